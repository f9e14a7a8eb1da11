"""What the files of CSMIP (V1 and V2) and COSMOS have in common: text headers, and how a channel's data end."""

from __future__ import annotations

import itertools
import re
from typing import NamedTuple

from rocking.motion.formats.aligned import Layout
from rocking.motion.formats.source import Line, Source
from rocking.motion.formats.values import bad_number, numeric_end

V1_TITLE = re.compile(r"^\s*uncorrected accelerogram", re.IGNORECASE)
V2_TITLE = re.compile(r"^\s*corrected accelerogram", re.IGNORECASE)

_CHANNEL = re.compile(r"^\s*chan\S*\s*(\d{1,6})\s*:\s*(.*)$", re.IGNORECASE | re.ASCII)
_STATION = re.compile(r"^\s*sta\w*\s+(?:no|id)\b\.?\s*(.*)$", re.IGNORECASE)
_STATION_CHANNEL = re.compile(r"\(sta\S*\s+ch\S*\s*(\d{1,6})\s*\)", re.IGNORECASE | re.ASCII)
_LOCATION = re.compile(r"location\s*:\s*(.*)$", re.IGNORECASE)
_AZIMUTH = re.compile(r"^(\d{1,3}(?:\.\d*)?)\s*deg", re.IGNORECASE | re.ASCII)
_FORMAT = re.compile(r"\(\s*(\d{1,3})\s*[EFGI]\s*(\d{1,3})(?:\.\d+)?\s*\)", re.IGNORECASE | re.ASCII)
_END_OF_DATA = re.compile(r"^\s*(/&|-*\s*end[ -]of[ -]data)", re.IGNORECASE)

_NAME_COLUMNS = 40


class Labels(NamedTuple):
    """What the text header of one channel says."""

    number: int
    name: str
    azimuth: float | None
    station: str
    metadata: dict[str, str]


def labels(header: list[Line], ordinal: int) -> Labels:
    """Return the labels in the text header of the file's channel number `ordinal`."""
    station, metadata = _station(header)
    channel = next((found for line in header if (found := _CHANNEL.match(line.text))), None)
    if channel is None:
        return Labels(ordinal, f"channel {ordinal}", None, station, metadata)
    name = re.split(r"\s{2,}|\(|location\s*:", channel[2].strip(), maxsplit=1, flags=re.IGNORECASE)[0].strip()
    metadata |= _place(channel[2])
    return Labels(int(channel[1]), name or f"channel {channel[1]}", azimuth(name), station, metadata)


def azimuth(name: str) -> float | None:
    """Return the direction in a name such as "90 Deg", in degrees clockwise from north, or None."""
    found = _AZIMUTH.match(name)
    return float(found[1]) % 360.0 if found else None


def location(text: str) -> str:
    """Return what follows "Location:" in `text`, or an empty string."""
    found = _LOCATION.search(text)
    return found[1].strip() if found else ""


def layout_in(text: str) -> Layout | None:
    """Return the Fortran columns that a header such as "... Format: (8f9.6)" states, or None."""
    found = _FORMAT.search(text)
    if found is None or int(found[1]) == 0 or int(found[2]) == 0:
        return None
    return Layout(int(found[1]), int(found[2]))


def data_end(source: Source, start: int, *titles: re.Pattern[str]) -> int:
    """Return where the numbers that begin at `start` end: at a trailer, at one of `titles` or with the file.

    Raises
    ------
    UnreadableRecord
        If they end at anything else, which then is a spoilt number.
    """
    end = numeric_end(source, start)
    if end == len(source.data):
        return end
    line = source.line(end)
    if _END_OF_DATA.match(line.text) or any(title.search(line.text) for title in titles):
        return end
    raise bad_number(source, end, line.next)


def after_trailer(source: Source, start: int) -> int:
    """Return the offset after the "end of data" line at `start`, or `start` where there is none."""
    line = source.first_line(start)
    return line.next if line is not None and _END_OF_DATA.match(line.text) else start


def _station(header: list[Line]) -> tuple[str, dict[str, str]]:
    for line, following in itertools.pairwise(header):
        found = _STATION.match(line.text)
        if found:
            name = following.text[:_NAME_COLUMNS].strip() or found[1].split("  ")[0]
            return name, {"station line": " ".join(line.text.split())}
    return "", {}


def _place(text: str) -> dict[str, str]:
    number, place = _STATION_CHANNEL.search(text), location(text)
    return ({"station channel": number[1]} if number else {}) | ({"location": place} if place else {})
