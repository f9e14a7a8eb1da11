"""List of records: shipped ones and uploaded files, their measures, and their stations."""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Iterable, Mapping
from pathlib import PurePath
from typing import Any, Final, NamedTuple
from urllib.parse import parse_qsl

from rocking import records
from rocking.analysis.levels import assign_numbers
from rocking.errors import OptionError, RockingError
from rocking.explorer.parameters import PARAMETERS, Texts, find_field_label
from rocking.explorer.uploads import UploadStore, compute_measures

#: Maximum number of entries and letters of a list in an address: forty records of two components, and as many again.
MAX_ENTRIES: Final = 160
_MAX_CHARACTERS: Final = 40_000

#: Names of the texts that control how a file is read.
_READING_OPTIONS: Final = ("dt", "units", "baseline", "highpass")

#: Names of components at the end of a file's name or of a channel: azimuths, directions, instrument codes. KiK-net has
#: one sensor in a borehole, 1, and one at the surface, 2, each with three components.
_VERTICAL_NAMES: Final = r"up|ud[12]?|dwn|down|vrt|vert(?:ical)?|u-d|[behls][hln]z|z|v"
_HORIZONTAL_NAMES: Final = r"ns[12]?|ew[12]?|n-s|e-w|[behls][hln][ne123xy]|[nexy]|[nsew]\d{1,3}[nsew]|h[12]|[0-3]\d\d"
_COMPONENT: Final = re.compile(
    rf"(?i)(?:^|[-_. ]|(?<=[a-z])(?=\d\d\d))(?:(?P<up>{_VERTICAL_NAMES})|(?P<level>{_HORIZONTAL_NAMES}))(?: ?deg)?$"
)
_SENSOR: Final = re.compile(r"(?i)(?:ns|ew|ud)([12])$")
_BOREHOLE: Final = " borehole"


class Component(NamedTuple):
    """Component of a record: its row of the list, and the data that it shares with others of its station."""

    row: dict[str, Any]
    sensor: tuple[object, ...]  # equal for components of one sensor
    origin: tuple[str, ...]  # event and station
    sample_count: int = 0

    def belongs_to(self, group: list[Component]) -> bool:
        """Whether a component belongs to a group of up to two horizontal ones and a vertical one."""
        first, is_up = group[0], self.row["is_up"]
        labels = [member.row["label"] for member in group if member.row["is_up"] == is_up]
        is_as_long = abs(self.sample_count - first.sample_count) <= 0.01 * max(self.sample_count, first.sample_count)
        has_room = len(labels) < (1 if is_up else 2) and self.row["label"] not in labels
        return self.sensor == first.sensor and is_as_long and has_room


def read_entries(text: str) -> list[dict[str, str]]:
    """Read a list from an address: entries separated by ;, each the texts of a motion as a query.

    Examples
    --------
    >>> read_entries("motion=ridgecrest-clc-090&vertical=ridgecrest-clc-up;motion=ridgecrest-clc-360")
    [{'motion': 'ridgecrest-clc-090', 'vertical': 'ridgecrest-clc-up'}, {'motion': 'ridgecrest-clc-360'}]
    """
    parts = [part for part in text.split(";") if part]
    if len(text) > _MAX_CHARACTERS or len(parts) > MAX_ENTRIES:
        message = f"a list of {{}} has {MAX_ENTRIES} entries and {_MAX_CHARACTERS} letters at most: take some out"
        raise OptionError(message, "records")
    return [dict(parse_qsl(part)) for part in parts]


def list_records(uploads: UploadStore, answers: Iterable[Texts] = ()) -> dict[str, Any]:
    """Return all records grouped by station; ``answers`` contains texts such as ``dt`` by the key of a file."""
    answers_by_key = {answer["key"]: answer for answer in answers if "key" in answer}
    components, problems = list[Component](), dict[str, str]()
    for key in uploads.list_records():
        components += _list_readable(uploads, key, answers_by_key.get(key, {}), problems)
    groups = []
    for group in [*_group_by_station(_list_shipped()), *_group_by_station(components)]:
        rows, first = [component.row for component in group], group[0]
        title = ", ".join(first.origin) or (rows[0]["file"] if rows[0]["key"] in first.sensor else str(first.sensor[0]))
        reason = " ".join(problems[row["key"]] for row in rows if row["key"] in problems)
        groups.append({"title": title, "reason": reason, "rows": rows})
    return {"groups": groups, "usage": uploads.count_usage()}


def describe_entries(entries: list[dict[str, str]], uploads: UploadStore) -> list[tuple[str, int]]:
    """Return title and number of the station of each entry, equal for components of one station."""
    keys = [(entry.get("motion", ""), entry.get("channel")) for entry in entries]
    files = {motion.removeprefix("file:"): entry for (motion, _), entry in zip(keys, entries, strict=True)}
    listed = (_list_channels(uploads, key, files[key]) for key in uploads.list_records() if key in files)
    components = [*_list_shipped(), *itertools.chain(*listed)]
    known: dict[tuple[str, str | None], tuple[str, object]] = {}
    for group in _group_by_station(components):
        for component in group:
            texts, station = component.row["texts"], component.origin or str(group[0].row["texts"])
            known[texts["motion"], texts.get("channel")] = component.row["title"], station
    titles, stations = zip(*(known.get(key, (key[0], key)) for key in keys), strict=True)
    return list(zip(titles, map(int, assign_numbers(stations)), strict=True))


