"""Blocks by motions: the full product of simulations, compiled, on every core."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Block, Blocks
from rocking.constants import VERSION
from rocking.engine import OUTCOME, Setup, Task, cores, parts_of, simulate_tasks
from rocking.errors import InvalidMotion, InvalidOption
from rocking.motion import measures
from rocking.motion.accepted import several_motions
from rocking.motion.motion import Motion
from rocking.problem import rules_of
from rocking.progress import Progress
from rocking.treatment import Treatment, treatment
from rocking.treatment.base import Model

if TYPE_CHECKING:
    import xarray as xr

Polarity = Literal["+", "-", "both"]

_SIGNS: dict[str, tuple[int, ...]] = {"+": (1,), "-": (-1,), "both": (1, -1)}

#: Variables of the result, from the fields of the engine's outcome: units, and what each one means.
VARIABLES: dict[str, tuple[str, str]] = {
    "overturned": ("1", "whether the rotation reached pi/2"),
    "peak_rotation": ("rad", "largest rotation in size"),
    "peak_time": ("s", "time of the peak rotation"),
    "impacts": ("1", "impacts that were resolved"),
    "uplifts": ("1", "uplifts from rest"),
    "rests": ("1", "times the block came to rest"),
    "time_at_rest": ("s", "time spent at rest"),
    "unfinished": ("1", "whether the simulation was given up after too many steps; the rest is as far as it came"),
}


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
        peak_time (s), impacts, uplifts, rests, time_at_rest (s), unfinished. Coordinates name the motions and hold the
        blocks' parameters.

    Raises
    ------
    InvalidOption
        If an argument is out of its range.

    Notes
    -----
    The same engine as `simulate`: every impact is located and chattering is proven. Under evenly sampled records the
    blocks that rock step together through each sample, and only those with an event in it are played one by one. What
    becomes of a block depends on the block and the motion alone, bit for bit, whatever is simulated beside it.

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
    many, shaken = Blocks.of(blocks), several_motions(motions)
    how = treatment(chattering)
    rules_of(many, model, how, duration, record=False)  # checked before anything is computed
    scales = _scales(factor=factor, pga=pga, pgv=pgv, sa=sa, period=period, damping=damping)
    if polarity not in _SIGNS:
        raise InvalidOption(f"polarity must be one of {', '.join(_SIGNS)}, not {polarity!r}")
    count = _threads(threads)
    shape = (len(shaken), scales.count, len(_SIGNS[polarity]), len(many))
    results = {name: np.empty(shape, dtype=OUTCOME[name]) for name in VARIABLES}
    setup = Setup(many, model, how, duration)
    with Progress("simulating", math.prod(shape), show=progress) as bar:
        for task, outcomes in simulate_tasks(setup, _tasks(shaken, scales, _SIGNS[polarity], len(many)), threads=count):
            for name, values in results.items():
                values[(*task.key, task.blocks)] = outcomes[name]
            bar.advance(len(outcomes))
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

    def factors(self, motion: Motion) -> Floats:
        """Factors that bring a motion to the values of the measure."""
        if self.measure is None or self.measure == "factor":
            return self.values
        now = measures.target(motion, self.measure, self.options.get("period"), self.options.get("damping", 0.0))
        if now == 0.0:
            raise InvalidMotion(f"{motion.name} is zero throughout and cannot be scaled to a {self.measure}")
        return self.values / now


def _scales(*, period: float | None, damping: float, **measures: ArrayLike | None) -> _Scales:
    given = {name: values for name, values in measures.items() if values is not None}
    if len(given) > 1:
        raise InvalidOption(f"motions can be scaled to one measure only, not to {' and '.join(given)}")
    if "sa" not in given and period is not None:
        raise InvalidOption("period= belongs to sa=; give sa= as well, or neither")
    if not given:
        return _Scales(None, np.ones(1), {})
    ((name, target),) = given.items()
    values = checks.positive_numbers(target, name, InvalidOption)
    if name != "sa":
        return _Scales(name, values, {})
    if period is None:
        raise InvalidOption("sa= needs period=, in s")
    return _Scales(name, values, {"period": period, "damping": damping})


def _threads(threads: int | None) -> int:
    return cores() if threads is None else checks.whole(threads, "threads", InvalidOption, least=1)


def _tasks(motions: Sequence[Motion], scales: _Scales, signs: tuple[int, ...], count: int) -> Iterator[Task]:
    for m, motion in enumerate(motions):
        for s, factor in enumerate(scales.factors(motion).tolist()):
            for k, sign in enumerate(signs):
                for part in parts_of(count, motion):
                    yield Task(part, motion, sign * factor, (m, s, k))


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
        name: (kept, results[name].squeeze(axis=tuple(dropped)), {"units": units, "long_name": meaning})
        for name, (units, meaning) in VARIABLES.items()
    }
    coordinates: dict[str, Any] = {"motion": ("motion", _names(motions))}
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


def _names(motions: Sequence[Motion]) -> list[str]:
    """Names of motions, numbered where several share one: a row of a table must say which it is."""
    shared = {name for name, count in Counter(motion.name for motion in motions).items() if count > 1}
    seen: Counter[str] = Counter()
    names = []
    for motion in motions:
        seen[motion.name] += 1
        names.append(f"{motion.name} #{seen[motion.name]}" if motion.name in shared else motion.name)
    return names


def _block_coordinates(blocks: Blocks) -> dict[str, Any]:
    columns = {"p": (blocks.p, "rad/s"), "alpha": (blocks.alpha, "rad"), "restitution": (blocks.restitution, "1")}
    if blocks.is_symmetric:
        return {name: ("block", values[:, 0], {"units": units}) for name, (values, units) in columns.items()}
    return {
        f"{name}_{side}": ("block", values[:, k], {"units": units})
        for name, (values, units) in columns.items()
        for k, side in enumerate(("plus", "minus"))
    }
