"""Comparison of predictions with shake-table tests: scores and reliability."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.levels import assign_numbers, describe_pool, normalise_weights
from rocking.block.body import Bodies, Body
from rocking.calibration.diagnostics import Scores, compute_log_losses
from rocking.calibration.outcomes import (
    Calibration,
    Validation,
    compute_probabilities,
    find_distinct_motions,
    simulate_outcomes,
)
from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.constants import Model
from rocking.core.result import Result
from rocking.core.tables import Column, escape_dollars, format_count, format_table, records_to_columns
from rocking.engine.problem import compute_slenderness, gather_bodies
from rocking.errors import MotionError, OptionError
from rocking.motion.motion import Motion
from rocking.records.named import check_motion, make_names_unique

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Sources of predictions.
Source = Calibration | Validation | Bodies | Body | Sequence[Body]


@dataclass(frozen=True)
class ShakeTest:
    """Test of a specimen at rest: applied motion and observed outcome.

    Parameters
    ----------
    motion : Motion
        Motion of the base of the specimen, preferably measured, otherwise commanded.
    overturned : bool
        Whether the specimen overturned.
    name : str
        Name of the test, by default of the motion.
    group : str
        Label of tests that belong together, such as tests with one command or source motion. Standard errors allow for
        groups. By default tests under one motion form a group.

    See Also
    --------
    rocking.read_tests : read tests from a table.
    rocking.validate : Compare predictions with tests.

    Examples
    --------
    >>> import rocking
    >>> ShakeTest(rocking.pulses.one_sine(3.0, 1.0), False, name="first")
    <ShakeTest: first, stood>
    """

    motion: Motion
    overturned: bool
    name: str = ""
    group: str = ""

    def __post_init__(self) -> None:
        motion, outcome = check_motion(self.motion), self.overturned
        if motion is None:
            raise MotionError("a test requires the {} of the base; got None", "motion")
        for label in ("name", "group"):
            checks.text(getattr(self, label), label, OptionError)
        if not isinstance(outcome, (bool, int, np.bool_, np.integer)) or outcome not in (0, 1):
            message = f"{{}} must be True or False, not {checks.short_repr(outcome)}"
            raise OptionError(message, "overturned", value=outcome)
        object.__setattr__(self, "overturned", bool(outcome))
        object.__setattr__(self, "name", self.name or motion.name)

    def __repr__(self) -> str:
        return f"<ShakeTest: {self.name}, {'overturned' if self.overturned else 'stood'}>"


@dataclass(frozen=True)
class PredictedTest:
    """Prediction and observed outcome of one test.

    Attributes
    ----------
    name, motion : str
        Names of the test and of the motion.
    overturned : bool
        Whether the specimen overturned.
    probability : float
        Predicted probability of overturning.

    See Also
    --------
    rocking.validate : Compare predictions with tests.
    rocking.ShakeTest : Create a test with its observed outcome.

    Examples
    --------
    >>> import rocking
    >>> pulses = [rocking.pulses.one_sine(a, 1.0) for a in (1.0, 2.0, 3.0, 4.0)]
    >>> tests = [rocking.ShakeTest(pulse, a) for pulse, a in zip(pulses, (False, False, True, True))]
    >>> result = rocking.validate(tests, rocking.Block.from_parameters(3.0, 0.15, 0.9))
    >>> [(test.probability, test.overturned) for test in result.tests]
    [(0.0, False), (1.0, False), (1.0, True), (1.0, True)]
    """

    name: str
    motion: str
    overturned: bool
    probability: float


@dataclass(frozen=True)
class MeanScore:
    """Mean score of predictions (smaller is better) and its standard error.

    Attributes
    ----------
    value, error : float
        Mean over the tests and its standard error, which is NaN for a single cluster or an infinite score.
    skill, skill_error : float
        1 minus the ratio of the score to the base rate's score on the same tests, and its standard error. The skill is
        1 for perfect predictions, 0 for the base rate, and NaN if the base rate is perfect.
    test_count, cluster_count : int
        Number of tests, and of clusters of tests that belong together.

    See Also
    --------
    rocking.validate : Compare predictions with tests.
    rocking.calibration.ModelValidation : Inspect the scores of the predictions.

    Examples
    --------
    >>> import rocking
    >>> pulses = [rocking.pulses.one_sine(a, 1.0) for a in (1.0, 2.0, 3.0, 4.0)]
    >>> tests = [rocking.ShakeTest(pulse, a) for pulse, a in zip(pulses, (False, False, True, True))]
    >>> result = rocking.validate(tests, rocking.Block.from_parameters(3.0, 0.15, 0.9))
    >>> result.brier.value, result.brier.test_count
    (0.25, 4)
    """

    value: float
    error: float
    skill: float
    skill_error: float
    test_count: int
    cluster_count: int


@dataclass(frozen=True)
class ReliabilityBin:
    """Observed share of overturning in a bin, and its consistency band.

    Attributes
    ----------
    lower, upper : float
        Ends of the bin.
    test_count : int
        Number of tests in the bin.
    predicted, observed : float
        Predicted and observed shares that overturn.
    band_lower, band_upper : float
        Ends of the central 90 % of the shares in simulations from the predictions :cite:p:`broecker2007`.

    See Also
    --------
    rocking.validate : Compare predictions with tests.
    rocking.calibration.ModelValidation : Inspect the reliability of the predictions.

    Examples
    --------
    >>> import rocking
    >>> pulses = [rocking.pulses.one_sine(a, 1.0) for a in (1.0, 2.0, 3.0, 4.0)]
    >>> tests = [rocking.ShakeTest(pulse, a) for pulse, a in zip(pulses, (False, False, True, True))]
    >>> result = rocking.validate(tests, rocking.Block.from_parameters(3.0, 0.15, 0.9))
    >>> [(share.test_count, round(share.observed, 2)) for share in result.reliability]
    [(1, 0.0), (3, 0.67)]
    """

    lower: float
    upper: float
    test_count: int
    predicted: float
    observed: float
    band_lower: float
    band_upper: float


@dataclass(frozen=True, eq=False, repr=False)
class ModelValidation(Result):
    """Comparison of predictions with tests, returned by `validate`.

    The table has a row for each test. The figure is the reliability diagram with consistency bands.

    Attributes
    ----------
    tests : tuple of PredictedTest
        Predictions and observations.
    brier, log_loss : MeanScore
        Mean squared difference between probability and outcome; mean of -log of the outcome's probability.
    reliability : tuple of ReliabilityBin
        Shares that overturned, in the nonempty bins of the predicted probability.
    reliability_p_value : float
        Probability, if the predictions are correct, of a reliability term of the Brier score at least this large.
    description, model : str
        Source of the predictions, and equation of motion.

    See Also
    --------
    rocking.validate : Compare predictions with tests.

    Examples
    --------
    >>> import rocking
    >>> pulses = [rocking.pulses.one_sine(a, 1.0) for a in (1.0, 2.0, 3.0, 4.0)]
    >>> tests = [rocking.ShakeTest(pulse, a) for pulse, a in zip(pulses, (False, False, True, True))]
    >>> result = rocking.validate(tests, rocking.Block.from_parameters(3.0, 0.15, 0.9))
    >>> f"Brier score {result.brier.value:.2f}"
    'Brier score 0.25'
    """

    TABLES = ("tests",)

    tests: tuple[PredictedTest, ...]
    brier: MeanScore
    log_loss: MeanScore
    reliability: tuple[ReliabilityBin, ...]
    reliability_p_value: float
    description: str
    model: str

    @property
    def scores(self) -> Scores:
        """Accuracy, log loss and Brier score, as for a calibration."""
        outcomes = [(test.probability, test.overturned) for test in self.tests]
        return Scores.from_predictions(*zip(*outcomes, strict=True))

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings about the scores, one sentence each."""
        notes = []
        overturned_count = sum(test.overturned for test in self.tests)
        if overturned_count in (0, len(self.tests)):
            tests = "all tests" if overturned_count else "no test"
            notes.append(f"{tests} overturned the specimen: the base rate is perfect, so that the skill is undefined")
        if self.brier.cluster_count < 10:
            cluster_text = format_count(self.brier.cluster_count, "cluster")
            notes.append(f"the tests belong to {cluster_text} only: standard errors are rough")
        if math.isinf(self.log_loss.value):
            reason = "because a certain prediction failed"
            notes.append(f"the log loss is infinite {reason}: include the uncertainty of the specimen")
        return tuple(notes)

    def _format_headline(self) -> str:
        overturned_count = sum(test.overturned for test in self.tests)
        model_text = f", {self.model} model" if self.model else ""
        return f"{self.description}{model_text}: {format_count(len(self.tests), 'test')}, {overturned_count} overturned"

    def summary(self) -> str:
        scores = [
            [name, *_format_with_error(score.value, score.error), *_format_with_error(score.skill, score.skill_error)]
            for name, score in (("Brier", self.brier), ("log loss", self.log_loss))
        ]
        negation = "not " if self.reliability_p_value < 0.05 else ""
        reliability = f"{negation}as if the predictions were right (p = {self.reliability_p_value:.2g})"
        table = format_table(["score", "mean", "+-", "skill", "+-"], scores)
        notes = (f"note: {sentence}" for sentence in self.notes)
        return "\n".join([self._format_headline(), "", table, "", f"reliability: {reliability}", *notes])

    def to_dict(self) -> dict[str, Any]:
        return asdict(self) | {"notes": [*self.notes]}

    def _columns(self, table: str) -> list[Column]:
        return records_to_columns([asdict(test) for test in self.tests], {})

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import draw_reliability

        columns = ("predicted", "observed", "band_lower", "band_upper")
        return draw_reliability(
            **{name: np.array([getattr(row, name) for row in self.reliability]) for name in columns},
            title=title or escape_dollars(self._format_headline()),
            ax=ax,
            figsize=figsize,
        )


