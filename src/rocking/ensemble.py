"""Blocks by motions: the full product of simulations, compiled, on every core."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.block import Block, Blocks
from rocking.constants import VERSION
from rocking.errors import InvalidOption
from rocking.kernels import lanes, march, state, status
from rocking.kernels.state import Floats
from rocking.motion.motion import Motion
from rocking.problem import Model, rules_of, shaking_of, sides_of
from rocking.progress import Progress
from rocking.treatment import Treatment, treatment

if TYPE_CHECKING:
    import xarray as xr

Polarity = Literal["+", "-", "both"]

_SIGNS: dict[str, tuple[int, ...]] = {"+": (1,), "-": (-1,), "both": (1, -1)}

#: Block-steps of one task: enough to pay for the call, few enough to stop soon when interrupted.
_TASK = 2_000_000


@dataclass(frozen=True)
class Outcome:
    """One variable of the result."""

    name: str
    dtype: str
    units: str
    meaning: str
    of: Callable[[state.Integers, Floats, state.Integers], NDArray[Any]]


#: What is kept of each simulation, from the last state (at, x) and the ending of its march.
OUTCOMES = (
    Outcome("overturned", "?", "1", "whether the rotation reached pi/2", lambda at, x, end: end == status.FELL),
    Outcome("peak_rotation", "f8", "rad", "largest rotation in size", lambda at, x, end: x[:, state.PEAK]),
    Outcome("peak_time", "f8", "s", "time of the peak rotation", lambda at, x, end: x[:, state.PEAK_TIME]),
    Outcome("impacts", "i8", "1", "impacts that were resolved", lambda at, x, end: at[:, state.IMPACTS]),
    Outcome("uplifts", "i8", "1", "uplifts from rest", lambda at, x, end: at[:, state.UPLIFTS]),
    Outcome("rests", "i8", "1", "times the block came to rest", lambda at, x, end: at[:, state.SEQUENCES]),
    Outcome("time_at_rest", "f8", "s", "time spent at rest", lambda at, x, end: x[:, state.RESTING]),
)


def simulate_many(
    blocks: Blocks | Block | Sequence[Block],
    motions: Motion | Sequence[Motion],
    *,
    model: Model = "nonlinear",
    chattering: str | Treatment = "certified",
    factor: ArrayLike | None = None,
    pga: ArrayLike | None = None,
    pgv: ArrayLike | None = None,
    sa: ArrayLike | None = None,
    period: float | None = None,
    damping: float = 0.05,
    polarity: Polarity = "+",
    duration: float | None = None,
    threads: int | None = None,
    progress: bool | None = None,
) -> xr.Dataset:
    """Simulate every block under every motion, and keep the outcome of each simulation.

    Parameters
    ----------
    blocks : Blocks, Block or sequence of Block
        n blocks.
    motions : Motion or sequence of Motion
        m motions.
    model, chattering, duration
        As for `simulate`.
    factor, pga, pgv, sa : array_like, optional
        At most one: simulate every motion scaled by these factors, or to these peak accelerations (m/s^2), peak
        velocities (m/s) or spectral accelerations (m/s^2, at `period` and `damping`). Adds the dimension ``scale``.
    period : float, optional
        Period for `sa`, s.
    damping : float
        Fraction of critical damping for `sa`.
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
        peak_time (s), impacts, uplifts, rests, time_at_rest (s). Coordinates name the motions and hold the blocks'
        parameters.

    Raises
    ------
    InvalidOption
        If an argument is out of its range.

    Notes
    -----
    The same engine as `simulate`: every impact is located and chattering is proven. Under evenly sampled records 64
    blocks step together through each sample, and only those with an event in it leave for the scalar loop.

    Examples
    --------
    >>> import rocking
    >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
    >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
    >>> result = rocking.simulate_many(blocks, motion, factor=[0.4, 1.0])
    >>> dict(result.sizes)
    {'motion': 1, 'scale': 2, 'block': 4}
    >>> result.overturned.sel(scale=0.4).values.tolist()
    [[True, False, True, False]]
    """
    many = _blocks(blocks)
    shaken = [motions] if isinstance(motions, Motion) else list(motions)
    if not shaken:
        raise InvalidOption("motions must hold at least one motion")
    how = treatment(chattering)
    rules = rules_of(many, model, how, duration, record=False)
    scales = _scales(factor=factor, pga=pga, pgv=pgv, sa=sa, period=period, damping=damping)
    if polarity not in _SIGNS:
        raise InvalidOption(f"polarity must be one of {', '.join(_SIGNS)}, not {polarity!r}")
    count = _threads(threads)
    shape = (len(shaken), scales.count, len(_SIGNS[polarity]), len(many))
    results = {outcome.name: np.empty(shape, dtype=outcome.dtype) for outcome in OUTCOMES}

    def run(cell: tuple[int, int, int], motion: Motion, part: slice) -> int:
        chosen = many.select(part)
        sides = sides_of(chosen, model, how.limits(chosen, motion))
        ended = _march(motion, many.gravity, sides, rules)
        for outcome in OUTCOMES:
            results[outcome.name][(*cell, part)] = outcome.of(*ended)
        return len(chosen)

    tasks = _tasks(shaken, scales, _SIGNS[polarity], len(many))
    with Progress("simulating", math.prod(shape), show=progress) as bar:
        for finished in _parallel(run, tasks, count):
            bar.advance(finished)
    return _dataset(results, many, shaken, scales, polarity, model, how)


@dataclass(frozen=True)
class _Scales:
    """How motions are scaled: a measure and its values; without one, not at all."""

    measure: str | None
    values: Floats
    options: dict[str, float]

    @property
    def count(self) -> int:
        return len(self.values)

    def applied(self, motion: Motion, value: float) -> Motion:
        if self.measure is None:
            return motion
        return motion.scaled(**{self.measure: value}, **self.options)


def _scales(*, period: float | None, damping: float, **measures: ArrayLike | None) -> _Scales:
    given = {name: values for name, values in measures.items() if values is not None}
    if len(given) > 1:
        raise InvalidOption(f"motions can be scaled to one measure only, not to {' and '.join(given)}")
    if "sa" not in given and period is not None:
        raise InvalidOption("period= belongs to sa=; give sa= as well, or neither")
    if not given:
        return _Scales(None, np.ones(1), {})
    ((name, target),) = given.items()
    try:
        values = np.atleast_1d(np.asarray(target, dtype=np.float64))
    except (TypeError, ValueError):
        raise InvalidOption(f"{name} must be a number or a sequence of numbers, not {target!r}") from None
    if values.ndim != 1 or values.size == 0 or not np.all(np.isfinite(values) & (values > 0.0)):
        raise InvalidOption(f"{name} must be a positive number or a sequence of positive numbers")
    if name != "sa":
        return _Scales(name, values, {})
    if period is None:
        raise InvalidOption("sa= needs period=, in s")
    return _Scales(name, values, {"period": period, "damping": damping})


def _blocks(blocks: Blocks | Block | Sequence[Block]) -> Blocks:
    if isinstance(blocks, Blocks):
        return blocks
    return Blocks.of([blocks] if isinstance(blocks, Block) else blocks)


def _threads(threads: int | None) -> int:
    if threads is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not (isinstance(threads, int) and threads >= 1):
        raise InvalidOption(f"threads must be a whole number of at least 1, not {threads!r}")
    return threads


def _tasks(
    motions: Sequence[Motion], scales: _Scales, signs: tuple[int, ...], count: int
) -> Iterator[tuple[tuple[int, int, int], Motion, slice]]:
    for m, motion in enumerate(motions):
        blocks_at_once = lanes.WIDTH * max(1, _TASK // (lanes.WIDTH * len(motion.coefficients)))
        for s, value in enumerate(scales.values):
            scaled = scales.applied(motion, float(value))
            for k, sign in enumerate(signs):
                signed = scaled if sign > 0 else -scaled
                for start in range(0, count, blocks_at_once):
                    yield (m, s, k), signed, slice(start, min(start + blocks_at_once, count))


def _parallel(
    run: Callable[[tuple[int, int, int], Motion, slice], int],
    tasks: Iterator[tuple[tuple[int, int, int], Motion, slice]],
    threads: int,
) -> Iterator[int]:
    """Run tasks on threads, a few ahead of the results; an interrupt leaves the rest undone.

    Kernels release Python's lock, so plain threads use every core, whoever calls and however often.
    """
    with ThreadPoolExecutor(threads) as pool:
        pending: set[Future[int]] = set()
        try:
            for task in tasks:
                pending.add(pool.submit(run, *task))
                if len(pending) >= 2 * threads:
                    done, pending = wait(pending, return_when=FIRST_COMPLETED)
                    yield from (future.result() for future in done)
            for future in pending:
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _march(
    motion: Motion, gravity: float, sides: Floats, rules: state.Rules
) -> tuple[state.Integers, Floats, state.Integers]:
    """Last state and ending of every block under one motion."""
    shaking = shaking_of(motion, gravity)
    at, x = state.new_states(len(sides))
    endings = np.empty(len(sides), dtype=np.int64)
    tables, scratch = state.new_tables(1), state.new_scratch(shaking.coefficients.shape[1])
    if motion.step is None:
        march.march_each(shaking, sides, rules, tables, scratch, at, x, endings)
        return at, x, endings
    room = lanes.new_room()
    for start in range(0, len(sides), lanes.WIDTH):
        part = slice(start, start + lanes.WIDTH)
        lanes.run_lanes(shaking, sides[part], rules, tables, scratch, room, at[part], x[part], endings[part])
    return at, x, endings


def _dataset(
    results: dict[str, NDArray[Any]],
    blocks: Blocks,
    motions: Sequence[Motion],
    scales: _Scales,
    polarity: Polarity,
    model: Model,
    how: Treatment,
) -> xr.Dataset:
    import xarray as xr

    dimensions = ("motion", "scale", "polarity", "block")
    dropped = [k for k, gone in ((1, scales.measure is None), (2, polarity != "both")) if gone]
    kept = tuple(name for k, name in enumerate(dimensions) if k not in dropped)
    variables = {
        outcome.name: (
            kept,
            results[outcome.name].squeeze(axis=tuple(dropped)),
            {"units": outcome.units, "long_name": outcome.meaning},
        )
        for outcome in OUTCOMES
    }
    coordinates: dict[str, Any] = {"motion": ("motion", [motion.name for motion in motions])}
    if scales.measure is not None:
        units = {"factor": "1", "pgv": "m/s"}.get(scales.measure, "m/s^2")
        coordinates["scale"] = ("scale", scales.values, {"measure": scales.measure, "units": units, **scales.options})
    if polarity == "both":
        coordinates["polarity"] = ("polarity", ["+", "-"])
    coordinates |= _block_coordinates(blocks)
    attributes = {
        "program": f"rocking {VERSION}",
        "model": model,
        "chattering": repr(how),
        "polarity": polarity,
        "gravity": blocks.gravity,
        "motions": [f"{motion.name}: {motion.description.text}" for motion in motions],
        "histories": ["; ".join(motion.history) for motion in motions],
    }
    return xr.Dataset(variables, coordinates, attributes)


def _block_coordinates(blocks: Blocks) -> dict[str, Any]:
    columns = {"p": (blocks.p, "rad/s"), "alpha": (blocks.alpha, "rad"), "restitution": (blocks.restitution, "1")}
    if blocks.is_symmetric:
        return {name: ("block", values[:, 0], {"units": units}) for name, (values, units) in columns.items()}
    return {
        f"{name}_{side}": ("block", values[:, k], {"units": units})
        for name, (values, units) in columns.items()
        for k, side in enumerate(("plus", "minus"))
    }
