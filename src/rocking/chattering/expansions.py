"""Expansions of the chattering time in eps = a - 1: asymptotic (from the paper), and consistent to any order."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import OptionError
from rocking.kernels.sine.series import compute_phase_coefficients, sum_eq65, write_eq65_terms

#: Range of frequencies, divided by p of the block, that double precision resolves.
MIN_FREQUENCY: Final = 1e-6
MAX_FREQUENCY: Final = 1e6

#: Largest coefficient of restitution below one; above it, a sequence has more than a million impacts.
MAX_RESTITUTION: Final = 0.99999

#: Maximum number of terms of the consistent expansion.
MAX_ORDER: Final = 40

#: Context in which very large amplitudes yield infinite results without warnings.
_IGNORE_OVERFLOW: Final = np.errstate(over="ignore", invalid="ignore")

CYCLE_DTYPE: Final = np.dtype(
    [("n", np.int64), ("sign", np.int8), ("order", np.int8)]
    + [(name, float) for name in ("term", "interval", "time", "phase", "speed_before", "speed_after")]
)


def _check_values(parameter: ArrayLike, name: str, meaning: str, bounds: str, is_allowed: Any) -> Floats:
    """Return the values of a parameter as an array; raise an error for the first invalid value."""
    values = checks.numbers(parameter, name, OptionError)
    is_finite = np.isfinite(values)
    is_valid = is_finite & is_allowed(values)
    if is_valid.all():
        return values
    index = tuple(map(int, np.argwhere(~(is_valid if is_finite.all() else is_finite))[0]))
    condition = bounds if is_finite.all() else f"finite ({meaning})"
    position, value = f" at index {index}" if values.ndim else "", float(values[index])
    raise OptionError(f"{{}} must be {condition}; got {value:g}{position}", name, value=value)


def check_amplitude(a: ArrayLike) -> Floats:
    """Return amplitudes as an array of finite numbers."""
    return _check_values(a, "a", "the acceleration amplitude divided by g alpha", "", np.isfinite)


def check_frequency(omega: ArrayLike) -> Floats:
    """Return frequencies as an array."""
    texts = "omega", "the forcing frequency divided by p", f"between {MIN_FREQUENCY:g} and {MAX_FREQUENCY:g}"
    return _check_values(omega, *texts, lambda values: (values >= MIN_FREQUENCY) & (values <= MAX_FREQUENCY))


def check_restitution(eta: ArrayLike) -> Floats:
    """Return coefficients of restitution as an array."""
    texts = "eta", "the coefficient of restitution", f"above 0 and at most {MAX_RESTITUTION:g}, or exactly 1"
    return _check_values(eta, *texts, lambda e: (e > 0.0) & ((e <= MAX_RESTITUTION) | (e == 1.0)))


def check_lossy_restitution(eta: ArrayLike) -> Floats:
    """Return coefficients of restitution below one as an array."""
    values = check_restitution(eta)
    if (values == 1.0).any():
        message = "{} must be below 1, because without energy loss at impacts chattering never ends"
        raise OptionError(message, "eta", value=eta)
    return values


def check_slenderness(alpha: ArrayLike) -> Floats:
    """Return slenderness angles as an array."""
    meaning = "the slenderness angle in rad"
    return _check_values(alpha, "alpha", meaning, "between 0 and pi/2 rad", lambda a: (a > 0.0) & (a < 0.5 * np.pi))


def require_scalar(values: Floats, name: str) -> float:
    """Return the single value of a parameter that must not be an array."""
    if values.ndim:
        raise OptionError(f"{{}} must be a single number; got an array of shape {values.shape}", name)
    return float(values)


def check_lifting_amplitude(a: ArrayLike, *, excludes_one: bool = False) -> float:
    """Return a single amplitude as a float that is at least 1, and with ``excludes_one`` above 1."""
    amplitude = require_scalar(check_amplitude(a), "a")
    if amplitude < 1.0 or (excludes_one and amplitude == 1.0):
        bound = "above" if excludes_one else "at least"
        raise OptionError(f"{{}} must be {bound} 1, so that the block uplifts; got {amplitude:g}", "a", value=a)
    return amplitude


def broadcast_flat(*parameters: Floats) -> tuple[tuple[int, ...], list[Floats]]:
    """Return the broadcast shape of the parameters, and the parameters as flat arrays of this size."""
    try:
        shape = np.broadcast_shapes(*(parameter.shape for parameter in parameters))
    except ValueError:
        shapes = ", ".join(str(parameter.shape) for parameter in parameters)
        raise OptionError(f"the shapes of the parameters must be compatible; {shapes} do not broadcast") from None
    return shape, [np.broadcast_to(parameter, shape).ravel() for parameter in parameters]


@_IGNORE_OVERFLOW
def compute_asymptotic_times(a: Floats, omega: Floats, eta: Floats) -> Floats:
    """Compute Eq. 65 of the paper."""
    values, inverse = np.unique(eta, return_inverse=True)
    sums = np.array([sum_eq65(float(value)) for value in values])[inverse.reshape(eta.shape)]
    eps = _compute_excess(a, omega, eta)
    times = np.sqrt(eps) * (sums[..., 0] + eps * sums[..., 1]) / omega
    return np.where(eps == 0.0, 0.0, times)[()]


@_IGNORE_OVERFLOW
def asymptotic_table(a: float, omega: float, eta: float) -> NDArray[np.void]:
    """Compute the iterative procedure of the paper, cycle by cycle.

    Parameters
    ----------
    a, omega, eta : float
        As in `chattering_time`, with a at least 1 and eta below 1.

    Returns
    -------
    structured array
        One row for each cycle n: sign i_n of the rotation (i_0 = -1); order 1 or 3 and term T_{n;1} (i_n = i_0, Eq. 62)
        or T_{n;3} (i_n = -i_0, Eq. 64); interval term eps^(order/2). Then for impact n + 1, which ends the cycle: time,
        the sum of the intervals; phase omega time + psi of the ground acceleration a sin(phase), rad, with psi of Eq.
        12; speed_before and speed_after |phi'|, to their lowest order, eps^(3/2) (Eqs 57 and 58). The last time is Eq.
        65, because the table ends where the terms vanish in double precision.

    See Also
    --------
    chattering_time : Compute the chattering time by several methods.

    Notes
    -----
    Source: Eqs 12, 57, 58, 60, 62, 64 and 65 of the paper. Correction: as printed, the procedure ends when Eq. 62
    "returns a negative solution". However, its cubic always has one positive root, so that here it ends when the terms
    vanish.

    Examples
    --------
    >>> table = asymptotic_table(1.01, 2.0, 0.92)
    >>> round(float(table["time"][-1]), 9)
    0.57342594
    """
    excess = check_lifting_amplitude(a) - 1.0
    frequency = require_scalar(check_frequency(omega), "omega")
    restitution = require_scalar(check_lossy_restitution(eta), "eta")
    pair_count = 64
    while (term_count := write_eq65_terms(restitution, *(terms := np.zeros((2, pair_count))))) == pair_count:
        pair_count *= 2
    table = np.zeros(2 * term_count, CYCLE_DTYPE)
    is_even = np.arange(2 * term_count) % 2 == 0
    table["n"] = np.arange(2 * term_count)
    table["sign"] = np.where(is_even, -1, 1)
    table["order"] = np.where(is_even, 1, 3)
    table["term"] = terms[:, :term_count].T.ravel() / frequency
    table["interval"] = table["term"] * np.sqrt(excess) ** table["order"]
    table["time"] = np.cumsum(table["interval"])
    table["phase"] = frequency * table["time"] + math.asin(1.0 / (1.0 + excess))
    # In these units an arc of the second side lasts as long as its initial speed, which is conserved.
    initial_speeds = np.repeat(terms[1, :term_count], 2)
    speeds = np.where(is_even, initial_speeds / restitution, initial_speeds)
    table["speed_before"] = speeds * np.float64(excess) ** 1.5 / frequency
    table["speed_after"] = restitution * table["speed_before"]
    return table


@_IGNORE_OVERFLOW
def first_interval(a: ArrayLike, omega: ArrayLike) -> Floats:
    """Compute the time from uplift to the first impact, to two orders (Eq. 32).

    Parameters
    ----------
    a, omega : array_like
        Amplitude, divided by g alpha (NaN is returned below 1), and forcing frequency, divided by p.

    Returns
    -------
    array of float
        tau_1 = (4 sqrt(2)/omega) eps^(1/2) + (sqrt(2)/omega) [1 - 32 (omega^2 - 1)/(15 omega^2)] eps^(3/2), with eps =
        a - 1, of the broadcast shape.

    See Also
    --------
    first_impact_speed : Compute the speed at the first impact.

    Notes
    -----
    Source: Eq. 32 of the paper. Correction: Eqs 31 and 32 print 32/5 for 32/15, because T_{0;3} stops at Phi^(5)
    although Phi^(6) enters at the same order. The exact value is the first interval of `chattering_sequence`.

    Examples
    --------
    >>> round(float(first_interval(1.01, 2.0)), 5)
    0.28242
    """
    eps, frequency, second = _compute_first_arc(a, omega)
    return (math.sqrt(2.0) / frequency * np.sqrt(eps) * (4.0 + second * eps))[()]


@_IGNORE_OVERFLOW
def first_impact_speed(a: ArrayLike, omega: ArrayLike) -> Floats:
    """Compute the angular velocity just before the first impact, to two orders (paper, Eq. 34).

    Parameters
    ----------
    a, omega : array_like
        As in `first_interval`.

    Returns
    -------
    array of float
        phi'_0(tau_1) = (16 sqrt(2)/(3 omega)) eps^(3/2) + (4 sqrt(2)/omega) [1 - 32 (omega^2 - 1)/(15 omega^2)]
        eps^(5/2), with eps = a - 1, of the broadcast shape.

    See Also
    --------
    first_interval : Compute the time of the first impact.

    Examples
    --------
    >>> round(float(first_impact_speed(1.01, 2.0)), 6)
    0.003754
    """
    eps, frequency, second = _compute_first_arc(a, omega)
    return (4.0 * math.sqrt(2.0) / frequency * eps * np.sqrt(eps) * (4.0 / 3.0 + second * eps))[()]


def _compute_first_arc(a: ArrayLike, omega: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Compute eps (NaN below uplift), omega, and the expression in brackets of Eqs 32 and 34."""
    amplitude, frequency = check_amplitude(a), check_frequency(omega)
    omega2 = frequency**2
    return _compute_excess(amplitude, frequency), frequency, 1.0 - 32.0 / 15.0 * (omega2 - 1.0) / omega2


