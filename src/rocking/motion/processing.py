"""Processing of a motion: trim, baseline, band-pass, resample, rotate, and floor motion."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import MotionError
from rocking.motion import piecewise
from rocking.motion.description import Description, Origin, compute_start_delay
from rocking.motion.measures import DEFAULT_DAMPING, MotionMeasures, check_damping
from rocking.motion.piecewise import Piecewise

T = TypeVar("T")

_MAX_SAMPLES: Final = 50_000_000

#: Largest angle of the oscillation on a piece, and degree of its series: 0.25**10 / 10! = 3e-13.
_MAX_ANGLE: Final = 0.25
_SERIES_DEGREE: Final = 9


class ProcessedPieces(NamedTuple):
    """Pieces after one processing step, and its description for the motion's history."""

    breakpoints: Floats
    coefficients: Floats
    history_entry: str


#: Processing step.
_ProcessingStep = Callable[[Piecewise], ProcessedPieces]


class ProcessingMethods(MotionMeasures):
    """Methods of `Motion` that derive other motions."""

    name: str
    description: Description
    history: tuple[str, ...]
    error: float
    vertical: Self | None
    orthogonal: Self | None

    def _collect_other_components(self) -> dict[str, Self | None]:
        """Return the other components by their names."""
        return {"vertical": self.vertical, "orthogonal": self.orthogonal}

    dt: float | None

    def _derive(self, change: str, history_entry: str, **fields: Any) -> Self:
        """Return the motion with other fields and an extended history."""
        history = (*self.history, history_entry)
        fields = {"description": self.description.changed(change), "history": history, "orthogonal": None} | fields
        return replace(self, **fields)  # type: ignore[type-var]

    def _describe_origin(self) -> str:
        """Return name, parameters, formula and history in one line, for the description of a sum."""
        description_parts = (self.description.family, self.description.parameter_text, self.description.text)
        return ", ".join(part for part in (self.name, *description_parts, *self.history) if part)

    def rotated(self, other: Self, azimuth: float, *, recorded: tuple[float, float] | None = None) -> Self:
        """Return the component along any azimuth of a horizontal motion with two components.

        Parameters
        ----------
        other : Motion
            Second horizontal component at the same place and time.
        azimuth : float
            Positive direction of the result, degrees clockwise from north.
        recorded : pair of float, optional
            Azimuths of both components, degrees clockwise from north, by default from their records.

        Returns
        -------
        Motion
            Component along `azimuth`, with the vertical component of either.

        Raises
        ------
        MotionError
            If an azimuth is unknown or not a number, the components are nearly parallel, begin at different times by
            the clock of their files, or have different vertical components.

        Notes
        -----
        a(phi) = (a_1 sin(phi_2 - phi) + a_2 sin(phi - phi_1))/sin(phi_2 - phi_1), exactly, piece by piece.
        """
        if not isinstance(other, ProcessingMethods):
            message = f"{{}} must be a Motion, the other horizontal component, not {type(other).__name__}"
            raise MotionError(message, "other", value=other)
        azimuths = _resolve_azimuths(self, other, recorded)
        if delay := compute_start_delay(self.description, other.description, self.dt):
            earlier_motion, later_motion = (self, other) if delay > 0.0 else (other, self)
            first, second = checks.short_repr(earlier_motion.name), checks.short_repr(later_motion.name)
            message = f"according to their files, {second} begins {abs(delay):.6g} s after {first}"
            call = f"processed(trim=({abs(delay):.6g}, {earlier_motion.duration:.6g}))"
            raise MotionError(f"{message}; remove the start of the latter with {call}")
        target = checks.finite(azimuth, "azimuth", MotionError)
        if self.vertical is not None and other.vertical not in (None, self.vertical):
            message = "the components have different vertical components; use with_vertical to add only one of them"
            raise MotionError(message)
        factors = compute_rotation_factors(azimuths, target)
        breakpoints, rows = piecewise.align_pieces(self, other)
        fields: dict[str, Any] = {"channel": f"{target:g} deg", "number": None, "azimuth": target, "is_reversed": False}
        origin = replace(self.description.origin or Origin(), **fields)
        first, second = (f"{azimuths[k]:g} deg: {part._describe_origin()}" for k, part in enumerate((self, other)))
        text = f"at {target:g} deg, from {first}; and {second}"
        return self._derive(
            "rotated",
            f"with {other.name} rotated to {target:g} deg",
            breakpoints=breakpoints,
            coefficients=factors[0] * rows[0] + factors[1] * rows[1],
            description=replace(self.description.changed("rotated"), parameters={}, text=text, origin=origin),
            error=abs(factors[0]) * self.error + abs(factors[1]) * other.error,
            vertical=self.vertical or other.vertical,
        )

    def delayed(self, delay: float) -> Self:
        """Return the motion after a time of zero acceleration, s. ``processed(trim=...)`` removes an early part."""
        wait = checks.positive(delay, "delay", MotionError, "s")
        rows = np.vstack([np.zeros((1, self.coefficients.shape[1])), self.coefficients])
        pieces = {"breakpoints": np.append(0.0, self.breakpoints + wait), "coefficients": rows}
        components = {name: part and part.delayed(wait) for name, part in self._collect_other_components().items()}
        return self._derive("delayed", f"delayed by {wait:.6g} s", **pieces, **components)

    def on_floor(self, period: float, damping: float = DEFAULT_DAMPING, *, free_vibration: float | None = None) -> Self:
        """Return the motion of a floor: the absolute acceleration of a linear oscillator under the motion.

        Parameters
        ----------
        period, damping : float
            Natural period of the building, s, and its fraction of critical damping.
        free_vibration : float, optional
            Duration of the floor motion after the ground motion, s, by default until a free oscillation decays to a
            thousandth.

        Returns
        -------
        Motion
            Polynomials of degree 9 on pieces of at most a quarter radian, with unchanged vertical component. An
            orthogonal component also becomes a floor motion.

        Raises
        ------
        MotionError
            If period or damping is out of range, or both damping and `free_vibration` are missing.

        Notes
        -----
        In a building with one mode, this is the motion of the floor where mode shape times participation factor is 1.
        At 0.6 the motion is ``ground + (floor + -ground) * 0.6``. Contents do not act back on the floor. A hazard curve
        of the ground does not apply to a fragility against floor measures.
        """
        breakpoints, coefficients, error = _compute_floor_motion(self, period, damping, free_vibration, self.error)
        history_entry = f"on a floor of period {period:.6g} s, damping {damping:.6g}"
        other = self.orthogonal and self.orthogonal.on_floor(period, damping, free_vibration=free_vibration)
        pieces: dict[str, Any] = {"breakpoints": breakpoints, "coefficients": coefficients, "error": error}
        return self._derive("floor", history_entry, orthogonal=other, **pieces)

    def processed(
        self,
        *,
        trim: tuple[float, float] | None = None,
        baseline: int | None = None,
        band_pass: tuple[float | None, float | None] | None = None,
        order: int | None = None,
        resample: float | None = None,
    ) -> Self:
        """Return a processed motion, with steps in the order of the parameters and recorded in `history`.

        Parameters
        ----------
        trim : (start, end)
            Part to keep, s, whose start becomes time 0. For even samples the ends move to the nearest sample.
        baseline : int
            Degree of the polynomial in time that is fitted by least squares and subtracted.
        band_pass : (low, high)
            Corner frequencies of a Butterworth filter, Hz, run forwards and backwards (no phase shift) with temporary
            zeros before and after. None leaves that side open.
        order : int
            Order of the filter in each direction with `band_pass`, 4 by default.
        resample : float
            New sampling step, s: values at its multiples, joined by straight lines. For a coarser step, use `band_pass`
            to remove content above its Nyquist frequency.

        Returns
        -------
        Motion
            Motion with the same name, and both components processed alike.

        Raises
        ------
        MotionError
            If no step is specified, an argument is invalid or out of place, or `baseline` or `band_pass` is applied to
            a motion that jumps or is not linear between even samples (resample it in a previous call).
        """
        steps: list[_ProcessingStep] = []
        window = None if trim is None else _find_window(self, *_unpack_pair(trim, "trim"))
        if baseline is not None:
            steps.append(lambda motion: _remove_baseline(motion, baseline))
        if band_pass is not None:
            low, high = _unpack_pair(band_pass, "band_pass")
            steps.append(lambda motion: _apply_band_pass(motion, low, high, 4 if order is None else order))
        elif order is not None:
            raise MotionError("{} requires {}; give both, or neither", "order", "band_pass")
        if resample is not None:
            steps.append(lambda motion: _resample(motion, resample))
        if window is None and not steps:
            raise MotionError("at least one of trim, baseline, band_pass and resample is required")
        other_components = self._collect_other_components()
        for name, part in other_components.items():
            if part is not None and window is not None and window[0] > part.duration - piecewise.MIN_DURATION:
                other_components[name] = None  # this component has ended by then
            elif part is not None:
                other_components[name] = part._apply_steps(window, steps, self.dt)
        return replace(self._apply_steps(window, steps), **other_components)  # type: ignore[type-var]

    def _apply_steps(
        self, window: tuple[float, float] | None, steps: list[_ProcessingStep], fine_step: float | None = None
    ) -> Self:
        """Return the processed part in a window (s). Even samples stay even, if necessary on a finer step (s)."""
        motion: Piecewise = self
        history = self.history
        # From this step on the motion is exactly the lines between the samples.
        error = 0.0 if steps else self.error
        if window is not None:
            start, end = window[0], min(window[1], self.duration)
            steps = [lambda motion: _trim(motion, start, end, fine_step), *steps]
        for step in steps:
            motion = processed = step(motion)
            history = (*history, processed.history_entry)
        pieces = {"breakpoints": motion.breakpoints, "coefficients": motion.coefficients}
        return self._derive("processed", "", **pieces, history=history, error=error)


