"""Plain text and CSV: accelerations with dt=, times and accelerations, or the columns named by a heading.

Columns and units come from the heading (`heading`) or units=. Times are in seconds by default. Heading lines and
comments (#, %, !, //) are skipped, except lines that look like a damaged row. The delimiter is a semicolon (a comma is
then the decimal sign), a comma, or blanks. Between blanks a comma within a number is the decimal sign. Numbers may be
quoted and may have Fortran exponents (1.0D-3). Rows such as "1,5" in a file without any point, and without two names
above, are ambiguous and rejected.
"""

from __future__ import annotations

import functools
import io
import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.errors import RecordError, escape_braces
from rocking.records.formats.channel import (
    Channel,
    Identification,
    Recognised,
    create_channel,
    find_first_fault,
    fit_even_step,
    resolve_timing,
)
from rocking.records.formats.heading import RULE_PATTERN, Heading, parse_heading
from rocking.records.formats.numbers import (
    NUMBER,
    StatedCount,
    compute_rounding,
    convert_tokens,
    invalid_number_error,
    parse_token,
    read_values,
)
from rocking.records.formats.source import Line, Request, Source

_DELIMITERS: Final = {",": "a comma", ";": "a semicolon", " ": "a blank"}

#: Largest number of heading lines.
HEADING_LINES: Final = 1000
#: Longest row of numbers. Longer lines are rejected before splitting.
_MAX_ROW_LENGTH: Final = 1024
#: Text after a longer piece on its line may not be seen.
_LONG_LINE_LENGTH: Final = 300

#: Error values of spreadsheets after a #.
_ERROR_VALUES: Final = r"(?:(?:n/?a|nv)(?!\w)|div/0!|value!|ref!|num!|name\?|null!|wert!|zahl!)"
_COMMENT: Final = re.compile(rf"[ \t]*(?:%|!|//|#(?!{_ERROR_VALUES}|#+[ \t]*(?:[,;\t]|$)))".encode(), re.IGNORECASE)
#: Text that begins like a number, or stands for a missing number.
_LIKE_NUMBER: Final = re.compile(
    rf"(?i)[<>~]?[+-]*[ool]?[.,]?\d.*|[*?-]+|##+|#{_ERROR_VALUES}|n/?a|nil|null|none|missing|bad|error|overflow|void"
)
_WITHOUT_POINT: Final = re.compile(r"[+-]?\d+(?:,\d+)?(?:[EeDd][+-]?\d+)?")
_DECIMAL_COMMA: Final = re.compile(r"[+-]?\d*,\d+(?:[EeDd][+-]?\d+)?")

#: Pattern of a unit of another quantity.
_OTHER_UNIT: Final = re.compile(r"(?i).*[/%].*|m|cm|mm|in|ft|m?v|counts?|rad|deg")
#: Pattern of a unit that is surely none of acceleration, unlike unknown spellings such as "cm/seg2" or "% of g".
_NON_ACCELERATION_UNIT: Final = re.compile(r"(?i)(?:[muµk]?m|cm|in|ft|rad|deg)(?:/s(?:ec)?)?")
#: Step or rate in a heading.
_STEP_STATEMENT: Final = re.compile(
    rf"({NUMBER})\s*(?:sps\b|samples?\s*(?:/|per)\s*s)|(?:sampl\w*[\s_-]*(?:rate|freq|interval|step|period|/\s*s)"
    r"|time[\s_-]*(?:step|interval)|\b(?:dt|delta[\s_-]?t)\b|intervals? of|(?:interval|vel|frec)\S* de muestreo)"
    r"(?:[^:=]*[:=])?(.*)",
    re.IGNORECASE,
)
#: Time of the day at the start of a row, possibly after a date, and its name in a heading.
_CLOCK_PATTERN: Final = re.compile(
    rb"(?m)^[ \t\"]*(?:(\d{4})[-/](\d\d?)[-/](\d\d?)[T ])?(\d{1,2}):(\d\d):(\d\d)([.,]\d+)?Z?\"?(?=[ \t,;])"
)
_CLOCK_HEADING: Final = re.compile(rb"(?i)[(\[](?:[ymd]+[-/][ymd]+[-/][ymd]+[t ])?hh:mm:ss[.\w]*[)\]]")
#: Title of a table that ObsPy reads.
OBSPY_TITLE: Final = "TIMESERIES "


