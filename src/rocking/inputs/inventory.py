"""Tables of objects: one block in a row, with sizes, restraints, names and any further columns."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, NamedTuple, overload

from rocking.block import Block, Blocks, RestrainedBlock, Restraint
from rocking.block.body import Body
from rocking.block.friction import Friction, check_friction, resolve_friction
from rocking.core import checks
from rocking.core.progress import note
from rocking.core.tables import format_count, read_csv_rows
from rocking.errors import OptionError, RecordError, RockingError, escape_braces
from rocking.inputs.bodies import (
    create_restrained,
    find_uncertain,
    note_likely_mistakes,
    read_forces,
    read_values,
    sample_bodies,
)
from rocking.inputs.declared import BLOCK_INPUTS, FORCE_RESTRAINTS, INPUTS, READERS, SUPPORT_INPUTS
from rocking.inputs.quantities import UNITS, read_array
from rocking.records.formats.source import read_text
from rocking.records.named import make_names_unique
from rocking.records.units import normalise_spelling

#: Suffixes of headings: parameters of the two sides, and standard deviations.
SIDE_SUFFIXES: Final = ("_plus", "_minus")
_DEVIATION_SUFFIX: Final = "_sd"

#: Other headings of some labels, used if no column has the label itself.
_SYNONYMS: Final = {
    "name": ("object", "object_name", "item", "title"),
    "friction": ("mu", "friction_coefficient", "coefficient_of_friction"),
}

#: Inputs by the names that headings may have.
_INPUTS_BY_HEADING: Final = {
    name + suffix: name
    for name in (*BLOCK_INPUTS, *SUPPORT_INPUTS)
    for suffix in ("", *SIDE_SUFFIXES, _DEVIATION_SUFFIX)
}

#: Inputs of numbers whose names are also words of other columns.
_TEXTUAL_HEADINGS: Final = ("load", "lean", "offset", "spring", "thrust", "mass")

_TRUTH_VALUES: Final = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False, "": False}


@dataclass(frozen=True, eq=False, repr=False)
class Inventory(Sequence[Block | RestrainedBlock]):
    """Named blocks from a table, accepted wherever several blocks are.

    Attributes
    ----------
    bodies : tuple of Block or RestrainedBlock
        Blocks in the order of the rows. Their `labels` contain the name, standard deviations, and further columns.
    values : tuple of dict of str to object
        Inputs of each block in SI units: numbers, pairs, or distributions of uncertain inputs.
    restraints : tuple of tuple of Restraint
        Restraints and loads of each block.
    lines : tuple of int
        Line (or row of the sheet) of each block.
    failures : dict of str to str
        Reasons why rows describe no block, by the name of the object.

    See Also
    --------
    rocking.read_inventory : Read the table.
    rocking.Blocks : Many blocks as arrays.
    """

    bodies: tuple[Block | RestrainedBlock, ...]
    values: tuple[Mapping[str, Any], ...]
    restraints: tuple[tuple[Restraint, ...], ...]
    lines: tuple[int, ...]
    failures: Mapping[str, str]

    @overload
    def __getitem__(self, index: int) -> Block | RestrainedBlock: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Block | RestrainedBlock, ...]: ...
    def __getitem__(self, index: int | slice) -> Block | RestrainedBlock | tuple[Block | RestrainedBlock, ...]:
        return self.bodies[index]

    def __len__(self) -> int:
        return len(self.bodies)

    def sample(self, index: int, count: int, *, seed: int = 0) -> Blocks | None:
        """Sample a block with uncertain inputs as `Blocks.sample`; None for a block without."""
        if not find_uncertain(self.values[index]):
            return None
        return sample_bodies(self.values[index], count, seed, self.restraints[index])

    def __repr__(self) -> str:
        names = ", ".join(body.description for body in self.bodies[:3]) + ", ..." * (len(self) > 3)
        return f"<Inventory: {format_count(len(self), 'object')}: {names}>"


class _Entry(NamedTuple):
    """Block with its restraints and labels, block alone, its inputs and restraints, and its line."""

    body: Block | RestrainedBlock
    block: Block
    values: dict[str, Any]
    restraints: tuple[Restraint, ...]
    line: int


@dataclass(frozen=True)
class _Heading:
    """Heading of a column: name of an input with its suffixes, or of a label (input empty), and the unit."""

    name: str
    input: str = ""
    unit: str = ""


def read_inventory(path: str | Path, *, keep_going: bool = False) -> Inventory:
    r"""Read blocks from a table with one object in each row.

    Parameters
    ----------
    path : str or pathlib.Path
        CSV file (UTF-8) or Excel workbook (.xlsx, first sheet). Its heading is the first row that contains two inputs
        of a block. A heading consists of the name of an input and optionally its unit: "Width (m)", "height_cm" or
        "alpha". The inputs are those of the command line, for example width and height, p and alpha, or pivots_plus,
        pivots_minus, height_of_mass and gyration, with offset, restitution, mass, lean, one_sided, spring, damper,
        tendon, thrust and load. A number may have its own unit (24cm). Its standard deviation follows "+-", or is in a
        column such as width_sd. All other columns, such as name, location or friction (also mu), become labels of the
        blocks.
    keep_going : bool
        Whether to skip rows that describe no block. By default the first one raises an error.

    Returns
    -------
    Inventory
        Blocks with their labels.

    Raises
    ------
    RecordError
        If the file cannot be read, has no rows, or two columns have the same meaning.
    RockingError
        If a row describes no block; `path` and `line` locate it.

    See Also
    --------
    rocking.Block : Create one block.
    rocking.assess : Assess the blocks under records.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> path = pathlib.Path(tempfile.mkdtemp(), "inventory.csv")
    >>> _ = path.write_text("name,Width (cm),height_m,room\nvase,24 +- 1,1.1,12\nstele,40,2.0,14\n")
    >>> inventory = read_inventory(path)
    >>> inventory[0].labels
    {'name': 'vase', 'room': '12', 'width_sd': 0.01}
    >>> inventory[1]
    <Block: stele: rectangular block, 0.4 m x 2 m; p = 2.6855 rad/s, alpha = 0.1974 rad, restitution = 0.94231>
    """
    return read_labelled(checks.path(path, "path of a table", RecordError), keep_going=keep_going)


def read_labelled(file: Path, *, keep_going: bool = False, expected: Collection[str] = ("name",)) -> Inventory:
    """Read an inventory with notes on its labels, except on expected ones."""
    headings, rows = _read_rows(file, expected)
    entries, failures = list[_Entry](), dict[str, str]()
    for line, row in rows:
        cells = row + [""] * (len(headings) - len(row))  # a workbook contains no empty cells at the end of a row
        labels = {heading.name: cell for heading, cell in zip(headings, cells, strict=False) if not heading.input}
        if not (
            labels.get("name") or any(cell for heading, cell in zip(headings, cells, strict=False) if heading.input)
        ):
            continue  # a remark below the table
        try:
            if len(cells) > len(headings):
                counts = format_count(len(cells), "cell"), format_count(len(headings), "column")
                raise OptionError(f"this row has {counts[0]} for {counts[1]}; correct it")
            texts = _read_row(headings, cells)
            values, restraints = read_values(texts), tuple(read_forces(texts))
            spreads = {name: values[name] for name in find_uncertain(values)}
            nominal = values | {name: spread.first for name, spread in spreads.items()}
            block, body = create_restrained(nominal, restraints)
            deviations = {f"{name}{_DEVIATION_SUFFIX}": spread.second for name, spread in spreads.items()}
            body = body.with_labels(**labels, **deviations)
            if "friction" in expected:
                check_friction(body.as_bodies(), "nonlinear", resolve_friction(find_friction(body, None)))
        except RockingError as error:
            if not keep_going:
                error.path, error.line = error.path or str(file), error.line or line
                raise
            failures[f"{labels.get('name') or 'object'} (line {line})"] = error.text()
            continue
        entries.append(_Entry(body, block, values, restraints, line))
    if not entries:
        reason = f"; the first failure: {next(iter(failures.values()))}" if failures else ""
        raise RecordError(escape_braces(f"the table contains no objects below its heading{reason}"), path=str(file))
    bodies = [entry.body for entry in entries]
    if any("name" in body.labels for body in bodies):
        bodies = [body.with_labels(name=name) for body, name in zip(bodies, list_names(bodies), strict=True)]
    _, blocks, values_of_all, restraints_of_all, lines = zip(*entries, strict=True)
    note_likely_mistakes(blocks, bodies)
    return Inventory(tuple(bodies), values_of_all, restraints_of_all, lines, failures)


def list_names(bodies: Sequence[Body]) -> list[str]:
    """Return distinct names of bodies for texts and figures: their own, or else numbers from 1."""
    names = [getattr(body, "labels", {}).get("name") for body in bodies]
    return make_names_unique([str(name or f"block {k}") for k, name in enumerate(names, start=1)])


def find_friction(body: Body, default: Friction | None) -> Friction | None:
    """Return the coefficient, or the static and the kinetic one, in the label "friction" of a body, or else another."""
    text = str(getattr(body, "labels", {}).get("friction", ""))
    if text in ("", "nan"):
        return default
    values: list[float] = read_array(text.replace(";", ","), "friction").tolist()
    return values[0] if len(values) == 1 else values


def read_rows(path: Path) -> list[tuple[int, list[str]]]:
    """Return line number and cells of each nonempty row of a CSV table or a workbook."""
    return read_csv_rows(read_text(path))


def _read_rows(file: Path, expected: Collection[str]) -> tuple[list[_Heading], list[tuple[int, list[str]]]]:
    """Return the headings of a table, and line and cells of each row below."""
    rows = read_rows(file)
    candidates = [[_read_heading(cell) for cell in row] for _, row in rows[:20]]
    counts = [len({heading.name for heading in headings if heading.input}) for headings in candidates]
    first = next((k for k, count in enumerate(counts) if count > 1), 0)
    if len(rows) < first + 2:
        message = "the table contains no objects; a heading and a row for each object are required"
        raise RecordError(message, path=str(file))
    line, cells = rows[first]
    headings = candidates[first]
    for label, synonyms in _SYNONYMS.items():
        if label not in (names := [heading.name for heading in headings]):
            k = next((k for k, name in enumerate(names) if name in synonyms), None)
            headings = [_Heading(label) if j == k else heading for j, heading in enumerate(headings)]
    if "name" not in [heading.name for heading in headings] and not headings[0].input:
        headings = [_Heading("name"), *headings[1:]]
    for k, heading in enumerate(headings):
        texts = ["".join(row[k : k + 1]) for _, row in rows[first + 1 :]]
        if heading.input in _TEXTUAL_HEADINGS and not any(re.search(r"\d", text) for text in texts):
            headings[k] = heading = _Heading(heading.name)  # a word such as "Load: full" describes no input
        if heading.name in [other.name for other in headings[:k]]:
            if heading.input or heading.name == "name":
                message = f"two columns contain {heading.name}; remove one of them, or rename it"
                raise RecordError(message, path=str(file), line=line, value=cells[k])
            headings[k] = _Heading(f"{heading.name}_{k + 1}")
    _note_labels(file, [pair for pair in zip(headings, cells, strict=True) if pair[0].name not in expected])
    return headings, rows[first + 1 :]


def _read_heading(cell: str) -> _Heading:
    """Interpret a heading: the name of an input and its unit, or a label."""
    text = cell.lower().replace("±", f" {_DEVIATION_SUFFIX} ").replace("+-", f" {_DEVIATION_SUFFIX} ").replace("²", "2")
    plain = re.sub(r"[^\w°]+|_+", "_", text).strip("_").replace("breadth", "width")
    for name in sorted(_INPUTS_BY_HEADING, key=len, reverse=True):
        if plain == name or plain.startswith(f"{name}_"):
            declared_input, unit = INPUTS[_INPUTS_BY_HEADING[name]], normalise_spelling(plain[len(name) + 1 :])
            kind = "angle" if declared_input.kind == "tilt" else declared_input.kind
            if unit in UNITS.get(kind, {"": None}):
                return _Heading(name, _INPUTS_BY_HEADING[name], unit)
    return _Heading(plain or "column")


def _note_labels(file: Path, columns: Sequence[tuple[_Heading, str]]) -> None:
    """Report columns that do not affect the blocks, and whether their names resemble inputs."""
    texts = []
    for heading, cell in columns:
        hint = checks.suggest(heading.name, [*_INPUTS_BY_HEADING], "", 0.8)
        if heading.name.startswith("depth"):
            hint = "blocks rock over their width: give the smaller side of the base as width"
        if cell and not heading.input:
            texts.append(f"{cell} ({hint})" if hint else cell)
    if texts:
        note(escape_braces(f"{file}: carried along, without effect on the motion of a block: {', '.join(texts)}"))


def _read_row(headings: Sequence[_Heading], cells: Sequence[str]) -> dict[str, Any]:
    """Return the texts of the inputs in a row, those of forces as lists, and of a wall True."""
    columns = [(heading, cell) for heading, cell in zip(headings, cells, strict=True) if heading.input and cell]
    units = {heading.name: heading.unit for heading, _ in columns}
    texts = {heading.name: _add_unit(cell, heading) for heading, cell in columns}
    for name in [name for name in texts if name.endswith(_DEVIATION_SUFFIX)]:
        size, heading = name.removesuffix(_DEVIATION_SUFFIX), _Heading(name, _INPUTS_BY_HEADING[name], units[name])
        deviation = _add_unit(texts.pop(name), replace(heading, unit=heading.unit or units.get(size, "")))
        if size not in texts:
            raise OptionError("a standard deviation of {} is given, but no value", size)
        if re.search("[1-9]", deviation):  # zero: the size is known
            unit = READERS[INPUTS[size].kind][1]  # otherwise the unit of the deviation would be read
            texts[size] = f"{_add_unit(texts[size], _Heading(size, size, unit))} +- {deviation}"
    values = dict[str, Any]()
    for name in (*BLOCK_INPUTS, *SUPPORT_INPUTS):
        sides = [texts[name + suffix] for suffix in SIDE_SUFFIXES if name + suffix in texts]
        if text := texts.get(name, ",".join(sides)):
            values[name] = [text] if name in FORCE_RESTRAINTS else text
    if (flag := str(values.pop("one_sided", "no")).lower()) not in _TRUTH_VALUES:
        raise OptionError(f"{{}} must be yes or no; got {flag!r}", "one_sided", value=flag)
    return values | ({"one_sided": True} if _TRUTH_VALUES[flag] else {})


def _add_unit(text: str, heading: _Heading) -> str:
    """Add the unit of the heading to each number without a unit, and replace a decimal comma."""
    if INPUTS[heading.input].arity == "one" and heading.input not in FORCE_RESTRAINTS:
        text = re.sub(r"(?<![\d,])(\d+),(\d+)(?![\d,])", r"\1.\2", text)
    if not heading.unit:
        return text
    return re.sub(r"(?<![\w.])([+-]?[\d.]+(?:e[+-]?\d+)?)(?=\s*(?:$|,|\+|±))", rf"\1{heading.unit}", text, flags=re.I)
