"""The functions of time of which every arc is a sum: by series for short arcs, in closed form for long ones."""

import math
from typing import Final, NamedTuple

from rocking.kernels.compiled import inlined, shared

#: Orders of the sums, and the largest t^2 (1 + delta) at which so many terms reach full precision.
BRIEF: Final = 2
SHORT: Final = 3
MEDIUM: Final = 5
LONG: Final = 9
LONGEST: Final = 14
REACH_BRIEF: Final = 0.0012
REACH_SHORT: Final = 0.003
REACH_MEDIUM: Final = 0.12
REACH_LONG: Final = 1.5
REACH_LONGEST: Final = 12.0

_INVERSE_FACTORIAL: Final = tuple(1.0 / math.factorial(k) for k in range(2 * LONGEST + 5))


class Basis(NamedTuple):
    """Values at a time t; E and W, which grow, are scaled by the positive factor ``decay``.

    With S = sinh(sqrt(delta) t)/sqrt(delta) and C = (cosh(sqrt(delta) t) - 1)/delta,
    t^3 E = (S - sin t)/(1 + delta) and t^4 W = (C - 1 + cos t)/(1 + delta).
    """

    sine: float  # sin(t)/t
    versine: float  # (1 - cos t)/t^2
    E: float
    W: float
    decay: float


@inlined
def summed_basis(q: float, delta: float, order: int) -> Basis:
    """Add up powers of q = t^2; decay is one."""
    sine = 1.0
    versine = _INVERSE_FACTORIAL[2]
    E = _INVERSE_FACTORIAL[3]
    W = _INVERSE_FACTORIAL[4]
    power = 1.0
    mixed = 1.0
    for m in range(1, order + 1):
        power *= -q
        mixed = mixed * (delta * q) + power
        sine += power * _INVERSE_FACTORIAL[2 * m + 1]
        versine += power * _INVERSE_FACTORIAL[2 * m + 2]
        E += mixed * _INVERSE_FACTORIAL[2 * m + 3]
        W += mixed * _INVERSE_FACTORIAL[2 * m + 4]
    power *= -q
    sine += power * _INVERSE_FACTORIAL[2 * order + 3]
    versine += power * _INVERSE_FACTORIAL[2 * order + 4]
    return Basis(sine, versine, E, W, 1.0)


@inlined
def closed_basis(t: float, delta: float) -> Basis:
    """Follow the definitions, for long arcs; decay is exp(-sqrt(delta) t), so that nothing overflows."""
    q = t * t
    growth = math.sqrt(delta) * t
    decay = math.exp(-growth)
    sine = math.sin(t) / t
    versine = 2.0 * math.sin(0.5 * t) ** 2 / q
    S = -0.5 * math.expm1(-2.0 * growth) / growth
    C = 0.5 * (math.expm1(-growth) / growth) ** 2
    total = (1.0 + delta) * q
    return Basis(sine, versine, (S - decay * sine) / total, (C - decay * versine) / total, decay)


@shared
def basis(t: float, delta: float) -> Basis:
    """Return the basis at any t > 0: by the shortest sum of full precision, in closed form where there is none."""
    q = t * t
    reach = q * (1.0 + delta)
    if reach < REACH_SHORT:
        return summed_basis(q, delta, SHORT)
    if reach < REACH_MEDIUM:
        return summed_basis(q, delta, MEDIUM)
    if reach < REACH_LONG:
        return summed_basis(q, delta, LONG)
    if reach < REACH_LONGEST:
        return summed_basis(q, delta, LONGEST)
    return closed_basis(t, delta)
