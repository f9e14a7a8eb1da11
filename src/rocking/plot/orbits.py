"""Periodic orbits, their branches, bifurcation diagrams, and intervals between impacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Unpack

import numpy as np

from rocking.core.arrays import Flags, Floats, Integers
from rocking.plot.canvas import ACCENT, GREY, INK, FigureOptions, add_labels, add_ticks, open_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Line styles of stable and unstable orbits.
_STABLE_STYLE: Final[dict[str, Any]] = {"color": INK, "linewidth": 1.4, "linestyle": "-"}
_IMPACT_STYLE: Final[dict[str, Any]] = {"color": ACCENT, "linewidth": 0.8, "linestyle": (0, (1, 1.5))}
_UNSTABLE_STYLE: Final[dict[str, Any]] = {"color": ACCENT, "linewidth": 1.2, "linestyle": (0, (4, 2))}

#: Markers of bifurcations by name, and of other bifurcations.
_MARKERS: Final = {
    "fold": "o",
    "flip": "D",
    "symmetry breaking": "s",
    "branch point": "X",
    "grazing": "v",
    "loss of complete chattering": "^",
    "start of rest": "<",
    "uplift": ">",
}
_OTHER_MARKER: Final = "P"
_BIFURCATION_STYLE: Final[Any] = {"color": INK, "markersize": 4.5, "mfc": GREY, "linestyle": "", "zorder": 4}


def draw_orbit(
    *,
    time: Floats,
    coordinate: Floats,
    velocity: Floats,
    impact_times: Floats,
    states: Floats,
    labels: tuple[str, str],
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw a periodic orbit: velocity against coordinate with its impacts, and coordinate against time."""
    with open_page((7.0, 3.2), **options) as page:
        plane, *histories = page.create_panels("AB")
        # Arcs end at impacts, so that no line is drawn across a jump of the velocity.
        indices = np.searchsorted(time, impact_times, side="right") - 1  # two times may be equal after division
        x, v = (np.insert(values, indices, np.nan) for values in (coordinate, velocity))
        plane.plot(x, v, label="orbit", **_STABLE_STYLE)
        previous = np.maximum(indices - 1, 0)
        for k, jump in enumerate(np.column_stack([previous, np.minimum(indices, len(time) - 1)])):
            plane.plot(coordinate[jump], velocity[jump], label="" if k else "impact", **_IMPACT_STYLE)
        plane.plot(*states.T, "o", color=INK, markersize=5.0, mfc="white", label="start of a period", zorder=4)
        add_labels(plane, *labels)
        for history in histories:
            history.plot(time, coordinate, **_STABLE_STYLE)
            heights = np.interp(impact_times, time, coordinate)
            history.plot(impact_times, heights, "|", color=ACCENT, markersize=8.0, markeredgewidth=1.0)
            history.set_xlim(time[0], time[-1])
            add_labels(history, "time (periods of the motion)", labels[0])
    return page.figure


