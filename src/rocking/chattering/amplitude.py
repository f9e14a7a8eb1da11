"""The critical amplitude: below it chattering is complete, above it the block does not come to rest."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from rocking import pulses
from rocking.block import Block
from rocking.chattering.expansions import broadcast, checked_frequency, checked_restitution, checked_slenderness
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.bisection import bisected
from rocking.core.progress import Progress
from rocking.core.threads import in_threads
from rocking.engine.tasks import require_finished
from rocking.engine.treatment import critical_amplitudes_by
from rocking.errors import InvalidOption, Unfinished
from rocking.simulation.simulate import simulate

#: Where the Chebyshev expansion holds.
FREQUENCIES: Final = (0.4, 10.0)
RESTITUTIONS: Final = (0.5, 0.97)

#: The same in the expansion's variables, 1/omega^2 and sqrt(1 - eta).
_DOMAIN: Final = (
    (1.0 / FREQUENCIES[1] ** 2, 1.0 / FREQUENCIES[0] ** 2),
    (np.sqrt(1.0 - RESTITUTIONS[1]), np.sqrt(1.0 - RESTITUTIONS[0])),
)

#: Row i, column j: T_i of the scaled 1/omega^2, T_j of the scaled sqrt(1 - eta). They interpolate the exact amplitude
#: at 24 x 24 Chebyshev nodes; the largest error on a grid of 150 x 150 points that reaches all edges is 3.2e-8.
_COEFFICIENTS: Final = np.array([
    [0.058942488924, 0.041606830693, -0.001733337117, -0.000550119971, 0.00022628456,
     -9.498518e-06, 1.603524e-06, 8.85382e-07, 7.3162e-08, -3.676e-08],
    [-0.01741909403, -0.020399361271, -0.003478615758, 0.00044251101, 5.4432568e-05,
     -4.0269211e-05, -2.885769e-06, 7.66302e-07, -1.34224e-07, -6.3172e-08],
    [0.002327106067, 0.003319042002, 0.001143747022, 0.000110826872, -3.0838276e-05,
     -1.615827e-06, 3.049668e-06, 3.81899e-07, -1.00667e-07, -3.074e-09],
    [-0.000285936282, -0.000450015994, -0.000213990163, -5.3686836e-05, -2.192482e-06,
     1.925241e-06, -2.0622e-08, -2.25042e-07, -3.0009e-08, 1.0102e-08],
    [3.2705582e-05, 5.4606084e-05, 3.133989e-05, 1.1656409e-05, 2.253387e-06,
     -7.8268e-08, -1.15586e-07, 1.1116e-08, 1.6235e-08, 1.727e-09],
    [-3.502989e-06, -6.090024e-06, -3.96462e-06, -1.868293e-06, -5.7941e-07,
     -8.0459e-08, 1.5072e-08, 6.348e-09, -1.484e-09, -1.116e-09],
    [3.50231e-07, 6.28089e-07, 4.49543e-07, 2.5049e-07, 1.02645e-07,
     2.6631e-08, 1.781e-09, -1.38e-09, -2.87e-10, 1.49e-10],
    [-3.2158e-08, -5.9274e-08, -4.6025e-08, -2.9384e-08, -1.4752e-08,
     -5.343e-09, -1.09e-09, 5.9e-11, 9.9e-11, 7e-12],
])  # fmt: skip

#: Phase before uplift at which the simulated motion starts.
_LEAD: Final = 0.1


def critical_amplitude(omega: ArrayLike, eta: ArrayLike, *, method: str = "exact") -> Floats:
    """Amplitude of the ground acceleration up to which chattering is complete.

    Parameters
    ----------
    omega, eta : array_like
        Forcing frequency over p, and coefficient of restitution.
    method : {"exact", "eq76", "eq77", "approximation"}
        "exact": by root finding on certified sequences, to 1e-14. "eq76", "eq77": the paper's fits, off by up to 1.1
        and 5.4 % in eta from 0.5 to 0.97, omega from 0.5 to 8. "approximation": a Chebyshev expansion with a largest
        error of 4e-8, for eta from 0.5 to 0.97 and omega from 0.4 to 10 only.

    Returns
    -------
    array of float
        a_cr, over g alpha, of the broadcast shape (a number for numbers): the supremum of all amplitudes whose first
        sequence of impacts accumulates within half a period of uplift.

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
    """
    chosen = checks.one_of(method, "method", InvalidOption, ("exact", "eq76", "eq77", "approximation"))
    shape, flat = broadcast(checked_frequency(omega), checked_restitution(eta))
    found = _approximation(*flat) if chosen == "approximation" else critical_amplitudes_by(chosen, *flat)
    return found.reshape(shape)[()]


def _approximation(omega: Floats, eta: Floats) -> Floats:
    """Chebyshev expansion in 1/omega^2 and sqrt(1 - eta)."""
    low, high = FREQUENCIES
    least, most = RESTITUTIONS
    if (omega < low).any() or (omega > high).any() or (eta < least).any() or (eta > most).any():
        raise InvalidOption(
            f'{{}} "approximation" holds for omega from {low:g} to {high:g} and eta from {least:g} to {most:g} only: '
            'use "exact" elsewhere',
            "method",
        )
    x, y = (
        (2.0 * value - start - end) / (end - start)
        for value, (start, end) in zip((1.0 / omega**2, np.sqrt(1.0 - eta)), _DOMAIN, strict=True)
    )
    amplitudes: Floats = 1.0 + chebyshev.chebval2d(x, y, _COEFFICIENTS)
    return amplitudes


def critical_amplitude_nonlinear(
    omega: ArrayLike, eta: ArrayLike, alpha: ArrayLike, *, threads: int | None = None, progress: bool | None = None
) -> Floats:
    """Critical amplitude of the nonlinear block, which `critical_amplitude` gives in the slender limit.

    Parameters
    ----------
    omega, eta : array_like
        As in `critical_amplitude`.
    alpha : array_like
        Slenderness angle, rad, between 0 and pi/2.
    threads, progress : int or bool, optional
        As for `rocking.simulate_many`.

    Returns
    -------
    array of float
        Ground acceleration over g tan(alpha), the block's own threshold of uplift, of the broadcast shape; NaN where a
        simulation is given up since eta is too close to 1. Multiply by tan(alpha)/alpha to get it over g alpha, as in
        the slender theory.

    Notes
    -----
    By bisection to 1e-12 on whether `rocking.simulate`, nonlinear and certified, finds the block at rest within half
    a period of uplift; some 40 simulations for each value. Source: the paper's Eqs 1, 2 and 13 and section 5.1.

    Examples
    --------
    >>> nonlinear = critical_amplitude_nonlinear(2.0, 0.92, 0.2)
    >>> f"{nonlinear - critical_amplitude(2.0, 0.92):.1e}"
    '-7.3e-06'
    """
    parameters = checked_frequency(omega), checked_restitution(eta), checked_slenderness(alpha)
    count = None if threads is None else checks.whole(threads, "threads", InvalidOption, least=1)
    shape, flat = broadcast(*parameters)
    cases = list(zip(*(values.tolist() for values in flat), strict=True))
    found = np.empty(len(cases))
    with Progress("bisecting", len(cases), show=progress) as bar:
        for k, amplitude in enumerate(in_threads(lambda case: _critical(*case), cases, threads=count)):
            found[k] = amplitude
            bar.advance()
    return found.reshape(shape)[()]


def _critical(omega: float, eta: float, alpha: float) -> float:
    if eta == 1.0:
        return 1.0
    block = Block.from_parameters(p=1.0, alpha=alpha, restitution=eta)
    # Beyond 1.5 no block's first sequence has been seen to be complete.
    low, high = 1.0, 1.5
    try:
        while _comes_to_rest(block, high, omega):
            low, high = high, 2.0 * high
        return bisected(low, high, lambda a: not _comes_to_rest(block, a, omega), width=1e-12)[0]
    except Unfinished:
        return math.nan


def _comes_to_rest(block: Block, a: float, omega: float) -> bool:
    """Whether the block rests within half a period of its first uplift under a sine of amplitude a g tan(alpha)."""
    amplitude = a * block.gravity * math.tan(block.sides[0].alpha)
    turn = 2.0 * math.pi
    motion = pulses.sine(amplitude, omega / turn, cycles=(math.pi + _LEAD) / turn, phase=math.asin(1.0 / a) - _LEAD)
    response = simulate(block, motion, model="nonlinear", duration=motion.duration)
    require_finished(response.unfinished)
    return bool((response.events["kind"] == "rest").any())
