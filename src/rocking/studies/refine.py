"""Refinement of a study: gaps between scales whose verdicts differ, halved in rounds to a tolerance.

A verdict is whether a block overturns, or whether its first chattering is complete. Round r lists brackets, a verdict,
motion, polarity and block each with two scales that differ in it, and simulates the middle of every one that is wider
than its tolerance. Its list follows from the round before, the first one from the study's grid, so that whoever
computes it, and however often it is killed, makes the same bytes. A round without middles is the last.
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import hashlib
import io
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from rocking import bisection, checks
from rocking.arrays import Flags, Floats, Integers
from rocking.ensemble import Product, body_coordinates, dataset_of, measured, setup_of, verticals_of
from rocking.errors import InvalidOption, StudyError
from rocking.studies import inputs
from rocking.studies.inputs import require
from rocking.studies.store import Store, UnitArray, kept, sealed, unsealed
from rocking.studies.units import Key, PointsWork, UnitGrid
from rocking.tables import counted

if TYPE_CHECKING:
    import xarray as xr

_PLAN: Final = "refine.json"

#: Units of a round, where it has points enough, and points of a unit at least.
_UNITS: Final = 32
_LEAST: Final = 64

StudyVerdict = Literal["overturning", "complete_chattering"]

#: What a study may be refined for; brackets name verdicts by their number here.
VERDICTS: Final[tuple[StudyVerdict, ...]] = get_args(StudyVerdict)

#: How a dataset names a verdict on the higher scale, and what it says.
_ABOVE: Final[Mapping[StudyVerdict, tuple[str, str]]] = {
    "overturning": ("overturns", "whether the scale above overturns the block, and the one below does not"),
    "complete_chattering": ("completes", "whether chattering is complete at the scale above, and not at the one below"),
}

#: Outcomes that a verdict follows from, besides those that are always kept.
_NEEDED: Final[Mapping[str, Sequence[str]]] = {
    "overturning": ("overturned",),
    "complete_chattering": ("rests", "complete_chattering"),
}

#: Widths over scale that are narrow enough, for each verdict that is refined.
Tolerances = Mapping[str, float]


class Finding(enum.IntEnum):
    """What a simulation says on a verdict; nothing where it was given up or stopped before, or a rest is not proven."""

    UNKNOWN = -1
    NO = 0
    YES = 1


@dataclass(frozen=True, eq=False)
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
        return bisection.middle(self.low, self.high)

    def wide(self, tolerances: Tolerances) -> Integers:
        """Which ones to halve, in the order in which they are simulated: those of one scaled motion together."""
        chosen = np.flatnonzero(self.known & bisection.is_wide(self.low, self.high, self._enough(tolerances)))
        keys = self.block, self.middle, self.polarity, self.motion
        return chosen[np.lexsort([key[chosen] for key in keys])]

    def halvings(self, tolerances: Tolerances) -> int:
        """How often the widest one has to be halved, at most."""
        wide = self.wide(tolerances)
        excess = (self.high - self.low)[wide] / (self._enough(tolerances)[wide] * self.low[wide])
        return int(np.ceil(np.log2(excess.max(initial=1.0))))

    def of(self, verdict: StudyVerdict) -> Brackets:
        """Those of one verdict."""
        chosen = self.verdict == VERDICTS.index(verdict)
        return Brackets(**{name: values[chosen] for name, values in vars(self).items()})

    def _enough(self, tolerances: Tolerances) -> Floats:
        """Width over scale that is narrow enough for each."""
        return np.array([tolerances.get(verdict, math.inf) for verdict in VERDICTS])[self.verdict]

    def halved(self, chosen: Integers, findings: NDArray[np.int8]) -> Brackets:
        """Brackets after these findings on the middles of the chosen ones."""
        found = np.full(len(self.low), Finding.UNKNOWN, dtype=np.int8)
        found[chosen] = findings
        is_chosen = np.zeros(len(self.low), dtype=bool)
        is_chosen[chosen] = True
        is_known, as_above = found != Finding.UNKNOWN, found == self.above
        low, high = bisection.halved(self.low, self.high, is_known & ~as_above, is_known & as_above)
        return dataclasses.replace(self, low=low, high=high, known=self.known & (is_known | ~is_chosen))

    def to_bytes(self) -> bytes:
        """Return an archive whose bytes depend on the brackets alone."""
        return inputs.archive(vars(self))

    @classmethod
    def from_bytes(cls, data: bytes) -> Brackets:
        """Read such an archive."""
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return cls(**arrays)


class Round(UnitArray):
    """One round of a refinement: simulations at the middles of its brackets.

    Attributes
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
        width = min(math.prod(store.grid.unit), max(_LEAST, math.ceil(count / _UNITS)))
        super().__init__(store.place, f"round.{number}", UnitGrid((count,), (width,), store.grid.outcomes))
        self._measured = functools.cache(lambda motion: measured(store.product.scales, store.product.motions[motion]))

    def create(self) -> None:
        """Write the round without its units; what describes it last."""
        archive = self.brackets.to_bytes()
        for name, data in {f"{self.array}/brackets.npz": archive, **self.metadata}.items():
            self.place.put(name, data)
        about = {"round": self.number, "brackets": hashlib.sha256(archive).hexdigest(), "points": len(self.chosen)}
        self.place.put(f"{self.array}/round.json", sealed(about))

    @property
    def title(self) -> str:
        """What is counted while it runs."""
        most = self.number - 1 + self.brackets.halvings(self.tolerances)
        return f"simulations of round {self.number} of at most {most}"

    @property
    def is_last(self) -> bool:
        """Whether nothing is left to halve."""
        return not len(self.chosen)

    def work(self, key: Key) -> PointsWork:
        """Return all that a worker needs for a unit."""
        product, (some,) = self.store.product, self.grid.ranges(key)
        chosen = self.chosen[some]
        motions, which = np.unique(self.brackets.motion[chosen], return_inverse=True)
        signs = np.array(product.signs)[self.brackets.polarity[chosen]]
        values = np.array([self._measured(int(motion)) for motion in motions])
        return PointsWork(
            setup=dataclasses.replace(setup_of(product), bodies=product.bodies.select(self.brackets.block[chosen])),
            motions=tuple(product.motions[motion] for motion in motions),
            which=which,
            factors=signs * (self.brackets.middle[chosen] / values[which]),  # to the last bit as of `Scales.factors`
            unit=self.grid.unit,
            outcomes=self.grid.outcomes,
        )

    def after(self) -> Brackets:
        """Brackets after this round, whose units are done."""
        findings = np.full((len(VERDICTS), len(self.chosen)), Finding.UNKNOWN, dtype=np.int8)
        for key in self.grid:
            outcomes, (some,) = self.present(key), self.grid.ranges(key)
            for verdict in self.tolerances:
                findings[VERDICTS.index(verdict), some] = _finding(verdict, outcomes)
        which = self.brackets.verdict[self.chosen]
        return self.brackets.halved(self.chosen, findings[which, np.arange(len(which))])


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
            return f"refined to {_text(self.tolerances)} in {counted(self.rounds - 1, 'round')}"
        if not self.rounds:
            return f"to be refined to {_text(self.tolerances)}"
        far = f"round {self.rounds}: {self.done} of {counted(self.simulations, 'simulation')} done"
        return f"being refined to {_text(self.tolerances)}, {far}"


