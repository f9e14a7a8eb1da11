"""The critical amplitude as a Chebyshev expansion in 1/omega^2 and sqrt(1 - eta).

In these variables the surface is smooth: omega enters the problem through 1/omega^2 alone, and eta = 1 is a
branch point.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.polynomial import chebyshev

from rocking.arrays import Floats
from rocking.chattering.theory.surface_coefficients import COEFFICIENTS

#: Where the expansion holds.
FREQUENCIES: Final = (0.4, 10.0)
RESTITUTIONS: Final = (0.5, 0.97)


def evaluate(omega: Floats, eta: Floats) -> Floats:
    """Approximate critical amplitude within the expansion's domain."""
    amplitudes: Floats = 1.0 + chebyshev.chebval2d(*coordinates(omega, eta), COEFFICIENTS)
    return amplitudes


def coordinates(omega: Floats, eta: Floats) -> tuple[Floats, Floats]:
    """Coordinates of the domain, each from -1 to 1."""
    return (
        _scaled(1.0 / omega**2, 1.0 / FREQUENCIES[1] ** 2, 1.0 / FREQUENCIES[0] ** 2),
        _scaled(np.sqrt(1.0 - eta), np.sqrt(1.0 - RESTITUTIONS[1]), np.sqrt(1.0 - RESTITUTIONS[0])),
    )


def parameters(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Omega and eta at coordinates from -1 to 1."""
    inverse_square = _unscaled(x, 1.0 / FREQUENCIES[1] ** 2, 1.0 / FREQUENCIES[0] ** 2)
    root = _unscaled(y, np.sqrt(1.0 - RESTITUTIONS[1]), np.sqrt(1.0 - RESTITUTIONS[0]))
    return inverse_square**-0.5, 1.0 - root**2


def _scaled(value: Floats, low: float, high: float) -> Floats:
    return (2.0 * value - low - high) / (high - low)


def _unscaled(coordinate: Floats, low: float, high: float) -> Floats:
    return 0.5 * (low + high + (high - low) * coordinate)
