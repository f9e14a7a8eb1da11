"""Simulations one by one: each block under its own scaling of one motion, where `simulate_many` does every product."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rocking.block import Blocks
from rocking.kernels import march, state, status
from rocking.kernels.state import Floats, Integers
from rocking.motion.motion import Motion
from rocking.problem import Model, rules_of, shaking_of, sides_of
from rocking.treatment import Certified

#: Blocks that one task takes through one motion: enough to pay for the call, few enough to stop soon.
_TASK: Final = 64


@dataclass(frozen=True)
class Ends:
    """What became of n simulations.

    Attributes
    ----------
    overturned : ndarray of bool
        Whether the rotation reached pi/2.
    peak : ndarray
        Largest rotation in size, rad.
    uplifts, impacts, rests : ndarray of int
        How many there were.
    last_rest : ndarray
        Time at which the block came to rest last, s; 0 where it never did.
    """

    overturned: NDArray[np.bool_]
    peak: Floats
    uplifts: Integers
    impacts: Integers
    rests: Integers
    last_rest: Floats


def simulate_pairs(
    blocks: Blocks,
    motion: Motion,
    factors: Floats,
    *,
    model: Model,
    chattering: Certified,
    done: Callable[[int], None] = lambda count: None,
) -> Ends:
    """Simulate block k under `motion` times factor k, on every core.

    Parameters
    ----------
    blocks : Blocks
        n blocks.
    motion : Motion
        What is scaled.
    factors : ndarray, shape (n,)
        Factor on the motion for each block.
    model : {"nonlinear", "linear"}
        Equation of motion.
    chattering : Certified
        Where only the verdict counts, a wide bracket on the time of rest is enough, and quicker; rest is proven anyway.
    done : callable
        Told how many simulations have just been finished.
    """
    rules = rules_of(blocks, model, chattering, None, record=False)
    shaking = shaking_of(motion, blocks.gravity)
    sides = sides_of(blocks, model, chattering.limits(blocks, motion))
    at, x = state.new_states(len(blocks))
    endings = np.empty(len(blocks), dtype=np.int64)

    def run(chosen: Integers) -> int:
        factor = factors[chosen[0]]
        scaled = shaking._replace(coefficients=shaking.coefficients * factor, error=shaking.error * abs(factor))
        tables, scratch = state.new_tables(1), state.new_scratch(shaking.coefficients.shape[1])
        at_here, x_here, ending = at[chosen], x[chosen], endings[chosen]
        march.march_each(scaled, sides[chosen], rules, tables, scratch, at_here, x_here, ending)
        at[chosen], x[chosen], endings[chosen] = at_here, x_here, ending
        return len(chosen)

    with ThreadPoolExecutor(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None) as pool:
        for count in pool.map(run, _tasks(factors)):
            done(count)
    return Ends(
        endings == status.FELL,
        x[:, state.PEAK],
        at[:, state.UPLIFTS],
        at[:, state.IMPACTS],
        at[:, state.SEQUENCES],
        x[:, state.RESTED],
    )


def _tasks(factors: Floats) -> list[Integers]:
    """List the simulations that share a factor, and so a scaled motion, a few at a time."""
    order = np.argsort(factors, kind="stable")
    starts = np.flatnonzero(np.diff(factors[order], prepend=np.nan) != 0.0)
    groups = np.split(order, starts[1:])
    return [group[k : k + _TASK] for group in groups for k in range(0, len(group), _TASK)]
