"""Results of a study: arrays read from its store when they are needed, and tables written a part at a time."""

from __future__ import annotations

import functools
import itertools
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from rocking.core import checks
from rocking.core.arrays import Flags, Floats
from rocking.core.progress import Progress
from rocking.core.tables import columns_of, frame_of, plain, whole_file
from rocking.engine.tasks import OUTCOME
from rocking.errors import InvalidOption, StudyError, install
from rocking.simulation.ensemble import body_coordinates, dataset_of, verticals_of
from rocking.studies.folder import Store
from rocking.studies.product import require
from rocking.studies.units import name_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

#: Methods of a study that write it, by the end of the file's name: `to_csv` and so on.
FORMATS: Final[Mapping[str, str]] = {
    ".nc": "netcdf",
    ".csv": "csv",
    ".json": "json",
    ".parquet": "parquet",
}


def write_table(kind: str, path: str | Path, dataset: xr.Dataset, along: str, step: int, progress: bool | None) -> None:
    """Write a row for each simulation or change in one of `FORMATS`, a range of the first dimension at a time."""
    table, count = _for_tables(dataset), max(1, dataset.sizes[along])
    with Progress("writing", count, show=progress) as bar:

        def frames() -> Iterator[pd.DataFrame]:
            for start in range(0, count, step):
                yield frame_of(columns_of(table.isel({along: slice(start, start + step)}).load()))
                bar.advance(min(step, count - start))

        with whole_file(path) as beside:
            {"csv": _write_csv, "json": _write_json, "parquet": _write_parquet}[kind](frames(), table, beside)


def _for_tables(dataset: xr.Dataset) -> xr.Dataset:
    """Name the scales as factors or values of a measure, which is an attribute, and impacts as in other tables."""
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


def lazy_outcome(store: Store, name: str, complete: bool) -> xr.Variable:
    """Outcome of a store, read when it is needed; of floats, NaN where a unit is not done, if some are not."""
    import xarray as xr
    from xarray.backends import BackendArray
    from xarray.core import indexing

    class Outcome(BackendArray):
        """Reads the units that a selection touches."""

        shape = store.grid.shape
        dtype = OUTCOME[name] if complete else np.dtype(np.float64)

        def __getitem__(self, key: indexing.ExplicitIndexer) -> NDArray[Any]:
            selected = functools.partial(_selected, store, name, complete)
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


StudyVerdict = Literal["overturning", "complete_chattering"]

#: Of each verdict its name on the higher scale, what that means, and the outcomes that it follows from.
_VERDICTS: Final[Mapping[str, tuple[str, str, Sequence[str]]]] = {
    "overturning": (
        "overturns",
        "whether the scale above overturns the block, and the one below does not",
        ("overturned",),
    ),
    "complete_chattering": (
        "completes",
        "whether chattering is complete at the scale above, and not at the one below",
        ("rests", "complete_chattering"),
    ),
}


def critical_scales(store: Store, verdict: StudyVerdict) -> xr.Dataset:
    """Label the changes of a verdict in a study whose units are done, as `Study.critical_scales`."""
    import xarray as xr

    checks.one_of(verdict, "verdict", InvalidOption, get_args(StudyVerdict))
    above, meaning, needed = _VERDICTS[verdict]
    require(store.grid.outcomes, needed, f"a critical scale of {verdict.replace('_', ' ')}")
    product, levels = store.product, store.product.scales.values
    if product.scales.count < 2 or not np.all(np.diff(levels) > 0.0):
        raise InvalidOption("critical scales lie between two scales or more, in increasing order: give those")
    store.require_complete()
    holds, known = np.zeros(store.grid.shape, bool), np.zeros(store.grid.shape, bool)
    for key in store.grid:
        here = store.grid.ranges(key)
        holds[here], known[here] = _verdicts(verdict, store.present(key))
    # An unknown verdict takes the last known one below: else a change with unknown verdicts inside would be lost.
    below = np.zeros(store.grid.shape, np.int64)  # number of that scale; -1 where no verdict is known so far
    for k in range(product.scales.count):
        below[:, k] = np.where(known[:, k], k, below[:, k - 1] if k else -1)
        np.copyto(holds[:, k], holds[:, k - 1], where=~known[:, k])
    changed = (holds[:, 1:] != holds[:, :-1]) & (below[:, :-1] >= 0)
    motion, polarity, block, scale = np.nonzero(changed.transpose(0, 2, 3, 1))
    low = below[motion, scale, polarity, block]
    whole, about = dataset_of(product, {}), product.scales.about
    units = {"units": about["units"]}
    of_blocks: dict[str, Any] = {
        name: ("change", np.asarray(values)[block], attributes)
        for name, (_, values, attributes) in body_coordinates(product.bodies).items()
    }
    return xr.Dataset(
        {
            "low": ("change", levels[low], units | {"long_name": "scale below the change"}),
            "high": ("change", levels[scale + 1], units | {"long_name": "scale above the change"}),
            above: ("change", holds[motion, scale + 1, polarity, block], {"long_name": meaning}),
            "known": ("change", low == scale, {"long_name": "whether the verdicts of all simulations are known"}),
        },
        {
            "motion": ("change", whole.motion.values[motion]),
            **{
                name: ("change", np.array(verticals)[motion])
                for name, (_, verticals) in verticals_of(product.motions).items()
            },
            "polarity": ("change", np.where(np.array(product.signs)[polarity] > 0, "+", "-")),
            "block": ("change", block),
            **of_blocks,
        },
        whole.attrs | {name: value for name, value in about.items() if name != "units"},
    )


def _verdicts(verdict: str, outcomes: Mapping[str, Floats]) -> tuple[Flags, Flags]:
    """Return whether a verdict holds in each simulation, and whether that is known: it was not given up or stopped."""
    known = (outcomes["unfinished"] == 0.0) & (outcomes["stopped"] == 0.0)
    if verdict == "overturning":
        return outcomes["overturned"] != 0.0, known
    known = (known | (outcomes["rests"] != 0.0)) & (outcomes["stalled"] == 0.0)
    return outcomes["complete_chattering"] != 0.0, known
