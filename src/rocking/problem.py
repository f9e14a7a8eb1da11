"""Bodies, a motion and the rules of a simulation, as the records and arrays that kernels take."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from typing import cast

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Block, Blocks, one_block
from rocking.body import Bodies, Body
from rocking.constants import MODELS, Model
from rocking.errors import InvalidOption
from rocking.kernels import ground, state
from rocking.kernels.ground import Ground
from rocking.motion import piecewise
from rocking.motion.motion import Motion
from rocking.treatment import Treatment


@functools.lru_cache(maxsize=8)
def ground_of(motion: Motion | None, gravity: float, factor: float = 1.0) -> Ground:
    """Ground of a motion times a factor, a negative one for the horizontal component alone; without a motion no piece.

    The last few are kept: laying out a record takes as long as a block's march through it.
    """
    if motion is None:
        return ground.ground_of(_NO_BREAKPOINTS, _NO_COEFFICIENTS, 1.0, 0.0)
    coefficients = motion.coefficients if factor == 1.0 else _frozen(motion.coefficients * factor)
    if motion.vertical is None:
        return ground.ground_of(motion.breakpoints, coefficients, 1.0 / gravity, motion.error * abs(factor))
    (breakpoints, pushes), (_, lifts) = _joined(motion)
    error = max(motion.error, motion.vertical.error)
    return ground.ground_of(
        breakpoints, pushes * factor, 1.0 / gravity, error * abs(factor), vertical=lifts * abs(factor)
    )


def step_of(motion: Motion) -> float | None:
    """Length of the pieces of `ground_of` if they are equally long and straight lines in all components, else None."""
    if motion.vertical is None:
        return motion.step
    steps = [piecewise.even_step(pieces) for pieces in _joined(motion)]
    return None if None in steps else steps[0]


def bodies_of(given: Bodies | Body | Iterable[Block]) -> Bodies:
    """Return bodies as they are, a single one as `Bodies` of which it is the only one, and blocks as `Blocks`."""
    if isinstance(given, type):  # has what its objects have, but is none
        return Blocks.of(cast("Iterable[Block]", given))
    if isinstance(given, Bodies):
        return given
    return given.alone() if isinstance(given, Body) else Blocks.of(given)


def one_body(body: Body) -> Body:
    """Return the body, or say that it is none."""
    if isinstance(body, Block) or (isinstance(body, Body) and not isinstance(body, type)):  # a protocol is slow to ask
        return body
    return one_block(cast("Block", body))


def rules_of(
    bodies: Bodies, model: Model, treatment: Treatment, duration: float | None, *, record: bool
) -> state.Record:
    """Return the rules of a simulation, checked; its end must be given where nothing comes to rest."""
    checks.one_of(model, "model", InvalidOption, MODELS)
    if duration is None:
        if np.any(np.prod(bodies.restitution, axis=1) == 1.0):
            raise InvalidOption(
                "a block with {} 1 never comes to rest; give {} to say when to stop", "restitution", "duration"
            )
    else:
        duration = checks.positive(duration, "duration", InvalidOption, "s")
    return state.record(
        state.RULES,
        nonlinear=model == "nonlinear",
        treatment=treatment.code,
        tolerance=treatment.bracket,
        stop=math.inf if duration is None else duration,
        endless=duration is None,
        record=record,
    )


@functools.lru_cache(maxsize=8)
def _joined(motion: Motion) -> tuple[piecewise.Pieces, piecewise.Pieces]:
    """Both components of a motion on the same pieces."""
    assert motion.vertical is not None
    breakpoints, (pushes, lifts) = piecewise.together(motion, motion.vertical)
    return piecewise.Pieces(breakpoints, pushes), piecewise.Pieces(breakpoints, lifts)


def _frozen(array: Floats) -> Floats:
    array.flags.writeable = False
    return array


_NO_BREAKPOINTS, _NO_COEFFICIENTS = _frozen(np.zeros(1)), _frozen(np.zeros((0, 2)))
