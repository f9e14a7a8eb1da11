"""Plain text and CSV: one column of accelerations with dt=, times and accelerations, or as many as a heading names.

Columns and their units are what the heading says (`heading`), or units=; times are in seconds where it says nothing.
Heading lines and comments (#, %, !, //) are passed over, but no line that looks like a damaged row. The delimiter is a
semicolon (a comma is then the decimal sign), a comma, or blanks; between blanks a comma within a number is the decimal
sign. Numbers may be quoted, and exponents Fortran's (1.0D-3). Rows such as "1,5" in a file without any point, and
without two names above them, may be one number or two: they are refused.
"""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.errors import UnreadableRecord, literal
from rocking.records.formats.channel import (
    Channel,
    Recognised,
    channel_of,
    even_step,
    first_fault,
    gap_at,
    missing_value,
    prints_as,
)
from rocking.records.formats.heading import RULE, Heading, heading_of, names_columns
from rocking.records.formats.source import Line, Request, Source
from rocking.records.formats.values import NUMBER, convert, not_a_number, parse
from rocking.records.units import CHOICES, Unit

_DELIMITERS = {",": "a comma", ";": "a semicolon", " ": "a blank"}

#: Headings are no longer.
HEADING_LINES = 1000

#: What spreadsheets write after a # where they have no number.
_ERRORS = r"(?:(?:n/?a|nv)(?!\w)|div/0!|value!|ref!|num!|name\?|null!|wert!|zahl!)"
_COMMENT = re.compile(rf"[ \t]*(?:%|!|//|#(?!{_ERRORS}|#+[ \t]*(?:[,;\t]|$)))".encode(), re.IGNORECASE)
#: What begins like a number, or stands where one is missing.
_LIKE_NUMBER = re.compile(
    rf"[<>~]?[+-]*[.,]?\d.*|[*?-]+|##+|#{_ERRORS}|n/?a|nil|null|none|missing|bad|error|overflow|void", re.IGNORECASE
)
#: Letters that are taken for digits.
_MISTAKEN = str.maketrans("OolI", "0011")
_DIGIT_OR_POINT = re.compile(r"[\d.]|[Oo]$")
_DATE = re.compile(r"\d+[-/:]\d+[-/:T]\S*|\d{1,2}\.\d{1,2}\.\d{2}(?:\d\d)?")

#: No row of numbers is longer; what is, is refused before it is split.
_ROW_LIMIT = 1024
_WITHOUT_POINT = re.compile(r"[+-]?\d+(?:,\d+)?(?:[EeDd][+-]?\d+)?")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[EeDd][+-]?\d+)?")

#: What a unit of another quantity has.
_OF_OTHER_QUANTITY = re.compile(r".*[/%].*|m|cm|mm|in|ft|m?v|counts?|rad|deg", re.IGNORECASE)

_LENGTH_OR_SPEED = re.compile(r"(?:[muµ]?m|cm|in|ft)(?:/s(?:ec)?)?", re.IGNORECASE)

#: What a step is stated by, or a rate: "sampling interval (sec) : 0.01", "200 sps".
_STATES_STEP = re.compile(
    rf"({NUMBER})\s*(?:sps\b|samples?\s*(?:/|per)\s*s)|(?:sampl\w*[\s_-]*(?:rate|freq|interval|step|period|/\s*s)"
    r"|time[\s_-]*(?:step|interval)|\b(?:dt|delta[\s_-]?t)\b|intervals? of|(?:interval|vel|frec)\S* de muestreo)"
    r"(?:[^:=]*[:=])?(.*)",
    re.IGNORECASE,
)
#: Title of a table that ObsPy reads.
_OTHER_TITLE = "TIMESERIES "


class _Row(NamedTuple):
    tokens: list[bytes]
    at: int


