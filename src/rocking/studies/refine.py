"""Refinement of a study: gaps between scales whose verdicts differ, halved in rounds to a tolerance.

A verdict is whether a block overturns, or whether its first chattering is complete. Round r lists brackets, a verdict,
motion, polarity and block each with two scales that differ in it, and simulates the middle of every one that is wider
than its tolerance. Its list follows from the round before, the first one from the study's grid, so that whoever
computes it, and however often it is killed, makes the same bytes. A round without middles is the last.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import io
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.arrays import Flags, Floats, Integers
from rocking.errors import InvalidOption, StudyError
from rocking.product import Product, body_coordinates
from rocking.studies import inputs
from rocking.studies.outcomes import require
from rocking.studies.store import Store, readable, sealed, unsealed
from rocking.studies.units import Key, Line, PointsWork, name_of
from rocking.tables import counted

if TYPE_CHECKING:
    import xarray as xr

_PLAN: Final = "refine.json"

#: Units of a round, where it has points enough, and points of a unit at least.
_UNITS: Final = 32
_LEAST: Final = 64

Verdict = Literal["overturning", "complete_chattering"]

#: What a study may be refined for; brackets name verdicts by their number here.
VERDICTS: Final[tuple[Verdict, ...]] = get_args(Verdict)

#: How a dataset names a verdict on the higher scale, and what it says.
_ABOVE: Final[Mapping[Verdict, tuple[str, str]]] = {
    "overturning": ("overturns", "whether the scale above overturns the block, and the one below does not"),
    "complete_chattering": ("completes", "whether chattering is complete at the scale above, and not at the one below"),
}

#: Outcomes that a verdict is told from, besides those that are always kept.
_NEEDED: Final[Mapping[str, Sequence[str]]] = {
    "overturning": ("overturned",),
    "complete_chattering": ("rests", "complete_chattering"),
}

#: Neither: a simulation was given up or stopped before, or a rest is not proven.
_UNKNOWN: Final = -1

#: Widths over scale that are narrow enough, for each verdict that is refined.
Tolerances = Mapping[str, float]


@dataclass(frozen=True)
class Brackets:
    """Changes of verdicts, each between two scales; in order of verdict, motion, polarity, block and scale.

    Attributes
    ----------
    verdict : ndarray of int
        Of which verdict of `VERDICTS`.
    motion, polarity, block : ndarray of int
        Whose.
    low, high : ndarray
        Scales that bracket the change.
    above : ndarray of bool
        Whether the verdict holds at the higher one, and not at the lower one; else the other way round.
    known : ndarray of bool
        Whether the verdicts of all middles so far are known.
    """

    verdict: Integers
    motion: Integers
    polarity: Integers
    block: Integers
    low: Floats
    high: Floats
    above: Flags
    known: Flags

    @property
    def middle(self) -> Floats:
        """Scales halfway."""
        return 0.5 * (self.low + self.high)

    def wide(self, tolerances: Tolerances) -> Integers:
        """Which ones to halve, in the order in which they are simulated: those of one scaled motion together."""
        middle, enough = self.middle, self._enough(tolerances)
        splits = (middle > self.low) & (middle < self.high)
        chosen = np.flatnonzero(self.known & splits & (self.high - self.low > enough * self.high))
        keys = self.block, middle, self.polarity, self.motion
        return chosen[np.lexsort([key[chosen] for key in keys])]

    def halvings(self, tolerances: Tolerances) -> int:
        """How often the widest one has to be halved, at most."""
        wide = self.wide(tolerances)
        excess = (self.high - self.low)[wide] / (self._enough(tolerances)[wide] * self.low[wide])
        return int(np.ceil(np.log2(excess.max(initial=1.0))))

    def of(self, verdict: Verdict) -> Brackets:
        """Those of one verdict."""
        chosen = self.verdict == VERDICTS.index(verdict)
        return Brackets(**{name: values[chosen] for name, values in vars(self).items()})

    def _enough(self, tolerances: Tolerances) -> Floats:
        """Width over scale that is narrow enough for each."""
        return np.array([tolerances.get(verdict, math.inf) for verdict in VERDICTS])[self.verdict]

    def halved(self, chosen: Integers, verdicts: NDArray[np.int8]) -> Brackets:
        """Brackets after these verdicts on the middles of the chosen ones."""
        low, high, known, middle = self.low.copy(), self.high.copy(), self.known.copy(), self.middle
        as_above = verdicts == self.above[chosen]
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
    tolerances : mapping
        Width over scale that is narrow enough, by verdict.
    """

    def __init__(self, store: Store, number: int, brackets: Brackets, tolerances: Tolerances) -> None:
        self.store, self.number, self.brackets, self.tolerances = store, number, brackets, tolerances
        self.chosen = brackets.wide(tolerances)
        count = len(self.chosen)
        most = math.prod(store.grid.unit)
        self.grid = Line(count, min(most, max(_LEAST, math.ceil(count / _UNITS))), store.grid.outcomes)
        self._now = functools.cache(lambda motion: store.product.scales.now(store.product.motions[motion]))

    def create(self) -> None:
        """Write the round without its units; what describes it last."""
        place, archive = self.store.place, self.brackets.to_bytes()
        place.put(f"{self.name}/brackets.npz", archive)
        for name, data in self.metadata.items():
            place.put(name, data)
        about = {"round": self.number, "brackets": hashlib.sha256(archive).hexdigest(), "points": len(self.chosen)}
        place.put(f"{self.name}/round.json", sealed(about))

    @property
    def metadata(self) -> dict[str, bytes]:
        """What any reader of Zarr knows the array by; a round without points has none."""
        return {f"{self.name}/zarr.json": self.grid.metadata().encode()} if len(self.chosen) else {}

    @property
    def name(self) -> str:
        """Name of its array."""
        return f"round.{self.number}"

    @property
    def title(self) -> str:
        """What is counted while it runs."""
        most = self.number - 1 + self.brackets.halvings(self.tolerances)
        return f"simulations of round {self.number} of at most {most}"

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
        setup = dataclasses.replace(product.setup(), bodies=product.bodies.select(self.brackets.block[chosen]))
        now = np.array([self._now(int(motion)) for motion in motions])
        return PointsWork(
            setup=setup,
            motions=tuple(product.motions[motion] for motion in motions),
            which=which,
            factors=signs * (self.brackets.middle[chosen] / now[which]),  # to the last bit as of `Scales.factors`
            unit=self.grid.unit,
            outcomes=self.grid.outcomes,
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

    def outcomes(self, key: Key) -> Mapping[str, Floats] | None:
        """Outcomes of a unit by name, shape (points,) each; None where it is not done.

        Raises
        ------
        StudyError
            If it is damaged; the message names it.
        """
        data = self.raw(key)
        return None if data is None else readable(data, self.grid, (self.grid.simulations(key),), self.label(key))

    def after(self) -> Brackets:
        """Brackets after this round, whose units are done.

        Raises
        ------
        StudyError
            If one is damaged or gone.
        """
        verdicts = np.full((len(VERDICTS), len(self.chosen)), _UNKNOWN, dtype=np.int8)
        for key in self.grid:
            outcomes = self.outcomes(key)
            if outcomes is None:
                raise StudyError(f"{self.store.place}: unit {self.label(key)} is gone: run the study again")
            for verdict in self.tolerances:
                verdicts[VERDICTS.index(verdict), self.grid.range(key)] = _verdict(verdict, outcomes)
        which = self.brackets.verdict[self.chosen]
        return self.brackets.halved(self.chosen, verdicts[which, np.arange(len(which))])


@dataclass(frozen=True)
class Refinement:
    """How far a refinement has come.

    Attributes
    ----------
    tolerances : mapping
        Width over scale to which it goes, by verdict.
    rounds : int
        Rounds that have begun.
    done, simulations : int
        Simulations of the last of them that are done, of how many.
    complete : bool
        Whether nothing is left to halve.
    """

    tolerances: Tolerances
    rounds: int
    done: int
    simulations: int
    complete: bool

    def __str__(self) -> str:
        """Write it in a few words."""
        if self.complete:
            return f"refined to {_told(self.tolerances)} in {counted(self.rounds - 1, 'round')}"
        if not self.rounds:
            return f"to be refined to {_told(self.tolerances)}"
        far = f"round {self.rounds}: {self.done} of {counted(self.simulations, 'simulation')} done"
        return f"being refined to {_told(self.tolerances)}, {far}"


def refinement(store: Store) -> Refinement | None:
    """Return how far the refinement of a study has come; None where it has none."""
    tolerances = kept_plan(store)
    if tolerances is None:
        return None
    begun = [*rounds(store, tolerances)]
    if not begun:
        return Refinement(tolerances, 0, 0, 0, complete=False)
    last = begun[-1]
    done = sum(map(last.grid.simulations, last.done()))
    return Refinement(tolerances, len(begun), done, last.grid.total, last.is_last)


def tolerances_of(product: Product, refine: float | Mapping[str, float], kept: Sequence[str]) -> Tolerances:
    """Return tolerances by verdict, checked; a number alone is one for overturning.

    Raises
    ------
    InvalidOption
        If one is out of its range, there is no such verdict, there are no scales to refine between, or the outcomes
        that are kept do not tell the verdict.
    """
    given = refine if isinstance(refine, Mapping) else {"overturning": refine}
    others = [name for name in given if name not in VERDICTS]
    if others or not given:
        what = f"not {others[0]!r}" if others else "none of which is given"
        raise InvalidOption(f"refine takes a number, or tolerances for {' and '.join(VERDICTS)}, {what}")
    _require_order(product)
    names = [verdict for verdict in VERDICTS if verdict in given]
    for verdict in names:
        require(kept, _NEEDED[verdict], f"a refinement of {_worded(verdict)}")
    return {verdict: checks.within(given[verdict], "refine", InvalidOption, 1e-12, 0.5) for verdict in names}


def keep_plan(store: Store, tolerances: Tolerances) -> None:
    """Store to which tolerances a study is refined.

    Raises
    ------
    StudyError
        If it is refined to others.
    """
    before = kept_plan(store)
    if before is None:
        store.place.put(_PLAN, sealed(dict(tolerances)))
    elif before != tolerances:
        raise StudyError(
            f"{store.place} holds a study refined to {_told(before)}, not to {_told(tolerances)}: create this one "
            "elsewhere"
        )


def kept_plan(store: Store) -> Tolerances | None:
    """Tolerances to which a study is refined; None where it is not.

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
    return {verdict: plan[verdict] for verdict in VERDICTS if verdict in plan}


def rounds(store: Store, tolerances: Tolerances) -> Iterator[Round]:
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
        yield Round(store, number, Brackets.from_bytes(archive), tolerances)
        number += 1


def next_round(store: Store, tolerances: Tolerances) -> Round:
    """Return the round that comes now: the last one that has begun, or where that is done, the one after it."""
    last = None
    for last in rounds(store, tolerances):  # noqa: B007 - the last is wanted
        pass
    if last is not None and (last.is_last or next(last.missing(), None) is not None):
        return last
    brackets = grid_brackets(store, tolerances) if last is None else last.after()
    begun = Round(store, 1 if last is None else last.number + 1, brackets, tolerances)
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


def found_brackets(store: Store, verdict: Verdict) -> Brackets:
    """Return the changes of a verdict in a study whose units are done; refined, where it is to be refined.

    Raises
    ------
    StudyError
        If units are missing or damaged.
    InvalidOption
        If the study has no two scales in increasing order.
    """
    missing = len(store.grid) - len(store.done())
    if missing:
        raise StudyError(f"units are missing, {missing} of {len(store.grid)}: run the study to its end first")
    tolerances = kept_plan(store)
    if tolerances is None or verdict not in tolerances:
        return grid_brackets(store, [verdict])
    begun = [*rounds(store, tolerances)]
    if not begun or not begun[-1].is_last:
        raise StudyError(f"{store.place}: the study is not yet refined to {_told(tolerances)}: run it to its end first")
    return begun[-1].brackets.of(verdict)


def grid_brackets(store: Store, of: Collection[str]) -> Brackets:
    """Find changes of verdicts between neighbouring scales of the grid, all of whose units are done."""
    _require_order(store.product)
    verdicts = np.full((len(VERDICTS), *store.grid.shape), _UNKNOWN, dtype=np.int8)
    for key in store.grid:
        outcomes = store.outcomes(key)
        if outcomes is None:
            raise StudyError(f"{store.place}: unit {name_of(key)} is gone: run the study again")
        for verdict in of:
            verdicts[VERDICTS.index(verdict), *store.grid.ranges(key)] = _verdict(verdict, outcomes)
    here, above = verdicts[:, :, :-1], verdicts[:, :, 1:]
    found = np.nonzero((here != above) & (here != _UNKNOWN) & (above != _UNKNOWN))
    which, motion, scale, polarity, block = found
    order = np.lexsort((scale, block, polarity, motion, which))
    which, motion, scale, polarity, block = (index[order] for index in found)
    levels = store.product.scales.values
    holds = above[which, motion, scale, polarity, block] == 1
    known = np.ones(len(motion), dtype=bool)
    return Brackets(which, motion, polarity, block, levels[scale], levels[scale + 1], holds, known)


def critical_scales(store: Store, verdict: Verdict) -> xr.Dataset:
    """Label the changes of a verdict in a study whose units are done.

    Raises
    ------
    StudyError
        If units are missing or damaged.
    InvalidOption
        If there is no such verdict, the study does not keep its outcomes, or has no two scales in increasing order.
    """
    import xarray as xr

    checks.one_of(verdict, "verdict", InvalidOption, VERDICTS)
    require(store.grid.outcomes, _NEEDED[verdict], f"a critical scale of {_worded(verdict)}")
    brackets = found_brackets(store, verdict)
    above, meaning = _ABOVE[verdict]
    product = store.product
    whole = product.dataset({})
    about = {"units": product.scales.units}
    named: dict[str, Any] = {
        name: ("change", np.asarray(values)[brackets.block], attributes)
        for name, (_, values, attributes) in body_coordinates(product.bodies).items()
    }
    names = whole.motion.values
    return xr.Dataset(
        {
            "low": ("change", brackets.low, about | {"long_name": "scale below the change"}),
            "high": ("change", brackets.high, about | {"long_name": "scale above the change"}),
            above: ("change", brackets.above, {"long_name": meaning}),
            "known": ("change", brackets.known, {"long_name": "whether the verdicts of all simulations are known"}),
        },
        {
            "motion": ("change", names[brackets.motion]),
            "polarity": ("change", np.where(np.array(product.signs)[brackets.polarity] > 0, "+", "-")),
            "block": ("change", brackets.block),
            **named,
        },
        whole.attrs | {"measure": product.scales.measure or "factor", **product.scales.options},
    )


def _verdict(verdict: str, outcomes: Mapping[str, Floats]) -> NDArray[np.int8]:
    """Verdict on each simulation from its outcomes; what was given up or stopped has not overturned yet."""
    cut = (outcomes["unfinished"] != 0.0) | (outcomes["stopped"] != 0.0)
    if verdict == "overturning":
        return _where_known(outcomes["overturned"] != 0.0, cut)
    unproven = (cut & (outcomes["rests"] == 0.0)) | (outcomes["stalled"] != 0.0)
    return _where_known(outcomes["complete_chattering"] != 0.0, unproven)


def _where_known(holds: Flags, unknown: Flags) -> NDArray[np.int8]:
    return np.where(unknown, _UNKNOWN, holds).astype(np.int8)


def _told(tolerances: Tolerances) -> str:
    """Write tolerances in a few words."""
    return ", ".join(f"{tolerance:g} ({_worded(verdict)})" for verdict, tolerance in tolerances.items())


def _worded(verdict: str) -> str:
    return verdict.replace("_", " ")
