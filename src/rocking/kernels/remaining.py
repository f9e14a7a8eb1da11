"""Remaining time of complete chattering, estimated to fourth order in the speed.

Within one smooth piece of the motion, the restoring acceleration of side j at a rotation u is

    g + rate t + curvature t^2 - stiffness u,    to within an error,

with a stiffness of p^2 for a block, 0 for a ball on a moving table, and a negative one for an oscillator with a stop. A
body that bounces on one side has two equal sides. See "Theory" in the documentation.

Let s be the remaining time at an impact that enters side i, before a candidate for the time of rest. Half the duration
of the arc is a polynomial Y_i(s), so that s - 2 Y_i(s) remains at the next impact. The speeds at both ends of an arc
are polynomials of the times of both impacts. Comparison of coefficients determines Y_i, and the remaining terms, also a
polynomial, bound the error (`bound_remainder`). Below, z is the remaining time divided by its value at the first
impact. NaN arguments make the results NaN, and a NaN bracket proves nothing.
"""

import math
from typing import NamedTuple

from rocking.kernels.compiled import inlined, not_inlined

#: Number of Newton steps to the time of rest, and the relative error of the speed that ends them.
_MAX_NEWTON_STEPS = 5
_SPEED_TOLERANCE = 2.0**-40

THIRD = 1.0 / 3.0
FIFTEENTH = 1.0 / 15.0

#: Coefficients of powers 1, 2, 3, 4.
Series = tuple[float, float, float, float]
Triple = tuple[float, float, float]
Pair = tuple[float, float]


class ImpactSide(NamedTuple):
    """One side at an impact: restoring acceleration g + rate t + curvature t^2 - stiffness u."""

    g: float  # restoring acceleration at the impact
    rate: float  # rate of g
    curvature: float  # half the second derivative of g
    stiffness: float  # decrease per unit of rotation
    restitution: float  # factor on the speed on leaving the side
    error: float  # bound on the error of the restoring acceleration


class RestSide(NamedTuple):
    """One side at the candidate for the rest, as `ImpactSide`, with the remaining time as the unit of time."""

    g: float  # restoring acceleration at the rest
    rate: float  # rate of g
    curvature: float  # half the second derivative of g
    stiffness: float  # decrease per unit of rotation


class Curve(NamedTuple):
    """Arcs of one side as series in the remaining time s."""

    half: Series  # half the duration
    speed: Series  # initial speed divided by s


@inlined
def estimate_remaining_time(v: float, i: ImpactSide, j: ImpactSide) -> float:
    """Compute the time to rest from an impact that enters side i with speed v, to second order in v.

    The first order is a geometric sum (the paper's Eq. 75). For the second, with accelerations linear in time,
    T_i(v, t) = A_i v + B_i v^2 solves T_i = (arc) + T_j(next impact). The only third-order term is the effect of the
    stiffness on every arc, complete under constant acceleration.
    """
    e_i, e_j = i.restitution, j.restitution
    product = e_i * e_j
    inverse_i, inverse_j = 1.0 / i.g, 1.0 / j.g
    slope_i, slope_j = i.rate * inverse_i * inverse_i, j.rate * inverse_j * inverse_j
    scale = 2.0 / (1.0 - product)
    A_i, A_j = scale * (inverse_i + e_i * inverse_j), scale * (inverse_j + e_j * inverse_i)
    drift_i, drift_j = -scale * (slope_i + e_i * slope_j), -scale * (slope_j + e_j * slope_i)
    source_i = slope_i * (2.0 * e_i * A_j - 4.0 * inverse_i) * THIRD + 2.0 * e_i * inverse_i * drift_j
    source_j = slope_j * (2.0 * e_j * A_i - 4.0 * inverse_j) * THIRD + 2.0 * e_j * inverse_j * drift_i
    B_i = (source_i + e_i * e_i * source_j) / (1.0 - product * product)
    stiff_i = i.stiffness * (inverse_i * inverse_i * inverse_i)
    stiff_j = j.stiffness * (inverse_j * inverse_j * inverse_j)
    C_i = 2.0 * THIRD * (stiff_i + e_i * e_i * e_i * stiff_j) / (1.0 - product * product * product)
    return v * (A_i + v * (B_i + v * C_i))


@inlined
def find_side_at_candidate(side: ImpactSide, s: float) -> RestSide:
    """Expand a side about a candidate s later, with s as the unit of time; g is NaN if not positive."""
    g = side.g + s * (side.rate + s * side.curvature)
    rate = s * (side.rate + 2.0 * s * side.curvature)
    return RestSide(g if g > 0.0 else math.nan, rate, side.curvature * s * s, side.stiffness * s * s)


