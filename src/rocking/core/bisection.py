"""Bisection of one bracket, or of many at once if each evaluation is slow."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rocking.core.arrays import Flags, Floats


def bisect(
    low: float, high: float, condition: Callable[[float], bool], *, width: float = 0.0, halvings: float = math.inf
) -> tuple[float, float]:
    """Return a bracket of where a condition begins to hold, limited by width, number of halvings or resolution."""
    while high - low > width and halvings > 0:
        midpoint = 0.5 * (low + high)
        if not low < midpoint < high:
            break
        low, high = (low, midpoint) if condition(midpoint) else (midpoint, high)
        halvings -= 1
    return low, high


def compute_midpoints(low: Floats, high: Floats) -> Floats:
    """Compute the midpoints of brackets."""
    return 0.5 * (low + high)


def is_wide(low: Floats, high: Floats, tolerance: Floats | float) -> Flags:
    """Return which brackets are wider than this fraction of their upper end and contain a number between their ends."""
    midpoints = compute_midpoints(low, high)
    return np.asarray((high - low > tolerance * high) & (midpoints > low) & (midpoints < high))


def halve(low: Floats, high: Floats, is_in_upper: Flags, is_in_lower: Flags) -> tuple[Floats, Floats]:
    """Return brackets cut at their middle, on the side that contains the change if known."""
    midpoints = compute_midpoints(low, high)
    return np.where(is_in_upper, midpoints, low), np.where(is_in_lower, midpoints, high)
