"""Motion of a floor: the absolute acceleration of a linear oscillator under a ground motion, as polynomials again."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.errors import InvalidMotion
from rocking.motion import piecewise
from rocking.motion.piecewise import Pieces, Piecewise

#: Largest angle of the oscillation on a piece, and degree of its series: 0.25**10 / 10! = 3e-13.
_RADIANS: Final = 0.25
_DEGREE: Final = 9

#: Share of itself down to which a free oscillation is followed unless a time is given.
_FADED: Final = 1e-3

#: Shortest period over the duration: 25 pieces for each.
_SHORTEST: Final = 1e-4

#: Most pieces of the oscillation itself: 0.1 GiB.
_MOST_PIECES: Final = 1e6


def floor_pieces(
    motion: Piecewise, period: float, damping: float, ringing: float | None, error: float = 0.0
) -> tuple[Pieces, float]:
    """Absolute acceleration of an oscillator that starts at rest, and a bound on the error of its pieces, m/s^2.

    With u'' + 2 z w u' + w^2 u = -a(t) it is -(2 z w u' + w^2 u). On each piece u is the Taylor series of the exact
    solution about its start, from the series of the solutions of the states (1, 0), (0, 1), and of the one at rest.
    """
    end = float(motion.breakpoints[-1])
    rate, ratio = _checked(period, damping, end)
    after = _ringing(rate, ratio, ringing)
    step = _RADIANS / rate
    if not (end + after) / step <= _MOST_PIECES:
        raise InvalidMotion(
            f"the floor moves for {end + after:.4g} s, which is too long for a {{}} of {period:g} s; give a shorter "
            "time for it after the motion, {}",
            "period",
            "ringing",
            value=ringing,
        )
    whole = np.append(motion.breakpoints, end + after) if after > 0.0 else motion.breakpoints
    shares = np.maximum(1, np.ceil(np.diff(whole) / step)).astype(np.int64)
    start, width = np.repeat(whole[:-1], shares), np.repeat(np.diff(whole) / shares, shares)
    place = np.arange(shares.sum()) - np.repeat(np.cumsum(shares) - shares, shares)
    breakpoints = np.append(start + place * width, whole[-1])
    width = np.diff(breakpoints)
    columns = max(motion.coefficients.shape[1], _DEGREE + 1)
    given = piecewise.refined(motion.breakpoints, motion.coefficients, breakpoints, columns)
    given[breakpoints[:-1] >= end] = 0.0
    series = _series(given, rate, ratio, columns + 2)
    ends = np.stack([_at(series, width), _at(series[..., 1:] * np.arange(1, columns + 2), width)])
    states = _marched(ends)
    solution = series[2] + np.einsum("jn,jnk->nk", states, series[:2])
    slope = solution[:, 1:] * np.arange(1, columns + 2)
    acceleration = -(2.0 * ratio * rate * slope[:, :columns] + rate**2 * solution[:, :columns])
    largest = float(np.max(np.abs(acceleration[:, 0]), initial=0.0))
    own = 4.0 * largest * _RADIANS**columns / math.factorial(columns)
    grown = error * (2.0 / ratio if ratio > 0.0 else rate * (end + after))  # the sum of all that an error can do
    return Pieces(breakpoints, acceleration), own + grown


def _checked(period: float, damping: float, duration: float) -> tuple[float, float]:
    """Circular frequency, rad/s, and fraction of critical damping."""
    time = checks.positive(period, "period", InvalidMotion, "s")
    if time < _SHORTEST * duration:
        raise InvalidMotion(
            f"{{}} of a floor must be at least a ten-thousandth of the motion, {_SHORTEST * duration:.4g} s, not "
            f"{time:g} s: a floor that is so stiff moves as the ground does",
            "period",
            value=period,
        )
    ratio = checks.finite(damping, "damping", InvalidMotion)
    if not 0.0 <= ratio < 1.0:
        raise InvalidMotion(
            f"the {{}} must be a fraction of critical from 0 to below 1, not {ratio:g}", "damping", value=damping
        )
    return 2.0 * math.pi / time, ratio


def _ringing(rate: float, ratio: float, given: float | None) -> float:
    """Time for which the floor is followed after the motion, s."""
    if given is not None:
        time = checks.finite(given, "ringing", InvalidMotion)
        if time < 0.0:
            raise InvalidMotion(f"{{}} must be a time of at least 0 s, not {time:g}", "ringing", value=given)
        return time
    if ratio == 0.0:
        raise InvalidMotion("a floor without {} moves for ever: give {}, s", "damping", "ringing")
    return -math.log(_FADED) / (ratio * rate)


def _series(given: Floats, rate: float, ratio: float, terms: int) -> Floats:
    """Series of three solutions on each piece, shape (3, pieces, terms): of two free ones, and of that from rest."""
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
    """Displacement and velocity at the start of every piece, shape (2, pieces), from what each makes of the states."""
    found = np.empty((2, ends.shape[2]))
    u = v = 0.0
    for k, (a, b, c, d, e, f) in enumerate(ends.transpose(2, 0, 1).reshape(-1, 6).tolist()):
        found[:, k] = u, v
        u, v = a * u + b * v + c, d * u + e * v + f
    return found
