"""PEER AT2: header lines, NPTS and DT in the last of them, then the accelerations in g, five to a line.

The last header line comes in several shapes: ``NPTS=  5372, DT= .0100 SEC,`` (NGA) or ``4096    0.0100    NPTS, DT``
(the older database), in any spacing and case. VT2 and DT2 files look alike but hold velocities, displacements.
"""

from __future__ import annotations

import functools
import re
from typing import Any

from rocking.records.formats.channel import Channel, Recognised, azimuth_of, channel_of, first_match
from rocking.records.formats.source import Line, Request, Source
from rocking.records.formats.values import NUMBER, Layout, Stated, parse, read_values

_KEYS_FIRST = re.compile(rf"NPTS\s*[=:]?\s*(\d{{1,12}})\b.*?\bDT\s*[=:]?\s*({NUMBER})", re.IGNORECASE)
_VALUES_FIRST = re.compile(rf"^\s*(\d{{1,12}})[\s,]+({NUMBER})[\s,]+NPTS\s*,\s*DT\b", re.IGNORECASE)
_UNITS = re.compile(r"UNITS\s+OF\s+([A-Z0-9/^*]+)", re.IGNORECASE)
_OTHER_QUANTITY = re.compile(r"\b(VELOCITY|DISPLACEMENT)\s+TIME\b", re.IGNORECASE)
#: Who owns the station, and its number there, at the end of a title.
_OWNER = re.compile(r"(.*?)[\s,]*\(([^()]*)\)")
_EXTENSIONS = {"velocity": "VT2", "displacement": "DT2"}


def recognise(source: Source) -> Recognised | None:
    """Return the format if one of the first lines gives NPTS and DT."""
    lines = source.lines(0, 12)
    for index, line in enumerate(lines):
        found = _VALUES_FIRST.search(line.text) or _KEYS_FIRST.search(line.text)
        dt = parse(found[2].encode("latin-1")) if found else None
        if found and dt is not None:
            titles = lines[:index]
            other = first_match(_OTHER_QUANTITY, titles)
            name = f"PEER {_EXTENSIONS[other[1].lower()] if other else 'AT2'}"
            reason = f"line {source.line_number(line.start)} gives NPTS and DT"
            return Recognised(name, reason, functools.partial(_read, source, titles, line, int(found[1]), dt))
    return None


def _read(source: Source, titles: list[Line], sizes: Line, points: int, dt: float, request: Request) -> list[Channel]:
    for line in titles:
        if other := _OTHER_QUANTITY.search(line.text):
            quantity = other[1].lower()
            raise source.error(f"this PEER file holds {quantity}; give the AT2 file of the acceleration", line.start)
    found = first_match(_UNITS, titles)
    spelling = found[1] if found else ""
    unit = request.units(source, spelling, sizes.start)
    dt = request.step(source, dt, sizes.start)
    stated = Stated(points, sizes.start, "NPTS")
    values = read_values(source, sizes.next, len(source.data), Layout(per_line=5, width=15), stated)
    # "event, date, station, component (owner)", "event, station, component" or "..., component, (owner)"
    title = titles[1].text.strip() if len(titles) > 1 else ""
    owned = _OWNER.fullmatch(title)
    text, owner = owned.groups() if owned else (title, "")
    event, station, name = title, "", "acceleration"
    if len(parts := [part.strip() for part in text.split(",")]) >= 3:
        event, station, name = ", ".join(parts[:-2]), parts[-2], parts[-1] or name
    else:
        owner = ""
    known: dict[str, Any] = {
        "name": name,
        "number": 1,
        "dt": dt,
        "azimuth": azimuth_of(name),
        "station": station,
        "event": event,
    }
    facts = {"station line": owner}
    return [channel_of(source, "PEER AT2", values, unit, sizes.start, spelling=spelling, facts=facts, **known)]
