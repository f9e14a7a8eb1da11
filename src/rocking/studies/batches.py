"""Batches of a study: grid cells, their size, computation and encoding."""

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
from rocking.engine.tasks import Setup, Task, create_task, simulate_task, split_simulations
from rocking.errors import OptionError, StudyError
from rocking.kernels.compiled import fingerprint
from rocking.motion.motion import Motion
from rocking.simulation.ensemble import VARIABLES, SimulationProduct

#: All outcomes of a simulation, in the order of the encoding.
OUTCOMES: Final = tuple(VARIABLES)

#: Batch sizes are multiples of this number of blocks, which the engine integrates together.
_GROUP_SIZE: Final = 512

#: Maximum number of simulations in a batch.
_MAX_SIMULATIONS: Final = 1 << 18

#: Compression saves three quarters of the bytes and costs half a microsecond per simulation.
_COMPRESSION_LEVEL: Final = 1

#: Bytes of the hash at the end of a file.
_HASH_SIZE: Final = hashlib.sha256().digest_size

#: Index of a batch along motions, scales, polarities and blocks.
Key = tuple[int, ...]


def seal(data: bytes) -> bytes:
    """Append a hash to data."""
    return data + hashlib.sha256(data).digest()


def unseal(data: bytes) -> bytes | None:
    """Remove the hash of `seal` from data; return None if any bit has changed."""
    return data[:-_HASH_SIZE] if seal(data[:-_HASH_SIZE]) == data else None


@dataclass(frozen=True)
class BatchGrid:
    """Division of simulations (motions, scales, polarities, blocks) into batches."""

    shape: tuple[int, ...]
    batch_shape: tuple[int, ...]

    @functools.cached_property
    def cells(self) -> tuple[int, ...]:
        """Number of batches along each axis."""
        return tuple(math.ceil(size / part) for size, part in zip(self.shape, self.batch_shape, strict=True))

    def __len__(self) -> int:
        return math.prod(self.cells)

    def __iter__(self) -> Iterator[Key]:
        """Iterate over the keys of all batches, the last axis fastest."""
        return itertools.product(*map(range, self.cells))

    def ranges(self, key: Key) -> tuple[slice, ...]:
        """Return the range of a batch along each axis."""
        axes = zip(key, self.batch_shape, self.shape, strict=True)
        return tuple(slice(index * part, min(index * part + part, size)) for index, part, size in axes)

    def count_simulations(self, key: Key) -> int:
        """Count the simulations of a batch."""
        return math.prod(part.stop - part.start for part in self.ranges(key))


def format_key(key: Key) -> str:
    """Return the file name of a batch."""
    return "batch." + ".".join(map(str, key))


def choose_batch_shape(product: SimulationProduct, blocks_per_batch: int | None) -> tuple[int, ...]:
    """Choose the size of a batch for a number of blocks, or for about five seconds (pilot run)."""
    if blocks_per_batch is not None:
        width = checks.integer(blocks_per_batch, "blocks_per_batch", OptionError, minimum=_GROUP_SIZE)
        if width % _GROUP_SIZE:
            message = f"{{}} must be a multiple of {_GROUP_SIZE}, not {width}"
            raise OptionError(message, "blocks_per_batch", value=blocks_per_batch)
        return 1, 1, 1, width
    motion_count, scale_count, polarity_count, block_count = product.shape
    sample = product.bodies.select(np.linspace(0, block_count - 1, min(block_count, _GROUP_SIZE)).astype(np.int64))
    longest_motion = max(product.motions, key=lambda candidate: len(candidate.coefficients))
    setup = Setup(sample, product.model, product.chattering, product.duration, friction=product.friction)
    task = Task(slice(None), (longest_motion,), float(product.scales.factors(longest_motion).max()))
    simulate_task(setup, task)  # loads the kernels
    start = time.perf_counter()
    simulate_task(setup, task)
    seconds = (time.perf_counter() - start) / len(sample)
    # Limits the size from below and above.
    max_simulation_count = min(5.0 / seconds, math.prod(product.shape) / 32, _MAX_SIMULATIONS)
    width = min(_GROUP_SIZE * max(1, int(max_simulation_count) // _GROUP_SIZE), block_count)
    remaining, counts = max_simulation_count / width, []
    for count in (scale_count, polarity_count, motion_count):
        counts.append(max(1, min(count, int(remaining))))
        remaining /= counts[-1]
    return counts[2], counts[0], counts[1], width


@functools.cache
def identify_program() -> str:
    """Return the identifier of programs that compute the same bits."""
    return f"rocking {VERSION} (kernels {fingerprint()})"


@dataclass(frozen=True, eq=False)
class BatchInput:
    """Complete input of a worker for a batch; factors have the shape (motions, scales, polarities)."""

    setup: Setup
    motions: tuple[Motion, ...]
    factors: Floats
    batch_shape: tuple[int, ...]
    program: str = field(default_factory=identify_program)


def compute_batch(batch_input: BatchInput, cancelled: threading.Event | None = None) -> bytes:
    """Compute the bytes of a batch, unless `cancelled`; raise a StudyError if the program differs."""
    if batch_input.program != identify_program():
        worker = f"the worker on {socket.gethostname()} has {identify_program()}"
        raise StudyError(f"{worker}, the study requires {batch_input.program}")
    # NaN where the batch contains fewer simulations than a full one
    values = np.full((len(OUTCOMES), *batch_input.batch_shape), np.nan)
    shape = (*batch_input.factors.shape, len(batch_input.setup.bodies))
    for part in split_simulations(batch_input.motions, np.full(shape[0], math.prod(shape[1:]))):
        m, s, k, block = key = np.unravel_index(np.arange(part.start, part.stop), shape)
        task = create_task(block, batch_input.motions, m, batch_input.factors[m, s, k])
        outcomes = simulate_task(batch_input.setup, task, cancelled)
        for cells, name in zip(values, OUTCOMES, strict=True):
            cells[key] = outcomes[name]
    return seal(zlib.compress(np.ascontiguousarray(values, "<f8").data, _COMPRESSION_LEVEL))


def decode(data: bytes, batch_shape: tuple[int, ...]) -> Floats | None:
    """Decode the outcomes of a full batch, shape (outcomes, *batch_shape); return None if any bit has changed."""
    packed = unseal(data)
    return (
        None if packed is None else np.frombuffer(zlib.decompress(packed), "<f8").reshape(len(OUTCOMES), *batch_shape)
    )
