"""The folder of a study: files that are written whole or not at all, and the locks of the processes that run it."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import os
import socket
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Final

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import VERSION
from rocking.core.tables import counted, write_bytes
from rocking.errors import DamagedStudy, OutputError, StudyError
from rocking.kernels.compiled import fingerprint
from rocking.simulation.ensemble import Product, setup_of
from rocking.studies import product as inputs
from rocking.studies.product import outcomes_text
from rocking.studies.units import DamagedUnit, Key, UnitGrid, Work, decoded, name_of

if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[bytes]) -> None:
        file.seek(0)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(file: IO[bytes]) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


#: How often a lock is tried, and how long after one another, s: whoever reads its holder has it for a moment.
_TRIES: Final = 3


class Folder:
    """Files of a study, made where there is no folder yet."""

    def __init__(self, path: str | Path) -> None:
        self.path = checks.path(path, "the folder of a study", StudyError)
        if "://" in str(path):
            raise StudyError("this is a URL, and a study is kept in a folder: name a folder", path=str(path))
        if self.path.is_file():
            raise StudyError("this is a file, and a study is kept in a folder: name that", path=str(path))

    def __str__(self) -> str:
        return str(self.path)

    def put(self, name: str, data: bytes) -> None:
        """Write a file, whole or not at all, and its name to the disk."""
        target = self.path / name
        with _refused("written", target):
            target.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(target, data)
            if os.name != "nt":  # folders cannot be opened there; its file system keeps a journal of names
                handle = os.open(target.parent, os.O_RDONLY)
                try:
                    os.fsync(handle)
                finally:
                    os.close(handle)

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
        """Hold a lock, a file that names its holder, while the process lives; that of a part excludes it and "lock"."""
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
                    for left in self.path.rglob(".*.part*"):  # half-written, when a process was killed
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
def _refused(done: str, target: Path) -> Iterator[None]:
    """Raise an OutputError where the system refuses to do something to a file."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"the file cannot be {done}: {error.strerror or error}", path=str(target)) from error


def _acquired(file: IO[bytes], tries: int) -> bool:
    """Lock a file until it is closed, and return whether that succeeded."""
    for left in reversed(range(tries)):
        try:
            _lock(file)
        except (BlockingIOError, PermissionError):
            time.sleep(0.02 if left else 0.0)
        else:
            return True
    return False


def _holder(file: IO[bytes]) -> str:
    file.seek(1)
    return file.read().decode(errors="replace").strip()


_ARRAY: Final = "result"


