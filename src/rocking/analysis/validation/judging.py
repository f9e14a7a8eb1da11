"""Predictions of many tests judged against what was observed: scores and reliability."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.analysis.calibration.diagnostics import log_losses
from rocking.analysis.validation import scores
from rocking.analysis.validation.predicted import Predicted, Prediction, Source, predicted
from rocking.analysis.validation.result import JudgedTest, ModelValidation, ShareInBin
from rocking.analysis.validation.tested import Observed, ShakeTest, checked_tests
from rocking.arrays import Flags, Floats, Integers
from rocking.constants import Model
from rocking.errors import InvalidOption
from rocking.motion.named import numbered

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
    bins : int
        Bins of the reliability diagram, of equal width.
    simulations : int
        Draws from the predictions, for bands and their chance; each test has a block of its own.
    seed : int
        Seeds them.
    threads : int, optional
        As for `simulate_many`.
    progress : bool, optional
        As for `simulate_many`.

    Returns
    -------
    ModelValidation
        Scores with standard errors, reliability diagram, and each test.

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

    Standard errors are those of the jackknife that leaves out clusters: tests of one group, else of one command. The
    base rate that skill is against comes from the same tests, which favours it.

    A consistency band holds the central 90 % of the shares in simulations from the predictions themselves (Broecker and
    Smith 2007), here with these predictions and not with others drawn from them. The chance of reliability comes from
    the same simulations.

    References
    ----------
    Gneiting, T. and Raftery, A. E. (2007). Strictly proper scoring rules, prediction, and estimation. Journal of the
    American Statistical Association 102, 359-378.

    Broecker, J. and Smith, L. A. (2007). Increasing the reliability of reliability diagrams. Weather and Forecasting
    22, 651-661.

    Hersbach, H. (2000). Decomposition of the continuous ranked probability score for ensemble prediction systems.
    Weather and Forecasting 15, 559-570.

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
    judged = _judged(given, seen, found)
    probabilities = found.probabilities
    outcomes = np.empty((simulations, len(given)), dtype=bool)
    for one in found.of_specimens:
        outcomes[:, one.tests] = rng.random((simulations, len(one.tests))) < one.probabilities
    places = np.minimum((probabilities * bins).astype(np.int64), bins - 1)
    statistic = scores.miscalibration(probabilities, np.vstack([seen.overturned, outcomes]), places)
    known = np.array([test.crps for test in judged])
    scored = np.flatnonzero(np.isfinite(known))
    return ModelValidation(
        tests=tuple(judged),
        brier=scores.score_of(
            (probabilities - seen.overturned) ** 2, scores.brier_of_base_rate(seen.overturned), seen.clusters
        ),
        log_loss=scores.score_of(
            log_losses(probabilities, seen.overturned), scores.log_loss_of_base_rate(seen.overturned), seen.clusters
        ),
        crps=None
        if not len(scored)
        else scores.score_of(known[scored], scores.crps_of_all_alike(seen.peaks[scored]), seen.clusters[scored]),
        reliability=_reliability(probabilities, seen.overturned, outcomes, places, bins),
        reliability_chance=scores.chance_of(float(statistic[0]), statistic[1:]),
        unexplained=sum(
            int(np.sum(np.isfinite(seen.peaks[one.tests]) & np.isnan(known[one.tests])))
            for one in found.of_specimens
            if one.has_blocks
        ),
        description=found.description,
        model=found.model,
    )


def _judged(tests: Sequence[ShakeTest], seen: Observed, found: Prediction) -> list[JudgedTest]:
    """Put what was predicted of each test beside what was observed."""
    names = numbered([test.name for test in tests])
    rows: dict[int, JudgedTest] = {}
    for one in found.of_specimens:
        for k, at in enumerate(one.tests.tolist()):
            test, fell, peak = tests[at], bool(seen.overturned[at]), float(seen.peaks[at])
            shares, score = _peak_judged(one, k, peak)
            rows[at] = JudgedTest(
                name=names[at],
                specimen=test.specimen,
                motion=test.motion.name,
                overturned=fell,
                probability=float(one.probabilities[k]),
                peak_rotation=math.inf if fell else peak,
                **dict(zip(("lower", "median", "upper"), shares, strict=True)),
                crps=score,
            )
    return [rows[at] for at in range(len(tests))]


def _peak_judged(one: Predicted, k: int, peak: float) -> tuple[list[float], float]:
    """Quantiles of the peaks of the blocks that stand, and among these the score of a measured one."""
    found = one.standing(k) if one.has_blocks else None
    if found is None:
        return [math.nan] * len(_SHARES), math.nan
    score = math.nan if math.isnan(peak) else scores.crps(*found, peak)
    return scores.quantiles(*found, np.array(_SHARES)).tolist(), score


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


def _band(values: Floats) -> tuple[float, float]:
    """Return the ends of the central part of simulated values: no more than a tail of them lies beyond each."""
    low, high = np.quantile(values, (_TAIL, 1.0 - _TAIL), method="inverted_cdf").tolist()
    return low, high
