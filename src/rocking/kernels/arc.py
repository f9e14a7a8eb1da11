"""Taylor series of one arc between two events (paper, Eq. 15): order, step length and truncation.

The equations and recurrences are in `series`. A NaN among the numbers makes series and bounds NaN.
"""

import math

import numpy as np

from rocking.core.arrays import Floats
from rocking.kernels.compiled import inlined, not_inlined
from rocking.kernels.ground import Ground, compute_acceleration, has_vertical, select_vertical, write_local_series
from rocking.kernels.series import (
    INTEGRATED_TWICE,
    compute_next_coefficient,
    write_angle_coefficients,
    write_half_angle_coefficients,
    write_linear_coefficients,
)
from rocking.kernels.state import ORDER, Struct

#: First step after an impact, divided by the arc's duration under constant acceleration.
_FIRST_STEP = 1.3


@inlined
def side_sign(side: int) -> float:
    """Return the sign of the rotation on a side."""
    return 1.0 - 2.0 * side


@inlined
def compute_restoring(ground: Ground, block: Struct, side: int, piece: int, offset: float) -> float:
    """Compute the restoring acceleration of a side at zero rotation."""
    threshold = block.threshold[side] * compute_weight(ground, piece, offset) + block.restraint_threshold[side]
    return block.restoring_gain[side] * (threshold + side_sign(side) * compute_acceleration(ground, piece, offset))


@inlined
def compute_weight(ground: Ground, piece: int, offset: float) -> float:
    """Compute the weight in the ground's frame, divided by the weight at rest."""
    return 1.0 + compute_acceleration(select_vertical(ground), piece, offset) if has_vertical(ground) else 1.0


@inlined
def write_weight_series(ground: Ground, piece: int, offset: float, W: Floats) -> int:
    """Write the polynomial of the weight about ``offset`` into W and return its degree."""
    W[0] = 0.0
    degree = write_local_series(select_vertical(ground), piece, offset, 1.0, W) if has_vertical(ground) else 0
    W[0] += 1.0
    return degree


@not_inlined
def expand_arc(
    ground: Ground, block: Struct, settings: Struct, scratch: Struct, state: Struct, h_max: float
) -> tuple[int, float, int]:
    """Write the series of the arc from a state into scratch; return (order, step, degree of both components).

    The step is at most ``h_max``.
    """
    h = find_step_length(ground, block, state, h_max)
    degree = write_local_series(ground, state.piece, state.offset, side_sign(state.side), scratch.ground)
    degree = find_significant_degree(scratch.ground, degree, h)
    weight_degree = write_weight_series(ground, state.piece, state.offset, scratch.weight)
    if has_vertical(ground):
        degree = pad_to_same_degree(scratch.ground, degree, scratch.weight, weight_degree)
    if block.restrained or settings.nonlinear or has_vertical(ground):
        order, h = expand_with_bound(block, settings, state, scratch, (degree, weight_degree), h)
        return order, h, degree
    if degree <= 1:
        order = find_linear_order(block.stiffness[state.side], h)
        write_linear_coefficients(block, state, scratch, degree, order)
        return order, h, degree
    write_linear_coefficients(block, state, scratch, degree, ORDER)
    order = find_converged_order(scratch.rotation, degree, h)
    if order > ORDER:
        return ORDER, shorten_step(block, settings, state.side, scratch, (degree, 0), h), degree
    return order, h, degree


@inlined
def pad_to_same_degree(A: Floats, degree: int, W: Floats, weight_degree: int) -> int:
    """Return the larger degree of two polynomials, and pad both with zeros to this degree."""
    max_degree = max(degree, weight_degree)
    for k in range(degree + 1, max_degree + 1):
        A[k] = 0.0
    for k in range(weight_degree + 1, max_degree + 1):
        W[k] = 0.0
    return max_degree


@inlined
def find_step_length(ground: Ground, block: Struct, state: Struct, h_max: float) -> float:
    """Compute the length of the next Taylor step."""
    h = min(h_max, 1.0 / np.sqrt(abs(block.stiffness[state.side])))
    if block.restrained:
        h = min(h, limit_restrained_step(block, state.side))
    if state.u == 0.0 and state.v > 0.0:
        g = compute_restoring(ground, block, state.side, state.piece, state.offset)
        if g > 0.0:
            h = min(h, _FIRST_STEP * 2.0 * state.v / g)
    return h


