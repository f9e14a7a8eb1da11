"""A study in an object store (S3 and what speaks like it, Google's, Azure's): the same objects as in a folder."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import threading
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from rocking.errors import InvalidOption, OutputError, StudyError
from rocking.studies.place import this_process

_LOCK: Final = "lock"

#: An object that is written to be told the store's own time.
_CLOCK: Final = "clock"

#: How often a lock is renewed, and how old it is when its holder is taken for dead, s.
_BEAT: Final = 20.0
_LEASE: Final = 120.0


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
            raise InvalidOption("an object store needs obstore: install rocking[objects]") from None
        self._url, self._library, self._taken_over = url, obstore, False
        try:
            self._store = from_url(url)
        except Exception as error:  # its own kinds, and those of the system
            raise InvalidOption(f"{url} is no object store: {_first_line(error)}") from None

    def __str__(self) -> str:
        """Name the place."""
        return self._url

    def put(self, name: str, data: bytes) -> None:
        """Store an object in one request, which is carried out whole or not at all."""
        if self._taken_over:
            raise StudyError(f"the study in {self._url} was taken over by another run while this one was not heard of")
        try:
            self._library.put(self._store, name, data)
        except self._failures as error:
            raise OutputError(f"{self._url}/{name} cannot be written: {_first_line(error)}") from error

    def get(self, name: str) -> bytes | None:
        """Get the object."""
        try:
            return bytes(self._library.get(self._store, name).bytes())
        except FileNotFoundError:
            return None
        except self._failures as error:
            raise StudyError(f"{self._url}/{name} cannot be read: {_first_line(error)}") from error

    def names(self, folder: str) -> Iterator[str]:
        """List the objects whose names begin with that of the folder."""
        try:
            for chunk in self._library.list(self._store, folder or None):
                yield from (one["path"].removeprefix(f"{folder}/") for one in chunk)
        except self._failures as error:
            raise StudyError(f"{self._url}/{folder} cannot be listed: {_first_line(error)}") from error

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
                    self._library.delete(self._store, _LOCK)

    def holder(self) -> str:
        """Read the lock, where somebody holds it that is not dead."""
        lock = self._lock()
        return "" if lock is None or lock.why_dead else lock.holder

    @property
    def _failures(self) -> tuple[type[Exception], ...]:
        return self._library.exceptions.BaseError, OSError

    def _acquired(self) -> tuple[str, str]:
        """Put the lock: its tag, and a note on the one whose place it took."""
        exceptions = self._library.exceptions
        try:
            with contextlib.suppress(exceptions.AlreadyExistsError):
                return self._put_lock("create"), ""
            found = self._lock()
            if found is None:  # given back in this moment
                return self._put_lock("create"), ""
            if not found.why_dead:
                raise StudyError(
                    f"the study in {self._url} is being run by {found.holder}, heard of {found.age:.0f} s ago; if that "
                    f"is dead, the study is free {_LEASE:g} s after it was last heard of"
                )
            return self._put_lock({"e_tag": found.tag}), f"took over from {found.holder}, {found.why_dead}"
        except (exceptions.AlreadyExistsError, exceptions.PreconditionError):
            raise StudyError(f"the study in {self._url} is being run by somebody who came first") from None
        except self._failures as error:
            raise OutputError(f"{self._url}/{_LOCK} cannot be written: {_first_line(error)}") from error

    def _put_lock(self, condition: Any) -> str:
        # Tags may be hashes of the content, so that it must be new every time.
        text = json.dumps({"holder": this_process(), "renewal": uuid.uuid4().hex})
        return str(self._library.put(self._store, _LOCK, text.encode(), mode=condition)["e_tag"])

    def _renew(self, tag: str, over: threading.Event) -> None:
        """Show every few seconds that the holder lives, as long as the lock is still its own."""
        while not over.wait(_BEAT):
            try:
                tag = self._put_lock({"e_tag": tag})
            except self._library.exceptions.PreconditionError:
                self._taken_over = True
                return
            except self._failures:  # the connection may come back before the lock runs out
                continue

    def _lock(self) -> _Lock | None:
        try:
            found = self._library.get(self._store, _LOCK)
            text = bytes(found.bytes())
        except FileNotFoundError:
            return None
        self._library.put(self._store, _CLOCK, uuid.uuid4().bytes)
        now = self._library.head(self._store, _CLOCK)["last_modified"]
        try:
            holder = str(json.loads(text)["holder"])
        except (ValueError, KeyError, TypeError):
            holder = "somebody"
        return _Lock(holder, (now - found.meta["last_modified"]).total_seconds(), str(found.meta["e_tag"]))


@dataclass(frozen=True)
class _Lock:
    """A lock as it is found: by whom it is held, how old it is (s), and its tag."""

    holder: str
    age: float
    tag: str

    @property
    def why_dead(self) -> str:
        """Why its holder must be dead; empty if it need not be."""
        if self.age > _LEASE:
            return f"which was not heard of for {self.age:.0f} s"
        process, _, host = self.holder.removeprefix("process ").partition(" on ")
        if host == socket.gethostname() and process.isdecimal() and not _lives(int(process)):
            return "whose process is gone"
        return ""


def _lives(process: int) -> bool:
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
