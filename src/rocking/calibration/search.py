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
from functools import cached_property, partial
from typing import Final

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from rocking.calibration.space import Space
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.bisection import bisect
from rocking.core.progress import Progress
from rocking.core.threads import choose_thread_count
from rocking.kernels import population as kernel

#: Prior standard deviation of the logarithm of a dispersion from test to test.
_DISPERSION_LOG_DEVIATION: Final = 0.6

#: Number of populations weighted at once, which bounds the memory.
_BATCH_SIZE: Final = 64


#: Factor on the dispersions of fitted populations for drawing blocks.
PROPOSAL_WIDTH: Final = 1.2

#: Jeffreys' prior, Beta(1/2, 1/2), of a share estimated from n simulated blocks.
_PRIOR_COUNT: Final = 0.5


def split_populations(populations: Floats) -> tuple[Floats, Floats]:
    """Split populations into centres and dispersions, shape (c, k) each."""
    k = populations.shape[1] // 2
    return populations[:, :k], np.exp(populations[:, k:])


def extend_to_populations(space: Space, centres: Floats, rng: Generator) -> Floats:
    """Draw dispersions from the prior for each centre."""
    scores = rng.standard_normal(centres.shape)
    return np.hstack([centres, np.log(space.dispersions) + _DISPERSION_LOG_DEVIATION * scores])


def compute_log_prior(space: Space, populations: Floats) -> Floats:
    """Compute the log-prior of the dispersions up to a constant, shape (c,)."""
    k = populations.shape[1] // 2
    scores = (populations[:, k:] - np.log(space.dispersions)) / _DISPERSION_LOG_DEVIATION
    return np.asarray(-0.5 * (scores**2).sum(axis=1))


def sample_points(populations: Floats, width: float, count: int, rng: Generator) -> Floats:
    """Draw points from populations in turn, with dispersions times `width`, shape (count, k)."""
    centre, dispersion = split_populations(populations[np.arange(count) % len(populations)])
    return centre + width * dispersion * rng.standard_normal(centre.shape)


def compute_log_density(populations: Floats, width: float, points: Floats) -> Floats:
    """Compute the log-density of the distribution of `sample_points` at points, shape (n,)."""
    centre, dispersion = split_populations(populations)
    mean = centre.mean(axis=0)
    centre, centred = centre - mean, points - mean
    precision = (width * dispersion) ** -2
    constant = 0.5 * (np.log(precision / (2.0 * np.pi)) - precision * centre**2).sum(axis=1)
    coefficients = np.ascontiguousarray(np.vstack([(precision * centre).T, -0.5 * precision.T, constant]))
    monomials = np.hstack([centred, centred**2, np.ones((len(points), 1))])
    log_sums = np.empty(len(points))
    kernel.write_log_sums(monomials, coefficients, np.empty(len(populations)), log_sums)
    return np.asarray(log_sums - np.log(len(populations)))


@dataclass(frozen=True, eq=False)
class Candidates:
    """Simulated blocks: coordinates (n, k), and overturning (1 or 0) under each motion, (n, m)."""

    space: Space
    points: Floats
    overturned: NDArray[np.float32]
    filling_count: int
    proposals: tuple[tuple[int, Floats], ...] = ()

    @classmethod
    def concatenate(cls, runs: Sequence[Candidates]) -> Candidates:
        """Concatenate candidates."""
        return cls(
            runs[0].space,
            np.concatenate([run.points for run in runs]),
            np.concatenate([run.overturned for run in runs]),
            sum(run.filling_count for run in runs),
            tuple(proposal for run in runs for proposal in run.proposals),
        )

    def select_tests(self, is_selected: Flags) -> Candidates:
        """Select some of the motions."""
        return replace(self, overturned=np.ascontiguousarray(self.overturned[:, is_selected]))

    @cached_property
    def log_weights(self) -> Floats:
        """Compute the log-volume that each candidate represents, smaller in dense regions (Owen and Zhou 2000)."""
        return -self.log_density(self.points)

    def log_density(self, points: Floats) -> Floats:
        """Compute the log-density of candidates per volume at points in the space, shape (c,)."""
        log_terms = [np.full(len(points), np.log(self.filling_count / self.space.volume))]
        for count, proposal in self.proposals:
            log_terms.append(np.log(count) + compute_log_density(proposal, PROPOSAL_WIDTH, points))
        return np.asarray(np.logaddexp.reduce(log_terms))


