"""Intensity measures of a ground motion, from the exact integrals of its pieces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidMotion
from rocking.motion import piecewise

if TYPE_CHECKING:
    from rocking.motion.motion import Motion


def arias_intensity(motion: Motion) -> float:
    """Arias intensity, m/s."""
    return math.pi / (2.0 * STANDARD_GRAVITY) * float(np.sum(_energies(motion)))


def cumulative_absolute_velocity(motion: Motion) -> float:
    """Integral of the absolute acceleration, m/s."""
    widths = np.diff(motion.breakpoints)
    integral = piecewise.antiderivative(widths, motion.coefficients)[:, np.newaxis, :]
    roots = piecewise.root_candidates(widths, motion.coefficients)
    cuts = np.hstack([np.zeros((len(widths), 1)), roots, widths[:, np.newaxis]])
    # Between two cuts the sign is constant; the integral's own start value would only cost digits.
    integral[..., 0] = 0.0
    return float(np.sum(np.abs(np.diff(piecewise.value(integral, cuts), axis=1))))


def significant_duration(motion: Motion, start: float, end: float) -> float:
    """Time between two fractions of the Arias intensity, s."""
    start, end = (checks.finite(value, "ends of a significant duration", InvalidMotion) for value in (start, end))
    if not 0.0 <= start < end <= 1.0:
        raise InvalidMotion(f"a significant duration needs 0 <= start < end <= 1, not {start} and {end}")
    cumulated = np.append(0.0, np.cumsum(_energies(motion)))
    if cumulated[-1] == 0.0:
        return math.nan
    return _time_at(motion, cumulated, end) - _time_at(motion, cumulated, start)


def spectral_acceleration(
    motion: Motion, period: float | Sequence[float] | NDArray[Any], damping: float
) -> float | Floats:
    """Pseudo-spectral acceleration, m/s^2."""
    from rocking.kernels import oscillator  # numba: loaded only where it is used

    periods = checks.numbers(period, "period of a spectral acceleration", InvalidMotion)
    if not np.all(np.isfinite(periods) & (periods > 0.0)):
        raise InvalidMotion("the period of a spectral acceleration must be a positive number of seconds")
    if np.any(periods < 1e-6 * motion.duration):
        raise InvalidMotion(
            f"a period below a millionth of the duration, {motion.duration:.6g} s, takes too long: use pga"
        )
    if not 0.0 <= checks.finite(damping, "damping", InvalidMotion) < 1.0:
        raise InvalidMotion(f"the damping must be a fraction of critical from 0 to below 1, not {damping}")
    frequencies = np.ravel(2.0 * np.pi / periods)
    peaks = np.empty_like(frequencies)
    work = np.empty(2 * motion.coefficients.shape[1] + oscillator.TERMS)
    oscillator.peak_displacements(motion.breakpoints, motion.coefficients, frequencies, float(damping), work, peaks)
    result = (frequencies**2 * peaks).reshape(periods.shape)
    return result if result.ndim else float(result)


def target(motion: Motion, what: str, period: float | None, damping: float) -> float:
    """Present value of the measure `what` ("pga", "pgv", "sa") that the motion is to be scaled to."""
    if what == "sa":
        return float(spectral_acceleration(motion, checks.positive(period, "period", InvalidMotion, "s"), damping))
    return motion.pga if what == "pga" else motion.pgv


def table(motion: Motion, periods: Sequence[float]) -> dict[str, float]:
    """All measures by name, each name ending in its unit."""
    measures = {
        "duration_s": motion.duration,
        "pga_m_s2": motion.pga,
        "pgv_m_s": motion.pgv,
        "pgd_m": motion.pgd,
        "arias_intensity_m_s": arias_intensity(motion),
        "cumulative_absolute_velocity_m_s": cumulative_absolute_velocity(motion),
        "significant_duration_5_75_s": significant_duration(motion, 0.05, 0.75),
        "significant_duration_5_95_s": significant_duration(motion, 0.05, 0.95),
    }
    for period in periods:
        measures[f"spectral_acceleration_{period:g}s_m_s2"] = float(spectral_acceleration(motion, period, 0.05))
    return measures


def _energies(motion: Motion) -> Floats:
    return _energy(motion.coefficients, np.diff(motion.breakpoints))


def _energy(coefficients: Floats, span: Floats) -> Floats:
    """Integral of the squared polynomial from 0 to `span`: Gauss's rule with degree + 1 points is exact."""
    nodes, weights = np.polynomial.legendre.leggauss(coefficients.shape[-1])
    values = piecewise.value(coefficients[..., np.newaxis, :], 0.5 * span[..., np.newaxis] * (nodes + 1.0))
    energy: Floats = 0.5 * span * (values**2 @ weights)
    return energy


def _time_at(motion: Motion, cumulated: Floats, fraction: float) -> float:
    """First time at which the energy reaches a fraction of the whole, by bisection within its piece."""
    wanted = fraction * cumulated[-1]
    piece = max(int(np.searchsorted(cumulated, wanted, side="left")) - 1, 0)
    low, high = np.float64(0.0), motion.breakpoints[piece + 1] - motion.breakpoints[piece]
    for _ in range(53):
        middle = 0.5 * (low + high)
        if cumulated[piece] + _energy(motion.coefficients[piece], middle) < wanted:
            low = middle
        else:
            high = middle
    return float(motion.breakpoints[piece] + high)
