"""Files as mishaps leave them: cut off, bytes flipped, lines lost or exchanged, headings, units and columns changed."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from typing import Final

#: What takes the place of a number, or gets in anywhere.
TOKENS: Final = (
    *("0", "-1", "1", "nan", "-inf", "1e999", "1e308", "5e-324", "99999999999", "9" * 30, "9" * 3000, "-999", "1_0"),
    *("1.7e38", "1.0D-3", ".", "-", "E", "", " ", "\n", "\r", "\f", "\t", "\0", "\x1a", "\xff", ",", ";", "#", '"'),
    *("NPTS", "DT=", "units of ", "End-of-data", "(8F10.5)", "(999F999.9)", "1,5", "1:9:999999999", "x.csv", "[", "]"),
)

#: Units that take each other's place in headings and headers.
UNITS: Final = ("g", "m/s2", "cm/s2", "cm/s^2", "mm/s2", "gal", "mg", "cm/s", "m", "s", "ms", "min", "rad", "deg", "Hz")

Operation = Callable[[bytes, random.Random], bytes]

_NUMBER: Final = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][+-]?\d+)?")
_UNIT: Final = re.compile(
    rb"(?<![\w/])(?:g|gal|(?:c?m|cm|mm)/s(?:ec)?\^?2?|cm/sec2|rad|ms|s|UNITS OF G)(?![\w/])", re.I
)
_WORD: Final = re.compile(rb"[A-Za-z][A-Za-z_]{2,}")


def _span(data: bytes, rng: random.Random) -> tuple[int, int]:
    at = rng.randrange(len(data) + 1)
    return at, at + 1 + int(rng.random() ** 4 * min(len(data), 2000))


def _token(rng: random.Random) -> bytes:
    return rng.choice(TOKENS).encode("latin-1")


def flip_a_bit(data: bytes, rng: random.Random) -> bytes:
    """One bit is another."""
    at = rng.randrange(len(data)) if data else 0
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :] if data else data


def change_a_byte(data: bytes, rng: random.Random) -> bytes:
    """One character is another one that is printed."""
    at = rng.randrange(len(data) + 1)
    return data[:at] + bytes([rng.randrange(32, 127)]) + data[at + 1 :]


def cut_off(data: bytes, rng: random.Random) -> bytes:
    """The end is missing."""
    return data[: rng.randrange(len(data) + 1)]


def lose_a_stretch(data: bytes, rng: random.Random) -> bytes:
    """Some bytes are missing."""
    start, end = _span(data, rng)
    return data[:start] + data[end:]


def repeat_a_stretch(data: bytes, rng: random.Random) -> bytes:
    """Some bytes come several times."""
    start, end = _span(data, rng)
    return data[:end] + data[start:end] * rng.randrange(1, 9) + data[end:]


def put_in_a_token(data: bytes, rng: random.Random) -> bytes:
    """Something stands where it does not belong."""
    at = rng.randrange(len(data) + 1)
    return data[:at] + _token(rng) + data[at:]


def change_a_number(data: bytes, rng: random.Random) -> bytes:
    """A number is another, or none."""
    found = _NUMBER.search(data, rng.randrange(len(data) + 1))
    return data if found is None else data[: found.start()] + _token(rng) + data[found.end() :]


def change_a_digit(data: bytes, rng: random.Random) -> bytes:
    """A digit is another: the file looks as it did."""
    found = re.compile(rb"\d").search(data, rng.randrange(len(data) + 1))
    return data if found is None else data[: found.start()] + b"%d" % rng.randrange(10) + data[found.end() :]


def change_a_unit(data: bytes, rng: random.Random) -> bytes:
    """A heading or header names another unit."""
    places = [found.span() for found in _UNIT.finditer(data[:4000])]
    start, end = rng.choice(places or [(0, 0)])
    return data[:start] + rng.choice(UNITS).encode() + data[end:]


def change_a_word(data: bytes, rng: random.Random) -> bytes:
    """A word of the heading is another of its words, or is missing."""
    found = list(_WORD.finditer(data[:4000]))
    if not found:
        return data
    one, other = rng.choice(found), rng.choice(found)
    return data[: one.start()] + rng.choice([other[0], b""]) + data[one.end() :]


def _of_lines(change: Callable[[list[bytes], random.Random], None]) -> Operation:
    def operation(data: bytes, rng: random.Random) -> bytes:
        lines = data.split(b"\n")
        change(lines, rng)
        return b"\n".join(lines)

    operation.__doc__ = change.__doc__
    return operation


def _lose(lines: list[bytes], rng: random.Random) -> None:
    """Lose a line."""
    del lines[rng.randrange(len(lines))]


def _repeat(lines: list[bytes], rng: random.Random) -> None:
    """Have a line twice."""
    at = rng.randrange(len(lines))
    lines.insert(at, lines[at])


def _swap(lines: list[bytes], rng: random.Random) -> None:
    """Two lines are exchanged, often neighbours."""
    at = rng.randrange(len(lines))
    to = min(at + 1, len(lines) - 1) if rng.random() < 0.5 else rng.randrange(len(lines))
    lines[at], lines[to] = lines[to], lines[at]


def _join(lines: list[bytes], rng: random.Random) -> None:
    """Two lines are one."""
    at = rng.randrange(len(lines))
    lines[at : at + 2] = [b"".join(lines[at : at + 2])]


def _damage_first_row(lines: list[bytes], rng: random.Random) -> None:
    """The first row of numbers is gone, or one of its numbers is none."""
    at = next((k for k, line in enumerate(lines) if line.strip() and not re.search(rb"[A-DF-Za-df-z]", line)), 0)
    if rng.random() < 0.3:
        del lines[at]
    else:
        lines[at] = change_a_number(lines[at], rng)


def _lose_a_column(lines: list[bytes], rng: random.Random) -> None:
    """One column of a table is missing, with its heading or without."""
    sign = next((each for each in (b";", b",") if any(each in line for line in lines)), None)
    first, place = rng.randrange(2), rng.randrange(4)
    for k in range(first, len(lines)):
        cells = lines[k].split(sign)
        if place < len(cells):
            del cells[place]
            lines[k] = (sign or b" ").join(cells)


def _swap_columns(lines: list[bytes], rng: random.Random) -> None:
    """Two columns are exchanged, with their headings or without."""
    sign = next((each for each in (b";", b",") if any(each in line for line in lines)), b",")
    first, one, other = rng.randrange(2), rng.randrange(4), rng.randrange(4)
    for k in range(first, len(lines)):
        cells = lines[k].split(sign)
        if max(one, other) < len(cells):
            cells[one], cells[other] = cells[other], cells[one]
            lines[k] = sign.join(cells)


OPERATIONS: Final[tuple[Operation, ...]] = (
    *(flip_a_bit, change_a_byte, cut_off, lose_a_stretch, repeat_a_stretch, put_in_a_token),
    *(change_a_number, change_a_number, change_a_digit, change_a_digit, change_a_unit, change_a_unit, change_a_word),
    *map(_of_lines, (_lose, _repeat, _swap, _join, _damage_first_row, _lose_a_column, _swap_columns)),
)

#: No file grows beyond this, bytes.
_MOST: Final = 200_000


def damaged(data: bytes, rng: random.Random) -> bytes:
    """A file after one mishap, two or three."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        data = rng.choice(OPERATIONS)(data, rng)[:_MOST]
    return data
