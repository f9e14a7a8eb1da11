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
