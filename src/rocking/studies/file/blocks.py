"""Blocks of a study's file: of every combination of their parameters, held back or not, or from a table."""

from __future__ import annotations

import contextlib
import inspect
import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Block, Blocks, RestrainedBlock, Restraint
from rocking.body import Bodies
from rocking.errors import Message, RockingError, StudyError
from rocking.plausibility import block_notes, restraint_notes
from rocking.progress import note
from rocking.studies.file.tables import (
    BODIES,
    COUPLES,
    FORCES,
    HELD,
    MASSIVE,
    PARAMETERS,
    Tables,
    line_of,
    listed,
    moved,
    nearest,
    number,
    read,
)
from rocking.tables import counted, csv_rows

#: What both sides of a block may have of their own, in columns of a table that end so.
_SIDED: Final = ("p", "alpha", "pivots", "restitution")
_SIDES: Final = ("_plus", "_minus")

#: Blocks that are looked at for what looks like a mistake.
_NOTED: Final = 100


def blocks_of(tables: Tables) -> Bodies:
    """Blocks of all combinations of what [blocks] gives, or of the table that it names."""
    given = dict(tables.table("blocks"))
    held = {name: given.pop(name) for name in HELD if name in given}
    if held and not {*MASSIVE} & given.keys():
        first = next(iter(held))
        raise tables.wrong("blocks", first, f"{{}} goes with {listed(MASSIVE)} of a block", first)
    if "csv" in given:
        if len(given) > 1:
            raise tables.wrong("blocks", "csv", "{} goes without other keys", "csv")
        return _blocks_of_csv(tables, tables.file.parent / given["csv"])
    if not any({*needed} <= given.keys() <= {*needed, *more} for needed, more in BODIES.items()):
        choices = ", or ".join(map(listed, BODIES))
        having = f"; it has {listed([*given])}" if given else ""
        raise tables.wrong("blocks", None, f"[blocks] needs {choices}, or csv{having}")
    axes: dict[str, Any] = {
        name: _pivots(tables, value) if name == "pivots" else tables.numbers("blocks", name, value)
        for name, value in given.items()
    }
    restraints = _restraints(tables, held)
    lean = tables.numbers("blocks", "lean", held["lean"]) if "lean" in held else [0.0]
    with tables.located("blocks"):
        if "p" in axes:
            return Blocks.grid(**axes)
        checks.grid_size({name: len(axis) for name, axis in axes.items()}, StudyError)
        rows = [dict(zip(axes, row, strict=True)) for row in itertools.product(*axes.values())]
        if not held:
            return Blocks.of(_noted([_body(row) for row in rows]))
        checks.grid_size({"body": len(rows) * len(lean) * math.prod(map(len, restraints))}, StudyError)
        bodies = [
            RestrainedBlock(
                _body(row), *chosen, one_sided=held.get("one_sided", False), lean=angle,
                restitution=row.get("restitution"),
            )
            for row, angle, *chosen in itertools.product(rows, lean, *restraints)
        ]  # fmt: skip
        _noted([body.block for body in bodies[:_NOTED]])
        _say(restraint_notes(body, _height(body.block)) for body in bodies[:_NOTED])
        return Blocks.of(bodies)


def _noted(blocks: list[Block]) -> list[Block]:
    """Return blocks, with notes on what looks like a mistake in the first of them."""
    _say(block_notes(block) for block in blocks[:_NOTED])
    return blocks


def _height(block: Block) -> float | None:
    return None if block.half_height is None else 2.0 * block.half_height


def _say(notes: Iterable[Sequence[Message | str]]) -> None:
    """Note each sentence once."""
    for sentence in {str(each): each for some in notes for each in some}.values():
        note(sentence)


def _restraints(tables: Tables, held: Mapping[str, Any]) -> list[list[Restraint]]:
    """Return what each restraint may be: one, or several where its numbers are lists or ranges."""
    found: list[list[Restraint]] = []
    for name, couple in COUPLES.items():
        if name in held:
            with tables.located("blocks", key=name):
                found.append([couple(value) for value in read(name, held[name]).tolist()])
    for name, kind in FORCES.items():
        for k, given in enumerate(held.get(name, [])):
            table, known = f"blocks.{name}", inspect.signature(kind).parameters
            axes: dict[str, Any] = {}
            for key, value in given.items():
                with tables.located(table, key=key, occurrence=k):
                    if key not in known:
                        raise StudyError(f"[[{table}]] has no {{}}; {nearest(key, known)}", key)
                    axes[key] = [value] if isinstance(value, bool) else read(key, value).tolist()
            with tables.located(table, occurrence=k):
                missing = [key for key, each in known.items() if each.default is each.empty and key not in axes]
                if missing:
                    raise StudyError(f"[[{table}]] needs {listed(missing)} as well")
                rows = itertools.product(*axes.values())
                found.append([kind(**dict(zip(axes, row, strict=True))) for row in rows])
    return found


