"""The critical amplitude: below it chattering is complete, above it the block does not come to rest."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.chattering.theory import surface
from rocking.chattering.theory.parameters import broadcast, checked_frequency, checked_restitution
from rocking.compiling import AMPLITUDES, announce
from rocking.errors import InvalidOption
from rocking.kernels.paper import fitted_amplitudes
from rocking.kernels.sine.critical import critical_amplitudes
from rocking.treatment import warn_outside_fit


def critical_amplitude(omega: ArrayLike, eta: ArrayLike, *, method: str = "exact") -> Floats:
    """Amplitude of the ground acceleration up to which chattering is complete.

    Parameters
    ----------
    omega : array_like
        Forcing frequency over p.
    eta : array_like
        Coefficient of restitution.
    method : {"exact", "eq76", "eq77", "approximation"}
        "exact": by root finding on certified sequences, to 1e-14. "eq76", "eq77": the paper's fits, off by up to 1.1
        and 5.4 % in eta from 0.5 to 0.97, omega from 0.5 to 8. "approximation": a Chebyshev expansion with a largest
        error of 4e-8, for eta from 0.5 to 0.97 and omega from 0.4 to 10 only.

    Returns
    -------
    array of float
        a_cr, over g alpha, of the broadcast shape (a number for numbers): the supremum of all amplitudes whose first
        sequence of impacts accumulates within half a period of uplift.

    Raises
    ------
    InvalidOption
        If a parameter is NaN, infinite or out of range, or the method is not one of these.

    Warns
    -----
    OutsideFit
        Where "eq76" or "eq77" is asked for omega or eta beyond those ranges: there they mean nothing.

    Notes
    -----
    Source: the paper's section 5.1, Eqs 76 and 77. As a approaches a_cr the time of rest approaches pi/omega like a
    power of a_cr - a whose exponent depends on eta only: 0.600 at eta = 0.92 and above, 0.612 at 0.5, to 1 towards 0.

    Examples
    --------
    >>> round(float(critical_amplitude(2.0, 0.92)), 12)
    1.03801553873
    >>> round(float(critical_amplitude(2.0, 0.92, method="eq77")), 6)
    1.037899
    """
    announce(AMPLITUDES)
    methods: dict[str, Callable[[Floats, Floats], Floats]] = {
        "exact": _exact,
        "eq76": _eq76,
        "eq77": _eq77,
        "approximation": _approximation,
    }
    chosen = checks.one_of(method, "method", InvalidOption, list(methods))
    shape, (frequencies, restitutions) = broadcast(checked_frequency(omega), checked_restitution(eta))
    return methods[chosen](frequencies, restitutions).reshape(shape)[()]


def _exact(omega: Floats, eta: Floats) -> Floats:
    amplitudes = np.ones(omega.size)
    lossy = np.flatnonzero(eta < 1.0)
    found = np.zeros(lossy.size)
    critical_amplitudes(omega[lossy], eta[lossy], found)
    amplitudes[lossy] = found
    return amplitudes


def _eq76(omega: Floats, eta: Floats) -> Floats:
    return _fitted("eq76", omega, eta)


def _eq77(omega: Floats, eta: Floats) -> Floats:
    return _fitted("eq77", omega, eta)


def _fitted(fit: str, omega: Floats, eta: Floats) -> Floats:
    warn_outside_fit(fit, omega, eta)
    amplitudes = np.zeros(omega.size)
    fitted_amplitudes(omega, eta, fit == "eq76", amplitudes)
    return amplitudes


def _approximation(omega: Floats, eta: Floats) -> Floats:
    low, high = surface.FREQUENCIES
    least, most = surface.RESTITUTIONS
    if (omega < low).any() or (omega > high).any() or (eta < least).any() or (eta > most).any():
        raise InvalidOption(
            f'method="approximation" holds for omega from {low:g} to {high:g} and eta from {least:g} to {most:g} only: '
            'use method="exact" elsewhere'
        )
    return surface.evaluate(omega, eta)