@inlined
def average_restoring(a: RestSide, half: Series, sign: float) -> Triple:
    """Compute coefficients 1, 2, 3 of B, where Y B is the speed at the start (sign -1) or end (+1) of an arc.

    Y is half the duration, C = z - Y the remaining time and G = g - rate C + curvature C^2 the acceleration at its
    middle, and k the stiffness:

        B = G (1 - k Y^2/3) + sign ((rate - 2 curvature C) Y/3 - rate k Y^3/45) + curvature Y^2/3.
    """
    y, y2, y3, _ = half
    c = 1.0 - y
    G = -a.rate * c
    stiffness = THIRD * a.stiffness * y
    curvature = THIRD * a.curvature * y
    odd = THIRD * sign
    b = G + odd * a.rate * y
    b2 = (
        a.rate * y2
        + a.curvature * c * c
        - stiffness * a.g * y
        + odd * (a.rate * y2 - 2.0 * a.curvature * c * y)
        + curvature * y
    )
    b3 = (
        a.rate * y3
        - 2.0 * a.curvature * c * y2
        - stiffness * (G * y + 2.0 * a.g * y2)
        + odd * (a.rate * y3 - 2.0 * a.curvature * y2 * (c - y) - FIFTEENTH * a.rate * a.stiffness * y * y * y)
        + 2.0 * curvature * y2
    )
    return b, b2, b3


@inlined
def compute_known_speed_terms(a: RestSide, half: Series, sign: float) -> Triple:
    """Compute coefficients 2, 3, 4 of Y B without g Y, which contains the unknown coefficient."""
    b = average_restoring(a, half, sign)
    y, y2, y3, _ = half
    return y * b[0], y2 * b[0] + y * b[1], y3 * b[0] + y2 * b[1] + y * b[2]


@inlined
def solve_pair(first: float, second: float, p: float, q: float) -> Pair:
    """Solve x = first + p y, y = second + q x."""
    inverse = 1.0 / (1.0 - p * q)
    return (first + p * second) * inverse, (second + q * first) * inverse


