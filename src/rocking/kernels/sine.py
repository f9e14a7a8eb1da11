"""The dimensionless sine problem: one arc, one impact, one chattering sequence, to a few ulp.

The paper's problem (Eq. 4) in variables in which nothing cancels:

- phase ``x = omega tau`` since uplift, ``delta = 1/omega^2``, height ``U = omega^2 |phi|``, speed ``V = dU/dx``;
- ``P = 1 - a sin(x + psi) = 1 - cos x - kappa sin x``, the restoring acceleration of the first side; that of the
  second is ``2 - P``; ``D = dP/dx = sin x - kappa cos x`` and ``kappa = sqrt(a^2 - 1)``.

On an arc of the first (s = 1) or second (s = -1) side ``U'' = delta U - G - s (change of P)``, with G = P or 2 - P at
its start. Divided by the time t since that impact (Eq. 20) its solution is

    U/t = V A - t (G B + s t (D E + t (1 - P) W)),

where A, B, E, W are the functions of t^2 and delta below, sums of terms of falling size however short the arc is.
P and D advance by the addition theorem, so that an impact calls neither sine nor exponential.

Every positive root of U/t with x + t < pi is the first one. From the first impact to x = pi, half a period after
uplift, both restoring accelerations are positive, so once an arc has come down to zero, U'' = delta U - g < 0 keeps
it below. Hence no search for an earlier root; and an arc that is still up at x = pi proves incomplete chattering.
"""

import math
from typing import Final

from rocking.kernels.chatter import geometric_bracket
from rocking.kernels.compiled import inlined, kernel, shared

#: No first arc ends before x = pi beyond this a - 1: even without growth, U(pi) = pi kappa - pi^2/2 + 2.
LARGEST_EXCESS: Final = math.hypot(1.0, math.pi / 2 - 2 / math.pi) - 1.0

#: Orders of the basis functions, and the largest t^2 (1 + delta) at which so many terms reach full precision.
SHORT: Final = 3
MEDIUM: Final = 5
LONG: Final = 9
LONGEST: Final = 14
REACH_SHORT: Final = 0.003
REACH_MEDIUM: Final = 0.12
REACH_LONG: Final = 1.5
REACH_LONGEST: Final = 12.0

#: A fourth-order correction of this relative size leaves an error below one ulp.
LARGEST_CORRECTION: Final = 1e-4

#: Extrapolations above the second-order closure, and the relative agreement at which their result is taken.
LEVELS: Final = 5
CLOSED: Final = 1e-13

#: One sixth.
SIXTH: Final = 1.0 / 6.0

#: Window of the certificate over the estimate of the remaining time.
WINDOW: Final = 1.5

#: Relative allowance for what P has gathered of rounding over a sequence.
_ROUNDING: Final = 1e-12

#: Impact pairs after which a sequence is given up (eta = 0.99999 takes about a million).
_MAXIMUM_PAIRS: Final = 5_000_000

#: Below this speed a block is at rest: what remains is nothing beside any phase.
STILL: Final = 1e-120

_MAXIMUM_HALVINGS: Final = 200

_INVERSE_FACTORIAL: Final = tuple(1.0 / math.factorial(k) for k in range(2 * LONGEST + 5))


@inlined
def basis(q: float, delta: float, order: int) -> tuple[float, float, float, float]:
    """Return sin(t)/t, (1 - cos t)/t^2, E and W at q = t^2.

    With S = sinh(sqrt(delta) t)/sqrt(delta) and C = (cosh(sqrt(delta) t) - 1)/delta they are
    t^3 E = (S - sin t)/(1 + delta) and t^4 W = (C - 1 + cos t)/(1 + delta).
    """
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
    return sine, versine, E, W


@shared
def basis_anywhere(t: float, delta: float) -> tuple[float, float, float, float]:
    """Return the same at any t > 0: by the shortest sum of full precision, in closed form where there is none."""
    q = t * t
    reach = q * (1.0 + delta)
    if reach < REACH_SHORT:
        return basis(q, delta, SHORT)
    if reach < REACH_MEDIUM:
        return basis(q, delta, MEDIUM)
    if reach < REACH_LONG:
        return basis(q, delta, LONG)
    if reach < REACH_LONGEST:
        return basis(q, delta, LONGEST)
    return closed_basis(t, delta)


