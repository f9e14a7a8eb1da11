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
    """Return values, and zeros in place of those that are only rounding beside a size.

    Examples
    --------
    >>> without_dust([1e-16, -2e-3, 5.0], 5.0).tolist()
    [0.0, -0.002, 5.0]
    """
    return np.where(np.abs(values) > 2.0**-40 * size, values, 0.0)


def evenly(count: int, most: int) -> list[int]:
    """Return positions of at most so many of a number of things, evenly from the first to the last.

    Examples
    --------
    >>> evenly(9, 3), evenly(2, 3)
    ([0, 4, 8], [0, 1])
    """
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, most))})


def ranges(count: int, size: int) -> Iterator[slice]:
    """Yield ranges of at most a size that cover a number of things: for calls of kernels, which no interrupt ends.

    Examples
    --------
    >>> list(ranges(5, 2))
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))
