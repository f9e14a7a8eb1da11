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
from rocking.errors import RecordError, escape_braces
from rocking.records.formats.channel import Channel, Recognised, create_channel, missing_value_error, resolve_timing
from rocking.records.formats.source import Line, Request, Source
from rocking.records.units import SECOND

#: Number in a header, as a regular expression.
NUMBER: Final = r"[+-]?(?:\d{1,20}\.?\d{0,20}|\.\d{1,20})(?:[EeDd][+-]?\d{1,4})?"

#: Fortran writes double precision with a D.
_FORTRAN_EXPONENTS: Final = bytes.maketrans(b"Dd", b"EE")
_NOT_NUMERIC: Final = bytes(0 if c in b"0123456789+-.eEdD \t\n\v" else 1 for c in range(256))
#: Bytes per block: numbers need some fifty times as much memory during conversion.
_BLOCK_SIZE: Final = 2**18
_SPACE: Final = re.compile(rb"\s")
_LINE_END: Final = re.compile(rb"\n")
#: Largest number of characters of a number.
_MAX_NUMBER_LENGTH: Final = 400
_END_OF_DATA: Final = re.compile(r"(?i)^\s*(/&|-*\s*end[ -]of[ -]data)")
_LAYOUT: Final = re.compile(r"(?ia)\(\s*(\d{1,3})\s*[EFGI]\s*(\d{1,3})(?:\.\d+)?\s*\)")
_SINGLE_NUMBER: Final = re.compile(rf"({NUMBER})\s*$")


