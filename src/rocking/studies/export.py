"""Results of a study as one file: a row for each simulation, in columns named with their units."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rocking.errors import InvalidOption
from rocking.tables import data_frame, plain, whole_file, write_netcdf

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: Rows of a sheet, without its heading.
_SHEET: Final = 1_048_575


def export(dataset: xr.Dataset, target: Path, along: str, step: int) -> None:
    """Write results to NetCDF, or to a table in one of the formats of `_WRITERS`, by the suffix.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results, which may be read only now.
    target : Path
        File to write.
    along : str
        Its first dimension.
    step : int
        How much of it is held in memory at a time.

    Raises
    ------
    InvalidOption
        If the suffix is another, what writes it is not installed, or a sheet has too few rows.
    OutputError
        If the file cannot be written.
    """
    if target.suffix not in {".nc", *_WRITERS}:
        raise InvalidOption(f"a study is exported to .nc, {', '.join(_WRITERS)}, not to {target.name}")
    if target.suffix == ".nc":
        write_netcdf(target, dataset)
        return
    table = _named(dataset)
    parts = (slice(start, start + step) for start in range(0, max(1, table.sizes[along]), step))
    frames = (data_frame(table.isel({along: part}).load()) for part in parts)
    try:
        with whole_file(target) as beside:
            _WRITERS[target.suffix](frames, table, beside)
    except ImportError:
        extra = {".parquet": "parquet", ".xlsx": "excel"}[target.suffix]
        raise InvalidOption(f"{target.suffix} needs more: install rocking[{extra}], or export to .csv or .nc") from None


def _named(dataset: xr.Dataset) -> xr.Dataset:
    """Name the scales for what they are: factors, or values of a measure."""
    if "scale" in dataset.dims:
        return dataset.rename(scale=dataset.scale.attrs["measure"])
    return dataset.rename({name: f"{dataset.measure}_{name}" for name in ("low", "high") if name in dataset})


def _write_csv(frames: Iterator[pd.DataFrame], dataset: xr.Dataset, target: Path) -> None:
    with target.open("w", encoding="utf-8", newline="") as file:
        for k, frame in enumerate(frames):
            frame.to_csv(file, header=k == 0, index=False, lineterminator="\n")


def _write_json(frames: Iterator[pd.DataFrame], dataset: xr.Dataset, target: Path) -> None:
    with target.open("w", encoding="utf-8") as file:
        file.write(f'{{"study": {json.dumps(plain(dataset.attrs))},\n"simulations": [')
        separator = "\n"
        for frame in frames:
            for row in frame.to_dict("records"):
                file.write(separator + json.dumps(plain(row), allow_nan=False))
                separator = ",\n"
        file.write("\n]}\n")


def _write_parquet(frames: Iterator[pd.DataFrame], dataset: xr.Dataset, target: Path) -> None:
    import pyarrow
    from pyarrow import parquet

    tables = (pyarrow.Table.from_pandas(frame, preserve_index=False) for frame in frames)
    first = next(tables)
    with parquet.ParquetWriter(target, first.schema) as file:
        file.write_table(first)
        for table in tables:
            file.write_table(table)


def _write_workbook(frames: Iterator[pd.DataFrame], dataset: xr.Dataset, target: Path) -> None:
    import openpyxl

    count = math.prod(dataset.sizes.values())
    if count > _SHEET:
        raise InvalidOption(f"a sheet holds {_SHEET} rows, the study has {count}: export to .csv, .parquet or .nc")
    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet("simulations")
    sheet.freeze_panes = "A2"
    for k, frame in enumerate(frames):
        if k == 0:
            sheet.append([*frame.columns])
        for row in frame.to_dict("records"):
            sheet.append([*plain(row).values()])
    content = io.BytesIO()  # what it writes itself must not fail
    book.save(content)
    target.write_bytes(content.getvalue())


_WRITERS: Final[Mapping[str, Callable[[Iterator[pd.DataFrame], xr.Dataset, Path], None]]] = {
    ".csv": _write_csv,
    ".json": _write_json,
    ".parquet": _write_parquet,
    ".xlsx": _write_workbook,
}
