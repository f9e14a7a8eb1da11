"""States, rests and tipping from the nodes of a solution, and the impacts after a proof."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.bisection import bisect, compute_midpoints, halve
from rocking.core.tables import format_count
from rocking.errors import OptionError
from rocking.kernels import state
from rocking.kernels.march import march
from rocking.kernels.state import Structs
from rocking.kernels.trace import Trail, copy_trail, trace

#: Number of samples per step in the search for the last passage of the balance.
_SAMPLES_PER_STEP: Final = 33

#: Parts of a step in the search for turning points, and bisections of the time of a turning point, at which the
#: coordinate is stationary.
_PARTS_PER_STEP: Final = 8
_BISECTION_COUNT: Final = 30


#: Bounds on the impacts after the last resolved one: smallest speed, divided by p and in rad, below which the motion
#: and the impacts no longer contribute; largest number per sequence, which suffices for restitutions up to 0.998; for
#: bodies without stiffness, smallest ratio to the speed at the end of the resolved sequence.
_MIN_SPEED: Final = 1e-10
_MAX_IMPACTS: Final = 10_000
_MIN_SPEED_RATIO: Final = 1e-9


class Solution(NamedTuple):
    """Result of the integration, from which a response is computed."""

    trail: Trail  # ground, body and settings for kernels, and the nodes of the series
    sequences: NDArray[np.void]  # as proven, without the rounding before the proof
    residual: float  # coordinate at the end
    repeat: Callable[[float], Any]  # repeats the simulation with the motion and the start multiplied by a factor

    def __repr__(self) -> str:
        return f"<Solution: {format_count(len(self.trail.nodes), 'node')}>"


@dataclass(frozen=True, eq=False)
class TimeHistory:
    """Computed solution as functions of time, from 0 to `end` (s)."""

    trail: Trail
    end: float
    stops: tuple[float, float]

    def states(self, time: ArrayLike) -> Floats:
        """Return the coordinate and its two rates at times of any shape, as last dimension; NaN outside [0, end]."""
        return self.compute_states_and_sides(time)[0]

    def compute_states_and_sides(self, time: ArrayLike) -> tuple[Floats, Integers]:
        """Return `states`, and the side at each time: 0, 1, or negative at rest."""
        times = checks.numbers(time, "time", OptionError)
        flat = times.ravel()
        rows = self.find_rows(flat)
        states = self.compute_states(flat, rows)
        states[self.is_outside(flat)] = np.nan
        sides = self.trail.nodes["side"][rows].astype(np.int64)
        return states.reshape((*times.shape, 3)), sides.reshape(times.shape)

    def slip_states(self, time: ArrayLike, gravity: float) -> Floats:
        """Return displacement, m, and velocity, m/s, of the foot at times of any shape; NaN outside [0, end]."""
        times = checks.numbers(time, "time", OptionError)
        flat = times.ravel()
        slips = gravity * self.compute_states(flat, self.find_rows(flat), columns=5)[:, 3:]
        slips[self.is_outside(flat)] = np.nan
        return slips.reshape((*times.shape, 2))

    def compute_states(self, times: Floats, rows: Integers, columns: int = 3) -> Floats:
        """Return coordinate and rates, shape (n, 3), at times in the steps that start at these rows.

        With five columns, the last two are displacement and velocity of the foot divided by g.
        """
        states = np.empty((len(times), columns))
        sample_times = times.view()
        sample_times.flags.writeable = False  # one type for any caller: `trace` is compiled once
        trace(copy_trail(self.trail), state.create_scratch(), sample_times, rows, states)
        if any(self.stops):
            side = self.trail.nodes["side"][rows]
            states[:, 0] += np.array(self.stops)[np.where(side < 0, -1 - side, side)]
        return states

    def find_rows(self, times: Floats) -> Integers:
        """Return the row of the first node of the step of each time."""
        rows = np.searchsorted(self.trail.nodes["time"], times, side="right") - 1
        return np.maximum(rows, 0).astype(np.int64)

    def is_outside(self, times: Floats) -> Flags:
        """Return whether each time is outside [0, end] or NaN."""
        return ~((times >= 0.0) & (times <= self.end))

    def find_rests(self) -> Floats:
        """Return start and end of each interval at rest, shape (n, 2), s."""
        nodes = self.trail.nodes
        rows = np.flatnonzero((nodes["side"] < 0) & (nodes["direction"] == 0))
        ends = np.append(nodes["time"][1:], self.end)
        return np.column_stack([nodes["time"][rows], ends[rows]])

    def find_slips(self) -> Floats:
        """Return start and end of each interval of slip, shape (n, 2), s."""
        nodes = self.trail.nodes
        slips = np.concatenate([[False], nodes["direction"] != 0, [False]])
        rows = np.flatnonzero(slips[1:] != slips[:-1])
        times = np.append(nodes["time"], self.end)[rows]
        return times.reshape(-1, 2)

    def compute_tipping_time(self, balances: tuple[float, float]) -> float:
        """Return the last time, s, at which a body passes its unstable balance outwards; NaN if it ends within it.

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
        times = (ends[:-1, None] + np.linspace(0.0, 1.0, _SAMPLES_PER_STEP) * np.diff(ends)[:, None]).ravel()
        within = np.flatnonzero(np.abs(self.states(times)[:, 0]) < balance)
        if not len(within):
            return float(ends[0])  # beyond it from the start
        return bisect(float(times[within[-1]]), float(times[min(within[-1] + 1, len(times) - 1)]), is_beyond)[1]

    def find_peaks(self) -> tuple[float, float]:
        """Return the largest rotation of a block on each side, rad, from parts of steps and turning points."""
        nodes = self.trail.nodes
        moving = np.flatnonzero(nodes["side"] >= 0)
        side = nodes["side"][moving]
        ends = np.append(nodes["time"][1:], self.end)[moving]
        times = np.linspace(nodes["time"][moving], ends, _PARTS_PER_STEP + 1, axis=1)
        states = self.compute_states(times.ravel(), np.repeat(moving, _PARTS_PER_STEP + 1)).reshape(*times.shape, 3)
        peaks, rate = np.abs(states[..., 0]).max(axis=1), (1.0 - 2.0 * side)[:, None] * states[..., 1]
        step, part = np.nonzero((rate[:, :-1] >= 0.0) & (rate[:, 1:] <= 0.0))
        low, high, rows, sign = times[step, part], times[step, part + 1], moving[step], 1.0 - 2.0 * side[step]
        for _ in range(_BISECTION_COUNT if len(step) else 0):
            is_outward = sign * self.compute_states(compute_midpoints(low, high), rows)[:, 1] > 0.0
            low, high = halve(low, high, is_outward, ~is_outward)
        np.maximum.at(peaks, step, np.abs(self.compute_states(low, rows)[:, 0]))
        plus, minus = (float(np.max(peaks[side == k], initial=0.0)) for k in range(2))
        return plus, minus


