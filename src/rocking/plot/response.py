"""Histories of a ground motion and of a response, its course in the phase plane, its energy over time."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, Unpack

import numpy as np

from rocking.core.arrays import Floats
from rocking.plot.canvas import ABOVE, GROUND, INK, REST, Page, Place, add_labels, add_ticks, page_for, write

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What rotations are drawn in.
RotationUnits = Literal["slenderness", "rad", "deg"]

#: Rotations beyond this multiple of the slenderness leave the frame: past it a block only falls.
LARGEST_RATIO_SHOWN: Final = 2.0

_BOUNDARY: Final[dict[str, Any]] = {"color": ABOVE, "linewidth": 0.9, "linestyle": (0, (6, 2, 1, 2))}
_JUMP: Final[dict[str, Any]] = {"color": GROUND, "linewidth": 1.1, "linestyle": (0, (1, 1.5))}

#: Rotations and velocities beyond this leave the frame: past it a block only falls.
_FARTHEST: Final = 2.0

#: A figure at least so wide (inches) has space for the chattering sequence beside the histories.
_WIDE: Final = 5.5

_Y_LABELS: Final = {"slenderness": "rotation / {}", "rad": "rotation (rad)", "deg": "rotation (°)"}


class DrawnSequence(NamedTuple):
    """One chattering sequence: the times of its impacts and the bracket on the time of rest, s.

    ``off`` is how far (s) the rest moves in repeated simulations (``sample``); NaN where it is not in all of them.
    """

    impact_times: Floats
    rest_lower: float
    rest_upper: float
    off: float = 0.0
    sample: str = ""


def response_figure(
    *,
    time: Floats,
    rotation: Floats,
    slenderness: tuple[float, float],
    impact_times: Floats,
    rest_intervals: Floats,
    uplift_times: Floats,
    overturn_time: float | None,
    motion_time: Floats,
    motion_acceleration_g: Floats,
    thresholds_g: tuple[Floats | float, Floats | float],
    vertical_acceleration_g: Floats | None = None,
    duration: float | None = None,
    chattering: DrawnSequence | None = None,
    units: RotationUnits = "slenderness",
    limit: str = "slenderness",
    label: str = "",
    **place: Unpack[Place],
) -> Figure:
    """Draw a response above the ground motion that caused it.

    Times are s and the rotation is in rad, on the stretch that is drawn; it leaves the frame beyond twice the
    slenderness (side +, side -). `rest_intervals` have shape (k, 2). Ground accelerations are in g; without
    `motion_time` there is no panel of them. A threshold is a magnitude, or one for each of the motion's times where the
    weight changes: the first lifts to side + and is drawn below zero, the second above. Where the stretch is only a
    part of the whole `duration`, the figure says so.

    A sequence `chattering` has a panel of its own, the interval to the next impact against the time to rest, both
    logarithmic, unless the time of rest is not bracketed (NaN) or there is a single impact. Rotations are drawn in
    `units`, over what `limit` names; a coordinate that is no rotation as it is, under its `label`. In `ax`, the
    rotation is drawn without the other panels.
    """
    shown = float(time[0]), float(time[-1])
    factors = (math.degrees(1.0),) * 2 if units == "deg" and not label else (1.0, 1.0)
    if units == "slenderness" and not label:
        factors = (1.0 / slenderness[0], 1.0 / slenderness[1])

    def factor(values: Floats) -> Floats:
        return np.where(values >= 0.0, *factors)

    drawn = rotation * factor(rotation)
    zoom = None if place.get("ax") is not None else chattering
    if zoom and (zoom.impact_times.size < 2 or not math.isfinite(zoom.rest_upper - zoom.rest_lower)):
        zoom = None
    histories = 1 if not motion_time.size else 2 if vertical_acceleration_g is None else 3
    with page_for((7.0, 4.4 if histories < 3 else 5.4), **place) as page:
        main, *grounds = _panels(page, histories, zoomed=zoom is not None)
        _shade_rest(main, np.clip(rest_intervals, *shown))
        _draw_rotation(main, time, drawn, np.array([-slenderness[1], slenderness[0]]) * factors[::-1], limit)
        if units != "deg" and not label:
            to_degrees = (lambda y: np.degrees(y / factor(y)), lambda y: np.radians(y) * factor(y))
            main.secondary_yaxis("right", functions=to_degrees).set_ylabel("rotation (°)")
        if slenderness[0] != slenderness[1]:
            _tell_sides(main, factors)
        _mark_times(main, shown, impact_times, 0.055, "resolved impacts ({})")
        _mark_times(main, shown, uplift_times, 0.13, "uplift", marker="^", color=ABOVE, markersize=4.5)
        if overturn_time is not None:
            _mark_fall(main, time, drawn, f"overturned at {overturn_time:.3f} s")
        main.set_xlim(*shown)
        for axes, acceleration in zip(grounds, (motion_acceleration_g, vertical_acceleration_g), strict=False):
            _draw_ground(axes, motion_time, np.asarray(acceleration), 0.6)
        for axes in grounds[:1]:
            _draw_thresholds(axes, motion_time, motion_acceleration_g, thresholds_g)
        _label_panels([main, *grounds], label or _Y_LABELS[units].format(limit), _time_label(shown, duration))
        if zoom:
            _draw_sequence(main, page.drawn[-1], zoom)
    return page.figure


def _panels(page: Page, histories: int, *, zoomed: bool) -> list[Axes]:
    """Panels of the rotation and of the motion; that of the chattering sequence is beside the others, or below them."""
    rows, options = [*"RGV"[:histories]], {"height_ratios": [1.3, 1.0, 0.7][:histories]}
    if zoomed and page.figure.get_figwidth() >= _WIDE:
        rows, options = [f"{row}Z" for row in rows], options | {"width_ratios": [3.0, 1.0]}
    elif zoomed:
        rows, options["height_ratios"] = [*rows, "Z"], [*options["height_ratios"], 1.0]
    panels = page.mosaic(";".join(rows), **options)
    if zoomed:
        sequence = panels.pop(1 if len(rows[0]) > 1 else -1)
        page.drawn = [*panels, sequence]
    for axes in panels[1:]:
        axes.sharex(panels[0])
    return panels


def _shade_rest(axes: Axes, rest_intervals: Floats) -> None:
    for start, end in rest_intervals[rest_intervals[:, 0] < rest_intervals[:, 1]]:
        axes.axvspan(start, end, color=REST, linewidth=0.0, label="at rest")


def _draw_rotation(axes: Axes, time: Floats, drawn: Floats, tipping: Floats, limit: str) -> None:
    """Draw the rotation, in its units, and the angles, to side - and to side +, at which the block tips over."""
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, drawn, color=INK, linewidth=0.9, label="_rotation")
    lowest = max(float(np.min(drawn, initial=0.0)), LARGEST_RATIO_SHOWN * float(tipping[0]))
    highest = min(float(np.max(drawn, initial=0.0)), LARGEST_RATIO_SHOWN * float(tipping[1]))
    span = (highest - lowest) or 1.0
    # Space below for the marks of the impacts and uplifts.
    low, high = axes.set_ylim(lowest - 0.28 * span, highest + 0.1 * span)
    label = "tipping, θ = ±α" if limit == "slenderness" else "unstable balance without ground motion"
    for level in tipping[(tipping > low) & (tipping < high)]:
        axes.axhline(level, label=label, **_BOUNDARY)


def _mark_times(axes: Axes, shown: tuple[float, float], times: Floats, height: float, name: str, **look: Any) -> None:
    inside = times[(times >= shown[0]) & (times <= shown[1])]
    if inside.size:
        add_ticks(axes, inside, height, label=name.format(inside.size), **look)


def _mark_fall(axes: Axes, time: Floats, drawn: Floats, label: str) -> None:
    """Put a cross where the curve ends, or where it has left the frame before."""
    low, high = axes.get_ylim()
    end = np.flatnonzero((drawn >= low) & (drawn <= high))[-1]
    axes.plot(time[end], drawn[end], "X", color=ABOVE, markersize=7, clip_on=False, zorder=4, label=label)


def _tell_sides(axes: Axes, factors: tuple[float, float]) -> None:
    """Name the sides where rotations are theirs, with what 1 is on each."""
    for name, place, off, factor in zip(("side +", "side −"), ("bottom", "top"), (2, -2), factors, strict=True):
        words = name if factors[0] == factors[1] else f"{name}: 1 is {math.degrees(1.0 / factor):.3g}°"
        look = {"va": place, "color": INK, "fontsize": "small", "xycoords": axes.get_yaxis_transform()}
        write(axes, words, (0.0, 0.0), (3, off), **look)


def _label_panels(panels: Sequence[Axes], rotation: str, time: str) -> None:
    for axes, name in zip(panels, (rotation, "ground acceleration (g)", "vertical (g)"), strict=False):
        axes.tick_params(labelbottom=axes is panels[-1])
        add_labels(axes, time if axes is panels[-1] else "", name)


def _draw_thresholds(
    axes: Axes, time: Floats, acceleration: Floats, thresholds: tuple[Floats | float, Floats | float]
) -> None:
    plus, minus = (np.broadcast_to(threshold, time.shape) for threshold in thresholds)
    above: dict[str, Any] = {"color": ABOVE, "linewidth": 0.9, "interpolate": True, "zorder": 3}
    for threshold, beyond in ((minus, acceleration > minus), (-plus, acceleration < -plus)):
        if np.any(beyond):
            axes.fill_between(time, acceleration, threshold, where=beyond, label="beyond a threshold", **above)
        if np.isfinite(threshold).all():  # else nothing lifts it to that side
            axes.plot(time, threshold, color=INK, linewidth=0.8, linestyle=(0, (5, 2)), label="uplift thresholds")


def _draw_ground(axes: Axes, time: Floats, acceleration: Floats, linewidth: float) -> None:
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, acceleration, color=GROUND, linewidth=linewidth, label="_ground acceleration")


def _time_label(shown: tuple[float, float], duration: float | None) -> str:
    start, end = shown
    if duration is None or (start <= 0.0 and end >= duration * (1.0 - 1e-9)):
        return "time (s)"
    digits = max(0, 1 - math.floor(math.log10(end - start)))
    return f"time (s); shown: {start:.{digits}f}–{end:.{digits}f} s of {duration:.{digits}f} s"


def _draw_sequence(main: Axes, axes: Axes, sequence: DrawnSequence) -> None:
    """Draw a sequence impact by impact, and where it is among the histories."""
    first, last, at = float(sequence.impact_times[0]), sequence.rest_upper, main.get_xaxis_transform()
    main.plot([first, last], [0.95, 0.95], "|-", color=ABOVE, linewidth=1.3, transform=at)
    look: dict[str, Any] = {"ha": "center", "va": "bottom", "color": ABOVE, "fontweight": "bold", "xycoords": at}
    write(main, "A", (0.5 * (first + last), 0.955), (0, 2), **look)
    rest, off = 0.5 * (sequence.rest_lower + sequence.rest_upper), sequence.off
    start, interval = sequence.impact_times[:-1], np.diff(sequence.impact_times)
    # Where impacts lie closer than the spacing of floating point times, neither axis has a logarithm.
    shown = (interval > 0.0) & (rest > start)
    look = {"color": INK, "markersize": 2.6, "markerfacecolor": "white", "markeredgewidth": 0.6}
    axes.loglog(rest - start[shown], interval[shown], "o", **look)
    axes.invert_xaxis()
    add_labels(axes, "time to rest (s)", "interval to next impact (s)")
    axes.grid(True)
    decimals = 6 if off < 1e-6 else 0 if math.isnan(off) else max(0, math.floor(-math.log10(off)))
    axes.set_title(f"A: at rest at {rest:.{decimals}f}\N{NO-BREAK SPACE}s", color=ABOVE, loc="left", wrap=True)
    known = "" if off < 1e-6 else f"{'not' if math.isnan(off) else f'± {off:.0e} s'} in all {sequence.sample}; "
    words = f"{known}bracket of the computation {sequence.rest_upper - sequence.rest_lower:.0e} s"
    # Below the falling line there is space.
    look = {"color": ABOVE, "fontsize": 7.0, "transform": axes.transAxes, "va": "bottom"}
    axes.text(0.04, 0.03, textwrap.fill(words, 16), **look)


def motion_figure(
    *, time: Floats, acceleration_g: Floats, vertical_g: Floats | None = None, **place: Unpack[Place]
) -> Figure:
    """Draw a ground acceleration (g) over time (s), and a vertical one below it; in `ax`, the horizontal one alone."""
    traces = {"ground acceleration (g)": acceleration_g}
    if vertical_g is not None and place.get("ax") is None:
        traces["vertical acceleration (g)"] = vertical_g
    with page_for((7.0, 0.6 + 1.8 * len(traces)), **place) as page:
        panels = page.panels(len(traces), sharex=True)
        for axes, (label, trace) in zip(panels, traces.items(), strict=True):
            _draw_ground(axes, time, trace, 0.8)
            axes.set_xlim(time[0], time[-1])
            add_labels(axes, "time (s)" if axes is panels[-1] else "", label)
        page.handles = []
    return page.figure


def phase_figure(
    *,
    rotation: Floats,
    velocity: Floats,
    jumps: Floats,
    boundary: tuple[Floats, Floats],
    uplifts: bool = False,
    rests: bool = False,
    limit: str = "slenderness",
    **place: Unpack[Place],
) -> Figure:
    """Draw velocity over p times what `limit` names, against the rotation over that."""
    with page_for((4.6, 4.2), **place) as page:
        (axes,) = page.panels()
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
    return page.figure


def energy_figure(
    *,
    time: Floats,
    kinetic: Floats,
    potential: Floats,
    needed: tuple[float, float],
    impact_times: Floats,
    rest_intervals: Floats,
    **place: Unpack[Place],
) -> Figure:
    """Draw kinetic, potential and total energy over time, s, over the least energy that overturns the body."""
    with page_for((7.0, 3.0), **place) as page:
        (axes,) = page.panels()
        _shade_rest(axes, np.clip(rest_intervals, time[0], time[-1]))
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
    return page.figure
