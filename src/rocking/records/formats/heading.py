"""Headings of text tables: columns of times, channels, and the unit of each.

A unit is in brackets, "a (cm/s2)", ends a name ("a_g", "t/ms", "Time in ms", "Time, s"), or is in a line of units below
or above the names.
"""

from __future__ import annotations

import csv
import functools
import re
from collections.abc import Callable, Iterator
from typing import Final, Literal, NamedTuple

from rocking.records.formats.source import Source
from rocking.records.units import SECOND, Unit, find_time_unit, find_unit

#: Kind of a column: times, row numbers, periods or ordinates of a spectrum, or values of a channel.
ColumnKind = Literal["time", "count", "spectrum", "channel"]

#: Text in brackets, unless a value follows, as in "PGA (g) = 0.3".
_BRACKETS: Final = re.compile(r"[(\[{<]\s*([^()\[\]{}<>]{1,40}?)\s*[)\]}>](?!\s*[=:]\s*[+-]?[\d.])")
#: Text before the unit of a value, as in "PGA = 8.2 m/s2".
_VALUE: Final = re.compile(r"[=:]\s*[+-]?[\d.,]+(?:[eE][+-]?\d+)?$")
_UP_TO_BRACKET: Final = re.compile(r"[^()\[\]]*[(\[][^()\[\]]*[)\]]")
_WORD_WITH_BRACKETS: Final = re.compile(r'"[^"]*"|(?:[^\s()\[\]]+\s*)?[(\[][^()\[\]]*[)\]]|[^\s()\[\]]+')
_WORD: Final = re.compile(r"[^\W\d_]+")
#: Text after the name of an acceleration, in running text.
_SUFFIX: Final = re.compile(r"(?i)(?:(?<![^\W_])a|(?:acc|acel|beschl)[^\W_]*)_(?=([A-Za-z]\w{0,12})\b)")
_BREAK: Final = re.compile(r"[\s_/,;:.-]+(?:in\s+)?")
#: Line without content: a rule, or delimiters only.
RULE_PATTERN: Final = re.compile(r"[-=_~+|\s]{3,}|#+|[,;\s]*")
#: Possible unit, unlike the number in "channel (3)".
_UNIT_LIKE: Final = re.compile(r".*(?:[^\W\d_]|[%°])")

_TIMES: Final = {"t", "time", "times", "timestamp", "zeit", "temps", "tiempo", "tempo", "tid", "tijd"}
_COUNTS: Final = {"index", "idx", "i", "no", "nr", "num", "number", "sample", "samples", "point", "points", "pt"}.union(
    ("row", "rows", "step", "time", "scan", "count", "id", "record")
)
_SPECTRA: Final = {"period", "periods", "frequency", "frequencies", "freq", "sa", "psa"}
#: Names of the ordinates of a response spectrum, except for an accelerogram fitted to a spectrum.
_SPECTRAL: Final = re.compile(r"(?i)(?!.*(?:match|[ck]ompat|consist|accelerogr)).*(?:spe[ckt]tr|pseudo|rotd\d|gmrot)")
_PERIOD: Final = re.compile(r"(?i)p[eé]r[ií]od|periyot")
_ACCELERATION: Final = re.compile(r"(?i)\b(a|acc\w*|acel\w*|beschl\w*)(?![a-z])")


class ColumnHeading(NamedTuple):
    """Column according to a heading."""

    kind: ColumnKind  # kind of the numbers
    name: str  # name without the unit
    unit: Unit | None  # unit, or None if not stated or unknown
    unknown_unit: str = ""  # text of an unknown unit


class Heading(NamedTuple):
    """Heading of a table."""

    columns: tuple[ColumnHeading, ...]  # columns in the order of the table
    has_names: bool  # whether it names the columns
    offset: int  # offset of its last line
    assumes_times: bool  # whether the first column is one of times without being named so
    may_be_spectrum: bool  # whether the table may be a response spectrum

    def find_columns(self, kind: ColumnKind) -> list[int]:
        """Return the indices of the columns of one kind."""
        return [index for index, column in enumerate(self.columns) if column.kind == kind]


