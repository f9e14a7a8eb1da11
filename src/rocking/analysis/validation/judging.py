"""Predictions of many tests judged against what was observed: scores, reliability, ranks of peaks, repetitions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.analysis.calibration.diagnostics import log_losses
from rocking.analysis.validation import scores
from rocking.analysis.validation.predicted import Predicted, Prediction, Source, predicted
from rocking.analysis.validation.result import JudgedTest, ModelValidation, Repeatability, ShareInBin
from rocking.analysis.validation.tested import Observed, ShakeTest, checked_tests
from rocking.arrays import Flags, Floats, Integers
from rocking.constants import Model
from rocking.errors import InvalidOption
from rocking.motion.named import numbered

#: In which tests a block is one and the same.
Scope = Literal["test", "group", "specimen"]

#: Shares of a prediction that its quantiles hold, and the central share of bands.
_SHARES: Final = (0.05, 0.5, 0.95)
_TAIL: Final = 0.05


def validate(
    tests: Sequence[ShakeTest],
    blocks: Source | Mapping[str, Source],
    *,
    weights: ArrayLike | Mapping[str, ArrayLike] | None = None,
    model: Model | None = None,
    lapse: float | None = None,
    peak_error: float = 0.0,
    one_block_in: Scope = "test",
    bins: int = 10,
    simulations: int = 2000,
    seed: int = 0,
    threads: int | None = None,
    progress: bool | None = None,
) -> ModelValidation:
    """Judge what blocks predict of tests against what was observed in them.

    Parameters
    ----------
    tests : sequence of ShakeTest
        m tests; `read_tests` reads them from a table.
    blocks : Block, Blocks, RestrainedBlock, sequence of one kind, Calibration, Validation, or mapping of str to these
        What predicts: one block that is taken as known; n of them, draws of what is not known of the specimen, or
        differs from test to test; a calibration; or what its `cross_validate` said of the same tests, in the order of
        the calibration, while they were left out. A mapping has one of these for each specimen.
    weights : array_like or mapping of str to array_like, optional
        How much each of several blocks counts; by default all alike.
    model : {"nonlinear", "linear"}, optional
        Equation of motion; by default that of a calibration, else the nonlinear one.
    lapse : float, optional
        Chance that an outcome is not that of a rocking block at all; by default that of a calibration, else 0.
    peak_error : float
        Standard deviation of a measured peak, rad.
    one_block_in : {"test", "group", "specimen"}
        In which tests the specimen is one and the same block of these, for bands and chances: in each test it is
        another (the population that `calibrate` finds), or it is one in all tests that belong together, or in all tests
        (draws of what is not known of it).
    bins : int
        Bins of the reliability diagram and of ranks, of equal width.
    simulations : int
        Draws from the predictions, for bands and chances.
    seed : int
        Seeds them.
    threads : int, optional
        As for `simulate_many`.
    progress : bool, optional
        As for `simulate_many`.

    Returns
    -------
    ModelValidation
        Scores with standard errors, reliability diagram, ranks of peaks, repeatability, and each test.

    Raises
    ------
    InvalidOption
        If an argument is out of its range, a specimen has no blocks, or there is no test.
    Unfinished
        If a simulation was given up.

    Notes
    -----
    The share of n blocks that overturn is itself uncertain; the probability is its mean by Jeffreys' prior, as in
    `Calibration.predict`, where one block is not taken as known. Outcomes are scored by the Brier score and the
    logarithmic one (Gneiting and Raftery 2007). A peak is scored among the blocks that stand, by the continuous ranked
    probability score (Hersbach 2000): the chance to stand is what outcomes judge, and both scores together are proper.
    One number for both would need a rotation for what overturned, and that would weigh more than all peaks.

    Standard errors are those of the jackknife that leaves out clusters: tests of one group, else repetitions. The base
    rate that skill is against comes from the same tests, which favours it.

    A consistency band holds the central 90 % of the shares in simulations from the predictions themselves (Broecker and
    Smith 2007), here with these predictions and not with others drawn from them. The two chances, of reliability and of
    ranks, come from the same simulations. Ranks are those of a peak among n draws: it lies in one of n + 1 equally
    probable intervals; where several share it, as the peaks of 0, it is spread evenly over theirs, and no random
    number is drawn (Czado, Gneiting and Held 2009).

    References
    ----------
    Gneiting, T. and Raftery, A. E. (2007). Strictly proper scoring rules, prediction, and estimation. Journal of the
    American Statistical Association 102, 359-378.

    Broecker, J. and Smith, L. A. (2007). Increasing the reliability of reliability diagrams. Weather and Forecasting
    22, 651-661.

    Hersbach, H. (2000). Decomposition of the continuous ranked probability score for ensemble prediction systems.
    Weather and Forecasting 15, 559-570.

    Czado, C., Gneiting, T. and Held, L. (2009). Predictive model assessment for count data. Biometrics 65, 1254-1261.

    Examples
    --------
    >>> import numpy as np, rocking
    >>> rng = np.random.default_rng(0)
    >>> specimens = rocking.Blocks(3.0, rng.lognormal(np.log(0.15), 0.1, 40), 0.9)
    >>> pulses = [rocking.pulses.one_sine(a, 1.0) for a in np.linspace(1.5, 4.0, 40)]
    >>> fell = rocking.simulate_many(specimens, pulses).overturned.values.diagonal()
    >>> tests = [rocking.ShakeTest(pulse, one) for pulse, one in zip(pulses, fell)]
    >>> population = rocking.Blocks(3.0, rng.lognormal(np.log(0.15), 0.1, 200), 0.9)
    >>> found = rocking.validate(tests, population)
    >>> found.brier.skill > 0.2, found.reliability_chance > 0.05
    (True, True)
    """
    given = checked_tests(tests)
    checks.one_of(one_block_in, "one_block_in", InvalidOption, get_args(Scope))
    checks.whole(bins, "bins", InvalidOption, 1, 1000)
    checks.whole(simulations, "simulations", InvalidOption, 100)
    rng = np.random.default_rng(checks.whole(seed, "seed", InvalidOption, 0))
    if lapse is not None:
        checks.within(lapse, "lapse", InvalidOption, 0.0, 0.5)
    deviation = checks.within(peak_error, "peak_error", InvalidOption, 0.0, 1.0, "rad")
    seen = Observed.of(given)
    found = predicted(
        seen,
        blocks,
        weights=weights,
        model=model,
        lapse=lapse,
        deviation=deviation,
        threads=threads,
        progress=progress,
    )
    if one_block_in != "test" and not all(one.has_blocks for one in found.of_specimens):
        raise InvalidOption("predictions of tests that were left out have no blocks: leave {} out", "one_block_in")
    judged = _judged(given, seen, found)
    labels = {"test": None, "group": seen.clusters, "specimen": np.zeros_like(seen.clusters)}[one_block_in]
    probabilities = found.probabilities
    outcomes = _drawn(found, None if labels is None else labels, simulations, rng)
    places = np.minimum((probabilities * bins).astype(np.int64), bins - 1)
    statistic = scores.miscalibration(probabilities, np.vstack([seen.overturned, outcomes]), places)
    known = np.array([test.crps for test in judged])
    ranked = np.flatnonzero(np.isfinite(known))
    # One block for several tests stands in others than those in which the specimen did.
    known_where = ranked if labels is None or not len(ranked) else np.union1d(ranked, np.flatnonzero(seen.overturned))
    _, low, high = _drawn_peaks(found, known_where, labels, simulations, rng)
    ranks, ranks_chance = _ranks(judged, ranked, low, high, bins)
    return ModelValidation(
        tests=tuple(judged),
        brier=scores.score_of(
            (probabilities - seen.overturned) ** 2, scores.brier_of_base_rate(seen.overturned), seen.clusters
        ),
        log_loss=scores.score_of(
            log_losses(probabilities, seen.overturned), scores.log_loss_of_base_rate(seen.overturned), seen.clusters
        ),
        crps=None
        if not len(ranked)
        else scores.score_of(known[ranked], scores.crps_of_all_alike(seen.peaks[ranked]), seen.clusters[ranked]),
        reliability=_reliability(probabilities, seen.overturned, outcomes, places, bins),
        reliability_chance=scores.chance_of(float(statistic[0]), statistic[1:]),
        ranks=ranks,
        ranks_chance=ranks_chance,
        coverage=_coverage(judged, ranked),
        unexplained=sum(
            int(np.sum(np.isfinite(seen.peaks[one.tests]) & np.isnan(known[one.tests])))
            for one in found.of_specimens
            if one.has_blocks
        ),
        repeated_outcomes=_repeated_outcomes(seen, found, simulations, rng),
        repeated_peaks=_repeated_peaks(seen, found, ranked, simulations, rng),
        description=found.description,
        model=found.model,
        one_block_in=one_block_in,
    )


def _judged(tests: Sequence[ShakeTest], seen: Observed, found: Prediction) -> list[JudgedTest]:
    """Put what was predicted of each test beside what was observed."""
    names = numbered([test.name for test in tests])
    rows: dict[int, JudgedTest] = {}
    for one in found.of_specimens:
        for k, at in enumerate(one.tests.tolist()):
            test, chance = tests[at], float(one.probabilities[k])
            fell, peak = bool(seen.overturned[at]), float(seen.peaks[at])
            shares, score, (low, high) = _peak_judged(one, k, peak)
            given = chance if fell else 1.0 - chance
            tail = 1.0 if math.isnan(low) else min(1.0, low + high, 2.0 - low - high)
            rows[at] = JudgedTest(
                name=names[at],
                specimen=test.specimen,
                motion=test.motion.name,
                overturned=fell,
                probability=chance,
                blocks=one.effective,
                peak_rotation=math.inf if fell else peak,
                **dict(zip(("lower", "median", "upper"), shares, strict=True)),
                crps=score,
                pit_lower=low,
                pit_upper=high,
                chance=min(given, tail),
            )
    return [rows[at] for at in range(len(tests))]


def _peak_judged(one: Predicted, k: int, peak: float) -> tuple[list[float], float, tuple[float, float]]:
    """Quantiles of the peaks of the blocks that stand, and among these the score of a measured one and its ranks."""
    found = one.standing(k) if one.has_blocks else None
    if found is None:
        return [math.nan] * len(_SHARES), math.nan, (math.nan, math.nan)
    ranks, within = found
    shares = scores.quantiles(ranks.points, within, np.array(_SHARES)).tolist()
    if math.isnan(peak):
        return shares, math.nan, (math.nan, math.nan)
    return shares, scores.crps(ranks.points, within, peak), ranks.interval(peak)


def _drawn(found: Prediction, labels: Integers | None, count: int, rng: np.random.Generator) -> Flags:
    """Draw outcomes of all tests, shape (count, m)."""
    drawn = np.empty((count, sum(len(one.tests) for one in found.of_specimens)), dtype=bool)
    for one in found.of_specimens:
        drawn[:, one.tests] = one.drawn_outcomes(None if labels is None else labels[one.tests], count, rng)
    return drawn


def _drawn_peaks(
    found: Prediction, ranked: Integers, labels: Integers | None, count: int, rng: np.random.Generator
) -> tuple[Floats, Floats, Floats]:
    """Draw peaks of the tests whose rank is known, and the intervals of their ranks: each of shape (count, tests)."""
    drawn = np.full((3, count, len(ranked)), math.nan)
    for one in found.of_specimens:
        where = {int(at): k for k, at in enumerate(one.tests)}
        blocks = one.drawn_blocks(None if labels is None else labels[one.tests], count, rng) if len(ranked) else None
        for column, at in enumerate(ranked.tolist()):
            if (k := where.get(at)) is not None:
                drawn[:, :, column] = one.drawn_peaks(k, None if blocks is None else blocks[:, k], count, rng)
    return drawn[0], drawn[1], drawn[2]


def _reliability(
    probabilities: Floats, observed: Flags, drawn: Flags, places: Integers, bins: int
) -> tuple[ShareInBin, ...]:
    found = []
    for k in np.unique(places):
        chosen = places == k
        shares = drawn[:, chosen].mean(axis=1)
        found.append(
            ShareInBin(
                k / bins,
                (k + 1) / bins,
                int(chosen.sum()),
                float(probabilities[chosen].mean()),
                float(observed[chosen].mean()),
                *_band(shares),
            )
        )
    return tuple(found)


def _ranks(
    judged: Sequence[JudgedTest], ranked: Integers, low: Floats, high: Floats, bins: int
) -> tuple[tuple[ShareInBin, ...], float]:
    """Share of the peaks in each bin of their ranks, and the chance that they are as uneven."""
    if not len(ranked):
        return (), math.nan
    ends = np.array([(judged[at].pit_lower, judged[at].pit_upper) for at in ranked])
    counts = scores.spread_in_bins(ends[:, 0], ends[:, 1], bins).sum(axis=0)
    drawn = np.zeros((len(low), bins))
    for column in range(low.shape[1]):
        stands = np.isfinite(low[:, column])
        drawn[stands] += scores.spread_in_bins(low[stands, column], high[stands, column], bins)
    uneven = scores.unevenness(np.vstack([counts, drawn]))
    shares = drawn / np.maximum(drawn.sum(axis=1, keepdims=True), 1e-300)
    rows = tuple(
        ShareInBin(k / bins, (k + 1) / bins, len(ranked), 1.0 / bins, counts[k] / len(ranked), *_band(shares[:, k]))
        for k in range(bins)
    )
    return rows, scores.chance_of(float(uneven[0]), uneven[1:])


def _band(values: Floats) -> tuple[float, float]:
    """Return the ends of the central part of simulated values: no more than a tail of them lies beyond each."""
    low, high = np.quantile(values, (_TAIL, 1.0 - _TAIL), method="inverted_cdf").tolist()
    return low, high


def _coverage(judged: Sequence[JudgedTest], ranked: Integers) -> float:
    """Share of the peaks within the central part of their predictions; one that has several ranks counts in part."""
    if not len(ranked):
        return math.nan
    parts = []
    for test in (judged[at] for at in ranked):
        low, high = test.pit_lower, test.pit_upper
        inside = min(high, 1.0 - _TAIL) - max(low, _TAIL)
        parts.append(max(inside, 0.0) / (high - low) if high > low else float(inside >= 0.0))
    return float(np.mean(parts))


def _repeated(sets: Integers) -> Integers:
    """Positions of the tests that have a repetition."""
    return np.flatnonzero(np.bincount(sets, minlength=1)[sets] > 1)


def _repeated_outcomes(seen: Observed, found: Prediction, count: int, rng: np.random.Generator) -> Repeatability | None:
    """How often repetitions differ."""
    chosen = _repeated(seen.repetitions)
    if not len(chosen):
        return None
    sets = seen.repetitions[chosen]
    observed, freedom = scores.differing(seen.overturned[None, chosen], sets)
    drawn = scores.differing(_drawn(found, None, count, rng)[:, chosen], sets)[0] / freedom
    same = 0.0
    for one in found.of_specimens:
        own = np.flatnonzero(np.isin(one.tests, chosen))
        one_block = scores.differing(one.overturned[:, own], seen.repetitions[one.tests[own]])[0]
        same += float(one.weights @ one_block) if one.has_blocks else math.nan
    sizes = len(np.unique(sets)), len(chosen)
    return Repeatability(*sizes, float(observed[0]) / freedom, float(drawn.mean()), *_band(drawn), same / freedom)


def _repeated_peaks(
    seen: Observed, found: Prediction, ranked: Integers, count: int, rng: np.random.Generator
) -> Repeatability | None:
    """How much measured peaks of repetitions differ."""
    chosen = ranked[_repeated(seen.repetitions[ranked])] if len(ranked) else ranked
    if not len(chosen):
        return None
    sets = seen.repetitions[chosen]
    total, freedom = scores.scatter(seen.peaks[None, chosen], sets)
    drawn = _drawn_peaks(found, chosen, None, count, rng)[0]
    squares, free = scores.scatter(drawn, sets)
    deviations = np.sqrt(squares / free)
    same = np.zeros(2)
    deviation = 0.0
    for one in found.of_specimens:
        own = np.flatnonzero(np.isin(one.tests, chosen))
        standing = np.where(np.isfinite(one.peaks[:, own]), one.peaks[:, own], math.nan)
        same += [float(one.weights @ each) for each in scores.scatter(standing, seen.repetitions[one.tests[own]])]
        deviation = max(deviation, one.deviation if one.has_blocks else 0.0)
    alone = math.hypot(math.sqrt(same[0] / same[1]), deviation) if same[1] > 0.0 else math.nan
    expected = math.sqrt(float((squares / free).mean()))
    sizes = len(np.unique(sets)), len(chosen)
    return Repeatability(*sizes, math.sqrt(float(total[0] / freedom[0])), expected, *_band(deviations), alone)
