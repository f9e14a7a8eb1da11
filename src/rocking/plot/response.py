"""Histories of a ground motion and of a response, its course in the phase plane, its energy over time."""

from __future__ import annotations

import math
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


class _Scale(NamedTuple):
    """From rotation (rad) to what is drawn: factors of the sides + and -."""

    plus: float
    minus: float

    def of(self, rotation: Floats) -> Floats:
        return np.where(rotation >= 0.0, rotation * self.plus, rotation * self.minus)

    def back(self, drawn: Floats) -> Floats:
        return np.where(drawn >= 0.0, drawn / self.plus, drawn / self.minus)


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
    scale = _scale("rad" if label else units, slenderness)
    drawn = scale.of(rotation)
    zoom = None
    if place.get("ax") is None and chattering and chattering.impact_times.size > 1:
        zoom = chattering if math.isfinite(chattering.rest_upper - chattering.rest_lower) else None
    histories = 1 if not motion_time.size else 2 if vertical_acceleration_g is None else 3
    with page_for((7.0, 4.4 if histories < 3 else 5.4), **place) as page:
        (main, *grounds), sequence = _panels(page, histories, zoomed=zoom is not None)
        _shade_rest(main, np.clip(rest_intervals, *shown))
        _draw_rotation(main, time, drawn, scale.of(np.array([-slenderness[1], slenderness[0]])), limit)
        if units != "deg" and not label:
            to_degrees = (lambda y: np.degrees(scale.back(y)), lambda y: scale.of(np.radians(y)))
            main.secondary_yaxis("right", functions=to_degrees).set_ylabel("rotation (°)")
        if slenderness[0] != slenderness[1]:
            _tell_sides(main, grounds[0] if grounds else None, thresholds_g, scale)
        _mark_impacts(main, _within(impact_times, shown), _within(uplift_times, shown))
        if overturn_time is not None:
            _mark_overturning(main, time, drawn, overturn_time)
        main.set_xlim(*shown)
        if grounds:
            _draw_motion(grounds[0], motion_time, motion_acceleration_g, thresholds_g)
        if vertical_acceleration_g is not None and len(grounds) > 1:
            _draw_ground(grounds[1], motion_time, vertical_acceleration_g, 0.6)
        labels = label or _Y_LABELS[units].format(limit), "ground acceleration (g)", "vertical (g)"
        for axes, name in zip(page.drawn, labels, strict=False):
            is_last = axes is page.drawn[-1]
            axes.tick_params(labelbottom=is_last)
            add_labels(axes, _time_label(shown, duration) if is_last else "", name)
        if zoom and sequence is not None:
            start, at = float(zoom.impact_times[0]), main.get_xaxis_transform()
            main.plot([start, zoom.rest_upper], [0.95, 0.95], "|-", color=ABOVE, linewidth=1.3, transform=at)
            look = {"ha": "center", "va": "bottom", "color": ABOVE, "fontweight": "bold", "xycoords": at}
            write(main, "A", (0.5 * (start + zoom.rest_upper), 0.955), (0, 2), **look)
            _draw_sequence(sequence, zoom)
    return page.figure


def _panels(page: Page, histories: int, *, zoomed: bool) -> tuple[list[Axes], Axes | None]:
    """Panels of the rotation and of the motion, and of the chattering sequence: beside the others, or below them."""
    if page.ax is not None:
        return page.panels(), None
    figure = page.figure
    beside = zoomed and figure.get_figwidth() >= _WIDE
    below = zoomed and not beside
    heights = (1.3, 1.0, 0.7)[:histories] + (1.0,) * below
    widths = (3.0, 1.0)[: 1 + beside]
    grid = figure.add_gridspec(len(heights), len(widths), height_ratios=heights, width_ratios=widths)
    rotation = figure.add_subplot(grid[0, 0])
    grounds = [figure.add_subplot(grid[k, 0], sharex=rotation) for k in range(1, histories)]
    sequence = figure.add_subplot(grid[:, 1] if beside else grid[-1, 0]) if zoomed else None
    page.drawn = [rotation, *grounds]
    return page.drawn, sequence


def _within(times: Floats, shown: tuple[float, float]) -> Floats:
    return times[(times >= shown[0]) & (times <= shown[1])]


def _shade_rest(axes: Axes, rest_intervals: Floats) -> None:
    label = "at rest"
    for start, end in rest_intervals[rest_intervals[:, 0] < rest_intervals[:, 1]]:
        axes.axvspan(start, end, color=REST, linewidth=0.0, label=label)
        label = ""


def _scale(units: RotationUnits, slenderness: tuple[float, float]) -> _Scale:
    if units == "slenderness":
        return _Scale(1.0 / slenderness[0], 1.0 / slenderness[1])
    factor = math.degrees(1.0) if units == "deg" else 1.0
    return _Scale(factor, factor)


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
        axes.axhline(level, color=ABOVE, linewidth=0.8, linestyle=(0, (6, 2, 1, 2)), label=label)
        label = ""