def compute_series_times(a: Floats, omega: Floats, eta: Floats, order: int) -> Floats:
    """Compute the chattering times by the first terms of the consistent expansion."""
    coefficients = _compute_coefficients(omega, eta, order)
    return _sum_series(coefficients, _compute_excess(a, coefficients[..., 0]))[()]


def _compute_excess(a: Floats, *parameters: Floats) -> Floats:
    """Compute eps in the broadcast shape of all parameters, NaN below uplift."""
    shape, _ = broadcast_flat(a, *parameters)
    return np.broadcast_to(np.where(a >= 1.0, a - 1.0, math.nan), shape)


def series_coefficients(omega: ArrayLike, eta: ArrayLike, *, order: int = 4) -> Floats:
    """Compute the coefficients of tau_ch = sqrt(eps) (C1 + C3 eps + C5 eps^2 + ...), with eps = a - 1.

    Parameters
    ----------
    omega, eta : array_like
        Forcing frequency, divided by p, and coefficient of restitution (infinity is returned for 1).
    order : int
        Number of coefficients, 1 to 40.

    Returns
    -------
    array of float, shape (..., order)
        C1, C3, C5, ...; the leading dimensions are the broadcast shape of omega and eta.

    Raises
    ------
    OptionError
        If a parameter is out of range, infinite or NaN, or a coefficient exceeds the range of a double (slow forcing,
        or high order with eta close to 1).

    See Also
    --------
    chattering_time : Compute the chattering time by several methods.

    Notes
    -----
    The exact impact map acts on truncated power series, and the infinite sum of intervals is extrapolated per
    coefficient. Eq. 65 of the paper has the same C1 and part of C3.

    Examples
    --------
    >>> (2.0 * series_coefficients(2.0, 0.92, order=2)).round(6)
    array([10.827448, 40.030207])
    """
    order = checks.integer(order, "order", OptionError, 1, MAX_ORDER)
    return _compute_coefficients(check_frequency(omega), check_restitution(eta), order)


