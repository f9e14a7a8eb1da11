"""COSMOS strong-motion format 1.20: headers that state their length and columns, comments, then one block of data.

A file may hold several channels, and velocities and displacements beside accelerations; only accelerations are
read. Real header 62 is the step in milliseconds, 34 that of the raw data in seconds.
"""

from __future__ import annotations

import functools
import math
import re
from typing import NamedTuple

from rocking.core.arrays import Floats
from rocking.records.formats import csmip
from rocking.records.formats.channel import Channel, Recognised, channel_of, first_match
from rocking.records.formats.source import Line, Request, Source
from rocking.records.formats.values import Stated, read_values

_TITLE = re.compile(r"\(format\s+v\s*[\d.]{1,8}\s+with\s+(\d{1,3})\s+text", re.IGNORECASE | re.ASCII)
_NUMBERS = re.compile(
    r"^\s*(\d{1,6})\s+(integer|real)-header\s+values\s+follow\s+on\s+(\d{1,4})\s+lines", re.IGNORECASE | re.ASCII
)
_COMMENTS = re.compile(r"^\s*(\d{1,4})\s+comment", re.IGNORECASE | re.ASCII)
_DATA_LINE = re.compile(r"^\s*(\d{1,12})\s+(\S.*?)\s*pts\b", re.IGNORECASE | re.ASCII)
_DURATION = re.compile(r"approx\s+(\d{1,9})\s+secs", re.IGNORECASE | re.ASCII)
_UNITS = re.compile(r"units\s*=\s*([A-Za-z0-9/^]+)", re.IGNORECASE)
_UNKNOWN = re.compile(r"unspecified:.*,\s*(-\d{1,9}(?:\.\d{0,9})?)\s*$", re.IGNORECASE | re.ASCII)
_CHANNEL = re.compile(r"^\s*sta\s+cha\w*\s*:?\s*(\w+|\?)\s*:\s*([^(]*)", re.IGNORECASE)
_STATION = re.compile(r"^\s*statn\s+no\S*\s+(\S+)\s*(?:code:\s*\S+)?\s*(.*)$", re.IGNORECASE)


class _CosmosHeader(NamedTuple):
    text: list[Line]
    reals: Floats
    data: Line
    points: int
    quantity: str


def recognise(source: Source) -> Recognised | None:
    """Return the format if the first line states its version and number of text lines."""
    line = source.first_line()
    found = _TITLE.search(line.text) if line is not None else None
    if line is None or found is None:
        return None
    reason = f"line {source.line_number(line.start)} says {found[0] + ' lines)'!r}"
    return Recognised("COSMOS", reason, functools.partial(_read, source, line))


def _read(source: Source, first: Line, request: Request) -> list[Channel]:
    found: list[Channel] = []
    others: list[str] = []
    title: Line | None = first
    while title is not None:
        header = _header(source, title)
        end = csmip.data_end(source, header.data.next, _TITLE)
        if header.quantity.startswith("accel"):
            found.append(_channel(source, request, header, end, len(found) + 1))
        else:
            others.append(header.quantity)
        title = source.first_line(csmip.after_trailer(source, end))
    if not found:
        raise source.error(f"this file holds {others[0]!r}; give the file of the processed acceleration")
    return found


def _header(source: Source, title: Line) -> _CosmosHeader:
    stated = _TITLE.search(title.text)
    if stated is None:
        raise source.error(
            "a channel's title with '(Format v01.20 ...' should stand here; correct the file", title.start
        )
    text = source.lines(title.start, max(int(stated[1]), 1))
    _, after = _numbers(source, text[-1].next, "integer")
    reals, after = _numbers(source, after, "real")
    data = source.line(after)
    if comments := _COMMENTS.match(data.text):
        data = source.line(_after(source, data, int(comments[1])))
    found = _DATA_LINE.match(data.text)
    if found is None:
        raise source.error("the line with the number of points should stand here; get the file again", data.start)
    return _CosmosHeader(text, reals, data, int(found[1]), found[2].lower())


def _numbers(source: Source, start: int, kind: str) -> tuple[Floats, int]:
    line = source.line(start)
    stated = _NUMBERS.match(line.text)
    if stated is None or stated[2].lower() != kind:
        raise source.error(f"a line '... {kind}-header values follow' should stand here; get the file again", start)
    end = _after(source, line, int(stated[3]))
    layout = csmip.layout_in(line.text)
    return read_values(source, line.next, end, layout, Stated(int(stated[1]), start)), end


def _after(source: Source, line: Line, count: int) -> int:
    """Return the offset after the `count` lines that follow `line`."""
    return [line, *source.lines(line.next, count)][-1].next


def _channel(source: Source, request: Request, header: _CosmosHeader, end: int, ordinal: int) -> Channel:
    line, text = header.data, header.text
    found = _UNITS.search(line.text)
    spelling = found[1] if found else ""
    unit = request.units(source, spelling, line.start)
    dt = request.step(source, _step(source, header), line.start)
    layout, stated = csmip.layout_in(line.text), Stated(header.points, line.start)
    values = read_values(source, line.next, end, layout, stated)
    flag = first_match(_UNKNOWN, text)
    if flag is not None and (values == float(flag[1])).any():
        raise source.error(
            f"some values are {flag[1]}, which here means 'unknown'; get a record without gaps", line.start
        )
    number, name, place = ordinal, "", ""
    if channel := first_match(_CHANNEL, text):
        number = int(channel[1]) if re.fullmatch(r"\d{1,6}", channel[1], re.ASCII) else ordinal
        name, place = " ".join(channel[2].split("  ")[0].split()), csmip.location(channel.string)
    name = name or f"channel {number}"
    station = first_match(_STATION, text)
    return channel_of(
        source,
        "COSMOS",
        values,
        unit,
        line.start,
        spelling=spelling,
        facts={"stage": text[0].text.split("(")[0].strip(), "location": place},
        name=name,
        number=number,
        dt=dt,
        azimuth=csmip.azimuth(name),
        station=" ".join((station[2] or station[1]).split()) if station else "",
        event=text[1].text.strip() if len(text) > 1 else "",
    )


def _step(source: Source, header: _CosmosHeader) -> float:
    """Return the step (s) that fits the stated duration: real header 62 is in ms, 34, that of the raw data, in s."""
    reals, at = header.reals, header.data.start
    written = [float(reals[k - 1]) / unit for k, unit in ((62, 1000.0), (34, 1.0)) if len(reals) >= k]
    steps = [step for step in written if step > 0.0 and math.isfinite(step)]
    if not steps:
        raise source.error("real headers 34 and 62 give no sampling step; get the file again", at)
    stated = _DURATION.search(header.data.text)
    if stated is None or int(stated[1]) == 0:
        return steps[0]
    # The duration is printed in whole seconds, by some without the last interval.
    duration = int(stated[1])
    fitting = [step for step in steps if abs(header.points * step - duration) <= 1.0 + step]
    if not fitting:
        raise source.error(f"{header.points} points at {steps[0]:g} s do not last {duration} s; correct the header", at)
    return fitting[0]