def draw_branches(
    *,
    values: Floats,
    heights: Floats,
    stable: Flags,
    marks: Sequence[tuple[str, float, float]],
    labels: tuple[str, str],
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw branches of periodic orbits: stable ones solid, unstable ones dashed, bifurcations as markers."""
    with open_page((5.2, 3.6), **options) as page:
        (axes,) = page.create_panels()
        for is_branch, name, style in ((stable, "stable", _STABLE_STYLE), (~stable, "unstable", _UNSTABLE_STYLE)):
            # Dashes extend to the points where solid lines begin.
            is_joined = is_branch | np.append(is_branch[1:], False) | np.insert(is_branch[:-1], 0, False)
            is_shown = is_branch if name == "stable" else is_joined
            if np.any(is_branch & ~np.isnan(values)):
                axes.plot(np.where(is_shown, values, np.nan), np.where(is_shown, heights, np.nan), label=name, **style)
        for kind in dict.fromkeys(name for name, _, _ in marks):
            points = np.array([(value, height) for name, value, height in marks if name == kind])
            axes.plot(*points.T, marker=_MARKERS.get(kind, _OTHER_MARKER), label=kind, **_BIFURCATION_STYLE)
        axes.margins(x=0.04, y=0.06)
        add_labels(axes, *labels)
    return page.figure


#: Colour and marker area (points squared) of each sweep direction. The first of two is larger, so that both are
#: visible.
_SWEEP_STYLES: Final = ((INK, 4.0), (ACCENT, 0.9))
_SINGLE_SWEEP_STYLE: Final = ((INK, 0.9),)

_SWEEP_LABELS: Final = {"up": "values going up", "down": "values going down", "afresh": "each value afresh"}


def draw_bifurcation(
    *,
    value: Floats,
    states: Mapping[str, Floats],
    overturned: Flags,
    not_followed: Flags | None = None,
    x_label: str,
    y_label: str,
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw states, shape (len(value), n), of each direction against a parameter; NaN if there are fewer."""
    with open_page((5.6, 3.8), **options) as page:
        (axes,) = page.create_panels()
        styles = _SINGLE_SWEEP_STYLE if len(states) == 1 else _SWEEP_STYLES
        for (direction, branch_states), (colour, area) in zip(states.items(), styles, strict=True):
            style: dict[str, Any] = {"linestyle": "", "marker": "o", "color": colour, "markeredgewidth": 0.0}
            axes.plot(value, branch_states, markersize=area**0.5, rasterized=True, **style)
            axes.plot([], [], markersize=area**0.5 + 1.0, label=_SWEEP_LABELS[direction], **style)
        for is_marked, marker, label in ((overturned, "|", "overturned"), (not_followed, "x", "not followed")):
            if is_marked is not None and is_marked.any():
                add_ticks(axes, value[is_marked], 0.015, marker, color=GREY, label=label)
        axes.set_xlim(value[0], value[-1] if value.size > 1 else None)
        add_labels(axes, x_label, y_label)
    return page.figure


_DOT: Final[dict[str, Any]] = {"linestyle": "", "marker": "o", "color": INK, "markersize": 3.2, "markeredgewidth": 0.6}

#: Margin beside the first and the last impact, relative to their number.
_AXIS_MARGIN: Final = 0.03


def draw_intervals(*, intervals: Floats, eta: float, **options: Unpack[FigureOptions]) -> Figure:
    """Draw the dimensionless intervals between the impacts of a chattering sequence, and ratios of every second one."""
    from matplotlib.ticker import MaxNLocator

    with open_page((7.0, 3.2), **options) as page:
        # Panels are side by side if the figure is wider than high.
        panels = page.create_panels("AB" if page.figure.get_figwidth() > page.figure.get_figheight() else "A;B")
        number = np.arange(1, intervals.size + 1)
        margin = max(0.5, _AXIS_MARGIN * intervals.size)
        _draw_sides(panels[0], number, intervals)
        add_labels(panels[0], "impact", "interval before the impact, p t")
        if intervals.size:
            panels[0].set_yscale("log")
        for panel in panels[1:]:
            _draw_sides(panel, number[2:], intervals[2:] / intervals[:-2])
            panel.axhline(eta**2, color=ACCENT, linewidth=1.2, linestyle=(0, (5, 1.5)), label=f"η² = {eta**2:.5g}")
            add_labels(panel, "impact", "interval over that two impacts before")
        for panel in panels:
            panel.grid(True)
            if intervals.size:
                panel.set_xlim(1.0 - margin, intervals.size + margin)
                panel.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    return page.figure


def _draw_sides(axes: Axes, number: Integers, values: Floats) -> None:
    """Draw values against the impact number, with filled markers on the first side and open ones on the second."""
    axes.plot(number, values, color=INK, linewidth=0.4, alpha=0.6, label="_in turn")
    for remainder, face, label in ((1, INK, "impacts 1, 3, ..."), (0, "white", "impacts 2, 4, ...")):
        is_selected = number % 2 == remainder
        if is_selected.any():
            axes.plot(number[is_selected], values[is_selected], markerfacecolor=face, label=label, **_DOT)
