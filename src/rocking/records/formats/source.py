"""Record file in memory, and the caller's arguments: step, units and channel.

Line ends in the text of a file are made uniform, and errors refer to one of its lines.
"""

from __future__ import annotations

import math
import os
import re
import stat
from dataclasses import dataclass
from functools import cached_property
from typing import BinaryIO, NamedTuple

from rocking.core import checks
from rocking.errors import InvalidMotion, UnreadableRecord, literal
from rocking.records import catalogue
from rocking.records.units import CHOICES, Unit, choose_unit, find_unit

#: Largest accepted file, bytes, a hundred times the longest strong-motion records.
SIZE_LIMIT = 512 * 2**20

#: Decoded length of header lines, which limits the cost of files without line ends.
LINE_LIMIT = 512

_CONTROL = bytes(c for c in range(32) if c not in b"\t\n")
_VISIBLE = re.compile(rb"\S")


class Line(NamedTuple):
    """Line: text (cut at LINE_LIMIT), its offset in the file, and the offset of the next line."""

    text: str
    start: int
    next: int


@dataclass(frozen=True)
class Source:
    """Content of a file.

    Attributes
    ----------
    path : str
        File name as specified by the user.
    raw : bytes
        Bytes as on disk, for binary formats.
    data : bytes
        Text without byte-order marks, form feeds and end-of-text bytes, with lines ended by newlines.
    """

    path: str
    raw: bytes
    data: bytes

    def line(self, start: int) -> Line:
        """Return the line that starts at the offset `start`."""
        end = self.data.find(b"\n", start)
        end = len(self.data) if end < 0 else end
        text = self.data[start : min(end, start + LINE_LIMIT)].decode("latin-1")
        return Line(text.rstrip(), start, min(end + 1, len(self.data)))

    def lines(self, start: int, count: int) -> list[Line]:
        """Return up to `count` lines from the offset `start`."""
        found: list[Line] = []
        while len(found) < count and start < len(self.data):
            found.append(self.line(start))
            start = found[-1].next
        return found

    def first_line(self, start: int = 0) -> Line | None:
        """Return the first line from `start` that is not blank, or None."""
        found = _VISIBLE.search(self.data, start)
        return None if found is None else self.line(self.data.rfind(b"\n", 0, found.start()) + 1)

    def first_lines(self, count: int) -> list[Line]:
        """Return up to `count` lines from the first nonblank one."""
        first = self.first_line()
        return [] if first is None else self.lines(first.start, count)

    def line_number(self, at: int) -> int:
        """Return the number (from 1) of the line that contains the offset `at`."""
        return self.data.count(b"\n", 0, at) + 1

    @cached_property
    def is_binary(self) -> bool:
        """Whether at least one byte in a hundred cannot occur in a text file."""
        return len(self.data.translate(None, _CONTROL)) < 0.99 * len(self.data)

    def error(self, message: str, at: int | None = None, *arguments: str, value: object = None) -> UnreadableRecord:
        """Return an error with this message about the file's line at the offset `at`."""
        line = None if at is None else self.line_number(at)
        return UnreadableRecord(message, *arguments, path=self.path, line=line, value=value)


def unreadable(name: str, error: Exception) -> UnreadableRecord:
    """Return an error for a file that could not be opened, with any similar shipped record."""
    text = f"this file could not be read ({getattr(error, 'strerror', None) or error}); check the name and the disk"
    if isinstance(error, FileNotFoundError):
        meant = catalogue.meant(name, "check the name and the folder", "the shipped record ")
        text = f"there is no such file; {meant}"
    return UnreadableRecord(text, path=name)