def _unpack_pair(values: tuple[T, T], argument: str) -> tuple[T, T]:
    """Return the two values of an argument."""
    try:
        first, second = values
    except (TypeError, ValueError) as error:
        raise MotionError(f"{{}} must be two numbers, not {values!r}", argument, value=values) from error
    return first, second


def _find_window(motion: Piecewise, start: float, end: float) -> tuple[float, float]:
    """Return the ends (s) of the part to keep, at the nearest samples if these are even."""
    first = checks.finite(start, "start of the part to keep", MotionError)
    last = checks.finite(end, "end of the part to keep", MotionError)
    duration = float(motion.breakpoints[-1])
    if not 0.0 <= first < last <= duration * (1.0 + 1e-12):
        requirement = f"0 <= start < end <= {duration:.6g} s, the duration"
        message = f"{{}} requires {requirement}; got {first:.6g} and {last:.6g}"
        raise MotionError(message, "trim", value=(start, end))
    step = piecewise.find_even_step(motion)
    if step is None:
        return first, min(last, duration)
    if round(last / step) <= round(first / step):
        raise MotionError(f"{{}} must keep at least two samples, {step:.6g} s apart", "trim", value=(start, end))
    return round(first / step) * step, round(last / step) * step


def _trim(motion: Piecewise, start: float, end: float, fine_step: float | None = None) -> ProcessedPieces:
    """Keep the part from `start` to `end` (s). Even samples stay even, if necessary on a finer step (s)."""
    entry = f"trimmed to {start:.6g}-{end:.6g} s"
    step = piecewise.find_even_step(motion)
    if step is not None:
        for new_step in (step, fine_step or step):
            first, last, subdivisions = (_round_if_integer(value / new_step) for value in (start, end, step))
            if first is not None and last is not None and subdivisions:
                sample, subdivision = np.divmod(np.arange(first, last), subdivisions)
                coefficients = piecewise.shift_origin(motion.coefficients[sample], subdivision * new_step)
                return ProcessedPieces(piecewise.create_even_times(last - first + 1, new_step), coefficients, entry)
    breakpoints, rows = motion.breakpoints, motion.coefficients
    inner_breakpoints = breakpoints[(breakpoints > start) & (breakpoints < end)]
    new_breakpoints = np.concatenate([[start], inner_breakpoints, [end]])
    coefficients = piecewise.refine_pieces(breakpoints, rows, new_breakpoints, rows.shape[1])
    return ProcessedPieces(new_breakpoints - start, coefficients, entry)