class _Shape(NamedTuple):
    """How the rows are written, where the first one starts, and what is wrong with it or a row before it."""

    translation: bytes
    delimiter: str
    columns: int
    start: int
    fault: UnreadableRecord | None

    def ambiguous(self, source: Source, heading: Heading) -> bool:
        """Whether the commas may be decimal signs as well as delimiters: rows such as "1,5" and no point anywhere."""
        # A comma that blanks follow is no decimal sign, and one at the end of a row neither.
        return (
            self.delimiter == ","
            and self.columns <= 2
            and _DECIMAL_COMMA.fullmatch(source.line(self.start).text.strip().strip('"')) is not None
            and b"." not in source.data[self.start :]
            and not (self.columns == 2 and heading.named)
        )

    def row_at(self, source: Source, index: int) -> int:
        """Return the offset of a row."""
        return next(row.at for k, row in enumerate(_rows(source, self)) if k == index)


def recognise(source: Source) -> Recognised | None:
    """Return the format if rows of one or two numbers begin after comments and headings, or of more that are named."""
    shape = _shape(source)
    if shape is None:
        return None
    heading = heading_of(source, shape.start, shape.columns, shape.delimiter)
    if shape.columns > 2 and not heading.named:
        return None
    if shape.columns == 1:
        what = "one number"
    elif shape.ambiguous(source, heading):
        what = "one number with a decimal comma, or two numbers"
    else:
        what = f"{'two' if shape.columns == 2 else shape.columns} numbers, between them {_DELIMITERS[shape.delimiter]}"
    reason = f"from line {source.line_number(shape.start)} on each line holds {what}"
    return Recognised("text table", reason, functools.partial(_read, source, shape, heading))


def refusal(source: Source) -> UnreadableRecord | None:
    """Return why what looks like a table is not read as one, or None if it does not look so."""
    shape = _shape(source)
    if shape is not None:
        commas = shape.columns == 4 and b"." not in source.raw
        decimal = "; decimal commas need semicolons or tabs between columns" if commas else ""
        return shape.fault or source.error(
            f"each line holds {shape.columns} numbers, but a text table has one (acceleration) or two (time, "
            f"acceleration); keep only these, or name all {shape.columns} columns in a heading line{decimal}",
            shape.start,
        )
    if is_foreign(source) or source.binary_at() is not None:
        return None
    rows = [_row(line, _delimiter(line)[0]) for line in _filled(source.lines(0, HEADING_LINES))]
    for row, following in itertools.pairwise(rows):
        damaged = _damaged_in(row.tokens)
        if damaged and len(row.tokens) == len(following.tokens) and _damaged_in(following.tokens):
            return _not_in_row(source, damaged, row.at)
    return None


def is_foreign(source: Source) -> bool:
    """Whether the first line is the title of another format's table."""
    return any(line.text.startswith(_OTHER_TITLE) for line in source.lines(0, HEADING_LINES))


def _read(source: Source, shape: _Shape, heading: Heading, request: Request) -> list[Channel]:
    """Return the channels of the file: one, unless a heading names several."""
    if shape.fault is not None:
        raise shape.fault
    if shape.ambiguous(source, heading):
        raise source.error(
            f"{source.line(shape.start).text.strip()!r} may be one number with a decimal comma, or two numbers; write "
            "decimal points, or blanks between two numbers",
            shape.start,
        )
    table = _values(source, shape).reshape(-1, shape.columns)
    if heading.assumed and (fault := first_fault(table[:, 0])) is not None:
        heading = _without_times(source, request, shape, heading, fault)
    held = _channels(source, heading)
    if heading.doubtful and (shape.columns == 1 or heading.places("time")) and np.all(table[:, held] >= 0.0):
        text = "this seems to be a response spectrum: no value is negative, and no column is named 'time'"
        raise source.error(f"{text}; give accelerations at times, or name their column so", heading.at)
    if not heading.places("time"):
        _check_step(source, request.dt, shape)
    _check_columns(source, shape, heading, table)
    units = [_unit(source, request, heading, place, shape.start) for place in held]
    channels = []
    for number, (place, unit) in enumerate(zip(held, units, strict=True), 1):
        column = heading.columns[place]
        known = _timing(source, request, shape, heading, table, place)
        known |= {"name": source.stem if shape.columns <= 2 and len(held) == 1 else column.name, "number": number}
        named = column.strange if _OF_OTHER_QUANTITY.fullmatch(column.strange) else ""
        facts = {"heading units": column.unit.name if column.unit is not None else named}
        row_at = functools.partial(shape.row_at, source)
        values = table[:, place]
        channels.append(
            channel_of(source, "text table", values, unit, shape.start, facts=facts, row_at=row_at, **known)
        )
    return channels


