"""What is measured of a motion's pieces: intensities, from exact integrals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.bisection import bisected
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidMotion
from rocking.motion import piecewise
from rocking.motion.piecewise import Piecewise
from rocking.tables import named

#: Damping of a spectral acceleration, if none is named.
DAMPING: Final = 0.05


def peak_acceleration(motion: Piecewise) -> float:
    """Peak ground acceleration, m/s^2: the exact extremum of the pieces."""
    return piecewise.largest_magnitude(np.diff(motion.breakpoints), motion.coefficients)


def peak_velocity(motion: Piecewise) -> float:
    """Peak ground velocity, m/s: the exact extremum of the exact integral, from rest."""
    return piecewise.largest_magnitude(np.diff(motion.breakpoints), velocity_pieces(motion))


def peak_displacement(motion: Piecewise) -> float:
    """Peak ground displacement up to the motion's end, m: the exact extremum of the exact integral."""
    return piecewise.largest_magnitude(np.diff(motion.breakpoints), displacement_pieces(motion))


def velocity_pieces(motion: Piecewise) -> Floats:
    """Coefficients of the ground velocity on each piece."""
    return piecewise.antiderivative(np.diff(motion.breakpoints), motion.coefficients)


def displacement_pieces(motion: Piecewise) -> Floats:
    """Coefficients of the ground displacement on each piece."""
    return piecewise.antiderivative(np.diff(motion.breakpoints), velocity_pieces(motion))


def arias_intensity(motion: Piecewise) -> float:
    """Arias intensity, m/s."""
    return math.pi / (2.0 * STANDARD_GRAVITY) * float(np.sum(_energies(motion)))


def cumulative_absolute_velocity(motion: Piecewise) -> float:
    """Integral of the absolute acceleration, m/s."""
    widths = np.diff(motion.breakpoints)
    integral = piecewise.antiderivative(widths, motion.coefficients)[:, np.newaxis, :]
    roots = piecewise.root_candidates(widths, motion.coefficients)
    cuts = np.hstack([np.zeros((len(widths), 1)), roots, widths[:, np.newaxis]])
    # Between two cuts the sign is constant; the integral's own start value would only cost digits.
    integral[..., 0] = 0.0
    return float(np.sum(np.abs(np.diff(piecewise.value(integral, cuts), axis=1))))


def significant_duration(motion: Piecewise, start: float, end: float) -> float:
    """Time between two fractions of the Arias intensity, s."""
    start, end = (checks.finite(value, "ends of a significant duration", InvalidMotion) for value in (start, end))
    if not 0.0 <= start < end <= 1.0:
        sentence = f"a significant duration needs 0 <= {{}} < {{}} <= 1, not {start:g} and {end:g}"
        raise InvalidMotion(sentence, "start", "end", value=(start, end))
    first, last = significant_span(motion, start, end)
    return last - first


def significant_span(motion: Piecewise, start: float = 0.05, end: float = 0.95) -> tuple[float, float]:
    """Return the times, s, at which the Arias intensity reaches two fractions of itself; NaN if it is zero."""
    cumulated = np.append(0.0, np.cumsum(_energies(motion)))
    if cumulated[-1] == 0.0:
        return math.nan, math.nan
    return _time_at(motion, cumulated, start), _time_at(motion, cumulated, end)


def spectral_acceleration(
    motion: Piecewise, period: float | Sequence[float] | NDArray[Any], damping: float
) -> float | Floats:
    """Pseudo-spectral acceleration, m/s^2."""
    from rocking.kernels import oscillator  # numba: loaded only where it is used

    periods = checks.numbers(period, "period of a spectral acceleration", InvalidMotion)
    if not np.all(np.isfinite(periods) & (periods > 0.0)):
        raise InvalidMotion("the {} of a spectral acceleration must be a positive number of seconds", "period")
    duration = float(motion.breakpoints[-1])
    if np.any(periods < 1e-6 * duration):
        sentence = f"a {{}} below a millionth of the duration, {duration:.6g} s, takes too long: use pga"
        raise InvalidMotion(sentence, "period")
    if np.any(periods > 1e6 * duration):
        sentence = f"a {{}} above a million times the duration, {duration:.6g} s, says nothing: use pgd"
        raise InvalidMotion(sentence, "period")
    if not 0.0 <= checks.finite(damping, "damping", InvalidMotion) < 1.0:
        sentence = f"the {{}} must be a fraction of critical from 0 to below 1, not {damping:g}"
        raise InvalidMotion(sentence, "damping", value=damping)
    frequencies = np.ravel(2.0 * np.pi / periods)
    peaks = np.empty_like(frequencies)
    work = np.empty(2 * motion.coefficients.shape[1] + oscillator.TERMS)
    oscillator.peak_displacements(motion.breakpoints, motion.coefficients, frequencies, float(damping), work, peaks)
    result = (frequencies**2 * peaks).reshape(periods.shape)
    return result if result.ndim else float(result)


def table(motion: Piecewise, periods: Sequence[float]) -> dict[str, float]:
    """All measures by name, each name ending in its unit."""
    measures = {
        named("duration", "s"): float(motion.breakpoints[-1]),
        named("pga", "m/s^2"): peak_acceleration(motion),
        named("pgv", "m/s"): peak_velocity(motion),
        named("pgd", "m"): peak_displacement(motion),
        named("arias_intensity", "m/s"): arias_intensity(motion),
        named("cumulative_absolute_velocity", "m/s"): cumulative_absolute_velocity(motion),
        named("significant_duration_5_75", "s"): significant_duration(motion, 0.05, 0.75),
        named("significant_duration_5_95", "s"): significant_duration(motion, 0.05, 0.95),
    }
    for period in np.ravel(checks.numbers(periods, "periods of a spectral acceleration", InvalidMotion)).tolist():
        name = named(f"spectral_acceleration_{period:g}s", "m/s^2")
        measures[name] = float(spectral_acceleration(motion, period, DAMPING))
    return measures


def _energies(motion: Piecewise) -> Floats:
    return _energy(motion.coefficients, np.diff(motion.breakpoints))


def _energy(coefficients: Floats, span: Floats) -> Floats:
    """Integral of the squared polynomial from 0 to `span`: Gauss's rule with degree + 1 points is exact."""
    nodes, weights = np.polynomial.legendre.leggauss(coefficients.shape[-1])
    values = piecewise.value(coefficients[..., np.newaxis, :], 0.5 * span[..., np.newaxis] * (nodes + 1.0))
    energy: Floats = 0.5 * span * (values**2 @ weights)
    return energy


def _time_at(motion: Piecewise, cumulated: Floats, fraction: float) -> float:
    """First time at which the energy reaches a fraction of the whole, by bisection within its piece."""
    wanted = fraction * cumulated[-1]
    piece = max(int(np.searchsorted(cumulated, wanted, side="left")) - 1, 0)
    start, end = motion.breakpoints[piece : piece + 2]

    def is_reached(span: float) -> bool:
        return bool(cumulated[piece] + _energy(motion.coefficients[piece], np.asarray(span)) >= wanted)

    return float(start + bisected(0.0, end - start, is_reached, halvings=53)[1])
