"""Blocks that were tried on every motion, and how they were chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rocking.analysis.calibration import population
from rocking.analysis.calibration.space import Space
from rocking.arrays import Flags, Floats

#: Blocks are drawn from a guide with its dispersions wider by a factor.
WIDENED = 1.2


@dataclass(frozen=True, eq=False)
class Candidates:
    """Blocks that were tried.

    Attributes
    ----------
    space : Space
        Where they are from.
    points : ndarray, shape (n, k)
        Their coordinates.
    overturned : ndarray, shape (n, m)
        1 where a block overturned under a motion, else 0.
    evenly : int
        How many of them fill the space evenly.
    guides : tuple of (int, ndarray)
        How many were drawn from which populations, those outside the space included.
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
        parts += [np.log(count) + population.log_density(guide, WIDENED, points) for count, guide in self.guides]
        return np.asarray(np.logaddexp.reduce(parts))