@inlined
def closed_basis(t: float, delta: float) -> tuple[float, float, float, float]:
    """Return the same from the definitions, for long arcs."""
    q = t * t
    growth = math.sqrt(delta) * t
    sine = math.sin(t) / t
    versine = 2.0 * math.sin(0.5 * t) ** 2 / q
    S = 1.0 + growth * growth / 6.0
    C = 0.5 + growth * growth / 24.0
    if growth > 1e-3:
        S = math.sinh(growth) / growth
        C = 2.0 * (math.sinh(0.5 * growth) / growth) ** 2
    return sine, versine, (S - sine) / ((1.0 + delta) * q), (C - versine) / ((1.0 + delta) * q)


@inlined
def pull(P: float, s: float) -> float:
    """Restoring acceleration of the first (s > 0) or second side."""
    return P if s > 0.0 else 2.0 - P


@inlined
def guess_landing(V: float, P: float, D: float, s: float, delta: float) -> float:
    """Estimate the duration of a short arc: root of the series to t^2, then one Newton step on it to t^3.

    Times a reciprocal, here and below: a compiler may not turn the division by a constant into a product.
    """
    G = pull(P, s)
    t = 4.0 * V / (G + math.sqrt(max(0.0, G * G + (8.0 / 3.0) * V * (s * D - delta * V))))
    growth = delta * t * t
    bend = s * t * D
    twist = s * t * t * (1.0 - P)
    value = V * (1.0 + SIXTH * growth) - t * (G * (0.5 + 0.25 * SIXTH * growth) + SIXTH * (bend + 0.25 * twist))
    slope = 2.0 * SIXTH * V * delta * t - (G * (0.5 + 0.125 * growth) + 2.0 * SIXTH * bend + 0.125 * twist)
    return t - value / slope


@inlined
def land(
    t: float, V: float, P: float, D: float, s: float, delta: float, shape: tuple[float, float, float, float]
) -> tuple[float, float, float, float, float]:
    """Correct an estimate t of an arc's duration to fourth order; ``shape`` holds the basis functions at t.

    Returns the duration, the impact speed (positive), P and D at the impact, and the size of the correction, larger
    where the arc lands flat: relative to t, its fourth power is the error.
    """
    sine, versine, E, W = shape
    q = t * t
    mean = 1.0 - P
    A = sine + (1.0 + delta) * q * E
    B = versine + (1.0 + delta) * q * W
    G = pull(P, s)
    height = t * (V * A - t * (G * B + s * t * (D * E + t * mean * W)))
    speed = V * (1.0 + delta * q * B) - t * (G * A + s * t * (D * (versine + delta * q * W) + t * mean * E))
    P_there = P + q * versine * mean + t * sine * D
    D_there = D - q * versine * D + t * sine * mean
    acceleration = delta * height - pull(P_there, s)
    jerk = delta * speed - s * D_there
    snap = delta * acceleration - s * (1.0 - P_there)
    inverse = 1.0 / speed
    newton = -height * inverse
    c2 = 0.5 * acceleration * inverse
    c3 = jerk * inverse * SIXTH
    dt = newton * (1.0 - newton * (c2 - newton * (2.0 * c2 * c2 - c3)))
    impact_speed = -(speed + dt * (acceleration + dt * (0.5 * jerk + dt * snap * SIXTH)))
    mean = 1.0 - P_there
    P_impact = P_there + dt * (D_there + dt * (0.5 * mean - dt * D_there * SIXTH))
    D_impact = D_there + dt * (mean - dt * (0.5 * D_there + dt * mean * SIXTH))
    return t + dt, impact_speed, P_impact, D_impact, abs(dt) * (1.0 + abs(t * c2))


