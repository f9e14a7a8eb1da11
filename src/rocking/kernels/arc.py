"""One arc between two events as a Taylor series (paper, Eq. 15), linear or nonlinear alike.

The rotation is written in the frame of the side that the block leans to: u = |theta| >= 0, and the motion as
A(t) = i a(t)/g with i the sign of that side. The two models read

    linear      u'' = lam (u - alpha - A)
    nonlinear   u'' = -lam (sin(alpha - u) + A cos(alpha - u))

with lam = p^2, and the coefficients c[k] of u follow by recurrence.
"""

import math

import numpy as np

from rocking.kernels.compiled import inlined, shared
from rocking.kernels.state import COSINE, GROUND, ORDER, SINE, SPARE, Floats

#: Terms below this fraction of the largest one no longer count.
NEGLIGIBLE = 2.0**-58

_WEIGHT = 1.0 / ((np.arange(ORDER + 1) + 1.0) * (np.arange(ORDER + 1) + 2.0))
_INVERSE = 1.0 / np.maximum(np.arange(ORDER + 2), 1)


@inlined
def local_motion(coefficients: Floats, offset: float, factor: float, h: float, A: Floats) -> int:
    """Motion's polynomial about ``offset``, times ``factor``, into A; returns the degree that counts within h."""
    degree = coefficients.shape[0] - 1
    for k in range(degree + 1):
        A[k] = coefficients[k] * factor
    if offset > 0.0:
        move(A, degree, offset)
    while degree > 1 and abs(A[degree]) * h**degree < NEGLIGIBLE * abs(A[0]):
        degree -= 1
    return degree


@inlined
def move(c: Floats, degree: int, t: float) -> None:
    """Centre of a polynomial moved by t, in place."""
    for k in range(degree):
        for j in range(degree - 1, k - 1, -1):
            c[j] += t * c[j + 1]


@inlined
def linear_order(lam: float, h: float) -> int:
    """Order at which a linear arc's series has converged over h <= 1/p, for a motion of degree 0 or 1.

    Every coefficient after the motion's own follows from the one two before, so the ratio of c[k] h^k to c[2] h^2
    (slower than all that comes from the initial state) is known beforehand.
    """
    squared = lam * h * h
    ratio = 1.0
    for k in range(2, ORDER - 2, 2):
        ratio *= squared * _WEIGHT[k]
        if ratio <= NEGLIGIBLE:
            return k + 1
    return ORDER


@inlined
def converged(c: Floats, degree: int, h: float) -> tuple[int, float]:
    """Order at which a full series has converged over h, or else a step over which it has; returns (order, h')."""
    largest = max(abs(c[0]), abs(c[1]) * h)
    previous = term = largest
    power = h * h
    for k in range(2, ORDER + 1):
        previous = term
        term = abs(c[k]) * power
        largest = max(largest, term)
        if k > degree + 2 and term + previous <= NEGLIGIBLE * largest:
            return k, h
        power *= h
    return ORDER, shortened(c, h)


@shared
def expand_linear(u: float, v: float, lam: float, alpha: float, A: Floats, degree: int, order: int, c: Floats) -> None:
    """Series of a linear arc into c, up to ``order``."""
    c[0] = u
    c[1] = v
    c[2] = 0.5 * lam * (u - alpha - A[0])
    for k in range(1, degree + 1):
        c[k + 2] = lam * (c[k] - A[k]) * _WEIGHT[k]
    for k in range(degree + 1, order - 1):
        c[k + 2] = lam * c[k] * _WEIGHT[k]


@shared
def expand_nonlinear(
    u: float, v: float, lam: float, alpha: float, A: Floats, degree: int, h: float, c: Floats, S: Floats, C: Floats
) -> tuple[int, float]:
    """Series of a nonlinear arc into c, of sin and cos(alpha - u) into S and C; returns (order, h')."""
    c[0] = u
    c[1] = v
    S[0] = math.sin(alpha - u)
    C[0] = math.cos(alpha - u)
    power = h * h
    largest = max(abs(u), abs(v) * h)
    previous = largest
    term = largest
    for k in range(ORDER - 1):
        value = S[k]
        for j in range(min(k, degree) + 1):
            value += A[j] * C[k - j]
        value *= -lam * _WEIGHT[k]
        c[k + 2] = value
        previous = term
        term = abs(value) * power
        largest = max(largest, term)
        sine = 0.0
        cosine = 0.0
        for j in range(k + 1):
            rate = (j + 1) * c[j + 1]
            sine -= rate * C[k - j]
            cosine += rate * S[k - j]
        S[k + 1] = sine * _INVERSE[k + 1]
        C[k + 1] = cosine * _INVERSE[k + 1]
        if k > degree and term + previous <= NEGLIGIBLE * largest:
            return k + 2, h
        power *= h
    return ORDER, shortened(c, h)


@shared
def shortened(c: Floats, h: float) -> float:
    """Step, not longer than h, at which the last two terms of a full series no longer count."""
    excess = np.inf
    while excess > 1.0:
        largest = term = previous = 0.0
        power = 1.0
        for k in range(ORDER + 1):
            previous = term
            term = abs(c[k]) * power
            largest = max(largest, term)
            power *= h
        excess = (term + previous) / (NEGLIGIBLE * largest)
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


@shared
def vary_linear(
    du: float, dv: float, lam: float, degree: int, order: int, t: float, scratch: Floats
) -> tuple[float, float]:
    """Variation (du, dv) after time t of a linear arc when the motion is scaled by 1 + epsilon.

    The variation obeys the arc's own equation with alpha = 0, so its series is an arc's series.
    """
    expand_linear(du, dv, lam, 0.0, scratch[GROUND], degree, order, scratch[SPARE])
    total, rate, _ = evaluate(scratch[SPARE], order, t)
    return total, rate


@shared
def vary_nonlinear(
    du: float, dv: float, lam: float, degree: int, order: int, t: float, scratch: Floats
) -> tuple[float, float]:
    """Variation (du, dv) after time t of a nonlinear arc when the motion is scaled by 1 + epsilon.

    Needs A, S and C as `expand_nonlinear` left them. Solves d'' = lam ((cos - A sin) d - A cos).
    """
    A, S, C, d = scratch[GROUND], scratch[SINE], scratch[COSINE], scratch[SPARE]
    d[0] = du
    d[1] = dv
    for k in range(order - 1):
        value = 0.0
        for j in range(k + 1):
            stiffness = C[j]
            for m in range(min(j, degree) + 1):
                stiffness -= A[m] * S[j - m]
            value += stiffness * d[k - j]
        for m in range(min(k, degree) + 1):
            value -= A[m] * C[k - m]
        d[k + 2] = lam * value * _WEIGHT[k]
    total, rate, _ = evaluate(d, order, t)
    return total, rate
