"""Names for the arrays that the package passes about."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


def as_asked(values: Floats) -> Floats:
    """Return an array, or where it has no dimension the number in it: a number for a number, an array for an array."""
    answer: Floats = values[()]
    return answer


def without_dust(values: ArrayLike, size: float) -> Floats:
    """Return values, and zeros in place of those that are only rounding beside a size."""
    return np.where(np.abs(values) > 2.0**-40 * size, values, 0.0)


def evenly(count: int, most: int) -> list[int]:
    """Return positions of at most so many of a number of things, evenly from the first to the last."""
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, most))})


def ranges(count: int, size: int) -> Iterator[slice]:
    """Yield ranges of at most a size that cover a number of things: for calls of kernels, which no interrupt ends."""
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))
