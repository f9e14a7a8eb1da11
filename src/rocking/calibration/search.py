"""The posterior over populations, drawn by sequential Monte Carlo, and the search for candidates to draw it from.

The likelihood of a population comes from blocks that were simulated near it. So what decides whether all regions of the
posterior are found is where blocks were tried. Independent runs look everywhere, and then compare: each run fills the
space evenly, then tries blocks where its own fits say: first where they are fair, at last where they are best. A narrow
region lies within a wider one that is better than the rest, and so on down to it; going for the best at once would miss
it. Runs share nothing until they are compared.
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
from rocking.core.bisection import bisected
from rocking.core.progress import Progress
from rocking.core.threads import cores
from rocking.kernels import population as kernel

#: Prior of the logarithm of a dispersion from test to test: its standard deviation.
_DISPERSION_LOG_DEVIATION: Final = 0.6

#: Populations that are weighed at once: bounds the memory.
_BATCH: Final = 64


#: Blocks are drawn from a guide with its dispersions wider by a factor.
PROPOSAL_WIDTH: Final = 1.2

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
    """Blocks that were tried: coordinates (n, k), and 1 where one overturned, else 0, (n, m)."""

    space: Space
    points: Floats
    overturned: NDArray[np.float32]
    evenly: int
    guides: tuple[tuple[int, Floats], ...] = ()

    @classmethod
    def pooled(cls, runs: Sequence[Candidates]) -> Candidates:
        """Put candidates together."""
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
        """Logarithm of how much of the space each stands for: dense regions weigh less (Owen and Zhou 2000)."""
        return -self.log_density(self.points)

    def log_density(self, points: Floats) -> Floats:
        """Logarithm of the number of candidates per volume at points in the space, shape (c,)."""
        parts = [np.full(len(points), np.log(self.evenly / self.space.volume))]
        parts += [np.log(count) + log_density(guide, PROPOSAL_WIDTH, points) for count, guide in self.guides]
        return np.asarray(np.logaddexp.reduce(parts))


@dataclass(frozen=True, eq=False)
class Evidence:
    """Observed outcomes of m motions (m,), and those of n candidates under them, with the lapse."""

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
        return with_outliers(expected_share(found, effective[:, None]), self.lapse)

    def effective(self, populations: Floats) -> Floats:
        """Effective number of candidates that speak for each population, shape (c,)."""
        return self._shares(populations)[1]

    def log_likelihoods(self, populations: Floats) -> Floats:
        """Log-likelihood of each population, shape (c,)."""
        if not len(populations):
            return np.zeros(0)
        chances = with_outliers(self._shares(populations)[0], self.lapse)
        return np.asarray(np.log(np.where(self.observed, chances, 1.0 - chances)).sum(axis=1))

    def _shares(self, populations: Floats) -> tuple[Floats, Floats]:
        """Share of each population that overturns, shape (c, m), and the effective number of candidates behind it."""
        overturned, powers, factors = self.candidates.overturned, self._powers, self._factors(populations)
        found = np.empty((len(populations), overturned.shape[1]), np.float32)
        effective = np.empty(len(populations))

        def weigh(start: int, end: int) -> None:
            exponents = np.empty(powers.shape[1], np.float32)
            kernel.shares(factors[start:end], powers, overturned, exponents, found[start:end], effective[start:end])

        each = max(-(-len(populations) // (self.threads or cores())), 16)
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
        """Coordinates of the candidates from their middle, their squares and their weights, shape (2 k + 1, n)."""
        points = self.candidates.points - self._middle
        powers = np.vstack([points.T, points.T**2, self.candidates.log_weights])
        return np.ascontiguousarray(powers, dtype=np.float32)

    @cached_property
    def _middle(self) -> Floats:
        return np.asarray(self.candidates.points.mean(axis=0))


def expected_share(share: Floats, effective: ArrayLike) -> Floats:
    """Mean of a share that was found with so many effective blocks: a prediction from one block is no certainty."""
    count = np.asarray(effective)
    return np.asarray((count * share + _JEFFREYS) / (count + 2.0 * _JEFFREYS))


def with_outliers(probabilities: Floats, lapse: float) -> Floats:
    """Probabilities of recorded outcomes, from those of the rocking block."""
    return lapse + (1.0 - 2.0 * lapse) * probabilities


#: Independent runs.
RUNS: Final = 2

#: A run's candidates come in parts of equal size: two that fill the space, then one for each exponent of the likelihood
#: that guides it. While the runs disagree, or too few candidates speak for what they found, they go on, `_MORE` times
#: at most.
_FILLING: Final = 2
_EXPONENTS: Final = (0.03, 0.1, 0.3, 1.0, 1.0)
_MORE: Final = 2

#: Draws from a posterior, and rounds of moves after each step of their tempering: where they guide the search, and
#: where they are compared.
_PROPOSAL: Final = (256, 2)
_COMPARED: Final = (256, 4)

#: Runs agree where R-hat is below this: their means then differ by less than two thirds of a standard deviation.
AGREEMENT: Final = 1.1


@dataclass(frozen=True, eq=False)
class Problem:
    """What is asked: which populations of the space explain what was observed, and what a block does (`tried`)."""

    space: Space
    observed: Flags
    lapse: float
    tried: Callable[[Floats], NDArray[np.float32]]
    threads: int | None = None

    def evidence(self, candidates: Candidates) -> Evidence:
        """Compare candidates with what was observed."""
        return Evidence(candidates, self.observed, self.lapse, self.threads)

    def filling(self, count: int, rng: np.random.Generator) -> Candidates:
        """Try blocks that fill the space evenly."""
        points = self.space.quasi_random(count, rng)
        return Candidates(self.space, points, self.tried(points), count)

    def propose(self, candidates: Candidates, exponent: float, count: int, rng: np.random.Generator) -> Candidates:
        """Try blocks where populations fit, too: the lower the exponent of the likelihood, the wider around."""
        populations = posterior(self.evidence(candidates), *_PROPOSAL, rng, exponent=exponent, progress=False)
        points = drawn(populations, PROPOSAL_WIDTH, count, rng)
        points = points[self.space.contains(points)]
        drawn_ones = Candidates(self.space, points, self.tried(points), 0, ((count, populations),))
        return Candidates.pooled([candidates, drawn_ones])


@dataclass(frozen=True, eq=False)
class Search:
    """What the runs found: all their candidates, those of each, and populations drawn from those of each run alone."""

    evidence: Evidence
    runs: tuple[Candidates, ...]
    posteriors: tuple[Floats, ...]

    @property
    def effective(self) -> float:
        """Effective number of candidates that speak for a typical population."""
        return float(np.median(self.evidence.effective(np.vstack(self.posteriors))))

    @property
    def agreement(self) -> dict[str, float]:
        """R-hat between the runs of each parameter's centre, by name."""
        named = [self.evidence.candidates.space.named(unpacked(one)[0]) for one in self.posteriors]
        return {name: r_hat(np.array([one[name] for one in named])) for name in named[0]}