def _round_if_integer(ratio: float) -> int | None:
    """Return the whole number that a ratio is up to rounding, or None."""
    return round(ratio) if abs(ratio - round(ratio)) <= 1e-8 else None


def _remove_baseline(motion: Piecewise, degree: int) -> ProcessedPieces:
    """Subtract the polynomial of this degree with the best least-squares fit to the samples."""
    step = _require_even_step(motion, "baseline")
    times, samples = piecewise.sample_breakpoints(motion)
    degree = checks.integer(degree, "degree of a baseline", MotionError, 0, min(10, len(samples) - 1))
    baseline = np.polynomial.Legendre.fit(times, samples, degree)(times)
    return _join_samples(samples - baseline, step, f"baseline of degree {degree} removed")


def _apply_band_pass(motion: Piecewise, low: float | None, high: float | None, order: int) -> ProcessedPieces:
    """Apply a Butterworth band-pass both ways with zeros at both ends (Converse and Brady 1992)."""
    from scipy import signal  # imported on first use because it takes half a second

    step = _require_even_step(motion, "band_pass")
    nyquist, duration = 0.5 / step, float(motion.breakpoints[-1])
    specified = [corner for corner in (low, high) if corner is not None]
    corners = [checks.positive(corner, "corner frequency", MotionError, "Hz") for corner in specified]
    if not corners or corners != sorted(set(corners)) or corners[-1] >= nyquist:
        message = f"{{}} must be (low, high) with low < high < {nyquist:.6g} Hz, the Nyquist frequency; one may be None"
        raise MotionError(message, "band_pass", value=(low, high))
    if corners[0] * duration < 0.1:
        message = f"a corner frequency of {corners[0]:.6g} Hz is too low for a motion of {duration:.6g} s"
        raise MotionError(f"{message}; use at least {0.1 / duration:.6g} Hz", value=(low, high))
    order = checks.integer(order, "order of a filter", MotionError, 1, 12)
    kind: Final = "bandpass" if len(corners) == 2 else "highpass" if high is None else "lowpass"
    frequencies = corners if kind == "bandpass" else corners[0]
    sections = signal.butter(order, frequencies, btype=kind, output="sos", fs=1.0 / step)
    pad_length = math.ceil(1.5 * order / corners[0] / step)
    padded = np.pad(piecewise.sample_breakpoints(motion)[1], pad_length)
    filtered: Floats = signal.sosfiltfilt(sections, padded, padtype=None)[pad_length:-pad_length]
    band_text = f"{'0' if low is None else f'{low:.6g}'}-{'inf' if high is None else f'{high:.6g}'} Hz"
    return _join_samples(filtered, step, f"band-passed {band_text}, order {order} forwards and backwards")