class Store:
    """Outcomes of a product, in units of a grid that are done when their files exist; `about` is from `study.json`."""

    def __init__(self, folder: Folder, about: dict[str, Any], product: Product) -> None:
        self.folder, self.about, self.product = folder, about, product
        self.grid = UnitGrid(product.shape, tuple(about["unit"]), tuple(about["outcomes"]))
        self._factors = functools.lru_cache(1)(self._factors_of)  # neighbouring units share their motions

    @classmethod
    def create(cls, folder: Folder, product: Product, unit: tuple[int, ...], outcomes: tuple[str, ...]) -> Store:
        """Write an empty store where nothing else is; `study.json` last, so that half a store is none."""
        require_free(folder)
        archive = inputs.to_bytes(product)
        about: dict[str, Any] = {
            "format": 3,
            "version": VERSION,
            "kernels": fingerprint(),
            "unit": list(unit),
            "shape": list(product.shape),
            "inputs": hashlib.sha256(archive).hexdigest(),
            "parts": inputs.hashes(product),
            "outcomes": list(outcomes),
        }
        made = cls(folder, about, product)
        for name, data in {"inputs.npz": archive, **made.metadata, "study.json": sealed(about)}.items():
            folder.put(name, data)
        return made

    @classmethod
    def open(cls, folder: Folder) -> Store:
        """Open a store; a StudyError if there is none, it is damaged, or of another format."""
        about = kept(folder, "study.json", "restore it, or create the study again elsewhere")
        if about is None:
            raise StudyError("there is no study here: create it first", path=str(folder))
        if about["format"] != 3:
            raise StudyError(
                f"the study is of format {about['format']}, this program reads 3: use its version", path=str(folder)
            )
        archive = folder.get("inputs.npz")
        if archive is None or hashlib.sha256(archive).hexdigest() != about["inputs"]:
            raise StudyError(
                "inputs.npz is missing or damaged; restore it, or create the study again elsewhere", path=str(folder)
            )
        return cls(folder, about, inputs.from_bytes(archive))

    @property
    def metadata(self) -> dict[str, bytes]:
        """Files by which any reader of Zarr knows the array, and the group that it is in."""
        group = json.dumps({"zarr_format": 3, "node_type": "group", "attributes": {}}, indent=2).encode()
        return {"zarr.json": group, f"{_ARRAY}/zarr.json": self.grid.metadata()}

    def check_program(self) -> None:
        """Check that this program computes what the store holds, to the last bit; a StudyError if not."""
        version, kernels = self.about["version"], self.about["kernels"]
        if (version, kernels) != (VERSION, fingerprint()):
            raise StudyError(
                f"the study was made by rocking {version} (kernels {kernels}), this is {VERSION} "
                f"(kernels {fingerprint()}): run it with that version, or create it again elsewhere",
                path=str(self.folder),
            )

    def check_inputs(self, product: Product, outcomes: tuple[str, ...]) -> None:
        """Check that these are the inputs and outcomes of the store; a StudyError says in which parts they differ."""
        changed = inputs.changes(inputs.hashes(product), self.about["parts"], product.motions)
        if outcomes != self.grid.outcomes:
            changed.append(f"the outcomes ({outcomes_text(self.grid.outcomes)} then; {outcomes_text(outcomes)} now)")
        if changed:
            raise StudyError(
                f"this holds a study of other inputs ({', '.join(changed)} changed), {len(self.done())} of "
                f"{counted(len(self.grid), 'unit')} done: create this one elsewhere, or remove that one",
                path=str(self.folder),
            )

    def name_records(self, records: Sequence[str]) -> None:
        """Keep the name of the record of each motion, in place of those that were; no number depends on them."""
        self.folder.keep("records.json", sealed({"records": list(records)}))

    def records(self) -> tuple[str, ...]:
        """Name of the record of each motion, empty of a pulse; none at all where they are not known."""
        correction, count = "create the study again from its file, in its place", len(self.product.motions)
        about = kept(self.folder, "records.json", correction, lambda about: len(about["records"]) == count)
        return () if about is None else tuple(about["records"])

    def done(self) -> set[Key]:
        """Keys of the units that are done."""
        names = set(self.folder.names(_ARRAY))
        return {key for key in self.grid if name_of(key) in names}

    def require_complete(self) -> None:
        """Raise a StudyError if units are missing."""
        missing = len(self.grid) - len(self.done())
        if missing:
            raise StudyError(
                f"units are missing, {missing} of {len(self.grid)}: run the study to its end first",
                path=str(self.folder),
            )

    def put(self, key: Key, data: bytes) -> None:
        """Store a unit."""
        self.folder.put(f"{_ARRAY}/{name_of(key)}", data)

    def raw(self, key: Key) -> bytes | None:
        """Return the bytes of a unit; None where it is not done."""
        return self.folder.get(f"{_ARRAY}/{name_of(key)}")

    def outcomes(self, key: Key) -> Mapping[str, Floats] | None:
        """Outcomes of a unit by name, of its counts each; None where it is not done, a StudyError if it is damaged."""
        data = self.raw(key)
        if data is None:
            return None
        try:
            return decoded(data, self.grid.outcomes, self.grid.counts(key), self.grid.unit)
        except DamagedUnit as error:
            raise DamagedStudy(f"unit {name_of(key)} is damaged, {error}") from None

    def present(self, key: Key) -> Mapping[str, Floats]:
        """Outcomes of a unit that was done; a StudyError if it is gone or damaged."""
        outcomes = self.outcomes(key)
        if outcomes is None:
            raise StudyError(f"unit {name_of(key)} is gone: run the study again", path=str(self.folder))
        return outcomes

    def work(self, key: Key) -> Work:
        """Return all that a worker needs for a unit."""
        motions, scales, polarities, blocks = self.grid.ranges(key)
        setup, factors = setup_of(self.product, blocks), self._factors(key[0])[:, scales, polarities]
        return Work(setup, self.product.motions[motions], factors, self.grid.unit, self.grid.outcomes)

    def _factors_of(self, unit: int) -> Floats:
        """Factors on the motions of a unit, shape (motions, scales, polarities)."""
        motions = self.product.motions[self.grid.ranges((unit, 0, 0, 0))[0]]
        factors = np.array([self.product.scales.factors(motion) for motion in motions])
        return factors[:, :, None] * np.array(self.product.signs, dtype=np.float64)


def exists(folder: Folder) -> bool:
    """Whether there is a study in a folder."""
    return folder.get("study.json") is not None


def require_free(folder: Folder) -> None:
    """Check that there is nothing in a folder that is no study's."""
    others = {*folder.names()} - {_ARRAY, "inputs.npz", "zarr.json", "lock", "runs.jsonl"}  # a creation was cut off
    if others:
        listed = ", ".join(sorted(others)[:3]) + (" and more" if len(others) > 3 else "")
        raise StudyError(f"this holds no study, but {listed}: name a new folder, or an empty one", path=str(folder))
    # A creation that was cut off has computed nothing: units of a study whose description is gone may be of another.
    if any(name.startswith("c.") for name in folder.names(_ARRAY)):
        raise StudyError(
            "this holds results of a study whose study.json is gone: restore that, or name a new folder",
            path=str(folder),
        )


def kept(
    folder: Folder, name: str, correction: str, holds: Callable[[dict[str, Any]], bool] = lambda about: True
) -> dict[str, Any] | None:
    """Return the content of a sealed file; None where there is none, a StudyError if it is damaged."""
    data = folder.get(name)
    if data is None:
        return None
    with contextlib.suppress(ValueError, KeyError, AttributeError, TypeError):
        about: dict[str, Any] = json.loads(data)
        del about["seal"]
        if sealed(about) == data and holds(about):
            return about
    raise StudyError(f"{name} is damaged: {correction}", path=str(folder))


def sealed(about: dict[str, Any]) -> bytes:
    """Return a description with its own hash."""
    seal = hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()
    return json.dumps(about | {"seal": seal}, indent=2).encode()
