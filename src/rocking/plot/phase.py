"""A response in the phase plane, and its energy over time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.arrays import Floats
from rocking.plot.canvas import ABOVE, GROUND, INK, REST, add_labels, add_legend, figure_for, handles_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Rotations and velocities beyond this leave the frame: past it a block only falls.
_FARTHEST: Final = 2.0

_BOUNDARY: Final[dict[str, Any]] = {"color": ABOVE, "linewidth": 0.9, "linestyle": (0, (6, 2, 1, 2))}
_JUMP: Final[dict[str, Any]] = {"color": GROUND, "linewidth": 1.1, "linestyle": (0, (1, 1.5))}


def phase_figure(
    *,
    rotation: Floats,
    velocity: Floats,
    jumps: Floats,
    boundary: tuple[Floats, Floats],
    uplifts: bool = False,
    rests: bool = False,
    limit: str = "slenderness",
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw velocity over p times what `limit` names, against the rotation over that.

    Both have gaps (NaN) at impacts, which are dotted lines between the velocities of `jumps`, shape (n, 2), at no
    rotation; uplift and rest are at the origin. `boundary` has the states with as much energy as at the balance.
    """
    with figure_for(ax, (4.6, 4.2), figsize, title) as figure:
        axes = figure.add_subplot() if ax is None else ax
        axes.axhline(0.0, color=INK, linewidth=0.4)
        axes.axvline(0.0, color=INK, linewidth=0.4)
        axes.plot(*boundary, label="as much energy as at the balance", **_BOUNDARY)
        if len(jumps):
            x = np.zeros(3 * len(jumps))
            axes.plot(x, np.insert(jumps, 2, np.nan, axis=1).ravel(), label="impact", **_JUMP)
        axes.plot(rotation, velocity, color=INK, linewidth=0.8, label="response")
        if uplifts or rests:
            name = " and ".join(word for word, seen in (("uplift", uplifts), ("rest", rests)) if seen)
            look: dict[str, Any] = {"color": INK, "markersize": 5.0, "markerfacecolor": REST, "zorder": 4}
            axes.plot(0.0, 0.0, "o", label=name, **look)
        for values, set_limits in ((rotation, axes.set_xlim), (velocity, axes.set_ylim)):
            reach = float(np.nanmax(np.abs(values), initial=0.0))
            reach = 1.1 * min(max(reach, 1e-12), _FARTHEST)
            set_limits(-reach, reach)
        add_labels(axes, f"rotation / {limit}", f"velocity / (p × {limit})")
        add_legend(figure, ax, handles_of(axes))
    return figure


def energy_figure(
    *,
    time: Floats,
    kinetic: Floats,
    potential: Floats,
    needed: tuple[float, float],
    impact_times: Floats,
    rest_intervals: Floats,
    title: str = "",
    ax: Axes | None = None,
    figsize: tuple[float, float] | None = None,
) -> Figure:
    """Draw kinetic, potential and total energy over time, s, over the least energy that overturns the body.

    `needed` is what overturns it to side + and side -; a level is drawn where the energy comes near it.
    `rest_intervals` have shape (k, 2).
    """
    with figure_for(ax, (7.0, 3.0), figsize, title) as figure:
        axes = figure.add_subplot() if ax is None else ax
        label = "at rest"
        for start, end in np.clip(rest_intervals, time[0], time[-1]):
            if start < end:
                axes.axvspan(start, end, color=REST, linewidth=0.0, label=label)
                label = ""
        total = kinetic + potential
        top = float(np.max(total, initial=0.0)) or 1.0
        axes.plot(time, total, color=INK, linewidth=1.4, label="total, which drops at impacts")
        axes.plot(time, potential, color=GROUND, linewidth=1.0, label="potential")
        axes.plot(time, kinetic, color="#3c6aa0", linewidth=0.8, linestyle=(0, (4, 1.5)), label="kinetic")
        axes.plot(impact_times, np.zeros(impact_times.size), "|", color=INK, markersize=6, markeredgewidth=0.5)
        levels = sorted({level for level in needed if math.isfinite(level) and level < 1.6 * top})
        for level in levels:
            axes.axhline(level, label="" if level != levels[0] else "as much energy as at the balance", **_BOUNDARY)
        axes.set_xlim(time[0], time[-1])
        axes.set_ylim(0.0, 1.08 * max([min(top, 2.0 * max([1.0, *levels])), *levels]))
        add_labels(axes, "time (s)", "energy / least that overturns")
        add_legend(figure, ax, handles_of(axes))
    return figure
