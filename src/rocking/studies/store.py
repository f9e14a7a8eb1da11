"""The store of a study: an array of outcomes, one object a unit, with all that is needed to go on."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from rocking.arrays import Floats
from rocking.constants import VERSION
from rocking.errors import DamagedStudy, StudyError
from rocking.kernels.compiled import fingerprint
from rocking.product import Product
from rocking.studies import inputs
from rocking.studies.outcomes import OUTCOMES, told
from rocking.studies.place import Place
from rocking.studies.units import Axes, DamagedUnit, Grid, Key, Line, Work, decoded, key_of, name_of
from rocking.tables import counted

#: Format of a store, and of one of chosen outcomes, which a program that knows none would take for damage.
FORMAT: Final = 2
_CHOSEN: Final = 3

_ARRAY: Final = "result"

#: How the file that a study was made from names its records; no result depends on it.
_RECORDS: Final = "records.json"

#: What is in the place of a study whose creation was cut off; that of an object store keeps a clock as well.
_ITS_OWN: Final = frozenset({_ARRAY, "inputs.npz", "zarr.json", "lock", "clock", "runs.jsonl"})

#: Names of other things that a sentence lists.
_LISTED: Final = 3

_GROUP: Final = json.dumps({"zarr_format": 3, "node_type": "group", "attributes": {}}, indent=2)


class Store:
    """Outcomes of a product, unit by unit. A unit is done when its object exists, and only then.

    Parameters
    ----------
    place : Place
        Where it is kept.
    product : Product
        What is simulated.
    grid : Grid
        How it is cut into units.
    """

    #: What is counted while it runs.
    title = "simulations"

    def __init__(self, place: Place, product: Product, grid: Grid) -> None:
        self.place, self.product, self.grid = place, product, grid
        # Neighbouring units share their motions or their blocks.
        self._factors = functools.lru_cache(1)(self._factors_of)
        self._setup = functools.lru_cache(1)(lambda unit: product.setup(grid.ranges((0, 0, 0, unit))[3]))

    @classmethod
    def create(cls, place: Place, product: Product, unit: Axes, outcomes: tuple[str, ...]) -> Store:
        """Write an empty store; `study.json` last, so that half a store is none.

        Raises
        ------
        StudyError
            If there is something else in the place.
        """
        _require_free(place)
        grid = Grid(product.shape, unit, outcomes)
        archive = inputs.to_bytes(product)
        place.put("inputs.npz", archive)
        made = cls(place, product, grid)
        for name, data in made.metadata.items():
            place.put(name, data)
        about: dict[str, Any] = {
            "format": FORMAT,
            "version": VERSION,
            "kernels": fingerprint(),
            "unit": list(unit),
            "shape": list(product.shape),
            "inputs": hashlib.sha256(archive).hexdigest(),
            "parts": inputs.hashes(product),
        }
        if outcomes != OUTCOMES:
            about |= {"format": _CHOSEN, "outcomes": list(outcomes)}
        place.put("study.json", sealed(about))
        return made

    @classmethod
    def open(cls, place: Place) -> Store:
        """Open a store, checked.

        Raises
        ------
        StudyError
            If there is none, it is damaged, or it was made by another version.
        """
        about = described(place)
        archive = place.get("inputs.npz")
        if archive is None or hashlib.sha256(archive).hexdigest() != about["inputs"]:
            raise StudyError(
                f"inputs.npz in {place} is missing or damaged; restore it, or create the study again elsewhere"
            )
        product = inputs.from_bytes(archive)
        grid = Grid(product.shape, tuple(about["unit"]), tuple(about.get("outcomes", OUTCOMES)))
        return cls(place, product, grid)

    @property
    def metadata(self) -> dict[str, bytes]:
        """Objects by which any reader of Zarr knows the array."""
        return {"zarr.json": _GROUP.encode(), f"{_ARRAY}/zarr.json": self.grid.metadata().encode()}

    def check_program(self) -> None:
        """Check that this program computes what the store holds, to the last bit.

        Raises
        ------
        StudyError
            If it was made by another version or by other kernels.
        """
        about = described(self.place)
        if (about["version"], about["kernels"]) != (VERSION, fingerprint()):
            raise StudyError(
                f"{self.place}: the study was made by rocking {about['version']} (kernels {about['kernels']}), this is "
                f"{VERSION} (kernels {fingerprint()}): run it with that version, or create it again elsewhere"
            )

    def check_inputs(self, product: Product, outcomes: tuple[str, ...]) -> None:
        """Check that these inputs are those of the store, and that it keeps these outcomes.

        Raises
        ------
        StudyError
            If they differ; the message says in which parts.
        """
        changed = inputs.changes(inputs.hashes(product), described(self.place)["parts"], product.motions)
        if outcomes != self.grid.outcomes:
            changed.append(f"the outcomes ({told(self.grid.outcomes)} then; {told(outcomes)} now)")
        if changed:
            raise StudyError(
                f"{self.place} holds a study of other inputs ({', '.join(changed)} changed), {len(self.done())} of "
                f"{counted(len(self.grid), 'unit')} done: create this one elsewhere, or remove that one"
            )

    def name_records(self, records: Sequence[str]) -> None:
        """Keep the name of the record of each motion, in place of those that were; no number depends on them."""
        data = sealed({"records": list(records)})
        if self.place.get(_RECORDS) != data:
            self.place.put(_RECORDS, data)

    def records(self) -> tuple[str, ...]:
        """Name of the record of each motion, empty of a pulse; none at all where they are not known.

        Raises
        ------
        StudyError
            If they are damaged.
        """
        data = self.place.get(_RECORDS)
        about = {"records": ()} if data is None else unsealed(data)
        if about is None or (data is not None and len(about["records"]) != len(self.product.motions)):
            raise StudyError(
                f"{_RECORDS} in {self.place} is damaged: create the study again from its file, in its place"
            )
        return tuple(about["records"])

    def done(self) -> set[Key]:
        """Keys of the units that are done."""
        found = map(key_of, self.place.names(_ARRAY))
        m, s, k, b = self.grid.cells
        return {key for key in found if key and key[0] < m and key[1] < s and key[2] < k and key[3] < b}

    def missing(self) -> Iterator[Key]:
        """Keys of the units that are not done, in order."""
        done = self.done()
        return (key for key in self.grid if key not in done)

    def work(self, key: Key) -> Work:
        """Return all that a worker needs for a unit."""
        motions, scales, polarities, _ = self.grid.ranges(key)
        factors = self._factors(key[0])[:, scales, polarities]
        return Work(self._setup(key[3]), self.product.motions[motions], factors, self.grid.unit, self.grid.outcomes)

    def _factors_of(self, unit: int) -> Floats:
        """Factors on the motions of a unit, shape (motions, scales, polarities)."""
        motions = self.product.motions[self.grid.ranges((unit, 0, 0, 0))[0]]
        factors = np.array([self.product.scales.factors(motion) for motion in motions])
        return factors[:, :, None] * np.array(self.product.signs, dtype=np.float64)

    @staticmethod
    def label(key: Key) -> str:
        """Name a unit."""
        return name_of(key)

    def put(self, key: Key, data: bytes) -> None:
        """Store a unit."""
        self.place.put(f"{_ARRAY}/{name_of(key)}", data)

    def raw(self, key: Key) -> bytes | None:
        """Bytes of a unit; None where it is not done."""
        return self.place.get(f"{_ARRAY}/{name_of(key)}")

    def outcomes(self, key: Key) -> Mapping[str, Floats] | None:
        """Outcomes of a unit by name, shape (motions, scales, polarities, blocks) each; None where it is not done.

        Raises
        ------
        StudyError
            If it is damaged; the message names it.
        """
        data = self.raw(key)
        if data is None:
            return None
        return readable(data, self.grid, self.grid.counts(key), self.label(key))


def readable(data: bytes, grid: Grid | Line, counts: tuple[int, ...], label: str) -> Mapping[str, Floats]:
    """Outcomes of a unit from its bytes by name, shape (*counts) each.

    Raises
    ------
    DamagedStudy
        If they are damaged; the message names the unit.
    """
    try:
        return decoded(data, grid.outcomes, counts, grid.unit)
    except DamagedUnit as error:
        raise DamagedStudy(f"unit {label} is damaged, {error}") from None


def exists(place: Place) -> bool:
    """Whether there is a study in a place."""
    return place.get("study.json") is not None


def described(place: Place) -> dict[str, Any]:
    """Read what `study.json` says.

    Raises
    ------
    StudyError
        If there is no study, it is damaged, or its format is another.
    """
    data = place.get("study.json")
    if data is None:
        raise StudyError(f"there is no study in {place}: create it first")
    about = unsealed(data)
    if about is None:
        raise StudyError(f"study.json in {place} is damaged: restore it, or create the study again elsewhere")
    if about["format"] not in (FORMAT, _CHOSEN):
        raise StudyError(
            f"the study in {place} is of format {about['format']}, this program knows {FORMAT} and {_CHOSEN}: use its "
            "version"
        )
    return about


def _require_free(place: Place) -> None:
    """Check that there is nothing in a place that is no study's.

    Raises
    ------
    StudyError
        If there is.
    """
    others = {name.partition("/")[0] for name in place.names("")} - _ITS_OWN
    if others:
        listed = ", ".join(sorted(others)[:_LISTED]) + (" and more" if len(others) > _LISTED else "")
        raise StudyError(f"{place} holds no study, but {listed}: name a new folder, or an empty one")


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