def create_times(end: float, dt: float) -> Floats:
    """Return multiples of a step from 0 to the end, s."""
    return np.minimum(dt * np.arange(math.floor(end / dt * (1.0 + 1e-12)) + 1, dtype=np.float64), end)


def find_event_steps(nodes: Structs, *, overturns: bool) -> Integers:
    """Return the rows of nodes whose steps end in an uplift, a rest or, if specified, overturning."""
    rests = nodes["side"] < 0
    rows = np.flatnonzero(rests[:-1] | rests[1:])
    return np.append(rows, len(nodes) - 2) if overturns else rows


def find_impact_steps(nodes: Structs) -> Integers:
    """Return the rows of nodes whose steps end in an impact, as `trace.is_impact`."""
    side, moves = nodes["side"], nodes["side"] >= 0
    onto_ground = moves[:-1] & moves[1:] & (nodes["u"][1:] == 0.0)
    rests = np.append(~moves, False)[2:]
    return np.flatnonzero(onto_ground & ((side[1:] != side[:-1]) | (nodes["v"][1:] > 0.0) | rests))


def add_all_impacts(trail: Trail, *, ends_in_sequence: bool) -> Trail:
    """Return the trail with the impacts between the last resolved one of each chattering sequence and its rest.

    ``ends_in_sequence``: whether the response ends within a sequence after its proof. Later impacts still exert forces,
    and are computed as far as they contribute.
    """
    nodes = trail.nodes
    # No rest follows the last impact if the duration ends within a sequence after its proof.
    rests = np.append(nodes["side"][1:] < 0, ends_in_sequence)
    last_impacts = np.flatnonzero(rests & (nodes["side"] >= 0) & (nodes["u"] == 0.0))
    min_speeds = _MIN_SPEED * np.sqrt(np.abs(trail.block["stiffness"]))
    last_impacts = last_impacts[nodes["v"][last_impacts] > min_speeds[nodes["side"][last_impacts]]]
    if not len(last_impacts):
        return trail
    body, settings, scratch = trail.block.copy(), trail.settings.copy(), state.create_scratch()
    settings["rest_rule"], settings["no_end_time"], settings["writes_tables"] = state.RestRule.VELOCITY, False, True
    table = state.create_table(1024)
    parts, next_row, plastic_elongations = [], 0, compute_plastic_elongations(trail)
    for row in last_impacts:
        start = state.create_state_at_node(nodes[row], plastic_elongations[row], _MAX_IMPACTS)
        body["rest_limit"] = np.maximum(min_speeds, _MIN_SPEED_RATIO * start["v"])
        start["peak"] = math.inf  # the peak is not needed, and weight is positive at a proven rest
        settings["stop_time"] = nodes["time"][row + 1] if row + 1 < len(nodes) else trail.settings["stop_time"]
        while march(trail.ground, body, settings, table, scratch, start) == state.MarchStatus.FULL:
            table = state.enlarge_table(table)
        later = table["node"][1 : start["node_count"]]
        parts += [nodes[next_row : row + 1], later[(later["side"] >= 0) & (later["time"] < settings["stop_time"])]]
        next_row = row + 1
    return trail._replace(nodes=state.expose_fields(np.concatenate([*parts, nodes[next_row:]])))


def compute_elongation(trail: Trail, rotations: Floats, side: Integers) -> Floats:
    """Return the elongation of a yielding tendon at rotations to each side, m."""
    opening_ratio = 2.0 * np.sin(0.5 * rotations) if trail.settings["nonlinear"] else rotations
    return np.asarray(trail.block["lever_arm"][np.maximum(side, 0)] * opening_ratio)


def compute_plastic_elongations(trail: Trail) -> Floats:
    """Return the plastic elongation of a tendon from each node on, m, as `restraints.update_plastic_elongation`."""
    nodes = trail.nodes
    if not trail.block["yielding"]:
        return np.zeros(len(nodes))
    law, side = nodes["tendon_law"], nodes["side"]
    unloads = np.append(side[:1] >= 0, (law[1:] == state.TendonLaw.ELASTIC) & (law[:-1] == state.TendonLaw.PLASTIC))
    plastic_elongations = np.maximum(0.0, compute_elongation(trail, nodes["u"], side) - trail.block["yield_elongation"])
    last = np.maximum.accumulate(np.where(unloads, np.arange(len(nodes)), -1))
    return np.where(last >= 0, plastic_elongations[last], 0.0)
