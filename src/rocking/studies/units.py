"""Units of a study: one cell of a regular grid each, what it computes, and its bytes in the store."""

from __future__ import annotations

import gzip
import itertools
import json
import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats
from rocking.engine import OUTCOME, Setup, Task, simulate_task
from rocking.motion.motion import Motion
from rocking.product import VARIABLES

#: Outcomes of a simulation, in the order in which the array holds them.
OUTCOMES: Final = tuple(VARIABLES)

#: What gzip writes first: no name, no time, an unknown system. Any other byte there is damage.
_HEADER: Final = gzip.compress(b"", 1, mtime=0)[:10]
_LEVEL: Final = 1

Key = tuple[int, int, int, int]


class DamagedUnit(Exception):
    """The bytes of a unit are not what was written."""


@dataclass(frozen=True)
class Grid:
    """How the simulations are cut into units.

    Attributes
    ----------
    shape : (m, s, k, n)
        Numbers of motions, scales, polarities and blocks.
    blocks : int
        Blocks of a unit; the last of a row may hold fewer.
    """

    shape: tuple[int, int, int, int]
    blocks: int

    @property
    def cells(self) -> tuple[int, int, int, int]:
        """Numbers of units along motions, scales, polarities and blocks."""
        return *self.shape[:3], math.ceil(self.shape[3] / self.blocks)

    def __len__(self) -> int:
        return math.prod(self.cells)

    def __iter__(self) -> Iterator[Key]:
        """Give the keys of all units, blocks first."""
        m, s, k, b = self.cells
        return itertools.product(range(m), range(s), range(k), range(b))

    def block_range(self, key: Key) -> slice:
        """Blocks of a unit."""
        start = key[3] * self.blocks
        return slice(start, min(start + self.blocks, self.shape[3]))

    def simulations(self, key: Key) -> int:
        """Count the simulations of a unit."""
        part = self.block_range(key)
        return int(part.stop - part.start)

    def metadata(self) -> str:
        """Metadata of the array as Zarr 3 has it: one chunk a unit, in flat keys."""
        return json.dumps(
            {
                "zarr_format": 3,
                "node_type": "array",
                "shape": [len(OUTCOMES), *self.shape],
                "data_type": "float64",
                "chunk_grid": {
                    "name": "regular",
                    "configuration": {"chunk_shape": [len(OUTCOMES), 1, 1, 1, self.blocks]},
                },
                "chunk_key_encoding": {"name": "default", "configuration": {"separator": "."}},
                "fill_value": "NaN",
                "codecs": [
                    {"name": "bytes", "configuration": {"endian": "little"}},
                    {"name": "gzip", "configuration": {"level": _LEVEL}},
                ],
                "dimension_names": ["outcome", "motion", "scale", "polarity", "block"],
                "attributes": {"outcomes": list(OUTCOMES)},
            },
            indent=2,
        )


def name_of(key: Key) -> str:
    """Name of a unit's object in the store."""
    return "c.0." + ".".join(map(str, key))


def key_of(name: str) -> Key | None:
    """Key of a unit from the name of its object; None of any other object."""
    parts = name.split(".")
    if len(parts) != 6 or parts[:2] != ["c", "0"] or not all(part.isdecimal() for part in parts[2:]):
        return None
    m, s, k, b = map(int, parts[2:])
    return m, s, k, b


def compute(setup: Setup, motion: Motion, factor: float, width: int) -> bytes:
    """Simulate a unit, wherever its inputs have been sent, and return its bytes.

    Parameters
    ----------
    setup : Setup
        The unit's blocks, and how to compute.
    motion, factor
        What shakes them.
    width : int
        Blocks of a full unit.
    """
    return encoded(simulate_task(setup, Task(slice(0, len(setup.blocks)), motion, factor)), width)


def encoded(outcomes: NDArray[np.void], width: int) -> bytes:
    """Bytes of a unit: outcomes by blocks, padded with NaN to the width of a full one."""
    values = np.full((len(OUTCOMES), width), np.nan)
    for row, name in zip(values, OUTCOMES, strict=True):
        row[: len(outcomes)] = outcomes[name]
    return gzip.compress(values.astype("<f8").tobytes(), _LEVEL, mtime=0)


def decoded(data: bytes, count: int, width: int) -> Floats:
    """Outcomes of a unit, shape (outcomes, count).

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
    if len(raw) != 8 * len(OUTCOMES) * width:
        raise DamagedUnit(f"it holds {len(raw)} bytes, not {8 * len(OUTCOMES) * width}")
    values = np.frombuffer(raw, "<f8").reshape(len(OUTCOMES), width).astype(np.float64)
    return values[:, :count]


def exact(name: str, values: Floats) -> NDArray[Any]:
    """Values of an outcome in its own type."""
    return values.astype(OUTCOME[name])
