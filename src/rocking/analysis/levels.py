"""Simulation of blocks under motions scaled to levels, and bisection for changes of the outcome."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
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
from rocking.engine.tasks import Setup, Task, describe_missing, simulate_tasks
from rocking.errors import InvalidOption, Message
from rocking.inputs.notes import is_multiple
from rocking.motion.description import Origin, compose_label
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.response import COUNT, RELATIVE, format_percent, list_factors
from rocking.simulation.ensemble import Polarity, body_coordinates, simulate_many

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


def numbered(labels: Sequence[object]) -> Integers:
    """Replace labels by integers in the order of first appearance."""
    places: dict[object, int] = {}
    return np.array([places.setdefault(label, len(places)) for label in labels], dtype=np.int64)


def groups_of(labels: object, name: str, count: int, each: str = "outcome") -> Integers:
    """Replace `count` labels by integers. Labels None, NaN or "" are distinct."""
    given = checks.items(labels, name, InvalidOption)
    if len(given) != count or not all(isinstance(label, Hashable) for label in given):
        raise InvalidOption(f"{{}} must hold {count} labels, numbers or texts, one for each {each}", name, value=labels)
    return numbered([(k,) if _is_missing(label) else label for k, label in enumerate(given)])


def _is_missing(label: object) -> bool:
    # The missing value of pandas equals nothing and has no truth value.
    is_none = label is None or type(label).__name__ == "NAType"
    return is_none or label == "" or (isinstance(label, float) and math.isnan(label))


def labels_of(data: xr.Dataset, of: str = "motion", *, with_history: bool = True) -> list[str]:
    """Names of motions or records, with vertical components and processing."""
    names = data[of].values
    verticals = data.vertical.values if "vertical" in data.coords else [""] * len(names)
    histories = data.histories if with_history else [""] * len(names)
    return [
        compose_label(str(name), done.split("; ") if done else [], str(vertical))
        for name, done, vertical in zip(names, histories, verticals, strict=True)
    ]


def motions_text(data: xr.Dataset) -> str:
    """Return the name or number of motions, and the numbers of scaled or processed ones."""
    labels = labels_of(data)
    changed = sum(bool(done) for done in data.histories)
    if len(labels) == 1:
        return labels[0]
    which = "all" if changed == len(labels) else f"{changed} of them"
    return f"{len(labels)} motions" + (f", {which} scaled or processed" if changed else "")


def curves_of(data: xr.Dataset) -> list[tuple[str, xr.Dataset]]:
    """Return names and selections of all slenderness-restitution combinations, or one curve for an ensemble."""
    if "block" in data.dims:
        return [(data.blocks, data)]
    stacked = data.stack(curve=[name for name in ("alpha", "restitution") if name in data.dims])
    curves = []
    for one in (stacked.isel(curve=k) for k in range(stacked.sizes["curve"])):
        restitution = f", restitution {float(one.restitution):g}" if "restitution" in one.coords else ""
        curves.append((f"alpha = {float(one.alpha):.5g} rad ({math.degrees(one.alpha):.4g}°){restitution}", one))
    return curves


#: Note for blocks with unequal sides that were simulated in one polarity only.
MIRROR_NOTE: Final = "the sides differ, so motions that are reversed (scaled by -1) overturn at other levels"

#: Option that clusters motions by station.
BY_STATION: Final = "station"


def described(blocks: Bodies | Body | Sequence[Body]) -> str:
    """Describe a block by its sizes or parameters, several by their number."""
    only = single_block(blocks)
    if only is None:
        return format_count(len(gather_bodies(blocks)), "block")
    if not isinstance(blocks, Blocks) or blocks.terms:
        return only.description
    return f"block with p = {_pair(blocks.p[0])} rad/s, alpha = {_pair(blocks.alpha[0])} rad"


def pooled(blocks: Bodies | Body | Sequence[Body], weights: ArrayLike | None) -> str:
    """Describe blocks with pooled outcomes, and whether their weights differ."""
    if single_block(blocks) is not None:
        return described(blocks)
    return f"{described(blocks)}, {'all of equal weight' if weights is None else 'weighted'}"


def normalised_weights(weights: ArrayLike | None, count: int) -> Floats:
    """Weights of blocks with mean 1, equal by default."""
    if weights is None:
        return np.ones(count)
    given = checks.numbers(weights, "weights", InvalidOption)
    if given.shape != (count,) or not (np.all(np.isfinite(given) & (given >= 0.0)) and np.any(given > 0.0)):
        raise InvalidOption(f"{{}} must be {count} numbers of 0 or more, not all 0, one for each block", "weights")
    given = given / given.max()  # otherwise sums of very large or very small weights overflow
    return np.asarray(given * (count / given.sum()))


def single_block(blocks: Bodies | Body | Sequence[Body]) -> Body | None:
    """Return the block as described, if there is only one."""
    if not isinstance(blocks, Sequence | Bodies):
        return blocks
    return blocks[0] if len(blocks) == 1 else None


def _pair(sides: Floats) -> str:
    return f"{sides[0]:.4g}" if sides[0] == sides[1] else f"({sides[0]:.4g}, {sides[1]:.4g})"


def values_of(motions: Sequence[Motion], measure: Measure) -> Floats:
    """Return the measure of each motion, in SI units."""
    return np.array([measure.positive(motion, motion.name) for motion in motions])


def clusters_of(motions: Sequence[Motion], labels: object = None) -> Integers:
    """Cluster numbers of motions with equal labels ("station": of one record) or equal up to a factor."""
    families, origins = families_of(motions), [motion.description.origin or Origin() for motion in motions]
    stations = [f"{one.event}, {one.station}" if one.station else "" for one in origins]
    if labels is None:
        of_records = {family: station for family, station in zip(families, stations, strict=True) if station}
        if len(of_records) > len(set(of_records.values())):
            sentence = f"components of one station count as independent of each other: {{}} may be {BY_STATION}"
            note(Message(f"{sentence}, which joins them", ("clusters",)))
        return families
    if isinstance(labels, str) and labels == BY_STATION:
        labels = stations
        if not any(stations):
            raise InvalidOption(f"{{}} {BY_STATION} is for records that name theirs: give each a label", "clusters")
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(motions)
    given = groups_of(labels, "clusters", count, "motion")
    links = coo_array((np.ones(count), (families, count + given)), shape=(2 * count, 2 * count))
    return numbered(connected_components(links, directed=False)[1][families].tolist())


def motions_in_words(clusters: Integers, labels: object) -> str:
    """Return the number of motions and, if they have labels, of clusters."""
    text = format_count(len(clusters), "motion")
    return text if labels is None else f"{text} in {format_count(len(np.unique(clusters)), 'cluster')}"


def families_of(motions: Sequence[Motion], *, reversed_too: bool = True) -> Integers:
    """Family numbers of motions that are equal up to a factor, also a negative one if ``reversed_too``."""
    # Invariants of scale and sign. Only motions with equal invariants are compared in full.
    alike = np.empty((len(motions), 2))
    for k, motion in enumerate(motions):
        size = np.abs(np.concatenate([part.coefficients.ravel() for part in (motion, motion.vertical) if part]))
        alike[k] = (size / size.max()).mean(), np.sqrt(((size / size.max()) ** 2).mean())
    firsts: list[int] = []
    families = np.empty(len(motions), dtype=np.int64)
    for k, motion in enumerate(motions):
        near = np.flatnonzero(np.all(np.abs(alike[firsts] - alike[k]) <= 1e-9, axis=1))
        same = (int(j) for j in near if is_multiple(motions[firsts[j]], motion, reversed_too=reversed_too))
        families[k] = next(same, len(firsts))
        if families[k] == len(firsts):
            firsts.append(k)
    return families


def units_of(blocks: Bodies, measure: Measure, model: Model) -> Floats:
    """Return the unit of the measure for each block (SI): the block's own unit, or 1."""
    if not measure.in_block_units:
        return np.ones(len(blocks))
    lifting = [min(blocks[k].uplift_thresholds(model)) for k in range(len(blocks))]
    return measure.unit(np.array(lifting), blocks.parameters()["p"][0].min(axis=1))


