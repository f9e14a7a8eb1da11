"""A block, a motion and the rules of a simulation as the plain arrays that kernels take."""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np

from rocking.block import Block
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.motion.motion import Motion
from rocking.treatment import Certified, Treatment

Model = Literal["nonlinear", "linear"]


def shaking_of(motion: Motion | None, gravity: float) -> state.Shaking:
    """Arrays of a motion; without one, no piece at all."""
    if motion is None:
        return state.Shaking(_readonly(np.zeros(1)), _readonly(np.zeros((0, 2))), 1.0 / gravity, 0.0)
    return state.Shaking(motion.breakpoints, motion.coefficients, 1.0 / gravity, motion.error / gravity)


def sides_of(block: Block, model: Model) -> state.Floats:
    """Rows side +, side -: p^2, alpha, uplift threshold in g, its gain, restitution."""
    return np.array([_side_row(side.p, side.alpha, side.restitution, model) for side in block.sides])


def _side_row(p: float, alpha: float, restitution: float, model: Model) -> list[float]:
    if model == "linear":
        return [p * p, alpha, alpha, p * p, restitution]
    return [p * p, alpha, math.tan(alpha), p * p * math.cos(alpha), restitution]


def rules_of(
    block: Block,
    motion: Motion | None,
    model: Model,
    treatment: Treatment,
    duration: float | None,
    *,
    record: bool,
) -> state.Rules:
    """Rules of a simulation, checked.

    Raises
    ------
    InvalidOption
        If the model is unknown, the duration is not positive, or it is not given where nothing comes to rest.
    """
    if model not in get_args(Model):
        raise InvalidOption(f"model must be one of {', '.join(get_args(Model))}, not {model!r}")
    if duration is None:
        if math.prod(side.restitution for side in block.sides) == 1.0:
            raise InvalidOption("a block with restitution 1 never comes to rest; give duration= to say when to stop")
    elif not (isinstance(duration, (int, float)) and math.isfinite(duration) and duration > 0.0):
        raise InvalidOption(f"duration must be a positive number of seconds, not {duration!r}")
    code, limits = treatment.code_and_limits(block, motion)
    return state.Rules(
        nonlinear=model == "nonlinear",
        treatment=code,
        limit=np.array(limits),
        tolerance=treatment.tolerance if isinstance(treatment, Certified) else 0.0,
        stop=math.inf if duration is None else float(duration),
        endless=duration is None,
        record=record,
    )


def _readonly(array: state.Floats) -> state.Floats:
    array.flags.writeable = False
    return array