@shared
def scaled_height(t: float, V: float, P: float, D: float, s: float, delta: float) -> float:
    """Height at any time of an arc, times exp(-sqrt(delta) t): its sign, without overflow."""
    rate = math.sqrt(delta)
    decay = math.exp(-rate * t)
    S = decay * t * (1.0 + delta * t * t / 6.0)
    C = decay * t * t * (0.5 + delta * t * t / 24.0)
    if rate * t > 1e-3:
        S = 0.5 * (1.0 - decay * decay) / rate
        C = 0.5 * (1.0 - decay) ** 2 / delta
    sine = math.sin(t) * decay
    versine = 2.0 * math.sin(0.5 * t) ** 2 * decay
    forced = (D * (S - sine) + (1.0 - P) * (C - versine)) / (1.0 + delta)
    return V * S - pull(P, s) * C - s * forced


@shared
def arc(
    t: float, V: float, P: float, D: float, s: float, delta: float, left: float
) -> tuple[float, float, float, float]:
    """Duration, impact speed, P and D of the arc's impact, from an estimate t of the duration.

    NaN as duration: still up when the time ``left`` to x = pi is over.
    """
    for _ in range(3):
        if not 0.0 < t < left:
            break
        landed, speed, P_impact, D_impact, change = land(t, V, P, D, s, delta, basis_anywhere(t, delta))
        if change <= LARGEST_CORRECTION * t and landed < left:
            return landed, speed, P_impact, D_impact
        t = landed
    return bracketed_arc(V, P, D, s, delta, left)


@shared
def bracketed_arc(
    V: float, P: float, D: float, s: float, delta: float, left: float
) -> tuple[float, float, float, float]:
    """Find the same by halving, where the estimate leads nowhere: a long arc, or one that never ends."""
    if scaled_height(left, V, P, D, s, delta) >= 0.0:
        return math.nan, 0.0, 0.0, 0.0
    low = 0.0
    high = left
    t = 0.5 * left
    for _ in range(_MAXIMUM_HALVINGS):
        landed, speed, P_impact, D_impact, change = land(t, V, P, D, s, delta, basis_anywhere(t, delta))
        if change <= LARGEST_CORRECTION * t and landed < left:
            return landed, speed, P_impact, D_impact
        if scaled_height(t, V, P, D, s, delta) > 0.0:
            low = t
        else:
            high = t
        t = landed if low < landed < high else 0.5 * (low + high)
    return math.nan, 0.0, 0.0, 0.0


@inlined
def guess_first_impact(kappa: float, delta: float) -> float:
    """Phase of the first impact to two orders in kappa (Eq. 32, mended)."""
    return 4.0 * kappa / (1.0 + (4.0 / 15.0) * (1.0 - delta) * kappa * kappa)


@shared
def first_arc(excess: float, delta: float) -> tuple[float, float, float, float]:
    """Phase and speed of the first impact, P and D there, for a = 1 + excess; NaN: none before x = pi."""
    if not excess <= LARGEST_EXCESS:
        return math.nan, 0.0, 0.0, 0.0
    kappa = math.sqrt(excess * (2.0 + excess))
    return arc(guess_first_impact(kappa, delta), 0.0, 0.0, -kappa, 1.0, delta, math.pi)


@inlined
def extrapolate(
    T: float, gone: float, Q: float, table: tuple[float, float, float, float, float, float]
) -> tuple[float, float, float, float, float, float]:
    """Add one closure T of the remaining phase to the last row of Richardson's table; ``gone`` has passed since.

    With Q = eta^2 the closures of successive pairs err by sums of Q^{kn}, k = 3, 4, 5, ..., with these very ratios
    at any amplitude, so each column removes one term. All of it in remaining, not absolute, phase, so that
    the amplified rounding stays relative to what remains.
    """
    cube = Q * Q * Q
    r1 = T + (T - (table[0] - gone)) * (cube / (1.0 - cube))
    cube *= Q
    r2 = r1 + (r1 - (table[1] - gone)) * (cube / (1.0 - cube))
    cube *= Q
    r3 = r2 + (r2 - (table[2] - gone)) * (cube / (1.0 - cube))
    cube *= Q
    r4 = r3 + (r3 - (table[3] - gone)) * (cube / (1.0 - cube))
    cube *= Q
    r5 = r4 + (r4 - (table[4] - gone)) * (cube / (1.0 - cube))
    return T, r1, r2, r3, r4, r5


