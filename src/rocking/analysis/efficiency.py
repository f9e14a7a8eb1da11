"""Efficiency of intensity measures: which one predicts best when motions overturn a block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.incremental import incremental_dynamic_analysis
from rocking.analysis.levels import (
    MIRROR_NOTE,
    clusters_of,
    families_of,
    motions_in_words,
    normalised_weights,
    pooled,
    units_of,
    values_of,
)
from rocking.block.body import Bodies, Body
from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.constants import Model
from rocking.core.result import DatasetResult, variable
from rocking.core.tables import as_written, text_table
from rocking.engine.problem import bodies_of, slenderness_of
from rocking.errors import InvalidOption
from rocking.motion.scaling import Measure
from rocking.records.named import Motions, several_motions

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def compare_measures(
    blocks: Bodies | Body | Sequence[Body],
    motions: Motions,
    *,
    periods: ArrayLike = (0.5, 1.0, 2.0),
    damping: float = 0.05,
    model: Model = "nonlinear",
    weights: ArrayLike | None = None,
    clusters: object = None,
    tolerance: float = 1e-4,
    threads: int | None = None,
    progress: bool | None = None,
) -> MeasureComparison:
    """Compare how widely motions scatter, by several intensity measures, at which they first overturn blocks.

    Parameters
    ----------
    blocks, motions : optional
        As for `simulate_many`: n blocks, and m motions, two at least.
    periods : array_like
        Periods of spectral accelerations, s.
    damping : float
        Their fraction of critical damping.
    model : {"nonlinear", "linear"}
        Equation of motion.
    weights, clusters : optional
        As for `fragility`; a cluster counts as one motion in the intervals.
    tolerance : float
        Width of the intensities at overturning, relative to them.
    threads, progress : optional
        As for `simulate_many`.

    Returns
    -------
    MeasureComparison
        For PGA, PGV, each spectral acceleration, and PGA and PGV in a block's own units.

    Raises
    ------
    InvalidOption
        If an argument is out of its range, fewer than two motions, or motions of fewer than two clusters, are given or
        overturn a block, or a block never comes to rest.
    InvalidMotion
        If a motion is zero throughout.

    Notes
    -----
    Every motion is scaled up, in steps of 5 %, until it overturns the block (`incremental_dynamic_analysis`). The
    logarithm of its intensity there has the standard deviation beta over the motions, the dispersion of the fragility:
    the smaller, the more efficient the measure. The interval of beta is that of a normal sample. Over several blocks
    beta is pooled from the deviations from each block's own mean, with the degrees of freedom of the motions or
    clusters. Of motions that are multiples of one another only the first counts; where the sides of a block differ,
    reversed ones count as well.

    Examples
    --------
    Rectangular pulses overturn a small block by their velocity, whatever their length:

    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=0.5, alpha=0.1, restitution=0.5)
    >>> pulses = [rocking.pulses.rectangular(1.0, length) for length in (0.05, 0.1, 0.2)]
    >>> found = compare_measures(block, pulses, periods=[1.0])
    >>> [f"{name} {beta:.2f}" for name, beta in zip(found.data.measure.values, found.data.dispersion.values)]
    ['PGA 0.67', 'PGV 0.02', 'SA(1 s) 0.01', 'PGA / uplift acceleration 0.67', 'p PGV / uplift acceleration 0.02']
    """
    many, shaken = bodies_of(blocks), several_motions(motions)
    slenderness_of(many)  # refused before the work
    shares = normalised_weights(weights, len(many))
    if len(shaken) < 2:
        raise InvalidOption("measures are compared by how {} scatter: give two or more, not one", "motions")
    times = checks.positive_numbers(periods, "periods", InvalidOption)
    measures = [
        Measure("pga"),
        Measure("pgv"),
        *(Measure("sa", float(time), damping) for time in times),
        Measure("pga_ratio"),
        Measure("pgv_ratio"),
    ]
    together = clusters_of(shaken, clusters)
    _check_enough(len(np.unique(together)), clusters)
    scaled = incremental_dynamic_analysis(
        many, shaken, measure="pga_ratio", model=model, tolerance=tolerance, threads=threads, progress=progress
    )
    lifting = units_of(many, Measure("pga_ratio"), model)
    level = scaled.data.overturning_level.transpose("motion", "block").values
    factors = level * lifting / np.array([motion.pga for motion in shaken])[:, None]
    intensity = np.stack(
        [factors * values_of(shaken, measure)[:, None] / units_of(many, measure, model) for measure in measures]
    )
    families = families_of(shaken, reversed_too=many.is_symmetric)
    is_first = np.isin(np.arange(len(shaken)), np.unique(families, return_index=True)[1])
    counted_in = np.isfinite(level[is_first])[:, shares > 0.0]
    sizes = [len(np.unique(together[is_first][overturns])) for overturns in counted_in.T]
    _check_enough(min(sizes), clusters)
    named_motions = {name: scaled.data[name] for name in ("motion", "vertical") if name in scaled.data.coords}
    found = _dataset(measures, intensity, named_motions, shares, is_first, freedom=min(sizes) - 1)
    about = {"blocks": pooled(blocks, weights), "model": model, "damping": damping}
    about["sample"] = motions_in_words(together, clusters)
    return MeasureComparison(found.assign_attrs(about, sides_differ=scaled.data.sides_differ))


@dataclass(frozen=True, eq=False, repr=False)
class MeasureComparison(DatasetResult):
    """Intensity measures side by side; from `compare_measures`.

    Its figure has the dispersion of each measure with its interval, the most efficient first, as the summary.

    Attributes
    ----------
    data : xarray.Dataset
        Over (measure, motion, block): intensity, the lowest that overturns, in the measure's unit; NaN where none does.
        Over (measure): median_intensity; dispersion (standard deviation of the logarithm about each block's own mean),
        with dispersion_low and dispersion_high, its 90 % interval; dispersion_of_all, about one mean of all blocks;
        unit. Its attribute damping is that of the spectral accelerations, sample how many motions there are.
    """

    TABLES = MappingProxyType(
        {
            "measures": ("median_intensity", "dispersion", "dispersion_low", "dispersion_high", "dispersion_of_all"),
            "intensities": ("intensity",),
        }
    )
    POOLED = ("motion", "block")

    def _order(self) -> Integers:
        """Positions of the measures, the most efficient first."""
        return np.argsort(self.data.dispersion_of_all.values, kind="stable")

    def summary(self) -> str:
        data = self.data
        several = data.sizes["block"] > 1
        order = self._order()
        best = data.dispersion_of_all.values.min()
        rows = [
            [
                str(data.measure.values[k]),
                f"{data.median_intensity.values[k]:.3g} {data.unit.values[k]}".removesuffix(" 1"),
                f"{data.dispersion.values[k]:.3f}",
                f"{data.dispersion_low.values[k]:.3f} to {data.dispersion_high.values[k]:.3f}",
                *([f"{data.dispersion_of_all.values[k]:.3f}"] if several else []),
                f"{data.dispersion_of_all.values[k] / best:.2f}" if best > 0.0 else "-",
            ]
            for k in order
        ]
        head = f"{data.blocks}, {data.model} model: intensities at which {data.sample} overturn"
        columns = ["measure", "median", "dispersion", "90 % between", *(["of all blocks"] if several else [])]
        text = [head, "", text_table([*columns, "over the best"], rows)]
        missing = int(np.sum(np.isnan(data.intensity.values[0])))
        if missing:
            pairs = "1 pair" if missing == 1 else f"{missing} pairs"
            text.append(f"left out: {pairs} of block and motion without overturning at any level looked at")
        return "\n".join(text + ([f"note: {MIRROR_NOTE}"] if data.sides_differ else []))

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        names = self.TABLES["measures"]
        return {
            "blocks": data.blocks,
            "model": data.model,
            "damping": data.damping,
            "motions": [str(name) for name in data.motion.values],
            **({"verticals": [str(name) for name in data.vertical.values]} if "vertical" in data.coords else {}),
            "measures": [
                {
                    "measure": str(data.measure.values[k]),
                    "unit": str(data.unit.values[k]),
                    **{name: float(data[name].values[k]) for name in names},
                    "intensity": data.intensity.values[k],
                }
                for k in range(data.sizes["measure"])
            ],
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import dispersions_figure

        data, order = self.data, self._order()
        return dispersions_figure(
            names=[str(name) for name in data.measure.values[order]],
            dispersion=data.dispersion.values[order],
            low=data.dispersion_low.values[order],
            high=data.dispersion_high.values[order],
            title=title or as_written(f"{data.blocks}, {data.model} model, {data.sample}"),
            ax=ax,
            figsize=figsize,
        )


def _dataset(
    measures: Sequence[Measure],
    intensity: Floats,
    motions: dict[str, xr.DataArray],
    shares: Floats,
    is_first: Flags,
    *,
    freedom: int,
) -> xr.Dataset:
    """Intensities at overturning and their dispersions; only motions that are the first of their kind count."""
    import xarray as xr
    from scipy.special import chdtri

    logarithm = np.where(is_first[:, None], np.log(intensity), np.nan)
    weight = np.where(np.isfinite(logarithm[0]), shares, 0.0)
    count = np.isfinite(logarithm[0]).sum(axis=0)
    # Motions are what is drawn: those of several blocks are the same.
    others = np.sum(shares * (count - 1))
    # Ends of a standard deviation's interval over its estimate, for a normal sample.
    tail = 0.5 * (1.0 - 0.9)
    low, high = (float(np.sqrt(freedom / chdtri(freedom, share))) for share in (tail, 1.0 - tail))
    within = logarithm - np.nansum(logarithm, axis=1, keepdims=True) / np.maximum(count, 1)
    about_own = np.sqrt(np.nansum(weight * within**2, axis=(1, 2)) / others)
    mean = np.nansum(weight * logarithm, axis=(1, 2)) / weight.sum()
    of_all = np.nansum(weight * (logarithm - mean[:, None, None]) ** 2, axis=(1, 2)) / others
    spread = "standard deviation of the logarithm of the intensity at overturning"
    return xr.Dataset(
        {
            "intensity": variable(("measure", "motion", "block"), intensity, "lowest intensity that overturns"),
            "median_intensity": variable(
                "measure", np.exp(mean), "median of the intensities at overturning, in the measure's unit"
            ),
            "dispersion": variable("measure", about_own, f"{spread} about each block's own mean", "1"),
            "dispersion_low": variable("measure", low * about_own, "lower end of its interval", "1"),
            "dispersion_high": variable("measure", high * about_own, "upper end of its interval", "1"),
            "dispersion_of_all": variable("measure", np.sqrt(of_all), f"{spread} about one mean of all blocks", "1"),
        },
        {
            "measure": [measure.short_name for measure in measures],
            "unit": ("measure", [measure.units for measure in measures]),
            **motions,
        },
    )


def _check_enough(count: int, clusters: object) -> None:
    """Refuse a sample of one: so many clusters, or motions if no clusters were given."""
    if count < 2:
        kind, which = ("motions", " that are not multiples of one another") if clusters is None else ("clusters", "")
        raise InvalidOption(
            f"fewer than two {{}}{which} overturn a block, however strong; a dispersion needs more", kind
        )
