"""The time that is left of complete chattering, estimated to fourth order in the speed.

Within one smooth piece of the motion side j's restoring acceleration at a rotation u is

    g + rate t + curvature t^2 - stiffness u,    to within an error,

with a stiffness of any sign: p^2 for a block, 0 for a ball on a moving table, negative for an oscillator with a stop.
A body that bounces on one side only has that side for both. The derivation is in the documentation ("Theory").

Counted back from a candidate rest time, with s the time left at an impact that enters side i, half the arc's duration
is sought as a polynomial Y_i(s), so that s - 2 Y_i(s) is left at the next impact. The speeds at both ends of an arc
between two given impacts are polynomials of the two times, so Y_i follows by comparison of coefficients. What the
comparison leaves is a polynomial, too, and bounds the error (`remainder`).
"""

import math
from typing import NamedTuple

from rocking.kernels.compiled import inlined

#: Candidates for the rest time, each from the one before, and the relative mismatch of speed that ends the search.
_CANDIDATES = 5
_SETTLED = 2.0**-40

THIRD = 1.0 / 3.0
FIFTEENTH = 1.0 / 15.0

#: Coefficients of powers 1, 2, 3, 4.
Series = tuple[float, float, float, float]
Three = tuple[float, float, float]
Pair = tuple[float, float]


class Restoring(NamedTuple):
    """One side at an impact: restoring acceleration g + rate t + curvature t^2 - stiffness u, to within error."""

    g: float
    rate: float
    curvature: float
    stiffness: float
    restitution: float
    error: float


class Terms(NamedTuple):
    """One side at the candidate rest time: g, and rate, curvature, stiffness in units of the time left."""

    g: float
    rate: float
    curvature: float
    stiffness: float


class Curve(NamedTuple):
    """Half the arc's duration, and speed at its start over the time left, as series in the time left."""

    half: Series
    speed: Series


@inlined
def remaining_time(v: float, i: Restoring, j: Restoring) -> float:
    """Time to rest from an impact that enters side i with speed v, to second order in v.

    The first order is a geometric sum (the paper's Eq. 75); the second lets the accelerations change linearly in time:
    T_i(v, t) = A_i v + B_i v^2 solved from T_i = (arc) + T_j(next impact). Of the third order only what the stiffness
    adds to every arc is kept, the whole of it under a constant acceleration.
    """
    e_i, e_j = i.restitution, j.restitution
    pair = e_i * e_j
    inverse_i, inverse_j = 1.0 / i.g, 1.0 / j.g
    slope_i, slope_j = i.rate * inverse_i * inverse_i, j.rate * inverse_j * inverse_j
    scale = 2.0 / (1.0 - pair)
    A_i, A_j = scale * (inverse_i + e_i * inverse_j), scale * (inverse_j + e_j * inverse_i)
    drift_i, drift_j = -scale * (slope_i + e_i * slope_j), -scale * (slope_j + e_j * slope_i)
    own_i = slope_i * (2.0 * e_i * A_j - 4.0 * inverse_i) * THIRD + 2.0 * e_i * inverse_i * drift_j
    own_j = slope_j * (2.0 * e_j * A_i - 4.0 * inverse_j) * THIRD + 2.0 * e_j * inverse_j * drift_i
    B_i = (own_i + e_i * e_i * own_j) / (1.0 - pair * pair)
    bend_i, bend_j = i.stiffness * inverse_i**3, j.stiffness * inverse_j**3
    C_i = 2.0 * THIRD * (bend_i + e_i**3 * bend_j) / (1.0 - pair**3)
    return v * (A_i + v * (B_i + v * C_i))


@inlined
def at_rest(side: Restoring, s: float) -> Terms:
    """One side as seen from a rest time s later, with s for the unit of time; NaN where nothing presses it down."""
    g = side.g + s * (side.rate + s * side.curvature)
    rate = s * (side.rate + 2.0 * s * side.curvature)
    return Terms(g if g > 0.0 else math.nan, rate, side.curvature * s * s, side.stiffness * s * s)


