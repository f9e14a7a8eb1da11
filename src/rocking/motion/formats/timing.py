"""Columns of times: whether they increase, and their step where it is even."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Even times may be off their grid by this share of the step (or by what the printed decimals round away).
_JITTER = 1e-6
_MOST_DECIMALS = 9

#: Rounded times leave the best even grid by one unit of their last decimal, and a little for that grid's own error.
_SPREAD = 1.25

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
    multiple = round(mean / resolution) * resolution if resolution else 0.0
    if abs(multiple - mean) <= (resolution + rounding) / intervals:
        # The decimals can write this step, so nothing is rounded: a missing sample must not pass for rounding.
        return _simplest_fit(times, multiple, rounding, _JITTER * mean + rounding)
    if resolution > 0.5 * mean:
        return None
    allowed = max(_SPREAD * resolution, _JITTER * mean) + rounding
    return _simplest_fit(times, _slope(times), (_SPREAD - 1.0) * resolution + rounding, allowed)


def _resolution(times: NDArray[np.float64], rounding: float) -> float:
    """Return the place of the last decimal that the times were printed with, s; 0 for all digits."""
    for decimals in range(_MOST_DECIMALS + 1):
        scaled = times * 10.0**decimals
        if float(np.abs(scaled - np.rint(scaled)).max()) <= max(_JITTER, rounding * 10.0**decimals):
            return 10.0**-decimals
    return 0.0


def _slope(times: NDArray[np.float64]) -> float:
    """Return the least-squares step."""
    index = np.arange(len(times)) - 0.5 * (len(times) - 1)
    return float(index @ times / (index @ index))


def _simplest_fit(times: NDArray[np.float64], step: float, drift: float, allowed: float) -> float | None:
    """Return the step of fewest digits that stays within `drift` of `step`, s, over all the times.

    None if the times leave its grid by more than `allowed`.
    """
    candidates = (float(f"{step:.{digits}g}") for digits in range(1, 18))
    simplest = next((each for each in candidates if abs(each - step) * len(times) <= drift), step)
    spread = float(np.ptp(times - simplest * np.arange(len(times))))
    return simplest if spread <= allowed else None