def _check_columns(source: Source, shape: _Shape, heading: Heading, table: Floats) -> None:
    """Refuse times in an unclear unit, and row numbers that do not follow each other."""
    for place in heading.places("time"):
        column = heading.columns[place]
        if column.unit is None:
            raise source.error(
                f"the unit of the times is not clear from {column.strange!r} in the heading; name it in their column, "
                "as 'time (ms)': s, ms, us, ns, min, h or d",
                heading.at,
            )
    for place in heading.places("count"):
        steps = np.diff(table[:, place])
        if len(odd := np.flatnonzero(steps != steps[:1])):
            raise source.error(
                "the number of this row does not follow that of the row before; get a record without gaps",
                shape.row_at(source, int(odd[0]) + 1),
            )


def _without_times(source: Source, request: Request, shape: _Shape, heading: Heading, fault: int) -> Heading:
    """Return the heading of a table whose first column does not hold times, as was assumed, at a row that shows it."""
    if request.dt is None or not heading.named:
        named = "no column is named as that of times, and " if heading.named else ""
        raise source.error(
            f"{named}the time does not increase from the row before; correct the column of times, or give {{}} of a "
            "table without one, whose columns are named",
            shape.row_at(source, fault),
            "dt",
        )
    columns = [each._replace(kind="channel", unit=None) if each.kind == "time" else each for each in heading.columns]
    return replace(heading, columns=tuple(columns))


def _channels(source: Source, heading: Heading) -> list[int]:
    """Return the places of the accelerations: with a unit of acceleration if any has one, else without any unit."""
    channels = heading.places("channel")
    if heading.places("spectrum") and not (channels and heading.places("time")):
        name = heading.columns[heading.places("spectrum")[0]].name
        raise source.error(
            f"the column {name!r} is that of a spectrum; give a table of accelerations at times", heading.at
        )
    if not channels:
        raise source.error("the heading names no column of accelerations; name it so", heading.at)
    known = [place for place in channels if heading.columns[place].unit]
    return known or [place for place in channels if not heading.columns[place].strange] or channels


def _unit(source: Source, request: Request, heading: Heading, place: int, at: int) -> Unit:
    """Return the unit of a column of accelerations."""
    column = heading.columns[place]
    if column.strange and (request.unit is None or request.several):  # for several files: for those that do not say
        said = f"the heading says {column.strange!r}, which is no unit of"
        if _LENGTH_OR_SPEED.fullmatch(column.strange):
            raise source.error(f"{said} an acceleration; give a table of accelerations", heading.at)
        known = f"acceleration that is known here; give {{}} as one of {', '.join(CHOICES)}"
        raise source.error(f"{said} {known}", heading.at, "units")
    if request.several and column.unit is not None:
        return column.unit
    return request.units(source, column.unit if request.unit is None else None, at)  # what is given overrules it


def _check_step(source: Source, dt: float | None, shape: _Shape) -> None:
    """Refuse a table without times if no step is given, or another one than a line before the rows states."""
    said = "the file does not say its sampling step"
    for line in itertools.takewhile(lambda line: line.start < shape.start, source.lines(0, HEADING_LINES)):
        found = _STATES_STEP.search(line.text)
        numbers = re.findall(NUMBER, found[1] or found[2]) if found else []
        stated = literal(repr(line.text.strip()[:100]))
        if dt is not None and numbers and not any(_is_step(number, dt) for number in numbers):
            sentence = f"the heading says {stated}, not {{}} {dt:g} s; correct one of them"
            raise source.error(sentence, line.start, "dt", value=dt)
        said = f"no column holds times, but the heading says {stated}" if numbers else said
    if dt is None:
        raise source.error(f"{said}; give {{}} in seconds", shape.start, "dt")