def _resample(motion: Piecewise, step: float) -> ProcessedPieces:
    """Sample the motion at the multiples of `step` (s) up to its end, joined by straight lines."""
    new_dt = checks.positive(step, "new sampling step", MotionError, "s")
    duration = float(motion.breakpoints[-1])
    count = math.floor(duration / new_dt * (1.0 + 1e-12)) + 1
    if not 2 <= count <= _MAX_SAMPLES:
        message = f"a step of {new_dt:.6g} s gives {count} samples of a motion of {duration:.6g} s; use a step that"
        raise MotionError(f"{message} gives 2 to {_MAX_SAMPLES}", value=step)
    times = np.minimum(new_dt * np.arange(count), duration)
    samples = piecewise.evaluate_at(motion.breakpoints, motion.coefficients, times)
    return _join_samples(samples, new_dt, f"resampled to a step of {new_dt:.6g} s")


def _require_even_step(motion: Piecewise, argument: str) -> float:
    step = piecewise.find_even_step(motion)
    if step is None:
        raise MotionError("{} requires samples at even steps; call processed(resample=...) first", argument)
    if piecewise.has_jumps(motion):
        message = "{} requires a motion that is linear between samples; call processed(resample=...) first"
        raise MotionError(message, argument)
    return step


def _join_samples(samples: Floats, step: float, history_entry: str) -> ProcessedPieces:
    times = piecewise.create_even_times(len(samples), step)
    return ProcessedPieces(times, piecewise.join_linearly(times, samples), history_entry)


