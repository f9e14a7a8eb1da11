"""Maximum likelihood for a lognormal fragility.

The probability of exceedance at intensity x is Phi(ln(x/median)/dispersion). In z = ln x it is a probit, Phi(a + b z)
with b = 1/dispersion and a = -b ln(median), whose likelihood is concave: it has one maximum, or none where the outcomes
are separated.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from rocking.core.arrays import Flags, Floats, Integers

_ITERATIONS: Final = 100


#: Slope that stands for a step.
STEEP: Final = 1e9

#: Outcomes in a group of the test of fit, at least; and groups of binary outcomes, at most (Hosmer and Lemeshow).
_GROUP: Final = 5


class Outcomes(NamedTuple):
    """Outcomes that exceeded, of how many trials, at n logarithms of the intensity, of one data set or of several."""

    z: Floats
    exceeded: Floats
    trials: Floats

    def alone(self) -> Outcomes:
        """Return one data set as several, of which there is one."""
        return Outcomes(self.z, self.exceeded[None, :], self.trials[None, :])

    def of(self, sets: Flags) -> Outcomes:
        """Return some of several data sets."""
        return Outcomes(self.z, self.exceeded[sets], self.trials[sets])


class Probit(NamedTuple):
    """Parameters of one or many fits: probabilities are Phi(intercept + slope ln x) at intensities x.

    Attributes
    ----------
    intercept, slope : ndarray, shape (fits,)
        Those of a single fit have one entry.
    """

    intercept: Floats
    slope: Floats

    def __repr__(self) -> str:
        if len(self.slope) > 1:
            return f"<Probit: {len(self.slope)} fits>"
        return f"<Probit: intercept {float(self.intercept[0]):.5g}, slope {float(self.slope[0]):.5g}>"


def normal_scores(fits: Probit, z: Floats) -> Floats:
    """Return normal scores of the probability at logarithms of the intensity, shape (fits, len(z)); -inf at 0."""
    finite = np.isfinite(z)
    at = fits.intercept[:, None] + fits.slope[:, None] * np.where(finite, z, 0.0)
    return np.where(finite, at, z)


def probabilities(fits: Probit, z: Floats) -> Floats:
    """Return probabilities at logarithms of the intensity, shape (fits, len(z))."""
    from scipy.special import ndtr

    result: Floats = ndtr(normal_scores(fits, z))
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
        Probability of a larger gain if the intensity did not matter (chi-squared, one degree of freedom); NaN where
        outcomes belong together.
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
        Probability of a larger statistic if the lognormal is right; NaN with fewer than three groups, and where
        outcomes belong together.
    """

    statistic: float
    freedom: int
    p_value: float


def merge_equal_intensities(intensity: Floats) -> Floats:
    """Return intensities of which those that differ by rounding alone, as those of scaled motions, are one."""
    order = np.argsort(intensity, kind="stable")
    ordered = intensity[order]
    grows = np.diff(np.log(ordered), prepend=-np.inf) > 1e-9
    found = np.empty_like(ordered)
    found[order] = ordered[grows][np.cumsum(grows) - 1]
    return found


def unidentified(data: Outcomes, shown: Callable[[float], str]) -> str | None:
    """Say why no rising lognormal fits a data set best, intensities as `shown` writes them; None where one does."""
    z, exceeded, trials = data
    yes, no, count = z[exceeded > 0], z[exceeded < trials], round(float(trials.sum()))
    if not yes.size:
        which = "the only outcome does not exceed" if count == 1 else f"none of the {count} outcomes exceeds"
        return f"{which} the limit, {_tried(z, shown)}: stronger motions are needed"
    if not no.size:
        which = "the only outcome exceeds" if count == 1 else f"all of the {count} outcomes exceed"
        return f"{which} the limit, {_tried(z, shown)}: weaker motions are needed"
    if z.min() == z.max():
        return f"all outcomes are at one intensity, {shown(math.exp(z[0]))}: others are needed"
    if no.max() <= yes.min() + _overlap(z):
        low, high = math.exp(no.max()), math.exp(yes.min())
        where = (
            f"below {shown(low)} and all do above it"
            if low >= high
            else f"up to {shown(low)} and all do from {shown(high)} on"
        )
        return (
            f"the outcomes are separated, none exceeds the limit {where}: the fragility is a step there, and motions "
            "near it are needed"
        )
    if not _rises(data.alone())[0]:
        return (
            "the outcomes contradict a curve that rises, the limit is exceeded no more often at higher intensities: "
            "another measure or more motions are needed"
        )
    return None


