"""Colours and sizes that all figures share."""

from __future__ import annotations

from typing import Any, Final

# Luminances differ, so that the figures read in grey as well.
INK: Final = "#10243e"
GROUND: Final = "#94a0ad"
REST: Final = "#e3e6ea"
ABOVE: Final = "#b0390c"

STYLE: Final[dict[Any, Any]] = {
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.5,
    "figure.titlesize": 9.5,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
}
