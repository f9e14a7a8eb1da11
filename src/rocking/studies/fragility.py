"""Fragility curves of a study: one for each block, or one for all."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.fragility.curve import Band, FragilityCurve, fitted_curve, passed
from rocking.analysis.fragility.fit import OVERTURNING, fit_fragility, of_polarities, weights_of
from rocking.analysis.fragility.result import Fragility
from rocking.analysis.levels import clusters_of, motions_in_words, only_block, pooled, units_of, values_of
from rocking.arrays import Floats
from rocking.engine import missing_text
from rocking.ensemble import Product, body_coordinates, verticals_of
from rocking.errors import InvalidOption
from rocking.motion.scaling import Measure
from rocking.progress import Progress
from rocking.result import table_of_some, variable
from rocking.studies.spectrum import BlocksResult, missing_attribute, peak_ratios, polarities_that_count, require_limits
from rocking.studies.store import Store
from rocking.tables import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What is kept of the curve of each block, and its units; those of the intensity are left out.
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


def pooled_fragility(
    store: Store,
    measure: Measure,
    limits: Mapping[str, float] = OVERTURNING,
    confidence: float = 0.9,
    weights: ArrayLike | None = None,
    clusters: ArrayLike | None = None,
) -> Fragility:
    """Fit one curve to the outcomes of all blocks, each of which may have a weight."""
    require_limits(store.grid.outcomes, limits)
    product = store.product
    units, which = np.unique(units_of(product.bodies, measure, product.model), return_inverse=True)
    shares, band = weights_of(weights, len(product.bodies)), Band(confidence=confidence)
    motions, scales, _, _ = product.shape
    counts = {name: np.zeros((motions, scales, len(units))) for name in limits}
    trials, missing = np.zeros((motions, scales, len(units))), 0
    for blocks, ratios in peak_ratios(store):
        belongs = np.where(which[blocks][:, None] == np.arange(len(units)), shares[blocks][:, None], 0.0)
        known = ~np.isnan(ratios)
        trials += known.sum(axis=2, dtype=float) @ belongs
        missing += int(np.count_nonzero(~known))
        for name, limit in limits.items():
            counts[name] += passed(ratios, limit, name).sum(axis=2) @ belongs
    x = _intensities(product, measure)[:, :, None] / units
    found = trials.ravel() > 0
    together = clusters_of(product.motions, clusters)
    groups = np.broadcast_to(together[:, None, None], x.shape).ravel()[found]
    curves = [
        fitted_curve(
            name,
            (x.ravel()[found], count.ravel()[found], trials.ravel()[found]),
            groups,
            band,
            measure,
            limits[name],
        )
        for name, count in counts.items()
    ]
    text = f"{pooled(product.bodies, weights)}, {motions_in_words(together, clusters)}, {counted(scales, 'scale')}"
    return Fragility(
        curves=tuple(curves),
        measure=measure,
        description=f"{text}, {product.model} model"
        + of_polarities(product.polarity, is_symmetric=product.bodies.is_symmetric),
        block=only_block(product.bodies),
        model=product.model,
        outcomes=None,
        one_way=product.polarity != "both" and not product.bodies.is_symmetric,
        with_vertical=bool(verticals_of(product.motions)),
        several_blocks=bool(np.count_nonzero(shares) > 1),
        source="motion" if clusters is None else "cluster",
        missing=missing_text(missing),
    )


def block_fragilities(
    store: Store,
    measure: Measure,
    limits: Mapping[str, float] = OVERTURNING,
    confidence: float = 0.9,
    clusters: ArrayLike | None = None,
    progress: bool | None = None,
) -> BlockFragilities:
    """Fit a curve to the outcomes of each block."""
    require_limits(store.grid.outcomes, limits)
    _, scales, _, count = store.grid.shape
    shape = len(limits), count
    kept = {name: np.full(shape, np.nan) for name in _KEPT}
    faults = np.full(shape, "", dtype=object)
    intensities = _intensities(store.product, measure).ravel()
    units = units_of(store.product.bodies, measure, store.product.model)
    together, missing = np.repeat(clusters_of(store.product.motions, clusters), scales), 0
    options: dict[str, Any] = {"measure": measure, "band": Band(confidence=confidence)}
    with Progress("fitting", count * len(limits), show=progress) as bar:
        for blocks, ratios in peak_ratios(store):
            counted = polarities_that_count(store.product.bodies.select(blocks), ratios.shape[2])
            for (i, (name, limit)), j in itertools.product(enumerate(limits.items()), range(blocks.start, blocks.stop)):
                polarities = int(counted[j - blocks.start])
                own = ratios[:, :, :polarities, j - blocks.start]
                exceeded = passed(own, limit, name).sum(axis=2).ravel()
                trials = np.count_nonzero(~np.isnan(own), axis=2).ravel()
                some = trials > 0
                data = intensities[some] / units[j], {name: exceeded[some]}
                kept["exceeded"][i, j], kept["outcomes"][i, j] = exceeded.sum(), trials.sum()
                missing += exceeded.size * polarities - int(trials.sum())
                try:
                    fitted = fit_fragility(*data, trials=trials[some], clusters=together[some], **options)
                except InvalidOption as error:  # no lognormal fits outcomes that are all alike, or separated
                    faults[i, j] = str(error)
                else:
                    for quantity, value in _numbers(fitted.curves[0]).items():
                        kept[quantity][i, j] = value
                bar.advance()
    import xarray as xr

    dims = "limit_state", "block"
    return BlockFragilities(
        xr.Dataset(
            {
                name: variable(dims, values, _KEPT[name], measure.units if name.startswith("median") else "1")
                for name, values in kept.items()
            }
            | {"fault": variable(dims, faults.astype(str), "why there is no curve")},
            {"limit_state": list(limits), **body_coordinates(store.product.bodies)},
            {
                "confidence": confidence,
                "model": store.product.model,
                "measure": measure.name,
                **measure.options(),
                **missing_attribute(missing),
            },
        )
    )


@dataclass(frozen=True, eq=False, repr=False)
class BlockFragilities(BlocksResult):
    """Lognormal fragility curves, one for each block and limit state; from `Study.block_fragilities`.

    Attributes
    ----------
    data : xarray.Dataset
        Over (limit_state, block): median with its confidence interval (median_lower, median_upper; SI units of the
        measure), dispersion likewise, exceeded (how many outcomes exceed the limit), outcomes (of how many: a block
        with two equal sides has those of one polarity), and fault: why there is no curve, empty where there is one.
        Parameters of the blocks are coordinates.
    """

    TABLES = MappingProxyType({"curves": (*_KEPT, "fault")})

    @property
    def measure(self) -> Measure:
        """Intensity measure."""
        return Measure(
            self.data.measure,
            **{name: self.data.attrs[name] for name in ("period", "damping") if name in self.data.attrs},
        )

    @property
    def _heading(self) -> str:
        least, most = int(self.data.outcomes.min()), int(self.data.outcomes.max())
        each = counted(most, "outcome") if least == most else f"{least} to {counted(most, 'outcome')}"
        return f"fragility of {counted(self.data.sizes['block'], 'block')}, {each} each"

    def summary(self) -> str:
        data, scale = self.data, self.measure.scale
        parameters = self.block_parameters
        header = ["limit state", "block", *parameters, "exceeded", "median", "between", "dispersion"]
        rows = []
        for i, j in itertools.product(range(data.sizes["limit_state"]), range(data.sizes["block"])):
            one = {name: values[i, j] for name, values in ((name, data[name].values) for name in _KEPT)}
            between = f"{scale * one['median_lower']:.4g} to {scale * one['median_upper']:.4g}"
            rows.append(
                [
                    str(data.limit_state.values[i]),
                    j,
                    *(float(values[j]) for values in parameters.values()),
                    f"{one['exceeded']:.0f} of {one['outcomes']:.0f}",
                    scale * float(one["median"]),
                    "-" if data.fault.values[i, j] else between,
                    float(one["dispersion"]),
                ]
            )
        without = int(np.count_nonzero(data.fault.values != ""))
        text = f"{self._heading}; intensity: {self.measure.label}"
        text += f"; {counted(without, 'curve')} cannot be fitted (fault says why)" if without else ""
        text += f"; {data.missing}" if "missing" in data.attrs else ""
        return f"{text}\n\n{table_of_some(header, rows)}"

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        return {
            **data.attrs,
            "intensity_units": self.measure.units,
            "limit_state": data.limit_state.values,
            "blocks": self.block_parameters,
            **{str(name): data[name].values for name in data.data_vars},
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        """Draw the median of each block over its frequency parameter and slenderness, a panel for each limit state.

        Raises
        ------
        InvalidOption
            If there are several limit states for the one `ax`.
        """
        from rocking.plot.maps import blocks_figure

        names = [str(name) for name in self.data.limit_state.values]
        medians = self.measure.scale * self.data["median"].values
        return blocks_figure(
            *self._plane(),
            panels=dict(zip(names, medians, strict=True)),
            value_label=f"median {self.measure.label}",
            missing_label="no curve fits",
            title=title or self._heading,
            ax=ax,
            figsize=figsize,
        )


def _numbers(curve: FragilityCurve) -> dict[str, float]:
    """Return what is kept of a curve."""
    ends = *curve.median_interval, *curve.dispersion_interval
    names = "median_lower", "median_upper", "dispersion_lower", "dispersion_upper"
    return {"median": curve.median, "dispersion": curve.dispersion, **dict(zip(names, ends, strict=True))}


def _intensities(product: Product, measure: Measure) -> Floats:
    """Return what every motion measures at every scale, shape (motions, scales)."""
    scales = product.scales
    values = values_of(product.motions, measure)
    if scales.measure == measure.alone:
        return np.tile(scales.values, (len(values), 1))  # as they were given, to the last bit
    factors = np.array([scales.factors(motion) for motion in product.motions])
    return np.asarray(np.abs(factors) * values[:, None])
