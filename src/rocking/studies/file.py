"""A study as a text file: blocks, motions, scales and rules in TOML, every mistake with its line."""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import itertools
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar, cast

import numpy as np

from rocking import checks, quantities
from rocking.arrays import Floats
from rocking.block import (
    Block,
    Blocks,
    Damper,
    Load,
    RestrainedBlock,
    RestrainedBlocks,
    Restraint,
    Spring,
    Tendon,
    Thrust,
)
from rocking.body import Bodies
from rocking.ensemble import Product, Scales
from rocking.errors import InvalidMotion, InvalidOption, RockingError, StudyError, UnreadableRecord
from rocking.motion.formats.source import Request
from rocking.motion.motion import Motion
from rocking.motion.named import expanded, named_motion, named_vertical
from rocking.motion.scaling import FACTOR, Measure, MeasureName
from rocking.named_pulses import pulse_family
from rocking.plausibility import vertical_notes
from rocking.progress import note
from rocking.studies.inputs import OUTCOMES, chosen_outcomes
from rocking.studies.refine import Tolerances, tolerances_of
from rocking.studies.results import PLANS, ReportPlan, check_part
from rocking.tables import csv_rows
from rocking.treatment import treatment

#: A file to start from, with comments.
TEMPLATE: Final = Path(__file__).with_name("template.toml").read_text("utf-8")

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
_BODIES: Final[Mapping[tuple[str, ...], tuple[str, ...]]] = {
    ("p", "alpha"): ("restitution",),
    ("width", "height"): ("offset", "restitution", "mass"),
    ("pivots", "height_of_mass", "gyration"): ("restitution", "mass"),
}
#: What needs to be given of a block that is held back, and what holds it: couples by a number, forces by tables.
_MASSIVE: Final = ("width", "pivots")
_COUPLES: Final[Mapping[str, Callable[[float], Restraint]]] = {"spring": Spring, "damper": Damper}
_FORCES: Final[Mapping[str, Callable[..., Restraint]]] = {"tendons": Tendon, "thrusts": Thrust, "loads": Load}
_HELD: Final = ("one_sided", "lean", *_COUPLES, *_FORCES)
_PARAMETERS: Final = sorted({name for needed, more in _BODIES.items() for name in (*needed, *more)})

#: What motions may be scaled to.
_MEASURES: Final = ("factor", "pga", "pgv", "sa")

#: What both sides of a block may have of their own, in columns of a table that end so.
_SIDED: Final = ("p", "alpha", "pivots", "restitution")
_SIDES: Final = ("_plus", "_minus")

_OF_HELD: Final[Mapping[str, _Kind]] = {
    "one_sided": _TRUTH,
    **dict.fromkeys(("lean", *_COUPLES), _ANY),
    **{name: _tables(f"blocks.{name}") for name in _FORCES},
}

#: Tables of a file, the keys of each, and what their values must be; numbers are read by `_QUANTITIES`.
_SCHEMA: Final[Mapping[str, Mapping[str, _Kind]]] = {
    "blocks": {"csv": _TEXT, **dict.fromkeys(_PARAMETERS, _ANY), **_OF_HELD},
    "motions": {
        "records": _TEXTS,
        "channel": _CHANNEL,
        "vertical": _TEXT,
        "units": _TEXT,
        "dt": _ANY,
        "skip_unreadable": _TRUTH,
        "pulses": _tables("motions.pulses"),
    },
    "scales": {**dict.fromkeys((*_MEASURES, "period", "damping", "refine"), _ANY), "polarity": _TEXT},
    "simulation": {"model": _TEXT, "chattering": _TEXT, "duration": _ANY, "outcomes": _TEXTS},
    "report": dict.fromkeys(PLANS, _TABLE),
    **{f"report.{name}": {each.name: _ANY for each in dataclasses.fields(plan)} for name, plan in PLANS.items()},
}

_QUANTITIES: Final[Mapping[str, quantities.Quantity]] = {
    **dict.fromkeys(("alpha", "lean"), quantities.tilt),
    **dict.fromkeys(("width", "height", "pivots", "height_of_mass", "gyration"), quantities.length),
    "pga": quantities.acceleration,
    "sa": quantities.acceleration,
}


