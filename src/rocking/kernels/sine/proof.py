"""The certificate under a sine: complete chattering proven, with a bracket on the remaining phase."""

import math
from typing import Final

from rocking.kernels.certificate import Bounds, geometric_bracket
from rocking.kernels.compiled import inlined
from rocking.kernels.sine.arc import State

#: Window of the certificate over the estimate of the remaining phase.
WINDOW: Final = 1.5

#: Relative allowance for what P has gathered of rounding over a sequence.
_ROUNDING: Final = 1e-12


@inlined
def bracket(entered: State, window: float, delta: float, eta: float) -> tuple[float, float]:
    """Bounds on the remaining phase on entering the second side; where there is no proof no comparison holds (NaN).

    They hold if the upper one lies within the window of phase and the window ends before x = pi: P rises there, at
    a rate of D at first, and |P''| <= a.
    """
    V, P, D = entered
    rate = (D + window * math.sqrt((1.0 - P) * (1.0 - P) + D * D)) * (1.0 + _ROUNDING)
    low = P * (1.0 - _ROUNDING)
    high = (P + window * rate) * (1.0 + _ROUNDING)
    second = Bounds(delta, 2.0 - high, 2.0 - low, high - low, rate, 0.0)
    first = Bounds(delta, low, high, high - low, rate, 0.0)
    return geometric_bracket(V, second, first, eta, eta)


@inlined
def proven(x: float, entered: State, delta: float, eta: float, remaining: float) -> bool:
    """Whether complete chattering is proven on entering the second side, with this remaining phase in the bracket."""
    window = WINDOW * remaining
    lower, upper = bracket(entered, window, delta, eta)
    return (upper <= window) & (lower <= remaining) & (remaining <= upper) & (x + window < math.pi)
