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
from typing import NamedTuple

from rocking.arrays import Floats
from rocking.motion.formats.channel import (
    Channel,
    Identification,
    Recognised,
    first_fault,
    step_or_times,
    to_acceleration,
)
from rocking.motion.formats.source import Line, Request, Source
from rocking.motion.formats.values import Layout, Stated, bad_number, numeric_end, parse, read_values
from rocking.motion.units import Unit

V1_TITLE = re.compile(r"^\s*uncorrected accelerogram", re.IGNORECASE)
V2_TITLE = re.compile(r"^\s*corrected accelerogram", re.IGNORECASE)
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

_NAME_COLUMNS = 40
_NO_DATA_LINE = "if the file is cut, get it again; if its layout is another one, write it as a text table"


def recognise(source: Source) -> Recognised | None:
    """Return the format if the first line is its title; refuse other layouts with such a title."""
    line = source.first_line()
    if line is not None and _OTHER_LAYOUT.search(line.text):
        text = "this accelerogram has the layout of GeoNet or USC, which is not read here"
        raise source.error(f"{text}; write it as a text table", line.start)
    kinds = ("CSMIP V1", V1_TITLE, "Uncorrected", _read_v1), ("CSMIP V2", V2_TITLE, "Corrected", _read_v2)
    for form, title, words, read in kinds:
        if line is not None and title.search(line.text):
            reason = f"line {source.line_number(line.start)} begins '{words} Accelerogram'"
            return Recognised(Identification(form, reason), functools.partial(read, source, line))
    return None


class Labels(NamedTuple):
    """What the text header of one channel says."""

    number: int
    name: str
    azimuth: float | None
    station: str
    metadata: dict[str, str]


def labels(header: list[Line], ordinal: int) -> Labels:
    """Return the labels in the text header of the file's channel number `ordinal`."""
    station, metadata = _station(header)
    channel = next((found for line in header if (found := _CHANNEL.match(line.text))), None)
    if channel is None:
        return Labels(ordinal, f"channel {ordinal}", None, station, metadata)
    name = re.split(r"\s{2,}|\(|location\s*:", channel[2].strip(), maxsplit=1, flags=re.IGNORECASE)[0].strip()
    metadata |= _place(channel[2])
    return Labels(int(channel[1]), name or f"channel {channel[1]}", azimuth(name), station, metadata)


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
    if found is None or int(found[1]) == 0 or int(found[2]) == 0:
        return None
    return Layout(int(found[1]), int(found[2]))


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


def _station(header: list[Line]) -> tuple[str, dict[str, str]]:
    for line, following in itertools.pairwise(header):
        found = _STATION.match(line.text)
        if found:
            name = following.text[:_NAME_COLUMNS].strip() or found[1].split("  ")[0]
            return name, {"station line": " ".join(line.text.split())}
    return "", {}


def _place(text: str) -> dict[str, str]:
    number, place = _STATION_CHANNEL.search(text), location(text)
    return ({"station channel": number[1]} if number else {}) | ({"location": place} if place else {})


_V1_TEXT_LINES = 13
_V1_NUMBER_LINES = 14
_V1_HEADER_LINES = 40
_V1_PAIRS = Layout(per_line=10, width=7)
_V1_DATA_LINE = re.compile(
    r"^\s*(\d{1,12})\s+accel\w*\s+points\s+at\s+(\S+)\s*(?:pts|points|samples|sps)", re.IGNORECASE | re.ASCII
)
_V1_UNITS = re.compile(r"units\s+of\s+([A-Za-z0-9/^]+)", re.IGNORECASE)
_V1_PAIR_UNITS = re.compile(r"^\s*units\b.*\bsec\w*\s+and\s+([A-Za-z0-9/^]+)", re.IGNORECASE)
_V1_POINTS = re.compile(r"no\.?\s*of\s*points\s*=\s*(\d{1,12})", re.IGNORECASE | re.ASCII)