def refinement(store: Store) -> Refinement | None:
    """Return how far the refinement of a study has come; None where it has none."""
    tolerances = kept_plan(store)
    if tolerances is None:
        return None
    last = _last_round(store, tolerances)
    if last is None:
        return Refinement(tolerances, 0, 0, 0, complete=False)
    done = sum(map(last.grid.simulations, last.done()))
    return Refinement(tolerances, last.number, done, last.grid.total, last.is_last)


def tolerances_of(product: Product, refine: float | Mapping[str, float], outcomes: Sequence[str]) -> Tolerances:
    """Return tolerances by verdict, checked, also against what the study keeps; a number alone is for overturning."""
    given = refine if isinstance(refine, Mapping) else {"overturning": refine}
    others = [name for name in given if name not in VERDICTS]
    if others or not given:
        what = f"not {others[0]!r}" if others else "none of which is given"
        raise InvalidOption(f"{{}} takes a number, or tolerances for {' and '.join(VERDICTS)}, {what}", "refine")
    _require_order(product)
    names = [verdict for verdict in VERDICTS if verdict in given]
    for verdict in names:
        require(outcomes, _NEEDED[verdict], f"a refinement of {_name(verdict)}")
    return {verdict: checks.within(given[verdict], "refine", InvalidOption, 1e-12, 0.5) for verdict in names}


