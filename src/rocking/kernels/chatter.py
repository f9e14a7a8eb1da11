"""The chattering certificate: complete chattering proven for any motion, with a bracket on the time of rest.

At an impact the block enters side i with speed v. Over a window, side j's restoring acceleration at zero rotation

    g_j(t) = gain_j (threshold_j + j a(t)/g)

stays within [m_j, M_j], with gain = p^2, threshold = alpha (linear) or p^2 cos(alpha), tan(alpha) (nonlinear).
Comparison of the arc with two of constant acceleration bounds its duration and its height, energy bounds the next
impact's speed, and a geometric sum bounds all that follows. The derivation is in the documentation ("Theory").
"""

import math

import numpy as np

from rocking.kernels.arc import local_motion
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.state import GAIN, RESTITUTION, SLENDERNESS, STIFFNESS, THRESHOLD, Floats, Shaking

#: What is known of one side over a window, see `arc_bounds`.
Bounds = tuple[float, float, float, float, float, float]

#: Window of the proof over the first estimate of the remaining time.
_WINDOW = 1.5

#: Pieces of the motion that a window may span; longer windows wait for a slower impact.
_LONGEST_WINDOW = 256

#: Relative allowance for rounding in the bounds.
_ROUNDING = 2.0**-48


@inlined
def geometric_bracket(v: float, first: Bounds, second: Bounds, e_i: float, e_j: float) -> tuple[float, float]:
    """Lower and upper bound on the time to rest, for bounds that hold as long as needed; NaN, NaN: no proof.

    ``first`` bounds the side that the block enters, ``second`` the other one; see `arc_bounds`.
    """
    change_i, shortest_i, longest_i = arc_bounds(v, first)
    fastest = e_i * math.sqrt(1.0 + change_i) * v
    slowest = e_i * math.sqrt(max(0.0, 1.0 - change_i)) * v
    change_j, _, longest_j = arc_bounds(fastest, second)
    _, shortest_j, _ = arc_bounds(slowest, second)
    most = fastest / v * e_j * math.sqrt(1.0 + change_j) * (1.0 + _ROUNDING)
    least = slowest / v * e_j * math.sqrt(max(0.0, 1.0 - change_j)) * (1.0 - _ROUNDING)
    if not most < 1.0:
        return np.nan, np.nan
    lower = (shortest_i + shortest_j) / (1.0 - least)
    upper = (longest_i + longest_j) / (1.0 - most)
    return lower * (1.0 - _ROUNDING), upper * (1.0 + _ROUNDING)


@inlined
def arc_bounds(v: float, bounds: Bounds) -> tuple[float, float, float]:
    """Bounds on one arc of initial speed v: (|w^2/v^2 - 1| for its impact speed w, duration from, to); NaN: none.

    ``bounds`` = (stiff, m, M, swing, rate, leap): the restoring acceleration at zero rotation stays within [m, M] and
    changes by at most stiff per unit of rotation; what the motion adds to it changes by at most ``swing``, and within
    a time by at most ``rate`` times that time and ``leap``. The durations (2/sqrt(stiff)) atan(x), atanh(x), with
    x = sqrt(stiff) v/M and /m, are replaced by the rational bounds x - x^3/3 and x + x^3/(3 (1 - x^2)), which need no
    transcendental function.
    """
    stiff, m, M, swing, rate, leap = bounds
    if not (m > 0.0 and stiff * v * v < m * m):
        return np.nan, np.nan, np.nan
    squared = stiff * v * v / (m * m)
    shortest = 2.0 * v / M * (1.0 - stiff * v * v / (3.0 * M * M))
    longest = 2.0 * v / m * (1.0 + squared / (3.0 * (1.0 - squared)))
    change = 2.0 * min(swing, rate * longest + leap) / (m * (1.0 + math.sqrt(1.0 - squared)))
    return change, shortest, longest


@inlined
def remaining_time(
    v: float,
    g_i: float,
    g_j: float,
    rate_i: float,
    rate_j: float,
    stiff_i: float,
    stiff_j: float,
    e_i: float,
    e_j: float,
) -> float:
    """Time to rest, for restoring accelerations g at zero rotation that change at a rate, and fall by stiff times u.

    The first order in the speed is the paper's Eq. 75 (a geometric sum); the second lets the accelerations change
    linearly in time: T_i(v, t) = A_i v + B_i v^2 solved from T_i = (arc) + T_j(next impact). Of the third order only
    what stiff adds to every arc is kept, the whole of it under a constant acceleration.
    """
    pair = e_i * e_j
    A_i = 2.0 * (1.0 / g_i + e_i / g_j) / (1.0 - pair)
    A_j = 2.0 * (1.0 / g_j + e_j / g_i) / (1.0 - pair)
    drift_i = -2.0 * (rate_i / g_i**2 + e_i * rate_j / g_j**2) / (1.0 - pair)
    drift_j = -2.0 * (rate_j / g_j**2 + e_j * rate_i / g_i**2) / (1.0 - pair)
    own_i = -4.0 / 3.0 * rate_i / g_i**3 + e_i * (2.0 / 3.0 * A_j * rate_i / g_i**2 + 2.0 * drift_j / g_i)
    own_j = -4.0 / 3.0 * rate_j / g_j**3 + e_j * (2.0 / 3.0 * A_i * rate_j / g_j**2 + 2.0 * drift_i / g_j)
    B_i = (own_i + e_i * e_i * own_j) / (1.0 - pair * pair)
    C_i = 2.0 / 3.0 * (stiff_i / g_i**3 + e_i**3 * stiff_j / g_j**3) / (1.0 - pair**3)
    return v * (A_i + v * (B_i + v * C_i))


