"""Headings of text tables: which column holds times, which ones are channels, and the unit of each.

A unit stands in brackets, "a (cm/s2)", or ends a name: "a_g", "t/ms", "Time in ms", "Time, s"; or there is a line of
units below the names or above them.
"""

from __future__ import annotations

import csv
import functools
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

from rocking.records.formats.source import Source
from rocking.records.units import SECOND, Unit, find_time_unit, find_unit

#: What a column holds: times, numbers of rows, periods or ordinates of a spectrum, or values of a channel.
Kind = Literal["time", "count", "spectrum", "channel"]

#: What is in brackets, unless a value follows, as in "PGA (g) = 0.3".
_BRACKETS: Final = re.compile(r"[(\[{<]\s*([^()\[\]{}<>]{1,40}?)\s*[)\]}>](?!\s*[=:]\s*[+-]?[\d.])")
#: What stands before the unit of a value, as in "PGA = 8.2 m/s2".
_VALUE: Final = re.compile(r"[=:]\s*[+-]?[\d.,]+(?:[eE][+-]?\d+)?$")
_UP_TO_BRACKET: Final = re.compile(r"[^()\[\]]*[(\[][^()\[\]]*[)\]]")
_WORD_WITH_BRACKETS: Final = re.compile(r'"[^"]*"|(?:[^\s()\[\]]+\s*)?[(\[][^()\[\]]*[)\]]|[^\s()\[\]]+')
_WORD: Final = re.compile(r"[^\W\d_]+")
#: What follows the name of an acceleration, in running text.
_SUFFIX: Final = re.compile(r"(?:(?<![^\W_])a|(?:acc|acel|beschl)[^\W_]*)_(?=([A-Za-z]\w{0,12})\b)", re.IGNORECASE)
_BREAK: Final = re.compile(r"[\s_/,;:.-]+(?:in\s+)?")
#: A line that holds nothing: it divides, or has delimiters only.
RULE: Final = re.compile(r"[-=_~+|\s]{3,}|#+|[,;\s]*")
#: What may be a unit; the number in "channel (3)" is none.
_UNIT_LIKE: Final = re.compile(r".*(?:[^\W\d_]|[%°])")

_TIMES: Final = frozenset({"t", "time", "times", "timestamp", "zeit", "temps", "tiempo", "tempo", "tid", "tijd"})
_STEPS: Final = frozenset({"time", "step"})
_COUNTS: Final = frozenset(
    {"index", "idx", "i", "no", "nr", "num", "number", "sample", "samples", "point", "points", "pt", "row", "rows"}
    | {"step", "scan", "count", "id", "record"}
)
_SPECTRA: Final = frozenset({"period", "periods", "frequency", "frequencies", "freq", "sa", "psa"})
#: What names the ordinates of a response spectrum, unless it is that of an accelerogram which was fitted to one.
_SPECTRAL: Final = re.compile(
    r"(?!.*(?:match|[ck]ompat|consist|accelerogr)).*(?:spe[ckt]tr|pseudo|rotd\d|gmrot)", re.IGNORECASE
)
_PERIOD: Final = re.compile(r"p[eé]r[ií]od|periyot", re.IGNORECASE)
_ACCELERATION: Final = re.compile(r"\b(a|acc\w*|acel\w*|beschl\w*)(?![a-z])", re.IGNORECASE)


class Column(NamedTuple):
    """What a heading says of a column; `strange` stands where its unit should, and is none that is known."""

    kind: Kind
    name: str
    unit: Unit | None
    strange: str = ""


@dataclass(frozen=True)
class Heading:
    """What a heading says of each column, whether it names them and where (the offset of that line)."""

    columns: tuple[Column, ...]
    named: bool
    at: int
    assumed: bool = False
    doubtful: bool = False

    def places(self, kind: Kind) -> list[int]:
        """Return the places of the columns of one kind."""
        return [place for place, column in enumerate(self.columns) if column.kind == kind]


