"""Motions by name: of record files, of shipped records, of whole folders."""

from __future__ import annotations

import fnmatch
import glob
import sys
from collections.abc import Iterable
from pathlib import Path

from rocking.errors import UnreadableRecord
from rocking.motion import formats, records
from rocking.motion.formats.request import Request
from rocking.motion.motion import Motion

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

    Raises
    ------
    UnreadableRecord
        If there is neither, or the file cannot be read.
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

    Raises
    ------
    UnreadableRecord
        If there is no such file, record or channel.
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
    """Check that nothing is said of a shipped record that it knows itself.

    Raises
    ------
    UnreadableRecord
        If its channel, step or units are given.
    """
    for argument, value in said.items():
        if value is not None:
            sentence = "a shipped record is one channel, with its step and units; leave {} out"
            raise UnreadableRecord(sentence, argument, path=name)


def is_shipped(name: str) -> bool:
    """Whether a name is that of a shipped record, and not of a file.

    Raises
    ------
    UnreadableRecord
        If it is neither, but close to the name of a shipped record.
    """
    if name == STANDARD_INPUT or Path(name).exists():
        return False
    if name in records.names():
        return True
    meant = records.meant(name)
    if meant and not Path(name).suffix:
        raise UnreadableRecord(f"{name}: there is no such file or shipped record; did you mean {' or '.join(meant)}?")
    return False


def expanded(names: Iterable[str]) -> list[str]:
    """Return the names of records that files, folders, patterns and shipped records stand for, each once.

    A folder stands for the files in it, by name, hidden ones left out; a pattern for the files that match it, or where
    none does for the shipped records of such names.

    Raises
    ------
    UnreadableRecord
        If a folder holds no file, or nothing matches a pattern.

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
            raise UnreadableRecord(f"{name}: this folder holds no file; name one that holds records")
        return files
    if not glob.has_magic(name) or Path(name).exists():
        return [name]
    matching = sorted(path for path in glob.glob(name, recursive=True) if Path(path).is_file())  # noqa: PTH207 - any root
    matching = matching or fnmatch.filter(records.names(), name)
    if not matching:
        raise UnreadableRecord(
            f"{name}: no file or shipped record matches this pattern; check the folder and the pattern"
        )
    return matching
