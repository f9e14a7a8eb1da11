"""Fragility curves for one intensity measure, and results derived from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, get_args

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.curve import (
    FragilityCurve,
    LossCategory,
    check_counts,
    convert_to_openquake_measure,
    create_fragility_line,
    fit_curve,
    format_intensity,
    format_interval,
    format_median_interval,
    format_nrml,
)
from rocking.analysis.hazard import HazardCurve
from rocking.analysis.levels import (
    assign_clusters,
    assign_groups,
    check_limit_states,
    check_state_mapping,
    compute_block_units,
    compute_exceedances,
    compute_intensities,
    compute_ratios,
    create_outcome_table,
    describe_polarities,
    describe_pool,
    describe_sample,
    describe_undecided,
    find_larger_responses,
    find_single_block,
    normalise_positive_weights,
    simulate_levels,
)
from rocking.analysis.risk import Risk, Survival, compute_mean_survival, compute_risk
from rocking.block.body import Bodies, Body
from rocking.block.friction import Friction, resolve_friction
from rocking.core import checks
from rocking.core.arrays import Flags
from rocking.core.constants import STANDARD_GRAVITY, Model
from rocking.core.progress import spell
from rocking.core.result import Result
from rocking.core.tables import Column, escape_dollars, format_count, format_table, write_text
from rocking.engine.problem import compute_slenderness, gather_bodies
from rocking.engine.schemes import ChatteringScheme, chattering_scheme
from rocking.engine.tasks import Setup, describe_missing
from rocking.errors import FitError, Message, OptionError
from rocking.motion.scaling import IntensityName, Measure
from rocking.records.named import Motions, list_motions
from rocking.simulation.ensemble import POLARITY_SIGNS, Polarity, simulate_many

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Points of a curve in a table or a figure.
_POINT_COUNT: Final = 201


@dataclass(frozen=True, eq=False, repr=False)
class Fragility(Result):
    """Fragility curves of one or more limit states for one intensity measure, computed by `fragility`.

    Tables: "curves" and, for simulated blocks, "outcomes". The figure contains curves, bands and observed shares.

    Attributes
    ----------
    curves : tuple of FragilityCurve
        Curve of each limit state.
    measure : Measure
        Intensity measure. Intensities are in its SI units.
    description, model : str
        Description of the data, and equation of motion, which affects a block's own unit.
    block : Block or None
        Block, if there is only one.
    outcomes : pandas.DataFrame or None
        All simulations: motion, block (position), polarity, the measure (SI, for example pga_m_s2), peak_rotation_rad,
        peak_over_alpha (infinite: overturned, NaN: unfinished), overturned, unfinished, whether each limit state was
        exceeded, and the weight of the block if any. None for outcomes from other sources.
    is_one_way, includes_vertical, has_several_blocks : bool
        Whether unequal sides were simulated in one polarity only, vertical motions were included, and several blocks
        are pooled.
    source : str
        Meaning of a cluster of outcomes: "motion" or "cluster".
    undecided_note, missing_note : str
        Number of outcomes in a sample that change within 3e-6 of the motion, and of abandoned (excluded) simulations,
        or empty.

    See Also
    --------
    rocking.fit_fragility : Fit curves to given outcomes.
    rocking.HazardCurve : Rates of exceeding an intensity at a site.

    Examples
    --------
    >>> from rocking import HazardCurve, fit_fragility
    >>> fitted = fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trial_counts=4, measure="pga")
    >>> risk = fitted.annual_rate(HazardCurve([0.5, 5.0], [1e-2, 1e-4]))
    >>> f"{risk.rate('overturning').probability(50.0):.4f}"
    '0.0215'
    """

    TABLES = ("curves", "outcomes")

    curves: tuple[FragilityCurve, ...]
    measure: Measure
    description: str
    block: Body | None
    model: Model
    outcomes: pd.DataFrame | None
    is_one_way: bool = False
    includes_vertical: bool = False
    has_several_blocks: bool = False
    source: str = "motion"
    undecided_note: str = ""
    missing_note: str = ""

    def summary(self) -> str:
        scale = self.measure.display_factor
        rows = [
            [
                curve.limit_state,
                f"{curve.exceedance_counts.sum():.0f} of {curve.trial_counts.sum():.0f}",
                scale * curve.median,
                format_median_interval(curve, scale),
                curve.dispersion,
                format_interval(curve.dispersion_interval, 3),
                float(f"{curve.goodness.p_value:.2g}"),
            ]
            for curve in self.curves
        ]
        heading = f"{100 * self.curves[0].confidence:g} % between"
        table = format_table(
            ["limit state", "exceeded", "median", heading, "dispersion", heading, "p-value of fit"], rows
        )
        notes = [f"note: {sentence}" for sentence in self.notes]
        return "\n".join([f"{self.description}; intensity: {self.measure.label}", "", table, *notes])

    @property
    def notes(self) -> tuple[str, ...]:
        """Limitations of the curves (small samples, poor fits, undecided outcomes), one sentence each."""
        notes = [message for message in (self.missing_note, self.undecided_note) if message]
        if self.is_one_way:
            notes.append(
                "the sides differ, and motions came in one polarity only: reversed ones give another curve; "
                + spell(Message('{} "both" counts both', ("polarity",)))
            )
        if not self.curves[0].is_bounded:
            notes.append(f"intervals and bands go from 0 to infinity: {self._few_clusters_text}")
        is_independent = self.curves[0].is_independent
        notes += [
            f"{curve.limit_state}: intervals without an end say that the data allow a curve which does not rise with "
            f"the intensity; more {'outcome' if is_independent else self.source}s are needed"
            for curve in self.curves
            if curve.is_bounded and math.isinf(curve.dispersion_interval[1])
        ]
        if not is_independent:
            reason = f"the test takes all outcomes for independent, and those of one {self.source} belong together"
            notes.append(f"no p-value of the fit: {reason}")
        elif self.curves[0].goodness.degrees_of_freedom < 1:
            notes.append("no p-value of the fit: the test needs three groups of outcomes, of five or so each")
        return tuple(notes)

    @property
    def _few_clusters_text(self) -> str:
        count = format_count(self.curves[0].cluster_count, self.source)
        return f"{count} cannot tell how far {self.source}s differ; give 3 or more"

    def to_dict(self) -> dict[str, Any]:
        return {
            "block": None if self.block is None else self.block.description,
            "description": self.description,
            "measure": {"name": self.measure.name, "units": self.measure.units, **self.measure.options()},
            "model": self.model,
            "curves": [curve.to_dict() for curve in self.curves],
            "notes": list(self.notes),
            "outcomes": None if self.outcomes is None else self.outcomes.to_dict("records"),
        }

    def _format_headline(self) -> str:
        curves = ", ".join(
            f"{curve.limit_state}: median {format_intensity(curve.median, self.measure)}, "
            f"dispersion {curve.dispersion:.3g}"
            for curve in self.curves
        )
        return f"{self.description}; {self.measure.label}; {curves}"

    def curve(self, limit_state: str) -> FragilityCurve:
        """Return the curve of a limit state."""
        curves = {curve.limit_state: curve for curve in self.curves}
        return curves[checks.choice(limit_state, "limit_state", OptionError, list(curves))]

    def annual_rate(self, hazard: HazardCurve) -> Risk:
        """Compute annual rates of exceeding the limit states from the hazard curve of a site.

        The integral of rate(x) dP(x) over all intensities x is evaluated in closed form. For a single power k it equals
        rate(median) exp((k dispersion)^2/2) (Cornell).
        """
        return compute_risk(self.curves, hazard, self.measure, self.description)

    def survival(
        self,
        years: float,
        hazard: HazardCurve | None = None,
        *,
        confidence: float = 0.95,
        limit_state: str = "overturning",
    ) -> Survival:
        """Constrain past ground motions by a limit state that was not exceeded, as by a rock that still stands.

        Parameters
        ----------
        years : float
            Time without exceedance of the limit state, years.
        hazard : HazardCurve, optional
            Annual rates of the intensities, for the probability of survival.
        confidence : float
            Probability with which stronger or more frequent motions would have exceeded the limit. It is one-sided:
            0.95 is the upper end of a two-sided interval with confidence 0.9.
        limit_state : str
            Name of the limit state.

        Returns
        -------
        Survival
            Intensity that was most likely never reached, largest annual rates, and probability of survival.

        See Also
        --------
        rocking.Fragility.annual_rate : Annual rates of exceeding the limit states.
        """
        curve = self.curve(limit_state)
        rate = None if hazard is None else self.annual_rate(hazard).rate(limit_state)
        description, has_several_blocks = self.description, self.has_several_blocks
        survival = Survival(curve, self.measure, description, years, confidence, hazard, rate, has_several_blocks)
        if hazard is None or not self.has_several_blocks or self.outcomes is None:
            return survival
        mean, error = compute_mean_survival(self.outcomes, self.measure.column, limit_state, hazard, survival.years)
        return replace(survival, mean_probability=mean, mean_error=error)

    @property
    def intensity_range(self) -> tuple[float, float]:
        """Lowest and highest intensity of the data, in SI units or a block's own."""
        intensities = np.concatenate([curve.intensity for curve in self.curves])
        return float(intensities.min()), float(intensities.max())

    def _columns(self, table: str) -> list[Column]:
        if table == "curves":
            x = np.linspace(0.0, self.intensity_range[1], _POINT_COUNT)
            values = np.hstack([[x, curve.probability(x), *curve.band(x)] for curve in self.curves])
            limit_states = np.repeat([curve.limit_state for curve in self.curves], _POINT_COUNT)
            names = ("limit_state", self.measure.column, "probability", "lower", "upper")
            return [*map(Column, names, [limit_states, *values])]
        if self.outcomes is None:
            origin = "this fragility was fitted to observed outcomes"
            raise OptionError(f"{origin}, so that there are no simulations to write")
        return [Column(str(name), self.outcomes[name]) for name in self.outcomes]

    def to_nrml(
        self,
        path: str | Path,
        *,
        taxonomy: str = "rocking-block",
        block: Body | None = None,
        model_id: str = "rocking",
        loss_category: LossCategory = "contents",
        asset_category: str = "contents",
    ) -> None:
        """Write the curves as an OpenQuake fragility model (NRML 0.5).

        Each lognormal curve is written as the mean and standard deviation of the intensity, with PGA and SA in g and
        PGV in cm/s. Intensities in units of a block are converted to its PGA or PGV. For PGA the no-damage limit is the
        uplift acceleration, unless it is lowered by a simulated vertical motion.

        Parameters
        ----------
        path : path
            Output file.
        taxonomy : str
            Identifier of the function in the exposure model.
        block : Block, optional
            Block for the unit of a dimensionless measure, for curves of several blocks.
        model_id, loss_category, asset_category : str
            Attributes of the model. The category is structural, nonstructural, contents or business_interruption.

        Raises
        ------
        OptionError
            If NRML does not allow a name, `block` is missing, the damping of a spectral acceleration is not 5 % as in
            OpenQuake, or the dispersion is too wide. `OutputError` if the file cannot be written.
        """
        if block is not None:
            gather_bodies(block)
        unit_block = self.block if block is None else block
        measure = convert_to_openquake_measure(self.measure, unit_block, self.model)
        uplift = None
        if unit_block is not None and measure[0] == "PGA" and not self.includes_vertical:
            uplift = min(unit_block.uplift_thresholds(self.model)) / STANDARD_GRAVITY
        options = {"id": model_id, "assetCategory": asset_category, "lossCategory": loss_category}
        ends = self.intensity_range
        write_text(path, format_nrml(self.curves, measure, ends, uplift, taxonomy, self.description, **options))

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import draw_fragility

        first_curve = self.curves[0]
        band_label = f"band: {100 * first_curve.confidence:g} % confidence (likelihood)"
        if not first_curve.is_bounded:
            band_label = f"no band: {self._few_clusters_text}"
        intensity = np.linspace(0.0, self.intensity_range[1], _POINT_COUNT)
        limit_state = first_curve.limit_state if len(self.curves) == 1 else "the limit state"
        verb = "" if limit_state == "overturning" else "exceeding "
        return draw_fragility(
            lines=[create_fragility_line(curve, intensity, self.measure) for curve in self.curves],
            intensity_label=self.measure.label,
            band_label=band_label,
            probability_label=f"probability of {verb}{limit_state}",
            title=title or escape_dollars(self.description),
            ax=ax,
            figsize=figsize,
        )


