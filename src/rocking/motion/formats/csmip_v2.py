"""CSMIP V2, corrected accelerograms: per channel three headers, then acceleration, velocity and displacement.

Only the acceleration is read. The line before it prints the step with three decimals; real header 53 holds more
of them, and is used where both agree.
"""

from __future__ import annotations

import re

from rocking.motion.formats import csmip
from rocking.motion.formats.aligned import Layout
from rocking.motion.formats.channel import Channel, to_acceleration
from rocking.motion.formats.identification import Identification
from rocking.motion.formats.request import Request
from rocking.motion.formats.source import Line, Source
from rocking.motion.formats.units import find_unit
from rocking.motion.formats.values import expect, parse, read_values

NAME = "CSMIP V2"

_TEXT_LINES = 25
_EVENT_LINE = 2
_REAL_LINES = 13
_COLUMNS = Layout(per_line=8, width=10)
_STEP_INDEX = 52
_HEADER_LINES = 70
_DATA_LINE = re.compile(
    r"^\s*(\d{1,12})\s+points\s+of\s+accel\w*\s+data\b.*?\bat\s+(\S+)\s*sec", re.IGNORECASE | re.ASCII
)
_UNITS = re.compile(r"(?:units:|\bin)\s*([A-Za-z0-9/^]+)", re.IGNORECASE)
_NEXT_QUANTITY = re.compile(r"^\s*\d+\s+points\s+of\s+(?:veloc|displ)", re.IGNORECASE)
_TITLE = re.compile(rb"(?im)^[ \t]*corrected accelerogram")


def recognise(source: Source) -> Identification | None:
    """Return the format if the first line is its title."""
    line = source.first_line()
    if line is None or not csmip.V2_TITLE.search(line.text):
        return None
    return Identification(NAME, f"line {source.line_number(line.start)} begins 'Corrected Accelerogram'")


def read(source: Source, request: Request) -> list[Channel]:
    """Return the accelerations of all channels of the file.

    Raises
    ------
    UnreadableRecord
        If a channel lacks its acceleration, or has more or fewer values than its header says.
    """
    found: list[Channel] = []
    first = source.first_line()
    start = None if first is None else first.start
    while start is not None:
        channel, end = _channel(source, request, start, len(found) + 1)
        found.append(channel)
        title = _TITLE.search(source.data, end)
        start = None if title is None else title.start()
    return found


def _channel(source: Source, request: Request, start: int, ordinal: int) -> tuple[Channel, int]:
    lines = source.lines(start, _HEADER_LINES)
    for index, line in enumerate(lines):
        stated = _DATA_LINE.match(line.text)
        if stated:
            return _acceleration(source, request, lines[: index + 1], stated, ordinal)
    raise source.error("no line 'points of accel data' ends this channel's header; get the file again", start)


def _acceleration(
    source: Source, request: Request, header: list[Line], stated: re.Match[str], ordinal: int
) -> tuple[Channel, int]:
    line = header[-1]
    spelling = _UNITS.search(line.text, stated.end())
    unit = request.units(source, find_unit(spelling[1]) if spelling else None, line.start)
    dt = request.step(source, _step(source, header, stated[2]), line.start)
    end = csmip.data_end(source, line.next, csmip.V2_TITLE, _NEXT_QUANTITY)
    count, layout = int(stated[1]), csmip.layout_in(line.text) or _COLUMNS
    values = expect(source, line.start, count, read_values(source, line.next, end, count=count, layout=layout))
    label = csmip.labels(header[:_TEXT_LINES], ordinal)
    channel = Channel(
        name=label.name,
        number=label.number,
        acceleration=to_acceleration(source, line.start, values, unit),
        dt=dt,
        azimuth=label.azimuth,
        units=spelling[1] if spelling else unit.name,
        station=label.station,
        event=header[_EVENT_LINE].text.split("   ")[0].strip() if len(header) > _EVENT_LINE else "",
        metadata={"format": NAME, "file": source.file, **label.metadata},
    )
    return channel, end


def _step(source: Source, header: list[Line], printed: str) -> float:
    step = parse(printed.encode("latin-1"))
    if step is None:
        raise source.error(f"the sampling step {printed!r} is not a number; correct it", header[-1].start)
    place = 10.0 ** -len(printed.partition(".")[2])
    finer = _real_step(header)
    return finer if finer is not None and abs(finer - step) <= 0.5 * place else step


def _real_step(header: list[Line]) -> float | None:
    """Return the step among the real headers, which end just before the line of the data, or None."""
    if len(header) <= _REAL_LINES:
        return None
    row, column = divmod(_STEP_INDEX, _COLUMNS.per_line)
    start = column * _COLUMNS.width
    field = header[-1 - _REAL_LINES + row].text[start : start + _COLUMNS.width]
    return parse(field.strip().encode("latin-1"))