def simulate_levels(
    blocks: Bodies, motions: Sequence[Motion], measure: Measure, levels: Floats, *, model: Model, **options: Any
) -> xr.Dataset:
    """Simulate every block under every motion at every level, with the dimension ``level``."""
    import xarray as xr

    units = units_of(blocks, measure, model)
    groups = [np.flatnonzero(units == unit) for unit in np.unique(units)]
    parts = []
    for group in groups:
        scaled = {"levels": levels * units[group[0]], "measure": measure.alone}
        part = simulate_many(blocks.select(group), motions, model=model, **scaled, **options)
        part = part.drop_vars(body_coordinates(blocks.select(group)))  # added to the whole
        parts.append(part.assign_coords(scale=("scale", levels, {"measure": measure.name, "units": measure.units})))
    whole = xr.concat(parts, "block", data_vars="all", coords="minimal", compat="override", join="override")
    ordered = whole.isel(block=np.argsort(np.concatenate(groups))).rename(scale="level")
    return ordered.assign_coords(body_coordinates(blocks))


def ratios_of(peak: Floats, overturned: Flags, unfinished: Flags, slenderness: Floats | float) -> Floats:
    """Ratio of peak rotation to slenderness: infinite for overturning, NaN for abandoned simulations."""
    return np.asarray(np.where(unfinished, np.nan, np.where(overturned, np.inf, peak / slenderness)))


