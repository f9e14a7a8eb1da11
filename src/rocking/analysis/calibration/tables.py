"""What `rocking calibrate` reads: a CSV table of outcomes, or of a measured rotation history."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from rocking.arrays import Floats
from rocking.errors import RockingError, UnreadableRecord
from rocking.motion.motion import Motion
from rocking.motion.named import named_motion

#: The decimal comma of a number.
_DECIMAL_COMMA: Final = re.compile(r"(?<=\d),(?=\d+(?:[eE][+-]?\d+)?$)")

_FOLDER: Final = re.compile(r"[\w-][\w. -]*(?<![. ])")

_ANSWERS: Final = {"1": True, "0": False, "true": True, "false": False, "yes": True, "no": False}


@dataclass(frozen=True)
class Outcomes:
    """Tests of one specimen: motions, whether each overturned it, and what to leave out together."""

    motions: tuple[Motion, ...]
    overturned: tuple[bool, ...]
    groups: tuple[str, ...] | None


@dataclass(frozen=True, eq=False)
class History:
    """Measured rotation: times (s) and rotations (rad)."""

    times: Floats
    rotation: Floats


@dataclass(frozen=True)
class _Table:
    path: Path
    columns: tuple[str, ...]
    #: Line number and cells of each row.
    rows: tuple[tuple[int, dict[str, str]], ...]

    def numbers(self, column: str) -> Floats:
        return np.array([self.convert(line, row[column], float, "a number") for line, row in self.rows])

    def convert(self, line: int, text: str, how: Callable[[str], Any], what: str) -> Any:
        try:
            return how(text)
        except (ValueError, KeyError):
            raise UnreadableRecord(f"{self.path}, line {line}: {text!r} is not {what}; correct it") from None


def read(
    path: Path, *, channel: str | None, dt: float | None, units: str | None
) -> Outcomes | dict[str, Outcomes] | History:
    """Read a table; its columns say what it is.

    Outcomes: `motion` (a record file, relative to the table's folder, or a shipped record) and `overturned` (1 or 0,
    yes or no); also, if there are such columns, `scale`, `channel` and `group`. With a column `specimen`, outcomes of
    several specimens by their names. A history: `time_s`, and `rotation_rad` or `rotation_deg`.

    Raises
    ------
    UnreadableRecord
        If it is no such table, or a cell or a record cannot be read; the message has the line.
    """
    table = _table(path)
    if {"motion", "overturned"} <= set(table.columns):
        about = {"channel": channel, "dt": dt, "units": units}
        if "specimen" not in table.columns:
            return _outcomes(table, **about)
        return {name: _outcomes(each, **about) for name, each in _by_specimen(table).items()}
    for column, unit in (("rotation_rad", 1.0), ("rotation_deg", np.pi / 180.0)):
        if {"time_s", column} <= set(table.columns):
            return History(table.numbers("time_s"), unit * table.numbers(column))
    raise UnreadableRecord(
        f"{path}, line 1: the columns must be motion,overturned (outcomes) or time_s,rotation_rad or "
        "time_s,rotation_deg (a history), "
        f"not {','.join(table.columns)}"
    )


def _table(path: Path) -> _Table:
    try:
        text = path.read_text("utf-8-sig")
    except OSError as error:
        raise UnreadableRecord(f"{path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UnreadableRecord(f"{path} is no text table; save it as CSV") from None
    lines = text.splitlines()
    # As record tables: semicolons separate where the header has one, and a comma is then the decimal sign.
    semicolons = bool(lines) and ";" in lines[0]
    reader = csv.reader(lines, delimiter=";" if semicolons else ",")
    cells = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(cell.strip() for cell in row)]
    if len(cells) < 2:
        raise UnreadableRecord(f"{path} holds no rows below its header")
    (_, columns), *rows = cells
    if semicolons:
        rows = [(line, [_DECIMAL_COMMA.sub(".", cell) for cell in row]) for line, row in rows]
    for line, row in rows:
        if len(row) != len(columns):
            raise UnreadableRecord(f"{path}, line {line}: {len(row)} cells under {len(columns)} columns; correct it")
    named = tuple((line, dict(zip(columns, row, strict=True))) for line, row in rows)
    return _Table(path, tuple(columns), named)


def _by_specimen(table: _Table) -> dict[str, _Table]:
    """Rows of each specimen, in the order in which the specimens come."""
    rows: dict[str, list[tuple[int, dict[str, str]]]] = {}
    for line, row in table.rows:
        name = table.convert(line, row["specimen"], _folder_name, "the name of a specimen (letters, digits, . _ -)")
        rows.setdefault(name, []).append((line, row))
    return {name: replace(table, rows=tuple(some)) for name, some in rows.items()}


def _folder_name(text: str) -> str:
    """Name that can also be that of a folder."""
    if not _FOLDER.fullmatch(text):
        raise ValueError(text)
    return text


def _outcomes(table: _Table, *, channel: Any, dt: Any, units: Any) -> Outcomes:
    motions, overturned = [], []
    for line, row in table.rows:
        overturned.append(
            table.convert(line, row["overturned"].lower(), _ANSWERS.__getitem__, "0 or 1, no or yes, false or true")
        )
        scale = table.convert(line, row.get("scale") or "1", float, "a number")
        name = _file_or_name(row["motion"], table.path.parent)
        wanted = row.get("channel") or channel
        try:
            motions.append(named_motion(name, channel=wanted, dt=dt, units=units, scale=scale))
        except RockingError as error:
            raise UnreadableRecord(f"{table.path}, line {line}: {error}") from error
    groups = tuple(row["group"] for _, row in table.rows) if "group" in table.columns else None
    return Outcomes(tuple(motions), tuple(overturned), groups)


def _file_or_name(name: str, folder: Path) -> str:
    beside = folder / name
    return str(beside) if beside.exists() else name
