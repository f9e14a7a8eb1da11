"""Results of a calibration from outcomes, and their predictions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence, Sized
from dataclasses import asdict, astuple, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.analysis.fragility import Fragility, fragility
from rocking.analysis.levels import assign_groups, note_missing
from rocking.analysis.spectrum import RockingSpectrum, rocking_spectrum
from rocking.block import Blocks
from rocking.block.body import Bodies
from rocking.calibration.diagnostics import Diagnostics, Scores, diagnose
from rocking.calibration.search import (
    Evidence,
    Problem,
    estimate_share,
    include_outliers,
    resample,
    sample_posterior,
    search,
    split_populations,
)
from rocking.calibration.space import SIDED_PARAMETER, Space, ValueOrBounds, find_parameter_unit
from rocking.core import checks
from rocking.core.arrays import Flags, Floats
from rocking.core.constants import Model
from rocking.core.result import Result
from rocking.core.tables import Column, escape_dollars, format_count, format_table
from rocking.errors import OptionError
from rocking.motion.motion import Motion
from rocking.records.named import Motions, list_motions
from rocking.simulation.ensemble import simulate_many

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rocking.plot.curves import ParameterEstimate

#: Rounds of moves of draws from the posterior over populations, and draws for a fit without a fold.
MOVE_ROUND_COUNT: Final = 4
DRAW_COUNT: Final = 256


@dataclass(frozen=True)
class Estimate:
    """Parameter of the population of blocks.

    Attributes
    ----------
    median, lower, upper : float
        Median and central 90 % interval of the population's centre, in the parameter's unit.
    dispersion : float
        Standard deviation of the parameter's logarithm from test to test.

    See Also
    --------
    rocking.calibrate : Fit blocks to the outcomes of tests.
    rocking.Calibration : Inspect the estimates of all parameters.

    Examples
    --------
    >>> from rocking.calibration import Estimate
    >>> alpha = Estimate(median=0.2, lower=0.18, upper=0.23, dispersion=0.1)
    >>> f"alpha = {alpha.median} rad, 90 % interval {alpha.lower} to {alpha.upper} rad"
    'alpha = 0.2 rad, 90 % interval 0.18 to 0.23 rad'
    """

    median: float
    lower: float
    upper: float
    dispersion: float


@dataclass(frozen=True, eq=False)
class Validation:
    """Predictions of tests that were left out of the fit.

    Attributes
    ----------
    probabilities : ndarray, shape (repeats, m)
        Probability of overturning in each test, from the fit to the other folds.
    scores_by_repeat : tuple of Scores
        Scores of each repeat.

    See Also
    --------
    rocking.validate : Compute standard errors and the reliability diagram of the predictions.

    Examples
    --------
    >>> import numpy as np
    >>> from rocking.calibration import Scores, Validation
    >>> scores = Scores.from_predictions([0.9, 0.2, 0.6], [True, False, False])
    >>> Validation(np.array([[0.9, 0.2, 0.6]]), (scores,))
    <Validation: 3 tests, each left out once: accuracy 66.7 %, log loss 0.415, Brier score 0.137>
    """

    probabilities: Floats
    scores_by_repeat: tuple[Scores, ...]

    def __repr__(self) -> str:
        repeat_count, test_count = self.probabilities.shape
        times = "once" if repeat_count == 1 else f"{repeat_count} times"
        return f"<Validation: {format_count(test_count, 'test')}, each left out {times}: {self.scores}>"

    @property
    def scores(self) -> Scores:
        """Mean scores of the repeats."""
        return Scores(*np.mean([astuple(scores) for scores in self.scores_by_repeat], axis=0).tolist())


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Result):
    """Ensemble of blocks fitted to the outcomes of tests, returned by `calibrate`.

    The table "ensemble" contains parameters of both sides, weight, and equation of motion of each block. Commands such
    as `rocking fragility --ensemble` read this table. The figure shows the ensemble, and outcomes against fitted
    probabilities.

    Attributes
    ----------
    blocks : Blocks
        Ensemble of n plausible blocks.
    weights : ndarray, shape (n,)
        Weights of the blocks, with sum 1.
    estimates : mapping of str to Estimate
        Parameters of the population: "p" (rad/s), "restitution", and "alpha" (rad), or for a two-sided block
        "alpha_plus" and "alpha_minus".
    draws : mapping of str to ndarray, shape (d,)
        Posterior draws of the population's centre, by the same names.
    probabilities, observed : ndarray, shape (m,)
        Fitted probability of overturning under each motion, and observed outcome (bool).
    model, outlier_probability, seed : str, float, int
        As for `calibrate`.
    diagnostics : Diagnostics
        Effective candidates, agreement of runs, and bounds reached. Its `notes` are part of the summary.

    See Also
    --------
    rocking.calibrate : Fit blocks to the outcomes of tests.
    rocking.validate : Compare predictions with tests.

    Examples
    --------
    >>> import rocking
    >>> pulses = [rocking.pulses.one_sine(amplitude, 1.0) for amplitude in (2.0, 5.0)]
    >>> fitted = rocking.calibrate(pulses, [0, 1], p=2.0, restitution=0.9, two_sided=False, candidate_count=128)
    >>> list(fitted.estimates), f"{fitted.weights.sum():.2f}"
    (['alpha'], '1.00')
    """

    TABLES = ("ensemble",)

    blocks: Blocks
    weights: Floats
    estimates: Mapping[str, Estimate]
    draws: Mapping[str, Floats]
    probabilities: Floats
    observed: Flags
    model: Model
    outlier_probability: float
    seed: int
    diagnostics: Diagnostics
    _evidence: Evidence = field(init=False)

    @property
    def scores(self) -> Scores:
        """Scores on the calibration's own motions, which are optimistic (see `cross_validate`)."""
        return Scores.from_predictions(self.probabilities, self.observed)

    def predict(self, motions: Motions) -> Floats:
        """Compute the probability of overturning under m motions, shape (m,).

        The weighted share of the ensemble that overturns is bounded away from 0 and 1 by the outlier_probability.
        """
        if isinstance(motions, Sized) and not isinstance(motions, Motion) and not len(motions):
            return np.empty(0)
        overturned = simulate_outcomes(self.blocks, motions, self.model)
        return compute_probabilities(
            self.weights @ overturned, self.diagnostics.effective_count, self.outlier_probability
        )

    def cross_validate(
        self, *, groups: Sequence[object] | None = None, fold_count: int = 10, repeat_count: int = 1, seed: int = 0
    ) -> Validation:
        """Predict every test from fits without it.

        Parameters
        ----------
        groups : sequence, optional
            Labels of the motions. Tests with one label, such as scaled versions of one source motion, are left out
            together.
        fold_count, repeat_count : int
            Number of parts, and of random divisions into parts.
        seed : int
            Seed of the divisions.

        Returns
        -------
        Validation
            Probabilities of all tests in each division, and their scores.

        Raises
        ------
        OptionError
            If there are fewer groups than folds, or the labels do not match the motions.
        """
        labels = label_groups(groups, len(self.observed), fold_count)
        rng = np.random.default_rng(checks.integer(seed, "seed", OptionError, 0))
        evidence = replace(self._evidence)
        probabilities = np.empty((checks.integer(repeat_count, "repeat_count", OptionError, 1), len(self.observed)))
        for row in probabilities:
            fold_numbers = rng.permutation(np.arange(labels.max() + 1) % fold_count)[labels]
            for fold in range(fold_count):
                is_left_out = fold_numbers == fold
                fitted, predicted = evidence.select_tests(~is_left_out), evidence.select_tests(is_left_out)
                populations = sample_posterior(fitted, DRAW_COUNT, MOVE_ROUND_COUNT, rng)
                row[is_left_out] = predicted.probabilities(populations).mean(axis=0)
        return Validation(probabilities, tuple(Scores.from_predictions(row, self.observed) for row in probabilities))

    def fragility(self, motions: Motions, *, model: Model | None = None, **options: Any) -> Fragility:
        """Compute the specimen's fragility with `rocking.fragility`, for the ensemble and by default in its model.

        The uncertainty of the block and its dispersion between tests widen the curve. The band represents the motions.
        The outlier probability of `predict` is ignored, because a motion too weak for uplift does not overturn it.
        """
        return fragility(self.blocks, motions, weights=self.weights, model=model or self.model, **options)

    def spectrum(self, motions: Motions, *, model: Model | None = None, **options: Any) -> RockingSpectrum:
        """Compute peak rotations of the specimen and of similar blocks of other sizes with `rocking.rocking_spectrum`.

        The ensemble's median is moved to each p, by default from half to twice its value, in the calibrated model.
        Fractiles combine the motions and the weights of the ensemble.
        """
        return rocking_spectrum(self.blocks, motions, weights=self.weights, model=model or self.model, **options)

    def _format_headline(self) -> str:
        overturned = int(self.observed.sum())
        return f"{format_count(len(self.observed), 'motion')}, {overturned} overturned the specimen; {self.model} model"

    def summary(self) -> str:
        rows = [
            [name, fit.median, fit.lower, fit.upper, f"{100 * fit.dispersion:.0f} %", find_parameter_unit(name)]
            for name, fit in self.estimates.items()
        ]
        size = 1.0 / float((self.weights**2).sum())
        table = format_table(["parameter", "median", "5 %", "95 %", "dispersion", "unit"], rows)
        ensemble = f"ensemble of {format_count(len(self.blocks), 'block')}, equivalent to {size:.0f} of equal weight"
        return f"{self._format_headline()}\n\n{table}\n\n{ensemble}\nfitted motions: {self.scores}\n{self.diagnostics}"

    def to_dict(self) -> dict[str, Any]:
        bounds_reached = [asdict(entry) for entry in self.diagnostics.bounds_reached]
        notes = {"bounds_reached": bounds_reached, "notes": [*self.diagnostics.notes]}
        return {
            "model": self.model,
            "motions": len(self.observed),
            "overturned": int(self.observed.sum()),
            "estimates": {name: asdict(entry) for name, entry in self.estimates.items()},
            "fitted": asdict(self.scores),
            "diagnostics": asdict(self.diagnostics) | notes,
            "probabilities": self.probabilities,
        }

    def _columns(self, table: str) -> list[Column]:
        columns = [
            Column(f"{name}_{side}", values[:, k], unit)
            for name, (values, unit) in self.blocks.parameters().items()
            for k, side in enumerate(("plus", "minus"))
        ]
        return [*columns, Column("weight", self.weights), Column("model", [self.model] * len(self.weights))]

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import draw_outcomes

        return draw_outcomes(
            probabilities=self.probabilities,
            overturned=self.observed,
            parameters=[self._create_parameter(name) for name in self._evidence.candidates.space.unknown],
            weights=self.weights,
            title=title or escape_dollars(self._format_headline()),
            ax=ax,
            figsize=figsize,
        )

    def _create_parameter(self, name: str) -> ParameterEstimate:
        """Create a parameter for a figure, for both sides if they may differ."""
        from rocking.plot.curves import ParameterEstimate

        estimates = [estimate for key, estimate in self.estimates.items() if key.partition("_")[0] == name]
        values = getattr(self.blocks, name)[:, : len(estimates)]
        ends = np.array([(estimate.median, estimate.lower, estimate.upper) for estimate in estimates])
        space = self._evidence.candidates.space
        low, high = (float(np.exp(end[space.unknown.index(name)])) for end in (space.lower, space.upper))
        return ParameterEstimate({"p": "p (rad/s)", "alpha": "alpha (rad)"}.get(name, name), values, ends, (low, high))

    def __repr__(self) -> str:
        return f"<Calibration: {self._format_headline()}; fitted: {self.scores}>"


