"""The paper's closed results as scalar kernels: Eqs 65, 76 and 77.

In Eqs 57, 60, 62 and 64 amplitude and frequency cancel when durations are counted in sqrt(eps)/omega and
eps^(3/2)/omega: with z = omega T_{n;1}, y = omega sigma_{n;1} and v = -omega Phi^(1)_{n;3} they depend on eta alone.
"""

import math
from typing import Final

from rocking.arrays import Floats
from rocking.kernels.compiled import inlined, kernel

_ROOT2: Final = math.sqrt(2.0)

#: What remains of Eq. 65's sum when it is cut, relative to the sum.
_VANISHED: Final = 1e-17

_MAXIMUM_NEWTON_STEPS: Final = 60


@kernel
def eq65_time(a: float, omega: float, eta: float) -> float:
    """Asymptotic chattering time (Eq. 65), until its terms vanish; NaN for a < 1, infinite for eta = 1."""
    if not a >= 1.0:
        return math.nan
    if a == 1.0:
        return 0.0
    first, third = eq65_sums(eta)
    return math.sqrt(a - 1.0) * (first + (a - 1.0) * third) / omega


@kernel
def eq65_sums(eta: float) -> tuple[float, float]:
    """Return the sums of omega T_{n;1} (n even) and omega T_{n;3} (n odd) in Eq. 65; infinite for eta = 1."""
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
def eq65_terms(eta: float, terms: Floats) -> int:
    """Fill rows with omega T_{n;1} and omega T_{n+1;3} until they vanish; number of rows, all when they do not."""
    y = 0.0
    v = 0.0
    for pair in range(terms.shape[0]):
        terms[pair, 0], terms[pair, 1], v = eq65_pair(y, v, eta)
        y += terms[pair, 0]
        if vanishes(terms[pair, 0], y, eta):
            return pair + 1
    return terms.shape[0]


@inlined
def vanishes(z: float, y: float, eta: float) -> bool:
    """Whether all terms after z, nearly a geometric series, are nothing beside their sum y."""
    return z <= _VANISHED * (1.0 - eta * eta) * y


@inlined
def eq65_pair(y: float, v: float, eta: float) -> tuple[float, float, float]:
    """Take steps 2 and 3 of the iterative procedure: omega T_{n;1}, omega T_{n+1;3} and v of the next pair.

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


@kernel
def eq76(omega: float, eta: float) -> float:
    """Fitted critical amplitude (Eq. 76)."""
    return (
        1.079
        - 0.1885 * eta
        + 0.1405 * omega
        + 0.6442 * eta**2
        - 0.1903 * eta * omega
        - 0.02818 * omega**2
        - 0.7372 * eta**3
        + 0.06413 * eta**2 * omega
        + 0.03236 * eta * omega**2
        + 0.00176 * omega**3
        + 0.2146 * eta**4
        - 0.0187 * eta**3 * omega
        - 0.003045 * eta**2 * omega**2
        - 0.00185 * eta * omega**3
    )


@kernel
def eq77(eta: float) -> float:
    """Fitted critical amplitude without the frequency (Eq. 77)."""
    return -0.3941 * eta**3 + 0.5763 * eta**2 - 0.45 * eta + 1.271


@kernel
def fitted_amplitudes(omega: Floats, eta: Floats, with_frequency: bool, amplitudes: Floats) -> None:
    """Eq. 76 (with the frequency) or Eq. 77 for each omega and eta."""
    for i in range(amplitudes.size):
        amplitudes[i] = eq76(omega[i], eta[i]) if with_frequency else eq77(eta[i])