@shared
def motion_range(
    shaking: Shaking, piece: int, offset: float, window: float, A: Floats
) -> tuple[float, float, float, float]:
    """Bounds over a window that starts in a piece: least and greatest acceleration, steepest slope, sum of all jumps.

    Rounding included. NaN when the window spans too many pieces. ``A`` is scratch space.
    """
    pieces = shaking.coefficients.shape[0]
    low, high, steepest, leap = np.inf, -np.inf, 0.0, 0.0
    for _ in range(_LONGEST_WINDOW):
        if piece == pieces:
            return min(low, 0.0), max(high, 0.0), steepest, leap
        length = shaking.breakpoints[piece + 1] - shaking.breakpoints[piece]
        left = length - offset
        least, most, slope, rounding = piece_range(shaking.coefficients[piece], offset, min(window, left), A)
        low, high, steepest = min(low, least), max(high, most), max(steepest, slope)
        if window <= left:
            return low, high, steepest, leap
        leap += abs(motion_at(shaking, piece + 1, 0.0) - motion_at(shaking, piece, length)) + rounding
        window -= left
        piece += 1
        offset = 0.0
    return np.nan, np.nan, np.nan, np.nan


@inlined
def piece_range(coefficients: Floats, offset: float, window: float, A: Floats) -> tuple[float, float, float, float]:
    """Bounds on one piece over [offset, offset + window]: least, greatest, steepest, and their allowance for rounding.

    Exact for degree 1, else tight.
    """
    if coefficients.shape[0] == 2:
        first = coefficients[0] + coefficients[1] * offset
        last = first + coefficients[1] * window
        rounding = _ROUNDING * (abs(coefficients[0]) + max(abs(first), abs(last)))
        return min(first, last) - rounding, max(first, last) + rounding, abs(coefficients[1]), rounding
    columns = coefficients.shape[0]
    local_motion(coefficients, offset, 1.0, window, A)
    low = high = A[0]
    steepest = 0.0
    power = 1.0
    for k in range(1, columns):
        steepest += k * abs(A[k]) * power
        power *= window
        term = A[k] * power
        low += min(0.0, term)
        high += max(0.0, term)
    size, slope = sizes(coefficients, offset + window)
    rounding = _ROUNDING * columns * size
    return low - rounding, high + rounding, steepest + _ROUNDING * columns * slope, rounding


@inlined
def sizes(coefficients: Floats, t: float) -> tuple[float, float]:
    """Sizes of the terms of a polynomial and of its slope at t, added up: what their rounding is a fraction of."""
    size = slope = 0.0
    for k in range(coefficients.shape[0] - 1, -1, -1):
        slope = slope * t + size
        size = size * t + abs(coefficients[k])
    return size, slope


@shared
def prove_rest(
    shaking: Shaking, sides: Floats, nonlinear: bool, A: Floats, v: float, i: int, piece: int, offset: float
) -> tuple[float, float]:
    """Bracket on the time to rest from an impact that enters side i (0: +, 1: -) with speed v; NaN, NaN: no proof.

    ``A`` is scratch space.
    """
    j = 1 - i
    e_i, e_j = sides[i, RESTITUTION], sides[j, RESTITUTION]
    here = motion_at(shaking, piece, offset) * shaking.inverse_g
    g_i = restoring(sides, i, here)
    g_j = restoring(sides, j, here)
    if not (g_i > 0.0 and g_j > 0.0 and e_i * e_j < 1.0 and sides[i, STIFFNESS] * v * v < g_i * g_i):
        return np.nan, np.nan
    window = _WINDOW * 2.0 * v * (1.0 / g_i + e_i / g_j) / (1.0 - e_i * e_j)
    # The rounding of the times decides on which side of a jump of the motion the window ends.
    doubt = _ROUNDING * (shaking.breakpoints[piece] + offset)
    low, high, steepest, leap = motion_range(shaking, piece, offset, window + doubt, A)
    low = low * shaking.inverse_g - shaking.error
    high = high * shaking.inverse_g + shaking.error
    steepest *= shaking.inverse_g
    leap = leap * shaking.inverse_g + 2.0 * shaking.error
    first = side_bounds(sides, i, nonlinear, low, high, steepest, leap)
    second = side_bounds(sides, j, nonlinear, low, high, steepest, leap)
    lower, upper = geometric_bracket(v, first, second, e_i, e_j)
    if not upper <= window:
        return np.nan, np.nan
    return lower, upper


