"""Rotation above the ground motion that caused it, with impacts, rests and one chattering sequence."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.plot.style import ABOVE, GROUND, INK, REST, STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Rotations beyond this multiple of the slenderness are cut: past it a block only falls.
LARGEST_RATIO_SHOWN: Final = 2.0


class DrawnSequence(NamedTuple):
    """One chattering sequence: the times of its impacts and the bracket on the time of rest, s."""

    impact_times: Floats
    rest_lower: float
    rest_upper: float


def response_figure(
    *,
    time: Floats,
    rotation_over_slenderness: Floats,
    impact_times: Floats,
    rest_intervals: Floats,
    uplift_times: Floats,
    overturn_time: float | None,
    motion_time: Floats,
    motion_acceleration_g: Floats,
    thresholds_g: tuple[float, float],
    chattering: DrawnSequence | None,
    title: str,
) -> Figure:
    """Draw a response above the ground motion that caused it.

    Parameters
    ----------
    time, rotation_over_slenderness : ndarray, shape (n,)
        Times (s) and signed rotation over slenderness; values beyond 2 are cut off by the axis.
    impact_times, uplift_times : ndarray
        Times of the impacts and of the uplifts, s.
    rest_intervals : ndarray, shape (k, 2)
        Start and end of each stretch at rest, s.
    overturn_time : float or None
        Time at which the block has fallen, s.
    motion_time, motion_acceleration_g : ndarray, shape (m,)
        Times (s) and ground acceleration (g); both empty for free rocking.
    thresholds_g : tuple of float
        Acceleration (g, a magnitude) that uplifts the block to side + and to side -; an acceleration
        of the opposite sign is needed, so the first is drawn below zero and the second above.
    chattering : DrawnSequence or None
        The sequence to zoom into: the interval to the next impact against the time to rest, both logarithmic.
        There is no zoom where the time of rest is not bracketed (NaN) or the sequence has a single impact.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        A figure that no global state knows of; save it with ``figure.savefig(path)``.

    Examples
    --------
    >>> import numpy as np
    >>> from rocking.plot import response_figure
    >>> t = np.linspace(0.0, 2.0, 201)
    >>> figure = response_figure(
    ...     time=t, rotation_over_slenderness=np.sin(t), impact_times=np.array([]),
    ...     rest_intervals=np.empty((0, 2)), uplift_times=np.array([0.0]), overturn_time=None,
    ...     motion_time=t, motion_acceleration_g=-0.4 * np.cos(t), thresholds_g=(0.2, 0.2),
    ...     chattering=None, title="A block")
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['rotation / slenderness', 'ground acceleration (g)']
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    zoom = chattering if chattering and _can_be_zoomed(chattering) else None
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.6, 4.6), layout="constrained")
        widths = (2.7, 1.0) if zoom else (1.0,)
        grid = figure.add_gridspec(2, len(widths), height_ratios=(1.2, 1.0), width_ratios=widths)
        rotation_axes = figure.add_subplot(grid[0, 0])
        motion_axes = figure.add_subplot(grid[1, 0], sharex=rotation_axes)
        figure.suptitle(title)

        _shade_rest(rotation_axes, rest_intervals)
        _draw_rotation(rotation_axes, time, rotation_over_slenderness)
        _mark_events(rotation_axes, impact_times, uplift_times, overturn_time)
        _draw_motion(motion_axes, motion_time, motion_acceleration_g, thresholds_g)
        _limit_time(rotation_axes, time, motion_time)
        if zoom:
            _mark_sequence(rotation_axes, zoom)
            _draw_sequence(figure.add_subplot(grid[:, 1]), zoom)
        _add_legend(figure, rotation_axes, motion_axes)
    return figure


def _can_be_zoomed(sequence: DrawnSequence) -> bool:
    return sequence.impact_times.size > 1 and math.isfinite(sequence.rest_upper - sequence.rest_lower)


def _shade_rest(axes: Axes, rest_intervals: Floats) -> None:
    for number, (start, end) in enumerate(rest_intervals):
        axes.axvspan(start, end, color=REST, linewidth=0.0, label="at rest" if number == 0 else None)


