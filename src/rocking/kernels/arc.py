"""One arc between two events as a Taylor series (paper, Eq. 15): its order, the length of a step, its truncation.

The equations and the recurrences for the coefficients are in `recurrences`. A NaN among the numbers makes series and
bounds NaN.
"""

import math

import numpy as np

from rocking.arrays import Floats
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.ground import Ground, acceleration, has_vertical, local_series, vertical_of
from rocking.kernels.recurrences import (
    INTEGRATED_TWICE,
    Line,
    Nine,
    Seven,
    angle_coefficients,
    damped_coefficient,
    linear_coefficients,
    nonlinear_coefficient,
    weighted_coefficient,
)
from rocking.kernels.state import ORDER, Record

#: Terms of the velocity below this fraction of the largest one are negligible. (Those of the rotation are no measure:
#: over a step that is short beside 1/p they are negligible beside u long before the velocity has converged.)
NEGLIGIBLE = 2.0**-56

#: Largest bound on the truncation of a velocity, over its largest term: a quarter of the last place.
_TRUNCATION = 2.0**-54

#: Nine times the largest bound on the truncation of a nonlinear velocity after nine terms, over the sum of their
#: absolute values. The bound is a few times the truncation. It holds where two sums are below a quarter.
_TRUNCATION_OF_NINE = 9.0 * 2.0**-52
_QUARTER = 0.25

#: Smaller terms of the velocity are negligible.
_SMALLEST = 1e-290

#: Largest number of times that a step is shortened; each time by a tenth at least.
_SHORTENINGS = 200

#: First step from an impact, over the arc's duration under constant acceleration.
_FIRST_STEP = 1.3


@inlined
def sign_of(side: int) -> float:
    """Sign of the rotation on a side."""
    return 1.0 - 2.0 * side


@inlined
def restoring(ground: Ground, block: Record, side: int, piece: int, offset: float) -> float:
    """Restoring acceleration of a side at zero rotation."""
    weight = weight_at(ground, piece, offset)
    return block.gain[side] * (block.threshold[side] * weight + sign_of(side) * acceleration(ground, piece, offset))


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
    ground: Ground, block: Record, rules: Record, scratch: Record, state: Record, left: float
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
    if rules.nonlinear:
        order, h = expand_nonlinear(block, state, scratch, (degree, changes), h)
        return order, h, degree
    if block.damping > 0.0:
        order, h = expand_damped(block, state, scratch, degree, h)
        return order, h, degree
    if has_vertical(ground):
        order, h = expand_linear_weighted(block, state, scratch, degree, h)
        return order, h, degree
    if degree <= 1:
        order = linear_order(block.stiffness[state.side], h)
        linear_coefficients(block, state, scratch, degree, order)
        return order, h, degree
    linear_coefficients(block, state, scratch, degree, ORDER)
    order = converged(scratch.rotation, degree, h)
    if order > ORDER:
        return ORDER, shortened_linear(scratch, block.stiffness[state.side], 0, h), degree
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
    if block.damping > 0.0:
        h = min(h, 1.0 / block.damping)
    if state.u == 0.0 and state.v > 0.0:
        g = restoring(ground, block, state.side, state.piece, state.offset)
        if g > 0.0:
            h = min(h, _FIRST_STEP * 2.0 * state.v / g)
    return h


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
def expand_linear_weighted(block: Record, state: Record, scratch: Record, degree: int, h: float) -> tuple[int, float]:
    """Series of a linear arc while the weight changes; the motion's polynomials are of one degree.

    Returns (order, h'). The series ends where a bound shows that its truncation is negligible.
    """
    c, lam = scratch.rotation, block.stiffness[state.side]
    c[0] = state.u
    c[1] = state.v
    power = h * h
    largest = term = abs(state.v) * h
    for k in range(ORDER - 1):
        c[k + 2] = weighted_coefficient(block, state.side, scratch, degree, k)
        previous = term
        term = (k + 2) * abs(c[k + 2]) * power
        largest = max(largest, term)
        power *= h
        if k > degree and term + previous <= NEGLIGIBLE * largest:
            beyond, _ = truncation_linear(scratch, lam, degree, k + 2, h)
            if beyond <= _TRUNCATION * largest:
                return k + 2, h
    return ORDER, shortened_linear(scratch, lam, degree, h)


