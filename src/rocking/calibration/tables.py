"""Input tables of analyses: tests with observed outcomes, rotation histories, ensembles of blocks."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np

from rocking.analysis.hazard import INTENSITY_HEADINGS, normalise_heading
from rocking.analysis.levels import assign_families
from rocking.block import Blocks
from rocking.calibration.validate import ShakeTest
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import Model
from rocking.core.tables import format_count
from rocking.errors import OptionError, RecordError, RockingError
from rocking.inputs.inventory import read_labelled, read_rows
from rocking.inputs.pulses import FAMILIES, named_pulse
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.records.formats.source import Request
from rocking.records.named import load_motion, load_vertical, path_exists

_TRUTH_VALUES: Final = {"1": True, "0": False, "true": True, "false": False, "yes": True, "no": False}


@dataclass(frozen=True, eq=False)
class MeasuredHistory:
    """Measured rotation: times (s) and rotations (rad), shape (n,) each."""

    times: Floats
    rotation: Floats


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Weighted ensemble of blocks that represents an uncertain block, and its equation of motion."""

    blocks: Blocks
    weights: Floats
    model: Model


@dataclass(frozen=True)
class _Table:
    """Column names of a file, and line number and cells by column name of each row."""

    path: Path
    columns: tuple[str, ...]
    rows: tuple[tuple[int, dict[str, str]], ...]

    def numbers(self, column: str) -> Floats:
        """Return the numbers of a column."""
        return np.array([self.convert(line, row[column], float, "a number") for line, row in self.rows])

    def booleans(self, column: str) -> tuple[bool, ...]:
        """Return the truth values of a column: 1 or 0, yes or no, true or false."""
        parse, expected = _TRUTH_VALUES.__getitem__, "0 or 1, no or yes, false or true"
        return tuple(self.convert(line, row[column].lower(), parse, expected) for line, row in self.rows)

    def convert(self, line: int, text: str, parse: Callable[[str], Any], expected: str) -> Any:
        """Convert a cell, or raise an error with its line and the expected kind of value."""
        try:
            return parse(text)
        except (ValueError, KeyError):
            raise self.create_error(f"{text!r} is not {expected}; correct it", line=line, value=text) from None

    def create_error(self, message: str, *arguments: str, line: int | None = 1, value: object = None) -> RecordError:
        """Create an error about a line of the table, by default its header."""
        return RecordError(message, *arguments, path=str(self.path), line=line, value=value)


def read_calibration(path: Path, **options: Any) -> list[ShakeTest] | MeasuredHistory:
    """Read tests (see `read_tests`) or a history with columns `time_s` and `rotation_rad` or `rotation_deg`."""
    table = read_table(path)
    if {"motion", "overturned"} <= set(table.columns):
        return _create_tests(table, **options)
    if {"rotation_rad", "rotation_deg"} <= set(table.columns):
        raise table.create_error("the table must contain either rotation_rad or rotation_deg, not both")
    for column, unit in (("rotation_rad", 1.0), ("rotation_deg", np.pi / 180.0)):
        if {"time_s", column} <= set(table.columns):
            return MeasuredHistory(table.numbers("time_s"), unit * table.numbers(column))
    raise table.create_error(
        "the columns must be motion,overturned (outcomes) or time_s,rotation_rad or time_s,rotation_deg (a history), "
        f"not {','.join(table.columns)}"
    )


def read_ensemble(path: Path) -> Ensemble:
    """Read the ensemble that `Calibration.to_csv` writes."""
    inventory = read_labelled(path, expected=("weight", "model"))
    labels = [{name: str(value) for name, value in body.labels.items()} for body in inventory]
    table = _Table(path, tuple(labels[0]), tuple(zip(inventory.lines, labels, strict=True)))
    if missing := [name for name in ("weight", "model") if name not in table.columns]:
        raise table.create_error(f"expected the ensemble.csv of a calibration, with columns {' and '.join(missing)}")
    parse = {name: name for name in get_args(Model)}.__getitem__
    models = {table.convert(line, row["model"], parse, "linear or nonlinear") for line, row in table.rows}
    if len(models) > 1:
        raise table.create_error("an ensemble must have one model, not both; correct the column model", line=None)
    blocks = Blocks.from_bodies(inventory)
    if blocks.terms:
        raise table.create_error("the blocks of an ensemble have no restraints; remove their columns")
    return Ensemble(Blocks(blocks.p, blocks.alpha, blocks.restitution), table.numbers("weight"), models.pop())


