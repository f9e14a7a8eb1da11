"""Record file in memory, and the caller's arguments: step, units and channel.

Line ends in the text of a file are made uniform, and errors refer to one of its lines.
"""

from __future__ import annotations

import contextlib
import csv
import errno
import io
import math
import os
import re
import stat
import zipfile
import zlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any, BinaryIO, NamedTuple

from rocking.core import checks
from rocking.errors import MotionError, RecordError, describe_install, escape_braces
from rocking.records import catalogue
from rocking.records.units import UNIT_NAMES, Unit, choose_unit, find_unit

#: Largest accepted file, bytes, a hundred times the longest strong-motion records.
MAX_SIZE = 512 * 2**20

#: Largest accepted file in an archive, bytes, because a small archive may unpack to any size.
_MAX_MEMBER_SIZE = 64 * 2**20

#: Decoded length of header lines, which limits the cost of files without line ends.
MAX_LINE_LENGTH = 512

_CONTROL_BYTES = bytes(c for c in range(32) if c not in b"\t\n")
_VISIBLE_PATTERN = re.compile(rb"\S")
_ZIP_MARK = b"PK\3\4"
_ARCHIVE_ERRORS = (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, zlib.error)
#: Members of archives that are no records: folders, hidden files, documents and pictures.
_NO_RECORD = re.compile(r"(?i)/$|(?:^|/)(?:\.|__MACOSX)|\.(?:pdf|docx?|html?|png|jpe?g|gif|ps|eps|kml|xml)$")


class Line(NamedTuple):
    """Line of a file."""

    text: str  # text, cut at MAX_LINE_LENGTH
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
        text = self.data[start : min(end, start + MAX_LINE_LENGTH)].decode("latin-1")
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
        match = _VISIBLE_PATTERN.search(self.data, start)
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
        return len(self.data.translate(None, _CONTROL_BYTES)) < 0.99 * len(self.data)

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


def name_path(path: str | os.PathLike[str] | BinaryIO) -> str:
    """Return the name of a file, or "standard input" for Python's standard streams."""
    if isinstance(path, (str, bytes, os.PathLike)):
        return os.fsdecode(path)
    if not hasattr(path, "read"):
        raise RecordError(f"the path of a record must be a file name, not {path!r}")
    name = getattr(path, "name", 0)
    return "standard input" if isinstance(name, int) or name in ("<stdin>", "<fdopen>") else str(name)


def open_source(path: str | os.PathLike[str] | BinaryIO) -> Source:
    """Read a whole file, or the rest of an open one."""
    name = name_path(path)
    try:
        name, raw = _unpack(name, path.read(MAX_SIZE + 1) if hasattr(path, "read") else _read_bytes(name))
    except (OSError, ValueError, *_ARCHIVE_ERRORS) as error:
        raise unreadable_file_error(name, error) from error
    if len(raw) > MAX_SIZE:
        limit = MAX_SIZE // 2**20
        raise RecordError(f"this file is larger than {limit} MiB; cut the record into smaller files", path=name)
    data = _normalise_text(_read_workbook(name, raw) if _is_workbook(raw) else raw)
    if not data.strip():
        raise RecordError("this file is empty; download the record again", path=name)
    return Source(name, raw, data)


def read_text(path: str | os.PathLike[str]) -> str:
    """Read a text table in UTF-8, or the first sheet of a workbook as comma-separated text."""
    source = open_source(path)
    try:
        return source.data.decode()
    except UnicodeDecodeError:
        raise source.error("the file is not a text table in UTF-8; save it as CSV") from None


def split_archive(name: str) -> tuple[str, str] | None:
    """Return the ZIP archive and the member of a name such as records.zip/file.at2, or None."""
    for match in re.finditer(r"(?i)\.zip[/\\]", name):
        if os.path.isfile(archive := name[: match.end() - 1]):  # noqa: PTH113
            return archive, name[match.end() :]
    return None


def list_archive(name: str) -> list[str]:
    """Return the names of the files in a ZIP archive, also in archives within it, or none for another file."""
    try:
        return [f"{name}/{member}" for member in _list_members(_read_bytes(name))]
    except (OSError, ValueError, *_ARCHIVE_ERRORS) as error:
        raise unreadable_file_error(name, error) from error


def _is_workbook(raw: bytes) -> bool:
    return raw.startswith(_ZIP_MARK) and b"xl/workbook.xml" in raw


def _list_members(raw: bytes, depth: int = 3) -> list[str]:
    """Return the files of a ZIP archive that may be records, also of archives within it, or none of other files."""
    members: list[str] = []
    if depth == 0 or not raw.startswith(_ZIP_MARK) or _is_workbook(raw):
        return members
    with contextlib.suppress(ValueError, *_ARCHIVE_ERRORS), zipfile.ZipFile(io.BytesIO(raw)) as archive:
        for name in sorted(name for name in archive.namelist() if not _NO_RECORD.search(name)):
            inner = _list_members(_extract(raw, name), depth - 1) if name.lower().endswith(".zip") else []
            members += [f"{name}/{member}" for member in inner] or [name]
    return members


def _extract(raw: bytes, member: str) -> bytes:
    """Return a member of a ZIP archive, also of an archive within it."""
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        if member in archive.namelist():
            with archive.open(member) as file:
                content = file.read(_MAX_MEMBER_SIZE + 1)
            if len(content) > _MAX_MEMBER_SIZE:
                limit = _MAX_MEMBER_SIZE // 2**20
                raise RecordError(f"this file in an archive is larger than {limit} MiB; unpack it", path=member)
            return content
    for match in re.finditer(r"(?i)\.zip/", member):
        return _extract(_extract(raw, member[: match.end() - 1]), member[match.end() :])
    raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), member)


