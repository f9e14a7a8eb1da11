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
from rocking.errors import MotionError, RecordError, escape_braces
from rocking.records import catalogue
from rocking.records.units import UNIT_NAMES, Unit, choose_unit, find_unit

#: Largest accepted file, bytes, a hundred times the longest strong-motion records.
SIZE_LIMIT = 512 * 2**20

#: Decoded length of header lines, which limits the cost of files without line ends.
LINE_LIMIT = 512

_CONTROL = bytes(c for c in range(32) if c not in b"\t\n")
_VISIBLE = re.compile(rb"\S")


class Line(NamedTuple):
    """Line of a file."""

    text: str  # text, cut at LINE_LIMIT
    start: int  # offset in the file
    next_start: int  # offset of the next line


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

    def read_line(self, start: int) -> Line:
        """Return the line that starts at the offset `start`."""
        end = self.data.find(b"\n", start)
        end = len(self.data) if end < 0 else end
        text = self.data[start : min(end, start + LINE_LIMIT)].decode("latin-1")
        return Line(text.rstrip(), start, min(end + 1, len(self.data)))

    def read_lines(self, start: int, count: int) -> list[Line]:
        """Return up to `count` lines from the offset `start`."""
        lines: list[Line] = []
        while len(lines) < count and start < len(self.data):
            lines.append(self.read_line(start))
            start = lines[-1].next_start
        return lines

    def find_first_line(self, start: int = 0) -> Line | None:
        """Return the first line from `start` that is not blank, or None."""
        match = _VISIBLE.search(self.data, start)
        return None if match is None else self.read_line(self.data.rfind(b"\n", 0, match.start()) + 1)

    def find_first_lines(self, count: int) -> list[Line]:
        """Return up to `count` lines from the first nonblank one."""
        first = self.find_first_line()
        return [] if first is None else self.read_lines(first.start, count)

    def find_line_number(self, offset: int) -> int:
        """Return the number (from 1) of the line that contains an offset."""
        return self.data.count(b"\n", 0, offset) + 1

    @cached_property
    def is_binary(self) -> bool:
        """Whether at least one byte in a hundred cannot occur in a text file."""
        return len(self.data.translate(None, _CONTROL)) < 0.99 * len(self.data)

    def error(self, message: str, offset: int | None = None, *arguments: str, value: object = None) -> RecordError:
        """Return an error with this message about the file's line at an offset."""
        line = None if offset is None else self.find_line_number(offset)
        return RecordError(message, *arguments, path=self.path, line=line, value=value)


def unreadable_file_error(name: str, error: Exception) -> RecordError:
    """Return an error for a file that could not be opened, with any similar shipped record."""
    text = f"this file could not be read ({getattr(error, 'strerror', None) or error}); check the name and the disk"
    if isinstance(error, FileNotFoundError):
        hint = catalogue.suggest_records(name, "check the name and the folder", "the shipped record ")
        text = f"there is no such file; {hint}"
    return RecordError(text, path=name)


def open_source(path: str | os.PathLike[str] | BinaryIO) -> Source:
    """Read a whole file, or the rest of an open one."""
    read = getattr(path, "read", None)
    if read is not None:  # Python's standard streams are named "<stdin>" or by a number
        name = str(getattr(path, "name", "<"))
        name = "standard input" if name.startswith("<") or name.isdecimal() else name
    elif not isinstance(path, (str, bytes, os.PathLike)):
        raise RecordError(f"the path of a record must be a file name, not {path!r}")
    else:
        name = os.fsdecode(path)
    try:
        raw = _read_bytes(name) if read is None else read(SIZE_LIMIT + 1)
    except (OSError, ValueError) as error:
        raise unreadable_file_error(name, error) from error
    if len(raw) > SIZE_LIMIT:
        limit = SIZE_LIMIT // 2**20
        raise RecordError(f"this file is larger than {limit} MiB; cut the record into smaller files", path=name)
    data = _normalise_text(raw)
    if not data.strip():
        raise RecordError("this file is empty; download the record again", path=name)
    return Source(name, raw, data)


def _read_bytes(name: str) -> bytes:
    status = os.stat(name)  # noqa: PTH116 - Path() would turn an empty name into the current folder
    if not stat.S_ISREG(status.st_mode):
        text = "this is a folder" if stat.S_ISDIR(status.st_mode) else "this is not a regular file"
        raise RecordError(f"{text}; choose a record file", path=name)
    with open(name, "rb") as file:  # noqa: PTH123
        # A read allocates as much memory as requested.
        return file.read(min(status.st_size, SIZE_LIMIT) + 1)


def _normalise_text(raw: bytes) -> bytes:
    data = raw
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data.decode("utf-16", "replace").encode("latin-1", "replace")
    data = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    # A form feed at the start of a line is a page break and does not occupy a column.
    data = data.removeprefix(b"\f").replace(b"\n\f", b"\n").replace(b"\f", b" ")
    return data.rstrip(b"\x00\x1a")


@dataclass(frozen=True)
class Request:
    """Arguments of a read, or None for those that the file should state.

    For several files, the arguments apply to files that do not state the values or contain several channels. They must
    not contradict a single file.
    """

    dt: float | None = None  # sampling step, s
    unit: Unit | None = None  # unit of the numbers
    channel: int | str | None = None  # number or name
    several: bool = False  # whether the arguments apply to several files
    max_samples: int | None = None  # limit of the samples unpacked from a compressed file

    @classmethod
    def create(
        cls,
        dt: float | None = None,
        units: str | None = None,
        channel: int | str | None = None,
        *,
        several: bool = False,
    ) -> Request:
        """Create a request from checked arguments."""
        step = None if dt is None else checks.positive(dt, "dt", MotionError, "s")
        return cls(step, None if units is None else choose_unit(units), channel, several)

    def check_step(self, source: Source, stated: float, offset: int | None) -> float:
        """Return the step (s) that the file states at an offset, or raise an error."""
        # Files contain no more samples than bytes, so this also bounds the record's duration.
        if not (stated > 0.0 and math.isfinite(stated * len(source.raw))):
            raise source.error(
                f"the sampling step must be positive; got {stated:g} s; correct it", offset, value=stated
            )
        if self.dt is not None and not self.several and not math.isclose(self.dt, stated, rel_tol=1e-6):
            text = f"the sampling step in the file is {stated:g} s, not {{}} {self.dt:g} s; omit {{}}"
            raise source.error(text, offset, "dt", "dt", value=self.dt)
        return stated

    def resolve_unit(self, source: Source, stated: Unit | str | None, offset: int | None) -> Unit:
        """Return the unit that the file states at an offset, or else the requested one."""
        spelling = stated.strip() if isinstance(stated, str) else ""
        unit = find_unit(spelling) if isinstance(stated, str) else stated
        unit = unit or (None if spelling and self.several else self.unit)
        if unit is None:
            unknown = f"the units {escape_braces(repr(spelling))} are unknown"
            fault = unknown if spelling else "the file does not state its units"
            raise source.error(f"{fault}; give {{}} as one of {', '.join(UNIT_NAMES)}", offset, "units")
        if self.unit is not None and not self.several and unit != self.unit:
            text = f"the units in the file are {unit.name}, not {{}} {self.unit.name!r}; omit {{}}"
            raise source.error(text, offset, "units", "units", value=self.unit.name)
        return unit
