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
from rocking.errors import InvalidMotion
from rocking.motion import piecewise
from rocking.motion.description import Description, Origin, begins_later
from rocking.motion.measures import DAMPING, Measured, checked_damping
from rocking.motion.piecewise import Piecewise

T = TypeVar("T")

_MOST_SAMPLES: Final = 50_000_000

#: Largest angle of the oscillation on a piece, and degree of its series: 0.25**10 / 10! = 3e-13.
_RADIANS: Final = 0.25
_DEGREE: Final = 9


class Processed(NamedTuple):
    """Pieces after one processing step, and its description for the motion's history."""

    breakpoints: Floats
    coefficients: Floats
    done: str


#: Processing step.
_Step = Callable[[Piecewise], Processed]


class Processable(Measured):
    """Methods of `Motion` that derive other motions."""

    name: str
    description: Description
    history: tuple[str, ...]
    error: float
    vertical: Self | None
    dt: float | None

    def _changed(self, how: str, done: str, **fields: Any) -> Self:
        """Return the motion with other fields and an extended history."""
        fields = {"description": self.description.changed(how), "history": (*self.history, done)} | fields
        return replace(self, **fields)  # type: ignore[type-var]

    def _origin(self) -> str:
        """Return name, parameters, formula and history in one line, for the description of a sum."""
        described = (self.description.family, self.description.numbers, self.description.text)
        return ", ".join(part for part in (self.name, *described, *self.history) if part)

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
        InvalidMotion
            If an azimuth is unknown or not a number, the components are nearly parallel, begin at different times by
            the clock of their files, or have different vertical components.

        Notes
        -----
        a(phi) = (a_1 sin(phi_2 - phi) + a_2 sin(phi - phi_1))/sin(phi_2 - phi_1), exactly, piece by piece.
        """
        if not isinstance(other, Processable):
            sentence = f"{{}} must be a Motion, the other horizontal component, not {type(other).__name__}"
            raise InvalidMotion(sentence, "other", value=other)
        first, second = _recorded_azimuths(self, other, recorded)
        if later := begins_later(self.description, other.description, self.dt):
            early, late = (self, other) if later > 0.0 else (other, self)
            raise InvalidMotion(
                f"by their files {checks.shown(late.name)} begins {abs(later):.6g} s after {checks.shown(early.name)}: "
                f"cut what comes first with processed(trim=({abs(later):.6g}, {early.duration:.6g})) of the latter"
            )
        wanted = checks.finite(azimuth, "azimuth", InvalidMotion)
        if self.vertical is not None and other.vertical not in (None, self.vertical):
            raise InvalidMotion("each component has a vertical one: give it to one of the two with with_vertical")
        mine, theirs = shares((first, second), wanted)
        breakpoints, (one, two) = piecewise.together(self, other)
        along: dict[str, Any] = {"channel": f"{wanted:g} deg", "number": None, "azimuth": wanted, "reversed": False}
        origin = replace(self.description.origin or Origin(), **along)
        text = f"at {wanted:g} deg, from {first:g} deg: {self._origin()}; and {second:g} deg: {other._origin()}"
        return self._changed(
            "rotated",
            f"with {other.name} rotated to {wanted:g} deg",
            breakpoints=breakpoints,
            coefficients=mine * one + theirs * two,
            description=replace(self.description.changed("rotated"), parameters={}, text=text, origin=origin),
            error=abs(mine) * self.error + abs(theirs) * other.error,
            vertical=self.vertical or other.vertical,
        )

    def delayed(self, delay: float) -> Self:
        """Return the motion after a time of zero acceleration, s. ``processed(trim=...)`` removes an early part."""
        wait = checks.positive(delay, "delay", InvalidMotion, "s")
        return self._changed(
            "delayed",
            f"delayed by {wait:.6g} s",
            breakpoints=np.concatenate([[0.0], self.breakpoints + wait]),
            coefficients=np.vstack([np.zeros((1, self.coefficients.shape[1])), self.coefficients]),
            vertical=None if self.vertical is None else self.vertical.delayed(wait),
        )

    def floor(self, period: float, damping: float = DAMPING, *, ringing: float | None = None) -> Self:
        """Return the motion of a floor: the absolute acceleration of a linear oscillator under the motion.

        Parameters
        ----------
        period, damping : float
            Natural period of the building, s, and its fraction of critical damping.
        ringing : float, optional
            Duration of the floor motion after the ground motion, s, by default until a free oscillation decays to a
            thousandth.

        Returns
        -------
        Motion
            Polynomials of degree 9 on pieces of at most a quarter radian, with unchanged vertical component.

        Raises
        ------
        InvalidMotion
            If period or damping is out of range, or both damping and `ringing` are missing.

        Notes
        -----
        In a building with one mode, this is the motion of the floor where mode shape times participation factor is 1.
        At 0.6 the motion is ``ground + (floor + -ground) * 0.6``. Contents do not act back on the floor. A hazard curve
        of the ground does not apply to a fragility against floor measures.
        """
        breakpoints, coefficients, error = _floor_pieces(self, period, damping, ringing, self.error)
        done = f"on a floor of period {period:.6g} s, damping {damping:.6g}"
        return self._changed("floor", done, breakpoints=breakpoints, coefficients=coefficients, error=error)

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
        InvalidMotion
            If no step is specified, an argument is invalid or out of place, or `baseline` or `band_pass` is applied to
            a motion that jumps or is not linear between even samples (resample it in a previous call).
        """
        steps: list[_Step] = []
        kept = None if trim is None else _ends(self, *_pair(trim, "trim"))
        if baseline is not None:
            steps.append(lambda motion: _baseline(motion, baseline))
        if band_pass is not None:
            low, high = _pair(band_pass, "band_pass")
            steps.append(lambda motion: _band_pass(motion, low, high, 4 if order is None else order))
        elif order is not None:
            raise InvalidMotion("{} belongs to {}; give that as well, or neither", "order", "band_pass")
        if resample is not None:
            steps.append(lambda motion: _resample(motion, resample))
        if kept is None and not steps:
            raise InvalidMotion("name what to do: trim, baseline, band_pass or resample")
        vertical = self.vertical
        if vertical is not None and kept is not None and kept[0] > vertical.duration - piecewise.SHORTEST:
            vertical = None  # the vertical motion has ended by then
        if vertical is not None:
            vertical = vertical._processed(kept, steps, self.dt)
        return replace(self._processed(kept, steps), vertical=vertical)  # type: ignore[type-var]

    def _processed(self, kept: tuple[float, float] | None, steps: list[_Step], grid: float | None = None) -> Self:
        """Return the part between two times (s; even samples stay even on a finer `grid`), after these steps."""
        motion: Piecewise = self
        history = self.history
        # From this step on the motion is exactly the lines between the samples.
        error = 0.0 if steps else self.error
        if kept is not None:
            start, end = kept[0], min(kept[1], self.duration)
            steps = [lambda motion: _cut(motion, start, end, grid), *steps]
        for step in steps:
            motion = done = step(motion)
            history = (*history, done.done)
        pieces = {"breakpoints": motion.breakpoints, "coefficients": motion.coefficients}
        return self._changed("processed", "", **pieces, history=history, error=error)


