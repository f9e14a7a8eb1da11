"""Expansion of the chattering time in a - 1, as the paper has it (Eq. 65).

In Eqs 57, 60, 62 and 64 amplitude and frequency cancel when durations are counted in sqrt(eps)/omega and
eps^(3/2)/omega, with eps = a - 1. With z = omega T_{n;1}, y = omega sigma_{n;1} and v = -omega Phi^(1)_{n;3} they
depend on eta alone.
"""

from __future__ import annotations

import math
from typing import Final

from rocking.arrays import Floats
from rocking.kernels.compiled import inlined, kernel

_ROOT2: Final = math.sqrt(2.0)

#: Part of Eq. 65's sum that is left out, relative to the sum.
_NEGLIGIBLE: Final = 1e-17

_MAXIMUM_NEWTON_STEPS: Final = 60


@kernel
def eq65_time(a: float, omega: float, eta: float) -> float:
    """Asymptotic chattering time (Eq. 65) for numbers; NaN for a < 1 and for a NaN, infinite for eta = 1."""
    if not a >= 1.0:
        return math.nan
    if a == 1.0:
        return 0.0
    first, third = eq65_sums(eta)
    return math.sqrt(a - 1.0) * (first + (a - 1.0) * third) / omega


@kernel
def eq65_sums(eta: float) -> tuple[float, float]:
    """Return the sums of omega T_{n;1} (n even) and omega T_{n;3} (n odd) in Eq. 65; infinite for eta = 1 and NaN."""
    if not eta < 1.0:
        return math.inf, math.inf
    y = 0.0
    third = 0.0
    v = 0.0
    z = math.inf
    while not vanishes(z, y, eta):
        z, odd, v = eq65_pair(y, v, eta)
        y += z
        third += odd
    return y, third


@kernel
def eq65_terms(eta: float, first: Floats, third: Floats) -> int:
    """Write omega T_{n;1} and omega T_{n+1;3} until they vanish; returns how many, as many as fit if they do not."""
    y = 0.0
    v = 0.0
    for pair in range(first.size):
        first[pair], third[pair], v = eq65_pair(y, v, eta)
        y += first[pair]
        if vanishes(first[pair], y, eta):
            return pair + 1
    return first.size


@inlined
def vanishes(z: float, y: float, eta: float) -> bool:
    """Whether all terms after z, nearly a geometric series, are negligible beside their sum y."""
    return z <= _NEGLIGIBLE * (1.0 - eta * eta) * y


@inlined
def eq65_pair(y: float, v: float, eta: float) -> tuple[float, float, float]:
    """Take steps 2 and 3 of the paper's iterative procedure: omega T_{n;1}, omega T_{n+1;3} and v of the next pair.

    The cubic of Eq. 62, z^3/24 + c2 z^2 + c1 z = v, has one positive root: from the second pair on its coefficients
    are positive, since y > 2 sqrt(2). In the first, with y = v = 0, it is Eq. 31.
    """
    c2 = (y - _ROOT2) / 6.0
    c1 = y * (y - 2.0 * _ROOT2) / 4.0
    z = 4.0 * _ROOT2 if y == 0.0 else positive_root(c2, c1, v)
    speed_before = z * (c1 + z * (2.0 * c2 + z / 8.0))
    odd = eta * speed_before
    return z, odd, eta * odd


@inlined
def positive_root(c2: float, c1: float, v: float) -> float:
    """Root of z^3/24 + c2 z^2 + c1 z - v, all positive: Newton's steps from above, where the cubic is convex."""
    z = min(v / c1, math.sqrt(v / c2))
    for _ in range(_MAXIMUM_NEWTON_STEPS):
        excess = z * (c1 + z * (c2 + z / 24.0)) - v
        step = excess / (c1 + z * (2.0 * c2 + z / 8.0))
        z -= step
        if step <= 1e-16 * z:
            break
    return z
