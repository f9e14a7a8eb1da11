"""Sequential Monte Carlo for the posterior over populations, and the search for its candidates.

The likelihood of a population comes from blocks simulated near it, so the candidates determine whether all regions of
the posterior are found. Independent runs therefore search the whole space, share nothing, and are compared at the end.
Each run fills the space evenly, then adds blocks near its own fits, first near fair ones, finally near the best,
because a narrow region lies within a wider one that is better than the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.calibration.space import Space
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.bisection import bisect
from rocking.core.progress import Progress
from rocking.core.threads import thread_count
from rocking.kernels import population as kernel

#: Prior standard deviation of the logarithm of a dispersion from test to test.
_DISPERSION_LOG_DEVIATION: Final = 0.6

#: Number of populations weighted at once, which bounds the memory.
_BATCH: Final = 64


#: Factor on the dispersions of a guide to draw blocks.
PROPOSAL_WIDTH: Final = 1.2

#: Jeffreys' prior, Beta(1/2, 1/2), of a share estimated from n simulated blocks.
_JEFFREYS: Final = 0.5


def unpacked(populations: Floats) -> tuple[Floats, Floats]:
    """Return centres and dispersions, shape (c, k) each."""
    k = populations.shape[1] // 2
    return populations[:, :k], np.exp(populations[:, k:])


def with_dispersions(space: Space, centres: Floats, rng: np.random.Generator) -> Floats:
    """Draw dispersions from the prior for each centre."""
    scores = rng.standard_normal(centres.shape)
    return np.hstack([centres, np.log(space.dispersions) + _DISPERSION_LOG_DEVIATION * scores])


def log_prior_of_dispersions(space: Space, populations: Floats) -> Floats:
    """Compute the log-prior of the dispersions up to a constant, shape (c,)."""
    k = populations.shape[1] // 2
    scores = (populations[:, k:] - np.log(space.dispersions)) / _DISPERSION_LOG_DEVIATION
    return np.asarray(-0.5 * (scores**2).sum(axis=1))


def drawn(populations: Floats, widened: float, count: int, rng: np.random.Generator) -> Floats:
    """Draw points from populations in turn, with dispersions times `widened`, shape (count, k)."""
    centre, dispersion = unpacked(populations[np.arange(count) % len(populations)])
    return centre + widened * dispersion * rng.standard_normal(centre.shape)


def log_density(populations: Floats, widened: float, points: Floats) -> Floats:
    """Compute the log-density of the distribution of `drawn` at points, shape (n,)."""
    centre, dispersion = unpacked(populations)
    middle = centre.mean(axis=0)
    centre, from_middle = centre - middle, points - middle
    precision = (widened * dispersion) ** -2
    constant = 0.5 * (np.log(precision / (2.0 * np.pi)) - precision * centre**2).sum(axis=1)
    powers = np.ascontiguousarray(np.vstack([(precision * centre).T, -0.5 * precision.T, constant]))
    factors = np.hstack([from_middle, from_middle**2, np.ones((len(points), 1))])
    found = np.empty(len(points))
    kernel.write_log_sums(factors, powers, np.empty(len(populations)), found)
    return np.asarray(found - np.log(len(populations)))


@dataclass(frozen=True, eq=False)
class Candidates:
    """Simulated blocks: coordinates (n, k), and overturning (1 or 0) under each motion, (n, m)."""

    space: Space
    points: Floats
    overturned: NDArray[np.float32]
    evenly: int
    guides: tuple[tuple[int, Floats], ...] = ()

    @classmethod
    def pooled(cls, runs: Sequence[Candidates]) -> Candidates:
        """Concatenate candidates."""
        return cls(
            runs[0].space,
            np.concatenate([run.points for run in runs]),
            np.concatenate([run.overturned for run in runs]),
            sum(run.evenly for run in runs),
            tuple(guide for run in runs for guide in run.guides),
        )

    def of_tests(self, tests: Flags) -> Candidates:
        """Return the same blocks under some of the motions."""
        return replace(self, overturned=np.ascontiguousarray(self.overturned[:, tests]))

    @cached_property
    def log_weights(self) -> Floats:
        """Compute the log-volume that each candidate represents, smaller in dense regions (Owen and Zhou 2000)."""
        return -self.log_density(self.points)

    def log_density(self, points: Floats) -> Floats:
        """Compute the log-density of candidates per volume at points in the space, shape (c,)."""
        parts = [np.full(len(points), np.log(self.evenly / self.space.volume))]
        parts += [np.log(count) + log_density(guide, PROPOSAL_WIDTH, points) for count, guide in self.guides]
        return np.asarray(np.logaddexp.reduce(parts))


@dataclass(frozen=True, eq=False)
class Evidence:
    """Observed outcomes of m motions (m,), outcomes of n candidates under them, and the outlier_probability."""

    candidates: Candidates
    observed: Flags
    outlier_probability: float

    def of_tests(self, tests: Flags) -> Evidence:
        """Return the evidence of some of the tests."""
        return replace(self, candidates=self.candidates.of_tests(tests), observed=self.observed[tests])

    def weights(self, populations: Floats) -> NDArray[np.float32]:
        """Compute the share of each population that each candidate represents, shape (c, n), with row sums 1."""
        weights = self._factors(populations) @ self._powers
        weights -= weights.max(axis=1, keepdims=True)
        np.exp(weights, out=weights)
        weights /= weights.sum(axis=1, keepdims=True)
        return weights

    def mean_weights(self, populations: Floats) -> Floats:
        """Compute weights of the candidates averaged over populations, shape (n,)."""
        batches = np.split(populations, range(_BATCH, len(populations), _BATCH))
        parts = [self.weights(batch).sum(axis=0, dtype=np.float64) for batch in batches]
        return np.asarray(np.sum(parts, axis=0) / len(populations))

    def probabilities(self, populations: Floats) -> Floats:
        """Compute the probability of overturning for each population and motion, shape (c, m)."""
        found, effective = self._shares(populations)
        return with_outliers(expected_share(found, effective[:, None]), self.outlier_probability)

    def effective(self, populations: Floats) -> Floats:
        """Compute the effective number of candidates that represent each population, shape (c,)."""
        return self._shares(populations)[1]

    def log_likelihoods(self, populations: Floats) -> Floats:
        """Compute the log-likelihood of each population, shape (c,)."""
        if not len(populations):
            return np.zeros(0)
        chances = with_outliers(self._shares(populations)[0], self.outlier_probability)
        return np.asarray(np.log(np.where(self.observed, chances, 1.0 - chances)).sum(axis=1))

    def _shares(self, populations: Floats) -> tuple[Floats, Floats]:
        """Compute the share of each population that overturns, shape (c, m), and its effective number of candidates."""
        overturned, powers, factors = self.candidates.overturned, self._powers, self._factors(populations)
        found = np.empty((len(populations), overturned.shape[1]), np.float32)
        effective = np.empty(len(populations))

        def weigh(start: int, end: int) -> None:
            exponents = np.empty(powers.shape[1], np.float32)
            kernel.write_overturned_fractions(
                factors[start:end], powers, overturned, exponents, found[start:end], effective[start:end]
            )

        each = max(-(-len(populations) // thread_count()), 16)
        starts = range(0, len(populations), each)
        with ThreadPoolExecutor(max(len(starts), 1)) as pool:
            list(pool.map(weigh, starts, (start + each for start in starts)))
        # Rounding can make a share exceed 1.
        return np.minimum(found, 1.0, dtype=np.float64), effective

    def _factors(self, populations: Floats) -> NDArray[np.float32]:
        """Return factors, shape (c, 2 k + 1), of `_powers` in the logarithm of a candidate's weight."""
        centre, dispersion = unpacked(populations)
        precision = dispersion**-2
        from_middle = precision * (centre - self._middle)
        return np.hstack([from_middle, -0.5 * precision, np.ones((len(centre), 1))]).astype(np.float32)

    @cached_property
    def _powers(self) -> NDArray[np.float32]:
        """Return centred coordinates, their squares and the weights of the candidates, shape (2 k + 1, n)."""
        points = self.candidates.points - self._middle
        powers = np.vstack([points.T, points.T**2, self.candidates.log_weights])
        return np.ascontiguousarray(powers, dtype=np.float32)

    @cached_property
    def _middle(self) -> Floats:
        return np.asarray(self.candidates.points.mean(axis=0))


