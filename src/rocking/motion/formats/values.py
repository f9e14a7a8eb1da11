"""Numbers in bulk: blank-separated first, by Fortran columns where they touch, singly only to name a bad one.

Numbers of one shape, which most are, take a short way, in columns of bytes, to the same result.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats, Integers
from rocking.errors import UnreadableRecord
from rocking.motion.formats.source import Entry, Source

#: Characters of one field: one row for each of its columns, one column for each line of the file.
_Field = NDArray[np.uint8]

#: Whole numbers and powers of ten up to these are doubles.
_LARGEST_INTEGER: Final = 2**53
_LARGEST_POWER: Final = 22
_POWERS: Final = 10.0 ** np.arange(_LARGEST_POWER + 1)

#: Digits that an integer of 64 bits holds.
_MOST_DIGITS: Final = 18
_SHORT_DIGITS: Final = 9

#: Wider fields are not made of one number; they are left to be refused.
_WIDEST: Final = 64

_NEWLINE, _BLANK, _PLUS, _MINUS, _POINT, _ZERO = b"\n +-.0"
#: What does not make the shape of a number: signs and blanks before it are as good as digits.
_SHAPE: Final = bytes.maketrans(b" +-123456789", b"000000000000")

#: Fortran writes double precision with a D.
FORTRAN_EXPONENT: Final = bytes.maketrans(b"Dd", b"EE")

_TOKEN: Final = re.compile(rb"[^ ]+")
_EXPONENT: Final = re.compile(rb"[EeDd][+-]\d{1,3}$")


class Stated(NamedTuple):
    """How many numbers a file says that it holds, the offset of the line that does, and what is said to do so."""

    values: float
    at: int
    by: str = "the header"


class Layout(NamedTuple):
    """Fortran columns such as 8F10.3: numbers per line and characters per number."""

    per_line: int
    width: int


def read_aligned(block: bytes, layout: Layout | None = None) -> Floats | None:
    """Return all numbers of lines that are written alike, the last of which may be shorter; None if they are not so.

    Numbers end where those of the first line do, with blanks between them; or where the columns of a layout do. There
    they may touch if each has a decimal point, for what touches then is no number by itself.
    """
    body, newline, last = block.rstrip().rpartition(b"\n")
    tokens = last.split() if layout is None else _columns(last, layout)
    rest = convert(tokens) if tokens else None
    if rest is None or not newline:
        return rest
    body += newline
    length = body.find(newline) + 1
    first = body[: length - 1].rstrip(b" ")
    ends = [found.end() for found in _TOKEN.finditer(first)] if layout is None else _fixed_ends(first, layout)
    if not ends or len(body) % length or max(np.diff(ends, prepend=0)) > _WIDEST:
        return None
    lines = np.frombuffer(body, dtype=np.uint8).reshape(-1, length)
    starts = [0, *ends[:-1]]
    gaps = [] if layout is not None else starts[1:]
    if np.any(lines[:, -1] != _NEWLINE) or np.any(lines[:, [*gaps, *range(ends[-1], length - 1)]] != _BLANK):
        return None
    numbers = np.empty((len(lines), len(ends)))
    for fields in _groups(starts, ends, first):
        start, end = starts[fields[0]], ends[fields[0]]
        rows = np.stack([lines[:, starts[k] : ends[k]] for k in fields], axis=1).reshape(-1, end - start)
        values = _numbers(np.ascontiguousarray(rows.T), first[start:end])
        if values is None:
            return None
        numbers[:, fields] = values.reshape(-1, len(fields))
    return np.concatenate([numbers.ravel(), rest])


def read_columns(block: bytes, count: int) -> Floats | None:
    """Return the numbers of lines of `count` numbers each, row by row; blanks between them may vary.

    None if a line holds more or fewer pieces of text, or the numbers of a column do not have the same decimals.
    """
    text = np.frombuffer(b" " * (_WIDEST - 1) + b"\n" + block.rstrip() + b"\n", dtype=np.uint8)
    line_ends = np.flatnonzero(text == _NEWLINE)
    visible = text > _BLANK
    changes = visible[1:] != visible[:-1]
    if np.count_nonzero(changes) != 2 * count * (len(line_ends) - 1):
        return None
    edges = np.flatnonzero(changes) + 1
    starts, ends = edges[0::2].reshape(-1, count), edges[1::2].reshape(-1, count)
    if np.any(starts[:, 0] < line_ends[:-1]) or np.any(ends[:, -1] > line_ends[1:]):
        return None
    columns = [_right_aligned(text, starts[:, k], ends[:, k]) for k in range(count)]
    numbers = [None if column is None else _numbers(column, column[:, 0].tobytes()) for column in columns]
    found = [each for each in numbers if each is not None]
    return np.column_stack(found).ravel() if len(found) == count else None


def _right_aligned(text: NDArray[np.uint8], starts: Integers, ends: Integers) -> _Field | None:
    """Pieces of text as one field, blanks before the shorter ones; None if one is too long."""
    lengths = ends - starts
    width = int(lengths.max())
    if width > _WIDEST:
        return None
    rows = np.lib.stride_tricks.sliding_window_view(text, width)[ends - width]
    field = np.ascontiguousarray(rows.T)
    field[np.arange(width)[:, np.newaxis] < width - lengths] = _BLANK
    return field


def _fixed_ends(first: bytes, layout: Layout) -> list[int]:
    """Return where the fields end, if they fill the line and each has its point."""
    count, rest = divmod(len(first), layout.width)
    ends = [(k + 1) * layout.width for k in range(count)]
    pointed = all(b"." in first[end - layout.width : end] for end in ends)
    return ends if rest == 0 and count <= layout.per_line and pointed else []


def _groups(starts: list[int], ends: list[int], first: bytes) -> list[list[int]]:
    """Fields of the first line by their shape: width, and places of point and exponent."""
    groups: dict[bytes, list[int]] = {}
    for k, (start, end) in enumerate(zip(starts, ends, strict=True)):
        groups.setdefault(first[start:end].translate(_SHAPE), []).append(k)
    return list(groups.values())


def _numbers(field: _Field, pattern: bytes) -> Floats | None:
    """Numbers of one field on all lines, if they are written like `pattern`: point and exponent in its columns."""
    exponent = _EXPONENT.search(pattern)
    stop = exponent.start() if exponent else len(pattern)
    point = pattern.find(b".", 0, stop)
    whole, fraction = (stop, stop) if point < 0 else (point, point + 1)
    before, after, powers = _leading(field[:whole]), _digits(field[fraction:stop]), _powers(field[stop:])
    if before is None or after is None or powers is None or np.any(field[whole:fraction] != _POINT):
        return None
    digits = np.concatenate([before, after])
    # A field of blanks or a sign alone is no number; a digit after the point makes it one.
    if len(digits) > _MOST_DIGITS or (fraction == stop and np.any(field[:whole][-1:] < _ZERO)):
        return None
    integers, powers = _integers(digits), powers - len(after)
    factors = _POWERS[np.minimum(np.abs(powers), _LARGEST_POWER)]
    magnitudes = np.where(powers < 0, integers / factors, integers * factors)
    numbers = np.where(np.any(field[:whole] == _MINUS, axis=0), -magnitudes, magnitudes)
    twice_rounded = (integers > _LARGEST_INTEGER) | (np.abs(powers) > _LARGEST_POWER)
    numbers[twice_rounded] = [float(text.tobytes().translate(FORTRAN_EXPONENT)) for text in field.T[twice_rounded]]
    return numbers if np.isfinite(numbers).all() else None


def _leading(columns: _Field) -> NDArray[np.uint8] | None:
    """Digits before the point, zero for blanks and a sign before them; None if anything else stands there."""
    begun = np.zeros(columns.shape[1], dtype=np.bool_)
    digits = np.zeros_like(columns)
    for k, column in enumerate(columns):
        is_digit = column - np.uint8(_ZERO) <= 9
        before = (column == _BLANK) | (column == _PLUS) | (column == _MINUS)
        if np.any(~is_digit & (begun | ~before)):
            return None
        begun |= column != _BLANK
        digits[k] = (column - np.uint8(_ZERO)) * is_digit
    return digits


def _digits(columns: _Field) -> NDArray[np.uint8] | None:
    digits = columns - np.uint8(_ZERO)
    return None if np.any(digits > 9) else digits


def _powers(columns: _Field) -> Integers | None:
    """Powers of ten in the columns of an exponent: a letter, a sign, digits; zero where there are no columns."""
    if not len(columns):
        return np.zeros(1, dtype=np.int64)
    letter, sign, digits = columns[0], columns[1], _digits(columns[2:])
    if digits is None or np.any(letter != letter[0]) or np.any((sign != _PLUS) & (sign != _MINUS)):
        return None
    return np.where(sign == _MINUS, -1, 1) * _integers(digits)


def _integers(digits: NDArray[np.uint8]) -> Integers:
    """Whole numbers from their digits, nine of them at a time, which 32 bits hold."""
    numbers = np.zeros(digits.shape[1], dtype=np.int64)
    for begin in range(0, len(digits), _SHORT_DIGITS):
        part = np.zeros(digits.shape[1], dtype=np.uint32)
        for digit in digits[begin : begin + _SHORT_DIGITS]:
            part *= np.uint32(10)
            part += digit
        numbers = numbers * 10 ** len(digits[begin : begin + _SHORT_DIGITS]) + part
    return numbers


#: A number in a header, as a regular expression.
NUMBER = r"[+-]?(?:\d{1,20}\.?\d{0,20}|\.\d{1,20})(?:[EeDd][+-]?\d{1,4})?"

_ONE_NUMBER: Final = re.compile(rf"({NUMBER})\s*$")

_NUMERIC = b"0123456789+-.eEdD"
_BLANKS = b" \t\n\v"
_IS_OTHER = bytes(0 if c in _NUMERIC + _BLANKS else 1 for c in range(256))
#: Bytes at once: the numbers in them take some fifty times the memory while they are converted.
_CHUNK = 2**18
_SPACE = re.compile(rb"\s")
_LINE_END = re.compile(rb"\n")

#: No number is written with more characters; longer ones are refused before they are converted.
_TOKEN_LIMIT = 400
_SHOWN = 40


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
    """Return all numbers between the offsets `start` and `end`, which begin lines; as many as are stated.

    Numbers are taken as blank-separated; where that fails or does not give so many of them, by the columns of
    `layout`, so that numbers which touch are split where the Fortran program that wrote them meant it.
    """
    count = None if stated is None else stated.values
    if layout is not None and count is not None:
        values, reached = _in_blocks(source, start, end, _LINE_END, lambda block: read_aligned(block, layout))
        if reached == end and len(values) == count:
            return values
    values, reached = _in_blocks(source, start, end, _SPACE, _read_separated)
    further = reached
    if layout is not None and (reached < end or count not in (None, len(values))):
        columns, further = _in_blocks(source, start, end, _LINE_END, lambda block: _read_columns(block, layout))
        if further == end and (reached < end or len(columns) == count):
            values, reached = columns, end
    if reached < end:
        # The reading that got further is the one that the file was written for: its complaint helps.
        bad = [_first_bad(source, reached, None), *([_first_bad(source, further, layout)] if layout else [])]
        raise not_a_number(source, *max(bad, key=lambda each: each[1]))
    if stated is not None and len(values) != stated.values:
        what = f"{stated.by} says {stated.values:.15g} values"
        raise wrong_count(source, stated.at, what, len(values), more=len(values) > stated.values)
    return values


def rows_of_numbers(source: Source, start: int, columns: int, translation: bytes, longest: int) -> Floats | None:
    """Return all numbers from the offset `start` on, if all there is are rows of so many `columns`; else None.

    `translation` turns delimiters into blanks and decimal signs into points; no row is longer than `longest`.
    """

    def read(block: bytes) -> Floats | None:
        short = max(map(len, block.split(b"\n"))) <= longest
        return read_columns(block.translate(translation), columns) if short else None

    values, reached = _in_blocks(source, start, len(source.data), _LINE_END, read)
    return values if reached == len(source.data) else None


def wrong_count(source: Source, at: int, stated: str, found: int, *, more: bool) -> UnreadableRecord:
    """Return the error for more values, or fewer, than are stated at the offset `at`."""
    advice = "remove what does not belong to it" if more else "get the whole file again"
    return source.error(f"{stated} but {found} follow; {advice}, or correct that number", at)


def positive_numbers(source: Source, key: str, entry: Entry, pattern: re.Pattern[str] = _ONE_NUMBER) -> list[float]:
    """Return the numbers that a pattern finds in what a header has after a key; each must be positive."""
    found = pattern.match(entry.value)
    numbers = [parse(group.encode("latin-1")) for group in found.groups()] if found else []
    positive = [number for number in numbers if number is not None and number > 0.0]
    if not positive or len(positive) < len(numbers):
        raise source.error(f"{key} is {entry.value!r}, which is no positive number; correct it", entry.at)
    return positive


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


def _in_blocks(
    source: Source, start: int, end: int, boundary: re.Pattern[bytes], read: Callable[[bytes], Floats | None]
) -> tuple[Floats, int]:
    """Numbers of the blocks that `read` takes, up to the first that it does not, and where that begins; or the end."""
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


def _read_separated(block: bytes) -> Floats | None:
    aligned = read_aligned(block)
    return convert(block.split()) if aligned is None else aligned


def _read_columns(block: bytes, layout: Layout) -> Floats | None:
    """Numbers of lines cut into columns, of which the last of a line may be missing; None if a line does not fit."""
    lines = [line.rstrip() for line in block.split(b"\n")]
    if not all(_fits(line, layout) for line in lines):
        return None
    padded = b"".join([line.ljust(layout.per_line * layout.width, b"\0") for line in lines])
    fields = np.frombuffer(padded, dtype=f"S{layout.width}")
    return convert(list(fields[fields != b""].tolist()))


def _fits(line: bytes, layout: Layout) -> bool:
    return len(line) <= layout.per_line * layout.width and b"\t" not in line


def _columns(line: bytes, layout: Layout) -> list[bytes]:
    """Fields of a line; the line as it is where it does not fit."""
    if not _fits(line, layout):
        return [line.strip()]
    return [line[i : i + layout.width] for i in range(0, len(line), layout.width)]


def _first_bad(source: Source, at: int, layout: Layout | None) -> tuple[bytes, int]:
    """Find the first piece of text from `at` on that is not a finite number, and where its line starts."""
    while at < len(source.data):
        end = source.data.find(b"\n", at) + 1 or len(source.data)
        line = source.data[at:end].rstrip()
        fits = layout is None or _fits(line, layout)
        for token in line.split() if layout is None else _columns(line, layout):
            number = parse(token)
            if not fits or number is None or not np.isfinite(number):
                return token, at
        at = end
    raise AssertionError("in a block that does not convert one number is bad")
