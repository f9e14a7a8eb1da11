"""Chattering time and critical amplitude, exact and by the approximations of the paper."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import pulses
from rocking.block import Block
from rocking.chattering.expansions import (
    MAX_ORDER,
    broadcast_flat,
    check_amplitude,
    check_frequency,
    check_lifting_amplitude,
    check_restitution,
    check_slenderness,
    compute_asymptotic_times,
    compute_series_times,
    require_scalar,
)
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.bisection import bisect
from rocking.core.progress import Progress
from rocking.core.tables import format_count
from rocking.core.threads import map_in_threads
from rocking.engine.schemes import compute_critical_amplitudes
from rocking.engine.tasks import require_finished
from rocking.errors import OptionError, UnfinishedError
from rocking.kernels.sine import SequenceStatus
from rocking.kernels.sine.sequence import RESOLVED_IMPACT as RESOLVED_IMPACT
from rocking.kernels.sine.sequence import resolve_impacts, write_rest_phases, write_semianalytical_phases
from rocking.simulation.simulate import simulate

#: Number of sequences per task of a thread.
_CHUNK_SIZE: Final = 1 << 12

#: Number of impacts in the paper, at this restitution.
_PAPER_IMPACT_COUNT: Final = 60
_PAPER_RESTITUTION: Final = 0.92

#: Relative rounding error of the bounds of the time of rest (two ulp).
_BOUND_ROUNDING: Final = 2.0**-51

_MAX_CAPACITY: Final = 1 << 23

IMPACT_DTYPE: Final = np.dtype(
    [("time", float), ("side", np.int8), ("interval", float), ("speed_before", float), ("speed_after", float)]
)


def chattering_time(
    a: ArrayLike,
    omega: ArrayLike,
    eta: ArrayLike,
    *,
    method: str = "exact",
    order: int = 4,
    impact_count: int | None = None,
) -> Floats:
    """Compute the dimensionless time from uplift to rest of a slender block under a sine.

    The block lifts off from rest as the ground acceleration a sin(omega tau + psi) reaches 1, and chatters. Chattering
    is complete if the impacts accumulate within half a period, pi/omega, after which the acceleration would lift the
    block again.

    Parameters
    ----------
    a : array_like
        Amplitude of the ground acceleration, divided by g alpha.
    omega : array_like
        Forcing frequency, divided by p of the block, from 1e-6 to 1e6.
    eta : array_like
        Coefficient of restitution, above 0 and at most 0.99999, or 1 (for which the block never rests).
    method : {"exact", "asymptotic", "series", "semianalytical"}
        "exact": impacts to a few ulp, completeness by certificate, and the infinite rest of the sequence by
        extrapolation with its known ratios; accurate to 1e-13 relative (5e-13 above eta = 0.95), except close to the
        critical amplitude, where a change of two ulp limits the accuracy (Notes). "asymptotic": Eq. 65 of the paper.
        "series": the consistent expansion in a - 1. "semianalytical": Eq. 75 of the paper, with the certificate of
        "exact" for completeness.
    order : int
        Number of terms of "series", 1 to 40.
    impact_count : int, optional
        Number of impacts that "semianalytical" resolves before its geometric sum. By default 60, and above eta = 0.92
        enough for the same decrease of the speed as 60 impacts at 0.92.

    Returns
    -------
    array of float
        Chattering time multiplied by p, of the broadcast shape (a scalar for scalars). NaN if a < 1, 0 if a = 1.
        "exact" and "semianalytical" return NaN for incomplete chattering, and infinity if double precision decides
        nothing (possible within rounding of the critical amplitude, but no case is known). The two expansions return a
        value for every a >= 1 (infinity at eta = 1, and beyond the range of a double), even if chattering is
        incomplete.

    See Also
    --------
    is_complete : Determine whether chattering is complete.
    critical_amplitude : Compute the largest amplitude with complete chattering.
    chattering_sequence : Resolve one sequence impact by impact.

    Notes
    -----
    Source: :cite:t:`giouvanidis2022`, Eqs 4 to 13 (problem), 65 and 75.

    Close to the critical amplitude a_cr the relative error of "exact" is at most 2^-51 nu (pi/omega - tau)/((a_cr - a)
    tau) plus 1e-13, with an exponent nu of eta alone (`critical_amplitude`): for example, 3e-12 at 1e-8 below a_cr for
    omega = 2 and eta = 0.92 (documentation, "The critical amplitude, and how it is approached").

    Examples
    --------
    >>> round(float(chattering_time(1.03, 2.0, 0.92)), 12)
    1.125947676934
    """
    order = checks.integer(order, "order", OptionError, 1, MAX_ORDER)
    if impact_count is not None:
        impact_count = checks.integer(impact_count, "impact_count", OptionError, 1, 1_000_000)
    parameters = check_amplitude(a), check_frequency(omega), check_restitution(eta)
    methods: dict[str, Callable[[], Floats]] = {
        "exact": lambda: _compute_exact_times(*parameters),
        "asymptotic": lambda: compute_asymptotic_times(*parameters),
        "series": lambda: compute_series_times(*parameters, order),
        "semianalytical": lambda: _compute_semianalytical_times(*parameters, impact_count),
    }
    selected = checks.choice(method, "method", OptionError, list(methods))
    return methods[selected]()


def is_complete(a: ArrayLike, omega: ArrayLike, eta: ArrayLike) -> NDArray[np.bool_]:
    """Determine whether the block comes to rest before the next threshold crossing (complete chattering).

    Parameters
    ----------
    a, omega, eta : array_like
        As in `chattering_time`.

    Returns
    -------
    array of bool
        Array of the broadcast shape. True is proven by a certificate, False by an arc that outlasts half a period (or,
        within rounding of the critical amplitude, by the lack of a proof). False if a < 1 (no uplift).

    See Also
    --------
    critical_amplitude : Compute the largest amplitude with complete chattering.

    Examples
    --------
    >>> is_complete([1.03, 1.05], 2.0, 0.92)
    array([ True, False])
    """
    return np.isfinite(chattering_time(a, omega, eta))


@dataclass(frozen=True, eq=False)
class ChatteringSequence:
    """Resolved impacts of one chattering sequence, with its time of rest.

    Attributes
    ----------
    impacts : structured array
        Fields time (since uplift), side (entered, +1 or -1; the first arc is on side -1), interval (since the previous
        impact, or since uplift), and speed_before and speed_after (|phi'|), all dimensionless.
    is_complete : bool
        Whether the impacts accumulate within half a period.
    time, lower, upper : float
        Time of rest, and its bounds proven by the certificate from the time and speed of the last impact; NaN if
        chattering is incomplete. Within rounding of the critical amplitude the bracket may extend from the last impact
        to half a period.

    See Also
    --------
    chattering_sequence : Resolve one sequence impact by impact.

    Examples
    --------
    >>> from rocking import chattering
    >>> sequence = chattering.chattering_sequence(1.03, 2.0, 0.92)
    >>> f"rest at {sequence.time:.6f}, complete: {sequence.is_complete}"
    'rest at 1.125948, complete: True'
    """

    impacts: NDArray[np.void]
    is_complete: bool
    time: float
    lower: float
    upper: float

    def __repr__(self) -> str:
        end = f"complete, at rest at p t = {self.time:.9g}" if self.is_complete else "incomplete"
        return f"<ChatteringSequence: {format_count(len(self.impacts), 'impact')} resolved; {end}>"


def chattering_sequence(a: float, omega: float, eta: float, *, tolerance: float = 1e-12) -> ChatteringSequence:
    """Resolve one sequence impact by impact (paper, Eqs 6, 13, 15 and 20) until its time of rest is bracketed.

    Parameters
    ----------
    a, omega, eta : float
        As in `chattering_time`, with a at least 1.
    tolerance : float
        Width of the bracket, divided by the time of rest, at which to stop; at least 1e-15.

    Returns
    -------
    ChatteringSequence
        Impacts and bracket.

    See Also
    --------
    chattering_time : Compute the time of rest of many sequences.
    interval_ratios : Compute the ratios of the intervals.

    Examples
    --------
    >>> chattering = chattering_sequence(1.03, 2.0, 0.92)
    >>> chattering.is_complete, chattering.impacts["side"][:3].tolist()
    (True, [1, -1, 1])
    """
    amplitude, frequency, restitution = _check_case(a, omega, eta)
    if checks.finite(tolerance, "tolerance", OptionError) < 1e-15:
        raise OptionError(f"{{}} must be finite and at least 1e-15; got {tolerance!r}", "tolerance", value=tolerance)
    if amplitude == 1.0:
        return ChatteringSequence(np.zeros(0, IMPACT_DTYPE), True, 0.0, 0.0, 0.0)
    capacity, half_period = 512, math.pi / frequency
    while True:
        status, impacts, phases = _resolve_sequence(amplitude, frequency, restitution, tolerance, capacity)
        has_stalled = impacts.size > 1 and not impacts["time"][-1] > impacts["time"][impacts.size // 2]
        if status != SequenceStatus.UNRESOLVED or impacts.size < capacity or has_stalled:
            break
        capacity *= 2
        if capacity > _MAX_CAPACITY:
            message = f"the sequence has more than {_MAX_CAPACITY} impacts: reduce {{}} = {eta!r}"
            raise OptionError(message, "eta", value=eta)
    # A sequence that lasts almost half a period may have the critical amplitude within rounding error.
    if status == SequenceStatus.UNRESOLVED or impacts["time"].max(initial=0.0) > half_period * (1.0 - 1e-6):
        # If rounding error decides, `chattering_time` determines the outcome.
        rest_time = float(chattering_time(amplitude, frequency, restitution))
        if status != SequenceStatus.FOUND and math.isfinite(rest_time):
            impacts = impacts[impacts["time"] < rest_time]
            return ChatteringSequence(impacts, True, rest_time, float(impacts["time"].max(initial=0.0)), half_period)
        status = status if math.isfinite(rest_time) else SequenceStatus.INCOMPLETE
    if status == SequenceStatus.FOUND:
        return ChatteringSequence(impacts, True, *phases)
    return ChatteringSequence(impacts, False, math.nan, math.nan, math.nan)


def interval_ratios(a: float, omega: float, eta: float, n: int) -> Floats:
    """Compute the ratios of the intervals between every second impact, which tend to eta^2 (paper, Eq. 73 and Fig. 3).

    Parameters
    ----------
    a, omega, eta : float
        As in `chattering_time`, with a above 1.
    n : int
        Number of ratios, 1 to 100,000.

    Returns
    -------
    array of float, shape (n,)
        Ratios of interval k + 2 to interval k, k = 0 ... n - 1; NaN once an arc outlasts half a period or intervals
        fall below 1e-120.

    See Also
    --------
    chattering_sequence : Resolve one sequence impact by impact.

    Examples
    --------
    >>> ratios = interval_ratios(1.03, 2.0, 0.86, 60)
    >>> round(float(ratios[-1]), 3), round(0.86**2, 3)
    (0.74, 0.74)
    """
    amplitude, frequency, restitution = _check_case(a, omega, eta)
    n = checks.integer(n, "n", OptionError, 1, 100_000)
    ratios = np.full(n, math.nan)
    intervals = _resolve_sequence(amplitude, frequency, restitution, -1.0, n + 2)[1]["interval"]
    intervals = intervals[intervals > 0.0]
    known_count = max(0, intervals.size - 2)
    ratios[:known_count] = intervals[2:] / intervals[:known_count]
    return ratios


def _check_case(a: float, omega: float, eta: float) -> tuple[float, float, float]:
    """Return the parameters of a single sequence as floats."""
    amplitude = check_lifting_amplitude(a)
    return amplitude, require_scalar(check_frequency(omega), "omega"), require_scalar(check_restitution(eta), "eta")


def _resolve_sequence(
    a: float, omega: float, eta: float, tolerance: float, capacity: int
) -> tuple[int, NDArray[np.void], tuple[float, float, float]]:
    """Compute the status (UNRESOLVED if the capacity is exhausted), impacts, and time of rest with its bracket."""
    table = np.zeros(capacity, RESOLVED_IMPACT)
    status, count, rest, lower, upper = resolve_impacts(a - 1.0, 1.0 / (omega * omega), eta, tolerance, table)
    table = table[:count]
    impacts = np.zeros(count, IMPACT_DTYPE)
    impacts["interval"] = table["interval"] / omega
    impacts["time"] = np.cumsum(table["interval"]) / omega
    impacts["side"] = np.where(np.arange(count) % 2 == 0, 1, -1)
    impacts["speed_before"] = table["before"] / omega
    impacts["speed_after"] = table["after"] / omega
    return (
        status,
        impacts,
        (rest / omega, lower / omega * (1.0 - _BOUND_ROUNDING), upper / omega * (1.0 + _BOUND_ROUNDING)),
    )


def _compute_exact_times(a: Floats, omega: Floats, eta: Floats) -> Floats:
    """Compute the chattering times by method "exact"."""
    shape, (amplitudes, frequencies, restitutions) = broadcast_flat(a, omega, eta)
    times = np.where(amplitudes == 1.0, 0.0, math.nan)
    rocking_indices = np.flatnonzero((amplitudes > 1.0) & (restitutions < 1.0))

    def compute_chunk(start: int) -> None:
        chunk = rocking_indices[start : start + _CHUNK_SIZE]
        phases, statuses = np.zeros(chunk.size), np.zeros(chunk.size, np.int8)
        write_rest_phases((amplitudes[chunk], frequencies[chunk], restitutions[chunk]), phases, statuses)
        phases[statuses == SequenceStatus.INCOMPLETE] = math.nan
        phases[statuses == SequenceStatus.UNRESOLVED] = math.inf
        times[chunk] = phases / frequencies[chunk]

    # The compiled function holds no lock.
    for _ in map_in_threads(compute_chunk, range(0, rocking_indices.size, _CHUNK_SIZE)):
        pass
    return times.reshape(shape)[()]


def _compute_semianalytical_times(a: Floats, omega: Floats, eta: Floats, impact_count: int | None) -> Floats:
    """Compute the chattering times by method "semianalytical"."""
    shape, (amplitudes, frequencies, restitutions) = broadcast_flat(a, omega, eta)
    exact = np.atleast_1d(_compute_exact_times(amplitudes, frequencies, restitutions))
    times = np.where(amplitudes == 1.0, 0.0, exact)
    complete = np.flatnonzero(np.isfinite(exact) & (amplitudes > 1.0))
    sequences = amplitudes[complete], frequencies[complete], restitutions[complete]
    impact_counts = choose_impact_counts(sequences[2]) if impact_count is None else np.full(complete.size, impact_count)
    phases = np.zeros(complete.size)
    statuses = np.full(complete.size, SequenceStatus.UNRESOLVED, np.int8)
    write_semianalytical_phases(sequences, impact_counts, phases, statuses)
    # Chattering is proven to be complete, so that an estimate beyond half a period is inaccurate.
    phases[statuses == SequenceStatus.UNRESOLVED] = math.inf
    times[complete] = phases / sequences[1]
    return times.reshape(shape)[()]


def choose_impact_counts(eta: Floats) -> NDArray[np.int64]:
    """Compute the default number of impacts that Eq. 75 resolves."""
    counts = np.ceil(_PAPER_IMPACT_COUNT * math.log(_PAPER_RESTITUTION) / np.log(eta))
    return np.maximum(counts, _PAPER_IMPACT_COUNT).astype(np.int64)


#: Phase before uplift at which the simulated motion starts.
_LEAD_PHASE: Final = 0.1


def critical_amplitude(omega: ArrayLike, eta: ArrayLike, *, method: str = "exact") -> Floats:
    """Compute the amplitude of the ground acceleration up to which chattering is complete.

    Parameters
    ----------
    omega, eta : array_like
        Forcing frequency, divided by p, and coefficient of restitution.
    method : {"exact", "eq76", "eq77"}
        "exact": root finding on certified sequences, to 1e-14. "eq76", "eq77": fits of the paper, with errors up to 1.1
        and 5.4 % for eta from 0.5 to 0.97, omega from 0.5 to 8.

    Returns
    -------
    array of float
        a_cr, divided by g alpha, of the broadcast shape (a scalar for scalars): supremum of the amplitudes whose first
        impacts accumulate within half a period of uplift.

    Warns
    -----
    OutsideFitWarning
        If "eq76" or "eq77" is used beyond these ranges, where the fits are meaningless.

    See Also
    --------
    critical_amplitude_nonlinear : Compute the critical amplitude of the nonlinear block.
    critical_report : Compare all methods.

    Notes
    -----
    Source: section 5.1 of the paper, Eqs 76 and 77. As a approaches a_cr, the time of rest approaches pi/omega like a
    power of a_cr - a with an exponent of eta alone: 0.600 at eta = 0.92 and above, 0.612 at 0.5, to 1 towards 0.

    Examples
    --------
    >>> round(float(critical_amplitude(2.0, 0.92)), 12)
    1.03801553873
    """
    selected = checks.choice(method, "method", OptionError, ("exact", "eq76", "eq77"))
    shape, flat_parameters = broadcast_flat(check_frequency(omega), check_restitution(eta))
    return compute_critical_amplitudes(selected, *flat_parameters).reshape(shape)[()]


def critical_amplitude_nonlinear(omega: ArrayLike, eta: ArrayLike, alpha: ArrayLike) -> Floats:
    """Compute the critical amplitude of the nonlinear block, which tends to `critical_amplitude` in the slender limit.

    Parameters
    ----------
    omega, eta : array_like
        As in `critical_amplitude`.
    alpha : array_like
        Slenderness angle, rad, between 0 and pi/2.

    Returns
    -------
    array of float
        Ground acceleration, divided by the uplift acceleration g tan(alpha), of the broadcast shape; NaN if eta is too
        close to 1 for a simulation. Multiply by tan(alpha)/alpha to normalise by g alpha, as in the slender theory.

    See Also
    --------
    critical_amplitude : Compute the critical amplitude of a slender block.

    Notes
    -----
    The method is bisection to 1e-12 on rest within half a period of uplift in `rocking.simulate` (nonlinear,
    certified), with about 40 simulations per value. Source: Eqs 1, 2 and 13 and section 5.1 of the paper.

    Examples
    --------
    >>> nonlinear = critical_amplitude_nonlinear(2.0, 0.92, 0.2)
    >>> f"{nonlinear - critical_amplitude(2.0, 0.92):.1e}"
    '-7.3e-06'
    """
    parameters = check_frequency(omega), check_restitution(eta), check_slenderness(alpha)
    shape, flat_parameters = broadcast_flat(*parameters)
    cases = list(zip(*(values.tolist() for values in flat_parameters), strict=True))
    amplitudes = np.empty(len(cases))
    with Progress("bisecting", len(cases)) as bar:
        for k, amplitude in enumerate(map_in_threads(lambda case: _bisect_critical_amplitude(*case), cases)):
            amplitudes[k] = amplitude
            bar.advance()
    return amplitudes.reshape(shape)[()]


def _bisect_critical_amplitude(omega: float, eta: float, alpha: float) -> float:
    """Find the critical amplitude of one nonlinear block; NaN if a simulation does not finish."""
    if eta == 1.0:
        return 1.0
    block = Block.from_parameters(p=1.0, alpha=alpha, restitution=eta)
    # No complete first sequence has been observed above 1.5.
    low, high = 1.0, 1.5
    try:
        while _comes_to_rest(block, high, omega):
            low, high = high, 2.0 * high
        return bisect(low, high, lambda a: not _comes_to_rest(block, a, omega), width=1e-12)[0]
    except UnfinishedError:
        return math.nan


def _comes_to_rest(block: Block, a: float, omega: float) -> bool:
    """Whether the block rests within half a period of its first uplift under a sine of amplitude a g tan(alpha)."""
    amplitude, two_pi = a * block.gravity * math.tan(block.sides[0].alpha), 2.0 * math.pi
    cycles, phase = (math.pi + _LEAD_PHASE) / two_pi, math.asin(1.0 / a) - _LEAD_PHASE
    motion = pulses.sine(amplitude, omega / two_pi, cycles=cycles, phase=phase)
    response = simulate(block, motion, model="nonlinear", duration=motion.duration)
    require_finished(response.unfinished)
    return bool((response.events["kind"] == "rest").any())
