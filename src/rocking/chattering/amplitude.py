"""What the slender theory costs: the critical amplitude of a block that is not slender."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.arrays import Floats
from rocking.block import Block
from rocking.chattering.theory.parameters import broadcast, checked_frequency, checked_restitution, checked_slenderness
from rocking.engine import require_finished
from rocking.motion import pulses
from rocking.simulation import simulate

#: Width of the final bracket.
_WIDTH: Final = 1e-12

#: Beyond it no block's first sequence has been seen to be complete; doubled where one is.
_FIRST_HIGH: Final = 1.5

#: Phase before uplift at which the simulated motion starts.
_LEAD: Final = 0.1


def critical_amplitude_nonlinear(omega: ArrayLike, eta: ArrayLike, alpha: ArrayLike) -> Floats:
    """Critical amplitude of the nonlinear block, which `critical_amplitude` gives in the slender limit.

    Parameters
    ----------
    omega : array_like
        Forcing frequency over p.
    eta : array_like
        Coefficient of restitution.
    alpha : array_like
        Slenderness angle, rad, between 0 and pi/2.

    Returns
    -------
    array of float
        Ground acceleration over g tan(alpha), the block's own threshold of uplift, of the broadcast shape. Multiply by
        tan(alpha)/alpha to get it over g alpha, as in the slender theory.

    Raises
    ------
    InvalidOption
        If a parameter is NaN, infinite or out of range.

    Notes
    -----
    By bisection to 1e-12 on whether `rocking.simulate`, nonlinear and certified, finds the block at rest within half
    a period of uplift; some 40 simulations for each value. Source: the paper's Eqs 1, 2 and 13 and section 5.1.

    Examples
    --------
    >>> from rocking.chattering import critical_amplitude
    >>> nonlinear = critical_amplitude_nonlinear(2.0, 0.92, 0.2)
    >>> f"{nonlinear - critical_amplitude(2.0, 0.92):.1e}"
    '-7.3e-06'
    """
    parameters = checked_frequency(omega), checked_restitution(eta), checked_slenderness(alpha)
    shape, (frequencies, restitutions, angles) = broadcast(*parameters)
    cases = zip(frequencies.tolist(), restitutions.tolist(), angles.tolist(), strict=True)
    return np.array([_critical(*case) for case in cases]).reshape(shape)[()]


def _critical(omega: float, eta: float, alpha: float) -> float:
    if eta == 1.0:
        return 1.0
    block = Block.from_parameters(p=1.0, alpha=alpha, restitution=eta)
    low, high = 1.0, _FIRST_HIGH
    while _comes_to_rest(block, high, omega):
        low, high = high, 2.0 * high
    while high - low > _WIDTH:
        middle = 0.5 * (low + high)
        if _comes_to_rest(block, middle, omega):
            low = middle
        else:
            high = middle
    return low


def _comes_to_rest(block: Block, a: float, omega: float) -> bool:
    """Whether the block rests within half a period of its first uplift under a sine of amplitude a g tan(alpha)."""
    amplitude = a * block.gravity * math.tan(block.sides[0].alpha)
    turn = 2.0 * math.pi
    motion = pulses.sine(amplitude, omega / turn, cycles=(math.pi + _LEAD) / turn, phase=math.asin(1.0 / a) - _LEAD)
    response = simulate(block, motion, model="nonlinear", duration=motion.duration)
    require_finished(np.array([response.unfinished]))
    return bool((response.events["kind"] == "rest").any())