def simulate_outcomes(blocks: Bodies, motions: Motions, model: Model) -> NDArray[np.float32]:
    """Return 1 for overturning, 0 for none, 0.5 for an abandoned simulation, shape (n, m)."""
    simulated = simulate_many(blocks, motions, model=model)
    note_missing(simulated.unfinished.values)
    outcomes = simulated.overturned.astype(np.float32).where(~simulated.unfinished, np.float32(0.5))
    return np.asarray(outcomes.transpose("block", "motion").values, dtype=np.float32)


def compute_probabilities(share: Floats, effective_count: float, outlier_probability: float) -> Floats:
    """Compute probabilities of recorded outcomes from a share of effective blocks, certain for a known block."""
    expected = share if math.isinf(effective_count) else estimate_share(share, effective_count)
    # Rounding can make a sum of weights exceed 1.
    return np.clip(include_outliers(expected, outlier_probability), 0.0, 1.0)


def label_groups(groups: Sequence[object] | None, test_count: int, fold_count: int) -> NDArray[np.int64]:
    """Assign a group number, from 0, to each motion. By default each motion is a group."""
    labels = assign_groups(range(test_count) if groups is None else groups, "groups", test_count)
    checks.integer(fold_count, "fold_count", OptionError, 2, int(labels.max()) + 1)
    return labels


