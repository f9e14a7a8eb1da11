"""Output of results: text tables, names with units, plain values for JSON, files."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import math
import os
import re
import shutil
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import OptionError, OutputError, describe_install

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

#: Number of letters in a line, more than in any table.
_MAX_LINE_LENGTH: Final = 100_000

#: Relative rounding error after a few operations.
_DECIMAL_ROUNDING: Final = 2.0**-50

#: Number of letters that make the name of a temporary file unique.
_SUFFIX_LENGTH: Final = 8

#: Number with a decimal comma and an optional unit.
_DECIMAL_COMMA = re.compile(r"([+-]?\d*),(\d+(?:[eE][+-]?\d+)?\s*[a-zA-Z°/%]*)")


class Column(NamedTuple):
    """Column of a table, the source of files, data frames and text.

    Attributes
    ----------
    name : str
        Name of the quantity.
    values : array_like
        One value for each row.
    unit : str
        Unit of the values, part of the column's name in files, or "1".
    label : str
        Heading in displayed text, empty for columns in files only.
    """

    name: str
    values: Any
    unit: str = "1"
    label: str = ""

    @property
    def key(self) -> str:
        """Name with the unit."""
        return add_unit(self.name, self.unit)


def format_table(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Format columns at least two spaces apart: numbers, to five digits, on the right, texts on the left."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="")
    for k, name in enumerate(header):
        numeric = all(isinstance(row[k], (int, float, np.number)) for row in rows)
        table.add_column(Text(name), justify="right" if numeric else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(Text(format_cell(entry)) for entry in row))
    console = Console(file=io.StringIO(), width=_MAX_LINE_LENGTH, color_system=None, legacy_windows=False)
    with console.capture() as captured:
        console.print(table)
    return "\n".join(line.rstrip() for line in captured.get().splitlines())


def format_cell(entry: Any) -> str:
    """Format an entry of a table: numbers to five digits, infinity and NaN as words."""
    if isinstance(entry, (bool, np.bool_)):
        return "yes" if entry else "no"
    if isinstance(entry, (float, np.floating)):
        return "infinite" if math.isinf(entry) else "-" if math.isnan(entry) else f"{entry:.5g}"
    return str(entry)


def format_count(number: float, noun: str) -> str:
    """Return a number and its noun, such as 1 polarity, 3 polarities or 0.5 years."""
    if number == 1:
        return f"1 {noun}"
    text = f"{number:g}" if isinstance(number, float) else f"{number}"
    plural = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}es" if noun.endswith("ch") else f"{noun}s"
    return f"{text} {plural}"


def list_some(names: Sequence[str], most: int = 5) -> str:
    """Return the first of some names, and the number of others."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def format_reasons(reasons: Mapping[str, str]) -> list[str]:
    """Return one line for each reason, after some of the names to which it applies."""
    by_reason = {reason: [name for name in reasons if reasons[name] == reason] for reason in reasons.values()}
    return [f"{list_some(names)}: {reason}" for reason, names in by_reason.items()]


def format_within(value: float, bounds: tuple[float, float], format_number: Callable[[float], str]) -> str:
    """Format a number or, if it is out of bounds, the bound after < or >."""
    low, high = bounds
    sign = "< " if value < low else "> " if value > high else ""
    return sign + format_number(min(max(value, low), high))


def format_digits(
    value: float, interval: tuple[float, float], bounds: tuple[float, float] = (0.0, math.inf)
) -> tuple[str, str]:
    """Format a value and its interval to the digits that the interval supports, at least two, or as bounds."""
    low, high = interval
    width = high - low
    # Two digits of the width.
    last_digit = math.floor(math.log10(width)) - 1 if 0.0 < width < math.inf else math.inf

    def format_number(number: float) -> str:
        if number == 0.0 or not math.isfinite(number):
            return "infinity" if math.isinf(number) else f"{number:g}"
        digits = int(max(2, math.floor(math.log10(abs(number))) - last_digit + 1))
        return f"{float(f'{number:.{digits - 1}e}'):.{max(digits, 6)}g}"

    value_text, low_text, high_text = (format_within(number, bounds, format_number) for number in (value, low, high))
    return value_text, f"{low_text} to {high_text}"


