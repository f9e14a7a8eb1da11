"""Study files: bodies, motions, scales and rules in TOML; errors report the line."""

from __future__ import annotations

import glob
import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

from rocking import records
from rocking.block import Blocks, Restraint
from rocking.block.body import Bodies
from rocking.block.friction import resolve_friction
from rocking.core import checks
from rocking.core.progress import note
from rocking.engine.schemes import chattering_scheme
from rocking.errors import MotionError, OptionError, RecordError, StudyError, join_placeholders
from rocking.inputs import quantities
from rocking.inputs.bodies import (
    STOCHASTIC_READERS,
    check_parameters,
    create_block,
    create_body,
    create_stochastic,
    find_description,
    find_reader,
    note_likely_mistakes,
)
from rocking.inputs.declared import (
    BLOCK_INPUTS,
    FORCE_RESTRAINTS,
    INPUTS,
    MOMENT_RESTRAINTS,
    SUPPORT_INPUTS,
    read_noted_acceleration,
)
from rocking.inputs.inventory import read_inventory
from rocking.inputs.notes import list_motion_notes
from rocking.inputs.pulses import find_family
from rocking.inputs.toml import TomlFile
from rocking.motion.motion import Motion
from rocking.motion.scaling import FACTOR, Measure, MeasureName
from rocking.records.components import separate_verticals
from rocking.records.formats.source import Request
from rocking.records.named import OWN, expand_record_names, load_motion, path_exists
from rocking.simulation.ensemble import ScalingLevels, SimulationProduct

#: Template of a study file, with comments.
TEMPLATE: Final = Path(__file__).with_name("template.toml").read_text("utf-8")

#: Measures for scaling motions, and how their levels are read.
_MEASURES: Final[Mapping[str, quantities.NumberReader]] = {
    "factor": quantities.read_number,
    "pga": read_noted_acceleration,
    "pgv": quantities.read_velocity,
    "sa": read_noted_acceleration,
    "sa_average": read_noted_acceleration,
    **dict.fromkeys(("arias", "cav", "incremental_velocity"), quantities.read_velocity),
    "pgd": quantities.read_position,
}

#: Keys of restraints; keys of tables are plurals.
_RESTRAINT_KEYS: Final = tuple(f"{name}s" if name in FORCE_RESTRAINTS else name for name in SUPPORT_INPUTS)

#: Tables of a file and their keys.
SCHEMA: Final[Mapping[str, tuple[str, ...]]] = {
    "blocks": ("csv", *BLOCK_INPUTS, *_RESTRAINT_KEYS),
    "motions": (
        *("records", "channel", "vertical", "pairs", "units", "dt", "baseline", "highpass", "skip_unreadable"),
        *("pulses", "stochastic"),
    ),
    "scales": (*_MEASURES, "period", "damping", "component", "polarity"),
    "simulation": ("model", "chattering", "duration", "friction"),
}

#: Keys whose values are not numbers, and the required type (also of the items of a list).
_VALUE_TYPES: Final[Mapping[str, tuple[Any, str]]] = {
    **dict.fromkeys(("csv", "vertical", "units", "component", "polarity", "model", "chattering"), (str, "text")),
    **dict.fromkeys(("one_sided", "skip_unreadable", "pairs"), (bool, "true or false")),
    **{f"{name}s": ([dict], f"tables, [[blocks.{name}s]]") for name in FORCE_RESTRAINTS},
    "pulses": ([dict], "tables, [[motions.pulses]]"),
    "stochastic": ([dict], "tables, [[motions.stochastic]]"),
    **dict.fromkeys(("channel", "baseline"), (str | int, "text or a whole number")),
    "records": ([str], "a list of texts"),
}


@dataclass(frozen=True)
class StudyFile:
    """Description of a study in a file.

    Attributes
    ----------
    product : SimulationProduct
        Blocks, motions, scales and rules.
    skipped : tuple of str
        A sentence for each record that could not be read, if the file allows skipping.
    records : tuple of str
        Name of the record of each motion, relative to the file; empty for a pulse.

    See Also
    --------
    rocking.studies.read_study : Read the description from a TOML file.
    rocking.create_study : Create a study from blocks and motions.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from rocking import studies
    >>> path = pathlib.Path(tempfile.mkdtemp(), "study.toml")
    >>> _ = path.write_text(studies.TEMPLATE)
    >>> len(studies.read_study(path).product.motions)
    2
    """

    product: SimulationProduct
    skipped: tuple[str, ...]
    records: tuple[str, ...] = ()