def calibrate(
    motions: Sequence[Motion] | Mapping[str, Motion],
    overturned: ArrayLike,
    *,
    model: Model = "nonlinear",
    p: ValueOrBounds = (1.0, 10.0),
    alpha: ValueOrBounds = (0.02, 0.6),
    restitution: ValueOrBounds = (0.3, 0.999),
    two_sided: bool = True,
    outlier_probability: float = 0.005,
    candidate_count: int = 8192,
    max_blocks: int = 1000,
    seed: int = 0,
) -> Calibration:
    """Fit blocks to the outcomes (overturned or not) of a specimen under several motions.

    Parameters
    ----------
    motions : sequence of Motion or mapping of str to Motion
        m motions, each applied to the specimen at rest.
    overturned : array_like of bool, shape (m,)
        Whether the specimen overturned.
    model : {"nonlinear", "linear"}
        Equation of motion. The linear model is faster and suitable for slender specimens.
    p, alpha, restitution : float or pair of float
        Known value on both sides in every test (a number, or a pair of equal numbers), or lowest and highest plausible
        value on either side (rad/s, rad, -) with a log-uniform prior. A body of known size has p =
        ``Block(width=..., height=...).p``. The restitution "housner" is computed from the slenderness as 1 - 1.5
        sin(alpha)^2 :cite:p:`housner1963`. For two sides it comes from a rectangle with an eccentric centre of mass and
        these slendernesses, and p is the rectangle's.
    two_sided : bool
        Whether the slendernesses of the two sides may differ, by a factor of at most 3. By default they may, unlike in
        `calibrate_history`, because few specimens are symmetric and outcomes alone would not reveal this.
    outlier_probability : float
        Probability that an outcome does not come from a rocking block.
    candidate_count : int
        Approximate number of blocks simulated under every distinct motion, up to twice as many if runs disagree or few
        represent a typical population.
    max_blocks : int
        Largest number of blocks for predictions.
    seed : int
        Seed of the random draws.

    Returns
    -------
    Calibration
        Weighted ensemble of blocks, estimates, and predictions for other motions.

    Raises
    ------
    OptionError
        If an argument is out of range, all parameters are known, the numbers of motions and outcomes differ, or all
        outcomes are equal (these bound the block from one side only).

    See Also
    --------
    rocking.calibrate_history : Fit a block to a rotation history.
    rocking.read_tests : read tests from a table.
    rocking.validate : Compare predictions with tests.

    Notes
    -----
    The block of each test is drawn from a population that is lognormal in p, alpha, restitution and the ratio of the
    slendernesses. The posterior over populations is sampled by sequential Monte Carlo
    :cite:p:`delmoral2006`, with a lognormal prior on each dispersion (median 10 %). Two independent runs fill the
    bounds evenly, then add blocks near their own best fits. Weights inverse to the density of candidates preserve the
    prior (deterministic mixture, :cite:t:`owen2000`).

    Two mirrored blocks often explain the outcomes equally well. The estimates of each side are then wide, but the
    predictions are not.

    Examples
    --------
    >>> import rocking
    >>> pulses = [rocking.pulses.one_sine(a, 1.0) for a in (2.0, 3.0, 4.0, 5.0)]
    >>> calibration = calibrate(pulses, [0, 0, 1, 1], p=2.0, restitution=0.9, two_sided=False, candidate_count=128)
    >>> bool(calibration.predict(rocking.pulses.one_sine(9.0, 1.0))[0] > 0.5)
    True
    """
    motion_list = list_motions(motions)
    observed = check_outcomes(overturned, len(motion_list))
    space = Space.from_bounds(p, alpha, restitution, two_sided=checks.boolean(two_sided, "two_sided", OptionError))
    checks.fraction(outlier_probability, "outlier_probability", OptionError, below=0.5)
    checks.integer(candidate_count, "candidate_count", OptionError, 128)
    checks.integer(max_blocks, "max_blocks", OptionError, 1)
    rng = np.random.default_rng(checks.integer(seed, "seed", OptionError, 0))
    distinct, motion_indices = find_distinct_motions(motion_list)

    def simulate_points(points: Floats) -> NDArray[np.float32]:
        return np.take(simulate_outcomes(space.blocks(points), distinct, model), motion_indices, axis=1)

    result = search(Problem(space, observed, outlier_probability, simulate_points), candidate_count, rng)
    evidence = result.evidence
    populations = sample_posterior(evidence, 2 * DRAW_COUNT, MOVE_ROUND_COUNT, rng)
    weights = evidence.mean_weights(populations)
    selected, counts = np.unique(resample(weights, max_blocks, rng), return_counts=True)
    calibration = Calibration(
        blocks=space.blocks(evidence.candidates.points[selected]),
        weights=counts / max_blocks,
        estimates=_compute_estimates(space, populations),
        draws=space.parameters_by_name(split_populations(populations)[0]),
        probabilities=evidence.probabilities(populations).mean(axis=0),
        observed=observed,
        model=model,
        outlier_probability=outlier_probability,
        seed=seed,
        diagnostics=diagnose(result, populations),
    )
    object.__setattr__(calibration, "_evidence", evidence)
    return calibration