def validate(
    tests: Sequence[ShakeTest],
    blocks: Source,
    *,
    weights: ArrayLike | None = None,
    model: Model | None = None,
    outlier_probability: float | None = None,
    bin_count: int = 10,
    simulation_count: int = 2000,
    seed: int = 0,
) -> ModelValidation:
    """Compare the predictions of blocks with the outcomes of tests.

    Parameters
    ----------
    tests : sequence of ShakeTest
        m tests, for example from `read_tests`.
    blocks : Block, Blocks, RestrainedBlock, sequence of one kind, Calibration or Validation
        Known block, n draws of a block that is uncertain or varies between tests, calibration, or result of its
        `cross_validate` on the same tests in the same order.
    weights : array_like, optional
        Weights of several blocks, equal by default.
    model : {"nonlinear", "linear"}, optional
        Equation of motion, by default the model of a calibration, otherwise nonlinear.
    outlier_probability : float, optional
        Probability that an outcome does not come from a rocking block, by default from a calibration, otherwise 0.
    bin_count : int
        Number of bins of the reliability diagram, of equal width.
    simulation_count, seed : int
        Number of independent draws from the predictions for the bands and `reliability_p_value`, and their seed.

    Returns
    -------
    ModelValidation
        Scores with standard errors, reliability diagram, and individual tests.

    Raises
    ------
    OptionError
        If an argument is out of range, or there are no tests.

    See Also
    --------
    rocking.read_tests : read tests from a table.
    rocking.calibrate : Fit blocks to the outcomes of tests.

    Notes
    -----
    The share of n blocks that overturn is uncertain, so the probability is its mean under Jeffreys' prior, except for a
    known block. Standard errors come from a jackknife over clusters: tests of one group, or else of one motion. The
    base rate of the skill comes from the same tests, which favours the base rate.

    References
    ----------
    Gneiting, T. and Raftery, A. E. (2007). Strictly proper scoring rules, prediction, and estimation. Journal of the
    American Statistical Association 102, 359-378.

    Broecker, J. and Smith, L. A. (2007). Increasing the reliability of reliability diagrams. Weather and Forecasting
    22, 651-661.

    Examples
    --------
    >>> import rocking
    >>> pulses = [rocking.pulses.one_sine(a, 1.0) for a in (1.0, 2.0, 3.0, 4.0)]
    >>> tests = [rocking.ShakeTest(pulse, a) for pulse, a in zip(pulses, (False, False, True, True))]
    >>> rocking.validate(tests, rocking.Block.from_parameters(3.0, 0.15, 0.9)).brier.value
    0.25
    """
    items = checks.items(tests, "tests", OptionError)
    if not items:
        raise OptionError("{} must contain at least one test", "tests", value=tests)
    for test in items:
        if not isinstance(test, ShakeTest):
            message = f"{{}} must contain ShakeTest(motion, overturned); got {checks.short_repr(test)}"
            raise OptionError(message, "tests", value=test)
    checks.integer(bin_count, "bin_count", OptionError, 1, 1000)
    checks.integer(simulation_count, "simulation_count", OptionError, 100)
    rng = np.random.default_rng(checks.integer(seed, "seed", OptionError, 0))
    if outlier_probability is not None:
        checks.between(outlier_probability, "outlier_probability", OptionError, 0.0, 0.5)
    distinct_motions, indices = find_distinct_motions([test.motion for test in items])
    observed = np.array([test.overturned for test in items], dtype=bool)
    labels = [test.group or k for test, k in zip(items, indices, strict=True)]
    clusters = assign_numbers(labels)
    description, model_name = "predictions of tests that were left out", ""
    if isinstance(blocks, Validation):
        probabilities = _average_left_out(blocks, len(items), weights, outlier_probability)
    else:
        if isinstance(blocks, Calibration):
            if weights is not None:
                raise OptionError("a calibration contains its own {}: omit the argument", "weights")
            description, model_name = f"calibration, {format_count(len(blocks.blocks), 'block')}", model or blocks.model
            bodies: Bodies = blocks.blocks
            shares, effective_count = blocks.weights / blocks.weights.sum(), blocks.diagnostics.effective_count
            outlier_probability = blocks.outlier_probability if outlier_probability is None else outlier_probability
        else:
            description, model_name = describe_pool(blocks, weights), model or "nonlinear"
            bodies = gather_bodies(blocks)
            compute_slenderness(bodies)  # checked before the simulations
            shares = normalise_weights(weights, len(bodies)) / len(bodies)
            effective_count = math.inf if len(bodies) == 1 else 1.0 / float((shares**2).sum())
        overturned = simulate_outcomes(bodies, distinct_motions, model_name)
        probabilities = compute_probabilities(shares @ overturned, effective_count, outlier_probability or 0.0)[indices]
    outcomes = rng.random((simulation_count, len(items))) < probabilities
    bin_indices = np.minimum((probabilities * bin_count).astype(np.int64), bin_count - 1)
    reliability_terms = compute_miscalibration(probabilities, np.vstack([observed, outcomes]), bin_indices)
    # Summation order changes the last digits.
    larger_count = np.count_nonzero(reliability_terms[1:] >= reliability_terms[0] - 1e-9 * abs(reliability_terms[0]))
    rows = zip(make_names_unique([test.name for test in items]), items, probabilities.tolist(), strict=True)
    reliability = []
    for k in np.unique(bin_indices).tolist():
        is_in_bin = bin_indices == k
        # At most 5 % of the simulated shares are beyond each end.
        band = np.quantile(outcomes[:, is_in_bin].mean(axis=1), (0.05, 0.95), method="inverted_cdf").tolist()
        shares = float(probabilities[is_in_bin].mean()), float(observed[is_in_bin].mean())
        reliability.append(ReliabilityBin(k / bin_count, (k + 1) / bin_count, int(is_in_bin.sum()), *shares, *band))
    return ModelValidation(
        tests=tuple(PredictedTest(name, test.motion.name, test.overturned, value) for name, test, value in rows),
        brier=compute_score((probabilities - observed) ** 2, observed, lambda share: share * (1.0 - share), clusters),
        log_loss=compute_score(compute_log_losses(probabilities, observed), observed, _compute_entropy, clusters),
        reliability=tuple(reliability),
        reliability_p_value=float((1.0 + larger_count) / (simulation_count + 1.0)),
        description=description,
        model=model_name,
    )


