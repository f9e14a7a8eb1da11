"""Conversion of numbers in bulk, and one reader for every format with a header.

A format defines its recognition and, in a function of a channel's header, the location of count, step, unit, labels and
layout of the numbers. All formats share the rest: search for the next channel, checks of the numbers and their count,
agreement of step and unit with the request, and construction of the channel.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.errors import UnreadableRecord, literal
from rocking.records.formats.channel import Channel, Recognised, channel_of, missing_value, timing
from rocking.records.formats.source import Line, Request, Source
from rocking.records.units import SECOND

#: Number in a header, as a regular expression.
NUMBER: Final = r"[+-]?(?:\d{1,20}\.?\d{0,20}|\.\d{1,20})(?:[EeDd][+-]?\d{1,4})?"

#: Fortran writes double precision with a D.
_FORTRAN: Final = bytes.maketrans(b"Dd", b"EE")
_IS_OTHER: Final = bytes(0 if c in b"0123456789+-.eEdD \t\n\v" else 1 for c in range(256))
#: Bytes per block: numbers need some fifty times as much memory during conversion.
_CHUNK: Final = 2**18
_SPACE: Final = re.compile(rb"\s")
_LINE_END: Final = re.compile(rb"\n")
#: Largest number of characters of a number.
_LONGEST: Final = 400
_END_OF_DATA: Final = re.compile(r"(?i)^\s*(/&|-*\s*end[ -]of[ -]data)")
_LAYOUT: Final = re.compile(r"(?ia)\(\s*(\d{1,3})\s*[EFGI]\s*(\d{1,3})(?:\.\d+)?\s*\)")
_NUMBER: Final = re.compile(rf"({NUMBER})\s*$")


@dataclass
class Header:
    """Header of one channel, read line by line by a format, with the numbers from `end`."""

    source: Source
    form: Format
    end: int
    ordinal: int = 1
    lines: list[Line] = field(default_factory=list)

    def skip(self, count: int) -> list[Line]:
        """Skip this many lines."""
        lines = self.source.lines(self.end, count)
        if len(lines) < count:
            last = lines[-1].start if lines else self.end
            raise self.source.error("the file ends within its header; get the whole file again", last)
        self.end = lines[-1].next if lines else self.end
        return lines

    def take(self, count: int) -> None:
        """Read this many lines of text."""
        self.lines += self.skip(count)

    def expect(self, pattern: re.Pattern[str], what: str) -> re.Match[str]:
        """Read the next line, which must match."""
        self.take(1)
        found = pattern.search(self.lines[-1].text)
        if found is None:
            raise self.source.error(f"{what} should stand here; get the file again", self.lines[-1].start)
        return found

    def take_until(self, pattern: re.Pattern[str], most: int) -> re.Match[str] | None:
        """Read the lines up to the first match, within a limit and the same channel."""
        for k, line in enumerate(self.source.lines(self.end, most)):
            if found := pattern.search(line.text):
                self.take(k + 1)
                return found
            if k > 0 and self.form.begins(line):
                break
        return None

    def numbers(self, rows: int, layout: Layout | None, count: int) -> Floats:
        """Read this many numbers in this many lines."""
        start = self.end
        self.skip(rows)
        return read_values(self.source, start, self.end, layout, Stated(count, start))

    def find(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        """Return the first match of a pattern in the lines."""
        return next((found for line in self.lines if (found := pattern.search(line.text))), None)

    def text(self, pattern: re.Pattern[str]) -> str:
        """Return the first group of a match, or an empty text."""
        found = self.find(pattern)
        return found[1].strip() if found else ""

    def at(self, pattern: re.Pattern[str]) -> int:
        """Return the offset of the first line that matches, or of the last line."""
        return next((line.start for line in self.lines if pattern.search(line.text)), self.end)

    def positive(self, key: re.Pattern[str], form: re.Pattern[str] = _NUMBER) -> list[float]:
        """Return the positive numbers that follow a key in this form."""
        found = form.match(self.text(key))
        numbers = [parse(group.encode("latin-1")) or 0.0 for group in found.groups()] if found else [0.0]
        if not all(number > 0.0 for number in numbers):
            line = self.source.line(self.at(key))
            text = f"{literal(repr(line.text))} gives no positive number; correct it, or get the record again"
            raise self.source.error(text, line.start)
        return numbers


@dataclass(frozen=True)
class Said:
    """Contents of a channel's header: unit, labels, and layout of the numbers that follow.

    Without a step (s) the numbers are pairs of time and value. A number that means 'unknown' is rejected. `scale`
    converts the counts of an instrument to the unit: a factor and a divisor. `at` is the offset of the line with this
    information.
    """

    at: int
    units: str
    step: float | None
    count: Stated
    labels: dict[str, Any]
    layout: Layout | None = None
    quantity: str = "acceleration"
    facts: Mapping[str, str] = field(default_factory=dict)
    padded: bool = False
    unknown: float | None = None
    scale: tuple[float, float] | None = None


class Format(NamedTuple):
    """Format: name, marks in its first lines, and reader of a channel's header.

    Each mark occurs in one of the first `within` lines. If the file may contain `several` channels, each begins with
    the first mark. Data of other quantities, which begin with a line that matches `other`, are skipped.
    """

    name: str
    marks: tuple[re.Pattern[str], ...]
    says: Callable[[Header], Said]
    within: int = 1
    several: bool = False
    other: re.Pattern[str] = re.compile(r"(?!)")

    def recognise(self, source: Source) -> Recognised | None:
        """Return the format if each of its marks is found."""
        lines = source.first_lines(self.within)
        found = [next(filter(None, (mark.search(line.text) for line in lines)), None) for mark in self.marks]
        if found[0] is None or None in found:
            return None
        at = next(line.start for line in lines if self.begins(line))
        reason = f"line {source.line_number(at)} reads {found[0][0].strip()!r}"
        return Recognised(self.name, reason, functools.partial(self._read, source, lines[0].start))

    def begins(self, line: Line) -> bool:
        """Return whether a line begins a channel."""
        return self.marks[0].search(line.text) is not None

    def _read(self, source: Source, start: int | None, request: Request) -> list[Channel]:
        channels: list[Channel] = []
        while start is not None:
            header = Header(source, self, start, len(channels) + 1)
            said = self.says(header)
            end = self._end(source, header.end)
            if said.quantity.lower().startswith("accel"):
                channels.append(_channel(header, said, end, request))
            start = self._next(source, end)
        if not channels:
            text = f"this {self.name} file holds {said.quantity.lower()!r}; give the file of the acceleration"
            raise source.error(text, said.at)
        return channels

    def _end(self, source: Source, start: int) -> int:
        """Return the end of a channel's numbers: the end of the file, or a line that begins other content."""
        end = numeric_end(source, start) if self.several else len(source.data)
        line = source.line(end)
        ends = _END_OF_DATA.match(line.text) or self.begins(line) or self.other.search(line.text)
        return end if ends else line.next  # such a line is not an end, but contains a damaged number

    def _next(self, source: Source, end: int) -> int | None:
        """Return the offset of the next channel."""
        line = source.first_line(end)
        while line is not None and not self.begins(line):
            if not (_END_OF_DATA.match(line.text) or self.other.search(line.text)):
                raise source.error("the title of another channel should stand here; correct the file", line.start)
            line = source.first_line(numeric_end(source, line.next))
        return None if line is None else line.start


