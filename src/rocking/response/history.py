"""What the steps of a march tell: rotations and forces at any time, when a body tips, how that changes with input."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Flags, Floats, Integers
from rocking.bisection import bisected
from rocking.body import ContactLaw
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.kernels.ground import components
from rocking.kernels.march import follow
from rocking.kernels.state import Records
from rocking.kernels.trace import Trail, trace, vary
from rocking.motion import piecewise
from rocking.tables import counted

#: Times at which each step of the last arc is looked at for its last passage of the balance point.
_LOOKS: Final = 33

#: Halvings of the time at which a body turns: the coordinate is stationary there.
_TURNINGS: Final = 30

#: A response is ambiguous when changes of the motion, the initial state and the block by one unit in the last place
#: move its peak by more than this fraction, or one of its events or impacts by more than this many seconds.
AMBIGUITY: Final = 1e-6

#: What a sensitivity is to.
QUANTITIES: Final = ("motion", "initial_rotation", "initial_velocity", "p", "alpha", "restitution")

#: What drives the block, as against what it is.
DRIVING: Final = QUANTITIES[:3]

#: What a rotation may be differentiated by, in the order of the kernels.
_NAMES: Final = (*QUANTITIES, *(f"{name}_{side}" for side in ("plus", "minus") for name in QUANTITIES[3:]))

_ULP: Final = 2.0**-52

#: Samples per step, rounds, and steps that are looked at again, when the forces' extremes are searched.
_SAMPLES: Final = 9
_REFINEMENTS: Final = 10
_MOST_REFINED: Final = 64

#: Impacts beyond the last resolved one are followed down to this speed, over p and in rad: what the motion changes and
#: what their speed adds are then nothing. So many of a sequence at most: all, up to a restitution of 0.998. And, of
#: bodies without stiffness, down to this share of the speed at which the sequence was closed.
_SLOWEST: Final = 1e-10
_MOST_IMPACTS: Final = 10_000
_LEAST_SHARE: Final = 1e-9

#: Coefficients of friction beyond those of any two materials.
_ROUGHEST: Final = 3.0

#: What is asked of the horizontal and the vertical force over the weight.
Measure = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True, eq=False)
class History:
    """The trail of a march as functions of time, from 0 to `end` (s)."""

    trail: Trail
    end: float
    stops: tuple[float, float]

    def states(self, time: ArrayLike) -> Floats:
        """Coordinate and its two rates at times of any shape, in one more dimension; NaN outside [0, end]."""
        times = checks.numbers(time, "time", InvalidOption)
        flat = times.ravel()
        found = self.states_in(flat, self.rows(flat))
        found[self.outside(flat)] = np.nan
        return found.reshape((*times.shape, 3))

    def states_in(self, times: Floats, rows: Integers) -> Floats:
        """Coordinate and its two rates at each time in the step that starts at the node of its row, shape (n, 3)."""
        found = np.empty((len(times), 3))
        given = times.view()
        given.flags.writeable = False  # one type, whatever the caller may do: `trace` is compiled once
        trace(self.trail, state.new_scratch(), given, rows, found)
        if any(self.stops):
            side = self.trail.nodes["side"][rows]
            found[:, 0] += np.array(self.stops)[np.where(side < 0, -1 - side, side)]
        return found

    def changes(self, time: ArrayLike, of: Iterable[str]) -> dict[str, Floats]:
        """Change the coordinate at times of any shape with each quantity, see `Sensitivity.rotation`."""
        times, nodes = checks.numbers(time, "time", InvalidOption), self.trail.nodes
        flat = times.ravel()
        order = np.argsort(flat, kind="stable")
        order = order[~self.outside(flat[order])]
        ascending = flat[order]
        ascending.flags.writeable = False
        rows = np.maximum(np.searchsorted(nodes["time"], ascending) - 1, 0)
        signs = np.where(nodes["side"][rows] == 1, -1.0, 1.0)
        rests = nodes["side"] < 0
        events = int(np.count_nonzero(rests[:-1] | rests[1:]))
        found = {}
        for name in of:
            if name not in _NAMES:
                raise InvalidOption(f"{{}} must be among {', '.join(_NAMES)}, not {name!r}", "of", value=name)
            values = np.full(flat.shape, np.nan)
            values[order] = signs * _varied(self.trail, _NAMES.index(name), ascending, len(nodes), events)[0]
            found[name] = values.reshape(times.shape)
        return found

    def rows(self, times: Floats) -> Integers:
        """Row of the node at which the step of each time starts."""
        rows = np.searchsorted(self.trail.nodes["time"], times, side="right") - 1
        return np.maximum(rows, 0).astype(np.int64)

    def outside(self, times: Floats) -> Flags:
        """Whether each time is outside [0, end], or none."""
        return ~((times >= 0.0) & (times <= self.end))

    def rests(self) -> Floats:
        """Start and end of each interval at rest, shape (n, 2), s."""
        nodes = self.trail.nodes
        rows = np.flatnonzero(nodes["side"] < 0)
        after = np.append(nodes["time"][1:], self.end)
        return np.column_stack([nodes["time"][rows], after[rows]])

    def tipping_time(self, balances: tuple[float, float]) -> float:
        """Last time, s, at which a body passes its unstable balance on the way out; NaN if it ends within it.

        ``balances``: coordinates of the balance on side + and side -.
        """
        nodes = self.trail.nodes
        if nodes["side"][-1] < 0:
            return math.nan
        last_arc = nodes[np.flatnonzero(nodes["u"] == 0.0)[-1] if np.any(nodes["u"] == 0.0) else 0 :]
        balance = balances[int(nodes["side"][-1])]

        def is_beyond(time: float) -> bool:
            return bool(abs(self.states(time)[0]) >= balance)

        if not is_beyond(self.end):
            return math.nan
        ends = last_arc["time"]
        times = (ends[:-1, None] + np.linspace(0.0, 1.0, _LOOKS) * np.diff(ends)[:, None]).ravel()
        within = np.flatnonzero(np.abs(self.states(times)[:, 0]) < balance)
        if not len(within):
            return float(ends[0])  # beyond it from the start
        return bisected(float(times[within[-1]]), float(times[min(within[-1] + 1, len(times) - 1)]), is_beyond)[1]

    def largest(self) -> tuple[float, float]:
        """Largest rotation of a block on each side, rad: at nodes, and where it turns within a step."""
        nodes = self.trail.nodes
        moving = np.flatnonzero(nodes["side"] >= 0)
        side, found = nodes["side"][moving], nodes["u"][moving].copy()
        sign = 1.0 - 2.0 * side
        low = nodes["time"][moving].copy()
        high = np.append(nodes["time"][1:], self.end)[moving]
        rising = (nodes["v"][moving] > 0.0) & (sign * self.states_in(high, moving)[:, 1] <= 0.0)
        at = np.flatnonzero(rising)
        for _ in range(_TURNINGS if len(at) else 0):
            middle = 0.5 * (low[at] + high[at])
            out = sign[at] * self.states_in(middle, moving[at])[:, 1] > 0.0
            low[at], high[at] = np.where(out, middle, low[at]), np.where(out, high[at], middle)
        found[at] = np.abs(self.states_in(low[at], moving[at])[:, 0])
        plus, minus = (float(np.max(found[side == k], initial=0.0)) for k in range(2))
        return plus, minus


def even_times(end: float, dt: float) -> Floats:
    """Multiples of a step from 0 to the end, s."""
    return dt * np.arange(math.floor(end / dt * (1.0 + 1e-12)) + 1, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Changes of a response per unit of relative change of what it was computed from.

    Structured arrays with the fields motion, initial_rotation, initial_velocity, p, alpha and restitution (of both
    sides together): a field times 1e-3 is what 0.1 % more of that quantity changes, to first order.

    Attributes
    ----------
    peak : structured array, shape (1,)
        Of the peak rotation, rad; 0 when overturned.
    impacts, events : structured array
        Of the times of the response's impacts and events, s.
    """

    peak: NDArray[np.void]
    impacts: NDArray[np.void]
    events: NDArray[np.void]
    _history: History

    def rotation(self, time: ArrayLike, of: Iterable[str] = QUANTITIES) -> dict[str, Floats]:
        """Return the change of the rotation at given times with each quantity.

        Parameters
        ----------
        time : array_like
            Times, s, of any shape.
        of : iterable of str
            Quantities: "motion", "initial_rotation", "initial_velocity", "p", "alpha" or "restitution"; the last three
            also with "_plus" or "_minus", of that side alone.

        Returns
        -------
        dict of str to ndarray
            By quantity, for each time: rad (of another body in the unit of its coordinate) per unit of relative change,
            with the sign of the rotation. 0 at rest; just before an impact, at one; NaN outside the response.

        Raises
        ------
        InvalidOption
            If a time is not a number, or there is no such quantity.

        Notes
        -----
        One pass along the response for each quantity, whatever the number of times. At a fixed time the rotation is
        continuous, and its derivative jumps at each impact (see "Impacts: restitution and sensitivity" in the
        documentation).

        Examples
        --------
        >>> import rocking
        >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
        >>> response = rocking.simulate(block, None, initial_rotation=0.1)
        >>> changes = response.sensitivity.rotation([0.2, 1.0], of=["p", "restitution_plus"])
        >>> {name: [f"{each:.5f}" for each in values] for name, values in changes.items()}
        {'p': ['-0.01640', '-0.09310'], 'restitution_plus': ['0.00000', '-0.11430']}
        """
        return self._history.changes(time, of)

    def __repr__(self) -> str:
        event = np.max(np.abs(self.events["motion"]), initial=0.0)
        return (
            f"<Sensitivity: 0.1 % more of the motion changes the peak by {1e-3 * self.peak['motion'][0]:.2g} rad and "
            f"the times of {counted(len(self.events), 'event')} by up to {1e-3 * event:.2g} s; "
            f"{counted(len(self.impacts), 'impact')}>"
        )