def _pair(values: tuple[T, T], what: str) -> tuple[T, T]:
    """Return the two values of the argument `what`."""
    try:
        first, second = values
    except (TypeError, ValueError) as error:
        raise InvalidMotion(f"{{}} takes two numbers, not {values!r}", what, value=values) from error
    return first, second


def _ends(motion: Piecewise, start: float, end: float) -> tuple[float, float]:
    """Return the ends (s) of the part to keep, at the nearest samples if these are even."""
    first = checks.finite(start, "start of the part to keep", InvalidMotion)
    last = checks.finite(end, "end of the part to keep", InvalidMotion)
    duration = float(motion.breakpoints[-1])
    if not 0.0 <= first < last <= duration * (1.0 + 1e-12):
        raise InvalidMotion(
            f"{{}} needs 0 <= start < end <= {duration:.6g} s, the motion's duration, not {first:.6g} and {last:.6g}",
            "trim",
            value=(start, end),
        )
    step = piecewise.even_step(motion)
    if step is None:
        return first, min(last, duration)
    if round(last / step) <= round(first / step):
        raise InvalidMotion(f"{{}} must keep at least two samples, {step:.6g} s apart", "trim", value=(start, end))
    return round(first / step) * step, round(last / step) * step


def _cut(motion: Piecewise, start: float, end: float, grid: float | None = None) -> Processed:
    """Keep the part from `start` to `end` (s); even samples stay even, where needed with a step `grid` (s)."""
    done = f"trimmed to {start:.6g}-{end:.6g} s"
    step = piecewise.even_step(motion)
    if step is not None:
        for finer in (step, grid or step):
            first, last, parts = (_whole(value / finer) for value in (start, end, step))
            if first is not None and last is not None and parts:
                sample, part = np.divmod(np.arange(first, last), parts)
                coefficients = piecewise.moved(motion.coefficients[sample], part * finer)
                return Processed(piecewise.even_times(last - first + 1, finer), coefficients, done)
    breakpoints = motion.breakpoints
    inside = breakpoints[(breakpoints > start) & (breakpoints < end)]
    kept = np.concatenate([[start], inside, [end]])
    coefficients = piecewise.refined(breakpoints, motion.coefficients, kept, motion.coefficients.shape[1])
    return Processed(kept - start, coefficients, done)


