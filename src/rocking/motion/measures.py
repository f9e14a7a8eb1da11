"""Kinematics and intensity measures of a motion, from exact integrals of its pieces."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.bisection import bisect
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.tables import add_unit
from rocking.errors import MotionError
from rocking.motion import piecewise

#: Default damping of a spectral acceleration.
DEFAULT_DAMPING: Final = 0.05


def check_damping(value: object, error: checks.ErrorFactory) -> float:
    """Return a damping ratio, or raise `error`."""
    ratio = checks.real(value, "damping", error)
    if not 0.0 <= ratio < 1.0:
        raise error(f"{{}} must be a fraction of critical from 0 to below 1, not {ratio:g}", "damping", value=value)
    return ratio


class MotionMeasures:
    """Kinematics and intensity measures of the horizontal component."""

    breakpoints: Floats
    coefficients: Floats
    name: str

    @property
    def other_horizontal(self) -> MotionMeasures | None:
        """Orthogonal horizontal component, if any."""
        return getattr(self, "orthogonal", None)

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
        return piecewise.sample_breakpoints(self)[1]

    @property
    def has_jumps(self) -> bool:
        """Whether the acceleration jumps between pieces, beyond rounding."""
        return piecewise.has_jumps(self)

    def _compute_widths(self) -> Floats:
        return np.diff(self.breakpoints)

    def _compute_velocity(self) -> Floats:
        """Compute the coefficients of the ground velocity on each piece."""
        return piecewise.integrate_pieces(self._compute_widths(), self.coefficients)

    def _compute_displacement(self) -> Floats:
        """Compute the coefficients of the ground displacement on each piece."""
        return piecewise.integrate_pieces(self._compute_widths(), self._compute_velocity())

    def acceleration(self, time: ArrayLike) -> Any:
        """Return the ground acceleration at times (s), m/s^2, shaped like `time` and zero outside the motion."""
        times = checks.numbers(time, "time", MotionError)
        result = piecewise.evaluate_at(self.breakpoints, self.coefficients, times)
        return _unwrap_float(np.where((times < 0.0) | (times > self.duration), 0.0, result))

    def velocity(self, time: ArrayLike) -> Any:
        """Return the ground velocity at times (s), m/s, from rest, constant after the end of the motion."""
        times = checks.numbers(time, "time", MotionError)
        return _unwrap_float(piecewise.evaluate_at(self.breakpoints, self._compute_velocity(), times))

    def displacement(self, time: ArrayLike) -> Any:
        """Return the ground displacement at times (s), m, from rest, with the last velocity after the end."""
        times = checks.numbers(time, "time", MotionError)
        result = piecewise.evaluate_at(self.breakpoints, self._compute_displacement(), times)
        return _unwrap_float(result + self.velocity(self.duration) * np.maximum(times - self.duration, 0.0))

    @property
    def extremes(self) -> tuple[float, float]:
        """Exact lowest and highest acceleration with their signs, m/s^2."""
        widths, maximum = self._compute_widths(), piecewise.compute_maximum
        return -maximum(widths, -self.coefficients), maximum(widths, self.coefficients)

    @property
    def pga(self) -> float:
        """Exact peak ground acceleration, m/s^2."""
        return piecewise.compute_peak_magnitude(self._compute_widths(), self.coefficients)

    @property
    def pgv(self) -> float:
        """Exact peak ground velocity from rest, m/s."""
        return piecewise.compute_peak_magnitude(self._compute_widths(), self._compute_velocity())

    @property
    def pgd(self) -> float:
        """Exact peak ground displacement until the end of the motion, m."""
        return piecewise.compute_peak_magnitude(self._compute_widths(), self._compute_displacement())

    @property
    def arias_intensity(self) -> float:
        """Arias intensity, m/s: ``pi/(2 g)`` times the exact integral of the squared acceleration."""
        return (
            math.pi
            / (2.0 * STANDARD_GRAVITY)
            * float(np.sum(_integrate_square(self.coefficients, self._compute_widths())))
        )

    def _integrate_between_signs(self) -> Floats:
        """Integrate the acceleration over intervals in which its sign is constant, located within pieces, m/s."""
        widths = self._compute_widths()
        integral = self._compute_velocity()[:, np.newaxis, :]
        roots = piecewise.find_root_candidates(widths, self.coefficients)
        cuts = np.hstack([np.zeros((len(widths), 1)), roots, widths[:, np.newaxis]])
        # Adding the integral's start value would only lose digits.
        integral[..., 0] = 0.0
        return np.asarray(np.diff(piecewise.evaluate_pieces(integral, cuts), axis=1))

    @property
    def cumulative_absolute_velocity(self) -> float:
        """Exact integral of the absolute acceleration, m/s, with sign changes located within pieces."""
        return float(np.sum(np.abs(self._integrate_between_signs())))

    @property
    def incremental_velocity(self) -> float:
        """Largest exact change of the ground velocity between two sign changes of the acceleration, m/s."""
        changes = self._integrate_between_signs().ravel()
        changes = changes[changes != 0.0]
        starts = np.flatnonzero(np.diff(np.sign(changes), prepend=0.0))
        return float(np.max(np.abs(np.add.reduceat(changes, starts)))) if len(starts) else 0.0

    def significant_duration(self, start: float = 0.05, end: float = 0.95) -> float:
        """Return the time between two fractions of the Arias intensity, s, or NaN if the intensity is zero.

        Raises `MotionError` unless ``0 <= start < end <= 1``.
        """
        start, end = (checks.finite(value, "ends of a significant duration", MotionError) for value in (start, end))
        if not 0.0 <= start < end <= 1.0:
            message = f"a significant duration requires 0 <= {{}} < {{}} <= 1; got {start:g} and {end:g}"
            raise MotionError(message, "start", "end", value=(start, end))
        start_time, end_time = compute_significant_span(self, start, end)
        return end_time - start_time

    def spectral_acceleration(self, period: ArrayLike, damping: float = DEFAULT_DAMPING) -> Any:
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
        MotionError
            If a period is not positive and finite, or below a millionth of the duration (use `pga`), or the damping is
            out of range.
        """
        from rocking.kernels import oscillator  # imported on first use because it loads the library

        periods = checks.numbers(period, "period of a spectral acceleration", MotionError)
        if not np.all(np.isfinite(periods) & (periods > 0.0)):
            raise MotionError("the {} of a spectral acceleration must be a positive number of seconds", "period")
        duration_text = f"the duration, {self.duration:.6g} s"
        if np.any(periods < 1e-6 * self.duration):
            message = f"a {{}} shorter than one millionth of {duration_text}, would take too long to compute; use pga"
            raise MotionError(message, "period")
        if np.any(periods > 1e6 * self.duration):
            message = f"a {{}} longer than one million times {duration_text}, gives only the displacement; use pgd"
            raise MotionError(message, "period")
        ratio, frequencies = check_damping(damping, MotionError), np.ravel(2.0 * np.pi / periods)
        peaks, workspace = np.empty_like(frequencies), np.empty(2 * self.coefficients.shape[1] + oscillator.TERMS)
        oscillator.write_peak_displacements(self.breakpoints, self.coefficients, frequencies, ratio, workspace, peaks)
        return _unwrap_float((frequencies**2 * peaks).reshape(periods.shape))

    def measures(self, periods: Sequence[float] = ()) -> dict[str, float]:
        """Return intensity measures in SI units by name, which ends in the unit.

        Spectral accelerations (5 % damping) are added for `periods`, s.
        """
        units = {"duration": "s", "pga": "m/s^2", "pgv": "m/s", "pgd": "m", "arias_intensity": "m/s"}
        units["cumulative_absolute_velocity"] = "m/s"
        values = {add_unit(name, unit): getattr(self, name) for name, unit in units.items()}
        for percent in (75, 95):
            duration = self.significant_duration(0.05, percent / 100.0)
            values[add_unit(f"significant_duration_5_{percent}", "s")] = duration
        for period in np.ravel(checks.numbers(periods, "periods of a spectral acceleration", MotionError)).tolist():
            values[add_unit(f"spectral_acceleration_{period:g}s", "m/s^2")] = self.spectral_acceleration(period)
        return values