def sensitivity_along(
    trail: Trail, history: History, peak_time: float, impacts: int, events: int, *, fixed: bool
) -> Sensitivity:
    """Sensitivity of a response with that many impacts and events: one pass along its steps for each quantity.

    A fixed peak is that of a body that has fallen, or has reached a stop.
    """
    at = np.array([peak_time])
    at.flags.writeable = False
    found = [_varied(trail, k, at, impacts, events) for k in range(len(QUANTITIES))]
    peak, impact_times, event_times = (np.array(values) for values in zip(*found, strict=True))
    if fixed:
        peak[:] = 0.0
    return Sensitivity(_by_quantity(peak), _by_quantity(impact_times), _by_quantity(event_times), history)


def _varied(trail: Trail, quantity: int, times: Floats, impacts: int, events: int) -> tuple[Floats, Floats, Floats]:
    """Change heights at given times, so many impacts, and so many events with a quantity."""
    heights, at_impacts, at_events = np.empty(len(times)), np.zeros(impacts), np.zeros(events)
    vary(trail, state.new_scratch(), state.record(state.VARIATION), quantity, times, heights, at_impacts, at_events)
    return heights, at_impacts, at_events


def ambiguities(found: Sensitivity, height: float, near_ties: int) -> tuple[str, ...]:
    """Which of "peak", "events" and "touch" one unit in the last place of everything changes visibly.

    ``height`` is that of the peak above the stop.
    """
    peak, *times = (_ULP * _total(values, QUANTITIES) for values in (found.peak, found.events, found.impacts))
    known = {
        "peak": bool(np.all(peak <= AMBIGUITY * max(height, 1e-300))),
        "events": bool(np.all(np.concatenate(times) <= AMBIGUITY)),
        "touch": near_ties == 0,
    }
    return tuple(name for name, is_known in known.items() if not is_known)


