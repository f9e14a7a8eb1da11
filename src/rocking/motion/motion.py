"""Ground motion: piecewise polynomial horizontal and optional vertical acceleration."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Flags, Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.tables import escape_dollars
from rocking.errors import MotionError, escape_braces
from rocking.motion import piecewise
from rocking.motion.description import Description, Origin, compute_start_delay, create_label
from rocking.motion.processing import ProcessingMethods
from rocking.motion.scaling import FACTOR, SCALING_MEASURES, Measure, MeasureName

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Motion(ProcessingMethods):
    """Piecewise polynomial ground acceleration, zero outside ``[0, duration]``.

    Pieces may jump. Records are exactly piecewise linear, and pulses are approximated to 1e-15 of their amplitude.
    Usual constructors are `from_samples`, `from_points`, `rocking.pulses`, `rocking.records` and `rocking.read`.

    Parameters
    ----------
    breakpoints : array_like, shape (n + 1,)
        Ends of the pieces, s, strictly increasing from 0.
    coefficients : array_like, shape (n, degree + 1)
        m/s^2, m/s^3, ...: the acceleration on piece k is ``sum_j coefficients[k, j] * (t - breakpoints[k])**j``.
    name : str
        Short name for tables and figures.
    description : Description
        Origin of the motion.
    history : tuple of str
        Later changes to the motion, one sentence each.
    error : float
        Bound on the difference from the motion in `description`, m/s^2, beyond rounding of breakpoints and
        coefficients, or 0 if the pieces are the motion itself (records).
    vertical : Motion, optional
        Vertical ground acceleration over the same time, positive upwards (see `with_vertical`).
    orthogonal : Motion, optional
        Other horizontal component, for intensity measures of the pair (see `with_orthogonal`).

    Attributes
    ----------
    dt : float or None
        Sampling step, s, if all pieces are straight lines of equal length.

    Raises
    ------
    MotionError
        If the arrays have incompatible shapes, invalid breakpoints or numbers that are not finite, if the degree is
        above 20, or if the motion exceeds the supported range: durations from 1e-9 to 1e15 s, and accelerations up to
        1e30 m/s^2, also of pieces extended to 1e-9 s.

    See Also
    --------
    rocking.read : read a motion from a record file.
    rocking.records.load : load a shipped record.
    rocking.Measure : intensity measure for scaling.

    Examples
    --------
    >>> motion = Motion([0.0, 1.0, 3.0], [[2.0, -1.0], [-1.0, 0.5]], name="kink")
    >>> motion.duration, motion.pga
    (3.0, 2.0)
    """

    breakpoints: Floats
    coefficients: Floats
    name: str = "motion"
    description: Description = field(default_factory=lambda: Description("polynomials"))
    history: tuple[str, ...] = ()
    error: float = 0.0
    vertical: Motion | None = None
    orthogonal: Motion | None = None
    dt: float | None = field(init=False)

    def __post_init__(self) -> None:
        breakpoints, coefficients = piecewise.check_pieces(self.breakpoints, self.coefficients)
        checks.text(self.name, "name of a motion", MotionError)
        if not isinstance(self.description, Description):
            type_name = type(self.description).__name__
            message = f"the description of a motion must be a Description(family, parameters, text), not a {type_name}"
            raise MotionError(message, value=self.description)
        if isinstance(self.history, str) or not isinstance(self.history, Iterable):
            message = f"the history of a motion must be a sequence of sentences, not {self.history!r}"
            raise MotionError(message, value=self.history)
        history = tuple(checks.text(entry, "sentence of a motion's history", MotionError) for entry in self.history)
        error_name = "approximation error of a motion"
        error = checks.between(self.error, error_name, MotionError, 0.0, piecewise.MAX_ACCELERATION)
        for component, part in self._collect_other_components().items():
            if part is not None and not isinstance(part, Motion):
                message = "{} must be a Motion, as from rocking.read or Motion.from_samples, not "
                raise MotionError(message + type(part).__name__, component, value=part)
            if part is not None and (part.vertical is not None or part.orthogonal is not None):
                kind = "a vertical component" if component == "vertical" else "components"
                raise MotionError(f"{{}} must be a motion without {kind} of its own", component)
        checked_fields = {"breakpoints": breakpoints, "coefficients": coefficients, "history": history, "error": error}
        for name, value in checked_fields.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "dt", piecewise.find_even_step(self))

    def __reduce__(self) -> tuple[Any, ...]:
        # The constructor makes the arrays read-only again.
        return Motion, tuple(getattr(self, parameter.name) for parameter in fields(self) if parameter.init)

    @classmethod
    def from_samples(
        cls, acceleration: ArrayLike, dt: float, *, name: str = "samples", description: Description | None = None
    ) -> Motion:
        """Create a motion that is linear between evenly spaced samples.

        Parameters
        ----------
        acceleration : array_like, shape (n,)
            Ground acceleration, m/s^2, n >= 2, from time 0.
        dt : float
            Sampling step, s, from 1e-9 to 1e9.
        name, description : str, Description, optional
            As for `Motion`.

        Returns
        -------
        Motion
            Motion with n - 1 pieces.

        Raises
        ------
        MotionError
            If there are fewer than two samples, a sample is not finite, or `dt` is not a number within its range.

        See Also
        --------
        rocking.Motion.from_points : create a motion from uneven samples.

        Examples
        --------
        >>> motion = Motion.from_samples([0.0, 1.0, -2.0, 0.0], 0.02)
        >>> motion.duration, motion.pga
        (0.06, 2.0)
        """
        samples, step = piecewise.check_samples(acceleration), piecewise.check_step(dt)
        times = piecewise.create_even_times(len(samples), step)
        description = description or Description("samples", text="linear between even samples")
        return cls(times, piecewise.join_linearly(times, samples), name=name, description=description)

    @classmethod
    def from_points(
        cls, times: ArrayLike, acceleration: ArrayLike, *, name: str = "points", description: Description | None = None
    ) -> Motion:
        """Create a motion that is linear between points at uneven times, s, like `from_samples`.

        Times must increase strictly. The first one becomes 0.
        """
        samples = piecewise.check_samples(acceleration)
        instants = piecewise.check_times(times, len(samples))
        with np.errstate(over="ignore"):
            breakpoints = instants - instants[0]
        description = description or Description("points", text="linear between uneven points")
        return cls(breakpoints, piecewise.join_linearly(breakpoints, samples), name=name, description=description)

    @property
    def end(self) -> float:
        """Time of the last breakpoint of both components, s."""
        return self.duration if self.vertical is None else max(self.duration, self.vertical.duration)

    @property
    def label(self) -> str:
        """Name with brief processing and vertical component, for titles."""
        return create_label(self.name, self.history, "" if self.vertical is None else self.vertical.name)

    def scaled(self, factor: float) -> Motion:
        """Return the motion times a factor.

        A negative factor reverses only the horizontal component. Raises `MotionError` if the factor is not finite, or
        the scaled motion would exceed the supported range.
        """
        multiplier = checks.finite(factor, "factor", MotionError)
        return self._multiply(multiplier, FACTOR.describe_scaling(multiplier, multiplier))

    def scaled_to(self, level: float, measure: MeasureName | Measure = "pga") -> Motion:
        """Return the motion scaled to a level of an intensity measure.

        Parameters
        ----------
        level : float
            Target level, SI units: accelerations in m/s^2, not g (0.5 g is ``0.5 * 9.80665``). `history` contains both.
        measure : {"pga", "pgv", "factor"} or Measure
            Peak acceleration (m/s^2), peak velocity (m/s), factor as for `scaled`, or another measure of a motion, for
            example spectral acceleration (m/s^2) as ``rocking.Measure("sa", period=1.0)``.

        Returns
        -------
        Motion
            Both components times the same factor.

        Raises
        ------
        MotionError
            If `level` is not positive, the motion is zero, or the scaled motion would exceed the supported range.
        OptionError
            If `measure` is not a measure of a motion alone.

        See Also
        --------
        rocking.Measure : intensity measure.
        """
        intensity_measure = Measure.parse(measure, names=SCALING_MEASURES)
        if intensity_measure.name == "factor":
            return self.scaled(level)
        target = checks.positive(level, "level", MotionError, intensity_measure.units)
        factor = intensity_measure.find_factor(target, intensity_measure.require_positive_value(self, self.name))
        return self._multiply(factor, intensity_measure.describe_scaling(target, factor))

    def with_vertical(self, vertical: Motion | None) -> Motion:
        """Return the motion with a vertical component, which changes the effective gravity.

        Scaling, delay, processing and addition apply to both components, reversal only to the horizontal one. A record
        with a channel named "Down" or "DWN" is inverted.

        `vertical` (m/s^2, positive upwards) starts at the same time. None removes the component. Raises `MotionError`
        if `vertical` is not a motion, or itself has a vertical component.
        """
        origin = vertical.description.origin if isinstance(vertical, Motion) else None
        if vertical is not None and origin is not None and origin.is_downward:
            vertical = vertical._multiply(-1.0, f"turned upwards, as its channel is called {origin.channel!r}")
        return self if vertical is self.vertical else replace(self, vertical=vertical)

    def with_orthogonal(self, orthogonal: Motion | None) -> Motion:
        """Return the motion with the other horizontal component, for intensity measures of the pair.

        A body responds to the motion alone, in its plane. Scaling, delay and processing apply to both components. None
        removes the component. `records.load_pairs` reads both components of each station.

        Parameters
        ----------
        orthogonal : Motion or None
            Simultaneous component perpendicular to this one.

        Returns
        -------
        Motion
            The same motion, with `orthogonal`.

        Raises
        ------
        MotionError
            If `orthogonal` is not a motion, or according to the files the components are not perpendicular within 5
            degrees, or do not begin together.

        See Also
        --------
        rocking.Measure : Intensity measures of pairs, for example RotD50.

        Examples
        --------
        >>> import rocking
        >>> first, second = (rocking.records.load(f"ridgecrest-clc-{azimuth}") for azimuth in ("090", "360"))
        >>> rotd50 = rocking.Measure("pga", component="rotd50").value(first.with_orthogonal(second))
        >>> f"{first.pga:.2f} {second.pga:.2f} {rotd50:.2f} m/s^2"
        '3.38 5.01 4.25 m/s^2'
        """
        if isinstance(orthogonal, Motion):
            orthogonal = replace(orthogonal, vertical=None, orthogonal=None)
            azimuths = [(part.description.origin or Origin()).azimuth for part in (self, orthogonal)]
            if None not in azimuths and abs((azimuths[1] - azimuths[0]) % 180.0 - 90.0) > 5.0:  # type: ignore[operator]
                message = f"the components {self.name} and {orthogonal.name} have azimuths of {azimuths[0]:g} and "
                raise MotionError(
                    escape_braces(message) + f"{azimuths[1]:g} deg; {{}} must be perpendicular", "orthogonal"
                )
            if delay := compute_start_delay(self.description, orthogonal.description, self.dt):
                message = f"the components {self.name} and {orthogonal.name} begin {abs(delay):.6g} s apart"
                raise MotionError(f"{escape_braces(message)}; remove the start of one with processed(trim=...)")
        return replace(self, orthogonal=orthogonal)

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        """Draw the ground acceleration in g over time, and the vertical one below, with parameters of `Result.plot`.

        In `ax` only the horizontal acceleration is drawn. The default title is the label of the motion.
        """
        from rocking.plot.curves import draw_motion

        times, title = self.choose_drawing_times(0.0, self.end), title or escape_dollars(self.label)
        acceleration = self.acceleration(times) / STANDARD_GRAVITY
        vertical = None if self.vertical is None else self.vertical.acceleration(times) / STANDARD_GRAVITY
        traces = {"acceleration_g": acceleration, "vertical_g": vertical}
        return draw_motion(time=times, **traces, title=title, ax=ax, figsize=figsize)

    def choose_drawing_times(self, start: float, end: float) -> Floats:
        """Return times (s) for drawing an interval: its ends, breakpoints, and additional points on curved pieces.

        Breakpoints of both components are included, and times just before jumps. The end of the motion is a jump to
        zero.
        """
        points = self.breakpoints
        if self.coefficients.shape[1] > 2:
            points = (points[:-1, None] + np.linspace(0.0, 1.0, 33) * np.diff(points)[:, None]).ravel()
        is_jump = piecewise.find_jumps(self)
        inner_jumps, end_jump = self.breakpoints[1:-1][is_jump[:-1]], self.breakpoints[-1:][is_jump[-1:]]
        points = np.concatenate([points, np.nextafter(inner_jumps, -np.inf), np.nextafter(end_jump, np.inf)])
        times = np.union1d([start, end], points[(points > start) & (points < end)])
        return times if self.vertical is None else np.union1d(times, self.vertical.choose_drawing_times(start, end))

    def __repr__(self) -> str:
        return f"<Motion: {self}>"

    def __str__(self) -> str:
        """Return name, duration, step, peak acceleration and changes in one line."""
        step = "" if self.dt is None else f" in steps of {self.dt:.5g} s"
        parts = [f"{self.name}, {self.duration:.5g} s{step}, {_describe_peak(self)}", *self.history]
        if self.vertical is not None:
            parts.append(f"vertical: {self.vertical.name}, {_describe_peak(self.vertical)}")
        return "; ".join(parts)

    def __mul__(self, factor: float) -> Motion:
        """Return the motion times a factor, like `scaled`."""
        return self.scaled(factor) if isinstance(factor, (int, float, np.number)) else NotImplemented

    __rmul__ = __mul__

    def __neg__(self) -> Motion:
        """Return the motion with reversed polarity."""
        return self._multiply(-1.0, "polarity reversed")

    def __add__(self, other: Motion) -> Motion:
        """Return the sum of two motions that start together."""
        if not isinstance(other, Motion):
            return NotImplemented
        breakpoints, (first, second) = piecewise.align_pieces(self, other)
        vertical = self.vertical or other.vertical
        if self.vertical is not None and other.vertical is not None:
            vertical = self.vertical + other.vertical
        name, error = f"{self.name} + {other.name}", self.error + other.error
        description = Description("sum", text=f"{self._describe_origin()}; plus {other._describe_origin()}")
        return Motion(breakpoints, first + second, name, description, error=error, vertical=vertical)

    def _multiply(self, factor: float, history_entry: str) -> Motion:
        """Return all components times a factor, the vertical and the orthogonal one times its absolute value."""
        fields: dict[str, Any] = self._collect_other_components()
        if abs(factor) != 1.0:
            fields = {name: part and part._multiply(abs(factor), history_entry) for name, part in fields.items()}
        with np.errstate(over="ignore", invalid="ignore"):
            coefficients = self.coefficients * factor
        if not np.all(np.abs(coefficients[:, 0]) <= piecewise.MAX_ACCELERATION) or not np.isfinite(coefficients).all():
            raise MotionError(piecewise.TOO_STRONG)
        description, history = self.description.scaled(factor), (*self.history, history_entry)
        fields |= {"description": description, "history": history, "error": self.error * abs(factor)}
        return replace(self, coefficients=coefficients, **fields)


def _describe_peak(motion: Motion) -> str:
    return f"peak {motion.pga:.5g} m/s^2 ({motion.pga / STANDARD_GRAVITY:.4g} g)"


def find_exceedances(motion: Motion, thresholds: tuple[float, float], gravity: float = STANDARD_GRAVITY) -> Floats:
    """Return intervals in which a resting block would be lifted: start and end of each, s, in order, shape (n, 2).

    The block is lifted to side + if -a exceeds the first threshold (m/s^2), and to side - if a exceeds the second (see
    `Block.uplift_thresholds`). Vertical acceleration adds to the gravity (m/s^2) for which the thresholds hold.
    """
    plus, minus = thresholds
    towards_plus, towards_minus = _deduct_vertical(motion, -plus / gravity), _deduct_vertical(motion, minus / gravity)
    may_exceed = _find_pieces_reaching(towards_plus, plus) | _find_pieces_reaching(towards_minus, minus)
    ends = towards_plus.breakpoints[np.append(may_exceed, False) | np.append(False, may_exceed)]
    crossings = [_find_crossings(towards_plus, -plus, may_exceed), _find_crossings(towards_minus, minus, may_exceed)]
    cuts = np.unique(np.concatenate([ends, *crossings]))
    midpoints = 0.5 * (cuts[:-1] + cuts[1:])
    is_exceeded = (towards_minus.acceleration(midpoints) > minus) | (towards_plus.acceleration(midpoints) < -plus)
    return cuts[np.flatnonzero(np.diff(is_exceeded, prepend=False, append=False))].reshape(-1, 2)


def compute_uplift_factors(
    motion: Motion, thresholds: ArrayLike, gravity: float = STANDARD_GRAVITY, weight_thresholds: ArrayLike | None = None
) -> Floats:
    """Compute the smallest factors on both components that lift blocks from rest, shape (n,), or infinity.

    The thresholds, shape (n, 2), are pairs as for `find_exceedances`, infinite on sides without rocking. The part due
    to the weight, by default all of them, changes with a vertical motion.
    """
    threshold_pairs = np.asarray(thresholds, dtype=np.float64)
    weight_pairs = threshold_pairs if weight_thresholds is None else np.asarray(weight_thresholds, dtype=np.float64)
    if motion.vertical is None:
        widths = np.diff(motion.breakpoints)
        peaks = np.array([[piecewise.compute_maximum(widths, sign * motion.coefficients) for sign in (-1.0, 1.0)]])
    else:
        breakpoints, (horizontal, vertical) = piecewise.align_pieces(motion, motion.vertical)
        widths = np.diff(breakpoints)

        def find_peak(sign: float, threshold: float) -> float:
            if np.isinf(threshold):
                return 0.0
            return piecewise.compute_maximum(widths, sign * horizontal - threshold / gravity * vertical)

        peaks = np.array([[find_peak(-1.0, plus), find_peak(1.0, minus)] for plus, minus in weight_pairs])
    with np.errstate(divide="ignore"):
        factors = np.where(peaks > 0.0, threshold_pairs / np.maximum(peaks, 0.0), np.inf)
    min_factors: Floats = factors.min(axis=1)
    return min_factors


def _deduct_vertical(motion: Motion, threshold_over_g: float) -> Motion:
    """Return the horizontal motion minus the contribution of the vertical motion to a threshold."""
    horizontal = motion.with_vertical(None)
    return horizontal if motion.vertical is None else horizontal + motion.vertical.scaled(-threshold_over_g)


def _find_pieces_reaching(motion: Motion, level: float) -> Flags:
    """Return which pieces may reach this magnitude, often few."""
    bounds = piecewise.bound_magnitudes(np.diff(motion.breakpoints), motion.coefficients)
    return np.asarray(bounds >= level * (1.0 - 1e-12))


def _find_crossings(motion: Motion, level: float, pieces: Flags) -> Floats:
    """Return a superset of the times, s, at which the motion crosses a level inside a piece."""
    widths = np.diff(motion.breakpoints)[pieces]
    shifted = motion.coefficients[pieces]
    shifted[:, 0] -= level
    offsets = piecewise.find_root_candidates(widths, shifted)
    is_inside = (offsets > 0.0) & (offsets < widths[:, np.newaxis])
    times: Floats = (motion.breakpoints[:-1][pieces][:, np.newaxis] + offsets)[is_inside]
    return times
