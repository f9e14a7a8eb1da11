"""How a response changes with what it was computed from, and what of it double precision cannot know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats
from rocking.kernels import state, variation
from rocking.kernels.trace import Trail
from rocking.tables import counted

#: A response is ambiguous when changes of the motion, the initial state and the block by one unit in the last place
#: move its peak by more than this fraction, or one of its events or impacts by more than this many seconds.
AMBIGUITY: Final = 1e-6

#: What a sensitivity is to.
QUANTITIES: Final = ("motion", "initial_rotation", "initial_velocity", "p", "alpha", "restitution")

#: What drives the block, as against what it is.
DRIVING: Final = QUANTITIES[:3]

_ULP: Final = 2.0**-52


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
        peak, struck, happened = np.zeros(count), np.zeros((count, impacts)), np.zeros((count, events))
        scratch, work = state.new_scratch(), state.record(state.VARIATION)
        for k in range(count):
            peak[k] = variation.vary(trail, scratch, work, k, peak_time, struck[k], happened[k])
        if overturned:
            peak[:] = 0.0
        return cls(*(_by_quantity(values) for values in (peak[:, None], struck, happened)))

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
