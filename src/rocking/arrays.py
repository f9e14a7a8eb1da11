"""Names for the arrays that the package passes about."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


def as_asked(values: Floats) -> Floats:
    """Return an array, or where it has no dimension the number in it: a number for a number, an array for an array."""
    answer: Floats = values[()]
    return answer


def evenly(count: int, most: int) -> list[int]:
    """Return positions of at most so many of a number of things, evenly from the first to the last.

    Examples
    --------
    >>> evenly(9, 3), evenly(2, 3)
    ([0, 4, 8], [0, 1])
    """
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, most))})