class _TextTable(NamedTuple):
    """Table of numbers in a text file."""

    source: Source  # file
    translation: bytes  # translation of a row into numbers with points between blanks
    delimiter: str  # sign between the numbers of a row
    column_count: int
    start: int  # offset of the first row
    damaged_token: tuple[bytes, int] | None  # invalid number in a row before it, and the offset of that row
    heading: Heading  # names and units of the columns

    def _is_ambiguous(self, row: str) -> bool:
        """Return whether commas may be decimal signs or delimiters, as in the row "1,5" of a file without points."""
        # A comma before blanks or at the end of a row is not a decimal sign.
        return (
            self.delimiter == ","
            and self.column_count <= 2
            and _DECIMAL_COMMA.fullmatch(row.strip('"')) is not None
            and b"." not in self.source.data[self.start :]
            and not (self.column_count == 2 and self.heading.has_names)
        )

    def identify(self, name: str) -> Identification:
        """Return the format of this name with the content of rows as reason."""
        numbers = f"{self.column_count} numbers, between them {_DELIMITERS[self.delimiter]}"
        numbers = "one number" if self.column_count == 1 else numbers
        return Identification(
            name, f"from line {self.source.find_line_number(self.start)} on each line holds {numbers}"
        )

    def read(self, request: Request) -> list[Channel]:
        """Return the channels of the file: one, unless a heading names several."""
        source = self.source
        if self.damaged_token is not None:
            token, offset = self.damaged_token
            text = f"{token[:40].decode('latin-1')!r} is not a number, but this line resembles a row of numbers"
            raise source.error(f"{text}; correct it, or begin the line with # if it is a heading", offset)
        row = source.read_line(self.start).text.strip()
        if self._is_ambiguous(row):
            advice = "use a point as the decimal sign, and separate numbers by blanks"
            raise source.error(f"{row!r} may be one number with a decimal comma, or two numbers; {advice}", self.start)
        numbers = self._read_numbers().reshape(-1, self.column_count)
        heading, dt = self.heading, request.dt
        is_assumed = heading.assumes_times and heading.has_names and heading.columns[0].kind == "time"
        if is_assumed and dt is not None and find_first_fault(numbers[:, 0]) is not None:
            # The first column does not contain times as assumed.
            first = heading.columns[0]._replace(kind="channel", unit=None)
            heading = heading._replace(columns=(first, *heading.columns[1:]))
        return self._replace(heading=heading)._create_channels(request, numbers)

    def _create_channels(self, request: Request, numbers: Floats) -> list[Channel]:
        chosen, times = self._find_acceleration_columns(), self.heading.find_columns("time")
        if self.heading.may_be_spectrum and (self.column_count == 1 or times) and np.all(numbers[:, chosen] >= 0.0):
            raise self.create_spectrum_error("no value is negative, and no column is named 'time'")
        if not times:
            self._check_step(request.dt)
        is_overruled = request.unit is not None and not request.are_defaults
        channels = []
        for number, column in enumerate(chosen, 1):
            _, name, unit, unknown_unit = self.heading.columns[column]
            if not (unit or is_overruled) and _NON_ACCELERATION_UNIT.fullmatch(unknown_unit):
                text = f"the heading states {unknown_unit!r}, which is not a unit of acceleration"
                raise self.source.error(f"{text}; use a table of accelerations", self.heading.offset)
            offset = self.heading.offset if unknown_unit else self.start
            fields = self._read_timing(request, numbers, column)
            heading_unit = unit.name if unit else unknown_unit if _OTHER_UNIT.fullmatch(unknown_unit) else ""
            fields |= {"facts": {"heading units": heading_unit}, "number": number}
            fields["name"] = Path(self.source.path).stem if self.column_count <= 2 and len(chosen) == 1 else name
            unit = request.resolve_unit(self.source, None if is_overruled else unit or unknown_unit, offset)
            values, find_row = numbers[:, column], self._find_row_offset
            channels.append(create_channel(self.source, "text table", values, unit, find_row, **fields))
        return channels

    def create_spectrum_error(self, reason: str) -> RecordError:
        """Return the error for a table of a response spectrum."""
        text = f"this seems to be a response spectrum: {reason}; use accelerations against time"
        return self.source.error(f"{text}, or name the column 'time'", self.heading.offset)

    def _read_timing(self, request: Request, numbers: Floats, channel_column: int) -> dict[str, Any]:
        """Return step or times, and start (s), from the nearest column of times before a channel, else the first."""
        times = self.heading.find_columns("time")
        if not times:
            return {"dt": request.dt}
        column = max((candidate for candidate in times if candidate < channel_column), default=times[0])
        _, _, unit, unknown_unit = self.heading.columns[column]
        if unit is None:
            text = f"the unit of the times is unclear from {unknown_unit!r} in the heading"
            advice = "name s, ms, us, ns, min, h or d in their column, as 'time (ms)'"
            raise self.source.error(f"{text}; {advice}", self.heading.offset)
        dt, instants = resolve_timing(self.source, request, numbers[:, column], unit, self._find_row_offset)
        return {"dt": dt, "times": instants, "start": float(unit.to_si(numbers[:1, column])[0])}

    def _check_step(self, dt: float | None) -> None:
        """Raise an error for a table without times if the step is missing or differs from its heading."""
        reason = "the file does not state its sampling step"
        for line in itertools.takewhile(lambda line: line.start < self.start, self.source.read_lines(0, HEADING_LINES)):
            match = _STEP_STATEMENT.search(line.text)
            numbers = re.findall(NUMBER, match[1] or match[2]) if match else []
            stated = escape_braces(repr(line.text.strip()[:100]))
            if dt is not None and numbers and not any(_is_step(number, dt) for number in numbers):
                text = f"the heading states {stated}, not {{}} {dt:g} s; correct one of them"
                raise self.source.error(text, line.start, "dt", value=dt)
            reason = f"no column contains times, but the heading states {stated}" if numbers else reason
        if dt is None:
            raise self.source.error(f"{reason}; give {{}} in seconds", self.start, "dt")

    def _find_acceleration_columns(self) -> list[int]:
        """Return the columns of accelerations: with a unit of acceleration if any has one, else without any unit."""
        columns, channels = self.heading.columns, self.heading.find_columns("channel")
        if not channels or (self.heading.find_columns("spectrum") and not self.heading.find_columns("time")):
            others = ", ".join(repr(column.name) for column in columns)
            text = f"the heading names no column of accelerations against time ({others}, perhaps a spectrum)"
            raise self.source.error(f"{text}; use a table of accelerations against time", self.heading.offset)
        with_unit = [index for index in channels if columns[index].unit]
        return with_unit or [index for index in channels if not columns[index].unknown_unit] or channels

    def _read_numbers(self) -> Floats:
        """Return all numbers, row by row."""
        rows = self._yield_rows()
        parts: list[Any] = []
        while group := list(itertools.islice(rows, 5000)):
            values = convert_tokens([token for tokens, _ in group for token in tokens])
            is_uneven = any(len(tokens) != self.column_count for tokens, _ in group)
            for tokens, offset in group if values is None or is_uneven else ():
                if invalid := [token for token in tokens if convert_tokens([token]) is None]:
                    raise invalid_number_error(self.source, invalid[0], offset)
                if len(tokens) != self.column_count:
                    text = f"all rows must have {self.column_count} columns; got {len(tokens)} in this row"
                    raise self.source.error(text, offset, value=len(tokens))
            parts.append(values)
        return np.concatenate(parts)

    def _yield_rows(self) -> Iterator[tuple[list[bytes], int]]:
        stream, offset = io.BytesIO(self.source.data), self.start
        stream.seek(offset)
        for raw in stream:
            line = raw.strip()
            if line and not _COMMENT.match(line):
                if len(line) > _MAX_ROW_LENGTH:
                    text = f"this row is {len(line)} characters long, too long for a row of numbers; correct it"
                    raise self.source.error(text, offset)
                if tokens := line.translate(self.translation).split():
                    yield tokens, offset
            offset += len(raw)

    def _find_row_offset(self, index: int) -> int:
        """Return the offset of a row."""
        return next(offset for k, (_, offset) in enumerate(self._yield_rows()) if k == index)


