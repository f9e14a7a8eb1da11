"""Motions by name, of record files, of shipped records, of whole folders; and tables of what records there are."""

from __future__ import annotations

import fnmatch
import glob
import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from rocking.constants import STANDARD_GRAVITY
from rocking.errors import UnreadableRecord
from rocking.motion import formats, records
from rocking.motion.formats.source import Request
from rocking.motion.motion import Motion
from rocking.tables import decimal, named, text_table

#: The name of a record that is read from standard input.
STANDARD_INPUT = "-"


def named_motion(
    name: str,
    *,
    channel: str | None = None,
    dt: float | None = None,
    units: str | None = None,
    scale: float = 1.0,
    several: bool = False,
) -> Motion:
    """Motion of a record file, or of a shipped record of that name, times a factor.

    Parameters
    ----------
    name : str
        Path of a file, "-" for standard input, or name of a shipped record; where a file has that name too, the file.
    channel, dt, units
        As for `rocking.read`.
    scale : float
        Factor on the motion.
    several : bool
        Whether `dt`, `units` and `channel` are for several files, of which those that say their step and units keep
        them, and those that hold one channel are taken whatever its name.
    """
    if is_shipped(name):
        if not several:
            refuse_what_is_known(name, channel=channel, dt=dt, units=units)
        motion = records.load(name)
    else:
        file = sys.stdin.buffer if name == STANDARD_INPUT else name
        motion = formats.read_as(file, channel, Request.checked(dt, units, several=several), optional=several)
    return motion if scale == 1.0 else motion.scaled(scale)


def named_vertical(
    name: str, record: str, *, channel: str | None = None, dt: float | None = None, units: str | None = None
) -> Motion:
    """Vertical motion by name: a file or a shipped record of its own, or else a channel of the horizontal one's file.

    There are two motions then, so `dt` and `units` are for the one that does not say its own.

    Parameters
    ----------
    name : str
        Path of a file, name of a shipped record, or a channel by number or name.
    record : str
        Path of the file with the horizontal motion.
    channel
        The channel that is the horizontal motion, where that file has several.
    dt, units
        As for `rocking.read`.
    """
    if Path(name).is_file() or name in records.names():
        return named_motion(name, dt=dt, units=units, several=True)
    if record == STANDARD_INPUT or not Path(record).exists():
        raise UnreadableRecord(
            f"there is no file or shipped record {name!r} for the vertical motion, and {record} has no channels; check "
            "the name"
        )
    request = Request.checked(dt, units, several=True)
    return formats.read_vertical(record, name, channel, request)


def refuse_what_is_known(name: str, **said: object) -> None:
    """Check that nothing is said of a shipped record that it knows itself."""
    for argument, value in said.items():
        if value is not None:
            raise UnreadableRecord(
                "a shipped record is one channel, with its step and units; leave {} out", argument, path=name
            )


def is_shipped(name: str) -> bool:
    """Whether a name is that of a shipped record, and not of a file."""
    if name == STANDARD_INPUT or Path(name).exists():
        return False
    if name in records.names():
        return True
    meant = records.meant(name)
    if meant and not Path(name).suffix:
        raise UnreadableRecord(
            f"there is no such file or shipped record; did you mean {' or '.join(meant)}?", path=name
        )
    return False


def expanded(names: Iterable[str]) -> list[str]:
    """Return the names of records that files, folders, patterns and shipped records stand for, each once.

    A folder stands for the files in it, by name, hidden ones left out; a pattern for the files that match it, or where
    none does for the shipped records of such names.

    Examples
    --------
    >>> expanded(["el-centro-meloland-270", "record.AT2", "record.AT2"])
    ['el-centro-meloland-270', 'record.AT2']
    """
    found: dict[str, None] = {}
    for name in names:
        found.update(dict.fromkeys(_files(name)))
    return list(found)


