"""Folder of a study: inputs and batches in atomically written files, and a lock."""

from __future__ import annotations

import contextlib
import functools
import io
import json
import os
import socket
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

import rocking.dynamics.bodies  # noqa: F401 -- registers its kinds
from rocking.block import Blocks
from rocking.block.body import BODIES_TYPES
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.tables import format_count, write_bytes
from rocking.engine.schemes import chattering_scheme
from rocking.errors import DamagedStudyError, OutputError, StudyError
from rocking.motion.description import Description
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.simulation.ensemble import ScalingLevels, SimulationProduct, create_setup
from rocking.studies.batches import (
    OUTCOMES,
    BatchGrid,
    BatchInput,
    Key,
    decode,
    format_key,
    identify_program,
    seal,
    unseal,
)

if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[bytes], is_shared: bool) -> None:
        if not is_shared:  # only exclusive locks exist
            file.seek(0)
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(file: IO[bytes], is_shared: bool) -> None:
        fcntl.flock(file, fcntl.LOCK_NB | (fcntl.LOCK_SH if is_shared else fcntl.LOCK_EX))


#: File that describes a study; its number increases when other versions cannot read it.
_INPUT_FILE: Final = "study.npz"
_FORMAT_VERSION: Final = 4

#: Folder of the batches, inside the folder of the study.
_BATCH_FOLDER: Final = "batches"


class Store:
    """Outcomes of a product in a folder, in batches of a grid; a batch is done if its file exists."""

    def __init__(self, path: str | Path) -> None:
        self.folder = check_folder(path)
        data = read_bytes(self.folder / _INPUT_FILE)
        if data is None:
            raise StudyError("the folder contains no study: create it first", path=str(path))
        archive = unseal(data)
        if archive is None:
            message = f"{_INPUT_FILE} is damaged: restore it, or create the study again elsewhere"
            raise StudyError(message, path=str(self.folder))
        with np.load(io.BytesIO(archive), allow_pickle=False) as arrays:
            self.inputs: dict[str, NDArray[Any]] = dict(arrays)
        header = json.loads(str(self.inputs.pop("about")))
        if header["format"] != _FORMAT_VERSION:
            message = f"the study has format {header['format']}; this program reads {_FORMAT_VERSION}"
            raise StudyError(message, path=str(path))
        self.program: str = header["program"]
        #: Record name of each motion, empty for a pulse; an empty sequence if unknown.
        self.records: tuple[str, ...] = tuple(header["records"])
        self.product = _product_from_arrays(self.inputs)
        self.grid = BatchGrid(self.product.shape, tuple(header["batch_shape"]))
        self._factors = functools.lru_cache(1)(self._compute_factors)  # neighbouring batches share their motions

    @staticmethod
    def create(
        path: str | Path, product: SimulationProduct, batch_shape: Sequence[int], records: Sequence[str]
    ) -> None:
        """Write a new store into an empty folder."""
        header = {
            "format": _FORMAT_VERSION,
            "program": identify_program(),
            "batch_shape": batch_shape,
            "records": records,
        }
        arrays: dict[str, Any] = _product_to_arrays(product) | {"about": np.array(json.dumps(header))}
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **arrays)
        write_atomically(check_folder(path) / _INPUT_FILE, seal(buffer.getvalue()))

    def check_program(self) -> None:
        """Raise a StudyError unless this program computes the same bits as the store."""
        if self.program != identify_program():
            remedy = "run it with that version, or create it again elsewhere"
            message = f"the study was created by {self.program}, this is {identify_program()}: {remedy}"
            raise StudyError(message, path=str(self.folder))

    def check_inputs(self, product: SimulationProduct) -> None:
        """Check the inputs against the store; a StudyError names the parts that differ."""
        inputs = self.inputs, _product_to_arrays(product)
        stored, new = ({name: array.tobytes() for name, array in arrays.items()} for arrays in inputs)
        changed = [name for name in stored | new if stored.get(name) != new.get(name)]
        if changed:
            parts = dict.fromkeys("/".join(name.split("/")[:2]) for name in changed)
            progress = f"{len(self.find_done())} of {format_count(len(self.grid), 'batch')} done"
            message = f"the folder contains a study of other inputs ({_format_some(parts)} changed), {progress}"
            message += ": create this study elsewhere, or remove the other one"
            raise StudyError(message, path=str(self.folder))

    def batch_path(self, key: Key) -> Path:
        """Return the file of a batch."""
        return self.folder / _BATCH_FOLDER / format_key(key)

    def find_done(self) -> set[Key]:
        """Return the keys of the batches that are done."""
        with contextlib.suppress(FileNotFoundError), os.scandir(self.folder / _BATCH_FOLDER) as entries:
            names = {entry.name for entry in entries}
            return {key for key in self.grid if format_key(key) in names}
        return set()

    def require_complete(self) -> None:
        """Raise a StudyError if batches are missing."""
        missing = len(self.grid) - len(self.find_done())
        if missing:
            message = f"{missing} of {len(self.grid)} batches are missing; complete the study first"
            raise StudyError(message, path=str(self.folder))

    def read_outcomes(self, key: Key) -> Mapping[str, Floats] | None:
        """Return the outcomes of a full batch by name, or None; raise a StudyError if it is damaged."""
        data = read_bytes(self.batch_path(key))
        if data is None:
            return None
        values = decode(data, self.grid.batch_shape)
        if values is None:
            raise DamagedStudyError(f"batch {format_key(key)} is damaged")
        return dict(zip(OUTCOMES, values, strict=True))

    def create_input(self, key: Key) -> BatchInput:
        """Create the complete input of a worker for a batch."""
        motions, scales, polarities, blocks = self.grid.ranges(key)
        factors = self._factors(key[0])[:, scales, polarities]
        return BatchInput(
            create_setup(self.product, blocks), self.product.motions[motions], factors, self.grid.batch_shape
        )

    def _compute_factors(self, batch: int) -> Floats:
        """Return the factors on the motions of a batch, shape (motions, scales, polarities)."""
        motions = self.product.motions[self.grid.ranges((batch, 0, 0, 0))[0]]
        factors = np.array([self.product.scales.factors(motion) for motion in motions])
        return factors[:, :, None] * np.array(self.product.signs, dtype=np.float64)


