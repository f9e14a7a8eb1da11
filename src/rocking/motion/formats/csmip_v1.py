"""CSMIP V1, uncorrected accelerograms: channel after channel, each with text, integer and real headers.

Today's files state count, rate, units and columns in a line before the data. Older ones, and those of networks
that took the format over, have no such line: pairs of time and acceleration follow the headers at once, in
columns 10F7.3 that touch, in seconds and g/10.
"""

from __future__ import annotations

import re

from rocking.arrays import Floats
from rocking.motion.formats import csmip
from rocking.motion.formats.aligned import Layout
from rocking.motion.formats.channel import Channel, to_acceleration
from rocking.motion.formats.identification import Identification
from rocking.motion.formats.request import Request
from rocking.motion.formats.source import Line, Source
from rocking.motion.formats.timing import even_step, first_fault
from rocking.motion.formats.units import Unit, find_unit
from rocking.motion.formats.values import expect, numeric_end, parse, read_values

NAME = "CSMIP V1"

_TEXT_LINES = 13
_NUMBER_LINES = 14
_HEADER_LINES = 40
_PAIRS = Layout(per_line=10, width=7)
_DATA_LINE = re.compile(
    r"^\s*(\d{1,12})\s+accel\w*\s+points\s+at\s+(\S+)\s*(?:pts|points|samples|sps)", re.IGNORECASE | re.ASCII
)
_UNITS = re.compile(r"units\s+of\s+([A-Za-z0-9/^]+)", re.IGNORECASE)
_PAIR_UNITS = re.compile(r"^\s*units\b.*\bsec\w*\s+and\s+([A-Za-z0-9/^]+)", re.IGNORECASE)
_POINTS = re.compile(r"no\.?\s*of\s*points\s*=\s*(\d{1,12})", re.IGNORECASE | re.ASCII)


def recognise(source: Source) -> Identification | None:
    """Return the format if the first line is its title."""
    line = source.first_line()
    if line is None or not csmip.V1_TITLE.search(line.text):
        return None
    return Identification(NAME, f"line {source.line_number(line.start)} begins 'Uncorrected Accelerogram'")


def read(source: Source, request: Request) -> list[Channel]:
    """Return all channels of the file.

    Raises
    ------
    UnreadableRecord
        If a header is incomplete or a channel has more or fewer values than its header says.
    """
    found: list[Channel] = []
    title = source.first_line()
    while title is not None:
        if not csmip.V1_TITLE.search(title.text):
            raise source.error("a channel's 'Uncorrected Accelerogram' should begin here; mend the file", title.start)
        channel, end = _channel(source, request, title.start, len(found) + 1)
        found.append(channel)
        title = source.first_line(csmip.after_trailer(source, end))
    return found


def _channel(source: Source, request: Request, start: int, ordinal: int) -> tuple[Channel, int]:
    lines = source.lines(start, _HEADER_LINES)
    for index, line in enumerate(lines[_TEXT_LINES:], _TEXT_LINES):
        stated = _DATA_LINE.match(line.text)
        if stated:
            return _samples(source, request, lines[: index + 1], stated, ordinal)
    return _pairs(source, request, lines[: _TEXT_LINES + _NUMBER_LINES], ordinal)


def _samples(
    source: Source, request: Request, header: list[Line], stated: re.Match[str], ordinal: int
) -> tuple[Channel, int]:
    line = header[-1]
    rate = parse(stated[2].encode("latin-1"))
    if rate is None or not rate > 0.0:
        raise source.error(f"the sampling rate {stated[2]!r} is not a positive number; correct it", line.start)
    spelling = _UNITS.search(line.text)
    unit = request.units(source, find_unit(spelling[1]) if spelling else None, line.start)
    dt = request.step(source, 1.0 / rate, line.start)
    end = csmip.data_end(source, line.next, csmip.V1_TITLE)
    count, layout = int(stated[1]), csmip.layout_in(line.text)
    values = expect(source, line.start, count, read_values(source, line.next, end, count=count, layout=layout))
    units = spelling[1] if spelling else unit.name
    return _labelled(source, header, ordinal, units, to_acceleration(source, line.start, values, unit), dt, None), end


def _pairs(source: Source, request: Request, header: list[Line], ordinal: int) -> tuple[Channel, int]:
    points, spelling, unit = _pair_header(source, request, header)
    start, at = header[-1].next, header[0].start
    end = csmip.data_end(source, start, csmip.V1_TITLE)
    values = expect(source, at, 2 * points, read_values(source, start, end, count=2 * points, layout=_PAIRS))
    times, acceleration = values[0::2], to_acceleration(source, at, values[1::2], unit)
    if first_fault(times) is not None:
        raise source.error("the times of the points that follow do not increase throughout; mend the file", start)
    dt = even_step(times)
    if dt is None:
        return _labelled(source, header, ordinal, spelling, acceleration, None, times), end
    return _labelled(source, header, ordinal, spelling, acceleration, request.step(source, dt, start), None), end


def _pair_header(source: Source, request: Request, header: list[Line]) -> tuple[int, str, Unit]:
    text, numbers = header[:_TEXT_LINES], header[_TEXT_LINES:]
    points = next((found[1] for line in text if (found := _POINTS.search(line.text))), None)
    spelling = next((found[1] for line in text if (found := _PAIR_UNITS.search(line.text))), None)
    complete = len(numbers) == _NUMBER_LINES and numeric_end(source, numbers[0].start) >= numbers[-1].next
    if points is None or spelling is None or not complete:
        raise source.error(
            "no line 'points at ... in units of ...' ends this channel's header; get the file again", header[0].start
        )
    return int(points), spelling, request.units(source, find_unit(spelling), header[0].start)


def _labelled(
    source: Source,
    header: list[Line],
    ordinal: int,
    units: str,
    acceleration: Floats,
    dt: float | None,
    times: Floats | None,
) -> Channel:
    label = csmip.labels(header[:_TEXT_LINES], ordinal)
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
        metadata={"format": NAME, "file": source.file, **label.metadata},
    )