@dataclass(frozen=True, eq=False)
class Evidence:
    """Observed outcomes of m motions (m,), outcomes of n candidates under them, and the outlier_probability."""

    candidates: Candidates
    observed: Flags
    outlier_probability: float

    def select_tests(self, is_selected: Flags) -> Evidence:
        """Select some of the tests."""
        return replace(self, candidates=self.candidates.select_tests(is_selected), observed=self.observed[is_selected])

    def weights(self, populations: Floats) -> NDArray[np.float32]:
        """Compute the share of each population that each candidate represents, shape (c, n), with row sums 1."""
        weights = self._compute_factors(populations) @ self._powers
        weights -= weights.max(axis=1, keepdims=True)
        np.exp(weights, out=weights)
        weights /= weights.sum(axis=1, keepdims=True)
        return weights

    def mean_weights(self, populations: Floats) -> Floats:
        """Compute weights of the candidates averaged over populations, shape (n,)."""
        batches = np.split(populations, range(_BATCH_SIZE, len(populations), _BATCH_SIZE))
        batch_sums = [self.weights(batch).sum(axis=0, dtype=np.float64) for batch in batches]
        return np.asarray(np.sum(batch_sums, axis=0) / len(populations))

    def probabilities(self, populations: Floats) -> Floats:
        """Compute the probability of overturning for each population and motion, shape (c, m)."""
        shares, effective_counts = self._compute_shares(populations)
        return include_outliers(estimate_share(shares, effective_counts[:, None]), self.outlier_probability)

    def count_effective(self, populations: Floats) -> Floats:
        """Compute the effective number of candidates that represent each population, shape (c,)."""
        return self._compute_shares(populations)[1]

    def log_likelihoods(self, populations: Floats) -> Floats:
        """Compute the log-likelihood of each population, shape (c,)."""
        if not len(populations):
            return np.zeros(0)
        probabilities = include_outliers(self._compute_shares(populations)[0], self.outlier_probability)
        return np.asarray(np.log(np.where(self.observed, probabilities, 1.0 - probabilities)).sum(axis=1))

    def _compute_shares(self, populations: Floats) -> tuple[Floats, Floats]:
        """Compute the share of each population that overturns, shape (c, m), and its effective number of candidates."""
        overturned, powers, factors = self.candidates.overturned, self._powers, self._compute_factors(populations)
        shares = np.empty((len(populations), overturned.shape[1]), np.float32)
        effective_counts = np.empty(len(populations))

        def compute_batch(start: int, end: int) -> None:
            exponents = np.empty(powers.shape[1], np.float32)
            kernel.write_overturned_fractions(
                factors[start:end], powers, overturned, exponents, shares[start:end], effective_counts[start:end]
            )

        batch_size = max(-(-len(populations) // choose_thread_count()), 16)
        starts = range(0, len(populations), batch_size)
        with ThreadPoolExecutor(max(len(starts), 1)) as pool:
            list(pool.map(compute_batch, starts, (start + batch_size for start in starts)))
        # Rounding can make a share exceed 1.
        return np.minimum(shares, 1.0, dtype=np.float64), effective_counts

    def _compute_factors(self, populations: Floats) -> NDArray[np.float32]:
        """Return factors, shape (c, 2 k + 1), of `_powers` in the logarithm of a candidate's weight."""
        centre, dispersion = split_populations(populations)
        precision = dispersion**-2
        scaled = precision * (centre - self._centre)
        return np.hstack([scaled, -0.5 * precision, np.ones((len(centre), 1))]).astype(np.float32)

    @cached_property
    def _powers(self) -> NDArray[np.float32]:
        """Return centred coordinates, their squares and the weights of the candidates, shape (2 k + 1, n)."""
        points = self.candidates.points - self._centre
        powers = np.vstack([points.T, points.T**2, self.candidates.log_weights])
        return np.ascontiguousarray(powers, dtype=np.float32)

    @cached_property
    def _centre(self) -> Floats:
        return np.asarray(self.candidates.points.mean(axis=0))


def estimate_share(share: Floats, effective_count: ArrayLike) -> Floats:
    """Compute the mean of a share estimated from this many effective blocks."""
    count = np.asarray(effective_count)
    return np.asarray((count * share + _PRIOR_COUNT) / (count + 2.0 * _PRIOR_COUNT))


def include_outliers(probabilities: Floats, outlier_probability: float) -> Floats:
    """Compute probabilities of recorded outcomes from those of the rocking block."""
    return outlier_probability + (1.0 - 2.0 * outlier_probability) * probabilities


#: Number of independent runs.
RUN_COUNT: Final = 2

#: Equal parts of a run's candidates: two that fill the space, then one for each exponent of the likelihood. The
#: search continues at most `_MAX_EXTENSIONS` times if runs disagree or too few candidates are effective.
_FILLING_PART_COUNT: Final = 2
_ANNEALING_EXPONENTS: Final = (0.03, 0.1, 0.3, 1.0, 1.0)
_MAX_EXTENSIONS: Final = 2

#: Draws from a posterior, and rounds of moves after each tempering step, for the search and the comparison.
_SAMPLE_COUNT: Final = 256
_PROPOSAL_ROUND_COUNT, _COMPARISON_ROUND_COUNT = 2, 4

#: Largest R-hat of agreeing runs: their means differ by less than two thirds of a standard deviation.
MAX_R_HAT: Final = 1.1


@dataclass(frozen=True, eq=False)
class Problem:
    """Calibration problem: parameter space, observed outcomes, and simulation of blocks."""

    space: Space
    observed: Flags
    outlier_probability: float
    simulate: Callable[[Floats], NDArray[np.float32]]

    def evidence(self, candidates: Candidates) -> Evidence:
        """Combine candidates with the observed outcomes."""
        return Evidence(candidates, self.observed, self.outlier_probability)

    def fill_space(self, count: int, rng: Generator) -> Candidates:
        """Simulate blocks that fill the space evenly."""
        points = self.space.sample_quasi_randomly(count, rng)
        return Candidates(self.space, points, self.simulate(points), count)

    def propose(self, candidates: Candidates, exponent: float, count: int, rng: Generator) -> Candidates:
        """Also simulate blocks near fitted populations, wider for a lower exponent of the likelihood."""
        evidence, round_count = self.evidence(candidates), _PROPOSAL_ROUND_COUNT
        populations = sample_posterior(evidence, _SAMPLE_COUNT, round_count, rng, exponent=exponent)
        points = sample_points(populations, PROPOSAL_WIDTH, count, rng)
        points = points[self.space.contains(points)]
        proposed = Candidates(self.space, points, self.simulate(points), 0, ((count, populations),))
        return Candidates.concatenate([candidates, proposed])


@dataclass(frozen=True, eq=False)
class SearchResult:
    """Candidates of all runs together and of each run, and populations drawn from each run alone."""

    evidence: Evidence
    runs: tuple[Candidates, ...]
    posteriors: tuple[Floats, ...]

    @property
    def effective_count(self) -> float:
        """Effective number of candidates that represent a typical population."""
        return float(np.median(self.evidence.count_effective(np.vstack(self.posteriors))))

    @property
    def r_hat(self) -> dict[str, float]:
        """R-hat between the runs of each parameter's centre, by name."""
        space = self.evidence.candidates.space
        centres = [space.parameters_by_name(split_populations(populations)[0]) for populations in self.posteriors]
        return {name: compute_r_hat(np.array([populations[name] for populations in centres])) for name in centres[0]}


def search(problem: Problem, candidate_count: int, rng: Generator) -> SearchResult:
    """Simulate about this many candidates, up to twice as many while runs disagree or few represent the posterior."""
    part_size = max(candidate_count // (RUN_COUNT * (_FILLING_PART_COUNT + len(_ANNEALING_EXPONENTS))), 1)
    streams = rng.spawn(RUN_COUNT)
    runs: Sequence[Candidates] = [problem.fill_space(_FILLING_PART_COUNT * part_size, stream) for stream in streams]
    result = _extend_runs(problem, runs, _ANNEALING_EXPONENTS, part_size, streams)
    for _ in range(_MAX_EXTENSIONS):
        if max(result.r_hat.values()) >= MAX_R_HAT:
            exponents = 0.1, 0.3, 1.0
        elif result.effective_count < 100.0:  # few blocks overrate a population that one of them fits by chance
            exponents = 1.0, 1.0, 1.0
        else:
            break
        result = _extend_runs(problem, result.runs, exponents, part_size, streams)
    return result


def _extend_runs(
    problem: Problem,
    runs: Sequence[Candidates],
    exponents: Sequence[float],
    part_size: int,
    streams: Sequence[Generator],
) -> SearchResult:
    """Extend every run by blocks near its fits, and compare the runs."""
    extended, posteriors = [], []
    for run, rng in zip(runs, streams, strict=True):
        for exponent in exponents:
            run = problem.propose(run, exponent, part_size, rng)
        extended.append(run)
        posteriors.append(sample_posterior(problem.evidence(run), _SAMPLE_COUNT, _COMPARISON_ROUND_COUNT, rng))
    return SearchResult(problem.evidence(Candidates.concatenate(extended)), tuple(extended), tuple(posteriors))


def compute_r_hat(runs: Floats) -> float:
    """Compute R-hat of the ranks, or distances from the middle, of draws (runs, draws)."""
    from scipy.special import ndtri
    from scipy.stats import rankdata

    def compute_from_ranks(values: Floats) -> float:
        scores = ndtri((rankdata(values).reshape(values.shape) - 0.375) / (values.size + 0.25))
        within, between = float(scores.var(axis=1, ddof=1).mean()), float(scores.mean(axis=1).var(ddof=1))
        return math.sqrt((values.shape[1] - 1) / values.shape[1] + between / within)

    return max(compute_from_ranks(values) for values in (runs, np.abs(runs - np.median(runs))))


def sample_posterior(evidence: Evidence, count: int, rounds: int, rng: Generator, *, exponent: float = 1.0) -> Floats:
    """Draw populations from the posterior, shape (count, 2 k), or from a tempered one if an exponent is set.

    Sequential Monte Carlo (Del Moral, Doucet and Jasra 2006): the centres of the particles start at candidates. Each
    step keeps half of the particles effective, resamples them, and moves them by differences of others (differential
    evolution).
    """
    space, points = evidence.candidates.space, evidence.candidates.points
    centres = points[rng.choice(len(points), min(4 * count, len(points)), replace=False)]
    particles = extend_to_populations(space, centres, rng)
    compute_densities = partial(_compute_log_densities, evidence, exponent)
    log_densities = compute_densities(particles)
    with Progress("fitting", 100) as bar:
        progress = 0.0  # exponent of the ratio of the posterior to the initial distribution
        while progress < 1.0:
            log_ratio = log_densities[1] - log_densities[0]
            increase = _find_step(log_ratio, 1.0 - progress)
            bar.advance(round(100 * (progress + increase)) - round(100 * progress))
            progress += increase
            indices = resample(_temper_weights(log_ratio, increase), count, rng)
            particles, log_densities = particles[indices], log_densities[:, indices]
            for _ in range(rounds):
                _move_particles(compute_densities, progress, particles, log_densities, rng)
    return particles


def _compute_log_densities(evidence: Evidence, exponent: float, populations: Floats) -> Floats:
    """Compute log-densities of the initial distribution of the particles and of the posterior, shape (2, n)."""
    candidates, centres = evidence.candidates, populations[:, : populations.shape[1] // 2]
    is_inside = candidates.space.contains(centres)
    prior = compute_log_prior(candidates.space, populations)
    log_densities = np.tile(np.where(is_inside, prior, -np.inf), (2, 1))
    log_densities[0, is_inside] += candidates.log_density(centres[is_inside])
    log_densities[1, is_inside] += exponent * evidence.log_likelihoods(populations[is_inside])
    return log_densities


def _move_particles(
    evaluate: Callable[[Floats], Floats], exponent: float, particles: Floats, log_densities: Floats, rng: Generator
) -> None:
    """Move one half of the particles by differences within the other half, then vice versa."""
    shuffled = rng.permutation(len(particles))
    half = len(particles) // 2
    for movers, guides in ((shuffled[:half], shuffled[half:]), (shuffled[half:], shuffled[:half])):
        new = particles[movers] + _sample_differences(particles[guides], len(movers), rng)
        new_densities = evaluate(new)
        with np.errstate(invalid="ignore"):
            changes = new_densities - log_densities[:, movers]
            gain = (1.0 - exponent) * changes[0] + exponent * changes[1]
        accepted = np.log(rng.random(len(movers))) < gain
        particles[movers[accepted]], log_densities[:, movers[accepted]] = (new[accepted], new_densities[:, accepted])


def resample(weights: Floats, count: int, rng: Generator) -> Integers:
    """Draw indices in proportion to weights with sum 1, as evenly as possible (systematic resampling)."""
    steps = np.cumsum(weights)
    return np.searchsorted(steps / steps[-1], (np.arange(count) + rng.random()) / count).astype(np.int64)


def _sample_differences(guides: Floats, count: int, rng: Generator) -> Floats:
    first, second = (rng.integers(len(guides), size=count) for _ in range(2))
    dimension_count = guides.shape[1]
    # 2.38/sqrt(2 d) suits a normal posterior (ter Braak 2006). Whole differences jump between optima.
    scale = np.where(rng.random(count) < 0.1, 1.0, 2.38 / np.sqrt(2.0 * dimension_count))
    # Jitter lets the moves leave the span of the particles.
    return scale[:, None] * (guides[first] - guides[second]) + 1e-3 * rng.standard_normal((count, dimension_count))


def _temper_weights(log_ratio: Floats, step: float) -> Floats:
    weights = np.exp(step * (log_ratio - log_ratio.max()))
    return np.asarray(weights / weights.sum())


def _find_step(log_ratio: Floats, max_step: float) -> float:
    """Find by bisection the increase of the exponent that keeps half of the particles effective."""

    def has_too_few(step: float) -> bool:
        return 1.0 / float((_temper_weights(log_ratio, step) ** 2).sum()) / len(log_ratio) < 0.5

    return bisect(0.0, max_step, has_too_few, halvings=50)[1] if has_too_few(max_step) else max_step
