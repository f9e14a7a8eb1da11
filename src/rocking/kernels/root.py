"""The first positive root of a power series, found without any chance of stepping over it."""

import math

import numpy as np

from rocking.arrays import Floats
from rocking.kernels.compiled import inlined, shared

_EPSILON = 2.0**-53

#: After so many steps the search goes on within a window of so many times the way that it has come, and then the next.
_PATIENCE = 8
_WINDOW = 4.0

#: Some six steps find a simple root; a near touch takes tens to thousands. A series that is still not negative after
#: so many lies within 1e-10 of zero, relative to its curvature: that counts as a touch.
_MAXIMUM_STEPS = 100_000


@shared
def first_root(c: Floats, lead: int, order: int, h: float) -> float:
    """First root in (0, h] of sum_k c[lead + k] t^k; NaN when there is none.

    The series is the paper's Eq. 20: what is left of Eq. 15 after division by t^lead. It must not be negative
    at 0. On [0, h] the second derivative is never below -bound, so the parabola with that curvature through the
    current value and slope lies below the series, and its root is a step that no root of the series can precede.
    Near a simple root the steps converge quadratically, always from the left. Where they are short because the bound
    holds for all of a much longer interval, a window, with a bound of its own, goes before them.

    A series that rounding makes negative at 0 counts as zero there, and that zero not as a root.
    """
    while lead < order and c[lead] == 0.0:
        lead += 1
    t = 0.0
    f = max(0.0, c[lead])
    slope = c[lead + 1] if lead < order else 0.0
    if f == 0.0 and slope <= 0.0:
        return np.nan
    window = h
    bound = curvature_bound(c, lead, order, window)
    for n in range(1, _MAXIMUM_STEPS + 1):
        root = math.sqrt(slope * slope + 2.0 * bound * f)
        # The two forms of the parabola's root; neither subtracts numbers of the same sign.
        above, below = (slope + root, bound) if slope > 0.0 else (2.0 * f, root - slope)
        if above <= below * (window - t):
            step = above / below
            t += step
            if step <= _EPSILON * t:
                return t
        elif window < h:  # no root in the window
            t = window
        else:
            return np.nan
        if t == window or n % _PATIENCE == 0:
            window = min(h, _WINDOW * t)
            bound = curvature_bound(c, lead, order, window)
        f, slope = deflated(c, lead, order, t)
        if f <= 0.0:
            return t
    return t


@inlined
def curvature_bound(c: Floats, lead: int, order: int, h: float) -> float:
    """Bound B >= 0 with f'' >= -B on [0, h] for the deflated series f: terms that help are left out."""
    lowest = 0.0
    power = 1.0
    for k in range(2, order - lead + 1):
        curvature = k * (k - 1) * c[lead + k] * power
        if k == 2 or curvature < 0.0:
            lowest += curvature
        power *= h
    return max(0.0, -lowest)


@inlined
def deflated(c: Floats, lead: int, order: int, t: float) -> tuple[float, float]:
    """Value and slope of sum_k c[lead + k] t^k."""
    f = c[order]
    slope = 0.0
    for k in range(order - 1, lead - 1, -1):
        slope = slope * t + f
        f = f * t + c[k]
    return f, slope
