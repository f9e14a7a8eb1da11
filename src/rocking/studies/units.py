"""Units of a study: one cell of a regular grid each, what it computes, and its bytes in the store."""

from __future__ import annotations

import functools
import gzip
import itertools
import json
import math
import re
import socket
import threading
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats, Integers
from rocking.constants import VERSION
from rocking.engine import OUTCOME, Setup, Task, simulate_task
from rocking.errors import StudyError
from rocking.kernels.compiled import fingerprint
from rocking.motion.motion import Motion

#: Checked, but not packed: packing would save two thirds of the bytes, and take 3 % of the time of the simulations.
_LEVEL: Final = 0

#: Outcomes that are rearranged together: some hundreds of kilobytes.
_CACHED: Final = 4096

#: What gzip writes first: no name, no time, an unknown system. Any other byte there is damage.
_HEADER: Final = gzip.compress(b"", _LEVEL, mtime=0)[:10]

_NAME: Final = re.compile(r"c\.0\.(\d+)\.(\d+)\.(\d+)\.(\d+)", re.ASCII)

#: Four numbers, along motions, scales, polarities and blocks.
Axes = tuple[int, int, int, int]

#: Indices of a unit along the axes of its array.
Key = tuple[int, ...]


class DamagedUnit(Exception):
    """The bytes of a unit are not what was written."""


@dataclass(frozen=True)
class Grid:
    """How the simulations are cut into units.

    Attributes
    ----------
    shape : (m, s, k, n)
        Numbers of motions, scales, polarities and blocks.
    unit : (um, us, uk, un)
        How many of each a unit holds; the last one along an axis may hold fewer.
    outcomes : tuple of str
        What is kept of each simulation, in the order in which the array holds it.
    """

    shape: Axes
    unit: Axes
    outcomes: tuple[str, ...]

    @property
    def cells(self) -> Axes:
        """Numbers of units along motions, scales, polarities and blocks."""
        m, s, k, n = (math.ceil(size / part) for size, part in zip(self.shape, self.unit, strict=True))
        return m, s, k, n

    def __len__(self) -> int:
        return math.prod(self.cells)

    @property
    def total(self) -> int:
        """Number of simulations in all units."""
        return math.prod(self.shape)

    def __iter__(self) -> Iterator[Key]:
        """Give the keys of all units, blocks first."""
        m, s, k, b = self.cells
        return itertools.product(range(m), range(s), range(k), range(b))

    def ranges(self, key: Key) -> tuple[slice, slice, slice, slice]:
        """Motions, scales, polarities and blocks of a unit."""
        starts = (index * part for index, part in zip(key, self.unit, strict=True))
        ends = zip(starts, self.unit, self.shape, strict=True)
        m, s, k, n = (slice(start, min(start + part, size)) for start, part, size in ends)
        return m, s, k, n

    def counts(self, key: Key) -> Axes:
        """Numbers of motions, scales, polarities and blocks of a unit."""
        m, s, k, n = (part.stop - part.start for part in self.ranges(key))
        return m, s, k, n

    def simulations(self, key: Key) -> int:
        """Count the simulations of a unit."""
        return math.prod(self.counts(key))

    def metadata(self) -> str:
        """Metadata of the array as Zarr 3 has it: one chunk a unit, in flat keys."""
        return _metadata(self.outcomes, self.shape, self.unit, ("motion", "scale", "polarity", "block"))


@dataclass(frozen=True)
class Line:
    """How simulations without a grid are cut into units.

    Attributes
    ----------
    total : int
        Number of simulations in all units.
    width : int
        How many a unit holds; the last one may hold fewer.
    outcomes : tuple of str
        What is kept of each simulation, in the order in which the array holds it.
    """

    total: int
    width: int
    outcomes: tuple[str, ...]

    @property
    def unit(self) -> tuple[int]:
        """Shape of a unit."""
        return (self.width,)

    def __iter__(self) -> Iterator[Key]:
        """Give the keys of all units."""
        return ((k,) for k in range(math.ceil(self.total / self.width)))

    def range(self, key: Key) -> slice:
        """Range of the simulations of a unit."""
        start = key[0] * self.width
        return slice(start, min(start + self.width, self.total))

    def simulations(self, key: Key) -> int:
        """Count the simulations of a unit."""
        return min(self.width, self.total - key[0] * self.width)

    def metadata(self) -> str:
        """Metadata of the array as Zarr 3 has it."""
        return _metadata(self.outcomes, (self.total,), self.unit, ("point",))


def _metadata(
    outcomes: tuple[str, ...], shape: tuple[int, ...], unit: tuple[int, ...], dimensions: tuple[str, ...]
) -> str:
    return json.dumps(
        {
            "zarr_format": 3,
            "node_type": "array",
            "shape": [len(outcomes), *shape],
            "data_type": "float64",
            "chunk_grid": {
                "name": "regular",
                "configuration": {"chunk_shape": [len(outcomes), *unit]},
            },
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "."}},
            "fill_value": "NaN",
            "codecs": [
                {"name": "bytes", "configuration": {"endian": "little"}},
                {"name": "gzip", "configuration": {"level": _LEVEL}},
            ],
            "dimension_names": ["outcome", *dimensions],
            "attributes": {"outcomes": list(outcomes)},
        },
        indent=2,
    )


def name_of(key: Key) -> str:
    """Name of a unit's object in the store."""
    return "c.0." + ".".join(map(str, key))


