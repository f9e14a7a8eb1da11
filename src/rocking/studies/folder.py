"""Folder of a study: inputs and units in atomically written files, and a lock."""

from __future__ import annotations

import contextlib
import functools
import io
import json
import os
import socket
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

import rocking.dynamics.bodies  # noqa: F401 -- registers its kinds
from rocking.block.body import KINDS
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.tables import format_count, write_bytes
from rocking.engine.schemes import chattering_scheme
from rocking.errors import DamagedStudy, OutputError, StudyError
from rocking.motion.description import Description
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.simulation.ensemble import Product, Scales, build_setup
from rocking.studies.units import OUTCOMES, Key, UnitGrid, Work, decoded, name_of, program, sealed, unsealed

if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[bytes], shared: bool) -> None:
        if not shared:  # only exclusive locks exist
            file.seek(0)
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(file: IO[bytes], shared: bool) -> None:
        fcntl.flock(file, fcntl.LOCK_NB | (fcntl.LOCK_SH if shared else fcntl.LOCK_EX))


#: File that describes a study; its number increases when other versions cannot read it.
_INPUTS: Final = "study.npz"
_FORMAT: Final = 4

#: Folder of the units, inside the folder of the study.
_UNITS: Final = "units"


class Store:
    """Outcomes of a product in a folder, in units of a grid; a unit is done if its file exists."""

    def __init__(self, path: str | Path) -> None:
        self.folder = folder_of(path)
        data = read(self.folder / _INPUTS)
        if data is None:
            raise StudyError("there is no study here: create it first", path=str(path))
        archive = unsealed(data)
        if archive is None:
            raise StudyError(
                f"{_INPUTS} is damaged: restore it, or create the study again elsewhere", path=str(self.folder)
            )
        with np.load(io.BytesIO(archive), allow_pickle=False) as arrays:
            self.inputs: dict[str, NDArray[Any]] = dict(arrays)
        about = json.loads(str(self.inputs.pop("about")))
        if about["format"] != _FORMAT:
            raise StudyError(f"the study is of format {about['format']}, this program reads {_FORMAT}", path=str(path))
        self.program: str = about["program"]
        #: Record name of each motion, empty for a pulse; an empty sequence if unknown.
        self.records: tuple[str, ...] = tuple(about["records"])
        self.product = _product(self.inputs)
        self.grid = UnitGrid(self.product.shape, tuple(about["unit"]))
        self._factors = functools.lru_cache(1)(self._factors_of)  # neighbouring units share their motions

    @staticmethod
    def create(path: str | Path, product: Product, unit: Sequence[int], records: Sequence[str]) -> None:
        """Write a new store into an empty folder."""
        buffer, about = io.BytesIO(), {"format": _FORMAT, "program": program(), "unit": unit, "records": records}
        arrays: dict[str, Any] = _arrays(product) | {"about": np.array(json.dumps(about))}
        np.savez_compressed(buffer, **arrays)
        put(folder_of(path) / _INPUTS, sealed(buffer.getvalue()))

    def check_program(self) -> None:
        """Raise a StudyError unless this program computes the same bits as the store."""
        if self.program != program():
            raise StudyError(
                f"the study was made by {self.program}, this is {program()}: run it with that version, or create it "
                "again elsewhere",
                path=str(self.folder),
            )

    def check_inputs(self, product: Product) -> None:
        """Check the inputs against the store; a StudyError names the parts that differ."""
        now, then = _arrays(product), self.inputs
        changed = [
            "/".join(name.split("/")[:2])
            for name in (then | now)
            if name not in then or name not in now or now[name].tobytes() != then[name].tobytes()
        ]
        if changed:
            parts = [*dict.fromkeys(changed)]
            listed = ", ".join(parts[:3]) + (" and more" if len(parts) > 3 else "")
            raise StudyError(
                f"this holds a study of other inputs ({listed} changed), {len(self.done())} of "
                f"{format_count(len(self.grid), 'unit')} done: create this one elsewhere, or remove that one",
                path=str(self.folder),
            )

    def file_of(self, key: Key) -> Path:
        """Return the file of a unit."""
        return self.folder / _UNITS / name_of(key)

    def done(self) -> set[Key]:
        """Return the keys of the units that are done."""
        with contextlib.suppress(FileNotFoundError), os.scandir(self.folder / _UNITS) as entries:
            names = {entry.name for entry in entries}
            return {key for key in self.grid if name_of(key) in names}
        return set()

    def require_complete(self) -> None:
        """Raise a StudyError if units are missing."""
        missing = len(self.grid) - len(self.done())
        if missing:
            raise StudyError(
                f"units are missing, {missing} of {len(self.grid)}: run the study to its end first",
                path=str(self.folder),
            )

    def outcomes(self, key: Key) -> Mapping[str, Floats] | None:
        """Return the outcomes of a full unit by name, or None; raise a StudyError if it is damaged."""
        data = read(self.file_of(key))
        if data is None:
            return None
        values = decoded(data, self.grid.unit)
        if values is None:
            raise DamagedStudy(f"unit {name_of(key)} is damaged")
        return dict(zip(OUTCOMES, values, strict=True))

    def work(self, key: Key) -> Work:
        """Return the complete input of a worker for a unit."""
        motions, scales, polarities, blocks = self.grid.ranges(key)
        factors = self._factors(key[0])[:, scales, polarities]
        return Work(build_setup(self.product, blocks), self.product.motions[motions], factors, self.grid.unit)

    def _factors_of(self, unit: int) -> Floats:
        """Return the factors on the motions of a unit, shape (motions, scales, polarities)."""
        motions = self.product.motions[self.grid.ranges((unit, 0, 0, 0))[0]]
        factors = np.array([self.product.scales.factors(motion) for motion in motions])
        return factors[:, :, None] * np.array(self.product.signs, dtype=np.float64)