def open_source(path: str | os.PathLike[str] | BinaryIO) -> Source:
    """Read a whole file, or the rest of an open one."""
    read = getattr(path, "read", None)
    if read is not None:  # Python's standard streams are named "<stdin>" or by a number
        name = str(getattr(path, "name", "<"))
        name = "standard input" if name.startswith("<") or name.isdecimal() else name
    elif not isinstance(path, (str, bytes, os.PathLike)):
        raise UnreadableRecord(f"the path of a record must be a file name, not {path!r}")
    else:
        name = os.fsdecode(path)
    try:
        raw = _content(name) if read is None else read(SIZE_LIMIT + 1)
    except (OSError, ValueError) as error:
        raise unreadable(name, error) from error
    if len(raw) > SIZE_LIMIT:
        limit = SIZE_LIMIT // 2**20
        raise UnreadableRecord(f"this file is larger than {limit} MiB; cut the record into smaller files", path=name)
    data = _text(raw)
    if not data.strip():
        raise UnreadableRecord("this file is empty; get the record again", path=name)
    return Source(name, raw, data)


def _content(name: str) -> bytes:
    status = os.stat(name)  # noqa: PTH116 - Path() would turn an empty name into the current folder
    if not stat.S_ISREG(status.st_mode):
        text = "this is a folder" if stat.S_ISDIR(status.st_mode) else "this is not a regular file"
        raise UnreadableRecord(f"{text}; name one record file", path=name)
    with open(name, "rb") as file:  # noqa: PTH123
        # A read allocates as much memory as requested.
        return file.read(min(status.st_size, SIZE_LIMIT) + 1)


def _text(raw: bytes) -> bytes:
    data = raw
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data.decode("utf-16", "replace").encode("latin-1", "replace")
    data = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    # A form feed at the start of a line is a page break and does not occupy a column.
    data = data.removeprefix(b"\f").replace(b"\n\f", b"\n").replace(b"\f", b" ")
    return data.rstrip(b"\x00\x1a")


@dataclass(frozen=True)
class Request:
    """Arguments `dt` (s), `units` and `channel` of a read, or None if the file should state them.

    ``most`` limits the number of samples unpacked from a compressed file, unless None. For several files, the arguments
    apply to files that do not state the values or contain several channels. They must not contradict a single file.
    """

    dt: float | None = None
    unit: Unit | None = None
    channel: int | str | None = None
    several: bool = False
    most: int | None = None

    @classmethod
    def checked(
        cls,
        dt: float | None = None,
        units: str | None = None,
        channel: int | str | None = None,
        *,
        several: bool = False,
    ) -> Request:
        """Create a request from checked arguments."""
        step = None if dt is None else checks.positive(dt, "dt", InvalidMotion, "s")
        return cls(step, None if units is None else choose_unit(units), channel, several)

    def step(self, source: Source, stated: float, at: int | None) -> float:
        """Return the checked step (s) that the file states at the offset `at`."""
        # Files contain no more samples than bytes, so this also bounds the record's duration.
        if not (stated > 0.0 and math.isfinite(stated * len(source.raw))):
            raise source.error(f"the sampling step is {stated:g} s, but it must be positive; correct it", at)
        if self.dt is not None and not self.several and not math.isclose(self.dt, stated, rel_tol=1e-6):
            text = f"the sampling step is {stated:g} s, not {{}} {self.dt:g} s; leave {{}} out"
            raise source.error(text, at, "dt", "dt", value=self.dt)
        return stated

    def units(self, source: Source, stated: Unit | str | None, at: int | None) -> Unit:
        """Return the unit that the file states at the offset `at`, or else the requested one."""
        spelling = stated.strip() if isinstance(stated, str) else ""
        unit = find_unit(spelling) if isinstance(stated, str) else stated
        unit = unit or (None if spelling and self.several else self.unit)
        if unit is None:
            unknown = f"the units {literal(repr(spelling))} are not known"
            fault = unknown if spelling else "the file does not say its units"
            raise source.error(f"{fault}; give {{}} as one of {', '.join(CHOICES)}", at, "units")
        if self.unit is not None and not self.several and unit != self.unit:
            text = f"the units are {unit.name}, not {{}} {self.unit.name!r}; leave {{}} out"
            raise source.error(text, at, "units", "units", value=self.unit.name)
        return unit