def _whole(ratio: float) -> int | None:
    """Return the whole number that a ratio is up to rounding, or None."""
    return round(ratio) if abs(ratio - round(ratio)) <= 1e-8 else None


def _baseline(motion: Piecewise, degree: int) -> Processed:
    """Subtract the polynomial of this degree with the best least-squares fit to the samples."""
    step = _step(motion, "baseline")
    times, samples = piecewise.samples(motion)
    degree = checks.whole(degree, "degree of a baseline", InvalidMotion, 0, min(10, len(samples) - 1))
    fitted = np.polynomial.Legendre.fit(times, samples, degree)(times)
    return _joined(samples - fitted, step, f"baseline of degree {degree} removed")


def _band_pass(motion: Piecewise, low: float | None, high: float | None, order: int) -> Processed:
    """Apply a Butterworth band-pass both ways with zeros at both ends (Converse and Brady 1992)."""
    from scipy import signal  # imported on first use because it takes half a second

    step = _step(motion, "band_pass")
    nyquist, duration = 0.5 / step, float(motion.breakpoints[-1])
    corners = [
        checks.positive(corner, "corner frequency", InvalidMotion, "Hz") for corner in (low, high) if corner is not None
    ]
    if not corners or corners != sorted(set(corners)) or corners[-1] >= nyquist:
        sentence = f"{{}} needs (low, high) with low < high < {nyquist:.6g} Hz, the Nyquist frequency; one of them may"
        raise InvalidMotion(f"{sentence} be None", "band_pass", value=(low, high))
    if corners[0] * duration < 0.1:
        sentence = f"a corner frequency of {corners[0]:.6g} Hz is too low for a motion of {duration:.6g} s"
        raise InvalidMotion(sentence, value=(low, high))
    order = checks.whole(order, "order of a filter", InvalidMotion, 1, 12)
    kind: Final = "bandpass" if len(corners) == 2 else "highpass" if high is None else "lowpass"
    at = corners if kind == "bandpass" else corners[0]
    sections = signal.butter(order, at, btype=kind, output="sos", fs=1.0 / step)
    pad = math.ceil(1.5 * order / corners[0] / step)
    padded = np.pad(piecewise.samples(motion)[1], pad)
    filtered: Floats = signal.sosfiltfilt(sections, padded, padtype=None)[pad:-pad]
    span = f"{'0' if low is None else f'{low:.6g}'}-{'inf' if high is None else f'{high:.6g}'} Hz"
    return _joined(filtered, step, f"band-passed {span}, order {order} forwards and backwards")


