"""Units of a study: one cell of a regular grid each, how large it is, what it computes, and its bytes in the folder."""

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

#: All outcomes of a simulation, in the order in which a unit holds them.
OUTCOMES: Final = tuple(VARIABLES)

#: Units are multiples of so many blocks, which the engine takes through a motion together.
_GROUP: Final = 512

#: Simulations in one unit at most.
_LARGEST: Final = 1 << 18

#: Packing saves three quarters of the bytes, and takes half a microsecond for each simulation.
_LEVEL: Final = 1

#: Bytes of the hash at the end of a file.
_HASH: Final = hashlib.sha256().digest_size

#: Index of a unit among the motions, scales, polarities and blocks.
Key = tuple[int, ...]


def sealed(data: bytes) -> bytes:
    """Return data with their hash."""
    return data + hashlib.sha256(data).digest()


def unsealed(data: bytes) -> bytes | None:
    """Return what was sealed; None where any bit of it changed."""
    return data[:-_HASH] if sealed(data[:-_HASH]) == data else None


@dataclass(frozen=True)
class UnitGrid:
    """How simulations (motions, scales, polarities, blocks) are cut into units."""

    shape: tuple[int, ...]
    unit: tuple[int, ...]

    @functools.cached_property
    def cells(self) -> tuple[int, ...]:
        """Numbers of units along the axes."""
        return tuple(math.ceil(size / part) for size, part in zip(self.shape, self.unit, strict=True))

    def __len__(self) -> int:
        return math.prod(self.cells)

    def __iter__(self) -> Iterator[Key]:
        """Give the keys of all units, the last axis first."""
        return itertools.product(*map(range, self.cells))

    def ranges(self, key: Key) -> tuple[slice, ...]:
        """Range of a unit along each axis."""
        axes = zip(key, self.unit, self.shape, strict=True)
        return tuple(slice(index * part, min(index * part + part, size)) for index, part, size in axes)

    def simulations(self, key: Key) -> int:
        """Count the simulations of a unit."""
        return math.prod(part.stop - part.start for part in self.ranges(key))


def name_of(key: Key) -> str:
    """Name of a unit's file."""
    return "unit." + ".".join(map(str, key))


def unit_of(product: Product, unit_blocks: int | None) -> tuple[int, ...]:
    """Return the size of a unit along the axes: so many blocks, or what takes about five seconds by a pilot."""
    if unit_blocks is not None:
        width = checks.whole(unit_blocks, "unit_blocks", InvalidOption, least=_GROUP)
        if width % _GROUP:
            raise InvalidOption(f"{{}} must be a multiple of {_GROUP}, not {width}", "unit_blocks", value=unit_blocks)
        return 1, 1, 1, width
    motions, scales, polarities, count = product.shape
    some = product.bodies.select(np.linspace(0, count - 1, min(count, _GROUP)).astype(np.int64))
    motion = max(product.motions, key=lambda one: len(one.coefficients))
    setup = Setup(some, product.model, product.treatment, product.duration)
    task = Task(slice(None), motion, float(product.scales.factors(motion).max()))
    simulate_task(setup, task)  # loads the kernels
    start = time.perf_counter()
    simulate_task(setup, task)
    each = (time.perf_counter() - start) / len(some)
    # Neither too few nor too large.
    most = min(5.0 / each, math.prod(product.shape) / 32, _LARGEST)
    width = min(_GROUP * max(1, int(most) // _GROUP), count)
    left, held = most / width, []
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
    program: str = field(default_factory=program)


def compute(work: Work, cancelled: threading.Event | None = None) -> bytes:
    """Simulate a unit and return its bytes, unless `cancelled`; a StudyError if the program here is another one."""
    if work.program != program():
        raise StudyError(f"the worker on {socket.gethostname()} has {program()}, the study needs {work.program}")
    # NaN where the unit holds fewer simulations than a full one.
    values = np.full((len(OUTCOMES), *work.unit), np.nan)
    blocks = slice(0, len(work.setup.bodies))
    for m, s, k in np.ndindex(work.factors.shape):
        task = Task(blocks, work.motions[m], float(work.factors[m, s, k]))
        outcomes = simulate_task(work.setup, task, cancelled)
        for one, name in zip(values[:, m, s, k], OUTCOMES, strict=True):
            one[blocks] = outcomes[name]
    return sealed(zlib.compress(np.ascontiguousarray(values, "<f8").data, _LEVEL))


def decoded(data: bytes, unit: tuple[int, ...]) -> Floats | None:
    """Outcomes of a full unit, shape (outcomes, *unit); None where any bit of it changed."""
    packed = unsealed(data)
    return None if packed is None else np.frombuffer(zlib.decompress(packed), "<f8").reshape(len(OUTCOMES), *unit)
