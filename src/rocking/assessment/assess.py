"""Assessment of objects under records: simulation of each object, its fragility and rate, and the ranking."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.fragility import fragility
from rocking.analysis.hazard import HazardCurve
from rocking.analysis.incremental import compute_lowest_uplift
from rocking.analysis.levels import (
    assign_clusters,
    assign_groups,
    compute_block_units,
    compute_intensities,
    simulate_levels,
)
from rocking.analysis.risk import check_measure
from rocking.assessment.dataset import create_dataset
from rocking.assessment.ranks import compute_ranks
from rocking.assessment.results import Assessment, ObjectAssessment
from rocking.block import Blocks
from rocking.block.body import Bodies, Body
from rocking.block.friction import Friction
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY, Model
from rocking.core.progress import Progress
from rocking.engine.problem import gather_bodies
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import FitError, OptionError, RockingError, escape_braces
from rocking.inputs.inventory import Inventory, find_friction, list_names
from rocking.motion.motion import Motion
from rocking.motion.scaling import IntensityName, Measure
from rocking.records.named import Motions, index_motions
from rocking.simulation.ensemble import Polarity, simulate_many

#: Number of levels of the search for the range of an object, the share of the motions that overturn it at the last
#: level, and the largest peak acceleration of a typical motion at a level, m/s^2.
_SEARCH_COUNT: Final = 10
_LAST_SHARE: Final = 0.9
_MAX_PGA: Final = 5.0 * STANDARD_GRAVITY


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
    chattering: str | ChatteringScheme = "certified",
    confidence: float = 0.9,
    years: float = 50.0,
    sample_count: int = 50,
) -> Assessment:
    """Assess which objects overturn, at which intensity, and how often at a site.

    Every object is simulated under the unscaled motions, and under the motions scaled to levels of intensity, to which
    a fragility curve is fitted. An object or motion that cannot be read (`Inventory.failures`) or simulated is listed
    with the reason, and does not affect the others.

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
    clusters, model, chattering, confidence : optional
        As for `fragility`. Labels of clusters are those of all motions.
    years : float
        Time of the probabilities, years.
    sample_count : int
        Number of sampled blocks of an object with uncertain sizes in an `Inventory`.

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
    checks.integer(sample_count, "sample_count", OptionError, 2)
    if isinstance(levels, int):
        checks.integer(levels, "levels", OptionError, 2)
    intensity = Measure.parse(measure)
    check_measure(hazard, intensity)
    named, unusable = index_motions(motions), dict[str, str]()
    failures = dict(blocks.failures) if isinstance(blocks, Inventory) else {}
    is_usable = [_is_scalable(name, motion, intensity, unusable) for name, motion in named.items()]
    usable = dict(compress(named.items(), is_usable))
    if not usable:
        raise OptionError(escape_braces(f"no motion can be scaled; the first: {next(iter(unusable.values()))}"))
    if clusters is not None and not isinstance(clusters, str):
        clusters = assign_groups(clusters, "clusters", len(named), "motion")[is_usable]
    block_list: Any = blocks if isinstance(blocks, Sequence | Bodies) else [blocks]
    bodies: list[Body] = [*block_list]
    options: dict[str, Any] = {"model": model, "polarity": polarity, "chattering": chattering}
    study = _Study([*usable.values()], intensity, hazard, levels, clusters, confidence, options)
    objects = list[ObjectAssessment]()
    with Progress("assessing", total=len(bodies)) as bar:
        for k, (name, body) in enumerate(zip(list_names(bodies), bodies, strict=True)):
            try:
                sample = blocks.sample(k, sample_count) if isinstance(blocks, Inventory) else None
                objects.append(study.assess(name, body, sample, friction))
            except RockingError as error:
                failures[name] = str(error)
            bar.advance()
    if not objects:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in failures.items())
        raise OptionError(escape_braces(f"no object can be assessed: {reasons}"))
    objects.sort(key=lambda item: item.order_vulnerability(hazard))
    numbers = assign_clusters([*usable.values()], clusters)
    ranks = dict(zip(("rank_best", "rank_worst"), compute_ranks(objects, numbers, hazard, confidence), strict=True))
    data = create_dataset(objects, usable, intensity, ranks, {"model": model, "polarity": polarity})
    return Assessment(tuple(objects), usable, intensity, hazard, failures, unusable, years, confidence, model, data)


def _is_scalable(name: str, motion: Motion, measure: Measure, unusable: dict[str, str]) -> bool:
    """Whether a motion can be scaled; otherwise add the reason."""
    try:
        measure.require_positive_value(motion, name)
    except RockingError as error:
        unusable[name] = str(error)
        return False
    return True


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
        coefficient = find_friction(body, friction)
        options: dict[str, Any] = {**self.options, "friction": coefficient}
        blocks = gather_bodies(body) if sample is None else sample
        levels = self._choose_levels(blocks, options)
        unscaled = simulate_many(body, self.motions, robust=True, **options).isel(block=0)
        share = unscaled.overturned_share
        unscaled["undecided"] = (share > 0.0) & (share < 1.0)
        unscaled["unfinished"] = unscaled.unfinished | unscaled.get("lost_contact", False)
        unscaled = unscaled.max("polarity") if "polarity" in unscaled.dims else unscaled
        fitted, fault = None, ""
        settings: dict[str, Any] = {"clusters": self.clusters, "confidence": self.confidence, "levels": levels}
        try:
            fitted = fragility(blocks, self.motions, measure=self.measure, **settings, **options)
            outcomes = fitted.outcomes
        except FitError as error:
            fault, outcomes = error.text().partition(": ")[2] or error.text(), error.outcomes
        assert outcomes is not None
        exceedances = outcomes.exceeded_overturning.where(~outcomes.unfinished).to_numpy(float)
        shares = np.nanmean(exceedances.reshape(len(levels), len(self.motions), -1), axis=2)
        rate = None if fitted is None or self.hazard is None else fitted.annual_rate(self.hazard).rates[0]
        block_count = 1 if sample is None else len(sample)
        return ObjectAssessment(name, body, block_count, coefficient, fitted, fault, rate, levels, shares, unscaled)

    def _choose_levels(self, blocks: Bodies, options: Mapping[str, Any]) -> Floats:
        """Return levels from below the first overturning of a coarse search to its last, in equal ratios."""
        if not isinstance(self.levels, int):
            return checks.increasing_numbers(self.levels, "levels", OptionError)
        measure, model = self.measure, options["model"]
        values = compute_intensities(self.motions, measure)
        lowest = compute_lowest_uplift(blocks, self.motions, values, measure, model)
        power, pgas = measure.exponent, np.array([motion.pga for motion in self.motions])
        strongest = float(np.median(values * (_MAX_PGA / pgas) ** power))
        block_unit = float(compute_block_units(blocks, measure, model).min())
        highest = min(max(2.0**power * lowest, strongest / block_unit), 64.0**power * lowest)
        grid = np.geomspace(lowest, highest, _SEARCH_COUNT)
        table = simulate_levels(blocks, self.motions, measure, grid, **{**options, "polarity": "+"})
        shares = table.overturned.mean([name for name in table.overturned.dims if name != "level"]).values
        first, last = int(np.argmax(shares > 0.0)), int(np.argmax(shares >= _LAST_SHARE))
        low = grid[max(first - 1, 0)] if shares.any() else grid[0]
        levels = np.geomspace(low, grid[last] if shares[last] >= _LAST_SHARE else grid[-1], self.levels)
        scale = measure.display_factor
        return np.array([float(f"{scale * level:.3g}") / scale for level in levels])  # as they are displayed
