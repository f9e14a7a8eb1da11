"""Diagnostics of a calibration: scores, effective candidates, agreement of runs, bounds reached."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.calibration.search import AGREEMENT, RUNS, Search, unpacked
from rocking.calibration.space import HIGHEST, Space, unit_of
from rocking.core.arrays import Flags, Floats
from rocking.core.tables import format_count
from rocking.errors import InvalidOption

#: An interval ends at a bound if more than this share of the posterior (the share beyond one end) is within the
#: outermost part of the range, in the logarithm.
_OUTERMOST: Final = 0.05


@dataclass(frozen=True)
class Scores:
    """Scores of predicted probabilities.

    Attributes
    ----------
    accuracy : float
        Share of outcomes predicted on the correct side of 1/2.
    log_loss : float
        Mean of -log of the probability of the observed outcome, infinite for an outcome with probability zero.
    brier : float
        Mean squared difference between probability and outcome (Brier 1950).

    See Also
    --------
    rocking.validate : compare predictions with tests.

    Examples
    --------
    >>> Scores.from_predictions([0.9, 0.2, 0.6], [True, False, False])
    <Scores: accuracy 66.7 %, log loss 0.415, Brier score 0.137>
    """

    accuracy: float
    log_loss: float
    brier: float

    def __str__(self) -> str:
        return f"accuracy {100 * self.accuracy:.1f} %, log loss {self.log_loss:.3f}, Brier score {self.brier:.3f}"

    def __repr__(self) -> str:
        return f"<Scores: {self}>"

    @classmethod
    def from_predictions(cls, probabilities: ArrayLike, observed: ArrayLike) -> Scores:
        """Compute the scores of predicted probabilities of m outcomes (bool)."""
        given, seen = np.asarray(probabilities, dtype=np.float64), np.asarray(observed, dtype=bool)
        if given.shape != seen.shape or not given.size:
            raise InvalidOption(f"there must be one probability for each outcome, not {given.shape} and {seen.shape}")
        if not np.all((given >= 0.0) & (given <= 1.0)):
            raise InvalidOption("{} must lie between 0 and 1", "probabilities")
        return cls(
            accuracy=float(np.mean((given > 0.5) == seen)),
            log_loss=float(log_losses(given, seen).mean()),
            brier=float(np.mean((given - seen) ** 2)),
        )


def log_losses(probabilities: Floats, observed: Flags) -> Floats:
    """Compute -log of the probability of each observed outcome, infinite for probability zero."""
    with np.errstate(divide="ignore"):
        return np.asarray(-np.log(np.where(observed, probabilities, 1.0 - probabilities)))


@dataclass(frozen=True)
class BoundReached:
    """Estimate whose interval ends at a bound.

    Attributes
    ----------
    name, end : str
        Estimate and bound, "lower" or "upper".
    bound, wider : float
        Bound and suggested wider bound, in the parameter's unit.
    share : float
        Share of the posterior in the outermost 5 % of the range.
    """

    name: str
    end: str
    bound: float
    wider: float
    share: float

    def __str__(self) -> str:
        unit = unit_of(self.name)
        bound = f"{self.bound:g}" + ("" if unit == "1" else f" {unit}")
        return (
            f"{self.name} reaches its {self.end} bound of {bound}: {100 * self.share:.0f} % of the posterior lies in "
            f"the outermost {100 * _OUTERMOST:.0f} % of the range, so that the bound sets the {self.end} end of the "
            "interval; unless you know that bound, "
            f"set that of {self.name.partition('_')[0]} to {self.wider:g}"
        )


@dataclass(frozen=True)
class Diagnostics:
    """Reliability of a calibration.

    Attributes
    ----------
    candidates : int
        Number of blocks simulated under every motion.
    effective : float
        Effective number of candidates that represent a typical population of the posterior.
    agreement : mapping of str to float
        R-hat of each estimate between independent runs: 1 if they agree, above 1.1 if they disagree.
    bounds_reached : tuple of BoundReached
        Estimates whose interval ends at a bound.
    """

    candidates: int
    effective: float
    agreement: Mapping[str, float]
    bounds_reached: tuple[BoundReached, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings about the estimates, one sentence each."""
        notes = [f"{one}" for one in self.bounds_reached]
        apart = [f"{name} ({value:.2f})" for name, value in self.agreement.items() if value > AGREEMENT]
        if apart:
            held = "the estimates weigh what both found; double the candidates, or narrow the bounds to what you know"
            notes.append(f"independent runs disagree (R-hat) on {', '.join(apart)}: {held}")
        if self.effective < 20.0:
            few = f"only {format_count(round(self.effective), 'candidate')} can tell what a typical population does"
            notes.append(f"{few}: double the candidates, or narrow the bounds to what you know")
        return tuple(notes)

    def __str__(self) -> str:
        search = (
            f"{format_count(self.candidates, 'candidate')}, {self.effective:.0f} effective for a typical population; "
            f"{RUNS} independent runs, R-hat at most {max(self.agreement.values()):.2f}"
        )
        return "\n".join([search, *(f"note: {sentence}" for sentence in self.notes)])


def diagnosed(found: Search, posterior: Floats) -> Diagnostics:
    """Compute the diagnostics of a search from the draws of its posterior."""
    space = found.evidence.candidates.space
    return Diagnostics(
        len(found.evidence.candidates.points),
        float(np.median(found.evidence.effective(posterior))),
        found.agreement,
        bounds_reached(space, unpacked(posterior)[0]),
    )


def bounds_reached(space: Space, centres: Floats) -> tuple[BoundReached, ...]:
    """Return estimates whose interval ends at a bound, from draws of the population's centre."""
    found = []
    for name, values in space.named(centres).items():
        parameter = name.partition("_")[0]
        if parameter not in space.unknown:
            continue
        k = space.unknown.index(parameter)
        low, high = float(space.lower[k]), float(space.upper[k])
        edge = _OUTERMOST * (high - low)
        wider = min(2.0 * math.exp(high), HIGHEST[parameter])
        ends = [
            ("lower", low, 0.5 * math.exp(low), np.log(values) < low + edge),
            ("upper", high, wider, np.log(values) > high - edge),
        ]
        for end, bound, further, near in ends:
            share = float(near.mean())
            # No block exceeds such a bound.
            if share > 0.05 and bound < math.log(HIGHEST[parameter]) - 1e-9:
                found.append(BoundReached(name, end, math.exp(bound), further, share))
    return tuple(found)
