"""From one event to the next: Taylor steps until the block meets the ground again, falls, or the piece ends."""

import math

import numpy as np

from rocking.kernels.arc import (
    converged,
    evaluate,
    expand_linear,
    expand_nonlinear,
    linear_order,
    local_motion,
    move,
)
from rocking.kernels.chatter import motion_at, motion_slope, piece_range, restoring
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.root import curvature_bound, first_root
from rocking.kernels.state import (
    AT_REST,
    COSINE,
    GAIN,
    GROUND,
    ORDER,
    SERIES,
    SINE,
    SLENDERNESS,
    STIFFNESS,
    THRESHOLD,
    Floats,
    Rules,
    Shaking,
)
from rocking.kernels.status import IMPACT, OVERTURN, STEP, UNDECIDED

QUARTER_TURN = 0.5 * math.pi

#: First step from an impact, over the arc's duration under constant acceleration.
_FIRST_STEP = 1.3

#: Largest (p t)^2 for which the terms of `short_series` are enough, and the most Newton steps of a short arc.
SHORT = 4e-3
_NEWTON_STEPS = 6

#: Accelerations closer to a threshold than this fraction of it are at the threshold.
_ROUNDING = 2.0**-48


@inlined
def step_length(sides: Floats, side: int, u: float, v: float, left: float, acceleration: float) -> float:
    """Length of the next Taylor step; ``acceleration`` is the motion's, now, in units of g."""
    h = min(left, 1.0 / math.sqrt(sides[side, STIFFNESS]))
    if u == 0.0 and v > 0.0:
        g = restoring(sides, side, acceleration)
        if g > 0.0:
            h = min(h, _FIRST_STEP * 2.0 * v / g)
    return h


@shared
def expand(
    shaking: Shaking,
    sides: Floats,
    rules: Rules,
    scratch: Floats,
    side: int,
    piece: int,
    offset: float,
    u: float,
    v: float,
    left: float,
) -> tuple[int, float, int]:
    """Series of the arc from a state into scratch; returns (order, step, degree of the motion)."""
    c, A = scratch[SERIES], scratch[GROUND]
    h = step_length(sides, side, u, v, left, motion_at(shaking, piece, offset) * shaking.inverse_g)
    degree = 0
    A[0] = 0.0
    if piece < shaking.coefficients.shape[0]:
        sign = 1.0 - 2.0 * side
        degree = local_motion(shaking.coefficients[piece], offset, sign * shaking.inverse_g, h, A)
    stiffness, slenderness = sides[side, STIFFNESS], sides[side, SLENDERNESS]
    if rules.nonlinear:
        order, h = expand_nonlinear(u, v, stiffness, slenderness, A, degree, h, c, scratch[SINE], scratch[COSINE])
    elif degree <= 1:
        order = linear_order(stiffness, h)
        expand_linear(u, v, stiffness, slenderness, A, degree, order, c)
    else:
        expand_linear(u, v, stiffness, slenderness, A, degree, ORDER, c)
        order, h = converged(c, degree, h)
    return order, h, degree


@shared
def short_step(
    shaking: Shaking,
    sides: Floats,
    side: int,
    piece: int,
    offset: float,
    u: float,
    v: float,
    left: float,
    highest: float,
) -> tuple[int, float, float, float]:
    """Step of the linear model to the next impact or to the end of the piece, where it is short and simple.

    Returns (status, time, u, u'); UNDECIDED where the step is long, may hold a rotation above ``highest``, or is not
    simple enough to see its first impact at a glance. The series is that of `expand_linear`, in registers.
    """
    lam = sides[side, STIFFNESS]
    if not lam * left * left < SHORT:
        return UNDECIDED, 0.0, 0.0, 0.0
    g = restoring(sides, side, motion_at(shaking, piece, offset) * shaking.inverse_g)
    rate = sides[side, GAIN] * (1.0 - 2.0 * side) * motion_slope(shaking, piece, offset) * shaking.inverse_g
    c2, c3 = 0.5 * (lam * u - g), (lam * v - rate) * (1.0 / 6.0)
    t, status = left, STEP
    if u == 0.0:
        # u/t > v + 1.01 (min(c2, 0) t + min(c3, 0) t^2): no impact while that is positive.
        if not v + 1.01 * left * (min(c2, 0.0) + min(c3, 0.0) * left) > 0.0:
            t, status = arc_from_impact(v, c2, c3, lam, left), IMPACT
    else:
        end, _ = short_series(u, v, c2, c3, lam, left)
        # u'' has its extrema at the ends: no dip below both by more than left^2/8 of it, and one root if it is concave.
        bend = max(c2, 0.5 * (lam * end - g - rate * left))
        if not min(u, end) > 0.25 * left * left * max(bend, 0.0):
            t, status = arc_to_impact(u, v, c2, c3, lam, left) if end < 0.0 and bend < 0.0 else np.nan, IMPACT
    if not t <= left:
        return UNDECIDED, 0.0, 0.0, 0.0
    end, speed = short_series(u, v, c2, c3, lam, t)
    bend = min(c2, 0.5 * (lam * end - g - rate * t))
    if end >= highest or max(u, end) - 0.25 * t * t * min(bend, 0.0) > highest:
        return UNDECIDED, 0.0, 0.0, 0.0
    return status, t, end if status == STEP else 0.0, speed