@inlined
def agree(remaining: float, less_extrapolated: float, expected: float, x: float) -> bool:
    """Whether the remaining phase is settled: the last extrapolation changed little, and so did the last pair.

    The first alone deceives where Q is small, the second where Q is close to one.
    """
    return (abs(remaining - less_extrapolated) <= CLOSED * x) & (abs(remaining - expected) <= CLOSED * x)


@inlined
def closure(V: float, P: float, D: float, eta: float) -> float:
    """Remaining phase to second order in the speed V with which the second side is entered.

    T = first V + second V^2 on each side, solved from T(arc) = duration + T(next arc) order by order; the first order
    is the paper's Eq. 75, the second lets both restoring accelerations change linearly.
    """
    up = 1.0 / (2.0 - P)
    down = 1.0 / P
    scale = 2.0 / (1.0 - eta * eta)
    first_up = scale * (up + eta * down)
    first_down = scale * (down + eta * up)
    drift_up = scale * D * (up * up - eta * down * down)
    drift_down = scale * D * (eta * up * up - down * down)
    own_up = D * up * up * ((4.0 / 3.0) * up - (2.0 / 3.0) * eta * first_down) + 2.0 * eta * up * drift_down
    own_down = D * down * down * ((2.0 / 3.0) * eta * first_up - (4.0 / 3.0) * down) + 2.0 * eta * down * drift_up
    second = (own_up + eta * eta * own_down) / (1.0 - eta * eta * (eta * eta))
    return V * (first_up + V * second)


@inlined
def bracket(V: float, P: float, D: float, window: float, delta: float, eta: float) -> tuple[float, float]:
    """Bounds on the remaining phase on entering the second side at speed V; NaN: no proof.

    They hold if the upper one lies within the window of phase and the window ends before x = pi: P rises there, at
    a rate of D at first, and |P''| <= a.
    """
    rate = (D + window * math.hypot(1.0 - P, D)) * (1.0 + _ROUNDING)
    low = P * (1.0 - _ROUNDING)
    high = (P + window * rate) * (1.0 + _ROUNDING)
    entered = (delta, 2.0 - high, 2.0 - low, high - low, rate, 0.0)
    other = (delta, low, high, high - low, rate, 0.0)
    return geometric_bracket(V, entered, other, eta, eta)


@inlined
def proven(x: float, V: float, P: float, D: float, delta: float, eta: float, remaining: float) -> bool:
    """Whether complete chattering is proven on entering the second side, with this remaining phase in the bracket."""
    window = WINDOW * remaining
    lower, upper = bracket(V, P, D, window, delta, eta)
    return upper <= window and lower <= remaining <= upper and x + window < math.pi


@shared
def settle(x: float, V: float, P: float, D: float, delta: float, eta: float) -> float:
    """Phase at which a block that enters the second side at x comes to rest.

    NaN: an arc outlasts x = pi, so that chattering is incomplete. Infinity: not resolved within the permitted pairs.
    """
    Q = eta * eta
    table = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    gone = 0.0
    for pair in range(_MAXIMUM_PAIRS):
        if V < STILL:
            return x
        expected = table[LEVELS] - gone
        table = extrapolate(closure(V, P, D, eta), gone, Q, table)
        remaining = table[LEVELS]
        if (
            pair > LEVELS
            and agree(remaining, table[LEVELS - 1], expected, x)
            and proven(x, V, P, D, delta, eta, remaining)
        ):
            return x + remaining
        left = math.pi - x
        second, w, P, D = arc(guess_landing(V, P, D, -1.0, delta), V, P, D, -1.0, delta, left)
        if not second >= 0.0:
            return math.nan
        V = eta * w
        first, w, P, D = arc(guess_landing(V, P, D, 1.0, delta), V, P, D, 1.0, delta, left - second)
        if not first >= 0.0:
            return math.nan
        V = eta * w
        gone = second + first
        x += gone
    return math.inf


@kernel
def rest_phase(excess: float, delta: float, eta: float) -> float:
    """Phase omega tau_ch of rest for a = 1 + excess > 1; NaN: incomplete, infinity: unresolved."""
    x, w, P, D = first_arc(excess, delta)
    if not x >= 0.0:
        return math.nan
    return settle(x, eta * w, P, D, delta, eta)
