"""The critical amplitude: the largest a whose first chattering sequence accumulates before x = pi."""

import math
from typing import Final

from rocking.arrays import Floats
from rocking.kernels.compiled import inlined, kernel, shared
from rocking.kernels.sine import FOUND
from rocking.kernels.sine.arc import LARGEST_EXCESS
from rocking.kernels.sine.sequence import rest_phase

#: Width of the final bracket on a - 1, over a: half an ulp.
_WIDTH: Final = 2.0**-53

#: Distance kept from the extrapolated critical value, over the distance it was extrapolated.
_CAUTION: Final = 0.01

#: Relative width of the bracket below which extrapolation starts.
_NEAR: Final = 0.1

_MAXIMUM_STEPS: Final = 400


@kernel
def critical_amplitudes(omega: Floats, eta: Floats, amplitudes: Floats) -> None:
    """Critical amplitude for each omega and eta < 1."""
    for i in range(amplitudes.size):
        amplitudes[i] = 1.0 + critical_excess(1.0 / (omega[i] * omega[i]), eta[i])


@shared
def critical_excess(delta: float, eta: float) -> float:
    """Largest a - 1 with complete chattering, by a bracket that closes around an extrapolated value.

    Near it pi - x_rest ~ (critical - excess)^nu, so (pi - x_rest)^(1/nu) is extrapolated to zero from the last two
    complete sequences; trying a little below and above the result shrinks the bracket from both ends, and halving it
    every third time bounds the number of steps whatever the extrapolation is worth.
    """
    power = 1.0 / distance_exponent(eta)
    low = 0.0
    high = LARGEST_EXCESS
    low_gap = math.pi**power
    older = -1.0
    older_gap = low_gap
    for step in range(_MAXIMUM_STEPS):
        if high - low <= _WIDTH * (1.0 + low):
            break
        trial = 0.5 * (low + high)
        if step % 3 > 0 and high - low < _NEAR * high and older_gap > low_gap:
            guess = low + low_gap * (low - older) / (older_gap - low_gap)
            caution = max(_CAUTION * abs(guess - low), 0.25 * _WIDTH)
            aimed = guess - caution if step % 3 == 1 else guess + caution
            trial = aimed if low < aimed < high else trial
        status, x = rest_phase(trial, delta, eta)
        if status == FOUND:
            older = low
            older_gap = low_gap
            low = trial
            low_gap = (math.pi - x) ** power
        else:
            high = trial
    return low


@inlined
def distance_exponent(eta: float) -> float:
    """Exponent nu of pi - x_rest ~ (critical - excess)^nu.

    Close to x = pi the second side's restoring acceleration is proportional to the phase s that is left, and the
    impact map scales: with speed w = v s^2 times a constant, an arc of duration z s has v = z/2 - z^2/6 and leaves
    s (1 - z), v' = eta^2 (z/2 - z^2/3)/(1 - z)^2. The critical sequence stays at the fixed point; a
    neighbour leaves it by the factor dv'/dv per pair while s falls by 1 - z.
    """
    pair = eta * eta
    low = 0.0
    high = 1.0
    for _ in range(60):
        z = 0.5 * (low + high)
        if (0.5 - z / 6.0) * (1.0 - z) ** 2 > pair * (0.5 - z / 3.0):
            low = z
        else:
            high = z
    z = 0.5 * (low + high)
    relative_growth = (0.5 - 2.0 * z / 3.0) / (0.5 * z - z * z / 3.0) + 2.0 / (1.0 - z)
    growth = relative_growth * (0.5 * z - z * z / 6.0) / (0.5 - z / 3.0)
    return -math.log(1.0 - z) / math.log(growth)
