"""Comparison of predictions with shake-table tests: scores and reliability."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis import levels
from rocking.analysis.levels import normalised_weights, pooled
from rocking.block.body import Bodies, Body
from rocking.calibration.diagnostics import Scores, log_losses
from rocking.calibration.outcomes import Calibration, Validation, chances_of, overturned_under
from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.constants import Model
from rocking.core.result import Result
from rocking.core.tables import Column, escape_dollars, format_count, format_table, records_to_columns
from rocking.engine.problem import compute_slenderness, gather_bodies
from rocking.errors import InvalidMotion, InvalidOption
from rocking.motion.motion import Motion
from rocking.records.named import check_motion, find_distinct_motions, make_names_unique

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
    rocking.validate : compare predictions with tests.

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
        motion, fell = check_motion(self.motion), self.overturned
        if motion is None:
            raise InvalidMotion("a test needs the {} of what the specimen stood on, not None", "motion")
        for label in ("name", "group"):
            checks.text(getattr(self, label), label, InvalidOption)
        if not isinstance(fell, (bool, int, np.bool_, np.integer)) or fell not in (0, 1):
            raise InvalidOption(f"{{}} must be True or False, not {checks.short_repr(fell)}", "overturned", value=fell)
        object.__setattr__(self, "overturned", bool(fell))
        object.__setattr__(self, "name", self.name or motion.name)

    def __repr__(self) -> str:
        return f"<ShakeTest: {self.name}, {'overturned' if self.overturned else 'stood'}>"


@dataclass(frozen=True)
class JudgedTest:
    """Prediction and observed outcome of one test.

    Attributes
    ----------
    name, motion : str
        Names of the test and of the motion.
    overturned : bool
        Whether the specimen overturned.
    probability : float
        Predicted probability of overturning.
    """

    name: str
    motion: str
    overturned: bool
    probability: float


@dataclass(frozen=True)
class Score:
    """Mean score of predictions (smaller is better) and its standard error.

    Attributes
    ----------
    value, error : float
        Mean over the tests and its standard error, which is NaN for a single cluster or an infinite score.
    skill, skill_error : float
        1 minus the ratio of the score to the base rate's score on the same tests, and its standard error. The skill is
        1 for perfect predictions, 0 for the base rate, and NaN if the base rate is perfect.
    tests, clusters : int
        Number of tests, and of clusters of tests that belong together.
    """

    value: float
    error: float
    skill: float
    skill_error: float
    tests: int
    clusters: int


@dataclass(frozen=True)
class ShareInBin:
    """Observed share of overturning in a bin, and its consistency band.

    Attributes
    ----------
    lower, upper : float
        Ends of the bin.
    tests : int
        Number of tests in the bin.
    predicted, observed : float
        Predicted and observed shares that overturn.
    band_lower, band_upper : float
        Ends of the central 90 % of the shares in simulations from the predictions (Broecker and Smith 2007).
    """

    lower: float
    upper: float
    tests: int
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
    tests : tuple of JudgedTest
        Predictions and observations.
    brier, log_loss : Score
        Mean squared difference between probability and outcome; mean of -log of the outcome's probability.
    reliability : tuple of ShareInBin
        Shares that overturned, in the nonempty bins of the predicted probability.
    reliability_chance : float
        Probability, if the predictions are correct, of a reliability term of the Brier score at least this large.
    description, model : str
        Source of the predictions, and equation of motion.

    See Also
    --------
    rocking.validate : compare predictions with tests.
    """

    TABLES = ("tests",)

    tests: tuple[JudgedTest, ...]
    brier: Score
    log_loss: Score
    reliability: tuple[ShareInBin, ...]
    reliability_chance: float
    description: str
    model: str

    @property
    def scores(self) -> Scores:
        """Accuracy, log loss and Brier score, as for a calibration."""
        return Scores.from_predictions(
            [test.probability for test in self.tests], [test.overturned for test in self.tests]
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings about the scores, one sentence each."""
        notes = []
        fell = sum(test.overturned for test in self.tests)
        if fell in (0, len(self.tests)):
            all_or_none = "all tests" if fell else "no test"
            notes.append(f"{all_or_none} overturned the specimen: the base rate is perfect, and no skill is known")
        if self.brier.clusters < 10:
            few = format_count(self.brier.clusters, "cluster")
            notes.append(f"the tests belong to {few} only: standard errors are rough")
        if math.isinf(self.log_loss.value):
            notes.append("the log loss is infinite, as a certainty failed: give what is not known of the specimen")
        return tuple(notes)

    def _headline(self) -> str:
        fell = sum(test.overturned for test in self.tests)
        by = f", {self.model} model" if self.model else ""
        return f"{self.description}{by}: {format_count(len(self.tests), 'test')}, {fell} overturned"

    def summary(self) -> str:
        scores = [
            [name, *_with_error(score.value, score.error), *_with_error(score.skill, score.skill_error)]
            for name, score in (("Brier", self.brier), ("log loss", self.log_loss))
        ]
        doubt = "not " if self.reliability_chance < 0.05 else ""
        parts = [
            self._headline(),
            "",
            format_table(["score", "mean", "+-", "skill", "+-"], scores),
            "",
            f"reliability: {doubt}as if the predictions were right (p = {self.reliability_chance:.2g})",
        ]
        return "\n".join([*parts, *(f"note: {sentence}" for sentence in self.notes)])

    def to_dict(self) -> dict[str, Any]:
        return asdict(self) | {"notes": [*self.notes]}

    def _columns(self, table: str) -> list[Column]:
        return records_to_columns([asdict(test) for test in self.tests], {})

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import reliability_figure

        columns = ("predicted", "observed", "band_lower", "band_upper")
        return reliability_figure(
            **{name: np.array([getattr(row, name) for row in self.reliability]) for name in columns},
            title=title or escape_dollars(self._headline()),
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
    bins: int = 10,
    simulations: int = 2000,
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
    bins : int
        Number of bins of the reliability diagram, of equal width.
    simulations, seed : int
        Number of independent draws from the predictions for the bands and `reliability_chance`, and their seed.

    Returns
    -------
    ModelValidation
        Scores with standard errors, reliability diagram, and individual tests.

    Raises
    ------
    InvalidOption
        If an argument is out of range, or there are no tests.

    See Also
    --------
    rocking.read_tests : read tests from a table.
    rocking.calibrate : fit blocks to the outcomes of tests.

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
    given = checks.items(tests, "tests", InvalidOption)
    if not given:
        raise InvalidOption("{} must hold at least one test", "tests", value=tests)
    for test in given:
        if not isinstance(test, ShakeTest):
            raise InvalidOption(
                f"{{}} must hold tests, ShakeTest(motion, overturned), not {checks.short_repr(test)}",
                "tests",
                value=test,
            )
    checks.integer(bins, "bins", InvalidOption, 1, 1000)
    checks.integer(simulations, "simulations", InvalidOption, 100)
    rng = np.random.default_rng(checks.integer(seed, "seed", InvalidOption, 0))
    if outlier_probability is not None:
        checks.between(outlier_probability, "outlier_probability", InvalidOption, 0.0, 0.5)
    distinct, which = find_distinct_motions([test.motion for test in given])
    observed = np.array([test.overturned for test in given], dtype=bool)
    clusters = levels.numbered(
        [("group", test.group) if test.group else ("motion", k) for test, k in zip(given, which, strict=True)]
    )
    description, how = "predictions of tests that were left out", ""
    if isinstance(blocks, Validation):
        probabilities = _left_out(blocks, len(given), weights, outlier_probability)
    else:
        if isinstance(blocks, Calibration):
            if weights is not None:
                raise InvalidOption("a calibration has {} of its own: leave them out", "weights")
            description, how = f"calibration, {format_count(len(blocks.blocks), 'block')}", model or blocks.model
            bodies: Bodies = blocks.blocks
            shares, effective = blocks.weights / blocks.weights.sum(), blocks.diagnostics.effective
            outlier_probability = blocks.outlier_probability if outlier_probability is None else outlier_probability
        else:
            description, how = pooled(blocks, weights), model or "nonlinear"
            bodies = gather_bodies(blocks)
            compute_slenderness(bodies)  # checked before the simulations
            shares = normalised_weights(weights, len(bodies)) / len(bodies)
            effective = math.inf if len(bodies) == 1 else 1.0 / float((shares**2).sum())
        fell = overturned_under(bodies, distinct, how)
        probabilities = chances_of(shares @ fell, effective, outlier_probability or 0.0)[which]
    outcomes = rng.random((simulations, len(given))) < probabilities
    places = np.minimum((probabilities * bins).astype(np.int64), bins - 1)
    term = miscalibration(probabilities, np.vstack([observed, outcomes]), places)
    # Summation order changes the last digits.
    larger = np.count_nonzero(term[1:] >= term[0] - 1e-9 * abs(term[0]))
    rows = zip(make_names_unique([test.name for test in given]), given, probabilities.tolist(), strict=True)
    return ModelValidation(
        tests=tuple(JudgedTest(name, test.motion.name, test.overturned, chance) for name, test, chance in rows),
        brier=score_of((probabilities - observed) ** 2, observed, lambda share: share * (1.0 - share), clusters),
        log_loss=score_of(log_losses(probabilities, observed), observed, _entropy, clusters),
        reliability=tuple(_bin(k, bins, places == k, probabilities, observed, outcomes) for k in np.unique(places)),
        reliability_chance=float((1.0 + larger) / (simulations + 1.0)),
        description=description,
        model=how,
    )


def _left_out(source: Validation, count: int, weights: object, outlier_probability: float | None) -> Floats:
    """Return the predicted probabilities of left-out tests of a calibration."""
    if weights is not None or outlier_probability is not None:
        name = "outlier_probability" if weights is None else "weights"
        raise InvalidOption("predictions of tests that were left out take no {}: leave it out", name)
    known = source.probabilities.shape[1]
    if known != count:
        raise InvalidOption(
            f"the predictions are of {format_count(known, 'test')}, and {format_count(count, 'test')} are given: "
            "{} must be those of the calibration, in their order",
            "tests",
        )
    return np.asarray(source.probabilities.mean(axis=0))


def score_of(each: Floats, observed: Flags, base: Callable[[float], float], clusters: Integers) -> Score:
    """Compute mean score and skill against the base rate, whose score is `base` of the share that overturned."""

    def mean(chosen: Integers) -> float:
        return float(each[chosen].mean())

    def skill(chosen: Integers) -> float:
        reference = base(float(observed[chosen].mean()))
        return 1.0 - mean(chosen) / reference if reference > 0.0 else math.nan

    errors, whole = [_jackknife(statistic, clusters) for statistic in (mean, skill)], np.arange(len(each))
    return Score(mean(whole), errors[0], skill(whole), errors[1], len(each), len(np.unique(clusters)))


def _jackknife(statistic: Callable[[Integers], float], clusters: Integers) -> float:
    """Compute the standard error of a statistic of tests by leaving out each cluster."""
    each = np.unique(clusters)
    if len(each) < 2:
        return math.nan
    found = np.array([statistic(np.flatnonzero(clusters != label)) for label in each])
    if not np.all(np.isfinite(found)):
        return math.nan
    return math.sqrt((len(each) - 1.0) / len(each) * float(((found - found.mean()) ** 2).sum()))


def _entropy(share: float) -> float:
    return -sum(part * math.log(part) for part in (share, 1.0 - share) if part > 0.0)


def miscalibration(probabilities: Floats, observed: Flags, bins: Integers) -> Floats:
    """Compute the reliability term of the Brier score (Murphy 1973) of outcomes (s, m) in bins (m,)."""
    counts = np.bincount(bins)
    member = (bins[:, None] == np.arange(len(counts))).astype(np.float64)
    excess = (observed - probabilities) @ member
    return np.asarray((excess**2 / np.maximum(counts, 1)).sum(axis=1) / len(bins))


def _bin(k: int, bins: int, chosen: Flags, probabilities: Floats, observed: Flags, drawn: Flags) -> ShareInBin:
    """Return the share of the tests in bin k, and the band of simulated shares with at most 5 % beyond each end."""
    band = np.quantile(drawn[:, chosen].mean(axis=1), (0.05, 0.95), method="inverted_cdf").tolist()
    shares = float(probabilities[chosen].mean()), float(observed[chosen].mean())
    return ShareInBin(k / bins, (k + 1) / bins, int(chosen.sum()), *shares, *band)


def _with_error(value: float, error: float) -> tuple[str, str]:
    """Return value and standard error as text, to two digits of the error."""
    if not (math.isfinite(value) and math.isfinite(error)):
        if math.isinf(value):
            return ("infinite" if value > 0.0 else "-infinite"), "-"
        return ("-" if math.isnan(value) else f"{value:.3g}"), "-"
    digits = 3 if error == 0.0 else max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{digits}f}", f"{error:.{digits}f}"