def driving(found: Sensitivity) -> tuple[float, Floats, Floats]:
    """Sizes of the changes of peak, events and impacts with all that drives the block, per relative change."""
    return float(_total(found.peak, DRIVING)[0]), _total(found.events, DRIVING), _total(found.impacts, DRIVING)


def _total(values: NDArray[np.void], quantities: tuple[str, ...]) -> Floats:
    total: Floats = np.sum([np.abs(values[name]) for name in quantities], axis=0)
    return total


def _by_quantity(values: Floats) -> NDArray[np.void]:
    table = np.empty(values.shape[1], dtype=[(name, "f8") for name in QUANTITIES])
    for name, row in zip(QUANTITIES, values, strict=True):
        table[name] = row
    return table


def friction_coefficient(value: object) -> float:
    """Return a coefficient of friction.

    Raises
    ------
    InvalidOption
        If it is not positive, or larger than that of any two materials.
    """
    coefficient = checks.positive(value, "friction", InvalidOption)
    if coefficient > _ROUGHEST:
        raise InvalidOption(
            "{} must be a coefficient (friction over normal force, about 0.6 of stone on stone) of at most "
            f"{_ROUGHEST:g}, not {coefficient:g}; of an angle of friction take the tangent",
            "friction",
            value=value,
        )
    return coefficient


def friction_demand(horizontal: Floats, vertical: Floats) -> Floats:
    """Friction coefficient that sticking needs: |H|/N, infinite where the block would leave the ground, NaN of NaN."""
    demand = np.where(np.isnan(vertical), np.nan, np.inf)
    np.divide(np.abs(horizontal), vertical, out=demand, where=vertical > 0.0)
    return demand


def steps_to_events(nodes: Records, *, overturns: bool) -> Integers:
    """Rows of the nodes whose steps end in an uplift, a rest or, where the response so ends, an overturning."""
    rests = nodes["side"] < 0
    rows = np.flatnonzero(rests[:-1] | rests[1:])
    return np.append(rows, len(nodes) - 2) if overturns else rows