def _average_left_out(source: Validation, count: int, weights: object, outlier_probability: float | None) -> Floats:
    """Average the predicted probabilities of left-out tests over the repeats."""
    if weights is not None or outlier_probability is not None:
        name = "outlier_probability" if weights is None else "weights"
        raise OptionError("{} cannot be combined with predictions of left-out tests: omit it", name)
    predicted_count = source.probabilities.shape[1]
    if predicted_count != count:
        counts = f"{format_count(predicted_count, 'test')}; got {format_count(count, 'test')}"
        message = f"the predictions are of {counts}: {{}} must be those of the calibration, in their order"
        raise OptionError(message, "tests", value=count)
    return np.asarray(source.probabilities.mean(axis=0))


def compute_score(
    scores: Floats, observed: Flags, base_score: Callable[[float], float], clusters: Integers
) -> MeanScore:
    """Compute mean score, and skill against the base rate, whose score is `base_score` of the overturned share."""

    def mean(indices: Integers) -> float:
        return float(scores[indices].mean())

    def skill(indices: Integers) -> float:
        reference = base_score(float(observed[indices].mean()))
        return 1.0 - mean(indices) / reference if reference > 0.0 else math.nan

    errors, all_tests = [_jackknife(statistic, clusters) for statistic in (mean, skill)], np.arange(len(scores))
    return MeanScore(mean(all_tests), errors[0], skill(all_tests), errors[1], len(scores), len(np.unique(clusters)))