@dataclass(frozen=True)
class StudyFile:
    """What a file describes.

    Attributes
    ----------
    product : Product
        Blocks, motions, scales and rules.
    skipped : tuple of str
        A sentence for each record that could not be read, where the file says to go on.
    report : ReportPlan or None
        What is to be made of the results.
    refine : mapping or None
        Tolerances to which scales are refined, by verdict.
    outcomes : tuple of str
        What is kept of each simulation.
    records : tuple of str
        Name of the record of each motion, relative to the file; empty of a pulse.
    """

    product: Product
    skipped: tuple[str, ...]
    report: ReportPlan | None
    refine: Tolerances | None = None
    outcomes: tuple[str, ...] = OUTCOMES
    records: tuple[str, ...] = ()


def read_study(path: str | Path) -> StudyFile:
    """Read the description of a study; names of files in it are relative to it.

    Parameters
    ----------
    path : path
        A TOML file; `TEMPLATE` is one with comments.

    Returns
    -------
    StudyFile
        Its product, and what is to be kept and made of the results.

    Raises
    ------
    StudyError
        If the file cannot be read, or a line of it is wrong: `path`, `line` and `argument` (the key) of the error.
    UnreadableRecord
        If a record cannot be read.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "study.toml"
    >>> _ = file.write_text(TEMPLATE)
    >>> read_study(file).product.shape
    (2, 3, 1, 320)
    >>> _ = file.write_text(TEMPLATE.replace("restitution", "restitutoin"))
    >>> try:
    ...     read_study(file)
    ... except StudyError as error:
    ...     print(error.line, error.message.text())
    7 [blocks] has no restitutoin; did you mean restitution?
    """
    file = checks.path(path, "the file of a study", StudyError)
    try:
        text = file.read_text("utf-8")
        tables = tomllib.loads(text)
    except OSError as error:
        raise StudyError(f"the file cannot be read: {error.strerror or error}", path=str(file)) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise StudyError(f"this is no TOML file: {error}; correct it", path=str(file)) from None
    return _Reader(file, text, tables).study()


