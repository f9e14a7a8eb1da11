"""The one engine for many simulations: any tasks of bodies under a scaled motion, in threads."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.block.body import Bodies
from rocking.block.single import ROTATION
from rocking.core.arrays import Flags, Floats, Integers, ranges
from rocking.core.constants import Model
from rocking.core.tables import counted
from rocking.core.threads import in_threads
from rocking.engine.problem import ground_of, highest, set_start, settings_of, step_of
from rocking.engine.treatment import Treatment
from rocking.errors import InvalidMotion, Unfinished
from rocking.kernels import lanes, state
from rocking.kernels.ground import Ground, greatest_weight
from rocking.kernels.lane_steps import WIDTH
from rocking.kernels.march import march
from rocking.kernels.state import Record, Records
from rocking.kernels.uplift import note_complete
from rocking.motion.motion import Motion

#: What is kept of a simulation. ``unfinished``: it took more than its budget of steps; ``stopped``: the duration ended
#: it while the body moved or the motion went on. All else is then as far as it came. ``leans``: restraints hold it
#: leaning for ever. ``residual_rotation``: where it stays, NaN where that is not known. ``complete_chattering``: it
#: rested after its first uplift before the motion passed a threshold again. ``stalled`` counts the rests that were not
#: proven. Times of what never happened are 0.
OUTCOME = np.dtype(
    [
        ("overturned", "?"), ("unfinished", "?"), ("stopped", "?"), ("leans", "?"), ("peak_rotation", "f8"),
        ("residual_rotation", "f8"), ("peak_time", "f8"),
        ("impacts", "i8"), ("uplifts", "i8"), ("rests", "i8"), ("time_at_rest", "f8"), ("first_uplift", "f8"),
        ("first_rest", "f8"), ("last_rest", "f8"), ("complete_chattering", "?"), ("stalled", "i8"), ("duration", "f8"),
    ]
)  # fmt: skip

#: Steps that a simulation may take, besides a few for every piece of its motion.
BUDGET: Final = 3_000_000
_BUDGET_OF_A_PIECE: Final = 4

#: Steps of one call of a kernel, for one body and for each of many: some milliseconds until an interrupt is seen.
SLICE: Final = 50_000
_FIRST_SLICE: Final = 5_000

#: Bodies that go through a motion together: as many as the fastest cache holds, and fewer where the motion is so long
#: that one call of a kernel would take more than half a second for all of its pieces.
_TOGETHER: Final = 16 * WIDTH
_PIECES: Final = 20_000_000

#: Steps of all bodies of one task: enough to pay for the call, few enough to stop soon when interrupted.
_TASK: Final = 8_000_000


@dataclass(frozen=True)
class Setup:
    """What all simulations share: n bodies, and how to compute, as for `rocking.simulate`."""

    bodies: Bodies
    model: Model
    treatment: Treatment
    duration: float | None = None
    #: Coordinate of all bodies at time 0, and its rate; None is zero, or the stop where zero is behind it.
    start: tuple[float | None, float] = (None, 0.0)

    def run(
        self,
        motion: Motion | None,
        factor: float = 1.0,
        *,
        record: bool = False,
        ground: Ground | None = None,
        name: str | None = None,
    ) -> Run:
        """Return all that kernels need for the bodies under a motion times a factor; all arguments are checked."""
        bodies = self.bodies
        check_components(bodies, motion)
        settings = settings_of(bodies, self.model, self.treatment, self.duration, record=record)
        records = bodies.kernel_records(self.model, self.treatment.limits(bodies, motion, self.model, factor))
        if ground is None:
            ground = ground_of(motion, bodies.gravity, factor)
        states = state.new_states(len(bodies), 0)
        set_start(states, records, bodies, *self.start, name)
        return Run(ground, records, settings, states)


class Run(NamedTuple):
    """Bodies under a motion as kernels take them: the ground, a record and a state of each body, and the settings."""

    ground: Ground
    records: Records
    settings: Record
    states: Records


@dataclass(frozen=True, eq=False)
class Task:
    """Some of the bodies under one motion times a factor."""

    bodies: slice | Integers
    motion: Motion
    factor: float = 1.0
    key: tuple[int, ...] = ()  # where the outcomes belong, for the caller


def simulate_tasks(
    setup: Setup, tasks: Iterable[Task], *, threads: int | None = None
) -> Iterator[tuple[Task, NDArray[np.void]]]:
    """Outcomes of every task, in their order: structured arrays (`OUTCOME`), one row a body.

    Tasks are taken as they are needed, some ahead of the results. What becomes of a body depends on the body and its
    motion alone, bit for bit, whatever shares its task. An interrupt leaves the rest undone.
    """
    cancelled = threading.Event()

    def simulated(task: Task) -> tuple[Task, NDArray[np.void]]:
        return task, simulate_task(setup, task, cancelled)

    yield from in_threads(simulated, tasks, threads=threads, cancelled=cancelled)


def parts_of(count: int, motion: Motion) -> Iterator[slice]:
    """Ranges of ``count`` bodies, each as large as a task should be."""
    size = _TOGETHER * max(1, _TASK // (_TOGETHER * len(motion.coefficients)))
    yield from ranges(count, size)


def simulate_each(
    setup: Setup, motion: Motion, factors: Floats, *, threads: int | None = None
) -> Iterator[tuple[Task, NDArray[np.void]]]:
    """Outcomes for body k under the motion times factor k; those that share a factor are simulated together."""
    order = np.argsort(factors, kind="stable")
    starts = np.flatnonzero(np.diff(factors[order], prepend=np.nan) != 0.0)
    groups = np.split(order, starts[1:])
    tasks = (
        Task(group[part], motion, float(factors[group[0]])) for group in groups for part in parts_of(len(group), motion)
    )
    yield from simulate_tasks(setup, tasks, threads=threads)


def require_finished(unfinished: bool) -> None:
    """Check that a simulation without which there is no answer was not given up."""
    if unfinished:
        raise Unfinished(
            f"a simulation was given up after more than {BUDGET:,} steps, so that its outcome is not known; "
            "simulate it alone to see how far it came, or give a duration"
        )


def missing_text(missing: Flags | int) -> str:
    """Sentence on the simulations that were given up, whose outcomes are missing; empty where there are none."""
    count = int(np.sum(missing))
    return f"{counted(count, 'simulation')} given up after too many steps: outcomes missing" * (count > 0)


def check_components(bodies: Bodies, motion: Motion | None) -> None:
    """Check that a motion has no vertical component where bodies move along a line and not over the ground."""
    if motion is not None and motion.vertical is not None and bodies[0].coordinate.unit != ROTATION.unit:
        raise InvalidMotion(
            f"this {bodies[0].description} moves along one line; give a motion without a vertical component"
        )


def simulate_task(setup: Setup, task: Task, cancelled: threading.Event | None = None) -> NDArray[np.void]:
    """Outcomes of one task; where it is ``cancelled`` on the way, of no use."""
    bodies = setup.bodies.select(task.bodies)
    ground, records, settings, states = replace(setup, bodies=bodies).run(task.motion, task.factor)
    states["budget"] = _FIRST_SLICE + _BUDGET_OF_A_PIECE * len(ground.pieces)
    step = step_of(task.motion)
    for chosen, substeps in _groups(ground, records, task.motion, setup.model):
        if cancelled is not None and cancelled.is_set():
            break
        _march_together(ground, settings, (records, states), chosen, step, substeps)
    _march_on(ground, settings, records, states, cancelled)
    outcomes = _outcomes(states, task.motion.end)
    outcomes["peak_rotation"] = highest(states, records, bodies.stops)
    known, side = ~(outcomes["overturned"] | outcomes["unfinished"] | outcomes["stopped"]), states["side"]
    stop = np.where((side == 1) | (side == -2), bodies.stops[:, 1], bodies.stops[:, 0])
    outcomes["residual_rotation"] = np.where(known, stop + (1.0 - 2.0 * side) * states["leaning"], np.nan)
    outcomes["complete_chattering"] = complete_chattering(ground, records, states)
    return outcomes


def _groups(ground: Ground, records: Records, motion: Motion, model: Model) -> Iterator[tuple[Integers, int]]:
    """Bodies that go together, with the substeps that they need; -1 for those that march alone."""
    substeps, step = np.full(len(records), -1), step_of(motion)
    if step is not None:
        width = step * np.sqrt(np.abs(records["stiffness"]).max(axis=1) * greatest_weight(ground))
        substeps = np.where(
            width <= lanes.LONGEST_STEP, _substeps(width, model, motion.vertical is not None), -1.0
        ).astype(np.int64)
    substeps[records["restrained"] | records["two_stops"]] = -1
    size = min(_TOGETHER, max(1, _PIECES // (len(ground.pieces) * WIDTH)) * WIDTH)
    for count in np.unique(substeps):
        chosen = np.flatnonzero(substeps == count)
        for some in ranges(len(chosen), size):
            yield chosen[some], int(count)


def _substeps(width: Floats, model: Model, with_vertical: bool) -> Floats:
    """Count the substeps of a sample in lanes, for each sqrt(|lam W|) h; 0 where one formula spans it."""
    if model == "nonlinear":
        return np.ceil(width / lanes.LONGEST_SUBSTEP)
    return np.ceil(width / lanes.LONGEST_WEIGHTED_SUBSTEP) if with_vertical else np.zeros(len(width))


def _march_together(
    ground: Ground,
    settings: Record,
    whole: tuple[Records, Records],
    chosen: Integers,
    step: float | None,
    substeps: int,
) -> None:
    """Take some of the bodies through the motion in lanes, or one after the other where they cannot."""
    records, states = whole
    pieces = len(ground.pieces) - 1
    finer = max(substeps, 0) if settings["nonlinear"] else 0
    together = lanes.pool_of(records[chosen], states[chosen], pieces, step or 1.0, finer)
    if substeps < 0:
        lanes.march_each(ground, settings, state.new_scratch(), together)
    else:
        lanes.run_lanes(ground, settings, state.new_scratch(), together, substeps)
    states[chosen] = together.states


def _march_on(
    ground: Ground, settings: Record, records: Records, states: Records, cancelled: threading.Event | None
) -> None:
    """Take those on that have used up their first slice of steps, until their budget is spent."""
    nothing, scratch = state.new_table(0), state.new_scratch()
    for k in np.flatnonzero(np.isin(states["ending"], (state.Ending.RUNNING, state.Ending.PAUSED))):
        one = states[k]
        one["stop_piece"] = state.TO_THE_END
        for _ in range(slices(ground)):
            if cancelled is not None and cancelled.is_set():
                return
            one["budget"] = SLICE
            one["ending"] = march(ground, records[k], settings, nothing, scratch, one)
            if int(one["ending"]) != state.Ending.PAUSED:
                break
        else:
            one["ending"] = state.Ending.UNFINISHED


def slices(ground: Ground) -> int:
    """Count the slices in the budget of a simulation."""
    return math.ceil((BUDGET + _BUDGET_OF_A_PIECE * len(ground.pieces)) / SLICE)


def complete_chattering(ground: Ground, records: Records, states: Records) -> Flags:
    """Whether the chattering after the first uplift was complete, by the times of that uplift and the first rest."""
    complete = np.empty(len(states), dtype=bool)
    note_complete(ground, records, states, state.new_scratch(), complete)
    return complete


def _outcomes(states: Records, motion_end: float) -> NDArray[np.void]:
    outcomes = np.empty(len(states), dtype=OUTCOME)
    outcomes["overturned"] = states["ending"] == state.Ending.OVERTURNED
    outcomes["unfinished"] = states["ending"] == state.Ending.UNFINISHED
    outcomes["leans"] = states["ending"] == state.Ending.LEANS
    early = (states["side"] >= 0) | (states["end"] < motion_end)
    # A body that balances for ever has no verdict either.
    undecided = np.isin(states["ending"], (state.Ending.DONE, state.Ending.BALANCED))
    outcomes["stopped"] = undecided & early
    for name, field in (
        ("peak_rotation", "peak"), ("peak_time", "peak_time"), ("impacts", "impacts"), ("uplifts", "uplifts"),
        ("rests", "rests"), ("time_at_rest", "time_at_rest"), ("first_uplift", "first_uplift"),
        ("first_rest", "first_rest"), ("last_rest", "last_rest_time"), ("stalled", "rests_by_rounding"),
        ("duration", "end"),
    ):  # fmt: skip
        outcomes[name] = states[field]
    return outcomes
