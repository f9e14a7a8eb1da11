"""A study as a text file: blocks, motions, scales and rules in TOML, every mistake with its line."""

from __future__ import annotations

import contextlib
import itertools
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from rocking import checks, quantities
from rocking.arrays import Floats
from rocking.block import Block, Blocks
from rocking.errors import InvalidMotion, InvalidOption, RockingError, StudyError, UnreadableRecord
from rocking.motion.formats.source import Request
from rocking.motion.motion import Motion
from rocking.motion.named import expanded, named_motion, named_vertical
from rocking.motion.scaling import SCALES, Measure, MeasureName
from rocking.named_pulses import pulse_family
from rocking.plausibility import vertical_notes
from rocking.product import Product, Scales
from rocking.progress import note
from rocking.studies.outcomes import OUTCOMES, chosen_outcomes
from rocking.studies.refine import Tolerances, tolerances_of
from rocking.studies.report import FragilityPlan, ReportPlan, SpectrumPlan
from rocking.tables import csv_rows
from rocking.treatment import treatment

TEMPLATE: Final = """\
# A study: every block under every motion at every scale. Numbers may be written 1.5, [1.0, 2.0], or as a
# range "START:STOP:COUNT" with ":log" for equal ratios; accelerations as "0.5g", angles as "12deg".

[blocks]                        # the full grid of these; or: csv = "blocks.csv" with these columns
p = "1.5:6:20"                  # frequency parameter, rad/s
alpha = "5deg:20deg:16"         # slenderness
restitution = 0.9               # leave out for that of angular momentum (Housner's)
# width = [0.3, 0.6]            # instead of p and alpha: rectangles, m,
# height = "1:2:5"
# offset = 0.02                 # with the centre of mass off the middle, positive to side +
# pivots = [[0.2, 0.15]]        # or bodies: distances of the pivots of side + and side - from the centre of mass, m,
# height_of_mass = 0.6          # its height, and the radius of gyration
# gyration = 0.4

[motions]
records = ["ridgecrest-clc-090", "el-centro-meloland-270"]   # files, folders, patterns, shipped records
# channel = "1"
# vertical = "3"                # a channel of the same file, or a record: moves the ground up and down besides
# units = "g"                   # of files that do not say theirs
# dt = 0.01
skip_unreadable = false         # true: leave out records that cannot be read, and list them

# [[motions.pulses]]            # any number of these; lists and ranges make one pulse each
# family = "one_sine"
# amplitude = 1.0
# frequency = "0.5:5:10:log"

[scales]                        # at most one of factor, pga, pgv, sa (with period, damping)
pga = ["0.2g", "0.4g", "0.8g"]
polarity = "+"                  # or "-", "both"
# refine = 1e-3                 # halve gaps between scales of which one overturns a block, to this relative width;
#                               # or { overturning = 1e-3, complete_chattering = 1e-6 }

[simulation]
model = "nonlinear"             # or "linear"
chattering = "certified"
# duration = 40.0
# outcomes = ["overturned", "peak_rotation"]   # keep these, and stalled, unfinished and stopped; by default all

[report.fragility]              # what `rocking study report` makes; may be changed later
measure = "pga"                 # pga, pgv, sa (with period, damping), pga_ratio, pgv_ratio
limits = { overturning = inf }  # peak rotation over slenderness, as half = 0.5; inf: overturning
blocks = "each"                 # a curve for each block; or "together": one for all

# [report.spectrum]
# fractiles = [0.16, 0.5, 0.84]
"""


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_list_of_texts(value: Any) -> bool:
    return isinstance(value, list) and all(map(_is_text, value))


#: Keys of every table.
_KEYS: Final[Mapping[str, frozenset[str]]] = {
    "blocks": frozenset(
        {"p", "alpha", "restitution", "csv", "width", "height", "offset", "pivots", "height_of_mass", "gyration"}
    ),
    "motions": frozenset({"records", "channel", "vertical", "units", "dt", "skip_unreadable", "pulses"}),
    "scales": frozenset({"factor", "pga", "pgv", "sa", "period", "damping", "polarity", "refine"}),
    "simulation": frozenset({"model", "chattering", "duration", "outcomes"}),
    "report": frozenset({"fragility", "spectrum"}),
}

#: Keys whose values are no numbers: what they are, in words, and whether a value is that.
_KINDS: Final[Mapping[str, tuple[str, Callable[[Any], bool]]]] = {
    **dict.fromkeys(("csv", "vertical", "units", "polarity", "model", "chattering"), ("text", _is_text)),
    "channel": ("text or a whole number", lambda value: _is_text(value) or type(value) is int),
    **dict.fromkeys(("records", "outcomes"), ("a list of texts", _is_list_of_texts)),
    "skip_unreadable": ("true or false", lambda value: isinstance(value, bool)),
    "pulses": ("tables, [[motions.pulses]]", lambda value: all(isinstance(each, dict) for each in value)),
}

