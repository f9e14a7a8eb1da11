"""What is sent to the page: plain values and arrays, and their bytes."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rocking.core.arrays import Floats
from rocking.core.tables import plain


@dataclass(frozen=True, eq=False)
class Payload:
    """What is sent: plain values, and arrays of floats by name."""

    header: dict[str, Any]
    arrays: dict[str, Floats] = field(default_factory=dict)


def pack(payload: Payload) -> bytes:
    """Return a payload as bytes: length of the header (4 bytes), header as JSON, arrays of doubles from multiples of 8.

    Examples
    --------
    >>> import numpy as np
    >>> packed = pack(Payload({"a": 1}, {"b": np.array([1.0])}))
    >>> len(packed) % 8, packed[4:20]
    (0, b'{"a":1,"arrays":')
    """
    lengths = {name: values.size for name, values in payload.arrays.items()}
    header = json.dumps({**plain(payload.header), "arrays": lengths}, separators=(",", ":"), allow_nan=False).encode()
    header += b" " * (-(4 + len(header)) % 8)
    arrays = (np.ascontiguousarray(values, "<f8").tobytes() for values in payload.arrays.values())
    return b"".join([struct.pack("<I", len(header)), header, *arrays])
