"""Units of a study: one cell of a regular grid each, how large it is, what it computes, and its bytes in the store."""

from __future__ import annotations

import functools
import gzip
import itertools
import json
import math
import socket
import threading
import time
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import VERSION
from rocking.engine.tasks import Setup, Task, simulate_task
from rocking.errors import InvalidOption, StudyError
from rocking.kernels.compiled import fingerprint
from rocking.motion.motion import Motion
from rocking.simulation.ensemble import Product

#: Units are multiples of so many blocks, which the engine takes through a motion together.
_GROUP: Final = 512

#: Simulations in one unit at most.
LARGEST: Final = 1 << 18

#: Checked, but not packed: packing would save two thirds of the bytes, and take 3 % of the time of the simulations.
_LEVEL: Final = 0

#: What gzip writes first: no name, no time, an unknown system. Any other byte there is damage.
_HEADER: Final = gzip.compress(b"", _LEVEL, mtime=0)[:10]

#: Index of a unit among the motions, scales, polarities and blocks.
Key = tuple[int, ...]


class DamagedUnit(Exception):
    """The bytes of a unit are not what was written."""


@dataclass(frozen=True)
class UnitGrid:
    """How simulations (motions, scales, polarities, blocks) are cut into units, and the outcomes that are kept."""

    shape: tuple[int, ...]
    unit: tuple[int, ...]
    outcomes: tuple[str, ...]

    @functools.cached_property
    def cells(self) -> tuple[int, ...]:
        """Numbers of units along the axes."""
        return tuple(math.ceil(size / part) for size, part in zip(self.shape, self.unit, strict=True))

    def __len__(self) -> int:
        return math.prod(self.cells)

    @property
    def total(self) -> int:
        """Number of simulations in all units."""
        return math.prod(self.shape)

    def __iter__(self) -> Iterator[Key]:
        """Give the keys of all units, the last axis first."""
        return itertools.product(*map(range, self.cells))

    def ranges(self, key: Key) -> tuple[slice, ...]:
        """Range of a unit along each axis."""
        starts = (index * part for index, part in zip(key, self.unit, strict=True))
        ends = zip(starts, self.unit, self.shape, strict=True)
        return tuple(slice(start, min(start + part, size)) for start, part, size in ends)

    def counts(self, key: Key) -> tuple[int, ...]:
        """Size of a unit along each axis."""
        return tuple(part.stop - part.start for part in self.ranges(key))

    def simulations(self, key: Key) -> int:
        """Count the simulations of a unit."""
        return math.prod(self.counts(key))

    def metadata(self) -> bytes:
        """Metadata of the array as Zarr 3 has it: one chunk a unit, in flat keys."""
        about = {
            "zarr_format": 3,
            "node_type": "array",
            "shape": [len(self.outcomes), *self.shape],
            "data_type": "float64",
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [len(self.outcomes), *self.unit]}},
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "."}},
            "fill_value": "NaN",
            "codecs": [
                {"name": "bytes", "configuration": {"endian": "little"}},
                {"name": "gzip", "configuration": {"level": _LEVEL}},
            ],
            "dimension_names": ["outcome", "motion", "scale", "polarity", "block"],
            "attributes": {"outcomes": list(self.outcomes)},
        }
        return json.dumps(about, indent=2).encode()


def name_of(key: Key) -> str:
    """Name of a unit's file in the store."""
    return "c.0." + ".".join(map(str, key))


def width_of(unit_blocks: int) -> int:
    """Return the number of blocks of a unit, checked."""
    width = checks.whole(unit_blocks, "unit_blocks", InvalidOption, least=_GROUP)
    if width % _GROUP:
        raise InvalidOption(f"{{}} must be a multiple of {_GROUP}, not {width}", "unit_blocks", value=unit_blocks)
    return width


def fitting_unit(product: Product) -> tuple[int, int, int, int]:
    """Units that take about five seconds, by a pilot under the longest motion, and neither too few nor too large."""
    motions, scales, polarities, count = product.shape
    some = product.bodies.select(np.linspace(0, count - 1, min(count, _GROUP)).astype(np.int64))
    motion = max(product.motions, key=lambda one: len(one.coefficients))
    setup = Setup(some, product.model, product.treatment, product.duration)
    task = Task(slice(None), motion, float(product.scales.factors(motion).max()))
    simulate_task(setup, task)  # loads the kernels
    start = time.perf_counter()
    simulate_task(setup, task)
    each = (time.perf_counter() - start) / len(some)
    most = min(5.0 / each, math.prod(product.shape) / 32, LARGEST)
    width = min(_GROUP * max(1, int(most) // _GROUP), count)
    left = most / width
    held = []
    for size in (scales, polarities, motions):
        held.append(max(1, min(size, int(left))))
        left /= held[-1]
    return held[2], held[0], held[1], width


@functools.cache
def program() -> str:
    """Name what computes here, to the last bit."""
    return f"rocking {VERSION} (kernels {fingerprint()})"


@dataclass(frozen=True, eq=False)
class Work:
    """All that a worker needs for a unit; factors have the shape (motions, scales, polarities)."""

    setup: Setup
    motions: tuple[Motion, ...]
    factors: Floats
    unit: tuple[int, ...]
    outcomes: tuple[str, ...]
    program: str = field(default_factory=program)


def compute(work: Work, cancelled: threading.Event | None = None) -> bytes:
    """Simulate a unit and return its bytes, unless `cancelled`; a StudyError if the program here is another one."""
    if work.program != program():
        raise StudyError(f"the worker on {socket.gethostname()} has {program()}, the study needs {work.program}")
    # NaN where the unit holds fewer simulations than a full one.
    values = np.full((len(work.outcomes), *work.unit), np.nan)
    blocks = slice(0, len(work.setup.bodies))
    for m, s, k in np.ndindex(work.factors.shape):
        task = Task(blocks, work.motions[m], float(work.factors[m, s, k]))
        outcomes = simulate_task(work.setup, task, cancelled)
        for one, name in zip(values[:, m, s, k], work.outcomes, strict=True):
            one[blocks] = outcomes[name]
    return encoded(values)


def encoded(values: Floats) -> bytes:
    """Return the bytes of the outcomes of a full unit."""
    return gzip.compress(np.ascontiguousarray(values, "<f8").data, _LEVEL, mtime=0)


def decoded(data: bytes, names: tuple[str, ...], counts: tuple[int, ...], unit: tuple[int, ...]) -> dict[str, Floats]:
    """Outcomes of a unit by their names, each of shape (*counts); a DamagedUnit for any changed bit and any cut."""
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
