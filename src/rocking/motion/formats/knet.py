"""K-NET and KiK-net ASCII: 17 header lines, then counts that the scale factor turns into gal.

The counts hold the instrument's constant offset (some gal). It is kept, and the metadata say so: remove it with a
baseline correction of the motion. "Record Time" is 15 s later than the first sample.
"""

from __future__ import annotations

import functools
import re

import numpy as np

from rocking.motion.formats.channel import Channel, Identification, Recognised, to_acceleration
from rocking.motion.formats.source import Entry, Request, Source
from rocking.motion.formats.values import Layout, positive_numbers, read_values, wrong_count

NAME = "K-NET/KiK-net"

_KEYS = (
    "Origin Time", "Lat.", "Lon", "Depth", "Mag.", "Station Code", "Station Lat", "Station Lon", "Station Height",
    "Record Time", "Sampling Freq", "Duration Time", "Dir.", "Scale Factor", "Max", "Last Correction", "Memo",
)  # fmt: skip
_KEY_COLUMNS = 18
_COUNTS = Layout(per_line=8, width=9)
_RATE = re.compile(r"([\d.]{1,20})\s*Hz", re.IGNORECASE | re.ASCII)
_SCALE = re.compile(r"([\d.]{1,20})\s*\(\s*gal\s*\)\s*/\s*([\d.]{1,20})", re.IGNORECASE | re.ASCII)
_SECONDS = re.compile(r"([\d.]{1,20})", re.ASCII)

#: KiK-net numbers its six sensors: three in the borehole, three at the surface.
_SENSORS = {"1": "N-S borehole", "2": "E-W borehole", "3": "U-D borehole", "4": "N-S", "5": "E-W", "6": "U-D"}
_AZIMUTHS = {"N-S": 0.0, "E-W": 90.0}


def recognise(source: Source) -> Recognised | None:
    """Return the format if the file begins with 'Origin Time' and has a 'Scale Factor'."""
    lines = source.first_lines(2 * len(_KEYS))
    scale = next((line for line in lines if line.text.startswith("Scale Factor")), None)
    if scale is None or not lines[0].text.startswith("Origin Time"):
        return None
    first, other = (source.line_number(line.start) for line in (lines[0], scale))
    reason = f"line {first} begins 'Origin Time', line {other} 'Scale Factor'"
    return Recognised(Identification(NAME, reason), functools.partial(_read, source))


def _read(source: Source, request: Request) -> list[Channel]:
    entries, start = _entries(source)
    (rate,) = positive_numbers(source, "Sampling Freq", entries["Sampling Freq"], _RATE)
    gal, counts = positive_numbers(source, "Scale Factor", entries["Scale Factor"], _SCALE)
    scale_at = entries["Scale Factor"].at
    unit = request.units(source, "gal", scale_at)
    dt = request.step(source, 1.0 / rate, entries["Sampling Freq"].at)
    values = read_values(source, start, len(source.data), _COUNTS)
    _check_duration(source, entries, rate, len(values))
    with np.errstate(over="ignore"):
        scaled = values * gal / counts
    acceleration = to_acceleration(source, scale_at, scaled, unit)
    with np.errstate(over="ignore"):
        mean = float(acceleration.mean())
    direction = entries["Dir."].value
    name = _SENSORS.get(direction, direction) or "acceleration"
    return [
        Channel(
            name=name,
            number=1,
            acceleration=acceleration,
            dt=dt,
            azimuth=_AZIMUTHS.get(name.split(" ")[0]),
            units="gal",
            station=entries["Station Code"].value,
            event=f"{entries['Origin Time'].value}, magnitude {entries['Mag.'].value}",
            metadata={
                "format": NAME,
                "file": source.file,
                "record time": entries["Record Time"].value,
                "offset": f"kept, the mean is {mean:.4g} m/s^2",
            },
        )
    ]


def _entries(source: Source) -> tuple[dict[str, Entry], int]:
    """Return the header's values by their key, and where the data start."""
    lines = source.first_lines(len(_KEYS))
    for line, key in zip(lines, _KEYS, strict=False):
        if not line.text.startswith(key):
            raise source.error(f"the header line {key!r} should stand here; get the record again", line.start)
    if len(lines) < len(_KEYS):
        raise source.error("the file ends within its header; get the whole file again", lines[-1].start)
    entries = [Entry(line.text[_KEY_COLUMNS:].strip(), line.start) for line in lines]
    return dict(zip(_KEYS, entries, strict=True)), lines[-1].next


def _check_duration(source: Source, entries: dict[str, Entry], rate: float, count: int) -> None:
    """Refuse fewer samples than the duration, which is in whole seconds, or a second's more."""
    (seconds,) = positive_numbers(source, "Duration Time", entries["Duration Time"], _SECONDS)
    stated = seconds * rate
    if not -0.5 < count - stated < rate:
        said = f"{seconds:g} s at {rate:g} Hz make {stated:g} samples"
        raise wrong_count(source, entries["Duration Time"].at, said, count, more=count > stated)
