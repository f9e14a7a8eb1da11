"""The consistent expansion in eps = a - 1, to any order, with its error and its radius of convergence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.arrays import Floats
from rocking.chattering.theory.parameters import (
    broadcast,
    checked_amplitude,
    checked_count,
    checked_frequency,
    checked_restitution,
)
from rocking.errors import InvalidOption
from rocking.kernels.sine.series import phase_coefficients

_HIGHEST_ORDER: Final = 40

#: Coefficients beyond the order asked for that the diagnosis looks at, and how many it needs at least.
_LOOK_AHEAD: Final = 6
_FEWEST: Final = 16


def series_times(a: Floats, omega: Floats, eta: Floats, order: int) -> Floats:
    """Sum of the first terms of the expansion."""
    coefficients = _coefficients(omega, eta, order)
    shape = np.broadcast_shapes(a.shape, coefficients.shape[:-1])
    eps = np.broadcast_to(np.where(a >= 1.0, a - 1.0, math.nan), shape)
    return _summed(coefficients, eps)[()]


def series_coefficients(omega: ArrayLike, eta: ArrayLike, *, order: int = 4) -> Floats:
    """Coefficients of tau_ch = sqrt(eps) (C1 + C3 eps + C5 eps^2 + ...), eps = a - 1.

    Parameters
    ----------
    omega : array_like
        Forcing frequency over p.
    eta : array_like
        Coefficient of restitution; infinity is returned for 1.
    order : int
        Number of coefficients, 1 to 40.

    Returns
    -------
    array of float, shape (..., order)
        C1, C3, C5, ...; the leading dimensions are the broadcast shape of omega and eta.

    Raises
    ------
    InvalidOption
        If a parameter is NaN, infinite or out of range, or a coefficient exceeds the range of a double (slow forcing or
        eta close to 1 with a high order).

    Notes
    -----
    The exact impact map acts on truncated power series, and the infinite sum of its intervals is extrapolated
    coefficient by coefficient; nothing is fitted. The paper's Eq. 65 has the same C1 and part of C3. C1 omega depends
    on eta alone, C3 omega = A + B/omega^2.

    Examples
    --------
    >>> (2.0 * series_coefficients(2.0, 0.92, order=2)).round(6)
    array([10.827448, 40.030207])
    """
    order = checked_count(order, "order", 1, _HIGHEST_ORDER)
    return _coefficients(checked_frequency(omega), checked_restitution(eta), order)


@dataclass(frozen=True)
class SeriesDiagnosis:
    """A partial sum of the expansion and what is known of the rest.

    Attributes
    ----------
    time : array of float
        Sum of the first `order` terms.
    error : array of float
        Estimate of what the neglected terms add; infinite from the radius of convergence on.
    radius : array of float
        Estimated radius of convergence in eps, from the ratios of the coefficients.
    """

    time: Floats
    error: Floats
    radius: Floats


def series_diagnosis(a: ArrayLike, omega: ArrayLike, eta: ArrayLike, *, order: int = 4) -> SeriesDiagnosis:
    """Partial sum of the expansion, its error and where it stops converging.

    Parameters
    ----------
    a, omega, eta : array_like
        As in `chattering_time`, eta below 1.
    order : int
        Terms of the sum, 1 to 34.

    Returns
    -------
    SeriesDiagnosis
        Arrays of the broadcast shape.

    Raises
    ------
    InvalidOption
        As `series_coefficients`, and for eta = 1.

    Notes
    -----
    Error: the next terms, and a geometric sum with the limit of their ratio. Radius: the ratios c_{k-1}/c_k are
    extrapolated linearly in 1/k (Domb and Sykes). Proven: the radius is not larger than a_cr - 1, where the chattering
    time has its branch point; and it is a_cr - 1 exactly, so that the series converges wherever chattering is
    complete, if no more than finitely many coefficients are negative. That they are not is observed of the first 40
    and not proven. Observed, too: the estimate agrees with a_cr - 1, for eta from 0.5 up and omega from 0.5 to 8, to
    1.2 per cent from the 16 coefficients that are formed at least, and to 0.12 per cent from 40.

    Examples
    --------
    >>> diagnosis = series_diagnosis(1.01, 2.0, 0.92, order=4)
    >>> round(float(diagnosis.radius), 3), bool(diagnosis.error < 5e-4)
    (0.038, True)
    """
    order = checked_count(order, "order", 1, _HIGHEST_ORDER - _LOOK_AHEAD)
    amplitude = checked_amplitude(a)
    restitution = checked_restitution(eta)
    if (restitution == 1.0).any():
        raise InvalidOption("eta must be below 1 here: without loss at impacts there is no expansion")
    longer = _coefficients(checked_frequency(omega), restitution, max(order + _LOOK_AHEAD, _FEWEST))
    shape, _ = broadcast(amplitude, longer[..., 0])
    eps = np.broadcast_to(np.where(amplitude >= 1.0, amplitude - 1.0, math.nan), shape)
    radius = np.broadcast_to(_radius(longer), shape)
    time = _summed(longer[..., :order], eps)
    last = longer[..., -1] * eps ** (longer.shape[-1] - 0.5)
    inside = eps < radius
    tail = last * (eps / radius) / np.where(inside, 1.0 - eps / radius, 1.0)
    error = np.where(inside, np.abs(_summed(longer, eps) - time + tail), math.inf)
    return SeriesDiagnosis(time[()], error[()], radius.copy()[()])


def _radius(coefficients: Floats) -> Floats:
    """Limit of the ratios of successive coefficients, extrapolated linearly in 1/k."""
    k = coefficients.shape[-1] - 1
    ratios = coefficients[..., :-1] / coefficients[..., 1:]
    radius: Floats = k * ratios[..., -1] - (k - 1) * ratios[..., -2]
    return radius


def _summed(coefficients: Floats, eps: Floats) -> Floats:
    """Horner's scheme; exactly zero at eps = 0."""
    total = np.zeros(eps.shape)
    for k in reversed(range(coefficients.shape[-1])):
        total = total * eps + coefficients[..., k]
    with np.errstate(invalid="ignore"):
        return np.where(eps == 0.0, 0.0, np.sqrt(eps) * total)


def _coefficients(omega: Floats, eta: Floats, order: int) -> Floats:
    """Coefficients of the broadcast parameters, formed once for each pair of different values."""
    shape, parameters = broadcast(omega, eta)
    pairs, where = np.unique(np.stack(parameters), axis=1, return_inverse=True)
    coefficients = np.full((pairs.shape[1], order), math.inf)
    for i in np.flatnonzero(pairs[1] < 1.0):
        w, restitution = pairs[:, i].tolist()
        coefficients[i] = phase_coefficients(1.0 / (w * w), restitution, order) / w
        if not np.isfinite(coefficients[i]).all():
            raise InvalidOption(
                f"the expansion at omega = {w:g}, eta = {restitution:g} is not resolved to order {order} "
                "in double precision: lower the order, or take eta further from 1"
            )
    return coefficients[where.ravel()].reshape((*shape, order))