def parse_heading(source: Source, end: int, count: int, delimiter: str) -> Heading:
    """Interpret the lines before the offset `end` as the heading of the `count` columns that begin there."""
    offset = max(0, end - 10_000)
    lines: list[tuple[str, int]] = []
    for line in source.data[offset:end].split(b"\n"):
        text = _strip_comment_sign(line)
        if not RULE_PATTERN.fullmatch(text):
            lines.append((text, offset))
        offset += len(line) + 1
    texts = [text for text, _ in lines]
    names = _split_names(texts[-1], count, delimiter) if texts else ()
    upper_names = _split_names(texts[-2], count, delimiter) if names and len(texts) > 1 else ()
    context = "\n".join(texts[: len(texts) - bool(names) - bool(upper_names)])
    start = lines[-1][1] if lines else end
    is_spectrum = any(map(_SPECTRAL.match, texts))
    if not names:
        times = ColumnHeading("time", "", *_find_times_unit(("",), context))
        channel = ColumnHeading("channel", "", _find_acceleration_unit(context) if count <= 2 else None)
        unnamed = (times,) * (count > 1) + (channel,) * max(count - 1, 1)
        return Heading(unnamed, False, start, count > 1, is_spectrum)
    cells = list(zip(names, upper_names, strict=True)) if upper_names else [(name,) for name in names]
    kinds: list[ColumnKind] = [_classify_column(cell) for cell in cells] if count > 1 else ["channel"]
    labels = [_find_label(cells[index]) for index, kind in enumerate(kinds) if kind == "time"]
    # "T" also denotes periods.
    has_certain_times = any(_TIMES - {"t"} & _split_words(cell) or "T" not in _WORD.findall(cell) for cell in labels)
    first_time = kinds.index("time") if labels else 0
    kinds = ["channel" if kind == "count" and index > first_time else kind for index, kind in enumerate(kinds)]
    units = [_find_cell_unit(cell, context if index == count - 1 <= 1 else "") for index, cell in enumerate(cells)]
    if not labels and kinds[0] == "channel" and count > 1 and units[0][0] is None:
        kinds[0] = "time"
    columns = []
    for kind, cell, unit in zip(kinds, cells, units, strict=True):
        column_unit = _find_times_unit(cell, context) if kind == "time" else unit
        columns.append(ColumnHeading(kind, _remove_bracketed(_find_label(cell)), *column_unit))
    may_be_spectrum = not has_certain_times if count > 1 else is_spectrum
    return Heading(tuple(columns), True, start, count > 1 and not labels, may_be_spectrum)


def _classify_column(cell: tuple[str, ...]) -> ColumnKind:
    """Return the kind of a column from the text above it, the nearest line first."""
    name = _remove_bracketed(_find_label(cell))
    words = _split_words(name)
    if (words and words <= _SPECTRA) or _SPECTRAL.match(name):
        return "spectrum"
    if any(find_unit(text) for line in cell for text in _list_units(line)):
        return "channel"
    if _PERIOD.search(name) and not _ACCELERATION.search(name):
        return "spectrum"
    is_count = words <= _COUNTS and words != {"time"} if words else re.search(r"\w", name) is None
    if is_count and not any(map(_parse_time_unit, cell)):
        return "count"
    bare_unit = find_time_unit(_strip_brackets(cell[0]))
    # "min", "h" and "d" are units of time in brackets only, and "ns" means north and south.
    is_time_unit = (
        _parse_time_unit(cell[0]) and bare_unit and (bare_unit.multiplier == 1.0 or cell[0] != _strip_brackets(cell[0]))
    )
    return "time" if words & _TIMES or is_time_unit else "channel"


def _find_label(cell: tuple[str, ...]) -> str:
    """Return the name of a column, which may be above a line of units."""
    bare = _strip_brackets(cell[0])
    return cell[-1] if find_unit(bare) or find_time_unit(bare) or not _WORD.search(cell[0]) else cell[0]


def _split_words(name: str) -> set[str]:
    return {word.lower() for word in _WORD.findall(name)}


def _parse_time_unit(line: str) -> Unit | None:
    """Return the unit of time in a name, except in "ns" (north and south)."""
    return None if line.lower() == "ns" else next(filter(None, map(find_time_unit, _list_units(line))), None)


