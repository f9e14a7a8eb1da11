"""One arc: its basis functions of time, duration and impact.

No argument may be NaN. A search without a result is UNRESOLVED.
"""

import math
from typing import Final, NamedTuple

from rocking.kernels.compiled import inlined, shared
from rocking.kernels.sine import Verdict

#: Orders of the sums, and the largest t^2 (1 + delta) at which they reach full precision.
SHORT: Final = 3
MEDIUM: Final = 5
LONG: Final = 9
LONGEST: Final = 14
REACH_SHORT: Final = 0.003
REACH_MEDIUM: Final = 0.12
REACH_LONG: Final = 1.5
REACH_LONGEST: Final = 12.0

_INVERSE_FACTORIAL: Final = tuple(1.0 / math.factorial(k) for k in range(2 * LONGEST + 5))


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
def summed_basis(q: float, delta: float, order: int) -> Basis:
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
def closed_basis(t: float, delta: float) -> Basis:
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


@shared
def basis(t: float, delta: float) -> Basis:
    """Compute the basis at t > 0, by the shortest sum of full precision or else by its definition."""
    q = t * t
    reach = q * (1.0 + delta)
    if reach < REACH_SHORT:
        return summed_basis(q, delta, SHORT)
    if reach < REACH_MEDIUM:
        return summed_basis(q, delta, MEDIUM)
    if reach < REACH_LONG:
        return summed_basis(q, delta, LONG)
    if reach < REACH_LONGEST:
        return summed_basis(q, delta, LONGEST)
    return closed_basis(t, delta)


#: No first arc ends before x = pi beyond this a - 1: even without growth, U(pi) = pi kappa - pi^2/2 + 2.
LARGEST_EXCESS: Final = math.hypot(1.0, math.pi / 2 - 2 / math.pi) - 1.0

#: A fourth-order correction of this size, relative to the shorter of the arc and its time of growth, errs by less than
#: an ulp.
_LARGEST_CORRECTION: Final = 1e-4

#: Number of corrections of an estimate before the root is bracketed, and of search steps.
_CORRECTIONS: Final = 3
_MAXIMUM_STEPS: Final = 400

#: Growth sqrt(delta) t above which a search only bisects, because an impact there is within rounding of none.
_LARGEST_GROWTH: Final = 100.0

_SIXTH: Final = 1.0 / 6.0


class State(NamedTuple):
    """Speed, restoring acceleration of the first side and its rate at an impact."""

    V: float
    P: float
    D: float


class Correction(NamedTuple):
    """Corrected duration, state just before the impact (V is positive), and size of the correction."""

    t: float
    impact: State
    change: float


@inlined
def pull(P: float, s: float) -> float:
    """Return the restoring acceleration of the first (s > 0) or second side."""
    return P if s > 0.0 else 2.0 - P


@inlined
def estimated_duration(start: State, s: float, delta: float) -> float:
    """Estimate the duration of a short arc: root of the series to t^2, then one Newton step on it to t^3.

    Reciprocals are written out, because a compiler may not replace a division by a constant by a product.
    """
    V, P, D = start
    G = pull(P, s)
    t = 4.0 * V / (G + math.sqrt(max(0.0, G * G + (8.0 / 3.0) * V * (s * D - delta * V))))
    growth = delta * t * t
    bend = s * t * D
    twist = s * t * t * (1.0 - P)
    value = V * (1.0 + _SIXTH * growth) - t * (G * (0.5 + 0.25 * _SIXTH * growth) + _SIXTH * (bend + 0.25 * twist))
    slope = 2.0 * _SIXTH * V * delta * t - (G * (0.5 + 0.125 * growth) + 2.0 * _SIXTH * bend + 0.125 * twist)
    return t - value / slope


@inlined
def height(t: float, start: State, s: float, delta: float, at: Basis) -> float:
    """Compute the height of an arc at t, where the basis is ``at``, times its decay."""
    V, P, D = start
    q = t * t
    A = at.decay * at.sine + (1.0 + delta) * q * at.E
    B = at.decay * at.versine + (1.0 + delta) * q * at.W
    return t * (V * A - t * (pull(P, s) * B + s * t * (D * at.E + t * (1.0 - P) * at.W)))


@inlined
def rise(t: float, start: State, s: float, delta: float, at: Basis) -> float:
    """Compute the rate of the height of an arc at t, where the basis is ``at``, times its decay."""
    V, P, D = start
    q = t * t
    A = at.decay * at.sine + (1.0 + delta) * q * at.E
    B = at.decay * at.versine + (1.0 + delta) * q * at.W
    bend = at.decay * at.versine + delta * q * at.W
    return V * (at.decay + delta * q * B) - t * (pull(P, s) * A + s * t * (D * bend + t * (1.0 - P) * at.E))