@_IGNORE_OVERFLOW
def _sum_series(coefficients: Floats, eps: Floats) -> Floats:
    """Sum the series by Horner's scheme; exactly zero at eps = 0."""
    total = np.zeros(eps.shape)
    for k in reversed(range(coefficients.shape[-1])):
        total = total * eps + coefficients[..., k]
    return np.where(eps == 0.0, 0.0, np.sqrt(eps) * total)


def _compute_coefficients(omega: Floats, eta: Floats, order: int) -> Floats:
    """Compute the coefficients once per distinct pair of parameters."""
    shape, parameters = broadcast_flat(omega, eta)
    pairs, inverse = np.unique(np.stack(parameters), axis=1, return_inverse=True)
    coefficients = np.full((pairs.shape[1], order), math.inf)
    for i in np.flatnonzero(pairs[1] < 1.0):
        w, restitution = pairs[:, i].tolist()
        coefficients[i] = compute_phase_coefficients(1.0 / (w * w), restitution, order) / w
        if not np.isfinite(coefficients[i]).all():
            raise OptionError(
                f"double precision does not resolve the expansion to order {order} at omega = {w:g} and "
                f"eta = {restitution:g}: reduce the order, or increase omega or 1 - eta"
            )
    return coefficients[inverse.ravel()].reshape((*shape, order))
