"""Results as people and machines read them: text tables, names with units, plain values for JSON."""

from __future__ import annotations

import io
import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rocking import checks
from rocking.arrays import Floats
from rocking.errors import OutputError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: Wider than any table, so that none is wrapped or cut.
_WIDTH = 100_000


def text_table(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Columns of text at least two spaces apart: numbers, to five digits, on the right, texts on the left.

    Examples
    --------
    >>> print(text_table(["record", "peak"], [["Pacoima Dam 164", 6.63581], ["Lone Pine", 0.5]]))
    record             peak
    Pacoima Dam 164  6.6358
    Lone Pine           0.5
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="")
    for k, name in enumerate(header):
        numeric = all(isinstance(row[k], (int, float, np.number)) for row in rows)
        table.add_column(Text(name), justify="right" if numeric else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(Text(cell(entry)) for entry in row))
    console = Console(file=io.StringIO(), width=_WIDTH, color_system=None, legacy_windows=False)
    with console.capture() as captured:
        console.print(table)
    return "\n".join(line.rstrip() for line in captured.get().splitlines())


def cell(entry: Any) -> str:
    """Entry of a table as text: numbers to five digits, infinity and NaN as words."""
    if isinstance(entry, (bool, np.bool_)):
        return "yes" if entry else "no"
    if isinstance(entry, (float, np.floating)):
        return "infinite" if math.isinf(entry) else "-" if math.isnan(entry) else f"{entry:.5g}"
    return str(entry)


def counted(number: int, noun: str) -> str:
    """Return a number and its noun, as 1 polarity or 3 polarities."""
    if number == 1:
        return f"1 {noun}"
    return f"{number} {noun[:-1]}ies" if noun.endswith("y") else f"{number} {noun}s"


def range_text(values: Floats) -> str:
    """Lowest and highest of some numbers, or the one that they all are.

    Examples
    --------
    >>> range_text(np.array([1.0, 2.5])), range_text(np.array([2.0, 2.0]))
    ('from 1 to 2.5', '2')
    """
    low, high = float(np.min(values)), float(np.max(values))
    return f"{low:.5g}" if low == high else f"from {low:.5g} to {high:.5g}"


def named(quantity: str, unit: str) -> str:
    """Name of a column or a field with its unit: the one rule for all files that the package writes.

    Examples
    --------
    >>> named("ground_acceleration", "m/s^2"), named("rotation", "rad"), named("impacts", "1")
    ('ground_acceleration_m_s2', 'rotation_rad', 'impacts')
    """
    return quantity if unit == "1" else f"{quantity}_{unit.replace('/', '_').replace('^', '')}"


def data_frame(part: xr.Dataset) -> pd.DataFrame:
    """Rows for each point of a dataset, in columns named with their units: dimensions, coordinates, variables."""
    # A dimension alone, without labels, only counts the rows.
    rows = [] if len(part.dims) == 1 and not part.coords else [*part.dims]
    columns = dict.fromkeys([*rows, *part.coords, *part.data_vars])
    frame = part.to_dataframe().reset_index()[[*columns]]
    return frame.rename(columns=lambda name: named(str(name), part[name].attrs.get("units", "1")))


def rows_of(table: np.ndarray[Any, Any]) -> list[dict[str, Any]]:
    """Rows of a structured array as mappings."""
    names = table.dtype.names or ()
    return [dict(zip(names, row.tolist(), strict=True)) for row in table]


def plain(value: Any) -> Any:
    """Value that JSON knows: lists for arrays, null for NaN and infinity."""
    if isinstance(value, Mapping):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def to_json(result: Mapping[str, Any]) -> str:
    """Return a result as JSON, NaN and infinity as null."""
    return json.dumps(plain(result), indent=2, allow_nan=False)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    try:
        checks.path(path, "path of a file", OutputError).write_text(text, "utf-8")
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror or error}; choose another place") from error


def write_netcdf(path: str | Path, dataset: xr.Dataset) -> None:
    """Write a dataset to a NetCDF file.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    folder = checks.path(path, "path of a file", OutputError).parent
    if not folder.is_dir():
        raise OutputError(f"{path} cannot be written: there is no folder {folder}; make it, or choose another place")
    try:
        dataset.to_netcdf(path, engine="h5netcdf")
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else error
        raise OutputError(f"{path} cannot be written: {reason}; choose another place") from error