def _find_times_unit(cell: tuple[str, ...], context: str) -> tuple[Unit | None, str]:
    """Return the unit of a column of times, seconds unless other text has a unit in brackets."""
    unit = next(filter(None, map(_parse_time_unit, cell)), None)
    unknown_unit = "" if unit else _find_unknown_unit(cell[0])
    if unit or unknown_unit:
        return unit, unknown_unit
    others = [text for text in _BRACKETS.findall(context) if find_time_unit(text) not in (None, SECOND)]
    return (None, others[0]) if others else (SECOND, "")


def _find_cell_unit(cell: tuple[str, ...], context: str) -> tuple[Unit | None, str]:
    for line in cell:
        if len({unit for text in _BRACKETS.findall(line) if (unit := find_unit(text))}) > 1:
            return None, _find_unknown_unit(line)
        # The longest end first: "acc % g" ends with "% g" and with "g".
        if unit := next(filter(None, map(find_unit, _list_units(line))), None):
            return unit, ""
    unknown_unit = _find_unknown_unit(cell[0])
    return None if unknown_unit else _find_acceleration_unit(context), unknown_unit


def _split_names(line: str, count: int, delimiter: str) -> tuple[str, ...]:
    """Return the names in a line with this many columns, or none."""
    if count == 1:
        return (line.strip(),)
    for split, is_certain in _yield_splitters(delimiter):
        cells = [cell.strip().strip('"').strip() for cell in split(line)]
        while len(cells) > count and not cells[-1]:
            cells.pop()
        if len(cells) == count and all(cells[1:]) and (is_certain or not any(map(find_unit, _list_units(cells[0])))):
            return tuple(cells)
    return ()


def _yield_splitters(delimiter: str) -> Iterator[tuple[Callable[[str], list[str]], bool]]:
    """Yield ways to split a line of names, and whether each is certain. Ways that fit the rows below come first."""
    for sign in ["\t", ";", ","] if delimiter == " " else [delimiter, ";", ",", "\t"]:
        yield functools.partial(_split_csv, sign), True
    yield lambda line: re.split(r"\t+|\s{2,}", line.strip()), True
    yield lambda line: _UP_TO_BRACKET.findall(line) if line.rstrip().endswith((")", "]")) else [], False
    if delimiter == " ":
        yield _WORD_WITH_BRACKETS.findall, False


def _split_csv(sign: str, line: str) -> list[str]:
    return next(csv.reader([line], delimiter=sign, skipinitialspace=True), [])


def _list_units(name: str) -> list[str]:
    """Return possible units in a name: text in brackets, and ends of the name."""
    return [*_BRACKETS.findall(name), *_yield_endings(name)]


def _yield_endings(name: str) -> Iterator[str]:
    """Yield ends of a name that may be its unit, the longest first ("g" alone only after an acceleration)."""
    yield _strip_brackets(name)
    text = _remove_bracketed(name).rstrip("_. ")
    for separator in _BREAK.finditer(text):
        end = text[separator.end() :]
        if _VALUE.search(text[: separator.start()]):
            continue
        is_certain = separator[0] == "_" or re.search(r"[/\d]", end) is not None or not find_unit(end)
        if end and (is_certain or _ACCELERATION.search(text[: separator.start()])):
            yield end


def _strip_brackets(name: str) -> str:
    return name.strip("()[]{}<> ")


def _remove_bracketed(name: str) -> str:
    return _BRACKETS.sub("", name).strip()


def _find_unknown_unit(name: str) -> str:
    """Return text in the brackets of a name that may be a unit, or an empty text."""
    return ", ".join(text for text in _BRACKETS.findall(name) if _UNIT_LIKE.match(text))


def _find_acceleration_unit(text: str) -> Unit | None:
    """Return the only unit of acceleration in brackets or after an underscore in a text, or None."""
    units = {unit for candidate in [*_BRACKETS.findall(text), *_SUFFIX.findall(text)] if (unit := find_unit(candidate))}
    return units.pop() if len(units) == 1 else None


def _strip_comment_sign(line: bytes) -> str:
    """Return the text of a line without its comment sign."""
    try:
        text = line.decode("utf-8").strip(" ")
    except UnicodeDecodeError:
        text = line.decode("latin-1").strip(" ")
    return text if text.startswith("%g") else text.lstrip("#%!/").strip(" ")