def fragility(
    blocks: Bodies | Body | Sequence[Body],
    motions: Motions,
    *,
    measure: IntensityName | Measure = "pga",
    levels: ArrayLike | None = None,
    limit_states: Mapping[str, float] | None = None,
    model: Model = "nonlinear",
    chattering: str | ChatteringScheme = "certified",
    friction: Friction | None = None,
    polarity: Polarity = "+",
    weights: ArrayLike | None = None,
    clusters: ArrayLike | None = None,
    larger: bool = False,
    confidence: float = 0.9,
) -> Fragility:
    """Simulate blocks under motions and fit the probability of exceedance against the intensity.

    Parameters
    ----------
    blocks : Blocks, Block, RestrainedBlock or sequence of one kind
        One block, or several with pooled outcomes, for example a weighted ensemble for one block
        (`Calibration.fragility`).
    motions : optional
        As for `simulate_many`: m motions.
    measure : str or Measure
        Intensity measure, as for `incremental_dynamic_analysis`.
    levels : array_like, optional
        Levels to which every motion is scaled (stripes). By default the motions are not scaled (cloud).
    limit_states : mapping of str to float, optional
        Limit states: ratio of peak rotation to slenderness (the smaller one of two sides), ``math.inf`` for
        overturning.
    model, chattering, friction : optional
        As for `simulate`.
    polarity : {"+", "-", "both"}
        Original motions, reversed motions, or both. With both, each motion counts twice unless all blocks are
        symmetric.
    weights : array_like, optional
        Weights of the blocks' outcomes, equal by default. Blocks of weight 0 are simulated but not used in the fit.
    clusters : "station" or array_like of labels, shape (m,), optional
        Labels of dependent motions, for intervals. By default only multiples of one another are dependent. "station"
        combines components of one station and earthquake by their file names. Components of a pair are always
        dependent.
    larger : bool
        Whether only the larger response counts: of both polarities (if simulated) and both components of each pair.
        Pairs (`records.load_pairs`) require a measure of the pair, for example ``Measure("pga", component="rotd50")``.
    confidence : float
        Probability of the intervals and bands, between 0 and 1.

    Returns
    -------
    Fragility
        Curves and all outcomes.

    Raises
    ------
    OptionError
        If an argument is out of range, or no lognormal can be fitted (`fit_fragility`). `MotionError` if a motion is
        zero throughout.

    See Also
    --------
    rocking.fit_fragility : Fit curves to given outcomes.
    rocking.incremental_dynamic_analysis : Find the levels that overturn each block.
    rocking.compare_measures : Compare the efficiency of intensity measures.

    Examples
    --------
    >>> import numpy as np, rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> motions = [rocking.pulses.one_sine(1.0, f) for f in np.linspace(0.3, 1.5, 13)]
    >>> result = fragility(block, motions, measure="pga_ratio", levels=np.linspace(1.0, 9.0, 17))
    >>> print(f"median {result.curves[0].median:.3f}, dispersion {result.curves[0].dispersion:.3f}")
    median 1.443, dispersion 0.524
    """
    bodies, measure = gather_bodies(blocks), Measure.parse(measure)
    slenderness = compute_slenderness(bodies)
    block_weights = normalise_positive_weights(weights, len(bodies))
    mirrored = checks.choice(polarity, "polarity", OptionError, get_args(Polarity)) == "both" and bodies.is_symmetric
    checks.fraction(confidence, "confidence", OptionError)
    limits = check_limit_states(limit_states)
    stripes = None if levels is None else checks.increasing_numbers(levels, "levels", OptionError)
    if stripes is not None and stripes.size < 2:
        raise OptionError(f"{{}} must contain at least two levels; got {stripes.size}", "levels", value=levels)
    motions = list_motions(motions)
    values, cluster_numbers = compute_intensities(motions, measure), assign_clusters(motions, clusters)
    units = compute_block_units(bodies, measure, model)
    options: dict[str, Any] = {"chattering": chattering, "friction": friction}
    options["polarity"] = "+" if mirrored else polarity
    if stripes is None:
        table = simulate_many(bodies, motions, model=model, **options).expand_dims("level")
        intensity = (values[:, None] / units)[None, :, :, None]
    else:
        table = simulate_levels(bodies, motions, measure, stripes, model=model, **options)
        intensity = stripes[:, None, None, None]
    table = table if "polarity" in table.dims else table.expand_dims("polarity")
    table = table.transpose("level", "motion", "block", "polarity")
    # The outcome after a loss of contact is unknown.
    has_lost_contact = table.lost_contact.values if "lost_contact" in table else np.zeros_like(table.unfinished.values)
    is_missing = table.unfinished.values | has_lost_contact
    ratio = compute_ratios(slenderness[:, None], table.peak_rotation.values, table.overturned.values, is_missing)
    x, trial_weights = (np.broadcast_to(array, ratio.shape).ravel() for array in (intensity, block_weights[:, None]))
    trial_clusters = np.broadcast_to(cluster_numbers[:, None, None], ratio.shape).ravel()
    outcomes = create_outcome_table(
        bodies, table.assign(unfinished=table.unfinished | is_missing), measure, x, ratio, limits
    )
    if weights is not None:
        outcomes["weight"] = trial_weights
    indices = np.arange(ratio.size)
    if checks.boolean(larger, "larger", OptionError):
        indices = find_larger_responses(ratio, motions, measure).ravel()
        outcomes = outcomes.iloc[indices].reset_index(drop=True)
    # Abandoned simulations and blocks of weight 0 are reported, but excluded from the fit.
    indices = indices[(trial_weights > 0.0)[indices] & ~is_missing.ravel()[indices]]
    x, trial_weights, trial_clusters = (x[indices], trial_weights[indices], trial_clusters[indices])
    curves = []
    try:
        for name, limit in limits.items():
            data = x, trial_weights * compute_exceedances(ratio, limit, name).ravel()[indices], trial_weights
            curves.append(fit_curve(name, data, trial_clusters, confidence, measure, limit))
    except FitError as error:
        error.outcomes = outcomes
        raise
    scales = 1.0 if stripes is None else measure.find_factor(stripes[:, None, None] * units, values[:, None])
    factors = np.asarray(scales)[..., None] * np.array(POLARITY_SIGNS[options["polarity"]])
    setup = Setup(bodies, model, chattering_scheme(chattering), friction=resolve_friction(friction))
    design = "cloud" if levels is None else format_count(len(intensity), "stripe")
    missing_notes = describe_missing(table.unfinished.values), _describe_lost(has_lost_contact)
    text = f"{describe_pool(blocks, weights)}, {describe_sample(cluster_numbers, clusters)}, {design}, {model} model"
    return Fragility(
        curves=tuple(curves),
        measure=measure,
        description=text
        + describe_polarities(polarity, is_symmetric=bodies.is_symmetric)
        + ", the larger response" * larger,
        block=find_single_block(blocks),
        model=model,
        outcomes=outcomes,
        is_one_way=polarity != "both" and not bodies.is_symmetric,
        includes_vertical="vertical" in table.coords,
        has_several_blocks=bool(np.count_nonzero(block_weights) > 1),
        source="motion" if clusters is None else "cluster",
        undecided_note=describe_undecided(setup, motions, factors, table.overturned.values),
        missing_note="; ".join(filter(None, missing_notes)),
    )