@inlined
def forces(a: Terms, half: Series, sign: float) -> Three:
    """Coefficients 1, 2, 3 of B: the speeds at an arc's start (sign -1) and end (+1) are Y B.

    With Y half the duration and C = z - Y the time left at its middle, where the acceleration is G = g - rate C
    + curvature C^2, B = G (1 - k Y^2/3) + sign ((rate - 2 curvature C) Y/3 - rate k Y^3/45) + curvature Y^2/3 and k
    the stiffness.
    """
    y, y2, y3, _ = half
    c = 1.0 - y
    G = -a.rate * c
    stiff = THIRD * a.stiffness * y
    bent = THIRD * a.curvature * y
    skew = THIRD * sign
    b = G + skew * a.rate * y
    b2 = (
        a.rate * y2
        + a.curvature * c * c
        - stiff * a.g * y
        + skew * (a.rate * y2 - 2.0 * a.curvature * c * y)
        + bent * y
    )
    b3 = (
        a.rate * y3
        - 2.0 * a.curvature * c * y2
        - stiff * (G * y + 2.0 * a.g * y2)
        + skew * (a.rate * y3 - 2.0 * a.curvature * y2 * (c - y) - FIFTEENTH * a.rate * a.stiffness * y * y * y)
        + 2.0 * bent * y2
    )
    return b, b2, b3


@inlined
def known(half: Series, b: Three) -> Three:
    """Coefficients 2, 3, 4 of Y B, each without the part g Y."""
    y, y2, y3, _ = half
    return y * b[0], y2 * b[0] + y * b[1], y3 * b[0] + y2 * b[1] + y * b[2]


@inlined
def both(first: float, second: float, one: float, other: float) -> Pair:
    """Solve x = first + one y, y = second + other x."""
    inverse = 1.0 / (1.0 - one * other)
    return (first + one * second) * inverse, (second + other * first) * inverse


@inlined
def excess(m: Series, ends: Three, starts: Three, speed: Series, e: float) -> Three:
    """Return what orders 2, 3, 4 of an impact's two speeds differ by while the half durations of that order are zero.

    ``m``: the time left at the next impact; ``ends``, ``starts``: `known` of this arc's end and the next one's start;
    ``speed``: the next arc's speed at its start.
    """
    square = m[0] * m[0]
    second = square * starts[0] - e * ends[0]
    third = 2.0 * speed[1] * m[0] * m[1] + square * m[0] * starts[1] - e * ends[1]
    fourth = (
        speed[1] * (m[1] * m[1] + 2.0 * m[0] * m[2])
        + 3.0 * speed[2] * square * m[1]
        + square * square * starts[2]
        - e * ends[2]
    )
    return second, third, fourth


@inlined
def left(half: Series) -> Series:
    """Time left at the next impact, z - 2 Y."""
    return 1.0 - 2.0 * half[0], -2.0 * half[1], -2.0 * half[2], -2.0 * half[3]


@inlined
def rest_curves(a: Terms, b: Terms, e_a: float, e_b: float) -> tuple[Curve, Curve]:
    """Half durations and speeds of arcs that end in rest at the candidate time, to fourth order in the time left."""
    half = 0.5 * (1.0 - e_a * e_b)
    inverse_a, inverse_b = 1.0 / a.g, 1.0 / b.g
    speed_a, speed_b = half / (inverse_a + e_a * inverse_b), half / (inverse_b + e_b * inverse_a)
    A = Curve((speed_a * inverse_a, 0.0, 0.0, 0.0), (speed_a, 0.0, 0.0, 0.0))
    B = Curve((speed_b * inverse_b, 0.0, 0.0, 0.0), (speed_b, 0.0, 0.0, 0.0))
    A, B = raised(a, b, e_a, e_b, A, B, 2)
    A, B = raised(a, b, e_a, e_b, A, B, 3)
    return raised(a, b, e_a, e_b, A, B, 4)


