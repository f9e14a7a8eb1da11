"""Recurrences for the coefficients of an arc's Taylor series.

The rotation u >= 0 and the ground acceleration A(t) = i a(t)/g are in the frame of the block's side of sign i. A
vertical ground acceleration changes the weight to W(t) = 1 + a_v(t)/g. The equations are

    linear      u'' = W lam u - gain (W threshold + A)
    nonlinear   u'' = -lam (W sin(alpha - u) + A cos(alpha - u))

In the linear model lam is p^2 for a rocking block (as is the gain), 0 for a ball, and negative for an oscillator with a
stop. A thrust or elastic tendon contributes terms of the form of sin and cos(alpha - u), so that restraints change W
and A to W + W' and A + A':

    linear      u'' = (lam (W + W') - s) u - gain (threshold (W + W') + A + A') - H - c u'
    nonlinear   u'' = -lam ((W + W') sin(alpha - u) + (A + A') cos(alpha - u)) - H cos(u/2) - s u - c u'

with the prestress H of tendons, the stiffness s of springs and the damping c (see "Restraints" in the documentation).

Without restraints, each equation is implemented three times: to any order in arrays (`arc`), nine terms in registers
(`short_arc`), and about ten terms of many lanes (`lanes`). A single form was measured: as loops over tuples, lanes do
not vectorise and take twelve times as long; unrolled, the last bit of some results changes, because each form adds its
terms in its shortest chain of operations. One test compares all forms with a calculation in 40 digits.

A NaN among the arguments makes every later coefficient NaN.
"""

import numpy as np

from rocking.kernels.compiled import inlined
from rocking.kernels.state import ORDER, Struct

#: Value of a quantity that is linear in time, and its slope or change during a step.
ValueAndSlope = tuple[float, float]

#: Sine and cosine of an angle.
SineCosine = tuple[float, float]

#: Coefficients c[0] to c[9] of a rotation; nine terms of a velocity; seven sums of |terms| of sin and cos(alpha - u).
RotationCoefficients = tuple[float, float, float, float, float, float, float, float, float, float]
VelocityTerms = tuple[float, float, float, float, float, float, float, float, float]
AngleSums = tuple[float, float, float, float, float, float, float]

#: Factors that integrate the term of power k twice, 1/((k + 1) (k + 2)), and of power k - 1 once, 1/k.
INTEGRATED_TWICE = 1.0 / ((np.arange(ORDER + 1) + 1.0) * (np.arange(ORDER + 1) + 2.0))
_INTEGRATED = 1.0 / np.maximum(np.arange(ORDER + 2), 1)


@inlined
def apply_weight(weight: ValueAndSlope | None, current: float, previous: float) -> float:
    """Compute a coefficient of weight times series from two neighbouring ones of the series; None: weight 1."""
    return current if weight is None else weight[0] * current + weight[1] * previous


# ---- Series to any order: scratch.ground and scratch.weight contain the polynomials of motion and weight ----


@inlined
def write_linear_coefficients(block: Struct, state: Struct, scratch: Struct, degree: int, order: int) -> None:
    """Write c[0] to c[order] of a linear arc under constant weight and a motion of ``degree`` into scratch.rotation."""
    c, A, side = scratch.rotation, scratch.ground, state.side
    lam, gain = block.stiffness[side], block.restoring_gain[side]
    c[0] = state.u
    c[1] = state.v
    c[2] = 0.5 * (lam * state.u - gain * (block.threshold[side] + A[0]))
    for k in range(1, degree + 1):
        c[k + 2] = (lam * c[k] - gain * A[k]) * INTEGRATED_TWICE[k]
    for k in range(degree + 1, order - 1):
        c[k + 2] = lam * c[k] * INTEGRATED_TWICE[k]


@inlined
def compute_weighted_coefficient(block: Struct, side: int, scratch: Struct, degree: int, k: int) -> float:
    """Compute c[k + 2] of a linear arc under varying weight from the earlier coefficients.

    ``degree`` applies to both the motion and the weight.
    """
    c, A, W = scratch.rotation, scratch.ground, scratch.weight
    lam, gain, threshold = block.stiffness[side], block.restoring_gain[side], block.threshold[side]
    value = -gain * (threshold * W[k] + A[k]) if k <= degree else 0.0
    for j in range(min(k, degree) + 1):
        value += lam * W[j] * c[k - j]
    return value * INTEGRATED_TWICE[k]