def expected_share(share: Floats, effective: ArrayLike) -> Floats:
    """Compute the mean of a share estimated from this many effective blocks."""
    count = np.asarray(effective)
    return np.asarray((count * share + _JEFFREYS) / (count + 2.0 * _JEFFREYS))


def with_outliers(probabilities: Floats, outlier_probability: float) -> Floats:
    """Compute probabilities of recorded outcomes from those of the rocking block."""
    return outlier_probability + (1.0 - 2.0 * outlier_probability) * probabilities


#: Number of independent runs.
RUNS: Final = 2

#: Equal parts of a run's candidates: two that fill the space, then one for each exponent of the guiding likelihood. The
#: search continues at most `_MORE` times if runs disagree or too few candidates are effective.
_FILLING: Final = 2
_EXPONENTS: Final = (0.03, 0.1, 0.3, 1.0, 1.0)
_MORE: Final = 2

#: Draws from a posterior, and rounds of moves after each tempering step, for the search and the comparison.
_PROPOSAL: Final = (256, 2)
_COMPARED: Final = (256, 4)

#: Largest R-hat of agreeing runs: their means differ by less than two thirds of a standard deviation.
AGREEMENT: Final = 1.1


@dataclass(frozen=True, eq=False)
class Problem:
    """Calibration problem: parameter space, observed outcomes, and simulation of blocks (`tried`)."""

    space: Space
    observed: Flags
    outlier_probability: float
    tried: Callable[[Floats], NDArray[np.float32]]

    def evidence(self, candidates: Candidates) -> Evidence:
        """Combine candidates with the observed outcomes."""
        return Evidence(candidates, self.observed, self.outlier_probability)

    def filling(self, count: int, rng: np.random.Generator) -> Candidates:
        """Simulate blocks that fill the space evenly."""
        points = self.space.quasi_random(count, rng)
        return Candidates(self.space, points, self.tried(points), count)

    def propose(self, candidates: Candidates, exponent: float, count: int, rng: np.random.Generator) -> Candidates:
        """Also simulate blocks near fitted populations, wider for a lower exponent of the likelihood."""
        populations = posterior(self.evidence(candidates), *_PROPOSAL, rng, exponent=exponent)
        points = drawn(populations, PROPOSAL_WIDTH, count, rng)
        points = points[self.space.contains(points)]
        drawn_ones = Candidates(self.space, points, self.tried(points), 0, ((count, populations),))
        return Candidates.pooled([candidates, drawn_ones])