def folder_of(path: str | Path) -> Path:
    """Return the folder of a study, which may not exist yet."""
    folder = checks.path(path, "the folder of a study", StudyError)
    if "://" in str(path) or folder.is_file():
        kind = "a file" if folder.is_file() else "a URL"
        raise StudyError(f"this is {kind}, and a study is kept in a folder: name a folder", path=str(path))
    return folder


def exists(path: str | Path) -> bool:
    """Whether a folder contains a study."""
    return (folder_of(path) / _INPUTS).exists()


def require_free(path: str | Path) -> None:
    """Check that a folder is empty except for remains of a creation."""
    folder = folder_of(path)
    others = sorted({each.name for each in folder.glob("[!.]*")} - {"lock"})
    if others:
        listed = ", ".join(others[:3]) + (" and more" if len(others) > 3 else "")
        raise StudyError(f"this holds no study, but {listed}: name a new folder, or an empty one", path=str(folder))


def read(file: Path) -> bytes | None:
    """Read a file; return None if it does not exist."""
    try:
        return file.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise StudyError(f"the file cannot be read: {error.strerror or error}", path=str(file)) from error


def put(file: Path, data: bytes) -> None:
    """Write a file atomically, and flush its name to the disk."""
    with _refused("written", file):
        file.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(file, data)
        if os.name != "nt":  # Windows cannot open folders; their file system keeps a journal of names
            handle = os.open(file.parent, os.O_RDONLY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)


