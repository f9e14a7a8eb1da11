"""Impact by impact: the resolved sequence with its bracket, and the paper's semi-analytical closure (Eq. 75)."""

import math

import numpy as np
from numpy.typing import NDArray

from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.sine import STILL, WINDOW, arc, bracket, closure, first_arc, guess_landing


@kernel
def resolve(
    excess: float,
    delta: float,
    eta: float,
    tolerance: float,
    intervals: NDArray[np.float64],
    before: NDArray[np.float64],
    after: NDArray[np.float64],
) -> tuple[int, float, float, float]:
    """Fill intervals (phase) and speeds before and after each impact until the bracket is narrow or the arrays full.

    Returns the number of impacts, the phase of rest with its bracket [lower, upper] from the last impact's state. All
    three are NaN without a proof, and minus infinity where an arc outlasts x = pi (incomplete chattering).
    """
    x, w, P, D = first_arc(excess, delta)
    duration = x
    s = 1.0
    for n in range(intervals.size):
        if not duration >= 0.0:
            return n, -math.inf, -math.inf, -math.inf
        intervals[n] = duration
        before[n] = w
        after[n] = eta * w
        V = eta * w
        s = -s
        if s < 0.0:
            lower, upper = settled_bracket(x, V, P, D, delta, eta)
            if upper - lower <= tolerance * x:
                return n + 1, x + min(max(closure(V, P, D, eta), lower), upper), x + lower, x + upper
        duration, w, P, D = next_arc(x, V, P, D, s, delta)
        x += duration
    return intervals.size, math.nan, math.nan, math.nan


@inlined
def settled_bracket(x: float, V: float, P: float, D: float, delta: float, eta: float) -> tuple[float, float]:
    """Bracket on the remaining phase on entering the second side; NaN where the certificate does not hold."""
    window = WINDOW * closure(V, P, D, eta)
    lower, upper = bracket(V, P, D, window, delta, eta)
    holds = (upper <= window) & (x + window < math.pi)
    return lower if holds else math.nan, upper if holds else math.nan


@inlined
def next_arc(x: float, V: float, P: float, D: float, s: float, delta: float) -> tuple[float, float, float, float]:
    """Duration, impact speed, P and D of the arc that starts at phase x; a block at rest stays so."""
    if V < STILL:
        return 0.0, 0.0, P, D
    return arc(guess_landing(V, P, D, s, delta), V, P, D, s, delta, math.pi - x)


@kernel
def semianalytical_times(
    a: NDArray[np.float64],
    omega: NDArray[np.float64],
    eta: NDArray[np.float64],
    resolved: int,
    times: NDArray[np.float64],
) -> None:
    """Eq. 75 with so many resolved intervals, for each set of parameters; NaN: no rest before x = pi."""
    for i in range(times.size):
        times[i] = semianalytical_phase(a[i] - 1.0, 1.0 / (omega[i] * omega[i]), eta[i], resolved) / omega[i]


@shared
def semianalytical_phase(excess: float, delta: float, eta: float, resolved: int) -> float:
    """Eq. 75 in phase: the resolved intervals, then two more as the first terms of two geometric sums."""
    if excess == 0.0:
        return 0.0
    if not excess > 0.0:
        return math.nan
    newer, w, P, D = first_arc(excess, delta)
    older = 0.0
    x = newer
    s = 1.0
    for _ in range(resolved + 1):
        if not x < math.pi:
            return math.nan
        s = -s
        older = newer
        newer, w, P, D = next_arc(x, eta * w, P, D, s, delta)
        x += newer
    pair = eta * eta
    rest = x + (older + newer) * (pair / (1.0 - pair))
    return rest if rest < math.pi else math.nan
