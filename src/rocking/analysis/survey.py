"""One block under many records: what becomes of it under each, in a row."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rocking.block.body import Body
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.progress import Progress, note
from rocking.core.result import Result
from rocking.core.tables import Column, columns_with_skipped, counted, decimal, named, text_table
from rocking.engine.problem import one_body
from rocking.errors import InvalidOption, install
from rocking.motion.motion import Motion
from rocking.records.named import Motions, motions_by_name, names_of
from rocking.response import PRECISION, Response, in_brief, ratio_text, steps_within
from rocking.response.mechanics import friction_coefficient
from rocking.simulation.ensemble import body_coordinates, verticals_of
from rocking.simulation.simulate import simulate

if TYPE_CHECKING:
    pass

#: Columns for people; files hold all.
_SHOWN: Final = {
    "record": "record",
    named("pga", "g"): "PGA, g",
    "peak_over_{}": "peak/{}",
    "impacts_resolved": "resolved impacts",
    "rests": "rests",
    "verdict": "verdict",
}

_SLIDING: Final = named("sliding_time", "s")


@dataclass(frozen=True, eq=False, repr=False)
class BlockUnderRecords(Result):
    """One block under several motions, named `records`; `skipped` are the reasons why others could not be read."""

    TABLES = ("records",)

    block: Body
    records: tuple[str, ...]
    responses: tuple[Response, ...]
    skipped: Mapping[str, str] = field(default_factory=dict, kw_only=True)

    @abstractmethod
    def rows(self) -> list[dict[str, Any]]:
        """Return a row of results for each record."""

    def to_dict(self) -> dict[str, Any]:
        return {"block": str(self.block), "records": self.rows(), "skipped": dict(self.skipped)}

    def _columns(self, table: str) -> list[Column]:
        return columns_with_skipped(self.rows(), self.skipped)

    def _labels(self) -> list[dict[str, Any]]:
        """First columns of each row: the record, its motion, the block."""
        columns = body_coordinates(self.block.alone())
        numbers = {named(name, about["units"]): float(values[0]) for name, (_, values, about) in columns.items()}
        labels = record_columns(self.records, [motion_of(response) for response in self.responses])
        return [{**label, "block": self.block.description, **numbers} for label in labels]

    def _headline(self) -> str:
        """Say under how many records the block overturns."""
        overturned = sum(one.overturned and one.perturbed().is_decided for one in self.responses)
        return f"{self.block.description}: {counted(len(self.records), 'record')}, overturned by {overturned}"


@dataclass(frozen=True, eq=False, repr=False)
class Survey(BlockUnderRecords):
    """Responses of a block to several motions; from `survey`.

    Attributes
    ----------
    friction, precision : float
        As for `survey`.
    block, records, responses, skipped
        Body, name of each motion, response to each, and why records could not be read.
    """

    friction: float | None = None
    precision: float = PRECISION

    def rows(self) -> list[dict[str, Any]]:
        rows = []
        for label, response in zip(self._labels(), self.responses, strict=True):
            friction = self.friction
            sliding = {} if friction is None else {"friction": friction, _SLIDING: response.sliding_time(friction)}
            rows.append(label | _row(response, self.precision) | sliding)
        return rows

    def summary(self) -> str:
        limit = self.block.coordinate.limit
        known = [{f"peak_over_{limit}": float(ratio_text(response))} for response in self.responses]
        rows = [row | each for row, each in zip(self.rows(), known, strict=True)]
        shown = {name.format(limit): title.format(limit) for name, title in _SHOWN.items()}
        if self.friction is not None:
            shown |= {_SLIDING: f"with friction {self.friction:g} slides at, s"}
        if any(row["processing"] for row in rows):
            shown = shown | {"processing": "done to the record"}
        table = text_table(list(shown.values()), [[row[name] for name in shown] for row in rows])
        return f"{self._headline()}\n\n{table}"

    def _headline(self) -> str:
        undecided = sum(
            response.stopped or response.unfinished or not response.perturbed().is_decided
            for response in self.responses
        )
        known = f", undecided under {undecided}" if undecided else ""
        unread = f"; {counted(len(self.skipped), 'record')} skipped" if self.skipped else ""
        return super()._headline() + known + unread

    def to_dict(self) -> dict[str, Any]:
        numbers = self.block.alone().parameters().items()
        block = {
            "description": self.block.description,
            **{named(name, unit): values[0].tolist() for name, (values, unit) in numbers},
        }
        friction = {} if self.friction is None else {"friction": self.friction}
        return {"block": block, **friction, "records": self.rows(), "skipped": dict(self.skipped)}

    def write(self, folder: str | Path) -> None:
        """Write summary.csv, summary.json and, if openpyxl is installed, summary.xlsx into a folder that exists."""
        folder = Path(folder)
        self.to_csv(folder / "summary.csv")
        try:
            self.to_excel(folder / "summary.xlsx")
        except InvalidOption:
            note(f"no summary.xlsx: {install('excel')} for a workbook; summary.csv contains the same table")
        self.to_json(folder / "summary.json")


def survey(
    block: Body,
    motions: Motions,
    *,
    friction: float | None = None,
    precision: float = PRECISION,
    progress: bool | None = None,
    **options: Any,
) -> Survey:
    """Simulate a block under many motions.

    Parameters
    ----------
    block, motions : optional
        As for `simulate_many`: one block, m motions; the table shows the names of a mapping, or else the motions' own.
    friction : float, optional
        Coefficient of friction at which to look for sliding.
    precision : float
        Relative precision of the motions, from 1e-6 to 0.1: outcomes are also counted within it.
    progress : bool, optional
        As for `simulate_many`.
    **options : object
        As for `rocking.simulate`: model, chattering, duration, ...

    Returns
    -------
    Survey
        All responses, in a table with a row for each.

    Raises
    ------
    InvalidOption
        As for `rocking.simulate`, or if there is no motion.
    InvalidMotion
        If a motion is anything else.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.24, height=1.1)
    >>> found = survey(block, {"clc": rocking.records.load("ridgecrest-clc-090")})
    >>> len(found.responses)
    1
    """
    named_motions = motions_by_name(motions)
    if not one_body(block).coordinate.limit:
        raise InvalidOption(f"a survey is of a block, which has a balance, not of a {type(block).__name__}")
    if friction is not None:
        friction_coefficient(friction)
    responses = []
    with Progress("simulating", total=len(named_motions), show=progress) as bar:
        for motion in named_motions.values():
            responses.append(simulate(block, motion, **options))
            _row(responses[-1], precision)  # what takes long in it, the response keeps: while the bar is there
            bar.advance()
    return Survey(block, tuple(named_motions), tuple(responses), friction, precision)


def folder_names(records: Sequence[str]) -> list[str]:
    """Return a name for a folder of each record, no two alike."""
    names: dict[str, None] = {}
    for record in records:
        # A pulse is named by its text, with a colon, which not every system has in a name.
        stem = Path(record).stem.replace(":", "-") if record != "-" else "standard-input"
        others = (f"{stem}-{k}" for k in range(2, len(records) + 2))
        names[stem if stem not in names else next(name for name in others if name not in names)] = None
    return list(names)


def record_columns(records: Sequence[str], motions: Sequence[Motion]) -> list[dict[str, str]]:
    """Name each record as it was asked for, and its motion as other analyses name it."""
    names, verticals = names_of(motions), verticals_of(motions)
    return [
        {"record": record, "motion": names[k], **{name: column[1][k] for name, column in verticals.items()}}
        for k, record in enumerate(records)
    ]


def motion_of(response: Response) -> Motion:
    """Return the motion of a response that has one."""
    assert response.motion is not None
    return response.motion


def _row(response: Response, precision: float) -> dict[str, Any]:
    motion = motion_of(response)
    near, further = response.perturbed(), response.perturbed(*steps_within(precision))
    return {
        named("duration", "s"): motion.duration,
        named("pga", "g"): decimal(motion.pga / STANDARD_GRAVITY),
        named("pgv", "m/s"): motion.pgv,
        "processing": "; ".join(motion.history),
        "verdict": in_brief(response, precision),
        "overturned": response.overturned,
        "decided": near.is_decided,
        "overturned_share": float(near.overturned.mean()),
        "precision": precision,
        "overturned_share_at_precision": float(further.overturned.mean()),
        "unfinished": response.unfinished,
        "stopped": response.stopped,
        "leans": response.leans,
        "ambiguous": response.ambiguous,
        named("overturn_time", "s"): response.overturn_time,
        f"peak_over_{response.body.coordinate.limit}": response.peak_over_slenderness,
        named("peak_rotation", "rad"): response.peak_rotation,
        named("residual_rotation", "rad"): response.residual_rotation,
        named("peak_time", "s"): response.peak_time,
        "impacts_resolved": len(response.impacts),
        "rests": int((response.events["kind"] == "rest").sum()),
        named("time_at_rest", "s"): response.time_at_rest,
        "required_friction": math.nan if response.body.contact is None else response.required_friction,
    }
