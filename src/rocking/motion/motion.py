"""Ground motions: a horizontal ground acceleration that is a piecewise polynomial in time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.constants import HIGHEST_DEGREE
from rocking.errors import InvalidMotion
from rocking.motion import measures, piecewise, processing

# Far beyond any ground motion, and far enough from overflow for the squares and integrals that measures take.
_STRONGEST: Final = 1e50
_LONGEST: Final = 1e15
#: Far below any ground motion; pieces may be shorter, but must not change faster than over this time.
_SHORTEST: Final = 1e-9
#: Pieces that meet within this part of the peak acceleration do not jump.
_JUMP: Final = 1e-12
#: Even breakpoints are off their grid by no more than this part of the duration, some units in its last place.
_ROUNDING: Final = 4.0 * np.finfo(np.float64).eps


@dataclass(frozen=True)
class Description:
    """How a motion was made.

    Attributes
    ----------
    family : str
        Kind of motion: "record", "samples", "sine", "symmetric Ricker", ... After a delay or processing it says so
        ("delayed sine", "processed record"), since the formula of `text` then no longer starts at time zero.
    parameters : mapping of str to float
        Numbers of the formula in SI units and radians, for instance amplitude, frequency, phase and cycles of
        a sine. Scaling a motion scales every parameter whose name starts with "amplitude" (and may make it
        negative).
    text : str
        The formula, or the record's source and terms, in words.
    """

    family: str
    parameters: Mapping[str, float] = field(default_factory=dict)
    text: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

    def __reduce__(self) -> tuple[Any, ...]:
        return Description, (self.family, dict(self.parameters), self.text)

    def scaled(self, factor: float) -> Description:
        """Return the description of the motion times `factor`."""
        parameters = {k: v * factor if k.startswith("amplitude") else v for k, v in self.parameters.items()}
        return replace(self, parameters=parameters)

    def changed(self, how: str) -> Description:
        """Return the description of a motion that was `how` ("delayed", "processed") off its formula."""
        family = self.family if self.family.startswith(f"{how} ") else f"{how} {self.family}"
        return replace(self, family=family)


@dataclass(frozen=True, eq=False)
class Motion:
    """A ground acceleration that is a polynomial on each of its pieces, and zero outside ``[0, duration]``.

    Pieces may jump. A record is piecewise linear, exactly; a pulse is approximated to 1e-15 of its amplitude.
    Usually made by `from_samples`, `from_points`, `rocking.pulses`, `rocking.records` or `rocking.read`.

    Parameters
    ----------
    breakpoints : array_like, shape (n + 1,)
        Ends of the pieces, s; strictly increasing, the first is 0.
    coefficients : array_like, shape (n, degree + 1)
        m/s^2, m/s^3, ...: the acceleration on piece k is ``sum_j coefficients[k, j] * (t - breakpoints[k])**j``.
    name : str
        Short name for tables and figures.
    description : Description
        How the motion was made.
    history : tuple of str
        What was done to it since, one sentence each.
    error : float
        Bound on the difference from the motion that `description` describes, m/s^2, beyond the rounding of
        breakpoints and coefficients; 0 where the pieces are the motion itself (records).

    Attributes
    ----------
    step : float or None
        Sampling step if all pieces are straight lines and equally long, s; it follows from them. Neighbouring lines may
        jump.

    Raises
    ------
    InvalidMotion
        If the arrays do not describe a piecewise polynomial, its degree is above 20, or a number is beyond all sense
        (accelerations of 1e50 m/s^2, also where a piece would last 1e-9 s; durations below 1e-9 s or above 1e15 s).

    Examples
    --------
    >>> motion = Motion([0.0, 1.0, 3.0], [[2.0, -1.0], [-1.0, 0.5]], name="kink")
    >>> motion.duration, motion.pga
    (3.0, 2.0)
    >>> motion.acceleration([0.5, 1.0, 2.0, 9.0])
    array([ 1.5, -1. , -0.5,  0. ])
    """

    breakpoints: Floats
    coefficients: Floats
    name: str = "motion"
    description: Description = field(default_factory=lambda: Description("polynomials"))
    history: tuple[str, ...] = ()
    error: float = 0.0
    step: float | None = field(init=False)

    def __post_init__(self) -> None:
        breakpoints = _frozen_floats(self.breakpoints, "breakpoints", 1)
        coefficients = _frozen_floats(self.coefficients, "coefficients", 2)
        if len(breakpoints) < 2 or coefficients.shape[0] != len(breakpoints) - 1 or coefficients.shape[1] == 0:
            raise InvalidMotion(
                f"a motion of n pieces needs n + 1 breakpoints and coefficients of shape (n, degree + 1), "
                f"not {breakpoints.shape} and {coefficients.shape}"
            )
        if breakpoints[0] != 0.0 or not np.all(np.diff(breakpoints) > 0.0):
            raise InvalidMotion("the breakpoints of a motion must start at 0 and increase strictly")
        if coefficients.shape[1] > HIGHEST_DEGREE + 1:
            raise InvalidMotion(
                f"the pieces of a motion must be of degree {HIGHEST_DEGREE} or less, not {coefficients.shape[1] - 1}: "
                "split them into shorter ones of a lower degree"
            )
        if not _SHORTEST <= breakpoints[-1] <= _LONGEST:
            raise InvalidMotion(
                f"a motion must last from {_SHORTEST:g} to {_LONGEST:g} s, not {breakpoints[-1]:g} s: check its units"
            )
        with np.errstate(over="ignore"):
            bounds = piecewise.value(np.abs(coefficients), np.maximum(np.diff(breakpoints), _SHORTEST))
        if not np.all(bounds <= _STRONGEST):
            raise InvalidMotion(
                f"a motion must stay below {_STRONGEST:g} m/s^2 on all its pieces, and where they are shorter than "
                f"{_SHORTEST:g} s so long: check its units"
            )
        error = checks.finite(self.error, "approximation error of a motion", InvalidMotion)
        if error < 0.0:
            raise InvalidMotion(f"approximation error of a motion must not be negative, not {error:g}")
        object.__setattr__(self, "breakpoints", breakpoints)
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "history", tuple(self.history))
        object.__setattr__(self, "error", error)
        object.__setattr__(self, "step", _even_step(breakpoints, coefficients))

    def __reduce__(self) -> tuple[Any, ...]:
        # Through the constructor, which makes the arrays read-only again.
        fields = (
            self.breakpoints,
            self.coefficients,
            self.name,
            self.description,
            self.history,
            self.error,
        )
        return Motion, fields

    @classmethod
    def from_samples(
        cls,
        acceleration: ArrayLike,
        dt: float,
        *,
        name: str = "samples",
        description: Description | None = None,
    ) -> Motion:
        """Motion that is linear between evenly spaced samples.

        Parameters
        ----------
        acceleration : array_like, shape (n,)
            Ground acceleration, m/s^2, n >= 2; the first sample is at time 0.
        dt : float
            Sampling step, s, from 1e-9 to 1e9.
        name : str
            Short name for tables and figures.
        description : Description, optional
            Where the samples come from.

        Raises
        ------
        InvalidMotion
            If there are fewer than two samples, one of them is not finite, or `dt` is not a number in its range.

        Examples
        --------
        >>> motion = Motion.from_samples([0.0, 1.0, -2.0, 0.0], 0.02)
        >>> motion.duration, motion.pga
        (0.06, 2.0)
        """
        samples = _samples(acceleration)
        step = _step(dt)
        times = piecewise.even_times(len(samples), step)
        return cls(
            times,
            piecewise.linear(times, samples),
            name=name,
            description=description or Description("samples", text="linear between even samples"),
        )

    @classmethod
    def from_points(
        cls,
        times: ArrayLike,
        acceleration: ArrayLike,
        *,
        name: str = "points",
        description: Description | None = None,
    ) -> Motion:
        """Motion that is linear between points at uneven times.

        Parameters
        ----------
        times : array_like, shape (n,)
            Strictly increasing, s; the motion's time is counted from the first.
        acceleration : array_like, shape (n,)
            Ground acceleration at these times, m/s^2, n >= 2.
        name : str
            Short name for tables and figures.
        description : Description, optional
            Where the points come from.

        Raises
        ------
        InvalidMotion
            If the two lengths differ, there are fewer than two points, a number is not finite, or the times
            do not increase strictly.

        Examples
        --------
        >>> Motion.from_points([0.0, 1.0, 5.0], [0.0, 3.0, 0.0]).acceleration(3.0)
        1.5
        """
        samples = _samples(acceleration)
        instants = _floats(times, "times", 1)
        if len(instants) != len(samples):
            raise InvalidMotion(f"there are {len(instants)} times but {len(samples)} accelerations: give one for each")
        if not np.all(np.isfinite(instants)) or not np.all(np.diff(instants) > 0.0):
            raise InvalidMotion("the times of a motion must be finite and increase strictly")
        with np.errstate(over="ignore"):
            breakpoints = instants - instants[0]
        return cls(
            breakpoints,
            piecewise.linear(breakpoints, samples),
            name=name,
            description=description or Description("points", text="linear between uneven points"),
        )

    @property
    def duration(self) -> float:
        """Time of the last breakpoint, s; the acceleration is zero after it."""
        return float(self.breakpoints[-1])

    @property
    def samples(self) -> tuple[Floats, Floats]:
        """Times (s) and accelerations (m/s^2) at the breakpoints; at a jump, the acceleration after it."""
        last = piecewise.value(self.coefficients[-1], np.diff(self.breakpoints)[-1])
        return self.breakpoints, np.append(self.coefficients[:, 0], last)

    @property
    def jumps(self) -> bool:
        """Whether the acceleration jumps from a piece to the next, beyond rounding; ends of the motion do not count."""
        ends = piecewise.value(self.coefficients, np.diff(self.breakpoints))
        gaps = np.abs(self.coefficients[1:, 0] - ends[:-1])
        return bool(np.any(gaps > _JUMP * self.pga))

    @property
    def pga(self) -> float:
        """Peak ground acceleration, m/s^2: the exact extremum of the pieces."""
        return piecewise.largest_magnitude(np.diff(self.breakpoints), self.coefficients)

    @property
    def pgv(self) -> float:
        """Peak ground velocity, m/s: the exact extremum of the exact integral, from rest."""
        return piecewise.largest_magnitude(np.diff(self.breakpoints), self._velocity_pieces())

    @property
    def pgd(self) -> float:
        """Peak ground displacement up to the motion's end, m: the exact extremum of the exact integral."""
        return piecewise.largest_magnitude(np.diff(self.breakpoints), self._displacement_pieces())

    @overload
    def acceleration(self, t: float) -> float: ...
    @overload
    def acceleration(self, t: Sequence[float] | NDArray[Any]) -> Floats: ...
    def acceleration(self, t: float | Sequence[float] | NDArray[Any]) -> float | Floats:
        """Ground acceleration, m/s^2, at the times `t` (s) and shaped like it; zero outside the motion."""
        time = np.asarray(t, dtype=np.float64)
        result = piecewise.at(self.breakpoints, self.coefficients, time)
        result = np.where((time < 0.0) | (time > self.duration), 0.0, result)
        return result if result.ndim else float(result)

    @overload
    def velocity(self, t: float) -> float: ...
    @overload
    def velocity(self, t: Sequence[float] | NDArray[Any]) -> Floats: ...
    def velocity(self, t: float | Sequence[float] | NDArray[Any]) -> float | Floats:
        """Ground velocity at the times `t` (s), m/s, from rest; constant after the end of the motion."""
        result = piecewise.at(self.breakpoints, self._velocity_pieces(), np.asarray(t, dtype=np.float64))
        return result if result.ndim else float(result)

    @overload
    def displacement(self, t: float) -> float: ...
    @overload
    def displacement(self, t: Sequence[float] | NDArray[Any]) -> Floats: ...
    def displacement(self, t: float | Sequence[float] | NDArray[Any]) -> float | Floats:
        """Ground displacement at the times `t` (s), m, from rest; after the end at the last velocity."""
        time = np.asarray(t, dtype=np.float64)
        result = piecewise.at(self.breakpoints, self._displacement_pieces(), time)
        result = result + self.velocity(self.duration) * np.maximum(time - self.duration, 0.0)
        return result if result.ndim else float(result)

    @property
    def arias_intensity(self) -> float:
        """Arias intensity, m/s: ``pi/(2 g)`` times the exact integral of the squared acceleration."""
        return measures.arias_intensity(self)

    @property
    def cumulative_absolute_velocity(self) -> float:
        """Integral of the absolute acceleration, m/s; exact, changes of sign within a piece are located."""
        return measures.cumulative_absolute_velocity(self)

    def significant_duration(self, start: float = 0.05, end: float = 0.95) -> float:
        """Time between the fractions `start` and `end` of the Arias intensity, s; NaN if that is zero.

        Raises
        ------
        InvalidMotion
            If not ``0 <= start < end <= 1``.

        Examples
        --------
        >>> round(Motion([0.0, 2.0], [[1.0]]).significant_duration(0.05, 0.75), 12)
        1.4
        """
        return measures.significant_duration(self, start, end)

    @overload
    def spectral_acceleration(self, period: float, damping: float = ...) -> float: ...
    @overload
    def spectral_acceleration(self, period: Sequence[float] | NDArray[Any], damping: float = ...) -> Floats: ...
    def spectral_acceleration(
        self, period: float | Sequence[float] | NDArray[Any], damping: float = 0.05
    ) -> float | Floats:
        """Pseudo-spectral acceleration: ``(2 pi/period)**2`` times an oscillator's peak displacement, m/s^2.

        The linear oscillator starts from rest and is followed through the motion and the first extremum after
        it. Its response on each piece is the Taylor series of the exact solution, to rounding, for records
        and pulses alike; extrema between samples are located.

        Parameters
        ----------
        period : float or array_like
            Undamped period, s.
        damping : float
            Fraction of critical damping, from 0 to below 1.

        Raises
        ------
        InvalidMotion
            If a period is not positive and finite or below a millionth of the duration (take `pga` there), or
            the damping is out of range.

        Examples
        --------
        An undamped oscillator under a long step of acceleration: twice the static response.

        >>> round(Motion([0.0, 2.0], [[1.0]]).spectral_acceleration(1.0, 0.0), 12)
        2.0
        """
        return measures.spectral_acceleration(self, period, damping)

    def measures(self, periods: Sequence[float] = ()) -> dict[str, float]:
        """Intensity measures by name; each name ends in its unit, as in ``"pga_m_s2"``.

        Spectral accelerations (5 % damping) at `periods` (s) are added under names as
        ``"spectral_acceleration_0.5s_m_s2"``.
        """
        return measures.table(self, periods)

    def scaled(
        self,
        factor: float | None = None,
        *,
        pga: float | None = None,
        pgv: float | None = None,
        sa: float | None = None,
        period: float | None = None,
        damping: float = 0.05,
    ) -> Motion:
        """Return the motion times a factor, or scaled to a target; give exactly one of the first four.

        Parameters
        ----------
        factor : float
            Factor on the acceleration; a negative one reverses the polarity.
        pga, pgv : float
            Wanted peak acceleration (m/s^2) or velocity (m/s).
        sa : float
            Wanted spectral acceleration (m/s^2) at `period` (s) and `damping`.
        period, damping : float
            Oscillator for `sa`.

        Raises
        ------
        InvalidMotion
            If not exactly one target is given, a target is not positive, or the motion is zero throughout.

        Examples
        --------
        >>> Motion([0.0, 2.0], [[1.0]]).scaled(pga=3.0).coefficients
        array([[3.]])
        """
        targets = {"factor": factor, "pga": pga, "pgv": pgv, "sa": sa}
        given = [(what, target) for what, target in targets.items() if target is not None]
        if len(given) != 1:
            raise InvalidMotion("scale a motion by exactly one of factor, pga, pgv and sa (with period)")
        if (sa is None) != (period is None):
            raise InvalidMotion("scaling to a spectral acceleration needs both sa and period")
        what, target = given[0]
        if what == "factor":
            return self._times(checks.finite(target, "scale factor", InvalidMotion), f"scaled by {target:.6g}")
        now = measures.target(self, what, period, damping)
        if now == 0.0:
            raise InvalidMotion(f"{self.name} is zero throughout and cannot be scaled to a {what}")
        ratio = checks.positive(target, f"target {what}", InvalidMotion, "m/s" if what == "pgv" else "m/s^2") / now
        at_period = f" at {period:.6g} s, damping {damping:.6g}" if what == "sa" else ""
        return self._times(ratio, f"scaled by {ratio:.6g} to a {what} of {target:.6g}{at_period}")

    def delayed(self, delay: float) -> Motion:
        """Return the motion after `delay` seconds of no acceleration.

        Raises
        ------
        InvalidMotion
            If `delay` is not a positive number (an early part is cut off by ``processed(trim=...)``).

        Examples
        --------
        >>> Motion([0.0, 2.0], [[1.0]]).delayed(1.0).acceleration([0.5, 1.5, 3.5])
        array([0., 1., 0.])
        """
        wait = checks.positive(delay, "delay", InvalidMotion, "s")
        return replace(
            self,
            breakpoints=np.concatenate([[0.0], self.breakpoints + wait]),
            coefficients=np.vstack([np.zeros((1, self.coefficients.shape[1])), self.coefficients]),
            description=self.description.changed("delayed"),
            history=(*self.history, f"delayed by {wait:.6g} s"),
        )

    def processed(
        self,
        *,
        trim: tuple[float, float] | None = None,
        baseline: int | None = None,
        band_pass: tuple[float | None, float | None] | None = None,
        order: int = 4,
        resample: float | None = None,
    ) -> Motion:
        """Return a processed motion; the steps go in the order of the arguments, each noted in `history`.

        Parameters
        ----------
        trim : (start, end)
            Part to keep, s; its start becomes time 0. For even samples the ends move to the nearest sample.
        baseline : int
            Degree of the polynomial in time that is fitted to the samples by least squares and subtracted.
        band_pass : (low, high)
            Corner frequencies of a Butterworth filter, Hz, run forwards and backwards (no phase shift) with
            zeros added before and after and removed again; None leaves that side open.
        order : int
            Order of the filter in each direction.
        resample : float
            New sampling step, s: the motion's values at its multiples, joined by straight lines; a jump becomes a
            slope of one step. To a coarser step, remove what lies above its Nyquist frequency with `band_pass`.

        Raises
        ------
        InvalidMotion
            If nothing is asked for, an argument is not usable, or `baseline` or `band_pass` is asked of a
            motion that is not linear between even samples, or jumps (resample it first, in a call of its own).

        Examples
        --------
        >>> record = Motion.from_samples([1.0, 2.0, 1.0, 0.0, 1.0], 0.5)
        >>> done = record.processed(trim=(0.5, 2.0), baseline=0)
        >>> done.samples[1]
        array([ 1.,  0., -1.,  0.])
        >>> done.history
        ('trimmed to 0.5-2 s', 'baseline of degree 0 removed')
        """
        steps: list[Callable[[Motion], Motion]] = []
        if trim is not None:
            start, end = processing.pair(trim, "trim=(start, end)")
            steps.append(lambda motion: processing.trim(motion, start, end))
        if baseline is not None:
            steps.append(lambda motion: processing.baseline(motion, baseline))
        if band_pass is not None:
            low, high = processing.pair(band_pass, "band_pass=(low, high)")
            steps.append(lambda motion: processing.band_pass(motion, low, high, order=order))
        if resample is not None:
            steps.append(lambda motion: processing.resample(motion, resample))
        if not steps:
            raise InvalidMotion("name what to do: trim, baseline, band_pass or resample")
        motion = self
        for step in steps:
            motion = step(motion)
        return motion

    def __neg__(self) -> Motion:
        """Return the motion with its polarity reversed."""
        return self._times(-1.0, "polarity reversed")

    def __add__(self, other: Motion) -> Motion:
        """Return the sum of two motions that start together."""
        if not isinstance(other, Motion):
            return NotImplemented
        breakpoints = np.union1d(self.breakpoints, other.breakpoints)
        degree = max(self.coefficients.shape[1], other.coefficients.shape[1])
        mine, theirs = (
            piecewise.refined(motion.breakpoints, motion.coefficients, breakpoints, degree) for motion in (self, other)
        )
        return Motion(
            breakpoints,
            mine + theirs,
            name=f"{self.name} + {other.name}",
            description=Description("sum", text=f"{self._origin()}; plus {other._origin()}"),
            error=self.error + other.error,
        )

    def _origin(self) -> str:
        """Return name, parameters, formula and history in one line, for the description of a sum."""
        numbers = ", ".join(f"{k} {v:.6g}" for k, v in self.description.parameters.items())
        parts = (self.name, self.description.family, numbers, self.description.text, *self.history)
        return ", ".join(part for part in parts if part)

    def _times(self, factor: float, what: str) -> Motion:
        with np.errstate(over="ignore"):
            coefficients = self.coefficients * factor
        return replace(
            self,
            coefficients=coefficients,
            description=self.description.scaled(factor),
            history=(*self.history, what),
            error=self.error * abs(factor),
        )

    def _velocity_pieces(self) -> Floats:
        return piecewise.antiderivative(np.diff(self.breakpoints), self.coefficients)

    def _displacement_pieces(self) -> Floats:
        return piecewise.antiderivative(np.diff(self.breakpoints), self._velocity_pieces())


