"""One chattering sequence: its oscillations, and the ratios of its intervals."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.plot.canvas import add_title, figure_for, magnified
from rocking.plot.style import ABOVE, GROUND, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Cycles that the details show: the first, and those after the impact with this number.
_FIRST_CYCLES: Final = 5
_LAST_CYCLES: Final = 5

#: Intervals shorter than this share of a detail have no name in it.
_NARROW: Final = 0.1


class Ratios(NamedTuple):
    """Ratios of intervals of one sequence, their limit, and what to write above them."""

    values: Floats
    limit: float
    title: str


def chattering_figure(
    *, time: Floats, rotation: Floats, impact_times: Floats, rest: float, late_impact: int, title: str
) -> Figure:
    """Draw a chattering sequence (a) with details of its first cycles (b) and of late ones (c).

    Parameters
    ----------
    time, rotation : ndarray, shape (n,)
        Dimensionless time since uplift, dense also between the late impacts, and rotation over slenderness.
    impact_times : ndarray
        Times of the impacts.
    rest : float
        Time of rest.
    late_impact : int
        Index into the impacts at which the second detail starts.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with figure_for(None, (7.0, 5.0)) as figure:
        grid = figure.add_gridspec(2, 2)
        whole, first, last = (figure.add_subplot(place) for place in (grid[0, :], grid[1, 0], grid[1, 1]))
        add_title(figure, None, title)
        _draw_whole(whole, time, rotation, impact_times, rest)
        early = np.append(0.0, impact_times[:_FIRST_CYCLES])
        _draw_cycles(first, time, rotation, early, 0)
        first.set_title("(b) first cycles", loc="left")
        first.set_xlabel(r"time since uplift, $\tau$")
        late = impact_times[late_impact : late_impact + _LAST_CYCLES + 1]
        scale, power = magnified(float(late[-1] - late[0]))
        _draw_cycles(last, scale * (time - late[0]), rotation, scale * (late - late[0]), late_impact + 1)
        last.set_title(rf"(c) cycles after impact {late_impact + 1}", loc="left")
        last.set_xlabel(rf"{power}$(\tau - \tau_{{{late_impact + 1}}})$")
    return figure


def _draw_whole(axes: Axes, time: Floats, rotation: Floats, impact_times: Floats, rest: float) -> None:
    scale, power = magnified(float(np.max(np.abs(rotation))))
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, scale * rotation, color=INK, linewidth=0.9)
    axes.plot(
        impact_times,
        np.full(impact_times.size, 0.06),
        "|",
        color=INK,
        markersize=6,
        markeredgewidth=0.5,
        transform=axes.get_xaxis_transform(),
    )
    axes.axvline(rest, color=ABOVE, linewidth=1.0, linestyle=(0, (4, 2)))
    axes.annotate(
        rf"at rest, $\tau_{{ch}}$ = {rest:.6f}",
        (rest, 0.3),
        xycoords=axes.get_xaxis_transform(),
        xytext=(-6, 0),
        textcoords="offset points",
        ha="right",
        color=ABOVE,
    )
    axes.set_xlim(0.0, 1.06 * rest)
    _pad(axes, below=0.18)
    axes.set_title("(a) the whole sequence, with its impacts as ticks", loc="left")
    axes.set_xlabel(r"time since uplift, $\tau$")
    axes.set_ylabel(rf"rotation, {power}$\phi$")


def _draw_cycles(axes: Axes, time: Floats, rotation: Floats, impacts: Floats, number: int) -> None:
    """Draw the stretch between the given impacts, which are numbered from `number` on, with the intervals."""
    margin = 0.06 * (impacts[-1] - impacts[0])
    shown = (time >= impacts[0] - margin) & (time <= impacts[-1] + margin)
    scale, power = magnified(float(np.max(np.abs(rotation[(time >= impacts[0]) & (time <= impacts[-1])]))))
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
        axes.plot([at, at], [low - 0.08 * span, height], color=GROUND, linewidth=0.6, zorder=0)
        axes.annotate(rf"$\tau_{{{number + k}}}$", (at, height), ha="center", va="bottom")
    _draw_intervals(axes, impacts, number, low - 0.05 * span)
    axes.set_ylabel(rf"rotation, {power}$\phi$")


def _draw_intervals(axes: Axes, impacts: Floats, number: int, height: float) -> None:
    """Draw an arrow from impact to impact, where there is room for its name."""
    for k, (start, end) in enumerate(itertools.pairwise(impacts)):
        if end - start < _NARROW * (impacts[-1] - impacts[0]):
            continue
        arrow = {
            "arrowstyle": "<->",
            "linewidth": 0.6,
            "color": INK,
            "shrinkA": 0.0,
            "shrinkB": 0.0,
            "mutation_scale": 6,
        }
        axes.annotate("", (end, height), (start, height), arrowprops=arrow)
        axes.annotate(
            rf"$\Delta\tau_{{{number + k}}}$",
            (0.5 * (start + end), height),
            xytext=(0, -2),
            textcoords="offset points",
            ha="center",
            va="top",
        )


def ratio_figure(panels: Sequence[Ratios]) -> Figure:
    """Draw the ratios of the intervals between every second impact, each panel with the limit.

    Parameters
    ----------
    panels : sequence of Ratios
        One for each panel, from left to right.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import numpy as np
    >>> figure = ratio_figure([Ratios(np.array([0.2, 1.0, 0.6, 0.9]), 0.8464, "a sequence")])
    >>> figure.axes[0].get_title(loc="left")
    '(a) a sequence'
    """
    with figure_for(None, (7.0, 2.9)) as figure:
        for k, (panel, axes) in enumerate(zip(panels, figure.subplots(1, len(panels), squeeze=False)[0], strict=True)):
            n = np.arange(panel.values.size)
            for start, face, label in ((0, INK, "even $n$"), (1, "white", "odd $n$")):
                chosen = slice(start, None, 2)
                axes.plot(
                    n[chosen], panel.values[chosen], "o", color=INK, markersize=3.0, markerfacecolor=face, label=label
                )
            axes.axhline(panel.limit, color=ABOVE, linewidth=0.9, linestyle=(0, (4, 2)), zorder=0)
            axes.annotate(
                rf"$\eta^2$ = {panel.limit:.4f}",
                (0.98, panel.limit),
                xycoords=axes.get_yaxis_transform(),
                xytext=(0, -5),
                textcoords="offset points",
                ha="right",
                va="top",
                color=ABOVE,
            )
            axes.set_title(f"({'abcdef'[k]}) {panel.title}", loc="left")
            axes.set_xlabel("impact $n$")
            axes.grid(color=GROUND, linewidth=0.3, alpha=0.6)
            axes.legend(loc="center right")
        figure.axes[0].set_ylabel(r"$\Delta\tau_{n+2}\,/\,\Delta\tau_n$")
    return figure


def _pad(axes: Axes, *, below: float) -> None:
    low, high = axes.get_ylim()
    axes.set_ylim(low - below * (high - low), high)
