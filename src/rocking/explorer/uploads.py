"""Uploaded records and meshes: files in limited memory, identified by a hash of their content."""

from __future__ import annotations

import hashlib
import io
import itertools
import threading
from functools import lru_cache
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any, Final, NamedTuple

from rocking.core import checks
from rocking.errors import BlockError, MotionError, RecordError
from rocking.explorer.meshes import MeshBody, read_body
from rocking.explorer.parameters import MESH_KINDS, PARAMETERS
from rocking.motion.motion import Motion
from rocking.records import formats
from rocking.records.formats.channel import Channel
from rocking.records.formats.source import Request
from rocking.records.units import UNIT_NAMES, find_unit
from rocking.solid.mesh import SHIPPED_MESHES

#: Largest file, bytes: twenty times a long record of three channels.
MAX_FILE_SIZE: Final = 16 * 2**20
SIZE_ADVICE: Final = f"a file may have {MAX_FILE_SIZE // 2**20} MiB: cut a record into smaller files, or coarsen a mesh"

#: Maximum number of files, forty stations of three components, and their bytes. Further records are rejected, so that
#: none disappears unnoticed.
MAX_FILES: Final = 120
MAX_BYTES: Final = 256 * 2**20

#: Maximum numbers of cached motions, of 60 MB at most, and bodies of meshes.
_MAX_MOTIONS, _MAX_BODIES = 8, 12

#: Maximum number of samples in a channel: 1.5 hours at 100 Hz. A motion takes some 120 bytes per sample.
MAX_SAMPLES: Final = 500_000

#: Maximum number of lines in a file (two such channels with a line per sample), and of possibly compressed samples.
_MAX_LINES, _MAX_FILE_SAMPLES = 2 * MAX_SAMPLES, 8 * MAX_SAMPLES

#: Lengths of a name and of a key.
_NAME_LENGTH, _KEY_LENGTH = 80, 24

#: Substitutes for missing metadata while the channels of a file are described.
_PLACEHOLDERS: Final[dict[str, Any]] = {"dt": 1.0, "units": "m/s2"}


class Upload(NamedTuple):
    """File name without folders, and content of a file."""

    name: str
    data: bytes

    def open(self) -> io.BytesIO:
        """Return the content as a stream with the name of the file, for readers."""
        stream = io.BytesIO(self.data)
        stream.name = self.name
        return stream


