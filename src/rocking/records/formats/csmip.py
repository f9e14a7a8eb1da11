"""CSMIP V1, uncorrected accelerograms, and V2, corrected ones; and what COSMOS has in common with them.

V1 has channel after channel, each with text, integer and real headers. Today's files state count, rate, units and
columns in a line before the data. Older ones, and those of networks that took the format over, have no such line:
pairs of time and acceleration follow the headers at once, in columns 10F7.3 that touch, in seconds and g/10.

V2 has three headers for each channel, then acceleration, velocity and displacement. Only the acceleration is read. The
line before it prints the step with three decimals; real header 53 holds more of them, and is used where both agree.
"""

from __future__ import annotations

import functools
import itertools
import re
from typing import Any, NamedTuple

from rocking.core.arrays import Floats
from rocking.records.formats.channel import (
    Channel,
    Recognised,
    channel_of,
    first_fault,
    first_match,
    step_or_times,
)
from rocking.records.formats.source import Line, Request, Source
from rocking.records.formats.values import Layout, Stated, bad_number, numeric_end, parse, read_values
from rocking.records.units import Unit


class _Volume(NamedTuple):
    """A kind of file: its titles, the line before its samples, and where its headers contain what."""

    name: str
    words: str
    title: re.Pattern[str]
    data_line: re.Pattern[str]
    units: re.Pattern[str]
    columns: Layout | None
    header_lines: int
    text_lines: int
    event_line: int


_V1 = _Volume(
    "CSMIP V1",
    "Uncorrected",
    re.compile(r"^\s*uncorrected accelerogram", re.IGNORECASE),
    re.compile(
        r"^\s*(\d{1,12})\s+accel\w*\s+points\s+at\s+(\S+)\s*(?:pts|points|samples|sps)", re.IGNORECASE | re.ASCII
    ),
    re.compile(r"units\s+of\s+([A-Za-z0-9/^]+)", re.IGNORECASE),
    columns=None,
    header_lines=40,
    text_lines=13,
    event_line=1,
)
_V2 = _Volume(
    "CSMIP V2",
    "Corrected",
    re.compile(r"^\s*corrected accelerogram", re.IGNORECASE),
    re.compile(r"^\s*(\d{1,12})\s+points\s+of\s+accel\w*\s+data\b.*?\bat\s+(\S+)\s*sec", re.IGNORECASE | re.ASCII),
    re.compile(r"(?:units:|\bin)\s*([A-Za-z0-9/^]+)", re.IGNORECASE),
    columns=Layout(per_line=8, width=10),
    header_lines=70,
    text_lines=25,
    event_line=2,
)
#: Titles of GeoNet and of USC, which begin alike; their headers are others.
_OTHER_LAYOUT = re.compile(
    r"^\s*(?:un)?corrected accelerogram(?: \d{8}_\d{6}_|.*\bfile\s+\d)|^\s*file\s+\d+ of uncorrected accelerogram",
    re.IGNORECASE | re.ASCII,
)
_CHANNEL = re.compile(r"^\s*chan\S*\s*(\d{1,6})\s*:\s*(.*)$", re.IGNORECASE | re.ASCII)
_STATION = re.compile(r"^\s*sta\w*\s+(?:no|id)\b\.?\s*(.*)$", re.IGNORECASE)
_STATION_CHANNEL = re.compile(r"\(sta\S*\s+ch\S*\s*(\d{1,6})\s*\)", re.IGNORECASE | re.ASCII)
_LOCATION = re.compile(r"location\s*:\s*(.*)$", re.IGNORECASE)
_AZIMUTH = re.compile(r"^(\d{1,3}(?:\.\d*)?)\s*deg", re.IGNORECASE | re.ASCII)
_FORMAT = re.compile(r"\(\s*(\d{1,3})\s*[EFGI]\s*(\d{1,3})(?:\.\d+)?\s*\)", re.IGNORECASE | re.ASCII)
_END_OF_DATA = re.compile(r"^\s*(/&|-*\s*end[ -]of[ -]data)", re.IGNORECASE)
_PAIR_UNITS = re.compile(r"^\s*units\b.*\bsec\w*\s+and\s+([A-Za-z0-9/^]+)", re.IGNORECASE)
_PAIR_COUNT = re.compile(r"no\.?\s*of\s*points\s*=\s*(\d{1,12})", re.IGNORECASE | re.ASCII)
_PAIR_NUMBER_LINES = 14
_NEXT_QUANTITY = re.compile(r"^\s*\d+\s+points\s+of\s+(?:veloc|displ)", re.IGNORECASE)
_V2_DATA = re.compile(rb"(?im)^[ \t]*\d{1,12}[ \t]+points[ \t]+of[ \t]+accel")
_V2_TITLE = re.compile(rb"(?im)^[ \t]*corrected accelerogram")
_V2_REAL_LINES = 13

