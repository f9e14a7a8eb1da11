"""Tables of objects: one block in a row, with sizes, restraints, names and any further columns."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple, overload

from rocking.block import Block, RestrainedBlock
from rocking.core import checks
from rocking.core.progress import note
from rocking.core.tables import format_count, read_csv_rows
from rocking.errors import OptionError, RecordError, RockingError, escape_braces
from rocking.inputs.bodies import note_likely_mistakes, read_body
from rocking.inputs.declared import BLOCK, FORCES, INPUTS, SUPPORTS
from rocking.inputs.quantities import UNITS
from rocking.records.formats.source import read_text
from rocking.records.named import make_names_unique
from rocking.records.units import normalise_spelling

#: Suffixes of headings: parameters of the two sides, and standard deviations.
SIDE_SUFFIXES: Final = ("_plus", "_minus")
_DEVIATION: Final = "_sd"

#: Headings of the name of an object, if no column is called name.
_NAMES: Final = ("object", "object_name", "item", "title")

#: Inputs by the names that headings may have.
_KNOWN: Final = {
    name + side + suffix: name
    for name in (*BLOCK, *SUPPORTS)
    for side in ("", *SIDE_SUFFIXES)
    for suffix in ("", _DEVIATION)
}

_PLUS_MINUS: Final = re.compile(r"\s*(?:\+/?-|±)\s*")
_YES: Final = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False, "": False}


@dataclass(frozen=True, eq=False, repr=False)
class Inventory(Sequence[Block | RestrainedBlock]):
    """Named blocks from a table, accepted wherever several blocks are.

    Attributes
    ----------
    bodies : tuple of Block or RestrainedBlock
        Blocks in the order of the rows. Their `labels` contain the name, standard deviations, and further columns.
    inputs : tuple of dict of str to object
        Values of the inputs of each block, in SI units.
    deviations : tuple of dict of str to float
        Standard deviations of uncertain inputs of each block, in SI units.
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
    inputs: tuple[Mapping[str, Any], ...]
    deviations: tuple[Mapping[str, float], ...]
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

    def __repr__(self) -> str:
        names = ", ".join(body.description for body in self.bodies[:3]) + ", ..." * (len(self) > 3)
        return f"<Inventory: {format_count(len(self), 'object')}: {names}>"


class _Entry(NamedTuple):
    """Block without and with its restraints and labels, its inputs and their standard deviations, and its line."""

    block: Block
    body: Block | RestrainedBlock
    inputs: dict[str, Any]
    deviations: dict[str, float]
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
        column such as width_sd. All other columns, such as name, location or friction, become labels of the blocks.
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
            texts, deviations = _read_row(headings, cells)
            block, body = read_body(texts)
        except RockingError as error:
            if not keep_going:
                error.path, error.line = error.path or str(file), error.line or line
                raise
            failures[f"{labels.get('name') or 'object'} (line {line})"] = error.text()
            continue
        spreads = {f"{name}{_DEVIATION}": value for name, value in deviations.items()}
        inputs = {name: INPUTS[name].read(text) for name, text in texts.items() if name in BLOCK}
        entries.append(_Entry(block, body.with_labels(**labels, **spreads), inputs, deviations, line))
    if not entries:
        reason = f"; the first failure: {next(iter(failures.values()))}" if failures else ""
        raise RecordError(escape_braces(f"the table contains no objects below its heading{reason}"), path=str(file))
    bodies = [entry.body for entry in entries]
    if any("name" in body.labels for body in bodies):
        names = [str(body.labels.get("name") or f"block {k}") for k, body in enumerate(bodies, start=1)]
        bodies = [body.with_labels(name=name) for body, name in zip(bodies, make_names_unique(names), strict=True)]
    blocks, _, inputs_of_all, deviations_of_all, lines = zip(*entries, strict=True)
    note_likely_mistakes(blocks, bodies)
    return Inventory(tuple(bodies), inputs_of_all, deviations_of_all, lines, failures)


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
    if not any(heading.name == "name" for heading in headings):
        k = next((k for k, heading in enumerate(headings) if heading.name in _NAMES), None)
        headings = [_Heading("name") if j == k else heading for j, heading in enumerate(headings)]
    for k, heading in enumerate(headings):
        if heading.name in [other.name for other in headings[:k]]:
            if heading.input or heading.name == "name":
                message = f"two columns contain {heading.name}; remove one of them, or rename it"
                raise RecordError(message, path=str(file), line=line, value=cells[k])
            headings[k] = _Heading(f"{heading.name}_{k + 1}")
    _note_labels(file, [pair for pair in zip(headings, cells, strict=True) if pair[0].name not in expected])
    return headings, rows[first + 1 :]