def _channel(header: Header, said: Said, end: int, request: Request) -> Channel:
    source = header.source
    unit = request.units(source, said.units, said.at)
    dt = None if said.step is None else request.step(source, said.step, said.at)
    values = read_values(source, header.end, end, said.layout, said.count)
    if said.padded:
        values = values[: int(said.count.values)]
    if said.unknown is not None and (values == said.unknown).any():
        raise missing_value(source, said.unknown, said.at)
    times, facts = None, {**said.facts}
    if said.scale is not None:
        with np.errstate(over="ignore"):
            values = values * said.scale[0] / said.scale[1]
            facts["offset"] = f"kept, the mean is {float(unit.to_si(values).mean()) if len(values) else 0.0:.4g} m/s^2"
    if dt is None:
        if len(values) % 2 or len(values) < 4:
            raise source.error("the values are no pairs of time and acceleration; correct the file", said.at)
        dt, times = timing(source, request, values[0::2], SECOND, said.at)
        values = values[1::2]
    known = {"number": header.ordinal, "dt": dt, "times": times, **said.labels}
    return channel_of(source, header.form.name, values, unit, said.at, spelling=said.units, facts=facts, **known)


def stated_layout(text: str) -> Layout | None:
    """Return the Fortran columns stated by a header such as "... Format: (8f9.6)", or None."""
    found = _LAYOUT.search(text)
    layout = Layout(int(found[1]), int(found[2])) if found else None
    return layout if layout and all(layout) else None


def direction(pattern: re.Pattern[str], name: str) -> float | None:
    """Return the direction, degrees clockwise from north, at the start of a matching name, or None."""
    found = pattern.match(name)
    return float(found[1]) % 360.0 if found else None


def number(text: str) -> float:
    """Return the number in a text, or 0."""
    return parse(text.encode("latin-1")) or 0.0


def step_of(rate: float) -> float:
    """Return the step, s, for this many samples per second, or 0 for 0."""
    return 1.0 / rate if rate else 0.0