def format_range(values: Floats) -> str:
    """Format the lowest and highest of some numbers, or their common value."""
    low, high = float(np.min(values)), float(np.max(values))
    return f"{low:.5g}" if low == high else f"from {low:.5g} to {high:.5g}"


def add_unit(quantity: str, unit: str) -> str:
    """Return the name of a column or field with its unit, for all files that the package writes."""
    return quantity if unit == "1" else f"{quantity}_{unit.replace('/', '_').replace('^', '')}"


def escape_dollars(text: str) -> str:
    """Escape a text for a figure, so that a dollar sign in a name does not begin a formula."""
    return text.replace("$", r"\$")


def round_decimal(value: float) -> float:
    """Return a number without the rounding in its last digit, for display."""
    rounded = float(f"{value:.12g}")
    return rounded if abs(rounded - value) <= _DECIMAL_ROUNDING * abs(value) else value


def columns_to_frame(columns: Iterable[Column]) -> pd.DataFrame:
    """Return columns as a data frame."""
    import pandas as pd

    return pd.DataFrame({column.key: column.values for column in columns})


def columns_to_records(columns: Sequence[Column]) -> list[dict[str, Any]]:
    """Return the rows of columns as mappings of plain values."""
    names, values = [column.key for column in columns], [np.asarray(column.values).tolist() for column in columns]
    return [dict(zip(names, row, strict=True)) for row in zip(*values, strict=True)]


def format_columns(columns: Sequence[Column]) -> str:
    """Format the columns that have a label as a table."""
    labelled = [column for column in columns if column.label]
    rows = zip(*(column.values for column in labelled), strict=True)
    return format_table([column.label for column in labelled], [*rows])


def dataset_to_columns(dataset: xr.Dataset) -> list[Column]:
    """Return dimensions, coordinates and variables of a dataset as columns, with a row for each point."""
    # A dimension without labels only numbers the rows.
    rows = [] if len(dataset.dims) == 1 and not dataset.coords else [*dataset.dims]
    frame = dataset.to_dataframe().reset_index()
    names = dict.fromkeys([*rows, *dataset.coords, *dataset.data_vars])
    return [Column(str(name), frame[name], dataset[name].attrs.get("units", "1")) for name in names]


def records_to_columns(rows: Sequence[Mapping[str, Any]], skipped_records: Mapping[str, str]) -> list[Column]:
    """Return records as columns, with additional rows for unreadable records and the reason."""
    import pandas as pd

    skipped = [{"record": record, "verdict": f"skipped: {reason}"} for record, reason in skipped_records.items()]
    frame = pd.DataFrame([*rows, *skipped])
    for name in rows[0] if skipped else ():
        kinds = {type(row[name]) for row in rows}
        if kinds <= {bool, int}:
            frame[name] = frame[name].astype("boolean" if kinds == {bool} else "Int64")
    return [Column(name, frame[name]) for name in frame]


def read_csv_rows(text: str) -> list[tuple[int, list[str]]]:
    r"""Return line number and cells of each nonempty row of a CSV table.

    If semicolons separate the columns of the first row, a comma is the decimal sign and becomes a point.

    Examples
    --------
    >>> read_csv_rows("p;alpha\n2,5;12,5deg\n")
    [(1, ['p', 'alpha']), (2, ['2.5', '12.5deg'])]
    """
    lines = text.splitlines()
    semicolons = ";" in next((line for line in lines if line.strip()), "")
    reader = csv.reader(lines, delimiter=";" if semicolons else ",")
    rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(map(str.strip, row))]
    if not semicolons:
        return rows
    return [(number, [_replace_comma(cell) for cell in row]) for number, row in rows]