def _read_heading(cell: str) -> _Heading:
    """Interpret a heading: the name of an input and its unit, or a label."""
    text = cell.lower().replace("±", f" {_DEVIATION} ").replace("+-", f" {_DEVIATION} ").replace("²", "2")
    plain = re.sub(r"[^\w°]+|_+", "_", text).strip("_")
    for name in sorted(_KNOWN, key=len, reverse=True):
        if plain == name or plain.startswith(f"{name}_"):
            declared_input, unit = INPUTS[_KNOWN[name]], normalise_spelling(plain[len(name) + 1 :])
            kind = "angle" if declared_input.kind == "tilt" else declared_input.kind
            if unit in UNITS.get(kind, {"": None}):
                return _Heading(name, _KNOWN[name], unit)
    return _Heading(plain or "column")


def _note_labels(file: Path, columns: Sequence[tuple[_Heading, str]]) -> None:
    """Report columns that do not affect the blocks, and whether their names resemble inputs."""
    texts = []
    for heading, cell in columns:
        hint = checks.suggest(heading.name, [*_KNOWN], "")
        if cell and not heading.input:
            texts.append(f"{cell} ({hint})" if hint else cell)
    if texts:
        note(escape_braces(f"{file}: carried along, without effect on the motion of a block: {', '.join(texts)}"))


def _read_row(headings: Sequence[_Heading], cells: Sequence[str]) -> tuple[dict[str, Any], dict[str, float]]:
    """Return the texts of the inputs in a row, and their standard deviations."""
    texts, errors = dict[str, str](), dict[str, float]()
    for heading, cell in zip(headings, cells, strict=True):
        if heading.input and cell:
            name, text, error = _read_cell(heading, cell)
            texts |= {name: text} if text else {}
            errors |= {} if error is None else {name: error}
    values = dict[str, Any]()
    for name in (*BLOCK, *SUPPORTS):
        sides = [texts[name + suffix] for suffix in SIDE_SUFFIXES if name + suffix in texts]
        if text := texts.get(name, ",".join(sides)):
            values[name] = [text] if name in FORCES else text
    if (flag := str(values.pop("one_sided", "no")).lower()) not in _YES:
        raise OptionError(f"{{}} must be yes or no; got {flag!r}", "one_sided", value=flag)
    for name in (name for name in errors if name not in values):
        raise OptionError("a standard deviation of {} is given, but no value", name)
    values |= {"one_sided": True} if _YES[flag] else {}
    return values, {name: error for name, error in errors.items() if error > 0.0}


def _read_cell(heading: _Heading, cell: str) -> tuple[str, str, float | None]:
    """Return the name of an input, its text in a cell (or ""), and its standard deviation if the cell contains one."""
    name = heading.name.removesuffix(_DEVIATION)
    has_spread = INPUTS[heading.input].kind in {*UNITS, "tilt"}
    parts = _PLUS_MINUS.split(cell) if has_spread else [cell]
    if len(parts) > 2 or not all(parts):
        raise OptionError(f"{{}} must be a number, or a number +- its standard deviation; got {cell!r}", name)
    if len(parts) == 2 and (unit := re.search(r"[^\d.,\s].*$", parts[1])) and not re.search(r"[^\d.,\s]", parts[0]):
        parts[0] += unit[0]  # 30 +- 2 cm
    numbers = [_add_unit(part, heading) for part in parts]
    if heading.name.endswith(_DEVIATION):
        numbers = ["", *numbers]
    if len(numbers) == 1:
        return name, numbers[0], None
    # A size must be positive, and its standard deviation only nonnegative.
    deviation = INPUTS["offset" if INPUTS[heading.input].kind == "length" else heading.input].read(numbers[1])
    if not (isinstance(deviation, float) and deviation >= 0.0):
        message = f"the standard deviation of {{}} must be a number that is not negative; got {numbers[1]}"
        raise OptionError(message, name, value=cell)
    return name, numbers[0], deviation


def _add_unit(text: str, heading: _Heading) -> str:
    """Add the unit of the heading to each number without a unit."""
    if INPUTS[heading.input].values == "one":
        text = re.sub(r"^\s*([+-]?\d+),(\d+)", r"\1.\2", text)  # a decimal comma
    if not heading.unit:
        return text
    parts = [part.strip() for part in text.split(",")]
    return ",".join(part if re.search(r"[^\d.eE+-]", part) else part + heading.unit for part in parts)