def read_table(path: Path, convert_heading: Callable[[str], str] = str) -> _Table:
    """Read a CSV table or a workbook with distinct columns, whose header cells are converted."""
    cells = read_rows(path)
    if len(cells) < 2:
        raise RecordError("the table has no rows below its header", path=str(path))
    (_, header), *rows = cells
    columns = [convert_heading(cell) for cell in header]
    if duplicates := [column for column in dict.fromkeys(columns) if columns.count(column) > 1]:
        message = f"column names must be distinct; got {' and '.join(duplicates)} more than once"
        raise RecordError(message, path=str(path), line=1)
    for line, row in rows:
        if len(row) != len(columns):
            message = f"this row has {format_count(len(row), 'cell')} for {format_count(len(columns), 'column')}"
            raise RecordError(f"{message}; correct it", path=str(path), line=line)
    return _Table(path, tuple(columns), tuple((line, dict(zip(columns, row, strict=True))) for line, row in rows))


def _create_tests(table: _Table, **options: Any) -> list[ShakeTest]:
    """Create the tests of a table with these columns."""
    specimens = dict.fromkeys(row.get("specimen") or "" for _, row in table.rows)
    if len(specimens) > 1:
        count = format_count(len(specimens), "specimen")
        raise table.create_error(f"the table contains tests of {count}; use one table for each")
    overturned, motions = table.booleans("overturned"), _load_row_motions(table, **options)
    names, groups = ([row.get(column) or "" for _, row in table.rows] for column in ("name", "group"))
    return [ShakeTest(*row) for row in zip(motions, overturned, names, groups, strict=True)]


def _load_row_motions(table: _Table, **options: Any) -> tuple[Motion, ...]:
    """Read each row's motion, scaled and with its vertical. The row's channel, dt_s and units take precedence."""
    has_several_motions = len({row["motion"] for _, row in table.rows}) > 1
    loaded: dict[tuple[object, ...], Motion] = {}
    motions = []
    for line, row in table.rows:
        scale = table.convert(line, row.get("scale") or "1", _parse_finite, "a number")
        step = table.convert(line, row["dt_s"], float, "a number") if row.get("dt_s") else None
        cells = {"channel": row.get("channel"), "dt": step, "units": row.get("units")}
        cells = {name: value for name, value in cells.items() if value}
        name, vertical = row["motion"], row.get("vertical") or ""
        try:
            if (key := (name, vertical, *cells.items())) not in loaded:
                request = Request.create(**options | cells, are_defaults=has_several_motions and not cells)
                loaded[key] = _load_row_motion(table.path, name, vertical, request)
            motions.append(loaded[key] if scale == 1.0 else loaded[key].scaled(scale))
        except RockingError as error:
            record_file = str(error).removesuffix(str(error.message))  # file of the record, before the table
            message, arguments = record_file + error.message.template, error.message.arguments
            raise table.create_error(message, *arguments, line=line, value=error.value) from error
    return tuple(motions)


def _load_row_motion(table: Path, name: str, vertical: str, request: Request) -> Motion:
    """Read a record or pulse (in command syntax) with its optional vertical component."""
    record = _resolve_path(table, name)
    vertical_source = _resolve_path(table, vertical) if vertical else None
    if record != name or name.partition(":")[0] not in FAMILIES:
        return load_motion(record, request, vertical_source)
    pulse = named_pulse(name)
    return pulse if vertical_source is None else pulse.with_vertical(load_vertical(vertical_source, record, request))


def _resolve_path(table: Path, name: str) -> str:
    """Resolve a file name relative to the table's folder if such a file exists."""
    sibling = table.parent / name
    return str(sibling) if path_exists(sibling) else name


def _parse_finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value


def read_tests(
    path: str | Path,
    *,
    channel: str | None = None,
    dt: float | None = None,
    units: str | None = None,
    baseline: int | str | None = None,
    highpass: float | None = None,
) -> list[ShakeTest]:
    r"""Read tests of a specimen from a CSV table, one per row.

    Parameters
    ----------
    path : str or pathlib.Path
        Table with a header. Column "motion" contains a record file (relative to the table), a shipped record, or a
        pulse such as "one-sine:amplitude=0.2g,frequency=2Hz", and "overturned" the outcome (1 or 0, yes or no, true or
        false). Optional columns are "scale" (factor on the motion), "vertical" (file or channel of the vertical
        component), "channel", "dt_s" (step, s) and "units" (for files that do not state them), "name" and "group" (see
        `ShakeTest`). A column "specimen" must contain one specimen throughout. Other columns are ignored.
    channel, dt, units, baseline, highpass : optional
        As for `rocking.read`, for rows that do not state them.

    Returns
    -------
    list of ShakeTest
        Tests in the order of the rows.

    Raises
    ------
    RecordError
        If the table or a motion cannot be read, a column is missing, or a cell is invalid. The line refers to the
        table.

    See Also
    --------
    rocking.validate : compare predictions with tests.
    rocking.calibrate : fit blocks to the outcomes of tests.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = pathlib.Path(folder, "tests.csv")
    ...     _ = table.write_text("motion,scale,overturned\nridgecrest-clc-090,0.5,0")
    ...     read_tests(table)
    [<ShakeTest: ridgecrest-clc-090, stood>]
    """
    table = read_table(checks.path(path, "path of a table", RecordError))
    if not {"motion", "overturned"} <= {*table.columns}:
        raise table.create_error(f"the columns must include motion and overturned; got {','.join(table.columns)}")
    return _create_tests(table, channel=channel, dt=dt, units=units, baseline=baseline, highpass=highpass)