def _tried(z: Floats, shown: Callable[[float], str]) -> str:
    """Say at which intensities outcomes are."""
    low, high = (shown(math.exp(end)) for end in (z.min(), z.max()))
    return f"at {low}" if low == high else f"at {low} to {high}"


def fit(data: Outcomes) -> Probit:
    """Fit several data sets, none of them `unidentified`, by maximum likelihood (Fisher's scoring)."""
    centre, spread = data.z.mean(), data.z.std()
    scaled = data._replace(z=(data.z - centre) / spread)
    beta = np.zeros((len(data.trials), 2))
    now = likelihood(scaled, beta)
    powers = np.stack([np.ones_like(scaled.z), scaled.z])
    most = np.einsum("fn,jn,kn->fjk", data.trials, powers, powers)
    for _ in range(_ITERATIONS):
        with np.errstate(all="ignore"):
            gradient, information = scores(scaled, beta)
            step = solved(information, gradient)
        # Far from the maximum the information may vanish to rounding; the complete data's (EM) still leads uphill.
        lost = ~np.isfinite(step).all(axis=1)
        step[lost] = solved(most[lost], gradient[lost])
        step, then = _uphill(scaled, beta, step, now)
        beta, now = beta + step, then
        if np.all(np.abs(step) <= 1e-11 * np.abs(beta).max(axis=1, keepdims=True)):
            break
    slope = beta[:, 1] / spread
    return Probit(beta[:, 0] - slope * centre, slope)


def likelihood(data: Outcomes, beta: Floats) -> Floats:
    """Logarithm of the likelihood of parameters (fits, 2), without binomial coefficients."""
    from scipy.special import log_ndtr

    z, exceeded, trials = data
    at = beta[:, :1] + beta[:, 1:] * z
    terms = np.where(exceeded > 0, exceeded * log_ndtr(at), 0.0)
    terms += np.where(exceeded < trials, (trials - exceeded) * log_ndtr(-at), 0.0)
    total: Floats = terms.sum(axis=1)
    return total


def covariance(data: Outcomes, fitted: Probit) -> Floats:
    """Inverse of Fisher's expected information of intercept and slope, shape (2, 2), of one fit."""
    scaled, about, centre, spread = standardised(data, fitted)
    counts = scaled._replace(exceeded=np.zeros_like(data.trials))
    change = np.array([[1.0, -centre / spread], [0.0, 1.0 / spread]])
    return np.asarray(change @ np.linalg.inv(scores(counts, np.column_stack(about))[1][0]) @ change.T, dtype=np.float64)


def standardised(data: Outcomes, fitted: Probit) -> tuple[Outcomes, Probit, float, float]:
    """Return data and fits with z about its mean and over its deviation, and these two, so that digits suffice."""
    centre, spread = float(data.z.mean()), float(data.z.std())
    scaled = data._replace(z=(data.z - centre) / spread)
    return scaled, Probit(fitted.intercept + fitted.slope * centre, fitted.slope * spread), centre, spread


def gain(data: Outcomes, fitted: Probit, *, independent: bool) -> Likelihood:
    """Likelihood of one fit, and its gain over one probability for all intensities."""
    from scipy.special import gammaincc, xlogy

    here = likelihood(data.alone(), np.column_stack(fitted))
    yes, total = data.exceeded.sum(), data.trials.sum()
    without = xlogy(yes, yes / total) + xlogy(total - yes, 1.0 - yes / total)
    ratio = max(0.0, 2.0 * float(here[0] - without))
    return Likelihood(float(here[0]), ratio, float(gammaincc(0.5, 0.5 * ratio)) if independent else math.nan)