def _unwrap_float(values: Floats) -> Any:
    """Return a float for an array without dimensions, else the array."""
    return values if values.ndim else float(values)


def compute_significant_span(motion: MotionMeasures, start: float = 0.05, end: float = 0.95) -> tuple[float, float]:
    """Return the times, s, at two fractions of the total Arias intensity, or NaN if zero."""
    energy = np.append(0.0, np.cumsum(_integrate_square(motion.coefficients, np.diff(motion.breakpoints))))
    if energy[-1] == 0.0:
        return math.nan, math.nan
    return _compute_time_at_energy(motion, energy, start), _compute_time_at_energy(motion, energy, end)


@functools.cache
def _compute_gauss_rule(count: int) -> tuple[Floats, Floats]:
    """Return nodes and weights of Gauss's rule."""
    return np.polynomial.legendre.leggauss(count)


def _integrate_square(coefficients: Floats, widths: Floats) -> Floats:
    """Integrate the squared polynomials over their widths, exactly, by Gauss's rule with degree + 1 points."""
    nodes, weights = _compute_gauss_rule(coefficients.shape[-1])
    values = piecewise.evaluate_pieces(coefficients[..., np.newaxis, :], 0.5 * widths[..., np.newaxis] * (nodes + 1.0))
    energy: Floats = 0.5 * widths * (values**2 @ weights)
    return energy


def _compute_time_at_energy(motion: MotionMeasures, energy: Floats, fraction: float) -> float:
    """Find the first time at a fraction of the total of the cumulative energy, by bisection within a piece."""
    target = fraction * energy[-1]
    piece = max(int(np.searchsorted(energy, target, side="left")) - 1, 0)
    start, end = motion.breakpoints[piece : piece + 2]

    def is_reached(span: float) -> bool:
        return bool(energy[piece] + _integrate_square(motion.coefficients[piece], np.asarray(span)) >= target)

    return float(start + bisect(0.0, end - start, is_reached, halvings=53)[1])