_NO_DATA_LINE = "if the file is cut, get it again; if its layout is another one, write it as a text table"


def recognise(source: Source) -> Recognised | None:
    """Return the format if the first line is its title; refuse other layouts with such a title."""
    line = source.first_line()
    if line is None:
        return None
    if _OTHER_LAYOUT.search(line.text):
        text = "this accelerogram has the layout of GeoNet or USC, which is not read here"
        raise source.error(f"{text}; write it as a text table", line.start)
    for volume in (_V1, _V2):
        if volume.title.search(line.text):
            reason = f"line {source.line_number(line.start)} begins '{volume.words} Accelerogram'"
            return Recognised(volume.name, reason, functools.partial(_read, source, volume, line.start))
    return None


def azimuth(name: str) -> float | None:
    """Return the direction in a name such as "90 Deg", in degrees clockwise from north, or None."""
    found = _AZIMUTH.match(name)
    return float(found[1]) % 360.0 if found else None


def location(text: str) -> str:
    """Return what follows "Location:" in `text`, or an empty string."""
    found = _LOCATION.search(text)
    return found[1].strip() if found else ""


def layout_in(text: str) -> Layout | None:
    """Return the Fortran columns that a header such as "... Format: (8f9.6)" states, or None."""
    found = _FORMAT.search(text)
    layout = Layout(int(found[1]), int(found[2])) if found else None
    return layout if layout and all(layout) else None


def data_end(source: Source, start: int, *titles: re.Pattern[str]) -> int:
    """Return where the numbers that begin at `start` end: at a trailer, at one of `titles` or with the file."""
    end = numeric_end(source, start)
    if end == len(source.data):
        return end
    line = source.line(end)
    if _END_OF_DATA.match(line.text) or any(title.search(line.text) for title in titles):
        return end
    raise bad_number(source, end, line.next)


def after_trailer(source: Source, start: int) -> int:
    """Return the offset after the "end of data" line at `start`, or `start` where there is none."""
    line = source.first_line(start)
    return line.next if line is not None and _END_OF_DATA.match(line.text) else start


def _read(source: Source, volume: _Volume, first: int, request: Request) -> list[Channel]:
    channels: list[Channel] = []
    start: int | None = first
    while start is not None:
        channel, end = _channel(source, request, volume, start, len(channels) + 1)
        channels.append(channel)
        if volume is _V1:
            title = source.first_line(after_trailer(source, end))
            if title is not None and not volume.title.search(title.text):
                raise source.error(
                    "a channel's 'Uncorrected Accelerogram' should begin here; correct the file", title.start
                )
            start = None if title is None else title.start
        else:  # velocity and displacement follow
            found = _V2_TITLE.search(source.data, end)
            start = None if found is None else found.start()
            lost = _V2_DATA.search(source.data, end, len(source.data) if start is None else start)
            if lost is not None:
                raise source.error("this channel's header lacks its title; get the whole file again", lost.start())
    return channels


def _channel(source: Source, request: Request, volume: _Volume, start: int, ordinal: int) -> tuple[Channel, int]:
    header: list[Line] = []
    for line in source.lines(start, volume.header_lines):
        if header and volume.title.search(line.text):
            break  # what follows is the next channel's
        header.append(line)
        if stated := volume.data_line.match(line.text):
            return _samples(source, request, volume, header, stated, ordinal)
    if volume is _V1:
        return _pairs(source, request, header[: _V1.text_lines + _PAIR_NUMBER_LINES], ordinal)
    raise source.error(f"no line 'points of accel data' ends this channel's header; {_NO_DATA_LINE}", start)


