"""How far off the estimated time to rest may be: a proven remainder of fifth order in the speed.

The comparison of coefficients in `remaining` leaves a mismatch of speeds at every impact. Bounds on it, on what the
motion does beyond a parabola and on all rounding tell how far one arc and impact may shift the time of rest; the sum of
all shifts is geometric. The derivation is in the documentation ("Theory").
"""

import math
from typing import NamedTuple

from rocking.kernels.compiled import inlined, shared
from rocking.kernels.remaining import (
    FIFTEENTH,
    THIRD,
    Curve,
    Pair,
    Restoring,
    Series,
    Terms,
    Three,
    first_candidate,
    forces,
    left,
    rest_candidate,
)

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