def check_folder(path: str | Path) -> Path:
    """Check the path of a study's folder, which may not exist yet."""
    folder = checks.path(path, "the folder of a study", StudyError)
    if "://" in str(path) or folder.is_file():
        kind = "a file" if folder.is_file() else "a URL"
        raise StudyError(f"a study is stored in a folder, but this is {kind}: choose a folder", path=str(path))
    return folder


def contains_study(path: str | Path) -> bool:
    """Return whether a folder contains a study."""
    return (check_folder(path) / _INPUT_FILE).exists()


def require_empty(path: str | Path) -> None:
    """Check that a folder is empty except for remains of a creation."""
    folder = check_folder(path)
    names = sorted({entry.name for entry in folder.glob("[!.]*")} - {"lock"})
    if names:
        message = f"the folder contains no study, but {_format_some(names)}: choose a new or empty folder"
        raise StudyError(message, path=str(folder))


def _format_some(names: Collection[str]) -> str:
    return ", ".join([*names][:3]) + (" and more" if len(names) > 3 else "")


def read_bytes(file: Path) -> bytes | None:
    """Read a file; return None if it does not exist."""
    try:
        return file.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise StudyError(f"the file cannot be read: {error.strerror or error}", path=str(file)) from error


def write_atomically(file: Path, data: bytes) -> None:
    """Write a file atomically, and flush its name to the disk."""
    with _convert_errors("written", file):
        file.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(file, data)
        if os.name != "nt":  # Windows cannot open folders; their file system keeps a journal of names
            handle = os.open(file.parent, os.O_RDONLY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)


@contextlib.contextmanager
def lock_folder(path: str | Path, *, is_shared: bool = False) -> Iterator[None]:
    """Lock a folder, exclusively or shared with runs of other parts."""
    folder = check_folder(path)
    with _convert_errors("locked", folder / "lock"):
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / "lock").open("a+b", buffering=0)
    with file:
        with _convert_errors("locked", folder / "lock"):
            try:
                _lock(file, is_shared)
            except (BlockingIOError, PermissionError):
                # On Windows the locked byte is unreadable, so the name begins at the second byte.
                file.seek(1)
                holder = file.read().decode(errors="replace") or "another process"
                message = f"the study is being run by {holder}; wait until it ends, or stop it there and run it again"
                raise StudyError(message, path=str(folder)) from None
            file.truncate(0)
            file.write(f" process {os.getpid()} on {socket.gethostname()}".encode())
            for remains in () if is_shared else folder.rglob(".*.part*"):  # remains of a killed process
                remains.unlink(missing_ok=True)
        yield