@inlined
def compute_speed_difference(m: Series, ends: Triple, starts: Triple, speed: Series, e: float) -> Triple:
    """Compute orders 2, 3, 4 of the difference of the speeds at an impact, with zero half durations of that order.

    ``m`` is the remaining time at the next impact, ``ends`` and ``starts`` are the `compute_known_speed_terms` of this
    arc's end and the next one's start, and ``speed`` is the initial speed of the next arc.
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
def subtract_arc(half: Series) -> Series:
    """Compute the remaining time at the next impact, z - 2 Y."""
    return 1.0 - 2.0 * half[0], -2.0 * half[1], -2.0 * half[2], -2.0 * half[3]


@inlined
def expand_curves(a: RestSide, b: RestSide, e_a: float, e_b: float) -> tuple[Curve, Curve]:
    """Compute half durations and speeds of the arcs before rest at the candidate, to order 4 in the remaining time."""
    half = 0.5 * (1.0 - e_a * e_b)
    inverse_a, inverse_b = 1.0 / a.g, 1.0 / b.g
    speed_a, speed_b = half / (inverse_a + e_a * inverse_b), half / (inverse_b + e_b * inverse_a)
    A = Curve((speed_a * inverse_a, 0.0, 0.0, 0.0), (speed_a, 0.0, 0.0, 0.0))
    B = Curve((speed_b * inverse_b, 0.0, 0.0, 0.0), (speed_b, 0.0, 0.0, 0.0))
    A, B = extend_curves(a, b, e_a, e_b, A, B, 2)
    A, B = extend_curves(a, b, e_a, e_b, A, B, 3)
    return extend_curves(a, b, e_a, e_b, A, B, 4)


@inlined
def extend_curves(
    a: RestSide, b: RestSide, e_a: float, e_b: float, A: Curve, B: Curve, order: int
) -> tuple[Curve, Curve]:
    """Return both curves with the coefficients of one more order: 2, 3 or 4."""
    starts_a, starts_b = compute_known_speed_terms(a, A.half, -1.0), compute_known_speed_terms(b, B.half, -1.0)
    ends_a, ends_b = compute_known_speed_terms(a, A.half, 1.0), compute_known_speed_terms(b, B.half, 1.0)
    m_a, m_b = subtract_arc(A.half), subtract_arc(B.half)
    k = order - 2
    source_a = compute_speed_difference(m_a, ends_a, starts_b, B.speed, e_a)[k] * (1.0 / B.speed[0])
    source_b = compute_speed_difference(m_b, ends_b, starts_a, A.speed, e_b)[k] * (1.0 / A.speed[0])
    y_a, y_b = solve_pair(source_a, source_b, raise_to_power(m_a[0], order), raise_to_power(m_b[0], order))
    y_a *= A.half[0]
    y_b *= B.half[0]
    A = set_coefficient(A, y_a, starts_a[k] + a.g * y_a, order)
    return A, set_coefficient(B, y_b, starts_b[k] + b.g * y_b, order)


@inlined
def raise_to_power(x: float, order: int) -> float:
    """Return x to the power of 2, 3 or 4."""
    square = x * x
    if order == 2:
        return square
    return square * x if order == 3 else square * square


@inlined
def set_coefficient(A: Curve, y: float, speed: float, order: int) -> Curve:
    """Set the coefficients of one order."""
    h, s = A
    if order == 2:
        return Curve((h[0], y, 0.0, 0.0), (s[0], speed, 0.0, 0.0))
    if order == 3:
        return Curve((h[0], h[1], y, 0.0), (s[0], s[1], speed, 0.0))
    return Curve((h[0], h[1], h[2], y), (s[0], s[1], s[2], speed))


@inlined
def compute_initial_speed(a: RestSide, half: Series) -> float:
    """Compute the initial speed of the first arc (z = 1) divided by the remaining time."""
    y = half[0] + half[1] + half[2] + half[3]
    c = 1.0 - y
    g = a.g - c * (a.rate - c * a.curvature)
    stiffness = a.stiffness * y
    rate = a.rate * (1.0 - FIFTEENTH * stiffness * y) - 2.0 * a.curvature * c
    return y * (g - THIRD * y * (rate + stiffness * g - a.curvature * y))


@inlined
def estimate_candidate(v: float, i: ImpactSide, j: ImpactSide) -> float:
    """Compute the time to rest to second order in v as the root of a quadratic: exact for a restitution near one."""
    constant = 2.0 * v * (1.0 / i.g + i.restitution / j.g) / (1.0 - i.restitution * j.restitution)
    correction = estimate_remaining_time(v, i, j) - constant
    return 2.0 * constant / (1.0 + math.sqrt(max(0.0, 1.0 - 4.0 * correction / constant)))


@inlined
def solve_candidate(
    v: float, i: ImpactSide, j: ImpactSide, s: float
) -> tuple[float, RestSide, RestSide, Curve, Curve, float]:
    """Compute the time to rest from an impact that enters side i with speed v, to fourth order, by Newton steps from s.

    Returns the time, both sides at that time, their curves, and the residual of speed(time) = v, divided by the time.
    """
    e_i, e_j = i.restitution, j.restitution
    a, b = find_side_at_candidate(i, s), find_side_at_candidate(j, s)
    A, B = expand_curves(a, b, e_i, e_j)
    residual = v / s - compute_initial_speed(a, A.half)
    for _ in range(_MAX_NEWTON_STEPS):
        if not abs(residual) > _SPEED_TOLERANCE * A.speed[0]:
            break
        # The slope includes the change of the first coefficient with the candidate; other changes are smaller.
        first = A.speed[0]
        change = a.rate / (a.g * a.g) + e_i * b.rate / (b.g * b.g)
        slope = first + 2.0 * A.speed[1] + 3.0 * A.speed[2] + 2.0 * first * first * change / (1.0 - e_i * e_j)
        s += s * residual / slope
        if not s > 0.0:
            s = math.nan
        a, b = find_side_at_candidate(i, s), find_side_at_candidate(j, s)
        A, B = expand_curves(a, b, e_i, e_j)
        residual = v / s - compute_initial_speed(a, A.half)
    return s, a, b, A, B, residual


#: Relative allowance for rounding.
_BOUND_ROUNDING = 2.0**-48

#: Largest relative distance from the candidate for the proof, and its factor on the bounds.
_MAX_DISTANCE = 2.0**-12
_MARGIN = 1.0 + 2.0**-7

#: Largest |stiffness| (half an arc)^2 for which the expansions in it are bounded.
_MAX_STIFFNESS = 1.0 / 16.0


@inlined
def sum_magnitudes(series: Series) -> float:
    """Sum the absolute values of coefficients."""
    return abs(series[0]) + abs(series[1]) + abs(series[2]) + abs(series[3])


@inlined
def bound_mean_restoring(a: RestSide, half: Series) -> Pair:
    """Bound the terms of B (`average_restoring`) beyond order 3, divided by z^4, and all of B."""
    y, y2 = half[0], abs(half[1])
    c = abs(1.0 - y)
    Y = sum_magnitudes(half)
    C = c + Y - y
    rate, curvature, stiffness = abs(a.rate), abs(a.curvature), abs(a.stiffness)
    G = a.g + C * (rate + C * curvature)
    higher_terms = (
        rate * abs(half[3]) * (1.0 + THIRD)
        + curvature * (C * C - c * (c + 2.0 * y2))
        + THIRD * stiffness * (G * Y * Y - y * (a.g * y + rate * c * y + 2.0 * a.g * y2))
        + THIRD * curvature * (2.0 * (C * Y - c * (y + y2) - y2 * y) + Y * Y - y * (y + 2.0 * y2))
        + THIRD * FIFTEENTH * rate * stiffness * (Y * Y * Y - y * y * y)
    )
    odd = rate * (1.0 + FIFTEENTH * stiffness * Y * Y) + curvature * (2.0 * C + Y)
    return higher_terms, G * (1.0 + THIRD * stiffness * Y * Y) + THIRD * Y * odd


@inlined
def bound_speed(half: Series, b: Triple, higher_terms: float) -> float:
    """Bound the terms of Y B beyond order 4, divided by z^5."""
    y2, y3, y4 = abs(half[1]), abs(half[2]), abs(half[3])
    b1, b2, b3 = abs(b[0]), abs(b[1]), abs(b[2])
    return y2 * b3 + y3 * (b2 + b3) + y4 * (b1 + b2 + b3) + sum_magnitudes(half) * higher_terms


@inlined
def bound_mismatch(m: Series, end: float, start: float, speed: Series, e: float) -> float:
    """Bound the difference of the speeds at an impact, divided by z^5; its orders 1 to 4 are zero.

    ``end``, ``start``: `bound_speed` of this arc's end and the next one's start.
    """
    M = sum_magnitudes(m)
    square, m1, m2 = M * M, abs(m[0]), abs(m[1])
    second = square - m1 * (m1 + 2.0 * m2 + 2.0 * abs(m[2])) - m2 * m2
    third = square * M - m1 * m1 * (m1 + 3.0 * m2)
    fourth = square * square - m1 * m1 * (m1 * m1)
    higher = abs(speed[1]) * second + abs(speed[2]) * third + abs(speed[3]) * fourth
    return e * end + higher + start * square * square * M


class ArcLimits(NamedTuple):
    """Bounds on the arcs of one side, in units of the remaining time z."""

    half: float  # half duration divided by z
    change: float  # change of the acceleration
    inverse: float  # inverse of the smallest slope of an arc's initial speed by the time of rest
    error: float  # error of the speeds divided by z
    series: float  # error of the expansions of the speeds divided by z
    end: float  # `bound_speed` of the ends of arcs
    start: float  # `bound_speed` of the starts of arcs
    speeds: float  # sum of all |terms| of the speeds


@inlined
def bound_arcs(side: ImpactSide, a: RestSide, half: Series) -> ArcLimits:
    """Bound the arcs of one side within the remaining time; NaN if the proof's assumptions are violated."""
    rate, curvature = abs(a.rate), abs(a.curvature)
    change = rate + 2.0 * curvature
    Y = sum_magnitudes(half)
    stiffness = abs(a.stiffness) * Y * Y * _MARGIN
    magnitude = abs(side.g) + change
    min_restoring = min(side.g, a.g) - 0.25 * curvature - 2.0 * _MAX_DISTANCE * change - _BOUND_ROUNDING * magnitude
    min_slope = min_restoring * (1.0 - stiffness) - (THIRD * curvature * Y * Y + 0.1 * rate * stiffness * Y) * _MARGIN
    growth = half[0] - (2.0 * abs(half[1]) + 3.0 * abs(half[2]) + 4.0 * abs(half[3])) * _MARGIN
    higher_terms, mean_bound = bound_mean_restoring(a, half)
    end = bound_speed(half, average_restoring(a, half, 1.0), higher_terms)
    start = bound_speed(half, average_restoring(a, half, -1.0), higher_terms)
    is_valid = min_restoring > 0.0 and min_slope > 0.0 and growth > 0.0 and stiffness <= _MAX_STIFFNESS
    inverse = 1.0 / (min_slope * growth) if is_valid else math.nan
    fourth = stiffness * ((a.g + change) / 7.0 + change * Y / 450.0)
    series = stiffness * (fourth + curvature * Y * (Y / 14.0 + 0.05))
    return ArcLimits(Y, change, inverse, 1.03 * Y * side.error, Y * series, end, start, Y * (mean_bound + magnitude))


