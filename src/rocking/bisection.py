"""Brackets of changes, halved: which are still too wide, and what is left of each once its middle is known."""

from __future__ import annotations

import numpy as np

from rocking.arrays import Flags, Floats


def middle(low: Floats, high: Floats) -> Floats:
    """Return the numbers halfway between two ends."""
    return 0.5 * (low + high)


def is_wide(low: Floats, high: Floats, tolerance: Floats | float) -> Flags:
    """Return which brackets are wider than this share of their upper end, and hold a number between their ends."""
    between = middle(low, high)
    return np.asarray((high - low > tolerance * high) & (between > low) & (between < high))


def halved(low: Floats, high: Floats, in_upper: Flags, in_lower: Flags) -> tuple[Floats, Floats]:
    """Return brackets cut at their middle, where it is known whether the change lies above it or below it."""
    between = middle(low, high)
    return np.where(in_upper, between, low), np.where(in_lower, between, high)