@inlined
def limit_restrained_step(block: Struct, side: int) -> float:
    """Return the longest step: the inverse of the largest rate of motion or damping under restraints."""
    stiffness = abs(block.stiffness[side]) * (1.0 + abs(block.added_weight[side])) + abs(block.spring[side])
    max_rate = max(math.sqrt(stiffness), block.damping[side])
    return 1.0 / max_rate if max_rate > 0.0 else np.inf


@inlined
def find_significant_degree(A: Floats, degree: int, h: float) -> int:
    """Return the degree of a polynomial without negligible highest powers within h."""
    while degree > 1 and abs(A[degree]) * h**degree < NEGLIGIBLE * abs(A[0]):
        degree -= 1
    return degree


@inlined
def find_linear_order(lam: float, h: float) -> int:
    """Return the order at which the series of a linear arc has converged within h (motion of degree 0 or 1).

    The ratio of c[k] h^k to c[2] h^2, which decreases most slowly, is known in advance, because each later coefficient
    follows from the one two before.
    """
    squared_step = abs(lam) * h * h
    ratio = 1.0
    for k in range(2, ORDER - 2, 2):
        ratio *= squared_step * INTEGRATED_TWICE[k]
        if ratio <= NEGLIGIBLE:
            return k + 1
    return ORDER


@inlined
def find_converged_order(c: Floats, degree: int, h: float) -> int:
    """Return the order at which a full series under constant weight has converged within h, or more than `ORDER`.

    Beyond the motion's degree, each coefficient follows from the one two before: two negligible ones end the series.
    """
    largest = term = abs(c[1]) * h
    power = h * h
    for k in range(2, ORDER + 1):
        previous = term
        term = k * abs(c[k]) * power
        largest = max(largest, term)
        if k > degree + 3 and term + previous <= NEGLIGIBLE * largest:
            return k
        power *= h
    return ORDER + 1


@not_inlined
def expand_with_bound(
    block: Struct, settings: Struct, state: Struct, scratch: Struct, degrees: tuple[int, int], h: float
) -> tuple[int, float]:
    """Compute the series of an arc and of its sines and cosines, for the degrees of motion and weight.

    Returns (order, h'). The series ends as soon as a bound on its truncation is negligible.
    """
    c, side = scratch.rotation, state.side
    if block.restrained:
        scratch.weight[0] += block.added_weight[side]
        scratch.ground[0] += block.added_push[side]
    c[0] = state.u
    c[1] = state.v
    if settings.nonlinear:
        psi = block.slenderness[side] - state.u
        scratch.sine[0], scratch.cosine[0] = math.sin(psi), math.cos(psi)
        if block.restrained:
            scratch.half_sine[0], scratch.half_cosine[0] = math.sin(0.5 * state.u), math.cos(0.5 * state.u)
    power = h * h
    largest = term = abs(state.v) * h
    for k in range(ORDER - 1):
        c[k + 2] = compute_next_coefficient(block, settings, side, scratch, degrees, k)
        previous = term
        term = (k + 2) * abs(c[k + 2]) * power
        largest = max(largest, term)
        if k > degrees[0] and term + previous <= NEGLIGIBLE * largest:
            truncated, _ = bound_truncation(block, settings, side, scratch, degrees, k + 2, h)
            if truncated <= MAX_TRUNCATION * largest:
                return k + 2, h
        if settings.nonlinear:
            write_angle_coefficients(scratch, k)
            if block.restrained:
                write_half_angle_coefficients(scratch, k)
        power *= h
    return ORDER, shorten_step(block, settings, side, scratch, degrees, h)


# ---- Bounds on all omitted terms of an arc's velocity ----
# See "Where a series may end" in the documentation. A NaN among the numbers makes a bound NaN.

#: Terms of the velocity below this fraction of the largest term are negligible. (In a step that is short compared with
#: 1/p, terms of the rotation are negligible relative to u long before the velocity has converged.)
NEGLIGIBLE = 2.0**-56

#: Largest bound on the truncation of a velocity, divided by its largest term: a quarter of the last place.
MAX_TRUNCATION = 2.0**-54

#: Smaller terms of the velocity are negligible.
MIN_TERM = 1e-290

#: Largest number of times that a step is shortened, each time by at least a tenth.
MAX_SHORTENINGS = 200


@not_inlined
def shorten_step(
    block: Struct, settings: Struct, side: int, scratch: Struct, degrees: tuple[int, int], h: float
) -> float:
    """Return a step, at most h, within which the truncation of a full series is negligible."""
    for _ in range(MAX_SHORTENINGS):
        truncated, largest = bound_truncation(block, settings, side, scratch, degrees, ORDER, h)
        excess = truncated / max(MAX_TRUNCATION * largest, MIN_TERM)
        if excess <= 1.0:
            break
        h *= max(0.5, 0.9 * excess ** (-1.0 / ORDER))
    return h