@contextlib.contextmanager
def _convert_errors(operation: str, file: Path) -> Iterator[None]:
    """Raise an OutputError if the system rejects an operation on a file."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"the file cannot be {operation}: {error.strerror or error}", path=str(file)) from error


def _product_to_arrays(product: SimulationProduct) -> dict[str, NDArray[Any]]:
    """Convert all inputs to arrays by part and name."""
    bodies, scales = product.bodies, product.scales
    arrays = {f"{bodies.kind}/{name}": values for name, (values, _) in bodies.parameters().items()}
    arrays[f"{bodies.kind}/gravity"] = np.array(bodies.gravity)
    if isinstance(bodies, Blocks):
        arrays |= {f"labels/{name}": values for name, values in bodies.labels.items()}
    for k, motion in enumerate(product.motions):
        arrays |= _motion_to_arrays(motion, f"motions/{k}")
    measure = None if scales.measure is None else {"name": scales.measure.name, **scales.measure.options()}
    rules = {name: getattr(product, name) for name in ("polarity", "model", "chattering", "duration")}
    rules["chattering"] = str(product.chattering)
    if product.friction is not None:
        rules["friction"] = [*product.friction]
        if isinstance(bodies, Blocks) and bodies.radii is not None:
            arrays["sizes/radii"] = bodies.radii
    values = {"scales/measure": measure} | {f"rules/{name}": value for name, value in rules.items()}
    texts = {name: np.array(json.dumps(value)) for name, value in values.items()}
    return arrays | {"scales/values": scales.values} | texts


def _product_from_arrays(arrays: Mapping[str, NDArray[Any]]) -> SimulationProduct:
    """Create the inputs from their arrays."""
    kind = next((folder for folder in (name.partition("/")[0] for name in arrays) if folder in BODIES_TYPES), "")
    if not kind:
        raise StudyError("the study contains an unknown kind of body: import its module first")
    values = {name.partition("/")[2]: array for name, array in arrays.items() if name.startswith(f"{kind}/")}
    motions = dict.fromkeys(name.split("/")[1] for name in arrays if name.startswith("motions/"))
    texts = {name: json.loads(str(array)) for name, array in arrays.items() if name.startswith(("scales/m", "rules/"))}
    labels = {name.partition("/")[2]: array for name, array in arrays.items() if name.startswith("labels/")}
    measure, chattering = texts["scales/measure"], chattering_scheme(texts["rules/chattering"])
    bodies, friction = (
        BODIES_TYPES[kind](**{**values, "gravity": float(values["gravity"])}),
        texts.get("rules/friction"),
    )
    if isinstance(bodies, Blocks):
        bodies.__dict__.update(radii=arrays.get("sizes/radii"), labels=labels)
    return SimulationProduct(
        bodies,
        tuple(_motion_from_arrays(arrays, f"motions/{k}") for k in motions),
        ScalingLevels(None if measure is None else Measure(**measure), arrays["scales/values"]),
        *(texts["rules/polarity"], texts["rules/model"], chattering, texts["rules/duration"]),
        friction and (friction[0], friction[1]),
    )


def _motion_to_arrays(motion: Motion, prefix: str) -> dict[str, NDArray[Any]]:
    family, text, parameters = (getattr(motion.description, name) for name in ("family", "text", "parameters"))
    texts = {"name": motion.name, "family": family, "parameters": dict(parameters), "text": text}
    texts |= {"history": motion.history, "error": motion.error}
    arrays = {"breakpoints": motion.breakpoints, "coefficients": motion.coefficients}
    arrays["words"] = np.array(json.dumps(texts))
    parts = {f"{prefix}/{name}": array for name, array in arrays.items()}
    for name, part in (("vertical", motion.vertical), ("orthogonal", motion.orthogonal)):
        parts |= {} if part is None else _motion_to_arrays(part, f"{prefix}/{name}")
    return parts


def _motion_from_arrays(arrays: Mapping[str, NDArray[Any]], prefix: str) -> Motion:
    texts = json.loads(str(arrays[f"{prefix}/words"]))
    others = [name for name in ("vertical", "orthogonal") if f"{prefix}/{name}/words" in arrays]
    return Motion(
        arrays[f"{prefix}/breakpoints"],
        arrays[f"{prefix}/coefficients"],
        name=texts["name"],
        description=Description(texts["family"], texts["parameters"], texts["text"]),
        history=tuple(texts["history"]),
        error=texts["error"],
        **{name: _motion_from_arrays(arrays, f"{prefix}/{name}") for name in others},
    )
