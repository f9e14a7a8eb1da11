"""A ground acceleration over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rocking.arrays import Floats
from rocking.plot.canvas import add_labels, add_title, figure_for
from rocking.plot.style import GROUND, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def motion_figure(
    *,
    time: Floats,
    acceleration_g: Floats,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw a ground acceleration over time.

    Parameters
    ----------
    time, acceleration_g : ndarray, shape (n,)
        Times (s) and ground acceleration (g), joined by straight lines.
    title : str
        Title of the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; by default in a new figure.
    figsize : (float, float), optional
        Width and height of a new figure, inches; by default 7 by 2.4.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import numpy as np
    >>> figure = motion_figure(time=np.array([0.0, 1.0]), acceleration_g=np.array([0.1, -0.2]), title="line")
    >>> figure.axes[0].get_xlabel(), figure.axes[0].get_xlim()
    ('time (s)', (np.float64(0.0), np.float64(1.0)))
    """
    with figure_for(ax, (7.0, 2.4), figsize) as figure:
        axes = ax or figure.add_subplot()
        axes.axhline(0.0, color=INK, linewidth=0.4)
        axes.plot(time, acceleration_g, color=GROUND, linewidth=0.8)
        axes.set_xlim(time[0], time[-1])
        add_labels(axes, "time (s)", "ground acceleration (g)")
        add_title(figure, ax, title)
    return figure