@inlined
def compute_nonlinear_coefficient(lam: float, scratch: Struct, degrees: tuple[int, int], k: int) -> float:
    """Compute c[k + 2] of a nonlinear arc from sin and cos(alpha - u) up to k, for the degrees of motion and weight."""
    A, W, S, C = scratch.ground, scratch.weight, scratch.sine, scratch.cosine
    degree, weight_degree = degrees
    value = W[0] * S[k]
    for j in range(1, min(k, weight_degree) + 1):
        value += W[j] * S[k - j]
    for j in range(min(k, degree) + 1):
        value += A[j] * C[k - j]
    value *= -lam * INTEGRATED_TWICE[k]
    return value


@inlined
def write_angle_coefficients(scratch: Struct, k: int) -> None:
    """Write the coefficients k + 1 of sin and cos(alpha - u) from the earlier ones and c[1] to c[k + 1]."""
    c, S, C = scratch.rotation, scratch.sine, scratch.cosine
    sine = 0.0
    cosine = 0.0
    for j in range(k + 1):
        rate = (j + 1) * c[j + 1]
        sine -= rate * C[k - j]
        cosine += rate * S[k - j]
    S[k + 1] = sine * _INTEGRATED[k + 1]
    C[k + 1] = cosine * _INTEGRATED[k + 1]


@inlined
def compute_restrained_coefficient(
    block: Struct, side: int, scratch: Struct, degrees: tuple[int, int], nonlinear: bool, k: int
) -> float:
    """Compute coefficient k of u'' + c u' from the rotation up to k."""
    c, A, W = scratch.rotation, scratch.ground, scratch.weight
    lam = block.stiffness[side]
    value = -block.spring[side] * c[k]
    if nonlinear:
        value += compute_nonlinear_coefficient(lam, scratch, degrees, k) / INTEGRATED_TWICE[k]
        return value - block.prestress[side] * scratch.half_cosine[k]
    if k <= degrees[0]:
        value -= block.restoring_gain[side] * A[k]
    if k <= degrees[1]:
        value -= block.restoring_gain[side] * (block.threshold[side] * W[k])
    if k == 0:
        value -= block.prestress[side]
    for j in range(min(k, degrees[1]) + 1):
        value += lam * W[j] * c[k - j]
    return value


@inlined
def write_half_angle_coefficients(scratch: Struct, k: int) -> None:
    """Write the coefficients k + 1 of sin and cos(u/2) from the earlier ones and c[1] to c[k + 1]."""
    c, S, C = scratch.rotation, scratch.half_sine, scratch.half_cosine
    sine = 0.0
    cosine = 0.0
    for j in range(k + 1):
        rate = 0.5 * (j + 1) * c[j + 1]
        sine += rate * C[k - j]
        cosine -= rate * S[k - j]
    S[k + 1] = sine / (k + 1)
    C[k + 1] = cosine / (k + 1)


@inlined
def compute_next_coefficient(
    block: Struct, settings: Struct, side: int, scratch: Struct, degrees: tuple[int, int], k: int
) -> float:
    """Compute c[k + 2] of an arc from the earlier coefficients, for the degrees of motion and weight."""
    if block.restrained:
        force = compute_restrained_coefficient(block, side, scratch, degrees, settings.nonlinear, k)
        return (force - block.damping[side] * ((k + 1) * scratch.rotation[k + 1])) * INTEGRATED_TWICE[k]
    if settings.nonlinear:
        return compute_nonlinear_coefficient(block.stiffness[side], scratch, degrees, k)
    return compute_weighted_coefficient(block, side, scratch, degrees[0], k)


@inlined
def write_variation_coefficients(variation: Struct, damping: float, order: int) -> None:
    """Write the coefficients 2 to ``order`` of x'' = stiffness x - damping x' + forcing into variation.rotation.

    The first two must be set beforehand.
    """
    stiffness, forcing, x = variation.stiffness, variation.forcing, variation.rotation
    for k in range(order - 1):
        value = forcing[k]
        for j in range(k + 1):
            value += stiffness[j] * x[k - j]
        if damping != 0.0:
            value -= damping * ((k + 1) * x[k + 1])
        x[k + 2] = value * INTEGRATED_TWICE[k]


# ---- Nine terms of one arc, with motion and weight linear in time ----


