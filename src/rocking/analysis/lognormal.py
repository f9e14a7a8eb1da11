"""Maximum likelihood for a lognormal fragility: probability Phi(ln(x/median)/dispersion) of exceedance at intensity x.

In z = ln x it is a probit, Phi(a + b z) with b = 1/dispersion and a = -b ln(median), whose likelihood is concave: it
has one maximum, or none where the outcomes are separated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.kernels.state import Floats, Integers

_ITERATIONS: Final = 100
#: The likelihood is at its maximum when the parameters move by less than this part of themselves.
_CONVERGED: Final = 1e-11

#: Slope that stands for a step.
STEEP: Final = 1e9

#: Outcomes in a group of the test of fit, at least.
_GROUP: Final = 5
#: Groups that binary outcomes are put in, at most (Hosmer and Lemeshow).
_GROUPS: Final = 10


class Probit(NamedTuple):
    """Parameters of one or many fits, along the first axis: intercept and slope, in the logarithm of the intensity."""

    intercept: Floats
    slope: Floats

    def probability(self, z: Floats) -> Floats:
        """Probability at logarithms of the intensity, shape (fits, len(z))."""
        from scipy.special import ndtr

        at = self.intercept[:, None] + self.slope[:, None] * z
        result: Floats = ndtr(at)
        return result


@dataclass(frozen=True)
class Likelihood:
    """Likelihood of a fit.

    Attributes
    ----------
    logarithm : float
        Without binomial coefficients.
    ratio : float
        Twice its gain over one probability for all intensities.
    p_value : float
        Probability of a larger gain if the intensity did not matter (chi-squared, one degree of freedom).
    """

    logarithm: float
    ratio: float
    p_value: float


@dataclass(frozen=True)
class Goodness:
    """Pearson's test of fit between groups of outcomes and the fitted probabilities.

    Attributes
    ----------
    statistic : float
        Sum over groups of (seen - expected)^2/variance.
    freedom : int
        Groups less two.
    p_value : float
        Probability of a larger statistic if the lognormal is right; NaN with fewer than three groups.
    """

    statistic: float
    freedom: int
    p_value: float


def separation(z: Floats, exceeded: Floats, trials: Floats) -> str | None:
    """Say why no lognormal fits best; None where one does.

    Parameters
    ----------
    z : ndarray, shape (n,)
        Logarithms of the intensity.
    exceeded, trials : ndarray, shape (n,)
        Outcomes that exceeded, of how many, at each.
    """
    yes, no = z[exceeded > 0], z[exceeded < trials]
    if not yes.size:
        return f"none of the {_count(trials)} outcomes exceeds the limit: stronger motions are needed"
    if not no.size:
        return f"all of the {_count(trials)} outcomes exceed the limit: weaker motions are needed"
    if no.max() <= yes.min():
        return (
            f"the outcomes are separated, none exceeds the limit up to {math.exp(no.max()):.6g} and all do from "
            f"{math.exp(yes.min()):.6g} on: the fragility is a step there, and motions in between are needed"
        )
    if yes.max() <= no.min():
        return "the outcomes are separated the wrong way round: the limit is exceeded by the weakest motions only"
    return None


def fit(z: Floats, exceeded: Floats, trials: Floats) -> Probit:
    """Fit many data sets by maximum likelihood, by Fisher's scoring.

    Parameters
    ----------
    z : ndarray, shape (n,)
        Logarithms of the intensity.
    exceeded, trials : ndarray, shape (fits, n)
        Outcomes that exceeded, of how many, at each; not separated.
    """
    centre = z.mean()
    spread = z.std()
    zero_one = (z - centre) / spread
    beta = np.zeros((len(trials), 2))
    now = likelihood(zero_one, exceeded, trials, beta)
    for _ in range(_ITERATIONS):
        gradient, information = _scores(zero_one, exceeded, trials, beta)
        step = np.asarray(np.linalg.solve(information, gradient[..., None])[..., 0], dtype=np.float64)
        step, then = _uphill(zero_one, exceeded, trials, beta, step, now)
        beta, now = beta + step, then
        if np.all(np.abs(step) <= _CONVERGED * np.abs(beta).max(axis=1, keepdims=True)):
            break
    slope = beta[:, 1] / spread
    return Probit(beta[:, 0] - slope * centre, slope)


def likelihood(z: Floats, exceeded: Floats, trials: Floats, beta: Floats) -> Floats:
    """Logarithm of the likelihood of parameters (fits, 2), without binomial coefficients."""
    from scipy.special import log_ndtr

    at = beta[:, :1] + beta[:, 1:] * z
    terms = np.where(exceeded > 0, exceeded * log_ndtr(at), 0.0)
    terms += np.where(exceeded < trials, (trials - exceeded) * log_ndtr(-at), 0.0)
    total: Floats = terms.sum(axis=1)
    return total


def covariance(z: Floats, trials: Floats, fitted: Probit) -> Floats:
    """Inverse of Fisher's expected information of intercept and slope, shape (2, 2), of one fit."""
    beta = np.column_stack([fitted.intercept, fitted.slope])
    information = _scores(z, np.zeros_like(trials), trials, beta)[1][0]
    return np.asarray(np.linalg.inv(information), dtype=np.float64)