@shared
def expand_damped(block: Record, state: Record, scratch: Record, degree: int, h: float) -> tuple[int, float]:
    """Series of a linear arc with damping, under a constant weight; returns (order, h').

    Past the motion's degree the term of power k + 2 of the velocity is at most q_k times the larger of the two before,
    q_k = (|lam| h^2/k + c h)/(k + 1), which falls. So those left out are a geometric sum, each power of q_k twice.
    """
    c, lam, drag = scratch.rotation, abs(block.stiffness[state.side]), block.damping
    c[0] = state.u
    c[1] = state.v
    for k in range(ORDER - 1):
        c[k + 2] = damped_coefficient(block, state.side, scratch, degree, k)
    for _ in range(_SHORTENINGS):
        largest = term = abs(c[1]) * h
        power = h * h
        beyond = np.inf
        for k in range(2, ORDER + 1):
            previous = term
            term = k * abs(c[k]) * power
            largest = max(largest, term)
            power *= h
            if k > degree + 2:
                ratio = (lam * h * h / (k - 1) + drag * h) / k
                beyond = 2.0 * max(term, previous) * ratio / (1.0 - ratio) if ratio < 1.0 else np.inf
                if beyond <= max(_TRUNCATION * largest, _SMALLEST):
                    return k, h
        h *= shortening(beyond / max(_TRUNCATION * largest, _SMALLEST))
    return ORDER, h


@shared
def expand_nonlinear(
    block: Record, state: Record, scratch: Record, degrees: tuple[int, int], h: float
) -> tuple[int, float]:
    """Series of a nonlinear arc, and of sin and cos(alpha - u), for a motion and a weight of these degrees.

    Returns (order, h'). The series ends where a bound shows that its truncation is negligible.
    """
    c, lam = scratch.rotation, block.stiffness[state.side]
    psi = block.slenderness[state.side] - state.u
    c[0] = state.u
    c[1] = state.v
    scratch.sine[0] = math.sin(psi)
    scratch.cosine[0] = math.cos(psi)
    power = h * h
    largest = term = abs(state.v) * h
    for k in range(ORDER - 1):
        c[k + 2] = nonlinear_coefficient(lam, scratch, degrees, k)
        previous = term
        term = (k + 2) * abs(c[k + 2]) * power
        largest = max(largest, term)
        if k > degrees[0] and term + previous <= NEGLIGIBLE * largest:
            beyond, _ = truncation_nonlinear(scratch, lam, degrees, k + 2, h)
            if beyond <= _TRUNCATION * largest:
                return k + 2, h
        angle_coefficients(scratch, k)
        power *= h
    for _ in range(_SHORTENINGS):
        beyond, largest = truncation_nonlinear(scratch, lam, degrees, ORDER, h)
        excess = beyond / max(_TRUNCATION * largest, _SMALLEST)
        if excess <= 1.0:
            break
        h *= shortening(excess)
    return ORDER, h


@shared
def shortened_linear(scratch: Record, lam: float, changes: int, h: float) -> float:
    """Step, not longer than h, over which the truncation of a full linear series is negligible.

    ``changes`` is the degree of the weight.
    """
    for _ in range(_SHORTENINGS):
        beyond, largest = truncation_linear(scratch, lam, changes, ORDER, h)
        excess = beyond / max(_TRUNCATION * largest, _SMALLEST)
        if excess <= 1.0:
            break
        h *= shortening(excess)
    return h


@inlined
def shortening(excess: float) -> float:
    """Factor on a step whose series has so many times the truncation that is allowed."""
    return max(0.5, 0.9 * excess ** (-1.0 / ORDER))


