"""Results of a study: arrays that are read from its store when they are needed, and files with a row a simulation."""

from __future__ import annotations

import io
import itertools
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.engine import OUTCOME
from rocking.errors import InvalidOption, StudyError
from rocking.progress import Progress
from rocking.studies.refine import StudyVerdict
from rocking.studies.store import Store
from rocking.studies.units import name_of
from rocking.tables import data_frame, plain, whole_file, write_netcdf

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

#: Rows of a table of critical scales that are held in memory at a time.
_ROWS: Final = 1 << 16


class WrittenToFiles(ABC):
    """What writes its results to one file, a part of them at a time."""

    @abstractmethod
    def _results(self, critical: StudyVerdict | None) -> tuple[xr.Dataset, str, int]:
        """Return results, their first dimension, and how much of it is held in memory at a time."""

    def to_netcdf(self, path: str | Path, *, critical: StudyVerdict | None = None) -> None:
        """Write the results as `results` has them to a NetCDF file.

        Parameters
        ----------
        path : path
            File to write.
        critical : {"overturning", "complete_chattering"}, optional
            Write the `critical_scales` of this verdict instead.

        Raises
        ------
        OutputError
            If the file cannot be written.
        StudyError
            If a unit is damaged, or critical scales are not known yet.
        """
        write_netcdf(path, self._results(critical)[0])

    def to_csv(self, path: str | Path, *, critical: StudyVerdict | None = None, progress: bool | None = None) -> None:
        """Write a row for each simulation as text, in columns named with their units.

        Parameters
        ----------
        path : path
            File to write.
        critical : {"overturning", "complete_chattering"}, optional
            Write the `critical_scales` of this verdict instead, a row for each change.
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

        Raises
        ------
        OutputError
            If the file cannot be written.
        StudyError
            If a unit is damaged, or critical scales are not known yet.
        """
        self._write(path, critical, progress, _write_csv)

    def to_json(self, path: str | Path, *, critical: StudyVerdict | None = None, progress: bool | None = None) -> None:
        """Write an object for each simulation as JSON; parameters and errors as of `to_csv`.

        The keys are those of its columns, and NaN is null; attributes of the study stand under "study".
        """
        self._write(path, critical, progress, _write_json)

    def to_parquet(
        self, path: str | Path, *, critical: StudyVerdict | None = None, progress: bool | None = None
    ) -> None:
        """Write the table of `to_csv` as Parquet; parameters and errors as there.

        Raises
        ------
        InvalidOption
            If pyarrow is not installed.
        """
        self._write(path, critical, progress, _write_parquet)

    def to_excel(self, path: str | Path, *, critical: StudyVerdict | None = None, progress: bool | None = None) -> None:
        """Write the table of `to_csv` as a workbook (.xlsx); parameters and errors as there.

        Raises
        ------
        InvalidOption
            If openpyxl is not installed, or a sheet has too few rows.
        """
        self._write(path, critical, progress, _write_excel)

    def _write(self, path: str | Path, critical: StudyVerdict | None, progress: bool | None, writer: _Writer) -> None:
        dataset, along, step = self._results(critical)
        table, count = _with_named_scales(dataset), max(1, dataset.sizes[along])
        with Progress("writing", count, show=progress) as bar:

            def frames() -> Iterator[pd.DataFrame]:
                for start in range(0, count, step):
                    yield data_frame(table.isel({along: slice(start, start + step)}).load())
                    bar.advance(min(step, count - start))

            with whole_file(path) as beside:
                writer(frames(), table, beside)


_Writer = Callable[[Iterator["pd.DataFrame"], "xr.Dataset", Path], None]


def _with_named_scales(dataset: xr.Dataset) -> xr.Dataset:
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
        for row in itertools.chain.from_iterable(frame.to_dict("records") for frame in frames):
            file.write(separator + json.dumps(plain(row), allow_nan=False))
            separator = ",\n"
        file.write("\n]}\n")


def _write_parquet(frames: Iterator[pd.DataFrame], dataset: xr.Dataset, target: Path) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise InvalidOption("Parquet needs pyarrow: install rocking[parquet], or write CSV or NetCDF") from None
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
        raise InvalidOption("a workbook needs openpyxl: install rocking[excel], or write CSV or NetCDF") from None
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
