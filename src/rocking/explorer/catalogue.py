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
from rocking.analysis.levels import assign_numbers
from rocking.errors import OptionError, RockingError
from rocking.explorer.parameters import PARAMETERS, Texts, field_label, list_names
from rocking.explorer.uploads import UploadStore, compute_measures

#: Maximum number of entries and letters of a list in an address: forty records of two components, and as many again.
MAX_ENTRIES: Final = 160
_MAX_LETTERS: Final = 40_000

#: Names of components at the end of a file's name or of a channel: azimuths, directions, instrument codes.
_VERTICAL_NAMES: Final = r"up|ud[12]?|dwn|down|vrt|vert(?:ical)?|u-d|[behls][hln]z|z|v"
_HORIZONTAL_NAMES: Final = r"ns[12]?|ew[12]?|n-s|e-w|[behls][hln][ne123xy]|[nexy]|[nsew]\d{1,3}[nsew]|h[12]|[0-3]\d\d"
_COMPONENT: Final = re.compile(
    rf"(?i)(?:^|[-_. ]|(?<=[a-z])(?=\d\d\d))(?:(?P<up>{_VERTICAL_NAMES})|(?P<level>{_HORIZONTAL_NAMES}))(?: ?deg)?$"
)

#: Sensor number in a component name, and its heading: KiK-net has one sensor in a borehole, 1, and one at the surface,
#: 2, each with three components.
_SENSOR: Final = re.compile(r"(?i)(?:ns|ew|ud)([12])$")
_BOREHOLE_SUFFIX: Final = " borehole"


@dataclass
class Component:
    """Row of the list: a horizontal or vertical component of a record."""

    texts: Texts  # that select it as the motion of a case
    title: str
    label: str  # of the component
    is_up: bool
    measures: Mapping[str, float] | None
    place: tuple[object, ...]  # equal for components of one sensor
    origin: tuple[str, ...] = ()  # event and station
    samples: int = 0
    key: str = ""  # of an uploaded file
    file: str = ""  # name of this file
    missing: list[str] = field(default_factory=list)  # metadata
    choices: Mapping[str, Any] = field(default_factory=dict)  # of the missing metadata
    vertical: str = ""  # text that adds its vertical component

    def belongs_to(self, group: list[Component]) -> bool:
        """Whether a component belongs to a group of up to two horizontal ones and a vertical one."""
        first, same = group[0], [member.label for member in group if member.is_up == self.is_up]
        is_as_long = abs(self.samples - first.samples) <= 0.01 * max(self.samples, first.samples)
        has_room = len(same) < (1 if self.is_up else 2) and self.label not in same
        return self.place == first.place and is_as_long and has_room

    def describe(self) -> dict[str, Any]:
        """Return the fields that the page shows."""
        names = ("texts", "title", "label", "is_up", "measures", "key", "file", "missing", "choices", "vertical")
        return {name: getattr(self, name) for name in names}


def read_entries(text: str) -> list[dict[str, str]]:
    """Read a list from an address: entries separated by ;, each the texts of a motion as a query.

    Examples
    --------
    >>> read_entries("motion=ridgecrest-clc-090&vertical=ridgecrest-clc-up;motion=ridgecrest-clc-360")
    [{'motion': 'ridgecrest-clc-090', 'vertical': 'ridgecrest-clc-up'}, {'motion': 'ridgecrest-clc-360'}]
    """
    parts = [part for part in text.split(";") if part]
    if len(text) > _MAX_LETTERS or len(parts) > MAX_ENTRIES:
        raise OptionError(
            f"a list of {{}} has {MAX_ENTRIES} entries and {_MAX_LETTERS} letters at most: take some out", "records"
        )
    entries = [dict(parse_qsl(part)) for part in parts]
    unknown_names = {name for entry in entries for name in entry.keys() - {*list_names("motion"), "key"}}
    if unknown_names:
        raise OptionError(
            f"an entry of the list of {{}} has {', '.join(list_names('motion'))}, not {min(unknown_names)[:20]!r}",
            "records",
            value=text,
        )
    return entries


def list_records(uploads: UploadStore, answers: Iterable[Texts] = ()) -> dict[str, Any]:
    """Return all records grouped by station; ``answers`` contains ``dt`` and ``units`` by the key of a file."""
    answers_by_key = {answer["key"]: answer for answer in answers if "key" in answer}
    components, problems = [], {}
    for key in uploads.list_records():
        try:
            components += _list_channels(uploads, key, answers_by_key.get(key, {}))
        except RockingError as error:
            problems[key] = ("" if error.path else f"{uploads.file(key).name}: ") + error.text(field_label)
            components += _list_channels(uploads, key, {})
    groups = [_describe_group(group, "") for group in _group_by_station(_list_shipped())]
    for group in _group_by_station(components):
        messages = [problems[component.key] for component in group if component.key in problems]
        groups.append(_describe_group(group, " ".join(messages)))
    return {"groups": groups, "usage": uploads.usage()}


