"""Blocks, a motion and the rules of a simulation as the plain arrays that kernels take."""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np

from rocking.block import Blocks
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


def sides_of(blocks: Blocks, model: Model, limits: state.Floats) -> state.Floats:
    """Sides of every block as the kernels take them (`state`), shape (n, 2, 6)."""
    p, alpha = blocks.p, blocks.alpha
    threshold, gain = (alpha, p * p) if model == "linear" else (np.tan(alpha), p * p * np.cos(alpha))
    return np.stack([p * p, alpha, threshold, gain, blocks.restitution, limits], axis=2)


def rules_of(
    blocks: Blocks, model: Model, treatment: Treatment, duration: float | None, *, record: bool
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
        if np.any(np.prod(blocks.restitution, axis=1) == 1.0):
            raise InvalidOption("a block with restitution 1 never comes to rest; give duration= to say when to stop")
    elif not (isinstance(duration, (int, float)) and math.isfinite(duration) and duration > 0.0):
        raise InvalidOption(f"duration must be a positive number of seconds, not {duration!r}")
    return state.Rules(
        nonlinear=model == "nonlinear",
        treatment=treatment.code,
        tolerance=treatment.tolerance if isinstance(treatment, Certified) else 0.0,
        stop=math.inf if duration is None else float(duration),
        endless=duration is None,
        record=record,
    )


def _readonly(array: state.Floats) -> state.Floats:
    array.flags.writeable = False
    return array
