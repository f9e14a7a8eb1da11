"""What the steps of a march tell: where the body is at any time, when it tips, and how both change with the input."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Flags, Floats, Integers
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.kernels.trace import Trail, trace, vary
from rocking.tables import counted

#: Times at which each step of the last arc is looked at for its last passage of the balance point.
_LOOKS: Final = 33

#: A response is ambiguous when changes of the motion, the initial state and the block by one unit in the last place
#: move its peak by more than this fraction, or one of its events or impacts by more than this many seconds.
AMBIGUITY: Final = 1e-6

#: What a sensitivity is to.
QUANTITIES: Final = ("motion", "initial_rotation", "initial_velocity", "p", "alpha", "restitution")

#: What drives the block, as against what it is.
DRIVING: Final = QUANTITIES[:3]

_ULP: Final = 2.0**-52


@dataclass(frozen=True, eq=False)
class History:
    """The trail of a march as functions of time, from 0 to `end` (s)."""

    trail: Trail
    end: float

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
        trace(self.trail, state.new_scratch(), times, rows, found)
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
        rows = np.flatnonzero(nodes["side"] == state.AT_REST)
        after = np.append(nodes["time"][1:], self.end)
        return np.column_stack([nodes["time"][rows], after[rows]])

    def tipping_time(self, balances: tuple[float, float]) -> float:
        """Last time, s, at which a body passes its unstable balance on the way out; NaN if it ends within it.

        ``balances``: coordinates of the balance on side + and side -.
        """
        nodes = self.trail.nodes
        if nodes["side"][-1] == state.AT_REST:
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
        return bisected(float(times[within[-1]]), float(times[min(within[-1] + 1, len(times) - 1)]), is_beyond)


def bisected(low: float, high: float, holds: Callable[[float], bool]) -> float:
    """Time from which on something holds, between one at which it does not and one at which it does."""
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return high
        low, high = (low, middle) if holds(middle) else (middle, high)


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

    @classmethod
    def along(cls, trail: Trail, peak_time: float, impacts: int, events: int, *, overturned: bool) -> Sensitivity:
        """Sensitivity of a response with that many impacts and events: one pass along its steps for each quantity."""
        count = len(QUANTITIES)
        peak, impact_times, event_times = np.zeros(count), np.zeros((count, impacts)), np.zeros((count, events))
        scratch, work = state.new_scratch(), state.record(state.VARIATION)
        for k in range(count):
            peak[k] = vary(trail, scratch, work, k, peak_time, impact_times[k], event_times[k])
        if overturned:
            peak[:] = 0.0
        return cls(*(_by_quantity(values) for values in (peak[:, None], impact_times, event_times)))

    def __repr__(self) -> str:
        event = np.max(np.abs(self.events["motion"]), initial=0.0)
        return (
            f"<Sensitivity: 0.1 % more of the motion changes the peak by {1e-3 * self.peak['motion'][0]:.2g} rad and "
            f"the times of {counted(len(self.events), 'event')} by up to {1e-3 * event:.2g} s; "
            f"{counted(len(self.impacts), 'impact')}>"
        )

    def ambiguities(self, peak_rotation: float, near_ties: int) -> tuple[str, ...]:
        """Which of "peak", "events" and "touch" one unit in the last place of everything changes visibly."""
        peak, *times = (_ULP * _total(values, QUANTITIES) for values in (self.peak, self.events, self.impacts))
        known = {
            "peak": bool(np.all(peak <= AMBIGUITY * max(peak_rotation, 1e-300))),
            "events": bool(np.all(np.concatenate(times) <= AMBIGUITY)),
            "touch": near_ties == 0,
        }
        return tuple(name for name, is_known in known.items() if not is_known)

    def driving(self) -> tuple[float, Floats]:
        """Sizes of the changes of the peak and of the events with all that drives the block, per relative change."""
        return float(_total(self.peak, DRIVING)[0]), _total(self.events, DRIVING)


def _total(values: NDArray[np.void], quantities: tuple[str, ...]) -> Floats:
    total: Floats = np.sum([np.abs(values[name]) for name in quantities], axis=0)
    return total


def _by_quantity(values: Floats) -> NDArray[np.void]:
    table = np.empty(values.shape[1], dtype=[(name, "f8") for name in QUANTITIES])
    for name, row in zip(QUANTITIES, values, strict=True):
        table[name] = row
    return table
