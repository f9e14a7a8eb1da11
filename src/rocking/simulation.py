"""The main job: one block, one motion, an exact response."""

from __future__ import annotations

import math

from rocking.block import Block, Blocks
from rocking.errors import InvalidOption
from rocking.kernels import state, status
from rocking.kernels.march import march
from rocking.motion.motion import Motion
from rocking.problem import Model, rules_of, shaking_of, sides_of
from rocking.response import Response
from rocking.treatment import Treatment, treatment

#: Rows of the first tables per piece of the motion, and the most that tables may grow to.
_FIRST_ROWS = 1.25
_MOST_ROWS = 30_000_000


def simulate(
    block: Block,
    motion: Motion | None,
    *,
    model: Model = "nonlinear",
    chattering: str | Treatment = "certified",
    duration: float | None = None,
    initial_rotation: float = 0.0,
    initial_velocity: float = 0.0,
) -> Response:
    """Response of a block to a ground motion, with every impact located and chattering resolved by proof.

    Parameters
    ----------
    block : Block
        What rocks.
    motion : Motion or None
        Horizontal ground acceleration; None for free rocking.
    model : {"nonlinear", "linear"}
        Equation of motion: exact, or linearised for slender blocks (paper, Eqs 2 and 3).
    chattering : str or treatment
        How sequences of impacts end: "certified" (default), "velocity", "interval" or "time", or the object with its
        parameter (`Certified`, `VelocityThreshold`, `IntervalThreshold`, `AsymptoticTime`).
    duration : float, optional
        Time to stop at, s. By default to the end of the motion, and on until rest or overturning.
    initial_rotation : float
        Rotation at time 0, rad; positive leans to side +.
    initial_velocity : float
        Angular velocity at time 0, rad/s.

    Returns
    -------
    Response
        Events, impacts, chattering sequences, and the rotation at any time.

    Raises
    ------
    InvalidOption
        If an argument is out of its range, or the block would never come to rest and no duration is given.

    Notes
    -----
    Between impacts the rotation is a Taylor series about the last event (paper, Eq. 15); the next impact is the first
    root of that series divided by time (paper, Eq. 20), found so that none can be missed.

    Examples
    --------
    A slender block is released from a tenth of its slenderness and rocks to rest:

    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> response = rocking.simulate(block, None, model="linear", initial_rotation=0.02)
    >>> response.overturned, len(response.impacts) > 50, f"{response.events['time'][-1]:.6f}"
    (False, True, '4.235818')
    """
    how, blocks = treatment(chattering), Blocks.of([block])
    rules = rules_of(blocks, model, how, duration, record=True)
    shaking = shaking_of(motion, block.gravity)
    sides = sides_of(blocks, model, how.limits(blocks, motion))[0]
    at, x = state.new_state()
    at[state.SIDE], x[state.U], x[state.V] = _initial_state(initial_rotation, initial_velocity)
    x[state.PEAK] = x[state.U]
    tables = state.new_tables(64 + int(_FIRST_ROWS * len(shaking.coefficients)))
    scratch = state.new_scratch(shaking.coefficients.shape[1])
    pieces = len(shaking.coefficients) + 1
    ending = march(shaking, sides, rules, tables, scratch, at, x, pieces)
    while ending == status.FULL:
        if tables.shape[1] > _MOST_ROWS:
            raise InvalidOption(f"the response takes more than {_MOST_ROWS} steps; give a shorter duration=")
        tables = state.grown(tables)
        ending = march(shaking, sides, rules, tables, scratch, at, x, pieces)
    if ending == status.BALANCED:
        raise InvalidOption("the block balances on its corner for ever; give duration= or another initial state")
    return Response.from_march(
        block, motion, model, how, state.Trail(shaking, sides, rules, tables[state.NODE_TABLE]), tables, at, x
    )


def _initial_state(rotation: float, velocity: float) -> tuple[int, float, float]:
    """Side index, rotation and velocity in that side's frame; at rest where both are zero."""
    for value, name in ((rotation, "initial_rotation"), (velocity, "initial_velocity")):
        if not (isinstance(value, (int, float)) and math.isfinite(value)):
            raise InvalidOption(f"{name} must be a finite number, not {value!r}")
    if abs(rotation) >= 0.5 * math.pi:
        raise InvalidOption(f"initial_rotation must be below pi/2 rad in size, not {rotation:g}")
    if rotation == 0.0 and velocity == 0.0:
        return state.AT_REST, 0.0, 0.0
    sign = math.copysign(1.0, rotation if rotation != 0.0 else velocity)
    return (0 if sign > 0.0 else 1), abs(rotation), sign * velocity
