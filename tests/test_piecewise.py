"""Laws of the algebra of piecewise polynomials."""

import numpy as np
from numpy.polynomial import Polynomial
from oracles.exact import exact, polynomial

from rocking.motion.piecewise import shift_origin_exactly


def test_pieces_that_are_cut_are_moved_as_if_rounded_once():
    """Also where the terms of a piece are far larger than its values: near the root of (x - 1)^10, for one."""
    rng = np.random.default_rng(5)
    rows = [np.pad(coefficients, (0, 3)) for coefficients in rng.normal(size=(300, 8))]
    rows += [(Polynomial([-1.0, 1.0]) ** 10).coef, (Polynomial([-1.0, 0.0, 1.0]) ** 5).coef]
    shifts = np.append(rng.uniform(-2.0, 2.0, 300), [1.01, 1.1])
    for row, shift, found in zip(rows, shifts, shift_origin_exactly(np.array(rows), shifts), strict=True):
        true = polynomial(row)(polynomial([shift, 1.0]))
        terms = polynomial(abs(row))(polynomial([abs(shift), 1.0]))
        for power, coefficient in enumerate(found):
            assert abs(exact(coefficient) - true[power]) <= abs(true[power]) / 2**53 + terms[power] / 2**98
