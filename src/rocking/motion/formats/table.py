"""Plain text and CSV: one column of accelerations with dt=, times and accelerations, or as many as a heading names.

Units are those that a heading names, in brackets or after an underscore, or units=. Heading lines and comments (#, %,
!, //) are passed over. The delimiter is a semicolon (a comma is then the decimal sign), a comma, or blanks; between
blanks a comma within a number is the decimal sign. Numbers may be quoted, and exponents Fortran's (1.0D-3). Rows such
as "1,5" in a file without any point may be one number or two: they are refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.errors import UnreadableRecord
from rocking.motion.formats.channel import Channel, to_acceleration
from rocking.motion.formats.identification import Identification
from rocking.motion.formats.request import Request
from rocking.motion.formats.source import Line, Source
from rocking.motion.formats.timing import even_step, first_fault
from rocking.motion.formats.units import Unit, find_unit
from rocking.motion.formats.values import convert, not_a_number, parse, rows_of_numbers

NAME = "text table"

_COMMA = "a comma"

_HEADING_LINES = 64
_LINES_AT_ONCE = 50_000
_LONGEST_HEADING = 10_000
_BRACKETS = re.compile(r"[(\[]\s*([A-Za-z][\w/^*.·⁻ -]{0,20}?)\s*[)\]]")
_SUFFIX = re.compile(r"(?<=[A-Za-z0-9])_(?=([A-Za-z]\w{0,12})\b)")
_COMMENT = re.compile(rb"[ \t]*(#|%|!|//)")

#: No row of numbers is longer; what is, is refused before it is split.
_ROW_LIMIT = 1024
_WITHOUT_POINT = re.compile(r"[+-]?\d+(?:,\d+)?(?:[EeDd][+-]?\d+)?")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[EeDd][+-]?\d+)?")

#: Titles of other formats' tables, which ObsPy reads.
_OTHER_TITLES = ("TIMESERIES ",)


class _Shape(NamedTuple):
    """How the rows are written, and where the first one starts."""

    translation: bytes
    delimiter: str
    columns: int
    start: int

    def ambiguous(self, source: Source) -> bool:
        """Whether the commas may be decimal signs as well as delimiters: rows such as "1,5" and no point anywhere."""
        # A comma that blanks follow is no decimal sign, and one at the end of a row neither.
        return (
            self.delimiter == _COMMA
            and self.columns <= 2
            and _DECIMAL_COMMA.fullmatch(source.line(self.start).text.strip().strip('"')) is not None
            and b"." not in source.data[self.start :]
        )


class _Row(NamedTuple):
    tokens: list[bytes]
    at: int


class _Column(NamedTuple):
    """A column of accelerations: its place in a row, its name, and the unit that its heading names."""

    place: int
    name: str
    unit: Unit | None


def recognise(source: Source) -> Identification | None:
    """Return the format if rows of one or two numbers begin after comments and headings, or of more that are named."""
    shape = _shape(source)
    if shape is None or not _columns(source, shape):
        return None
    if shape.columns == 1:
        what = "one number"
    elif shape.ambiguous(source):
        what = "one number with a decimal comma, or two numbers"
    else:
        what = f"{'two' if shape.columns == 2 else shape.columns} numbers, between them {shape.delimiter}"
    return Identification(NAME, f"from line {source.line_number(shape.start)} on each line holds {what}")


def columns(source: Source) -> int | None:
    """Return how many numbers the first row of what looks like a table holds, or None."""
    shape = _shape(source)
    return None if shape is None else shape.columns


def is_foreign(source: Source) -> bool:
    """Whether the first line is the title of another format's table."""
    return any(line.text.startswith(_OTHER_TITLES) for line in source.lines(0, _HEADING_LINES))


def read(source: Source, request: Request) -> list[Channel]:
    """Return the channels of the file: one, unless a heading names several.

    Raises
    ------
    UnreadableRecord
        If units are not known, or dt is not given for a single column, or a row is not like the first one, or
        times do not increase, or it cannot be told whether commas are decimal signs.
    """
    shape = _shape(source)
    assert shape is not None
    if shape.ambiguous(source):
        raise source.error(
            f"{source.line(shape.start).text.strip()!r} may be one number with a decimal comma, or two numbers; write "
            "decimal points, or blanks between two numbers",
            shape.start,
        )
    if shape.columns == 1 and request.dt is None:
        raise source.error("the file does not say its sampling step; give dt= in seconds", shape.start)
    held = _columns(source, shape)
    units = [request.units_by_heading(source, column.unit, shape.start) for column in held]
    values = _values(source, shape)
    dt, times = request.dt, None
    if shape.columns > 1:
        dt, times = _timing(source, request, shape, values[0 :: shape.columns])
    channels = []
    for number, (column, unit) in enumerate(zip(held, units, strict=True), 1):
        facts = {"format": NAME, "file": source.file}
        facts |= {"heading units": column.unit.name} if column.unit else {}
        acceleration = to_acceleration(source, shape.start, values[column.place :: shape.columns], unit)
        channels.append(Channel(column.name, number, acceleration, dt, times, units=unit.name, metadata=facts))
    return channels


