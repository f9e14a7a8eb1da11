"""One arc between two events as a Taylor series (paper, Eq. 15), linear or nonlinear alike.

The rotation is written in the frame of the side that the block leans to: u = |theta| >= 0, and the ground acceleration
as A(t) = i a(t)/g with i the sign of that side. A vertical ground acceleration changes the weight: W(t) = 1 + a_v(t)/g.
The two models read

    linear      u'' = W lam u - gain (W threshold + A)
    nonlinear   u'' = -lam (W sin(alpha - u) + A cos(alpha - u))

and the coefficients c[k] of u follow by recurrence. In the linear model lam may have any sign: p^2 for a rocking block
(whose gain is p^2, too), 0 for a ball, negative for an oscillator with a stop.
"""

import math

import numpy as np

from rocking.arrays import Floats
from rocking.kernels.compiled import inlined, shared
from rocking.kernels.ground import Ground, acceleration, has_vertical, local_series, vertical_of
from rocking.kernels.state import ORDER, Record

#: Terms of the velocity below this fraction of the largest one no longer count. (Those of the rotation are no measure:
#: over a step that is short beside 1/p they vanish beside u long before the velocity has converged.)
NEGLIGIBLE = 2.0**-56

#: Largest of what `is_carried_on` tests over the first two terms: a sixtieth of it is below the last place.
_CARRIED = 2.0**-46

#: First step from an impact, over the arc's duration under constant acceleration.
_FIRST_STEP = 1.3

_WEIGHT = 1.0 / ((np.arange(ORDER + 1) + 1.0) * (np.arange(ORDER + 1) + 2.0))
_INVERSE = 1.0 / np.maximum(np.arange(ORDER + 2), 1)


#: A quantity that changes evenly: its value, and its slope or its change over a step.
Line = tuple[float, float]


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


@inlined
def borne(weight: Line | None, this: float, before: float) -> float:
    """Coefficient of the weight times a series, from two neighbouring ones of the series; None: the weight is 1."""
    return this if weight is None else weight[0] * this + weight[1] * before


@inlined
def is_carried_on(change: float, seventh: float, first: tuple[float, float]) -> bool:
    """Whether a changing weight makes more than nothing of a seventh term of the rate beyond the ninth.

    ``change`` is lam h^2 times the change of the weight over a step of length h, and time is counted in steps. What it
    makes in all is less than a sixtieth of its product with the term; ``first`` are the first two terms.
    """
    return not abs(change * seventh) <= _CARRIED * (abs(first[0]) + abs(first[1]))


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
    if has_vertical(ground):
        expand_linear_weighted(block, state, scratch, degree)
        return ORDER, shortened(scratch.rotation, h), degree
    if degree <= 1:
        order = linear_order(block.stiffness[state.side], h)
        expand_linear(block, state, scratch, degree, order)
        return order, h, degree
    expand_linear(block, state, scratch, degree, ORDER)
    order, h = converged(scratch.rotation, degree, h)
    return order, h, degree


@inlined
def raise_degree(A: Floats, degree: int, W: Floats, other: int) -> int:
    """Larger degree of two polynomials, both of which are filled up with zeros to it."""
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
    if state.u == 0.0 and state.v > 0.0:
        g = restoring(ground, block, state.side, state.piece, state.offset)
        if g > 0.0:
            h = min(h, _FIRST_STEP * 2.0 * state.v / g)
    return h


@inlined
def significant_degree(A: Floats, degree: int, h: float) -> int:
    """Degree of a polynomial without the highest powers that do not count within h."""
    while degree > 1 and abs(A[degree]) * h**degree < NEGLIGIBLE * abs(A[0]):
        degree -= 1
    return degree


@inlined
def linear_order(lam: float, h: float) -> int:
    """Order at which a linear arc's series has converged over h, for a motion of degree 0 or 1.

    Every coefficient after the motion's own follows from the one two before, so the ratio of c[k] h^k to c[2] h^2
    (slower than all that comes from the initial state) is known beforehand.
    """
    squared = abs(lam) * h * h
    ratio = 1.0
    for k in range(2, ORDER - 2, 2):
        ratio *= squared * _WEIGHT[k]
        if ratio <= NEGLIGIBLE:
            return k + 1
    return ORDER


