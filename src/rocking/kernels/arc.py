"""One arc between two events as a Taylor series (paper, Eq. 15): its order, the length of a step, its truncation.

The equations and the recurrences for the coefficients are in `series`. A NaN among the numbers makes series and
bounds NaN.
"""

import math

import numpy as np

from rocking.core.arrays import Floats
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.ground import Ground, acceleration, has_vertical, local_series, vertical_of
from rocking.kernels.series import (
    INTEGRATED_TWICE,
    angle_coefficients,
    half_angle_coefficients,
    linear_coefficients,
    next_coefficient,
)
from rocking.kernels.state import ORDER, Record

#: First step from an impact, over the arc's duration under constant acceleration.
_FIRST_STEP = 1.3


@inlined
def sign_of(side: int) -> float:
    """Sign of the rotation on a side."""
    return 1.0 - 2.0 * side


@inlined
def restoring(ground: Ground, block: Record, side: int, piece: int, offset: float) -> float:
    """Restoring acceleration of a side at zero rotation."""
    standing = block.threshold[side] * weight_at(ground, piece, offset) + block.restraint_threshold[side]
    return block.threshold_slope[side] * (standing + sign_of(side) * acceleration(ground, piece, offset))


@inlined
def weight_at(ground: Ground, piece: int, offset: float) -> float:
    """Weight in the ground's frame, over that at rest: 1 + a_v/g."""
    return 1.0 + acceleration(vertical_of(ground), piece, offset) if has_vertical(ground) else 1.0


@inlined
def weight_series(ground: Ground, piece: int, offset: float, W: Floats) -> int:
    """Put the polynomial of the weight about ``offset`` into W; returns its degree."""
    W[0] = 0.0
    degree = local_series(vertical_of(ground), piece, offset, 1.0, W) if has_vertical(ground) else 0
    W[0] += 1.0
    return degree


@shared
def expand(
    ground: Ground, block: Record, settings: Record, scratch: Record, state: Record, left: float
) -> tuple[int, float, int]:
    """Series of the arc from a state into scratch, for a time of at most ``left``; returns (order, step, degree).

    The degree is that of both components of the motion.
    """
    h = step_length(ground, block, state, left)
    degree = local_series(ground, state.piece, state.offset, sign_of(state.side), scratch.ground)
    degree = significant_degree(scratch.ground, degree, h)
    changes = weight_series(ground, state.piece, state.offset, scratch.weight)
    if has_vertical(ground):
        degree = raise_degree(scratch.ground, degree, scratch.weight, changes)
    if block.restrained or settings.nonlinear or has_vertical(ground):
        order, h = expand_checked(block, settings, state, scratch, (degree, changes), h)
        return order, h, degree
    if degree <= 1:
        order = linear_order(block.stiffness[state.side], h)
        linear_coefficients(block, state, scratch, degree, order)
        return order, h, degree
    linear_coefficients(block, state, scratch, degree, ORDER)
    order = converged(scratch.rotation, degree, h)
    if order > ORDER:
        return ORDER, shortened(block, settings, state.side, scratch, (degree, 0), h), degree
    return order, h, degree


@inlined
def raise_degree(A: Floats, degree: int, W: Floats, other: int) -> int:
    """Larger degree of two polynomials; both are filled up with zeros to it."""
    highest = max(degree, other)
    for k in range(degree + 1, highest + 1):
        A[k] = 0.0
    for k in range(other + 1, highest + 1):
        W[k] = 0.0
    return highest


@inlined
def step_length(ground: Ground, block: Record, state: Record, left: float) -> float:
    """Length of the next Taylor step."""
    h = min(left, 1.0 / np.sqrt(abs(block.stiffness[state.side])))
    if block.restrained:
        h = min(h, restrained_step(block, state.side))
    if state.u == 0.0 and state.v > 0.0:
        g = restoring(ground, block, state.side, state.piece, state.offset)
        if g > 0.0:
            h = min(h, _FIRST_STEP * 2.0 * state.v / g)
    return h


