"""One sequence: phase of rest with its proof, resolved impacts, and critical amplitude.

The remaining phase is an expansion in the speed, extrapolated over successive pairs of impacts. The critical amplitude
is the largest a whose first chattering sequence accumulates before x = pi. Parameters are finite.
"""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.core.arrays import Floats, Integers
from rocking.kernels.certificate import RestoringBounds, bracket_geometrically
from rocking.kernels.compiled import inlined, kernel, not_inlined
from rocking.kernels.remaining import ImpactSide, estimate_remaining_time
from rocking.kernels.sine import SequenceStatus
from rocking.kernels.sine.arc import MAX_EXCESS, State, apply_restitution, estimate_duration, solve_arc, solve_first_arc

#: Number of extrapolations of that expansion, and relative agreement at which they are accepted.
LEVELS: Final = 5
_EXTRAPOLATION_TOLERANCE: Final = 1e-13

#: Estimate of the remaining phase and its successive extrapolations; their factors.
Row = tuple[float, float, float, float, float, float]
Weights = tuple[float, float, float, float, float]


@inlined
def estimate_remaining_phase(entry: State, delta: float, eta: float) -> float:
    """Estimate the remaining phase on entering the second side, to second order in the speed."""
    V, P, D = entry
    return estimate_remaining_time(
        V, ImpactSide(2.0 - P, -D, 0.0, delta, eta, 0.0), ImpactSide(P, D, 0.0, delta, eta, 0.0)
    )


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
def extrapolate(T: float, elapsed: float, weights: Weights, last: Row) -> Row:
    """Compute the next row of Richardson's table from an estimate T of the remaining phase and the ``last`` row.

    ``elapsed`` is the phase between both. With remaining phases, the amplified rounding is relative to what remains.
    """
    r1 = T + (T - (last[0] - elapsed)) * weights[0]
    r2 = r1 + (r1 - (last[1] - elapsed)) * weights[1]
    r3 = r2 + (r2 - (last[2] - elapsed)) * weights[2]
    r4 = r3 + (r3 - (last[3] - elapsed)) * weights[3]
    r5 = r4 + (r4 - (last[4] - elapsed)) * weights[4]
    return T, r1, r2, r3, r4, r5


@inlined
def has_converged(row: Row, last: Row, elapsed: float, x: float) -> bool:
    """Return whether the last extrapolation and the last pair changed the remaining phase little.

    The first criterion is insufficient for small Q, the second for Q close to one.
    """
    remaining = row[LEVELS]
    expected = last[LEVELS] - elapsed
    return (abs(remaining - row[LEVELS - 1]) <= _EXTRAPOLATION_TOLERANCE * x) & (
        abs(remaining - expected) <= _EXTRAPOLATION_TOLERANCE * x
    )


#: Window of the proof divided by the estimate of the remaining phase.
_WINDOW_RATIO: Final = 1.5

#: Relative allowance for the rounding of P during a sequence.
_PHASE_ROUNDING: Final = 1e-12


@inlined
def bracket_remaining_phase(entry: State, window: float, delta: float, eta: float) -> tuple[float, float]:
    """Compute bounds on the remaining phase on entering the second side; NaN, NaN: no proof.

    They are valid if the upper one lies within the window, which ends before x = pi: P increases, at a rate of D at
    first, and |P''| <= a.
    """
    if not window > 0.0:
        return np.nan, np.nan
    V, P, D = entry
    rate = (D + window * math.sqrt((1.0 - P) * (1.0 - P) + D * D)) * (1.0 + _PHASE_ROUNDING)
    low = P * (1.0 - _PHASE_ROUNDING)
    high = (P + window * rate) * (1.0 + _PHASE_ROUNDING)
    second = RestoringBounds(delta, 2.0 - high, 2.0 - low, high - low, rate, 0.0)
    first = RestoringBounds(delta, low, high, high - low, rate, 0.0)
    return bracket_geometrically(V, second, first, (eta, eta), (eta, eta))


@inlined
def is_proven(x: float, entry: State, delta: float, eta: float, remaining: float) -> bool:
    """Return whether complete chattering is proven on entering the second side, with ``remaining`` in the bracket."""
    window = _WINDOW_RATIO * remaining
    lower, upper = bracket_remaining_phase(entry, window, delta, eta)
    return (upper <= window) & (lower <= remaining) & (remaining <= upper) & (x + window < math.pi)


#: Speed below which a block is at rest, because no phase changes any more.
MIN_MOVING_SPEED: Final = 1e-120

#: Number of impact pairs after which a sequence is UNRESOLVED (eta = 0.99999 requires about a million).
_MAX_PAIRS: Final = 5_000_000

#: Resolved impact: phase since the previous one, speed before and after.
RESOLVED_IMPACT: Final = np.dtype(
    (np.record, [("interval", np.float64), ("before", np.float64), ("after", np.float64)])
)


#: Amplitudes, frequencies and coefficients of restitution.
Sequences = tuple[Floats, Floats, Floats]


@kernel
def write_rest_phases(sequences: Sequences, phases: Floats, statuses: NDArray[np.int8]) -> None:
    """Write status and phase of rest of each sequence (a > 1, omega, eta)."""
    a, omega, eta = sequences
    for i in range(phases.size):
        statuses[i], phases[i] = find_rest_phase(a[i] - 1.0, 1.0 / (omega[i] * omega[i]), eta[i])