@inlined
def corrected_duration(t: float, start: State, s: float, delta: float, at: Basis) -> Correction:
    """Correct an estimate t of an arc's duration to fourth order; ``at`` is the basis at t.

    The size is that of the Newton step, increased for small impact speeds; the fourth power of its ratio to t is the
    error. (The whole correction is also zero without a root.)
    """
    P, D = start.P, start.D
    q = t * t
    mean = 1.0 - P
    speed = rise(t, start, s, delta, at)
    P_there = P + q * at.versine * mean + t * at.sine * D
    D_there = D - q * at.versine * D + t * at.sine * mean
    there = height(t, start, s, delta, at)
    acceleration = delta * there - at.decay * pull(P_there, s)
    jerk = delta * speed - s * at.decay * D_there
    snap = delta * acceleration - s * at.decay * (1.0 - P_there)
    inverse = 1.0 / speed
    newton = -there * inverse
    c2 = 0.5 * acceleration * inverse
    c3 = jerk * inverse * _SIXTH
    dt = newton * (1.0 - newton * (c2 - newton * (2.0 * c2 * c2 - c3)))
    impact_speed = -(speed + dt * (acceleration + dt * (0.5 * jerk + dt * snap * _SIXTH))) / at.decay
    mean = 1.0 - P_there
    P_impact = P_there + dt * (D_there + dt * (0.5 * mean - dt * D_there * _SIXTH))
    D_impact = D_there + dt * (mean - dt * (0.5 * D_there + dt * mean * _SIXTH))
    return Correction(t + dt, State(impact_speed, P_impact, D_impact), abs(newton) * (1.0 + abs(t * c2)))


@inlined
def is_precise(correction: Correction, t: float, delta: float) -> bool:
    """Return whether the correction of the estimate t is small enough to be the last; False for NaN."""
    reach = t * t * (1.0 + delta)
    return correction.change * correction.change * (1.0 + reach) <= _LARGEST_CORRECTION * _LARGEST_CORRECTION * (t * t)


@shared
def arc(start: State, t: float, s: float, delta: float, left: float) -> tuple[int, float, State]:
    """Compute the duration of an arc, from an estimate t, and the state just before its impact.

    Status: FOUND; INCOMPLETE if the arc is still up after the time ``left`` to x = pi; UNRESOLVED.
    """
    for _ in range(_CORRECTIONS):
        if not (0.0 < t < left and delta * t * t < _LARGEST_GROWTH**2):
            break
        correction = corrected_duration(t, start, s, delta, basis(t, delta))
        if is_precise(correction, t, delta) and correction.t < left:
            return Verdict.FOUND, correction.t, correction.impact
        t = correction.t
    return bracketed_arc(start, s, delta, left)


@shared
def bracketed_arc(start: State, s: float, delta: float, left: float) -> tuple[int, float, State]:
    """Compute the same as `arc` in a bracket if the corrections do not converge (long arc, or arc without end).

    A corrected estimate is tried after the bracket was at least halved.
    """
    if outlasts(start, s, delta, left):
        return Verdict.INCOMPLETE, left, start
    low = 0.0
    high = left
    t = 0.5 * left
    width = left
    for _ in range(_MAXIMUM_STEPS):
        at = basis(t, delta)
        corrected = 0.0
        if delta * t * t < _LARGEST_GROWTH**2:
            correction = corrected_duration(t, start, s, delta, at)
            if is_precise(correction, t, delta) and correction.t < left:
                return Verdict.FOUND, correction.t, correction.impact
            corrected = correction.t
        if height(t, start, s, delta, at) > 0.0:
            low = t
        else:
            high = t
        halved = high - low <= 0.5 * width
        width = high - low
        t = corrected if halved and low < corrected < high else 0.5 * (low + high)
    return Verdict.UNRESOLVED, left, start


@inlined
def outlasts(start: State, s: float, delta: float, left: float) -> bool:
    """Return whether an arc is still up after the time ``left`` to x = pi."""
    return height(left, start, s, delta, basis(left, delta)) >= 0.0


@inlined
def estimated_first_impact(kappa: float, delta: float) -> float:
    """Estimate the phase of the first impact to two orders in kappa (Eq. 32, corrected)."""
    return 4.0 * kappa / (1.0 + (4.0 / 15.0) * (1.0 - delta) * kappa * kappa)


@inlined
def uplift_state(excess: float) -> State:
    """Return the state at uplift for a = 1 + excess, where D is -kappa."""
    return State(0.0, 0.0, -math.sqrt(excess * (2.0 + excess)))


@shared
def first_arc(excess: float, delta: float) -> tuple[int, float, State]:
    """Compute status and phase of the first impact for a = 1 + excess > 1, and the state just before."""
    start = uplift_state(min(excess, LARGEST_EXCESS))
    if excess > LARGEST_EXCESS:
        return Verdict.INCOMPLETE, math.pi, start
    return arc(start, estimated_first_impact(-start.D, delta), 1.0, delta, math.pi)


@inlined
def bounced(impact: State, eta: float) -> State:
    """Return the state after an impact."""
    return State(eta * impact.V, impact.P, impact.D)
