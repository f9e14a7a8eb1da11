"""Simulation of one body under one ground motion."""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from rocking.block.body import Body
from rocking.block.friction import Friction, resolve_friction
from rocking.core.arrays import Floats
from rocking.core.constants import Model
from rocking.engine.problem import compute_peaks, require_body, set_start
from rocking.engine.schemes import ChatteringScheme, chattering_scheme
from rocking.engine.tasks import STEPS_PER_SLICE, Setup, count_slices
from rocking.errors import OptionError
from rocking.kernels import state
from rocking.kernels.march import march
from rocking.kernels.trace import NO_NODES, Trail
from rocking.motion.motion import Motion
from rocking.records.named import check_motion
from rocking.response import Response
from rocking.response.history import Solution

_EVENT_DTYPE = np.dtype([("time", "f8"), ("kind", "U12"), ("side", "i1")])
_IMPACT_DTYPE = np.dtype([("time", "f8"), ("side", "i1"), ("speed_before", "f8"), ("speed_after", "f8")])
_SEQUENCE_DTYPE = np.dtype([("start", "f8"), ("end", "f8"), ("lower", "f8"), ("upper", "f8"), ("impacts", "i8")])

#: Event kinds by code (`rocking.kernels.state`).
_EVENT_KINDS = np.array(["uplift", "rest", "overturn", "slide", "stick", "slide-rock", "lost contact"])

#: Rows of the first table per piece of the motion.
_ROWS_PER_PIECE = 1.25


def simulate(
    block: Body,
    motion: Motion | None,
    *,
    model: Model = "nonlinear",
    chattering: str | ChatteringScheme = "certified",
    duration: float | None = None,
    initial_rotation: float = 0.0,
    initial_velocity: float = 0.0,
    friction: Friction | None = None,
) -> Response:
    """Simulate a block under a ground motion.

    Every impact is located, and chattering is resolved by a certificate.

    Parameters
    ----------
    block : Block
        Block, or another body (`rocking.block.body.Body`).
    motion : Motion or None
        Horizontal ground acceleration. None means free rocking.
    model : {"nonlinear", "linear"}
        Equation of motion, for finite rotations or linearised for slender blocks (paper, Eqs 2 and 3).
    chattering : str or ChatteringScheme
        Method for the end of a sequence of impacts: "certified" (default), "velocity", "bypass", "interval" or "time",
        or an object with its parameter (`Certified`, `VelocityThreshold`, `GeometricBypass`, `IntervalThreshold`,
        `AsymptoticTime`).
    duration : float, optional
        End of the simulation, s. By default the simulation continues beyond the motion until rest, overturning, or
        proof that restraints hold the block leaning for ever. A response cut during the motion of ground or block is
        `ended_early`, with undetermined outcome.
    initial_rotation, initial_velocity : float
        Initial rotation (rad, positive to side +) and angular velocity (rad/s), or coordinate and rate of another body.
    friction : float or pair, optional
        Coefficient of friction of the base, or the pair (static, kinetic). By default the block never slips. Available
        for free blocks, and for kinetic coefficients up to 1.33 for a rectangle.

    Returns
    -------
    Response
        Events, impacts, chattering sequences, and rotation history.

    Raises
    ------
    BlockError, MotionError
        If `block` is not a body, `motion` is not a `Motion`, or a body on a line has vertical motion.
    OptionError
        If an option is out of range, or `friction` is not available for the block.

    See Also
    --------
    rocking.simulate_many : Simulate many blocks under many motions.
    rocking.Motion : Ground motion.
    rocking.Response : Result of a simulation.

    Notes
    -----
    Without `friction` the block does not slide, and `Response.sliding_time` and ``summary(available_friction)`` report
    when it would. With `friction` it sticks, slides on both pivots or slips on one while it rocks, and every transition
    is located (see "Sliding" in the documentation).

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> response = rocking.simulate(block, None, model="linear", initial_rotation=0.02)
    >>> response.overturned, len(response.impacts) > 50, f"{response.events['time'][-1]:.6f}"
    (False, True, '4.235818')
    """
    initial = initial_rotation, initial_velocity
    return compute_response(block, motion, model, chattering, duration, initial, friction=resolve_friction(friction))


