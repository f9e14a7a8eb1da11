"""The store of a study: an array of outcomes, one file a unit, with all that is needed to go on."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from rocking.arrays import Floats
from rocking.constants import VERSION
from rocking.ensemble import Product, setup_of
from rocking.errors import DamagedStudy, StudyError
from rocking.kernels.compiled import fingerprint
from rocking.studies import inputs
from rocking.studies.folder import Folder
from rocking.studies.inputs import UNNAMED, outcomes_text
from rocking.studies.units import DamagedUnit, Key, UnitGrid, Work, decoded, name_of
from rocking.tables import counted

#: Formats of a store that are read; the second one, which is written, names its outcomes.
_FORMATS: Final = (2, 3)

_ARRAY: Final = "result"

#: How the file that a study was made from names its records; no result depends on it.
_RECORDS: Final = "records.json"

#: What is in the folder of a study whose creation was cut off.
_ITS_OWN: Final = frozenset({_ARRAY, "inputs.npz", "zarr.json", "lock", "runs.jsonl"})

#: Names of other things that a sentence lists.
_LISTED: Final = 3

_GROUP: Final = json.dumps({"zarr_format": 3, "node_type": "group", "attributes": {}}, indent=2).encode()


class Store:
    """Outcomes of a product of blocks, motions, scales and polarities. A unit is done when its file exists.

    Attributes
    ----------
    folder : Folder
        Where it is kept.
    about : dict
        What `study.json` describes.
    product : Product
        What is simulated.
    grid : UnitGrid
        How it is cut into units.
    """

    def __init__(self, folder: Folder, about: dict[str, Any], product: Product) -> None:
        self.folder, self.about, self.product = folder, about, product
        self.grid = UnitGrid(product.shape, tuple(about["unit"]), tuple(about.get("outcomes", UNNAMED)))
        # Neighbouring units share their motions or their blocks.
        self._factors = functools.lru_cache(1)(self._factors_of)
        self._setup = functools.lru_cache(1)(lambda unit: setup_of(product, self.grid.ranges((0, 0, 0, unit))[-1]))

    @classmethod
    def create(cls, folder: Folder, product: Product, unit: tuple[int, ...], outcomes: tuple[str, ...]) -> Store:
        """Write an empty store where nothing else is; `study.json` last, so that half a store is none."""
        require_free(folder)
        archive = inputs.to_bytes(product)
        about: dict[str, Any] = {
            "format": max(_FORMATS),
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
        if about["format"] not in _FORMATS:
            raise StudyError(
                f"the study is of format {about['format']}, this program reads {' and '.join(map(str, _FORMATS))}: use "
                "its version",
                path=str(folder),
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
        return {"zarr.json": _GROUP, f"{_ARRAY}/zarr.json": self.grid.metadata()}

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
        self.folder.keep(_RECORDS, sealed({"records": list(records)}))

    def records(self) -> tuple[str, ...]:
        """Name of the record of each motion, empty of a pulse; none at all where they are not known."""
        correction, count = "create the study again from its file, in its place", len(self.product.motions)
        about = kept(self.folder, _RECORDS, correction, lambda about: len(about["records"]) == count)
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
        """Bytes of a unit; None where it is not done."""
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
        motions, scales, polarities, _ = self.grid.ranges(key)
        factors = self._factors(key[0])[:, scales, polarities]
        return Work(self._setup(key[-1]), self.product.motions[motions], factors, self.grid.unit, self.grid.outcomes)

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
    others = {*folder.names()} - _ITS_OWN
    if others:
        listed = ", ".join(sorted(others)[:_LISTED]) + (" and more" if len(others) > _LISTED else "")
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
    about = _unsealed(data)
    if about is None or not holds(about):
        raise StudyError(f"{name} is damaged: {correction}", path=str(folder))
    return about


def _unsealed(data: bytes) -> dict[str, Any] | None:
    """Return the content of a sealed file; None if it is damaged."""
    try:
        about: dict[str, Any] = json.loads(data)
        seal = about.pop("seal")
    except (ValueError, KeyError, AttributeError, TypeError):
        return None
    return about if sealed(about) == data and seal == _seal(about) else None


def sealed(about: dict[str, Any]) -> bytes:
    """Return a description with its own hash."""
    return json.dumps(about | {"seal": _seal(about)}, indent=2).encode()


def _seal(about: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()