def read_study(path: str | Path) -> StudyFile:
    """Read the description of a study from a TOML file.

    Parameters
    ----------
    path : path
        TOML file. File names in it are relative to its folder. `TEMPLATE` is an example with comments.

    Returns
    -------
    StudyFile
        Product and records of the study.

    Raises
    ------
    StudyError
        If the file or one of its lines is invalid; `path`, `line` and `argument` (the key) locate the error.
    RecordError
        If a record cannot be read.

    See Also
    --------
    rocking.create_study : Create a study from blocks and motions.
    rocking.studies.StudyFile : Inspect the description of a study.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "study.toml"
    >>> _ = file.write_text(TEMPLATE)
    >>> read_study(file).product.shape
    (2, 3, 1, 320)
    """
    tables = TomlFile(path)
    _check_tables(tables)
    blocks, scales = _read_bodies(tables), _read_scales(tables)
    motions, names, skipped = _load_motions(tables, scales)
    rules, polarity = tables.table("simulation"), tables.table("scales").get("polarity", "+")
    with tables.locating_errors("simulation", key="chattering"):
        chattering = chattering_scheme(rules.get("chattering", "certified"))
    with tables.locating_errors("simulation", "scales", "blocks"):
        model, duration = rules.get("model", "nonlinear"), rules.get("duration")
        friction = resolve_friction(rules.get("friction"))
        product = SimulationProduct(blocks, tuple(motions), scales, polarity, model, chattering, duration, friction)
    return StudyFile(product, tuple(skipped), tuple(names))


def _check_tables(tables: TomlFile) -> None:
    """Check table names, keys, and types of non-numeric values."""
    for table, content in tables.tables.items():
        if table not in SCHEMA:
            moved_hint = "its options are now those of rocking study report"
            hint = moved_hint if table == "report" else checks.suggest(table, [*SCHEMA])
            raise tables.create_error(table, None, f"there is no table [{{}}]; {hint}", table)
        if not isinstance(content, dict):
            raise tables.create_error(table, None, f"{{}} must be one table, [{table}], once", table)
        for key, value in content.items():
            if key not in SCHEMA[table]:
                message = f"[{table}] has no {{}}; {checks.suggest(key, SCHEMA[table])}"
                raise tables.create_error(table, key, message, key)
            kind, expected = _VALUE_TYPES.get(key, (object, ""))
            is_valid = isinstance(value, list if isinstance(kind, list) else kind)
            if not is_valid or (isinstance(kind, list) and not all(isinstance(item, kind[0]) for item in value)):
                message = f"{{}} must be {expected}, not {checks.short_repr(value)}"
                raise tables.create_error(table, key, message, key, value=value)
    for needed in ("blocks", "motions"):
        if needed not in tables.tables:
            raise StudyError("the table [{}] is missing", needed, path=str(tables.file))


