"""A study as a text file: bodies, motions, scales and rules in TOML, every mistake with its line."""

from __future__ import annotations

import dataclasses
import fnmatch
import glob
import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from rocking import records
from rocking.block import Blocks
from rocking.block.body import Bodies
from rocking.core import checks
from rocking.core.progress import note
from rocking.core.tables import counted, csv_rows
from rocking.engine.treatment import treatment
from rocking.errors import InvalidMotion, InvalidOption, RockingError, StudyError, UnreadableRecord
from rocking.inputs import quantities
from rocking.inputs.bodies import block_of, body_of, check_parameters, note_likely_mistakes, quantity_of, shape_of
from rocking.inputs.declared import BLOCK, COUPLES, FORCES, HELD, INPUTS, noted_acceleration
from rocking.inputs.notes import motion_notes
from rocking.inputs.pulses import pulse_family
from rocking.inputs.toml import Tables, in_line, moved, nearest
from rocking.motion.motion import Motion
from rocking.motion.scaling import FACTOR, Measure, MeasureName
from rocking.records.formats.source import Request
from rocking.records.named import expanded, is_there, named_motion
from rocking.simulation.ensemble import Product, Scales
from rocking.studies.product import OUTCOMES, chosen_outcomes
from rocking.studies.report import PLANS, ReportPlan, check_part

#: A file to start from, with comments.
TEMPLATE: Final = Path(__file__).with_name("template.toml").read_text("utf-8")

#: What motions may be scaled to, and how levels are read.
_MEASURES: Final[Mapping[str, quantities.Quantity]] = {
    "factor": quantities.number,
    "pga": noted_acceleration,
    "pgv": quantities.velocity,
    "sa": noted_acceleration,
}

#: Keys of restraints: of those that are tables one word for several.
_HELD: Final = tuple(f"{name}s" if name in FORCES else name for name in HELD)

#: Tables of a file and their keys.
SCHEMA: Final[Mapping[str, tuple[str, ...]]] = {
    "blocks": ("csv", *BLOCK, *_HELD),
    "motions": ("records", "channel", "vertical", "units", "dt", "skip_unreadable", "pulses"),
    "scales": (*_MEASURES, "period", "damping", "polarity"),
    "simulation": ("model", "chattering", "duration", "outcomes"),
    "report": tuple(PLANS),
    **{f"report.{name}": tuple(each.name for each in dataclasses.fields(plan)) for name, plan in PLANS.items()},
}

#: Keys whose values are no numbers, and what these must be.
_TYPES: Final[Mapping[str, tuple[str, ...]]] = {
    "text": ("csv", "vertical", "units", "polarity", "model", "chattering"),
    "text or a whole number": ("channel",),
    "a list of texts": ("records", "outcomes"),
    "true or false": ("one_sided", "skip_unreadable"),
    "a table": tuple(PLANS),
    "tables, [[blocks.{}]]": tuple(f"{name}s" for name in FORCES),
    "tables, [[motions.{}]]": ("pulses",),
}

#: What both sides of a block may have of their own, in columns of a table that end so.
_SIDES: Final = ("_plus", "_minus")
_SIDED: Final = tuple(name for name in BLOCK if INPUTS[name].values != "one")


