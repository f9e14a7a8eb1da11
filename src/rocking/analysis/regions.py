"""Confidence in a fitted lognormal: the region of its likelihood, or fits to data drawn anew.

Both give an interval for any quantity of the curve's intercept and slope, and both know that a fragility rises.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from rocking.analysis.probit import (
    STEEP,
    Outcomes,
    Probit,
    covariance,
    fit_or_limits,
    likelihood,
    logarithms,
    scores,
    solved,
    standardised,
)
from rocking.core.arrays import Floats, Integers

#: Directions in which a region is measured: between them 4e-5 of an interval's width is lost.
_RAYS: Final = 360

#: Relative difference of two quantities that are the same but for rounding.
_SAME: Final = 1e-9

#: Clusters that tell how far they differ, at least; and the most that one may weigh in its own leaving out.
FEWEST: Final = 3

#: Level curves at 0 and 1, and steps at intensities below and above all that there are.
_STEPS_AT: Final = 1000.0 * STEEP
_WHOLE_PLANE: Final = Probit(np.array([-np.inf, np.inf, _STEPS_AT, -_STEPS_AT]), np.array([0.0, 0.0, STEEP, STEEP]))

Quantity = Callable[[Probit], Floats]
Ends = tuple[Floats, Floats]


@dataclass(frozen=True, eq=False)
class LikelyRegion:
    """Parameters whose likelihood is not significantly below the maximum: intervals are of the profile likelihood.

    The region is convex, and ends where curves no longer rise. Where clusters hold several outcomes each, it is
    stretched to the covariance of the clusters (Chandler and Bate 2007) by Student's distribution. With fewer than
    three clusters it is the whole plane.
    """

    boundary: Probit

    def __repr__(self) -> str:
        return f"<LikelyRegion: {len(self.boundary.slope)} fits on its boundary>"

    @property
    def bounded(self) -> bool:
        """Whether the data bound anything at all."""
        return bool(np.all(np.isfinite(self.boundary.intercept)))

    @classmethod
    def of(cls, data: Outcomes, fitted: Probit, clusters: Integers | None, confidence: float) -> LikelyRegion:
        """Measure the region from the maximum outwards; without clusters every outcome is on its own."""
        from scipy.special import chdtri, stdtrit

        scaled, best, centre, spread = standardised(data, fitted)
        if clusters is None:
            around = _around(scaled, best, 0.5 * float(chdtri(1.0, 1.0 - confidence)))
        elif (count := int(clusters.max()) + 1) < FEWEST:
            return cls(_WHOLE_PLANE)
        else:
            around = _around(scaled, best, 0.5 * float(stdtrit(count - 1.0, 0.5 + 0.5 * confidence)) ** 2)
            around = np.column_stack(best) + (around - np.column_stack(best)) @ _stretch(scaled, clusters, best).T
        intercepts, slopes = _cut_where_level(around).T
        slopes = slopes / spread
        return cls(Probit(intercepts - slopes * centre, slopes))

    def interval(self, quantity: Quantity, estimate: Floats, gradient: Floats, confidence: float) -> Ends:
        """Extremes of a quantity."""
        values = quantity(self.boundary)
        return values.min(axis=0), values.max(axis=0)


@dataclass(frozen=True, eq=False)
class Resamples:
    """Fits to data drawn anew from the clusters of outcomes, with replacement; intervals are BCa (Efron 1987).

    The influence (clusters, 2) of a cluster is its score over the observed information. Clusters that are alike have
    one row there, and `alike` is their number.
    """

    fits: Probit
    degenerate: float
    influence: Floats
    alike: Floats

    def __repr__(self) -> str:
        return f"<Resamples: {len(self.fits.slope)} fits, {100 * self.degenerate:.3g} % of them degenerate>"

    @classmethod
    def of(cls, data: Outcomes, fitted: Probit, clusters: Integers | None, samples: int, seed: int) -> Resamples:
        """Draw and fit; without clusters every outcome is on its own."""
        if clusters is None:
            # One outcome of each kind at each intensity, and how many are like it: the outcomes may be very many.
            alike = np.column_stack([data.exceeded, data.trials - data.exceeded]).ravel()
            there, exceeded = alike > 0.0, np.tile([1.0, 0.0], data.z.size)[alike > 0.0]
            data, alike = Outcomes(np.repeat(data.z, 2)[there], exceeded, np.ones_like(exceeded)), alike[there]
            clusters = np.arange(alike.size)
        else:
            alike = np.ones(int(clusters.max()) + 1)
        order = np.argsort(data.z, kind="stable")
        starts = np.flatnonzero(np.diff(data.z[order], prepend=-np.inf))
        count = alike.sum()
        drawn = np.random.default_rng(seed).multinomial(int(count), alike / count, size=samples)
        weights = drawn[:, clusters[order]]
        yes, trials = (np.add.reduceat(weights * values[order], starts, axis=1) for values in data[1:])
        anew = Outcomes(data.z[order][starts], yes, trials)
        fits, regular = fit_or_limits(anew)
        return cls(fits, 1.0 - float(regular.mean()), _influences(data, clusters, alike, fitted), alike)

    def interval(self, quantity: Quantity, estimate: Floats, gradient: Floats, confidence: float) -> Ends:
        """Percentiles of values (fits, n) about estimates (n,) with derivatives (2, n), less bias and skewness."""
        from scipy.special import ndtr, ndtri

        values = quantity(self.fits)
        count = len(values)
        # Data that are drawn again as they are, are fitted to other last digits.
        with np.errstate(invalid="ignore"):
            same = (values == estimate) | (np.abs(values - estimate) <= _SAME * np.maximum(1.0, np.abs(estimate)))
        below = (np.sum((values < estimate) & ~same, axis=0) + 0.5 * np.sum(same, axis=0)) / count
        bias = ndtri(np.clip(below, 0.5 / count, 1.0 - 0.5 / count))
        pulls = self.influence @ gradient
        tiny = np.finfo(float).tiny
        acceleration = self.alike @ pulls**3 / (6.0 * np.maximum((self.alike @ pulls**2) ** 1.5, tiny))
        reach = float(ndtri(0.5 + 0.5 * confidence))
        ordered = np.sort(values, axis=0)
        ends = []
        for rounded, end in ((np.floor, -reach), (np.ceil, reach)):
            share = ndtr(bias + (bias + end) / np.maximum(1.0 - acceleration * (bias + end), tiny))
            place = rounded((count - 1) * share).astype(np.int64)
            ends.append(np.take_along_axis(ordered, place[None, :], axis=0)[0])
        return ends[0], ends[1]


Confidence = LikelyRegion | Resamples


def _around(data: Outcomes, best: Probit, drop: float) -> Floats:
    """Points all around the maximum where the logarithm of the likelihood is lower by `drop`, shape (rays, 2)."""
    z, level = np.unique(data.z, return_inverse=True)
    yes, trials = (
        np.broadcast_to(np.bincount(level, counts).astype(np.float64), (_RAYS, z.size)) for counts in data[1:]
    )
    rays = Outcomes(z, yes, trials)
    top = np.column_stack(best)
    floor = likelihood(Outcomes(z, yes[:1], trials[:1]), top)[0] - drop
    angle = np.linspace(0.0, 2.0 * math.pi, _RAYS, endpoint=False)
    wide = np.linalg.cholesky(covariance(Outcomes(z, yes[0], trials[0]), best))
    directions = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ wide.T
    reach = np.ones(_RAYS)
    for _ in range(100):
        short = likelihood(rays, top + reach[:, None] * directions) > floor
        if not short.any():
            break
        reach[short] *= 2.0
    # From beyond, Newton's rule does not overshoot the root of a concave function.
    for _ in range(80):
        here = top + reach[:, None] * directions
        above = likelihood(rays, here) - floor
        with np.errstate(over="ignore", invalid="ignore"):
            fall = -np.sum(scores(rays, here)[0] * directions, axis=1)
        beyond = (above < 0.0) & (fall > 0.0)
        step = above[beyond] / fall[beyond]
        reach[beyond] += step
        if np.all(np.abs(step) <= _SAME * reach[beyond]):
            break
    return np.asarray(top + reach[:, None] * directions)


def _cut_where_level(around: Floats) -> Floats:
    """Cut the region off where the slope is 0."""
    after = np.roll(around, -1, axis=0)
    (intercept, slope), (next_intercept, next_slope) = around.T, after.T
    up = slope >= 0.0
    cut = up != (next_slope >= 0.0)
    share = slope[cut] / (slope[cut] - next_slope[cut])
    corners = intercept[cut] + share * (next_intercept[cut] - intercept[cut])
    return np.vstack([around[up], np.column_stack([corners, np.zeros(share.size)])])


def _stretch(data: Outcomes, clusters: Integers, best: Probit) -> Floats:
    """Map from the likelihood's covariance to that which the clusters show."""
    pulls, bends = _by_cluster(data, clusters, best)
    count = len(pulls)
    root = np.linalg.cholesky(np.linalg.inv(bends.sum(axis=0)))
    # Without the cluster the information is less by its leverage, so that its score moves the parameters further.
    leverage, axes = np.linalg.eigh(root.T @ bends @ root)
    freed = np.einsum("cij,cj,ckj->cik", axes, 1.0 / (1.0 - np.minimum(leverage, 0.9)), axes)
    moved = np.einsum("cij,cj->ci", freed, pulls @ root)
    variance, axis = np.linalg.eigh(moved.T @ moved * (count - 1.0) / count)
    wide = axis * np.sqrt(np.maximum(variance, 0.0)) @ axis.T
    return np.asarray(root @ wide @ np.linalg.inv(root))