@inlined
def bound_shifts(m: Series, current: ArcLimits, following: ArcLimits, speed: Series, e: float) -> Triple:
    """Bound the shift of the time of rest by one arc and impact, divided by z^5, z, and z times the distance so far."""
    M = sum_magnitudes(m)
    fifth = bound_mismatch(m, current.end, following.start, speed, e) * following.inverse
    rounding = 4.0 * _BOUND_ROUNDING * (e * current.speeds + following.speeds * M)
    inverse_before, inverse_after = current.inverse, e * following.inverse
    first = (
        rounding * following.inverse
        + current.error * max(inverse_before, inverse_after)
        + current.series * (inverse_before + inverse_after)
    )
    drift = 1.03 * (e * current.change * current.half + following.change * following.half * M) * following.inverse
    return fifth * _MARGIN, first * _MARGIN, drift * _MARGIN


@inlined
def bound_distance(first: float, ratios: Pair, first_shift: Triple, second_shift: Triple) -> float:
    """Bound the distance of the time of rest from the candidate by the geometric sum of all shifts; NaN: no proof."""
    pair = ratios[0] * ratios[1]
    square = ratios[0] * ratios[0]
    inverse = 1.0 / (1.0 - pair)
    fifths = (first_shift[0] + second_shift[0] * square * square * ratios[0]) / (1.0 - pair * pair * pair * pair * pair)
    linear = (first_shift[1] + second_shift[1] * ratios[0]) * inverse
    drift = (first_shift[2] + second_shift[2] * ratios[0]) * inverse
    bound = (first + fifths + linear) / (1.0 - drift)
    return bound if pair < 1.0 and drift < 1.0 and bound <= _MAX_DISTANCE else math.nan