class Stated(NamedTuple):
    """Number of values stated in a file, offset of its line, and name of its source.

    Up to `more` additional values may fill the last row, or are not counted by a length in whole seconds.
    """

    values: float
    at: int
    by: str = "the header"
    more: float = 0.0

    def fits(self, count: int) -> bool:
        """Return whether this many values may follow."""
        return -0.5 < count - self.values < self.more + 0.5


class Layout(NamedTuple):
    """Fortran columns such as 8F10.3: numbers per line and characters per number."""

    per_line: int
    width: int

    def fields(self, line: bytes) -> list[bytes]:
        """Return the fields of a line, or the unchanged line if it does not fit."""
        if len(line) > self.per_line * self.width or b"\t" in line:
            return [line.strip()]
        return [line[i : i + self.width] for i in range(0, len(line), self.width)]


def numeric_end(source: Source, start: int) -> int:
    """Return the offset of the first line from `start` that is not numeric, or the file's end."""
    data = source.data
    for begin in range(start, len(data), _CHUNK):
        position = data[begin : begin + _CHUNK].translate(_IS_OTHER).find(1)
        if position >= 0:
            return max(data.rfind(b"\n", start, begin + position) + 1, start)
    return len(data)


def read_values(source: Source, start: int, end: int, layout: Layout | None, stated: Stated) -> Floats:
    """Return all numbers between the offsets `start` and `end` of lines, as many as stated."""
    values, reached = _in_blocks(source, start, end, None)
    further = reached
    if layout is not None and not (reached == end and stated.fits(len(values))):
        columns, further = _in_blocks(source, start, end, layout)
        if further == end and (reached < end or stated.fits(len(columns))):
            values, reached = columns, end
    if reached < end:
        # The reading that got further has the helpful error message.
        bad = _first_bad(source, reached, None), _first_bad(source, further, layout)
        raise not_a_number(source, *max(bad, key=lambda each: each[1]))
    if not stated.fits(len(values)):
        advice = "remove what does not belong to it" if len(values) > stated.values else "get the whole file again"
        said = f"{stated.by} says {stated.values:.15g} values but {len(values)} follow"
        raise source.error(f"{said}; {advice}, or correct that number", stated.at)
    return values


def not_a_number(source: Source, token: bytes, at: int) -> UnreadableRecord:
    """Return the error for text that should be a finite number."""
    shown, number = repr(token[:40].decode("latin-1")), parse(token)
    if b"," in token and parse(token.replace(b",", b".")) is not None:
        return source.error(f"{shown} is not a number; write decimal points in place of commas", at)
    finite = "" if number is None or np.isfinite(number) else "finite "
    return source.error(f"{shown} is not a {finite}number; correct it or get the record again", at)


def parse(token: bytes) -> float | None:
    """Return the number written by `token` (also with D exponent, possibly not finite), or None."""
    if len(token) > _LONGEST or b"_" in token:
        return None
    try:
        return float(token.translate(_FORTRAN))
    except ValueError:
        return None


def convert(tokens: list[bytes]) -> Floats | None:
    """Return the numbers written by the tokens (also with D exponents), or None unless all are finite."""
    if not tokens:
        return np.empty(0)
    joined = b"\n".join(tokens)
    if b"_" in joined or max(map(len, tokens)) > _LONGEST:
        return None
    if b"D" in joined or b"d" in joined:
        tokens = joined.translate(_FORTRAN).split(b"\n")
    try:
        values = np.array(tokens, dtype=np.float64)
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _in_blocks(source: Source, start: int, end: int, layout: Layout | None) -> tuple[Floats, int]:
    """Return the numbers of purely numeric blocks, and the offset of their end."""
    parts = [np.empty(0)]
    while start < end:
        found = (_LINE_END if layout else _SPACE).search(source.data, min(start + _CHUNK, end) - 1, end)
        stop = end if found is None else found.end()
        values = convert(_tokens(source.data[start:stop], layout))
        if values is None:
            break
        parts.append(values)
        start = stop
    return np.concatenate(parts), start


def _tokens(text: bytes, layout: Layout | None) -> list[bytes]:
    """Split at blanks, or into columns, of which the last in a line may be missing."""
    if layout is None:
        return text.split()
    return [field for line in text.split(b"\n") for field in layout.fields(line.rstrip())]


def _first_bad(source: Source, at: int, layout: Layout | None) -> tuple[bytes, int]:
    """Find the first piece of text from `at` that is not a finite number, and the start of its line."""
    for line in source.data[at : at + 2 * _CHUNK].split(b"\n"):
        for token in _tokens(line, layout):
            if convert([token]) is None:
                return token, at
        at += len(line) + 1
    raise AssertionError("in a block that does not convert one number is bad")