@inlined
def arc_from_impact(v: float, c2: float, c3: float, lam: float, left: float) -> float:
    """Duration of the arc that an impact starts, where it ends before ``left`` and u/t falls all the way; else NaN.

    All even coefficients have the sign of c2, the odd ones from c3 on that of c3, and they fall so fast that the slope
    of u/t is below c2 + 2.02 max(c3, 0) t. Where that is negative, the root that Newton finds is the first.
    """
    root = c2 * c2 - 4.0 * c3 * v
    if not (c2 < 0.0 and root > 0.0):
        return np.nan
    t = 2.0 * v / (math.sqrt(root) - c2)
    if not (t < left and c2 + 2.02 * max(c3, 0.0) * t < 0.0):
        return np.nan
    for _ in range(_NEWTON_STEPS):
        x = lam * t * t
        even = c2 * (1.0 + x * (1.0 / 12.0 + x * (1.0 / 360.0 + x * (1.0 / 20160.0))))
        odd = c3 * (1.0 + x * (1.0 / 20.0 + x * (1.0 / 840.0 + x * (1.0 / 60480.0))))
        even_slope = c2 * (1.0 + x * (1.0 / 4.0 + x * (1.0 / 72.0 + x * (1.0 / 2880.0))))
        odd_slope = c3 * (2.0 + x * (1.0 / 5.0 + x * (1.0 / 140.0 + x * (1.0 / 7560.0))))
        step = (v + t * (even + t * odd)) / (even_slope + t * odd_slope)
        t -= step
        if abs(step) < 1e-8 * t:
            break
    return t if t < left else np.nan


@inlined
def arc_to_impact(u: float, v: float, c2: float, c3: float, lam: float, left: float) -> float:
    """Time to the one root of a concave arc that is above ground now and below it at ``left``; NaN if not found."""
    t = 2.0 * u / (math.sqrt(v * v - 4.0 * c2 * u) - v)
    for _ in range(_NEWTON_STEPS):
        height, speed = short_series(u, v, c2, c3, lam, t)
        step = height / speed
        t -= step
        if abs(step) < 1e-8 * t:
            return t if 0.0 < t < left else np.nan
    return np.nan


@inlined
def short_series(u: float, v: float, c2: float, c3: float, lam: float, t: float) -> tuple[float, float]:
    """Rotation and velocity after t, for c[k + 2] = lam c[k]/((k + 1)(k + 2)) from c2, c3 on and (p t)^2 <= SHORT."""
    x = lam * t * t
    even = 1.0 + x * (1.0 / 12.0 + x * (1.0 / 360.0 + x * (1.0 / 20160.0)))
    odd = 1.0 + x * (1.0 / 20.0 + x * (1.0 / 840.0 + x * (1.0 / 60480.0)))
    even_slope = 1.0 + x * (1.0 / 6.0 + x * (1.0 / 120.0 + x * (1.0 / 5040.0)))
    rotation = u + t * (v + t * (c2 * even + t * c3 * odd))
    velocity = v + t * (2.0 * c2 * even_slope + 3.0 * t * c3 * even)
    return rotation, velocity


@shared
def advance(
    u: float, v: float, order: int, h: float, c: Floats, d: Floats
) -> tuple[int, float, float, float, float, float]:
    """Follow a series to its first event within h.

    Returns (status, time, u, u', time of the highest rotation on the way, that rotation). ``d`` is scratch space.
    """
    status = STEP
    lead = 0 if u > 0.0 else (1 if v > 0.0 else 2)
    time = first_root(c, lead, order, h)
    if time == time:
        status = IMPACT
    else:
        time = h
    end, speed, _ = evaluate(c, order, time)
    if end <= 0.0:  # also without a root: one within rounding of the step's end must not be left behind
        status, end = IMPACT, 0.0
    peak_time, peak = time, end
    if turns(v, order, time, c):
        peak_time, peak = highest(order, time, c, d)
    if peak >= QUARTER_TURN:
        passage = first_passage(c, order, QUARTER_TURN, peak_time, d)
        _, speed, _ = evaluate(c, order, passage)
        return OVERTURN, passage, QUARTER_TURN, speed, passage, QUARTER_TURN
    if status == IMPACT:
        end = 0.0
    return status, time, end, speed, peak_time, peak


@inlined
def turns(v: float, order: int, h: float, c: Floats) -> bool:
    """Whether a series may be higher within (0, h) than at both ends."""
    if v > 0.0:
        return v < curvature_bound(c, 0, order, h) * h
    rise = v
    power = h
    for k in range(2, order + 1):
        rise += max(0.0, c[k]) * power
        power *= h
    return rise > 0.0


