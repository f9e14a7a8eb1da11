"""One sequence, impact by impact: the phase of rest, the resolved impacts, and the paper's Eq. 75."""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats, Integers
from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.sine import FOUND, OUTLASTS, UNRESOLVED
from rocking.kernels.sine.arc import State, arc, bounced, first_arc, guess_landing
from rocking.kernels.sine.closure import LEVELS, agree, extrapolate, remaining_phase, richardson_weights
from rocking.kernels.sine.proof import WINDOW, bracket, proven

#: Below this speed a block is at rest: what remains is nothing beside any phase.
_STILL: Final = 1e-120

#: Impact pairs after which a sequence is given up (eta = 0.99999 takes about a million).
_MAXIMUM_PAIRS: Final = 5_000_000

#: What one resolved impact is made of: phase since the one before, speed before and after.
IMPACT: Final = np.dtype((np.record, [("interval", np.float64), ("before", np.float64), ("after", np.float64)]))


@kernel
def rest_phase(excess: float, delta: float, eta: float) -> tuple[int, float]:
    """Status and phase omega tau_ch of rest for a = 1 + excess > 1; the phase means nothing unless it is FOUND."""
    status, x, impact = first_arc(excess, delta)
    if status != FOUND:
        return status, x
    return settle(x, bounced(impact, eta), delta, eta)


@shared
def settle(x: float, entered: State, delta: float, eta: float) -> tuple[int, float]:
    """Status and phase of rest of a block that enters the second side at x."""
    weights = richardson_weights(eta)
    row = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    gone = 0.0
    for pair in range(_MAXIMUM_PAIRS):
        if entered.V < _STILL:
            return FOUND, x
        last = row
        row = extrapolate(remaining_phase(entered, delta, eta), gone, weights, last)
        remaining = row[LEVELS]
        if pair > LEVELS and agree(row, last, gone, x) and proven(x, entered, delta, eta, remaining):
            return FOUND, x + remaining
        status, second, impact = next_arc(x, entered, -1.0, delta)
        if status != FOUND:
            return status, x
        status, first, impact = next_arc(x + second, bounced(impact, eta), 1.0, delta)
        if status != FOUND:
            return status, x
        entered = bounced(impact, eta)
        gone = second + first
        x += gone
    return UNRESOLVED, x


@inlined
def next_arc(x: float, start: State, s: float, delta: float) -> tuple[int, float, State]:
    """Status and duration of the arc that starts at phase x, and the state before its impact; a block at rest stays."""
    if start.V < _STILL:
        return FOUND, 0.0, State(0.0, start.P, start.D)
    return arc(start, guess_landing(start, s, delta), s, delta, math.pi - x)


@kernel
def resolve(
    excess: float, delta: float, eta: float, tolerance: float, impacts: NDArray[Any]
) -> tuple[int, int, float, float, float]:
    """Fill impacts until the bracket on the phase of rest is narrow, or their array full.

    Returns status, number of impacts, phase of rest, and its bracket [lower, upper] from the last impact's state. The
    phases mean something only where they are FOUND; the status is UNRESOLVED where the array is full.
    """
    status, duration, impact = first_arc(excess, delta)
    x = 0.0
    s = 1.0
    for n in range(impacts.size):
        if status != FOUND:
            return status, n, x, x, x
        x += duration
        impacts[n].interval = duration
        impacts[n].before = impact.V
        impacts[n].after = eta * impact.V
        start = bounced(impact, eta)
        s = -s
        if s < 0.0:
            remaining = remaining_phase(start, delta, eta)
            window = WINDOW * remaining
            lower, upper = bracket(start, window, delta, eta)
            if upper <= window and x + window < math.pi and upper - lower <= tolerance * x:
                return FOUND, n + 1, x + min(max(remaining, lower), upper), x + lower, x + upper
        status, duration, impact = next_arc(x, start, s, delta)
    return UNRESOLVED, impacts.size, x, x, x


@kernel
def semianalytical_phases(
    sequences: tuple[Floats, Floats, Floats],
    resolved: Integers,
    phases: Floats,
    statuses: NDArray[np.int8],
) -> None:
    """Status and phase of rest by Eq. 75 with so many resolved intervals, for each (a > 1, omega, eta)."""
    a, omega, eta = sequences
    for i in range(phases.size):
        delta = 1.0 / (omega[i] * omega[i])
        statuses[i], phases[i] = semianalytical_phase(a[i] - 1.0, delta, eta[i], resolved[i])


@shared
def semianalytical_phase(excess: float, delta: float, eta: float, resolved: int) -> tuple[int, float]:
    """Eq. 75 in phase: the resolved intervals, then two more as the first terms of two geometric sums."""
    status, newer, impact = first_arc(excess, delta)
    older = 0.0
    x = newer
    s = 1.0
    for _ in range(resolved + 1):
        if status != FOUND:
            return status, x
        s = -s
        older = newer
        status, newer, impact = next_arc(x, bounced(impact, eta), s, delta)
        x += newer
    if status != FOUND:
        return status, x
    pair = eta * eta
    rest = x + (older + newer) * (pair / (1.0 - pair))
    return FOUND if rest < math.pi else OUTLASTS, rest
