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

from rocking.analysis.curve import fit_curve
from rocking.analysis.fragility import Fragility, fit_fragility
from rocking.analysis.levels import (
    assign_clusters,
    assign_pairs,
    check_limit,
    check_limit_states,
    compute_block_units,
    compute_exceedances,
    compute_intensities,
    compute_ratios,
    describe_polarities,
    describe_pool,
    describe_sample,
    find_larger_responses,
    find_single_block,
    normalise_positive_weights,
)
from rocking.analysis.spectrum import compute_fractiles, compute_overturned_share
from rocking.block.body import Bodies
from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers, select_evenly, split_range
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, create_variable, format_some_rows
from rocking.core.tables import (
    atomic_file,
    columns_to_frame,
    columns_to_records,
    dataset_to_columns,
    escape_dollars,
    format_count,
)
from rocking.engine.problem import compute_slenderness
from rocking.engine.tasks import OUTCOME_DTYPE, describe_missing
from rocking.errors import FitError, OptionError, StudyError, describe_install
from rocking.motion.scaling import Measure
from rocking.simulation.ensemble import (
    SimulationProduct,
    body_coordinates,
    collect_verticals,
    create_dataset,
    find_labels,
    list_block_names,
)
from rocking.studies.batches import OUTCOMES, format_key
from rocking.studies.folder import Store

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Maximum number of simulations in memory.
_MAX_VALUES_IN_MEMORY: Final = 4_000_000

_ALL: Final = slice(None)

#: An integer, a slice or an array of indices along each axis.
_Selection = tuple[Any, ...]

StudyOutcome = Literal["overturning", "complete_chattering"]


def open_results(store: Store) -> xr.Dataset:
    """Return the outcomes so far, read lazily; variables are floats, NaN where batches are missing."""
    is_done, grid = store.find_done(), store.grid
    is_complete = len(is_done) == len(grid)
    outcomes: dict[str, Any] = {name: _create_lazy_outcome(store, name, is_complete) for name in OUTCOMES}
    if not is_complete:
        outcomes["done"] = np.zeros(grid.shape, dtype=bool)
        for key in is_done:
            outcomes["done"][grid.ranges(key)] = True
    return _add_records(store, create_dataset(store.product, outcomes))


def _add_records(store: Store, data: xr.Dataset) -> xr.Dataset:
    """Add the record to the name of each motion, if the study contains it."""
    return data.assign_coords(record=("motion", list(store.records))) if store.records else data


def _create_lazy_outcome(store: Store, name: str, is_complete: bool) -> xr.Variable:
    import xarray as xr
    from xarray.backends import BackendArray
    from xarray.core import indexing

    def read(key: _Selection) -> NDArray[Any]:
        (values,) = _read_selection(store, [name], is_complete, key)
        return values.astype(OUTCOME_DTYPE[name]) if is_complete else values

    class Outcome(BackendArray):
        """Lazy array that reads the selected batches."""

        shape = store.grid.shape
        dtype = OUTCOME_DTYPE[name] if is_complete else np.dtype(np.float64)

        def __getitem__(self, key: indexing.ExplicitIndexer) -> NDArray[Any]:
            outer = indexing.IndexingSupport.OUTER
            values: NDArray[Any] = indexing.explicit_indexing_adapter(key, self.shape, outer, read)
            return values

    return xr.Variable(("motion", "scale", "polarity", "block"), indexing.LazilyIndexedArray(Outcome()))


