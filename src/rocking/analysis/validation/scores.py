"""Scores of predicted distributions, their standard errors, and what predictions that are right would look like.

Numbers in, numbers out: nothing here knows of blocks. A distribution is a set of points with weights.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rocking.arrays import Flags, Floats, Integers

#: A mean over some of the tests, whose positions are given.
_Mean = Callable[[Integers], float]


@dataclass(frozen=True)
class Score:
    """Mean score of predictions, the smaller the better, and how far it is known.

    Attributes
    ----------
    value : float
        Mean over the tests.
    error : float
        Its standard error; NaN where there is one cluster of tests only, or the score is infinite.
    skill : float
        1 less the score over that of the base rate of the same tests (of peaks: of all their peaks alike): 1 where
        predictions are perfect, 0 where the base rate is as good. NaN where the base rate itself is perfect.
    skill_error : float
        Its standard error.
    tests : int
        Number of tests.
    clusters : int
        Number of clusters of tests that belong together.
    """

    value: float
    error: float
    skill: float
    skill_error: float
    tests: int
    clusters: int


def score_of(each: Floats, base: _Mean, clusters: Integers) -> Score:
    """Mean of scores (m,), against the mean score `base` of the base rate of some of the tests."""

    def skill(chosen: Integers) -> float:
        reference = base(chosen)
        return 1.0 - float(each[chosen].mean()) / reference if reference > 0.0 else math.nan

    whole = np.arange(len(each))
    return Score(
        float(each.mean()),
        jackknife(lambda chosen: float(each[chosen].mean()), clusters),
        skill(whole),
        jackknife(skill, clusters),
        len(each),
        len(np.unique(clusters)),
    )


def jackknife(statistic: _Mean, clusters: Integers) -> float:
    """Find the standard error of a statistic of tests, from what it is without each of the clusters."""
    labels = np.unique(clusters)
    if len(labels) < 2:
        return math.nan
    found = np.array([statistic(np.flatnonzero(clusters != label)) for label in labels])
    if not np.all(np.isfinite(found)):
        return math.nan
    return math.sqrt((len(labels) - 1.0) / len(labels) * float(((found - found.mean()) ** 2).sum()))


def brier_of_base_rate(observed: Flags) -> _Mean:
    """Brier score of the share that overturned."""

    def mean(chosen: Integers) -> float:
        share = float(observed[chosen].mean())
        return share * (1.0 - share)

    return mean


def log_loss_of_base_rate(observed: Flags) -> _Mean:
    """Log loss of the share that overturned."""

    def mean(chosen: Integers) -> float:
        share = float(observed[chosen].mean())
        return -sum(part * math.log(part) for part in (share, 1.0 - share) if part > 0.0)

    return mean


def crps_of_all_alike(observed: Floats) -> _Mean:
    """Continuous ranked probability score of the distribution of what was observed itself."""

    def mean(chosen: Integers) -> float:
        values = np.sort(observed[chosen])
        return half_mean_difference(values, np.full(len(values), 1.0 / len(values)))

    return mean


def half_mean_difference(points: Floats, weights: Floats) -> float:
    """Half the mean distance of two draws from a distribution, whose points are in order."""
    # Points that are all alike have none: from the first on, no rounding remains of what they are.
    return float((weights * (points - points[0]) * (2.0 * np.cumsum(weights) - weights - 1.0)).sum())


def crps(points: Floats, weights: Floats, observed: float) -> float:
    """Continuous ranked probability score: the integral of (F(x) - 1[x >= observed])^2 (Hersbach 2000).

    The points are in order, and the weights sum to 1.

    Examples
    --------
    >>> crps(np.array([1.0, 3.0]), np.array([0.5, 0.5]), 1.0)
    0.5
    """
    return float((weights * np.abs(points - observed)).sum()) - half_mean_difference(points, weights)


def quantiles(points: Floats, weights: Floats, shares: Floats) -> Floats:
    """Least points of a distribution, in order, that hold these shares of it or more."""
    held = np.cumsum(weights)
    places = np.searchsorted(held, np.asarray(shares) * held[-1] * (1.0 - 1e-12))
    return np.asarray(points[np.minimum(places, len(points) - 1)])


def miscalibration(probabilities: Floats, observed: Flags, bins: Integers) -> Floats:
    """Reliability term of the Brier score (Murphy 1973) of outcomes (s, m), with probabilities and bins (m,)."""
    counts = np.bincount(bins)
    member = (bins[:, None] == np.arange(len(counts))).astype(np.float64)
    excess = (observed - probabilities) @ member
    return np.asarray((excess**2 / np.maximum(counts, 1)).sum(axis=1) / len(bins))


def chance_of(statistic: float, simulated: Floats) -> float:
    """Chance of a statistic as large or larger, from those of simulations of what is assumed."""
    # Sums of the same numbers in another order differ in their last digits.
    larger = np.count_nonzero(simulated >= statistic - 1e-9 * abs(statistic))
    return float((1.0 + larger) / (len(simulated) + 1.0))