def passed(ratio: Floats, limit: float, name: str) -> Floats:
    """Whether the ratio of peak rotation to slenderness exceeds a limit (infinite: overturning), 1 or 0."""
    limit = checked_limit(limit, name)
    return np.asarray(np.isinf(ratio) if math.isinf(limit) else ratio > limit, dtype=np.float64)


def checked_limit(limit: float, name: str) -> float:
    """Validate a limit of the ratio of peak rotation to slenderness."""
    what = f"the limit {name!r} (rotation over slenderness)"
    least = checks.real(limit, what, InvalidOption)
    if not least >= 0.0:
        raise InvalidOption(f"{{}} must be 0 or more, not {limit!r}", what, value=limit)
    return least


def by_limit_state(values: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """Return values by limit state, at least one."""
    for state in checks.mapping(values, name, InvalidOption, "{'overturning': inf}"):
        checks.text(state, f"name of a limit state in {name}", InvalidOption)
    return values


def checked_limit_states(limit_states: Mapping[str, float] | None) -> Mapping[str, float]:
    """Return limits of the ratio of peak rotation to slenderness by limit state; by default overturning (infinite)."""
    return {"overturning": math.inf} if limit_states is None else by_limit_state(limit_states, "limit_states")


def outcomes_of(
    table: xr.Dataset, measure: Measure, intensity: Floats, ratio: Floats, limit_states: Mapping[str, float]
) -> pd.DataFrame:
    """Table of all simulations (level, motion, block, polarity) with the limits that they exceed."""
    import pandas as pd

    def along(values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        return np.broadcast_to(values, ratio.shape).ravel()  # order: level, motion, block, polarity

    signs = table.polarity.values if "polarity" in table.coords else np.array(["+"])
    motions = [name for name in ("motion", "vertical") if name in table.coords]
    return pd.DataFrame(
        {
            **{name: along(table[name].values[:, None, None]) for name in motions},
            "block": along(np.arange(table.sizes["block"])[:, None]),
            "polarity": along(signs),
            measure.column: intensity,
            "peak_rotation_rad": table.peak_rotation.values.ravel(),
            "peak_over_alpha": ratio.ravel(),
            "overturned": table.overturned.values.ravel(),
            "unfinished": table.unfinished.values.ravel(),
            **{
                f"exceeded_{name}": passed(ratio, limit, name).ravel().astype(bool)
                for name, limit in limit_states.items()
            },
        }
    )


def weights_of(weights: ArrayLike | None, count: int) -> Floats:
    """Normalise weights to mean 1 over blocks of positive weight, so that zero weights do not change the count."""
    shares = normalised_weights(weights, count)
    return np.asarray(shares / shares[shares > 0.0].mean())


def of_polarities(polarity: Polarity, *, is_symmetric: bool) -> str:
    """Append the polarities to a description if both were requested."""
    if polarity != "both":
        return ""
    return ", one polarity, since a symmetric block does the same in both" if is_symmetric else ", both polarities"


def note_missing(unfinished: Flags) -> None:
    """Report abandoned simulations, which count as half overturned."""
    if text := describe_missing(unfinished):
        note(f"{text}, and each counts as half overturned")


def undecided_text(setup: Setup, motions: Sequence[Motion], factors: ArrayLike, overturned: Flags) -> str:
    """Describe how many outcomes of a sample change when motions are scaled by 1 +- 3e-6.

    Factors of the motions and outcomes are over (level, motion, block, polarity).
    """
    drawn = np.sort(np.random.default_rng(0).permutation(overturned.size)[:30])
    _, motion, block, _ = np.unravel_index(drawn, overturned.shape)
    factor, was = np.broadcast_to(factors, overturned.shape).ravel()[drawn], overturned.ravel()[drawn]
    near = list_factors(RELATIVE, COUNT)
    tasks = (
        Task(slice(b, b + 1), motions[m], float(factor[k] * scale), (k,))
        for k, (m, b) in enumerate(zip(motion, block, strict=True))
        for scale in (near[0], near[-1])
    )
    found = simulate_tasks(setup, tasks)
    changed = {task.key for task, outcomes in found if outcomes["overturned"][0] != was[task.key[0]]}
    sample = format_count(len(drawn), "outcome")
    return f"undecided within {format_percent(near[-1] - 1.0)} of the motion: {len(changed)} of a sample of {sample}"


@dataclass(frozen=True, eq=False)
class Boundaries:
    """Brackets (low, high) of changes of the outcome in columns of a grid, sorted by column and level."""

    column: Integers
    low: Floats
    high: Floats
    below: Integers
    above: Integers

    @property
    def level(self) -> Floats:
        """Midpoint of every bracket."""
        return bisection.find_middles(self.low, self.high)


def boundaries(
    levels: Floats,
    outcome: Integers,
    outcome_of: Callable[[Integers, Floats], Integers],
    *,
    rtol: float,
) -> Boundaries:
    """Find all changes of the outcome (m, columns) between neighbouring levels (m,) of a grid.

    A bracket with a third outcome is split, but in an interval with 64 changes or more only one half is followed.
    Changes between two levels of equal outcome are not detected.
    """
    row, column = np.nonzero(outcome[1:] != outcome[:-1])
    here = Boundaries(column, levels[row], levels[row + 1], outcome[row, column], outcome[row + 1, column])
    origin = np.arange(len(here.level))
    left = _halvings(here, rtol)
    with Progress("refining", left) as bar:
        while (wide := bisection.is_wide(here.low, here.high, rtol)).any():
            found = here.below.copy()
            found[wide] = outcome_of(here.column[wide], here.level[wide])
            here, origin = _halved(here, wide, found, origin)
            # A third outcome adds brackets, which the bar waits for.
            before, left = left, min(left, _halvings(here, rtol))
            bar.advance(before - left)
    order = np.lexsort((here.low, here.column))
    return Boundaries(*(values[order] for values in vars(here).values()))


def _halvings(here: Boundaries, rtol: float) -> int:
    """Count the remaining bisections of the present brackets."""
    return int(np.ceil(np.log2(np.maximum(1.0, (here.high - here.low) / (rtol * here.high)))).sum())


def _halved(here: Boundaries, wide: Flags, found: Integers, origin: Integers) -> tuple[Boundaries, Integers]:
    """Bisect wide brackets, and split those with a third outcome."""
    few = np.bincount(origin)[origin] < 64
    third = wide & few & (found != here.below) & (found != here.above)
    up = wide & (found == here.below)
    low, high = bisection.halve(here.low, here.high, up, wide & ~up)
    lower = Boundaries(here.column, low, high, here.below, np.where(third, found, here.above))
    upper = Boundaries(here.column[third], here.level[third], here.high[third], found[third], here.above[third])
    both = (np.concatenate(pair) for pair in zip(vars(lower).values(), vars(upper).values(), strict=True))
    return Boundaries(*both), np.concatenate([origin, origin[third]])
