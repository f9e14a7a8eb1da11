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
    vertical_g: Floats | None = None,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw a ground acceleration over time.

    Parameters
    ----------
    time, acceleration_g : ndarray, shape (n,)
        Times (s) and ground acceleration (g), joined by straight lines.
    vertical_g : ndarray, shape (n,), optional
        Vertical ground acceleration (g), which has a panel of its own.
    title : str
        Title of the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw the horizontal acceleration alone; by default in a new figure.
    figsize : (float, float), optional
        Width and height of a new figure, inches; by default 7 by 2.4, or 4.2 with a vertical acceleration.

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
    traces = {"ground acceleration (g)": acceleration_g}
    if vertical_g is not None and ax is None:
        traces["vertical acceleration (g)"] = vertical_g
    with figure_for(ax, (7.0, 0.6 + 1.8 * len(traces)), figsize) as figure:
        panels = [ax] if ax else figure.subplots(len(traces), 1, sharex=True, squeeze=False)[:, 0].tolist()
        for axes, (label, trace) in zip(panels, traces.items(), strict=True):
            axes.axhline(0.0, color=INK, linewidth=0.4)
            axes.plot(time, trace, color=GROUND, linewidth=0.8)
            axes.set_xlim(time[0], time[-1])
            add_labels(axes, "time (s)" if axes is panels[-1] else "", label)
        add_title(figure, ax, title)
    return figure