@inlined
def bound_truncation(
    block: Struct, settings: Struct, side: int, scratch: Struct, degrees: tuple[int, int], order: int, h: float
) -> tuple[float, float]:
    """Bound the truncation of an arc's velocity within h, and return its largest term, both times h.

    The bound is inf if h is too long. The motion's degree is below order - 1.
    """
    if block.restrained:
        return bound_restrained_truncation(block, settings, side, scratch, degrees, order, h)
    if settings.nonlinear:
        return bound_nonlinear_truncation(scratch, block.stiffness[side], degrees, order, h)
    return bound_linear_truncation(scratch, block.stiffness[side], degrees[1], order, h)


@not_inlined
def bound_linear_truncation(
    scratch: Struct, lam: float, weight_degree: int, order: int, h: float
) -> tuple[float, float]:
    """Bound the truncation of a linear arc, for a weight of degree ``weight_degree``.

    With u_k = |c_k| h^k and w_j = |W_j| h^j, u'' h^2 omits the products w_j u_k with j + k >= order - 1 and all terms
    that follow from them.
    """
    c, W, d = scratch.rotation, scratch.weight, scratch.auxiliary
    power = 1.0
    largest = 0.0
    for k in range(order + 1):
        d[k] = abs(c[k]) * power
        largest = max(largest, k * d[k])
        power *= h
    for k in range(order - 1, order - 2 - weight_degree, -1):  # sums of all later terms
        d[k] += d[k + 1]
    weight = products = 0.0
    power = 1.0
    for j in range(weight_degree + 1):
        weight += abs(W[j]) * power
        products += abs(W[j]) * power * d[order - 1 - j]
        power *= h
    stiffness = abs(lam) * h * h
    feedback = stiffness * weight / (order * (order + 1))
    return (stiffness * products / (order * (1.0 - feedback)) if feedback < 1.0 else np.inf), largest


@not_inlined
def bound_nonlinear_truncation(
    scratch: Struct, lam: float, degrees: tuple[int, int], order: int, h: float
) -> tuple[float, float]:
    """Bound the truncation of a nonlinear arc.

    With the terms r of the velocity, z of sin and cos(alpha - u), and b of motion and weight, z' omits the products r z
    from order - 2 on, u'' the products b z from order - 1 on, and both all terms that follow from them.
    """
    c, A, W = scratch.rotation, scratch.ground, scratch.weight
    S, C, d = scratch.sine, scratch.cosine, scratch.auxiliary
    largest = 0.0
    power = h
    for k in range(order):
        d[k] = (k + 1) * abs(c[k + 1]) * power
        largest = max(largest, d[k])
        power *= h
    for k in range(order - 2, -1, -1):  # sums of all later terms
        d[k] += d[k + 1]
    velocity = d[0]
    angle_sum, angle_products = sum_angle_terms(S, C, d, order, h)
    write_angle_tails(S, C, d, order, h)
    degree, weight_degree = degrees
    strength = push_products = 0.0
    power = 1.0
    for j in range(max(degree, weight_degree) + 1):
        push = ((abs(A[j]) if j <= degree else 0.0) + (abs(W[j]) if j <= weight_degree else 0.0)) * power
        strength += push
        if j > 0:
            push_products += push * d[max(0, order - 1 - j)]
        power *= h
    # The truncation of z is at most (angle_products + velocity z + (truncation of u') (angle_sum + z))/(order - 1),
    # with z below 1; the truncation of u' is at most stiffness (push_products + strength z)/order.
    stiffness = abs(lam) * h * h
    feedback = (velocity + stiffness * strength * (angle_sum + 1.0) / order) / (order - 1)
    if not feedback < 0.5:
        return np.inf, largest
    z = (angle_products + stiffness * push_products * (angle_sum + 1.0) / order) / ((order - 1) * (1.0 - feedback))
    return (stiffness * (push_products + strength * z) / order if z < 1.0 else np.inf), largest


