"""Where a study is kept: objects that are put whole or not at all, listed, and got back.

A folder holds them as files. An object store (S3 and what speaks like it, Google's, Azure's) holds the same objects.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import threading
import time
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final, Protocol

from rocking import checks
from rocking.errors import InvalidOption, OutputError, StudyError, install

#: End of the names of files that are half-written; a crash leaves them, the next run removes them.
_PART: Final = ".part"

#: The object that is locked; it names who holds it.
_LOCK: Final = "lock"

#: How often, and how long after one another, the lock of a folder is tried, s.
_TRIES: Final = 3
_BETWEEN_TRIES: Final = 0.02

#: An object that is written to learn the store's own time.
_CLOCK: Final = "clock"

#: How often the lock of an object store is renewed, and how old it is when its holder is taken for dead, s.
_RENEWAL: Final = 20.0
_LEASE: Final = 120.0


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
        """Return who runs the study now; empty where nobody does."""


def place_of(where: str | Path) -> Place:
    """Return the place that a path or a URL (``s3://bucket/prefix``) names; a StudyError where it can be none."""
    checks.path(where, "the folder of a study", StudyError)
    if "://" in str(where):
        return ObjectStore(str(where))
    if Path(where).is_file():
        raise StudyError("this is a file, and a study is kept in a folder: name that", path=str(where))
    return Folder(Path(where))


def this_process() -> str:
    """Name this process and its host."""
    return f"process {os.getpid()} on {socket.gethostname()}"


class Folder:
    """A study in a folder of this machine, or of a file system that it shares; made where there is none."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __str__(self) -> str:
        """Name the folder."""
        return str(self.path)

    def put(self, name: str, data: bytes) -> None:
        """Write beside the object, flush to the disk, rename, and flush the folder."""
        target = self.path / name
        with _refused("written", target, kept="; nothing of it was kept"):
            target.parent.mkdir(parents=True, exist_ok=True)
            with _written(target.parent, data) as written:
                written.replace(target)
            _flush_folder(target.parent)

    def get(self, name: str) -> bytes | None:
        """Read the file of the object."""
        target = self.path / name
        try:
            return target.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise StudyError(f"the file cannot be read: {error.strerror or error}", path=str(target)) from error

    def names(self, folder: str) -> Iterator[str]:
        """List the files of a folder, without those that are half-written."""
        try:
            with os.scandir(self.path / folder) as entries:
                yield from (entry.name for entry in entries if not entry.name.startswith("."))
        except FileNotFoundError:
            return

    def append(self, name: str, line: str) -> None:
        """Append the line to the file, in a line of its own where a crash has cut the last one."""
        with _refused("written", self.path / name), (self.path / name).open("ab+") as file:
            end = file.seek(0, os.SEEK_END)
            file.seek(max(0, end - 1))
            is_cut = file.read(1) not in (b"", b"\n")
            file.write(b"\n" * is_cut + line.encode() + b"\n")

    @contextlib.contextmanager
    def locked(self) -> Iterator[str]:
        """Hold the file `lock`, which names the process and host that hold it, for as long as the process lives."""
        with contextlib.ExitStack() as stack:
            with _refused("locked", self.path / _LOCK):
                self.path.mkdir(parents=True, exist_ok=True)
                file = stack.enter_context(self._lock_file())
                if not _lock(file, _TRIES):
                    holder = _holder(file) or "another process"
                    sentence = f"the study is being run by {holder}; wait for it, or end it there and run it again"
                    raise StudyError(sentence, path=str(self))
                file.seek(0)
                before = file.read().decode(errors="replace").strip()
                file.truncate(0)
                file.write(f" {this_process()}".encode())
                for left in self.path.rglob(f"*{_PART}"):
                    left.unlink(missing_ok=True)
            try:
                yield f"took over from {before}, which did not finish" if before else ""
            finally:
                with _refused("unlocked", self.path / _LOCK):
                    file.truncate(0)
                    _unlock(file)

    def holder(self) -> str:
        """Read the lock, where somebody holds it; none is made to be looked at."""
        if not (self.path / _LOCK).exists():
            return ""
        with contextlib.suppress(OSError), self._lock_file() as file:  # who may not write here does not run it
            if not _lock(file):
                return _holder(file)
            _unlock(file)
        return ""

    def _lock_file(self) -> IO[bytes]:
        return (self.path / _LOCK).open("a+b", buffering=0)


@contextlib.contextmanager
def _refused(done: str, target: Path, kept: str = "") -> Iterator[None]:
    """Raise an OutputError where the system refuses to do something to a file."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"the file cannot be {done}: {error.strerror or error}{kept}", path=str(target)) from error


def _lock(file: IO[bytes], tries: int = 1) -> bool:
    """Lock a file; tried again, since somebody who only asks for the holder has it for a moment."""
    from filelock import lock_descriptor

    for k in range(tries):
        if k:
            time.sleep(_BETWEEN_TRIES)
        if lock_descriptor(file.fileno(), blocking=False):
            return True
    return False


def _unlock(file: IO[bytes]) -> None:
    from filelock import unlock_descriptor

    unlock_descriptor(file.fileno())


def _holder(file: IO[bytes]) -> str:
    """Read who holds a lock; the first byte, a blank, is what Windows lets nobody else read."""
    file.seek(1)
    return file.read().decode(errors="replace").strip()


@contextlib.contextmanager
def _written(folder: Path, data: bytes) -> Iterator[Path]:
    """Give a file of these bytes, on the disk, which goes unless it is renamed; the umask says who may read it."""
    part = folder / f".{uuid.uuid4().hex}{_PART}"
    try:
        with part.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
            _drop_from_cache(file.fileno())
        yield part
    finally:
        part.unlink(missing_ok=True)


def _drop_from_cache(handle: int) -> None:
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


class ObjectStore:
    """A study under a prefix of an object store.

    Parameters
    ----------
    url : str
        As ``s3://bucket/prefix``. Credentials, region and endpoint are taken from the environment (AWS_ACCESS_KEY_ID,
        AWS_SECRET_ACCESS_KEY, AWS_REGION, AWS_ENDPOINT_URL and so on).

    Raises
    ------
    InvalidOption
        If obstore is not installed, or there is no such kind of store.
    """

    def __init__(self, url: str) -> None:
        try:
            import obstore
            from obstore.store import from_url
        except ImportError:
            raise InvalidOption(f"an object store needs obstore: {install('objects')}") from None
        self._url, self._library, self._taken_over = url, obstore, False
        #: What tells the locks that this object has put from those of others.
        self._renewals: set[str] = set()
        try:
            self._store = from_url(url)
        except Exception as error:  # its own kinds, and those of the system
            raise InvalidOption(f"this is no URL of an object store: {_first_line(error)}", path=url) from None

    def __str__(self) -> str:
        """Name the place."""
        return self._url

    def put(self, name: str, data: bytes) -> None:
        """Store an object in one request, which is carried out whole or not at all."""
        if self._taken_over:
            raise StudyError("the study was taken over by another run while this one was not heard of", path=str(self))
        try:
            self._library.put(self._store, name, data)
        except self._failures as error:
            raise self._failed("written", name, error, OutputError) from error

    def get(self, name: str) -> bytes | None:
        """Get the object."""
        try:
            return bytes(self._library.get(self._store, name).bytes())
        except FileNotFoundError:
            return None
        except self._failures as error:
            raise self._failed("read", name, error) from error

    def names(self, folder: str) -> Iterator[str]:
        """List the objects whose names begin with that of the folder."""
        try:
            for chunk in self._library.list(self._store, folder or None):
                yield from (one["path"].removeprefix(f"{folder}/") for one in chunk)
        except self._failures as error:
            raise self._failed("listed", folder, error) from error

    def append(self, name: str, line: str) -> None:
        """Store the object anew, with the line; only who holds the lock does."""
        self.put(name, (self.get(name) or b"") + line.encode() + b"\n")

    @contextlib.contextmanager
    def locked(self) -> Iterator[str]:
        """Hold the object `lock`, put on the condition that there is none, and renewed as long as the process lives."""
        held, note = self._acquired()
        over = threading.Event()
        renewal = threading.Thread(target=self._renew, args=(held, over), daemon=True)
        renewal.start()
        try:
            yield note
        finally:
            over.set()
            renewal.join()
            if not self._taken_over:
                with contextlib.suppress(*self._failures):  # it runs out by itself
                    if self._own_tag():
                        self._library.delete(self._store, _LOCK)

    def holder(self) -> str:
        """Read the lock, where somebody holds it that is not dead."""
        try:
            lock = self._found_lock()
        except self._failures as error:
            raise self._failed("read", _LOCK, error) from error
        return "" if lock is None or lock.why_dead else lock.holder

    @property
    def _failures(self) -> tuple[type[Exception], ...]:
        return self._library.exceptions.BaseError, OSError

    def _failed(
        self, done: str, name: str, error: Exception, kind: type[StudyError | OutputError] = StudyError
    ) -> StudyError | OutputError:
        """Return the error that says what cannot be done to an object, and why."""
        return kind(f"the object cannot be {done}: {_first_line(error)}", path=f"{self}/{name}")

    def _acquired(self) -> tuple[str, str]:
        """Put the lock: its tag, and a note on the one whose place it took."""
        exceptions = self._library.exceptions
        try:
            with contextlib.suppress(exceptions.AlreadyExistsError):
                return self._put_lock("create"), ""
            found = self._found_lock()
            if found is None:  # given back in this moment
                return self._put_lock("create"), ""
            if not found.why_dead:
                raise StudyError(
                    f"the study is being run by {found.holder}, heard of {found.age:.0f} s ago; if that is dead, the "
                    f"study is free {_LEASE:g} s after it was last heard of",
                    path=str(self),
                )
            return self._put_lock({"e_tag": found.tag}), f"took over from {found.holder}, {found.why_dead}"
        except (exceptions.AlreadyExistsError, exceptions.PreconditionError):
            raise StudyError("the study is being run by somebody who came first", path=str(self)) from None
        except self._failures as error:
            raise self._failed("written", _LOCK, error, OutputError) from error

    def _put_lock(self, condition: Any) -> str:
        # Tags may be hashes of the content, so that it must be new every time.
        about = {"holder": this_process(), "process": os.getpid(), "host": socket.gethostname()}
        self._renewals.add(renewal := uuid.uuid4().hex)
        text = json.dumps(about | {"renewal": renewal})
        return str(self._library.put(self._store, _LOCK, text.encode(), mode=condition)["e_tag"])

    def _renew(self, tag: str, over: threading.Event) -> None:
        """Show every few seconds that the holder lives, as long as the lock is still its own."""
        while not over.wait(_RENEWAL):
            try:
                tag = self._put_lock({"e_tag": tag})
            except self._library.exceptions.PreconditionError:
                with contextlib.suppress(*self._failures):
                    tag = self._own_tag()  # of a renewal that was carried out, but whose answer was lost
                    self._taken_over = not tag
                if self._taken_over:
                    return
            except self._failures:  # the connection may come back before the lock runs out
                continue

    def _own_tag(self) -> str:
        """Tag of the lock, if it is one that this object has put; else empty."""
        try:
            found = self._library.get(self._store, _LOCK)
            about = json.loads(bytes(found.bytes()))
        except (FileNotFoundError, ValueError):
            return ""
        own = isinstance(about, dict) and about.get("renewal") in self._renewals
        return str(found.meta["e_tag"]) if own else ""

    def _found_lock(self) -> _FoundLock | None:
        try:
            found = self._library.get(self._store, _LOCK)
            text = bytes(found.bytes())
        except FileNotFoundError:
            return None
        now = found.meta["last_modified"]
        with contextlib.suppress(*self._failures):  # who may only read has no clock, and takes the holder to live
            self._library.put(self._store, _CLOCK, uuid.uuid4().bytes)
            now = self._library.head(self._store, _CLOCK)["last_modified"]
        try:
            about = dict(json.loads(text))
        except (ValueError, TypeError):
            about = {}
        age = (now - found.meta["last_modified"]).total_seconds()
        is_gone = about.get("host") == socket.gethostname() and not _is_alive(about["process"])
        return _FoundLock(str(about.get("holder", "somebody")), is_gone, age, str(found.meta["e_tag"]))


@dataclass(frozen=True)
class _FoundLock:
    """A lock as it is found: who holds it, whether that process is gone, how old it is (s), and its tag."""

    holder: str
    is_gone: bool
    age: float
    tag: str

    @property
    def why_dead(self) -> str:
        """Why its holder must be dead; empty if it need not be."""
        if self.age > _LEASE:
            return f"which was not heard of for {self.age:.0f} s"
        return "whose process is gone" if self.is_gone else ""


def _is_alive(process: int) -> bool:
    """Whether a process of this host lives; on Windows, where asking is not harmless, it is taken to."""
    if os.name == "nt":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def _first_line(error: Exception) -> str:
    return str(error).partition("\n")[0].strip()
