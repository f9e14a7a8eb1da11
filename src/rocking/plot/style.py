"""Colours, dashes and sizes that all figures share."""

from __future__ import annotations

from typing import Any, Final

# Luminances differ, so that the figures read in grey as well.
INK: Final = "#10243e"
GROUND: Final = "#94a0ad"
REST: Final = "#e3e6ea"
ABOVE: Final = "#b0390c"

#: Curves of one figure: luminances differ, and so do the dashes.
CURVES: Final[tuple[dict[str, Any], ...]] = (
    {"color": INK, "linestyle": "-"},
    {"color": ABOVE, "linestyle": (0, (5, 1.5))},
    {"color": "#4d7ea8", "linestyle": (0, (1, 1))},
    {"color": "#b8860b", "linestyle": (0, (6, 1.5, 1, 1.5))},
)

STYLE: Final[dict[Any, Any]] = {
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.5,
    "figure.titlesize": 9.0,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "grid.color": REST,
    "grid.linewidth": 0.6,
    "hatch.linewidth": 0.4,
    "legend.fontsize": 7.5,
    "legend.handlelength": 1.5,
    "legend.handletextpad": 0.5,
    "legend.columnspacing": 1.0,
    "legend.frameon": False,
}
