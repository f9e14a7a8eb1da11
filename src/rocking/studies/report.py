"""The report of a study: what is wanted of it, and how that is made."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.curve import fitted_curve
from rocking.analysis.fragility import Fragility, fit_fragility
from rocking.analysis.levels import (
    OVERTURNING,
    checked_limit,
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
from rocking.core.arrays import Floats, Integers, evenly
from rocking.core.progress import Progress, note
from rocking.core.result import DatasetResult, table_of_some, variable
from rocking.core.tables import as_written, counted
from rocking.engine.problem import slenderness_of
from rocking.engine.tasks import missing_text
from rocking.errors import InvalidOption, Message, StudyError, Unfitted
from rocking.motion.scaling import INTENSITIES, IntensityName, Measure
from rocking.simulation.ensemble import Product, body_coordinates, verticals_of
from rocking.studies.folder import Folder, Store
from rocking.studies.product import require

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FRACTILES: Final = (0.16, 0.5, 0.84)

#: Simulations that are held in memory at a time.
_HELD: Final = 4_000_000


#: Outcomes that peak rotations over slenderness follow from.
_RATIO: Final = ("overturned", "peak_rotation")


def require_limits(kept: Sequence[str], limits: Mapping[str, float]) -> None:
    """Check that it follows from these outcomes whether limits are passed: overturning needs no peak rotation."""
    finite = [name for name, limit in limits.items() if math.isfinite(checked_limit(limit, name))]
    if finite:
        require(kept, _RATIO, f"{{}}.{finite[0]}", "limits")
    else:
        require(kept, ["overturned"], "a fragility")


def polarities_that_count(bodies: Bodies, polarities: int) -> Integers:
    """Return how many polarities have outcomes of their own, for each body: a symmetric one does the same in both."""
    if bodies.is_symmetric or polarities == 1:
        return np.ones(len(bodies), int)
    alone = (bodies.select(slice(k, k + 1)) for k in range(len(bodies)))
    return np.array([1 if each.is_symmetric else polarities for each in alone])


def peak_ratios(store: Store) -> Iterator[tuple[slice, Floats]]:
    """Peak rotation over slenderness (motions, scales, polarities, blocks), infinite if overturned, by blocks.

    It is NaN where the simulation was given up, and 0 of blocks that stand where no peak rotation is kept.
    """
    store.require_complete()
    motions, scales, polarities, _ = store.grid.shape
    shape = motions, scales, 1 if store.product.bodies.is_symmetric else polarities
    width = max(1, _HELD // math.prod(shape))
    for unit in range(store.grid.cells[-1]):
        *_, whole = store.grid.ranges((0, 0, 0, unit))
        for start in range(whole.start, whole.stop, width):
            blocks = slice(start, min(start + width, whole.stop))
            yield blocks, _read(store, shape, unit, blocks)


def _read(store: Store, shape: tuple[int, int, int], unit: int, blocks: slice) -> Floats:
    alpha = slenderness_of(store.product.bodies.select(blocks))
    ratios = np.empty((*shape, len(alpha)))
    for cell in np.ndindex(store.grid.cells[:3]):
        key = *cell, unit
        motions, scales, polarities, whole = store.grid.ranges(key)
        some = slice(blocks.start - whole.start, blocks.stop - whole.start)
        outcomes = {name: values[..., some] for name, values in store.present(key).items()}
        stopped = int(np.count_nonzero(outcomes["stopped"]))
        if stopped:
            raise StudyError(
                f"{stopped} of {outcomes['stopped'].size} simulations of a unit were stopped by the study's duration, "
                "while the block moved or the motion went on, so that their verdicts are not known: make the study "
                "without a duration"
            )
        there = ratios[motions, scales, polarities]
        peak = outcomes.get("peak_rotation", np.zeros_like(outcomes["overturned"]))
        found = ratios_of(peak, outcomes["overturned"] != 0.0, outcomes["unfinished"] != 0.0, alpha)
        there[...] = found[:, :, : there.shape[2]]
    return ratios


@dataclass(frozen=True, eq=False, repr=False)
class BlocksResult(DatasetResult):
    """Result of a study that has a dimension ``block``, whose parameters are coordinates."""

    @property
    def block_parameters(self) -> dict[str, Floats]:
        """Parameters of the blocks by name, SI units: those that tables list."""
        return {str(name): one.values for name, one in self.data.coords.items() if one.dims == ("block",)}

    def _plane(self) -> tuple[Floats, Floats]:
        """Frequency parameters (rad/s) and slendernesses (rad) of the blocks: means of unequal sides."""
        parameters = self.block_parameters
        p, alpha = (
            np.mean([parameters[one] for one in (name, f"{name}_plus", f"{name}_minus") if one in parameters], axis=0)
            for name in ("p", "alpha")
        )
        return p, alpha


def _measure_of(about: Mapping[str, Any]) -> Measure:
    """Return the measure that attributes describe."""
    return Measure(about["measure"], **{name: about[name] for name in ("period", "damping") if name in about})


def study_spectrum(store: Store, fractiles: Sequence[float], progress: bool | None) -> StudySpectrum:
    """Fractiles over motions and polarities of peak rotation over slenderness, for each scale and block."""
    import xarray as xr

    require(store.grid.outcomes, _RATIO, "a spectrum")
    shares = checked_fractiles(fractiles)
    product, count = store.product, len(store.product.bodies)
    values = np.empty((len(shares), product.scales.count, count))
    overturned, missing = np.empty((product.scales.count, count)), 0
    with Progress("reading", count, show=progress) as bar:
        for blocks, ratios in peak_ratios(store):
            counted = polarities_that_count(product.bodies.select(blocks), ratios.shape[2])
            for polarities in np.unique(counted):
                some = np.flatnonzero(counted == polarities)
                own = ratios[:, :, :polarities, some]
                pooled = own.swapaxes(1, 2).reshape(-1, product.scales.count, some.size)
                values[:, :, blocks.start + some] = fractiles_of(pooled, shares)
                overturned[:, blocks.start + some] = overturned_share(pooled)
                missing += int(np.count_nonzero(np.isnan(pooled)))
            bar.advance(blocks.stop - blocks.start)
    words = "peak rotation over the slenderness, infinite where that share overturns"
    return StudySpectrum(
        xr.Dataset(
            {
                "fractile_over_alpha": (("fractile", "scale", "block"), values, {"units": "1", "long_name": words}),
                "overturned_share": (("scale", "block"), overturned, {"units": "1"}),
            },
            {
                "fractile": shares,
                "scale": ("scale", product.scales.values, product.scales.about),
                **body_coordinates(product.bodies),
            },
            {"motions": len(product.motions), "model": product.model}
            | ({"missing": missing_text(missing)} if missing else {}),
        )
    )


def checked_fractiles(fractiles: Sequence[float]) -> Floats:
    """Return shares between 0 and 1, checked."""
    shares = checks.numbers(fractiles, "fractiles", InvalidOption).ravel()
    if not shares.size:
        raise InvalidOption("{} must hold a share of the motions or more, as [0.16, 0.5, 0.84]", "fractiles")
    for value in shares:
        if not 0.0 < value < 1.0:
            raise InvalidOption(
                f"each of {{}} must be a number between 0 and 1, not {value:g}", "fractiles", value=value
            )
    return shares


@dataclass(frozen=True, eq=False, repr=False)
class StudySpectrum(BlocksResult):
    """Peak rotations of every block at every scale; from `Study.spectrum`.

    Attributes
    ----------
    data : xarray.Dataset
        Over (fractile, scale, block): fractile_over_alpha, infinite where that share of the motions overturns the
        block. Over (scale, block): overturned_share. Parameters of the blocks are coordinates.
    """

    TABLES = MappingProxyType({"fractiles": ("fractile_over_alpha", "overturned_share")})

    def summary(self) -> str:
        data, one = self.data, self._fractile(0.5)
        parameters, chosen = self.block_parameters, self._some_scales()
        header = ["block", *parameters, *(self._scale_name(i) for i in chosen)]
        rows = [
            [
                j,
                *(float(values[j]) for values in parameters.values()),
                *("overturns" if np.isinf(value) else float(value) for value in one.values[chosen, j]),
            ]
            for j in range(data.sizes["block"])
        ]
        what = f"{100 * float(one.fractile):g} % fractile of peak rotation over slenderness"
        return f"{what}; {self._about()}\n\n{table_of_some(header, rows)}"

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        return {
            **data.attrs,
            **{name: value for name, value in data.scale.attrs.items() if name != "units"},
            "scale": data.scale.values,
            "blocks": self.block_parameters,
            "fractile": data.fractile.values,
            "fractile_over_alpha": data.fractile_over_alpha.values,
            "overturned_share": data.overturned_share.values,
        }

    def plot(
        self,
        ax: Axes | None = None,
        *,
        fractile: float = 0.5,
        title: str = "",
        figsize: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw the nearest `fractile` of each block over p and slenderness, at up to four scales, as `Result.plot`."""
        from rocking.plot.maps import blocks_figure

        one = self._fractile(fractile)
        return blocks_figure(
            *self._plane(),
            panels={self._scale_name(i): one.values[i] for i in self._some_scales()},
            value_label=f"{100 * float(one.fractile):g} % fractile of peak rotation over slenderness",
            missing_label="so many motions overturn the block that there is none",
            title=title or as_written(self._about()),
            ax=ax,
            figsize=figsize,
        )

    def _table(self, name: str) -> xr.Dataset:
        # A table's column is named for what the scales are, as in an export: pga_m_s2, or factor.
        return super()._table(name).rename(scale=self.data.scale.attrs["measure"])

    def _fractile(self, wanted: float) -> xr.DataArray:
        nearest = int(np.argmin(np.abs(self.data.fractile.values - wanted)))
        found: xr.DataArray = self.data.fractile_over_alpha.isel(fractile=nearest)
        return found

    def _about(self) -> str:
        motions, scales, shown = int(self.data.motions), self.data.sizes["scale"], len(self._some_scales())
        left_out = f"; {shown} of {scales} scales are shown" if shown < scales else ""
        missing = f"; {self.data.missing}" if "missing" in self.data.attrs else ""
        return f"{counted(motions, 'motion')}, {self.data.model} model{left_out}{missing}"

    def _some_scales(self) -> list[int]:
        return evenly(self.data.sizes["scale"], 4)

    def _scale_name(self, i: int) -> str:
        value, about = float(self.data.scale.values[i]), self.data.scale.attrs
        if about["measure"] == "factor":
            return f"factor {value:.4g}"
        measure = _measure_of(about)
        return f"{measure.short_name} {measure.scale * value:.4g} {measure.shown_in}"


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
    limits: Mapping[str, float],
    confidence: float,
    weights: ArrayLike | None = None,
    clusters: ArrayLike | None = None,
) -> Fragility:
    """Fit one curve to the outcomes of all blocks, each of which may have a weight."""
    require_limits(store.grid.outcomes, limits)
    product = store.product
    units, which = np.unique(units_of(product.bodies, measure, product.model), return_inverse=True)
    shares = weights_of(weights, len(product.bodies))
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
    x, trials = x.ravel()[found], trials.ravel()[found]
    curves = [
        fitted_curve(name, (x, count.ravel()[found], trials), groups, confidence, measure, limits[name])
        for name, count in counts.items()
    ]
    text = f"{pooled(product.bodies, weights)}, {motions_in_words(together, clusters)}, {counted(scales, 'scale')}"
    return Fragility(
        curves=tuple(curves),
        measure=measure,
        description=f"{text}, {product.model} model"
        + of_polarities(product.polarity, is_symmetric=product.bodies.is_symmetric),
        block=single_block(product.bodies),
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
    limits: Mapping[str, float],
    confidence: float,
    clusters: ArrayLike | None,
    progress: bool | None,
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
    options: dict[str, Any] = {"measure": measure, "confidence": confidence}
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
                    curve = fitted.curves[0]
                    numbers = curve.median, *curve.median_interval, curve.dispersion, *curve.dispersion_interval
                    for quantity, value in zip(_KEPT, numbers, strict=False):
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
            {"confidence": confidence, "model": store.product.model, "measure": measure.name, **measure.options()}
            | ({"missing": missing_text(missing)} if missing else {}),
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
        return _measure_of(self.data.attrs)

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
            **{str(name): values.values for name, values in data.data_vars.items()},
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        """Draw the median of each block over its frequency parameter and slenderness, a panel for each limit state."""
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


def _intensities(product: Product, measure: Measure) -> Floats:
    """Return what every motion measures at every scale, shape (motions, scales)."""
    scales = product.scales
    values = values_of(product.motions, measure)
    if scales.measure == measure.alone:
        return np.tile(scales.values, (len(values), 1))  # as they were given, to the last bit
    factors = np.array([scales.factors(motion) for motion in product.motions])
    return np.asarray(np.abs(factors) * values[:, None])


ReportPart = Fragility | BlockFragilities | StudySpectrum

_REPORT: Final = "report.json"


@dataclass(frozen=True)
class FragilityPlan:
    """Fragility curves to make, as for `rocking.fragility`: of "each" of the blocks, or of all "together"."""

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
    """Fractiles to make, as for `rocking.rocking_spectrum`."""

    fractiles: Sequence[float] = FRACTILES

    def __post_init__(self) -> None:
        checked_fractiles(self.fractiles)


#: Plans by the names of the parts of a report.
PLANS: Final[Mapping[str, type[FragilityPlan | SpectrumPlan]]] = {"fragility": FragilityPlan, "spectrum": SpectrumPlan}


@dataclass(frozen=True)
class ReportPlan:
    """Fragility curves and fractiles to make, or None."""

    fragility: FragilityPlan | None = None
    spectrum: SpectrumPlan | None = None


def check_part(plan: FragilityPlan | SpectrumPlan, kept: Sequence[str]) -> None:
    """Raise an InvalidOption unless these outcomes, which a study keeps, are enough for a part of a report."""
    if isinstance(plan, FragilityPlan):
        require_limits(kept, plan.limits)
    else:
        require(kept, _RATIO, "a spectrum")


def made_report(store: Store, progress: bool | None) -> dict[str, ReportPart]:
    """Make all that is wanted of a complete study, by name."""
    plan = kept_report(store.folder)
    if plan is None or plan == ReportPlan():
        raise StudyError(
            "the study says nothing of a report: add [report.fragility] to its file and create it again",
            path=str(store.folder),
        )
    found: dict[str, ReportPart] = {}
    refused: Unfitted | None = None
    if (curves := plan.fragility) is not None:
        measure = Measure(curves.measure, curves.period, curves.damping)
        try:
            found["fragility"] = (
                pooled_fragility(store, measure, curves.limits, curves.confidence)
                if curves.blocks == "together"
                else block_fragilities(store, measure, curves.limits, curves.confidence, None, progress)
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


def keep_report(folder: Folder, plan: ReportPlan) -> None:
    """Store what is wanted beside the study, in place of what was."""
    folder.keep(_REPORT, json.dumps(asdict(plan), indent=2).encode())


def kept_report(folder: Folder) -> ReportPlan | None:
    """Read what is wanted; None if nothing is, a StudyError if it is damaged."""
    data = folder.get(_REPORT)
    if data is None:
        return None
    try:
        given = {name: words for name, words in json.loads(data).items() if words is not None}
        plans: dict[str, Any] = {name: PLANS[name](**words) for name, words in given.items()}
        return ReportPlan(**plans)
    except (ValueError, TypeError, KeyError, AttributeError, InvalidOption) as error:
        raise StudyError(f"{_REPORT} is damaged ({error}): create the study again from its file") from None
