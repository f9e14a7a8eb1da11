"""Uploaded records and meshes: files in limited memory, identified by a hash of their content."""

from __future__ import annotations

import hashlib
import io
import itertools
import json
import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any, Final, Generic, NamedTuple, TypeVar

from rocking.core import checks
from rocking.errors import BlockError, MotionError, RecordError
from rocking.explorer.meshes import MeshBody, read_body, read_options
from rocking.explorer.parameters import MESH_KINDS
from rocking.motion.motion import Motion
from rocking.records import formats
from rocking.records.formats.channel import Channel
from rocking.records.formats.source import Request
from rocking.records.units import UNIT_NAMES, find_unit
from rocking.solid.mesh import SHIPPED_MESHES

V = TypeVar("V")

#: Largest file, bytes: twenty times a long record of three channels.
MAX_FILE_SIZE: Final = 16 * 2**20
_LIMIT: Final = f"{MAX_FILE_SIZE // 2**20} MiB"
TOO_LARGE: Final = f"a file may be {_LIMIT} large: cut a record into smaller files, or make a mesh coarser"

#: Maximum number of files, forty stations of three components, and their bytes. Further records are rejected, so that
#: none disappears unnoticed.
MAX_FILES: Final = 120
MAX_BYTES: Final = 256 * 2**20

#: Maximum number of cached bodies of meshes.
_MAX_BODIES: Final = 12

#: Maximum number of samples in a channel: 1.5 hours at 100 Hz. A motion takes some 120 bytes per sample.
MAX_SAMPLES: Final = 500_000

#: Maximum number of samples of cached motions, of 120 bytes each; the least recently used are removed first.
MAX_CACHED_SAMPLES: Final = 3_000_000

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

    def stream(self) -> io.BytesIO:
        """Return the content as a stream with the name of the file, for readers."""
        stream = io.BytesIO(self.data)
        stream.name = self.name
        return stream


