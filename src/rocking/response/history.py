"""Where the block is at any time, and when it tips: from the steps of a march."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats, Integers
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.kernels.trace import Trail, trace

#: Times at which each step of the last arc is looked at for its last passage of the balance point.
_LOOKS: Final = 33


@dataclass(frozen=True, eq=False)
class History:
    """The trail of a march as functions of time, from 0 to `end` (s)."""

    trail: Trail
    end: float

    def states(self, time: ArrayLike) -> Floats:
        """theta, theta', theta'' at times of any shape, in one more dimension; NaN outside [0, end]."""
        times = checks.numbers(time, "time", InvalidOption)
        flat = times.ravel()
        found = self.states_in(flat, self.rows(flat))
        found[self.outside(flat)] = np.nan
        return found.reshape((*times.shape, 3))

    def states_in(self, times: Floats, rows: Integers) -> Floats:
        """theta, theta', theta'' at each time in the step that starts at the node of its row, shape (n, 3)."""
        found = np.empty((len(times), 3))
        trace(self.trail, state.new_scratch(), times, rows, found)
        return found

    def rows(self, times: Floats) -> Integers:
        """Row of the node at which the step of each time starts."""
        rows = np.searchsorted(self.trail.nodes["time"], times, side="right") - 1
        return np.maximum(rows, 0).astype(np.int64)

    def outside(self, times: Floats) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Whether each time is outside [0, end], or none."""
        return ~((times >= 0.0) & (times <= self.end))

    def rests(self) -> Floats:
        """Start and end of each interval at rest, shape (n, 2), s."""
        nodes = self.trail.nodes
        rows = np.flatnonzero(nodes["side"] == state.AT_REST)
        after = np.append(nodes["time"][1:], self.end)
        return np.column_stack([nodes["time"][rows], after[rows]])

    def tipping_time(self, slenderness: tuple[float, float]) -> float:
        """Last time, s, at which a block passes its balance point on the way out; NaN if it ends within it.

        Parameters
        ----------
        slenderness
            Of side + and side -, rad.
        """
        nodes = self.trail.nodes
        if nodes["side"][-1] == state.AT_REST:
            return math.nan
        last_arc = nodes[np.flatnonzero(nodes["u"] == 0.0)[-1] if np.any(nodes["u"] == 0.0) else 0 :]
        balance = slenderness[int(nodes["side"][-1])]

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