def _even_step(breakpoints: Floats, coefficients: Floats) -> float | None:
    """Length of the pieces if they are equally long and straight lines, else None."""
    if coefficients.shape[1] < 2 or np.any(coefficients[:, 2:]):
        return None
    step = float(breakpoints[1])
    off = np.abs(breakpoints - piecewise.even_times(len(breakpoints), step))
    return step if np.all(off <= _ROUNDING * breakpoints[-1]) else None


def _floats(values: ArrayLike, what: str, dimensions: int) -> Floats:
    array = np.array(checks.numbers(values, f"{what} of a motion", InvalidMotion), order="C")
    if array.ndim != dimensions:
        raise InvalidMotion(f"the {what} of a motion must have {dimensions} dimension(s), not {array.ndim}")
    return array


def _frozen_floats(values: ArrayLike, what: str, dimensions: int) -> Floats:
    array = _floats(values, what, dimensions)
    if not np.all(np.isfinite(array)):
        raise InvalidMotion(f"the {what} of a motion must be finite numbers")
    array.setflags(write=False)
    return array


def _samples(acceleration: ArrayLike) -> Floats:
    samples = _floats(acceleration, "accelerations", 1)
    if len(samples) < 2:
        raise InvalidMotion(f"a motion needs at least two samples, not {len(samples)}")
    bad = np.flatnonzero(~np.isfinite(samples))
    if len(bad):
        raise InvalidMotion(f"sample {bad[0]} of the motion is {samples[bad[0]]}: every sample must be a finite number")
    return samples


def _step(dt: float) -> float:
    if np.ndim(dt) != 0:
        raise InvalidMotion("dt must be one number; for uneven times use Motion.from_points(times, acceleration)")
    step = checks.positive(dt, "sampling step dt", InvalidMotion, "s")
    return checks.within(step, "sampling step dt", InvalidMotion, _SHORTEST, 1.0 / _SHORTEST, "s: check its units")
