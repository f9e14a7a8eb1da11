"""PEER AT2: header lines, NPTS and DT in the last of them, then the accelerations in g, five to a line.

The last header line comes in several shapes: ``NPTS=  5372, DT= .0100 SEC,`` (NGA) or ``4096    0.0100    NPTS, DT``
(the older database), in any spacing and case. VT2 and DT2 files look alike but hold velocities, displacements.
"""

from __future__ import annotations

import functools
import re
from typing import NamedTuple

from rocking.motion.formats.channel import Channel, Identification, Recognised, azimuth_of, to_acceleration
from rocking.motion.formats.source import Line, Request, Source
from rocking.motion.formats.values import NUMBER, Layout, Stated, parse, read_values

NAME = "PEER AT2"

_HEADER_LINES = 12
_LAYOUT = Layout(per_line=5, width=15)
_KEYS_FIRST = re.compile(rf"NPTS\s*[=:]?\s*(\d{{1,12}})\b.*?\bDT\s*[=:]?\s*({NUMBER})", re.IGNORECASE)
_VALUES_FIRST = re.compile(rf"^\s*(\d{{1,12}})[\s,]+({NUMBER})[\s,]+NPTS\s*,\s*DT\b", re.IGNORECASE)
_UNITS = re.compile(r"UNITS\s+OF\s+([A-Z0-9/^*]+)", re.IGNORECASE)
_OTHER_QUANTITY = re.compile(r"\b(VELOCITY|DISPLACEMENT)\s+TIME\b", re.IGNORECASE)
#: Who owns the station, and its number there, at the end of a title.
_OWNER = re.compile(r"(.*?)[\s,]*\(([^()]*)\)")
_EXTENSIONS = {"velocity": "VT2", "displacement": "DT2"}


class _PeerHeader(NamedTuple):
    titles: list[Line]
    sizes: Line
    points: int
    dt: float


def recognise(source: Source) -> Recognised | None:
    """Return the format if one of the first lines gives NPTS and DT."""
    header = _header(source)
    if header is None:
        return None
    other = _other_quantity(header)
    name = f"PEER {_EXTENSIONS[other[0]]}" if other else NAME
    reason = f"line {source.line_number(header.sizes.start)} gives NPTS and DT"
    return Recognised(Identification(name, reason), functools.partial(_read, source, header, other))


def _read(source: Source, header: _PeerHeader, other: tuple[str, int] | None, request: Request) -> list[Channel]:
    if other:
        raise source.error(f"this PEER file holds {other[0]}; give the AT2 file of the acceleration", other[1])
    at = header.sizes.start
    spelling = next((found[1] for line in header.titles if (found := _UNITS.search(line.text))), "")
    unit = request.units(source, spelling, at)
    dt = request.step(source, header.dt, at)
    stated = Stated(header.points, at, "NPTS")
    values = read_values(source, header.sizes.next, len(source.data), _LAYOUT, stated)
    title = header.titles[1].text.strip() if len(header.titles) > 1 else ""
    event, station, name, owner = _places(title)
    return [
        Channel(
            name=name,
            number=1,
            acceleration=to_acceleration(source, at, values, unit),
            dt=dt,
            azimuth=azimuth_of(name),
            units=spelling or unit.name,
            station=station,
            event=event,
            metadata={"format": NAME, "file": source.file} | ({"station line": owner} if owner else {}),
        )
    ]


def _header(source: Source) -> _PeerHeader | None:
    lines = source.lines(0, _HEADER_LINES)
    for index, line in enumerate(lines):
        found = _VALUES_FIRST.search(line.text) or _KEYS_FIRST.search(line.text)
        dt = parse(found[2].encode("latin-1")) if found else None
        if found and dt is not None:
            return _PeerHeader(lines[:index], line, int(found[1]), dt)
    return None


def _other_quantity(header: _PeerHeader) -> tuple[str, int] | None:
    """Return what the file holds instead of acceleration, and where it says so, or None."""
    for line in header.titles:
        found = _OTHER_QUANTITY.search(line.text)
        if found:
            return found[1].lower(), line.start
    return None


def _places(title: str) -> tuple[str, str, str, str]:
    """Split "event, date, station, component (owner)" (or "event, station, component", "..., component, (owner)")."""
    owned = _OWNER.fullmatch(title)
    text, owner = owned.groups() if owned else (title, "")
    parts = [part.strip() for part in text.split(",")]
    if len(parts) < 3:
        return title, "", "acceleration", ""
    return ", ".join(parts[:-2]), parts[-2], parts[-1] or "acceleration", owner
