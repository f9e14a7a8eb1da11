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
Kind = Literal["time", "count", "spectrum", "channel"]

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
RULE: Final = re.compile(r"[-=_~+|\s]{3,}|#+|[,;\s]*")
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


class Column(NamedTuple):
    """Column according to a heading, with the text of an unknown unit (`strange`)."""

    kind: Kind
    name: str
    unit: Unit | None
    strange: str = ""


class Heading(NamedTuple):
    """Heading: its columns, whether it names them, and the offset of its line."""

    columns: tuple[Column, ...]
    named: bool
    at: int
    assumed: bool
    doubtful: bool

    def places(self, kind: Kind) -> list[int]:
        """Return the indices of the columns of one kind."""
        return [place for place, column in enumerate(self.columns) if column.kind == kind]


def heading_of(source: Source, end: int, count: int, delimiter: str) -> Heading:
    """Interpret the lines before the offset `end` as the heading of the `count` columns that begin there."""
    at = max(0, end - 10_000)
    lines: list[tuple[str, int]] = []
    for line in source.data[at:end].split(b"\n"):
        text = _uncommented(line)
        if not RULE.fullmatch(text):
            lines.append((text, at))
        at += len(line) + 1
    texts = [text for text, _ in lines]
    names = _cells(texts[-1], count, delimiter) if texts else ()
    above = _cells(texts[-2], count, delimiter) if names and len(texts) > 1 else ()
    rest = "\n".join(texts[: len(texts) - bool(names) - bool(above)])
    where = lines[-1][1] if lines else end
    spectral = any(map(_SPECTRAL.match, texts))
    if not names:
        times = Column("time", "", *_time_unit(("",), rest))
        channel = Column("channel", "", _acceleration_unit_in(rest) if count <= 2 else None)
        unnamed = (times,) * (count > 1) + (channel,) * max(count - 1, 1)
        return Heading(unnamed, False, where, count > 1, spectral)
    cells = list(zip(names, above, strict=True)) if above else [(name,) for name in names]
    kinds = [_kind(each) for each in cells] if count > 1 else [_kind_of_only(cells[0])]
    labels = [_label(cells[place]) for place, kind in enumerate(kinds) if kind == "time"]
    # "T" also denotes periods.
    surely = any(_TIMES - {"t"} & _words(each) or "T" not in _WORD.findall(each) for each in labels)
    first_time = kinds.index("time") if labels else 0
    kinds = ["channel" if kind == "count" and place > first_time else kind for place, kind in enumerate(kinds)]
    units = [_acceleration_unit(each, rest if place == count - 1 <= 1 else "") for place, each in enumerate(cells)]
    if not labels and kinds[0] == "channel" and count > 1 and units[0][0] is None:
        kinds[0] = "time"
    columns = (
        Column(kind, _without_brackets(_label(each)), *(_time_unit(each, rest) if kind == "time" else unit))
        for kind, each, unit in zip(kinds, cells, units, strict=True)
    )
    return Heading(tuple(columns), True, where, count > 1 and not labels, not surely if count > 1 else spectral)


def _kind(cell: tuple[str, ...]) -> Kind:
    """Return the kind of a column from the text above it, the nearest line first."""
    name = _without_brackets(_label(cell))
    words = _words(name)
    if (words and words <= _SPECTRA) or _SPECTRAL.match(name):
        return "spectrum"
    if any(find_unit(text) for line in cell for text in _texts(line)):
        return "channel"
    if _PERIOD.search(name) and not _ACCELERATION.search(name):
        return "spectrum"
    counts = words <= _COUNTS and words != {"time"} if words else re.search(r"\w", name) is None
    if counts and not any(map(_time_of, cell)):
        return "count"
    alone = find_time_unit(_bare(cell[0]))
    # "min", "h" and "d" are units of time in brackets only, and "ns" means north and south.
    unit = _time_of(cell[0]) and alone and (alone.multiplier == 1.0 or cell[0] != _bare(cell[0]))
    return "time" if words & _TIMES or unit else "channel"


def _kind_of_only(cell: tuple[str, ...]) -> Kind:
    """Return the kind of a single column, possibly below a title: times only if nothing else is named."""
    name = _label(cell)
    words = {word for word in _words(name) if not (find_unit(word) or find_time_unit(word))} - {"in"}
    unclear = words == {"t"} and not any(map(_time_of, cell))
    sure = words and words <= _TIMES | _SPECTRA and not unclear and not re.search(r"\d", name)
    return _kind(cell) if sure else "channel"


