"""Formats with one component per file: PEER AT2, USGS SMC, K-NET and KiK-net, ESM and ITACA."""

from __future__ import annotations

import itertools
import re
from datetime import datetime
from typing import Final

from rocking.records.formats.engine import (
    NUMBER,
    Count,
    Format,
    Header,
    HeaderData,
    Layout,
    parse_azimuth,
    parse_number,
    step_from_rate,
)

_DEGREES: Final = re.compile(r"(?a)(\d{1,3})$")

# PEER AT2: NPTS and DT are in the last line of the header in several forms, ``NPTS=  5372, DT= .0100 SEC,`` (NGA) or
# ``4096    0.0100    NPTS, DT`` (the older database). VT2 and DT2 files look alike but contain velocities and
# displacements.

_SIZES: Final = re.compile(
    rf"(?i)NPTS\s*[=:]?\s*(\d{{1,12}})\b.*?\bDT\s*[=:]?\s*({NUMBER})"
    rf"|^\s*(\d{{1,12}})[\s,]+({NUMBER})[\s,]+NPTS\s*,\s*DT\b"
)
_AT2_UNITS: Final = re.compile(r"(?i)UNITS\s+OF\s+([A-Z0-9/^*]+)")
_AT2_OTHER: Final = re.compile(r"(?i)\b(VELOCITY|DISPLACEMENT)\s+TIME\b")
#: Owner and number of the station at the end of a title.
_OWNER: Final = re.compile(r"(.*?)[\s,]*\(([^()]*)\)")


def _parse_at2_header(header: Header) -> HeaderData:
    sizes = header.read_until(_SIZES, 12)
    assert sizes is not None
    points, dt = filter(None, sizes.groups())
    offset = header.lines[-1].start
    # "event, date, station, component (owner)", "event, station, component" or "..., component, (owner)"
    title_lines = header.source.read_lines(0, 2)[1:]  # of the file, whose first line may be blank
    title = next((line.text.strip() for line in title_lines if line.start < offset), "")
    match = _OWNER.fullmatch(title)
    text, owner = match.groups() if match else (title, "")
    event, station, name = title, "", "acceleration"
    if len(parts := [part.strip() for part in text.split(",")]) >= 3:
        event, station, name = ", ".join(parts[:-2]), parts[-2], parts[-1] or name
    else:
        owner = ""
    return HeaderData(
        offset,
        header.find_text(_AT2_UNITS),
        parse_number(dt),
        Count(int(points), offset, "NPTS"),
        {"name": name, "azimuth": parse_azimuth(_DEGREES, name), "station": station, "event": event},
        Layout(per_line=5, width=15),
        quantity=header.find_text(_AT2_OTHER) or "acceleration",
        facts={"station line": owner},
    )


# USGS SMC: 11 text lines, 48 integers, 50 reals, comments. Integer 16 counts the comment lines, integer 17 the values,
# after which the last row may be padded. Real 2 is the rate. Digitised films have no rate and pairs of values.

_SMC_TITLE: Final = re.compile(
    r"(?i)^\s*([0-6])\s+(unknown|(?:un)?corrected accelerogram|velocity|displacement|response|fourier)"
)
_COMPONENT: Final = re.compile(r"(?i)component\s*=\s*(.*)$")
_SMC_STATION: Final = re.compile(r"(?i)station\s*=\s*(.*?)\s*(?:component\s*=|$)")
_SMC_MISSING: Final = 1.7e38


def _parse_smc_header(header: Header) -> HeaderData:
    kind = header.expect(_SMC_TITLE, "the title")
    header.read_lines(10)
    offset = header.end
    integers = header.read_numbers(6, Layout(per_line=8, width=10), 48)
    reals = header.read_numbers(10, Layout(per_line=5, width=15), 50)
    header.skip(int(integers[15]))
    rate = float(reals[1])
    name = header.find_text(_COMPONENT).strip(" *") or "acceleration"
    layout = Layout(per_line=5, width=14) if int(integers[46]) == 8 else Layout(per_line=8, width=10)
    return HeaderData(
        offset,
        "cm/s2",
        None if rate == _SMC_MISSING else step_from_rate(rate),
        Count(int(integers[16]), offset, max_surplus=layout.per_line),
        {
            "name": name,
            "azimuth": parse_azimuth(_DEGREES, name),
            "station": header.find_text(_SMC_STATION),
            "event": " ".join(header.lines[3].text.split()),
        },
        layout,
        quantity="acceleration" if kind[1] in "12" else kind[2],
        facts={"stage": kind[2].lower()},
        padded=True,
        missing_mark=_SMC_MISSING,
    )


# K-NET and KiK-net: 17 lines, then counts that the scale factor converts to gal. The instrument's constant offset (some
# gal) is kept. "Record Time" is 15 s later than the first sample.

