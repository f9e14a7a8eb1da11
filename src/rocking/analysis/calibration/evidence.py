"""How probable the outcomes are for a population of blocks.

The chance that a test overturns the specimen is the share of the population that overturns under its motion, and that
share is a weighted mean over candidate blocks that were simulated once, whatever the population.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.analysis.calibration.candidates import Candidates
from rocking.analysis.calibration.population import batches, unpacked
from rocking.arrays import Flags, Floats
from rocking.kernels.population import shares

#: A share that n simulated blocks estimate is itself uncertain: Jeffreys' prior, Beta(1/2, 1/2).
_JEFFREYS: Final = 0.5


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

    def of_tests(self, tests: Flags) -> Evidence:
        """Evidence of some of the tests alone."""
        return Evidence(self.candidates.of_tests(tests), self.observed[tests], self.lapse)

    def weights(self, populations: Floats) -> NDArray[np.float32]:
        """Share of each population that each candidate stands for, shape (c, n); rows sum to 1."""
        weights = self._factors(populations) @ self._powers
        weights -= weights.max(axis=1, keepdims=True)
        np.exp(weights, out=weights)
        weights /= weights.sum(axis=1, keepdims=True)
        return weights

    def mean_weights(self, populations: Floats) -> Floats:
        """Weights of the candidates, shape (n,), averaged over populations."""
        parts = [self.weights(part).sum(axis=0, dtype=np.float64) for part in batches(populations)]
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
        overturned, powers = self.candidates.overturned, self._powers
        found = np.empty((len(populations), overturned.shape[1]), np.float32)
        effective = np.empty(len(populations))
        room = np.empty(powers.shape[1], np.float32)
        shares(self._factors(populations), powers, overturned, room, found, effective)
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
        return np.vstack([points.T, points.T**2, self.candidates.log_weights]).astype(np.float32)

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
