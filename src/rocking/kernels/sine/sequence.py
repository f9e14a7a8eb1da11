"""One sequence: phase of rest with its proof, resolved impacts, and critical amplitude.

The remaining phase is an expansion in the speed, extrapolated over successive pairs of impacts. The critical amplitude
is the largest a whose first chattering sequence accumulates before x = pi. Parameters are finite.
"""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.core.arrays import Floats, Integers
from rocking.kernels.certificate import Bounds, geometric_bracket
from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.remaining import Restoring, remaining_time
from rocking.kernels.sine import Verdict
from rocking.kernels.sine.arc import LARGEST_EXCESS, State, arc, bounced, estimated_duration, first_arc

#: Number of extrapolations of that expansion, and relative agreement at which they are accepted.
LEVELS: Final = 5
_AGREEMENT: Final = 1e-13

#: Estimate of the remaining phase and its successive extrapolations; their factors.
Row = tuple[float, float, float, float, float, float]
Weights = tuple[float, float, float, float, float]


@inlined
def remaining_phase(entered: State, delta: float, eta: float) -> float:
    """Compute the remaining phase on entering the second side, to second order in the speed (`remaining_time`)."""
    V, P, D = entered
    return remaining_time(V, Restoring(2.0 - P, -D, 0.0, delta, eta, 0.0), Restoring(P, D, 0.0, delta, eta, 0.0))


@inlined
def richardson_weights(eta: float) -> Weights:
    """Compute the factors of the change between pairs of impacts in each extrapolation.

    With Q = eta^2, the errors of successive pairs are sums of Q^{kn}, k = 3, 4, ..., with these ratios at any
    amplitude, because the estimate is correct to second order in the speed. Therefore each column removes one term.
    """
    Q = eta * eta
    q1 = Q * Q * Q
    q2 = q1 * Q
    q3 = q2 * Q
    q4 = q3 * Q
    q5 = q4 * Q
    return q1 / (1.0 - q1), q2 / (1.0 - q2), q3 / (1.0 - q3), q4 / (1.0 - q4), q5 / (1.0 - q5)


@inlined
def extrapolate(T: float, passed: float, weights: Weights, last: Row) -> Row:
    """Compute the next row of Richardson's table from an estimate T of the remaining phase and the ``last`` row.

    ``passed`` is the phase between both. With remaining phases, the amplified rounding is relative to what remains.
    """
    r1 = T + (T - (last[0] - passed)) * weights[0]
    r2 = r1 + (r1 - (last[1] - passed)) * weights[1]
    r3 = r2 + (r2 - (last[2] - passed)) * weights[2]
    r4 = r3 + (r3 - (last[3] - passed)) * weights[3]
    r5 = r4 + (r4 - (last[4] - passed)) * weights[4]
    return T, r1, r2, r3, r4, r5


@inlined
def agree(row: Row, last: Row, passed: float, x: float) -> bool:
    """Return whether the last extrapolation and the last pair changed the remaining phase little.

    The first criterion is insufficient for small Q, the second for Q close to one.
    """
    remaining = row[LEVELS]
    expected = last[LEVELS] - passed
    return (abs(remaining - row[LEVELS - 1]) <= _AGREEMENT * x) & (abs(remaining - expected) <= _AGREEMENT * x)


#: Window of the proof divided by the estimate of the remaining phase.
_WINDOW: Final = 1.5

#: Relative allowance for the rounding of P during a sequence.
_ROUNDING: Final = 1e-12


@inlined
def bracket(entered: State, window: float, delta: float, eta: float) -> tuple[float, float]:
    """Compute bounds on the remaining phase on entering the second side; NaN, NaN: no proof.

    They are valid if the upper one lies within the window, which ends before x = pi: P increases, at a rate of D at
    first, and |P''| <= a.
    """
    if not window > 0.0:
        return np.nan, np.nan
    V, P, D = entered
    rate = (D + window * math.sqrt((1.0 - P) * (1.0 - P) + D * D)) * (1.0 + _ROUNDING)
    low = P * (1.0 - _ROUNDING)
    high = (P + window * rate) * (1.0 + _ROUNDING)
    second = Bounds(delta, 2.0 - high, 2.0 - low, high - low, rate, 0.0)
    first = Bounds(delta, low, high, high - low, rate, 0.0)
    return geometric_bracket(V, second, first, (eta, eta), (eta, eta))


@inlined
def proven(x: float, entered: State, delta: float, eta: float, remaining: float) -> bool:
    """Return whether complete chattering is proven on entering the second side, with ``remaining`` in the bracket."""
    window = _WINDOW * remaining
    lower, upper = bracket(entered, window, delta, eta)
    return (upper <= window) & (lower <= remaining) & (remaining <= upper) & (x + window < math.pi)


#: Speed below which a block is at rest, because no phase changes any more.
STILL: Final = 1e-120

#: Number of impact pairs after which a sequence is UNRESOLVED (eta = 0.99999 requires about a million).
_MAXIMUM_PAIRS: Final = 5_000_000

#: Resolved impact: phase since the previous one, speed before and after.
IMPACT: Final = np.dtype((np.record, [("interval", np.float64), ("before", np.float64), ("after", np.float64)]))


#: Amplitudes, frequencies and coefficients of restitution.
Sequences = tuple[Floats, Floats, Floats]