@not_inlined
def find_rest_phase(excess: float, delta: float, eta: float) -> tuple[int, float]:
    """Compute status and phase omega tau_ch of rest for a = 1 + excess > 1; the phase is valid only if FOUND."""
    status, x, impact = solve_first_arc(excess, delta)
    if status != SequenceStatus.FOUND:
        return status, x
    entry = apply_restitution(impact, eta)
    weights = richardson_weights(eta)
    row = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    elapsed = 0.0
    for pair in range(_MAX_PAIRS):
        if entry.V < MIN_MOVING_SPEED:
            return SequenceStatus.FOUND, x
        last = row
        row = extrapolate(estimate_remaining_phase(entry, delta, eta), elapsed, weights, last)
        remaining = row[LEVELS]
        if pair > LEVELS and has_converged(row, last, elapsed, x) and is_proven(x, entry, delta, eta, remaining):
            return SequenceStatus.FOUND, x + remaining
        status, second, impact = solve_next_arc(x, entry, -1.0, delta)
        if status != SequenceStatus.FOUND:
            return status, x
        status, first, impact = solve_next_arc(x + second, apply_restitution(impact, eta), 1.0, delta)
        if status != SequenceStatus.FOUND:
            return status, x
        entry = apply_restitution(impact, eta)
        elapsed = second + first
        x += elapsed
    return SequenceStatus.UNRESOLVED, x


@inlined
def solve_next_arc(x: float, start: State, s: float, delta: float) -> tuple[int, float, State]:
    """Compute status and duration of the arc from phase x, and the state before its impact; a block at rest stays."""
    if start.V < MIN_MOVING_SPEED:
        return SequenceStatus.FOUND, 0.0, State(0.0, start.P, start.D)
    return solve_arc(start, estimate_duration(start, s, delta), s, delta, math.pi - x)


@kernel
def resolve_impacts(
    excess: float, delta: float, eta: float, tolerance: float, impacts: NDArray[Any]
) -> tuple[int, int, float, float, float]:
    """Fill ``impacts`` until it is full or the bracket on the phase of rest is narrower than ``tolerance`` times it.

    Returns status (UNRESOLVED if full), number of impacts, phase of rest, and its bracket [lower, upper] from the last
    impact's state. The phases are meaningful only if FOUND.
    """
    status, duration, impact = solve_first_arc(excess, delta)
    x = 0.0
    s = 1.0
    for n in range(impacts.size):
        if status != SequenceStatus.FOUND:
            return status, n, x, x, x
        x += duration
        impacts[n].interval = duration
        impacts[n].before = impact.V
        impacts[n].after = eta * impact.V
        start = apply_restitution(impact, eta)
        s = -s
        if s < 0.0:
            remaining = estimate_remaining_phase(start, delta, eta)
            window = _WINDOW_RATIO * remaining
            lower, upper = bracket_remaining_phase(start, window, delta, eta)
            if upper <= window and x + window < math.pi and upper - lower <= tolerance * x:
                return SequenceStatus.FOUND, n + 1, x + min(max(remaining, lower), upper), x + lower, x + upper
        status, duration, impact = solve_next_arc(x, start, s, delta)
    return SequenceStatus.UNRESOLVED, impacts.size, x, x, x


@kernel
def write_semianalytical_phases(
    sequences: Sequences, impact_counts: Integers, phases: Floats, statuses: NDArray[np.int8]
) -> None:
    """Write status and phase of rest by Eq. 75 for each (a > 1, omega, eta) and number of resolved intervals."""
    a, omega, eta = sequences
    for i in range(phases.size):
        delta = 1.0 / (omega[i] * omega[i])
        statuses[i], phases[i] = find_semianalytical_phase(a[i] - 1.0, delta, eta[i], impact_counts[i])


@not_inlined
def find_semianalytical_phase(excess: float, delta: float, eta: float, impact_count: int) -> tuple[int, float]:
    """Compute Eq. 75 in phase: the resolved intervals, then two more that start two geometric sums."""
    status, current, impact = solve_first_arc(excess, delta)
    previous = 0.0
    x = current
    s = 1.0
    for _ in range(impact_count + 1):
        if status != SequenceStatus.FOUND:
            return status, x
        s = -s
        previous = current
        status, current, impact = solve_next_arc(x, apply_restitution(impact, eta), s, delta)
        x += current
    if status != SequenceStatus.FOUND:
        return status, x
    pair_ratio = eta * eta
    remaining_phase = x + (previous + current) * (pair_ratio / (1.0 - pair_ratio))
    return SequenceStatus.FOUND if remaining_phase < math.pi else SequenceStatus.INCOMPLETE, remaining_phase


#: Width of the final bracket on a - 1, divided by a: half an ulp.
_MIN_WIDTH: Final = 2.0**-53


@kernel
def write_critical_amplitudes(omega: Floats, eta: Floats, amplitudes: Floats) -> None:
    """Write the critical amplitude, the largest with complete chattering, for each omega and eta < 1."""
    for i in range(amplitudes.size):
        low, high = 0.0, MAX_EXCESS
        while high - low > _MIN_WIDTH * (1.0 + low):
            middle = 0.5 * (low + high)
            if find_rest_phase(middle, 1.0 / (omega[i] * omega[i]), eta[i])[0] == SequenceStatus.FOUND:
                low = middle
            else:
                high = middle
        amplitudes[i] = 1.0 + low
