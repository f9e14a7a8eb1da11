"""One arc: its basis functions of time, duration and impact.

No argument may be NaN. A search without a result is UNRESOLVED.
"""

import math
from typing import Final, NamedTuple

from rocking.kernels.compiled import inlined, not_inlined
from rocking.kernels.sine import SequenceStatus

#: Orders of the sums, and the largest t^2 (1 + delta) at which they reach full precision.
SHORT_ORDER: Final = 3
MEDIUM_ORDER: Final = 5
LONG_ORDER: Final = 9
LONGEST_ORDER: Final = 14
REACH_SHORT: Final = 0.003
REACH_MEDIUM: Final = 0.12
REACH_LONG: Final = 1.5
REACH_LONGEST: Final = 12.0

_INVERSE_FACTORIAL: Final = tuple(1.0 / math.factorial(k) for k in range(2 * LONGEST_ORDER + 5))


class Basis(NamedTuple):
    """Values at a time t; E and W, which grow exponentially, are multiplied by ``decay`` > 0.

    With S = sinh(sqrt(delta) t)/sqrt(delta) and C = (cosh(sqrt(delta) t) - 1)/delta, t^3 E = (S - sin t)/(1 + delta)
    and t^4 W = (C - 1 + cos t)/(1 + delta).
    """

    sine: float  # sin(t)/t
    versine: float  # (1 - cos t)/t^2
    E: float
    W: float
    decay: float


@inlined
def sum_basis(q: float, delta: float, order: int) -> Basis:
    """Compute the basis as a sum of powers of q = t^2; decay is one."""
    sine = 1.0
    versine = _INVERSE_FACTORIAL[2]
    E = _INVERSE_FACTORIAL[3]
    W = _INVERSE_FACTORIAL[4]
    power = 1.0
    mixed = 1.0
    for m in range(1, order + 1):
        power *= -q
        mixed = mixed * (delta * q) + power
        sine += power * _INVERSE_FACTORIAL[2 * m + 1]
        versine += power * _INVERSE_FACTORIAL[2 * m + 2]
        E += mixed * _INVERSE_FACTORIAL[2 * m + 3]
        W += mixed * _INVERSE_FACTORIAL[2 * m + 4]
    power *= -q
    sine += power * _INVERSE_FACTORIAL[2 * order + 3]
    versine += power * _INVERSE_FACTORIAL[2 * order + 4]
    return Basis(sine, versine, E, W, 1.0)


@inlined
def compute_closed_form_basis(t: float, delta: float) -> Basis:
    """Compute the basis of long arcs by its definition; decay is exp(-sqrt(delta) t), so that nothing overflows."""
    q = t * t
    growth = math.sqrt(delta) * t
    decay = math.exp(-growth)
    sine = math.sin(t) / t
    versine = 2.0 * math.sin(0.5 * t) ** 2 / q
    S = -0.5 * math.expm1(-2.0 * growth) / growth
    C = 0.5 * (math.expm1(-growth) / growth) ** 2
    total = (1.0 + delta) * q
    return Basis(sine, versine, (S - decay * sine) / total, (C - decay * versine) / total, decay)


@not_inlined
def compute_basis(t: float, delta: float) -> Basis:
    """Compute the basis at t > 0, by the shortest sum of full precision or else by its definition."""
    q = t * t
    reach = q * (1.0 + delta)
    if reach < REACH_SHORT:
        return sum_basis(q, delta, SHORT_ORDER)
    if reach < REACH_MEDIUM:
        return sum_basis(q, delta, MEDIUM_ORDER)
    if reach < REACH_LONG:
        return sum_basis(q, delta, LONG_ORDER)
    if reach < REACH_LONGEST:
        return sum_basis(q, delta, LONGEST_ORDER)
    return compute_closed_form_basis(t, delta)


#: No first arc ends before x = pi beyond this a - 1: even without growth, U(pi) = pi kappa - pi^2/2 + 2.
MAX_EXCESS: Final = math.hypot(1.0, math.pi / 2 - 2 / math.pi) - 1.0

#: A fourth-order correction of this size, relative to the shorter of the arc and its time of growth, errs by less than
#: an ulp.
_MAX_CORRECTION: Final = 1e-4

