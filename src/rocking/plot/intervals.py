"""Intervals between the impacts of a chattering sequence, and their ratios."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.arrays import Floats, Integers
from rocking.plot.canvas import (
    ABOVE,
    INK,
    add_labels,
    add_legend,
    figure_for,
    handles_of,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DOTS: Final[dict[str, Any]] = {"linestyle": "", "marker": "o", "color": INK, "markersize": 3.2, "markeredgewidth": 0.6}

#: Up to so many intervals are joined by a line, which shows how they take turns.
_JOINED: Final = 100

#: Space beside the first and the last impact, over their number.
_MARGIN: Final = 0.03


def intervals_figure(
    *,
    intervals: Floats,
    eta: float,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw the dimensionless intervals between the impacts of a chattering sequence, and the ratios of every second.

    The first interval is that from the uplift; there may be none. The ratios of a complete sequence tend to eta^2. In
    `ax`, the intervals are drawn without the ratios.
    """
    from matplotlib.ticker import MaxNLocator

    with figure_for(ax, (7.0, 3.2), figsize, title) as figure:
        panels = _panels(figure) if ax is None else [ax]
        number = np.arange(1, intervals.size + 1)
        margin = max(0.5, _MARGIN * intervals.size)
        _draw(panels[0], number, intervals)
        add_labels(panels[0], "impact", "interval before the impact, p t")
        if intervals.size:
            panels[0].set_yscale("log")
        for panel in panels[1:]:
            _draw(panel, number[2:], intervals[2:] / intervals[:-2])
            panel.axhline(eta**2, color=ABOVE, linewidth=1.2, linestyle=(0, (5, 1.5)), label=f"η² = {eta**2:.5g}")
            add_labels(panel, "impact", "interval over that two impacts before")
        for panel in panels:
            panel.grid(True)
            if intervals.size:
                panel.set_xlim(1.0 - margin, intervals.size + margin)
                panel.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
        add_legend(figure, ax, handles_of(*panels))
    return figure


def _panels(figure: Figure) -> list[Axes]:
    """Make panels beside each other where the figure is wider than high, else below each other."""
    wide = figure.get_figwidth() > figure.get_figheight()
    panels: list[Axes] = figure.subplots(*((1, 2) if wide else (2, 1))).tolist()
    return panels


def _draw(axes: Axes, number: Integers, values: Floats) -> None:
    """Draw values by the number of the impact; those of the first side filled, those of the second open."""
    if values.size <= _JOINED:
        axes.plot(number, values, color=INK, linewidth=0.4, alpha=0.6, label="_in turn")
    for first, face, label in ((1, INK, "impacts 1, 3, ..."), (0, "white", "impacts 2, 4, ...")):
        chosen = number % 2 == first
        if chosen.any():
            axes.plot(number[chosen], values[chosen], markerfacecolor=face, label=label, **_DOTS)
    if not values.size:
        axes.annotate("no such impacts", (0.5, 0.7), xycoords="axes fraction", ha="center", color=INK)
        axes.set_xticks([])
