"""Figures of a response: its histories, its course in the phase plane, its energy over time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Unpack, get_args

import numpy as np

from rocking.block.body import title_of
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.tables import as_written
from rocking.engine.problem import thresholds_of
from rocking.errors import InvalidOption
from rocking.plot.canvas import Place
from rocking.plot.response import DrawnSequence, RotationUnits, energy_figure, phase_figure, response_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rocking.response.response import Response

#: Even times of a drawn line: a history, and a course in the phase plane.
_EVEN_TIMES: Final = 4001
_EVEN_TIMES_OF_COURSE: Final = 3001

#: Impacts of a course that are drawn at most, evenly left out; and intervals between impacts that have more points, by
#: how many even steps they are long: arcs of shorter ones nobody sees.
_MOST_IMPACTS: Final = 2000
_SHORT: Final = (0.5, 12.0)
_POINTS_OF_SHORT: Final = 12


def titled(response: Response) -> str:
    """Return what was simulated, for the title of a figure."""
    shaken = "no motion" if response.motion is None else response.motion.label
    return as_written(f"{title_of(response.body)} under {shaken}")


def active_span(response: Response) -> tuple[float, float]:
    """Stretch worth drawing: from a little before the first event to a little after the last."""
    times = np.concatenate([response.events["time"], response.impacts["time"]])
    if len(times) == 0:
        return 0.0, response.duration
    first = float(times.min()) if response.states(0.0)[0] == 0.0 else 0.0
    margin = 0.1 * (float(times.max()) - first) + 0.5
    return max(0.0, first - margin), min(response.duration, float(times.max()) + margin)


def shown_span(response: Response, window: Sequence[float] | None) -> tuple[float, float]:
    """Return a window of a response, s, or else what is worth drawing; refuse what is no stretch of the response."""
    if window is None:
        return active_span(response)
    ends: Any = checks.numbers(window, "window", InvalidOption)
    if ends.shape != (2,) or not 0.0 <= ends[0] < ends[1] <= response.duration:
        raise InvalidOption(
            f"{{}} must be (start, end), in s, with 0 <= start < end <= {response.duration:.6g}, the duration",
            "window",
            value=window,
        )
    return float(ends[0]), float(ends[1])


def drawing_times(response: Response, start: float, end: float) -> Floats:
    """Return times dense enough for a smooth line: even ones, and those of steps that are long enough to see."""
    even = np.linspace(start, end, _EVEN_TIMES)
    steps = _within(response._history.trail.nodes["time"], start, end)
    visible = np.diff(np.floor(steps / max(even[1] - even[0], 1e-12)), prepend=-1.0) > 0.0
    return np.union1d(even, steps[visible])


def _within(times: Floats, start: float, end: float) -> Floats:
    return times[(times >= start) & (times <= end)]


def histories(
    response: Response,
    units: RotationUnits,
    window: Sequence[float] | None,
    *,
    longest_sequence: bool,
    **place: Unpack[Place],
) -> Figure:
    """Draw the rotation over the ground motion in a window."""
    checks.one_of(units, "units", InvalidOption, get_args(RotationUnits))
    start, end = shown_span(response, window)
    times, (body, motion) = drawing_times(response, start, end), (response.body, response.motion)
    corners = np.empty(0) if motion is None else motion.drawing_times(start, end)
    lift = None if motion is None or motion.vertical is None else motion.vertical.acceleration(corners)
    weight = 1.0 if lift is None else 1.0 + lift / body.gravity
    (pair,), (own,) = thresholds_of(body.alone(), response.model)
    with np.errstate(invalid="ignore"):  # of a body of one side, which nothing lifts to the other
        plus, minus = ((pair[k] + (weight - 1.0) * own[k]) / STANDARD_GRAVITY for k in range(2))
    balance = (response.balance[0], response.balance[0 if math.isinf(pair[1]) else 1])
    return response_figure(
        time=times,
        rotation=response.states(times)[:, 0],
        slenderness=balance,
        limit=body.coordinate.limit,
        impact_times=response.impacts["time"],
        rest_intervals=response.rest_intervals,
        uplift_times=response.events["time"][response.events["kind"] == "uplift"],
        overturn_time=response.overturn_time if response.overturned and response.overturn_time <= end else None,
        motion_time=corners,
        motion_acceleration_g=corners if motion is None else motion.acceleration(corners) / STANDARD_GRAVITY,
        thresholds_g=(plus, minus),
        vertical_acceleration_g=None if lift is None else lift / STANDARD_GRAVITY,
        duration=response.duration,
        chattering=_longest_sequence(response, start, end) if longest_sequence else None,
        units="rad" if units == "slenderness" and any(map(math.isinf, balance)) else units,
        label="" if body.coordinate.unit == "rad" else f"{body.coordinate.name} ({body.coordinate.unit})",
        **place,
    )


def _longest_sequence(response: Response, start: float, end: float) -> DrawnSequence | None:
    """Chattering sequence with the most impacts in the stretch."""
    inside = response.chattering[(response.chattering["start"] >= start) & (response.chattering["end"] <= end)]
    longest = max(inside, key=lambda row: row["impacts"], default=None)
    if longest is None:
        return None
    times = _within(response.impacts["time"], longest["start"], longest["end"])
    near = response.perturbed()
    off = float(near.event_spreads[response.events["time"] == longest["end"]].max(initial=0.0))
    return DrawnSequence(times, float(longest["lower"]), float(longest["upper"]), off, near.sample)


class Course(NamedTuple):
    """A stretch of a response, with the points of its impacts twice: before each and, at the same time, after it.

    Attributes
    ----------
    time : ndarray
        s.
    rotation, velocity : ndarray
        Rotation over the balance of its side (of a free block the slenderness), velocity over p times that; where a
        side has no balance, rotation in rad and velocity over p.
    kinetic, potential : ndarray
        Energies as of `Response.kinetic_energy`.
    before : ndarray of int
        Places of the points before impacts.
    """

    time: Floats
    rotation: Floats
    velocity: Floats
    kinetic: Floats
    potential: Floats
    before: Integers

    def parted(self, values: Floats) -> Floats:
        """Put a gap at each impact into values at these points: a line of them does not jump."""
        return np.insert(values, self.before + 1, np.nan)


def course_of(response: Response, start: float, end: float) -> Course:
    """Follow a response, of a body whose energy is known, from a time to a later one, s."""
    history, energy = response._history, response._energy
    even, step = np.linspace(start, end, _EVEN_TIMES_OF_COURSE, retstep=True)
    impacts = response.impacts[(response.impacts["time"] >= start) & (response.impacts["time"] <= end)]
    impacts = impacts[:: 1 + len(impacts) // _MOST_IMPACTS]
    at = np.asarray(impacts["time"], dtype=float)
    gaps = np.diff(at)
    short = np.flatnonzero((gaps > _SHORT[0] * step) & (gaps < _SHORT[1] * step))
    inside = at[short, None] + gaps[short, None] * np.linspace(0.0, 1.0, _POINTS_OF_SHORT)[1:-1]
    times = np.setdiff1d(np.union1d(even, inside.ravel()), at)
    rows = history.rows(times)
    theta, rate, _ = history.states_in(times, rows).T
    where = np.searchsorted(times, at)

    def joined(values: Floats | Integers, before: Floats | Integers, after: Floats | Integers) -> Floats:
        return np.insert(values.astype(float), np.repeat(where, 2), np.column_stack([before, after]).ravel())

    left, entered = energy.sides_at(impacts)
    side = joined(history.trail.nodes["side"][rows], left, entered).astype(np.int64)
    back, out = (2.0 * left - 1.0) * impacts["speed_before"], (1.0 - 2.0 * entered) * impacts["speed_after"]
    rotation, velocity = joined(theta, 0.0 * at, 0.0 * at), joined(rate, back, out)
    own = np.maximum(side, 0)
    unit = energy.unit_of_rotation[own]
    return Course(
        joined(times, at, at),
        rotation / unit,
        velocity / (energy.p[own] * unit),
        energy.kinetic(velocity, side),
        energy.potential(rotation, side),
        where + 2 * np.arange(len(where)),
    )


def boundary_of(response: Response) -> tuple[Floats, Floats]:
    """Rotations and velocities, in units of a `Course`, with as much energy as at the balance."""
    energy, gap = response._energy, np.array([np.nan])
    x: list[Floats] = []
    y: list[Floats] = []
    for side, sign in enumerate((1.0, -1.0)):
        u, speed = energy.boundary(side)
        falling = np.where(u < 1.0, speed, -speed)  # two branches cross at the balance
        unit = energy.balance[side] / energy.unit_of_rotation[side]
        for direction in (1.0, -1.0) if len(u) else ():
            x += [sign * unit * u, gap]
            y += [direction * unit * falling, gap]
    return np.concatenate(x), np.concatenate(y)


def marked(response: Response, start: float, end: float) -> dict[str, Floats]:
    """Return the times of uplift and rest within a stretch, s."""
    events = response.events
    inside = (events["time"] >= start) & (events["time"] <= end)
    return {kind: np.asarray(events["time"][inside & (events["kind"] == kind)], float) for kind in ("uplift", "rest")}


def phase_plane(response: Response, window: Sequence[float] | None, **place: Unpack[Place]) -> Figure:
    """Draw velocity against rotation in a window."""
    start, end = shown_span(response, window)
    course = course_of(response, start, end)
    return phase_figure(
        rotation=course.parted(course.rotation),
        velocity=course.parted(course.velocity),
        jumps=np.column_stack([course.velocity[course.before], course.velocity[course.before + 1]]),
        boundary=boundary_of(response),
        **{f"{kind}s": bool(len(times)) for kind, times in marked(response, start, end).items()},
        limit=response.body.coordinate.limit if response._energy.has_balances else "rad",
        **place,
    )


def energies(response: Response, window: Sequence[float] | None, **place: Unpack[Place]) -> Figure:
    """Draw kinetic, potential and total energy in a window."""
    course = course_of(response, *shown_span(response, window))
    return energy_figure(
        time=course.time,
        kinetic=course.kinetic,
        potential=course.potential,
        needed=response._energy.needed.tolist(),
        impact_times=course.time[course.before],
        rest_intervals=response.rest_intervals,
        **place,
    )
