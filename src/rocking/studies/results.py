"""Results of a study: arrays read from its store when they are needed, and tables written a part at a time."""

from __future__ import annotations

import io
import itertools
import json
import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.engine import OUTCOME
from rocking.errors import InvalidOption, StudyError, install
from rocking.progress import Progress
from rocking.studies.store import Store
from rocking.studies.units import name_of
from rocking.tables import columns_of, frame_of, plain, whole_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: Methods of a study that write it, by the end of the file's name: `to_csv` and so on.
FORMATS: Final[Mapping[str, str]] = {
    ".nc": "netcdf",
    ".csv": "csv",
    ".json": "json",
    ".parquet": "parquet",
    ".xlsx": "excel",
}

#: Rows of a sheet, without its heading.
_SHEET: Final = 1_048_575


def write_table(kind: str, path: str | Path, dataset: xr.Dataset, along: str, step: int, progress: bool | None) -> None:
    """Write a row for each simulation or change in one of `FORMATS`, a range of the first dimension at a time."""
    table, count = _for_tables(dataset), max(1, dataset.sizes[along])
    with Progress("writing", count, show=progress) as bar:

        def frames() -> Iterator[pd.DataFrame]:
            for start in range(0, count, step):
                yield frame_of(columns_of(table.isel({along: slice(start, start + step)}).load()))
                bar.advance(min(step, count - start))

        with whole_file(path) as beside:
            _WRITERS[kind](frames(), table, beside)


def _for_tables(dataset: xr.Dataset) -> xr.Dataset:
    """Name the scales for what they are, factors or values of a measure, and impacts as other tables do.

    What a measure is stands among the attributes.
    """
    if "scale" in dataset.dims:
        dataset = dataset.assign_attrs({name: of for name, of in dataset.scale.attrs.items() if name != "units"})
        names = {"scale": dataset.scale.attrs["measure"], "impacts": "impacts_resolved"}
        return dataset.rename({name: other for name, other in names.items() if name in dataset})
    return dataset.rename({name: f"{dataset.measure}_{name}" for name in ("low", "high") if name in dataset})


def _write_csv(frames: Iterator[pd.DataFrame], dataset: xr.Dataset, target: Path) -> None:
    with target.open("w", encoding="utf-8", newline="") as file:
        for k, frame in enumerate(frames):
            frame.to_csv(file, header=k == 0, index=False, lineterminator="\n")


def _write_json(frames: Iterator[pd.DataFrame], dataset: xr.Dataset, target: Path) -> None:
    with target.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f'{{"study": {json.dumps(plain(dataset.attrs))},\n"simulations": [')
        separator = "\n"
        for row in itertools.chain.from_iterable(frame.to_dict("records") for frame in frames):
            file.write(separator + json.dumps(plain(row), allow_nan=False))
            separator = ",\n"
        file.write("\n]}\n")


def _write_parquet(frames: Iterator[pd.DataFrame], dataset: xr.Dataset, target: Path) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise InvalidOption(f"Parquet needs pyarrow: {install('parquet')}, or write CSV or NetCDF") from None
    tables = (pyarrow.Table.from_pandas(frame, preserve_index=False) for frame in frames)
    first = next(tables)
    with parquet.ParquetWriter(target, first.schema) as file:
        file.write_table(first)
        for table in tables:
            file.write_table(table)


def _write_excel(frames: Iterator[pd.DataFrame], dataset: xr.Dataset, target: Path) -> None:
    try:
        import openpyxl
    except ImportError:
        raise InvalidOption(f"a workbook needs openpyxl: {install('excel')}, or write CSV or NetCDF") from None
    count = math.prod(dataset.sizes.values())
    if count > _SHEET:
        raise InvalidOption(f"a sheet holds {_SHEET} rows, the study has {count}: write CSV, Parquet or NetCDF")
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


_Writer = Callable[[Iterator["pd.DataFrame"], "xr.Dataset", Path], None]
_WRITERS: Final[Mapping[str, _Writer]] = {
    "csv": _write_csv,
    "json": _write_json,
    "parquet": _write_parquet,
    "excel": _write_excel,
}


def lazy_outcome(store: Store, name: str, complete: bool) -> xr.Variable:
    """Outcome of a store over (motion, scale, polarity, block), read when it is needed.

    It has its own type where all units are done, else it is of floats, NaN where a unit is not done.
    """
    import xarray as xr
    from xarray.backends import BackendArray
    from xarray.core import indexing

    class Outcome(BackendArray):
        """Reads the units that a selection touches."""

        shape = store.grid.shape
        dtype = OUTCOME[name] if complete else np.dtype(np.float64)

        def __getitem__(self, key: indexing.ExplicitIndexer) -> NDArray[Any]:
            def selected(parts: tuple[Any, ...]) -> NDArray[Any]:
                return _selected(store, name, complete, parts)

            found: NDArray[Any] = indexing.explicit_indexing_adapter(
                key, self.shape, indexing.IndexingSupport.OUTER, selected
            )
            return found

    return xr.Variable(("motion", "scale", "polarity", "block"), indexing.LazilyIndexedArray(Outcome()))


def _selected(store: Store, name: str, complete: bool, key: tuple[Any, ...]) -> NDArray[Any]:
    """Values of an outcome at an integer, a slice or an array of indices along each axis."""
    grid = store.grid
    axes = [np.arange(size)[part] for size, part in zip(grid.shape, key, strict=True)]
    wanted = [np.atleast_1d(axis) for axis in axes]
    found = np.full([len(axis) for axis in wanted], np.nan)
    units = [np.unique(axis // part).tolist() for axis, part in zip(wanted, grid.unit, strict=True)]
    for unit in itertools.product(*units):
        here = [np.flatnonzero(axis // part == k) for axis, part, k in zip(wanted, grid.unit, unit, strict=True)]
        within = [axis[at] - k * part for axis, at, part, k in zip(wanted, here, grid.unit, unit, strict=True)]
        outcomes = store.outcomes(unit)
        if outcomes is not None:
            found[np.ix_(*here)] = outcomes[name][np.ix_(*within)]
        elif complete:
            raise StudyError(f"unit {name_of(unit)} is gone since these results were opened: run the study again")
    values = found.squeeze(axis=tuple(position for position, axis in enumerate(axes) if axis.ndim == 0))
    return values.astype(OUTCOME[name]) if complete else values
