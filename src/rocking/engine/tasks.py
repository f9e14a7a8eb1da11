"""Engine for many simulations: tasks of bodies under a scaled motion, in threads."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.block.body import Bodies
from rocking.block.friction import add_friction
from rocking.block.single import ROTATION
from rocking.core.arrays import Flags, Floats, Integers, split_range
from rocking.core.constants import Model
from rocking.core.tables import format_count
from rocking.core.threads import choose_thread_count, map_in_threads
from rocking.engine.problem import (
    GroundGroup,
    build_settings,
    compute_peaks,
    prepare_ground,
    prepare_grounds,
    set_start,
)
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import MotionError, UnfinishedError
from rocking.kernels import lanes, state
from rocking.kernels.ground import Ground, Grounds, compute_max_weights, select_ground
from rocking.kernels.lane_steps import LANE_COUNT
from rocking.kernels.march import march
from rocking.kernels.state import Struct, Structs
from rocking.kernels.uplift import write_completeness
from rocking.motion.motion import Motion

#: Fields of an outcome. ``unfinished``: the step budget was exceeded. ``ended_early``: the duration ended while the
#: body moved or the motion continued. In both cases all other fields are incomplete. ``leans``: restraints hold the
#: body in a leaning position for ever. ``lost_contact``: the ground no longer presses on it, where the simulation ends.
#: ``largest_slip``, ``residual_slip``: displacement of the base relative to the ground, m.
#: ``residual_rotation``: final rotation, NaN if unknown. ``complete_chattering``: the body
#: rested after its first uplift before the motion exceeded a threshold again. ``rests_by_rounding``: number of rests
#: because time no longer advanced. Times of events that did not occur are 0.
OUTCOME_DTYPE = np.dtype(
    [
        ("overturned", "?"), ("unfinished", "?"), ("ended_early", "?"), ("leans", "?"), ("lost_contact", "?"),
        ("peak_rotation", "f8"), ("residual_rotation", "f8"), ("peak_time", "f8"),
        ("impacts", "i8"), ("uplifts", "i8"), ("rests", "i8"), ("time_at_rest", "f8"), ("first_uplift", "f8"),
        ("first_rest", "f8"), ("last_rest", "f8"), ("complete_chattering", "?"), ("rests_by_rounding", "i8"),
        ("duration", "f8"), ("largest_slip", "f8"), ("residual_slip", "f8"),
    ]
)  # fmt: skip

#: Step budget of a simulation, besides a few steps for every piece of its motion.
STEP_BUDGET: Final = 3_000_000
STEP_BUDGET_PER_PIECE: Final = 4

#: Steps per call of a kernel, for one body and for each of many: milliseconds until an interrupt.
STEPS_PER_SLICE: Final = 50_000
_STEPS_OF_FIRST_SLICE: Final = 5_000

#: Number of simulations in a call of a kernel, and of their pieces in lanes, where it is larger. A call takes at most
#: about half a second; the last simulations of a call do not fill the lanes.
_CALL_SIZE: Final = 16 * LANE_COUNT
_CALL_PIECES: Final = 20_000_000

#: Largest number of steps of all simulations in one task, enough to amortise the call and few enough to stop soon after
#: an interrupt, and of pieces of its motions.
_TASK_STEPS: Final = 8_000_000
_TASK_PIECES: Final = 500_000


@dataclass(frozen=True)
class Setup:
    """Common properties of all simulations: n bodies, and the options of `rocking.simulate`."""

    bodies: Bodies
    model: Model
    chattering: ChatteringScheme
    duration: float | None = None
    #: Coordinate of all bodies at time 0 and its rate; None means zero, or the stop if zero is behind the stop.
    start: tuple[float | None, float] = (None, 0.0)
    #: Static and kinetic coefficient of friction; None for bodies that never slip.
    friction: tuple[float, float] | None = None

    def prepare(
        self,
        motion: Motion | None,
        factor: float = 1.0,
        *,
        writes_tables: bool = False,
        ground: Ground | None = None,
        name: str | None = None,
    ) -> KernelArguments:
        """Return the arguments of the kernels for the bodies under a scaled motion, after checking all arguments."""
        bodies = self.bodies
        check_components(bodies, motion)
        settings = build_settings(bodies, self.model, self.chattering, self.duration, writes_tables=writes_tables)
        thresholds = self.chattering.thresholds(bodies, motion, self.model, factor)
        structs = bodies.create_kernel_structs(self.model, thresholds)
        if self.friction is not None:
            add_friction(structs, bodies, self.model, self.friction)
        if ground is None:
            ground = prepare_ground(motion, bodies.gravity)._replace(factor=float(factor))
        states = state.create_states(len(bodies), 0)
        set_start(states, structs, bodies, *self.start, name)
        return KernelArguments(ground, structs, settings, states)


class KernelArguments(NamedTuple):
    """Bodies under a motion, as kernels accept them: the ground, a struct and a state per body, and the settings."""

    ground: Ground
    structs: Structs
    settings: Struct
    states: Structs


@dataclass(frozen=True, eq=False)
class Task:
    """Simulations of bodies under multiples of motions."""

    bodies: slice | Integers  # body of each
    motions: tuple[Motion, ...]
    factor: float | Floats = 1.0  # of all motions, or of each simulation
    motion_indices: Integers | None = None  # index of the motion of each; None: the first of all
    key: Any = ()  # index of the outcomes for the caller


def simulate_tasks(setup: Setup, tasks: Iterable[Task]) -> Iterator[tuple[Task, NDArray[np.void]]]:
    """Simulate tasks, and yield their outcomes in order: structured arrays (`OUTCOME_DTYPE`), one row per simulation.

    Tasks are consumed as needed, slightly ahead of the results. An outcome depends only on the body, the motion and the
    factor, bit for bit, not on the task. An interrupt cancels the remaining tasks.
    """
    cancelled = threading.Event()

    def run_task(task: Task) -> tuple[Task, NDArray[np.void]]:
        return task, simulate_task(setup, task, cancelled)

    yield from map_in_threads(run_task, tasks, cancelled=cancelled)


def split_simulations(motions: Sequence[Motion], counts: Integers) -> Iterator[slice]:
    """Divide simulations, so many for each motion in turn, into ranges of the size of a task.

    A range contains either part of the simulations under one motion, or all of those under some.
    """
    pieces = np.array([len(motion.coefficients) for motion in motions])
    max_steps = max(1, min(_TASK_STEPS, int(pieces @ counts) // (2 * choose_thread_count())))
    start = stop = steps = motion_pieces = 0
    for length, count in zip(pieces.tolist(), counts.tolist(), strict=True):
        if stop > start and (steps + length * count > max_steps or motion_pieces + length > _TASK_PIECES):
            yield slice(start, stop)
            start, steps, motion_pieces = stop, 0, 0
        size = max(_CALL_SIZE, max_steps // max(length, 1))
        while count > size:
            yield slice(start, start + size)
            start, stop, count = start + size, stop + size, count - size
        stop, steps, motion_pieces = stop + count, steps + length * count, motion_pieces + length
    if stop > start:
        yield slice(start, stop)


def simulate_each(
    setup: Setup, motions: Sequence[Motion], bodies: Integers, motion_indices: Integers, factors: Floats
) -> Iterator[tuple[Integers, NDArray[np.void]]]:
    """Yield indices k and outcomes of ``bodies[k]`` under motion ``motion_indices[k]`` times ``factors[k]``."""
    order = np.argsort(motion_indices, kind="stable")
    tasks = (
        create_task(bodies[part], motions, motion_indices[part], factors[part], part)
        for part in (
            order[part] for part in split_simulations(motions, np.bincount(motion_indices, minlength=len(motions)))
        )
    )
    for task, outcomes in simulate_tasks(setup, tasks):
        yield task.key, outcomes


def create_task(
    bodies: Integers, motions: Sequence[Motion], motion_indices: Integers, factors: Floats, key: Any = ()
) -> Task:
    """Create a task of simulations under some of the motions, from the indices of bodies and motions."""
    first, last = int(motion_indices.min()), int(motion_indices.max())
    return Task(bodies, tuple(motions[first : last + 1]), factors, motion_indices - first, key)


def require_finished(unfinished: bool) -> None:
    """Raise an error if a required simulation was aborted."""
    if unfinished:
        raise UnfinishedError(
            f"a simulation was aborted after more than {STEP_BUDGET:,} steps, so its outcome is unknown; "
            "simulate this case alone for its partial response, or give a duration"
        )


def describe_missing(missing: Flags | int) -> str:
    """Return a sentence on the abandoned simulations, whose outcomes are missing; empty if there are none."""
    count = int(np.sum(missing))
    return f"{format_count(count, 'simulation')} given up after too many steps: outcomes missing" * (count > 0)


def check_components(bodies: Bodies, motion: Motion | None) -> None:
    """Raise an error if a motion has a vertical component although the bodies move along a line."""
    if motion is not None and motion.vertical is not None and bodies[0].coordinate.unit != ROTATION.unit:
        raise MotionError(
            f"this {bodies[0].description} moves along one line; use a motion without a vertical component"
        )


def simulate_task(setup: Setup, task: Task, cancelled: threading.Event | None = None) -> NDArray[np.void]:
    """Compute the outcomes of one task; they are invalid if it is ``cancelled`` on the way."""
    bodies = setup.bodies.select(task.bodies)
    for ground_motion in task.motions:
        check_components(bodies, ground_motion)
    motion_indices = np.zeros(len(bodies), dtype=np.int64) if task.motion_indices is None else task.motion_indices
    factors = np.broadcast_to(np.asarray(task.factor, dtype=float), len(bodies)).copy()
    settings = build_settings(bodies, setup.model, setup.chattering, setup.duration, writes_tables=False)
    structs = bodies.create_kernel_structs(
        setup.model, _compute_thresholds(setup, bodies, task.motions, motion_indices, factors)
    )
    if setup.friction is not None:
        add_friction(structs, bodies, setup.model, setup.friction)
    states = state.create_states(len(bodies), 0)
    set_start(states, structs, bodies, *setup.start)
    complete = np.empty(len(bodies), dtype=bool)
    for group in prepare_grounds(task.motions, bodies.gravity):
        for indices, substeps in _split_group(group, motion_indices, factors, structs, setup.model):
            if cancelled is not None and cancelled.is_set():
                break
            index = np.searchsorted(group.indices, motion_indices[indices])
            # `take` copies structs 20 times as fast as indexing, which copies field by field.
            batch = _Batch(group.grounds, index, factors[indices], structs.take(indices), states.take(indices))
            piece_counts = np.diff(group.grounds.first_pieces)[index]
            batch.states["budget"] = _STEPS_OF_FIRST_SLICE + STEP_BUDGET_PER_PIECE * piece_counts
            _march_together(settings, batch, substeps)
            _resume_marches(settings, batch, cancelled)
            state.replace_structs(states, indices, batch.states)
            complete[indices] = detect_complete_chattering(*batch)
    outcomes = _collect_outcomes(states, np.array([motion.end for motion in task.motions])[motion_indices])
    outcomes["peak_rotation"] = compute_peaks(states, structs, bodies.stops)
    is_known = ~(outcomes["overturned"] | outcomes["unfinished"] | outcomes["ended_early"] | outcomes["lost_contact"])
    side = states["side"]
    stop = np.where((side == 1) | (side == -2), bodies.stops[:, 1], bodies.stops[:, 0])
    outcomes["residual_rotation"] = np.where(is_known, stop + (1.0 - 2.0 * side) * states["leaning_rotation"], np.nan)
    outcomes["largest_slip"] = bodies.gravity * states["largest_slip"]
    outcomes["residual_slip"] = np.where(outcomes["unfinished"], np.nan, bodies.gravity * states["slip"])
    outcomes["complete_chattering"] = complete
    return outcomes


def _compute_thresholds(
    setup: Setup, bodies: Bodies, motions: Sequence[Motion], motion_indices: Integers, factors: Floats
) -> Floats:
    """Compute the thresholds of the chattering scheme for each simulation, shape (n, 2)."""
    if len(motions) == 1 or setup.chattering.code != state.RestRule.TIME:
        return setup.chattering.thresholds(bodies, motions[0], setup.model, factors)
    thresholds = np.empty((len(bodies), 2))
    for m in np.unique(motion_indices):
        members = np.flatnonzero(motion_indices == m)
        thresholds[members] = setup.chattering.thresholds(
            bodies.select(members), motions[m], setup.model, factors[members]
        )
    return thresholds


class _Batch(NamedTuple):
    """Simulations under similar motions, as kernels accept them."""

    grounds: Grounds
    motion_indices: Integers  # index of the motion of each
    factors: Floats
    structs: Structs
    states: Structs


def _split_group(
    group: GroundGroup, motion_indices: Integers, factors: Floats, structs: Structs, model: Model
) -> Iterator[tuple[Integers, int]]:
    """Yield simulations under a group of motions for one call of a kernel, and their number of substeps.

    It is -1 for bodies simulated alone.
    """
    members = np.flatnonzero(np.isin(motion_indices, group.indices))
    index = np.searchsorted(group.indices, motion_indices[members])
    weight = compute_max_weights(group.grounds, index, factors[members])
    step, with_vertical = group.steps[index], group.grounds.stretches.shape[1] > 1
    width = step * np.sqrt(np.abs(structs["stiffness"][members]).max(axis=1) * weight)
    is_excluded = structs["restrained"] | structs["two_stops"] | (structs["has_friction"] & with_vertical)
    in_lanes = (step > 0.0) & (width <= lanes.MAX_STEP) & ~is_excluded[members]
    width = np.where(in_lanes, width, 0.0)
    if model == "nonlinear" or with_vertical:  # otherwise one formula covers a sample
        substeps = np.ceil(width / (lanes.MAX_SUBSTEP if model == "nonlinear" else lanes.MAX_WEIGHTED_SUBSTEP))
    else:
        substeps = np.zeros(len(width))
    substeps = np.where(in_lanes, substeps, -1.0).astype(np.int64)
    pieces = int(np.diff(group.grounds.first_pieces).max(initial=1))
    for count in np.unique(substeps):
        indices = members[substeps == count]
        for part in split_range(len(indices), _CALL_SIZE if count < 0 else max(_CALL_SIZE, _CALL_PIECES // pieces)):
            yield indices[part], int(count)


def _march_together(settings: Struct, batch: _Batch, substeps: int) -> None:
    """Run simulations in lanes, or one after the other if lanes do not support them."""
    count = max(substeps, 0) if settings["nonlinear"] else 0
    pool = lanes.build_pool(*batch, float(settings["stop_time"]), count)
    if substeps < 0:
        lanes.march_blocks(settings, state.create_scratch(), pool)
    else:
        lanes.run_lanes(settings, state.create_scratch(), pool, substeps)


def _resume_marches(settings: Struct, batch: _Batch, cancelled: threading.Event | None) -> None:
    """Continue simulations that have used up their first slice of steps, up to their budget."""
    empty_table, scratch = state.create_table(0), state.create_scratch()
    status = batch.states["status"]
    for k in np.flatnonzero((status == state.MarchStatus.RUNNING) | (status == state.MarchStatus.PAUSED)):
        body_state = batch.states[k]
        ground = select_ground(batch.grounds, batch.motion_indices[k], float(batch.factors[k]))
        body_state["stop_piece"] = state.NO_STOP_PIECE
        for _ in range(count_slices(ground)):
            if cancelled is not None and cancelled.is_set():
                return
            body_state["budget"] = STEPS_PER_SLICE
            body_state["status"] = march(ground, batch.structs[k], settings, empty_table, scratch, body_state)
            if int(body_state["status"]) != state.MarchStatus.PAUSED:
                break
        else:
            body_state["status"] = state.MarchStatus.UNFINISHED


def count_slices(ground: Ground) -> int:
    """Return the number of slices in the budget of a simulation."""
    return math.ceil((STEP_BUDGET + STEP_BUDGET_PER_PIECE * len(ground.pieces)) / STEPS_PER_SLICE)


def detect_complete_chattering(
    grounds: Grounds, motion_indices: Integers, factors: Floats, structs: Structs, states: Structs
) -> Flags:
    """Whether chattering after the first uplift was complete, from the times of that uplift and the first rest."""
    complete = np.empty(len(states), dtype=bool)
    write_completeness(grounds, motion_indices, factors, structs, states, state.create_scratch(), complete)
    return complete


def _collect_outcomes(states: Structs, motion_end: Floats) -> NDArray[np.void]:
    outcomes = np.empty(len(states), dtype=OUTCOME_DTYPE)
    outcomes["overturned"] = states["status"] == state.MarchStatus.OVERTURNED
    outcomes["unfinished"] = states["status"] == state.MarchStatus.UNFINISHED
    outcomes["leans"] = states["status"] == state.MarchStatus.LEANS
    outcomes["lost_contact"] = states["status"] == state.MarchStatus.LOST
    is_early = (states["side"] >= 0) | (states["direction"] != 0) | (states["end_time"] < motion_end)
    # A body that remains balanced also has no outcome.
    is_undecided = (states["status"] == state.MarchStatus.DONE) | (states["status"] == state.MarchStatus.BALANCED)
    outcomes["ended_early"] = is_undecided & is_early
    for name, field in (
        ("peak_rotation", "peak"), ("peak_time", "peak_time"), ("impacts", "impact_count"), ("uplifts", "uplift_count"),
        ("rests", "rest_count"), ("time_at_rest", "time_at_rest"), ("first_uplift", "first_uplift"),
        ("first_rest", "first_rest"), ("last_rest", "last_rest_time"), ("rests_by_rounding", "rests_by_rounding"),
        ("duration", "end_time"),
    ):  # fmt: skip
        outcomes[name] = states[field]
    return outcomes