@inlined
def expand_linear(u: float, v: float, lam: float, pull: float, rate: float) -> RotationCoefficients:
    """Compute the coefficients of u'' = lam u - pull - rate t."""
    c2, c3 = 0.5 * (lam * u - pull), (lam * v - rate) * (1.0 / 6.0)
    c4, c5 = lam * c2 * (1.0 / 12.0), lam * c3 * (1.0 / 20.0)
    c6, c7 = lam * c4 * (1.0 / 30.0), lam * c5 * (1.0 / 42.0)
    c8, c9 = lam * c6 * (1.0 / 56.0), lam * c7 * (1.0 / 72.0)
    return u, v, c2, c3, c4, c5, c6, c7, c8, c9


@inlined
def expand_weighted(
    u: float, v: float, lam: float, pull: float, push: ValueAndSlope, weight: ValueAndSlope
) -> RotationCoefficients:
    """Compute the coefficients of u'' = weight (lam u - pull) - push, with weight and push linear in time."""
    z = lam * u - pull
    c2 = 0.5 * (apply_weight(weight, z, 0.0) - push[0])
    c3 = (1.0 / 6.0) * (apply_weight(weight, lam * v, z) - push[1])
    c4 = lam * apply_weight(weight, c2, v) * (1.0 / 12.0)
    c5 = lam * apply_weight(weight, c3, c2) * (1.0 / 20.0)
    c6 = lam * apply_weight(weight, c4, c3) * (1.0 / 30.0)
    c7 = lam * apply_weight(weight, c5, c4) * (1.0 / 42.0)
    c8 = lam * apply_weight(weight, c6, c5) * (1.0 / 56.0)
    c9 = lam * apply_weight(weight, c7, c6) * (1.0 / 72.0)
    return u, v, c2, c3, c4, c5, c6, c7, c8, c9


@inlined
def expand_nonlinear(
    start: ValueAndSlope, sine_cosine: SineCosine, lam: float, push: ValueAndSlope, weight: ValueAndSlope | None
) -> tuple[RotationCoefficients, AngleSums]:
    """Compute the coefficients of u'' = -lam (weight sin(alpha - u) + push cos(alpha - u)).

    Weight (None: 1) and push are linear in time. ``start`` is (u, v) and ``sine_cosine`` the sine and cosine of alpha -
    u there. The second tuple contains the sums of the |coefficients| of sine and cosine, from power 1 to 7.
    """
    u, v = start
    s0, c0 = sine_cosine
    a, b = push
    l2 = -0.5 * lam
    u2 = l2 * (apply_weight(weight, s0, 0.0) + a * c0)
    s1, c1 = -(v * c0), v * s0
    u3 = l2 * (apply_weight(weight, s1, s0) + (a * c1 + b * c0)) * (1.0 / 3.0)
    r2 = 2.0 * u2
    s2, c2 = -0.5 * (v * c1 + r2 * c0), 0.5 * (v * s1 + r2 * s0)
    u4 = l2 * (apply_weight(weight, s2, s1) + (a * c2 + b * c1)) * (1.0 / 6.0)
    r3 = 3.0 * u3
    s3, c3 = -(v * c2 + r2 * c1 + r3 * c0) * (1.0 / 3.0), (v * s2 + r2 * s1 + r3 * s0) * (1.0 / 3.0)
    u5 = l2 * (apply_weight(weight, s3, s2) + (a * c3 + b * c2)) * (1.0 / 10.0)
    r4 = 4.0 * u4
    s4 = -0.25 * ((v * c3 + r2 * c2) + (r3 * c1 + r4 * c0))
    c4 = 0.25 * ((v * s3 + r2 * s2) + (r3 * s1 + r4 * s0))
    u6 = l2 * (apply_weight(weight, s4, s3) + (a * c4 + b * c3)) * (1.0 / 15.0)
    r5 = 5.0 * u5
    s5 = -0.2 * ((v * c4 + r2 * c3) + (r3 * c2 + r4 * c1) + r5 * c0)
    c5 = 0.2 * ((v * s4 + r2 * s3) + (r3 * s2 + r4 * s1) + r5 * s0)
    u7 = l2 * (apply_weight(weight, s5, s4) + (a * c5 + b * c4)) * (1.0 / 21.0)
    r6 = 6.0 * u6
    s6 = -(1.0 / 6.0) * ((v * c5 + r2 * c4) + (r3 * c3 + r4 * c2) + (r5 * c1 + r6 * c0))
    c6 = (1.0 / 6.0) * ((v * s5 + r2 * s4) + (r3 * s3 + r4 * s2) + (r5 * s1 + r6 * s0))
    u8 = l2 * (apply_weight(weight, s6, s5) + (a * c6 + b * c5)) * (1.0 / 28.0)
    r7 = 7.0 * u7
    s7 = -(1.0 / 7.0) * ((v * c6 + r2 * c5) + (r3 * c4 + r4 * c3) + ((r5 * c2 + r6 * c1) + r7 * c0))
    c7 = (1.0 / 7.0) * ((v * s6 + r2 * s5) + (r3 * s4 + r4 * s3) + ((r5 * s2 + r6 * s1) + r7 * s0))
    u9 = l2 * (apply_weight(weight, s7, s6) + (a * c7 + b * c6)) * (1.0 / 36.0)
    lowest_sums = (abs(v), abs(s2) + abs(c2), abs(s3) + abs(c3), abs(s4) + abs(c4))
    return (u, v, u2, u3, u4, u5, u6, u7, u8, u9), (
        *lowest_sums,
        abs(s5) + abs(c5),
        abs(s6) + abs(c6),
        abs(s7) + abs(c7),
    )