def key_of(name: str) -> Axes | None:
    """Key of a unit of a grid from the name of its object; None of any other object."""
    found = _NAME.fullmatch(name)
    if found is None:
        return None
    m, s, k, b = map(int, found.groups())
    return m, s, k, b


@functools.cache
def program() -> str:
    """Name what computes here, to the last bit."""
    return f"rocking {VERSION} (kernels {fingerprint()})"


@dataclass(frozen=True)
class Work:
    """All that a worker needs for a unit.

    Attributes
    ----------
    setup : Setup
        The unit's blocks, and how to compute.
    motions : tuple of Motion
        What shakes them.
    factors : ndarray, shape (motions, scales, polarities)
        Factors on the motions.
    unit : (um, us, uk, un)
        What a full unit holds.
    outcomes : tuple of str
        What is kept of each simulation.
    program : str
        Who must compute it.
    """

    setup: Setup
    motions: tuple[Motion, ...]
    factors: Floats
    unit: Axes
    outcomes: tuple[str, ...]
    program: str = field(default_factory=program)

    def values(self, stop: threading.Event | None) -> Floats:
        """Simulate, and return the outcomes."""
        blocks = slice(0, len(self.setup.bodies))
        values = blank(self.outcomes, self.unit, (*self.factors.shape, blocks.stop))
        for m, s, k in np.ndindex(self.factors.shape):
            task = Task(blocks, self.motions[m], float(self.factors[m, s, k]))
            fill(values[:, m, s, k, blocks], self.outcomes, simulate_task(self.setup, task, stop))
        return values


@dataclass(frozen=True)
class PointsWork:
    """All that a worker needs for a unit of simulations that are no grid: a block, a motion and a factor each.

    Attributes
    ----------
    setup : Setup
        n blocks, one for each simulation, and how to compute.
    motions : tuple of Motion
        What shakes them.
    which : ndarray of int, shape (n,)
        Which motion.
    factors : ndarray, shape (n,)
        Factors on it; those with the same motion and factor stand together.
    unit : (int,)
        How many a full unit holds.
    outcomes : tuple of str
        What is kept of each simulation.
    program : str
        Who must compute it.
    """

    setup: Setup
    motions: tuple[Motion, ...]
    which: Integers
    factors: Floats
    unit: tuple[int]
    outcomes: tuple[str, ...]
    program: str = field(default_factory=program)

    def values(self, stop: threading.Event | None) -> Floats:
        """Simulate, and return the outcomes."""
        count = len(self.factors)
        values = blank(self.outcomes, self.unit, (count,))
        changes = np.flatnonzero((np.diff(self.which) != 0) | (np.diff(self.factors) != 0.0)) + 1
        for start, end in itertools.pairwise([0, *changes.tolist(), count]):
            task = Task(slice(start, end), self.motions[self.which[start]], float(self.factors[start]))
            fill(values[:, start:end], self.outcomes, simulate_task(self.setup, task, stop))
        return values


def compute(work: Work | PointsWork, stop: threading.Event | None = None) -> bytes:
    """Simulate a unit, wherever its inputs have been sent, and return its bytes; of no use where `stop` is set.

    Raises
    ------
    StudyError
        If the program is another one here, whose bits may differ.
    """
    if work.program != program():
        raise StudyError(f"the worker on {socket.gethostname()} has {program()}, the study needs {work.program}")
    return encoded(work.values(stop))


def blank(names: tuple[str, ...], unit: tuple[int, ...], counts: tuple[int, ...]) -> Floats:
    """Room for these outcomes of a unit, NaN where it holds fewer simulations than a full one."""
    shape = len(names), *unit
    return np.empty(shape) if unit == counts else np.full(shape, np.nan)


def fill(values: Floats, names: tuple[str, ...], outcomes: NDArray[np.void]) -> None:
    """Write these outcomes of n simulations into an array, shape (names, n): as many at a time as a cache holds."""
    for start in range(0, len(outcomes), _CACHED):
        some = slice(start, start + _CACHED)
        for one, name in zip(values, names, strict=True):
            one[some] = outcomes[name][some]


def encoded(values: Floats) -> bytes:
    """Bytes of the outcomes of a full unit, however many of them are NaN."""
    return gzip.compress(np.ascontiguousarray(values, "<f8").data, _LEVEL, mtime=0)


def decoded(data: bytes, names: tuple[str, ...], counts: tuple[int, ...], unit: tuple[int, ...]) -> dict[str, Floats]:
    """Outcomes of a unit by their names, each of shape (*counts).

    Raises
    ------
    DamagedUnit
        If the bytes are damaged: every changed bit and every cut is seen.
    """
    if data[: len(_HEADER)] != _HEADER:
        raise DamagedUnit("its header is damaged")
    try:
        raw = gzip.decompress(data)
    except (OSError, EOFError, zlib.error) as error:
        raise DamagedUnit(f"it cannot be unpacked: {error}") from None
    size = 8 * len(names) * math.prod(unit)
    if len(raw) != size:
        raise DamagedUnit(f"it holds {len(raw)} bytes, not {size}")
    values = np.frombuffer(raw, "<f8").reshape(len(names), *unit)
    held = np.asarray(values[(slice(None), *(slice(0, count) for count in counts))], dtype=np.float64)
    return dict(zip(names, held, strict=True))


def exact(name: str, values: Floats) -> NDArray[Any]:
    """Values of an outcome in its own type."""
    return values.astype(OUTCOME[name])
