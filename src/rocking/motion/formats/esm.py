"""ESM and ITACA ASCII (DYNA headers): lines "KEY: value", then one value to a line."""

from __future__ import annotations

import functools
import re
from datetime import datetime

from rocking.motion.formats.channel import Channel, Identification, Recognised, to_acceleration
from rocking.motion.formats.source import Entry, Request, Source
from rocking.motion.formats.values import Stated, positive_numbers, read_values

NAME = "ESM"

_HEADER_LINES = 200
_KEY = re.compile(r"^([A-Z][A-Z0-9_/^]*)\s*:\s*(.*)$")
_SIGNS = ("DATA_TYPE", "SAMPLING_INTERVAL_S", "NDATA")
_AZIMUTHS = {"N": 0.0, "E": 90.0}


def recognise(source: Source) -> Recognised | None:
    """Return the format if the first lines are keys and values, step and type of data among them."""
    entries, start = _entries(source)
    if not all(key in entries for key in _SIGNS):
        return None
    line = source.line_number(entries["DATA_TYPE"].at)
    identification = Identification(NAME, f"the first lines read 'KEY: value', line {line} is DATA_TYPE")
    return Recognised(identification, functools.partial(_read, source, entries, start))


def _read(source: Source, entries: dict[str, Entry], start: int, request: Request) -> list[Channel]:
    kind = entries["DATA_TYPE"]
    if kind.value.upper() != "ACCELERATION":
        raise source.error(f"this ESM file holds {kind.value.lower()!r}; give the file of the acceleration", kind.at)
    spelling = entries.get("UNITS", Entry("", start))
    unit = request.units(source, spelling.value, spelling.at)
    (dt,), (count,) = (positive_numbers(source, key, entries[key]) for key in ("SAMPLING_INTERVAL_S", "NDATA"))
    dt = request.step(source, dt, entries["SAMPLING_INTERVAL_S"].at)
    values = read_values(source, start, len(source.data), stated=Stated(count, entries["NDATA"].at, "NDATA"))
    text = {key: entry.value for key, entry in entries.items() if entry.value}
    name = text.get("STREAM", "acceleration")
    processing = {"processing": text["PROCESSING"]} if "PROCESSING" in text else {}
    return [
        Channel(
            name=name,
            number=1,
            acceleration=to_acceleration(source, start, values, unit),
            dt=dt,
            azimuth=_AZIMUTHS.get(name[-1]),
            units=spelling.value or unit.name,
            station=".".join(text[key] for key in ("NETWORK", "STATION_CODE") if key in text),
            event=text.get("EVENT_ID", text.get("EVENT_NAME", "")),
            metadata={"format": NAME, "file": source.file, **processing},
            start=_start(text.get("DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS", "")),
        )
    ]


def _start(written: str) -> float | None:
    """Return the instant that a file writes, s since 1970; None where it is not understood."""
    try:
        return datetime.strptime(f"{written}+0000", "%Y%m%d_%H%M%S.%f%z").timestamp()
    except ValueError:
        return None


def _entries(source: Source) -> tuple[dict[str, Entry], int]:
    """Return the header's values by their key, and where the data start."""
    entries: dict[str, Entry] = {}
    start = 0
    for line in source.first_lines(_HEADER_LINES):
        found = _KEY.match(line.text)
        if found is None:
            break
        entries[found[1]] = Entry(found[2].strip(), line.start)
        start = line.next
    return entries, start