def number_stations(entries: list[dict[str, str]], uploads: UploadStore) -> list[int]:
    """Return a number for each entry, equal for components that the list assigns to one station."""
    files = {entry["motion"].partition(":")[2]: entry for entry in entries if entry["motion"].startswith("file:")}
    components = [component for key, entry in files.items() for component in _list_channels(uploads, key, entry)]
    labels: dict[tuple[str, str | None], object] = {}
    for group in [*_group_by_station(_list_shipped()), *_group_by_station(components)]:
        for row in group:
            labels[row.texts["motion"], row.texts.get("channel")] = row.origin or tuple(group[0].texts.items())
    keys = [(entry["motion"], entry.get("channel")) for entry in entries]
    return [*map(int, assign_numbers([labels.get(key, key) for key in keys]))]


def find_title(texts: Texts, uploads: UploadStore) -> str:
    """Return the title of an entry's record in the list."""
    name, _, key = texts.get("motion", "").partition(":")
    if name != "file":
        return records.info(name).title if name in records.names() else texts.get("motion", "")
    file = uploads.describe_file(key, PARAMETERS["dt"].read(texts["dt"]) if "dt" in texts else None, texts.get("units"))
    channels = file["channels"]
    selected = (
        [channel for channel in channels if str(channel["number"]) == texts.get("channel")] if len(channels) > 1 else []
    )
    return f"{file['name']}, {selected[0]['name']}" if selected else str(file["name"])


@functools.cache
def _list_shipped() -> tuple[Component, ...]:
    def describe(name: str) -> Component:
        record = records.info(name)
        measures, origin = compute_measures(records.load(name)), (record.title.rpartition(", ")[0],)
        is_up, place = record.direction == "up", (name.rpartition("-")[0],)
        return Component({"motion": name}, record.title, record.direction, is_up, measures, place, origin)

    return tuple(map(describe, records.names()))


def _list_channels(uploads: UploadStore, key: str, answers: Texts) -> list[Component]:
    """Return the channels of a file, read with the user's answers."""
    dt = PARAMETERS["dt"].read(answers["dt"]) if answers.get("dt") else None
    contents = uploads.describe_file(key, dt, answers.get("units") or None)
    known = {each: answers[each] for each in uploads.describe_file(key)["missing"] if answers.get(each)}
    name, has_many = contents["name"], len(contents["channels"]) > 1
    components = []
    for channel in contents["channels"]:
        texts = {"motion": f"file:{key}"} | ({"channel": str(channel["number"])} if has_many else {}) | known
        stem, label, is_up, sensor = _split_component_name(name, channel["name"], channel["azimuth"], has_many)
        origin = tuple(filter(None, (channel["event"], channel["station"]))) if channel["station"] else ()
        sensor_place = (sensor, channel["step"], tuple(contents["missing"]))
        place = (key,) if has_many else (*origin, *sensor_place) if origin else (stem or key, *sensor_place)
        title = f"{name}, {channel['name']}" if has_many else name
        components.append(
            Component(
                texts, title, label, is_up, channel["measures"], place, origin, channel["samples"], key, name,
                contents["missing"], channel["choices"],
            )
        )  # fmt: skip
    return components


def _split_component_name(name: str, channel: str, azimuth: float | None, has_many: bool) -> tuple[str, str, bool, str]:
    """Return a file's name without its component, the component's label, whether it is vertical, and its sensor."""
    path = PurePath(name)
    candidates = [] if has_many else [path.suffix.removeprefix("."), path.stem]
    match = next(filter(None, map(_COMPONENT.search, candidates)), None)
    stem = "" if match is None else path.stem[: match.start()] if match.string == path.stem else path.stem
    channel_match = _COMPONENT.search(channel.strip().removesuffix(_BOREHOLE_SUFFIX))
    is_up = azimuth is None and any(m is not None and m["up"] for m in (channel_match, match))
    label = channel if match is None or azimuth is not None else match[0].strip("-_. ")
    number = _SENSOR.search(match[0]) if match is not None else None
    sensor = "1" if channel.endswith(_BOREHOLE_SUFFIX) else "" if number is None else number[1]
    return stem.lower(), label, is_up, sensor


def _group_by_station(components: Iterable[Component]) -> list[list[Component]]:
    """Group the components of one sensor: up to two horizontal ones, followed by a vertical one."""
    groups: list[list[Component]] = []
    for component in components:
        home = next((group for group in groups if component.belongs_to(group)), None)
        if home is None:
            groups.append([component])
        else:
            home.append(component)
    for group in groups:
        group.sort(key=lambda component: component.is_up)
        vertical = group[-1]
        for component in group if vertical.is_up else ():
            if not component.is_up:
                component.vertical = _write_vertical(vertical, component)
    return groups


def _write_vertical(vertical: Component, horizontal: Component) -> str:
    """Return the text that makes a component the vertical one of another."""
    name, channel = vertical.texts["motion"], vertical.texts.get("channel")
    if channel is None:
        return name
    return channel if vertical.key == horizontal.key else f"{name}#{channel}"


def _describe_group(group: list[Component], reason: str) -> dict[str, Any]:
    first = group[0]
    title = ", ".join(first.origin) or (str(first.place[0]) if len(first.place) > 1 else "")
    rows = [component.describe() for component in group]
    return {"title": title or first.file, "reason": reason, "rows": rows}