def _files(name: str) -> list[str]:
    if Path(name).is_dir():
        files = sorted(str(path) for path in Path(name).iterdir() if path.is_file() and not path.name.startswith("."))
        if not files:
            raise UnreadableRecord("this folder holds no file; name one that holds records", path=name)
        return files
    if not glob.has_magic(name) or Path(name).exists():
        return [name]
    matching = sorted(path for path in glob.glob(name, recursive=True) if Path(path).is_file())  # noqa: PTH207 - any root
    matching = matching or fnmatch.filter(records.names(), name)
    if not matching:
        raise UnreadableRecord(
            "no file or shipped record matches this pattern; check the folder and the pattern", path=name
        )
    return matching


@dataclass(frozen=True)
class Contents:
    """A list of records or channels.

    Attributes
    ----------
    title : str
        What they are; empty if the list says it.
    facts : dict
        What holds for all of them.
    kind : {"records", "channels"}
        What is listed.
    entries : list of dict
        One for each, with the same names in the same order; units are in the names.
    motions : tuple of Motion
        Those of a file's channels.
    """

    title: str
    facts: dict[str, Any]
    kind: str
    entries: list[dict[str, Any]]
    motions: tuple[Motion, ...] = ()

    def summary(self) -> str:
        """Return the table for people."""
        columns = list(self.entries[0])
        # What has no value is the step of samples that are not evenly spaced.
        rows = [["uneven" if entry[column] is None else entry[column] for column in columns] for entry in self.entries]
        table = text_table(columns, rows)
        return f"{self.title}\n\n{table}" if self.title else table

    def __repr__(self) -> str:
        names = ", ".join(str(entry["name"]) for entry in self.entries)
        title = f"{self.title}; " if self.title else ""
        kind = self.kind if len(self.entries) > 1 else self.kind.removesuffix("s")
        return f"<Contents: {title}{len(self.entries)} {kind}: {names}>"

    def to_dict(self) -> dict[str, Any]:
        """Return the table for machines."""
        return {**self.facts, self.kind: self.entries}


def shipped(name: str | None = None) -> Contents:
    """List the records that ship, or one of them.

    Raises
    ------
    UnreadableRecord
        If no record has that name.

    Examples
    --------
    >>> [entry["name"] for entry in shipped().entries][:2]
    ['ridgecrest-clc-090', 'ridgecrest-clc-360']
    """
    return Contents("", {}, "records", [_shipped(each) for each in (records.names() if name is None else [name])])


def contents(
    file: str | os.PathLike[str] | BinaryIO,
    *,
    channel: str | None = None,
    dt: float | None = None,
    units: str | None = None,
    several: bool = False,
) -> Contents:
    """List the acceleration channels of a file, and say what it was taken for.

    Parameters
    ----------
    file, channel, dt, units
        As for `rocking.read`; without `channel`, all of them.
    several
        As for `named_motion`.

    Raises
    ------
    UnreadableRecord, InvalidMotion
        As for `rocking.read`.
    """
    request = Request.checked(dt, units, several=several)
    identification, channels = formats.content_as(file, channel, request, optional=several)
    motions = tuple(each.motion() for each in channels)
    name = "standard input" if hasattr(file, "read") else os.fsdecode(file)
    facts = {"file": name, "format": identification.format, "reason": identification.reason}
    title = f"{name}: {identification.format}, since {identification.reason}"
    entries = [
        {"channel": each.number, "name": each.name, "units": each.units} | _measures(motion)
        for each, motion in zip(channels, motions, strict=True)
    ]
    return Contents(title, facts, "channels", entries, motions)


def _shipped(name: str) -> dict[str, Any]:
    record = records.info(name)
    known = {"name": name, "event": record.event, "station": record.station, "direction": record.direction}
    return known | _measures(records.load(name)) | {"terms": record.terms}


def _measures(motion: Motion) -> dict[str, Any]:
    return {
        named("step", "s"): motion.step,
        named("duration", "s"): motion.duration,
        named("pga", "g"): decimal(motion.pga / STANDARD_GRAVITY),
        named("pgv", "m/s"): motion.pgv,
    }
