"""One arc between two events as a Taylor series (paper, Eq. 15): its order, the length of a step, its truncation.

The equations and the recurrences for the coefficients are in `recurrences`. A NaN among the numbers makes series and
bounds NaN.
"""

import math

import numpy as np

from rocking.core.arrays import Floats
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.ground import Ground, acceleration, has_vertical, local_series, vertical_of
from rocking.kernels.restrained import expand_restrained, restrained_step
from rocking.kernels.series import (
    INTEGRATED_TWICE,
    NEGLIGIBLE,
    SHORTENINGS,
    SMALLEST,
    TRUNCATION,
    angle_coefficients,
    linear_coefficients,
    nonlinear_coefficient,
    shortened_linear,
    shortening,
    truncation_linear,
    truncation_nonlinear,
    weighted_coefficient,
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
    if block.restrained:
        order, h = expand_restrained(block, settings, state, scratch, (degree, changes), h)
        return order, h, degree
    if settings.nonlinear:
        order, h = expand_nonlinear(block, state, scratch, (degree, changes), h)
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
    if block.restrained:
        h = min(h, restrained_step(block, state.side))
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
            if beyond <= TRUNCATION * largest:
                return k + 2, h
    return ORDER, shortened_linear(scratch, lam, degree, h)


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
            if beyond <= TRUNCATION * largest:
                return k + 2, h
        angle_coefficients(scratch, k)
        power *= h
    for _ in range(SHORTENINGS):
        beyond, largest = truncation_nonlinear(scratch, lam, degrees, ORDER, h)
        excess = beyond / max(TRUNCATION * largest, SMALLEST)
        if excess <= 1.0:
            break
        h *= shortening(excess)
    return ORDER, h


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
