"""List of records: shipped ones and uploaded files, their measures, and their stations."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import Any, Final
from urllib.parse import parse_qsl

from rocking import records
from rocking.analysis.levels import numbered
from rocking.errors import InvalidOption, RockingError
from rocking.explorer.parameters import PARAMETERS, Texts, field_label, names_of
from rocking.explorer.uploads import UploadStore, measures

#: Maximum number of entries and letters of a list in an address: forty records of two components, and as many again.
MOST: Final = 160
_LETTERS: Final = 40_000

#: Names of components at the end of a file's name or of a channel: azimuths, directions, instrument codes.
_UP: Final = r"up|ud[12]?|dwn|down|vrt|vert(?:ical)?|u-d|[behls][hln]z|z|v"
_LEVEL: Final = r"ns[12]?|ew[12]?|n-s|e-w|[behls][hln][ne123xy]|[nexy]|[nsew]\d{1,3}[nsew]|h[12]|[0-3]\d\d"
_COMPONENT: Final = re.compile(
    rf"(?i)(?:^|[-_. ]|(?<=[a-z])(?=\d\d\d))(?:(?P<up>{_UP})|(?P<level>{_LEVEL}))(?: ?deg)?$"
)

#: Sensor number in a component name, and its heading: KiK-net has one sensor in a borehole, 1, and one at the surface,
#: 2, each with three components.
_SENSOR: Final = re.compile(r"(?i)(?:ns|ew|ud)([12])$")
_DEEP: Final = " borehole"


@dataclass
class Component:
    """Row of the list: texts that make it the case's motion, its name, and its known properties."""

    texts: Texts
    title: str
    label: str
    is_up: bool
    measures: Mapping[str, float] | None
    event: str = ""
    station: str = ""
    stem: str = ""
    sensor: str = ""
    samples: int = 0
    step: float | None = None
    key: str = ""
    file: str = ""
    missing: list[str] = field(default_factory=list)
    choices: Mapping[str, Any] = field(default_factory=dict)
    vertical: str = ""

    def described(self) -> dict[str, Any]:
        """Return the fields that the page shows."""
        names = ("texts", "title", "label", "is_up", "measures", "key", "file", "missing", "choices", "vertical")
        return {name: getattr(self, name) for name in names}


def entries_of(text: str) -> list[dict[str, str]]:
    """Read a list from an address: entries separated by ;, each the texts of a motion as a query.

    Examples
    --------
    >>> entries_of("motion=ridgecrest-clc-090&vertical=ridgecrest-clc-up;motion=ridgecrest-clc-360")
    [{'motion': 'ridgecrest-clc-090', 'vertical': 'ridgecrest-clc-up'}, {'motion': 'ridgecrest-clc-360'}]
    """
    parts = [part for part in text.split(";") if part]
    if len(text) > _LETTERS or len(parts) > MOST:
        raise InvalidOption(
            f"a list of {{}} has {MOST} entries and {_LETTERS} letters at most: take some out", "records"
        )
    found = [dict(parse_qsl(part)) for part in parts]
    wrong = {name for entry in found for name in entry.keys() - {*names_of("motion"), "key"}}
    if wrong:
        raise InvalidOption(
            f"an entry of the list of {{}} has {', '.join(names_of('motion'))}, not {min(wrong)[:20]!r}",
            "records",
            value=text,
        )
    return found


def listing(uploads: UploadStore, answers: Iterable[Texts] = ()) -> dict[str, Any]:
    """Return all records grouped by station; ``answers`` contains ``dt`` and ``units`` by the key of a file."""
    known = {answer["key"]: answer for answer in answers if "key" in answer}
    files, problems = [], {}
    for key in uploads.kept():
        try:
            files += _of_file(uploads, key, known.get(key, {}))
        except RockingError as error:
            problems[key] = ("" if error.path else f"{uploads.file(key).name}: ") + error.text(field_label)
            files += _of_file(uploads, key, {})
    groups = [_described(group, "") for group in _by_station(_shipped())]
    for group in _by_station(files):
        wrong = [problems[each.key] for each in group if each.key in problems]
        groups.append(_described(group, " ".join(wrong)))
    return {"groups": groups, "usage": uploads.usage()}


def clusters_of(entries: list[dict[str, str]], uploads: UploadStore) -> list[int]:
    """Return a number for each entry, equal for components that the list assigns to one station."""
    files = {entry["motion"].partition(":")[2]: entry for entry in entries if entry["motion"].startswith("file:")}
    components = [each for key, entry in files.items() for each in _of_file(uploads, key, entry)]
    homes: dict[tuple[str, str | None], object] = {}
    for group in [*_by_station(_shipped()), *_by_station(components)]:
        for each in group:
            names = (each.event, each.station) if each.station else (group[0].key, group[0].texts.get("channel"))
            homes[each.texts["motion"], each.texts.get("channel")] = names
    places = [(entry["motion"], entry.get("channel")) for entry in entries]
    return [*map(int, numbered([homes.get(place, place) for place in places]))]


