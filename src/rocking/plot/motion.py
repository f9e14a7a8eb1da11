"""A ground acceleration over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rocking.arrays import Floats
from rocking.plot.style import GROUND, INK, STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def motion_figure(*, time: Floats, acceleration_g: Floats, title: str, ax: Axes | None = None) -> Axes:
    """Draw a ground acceleration over time.

    Parameters
    ----------
    time, acceleration_g : ndarray, shape (n,)
        Times (s) and ground acceleration (g), joined by straight lines.
    title : str
        Title of the axes.
    ax : matplotlib.axes.Axes, optional
        Where to draw; by default in a new figure, which no global state knows of.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import numpy as np
    >>> axes = motion_figure(time=np.array([0.0, 1.0]), acceleration_g=np.array([0.1, -0.2]), title="line")
    >>> axes.get_ylabel(), axes.get_xlim()
    ('ground acceleration (g)', (np.float64(0.0), np.float64(1.0)))
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        axes = Figure(figsize=(7.6, 2.4), layout="constrained").add_subplot() if ax is None else ax
        axes.axhline(0.0, color=INK, linewidth=0.4)
        axes.plot(time, acceleration_g, color=GROUND, linewidth=0.8)
        axes.set(xlabel="time (s)", ylabel="ground acceleration (g)", title=title, xlim=(time[0], time[-1]))
    return axes
