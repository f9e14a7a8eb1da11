"""The store of a study: arrays of outcomes, one object a unit, with all that is needed to go on."""

from __future__ import annotations

import functools
import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from rocking.arrays import Floats
from rocking.constants import VERSION
from rocking.ensemble import Product, setup_of
from rocking.errors import DamagedStudy, StudyError
from rocking.kernels.compiled import fingerprint
from rocking.studies import inputs
from rocking.studies.inputs import UNNAMED, outcomes_text
from rocking.studies.place import Place
from rocking.studies.units import DamagedUnit, GridWork, Key, UnitGrid, Work, decoded, key_of, name_of
from rocking.tables import counted

#: Format of a store, and of one of chosen outcomes, which a program that knows none would take for damage.
_FORMAT: Final = 2
_CHOSEN: Final = 3

_ARRAY: Final = "result"

#: How the file that a study was made from names its records; no result depends on it.
_RECORDS: Final = "records.json"

#: What is in the place of a study whose creation was cut off; that of an object store keeps a clock as well.
_ITS_OWN: Final = frozenset({_ARRAY, "inputs.npz", "zarr.json", "lock", "clock", "runs.jsonl"})

#: Names of other things that a sentence lists.
_LISTED: Final = 3

_GROUP: Final = json.dumps({"zarr_format": 3, "node_type": "group", "attributes": {}}, indent=2).encode()


class UnitArray(ABC):
    """Outcomes of simulations, unit by unit. A unit is done when its object exists, and only then.

    Attributes
    ----------
    place : Place
        Where it is kept.
    array : str
        Its name there.
    grid : UnitGrid
        How it is cut into units.
    """

    def __init__(self, place: Place, array: str, grid: UnitGrid) -> None:
        self.place, self.array, self.grid = place, array, grid

    @property
    @abstractmethod
    def title(self) -> str:
        """What is counted while it runs, in a few words."""

    @abstractmethod
    def work(self, key: Key) -> Work:
        """Return all that a worker needs for a unit."""

    @property
    def metadata(self) -> dict[str, bytes]:
        """Objects by which any reader of Zarr knows the array; an array without units has none."""
        return {f"{self.array}/zarr.json": self.grid.metadata()} if self.grid.total else {}

    def done(self) -> set[Key]:
        """Keys of the units that are done."""
        return {key for name in self.place.names(self.array) if (key := key_of(name)) in self.grid and key is not None}

    def missing(self) -> Iterator[Key]:
        """Keys of the units that are not done, in order."""
        done = self.done()
        return (key for key in self.grid if key not in done)

    def require_complete(self) -> None:
        """Raise a StudyError if units are missing."""
        missing = len(self.grid) - len(self.done())
        if missing:
            raise StudyError(
                f"units are missing, {missing} of {len(self.grid)}: run the study to its end first",
                path=str(self.place),
            )

    def label(self, key: Key) -> str:
        """Name a unit among those of all arrays of the study."""
        return f"{self.array}/{name_of(key)}"

    def put(self, key: Key, data: bytes) -> None:
        """Store a unit."""
        self.place.put(f"{self.array}/{name_of(key)}", data)

    def raw(self, key: Key) -> bytes | None:
        """Bytes of a unit; None where it is not done."""
        return self.place.get(f"{self.array}/{name_of(key)}")

    def outcomes(self, key: Key) -> Mapping[str, Floats] | None:
        """Outcomes of a unit by name, of its counts each; None where it is not done, a StudyError if it is damaged."""
        data = self.raw(key)
        if data is None:
            return None
        try:
            return decoded(data, self.grid.outcomes, self.grid.counts(key), self.grid.unit)
        except DamagedUnit as error:
            raise DamagedStudy(f"unit {self.label(key)} is damaged, {error}") from None

    def present(self, key: Key) -> Mapping[str, Floats]:
        """Outcomes of a unit that was done; a StudyError if it is gone or damaged."""
        outcomes = self.outcomes(key)
        if outcomes is None:
            raise StudyError(f"unit {self.label(key)} is gone: run the study again", path=str(self.place))
        return outcomes


