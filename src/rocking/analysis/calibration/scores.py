"""How good predicted probabilities are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import ArrayLike

from rocking.errors import InvalidOption


@dataclass(frozen=True)
class Scores:
    """Measures of predicted probabilities against outcomes.

    Attributes
    ----------
    accuracy : float
        Share of outcomes on the side of 1/2 that was predicted.
    log_loss : float
        Mean of -log of the probability that was given to the outcome; infinite after a certainty that failed.
    brier : float
        Mean squared difference between probability and outcome (Brier 1950).
    """

    accuracy: float
    log_loss: float
    brier: float

    def __str__(self) -> str:
        """Write the three in one line."""
        return f"accuracy {100 * self.accuracy:.1f} %, log loss {self.log_loss:.3f}, Brier score {self.brier:.3f}"

    def __repr__(self) -> str:
        return f"<Scores: {self}>"

    @classmethod
    def of(cls, probabilities: ArrayLike, observed: ArrayLike) -> Scores:
        """Measure probabilities against outcomes of the same number.

        Raises
        ------
        InvalidOption
            If the shapes differ, there is nothing to measure, or a probability is not between 0 and 1.

        Examples
        --------
        >>> Scores.of([0.9, 0.2, 0.6], [True, False, False])
        <Scores: accuracy 66.7 %, log loss 0.415, Brier score 0.137>
        """
        given, seen = np.asarray(probabilities, dtype=np.float64), np.asarray(observed, dtype=bool)
        if given.shape != seen.shape or not given.size:
            raise InvalidOption(f"there must be one probability for each outcome, not {given.shape} and {seen.shape}")
        if not np.all((given >= 0.0) & (given <= 1.0)):
            raise InvalidOption("probabilities must lie between 0 and 1")
        with np.errstate(divide="ignore"):
            losses = -np.log(np.where(seen, given, 1.0 - given))
        return cls(
            accuracy=float(np.mean((given > 0.5) == seen)),
            log_loss=float(losses.mean()),
            brier=float(np.mean((given - seen) ** 2)),
        )

    @classmethod
    def mean(cls, scores: Sequence[Scores]) -> Scores:
        """Mean of each measure."""
        table = np.array([astuple(one) for one in scores])
        return cls(*(float(value) for value in table.mean(axis=0)))