# ---- Terms of the velocity in lanes, in units of substeps, so that their sum is the change during one ----


@inlined
def compute_weighted_terms(
    r1: float, z0: float, q: float, push: ValueAndSlope, weight: ValueAndSlope
) -> tuple[VelocityTerms, float, float]:
    """Compute the terms r1 to r9, r10 and r11 of the velocity of a linear arc under varying weight.

    u'' = weight z - push, where z is q u minus a constant and z0 is its initial value.
    """
    w, d = weight
    r2, z1 = w * z0 - push[0], q * r1
    r3, z2 = 0.5 * ((w * z1 + d * z0) - push[1]), 0.5 * (q * r2)
    r4, z3 = (1.0 / 3.0) * (w * z2 + d * z1), (1.0 / 3.0) * (q * r3)
    r5, z4 = 0.25 * (w * z3 + d * z2), 0.25 * (q * r4)
    r6, z5 = 0.2 * (w * z4 + d * z3), 0.2 * (q * r5)
    r7, z6 = (1.0 / 6.0) * (w * z5 + d * z4), (1.0 / 6.0) * (q * r6)
    r8, z7 = (1.0 / 7.0) * (w * z6 + d * z5), (1.0 / 7.0) * (q * r7)
    r9, z8 = 0.125 * (w * z7 + d * z6), 0.125 * (q * r8)
    r10, z9 = (1.0 / 9.0) * (w * z8 + d * z7), (1.0 / 9.0) * (q * r9)
    r11 = 0.1 * (w * z9 + d * z8)
    return (r1, r2, r3, r4, r5, r6, r7, r8, r9), r10, r11