def _compute_estimates(space: Space, populations: Floats) -> dict[str, Estimate]:
    centres, dispersions = split_populations(populations)
    sides = dispersions[:, : len(space.unknown)].copy()
    if space.is_two_sided:
        # The mean's logarithm plus or minus half the ratio's.
        sided = space.unknown.index(SIDED_PARAMETER)
        sides[:, sided] = np.hypot(sides[:, sided], 0.5 * dispersions[:, -1])
    dispersion = dict(zip(space.unknown, sides.mean(axis=0).tolist(), strict=True))
    central = 0.9  # posterior share between the lower and upper end of an estimate
    probabilities = (0.5, 0.5 * (1.0 - central), 0.5 * (1.0 + central))
    estimates = {}
    for name, values in space.parameters_by_name(centres).items():
        median, lower, upper = np.quantile(values, probabilities).tolist()
        estimates[name] = Estimate(median, lower, upper, dispersion[name.partition("_")[0]])
    return estimates


def check_outcomes(overturned: ArrayLike, count: int) -> Flags:
    """Check that there is an outcome for each motion and not all are equal; return a read-only array."""
    if np.ma.is_masked(overturned):
        raise OptionError("{} must not be masked; provide an outcome for each motion", "overturned", value=overturned)
    values = np.asarray(overturned)
    if values.shape != (count,):
        message = f"{{}} must contain one outcome for each of the {count} motions; got shape {values.shape}"
        raise OptionError(message, "overturned", value=overturned)
    if not np.all(np.isin(values, (0, 1))):
        raise OptionError("{} must contain True or False (or 1 or 0) for each motion", "overturned")
    observed = values.astype(bool)
    if observed.all() or not observed.any():
        requirement = "a calibration requires motions that overturn the block and motions that do not"
        raise OptionError(f"all outcomes are equal; {requirement}")
    observed.flags.writeable = False
    return observed


def find_distinct_motions(motions: Sequence[Motion]) -> tuple[list[Motion], list[int]]:
    """Return distinct motions, and the index of each motion among them."""
    distinct_motions: dict[tuple[bytes, ...], Motion] = {}
    keys = []
    for motion in motions:
        parts = [part for part in (motion, motion.vertical) if part is not None]
        keys.append(tuple(values.tobytes() for part in parts for values in (part.breakpoints, part.coefficients)))
        distinct_motions.setdefault(keys[-1], motion)
    indices = {key: index for index, key in enumerate(distinct_motions)}
    return [*distinct_motions.values()], [indices[key] for key in keys]
