"""Numbers in bulk: blank-separated, or by Fortran columns where they touch; singly only to name a bad one."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from rocking.core.arrays import Floats
from rocking.errors import UnreadableRecord
from rocking.records.formats.source import Entry, Source

#: A number in a header, as a regular expression.
NUMBER = r"[+-]?(?:\d{1,20}\.?\d{0,20}|\.\d{1,20})(?:[EeDd][+-]?\d{1,4})?"

_ONE_NUMBER: Final = re.compile(rf"({NUMBER})\s*$")

#: Fortran writes double precision with a D.
_FORTRAN: Final = bytes.maketrans(b"Dd", b"EE")
_NUMERIC: Final = b"0123456789+-.eEdD"
_IS_OTHER: Final = bytes(0 if c in _NUMERIC + b" \t\n\v" else 1 for c in range(256))
#: Bytes at once: the numbers in them take some fifty times the memory while they are converted.
_CHUNK: Final = 2**18
_SPACE: Final = re.compile(rb"\s")
_LINE_END: Final = re.compile(rb"\n")
#: No number is written with more characters.
_LONGEST: Final = 400


class Stated(NamedTuple):
    """Number of values that a file states, the offset of the line that does, and how that is called."""

    values: float
    at: int
    by: str = "the header"


class Layout(NamedTuple):
    """Fortran columns such as 8F10.3: numbers per line and characters per number."""

    per_line: int
    width: int

    def fits(self, line: bytes) -> bool:
        """Whether a line is no longer than its columns, and without tabs."""
        return len(line) <= self.per_line * self.width and b"\t" not in line

    def fields(self, line: bytes) -> list[bytes]:
        """Return the fields of a line; the line as it is where it does not fit."""
        if not self.fits(line):
            return [line.strip()]
        return [line[i : i + self.width] for i in range(0, len(line), self.width)]


def numeric_end(source: Source, start: int) -> int:
    """Return the offset of the first line from `start` on that holds more than numbers, or the file's end."""
    data = source.data
    for begin in range(start, len(data), _CHUNK):
        position = data[begin : begin + _CHUNK].translate(_IS_OTHER).find(1)
        if position >= 0:
            return max(data.rfind(b"\n", start, begin + position) + 1, start)
    return len(data)


def read_values(
    source: Source, start: int, end: int, layout: Layout | None = None, stated: Stated | None = None
) -> Floats:
    """Return all numbers between the offsets `start` and `end`, which begin lines; as many as are stated."""
    values, reached = _in_blocks(source, start, end, _SPACE, lambda block: convert(block.split()))
    further = reached
    if layout is not None and (reached < end or (stated is not None and len(values) != stated.values)):
        columns, further = _in_blocks(source, start, end, _LINE_END, lambda block: _read_columns(block, layout))
        if further == end and (reached < end or stated is None or len(columns) == stated.values):
            values, reached = columns, end
    if reached < end:
        # The reading that got further is the one that the file was written for: its complaint helps.
        bad = [_first_bad(source, reached, None), *([_first_bad(source, further, layout)] if layout else [])]
        raise not_a_number(source, *max(bad, key=lambda each: each[1]))
    if stated is not None and len(values) != stated.values:
        raise wrong_count(
            source, stated.at, f"{stated.by} says {stated.values:.15g} values", len(values), stated.values
        )
    return values


def wrong_count(source: Source, at: int, stated: str, count: int, wanted: float) -> UnreadableRecord:
    """Return the error for more values, or fewer, than are stated at the offset `at`."""
    advice = "remove what does not belong to it" if count > wanted else "get the whole file again"
    return source.error(f"{stated} but {count} follow; {advice}, or correct that number", at)


def positive_numbers(source: Source, key: str, entry: Entry, pattern: re.Pattern[str] = _ONE_NUMBER) -> list[float]:
    """Return the numbers that a pattern finds in what a header has after a key; each must be positive."""
    found = pattern.match(entry.value)
    numbers = [parse(group.encode("latin-1")) or 0.0 for group in found.groups()] if found else [0.0]
    if not all(number > 0.0 for number in numbers):
        raise source.error(f"{key} is {entry.value!r}, which is no positive number; correct it", entry.at)
    return numbers


def bad_number(source: Source, start: int, end: int) -> UnreadableRecord:
    """Return the error for the line from `start` to `end`, which should hold numbers only and does not."""
    strange = (token for token in source.data[start:end].split() if token.strip(_NUMERIC))
    return not_a_number(source, next(strange), start)


def not_a_number(source: Source, token: bytes, at: int) -> UnreadableRecord:
    """Return the error for a piece of text that should be a finite number."""
    shown, number = repr(token[:40].decode("latin-1")), parse(token)
    if b"," in token and parse(token.replace(b",", b".")) is not None:
        return source.error(f"{shown} is not a number; write decimal points in place of commas", at)
    if number is None or np.isfinite(number):
        return source.error(f"{shown} is not a number; correct it or get the record again", at)
    return source.error(f"{shown} is not a finite number; a record needs a value at every instant", at)


def parse(token: bytes) -> float | None:
    """Return the number that `token` writes (D exponents too; perhaps not finite), or None."""
    if len(token) > _LONGEST or b"_" in token:
        return None
    try:
        return float(token.translate(_FORTRAN))
    except ValueError:
        return None


def convert(tokens: list[bytes]) -> Floats | None:
    """Return the numbers that the tokens write (D exponents too), or None if one is not a finite number."""
    if not tokens:
        return np.empty(0)
    joined = b"\n".join(tokens)
    if b"_" in joined or max(map(len, tokens)) > _LONGEST:
        return None
    if b"D" in joined or b"d" in joined:
        tokens = joined.translate(_FORTRAN).split(b"\n")
    try:
        values = np.array(tokens, dtype=np.float64)
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _in_blocks(
    source: Source, start: int, end: int, boundary: re.Pattern[bytes], read: Callable[[bytes], Floats | None]
) -> tuple[Floats, int]:
    """Numbers of the blocks that `read` accepts, up to the first other one, and where that begins; or the end."""
    parts = [np.empty(0)]
    while start < end:
        found = boundary.search(source.data, min(start + _CHUNK, end) - 1, end)
        stop = end if found is None else found.end()
        values = read(source.data[start:stop])
        if values is None:
            break
        parts.append(values)
        start = stop
    return np.concatenate(parts), start


def _read_columns(block: bytes, layout: Layout) -> Floats | None:
    """Numbers of lines cut into columns, of which the last of a line may be missing; None if a line does not fit."""
    lines = [line.rstrip() for line in block.split(b"\n")]
    if not all(map(layout.fits, lines)):
        return None
    return convert([field for line in lines for field in layout.fields(line)])


def _first_bad(source: Source, at: int, layout: Layout | None) -> tuple[bytes, int]:
    """Find the first piece of text from `at` on that is not a finite number, and where its line starts."""
    for line in source.data[at : at + 2 * _CHUNK].split(b"\n"):
        text = line.rstrip()
        for token in text.split() if layout is None else layout.fields(text):
            number = parse(token)
            if number is None or not np.isfinite(number) or not (layout is None or layout.fits(text)):
                return token, at
        at += len(line) + 1
    raise AssertionError("in a block that does not convert one number is bad")
