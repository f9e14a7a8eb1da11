"""Formats whose headers are lines of keys and values: ESM and ITACA (DYNA headers), K-NET and KiK-net.

ESM has "KEY: value" lines, then one value to a line. K-NET has 17 lines, then counts that the scale factor turns into
gal. The counts hold the instrument's constant offset (some gal). It is kept, and the metadata say so: remove it with a
baseline correction of the motion. "Record Time" is 15 s later than the first sample.
"""

from __future__ import annotations

import functools
import re
from datetime import datetime

import numpy as np

from rocking.records.formats.channel import Channel, Recognised, channel_of
from rocking.records.formats.source import Entry, Request, Source
from rocking.records.formats.values import Layout, Stated, positive_numbers, read_values, wrong_count

_ESM_LINE = re.compile(r"^([A-Z][A-Z0-9_/^]*)\s*:\s*(.*)$")

_KNET_KEYS = (
    "Origin Time", "Lat.", "Lon", "Depth", "Mag.", "Station Code", "Station Lat", "Station Lon", "Station Height",
    "Record Time", "Sampling Freq", "Duration Time", "Dir.", "Scale Factor", "Max", "Last Correction", "Memo",
)  # fmt: skip
_RATE = re.compile(r"([\d.]{1,20})\s*Hz", re.IGNORECASE | re.ASCII)
_SCALE = re.compile(r"([\d.]{1,20})\s*\(\s*gal\s*\)\s*/\s*([\d.]{1,20})", re.IGNORECASE | re.ASCII)
_SECONDS = re.compile(r"([\d.]{1,20})", re.ASCII)
#: KiK-net numbers its six sensors: three in the borehole, three at the surface.
_SENSORS = {"1": "N-S borehole", "2": "E-W borehole", "3": "U-D borehole", "4": "N-S", "5": "E-W", "6": "U-D"}


def recognise_esm(source: Source) -> Recognised | None:
    """Return the format if the first lines are keys and values, step and type of data among them."""
    entries: dict[str, Entry] = {}
    start = 0
    for line in source.first_lines(200):
        found = _ESM_LINE.match(line.text)
        if found is None:
            break
        entries[found[1]] = Entry(found[2].strip(), line.start)
        start = line.next
    if not {"DATA_TYPE", "SAMPLING_INTERVAL_S", "NDATA"} <= entries.keys():
        return None
    reason = f"the first lines read 'KEY: value', line {source.line_number(entries['DATA_TYPE'].at)} is DATA_TYPE"
    return Recognised("ESM", reason, functools.partial(_read_esm, source, entries, start))


def _read_esm(source: Source, entries: dict[str, Entry], start: int, request: Request) -> list[Channel]:
    kind = entries["DATA_TYPE"]
    if kind.value.upper() != "ACCELERATION":
        raise source.error(f"this ESM file holds {kind.value.lower()!r}; give the file of the acceleration", kind.at)
    units = entries.get("UNITS", Entry("", start))
    unit = request.units(source, units.value, units.at)
    (dt,), (count,) = (positive_numbers(source, key, entries[key]) for key in ("SAMPLING_INTERVAL_S", "NDATA"))
    dt = request.step(source, dt, entries["SAMPLING_INTERVAL_S"].at)
    values = read_values(source, start, len(source.data), stated=Stated(count, entries["NDATA"].at, "NDATA"))
    text = {key: entry.value for key, entry in entries.items() if entry.value}
    name = text.get("STREAM", "acceleration")
    try:
        first_sample = text.get("DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS", "")
        began = datetime.strptime(f"{first_sample}+0000", "%Y%m%d_%H%M%S.%f%z").timestamp()
    except ValueError:
        began = None
    return [
        channel_of(
            source,
            "ESM",
            values,
            unit,
            start,
            spelling=units.value,
            facts={"processing": text.get("PROCESSING", "")},
            name=name,
            number=1,
            dt=dt,
            azimuth={"N": 0.0, "E": 90.0}.get(name[-1]),
            station=".".join(text[key] for key in ("NETWORK", "STATION_CODE") if key in text),
            event=text.get("EVENT_ID", text.get("EVENT_NAME", "")),
            start=began,
        )
    ]


def recognise_knet(source: Source) -> Recognised | None:
    """Return the format if the file begins with 'Origin Time' and has a 'Scale Factor'."""
    lines = source.first_lines(2 * len(_KNET_KEYS))
    scale = next((line for line in lines if line.text.startswith("Scale Factor")), None)
    if scale is None or not lines[0].text.startswith("Origin Time"):
        return None
    first, other = (source.line_number(line.start) for line in (lines[0], scale))
    reason = f"line {first} begins 'Origin Time', line {other} 'Scale Factor'"
    return Recognised("K-NET/KiK-net", reason, functools.partial(_read_knet, source))


def _read_knet(source: Source, request: Request) -> list[Channel]:
    lines = source.first_lines(len(_KNET_KEYS))
    for line, key in zip(lines, _KNET_KEYS, strict=False):
        if not line.text.startswith(key):
            raise source.error(f"the header line {key!r} should stand here; get the record again", line.start)
    if len(lines) < len(_KNET_KEYS):
        raise source.error("the file ends within its header; get the whole file again", lines[-1].start)
    entries = {key: Entry(line.text[18:].strip(), line.start) for key, line in zip(_KNET_KEYS, lines, strict=True)}
    (rate,) = positive_numbers(source, "Sampling Freq", entries["Sampling Freq"], _RATE)
    gal, counts = positive_numbers(source, "Scale Factor", entries["Scale Factor"], _SCALE)
    scale_at = entries["Scale Factor"].at
    unit = request.units(source, "gal", scale_at)
    dt = request.step(source, 1.0 / rate, entries["Sampling Freq"].at)
    values = read_values(source, lines[-1].next, len(source.data), Layout(per_line=8, width=9))
    # The duration is in whole seconds: fewer samples are missing, and a second's more are too many.
    (seconds,) = positive_numbers(source, "Duration Time", entries["Duration Time"], _SECONDS)
    stated = seconds * rate
    if not -0.5 < len(values) - stated < rate:
        said = f"{seconds:g} s at {rate:g} Hz make {stated:g} samples"
        raise wrong_count(source, entries["Duration Time"].at, said, len(values), stated)
    with np.errstate(over="ignore"):
        scaled = values * gal / counts
        offset = f"kept, the mean is {float(unit.to_si(scaled).mean()) if len(scaled) else 0.0:.4g} m/s^2"
    direction = entries["Dir."].value
    name = _SENSORS.get(direction, direction) or "acceleration"
    return [
        channel_of(
            source,
            "K-NET/KiK-net",
            scaled,
            unit,
            scale_at,
            spelling="gal",
            facts={"record time": entries["Record Time"].value, "offset": offset},
            name=name,
            number=1,
            dt=dt,
            azimuth={"N-S": 0.0, "E-W": 90.0}.get(name.split(" ")[0]),
            station=entries["Station Code"].value,
            event=f"{entries['Origin Time'].value}, magnitude {entries['Mag.'].value}",
        )
    ]
