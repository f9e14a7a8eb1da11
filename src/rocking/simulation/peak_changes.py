"""How the peaks of many simulations change with the motion, the body and the start, each as `Response.sensitivity`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.progress import Progress
from rocking.core.threads import in_threads
from rocking.engine.problem import highest
from rocking.engine.tasks import Setup, Task
from rocking.kernels import state
from rocking.kernels.trace import NO_NODES, Quantity, Trail, vary
from rocking.simulation.simulate import marched

#: What peaks are differentiated by, and its name in words, by the name of the derivative in a dataset.
By = Mapping[str, tuple[Quantity, str]]

OF_BLOCKS: Final[By] = {
    "peak_by_motion": (Quantity.MOTION, "the motion"),
    "peak_by_p": (Quantity.FREQUENCY, "p of both sides"),
    "peak_by_alpha": (Quantity.SLENDERNESS, "the slenderness of both sides"),
    "peak_by_restitution": (Quantity.RESTITUTION, "the restitution of both sides"),
}

#: Bodies whose changes are found together, in one thread.
_TOGETHER: Final = 64


def peak_changes(
    setup: Setup,
    done: Sequence[tuple[Task, Flags]],
    shape: tuple[int, ...],
    by: By,
    *,
    threads: int | None,
    progress: bool | None,
) -> dict[str, NDArray[np.generic]]:
    """Find the changes of peaks per relative change of each quantity, for tasks and which bodies overturned in each."""
    portions = [
        (task, slice(first, first + _TOGETHER), overturned[first : first + _TOGETHER])
        for task, overturned in done
        for first in range(0, len(overturned), _TOGETHER)
    ]
    quantities = [quantity for quantity, _ in by.values()]
    changes: dict[str, NDArray[np.generic]] = {name: np.full(shape, math.nan) for name in by}

    def found(portion: tuple[Task, slice, Flags]) -> tuple[tuple[int | Integers, ...], Floats]:
        task, part, overturned = portion
        bodies = np.arange(shape[-1])[task.bodies][part]
        return (*task.key, bodies), _changes(setup, replace(task, bodies=bodies), overturned, quantities)

    with Progress("differentiating", math.prod(shape), show=progress) as bar:
        for place, values in in_threads(found, portions, threads=threads):
            for name, column in zip(by, values.T, strict=True):
                changes[name][place] = column
            bar.advance(len(values))
    return changes


def _changes(setup: Setup, task: Task, overturned: Flags, quantities: Sequence[Quantity]) -> Floats:
    """Find the changes of the peaks of a task's bodies by each quantity, shape (bodies, quantities)."""
    bodies = setup.bodies.select(task.bodies)
    ground, records, settings, states = replace(setup, bodies=bodies).run(task.motion, task.factor, record=True)
    scratch, work = state.new_scratch(), state.record(state.VARIATION)
    changes = np.full((len(bodies), len(quantities)), math.nan)
    for k in np.flatnonzero(~overturned):
        start, trail = states[k], Trail(ground, records[k], settings, NO_NODES)
        ending, table = marched(trail, start)
        known = ending in (state.Ending.DONE, state.Ending.LEANS) and start["rounding_decisions"] == 0
        if not known or (records["two_stops"][k] and highest(start, records[k], bodies.stops[k]) == bodies.stops[k, 1]):
            continue
        trail = trail._replace(nodes=state.attributed(np.array(table["node"][: start["nodes"]])))
        at, impacts, events = np.array([start["peak_time"]]), np.empty(start["impacts"]), np.empty(start["events"])
        at.flags.writeable = False
        for j, quantity in enumerate(quantities):
            vary(trail, scratch, work, quantity, at, changes[k, j : j + 1], impacts, events)
    return changes
