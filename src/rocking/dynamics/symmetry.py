"""Mirror images: bodies and motions whose courses have one half a period later, and orbits that are their own."""

from __future__ import annotations

from typing import Final

import numpy as np

from rocking.arrays import Flags, Floats
from rocking.dynamics.courses import response_of
from rocking.dynamics.maps import StroboscopicMap
from rocking.dynamics.repeated import repeated, scale_of
from rocking.motion.motion import Motion


class HalfMap(StroboscopicMap):
    """Map of a mirrored body under an antisymmetric motion to the mirror image of its state half a period later.

    Its square is the stroboscopic map.
    """

    def __init__(self, strobe: StroboscopicMap) -> None:
        super().__init__(strobe.body, strobe.motion, strobe.model, strobe.treatment)
        first = _first_half(strobe.motion)
        self.period *= 0.5
        self._ground = repeated(first, self.body.gravity, -1.0)
        self._steps = np.ascontiguousarray(self._steps[:, : len(first.coefficients)])  # as kernels take arrays

    def mirrored(self, state: Floats, halves: int) -> tuple[Floats, Floats]:
        """Mirror image of a state after an odd number of half periods, and its derivative; NaN where it overturns."""
        total, at = np.eye(2), state
        for _ in range(halves):
            if not np.all(np.isfinite(at)):  # a march from there would take all its turns
                break
            after, change = self.derivative(at)
            at, total = 0.0 - after, -change @ total
        return at, total


#: Fields of a body's record that are a side's own.
_OF_SIDES: Final = (
    "stiffness", "threshold_slope", "threshold", "slenderness", "restitution", "min_restitution", "restitution_slope",
    "restraint_threshold", "added_weight",
    "added_push", "prestress", "spring", "damping",
)  # fmt: skip


def is_mirrored(strobe: StroboscopicMap) -> bool:
    """Whether the mirror image of every course of a body is one half a period later."""
    record, (low, high) = strobe._records[0], strobe.body.stops
    if not strobe._is_two_sided or low != -high:
        return False
    same = all(record[name][0] == record[name][1] for name in _OF_SIDES)
    return same and _is_antisymmetric(strobe.motion)


def is_symmetric(strobe: StroboscopicMap, state: Floats, period: int) -> bool:
    """Whether an orbit is its own mirror image half a period of it later."""
    if period % 2 == 0 or not is_mirrored(strobe):
        return False
    after = response_of(strobe, state, period).states(0.5 * period * strobe.period)[:2]
    tolerance = 1e-9 * np.array(scale_of(strobe))
    return bool(np.all(np.abs(after + state) < tolerance))


def _first_half(motion: Motion) -> Motion:
    middle = int(np.argmin(np.abs(motion.breakpoints - 0.5 * motion.duration)))
    return Motion(motion.breakpoints[: middle + 1], motion.coefficients[:middle], error=motion.error)


def distances(times: Floats, marks: Floats, period: float) -> Floats:
    """Distance in time of each of some times to the nearest of some marks, all of them within a period that repeats."""
    marks = np.sort(marks)
    after = np.searchsorted(marks, times)
    away = np.abs(times - marks[[after - 1, after % len(marks)]])
    return np.asarray(np.min(np.minimum(away, period - away), axis=0))


def are_halved(motion: Motion) -> Flags:
    """Of each breakpoint but the last: whether there is another one half a period later."""
    starts, period = motion.breakpoints[:-1] - motion.breakpoints[0], motion.duration
    return distances(np.mod(starts + 0.5 * period, period), starts, period) <= 1e-14 * period


def _is_antisymmetric(motion: Motion) -> bool:
    """Whether the second half of a motion is the first one with the opposite sign, to rounding."""
    half = 0.5 * motion.duration
    if not are_halved(motion)[0]:
        return False
    times = half * (np.arange(200) + 0.5) / 200.0
    sums = motion.acceleration(times) + motion.acceleration(times + half)
    return bool(np.max(np.abs(sums)) <= 1e-12 * motion.pga)