def keep_plan(store: Store, tolerances: Tolerances) -> None:
    """Store to which tolerances a study is refined; a StudyError if it is refined to others."""
    before = kept_plan(store)
    if before is None:
        store.place.put(_PLAN, sealed(dict(tolerances)))
    elif before != tolerances:
        raise StudyError(
            f"this holds a study refined to {_text(before)}, not to {_text(tolerances)}: create this one elsewhere",
            path=str(store.place),
        )


def kept_plan(store: Store) -> Tolerances | None:
    """Tolerances to which a study is refined; None where it is not, a StudyError if what says so is damaged."""
    plan = kept(store.place, _PLAN, "remove it, and create the study again from its inputs")
    return None if plan is None else {verdict: plan[verdict] for verdict in VERDICTS if verdict in plan}


def rounds(store: Store, tolerances: Tolerances) -> Iterator[Round]:
    """Give the rounds that have begun, in order; a StudyError if one is damaged."""
    for number, about in enumerate(_begun(store), 1):
        yield _round(store, number, about, tolerances)


def next_round(store: Store, tolerances: Tolerances) -> Round:
    """Return the round that comes now: the last one that has begun, or where that is done, the one after it."""
    last = _last_round(store, tolerances)
    if last is not None and (last.is_last or next(last.missing(), None) is not None):
        return last
    brackets = grid_brackets(store, tolerances) if last is None else last.after()
    begun = Round(store, 1 if last is None else last.number + 1, brackets, tolerances)
    begun.create()
    return begun


def _last_round(store: Store, tolerances: Tolerances) -> Round | None:
    """Return the last round that has begun; its brackets alone are read, which hold all that those before it found."""
    begun = [*_begun(store)]
    return _round(store, len(begun), begun[-1], tolerances) if begun else None


def _begun(store: Store) -> Iterator[bytes]:
    """Give what describes each round that has begun, in order."""
    number = 1
    while (data := store.place.get(f"round.{number}/round.json")) is not None:
        yield data
        number += 1


def _round(store: Store, number: int, data: bytes, tolerances: Tolerances) -> Round:
    """Read a round that has begun; a StudyError if it is damaged."""
    about, archive = unsealed(data), store.place.get(f"round.{number}/brackets.npz")
    if about is None or archive is None or hashlib.sha256(archive).hexdigest() != about["brackets"]:
        raise StudyError(
            f"round.{number} is damaged: remove the folders round.* and run the study again", path=str(store.place)
        )
    return Round(store, number, Brackets.from_bytes(archive), tolerances)


def _require_order(product: Product) -> None:
    """Check that there are scales to refine between."""
    if product.scales.count < 2 or not np.all(np.diff(product.scales.values) > 0.0):
        raise InvalidOption("critical scales lie between two scales or more, in increasing order: give those")


