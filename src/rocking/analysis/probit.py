"""Maximum-likelihood fit of a lognormal fragility, and its confidence region.

The probability of exceedance at intensity x is Phi(ln(x/median)/dispersion). In z = ln x it is a probit, Phi(a + b z),
with b = 1/dispersion and a = -b ln(median). Its likelihood is concave and has one maximum, or none if the outcomes are
separated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from rocking.core.arrays import Flags, Floats, Integers

_MAX_ITERATIONS: Final = 100


#: Slope that represents a step.
STEEPEST_SLOPE: Final = 1e9

#: Minimum number of outcomes in a group of the test of fit, and maximum number of groups of binary outcomes (Hosmer and
#: Lemeshow).
_MIN_GROUP_SIZE: Final = 5

#: Directions that discretise a region, which loses 4e-5 of an interval's width.
_RAY_COUNT: Final = 360

#: Relative tolerance of the end of a ray.
_RAY_TOLERANCE: Final = 1e-9

#: Minimum number of clusters for an estimate of their differences.
MIN_CLUSTERS: Final = 3


class ExceedanceCounts(NamedTuple):
    """Numbers of exceedances and trials at n logarithms of the intensity, for one or several data sets."""

    log_x: Floats
    exceedance_counts: Floats
    trial_counts: Floats

    def as_batch(self) -> ExceedanceCounts:
        """Return one data set with an additional dimension of length 1."""
        return ExceedanceCounts(self.log_x, self.exceedance_counts[None, :], self.trial_counts[None, :])

    def select(self, is_selected: Flags) -> ExceedanceCounts:
        """Return selected data sets."""
        return ExceedanceCounts(self.log_x, self.exceedance_counts[is_selected], self.trial_counts[is_selected])


class Probit(NamedTuple):
    """Parameters of one or several fits: probabilities are Phi(intercept + slope ln x) at intensities x.

    Attributes
    ----------
    intercept, slope : ndarray, shape (fits,)
        Parameters, with one entry for a single fit.

    See Also
    --------
    rocking.analysis.FragilityCurve : Evaluate the fitted probabilities.
    rocking.fit_fragility : Fit fragility curves to observed outcomes.

    Examples
    --------
    >>> from rocking import fit_fragility
    >>> fitted = fit_fragility([2.0, 3.0, 4.0, 5.0], [1, 4, 7, 10], trial_counts=10).curves[0].fitted
    >>> f"intercept {fitted.intercept[0]:.3f}, slope {fitted.slope[0]:.3f}"
    'intercept -3.773, slope 3.287'
    """

    intercept: Floats
    slope: Floats

    def __repr__(self) -> str:
        if len(self.slope) > 1:
            return f"<Probit: {len(self.slope)} fits>"
        return f"<Probit: intercept {float(self.intercept[0]):.5g}, slope {float(self.slope[0]):.5g}>"


#: Level curves at 0 and 1, and steps below and above all possible intensities.
_STEEPEST_INTERCEPT: Final = 1000.0 * STEEPEST_SLOPE
_WHOLE_PLANE: Final = Probit(
    np.array([-np.inf, np.inf, _STEEPEST_INTERCEPT, -_STEEPEST_INTERCEPT]),
    np.array([0.0, 0.0, STEEPEST_SLOPE, STEEPEST_SLOPE]),
)


def compute_normal_scores(fits: Probit, log_x: Floats) -> Floats:
    """Compute normal scores of the probability at logarithms of the intensity, shape (fits, len(z)), -inf at 0."""
    is_finite = np.isfinite(log_x)
    scores = fits.intercept[:, None] + fits.slope[:, None] * np.where(is_finite, log_x, 0.0)
    return np.where(is_finite, scores, log_x)


def compute_probabilities(fits: Probit, log_x: Floats) -> Floats:
    """Compute probabilities at logarithms of the intensity, shape (fits, len(z))."""
    from scipy.special import ndtr

    values: Floats = ndtr(compute_normal_scores(fits, log_x))
    return values


@dataclass(frozen=True)
class Goodness:
    """Pearson's test of the fitted probabilities against groups of outcomes.

    Attributes
    ----------
    statistic : float
        Sum over groups of (seen - expected)^2/variance.
    degrees_of_freedom : int
        Number of groups minus two.
    p_value : float
        Probability of a larger statistic if the lognormal is right, or NaN for fewer than three groups or dependent
        outcomes.

    See Also
    --------
    rocking.analysis.FragilityCurve : Evaluate the fitted probabilities.
    rocking.fit_fragility : Fit fragility curves to observed outcomes.

    Examples
    --------
    >>> from rocking import fit_fragility
    >>> goodness = fit_fragility([2.0, 3.0, 4.0, 5.0], [1, 4, 7, 10], trial_counts=10).curves[0].goodness
    >>> f"{goodness.degrees_of_freedom} degrees of freedom, p-value {goodness.p_value:.2f}"
    '2 degrees of freedom, p-value 0.52'
    """

    statistic: float
    degrees_of_freedom: int
    p_value: float


def merge_equal_intensities(intensity: Floats) -> Floats:
    """Merge intensities that differ by rounding only, for example after scaling."""
    order = np.argsort(intensity, kind="stable")
    ordered = intensity[order]
    is_larger = np.diff(np.log(ordered), prepend=-np.inf) > 1e-9
    merged = np.empty_like(ordered)
    merged[order] = ordered[is_larger][np.cumsum(is_larger) - 1]
    return merged


def explain_missing_fit(data: ExceedanceCounts, format_intensity: Callable[[float], str]) -> str | None:
    """Explain why no rising lognormal fits a data set, or return None if one does."""
    log_x, exceedances, trial_counts = data
    exceeded_x, other_x, count = log_x[exceedances > 0], log_x[exceedances < trial_counts], round(trial_counts.sum())
    if not exceeded_x.size or not other_x.size:
        quantifier, remedy = ("no", "stronger") if not exceeded_x.size else ("every", "weaker")
        ends = dict.fromkeys(format_intensity(math.exp(end)) for end in (log_x.min(), log_x.max()))
        return f"{quantifier} outcome of {count} exceeds the limit, at {' to '.join(ends)}; use {remedy} motions"
    if log_x.min() == log_x.max():
        return f"all outcomes are at one intensity, {format_intensity(math.exp(log_x[0]))}; use several intensities"
    if other_x.max() <= exceeded_x.min() + _compute_overlap(log_x):
        low, high = math.exp(other_x.max()), math.exp(exceeded_x.min())
        start, others_text = ("below", "above it") if low >= high else ("up to", f"from {format_intensity(high)} on")
        gap = f"{start} {format_intensity(low)} and all do {others_text}"
        return (
            f"the outcomes are separated, none exceeds the limit {gap}, so that the fragility is a step; use more "
            "motions near it"
        )
    if not _is_rising(data.as_batch())[0]:
        return (
            "the fitted curve does not rise, because the limit is exceeded no more often at higher intensities; use "
            "another measure or more motions"
        )
    return None


def fit(data: ExceedanceCounts) -> Probit:
    """Fit several data sets that have one (`explain_missing_fit`) by maximum likelihood (Fisher's scoring)."""
    centre, spread = data.log_x.mean(), data.log_x.std()
    scaled = data._replace(log_x=(data.log_x - centre) / spread)
    beta = np.zeros((len(data.trial_counts), 2))
    log_likelihoods = compute_log_likelihood(scaled, beta)
    powers = np.stack([np.ones_like(scaled.log_x), scaled.log_x])
    full_information = np.einsum("fn,jn,kn->fjk", data.trial_counts, powers, powers)
    for _ in range(_MAX_ITERATIONS):
        with np.errstate(all="ignore"):
            gradient, information = _compute_score_and_information(scaled, beta)
            step = _solve_two_equations(information, gradient)
        # Far from the maximum the information may vanish by rounding. The step of the complete data (EM) still
        # increases the likelihood.
        is_singular = ~np.isfinite(step).all(axis=1)
        step[is_singular] = _solve_two_equations(full_information[is_singular], gradient[is_singular])
        step, new_log_likelihoods = _shorten_steps(scaled, beta, step, log_likelihoods)
        beta, log_likelihoods = beta + step, new_log_likelihoods
        if np.all(np.abs(step) <= 1e-11 * np.abs(beta).max(axis=1, keepdims=True)):
            break
    slope = beta[:, 1] / spread
    return Probit(beta[:, 0] - slope * centre, slope)


def fit_or_limits(data: ExceedanceCounts) -> Probit:
    """Fit several data sets, with the limit of rising curves if their likelihood has no maximum."""
    from scipy.special import ndtri

    log_x, exceedances, trial_counts = data
    min_exceeded = np.where(exceedances > 0, log_x, np.inf).min(axis=1)
    max_other = np.where(exceedances < trial_counts, log_x, -np.inf).max(axis=1)
    is_step = np.isfinite(max_other - min_exceeded) & (max_other <= min_exceeded + _compute_overlap(log_x))
    # If the best curve would fall, the limit is level: one probability, 0 or 1 if all outcomes are equal.
    fits = Probit(ndtri(exceedances.sum(axis=1) / trial_counts.sum(axis=1)), np.where(is_step, STEEPEST_SLOPE, 0.0))
    fits.intercept[is_step] = -0.5 * STEEPEST_SLOPE * (max_other + min_exceeded)[is_step]
    if (is_regular := ~is_step & _is_rising(data)).any():
        fits.intercept[is_regular], fits.slope[is_regular] = fit(data.select(is_regular))
    return fits


def compute_log_likelihood(data: ExceedanceCounts, beta: Floats) -> Floats:
    """Compute the log-likelihood of parameters (fits, 2), without binomial coefficients."""
    from scipy.special import log_ndtr

    log_x, exceedances, trial_counts = data
    scores = beta[:, :1] + beta[:, 1:] * log_x
    terms = np.where(exceedances > 0, exceedances * log_ndtr(scores), 0.0)
    terms += np.where(exceedances < trial_counts, (trial_counts - exceedances) * log_ndtr(-scores), 0.0)
    total: Floats = terms.sum(axis=1)
    return total


def compute_covariance(data: ExceedanceCounts, fitted: Probit) -> Floats:
    """Compute the inverse of Fisher's expected information of intercept and slope for one fit, shape (2, 2)."""
    scaled, scaled_fit, centre, spread = _standardise(data, fitted)
    information = _compute_score_and_information(scaled.as_batch(), np.column_stack(scaled_fit))[1][0]
    transform = np.array([[1.0, -centre / spread], [0.0, 1.0 / spread]])
    return np.asarray(transform @ np.linalg.inv(information) @ transform.T, dtype=np.float64)


def _standardise(data: ExceedanceCounts, fitted: Probit) -> tuple[ExceedanceCounts, Probit, float, float]:
    """Standardise z in data and fits for accuracy, and return mean and deviation of z as well."""
    centre, spread = float(data.log_x.mean()), float(data.log_x.std())
    scaled = data._replace(log_x=(data.log_x - centre) / spread)
    return scaled, Probit(fitted.intercept + fitted.slope * centre, fitted.slope * spread), centre, spread


def group_outcomes(log_x: Floats, trial_counts: Floats) -> Integers:
    """Assign outcomes to groups: by intensity if each has five outcomes or more, else up to ten equal groups."""
    intensity_index = np.unique(log_x, return_inverse=True)[1]
    counts_by_intensity = np.bincount(intensity_index, trial_counts)
    if counts_by_intensity.min() >= _MIN_GROUP_SIZE:
        return np.asarray(intensity_index, dtype=np.int64)
    group_count = min(10, int(trial_counts.sum()) // _MIN_GROUP_SIZE)
    midpoints = (np.cumsum(counts_by_intensity) - 0.5 * counts_by_intensity) / counts_by_intensity.sum()
    _, group = np.unique((midpoints * group_count).astype(np.int64), return_inverse=True)
    return np.asarray(group[intensity_index], dtype=np.int64)


def compute_goodness(data: ExceedanceCounts, fitted: Probit, *, is_independent: bool) -> Goodness:
    """Test the fit by Pearson's statistic of groups of outcomes."""
    from scipy.special import gammaincc

    groups = group_outcomes(data.log_x, data.trial_counts)
    probability = compute_probabilities(fitted, data.log_x)[0]
    expected = np.bincount(groups, data.trial_counts * probability)
    variance = np.bincount(groups, data.trial_counts * (probability * (1.0 - probability)))
    observed = np.bincount(groups, data.exceedance_counts)
    degrees_of_freedom = len(observed) - 2
    if degrees_of_freedom < 1:
        return Goodness(math.nan, max(degrees_of_freedom, 0), math.nan)
    # If a group's variance vanishes, the fitted probability is 0 or 1, as observed.
    with np.errstate(over="ignore"):
        statistic = float(np.sum((observed - expected) ** 2 / np.maximum(variance, np.finfo(float).tiny)))
    p_value = float(gammaincc(0.5 * degrees_of_freedom, 0.5 * statistic)) if is_independent else math.nan
    return Goodness(statistic, degrees_of_freedom, p_value)


def _compute_overlap(log_x: Floats) -> float:
    """Compute the largest overlap of both kinds of outcomes that is too narrow to determine a slope."""
    return 1e-6 * float(log_x.max() - log_x.min())


def _is_rising(data: ExceedanceCounts) -> Flags:
    """Whether the likelihood of each data set increases with the slope of a level curve."""
    log_x, exceedances, trial_counts = data
    centred = log_x - log_x.mean()
    share = exceedances.sum(axis=1, keepdims=True) / trial_counts.sum(axis=1, keepdims=True)
    score = np.sum((exceedances - trial_counts * share) * centred, axis=1)
    return np.asarray(score > 1e-12 * np.sum(trial_counts * np.abs(centred), axis=1))


def _solve_two_equations(matrix: Floats, right_side: Floats) -> Floats:
    """Solve symmetric positive systems of two equations, shapes (fits or 1, 2, 2) and (fits, 2)."""
    a, b, c = matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 1]
    ratio = b / a
    second = (right_side[:, 1] - ratio * right_side[:, 0]) / (c - ratio * b)
    return np.stack([right_side[:, 0] / a - ratio * second, second], axis=1)


def _compute_score_and_information(data: ExceedanceCounts, beta: Floats) -> tuple[Floats, Floats]:
    """Compute score and Fisher's expected information, shapes (fits, 2) and (fits, 2, 2)."""
    log_x, exceedances, trial_counts = data
    density, log_below, log_above = _compute_log_normals(beta[:, :1] + beta[:, 1:] * log_x)
    residual = exceedances * np.exp(density - log_below) - (trial_counts - exceedances) * np.exp(density - log_above)
    weight = trial_counts * np.exp(2.0 * density - log_below - log_above)
    powers = np.stack([np.ones_like(log_x), log_x])
    return np.einsum("fn,jn->fj", residual, powers), np.einsum("fn,jn,kn->fjk", weight, powers, powers)


def _compute_log_normals(scores: Floats) -> tuple[Floats, Floats, Floats]:
    """Compute logarithms of the normal density, and of the probabilities below and above."""
    from scipy.special import log_ndtr

    return -0.5 * scores * scores - 0.5 * math.log(2.0 * math.pi), log_ndtr(scores), log_ndtr(-scores)


def _shorten_steps(data: ExceedanceCounts, beta: Floats, step: Floats, likelihoods: Floats) -> tuple[Floats, Floats]:
    """Halve steps until the likelihood does not decrease, and return steps and likelihoods."""
    new_likelihoods = compute_log_likelihood(data, beta + step)
    for _ in range(_MAX_ITERATIONS):
        is_lower = ~(new_likelihoods >= likelihoods - 1e-12 * np.abs(likelihoods))
        if not is_lower.any():
            break
        step[is_lower] *= 0.5
        new_likelihoods[is_lower] = compute_log_likelihood(data.select(is_lower), (beta + step)[is_lower])
    return step, new_likelihoods


def compute_confidence_region(
    data: ExceedanceCounts, fitted: Probit, clusters: Integers | None, confidence: float
) -> Probit:
    """Find fits on the boundary of the confidence region, without curves that fall.

    Intervals are extremes in this region, as for the profile likelihood. For clusters of several outcomes the region is
    stretched to their covariance (Chandler and Bate 2007) with Student's distribution. For fewer than three clusters it
    is the whole plane. Without clusters all outcomes are independent.
    """
    from scipy.special import chdtri, stdtrit

    scaled, best_fit, centre, spread = _standardise(data, fitted)
    if clusters is None:
        boundary = _trace_region(scaled, best_fit, 0.5 * float(chdtri(1.0, 1.0 - confidence)))
    elif (cluster_count := int(clusters.max()) + 1) < MIN_CLUSTERS:
        return _WHOLE_PLANE
    else:
        maximum = np.column_stack(best_fit)
        drop = 0.5 * float(stdtrit(cluster_count - 1.0, 0.5 + 0.5 * confidence)) ** 2
        offsets = _trace_region(scaled, best_fit, drop) - maximum
        boundary = maximum + offsets @ _compute_stretch_matrix(scaled, clusters, best_fit).T
    intercepts, slopes = _cut_at_zero_slope(boundary).T
    slopes = slopes / spread
    return Probit(intercepts - slopes * centre, slopes)


def _trace_region(data: ExceedanceCounts, best: Probit, drop: float) -> Floats:
    """Trace the points around the maximum at which the log-likelihood is lower by `drop`, shape (rays, 2)."""
    log_x, index = np.unique(data.log_x, return_inverse=True)
    merged = ExceedanceCounts(log_x, *(np.bincount(index, counts).astype(np.float64) for counts in data[1:]))
    rays = ExceedanceCounts(log_x, *(np.broadcast_to(counts, (_RAY_COUNT, log_x.size)) for counts in merged[1:]))
    maximum = np.column_stack(best)
    floor = compute_log_likelihood(merged.as_batch(), maximum)[0] - drop
    angle = np.linspace(0.0, 2.0 * math.pi, _RAY_COUNT, endpoint=False)
    root = np.linalg.cholesky(compute_covariance(merged, best))
    directions = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ root.T
    distance = np.ones(_RAY_COUNT)
    for _ in range(100):
        is_inside = compute_log_likelihood(rays, maximum + distance[:, None] * directions) > floor
        if not is_inside.any():
            break
        distance[is_inside] *= 2.0
    # From outside, Newton's method does not overshoot the root of a concave function.
    for _ in range(80):
        points = maximum + distance[:, None] * directions
        excess = compute_log_likelihood(rays, points) - floor
        with np.errstate(over="ignore", invalid="ignore"):
            descent = -np.sum(_compute_score_and_information(rays, points)[0] * directions, axis=1)
        is_outside = (excess < 0.0) & (descent > 0.0)
        step = excess[is_outside] / descent[is_outside]
        distance[is_outside] += step
        if np.all(np.abs(step) <= _RAY_TOLERANCE * distance[is_outside]):
            break
    return np.asarray(maximum + distance[:, None] * directions)


def _cut_at_zero_slope(boundary: Floats) -> Floats:
    """Cut the region off at slope 0."""
    (intercept, slope), (next_intercept, next_slope) = boundary.T, np.roll(boundary, -1, axis=0).T
    is_rising = slope >= 0.0
    is_crossing = is_rising != (next_slope >= 0.0)
    share = slope[is_crossing] / (slope[is_crossing] - next_slope[is_crossing])
    corners = intercept[is_crossing] + share * (next_intercept[is_crossing] - intercept[is_crossing])
    return np.vstack([boundary[is_rising], np.column_stack([corners, np.zeros(share.size)])])


def _compute_stretch_matrix(data: ExceedanceCounts, clusters: Integers, best: Probit) -> Floats:
    """Compute the linear map from the covariance of the likelihood to the covariance of the clusters."""
    scores, informations = _sum_by_cluster(data, clusters, best)
    count = len(scores)
    root = np.linalg.cholesky(np.linalg.inv(informations.sum(axis=0)))
    # Without the cluster, the information is smaller by its leverage, so that its score moves the parameters further.
    leverage, axes = np.linalg.eigh(root.T @ informations @ root)
    corrections = np.einsum("cij,cj,ckj->cik", axes, 1.0 / (1.0 - np.minimum(leverage, 0.9)), axes)
    shifts = np.einsum("cij,cj->ci", corrections, scores @ root)
    variance, axis = np.linalg.eigh(shifts.T @ shifts * (count - 1.0) / count)
    deviation = axis * np.sqrt(np.maximum(variance, 0.0)) @ axis.T
    return np.asarray(root @ deviation @ np.linalg.inv(root))


def _sum_by_cluster(data: ExceedanceCounts, clusters: Integers, fitted: Probit) -> tuple[Floats, Floats]:
    """Sum score and observed information of each cluster, shapes (clusters, 2) and (clusters, 2, 2)."""
    log_x, exceedances, trial_counts = data
    z_scores = fitted.intercept + fitted.slope * log_x
    density, log_below, log_above = _compute_log_normals(z_scores)
    ratio_below, ratio_above = np.exp(density - log_below), np.exp(density - log_above)
    weight_below, weight_above = exceedances * ratio_below, (trial_counts - exceedances) * ratio_above
    score = weight_below - weight_above
    information = weight_below * (ratio_below + z_scores) + weight_above * (ratio_above - z_scores)
    powers = np.ones_like(log_x), log_x, log_x * log_x
    scores = np.stack([np.bincount(clusters, score * power) for power in powers[:2]], axis=1)
    level, mixed, square = (np.bincount(clusters, information * power) for power in powers)
    informations = np.stack([level, mixed, mixed, square], axis=1).reshape(-1, 2, 2)
    return np.asarray(scores, dtype=np.float64), np.asarray(informations, dtype=np.float64)
