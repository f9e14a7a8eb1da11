"""Array types of the package, and helpers for arrays."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


def unwrap_scalar(values: Floats) -> Floats:
    """Return a number for an array without dimensions, else the array."""
    unwrapped: Floats = values[()]
    return unwrapped


def clear_rounding(values: ArrayLike, size: float) -> Floats:
    """Replace values below the rounding error of a size by zero."""
    return np.where(np.abs(values) > 2.0**-40 * size, values, 0.0)


def select_evenly(count: int, max_count: int) -> list[int]:
    """Return at most `most` of `count` positions, evenly from the first to the last."""
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, max_count))})


def split_range(count: int, size: int) -> Iterator[slice]:
    """Yield slices of at most `size` items, because kernel calls cannot be interrupted."""
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))