def _list_readable(uploads: UploadStore, key: str, answers: Texts, problems: dict[str, str]) -> list[Component]:
    """Return the channels of a file, read without wrong answers, for which the problem is added."""
    try:
        return _list_channels(uploads, key, answers)
    except RockingError as error:
        if not answers:
            raise
        problems[key] = ("" if error.path else f"{uploads.get_file(key).name}: ") + error.text(find_field_label)
        known = answers if error.argument in answers else {}
        return _list_readable(uploads, key, {n: text for n, text in known.items() if n != error.argument}, problems)


@functools.cache
def _list_shipped() -> tuple[Component, ...]:
    def describe(name: str) -> Component:
        record = records.info(name)
        measures, origin = compute_measures(records.load(name)), (record.title.rpartition(", ")[0],)
        row = _create_row({"motion": name}, record.title, record.direction, record.direction == "up", measures)
        return Component(row, (name.rpartition("-")[0],), origin)

    return tuple(map(describe, records.names()))


def _create_row(
    texts: Texts, title: str, label: str, is_up: bool, measures: Mapping[str, float] | None, **facts: Any
) -> dict[str, Any]:
    """Return what the page shows of a component: texts that select it, title, label, measures and facts of its file."""
    row = {"texts": texts, "title": title, "label": label, "is_up": is_up, "measures": measures, "vertical": ""}
    return {**row, "key": "", "file": "", "missing": [], "raw": None, **facts}


def _list_channels(uploads: UploadStore, key: str, answers: Texts) -> list[Component]:
    """Return the channels of a file, read with the user's answers."""
    options = {name: PARAMETERS[name].read(answers[name]) for name in _READING_OPTIONS if answers.get(name)}
    contents, missing = uploads.describe_file(key, **options), uploads.describe_file(key)["missing"]
    known = {name: answers[name] for name in options if name in missing or name not in ("dt", "units")}
    name, has_many = contents["name"], len(contents["channels"]) > 1
    components = []
    for channel in contents["channels"]:
        texts = {"motion": f"file:{key}"} | ({"channel": str(channel["number"])} if has_many else {}) | known
        stem, label, is_up, sensor = _split_component_name(name, channel["name"], channel["azimuth"], has_many)
        origin = tuple(filter(None, (channel["event"], channel["station"]))) if channel["station"] else ()
        sensor_place = (sensor, channel["step"], tuple(contents["missing"]))
        place = (key,) if has_many else (*origin, *sensor_place) if origin else (stem or key, *sensor_place)
        title, facts = f"{name}, {channel['name']}" if has_many else name, {"key": key, "file": name}
        facts |= {"missing": contents["missing"], "raw": channel["raw"]}
        row = _create_row(texts, title, label, is_up, channel["measures"], **facts)
        components.append(Component(row, place, origin, channel["samples"]))
    return components


def _split_component_name(name: str, channel: str, azimuth: float | None, has_many: bool) -> tuple[str, str, bool, str]:
    """Return a file's name without its component, the component's label, whether it is vertical, and its sensor."""
    path = PurePath(name)
    candidates = [] if has_many else [path.suffix.removeprefix("."), path.stem]
    match = next(filter(None, map(_COMPONENT.search, candidates)), None)
    stem = "" if match is None else path.stem[: match.start()] if match.string == path.stem else path.stem
    channel_match = _COMPONENT.search(channel.strip().removesuffix(_BOREHOLE))
    is_up = azimuth is None and any(m is not None and m["up"] for m in (channel_match, match))
    label = channel if match is None or azimuth is not None else match[0].strip("-_. ")
    number = _SENSOR.search(match[0]) if match is not None else None
    sensor = "1" if channel.endswith(_BOREHOLE) else "" if number is None else number[1]
    return stem.lower(), label, is_up, sensor


def _group_by_station(components: Iterable[Component]) -> list[list[Component]]:
    """Group the components of one sensor: up to two horizontal ones, followed by a vertical one."""
    groups: list[list[Component]] = []
    for component in components:
        matching_group = next((group for group in groups if component.belongs_to(group)), None)
        if matching_group is None:
            groups.append([component])
        else:
            matching_group.append(component)
    for group in groups:
        group.sort(key=lambda component: component.row["is_up"])
        vertical = group[-1].row
        for row in (component.row for component in group[:-1] if vertical["is_up"]):
            motion, channel = vertical["texts"]["motion"], vertical["texts"].get("channel")
            of_file = channel if vertical["key"] == row["key"] else f"{motion}#{channel}"
            row["vertical"] = motion if channel is None else of_file
    return groups
