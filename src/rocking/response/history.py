"""States, rests and tipping from the nodes of a solution, and the impacts beyond a proof."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.bisection import bisected, halved, middle
from rocking.core.tables import counted
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.kernels.march import march
from rocking.kernels.state import Records
from rocking.kernels.trace import Trail, copy_trail, trace

#: Times at which each step of the last arc is looked at for its last passage of the balance point.
_LOOKS: Final = 33

#: Parts of a step, each of which is looked at for where a body turns back; and halvings of the time at which it does:
#: the coordinate is stationary there.
_PARTS: Final = 8
_TURNINGS: Final = 30


#: Impacts beyond the last resolved one are followed down to this speed, over p and in rad: what the motion changes and
#: what their speed adds are then nothing. So many of a sequence at most: all, up to a restitution of 0.998. And, of
#: bodies without stiffness, down to this share of the speed at which the sequence was closed.
_SLOWEST: Final = 1e-10
_MOST_IMPACTS: Final = 10_000
_LEAST_SHARE: Final = 1e-9


class Solution(NamedTuple):
    """What the integration returned, from which a response computes everything else."""

    trail: Trail  # ground, body and settings as kernels take them, and the nodes of the series
    sequences: NDArray[np.void]  # as they were proven, without the rounding before the proof
    residual: float  # coordinate at the end
    again: Callable[[float], Any]  # repeats the simulation with the motion and the start multiplied by a factor

    def __repr__(self) -> str:
        return f"<Solution: {counted(len(self.trail.nodes), 'node')}>"


@dataclass(frozen=True, eq=False)
class History:
    """The trail of a march as functions of time, from 0 to `end` (s)."""

    trail: Trail
    end: float
    stops: tuple[float, float]

    def states(self, time: ArrayLike) -> Floats:
        """Coordinate and its two rates at times of any shape, in one more dimension; NaN outside [0, end]."""
        return self.states_and_sides(time)[0]

    def states_and_sides(self, time: ArrayLike) -> tuple[Floats, Integers]:
        """Return `states`, and the side at each time: 0, 1, or negative at rest."""
        times = checks.numbers(time, "time", InvalidOption)
        flat = times.ravel()
        rows = self.rows(flat)
        found = self.states_in(flat, rows)
        found[self.outside(flat)] = np.nan
        sides = self.trail.nodes["side"][rows].astype(np.int64)
        return found.reshape((*times.shape, 3)), sides.reshape(times.shape)

    def states_in(self, times: Floats, rows: Integers) -> Floats:
        """Coordinate and its two rates at each time in the step that starts at the node of its row, shape (n, 3)."""
        found = np.empty((len(times), 3))
        given = times.view()
        given.flags.writeable = False  # one type, whatever the caller may do: `trace` is compiled once
        trace(copy_trail(self.trail), state.new_scratch(), given, rows, found)
        if any(self.stops):
            side = self.trail.nodes["side"][rows]
            found[:, 0] += np.array(self.stops)[np.where(side < 0, -1 - side, side)]
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
        """Largest rotation of a block on each side, rad: at the ends of parts of steps, or where it turns."""
        nodes = self.trail.nodes
        moving = np.flatnonzero(nodes["side"] >= 0)
        side = nodes["side"][moving]
        ends = np.append(nodes["time"][1:], self.end)[moving]
        times = np.linspace(nodes["time"][moving], ends, _PARTS + 1, axis=1)
        states = self.states_in(times.ravel(), np.repeat(moving, _PARTS + 1)).reshape(*times.shape, 3)
        found, rate = np.abs(states[..., 0]).max(axis=1), (1.0 - 2.0 * side)[:, None] * states[..., 1]
        step, part = np.nonzero((rate[:, :-1] >= 0.0) & (rate[:, 1:] <= 0.0))
        low, high, rows, sign = times[step, part], times[step, part + 1], moving[step], 1.0 - 2.0 * side[step]
        for _ in range(_TURNINGS if len(step) else 0):
            out = sign * self.states_in(middle(low, high), rows)[:, 1] > 0.0
            low, high = halved(low, high, out, ~out)
        np.maximum.at(found, step, np.abs(self.states_in(low, rows)[:, 0]))
        plus, minus = (float(np.max(found[side == k], initial=0.0)) for k in range(2))
        return plus, minus


def even_times(end: float, dt: float) -> Floats:
    """Multiples of a step from 0 to the end, s."""
    return np.minimum(dt * np.arange(math.floor(end / dt * (1.0 + 1e-12)) + 1, dtype=np.float64), end)


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
    body, rules, scratch = trail.block.copy(), trail.settings.copy(), state.new_scratch()
    rules["treatment"], rules["no_end_time"], rules["record"] = state.RestRule.VELOCITY, False, True
    table = state.new_table(1024)
    parts, done, plastic = [], 0, plastic_elongations(trail)
    for row in closing:
        start = state.state_at(nodes[row], plastic[row], _MOST_IMPACTS)
        body["limit"] = np.maximum(slowest, _LEAST_SHARE * start["v"])
        start["peak"] = math.inf  # nobody asks for the highest rotation; weight presses down where a rest is proven
        rules["stop"] = nodes["time"][row + 1] if row + 1 < len(nodes) else trail.settings["stop"]
        while march(trail.ground, body, rules, table, scratch, start) == state.Ending.FULL:
            table = state.grown(table)
        found = table["node"][1 : start["nodes"]]
        parts += [nodes[done : row + 1], found[(found["side"] >= 0) & (found["time"] < rules["stop"])]]
        done = row + 1
    return trail._replace(nodes=state.attributed(np.concatenate([*parts, nodes[done:]])))


def elongation(trail: Trail, rotations: Floats, side: Integers) -> Floats:
    """Elongation of the tendon that may yield at rotations to each side, m."""
    bend = 2.0 * np.sin(0.5 * rotations) if trail.settings["nonlinear"] else rotations
    return np.asarray(trail.block["lever_arm"][np.maximum(side, 0)] * bend)


def plastic_elongations(trail: Trail) -> Floats:
    """Plastic elongation of a tendon from each node on, m; as `tendon.plastic_after`."""
    nodes = trail.nodes
    if not trail.block["yielding"]:
        return np.zeros(len(nodes))
    law, side = nodes["law"], nodes["side"]
    turns = np.append(side[:1] >= 0, (law[1:] == state.TendonLaw.ELASTIC) & (law[:-1] == state.TendonLaw.PLASTIC))
    after = np.maximum(0.0, elongation(trail, nodes["u"], side) - trail.block["yields"])
    last = np.maximum.accumulate(np.where(turns, np.arange(len(nodes)), -1))
    return np.where(last >= 0, after[last], 0.0)
