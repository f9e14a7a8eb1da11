"""Measures of two horizontal components in all directions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from rocking.core.arrays import Floats
from rocking.motion import piecewise
from rocking.motion.measures import MotionMeasures
from rocking.motion.processing import compute_oscillator, sine_cosine

#: Cosine and sine of the directions from the first component, shape (180, 2).
_DIRECTIONS: Final = np.stack(sine_cosine(np.arange(180.0))[::-1], axis=1)


class _Component(MotionMeasures):
    """Horizontal acceleration in one direction."""

    def __init__(self, breakpoints: Floats, coefficients: Floats) -> None:
        self.breakpoints, self.coefficients = breakpoints, coefficients


def iterate_directions(first: MotionMeasures, second: MotionMeasures) -> Iterator[MotionMeasures]:
    """Yield the motion in each direction."""
    breakpoints, rows = piecewise.align_pieces(first, second)
    return (_Component(breakpoints, cosine * rows[0] + sine * rows[1]) for cosine, sine in _DIRECTIONS)


def compute_directional_peaks(first: MotionMeasures, second: MotionMeasures, integrations: int) -> Floats:
    """Compute peak acceleration, velocity or displacement (0, 1 or 2 integrations) in each direction, shape (180,)."""
    breakpoints, components = piecewise.align_pieces(first, second)
    widths, histories = np.diff(breakpoints), [*components]
    for _ in range(integrations):
        histories = [piecewise.integrate_pieces(widths, history) for history in histories]
    return _find_peaks(widths, histories[0], histories[1])


def compute_directional_spectrum(
    first: MotionMeasures, second: MotionMeasures, period: float, damping: float
) -> Floats:
    """Compute the pseudo-spectral acceleration in each direction, m/s^2, shape (180,)."""
    rate = 2.0 * math.pi / period
    breakpoints, components = piecewise.align_pieces(first, second)
    # The last extremum follows the motion within half a damped period.
    tail = math.pi / (rate * math.sqrt(1.0 - damping**2))
    responses = [compute_oscillator(piecewise.Pieces(breakpoints, rows), rate, damping, tail) for rows in components]
    return rate**2 * _find_peaks(np.diff(responses[0][0]), responses[0][1], responses[1][1])


def _find_peaks(widths: Floats, first: Floats, second: Floats) -> Floats:
    """Find the peak magnitude of histories in all directions, from their components on common pieces."""
    starts = np.stack([first[:, 0], second[:, 0]])
    lower = np.array([np.abs(direction @ starts).max() for direction in _DIRECTIONS])
    # Pieces whose resultant is below the smallest peak do not contain any.
    bounds = np.hypot(*(piecewise.bound_magnitudes(widths, history) for history in (first, second)))
    is_candidate = bounds >= lower.min()
    widths, first, second, bounds = (
        widths[is_candidate],
        first[is_candidate],
        second[is_candidate],
        bounds[is_candidate],
    )
    peaks = np.empty(len(_DIRECTIONS))
    for k, (cosine, sine) in enumerate(_DIRECTIONS):
        is_near = bounds >= lower[k]
        peaks[k] = piecewise.compute_peak_magnitude(widths[is_near], cosine * first[is_near] + sine * second[is_near])
    return peaks