def heading_of(source: Source, end: int, count: int, delimiter: str) -> Heading:
    """Return what the lines before the offset `end` say of the `count` columns that begin there."""
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
    named = _Names(names, above, rest)
    columns = named.columns() if names else _unnamed(rest, count)
    assumed = count > 1 and not (names and named.names_times())
    spectral = any(map(_SPECTRAL.match, texts))
    doubtful = not named.names_times(surely=True) if names and count > 1 else spectral
    return Heading(tuple(columns), bool(names), lines[-1][1] if lines else end, assumed, doubtful)


def names_columns(line: bytes, count: int, delimiter: str) -> bool:
    """Return whether a line names `count` columns, one of them so that it is understood: times, or a known unit."""
    return _Names(_cells(_uncommented(line), count, delimiter), (), "").understood()


@dataclass(frozen=True)
class _Names:
    """Names of columns, the line above them where it has as many cells, and the text of the other lines."""

    names: tuple[str, ...]
    above: tuple[str, ...]
    rest: str

    def columns(self) -> Iterator[Column]:
        """Columns as their names tell; where none is named as times, the first of several holds them."""
        count = len(self.names)
        kinds = [self._kind(place) for place in range(count)] if count > 1 else [self._kind_of_only()]
        first_time = kinds.index("time") if "time" in kinds else 0
        for place, kind in enumerate(kinds):
            if kind == "count" and place > first_time:
                kinds[place] = "channel"
        if "time" not in kinds and kinds[0] == "channel" and count > 1 and self._acceleration_unit(0)[0] is None:
            kinds[0] = "time"
        for place, kind in enumerate(kinds):
            unit, strange = self._time_unit(place) if kind == "time" else self._acceleration_unit(place)
            yield Column(kind, _without_brackets(self._label(place)), unit, strange)

    def names_times(self, *, surely: bool = False) -> bool:
        """Whether a name is that of times; surely so if it is more than "T", which is that of periods as well."""
        places = [place for place in range(len(self.names)) if self._kind(place) == "time"]
        words = [set(_WORD.findall(self._label(place))) for place in places]
        return any(not surely or "T" not in each or {word.lower() for word in each} & _TIMES - {"t"} for each in words)

    def understood(self) -> bool:
        """Whether a name is that of times, row numbers or a spectrum, or has a unit of acceleration."""
        return any(
            (_WORD.search(name) if self._kind(place) != "channel" else self._acceleration_unit(place)[0]) is not None
            for place, name in enumerate(self.names)
        )

    def _kind(self, place: int) -> Kind:
        name = _without_brackets(self._label(place))
        words = {word.lower() for word in _WORD.findall(name)}
        texts = [text for line in self._lines(place) for text in _texts(line)]
        if (words and words <= _SPECTRA) or _SPECTRAL.match(name):
            return "spectrum"
        if any(map(find_unit, texts)):
            return "channel"
        if _PERIOD.search(name) and not _ACCELERATION.search(name):
            return "spectrum"
        counts = words <= _COUNTS | _STEPS and words != {"time"} if words else re.search(r"\w", name) is None
        if counts and not any(map(find_time_unit, texts)):
            return "count"
        return "time" if words & _TIMES or self._is_unit_of_time(place) else "channel"

    def _kind_of_only(self) -> Kind:
        """Return the kind of a single column, above which a title may stand: times only if it says nothing else."""
        name = self._label(0)
        units = (find_unit, find_time_unit)
        words = {word.lower() for word in _WORD.findall(name) if not any(find(word) for find in units)} - {"in"}
        unclear = words == {"t"} and not any(find_time_unit(text) for line in self._lines(0) for text in _texts(line))
        sure = words and words <= _TIMES | _SPECTRA and not unclear and not re.search(r"\d", name)
        return self._kind(0) if sure else "channel"

    def _label(self, place: int) -> str:
        """Return a column's name, which may stand above a line of units."""
        name = self.names[place]
        if self.above and (find_unit(_bare(name)) or find_time_unit(_bare(name)) or not _WORD.search(name)):
            return self.above[place]
        return name

    def _is_unit_of_time(self, place: int) -> bool:
        """Whether a name is a unit of time and nothing else; "min", "h" and "d" only in brackets."""
        name = self.names[place]
        if self._is_north_south(place):
            return False
        unit = find_time_unit(_bare(name))
        return unit is not None and (unit.multiplier == 1.0 or name != _bare(name))

    def _is_north_south(self, place: int) -> bool:
        """Whether a name is "ns" of north and south: beside "ew", or a column that is named as times."""
        others = [name.lower() for k, name in enumerate(self.names) if k != place]
        return self.names[place].lower() == "ns" and any(
            name == "ew" or not _TIMES.isdisjoint(_WORD.findall(name)) for name in others
        )

    def _lines(self, place: int) -> list[str]:
        """Return what is written above a column, the nearest line first."""
        return [line[place] for line in (self.names, self.above) if line]

    def _time_unit(self, place: int) -> tuple[Unit | None, str]:
        for line in () if self._is_north_south(place) else self._lines(place):
            unit = next((unit for text in _texts(line) if (unit := find_time_unit(text))), None)
            if unit is not None:
                return unit, ""
        strange = _strange(self.names[place])
        return (None, strange) if strange else _time_unit_in(self.rest)

    def _acceleration_unit(self, place: int) -> tuple[Unit | None, str]:
        for line in self._lines(place):
            units = {unit for text in _BRACKETS.findall(line) if (unit := find_unit(text))}
            if len(units) > 1:
                return None, _strange(line)
            # The longest end first: "acc % g" ends with "% g" and with "g".
            unit = next(iter(units), None) or next((unit for text in _ends(line) if (unit := find_unit(text))), None)
            if unit is not None:
                return unit, ""
        strange = _strange(self.names[place])
        if strange or place != len(self.names) - 1 or place > 1:
            return None, strange
        return _acceleration_unit_in(self.rest), ""


