"""The folder of a study: files that are written whole or not at all, and the locks of the processes that run it."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Final

from rocking import checks
from rocking.errors import OutputError, StudyError

if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[bytes]) -> None:
        file.seek(0)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(file: IO[bytes]) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


#: End of the names of files that are half-written; a crash leaves them, and the next run removes them.
_PART: Final = ".part"

#: How often a lock is tried, and how long after one another, s: whoever reads its holder has it for a moment.
_TRIES: Final = 3
_BETWEEN_TRIES: Final = 0.02


class Folder:
    """Files of a study, made where there is no folder yet.

    Attributes
    ----------
    path : Path
        Where it is.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = checks.path(path, "the folder of a study", StudyError)
        if "://" in str(path):
            raise StudyError("this is a URL, and a study is kept in a folder: name a folder", path=str(path))
        if self.path.is_file():
            raise StudyError("this is a file, and a study is kept in a folder: name that", path=str(path))

    def __str__(self) -> str:
        """Name the folder."""
        return str(self.path)

    def put(self, name: str, data: bytes) -> None:
        """Write beside the file, flush to the disk, rename, and flush the folder."""
        target = self.path / name
        with _refused("written", target, kept="; nothing of it was kept"):
            target.parent.mkdir(parents=True, exist_ok=True)
            with _written(target.parent, data) as written:
                written.replace(target)
            _flush_folder(target.parent)

    def keep(self, name: str, data: bytes) -> None:
        """Write a file unless it has this content already."""
        if self.get(name) != data:
            self.put(name, data)

    def get(self, name: str) -> bytes | None:
        """Read a file; None where there is none."""
        target = self.path / name
        try:
            return target.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise StudyError(f"the file cannot be read: {error.strerror or error}", path=str(target)) from error

    def names(self, folder: str = "") -> list[str]:
        """List the files and folders in this one or in one of its folders, without files that are half-written."""
        try:
            with os.scandir(self.path / folder) as entries:
                return [entry.name for entry in entries if not entry.name.startswith(".")]
        except FileNotFoundError:
            return []

    def append(self, name: str, line: str) -> None:
        """Append a line to a file, on a line of its own where a crash has cut the last one."""
        with _refused("written", self.path / name), (self.path / name).open("ab+") as file:
            end = file.seek(0, os.SEEK_END)
            file.seek(max(0, end - 1))
            is_cut = file.read(1) not in (b"", b"\n")
            file.write(b"\n" * is_cut + line.encode() + b"\n")

    @contextlib.contextmanager
    def locked(self, lock: str = "lock") -> Iterator[None]:
        """Hold a lock, a file that names its holder, for as long as the process lives.

        "lock" excludes every other holder; others ("lock.3-10", of a part) exclude the same part and "lock". A file
        that is left behind locks nothing.
        """
        with _refused("locked", self.path / lock):
            self.path.mkdir(parents=True, exist_ok=True)
            file = (self.path / lock).open("a+b", buffering=0)
        with file:
            with _refused("locked", self.path / lock):
                own = [] if _acquired(file, _TRIES) else [_holder(file)]
                # A process takes its own lock before it looks at those of others, so that two never miss each other.
                others = self.holders(_TRIES).items()
                holders = own + [who for other, who in others if other != lock and "lock" in (lock, other)]
                if holders:
                    who = ", ".join(each or "another process" for each in holders)
                    raise StudyError(
                        f"the study is being run by {who}; wait for it, or end it there and run it again",
                        path=str(self),
                    )
                file.truncate(0)
                # On Windows nobody else can read the byte that is locked: the name begins at the second one.
                file.write(f" {this_process()}".encode())
                if lock == "lock":
                    for left in self.path.rglob(f"*{_PART}"):
                        left.unlink(missing_ok=True)
            yield

    def holders(self, tries: int = 1) -> dict[str, str]:
        """Return the process that holds each lock that is held."""
        found = {}
        for lock in self.names():
            if lock == "lock" or lock.startswith("lock."):
                # A process that may not write to the folder does not run the study.
                with contextlib.suppress(OSError), (self.path / lock).open("a+b", buffering=0) as file:
                    if not _acquired(file, tries):
                        found[lock] = _holder(file)
        return found


def this_process() -> str:
    """Name this process and its host."""
    return f"process {os.getpid()} on {socket.gethostname()}"


@contextlib.contextmanager
def _refused(done: str, target: Path, kept: str = "") -> Iterator[None]:
    """Raise an OutputError where the system refuses to do something to a file."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"the file cannot be {done}: {error.strerror or error}{kept}", path=str(target)) from error


def _acquired(file: IO[bytes], tries: int) -> bool:
    """Lock a file until it is closed, and return whether that succeeded."""
    for left in reversed(range(tries)):
        try:
            _lock(file)
        except (BlockingIOError, PermissionError):
            time.sleep(_BETWEEN_TRIES if left else 0.0)
        else:
            return True
    return False


def _holder(file: IO[bytes]) -> str:
    file.seek(1)
    return file.read().decode(errors="replace").strip()


@contextlib.contextmanager
def _written(folder: Path, data: bytes) -> Iterator[Path]:
    """Give a file of these bytes, on the disk, which goes unless it is renamed; the umask decides who may read it."""
    part = folder / f".{uuid.uuid4().hex}{_PART}"
    try:
        with part.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
            if hasattr(os, "posix_fadvise"):  # a copy in memory would cost more than the writing
                os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
        yield part
    finally:
        part.unlink(missing_ok=True)


def _flush_folder(folder: Path) -> None:
    if os.name == "nt":  # folders cannot be opened there; its file system keeps a journal of names
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
