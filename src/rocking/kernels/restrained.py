"""Arcs of bodies that are held back: by tendons, springs, thrusts, loads and dampers.

With the weight W + W' and the push A + A' in place of W and A, since what a thrust or an elastic tendon adds is of the
form of sin and cos(alpha - u), the equations are

    linear      u'' = (lam (W + W') - s) u - gain (threshold (W + W') + A + A') - H - c u'
    nonlinear   u'' = -lam ((W + W') sin(alpha - u) + (A + A') cos(alpha - u)) - H cos(u/2) - s u - c u'

with H for the prestress of tendons, s for springs, c for dampers: see "Restraints" in the documentation.
"""

import math

import numpy as np

from rocking.core.arrays import Floats
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.series import (
    INTEGRATED_TWICE,
    NEGLIGIBLE,
    SHORTENINGS,
    SMALLEST,
    TRUNCATION,
    angle_coefficients,
    nonlinear_coefficient,
    shortening,
)
from rocking.kernels.state import ORDER, Record


@inlined
def restrained_step(block: Record, side: int) -> float:
    """Longest step: the inverse of the greatest rate at which the restraints let the body move or slow down."""
    stiffness = abs(block.stiffness[side]) * (1.0 + abs(block.added_weight[side])) + abs(block.spring[side])
    fastest = max(math.sqrt(stiffness), block.damping[side])
    return 1.0 / fastest if fastest > 0.0 else np.inf


@shared
def expand_restrained(
    block: Record, settings: Record, state: Record, scratch: Record, degrees: tuple[int, int], h: float
) -> tuple[int, float]:
    """Series of an arc for a motion and a weight of these degrees, to which the restraints' parts are added.

    Returns (order, h'). The series ends where a bound shows that its truncation is negligible.
    """
    c, side, degree = scratch.rotation, state.side, max(degrees[0], degrees[1])
    scratch.weight[0] += block.added_weight[side]
    scratch.ground[0] += block.added_push[side]
    c[0] = state.u
    c[1] = state.v
    if settings.nonlinear:
        psi = block.slenderness[side] - state.u
        scratch.sine[0], scratch.cosine[0] = math.sin(psi), math.cos(psi)
        scratch.half_sine[0], scratch.half_cosine[0] = math.sin(0.5 * state.u), math.cos(0.5 * state.u)
    power = h * h
    largest = term = abs(state.v) * h
    for k in range(ORDER - 1):
        value = restrained_force(block, side, scratch, degrees, settings.nonlinear, k)
        c[k + 2] = (value - block.damping[side] * ((k + 1) * c[k + 1])) * INTEGRATED_TWICE[k]
        previous = term
        term = (k + 2) * abs(c[k + 2]) * power
        largest = max(largest, term)
        if k > degree and term + previous <= NEGLIGIBLE * largest:
            beyond, _ = truncation_restrained(block, settings, side, scratch, degrees, k + 2, h)
            if beyond <= TRUNCATION * largest:
                return k + 2, h
        if settings.nonlinear:
            angle_coefficients(scratch, k)
            half_angle_coefficients(scratch, k)
        power *= h
    for _ in range(SHORTENINGS):
        beyond, largest = truncation_restrained(block, settings, side, scratch, degrees, ORDER, h)
        excess = beyond / max(TRUNCATION * largest, SMALLEST)
        if excess <= 1.0:
            break
        h *= shortening(excess)
    return ORDER, h


@inlined
def restrained_force(
    block: Record, side: int, scratch: Record, degrees: tuple[int, int], nonlinear: bool, k: int
) -> float:
    """Coefficient k of u'' + c u', from the coefficients of the rotation up to k."""
    c, A, W = scratch.rotation, scratch.ground, scratch.weight
    lam = block.stiffness[side]
    value = -block.spring[side] * c[k]
    if nonlinear:
        value += nonlinear_coefficient(lam, scratch, degrees, k) / INTEGRATED_TWICE[k]
        return value - block.prestress[side] * scratch.half_cosine[k]
    if k <= degrees[0]:
        value -= block.threshold_slope[side] * A[k]
    if k <= degrees[1]:
        value -= block.threshold_slope[side] * (block.threshold[side] * W[k])
    if k == 0:
        value -= block.prestress[side]
    for j in range(min(k, degrees[1]) + 1):
        value += lam * W[j] * c[k - j]
    return value


@inlined
def half_angle_coefficients(scratch: Record, k: int) -> None:
    """Write the coefficients k + 1 of sin and cos(u/2), from those before and c[1] to c[k + 1]."""
    c, S, C = scratch.rotation, scratch.half_sine, scratch.half_cosine
    sine = 0.0
    cosine = 0.0
    for j in range(k + 1):
        rate = 0.5 * (j + 1) * c[j + 1]
        sine += rate * C[k - j]
        cosine -= rate * S[k - j]
    S[k + 1] = sine / (k + 1)
    C[k + 1] = cosine / (k + 1)


@shared
def truncation_restrained(
    block: Record, settings: Record, side: int, scratch: Record, degrees: tuple[int, int], order: int, h: float
) -> tuple[float, float]:
    """Bound on the truncation of an arc's velocity over h, and its largest term; both times h.

    inf: h is too long for a bound. U and V being the sums of all terms of rotation and velocity that are left out,

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