def _compute_floor_motion(
    motion: Piecewise, period: float, damping: float, free_vibration: float | None, error: float = 0.0
) -> tuple[Floats, Floats, float]:
    """Compute the absolute acceleration of an oscillator from rest, and its error bound, m/s^2.

    For u'' + 2 z w u' + w^2 u = -a(t) it is -(2 z w u' + w^2 u).
    """
    end = float(motion.breakpoints[-1])
    natural_period = checks.positive(period, "period", MotionError, "s")
    angular_frequency, damping_ratio = 2.0 * math.pi / natural_period, check_damping(damping, MotionError)
    if free_vibration is None and damping_ratio == 0.0:
        raise MotionError("the motion of a floor without {} does not decay; give {}, in s", "damping", "free_vibration")
    # By default a free oscillation continues until it has decayed to a thousandth.
    if free_vibration is None:
        tail = -math.log(1e-3) / (damping_ratio * angular_frequency)
    else:
        tail = checks.between(free_vibration, "free_vibration", MotionError, 0.0, 1e15, "s")
    if not (end + tail) / (_MAX_ANGLE / angular_frequency) <= 1e6:
        message = f"{{}} = {natural_period:g} s is too short for a floor motion of {end + tail:.4g} s"
        raise MotionError(f"{message}; use a longer one, or a shorter {{}}", "period", "free_vibration", value=period)
    breakpoints, solution = compute_oscillator(motion, angular_frequency, damping_ratio, tail)
    columns = solution.shape[1] - 2
    velocity = solution[:, 1:] * np.arange(1, columns + 2)
    acceleration = -(
        2.0 * damping_ratio * angular_frequency * velocity[:, :columns] + angular_frequency**2 * solution[:, :columns]
    )
    peak = float(np.max(np.abs(acceleration[:, 0]), initial=0.0))
    truncation_error = 4.0 * peak * _MAX_ANGLE**columns / math.factorial(columns)
    # The effects of an error of the acceleration add up.
    propagated_error = error * (2.0 / damping_ratio if damping_ratio > 0.0 else angular_frequency * (end + tail))
    return breakpoints, acceleration, truncation_error + propagated_error


def compute_oscillator(
    motion: Piecewise, angular_frequency: float, damping_ratio: float, tail: float
) -> tuple[Floats, Floats]:
    """Return breakpoints, s, and coefficients of the displacement u, m, with u'' + 2 z w u' + w^2 u = -a(t), from rest.

    On each piece u is the Taylor series of the exact solution about its start, from the series of the solutions of the
    states (1, 0) and (0, 1) and of the one from rest. ``tail`` is the time after the motion, s.
    """
    nodes = motion.breakpoints
    nodes = np.append(nodes, nodes[-1] + tail) if tail > 0.0 else nodes
    subdivisions = np.maximum(1, np.ceil(np.diff(nodes) / (_MAX_ANGLE / angular_frequency))).astype(np.intp)
    start, width = np.repeat(nodes[:-1], subdivisions), np.repeat(np.diff(nodes) / subdivisions, subdivisions)
    index = np.arange(subdivisions.sum()) - np.repeat(np.cumsum(subdivisions) - subdivisions, subdivisions)
    breakpoints = np.append(start + index * width, nodes[-1])
    width = np.diff(breakpoints)
    columns = max(motion.coefficients.shape[1], _SERIES_DEGREE + 1)
    forcing = piecewise.refine_pieces(motion.breakpoints, motion.coefficients, breakpoints, columns)
    series = _compute_oscillator_series(forcing, angular_frequency, damping_ratio, columns + 2)
    velocity_series = series[..., 1:] * np.arange(1, columns + 2)
    end_states = [piecewise.evaluate_pieces(s, np.broadcast_to(width, s.shape[:-1])) for s in (series, velocity_series)]
    states = _propagate_states(np.stack(end_states))
    return breakpoints, series[2] + np.einsum("jn,jnk->nk", states, series[:2])


