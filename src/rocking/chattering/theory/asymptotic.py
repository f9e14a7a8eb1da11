"""The paper's asymptotic scheme (section 3): Eqs 14 to 65, with its iterative procedure in the open."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.arrays import Floats
from rocking.chattering.theory.parameters import (
    broadcast,
    checked_amplitude,
    checked_frequency,
    checked_restitution,
    single,
)
from rocking.errors import InvalidOption
from rocking.kernels.paper import eq65_sums, eq65_terms

CYCLE: Final = np.dtype(
    [
        ("n", np.int64),
        ("sign", np.int8),
        ("order", np.int8),
        ("term", float),
        ("interval", float),
        ("time", float),
        ("phase", float),
        ("speed_before", float),
        ("speed_after", float),
    ]
)


def asymptotic_times(a: Floats, omega: Floats, eta: Floats) -> Floats:
    """Eq. 65; its sums depend on eta alone and are formed once for each value of it."""
    values, where = np.unique(eta, return_inverse=True)
    sums = np.array([eq65_sums(float(value)) for value in values])[where.reshape(eta.shape)]
    shape, (amplitudes, frequencies, first, third) = broadcast(a, omega, sums[..., 0], sums[..., 1])
    excess = amplitudes - 1.0
    times = np.full(excess.shape, math.nan)
    times[excess == 0.0] = 0.0
    rocks = excess > 0.0
    times[rocks] = np.sqrt(excess[rocks]) * (first[rocks] + excess[rocks] * third[rocks]) / frequencies[rocks]
    return times.reshape(shape)[()]


def asymptotic_table(a: float, omega: float, eta: float) -> NDArray[np.void]:
    """Run the paper's iterative procedure, cycle by cycle.

    Parameters
    ----------
    a : float
        Amplitude over g alpha, at least 1.
    omega : float
        Forcing frequency over p.
    eta : float
        Coefficient of restitution, below 1.

    Returns
    -------
    structured array
        A row for each cycle n: sign i_n of the rotation (i_0 = -1); order 1 or 3 and term T_{n;1} (i_n = i_0, Eq. 62)
        or T_{n;3} (i_n = -i_0, Eq. 64); interval term eps^(order/2). Then what ends the cycle, impact n + 1: time, the
        intervals' sum; phase omega time + psi of the ground acceleration a sin(phase), rad, with psi of Eq. 12;
        speed_before and speed_after |phi'|, to their lowest order, eps^(3/2) (Eqs 57 and 58). The last row's time is
        Eq. 65: the table ends where the terms vanish in double precision.

    Raises
    ------
    InvalidOption
        If a parameter is not a single number or out of range.

    Notes
    -----
    Source: the paper's Eqs 12, 57, 58, 60, 62, 64 and 65. Mended: the procedure is to end, as printed, when Eq. 62
    "returns a negative solution", but its cubic always has one positive root, so it ends when the terms vanish.

    Examples
    --------
    >>> table = asymptotic_table(1.01, 2.0, 0.92)
    >>> table["sign"][:3].tolist(), table["order"][:3].tolist()
    ([-1, 1, -1], [1, 3, 1])
    >>> round(float(table["time"][-1]), 9)
    0.57342594
    >>> table["speed_before"][:3].round(6).tolist()
    [0.003771, 0.00347, 0.003862]
    """
    excess = _excess(a)
    frequency = single(checked_frequency(omega), "omega")
    restitution = single(checked_restitution(eta), "eta")
    if restitution == 1.0:
        raise InvalidOption("eta must be below 1 here: without loss at impacts the terms of Eq. 65 never vanish")
    pairs = 64
    while (count := eq65_terms(restitution, terms := np.zeros((pairs, 2)))) == pairs:
        pairs *= 2
    table = np.zeros(2 * count, CYCLE)
    even = np.arange(2 * count) % 2 == 0
    table["n"] = np.arange(2 * count)
    table["sign"] = np.where(even, -1, 1)
    table["order"] = np.where(even, 1, 3)
    table["term"] = terms[:count].ravel() / frequency
    table["interval"] = table["term"] * np.sqrt(excess) ** table["order"]
    table["time"] = np.cumsum(table["interval"])
    table["phase"] = frequency * table["time"] + math.asin(1.0 / (1.0 + excess))
    # An arc of the second side takes as long, in these units, as the speed that it starts with, and keeps it.
    entering = np.repeat(terms[:count, 1], 2)
    table["speed_before"] = np.where(even, entering / restitution, entering) * excess**1.5 / frequency
    table["speed_after"] = restitution * table["speed_before"]
    return table


def first_interval(a: ArrayLike, omega: ArrayLike) -> Floats:
    """Time from uplift to the first impact, to two orders (Eq. 32).

    Parameters
    ----------
    a : array_like
        Amplitude over g alpha; NaN is returned where a < 1.
    omega : array_like
        Forcing frequency over p.

    Returns
    -------
    array of float
        tau_1 = (4 sqrt(2)/omega) eps^(1/2) + (sqrt(2)/omega) [1 - 32 (omega^2 - 1)/(15 omega^2)] eps^(3/2), with
        eps = a - 1, of the broadcast shape.

    Raises
    ------
    InvalidOption
        If a parameter is NaN, infinite or out of range.

    Notes
    -----
    Source: the paper's Eq. 32. Mended: Eqs 31 and 32 print 32/5 for 32/15, because T_{0;3} stops at Phi^(5) although
    Phi^(6) enters at the same order. The exact value is the first interval of `sequence`.

    Examples
    --------
    >>> round(float(first_interval(1.01, 2.0)), 5)
    0.28242
    """
    eps, omega2, frequency = _expansion_parameters(a, omega)
    second = 1.0 - 32.0 / 15.0 * (omega2 - 1.0) / omega2
    return (math.sqrt(2.0) / frequency * np.sqrt(eps) * (4.0 + second * eps))[()]


def first_impact_speed(a: ArrayLike, omega: ArrayLike) -> Floats:
    """Angular velocity just before the first impact, to two orders (Eq. 34).

    Parameters
    ----------
    a : array_like
        Amplitude over g alpha; NaN is returned where a < 1.
    omega : array_like
        Forcing frequency over p.

    Returns
    -------
    array of float
        phi'_0(tau_1) = (16 sqrt(2)/(3 omega)) eps^(3/2) + (4 sqrt(2)/omega) [1 - 32 (omega^2 - 1)/(15 omega^2)]
        eps^(5/2), with eps = a - 1, of the broadcast shape.

    Raises
    ------
    InvalidOption
        If a parameter is NaN, infinite or out of range.

    Notes
    -----
    Source: the paper's Eq. 34, as printed.

    Examples
    --------
    >>> round(float(first_impact_speed(1.01, 2.0)), 6)
    0.003754
    """
    eps, omega2, frequency = _expansion_parameters(a, omega)
    second = 1.0 - 32.0 / 15.0 * (omega2 - 1.0) / omega2
    return (4.0 * math.sqrt(2.0) / frequency * eps * np.sqrt(eps) * (4.0 / 3.0 + second * eps))[()]


def _expansion_parameters(a: ArrayLike, omega: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Eps (NaN below uplift), omega^2 and omega."""
    amplitude = checked_amplitude(a)
    frequency = checked_frequency(omega)
    shape, (amplitudes, frequencies) = broadcast(amplitude, frequency)
    eps = np.where(amplitudes >= 1.0, amplitudes - 1.0, math.nan).reshape(shape)
    frequencies = frequencies.reshape(shape)
    return eps, frequencies**2, frequencies


def _excess(a: float) -> float:
    amplitude = single(checked_amplitude(a), "a")
    if amplitude < 1.0:
        raise InvalidOption(f"a must be at least 1, or the block does not lift off, not {amplitude:g}")
    return amplitude - 1.0