def steps_to_impacts(nodes: Records) -> Integers:
    """Rows of the nodes whose steps end in an impact; as `trace.is_impact`."""
    side, moves = nodes["side"], nodes["side"] >= 0
    onto_ground = moves[:-1] & moves[1:] & (nodes["u"][1:] == 0.0)
    rests = np.append(~moves, False)[2:]
    return np.flatnonzero(onto_ground & ((side[1:] != side[:-1]) | (nodes["v"][1:] > 0.0) | rests))


def with_all_impacts(trail: Trail, *, cut: bool) -> Trail:
    """Return the trail with the impacts between the last resolved one of each chattering sequence and its rest.

    ``cut``: whether the response ends within a sequence that is closed already. A sequence is closed where its end is
    proven, while its impacts still push and pull. They are followed here as far as that counts.
    """
    nodes = trail.nodes
    # A duration that ends within a sequence that is closed leaves no rest behind its last impact.
    rests = np.append(nodes["side"][1:] < 0, cut)
    closing = np.flatnonzero(rests & (nodes["side"] >= 0) & (nodes["u"] == 0.0))
    slowest = _SLOWEST * np.sqrt(np.abs(trail.block["stiffness"]))
    closing = closing[nodes["v"][closing] > slowest[nodes["side"][closing]]]
    if not len(closing):
        return trail
    body, rules, scratch = trail.block.copy(), trail.rules.copy(), state.new_scratch()
    rules["treatment"], rules["endless"], rules["record"] = state.RestRule.VELOCITY, False, True
    table = state.new_table(1024)
    parts, done = [], 0
    for row in closing:
        start = state.new_states(1, _MOST_IMPACTS)[0]
        for name in ("piece", "offset", "side", "u", "v", "law"):
            start[name] = nodes[name][row]
        start["plastic"] = _plastic_at(trail, row)
        body["limit"] = np.maximum(slowest, _LEAST_SHARE * start["v"])
        start["peak"] = math.inf  # nobody asks for the highest rotation; weight presses down where a rest is proven
        rules["stop"] = nodes["time"][row + 1] if row + 1 < len(nodes) else trail.rules["stop"]
        while follow(trail.ground, body, rules, table, scratch, start) == state.Ending.FULL:
            table = state.grown(table)
        found = table["node"][1 : start["nodes"]]
        parts += [nodes[done : row + 1], found[(found["side"] >= 0) & (found["time"] < rules["stop"])]]
        done = row + 1
    return trail._replace(nodes=state.attributed(np.concatenate([*parts, nodes[done:]])))


def _plastic_at(trail: Trail, row: int) -> float:
    """Plastic elongation of a tendon at a node, from where it last turned back; as `tendon.plastic_after`."""
    block, nodes = trail.block, trail.nodes[: row + 1]
    law = nodes["law"]
    turns = np.flatnonzero((law[:-1] == state.TendonLaw.PLASTIC) & (law[1:] == state.TendonLaw.ELASTIC)) + 1
    at = nodes[turns[-1] if len(turns) else 0]
    if not block["yielding"] or at["side"] < 0:
        return 0.0
    u = 2.0 * math.sin(0.5 * at["u"]) if trail.rules["nonlinear"] else at["u"]
    return max(0.0, float(block["opening"][at["side"]] * u - block["yields"]))


