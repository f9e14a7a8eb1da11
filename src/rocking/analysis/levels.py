"""Simulation of blocks under motions scaled to levels, and bisection for changes of the outcome."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.block import Blocks
from rocking.block.body import Bodies, Body
from rocking.core import bisection, checks
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.constants import Model
from rocking.core.progress import Progress, note
from rocking.core.tables import format_count
from rocking.engine.problem import gather_bodies
from rocking.engine.tasks import Setup, describe_missing, simulate_each
from rocking.errors import Message, OptionError, escape_braces
from rocking.inputs.notes import is_multiple
from rocking.motion.description import Origin, create_label
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.response.perturbed import FACTOR_COUNT, RELATIVE_STEP, format_percent, list_factors
from rocking.simulation.ensemble import Polarity, body_coordinates, list_labels, simulate_many

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


def assign_numbers(labels: Sequence[object]) -> Integers:
    """Replace labels by integers in the order of first appearance."""
    numbers: dict[object, int] = {}
    return np.array([numbers.setdefault(label, len(numbers)) for label in labels], dtype=np.int64)


def assign_groups(labels: object, name: str, count: int, item: str = "outcome") -> Integers:
    """Replace `count` labels by integers. Labels None, NaN or "" are distinct."""
    entries = checks.items(labels, name, OptionError)
    if len(entries) != count or not all(isinstance(label, Hashable) for label in entries):
        message = f"{{}} must contain {count} labels (numbers or texts), one for each {item}"
        raise OptionError(message, name, value=labels)
    return assign_numbers([(k,) if _is_missing(label) else label for k, label in enumerate(entries)])


def _is_missing(label: object) -> bool:
    # The missing value of pandas equals nothing and has no truth value.
    is_none = label is None or type(label).__name__ == "NAType"
    return is_none or label == "" or (isinstance(label, float) and math.isnan(label))


def create_motion_labels(data: xr.Dataset, coordinate: str = "motion", *, includes_history: bool = True) -> list[str]:
    """Compose labels of motions or records, with vertical components and processing."""
    names = data[coordinate].values
    verticals = data.vertical.values if "vertical" in data.coords else [""] * len(names)
    histories = data.histories if includes_history else [""] * len(names)
    return [
        create_label(str(name), history.split("; ") if history else [], str(vertical))
        for name, history, vertical in zip(names, histories, verticals, strict=True)
    ]


def describe_motions(data: xr.Dataset) -> str:
    """Describe motions by name or number, with the numbers of scaled or processed ones."""
    labels = create_motion_labels(data)
    changed_count = sum(bool(history) for history in data.histories)
    if len(labels) == 1:
        return labels[0]
    changed_text = "all" if changed_count == len(labels) else f"{changed_count} of them"
    return f"{len(labels)} motions" + (f", {changed_text} scaled or processed" if changed_count else "")


def split_curves(data: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Split a spectrum into named curves for each slenderness and restitution, or one for an ensemble."""
    if "block" in data.dims:
        return [(data.blocks, data)]
    stacked = data.stack(curve=[name for name in ("alpha", "restitution") if name in data.dims])
    curves = []
    for curve in (stacked.isel(curve=k) for k in range(stacked.sizes["curve"])):
        restitution = f", restitution {float(curve.restitution):g}" if "restitution" in curve.coords else ""
        curves.append((f"alpha = {float(curve.alpha):.5g} rad ({math.degrees(curve.alpha):.4g}°){restitution}", curve))
    return curves


#: Note for blocks with unequal sides that were simulated in one polarity only.
MIRROR_NOTE: Final = "the sides differ, so motions that are reversed (scaled by -1) overturn at other levels"

#: Option that clusters motions by station.
BY_STATION: Final = "station"


def describe_blocks(blocks: Bodies | Body | Sequence[Body]) -> str:
    """Describe a block by its sizes or parameters, several by their number."""
    if (block := find_single_block(blocks)) is None:
        return format_count(len(gather_bodies(blocks)), "block")
    if not isinstance(blocks, Blocks) or blocks.terms:
        return block.description
    return f"block with p = {_format_sides(blocks.p[0])} rad/s, alpha = {_format_sides(blocks.alpha[0])} rad"