@shared
def truncation_linear(scratch: Record, lam: float, changes: int, order: int, h: float) -> tuple[float, float]:
    """Bound on the truncation of a linear arc's velocity over h, and its largest term; both times h.

    With u_k = |c_k| h^k and w_j = |W_j| h^j the products w_j u_k with j + k >= order - 1 are left out of u'' h^2, and
    all terms that follow from them: see "Where a series may end" in the documentation. The motion's degree is below
    order - 1. inf: h is too long for a bound.
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
    """Bound on the truncation of a nonlinear arc's velocity over h, and its largest term; both times h.

    With r the velocity's terms, z those of sin and cos(alpha - u), b those of motion and weight, the products r z from
    order - 2 on are left out of z', and b z from order - 1 on of u'', and all terms that follow from them. See "Where a
    series may end" in the documentation. inf: h is too long for a bound.
    """
    c, A, W = scratch.rotation, scratch.ground, scratch.weight
    S, C, d = scratch.sine, scratch.cosine, scratch.other
    last = order - 2
    largest = 0.0
    power = h
    for k in range(order):
        d[k] = (k + 1) * abs(c[k + 1]) * power
        largest = max(largest, d[k])
        power *= h
    for k in range(order - 2, -1, -1):  # from here on: sums of all later terms
        d[k] += d[k + 1]
    angle_products = d[last]
    angles = 1.0
    power = h
    for k in range(1, last + 1):
        term = (abs(S[k]) + abs(C[k])) * power
        angles += term
        angle_products += term * d[last - k]
        power *= h
    velocity = d[0]
    d[0] = 1.0
    power = h
    for k in range(1, last + 1):
        d[k] = (abs(S[k]) + abs(C[k])) * power
        power *= h
    for k in range(last - 1, -1, -1):
        d[k] += d[k + 1]
    degree, changes = degrees
    strength = push_products = 0.0
    power = 1.0
    for j in range(max(degree, changes) + 1):
        push = ((abs(A[j]) if j <= degree else 0.0) + (abs(W[j]) if j <= changes else 0.0)) * power
        strength += push
        if j > 0:
            push_products += push * d[max(0, last + 1 - j)]
        power *= h
    # The truncation of z is at most (angle_products + velocity z + (that of u') (angles + z))/(order - 1), with z below
    # 1; that of u' at most stiffness (push_products + strength z)/order.
    stiffness = abs(lam) * h * h
    feedback = (velocity + stiffness * strength * (angles + 1.0) / order) / (order - 1)
    if not feedback < 0.5:
        return np.inf, largest
    z = (angle_products + stiffness * push_products * (angles + 1.0) / order) / ((order - 1) * (1.0 - feedback))
    return (stiffness * (push_products + strength * z) / order if z < 1.0 else np.inf), largest


@inlined
def strength_of(weight: Line | None, push: Line, t: float) -> Line:
    """Return the sums of |weight| and |push| within t, and of their changes; lines are values and slopes."""
    if weight is None:
        return 1.0 + abs(push[0]) + abs(push[1]) * t, abs(push[1]) * t
    change = (abs(push[1]) + abs(weight[1])) * t
    return abs(weight[0]) + abs(push[0]) + change, change


@inlined
def truncation_is_negligible(r: Nine, z: Seven, stiffness: float, strength: Line) -> tuple[bool, float]:
    """Whether the truncation after nine terms is below 2^-52; and a bound on all terms of u'' after the first.

    `truncation_nonlinear` for a motion and a weight that are linear in time, which is counted in steps of length h;
    ``stiffness`` is lam h^2. Of a NaN it is False.
    """
    t8 = r[7] + r[8]  # sums of all later terms from here on
    t7 = r[6] + t8
    t6 = r[5] + t7
    t5 = r[4] + t6
    t4 = r[3] + t5
    t3 = r[2] + t4
    t2 = r[1] + t3
    velocity = r[0] + t2
    products = (t8 + z[0] * t7) + (z[1] * t6 + z[2] * t5) + ((z[3] * t4 + z[4] * t3) + (z[5] * t2 + z[6] * velocity))
    most, change = stiffness * strength[0], stiffness * strength[1]
    # The factors include the feedback where velocity and most are below a quarter.
    beyond = 1.01 * change * z[6] + 0.131 * (most * products)
    negligible = (beyond <= _TRUNCATION_OF_NINE * velocity) & (velocity <= _QUARTER) & (most <= _QUARTER)
    return negligible, (t3 + t3) + ((t4 + t5) + (t6 + t7) + (t8 + r[8]))


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