_KNET_KEYS: Final = (
    "Origin Time", "Lat.", "Lon", "Depth", "Mag.", "Station Code", "Station Lat", "Station Lon", "Station Height",
    "Record Time", "Sampling Freq", "Duration Time", "Dir.", "Scale Factor", "Max", "Last Correction", "Memo",
)  # fmt: skip
_KNET: Final = {key: re.compile(rf"^(?={re.escape(key)}).{{0,18}}(.*)$") for key in _KNET_KEYS}
_RATE: Final = re.compile(r"(?ia)\s*([\d.]{1,20})\s*Hz")
_SCALE: Final = re.compile(r"(?ia)\s*([\d.]{1,20})\s*\(\s*gal\s*\)\s*/\s*([\d.]{1,20})")
_SECONDS: Final = re.compile(r"(?a)\s*([\d.]{1,20})")
#: KiK-net numbers its six sensors: three in the borehole, three at the surface.
_SENSORS: Final = {"1": "N-S borehole", "2": "E-W borehole", "3": "U-D borehole", "4": "N-S", "5": "E-W", "6": "U-D"}


def _parse_knet_header(header: Header) -> HeaderData:
    entries = {key: header.expect(pattern, f"the header line {key!r}")[1].strip() for key, pattern in _KNET.items()}
    (rate,) = header.find_positive_numbers(_KNET["Sampling Freq"], _RATE)
    (seconds,) = header.find_positive_numbers(_KNET["Duration Time"], _SECONDS)
    gal, counts = header.find_positive_numbers(_KNET["Scale Factor"], _SCALE)
    name = _SENSORS.get(entries["Dir."], entries["Dir."]) or "acceleration"
    return HeaderData(
        header.find_offset(_KNET["Scale Factor"]),
        "gal",
        1.0 / rate,
        # The duration is in whole seconds. Fewer samples, or a surplus of a second, are errors.
        Count(seconds * rate, header.find_offset(_KNET["Duration Time"]), "the duration", max_surplus=rate - 1.0),
        {
            "name": name,
            "azimuth": {"N-S": 0.0, "E-W": 90.0}.get(name.split(" ")[0]),
            "station": entries["Station Code"],
            "event": f"{entries['Origin Time']}, magnitude {entries['Mag.']}",
        },
        facts={"record time": entries["Record Time"]},
        scale=(gal, counts),
    )


# ESM and ITACA: "KEY: value" lines, then one value per line.

_ESM_LINE: Final = re.compile(r"^([A-Z][A-Z0-9_/^]*)\s*:\s*(.*)$")
_ESM_KEYS: Final = ("DATA_TYPE", "SAMPLING_INTERVAL_S", "NDATA", "UNITS")
_ESM: Final = {key: re.compile(rf"^{key}\s*:(.*)$") for key in _ESM_KEYS}


def _parse_esm_header(header: Header) -> HeaderData:
    matches = (_ESM_LINE.match(line.text) for line in header.source.read_lines(header.end, 200))
    pairs = [match.groups() for match in itertools.takewhile(bool, matches) if match]
    header.read_lines(len(pairs))
    entries = {key: value.strip() for key, value in pairs if value.strip()}
    for key in _ESM_KEYS[:3]:
        if key not in entries:
            raise header.source.error(
                f"the header does not contain {key}; download the record again", header.find_offset(_ESM[key])
            )
    (step,), (count,) = (header.find_positive_numbers(_ESM[key]) for key in ("SAMPLING_INTERVAL_S", "NDATA"))
    name = entries.get("STREAM", "acceleration")
    first_sample = entries.get("DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS", "")
    try:
        start = datetime.strptime(f"{first_sample}+0000", "%Y%m%d_%H%M%S.%f%z").timestamp()
    except ValueError:
        start = None
    return HeaderData(
        header.find_offset(_ESM["UNITS"]),
        entries.get("UNITS", ""),
        step,
        Count(count, header.find_offset(_ESM["NDATA"]), "NDATA"),
        {
            "name": name,
            "azimuth": {"N": 0.0, "E": 90.0}.get(name[-1]),
            "station": ".".join(entries[key] for key in ("NETWORK", "STATION_CODE") if key in entries),
            "event": entries.get("EVENT_ID", entries.get("EVENT_NAME", "")),
            "start": start,
        },
        quantity=entries.get("DATA_TYPE", ""),
        facts={"processing": entries.get("PROCESSING", "")},
    )


AT2: Final = Format("PEER AT2", (_SIZES,), _parse_at2_header, max_lines=12)
SMC: Final = Format("USGS SMC", (_SMC_TITLE,), _parse_smc_header)
KNET: Final = Format("K-NET/KiK-net", (_KNET["Origin Time"], _KNET["Scale Factor"]), _parse_knet_header, max_lines=34)
ESM: Final = Format("ESM", tuple(_ESM.values())[:3], _parse_esm_header, max_lines=200)