def _is_step(number: str, dt: float) -> bool:
    """Whether a number may be a step (s): in s or ms, or as a rate, rounded as it is printed."""
    printed = Decimal(number.upper().replace("D", "E"))
    rounded = min(float(f"0.5e{printed.as_tuple().exponent}"), 0.03 * abs(float(printed)))
    return any(abs(each - float(printed)) <= rounded for each in (dt, 1e3 * dt, 1.0 / dt))


def _shape(source: Source) -> _Shape | None:
    lines = [] if source.is_binary else source.lines(0, HEADING_LINES)
    for k, line in enumerate(lines):
        if line.text.startswith(_OTHER_TITLE):
            return None
        translation, delimiter = _delimiter(line)
        tokens = _row(line, translation).tokens
        if tokens and not _is_comment(line) and all(parse(token) is not None for token in tokens):
            following = _filled(source.lines(line.next, 64))
            if delimiter == " " and len(tokens) > 1:
                # Between blanks commas may be decimal signs, in rows below the first one that has any.
                ways = (_delimiter(each) for each in following if "," in each.text)
                translation = next((way for way, sign in ways if sign == " "), translation)
            rows = [_row(each, translation) for each in (line, *following[:2])]
            counts = [len(row.tokens) for row in rows]
            odd = len(counts) == 3 and counts[0] != counts[1] == counts[2]
            columns = counts[1] if odd else counts[0]
            shape = _Shape(translation, delimiter, columns, line.start, None)
            fault = _fault_before(source, lines[:k], rows, shape)
            if fault is None and odd:
                fault = source.error(
                    f"columns in this row: {counts[0]}, in those below: {columns}; make all rows alike", line.start
                )
            return shape._replace(fault=fault)
    return None


def _is_comment(line: Line) -> bool:
    return _COMMENT.match(line.text.encode("latin-1")) is not None


def _filled(lines: Sequence[Line]) -> list[Line]:
    """Return the lines that hold more than a comment."""
    return [line for line in lines if not _is_comment(line) and not RULE.fullmatch(line.text)]


def _row(line: Line, translation: bytes) -> _Row:
    return _Row(line.text.encode("latin-1").translate(translation).split(), line.start)


def _fault_before(source: Source, before: Sequence[Line], rows: list[_Row], shape: _Shape) -> UnreadableRecord | None:
    """Return what is wrong with the first of the rows that end where numbers alone begin, or None if there are none."""
    fault = None
    for line in reversed(_filled(before)):
        tokens = _row(line, shape.translation).tokens
        damaged = (
            _damaged_in(tokens, shape.columns)
            or _damaged_before(tokens, rows, shape.columns)
            or _damaged_below_names(line, tokens, before, shape)
        )
        if not damaged:
            break
        fault = _not_in_row(source, damaged, line.start)
    return fault


def _damaged_in(tokens: list[bytes], columns: int = 0) -> bytes:
    """Return the first piece that is no number, of a line of numbers and what stands in place of some; or nothing."""
    damaged = [token for token in tokens if parse(token) is None]
    numbers = len(tokens) - len(damaged)
    # What is that long is a number or nothing, and what follows it on its line is not seen.
    fits = numbers > 0 or len(tokens) == columns or max(map(len, tokens), default=0) > 300
    return damaged[0] if damaged and fits and all(map(_like_number, damaged)) else b""


def _like_number(token: bytes) -> bool:
    text = token.decode("latin-1")
    is_mistaken = _DIGIT_OR_POINT.search(text) and parse(text.translate(_MISTAKEN).encode("latin-1")) is not None
    return bool(is_mistaken or _LIKE_NUMBER.fullmatch(text))


def _damaged_before(tokens: list[bytes], rows: list[_Row], columns: int) -> bytes:
    """Return the first piece that is no number, of a line whose time is one step before that of the rows below it."""
    times = [
        time for each in (tokens, *(row.tokens for row in rows[:2])) if each and (time := parse(each[0])) is not None
    ]
    if columns == 1 or len(times) < 3:
        return b""
    before, first, second = times
    follows = second > first and abs((first - before) - (second - first)) <= 0.5 * (second - first)
    return next((token for token in tokens if parse(token) is None), b"") if follows else b""