class UploadStore:
    """Thread-safe store of files and motions by keys."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._files: dict[str, Upload] = {}
        self._motions: dict[str, Motion] = {}
        self.read = lru_cache(_MAX_MOTIONS)(self._read)
        self.describe_file = lru_cache(4 * MAX_FILES)(self._describe_file)
        self.read_body = lru_cache(_MAX_BODIES)(self._read_body)

    def add_file(self, name: str, data: bytes) -> str:
        """Store a record or a mesh, and return its key."""
        upload = Upload(clean_file_name(name), data)
        lines = max(data.count(b"\n"), data.count(b"\r"))
        if lines > _MAX_LINES and b"\0" not in data and not is_mesh(upload.name):
            message = f"{lines} lines, of which at most {_MAX_LINES} are read here; cut the record into smaller files"
            raise RecordError(message, path=upload.name)
        if len(data) > MAX_FILE_SIZE:
            raise RecordError(SIZE_ADVICE, path=upload.name)
        key = hashlib.sha256(upload.name.encode() + b"\0" + data).hexdigest()[:_KEY_LENGTH]
        with self._lock:
            other_files = [file for name, file in self._files.items() if name != key]
            if len(other_files) >= MAX_FILES or sum(len(file.data) for file in other_files) + len(data) > MAX_BYTES:
                limits = f"{MAX_FILES} files and {MAX_BYTES // 2**20} MiB are kept at most"
                raise RecordError(f"it cannot be kept: {limits}; remove records from the list first", path=upload.name)
            self._files[key] = upload
        return key

    def remove(self, key: str) -> None:
        """Remove a file and its results."""
        self.get_file(key)
        with self._lock:
            self._files.pop(key, None)
        for cached in (self.read, self.describe_file, self.read_body):
            cached.cache_clear()

    def list_records(self) -> tuple[str, ...]:
        """Return the keys of the stored records, in order of upload."""
        with self._lock:
            return tuple(key for key, upload in self._files.items() if not is_mesh(upload.name))

    def count_usage(self) -> dict[str, int]:
        """Return number and bytes of the stored files, and their limits."""
        with self._lock:
            byte_count = sum(len(upload.data) for upload in self._files.values())
            return {"files": len(self._files), "bytes": byte_count, "most_files": MAX_FILES, "most_bytes": MAX_BYTES}

    def add_motion(self, motion: Motion) -> str:
        """Store a motion of the program, and return its key."""
        parts = [part for part in (motion, motion.vertical) if part is not None]
        contents = ((part.breakpoints.tobytes(), part.coefficients.tobytes(), part.name.encode()) for part in parts)
        key = hashlib.sha256(b"".join(itertools.chain(*contents))).hexdigest()[:_KEY_LENGTH]
        with self._lock:
            self._motions[key] = motion
        return key

    def get_motion(self, key: str) -> Motion:
        """Return a motion of the program."""
        if key not in self._motions:
            raise RecordError("{} is a motion of a study that is not open: choose a point of its map again", "motion")
        return self._motions[key]

    def get_file(self, key: str, argument: str = "motion") -> Upload:
        """Return a stored file, which an argument names."""
        with self._lock:
            if key not in self._files:
                raise RecordError("the file of {} is not here any more: open it again", argument)
            return self._files[key]

    def _read(self, key: str, **options: Any) -> Motion:
        """Return the motion of a file, with the arguments of `rocking.read`."""
        corrections = options.pop("baseline", None), options.pop("highpass", None)
        upload = self.get_file(key)
        return _read_channel(upload, formats.read_channel(upload.open(), _create_request(**options)), *corrections)

    def _read_body(self, name: str, **texts: str) -> MeshBody:
        """Return the body of a mesh, ``statue`` or ``file:KEY``, read with texts named as in `MESH_OPTIONS`."""
        stream = self.get_file(name.removeprefix("file:"), "mesh").open() if name.startswith("file:") else None
        if stream is None:
            checks.choice(name, "mesh", BlockError, [*SHIPPED_MESHES])
        return read_body(name, stream, {option: PARAMETERS[option].read(text) for option, text in texts.items()})

    def _describe_file(self, key: str, **options: Any) -> dict[str, Any]:
        """Describe a file, read with arguments of `rocking.read`: channels, and arguments that reading requires."""
        upload, missing = self.get_file(key), list[str]()
        corrections = options.pop("baseline", None), options.pop("highpass", None)
        while True:
            try:
                _, channels = formats.read_content(upload.open(), _create_request(**options))
                break
            except (RecordError, MotionError) as error:
                name = error.argument
                if name not in _PLACEHOLDERS or name in options:
                    raise
                missing.append(name)
                options[name] = _PLACEHOLDERS[name]
        described = [
            _describe_channel(channel, _read_channel(upload, channel, *corrections), is_complete=not missing)
            for channel in channels
        ]
        return {"key": key, "name": upload.name, "missing": missing, "channels": described}


def _describe_channel(channel: Channel, motion: Motion, *, is_complete: bool) -> dict[str, Any]:
    """Return metadata of a channel, and its measures or raw ones, as if missing metadata were `_PLACEHOLDERS`."""
    metadata = {name: getattr(channel, name) for name in ("number", "name", "station", "event", "azimuth")}
    raw = {"pga": motion.pga, "duration": motion.duration}
    measures = compute_measures(motion) if is_complete else None
    return metadata | {"samples": len(channel.acceleration), "step": channel.dt, "raw": raw, "measures": measures}


def _create_request(dt: float | None = None, units: str | None = None, channel: str | None = None) -> Request:
    return Request.create(dt, units, channel=channel, max_samples=_MAX_FILE_SAMPLES)


def _read_channel(upload: Upload, channel: Channel, *corrections: Any) -> Motion:
    """Return a channel as a motion; reject motions longer than the limit of the page."""
    samples = len(channel.acceleration)
    if samples > MAX_SAMPLES:
        raise MotionError(f"{samples} samples; at most {MAX_SAMPLES} are shown here", path=upload.name)
    return channel.motion(*corrections)


def list_units() -> dict[str, float]:
    """Return the sizes of units of accelerations by name, m/s^2, each unit once."""
    units = {unit: name for name in reversed(UNIT_NAMES) if (unit := find_unit(name)) is not None}
    return {name: unit.multiplier / unit.divisor for unit, name in reversed(units.items())}


def compute_measures(motion: Motion) -> dict[str, float]:
    """Return the listed measures of a record: PGA (m/s^2), PGV (m/s), 5-95 % duration and total duration (s)."""
    return {
        "pga": motion.pga,
        "pgv": motion.pgv,
        "significant": motion.significant_duration(0.05, 0.95),
        "duration": motion.duration,
    }


def is_mesh(name: str) -> bool:
    """Whether a file is a mesh by its name."""
    return PurePosixPath(name).suffix.lower().removeprefix(".") in MESH_KINDS


def clean_file_name(name: str) -> str:
    r"""Return a file's name without folders and control characters, truncated.

    Examples
    --------
    >>> clean_file_name("../../etc/passwd"), clean_file_name("C:\\data\\RSN6.AT2"), clean_file_name("\x00")
    ('passwd', 'RSN6.AT2', 'record')
    """
    file_name = PurePosixPath(PureWindowsPath(name).name).name
    printable = "".join(character for character in file_name if character.isprintable()).strip()
    return printable[-_NAME_LENGTH:] or "record"