def describe_pool(blocks: Bodies | Body | Sequence[Body], weights: ArrayLike | None) -> str:
    """Describe blocks with pooled outcomes, and whether their weights differ."""
    if find_single_block(blocks) is not None:
        return describe_blocks(blocks)
    return f"{describe_blocks(blocks)}, {'all of equal weight' if weights is None else 'weighted'}"


def normalise_weights(weights: ArrayLike | None, count: int) -> Floats:
    """Normalise weights of blocks to mean 1, equal by default."""
    if weights is None:
        return np.ones(count)
    values = checks.numbers(weights, "weights", OptionError)
    if values.shape != (count,) or not (np.all(np.isfinite(values) & (values >= 0.0)) and np.any(values > 0.0)):
        raise OptionError(f"{{}} must contain {count} nonnegative numbers, not all 0, one for each block", "weights")
    values = values / values.max()  # otherwise sums of very large or very small weights overflow
    return np.asarray(values * (count / values.sum()))


def find_single_block(blocks: Bodies | Body | Sequence[Body]) -> Body | None:
    """Find the only block, or None if there are several."""
    if not isinstance(blocks, Sequence | Bodies):
        return blocks
    return blocks[0] if len(blocks) == 1 else None


def _format_sides(sides: Floats) -> str:
    return f"{sides[0]:.4g}" if sides[0] == sides[1] else f"({sides[0]:.4g}, {sides[1]:.4g})"


def compute_intensities(motions: Sequence[Motion], measure: Measure) -> Floats:
    """Compute the measure of each motion, in SI units."""
    return np.array([measure.require_positive_value(motion, motion.name) for motion in motions])


def assign_clusters(motions: Sequence[Motion], labels: object = None) -> Integers:
    """Assign numbers to clusters of motions with equal labels ("station": of one record) or equal up to a factor."""
    families = _join_groups(assign_families(motions), assign_pairs(motions))
    origins = [motion.description.origin or Origin() for motion in motions]
    stations = [f"{origin.event}, {origin.station}" if origin.station else "" for origin in origins]
    if labels is None:
        stations_by_family = {family: station for family, station in zip(families, stations, strict=True) if station}
        if len(stations_by_family) > len(set(stations_by_family.values())):
            message = f"components of one station count as independent of each other: {{}} may be {BY_STATION}"
            note(Message(f"{message}, which joins them", ("clusters",)))
        return families
    if isinstance(labels, str) and labels == BY_STATION:
        labels = stations
        if not any(stations):
            message = f"{{}} {BY_STATION} requires records that name their station; give a label for each motion"
            raise OptionError(message, "clusters")
    return _join_groups(families, assign_groups(labels, "clusters", len(motions), "motion"))


