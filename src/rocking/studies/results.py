"""Results of a study: lazily read arrays, tables, critical scales, fragility, spectra."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.analysis.curve import fitted_curve
from rocking.analysis.fragility import Fragility, fit_fragility
from rocking.analysis.levels import (
    checked_limit,
    checked_limit_states,
    clusters_of,
    motions_in_words,
    of_polarities,
    passed,
    pooled,
    ratios_of,
    single_block,
    units_of,
    values_of,
    weights_of,
)
from rocking.analysis.spectrum import fractiles_of, overturned_share
from rocking.block.body import Bodies
from rocking.core import checks
from rocking.core.arrays import Flags, Floats, select_evenly, split_range
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, format_some_rows, variable
from rocking.core.tables import (
    atomic_file,
    columns_to_frame,
    columns_to_records,
    dataset_to_columns,
    escape_dollars,
    format_count,
)
from rocking.engine.problem import compute_slenderness
from rocking.engine.tasks import OUTCOME, describe_missing
from rocking.errors import InvalidOption, StudyError, Unfitted, describe_install
from rocking.motion.scaling import Measure
from rocking.simulation.ensemble import Product, body_coordinates, build_dataset, collect_verticals
from rocking.studies.folder import Store
from rocking.studies.units import OUTCOMES, name_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Maximum number of simulations in memory.
_HELD: Final = 4_000_000

_EVERYTHING: Final = slice(None)

#: An integer, a slice or an array of indices along each axis.
_Selection = tuple[Any, ...]

StudyOutcome = Literal["overturning", "complete_chattering"]


def results_of(store: Store) -> xr.Dataset:
    """Return the outcomes so far, read lazily; if units are missing, variables are floats, with NaN for those units."""
    done, grid = store.done(), store.grid
    complete = len(done) == len(grid)
    outcomes: dict[str, Any] = {name: _lazy_outcome(store, name, complete) for name in OUTCOMES}
    if not complete:
        outcomes["done"] = np.zeros(grid.shape, dtype=bool)
        for key in done:
            outcomes["done"][grid.ranges(key)] = True
    return _with_records(store, build_dataset(store.product, outcomes))


def _with_records(store: Store, data: xr.Dataset) -> xr.Dataset:
    """Add the record to the name of each motion, if the study contains it."""
    return data.assign_coords(record=("motion", list(store.records))) if store.records else data


def _lazy_outcome(store: Store, name: str, complete: bool) -> xr.Variable:
    import xarray as xr
    from xarray.backends import BackendArray
    from xarray.core import indexing

    def selected(key: _Selection) -> NDArray[Any]:
        (values,) = _selected(store, [name], complete, key)
        return values.astype(OUTCOME[name]) if complete else values

    class Outcome(BackendArray):
        """Lazy array that reads the selected units."""

        shape = store.grid.shape
        dtype = OUTCOME[name] if complete else np.dtype(np.float64)

        def __getitem__(self, key: indexing.ExplicitIndexer) -> NDArray[Any]:
            outer = indexing.IndexingSupport.OUTER
            found: NDArray[Any] = indexing.explicit_indexing_adapter(key, self.shape, outer, selected)
            return found

    return xr.Variable(("motion", "scale", "polarity", "block"), indexing.LazilyIndexedArray(Outcome()))


def _selected(store: Store, names: Sequence[str], complete: bool, key: _Selection) -> list[Floats]:
    """Read a selection of outcomes, with NaN for missing units."""
    grid = store.grid
    axes = [np.arange(size)[part] for size, part in zip(grid.shape, key, strict=True)]
    wanted = [np.atleast_1d(axis) for axis in axes]
    found = np.full([len(names), *map(len, wanted)], np.nan)
    units = [np.unique(axis // part).tolist() for axis, part in zip(wanted, grid.unit, strict=True)]
    for unit in itertools.product(*units):
        here = [np.flatnonzero(axis // part == k) for axis, part, k in zip(wanted, grid.unit, unit, strict=True)]
        within = [axis[at] - k * part for axis, at, part, k in zip(wanted, here, grid.unit, unit, strict=True)]
        outcomes = store.outcomes(unit)
        if outcomes is not None:
            for values, name in zip(found, names, strict=True):
                values[np.ix_(*here)] = outcomes[name][np.ix_(*within)]
        elif complete:
            raise StudyError(f"unit {name_of(unit)} is gone since these results were opened: run the study again")
    single = tuple(position for position, axis in enumerate(axes) if axis.ndim == 0)
    return [values.squeeze(axis=single) for values in found]


def write_table(kind: str, path: str | Path, dataset: xr.Dataset, step: int) -> None:
    """Write a row for each simulation or change as CSV or Parquet, in chunks of the first dimension."""
    along = next(iter(dataset.sizes))
    table, count = _for_tables(dataset), max(1, dataset.sizes[along])
    with Progress("writing", count) as bar:

        def frames() -> Iterator[pd.DataFrame]:
            for part in split_range(count, step):
                yield columns_to_frame(dataset_to_columns(table.isel({along: part}).load()))
                bar.advance(part.stop - part.start)

        with atomic_file(path) as beside:
            (_write_csv if kind == "csv" else _write_parquet)(frames(), beside)


def _for_tables(dataset: xr.Dataset) -> xr.Dataset:
    """Name the scales as factors or values of a measure, and the impacts as in other tables."""
    measure = dataset.scale.attrs["measure"] if "scale" in dataset.dims else dataset.attrs.get("measure")
    names = {"scale": measure, "impacts": "impacts_resolved", "low": f"{measure}_low", "high": f"{measure}_high"}
    return dataset.rename({name: other for name, other in names.items() if name in dataset.variables})


def _write_csv(frames: Iterator[pd.DataFrame], target: Path) -> None:
    with target.open("w", encoding="utf-8", newline="") as file:
        for k, frame in enumerate(frames):
            frame.to_csv(file, header=k == 0, index=False, lineterminator="\n")


def _write_parquet(frames: Iterator[pd.DataFrame], target: Path) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise InvalidOption(f"Parquet needs pyarrow: {describe_install('parquet')}, or write CSV or NetCDF") from None
    tables = (pyarrow.Table.from_pandas(frame, preserve_index=False) for frame in frames)
    first = next(tables)
    with parquet.ParquetWriter(target, first.schema) as file:
        for table in itertools.chain([first], tables):
            file.write_table(table)


def critical_scales(store: Store, outcome: StudyOutcome) -> xr.Dataset:
    """Compute `Study.critical_scales` of a complete study."""
    import xarray as xr

    checks.choice(outcome, "outcome", InvalidOption, get_args(StudyOutcome))
    product, levels = store.product, store.product.scales.values
    if product.scales.count < 2 or not np.all(np.diff(levels) > 0.0):
        raise InvalidOption("critical scales lie between two scales or more, in increasing order: give those")
    store.require_complete()
    names = ["unfinished", "stopped", "overturned", "complete_chattering", "rests", "rests_by_rounding"]
    holds, known = np.empty(store.grid.shape, bool), np.empty(store.grid.shape, bool)
    for part in split_range(len(product.motions), store.grid.unit[0]):
        outcomes = _selected(store, names, True, (part, _EVERYTHING, _EVERYTHING, _EVERYTHING))
        unfinished, stopped, overturned, completes, rests, rests_by_rounding = (values != 0.0 for values in outcomes)
        holds[part], known[part] = overturned, ~(unfinished | stopped)
        if outcome == "complete_chattering":
            holds[part], known[part] = completes, (known[part] | rests) & ~rests_by_rounding
    # Unknown outcomes inherit the last known one below, so that no change is lost.
    below = np.zeros(store.grid.shape, np.int64)  # index of that scale; -1 if no outcome is known so far
    for k in range(product.scales.count):
        below[:, k] = np.where(known[:, k], k, below[:, k - 1] if k else -1)
        np.copyto(holds[:, k], holds[:, k - 1], where=~known[:, k])
    changed = (holds[:, 1:] != holds[:, :-1]) & (below[:, :-1] >= 0)
    motion, polarity, block, scale = np.nonzero(changed.transpose(0, 2, 3, 1))
    low = below[motion, scale, polarity, block]
    whole, about = build_dataset(product, {}), product.scales.attributes
    above, meaning = {
        "overturning": ("overturns", "whether the scale above overturns the block, and the one below does not"),
        "complete_chattering": ("completes", "whether chattering is complete at the scale above, and not below"),
    }[outcome]
    unit = about["units"]
    return xr.Dataset(
        {
            "low": variable("change", levels[low], "scale below the change", unit),
            "high": variable("change", levels[scale + 1], "scale above the change", unit),
            above: variable("change", holds[motion, scale + 1, polarity, block], meaning),
            "known": variable("change", low == scale, "whether the outcomes of all simulations are known"),
        },
        {
            **{
                str(name): ("change", one.values[motion])
                for name, one in _with_records(store, whole).coords.items()
                if one.dims == ("motion",)
            },
            "polarity": ("change", np.where(np.array(product.signs)[polarity] > 0, "+", "-")),
            "block": ("change", block),
            **{
                name: ("change", np.asarray(values)[block], attributes)
                for name, (_, values, attributes) in body_coordinates(product.bodies).items()
            },
        },
        whole.attrs | {name: value for name, value in about.items() if name != "units"},
    )


def _peak_ratios(store: Store) -> Iterator[tuple[slice, Floats]]:
    """Yield normalised peak rotations (motions, scales, polarities, blocks) by slices of blocks.

    Values are infinite if the block overturned and NaN if the simulation was abandoned.
    """
    store.require_complete()
    *others, count = store.product.shape
    polarities = slice(0, 1 if store.product.bodies.is_symmetric else None)
    names = ["peak_rotation", "overturned", "unfinished", "stopped"]
    for blocks in split_range(count, max(1, _HELD // math.prod(others))):
        selection = _EVERYTHING, _EVERYTHING, polarities, blocks
        peak, overturned, unfinished, stopped = _selected(store, names, True, selection)
        if stopped.any():
            raise StudyError(
                f"{np.count_nonzero(stopped)} of {stopped.size} simulations were stopped by the study's duration, "
                "while the block moved or the motion went on, so that their outcomes are not known: make the study "
                "without a duration"
            )
        alpha = compute_slenderness(store.product.bodies.select(blocks))
        yield blocks, ratios_of(peak, overturned != 0.0, unfinished != 0.0, alpha)


def _repeated(bodies: Bodies, polarities: int) -> Flags:
    """Whether a polarity repeats the first one by symmetry, shape (polarities, bodies)."""
    repeated = np.zeros((polarities, len(bodies)), bool)
    if polarities > 1:
        repeated[1] = [bodies.select(slice(k, k + 1)).is_symmetric for k in range(len(bodies))]
    return repeated


@dataclass(frozen=True, eq=False, repr=False)
class BlockTable(DatasetResult):
    """Numbers for each block of a study; from `Study.spectrum` and `Study.block_fragilities`.

    Attributes
    ----------
    data : xarray.Dataset
        Variables over ``block`` and other dimensions; ``plot`` draws the first one. Parameters of the blocks are
        coordinates.
    """

    TABLES = MappingProxyType({"blocks": ()})

    @property
    def block_parameters(self) -> dict[str, Floats]:
        """Return the parameters of the blocks in the tables, by name, in SI units."""
        return {str(name): one.values for name, one in self.data.coords.items() if one.dims == ("block",)}

    def summary(self) -> str:
        columns = [one for one in self._columns("blocks") if one.name != "fault"]  # too long for a table
        rows = columns_to_records(columns)
        table = format_some_rows([column.key for column in columns], [[*row.values()] for row in rows])
        return f"{self.data.description}\n\n{table}"

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        about = [data.attrs, *(one.attrs for name, one in data.coords.items() if name in data.dims)]
        return {
            **{name: value for attributes in about for name, value in attributes.items() if name != "units"},
            **{str(name): one.values for name, one in data.coords.items() if one.dims != ("block",)},
            "blocks": self.block_parameters,
            **{str(name): one.values for name, one in data.data_vars.items()},
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        """Draw the first variable against p and slenderness, in up to four panels, or one fractile."""
        from rocking.plot.maps import blocks_figure

        drawn, parameters = next(iter(self.data.data_vars.values())), self.block_parameters
        if "fractile" in drawn.dims:
            drawn = drawn.isel(fractile=int(np.argmin(np.abs(drawn.fractile.values - 0.5))))
            measure = _measure_of(drawn.scale.attrs)
            is_factor = measure.name == "factor"
            name, unit = "factor" if is_factor else measure.short_name, measure.shown_in
            names = [f"{name} {measure.scale * value:.4g} {unit}".rstrip() for value in drawn.scale.values]
            shown, missing = drawn.values, "overturns"
            label = f"{100.0 * float(drawn.fractile):g} % fractile of peak rotation over slenderness"
        else:
            measure, names = _measure_of(self.data.attrs), [str(name) for name in drawn.limit_state.values]
            shown, missing, label = measure.scale * drawn.values, "no curve fits", f"median {measure.label}"
        p, alpha = (
            np.mean([parameters[one] for one in (name, f"{name}_plus", f"{name}_minus") if one in parameters], axis=0)
            for name in ("p", "alpha")
        )
        return blocks_figure(
            p,
            alpha,
            panels={names[k]: shown[k] for k in select_evenly(len(names), 4)},
            value_label=label,
            missing_label=missing,
            title=title or escape_dollars(self.data.description),
            ax=ax,
            figsize=figsize,
        )

    def _table(self, name: str) -> xr.Dataset:
        return _for_tables(self.data)


def _measure_of(about: Mapping[str, Any]) -> Measure:
    """Return the measure that attributes describe."""
    return Measure(about["measure"], **{name: about[name] for name in ("period", "damping") if name in about})


def checked_fractiles(fractiles: Sequence[float]) -> Floats:
    """Return shares between 0 and 1, one or more."""
    shares = np.atleast_1d(checks.numbers(fractiles, "fractiles", InvalidOption)).ravel()
    if not shares.size:
        raise InvalidOption("{} must hold a share of the motions or more, as [0.16, 0.5, 0.84]", "fractiles")
    for value in shares:
        if not 0.0 < value < 1.0:
            sentence = f"each of {{}} must be a number between 0 and 1, not {value:g}"
            raise InvalidOption(sentence, "fractiles", value=value)
    return shares


def _checked_states(limit_states: Mapping[str, float] | None, confidence: float) -> Mapping[str, float]:
    """Return limits by limit state. Check the arguments of curves before outcomes are read."""
    checks.fraction(confidence, "confidence", InvalidOption)
    limits = checked_limit_states(limit_states)
    for name, limit in limits.items():
        checked_limit(limit, name)
    return limits


def study_spectrum(store: Store, fractiles: Sequence[float]) -> BlockTable:
    """Compute fractiles of the normalised peak rotation for each scale and block."""
    import xarray as xr

    shares = checked_fractiles(fractiles)
    product, scales, count = store.product, store.product.scales, len(store.product.bodies)
    values = np.empty((len(shares), scales.count, count))
    overturned, missing = np.empty((scales.count, count)), 0
    with Progress("reading", count) as bar:
        for blocks, ratios in _peak_ratios(store):
            repeated = _repeated(product.bodies.select(blocks), ratios.shape[2])
            missing += int(np.count_nonzero(np.isnan(ratios) & ~repeated))
            own = np.where(repeated, np.nan, ratios).swapaxes(1, 2).reshape(-1, scales.count, ratios.shape[3])
            values[:, :, blocks], overturned[:, blocks] = fractiles_of(own, shares), overturned_share(own)
            bar.advance(blocks.stop - blocks.start)
    words = "peak rotation over the slenderness, infinite where that share overturns"
    left_out = describe_missing(missing)
    text = (
        f"fractiles of peak rotation over slenderness, {format_count(len(product.motions), 'motion')}, {product.model} "
    )
    return BlockTable(
        xr.Dataset(
            {
                "fractile_over_alpha": variable(("fractile", "scale", "block"), values, words, "1"),
                "overturned_share": variable(("scale", "block"), overturned, unit="1"),
            },
            {
                "fractile": shares,
                "scale": ("scale", scales.values, scales.attributes),
                **body_coordinates(product.bodies),
            },
            {"description": f"{text}model" + f"; {left_out}" * bool(left_out), "model": product.model},
        )
    )


def pooled_fragility(
    store: Store,
    measure: Measure,
    limit_states: Mapping[str, float] | None,
    confidence: float,
    weights: ArrayLike | None,
    clusters: ArrayLike | None,
) -> Fragility:
    """Fit one curve to the outcomes of all blocks, with optional weights."""
    limits = _checked_states(limit_states, confidence)
    product, bodies = store.product, store.product.bodies
    units, which = np.unique(units_of(bodies, measure, product.model), return_inverse=True)
    shares = weights_of(weights, len(bodies))
    motions, scales, _, _ = product.shape
    trials, missing = np.zeros((motions, scales, len(units))), 0
    counts = {name: np.zeros_like(trials) for name in limits}
    for blocks, ratios in _peak_ratios(store):
        belongs = np.where(which[blocks][:, None] == np.arange(len(units)), shares[blocks][:, None], 0.0)
        known = ~np.isnan(ratios)
        trials += known.sum(axis=2, dtype=float) @ belongs
        missing += int(np.count_nonzero(~known))
        for name, limit in limits.items():
            counts[name] += passed(ratios, limit, name).sum(axis=2) @ belongs
    found = trials > 0.0
    together = clusters_of(product.motions, clusters)
    x, groups = (
        _intensities(product, measure)[:, :, None] / units,
        np.broadcast_to(together[:, None, None], found.shape),
    )
    curves = [
        fitted_curve(name, (x[found], count[found], trials[found]), groups[found], confidence, measure, limits[name])
        for name, count in counts.items()
    ]
    text = f"{pooled(bodies, weights)}, {motions_in_words(together, clusters)}, {format_count(scales, 'scale')}"
    return Fragility(
        tuple(curves),
        measure,
        f"{text}, {product.model} model{of_polarities(product.polarity, is_symmetric=bodies.is_symmetric)}",
        single_block(bodies),
        product.model,
        outcomes=None,
        one_way=product.polarity != "both" and not bodies.is_symmetric,
        with_vertical=bool(collect_verticals(product.motions)),
        several_blocks=bool(np.count_nonzero(shares) > 1),
        source="motion" if clusters is None else "cluster",
        missing=describe_missing(missing),
    )


#: Stored results of the curve of each block.
_KEPT: Final[Mapping[str, str]] = {
    "median": "intensity that half of the outcomes exceed the limit at",
    "median_lower": "lower end of its confidence interval",
    "median_upper": "upper end of its confidence interval",
    "dispersion": "standard deviation of the logarithm of the intensity",
    "dispersion_lower": "lower end of its confidence interval",
    "dispersion_upper": "upper end of its confidence interval",
    "exceeded": "outcomes that exceed the limit",
    "outcomes": "outcomes that the curve is fitted to",
}


def block_fragilities(
    store: Store,
    measure: Measure,
    limit_states: Mapping[str, float] | None,
    confidence: float,
    clusters: ArrayLike | None,
) -> BlockTable:
    """Fit a curve to the outcomes of each block."""
    import xarray as xr

    limits = _checked_states(limit_states, confidence)
    product, bodies, scales = store.product, store.product.bodies, store.product.scales.count
    kept = {name: np.full((len(limits), len(bodies)), np.nan) for name in _KEPT}
    faults, missing = np.full((len(limits), len(bodies)), "", dtype=object), 0
    intensities, units = _intensities(product, measure).ravel(), units_of(bodies, measure, product.model)
    together = np.repeat(clusters_of(product.motions, clusters), scales)
    fit = partial(fit_fragility, measure=measure, confidence=confidence)
    with Progress("fitting", len(bodies) * len(limits)) as bar:
        for blocks, ratios in _peak_ratios(store):
            repeated = _repeated(bodies.select(blocks), ratios.shape[2])
            missing += int(np.count_nonzero(np.isnan(ratios) & ~repeated))
            own = np.where(repeated, np.nan, ratios)
            all_trials = np.count_nonzero(~np.isnan(own), axis=2).reshape(-1, own.shape[3])
            for i, (name, limit) in enumerate(limits.items()):
                all_exceeded = passed(own, limit, name).sum(axis=2).reshape(-1, own.shape[3])
                for j, trials, exceeded in zip(range(len(bodies))[blocks], all_trials.T, all_exceeded.T, strict=True):
                    some = trials > 0
                    data = intensities[some] / units[j], {name: exceeded[some]}
                    numbers = [np.nan] * 6
                    try:
                        if not some.any():
                            raise Unfitted("every simulation was given up")
                        curve = fit(*data, trials=trials[some], clusters=together[some]).curves[0]
                        numbers = [curve.median, *curve.median_interval, curve.dispersion, *curve.dispersion_interval]
                    except Unfitted as error:  # identical or separated outcomes have no lognormal fit
                        faults[i, j] = str(error)
                    numbers += [exceeded.sum(), trials.sum()]
                    for values, number in zip(kept.values(), numbers, strict=True):
                        values[i, j] = number
                    bar.advance()
    dims, without, left_out = ("limit_state", "block"), np.count_nonzero(faults != ""), describe_missing(missing)
    text = f"fragility of {format_count(len(bodies), 'block')}; intensity: {measure.quantity}"
    text += f"; {format_count(int(without), 'curve')} cannot be fitted (fault says why)" if without else ""
    about = {"confidence": confidence, "model": product.model, "measure": measure.name, **measure.options()}
    return BlockTable(
        xr.Dataset(
            {
                name: variable(dims, values, _KEPT[name], measure.units if name.startswith("median") else "1")
                for name, values in kept.items()
            }
            | {"fault": variable(dims, faults.astype(str), "why there is no curve")},
            {"limit_state": list(limits), **body_coordinates(bodies)},
            {"description": text + f"; {left_out}" * bool(left_out), **about},
        )
    )


def _intensities(product: Product, measure: Measure) -> Floats:
    """Return the intensity of every motion at every scale, shape (motions, scales)."""
    scales = product.scales
    values = values_of(product.motions, measure)
    if scales.measure == measure.alone:
        return np.tile(scales.values, (len(values), 1))  # the input values, bit for bit
    factors = np.array([scales.factors(motion) for motion in product.motions])
    return np.asarray(np.abs(factors) * values[:, None])