def _read_selection(store: Store, names: Sequence[str], complete: bool, key: _Selection) -> list[Floats]:
    """Read a selection of outcomes, with NaN for missing batches."""
    grid = store.grid
    axes = [np.arange(size)[part] for size, part in zip(grid.shape, key, strict=True)]
    indices = [np.atleast_1d(axis) for axis in axes]
    selection = np.full([len(names), *map(len, indices)], np.nan)
    batches = [np.unique(axis // part).tolist() for axis, part in zip(indices, grid.batch_shape, strict=True)]
    for batch in itertools.product(*batches):
        targets = [
            np.flatnonzero(axis // part == k) for axis, part, k in zip(indices, grid.batch_shape, batch, strict=True)
        ]
        sources = [axis[target] % part for axis, target, part in zip(indices, targets, grid.batch_shape, strict=True)]
        outcomes = store.read_outcomes(batch)
        if outcomes is not None:
            for values, name in zip(selection, names, strict=True):
                values[np.ix_(*targets)] = outcomes[name][np.ix_(*sources)]
        elif complete:
            event = f"batch {format_key(batch)} was removed after these results were opened"
            raise StudyError(f"{event}: run the study again")
    single = tuple(position for position, axis in enumerate(axes) if axis.ndim == 0)
    return [values.squeeze(axis=single) for values in selection]


def write_table(kind: str, path: str | Path, dataset: xr.Dataset, step: int) -> None:
    """Write a row for each simulation or change as CSV or Parquet, in chunks of the first dimension."""
    dimension = next(iter(dataset.sizes))
    table, count = _rename_for_tables(dataset), max(1, dataset.sizes[dimension])
    with Progress("writing", count) as bar:

        def frames() -> Iterator[pd.DataFrame]:
            for part in split_range(count, step):
                yield columns_to_frame(dataset_to_columns(table.isel({dimension: part}).load()))
                bar.advance(part.stop - part.start)

        with atomic_file(path) as temporary:
            (_write_csv if kind == "csv" else _write_parquet)(frames(), temporary)


def _rename_for_tables(dataset: xr.Dataset) -> xr.Dataset:
    """Name the scales as factors or values of a measure, and the impacts as in other tables."""
    measure = dataset.scale.attrs["measure"] if "scale" in dataset.dims else dataset.attrs.get("measure")
    names = {"scale": measure, "impacts": "impacts_resolved", "low": f"{measure}_low", "high": f"{measure}_high"}
    return dataset.rename({name: new_name for name, new_name in names.items() if name in dataset.variables})


def _write_csv(frames: Iterator[pd.DataFrame], target: Path) -> None:
    with target.open("w", encoding="utf-8", newline="") as file:
        for k, frame in enumerate(frames):
            frame.to_csv(file, header=k == 0, index=False, lineterminator="\n")


def _write_parquet(frames: Iterator[pd.DataFrame], target: Path) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        message = f"Parquet requires pyarrow: {describe_install('parquet')}, or write CSV or NetCDF"
        raise OptionError(message) from None
    tables = (pyarrow.Table.from_pandas(frame, preserve_index=False) for frame in frames)
    first = next(tables)
    with parquet.ParquetWriter(target, first.schema) as file:
        for table in itertools.chain([first], tables):
            file.write_table(table)


def find_critical_scales(store: Store, outcome: StudyOutcome) -> xr.Dataset:
    """Compute `Study.critical_scales` of a complete study."""
    import xarray as xr

    checks.choice(outcome, "outcome", OptionError, get_args(StudyOutcome))
    product, levels = store.product, store.product.scales.values
    if product.scales.count < 2 or not np.all(np.diff(levels) > 0.0):
        raise OptionError("critical scales require at least two scales, in increasing order")
    store.require_complete()
    names = ["unfinished", "ended_early", "overturned", "complete_chattering", "rests", "rests_by_rounding"]
    has_outcome, is_known = np.empty(store.grid.shape, bool), np.empty(store.grid.shape, bool)
    for part in split_range(len(product.motions), store.grid.batch_shape[0]):
        outcomes = _read_selection(store, names, True, (part, _ALL, _ALL, _ALL))
        unfinished, ended_early, overturned, completes, rests, rests_by_rounding = (
            values != 0.0 for values in outcomes
        )
        has_outcome[part], is_known[part] = overturned, ~(unfinished | ended_early)
        if outcome == "complete_chattering":
            has_outcome[part], is_known[part] = completes, (is_known[part] | rests) & ~rests_by_rounding
    # Unknown outcomes inherit the last known one below, so that no change is lost.
    below = np.zeros(store.grid.shape, np.int64)  # index of that scale; -1 if no outcome is known so far
    for k in range(product.scales.count):
        below[:, k] = np.where(is_known[:, k], k, below[:, k - 1] if k else -1)
        np.copyto(has_outcome[:, k], has_outcome[:, k - 1], where=~is_known[:, k])
    changed = (has_outcome[:, 1:] != has_outcome[:, :-1]) & (below[:, :-1] >= 0)
    motion, polarity, block, scale = np.nonzero(changed.transpose(0, 2, 3, 1))
    low = below[motion, scale, polarity, block]
    dataset, attributes = _add_records(store, create_dataset(product, {})), product.scales.attributes
    name, meaning = ("overturns", "whether the scale above overturns the block, and the one below does not")
    if outcome == "complete_chattering":
        name, meaning = ("completes", "whether chattering is complete at the scale above, and not below")
    unit = attributes.pop("units")
    variables = {
        "low": create_variable("change", levels[low], "scale below the change", unit),
        "high": create_variable("change", levels[scale + 1], "scale above the change", unit),
        name: create_variable("change", has_outcome[motion, scale + 1, polarity, block], meaning),
        "known": create_variable("change", low == scale, "whether the outcomes of all simulations are known"),
    }
    motions = {name: values for name, values in dataset.coords.items() if values.dims == ("motion",)}
    coordinates: dict[Any, Any] = {name: ("change", values.values[motion]) for name, values in motions.items()}
    coordinates["polarity"] = ("change", np.where(np.array(product.signs)[polarity] > 0, "+", "-"))
    coordinates["block"] = ("change", block)
    for name, (_, values, details) in body_coordinates(product.bodies).items():
        coordinates[name] = ("change", np.asarray(values)[block], details)
    return xr.Dataset(variables, coordinates, dataset.attrs | attributes)


def _iterate_peak_ratios(store: Store, pair_measure: Measure | None = None) -> Iterator[tuple[slice, Floats]]:
    """Yield normalised peak rotations (motions, scales, polarities, blocks) by slices of blocks.

    Values are infinite if the block overturned and NaN if the simulation was abandoned. With a measure, only the larger
    response of each pair and of both polarities is yielded, shape (pairs, scales, 1, blocks).
    """
    store.require_complete()
    *other_counts, block_count = store.product.shape
    polarities = slice(0, 1 if store.product.bodies.is_symmetric else None)
    names = ["peak_rotation", "overturned", "unfinished", "ended_early"]
    for blocks in split_range(block_count, max(1, _MAX_VALUES_IN_MEMORY // math.prod(other_counts))):
        selection = _ALL, _ALL, polarities, blocks
        peak, overturned, unfinished, ended_early = _read_selection(store, names, True, selection)
        if ended_early.any():
            count_text = f"{np.count_nonzero(ended_early)} of {ended_early.size} simulations"
            message = "were stopped by the study's duration, while the block moved or the motion went on, so that their"
            raise StudyError(f"{count_text} {message} outcomes are unknown: create the study without a duration")
        alpha = compute_slenderness(store.product.bodies.select(blocks))
        ratios = compute_ratios(alpha, peak, overturned != 0.0, unfinished != 0.0)
        if pair_measure is not None:
            by_level = ratios.transpose(1, 0, 3, 2)
            indices = find_larger_responses(by_level, store.product.motions, pair_measure)
            ratios = by_level.ravel()[indices].swapaxes(0, 1)[:, :, None]
        yield blocks, ratios


def _list_counted_motions(product: SimulationProduct, measure: Measure, *, larger: bool) -> Integers:
    """Return the positions of the motions that count: all, or the first of each pair."""
    if not larger:
        return np.arange(len(product.motions))
    pairs, values = assign_pairs(product.motions), _compute_intensities(product, measure)
    first = np.unique(pairs, return_index=True)[1]
    if not np.allclose(values, values[first][pairs], rtol=1e-9, atol=0.0):
        message = (
            "{} requires scales at which both components of a pair have the same factor: factors, or {} in [scales]"
        )
        raise OptionError(message, "larger", "component")
    return first


def _mark_repeated(bodies: Bodies, polarities: int) -> Flags:
    """Mark polarities that repeat the first by symmetry, shape (polarities, bodies)."""
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

    See Also
    --------
    rocking.Study.spectrum : Compute fractiles of the peak rotation of each block.
    rocking.Study.block_fragilities : Fit a fragility curve to each block.

    Examples
    --------
    >>> import rocking, tempfile
    >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1], restitution=[0.9])
    >>> study = rocking.create_study(tempfile.mkdtemp(), blocks, rocking.pulses.one_sine(4.0, 1.0), levels=[0.4, 1.0])
    >>> _ = study.run()
    >>> list(study.spectrum().data)
    ['fractile_over_alpha', 'overturned_share']
    """

    TABLES = MappingProxyType({"blocks": ()})

    @property
    def block_parameters(self) -> dict[str, Floats]:
        """Return the parameters of the blocks in the tables, by name, in SI units."""
        return {str(name): values.values for name, values in self.data.coords.items() if values.dims == ("block",)}

    def summary(self) -> str:
        columns = [column for column in self._columns("blocks") if column.name != "fault"]  # too long for a table
        rows = columns_to_records(columns)
        table = format_some_rows([column.key for column in columns], [[*row.values()] for row in rows])
        return f"{self.data.description}\n\n{table}"

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        attribute_sets = [data.attrs, *(variable.attrs for name, variable in data.coords.items() if name in data.dims)]
        return {
            **{name: value for attributes in attribute_sets for name, value in attributes.items() if name != "units"},
            **{str(name): variable.values for name, variable in data.coords.items() if variable.dims != ("block",)},
            "blocks": self.block_parameters,
            **{str(name): variable.values for name, variable in data.data_vars.items()},
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        """Draw the first variable against p and slenderness, in up to four panels, or one fractile."""
        from rocking.plot.maps import draw_blocks

        plotted, parameters = next(iter(self.data.data_vars.values())), self.block_parameters
        if "fractile" in plotted.dims:
            plotted = plotted.isel(fractile=int(np.argmin(np.abs(plotted.fractile.values - 0.5))))
            measure = _parse_measure(plotted.scale.attrs)
            is_factor = measure.name == "factor"
            name, unit = "factor" if is_factor else measure.short_name, measure.display_unit
            names = [f"{name} {measure.display_factor * value:.4g} {unit}".rstrip() for value in plotted.scale.values]
            panels, missing = plotted.values, "overturns"
            label = f"{100.0 * float(plotted.fractile):g} % fractile of peak rotation over slenderness"
        else:
            measure, names = _parse_measure(self.data.attrs), [str(name) for name in plotted.limit_state.values]
            panels, missing, label = measure.display_factor * plotted.values, "no curve fits", f"median {measure.label}"

        def average(name: str) -> Floats:
            keys = [key for key in (name, f"{name}_plus", f"{name}_minus") if key in parameters]
            return np.asarray(np.mean([parameters[key] for key in keys], axis=0))

        selected = {names[k]: panels[k] for k in select_evenly(len(names), 4)}
        labels: dict[str, Any] = {"value_label": label, "missing_label": missing}
        labels["block_names"] = list_block_names(self.data) if "name" in find_labels(self.data) else []
        title = title or escape_dollars(self.data.description)
        return draw_blocks(
            average("p"), average("alpha"), panels=selected, **labels, title=title, ax=ax, figsize=figsize
        )

    def _table(self, name: str) -> xr.Dataset:
        return _rename_for_tables(self.data)


def _parse_measure(attributes: Mapping[str, Any]) -> Measure:
    """Create the measure from the attributes of a variable."""
    options = {name: attributes[name] for name in ("period", "damping", "component") if name in attributes}
    return Measure(attributes["measure"], **options)


def check_fractiles(fractiles: Sequence[float]) -> Floats:
    """Check that fractiles are between 0 and 1, and return them as an array."""
    shares = np.atleast_1d(checks.numbers(fractiles, "fractiles", OptionError)).ravel()
    if not shares.size:
        raise OptionError("{} must contain at least one number, as [0.16, 0.5, 0.84]", "fractiles")
    for value in shares:
        if not 0.0 < value < 1.0:
            raise OptionError(f"each of {{}} must be between 0 and 1; got {value:g}", "fractiles", value=value)
    return shares


def _check_limit_states(limit_states: Mapping[str, float] | None, confidence: float) -> Mapping[str, float]:
    """Check the arguments of curves before outcomes are read, and return limits by limit state."""
    checks.fraction(confidence, "confidence", OptionError)
    limits = check_limit_states(limit_states)
    for name, limit in limits.items():
        check_limit(limit, name)
    return limits


def compute_spectrum(store: Store, fractiles: Sequence[float]) -> BlockTable:
    """Compute fractiles of the normalised peak rotation for each scale and block."""
    import xarray as xr

    shares = check_fractiles(fractiles)
    product, scales, count = store.product, store.product.scales, len(store.product.bodies)
    values = np.empty((len(shares), scales.count, count))
    overturned, missing_count = np.empty((scales.count, count)), 0
    with Progress("reading", count) as bar:
        for blocks, ratios in _iterate_peak_ratios(store):
            repeated = _mark_repeated(product.bodies.select(blocks), ratios.shape[2])
            missing_count += int(np.count_nonzero(np.isnan(ratios) & ~repeated))
            is_distinct = np.where(repeated, np.nan, ratios).swapaxes(1, 2).reshape(-1, scales.count, ratios.shape[3])
            values[:, :, blocks] = compute_fractiles(is_distinct, shares)
            overturned[:, blocks] = compute_overturned_share(is_distinct)
            bar.advance(blocks.stop - blocks.start)
    meaning = "peak rotation over the slenderness, infinite where that share overturns"
    variables = {
        "fractile_over_alpha": create_variable(("fractile", "scale", "block"), values, meaning, "1"),
        "overturned_share": create_variable(("scale", "block"), overturned, unit="1"),
    }
    coordinates = {"fractile": shares, "scale": ("scale", scales.values, scales.attributes)}
    text = f"fractiles of peak rotation over slenderness, {format_count(len(product.motions), 'motion')}"
    description = _describe(f"{text}, {product.model} model", missing_count)
    attributes = {"description": description, "model": product.model}
    return BlockTable(xr.Dataset(variables, coordinates | body_coordinates(product.bodies), attributes))


def _describe(text: str, missing_count: int) -> str:
    """Add the number of simulations without a result to a description."""
    return "; ".join(filter(None, [text, describe_missing(missing_count)]))


def fit_pooled_fragility(
    store: Store,
    measure: Measure,
    limit_states: Mapping[str, float] | None,
    confidence: float,
    weights: ArrayLike | None,
    clusters: ArrayLike | None,
    *,
    larger: bool = False,
) -> Fragility:
    """Fit one curve to the outcomes of all blocks, with optional weights."""
    limits = _check_limit_states(limit_states, confidence)
    product, bodies = store.product, store.product.bodies
    units, unit_indices = np.unique(compute_block_units(bodies, measure, product.model), return_inverse=True)
    shares = normalise_positive_weights(weights, len(bodies))
    motions = _list_counted_motions(product, measure, larger=larger)
    scales = product.scales.count
    trial_counts, missing_count = np.zeros((len(motions), scales, len(units))), 0
    exceedance_counts = {name: np.zeros_like(trial_counts) for name in limits}
    for blocks, ratios in _iterate_peak_ratios(store, measure if larger else None):
        membership = np.where(unit_indices[blocks][:, None] == np.arange(len(units)), shares[blocks][:, None], 0.0)
        is_known = ~np.isnan(ratios)
        trial_counts += is_known.sum(axis=2, dtype=float) @ membership
        missing_count += int(np.count_nonzero(~is_known))
        for name, limit in limits.items():
            exceedance_counts[name] += compute_exceedances(ratios, limit, name).sum(axis=2) @ membership
    has_trials = trial_counts > 0.0
    labels = assign_clusters(product.motions, clusters)[motions]
    intensities = (_compute_intensities(product, measure)[motions][:, :, None] / units)[has_trials]
    groups = np.broadcast_to(labels[:, None, None], has_trials.shape)[has_trials]
    curves = []
    for name, limit in limits.items():
        data = intensities, exceedance_counts[name][has_trials], trial_counts[has_trials]
        curves.append(fit_curve(name, data, groups, confidence, measure, limit))
    text = f"{describe_pool(bodies, weights)}, {describe_sample(labels, clusters)}, {format_count(scales, 'scale')}"
    text += f", {product.model} model{describe_polarities(product.polarity, is_symmetric=bodies.is_symmetric)}"
    text += ", the larger response" * larger
    return Fragility(
        *(tuple(curves), measure, text, find_single_block(bodies), product.model),
        outcomes=None,
        is_one_way=product.polarity != "both" and not bodies.is_symmetric,
        includes_vertical=bool(collect_verticals(product.motions)),
        has_several_blocks=bool(np.count_nonzero(shares) > 1),
        source="motion" if clusters is None else "cluster",
        missing_note=describe_missing(missing_count),
    )


#: Stored results of the curve of each block.
_CURVE_VARIABLES: Final[Mapping[str, str]] = {
    "median": "intensity that half of the outcomes exceed the limit at",
    "median_lower": "lower end of its confidence interval",
    "median_upper": "upper end of its confidence interval",
    "dispersion": "standard deviation of the logarithm of the intensity",
    "dispersion_lower": "lower end of its confidence interval",
    "dispersion_upper": "upper end of its confidence interval",
    "exceedance_count": "outcomes that exceed the limit",
    "trial_count": "outcomes that the curve is fitted to",
}


def fit_block_fragilities(
    store: Store,
    measure: Measure,
    limit_states: Mapping[str, float] | None,
    confidence: float,
    clusters: ArrayLike | None,
    *,
    larger: bool = False,
) -> BlockTable:
    """Fit a curve to the outcomes of each block."""
    import xarray as xr

    limits = _check_limit_states(limit_states, confidence)
    product, bodies, scale_count = store.product, store.product.bodies, store.product.scales.count
    estimates = {name: np.full((len(limits), len(bodies)), np.nan) for name in _CURVE_VARIABLES}
    faults, missing_count = np.full((len(limits), len(bodies)), "", dtype=object), 0
    motions = _list_counted_motions(product, measure, larger=larger)
    intensities = _compute_intensities(product, measure)[motions].ravel()
    units = compute_block_units(bodies, measure, product.model)
    labels = np.repeat(assign_clusters(product.motions, clusters)[motions], scale_count)
    fit = partial(fit_fragility, measure=measure, confidence=confidence)
    with Progress("fitting", len(bodies) * len(limits)) as bar:
        for blocks, ratios in _iterate_peak_ratios(store, measure if larger else None):
            is_repeated = _mark_repeated(bodies.select(blocks), ratios.shape[2])
            missing_count += int(np.count_nonzero(np.isnan(ratios) & ~is_repeated))
            distinct = np.where(is_repeated, np.nan, ratios)
            all_trials = np.count_nonzero(~np.isnan(distinct), axis=2).reshape(-1, distinct.shape[3])
            for i, (name, limit) in enumerate(limits.items()):
                all_exceeded = compute_exceedances(distinct, limit, name).sum(axis=2).reshape(-1, distinct.shape[3])
                for j, trials, exceeded in zip(range(len(bodies))[blocks], all_trials.T, all_exceeded.T, strict=True):
                    has_trials = trials > 0
                    data = intensities[has_trials] / units[j], {name: exceeded[has_trials]}
                    numbers = [np.nan] * 6
                    try:
                        if not has_trials.any():
                            raise FitError("every simulation was abandoned")
                        curve = fit(*data, trial_counts=trials[has_trials], clusters=labels[has_trials]).curves[0]
                        numbers = [curve.median, *curve.median_interval, curve.dispersion, *curve.dispersion_interval]
                    except FitError as error:  # identical or separated outcomes have no lognormal fit
                        faults[i, j] = str(error)
                    numbers += [exceeded.sum(), trials.sum()]
                    for values, number in zip(estimates.values(), numbers, strict=True):
                        values[i, j] = number
                    bar.advance()
    dims, unfitted_count = ("limit_state", "block"), int(np.count_nonzero(faults != ""))
    text = f"fragility of {format_count(len(bodies), 'block')}; intensity: {measure.quantity}"
    text += f"; {format_count(unfitted_count, 'curve')} cannot be fitted (see fault)" if unfitted_count else ""
    attributes = {"description": _describe(text, missing_count), "confidence": confidence, "model": product.model}
    attributes |= {"measure": measure.name, **measure.options()}
    variables = {}
    for name, values in estimates.items():
        unit = measure.units if name.startswith("median") else "1"
        variables[name] = create_variable(dims, values, _CURVE_VARIABLES[name], unit)
    variables["fault"] = create_variable(dims, faults.astype(str), "why there is no curve")
    coordinates = {"limit_state": list(limits), **body_coordinates(bodies)}
    return BlockTable(xr.Dataset(variables, coordinates, attributes))


def _compute_intensities(product: SimulationProduct, measure: Measure) -> Floats:
    """Compute the intensity of every motion at every scale, shape (motions, scales)."""
    scales = product.scales
    values = compute_intensities(product.motions, measure)
    if scales.measure == measure.motion_measure:
        return np.tile(scales.values, (len(values), 1))  # the input values, bit for bit
    factors = np.array([scales.factors(motion) for motion in product.motions])
    return np.asarray(np.abs(factors) ** measure.exponent * values[:, None])