#: Number of corrections of an estimate before the root is bracketed, and of search steps.
_CORRECTIONS: Final = 3
_MAX_STEPS: Final = 400

#: Growth sqrt(delta) t above which a search only bisects, because an impact there is within rounding of none.
_MAX_GROWTH: Final = 100.0

_SIXTH: Final = 1.0 / 6.0


class State(NamedTuple):
    """State at an impact."""

    V: float  # speed
    P: float  # restoring acceleration of the first side
    D: float  # rate of P


class Correction(NamedTuple):
    """Correction of an estimated duration."""

    t: float  # corrected duration
    impact: State  # state just before the impact; V is positive
    change: float  # size of the correction


@inlined
def compute_side_acceleration(P: float, s: float) -> float:
    """Return the restoring acceleration of the first (s > 0) or second side."""
    return P if s > 0.0 else 2.0 - P


@inlined
def estimate_duration(start: State, s: float, delta: float) -> float:
    """Estimate the duration of a short arc: root of the series to t^2, then one Newton step on it to t^3.

    Reciprocals are written out, because a compiler may not replace a division by a constant by a product.
    """
    V, P, D = start
    G = compute_side_acceleration(P, s)
    t = 4.0 * V / (G + math.sqrt(max(0.0, G * G + (8.0 / 3.0) * V * (s * D - delta * V))))
    growth = delta * t * t
    bend = s * t * D
    twist = s * t * t * (1.0 - P)
    value = V * (1.0 + _SIXTH * growth) - t * (G * (0.5 + 0.25 * _SIXTH * growth) + _SIXTH * (bend + 0.25 * twist))
    slope = 2.0 * _SIXTH * V * delta * t - (G * (0.5 + 0.125 * growth) + 2.0 * _SIXTH * bend + 0.125 * twist)
    return t - value / slope


@inlined
def compute_arc_height(t: float, start: State, s: float, delta: float, basis: Basis) -> float:
    """Compute the height of an arc at t times the decay of the basis at t."""
    V, P, D = start
    q = t * t
    A = basis.decay * basis.sine + (1.0 + delta) * q * basis.E
    B = basis.decay * basis.versine + (1.0 + delta) * q * basis.W
    return t * (V * A - t * (compute_side_acceleration(P, s) * B + s * t * (D * basis.E + t * (1.0 - P) * basis.W)))


@inlined
def compute_arc_speed(t: float, start: State, s: float, delta: float, basis: Basis) -> float:
    """Compute the rate of the height of an arc at t times the decay of the basis at t."""
    V, P, D = start
    q = t * t
    A = basis.decay * basis.sine + (1.0 + delta) * q * basis.E
    B = basis.decay * basis.versine + (1.0 + delta) * q * basis.W
    bend = basis.decay * basis.versine + delta * q * basis.W
    return V * (basis.decay + delta * q * B) - t * (
        compute_side_acceleration(P, s) * A + s * t * (D * bend + t * (1.0 - P) * basis.E)
    )


@inlined
def correct_duration(t: float, start: State, s: float, delta: float, basis: Basis) -> Correction:
    """Correct an estimate t of an arc's duration to fourth order; ``basis`` is the basis at t.

    The size is that of the Newton step, increased for small impact speeds; the fourth power of its ratio to t is the
    error. (The whole correction is also zero without a root.)
    """
    P, D = start.P, start.D
    q = t * t
    mean = 1.0 - P
    speed = compute_arc_speed(t, start, s, delta, basis)
    P_t = P + q * basis.versine * mean + t * basis.sine * D
    D_t = D - q * basis.versine * D + t * basis.sine * mean
    height = compute_arc_height(t, start, s, delta, basis)
    acceleration = delta * height - basis.decay * compute_side_acceleration(P_t, s)
    jerk = delta * speed - s * basis.decay * D_t
    snap = delta * acceleration - s * basis.decay * (1.0 - P_t)
    inverse = 1.0 / speed
    newton = -height * inverse
    c2 = 0.5 * acceleration * inverse
    c3 = jerk * inverse * _SIXTH
    dt = newton * (1.0 - newton * (c2 - newton * (2.0 * c2 * c2 - c3)))
    impact_speed = -(speed + dt * (acceleration + dt * (0.5 * jerk + dt * snap * _SIXTH))) / basis.decay
    mean = 1.0 - P_t
    P_impact = P_t + dt * (D_t + dt * (0.5 * mean - dt * D_t * _SIXTH))
    D_impact = D_t + dt * (mean - dt * (0.5 * D_t + dt * mean * _SIXTH))
    return Correction(t + dt, State(impact_speed, P_impact, D_impact), abs(newton) * (1.0 + abs(t * c2)))


