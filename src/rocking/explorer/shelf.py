"""Records that were handed to the explorer: files in memory, so many at most, each known by a hash of its content."""

from __future__ import annotations

import hashlib
import io
import threading
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any, Final

from rocking.errors import InvalidMotion, UnreadableRecord
from rocking.motion import formats
from rocking.motion.motion import Motion
from rocking.plausibility import motion_notes

#: Largest file, bytes: twenty times a long record of three channels.
LARGEST: Final = 16 * 2**20

#: Files that are kept; the one that was not used for longest makes room.
MOST: Final = 12

#: Samples of one channel at most: an hour and a half at a hundred a second.
LONGEST: Final = 500_000

#: Letters of a name, and of a hash.
_NAME, _HASH = 80, 24


class _Named(io.BytesIO):
    """Bytes that readers can call by the name of their file."""

    def __init__(self, data: bytes, name: str) -> None:
        super().__init__(data)
        self.name = name


@dataclass(frozen=True)
class Upload:
    """A file: its name without folders, and its content."""

    name: str
    data: bytes


class Shelf:
    """Files and motions by keys; safe to use from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._files: OrderedDict[str, Upload] = OrderedDict()
        self._motions: OrderedDict[tuple[str, ...], Motion] = OrderedDict()
        self._given: dict[str, Motion] = {}

    def put(self, name: str, data: bytes) -> str:
        """Keep a file, and return its key.

        Raises
        ------
        UnreadableRecord
            If it is too large.
        """
        called = bare_name(name)
        if len(data) > LARGEST:
            raise UnreadableRecord(f"{called}: larger than {LARGEST // 2**20} MiB; cut the record into smaller files")
        key = hashlib.sha256(data).hexdigest()[:_HASH]
        with self._lock:
            self._files[key] = Upload(called, data)
            self._files.move_to_end(key)
            while len(self._files) > MOST:
                self._files.popitem(last=False)
        return key

    def give(self, motion: Motion) -> str:
        """Keep a motion of the program's own, and return its key."""
        components = [motion] if motion.vertical is None else [motion, motion.vertical]
        parts = [
            part
            for one in components
            for part in (one.breakpoints.tobytes(), one.coefficients.tobytes(), one.name.encode())
        ]
        key = hashlib.sha256(b"".join(parts)).hexdigest()[:_HASH]
        with self._lock:
            self._given[key] = motion
        return key

    def given(self, key: str) -> Motion:
        """Return a motion of the program's own.

        Raises
        ------
        UnreadableRecord
            If there is none of that key.
        """
        if key not in self._given:
            raise UnreadableRecord("this link names a motion of another program: open the page from there again")
        return self._given[key]

    def file(self, key: str) -> Upload:
        """Return a file that is kept.

        Raises
        ------
        UnreadableRecord
            If there is none of that key.
        """
        with self._lock:
            if key not in self._files:
                raise UnreadableRecord("this record is not here any more: drop its file on the page again")
            self._files.move_to_end(key)
            return self._files[key]

    def read(self, key: str, channel: str | None, dt: float | None, units: str | None) -> Motion:
        """Return the motion of a file; arguments as for `rocking.read`.

        Raises
        ------
        UnreadableRecord, InvalidMotion
            As for `rocking.read`, or if the record is too long.
        """
        upload = self.file(key)
        request = (key, str(channel), str(dt), str(units))
        with self._lock:
            known = self._motions.get(request)
        if known is not None:
            return known
        motion = formats.read(_Named(upload.data, upload.name), channel=channel, dt=dt, units=units)
        if len(motion.coefficients) > LONGEST:
            raise InvalidMotion(f"{upload.name}: {len(motion.coefficients)} samples; at most {LONGEST} are shown here")
        with self._lock:
            self._motions[request] = motion
            while len(self._motions) > MOST:
                self._motions.popitem(last=False)
        return motion

    def contents(self, key: str, dt: float | None = None, units: str | None = None) -> dict[str, Any]:
        """Say what a file is: its format, its channels, and what must still be told before it can be read.

        Raises
        ------
        UnreadableRecord, InvalidMotion
            If it cannot be read, whatever is told.
        """
        upload = self.file(key)
        missing: list[str] = []
        told: dict[str, Any] = {"dt": dt, "units": units}
        for _ in range(2):
            try:
                identification, channels = formats.content(_Named(upload.data, upload.name), **told)
                break
            except (UnreadableRecord, InvalidMotion) as error:
                need = error.argument
                if need is None or need not in _STAND_IN or told[need] is not None:
                    raise
                missing.append(need)
                told[need] = _STAND_IN[need]
        else:
            identification, channels = formats.content(_Named(upload.data, upload.name), **told)
        return {
            "key": key,
            "name": upload.name,
            "format": identification.format,
            "reason": identification.reason,
            "missing": missing,
            "channels": [{"number": each.number, "name": each.name, "notes": _notes(each)} for each in channels],
        }


#: What a file is read with to learn its channels while the truth is not told yet.
_STAND_IN: Final[dict[str, Any]] = {"dt": 0.01, "units": "m/s2"}


def bare_name(name: str) -> str:
    r"""Return a file's name without folders and control characters, not too long.

    Examples
    --------
    >>> bare_name("../../etc/passwd"), bare_name("C:\\data\\RSN6.AT2"), bare_name("\x00")
    ('passwd', 'RSN6.AT2', 'record')
    """
    last = PurePosixPath(PureWindowsPath(name).name).name
    shown = "".join(letter for letter in last if letter.isprintable()).strip()
    return shown[-_NAME:] or "record"


def _notes(channel: Any) -> list[str]:
    return list(motion_notes(channel.motion()))
