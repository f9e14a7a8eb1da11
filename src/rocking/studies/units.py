"""Units of a study: grid cells, their size, computation and encoding."""

from __future__ import annotations

import functools
import hashlib
import itertools
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
from rocking.simulation.ensemble import VARIABLES, Product

#: All outcomes of a simulation, in the order of the encoding.
OUTCOMES: Final = tuple(VARIABLES)

#: Unit sizes are multiples of this number of blocks, which the engine integrates together.
_GROUP: Final = 512

#: Maximum number of simulations in a unit.
_LARGEST: Final = 1 << 18

#: Packing saves three quarters of the bytes, and takes half a microsecond for each simulation.
_LEVEL: Final = 1

#: Bytes of the hash at the end of a file.
_HASH: Final = hashlib.sha256().digest_size

#: Index of a unit along motions, scales, polarities and blocks.
Key = tuple[int, ...]


def sealed(data: bytes) -> bytes:
    """Return data with their hash."""
    return data + hashlib.sha256(data).digest()


def unsealed(data: bytes) -> bytes | None:
    """Return the data of `sealed`; None if any bit has changed."""
    return data[:-_HASH] if sealed(data[:-_HASH]) == data else None


@dataclass(frozen=True)
class UnitGrid:
    """Division of simulations (motions, scales, polarities, blocks) into units."""

    shape: tuple[int, ...]
    unit: tuple[int, ...]

    @functools.cached_property
    def cells(self) -> tuple[int, ...]:
        """Return the number of units along each axis."""
        return tuple(math.ceil(size / part) for size, part in zip(self.shape, self.unit, strict=True))

    def __len__(self) -> int:
        return math.prod(self.cells)

    def __iter__(self) -> Iterator[Key]:
        """Iterate over the keys of all units, the last axis fastest."""
        return itertools.product(*map(range, self.cells))

    def ranges(self, key: Key) -> tuple[slice, ...]:
        """Return the range of a unit along each axis."""
        axes = zip(key, self.unit, self.shape, strict=True)
        return tuple(slice(index * part, min(index * part + part, size)) for index, part, size in axes)

    def simulations(self, key: Key) -> int:
        """Count the simulations of a unit."""
        return math.prod(part.stop - part.start for part in self.ranges(key))


def name_of(key: Key) -> str:
    """Return the file name of a unit."""
    return "unit." + ".".join(map(str, key))


def unit_of(product: Product, unit_blocks: int | None) -> tuple[int, ...]:
    """Return the size of a unit for a number of blocks, or for about five seconds (pilot run)."""
    if unit_blocks is not None:
        width = checks.integer(unit_blocks, "unit_blocks", InvalidOption, minimum=_GROUP)
        if width % _GROUP:
            raise InvalidOption(f"{{}} must be a multiple of {_GROUP}, not {width}", "unit_blocks", value=unit_blocks)
        return 1, 1, 1, width
    motions, scales, polarities, count = product.shape
    some = product.bodies.select(np.linspace(0, count - 1, min(count, _GROUP)).astype(np.int64))
    motion = max(product.motions, key=lambda one: len(one.coefficients))
    setup = Setup(some, product.model, product.chattering, product.duration)
    task = Task(slice(None), motion, float(product.scales.factors(motion).max()))
    simulate_task(setup, task)  # loads the kernels
    start = time.perf_counter()
    simulate_task(setup, task)
    each = (time.perf_counter() - start) / len(some)
    # Limits the size from below and above.
    most = min(5.0 / each, math.prod(product.shape) / 32, _LARGEST)
    width = min(_GROUP * max(1, int(most) // _GROUP), count)
    left, held = most / width, []
    for size in (scales, polarities, motions):
        held.append(max(1, min(size, int(left))))
        left /= held[-1]
    return held[2], held[0], held[1], width


@functools.cache
def program() -> str:
    """Return an identifier shared by programs that compute the same bits."""
    return f"rocking {VERSION} (kernels {fingerprint()})"


@dataclass(frozen=True, eq=False)
class Work:
    """Complete input of a worker for a unit; factors have the shape (motions, scales, polarities)."""

    setup: Setup
    motions: tuple[Motion, ...]
    factors: Floats
    unit: tuple[int, ...]
    program: str = field(default_factory=program)


def compute(work: Work, cancelled: threading.Event | None = None) -> bytes:
    """Return the bytes of a unit, unless `cancelled`; raise a StudyError if the program differs."""
    if work.program != program():
        raise StudyError(f"the worker on {socket.gethostname()} has {program()}, the study needs {work.program}")
    # NaN where the unit contains fewer simulations than a full one
    values = np.full((len(OUTCOMES), *work.unit), np.nan)
    blocks = slice(0, len(work.setup.bodies))
    for m, s, k in np.ndindex(work.factors.shape):
        task = Task(blocks, work.motions[m], float(work.factors[m, s, k]))
        outcomes = simulate_task(work.setup, task, cancelled)
        for one, name in zip(values[:, m, s, k], OUTCOMES, strict=True):
            one[blocks] = outcomes[name]
    return sealed(zlib.compress(np.ascontiguousarray(values, "<f8").data, _LEVEL))


def decoded(data: bytes, unit: tuple[int, ...]) -> Floats | None:
    """Return the outcomes of a full unit, shape (outcomes, *unit); None if any bit has changed."""
    packed = unsealed(data)
    return None if packed is None else np.frombuffer(zlib.decompress(packed), "<f8").reshape(len(OUTCOMES), *unit)
