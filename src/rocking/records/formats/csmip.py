"""Formats with several channels per file: CSMIP V1 (uncorrected) and V2 (corrected), and COSMOS 1.20.

CSMIP files have text, integer and real headers for each channel, then a line with count, step or rate, units and
columns. Older V1 files, and files of other networks, instead have pairs of time and acceleration, in touching columns
10F7.3, in seconds and g/10. In V2, velocity and displacement follow the acceleration. COSMOS files state the length and
columns of each header.
"""

from __future__ import annotations

import itertools
import re
from typing import Any, Final

from rocking.core.arrays import Floats
from rocking.errors import RecordError
from rocking.records.formats.engine import (
    Count,
    Format,
    Header,
    HeaderData,
    Layout,
    find_numeric_end,
    parse_azimuth,
    parse_layout,
    parse_number,
    step_from_rate,
)

_V1_DATA: Final = re.compile(
    r"(?ia)^\s*(\d{1,12})\s+accel\w*\s+points\s+at\s+(\S+)\s*(?:pts|points|samples|sps)(?:.*?units\s+of\s+([A-Za-z0-9/^]+))?"
)
_V2_DATA: Final = re.compile(
    r"(?ia)^\s*(\d{1,12})\s+points\s+of\s+accel\w*\s+data\b.*?\bat\s+(\S+)\s*sec(?:.*?(?:units:|\bin)\s*([A-Za-z0-9/^]+))?"
)
_V2_OTHER: Final = re.compile(r"(?i)^\s*\d+\s+points\s+of\s+(?:veloc|displ)")
_CHANNEL: Final = re.compile(r"(?ia)^\s*chan\S*\s*(\d{1,6})\s*:\s*(.*)$")
_STATION: Final = re.compile(r"(?i)^\s*sta\w*\s+(?:no|id)\b\.?\s*(.*)$")
_STATION_CHANNEL: Final = re.compile(r"(?ia)\(sta\S*\s+ch\S*\s*(\d{1,6})\s*\)")
_LOCATION: Final = re.compile(r"(?i)location\s*:\s*(.*)$")
_DEGREES: Final = re.compile(r"(?ia)(\d{1,3}(?:\.\d*)?)\s*deg")
_PAIR_UNITS: Final = re.compile(r"(?i)^\s*units\b.*\bsec\w*\s+and\s+([A-Za-z0-9/^]+)")
_PAIR_COUNT: Final = re.compile(r"(?ia)no\.?\s*of\s*points\s*=\s*(\d{1,12})")
_TEXT_LINES, _NUMBER_LINES, _REAL_LINES = 13, 14, 13


def _parse_v1_header(header: Header) -> HeaderData:
    match = header.read_until(_V1_DATA, 40)
    if match is None:
        return _parse_pairs_header(header)
    return _create_header_data(header, match, step_from_rate(parse_number(match[2])), None, event_line=1)


def _parse_v2_header(header: Header) -> HeaderData:
    match = header.read_until(_V2_DATA, 70)
    if match is None:
        raise _missing_count_error(header)
    step = parse_number(match[2])
    if len(header.lines) > _REAL_LINES:
        # Real header 53, in columns 8F10, of headers that end just before the data line: it has more decimals.
        precise_step = parse_number(header.lines[5 - _REAL_LINES].text[40:50].strip())
        if abs(precise_step - step) <= 0.5 * 10.0 ** -len(match[2].partition(".")[2]):
            step = precise_step
    return _create_header_data(header, match, step, Layout(per_line=8, width=10), event_line=2)


def _create_header_data(
    header: Header, match: re.Match[str], step: float, layout: Layout | None, *, event_line: int
) -> HeaderData:
    line = header.lines[-1]
    labels, facts = _parse_labels(header, event_line)
    layout = parse_layout(line.text) or layout
    return HeaderData(line.start, match[3] or "", step, Count(int(match[1]), line.start), labels, layout, facts=facts)


def _parse_pairs_header(header: Header) -> HeaderData:
    header.read_lines(_TEXT_LINES)
    start, offset = header.end, header.lines[0].start
    header.skip(_NUMBER_LINES)
    points, units = header.find_text(_PAIR_COUNT), header.find_text(_PAIR_UNITS)
    if not (points and units and find_numeric_end(header.source, start) >= header.end):
        raise _missing_count_error(header)
    labels, facts = _parse_labels(header, 1)
    layout = Layout(per_line=10, width=7)
    return HeaderData(offset, units, None, Count(2 * int(points), offset), labels, layout, facts=facts)


def _missing_count_error(header: Header) -> RecordError:
    advice = "if the file is incomplete, download it again; if its layout differs, write it as a text table"
    offset = header.lines[0].start if header.lines else header.end
    return header.source.error(f"no line of points and units ends this channel's header; {advice}", offset)


def _parse_labels(header: Header, event_line: int) -> tuple[dict[str, Any], dict[str, str]]:
    lines = header.lines
    labels: dict[str, Any] = {"name": f"channel {header.ordinal}", "station": ""}
    facts: dict[str, str] = {}
    for line, following in itertools.pairwise(lines):
        if match := _STATION.match(line.text):
            labels["station"] = following.text[:40].strip() or match[1].split("  ")[0]
            facts["station line"] = " ".join(line.text.split())
            break
    if channel := header.find_match(_CHANNEL):
        words = channel[2].strip()
        name = re.split(r"\s{2,}|\(|location\s*:", words, maxsplit=1, flags=re.IGNORECASE)[0].strip()
        labels |= {"number": int(channel[1]), "azimuth": parse_azimuth(_DEGREES, name)}
        labels["name"] = name or f"channel {channel[1]}"
        station_channel = _STATION_CHANNEL.search(words)
        facts |= {"station channel": station_channel[1] if station_channel else "", "location": _parse_location(words)}
    labels["event"] = lines[event_line].text.split("   ")[0].strip() if len(lines) > event_line else ""
    return labels, facts