def _read_bodies(tables: TomlFile) -> Bodies:
    """Read the bodies of all combinations in [blocks], or of its CSV table."""
    entries = tables.table("blocks")
    if "csv" in entries:
        if len(entries) > 1:
            raise tables.create_error("blocks", "csv", "{} cannot be combined with other keys", "csv")
        with tables.locating_errors("blocks", key="csv"):
            return Blocks.from_bodies(read_inventory(tables.file.parent / entries["csv"]))
    with tables.locating_errors("blocks"):
        find_description(entries)
    axes: dict[str, Any] = {}
    for name in (*(name for name in entries if name in BLOCK_INPUTS), "one_sided", "lean", *MOMENT_RESTRAINTS):
        with tables.locating_errors("blocks", key=name):
            if name in entries:
                values = INPUTS[name].read_axis(entries[name])
                restraint = MOMENT_RESTRAINTS.get(name)
                axes[name] = values if restraint is None else [restraint(value) for value in values]
    for name in FORCE_RESTRAINTS:
        for k in range(len(entries.get(f"{name}s", []))):
            axes[f"{name} {k + 1}"] = _create_forces(tables, name, k)
    with tables.locating_errors("blocks"):
        if "p" in entries and axes.keys() <= {*BLOCK_INPUTS}:
            return Blocks.grid(**axes)
        checks.check_grid_size({name: len(axis) for name, axis in axes.items()}, StudyError)
        rows = [dict(zip(axes, row, strict=True)) for row in itertools.product(*axes.values())]
        blocks = [create_block(row) for row in rows]
        restraints = [[value for value in row.values() if isinstance(value, Restraint)] for row in rows]
        bodies: list[Any] = [*map(create_body, blocks, rows, restraints)]
        note_likely_mistakes(blocks, bodies)
        return Blocks.from_bodies(bodies)


def _create_objects(
    tables: TomlFile,
    table: str,
    k: int,
    entries: Mapping[str, Any],
    find_reader: Callable[[str], quantities.NumberReader | None],
    create: Callable[[dict[str, Any]], Any],
) -> list[Any]:
    """Create the object of the k-th table, or several for lists or ranges."""
    axes: dict[str, Any] = {}
    for key, value in entries.items():
        with tables.locating_errors(table, key=key, occurrence=k):
            reader = None if isinstance(value, bool) else find_reader(key)
            axes[key] = [value] if reader is None else quantities.read_axis(value, key, reader)
    with tables.locating_errors(table, occurrence=k):
        return [create(dict(zip(axes, row, strict=True))) for row in itertools.product(*axes.values())]


def _create_forces(tables: TomlFile, name: str, k: int) -> list[Any]:
    table = f"blocks.{name}s"

    def create_force(values: dict[str, Any]) -> Any:
        check_parameters(FORCE_RESTRAINTS[name], values, f"[[{table}]]")
        return FORCE_RESTRAINTS[name](**values)

    return _create_objects(tables, table, k, tables.table(table, k), find_reader, create_force)


def _create_pulses(tables: TomlFile, k: int) -> list[Motion]:
    entries, table = dict(tables.table("motions.pulses", k)), "motions.pulses"
    with tables.locating_errors(table, key="family", occurrence=k):
        family = find_family(str(entries.pop("family", "")))
    return _create_objects(tables, table, k, entries, family.find_reader, family.create_motion)


def _create_stochastic_motions(tables: TomlFile, k: int) -> list[Motion]:
    table = "motions.stochastic"

    def create(values: dict[str, Any]) -> tuple[Motion, ...]:
        return create_stochastic(values, f"[[{table}]]")

    readers = STOCHASTIC_READERS.get
    return [*itertools.chain(*_create_objects(tables, table, k, tables.table(table, k), readers, create))]


def _read_scales(tables: TomlFile) -> ScalingLevels:
    entries = tables.table("scales")
    measures = [name for name in _MEASURES if name in entries]
    if len(measures) > 1:
        message = f"motions can be scaled to one measure only, not to {join_placeholders(measures)}"
        raise tables.create_error("scales", measures[0], message, *measures)
    options = {option: entries[option] for option in ("period", "damping") if option in entries}
    for option in () if {"sa", "sa_average"} & {*entries} else options:
        raise tables.create_error("scales", option, "{} is only allowed with {}", option, "sa")
    options |= {"component": entries["component"]} if "component" in entries else {}
    if not measures:
        return ScalingLevels.from_levels(None, FACTOR)
    (name,) = measures
    with tables.locating_errors("scales", key=name):
        values = quantities.read_axis(entries[name], name, _MEASURES[name])
        checks.positive_numbers(values, name, OptionError)
        return ScalingLevels.from_levels(values, Measure(cast(MeasureName, name), **options))


