"""Efficiency of intensity measures as predictors of overturning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.incremental import incremental_dynamic_analysis
from rocking.analysis.levels import (
    MIRROR_NOTE,
    assign_clusters,
    assign_families,
    compute_block_units,
    compute_intensities,
    describe_pool,
    describe_sample,
    normalise_weights,
)
from rocking.block.body import Bodies, Body
from rocking.core import checks
from rocking.core.arrays import Flags, Floats
from rocking.core.constants import Model
from rocking.core.result import DatasetResult, create_variable
from rocking.core.tables import escape_dollars, format_count, format_table
from rocking.engine.problem import compute_slenderness, gather_bodies
from rocking.errors import OptionError
from rocking.motion.scaling import ComponentName, IntensityName, Measure
from rocking.records.named import Motions, list_motions

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def compare_measures(
    blocks: Bodies | Body | Sequence[Body],
    motions: Motions,
    *,
    periods: ArrayLike = (0.5, 1.0, 2.0),
    damping: float = 0.05,
    further_measures: Sequence[IntensityName | Measure] = (),
    component: ComponentName = "own",
    model: Model = "nonlinear",
    weights: ArrayLike | None = None,
    clusters: object = None,
    rtol: float = 1e-6,
) -> MeasureComparison:
    """Compare the dispersion of overturning motions for several intensity measures.

    Parameters
    ----------
    blocks, motions : optional
        As for `simulate_many`: n blocks, and m >= 2 motions.
    periods : array_like
        Periods of spectral accelerations, s.
    damping : float
        Fraction of critical damping of the spectral accelerations.
    further_measures : sequence of str or Measure
        Further measures, for example ``["arias", "cav"]``.
    component : str
        Component of all measures but those in `further_measures` that state another, as for `Measure`.
    model : {"nonlinear", "linear"}
        Equation of motion.
    weights, clusters : optional
        As for `fragility`. A cluster counts as one motion in the intervals.
    rtol : float
        Relative width of the brackets of the overturning intensities.

    Returns
    -------
    MeasureComparison
        Comparison of PGA, PGV, each spectral acceleration, further measures, and PGA and PGV in a block's own units.

    Raises
    ------
    OptionError
        If an argument is out of range, fewer than two motions or clusters are available or overturn a block, or a block
        never comes to rest.
    MotionError
        If a motion is zero throughout.

    See Also
    --------
    rocking.incremental_dynamic_analysis : Find the levels that overturn each block.
    rocking.fragility : Fit fragility curves for one measure.

    Notes
    -----
    Every motion is scaled up in steps of 5 % until it overturns the block (`incremental_dynamic_analysis`). The
    standard deviation beta of the logarithm of this intensity over the motions is the dispersion of the fragility.
    Efficient measures have a small beta. The interval of beta assumes a normal sample. For several blocks, beta is
    pooled from the deviations from each block's mean, with the degrees of freedom of the motions or clusters. Only the
    first of motions that are multiples of one another counts, and reversed ones as well if the sides of a block differ.

    Examples
    --------
    Rectangular pulses overturn a small block by their velocity, whatever their length:

    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=0.5, alpha=0.1, restitution=0.5)
    >>> pulses = [rocking.pulses.rectangular(1.0, length) for length in (0.05, 0.1, 0.2)]
    >>> comparison = compare_measures(block, pulses, periods=[1.0])
    >>> [f"{name} {beta:.2f}" for name, beta in zip(comparison.data.measure.values, comparison.data.dispersion.values)]
    ['PGA 0.67', 'PGV 0.02', 'SA(1 s) 0.01', 'PGA / uplift acceleration 0.67', 'p PGV / uplift acceleration 0.02']
    """
    bodies, motions = gather_bodies(blocks), list_motions(motions)
    compute_slenderness(bodies)  # raise errors before the simulations
    block_weights = normalise_weights(weights, len(bodies))
    if len(motions) < 2:
        raise OptionError("{} must contain at least two motions for a comparison of measures; got one", "motions")
    period_values = checks.positive_numbers(periods, "periods", OptionError)
    spectral_measures = [Measure("sa", float(time), damping) for time in period_values]
    parsed_measures = [Measure.parse(name) for name in checks.items(further_measures, "further_measures", OptionError)]
    measures = [
        Measure("pga"),
        Measure("pgv"),
        *spectral_measures,
        *parsed_measures,
        Measure("pga_ratio"),
        Measure("pgv_ratio"),
    ]
    measures = [replace(item, component=component) if item.component == "own" else item for item in measures]
    cluster_numbers = assign_clusters(motions, clusters)
    _check_sample_size(len(np.unique(cluster_numbers)), clusters)
    analysis = incremental_dynamic_analysis(bodies, motions, measure=measures[-2], model=model, rtol=rtol)
    levels = analysis.data.overturning_level.transpose("motion", "block").values
    values = [compute_intensities(motions, measure)[:, None] for measure in measures]
    units = [compute_block_units(bodies, measure, model) for measure in measures]
    factors = levels * units[-2] / values[0]  # on the motions; levels are of pga_ratio
    rows = zip(measures, values, units, strict=True)
    intensity = np.array([factors**measure.exponent * value / unit for measure, value, unit in rows])
    families = assign_families(motions, include_reversed=bodies.is_symmetric)
    is_first = np.isin(np.arange(len(motions)), np.unique(families, return_index=True)[1])
    is_counted = is_first[:, None] & np.isfinite(levels)
    cluster_counts = [len(np.unique(cluster_numbers[overturns])) for overturns in is_counted[:, block_weights > 0.0].T]
    _check_sample_size(min(cluster_counts), clusters)
    dataset = _combine_dispersions(measures, intensity, is_counted, block_weights, dof=min(cluster_counts) - 1)
    attributes = {"blocks": describe_pool(blocks, weights), "model": model, "damping": damping}
    attributes |= {"sample": describe_sample(cluster_numbers, clusters), "sides_differ": analysis.data.sides_differ}
    coordinates = {name: analysis.data[name] for name in ("motion", "vertical") if name in analysis.data.coords}
    return MeasureComparison(dataset.assign_coords(coordinates).assign_attrs(attributes))


@dataclass(frozen=True, eq=False, repr=False)
class MeasureComparison(DatasetResult):
    """Comparison of intensity measures, computed by `compare_measures`.

    Figure and summary list the dispersion of each measure with its interval, the most efficient first.

    Attributes
    ----------
    data : xarray.Dataset
        Over (measure, motion, block): intensity, the lowest that overturns, in the measure's unit, or NaN. Over
        (measure): median_intensity, unit, dispersion (standard deviation of the logarithm about each block's mean) with
        its 90 % interval dispersion_low and dispersion_high, and dispersion_of_all (about a common mean). Attributes:
        damping of the spectral accelerations, and sample, the number of motions.

    See Also
    --------
    rocking.compare_measures : Run the comparison.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=0.5, alpha=0.1, restitution=0.5)
    >>> pulses = [rocking.pulses.rectangular(1.0, length) for length in (0.05, 0.2)]
    >>> comparison = rocking.compare_measures(block, pulses)
    >>> f"PGV {float(comparison.data.dispersion.sel(measure='PGV')):.2f}"
    'PGV 0.03'
    """

    TABLES: ClassVar = {
        "measures": ("median_intensity", "dispersion", "dispersion_low", "dispersion_high", "dispersion_of_all"),
        "intensities": ("intensity",),
    }
    AGGREGATED_DIMENSIONS = ("motion", "block")

    @property
    def _ranked_table(self) -> pd.DataFrame:
        """Table of measures, the most efficient first."""
        table = self.data[list(self.TABLES["measures"])].to_dataframe()
        return table.sort_values("dispersion_of_all", kind="stable")

    def summary(self) -> str:
        data, table = self.data, self._ranked_table
        is_pooled, min_dispersion = data.sizes["block"] > 1, table.dispersion_of_all.min()
        rows = [
            [
                row.Index,
                f"{row.median_intensity:.3g} {row.unit}".removesuffix(" 1"),
                f"{row.dispersion:.3f}",
                f"{row.dispersion_low:.3f} to {row.dispersion_high:.3f}",
                *([f"{row.dispersion_of_all:.3f}"] if is_pooled else []),
                f"{row.dispersion_of_all / min_dispersion:.2f}" if min_dispersion > 0.0 else "-",
            ]
            for row in table.itertuples()
        ]
        headline = f"{data.blocks}, {data.model} model: intensities at which {data.sample} overturn"
        columns = ["measure", "median", "dispersion", "90 % between", *(["of all blocks"] if is_pooled else [])]
        lines = [headline, "", format_table([*columns, "over the best"], rows)]
        if missing := int(np.sum(np.isnan(data.intensity.values[0]))):
            pairs = format_count(missing, "pair")
            lines.append(f"left out: {pairs} of block and motion without overturning at any level looked at")
        return "\n".join(lines + [f"note: {MIRROR_NOTE}"] * data.sides_differ)

    def to_dict(self) -> dict[str, Any]:
        data, names = self.data, self.TABLES["measures"]
        rows = data[list(names)].to_dataframe()[["unit", *names]].reset_index().to_dict("records")
        return {
            "blocks": data.blocks,
            "model": data.model,
            "damping": data.damping,
            "motions": [str(name) for name in data.motion.values],
            **({"verticals": [str(name) for name in data.vertical.values]} if "vertical" in data.coords else {}),
            "measures": [{**row, "intensity": values} for row, values in zip(rows, data.intensity.values, strict=True)],
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import draw_dispersions

        data, table = self.data, self._ranked_table
        return draw_dispersions(
            names=[str(name) for name in table.index],
            dispersion=table.dispersion.to_numpy(),
            low=table.dispersion_low.to_numpy(),
            high=table.dispersion_high.to_numpy(),
            title=title or escape_dollars(f"{data.blocks}, {data.model} model, {data.sample}"),
            ax=ax,
            figsize=figsize,
        )


def _combine_dispersions(
    measures: Sequence[Measure], intensity: Floats, is_counted: Flags, block_weights: Floats, *, dof: int
) -> xr.Dataset:
    """Combine intensities at overturning (measure, motion, block) with the dispersions of valid ones."""
    import xarray as xr
    from scipy.special import chdtri

    logarithm = np.where(is_counted, np.log(intensity), np.nan)
    weights, motion_counts = np.where(is_counted, block_weights, 0.0), is_counted.sum(axis=0)
    # The sample consists of motions, which are the same for several blocks.
    total_dof = np.sum(block_weights * (motion_counts - 1))
    deviation = logarithm - np.nansum(logarithm, axis=1, keepdims=True) / np.maximum(motion_counts, 1)
    dispersion = np.sqrt(np.nansum(weights * deviation**2, axis=(1, 2)) / total_dof)
    mean_log = np.nansum(weights * logarithm, axis=(1, 2)) / weights.sum()
    pooled = np.sqrt(np.nansum(weights * (logarithm - mean_log[:, None, None]) ** 2, axis=(1, 2)) / total_dof)
    # Ratios of the ends of the interval to the standard deviation, for a normal sample.
    low, high = (float(np.sqrt(dof / chdtri(dof, tail))) * dispersion for tail in (0.05, 0.95))
    spread = "standard deviation of the logarithm of the intensity at overturning"
    median_text = "median of the intensities at overturning, in the measure's unit"
    return xr.Dataset(
        {
            "intensity": create_variable(("measure", "motion", "block"), intensity, "lowest intensity that overturns"),
            "median_intensity": create_variable("measure", np.exp(mean_log), median_text),
            "dispersion": create_variable("measure", dispersion, f"{spread} about each block's own mean", "1"),
            "dispersion_low": create_variable("measure", low, "lower end of its interval", "1"),
            "dispersion_high": create_variable("measure", high, "upper end of its interval", "1"),
            "dispersion_of_all": create_variable("measure", pooled, f"{spread} about one mean of all blocks", "1"),
        },
        {"measure": [item.short_name for item in measures], "unit": ("measure", [item.units for item in measures])},
    )


def _check_sample_size(sample_size: int, clusters: object) -> None:
    """Raise an error for a sample of one cluster, or of one motion without clusters."""
    if sample_size < 2:
        argument, kind = ("motions", " that are not multiples of one another") if clusters is None else ("clusters", "")
        message = f"fewer than two {{}}{kind} overturn a block at any scale; a dispersion requires at least two"
        raise OptionError(message, argument)
