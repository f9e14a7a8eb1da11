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

from rocking.kernels.compiled import inlined, shared

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


#: Relative allowance for rounding.
_ROUNDING = 2.0**-48

#: Relative distance from the candidate rest time within which the proof works, and what it costs the bounds.
_NEAR = 2.0**-12
_MARGIN = 1.0 + 2.0**-7

#: Largest |stiffness| (half an arc)^2 for which the expansions in it are bounded.
_LARGEST_STIFFNESS = 1.0 / 16.0


@inlined
def total(series: Series) -> float:
    """Sum of the sizes of coefficients."""
    return abs(series[0]) + abs(series[1]) + abs(series[2]) + abs(series[3])


@inlined
def forces_bound(a: Terms, half: Series) -> Pair:
    """Bounds on what B (`forces`) holds beyond order 3, over z^4, and on all of it."""
    y, y2 = half[0], abs(half[1])
    c = abs(1.0 - y)
    Y = total(half)
    C = c + Y - y
    rate, bend, stiff = abs(a.rate), abs(a.curvature), abs(a.stiffness)
    G = a.g + C * (rate + C * bend)
    beyond = (
        rate * abs(half[3]) * (1.0 + THIRD)
        + bend * (C * C - c * (c + 2.0 * y2))
        + THIRD * stiff * (G * Y * Y - y * (a.g * y + rate * c * y + 2.0 * a.g * y2))
        + THIRD * bend * (2.0 * (C * Y - c * (y + y2) - y2 * y) + Y * Y - y * (y + 2.0 * y2))
        + THIRD * FIFTEENTH * rate * stiff * (Y * Y * Y - y * y * y)
    )
    skew = rate * (1.0 + FIFTEENTH * stiff * Y * Y) + bend * (2.0 * C + Y)
    return beyond, G * (1.0 + THIRD * stiff * Y * Y) + THIRD * Y * skew


@inlined
def speed_bound(half: Series, b: Three, beyond: float) -> float:
    """Bound on what Y B holds beyond order 4, over z^5."""
    y2, y3, y4 = abs(half[1]), abs(half[2]), abs(half[3])
    b1, b2, b3 = abs(b[0]), abs(b[1]), abs(b[2])
    return y2 * b3 + y3 * (b2 + b3) + y4 * (b1 + b2 + b3) + total(half) * beyond


@inlined
def mismatch(m: Series, end: float, start: float, speed: Series, e: float) -> float:
    """Bound on the mismatch of speeds at an impact, over z^5, of which orders 1 to 4 are made zero.

    ``end``, ``start``: `speed_bound` of this arc's end and of the next one's start.
    """
    M = total(m)
    square, m1, m2 = M * M, abs(m[0]), abs(m[1])
    second = square - m1 * (m1 + 2.0 * m2 + 2.0 * abs(m[2])) - m2 * m2
    third = square * M - m1 * m1 * (m1 + 3.0 * m2)
    fourth = square * square - m1 * m1 * (m1 * m1)
    chained = abs(speed[1]) * second + abs(speed[2]) * third + abs(speed[3]) * fourth
    return e * end + chained + start * square * square * M


class Limits(NamedTuple):
    """Bounds on one side's arcs, in units of the time left."""

    half: float
    change: float
    inverse: float
    error: float
    series: float
    end: float
    start: float
    speeds: float


@inlined
def limits(side: Restoring, a: Terms, half: Series) -> Limits:
    """Bounds on one side's arcs while s is left; NaN where the hypotheses fail.

    Half duration, error of the speeds, and of their expansions, over z; change of the acceleration; inverse of the
    least slope of the speed at an arc's start by the rest time; `speed_bound` of both ends; size of all terms of the
    speeds.
    """
    rate, bend = abs(a.rate), abs(a.curvature)
    change = rate + 2.0 * bend
    Y = total(half)
    stiff = abs(a.stiffness) * Y * Y * _MARGIN
    sizes = abs(side.g) + change
    least = min(side.g, a.g) - 0.25 * bend - 2.0 * _NEAR * change - _ROUNDING * sizes
    by_half = least * (1.0 - stiff) - (THIRD * bend * Y * Y + 0.1 * rate * stiff * Y) * _MARGIN
    growth = half[0] - (2.0 * abs(half[1]) + 3.0 * abs(half[2]) + 4.0 * abs(half[3])) * _MARGIN
    beyond, whole = forces_bound(a, half)
    end = speed_bound(half, forces(a, half, 1.0), beyond)
    start = speed_bound(half, forces(a, half, -1.0), beyond)
    proven = least > 0.0 and by_half > 0.0 and growth > 0.0 and stiff <= _LARGEST_STIFFNESS
    inverse = 1.0 / (by_half * growth) if proven else math.nan
    series = stiff * (stiff * ((a.g + change) / 7.0 + change * Y / 450.0) + bend * Y * (Y / 14.0 + 0.05))
    return Limits(Y, change, inverse, 1.03 * Y * side.error, Y * series, end, start, Y * (whole + sizes))