@dataclass
class Header:
    """Header of one channel, read line by line by a format."""

    source: Source  # file
    record_format: Format  # format that reads the header
    end: int  # offset of the numbers
    ordinal: int = 1  # number of the channel in the file, from 1
    lines: list[Line] = field(default_factory=list)  # lines read

    def skip(self, count: int) -> list[Line]:
        """Skip this many lines."""
        lines = self.source.read_lines(self.end, count)
        if len(lines) < count:
            last = lines[-1].start if lines else self.end
            raise self.source.error("the file ends within its header; download the complete file again", last)
        self.end = lines[-1].next_start if lines else self.end
        return lines

    def read_lines(self, count: int) -> None:
        """Read this many lines of text."""
        self.lines += self.skip(count)

    def expect(self, pattern: re.Pattern[str], content: str) -> re.Match[str]:
        """Read the next line, which must match."""
        self.read_lines(1)
        match = pattern.search(self.lines[-1].text)
        if match is None:
            sentence = f"expected {content} here; the file may be damaged, so download it again"
            raise self.source.error(sentence, self.lines[-1].start)
        return match

    def read_until(self, pattern: re.Pattern[str], max_lines: int) -> re.Match[str] | None:
        """Read the lines up to the first match, within a limit and the same channel."""
        for k, line in enumerate(self.source.read_lines(self.end, max_lines)):
            if match := pattern.search(line.text):
                self.read_lines(k + 1)
                return match
            if k > 0 and self.record_format.begins_channel(line):
                break
        return None

    def read_numbers(self, rows: int, layout: Layout | None, count: int) -> Floats:
        """Read this many numbers in this many lines."""
        start = self.end
        self.skip(rows)
        return read_values(self.source, start, self.end, layout, Count(count, start))

    def find_match(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        """Return the first match of a pattern in the lines."""
        return next((match for line in self.lines if (match := pattern.search(line.text))), None)

    def find_text(self, pattern: re.Pattern[str]) -> str:
        """Return the first group of a match, or an empty text."""
        match = self.find_match(pattern)
        return match[1].strip() if match else ""

    def find_offset(self, pattern: re.Pattern[str]) -> int:
        """Return the offset of the first line that matches, or of the last line."""
        return next((line.start for line in self.lines if pattern.search(line.text)), self.end)

    def find_positive_numbers(self, key: re.Pattern[str], pattern: re.Pattern[str] = _SINGLE_NUMBER) -> list[float]:
        """Return the positive numbers that follow a key."""
        match = pattern.match(self.find_text(key))
        numbers = [parse_token(group.encode("latin-1")) or 0.0 for group in match.groups()] if match else [0.0]
        if not all(number > 0.0 for number in numbers):
            line = self.source.read_line(self.find_offset(key))
            text = f"expected a positive number in {escape_braces(repr(line.text))}"
            raise self.source.error(f"{text}; correct it, or download the record again", line.start)
        return numbers


@dataclass(frozen=True)
class HeaderData:
    """Contents of a channel's header."""

    offset: int  # offset of the line with this information
    units: str  # unit of the numbers
    step: float | None  # sampling step, s, or None for pairs of time and value
    count: Count  # number of values
    labels: dict[str, Any]  # fields of the channel
    layout: Layout | None = None  # columns of the numbers
    quantity: str = "acceleration"  # recorded quantity
    facts: Mapping[str, str] = field(default_factory=dict)  # metadata of the channel
    padded: bool = False  # whether the last row is filled up
    missing_mark: float | None = None  # number for unknown values, which are rejected
    scale: tuple[float, float] | None = None  # factor and divisor from the counts of an instrument to the unit


class Format(NamedTuple):
    """Format with a header."""

    name: str  # name for the user
    marks: tuple[re.Pattern[str], ...]  # patterns in the first lines, of which the first one begins a channel
    parse_header: Callable[[Header], HeaderData]  # reader of a channel's header
    max_lines: int = 1  # number of lines that contain the marks
    has_several_channels: bool = False  # whether a file may contain several channels
    other_data: re.Pattern[str] = re.compile(r"(?!)")  # line that begins data of other quantities, which are skipped

    def recognise(self, source: Source) -> Recognised | None:
        """Return the format if each of its marks is found."""
        lines = source.find_first_lines(self.max_lines)
        matches = [next(filter(None, (mark.search(line.text) for line in lines)), None) for mark in self.marks]
        if matches[0] is None or None in matches:
            return None
        offset = next(line.start for line in lines if self.begins_channel(line))
        reason = f"line {source.find_line_number(offset)} reads {matches[0][0].strip()!r}"
        return Recognised(self.name, reason, functools.partial(self._read_channels, source, lines[0].start))

    def begins_channel(self, line: Line) -> bool:
        """Return whether a line begins a channel."""
        return self.marks[0].search(line.text) is not None

    def _read_channels(self, source: Source, start: int | None, request: Request) -> list[Channel]:
        channels: list[Channel] = []
        while start is not None:
            header = Header(source, self, start, len(channels) + 1)
            data = self.parse_header(header)
            end = self._find_end(source, header.end)
            if data.quantity.lower().startswith("accel"):
                channels.append(_build_channel(header, data, end, request))
            start = self._find_next(source, end)
        if not channels:
            text = f"this {self.name} file contains {data.quantity.lower()!r}; use the file of the acceleration"
            raise source.error(text, data.offset)
        return channels

    def _find_end(self, source: Source, start: int) -> int:
        """Return the end of a channel's numbers: the end of the file, or a line that begins other content."""
        end = find_numeric_end(source, start) if self.has_several_channels else len(source.data)
        line = source.read_line(end)
        ends = _END_OF_DATA.match(line.text) or self.begins_channel(line) or self.other_data.search(line.text)
        return end if ends else line.next_start  # such a line is not an end, but contains a damaged number

    def _find_next(self, source: Source, end: int) -> int | None:
        """Return the offset of the next channel."""
        line = source.find_first_line(end)
        while line is not None and not self.begins_channel(line):
            if not (_END_OF_DATA.match(line.text) or self.other_data.search(line.text)):
                raise source.error("expected the title of the next channel here; correct the file", line.start)
            line = source.find_first_line(find_numeric_end(source, line.next_start))
        return None if line is None else line.start


def _build_channel(header: Header, data: HeaderData, end: int, request: Request) -> Channel:
    source = header.source
    unit = request.resolve_unit(source, data.units, data.offset)
    dt = None if data.step is None else request.check_step(source, data.step, data.offset)
    values = read_values(source, header.end, end, data.layout, data.count)
    if data.padded:
        values = values[: int(data.count.values)]
    if data.missing_mark is not None and (values == data.missing_mark).any():
        raise missing_value_error(source, data.missing_mark, data.offset)
    times, facts = None, {**data.facts}
    if data.scale is not None:
        with np.errstate(over="ignore"):
            values = values * data.scale[0] / data.scale[1]
            facts["offset"] = f"kept, the mean is {float(unit.to_si(values).mean()) if len(values) else 0.0:.4g} m/s^2"
    if dt is None:
        if len(values) % 2 or len(values) < 4:
            raise source.error("expected pairs of time and acceleration; correct the file", data.offset)
        dt, times = resolve_timing(source, request, values[0::2], SECOND, data.offset)
        values = values[1::2]
    fields = {"number": header.ordinal, "dt": dt, "times": times, **data.labels}
    return create_channel(
        source, header.record_format.name, values, unit, data.offset, spelling=data.units, facts=facts, **fields
    )


def parse_layout(text: str) -> Layout | None:
    """Return the Fortran columns stated by a header such as "... Format: (8f9.6)", or None."""
    match = _LAYOUT.search(text)
    layout = Layout(int(match[1]), int(match[2])) if match else None
    return layout if layout and all(layout) else None


def parse_azimuth(pattern: re.Pattern[str], name: str) -> float | None:
    """Return the direction, degrees clockwise from north, at the start of a matching name, or None."""
    match = pattern.match(name)
    return float(match[1]) % 360.0 if match else None


def parse_number(text: str) -> float:
    """Return the number in a text, or 0."""
    return parse_token(text.encode("latin-1")) or 0.0


def step_from_rate(rate: float) -> float:
    """Return the step, s, for this many samples per second, or 0 for 0."""
    return 1.0 / rate if rate else 0.0


class Count(NamedTuple):
    """Number of values stated in a file."""

    values: float  # number
    offset: int  # offset of its line
    stated_by: str = "the header"  # name for messages
    max_surplus: float = 0.0  # number of values that may fill the last row or the last second

    def fits(self, count: int) -> bool:
        """Return whether this many values may follow."""
        return -0.5 < count - self.values < self.max_surplus + 0.5


class Layout(NamedTuple):
    """Fortran columns such as 8F10.3."""

    per_line: int  # numbers per line
    width: int  # characters per number

    def split_line(self, line: bytes) -> list[bytes]:
        """Return the fields of a line, or the unchanged line if it does not fit."""
        if len(line) > self.per_line * self.width or b"\t" in line:
            return [line.strip()]
        return [line[i : i + self.width] for i in range(0, len(line), self.width)]


def find_numeric_end(source: Source, start: int) -> int:
    """Return the offset of the first line from `start` that is not numeric, or the file's end."""
    data = source.data
    for block_start in range(start, len(data), _BLOCK_SIZE):
        position = data[block_start : block_start + _BLOCK_SIZE].translate(_NOT_NUMERIC).find(1)
        if position >= 0:
            return max(data.rfind(b"\n", start, block_start + position) + 1, start)
    return len(data)


def read_values(source: Source, start: int, end: int, layout: Layout | None, stated: Count) -> Floats:
    """Return all numbers between the offsets `start` and `end` of lines, as many as stated."""
    values, values_end = _read_blocks(source, start, end, None)
    columns_end = values_end
    if layout is not None and not (values_end == end and stated.fits(len(values))):
        column_values, columns_end = _read_blocks(source, start, end, layout)
        if columns_end == end and (values_end < end or stated.fits(len(column_values))):
            values, values_end = column_values, end
    if values_end < end:
        # The reading that got further has the helpful error message.
        tokens = _find_first_invalid(source, values_end, None), _find_first_invalid(source, columns_end, layout)
        raise invalid_number_error(source, *max(tokens, key=lambda token: token[1]))
    if not stated.fits(len(values)):
        advice = "remove the other values" if len(values) > stated.values else "download the complete file again"
        mismatch = f"{stated.stated_by} specifies {stated.values:.15g} values, but {len(values)} follow"
        raise source.error(f"{mismatch}; {advice}, or correct that number", stated.offset)
    return values


def invalid_number_error(source: Source, token: bytes, offset: int) -> RecordError:
    """Return the error for text that should be a finite number."""
    token_text, number = repr(token[:40].decode("latin-1")), parse_token(token)
    if b"," in token and parse_token(token.replace(b",", b".")) is not None:
        return source.error(f"{token_text} is not a number; use a point as the decimal sign", offset)
    finite = "" if number is None or np.isfinite(number) else "finite "
    return source.error(f"{token_text} is not a {finite}number; correct it, or download the record again", offset)


def parse_token(token: bytes) -> float | None:
    """Return the number written by `token` (also with D exponent, possibly not finite), or None."""
    if len(token) > _MAX_NUMBER_LENGTH or b"_" in token:
        return None
    try:
        return float(token.translate(_FORTRAN_EXPONENTS))
    except ValueError:
        return None


def convert_tokens(tokens: list[bytes]) -> Floats | None:
    """Return the numbers written by the tokens (also with D exponents), or None unless all are finite."""
    if not tokens:
        return np.empty(0)
    joined = b"\n".join(tokens)
    if b"_" in joined or max(map(len, tokens)) > _MAX_NUMBER_LENGTH:
        return None
    if b"D" in joined or b"d" in joined:
        tokens = joined.translate(_FORTRAN_EXPONENTS).split(b"\n")
    try:
        values = np.array(tokens, dtype=np.float64)
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _read_blocks(source: Source, start: int, end: int, layout: Layout | None) -> tuple[Floats, int]:
    """Return the numbers of purely numeric blocks, and the offset of their end."""
    parts = [np.empty(0)]
    while start < end:
        boundary = (_LINE_END if layout else _SPACE).search(source.data, min(start + _BLOCK_SIZE, end) - 1, end)
        stop = end if boundary is None else boundary.end()
        values = convert_tokens(_split_tokens(source.data[start:stop], layout))
        if values is None:
            break
        parts.append(values)
        start = stop
    return np.concatenate(parts), start


def _split_tokens(text: bytes, layout: Layout | None) -> list[bytes]:
    """Split at blanks, or into columns, of which the last in a line may be missing."""
    if layout is None:
        return text.split()
    return [field for line in text.split(b"\n") for field in layout.split_line(line.rstrip())]


def _find_first_invalid(source: Source, offset: int, layout: Layout | None) -> tuple[bytes, int]:
    """Find the first piece of text from `offset` that is not a finite number, and the start of its line."""
    for line in source.data[offset : offset + 2 * _BLOCK_SIZE].split(b"\n"):
        for token in _split_tokens(line, layout):
            if convert_tokens([token]) is None:
                return token, offset
        offset += len(line) + 1
    raise AssertionError("in a block that does not convert one number is bad")
