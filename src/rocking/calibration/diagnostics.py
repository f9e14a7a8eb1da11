"""Diagnostics of a calibration: scores, effective candidates, agreement of runs, bounds reached."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.calibration.search import MAX_R_HAT, RUN_COUNT, SearchResult, split_populations
from rocking.calibration.space import MAX_VALUES, Space, find_parameter_unit
from rocking.core.arrays import Flags, Floats
from rocking.core.tables import format_count
from rocking.errors import OptionError

#: An interval ends at a bound if more than this share of the posterior (the share beyond one end) is within the
#: outermost part of the range, in the logarithm.
_EDGE_SHARE: Final = 0.05


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
        Mean squared difference between probability and outcome :cite:p:`brier1950`.

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
        predicted, actual = np.asarray(probabilities, dtype=np.float64), np.asarray(observed, dtype=bool)
        if predicted.shape != actual.shape or not predicted.size:
            shapes = f"{predicted.shape} and {actual.shape}"
            raise OptionError(f"probabilities and outcomes must have the same shape; got {shapes}")
        if not np.all((predicted >= 0.0) & (predicted <= 1.0)):
            raise OptionError("{} must be between 0 and 1", "probabilities")
        scores = (predicted > 0.5) == actual, compute_log_losses(predicted, actual), (predicted - actual) ** 2
        return cls(*(float(np.mean(values)) for values in scores))


def compute_log_losses(probabilities: Floats, observed: Flags) -> Floats:
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
    bound, wider_bound : float
        Bound and suggested wider bound, in the parameter's unit.
    share : float
        Share of the posterior in the outermost 5 % of the range.

    See Also
    --------
    rocking.calibration.Diagnostics : Assess the reliability of a calibration.
    rocking.calibrate : Fit blocks to the outcomes of tests.

    Examples
    --------
    >>> from rocking.calibration import BoundReached
    >>> reached = BoundReached("alpha", "upper", bound=0.3, wider_bound=0.6, share=0.4)
    >>> f"{reached.name}: widen the {reached.end} bound from {reached.bound} to {reached.wider_bound} rad"
    'alpha: widen the upper bound from 0.3 to 0.6 rad'
    """

    name: str
    end: str
    bound: float
    wider_bound: float
    share: float

    def __str__(self) -> str:
        bound = f"{self.bound:g} {find_parameter_unit(self.name)}".removesuffix(" 1")
        return (
            f"{self.name} reaches its {self.end} bound of {bound}: {100 * self.share:.0f} % of the posterior lies in "
            f"the outermost {100 * _EDGE_SHARE:.0f} % of the range, so that the bound sets the {self.end} end of the "
            f"interval; unless this bound is certain, set that of {self.name.partition('_')[0]} to {self.wider_bound:g}"
        )


@dataclass(frozen=True)
class Diagnostics:
    """Reliability of a calibration.

    Attributes
    ----------
    candidate_count : int
        Number of blocks simulated under every motion.
    effective_count : float
        Effective number of candidates that represent a typical population of the posterior.
    r_hat : mapping of str to float
        R-hat of each estimate between independent runs: 1 if they agree, above 1.1 if they disagree.
    bounds_reached : tuple of BoundReached
        Estimates whose interval ends at a bound.

    See Also
    --------
    rocking.calibrate : Fit blocks to the outcomes of tests.
    rocking.Calibration : Inspect the fitted ensemble and its diagnostics.

    Examples
    --------
    >>> from rocking.calibration import Diagnostics
    >>> Diagnostics(candidate_count=256, effective_count=12.0, r_hat={"alpha": 1.02}, bounds_reached=()).notes
    ('only 12 candidates represent a typical population: double the candidates, or narrow the bounds',)
    """

    candidate_count: int
    effective_count: float
    r_hat: Mapping[str, float]
    bounds_reached: tuple[BoundReached, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings about the estimates, one sentence each."""
        notes, correction = [*map(str, self.bounds_reached)], "double the candidates, or narrow the bounds"
        disagreeing = ", ".join(f"{name} ({value:.2f})" for name, value in self.r_hat.items() if value > MAX_R_HAT)
        if disagreeing:
            disagreement = f"independent runs disagree (R-hat) on {disagreeing}"
            notes.append(f"{disagreement}: the estimates average them; {correction}")
        if self.effective_count < 20.0:
            shortage = f"only {format_count(round(self.effective_count), 'candidate')} represent a typical population"
            notes.append(f"{shortage}: {correction}")
        return tuple(notes)

    def __str__(self) -> str:
        candidates = format_count(self.candidate_count, "candidate")
        effective = f"{self.effective_count:.0f} effective for a typical population"
        runs = f"{RUN_COUNT} independent runs, R-hat at most {max(self.r_hat.values()):.2f}"
        return "\n".join([f"{candidates}, {effective}; {runs}", *(f"note: {sentence}" for sentence in self.notes)])


def diagnose(search: SearchResult, populations: Floats) -> Diagnostics:
    """Compute the diagnostics of a search from the draws of its posterior."""
    candidates, effective = search.evidence.candidates, float(np.median(search.evidence.count_effective(populations)))
    bounds_reached = list_bounds_reached(candidates.space, split_populations(populations)[0])
    return Diagnostics(len(candidates.points), effective, search.r_hat, bounds_reached)


def list_bounds_reached(space: Space, centres: Floats) -> tuple[BoundReached, ...]:
    """Return estimates whose interval ends at a bound, from draws of the population's centre."""
    bounds_reached = []
    for name, values in space.parameters_by_name(centres).items():
        parameter = name.partition("_")[0]
        if parameter not in space.unknown:
            continue
        k, logs, max_value = space.unknown.index(parameter), np.log(values), MAX_VALUES[parameter]
        low, high = float(space.lower[k]), float(space.upper[k])
        edge_width = _EDGE_SHARE * (high - low)
        ends = ("lower", low, 0.5, logs < low + edge_width), ("upper", high, 2.0, logs > high - edge_width)
        for end, bound, factor, is_near in ends:
            share = float(is_near.mean())
            # Bounds at the largest possible value cannot be widened.
            if share > 0.05 and bound < math.log(max_value) - 1e-9:
                wider_bound = min(factor * math.exp(bound), max_value)
                bounds_reached.append(BoundReached(name, end, math.exp(bound), wider_bound, share))
    return tuple(bounds_reached)
