"""Columns of times: whether they increase, and their step where it is even."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Even times may be off their grid by this share of the step (or by what the printed decimals round away).
_JITTER = 1e-6
_MOST_DECIMALS = 9

#: Later times are mistakes, s (30,000 years).
_LATEST = 1e12


def first_fault(times: NDArray[np.float64]) -> int | None:
    """Return the index of the first time that does not come after the one before it, or None."""
    with np.errstate(over="ignore"):
        fine = (np.diff(times) > 0.0) & (np.abs(times[1:]) <= _LATEST) & (np.abs(times[:-1]) <= _LATEST)
    faults = np.flatnonzero(~fine)
    return int(faults[0]) + 1 if len(faults) else None


def even_step(times: NDArray[np.float64]) -> float | None:
    """Return the step of increasing `times` (s) if they are even up to their printed decimals, else None.

    Of all steps that fit, the one with the fewest digits is returned: times printed with three decimals at
    200 samples per second give exactly 0.005.
    """
    intervals = len(times) - 1
    mean = float(times[-1] - times[0]) / intervals
    rounding = 4.0 * float(np.spacing(np.abs(times).max()))
    resolution = _resolution(times, rounding)
    if resolution > mean * (1.0 + _JITTER):
        return None
    step = _simplest(mean, max(resolution, _JITTER * mean, rounding) / intervals)
    deviation = times - times[0] - step * np.arange(len(times))
    # A step that the decimals can write leaves no rounding: then a whole missing sample must not pass for it.
    writable = resolution == 0.0 or abs(step / resolution - round(step / resolution)) <= _JITTER
    allowed = rounding + (_JITTER * mean if writable else resolution * (1.0 + _JITTER))
    return step if float(deviation.max() - deviation.min()) <= allowed else None


def _resolution(times: NDArray[np.float64], rounding: float) -> float:
    """Return the place of the last decimal that the times were printed with, s; 0 for all digits."""
    for decimals in range(_MOST_DECIMALS + 1):
        scaled = times * 10.0**decimals
        if float(np.abs(scaled - np.rint(scaled)).max()) <= max(_JITTER, rounding * 10.0**decimals):
            return 10.0**-decimals
    return 0.0


def _simplest(value: float, tolerance: float) -> float:
    candidates = (float(f"{value:.{digits}g}") for digits in range(1, 17))
    return next((each for each in candidates if abs(each - value) <= tolerance), value)