def _unpack(name: str, raw: bytes) -> tuple[str, bytes]:
    """Return the name and content of the only file in a ZIP archive, or those of another file."""
    members = _list_members(raw)
    if len(members) > 1:
        listing = escape_braces(", ".join(f"{name}/{member}" for member in members[:10]))
        raise RecordError(f"this archive contains {len(members)} files; give one of {listing}", path=name)
    return (f"{name}/{members[0]}", _extract(raw, members[0])) if members else (name, raw)


def _read_workbook(name: str, raw: bytes) -> bytes:
    """Return the first sheet of a workbook as comma-separated text."""
    try:
        import openpyxl
    except ImportError:
        raise RecordError(f"this workbook requires openpyxl: {describe_install('excel')}", path=name) from None
    text = io.StringIO()
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            if sum(info.file_size for info in archive.infolist()) > _MAX_MEMBER_SIZE:
                raise ValueError
        workbook = openpyxl.load_workbook(io.BytesIO(raw), read_only=True, data_only=True)
        for row in workbook.worksheets[0].iter_rows(values_only=True):
            cells = ["" if cell is None else cell.isoformat() if hasattr(cell, "isoformat") else cell for cell in row]
            csv.writer(text).writerow(cells)
    except Exception as error:  # openpyxl raises any exception from a damaged file
        raise RecordError(
            "this workbook is damaged or too large; save it again, or save it as CSV", path=name
        ) from error
    return re.sub(r"(?m),+\r?$", "", text.getvalue()).encode()


def _read_bytes(name: str) -> bytes:
    if member := split_archive(name):
        return _extract(_read_bytes(member[0]), member[1])
    status = os.stat(name)  # noqa: PTH116 - Path() would turn an empty name into the current folder
    if not stat.S_ISREG(status.st_mode):
        text = "this is a folder" if stat.S_ISDIR(status.st_mode) else "this is not a regular file"
        raise RecordError(f"{text}; choose a record file", path=name)
    with open(name, "rb") as file:  # noqa: PTH123
        # A read allocates as much memory as requested.
        return file.read(min(status.st_size, MAX_SIZE) + 1)


def _normalise_text(raw: bytes) -> bytes:
    data = raw
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data.decode("utf-16", "replace").encode("latin-1", "replace")
    data = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    # A form feed at the start of a line is a page break and does not occupy a column.
    data = data.removeprefix(b"\f").replace(b"\n\f", b"\n").replace(b"\f", b" ")
    # Some programs fill up the last row of numbers with zero bytes.
    data = data.rstrip(b"\x00\x1a")
    return re.sub(rb"\x00+(?=\n)", b"", data) if b"\x00" in data else data


@dataclass(frozen=True)
class Request:
    """Arguments of a read, or None for those that the file should state.

    For several files, the arguments apply to files that do not state the values or contain several channels. They must
    not contradict a single file.
    """

    dt: float | None = None  # sampling step, s
    unit: Unit | None = None  # unit of the numbers
    channel: int | str | None = None  # number or name
    baseline: int | str | None = None  # degree of the polynomial to subtract, or "none"
    highpass: float | None = None  # corner frequency of a high-pass filter, Hz
    are_defaults: bool = False  # whether the arguments apply to several files
    max_samples: int | None = None  # limit of the samples unpacked from a compressed file

    @classmethod
    def create(cls, dt: float | None = None, units: str | None = None, **options: Any) -> Request:
        """Create a request from checked arguments, by the names of its fields."""
        step = None if dt is None else checks.positive(dt, "dt", MotionError, "s")
        return cls(step, None if units is None else choose_unit(units), **options)

    def check_step(self, source: Source, stated: float, offset: int | None) -> float:
        """Return the step (s) that the file states at an offset, or raise an error."""
        # Files contain no more samples than bytes, so this also bounds the record's duration.
        if not (stated > 0.0 and math.isfinite(stated * len(source.raw))):
            raise source.error(
                f"the sampling step must be positive; got {stated:g} s; correct it", offset, value=stated
            )
        if self.dt is not None and not self.are_defaults and not math.isclose(self.dt, stated, rel_tol=1e-6):
            text = f"the sampling step in the file is {stated:g} s, not {{}} {self.dt:g} s; omit {{}}"
            raise source.error(text, offset, "dt", "dt", value=self.dt)
        return stated

    def resolve_unit(self, source: Source, stated: Unit | str | None, offset: int | None) -> Unit:
        """Return the unit that the file states at an offset, or else the requested one."""
        spelling = stated.strip() if isinstance(stated, str) else ""
        unit = find_unit(spelling) if isinstance(stated, str) else stated
        unit = unit or (None if spelling and self.are_defaults else self.unit)
        if unit is None:
            unknown = f"the units {escape_braces(repr(spelling))} are unknown"
            fault = unknown if spelling else "the file does not state its units"
            raise source.error(f"{fault}; give {{}} as one of {', '.join(UNIT_NAMES)}", offset, "units")
        if self.unit is not None and not self.are_defaults and unit != self.unit:
            text = f"the units in the file are {unit.name}, not {{}} {self.unit.name!r}; omit {{}}"
            raise source.error(text, offset, "units", "units", value=self.unit.name)
        return unit
