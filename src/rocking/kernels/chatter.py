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
from rocking.kernels.compiled import leaf, routine
from rocking.kernels.state import GAIN, RESTITUTION, STIFFNESS, THRESHOLD

#: Window of the proof over the first estimate of the remaining time.
_WINDOW = 1.5

#: Pieces of the motion that a window may span; longer windows wait for a slower impact.
_LONGEST_WINDOW = 256

#: Relative allowance for rounding in the bounds.
_ROUNDING = 2.0**-48


@leaf
def geometric_bracket(v, first, second, e_i, e_j):
    """Lower and upper bound on the time to rest, for bounds that hold as long as needed; NaN, NaN: no proof.

    ``first`` bounds the side that the block enters, ``second`` the other one; see `arc_bounds`.
    """
    change_i, shortest_i, longest_i = arc_bounds(v, first)
    fastest = e_i * math.sqrt(1.0 + change_i) * v
    slowest = e_i * math.sqrt(max(0.0, 1.0 - change_i)) * v
    change_j, _, longest_j = arc_bounds(fastest, second)
    _, shortest_j, _ = arc_bounds(slowest, second)
    most = fastest / v * e_j * math.sqrt(1.0 + change_j)
    least = slowest / v * e_j * math.sqrt(max(0.0, 1.0 - change_j))
    if not most < 1.0:
        return np.nan, np.nan
    return (shortest_i + shortest_j) / (1.0 - least), (longest_i + longest_j) / (1.0 - most)


@leaf
def arc_bounds(v, bounds):
    """Bounds on one arc of initial speed v: (|w^2/v^2 - 1| for its impact speed w, duration from, to); NaN: none.

    ``bounds`` = (stiff, m, M, swing, rate): the restoring acceleration at zero rotation stays within [m, M] and
    falls by at most stiff per unit of rotation; what the motion adds to it changes by at most ``swing``, and at
    most ``rate`` times a time. The durations (2/sqrt(stiff)) atan(x), atanh(x), with x = sqrt(stiff) v/M and /m, are
    replaced by the rational bounds x - x^3/3 and x + x^3/(3 (1 - x^2)), which need no transcendental function.
    """
    stiff, m, M, swing, rate = bounds
    squared = stiff * v * v / (m * m)
    if not (m > 0.0 and squared < 1.0):
        return np.nan, np.nan, np.nan
    shortest = 2.0 * v / M * (1.0 - stiff * v * v / (3.0 * M * M))
    longest = 2.0 * v / m * (1.0 + squared / (3.0 * (1.0 - squared)))
    change = 2.0 * min(swing, rate * longest) / (m * (1.0 + math.sqrt(1.0 - squared)))
    return change, shortest, longest


@leaf
def remaining_time(v, g_i, g_j, rate_i, rate_j, e_i, e_j):
    """Time to rest to second order in the speed, for restoring accelerations g_j and their rates of change.

    The first order is the paper's Eq. 75 (a geometric sum); the second lets the accelerations change linearly in
    time: T_i(v, t) = A_i v + B_i v^2 solved from T_i = (arc) + T_j(next impact).
    """
    pair = e_i * e_j
    A_i = 2.0 * (1.0 / g_i + e_i / g_j) / (1.0 - pair)
    A_j = 2.0 * (1.0 / g_j + e_j / g_i) / (1.0 - pair)
    drift_i = -2.0 * (rate_i / g_i**2 + e_i * rate_j / g_j**2) / (1.0 - pair)
    drift_j = -2.0 * (rate_j / g_j**2 + e_j * rate_i / g_i**2) / (1.0 - pair)
    own_i = -4.0 / 3.0 * rate_i / g_i**3 + e_i * (2.0 / 3.0 * A_j * rate_i / g_i**2 + 2.0 * drift_j / g_i)
    own_j = -4.0 / 3.0 * rate_j / g_j**3 + e_j * (2.0 / 3.0 * A_i * rate_j / g_j**2 + 2.0 * drift_i / g_j)
    B_i = (own_i + e_i * e_i * own_j) / (1.0 - pair * pair)
    return v * (A_i + v * B_i)


