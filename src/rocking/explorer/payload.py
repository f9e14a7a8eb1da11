"""Data for the page, plain values and arrays, and their encoding."""

from __future__ import annotations

import functools
import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from typing import Any

import numpy as np

from rocking.core.arrays import Floats
from rocking.core.tables import to_plain


@dataclass(frozen=True, eq=False)
class Payload:
    """Plain values, and arrays of floats by name."""

    header: dict[str, Any]
    arrays: dict[str, Floats] = field(default_factory=dict)


def pack(payload: Payload) -> bytes:
    """Return a payload as bytes: length of the header (4 bytes), JSON header, arrays of doubles aligned to 8 bytes.

    Examples
    --------
    >>> import numpy as np
    >>> packed = pack(Payload({"a": 1}, {"b": np.array([1.0])}))
    >>> len(packed) % 8, packed[4:20]
    (0, b'{"a":1,"arrays":')
    """
    lengths = {name: values.size for name, values in payload.arrays.items()}
    header = json.dumps(
        {**to_plain(payload.header), "arrays": lengths}, separators=(",", ":"), allow_nan=False
    ).encode()
    header += b" " * (-(4 + len(header)) % 8)
    arrays = (np.ascontiguousarray(values, "<f8").tobytes() for values in payload.arrays.values())
    return b"".join([struct.pack("<I", len(header)), header, *arrays])


def fill_page(page: str, texts: Mapping[str, Any]) -> str:
    r"""Return the page with all texts for its scripts.

    Examples
    --------
    >>> fill_page("<script>TEXTS</script>", {"field.p": "Frequency</script>"})
    '<script>{"field.p": "Frequency\\u003c/script>"}</script>'
    """
    return page.replace("TEXTS", json.dumps(texts, ensure_ascii=False).replace("<", "\\u003c"), 1)


@functools.cache
def load_english_texts() -> dict[str, str]:
    """Return the English texts by key."""
    file = resources.files("rocking.explorer") / "page" / "texts.json"
    texts: dict[str, str] = json.loads(file.read_text("utf-8"))
    return texts