def _resample(motion: Piecewise, step: float) -> Processed:
    """Sample the motion at the multiples of `step` (s) up to its end, joined by straight lines."""
    new = checks.positive(step, "new sampling step", InvalidMotion, "s")
    duration = float(motion.breakpoints[-1])
    count = math.floor(duration / new * (1.0 + 1e-12)) + 1
    if not 2 <= count <= _MOST_SAMPLES:
        sentence = f"a step of {new:.6g} s gives {count} samples of a motion of {duration:.6g} s: it needs from 2 to"
        raise InvalidMotion(f"{sentence} {_MOST_SAMPLES}", value=step)
    times = np.minimum(new * np.arange(count), duration)
    samples = piecewise.at(motion.breakpoints, motion.coefficients, times)
    return _joined(samples, new, f"resampled to a step of {new:.6g} s")


def _step(motion: Piecewise, what: str) -> float:
    step = piecewise.even_step(motion)
    if step is None:
        raise InvalidMotion("{} needs even samples: call processed(resample=...) on the motion first", what)
    if piecewise.jumps(motion):
        raise InvalidMotion(
            "{} needs samples joined by lines, but the motion jumps: call processed(resample=...) on it first", what
        )
    return step


def _joined(samples: Floats, step: float, done: str) -> Processed:
    times = piecewise.even_times(len(samples), step)
    return Processed(times, piecewise.linear(times, samples), done)


def _floor_pieces(
    motion: Piecewise, period: float, damping: float, ringing: float | None, error: float = 0.0
) -> tuple[Floats, Floats, float]:
    """Compute the absolute acceleration of an oscillator from rest, and its error bound, m/s^2.

    For u'' + 2 z w u' + w^2 u = -a(t) it is -(2 z w u' + w^2 u). On each piece u is the Taylor series of the exact
    solution about its start, from the series of the solutions of the states (1, 0) and (0, 1) and of the one from rest.
    """
    end = float(motion.breakpoints[-1])
    time = checks.positive(period, "period", InvalidMotion, "s")
    rate, ratio = 2.0 * math.pi / time, checked_damping(damping, InvalidMotion)
    if ringing is None and ratio == 0.0:
        raise InvalidMotion("a floor without {} moves for ever: give {}, s", "damping", "ringing")
    # By default a free oscillation continues until it has decayed to a thousandth.
    after = -math.log(1e-3) / (ratio * rate) if ringing is None else ringing
    after = after if ringing is None else checks.within(ringing, "ringing", InvalidMotion, 0.0, 1e15, "s")
    step = _RADIANS / rate
    if not (end + after) / step <= 1e6:
        raise InvalidMotion(
            f"{{}} = {time:g} s is too short for a floor that is followed for {end + after:.4g} s: give a longer one, "
            "or a shorter time after the motion, {}",
            *("period", "ringing"),
            value=period,
        )
    whole = np.append(motion.breakpoints, end + after) if after > 0.0 else motion.breakpoints
    shares = np.maximum(1, np.ceil(np.diff(whole) / step)).astype(np.int64)
    start, width = np.repeat(whole[:-1], shares), np.repeat(np.diff(whole) / shares, shares)
    place = np.arange(shares.sum()) - np.repeat(np.cumsum(shares) - shares, shares)
    breakpoints = np.append(start + place * width, whole[-1])
    width = np.diff(breakpoints)
    columns = max(motion.coefficients.shape[1], _DEGREE + 1)
    given = piecewise.refined(motion.breakpoints, motion.coefficients, breakpoints, columns)
    series = _series(given, rate, ratio, columns + 2)
    ends = np.stack([_at(series, width), _at(series[..., 1:] * np.arange(1, columns + 2), width)])
    states = _marched(ends)
    solution = series[2] + np.einsum("jn,jnk->nk", states, series[:2])
    slope = solution[:, 1:] * np.arange(1, columns + 2)
    acceleration = -(2.0 * ratio * rate * slope[:, :columns] + rate**2 * solution[:, :columns])
    largest = float(np.max(np.abs(acceleration[:, 0]), initial=0.0))
    own = 4.0 * largest * _RADIANS**columns / math.factorial(columns)
    grown = error * (2.0 / ratio if ratio > 0.0 else rate * (end + after))  # sum of all effects of an error
    return breakpoints, acceleration, own + grown