@not_inlined
def bound_restrained_truncation(
    block: Struct, settings: Struct, side: int, scratch: Struct, degrees: tuple[int, int], order: int, h: float
) -> tuple[float, float]:
    """Bound the truncation of an arc of a restrained body.

    The sums U and V of all omitted terms of rotation and velocity satisfy

        order V <= (terms from known terms) + (push, weight, prestress) Z + s h^2 U + c h V,   order U <= V,

    where Z, in the linear model U, bounds the omitted terms of the sine and cosine of both angles.
    """
    c, d = scratch.rotation, scratch.auxiliary
    largest = last_term = 0.0
    power = 1.0
    for k in range(order + 1):
        d[k] = abs(c[k]) * power
        last_term = k * d[k]
        largest = max(largest, last_term)
        power *= h
    drag, spring = block.damping[side] * h, abs(block.spring[side]) * h * h
    stiffness = abs(block.stiffness[side]) * h * h
    known_terms = spring * (d[order - 1] + d[order]) + drag * last_term
    feedback = drag / order + spring / (order * (order + 1))
    if settings.nonlinear:
        prestress = abs(block.prestress[side]) * h * h
        return bound_restrained_angles(
            scratch, degrees, order, h, (stiffness, prestress, known_terms, feedback)
        ), largest
    for k in range(order - 1, order - 2 - degrees[1], -1):  # sums of all later terms
        d[k] += d[k + 1]
    weight = 0.0
    power = stiffness
    for j in range(degrees[1] + 1):
        weight += abs(scratch.weight[j]) * power
        known_terms += abs(scratch.weight[j]) * power * d[order - 1 - j]
        power *= h
    feedback += weight / (order * (order + 1))
    return (known_terms / (order * (1.0 - feedback)) if feedback < 1.0 else np.inf), largest


@inlined
def bound_restrained_angles(
    scratch: Struct, degrees: tuple[int, int], order: int, h: float, force_terms: tuple[float, float, float, float]
) -> float:
    """Bound V of `bound_restrained_truncation` in the nonlinear model from terms of the rotation in ``auxiliary``.

    ``force_terms``: stiffness and prestress times h^2, contribution of known terms, and feedback of V.
    """
    A, W, d = scratch.ground, scratch.weight, scratch.auxiliary
    stiffness, prestress, known_terms, feedback = force_terms
    if not feedback < 0.5:
        return np.inf
    for k in range(1, order + 1):
        d[k - 1] = k * d[k]
    for k in range(order - 2, -1, -1):  # sums of all later terms
        d[k] += d[k + 1]
    velocity = d[0]
    angle_sum, products = sum_angle_terms(scratch.sine, scratch.cosine, d, order, h)
    if prestress > 0.0:
        half_sum, half_products = sum_angle_terms(scratch.half_sine, scratch.half_cosine, d, order, h)
        angle_sum += half_sum
        products += half_products
    write_angle_tails(scratch.sine, scratch.cosine, d, order, h)
    strength, power = prestress, stiffness
    for j in range(max(degrees[0], degrees[1]) + 1):
        push = ((abs(A[j]) if j <= degrees[0] else 0.0) + (abs(W[j]) if j <= degrees[1] else 0.0)) * power
        strength += push
        if j > 0:
            known_terms += push * d[max(0, order - 1 - j)]
        power *= h
    per_order = 1.0 / (order * (1.0 - feedback))
    angle_feedback = (velocity + strength * (angle_sum + 1.0) * per_order) / (order - 1)
    if not angle_feedback < 0.5:
        return np.inf
    z = (products + known_terms * (angle_sum + 1.0) * per_order) / ((order - 1) * (1.0 - angle_feedback))
    return (known_terms + strength * z) * per_order if z < 1.0 else np.inf


@inlined
def sum_angle_terms(S: Floats, C: Floats, tails: Floats, order: int, h: float) -> tuple[float, float]:
    """Sum the terms of an angle's sine and cosine up to ``order`` - 2, and the products omitted from their rates.

    ``tails[k]`` is the sum of the velocity's terms from k on. The first terms form a unit vector.
    """
    total, products = 1.0, tails[order - 2]
    power = h
    for k in range(1, order - 1):
        term = (abs(S[k]) + abs(C[k])) * power
        total += term
        products += term * tails[order - 2 - k]
        power *= h
    return total, products


@inlined
def write_angle_tails(S: Floats, C: Floats, d: Floats, order: int, h: float) -> None:
    """Write the sums of the terms of sine and cosine from each index on into d."""
    d[0] = 1.0
    power = h
    for k in range(1, order - 1):
        d[k] = (abs(S[k]) + abs(C[k])) * power
        power *= h
    for k in range(order - 3, -1, -1):
        d[k] += d[k + 1]


@inlined
def evaluate_series(c: Floats, order: int, t: float) -> tuple[float, float, float]:
    """Evaluate rotation, velocity and acceleration (u, u', u'') of a series at time t after its centre."""
    u = c[order]
    v = 0.0
    w = 0.0
    for k in range(order - 1, -1, -1):
        w = w * t + v
        v = v * t + u
        u = u * t + c[k]
    return u, v, 2.0 * w