@kernel
def rest_phases(sequences: Sequences, phases: Floats, statuses: NDArray[np.int8]) -> None:
    """Write status and phase of rest of each sequence (a > 1, omega, eta)."""
    a, omega, eta = sequences
    for i in range(phases.size):
        statuses[i], phases[i] = rest_phase(a[i] - 1.0, 1.0 / (omega[i] * omega[i]), eta[i])


@shared
def rest_phase(excess: float, delta: float, eta: float) -> tuple[int, float]:
    """Compute status and phase omega tau_ch of rest for a = 1 + excess > 1; the phase is valid only if FOUND."""
    status, x, impact = first_arc(excess, delta)
    if status != Verdict.FOUND:
        return status, x
    entered = bounced(impact, eta)
    weights = richardson_weights(eta)
    row = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    passed = 0.0
    for pair in range(_MAXIMUM_PAIRS):
        if entered.V < STILL:
            return Verdict.FOUND, x
        last = row
        row = extrapolate(remaining_phase(entered, delta, eta), passed, weights, last)
        remaining = row[LEVELS]
        if pair > LEVELS and agree(row, last, passed, x) and proven(x, entered, delta, eta, remaining):
            return Verdict.FOUND, x + remaining
        status, second, impact = next_arc(x, entered, -1.0, delta)
        if status != Verdict.FOUND:
            return status, x
        status, first, impact = next_arc(x + second, bounced(impact, eta), 1.0, delta)
        if status != Verdict.FOUND:
            return status, x
        entered = bounced(impact, eta)
        passed = second + first
        x += passed
    return Verdict.UNRESOLVED, x


@inlined
def next_arc(x: float, start: State, s: float, delta: float) -> tuple[int, float, State]:
    """Compute status and duration of the arc from phase x, and the state before its impact; a block at rest stays."""
    if start.V < STILL:
        return Verdict.FOUND, 0.0, State(0.0, start.P, start.D)
    return arc(start, estimated_duration(start, s, delta), s, delta, math.pi - x)


@kernel
def resolve(
    excess: float, delta: float, eta: float, tolerance: float, impacts: NDArray[Any]
) -> tuple[int, int, float, float, float]:
    """Fill ``impacts`` until it is full or the bracket on the phase of rest is narrower than ``tolerance`` times it.

    Returns status (UNRESOLVED if full), number of impacts, phase of rest, and its bracket [lower, upper] from the last
    impact's state. The phases are meaningful only if FOUND.
    """
    status, duration, impact = first_arc(excess, delta)
    x = 0.0
    s = 1.0
    for n in range(impacts.size):
        if status != Verdict.FOUND:
            return status, n, x, x, x
        x += duration
        impacts[n].interval = duration
        impacts[n].before = impact.V
        impacts[n].after = eta * impact.V
        start = bounced(impact, eta)
        s = -s
        if s < 0.0:
            remaining = remaining_phase(start, delta, eta)
            window = _WINDOW * remaining
            lower, upper = bracket(start, window, delta, eta)
            if upper <= window and x + window < math.pi and upper - lower <= tolerance * x:
                return Verdict.FOUND, n + 1, x + min(max(remaining, lower), upper), x + lower, x + upper
        status, duration, impact = next_arc(x, start, s, delta)
    return Verdict.UNRESOLVED, impacts.size, x, x, x


@kernel
def semianalytical_phases(sequences: Sequences, resolved: Integers, phases: Floats, statuses: NDArray[np.int8]) -> None:
    """Write status and phase of rest by Eq. 75 for each (a > 1, omega, eta) and number of ``resolved`` intervals."""
    a, omega, eta = sequences
    for i in range(phases.size):
        delta = 1.0 / (omega[i] * omega[i])
        statuses[i], phases[i] = semianalytical_phase(a[i] - 1.0, delta, eta[i], resolved[i])


@shared
def semianalytical_phase(excess: float, delta: float, eta: float, resolved: int) -> tuple[int, float]:
    """Compute Eq. 75 in phase: the resolved intervals, then two more that start two geometric sums."""
    status, newer, impact = first_arc(excess, delta)
    older = 0.0
    x = newer
    s = 1.0
    for _ in range(resolved + 1):
        if status != Verdict.FOUND:
            return status, x
        s = -s
        older = newer
        status, newer, impact = next_arc(x, bounced(impact, eta), s, delta)
        x += newer
    if status != Verdict.FOUND:
        return status, x
    pair = eta * eta
    rest = x + (older + newer) * (pair / (1.0 - pair))
    return Verdict.FOUND if rest < math.pi else Verdict.INCOMPLETE, rest


#: Width of the final bracket on a - 1, divided by a: half an ulp.
_WIDTH: Final = 2.0**-53


@kernel
def critical_amplitudes(omega: Floats, eta: Floats, amplitudes: Floats) -> None:
    """Write the critical amplitude, the largest with complete chattering, for each omega and eta < 1."""
    for i in range(amplitudes.size):
        low, high = 0.0, LARGEST_EXCESS
        while high - low > _WIDTH * (1.0 + low):
            middle = 0.5 * (low + high)
            if rest_phase(middle, 1.0 / (omega[i] * omega[i]), eta[i])[0] == Verdict.FOUND:
                low = middle
            else:
                high = middle
        amplitudes[i] = 1.0 + low