def _read_v1(source: Source, first: Line, request: Request) -> list[Channel]:
    found: list[Channel] = []
    title: Line | None = first
    while title is not None:
        if not V1_TITLE.search(title.text):
            raise source.error(
                "a channel's 'Uncorrected Accelerogram' should begin here; correct the file", title.start
            )
        channel, end = _v1_channel(source, request, title.start, len(found) + 1)
        found.append(channel)
        title = source.first_line(after_trailer(source, end))
    return found


def _v1_channel(source: Source, request: Request, start: int, ordinal: int) -> tuple[Channel, int]:
    lines = source.lines(start, _V1_HEADER_LINES)
    for index, line in enumerate(lines):
        if index and V1_TITLE.search(line.text):
            break  # what follows is the next channel's
        stated = _V1_DATA_LINE.match(line.text)
        if stated:
            return _v1_samples(source, request, lines[: index + 1], stated, ordinal)
    return _v1_pairs(source, request, lines[: _V1_TEXT_LINES + _V1_NUMBER_LINES], ordinal)


def _v1_samples(
    source: Source, request: Request, header: list[Line], stated: re.Match[str], ordinal: int
) -> tuple[Channel, int]:
    line = header[-1]
    rate = parse(stated[2].encode("latin-1"))
    if rate is None or not rate > 0.0:
        raise source.error(f"the sampling rate {stated[2]!r} is not a positive number; correct it", line.start)
    spelling = _V1_UNITS.search(line.text)
    unit = request.units(source, spelling[1] if spelling else None, line.start)
    dt = request.step(source, 1.0 / rate, line.start)
    end = data_end(source, line.next, V1_TITLE)
    values = read_values(source, line.next, end, layout_in(line.text), Stated(int(stated[1]), line.start))
    units, acceleration = spelling[1] if spelling else unit.name, to_acceleration(source, line.start, values, unit)
    return _v1_labelled(source, header, ordinal, units, acceleration, dt, None), end


def _v1_pairs(source: Source, request: Request, header: list[Line], ordinal: int) -> tuple[Channel, int]:
    points, spelling, unit = _v1_pair_header(source, request, header)
    start, at = header[-1].next, header[0].start
    end = data_end(source, start, V1_TITLE)
    values = read_values(source, start, end, _V1_PAIRS, Stated(2 * points, at))
    times, acceleration = values[0::2], to_acceleration(source, at, values[1::2], unit)
    if first_fault(times) is not None:
        raise source.error("the times of the points that follow do not increase throughout; correct the file", start)
    dt, uneven = step_or_times(source, request, times, start)
    return _v1_labelled(source, header, ordinal, spelling, acceleration, dt, uneven), end


def _v1_pair_header(source: Source, request: Request, header: list[Line]) -> tuple[int, str, Unit]:
    text, numbers = header[:_V1_TEXT_LINES], header[_V1_TEXT_LINES:]
    points = next((found[1] for line in text if (found := _V1_POINTS.search(line.text))), None)
    spelling = next((found[1] for line in text if (found := _V1_PAIR_UNITS.search(line.text))), None)
    complete = len(numbers) == _V1_NUMBER_LINES and numeric_end(source, numbers[0].start) >= numbers[-1].next
    if points is None or spelling is None or not complete:
        raise source.error(
            f"no line 'points at ... in units of ...' ends this channel's header; {_NO_DATA_LINE}", header[0].start
        )
    return int(points), spelling, request.units(source, spelling, header[0].start)


def _v1_labelled(
    source: Source,
    header: list[Line],
    ordinal: int,
    units: str,
    acceleration: Floats,
    dt: float | None,
    times: Floats | None,
) -> Channel:
    label = labels(header[:_V1_TEXT_LINES], ordinal)
    return Channel(
        name=label.name,
        number=label.number,
        acceleration=acceleration,
        dt=dt,
        times=times,
        azimuth=label.azimuth,
        units=units,
        station=label.station,
        event=header[1].text.split("   ")[0].strip() if len(header) > 1 else "",
        metadata={"format": "CSMIP V1", "file": source.file, **label.metadata},
    )


