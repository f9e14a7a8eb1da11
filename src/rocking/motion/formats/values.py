"""Numbers in bulk: blank-separated first, by Fortran columns where they touch, singly only to name a bad one.

Numbers of one shape, which most are, take the short way of `aligned`, to the same result.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from rocking.arrays import Floats
from rocking.errors import UnreadableRecord
from rocking.motion.formats.aligned import FORTRAN_EXPONENT, Layout, read_aligned, read_columns
from rocking.motion.formats.source import Source

#: A number in a header, as a regular expression.
NUMBER = r"[+-]?(?:\d{1,20}\.?\d{0,20}|\.\d{1,20})(?:[EeDd][+-]?\d{1,4})?"

_NUMERIC = b"0123456789+-.eEdD"
_BLANK = b" \t\n\v"
_IS_OTHER = bytes(0 if c in _NUMERIC + _BLANK else 1 for c in range(256))
#: Bytes at once: the numbers in them take some fifty times the memory while they are converted.
_CHUNK = 2**20
_SPACE = re.compile(rb"\s")
_LINE_END = re.compile(rb"\n")

#: No number is written with more characters; longer ones are refused before they are converted.
_TOKEN_LIMIT = 400
_SHOWN = 40


class _BadNumberError(Exception):
    """A piece of text that is not a finite number, and where its line starts."""

    def __init__(self, token: bytes, at: int) -> None:
        super().__init__(token, at)
        self.token = token
        self.at = at


def numeric_end(source: Source, start: int) -> int:
    """Return the offset of the first line from `start` on that holds more than numbers, or the file's end."""
    data = source.data
    for begin in range(start, len(data), _CHUNK):
        position = data[begin : begin + _CHUNK].translate(_IS_OTHER).find(1)
        if position >= 0:
            return max(data.rfind(b"\n", start, begin + position) + 1, start)
    return len(data)


def read_values(
    source: Source, start: int, end: int, *, count: int | None = None, layout: Layout | None = None
) -> Floats:
    """Return all numbers between the offsets `start` and `end`, which begin lines.

    Numbers are taken as blank-separated; where that fails or does not give `count` of them, by the columns of
    `layout`, so that numbers which touch are split where the Fortran program that wrote them meant it.

    Raises
    ------
    UnreadableRecord
        Naming the line and the text that is not a finite number.
    """
    if layout is not None and count is not None:
        aligned = _read_aligned(source, start, end, layout)
        if aligned is not None and len(aligned) == count:
            return aligned
    try:
        free = _read(source, start, end, None)
    except _BadNumberError as bad:
        return _read_columns(source, start, end, layout, bad)
    if layout is None or count is None or len(free) == count:
        return free
    try:
        columns = _read(source, start, end, layout)
    except _BadNumberError:
        return free
    return columns if len(columns) == count else free


def rows_of_numbers(source: Source, start: int, columns: int, translation: bytes, longest: int) -> Floats | None:
    """Return all numbers from the offset `start` on, if all there is are rows of so many `columns`; else None.

    `translation` turns delimiters into blanks and decimal signs into points; no row is longer than `longest`.
    """
    parts = []
    for begin, stop in _chunks(source.data, start, len(source.data), _LINE_END):
        block = source.data[begin:stop]
        short = max(map(len, block.split(b"\n"))) <= longest
        values = read_columns(block.translate(translation), columns) if short else None
        if values is None:
            return None
        parts.append(values)
    return np.concatenate(parts) if parts else None


def expect(source: Source, at: int, count: int, values: Floats) -> Floats:
    """Return `values`, of which the header at the offset `at` says that there are `count`.

    Raises
    ------
    UnreadableRecord
        If there are more or fewer.
    """
    if len(values) != count:
        raise source.error(f"the header says {count} values but {len(values)} follow; get the whole file again", at)
    return values


def bad_number(source: Source, start: int, end: int) -> UnreadableRecord:
    """Return the error for the line from `start` to `end`, which should hold numbers only and does not."""
    strange = (token for token in source.data[start:end].split() if token.strip(_NUMERIC))
    return not_a_number(source, next(strange), start)


