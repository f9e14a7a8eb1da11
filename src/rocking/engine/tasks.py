"""Engine for many simulations: tasks of bodies under a scaled motion, in threads."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.block.body import Bodies
from rocking.block.friction import add_friction
from rocking.block.single import ROTATION
from rocking.core.arrays import Flags, Floats, Integers, split_range
from rocking.core.constants import Model
from rocking.core.tables import format_count
from rocking.core.threads import map_in_threads
from rocking.engine.problem import build_settings, compute_peaks, find_common_step, prepare_ground, set_start
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import MotionError, UnfinishedError
from rocking.kernels import lanes, state
from rocking.kernels.ground import Ground, max_absolute_weight
from rocking.kernels.lane_steps import WIDTH
from rocking.kernels.march import march
from rocking.kernels.state import Record, Records
from rocking.kernels.uplift import write_completeness
from rocking.motion.motion import Motion

#: Fields of an outcome. ``unfinished``: the step budget was exceeded. ``stopped``: the duration ended while the body
#: moved or the motion continued. In both cases all other fields are incomplete. ``leans``: restraints hold the body in
#: a leaning position for ever. ``lost_contact``: the ground no longer presses on it, where the simulation ends.
#: ``largest_slip``, ``residual_slip``: displacement of the base relative to the ground, m.
#: ``residual_rotation``: final rotation, NaN if unknown. ``complete_chattering``: the body
#: rested after its first uplift before the motion exceeded a threshold again. ``rests_by_rounding``: number of rests
#: because time no longer advanced. Times of events that did not occur are 0.
OUTCOME = np.dtype(
    [
        ("overturned", "?"), ("unfinished", "?"), ("stopped", "?"), ("leans", "?"), ("lost_contact", "?"),
        ("peak_rotation", "f8"), ("residual_rotation", "f8"), ("peak_time", "f8"),
        ("impacts", "i8"), ("uplifts", "i8"), ("rests", "i8"), ("time_at_rest", "f8"), ("first_uplift", "f8"),
        ("first_rest", "f8"), ("last_rest", "f8"), ("complete_chattering", "?"), ("rests_by_rounding", "i8"),
        ("duration", "f8"), ("largest_slip", "f8"), ("residual_slip", "f8"),
    ]
)  # fmt: skip

#: Step budget of a simulation, besides a few steps for every piece of its motion.
BUDGET: Final = 3_000_000
_BUDGET_PER_PIECE: Final = 4

#: Steps per call of a kernel, for one body and for each of many: milliseconds until an interrupt.
SLICE: Final = 50_000
_FIRST_SLICE: Final = 5_000

#: Number of bodies simulated together: the capacity of the fastest cache, or fewer for a long motion, so that one call
#: of a kernel takes at most half a second.
_GROUP_SIZE: Final = 16 * WIDTH
_GROUP_PIECES: Final = 20_000_000

#: Steps of all bodies in one task: enough to amortise the call, few enough to stop soon after an interrupt.
_TASK_STEPS: Final = 8_000_000


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
        factor: float | Floats = 1.0,
        *,
        record: bool = False,
        ground: Ground | None = None,
        name: str | None = None,
    ) -> Run:
        """Return the arguments of the kernels for the bodies under a scaled motion, after checking all arguments.

        An array of factors, one for each body, leaves the factor of the ground at 1.
        """
        bodies = self.bodies
        check_components(bodies, motion)
        settings = build_settings(bodies, self.model, self.chattering, self.duration, record=record)
        records = bodies.kernel_records(self.model, self.chattering.thresholds(bodies, motion, self.model, factor))
        if self.friction is not None:
            add_friction(records, bodies, self.model, self.friction)
        if ground is None:
            ground = prepare_ground(motion, bodies.gravity)
            if np.ndim(factor) == 0:
                ground = ground._replace(factor=float(factor))
        states = state.new_states(len(bodies), 0)
        set_start(states, records, bodies, *self.start, name)
        return Run(ground, records, settings, states)


class Run(NamedTuple):
    """Bodies under a motion, as kernels accept them: the ground, a record and a state per body, and the settings."""

    ground: Ground
    records: Records
    settings: Record
    states: Records


@dataclass(frozen=True, eq=False)
class Task:
    """Some of the bodies under multiples of one motion."""

    bodies: slice | Integers
    motion: Motion
    factor: float | Floats = 1.0  # of all bodies, or of each
    key: tuple[int | Integers, ...] = ()  # index of the outcomes for the caller


def simulate_tasks(setup: Setup, tasks: Iterable[Task]) -> Iterator[tuple[Task, NDArray[np.void]]]:
    """Simulate tasks, and yield their outcomes in order: structured arrays (`OUTCOME`), one row per body.

    Tasks are consumed as needed, slightly ahead of the results. The outcome of a body depends only on the body and its
    motion, bit for bit, not on its task. An interrupt cancels the remaining tasks.
    """
    cancelled = threading.Event()

    def run_task(task: Task) -> tuple[Task, NDArray[np.void]]:
        return task, simulate_task(setup, task, cancelled)

    yield from map_in_threads(run_task, tasks, cancelled=cancelled)


def split_bodies(count: int, motion: Motion) -> Iterator[slice]:
    """Divide ``count`` bodies into ranges of the size of a task."""
    size = _GROUP_SIZE * max(1, _TASK_STEPS // (_GROUP_SIZE * len(motion.coefficients)))
    yield from split_range(count, size)


def simulate_each(setup: Setup, motion: Motion, factors: Floats) -> Iterator[tuple[Task, NDArray[np.void]]]:
    """Yield outcomes of body k under the motion times factor k."""
    indices = np.arange(len(factors))
    tasks = (Task(indices[part], motion, factors[part]) for part in split_bodies(len(factors), motion))
    yield from simulate_tasks(setup, tasks)


def require_finished(unfinished: bool) -> None:
    """Raise an error if a required simulation was aborted."""
    if unfinished:
        raise UnfinishedError(
            f"a simulation was aborted after more than {BUDGET:,} steps, so its outcome is unknown; "
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
    ground, records, settings, states = replace(setup, bodies=bodies).prepare(task.motion, task.factor)
    factors = np.broadcast_to(np.asarray(task.factor, dtype=float), len(states)).copy()
    states["budget"] = _FIRST_SLICE + _BUDGET_PER_PIECE * len(ground.pieces)
    step = find_common_step(task.motion)
    for group, substeps in _group_bodies(ground, factors, records, task.motion, setup.model):
        if cancelled is not None and cancelled.is_set():
            break
        _march_together(ground, settings, (records, states, factors), group, step, substeps)
    _resume_marches(ground, settings, (records, states, factors), cancelled)
    outcomes = _collect_outcomes(states, task.motion.end)
    outcomes["peak_rotation"] = compute_peaks(states, records, bodies.stops)
    is_known = ~(outcomes["overturned"] | outcomes["unfinished"] | outcomes["stopped"] | outcomes["lost_contact"])
    side = states["side"]
    stop = np.where((side == 1) | (side == -2), bodies.stops[:, 1], bodies.stops[:, 0])
    outcomes["residual_rotation"] = np.where(is_known, stop + (1.0 - 2.0 * side) * states["leaning_rotation"], np.nan)
    outcomes["largest_slip"] = bodies.gravity * states["largest_slip"]
    outcomes["residual_slip"] = np.where(outcomes["unfinished"], np.nan, bodies.gravity * states["slip"])
    outcomes["complete_chattering"] = detect_complete_chattering(ground, factors, records, states)
    return outcomes


def _group_bodies(
    ground: Ground, factors: Floats, records: Records, motion: Motion, model: Model
) -> Iterator[tuple[Integers, int]]:
    """Yield bodies that are simulated together, with their number of substeps; -1 for bodies simulated alone."""
    substeps, step = np.full(len(records), -1), find_common_step(motion)
    if step is not None:
        width = step * np.sqrt(np.abs(records["stiffness"]).max(axis=1) * max_absolute_weight(ground, factors))
        substeps = np.where(
            width <= lanes.MAX_STEP, _count_substeps(width, model, motion.vertical is not None), -1.0
        ).astype(np.int64)
    substeps[records["restrained"] | records["two_stops"]] = -1
    if motion.vertical is not None:
        substeps[records["friction"]] = -1
    size = min(_GROUP_SIZE, max(1, _GROUP_PIECES // (len(ground.pieces) * WIDTH)) * WIDTH)
    for count in np.unique(substeps):
        indices = np.flatnonzero(substeps == count)
        for part in split_range(len(indices), size):
            yield indices[part], int(count)


def _count_substeps(width: Floats, model: Model, with_vertical: bool) -> Floats:
    """Compute the substeps per sample in lanes, for each sqrt(|lam W|) h; 0 if one formula covers the sample."""
    if model == "nonlinear":
        return np.ceil(width / lanes.MAX_SUBSTEP)
    return np.ceil(width / lanes.MAX_WEIGHTED_SUBSTEP) if with_vertical else np.zeros(len(width))


def _march_together(
    ground: Ground,
    settings: Record,
    arrays: tuple[Records, Records, Floats],
    indices: Integers,
    step: float | None,
    substeps: int,
) -> None:
    """Simulate some of the bodies in lanes, or one after the other if lanes do not support them."""
    records, states, factors = arrays
    pieces = len(ground.pieces) - 1
    n_substeps = max(substeps, 0) if settings["nonlinear"] else 0
    pool = lanes.build_pool(records[indices], states[indices], factors[indices], pieces, step or 1.0, n_substeps)
    if substeps < 0:
        lanes.march_blocks(ground, settings, state.new_scratch(), pool)
    else:
        lanes.run_lanes(ground, settings, state.new_scratch(), pool, substeps)
    states[indices] = pool.states


def _resume_marches(
    ground: Ground,
    settings: Record,
    arrays: tuple[Records, Records, Floats],
    cancelled: threading.Event | None,
) -> None:
    """Continue simulations that have used up their first slice of steps, up to their budget."""
    (records, states, factors), empty_table, scratch = arrays, state.new_table(0), state.new_scratch()
    for k in np.flatnonzero(np.isin(states["ending"], (state.Ending.RUNNING, state.Ending.PAUSED))):
        body_state = states[k]
        body_state["stop_piece"] = state.TO_THE_END
        for _ in range(count_slices(ground)):
            if cancelled is not None and cancelled.is_set():
                return
            body_state["budget"] = SLICE
            scaled = ground._replace(factor=float(factors[k]))
            body_state["ending"] = march(scaled, records[k], settings, empty_table, scratch, body_state)
            if int(body_state["ending"]) != state.Ending.PAUSED:
                break
        else:
            body_state["ending"] = state.Ending.UNFINISHED


def count_slices(ground: Ground) -> int:
    """Return the number of slices in the budget of a simulation."""
    return math.ceil((BUDGET + _BUDGET_PER_PIECE * len(ground.pieces)) / SLICE)


def detect_complete_chattering(ground: Ground, factors: Floats, records: Records, states: Records) -> Flags:
    """Whether chattering after the first uplift was complete, from the times of that uplift and the first rest."""
    complete = np.empty(len(states), dtype=bool)
    write_completeness(ground, factors, records, states, state.new_scratch(), complete)
    return complete


def _collect_outcomes(states: Records, motion_end: float) -> NDArray[np.void]:
    outcomes = np.empty(len(states), dtype=OUTCOME)
    outcomes["overturned"] = states["ending"] == state.Ending.OVERTURNED
    outcomes["unfinished"] = states["ending"] == state.Ending.UNFINISHED
    outcomes["leans"] = states["ending"] == state.Ending.LEANS
    outcomes["lost_contact"] = states["ending"] == state.Ending.LOST
    is_early = (states["side"] >= 0) | (states["direction"] != 0) | (states["end_time"] < motion_end)
    # A body that remains balanced also has no outcome.
    is_undecided = np.isin(states["ending"], (state.Ending.DONE, state.Ending.BALANCED))
    outcomes["stopped"] = is_undecided & is_early
    for name, field in (
        ("peak_rotation", "peak"), ("peak_time", "peak_time"), ("impacts", "impacts"), ("uplifts", "uplifts"),
        ("rests", "rests"), ("time_at_rest", "time_at_rest"), ("first_uplift", "first_uplift"),
        ("first_rest", "first_rest"), ("last_rest", "last_rest_time"), ("rests_by_rounding", "rests_by_rounding"),
        ("duration", "end_time"),
    ):  # fmt: skip
        outcomes[name] = states[field]
    return outcomes