class _Reader:
    """Tables of a file, and where each key of them stands."""

    def __init__(self, file: Path, text: str, tables: dict[str, Any]) -> None:
        self.file, self.text, self.tables = file, text, tables

    def study(self) -> StudyFile:
        """Read all tables, the cheapest first."""
        self._check_tables()
        rules, given = self._table("simulation"), self._table("scales")
        blocks, scales = self._blocks(), self._scales()
        motions, names, skipped = self._motions(scales)
        with self._located("simulation", key="chattering"):
            chattering = treatment(rules.get("chattering", "certified"))
        model, polarity = rules.get("model", "nonlinear"), given.get("polarity", "+")
        with self._located("simulation", "scales", "blocks"):
            product = Product(blocks, tuple(motions), scales, polarity, model, chattering, rules.get("duration"))
            kept = chosen_outcomes(rules.get("outcomes"))
        report, refine = self._report(kept), given.get("refine")
        with self._located("scales", key="refine"):
            tolerances = None if refine is None else tolerances_of(product, refine, kept)
        return StudyFile(product, tuple(skipped), report, tolerances, kept, tuple(names))

    def _check_tables(self) -> None:
        """Check names of tables and keys, and that values which are no numbers are what they must be."""
        for table in self.tables:
            if table not in _SCHEMA:
                hint = _nearest(table, (name for name in _SCHEMA if "." not in name))
                raise self._wrong(table, None, f"there is no table [{{}}]; {hint}", table)
            self._check_keys(table)
        for needed in ("blocks", "motions"):
            if needed not in self.tables:
                raise StudyError("the table [{}] is missing", needed, path=str(self.file))

    def _check_keys(self, table: str) -> None:
        content = self._table(table)
        if not isinstance(content, dict):
            raise self._wrong("", table, f"{{}} must be a table, [{table}]", table.rpartition(".")[2])
        for key, value in content.items():
            if key not in _SCHEMA[table]:
                raise self._wrong(table, key, f"[{table}] has no {{}}; {_nearest(key, _SCHEMA[table])}", key)
            kind = _SCHEMA[table][key]
            if not kind.holds(value):
                raise self._wrong(table, key, f"{{}} must be {kind.words}, not {checks.shown(value)}", key, value=value)
            if f"{table}.{key}" in _SCHEMA:
                self._check_keys(f"{table}.{key}")

    def _table(self, table: str, occurrence: int = 0) -> Any:
        """Content of a table, empty where it is missing; of those of a list, the occurrence-th."""
        content: Any = self.tables
        for name in table.split("."):
            content = content.get(name, {})
        return content[occurrence] if isinstance(content, list) else content

    def _scales(self) -> Scales:
        given = self._table("scales")
        measures = [name for name in _MEASURES if name in given]
        if len(measures) > 1:
            listed = " and ".join(["{}"] * len(measures))
            raise self._wrong(
                "scales", measures[0], f"motions can be scaled to one measure only, not to {listed}", *measures
            )
        if "period" in given and "sa" not in given:
            raise self._wrong("scales", "period", "{} goes with {}, and only with it", "period", "sa")
        if "sa" in given and "period" not in given:
            raise self._wrong("scales", "sa", "{} needs {}, in s", "sa", "period")
        levels = {name: self._numbers("scales", name, given[name]) for name in measures}
        with self._located("scales"):
            if not levels:
                return Scales.of(None, FACTOR)
            ((name, values),) = levels.items()
            checks.positive_numbers(values, name, InvalidOption)
            options = {option: given[option] for option in ("period", "damping") if option in given}
            return Scales.of(values, Measure(cast(MeasureName, name), **options))

    def _report(self, kept: tuple[str, ...]) -> ReportPlan | None:
        plans: dict[str, Any] = {}
        for name, given in self._table("report").items():
            with self._located(f"report.{name}"):
                plans[name] = PLANS[name](**given)
                check_part(plans[name], kept)
        return ReportPlan(**plans) if "report" in self.tables else None

    def _blocks(self) -> Bodies:
        given = dict(self._table("blocks"))
        held = {name: given.pop(name) for name in _HELD if name in given}
        if held and not {*_MASSIVE} & given.keys():
            first = next(iter(held))
            raise self._wrong("blocks", first, f"{{}} goes with {_listed(_MASSIVE)} of a block", first)
        if "csv" in given:
            if len(given) > 1:
                raise self._wrong("blocks", "csv", "{} goes without other keys", "csv")
            return self._blocks_of_csv(self.file.parent / given["csv"])
        if not any({*needed} <= given.keys() <= {*needed, *more} for needed, more in _BODIES.items()):
            choices = ", or ".join(map(_listed, _BODIES))
            having = f"; it has {_listed([*given])}" if given else ""
            raise self._wrong("blocks", None, f"[blocks] needs {choices}, or csv{having}")
        axes: dict[str, Any] = {
            name: self._pivots(value) if name == "pivots" else self._numbers("blocks", name, value)
            for name, value in given.items()
        }
        restraints = self._restraints(held)
        lean = self._numbers("blocks", "lean", held["lean"]) if "lean" in held else [0.0]
        with self._located("blocks"):
            if "p" in axes:
                return Blocks.grid(**axes)
            checks.grid_size({name: len(axis) for name, axis in axes.items()}, StudyError)
            rows = [dict(zip(axes, row, strict=True)) for row in itertools.product(*axes.values())]
            if not held:
                return Blocks.of([_body(row) for row in rows])
            checks.grid_size({"body": len(rows) * len(lean) * math.prod(map(len, restraints))}, StudyError)
            return RestrainedBlocks.of(
                [
                    RestrainedBlock(
                        _body(row), *chosen, one_sided=held.get("one_sided", False), lean=angle,
                        restitution=row.get("restitution"),
                    )
                    for row, angle, *chosen in itertools.product(rows, lean, *restraints)
                ]
            )  # fmt: skip

    def _restraints(self, held: Mapping[str, Any]) -> list[list[Restraint]]:
        """Return what each restraint may be: one, or several where its numbers are lists or ranges."""
        found: list[list[Restraint]] = []
        for name, couple in _COUPLES.items():
            if name in held:
                with self._located("blocks", key=name):
                    found.append([couple(value) for value in _read(name, held[name]).tolist()])
        for name, kind in _FORCES.items():
            for k, given in enumerate(held.get(name, [])):
                table, known = f"blocks.{name}", inspect.signature(kind).parameters
                axes: dict[str, Any] = {}
                for key, value in given.items():
                    with self._located(table, key=key, occurrence=k):
                        if key not in known:
                            raise StudyError(f"[[{table}]] has no {{}}; {_nearest(key, known)}", key)
                        axes[key] = [value] if isinstance(value, bool) else _read(key, value).tolist()
                with self._located(table, occurrence=k):
                    missing = [key for key, each in known.items() if each.default is each.empty and key not in axes]
                    if missing:
                        raise StudyError(f"[[{table}]] needs {_listed(missing)} as well")
                    rows = itertools.product(*axes.values())
                    found.append([kind(**dict(zip(axes, row, strict=True))) for row in rows])
        return found

    def _pivots(self, value: Any) -> list[Floats]:
        """Pairs of distances: one, or several."""
        pairs = value if isinstance(value, list) and value and isinstance(value[0], list) else [value]
        with self._located("blocks", key="pivots"):
            found = [_read("pivots", pair) for pair in pairs]
            if any(len(pair) != 2 for pair in found):
                raise StudyError(
                    "{} must be a pair, [0.2, 0.15] (side +, side -), or a list of pairs", "pivots", value=value
                )
            return found

    def _blocks_of_csv(self, table: Path) -> Blocks:
        try:
            rows = csv_rows(table.read_text("utf-8-sig"))
        except OSError as error:
            raise self._wrong("blocks", "csv", f"{table} cannot be read: {error.strerror}") from None
        except UnicodeDecodeError:
            raise self._wrong("blocks", "csv", f"{table} is no text table in UTF-8; save it as CSV") from None
        columns: dict[str, Any] = {}
        headings, rows = (rows[0][1], rows[1:]) if len(rows) > 1 else (list[str](), [])
        for name in _PARAMETERS:
            ends = _SIDES if name in _SIDED and name + _SIDES[0] in headings else ("",)
            if all(name + end in headings for end in ends):
                places = [headings.index(name + end) for end in ends]
                cells = []
                for line, row in rows:
                    with _in_table(table, line):
                        cells.append([_number(name, row[k] if k < len(row) else "") for k in places])
                columns[name] = np.squeeze(cells, axis=1) if len(ends) == 1 else np.array(cells)
        if not any({*needed} <= columns.keys() for needed in _BODIES):
            raise self._wrong(
                "blocks",
                "csv",
                f"{table} needs columns p (rad/s) and alpha (rad, or 12deg), or width and height (m), or pivots_plus, "
                "pivots_minus, height_of_mass and gyration (m), and rows",
            )
        if {"p", "alpha"} <= columns.keys():
            try:
                return Blocks(**{name: columns[name] for name in ("p", "alpha", "restitution") if name in columns})
            except RockingError as error:
                where = f"{table}, whose block 0 is in line {rows[0][0]}: "
                line = _line(self.text, "blocks", "csv", 0)
                raise _moved(error, StudyError, self.file, line, where) from None
        bodies = []
        for (line, _), values in zip(rows, zip(*columns.values(), strict=True), strict=True):
            with _in_table(table, line):
                bodies.append(_body(dict(zip(columns, values, strict=True))))
        return Blocks.of(bodies)

    def _motions(self, scales: Scales) -> tuple[list[Motion], list[str], list[str]]:
        """Motions that can be read and scaled, their records, and a sentence for each that cannot, if it may be so."""
        given = self._table("motions")
        with self._located("motions", key="dt"):
            Request.checked(given.get("dt"), None)
        with self._located("motions", key="units"):
            Request.checked(None, given.get("units"))
        records: dict[str, str] = {}  # by their paths or names, what stands for each in the file
        for name in given.get("records", []):
            with self._located_record(name):
                records |= dict.fromkeys(expanded([self._beside(name)]), name)
        motions, names, skipped = [], [], []
        for path, name in records.items():
            try:
                with self._located_record(name):
                    motion = self._record(path, several=len(records) > 1)
                    scales.factors(motion)  # it can be scaled
            except (UnreadableRecord, InvalidMotion) as error:
                if not given.get("skip_unreadable", False):
                    raise
                skipped.append(str(error))
            else:
                motions.append(motion)
                names.append(self._as_written(path))
        for k in range(len(given.get("pulses", []))):
            motions += self._pulses(k)
        if not motions:
            raise self._wrong("motions", None, "[motions] holds no motion that can be read: name records or pulses")
        return motions, names + [""] * (len(motions) - len(names)), skipped

    def _record(self, path: str, *, several: bool) -> Motion:
        given = self._table("motions")
        about = {"dt": given.get("dt"), "units": given.get("units")}
        channel = None if "channel" not in given else str(given["channel"])
        motion = named_motion(path, channel=channel, several=several, **about)
        if "vertical" not in given:
            return motion
        both = motion.with_vertical(named_vertical(self._beside(given["vertical"]), path, channel=channel, **about))
        for sentence in vertical_notes(both):
            note(f"{path}: {sentence}")
        return both

    def _beside(self, name: str) -> str:
        """Path of a file that lies beside the study's own, or the name of anything else."""
        path = str(self.file.parent / name)
        return path if Path(path).exists() or any(mark in name for mark in "*?[") else name

    def _as_written(self, path: str) -> str:
        """Return the path of a record relative to the file, as it names those beside it."""
        beside = Path(path).is_relative_to(self.file.parent) and Path(path).exists()
        return str(Path(path).relative_to(self.file.parent)) if beside else path

    def _pulses(self, k: int) -> list[Motion]:
        pulse, table = dict(self._table("motions.pulses", k)), "motions.pulses"
        with self._located(table, key="family", occurrence=k):
            family = pulse_family(str(pulse.pop("family", "")))
        axes: dict[str, Sequence[Any] | Floats] = {}
        for key, value in pulse.items():
            with self._located(table, key=key, occurrence=k):
                quantity = family.quantity(key)
                axes[key] = [value] if quantity is None else _read(key, value, quantity)
        with self._located(table, occurrence=k):
            return [family.motion(dict(zip(axes, values, strict=True))) for values in itertools.product(*axes.values())]

    def _numbers(self, table: str, key: str, value: Any) -> Floats:
        with self._located(table, key=key):
            return _read(key, value)

    @contextlib.contextmanager
    def _located(self, *tables: str, key: str | None = None, occurrence: int = 0) -> Iterator[None]:
        """Give a mistake the line of this key, or of the first that it names in these tables, or of the heading."""
        try:
            yield
        except RockingError as error:
            named = error.message.arguments if key is None else (key,)
            places = [(table, name) for table in tables for name in named if name in self._table(table, occurrence)]
            table, name = places[0] if places else (tables[0], None)
            line = _line(self.text, table, name, occurrence)
            raise _moved(error, StudyError, self.file, line) from None

    @contextlib.contextmanager
    def _located_record(self, name: str) -> Iterator[None]:
        """Give what is wrong with a record the line that names it."""
        try:
            yield
        except (UnreadableRecord, InvalidMotion) as error:
            first = _line(self.text, "motions", "records", 0)
            lines = self.text.splitlines()[first - 1 :]
            line = next((k for k, text in enumerate(lines, start=first) if name in text), first)
            raise _moved(error, type(error), self.file, line) from None

    def _wrong(self, table: str, key: str | None, message: str, *names: str, value: object = None) -> StudyError:
        """Return the error that says what is wrong with a key of a table, or with the table."""
        line = _line(self.text, table, key, 0)
        return StudyError(message, *names, path=str(self.file), line=line, value=value)


