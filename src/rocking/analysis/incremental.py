"""Incremental dynamic analysis: bands of levels at which scaled motions overturn blocks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.levels import (
    MIRROR_NOTE,
    RATIO_VARIABLES,
    Brackets,
    compute_block_units,
    compute_intensities,
    compute_ratios,
    create_motion_labels,
    describe_blocks,
    describe_undecided,
    find_boundaries,
    list_missing_notes,
    simulate_levels,
)
from rocking.block.body import Bodies, Body
from rocking.block.friction import Friction, check_friction, resolve_friction
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.constants import Model
from rocking.core.result import DatasetResult
from rocking.core.tables import add_unit, escape_dollars, format_count, format_table, to_plain
from rocking.engine.problem import compute_slenderness, compute_uplift_thresholds, conserves_speed, gather_bodies
from rocking.engine.schemes import Certified
from rocking.engine.tasks import Setup, simulate_each
from rocking.errors import OptionError
from rocking.motion.motion import Motion, compute_uplift_factors
from rocking.motion.scaling import IntensityName, Measure
from rocking.records.named import Motions, list_motions
from rocking.simulation.ensemble import find_labels, list_block_names

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Number of levels per simulation.
_LEVELS_PER_CHUNK: Final = 16


def incremental_dynamic_analysis(
    blocks: Bodies | Body | Sequence[Body],
    motions: Motions,
    *,
    measure: IntensityName | Measure = "pga",
    levels: ArrayLike | None = None,
    model: Model = "nonlinear",
    rtol: float = 1e-6,
    friction: Friction | None = None,
) -> IncrementalDynamicAnalysis:
    """Scale motions beyond overturning of every block, and find the bands of levels that overturn.

    A rocking block may survive a motion stronger than one that overturns it. Therefore bands of levels that overturn
    alternate with others.

    Parameters
    ----------
    blocks, motions : optional
        As for `simulate_many`: n blocks, m motions.
    measure : str or Measure
        Intensity measure to which motions are scaled, by a name of `Measure` ("pga", "pgv", "pga_ratio", ...), or for
        example ``rocking.Measure("sa", period=1.0)``.
    levels : array_like, optional
        Increasing levels of the measure. By default from the lowest that lifts a block, in steps of 5 %, to three times
        the level by which every motion has overturned every block, at most 490 times the first.
    model : {"nonlinear", "linear"}
        Equation of motion.
    rtol : float
        Width of refined ends of bands, relative to the level.
    friction : optional
        As for `simulate`.

    Returns
    -------
    IncrementalDynamicAnalysis
        Peaks at every level, and the bands of levels that overturn, at the resolution of the levels.

    Raises
    ------
    OptionError
        If an argument is out of range.
    MotionError
        If a motion is zero throughout.

    See Also
    --------
    rocking.critical_scale : Find one critical scale with its derivatives.
    rocking.fragility : Fit fragility curves to scaled motions.
    rocking.overturning_map : Map the outcomes of a pulse over amplitude and frequency.

    Notes
    -----
    Ends of bands are located by bisection between neighbouring levels with different outcomes. Under records, a finer
    search may reveal thinner bands. The lowest level therefore depends on the resolution and is not a safety margin.

    References
    ----------
    Vamvatsikos, D. and Cornell, C. A. (2002). Incremental dynamic analysis. Earthquake Engineering and Structural
    Dynamics 31(3), 491-514.

    Examples
    --------
    A one-sine pulse overturns this block in two bands:

    >>> import numpy as np, rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> pulse = rocking.pulses.one_sine(1.0, 5.0 / np.pi)
    >>> incremental_dynamic_analysis(block, pulse, measure="pga_ratio").data.band_start.values.round(4).tolist()
    [2.9855, 7.2759]
    """
    bodies, measure, motion_list = gather_bodies(blocks), Measure.parse(measure), list_motions(motions)
    slenderness = compute_slenderness(bodies)
    values = compute_intensities(motion_list, measure)
    if conserves_speed(bodies):
        reason = "because otherwise the block never comes to rest"
        raise OptionError(f"{{}} must be below 1 for an incremental dynamic analysis, {reason}", "restitution")
    relative_width = checks.between(rtol, "rtol", OptionError, 1e-15, 0.5)
    options: dict[str, Any] = {"model": model, "friction": friction}
    coefficients = resolve_friction(friction)
    check_friction(bodies, model, coefficients)
    lowest_uplift = compute_lowest_uplift(bodies, motion_list, values, measure, model)
    if levels is None:
        table = _simulate_until_overturned(bodies, motion_list, measure, lowest_uplift, options)
    else:
        level_values = checks.increasing_numbers(levels, "levels", OptionError)
        table = simulate_levels(bodies, motion_list, measure, level_values, **options)
    units = compute_block_units(bodies, measure, model)
    # The scheme of the levels determines how often the restitution is drawn.
    setup = Setup(bodies, model, Certified(), friction=coefficients)

    def simulate_overturned(column: Integers, level: Floats) -> Integers:
        is_overturned = np.empty(column.size, dtype=np.int64)
        motion, block = np.divmod(column, len(bodies))
        factors = measure.find_factor(level * units[block], values[motion])
        for k, outcomes in simulate_each(setup, motion_list, block, motion, factors):
            is_overturned[k] = outcomes["overturned"]
        return is_overturned

    grid = table.overturned.transpose("level", "motion", "block").values
    flat_grid = grid.reshape(len(grid), -1).astype(np.int64)
    brackets = find_boundaries(table.level.values, flat_grid, simulate_overturned, rtol=relative_width)
    dataset = _combine_bands(table, flat_grid, brackets, slenderness, measure)
    scales = measure.find_factor(table.level.values[:, None, None] * units, values[:, None])
    undecided_note = describe_undecided(setup, motion_list, scales[..., None], grid[..., None])
    sides_differ, block_text = int(not bodies.is_symmetric), describe_blocks(blocks)
    attributes = {"blocks": block_text, "lowest_uplift": lowest_uplift, "sides_differ": sides_differ}
    return IncrementalDynamicAnalysis(dataset.assign_attrs(attributes, undecided_note=undecided_note))


@dataclass(frozen=True, eq=False, repr=False)
class IncrementalDynamicAnalysis(DatasetResult):
    """Blocks under scaled motions, computed by `incremental_dynamic_analysis`.

    Attributes
    ----------
    data : xarray.Dataset
        Over (motion, level, block): peak_rotation (rad, pi/2 for overturning), peak_over_alpha (normalised by the
        smaller slenderness, infinite for overturning, NaN for abandoned simulations, which bands count as not
        overturning) and overturned. Over (motion, block): overturning_level, the lowest that overturns, or NaN if none
        or already the first does. Over (band): band_motion and band_block (positions), band_start and band_end, NaN
        beyond the levels. Attributes: lowest_uplift, the lowest level that lifts a block, and undecided_note, the
        number of outcomes in a sample that change within 3e-6 of the motion.

    See Also
    --------
    rocking.incremental_dynamic_analysis : Run the analysis.

    Examples
    --------
    >>> import numpy as np, rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> pulse = rocking.pulses.one_sine(1.0, 5.0 / np.pi)
    >>> analysis = rocking.incremental_dynamic_analysis(block, pulse, measure="pga_ratio", levels=[1.0, 2.0, 4.0])
    >>> analysis.data.overturned.values[0, :, 0].tolist()
    [False, False, True]
    """

    TABLES: ClassVar = {
        "levels": ("peak_rotation", "peak_over_alpha", "overturned"),
        "bands": ("band_motion", "band_block", "band_start", "band_end"),
    }
    AGGREGATED_DIMENSIONS = ("motion", "level", "block", "band")

    def _table(self, name: str) -> xr.Dataset:
        part = super()._table(name)
        if name == "levels":
            return part
        index, coords = self.data.band_motion.values, self.data.coords  # the names of the other table permit a join
        labels = {name: coords[name].values[index] for name in ("motion", "vertical", "record") if name in coords}
        labels["block"] = self.data.band_block.values
        labels |= {name: coords[name].values[labels["block"]] for name in find_labels(self.data)}
        columns = {name: ("band", values) for name, values in labels.items()}
        return part[[]].assign(columns | {"band_start": part.band_start, "band_end": part.band_end})

    def bands(self, *, block: int = 0, motion: int = 0) -> list[tuple[float, float]]:
        """Return start and end of the bands of levels that overturn a block under a motion, both by position.

        Ends are in SI units or the block's own, NaN beyond the levels.
        """
        m, b = self._check_position(motion, "motion"), self._check_position(block, "block")
        selected = (self.data.band_motion.values == m) & (self.data.band_block.values == b)
        starts, ends = self.data.band_start.values[selected], self.data.band_end.values[selected]
        return list(zip(starts.tolist(), ends.tolist(), strict=True))

    def _check_position(self, position: object, dimension: str) -> int:
        return checks.integer(position, dimension, OptionError, 0, self.data.sizes[dimension] - 1)

    def summary(self) -> str:
        data, levels = self.data, _LevelDescription(self.data.level)
        block_count = data.sizes["block"]
        has_several_blocks, names = block_count > 1, list_block_names(data)
        coordinate = "record" if "record" in data.coords else "motion"
        rows = [
            [label, *([names[b]] * has_several_blocks), levels.describe_bands(self.bands(block=b, motion=m))]
            for m, label in enumerate(create_motion_labels(data, coordinate, includes_history=False))
            for b in range(block_count)
        ]
        blocks = format_count(block_count, "block") if has_several_blocks else data.blocks
        table = format_table([coordinate, *(["block"] * has_several_blocks), "overturns"], rows)
        headline = f"{blocks}, {data.model} model; {data.level.label} that overturns"
        notes = [*[f"note: {MIRROR_NOTE}"] * data.sides_differ, f"note: {data.undecided_note}"]
        notes += list_missing_notes(np.isnan(data.peak_over_alpha.values))
        return "\n".join([headline, levels.summary(data.lowest_uplift), "", table, *notes])

    def to_dict(self) -> dict[str, Any]:
        data, units = self.data, self.data.level.units
        peaks = data.peak_over_alpha.transpose("motion", "block", "level").values
        lowest = data.overturning_level.transpose("motion", "block").values
        ends = add_unit("from", units), add_unit("to", units)
        return {
            "blocks": data.blocks,
            "model": data.model,
            "measure": data.level.long_name,
            **{name: data.level.attrs[name] for name in ("period", "damping", "component") if name in data.level.attrs},
            add_unit("level", units): data.level.values,
            add_unit("lowest_uplift", units): data.lowest_uplift,
            "undecided_note": data.undecided_note,
            "motions": [
                {
                    "name": str(data.motion.values[m]),
                    **({"vertical": str(data.vertical.values[m])} if "vertical" in data.coords else {}),
                    "block": b,
                    **{name: to_plain(data[name].values[b]) for name in find_labels(data)},
                    add_unit("overturning_level", units): float(lowest[m, b]),
                    "overturns": [dict(zip(ends, band, strict=True)) for band in self.bands(block=b, motion=m)],
                    "peak_over_alpha": peaks[m, b],
                }
                for m in range(data.sizes["motion"])
                for b in range(data.sizes["block"])
            ],
        }

    def plot(
        self, ax: Axes | None = None, *, block: int = 0, title: str = "", figsize: tuple[float, float] | None = None
    ) -> Figure:
        """Plot level against peak rotation and bands of one block, by position, like `DrawnResult.plot`."""
        from rocking.plot.curves import ScaledMotion, draw_ida

        data, block = self.data, self._check_position(block, "block")
        levels = data.level.scale * data.level.values
        peaks = data.peak_over_alpha.isel(block=block).transpose("motion", "level").values
        motions = []
        for m, label in enumerate(create_motion_labels(data, includes_history=False)):
            bands = data.level.scale * np.array(self.bands(block=block, motion=m)).reshape(-1, 2)
            motions.append(ScaledMotion(label, levels, peaks[m], np.where(np.isnan(bands), levels[[0, -1]], bands)))
        block_text = data.blocks if data.sizes["block"] == 1 else list_block_names(data)[block]
        return draw_ida(
            motions=motions,
            level_label=data.level.label,
            title=title or escape_dollars(f"{block_text}, {data.model} model"),
            ax=ax,
            figsize=figsize,
        )


def compute_lowest_uplift(
    blocks: Bodies, motions: Sequence[Motion], values: Floats, measure: Measure, model: Model
) -> float:
    """Find the lowest level at which a motion, scaled with its vertical component, lifts a block."""
    (thresholds, weight_thresholds), gravity = compute_uplift_thresholds(blocks, model), blocks.gravity
    factors = [compute_uplift_factors(motion, thresholds, gravity, weight_thresholds) for motion in motions]
    intensity = np.array(factors) ** measure.exponent * values[:, None] / compute_block_units(blocks, measure, model)
    lowest = float(np.min(intensity))
    if math.isinf(lowest):
        message = "no motion lifts a block at any level, because of direction or vertical component"
        raise OptionError(f"{message}; use other motions")
    return lowest


def _simulate_until_overturned(
    blocks: Bodies, motions: Sequence[Motion], measure: Measure, lowest_level: float, options: dict[str, Any]
) -> xr.Dataset:
    """Simulate levels in steps of 5 % up to three times the level by which every motion overturns each block."""
    import xarray as xr

    tables: list[xr.Dataset] = []
    for start in range(0, 128, _LEVELS_PER_CHUNK):
        levels = lowest_level * np.power(1.05, np.arange(start, start + _LEVELS_PER_CHUNK, dtype=np.float64))
        tables.append(simulate_levels(blocks, motions, measure, levels, **options))
        overturned = xr.concat([chunk.overturned for chunk in tables], "level")
        last_level = 3.0 * overturned.level.where(overturned).min("level", skipna=True).max(skipna=False)
        if last_level <= levels[-1]:
            break
    table = xr.concat(tables, "level", data_vars="all", coords="minimal", compat="override", join="override")
    indices = np.flatnonzero(table.level.values >= float(last_level))
    return table.isel(level=slice(0, indices[0] + 1 if indices.size else None))


def _combine_bands(
    table: xr.Dataset, flat_grid: Integers, brackets: Brackets, alpha: Floats, measure: Measure
) -> xr.Dataset:
    """Pair the levels of outcome changes in a (level, column) grid, NaN for bands beyond it."""
    columns, starts, ends = list[int](), list[float](), list[float]()
    for column in range(flat_grid.shape[1]):
        selected = brackets.column == column
        is_start, level = brackets.outcome_above[selected] == 1, brackets.level[selected]
        starts += [*([np.nan] if flat_grid[0, column] else []), *level[is_start]]
        ends += [*level[~is_start], *([np.nan] if flat_grid[-1, column] else [])]
        columns += [column] * (len(starts) - len(columns))
    motion, block = np.divmod(np.array(columns, dtype=np.int64), len(alpha))
    lowest = np.full((table.sizes["motion"], len(alpha)), np.inf)
    np.minimum.at(lowest, (motion, block), np.array(starts, dtype=float))
    lowest[np.isinf(lowest)] = np.nan
    attributes: dict[str, Any] = {"units": measure.units, "long_name": measure.quantity, "label": measure.label}
    attributes |= {"scale": measure.display_factor, **measure.options()}
    table = table[list(RATIO_VARIABLES)].transpose(..., "block")
    ratios = compute_ratios(alpha, *(table[name].values for name in RATIO_VARIABLES))
    ratio_attributes = {"units": "1", "long_name": "peak rotation over slenderness"}
    table["level"].attrs = attributes
    return table.drop_vars("unfinished").assign(
        peak_over_alpha=(table.peak_rotation.dims, ratios, ratio_attributes),
        overturning_level=(("motion", "block"), lowest, attributes),
        band_motion=("band", motion, {"units": "1", "long_name": "position of the motion"}),
        band_block=("band", block, {"units": "1", "long_name": "position of the block"}),
        band_start=("band", np.array(starts, dtype=float), attributes),
        band_end=("band", np.array(ends, dtype=float), attributes),
    )


class _LevelDescription:
    """Description of simulated levels and of bands of them."""

    def __init__(self, level: xr.DataArray) -> None:
        self.scale, self.values = level.scale, level.scale * level.values
        self.unit = {"m/s^2": " g", "1": ""}.get(level.units, f" {level.units}")
        low, high = (f"{end:.5g}" for end in self.values[[0, -1]])
        self.range_text = f"{low}{self.unit}" if low == high else f"{low} to {high}{self.unit}"

    def summary(self, lowest_uplift: float) -> str:
        """Describe the levels, and whether all of them are below the level (SI) at which a motion lifts a block."""
        sentence = f"looked at: {format_count(len(self.values), 'level')}, {self.range_text}"
        if len(self.values) > 1:
            steps, ratios = np.diff(self.values), self.values[1:] / self.values[:-1]
            apart = f"up to {steps.max():.5g}{self.unit}"
            if np.allclose(steps, steps[0], rtol=1e-6):
                apart = f"{steps[0]:.5g}{self.unit}"
            elif np.allclose(ratios, ratios[0], rtol=1e-6):
                apart = f"{100.0 * (ratios[0] - 1.0):.3g} %"
            sentence += f", {apart} apart; bands and gaps that lie between two of them are not seen"
        uplift = self.scale * lowest_uplift
        if self.values[-1] < uplift:
            sentence += f"\nnone of them lifts a block; that begins at {uplift:.5g}{self.unit}: are the levels right?"
        return sentence

    def describe_bands(self, bands: Sequence[tuple[float, float]]) -> str:
        """Describe the bands that overturn (SI). NaN marks unknown ends beyond the levels."""
        texts = [self._describe_band(*(self.scale * end for end in band)) for band in bands]
        return "; ".join(texts) or f"at no level looked at, {self.range_text}"

    def _describe_band(self, low: float, high: float) -> str:
        if not (math.isnan(low) or math.isnan(high)):
            return f"{low:.5g} to {high:.5g}"
        if math.isnan(low) and math.isnan(high):
            return f"at every level looked at, {self.range_text}"
        open_end = f"up to {high:.5g}{self.unit}" if math.isnan(low) else f"from {low:.5g}{self.unit} on"
        return f"at all levels looked at {open_end}"