@inlined
def compute_nonlinear_terms(
    r1: float, sine_cosine: SineCosine, l2: float, push: ValueAndSlope, weight: ValueAndSlope | None
) -> tuple[VelocityTerms, AngleSums]:
    """Compute the terms r1 to r9 of the velocity of a nonlinear arc.

    ``l2`` is -lam/2, ``sine_cosine`` the initial sine and cosine of alpha - u; a weight of None is 1. The second tuple
    is as in `expand_nonlinear`.
    """
    s0, c0 = sine_cosine
    a, b = push
    r2 = 2.0 * (l2 * (apply_weight(weight, s0, 0.0) + a * c0))
    s1, c1 = -(r1 * c0), r1 * s0
    r3 = l2 * (apply_weight(weight, s1, s0) + (a * c1 + b * c0))
    s2, c2 = -0.5 * (r1 * c1 + r2 * c0), 0.5 * (r1 * s1 + r2 * s0)
    r4 = (2.0 / 3.0) * (l2 * (apply_weight(weight, s2, s1) + (a * c2 + b * c1)))
    s3, c3 = -(1.0 / 3.0) * (r1 * c2 + (r2 * c1 + r3 * c0)), (1.0 / 3.0) * (r1 * s2 + (r2 * s1 + r3 * s0))
    r5 = 0.5 * (l2 * (apply_weight(weight, s3, s2) + (a * c3 + b * c2)))
    s4 = -0.25 * ((r1 * c3 + r2 * c2) + (r3 * c1 + r4 * c0))
    c4 = 0.25 * ((r1 * s3 + r2 * s2) + (r3 * s1 + r4 * s0))
    r6 = 0.4 * (l2 * (apply_weight(weight, s4, s3) + (a * c4 + b * c3)))
    s5 = -0.2 * ((r1 * c4 + r2 * c3) + (r3 * c2 + (r4 * c1 + r5 * c0)))
    c5 = 0.2 * ((r1 * s4 + r2 * s3) + (r3 * s2 + (r4 * s1 + r5 * s0)))
    r7 = (1.0 / 3.0) * (l2 * (apply_weight(weight, s5, s4) + (a * c5 + b * c4)))
    s6 = -(1.0 / 6.0) * ((r1 * c5 + r2 * c4) + ((r3 * c3 + r4 * c2) + (r5 * c1 + r6 * c0)))
    c6 = (1.0 / 6.0) * ((r1 * s5 + r2 * s4) + ((r3 * s3 + r4 * s2) + (r5 * s1 + r6 * s0)))
    r8 = (2.0 / 7.0) * (l2 * (apply_weight(weight, s6, s5) + (a * c6 + b * c5)))
    s7 = -(1.0 / 7.0) * (((r1 * c6 + r2 * c5) + (r3 * c4 + r4 * c3)) + ((r5 * c2 + r6 * c1) + r7 * c0))
    c7 = (1.0 / 7.0) * (((r1 * s6 + r2 * s5) + (r3 * s4 + r4 * s3)) + ((r5 * s2 + r6 * s1) + r7 * s0))
    r9 = 0.25 * (l2 * (apply_weight(weight, s7, s6) + (a * c7 + b * c6)))
    lowest_sums = (abs(r1), abs(s2) + abs(c2), abs(s3) + abs(c3), abs(s4) + abs(c4))
    angle_sums = (*lowest_sums, abs(s5) + abs(c5), abs(s6) + abs(c6), abs(s7) + abs(c7))
    return (r1, r2, r3, r4, r5, r6, r7, r8, r9), angle_sums


# ---- Sufficiency of nine terms; see "Where a series may end" in the documentation ----

#: Nine times the largest bound on the truncation of a nonlinear velocity after nine terms, divided by the sum of their
#: absolute values. The bound, a few times the truncation, is valid if two sums are below a quarter.
_MAX_TRUNCATION = 9.0 * 2.0**-52
_MAX_SUM = 0.25


@inlined
def sum_forcing(weight: ValueAndSlope | None, push: ValueAndSlope, t: float) -> tuple[float, float]:
    """Compute the sum of |weight| and |push| within t, and of their changes; lines are values and slopes."""
    if weight is None:
        return 1.0 + abs(push[0]) + abs(push[1]) * t, abs(push[1]) * t
    change = (abs(push[1]) + abs(weight[1])) * t
    return abs(weight[0]) + abs(push[0]) + change, change


@inlined
def has_negligible_truncation(
    r: VelocityTerms, z: AngleSums, stiffness: float, forcing_bounds: tuple[float, float]
) -> tuple[bool, float]:
    """Return whether the truncation after nine terms is below 2^-52, and a bound on all terms of u'' after the first.

    Special case of `bound_nonlinear_truncation` for motion and weight linear in time, with the step h as the unit of
    time and ``stiffness`` = lam h^2. False for NaN.
    """
    t8 = r[7] + r[8]  # sums of all later terms
    t7 = r[6] + t8
    t6 = r[5] + t7
    t5 = r[4] + t6
    t4 = r[3] + t5
    t3 = r[2] + t4
    t2 = r[1] + t3
    velocity = r[0] + t2
    products = (t8 + z[0] * t7) + (z[1] * t6 + z[2] * t5) + ((z[3] * t4 + z[4] * t3) + (z[5] * t2 + z[6] * velocity))
    max_forcing, change = stiffness * forcing_bounds[0], stiffness * forcing_bounds[1]
    # The factors include the feedback if velocity and max_forcing are below a quarter.
    truncation = 1.01 * change * z[6] + 0.131 * (max_forcing * products)
    is_negligible = (truncation <= _MAX_TRUNCATION * velocity) & (velocity <= _MAX_SUM) & (max_forcing <= _MAX_SUM)
    return is_negligible, (t3 + t3) + ((t4 + t5) + (t6 + t7) + (t8 + r[8]))