def _unnamed(text: str, count: int) -> Iterator[Column]:
    if count > 1:
        yield Column("time", "", *_time_unit_in(text))
    unit = _acceleration_unit_in(text) if count <= 2 else None
    for _ in range(count - 1 if count > 1 else 1):
        yield Column("channel", "", unit)


def _cells(line: str, count: int, delimiter: str) -> tuple[str, ...]:
    """Return the names in a line of so many columns, or none where it cannot be split so."""
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
    """Yield ways to split a line of names, those that fit the rows below it first, and whether each is sure."""
    for sign in ["\t", ";", ","] if delimiter == " " else [delimiter, ";", ",", "\t"]:
        yield functools.partial(_divided, sign), True
    yield lambda line: re.split(r"\t+|\s{2,}", line.strip()), True
    yield lambda line: _UP_TO_BRACKET.findall(line) if line.rstrip().endswith((")", "]")) else [], False
    if delimiter == " ":
        yield _WORD_WITH_BRACKETS.findall, False


def _divided(sign: str, line: str) -> list[str]:
    return next(csv.reader([line], delimiter=sign, skipinitialspace=True), [])


def _texts(name: str) -> list[str]:
    """Return what may be the unit in a name: what is in brackets, or how it ends."""
    return [*_BRACKETS.findall(name), *_ends(name)]


def _ends(name: str) -> Iterator[str]:
    """Yield the ends of a name that may be its unit, the longest first; "g" alone only of what is an acceleration."""
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
    """Return what a name has in brackets that may be a unit, or an empty text."""
    return ", ".join(text for text in _BRACKETS.findall(name) if _UNIT_LIKE.match(text))


def _time_unit_in(text: str) -> tuple[Unit | None, str]:
    """Return seconds; or None, and the other unit of time that a text has in brackets, of what it does not say."""
    others = [each for each in _BRACKETS.findall(text) if find_time_unit(each) not in (None, SECOND)]
    return (None, others[0]) if others else (SECOND, "")


def _acceleration_unit_in(text: str) -> Unit | None:
    """Return the one unit of acceleration that a text names in brackets or after an underscore, or None."""
    units = {unit for each in [*_BRACKETS.findall(text), *_SUFFIX.findall(text)] if (unit := find_unit(each))}
    return units.pop() if len(units) == 1 else None


def _uncommented(line: bytes) -> str:
    """Return the text of a line without the sign of a comment."""
    try:
        text = line.decode("utf-8").strip(" ")
    except UnicodeDecodeError:
        text = line.decode("latin-1").strip(" ")
    return text if text.startswith("%g") else text.lstrip("#%!/").strip(" ")
