"""How probable outcomes are for a population of blocks: populations, candidates that were tried, and what they tell.

A specimen is never twice the same block: it is set back by hand, its pivots wear, a rock rolls out of its plane. So
each test has its own block, drawn from a population that is normal in the logarithmic coordinates of `Space`. Several
populations are an array of shape (c, 2 k): centres, then logarithms of the dispersions, along each coordinate. The
chance that a test overturns the specimen is the share of the population that overturns under its motion, and that share
is a weighted mean over candidate blocks that were simulated once, whatever the population.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.analysis.calibration.space import Space
from rocking.arrays import Flags, Floats
from rocking.kernels import population as kernel
from rocking.threads import cores

#: Prior of the logarithm of a dispersion from test to test: its standard deviation.
_DISPERSION_LOG_DEVIATION: Final = 0.6

#: Populations that are weighed at once: bounds the memory.
_BATCH: Final = 64

#: Populations that are worth a thread of their own.
_LEAST: Final = 16

#: Blocks are drawn from a guide with its dispersions wider by a factor.
WIDENED: Final = 1.2

#: A share that n simulated blocks estimate is itself uncertain: Jeffreys' prior, Beta(1/2, 1/2).
_JEFFREYS: Final = 0.5


def unpacked(populations: Floats) -> tuple[Floats, Floats]:
    """Centres and dispersions, shape (c, k) each."""
    k = populations.shape[1] // 2
    return populations[:, :k], np.exp(populations[:, k:])


def with_dispersions(space: Space, centres: Floats, rng: np.random.Generator) -> Floats:
    """Give each centre dispersions from their prior."""
    scores = rng.standard_normal(centres.shape)
    return np.hstack([centres, np.log(space.dispersions) + _DISPERSION_LOG_DEVIATION * scores])


def log_prior_of_dispersions(space: Space, populations: Floats) -> Floats:
    """Logarithm of the prior of the dispersions, up to a constant, shape (c,)."""
    k = populations.shape[1] // 2
    scores = (populations[:, k:] - np.log(space.dispersions)) / _DISPERSION_LOG_DEVIATION
    return np.asarray(-0.5 * (scores**2).sum(axis=1))


def drawn(populations: Floats, widened: float, count: int, rng: np.random.Generator) -> Floats:
    """Draw points from populations in turn, their dispersion times `widened`; shape (count, k)."""
    centre, dispersion = unpacked(populations[np.arange(count) % len(populations)])
    return centre + widened * dispersion * rng.standard_normal(centre.shape)


def log_density(populations: Floats, widened: float, points: Floats) -> Floats:
    """Logarithm of the density at points of what `drawn` draws, shape (n,)."""
    centre, dispersion = unpacked(populations)
    middle = centre.mean(axis=0)
    centre, from_middle = centre - middle, points - middle
    precision = (widened * dispersion) ** -2
    constant = 0.5 * (np.log(precision / (2.0 * np.pi)) - precision * centre**2).sum(axis=1)
    powers = np.ascontiguousarray(np.vstack([(precision * centre).T, -0.5 * precision.T, constant]))
    factors = np.hstack([from_middle, from_middle**2, np.ones((len(points), 1))])
    found = np.empty(len(points))
    kernel.log_density(factors, powers, np.empty(len(populations)), found)
    return np.asarray(found - np.log(len(populations)))


@dataclass(frozen=True, eq=False)
class Candidates:
    """Blocks that were tried: coordinates (n, k) in a space, and 1 where one overturned under a motion, else 0, (n, m).

    `evenly` of them fill the space; the `guides` say how many were drawn from which populations, those outside
    included.
    """

    space: Space
    points: Floats
    overturned: NDArray[np.float32]
    evenly: int
    guides: tuple[tuple[int, Floats], ...] = ()

    @classmethod
    def pooled(cls, runs: Sequence[Candidates]) -> Candidates:
        """Put the candidates of several runs together."""
        return cls(
            runs[0].space,
            np.concatenate([run.points for run in runs]),
            np.concatenate([run.overturned for run in runs]),
            sum(run.evenly for run in runs),
            tuple(guide for run in runs for guide in run.guides),
        )

    def joined(self, guide: tuple[int, Floats], points: Floats, overturned: NDArray[np.float32]) -> Candidates:
        """Add others that were drawn from populations."""
        return Candidates(
            self.space,
            np.concatenate([self.points, points]),
            np.concatenate([self.overturned, overturned]),
            self.evenly,
            (*self.guides, guide),
        )

    def of_tests(self, tests: Flags) -> Candidates:
        """Return the same blocks under some of the motions."""
        return replace(self, overturned=np.ascontiguousarray(self.overturned[:, tests]))

    @cached_property
    def log_weights(self) -> Floats:
        """Logarithm of how much of the space each stands for: dense regions weigh less (Owen and Zhou 2000)."""
        return -self.log_density(self.points)

    def log_density(self, points: Floats) -> Floats:
        """Logarithm of the number of candidates per volume at points in the space, shape (c,)."""
        parts = [np.full(len(points), np.log(self.evenly / self.space.volume))]
        parts += [np.log(count) + log_density(guide, WIDENED, points) for count, guide in self.guides]
        return np.asarray(np.logaddexp.reduce(parts))


@dataclass(frozen=True, eq=False)
class Evidence:
    """What was observed under m motions (m,), against what n candidates do under them.

    The lapse is the chance that an outcome is not that of a rocking block at all.
    """

    candidates: Candidates
    observed: Flags
    lapse: float
    threads: int | None = None

    def of_tests(self, tests: Flags) -> Evidence:
        """Evidence of some of the tests alone."""
        return replace(self, candidates=self.candidates.of_tests(tests), observed=self.observed[tests])

    def weights(self, populations: Floats) -> NDArray[np.float32]:
        """Share of each population that each candidate stands for, shape (c, n); rows sum to 1."""
        weights = self._factors(populations) @ self._powers
        weights -= weights.max(axis=1, keepdims=True)
        np.exp(weights, out=weights)
        weights /= weights.sum(axis=1, keepdims=True)
        return weights

    def mean_weights(self, populations: Floats) -> Floats:
        """Weights of the candidates, shape (n,), averaged over populations."""
        batches = np.split(populations, range(_BATCH, len(populations), _BATCH))
        parts = [self.weights(batch).sum(axis=0, dtype=np.float64) for batch in batches]
        return np.asarray(np.sum(parts, axis=0) / len(populations))

    def probabilities(self, populations: Floats) -> Floats:
        """Probability of overturning for each population and motion, shape (c, m)."""
        found, effective = self._shares(populations)
        return blurred(expected_share(found, effective[:, None]), self.lapse)

    def effective(self, populations: Floats) -> Floats:
        """Effective number of candidates that speak for each population, shape (c,)."""
        return self._shares(populations)[1]

    def log_likelihoods(self, populations: Floats) -> Floats:
        """Log-likelihood of each population, shape (c,)."""
        if not len(populations):
            return np.zeros(0)
        chances = blurred(self._shares(populations)[0], self.lapse)
        return np.asarray(np.log(np.where(self.observed, chances, 1.0 - chances)).sum(axis=1))

    def _shares(self, populations: Floats) -> tuple[Floats, Floats]:
        """Share of each population that overturns, shape (c, m), and the effective number of candidates behind it."""
        overturned, powers, factors = self.candidates.overturned, self._powers, self._factors(populations)
        found = np.empty((len(populations), overturned.shape[1]), np.float32)
        effective = np.empty(len(populations))

        def weigh(start: int, end: int) -> None:
            exponents = np.empty(powers.shape[1], np.float32)
            kernel.shares(factors[start:end], powers, overturned, exponents, found[start:end], effective[start:end])

        each = max(-(-len(populations) // (self.threads or cores())), _LEAST)
        starts = range(0, len(populations), each)
        with ThreadPoolExecutor(max(len(starts), 1)) as pool:
            list(pool.map(weigh, starts, (start + each for start in starts)))
        # Rounding may take a share of all just above 1.
        return np.minimum(found, 1.0, dtype=np.float64), effective

    def _factors(self, populations: Floats) -> NDArray[np.float32]:
        """Factors, shape (c, 2 k + 1), of `_powers` in the logarithm of a candidate's weight."""
        centre, dispersion = unpacked(populations)
        precision = dispersion**-2
        from_middle = precision * (centre - self._middle)
        return np.hstack([from_middle, -0.5 * precision, np.ones((len(centre), 1))]).astype(np.float32)

    @cached_property
    def _powers(self) -> NDArray[np.float32]:
        """Coordinates of the candidates, their squares and their weights, shape (2 k + 1, n).

        They are counted from the candidates' middle: single precision then serves.
        """
        points = self.candidates.points - self._middle
        powers = np.vstack([points.T, points.T**2, self.candidates.log_weights])
        return np.ascontiguousarray(powers, dtype=np.float32)

    @cached_property
    def _middle(self) -> Floats:
        return np.asarray(self.candidates.points.mean(axis=0))


def expected_share(share: Floats, effective: ArrayLike) -> Floats:
    """Mean of a share that was found with so many effective blocks.

    Few blocks tell little of what a population does: a prediction from one block is no certainty. The likelihood takes
    shares as they are found: it would otherwise favour where candidates are dense.
    """
    count = np.asarray(effective)
    return np.asarray((count * share + _JEFFREYS) / (count + 2.0 * _JEFFREYS))


def blurred(probabilities: Floats, lapse: float) -> Floats:
    """Probabilities of recorded outcomes, from those of the rocking block."""
    return lapse + (1.0 - 2.0 * lapse) * probabilities
