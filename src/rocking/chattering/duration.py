"""How long chattering lasts: the exact sequence, its bracket, and the paper's approximations of its duration."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.chattering.asymptotic import asymptotic_times
from rocking.chattering.parameters import (
    FloatArray,
    broadcast,
    checked_amplitude,
    checked_count,
    checked_frequency,
    checked_restitution,
    single,
)
from rocking.chattering.series import series_times
from rocking.errors import InvalidOption
from rocking.kernels.sine_lanes import BLOCK, LANES, rest_times
from rocking.kernels.sine_sequence import resolve, semianalytical_times

#: Sequences that are worth a thread of their own.
_SEQUENCES_PER_THREAD: Final = 4096

#: Classes of eta by which sequences are sorted, so that those of a block take about as many impacts.
_RESTITUTION_CLASSES: Final = 1000

#: Two ulp: what adding to a phase and dividing by omega may lose of the bracket.
_ROUNDING: Final = 2.0**-51

_FIRST_CAPACITY: Final = 512
_LARGEST_CAPACITY: Final = 1 << 23

IMPACT: Final = np.dtype(
    [("time", float), ("side", np.int8), ("interval", float), ("speed_before", float), ("speed_after", float)]
)


def chattering_time(
    a: ArrayLike,
    omega: ArrayLike,
    eta: ArrayLike,
    *,
    method: str = "exact",
    order: int = 4,
    resolved: int = 60,
) -> FloatArray:
    """Dimensionless time from uplift to rest of a slender block under a sine.

    The block lifts off at rest as the ground acceleration a sin(omega tau + psi) reaches 1, and chatters. Chattering
    is complete if its impacts accumulate before half a period, pi/omega, is over, when the acceleration would lift
    it again.

    Parameters
    ----------
    a : array_like
        Amplitude of the ground acceleration over g alpha, dimensionless.
    omega : array_like
        Forcing frequency over the block's p, from 1e-6 to 1e6.
    eta : array_like
        Coefficient of restitution, above 0 and at most 0.99999, or 1 (which never rests).
    method : {"exact", "asymptotic", "series", "semianalytical"}
        "exact": every impact to a few ulp, completeness proven by certificate, the infinite rest of the sequence
        extrapolated with its known ratios; 1e-13 relative except within 1e-9 of the critical amplitude. "asymptotic":
        the paper's Eq. 65. "series": the consistent expansion in a - 1. "semianalytical": the paper's Eq. 75.
    order : int
        Terms of "series", 1 to 40.
    resolved : int
        Impacts that "semianalytical" resolves before its geometric sum.

    Returns
    -------
    array of float
        p times the chattering time, of the broadcast shape of a, omega and eta (a number for numbers). NaN where
        a < 1, 0 where a = 1. "exact" and "semianalytical" give NaN for incomplete chattering; the two expansions
        are finite for every a >= 1 (infinite at eta = 1) and know nothing of it.

    Raises
    ------
    InvalidOption
        If a parameter is NaN, infinite or out of range, or the method is not one of these.

    Notes
    -----
    Source: "Chattering: An overlooked peculiarity of rocking motion", Eqs 4 to 13 (problem), 65 and 75. Large
    arrays are shared among the processor's cores.

    Examples
    --------
    >>> round(float(chattering_time(1.03, 2.0, 0.92)), 12)
    1.125947676934
    >>> chattering_time([1.01, 1.05], 2.0, 0.92).round(6)
    array([0.564391,      nan])
    >>> round(float(chattering_time(1.01, 2.0, 0.92, method="asymptotic")), 6)
    0.573426
    """
    order = checked_count(order, "order", 1, 40)
    resolved = checked_count(resolved, "resolved", 1, 1_000_000)
    parameters = checked_amplitude(a), checked_frequency(omega), checked_restitution(eta)
    methods: dict[str, Callable[[], FloatArray]] = {
        "exact": lambda: _exact_times(*parameters),
        "asymptotic": lambda: asymptotic_times(*parameters),
        "series": lambda: series_times(*parameters, order),
        "semianalytical": lambda: _semianalytical_times(*parameters, resolved),
    }
    if method not in methods:
        raise InvalidOption(f"method must be one of {', '.join(map(repr, methods))}, not {method!r}")
    return methods[method]()


def is_complete(a: ArrayLike, omega: ArrayLike, eta: ArrayLike) -> NDArray[np.bool_]:
    """Whether chattering is complete: the block comes to rest before the next threshold crossing.

    Parameters
    ----------
    a, omega, eta : array_like
        As in `chattering_time`.

    Returns
    -------
    array of bool
        Of the broadcast shape. True is proven by certificate, False by an arc that outlasts half a period; a < 1
        never lifts off and is False.

    Raises
    ------
    InvalidOption
        If a parameter is NaN, infinite or out of range.

    Examples
    --------
    >>> is_complete([1.03, 1.05], 2.0, 0.92)
    array([ True, False])
    """
    return np.isfinite(chattering_time(a, omega, eta))


@dataclass(frozen=True)
class ChatteringSequence:
    """The resolved impacts of one chattering sequence and what follows from the last.

    Attributes
    ----------
    impacts : structured array
        time (since uplift), side (entered, +1 or -1; the first arc is on side -1), interval (since the impact before,
        or since uplift), speed_before and speed_after (|phi'|), all dimensionless.
    complete : bool
        Whether the impacts accumulate before half a period is over.
    time, lower, upper : float
        Time of rest and the bracket on it that the certificate proves from the last impact's time and speed; NaN where
        chattering is incomplete.
    """

    impacts: NDArray[np.void]
    complete: bool
    time: float
    lower: float
    upper: float


def sequence(a: float, omega: float, eta: float, *, tolerance: float = 1e-12) -> ChatteringSequence:
    """Resolve one sequence impact by impact until its time of rest is bracketed.

    Parameters
    ----------
    a : float
        Amplitude over g alpha, at least 1.
    omega, eta : float
        As in `chattering_time`.
    tolerance : float
        Width of the bracket over the time of rest at which to stop, 1e-15 or more.

    Returns
    -------
    ChatteringSequence
        Impacts and bracket.

    Raises
    ------
    InvalidOption
        If a parameter is not a single number or out of range.

    Notes
    -----
    Source: the paper's Eqs 6, 13, 15 and 20; the certificate is this package's own (documentation, "Theory").

    Examples
    --------
    >>> chattering = sequence(1.03, 2.0, 0.92)
    >>> chattering.complete, chattering.impacts["side"][:3].tolist()
    (True, [1, -1, 1])
    >>> bool(chattering.lower <= chattering.time <= chattering.upper)
    True
    """
    amplitude, frequency, restitution = _single_case(a, omega, eta)
    if not 1e-15 <= tolerance < math.inf:
        raise InvalidOption(f"tolerance must be at least 1e-15 and finite, not {tolerance!r}")
    if amplitude == 1.0:
        return ChatteringSequence(np.zeros(0, IMPACT), True, 0.0, 0.0, 0.0)
    capacity = _FIRST_CAPACITY
    while True:
        impacts, rest, lower, upper = _resolved(amplitude, frequency, restitution, tolerance, capacity)
        if not math.isnan(rest):
            break
        capacity *= 2
        if capacity > _LARGEST_CAPACITY:
            raise InvalidOption(f"the sequence takes more than {_LARGEST_CAPACITY} impacts: lower eta = {eta!r}")
    if rest == -math.inf:
        return ChatteringSequence(impacts, False, math.nan, math.nan, math.nan)
    return ChatteringSequence(impacts, True, rest, lower, upper)


def interval_ratios(a: float, omega: float, eta: float, n: int) -> FloatArray:
    """Ratios of the intervals between every second impact, which tend to eta^2.

    Parameters
    ----------
    a : float
        Amplitude over g alpha, above 1.
    omega, eta : float
        As in `chattering_time`.
    n : int
        How many ratios, 1 to 100,000.

    Returns
    -------
    array of float, shape (n,)
        Interval k + 2 over interval k, for k = 0 ... n - 1, from resolved impacts; NaN from where an arc outlasts
        half a period, or the intervals fall below 1e-120.

    Raises
    ------
    InvalidOption
        If a parameter is not a single number or out of range.

    Notes
    -----
    Source: the paper's Eq. 73 and Fig. 3.

    Examples
    --------
    >>> ratios = interval_ratios(1.03, 2.0, 0.86, 60)
    >>> round(float(ratios[-1]), 3), round(0.86**2, 3)
    (0.74, 0.74)
    """
    amplitude, frequency, restitution = _single_case(a, omega, eta)
    n = checked_count(n, "n", 1, 100_000)
    ratios = np.full(n, math.nan)
    intervals = _resolved(amplitude, frequency, restitution, -1.0, n + 2)[0]["interval"]
    intervals = intervals[intervals > 0.0]
    known = max(0, intervals.size - 2)
    ratios[:known] = intervals[2:] / intervals[:known]
    return ratios


def _single_case(a: float, omega: float, eta: float) -> tuple[float, float, float]:
    amplitude = single(checked_amplitude(a), "a")
    if amplitude < 1.0:
        raise InvalidOption(f"a must be at least 1, or the block does not lift off, not {amplitude:g}")
    return amplitude, single(checked_frequency(omega), "omega"), single(checked_restitution(eta), "eta")


def _resolved(
    a: float, omega: float, eta: float, tolerance: float, capacity: int
) -> tuple[NDArray[np.void], float, float, float]:
    """Impacts, time of rest and bracket; NaN: the capacity is used up, minus infinity: incomplete."""
    intervals, before, after = np.zeros((3, capacity))
    count, rest, lower, upper = resolve(a - 1.0, 1.0 / (omega * omega), eta, tolerance, intervals, before, after)
    impacts = np.zeros(count, IMPACT)
    impacts["interval"] = intervals[:count] / omega
    impacts["time"] = np.cumsum(intervals[:count]) / omega
    impacts["side"] = np.where(np.arange(count) % 2 == 0, 1, -1)
    impacts["speed_before"] = before[:count] / omega
    impacts["speed_after"] = after[:count] / omega
    return impacts, rest / omega, lower / omega * (1.0 - _ROUNDING), upper / omega * (1.0 + _ROUNDING)


def _exact_times(a: FloatArray, omega: FloatArray, eta: FloatArray) -> FloatArray:
    shape, (amplitudes, frequencies, restitutions) = broadcast(a, omega, eta)
    times = np.where(amplitudes == 1.0, 0.0, math.nan)
    order = _alike_together(np.flatnonzero(restitutions < 1.0), restitutions)

    def part(selected: NDArray[np.int64]) -> None:
        rest_times(amplitudes, frequencies, restitutions, selected, np.zeros(BLOCK), times)

    _share(part, order)
    return times.reshape(shape)[()]


def _alike_together(order: NDArray[np.int64], eta: FloatArray) -> NDArray[np.int64]:
    """Sort the sequences by eta, coarsely (a radix sort)."""
    classes = (eta[order] * _RESTITUTION_CLASSES).astype(np.uint16)
    if order.size <= LANES or classes.min() == classes.max():
        return order
    return order[np.argsort(classes, kind="stable")]


def _share(part: Callable[[NDArray[np.int64]], None], order: NDArray[np.int64]) -> None:
    """Run a compiled function, which holds no lock, on whole blocks of the sequences in several threads."""
    threads = min(_cores(), order.size // _SEQUENCES_PER_THREAD)
    if threads < 2:
        part(order)
        return
    size = -(-order.size // (4 * threads * LANES)) * LANES
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(part, (order[start : start + size] for start in range(0, order.size, size))))


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _semianalytical_times(a: FloatArray, omega: FloatArray, eta: FloatArray, resolved: int) -> FloatArray:
    shape, (amplitudes, frequencies, restitutions) = broadcast(a, omega, eta)
    times = np.where(amplitudes == 1.0, 0.0, math.nan)
    rests = np.flatnonzero(restitutions < 1.0)
    some = np.zeros(rests.size)
    semianalytical_times(amplitudes[rests], frequencies[rests], restitutions[rests], resolved, some)
    times[rests] = some
    return times.reshape(shape)[()]