@routine
def motion_range(shaking, piece, offset, window, A):
    """Bounds over a window that starts in a piece: least and greatest acceleration, steepest slope (inf: a jump).

    NaN when the window spans too many pieces.
    """
    pieces = shaking.coefficients.shape[0]
    low, high, steepest = np.inf, -np.inf, 0.0
    end = motion_at(shaking, piece, offset)
    for _ in range(_LONGEST_WINDOW):
        start = motion_at(shaking, piece, offset)
        if abs(start - end) > _ROUNDING * max(abs(start), abs(end), abs(low), abs(high)):
            steepest = np.inf
        if piece == pieces:
            return min(low, 0.0), max(high, 0.0), steepest
        length = shaking.breakpoints[piece + 1] - shaking.breakpoints[piece]
        left = length - offset
        least, most, slope = piece_range(shaking.coefficients[piece], offset, min(window, left), A)
        low, high, steepest = min(low, least), max(high, most), max(steepest, slope)
        if window <= left:
            return low, high, steepest
        end = motion_at(shaking, piece, length)
        window -= left
        piece += 1
        offset = 0.0
    return np.nan, np.nan, np.nan


@leaf
def piece_range(coefficients, offset, window, A):
    """Bounds on one piece over [offset, offset + window]: least, greatest, steepest; exact for degree 1, else tight."""
    if coefficients.shape[0] == 2:
        first = coefficients[0] + coefficients[1] * offset
        last = first + coefficients[1] * window
        return min(first, last), max(first, last), abs(coefficients[1])
    degree = local_motion(coefficients, offset, 1.0, window, A)
    low = high = A[0]
    steepest = 0.0
    power = 1.0
    for k in range(1, degree + 1):
        steepest += k * abs(A[k]) * power
        power *= window
        term = A[k] * power
        low += min(0.0, term)
        high += max(0.0, term)
    return low, high, steepest


@routine
def prove_rest(shaking, sides, nonlinear, A, v, i, piece, offset):
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
    low, high, steepest = motion_range(shaking, piece, offset, window, A)
    low = low * shaking.inverse_g - shaking.error
    high = high * shaking.inverse_g + shaking.error
    steepest *= shaking.inverse_g
    first = side_bounds(sides, i, nonlinear, low, high, steepest)
    second = side_bounds(sides, j, nonlinear, low, high, steepest)
    lower, upper = geometric_bracket(v, first, second, e_i, e_j)
    if not upper <= window:
        return np.nan, np.nan
    return lower * (1.0 - _ROUNDING), upper * (1.0 + _ROUNDING)


@leaf
def side_bounds(sides, j, nonlinear, low, high, steepest):
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
    growth = 1.0 + _ROUNDING
    return stiff * growth, m, M, stiffness * (high - low) * growth, stiffness * steepest * growth


@leaf
def restoring(sides, j, acceleration):
    """Side j's restoring acceleration at zero rotation, for a ground acceleration in units of g."""
    return sides[j, GAIN] * (sides[j, THRESHOLD] + (1.0 - 2.0 * j) * acceleration)


@leaf
def motion_at(shaking, piece, offset):
    """Ground acceleration within a piece; zero after the last one."""
    coefficients = shaking.coefficients
    if piece == coefficients.shape[0]:
        return 0.0
    value = 0.0
    for k in range(coefficients.shape[1] - 1, -1, -1):
        value = value * offset + coefficients[piece, k]
    return value


@leaf
def motion_slope(shaking, piece, offset):
    """Rate of the ground acceleration within a piece; zero after the last one."""
    coefficients = shaking.coefficients
    if piece == coefficients.shape[0]:
        return 0.0
    value = 0.0
    for k in range(coefficients.shape[1] - 1, 0, -1):
        value = value * offset + k * coefficients[piece, k]
    return value


@leaf
def time_to_rest(shaking, sides, v, i, piece, offset):
    """Estimate of the time to rest from an impact that enters side i with speed v (`remaining_time`)."""
    j = 1 - i
    here = motion_at(shaking, piece, offset) * shaking.inverse_g
    slope = motion_slope(shaking, piece, offset) * shaking.inverse_g
    sign = 1.0 - 2.0 * i
    return remaining_time(
        v, restoring(sides, i, here), restoring(sides, j, here),
        sides[i, GAIN] * sign * slope, -sides[j, GAIN] * sign * slope, sides[i, RESTITUTION], sides[j, RESTITUTION],
    )  # fmt: skip
