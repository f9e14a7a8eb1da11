"""USGS SMC: 11 text lines, 48 integers, 50 reals, comments that start with a bar, one component in cm/s^2.

Integer 16 counts the comment lines, integer 17 the values, after which a last row may be padded; real 2 is the rate in
samples per second. A digitised film record has no rate: its values are pairs of time and acceleration. Unknown values
are -32768 and 1.7e38.
"""

from __future__ import annotations

import functools
import re
from typing import Any

import numpy as np

from rocking.core.arrays import Floats
from rocking.records.formats.channel import (
    Channel,
    Recognised,
    azimuth_of,
    channel_of,
    first_fault,
    first_match,
    step_or_times,
)
from rocking.records.formats.source import Line, Request, Source
from rocking.records.formats.values import Layout, Stated, read_values, wrong_count

_TEXT_LINES, _INTEGER_LINES, _REAL_LINES = 11, 6, 10
_HEADER_LINES = _TEXT_LINES + _INTEGER_LINES + _REAL_LINES
_UNKNOWN = 1.6e38

_TITLE = re.compile(
    r"^\s*([0-6])\s+(unknown|(?:un)?corrected accelerogram|velocity|displacement|response|fourier)", re.IGNORECASE
)
_COMPONENT = re.compile(r"component\s*=\s*(.*)$", re.IGNORECASE)
_STATION = re.compile(r"station\s*=\s*(.*?)\s*(?:component\s*=|$)", re.IGNORECASE)


def recognise(source: Source) -> Recognised | None:
    """Return the format if the first line is one of its seven titles."""
    line = source.first_line()
    found = _TITLE.match(line.text) if line is not None else None
    if line is None or found is None:
        return None
    reason = f"line {source.line_number(line.start)} begins {found[0].strip()!r}"
    return Recognised("USGS SMC", reason, functools.partial(_read, source, line, found))


def _read(source: Source, title: Line, kind: re.Match[str], request: Request) -> list[Channel]:
    if kind[1] not in ("1", "2"):
        raise source.error(f"this SMC file holds {kind[2].lower()!r}; give the file of the acceleration", title.start)
    lines = source.lines(title.start, _HEADER_LINES)
    if len(lines) < _HEADER_LINES:
        raise source.error("the file ends within its header; get the whole file again", lines[-1].start)
    text, rest = lines[:_TEXT_LINES], lines[_TEXT_LINES:]
    at = text[-1].next
    integers = _numbers(source, rest[:_INTEGER_LINES], Layout(per_line=8, width=10))
    reals = _numbers(source, rest[_INTEGER_LINES:], Layout(per_line=5, width=15))
    comments, count, digits, rate = integers[15], int(integers[16]), int(integers[46]), float(reals[1])
    if comments > 10_000:
        raise source.error(f"{comments:g} comment lines are too many; correct integer 16", at)
    start = [rest[-1], *source.lines(rest[-1].next, int(comments))][-1].next
    unit = request.units(source, "cm/s2", title.start)
    layout = Layout(per_line=5, width=14) if digits == 8 else Layout(per_line=8, width=10)
    values = read_values(source, start, len(source.data), layout)
    if not 0 <= len(values) - count <= layout.per_line:
        raise wrong_count(source, at, f"the header says {count} values", len(values), count)
    values = values[:count]
    if (np.abs(values) >= _UNKNOWN).any():
        raise source.error("some values are 1.7e38, which means 'unknown'; get a record without gaps", start)
    dt: float | None
    if rate < _UNKNOWN:
        if not rate > 0.0:
            raise source.error(f"the sampling rate is {rate:g} per second, but it must be positive; correct it", at)
        dt, times = request.step(source, 1.0 / rate, at), None
    else:
        times, values = values[0::2], values[1::2]
        if count % 2 or count == 0 or first_fault(times) is not None:
            fault = "there is no rate, nor are the values pairs of increasing time and value"
            raise source.error(f"{fault}; correct it, or get the corrected accelerogram", at)
        dt, times = step_or_times(source, request, times, at)
    component, station = (
        found[1].strip() if (found := first_match(each, text)) else "" for each in (_COMPONENT, _STATION)
    )
    name = component.strip(" *") or "acceleration"
    known: dict[str, Any] = {
        "name": name,
        "number": 1,
        "dt": dt,
        "times": times,
        "azimuth": azimuth_of(name),
        "station": station,
    }
    known |= {"station": station, "event": " ".join(text[3].text.split())}
    facts = {"stage": kind[2].lower()}
    return [channel_of(source, "USGS SMC", values, unit, start, spelling="cm/s2", facts=facts, **known)]


def _numbers(source: Source, lines: list[Line], layout: Layout) -> Floats:
    start, count = lines[0].start, layout.per_line * len(lines)
    return read_values(source, start, lines[-1].next, layout, Stated(count, start))