def not_a_number(source: Source, token: bytes, at: int) -> UnreadableRecord:
    """Return the error for a piece of text that should be a finite number."""
    shown, number = token[:_SHOWN].decode("latin-1"), parse(token)
    if b"," in token and parse(token.replace(b",", b".")) is not None:
        return source.error(f"{shown!r} is not a number; write decimal points in place of commas", at)
    if number is None or np.isfinite(number):
        return source.error(f"{shown!r} is not a number; correct it or get the record again", at)
    return source.error(f"{shown!r} is not a finite number; a record needs a value at every instant", at)


def parse(token: bytes) -> float | None:
    """Return the number that `token` writes (D exponents too; perhaps not finite), or None."""
    if len(token) > _TOKEN_LIMIT or b"_" in token:
        return None
    try:
        return float(token.translate(FORTRAN_EXPONENT))
    except ValueError:
        return None


def convert(tokens: list[bytes]) -> Floats | None:
    """Return the numbers that the tokens write (D exponents too), or None if one is not a finite number."""
    if not tokens:
        return np.empty(0)
    joined = b"\n".join(tokens)
    if b"_" in joined or max(map(len, tokens)) > _TOKEN_LIMIT:
        return None
    fortran = b"D" in joined or b"d" in joined
    try:
        values = np.array(joined.translate(FORTRAN_EXPONENT).split(b"\n") if fortran else tokens, dtype=np.float64)
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _read_columns(source: Source, start: int, end: int, layout: Layout | None, free: _BadNumberError) -> Floats:
    bad = free
    if layout is not None:
        try:
            return _read(source, start, end, layout)
        except _BadNumberError as columns:
            # The reading that got further is the one that the file was written for: its complaint helps.
            bad = max(free, columns, key=lambda each: each.at)
    raise not_a_number(source, bad.token, bad.at) from None


def _read(source: Source, start: int, end: int, layout: Layout | None) -> Floats:
    parts = []
    for begin, stop in _chunks(source.data, start, end, _SPACE if layout is None else _LINE_END):
        block = source.data[begin:stop]
        values = _convert_block(block, layout)
        if values is None:
            raise _first_bad(block, begin, layout)
        parts.append(values)
    return np.concatenate(parts) if parts else np.empty(0)


def _read_aligned(source: Source, start: int, end: int, layout: Layout) -> Floats | None:
    """Numbers in the columns of `layout`, all written alike; None if they are not."""
    parts = []
    for begin, stop in _chunks(source.data, start, end, _LINE_END):
        values = read_aligned(source.data[begin:stop], layout)
        if values is None:
            return None
        parts.append(values)
    return np.concatenate(parts) if parts else None


def _chunks(data: bytes, start: int, end: int, boundary: re.Pattern[bytes]) -> Iterator[tuple[int, int]]:
    while start < end:
        found = boundary.search(data, min(start + _CHUNK, end) - 1, end)
        stop = end if found is None else found.end()
        yield start, stop
        start = stop


def _convert_block(block: bytes, layout: Layout | None) -> Floats | None:
    if layout is None:
        aligned = read_aligned(block)
        return convert(block.split()) if aligned is None else aligned
    tokens = _fields(block, layout)
    return None if tokens is None else convert(tokens)


def _fields(block: bytes, layout: Layout) -> list[bytes] | None:
    """Cut all lines into columns, of which the last of a line may be missing; None if a line does not fit."""
    lines = [line.rstrip() for line in block.split(b"\n")]
    if not all(_fits(line, layout) for line in lines):
        return None
    padded = b"".join([line.ljust(layout.per_line * layout.width, b"\0") for line in lines])
    fields = np.frombuffer(padded, dtype=f"S{layout.width}")
    return list(fields[fields != b""].tolist())


def _fits(line: bytes, layout: Layout) -> bool:
    return len(line) <= layout.per_line * layout.width and b"\t" not in line


def _first_bad(block: bytes, begin: int, layout: Layout | None) -> _BadNumberError:
    at = begin
    for line in block.split(b"\n"):
        if layout is not None and not _fits(line.rstrip(), layout):
            return _BadNumberError(line.strip(), at)
        for token in line.split() if layout is None else _columns(line.rstrip(), layout.width):
            number = parse(token)
            if number is None or not np.isfinite(number):
                return _BadNumberError(token, at)
        at += len(line) + 1
    raise AssertionError("in a block that does not convert one number is bad")


def _columns(line: bytes, width: int) -> list[bytes]:
    return [line[i : i + width] for i in range(0, len(line), width)]