def gain(z: Floats, exceeded: Floats, trials: Floats, fitted: Probit) -> Likelihood:
    """Likelihood of one fit, and its gain over one probability for all intensities."""
    from scipy.special import gammaincc, xlogy

    here = likelihood(z, exceeded[None, :], trials[None, :], np.column_stack([fitted.intercept, fitted.slope]))
    yes, total = exceeded.sum(), trials.sum()
    without = xlogy(yes, yes / total) + xlogy(total - yes, 1.0 - yes / total)
    ratio = max(0.0, 2.0 * float(here[0] - without))
    return Likelihood(float(here[0]), ratio, float(gammaincc(0.5, 0.5 * ratio)))


def groups(z: Floats, trials: Floats) -> Integers:
    """Group of each outcome: the intensities where each has five outcomes or more, else up to ten equal groups."""
    level = np.unique(z, return_inverse=True)[1]
    held = np.bincount(level, trials)
    if held.min() >= _GROUP:
        return np.asarray(level, dtype=np.int64)
    wanted = min(_GROUPS, int(trials.sum()) // _GROUP)
    middle = (np.cumsum(held) - 0.5 * held) / held.sum()
    _, group = np.unique((middle * wanted).astype(np.int64), return_inverse=True)
    return np.asarray(group[level], dtype=np.int64)


def goodness(z: Floats, exceeded: Floats, trials: Floats, fitted: Probit) -> Goodness:
    """Test the fit in its `groups`."""
    from scipy.special import gammaincc

    group = groups(z, trials)
    chance = fitted.probability(z)[0]
    expected, variance = (np.bincount(group, trials * terms) for terms in (chance, chance * (1.0 - chance)))
    seen = np.bincount(group, exceeded)
    freedom = len(seen) - 2
    if freedom < 1:
        return Goodness(math.nan, max(freedom, 0), math.nan)
    # A group whose variance vanishes is one that the fit is certain of, and right about.
    statistic = float(np.sum((seen - expected) ** 2 / np.maximum(variance, np.finfo(float).tiny)))
    return Goodness(statistic, freedom, float(gammaincc(0.5 * freedom, 0.5 * statistic)))


def resampled(
    z: Floats, exceeded: Floats, trials: Floats, clusters: Integers, samples: int, seed: int
) -> tuple[Probit, int]:
    """Fit data sets drawn anew from the clusters, with replacement; and count those that have no best fit.

    These are what the likelihood tends to: a step between separated outcomes, 0 or 1 everywhere without either kind.
    """
    order = np.argsort(z, kind="stable")
    starts = np.flatnonzero(np.diff(z[order], prepend=-np.inf))
    count = int(clusters.max()) + 1
    drawn = np.random.default_rng(seed).multinomial(count, np.full(count, 1.0 / count), size=samples)
    weights = drawn[:, clusters[order]]
    levels = z[order][starts]
    yes, all_of = (np.add.reduceat(weights * values[order], starts, axis=1) for values in (exceeded, trials))
    fits, overlap = _limits(levels, yes, all_of)
    if overlap.any():
        fitted = fit(levels, yes[overlap], all_of[overlap])
        fits.intercept[overlap], fits.slope[overlap] = fitted.intercept, fitted.slope
    return fits, samples - int(overlap.sum())


def corrected_percentiles(replicates: Floats, estimate: Floats, confidence: float) -> tuple[Floats, Floats]:
    """Return the ends of intervals from the bootstrap: percentiles, corrected for the median bias (Efron 1981).

    Parameters
    ----------
    replicates : ndarray, shape (fits, n)
        Resampled values of n quantities.
    estimate : ndarray, shape (n,)
        Their estimates.
    confidence : float
        Probability that an interval shall hold the true value.
    """
    from scipy.special import ndtr, ndtri

    count = len(replicates)
    below = (np.sum(replicates < estimate, axis=0) + 0.5 * np.sum(replicates == estimate, axis=0)) / count
    bias = ndtri(np.clip(below, 0.5 / count, 1.0 - 0.5 / count))
    reach = ndtri(0.5 + 0.5 * confidence)
    ordered = np.sort(replicates, axis=0)
    low, high = (
        np.take_along_axis(ordered, rounded((count - 1) * ndtr(2.0 * bias + end)).astype(np.int64)[None, :], axis=0)[0]
        for rounded, end in ((np.floor, -reach), (np.ceil, reach))
    )
    return low, high


def _limits(z: Floats, exceeded: Floats, trials: Floats) -> tuple[Probit, NDArray[np.bool_]]:
    """Limits that likelihoods without a maximum tend to, and which of the fits have a maximum."""
    yes, no = exceeded > 0, exceeded < trials
    lowest_yes, highest_yes = np.where(yes, z, np.inf).min(axis=1), np.where(yes, z, -np.inf).max(axis=1)
    lowest_no, highest_no = np.where(no, z, np.inf).min(axis=1), np.where(no, z, -np.inf).max(axis=1)
    rising, falling = highest_no <= lowest_yes, highest_yes <= lowest_no
    never, always = ~yes.any(axis=1), ~no.any(axis=1)
    middle = np.where(rising, highest_no + lowest_yes, highest_yes + lowest_no) / 2.0
    slope = np.where(rising, STEEP, -STEEP)
    slope[never | always] = 0.0
    with np.errstate(invalid="ignore"):
        intercept = -slope * middle
    intercept[never], intercept[always] = -np.inf, np.inf
    return Probit(intercept, slope), ~(rising | falling)


def _scores(z: Floats, exceeded: Floats, trials: Floats, beta: Floats) -> tuple[Floats, Floats]:
    """Gradient of the likelihood and Fisher's expected information, shapes (fits, 2) and (fits, 2, 2)."""
    from scipy.special import log_ndtr

    at = beta[:, :1] + beta[:, 1:] * z
    density, below, above = -0.5 * at * at - 0.5 * math.log(2.0 * math.pi), log_ndtr(at), log_ndtr(-at)
    pull = exceeded * np.exp(density - below) - (trials - exceeded) * np.exp(density - above)
    weight = trials * np.exp(2.0 * density - below - above)
    powers = np.stack([np.ones_like(z), z])
    gradient = np.einsum("fn,jn->fj", pull, powers)
    return gradient, np.einsum("fn,jn,kn->fjk", weight, powers, powers)


def _uphill(
    z: Floats, exceeded: Floats, trials: Floats, beta: Floats, step: Floats, now: Floats
) -> tuple[Floats, Floats]:
    """Halve steps until the likelihood does not fall; return them and the likelihoods there."""
    then = likelihood(z, exceeded, trials, beta + step)
    for _ in range(_ITERATIONS):
        falling = ~(then >= now - 1e-12 * np.abs(now))
        if not falling.any():
            break
        step[falling] *= 0.5
        then[falling] = likelihood(z, exceeded[falling], trials[falling], (beta + step)[falling])
    return step, then


def _count(trials: Floats) -> int:
    return int(trials.sum())
