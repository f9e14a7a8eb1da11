"""Families of simulations with two parameters, for `chattering_map`.

Each function accepts a block or a motion and the constants of a map, and returns a function of the two parameters. The
first is the amplitude ``a``: the peak acceleration, divided by the uplift acceleration (g tan(alpha), in the linear
model g alpha). Frequencies ``omega`` are 2 pi f divided by p of the block (the smaller p of a two-sided block).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

from rocking import pulses
from rocking.block import Block
from rocking.block.single import require_block
from rocking.core import checks
from rocking.core.constants import Model
from rocking.errors import MotionError, OptionError
from rocking.motion.motion import Motion
from rocking.records.named import check_motion


class SimulationInput(NamedTuple):
    """Input of the simulation at one point of a map.

    Attributes
    ----------
    block : Block
        Rocking block.
    motion : Motion
        Ground motion.
    model : {"nonlinear", "linear"}
        Equation of motion.
    """

    block: Block
    motion: Motion
    model: Model = "nonlinear"


Family = Callable[[float, float], SimulationInput]


def sine(block: Block, *, cycles: float = 2.5, model: Model = "nonlinear") -> Family:
    """Create sines with parameters (a, omega).

    Parameters
    ----------
    block : Block
        Rocking block.
    cycles : float
        Number of periods.
    model : {"nonlinear", "linear"}
        Equation of motion.

    Returns
    -------
    callable
        Function (a, omega) that returns a `SimulationInput`.

    See Also
    --------
    rocking.chattering.chattering_map : Compute a map of chattering over a family.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> case = sine(block, model="linear")(1.1, 3.0)
    >>> round(case.motion.pga / (0.2 * block.gravity), 9)
    1.1
    """
    scale = _find_threshold(block, model)
    return lambda a, omega: SimulationInput(
        block, pulses.sine(a * scale, _to_hertz(block, omega), cycles=cycles), model
    )


def lobes(block: Block, *, omega: float = 2.0, count: int = 5, model: Model = "nonlinear") -> Family:
    """Create sine half cycles with unequal amplitudes, with parameters (a, ratio).

    The first lobe has the amplitude a, not the largest, and each later amplitude is `ratio` times the previous one: the
    motion grows (ratio above 1) or decays.

    Parameters
    ----------
    block, omega, count, model : Block, float, int, str
        As in `sine`, with the frequency and the number of the lobes.

    Returns
    -------
    callable
        Function (a, ratio) that returns a `SimulationInput`.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> case = lobes(block, count=3)(1.2, 2.0)
    >>> round(case.motion.pga / min(block.uplift_thresholds()), 9)
    4.8
    """
    scale = _find_threshold(block, model)
    frequency = _to_hertz(block, checks.positive(omega, "omega", OptionError))
    n_lobes = checks.integer(count, "count", OptionError, minimum=1)

    def create_input(a: float, ratio: float) -> SimulationInput:
        return SimulationInput(block, pulses.n_lobe([a * scale * ratio**k for k in range(n_lobes)], frequency), model)

    return create_input


def ricker(
    block: Block, *, kind: Literal["symmetric", "antisymmetric"] = "symmetric", model: Model = "nonlinear"
) -> Family:
    """Create Ricker pulses with parameters (a, omega).

    Parameters
    ----------
    block, kind, model : Block, {"symmetric", "antisymmetric"}, str
        As in `sine` and `rocking.pulses.ricker`.

    Returns
    -------
    callable
        Function (a, omega) that returns a `SimulationInput`.

    Examples
    --------
    >>> import rocking
    >>> ricker(rocking.Block(width=0.2, height=0.8))(1.5, 2.0).motion.name
    'symmetric Ricker'
    """
    scale = _find_threshold(block, model)
    return lambda a, omega: SimulationInput(block, pulses.ricker(a * scale, _to_hertz(block, omega), kind=kind), model)


def mavroeidis_papageorgiou(
    block: Block, *, phase: float = 0.0, gamma: float = 3.0, model: Model = "nonlinear"
) -> Family:
    """Create near-fault pulses of Mavroeidis and Papageorgiou with parameters (a, omega).

    Parameters
    ----------
    block, phase, gamma, model : Block, float, float, str
        As in `sine` and `rocking.pulses.mavroeidis_papageorgiou`.

    Returns
    -------
    callable
        Function (a, omega) that returns a `SimulationInput`.

    Examples
    --------
    >>> import rocking
    >>> mavroeidis_papageorgiou(rocking.Block(width=0.2, height=0.8), gamma=2.0)(1.5, 2.0).model
    'nonlinear'
    """
    scale = _find_threshold(block, model)

    def create_input(a: float, omega: float) -> SimulationInput:
        pulse = pulses.mavroeidis_papageorgiou(1.0, _to_hertz(block, omega), phase=phase, gamma=gamma)
        return SimulationInput(block, pulse.scaled_to(a * scale), model)

    return create_input


def record(
    motion: Motion, alpha: float, restitution: float | None = None, *, model: Model = "nonlinear"
) -> Callable[[float, float], SimulationInput]:
    """Create scaled copies of one motion, and blocks of one shape, with parameters (a, p), p in rad/s.

    By dimensional analysis a smaller p is equivalent to the same block under a faster motion.

    Parameters
    ----------
    motion : Motion
        Motion to scale.
    alpha, restitution, model : float, float, str
        Slenderness of the blocks, rad, their restitution (by default after :cite:t:`housner1963`), and the model as in
        `sine`.

    Returns
    -------
    callable
        Function (a, p) that returns a `SimulationInput`.

    Examples
    --------
    >>> import rocking
    >>> record(rocking.pulses.one_sine(1.0, 1.0), 0.2, 0.9)(1.5, 2.0).block.p
    2.0
    """
    if check_motion(motion) is None:
        raise MotionError("motion must be a Motion, for example rocking.pulses.one_sine(1, 1); got None")

    def create_input(a: float, p: float) -> SimulationInput:
        block = Block.from_parameters(p, alpha, restitution)
        return SimulationInput(block, motion.scaled_to(a * _find_threshold(block, model)), model)

    return create_input


def _find_threshold(block: Block, model: Model) -> float:
    """Compute the lowest uplift acceleration, m/s^2."""
    return min(require_block(block).uplift_thresholds(model))


def _to_hertz(block: Block, omega: float) -> float:
    """Convert a frequency, divided by p, to Hz."""
    return omega * min(side.p for side in block.sides) / (2.0 * math.pi)