def _jackknife(statistic: Callable[[Integers], float], clusters: Integers) -> float:
    """Compute the standard error of a statistic of tests by leaving out each cluster."""
    labels = np.unique(clusters)
    if len(labels) < 2:
        return math.nan
    estimates = np.array([statistic(np.flatnonzero(clusters != label)) for label in labels])
    if not np.all(np.isfinite(estimates)):
        return math.nan
    return math.sqrt((len(labels) - 1.0) / len(labels) * float(((estimates - estimates.mean()) ** 2).sum()))


def _compute_entropy(share: float) -> float:
    return -sum(part * math.log(part) for part in (share, 1.0 - share) if part > 0.0)


def compute_miscalibration(probabilities: Floats, observed: Flags, bins: Integers) -> Floats:
    """Compute the reliability term of the Brier score (Murphy 1973) of outcomes (s, m) in bins (m,)."""
    counts = np.bincount(bins)
    membership = (bins[:, None] == np.arange(len(counts))).astype(np.float64)
    excess = (observed - probabilities) @ membership
    return np.asarray((excess**2 / np.maximum(counts, 1)).sum(axis=1) / len(bins))


def _format_with_error(value: float, error: float) -> tuple[str, str]:
    """Format value and standard error to two digits of the error."""
    if not (math.isfinite(value) and math.isfinite(error)):
        text = f"{value:.3g}"
        return {"inf": "infinite", "-inf": "-infinite", "nan": "-"}.get(text, text), "-"
    digits = 3 if error == 0.0 else max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{digits}f}", f"{error:.{digits}f}"