@inlined
def side_bounds(
    sides: Floats, j: int, nonlinear: bool, low: float, high: float, steepest: float, leap: float
) -> Bounds:
    """Bounds on side j for `arc_bounds`, rounding included, while a/g stays within [low, high]."""
    sign = 1.0 - 2.0 * j
    one = sides[j, THRESHOLD] + sign * low
    other = sides[j, THRESHOLD] + sign * high
    largest = max(abs(low), abs(high))
    slack = _ROUNDING * (sides[j, THRESHOLD] + largest)
    stiffness = sides[j, STIFFNESS]
    stiff = stiffness * (math.hypot(1.0, largest) if nonlinear else 1.0)
    m = sides[j, GAIN] * (min(one, other) - slack)
    M = sides[j, GAIN] * (max(one, other) + slack)
    grown = stiffness * (1.0 + _ROUNDING)
    return stiff * (1.0 + _ROUNDING), m, M, grown * (high - low), grown * steepest, grown * leap


@inlined
def restoring(sides: Floats, j: int, acceleration: float) -> float:
    """Side j's restoring acceleration at zero rotation, for a ground acceleration in units of g."""
    return sides[j, GAIN] * (sides[j, THRESHOLD] + (1.0 - 2.0 * j) * acceleration)


@inlined
def motion_at(shaking: Shaking, piece: int, offset: float) -> float:
    """Ground acceleration within a piece; zero after the last one."""
    coefficients = shaking.coefficients
    if piece == coefficients.shape[0]:
        return 0.0
    value = 0.0
    for k in range(coefficients.shape[1] - 1, -1, -1):
        value = value * offset + coefficients[piece, k]
    return value


@inlined
def motion_slope(shaking: Shaking, piece: int, offset: float) -> float:
    """Rate of the ground acceleration within a piece; zero after the last one."""
    coefficients = shaking.coefficients
    if piece == coefficients.shape[0]:
        return 0.0
    value = 0.0
    for k in range(coefficients.shape[1] - 1, 0, -1):
        value = value * offset + k * coefficients[piece, k]
    return value


@inlined
def time_to_rest(
    shaking: Shaking, sides: Floats, nonlinear: bool, v: float, i: int, piece: int, offset: float
) -> float:
    """Estimate of the time to rest from an impact that enters side i with speed v (`remaining_time`)."""
    j = 1 - i
    here = motion_at(shaking, piece, offset) * shaking.inverse_g
    slope = motion_slope(shaking, piece, offset) * shaking.inverse_g
    sign = 1.0 - 2.0 * i
    return remaining_time(
        v,
        restoring(sides, i, here),
        restoring(sides, j, here),
        sides[i, GAIN] * sign * slope,
        -sides[j, GAIN] * sign * slope,
        stiffness_at_rest(sides, i, nonlinear, sign * here),
        stiffness_at_rest(sides, j, nonlinear, -sign * here),
        sides[i, RESTITUTION],
        sides[j, RESTITUTION],
    )


@inlined
def rest_shift(
    shaking: Shaking, sides: Floats, v: float, dv: float, shift: float, i: int, piece: int, offset: float
) -> float:
    """Shift of the time of rest per unit of scaling of the motion, to first order in the speed.

    ``shift`` is that of the impact, ``dv`` the variation of the velocity after it at the time that it has unscaled.
    The time to rest is A v (`remaining_time`), with A and v at the impact of the scaled motion.
    """
    j = 1 - i
    e_i, e_j = sides[i, RESTITUTION], sides[j, RESTITUTION]
    here = motion_at(shaking, piece, offset) * shaking.inverse_g
    g_i, g_j = restoring(sides, i, here), restoring(sides, j, here)
    faster = dv - g_i * shift
    change = (1.0 - 2.0 * i) * (here + shift * motion_slope(shaking, piece, offset) * shaking.inverse_g)
    per_speed = 2.0 * (1.0 / g_i + e_i / g_j)
    change_of_it = -2.0 * change * (sides[i, GAIN] / g_i**2 - e_i * sides[j, GAIN] / g_j**2)
    return shift + (per_speed * faster + change_of_it * v) / (1.0 - e_i * e_j)


@inlined
def stiffness_at_rest(sides: Floats, j: int, nonlinear: bool, push: float) -> float:
    """Rate at which side j's restoring acceleration falls with rotation, at zero rotation; push = j a/g."""
    if not nonlinear:
        return sides[j, STIFFNESS]
    alpha = sides[j, SLENDERNESS]
    return sides[j, STIFFNESS] * (math.cos(alpha) - push * math.sin(alpha))
