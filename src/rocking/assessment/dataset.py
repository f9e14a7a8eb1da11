"""All numbers of an assessment as one labelled dataset over blocks, motions and levels."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.analysis.levels import compute_intensities
from rocking.assessment.page import RULES
from rocking.assessment.results import ObjectAssessment
from rocking.block import Block
from rocking.block.body import Body
from rocking.core.arrays import Floats
from rocking.core.constants import VERSION
from rocking.core.result import create_variable
from rocking.engine.problem import gather_bodies
from rocking.motion.description import Origin
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.rules import apply_rules
from rocking.simulation.ensemble import body_coordinates, motion_coordinates

if TYPE_CHECKING:
    import xarray as xr

#: Unit of a quantity in the unit of the measure.
_INTENSITY: Final = "intensity"

#: Name, meaning, unit and value of the quantities of an object, of an object under each motion, at each level, and of
#: a motion.
_OBJECT_ROWS: Final[Sequence[tuple[str, str, str, Callable[[ObjectAssessment], Any]]]] = (
    ("description", "", "", lambda item: item.body.description),
    ("samples", "sampled blocks of uncertain size", "1", lambda item: item.sample_count),
    ("uplift", "lowest uplift acceleration", "m/s^2", lambda item: item.uplift_acceleration),
    ("friction", "static friction of the simulations; NaN: no slip", "1", lambda item: item.static_friction),
    ("slides_first", "whether it slides instead of rocking", "", lambda item: item.slides_first),
    ("fault", "why there is no curve", "", lambda item: item.fault),
)
_OUTCOME_ROWS: Final[Sequence[tuple[str, str, str, Callable[[ObjectAssessment], Any]]]] = (
    ("overturned", "whether the unscaled motion overturns the object", "", lambda item: item.unscaled.overturned),
    ("undecided", "whether that changes within 3e-6 of the motion", "", lambda item: item.unscaled.undecided),
    ("unfinished", "whether the simulation was abandoned, or lost contact", "", lambda item: item.unscaled.unfinished),
    ("peak_over_alpha", "peak rotation over slenderness, infinite for overturning", "1", lambda item: item.peaks),
    ("stands_up_to", "highest level below the first that overturns", _INTENSITY, lambda item: item.first_levels[0]),
    ("overturns_at", "lowest level that overturns, infinite if none", _INTENSITY, lambda item: item.first_levels[1]),
    ("largest_slip", "largest displacement of the base", "m", lambda item: item.largest_slip),
)
_LEVEL_ROWS: Final[Sequence[tuple[str, str, str, Callable[[ObjectAssessment], Any]]]] = (
    ("intensity", "level of the measure", _INTENSITY, lambda item: item.levels),
    ("overturned_share", "share that overturns", "1", lambda item: item.share.mean(axis=1)),
)
_MOTION_ROWS: Final[Sequence[tuple[str, str, str, Callable[[Motion], Any]]]] = (
    ("step", "sampling step", "s", lambda motion: motion.dt or math.nan),
    ("duration", "duration", "s", lambda motion: motion.duration),
    ("pga", "peak ground acceleration", "m/s^2", lambda motion: motion.pga),
    ("pgv", "peak ground velocity", "m/s", lambda motion: motion.pgv),
    ("arias", "Arias intensity", "m/s", lambda motion: motion.arias_intensity),
    ("significant_duration", "significant duration D5-95", "s", lambda motion: motion.significant_duration()),
    ("format", "format of the file", "", lambda motion: (motion.description.origin or Origin()).format),
    ("processing", "corrections and scaling", "", lambda motion: "; ".join(motion.history)),
)

#: Name of estimates with an interval: attributes of an object, of the estimate and of its interval; meaning and unit.
_ESTIMATE_ROWS: Final = (
    ("median", "curve", "median", "median_interval", "intensity with a probability of one half", _INTENSITY),
    ("dispersion", "curve", "dispersion", "dispersion_interval", "logarithmic standard deviation", "1"),
    ("annual_rate", "rate", "annual_rate", "interval", "mean annual rate of overturning", "1/year"),
)

#: Quantities that are omitted if all are unknown.
_OPTIONAL_NAMES: Final = ("largest_slip", "annual_rate", "annual_rate_lower", "annual_rate_upper")


def create_dataset(
    objects: Sequence[ObjectAssessment],
    motions: Mapping[str, Motion],
    measure: Measure,
    ranks: Mapping[str, Any],
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """Combine the results of all objects, over (block, motion, level)."""
    import xarray as xr

    variables = dict[str, Any]()

    def add(dims: str, name: str, values: Any, meaning: str, unit: str) -> None:
        unit = measure.units if unit == _INTENSITY else unit
        variables[name] = create_variable((*dims.split(),), values, meaning, unit)

    for name, values in ranks.items():
        add("block", name, values, name.replace("_", " "), "1")
    for dims, quantities in (("block", _OBJECT_ROWS), ("block motion", _OUTCOME_ROWS), ("block level", _LEVEL_ROWS)):
        for name, meaning, unit, evaluate in quantities:
            add(dims, name, np.stack([np.asarray(evaluate(item)) for item in objects]), meaning, unit)
    for name, owner, middle, ends, meaning, unit in _ESTIMATE_ROWS:
        estimates = [getattr(item, owner) for item in objects]
        rows = [[math.nan] * 3 if item is None else [getattr(item, middle), *getattr(item, ends)] for item in estimates]
        for end, column in zip(("", "_lower", "_upper"), np.array(rows, dtype=float).T, strict=True):
            add("block", name + end, column, meaning + end.replace("_", ", "), unit)
    for rule, ratios in _apply_rules([item.body for item in objects], [*motions.values()]).items():
        add("block motion", rule, ratios, f"demand divided by capacity by the rule {rule}", "1")
    for name, meaning, unit, evaluate_motion in _MOTION_ROWS:
        add("motion", name, [evaluate_motion(motion) for motion in motions.values()], meaning, unit)
    add("motion", "intensity", compute_intensities([*motions.values()], measure), measure.quantity, _INTENSITY)
    unknown = [name for name in _OPTIONAL_NAMES if np.isnan(variables[name][1]).all()]
    coordinates = {
        **motion_coordinates([*motions.values()]),
        **body_coordinates(gather_bodies([item.body for item in objects])),
        "name": ("block", [item.name for item in objects], {}),
    }
    coordinates = {f"object_{name}" if name in variables else name: values for name, values in coordinates.items()}
    attributes = {"program": f"rocking {VERSION}", **attributes, "measure": measure.name, **measure.options()}
    return xr.Dataset(variables, coordinates | {"motion": [*motions]}, attributes).drop_vars(unknown)


def _apply_rules(bodies: Sequence[Body], motions: Sequence[Motion]) -> dict[str, Floats]:
    """Return demand divided by capacity (bodies, motions) by rules of thumb, NaN for restrained blocks."""
    is_free = [isinstance(body, Block) for body in bodies]
    ratios = {rule: np.full((len(bodies), len(motions)), np.nan) for rule in RULES}
    free_blocks = [body for body in bodies if isinstance(body, Block)]
    for k, motion in enumerate(motions if free_blocks else ()):
        for rule, rating in apply_rules(free_blocks, motion, RULES).items():
            ratios[rule][is_free, k] = rating.ratio
    return ratios