def search(problem: Problem, candidates: int, rng: np.random.Generator) -> Search:
    """Try about so many candidates; up to twice as many while runs disagree or too few speak for what they found."""
    part = max(candidates // (RUNS * (_FILLING + len(_EXPONENTS))), 1)
    streams = rng.spawn(RUNS)
    runs: Sequence[Candidates] = [problem.filling(_FILLING * part, stream) for stream in streams]
    found = _compared(problem, runs, _EXPONENTS, part, streams)
    for _ in range(_MORE):
        if max(found.agreement.values()) >= AGREEMENT:
            exponents = 0.1, 0.3, 1.0
        elif found.effective < 100.0:  # a lone block that happens to fit would make a population look excellent
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
    """Let every run try blocks where its own fits say, and compare what they find."""
    longer, posteriors = [], []
    for run, rng in zip(runs, streams, strict=True):
        for exponent in exponents:
            run = problem.propose(run, exponent, part, rng)
        longer.append(run)
        posteriors.append(posterior(problem.evidence(run), *_COMPARED, rng, progress=False))
    return Search(problem.evidence(Candidates.pooled(longer)), tuple(longer), tuple(posteriors))


def r_hat(runs: Floats) -> float:
    """R-hat of the ranks, or distances from the middle, of draws (runs, draws); 1 where runs agree."""
    from scipy.special import ndtri
    from scipy.stats import rankdata

    def of_ranks(values: Floats) -> float:
        scores = ndtri((rankdata(values).reshape(values.shape) - 0.375) / (values.size + 0.25))
        within, between = float(scores.var(axis=1, ddof=1).mean()), float(scores.mean(axis=1).var(ddof=1))
        return math.sqrt((values.shape[1] - 1) / values.shape[1] + between / within)

    return max(of_ranks(values) for values in (runs, np.abs(runs - np.median(runs))))


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

    Sequential Monte Carlo (Del Moral, Doucet and Jasra 2006): particles start with their centres at candidates, and
    each step keeps half of them effective, resamples, and moves them by differences of others (differential evolution).
    """
    space, points = evidence.candidates.space, evidence.candidates.points
    centres = points[rng.choice(len(points), min(4 * count, len(points)), replace=False)]
    particles = with_dispersions(space, centres, rng)
    start, end = _log_densities(evidence, exponent, particles)
    with Progress("fitting", 100, show=progress) as bar:
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
    """Logarithms of the densities from which particles start, and of the posterior."""
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
    """Move one half of the particles by differences within the other half, then the other way round."""
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
    """Draw indices in proportion to weights that sum to 1, as evenly as can be."""
    steps = np.cumsum(weights)
    return np.searchsorted(steps / steps[-1], (np.arange(count) + rng.random()) / count).astype(np.int64)


def _differences(guides: Floats, count: int, rng: np.random.Generator) -> Floats:
    first, second = (rng.integers(len(guides), size=count) for _ in range(2))
    size = guides.shape[1]
    # 2.38/sqrt(2 d) suits a normal posterior (ter Braak 2006); whole differences jump between optima.
    scale = np.where(rng.random(count) < 0.1, 1.0, 2.38 / np.sqrt(2.0 * size))
    # The jitter keeps moves from living in the particles' span.
    return scale[:, None] * (guides[first] - guides[second]) + 1e-3 * rng.standard_normal((count, size))


def _tempered(likelihood: Floats, step: float) -> Floats:
    weights = np.exp(step * (likelihood - likelihood.max()))
    return np.asarray(weights / weights.sum())


def _step(likelihood: Floats, most: float) -> float:
    """Growth of the exponent that keeps half of the particles effective, by bisection."""

    def too_few(step: float) -> bool:
        return 1.0 / float((_tempered(likelihood, step) ** 2).sum()) / len(likelihood) < 0.5

    return bisected(0.0, most, too_few, halvings=50)[1] if too_few(most) else most
