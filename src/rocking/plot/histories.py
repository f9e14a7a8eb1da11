"""Histories under a sine: the excitation with its thresholds, and responses by several schemes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from rocking.arrays import Floats
from rocking.plot.canvas import add_title, figure_for
from rocking.plot.style import ABOVE, GROUND, INK

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
    """What an inset magnifies: limits of time and rotation, and where it lies (axes fractions)."""

    time: tuple[float, float]
    rotation: tuple[float, float]
    place: tuple[float, float, float, float]


class Mark(NamedTuple):
    """An instant that is marked, with a text above it."""

    time: float
    text: str


def excitation_figure(
    *, time: Floats, acceleration: Floats, marks: tuple[Mark, ...], rest: float, title: str, ax: Axes | None = None
) -> Figure:
    """Draw a sine with the thresholds, its exceedances, the first two initiations and the time to the first rest.

    Parameters
    ----------
    time, acceleration : ndarray, shape (n,)
        Time over the period and ground acceleration over g alpha.
    marks : tuple of Mark, length 2
        The first two initiations.
    rest : float
        Time of the first rest, over the period.
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
        _mark_initiations(axes, marks)
        first, second = (mark.time for mark in marks)
        for end, height, text in ((rest, 0.0, r"$\tau_{ch}$"), (second, -0.45, "$T/2$")):
            axes.annotate("", (end, height), (first, height), arrowprops={"arrowstyle": "<->", "linewidth": 0.8})
            axes.annotate(
                text, (0.5 * (first + end), height), xytext=(0, 2), textcoords="offset points", ha="center", va="bottom"
            )
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
    from matplotlib.ticker import MaxNLocator

    with figure_for(None, (7.0, 4.6)) as figure:
        response, excitation = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
        _draw_responses(response, time, rotations)
        response.set_xlim(time[0], time[-1])
        response.set_ylim(*(1e3 * limit for limit in limits))
        response.set_ylabel(r"rotation, $10^3\,\theta/\alpha$")
        add_title(figure, None, title)
        highest = 1e3 * max(float(rotation.max()) for rotation in rotations.values())
        response.set_yticks([tick for tick in response.get_yticks() if 1e3 * limits[0] <= tick <= highest])
        response.plot([mark.time for mark in marks], [0.0] * len(marks), "^", **_MARK)
        inset = response.inset_axes(detail.place)
        _draw_responses(inset, time, rotations)
        inset.set_xlim(*detail.time)
        inset.set_ylim(*(1e3 * limit for limit in detail.rotation))
        inset.tick_params(labelsize=7)
        inset.yaxis.tick_right()
        inset.xaxis.set_major_locator(MaxNLocator(6))
        for spine in inset.spines.values():
            spine.set_visible(True)
        response.indicate_inset_zoom(inset, edgecolor=INK, linewidth=0.6, zorder=0.5)
        _draw_excitation(excitation, time, acceleration)
        _mark_initiations(excitation, marks)
        excitation.set_xlabel("time over period, $t/T$")
        figure.legend(*response.get_legend_handles_labels(), loc="outside lower center", ncols=len(rotations))
    return figure


def _draw_responses(axes: Axes, time: Floats, rotations: Mapping[str, Floats]) -> None:
    axes.axhline(0.0, color=INK, linewidth=0.4)
    for (name, rotation), style in zip(rotations.items(), _SCHEMES, strict=False):
        axes.plot(time, 1e3 * rotation, label=name, **style)


def _draw_excitation(axes: Axes, time: Floats, acceleration: Floats) -> None:
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, acceleration, color=GROUND, linewidth=1.2, label="ground acceleration")
    beyond: dict[str, Any] = {"color": ABOVE, "linewidth": 0.9, "interpolate": True, "zorder": 3}
    axes.fill_between(time, acceleration, 1.0, where=acceleration > 1.0, **beyond)
    axes.fill_between(time, acceleration, -1.0, where=acceleration < -1.0, **beyond)
    for threshold, label in ((1.0, "uplift thresholds"), (-1.0, None)):
        axes.axhline(threshold, color=INK, linewidth=0.8, linestyle=(0, (5, 2)), label=label)
    axes.set_ylabel(r"$\ddot u_g / (g\alpha)$")


def _mark_initiations(axes: Axes, marks: tuple[Mark, ...]) -> None:
    axes.set_ylim(-1.35, 1.75)
    axes.set_yticks([-1.0, 0.0, 1.0])
    for mark in marks:
        axes.plot(mark.time, 1.12, "v", **_MARK)
        axes.annotate(
            mark.text,
            (mark.time, 1.12),
            xytext=(0, 4),
            textcoords="offset points",
            ha="center",
            color=ABOVE,
            fontsize=7.5,
        )
