"""One block under a sine: a chattering sequence with its intervals and their ratios, responses by several schemes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.plot.canvas import (
    ACCENT,
    GREY,
    INK,
    PALE,
    add_legend,
    add_text,
    add_ticks,
    collect_handles,
    open_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: How responses are distinguished, in colour and in grey: the first is a broad line below all others.
_SCHEMES: Final[tuple[dict[str, Any], ...]] = (
    {"color": GREY, "linewidth": 3.0},
    {"color": INK, "linewidth": 1.1},
    {"color": ACCENT, "linewidth": 1.3, "linestyle": (0, (4, 2))},
    {"color": "#3c6aa0", "linewidth": 1.8, "linestyle": (0, (1, 1))},
)

#: Cycles that the details show: the first, and those after the impact with this number.
_FIRST_CYCLES: Final = 5
_LAST_CYCLES: Final = 5

#: Intervals shorter than this share of a detail have no name in it.
_NARROW: Final = 0.1

#: The line at which a block comes to rest, or to which ratios tend.
_LIMIT: Final[dict[str, Any]] = {"color": ACCENT, "linestyle": (0, (4, 2))}

_ARROW: Final = {
    "arrowstyle": "<->",
    "linewidth": 0.6,
    "color": INK,
    "shrinkA": 0.0,
    "shrinkB": 0.0,
    "mutation_scale": 6,
}
_MARK: Final[dict[str, Any]] = {"color": ACCENT, "markersize": 4.5, "markeredgewidth": 0.0, "zorder": 4}


def find_magnification(largest: float) -> tuple[float, str]:
    """Find a power of a thousand that scales values up to `largest`, and its words for a label."""
    power = 3 * max(0, math.ceil((-math.log10(largest) - 0.5) / 3.0)) if largest > 0.0 else 0
    return 10.0**power, f"$10^{{{power}}}$ " if power else ""


class Detail(NamedTuple):
    """What is magnified: limits of time and rotation."""

    time: tuple[float, float]
    rotation: tuple[float, float]


class Mark(NamedTuple):
    """An instant that is marked, with a text above it."""

    time: float
    text: str


def excitation_figure(
    *, time: Floats, acceleration: Floats, marks: tuple[Mark, ...], chattering_time: float, title: str
) -> Figure:
    """Draw a sine with the thresholds, its exceedances, the initiations and the time to the first rest.

    Times are over the period, accelerations over g alpha; `marks` are the first one or two initiations. The chattering
    time is NaN where chattering is incomplete.
    """
    with open_figure(None, (7.0, 2.9), title=title) as figure:
        axes = figure.add_subplot()
        _draw_excitation(axes, time, acceleration)
        _mark_initiations(axes, marks, float(acceleration.max()))
        first = marks[0].time
        rest = first + chattering_time
        for end, height, text in ((rest, 0.0, r"$\tau_{ch}$"), (first + 0.5, -0.45, "$T/2$")):
            if math.isnan(end):
                continue
            axes.annotate("", (end, height), (first, height), arrowprops={"arrowstyle": "<->", "linewidth": 0.8})
            add_text(axes, text, (0.5 * (first + end), height), (0, 2), ha="center", va="bottom")
        if not math.isnan(rest):
            axes.plot([rest, rest], [-0.75, 0.1], linewidth=0.9, **_LIMIT)
            add_text(axes, "at rest", (rest, -0.75), (-3, 0), ha="right", color=ACCENT)
        axes.set_xlim(time[0], time[-1])
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

    Times are over the period, rotations over the slenderness, the reference first, accelerations over g alpha. The time
    of the detail is shaded in the first panel.
    """
    with open_figure(None, (7.0, 5.6), title=title) as figure:
        response, excitation, close = figure.subplots(3, 1, height_ratios=(1.5, 1.0, 1.2))
        response.axvspan(*detail.time, color=PALE, label="the time of (c)")
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
        add_legend(figure, None, collect_handles(response, excitation))
    return figure


def _draw_responses(axes: Axes, time: Floats, rotations: Mapping[str, Floats], limits: tuple[float, float]) -> None:
    """Draw rotations between limits, all magnified by as much as these ask for."""
    scale, power = find_magnification(max(abs(limit) for limit in limits))
    axes.axhline(0.0, color=INK, linewidth=0.4)
    for (name, rotation), style in zip(rotations.items(), _SCHEMES, strict=False):
        axes.plot(time, scale * rotation, label=name, **style)
    axes.set_ylim(*(scale * limit for limit in limits))
    axes.set_ylabel(rf"rotation, {power}$\theta/\alpha$")


def _draw_excitation(axes: Axes, time: Floats, acceleration: Floats) -> None:
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, acceleration, color=GREY, linewidth=1.2, label="ground acceleration")
    beyond: dict[str, Any] = {"color": ACCENT, "linewidth": 0.9, "interpolate": True, "zorder": 3}
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
        add_text(axes, mark.text, (mark.time, height), (-4, 4), color=ACCENT, fontsize=7.5)


class Ratios(NamedTuple):
    """Ratios of intervals of one sequence, their limit, and what to write above them."""

    values: Floats
    limit: float
    title: str