_V2_TEXT_LINES = 25
_V2_EVENT_LINE = 2
_V2_REAL_LINES = 13
_V2_COLUMNS = Layout(per_line=8, width=10)
_V2_STEP_INDEX = 52
_V2_HEADER_LINES = 70
_V2_DATA_LINE = re.compile(
    r"^\s*(\d{1,12})\s+points\s+of\s+accel\w*\s+data\b.*?\bat\s+(\S+)\s*sec", re.IGNORECASE | re.ASCII
)
_V2_UNITS = re.compile(r"(?:units:|\bin)\s*([A-Za-z0-9/^]+)", re.IGNORECASE)
_V2_NEXT_QUANTITY = re.compile(r"^\s*\d+\s+points\s+of\s+(?:veloc|displ)", re.IGNORECASE)
_V2_DATA = re.compile(rb"(?im)^[ \t]*\d{1,12}[ \t]+points[ \t]+of[ \t]+accel")
_V2_TITLE = re.compile(rb"(?im)^[ \t]*corrected accelerogram")


def _read_v2(source: Source, first: Line, request: Request) -> list[Channel]:
    found: list[Channel] = []
    start: int | None = first.start
    while start is not None:
        channel, end = _v2_channel(source, request, start, len(found) + 1)
        found.append(channel)
        title = _V2_TITLE.search(source.data, end)
        start = None if title is None else title.start()
        lost = _V2_DATA.search(source.data, end, len(source.data) if start is None else start)
        if lost is not None:
            raise source.error("this channel's header lacks its title; get the whole file again", lost.start())
    return found


def _v2_channel(source: Source, request: Request, start: int, ordinal: int) -> tuple[Channel, int]:
    lines = source.lines(start, _V2_HEADER_LINES)
    for index, line in enumerate(lines):
        if index and V2_TITLE.search(line.text):
            break  # what follows is the next channel's
        stated = _V2_DATA_LINE.match(line.text)
        if stated:
            return _v2_acceleration(source, request, lines[: index + 1], stated, ordinal)
    raise source.error(f"no line 'points of accel data' ends this channel's header; {_NO_DATA_LINE}", start)


def _v2_acceleration(
    source: Source, request: Request, header: list[Line], stated: re.Match[str], ordinal: int
) -> tuple[Channel, int]:
    line = header[-1]
    spelling = _V2_UNITS.search(line.text, stated.end())
    unit = request.units(source, spelling[1] if spelling else None, line.start)
    dt = request.step(source, _v2_step(source, header, stated[2]), line.start)
    end = data_end(source, line.next, V2_TITLE, _V2_NEXT_QUANTITY)
    layout = layout_in(line.text) or _V2_COLUMNS
    values = read_values(source, line.next, end, layout, Stated(int(stated[1]), line.start))
    label = labels(header[:_V2_TEXT_LINES], ordinal)
    channel = Channel(
        name=label.name,
        number=label.number,
        acceleration=to_acceleration(source, line.start, values, unit),
        dt=dt,
        azimuth=label.azimuth,
        units=spelling[1] if spelling else unit.name,
        station=label.station,
        event=header[_V2_EVENT_LINE].text.split("   ")[0].strip() if len(header) > _V2_EVENT_LINE else "",
        metadata={"format": "CSMIP V2", "file": source.file, **label.metadata},
    )
    return channel, end


def _v2_step(source: Source, header: list[Line], printed: str) -> float:
    step = parse(printed.encode("latin-1"))
    if step is None:
        raise source.error(f"the sampling step {printed!r} is not a number; correct it", header[-1].start)
    place = 10.0 ** -len(printed.partition(".")[2])
    finer = _v2_real_step(header)
    return finer if finer is not None and abs(finer - step) <= 0.5 * place else step


def _v2_real_step(header: list[Line]) -> float | None:
    """Return the step among the real headers, which end just before the line of the data, or None."""
    if len(header) <= _V2_REAL_LINES:
        return None
    row, column = divmod(_V2_STEP_INDEX, _V2_COLUMNS.per_line)
    start = column * _V2_COLUMNS.width
    field = header[-1 - _V2_REAL_LINES + row].text[start : start + _V2_COLUMNS.width]
    return parse(field.strip().encode("latin-1"))