def _series(given: Floats, rate: float, ratio: float, terms: int) -> Floats:
    """Return series of two free solutions and of the one from rest on each piece, shape (3, pieces, terms)."""
    series = np.zeros((3, len(given), terms))
    series[0, :, 0] = series[1, :, 1] = 1.0
    for k in range(terms - 2):
        free = 2.0 * ratio * rate * (k + 1) * series[..., k + 1] + rate * rate * series[..., k]
        free[2] += given[:, k]
        series[..., k + 2] = -free / ((k + 1) * (k + 2))
    return series


def _at(series: Floats, x: Floats) -> Floats:
    return piecewise.value(series, np.broadcast_to(x, series.shape[:-1]))


def _marched(ends: Floats) -> Floats:
    """Compute displacement and velocity at the start of every piece, shape (2, pieces)."""
    found = np.empty((2, ends.shape[2]))
    u = v = 0.0
    for k, (a, b, c, d, e, f) in enumerate(ends.transpose(2, 0, 1).reshape(-1, 6).tolist()):
        found[:, k] = u, v
        u, v = a * u + b * v + c, d * u + e * v + f
    return found


def sine_cosine(degrees: ArrayLike) -> tuple[Floats, Floats]:
    """Return sine and cosine of angles in degrees, exact at multiples of a right angle."""
    angle = np.asarray(degrees, dtype=np.float64)
    quarters = np.rint(angle / 90.0)
    sine, cosine = piecewise.from_quadrant(quarters, np.deg2rad(angle - 90.0 * quarters))
    return sine + 0.0, cosine + 0.0  # avoids negative zeros


def _recorded_azimuths(one: Processable, other: Processable, recorded: Any) -> tuple[float, float]:
    """Return the azimuths of two components, specified or from their records."""
    if recorded is None:
        recorded = [(each.description.origin or Origin()).azimuth for each in (one, other)]
        if None in recorded:
            raise InvalidMotion(
                f"the azimuth of {checks.shown((one, other)[recorded.index(None)].name)} is not known: give "
                "{}=(first, second), the directions of both components in degrees clockwise from north",
                "recorded",
            )
    given = checks.numbers(recorded, "recorded", InvalidMotion)
    if given.shape != (2,) or not np.all(np.isfinite(given)):
        raise InvalidMotion(
            "{} must be the azimuths of both components, two numbers in degrees", "recorded", value=recorded
        )
    first, second = given.tolist()
    between = abs((second - first + 90.0) % 180.0 - 90.0)
    if between < 15.0:
        raise InvalidMotion(
            f"the components point to azimuths of {first:g} and {second:g} deg, along one line to {between:g} deg: two "
            "that are across each other are needed"
        )
    return first, second


def shares(recorded: tuple[float, float], azimuth: float) -> tuple[float, float]:
    """Return the factors on two components for the component along another azimuth."""
    first, second = recorded
    sine, _ = sine_cosine([second - azimuth, azimuth - first, second - first])
    return float(sine[0] / sine[2]) + 0.0, float(sine[1] / sine[2]) + 0.0