@inlined
def is_precise(correction: Correction, t: float, delta: float) -> bool:
    """Return whether the correction of the estimate t is small enough to be the last; False for NaN."""
    reach = t * t * (1.0 + delta)
    return correction.change * correction.change * (1.0 + reach) <= _MAX_CORRECTION * _MAX_CORRECTION * (t * t)


@not_inlined
def solve_arc(start: State, t: float, s: float, delta: float, max_duration: float) -> tuple[int, float, State]:
    """Compute the duration of an arc, from an estimate t, and the state just before its impact.

    Status: FOUND; INCOMPLETE if the arc is still up after the time ``max_duration`` to x = pi; UNRESOLVED.
    """
    for _ in range(_CORRECTIONS):
        if not (0.0 < t < max_duration and delta * t * t < _MAX_GROWTH**2):
            break
        correction = correct_duration(t, start, s, delta, compute_basis(t, delta))
        if is_precise(correction, t, delta) and correction.t < max_duration:
            return SequenceStatus.FOUND, correction.t, correction.impact
        t = correction.t
    return bracket_arc(start, s, delta, max_duration)


@not_inlined
def bracket_arc(start: State, s: float, delta: float, max_duration: float) -> tuple[int, float, State]:
    """Compute the same as `solve_arc` in a bracket if the corrections do not converge (long arc, or arc without end).

    A corrected estimate is tried after the bracket was at least halved.
    """
    if is_longer_than(start, s, delta, max_duration):
        return SequenceStatus.INCOMPLETE, max_duration, start
    low = 0.0
    high = max_duration
    t = 0.5 * max_duration
    width = max_duration
    for _ in range(_MAX_STEPS):
        basis = compute_basis(t, delta)
        corrected = 0.0
        if delta * t * t < _MAX_GROWTH**2:
            correction = correct_duration(t, start, s, delta, basis)
            if is_precise(correction, t, delta) and correction.t < max_duration:
                return SequenceStatus.FOUND, correction.t, correction.impact
            corrected = correction.t
        if compute_arc_height(t, start, s, delta, basis) > 0.0:
            low = t
        else:
            high = t
        is_halved = high - low <= 0.5 * width
        width = high - low
        t = corrected if is_halved and low < corrected < high else 0.5 * (low + high)
    return SequenceStatus.UNRESOLVED, max_duration, start


@inlined
def is_longer_than(start: State, s: float, delta: float, max_duration: float) -> bool:
    """Return whether an arc is still up after the time ``max_duration`` to x = pi."""
    return compute_arc_height(max_duration, start, s, delta, compute_basis(max_duration, delta)) >= 0.0


@inlined
def estimate_first_impact(kappa: float, delta: float) -> float:
    """Estimate the phase of the first impact to two orders in kappa (Eq. 32, corrected)."""
    return 4.0 * kappa / (1.0 + (4.0 / 15.0) * (1.0 - delta) * kappa * kappa)


@inlined
def create_uplift_state(excess: float) -> State:
    """Return the state at uplift for a = 1 + excess, where D is -kappa."""
    return State(0.0, 0.0, -math.sqrt(excess * (2.0 + excess)))


@not_inlined
def solve_first_arc(excess: float, delta: float) -> tuple[int, float, State]:
    """Compute status and phase of the first impact for a = 1 + excess > 1, and the state just before."""
    start = create_uplift_state(min(excess, MAX_EXCESS))
    if excess > MAX_EXCESS:
        return SequenceStatus.INCOMPLETE, math.pi, start
    return solve_arc(start, estimate_first_impact(-start.D, delta), 1.0, delta, math.pi)


@inlined
def apply_restitution(impact: State, eta: float) -> State:
    """Return the state after an impact."""
    return State(eta * impact.V, impact.P, impact.D)