def groups(z: Floats, trials: Floats) -> Integers:
    """Group of each outcome: the intensities where each has five outcomes or more, else up to ten equal groups."""
    level = np.unique(z, return_inverse=True)[1]
    held = np.bincount(level, trials)
    if held.min() >= _GROUP:
        return np.asarray(level, dtype=np.int64)
    wanted = min(10, int(trials.sum()) // _GROUP)
    middle = (np.cumsum(held) - 0.5 * held) / held.sum()
    _, group = np.unique((middle * wanted).astype(np.int64), return_inverse=True)
    return np.asarray(group[level], dtype=np.int64)


def goodness(data: Outcomes, fitted: Probit, *, independent: bool) -> Goodness:
    """Test the fit in its `groups`."""
    from scipy.special import gammaincc

    group = groups(data.z, data.trials)
    chance = probabilities(fitted, data.z)[0]
    expected, variance = (np.bincount(group, data.trials * terms) for terms in (chance, chance * (1.0 - chance)))
    seen = np.bincount(group, data.exceeded)
    freedom = len(seen) - 2
    if freedom < 1:
        return Goodness(math.nan, max(freedom, 0), math.nan)
    # A group whose variance vanishes is one that the fit is certain of, and right about.
    with np.errstate(over="ignore"):
        statistic = float(np.sum((seen - expected) ** 2 / np.maximum(variance, np.finfo(float).tiny)))
    chance_of_more = float(gammaincc(0.5 * freedom, 0.5 * statistic)) if independent else math.nan
    return Goodness(statistic, freedom, chance_of_more)


def limits(data: Outcomes) -> tuple[Probit, Flags]:
    """Limits that likelihoods of rising curves without a maximum tend to, and which of the fits have a maximum."""
    from scipy.special import ndtri

    z, exceeded, trials = data
    yes, no = exceeded > 0, exceeded < trials
    lowest_yes, highest_no = np.where(yes, z, np.inf).min(axis=1), np.where(no, z, -np.inf).max(axis=1)
    never, always = ~yes.any(axis=1), ~no.any(axis=1)
    step = (highest_no <= lowest_yes + _overlap(z)) & ~never & ~always
    slope = np.where(step, STEEP, 0.0)
    # A curve that would fall is level at best: one probability, 0 or 1 without either kind of outcome.
    intercept = ndtri(exceeded.sum(axis=1) / trials.sum(axis=1))
    intercept[step] = -0.5 * STEEP * (highest_no + lowest_yes)[step]
    return Probit(intercept, slope), ~step & _rises(data)


def fit_or_limits(data: Outcomes) -> tuple[Probit, Flags]:
    """Fit several data sets, by limits where a likelihood has no maximum; and which of them have one."""
    fits, regular = limits(data)
    if regular.any():
        found = fit(data.of(regular))
        fits.intercept[regular], fits.slope[regular] = found.intercept, found.slope
    return fits, regular


def _overlap(z: Floats) -> float:
    """Overlap of the outcomes of either kind that is too narrow for a slope to be found from it."""
    return 1e-6 * float(z.max() - z.min())


def _rises(data: Outcomes) -> Flags:
    """Whether the likelihood of each data set grows as the level curve begins to rise."""
    z, exceeded, trials = data
    centred = z - z.mean()
    share = exceeded.sum(axis=1, keepdims=True) / trials.sum(axis=1, keepdims=True)
    pull = np.sum((exceeded - trials * share) * centred, axis=1)
    return np.asarray(pull > 1e-12 * np.sum(trials * np.abs(centred), axis=1))


def solved(matrix: Floats, right: Floats) -> Floats:
    """Solve symmetric positive systems of two equations, shapes (fits or 1, 2, 2) and (fits, 2)."""
    a, b, c = matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 1]
    ratio = b / a
    second = (right[:, 1] - ratio * right[:, 0]) / (c - ratio * b)
    return np.stack([right[:, 0] / a - ratio * second, second], axis=1)


def scores(data: Outcomes, beta: Floats) -> tuple[Floats, Floats]:
    """Gradient of the likelihood and Fisher's expected information, shapes (fits, 2) and (fits, 2, 2)."""
    z, exceeded, trials = data
    density, below, above = logarithms(beta[:, :1] + beta[:, 1:] * z)
    pull = exceeded * np.exp(density - below) - (trials - exceeded) * np.exp(density - above)
    weight = trials * np.exp(2.0 * density - below - above)
    powers = np.stack([np.ones_like(z), z])
    return np.einsum("fn,jn->fj", pull, powers), np.einsum("fn,jn,kn->fjk", weight, powers, powers)


def logarithms(at: Floats) -> tuple[Floats, Floats, Floats]:
    """Logarithms of the normal density, and of the probabilities below and above."""
    from scipy.special import log_ndtr

    return -0.5 * at * at - 0.5 * math.log(2.0 * math.pi), log_ndtr(at), log_ndtr(-at)


def _uphill(data: Outcomes, beta: Floats, step: Floats, now: Floats) -> tuple[Floats, Floats]:
    """Halve steps until the likelihood does not fall; return them and the likelihoods there."""
    then = likelihood(data, beta + step)
    for _ in range(_ITERATIONS):
        falling = ~(then >= now - 1e-12 * np.abs(now))
        if not falling.any():
            break
        step[falling] *= 0.5
        then[falling] = likelihood(data.of(falling), (beta + step)[falling])
    return step, then