@contextlib.contextmanager
def locked(path: str | Path, *, shared: bool = False) -> Iterator[None]:
    """Lock a folder, exclusively or shared with runs of other parts."""
    folder = folder_of(path)
    with _refused("locked", folder / "lock"):
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / "lock").open("a+b", buffering=0)
    with file:
        with _refused("locked", folder / "lock"):
            try:
                _lock(file, shared)
            except (BlockingIOError, PermissionError):
                # On Windows the locked byte is unreadable, so the name begins at the second byte.
                file.seek(1)
                holder = file.read().decode(errors="replace") or "another process"
                raise StudyError(
                    f"the study is being run by {holder}; wait for it, or end it there and run it again",
                    path=str(folder),
                ) from None
            file.truncate(0)
            file.write(f" process {os.getpid()} on {socket.gethostname()}".encode())
            for left in () if shared else folder.rglob(".*.part*"):  # remains of a killed process
                left.unlink(missing_ok=True)
        yield


@contextlib.contextmanager
def _refused(done: str, file: Path) -> Iterator[None]:
    """Raise an OutputError if the system rejects an operation on a file."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"the file cannot be {done}: {error.strerror or error}", path=str(file)) from error


def _arrays(product: Product) -> dict[str, NDArray[Any]]:
    """Return all inputs as arrays by part and name."""
    bodies, scales = product.bodies, product.scales
    arrays = {f"{bodies.kind}/{name}": values for name, (values, _) in bodies.parameters().items()}
    arrays[f"{bodies.kind}/gravity"] = np.array(bodies.gravity)
    for k, motion in enumerate(product.motions):
        arrays |= _motion_arrays(motion, f"motions/{k}")
    measure = None if scales.measure is None else {"name": scales.measure.name, **scales.measure.options()}
    rules = {
        "scales/measure": measure,
        "rules/polarity": product.polarity,
        "rules/model": product.model,
        "rules/chattering": str(product.chattering),
        "rules/duration": product.duration,
    }
    words = {name: np.array(json.dumps(value)) for name, value in rules.items()}
    return arrays | {"scales/values": scales.values} | words


def _product(arrays: Mapping[str, NDArray[Any]]) -> Product:
    """Return the inputs from their arrays."""
    kind = next((folder for folder in (name.partition("/")[0] for name in arrays) if folder in KINDS), "")
    if not kind:
        raise StudyError("the bodies of this study are of a kind that is not known here: import its module first")
    values = {name.partition("/")[2]: each for name, each in arrays.items() if name.startswith(f"{kind}/")}
    motions = dict.fromkeys(name.split("/")[1] for name in arrays if name.startswith("motions/"))
    words = {name: json.loads(str(each)) for name, each in arrays.items() if each.dtype.kind == "U"}
    measure = words["scales/measure"]
    return Product(
        KINDS[kind](**{**values, "gravity": float(values["gravity"])}),
        tuple(_motion(arrays, f"motions/{k}") for k in motions),
        Scales(None if measure is None else Measure(**measure), arrays["scales/values"]),
        words["rules/polarity"],
        words["rules/model"],
        chattering_scheme(words["rules/chattering"]),
        words["rules/duration"],
    )


def _motion_arrays(motion: Motion, place: str) -> dict[str, NDArray[Any]]:
    description = motion.description
    words = {
        "name": motion.name,
        "family": description.family,
        "parameters": dict(description.parameters),
        "text": description.text,
        "history": motion.history,
        "error": motion.error,
    }
    arrays: dict[str, NDArray[Any]] = {
        f"{place}/breakpoints": motion.breakpoints,
        f"{place}/coefficients": motion.coefficients,
        f"{place}/words": np.array(json.dumps(words)),
    }
    return arrays if motion.vertical is None else arrays | _motion_arrays(motion.vertical, f"{place}/vertical")


def _motion(arrays: Mapping[str, NDArray[Any]], place: str) -> Motion:
    words = json.loads(str(arrays[f"{place}/words"]))
    return Motion(
        arrays[f"{place}/breakpoints"],
        arrays[f"{place}/coefficients"],
        name=words["name"],
        description=Description(words["family"], words["parameters"], words["text"]),
        history=tuple(words["history"]),
        error=words["error"],
        vertical=_motion(arrays, f"{place}/vertical") if f"{place}/vertical/words" in arrays else None,
    )