def _is_step(number: str, dt: float) -> bool:
    """Return whether a printed number may be a step (s): in s or ms, or as a rate, rounded as printed."""
    printed, rounding = parse_token(number.encode()) or 0.0, compute_rounding(number)
    return any(abs(candidate - printed) <= rounding for candidate in (dt, 1e3 * dt, 1.0 / dt))


def recognise_table(source: Source) -> Recognised | None:
    """Recognise rows of one or two numbers after comments and headings, or of more numbers with named columns."""
    table = _find_table(_convert_clock_times(source))
    if table is None or (table.column_count > 2 and not table.heading.has_names):
        return None
    return table.identify("text table"), table.read


def recognise_wrapped(source: Source) -> Recognised | None:
    """Recognise rows of more numbers without a heading, which are one series if its step is specified."""
    table = _find_table(source)
    return None if table is None else (table.identify("wrapped numbers"), functools.partial(_read_wrapped, table))


def _read_wrapped(table: _TextTable, request: Request) -> list[Channel]:
    """Read all numbers row by row as one series."""
    source, start = table.source, table.start
    if table.heading.may_be_spectrum:
        raise table.create_spectrum_error("its heading names spectra")
    text = f"each line holds {table.column_count} numbers"
    advice = f"name all {table.column_count} columns in a heading line"
    if request.dt is None:
        text += ", not one (acceleration) or two (time, acceleration); keep only these"
        raise source.error(f"{text}, {advice}, or give {{}} if they are one series", start, "dt")
    values = read_values(source, start, len(source.data), (), StatedCount(0.0, start, max_surplus=math.inf))
    first = values[: -1 : table.column_count]
    if len(first) > 2 and find_first_fault(first) is None and fit_even_step(first) is not None:
        raise source.error(f"{text}, of which the first ones seem to be times; {advice}", start)
    unit, name = request.resolve_unit(source, None, start), Path(source.path).stem
    return [
        create_channel(source, "wrapped numbers", values, unit, lambda _: start, dt=request.dt, name=name, number=1)
    ]