def _draw_rotation(axes: Axes, time: Floats, ratio: Floats) -> None:
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, ratio, color=INK, linewidth=0.9, label="rotation")
    lowest = max(float(np.min(ratio, initial=0.0)), -LARGEST_RATIO_SHOWN)
    highest = min(float(np.max(ratio, initial=0.0)), LARGEST_RATIO_SHOWN)
    span = (highest - lowest) or 1.0
    # Room below for the marks of the impacts and uplifts, above for the mark of the zoomed sequence.
    axes.set_ylim(lowest - 0.28 * span, highest + 0.15 * span)
    axes.set_ylabel("rotation / slenderness")
    axes.tick_params(labelbottom=False)


def _mark_events(axes: Axes, impact_times: Floats, uplift_times: Floats, overturn_time: float | None) -> None:
    rug = axes.get_xaxis_transform()
    if impact_times.size:
        axes.plot(
            impact_times,
            np.full(impact_times.size, 0.055),
            "|",
            color=INK,
            markersize=6,
            markeredgewidth=0.5,
            transform=rug,
            label=f"impacts ({impact_times.size})",
        )
    if uplift_times.size:
        axes.plot(
            uplift_times,
            np.full(uplift_times.size, 0.13),
            "^",
            color=ABOVE,
            markersize=4.5,
            markeredgewidth=0.0,
            transform=rug,
            label="uplift",
        )
    if overturn_time is not None:
        axes.axvline(
            overturn_time,
            color=ABOVE,
            linewidth=1.1,
            linestyle=(0, (1, 1)),
            label=f"overturns, {overturn_time:.3f} s",
        )


def _draw_motion(axes: Axes, time: Floats, acceleration: Floats, thresholds: tuple[float, float]) -> None:
    plus, minus = thresholds
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, acceleration, color=GROUND, linewidth=0.6, label="ground acceleration")
    above: dict[str, Any] = {"color": ABOVE, "linewidth": 0.9, "interpolate": True, "zorder": 3}
    axes.fill_between(time, acceleration, minus, where=acceleration > minus, label="beyond a threshold", **above)
    axes.fill_between(time, acceleration, -plus, where=acceleration < -plus, **above)
    axes.axhline(minus, color=INK, linewidth=0.8, linestyle=(0, (5, 2)), label="uplift thresholds")
    axes.axhline(-plus, color=INK, linewidth=0.8, linestyle=(0, (5, 2)))
    axes.set_ylabel("ground acceleration (g)")
    axes.set_xlabel("time (s)")


def _mark_sequence(axes: Axes, sequence: DrawnSequence) -> None:
    start, end = float(sequence.impact_times[0]), sequence.rest_upper
    axes.plot([start, end], [0.95, 0.95], "|-", color=ABOVE, linewidth=1.3, transform=axes.get_xaxis_transform())
    axes.annotate(
        "A",
        (0.5 * (start + end), 0.955),
        xycoords=axes.get_xaxis_transform(),
        xytext=(0, 2),
        textcoords="offset points",
        ha="center",
        va="bottom",
        color=ABOVE,
        fontweight="bold",
    )


def _draw_sequence(axes: Axes, sequence: DrawnSequence) -> None:
    rest = 0.5 * (sequence.rest_lower + sequence.rest_upper)
    start = sequence.impact_times[:-1]
    interval = np.diff(sequence.impact_times)
    # Where impacts lie closer than the spacing of floating point times, neither axis has a logarithm.
    shown = (interval > 0.0) & (rest > start)
    axes.loglog(
        rest - start[shown],
        interval[shown],
        "o",
        color=INK,
        markersize=2.6,
        markerfacecolor="white",
        markeredgewidth=0.6,
    )
    axes.invert_xaxis()
    axes.set_xlabel("time to rest (s)")
    axes.set_ylabel("interval to next impact (s)")
    axes.grid(color=REST, linewidth=0.6)
    axes.set_axisbelow(True)
    width = sequence.rest_upper - sequence.rest_lower
    axes.set_title(f"A: at rest at {rest:.6f} s,\nbracket {width:.0e} s wide", color=ABOVE, loc="left")


def _limit_time(axes: Axes, time: Floats, motion_time: Floats) -> None:
    start = min(np.min(time), np.min(motion_time, initial=np.inf))
    end = max(np.max(time), np.max(motion_time, initial=-np.inf))
    axes.set_xlim(float(start), float(end))


def _add_legend(figure: Figure, *panels: Axes) -> None:
    """Put one legend for all panels below them, where it can cover no data."""
    handles, labels = [], []
    for panel in panels:
        panel_handles, panel_labels = panel.get_legend_handles_labels()
        handles += panel_handles
        labels += panel_labels
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
