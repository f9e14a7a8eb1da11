"""Periodic orbits in the phase plane and over time, branches of them along a parameter, and bifurcation diagrams."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.arrays import Flags, Floats
from rocking.plot.canvas import ABOVE, GROUND, INK, add_labels, add_legend, figure_for, handles_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: How stable and unstable orbits are drawn.
_STABLE: Final[dict[str, Any]] = {"color": INK, "linewidth": 1.4, "linestyle": "-"}
_UNSTABLE: Final[dict[str, Any]] = {"color": ABOVE, "linewidth": 1.2, "linestyle": (0, (4, 2))}

#: Marks of bifurcations by their names, and what marks others.
_MARKS: Final = {
    "fold": "o",
    "flip": "D",
    "symmetry breaking": "s",
    "branch point": "X",
    "grazing": "v",
    "loss of complete chattering": "^",
    "start of rest": "<",
    "uplift": ">",
}
_OTHER: Final = "P"


def orbit_figure(
    *,
    time: Floats,
    coordinate: Floats,
    velocity: Floats,
    impact_times: Floats,
    states: Floats,
    labels: tuple[str, str],
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw a periodic orbit: velocity against coordinate with its impacts, and the coordinate over time.

    Times are in periods of the motion, with one just before and one at each impact; `states` are those at the starts of
    periods; `labels` name coordinate and velocity. In `ax`, the phase plane is drawn alone.
    """
    with figure_for(ax, (7.0, 3.2), figsize, title) as figure:
        plane, history = (ax, None) if ax is not None else figure.subplots(1, 2)
        # Arcs end at impacts: a jump of the velocity is no part of the course.
        at = np.searchsorted(time, impact_times, side="right") - 1  # division may have made two times one
        x, v = (np.insert(each, at, np.nan) for each in (coordinate, velocity))
        plane.plot(x, v, label="orbit", **_STABLE)
        before = np.maximum(at - 1, 0)
        for k, (first, second) in enumerate(zip(before, np.minimum(at, len(time) - 1), strict=True)):
            look: dict[str, Any] = {
                "color": ABOVE,
                "linewidth": 0.8,
                "linestyle": (0, (1, 1.5)),
                "label": "impact" if k == 0 else None,
            }
            plane.plot(coordinate[[first, second]], velocity[[first, second]], **look)
        start: dict[str, Any] = {
            "color": INK,
            "markersize": 5.0,
            "markerfacecolor": "white",
            "label": "start of a period",
        }
        plane.plot(states[:, 0], states[:, 1], "o", zorder=4, **start)
        add_labels(plane, *labels)
        if history is not None:
            history.plot(time, coordinate, **_STABLE)
            heights = np.interp(impact_times, time, coordinate)
            history.plot(impact_times, heights, "|", color=ABOVE, markersize=8.0, markeredgewidth=1.0)
            history.set_xlim(time[0], time[-1])
            add_labels(history, "time (periods of the motion)", labels[0])
        add_legend(figure, ax, handles_of(plane))
    return figure


def branch_figure(
    *,
    values: Floats,
    heights: Floats,
    stable: Flags,
    marks: Sequence[tuple[str, float, float]],
    labels: tuple[str, str],
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw branches of periodic orbits: stable ones as full lines, unstable ones dashed, and bifurcations by marks.

    A value that is not a number parts a branch from the next. `marks` are names of bifurcations, with the parameter and
    the height there.
    """
    with figure_for(ax, (5.2, 3.6), figsize, title) as figure:
        axes = figure.add_subplot() if ax is None else ax
        for chosen, name, style in ((stable, "stable", _STABLE), (~stable, "unstable", _UNSTABLE)):
            # Dashes reach to the points where full lines begin.
            joined = chosen | np.append(chosen[1:], False) | np.insert(chosen[:-1], 0, False)
            shown = chosen if name == "stable" else joined
            if np.any(chosen & ~np.isnan(values)):
                axes.plot(np.where(shown, values, np.nan), np.where(shown, heights, np.nan), label=name, **style)
        look: dict[str, Any] = {
            "color": INK,
            "markersize": 4.5,
            "markerfacecolor": GROUND,
            "linestyle": "",
            "zorder": 4,
        }
        for kind in dict.fromkeys(name for name, _, _ in marks):
            at = np.array([(value, height) for name, value, height in marks if name == kind])
            axes.plot(at[:, 0], at[:, 1], marker=_MARKS.get(kind, _OTHER), label=kind, **look)
        axes.margins(x=0.04, y=0.06)
        add_labels(axes, *labels)
        add_legend(figure, ax, handles_of(axes))
    return figure


#: Colour of each way through the values, and area of its marks, points squared; of two the first is the larger, so that
#: the second is seen on it, and the first around it.
_LOOKS: Final = ((INK, 4.0), (ABOVE, 0.9))
_ALONE: Final = ((INK, 0.9),)

_WORDS: Final = {"up": "values going up", "down": "values going down", "afresh": "each value afresh"}


def bifurcation_figure(
    *,
    value: Floats,
    states: Mapping[str, Floats],
    overturned: Flags,
    not_followed: Flags | None = None,
    x_label: str,
    y_label: str,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw states, shape (len(value), n), of each direction against a parameter; NaN where there is none.

    Where nothing is left, marks at the lower edge say whether the body overturned or could not be followed.
    """
    from matplotlib.lines import Line2D

    with figure_for(ax, (5.6, 3.8), figsize, title) as figure:
        axes = ax or figure.add_subplot()
        handles: list[Artist] = []
        looks = _ALONE if len(states) == 1 else _LOOKS
        for (way, kept), (colour, area) in zip(states.items(), looks, strict=True):
            x = np.broadcast_to(value[:, None], kept.shape).ravel()
            axes.scatter(x, kept.ravel(), s=area, marker="o", color=colour, linewidths=0.0, rasterized=True)
            size = area**0.5 + 1.0
            handles.append(Line2D([], [], linestyle="", marker="o", color=colour, markersize=size, label=_WORDS[way]))
        for gone, marker, label in ((overturned, "|", "overturned"), (not_followed, "x", "not followed")):
            if gone is None or not gone.any():
                continue
            places = value[gone]
            look: dict[str, Any] = {"linestyle": "", "marker": marker, "color": GROUND}
            axes.plot(places, np.full(places.size, 0.015), transform=axes.get_xaxis_transform(), **look)
            handles.append(Line2D([], [], label=label, **look))
        axes.set_xlim(value[0], value[-1] if value.size > 1 else None)
        add_labels(axes, x_label, y_label)
        add_legend(figure, ax, handles)
    return figure