def _found_brackets(store: Store, verdict: StudyVerdict) -> Brackets:
    """Return the changes of a verdict in a study whose units are done; refined, where it is to be refined."""
    store.require_complete()
    tolerances = kept_plan(store)
    if tolerances is None or verdict not in tolerances:
        return grid_brackets(store, [verdict])
    last = _last_round(store, tolerances)
    if last is None or not last.is_last:
        raise StudyError(
            f"the study is not yet refined to {_text(tolerances)}: run it to its end first", path=str(store.place)
        )
    return last.brackets.of(verdict)


def grid_brackets(store: Store, of: Collection[str]) -> Brackets:
    """Find changes of verdicts between each scale of the grid and the next known one; all its units are done."""
    _require_order(store.product)
    findings = np.full((len(VERDICTS), *store.grid.shape), Finding.UNKNOWN, dtype=np.int8)
    for key in store.grid:
        outcomes = store.present(key)
        for verdict in of:
            findings[VERDICTS.index(verdict)][store.grid.ranges(key)] = _finding(verdict, outcomes)
    is_known = findings != Finding.UNKNOWN
    # An unknown verdict takes the last known one below it: else a change with unknown verdicts inside would be lost.
    for k in range(1, findings.shape[2]):
        np.copyto(findings[:, :, k], findings[:, :, k - 1], where=~is_known[:, :, k])
    here, above = findings[:, :, :-1], findings[:, :, 1:]
    found = np.nonzero((here != above) & (here != Finding.UNKNOWN))
    which, motion, scale, polarity, block = found
    order = np.lexsort((scale, block, polarity, motion, which))
    which, motion, scale, polarity, block = (index[order] for index in found)
    levels = store.product.scales.values
    holds = above[which, motion, scale, polarity, block] == Finding.YES
    below = scale.copy()
    while (unknown := ~is_known[which, motion, below, polarity, block]).any():
        below[unknown] -= 1
    return Brackets(which, motion, polarity, block, levels[below], levels[scale + 1], holds, below == scale)


def critical_scales(store: Store, verdict: StudyVerdict) -> xr.Dataset:
    """Label the changes of a verdict in a study whose units are done, as `Study.critical_scales`."""
    import xarray as xr

    checks.one_of(verdict, "verdict", InvalidOption, VERDICTS)
    require(store.grid.outcomes, _NEEDED[verdict], f"a critical scale of {_name(verdict)}")
    brackets = _found_brackets(store, verdict)
    above, meaning = _ABOVE[verdict]
    product = store.product
    whole = dataset_of(product, {})
    about = {"units": product.scales.about["units"]}
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
            **{
                name: ("change", np.array(verticals)[brackets.motion])
                for name, (_, verticals) in verticals_of(product.motions).items()
            },
            "polarity": ("change", np.where(np.array(product.signs)[brackets.polarity] > 0, "+", "-")),
            "block": ("change", brackets.block),
            **named,
        },
        whole.attrs | {name: value for name, value in product.scales.about.items() if name != "units"},
    )


def _finding(verdict: str, outcomes: Mapping[str, Floats]) -> NDArray[np.int8]:
    """Return the `Finding` of each simulation; what was given up or stopped has not overturned yet."""
    unknown = (outcomes["unfinished"] != 0.0) | (outcomes["stopped"] != 0.0)
    if verdict == "overturning":
        holds = outcomes["overturned"] != 0.0
    else:
        holds = outcomes["complete_chattering"] != 0.0
        unknown = (unknown & (outcomes["rests"] == 0.0)) | (outcomes["stalled"] != 0.0)
    return np.where(unknown, Finding.UNKNOWN, holds).astype(np.int8)


def _text(tolerances: Tolerances) -> str:
    """Write tolerances in a few words."""
    return ", ".join(f"{tolerance:g} ({_name(verdict)})" for verdict, tolerance in tolerances.items())


def _name(verdict: str) -> str:
    return verdict.replace("_", " ")