def chattering_figure(
    *, time: Floats, rotation: Floats, impact_times: Floats, rest: float, late_impact: int, title: str
) -> Figure:
    """Draw a chattering sequence (a) with details of its first cycles (b) and of late ones (c).

    Times are p t since uplift, dense also between the late impacts; rotations are over the slenderness. The second
    detail starts at the impact with the index `late_impact`.
    """
    with open_figure(None, (7.0, 5.0), title=title) as figure:
        grid = figure.add_gridspec(2, 2)
        whole, first, last = (figure.add_subplot(place) for place in (grid[0, :], grid[1, 0], grid[1, 1]))
        _draw_whole(whole, time, rotation, impact_times, rest)
        early = np.append(0.0, impact_times[:_FIRST_CYCLES])
        _draw_cycles(first, time, rotation, early, 0)
        first.set_title("(b) first cycles", loc="left")
        first.set_xlabel(r"time since uplift, $\tau$")
        late = impact_times[late_impact : late_impact + _LAST_CYCLES + 1]
        scale, power = find_magnification(float(late[-1] - late[0]))
        _draw_cycles(last, scale * (time - late[0]), rotation, scale * (late - late[0]), late_impact + 1)
        last.set_title(rf"(c) cycles after impact {late_impact + 1}", loc="left")
        last.set_xlabel(rf"{power}$(\tau - \tau_{{{late_impact + 1}}})$")
    return figure


def _draw_whole(axes: Axes, time: Floats, rotation: Floats, impact_times: Floats, rest: float) -> None:
    scale, power = find_magnification(float(np.max(np.abs(rotation))))
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, scale * rotation, color=INK, linewidth=0.9)
    add_ticks(axes, impact_times, 0.06)
    axes.axvline(rest, linewidth=1.0, **_LIMIT)
    text, across = rf"at rest, $\tau_{{ch}}$ = {rest:.6f}", axes.get_xaxis_transform()
    add_text(axes, text, (rest, 0.3), (-6, 0), xycoords=across, ha="right", color=ACCENT)
    axes.set_xlim(0.0, 1.06 * rest)
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.18 * (high - low), high)
    axes.set_title("(a) the whole sequence, with its impacts as ticks", loc="left")
    axes.set_xlabel(r"time since uplift, $\tau$")
    axes.set_ylabel(rf"rotation, {power}$\phi$")


def _draw_cycles(axes: Axes, time: Floats, rotation: Floats, impacts: Floats, number: int) -> None:
    """Draw the stretch between the given impacts, which are numbered from `number` on, with the intervals."""
    margin = 0.06 * (impacts[-1] - impacts[0])
    shown = (time >= impacts[0] - margin) & (time <= impacts[-1] + margin)
    scale, power = find_magnification(float(np.max(np.abs(rotation[(time >= impacts[0]) & (time <= impacts[-1])]))))
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time[shown], scale * rotation[shown], color=INK, linewidth=1.0)
    axes.plot(impacts, np.zeros(impacts.size), "o", color=INK, markersize=3.4, markerfacecolor="white")
    axes.set_xlim(impacts[0] - margin, impacts[-1] + margin)
    low, high = axes.get_ylim()
    span = high - low
    # Neighbours lie close together: their labels stand above the curve, at two heights.
    axes.set_ylim(low - 0.24 * span, high + 0.4 * span)
    for k, at in enumerate(impacts):
        height = high + (0.16 if k % 2 else 0.3) * span
        axes.plot([at, at], [low - 0.08 * span, height], color=GREY, linewidth=0.6, zorder=0)
        axes.annotate(rf"$\tau_{{{number + k}}}$", (at, height), ha="center", va="bottom")
    _draw_intervals(axes, impacts, number, low - 0.05 * span)
    axes.set_ylabel(rf"rotation, {power}$\phi$")


def _draw_intervals(axes: Axes, impacts: Floats, number: int, height: float) -> None:
    """Draw an arrow from impact to impact, where its name fits."""
    for k, (start, end) in enumerate(itertools.pairwise(impacts)):
        if end - start < _NARROW * (impacts[-1] - impacts[0]):
            continue
        axes.annotate("", (end, height), (start, height), arrowprops=_ARROW)
        add_text(axes, rf"$\Delta\tau_{{{number + k}}}$", (0.5 * (start + end), height), (0, -2), ha="center", va="top")


def ratio_figure(panels: Sequence[Ratios]) -> Figure:
    """Draw the ratios of the intervals between every second impact, each panel with the limit."""
    with open_figure(None, (7.0, 2.9)) as figure:
        for k, (panel, axes) in enumerate(zip(panels, figure.subplots(1, len(panels), squeeze=False)[0], strict=True)):
            n = np.arange(panel.values.size)
            for start, face, label in ((0, INK, "even $n$"), (1, "white", "odd $n$")):
                chosen = slice(start, None, 2)
                look = {"color": INK, "markersize": 3.0, "markerfacecolor": face, "label": label}
                axes.plot(n[chosen], panel.values[chosen], "o", **look)
            axes.axhline(panel.limit, linewidth=0.9, **_LIMIT, zorder=0)
            text, at, up = rf"$\eta^2$ = {panel.limit:.4f}", (0.98, panel.limit), axes.get_yaxis_transform()
            add_text(axes, text, at, (0, -5), xycoords=up, ha="right", va="top", color=ACCENT)
            axes.set_title(f"({'abcdef'[k]}) {panel.title}", loc="left")
            axes.set_xlabel("impact $n$")
            axes.grid(color=GREY, linewidth=0.3, alpha=0.6)
            axes.legend(loc="center right")
        figure.axes[0].set_ylabel(r"$\Delta\tau_{n+2}\,/\,\Delta\tau_n$")
    return figure
