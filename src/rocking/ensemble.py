"""Blocks by motions: the full product of simulations, compiled, on every core."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.block import Block
from rocking.body import Bodies, Body
from rocking.constants import Model
from rocking.engine import OUTCOME, cores, simulate_tasks
from rocking.errors import InvalidOption
from rocking.motion.named import Motions, several_motions
from rocking.motion.scaling import Measure, MeasureName
from rocking.problem import bodies_of
from rocking.product import VARIABLES, Polarity, Product, Scales
from rocking.progress import Progress
from rocking.treatment import Treatment, treatment

if TYPE_CHECKING:
    import xarray as xr


def simulate_many(
    blocks: Bodies | Body | Sequence[Block],
    motions: Motions,
    *,
    model: Model = "nonlinear",
    chattering: str | Treatment = "certified",
    levels: ArrayLike | None = None,
    measure: MeasureName | Measure = "factor",
    polarity: Polarity = "+",
    duration: float | None = None,
    threads: int | None = None,
    progress: bool | None = None,
) -> xr.Dataset:
    """Simulate every block under every motion, and keep the outcome of each simulation.

    Parameters
    ----------
    blocks : Blocks, Block or sequence of Block
        n blocks, or bodies of another kind (`rocking.body.Bodies`).
    motions : Motion, sequence of Motion, or mapping of str to Motion
        m motions; a mapping gives them its names.
    model, chattering, duration
        As for `simulate`.
    levels : array_like, optional
        Simulate every motion scaled to each of these levels of `measure`. Adds the dimension ``scale``.
    measure : {"factor", "pga", "pgv"} or Measure
        What levels are: factors on the motions, peak accelerations (m/s^2), peak velocities (m/s), or spectral
        accelerations (m/s^2) as ``rocking.Measure("sa", period=1.0)``.
    polarity : {"+", "-", "both"}
        Motions as they are, reversed, or both (adds the dimension ``polarity``).
    threads : int, optional
        Number of threads; by default one for every core.
    progress : bool, optional
        Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

    Returns
    -------
    xarray.Dataset
        Dimensions (motion, scale, polarity, block), those that apply. Variables: overturned, peak_rotation (rad),
        peak_time (s), impacts, uplifts, rests, time_at_rest (s), complete_chattering (whether the block came to rest
        after its first uplift before the motion passed a threshold again), stalled (rests that were not proven),
        unfinished, stopped (by `duration`, so that overturned is open). Coordinates name the motions and hold the
        blocks' parameters.

    Raises
    ------
    InvalidOption
        If an argument is out of its range.

    Notes
    -----
    The same engine as `simulate`: every impact is located and chattering is proven. Under evenly sampled records the
    blocks that rock step together through each sample, and only those with an event in it are marched one by one. What
    becomes of a block depends on the block and the motion alone, bit for bit, whatever is simulated beside it.

    Examples
    --------
    >>> import rocking
    >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
    >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
    >>> result = rocking.simulate_many(blocks, motion, levels=[0.4, 1.0])
    >>> dict(result.sizes)
    {'motion': 1, 'scale': 2, 'block': 4}
    >>> result.overturned.sel(scale=0.4).values.tolist()
    [[True, False, True, False]]
    """
    product = Product(
        bodies_of(blocks),
        tuple(several_motions(motions)),
        Scales.of(levels, measure),
        polarity,
        model,
        treatment(chattering),
        duration,
    )
    count = cores() if threads is None else checks.whole(threads, "threads", InvalidOption, least=1)
    results = {name: np.empty(product.shape, dtype=OUTCOME[name]) for name in VARIABLES}
    with Progress("simulating", math.prod(product.shape), show=progress) as bar:
        for task, outcomes in simulate_tasks(product.setup(), product.tasks(), threads=count):
            for name, values in results.items():
                values[(*task.key, task.bodies)] = outcomes[name]
            bar.advance(len(outcomes))
    return product.dataset(results)