def _join_groups(first: Integers, second: Integers) -> Integers:
    """Join groups that have a common member, and number them in the order of their first members."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(first)
    links = coo_array((np.ones(count), (first, count + second)), shape=(2 * count, 2 * count))
    return assign_numbers(connected_components(links, directed=False)[1][first].tolist())


def assign_pairs(motions: Sequence[Motion]) -> Integers:
    """Assign one number to both components of each pair and to their reversals, and another to each other motion."""
    parts = [[part for part in (motion, motion.orthogonal) if part is not None] for motion in motions]
    keys = [
        frozenset((part.breakpoints.tobytes(), np.abs(part.coefficients).tobytes()) for part in row) for row in parts
    ]
    return assign_numbers(keys)


def find_larger_responses(ratio: Floats, motions: Sequence[Motion], measure: Measure) -> Integers:
    """Find the simulation with the larger response for each level, pair (or single motion) and block.

    Ratios are over (level, motion, block, polarity), NaN if unknown. The result contains positions in the flattened
    array, shape (level, pair, block).
    """
    pairs = assign_pairs(motions)
    if any(motion.orthogonal for motion in motions):
        alone = [motions[group[0]].name for k in range(pairs.max() + 1) if len(group := np.flatnonzero(pairs == k)) < 2
                 and motions[group[0]].orthogonal is not None]  # fmt: skip
        if alone:
            message = (
                f"{{}} requires both components of each pair; the other one of {escape_braces(alone[0])} is missing"
            )
            raise OptionError(message, "larger")
        if measure.component == "own":
            message = '{} requires a measure of the pair, which is the same for both components; use {} "rotd50"'
            raise OptionError(message, "larger", "component")
    # An unknown response is larger than all known ones except overturning.
    rank = np.where(np.isnan(ratio), np.finfo(float).max, ratio)
    positions = np.arange(ratio.size).reshape(ratio.shape)
    columns = []
    for k in range(pairs.max() + 1):
        pair_ranks, pair_positions = (
            np.moveaxis(array[:, pairs == k], 2, 1).reshape(len(ratio), ratio.shape[2], -1)
            for array in (rank, positions)
        )
        columns.append(np.take_along_axis(pair_positions, pair_ranks.argmax(axis=2)[..., None], axis=2)[..., 0])
    return np.stack(columns, axis=1)


def describe_sample(clusters: Integers, labels: object) -> str:
    """Describe the number of motions and, if they have labels, of clusters."""
    text = format_count(len(clusters), "motion")
    return text if labels is None else f"{text} in {format_count(len(np.unique(clusters)), 'cluster')}"


def assign_families(motions: Sequence[Motion], *, include_reversed: bool = True) -> Integers:
    """Assign numbers to families of motions that are equal up to a factor, by choice also a negative one."""
    # Invariants of scale and sign. Only motions with equal invariants are compared in full.
    invariants, first_members = np.empty((len(motions), 2)), list[int]()
    families = np.empty(len(motions), dtype=np.int64)
    for k, motion in enumerate(motions):
        magnitudes = np.abs(np.concatenate([part.coefficients.ravel() for part in (motion, motion.vertical) if part]))
        invariants[k] = (magnitudes / magnitudes.max()).mean(), np.sqrt(((magnitudes / magnitudes.max()) ** 2).mean())
        nearby = np.flatnonzero(np.all(np.abs(invariants[first_members] - invariants[k]) <= 1e-9, axis=1)).tolist()
        is_alike = (is_multiple(motions[first_members[j]], motion, include_reversed=include_reversed) for j in nearby)
        families[k] = next(compress(nearby, is_alike), len(first_members))
        if families[k] == len(first_members):
            first_members.append(k)
    return families


def compute_block_units(blocks: Bodies, measure: Measure, model: Model) -> Floats:
    """Compute the unit of the measure for each block (SI): the block's own unit, or 1."""
    if not measure.has_block_units:
        return np.ones(len(blocks))
    uplift_thresholds = [min(blocks[k].uplift_thresholds(model)) for k in range(len(blocks))]
    return measure.block_units(np.array(uplift_thresholds), blocks.parameters()["p"][0].min(axis=1))


def simulate_levels(
    blocks: Bodies, motions: Sequence[Motion], measure: Measure, levels: Floats, *, model: Model, **options: Any
) -> xr.Dataset:
    """Simulate every block under every motion at every level, with the dimension ``level``."""
    import xarray as xr

    units, coordinate = compute_block_units(blocks, measure, model), {"measure": measure.name, "units": measure.units}
    groups = [np.flatnonzero(units == unit) for unit in np.unique(units)]
    parts = []
    for group in groups:
        scaled = {"levels": levels * units[group[0]], "measure": measure.motion_measure}
        part = simulate_many(blocks.select(group), motions, model=model, **scaled, **options)
        parts.append(part.rename(scale="level").assign_coords(level=("level", levels, coordinate)))
    if len(parts) == 1:
        return parts[0]
    names = (body_coordinates(blocks.select(group)) for group in groups)  # added to the full table
    parts = [part.drop_vars(list(each)) for part, each in zip(parts, names, strict=True)]
    table = xr.concat(parts, "block", data_vars="all", coords="minimal", compat="override", join="override")
    return table.isel(block=np.argsort(np.concatenate(groups))).assign_coords(body_coordinates(blocks))


#: Variables of a table of simulations from which `compute_ratios` is computed.
RATIO_VARIABLES: Final = ("peak_rotation", "overturned", "unfinished")


def compute_ratios(slenderness: Floats | float, peak: Floats, overturned: Flags, unfinished: Flags) -> Floats:
    """Compute ratios of peak rotation to slenderness: infinite for overturning, NaN for abandoned simulations."""
    return np.asarray(np.where(unfinished, np.nan, np.where(overturned, np.inf, peak / slenderness)))


def compute_exceedances(ratio: Floats, limit: float, name: str) -> Floats:
    """Compare ratios of peak rotation to slenderness with a limit (infinite: overturning); 1 if exceeded, else 0."""
    limit = check_limit(limit, name)
    return np.asarray(np.isinf(ratio) if math.isinf(limit) else ratio > limit, dtype=np.float64)