def _tell_sides(
    rotation: Axes, motion: Axes | None, thresholds: tuple[Floats | float, Floats | float], scale: _Scale
) -> None:
    """Name the sides: where rotations are theirs, with what 1 is on each, and to which one a threshold lifts."""
    plus, minus = (float(np.ravel(threshold)[0]) for threshold in thresholds)
    names = ["side +", "side −"]
    if scale.plus != scale.minus:
        names = [f"{name}: 1 is {math.degrees(1.0 / factor):.3g}°" for name, factor in zip(names, scale, strict=True)]
    places = [(rotation, 0.0, names[0], "bottom"), (rotation, 0.0, names[1], "top")]
    if motion is not None:
        places += [(motion, minus, "lifts to side −", "top"), (motion, -plus, "lifts to side +", "bottom")]
    for axes, level, words, place in places:
        look = {"va": place, "color": INK, "fontsize": "small", "zorder": 5}
        write(
            axes, words, (0.0, level), (3, 2 if place == "bottom" else -2), xycoords=axes.get_yaxis_transform(), **look
        )


def _mark_impacts(axes: Axes, impact_times: Floats, uplift_times: Floats) -> None:
    if impact_times.size:
        add_ticks(axes, impact_times, 0.055, label=f"resolved impacts ({impact_times.size})")
    if uplift_times.size:
        add_ticks(axes, uplift_times, 0.13, "^", color=ABOVE, markersize=4.5, markeredgewidth=0.0, label="uplift")


def _mark_overturning(axes: Axes, time: Floats, drawn: Floats, overturn_time: float) -> None:
    """Put a cross on the curve: at the time of the fall, where it ends, or where it has left the frame before."""
    look: dict[str, Any] = {"color": ABOVE, "markersize": 7, "markeredgecolor": "white", "markeredgewidth": 0.5}
    height, label = float(np.clip(drawn[-1], *axes.get_ylim())), f"overturned at {overturn_time:.3f} s"
    at = overturn_time
    inside = np.flatnonzero((drawn - height) * (drawn[-1] - height) < 0.0)
    if inside.size:
        k = inside[-1]
        at = float(time[k] + (height - drawn[k]) / (drawn[k + 1] - drawn[k]) * (time[k + 1] - time[k]))
    axes.plot(at, height, "X", clip_on=False, zorder=4, label=label, **look)


def _draw_motion(
    axes: Axes, time: Floats, acceleration: Floats, thresholds: tuple[Floats | float, Floats | float]
) -> None:
    plus, minus = (np.broadcast_to(threshold, time.shape) for threshold in thresholds)
    _draw_ground(axes, time, acceleration, 0.6)
    above: dict[str, Any] = {"color": ABOVE, "linewidth": 0.9, "interpolate": True, "zorder": 3}
    label = "beyond a threshold"
    for threshold, beyond in ((minus, acceleration > minus), (-plus, acceleration < -plus)):
        if np.any(beyond):
            axes.fill_between(time, acceleration, threshold, where=beyond, label=label, **above)
            label = ""
    moves = any(bool(np.ptp(threshold)) for threshold in (plus, minus) if np.isfinite(threshold).all())
    label = "uplift thresholds" + (", which change with the weight" if moves else "")
    for threshold in (minus, -plus):
        if not np.isfinite(threshold).all():
            continue  # nothing lifts it to that side
        if moves:
            axes.plot(time, threshold, color=INK, linewidth=0.5, label=label)
        else:
            axes.axhline(float(threshold[0]), color=INK, linewidth=0.8, linestyle=(0, (5, 2)), label=label)
        label = ""


def _draw_ground(axes: Axes, time: Floats, acceleration: Floats, linewidth: float) -> None:
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, acceleration, color=GROUND, linewidth=linewidth, label="_ground acceleration")


def _time_label(shown: tuple[float, float], duration: float | None) -> str:
    start, end = shown
    if duration is None or (start <= 0.0 and end >= duration * (1.0 - 1e-9)):
        return "time (s)"
    digits = max(0, 1 - math.floor(math.log10(end - start)))
    return f"time (s); shown: {start:.{digits}f}–{end:.{digits}f} s of {duration:.{digits}f} s"


def _draw_sequence(axes: Axes, sequence: DrawnSequence) -> None:
    rest = 0.5 * (sequence.rest_lower + sequence.rest_upper)
    start = sequence.impact_times[:-1]
    interval = np.diff(sequence.impact_times)
    # Where impacts lie closer than the spacing of floating point times, neither axis has a logarithm.
    shown = (interval > 0.0) & (rest > start)
    look: dict[str, Any] = {"color": INK, "markersize": 2.6, "markerfacecolor": "white", "markeredgewidth": 0.6}
    axes.loglog(rest - start[shown], interval[shown], "o", **look)
    axes.invert_xaxis()
    add_labels(axes, "time to rest (s)", "interval to next impact (s)")
    axes.grid(True)
    width = sequence.rest_upper - sequence.rest_lower
    off = sequence.off
    decimals = 6 if off < 1e-6 else 0 if math.isnan(off) else max(0, math.floor(-math.log10(off)))
    axes.set_title(f"A: at rest at {rest:.{decimals}f}\N{NO-BREAK SPACE}s", color=ABOVE, loc="left", wrap=True)
    moves = "not" if math.isnan(off) else f"± {off:.0e} s"
    known = "" if off < 1e-6 else f"{moves} in all\n{sequence.sample.replace(' within', chr(10) + 'within')};\n"
    # Below the falling line there is space.
    words = f"{known}bracket of the\ncomputation\n{width:.0e} s"
    axes.text(0.04, 0.03, words, color=ABOVE, fontsize=7.0, transform=axes.transAxes, ha="left", va="bottom")


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