@shared
def highest(order: int, h: float, c: Floats, d: Floats) -> tuple[float, float]:
    """Time and value of a series' maximum on (0, h], from one turning point to the next. ``d`` is scratch space."""
    best_time = h
    best, _, _ = evaluate(c, order, h)
    for k in range(order):
        d[k] = (k + 1) * c[k + 1]
    t = 0.0
    rising = True
    for _ in range(order):
        lead = 0
        while lead < order - 1 and d[lead] == 0.0:
            lead += 1
        if d[lead] < 0.0:
            rising = not rising
            for k in range(order):
                d[k] = -d[k]
        turn = first_root(d, lead, order - 1, h - t)
        if not turn > 0.0:
            break
        t += turn
        value, _, _ = evaluate(c, order, t)
        if rising and value > best:
            best_time, best = t, value
        move(d, order - 1, turn)
        d[0] = 0.0
    return best_time, best


@inlined
def first_passage(c: Floats, order: int, level: float, h: float, d: Floats) -> float:
    """First time in (0, h] at which a series that starts below ``level``, and is not below it at h, reaches it.

    ``d`` is scratch space.
    """
    d[0] = level - c[0]
    for k in range(1, order + 1):
        d[k] = -c[k]
    time = first_root(d, 0, order, h)
    return time if time == time else h


@shared
def next_uplift(
    shaking: Shaking, piece: int, offset: float, sides: Floats, stop: float, A: Floats, d: Floats
) -> tuple[int, float, int, bool]:
    """First instant from (piece, offset) at which the motion passes a side's threshold.

    Returns (piece, offset, side, whether it passes by a jump); side AT_REST when it never does before ``stop``.
    ``A`` and ``d`` are scratch space.
    """
    plus, minus = sides[0, THRESHOLD], sides[1, THRESHOLD]
    while piece < shaking.coefficients.shape[0] and shaking.breakpoints[piece] + offset < stop:
        coefficients = shaking.coefficients[piece]
        length = shaking.breakpoints[piece + 1] - shaking.breakpoints[piece]
        left = length - offset
        low, high, _, _ = piece_range(coefficients, offset, left, A)
        if high * shaking.inverse_g > minus or -low * shaking.inverse_g > plus:
            degree = local_motion(coefficients, offset, shaking.inverse_g, left, A)
            to_plus, jump_plus = first_excess(A, degree, left, plus, -1.0, d)
            to_minus, jump_minus = first_excess(A, degree, left, minus, 1.0, d)
            # A passing that rounding puts at the end of the piece is left to the next one, which may turn back.
            if to_plus < to_minus and offset + to_plus < length:
                return piece, offset + to_plus, 0, jump_plus
            if to_minus < to_plus and offset + to_minus < length:
                return piece, offset + to_minus, 1, jump_minus
        piece += 1
        offset = 0.0
    return piece, offset, AT_REST, False


@shared
def first_excess(A: Floats, degree: int, h: float, threshold: float, sign: float, d: Floats) -> tuple[float, bool]:
    """First time in [0, h) from which sign * A(t) > threshold, and whether it is so by a jump; inf when never.

    ``d`` is scratch space.
    """
    gap = threshold - sign * A[0]
    if gap < -_ROUNDING * threshold:
        return 0.0, True
    if degree <= 1:
        rate = sign * A[1] if degree == 1 else 0.0
        if rate > 0.0 and gap < rate * h - _ROUNDING * threshold:
            return max(0.0, gap) / rate, False
        return np.inf, False
    d[0] = gap
    for k in range(1, degree + 1):
        d[k] = -sign * A[k]
    return first_passing(d, degree, h), False


@shared
def first_passing(d: Floats, degree: int, h: float) -> float:
    """First time in [0, h) from which a polynomial, not negative before, is negative beyond rounding; inf when never.

    From a root that is but a touch the search goes on with what is left once the root is divided out. Changes ``d``.
    """
    rounding = 0.0
    for k in range(degree, -1, -1):
        rounding = rounding * h + _ROUNDING * abs(d[k])
    start = 0.0
    for _ in range(degree + 1):
        lead = 0
        power = 1.0
        while lead <= degree and abs(d[lead]) * power <= rounding:
            lead += 1
            power *= h - start
        if lead > degree:
            return np.inf
        if d[lead] < 0.0:
            return start
        time = first_root(d, lead, degree, h - start)
        if not start + time < h:
            return np.inf
        move(d, degree, time)
        start += time
        if d[1] < 0.0 and d[1] * d[1] <= 2.0 * d[2] * rounding:  # a dip below zero that is lost in rounding
            across = -2.0 * d[1] / d[2]
            move(d, degree, across)
            start += across
        d[0] = 0.0
    return np.inf
