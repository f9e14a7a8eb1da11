"""Where a study is kept: objects that are put whole or not at all, listed, and got back."""

from __future__ import annotations

import contextlib
import os
import socket
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Final, Protocol

from rocking import checks
from rocking.errors import OutputError, StudyError
from rocking.studies import locks

#: End of the names of files that are half-written; a crash leaves them, the next run removes them.
_PART: Final = ".part"

#: How often, and how long after one another, a lock is tried, s.
_TRIES: Final = 3
_MOMENT: Final = 0.02


class Place(Protocol):
    """What a study asks of the place where it is kept, which str() names; names of objects may hold one "/"."""

    def put(self, name: str, data: bytes) -> None:
        """Store an object: when this returns it survives a crash, before that it does not exist."""

    def get(self, name: str) -> bytes | None:
        """Return an object, or None where there is none."""

    def names(self, folder: str) -> Iterator[str]:
        """List the objects of a folder ("": of the place itself), without its name, in any order."""

    def append(self, name: str, line: str) -> None:
        """Add a line to an object that only people read."""

    def locked(self) -> contextlib.AbstractContextManager[str]:
        """Keep everyone else from running the study; gives a note on a lock that was left behind, or nothing."""

    def holder(self) -> str:
        """Say who runs the study now; empty where nobody does."""


class Folder:
    """A study in a folder of this machine, or of a file system that it shares.

    Parameters
    ----------
    path : Path
        The folder; made where there is none.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def __str__(self) -> str:
        """Name the folder."""
        return str(self.path)

    def put(self, name: str, data: bytes) -> None:
        """Write beside the object, flush to the disk, rename, and flush the folder."""
        target = self.path / name
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            written = _written(target.parent, data)
            try:
                written.replace(target)
            except OSError:
                written.unlink(missing_ok=True)
                raise
            _flush_folder(target.parent)
        except OSError as error:
            raise OutputError(
                f"{target} cannot be written: {error.strerror or error}; nothing of it was kept"
            ) from error

    def get(self, name: str) -> bytes | None:
        """Read the file of the object."""
        target = self.path / name
        try:
            return target.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise StudyError(f"{target} cannot be read: {error.strerror or error}") from error

    def names(self, folder: str) -> Iterator[str]:
        """List the files of a folder, without those that are half-written."""
        try:
            with os.scandir(self.path / folder) as entries:
                yield from (entry.name for entry in entries if not entry.name.startswith("."))
        except FileNotFoundError:
            return

    def append(self, name: str, line: str) -> None:
        """Append the line to the file."""
        try:
            with (self.path / name).open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError as error:
            raise OutputError(f"{self.path / name} cannot be written: {error.strerror or error}") from error

    @contextlib.contextmanager
    def locked(self) -> Iterator[str]:
        """Hold the file `lock`, which names the process and host that hold it, for as long as the process lives."""
        with self._lock_file() as file:
            if not _taken(file):
                raise StudyError(f"the study in {self.path} is being run by {_read(file) or 'another process'}")
            before = _read(file)
            file.truncate(0)
            file.write(this_process())
            file.flush()
            for left in self.path.rglob(f"*{_PART}"):
                left.unlink(missing_ok=True)
            try:
                yield f"took over from {before}, which did not finish" if before else ""
            finally:
                file.truncate(0)
                locks.leave(file)

    def holder(self) -> str:
        """Read the lock, where somebody holds it."""
        try:
            with (self.path / "lock").open("a+", encoding="utf-8") as file:
                if not locks.take(file):
                    return _read(file)
                locks.leave(file)
        except OSError:  # who may not write here does not run it
            pass
        return ""

    @contextlib.contextmanager
    def _lock_file(self) -> Iterator[IO[str]]:
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            with (self.path / "lock").open("a+", encoding="utf-8") as file:
                yield file
        except OSError as error:
            raise OutputError(f"{self.path / 'lock'} cannot be locked: {error.strerror or error}") from error


def place_of(where: str | Path) -> Place:
    """Return the place that a path or a URL (``s3://bucket/prefix``) names.

    Raises
    ------
    StudyError
        If it is a file, or neither text nor a path.
    """
    checks.path(where, "the folder of a study", StudyError)
    if "://" in str(where):
        from rocking.studies.objects import ObjectStore

        return ObjectStore(str(where))
    if Path(where).is_file():
        raise StudyError(f"{where} is a file, and a study is kept in a folder: name that")
    return Folder(Path(where))


def this_process() -> str:
    """Name this process and its host."""
    return f"process {os.getpid()} on {socket.gethostname()}"


def _taken(file: IO[str]) -> bool:
    """Lock a file; tried again, since somebody who only asks for the holder has it for a moment."""
    for _ in range(_TRIES):
        if locks.take(file):
            return True
        time.sleep(_MOMENT)
    return False


def _read(file: IO[str]) -> str:
    file.seek(0)
    return file.read().strip()


def _written(folder: Path, data: bytes) -> Path:
    """Temporary file of these bytes, on the disk."""
    handle, name = tempfile.mkstemp(prefix=".", suffix=_PART, dir=folder)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
            _let_go(file.fileno())
    except OSError:
        Path(name).unlink(missing_ok=True)
        raise
    return Path(name)


def _let_go(handle: int) -> None:
    """Keep no copy of a file in memory: the next one would need new memory, which can cost more than the writing."""
    if hasattr(os, "posix_fadvise"):
        os.posix_fadvise(handle, 0, 0, os.POSIX_FADV_DONTNEED)


def _flush_folder(folder: Path) -> None:
    if os.name == "nt":  # folders cannot be opened there; its file system keeps a journal of names
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
