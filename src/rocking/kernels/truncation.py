"""Where a series may end: bounds on all terms of an arc's velocity that are left out.

The derivations are in the documentation ("Where a series may end"). A NaN among the numbers makes a bound NaN.
"""

import numpy as np

from rocking.kernels.compiled import inlined, shared
from rocking.kernels.recurrences import Line, Nine, Seven
from rocking.kernels.state import ORDER, Record

#: Terms of the velocity below this fraction of the largest one are negligible. (Those of the rotation are no measure:
#: over a step that is short beside 1/p they are negligible beside u long before the velocity has converged.)
NEGLIGIBLE = 2.0**-56

#: Largest bound on the truncation of a velocity, over its largest term: a quarter of the last place.
TRUNCATION = 2.0**-54

#: Nine times the largest bound on the truncation of a nonlinear velocity after nine terms, over the sum of their
#: absolute values. The bound is a few times the truncation. It holds where two sums are below a quarter.
_TRUNCATION_OF_NINE = 9.0 * 2.0**-52
_QUARTER = 0.25

#: Smaller terms of the velocity are negligible.
SMALLEST = 1e-290

#: Largest number of times that a step is shortened; each time by a tenth at least.
SHORTENINGS = 200


@shared
def shortened_linear(scratch: Record, lam: float, changes: int, h: float) -> float:
    """Step, not longer than h, over which the truncation of a full linear series is negligible.

    ``changes`` is the degree of the weight.
    """
    for _ in range(SHORTENINGS):
        beyond, largest = truncation_linear(scratch, lam, changes, ORDER, h)
        excess = beyond / max(TRUNCATION * largest, SMALLEST)
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