def _compute_oscillator_series(forcing: Floats, angular_frequency: float, damping_ratio: float, terms: int) -> Floats:
    """Return series of two free solutions and of the one from rest on each piece, shape (3, pieces, terms)."""
    series = np.zeros((3, len(forcing), terms))
    series[0, :, 0] = series[1, :, 1] = 1.0
    for k in range(terms - 2):
        forces = (
            2.0 * damping_ratio * angular_frequency * (k + 1) * series[..., k + 1]
            + angular_frequency * angular_frequency * series[..., k]
        )
        forces[2] += forcing[:, k]
        series[..., k + 2] = -forces / ((k + 1) * (k + 2))
    return series


def _propagate_states(end_states: Floats) -> Floats:
    """Compute displacement and velocity at the start of every piece, shape (2, pieces)."""
    states = np.empty((2, end_states.shape[2]))
    u = v = 0.0
    for k, (a, b, c, d, e, f) in enumerate(end_states.transpose(2, 0, 1).reshape(-1, 6).tolist()):
        states[:, k] = u, v
        u, v = a * u + b * v + c, d * u + e * v + f
    return states


def sine_cosine(degrees: ArrayLike) -> tuple[Floats, Floats]:
    """Return sine and cosine of angles in degrees, exact at multiples of a right angle."""
    angle = np.asarray(degrees, dtype=np.float64)
    quarters = np.rint(angle / 90.0)
    sine, cosine = piecewise.sine_cosine_from_quarters(quarters, np.deg2rad(angle - 90.0 * quarters))
    return sine + 0.0, cosine + 0.0  # avoids negative zeros


def _resolve_azimuths(
    first_motion: ProcessingMethods, second_motion: ProcessingMethods, recorded: Any
) -> tuple[float, float]:
    """Return the azimuths of two components, specified or from their records."""
    if recorded is None:
        recorded = [(motion.description.origin or Origin()).azimuth for motion in (first_motion, second_motion)]
        if None in recorded:
            name = checks.short_repr((first_motion, second_motion)[recorded.index(None)].name)
            remedy = "give {}=(first, second), the directions of both components in degrees clockwise from north"
            raise MotionError(f"the azimuth of {name} is unknown; {remedy}", "recorded")
    azimuths = checks.numbers(recorded, "recorded", MotionError)
    if azimuths.shape != (2,) or not np.all(np.isfinite(azimuths)):
        message = "{} must be the azimuths of both components, two numbers in degrees"
        raise MotionError(message, "recorded", value=recorded)
    first, second = azimuths.tolist()
    angle = abs((second - first + 90.0) % 180.0 - 90.0)
    if angle < 15.0:
        message = f"the components have azimuths of {first:g} and {second:g} deg, along one line within {angle:g} deg"
        raise MotionError(f"{message}; use two perpendicular components")
    return first, second


def compute_rotation_factors(recorded: tuple[float, float], azimuth: float) -> tuple[float, float]:
    """Return the factors on two components for the component along another azimuth."""
    first, second = recorded
    sine, _ = sine_cosine([second - azimuth, azimuth - first, second - first])
    return float(sine[0] / sine[2]) + 0.0, float(sine[1] / sine[2]) + 0.0