@dataclasses.dataclass(frozen=True)
class StudyFile:
    """Description of a study in a file.

    Attributes
    ----------
    product : Product
        Blocks, motions, scales and rules.
    skipped : tuple of str
        A sentence for each record that could not be read, where the file says to go on.
    report : ReportPlan or None
        Results to make.
    outcomes, records : tuple of str
        As for `rocking.study`; and the name of the record of each motion, relative to the file; empty of a pulse.
    """

    product: Product
    skipped: tuple[str, ...]
    report: ReportPlan | None
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
    """
    tables = Tables(path)
    _check_tables(tables)
    rules, given = tables.table("simulation"), tables.table("scales")
    blocks, scales = _bodies(tables), _scales(tables)
    motions, names, skipped = _motions(tables, scales)
    with tables.located("simulation", key="chattering"):
        chattering = treatment(rules.get("chattering", "certified"))
    model, polarity = rules.get("model", "nonlinear"), given.get("polarity", "+")
    with tables.located("simulation", "scales", "blocks"):
        product = Product(blocks, tuple(motions), scales, polarity, model, chattering, rules.get("duration"))
        kept = chosen_outcomes(rules.get("outcomes"))
    plans: dict[str, Any] = {}
    for name, options in tables.table("report").items():
        with tables.located(f"report.{name}"):
            plans[name] = PLANS[name](**options)
            check_part(plans[name], kept)
    longest = max(motion.end for motion in motions)
    if plans and product.duration is not None and product.duration < longest:
        raise tables.wrong(
            "simulation",
            "duration",
            f"{{}} ends before the longest motion, of {longest:g} s, and a report needs whole responses: leave it out",
            "duration",
        )
    report = ReportPlan(**plans) if "report" in tables.tables else None
    return StudyFile(product, tuple(skipped), report, kept, tuple(names))


def _check_tables(tables: Tables) -> None:
    """Check names of tables and keys, and that values which are no numbers are what they must be."""
    for table, content in tables.tables.items():
        if table not in SCHEMA:
            hint = nearest(table, (name for name in SCHEMA if "." not in name))
            raise tables.wrong(table, None, f"there is no table [{{}}]; {hint}", table)
        if not isinstance(content, dict):
            raise tables.wrong(table, None, f"{{}} must be one table, [{table}], once", table)
        _check_keys(tables, table)
    for needed in ("blocks", "motions"):
        if needed not in tables.tables:
            raise StudyError("the table [{}] is missing", needed, path=str(tables.file))


def _check_keys(tables: Tables, table: str) -> None:
    for key, value in tables.table(table).items():
        if key not in SCHEMA[table]:
            raise tables.wrong(table, key, f"[{table}] has no {{}}; {nearest(key, SCHEMA[table])}", key)
        wanted = next((kind for kind, keys in _TYPES.items() if key in keys and table.count(".") == 0), "")
        several = dict if wanted.startswith("tables") else str
        is_list = isinstance(value, list) and all(isinstance(each, several) for each in value)
        kind = {"text": str, "true or false": bool, "a table": dict}.get(wanted)
        is_right = is_list if kind is None else isinstance(value, kind)
        if wanted == "text or a whole number":
            is_right = isinstance(value, str) or type(value) is int
        if wanted and not is_right:
            sentence = f"{{}} must be {wanted.format(key)}, not {checks.shown(value)}"
            raise tables.wrong(table, key, sentence, key, value=value)
        if wanted == "a table":
            _check_keys(tables, f"{table}.{key}")


def _bodies(tables: Tables) -> Bodies:
    """Bodies of all combinations of what [blocks] gives, or of the table that it names."""
    given = tables.table("blocks")
    held = [name for name in given if name in _HELD]
    if held and not {"width", "half_width", "pivots"} & given.keys():
        sentence = "{} goes with width, half_width and pivots of a block"
        raise tables.wrong("blocks", held[0], sentence, held[0])
    if "csv" in given:
        if len(given) > 1:
            raise tables.wrong("blocks", "csv", "{} goes without other keys", "csv")
        return _blocks_of_csv(tables, tables.file.parent / given["csv"])
    with tables.located("blocks"):
        shape_of(given)
    axes: dict[str, Any] = {}
    described = [name for name in given if name not in _HELD]
    for name in (*described, *(name for name in ("one_sided", "lean") if name in given)):
        with tables.located("blocks", key=name):
            axes[name] = INPUTS[name].axis(given[name])
    restraints = [*_restraints(tables)]
    with tables.located("blocks"):
        if "p" in axes:
            return Blocks.grid(**axes)
        restraint_counts = {f"restraint {k}": len(each) for k, each in enumerate(restraints, 1)}
        checks.grid_size({name: len(axis) for name, axis in axes.items()} | restraint_counts, StudyError)
        rows = [*itertools.product(*axes.values(), *restraints)]
        values = [dict(zip(axes, row, strict=False)) for row in rows]
        blocks = [block_of(each) for each in values]
        bodies: list[Any] = [
            body_of(block, each, row[len(axes) :]) for block, each, row in zip(blocks, values, rows, strict=True)
        ]
        note_likely_mistakes(blocks, bodies)
        return Blocks.of(bodies)


def _restraints(tables: Tables) -> Iterator[list[Any]]:
    """Give what each restraint may be: one, or several where its numbers are lists or ranges."""
    blocks = tables.table("blocks")
    for name, couple in COUPLES.items():
        if name in blocks:
            with tables.located("blocks", key=name):
                yield [couple(value) for value in INPUTS[name].axis(blocks[name])]
    for name, force in FORCES.items():
        for k, given in enumerate(blocks.get(f"{name}s", [])):
            table, axes = f"blocks.{name}s", dict[str, Any]()
            with tables.located(table, occurrence=k):
                check_parameters(force, given, f"[[{table}]]")
            for key, value in given.items():
                with tables.located(table, key=key, occurrence=k):
                    numbers = [value] if isinstance(value, bool) else quantities.axis(value, key, quantity_of(key))
                    axes[key] = [*numbers]
            with tables.located(table, occurrence=k):
                yield [force(**dict(zip(axes, row, strict=True))) for row in itertools.product(*axes.values())]


def _blocks_of_csv(tables: Tables, table: Path) -> Blocks:
    try:
        rows = csv_rows(table.read_text("utf-8-sig"))
    except OSError as error:
        raise tables.wrong("blocks", "csv", f"{table} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise tables.wrong("blocks", "csv", f"{table} is no text table in UTF-8; save it as CSV") from None
    headings, rows = (rows[0][1], rows[1:]) if len(rows) > 1 else (list[str](), [])
    _check_headings(tables, table, headings)
    columns = _columns(table, headings, rows)
    try:
        shape_of(columns)
        if "p" in columns:
            arrays: dict[str, Any] = {name: np.array(column) for name, column in columns.items()}
            return Blocks(**arrays)
    except RockingError as error:
        where = f"{table}, whose block 0 is in line {rows[0][0]}: " if rows else f"{table}: "
        raise moved(error, StudyError, tables.file, tables.line_of("blocks", "csv"), where) from None
    blocks = []
    for (line, _), values in zip(rows, zip(*columns.values(), strict=True), strict=True):
        with in_line(table, line):
            blocks.append(block_of(dict(zip(columns, values, strict=True))))
    note_likely_mistakes(blocks)
    return Blocks.of(blocks)


def _columns(table: Path, headings: Sequence[str], rows: Sequence[tuple[int, list[str]]]) -> dict[str, Any]:
    """Values of each column that describes a block; those of both sides beside each other."""
    columns: dict[str, Any] = {}
    for line, row in rows:
        with in_line(table, line):
            if len(row) != len(headings):
                raise StudyError(f"{counted(len(row), 'cell')} under {counted(len(headings), 'column')}; correct it")
            cells = dict(zip(headings, row, strict=True))
            for name in BLOCK:
                ends = [name + end for end in _SIDES if name in _SIDED]
                if ends and {*ends} <= cells.keys():
                    columns.setdefault(name, []).append(tuple(INPUTS[name].one(cells[end]) for end in ends))
                elif name in cells:
                    columns.setdefault(name, []).append(INPUTS[name].one(cells[name]))
    return columns


def _check_headings(tables: Tables, table: Path, headings: Sequence[str]) -> None:
    """Refuse columns that are there twice, or that a block could have and this table cannot say."""
    known = [*BLOCK, *(name + end for name in _SIDED for end in _SIDES)]
    for name in dict.fromkeys(headings):
        fault = ""
        if name in known and headings.count(name) > 1:
            fault = "is there twice"
        elif name in _HELD:
            fault = "cannot be given in a table: give it under [blocks]"
        elif name not in known and (meant := checks.meant(name, known, "")):
            fault = f"is no column of blocks; {meant}"
        if fault:
            raise tables.wrong("blocks", "csv", f"column {name} of {table} {fault}")


def _scales(tables: Tables) -> Scales:
    given = tables.table("scales")
    measures = [name for name in _MEASURES if name in given]
    if len(measures) > 1:
        listed = " and ".join(["{}"] * len(measures))
        sentence = f"motions can be scaled to one measure only, not to {listed}"
        raise tables.wrong("scales", measures[0], sentence, *measures)
    options = {option: given[option] for option in ("period", "damping") if option in given}
    for option in options:
        if "sa" not in given:
            raise tables.wrong("scales", option, "{} goes with {}, and only with it", option, "sa")
    if "sa" in given and "period" not in given:
        raise tables.wrong("scales", "sa", "{} needs {}, in s", "sa", "period")
    with tables.located("scales"):
        if not measures:
            return Scales.of(None, FACTOR)
        (name,) = measures
        with tables.located("scales", key=name):
            values = quantities.axis(given[name], name, _MEASURES[name])
            checks.positive_numbers(values, name, InvalidOption)
        return Scales.of(values, Measure(cast(MeasureName, name), **options))


def _motions(tables: Tables, scales: Scales) -> tuple[list[Motion], list[str], list[str]]:
    """Motions that can be read and scaled, their records, and a sentence for each that cannot, if it may be so."""
    given = tables.table("motions")
    for key in ("dt", "units"):
        with tables.located("motions", key=key):
            Request.checked(**{"dt": None, "units": None, key: given.get(key)})
    if "vertical" in given and not given.get("records"):
        raise tables.wrong("motions", "vertical", "{} is that of the records, and there are none", "vertical")
    found: dict[str, str] = {}  # by their paths or names, what stands for each in the file
    for name in given.get("records", []):
        with tables.located_record(name):
            found |= dict.fromkeys(_records_of(tables.file.parent, name), name)
    motions, names, skipped = [], [], []
    for path, name in found.items():
        try:
            with tables.located_record(name):
                motion = _record(tables, path, several=len(found) > 1)
                scales.factors(motion)  # it can be scaled
        except (UnreadableRecord, InvalidMotion) as error:
            if not given.get("skip_unreadable", False):
                raise
            skipped.append(str(error))
        else:
            motions.append(motion)
            beside = Path(path).is_relative_to(tables.file.parent) and is_there(path)
            names.append(str(Path(path).relative_to(tables.file.parent)) if beside else path)
    for k in range(len(given.get("pulses", []))):
        motions += _pulses(tables, k)
    if not motions:
        raise tables.wrong("motions", None, "[motions] holds no motion that can be read: name records or pulses")
    return motions, names + [""] * (len(motions) - len(names)), skipped


def _record(tables: Tables, path: str, *, several: bool) -> Motion:
    given = tables.table("motions")
    about = {name: given[name] for name in ("dt", "units") if name in given}
    if "channel" in given:
        about["channel"] = str(given["channel"])
    if "vertical" in given:  # a file beside the study's own, or the name of anything else
        beside = str(tables.file.parent / given["vertical"])
        about["vertical"] = beside if is_there(beside) else given["vertical"]
    motion = named_motion(path, **about, several=several)
    for sentence in motion_notes(motion):
        note(f"{path}: {sentence}")
    return motion


def _records_of(parent: Path, name: str) -> list[str]:
    """Files beside the study's own, or shipped records, that a name, a folder or a pattern stands for."""
    path = str(parent / name)
    if is_there(path):
        return expanded([path])
    if not glob.has_magic(name):
        # A file of this name in the folder of the call is not meant; without one the name alone tells more.
        return [path if is_there(name) and name not in records.names() else name]
    try:
        return expanded([str(Path(glob.escape(str(parent))) / name)])
    except UnreadableRecord:
        shipped = fnmatch.filter(records.names(), name)
        if not shipped:
            raise
        return shipped


def _pulses(tables: Tables, k: int) -> list[Motion]:
    pulse, table = dict(tables.table("motions.pulses", k)), "motions.pulses"
    with tables.located(table, key="family", occurrence=k):
        family = pulse_family(str(pulse.pop("family", "")))
    axes: dict[str, Any] = {}
    for key, value in pulse.items():
        with tables.located(table, key=key, occurrence=k):
            quantity = family.quantity(key)
            axes[key] = [value] if quantity is None else quantities.axis(value, key, quantity)
    with tables.located(table, occurrence=k):
        return [family.motion(dict(zip(axes, values, strict=True))) for values in itertools.product(*axes.values())]
