"""From one event to the next: Taylor steps until the block meets the ground again, falls, or the piece ends."""

import math

import numpy as np

from rocking.kernels.arc import evaluate, expand_linear, expand_nonlinear, linear_order, local_motion
from rocking.kernels.chatter import motion_at, piece_range, restoring
from rocking.kernels.compiled import leaf, routine
from rocking.kernels.root import curvature_bound, first_passage, first_peak, first_root
from rocking.kernels.state import AT_REST, SLENDERNESS, STIFFNESS, THRESHOLD
from rocking.kernels.status import IMPACT, OVERTURN, STEP

QUARTER_TURN = 0.5 * math.pi

#: First step from an impact, over the arc's duration under constant acceleration.
_FIRST_STEP = 1.3


@leaf
def step_length(sides, side, u, v, left, acceleration):
    """Length of the next Taylor step; ``acceleration`` is the motion's, now, in units of g."""
    h = min(left, 1.0 / math.sqrt(sides[side, STIFFNESS]))
    if u == 0.0 and v > 0.0:
        g = restoring(sides, side, acceleration)
        if g > 0.0:
            h = min(h, _FIRST_STEP * 2.0 * v / g)
    return h


@routine
def expand(shaking, sides, rules, scratch, side, piece, offset, u, v, left):
    """Series of the arc from a state into scratch; returns (order, step, degree of the motion)."""
    c, A = scratch.c, scratch.A
    h = step_length(sides, side, u, v, left, motion_at(shaking, piece, offset) * shaking.inverse_g)
    degree = 0
    A[0] = 0.0
    if piece < shaking.coefficients.shape[0]:
        sign = 1.0 - 2.0 * side
        degree = local_motion(shaking.coefficients[piece], offset, sign * shaking.inverse_g, h, A)
    stiffness, slenderness = sides[side, STIFFNESS], sides[side, SLENDERNESS]
    if rules.nonlinear:
        order, h = expand_nonlinear(u, v, stiffness, slenderness, A, degree, h, c, scratch.S, scratch.C)
    else:
        order = linear_order(stiffness, degree, h)
        expand_linear(u, v, stiffness, slenderness, A, degree, order, c)
    return order, h, degree


@routine
def advance(u, v, order, h, c, d):
    """Follow a series to its first event within h.

    Returns (status, time, u, u', u'', time of the highest rotation on the way, that rotation). ``d`` is scratch.
    """
    status = STEP
    lead = 0 if u > 0.0 else (1 if v > 0.0 else 2)
    time = first_root(c, lead, order, h)
    if time == time:
        status = IMPACT
    else:
        time = h
    end, speed, acceleration = evaluate(c, order, time)
    peak_time, peak = time, end
    if v > 0.0 and v < curvature_bound(c, 0, order, time) * time:
        top = first_peak(c, order, time, d)
        if top == top:
            peak_time = top
            peak, _, _ = evaluate(c, order, top)
    if peak >= QUARTER_TURN:
        passage = first_passage(c, order, QUARTER_TURN, time, d)
        if passage == passage:
            end, speed, acceleration = evaluate(c, order, passage)
            return OVERTURN, passage, QUARTER_TURN, speed, acceleration, passage, QUARTER_TURN
    if status == IMPACT:
        end = 0.0
    return status, time, end, speed, acceleration, peak_time, peak


@routine
def next_uplift(shaking, piece, offset, sides, stop, A, d):
    """First instant from (piece, offset) at which the motion passes a side's threshold.

    Returns (piece, offset, side, whether it passes by a jump); side AT_REST when it never does before ``stop``.
    """
    plus, minus = sides[0, THRESHOLD], sides[1, THRESHOLD]
    while piece < shaking.coefficients.shape[0] and shaking.breakpoints[piece] + offset < stop:
        coefficients = shaking.coefficients[piece]
        left = shaking.breakpoints[piece + 1] - shaking.breakpoints[piece] - offset
        low, high, _ = piece_range(coefficients, offset, left, A)
        if high * shaking.inverse_g > minus or -low * shaking.inverse_g > plus:
            degree = local_motion(coefficients, offset, shaking.inverse_g, left, A)
            to_plus, jump_plus = first_excess(A, degree, left, plus, -1.0, d)
            to_minus, jump_minus = first_excess(A, degree, left, minus, 1.0, d)
            if to_plus < to_minus:
                return piece, offset + to_plus, 0, jump_plus
            if to_minus < np.inf:
                return piece, offset + to_minus, 1, jump_minus
        piece += 1
        offset = 0.0
    return piece, offset, AT_REST, False


@routine
def first_excess(A, degree, h, threshold, sign, d):
    """First time in [0, h) from which sign * A(t) > threshold, and whether it is so at once; inf when never."""
    if sign * A[0] > threshold:
        return 0.0, True
    if degree <= 1:
        gap = threshold - sign * A[0]
        rate = sign * A[1] if degree == 1 else 0.0
        if rate > 0.0 and gap < rate * h:
            return gap / rate, False
        return np.inf, False
    d[0] = threshold - sign * A[0]
    for k in range(1, degree + 1):
        d[k] = -sign * A[k]
    if d[0] == 0.0 and d[1] < 0.0:
        return 0.0, False
    time = first_root(d, 0, degree, h)
    if time == time and time < h:
        _, slope, _ = evaluate(d, degree, time)
        if slope < 0.0:
            return time, False
    return np.inf, False
