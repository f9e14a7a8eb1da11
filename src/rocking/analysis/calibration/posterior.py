"""The posterior over populations, drawn by sequential Monte Carlo."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from rocking.analysis.calibration import population
from rocking.analysis.calibration.evidence import Evidence
from rocking.arrays import Floats, Integers
from rocking.progress import Progress

#: Populations at the start for each that is drawn.
_STARTS: Final = 4

#: Share of effective particles that a step keeps, share of long jumps, and the jitter that keeps moves from living in
#: the particles' span.
_KEPT: Final = 0.5
_LONG_JUMPS: Final = 0.1
_JITTER: Final = 1e-3


def posterior(
    evidence: Evidence,
    count: int,
    rounds: int,
    rng: np.random.Generator,
    *,
    exponent: float = 1.0,
    progress: bool | None = None,
) -> Floats:
    """Draw populations from the posterior, shape (count, 2 k); with an exponent of the likelihood, from a wider one.

    Sequential Monte Carlo (Del Moral, Doucet and Jasra 2006): particles start with their centres at candidates, so
    where the search has looked, and follow the geometric path from that density to the posterior. Each step keeps half
    of them effective, resamples, and moves them in some rounds by differences of other particles (differential
    evolution), so that several separate optima are all followed.
    """
    particles = _Particles.from_candidates(evidence, exponent, _STARTS * count, rng)
    with Progress("fitting", 100, show=progress) as bar:
        done = 0.0
        while done < 1.0:
            step = _step(particles.gain, 1.0 - done)
            bar.advance(round(100 * (done + step)) - round(100 * done))
            done += step
            particles = particles.resampled(step, count, rng)
            for _ in range(rounds):
                particles = particles.moved(done, rng)
    return particles.populations


@dataclass(frozen=True, eq=False)
class _Particles:
    """Populations, and the logarithms of two densities at each: that of the start, and the posterior."""

    evidence: Evidence
    exponent: float
    populations: Floats
    start: Floats
    posterior: Floats

    @classmethod
    def at(cls, evidence: Evidence, exponent: float, populations: Floats) -> _Particles:
        candidates, k = evidence.candidates, populations.shape[1] // 2
        centres = populations[:, :k]
        inside = candidates.space.contains(centres)
        posterior = population.log_prior_of_dispersions(candidates.space, populations)
        start = posterior + np.where(inside, 0.0, -np.inf)
        start[inside] += candidates.log_density(centres[inside])
        posterior[inside] += exponent * evidence.log_likelihoods(populations[inside])
        posterior[~inside] = -np.inf
        return cls(evidence, exponent, populations, start, posterior)

    @classmethod
    def from_candidates(cls, evidence: Evidence, exponent: float, count: int, rng: np.random.Generator) -> _Particles:
        points = evidence.candidates.points
        centres = points[rng.choice(len(points), min(count, len(points)), replace=False)]
        return cls.at(evidence, exponent, population.with_dispersions(evidence.candidates.space, centres, rng))

    @property
    def gain(self) -> Floats:
        """Logarithm of what a particle's density gains on the way from start to posterior."""
        return self.posterior - self.start

    def resampled(self, step: float, count: int, rng: np.random.Generator) -> _Particles:
        chosen = systematic(_tempered(self.gain, step), count, rng)
        return _Particles(
            self.evidence, self.exponent, self.populations[chosen], self.start[chosen], self.posterior[chosen]
        )

    def moved(self, done: float, rng: np.random.Generator) -> _Particles:
        """Move one half of the particles by differences within the other half, then the other way round."""
        populations, start, posterior = self.populations.copy(), self.start.copy(), self.posterior.copy()
        shuffled = rng.permutation(len(populations))
        half = len(populations) // 2
        for movers, guides in ((shuffled[:half], shuffled[half:]), (shuffled[half:], shuffled[:half])):
            changes = _differences(populations[guides], len(movers), rng)
            new = _Particles.at(self.evidence, self.exponent, populations[movers] + changes)
            with np.errstate(invalid="ignore"):
                gain = (1.0 - done) * (new.start - start[movers]) + done * (new.posterior - posterior[movers])
            taken = np.log(rng.random(len(movers))) < gain
            there = movers[taken]
            populations[there], start[there], posterior[there] = (
                new.populations[taken],
                new.start[taken],
                new.posterior[taken],
            )
        return replace(self, populations=populations, start=start, posterior=posterior)


def systematic(weights: Floats, count: int, rng: np.random.Generator) -> Integers:
    """Draw indices in proportion to weights that sum to 1, as evenly as can be."""
    steps = np.cumsum(weights)
    return np.searchsorted(steps / steps[-1], (np.arange(count) + rng.random()) / count).astype(np.int64)


def _differences(guides: Floats, count: int, rng: np.random.Generator) -> Floats:
    first, second = (rng.integers(len(guides), size=count) for _ in range(2))
    size = guides.shape[1]
    # 2.38/sqrt(2 d) suits a normal posterior (ter Braak 2006); whole differences jump between optima.
    scale = np.where(rng.random(count) < _LONG_JUMPS, 1.0, 2.38 / np.sqrt(2.0 * size))
    return scale[:, None] * (guides[first] - guides[second]) + _JITTER * rng.standard_normal((count, size))


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