@dataclass(frozen=True, eq=False)
class Contact:
    """Horizontal and vertical force of the ground over the weight, up to the time `until` (s).

    Within a step the forces are smooth; both limits at every impact and at every jump of the motion are looked at. The
    impulses at impacts are not part of it.
    """

    history: History
    law: ContactLaw
    until: float

    def forces(self, time: ArrayLike) -> tuple[Floats, Floats]:
        """Both forces at times of any shape; NaN outside the response."""
        times = checks.numbers(time, "time", InvalidOption)
        flat = times.ravel()
        outside = self.history.outside(flat)
        within = np.where(outside, 0.0, flat)
        horizontal, vertical = self._forces_in(within, self.history.rows(within))
        horizontal[outside] = vertical[outside] = np.nan
        return horizontal.reshape(times.shape), vertical.reshape(times.shape)

    def largest(self, measure: Measure) -> float:
        """Largest value of a measure: steps whose samples come near it are sampled again, around their best."""
        times, rows = self._samples()
        values = self._measured(measure, times, rows)
        kept = np.argsort(values.max(axis=1))[-_MOST_REFINED:]
        return float(max(values.max(), self._peaks(measure, times[kept], rows[kept])[1].max()))

    def first(self, measure: Measure, is_beyond: Callable[[Floats], Flags]) -> float:
        """First time, s, at which a measure is beyond a level, as then all greater values are; NaN if it never is."""
        times, rows = self._samples()
        values = self._measured(measure, times, rows)
        highest = values.max(axis=1)
        with np.errstate(invalid="ignore"):
            # Between its samples, a smooth step rises above them by less than they span.
            reach = np.where(np.isfinite(highest), 2.0 * highest - values.min(axis=1), highest)
        near = np.flatnonzero(is_beyond(reach))
        if not len(near):
            return math.nan
        at, peaks = self._peaks(measure, times[near], rows[near])
        passing = np.flatnonzero(is_beyond(peaks))
        if not len(passing):
            return math.nan
        step = near[passing[0]]
        looks = np.append(times[step], at[passing[0]])
        beyond = is_beyond(np.append(values[step], peaks[passing[0]]))
        high = float(looks[beyond].min())
        before = looks[~beyond & (looks < high)]
        if not len(before):
            return high  # at once: a jump

        def passes(time: float) -> bool:
            return bool(is_beyond(self._measured(measure, np.array([time]), rows[step, :1]))[0])

        return bisected(float(before.max()), high, passes)[1]

    def _peaks(self, measure: Measure, times: Floats, rows: Integers) -> tuple[Floats, Floats]:
        """Where each of some steps has its largest value, and that value."""
        at, best = times[:, 0], np.full(len(times), -np.inf)
        for _ in range(_REFINEMENTS):
            values = self._measured(measure, times, rows)
            place = values.argmax(axis=1)[:, None]
            value, where = (np.take_along_axis(array, place, axis=1)[:, 0] for array in (values, times))
            at, best = np.where(value > best, where, at), np.maximum(value, best)
            low = np.take_along_axis(times, np.maximum(place - 1, 0), axis=1)
            high = np.take_along_axis(times, np.minimum(place + 1, times.shape[1] - 1), axis=1)
            times = low + (high - low) * np.linspace(0.0, 1.0, times.shape[1])
        return at, best

    def _measured(self, measure: Measure, times: Floats, rows: Integers) -> Floats:
        return measure(*self._forces_in(times.ravel(), rows.ravel())).reshape(times.shape)

    def _forces_in(self, times: Floats, rows: Integers) -> tuple[Floats, Floats]:
        """Compute the forces in the steps that start at these rows: on the side and under the piece of each."""
        theta, rate, acceleration = self.history.states_in(times, rows).T
        side = self.history.trail.nodes["side"][rows]
        ground = self._ground_in(times, rows, side < 0)
        return self.law((theta, rate, acceleration), ground, side)

    def _ground_in(self, times: Floats, rows: Integers, at_rest: Flags) -> tuple[Floats, Floats]:
        """Both ground accelerations in g: in the piece where a step starts; at rest, which may span many, anywhere."""
        ground = self.history.trail.ground
        anywhere = np.maximum(np.searchsorted(ground.pieces[:, 0], times, side="right") - 1, 0)
        piece = np.where(at_rest, anywhere, self.history.trail.nodes["piece"][rows])
        elapsed = np.maximum(times - ground.pieces[piece, 0], 0.0)
        push, *lift = (piecewise.value(coefficients, elapsed) for coefficients in components(ground, piece))
        return push, lift[0] if lift else np.zeros_like(push)

    def _samples(self) -> tuple[Floats, Integers]:
        """Sample every step, and at rest every piece of the motion, ends included and in order; with their steps."""
        nodes = self.history.trail.nodes
        corners = self.history.trail.ground.pieces[:, 0]
        corners = corners[nodes["side"][self.history.rows(corners)] < 0]
        starts = np.unique(np.concatenate([nodes["time"], corners]))
        starts = starts[(starts < self.until) | (starts == starts[0])]
        if nodes["side"][self.history.rows(np.array([self.until]))[0]] < 0:
            starts = np.union1d(starts, [self.until])  # what the motion is after a jump at the end
        ends = np.append(starts[1:], max(self.until, starts[-1]))
        rows = self.history.rows(starts)
        fractions = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, _SAMPLES))
        times = starts[:, None] + fractions * (ends - starts)[:, None]
        resting = nodes["side"][rows] < 0  # what the motion is before a jump
        times[resting, -1] = np.maximum(np.nextafter(times[resting, -1], 0.0), times[resting, 0])
        return times, np.repeat(rows[:, None], _SAMPLES, axis=1)