@dataclass(frozen=True, eq=False)
class Search:
    """Candidates of all runs together and of each run, and populations drawn from each run alone."""

    evidence: Evidence
    runs: tuple[Candidates, ...]
    posteriors: tuple[Floats, ...]

    @property
    def effective(self) -> float:
        """Effective number of candidates that represent a typical population."""
        return float(np.median(self.evidence.effective(np.vstack(self.posteriors))))

    @property
    def agreement(self) -> dict[str, float]:
        """R-hat between the runs of each parameter's centre, by name."""
        named = [self.evidence.candidates.space.named(unpacked(one)[0]) for one in self.posteriors]
        return {name: r_hat(np.array([one[name] for one in named])) for name in named[0]}


def search(problem: Problem, candidates: int, rng: np.random.Generator) -> Search:
    """Simulate about this many candidates, up to twice as many while runs disagree or few represent the posterior."""
    part = max(candidates // (RUNS * (_FILLING + len(_EXPONENTS))), 1)
    streams = rng.spawn(RUNS)
    runs: Sequence[Candidates] = [problem.filling(_FILLING * part, stream) for stream in streams]
    found = _compared(problem, runs, _EXPONENTS, part, streams)
    for _ in range(_MORE):
        if max(found.agreement.values()) >= AGREEMENT:
            exponents = 0.1, 0.3, 1.0
        elif found.effective < 100.0:  # a single block that happens to fit would make a population look excellent
            exponents = 1.0, 1.0, 1.0
        else:
            break
        found = _compared(problem, found.runs, exponents, part, streams)
    return found


def _compared(
    problem: Problem,
    runs: Sequence[Candidates],
    exponents: Sequence[float],
    part: int,
    streams: Sequence[np.random.Generator],
) -> Search:
    """Let every run add blocks near its own fits, and compare the runs."""
    longer, posteriors = [], []
    for run, rng in zip(runs, streams, strict=True):
        for exponent in exponents:
            run = problem.propose(run, exponent, part, rng)
        longer.append(run)
        posteriors.append(posterior(problem.evidence(run), *_COMPARED, rng))
    return Search(problem.evidence(Candidates.pooled(longer)), tuple(longer), tuple(posteriors))


def r_hat(runs: Floats) -> float:
    """Compute R-hat of the ranks, or distances from the middle, of draws (runs, draws)."""
    from scipy.special import ndtri
    from scipy.stats import rankdata

    def of_ranks(values: Floats) -> float:
        scores = ndtri((rankdata(values).reshape(values.shape) - 0.375) / (values.size + 0.25))
        within, between = float(scores.var(axis=1, ddof=1).mean()), float(scores.mean(axis=1).var(ddof=1))
        return math.sqrt((values.shape[1] - 1) / values.shape[1] + between / within)

    return max(of_ranks(values) for values in (runs, np.abs(runs - np.median(runs))))


def posterior(
    evidence: Evidence, count: int, rounds: int, rng: np.random.Generator, *, exponent: float = 1.0
) -> Floats:
    """Draw populations from the posterior, shape (count, 2 k), or from a tempered one if an exponent is set.

    Sequential Monte Carlo (Del Moral, Doucet and Jasra 2006): the centres of the particles start at candidates. Each
    step keeps half of the particles effective, resamples them, and moves them by differences of others (differential
    evolution).
    """
    space, points = evidence.candidates.space, evidence.candidates.points
    centres = points[rng.choice(len(points), min(4 * count, len(points)), replace=False)]
    particles = with_dispersions(space, centres, rng)
    start, end = _log_densities(evidence, exponent, particles)
    with Progress("fitting", 100) as bar:
        done = 0.0
        while done < 1.0:
            step = _step(end - start, 1.0 - done)
            bar.advance(round(100 * (done + step)) - round(100 * done))
            done += step
            chosen = systematic(_tempered(end - start, step), count, rng)
            particles, start, end = particles[chosen], start[chosen], end[chosen]
            for _ in range(rounds):
                _move(evidence, exponent, done, particles, start, end, rng)
    return particles


def _log_densities(evidence: Evidence, exponent: float, populations: Floats) -> tuple[Floats, Floats]:
    """Compute log-densities of the initial distribution of the particles and of the posterior."""
    candidates, centres = evidence.candidates, populations[:, : populations.shape[1] // 2]
    inside = candidates.space.contains(centres)
    end = log_prior_of_dispersions(candidates.space, populations)
    start = end + np.where(inside, 0.0, -np.inf)
    start[inside] += candidates.log_density(centres[inside])
    end[inside] += exponent * evidence.log_likelihoods(populations[inside])
    end[~inside] = -np.inf
    return start, end


def _move(
    evidence: Evidence,
    exponent: float,
    done: float,
    particles: Floats,
    start: Floats,
    end: Floats,
    rng: np.random.Generator,
) -> None:
    """Move one half of the particles by differences within the other half, then vice versa."""
    shuffled = rng.permutation(len(particles))
    half = len(particles) // 2
    for movers, guides in ((shuffled[:half], shuffled[half:]), (shuffled[half:], shuffled[:half])):
        new = particles[movers] + _differences(particles[guides], len(movers), rng)
        new_start, new_end = _log_densities(evidence, exponent, new)
        with np.errstate(invalid="ignore"):
            gain = (1.0 - done) * (new_start - start[movers]) + done * (new_end - end[movers])
        accepted = np.log(rng.random(len(movers))) < gain
        there = movers[accepted]
        particles[there], start[there], end[there] = new[accepted], new_start[accepted], new_end[accepted]


def systematic(weights: Floats, count: int, rng: np.random.Generator) -> Integers:
    """Draw indices in proportion to weights with sum 1, as evenly as possible (systematic resampling)."""
    steps = np.cumsum(weights)
    return np.searchsorted(steps / steps[-1], (np.arange(count) + rng.random()) / count).astype(np.int64)


def _differences(guides: Floats, count: int, rng: np.random.Generator) -> Floats:
    first, second = (rng.integers(len(guides), size=count) for _ in range(2))
    size = guides.shape[1]
    # 2.38/sqrt(2 d) suits a normal posterior (ter Braak 2006). Whole differences jump between optima.
    scale = np.where(rng.random(count) < 0.1, 1.0, 2.38 / np.sqrt(2.0 * size))
    # Jitter lets the moves leave the span of the particles.
    return scale[:, None] * (guides[first] - guides[second]) + 1e-3 * rng.standard_normal((count, size))


def _tempered(likelihood: Floats, step: float) -> Floats:
    weights = np.exp(step * (likelihood - likelihood.max()))
    return np.asarray(weights / weights.sum())


def _step(likelihood: Floats, most: float) -> float:
    """Find by bisection the increase of the exponent that keeps half of the particles effective."""

    def too_few(step: float) -> bool:
        return 1.0 / float((_tempered(likelihood, step) ** 2).sum()) / len(likelihood) < 0.5

    return bisect(0.0, most, too_few, halvings=50)[1] if too_few(most) else most