_QUANTITIES: Final[Mapping[str, Callable[[str, str], float]]] = {
    "alpha": quantities.tilt,
    **dict.fromkeys(("width", "height", "pivots", "height_of_mass", "gyration"), quantities.length),
    "pga": quantities.acceleration,
    "sa": quantities.acceleration,
}


#: What says together what a block is, and what may go with it.
_BODIES: Final[Mapping[tuple[str, ...], tuple[str, ...]]] = {
    ("p", "alpha"): ("restitution",),
    ("width", "height"): ("offset", "restitution"),
    ("pivots", "height_of_mass", "gyration"): ("restitution",),
}

#: What both sides of a block may have of their own, in columns of a table that end so.
_SIDED: Final = ("p", "alpha", "pivots", "restitution")
_SIDES: Final = ("_plus", "_minus")


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

    Raises
    ------
    StudyError
        If the file cannot be read, or a line of it is wrong; the message has the line.
    UnreadableRecord
        If a record cannot be read.
    """
    file = checks.path(path, "the file of a study", StudyError)
    try:
        text = file.read_text("utf-8")
        tables = tomllib.loads(text)
    except OSError as error:
        raise StudyError(f"{file} cannot be read: {error.strerror or error}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise StudyError(f"{file} is no TOML file: {error}; correct it") from None
    return _Reader(file, text, tables).study()


class _Reader:
    """Tables of a file, and where each key of them stands."""

    def __init__(self, file: Path, text: str, tables: dict[str, Any]) -> None:
        self.file, self.text, self.tables = file, text, tables

    def study(self) -> StudyFile:
        self._check_keys()
        blocks, scales = self._blocks(), self._scales()
        motions, names, skipped = self._motions(scales)
        rules = self.tables.get("simulation", {})
        with self._line_told("simulation", "chattering"):
            chattering = treatment(rules.get("chattering", "certified"))
        polarity = self.tables.get("scales", {}).get("polarity", "+")
        with self._lines_told("simulation", "scales", "blocks"):
            product = Product(
                blocks,
                tuple(motions),
                scales,
                polarity,
                rules.get("model", "nonlinear"),
                chattering,
                rules.get("duration"),
            )
        with self._line_told("simulation", "outcomes"):
            kept = chosen_outcomes(rules.get("outcomes"))
        return StudyFile(product, tuple(skipped), self._report(kept), self._refine(product, kept), kept, tuple(names))

    def _scales(self) -> Scales:
        given = {
            name: value for name, value in self.tables.get("scales", {}).items() if name not in ("polarity", "refine")
        }
        measures = {name: self._numbers("scales", name, given.pop(name)) for name in SCALES if name in given}
        with self._lines_told("scales"):
            if len(measures) > 1:
                raise InvalidOption(f"motions can be scaled to one measure only, not to {' and '.join(measures)}")
            if not measures and given:
                raise InvalidOption(f"{next(iter(given))} belongs to sa: give that as well, or neither")
            name, levels = next(iter(measures.items()), ("factor", None))
            if levels is not None:
                checks.positive_numbers(levels, name, InvalidOption)
            return Scales.of(levels, Measure(cast(MeasureName, name), **given))

    def _refine(self, product: Product, kept: tuple[str, ...]) -> Tolerances | None:
        refine = self.tables.get("scales", {}).get("refine")
        with self._line_told("scales", "refine"):
            return None if refine is None else tolerances_of(product, refine, kept)

    def _report(self, kept: tuple[str, ...]) -> ReportPlan | None:
        if "report" not in self.tables:
            return None
        plans: dict[str, Any] = {}
        for name, kind in {"fragility": FragilityPlan, "spectrum": SpectrumPlan}.items():
            given = self.tables["report"].get(name)
            if given is None:
                continue
            table = f"report.{name}"
            if not isinstance(given, dict):
                raise self._wrong("report", name, f"{name} must be a table, [{table}]")
            known = [each.name for each in fields(kind)]
            for key in given:
                if key not in known:
                    raise self._wrong(table, key, f"[{table}] has no {key}; it takes {', '.join(known)}")
            with self._lines_told(table):
                plans[name] = kind(**given)
                plans[name].check(kept)
        return ReportPlan(**plans)

    def _check_keys(self) -> None:
        for table, content in self.tables.items():
            if table not in _KEYS:
                raise self._wrong(table, None, f"there is no table [{table}]; there are {', '.join(_KEYS)}")
            if not isinstance(content, dict):
                raise self._wrong(None, table, f"{table} must be a table, [{table}]")
            for key in content:
                if key not in _KEYS[table]:
                    known = ", ".join(sorted(_KEYS[table]))
                    raise self._wrong(table, key, f"[{table}] has no {key}; it takes {known}")
                what, is_that = _KINDS.get(key, ("", lambda value: True))
                if not is_that(content[key]):
                    raise self._wrong(table, key, f"{key} must be {what}, not {content[key]!r}")
        for needed in ("blocks", "motions"):
            if needed not in self.tables:
                raise StudyError(f"{self.file}: the table [{needed}] is missing")

    def _blocks(self) -> Blocks:
        given = self.tables["blocks"]
        if "csv" in given:
            if len(given) > 1:
                raise self._wrong("blocks", "csv", "csv goes without other keys")
            return self._blocks_of_csv(self.file.parent / given["csv"])
        self._check_description(given)
        axes: dict[str, Any] = {
            name: self._pivots(value) if name == "pivots" else self._numbers("blocks", name, value)
            for name, value in given.items()
        }
        with self._lines_told("blocks"):
            if "p" in axes:
                return Blocks.grid(**axes)
            checks.grid_size({name: len(axis) for name, axis in axes.items()}, StudyError)
            return Blocks.of(
                [_body(dict(zip(axes, row, strict=True))) for row in itertools.product(*axes.values())],
            )

    def _check_description(self, given: Mapping[str, Any]) -> None:
        """Check that these keys say what a block is."""
        if not any({*all_} <= given.keys() <= {*all_, *more} for all_, more in _BODIES.items()):
            choices = ", or ".join(_listed(all_) for all_ in _BODIES)
            having = f"; it has {_listed([*given])}" if given else ""
            raise self._wrong("blocks", None, f"[blocks] needs {choices}, or csv{having}")

    def _pivots(self, value: Any) -> list[Floats]:
        """Pairs of distances: one, or several."""
        with self._line_told("blocks", "pivots"):
            pairs = value if isinstance(value, list) and value and isinstance(value[0], list) else [value]
            found = [_read("pivots", pair, quantities.length) for pair in pairs]
            if any(len(pair) != 2 for pair in found):
                raise StudyError("pivots must be a pair, [0.2, 0.15] (side +, side -), or a list of pairs")
            return found

    def _blocks_of_csv(self, table: Path) -> Blocks:
        try:
            rows = csv_rows(table.read_text("utf-8-sig"))
        except OSError as error:
            raise self._wrong("blocks", "csv", f"{table} cannot be read: {error.strerror}") from None
        except UnicodeDecodeError:
            raise self._wrong("blocks", "csv", f"{table} is no text table in UTF-8; save it as CSV") from None
        columns: dict[str, Any] = {}
        headings, given = (rows[0][1], rows[1:]) if len(rows) > 1 else ([], [])
        for name in sorted(_KEYS["blocks"] - {"csv"}):
            ends = _SIDES if name in _SIDED and f"{name}{_SIDES[0]}" in headings else ("",)
            if all(name + end in headings for end in ends):
                places = [headings.index(name + end) for end in ends]
                cells = [
                    [_cell(table, line, name, row[place] if place < len(row) else "") for place in places]
                    for line, row in given
                ]
                columns[name] = np.squeeze(cells, axis=1) if len(ends) == 1 else np.array(cells)
        if not any({*all_} <= columns.keys() for all_ in _BODIES):
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
                raise self._wrong(
                    "blocks", "csv", f"{table}, whose block 0 is in line {given[0][0]}: {error}"
                ) from None
        bodies = []
        for (line, _), row in zip(given, zip(*columns.values(), strict=True), strict=True):
            try:
                bodies.append(_body(dict(zip(columns, row, strict=True))))
            except RockingError as error:
                raise StudyError(f"{table}, line {line}: {error}") from None
        return Blocks.of(bodies)

    def _motions(self, scales: Scales) -> tuple[list[Motion], list[str], list[str]]:
        """Motions that can be read and scaled, their records, and a sentence for each that cannot, if it may be so."""
        given = self.tables["motions"]
        motions, names, skipped = [], [], []
        records = self._records()
        for path, name in records.items():
            try:
                with self._record_told(name):
                    motions.append(_scalable(self._record(path, several=len(records) > 1), scales))
                names.append(self._as_written(path))
            except (UnreadableRecord, InvalidMotion) as error:
                if not given.get("skip_unreadable", False):
                    raise
                skipped.append(str(error))
        for k in range(len(given.get("pulses", []))):
            motions += self._pulses(k)
        names += [""] * (len(motions) - len(names))
        if not motions:
            raise self._wrong("motions", None, "[motions] holds no motion that can be read: name records or pulses")
        return motions, names, skipped

    def _records(self) -> dict[str, str]:
        """Paths (relative to the study's own file) or names of all records, and what stands for each in the file."""
        with self._lines_told("motions"):
            Request.checked(self.tables["motions"].get("dt"), self.tables["motions"].get("units"))
        found: dict[str, str] = {}
        for name in self.tables["motions"].get("records", []):
            with self._record_told(name):
                found |= dict.fromkeys(expanded([self._beside(name)]), name)
        return found

    def _record(self, path: str, *, several: bool) -> Motion:
        given = self.tables["motions"]
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
        pulse = dict(self.tables["motions"]["pulses"][k])
        with self._line_told("motions.pulses", "family", k):
            family = pulse_family(str(pulse.pop("family", "")))
        axes: dict[str, Sequence[Any] | Floats] = {}
        for key, value in pulse.items():
            with self._line_told("motions.pulses", key, k):
                quantity = family.quantity(key)
                axes[key] = [value] if quantity is None else _read(key, value, quantity)
        with self._lines_told("motions.pulses", occurrence=k):
            return [family.motion(dict(zip(axes, values, strict=True))) for values in itertools.product(*axes.values())]

    def _numbers(self, table: str, key: str, value: Any) -> Floats:
        with self._line_told(table, key):
            return _read(key, value, _QUANTITIES.get(key, quantities.number))

    @contextlib.contextmanager
    def _line_told(self, table: str, key: str, occurrence: int = 0) -> Iterator[None]:
        """Give a mistake the line of the key that it is in."""
        try:
            yield
        except RockingError as error:
            raise self._wrong(table, key, str(error), occurrence) from None

    @contextlib.contextmanager
    def _lines_told(self, *tables: str, occurrence: int = 0) -> Iterator[None]:
        """Give a mistake the line of the key of these tables that its sentence names first, or of the first heading."""
        try:
            yield
        except RockingError as error:
            sentence = str(error)
            places = [
                (_position(key, sentence), table, key) for table in tables for key in self._keys(table, occurrence)
            ]
            named = sorted(place for place in places if place[0] >= 0)
            _, table, key = named[0] if named else (0, tables[0], None)
            raise self._wrong(table, key, sentence, occurrence) from None

    @contextlib.contextmanager
    def _record_told(self, name: str) -> Iterator[None]:
        """Give what is wrong with a record the line that names it."""
        try:
            yield
        except (UnreadableRecord, InvalidMotion) as error:
            first = _line(self.text, "motions", "records", 0)
            lines = self.text.splitlines()[first - 1 :]
            line = next((k for k, text in enumerate(lines, start=first) if name in text), first)
            raise type(error)(f"{self.file}, line {line}: {error}") from None

    def _keys(self, table: str, occurrence: int) -> list[str]:
        content: Any = self.tables
        for name in table.split("."):
            content = content.get(name, {})
        return [*(content[occurrence] if isinstance(content, list) else content)]

    def _wrong(self, table: str | None, key: str | None, sentence: str, occurrence: int = 0) -> StudyError:
        return StudyError(f"{self.file}, line {_line(self.text, table, key, occurrence)}: {sentence}")


def _scalable(motion: Motion, scales: Scales) -> Motion:
    """Return a motion, checked that it can be scaled."""
    scales.factors(motion)
    return motion


def _position(word: str, sentence: str) -> int:
    """Where a word stands in a sentence; -1 if it does not."""
    found = re.search(rf"\b{re.escape(word)}\b", sentence)
    return found.start() if found else -1


def _read(key: str, value: Any, quantity: quantities.Quantity) -> Floats:
    """Numbers of a value: one, a list, or a range."""
    if isinstance(value, str):
        return quantities.values(value, key, quantity)
    each = value if isinstance(value, list) else [value]
    return np.array([quantity(one if isinstance(one, str) else repr(one), key) for one in each])


def _body(given: Mapping[str, Any]) -> Block:
    """Rectangle or body on pivots from one value of each."""
    if "width" in given:
        return Block(**given)
    return Block.from_pivots(
        given["pivots"], given["height_of_mass"], given["gyration"], restitution=given.get("restitution")
    )


def _listed(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _cell(table: Path, line: int, name: str, text: str) -> float:
    try:
        return _QUANTITIES.get(name, quantities.number)(text, name)
    except RockingError as error:
        raise StudyError(f"{table}, line {line}: {error}") from None


def _line(text: str, table: str | None, key: str | None, occurrence: int) -> int:
    """Line of a key in a table, the occurrence-th of that name; of its heading where there is no key; 1 if unseen."""
    if table is not None and "." in table and not re.search(rf"^\s*\[+\s*{re.escape(table)}\b", text, re.MULTILINE):
        parent, _, name = table.rpartition(".")  # it is written within its parent
        return _line(text, parent, name, 0)
    here, seen, heading_line = None, -1, 1
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