def read_observed(path: Path, measure: Measure, **options: Any) -> dict[str, Any]:
    """Read a table of observed outcomes as arguments of `fit_fragility`.

    The table has a column "overturned" (a count with a column "trials"), and either an intensity (`INTENSITY_HEADINGS`)
    or a motion (see `read_tests`). Column "group" labels outcomes that belong together. Outcomes under one motion, and
    groups with a common motion, always do. A row without label belongs to no group. Options apply to the files.
    """
    table = read_table(path, normalise_heading)
    columns = table.columns
    intensities = [name for name in columns if name in INTENSITY_HEADINGS]
    if "overturned" not in columns or len(intensities) + ("motion" in columns) != 1:
        expected = f"overturned and either motion or one of {', '.join(INTENSITY_HEADINGS)}"
        raise table.create_error(f"the columns must be {expected}, not {','.join(columns)}")
    has_trials = "trials" in columns
    observed: dict[str, Any] = {
        "exceedance_counts": table.numbers("overturned") if has_trials else [*table.booleans("overturned")],
        "trial_counts": table.numbers("trials") if has_trials else 1,
        "clusters": _join_clusters(table, {}) if "group" in columns else None,
    }
    if intensities:
        observed |= _pair_with_intensity(table, intensities[0], measure)
    else:
        observed |= _pair_with_motions(table, measure, **{"channel": None, "dt": None, "units": None, **options})
    outcomes = round(float(np.sum(np.broadcast_to(observed["trial_counts"], len(table.rows)))))
    return observed | {"description": f"{format_count(outcomes, 'observed outcome')} in {path.name}"}


def _pair_with_intensity(table: _Table, heading: str, measure: Measure) -> dict[str, Any]:
    kind, factor = INTENSITY_HEADINGS[heading]
    if kind == "sa" and measure.period is None:
        raise OptionError("a spectral acceleration requires {}, in s", "period", path=str(table.path))
    if measure.name not in ("pga", kind):  # "pga" is the default
        message = f"{{}} is {measure.name}, but the intensities of the outcomes are {kind}; omit it"
        raise OptionError(message, "measure", path=str(table.path))
    return {
        "intensity": factor * table.numbers(heading),
        "measure": measure if kind == "sa" else Measure(kind, component=measure.component),
    }


def _pair_with_motions(table: _Table, measure: Measure, **metadata: Any) -> dict[str, Any]:
    if measure.has_block_units:
        raise OptionError(f"{measure.name} is in units of the block, which is unknown for observed outcomes; use pga")
    motions = _load_row_motions(table, **metadata)
    rows = zip(table.rows, motions, strict=True)
    motions_by_name = {row["motion"]: motion for (_, row), motion in rows if motion.pga > 0.0}
    families = dict(zip(motions_by_name, assign_families([*motions_by_name.values()]), strict=True))
    intensity = [measure.value(motion) for motion in motions]
    return {"intensity": intensity, "measure": measure, "clusters": _join_clusters(table, families)}


def _join_clusters(table: _Table, families: Mapping[str, int]) -> list[int]:
    """Assign a cluster to each row: a common motion (or a multiple of it) or group joins rows, even indirectly."""
    clusters = [*range(len(table.rows))]
    first: dict[tuple[str, str | int], int] = {}
    for k, (_, row) in enumerate(table.rows):
        for column in ("motion", "group"):
            if label := row.get(column):
                key = families.get(label, label) if column == "motion" else label
                kept_cluster, merged_cluster = clusters[first.setdefault((column, key), k)], clusters[k]
                clusters = [kept_cluster if cluster == merged_cluster else cluster for cluster in clusters]
    return clusters