def _load_motions(tables: TomlFile, scales: ScalingLevels) -> tuple[list[Motion], list[str], list[str]]:
    """Load the motions; return them, their records, and a sentence for each skipped record."""
    entries, folder = tables.table("motions"), tables.file.parent
    if "vertical" in entries and not entries.get("records"):
        message = "{} applies only to records; add a record, or omit it"
        raise tables.create_error("motions", "vertical", message, "vertical")
    names_by_path: dict[str, str] = {}  # names in the file by path or record name
    for name in entries.get("records", []):
        with tables.locating_record_errors(name):
            names_by_path |= dict.fromkeys(_match_records(folder, name), name)
    motions, names, skipped, loaded = list[Motion](), list[str](), list[str](), dict[str, Motion]()
    if entries.get("pairs", False):
        motions += _load_pairs(tables, [*names_by_path])
        names += [motion.name for motion in motions]
        names_by_path = {}
    for path, name in names_by_path.items():
        try:
            with tables.locating_record_errors(name):
                loaded[path] = _load_record(tables, path, are_defaults=len(names_by_path) > 1)
                scales.factors(loaded[path])  # raises if the motion cannot be scaled
        except (RecordError, MotionError) as error:
            if not entries.get("skip_unreadable", False):
                raise
            skipped.append(str(error))
            loaded.pop(path, None)
    is_chosen = "channel" in entries
    exempt = [path for path, name in names_by_path.items() if is_chosen or path in (name, str(folder / name))]
    with tables.locating_record_errors(""):
        loaded, reasons = separate_verticals(loaded, exempt, keep_going=entries.get("skip_unreadable", False))
    skipped += [f"{path}: {reason}" for path, reason in reasons.items()]
    motions += loaded.values()
    for path in loaded:
        is_sibling = path_exists(path) and Path(path).is_relative_to(folder)
        names.append(str(Path(path).relative_to(folder)) if is_sibling else path)
    for name, create in (("pulses", _create_pulses), ("stochastic", _create_stochastic_motions)):
        motions += itertools.chain(*(create(tables, k) for k in range(len(entries.get(name, [])))))
    if not motions:
        raise tables.create_error("motions", None, "[motions] contains no readable motion: add records or pulses")
    return motions, names + [""] * (len(motions) - len(names)), skipped


#: Keys of [motions] that also apply to pairs.
_READING_OPTIONS: Final = ("dt", "units", "baseline", "highpass")


def _load_pairs(tables: TomlFile, paths: list[str]) -> list[Motion]:
    """Load the pairs of horizontal components, with vertical ones if the key is "own"."""
    entries = tables.table("motions")
    if "channel" in entries or entries.get("vertical", OWN) != OWN:
        message = f'with pairs, {{}} is not allowed, and {{}} must be "{OWN}": the vertical component of the station'
        raise tables.create_error("motions", "pairs", message, "channel", "vertical")
    options = {name: entries[name] for name in _READING_OPTIONS if name in entries}
    with tables.locating_record_errors(paths[0] if paths else ""):
        keep_going = entries.get("skip_unreadable", False)
        return [*records.load_pairs(paths, with_vertical="vertical" in entries, keep_going=keep_going, **options)]


def _load_record(tables: TomlFile, path: str, *, are_defaults: bool) -> Motion:
    entries = tables.table("motions")
    options = {name: entries[name] for name in _READING_OPTIONS if name in entries}
    channel, vertical_name = (str(entries[name]) if name in entries else None for name in ("channel", "vertical"))
    if vertical_name is not None:  # a file beside the study file, or any other name
        sibling = str(tables.file.parent / vertical_name)
        vertical_name = sibling if path_exists(sibling) else vertical_name
    motion = load_motion(path, Request.create(**options, channel=channel, are_defaults=are_defaults), vertical_name)
    for sentence in list_motion_notes(motion):
        note(f"{path}: {sentence}")
    return motion


def _match_records(folder: Path, name: str) -> list[str]:
    """Find the files that match a name relative to the study file, or a shipped record."""
    path = str(folder / name)
    if glob.has_magic(name) and not path_exists(path):
        return expand_record_names([str(Path(glob.escape(str(folder))) / name)])
    if path_exists(path):
        return expand_record_names([path])
    # Not a file in the working folder; the bare name gives a better message.
    return [path if path_exists(name) and name not in records.names() else name]