def _damaged_below_names(line: Line, tokens: list[bytes], before: Sequence[Line], shape: _Shape) -> bytes:
    """Return the first piece that is no number, of a line with as many cells as columns, one of them a number.

    It is no heading if one stands above it; without one, if a number has a point and more than blanks are between them.
    """
    numbers = [token for token in tokens if parse(token) is not None]
    cells = len(tokens) if shape.delimiter == " " else line.text.rstrip(shape.delimiter).count(shape.delimiter) + 1
    if shape.columns == 1 or not numbers or shape.columns not in (len(tokens), cells) or _names_columns(line, shape):
        return b""
    above = (each for each in before if each.start < line.start)
    divided = shape.delimiter != " " and any(b"." in number for number in numbers)
    if not divided and not any(_names_columns(each, shape) for each in above):
        return b""
    return next((token for token in tokens if parse(token) is None), b"")


def _names_columns(line: Line, shape: _Shape) -> bool:
    return names_columns(line.text.encode("latin-1"), shape.columns, shape.delimiter)


def _not_in_row(source: Source, token: bytes, at: int) -> UnreadableRecord:
    shown = token[:40].decode("latin-1")
    if _DATE.fullmatch(shown):
        return source.error(f"{shown!r} is not a number; write times in seconds, not as dates or times of day", at)
    return source.error(
        f"{shown!r} is not a number, in what looks like a row of them; correct it, or begin the line with # if it is a "
        "heading",
        at,
    )


def _delimiter(line: Line) -> tuple[bytes, str]:
    """Return what turns a row into numbers with points between blanks, and the delimiter."""
    if ";" in line.text:
        return bytes.maketrans(b',;"', b".  "), ";"
    words = line.text.replace('"', " ").split()
    if len(words) > 1 and "," in line.text and all(map(_WITHOUT_POINT.fullmatch, words)):
        return bytes.maketrans(b',"', b". "), " "
    if "," in line.text:
        return bytes.maketrans(b',"', b"  "), ","
    return bytes.maketrans(b'"', b" "), " "


def _values(source: Source, shape: _Shape) -> Floats:
    """Return all numbers, row by row."""
    rows, parts = _rows(source, shape), []
    while group := list(itertools.islice(rows, 5000)):
        values = convert([token for row in group for token in row.tokens])
        if values is None or any(len(row.tokens) != shape.columns for row in group):
            raise _first_bad(source, group, shape)
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


def _timing(
    source: Source, request: Request, shape: _Shape, heading: Heading, table: Floats, place: int
) -> dict[str, Any]:
    """Return step or times, and start (s), from the nearest column of times before a channel, or else the first one."""
    columns = heading.places("time")
    if not columns:
        return {"dt": request.dt}
    column = max((each for each in columns if each < place), default=columns[0])
    unit, written = heading.columns[column].unit, table[:, column]
    assert unit is not None
    times = unit.to_si(written)
    start = float(times[0])
    fault = first_fault(times)
    step = even_step(written) if fault is None and len(written) > 1 else None
    if step is not None:
        return {"dt": request.step(source, step * unit.multiplier / unit.divisor, shape.start), "start": start}
    given = None if request.several else request.dt
    if given is not None and prints_as(written, given * unit.divisor / unit.multiplier):
        return {"dt": given, "start": start}
    if fault is not None:
        same = "; if the times are even, but printed with too few digits, give {}" if given is None else ""
        raise source.error(
            f"the time does not increase from the row before; correct the column of times{same}",
            shape.row_at(source, fault),
            *(("dt",) if same else ()),
        )
    gap = gap_at(written)
    if gap is not None:
        raise missing_value(source, written[gap], shape.row_at(source, gap))
    if given is not None:
        raise source.error(f"the times are not evenly {given:g} s apart; leave {{}} out", shape.start, "dt")
    return {"times": times, "start": start}