def _convert_clock_times(source: Source) -> Source:
    """Return a file with the seconds since midnight instead of times such as 2024-01-31T23:59:59.99 or 23:59:59.99."""
    first = _CLOCK_PATTERN.search(source.data)
    if first is None:
        return source
    first_day = _number_day(first)

    def convert(match: re.Match[bytes]) -> bytes:
        hours, minutes, seconds = (int(match[k]) for k in (4, 5, 6))
        whole = 86400 * (_number_day(match) - first_day) + 3600 * hours + 60 * minutes + seconds
        return b"%d" % whole + (match[7] or b"")

    return replace(source, data=_CLOCK_HEADING.sub(b"(s)", _CLOCK_PATTERN.sub(convert, source.data)))


def _number_day(match: re.Match[bytes]) -> int:
    try:
        return date(*(int(match[k]) for k in (1, 2, 3))).toordinal() if match[1] else 0
    except ValueError:
        return 0


def _find_table(source: Source) -> _TextTable | None:
    """Return the table that begins at the first purely numeric line, or None."""
    lines = [] if source.is_binary else source.read_lines(0, HEADING_LINES)
    for k, line in enumerate(lines):
        if line.text.startswith(OBSPY_TITLE):
            return None
        translation, delimiter = _detect_delimiter(line)
        tokens = _split_row(line, translation)
        if tokens and not _is_comment(line) and all(parse_token(token) is not None for token in tokens):
            following = _drop_empty_lines(source.read_lines(line.next_start, 64))
            if delimiter == " " and len(tokens) > 1:
                # Between blanks commas may be decimal signs, in rows below the first one with a comma.
                translations = (_detect_delimiter(row) for row in following if "," in row.text)
                translation = next((candidate for candidate, sign in translations if sign == " "), translation)
            # The first row may be damaged, so the second one determines the number of columns.
            columns = len(_split_row(following[0] if following else line, translation))
            heading = parse_heading(source, line.start, columns, delimiter)
            damaged = None
            for title_line in _drop_empty_lines(lines[:k])[-1:]:
                title = parse_heading(source, title_line.start, columns, delimiter)
                has_names = columns > 1 and title.has_names and not title.assumes_times
                token = _find_damaged_token(
                    title_line.text, _split_row(title_line, translation), columns, has_names=has_names
                )
                damaged = (token, title_line.start) if token else None
            return _TextTable(source, translation, delimiter, columns, line.start, damaged, heading)
    return None


def _is_comment(line: Line) -> bool:
    return _COMMENT.match(line.text.encode("latin-1")) is not None


def _drop_empty_lines(lines: Sequence[Line]) -> list[Line]:
    """Return the lines that contain more than a comment."""
    return [line for line in lines if not _is_comment(line) and not RULE_PATTERN.fullmatch(line.text)]


def _split_row(line: Line, translation: bytes) -> list[bytes]:
    return line.text.encode("latin-1").translate(translation).split()


def _find_damaged_token(text: str, tokens: list[bytes], columns: int, *, has_names: bool) -> bytes:
    """Return the first non-numeric piece of a line if it looks like a damaged row, else empty bytes.

    In a row all pieces look like numbers, or there are as many as columns with a number among them, below names or with
    delimiters other than blanks and a number that is first or has a point.
    """
    invalid = [token for token in tokens if parse_token(token) is None]
    numbers = [token for token in tokens if parse_token(token) is not None]
    is_alike = all(_LIKE_NUMBER.fullmatch(token.decode("latin-1")) for token in invalid)
    is_row = is_alike and bool(numbers or len(tokens) == columns or len(text) > _LONG_LINE_LENGTH)
    if numbers and len(tokens) == columns and not is_row:
        is_plausible = tokens[0] in numbers or any(b"." in number for number in numbers)
        is_row = has_names or (is_plausible and re.search(r"[,;\t]", text.strip()) is not None)
    return invalid[0] if invalid and is_row else b""


def _detect_delimiter(line: Line) -> tuple[bytes, str]:
    """Return the translation of a row into numbers with points between blanks, and the delimiter."""
    if ";" in line.text:
        return bytes.maketrans(b',;"', b".  "), ";"
    words = line.text.replace('"', " ").split()
    if len(words) > 1 and "," in line.text and all(map(_WITHOUT_POINT.fullmatch, words)):
        return bytes.maketrans(b',"', b". "), " "
    if "," in line.text:
        return bytes.maketrans(b',"', b"  "), ","
    return bytes.maketrans(b'"', b" "), " "