def title_of(texts: Texts, uploads: UploadStore) -> str:
    """Return the title of an entry's record in the list."""
    name, _, key = texts.get("motion", "").partition(":")
    if name != "file":
        return records.info(name).title if name in records.names() else texts.get("motion", "")
    file = uploads.contents(key, PARAMETERS["dt"].read(texts["dt"]) if "dt" in texts else None, texts.get("units"))
    channels = file["channels"]
    chosen = [each for each in channels if str(each["number"]) == texts.get("channel")] if len(channels) > 1 else []
    return f"{file['name']}, {chosen[0]['name']}" if chosen else str(file["name"])


@functools.cache
def _shipped() -> tuple[Component, ...]:
    found = []
    for name in records.names():
        record = records.info(name)
        place, up = record.title.rpartition(", ")[0], record.direction == "up"
        texts, stem = {"motion": name}, name.rpartition("-")[0]
        known = measures(records.load(name))
        found.append(Component(texts, record.title, record.direction, up, known, station=place, stem=stem))
    return tuple(found)


def _of_file(uploads: UploadStore, key: str, answer: Texts) -> list[Component]:
    """Return the channels of a file, read with the user's answers."""
    dt = PARAMETERS["dt"].read(answer["dt"]) if answer.get("dt") else None
    given = {name: answer[name] for name in ("dt", "units") if answer.get(name)}
    told = uploads.contents(key, dt, answer.get("units") or None)
    needed = uploads.contents(key)["missing"]
    name, several = told["name"], len(told["channels"]) > 1
    found = []
    for each in told["channels"]:
        texts = {"motion": f"file:{key}"} | ({"channel": str(each["number"])} if several else {})
        texts |= {one: given[one] for one in needed if one in given}
        stem, label, is_up, sensor = _parted(name, each["name"], each["azimuth"], several)
        found.append(
            Component(
                texts,
                f"{name}, {each['name']}" if several else name,
                label,
                is_up,
                **{fact: each[fact] for fact in ("measures", "event", "station", "samples", "step", "choices")},
                stem=key if several else stem,
                sensor=sensor,
                key=key,
                file=name,
                missing=told["missing"],
            )
        )
    return found


def _parted(name: str, channel: str, azimuth: float | None, several: bool) -> tuple[str, str, bool, str]:
    """Return a file's name without its component, the component's label, whether it is vertical, and its sensor."""
    path = PurePath(name)
    whole = path.stem
    found = None
    for text in (path.suffix.removeprefix("."), whole):
        found = found or (_COMPONENT.search(text) if not several else None)
    stem = whole[: found.start()] if found is not None and found.string == whole else whole
    said = _COMPONENT.search(channel.strip().removesuffix(_DEEP))
    up = azimuth is None and any(each is not None and each["up"] for each in (said, found))
    label = channel if found is None or azimuth is not None else found[0].strip("-_. ")
    number = _SENSOR.search(found[0]) if found is not None else None
    sensor = "1" if channel.endswith(_DEEP) else "" if number is None else number[1]
    return stem.lower(), label, up, sensor


def _by_station(components: Iterable[Component]) -> list[list[Component]]:
    """Group the components of one sensor: up to two horizontal ones, followed by a vertical one."""
    groups: list[list[Component]] = []
    for each in components:
        home = next((group for group in groups if _belongs(each, group)), None)
        if home is None:
            groups.append([each])
        else:
            home.append(each)
    for group in groups:
        group.sort(key=lambda each: each.is_up)
        upward = next((each for each in group if each.is_up), None)
        for each in group:
            if upward is not None and not each.is_up:
                each.vertical = _as_vertical(upward, each)
    return groups


def _belongs(one: Component, group: list[Component]) -> bool:
    """Whether a component belongs to a group."""
    first = group[0]
    if bool(one.key) != bool(first.key) or sum(each.is_up == one.is_up for each in group) >= (1 if one.is_up else 2):
        return False
    if not one.key or one.key == first.key:
        return one.stem == first.stem
    if (
        one.sensor != first.sensor
        or one.missing != first.missing
        or one.step != first.step
        or any(each.key == one.key for each in group)
    ):
        return False
    if abs(one.samples - first.samples) > 0.01 * max(one.samples, first.samples):
        return False
    if one.station and first.station and (one.station, one.event) != (first.station, first.event):
        return False
    heads = bool(one.station) and (one.station, one.event) == (first.station, first.event)
    return heads or (bool(one.stem) and one.stem == first.stem and one.label != first.label)


def _as_vertical(upward: Component, beside: Component) -> str:
    """Return the text that makes a component the vertical one of another."""
    name, channel = upward.texts["motion"], upward.texts.get("channel")
    if channel is None:
        return name
    return channel if upward.key == beside.key else f"{name}#{channel}"


def _described(group: list[Component], reason: str) -> dict[str, Any]:
    first = group[0]
    place = ", ".join(part for part in (first.event, first.station) if part)
    return {"title": place or first.stem or first.file, "reason": reason, "rows": [each.described() for each in group]}
