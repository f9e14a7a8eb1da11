"""Tables of a study's file: their keys, what the values must be, and the line of every mistake."""

from __future__ import annotations

import contextlib
import dataclasses
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np

from rocking import checks, quantities
from rocking.arrays import Floats
from rocking.block import Damper, Load, Restraint, Spring, Tendon, Thrust
from rocking.errors import InvalidMotion, RockingError, StudyError, UnreadableRecord
from rocking.studies.report import PLANS

_Kept = TypeVar("_Kept", bound=RockingError)


class _Kind(NamedTuple):
    """What a value must be, in words, and whether it is."""

    words: str
    holds: Callable[[Any], bool]


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


_ANY: Final = _Kind("", lambda value: True)
_TEXT: Final = _Kind("text", _is_text)
_TEXTS: Final = _Kind("a list of texts", lambda value: isinstance(value, list) and all(map(_is_text, value)))
_CHANNEL: Final = _Kind("text or a whole number", lambda value: _is_text(value) or type(value) is int)
_TRUTH: Final = _Kind("true or false", lambda value: isinstance(value, bool))
_TABLE: Final = _Kind("a table", lambda value: isinstance(value, dict))


def _tables(name: str) -> _Kind:
    return _Kind(
        f"tables, [[{name}]]", lambda value: isinstance(value, list) and all(isinstance(one, dict) for one in value)
    )


#: What says together what a block is, and what may go with it.
BODIES: Final[Mapping[tuple[str, ...], tuple[str, ...]]] = {
    ("p", "alpha"): ("restitution",),
    ("width", "height"): ("offset", "restitution", "mass"),
    ("pivots", "height_of_mass", "gyration"): ("restitution", "mass"),
}
#: What needs to be given of a block that is held back, and what holds it: couples by a number, forces by tables.
MASSIVE: Final = ("width", "pivots")
COUPLES: Final[Mapping[str, Callable[[float], Restraint]]] = {"spring": Spring, "damper": Damper}
FORCES: Final[Mapping[str, Callable[..., Restraint]]] = {"tendons": Tendon, "thrusts": Thrust, "loads": Load}
HELD: Final = ("one_sided", "lean", *COUPLES, *FORCES)
PARAMETERS: Final = sorted({name for needed, more in BODIES.items() for name in (*needed, *more)})

#: What motions may be scaled to.
MEASURES: Final = ("factor", "pga", "pgv", "sa")

_OF_HELD: Final[Mapping[str, _Kind]] = {
    "one_sided": _TRUTH,
    **dict.fromkeys(("lean", *COUPLES), _ANY),
    **{name: _tables(f"blocks.{name}") for name in FORCES},
}

#: Tables of a file, the keys of each, and what their values must be; numbers are read by `_QUANTITIES`.
SCHEMA: Final[Mapping[str, Mapping[str, _Kind]]] = {
    "blocks": {"csv": _TEXT, **dict.fromkeys(PARAMETERS, _ANY), **_OF_HELD},
    "motions": {
        "records": _TEXTS,
        "channel": _CHANNEL,
        "vertical": _TEXT,
        "units": _TEXT,
        "dt": _ANY,
        "skip_unreadable": _TRUTH,
        "pulses": _tables("motions.pulses"),
    },
    "scales": {**dict.fromkeys((*MEASURES, "period", "damping"), _ANY), "polarity": _TEXT},
    "simulation": {"model": _TEXT, "chattering": _TEXT, "duration": _ANY, "outcomes": _TEXTS},
    "report": dict.fromkeys(PLANS, _TABLE),
    **{f"report.{name}": {each.name: _ANY for each in dataclasses.fields(plan)} for name, plan in PLANS.items()},
}

_QUANTITIES: Final[Mapping[str, quantities.Quantity]] = {
    **dict.fromkeys(("alpha", "lean"), quantities.tilt),
    **dict.fromkeys(("width", "height", "pivots", "height_of_mass", "gyration"), quantities.length),
    "pga": quantities.acceleration,
    "sa": quantities.acceleration,
    "pgv": quantities.velocity,
}


