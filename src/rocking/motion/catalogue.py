"""What records there are: those that ship, and the channels of a file, with their peaks, as tables."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, BinaryIO

from rocking.constants import STANDARD_GRAVITY
from rocking.motion import formats, records
from rocking.motion.formats.request import Request
from rocking.motion.motion import Motion
from rocking.tables import decimal, named, text_table


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