def _moved(error: RockingError, kind: type[_Kept], file: Path, line: int, where: str = "") -> _Kept:
    """Return an error as one of this line, with all its data; what it says of a file of its own comes before."""
    where += error.text().removesuffix(error.message.text())
    return kind(where + error.message.template, *error.message.arguments, path=str(file), line=line, value=error.value)


@contextlib.contextmanager
def _in_table(table: Path, line: int) -> Iterator[None]:
    """Give a mistake the line of a table of blocks."""
    try:
        yield
    except RockingError as error:
        raise _moved(error, StudyError, table, line) from None


def _nearest(name: str, known: Iterable[str]) -> str:
    """Say which known name is meant, or which there are."""
    names = [*known]
    return checks.meant(name, names, f"there are {', '.join(names)}")


def _number(key: str, text: str) -> float:
    return _QUANTITIES.get(key, quantities.number)(text, key)


def _read(key: str, value: Any, quantity: quantities.Quantity | None = None) -> Floats:
    """Numbers of a value: one, a list, or a range."""
    quantity = quantity or _QUANTITIES.get(key, quantities.number)
    if isinstance(value, str):
        return quantities.values(value, key, quantity)
    each = value if isinstance(value, list) else [value]
    return np.array([quantity(one if isinstance(one, str) else repr(one), key) for one in each])


def _body(given: Mapping[str, Any]) -> Block:
    """Rectangle or body on pivots from one value of each."""
    if "width" in given:
        return Block(**given)
    return Block.from_pivots(
        given["pivots"],
        given["height_of_mass"],
        given["gyration"],
        restitution=given.get("restitution"),
        mass=given.get("mass"),
    )


def _listed(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _line(text: str, table: str, key: str | None, occurrence: int) -> int:
    """Line of a key in a table, the occurrence-th of that name; of its heading where there is no key; 1 if unseen."""
    if "." in table and not re.search(rf"^\s*\[+\s*{re.escape(table)}\b", text, re.MULTILINE):
        parent, _, name = table.rpartition(".")  # it is written within its parent
        return _line(text, parent, name, 0)
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