def _replace_comma(cell: str) -> str:
    match = _DECIMAL_COMMA.fullmatch(cell)
    return f"{match[1]}.{match[2]}" if match else cell


def array_to_rows(table: np.ndarray[Any, Any]) -> list[dict[str, Any]]:
    """Return the rows of a structured array as mappings."""
    names = table.dtype.names or ()
    return [dict(zip(names, row.tolist(), strict=True)) for row in table]


def to_plain(value: Any) -> Any:
    """Return a value that JSON supports: lists for arrays, null for NaN and infinity."""
    if isinstance(value, Mapping):
        return {key: to_plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_plain(entry) for entry in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return to_plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def to_json(result: Mapping[str, Any]) -> str:
    """Return a result as JSON, NaN and infinity as null."""
    return json.dumps(to_plain(result), indent=2, allow_nan=False)


@contextlib.contextmanager
def atomic_file(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path that replaces the file on success: complete, on the disk, or not at all.

    Devices and pipes are written directly. If writing fails, an `OutputError` contains the reason, and the previous
    content is unchanged.
    """
    destination = checks.path(path, "path of a file", OutputError)
    try:
        if destination.exists() and not destination.is_file() and not destination.is_dir():
            yield destination
            return
        target = destination.resolve()  # a link remains, and its target is replaced
        if not target.parent.is_dir():
            message = f"cannot be written: there is no folder {target.parent}; create it, or choose another"
            raise OutputError(message, path=str(path))
        temporary = target.with_name(f".{target.stem}.{uuid.uuid4().hex[:_SUFFIX_LENGTH]}.part{target.suffix}")
        try:
            yield temporary
            with temporary.open("rb+") as file:
                os.fsync(file.fileno())
            if target.exists():
                shutil.copymode(target, temporary)
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        message = f"cannot be written: {reason}; no partial file remains; choose another location"
        raise OutputError(message, path=str(path)) from error


def write_text(path: str | Path, text: str) -> None:
    """Write a text file, completely or not at all."""
    write_bytes(path, text.encode())


def write_bytes(path: str | Path, content: bytes | memoryview) -> None:
    """Write a binary file, completely or not at all."""
    with atomic_file(path) as temporary:
        temporary.write_bytes(content)


def write_csv(
    path: str | Path, frame: pd.DataFrame, *, index: bool = False, float_format: str | None = "%.15g"
) -> None:
    """Write a data frame as CSV with a header, completely or not at all."""
    write_text(path, frame.to_csv(index=index, float_format=float_format, lineterminator="\n"))


def write_excel(path: str | Path, sheets: Mapping[str, pd.DataFrame]) -> None:
    """Write data frames as sheets of a workbook, completely or not at all."""
    import pandas as pd

    content = io.BytesIO()
    try:
        with pd.ExcelWriter(content, engine="openpyxl") as workbook:
            for name, frame in sheets.items():
                frame.to_excel(workbook, sheet_name=name, freeze_panes=(1, 0), index=False, float_format="%.15g")
    except ImportError:
        raise OptionError(f"an Excel workbook requires openpyxl: {describe_install('excel')}, or write CSV") from None
    write_bytes(path, content.getvalue())


def write_netcdf(path: str | Path, dataset: xr.Dataset) -> None:
    """Write a dataset to a NetCDF file, completely or not at all."""
    # In memory first, because HDF5 ends the process on a full disk.
    content: Any = dataset.to_netcdf(engine="h5netcdf")
    write_bytes(path, content)


def write_figure(path: str | Path, figure: Figure, **options: Any) -> None:
    """Write a figure in the suffix's format, completely or not at all, with options of its ``savefig``."""
    content = io.BytesIO()
    figure.savefig(content, format=Path(path).suffix.removeprefix("."), **options)
    write_bytes(path, content.getvalue())