def _influences(data: Outcomes, clusters: Integers, alike: Floats, fitted: Probit) -> Floats:
    """Score of each cluster over the observed information: what an infinitesimal jackknife leaves."""
    centre = data.z.mean()
    best = Probit(fitted.intercept + fitted.slope * centre, fitted.slope)
    pulls, bends = _by_cluster(data._replace(z=data.z - centre), clusters, best)
    intercept, slope = solved(np.tensordot(alike, bends, axes=1)[None], pulls).T
    return np.stack([intercept - slope * centre, slope], axis=1)


def _by_cluster(data: Outcomes, clusters: Integers, fitted: Probit) -> tuple[Floats, Floats]:
    """Score and observed information of each cluster, shapes (clusters, 2) and (clusters, 2, 2)."""
    z, exceeded, trials = data
    at = fitted.intercept + fitted.slope * z
    density, below, above = logarithms(at)
    up, down = np.exp(density - below), np.exp(density - above)
    pull = exceeded * up - (trials - exceeded) * down
    bend = exceeded * up * (up + at) + (trials - exceeded) * down * (down - at)
    pulls = np.stack([np.bincount(clusters, pull * power) for power in (np.ones_like(z), z)], axis=1)
    level, mixed, square = (np.bincount(clusters, bend * power) for power in (np.ones_like(z), z, z * z))
    bends = np.stack([level, mixed, mixed, square], axis=1).reshape(-1, 2, 2)
    return np.asarray(pulls, dtype=np.float64), np.asarray(bends, dtype=np.float64)