def _label(cell: tuple[str, ...]) -> str:
    """Return the name of a column, which may be above a line of units."""
    bare = _bare(cell[0])
    return cell[-1] if find_unit(bare) or find_time_unit(bare) or not _WORD.search(cell[0]) else cell[0]


def _words(name: str) -> set[str]:
    return {word.lower() for word in _WORD.findall(name)}


def _time_of(line: str) -> Unit | None:
    """Return the unit of time in a name, except in "ns" (north and south)."""
    return None if line.lower() == "ns" else next(filter(None, map(find_time_unit, _texts(line))), None)


def _time_unit(cell: tuple[str, ...], rest: str) -> tuple[Unit | None, str]:
    """Return the unit of a column of times, seconds unless other text has a unit in brackets."""
    unit = next(filter(None, map(_time_of, cell)), None)
    strange = "" if unit else _strange(cell[0])
    if unit or strange:
        return unit, strange
    others = [each for each in _BRACKETS.findall(rest) if find_time_unit(each) not in (None, SECOND)]
    return (None, others[0]) if others else (SECOND, "")


def _acceleration_unit(cell: tuple[str, ...], rest: str) -> tuple[Unit | None, str]:
    for line in cell:
        if len({unit for text in _BRACKETS.findall(line) if (unit := find_unit(text))}) > 1:
            return None, _strange(line)
        # The longest end first: "acc % g" ends with "% g" and with "g".
        if unit := next(filter(None, map(find_unit, _texts(line))), None):
            return unit, ""
    strange = _strange(cell[0])
    return None if strange else _acceleration_unit_in(rest), strange


def _cells(line: str, count: int, delimiter: str) -> tuple[str, ...]:
    """Return the names in a line with this many columns, or none."""
    if count == 1:
        return (line.strip(),)
    for split, sure in _ways(delimiter):
        cells = [cell.strip().strip('"').strip() for cell in split(line)]
        while len(cells) > count and not cells[-1]:
            cells.pop()
        if len(cells) == count and all(cells[1:]) and (sure or not any(map(find_unit, _texts(cells[0])))):
            return tuple(cells)
    return ()


def _ways(delimiter: str) -> Iterator[tuple[Callable[[str], list[str]], bool]]:
    """Yield ways to split a line of names, and whether each is certain. Ways that fit the rows below come first."""
    for sign in ["\t", ";", ","] if delimiter == " " else [delimiter, ";", ",", "\t"]:
        yield functools.partial(_divided, sign), True
    yield lambda line: re.split(r"\t+|\s{2,}", line.strip()), True
    yield lambda line: _UP_TO_BRACKET.findall(line) if line.rstrip().endswith((")", "]")) else [], False
    if delimiter == " ":
        yield _WORD_WITH_BRACKETS.findall, False


def _divided(sign: str, line: str) -> list[str]:
    return next(csv.reader([line], delimiter=sign, skipinitialspace=True), [])


def _texts(name: str) -> list[str]:
    """Return possible units in a name: text in brackets, and ends of the name."""
    return [*_BRACKETS.findall(name), *_ends(name)]


def _ends(name: str) -> Iterator[str]:
    """Yield ends of a name that may be its unit, the longest first ("g" alone only after an acceleration)."""
    yield _bare(name)
    text = _without_brackets(name).rstrip("_. ")
    for found in _BREAK.finditer(text):
        end = text[found.end() :]
        if _VALUE.search(text[: found.start()]):
            continue
        sure = found[0] == "_" or re.search(r"[/\d]", end) is not None or not find_unit(end)
        if end and (sure or _ACCELERATION.search(text[: found.start()])):
            yield end


def _bare(name: str) -> str:
    return name.strip("()[]{}<> ")


def _without_brackets(name: str) -> str:
    return _BRACKETS.sub("", name).strip()


def _strange(name: str) -> str:
    """Return text in the brackets of a name that may be a unit, or an empty text."""
    return ", ".join(text for text in _BRACKETS.findall(name) if _UNIT_LIKE.match(text))


def _acceleration_unit_in(text: str) -> Unit | None:
    """Return the only unit of acceleration in brackets or after an underscore in a text, or None."""
    units = {unit for each in [*_BRACKETS.findall(text), *_SUFFIX.findall(text)] if (unit := find_unit(each))}
    return units.pop() if len(units) == 1 else None


def _uncommented(line: bytes) -> str:
    """Return the text of a line without its comment sign."""
    try:
        text = line.decode("utf-8").strip(" ")
    except UnicodeDecodeError:
        text = line.decode("latin-1").strip(" ")
    return text if text.startswith("%g") else text.lstrip("#%!/").strip(" ")
