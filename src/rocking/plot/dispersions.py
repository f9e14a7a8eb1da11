"""Dispersions of intensity measures, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rocking.arrays import Floats
from rocking.plot.canvas import add_labels, add_title, figure_for
from rocking.plot.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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
    """Draw a dispersion with its interval for each measure, one below the other.

    Parameters
    ----------
    names : sequence of str
        Measures.
    dispersion, low, high : ndarray, shape (n,)
        Standard deviation of the logarithm of the intensity at overturning, and the ends of its interval.
    title : str
        Text.
    ax : matplotlib.axes.Axes, optional
        Where to draw.
    figsize : (float, float), optional
        Width and height of a new figure, inches.
    """
    with figure_for(ax, (5.6, 0.8 + 0.32 * len(names)), figsize) as figure:
        axes = ax or figure.add_subplot()
        row = np.arange(len(names))
        axes.hlines(row, low, high, color=INK, linewidth=1.0)
        axes.plot(dispersion, row, color=INK, linestyle="none", marker="o", markersize=4.5)
        axes.set_yticks(row, list(names))
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_xlim(left=0.0)
        axes.grid(axis="x", linewidth=0.4, color="0.85")
        add_labels(axes, "dispersion of the intensity at overturning (90 % interval)", "")
        add_title(figure, ax, title)
    return figure