@inlined
def converged(c: Floats, degree: int, h: float) -> tuple[int, float]:
    """Order at which a full series has converged over h, or else a step over which it has; returns (order, h').

    Past the motion's degree a coefficient follows from the one two before: two that do not count end the series.
    """
    largest = term = abs(c[1]) * h
    power = h * h
    for k in range(2, ORDER + 1):
        previous = term
        term = k * abs(c[k]) * power
        largest = max(largest, term)
        if k > degree + 3 and term + previous <= NEGLIGIBLE * largest:
            return k, h
        power *= h
    return ORDER, shortened(c, h)


@inlined
def expand_linear(block: Record, state: Record, scratch: Record, degree: int, order: int) -> None:
    """Series of a linear arc, up to ``order``."""
    c, A, side = scratch.rotation, scratch.ground, state.side
    lam, gain = block.stiffness[side], block.gain[side]
    c[0] = state.u
    c[1] = state.v
    c[2] = 0.5 * (lam * state.u - gain * (block.threshold[side] + A[0]))
    for k in range(1, degree + 1):
        c[k + 2] = (lam * c[k] - gain * A[k]) * _WEIGHT[k]
    for k in range(degree + 1, order - 1):
        c[k + 2] = lam * c[k] * _WEIGHT[k]


@shared
def expand_linear_weighted(block: Record, state: Record, scratch: Record, degree: int) -> None:
    """Full series of a linear arc while the weight changes; the motion's polynomials are of one degree."""
    c, A, W, side = scratch.rotation, scratch.ground, scratch.weight, state.side
    lam, gain, threshold = block.stiffness[side], block.gain[side], block.threshold[side]
    c[0] = state.u
    c[1] = state.v
    for k in range(ORDER - 1):
        value = -gain * (threshold * W[k] + A[k]) if k <= degree else 0.0
        for j in range(min(k, degree) + 1):
            value += lam * W[j] * c[k - j]
        c[k + 2] = value * _WEIGHT[k]


@shared
def expand_nonlinear(
    block: Record, state: Record, scratch: Record, degrees: tuple[int, int], h: float
) -> tuple[int, float]:
    """Series of a nonlinear arc, and of sin and cos(alpha - u), for a motion and a weight of these degrees.

    Returns (order, h').

    Coefficients may vanish one after another (a release from rest where sin and cos balance), so that small terms alone
    do not end the series: a majorant of the velocity's, |u''| h^2 times those of an exponential, must be small as well.
    """
    c, A, W, S, C = scratch.rotation, scratch.ground, scratch.weight, scratch.sine, scratch.cosine
    lam, psi = block.stiffness[state.side], block.slenderness[state.side] - state.u
    degree, changes = degrees
    c[0] = state.u
    c[1] = state.v
    S[0] = math.sin(psi)
    C[0] = math.cos(psi)
    power = h * h
    stiff = lam * math.hypot(W[0], A[0])
    rate = (math.sqrt(stiff) + abs(state.v) + stiff * h) * h
    majorant = stiff * power
    largest = term = abs(state.v) * h
    for k in range(ORDER - 1):
        value = W[0] * S[k]
        for j in range(1, min(k, changes) + 1):
            value += W[j] * S[k - j]
        for j in range(min(k, degree) + 1):
            value += A[j] * C[k - j]
        value *= -lam * _WEIGHT[k]
        c[k + 2] = value
        previous = term
        term = (k + 2) * abs(value) * power
        largest = max(largest, term)
        if k > degree and majorant <= NEGLIGIBLE * largest and term + previous <= NEGLIGIBLE * largest:
            return k + 2, h
        sine = 0.0
        cosine = 0.0
        for j in range(k + 1):
            turn = (j + 1) * c[j + 1]
            sine -= turn * C[k - j]
            cosine += turn * S[k - j]
        S[k + 1] = sine * _INVERSE[k + 1]
        C[k + 1] = cosine * _INVERSE[k + 1]
        power *= h
        majorant *= rate * _INVERSE[k + 2]
    return ORDER, shortened(c, h)


@shared
def shortened(c: Floats, h: float) -> float:
    """Step, not longer than h, at which the last terms of a full series no longer count.

    The last four, since three may vanish (a release from rest where sin and cos balance has every fourth power only).
    """
    excess = np.inf
    while excess > 1.0:
        largest = last = 0.0
        power = 1.0
        for k in range(ORDER + 1):
            term = k * abs(c[k]) * power
            largest = max(largest, term)
            if k > ORDER - 4:
                last += term
            power *= h
        excess = last / (NEGLIGIBLE * largest)
        if excess > 1.0:
            h *= 0.9 * excess ** (-1.0 / ORDER)
    return h


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
