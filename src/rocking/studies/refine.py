"""Refinement of a study: scales between neighbours of which one overturns a block, halved in rounds to a tolerance.

Round r lists brackets, a motion, polarity and block each with two scales of different verdicts, and simulates the
middle of every one that is wider than the tolerance. Its list follows from the round before, the first one from the
study's grid, so that whoever computes it, and however often it is killed, makes the same bytes. A round without middles
is the last.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.arrays import Flags, Floats, Integers
from rocking.errors import InvalidOption, StudyError
from rocking.product import Product, block_coordinates
from rocking.studies import inputs
from rocking.studies.store import Store, readable, sealed, unsealed
from rocking.studies.units import OUTCOMES, Key, Line, PointsWork, name_of

if TYPE_CHECKING:
    import xarray as xr

_PLAN: Final = "refine.json"

#: Units of a round, where it has points enough, and points of a unit at least.
_UNITS: Final = 32
_LEAST: Final = 64

#: Verdicts; what is not known, because a simulation was given up or stopped, is none.
_STANDS: Final = 0
_OVERTURNS: Final = 1
_UNKNOWN: Final = -1


@dataclass(frozen=True)
class Brackets:
    """Changes of the verdict, each between two scales; in order of motion, polarity, block and scale.

    Attributes
    ----------
    motion, polarity, block : ndarray of int
        Whose.
    low, high : ndarray
        Scales that bracket the change.
    overturns : ndarray of bool
        Whether the higher one overturns the block, and the lower one does not; else the other way round.
    known : ndarray of bool
        Whether the verdicts of all middles so far are known.
    """

    motion: Integers
    polarity: Integers
    block: Integers
    low: Floats
    high: Floats
    overturns: Flags
    known: Flags

    @property
    def middle(self) -> Floats:
        """Scales halfway."""
        return 0.5 * (self.low + self.high)

    def wide(self, tolerance: float) -> Integers:
        """Which ones to halve, in the order in which they are simulated: those of one scaled motion together."""
        middle = self.middle
        splits = (middle > self.low) & (middle < self.high)
        chosen = np.flatnonzero(self.known & splits & (self.high - self.low > tolerance * self.high))
        keys = self.block, middle, self.polarity, self.motion
        return chosen[np.lexsort([key[chosen] for key in keys])]

    def halved(self, chosen: Integers, verdicts: Integers) -> Brackets:
        """Brackets after these verdicts on the middles of the chosen ones."""
        low, high, known, middle = self.low.copy(), self.high.copy(), self.known.copy(), self.middle
        as_above = verdicts == np.where(self.overturns[chosen], _OVERTURNS, _STANDS)
        unknown = verdicts == _UNKNOWN
        high[chosen[as_above]] = middle[chosen[as_above]]
        low[chosen[~as_above & ~unknown]] = middle[chosen[~as_above & ~unknown]]
        known[chosen[unknown]] = False
        return dataclasses.replace(self, low=low, high=high, known=known)

    def to_bytes(self) -> bytes:
        """Return an archive whose bytes depend on the brackets alone."""
        return inputs.archive(vars(self))

    @classmethod
    def from_bytes(cls, data: bytes) -> Brackets:
        """Read such an archive."""
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return cls(**arrays)


class Round:
    """One round of a refinement, as a store of units: ranges of the middles of its brackets.

    Parameters
    ----------
    store : Store
        The study's grid.
    number : int
        From 1 on.
    brackets : Brackets
        What is known before it.
    tolerance : float
        Width over scale that is narrow enough.
    """

    def __init__(self, store: Store, number: int, brackets: Brackets, tolerance: float) -> None:
        self.store, self.number, self.brackets = store, number, brackets
        self.chosen = brackets.wide(tolerance)
        count = len(self.chosen)
        most = math.prod(store.grid.unit)
        self.grid = Line(count, min(most, max(_LEAST, math.ceil(count / _UNITS))))
        self._now = functools.cache(lambda motion: store.product.scales.now(store.product.motions[motion]))

    def create(self) -> None:
        """Write the round without its units; what describes it last."""
        place, archive = self.store.place, self.brackets.to_bytes()
        place.put(f"{self.name}/brackets.npz", archive)
        if len(self.chosen):
            place.put(f"{self.name}/zarr.json", self.grid.metadata().encode())
        about = {"round": self.number, "brackets": hashlib.sha256(archive).hexdigest(), "points": len(self.chosen)}
        place.put(f"{self.name}/round.json", sealed(about))

    @property
    def name(self) -> str:
        """Name of its array."""
        return f"round.{self.number}"

    @property
    def is_last(self) -> bool:
        """Whether nothing is left to halve."""
        return not len(self.chosen)

    def done(self) -> set[Key]:
        """Keys of the units that are done."""
        there = set(self.store.place.names(self.name))
        return {key for key in self.grid if name_of(key) in there}

    def missing(self) -> Iterator[Key]:
        """Keys of the units that are not done, in order."""
        done = self.done()
        return (key for key in self.grid if key not in done)

    def work(self, key: Key) -> PointsWork:
        """Return all that a worker needs for a unit."""
        product = self.store.product
        chosen = self.chosen[self.grid.range(key)]
        motions, which = np.unique(self.brackets.motion[chosen], return_inverse=True)
        signs = np.array(product.signs)[self.brackets.polarity[chosen]]
        setup = dataclasses.replace(product.setup(), blocks=product.blocks.select(self.brackets.block[chosen]))
        now = np.array([self._now(int(motion)) for motion in motions])
        return PointsWork(
            setup=setup,
            motions=tuple(product.motions[motion] for motion in motions),
            which=which,
            factors=signs * (self.brackets.middle[chosen] / now[which]),  # to the last bit as of `Scales.factors`
            unit=self.grid.unit,
        )

    def label(self, key: Key) -> str:
        """Name a unit among those of all rounds."""
        return f"{self.name}/{name_of(key)}"

    def put(self, key: Key, data: bytes) -> None:
        """Store a unit."""
        self.store.place.put(self.label(key), data)

    def raw(self, key: Key) -> bytes | None:
        """Bytes of a unit; None where it is not done."""
        return self.store.place.get(self.label(key))

    def outcomes(self, key: Key) -> Floats | None:
        """Outcomes of a unit, shape (outcomes, points); None where it is not done.

        Raises
        ------
        StudyError
            If it is damaged; the message names it.
        """
        data = self.raw(key)
        return None if data is None else readable(data, (self.grid.simulations(key),), self.grid.unit, self.label(key))

    def after(self) -> Brackets:
        """Brackets after this round, whose units are done.

        Raises
        ------
        StudyError
            If one is damaged or gone.
        """
        verdicts = np.empty(len(self.chosen), dtype=np.int64)
        for key in self.grid:
            outcomes = self.outcomes(key)
            if outcomes is None:
                raise StudyError(f"{self.store.place}: unit {self.label(key)} is gone: run the study again")
            verdicts[self.grid.range(key)] = _verdicts(outcomes)
        return self.brackets.halved(self.chosen, verdicts)


@dataclass(frozen=True)
class Refinement:
    """How far a refinement has come.

    Attributes
    ----------
    tolerance : float
        Width over scale to which it goes.
    rounds : int
        Rounds that have begun.
    done, simulations : int
        Simulations of the last of them that are done, of how many.
    complete : bool
        Whether nothing is left to halve.
    """

    tolerance: float
    rounds: int
    done: int
    simulations: int
    complete: bool

    def __str__(self) -> str:
        """Write it in a few words."""
        if self.complete:
            return f"refined to {self.tolerance:g} in {self.rounds - 1} rounds"
        if not self.rounds:
            return f"to be refined to {self.tolerance:g}"
        return f"refined to {self.tolerance:g}, round {self.rounds}: {self.done} of {self.simulations} simulations done"


def refinement(store: Store) -> Refinement | None:
    """Return how far the refinement of a study has come; None where it has none."""
    tolerance = kept_plan(store)
    if tolerance is None:
        return None
    begun = [*rounds(store, tolerance)]
    if not begun:
        return Refinement(tolerance, 0, 0, 0, complete=False)
    last = begun[-1]
    done = sum(map(last.grid.simulations, last.done()))
    return Refinement(tolerance, len(begun), done, last.grid.total, last.is_last)


def tolerance_of(product: Product, refine: float) -> float:
    """Return a tolerance, checked.

    Raises
    ------
    InvalidOption
        If it is out of its range, or there are no scales to refine between.
    """
    width = checks.within(refine, "refine", InvalidOption, 1e-12, 0.5)
    _require_order(product)
    return width


def keep_plan(store: Store, tolerance: float) -> None:
    """Store to which tolerance a study is refined.

    Raises
    ------
    StudyError
        If it is refined to another one.
    """
    before = kept_plan(store)
    if before is None:
        store.place.put(_PLAN, sealed({"overturning": tolerance}))
    elif before != tolerance:
        raise StudyError(
            f"{store.place} holds a study refined to {before:g}, not to {tolerance:g}: create this one elsewhere"
        )


def kept_plan(store: Store) -> float | None:
    """Tolerance to which a study is refined; None where it is not.

    Raises
    ------
    StudyError
        If what says so is damaged.
    """
    data = store.place.get(_PLAN)
    if data is None:
        return None
    plan = unsealed(data)
    if plan is None:
        raise StudyError(f"{_PLAN} in {store.place} is damaged: remove it, and create the study again from its inputs")
    return float(plan["overturning"])


def rounds(store: Store, tolerance: float) -> Iterator[Round]:
    """Give the rounds that have begun, in order.

    Raises
    ------
    StudyError
        If one is damaged.
    """
    number = 1
    while (data := store.place.get(f"round.{number}/round.json")) is not None:
        about, archive = unsealed(data), store.place.get(f"round.{number}/brackets.npz")
        if about is None or archive is None or hashlib.sha256(archive).hexdigest() != about["brackets"]:
            raise StudyError(f"round.{number} in {store.place} is damaged: remove the folders round.* and run it again")
        yield Round(store, number, Brackets.from_bytes(archive), tolerance)
        number += 1


def next_round(store: Store, tolerance: float) -> Round:
    """Return the round that comes now: the last one that has begun, or where that is done, the one after it."""
    last = None
    for last in rounds(store, tolerance):  # noqa: B007 - the last is wanted
        pass
    if last is not None and (last.is_last or next(last.missing(), None) is not None):
        return last
    brackets = grid_brackets(store) if last is None else last.after()
    begun = Round(store, 1 if last is None else last.number + 1, brackets, tolerance)
    begun.create()
    return begun


def _require_order(product: Product) -> None:
    """Check that there are scales to refine between.

    Raises
    ------
    InvalidOption
        If there is one only, or they do not increase.
    """
    if product.scales.count < 2 or not np.all(np.diff(product.scales.values) > 0.0):
        raise InvalidOption("critical scales lie between two scales or more, in increasing order: give those")


def found_brackets(store: Store) -> Brackets:
    """Brackets of a study whose units are done; refined, where it is to be refined.

    Raises
    ------
    StudyError
        If units are missing or damaged.
    InvalidOption
        If the study has no two scales in increasing order.
    """
    missing = len(store.grid) - len(store.done())
    if missing:
        raise StudyError(f"{missing} of {len(store.grid)} units are missing: run the study to its end first")
    tolerance = kept_plan(store)
    if tolerance is None:
        return grid_brackets(store)
    begun = [*rounds(store, tolerance)]
    if not begun or not begun[-1].is_last:
        raise StudyError(f"{store.place}: the study is not yet refined to {tolerance:g}: run it to its end first")
    return begun[-1].brackets


def grid_brackets(store: Store) -> Brackets:
    """Brackets between neighbouring scales of the grid, all of whose units are done."""
    _require_order(store.product)
    verdicts = np.empty(store.grid.shape, dtype=np.int8)
    for key in store.grid:
        outcomes = store.outcomes(key)
        if outcomes is None:
            raise StudyError(f"{store.place}: unit {name_of(key)} is gone: run the study again")
        verdicts[store.grid.ranges(key)] = _verdicts(outcomes)
    here, above = verdicts[:, :-1].swapaxes(1, 3), verdicts[:, 1:].swapaxes(1, 3)  # (motion, block, polarity, scale)
    motion, block, polarity, scale = np.nonzero((here != above) & (here != _UNKNOWN) & (above != _UNKNOWN))
    order = np.lexsort((scale, block, polarity, motion))
    motion, block, polarity, scale = (index[order] for index in (motion, block, polarity, scale))
    levels = store.product.scales.values
    overturns = above[motion, block, polarity, scale] == _OVERTURNS
    known = np.ones(len(motion), dtype=bool)
    return Brackets(motion, polarity, block, levels[scale], levels[scale + 1], overturns, known)


def critical_scales(store: Store, brackets: Brackets) -> xr.Dataset:
    """Label brackets."""
    import xarray as xr

    product = store.product
    whole = product.dataset({})
    about = {"units": product.scales.units}
    named: dict[str, Any] = {
        name: ("change", np.asarray(values)[brackets.block], attributes)
        for name, (_, values, attributes) in block_coordinates(product.blocks).items()
    }
    names = whole.motion.values
    return xr.Dataset(
        {
            "low": ("change", brackets.low, about | {"long_name": "scale below the change"}),
            "high": ("change", brackets.high, about | {"long_name": "scale above the change"}),
            "overturns": ("change", brackets.overturns, {"long_name": "whether the scale above overturns the block"}),
            "known": ("change", brackets.known, {"long_name": "whether no simulation on the way was given up"}),
        },
        {
            "motion": ("change", names[brackets.motion]),
            "polarity": ("change", np.where(np.array(product.signs)[brackets.polarity] > 0, "+", "-")),
            "block": ("change", brackets.block),
            **named,
        },
        whole.attrs | {"measure": product.scales.measure or "factor", **product.scales.options},
    )


def _verdicts(outcomes: Floats) -> NDArray[np.int64]:
    """Verdict of each simulation from its outcomes, of which the first axis is."""
    named = dict(zip(OUTCOMES, outcomes, strict=True))
    overturned = named["overturned"] != 0.0
    open_ = ~overturned & ((named["unfinished"] != 0.0) | (named["stopped"] != 0.0))
    return np.where(open_, _UNKNOWN, np.where(overturned, _OVERTURNS, _STANDS))
