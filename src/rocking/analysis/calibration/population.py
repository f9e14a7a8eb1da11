"""The population of blocks behind binary outcomes: its likelihood, and its posterior by tempering.

A specimen is never twice the same block: it is set back by hand, its pivots wear, a rock rolls out of its plane. So
each test has its own block, drawn from a population that is normal in the logarithmic coordinates of `Space`. The
chance that a test overturns the specimen is the share of the population that overturns under its motion, and that share
is a weighted mean over candidate blocks that were simulated once, whatever the population.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from rocking.analysis.calibration.space import Candidates, Space
from rocking.arrays import Flags, Floats, Integers
from rocking.progress import Progress

#: Prior of the dispersion from test to test: lognormal, medians for p, alpha, restitution and for the three ratios.
_DISPERSION_MEDIANS: Final = np.array([0.10, 0.10, 0.10, 0.05, 0.10, 0.05])
_DISPERSION_LOG_DEVIATION: Final = 0.6

#: Populations that are weighed at once: bounds the memory.
_BATCH: Final = 64

#: Tempering: share of effective particles that a step keeps, rounds of moves after each step, share of long jumps, and
#: the jitter that keeps moves from living in the particles' span.
_KEPT: Final = 0.5
_ROUNDS: Final = 4
_LONG_JUMPS: Final = 0.1
_JITTER: Final = 1e-3


@dataclass(frozen=True, eq=False)
class Evidence:
    """What was observed, against what candidates do.

    Attributes
    ----------
    candidates : Candidates
        n blocks, simulated under the m motions.
    observed : ndarray of bool, shape (m,)
        Whether the specimen overturned.
    lapse : float
        Chance that an outcome is not that of a rocking block at all.
    """

    candidates: Candidates
    observed: Flags
    lapse: float

    def weights(self, populations: Floats) -> Floats:
        """Share of each population that each candidate stands for, shape (c, n); rows sum to 1."""
        points = self.candidates.points
        centre, dispersion = unpacked(populations)
        precision = dispersion**-2
        exponent = (precision * centre) @ points.T - 0.5 * precision @ (points**2).T + self.candidates.log_weights
        exponent -= exponent.max(axis=1, keepdims=True)
        np.exp(exponent, out=exponent)
        exponent /= exponent.sum(axis=1, keepdims=True)
        return np.asarray(exponent)

    def mean_weights(self, populations: Floats) -> Floats:
        """Weights of the candidates, shape (n,), averaged over populations."""
        parts = [self.weights(part).sum(axis=0) for part in _batches(populations)]
        return np.asarray(np.sum(parts, axis=0) / len(populations))

    def probabilities(self, populations: Floats) -> Floats:
        """Probability of overturning for each population and motion, shape (c, m)."""
        overturned = self.candidates.overturned
        parts = [self.weights(part).astype(np.float32) @ overturned for part in _batches(populations)]
        return blurred(np.concatenate(parts).astype(np.float64), self.lapse)

    def log_likelihoods(self, probabilities: Floats, tests: Flags) -> Floats:
        """Log-likelihood of each population on some of the tests, shape (c,)."""
        seen = self.observed[tests]
        return np.asarray(np.log(np.where(seen, probabilities[:, tests], 1.0 - probabilities[:, tests])).sum(axis=1))


def blurred(probabilities: Floats, lapse: float) -> Floats:
    """Probabilities of recorded outcomes, from those of the rocking block."""
    return lapse + (1.0 - 2.0 * lapse) * probabilities


def unpacked(populations: Floats) -> tuple[Floats, Floats]:
    """Centres and dispersions, shape (c, k) each, of populations (c, 2 k): centres and scores of the dispersion."""
    k = populations.shape[1] // 2
    return populations[:, :k], _DISPERSION_MEDIANS[:k] * np.exp(_DISPERSION_LOG_DEVIATION * populations[:, k:])


def posterior(
    evidence: Evidence, tests: Flags, count: int, rng: np.random.Generator, progress: bool | None = None
) -> Floats:
    """Draw populations from the posterior given some of the tests, shape (count, 2 k).

    Sequential Monte Carlo: particles from the prior (even centres in the space, normal scores of the dispersion) follow
    the likelihood as its exponent grows from 0 to 1. Each step keeps half of them effective, resamples, and moves them
    by differences of other particles (differential evolution), so that several separate optima are all followed.
    """
    particles = _Particles.from_prior(evidence, tests, count, rng)
    with Progress("fitting", 100, show=progress) as bar:
        exponent = 0.0
        while exponent < 1.0:
            step = _step(particles.likelihood, 1.0 - exponent)
            bar.advance(round(100 * (exponent + step)) - round(100 * exponent))
            exponent += step
            particles = particles.resampled(step, rng)
            for _ in range(_ROUNDS):
                particles = particles.moved(exponent, rng)
    return particles.populations


@dataclass(frozen=True, eq=False)
class _Particles:
    evidence: Evidence
    tests: Flags
    populations: Floats
    likelihood: Floats

    @classmethod
    def from_prior(cls, evidence: Evidence, tests: Flags, count: int, rng: np.random.Generator) -> _Particles:
        centres = evidence.candidates.space.spread_evenly(count, rng)
        populations = np.hstack([centres, rng.standard_normal(centres.shape)])
        return cls(evidence, tests, populations, _log_likelihoods(evidence, tests, populations))

    def resampled(self, step: float, rng: np.random.Generator) -> _Particles:
        chosen = systematic(_tempered(self.likelihood, step), len(self.likelihood), rng)
        return _Particles(self.evidence, self.tests, self.populations[chosen], self.likelihood[chosen])

    def moved(self, exponent: float, rng: np.random.Generator) -> _Particles:
        """Move one half of the particles by differences within the other half, then the other way round."""
        populations, likelihood = self.populations.copy(), self.likelihood.copy()
        shuffled = rng.permutation(len(populations))
        half = len(populations) // 2
        for movers, guides in ((shuffled[:half], shuffled[half:]), (shuffled[half:], shuffled[:half])):
            old = populations[movers]
            new = old + _differences(populations[guides], len(movers), rng)
            prior = _log_prior(self.evidence.candidates.space, new)
            possible = np.isfinite(prior)
            found = np.full(len(movers), -np.inf)
            found[possible] = _log_likelihoods(self.evidence, self.tests, new[possible])
            gain = np.full(len(movers), -np.inf)
            known = _log_prior(self.evidence.candidates.space, old[possible])
            gain[possible] = exponent * (found - likelihood[movers])[possible] + prior[possible] - known
            taken = np.log(rng.random(len(movers))) < gain
            populations[movers[taken]], likelihood[movers[taken]] = new[taken], found[taken]
        return _Particles(self.evidence, self.tests, populations, likelihood)


def systematic(weights: Floats, count: int, rng: np.random.Generator) -> Integers:
    """Draw indices in proportion to weights that sum to 1, as evenly as can be."""
    steps = np.cumsum(weights)
    return np.searchsorted(steps / steps[-1], (np.arange(count) + rng.random()) / count).astype(np.int64)


def drawn(populations: Floats, widened: float, count: int, rng: np.random.Generator) -> Floats:
    """Draw points from populations in turn, their dispersion times `widened`; shape (count, k)."""
    centre, dispersion = unpacked(populations[np.arange(count) % len(populations)])
    return centre + widened * dispersion * rng.standard_normal(centre.shape)


def log_density(populations: Floats, widened: float, points: Floats) -> Floats:
    """Logarithm of the density at points of what `drawn` draws, shape (n,)."""
    centre, dispersion = unpacked(populations)
    total = np.full(len(points), -np.inf)
    for middle, deviation in zip(centre, widened * dispersion, strict=True):
        exponent = -0.5 * (((points - middle) / deviation) ** 2).sum(axis=1)
        total = np.logaddexp(total, exponent - np.log(deviation * np.sqrt(2.0 * np.pi)).sum())
    return np.asarray(total - np.log(len(centre)))


def _differences(guides: Floats, count: int, rng: np.random.Generator) -> Floats:
    first, second = (rng.integers(len(guides), size=count) for _ in range(2))
    size = guides.shape[1]
    # 2.38/sqrt(2 d) suits a normal posterior (ter Braak 2006); whole differences jump between optima.
    scale = np.where(rng.random(count) < _LONG_JUMPS, 1.0, 2.38 / np.sqrt(2.0 * size))
    return scale[:, None] * (guides[first] - guides[second]) + _JITTER * rng.standard_normal((count, size))


def _log_prior(space: Space, populations: Floats) -> Floats:
    """Even centres inside the space, standard normal scores of the dispersion."""
    k = populations.shape[1] // 2
    inside = space.contains(populations[:, :k])
    return np.where(inside, -0.5 * (populations[:, k:] ** 2).sum(axis=1), -np.inf)


def _log_likelihoods(evidence: Evidence, tests: Flags, populations: Floats) -> Floats:
    if not len(populations):
        return np.zeros(0)
    return evidence.log_likelihoods(evidence.probabilities(populations), tests)


def _tempered(likelihood: Floats, step: float) -> Floats:
    weights = np.exp(step * (likelihood - likelihood.max()))
    return np.asarray(weights / weights.sum())


def _step(likelihood: Floats, most: float) -> float:
    """Growth of the exponent that keeps the wanted share of particles effective, by bisection."""

    def kept(step: float) -> float:
        return 1.0 / float((_tempered(likelihood, step) ** 2).sum()) / len(likelihood)

    if kept(most) >= _KEPT:
        return most
    low, high = 0.0, most
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if kept(middle) >= _KEPT else (low, middle)
    return high


def _batches(populations: Floats) -> list[Floats]:
    return [populations[start : start + _BATCH] for start in range(0, len(populations), _BATCH)]
