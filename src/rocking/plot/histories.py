"""Histories under a sine: the excitation with its thresholds, and responses by several schemes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from rocking.arrays import Floats
from rocking.plot.canvas import add_legend, add_title, figure_for, labelled, magnified
from rocking.plot.style import ABOVE, GROUND, INK, REST

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: How responses are told apart, in colour and in grey: the first is a broad line below all others.
_SCHEMES: Final[tuple[dict[str, Any], ...]] = (
    {"color": GROUND, "linewidth": 3.0},
    {"color": INK, "linewidth": 1.1},
    {"color": ABOVE, "linewidth": 1.3, "linestyle": (0, (4, 2))},
    {"color": "#3c6aa0", "linewidth": 1.8, "linestyle": (0, (1, 1))},
)


_MARK: Final[dict[str, Any]] = {"color": ABOVE, "markersize": 4.5, "markeredgewidth": 0.0, "zorder": 4}


class Detail(NamedTuple):
    """What is magnified: limits of time and rotation."""

    time: tuple[float, float]
    rotation: tuple[float, float]


class Mark(NamedTuple):
    """An instant that is marked, with a text above it."""

    time: float
    text: str


def excitation_figure(
    *,
    time: Floats,
    acceleration: Floats,
    marks: tuple[Mark, ...],
    chattering_time: float,
    title: str,
    ax: Axes | None = None,
) -> Figure:
    """Draw a sine with the thresholds, its exceedances, the initiations and the time to the first rest.

    Parameters
    ----------
    time, acceleration : ndarray, shape (n,)
        Time over the period and ground acceleration over g alpha.
    marks : tuple of Mark
        The first one or two initiations.
    chattering_time : float
        Time from the first initiation to rest, over the period; NaN where chattering is incomplete.
    title : str
        Title of the figure.
    ax : matplotlib.axes.Axes, optional
        Where to draw.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with figure_for(ax, (7.0, 2.9)) as figure:
        axes = ax or figure.add_subplot()
        _draw_excitation(axes, time, acceleration)
        _mark_initiations(axes, marks, float(acceleration.max()))
        first = marks[0].time
        rest = first + chattering_time
        for end, height, text in ((rest, 0.0, r"$\tau_{ch}$"), (first + 0.5, -0.45, "$T/2$")):
            if math.isnan(end):
                continue
            axes.annotate("", (end, height), (first, height), arrowprops={"arrowstyle": "<->", "linewidth": 0.8})
            axes.annotate(
                text, (0.5 * (first + end), height), xytext=(0, 2), textcoords="offset points", ha="center", va="bottom"
            )
        if not math.isnan(rest):
            axes.plot([rest, rest], [-0.75, 0.1], color=ABOVE, linewidth=0.9, linestyle=(0, (4, 2)))
            axes.annotate("at rest", (rest, -0.75), xytext=(-3, 0), textcoords="offset points", ha="right", color=ABOVE)
        axes.set_xlim(time[0], time[-1])
        add_title(figure, ax, title)
        axes.set_xlabel("time over period, $t/T$")
        axes.legend(loc="upper right", ncols=2, bbox_to_anchor=(1.0, 1.04))
    return figure


def history_figure(
    *,
    time: Floats,
    rotations: Mapping[str, Floats],
    acceleration: Floats,
    detail: Detail,
    marks: tuple[Mark, ...],
    title: str,
) -> Figure:
    """Draw responses by one or several schemes, the excitation below, and a detail of what matters below that.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Time over the period.
    rotations : mapping of str to ndarray, shape (n,)
        Rotation over slenderness by each scheme, the reference first.
    acceleration : ndarray, shape (n,)
        Ground acceleration over g alpha.
    detail : Detail
        What the last panel shows; its time is shaded in the first.
    marks : tuple of Mark
        Instants to mark.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with figure_for(None, (7.0, 5.6)) as figure:
        response, excitation, close = figure.subplots(3, 1, height_ratios=(1.5, 1.0, 1.2))
        response.axvspan(*detail.time, color=REST, label="the time of (c)")
        low = min(float(rotation.min()) for rotation in rotations.values())
        high = max(float(rotation.max()) for rotation in rotations.values())
        margin = 0.07 * (high - low)
        _draw_responses(response, time, rotations, (low - margin, high + margin))
        response.plot([mark.time for mark in marks], [0.0] * len(marks), "^", **_MARK)
        _draw_excitation(excitation, time, acceleration)
        _mark_initiations(excitation, marks, float(acceleration.max()))
        for axes in (response, excitation):
            axes.set_xlim(time[0], time[-1])
        response.tick_params(labelbottom=False)
        excitation.set_xlabel("time over period, $t/T$")
        _draw_responses(close, time, rotations, detail.rotation)
        close.set_xlim(*detail.time)
        close.set_xlabel("time over period, $t/T$")
        for letter, axes in zip("abc", (response, excitation, close), strict=True):
            axes.set_title(f"({letter})", loc="left", pad=3.0)
        add_title(figure, None, title)
        add_legend(figure, None, labelled(response, excitation))
    return figure


def _draw_responses(axes: Axes, time: Floats, rotations: Mapping[str, Floats], limits: tuple[float, float]) -> None:
    """Draw rotations between limits, all magnified by as much as these ask for."""
    scale, power = magnified(max(abs(limit) for limit in limits))
    axes.axhline(0.0, color=INK, linewidth=0.4)
    for (name, rotation), style in zip(rotations.items(), _SCHEMES, strict=False):
        axes.plot(time, scale * rotation, label=name, **style)
    axes.set_ylim(*(scale * limit for limit in limits))
    axes.set_ylabel(rf"rotation, {power}$\theta/\alpha$")


def _draw_excitation(axes: Axes, time: Floats, acceleration: Floats) -> None:
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, acceleration, color=GROUND, linewidth=1.2, label="ground acceleration")
    beyond: dict[str, Any] = {"color": ABOVE, "linewidth": 0.9, "interpolate": True, "zorder": 3}
    axes.fill_between(time, acceleration, 1.0, where=acceleration > 1.0, **beyond)
    axes.fill_between(time, acceleration, -1.0, where=acceleration < -1.0, **beyond)
    for threshold, label in ((1.0, "uplift thresholds"), (-1.0, None)):
        axes.axhline(threshold, color=INK, linewidth=0.8, linestyle=(0, (5, 2)), label=label)
    axes.set_ylabel(r"$\ddot u_g / (g\alpha)$")


def _mark_initiations(axes: Axes, marks: tuple[Mark, ...], peak: float) -> None:
    """Mark instants above the excitation, of this peak."""
    height = peak + 0.09
    axes.set_ylim(-peak - 0.32, height + 0.63)
    axes.set_yticks([-1.0, 0.0, 1.0])
    for mark in marks:
        axes.plot(mark.time, height, "v", **_MARK)
        axes.annotate(
            mark.text,
            (mark.time, height),
            xytext=(-4, 4),
            textcoords="offset points",
            color=ABOVE,
            fontsize=7.5,
        )
