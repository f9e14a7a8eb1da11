"""The first arc, beyond half a period: the ground pulls the block down and pushes it up in turn.

The first side's restoring acceleration P = 1 - cos x - kappa sin x is negative in the first part of each period, up to
2 arctan(kappa), and positive in the second. Where it is positive, an arc that has come down to zero goes on falling
(U'' = delta U - P), so that its sign at the end tells whether it has landed. Where it is negative, the height is convex
as long as it is positive, so that its lowest point tells.
"""

import math
from typing import Final

from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.sine import FOUND, OUTLASTS
from rocking.kernels.sine.arc import State, height, land, rise, uplift
from rocking.kernels.sine.basis import basis

#: Longest arc that is followed, as a time p t: rounding grows by its exponential.
LONGEST: Final = 20.0

_MOST_HALVINGS: Final = 2_000


@kernel
def first_landing(excess: float, omega: float) -> tuple[int, float, float]:
    """Phase of the first impact for a = 1 + excess > 1, and the speed before it; OUTLASTS if none comes in time."""
    delta = 1.0 / (omega * omega)
    start = uplift(excess)
    turn = 2.0 * math.atan(-start.D)
    for period in range(1 + int(LONGEST * omega / (2.0 * math.pi))):
        begin = 2.0 * math.pi * period
        pulled = begin + turn
        end = begin + 2.0 * math.pi
        if period > 0:
            lowest = lowest_point(begin, pulled, start, delta)
            if height(lowest, start, 1.0, delta, basis(lowest, delta)) <= 0.0:
                return landed(begin, lowest, start, delta)
        if height(end, start, 1.0, delta, basis(end, delta)) <= 0.0:
            return landed(pulled, end, start, delta)
    return OUTLASTS, end, 0.0


@inlined
def lowest_point(low: float, high: float, start: State, delta: float) -> float:
    """Where an arc that is convex as long as it is up is lowest; where it is not up, if it comes down."""
    if rise(low, start, 1.0, delta, basis(low, delta)) >= 0.0:
        return low
    if rise(high, start, 1.0, delta, basis(high, delta)) <= 0.0:
        return high
    for _ in range(_MOST_HALVINGS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        at = basis(middle, delta)
        if height(middle, start, 1.0, delta, at) <= 0.0:
            return middle
        if rise(middle, start, 1.0, delta, at) < 0.0:
            low = middle
        else:
            high = middle
    return low


@shared
def landed(low: float, high: float, start: State, delta: float) -> tuple[int, float, float]:
    """Status, phase and speed of the one landing between two phases."""
    for _ in range(_MOST_HALVINGS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        if height(middle, start, 1.0, delta, basis(middle, delta)) > 0.0:
            low = middle
        else:
            high = middle
    return FOUND, high, land(high, start, 1.0, delta, basis(high, delta)).impact.V