def _parse_location(text: str) -> str:
    match = _LOCATION.search(text)
    return match[1].strip() if match else ""


_COSMOS_TITLE: Final = re.compile(r"(?ia)\(format\s+v\s*[\d.]{1,8}\s+with\s+(\d{1,3})\s+text(?:\s+lines\))?")
_NUMBERS: Final = re.compile(r"(?ia)^\s*(\d{1,6})\s+(?:integer|real)-header\s+values\s+follow\s+on\s+(\d{1,4})\s+lines")
_COMMENTS: Final = re.compile(r"(?ia)^\s*(\d{1,4})\s+comment")
_DATA: Final = re.compile(r"(?ia)^\s*(\d{1,12})\s+(\S.*?)\s*pts\b")
_DURATION: Final = re.compile(r"(?ia)approx\s+(\d{1,9})\s+secs")
_UNITS: Final = re.compile(r"(?i)units\s*=\s*([A-Za-z0-9/^]+)")
_MISSING_MARK: Final = re.compile(r"(?ia)unspecified:.*,\s*(-\d{1,9}(?:\.\d{0,9})?)\s*$")
_COSMOS_CHANNEL: Final = re.compile(r"(?i)^\s*sta\s+cha\w*\s*:?\s*(\w+|\?)\s*:\s*([^(]*)")
_COSMOS_STATION: Final = re.compile(r"(?i)^\s*statn\s+no\S*\s+(\S+)\s*(?:code:\s*\S+)?\s*(.*)$")


def _parse_cosmos_header(header: Header) -> HeaderData:
    title = header.expect(_COSMOS_TITLE, "the title")
    header.read_lines(int(title[1]) - 1)
    text_lines = [*header.lines]
    _read_header_numbers(header)
    reals = _read_header_numbers(header)
    if comments := _COMMENTS.match(header.source.read_line(header.end).text):
        header.skip(1 + int(comments[1]))
    points = header.expect(_DATA, "the line with the number of points")
    data_line = header.lines[-1]
    missing_mark, station = header.find_text(_MISSING_MARK), header.find_match(_COSMOS_STATION)
    labels: dict[str, Any] = {"name": "", "event": text_lines[1].text.strip() if len(text_lines) > 1 else ""}
    location = ""
    if channel := header.find_match(_COSMOS_CHANNEL):
        if re.fullmatch(r"\d{1,6}", channel[1], re.ASCII):
            labels["number"] = int(channel[1])
        labels["name"] = " ".join(channel[2].split("  ")[0].split())
        location = _parse_location(channel.string)
    labels["name"] = labels["name"] or f"channel {labels.get('number', header.ordinal)}"
    labels["azimuth"] = parse_azimuth(_DEGREES, labels["name"])
    labels["station"] = " ".join((station[2] or station[1]).split()) if station else ""
    return HeaderData(
        data_line.start,
        units[1] if (units := _UNITS.search(data_line.text)) else "",
        _choose_step(header, reals, int(points[1])) if points[2].lower().startswith("accel") else None,
        Count(int(points[1]), data_line.start),
        labels,
        parse_layout(data_line.text),
        quantity=points[2],
        facts={"stage": text_lines[0].text.split("(")[0].strip(), "location": location},
        missing_mark=float(missing_mark) if missing_mark else None,
    )


def _read_header_numbers(header: Header) -> Floats:
    match = header.expect(_NUMBERS, "a line '... header values follow'")
    return header.read_numbers(int(match[2]), parse_layout(match.string), int(match[1]))


def _choose_step(header: Header, reals: Floats, points: int) -> float:
    """Return the step (s) that fits the stated duration: real header 62 in ms, or 34 (raw data) in s."""
    data_line = header.lines[-1]
    steps = [float(step) for step in (*reals[61:62] / 1000.0, *reals[33:34]) if step > 0.0]
    match = _DURATION.search(data_line.text)
    duration = int(match[1]) if match else 0
    # The duration is printed in whole seconds, in some files without the last interval.
    matching = [step for step in steps if not duration or abs(points * step - duration) <= 1.0 + step]
    if not matching:
        text = f"real headers 34 and 62 are inconsistent with {points} points and the stated duration"
        raise header.source.error(f"{text}; correct the header, or download the file again", data_line.start)
    return matching[0]


# The titles of GeoNet and USC begin alike, but their headers differ.
_TITLE_END: Final = r" accelerogram(?! \d{8}_\d{6}_|.*\bfile\s+\d)"
_V1_TITLE, _V2_TITLE = (re.compile(rf"(?ia)^\s*{word}{_TITLE_END}") for word in ("uncorrected", "corrected"))
V1: Final = Format("CSMIP V1", (_V1_TITLE,), _parse_v1_header, has_several_channels=True)
V2: Final = Format("CSMIP V2", (_V2_TITLE,), _parse_v2_header, has_several_channels=True, other_data=_V2_OTHER)
COSMOS: Final = Format("COSMOS", (_COSMOS_TITLE,), _parse_cosmos_header, has_several_channels=True)
