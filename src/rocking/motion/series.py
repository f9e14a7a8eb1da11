"""Formulas of pulses as piecewise polynomials: each piece is the Taylor series about its middle, moved to its start.

The pieces are so short that the first term left out is below 1e-16 of the amplitude. Large angles are taken without
their rounding: products and quotients with their errors, whole turns taken off exactly.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.polynomial import hermite_e
from numpy.typing import NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.errors import InvalidMotion
from rocking.motion import piecewise
from rocking.motion.piecewise import exact_product


class Angle(NamedTuple):
    """Angles by their sines and cosines."""

    sine: Floats
    cosine: Floats


def sine_and_cosine(turns: Floats, rest: Floats, phase: float) -> Angle:
    """Angle ``2 pi (turns + rest) + phase``, `rest` far below `turns`, without the rounding of a large angle.

    Whole quarter turns are taken off exactly, and the phase is added by the addition theorem.
    """
    within = (turns - np.rint(turns)) + rest
    quarter = np.rint(4.0 * within)
    angle = 2.0 * np.pi * (within - 0.25 * quarter)
    sine, cosine = np.sin(angle), np.cos(angle)
    quadrant = quarter.astype(int) % 4
    turned = Angle(
        np.choose(quadrant, [sine, cosine, -sine, -cosine]),
        np.choose(quadrant, [cosine, -sine, -cosine, sine]),
    )
    return sum_of_angles(turned, Angle(np.sin(phase), np.cos(phase)), 1.0)


def sum_of_angles(one: Angle, other: Angle, sign: float) -> Angle:
    """Sum of two angles, or their difference where the sign is -1."""
    return Angle(
        one.sine * other.cosine + sign * one.cosine * other.sine,
        one.cosine * other.cosine - sign * one.sine * other.sine,
    )


#: Relative to the amplitude of the acceleration, which a pulse that is cut need not reach; covers the terms left out
#: and the rounding of the coefficients, which are multiples of it.
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


MOST_CYCLES: Final = 100_000
#: Far beyond any ground motion, Hz.
_LOWEST: Final = 1e-9
_HIGHEST: Final = 1e6


def checked_frequency(frequency: float) -> float:
    """Return a frequency, Hz, or raise InvalidMotion if it is no pulse's."""
    checked = checks.positive(frequency, "frequency", InvalidMotion, "Hz")
    return checks.within(checked, "frequency of a pulse", InvalidMotion, _LOWEST, _HIGHEST, "Hz")