@inlined
def shifts(m: Series, here: Limits, there: Limits, speed: Series, e: float) -> Three:
    """Bounds on how far one arc and impact shift the rest time: over z^5, over z, over z and the distance so far."""
    M = total(m)
    fifth = mismatch(m, here.end, there.start, speed, e) * there.inverse
    rounding = 4.0 * _ROUNDING * (e * here.speeds + there.speeds * M)
    before, after = here.inverse, e * there.inverse
    first = rounding * there.inverse + here.error * max(before, after) + here.series * (before + after)
    drift = 1.03 * (e * here.change * here.half + there.change * there.half * M) * there.inverse
    return fifth * _MARGIN, first * _MARGIN, drift * _MARGIN


@inlined
def distance(missing: float, ratios: Pair, one: Three, other: Three) -> float:
    """Bound on the distance of the rest time from the candidate: the geometric sum of all shifts."""
    pair = ratios[0] * ratios[1]
    square = ratios[0] * ratios[0]
    inverse = 1.0 / (1.0 - pair)
    fifths = (one[0] + other[0] * square * square * ratios[0]) / (1.0 - pair * pair * pair * pair * pair)
    firsts = (one[1] + other[1] * ratios[0]) * inverse
    drift = (one[2] + other[2] * ratios[0]) * inverse
    found = (missing + fifths + firsts) / (1.0 - drift)
    return found if pair < 1.0 and drift < 1.0 and found <= _NEAR else math.nan


@inlined
def ratio(m: Series, shift: Three, following: Three) -> float:
    """Largest ratio of the times left at two impacts, shifts included; NaN where the next might be out of order."""
    wandering = shift[0] + shift[1] + shift[2] * _NEAR + following[1]
    rest = (abs(m[1]) + abs(m[2]) + abs(m[3])) * _MARGIN
    largest = abs(m[0]) + rest + wandering
    return largest if m[0] - rest > wandering and largest <= 1.0 else math.nan


@shared
def refined_bracket(v: float, i: Restoring, j: Restoring, window: float) -> Pair:
    """Bracket on the time to rest from an impact that enters side i with speed v; NaN, NaN: no proof.

    ``window``: time over which what i and j say holds, within which complete chattering has been proven.
    """
    if not (0.0 < v < math.inf and i.g > 0.0 and j.g > 0.0 and i.restitution * j.restitution < 1.0):
        return math.nan, math.nan
    first = first_candidate(v, i, j)
    if not 0.5 * first <= window:
        return math.nan, math.nan
    s, a, b, A, B, missing = rest_candidate(v, i, j, first)
    half_width = s * remainder(s, i, j, (a, b), (A, B), missing) * (1.0 + _ROUNDING) + _ROUNDING * s
    if not (s > 0.0 and s + half_width <= window):
        return math.nan, math.nan
    return s - half_width, s + half_width


@inlined
def remainder(
    s: float, i: Restoring, j: Restoring, terms: tuple[Terms, Terms], curves: tuple[Curve, Curve], missing: float
) -> float:
    """Bound on the rest time's distance from a candidate, over the time left s; NaN: no proof.

    See `rest_candidate` for the rest.
    """
    A, B = curves
    one, other = limits(i, terms[0], A.half), limits(j, terms[1], B.half)
    m_i, m_j = left(A.half), left(B.half)
    shift_i = shifts(m_i, one, other, B.speed, i.restitution)
    shift_j = shifts(m_j, other, one, A.speed, j.restitution)
    ratios = ratio(m_i, shift_i, shift_j), ratio(m_j, shift_j, shift_i)
    away = (abs(missing) + 4.0 * _ROUNDING * one.speeds) * one.inverse
    return distance(away, ratios, shift_i, shift_j)


@inlined
def deviation(error: float, drift: float, bend: float, height: float) -> float:
    """Error of a `Restoring` up to a height where its stiffness drifts and bends: G = g - k u + ..., |d2G/du2| <= bend.

    ``error``: of g; ``drift``: of the stiffness k over the window. A nonlinear block with ground accelerations a in
    units of g has k = p^2 (cos(alpha) - j a sin(alpha)), bend = p^2 hypot(1, |a|max).
    """
    return (error + height * (drift + 0.5 * bend * height)) * (1.0 + _ROUNDING)
