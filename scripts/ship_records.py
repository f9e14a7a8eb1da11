"""Convert published strong-motion files into the records that ship with the package.

    python scripts/ship_records.py FOLDER

FOLDER holds the CSMIP V1 and V2 files named in STATIONS. For each station one compressed NumPy archive is
written to ``src/rocking/records/data``: per channel the printed values as integers (printed value = integer /
denominator), stored as second differences, which compress best; and ``catalogue.json`` says what they are.
Nothing is rounded, filtered or cut.
"""

import argparse
import json
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

DATA = Path(__file__).resolve().parents[1] / "src" / "rocking" / "records" / "data"

RIDGECREST = "Ridgecrest, California, M 7.1, 2019-07-06"
IMPERIAL_VALLEY = "Imperial Valley, California, 1979-10-15"
GMPROCESS = (
    "Southern California Seismic Network, processed by the California Geological Survey; "
    "from the data of gmprocess 2.8.0 (USGS)"
)
CSMIP = (
    "California Strong Motion Instrumentation Program, processed by the USGS; "
    "Center for Engineering Strong Motion Data (CESMD); from the data of quakeio 0.1.12"
)


class Station(NamedTuple):
    """A station's files and what its records are called."""

    record: str
    files: tuple[str, ...]
    title: str
    event: str
    station: str
    state: str
    source: str
    terms: str


STATIONS = (
    Station(
        record="ridgecrest-clc",
        files=("CICLC.v1",),
        title="Ridgecrest 2019, China Lake",
        event=RIDGECREST,
        station="CI.CLC China Lake, G2 Tower Rd.",
        state="uncorrected (CSMIP V1)",
        source=GMPROCESS,
        terms="CC0 1.0",
    ),
    Station(
        record="ridgecrest-tow2",
        files=("CITOW2.RAW",),
        title="Ridgecrest 2019, Tower 2",
        event=RIDGECREST,
        station="CI.TOW2 Tower 2",
        state="uncorrected (CSMIP V1)",
        source=GMPROCESS,
        terms="CC0 1.0",
    ),
    Station(
        record="el-centro-meloland",
        files=("MELOLAND_CHAN15.V2", "MELOLAND_CHAN24.V2", "MELOLAND_CHAN14.V2"),
        title="Imperial Valley 1979, El Centro Meloland overpass",
        event=IMPERIAL_VALLEY,
        station="1336 El Centro, Highway 8 / Meloland overpass, free field",
        state="corrected (CSMIP V2), band-passed with ramps at 0.07-0.17 and 23-25 Hz",
        source=CSMIP,
        terms="attribution to CSMIP and CESMD is asked for",
    ),
)

BLOCK = re.compile(
    r"^\s*(?P<count>\d+)\s+(?:Accelerogram points at\s+(?P<rate>\d+) pts/sec in units of g"
    r"|POINTS OF ACCEL DATA EQUALLY SPACED AT\s+(?P<step>[\d.]+) SEC\.\s+\(UNITS: CM/SEC/SEC\))"
)
DIRECTION = re.compile(r"^Chan\s+\d+:\s+(?P<direction>\d+ Deg|Up)\b", re.IGNORECASE)


class Channel(NamedTuple):
    """Printed values of one channel as integers."""

    direction: str
    step: float
    units: str
    denominator: int
    counts: NDArray[np.int64]


def channels(path: Path) -> list[Channel]:
    """Return the acceleration channels of a CSMIP V1 or V2 file."""
    found, direction = [], ""
    lines = path.read_text("ascii").splitlines()
    for number, line in enumerate(lines):
        if named := DIRECTION.match(line):
            direction = named["direction"].lower().removesuffix(" deg").zfill(2)
        if block := BLOCK.match(line):
            found.append(_channel(block, direction, lines[number + 1 :]))
    return found


def _channel(block: re.Match[str], direction: str, lines: list[str]) -> Channel:
    count, in_g = int(block["count"]), block["rate"] is not None
    width, decimals = (9, 6) if in_g else (10, 3)
    fields = [line[i : i + width] for line in lines[: -(-count // 8)] for i in range(0, len(line.rstrip()), width)]
    if len(fields) != count or any(field[-decimals - 1] != "." for field in fields):
        raise SystemExit(f"{len(fields)} values with {decimals} decimals found where {count} should be")
    counts = np.array([int(field.replace(".", "")) for field in fields])
    step = 1.0 / int(block["rate"]) if in_g else float(block["step"])
    name = direction if direction == "up" else f"{int(direction):03d}"
    return Channel(name, step, "g" if in_g else "cm/s2", 10**decimals, counts)


def entry(station: Station, channel: Channel) -> dict[str, object]:
    """Return what the catalogue says of one record."""
    return {
        "archive": f"{station.record}.npz",
        "title": f"{station.title}, {channel.direction}",
        "event": station.event,
        "station": station.station,
        "direction": channel.direction,
        "state": station.state,
        "dt": channel.step,
        "samples": len(channel.counts),
        "units": channel.units,
        "denominator": channel.denominator,
        "source": station.source,
        "terms": station.terms,
    }


def main() -> None:
    """Write the archives and the catalogue."""
    parser = argparse.ArgumentParser(description="Convert strong-motion files into the shipped records.")
    parser.add_argument("folder", type=Path, help="folder with the published files")
    folder = parser.parse_args().folder
    DATA.mkdir(exist_ok=True)
    catalogue = {}
    for station in STATIONS:
        archive: dict[str, Any] = {}
        for channel in (channel for file in station.files for channel in channels(folder / file)):
            differences = np.diff(channel.counts, 2, prepend=[0, 0])
            smallest = np.min_scalar_type(-int(np.abs(differences).max()) - 1)
            archive[channel.direction] = differences.astype(smallest)
            catalogue[f"{station.record}-{channel.direction}"] = entry(station, channel)
        np.savez_compressed(DATA / f"{station.record}.npz", **archive)
    (DATA / "catalogue.json").write_text(json.dumps(catalogue, indent=1) + "\n", encoding="utf-8")
    for file in sorted(DATA.iterdir()):
        print(f"{file.name}: {file.stat().st_size} bytes")


if __name__ == "__main__":
    main()