def _describe_lost(has_lost_contact: Flags) -> str:
    """Describe the number of simulations that end because the ground no longer presses on the block."""
    count = np.count_nonzero(has_lost_contact)
    text = f"{count} of {has_lost_contact.size} simulations ended with a loss of contact and are not counted"
    return text if count else ""


def fit_fragility(
    intensity: ArrayLike,
    exceedance_counts: ArrayLike | Mapping[str, ArrayLike],
    *,
    trial_counts: ArrayLike = 1,
    clusters: ArrayLike | None = None,
    measure: IntensityName | Measure = "pga",
    confidence: float = 0.9,
    block: Body | None = None,
    description: str = "observed outcomes",
) -> Fragility:
    """Fit a lognormal fragility to outcomes (cloud) or counts (stripes) by maximum likelihood.

    Parameters
    ----------
    intensity : array_like, shape (n,)
        Positive intensities, in SI units.
    exceedance_counts : array_like, shape (n,), or mapping of str to array_like
        Whether the limit (default: "overturning") was exceeded, or in how many trials. A mapping contains several limit
        states.
    trial_counts : array_like
        Number of trials at each intensity.
    clusters : array_like of labels, shape (n,), optional
        Labels of dependent outcomes (for example of one motion), for the bands. By default, and for labels NaN, None or
        empty, outcomes are independent. Fewer than three clusters of several outcomes have no finite bounds.
    measure, confidence : optional
        As for `fragility`.
    block : Block, optional
        Tested block, for the units of `Fragility.to_nrml`.
    description : str
        Description of the observations.

    Returns
    -------
    Fragility
        Curve of each limit state.

    Raises
    ------
    OptionError
        If an argument is out of range, or no rising lognormal fits best: all outcomes are equal, separated, at one
        intensity, or not more frequent at higher ones, or the median is above 1000 times every intensity.

    See Also
    --------
    rocking.fragility : Simulate the outcomes and fit the curves.

    Notes
    -----
    The likelihood of P = Phi(ln(x/median)/dispersion) assumes independent binomial counts :cite:p:`baker2015`.

    References
    ----------
    Baker, J. W. (2015). Efficient analytical fragility function fitting using dynamic structural analysis. Earthquake
    Spectra 31(1), 579-599.

    Examples
    --------
    >>> curve = fit_fragility([2.0, 3.0, 4.0, 5.0], [1, 4, 7, 10], trial_counts=10).curves[0]
    >>> print(f"median {curve.median:.4f} m/s^2, dispersion {curve.dispersion:.4f}")
    median 3.1509 m/s^2, dispersion 0.3042
    """
    measure = Measure.parse(measure)
    x = checks.positive_numbers(intensity, "intensity", OptionError)
    for end in (x.min(), x.max()):
        checks.between(float(end), "intensity", OptionError, 1e-50, 1e50)
    counts = check_counts(trial_counts, "trial_counts", x.size, 1.0, 2.0**53)
    by_state = exceedance_counts if isinstance(exceedance_counts, Mapping) else {"overturning": exceedance_counts}
    groups = None if clusters is None else assign_groups(clusters, "clusters", x.size)
    checks.fraction(confidence, "confidence", OptionError)
    curves = []
    for name, values in check_state_mapping(by_state, "exceedance_counts").items():
        data = x, check_counts(values, "exceedance_counts", x.size, 0.0, counts), counts
        curves.append(fit_curve(name, data, groups, confidence, measure))
    return Fragility(tuple(curves), measure, description, block, "nonlinear", None, source="cluster")
