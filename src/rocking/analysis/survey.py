"""One block under many records: what becomes of it under each, in a row."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rocking import checks
from rocking.block import Block, Blocks
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.product import body_coordinates, names_of, verticals_of
from rocking.progress import Progress, note
from rocking.response import Response, in_brief, ratio_text
from rocking.response.forces import friction_coefficient
from rocking.simulation import simulate
from rocking.tables import counted, decimal, frame_of, named, text_table, to_json, write_bytes, write_text

if TYPE_CHECKING:
    import pandas as pd

#: Columns for people; files hold all.
_SHOWN: Final = {
    "record": "record",
    named("pga", "g"): "PGA, g",
    "peak_over_slenderness": "peak/slenderness",
    "impacts_resolved": "impacts",
    "rests": "rests",
    "verdict": "verdict",
}

_SLIDING: Final = named("sliding_time", "s")


@dataclass(frozen=True, eq=False)
class Survey:
    """Responses of a block to several motions.

    Attributes
    ----------
    block : Block
        What rocks.
    records : tuple of str
        Name of each motion.
    responses : tuple of Response
        Response to each.
    friction : float or None
        Coefficient of friction at which sliding is looked for.
    skipped : mapping of str to str
        Records that could not be read, and why.
    """

    block: Block
    records: tuple[str, ...]
    responses: tuple[Response, ...]
    friction: float | None = None
    skipped: Mapping[str, str] = field(default_factory=dict)

    def rows(self) -> list[dict[str, Any]]:
        """Return what became of the block under each record; units are in the names."""
        labels = record_columns(self.records, [motion_of(response) for response in self.responses])
        block = block_columns(self.block)
        each = zip(labels, self.responses, strict=True)
        return [label | block | _row(response) | self._sliding(response) for label, response in each]

    def to_dataframe(self) -> pd.DataFrame:
        """Return the table as a data frame, with a row for each record that could not be read."""
        return frame_of(self.rows(), self.skipped)

    def summary(self) -> str:
        """Return the table for people."""
        known = [{"peak_over_slenderness": float(ratio_text(response))} for response in self.responses]
        rows = [row | each for row, each in zip(self.rows(), known, strict=True)]
        shown = (
            _SHOWN if self.friction is None else _SHOWN | {_SLIDING: f"with friction {self.friction:g} slides at, s"}
        )
        if any(row["processing"] for row in rows):
            shown = shown | {"processing": "done to the record"}
        table = text_table(list(shown.values()), [[row[name] for name in shown] for row in rows])
        return f"{self._count()}\n\n{table}"

    def _count(self) -> str:
        """Say under how many records the block overturns."""
        overturned = sum(response.overturned for response in self.responses)
        undecided = sum(response.stopped or response.unfinished for response in self.responses)
        count = "1 record" if len(self.records) == 1 else f"{len(self.records)} records"
        known = f", not decided under {undecided}" if undecided else ""
        unread = f"; {counted(len(self.skipped), 'record')} skipped" if self.skipped else ""
        return f"{self.block.description}: {count}, overturned by {overturned}{known}{unread}"

    def __repr__(self) -> str:
        return f"<Survey: {self._count()}>"

    def to_dict(self) -> dict[str, Any]:
        """Return the table for machines."""
        sides = self.block.sides
        block = {
            "description": self.block.description,
            named("p", "rad/s"): [side.p for side in sides],
            named("alpha", "rad"): [side.alpha for side in sides],
            "restitution": [side.restitution for side in sides],
        }
        friction = {} if self.friction is None else {"friction": self.friction}
        return {"block": block, **friction, "records": self.rows(), "skipped": dict(self.skipped)}

    def _sliding(self, response: Response) -> dict[str, float]:
        if self.friction is None:
            return {}
        return {"friction": self.friction, _SLIDING: response.sliding_time(self.friction)}

    def folders(self) -> list[str]:
        """Return a name for a folder of each record, no two alike."""
        names: dict[str, None] = {}
        for record in self.records:
            # A pulse is named by its text, with a colon, which not every system has in a name.
            stem = Path(record).stem.replace(":", "-") if record != "-" else "standard-input"
            others = (f"{stem}-{k}" for k in range(2, len(self.records) + 2))
            names[stem if stem not in names else next(name for name in others if name not in names)] = None
        return list(names)

    def write(self, folder: Path) -> None:
        """Write summary.csv, summary.json and, if openpyxl is installed, summary.xlsx.

        Raises
        ------
        OutputError
            If they cannot be written.
        """
        frame = self.to_dataframe()
        digits: dict[str, Any] = {"index": False, "float_format": "%.15g"}
        write_text(folder / "summary.csv", frame.to_csv(lineterminator="\n", **digits))
        try:
            workbook = io.BytesIO()
            frame.to_excel(workbook, sheet_name="summary", freeze_panes=(1, 0), **digits)
            write_bytes(folder / "summary.xlsx", workbook.getvalue())
        except ImportError:
            note("no summary.xlsx: install rocking[excel] for a workbook; summary.csv holds the same table")
        write_text(folder / "summary.json", to_json(self.to_dict()) + "\n")


def survey(
    block: Block,
    motions: Mapping[str, Motion],
    *,
    friction: float | None = None,
    progress: bool | None = None,
    **options: Any,
) -> Survey:
    """Simulate a block under many motions.

    Parameters
    ----------
    block : Block
        What rocks.
    motions : mapping of str to Motion
        Motions by the names that the table shows.
    friction : float, optional
        Coefficient of friction at which to look for sliding.
    progress : bool, optional
        Show a progress bar; by default if stderr is a terminal.
    **options
        As for `rocking.simulate`: model, chattering, duration, ...

    Returns
    -------
    Survey

    Raises
    ------
    InvalidOption
        As for `rocking.simulate`.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.24, height=1.1)
    >>> names = ["el-centro-meloland-270", "ridgecrest-clc-090"]
    >>> found = survey(block, {name: rocking.records.load(name) for name in names})
    >>> print(found.summary().splitlines()[0])
    rectangular block, 0.24 m x 1.1 m: 2 records, overturned by 1
    """
    checks.mapping(motions, "motions", InvalidOption, "{name: motion}")
    if friction is not None:
        friction_coefficient(friction)
    responses = []
    with Progress("simulating", total=len(motions), show=progress) as bar:
        for motion in motions.values():
            responses.append(simulate(block, motion, **options))
            _row(responses[-1])  # what takes long in it, the response keeps: while the bar is there
            bar.advance()
    return Survey(block, tuple(motions), tuple(responses), friction)


def record_columns(records: Sequence[str], motions: Sequence[Motion]) -> list[dict[str, str]]:
    """Name each record as it was asked for, and its motion as other analyses name it."""
    names, verticals = names_of(motions), verticals_of(motions)
    return [
        {"record": record, "motion": names[k], **{name: column[1][k] for name, column in verticals.items()}}
        for k, record in enumerate(records)
    ]


def block_columns(block: Block) -> dict[str, Any]:
    """Describe a block in the columns of a table."""
    columns = body_coordinates(Blocks.of(block))
    numbers = {named(name, about["units"]): float(values[0]) for name, (_, values, about) in columns.items()}
    return {"block": block.description, **numbers}


def motion_of(response: Response) -> Motion:
    """Return the motion of a response that has one."""
    assert response.motion is not None
    return response.motion


def _row(response: Response) -> dict[str, Any]:
    motion = motion_of(response)
    return {
        named("duration", "s"): motion.duration,
        named("pga", "g"): decimal(motion.pga / STANDARD_GRAVITY),
        named("pgv", "m/s"): motion.pgv,
        "processing": "; ".join(motion.history),
        "verdict": in_brief(response),
        "overturned": response.overturned,
        "unfinished": response.unfinished,
        "stopped": response.stopped,
        "ambiguous": response.ambiguous,
        named("overturn_time", "s"): response.overturn_time,
        "peak_over_slenderness": response.peak_over_slenderness,
        named("peak_rotation", "rad"): response.peak_rotation,
        named("peak_time", "s"): response.peak_time,
        "impacts_resolved": len(response.impacts),
        "rests": int((response.events["kind"] == "rest").sum()),
        named("time_at_rest", "s"): response.time_at_rest,
        "required_friction": response.required_friction,
    }
