"""Plain text and CSV: accelerations with dt=, times and accelerations, or the columns named by a heading.

Columns and units come from the heading (`heading`) or units=. Times are in seconds by default. Heading lines and
comments (#, %, !, //) are skipped, except lines that look like a damaged row. The delimiter is a semicolon (a comma is
then the decimal sign), a comma, or blanks. Between blanks a comma within a number is the decimal sign. Numbers may be
quoted and may have Fortran exponents (1.0D-3). Rows such as "1,5" in a file without any point, and without two names
above, are ambiguous and rejected.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.errors import UnreadableRecord, literal
from rocking.records.formats.channel import Channel, Recognised, channel_of, first_fault, timing
from rocking.records.formats.engine import NUMBER, convert, not_a_number, parse
from rocking.records.formats.heading import RULE, Heading, heading_of
from rocking.records.formats.source import Line, Request, Source

_DELIMITERS: Final = {",": "a comma", ";": "a semicolon", " ": "a blank"}

#: Largest number of heading lines.
HEADING_LINES: Final = 1000
#: Longest row of numbers. Longer lines are rejected before splitting.
_ROW_LIMIT: Final = 1024
#: Text after a longer piece on its line may not be seen.
_LONG: Final = 300

#: Error values of spreadsheets after a #.
_ERRORS: Final = r"(?:(?:n/?a|nv)(?!\w)|div/0!|value!|ref!|num!|name\?|null!|wert!|zahl!)"
_COMMENT: Final = re.compile(rf"[ \t]*(?:%|!|//|#(?!{_ERRORS}|#+[ \t]*(?:[,;\t]|$)))".encode(), re.IGNORECASE)
#: Text that begins like a number, or stands for a missing number.
_LIKE_NUMBER: Final = re.compile(
    rf"(?i)[<>~]?[+-]*[ool]?[.,]?\d.*|[*?-]+|##+|#{_ERRORS}|n/?a|nil|null|none|missing|bad|error|overflow|void"
)
_WITHOUT_POINT: Final = re.compile(r"[+-]?\d+(?:,\d+)?(?:[EeDd][+-]?\d+)?")
_DECIMAL_COMMA: Final = re.compile(r"[+-]?\d*,\d+(?:[EeDd][+-]?\d+)?")

#: Pattern of a unit of another quantity.
_OF_OTHER_QUANTITY: Final = re.compile(r"(?i).*[/%].*|m|cm|mm|in|ft|m?v|counts?|rad|deg")
#: Pattern of a unit that is surely none of acceleration, unlike unknown spellings such as "cm/seg2" or "% of g".
_OF_NO_ACCELERATION: Final = re.compile(r"(?i)(?:[muµk]?m|cm|in|ft|rad|deg)(?:/s(?:ec)?)?")
#: Step or rate in a heading.
_STATES_STEP: Final = re.compile(
    rf"({NUMBER})\s*(?:sps\b|samples?\s*(?:/|per)\s*s)|(?:sampl\w*[\s_-]*(?:rate|freq|interval|step|period|/\s*s)"
    r"|time[\s_-]*(?:step|interval)|\b(?:dt|delta[\s_-]?t)\b|intervals? of|(?:interval|vel|frec)\S* de muestreo)"
    r"(?:[^:=]*[:=])?(.*)",
    re.IGNORECASE,
)
#: Title of a table that ObsPy reads.
OTHER_TITLE: Final = "TIMESERIES "


class _Table(NamedTuple):
    """Format of the rows, start of the first one, damaged row before it, and heading."""

    source: Source
    translation: bytes
    delimiter: str
    columns: int
    start: int
    damaged: tuple[bytes, int] | None
    heading: Heading

    @property
    def ambiguous(self) -> bool:
        """Whether commas may be decimal signs or delimiters, as in rows such as "1,5" without any point."""
        # A comma before blanks or at the end of a row is not a decimal sign.
        return (
            self.delimiter == ","
            and self.columns <= 2
            and _DECIMAL_COMMA.fullmatch(self.source.line(self.start).text.strip().strip('"')) is not None
            and b"." not in self.source.data[self.start :]
            and not (self.columns == 2 and self.heading.named)
        )

    def read(self, request: Request) -> list[Channel]:
        """Return the channels of the file: one, unless a heading names several."""
        source = self.source
        if self.damaged is not None:
            text = f"{self.damaged[0][:40].decode('latin-1')!r} is not a number, in what looks like a row of them"
            raise source.error(f"{text}; correct it, or begin the line with # if it is a heading", self.damaged[1])
        if self.ambiguous:
            text = f"{source.line(self.start).text.strip()!r} may be one number with a decimal comma, or two numbers"
            raise source.error(f"{text}; write decimal points, or blanks between two numbers", self.start)
        numbers = self._values().reshape(-1, self.columns)
        heading, dt = self.heading, request.dt
        assumed = heading.assumed and heading.named and heading.columns[0].kind == "time"
        if assumed and dt is not None and first_fault(numbers[:, 0]) is not None:
            # The first column does not contain times as assumed.
            first = heading.columns[0]._replace(kind="channel", unit=None)
            heading = heading._replace(columns=(first, *heading.columns[1:]))
        return self._replace(heading=heading)._channels(request, numbers)

    def _channels(self, request: Request, numbers: Floats) -> list[Channel]:
        held, times = self._held(), self.heading.places("time")
        if self.heading.doubtful and (self.columns == 1 or times) and np.all(numbers[:, held] >= 0.0):
            text = "this seems to be a response spectrum: no value is negative, and no column is named 'time'"
            raise self.source.error(f"{text}; give accelerations at times, or name their column so", self.heading.at)
        if not times:
            self._check_step(request.dt)
        self._check_numbers(numbers)
        overruled = request.unit is not None and not request.several
        channels = []
        for number, place in enumerate(held, 1):
            _, name, unit, strange = self.heading.columns[place]
            if not (unit or overruled) and _OF_NO_ACCELERATION.fullmatch(strange):
                text = f"the heading says {strange!r}, which is no unit of an acceleration"
                raise self.source.error(f"{text}; give a table of accelerations", self.heading.at)
            at = self.heading.at if strange else self.start
            known = self._timing(request, numbers, place)
            in_heading = unit.name if unit else strange if _OF_OTHER_QUANTITY.fullmatch(strange) else ""
            known |= {"facts": {"heading units": in_heading}, "number": number}
            known["name"] = Path(self.source.path).stem if self.columns <= 2 and len(held) == 1 else name
            unit = request.units(self.source, None if overruled else unit or strange, at)
            values, known["row_at"] = numbers[:, place], self._row_at
            channels.append(channel_of(self.source, "text table", values, unit, self.start, **known))
        return channels

    def _timing(self, request: Request, numbers: Floats, place: int) -> dict[str, Any]:
        """Return step or times, and start (s), from the nearest column of times before a channel, else the first."""
        times = self.heading.places("time")
        if not times:
            return {"dt": request.dt}
        column = max((each for each in times if each < place), default=times[0])
        _, _, unit, strange = self.heading.columns[column]
        if unit is None:
            text = f"the unit of the times is not clear from {strange!r} in the heading; name it in their column, as"
            raise self.source.error(f"{text} 'time (ms)': s, ms, us, ns, min, h or d", self.heading.at)
        dt, instants = timing(self.source, request, numbers[:, column], unit, self.start, self._row_at)
        return {"dt": dt, "times": instants, "start": float(unit.to_si(numbers[:1, column])[0])}

    def _check_numbers(self, numbers: Floats) -> None:
        """Raise an error if row numbers have a gap."""
        for place in self.heading.places("count"):
            steps = np.diff(numbers[:, place])
            odd = np.flatnonzero(np.abs(steps - steps[:1]) > 1e-6)
            if len(odd):
                text = "the number of this row does not follow that of the row before; get a record without gaps"
                raise self.source.error(text, self._row_at(int(odd[0]) + 1))

    def _check_step(self, dt: float | None) -> None:
        """Raise an error for a table without times if the step is missing or differs from its heading."""
        said = "the file does not say its sampling step"
        for line in itertools.takewhile(lambda line: line.start < self.start, self.source.lines(0, HEADING_LINES)):
            match = _STATES_STEP.search(line.text)
            numbers = re.findall(NUMBER, match[1] or match[2]) if match else []
            stated = literal(repr(line.text.strip()[:100]))
            if dt is not None and numbers and not any(_is_step(number, dt) for number in numbers):
                text = f"the heading says {stated}, not {{}} {dt:g} s; correct one of them"
                raise self.source.error(text, line.start, "dt", value=dt)
            said = f"no column holds times, but the heading says {stated}" if numbers else said
        if dt is None:
            raise self.source.error(f"{said}; give {{}} in seconds", self.start, "dt")

    def _held(self) -> list[int]:
        """Return the columns of accelerations: with a unit of acceleration if any has one, else without any unit."""
        columns, channels = self.heading.columns, self.heading.places("channel")
        if not channels or (self.heading.places("spectrum") and not self.heading.places("time")):
            others = ", ".join(repr(column.name) for column in columns)
            text = f"the heading names no column of accelerations at times ({others}, of a spectrum?)"
            raise self.source.error(f"{text}; give a table of accelerations at times", self.heading.at)
        known = [place for place in channels if columns[place].unit]
        return known or [place for place in channels if not columns[place].strange] or channels

    def _values(self) -> Floats:
        """Return all numbers, row by row."""
        rows = self._rows()
        parts: list[Any] = []
        while group := list(itertools.islice(rows, 5000)):
            values = convert([token for tokens, _ in group for token in tokens])
            uneven = any(len(tokens) != self.columns for tokens, _ in group)
            for tokens, at in group if values is None or uneven else ():
                if bad := [token for token in tokens if convert([token]) is None]:
                    raise not_a_number(self.source, bad[0], at)
                if len(tokens) != self.columns:
                    text = f"columns in this row: {len(tokens)}, in others: {self.columns}; make all rows alike"
                    raise self.source.error(text, at)
            parts.append(values)
        return np.concatenate(parts)

    def _rows(self) -> Iterator[tuple[list[bytes], int]]:
        data, start = self.source.data, self.start
        while start < len(data):
            end = data.find(b"\n", start)
            end = len(data) if end < 0 else end
            line = data[start:end].strip()
            if line and not _COMMENT.match(line):
                if len(line) > _ROW_LIMIT:
                    raise self.source.error(f"this row is {len(line)} characters long; make all rows alike", start)
                if tokens := line.translate(self.translation).split():
                    yield tokens, start
            start = end + 1

    def _row_at(self, index: int) -> int:
        """Return the offset of a row."""
        return next(at for k, (_, at) in enumerate(self._rows()) if k == index)


def _is_step(number: str, dt: float) -> bool:
    """Return whether a printed number may be a step (s): in s or ms, or as a rate, rounded as printed."""
    printed = Decimal(number.upper().replace("D", "E"))
    rounded = min(float(f"0.5e{printed.as_tuple().exponent}"), 0.03 * abs(float(printed)))
    return any(abs(each - float(printed)) <= rounded for each in (dt, 1e3 * dt, 1.0 / dt))


def recognise(source: Source) -> Recognised | None:
    """Recognise rows of one or two numbers after comments and headings, or of more numbers with named columns."""
    table = _table(source)
    if table is None or (table.columns > 2 and not table.heading.named):
        return None
    several = f"{table.columns} numbers, between them {_DELIMITERS[table.delimiter]}"
    what = "one number" if table.columns == 1 else several
    reason = f"from line {source.line_number(table.start)} on each line holds {what}"
    return Recognised("text table", reason, table.read)


def refusal(source: Source) -> UnreadableRecord | None:
    """Return the reason why an apparent table cannot be read, or None for other content."""
    table = _table(source)
    if table is None:
        return None
    text = f"each line holds {table.columns} numbers, not one (acceleration) or two (time, acceleration)"
    return source.error(f"{text}; keep only these, or name all {table.columns} columns in a heading line", table.start)


def _table(source: Source) -> _Table | None:
    """Return the table that begins at the first purely numeric line, or None."""
    lines = [] if source.is_binary else source.lines(0, HEADING_LINES)
    for k, line in enumerate(lines):
        if line.text.startswith(OTHER_TITLE):
            return None
        translation, delimiter = _delimiter(line)
        tokens = _tokens(line, translation)
        if tokens and not _is_comment(line) and all(parse(token) is not None for token in tokens):
            following = _filled(source.lines(line.next, 64))
            if delimiter == " " and len(tokens) > 1:
                # Between blanks commas may be decimal signs, in rows below the first one with a comma.
                ways = (_delimiter(each) for each in following if "," in each.text)
                translation = next((way for way, sign in ways if sign == " "), translation)
            # The first row may be damaged, so the second one determines the number of columns.
            columns = len(_tokens(following[0] if following else line, translation))
            heading = heading_of(source, line.start, columns, delimiter)
            damaged = None
            for above in _filled(lines[:k])[-1:]:
                names = heading_of(source, above.start, columns, delimiter)
                named = columns > 1 and names.named and not names.assumed
                token = _damaged(above.text, _tokens(above, translation), columns, named=named)
                damaged = (token, above.start) if token else None
            return _Table(source, translation, delimiter, columns, line.start, damaged, heading)
    return None


def _is_comment(line: Line) -> bool:
    return _COMMENT.match(line.text.encode("latin-1")) is not None


def _filled(lines: Sequence[Line]) -> list[Line]:
    """Return the lines that contain more than a comment."""
    return [line for line in lines if not _is_comment(line) and not RULE.fullmatch(line.text)]


def _tokens(line: Line, translation: bytes) -> list[bytes]:
    return line.text.encode("latin-1").translate(translation).split()


def _damaged(text: str, tokens: list[bytes], columns: int, *, named: bool) -> bytes:
    """Return the first non-numeric piece of a line if it looks like a damaged row, else empty bytes.

    In a row all pieces look like numbers, or there are as many as columns with a number among them, below names or with
    delimiters other than blanks and a number that is first or has a point.
    """
    strange = [token for token in tokens if parse(token) is None]
    numbers = [token for token in tokens if parse(token) is not None]
    alike = all(_LIKE_NUMBER.fullmatch(token.decode("latin-1")) for token in strange)
    is_row = alike and bool(numbers or len(tokens) == columns or len(text) > _LONG)
    if numbers and len(tokens) == columns and not is_row:
        pointed = tokens[0] in numbers or any(b"." in number for number in numbers)
        is_row = named or (pointed and re.search(r"[,;\t]", text.strip()) is not None)
    return strange[0] if strange and is_row else b""


def _delimiter(line: Line) -> tuple[bytes, str]:
    """Return the translation of a row into numbers with points between blanks, and the delimiter."""
    if ";" in line.text:
        return bytes.maketrans(b',;"', b".  "), ";"
    words = line.text.replace('"', " ").split()
    if len(words) > 1 and "," in line.text and all(map(_WITHOUT_POINT.fullmatch, words)):
        return bytes.maketrans(b',"', b". "), " "
    if "," in line.text:
        return bytes.maketrans(b',"', b"  "), ","
    return bytes.maketrans(b'"', b" "), " "