@inlined
def restrained_step(block: Record, side: int) -> float:
    """Longest step: the inverse of the greatest rate at which the restraints let the body move or slow down."""
    stiffness = abs(block.stiffness[side]) * (1.0 + abs(block.added_weight[side])) + abs(block.spring[side])
    fastest = max(math.sqrt(stiffness), block.damping[side])
    return 1.0 / fastest if fastest > 0.0 else np.inf


@inlined
def significant_degree(A: Floats, degree: int, h: float) -> int:
    """Degree of a polynomial without the highest powers that are negligible within h."""
    while degree > 1 and abs(A[degree]) * h**degree < NEGLIGIBLE * abs(A[0]):
        degree -= 1
    return degree


@inlined
def linear_order(lam: float, h: float) -> int:
    """Order at which a linear arc's series has converged over h, for a motion of degree 0 or 1.

    Every coefficient after the motion's own follows from the one two before, so the ratio of c[k] h^k to c[2] h^2,
    which falls the most slowly, is known beforehand.
    """
    squared = abs(lam) * h * h
    ratio = 1.0
    for k in range(2, ORDER - 2, 2):
        ratio *= squared * INTEGRATED_TWICE[k]
        if ratio <= NEGLIGIBLE:
            return k + 1
    return ORDER


@inlined
def converged(c: Floats, degree: int, h: float) -> int:
    """Order at which a full series under a constant weight has converged over h; above `ORDER` where it has not.

    Past the motion's degree a coefficient follows from the one two before: two negligible ones end the series.
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


@shared
def expand_checked(
    block: Record, settings: Record, state: Record, scratch: Record, degrees: tuple[int, int], h: float
) -> tuple[int, float]:
    """Series of an arc, and of the sines and cosines in it, for a motion and a weight of these degrees.

    Returns (order, h'). The series ends where a bound shows that its truncation is negligible.
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
        c[k + 2] = next_coefficient(block, settings, side, scratch, degrees, k)
        previous = term
        term = (k + 2) * abs(c[k + 2]) * power
        largest = max(largest, term)
        if k > degrees[0] and term + previous <= NEGLIGIBLE * largest:
            beyond, _ = truncation(block, settings, side, scratch, degrees, k + 2, h)
            if beyond <= TRUNCATION * largest:
                return k + 2, h
        if settings.nonlinear:
            angle_coefficients(scratch, k)
            if block.restrained:
                half_angle_coefficients(scratch, k)
        power *= h
    return ORDER, shortened(block, settings, side, scratch, degrees, h)


# ---- Where a series may end: bounds on all terms of an arc's velocity that are left out ----
# The derivations are in the documentation ("Where a series may end"). A NaN among the numbers makes a bound NaN.

#: Terms of the velocity below this fraction of the largest one are negligible. (Those of the rotation are no measure:
#: over a step that is short beside 1/p they are negligible beside u long before the velocity has converged.)
NEGLIGIBLE = 2.0**-56

#: Largest bound on the truncation of a velocity, over its largest term: a quarter of the last place.
TRUNCATION = 2.0**-54

#: Smaller terms of the velocity are negligible.
SMALLEST = 1e-290

#: Largest number of times that a step is shortened; each time by a tenth at least.
SHORTENINGS = 200


@shared
def shortened(block: Record, settings: Record, side: int, scratch: Record, degrees: tuple[int, int], h: float) -> float:
    """Step, not longer than h, over which the truncation of a full series is negligible."""
    for _ in range(SHORTENINGS):
        beyond, largest = truncation(block, settings, side, scratch, degrees, ORDER, h)
        excess = beyond / max(TRUNCATION * largest, SMALLEST)
        if excess <= 1.0:
            break
        h *= max(0.5, 0.9 * excess ** (-1.0 / ORDER))
    return h


@inlined
def truncation(
    block: Record, settings: Record, side: int, scratch: Record, degrees: tuple[int, int], order: int, h: float
) -> tuple[float, float]:
    """Bound on the truncation of an arc's velocity over h, and its largest term; both times h.

    inf: h is too long for a bound. The motion's degree is below order - 1.
    """
    if block.restrained:
        return truncation_restrained(block, settings, side, scratch, degrees, order, h)
    if settings.nonlinear:
        return truncation_nonlinear(scratch, block.stiffness[side], degrees, order, h)
    return truncation_linear(scratch, block.stiffness[side], degrees[1], order, h)


@shared
def truncation_linear(scratch: Record, lam: float, changes: int, order: int, h: float) -> tuple[float, float]:
    """Bound the truncation of a linear arc, for a weight of degree ``changes``.

    With u_k = |c_k| h^k and w_j = |W_j| h^j the products w_j u_k with j + k >= order - 1 are left out of u'' h^2, and
    all terms that follow from them.
    """
    c, W, d = scratch.rotation, scratch.weight, scratch.other
    power = 1.0
    largest = 0.0
    for k in range(order + 1):
        d[k] = abs(c[k]) * power
        largest = max(largest, k * d[k])
        power *= h
    for k in range(order - 1, order - 2 - changes, -1):  # from here on: sums of all later terms
        d[k] += d[k + 1]
    weight = products = 0.0
    power = 1.0
    for j in range(changes + 1):
        weight += abs(W[j]) * power
        products += abs(W[j]) * power * d[order - 1 - j]
        power *= h
    stiffness = abs(lam) * h * h
    feedback = stiffness * weight / (order * (order + 1))
    return (stiffness * products / (order * (1.0 - feedback)) if feedback < 1.0 else np.inf), largest


@shared
def truncation_nonlinear(
    scratch: Record, lam: float, degrees: tuple[int, int], order: int, h: float
) -> tuple[float, float]:
    """Bound the truncation of a nonlinear arc.

    With r the velocity's terms, z those of sin and cos(alpha - u), b those of motion and weight, the products r z from
    order - 2 on are left out of z', and b z from order - 1 on of u'', and all terms that follow from them.
    """
    c, A, W = scratch.rotation, scratch.ground, scratch.weight
    S, C, d = scratch.sine, scratch.cosine, scratch.other
    largest = 0.0
    power = h
    for k in range(order):
        d[k] = (k + 1) * abs(c[k + 1]) * power
        largest = max(largest, d[k])
        power *= h
    for k in range(order - 2, -1, -1):  # from here on: sums of all later terms
        d[k] += d[k + 1]
    velocity = d[0]
    angles, angle_products = angle_terms(S, C, d, order, h)
    sums_of_terms(S, C, d, order, h)
    degree, changes = degrees
    strength = push_products = 0.0
    power = 1.0
    for j in range(max(degree, changes) + 1):
        push = ((abs(A[j]) if j <= degree else 0.0) + (abs(W[j]) if j <= changes else 0.0)) * power
        strength += push
        if j > 0:
            push_products += push * d[max(0, order - 1 - j)]
        power *= h
    # The truncation of z is at most (angle_products + velocity z + (that of u') (angles + z))/(order - 1), with z below
    # 1; that of u' at most stiffness (push_products + strength z)/order.
    stiffness = abs(lam) * h * h
    feedback = (velocity + stiffness * strength * (angles + 1.0) / order) / (order - 1)
    if not feedback < 0.5:
        return np.inf, largest
    z = (angle_products + stiffness * push_products * (angles + 1.0) / order) / ((order - 1) * (1.0 - feedback))
    return (stiffness * (push_products + strength * z) / order if z < 1.0 else np.inf), largest


@shared
def truncation_restrained(
    block: Record, settings: Record, side: int, scratch: Record, degrees: tuple[int, int], order: int, h: float
) -> tuple[float, float]:
    """Bound the truncation of an arc of a body that is held back.

    U and V being the sums of all terms of rotation and velocity that are left out,

        order V <= (what follows from known terms) + (push, weight, prestress) Z + s h^2 U + c h V,   order U <= V,

    where Z bounds what is left out of sin and cos of both angles; in the linear model Z is U.
    """
    c, d = scratch.rotation, scratch.other
    largest = last = 0.0
    power = 1.0
    for k in range(order + 1):
        d[k] = abs(c[k]) * power
        last = k * d[k]
        largest = max(largest, last)
        power *= h
    drag, spring = block.damping[side] * h, abs(block.spring[side]) * h * h
    stiffness = abs(block.stiffness[side]) * h * h
    known = spring * (d[order - 1] + d[order]) + drag * last
    feedback = drag / order + spring / (order * (order + 1))
    if settings.nonlinear:
        prestress = abs(block.prestress[side]) * h * h
        return beyond_angles(scratch, degrees, order, h, (stiffness, prestress, known, feedback)), largest
    for k in range(order - 1, order - 2 - degrees[1], -1):  # from here on: sums of all later terms
        d[k] += d[k + 1]
    weight = 0.0
    power = stiffness
    for j in range(degrees[1] + 1):
        weight += abs(scratch.weight[j]) * power
        known += abs(scratch.weight[j]) * power * d[order - 1 - j]
        power *= h
    feedback += weight / (order * (order + 1))
    return (known / (order * (1.0 - feedback)) if feedback < 1.0 else np.inf), largest


@inlined
def beyond_angles(
    scratch: Record, degrees: tuple[int, int], order: int, h: float, forces: tuple[float, float, float, float]
) -> float:
    """Bound V of `truncation_restrained` in the nonlinear model; scratch.other has the terms of the rotation.

    ``forces``: stiffness and prestress times h^2, what follows from known terms, and what V adds to itself.
    """
    A, W, d = scratch.ground, scratch.weight, scratch.other
    power, strength, known, feedback = forces
    if not feedback < 0.5:
        return np.inf
    for k in range(1, order + 1):
        d[k - 1] = k * d[k]
    for k in range(order - 2, -1, -1):  # from here on: sums of all later terms
        d[k] += d[k + 1]
    velocity = d[0]
    total, products = angle_terms(scratch.sine, scratch.cosine, d, order, h)
    if strength > 0.0:
        of_half, products_of_half = angle_terms(scratch.half_sine, scratch.half_cosine, d, order, h)
        total += of_half
        products += products_of_half
    sums_of_terms(scratch.sine, scratch.cosine, d, order, h)
    for j in range(max(degrees[0], degrees[1]) + 1):
        push = ((abs(A[j]) if j <= degrees[0] else 0.0) + (abs(W[j]) if j <= degrees[1] else 0.0)) * power
        strength += push
        if j > 0:
            known += push * d[max(0, order - 1 - j)]
        power *= h
    per_order = 1.0 / (order * (1.0 - feedback))
    returned = (velocity + strength * (total + 1.0) * per_order) / (order - 1)
    if not returned < 0.5:
        return np.inf
    z = (products + known * (total + 1.0) * per_order) / ((order - 1) * (1.0 - returned))
    return (known + strength * z) * per_order if z < 1.0 else np.inf


@inlined
def angle_terms(S: Floats, C: Floats, later: Floats, order: int, h: float) -> tuple[float, float]:
    """Sum of the terms of an angle's sine and cosine up to ``order`` - 2; and of the products left out of their rates.

    ``later[k]`` is the sum of the velocity's terms from k on. The first terms are those of a unit vector.
    """
    total, products = 1.0, later[order - 2]
    power = h
    for k in range(1, order - 1):
        term = (abs(S[k]) + abs(C[k])) * power
        total += term
        products += term * later[order - 2 - k]
        power *= h
    return total, products


@inlined
def sums_of_terms(S: Floats, C: Floats, d: Floats, order: int, h: float) -> None:
    """Write the sums of the terms of sine and cosine, from each on, into d."""
    d[0] = 1.0
    power = h
    for k in range(1, order - 1):
        d[k] = (abs(S[k]) + abs(C[k])) * power
        power *= h
    for k in range(order - 3, -1, -1):
        d[k] += d[k + 1]


@inlined
def evaluate(c: Floats, order: int, t: float) -> tuple[float, float, float]:
    """Rotation, velocity and acceleration (u, u', u'') of a series at time t after its centre."""
    u = c[order]
    v = 0.0
    w = 0.0
    for k in range(order - 1, -1, -1):
        w = w * t + v
        v = v * t + u
        u = u * t + c[k]
    return u, v, 2.0 * w
