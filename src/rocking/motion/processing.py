"""Processing of a ground motion: trim, baseline, band-pass, resample; each gives new pieces, and says what it did."""

from __future__ import annotations

import math
from typing import Final, NamedTuple, TypeVar

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.errors import InvalidMotion
from rocking.motion import piecewise
from rocking.motion.piecewise import Piecewise

T = TypeVar("T")

_MOST_SAMPLES: Final = 50_000_000

#: Ratios of times and steps are off a whole number by no more than this, through rounding.
_ROUNDING: Final = 1e-8


class Processed(NamedTuple):
    """Pieces after one step of processing, and what was done, for the motion's history."""

    breakpoints: Floats
    coefficients: Floats
    done: str


def pair(values: tuple[T, T], what: str) -> tuple[T, T]:
    """Return the two values of the argument `what`."""
    try:
        first, second = values
    except (TypeError, ValueError) as error:
        raise InvalidMotion(f"{{}} takes two numbers, not {values!r}", what, value=values) from error
    return first, second


def ends(motion: Piecewise, start: float, end: float) -> tuple[float, float]:
    """Return the ends (s) of the part to keep; those of even samples are moved to the nearest sample."""
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


def cut(motion: Piecewise, start: float, end: float, grid: float | None = None) -> Processed:
    """Keep the part from `start` to `end` (s), exactly; it starts at 0 then.

    Even samples stay even where both ends are samples, or where they are multiples of a step `grid` (s) that divides
    the samples' own: the part has that step then.
    """
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
    return round(ratio) if abs(ratio - round(ratio)) <= _ROUNDING else None


def baseline(motion: Piecewise, degree: int) -> Processed:
    """Subtract the polynomial of the given degree that fits the samples best (least squares)."""
    step = _step(motion, "baseline")
    times, samples = piecewise.samples(motion)
    degree = checks.whole(degree, "degree of a baseline", InvalidMotion, 0, min(10, len(samples) - 1))
    fitted = np.polynomial.Legendre.fit(times, samples, degree)(times)
    return _joined(samples - fitted, step, f"baseline of degree {degree} removed")


def band_pass(motion: Piecewise, low: float | None, high: float | None, *, order: int) -> Processed:
    """Filter with a Butterworth band-pass, forwards and backwards, zeros added at both ends meanwhile.

    The zeros last ``1.5 order / low`` on each side (Converse and Brady 1992); without `low`, ``1.5 order / high``.
    They are cut off again, and with them what the filter spread there, so the displacement may keep a slow drift.
    """
    from scipy import signal  # half a second: loaded only where it is used

    step = _step(motion, "band_pass")
    corners = _corners(motion, step, low, high)
    order = checks.whole(order, "order of a filter", InvalidMotion, 1, 12)
    kind: Final = "bandpass" if len(corners) == 2 else "highpass" if high is None else "lowpass"
    at = corners if kind == "bandpass" else corners[0]
    sections = signal.butter(order, at, btype=kind, output="sos", fs=1.0 / step)
    pad = math.ceil(1.5 * order / corners[0] / step)
    padded = np.pad(piecewise.samples(motion)[1], pad)
    filtered: Floats = signal.sosfiltfilt(sections, padded, padtype=None)[pad:-pad]
    span = f"{'0' if low is None else f'{low:.6g}'}-{'inf' if high is None else f'{high:.6g}'} Hz"
    return _joined(filtered, step, f"band-passed {span}, order {order} forwards and backwards")


def _corners(motion: Piecewise, step: float, low: float | None, high: float | None) -> list[float]:
    corners = [
        checks.positive(corner, "corner frequency", InvalidMotion, "Hz") for corner in (low, high) if corner is not None
    ]
    nyquist, duration = 0.5 / step, float(motion.breakpoints[-1])
    if not corners or corners != sorted(set(corners)) or corners[-1] >= nyquist:
        sentence = (
            f"{{}} needs (low, high) with low < high < {nyquist:.6g} Hz, the Nyquist frequency; one of them may be"
        )
        raise InvalidMotion(f"{sentence} None", "band_pass", value=(low, high))
    if corners[0] * duration < 0.1:
        sentence = f"a corner frequency of {corners[0]:.6g} Hz is too low for a motion of {duration:.6g} s"
        raise InvalidMotion(sentence, value=(low, high))
    return corners


def resample(motion: Piecewise, step: float) -> Processed:
    """Take the motion's values at the multiples of `step` (s) up to its end, joined by straight lines."""
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
