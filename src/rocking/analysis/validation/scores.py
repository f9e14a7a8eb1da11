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


@dataclass(frozen=True, eq=False)
class Ranks:
    """Where a value lies among the points of a distribution: an interval between 0 and 1 for each value.

    So many draws divide [0, 1] into one interval more, of equal lengths, in any of which a further draw lies as likely
    (the rank histogram). A point that several draws share, as 0 where blocks did not rock, has the intervals about it.
    Of a distribution that is known, the number of draws is infinite, and its steps are the intervals. In both cases a
    uniform number picks an interval as probably as a value of the distribution does.

    points : in order
    below, upto : share of the distribution below each point, and up to it
    effective : number of draws
    edges : ends of the intervals
    """

    points: Floats
    below: Floats
    upto: Floats
    effective: float
    edges: Floats

    @classmethod
    def of(cls, points: Floats, weights: Floats, effective: float) -> Ranks:
        """Ranks among points in order, whose weights sum to 1."""
        held = np.cumsum(weights)
        below = np.concatenate([[0.0], held])[np.searchsorted(points, points, "left")]
        upto = held[np.searchsorted(points, points, "right") - 1]
        if math.isinf(effective):
            edges = np.unique(np.concatenate([below, [1.0]]))
        else:
            at_zero = float(upto[0]) if points[0] == 0.0 else 0.0
            first = (effective * at_zero + 1.0) / (effective + 1.0) if at_zero > 0.0 else 0.0
            others = np.arange(first, 1.0 - 1e-9, 1.0 / (effective + 1.0))
            edges = np.unique(np.concatenate([[0.0], others, [1.0]]))
        return cls(points, below, upto, effective, edges)

    def interval(self, observed: float) -> tuple[float, float]:
        """Interval of a value."""
        first, last = np.searchsorted(self.points, observed, "left"), np.searchsorted(self.points, observed, "right")
        low = self.upto[first - 1] if first > 0 else 0.0
        high = self.upto[last - 1] if last > 0 else 0.0
        if math.isinf(self.effective):
            return float(low), float(max(high, low))
        n = self.effective
        return float(n * low / (n + 1.0)), float(min((n * high + 1.0) / (n + 1.0), 1.0))

    def intervals(self, uniform: Floats) -> tuple[Floats, Floats]:
        """Intervals that uniform numbers pick, shape (s,) each."""
        places = np.clip(np.searchsorted(self.edges, uniform, "right") - 1, 0, len(self.edges) - 2)
        return self.edges[places], self.edges[places + 1]

    def uniform_at(self, places: Integers, uniform: Floats) -> Floats:
        """Numbers of an interval about each of some points, as far along it as uniform numbers say."""
        low, high = self.below[places], self.upto[places]
        if math.isinf(self.effective):
            return np.asarray(low + uniform * (high - low))
        n = self.effective
        return np.asarray((n * low + uniform * (n * (high - low) + 1.0)) / (n + 1.0))


def spread_in_bins(low: Floats, high: Floats, bins: int) -> Floats:
    """Share of each interval of [0, 1] that lies in each of some bins of equal width, shape (s, bins)."""
    edges = np.linspace(0.0, 1.0, bins + 1)
    overlap = np.clip(np.minimum(high[:, None], edges[1:]) - np.maximum(low[:, None], edges[:-1]), 0.0, None)
    width = (high - low)[:, None]
    place = np.clip(np.ceil(low * bins).astype(np.int64) - 1, 0, bins - 1)
    inside = np.where(width > 0.0, overlap / np.where(width > 0.0, width, 1.0), np.arange(bins) == place[:, None])
    return np.asarray(inside, dtype=np.float64)


def unevenness(counts: Floats) -> Floats:
    """Pearson's statistic of counts (s, bins) against equal ones; 0 where nothing was counted."""
    total = counts.sum(axis=1)
    expected = np.where(total > 0.0, total, 1.0)[:, None] / counts.shape[1]
    return np.asarray(np.where(total > 0.0, ((counts - expected) ** 2 / expected).sum(axis=1), 0.0))


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


def differing(outcomes: Flags, sets: Integers) -> tuple[Floats, float]:
    """How often two tests of one set differ: a sum over sets for each row of outcomes (s, m), and what divides it.

    Of n tests of which k overturned 2 k (n - k)/(n (n - 1)) of the pairs differ; a set counts n - 1.
    """
    total, freedom = np.zeros(len(outcomes)), 0.0
    for label in np.unique(sets):
        chosen = outcomes[:, sets == label]
        n = chosen.shape[1]
        fell = chosen.sum(axis=1)
        total += 2.0 * fell * (n - fell) / n
        freedom += n - 1.0
    return total, freedom


def scatter(values: Floats, sets: Integers) -> tuple[Floats, Floats]:
    """Sum squares about the mean of each set, and degrees of freedom, in each row of values (s, m); NaN is none."""
    total, freedom = np.zeros(len(values)), np.zeros(len(values))
    for label in np.unique(sets):
        chosen = values[:, sets == label]
        there = np.isfinite(chosen)
        n = there.sum(axis=1)
        # From the first that is known: values that are the same have no scatter at all, not even of rounding.
        first = chosen[np.arange(len(chosen)), np.argmax(there, axis=1)]
        chosen = chosen - first[:, None]
        known = np.where(there, chosen, 0.0)
        mean = known.sum(axis=1) / np.maximum(n, 1)
        total += (np.where(there, chosen - mean[:, None], 0.0) ** 2).sum(axis=1)
        freedom += np.maximum(n - 1, 0)
    return total, freedom