def _pivots(tables: Tables, value: Any) -> list[Floats]:
    """Pairs of distances: one, or several."""
    pairs = value if isinstance(value, list) and value and isinstance(value[0], list) else [value]
    with tables.located("blocks", key="pivots"):
        found = [read("pivots", pair) for pair in pairs]
        if any(len(pair) != 2 for pair in found):
            raise StudyError(
                "{} must be a pair, [0.2, 0.15] (side +, side -), or a list of pairs", "pivots", value=value
            )
        return found


def _blocks_of_csv(tables: Tables, table: Path) -> Blocks:
    try:
        rows = csv_rows(table.read_text("utf-8-sig"))
    except OSError as error:
        raise tables.wrong("blocks", "csv", f"{table} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise tables.wrong("blocks", "csv", f"{table} is no text table in UTF-8; save it as CSV") from None
    headings, rows = (rows[0][1], rows[1:]) if len(rows) > 1 else (list[str](), [])
    _check_headings(tables, table, headings)
    columns = _columns(table, headings, rows)
    if not any({*needed} <= columns.keys() <= {*needed, *more} for needed, more in BODIES.items()):
        having = f"; it has {listed([*columns])}" if columns else ""
        raise tables.wrong(
            "blocks",
            "csv",
            f"{table} needs columns p (rad/s) and alpha (rad, or 12deg), or width and height (m), or pivots_plus, "
            f"pivots_minus, height_of_mass and gyration (m), and rows{having}",
        )
    if "p" in columns:
        try:
            return Blocks(**columns)
        except RockingError as error:
            where = f"{table}, whose block 0 is in line {rows[0][0]}: "
            line = line_of(tables.text, "blocks", "csv", 0)
            raise moved(error, StudyError, tables.file, line, where) from None
    bodies = []
    for (line, _), values in zip(rows, zip(*columns.values(), strict=True), strict=True):
        with _in_table(table, line):
            bodies.append(_body(dict(zip(columns, values, strict=True))))
    return Blocks.of(_noted(bodies))


def _columns(table: Path, headings: Sequence[str], rows: Sequence[tuple[int, list[str]]]) -> dict[str, Any]:
    """Numbers of each column that says something of a block; those of both sides beside each other."""
    for line, row in rows:
        with _in_table(table, line):
            if len(row) != len(headings):
                raise StudyError(f"{counted(len(row), 'cell')} under {counted(len(headings), 'column')}; correct it")
    columns: dict[str, Any] = {}
    for name in PARAMETERS:
        ends = _SIDES if name in _SIDED and name + _SIDES[0] in headings else ("",)
        if all(name + end in headings for end in ends):
            places = [headings.index(name + end) for end in ends]
            cells = []
            for line, row in rows:
                with _in_table(table, line):
                    cells.append([number(name, row[k]) for k in places])
            columns[name] = np.squeeze(cells, axis=1) if len(ends) == 1 else np.array(cells)
    return columns


def _check_headings(tables: Tables, table: Path, headings: Sequence[str]) -> None:
    """Refuse columns that are there twice, or that a block could have and this table cannot say."""
    known = [*PARAMETERS, *(name + end for name in _SIDED for end in _SIDES)]
    for name in dict.fromkeys(headings):
        fault = ""
        if name in known and headings.count(name) > 1:
            fault = "is there twice"
        elif name in HELD:
            fault = "cannot be given in a table: give it under [blocks]"
        elif name not in known and (meant := checks.meant(name, known, "")):
            fault = f"is no column of blocks; {meant}"
        if fault:
            raise tables.wrong("blocks", "csv", f"column {name} of {table} {fault}")


@contextlib.contextmanager
def _in_table(table: Path, line: int) -> Iterator[None]:
    """Give a mistake the line of a table of blocks."""
    try:
        yield
    except RockingError as error:
        raise moved(error, StudyError, table, line) from None


def _body(given: Mapping[str, Any]) -> Block:
    """Rectangle or body on pivots from one value of each."""
    if "width" in given:
        return Block(**given)
    return Block.from_pivots(
        given["pivots"],
        given["height_of_mass"],
        given["gyration"],
        restitution=given.get("restitution"),
        mass=given.get("mass"),
    )