class RecentCache(Generic[V]):
    """Thread-safe least-recently-used cache with limited total weight."""

    def __init__(self, max_weight: float, weight: Callable[[V], float] = lambda _: 1.0) -> None:
        self._max_weight, self._weight = max_weight, weight
        self._lock = threading.Lock()
        self._values: OrderedDict[tuple[str, ...], V] = OrderedDict()

    def get(self, key: tuple[str, ...], create: Callable[[], V]) -> V:
        """Return the value of a key, created unless it is cached."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
                return self._values[key]
        value = create()
        with self._lock:
            self._values[key] = value
            while len(self._values) > 1 and sum(map(self._weight, self._values.values())) > self._max_weight:
                self._values.popitem(last=False)
        return value

    def remove(self, name: str) -> None:
        """Remove all values whose keys contain a name."""
        with self._lock:
            for key in [key for key in self._values if any(name in part for part in key)]:
                del self._values[key]


class UploadStore:
    """Thread-safe store of files and motions by keys."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._files: dict[str, Upload] = {}
        self._motions: dict[str, Motion] = {}
        self._record_motions = RecentCache[Motion](MAX_CACHED_SAMPLES, lambda motion: len(motion.breakpoints))
        self._descriptions = RecentCache[dict[str, Any]](4 * MAX_FILES)
        self._bodies = RecentCache[MeshBody](_MAX_BODIES)

    def add_file(self, name: str, data: bytes) -> str:
        """Store a record or a mesh, and return its key."""
        upload = Upload(clean_file_name(name), data)
        lines = max(data.count(b"\n"), data.count(b"\r"))
        if lines > _MAX_LINES and b"\0" not in data and not is_mesh(upload.name):
            message = f"{lines} lines, of which at most {_MAX_LINES} are read here; cut the record into smaller files"
            raise RecordError(message, path=upload.name)
        if len(data) > MAX_FILE_SIZE:
            raise RecordError(TOO_LARGE, path=upload.name)
        key = hashlib.sha256(upload.name.encode() + b"\0" + data).hexdigest()[:_KEY_LENGTH]
        with self._lock:
            others = [file for name, file in self._files.items() if name != key]
            if len(others) >= MAX_FILES or sum(len(file.data) for file in others) + len(data) > MAX_BYTES:
                limits = f"{MAX_FILES} files and {MAX_BYTES // 2**20} MiB are kept at most"
                raise RecordError(f"it cannot be kept: {limits}; remove records from the list first", path=upload.name)
            self._files[key] = upload
        return key

    def remove(self, key: str) -> None:
        """Remove a file and its results."""
        self.file(key)
        with self._lock:
            self._files.pop(key, None)
        for cache in (self._record_motions, self._descriptions, self._bodies):
            cache.remove(key)

    def list_records(self) -> tuple[str, ...]:
        """Return the keys of the stored records, in order of upload."""
        with self._lock:
            return tuple(key for key, upload in self._files.items() if not is_mesh(upload.name))

    def usage(self) -> dict[str, int]:
        """Return number and bytes of the stored files, and their limits."""
        with self._lock:
            total = sum(len(upload.data) for upload in self._files.values())
            return {"files": len(self._files), "bytes": total, "most_files": MAX_FILES, "most_bytes": MAX_BYTES}

    def add_motion(self, motion: Motion) -> str:
        """Store a motion of the program, and return its key."""
        parts = [part for part in (motion, motion.vertical) if part is not None]
        contents = ((part.breakpoints.tobytes(), part.coefficients.tobytes(), part.name.encode()) for part in parts)
        key = hashlib.sha256(b"".join(itertools.chain(*contents))).hexdigest()[:_KEY_LENGTH]
        with self._lock:
            self._motions[key] = motion
        return key

    def motion(self, key: str) -> Motion:
        """Return a motion of the program."""
        if key not in self._motions:
            raise RecordError("{} is a motion of a study that is not open: choose a point of its map again", "motion")
        return self._motions[key]

    def file(self, key: str, argument: str = "motion") -> Upload:
        """Return a stored file, which an argument names."""
        with self._lock:
            if key not in self._files:
                raise RecordError("the file of {} is not here any more: open it again", argument)
            return self._files[key]

    def read(self, key: str, **options: Any) -> Motion:
        """Return the motion of a file, with the arguments of `rocking.read`."""
        upload = self.file(key)
        corrections = options.get("baseline"), options.get("highpass")
        request = _create_request(*(options.get(name) for name in ("dt", "units", "channel")))
        return self._record_motions.get(
            (key, json.dumps(options)),
            lambda: _read_channel(upload, formats.read_channel(upload.stream(), request), *corrections),
        )

    def body(self, name: str, texts: Mapping[str, str], tolerance: float | None, gravity: float | None) -> MeshBody:
        """Return the body of a mesh, ``statue`` or ``file:KEY``, read with the texts of a case."""
        upload = self.file(name.removeprefix("file:"), "mesh") if name.startswith("file:") else None
        if upload is None:
            checks.choice(name, "mesh", BlockError, [*SHIPPED_MESHES])
        options = read_options(texts, tolerance, gravity)
        key = name, upload.name if upload else "", json.dumps(options)
        return self._bodies.get(key, lambda: read_body(name, upload and upload.stream(), options))

    def describe_file(self, key: str, **options: Any) -> dict[str, Any]:
        """Describe a file, read with arguments of `rocking.read`: channels, and arguments that reading requires."""
        upload = self.file(key)
        return self._descriptions.get((key, json.dumps(options)), lambda: self._describe_file(key, upload, options))

    def _describe_file(self, key: str, upload: Upload, options: dict[str, Any]) -> dict[str, Any]:
        options, missing = dict(options), list[str]()
        corrections = options.pop("baseline", None), options.pop("highpass", None)
        while True:
            try:
                _, channels = formats.read_content(upload.stream(), _create_request(**options))
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
    printable = "".join(letter for letter in file_name if letter.isprintable()).strip()
    return printable[-_NAME_LENGTH:] or "record"
