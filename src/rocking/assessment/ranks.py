"""Ranks of objects that are plausible with other motions of the same kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from rocking.analysis.hazard import HazardCurve, compute_log_rate, compute_log_rate_within
from rocking.analysis.probit import MIN_CLUSTERS, ExceedanceCounts, fit_or_limits
from rocking.assessment.results import ObjectAssessment
from rocking.core.arrays import Floats, Integers

#: Number of resampled sets of motions.
_RESAMPLE_COUNT: Final = 400


def compute_ranks(
    objects: Sequence[ObjectAssessment], clusters: Integers, hazard: HazardCurve | None, confidence: float
) -> tuple[Integers, Integers]:
    """Compute the best and the worst plausible rank of each of some objects in the order of their ranks.

    The motions are resampled in clusters with replacement (bootstrap). All objects meet the same resampled motions,
    each has its own curve, and is ranked by rate or median. The ranks are quantiles. Fewer than three clusters allow
    all ranks.
    """
    object_count, cluster_count = len(objects), int(clusters.max()) + 1
    if cluster_count < MIN_CLUSTERS:
        return np.ones(object_count, dtype=np.int64), np.full(object_count, object_count)
    # One draw less than there are clusters, because the variance of means is then unbiased.
    shares = np.full(cluster_count, 1.0 / cluster_count)
    draw_counts = np.random.default_rng(0).multinomial(cluster_count - 1, shares, _RESAMPLE_COUNT)
    weights = draw_counts[:, clusters].astype(float)
    scores = np.stack([compute_scores(item, weights, hazard) for item in objects])
    # An object has the better rank of its equals as the best one, and the worse rank as the worst one.
    best_ranks = 1 + (scores[:, None] > scores[None, :]).sum(axis=1)
    worst_ranks = (scores[:, None] >= scores[None, :]).sum(axis=1)
    tail, ranks = 0.5 * (1.0 - confidence), np.arange(1, object_count + 1)
    lowest = np.quantile(best_ranks, tail, axis=1, method="lower")
    highest = np.quantile(worst_ranks, 1.0 - tail, axis=1, method="higher")
    return np.minimum(lowest, ranks), np.maximum(highest, ranks)


def compute_scores(item: ObjectAssessment, weights: Floats, hazard: HazardCurve | None) -> Floats:
    """Compute minus the logarithm of the rate, or the logarithm of the median, for each set of weights of motions."""
    is_known = np.isfinite(item.share)
    exceedances, trial_counts = weights @ np.where(is_known, item.share, 0.0).T, weights @ is_known.T.astype(float)
    fits = fit_or_limits(ExceedanceCounts(np.log(item.levels), exceedances, trial_counts))
    if hazard is not None:
        log_rates, level_log_rates = compute_log_rate(fits, hazard), compute_log_rate_within(fits, hazard)
        return -np.where(fits.slope > 0.0, log_rates[:, 0], level_log_rates[:, 0])
    with np.errstate(over="ignore"):
        return np.asarray(-fits.intercept / np.maximum(fits.slope, np.finfo(float).tiny))
