"""Conversion of numbers in bulk, of free form or in Fortran columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from decimal import Decimal
from typing import Final, NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.errors import RecordError
from rocking.records.formats.source import Source

#: Number in a header, as a regular expression.
NUMBER: Final = r"[+-]?(?:\d{1,20}\.?\d{0,20}|\.\d{1,20})(?:[EeDd][+-]?\d{1,4})?"

#: Fortran writes double precision with a D.
_FORTRAN_EXPONENTS: Final = bytes.maketrans(b"Dd", b"EE")
_NOT_NUMERIC: Final = bytes(0 if c in b"0123456789+-.eEdD \t\n\v" else 1 for c in range(256))
#: Bytes per block: numbers need some fifty times as much memory during conversion.
_BLOCK_SIZE: Final = 2**18
_SPACE: Final = re.compile(rb"\s")
_LINE_END: Final = re.compile(rb"\n")
#: Largest number of characters of a number.
_MAX_NUMBER_LENGTH: Final = 400
_LAYOUT: Final = re.compile(r"(?ia)\(\s*(\d{1,3})\s*[EFGI]\s*(\d{1,3})(?:\.\d+)?\s*\)|^(\d{1,3})x(\d{1,3})$")


def compute_rounding(text: str) -> float:
    """Return the largest error of the rounded number at the start of a text: half a unit of its last digit, or 3 %."""
    match = re.match(NUMBER, text)
    if match is None:
        return 0.0
    printed = Decimal(match[0].upper().replace("D", "E"))
    return min(float(f"0.5e{printed.as_tuple().exponent}"), 0.03 * abs(float(printed)))


class StatedCount(NamedTuple):
    """Number of values stated in a file."""

    number: float
    offset: int  # offset of its line
    max_surplus: float = 0.0  # number of values that may fill the last row or the last second

    def allows(self, count: int) -> bool:
        """Return whether this many values may follow."""
        return -0.5 < count - self.number < self.max_surplus + 0.5


class Layout(NamedTuple):
    """Fortran columns such as 8F10.3."""

    per_line: int  # numbers per line
    width: int  # characters per number

    @classmethod
    def find(cls, text: str) -> Layout | None:
        """Return the layout in a text such as "8x10" or "... Format: (8f9.6)", or None."""
        match = _LAYOUT.search(text)
        sizes = [int(size) for size in match.groups() if size] if match else []
        return cls(*sizes) if sizes and all(sizes) else None


def find_numeric_end(source: Source, start: int) -> int:
    """Return the offset of the first line from `start` that is not numeric, or the file's end."""
    data = source.data
    for block_start in range(start, len(data), _BLOCK_SIZE):
        position = data[block_start : block_start + _BLOCK_SIZE].translate(_NOT_NUMERIC).find(1)
        if position >= 0:
            return max(data.rfind(b"\n", start, block_start + position) + 1, start)
    return len(data)


def read_values(source: Source, start: int, end: int, layouts: Sequence[Layout], stated: StatedCount) -> Floats:
    """Return the numbers between the offsets of two lines, separated by blanks or in columns, as many as stated."""
    faults, counts = [], []
    for layout in (None, *layouts):
        values, values_end = _read_blocks(source, start, end, layout)
        if values_end < end:
            faults.append(_find_first_invalid(source, values_end, layout))
        elif stated.allows(len(values)):
            return values
        else:
            counts.append(len(values))
    if not counts:
        # The reading that got further has the helpful error message.
        raise invalid_number_error(source, *max(faults, key=lambda fault: fault[1]))
    advice = "remove the other values" if counts[-1] > stated.number else "download the complete file again"
    mismatch = f"the header specifies {stated.number:.15g} values, but {counts[-1]} follow"
    raise source.error(f"{mismatch}; {advice}, or correct that number", stated.offset)


def invalid_number_error(source: Source, token: bytes, offset: int) -> RecordError:
    """Return the error for text that should be a finite number."""
    token_text, number = repr(token[:40].decode("latin-1")), parse_token(token)
    if b"," in token and parse_token(token.replace(b",", b".")) is not None:
        return source.error(f"{token_text} is not a number; use a point as the decimal sign", offset)
    finite = "" if number is None or np.isfinite(number) else "finite "
    return source.error(f"{token_text} is not a {finite}number; correct it, or download the record again", offset)


def parse_token(token: bytes) -> float | None:
    """Return the number written by `token` (also with D exponent, possibly not finite), or None."""
    if len(token) > _MAX_NUMBER_LENGTH or b"_" in token:
        return None
    try:
        return float(token.translate(_FORTRAN_EXPONENTS))
    except ValueError:
        return None


def convert_tokens(tokens: list[bytes]) -> Floats | None:
    """Return the numbers written by the tokens (also with D exponents), or None unless all are finite."""
    if not tokens:
        return np.empty(0)
    joined = b"\n".join(tokens)
    if b"_" in joined or max(map(len, tokens)) > _MAX_NUMBER_LENGTH:
        return None
    if b"D" in joined or b"d" in joined:
        tokens = joined.translate(_FORTRAN_EXPONENTS).split(b"\n")
    try:
        values = np.array(tokens, dtype=np.float64)
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _read_blocks(source: Source, start: int, end: int, layout: Layout | None) -> tuple[Floats, int]:
    """Return the numbers of purely numeric blocks, and the offset of their end."""
    parts = [np.empty(0)]
    while start < end:
        boundary = (_LINE_END if layout else _SPACE).search(source.data, min(start + _BLOCK_SIZE, end) - 1, end)
        stop = end if boundary is None else boundary.end()
        values = convert_tokens(_split_tokens(source.data[start:stop], layout))
        if values is None:
            break
        parts.append(values)
        start = stop
    return np.concatenate(parts), start


def _split_tokens(text: bytes, layout: Layout | None) -> list[bytes]:
    """Split at blanks, or into columns, of which the last in a line may be missing, if the line fits."""
    if layout is None:
        return text.split()
    tokens, (per_line, width) = list[bytes](), layout
    for line in map(bytes.rstrip, text.split(b"\n")):
        is_fitting = len(line) <= per_line * width and b"\t" not in line
        tokens += [line[k : k + width] for k in range(0, len(line), width)] if is_fitting else [line.strip()]
    return tokens


def _find_first_invalid(source: Source, offset: int, layout: Layout | None) -> tuple[bytes, int]:
    """Find the first piece of text from `offset` that is not a finite number, and the start of its line."""
    for line in source.data[offset : offset + 2 * _BLOCK_SIZE].split(b"\n"):
        for token in _split_tokens(line, layout):
            if convert_tokens([token]) is None:
                return token, offset
        offset += len(line) + 1
    raise AssertionError("in a block that does not convert one number is bad")
