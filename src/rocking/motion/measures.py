"""Kinematics and intensity measures of a motion, from exact integrals of its pieces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.bisection import bisected
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.tables import named
from rocking.errors import InvalidMotion
from rocking.motion import piecewise

#: Default damping of a spectral acceleration.
DAMPING: Final = 0.05


def checked_damping(value: object, error: checks.Error) -> float:
    """Return a damping ratio, or raise `error`."""
    ratio = checks.number(value, "damping", error)
    if not 0.0 <= ratio < 1.0:
        raise error(f"{{}} must be a fraction of critical from 0 to below 1, not {ratio:g}", "damping", value=value)
    return ratio


class Measured:
    """Kinematics and intensity measures of the horizontal component."""

    breakpoints: Floats
    coefficients: Floats

    @property
    def duration(self) -> float:
        """Time of the last breakpoint, s, after which the acceleration is zero."""
        return float(self.breakpoints[-1])

    @property
    def times(self) -> Floats:
        """Times of the samples (the breakpoints), s."""
        return self.breakpoints

    @property
    def samples(self) -> Floats:
        """Accelerations at `times`, m/s^2, with the value after a jump."""
        return piecewise.samples(self)[1]

    @property
    def jumps(self) -> bool:
        """Whether the acceleration jumps between pieces, beyond rounding."""
        return piecewise.jumps(self)

    def _widths(self) -> Floats:
        return np.diff(self.breakpoints)

    def _velocity(self) -> Floats:
        """Coefficients of the ground velocity on each piece."""
        return piecewise.antiderivative(self._widths(), self.coefficients)

    def _displacement(self) -> Floats:
        """Coefficients of the ground displacement on each piece."""
        return piecewise.antiderivative(self._widths(), self._velocity())

    def acceleration(self, time: ArrayLike) -> Any:
        """Return the ground acceleration at times (s), m/s^2, shaped like `time` and zero outside the motion."""
        at = checks.numbers(time, "time", InvalidMotion)
        result = piecewise.at(self.breakpoints, self.coefficients, at)
        result = np.where((at < 0.0) | (at > self.duration), 0.0, result)
        return result if result.ndim else float(result)

    def velocity(self, time: ArrayLike) -> Any:
        """Return the ground velocity at times (s), m/s, from rest, constant after the end of the motion."""
        at = checks.numbers(time, "time", InvalidMotion)
        result = piecewise.at(self.breakpoints, self._velocity(), at)
        return result if result.ndim else float(result)

    def displacement(self, time: ArrayLike) -> Any:
        """Return the ground displacement at times (s), m, from rest, with the last velocity after the end."""
        at = checks.numbers(time, "time", InvalidMotion)
        result = piecewise.at(self.breakpoints, self._displacement(), at)
        result = result + self.velocity(self.duration) * np.maximum(at - self.duration, 0.0)
        return result if result.ndim else float(result)

    @property
    def extremes(self) -> tuple[float, float]:
        """Exact lowest and highest acceleration with their signs, m/s^2."""
        return -piecewise.highest(self._widths(), -self.coefficients), piecewise.highest(
            self._widths(), self.coefficients
        )

    @property
    def pga(self) -> float:
        """Exact peak ground acceleration, m/s^2."""
        return piecewise.largest_magnitude(self._widths(), self.coefficients)

    @property
    def pgv(self) -> float:
        """Exact peak ground velocity from rest, m/s."""
        return piecewise.largest_magnitude(self._widths(), self._velocity())

    @property
    def pgd(self) -> float:
        """Exact peak ground displacement until the end of the motion, m."""
        return piecewise.largest_magnitude(self._widths(), self._displacement())

    @property
    def arias_intensity(self) -> float:
        """Arias intensity, m/s: ``pi/(2 g)`` times the exact integral of the squared acceleration."""
        return math.pi / (2.0 * STANDARD_GRAVITY) * float(np.sum(_energy(self.coefficients, self._widths())))

    @property
    def cumulative_absolute_velocity(self) -> float:
        """Exact integral of the absolute acceleration, m/s, with sign changes located within pieces."""
        widths = self._widths()
        integral = self._velocity()[:, np.newaxis, :]
        roots = piecewise.root_candidates(widths, self.coefficients)
        cuts = np.hstack([np.zeros((len(widths), 1)), roots, widths[:, np.newaxis]])
        # The sign is constant between cuts. Adding the integral's start value would only lose digits.
        integral[..., 0] = 0.0
        return float(np.sum(np.abs(np.diff(piecewise.value(integral, cuts), axis=1))))

    def significant_duration(self, start: float = 0.05, end: float = 0.95) -> float:
        """Return the time between two fractions of the Arias intensity, s, or NaN if the intensity is zero.

        Raises `InvalidMotion` unless ``0 <= start < end <= 1``.
        """
        start, end = (checks.finite(value, "ends of a significant duration", InvalidMotion) for value in (start, end))
        if not 0.0 <= start < end <= 1.0:
            sentence = f"a significant duration needs 0 <= {{}} < {{}} <= 1, not {start:g} and {end:g}"
            raise InvalidMotion(sentence, "start", "end", value=(start, end))
        first, last = significant_span(self, start, end)
        return last - first

    def spectral_acceleration(self, period: ArrayLike, damping: float = DAMPING) -> Any:
        """Compute the pseudo-spectral acceleration: ``(2 pi/period)**2`` times an oscillator's peak displacement.

        Taylor series of the exact solution on each piece follow the linear oscillator from rest until the first
        extremum after the end of the ground motion. Extrema between samples are located.

        Parameters
        ----------
        period : float or array_like
            Undamped period, s.
        damping : float
            Fraction of critical damping, from 0 to below 1.

        Returns
        -------
        float or ndarray
            Pseudo-spectral acceleration, m/s^2, shaped like `period`.

        Raises
        ------
        InvalidMotion
            If a period is not positive and finite, or below a millionth of the duration (use `pga`), or the damping is
            out of range.
        """
        from rocking.kernels import oscillator  # imported on first use because it loads the library

        periods = checks.numbers(period, "period of a spectral acceleration", InvalidMotion)
        if not np.all(np.isfinite(periods) & (periods > 0.0)):
            raise InvalidMotion("the {} of a spectral acceleration must be a positive number of seconds", "period")
        length = f"the duration, {self.duration:.6g} s"
        if np.any(periods < 1e-6 * self.duration):
            raise InvalidMotion(f"a {{}} below a millionth of {length}, takes too long: use pga", "period")
        if np.any(periods > 1e6 * self.duration):
            raise InvalidMotion(f"a {{}} above a million times {length}, says nothing: use pgd", "period")
        ratio = checked_damping(damping, InvalidMotion)
        frequencies = np.ravel(2.0 * np.pi / periods)
        peaks = np.empty_like(frequencies)
        work = np.empty(2 * self.coefficients.shape[1] + oscillator.TERMS)
        oscillator.write_peak_displacements(self.breakpoints, self.coefficients, frequencies, ratio, work, peaks)
        result = (frequencies**2 * peaks).reshape(periods.shape)
        return result if result.ndim else float(result)

    def measures(self, periods: Sequence[float] = ()) -> dict[str, float]:
        """Return intensity measures in SI units by name, which ends in the unit.

        Spectral accelerations (5 % damping) are added for `periods`, s.
        """
        values = {
            named("duration", "s"): self.duration,
            named("pga", "m/s^2"): self.pga,
            named("pgv", "m/s"): self.pgv,
            named("pgd", "m"): self.pgd,
            named("arias_intensity", "m/s"): self.arias_intensity,
            named("cumulative_absolute_velocity", "m/s"): self.cumulative_absolute_velocity,
            named("significant_duration_5_75", "s"): self.significant_duration(0.05, 0.75),
            named("significant_duration_5_95", "s"): self.significant_duration(0.05, 0.95),
        }
        for period in np.ravel(checks.numbers(periods, "periods of a spectral acceleration", InvalidMotion)).tolist():
            values[named(f"spectral_acceleration_{period:g}s", "m/s^2")] = self.spectral_acceleration(period)
        return values


def significant_span(motion: Measured, start: float = 0.05, end: float = 0.95) -> tuple[float, float]:
    """Return the times, s, at two fractions of the total Arias intensity, or NaN if zero."""
    cumulated = np.append(0.0, np.cumsum(_energy(motion.coefficients, np.diff(motion.breakpoints))))
    if cumulated[-1] == 0.0:
        return math.nan, math.nan
    return _time_at(motion, cumulated, start), _time_at(motion, cumulated, end)


def _energy(coefficients: Floats, span: Floats) -> Floats:
    """Integrate the squared polynomial from 0 to `span`, exactly, by Gauss's rule with degree + 1 points."""
    nodes, weights = np.polynomial.legendre.leggauss(coefficients.shape[-1])
    values = piecewise.value(coefficients[..., np.newaxis, :], 0.5 * span[..., np.newaxis] * (nodes + 1.0))
    energy: Floats = 0.5 * span * (values**2 @ weights)
    return energy


def _time_at(motion: Measured, cumulated: Floats, fraction: float) -> float:
    """Find by bisection within a piece the first time at a fraction of the total energy."""
    wanted = fraction * cumulated[-1]
    piece = max(int(np.searchsorted(cumulated, wanted, side="left")) - 1, 0)
    start, end = motion.breakpoints[piece : piece + 2]

    def is_reached(span: float) -> bool:
        return bool(cumulated[piece] + _energy(motion.coefficients[piece], np.asarray(span)) >= wanted)

    return float(start + bisected(0.0, end - start, is_reached, halvings=53)[1])
