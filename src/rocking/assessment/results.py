"""Results of an assessment: of each object, and of all as text, tables and files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from rocking.analysis.curve import FragilityCurve, format_interval
from rocking.analysis.fragility import Fragility
from rocking.analysis.hazard import HazardCurve
from rocking.analysis.risk import Rate
from rocking.assessment.page import write_page
from rocking.block.body import Body
from rocking.block.friction import Friction, resolve_friction
from rocking.core.arrays import Floats
from rocking.core.constants import Model
from rocking.core.result import Result
from rocking.core.tables import (
    Column,
    dataset_to_columns,
    format_count,
    format_digits,
    format_reasons,
    format_table,
    write_netcdf,
)
from rocking.engine.problem import compute_slenderness, gather_bodies
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.simulation.ensemble import find_labels

if TYPE_CHECKING:
    import xarray as xr

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
    sample_count : int
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
        Outcomes under the unscaled motions, the larger ones if both polarities were simulated, and whether they are
        undecided.

    See Also
    --------
    rocking.assess : Assess objects.
    """

    name: str
    body: Body
    sample_count: int
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
        first, is_reached = overturns.argmax(axis=0), overturns.any(axis=0)
        bounded = np.concatenate([[0.0], self.levels])
        high = np.where(is_reached, self.levels[first], np.inf)
        return np.where(is_reached, bounded[first], self.levels[-1]), high

    @property
    def uplift_acceleration(self) -> float:
        """Lowest uplift acceleration, m/s^2."""
        return min(self.body.uplift_thresholds())

    @property
    def peaks(self) -> Floats:
        """Ratio of peak rotation to slenderness under each unscaled motion, infinite for overturning."""
        slenderness = compute_slenderness(gather_bodies(self.body))[0]
        return np.where(self.unscaled.overturned, np.inf, self.unscaled.peak_rotation / slenderness)

    @property
    def largest_slip(self) -> Floats:
        """Largest displacement of the base under each unscaled motion, m, or NaN without sliding."""
        return np.asarray(self.unscaled.get("largest_slip", np.full(self.unscaled.overturned.shape, np.nan)))

    @property
    def static_friction(self) -> float:
        """Coefficient of static friction of the simulations, or NaN without sliding."""
        coefficients = resolve_friction(self.friction)
        return math.nan if coefficients is None else coefficients[0]

    @property
    def slides_first(self) -> bool:
        """Whether friction is so low that the object slides instead of rocking from rest."""
        return self.static_friction * self.body.gravity <= self.uplift_acceleration

    def order_vulnerability(self, hazard: HazardCurve | None) -> tuple[bool, float, int]:
        """Return a key for sorting, the most vulnerable first; objects that no level overturns are last."""
        never_overturns = self.curve is None and not (self.share > 0.0).any()
        return never_overturns, self.bound_vulnerability(hazard)[1], -int(np.sum(self.unscaled.overturned))

    def bound_vulnerability(self, hazard: HazardCurve | None) -> tuple[float, float, float]:
        """Return the return period of overturning, or without hazard curve the median, between its bounds."""
        if self.rate is not None:
            return self.rate.return_interval[0], self.rate.return_period, self.rate.return_interval[1]
        if self.curve is not None:
            return self.curve.median_interval[0], self.curve.median, self.curve.median_interval[1]
        ends = [float(bound(levels)) for bound, levels in zip((np.min, np.max), self.first_levels, strict=True)]
        if hazard is not None:
            # The hazard curve does not resolve rates beyond its points.
            known_ends = np.clip(ends, *hazard.intensity[[0, -1]])
            periods = 1.0 / hazard.rate_of(known_ends)
            low, high = ends[0] >= hazard.intensity[0], ends[1] <= hazard.intensity[-1]
            ends = [float(periods[0]) if low else 0.0, float(periods[1]) if high else math.inf]
        return ends[0], ends[0], ends[1]


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
    failures, skipped : dict of str to str
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
    skipped: Mapping[str, str]
    years: float
    confidence: float
    model: Model
    data: xr.Dataset = field(repr=False)

    def _columns(self, table: str) -> list[Column]:
        if table == "failures":
            items = [("object", *item) for item in self.failures.items()]
            items += [("record", *item) for item in self.skipped.items()]
            return [Column(name, [item[k] for item in items]) for k, name in enumerate(("kind", "name", "reason"))]
        dimensions = {"objects": {"block"}, "outcomes": {"block", "motion"}, "levels": {"block", "level"}}
        table_dimensions = dimensions.get(table, {"motion"})
        names = [name for name, values in self.data.data_vars.items() if {*values.dims} == table_dimensions]
        return [column for column in dataset_to_columns(self.data[names]) if column.name not in ("level",)]

    def summary(self) -> str:
        header, rows = self.tabulate()
        lines = [self._format_headline(), "", format_table(header, rows)]
        lines += [f"not assessed: {name}: {reason}" for name, reason in self.failures.items()]
        lines += [f"not used: {text}" for text in format_reasons(self.skipped)]
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
            share = f"{int(self.data.overturned[k].sum())} of {len(self.motions)}"
            rows.append([rank, item.name, share, *self.format_curve(item), *self.format_rate(item)])
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
            low, _, high = item.bound_vulnerability(self.hazard)
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
            "skipped": dict(self.skipped),
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

    def _format_headline(self) -> str:
        objects, motions = format_count(len(self.objects), "object"), format_count(len(self.motions), "motion")
        text = f"{objects} under {motions}, {self.model} model"
        failure_text = f"; {len(self.failures)} not assessed" if self.failures else ""
        return f"{text}; intensity: {self.measure.label}{failure_text}"
