"""Assessment of objects under records: outcomes, fragility, annual rate, ranking, rules of thumb and friction."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.curve import FragilityCurve, format_interval
from rocking.analysis.fragility import Fragility, fragility
from rocking.analysis.hazard import HazardCurve
from rocking.analysis.incremental import compute_lowest_uplift
from rocking.analysis.levels import compute_block_units, compute_intensities, simulate_levels
from rocking.analysis.risk import Rate, check_measure
from rocking.assessment.page import RULES, write_page
from rocking.block import Block, Blocks
from rocking.block.body import Bodies, Body
from rocking.block.friction import Friction, resolve_friction
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.constants import STANDARD_GRAVITY, VERSION, Model
from rocking.core.progress import Progress
from rocking.core.result import Result, variable
from rocking.core.tables import Column, dataset_to_columns, format_digits, format_table, write_netcdf
from rocking.engine.problem import compute_slenderness, gather_bodies
from rocking.errors import FitError, OptionError, RockingError, escape_braces
from rocking.inputs.inventory import Inventory, list_names
from rocking.inputs.quantities import read_array
from rocking.motion.description import Origin
from rocking.motion.motion import Motion
from rocking.motion.scaling import IntensityName, Measure
from rocking.records.named import Motions, index_motions
from rocking.rules import apply_rules
from rocking.simulation.ensemble import Polarity, body_coordinates, find_labels, motion_coordinates, simulate_many

if TYPE_CHECKING:
    import xarray as xr

#: Number of levels of the search for the range of an object, the share of the motions that overturn it at the last
#: level, and the largest peak acceleration of a typical motion at a level, m/s^2.
_SEARCH_COUNT: Final = 10
_LAST_SHARE: Final = 0.9
_MAX_PGA: Final = 5.0 * STANDARD_GRAVITY

#: Largest ratio of an end of an interval to the levels that is stated as a number.
_MAX_RATIO: Final = 10.0


@dataclass(frozen=True, eq=False)
class ObjectAssessment:
    """Results of one object.

    Attributes
    ----------
    name : str
        Name of the object, or its number.
    body : Body
        Block with its labels.
    samples : int
        Number of sampled blocks of an object with uncertain sizes, otherwise 1.
    friction : float or pair, or None
        Coefficient of friction of the simulations.
    fragility : Fragility or None
        Fragility, or None if no curve fits.
    fault : str
        Reason why there is no curve.
    rate : Rate or None
        Annual rate of overturning with the hazard curve.
    levels : ndarray, shape (k,)
        Levels of the measure, SI units.
    share : ndarray, shape (k, m)
        Share of the outcomes of each level and motion that overturn the object.
    unscaled : Dataset
        Outcomes under the unscaled motions.

    See Also
    --------
    rocking.assess : Assess objects.
    """

    name: str
    body: Body
    samples: int
    friction: Friction | None
    fragility: Fragility | None
    fault: str
    rate: Rate | None
    levels: Floats
    share: Floats
    unscaled: xr.Dataset

    @property
    def curve(self) -> FragilityCurve | None:
        """Curve of overturning."""
        return None if self.fragility is None else self.fragility.curves[0]

    @property
    def first_levels(self) -> tuple[Floats, Floats]:
        """Bounds on the lowest level that overturns the object under each motion: 0 and infinite without one."""
        overturns = self.share > 0.0
        first, exists = overturns.argmax(axis=0), overturns.any(axis=0)
        bounded = np.concatenate([[0.0], self.levels])
        high = np.where(exists, self.levels[first], np.inf)
        return np.where(exists, bounded[first], self.levels[-1]), high

    @property
    def uplift(self) -> float:
        """Lowest uplift acceleration, m/s^2."""
        return min(self.body.uplift_thresholds())

    @property
    def slides_first(self) -> bool:
        """Whether friction is so low that the object slides instead of rocking from rest."""
        coefficients = resolve_friction(self.friction)
        return coefficients is not None and coefficients[0] * self.body.gravity <= self.uplift


@dataclass(frozen=True, eq=False, repr=False)
class Assessment(Result):
    """Assessment of objects under motions, computed by `assess`.

    Attributes
    ----------
    objects : tuple of ObjectAssessment
        Results, the most vulnerable object first.
    motions : dict of str to Motion
        Motions by name.
    measure : Measure
        Intensity measure.
    hazard : HazardCurve or None
        Annual rates at the site.
    failures : dict of str to str
        Reasons why objects and motions are not included, by their names.
    years, confidence : float
        Time of the probabilities, years, and probability of the intervals.
    data : xarray.Dataset
        All numbers over (block, motion, level), with names and labels as coordinates.

    See Also
    --------
    rocking.assess : Assess objects.
    rocking.read_inventory : Read objects from a table.
    """

    TABLES: ClassVar = ("objects", "outcomes", "levels", "records", "failures")

    objects: tuple[ObjectAssessment, ...]
    motions: Mapping[str, Motion]
    measure: Measure
    hazard: HazardCurve | None
    failures: Mapping[str, str]
    years: float
    confidence: float
    model: Model
    data: xr.Dataset = field(repr=False)

    def _columns(self, table: str) -> list[Column]:
        if table == "failures":
            return [Column("name", [*self.failures]), Column("reason", [*self.failures.values()])]
        dimensions = {"objects": {"block"}, "outcomes": {"block", "motion"}, "levels": {"block", "level"}}
        wanted = dimensions.get(table, {"motion"})
        names = [name for name, values in self.data.data_vars.items() if {*values.dims} == wanted]
        return [column for column in dataset_to_columns(self.data[names]) if column.name not in ("level",)]

    def summary(self) -> str:
        header, rows = self.tabulate()
        lines = [self._headline(), "", format_table(header, rows)]
        lines += [f"not assessed: {name}: {reason}" for name, reason in self.failures.items()]
        return "\n".join(lines)

    @property
    def labels(self) -> list[str]:
        """Names of the labels of the objects, without the friction."""
        return [name for name in find_labels(self.data) if name not in ("name", "object_friction")]

    def label(self, name: str, k: int) -> str:
        """Return a label of an object as text."""
        value = self.data[name].values[k].item()
        return value if isinstance(value, str) else "" if math.isnan(value) else f"{value:g}"

    def tabulate(self) -> tuple[list[str], list[list[str]]]:
        """Return the heading and the rows of the summary: ranks, names, outcomes, fragility and rates as text."""
        header = ["rank", "object", "overturns under", f"median {self.measure.short_name}", "interval", "dispersion"]
        if self.hazard is not None:
            header += ["once in (years)", "interval", f"in {self.years:g} years"]
        unit = self.measure.display_unit
        header[3] += f" ({unit})" if unit else ""
        rows = []
        for k, item in enumerate(self.objects):
            first, last = (int(self.data[f"rank_{end}"][k]) for end in ("best", "worst"))
            rank = f"{k + 1}" + (f" ({first}-{last})" if first < last else "")
            overturned, total = int(self.data.overturned[k].sum()), len(self.motions)
            rows.append(
                [rank, item.name, f"{overturned} of {total}", *self.format_curve(item), *self.format_rate(item)]
            )
        return header, rows

    def format_curve(self, item: ObjectAssessment) -> list[str]:
        """Format median, interval and dispersion, to the digits that the interval supports."""
        scale, curve = self.measure.display_factor, item.curve
        if curve is None:
            low, high = item.first_levels
            if np.isinf(high).all():
                return [f"> {scale * item.levels[-1]:.2g}", "-", "-"]
            return [f"{scale * low.min():.2g} to {scale * np.max(high):.2g}", "-", "-"]
        ends = curve.median_interval
        median, interval = format_digits(scale * curve.median, (scale * ends[0], scale * ends[1]))
        bounds = item.levels[0] / _MAX_RATIO, item.levels[-1] * _MAX_RATIO
        if not bounds[0] <= ends[0] <= ends[1] <= bounds[1]:
            interval = format_interval([scale * end for end in ends], 2, (scale * bounds[0], scale * bounds[1]))
        return [median, interval, format_digits(curve.dispersion, curve.dispersion_interval)[0]]

    def format_rate(self, item: ObjectAssessment) -> list[str]:
        """Format return period, interval and probability."""
        if self.hazard is None:
            return []
        if item.rate is None:
            low, _, high = _bound_vulnerability(item, self.hazard)
            texts = [f"{float(f'{end:.2g}'):.9g}" for end in (low, high)]
            return [f"> {texts[0]}" if math.isinf(high) else " to ".join(texts), "-", "-"]
        period, interval = item.rate._format_period()
        ends = [-math.expm1(-rate * self.years) for rate in (*item.rate.interval, *item.rate.bounds)]
        probability = item.rate.probability(self.years)
        return [period, interval, format_digits(probability, (ends[0], ends[1]), (ends[2], ends[3]))[0]]

    def to_dict(self) -> dict[str, Any]:
        tables = {table: self.to_dataframe(table).to_dict("records") for table in self.TABLES if table != "failures"}
        return {
            "measure": {"name": self.measure.name, "units": self.measure.units, **self.measure.options()},
            "hazard": None if self.hazard is None else self.hazard.to_dict(),
            "years": self.years,
            "confidence": self.confidence,
            "model": self.model,
            **tables,
            "failures": dict(self.failures),
        }

    def to_netcdf(self, path: str | Path) -> None:
        """Write `data` to a NetCDF file, like `to_json`."""
        write_netcdf(path, self.data)

    def to_html(self, path: str | Path, *, command: str = "") -> None:
        """Write the report: one HTML page with all figures, which prints on A4 with a page for each object.

        Parameters
        ----------
        path : str or pathlib.Path
            File, written completely or not at all.
        command : str
            Command or call that created the assessment, for the last section.
        """
        write_page(self, path, command)

    def _headline(self) -> str:
        count, motions = len(self.objects), len(self.motions)
        text = f"{count} object{'s' * (count != 1)} under {motions} motion{'s' * (motions != 1)}, {self.model} model"
        failed = f"; {len(self.failures)} not assessed" if self.failures else ""
        return f"{text}; intensity: {self.measure.label}{failed}"


def assess(
    blocks: Bodies | Body | Sequence[Body],
    motions: Motions,
    *,
    hazard: HazardCurve | None = None,
    measure: IntensityName | Measure = "pga",
    levels: int | ArrayLike = 20,
    friction: Friction | None = None,
    polarity: Polarity = "+",
    clusters: ArrayLike | None = None,
    model: Model = "nonlinear",
    confidence: float = 0.9,
    years: float = 50.0,
    samples: int = 50,
    failures: Mapping[str, str] = MappingProxyType({}),
) -> Assessment:
    """Assess which objects overturn, at which intensity, and how often at a site.

    Every object is simulated under the unscaled motions, and under the motions scaled to levels of intensity, to which
    a fragility curve is fitted. An object or motion that cannot be simulated is listed with the reason, and does not
    affect the others.

    Parameters
    ----------
    blocks : Inventory, Blocks, Block, RestrainedBlock or sequence of blocks
        Objects, named by their labels. A label ``friction`` is the coefficient of friction of an object.
    motions : Motion, sequence of Motion, or mapping of str to Motion
        Ground motions.
    hazard : HazardCurve, optional
        Hazard curve of the site, for annual rates.
    measure : str or Measure
        Intensity measure, as for `fragility`, which must be that of the hazard curve.
    levels : int or array_like
        Number of levels for each object, from below its first overturning until 90 % of the motions overturn it, or
        levels for all objects (SI units).
    friction : float or pair, optional
        Coefficient of friction of objects without this label. By default objects do not slide.
    polarity : {"+", "-", "both"}
        Original motions, reversed motions, or both (as in the command). A symmetric block responds equally to both,
        which count once.
    clusters, model, confidence : optional
        As for `fragility`.
    years : float
        Time of the probabilities, years.
    samples : int
        Number of sampled blocks of an object with uncertain sizes in an `Inventory`.
    failures : mapping of str to str
        Objects and motions that could not be read, with the reason, for the report.

    Returns
    -------
    Assessment
        Results with tables, a dataset and an HTML page.

    Raises
    ------
    OptionError
        If an argument is invalid, or no object or no motion can be simulated.

    See Also
    --------
    rocking.read_inventory : Read objects from a table.
    rocking.fragility : Fragility of one block.

    Examples
    --------
    >>> import rocking
    >>> objects = [
    ...     rocking.Block(width=0.24, height=1.1).with_labels(name="vase"),
    ...     rocking.Block(width=0.5, height=1.6).with_labels(name="stele"),
    ... ]
    >>> motions = [rocking.pulses.one_sine(1.0, f) for f in (0.5, 0.7, 1.0, 1.2, 1.5, 2.0)]
    >>> assessment = assess(objects, motions, levels=12)
    >>> [item.name for item in assessment.objects]
    ['vase', 'stele']
    """
    checks.fraction(confidence, "confidence", OptionError)
    checks.positive(years, "years", OptionError)
    checks.integer(samples, "samples", OptionError, 2)
    intensity = Measure.parse(measure)
    if hazard is not None:
        check_measure(hazard, intensity)
    if isinstance(levels, int):
        checks.integer(levels, "levels", OptionError, 2)
    failed = dict(failures)
    usable = _select_motions(index_motions(motions), intensity, failed)
    several: Any = blocks if isinstance(blocks, Sequence | Bodies) else [blocks]
    bodies: list[Body] = [*several]
    options: dict[str, Any] = {"model": model, "polarity": polarity}
    study = _Study([*usable.values()], intensity, hazard, levels, clusters, confidence, options)
    objects = list[ObjectAssessment]()
    with Progress("assessing", total=len(bodies)) as bar:
        for k, (name, body) in enumerate(zip(list_names(bodies), bodies, strict=True)):
            try:
                sample = blocks.sample(k, samples) if isinstance(blocks, Inventory) else None
                objects.append(study.assess(name, body, sample, friction))
            except RockingError as error:
                failed[name] = str(error)
            bar.advance()
    if not objects:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in failed.items())
        raise OptionError(escape_braces(f"no object can be assessed: {reasons}"))
    order = sorted(range(len(objects)), key=lambda k: _bound_vulnerability(objects[k], hazard)[1])
    ranked = [objects[k] for k in order]
    data = _create_dataset(ranked, usable, study)
    return Assessment(tuple(ranked), usable, intensity, hazard, failed, years, confidence, model, data)


def _select_motions(motions: Mapping[str, Motion], measure: Measure, failed: dict[str, str]) -> dict[str, Motion]:
    """Return the motions that can be scaled; add the reasons of the others."""
    usable = {}
    for name, motion in motions.items():
        try:
            measure.require_positive_value(motion, name)
            usable[name] = motion
        except RockingError as error:
            failed[name] = str(error)
    if not usable:
        raise OptionError(escape_braces(f"no motion can be scaled; the first: {next(iter(failed.values()))}"))
    return usable


@dataclass(frozen=True)
class _Study:
    """Motions and settings of the simulations of each object."""

    motions: Sequence[Motion]
    measure: Measure
    hazard: HazardCurve | None
    levels: int | ArrayLike
    clusters: ArrayLike | None
    confidence: float
    options: Mapping[str, Any]

    def assess(self, name: str, body: Body, sample: Blocks | None, friction: Friction | None) -> ObjectAssessment:
        """Assess one object, with its own friction if it has a label."""
        coefficient = _read_friction(body, friction)
        options: dict[str, Any] = {**self.options, "friction": coefficient}
        blocks = gather_bodies(body) if sample is None else sample
        levels = self._choose_levels(blocks, options)
        unscaled = simulate_many(body, self.motions, robust=True, **options)
        fitted, fault = None, ""
        settings: dict[str, Any] = {"clusters": self.clusters, "confidence": self.confidence, "levels": levels}
        try:
            fitted = fragility(blocks, self.motions, measure=self.measure, **settings, **options)
            outcomes = fitted.outcomes
        except FitError as error:
            fault, outcomes = error.text().partition(": ")[2] or error.text(), error.outcomes
        assert outcomes is not None
        share = outcomes.exceeded_overturning.to_numpy(float)
        share[outcomes.unfinished.to_numpy(bool)] = np.nan
        mean = np.nanmean(share.reshape(len(levels), len(self.motions), -1), axis=2)
        rate = None if fitted is None or self.hazard is None else fitted.annual_rate(self.hazard).rates[0]
        count = 1 if sample is None else len(sample)
        return ObjectAssessment(name, body, count, coefficient, fitted, fault, rate, levels, mean, unscaled)

    def _choose_levels(self, blocks: Bodies, options: Mapping[str, Any]) -> Floats:
        """Return levels from below the first overturning of a coarse search to its last, in equal ratios."""
        if not isinstance(self.levels, int):
            return checks.increasing_numbers(self.levels, "levels", OptionError)
        measure, model = self.measure, options["model"]
        values = compute_intensities(self.motions, measure)
        lowest = compute_lowest_uplift(blocks, self.motions, values, measure, model)
        strongest = np.median(
            [_MAX_PGA * value / motion.pga for value, motion in zip(values, self.motions, strict=True)]
        )
        unit = float(compute_block_units(blocks, measure, model).min())
        search = np.geomspace(lowest, min(max(2.0 * lowest, strongest / unit), 64.0 * lowest), _SEARCH_COUNT)
        table = simulate_levels(blocks, self.motions, measure, search, **{**options, "polarity": "+"})
        shares = table.overturned.mean([name for name in table.overturned.dims if name != "level"]).values
        first, last = int(np.argmax(shares > 0.0)), int(np.argmax(shares >= _LAST_SHARE))
        low = search[max(first - 1, 0)] if shares.any() else search[0]
        levels = np.geomspace(low, search[last] if shares[last] >= _LAST_SHARE else search[-1], self.levels)
        scale = measure.display_factor
        return np.array([float(f"{scale * level:.3g}") / scale for level in levels])  # as they are displayed


def _read_friction(body: Body, friction: Friction | None) -> Friction | None:
    """Return the coefficient in the label of a body, or else the given one."""
    text = str(getattr(body, "labels", {}).get("friction", ""))
    if text in ("", "nan"):
        return friction
    values: list[float] = read_array(text.replace(";", ","), "friction").tolist()
    return values[0] if len(values) == 1 else values


def _bound_vulnerability(item: ObjectAssessment, hazard: HazardCurve | None) -> tuple[float, float, float]:
    """Return the return period of overturning, or without hazard curve the median, between its bounds."""
    if item.rate is not None:
        return item.rate.return_interval[0], item.rate.return_period, item.rate.return_interval[1]
    if item.curve is not None:
        return item.curve.median_interval[0], item.curve.median, item.curve.median_interval[1]
    ends = [float(bounds(levels)) for bounds, levels in zip((np.min, np.max), item.first_levels, strict=True)]
    if hazard is not None:
        # The hazard curve does not resolve rates beyond its points.
        known = np.clip(ends, *hazard.intensity[[0, -1]])
        periods = 1.0 / hazard.rate_of(known)
        low, high = ends[0] >= hazard.intensity[0], ends[1] <= hazard.intensity[-1]
        ends = [float(periods[0]) if low else 0.0, float(periods[1]) if high else math.inf]
    return ends[0], ends[0], ends[1]


def _compute_ranks(objects: Sequence[ObjectAssessment], hazard: HazardCurve | None) -> tuple[Integers, Integers]:
    """Return the best and the worst rank of each object that the intervals allow."""
    low, _, high = np.array([_bound_vulnerability(item, hazard) for item in objects]).T
    best = 1 + (high[None, :] < low[:, None]).sum(axis=1)
    return best, len(objects) - (low[None, :] > high[:, None]).sum(axis=1)


def _create_dataset(objects: Sequence[ObjectAssessment], motions: Mapping[str, Motion], study: _Study) -> xr.Dataset:
    """Combine the results of all objects, over (block, motion, level)."""
    import xarray as xr

    measure, hazard = study.measure, study.hazard
    curves = [item.curve for item in objects]
    nothing = (math.nan, math.nan)

    def collect(values: Callable[[FragilityCurve], float | tuple[float, float]], missing: Any = math.nan) -> Floats:
        return np.array([missing if curve is None else values(curve) for curve in curves], dtype=float)

    best, worst = _compute_ranks(objects, hazard)
    median, dispersion = (
        collect(lambda c: c.median_interval, nothing),
        collect(lambda c: c.dispersion_interval, nothing),
    )
    ones, pairs = ("block",), ("block", "motion")
    low, high = (np.stack(values) for values in zip(*(item.first_levels for item in objects), strict=True))
    unscaled = [item.unscaled.isel(block=0) for item in objects]

    def gather(name: str, missing: float = math.nan) -> Floats:
        """Return an outcome over (block, motion), the largest of both polarities."""
        rows = [item[name] if name in item else xr.full_like(item.peak_rotation, missing) for item in unscaled]
        return np.stack([(row.max("polarity") if "polarity" in row.dims else row).values for row in rows])

    unfinished = (gather("unfinished") + gather("lost_contact", 0.0)) > 0.0
    share = [item.overturned_share for item in unscaled]
    undecided = [((s > 0.0) & (s < 1.0)).any([d for d in s.dims if d != "motion"]).values for s in share]
    slenderness = np.concatenate([compute_slenderness(gather_bodies(item.body)) for item in objects])
    unit = measure.units
    frictions = [math.nan if item.friction is None else float(np.max(item.friction)) for item in objects]
    variables = {
        "rank_best": variable(ones, best, "best rank that the intervals allow", "1"),
        "rank_worst": variable(ones, worst, "worst rank that the intervals allow", "1"),
        "description": variable(ones, [item.body.description for item in objects]),
        "samples": variable(ones, [item.samples for item in objects], "sampled blocks of uncertain size", "1"),
        "uplift": variable(ones, [item.uplift for item in objects], "lowest uplift acceleration", "m/s^2"),
        "friction": variable(ones, frictions, "static friction of the simulations; NaN: no slip", "1"),
        "slides_first": variable(ones, [item.slides_first for item in objects], "whether it slides instead of rocking"),
        "median": variable(ones, collect(lambda c: c.median), "intensity with a probability of one half", unit),
        "median_lower": variable(ones, median[:, 0], "lower end of its interval", unit),
        "median_upper": variable(ones, median[:, 1], "upper end of its interval", unit),
        "dispersion": variable(ones, collect(lambda c: c.dispersion), "logarithmic standard deviation", "1"),
        "dispersion_lower": variable(ones, dispersion[:, 0], "lower end of its interval", "1"),
        "dispersion_upper": variable(ones, dispersion[:, 1], "upper end of its interval", "1"),
        "fault": variable(ones, [item.fault for item in objects], "why there is no curve"),
        "overturned": variable(pairs, gather("overturned"), "whether the unscaled motion overturns the object"),
        "undecided": variable(pairs, np.stack(undecided), "whether that changes within 3e-6 of the motion"),
        "unfinished": variable(pairs, unfinished, "whether the simulation was abandoned, or lost contact"),
        "peak_over_alpha": variable(
            pairs,
            np.where(gather("overturned"), np.inf, gather("peak_rotation") / slenderness[:, None]),
            "peak rotation over slenderness, infinite for overturning",
            "1",
        ),
        "stands_up_to": variable(pairs, low, "highest level below the first that overturns", unit),
        "overturns_at": variable(pairs, high, "lowest level that overturns, infinite if none", unit),
        "intensity": variable(("block", "level"), np.stack([item.levels for item in objects]), measure.quantity, unit),
        "overturned_share": variable(
            ("block", "level"), np.stack([item.share.mean(axis=1) for item in objects]), "share that overturns", "1"
        ),
    }
    if any("largest_slip" in item for item in unscaled):
        variables["largest_slip"] = variable(pairs, gather("largest_slip"), "largest displacement of the base", "m")
    for rule, ratios in _apply_rules([item.body for item in objects], study.motions).items():
        variables[rule] = variable(pairs, ratios, f"demand divided by capacity by the rule {rule}", "1")
    if hazard is not None:
        rates = [
            (math.nan,) * 3 if item.rate is None else (item.rate.annual_rate, *item.rate.interval) for item in objects
        ]
        for name, values in zip(
            ("annual_rate", "annual_rate_lower", "annual_rate_upper"), np.array(rates).T, strict=True
        ):
            variables[name] = variable(ones, values, "mean annual rate of overturning", "1/year")
    for name, (values, meaning, units) in _measure_motions([*motions.values()]).items():
        variables[name] = variable("motion", values, meaning, units)
    variables[measure.name] = variable("motion", compute_intensities(study.motions, measure), measure.quantity, unit)
    coordinates = {
        **motion_coordinates([*motions.values()]),
        **body_coordinates(gather_bodies([item.body for item in objects])),
        "name": ("block", [item.name for item in objects], {}),
    }
    coordinates = {f"object_{name}" if name in variables else name: values for name, values in coordinates.items()}
    coordinates |= {"motion": [*motions]}
    attributes = {"program": f"rocking {VERSION}", **study.options, "measure": measure.name, **measure.options()}
    return xr.Dataset(variables, coordinates, attributes)


def _apply_rules(bodies: Sequence[Body], motions: Sequence[Motion]) -> dict[str, Floats]:
    """Return demand divided by capacity (bodies, motions) by rules of thumb, NaN for restrained blocks."""
    is_free = [isinstance(body, Block) for body in bodies]
    ratios = {rule: np.full((len(bodies), len(motions)), np.nan) for rule in RULES}
    free_blocks = [body for body in bodies if isinstance(body, Block)]
    for k, motion in enumerate(motions if free_blocks else ()):
        for rule, rating in apply_rules(free_blocks, motion, RULES).items():
            ratios[rule][is_free, k] = rating.ratio
    return ratios


def _measure_motions(motions: Sequence[Motion]) -> dict[str, tuple[list[Any], str, str]]:
    """Return properties of the motions with meaning and unit."""
    return {
        "step": ([motion.dt or math.nan for motion in motions], "sampling step", "s"),
        "duration": ([motion.duration for motion in motions], "duration", "s"),
        "pga": ([motion.pga for motion in motions], "peak ground acceleration", "m/s^2"),
        "pgv": ([motion.pgv for motion in motions], "peak ground velocity", "m/s"),
        "arias": ([motion.arias_intensity for motion in motions], "Arias intensity", "m/s"),
        "significant_duration": ([motion.significant_duration() for motion in motions], "duration D5-95", "s"),
        "format": ([(motion.description.origin or Origin()).format for motion in motions], "format of the file", ""),
        "processing": (["; ".join(motion.history) for motion in motions], "corrections and scaling", ""),
    }