class Store(UnitArray):
    """Outcomes of a product of blocks, motions, scales and polarities, with what describes it.

    Attributes
    ----------
    product : Product
        What is simulated.
    """

    title = "simulations"

    def __init__(self, place: Place, product: Product, grid: UnitGrid) -> None:
        super().__init__(place, _ARRAY, grid)
        self.product = product
        # Neighbouring units share their motions or their blocks.
        self._factors = functools.lru_cache(1)(self._factors_of)
        self._setup = functools.lru_cache(1)(lambda unit: setup_of(product, grid.ranges((0, 0, 0, unit))[-1]))

    @classmethod
    def create(cls, place: Place, product: Product, unit: tuple[int, ...], outcomes: tuple[str, ...]) -> Store:
        """Write an empty store where nothing else is; `study.json` last, so that half a store is none."""
        require_free(place)
        archive = inputs.to_bytes(product)
        place.put("inputs.npz", archive)
        made = cls(place, product, UnitGrid(product.shape, unit, outcomes))
        for name, data in made.metadata.items():
            place.put(name, data)
        about: dict[str, Any] = {
            "format": _FORMAT,
            "version": VERSION,
            "kernels": fingerprint(),
            "unit": list(unit),
            "shape": list(product.shape),
            "inputs": hashlib.sha256(archive).hexdigest(),
            "parts": inputs.hashes(product),
        }
        if outcomes != UNNAMED:
            about |= {"format": _CHOSEN, "outcomes": list(outcomes)}
        place.put("study.json", sealed(about))
        return made

    @classmethod
    def open(cls, place: Place) -> Store:
        """Open a store; a StudyError if there is none, it is damaged, or of another format."""
        about = _described(place)
        archive = place.get("inputs.npz")
        if archive is None or hashlib.sha256(archive).hexdigest() != about["inputs"]:
            raise StudyError(
                "inputs.npz is missing or damaged; restore it, or create the study again elsewhere", path=str(place)
            )
        product = inputs.from_bytes(archive)
        grid = UnitGrid(product.shape, tuple(about["unit"]), tuple(about.get("outcomes", UNNAMED)))
        return cls(place, product, grid)

    @property
    def metadata(self) -> dict[str, bytes]:
        """Objects by which any reader of Zarr knows the array, and the group of all arrays."""
        return {"zarr.json": _GROUP, **super().metadata}

    def check_program(self) -> None:
        """Check that this program computes what the store holds, to the last bit; a StudyError if not."""
        about = _described(self.place)
        if (about["version"], about["kernels"]) != (VERSION, fingerprint()):
            raise StudyError(
                f"the study was made by rocking {about['version']} (kernels {about['kernels']}), this is {VERSION} "
                f"(kernels {fingerprint()}): run it with that version, or create it again elsewhere",
                path=str(self.place),
            )

    def check_inputs(self, product: Product, outcomes: tuple[str, ...]) -> None:
        """Check that these are the inputs and outcomes of the store; a StudyError says in which parts they differ."""
        changed = inputs.changes(inputs.hashes(product), _described(self.place)["parts"], product.motions)
        if outcomes != self.grid.outcomes:
            changed.append(f"the outcomes ({outcomes_text(self.grid.outcomes)} then; {outcomes_text(outcomes)} now)")
        if changed:
            raise StudyError(
                f"this holds a study of other inputs ({', '.join(changed)} changed), {len(self.done())} of "
                f"{counted(len(self.grid), 'unit')} done: create this one elsewhere, or remove that one",
                path=str(self.place),
            )

    def name_records(self, records: Sequence[str]) -> None:
        """Keep the name of the record of each motion, in place of those that were; no number depends on them."""
        keep(self.place, _RECORDS, sealed({"records": list(records)}))

    def records(self) -> tuple[str, ...]:
        """Name of the record of each motion, empty of a pulse; none at all where they are not known."""
        correction, count = "create the study again from its file, in its place", len(self.product.motions)
        about = kept(self.place, _RECORDS, correction, lambda about: len(about["records"]) == count)
        return () if about is None else tuple(about["records"])

    def label(self, key: Key) -> str:
        """Name a unit; those of the grid need no name of their array."""
        return name_of(key)

    def work(self, key: Key) -> GridWork:
        """Return all that a worker needs for a unit."""
        motions, scales, polarities, _ = self.grid.ranges(key)
        return GridWork(
            setup=self._setup(key[-1]),
            motions=self.product.motions[motions],
            factors=self._factors(key[0])[:, scales, polarities],
            unit=self.grid.unit,
            outcomes=self.grid.outcomes,
        )

    def _factors_of(self, unit: int) -> Floats:
        """Factors on the motions of a unit, shape (motions, scales, polarities)."""
        motions = self.product.motions[self.grid.ranges((unit, 0, 0, 0))[0]]
        factors = np.array([self.product.scales.factors(motion) for motion in motions])
        return factors[:, :, None] * np.array(self.product.signs, dtype=np.float64)


def exists(place: Place) -> bool:
    """Whether there is a study in a place."""
    return place.get("study.json") is not None


def _described(place: Place) -> dict[str, Any]:
    """Read what `study.json` says; a StudyError if there is none, it is damaged, or its format is another."""
    about = kept(place, "study.json", "restore it, or create the study again elsewhere")
    if about is None:
        raise StudyError("there is no study here: create it first", path=str(place))
    if about["format"] not in (_FORMAT, _CHOSEN):
        raise StudyError(
            f"the study is of format {about['format']}, this program knows {_FORMAT} and {_CHOSEN}: use its version",
            path=str(place),
        )
    return about


def require_free(place: Place) -> None:
    """Check that there is nothing in a place that is no study's."""
    others = {name.partition("/")[0] for name in place.names("")} - _ITS_OWN
    if others:
        listed = ", ".join(sorted(others)[:_LISTED]) + (" and more" if len(others) > _LISTED else "")
        raise StudyError(f"this holds no study, but {listed}: name a new folder, or an empty one", path=str(place))
    # A creation that was cut off has computed nothing: units of a study whose description is gone may be of another.
    if any(key_of(name) is not None for name in place.names(_ARRAY)):
        raise StudyError(
            "this holds results of a study whose study.json is gone: restore that, or name a new folder",
            path=str(place),
        )


def keep(place: Place, name: str, data: bytes) -> None:
    """Put an object in place of another one; not if it is there already."""
    if place.get(name) != data:
        place.put(name, data)


def kept(
    place: Place, name: str, correction: str, holds: Callable[[dict[str, Any]], bool] = lambda about: True
) -> dict[str, Any] | None:
    """Return what a sealed object says; None where there is none, a StudyError with a correction if it is damaged."""
    data = place.get(name)
    if data is None:
        return None
    about = unsealed(data)
    if about is None or not holds(about):
        raise StudyError(f"{name} is damaged: {correction}", path=str(place))
    return about


def unsealed(data: bytes) -> dict[str, Any] | None:
    """Return what a sealed description says; None if it is damaged."""
    try:
        about: dict[str, Any] = json.loads(data)
        seal = about.pop("seal")
    except (ValueError, KeyError, AttributeError, TypeError):
        return None
    return about if sealed(about) == data and seal == _seal(about) else None


def sealed(about: dict[str, Any]) -> bytes:
    """Return the description with its own hash."""
    return json.dumps(about | {"seal": _seal(about)}, indent=2).encode()


def _seal(about: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()
