"""Figures of a response: histories, phase plane, energy."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, Unpack, get_args

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.tables import escape_dollars
from rocking.engine.problem import compute_uplift_thresholds
from rocking.errors import OptionError
from rocking.plot.canvas import ACCENT, GREY, INK, PALE, FigureOptions, Page, add_labels, add_text, add_ticks, open_page
from rocking.plot.curves import draw_ground
from rocking.response.simulated import ResponseData
from rocking.response.summary import describe_subject, format_time

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Units of rotations in figures.
RotationUnits = Literal["slenderness", "rad", "deg"]

#: Number of even times of a line.
_EVEN_TIMES: Final = 4001

#: Largest number of drawn impacts; others are omitted evenly.
_MAX_IMPACTS: Final = 2000

#: Limit of drawn rotations and velocities; beyond it a block only falls.
_MAX_RATIO: Final = 2.0

_BOUNDARY: Final[dict[str, Any]] = {"color": ACCENT, "linewidth": 0.9, "linestyle": (0, (6, 2, 1, 2))}


def create_title(response: ResponseData) -> str:
    """Return the title of a figure: the body and its motion."""
    return escape_dollars(describe_subject(response))


def compute_active_span(response: ResponseData) -> tuple[float, float]:
    """Return the interval of all events, with margins, s."""
    times = np.concatenate([response.events["time"], response.impacts["time"]])
    if len(times) == 0:
        return 0.0, response.duration
    first = float(times.min()) if response.states(0.0)[0] == 0.0 else 0.0
    margin = 0.1 * (float(times.max()) - first) + 0.5
    return max(0.0, first - margin), min(response.duration, float(times.max()) + margin)


def resolve_window(response: ResponseData, window: Sequence[float] | None) -> tuple[float, float]:
    """Return a valid window of a response, s, or its active span."""
    if window is None:
        return compute_active_span(response)
    ends: Any = checks.numbers(window, "window", OptionError)
    if ends.shape != (2,) or not 0.0 <= ends[0] < ends[1] <= response.duration:
        requirement = f"(start, end), in s, with 0 <= start < end <= {response.duration:.6g}, the duration"
        raise OptionError(f"{{}} must be {requirement}", "window", value=window)
    return float(ends[0]), float(ends[1])


def choose_times(response: ResponseData, start: float, end: float) -> Floats:
    """Return times for a smooth line: even ones and visible steps."""
    even = np.linspace(start, end, _EVEN_TIMES)
    steps = _crop(response._history.trail.nodes["time"], start, end)
    visible = np.diff(np.floor(steps / max(even[1] - even[0], 1e-12)), prepend=-1.0) > 0.0
    return np.union1d(even, steps[visible])


def _crop(times: Floats, start: float, end: float) -> Floats:
    return times[(times >= start) & (times <= end)]


def draw_histories(
    response: ResponseData,
    units: RotationUnits,
    window: Sequence[float] | None,
    *,
    longest_sequence: bool,
    **options: Unpack[FigureOptions],
) -> Figure:
    """Draw the rotation above the ground motion in a window.

    The frame ends at twice the slenderness (or balance). A separate panel shows the longest chattering sequence: the
    interval to the next impact against the time to rest, both logarithmic. In `ax` only the rotation is drawn.
    """
    checks.choice(units, "rotation_units", OptionError, get_args(RotationUnits))
    span = resolve_window(response, window)
    time, coordinate = choose_times(response, *span), response.block.coordinate
    is_rotation = coordinate.unit == "rad"
    plus, minus = balances = _choose_balances(response)
    if not is_rotation or (units == "slenderness" and any(map(math.isinf, balances))):
        units = "rad"
    factors = {"slenderness": (1.0 / plus, 1.0 / minus), "deg": (math.degrees(1.0),) * 2, "rad": (1.0, 1.0)}[units]
    names = {"slenderness": f"rotation / {coordinate.limit_name}", "deg": "rotation (°)", "rad": "rotation (rad)"}

    def normalise(values: Floats) -> Floats:
        return np.where(values >= 0.0, *factors)

    rotation = response.states(time)[:, 0]
    scaled_rotation = rotation * normalise(rotation)
    sequence = _find_longest_sequence(response, *span) if longest_sequence and options.get("ax") is None else None
    traces = _compute_traces(response, *span)
    with open_page((7.0, 4.4 + (len(traces) > 1) + 1.4 * (sequence is not None)), **options) as page:
        main, *grounds = _create_panels(page, 1 + len(traces), has_zoom=sequence is not None)
        _shade_rest(main, np.clip(response.rest_intervals, *span))
        _shade_slip(main, np.clip(response._history.find_slips(), *span))
        _draw_rotation(main, time, scaled_rotation, np.array([-minus, plus]) * factors[::-1], coordinate.limit_name)
        if units != "deg" and is_rotation:
            to_degrees = (lambda y: np.degrees(y / normalise(y)), lambda y: np.radians(y) * normalise(y))
            main.secondary_yaxis("right", functions=to_degrees).set_ylabel("rotation (°)")
        if plus != minus:
            _label_sides(main, factors)
        _mark_events(main, response, *span)
        if response.overturned and response.overturn_time <= span[1]:
            _mark_overturning(main, time, scaled_rotation, f"overturned at {response.overturn_time:.3f} s")
        main.set_xlim(*span)
        for axes, (trace_time, trace) in zip(grounds, traces.values(), strict=False):
            draw_ground(axes, trace_time, trace, 0.6)
        for axes in grounds[: response.motion is not None]:
            _draw_thresholds(axes, response, *traces["ground acceleration (g)"])
        panels = [main, *grounds]
        label = names[units] if is_rotation else f"{coordinate.name} ({coordinate.unit})"
        for axes, name in zip(panels, (label, *traces), strict=False):
            axes.tick_params(labelbottom=axes is panels[-1])
            add_labels(axes, _format_time_label(*span, response.duration) if axes is panels[-1] else "", name)
        if sequence is not None:
            _draw_sequence(main, page.panel_axes[-1], response, sequence)
    return page.figure


def _choose_balances(response: ResponseData) -> tuple[float, float]:
    """Return the balance on each side, for a one-sided body the same value twice."""
    (pair,), _ = compute_uplift_thresholds(response.block.as_bodies(), response.model)
    return response.balance[0], response.balance[0 if math.isinf(pair[1]) else 1]


def _compute_traces(response: ResponseData, start: float, end: float) -> dict[str, tuple[Floats, Floats]]:
    """Return times and values of ground accelerations, g, and slip, mm, by label."""
    motion, slips = response.motion, {}
    if response.friction is not None:
        times = choose_times(response, start, end)
        slips["slip (mm)"] = times, 1e3 * response.slip(times)
    if motion is None:
        return slips
    times = motion.choose_drawing_times(start, end)
    traces = {"ground acceleration (g)": (times, motion.acceleration(times) / STANDARD_GRAVITY)}
    if motion.vertical is not None:
        traces["vertical (g)"] = (times, motion.vertical.acceleration(times) / STANDARD_GRAVITY)
    return traces | slips


def _find_longest_sequence(response: ResponseData, start: float, end: float) -> np.void | None:
    """Return the sequence with the most impacts in the interval, if its time of rest is bracketed."""
    inside = response.sequences[(response.sequences["start"] >= start) & (response.sequences["end"] <= end)]
    longest: np.void | None = max(inside, key=lambda row: row["impacts"], default=None)
    if longest is None or not math.isfinite(longest["upper"] - longest["lower"]):
        return None
    return longest if _crop(response.impacts["time"], longest["start"], longest["end"]).size > 1 else None


def _create_panels(page: Page, count: int, *, has_zoom: bool) -> list[Axes]:
    """Return the panels of rotation and motion, above the panel of the chattering sequence."""
    heights = [*(1.3, 1.0, 0.7, 0.7)[:count]] + [1.0] * has_zoom
    panels = page.create_panels(";".join("RGVS"[:count] + "Z" * has_zoom), height_ratios=heights)
    for axes in panels[1:count]:
        axes.sharex(panels[0])
    return panels[:count]


def _shade_rest(axes: Axes, rest_intervals: Floats) -> None:
    for start, end in rest_intervals[rest_intervals[:, 0] < rest_intervals[:, 1]]:
        axes.axvspan(start, end, color=PALE, linewidth=0.0, label="at rest")


def _shade_slip(axes: Axes, intervals: Floats) -> None:
    for start, end in intervals[intervals[:, 0] < intervals[:, 1]]:
        axes.axvspan(start, end, color=ACCENT, alpha=0.5, fill=False, hatch="////", linewidth=0.0, label="slips")


def _draw_rotation(axes: Axes, time: Floats, rotation: Floats, tipping_angles: Floats, limit: str) -> None:
    """Draw the rotation, in its units, and the angles, to side - and to side +, at which the block tips over."""
    axes.axhline(0.0, color=INK, linewidth=0.4)
    axes.plot(time, rotation, color=INK, linewidth=0.9, label="_rotation")
    lowest = max(float(np.min(rotation, initial=0.0)), _MAX_RATIO * float(tipping_angles[0]))
    highest = min(float(np.max(rotation, initial=0.0)), _MAX_RATIO * float(tipping_angles[1]))
    span = (highest - lowest) or 1.0
    # Space for the marks of impacts and uplifts.
    low, high = axes.set_ylim(lowest - 0.28 * span, highest + 0.1 * span)
    label = "tipping, θ = ±α" if limit == "slenderness" else "unstable balance without ground motion"
    for level in tipping_angles[(tipping_angles > low) & (tipping_angles < high)]:
        axes.axhline(level, label=label, **_BOUNDARY)


def _mark_events(axes: Axes, response: ResponseData, start: float, end: float) -> None:
    impacts, uplifts = (_crop(response.impacts["time"], start, end), find_event_times(response, start, end)["uplift"])
    if impacts.size:
        add_ticks(axes, impacts, 0.055, label=f"resolved impacts ({impacts.size})")
    if uplifts.size:
        add_ticks(axes, uplifts, 0.13, "^", color=ACCENT, markersize=4.5, markeredgewidth=0.0, label="uplift")


def _mark_overturning(axes: Axes, time: Floats, rotation: Floats, label: str) -> None:
    """Draw a cross where the curve ends or leaves the frame."""
    low, high = axes.get_ylim()
    inside = np.flatnonzero((rotation >= low) & (rotation <= high))
    end = inside[-1] if inside.size else -1
    style: dict[str, Any] = {"color": ACCENT, "markersize": 7, "clip_on": False, "zorder": 4}
    axes.plot(time[end], np.clip(rotation[end], low, high), "X", label=label, **style)


def _label_sides(axes: Axes, factors: tuple[float, float]) -> None:
    """Label the sides, with the angle of 1 on each."""
    for name, offset, factor in zip(("side +", "side −"), (2, -2), factors, strict=True):
        text = name if factors[0] == factors[1] else f"{name}: 1 is {math.degrees(1.0 / factor):.3g}°"
        _label_left_end(axes, text, 0.0, offset)


def _label_left_end(axes: Axes, text: str, y: float, offset: float) -> None:
    """Write a text at the left end of a horizontal line, above it for a positive offset, in points."""
    alignment, transform = "bottom" if offset > 0.0 else "top", axes.get_yaxis_transform()
    add_text(axes, text, (0.0, y), (3, offset), va=alignment, color=INK, fontsize="small", xycoords=transform)


def _draw_thresholds(axes: Axes, response: ResponseData, time: Floats, acceleration: Floats) -> None:
    """Draw the uplift thresholds, which vary with the weight, and the motion beyond them."""
    (pair,), (weight_part,) = compute_uplift_thresholds(response.block.as_bodies(), response.model)
    lift = response.motion.vertical.acceleration(time) if response.motion and response.motion.vertical else 0.0 * time
    fill_style: dict[str, Any] = {"color": ACCENT, "linewidth": 0.9, "interpolate": True, "zorder": 3}
    for sign, size, weight_slope in ((-1.0, pair[0], weight_part[0]), (1.0, pair[1], weight_part[1])):
        if math.isinf(size):
            continue  # no uplift to this side
        threshold = sign * (size + lift / response.block.gravity * weight_slope) / STANDARD_GRAVITY
        is_beyond = sign * acceleration > sign * threshold
        if np.any(is_beyond):
            axes.fill_between(time, acceleration, threshold, where=is_beyond, label="beyond a threshold", **fill_style)
        axes.plot(time, threshold, color=INK, linewidth=0.8, linestyle=(0, (5, 2)), label="uplift thresholds")
        if pair[0] != pair[1]:
            text = "lifts to side +" if sign < 0.0 else "lifts to side −"
            _label_left_end(axes, text, threshold[0], -2.0 * sign)


def _format_time_label(start: float, end: float, duration: float) -> str:
    is_all = start <= 0.0 and end >= duration * (1.0 - 1e-9)
    return "time (s)" if is_all else f"time (s); shown: {start:.4g}–{end:.4g} s of {duration:.4g} s"


def _draw_sequence(main: Axes, axes: Axes, response: ResponseData, sequence: np.void) -> None:
    """Draw a sequence impact by impact, and mark it in the histories."""
    times = _crop(response.impacts["time"], sequence["start"], sequence["end"])
    ranges = response.perturbed().event_ranges[response.events["time"] == sequence["end"]]
    low, high = ranges.T.max(axis=1, initial=0.0)
    first, last, transform = float(times[0]), float(sequence["upper"]), main.get_xaxis_transform()
    main.plot([first, last], [0.95, 0.95], "|-", color=ACCENT, linewidth=1.3, transform=transform)
    style: dict[str, Any] = {"ha": "center", "va": "bottom", "color": ACCENT, "fontweight": "bold"}
    add_text(main, "A", (0.5 * (first + last), 0.955), (0, 2), xycoords=transform, **style)
    rest, start, interval = 0.5 * (sequence["lower"] + sequence["upper"]), times[:-1], np.diff(times)
    # Logarithms are undefined for impacts closer than floating-point spacing.
    is_positive = (interval > 0.0) & (rest > start)
    style = {"color": INK, "markersize": 2.6, "markerfacecolor": "white", "markeredgewidth": 0.6}
    axes.loglog(rest - start[is_positive], interval[is_positive], "o", **style)
    axes.invert_xaxis()
    add_labels(axes, "time to rest (s)", "interval to next impact (s)")
    axes.grid(True)
    rest_text = f"about {rest:.0f} s, if at all" if math.isnan(low) else format_time(rest, low, high)
    title = f"A: at rest at {rest_text}; bracket of the computation {sequence['upper'] - sequence['lower']:.0e} s"
    axes.set_title(textwrap.fill(title, max(20, int(axes.bbox.width / axes.figure.dpi * 14))), color=ACCENT, loc="left")


class SampledInterval(NamedTuple):
    """Interval of a response, with two points at each impact: before it and, at the same time, after it.

    Attributes
    ----------
    time : ndarray
        Times, s.
    rotation, velocity : ndarray
        Rotation divided by the balance of its side (the slenderness of a free block), velocity divided by p times the
        balance. If a side has no balance, rotation in rad and velocity divided by p.
    kinetic, potential : ndarray
        Energies as of `Response.kinetic_energy`.
    impact_rows : ndarray of int
        Indices of the points before impacts.
    """

    time: Floats
    rotation: Floats
    velocity: Floats
    kinetic: Floats
    potential: Floats
    impact_rows: Integers

    def insert_gaps(self, values: Floats) -> Floats:
        """Insert a gap at each impact, where a line would jump."""
        return np.insert(values, self.impact_rows + 1, np.nan)


def sample_interval(response: ResponseData, start: float, end: float) -> SampledInterval:
    """Compute the course of a response between two times, s."""
    history, energy = response._history, response._energy
    impacts = response.impacts[(response.impacts["time"] >= start) & (response.impacts["time"] <= end)]
    impacts = impacts[:: 1 + len(impacts) // _MAX_IMPACTS]
    impact_times = np.asarray(impacts["time"], dtype=float)
    times = np.setdiff1d(np.linspace(start, end, _EVEN_TIMES), impact_times)
    rows = history.find_rows(times)
    theta, rate, _ = history.compute_states(times, rows).T
    positions = np.searchsorted(times, impact_times)

    def insert(values: Floats | Integers, before: Floats | Integers, after: Floats | Integers) -> Floats:
        return np.insert(values.astype(float), np.repeat(positions, 2), np.column_stack([before, after]).ravel())

    side_left, side_entered = energy.find_sides(impacts)
    side = insert(history.trail.nodes["side"][rows], side_left, side_entered).astype(np.int64)
    v_before = (2.0 * side_left - 1.0) * impacts["speed_before"]
    v_after = (1.0 - 2.0 * side_entered) * impacts["speed_after"]
    rotation, velocity = (insert(theta, 0.0 * impact_times, 0.0 * impact_times), insert(rate, v_before, v_after))
    side_index = np.maximum(side, 0)
    unit = energy.unit_of_rotation[side_index]
    all_times, impact_rows = insert(times, impact_times, impact_times), positions + 2 * np.arange(len(positions))
    energies = energy.kinetic(velocity, side), energy.potential(rotation, side)
    return SampledInterval(all_times, rotation / unit, velocity / (energy.p[side_index] * unit), *energies, impact_rows)


def compute_boundary(response: ResponseData) -> tuple[Floats, Floats]:
    """Return rotations and velocities, in units of a `SampledInterval`, with the energy of the balance."""
    energy, gap = response._energy, np.array([np.nan])
    x: list[Floats] = []
    y: list[Floats] = []
    for side, sign in enumerate((1.0, -1.0)):
        u, speed = energy.compute_boundary(side)
        falling = np.where(u < 1.0, speed, -speed)  # two branches cross at the balance
        unit = energy.balance[side] / energy.unit_of_rotation[side]
        for direction in (1.0, -1.0) if len(u) else ():
            x += [sign * unit * u, gap]
            y += [direction * unit * falling, gap]
    return np.concatenate(x), np.concatenate(y)


def find_event_times(response: ResponseData, start: float, end: float) -> dict[str, Floats]:
    """Return the times of uplift and rest within an interval, s."""
    events = response.events
    inside = (events["time"] >= start) & (events["time"] <= end)
    return {kind: np.asarray(events["time"][inside & (events["kind"] == kind)], float) for kind in ("uplift", "rest")}


def draw_phase_plane(
    response: ResponseData, window: Sequence[float] | None, **options: Unpack[FigureOptions]
) -> Figure:
    """Draw normalised velocity against normalised rotation in a window, in units of a `SampledInterval`."""
    span = resolve_window(response, window)
    interval = sample_interval(response, *span)
    limit = response.block.coordinate.limit_name if response._energy.has_balances else "rad"
    with open_page((4.6, 4.2), **options) as page:
        (axes,) = page.create_panels()
        axes.axhline(0.0, color=INK, linewidth=0.4)
        axes.axvline(0.0, color=INK, linewidth=0.4)
        axes.plot(*compute_boundary(response), label="as much energy as at the balance", **_BOUNDARY)
        if len(rows := interval.impact_rows):
            jumps = np.column_stack([interval.velocity[rows], interval.velocity[rows + 1]])
            y = np.insert(jumps, 2, np.nan, axis=1).ravel()
            axes.plot(0.0 * y, y, color=GREY, linewidth=1.1, linestyle=(0, (1, 1.5)), label="impact")
        rotation, velocity = interval.insert_gaps(interval.rotation), interval.insert_gaps(interval.velocity)
        axes.plot(rotation, velocity, color=INK, linewidth=0.8, label="response")
        if name := " and ".join(kind for kind, times in find_event_times(response, *span).items() if len(times)):
            axes.plot(0.0, 0.0, "o", label=name, color=INK, markersize=5.0, markerfacecolor=PALE, zorder=4)
        for values, set_limits in ((rotation, axes.set_xlim), (velocity, axes.set_ylim)):
            reach = 1.1 * min(max(float(np.nanmax(np.abs(values), initial=0.0)), 1e-12), _MAX_RATIO)
            set_limits(-reach, reach)
        add_labels(axes, f"rotation / {limit}", f"velocity / (p × {limit})")
    return page.figure


def draw_energies(response: ResponseData, window: Sequence[float] | None, **options: Unpack[FigureOptions]) -> Figure:
    """Draw kinetic, potential and total energy, divided by the overturning energy, in a window."""
    interval = sample_interval(response, *resolve_window(response, window))
    time, total = interval.time, interval.kinetic + interval.potential
    with open_page((7.0, 3.0), **options) as page:
        (axes,) = page.create_panels()
        _shade_rest(axes, np.clip(response.rest_intervals, time[0], time[-1]))
        top = float(np.max(total, initial=0.0)) or 1.0
        axes.plot(time, total, color=INK, linewidth=1.4, label="total, which drops at impacts")
        axes.plot(time, interval.potential, color=GREY, linewidth=1.0, label="potential")
        axes.plot(time, interval.kinetic, color="#3c6aa0", linewidth=0.8, linestyle=(0, (4, 1.5)), label="kinetic")
        rows = interval.impact_rows
        axes.plot(time[rows], 0.0 * rows, "|", color=INK, markersize=6, markeredgewidth=0.5)
        levels = [level for level in response._energy.overturning_energy.tolist() if level < min(1.6 * top, math.inf)]
        for level in levels:
            axes.axhline(level, label="as much energy as at the balance", **_BOUNDARY)
        axes.set_xlim(time[0], time[-1])
        axes.set_ylim(0.0, 1.08 * max([min(top, 2.0 * max([1.0, *levels])), *levels]))
        add_labels(axes, "time (s)", "energy / least that overturns")
    return page.figure
