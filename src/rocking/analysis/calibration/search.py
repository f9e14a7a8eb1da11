"""Where the candidates are that a posterior is drawn from: runs that look on their own, then share, then compare.

The likelihood of a population comes from blocks that were simulated near it. So what decides whether all regions of the
posterior are found is where blocks were tried. Each run fills the space evenly, fits, tries blocks drawn from what it
has found, and so on. Then the runs tell each other where they have looked, though not what they saw: each tries blocks
of its own in all regions that any of them has found, until they agree or a limit is reached. A region that none of
them has met is not found by comparing them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rocking.analysis.calibration import population
from rocking.analysis.calibration.candidates import WIDENED, Candidates
from rocking.analysis.calibration.evidence import Evidence
from rocking.analysis.calibration.posterior import posterior
from rocking.analysis.calibration.space import Space
from rocking.arrays import Flags, Floats

#: Independent runs.
RUNS: Final = 2

#: A run's candidates come in eighths: two that fill the space, three that are guided by the run's own fits, three that
#: are guided by the fits of all runs. While the runs disagree, up to four more of these.
_PARTS: Final = 8
_OWN: Final = 3
_SHARED: Final = 3
_MORE: Final = 4

#: Draws from a posterior, and rounds of moves after each step of their tempering: where they guide the search, and
#: where they are compared.
_GUIDING: Final = (256, 2)
_COMPARED: Final = (256, 4)

#: Runs agree where R-hat is below this: their means then differ by less than two thirds of a standard deviation.
AGREEMENT: Final = 1.1

Tried = Callable[[Floats], NDArray[np.float32]]


@dataclass(frozen=True, eq=False)
class Problem:
    """What is asked: which populations of the space explain what was observed, and what a block does (`tried`)."""

    space: Space
    observed: Flags
    lapse: float
    tried: Tried

    def filling(self, count: int, rng: np.random.Generator) -> Candidates:
        """Try blocks that fill the space evenly."""
        points = self.space.spread_evenly(count, rng)
        return Candidates(self.space, points, self.tried(points), count)

    def guided(self, candidates: Candidates, populations: Floats, count: int, rng: np.random.Generator) -> Candidates:
        """Try blocks that are drawn from populations as well."""
        points = population.drawn(populations, WIDENED, count, rng)
        points = points[self.space.contains(points)]
        return candidates.joined((count, populations), points, self.tried(points))

    def evidence(self, candidates: Candidates) -> Evidence:
        """Return what candidates tell."""
        return Evidence(candidates, self.observed, self.lapse)

    def guide(self, candidates: Candidates, rng: np.random.Generator) -> Floats:
        """Draw populations around which to look next."""
        return posterior(self.evidence(candidates), *_GUIDING, rng, progress=False)


@dataclass(frozen=True, eq=False)
class Search:
    """What the runs found.

    Attributes
    ----------
    evidence : Evidence
        All candidates of all runs.
    posteriors : tuple of ndarray
        Populations, drawn from the candidates of each run alone.
    """

    evidence: Evidence
    posteriors: tuple[Floats, ...]

    @property
    def agreement(self) -> dict[str, float]:
        """R-hat between the runs of each parameter's centre, by name."""
        centres = [population.unpacked(one)[0] for one in self.posteriors]
        named = [self.evidence.candidates.space.named(one) for one in centres]
        return {name: r_hat(np.array([one[name] for one in named])) for name in named[0]}


def search(problem: Problem, candidates: int, rng: np.random.Generator) -> Search:
    """Try about so many candidates; up to half as many again while the runs disagree."""
    part = max(candidates // (RUNS * _PARTS), 1)
    streams = rng.spawn(RUNS)
    runs = [_alone(problem, part, stream) for stream in streams]
    for _ in range(_SHARED):
        guides = [problem.guide(run, stream) for run, stream in zip(runs, streams, strict=True)]
        runs = _shared(problem, runs, guides, part, streams)
    found = _compared(problem, runs, streams)
    for _ in range(_MORE):
        if max(found.agreement.values()) < AGREEMENT:
            break
        runs = _shared(problem, runs, found.posteriors, part, streams)
        found = _compared(problem, runs, streams)
    return found


def _alone(problem: Problem, part: int, rng: np.random.Generator) -> Candidates:
    run = problem.filling((_PARTS - _OWN - _SHARED) * part, rng)
    for _ in range(_OWN):
        run = problem.guided(run, problem.guide(run, rng), part, rng)
    return run


def _shared(
    problem: Problem,
    runs: Sequence[Candidates],
    guides: Sequence[Floats],
    part: int,
    streams: Sequence[np.random.Generator],
) -> list[Candidates]:
    """Let every run try blocks of its own wherever any run would look."""
    guide = np.concatenate(guides)
    return [problem.guided(run, guide, part, stream) for run, stream in zip(runs, streams, strict=True)]


def _compared(problem: Problem, runs: Sequence[Candidates], streams: Sequence[np.random.Generator]) -> Search:
    posteriors = tuple(
        posterior(problem.evidence(run), *_COMPARED, stream, progress=False)
        for run, stream in zip(runs, streams, strict=True)
    )
    return Search(problem.evidence(Candidates.pooled(runs)), posteriors)


def r_hat(runs: Floats) -> float:
    """R-hat of draws of several runs, shape (runs, draws): of their ranks or of their distances from the middle.

    1 where runs differ no more than draws within a run (Vehtari et al. 2021, here without splitting the runs).

    Examples
    --------
    >>> import numpy as np
    >>> same = np.random.default_rng(0).normal(size=(2, 500))
    >>> r_hat(same) < 1.01, r_hat(same + [[0.0], [1.0]]) > 1.1, r_hat(same * [[1.0], [3.0]]) > 1.1
    (True, True, True)
    """
    return max(_r_hat(_normal_scores(values)) for values in (runs, np.abs(runs - np.median(runs))))


def _normal_scores(runs: Floats) -> Floats:
    from scipy.special import ndtri
    from scipy.stats import rankdata

    return np.asarray(ndtri((rankdata(runs).reshape(runs.shape) - 0.375) / (runs.size + 0.25)))


def _r_hat(scores: Floats) -> float:
    draws = scores.shape[1]
    within = float(scores.var(axis=1, ddof=1).mean())
    between = float(scores.mean(axis=1).var(ddof=1))
    return math.sqrt((draws - 1) / draws + between / within)
