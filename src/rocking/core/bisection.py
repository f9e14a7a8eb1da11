"""Bisection: of one bracket until it is narrow, or of many at once with slow evaluations of the middles."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rocking.core.arrays import Flags, Floats


def bisected(
    low: float, high: float, holds: Callable[[float], bool], *, width: float = 0.0, halvings: float = math.inf
) -> tuple[float, float]:
    """Return a bracket of where a condition begins to hold, limited by width, number of halvings or resolution."""
    while high - low > width and halvings > 0:
        between = 0.5 * (low + high)
        if not low < between < high:
            break
        low, high = (low, between) if holds(between) else (between, high)
        halvings -= 1
    return low, high


def middle(low: Floats, high: Floats) -> Floats:
    """Return the midpoints of brackets."""
    return 0.5 * (low + high)


def is_wide(low: Floats, high: Floats, tolerance: Floats | float) -> Flags:
    """Return which brackets are wider than this fraction of their upper end and contain a number between their ends."""
    between = middle(low, high)
    return np.asarray((high - low > tolerance * high) & (between > low) & (between < high))


def halved(low: Floats, high: Floats, in_upper: Flags, in_lower: Flags) -> tuple[Floats, Floats]:
    """Return brackets cut at their middle, on the side that contains the change if known."""
    between = middle(low, high)
    return np.where(in_upper, between, low), np.where(in_lower, between, high)