class Tables:
    """Tables of a file, and where each key of them stands."""

    def __init__(self, file: Path, text: str, tables: dict[str, Any]) -> None:
        self.file, self.text, self.tables = file, text, tables

    def table(self, table: str, occurrence: int = 0) -> Any:
        """Content of a table, empty where it is missing; of those of a list, the occurrence-th."""
        content: Any = self.tables
        for name in table.split("."):
            content = content.get(name, {})
        return content[occurrence] if isinstance(content, list) else content

    def check(self) -> None:
        """Check names of tables and keys, and that values which are no numbers are what they must be."""
        for table in self.tables:
            if table not in SCHEMA:
                hint = nearest(table, (name for name in SCHEMA if "." not in name))
                raise self.wrong(table, None, f"there is no table [{{}}]; {hint}", table)
            if not isinstance(self.tables[table], dict):
                raise self.wrong(table, None, f"{{}} must be one table, [{table}], once", table)
            self._check_keys(table)
        for needed in ("blocks", "motions"):
            if needed not in self.tables:
                raise StudyError("the table [{}] is missing", needed, path=str(self.file))

    def _check_keys(self, table: str) -> None:
        content = self.table(table)
        if not isinstance(content, dict):
            raise self.wrong("", table, f"{{}} must be a table, [{table}]", table.rpartition(".")[2])
        for key, value in content.items():
            if key not in SCHEMA[table]:
                raise self.wrong(table, key, f"[{table}] has no {{}}; {nearest(key, SCHEMA[table])}", key)
            kind = SCHEMA[table][key]
            if not kind.holds(value):
                raise self.wrong(table, key, f"{{}} must be {kind.words}, not {checks.shown(value)}", key, value=value)
            if f"{table}.{key}" in SCHEMA:
                self._check_keys(f"{table}.{key}")

    def numbers(self, table: str, key: str, value: Any) -> Floats:
        """Numbers of a key's value."""
        with self.located(table, key=key):
            return read(key, value)

    @contextlib.contextmanager
    def located(self, *tables: str, key: str | None = None, occurrence: int = 0) -> Iterator[None]:
        """Give a mistake the line of this key, or of the first that it names in these tables, or of the heading."""
        try:
            yield
        except RockingError as error:
            named = error.message.arguments if key is None else (key,)
            places = [(table, name) for table in tables for name in named if name in self.table(table, occurrence)]
            table, name = places[0] if places else (tables[0], None)
            line = line_of(self.text, table, name, occurrence)
            raise moved(error, StudyError, self.file, line) from None

    @contextlib.contextmanager
    def located_record(self, name: str) -> Iterator[None]:
        """Give what is wrong with a record the line that names it."""
        try:
            yield
        except (UnreadableRecord, InvalidMotion) as error:
            first = line_of(self.text, "motions", "records", 0)
            lines = self.text.splitlines()[first - 1 :]
            line = next((k for k, text in enumerate(lines, start=first) if name in text), first)
            raise moved(error, type(error), self.file, line) from None

    def wrong(self, table: str, key: str | None, message: str, *names: str, value: object = None) -> StudyError:
        """Return the error that says what is wrong with a key of a table, or with the table."""
        line = line_of(self.text, table, key, 0)
        return StudyError(message, *names, path=str(self.file), line=line, value=value)


def moved(error: RockingError, kind: type[_Kept], file: Path, line: int, where: str = "") -> _Kept:
    """Return an error as one of this line, with all its data; what it says of a file of its own comes before."""
    where += error.text().removesuffix(error.message.text())
    return kind(where + error.message.template, *error.message.arguments, path=str(file), line=line, value=error.value)


def nearest(name: str, known: Iterable[str]) -> str:
    """Say which known name is meant, or which there are."""
    names = [*known]
    return checks.meant(name, names, f"there are {', '.join(names)}")


def read(key: str, value: Any, quantity: quantities.Quantity | None = None) -> Floats:
    """Numbers of a value: one, a list, or a range."""
    quantity = quantity or _QUANTITIES.get(key, quantities.number)
    if isinstance(value, str):
        return quantities.values(value, key, quantity)
    each = value if isinstance(value, list) else [value]
    return np.array([quantity(one if isinstance(one, str) else repr(one), key) for one in each])


def number(key: str, text: str) -> float:
    """Read a number with the unit that a key may have."""
    return _QUANTITIES.get(key, quantities.number)(text, key)


def listed(names: Sequence[str]) -> str:
    """Join names as a sentence does."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def line_of(text: str, table: str, key: str | None, occurrence: int) -> int:
    """Line of a key in a table, the occurrence-th of that name; of its heading where there is no key; 1 if unseen."""
    if "." in table and not re.search(rf"^\s*\[+\s*{re.escape(table)}\b", text, re.MULTILINE):
        parent, _, name = table.rpartition(".")  # it is written within its parent
        return line_of(text, parent, name, 0)
    here, seen, heading_line = "", -1, 1
    for number, line in enumerate(text.splitlines(), start=1):
        heading = re.match(r"\s*\[+\s*([\w.]+)\s*\]+", line)
        if heading:
            here = heading[1]
            seen += here == table
            if key is not None and here == f"{table}.{key}":
                return number
            if here == table and seen == occurrence:
                heading_line = number
        found = re.match(r"\s*([\w.-]+)\s*=", line)
        if found and key is not None and here == table and max(seen, 0) == occurrence and found[1] == key:
            return number
    return heading_line