@inlined
def raised(a: Terms, b: Terms, e_a: float, e_b: float, A: Curve, B: Curve, order: int) -> tuple[Curve, Curve]:
    """Add the coefficients of one order: 2, 3 or 4."""
    starts_a, ends_a = known(A.half, forces(a, A.half, -1.0)), known(A.half, forces(a, A.half, 1.0))
    starts_b, ends_b = known(B.half, forces(b, B.half, -1.0)), known(B.half, forces(b, B.half, 1.0))
    m_a, m_b = left(A.half), left(B.half)
    k = order - 2
    own_a = excess(m_a, ends_a, starts_b, B.speed, e_a)[k] * (1.0 / B.speed[0])
    own_b = excess(m_b, ends_b, starts_a, A.speed, e_b)[k] * (1.0 / A.speed[0])
    y_a, y_b = both(own_a, own_b, power(m_a[0], order), power(m_b[0], order))
    y_a *= A.half[0]
    y_b *= B.half[0]
    return extended(A, y_a, starts_a[k] + a.g * y_a, order), extended(B, y_b, starts_b[k] + b.g * y_b, order)


@inlined
def power(x: float, order: int) -> float:
    """Return x to the power 2, 3 or 4."""
    square = x * x
    if order == 2:
        return square
    return square * x if order == 3 else square * square


@inlined
def extended(A: Curve, y: float, speed: float, order: int) -> Curve:
    """Set one order's coefficients."""
    h, s = A
    if order == 2:
        return Curve((h[0], y, 0.0, 0.0), (s[0], speed, 0.0, 0.0))
    if order == 3:
        return Curve((h[0], h[1], y, 0.0), (s[0], s[1], speed, 0.0))
    return Curve((h[0], h[1], h[2], y), (s[0], s[1], s[2], speed))


@inlined
def speed_of(a: Terms, half: Series) -> float:
    """Speed at the start of the arc at whose start the whole time is left, over that time."""
    y = half[0] + half[1] + half[2] + half[3]
    c = 1.0 - y
    g = a.g - c * (a.rate - c * a.curvature)
    stiff = a.stiffness * y
    rate = a.rate * (1.0 - FIFTEENTH * stiff * y) - 2.0 * a.curvature * c
    return y * (g - THIRD * y * (rate + stiff * g - a.curvature * y))


@inlined
def first_candidate(v: float, i: Restoring, j: Restoring) -> float:
    """Time to rest to second order in v, as the root of a quadratic: exact where restitution is nearly one."""
    constant = 2.0 * v * (1.0 / i.g + i.restitution / j.g) / (1.0 - i.restitution * j.restitution)
    bent = remaining_time(v, i, j) - constant
    return 2.0 * constant / (1.0 + math.sqrt(max(0.0, 1.0 - 4.0 * bent / constant)))


@inlined
def rest_candidate(v: float, i: Restoring, j: Restoring, s: float) -> tuple[float, Terms, Terms, Curve, Curve, float]:
    """Time to rest from an impact that enters side i with speed v, to fourth order, by Newton's steps from s.

    Returns it, both sides at that time, their curves, and how far it is from solving speed(time) = v, in speed.
    """
    e_i, e_j = i.restitution, j.restitution
    a, b = at_rest(i, s), at_rest(j, s)
    A, B = rest_curves(a, b, e_i, e_j)
    missing = v / s - speed_of(a, A.half)
    for _ in range(_CANDIDATES):
        if not abs(missing) > _SETTLED * A.speed[0]:
            break
        # The slope also holds how the first coefficient changes with the candidate; the rest is smaller.
        first = A.speed[0]
        moved = a.rate / (a.g * a.g) + e_i * b.rate / (b.g * b.g)
        slope = first + 2.0 * A.speed[1] + 3.0 * A.speed[2] + 2.0 * first * first * moved / (1.0 - e_i * e_j)
        s += s * missing / slope
        if not s > 0.0:
            s = math.nan
        a, b = at_rest(i, s), at_rest(j, s)
        A, B = rest_curves(a, b, e_i, e_j)
        missing = v / s - speed_of(a, A.half)
    return s, a, b, A, B, missing
