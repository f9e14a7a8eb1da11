"""USGS SMC: 11 text lines, 48 integers, 50 reals, comments that start with a bar, one component in cm/s^2.

Integer 16 counts the comment lines, integer 17 the values, after which a last row may be padded; real 2 is the rate in
samples per second. A digitised film record has no rate: its values are pairs of time and acceleration. Unknown values
are -32768 and 1.7e38.
"""

from __future__ import annotations

import functools
import re
from typing import NamedTuple

import numpy as np

from rocking.arrays import Floats
from rocking.motion.formats.channel import (
    Channel,
    Identification,
    Recognised,
    azimuth_of,
    first_fault,
    step_or_times,
    to_acceleration,
)
from rocking.motion.formats.source import Line, Request, Source
from rocking.motion.formats.values import Layout, Stated, read_values, wrong_count

NAME = "USGS SMC"

_TEXT_LINES, _INTEGER_LINES, _REAL_LINES = 11, 6, 10
_EVENT_LINE = 3
_INTEGERS = Layout(per_line=8, width=10)
_REALS = Layout(per_line=5, width=15)
_VALUES = Layout(per_line=8, width=10)
_PRECISE_VALUES = Layout(per_line=5, width=14)
_COMMENT_COUNT, _VALUE_COUNT, _DIGITS, _RATE = 16, 17, 47, 2
_PRECISE_DIGITS = 8
_MOST_COMMENTS = 10_000
_UNKNOWN = 1.6e38

_TITLE = re.compile(
    r"^\s*([0-6])\s+(unknown|(?:un)?corrected accelerogram|velocity|displacement|response|fourier)", re.IGNORECASE
)
_ACCELERATIONS = ("1", "2")
_COMPONENT = re.compile(r"component\s*=\s*(.*)$", re.IGNORECASE)
_STATION = re.compile(r"station\s*=\s*(.*?)\s*(?:component\s*=|$)", re.IGNORECASE)


class _SmcHeader(NamedTuple):
    text: list[Line]
    integers: Floats
    reals: Floats
    data: int

    def integer(self, number: int) -> int:
        return int(self.integers[number - 1])


def recognise(source: Source) -> Recognised | None:
    """Return the format if the first line is one of its seven titles."""
    line = source.first_line()
    found = _TITLE.match(line.text) if line is not None else None
    if line is None or found is None:
        return None
    identification = Identification(NAME, f"line {source.line_number(line.start)} begins {found[0].strip()!r}")
    return Recognised(identification, functools.partial(_read, source, line, found))


def _read(source: Source, title: Line, kind: re.Match[str], request: Request) -> list[Channel]:
    if kind[1] not in _ACCELERATIONS:
        raise source.error(f"this SMC file holds {kind[2].lower()!r}; give the file of the acceleration", title.start)
    header = _header(source, title)
    unit = request.units(source, "cm/s2", title.start)
    dt, times, values = _series(source, request, header)
    name = _first(_COMPONENT, header.text).strip(" *") or "acceleration"
    return [
        Channel(
            name=name,
            number=1,
            acceleration=to_acceleration(source, header.data, values, unit),
            dt=dt,
            times=times,
            azimuth=azimuth_of(name),
            units="cm/s2",
            station=_first(_STATION, header.text),
            event=" ".join(header.text[_EVENT_LINE].text.split()),
            metadata={"format": NAME, "file": source.file, "stage": kind[2].lower()},
        )
    ]


def _header(source: Source, title: Line) -> _SmcHeader:
    lines = source.lines(title.start, _TEXT_LINES + _INTEGER_LINES + _REAL_LINES)
    if len(lines) < _TEXT_LINES + _INTEGER_LINES + _REAL_LINES:
        raise source.error("the file ends within its header; get the whole file again", lines[-1].start)
    text, rest = lines[:_TEXT_LINES], lines[_TEXT_LINES:]
    integers = _numbers(source, rest[:_INTEGER_LINES], _INTEGERS)
    reals = _numbers(source, rest[_INTEGER_LINES:], _REALS)
    comments = integers[_COMMENT_COUNT - 1]
    if comments > _MOST_COMMENTS:
        raise source.error(f"{comments:g} comment lines are too many; correct integer {_COMMENT_COUNT}", rest[0].start)
    rows = source.lines(rest[-1].next, int(comments))
    return _SmcHeader(text, integers, reals, [rest[-1], *rows][-1].next)


def _numbers(source: Source, lines: list[Line], layout: Layout) -> Floats:
    start, count = lines[0].start, layout.per_line * len(lines)
    return read_values(source, start, lines[-1].next, layout, Stated(count, start))


def _series(source: Source, request: Request, header: _SmcHeader) -> tuple[float | None, Floats | None, Floats]:
    """Return step or times, and the values."""
    values = _values(source, header)
    at = header.text[-1].next
    rate = float(header.reals[_RATE - 1])
    if rate < _UNKNOWN:
        if not rate > 0.0:
            raise source.error(f"the sampling rate is {rate:g} per second, but it must be positive; correct it", at)
        return request.step(source, 1.0 / rate, at), None, values
    times = values[0::2]
    if len(values) % 2 or len(values) == 0 or first_fault(times) is not None:
        text = "there is no rate, nor are the values pairs of increasing time and value"
        raise source.error(f"{text}; correct it, or get the corrected accelerogram", at)
    return *step_or_times(source, request, times, at), values[1::2]


def _values(source: Source, header: _SmcHeader) -> Floats:
    count = header.integer(_VALUE_COUNT)
    layout = _PRECISE_VALUES if header.integer(_DIGITS) == _PRECISE_DIGITS else _VALUES
    values = read_values(source, header.data, len(source.data), layout)
    if not 0 <= len(values) - count <= layout.per_line:
        at = header.text[-1].next
        raise wrong_count(source, at, f"the header says {count} values", len(values), more=len(values) > count)
    values = values[:count]
    if (np.abs(values) >= _UNKNOWN).any():
        raise source.error("some values are 1.7e38, which means 'unknown'; get a record without gaps", header.data)
    return values


def _first(pattern: re.Pattern[str], lines: list[Line]) -> str:
    return next((found[1].strip() for line in lines if (found := pattern.search(line.text))), "")