@inlined
def bound_ratio(m: Series, shift: Triple, next_shift: Triple) -> float:
    """Bound the ratio of remaining times at two impacts, shifts included; NaN if their order is uncertain."""
    shifted = shift[0] + shift[1] + shift[2] * _MAX_DISTANCE + next_shift[1]
    higher = (abs(m[1]) + abs(m[2]) + abs(m[3])) * _MARGIN
    max_ratio = abs(m[0]) + higher + shifted
    return max_ratio if m[0] - higher > shifted and max_ratio <= 1.0 else math.nan


@not_inlined
def refine_bracket(v: float, i: ImpactSide, j: ImpactSide, window: float) -> Pair:
    """Compute a bracket on the time to rest from an impact that enters side i with speed v; NaN, NaN: no proof.

    Complete chattering has been proven within ``window``, during which i and j hold.
    """
    if not (0.0 < v < math.inf and i.g > 0.0 and j.g > 0.0 and i.restitution * j.restitution < 1.0):
        return math.nan, math.nan
    first = estimate_candidate(v, i, j)
    if not 0.5 * first <= window:
        return math.nan, math.nan
    s, a, b, A, B, residual = solve_candidate(v, i, j, first)
    half_width = s * bound_remainder(i, j, (a, b), (A, B), residual) * (1.0 + _BOUND_ROUNDING) + _BOUND_ROUNDING * s
    if not (s > 0.0 and s + half_width <= window):
        return math.nan, math.nan
    return s - half_width, s + half_width


@inlined
def bound_remainder(
    i: ImpactSide, j: ImpactSide, sides: tuple[RestSide, RestSide], curves: tuple[Curve, Curve], residual: float
) -> float:
    """Bound the distance of the time of rest from a candidate (see `solve_candidate`), divided by it; NaN: no proof."""
    A, B = curves
    limits_i, limits_j = bound_arcs(i, sides[0], A.half), bound_arcs(j, sides[1], B.half)
    m_i, m_j = subtract_arc(A.half), subtract_arc(B.half)
    shift_i = bound_shifts(m_i, limits_i, limits_j, B.speed, i.restitution)
    shift_j = bound_shifts(m_j, limits_j, limits_i, A.speed, j.restitution)
    ratios = bound_ratio(m_i, shift_i, shift_j), bound_ratio(m_j, shift_j, shift_i)
    first = (abs(residual) + 4.0 * _BOUND_ROUNDING * limits_i.speeds) * limits_i.inverse
    return bound_distance(first, ratios, shift_i, shift_j)


@inlined
def bound_restoring_error(error: float, change: float, curvature: float, height: float) -> float:
    """Compute the error of an `ImpactSide` up to a height, where G = g - k u + ... with a variable stiffness k.

    ``error`` of g; ``change`` of k during the window; ``curvature`` bounds |d2G/du2|. For a nonlinear block under
    ground accelerations a in units of g, k = p^2 (cos(alpha) - j a sin(alpha)), with a curvature of
    p^2 hypot(1, |a|max).
    """
    return (error + height * (change + 0.5 * curvature * height)) * (1.0 + _BOUND_ROUNDING)
