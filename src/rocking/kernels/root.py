"""The first positive root of a power series, found without any chance of stepping over it."""

import math

import numpy as np

from rocking.kernels.compiled import leaf, routine

_EPSILON = 2.0**-53
_MAXIMUM_STEPS = 200


@routine
def first_root(c, lead, order, h):
    """First root in (0, h] of sum_k c[lead + k] t^k; NaN when there is none.

    The series is the paper's Eq. 20: what is left of Eq. 15 after division by t^lead. It must not be negative
    at 0. On [0, h] the second derivative is never below -bound, so the parabola with that curvature through the
    current value and slope lies below the series, and its root is a step that no root of the series can precede.
    Near a simple root the steps converge quadratically, always from the left.
    """
    while lead < order and c[lead] == 0.0:
        lead += 1
    bound = curvature_bound(c, lead, order, h)
    t = 0.0
    f = c[lead]
    slope = c[lead + 1] if lead < order else 0.0
    for _ in range(_MAXIMUM_STEPS):
        denominator = math.sqrt(slope * slope + 2.0 * bound * f) - slope
        if not 2.0 * f <= denominator * (h - t):
            return np.nan
        if f == 0.0 and slope >= 0.0:
            return t if t > 0.0 else np.nan
        step = 2.0 * f / denominator
        t += step
        if step <= _EPSILON * t:
            return t
        f, slope = deflated(c, lead, order, t)
        if f <= 0.0:
            return t
    return t


@leaf
def curvature_bound(c, lead, order, h):
    """Bound B >= 0 with f'' >= -B on [0, h] for the deflated series f: terms that help are left out."""
    lowest = 0.0
    power = 1.0
    for k in range(2, order - lead + 1):
        curvature = k * (k - 1) * c[lead + k] * power
        if k == 2 or curvature < 0.0:
            lowest += curvature
        power *= h
    return max(0.0, -lowest)


@leaf
def deflated(c, lead, order, t):
    """Value and slope of sum_k c[lead + k] t^k."""
    f = c[order]
    slope = 0.0
    for k in range(order - 1, lead - 1, -1):
        slope = slope * t + f
        f = f * t + c[k]
    return f, slope


@leaf
def first_peak(c, order, h, d):
    """First time in (0, h] at which a rising series stops rising; NaN when it does not. d is scratch space."""
    for k in range(order):
        d[k] = (k + 1) * c[k + 1]
    return first_root(d, 0, order - 1, h)


@leaf
def first_passage(c, order, level, h, d):
    """First time in (0, h] at which a series that starts below ``level`` reaches it; NaN when it does not."""
    d[0] = level - c[0]
    for k in range(1, order + 1):
        d[k] = -c[k]
    return first_root(d, 0, order, h)
