"""Histories under a sine: the excitation with its thresholds, and responses by several schemes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from rocking.plot.style import ABOVE, GROUND, INK, STYLE, FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: How responses are told apart, in colour and in grey: the first is a broad line below all others.
_SCHEMES: Final[tuple[dict[str, Any], ...]] = (
    {"color": GROUND, "linewidth": 3.0},
    {"color": INK, "linewidth": 1.1},
    {"color": ABOVE, "linewidth": 1.3, "linestyle": (0, (4, 2))},
    {"color": "#3c6aa0", "linewidth": 1.4, "linestyle": (0, (1, 1))},
)


class Detail(NamedTuple):
    """What an inset magnifies: limits of time and rotation, and where it lies (axes fractions)."""

    time: tuple[float, float]
    rotation: tuple[float, float]
    place: tuple[float, float, float, float]


class Mark(NamedTuple):
    """An instant that is marked, with a text to the left of it."""

    time: float
    text: str


def excitation_figure(
    *, time: FloatArray, acceleration: FloatArray, uplifts: FloatArray, rest: float, title: str
) -> Figure:
    """Draw a sine with the thresholds, its exceedances, the first two initiations and the time to the first rest.

    Parameters
    ----------
    time, acceleration : ndarray, shape (n,)
        Time over the period and ground acceleration over g alpha.
    uplifts : ndarray
        Times at which a resting block is lifted, over the period.
    rest : float
        Time of the first rest, over the period.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 2.9), layout="constrained")
        axes = figure.add_subplot()
        _draw_excitation(axes, time, acceleration)
        for at, text in zip(uplifts, ("1st initiation", "2nd initiation"), strict=False):
            _mark(axes, Mark(float(at), text), 1.08)
        first, second = uplifts[:2]
        for end, height, text in ((rest, 0.0, r"$\tau_{ch}$"), (second, -0.45, "$T/2$")):
            axes.annotate("", (end, height), (first, height), arrowprops={"arrowstyle": "<->", "linewidth": 0.8})
            axes.annotate(
                text, (0.5 * (first + end), height), xytext=(0, 2), textcoords="offset points", ha="center", va="bottom"
            )
        axes.plot([rest, rest], [-0.75, 0.1], color=ABOVE, linewidth=0.9, linestyle=(0, (4, 2)))
        axes.annotate("at rest", (rest, -0.75), xytext=(-3, 0), textcoords="offset points", ha="right", color=ABOVE)
        axes.set_ylim(-1.35, 1.45)
        axes.set_xlim(time[0], time[-1])
        axes.set_title(title, loc="left")
        axes.set_xlabel("time over period, $t/T$")
        axes.legend(loc="upper right", ncols=2)
    return figure


def history_figure(
    *,
    time: FloatArray,
    rotations: Mapping[str, FloatArray],
    acceleration: FloatArray,
    limits: tuple[float, float],
    detail: Detail,
    marks: tuple[Mark, ...],
    title: str,
) -> Figure:
    """Draw responses by one or several schemes, an inset on what matters, and the excitation below.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Time over the period.
    rotations : mapping of str to ndarray, shape (n,)
        Rotation over slenderness by each scheme, the reference first.
    acceleration : ndarray, shape (n,)
        Ground acceleration over g alpha.
    limits : tuple of float
        Limits of the rotation's axis.
    detail : Detail
        What the inset shows.
    marks : tuple of Mark
        Instants to mark.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 4.6), layout="constrained")
        response, excitation = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
        _draw_responses(response, time, rotations)
        response.set_xlim(time[0], time[-1])
        response.set_ylim(*(1e3 * limit for limit in limits))
        response.set_ylabel(r"rotation, $10^3\,\theta/\alpha$")
        response.set_title(title, loc="left")
        for mark in marks:
            _mark(response, mark, 0.0)
        inset = response.inset_axes(detail.place)
        _draw_responses(inset, time, rotations)
        inset.set_xlim(*detail.time)
        inset.set_ylim(*(1e3 * limit for limit in detail.rotation))
        inset.tick_params(labelsize=7)
        for spine in inset.spines.values():
            spine.set_visible(True)
        response.indicate_inset_zoom(inset, edgecolor=INK, linewidth=0.6)
        _draw_excitation(excitation, time, acceleration)
        excitation.set_xlabel("time over period, $t/T$")
        figure.legend(*response.get_legend_handles_labels(), loc="outside lower center", ncols=len(rotations))
    return figure


def _draw_responses(axes: Axes, time: FloatArray, rotations: Mapping[str, FloatArray]) -> None:
    axes.axhline(0.0, color=INK, linewidth=0.4)
    for (name, rotation), style in zip(rotations.items(), _SCHEMES, strict=False):
        axes.plot(time, 1e3 * rotation, label=name, **style)


def _draw_excitation(axes: Axes, time: FloatArray, acceleration: FloatArray) -> None:
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, acceleration, color=GROUND, linewidth=1.2, label="ground acceleration")
    beyond: dict[str, Any] = {"color": ABOVE, "linewidth": 0.9, "interpolate": True, "zorder": 3}
    axes.fill_between(time, acceleration, 1.0, where=acceleration > 1.0, **beyond)
    axes.fill_between(time, acceleration, -1.0, where=acceleration < -1.0, **beyond)
    for threshold, label in ((1.0, "uplift thresholds"), (-1.0, None)):
        axes.axhline(threshold, color=INK, linewidth=0.8, linestyle=(0, (5, 2)), label=label)
    axes.set_ylabel(r"$\ddot u_g / (g\alpha)$")


def _mark(axes: Axes, mark: Mark, height: float) -> None:
    axes.plot(mark.time, height, "^", color=ABOVE, markersize=5.0, markeredgewidth=0.0, zorder=4)
    axes.annotate(
        mark.text,
        (mark.time, height),
        xytext=(-4, 4),
        textcoords="offset points",
        ha="right",
        color=ABOVE,
        fontsize=7.5,
    )
