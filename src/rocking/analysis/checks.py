"""Arguments that several analyses check in the same way."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rocking.errors import InvalidOption
from rocking.kernels.state import Floats


def positive_numbers(values: ArrayLike, name: str) -> Floats:
    """One or more positive finite numbers as a flat array.

    Raises
    ------
    InvalidOption
        If they are anything else.
    """
    try:
        axis = np.atleast_1d(np.asarray(values, dtype=np.float64))
    except (TypeError, ValueError):
        raise InvalidOption(f"{name} must be numbers, not {values!r}") from None
    if axis.ndim != 1 or not axis.size or not np.all(np.isfinite(axis) & (axis > 0.0)):
        raise InvalidOption(f"{name} must be one or more positive finite numbers")
    return axis


def increasing_numbers(values: ArrayLike, name: str) -> Floats:
    """Positive finite numbers in increasing order.

    Raises
    ------
    InvalidOption
        If they are anything else.
    """
    axis = positive_numbers(values, name)
    if not np.all(np.diff(axis) > 0.0):
        raise InvalidOption(f"{name} must increase from one to the next")
    return axis


def share(value: object, name: str) -> float:
    """Check a number between 0 and 1, ends excluded.

    Raises
    ------
    InvalidOption
        If it is anything else.
    """
    if not (isinstance(value, (int, float)) and 0.0 < value < 1.0):
        raise InvalidOption(f"{name} must be a number between 0 and 1, not {value!r}")
    return float(value)
