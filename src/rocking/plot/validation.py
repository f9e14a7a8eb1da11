"""Reliability diagram: how often what was predicted with a probability was observed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rocking.arrays import Floats
from rocking.plot.canvas import GROUND, INK, add_labels, add_legend, figure_for, handles_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def reliability_figure(
    *,
    predicted: Floats,
    observed: Floats,
    band_lower: Floats,
    band_upper: Floats,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw observed shares against predicted ones (bins,), with the bands of right predictions."""
    with figure_for(ax, (3.7, 3.7), figsize, title) as figure:
        axes = ax or figure.add_subplot()
        axes.plot([0.0, 1.0], [0.0, 1.0], color=GROUND, linewidth=0.8, linestyle=(0, (4, 2)))
        label = "90 % of what right predictions would show"
        axes.vlines(predicted, band_lower, band_upper, color=GROUND, linewidth=5.0, alpha=0.55, label=label)
        axes.plot(predicted, observed, "o-", color=INK, linewidth=0.9, markersize=4.0, clip_on=False, label="observed")
        axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
        axes.grid(True)
        add_labels(axes, "predicted probability of overturning", "share that overturned")
        add_legend(figure, ax, handles_of(axes))
    return figure