def _columns(source: Source, shape: _Shape) -> list[_Column]:
    """Columns of accelerations; of more than two those that a heading names, with a unit of acceleration if any has."""
    heading = _decoded(source.data[: min(shape.start, _LONGEST_HEADING)])
    if shape.columns <= 2:
        return [_Column(shape.columns - 1, source.stem, _unit_in(heading))]
    lines = [line.strip().lstrip("#%!/").strip() for line in heading.splitlines() if line.strip()]
    names = _cells(lines[-1], shape.columns) if lines else []
    found = [_Column(k, _BRACKETS.sub("", name).strip(), _unit_in(name)) for k, name in enumerate(names)][1:]
    return [column for column in found if column.unit] or found


def _cells(line: str, count: int) -> list[str]:
    """Return the names in a heading of so many columns, or none where it cannot be split so."""
    for delimiter in (r";", r",", r"\t+", r"\s{2,}", r"\s+"):
        cells = [cell.strip().strip('"').strip() for cell in re.split(delimiter, line)]
        if len(cells) == count and all(cells):
            return cells
    return []


def _unit_in(heading: str) -> Unit | None:
    """Return the one unit of acceleration that a heading names in brackets or after an underscore, or None."""
    words = [*_BRACKETS.findall(heading), *_SUFFIX.findall(heading)]
    units = {unit for word in words if (unit := find_unit(word)) is not None}
    return units.pop() if len(units) == 1 else None


def _decoded(heading: bytes) -> str:
    try:
        return heading.decode("utf-8")
    except UnicodeDecodeError:
        return heading.decode("latin-1")


def _shape(source: Source) -> _Shape | None:
    for line in source.lines(0, _HEADING_LINES):
        text = line.text.encode("latin-1")
        if line.text.startswith(_OTHER_TITLES):
            return None
        translation, delimiter = _delimiter(line)
        tokens = text.translate(translation).split()
        if tokens and not _COMMENT.match(text) and all(parse(token) is not None for token in tokens):
            return _Shape(translation, delimiter, len(tokens), line.start)
    return None


def _delimiter(line: Line) -> tuple[bytes, str]:
    """Return what turns a row into numbers with points between blanks, and the delimiter's name."""
    if ";" in line.text:
        return bytes.maketrans(b',;"', b".  "), "a semicolon"
    words = line.text.replace('"', " ").split()
    if len(words) > 1 and "," in line.text and all(map(_WITHOUT_POINT.fullmatch, words)):
        return bytes.maketrans(b',"', b". "), "a blank"
    if "," in line.text:
        return bytes.maketrans(b',"', b"  "), _COMMA
    return bytes.maketrans(b'"', b" "), "a blank"


def _values(source: Source, shape: _Shape) -> Floats:
    """Return all numbers, row by row: at once where there is nothing but rows, else one row after the other."""
    plain = rows_of_numbers(source, shape.start, shape.columns, shape.translation, _ROW_LIMIT)
    if plain is not None:
        return plain
    parts = []
    for rows in _groups(_rows(source, shape), shape.columns):
        values = convert([token for row in rows for token in row.tokens])
        if values is None or any(len(row.tokens) != shape.columns for row in rows):
            raise _first_bad(source, rows, shape)
        parts.append(values)
    return np.concatenate(parts)


def _rows(source: Source, shape: _Shape) -> Iterator[_Row]:
    data, start = source.data, shape.start
    while start < len(data):
        end = data.find(b"\n", start)
        end = len(data) if end < 0 else end
        line = data[start:end].strip()
        if line and not _COMMENT.match(line):
            if len(line) > _ROW_LIMIT:
                raise source.error(f"this row is {len(line)} characters long; make all rows alike", start)
            tokens = line.translate(shape.translation).split()
            if tokens:
                yield _Row(tokens, start)
        start = end + 1


def _groups(rows: Iterator[_Row], columns: int) -> Iterator[list[_Row]]:
    """Rows in groups, each of which ends with the first row that is not like the others."""
    group: list[_Row] = []
    for row in rows:
        group.append(row)
        if len(group) == _LINES_AT_ONCE or len(row.tokens) != columns:
            yield group
            group = []
    if group:
        yield group


def _first_bad(source: Source, rows: list[_Row], shape: _Shape) -> UnreadableRecord:
    for row in rows:
        for token in row.tokens:
            number = parse(token)
            if number is None or not np.isfinite(number):
                return not_a_number(source, token, row.at)
        if len(row.tokens) != shape.columns:
            return source.error(
                f"columns in this row: {len(row.tokens)}, in the first: {shape.columns}; make all rows alike", row.at
            )
    raise AssertionError("among rows that do not convert one is bad")


def _timing(source: Source, request: Request, shape: _Shape, times: Floats) -> tuple[float | None, Floats | None]:
    fault = first_fault(times)
    if fault is not None:
        at = next(row.at for index, row in enumerate(_rows(source, shape)) if index == fault)
        raise source.error("the time does not increase from the row before; mend the first column", at)
    dt = even_step(times) if len(times) > 1 else None
    if dt is not None:
        return request.step(source, dt, shape.start), None
    if request.dt is not None:
        raise source.error(f"the times are not evenly {request.dt:g} s apart; leave dt out", shape.start)
    return None, times
