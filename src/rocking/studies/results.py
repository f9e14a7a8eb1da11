"""What comes out of a study: arrays read from its store when they are needed, files, and the report that is wanted."""

from __future__ import annotations

import io
import itertools
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.analysis.fragility.fit import OVERTURNING
from rocking.analysis.fragility.result import Fragility
from rocking.engine import OUTCOME
from rocking.errors import InvalidOption, Message, StudyError, Unfitted, install
from rocking.motion.scaling import INTENSITIES, IntensityName, Measure
from rocking.progress import Progress, note
from rocking.studies.fragility import BlockFragilities, block_fragilities, pooled_fragility
from rocking.studies.refine import StudyVerdict
from rocking.studies.spectrum import (
    FRACTILES,
    StudySpectrum,
    checked_fractiles,
    require_limits,
    require_ratios,
    study_spectrum,
)
from rocking.studies.store import Store, keep
from rocking.studies.units import name_of
from rocking.tables import data_frame, plain, whole_file, write_netcdf

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: What a report may hold: each with a summary, a figure and a table.
ReportPart = Fragility | BlockFragilities | StudySpectrum

_REPORT: Final = "report.json"

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
        """Write the results as `results` has them to a NetCDF file; parameters and errors as of `to_csv`."""
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

        The keys are those of its columns, and NaN is null; attributes of the study and of its measure stand under
        "study".
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
        table, count = _for_tables(dataset), max(1, dataset.sizes[along])
        with Progress("writing", count, show=progress) as bar:

            def frames() -> Iterator[pd.DataFrame]:
                for start in range(0, count, step):
                    yield data_frame(table.isel({along: slice(start, start + step)}).load())
                    bar.advance(min(step, count - start))

            with whole_file(path) as beside:
                writer(frames(), table, beside)


_Writer = Callable[[Iterator["pd.DataFrame"], "xr.Dataset", Path], None]


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


@dataclass(frozen=True)
class FragilityPlan:
    """Fragility curves that are wanted.

    Attributes
    ----------
    measure : str
        Intensity, as for `rocking.fragility`.
    period : float or None
        Period of a spectral acceleration, s.
    damping : float
        Its fraction of critical damping.
    limits : mapping of str to float
        Limit states: peak rotation over slenderness that is exceeded, or infinity for overturning.
    blocks : {"each", "together"}
        A curve for each block, or one for all.
    confidence : float
        Probability of the intervals.

    Raises
    ------
    InvalidOption
        If one of them is out of its range.
    """

    measure: IntensityName = "pga"
    period: float | None = None
    damping: float = 0.05
    limits: Mapping[str, float] = field(default_factory=lambda: dict(OVERTURNING))
    blocks: Literal["each", "together"] = "each"
    confidence: float = 0.9

    def __post_init__(self) -> None:
        checks.one_of(self.measure, "measure", InvalidOption, INTENSITIES)
        Measure(self.measure, self.period, self.damping)
        checks.share(self.confidence, "confidence", InvalidOption)
        checks.one_of(self.blocks, "blocks", InvalidOption, ["each", "together"])
        for name, limit in checks.mapping(self.limits, "limits", InvalidOption, '{"overturning": inf}').items():
            if not (isinstance(limit, (int, float)) and limit >= 0.0):
                raise InvalidOption(
                    f"{{}}.{name} must be a rotation over slenderness or inf, not {checks.shown(limit)}",
                    "limits",
                    value=limit,
                )


@dataclass(frozen=True)
class SpectrumPlan:
    """Fractiles that are wanted.

    Attributes
    ----------
    fractiles : sequence of float
        Shares of the motions, in (0, 1), that stay below.

    Raises
    ------
    InvalidOption
        If one is out of its range.
    """

    fractiles: Sequence[float] = FRACTILES

    def __post_init__(self) -> None:
        checked_fractiles(self.fractiles)


#: Plans by the names of the parts of a report.
PLANS: Final[Mapping[str, type[FragilityPlan | SpectrumPlan]]] = {"fragility": FragilityPlan, "spectrum": SpectrumPlan}


@dataclass(frozen=True)
class ReportPlan:
    """All that is wanted.

    Attributes
    ----------
    fragility : FragilityPlan or None
        Fragility curves.
    spectrum : SpectrumPlan or None
        Fractiles of the peak rotation.
    """

    fragility: FragilityPlan | None = None
    spectrum: SpectrumPlan | None = None


def check_part(plan: FragilityPlan | SpectrumPlan, kept: Sequence[str]) -> None:
    """Raise an InvalidOption unless these outcomes, which a study keeps, are enough for a part of a report."""
    if isinstance(plan, FragilityPlan):
        require_limits(kept, plan.limits)
    else:
        require_ratios(kept, "a spectrum")


def made_report(store: Store, progress: bool | None) -> dict[str, ReportPart]:
    """Make all that is wanted of a complete study, by name."""
    plan = kept_report(store)
    if plan is None or plan == ReportPlan():
        raise StudyError(
            "the study says nothing of a report: add [report.fragility] to its file and create it again",
            path=str(store.place),
        )
    found: dict[str, ReportPart] = {}
    refused: Unfitted | None = None
    if (curves := plan.fragility) is not None:
        measure = Measure(curves.measure, curves.period, curves.damping)
        try:
            found["fragility"] = (
                pooled_fragility(store, measure, curves.limits, curves.confidence)
                if curves.blocks == "together"
                else block_fragilities(store, measure, curves.limits, curves.confidence, progress)
            )
        except Unfitted as error:
            refused = error
    if plan.spectrum is not None:
        found["spectrum"] = study_spectrum(store, plan.spectrum.fractiles, progress)
    if refused is not None:
        if not found:
            raise refused
        note(Message(f"fragility left out: {refused.message.template}", refused.message.arguments))
    return found


def keep_report(store: Store, plan: ReportPlan) -> None:
    """Store what is wanted beside the study, in place of what was."""
    keep(store.place, _REPORT, json.dumps(asdict(plan), indent=2).encode())


def kept_report(store: Store) -> ReportPlan | None:
    """Read what is wanted; None if nothing is, a StudyError if it is damaged."""
    data = store.place.get(_REPORT)
    if data is None:
        return None
    try:
        given = {name: words for name, words in json.loads(data).items() if words is not None}
        plans: dict[str, Any] = {name: PLANS[name](**words) for name, words in given.items()}
        return ReportPlan(**plans)
    except (ValueError, TypeError, KeyError, AttributeError, InvalidOption) as error:
        raise StudyError(f"{_REPORT} is damaged ({error}): create the study again from its file") from None
