"""Formulas as piecewise polynomials: each piece is the Taylor series about its middle, moved to its start.

The pieces are so short that the first term left out is below 1e-16 of the peak.
"""

import math
from typing import Final

import numpy as np
from numpy.polynomial import hermite_e
from numpy.typing import NDArray

from rocking.arrays import Floats
from rocking.motion import piecewise
from rocking.motion.pulses.angles import Angle, exact_product, sine_and_cosine

#: Relative to the peak; covers the terms left out and the rounding of the coefficients.
ERROR: Final = 1e-15

#: Of a sine: half a piece is pi/8 = 0.39 rad, and 0.39**14 / 14! = 2.4e-17.
PIECES_PER_CYCLE: Final = 8
_SINE_DEGREE: Final = 13

#: Of a derivative of a Gaussian, in its standard deviations: by Cramer's inequality (|He_n(x)| exp(-x^2/4) is at most
#: 1.09 sqrt(n!)) the first term left out is below 6 e-17 of the peak.
GAUSSIAN_PIECE: Final = 0.4
_GAUSSIAN_DEGREE: Final = 15


def whole_pieces(pieces: float) -> int:
    """Return the number of breakpoints of at least so many equal pieces."""
    return math.ceil(pieces - 1e-9) + 1


def middles(breakpoints: Floats) -> Floats:
    """Middle of each piece, s."""
    return breakpoints[:-1] + 0.5 * np.diff(breakpoints)


def about_starts(breakpoints: Floats, about_middles: Floats) -> Floats:
    """Coefficients about the start of each piece, from those about its middle."""
    return piecewise.moved(about_middles, breakpoints[:-1] - middles(breakpoints))


def sine_pieces(breakpoints: Floats, frequency: float, phase: float) -> Floats:
    """Coefficients of ``sin(2 pi frequency t + phase)`` on each piece."""
    turns, rest = exact_product(frequency, middles(breakpoints))
    angle = sine_and_cosine(turns, rest, phase)
    return about_starts(breakpoints, sine_series(angle, 2.0 * math.pi * frequency))


def sine_series(angle: Angle, rate: float) -> Floats:
    """Taylor coefficients of ``sin(angle + rate t)`` about ``t = 0``; shape (angles, degree + 1)."""
    powers = np.arange(_SINE_DEGREE + 1)
    derivatives = np.column_stack([angle.sine, angle.cosine, -angle.sine, -angle.cosine])[:, powers % 4]
    return derivatives * _scaled_powers(rate, powers)


def gaussian_derivative(order: int, times: Floats, rate: float) -> Floats:
    """Taylor coefficients in t of the derivative in x of ``exp(-x^2 / 2)``, ``x = rate t``, about each time.

    The n-th derivative of the Gaussian is ``(-1)^n He_n(x) exp(-x^2 / 2)``, He_n Hermite's polynomials.
    """
    x = rate * times
    powers = np.arange(_GAUSSIAN_DEGREE + 1)
    hermite = hermite_e.hermevander(x, order + _GAUSSIAN_DEGREE)[:, order:]
    derivatives = hermite * np.exp(-0.5 * x * x)[:, np.newaxis]
    return (-1.0) ** (order + powers) * derivatives * _scaled_powers(rate, powers)


def _scaled_powers(rate: float, powers: NDArray[np.int_]) -> Floats:
    """Return ``rate**n / n!``."""
    return rate ** powers.astype(np.float64) / np.array([math.factorial(n) for n in powers], dtype=np.float64)
