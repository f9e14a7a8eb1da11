"""Where a study is kept: objects that are put whole or not at all, listed, and got back."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final, Protocol

from rocking.errors import OutputError, StudyError

#: End of the names of files that are half-written; a crash leaves them, the next run removes them.
_PART: Final = ".part"


class Place(Protocol):
    """What a study asks of the place where it is kept; names may hold one "/"."""

    def put(self, name: str, data: bytes) -> None:
        """Store an object: when this returns it survives a crash, before that it does not exist."""

    def get(self, name: str) -> bytes | None:
        """Return an object, or None where there is none."""

    def names(self, folder: str) -> Iterator[str]:
        """List the objects of a folder, without its name, in any order."""

    def append(self, name: str, line: str) -> None:
        """Add a line to an object that only people read."""

    def locked(self) -> contextlib.AbstractContextManager[str]:
        """Keep everyone else from running the study; gives a note on a lock that was left behind, or nothing."""


class Folder:
    """A study in a folder of this machine, or of a file system that it shares.

    Parameters
    ----------
    path : Path
        The folder; made where there is none.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def put(self, name: str, data: bytes) -> None:
        """Write beside the object, flush to the disk, rename, and flush the folder."""
        target = self.path / name
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            written = _written(target.parent, data)
            try:
                written.rename(target)
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
        import fcntl

        self.path.mkdir(parents=True, exist_ok=True)
        with (self.path / "lock").open("a+", encoding="utf-8") as file:
            file.seek(0)
            holder = file.read().strip()
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                if error.errno not in (errno.EWOULDBLOCK, errno.EACCES):
                    raise StudyError(f"{self.path / 'lock'} cannot be locked: {error.strerror}") from error
                raise StudyError(f"the study in {self.path} is being run by {holder or 'another process'}") from None
            file.truncate(0)
            file.write(f"process {os.getpid()} on {socket.gethostname()}")
            file.flush()
            for left in self.path.rglob(f"*{_PART}"):
                left.unlink(missing_ok=True)
            try:
                yield f"took over from {holder}, which did not finish" if holder else ""
            finally:
                file.truncate(0)


def _written(folder: Path, data: bytes) -> Path:
    """Temporary file of these bytes, on the disk."""
    handle, name = tempfile.mkstemp(prefix=".", suffix=_PART, dir=folder)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
    except OSError:
        Path(name).unlink(missing_ok=True)
        raise
    return Path(name)


def _flush_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
