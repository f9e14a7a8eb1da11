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
from rocking.errors import UnreadableRecord
from rocking.records.formats.engine import (
    Format,
    Header,
    Layout,
    Said,
    Stated,
    direction,
    number,
    numeric_end,
    stated_layout,
    step_of,
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


def _v1(header: Header) -> Said:
    stated = header.take_until(_V1_DATA, 40)
    if stated is None:
        return _pairs(header)
    return _said(header, stated, step_of(number(stated[2])), None, event_line=1)


def _v2(header: Header) -> Said:
    stated = header.take_until(_V2_DATA, 70)
    if stated is None:
        raise _without_count(header)
    step = number(stated[2])
    if len(header.lines) > _REAL_LINES:
        # Real header 53, in columns 8F10, of headers that end just before the data line: it has more decimals.
        finer = number(header.lines[5 - _REAL_LINES].text[40:50].strip())
        if abs(finer - step) <= 0.5 * 10.0 ** -len(stated[2].partition(".")[2]):
            step = finer
    return _said(header, stated, step, Layout(per_line=8, width=10), event_line=2)


def _said(header: Header, stated: re.Match[str], step: float, layout: Layout | None, *, event_line: int) -> Said:
    line = header.lines[-1]
    labels, facts = _labels(header, event_line)
    layout = stated_layout(line.text) or layout
    return Said(line.start, stated[3] or "", step, Stated(int(stated[1]), line.start), labels, layout, facts=facts)


def _pairs(header: Header) -> Said:
    header.take(_TEXT_LINES)
    start, at = header.end, header.lines[0].start
    header.skip(_NUMBER_LINES)
    points, units = header.text(_PAIR_COUNT), header.text(_PAIR_UNITS)
    if not (points and units and numeric_end(header.source, start) >= header.end):
        raise _without_count(header)
    labels, facts = _labels(header, 1)
    layout = Layout(per_line=10, width=7)
    return Said(at, units, None, Stated(2 * int(points), at), labels, layout, facts=facts)


def _without_count(header: Header) -> UnreadableRecord:
    advice = "if the file is cut, get it again; if its layout is another one, write it as a text table"
    at = header.lines[0].start if header.lines else header.end
    return header.source.error(f"no line of points and units ends this channel's header; {advice}", at)


def _labels(header: Header, event_line: int) -> tuple[dict[str, Any], dict[str, str]]:
    lines = header.lines
    labels: dict[str, Any] = {"name": f"channel {header.ordinal}", "station": ""}
    facts: dict[str, str] = {}
    for line, following in itertools.pairwise(lines):
        if found := _STATION.match(line.text):
            labels["station"] = following.text[:40].strip() or found[1].split("  ")[0]
            facts["station line"] = " ".join(line.text.split())
            break
    if channel := header.find(_CHANNEL):
        words = channel[2].strip()
        name = re.split(r"\s{2,}|\(|location\s*:", words, maxsplit=1, flags=re.IGNORECASE)[0].strip()
        labels |= {"number": int(channel[1]), "azimuth": direction(_DEGREES, name)}
        labels["name"] = name or f"channel {channel[1]}"
        place = _STATION_CHANNEL.search(words)
        facts |= {"station channel": place[1] if place else "", "location": _location(words)}
    labels["event"] = lines[event_line].text.split("   ")[0].strip() if len(lines) > event_line else ""
    return labels, facts


def _location(text: str) -> str:
    found = _LOCATION.search(text)
    return found[1].strip() if found else ""


_COSMOS_TITLE: Final = re.compile(r"(?ia)\(format\s+v\s*[\d.]{1,8}\s+with\s+(\d{1,3})\s+text(?:\s+lines\))?")
_NUMBERS: Final = re.compile(r"(?ia)^\s*(\d{1,6})\s+(?:integer|real)-header\s+values\s+follow\s+on\s+(\d{1,4})\s+lines")
_COMMENTS: Final = re.compile(r"(?ia)^\s*(\d{1,4})\s+comment")
_DATA: Final = re.compile(r"(?ia)^\s*(\d{1,12})\s+(\S.*?)\s*pts\b")
_DURATION: Final = re.compile(r"(?ia)approx\s+(\d{1,9})\s+secs")
_UNITS: Final = re.compile(r"(?i)units\s*=\s*([A-Za-z0-9/^]+)")
_UNKNOWN: Final = re.compile(r"(?ia)unspecified:.*,\s*(-\d{1,9}(?:\.\d{0,9})?)\s*$")
_COSMOS_CHANNEL: Final = re.compile(r"(?i)^\s*sta\s+cha\w*\s*:?\s*(\w+|\?)\s*:\s*([^(]*)")
_COSMOS_STATION: Final = re.compile(r"(?i)^\s*statn\s+no\S*\s+(\S+)\s*(?:code:\s*\S+)?\s*(.*)$")


def _cosmos(header: Header) -> Said:
    title = header.expect(_COSMOS_TITLE, "the title")
    header.take(int(title[1]) - 1)
    text = [*header.lines]
    _numbers_of(header)
    reals = _numbers_of(header)
    if comments := _COMMENTS.match(header.source.line(header.end).text):
        header.skip(1 + int(comments[1]))
    stated = header.expect(_DATA, "the line with the number of points")
    data = header.lines[-1]
    unknown, station = header.text(_UNKNOWN), header.find(_COSMOS_STATION)
    labels: dict[str, Any] = {"name": "", "event": text[1].text.strip() if len(text) > 1 else ""}
    place = ""
    if channel := header.find(_COSMOS_CHANNEL):
        if re.fullmatch(r"\d{1,6}", channel[1], re.ASCII):
            labels["number"] = int(channel[1])
        labels["name"] = " ".join(channel[2].split("  ")[0].split())
        place = _location(channel.string)
    labels["name"] = labels["name"] or f"channel {labels.get('number', header.ordinal)}"
    labels["azimuth"] = direction(_DEGREES, labels["name"])
    labels["station"] = " ".join((station[2] or station[1]).split()) if station else ""
    return Said(
        data.start,
        units[1] if (units := _UNITS.search(data.text)) else "",
        _step(header, reals, int(stated[1])) if stated[2].lower().startswith("accel") else None,
        Stated(int(stated[1]), data.start),
        labels,
        stated_layout(data.text),
        quantity=stated[2],
        facts={"stage": text[0].text.split("(")[0].strip(), "location": place},
        unknown=float(unknown) if unknown else None,
    )


def _numbers_of(header: Header) -> Floats:
    stated = header.expect(_NUMBERS, "a line '... header values follow'")
    return header.numbers(int(stated[2]), stated_layout(stated.string), int(stated[1]))


def _step(header: Header, reals: Floats, points: int) -> float:
    """Return the step (s) that fits the stated duration: real header 62 in ms, or 34 (raw data) in s."""
    data = header.lines[-1]
    steps = [float(step) for step in (*reals[61:62] / 1000.0, *reals[33:34]) if step > 0.0]
    stated = _DURATION.search(data.text)
    duration = int(stated[1]) if stated else 0
    # The duration is printed in whole seconds, in some files without the last interval.
    fitting = [step for step in steps if not duration or abs(points * step - duration) <= 1.0 + step]
    if not fitting:
        text = f"real headers 34 and 62 give no step at which {points} points last as stated"
        raise header.source.error(f"{text}; correct the header, or get the file again", data.start)
    return fitting[0]


# The titles of GeoNet and USC begin alike, but their headers differ.
_TITLE: Final = r" accelerogram(?! \d{8}_\d{6}_|.*\bfile\s+\d)"
_V1_TITLE, _V2_TITLE = (re.compile(rf"(?ia)^\s*{word}{_TITLE}") for word in ("uncorrected", "corrected"))
V1: Final = Format("CSMIP V1", (_V1_TITLE,), _v1, several=True)
V2: Final = Format("CSMIP V2", (_V2_TITLE,), _v2, several=True, other=_V2_OTHER)
COSMOS: Final = Format("COSMOS", (_COSMOS_TITLE,), _cosmos, several=True)