def _samples(
    source: Source, request: Request, volume: _Volume, header: list[Line], stated: re.Match[str], ordinal: int
) -> tuple[Channel, int]:
    line = header[-1]
    found = volume.units.search(line.text, stated.end())
    spelling = found[1] if found else ""
    unit = request.units(source, spelling, line.start)
    dt = request.step(source, _step(source, volume, header, stated[2]), line.start)
    end = data_end(source, line.next, volume.title, *([_NEXT_QUANTITY] if volume is _V2 else []))
    layout = layout_in(line.text) or volume.columns
    values = read_values(source, line.next, end, layout, Stated(int(stated[1]), line.start))
    known = {"dt": dt, "spelling": spelling}
    return _labelled(source, volume, header, ordinal, values, unit, line.start, **known), end


def _step(source: Source, volume: _Volume, header: list[Line], printed: str) -> float:
    number, at = parse(printed.encode("latin-1")), header[-1].start
    if volume is _V1:
        if number is None or not number > 0.0:
            raise source.error(f"the sampling rate {printed!r} is not a positive number; correct it", at)
        return 1.0 / number
    if number is None:
        raise source.error(f"the sampling step {printed!r} is not a number; correct it", at)
    if len(header) <= _V2_REAL_LINES:
        return number
    # Real header 53, in columns 8F10, of those that end just before the line of the data.
    finer = parse(header[5 - _V2_REAL_LINES].text[40:50].strip().encode("latin-1"))
    place = 10.0 ** -len(printed.partition(".")[2])
    return finer if finer is not None and abs(finer - number) <= 0.5 * place else number


def _pairs(source: Source, request: Request, header: list[Line], ordinal: int) -> tuple[Channel, int]:
    text, numbers, at = header[: _V1.text_lines], header[_V1.text_lines :], header[0].start
    points, spelling = first_match(_PAIR_COUNT, text), first_match(_PAIR_UNITS, text)
    complete = len(numbers) == _PAIR_NUMBER_LINES and numeric_end(source, numbers[0].start) >= numbers[-1].next
    if points is None or spelling is None or not complete:
        raise source.error(f"no line 'points at ... in units of ...' ends this channel's header; {_NO_DATA_LINE}", at)
    unit = request.units(source, spelling[1], at)
    start = header[-1].next
    end = data_end(source, start, _V1.title)
    values = read_values(source, start, end, Layout(per_line=10, width=7), Stated(2 * int(points[1]), at))
    if first_fault(values[0::2]) is not None:
        raise source.error("the times of the points that follow do not increase throughout; correct the file", start)
    dt, times = step_or_times(source, request, values[0::2], start)
    known = {"dt": dt, "times": times, "spelling": spelling[1]}
    return _labelled(source, _V1, header, ordinal, values[1::2], unit, at, **known), end


def _labelled(
    source: Source, volume: _Volume, header: list[Line], ordinal: int, values: Floats, unit: Unit, at: int, **known: Any
) -> Channel:
    text = header[: volume.text_lines]
    station, facts = "", {}
    for line, following in itertools.pairwise(text):
        if found := _STATION.match(line.text):
            station = following.text[:40].strip() or found[1].split("  ")[0]
            facts["station line"] = " ".join(line.text.split())
            break
    number, name, direction = ordinal, f"channel {ordinal}", None
    if channel := first_match(_CHANNEL, text):
        number, words = int(channel[1]), channel[2].strip()
        name = re.split(r"\s{2,}|\(|location\s*:", words, maxsplit=1, flags=re.IGNORECASE)[0].strip()
        direction, name = azimuth(name), name or f"channel {number}"
        place = _STATION_CHANNEL.search(words)
        facts |= {"station channel": place[1] if place else "", "location": location(words)}
    event = header[volume.event_line].text.split("   ")[0].strip() if len(header) > volume.event_line else ""
    known |= {"name": name, "number": number, "azimuth": direction, "station": station, "event": event, "facts": facts}
    return channel_of(source, volume.name, values, unit, at, **known)