def check_limit(limit: float, name: str) -> float:
    """Check a limit of the ratio of peak rotation to slenderness."""
    argument = f"the limit {name!r} (rotation over slenderness)"
    checked = checks.real(limit, argument, OptionError)
    if not checked >= 0.0:
        raise OptionError(f"{{}} must be 0 or more, not {limit!r}", argument, value=limit)
    return checked


def check_state_mapping(values: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """Check values by limit state, at least one."""
    for state in checks.mapping(values, name, OptionError, "{'overturning': inf}"):
        checks.text(state, f"name of a limit state in {name}", OptionError)
    return values


def check_limit_states(limit_states: Mapping[str, float] | None) -> Mapping[str, float]:
    """Check limits of the ratio of peak rotation to slenderness; the default is overturning (infinite)."""
    return {"overturning": math.inf} if limit_states is None else check_state_mapping(limit_states, "limit_states")


def create_outcome_table(
    bodies: Bodies,
    table: xr.Dataset,
    measure: Measure,
    intensity: Floats,
    ratio: Floats,
    limit_states: Mapping[str, float],
) -> pd.DataFrame:
    """Create a table of all simulations (level, motion, block, polarity) with the limits that they exceed."""
    import pandas as pd

    def expand(values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        return np.broadcast_to(values, ratio.shape).ravel()  # order: level, motion, block, polarity

    signs = table.polarity.values if "polarity" in table.coords else np.array(["+"])
    motion_names = [name for name in ("motion", "vertical") if name in table.coords]
    exceeded = {state: compute_exceedances(ratio, limit, state).ravel() for state, limit in limit_states.items()}
    return pd.DataFrame(
        {
            **{name: expand(table[name].values[:, None, None]) for name in motion_names},
            "block": expand(np.arange(table.sizes["block"])[:, None]),
            **{name: expand(values[:, None]) for name, values in list_labels(bodies).items()},
            "polarity": expand(signs),
            measure.column: intensity,
            "peak_rotation_rad": table.peak_rotation.values.ravel(),
            "peak_over_alpha": ratio.ravel(),
            "overturned": table.overturned.values.ravel(),
            "unfinished": table.unfinished.values.ravel(),
            **{f"exceeded_{state}": flags.astype(bool) for state, flags in exceeded.items()},
        }
    )


def normalise_positive_weights(weights: ArrayLike | None, count: int) -> Floats:
    """Normalise weights to mean 1 over blocks of positive weight, so that zero weights do not change the count."""
    normalised = normalise_weights(weights, count)
    return np.asarray(normalised / normalised[normalised > 0.0].mean())


def describe_polarities(polarity: Polarity, *, is_symmetric: bool) -> str:
    """Describe the polarities if both were requested."""
    if polarity != "both":
        return ""
    return ", one polarity, since a symmetric block does the same in both" if is_symmetric else ", both polarities"


def note_missing(unfinished: Flags) -> None:
    """Report abandoned simulations, which count as half overturned."""
    if text := describe_missing(unfinished):
        note(f"{text}, and each counts as half overturned")


def list_missing_notes(unfinished: Flags) -> list[str]:
    """List the note on abandoned simulations, if there are any."""
    return [f"note: {message}"] if (message := describe_missing(unfinished)) else []


def describe_undecided(setup: Setup, motions: Sequence[Motion], factors: ArrayLike, overturned: Flags) -> str:
    """Describe how many outcomes of a sample change when motions are scaled by 1 +- 3e-6.

    Factors of the motions and outcomes are over (level, motion, block, polarity).
    """
    indices = np.sort(np.random.default_rng(0).permutation(overturned.size)[:30])
    _, motion, block, _ = np.unravel_index(indices, overturned.shape)
    factor, original = np.broadcast_to(factors, overturned.shape).ravel()[indices], overturned.ravel()[indices]
    scales, count = np.array(list_factors(RELATIVE_STEP, FACTOR_COUNT))[[0, -1]], len(indices)
    has_changed = np.zeros(2 * count, dtype=bool)
    for k, outcomes in simulate_each(
        setup, motions, np.tile(block, 2), np.tile(motion, 2), np.outer(scales, factor).ravel()
    ):
        has_changed[k] = outcomes["overturned"] != original[k % count]
    changed, sample = has_changed.reshape(2, count).any(axis=0).sum(), format_count(count, "outcome")
    return f"undecided within {format_percent(scales[-1] - 1.0)} of the motion: {changed} of a sample of {sample}"


@dataclass(frozen=True, eq=False)
class Brackets:
    """Brackets (low, high) of changes of the outcome in columns of a grid, sorted by column and level."""

    column: Integers
    low: Floats
    high: Floats
    outcome_below: Integers
    outcome_above: Integers

    @property
    def level(self) -> Floats:
        """Midpoint of every bracket."""
        return bisection.compute_midpoints(self.low, self.high)


#: Number of simulations that take hardly longer together than one.
_BATCH_SIZE: Final = 48


def find_boundaries(
    levels: Floats, outcome: Integers, find_outcome: Callable[[Integers, Floats], Integers], *, rtol: float
) -> Brackets:
    """Find all changes of the outcome (m, columns) between neighbouring levels (m,) of a grid.

    A bracket with a third outcome is split, but in an interval with 64 changes or more only one half is followed.
    Changes between two levels of equal outcome are not detected. Few brackets are bisected several times per call of
    `find_outcome`, by all midpoints that may be needed.
    """
    outcomes_by_point: dict[tuple[int, float], int] = {}
    row, column = np.nonzero(outcome[1:] != outcome[:-1])
    brackets = Brackets(column, levels[row], levels[row + 1], outcome[row, column], outcome[row + 1, column])
    origin = np.arange(len(brackets.level))
    remaining = _count_bisections(brackets, rtol)
    with Progress("refining", remaining) as bar:
        while (is_wide := bisection.is_wide(brackets.low, brackets.high, rtol)).any():
            wanted = list(zip(brackets.column[is_wide].tolist(), brackets.level[is_wide].tolist(), strict=True))
            if not outcomes_by_point.keys() >= set(wanted):
                columns, midpoints = _collect_midpoints(
                    brackets.column[is_wide], brackets.low[is_wide], brackets.high[is_wide]
                )
                points = zip(columns.tolist(), midpoints.tolist(), strict=True)
                outcomes_by_point = dict(zip(points, find_outcome(columns, midpoints).tolist(), strict=True))
            outcomes = brackets.outcome_below.copy()
            outcomes[is_wide] = [outcomes_by_point[point] for point in wanted]
            brackets, origin = _bisect(brackets, is_wide, outcomes, origin)
            # A third outcome adds brackets, for which the progress bar does not move back.
            previous, remaining = remaining, min(remaining, _count_bisections(brackets, rtol))
            bar.advance(previous - remaining)
    order = np.lexsort((brackets.low, brackets.column))
    return Brackets(*(values[order] for values in vars(brackets).values()))


def _collect_midpoints(column: Integers, low: Floats, high: Floats) -> tuple[Integers, Floats]:
    """Return the columns and midpoints of brackets, and of their halves as long as there are few."""
    columns, midpoints = [column], [bisection.compute_midpoints(low, high)]
    while sum(map(len, columns)) + 2 * len(column) < _BATCH_SIZE:
        low, high = np.append(low, midpoints[-1]), np.append(midpoints[-1], high)
        column = np.append(column, column)
        columns.append(column)
        midpoints.append(bisection.compute_midpoints(low, high))
    return np.concatenate(columns), np.concatenate(midpoints)


def _count_bisections(brackets: Brackets, rtol: float) -> int:
    """Count the bisections that brackets still need."""
    return int(np.ceil(np.log2(np.maximum(1.0, (brackets.high - brackets.low) / (rtol * brackets.high)))).sum())


def _bisect(brackets: Brackets, is_wide: Flags, outcomes: Integers, origin: Integers) -> tuple[Brackets, Integers]:
    """Bisect wide brackets, and split those with a third outcome."""
    column, low, high, below, above = vars(brackets).values()
    has_few_changes = np.bincount(origin)[origin] < 64
    is_third = is_wide & has_few_changes & (outcomes != below) & (outcomes != above)
    moves_up = is_wide & (outcomes == below)
    new_low, new_high = bisection.halve(low, high, moves_up, is_wide & ~moves_up)
    lower = column, new_low, new_high, below, np.where(is_third, outcomes, above)
    upper = (values[is_third] for values in (column, brackets.level, high, outcomes, above))
    return Brackets(*map(np.append, lower, upper)), np.append(origin, origin[is_third])