def compute_response(
    block: Body,
    motion: Motion | None,
    model: Model,
    chattering: str | ChatteringScheme,
    duration: float | None,
    initial: tuple[float, float],
    name: str | None = None,
    factor: float = 1.0,
    *,
    friction: tuple[float, float] | None = None,
) -> Response:
    """Compute a response like `simulate`, with `name` for the initial coordinate in errors."""
    scheme, bodies, motion = chattering_scheme(chattering), require_body(block).as_bodies(), check_motion(motion)
    setup = Setup(bodies, model, scheme, duration, initial, friction)
    run = setup.prepare(motion, factor, writes_tables=True, name=name)
    if factor != 1.0:
        set_start(run.states, run.structs, bodies, *_scale_start(initial, factor, run.structs, bodies.stops[0]), name)
    trail, body_state = Trail(run.ground, run.structs[0], run.settings, NO_NODES), run.states[0]
    status, table = march_in_slices(trail, body_state)
    if status == state.MarchStatus.BALANCED:
        raise OptionError("the block remains balanced on its corner; give {} or another initial state", "duration")
    events = table["event"][: body_state["event_count"]]
    overturned = status == state.MarchStatus.OVERTURNED
    return Response(
        block=block,
        motion=motion,
        model=model,
        chattering=scheme,
        friction=friction,
        overturned=overturned,
        unfinished=status == state.MarchStatus.UNFINISHED,
        leans=status == state.MarchStatus.LEANS,
        lost_contact=status == state.MarchStatus.LOST,
        largest_slip=bodies.gravity * float(body_state["largest_slip"]),
        overturn_time=float(events["time"][-1]) if overturned else math.nan,
        peak_rotation=float(compute_peaks(body_state, trail.block, np.array(block.stops))),
        peak_time=float(body_state["peak_time"]),
        duration=float(body_state["end_time"]),
        events=_convert_events(events),
        impacts=_convert_rows(table["impact"][: body_state["impact_count"]], _IMPACT_DTYPE),
        rests_by_rounding=int(body_state["rests_by_rounding"]),
        rounding_decisions=int(body_state["rounding_decisions"]),
        solution=Solution(
            trail=trail._replace(nodes=state.expose_fields(np.array(table["node"][: body_state["node_count"]]))),
            sequences=_convert_rows(table["sequence"][: body_state["sequence_count"]], _SEQUENCE_DTYPE),
            residual=float(
                block.stops[int(body_state["side"] in (1, -2))]
                + (1 - 2 * body_state["side"]) * body_state["leaning_rotation"]
            ),
            repeat=functools.partial(
                compute_response, block, motion, model, scheme, duration, initial, name, friction=friction
            ),
        ),
    )


def _scale_start(
    initial: tuple[float, float], factor: float, structs: state.Structs, stops: Floats
) -> tuple[float, float]:
    """Scale the distance of an initial coordinate from its stop, below overturning, and its rate."""
    coordinate, rate = initial
    if coordinate in stops:
        return coordinate, factor * rate
    limit = math.nextafter(float(structs["overturn_angle"].min()), 0.0)
    distance = factor * (coordinate - float(stops[0]))
    return float(stops[0]) + min(max(distance, -limit), limit), factor * rate


def march_in_slices(trail: Trail, body_state: state.Struct) -> tuple[int, state.Structs]:
    """Integrate in interruptible slices, and return the end and the growing table."""
    ground, block, settings, _ = trail
    table = state.create_table(128 + int(_ROWS_PER_PIECE * len(ground.pieces)))
    scratch = state.create_scratch()
    status: int = state.MarchStatus.PAUSED
    for _ in range(count_slices(ground)):
        body_state["budget"] = STEPS_PER_SLICE
        status = march(ground, block, settings, table, scratch, body_state)
        while status == state.MarchStatus.FULL:
            table = state.enlarge_table(table)
            status = march(ground, block, settings, table, scratch, body_state)
        if status != state.MarchStatus.PAUSED:
            return status, table
    body_state["end_time"] = table["node"]["time"][body_state["node_count"] - 1]
    body_state["status"] = state.MarchStatus.UNFINISHED
    return state.MarchStatus.UNFINISHED, table


def _convert_rows(rows: state.Structs, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    converted = np.empty(len(rows), dtype=dtype)
    for name in dtype.names or ():
        converted[name] = rows[name]
    return converted


def _convert_events(rows: state.Structs) -> NDArray[np.void]:
    events = np.empty(len(rows), dtype=_EVENT_DTYPE)
    events["time"], events["side"], events["kind"] = rows["time"], rows["side"], _EVENT_KINDS[rows["kind"]]
    return events
