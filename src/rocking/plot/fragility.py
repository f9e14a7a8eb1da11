"""Fragility curves, and dispersions of intensity measures side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.plot.canvas import CURVES, GROUND, INK, add_labels, add_legend, figure_for, handles_of
from rocking.tables import as_written

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DOT: Final[dict[str, Any]] = {"markersize": 4.0, "markerfacecolor": "none"}


class FragilityLine(NamedTuple):
    """A fitted curve with its confidence band, and the shares seen among outcomes of about one intensity.

    seen_at, seen (groups,) : mean intensity of each group of outcomes, and the share of them that exceeds the limit
    outcomes (groups,) : how many outcomes a group has
    """

    label: str
    intensity: Floats
    probability: Floats
    lower: Floats
    upper: Floats
    seen_at: Floats
    seen: Floats
    outcomes: Floats


def fragility_figure(
    *,
    lines: Sequence[FragilityLine],
    intensity_label: str,
    band_label: str,
    probability_label: str = "probability",
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw fitted fragility curves with their confidence bands, and the shares that were seen.

    `band_label` says what the bands are, or why there is none.
    """
    with figure_for(ax, (5.6, 4.2), figsize, title) as figure:
        axes = ax or figure.add_subplot()
        for k, line in enumerate(lines):
            style = CURVES[k % len(CURVES)]
            axes.fill_between(line.intensity, line.lower, line.upper, color=style["color"], alpha=0.18, linewidth=0.0)
            axes.plot(line.intensity, line.probability, linewidth=1.5, label=as_written(line.label), **style)
            # Every limit state has a mark of its own.
            axes.plot(line.seen_at, line.seen, "os^D"[k % 4], color=style["color"], clip_on=False, **_DOT)
        if any(np.any(line.lower < line.upper) for line in lines):
            axes.fill_between([], [], [], color=GROUND, alpha=0.4, linewidth=0.0, label=band_label)
        else:
            axes.plot([], [], linestyle="none", label=band_label)
        axes.plot([], [], "o", color=GROUND, label=_dots(lines), **_DOT)
        axes.set(xlim=(0.0, float(lines[0].intensity[-1])), ylim=(0.0, 1.0))
        axes.grid(True)
        add_labels(axes, intensity_label, probability_label)
        add_legend(figure, ax, handles_of(axes))
    return figure


def dispersions_figure(
    *,
    names: Sequence[str],
    dispersion: Floats,
    low: Floats,
    high: Floats,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw the dispersion of the intensity at overturning, with its interval, for each measure by name."""
    with figure_for(ax, (5.6, 0.8 + 0.32 * len(names)), figsize, title) as figure:
        axes = ax or figure.add_subplot()
        row = np.arange(len(names))
        axes.hlines(row, low, high, color=INK, linewidth=1.0)
        axes.plot(dispersion, row, color=INK, linestyle="none", marker="o", markersize=4.5)
        axes.set_yticks(row, list(names))
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_xlim(left=0.0)
        axes.grid(axis="x", linewidth=0.4, color="0.85")
        add_labels(axes, "dispersion of the intensity at overturning (90 % interval)", "")
    return figure


def _dots(lines: Sequence[FragilityLine]) -> str:
    """Say what one dot pools."""
    held = np.concatenate([line.outcomes for line in lines])
    fewest, most = round(float(held.min())), round(float(held.max()))
    count = f"{fewest}" if fewest == most else f"{fewest} to {most}"
    return f"dot: share of {count} outcome{'' if most == 1 else 's'} at about its intensity"
