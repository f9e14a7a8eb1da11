"""Brackets of changes, halved: which are still too wide, and what is left of each once its middle is known."""

from __future__ import annotations

from collections.abc import Callable

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
    """Return brackets of which some are cut at their middle.

    Parameters
    ----------
    low, high : ndarray, shape (n,)
        Ends of the brackets.
    in_upper, in_lower : ndarray of bool, shape (n,)
        Whether the change lies above the middle, or below it. A bracket with neither stays as it is.

    Returns
    -------
    low, high : ndarray, shape (n,)
    """
    between = middle(low, high)
    return np.where(in_upper, between, low), np.where(in_lower, between, high)


def last_that_holds(holds: Callable[[float], bool], low: float, high: float, width: float) -> float:
    """Return a number, from `low` where something holds to `high` where not, at which it holds and so far above not."""
    while high - low > width:
        between = 0.5 * (low + high)
        low, high = (between, high) if holds(between) else (low, between)
    return low
