"""What a block that still stands says: how strongly, and how often, it has not been shaken."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking import checks
from rocking.analysis.fragility.curve import FragilityCurve, in_units
from rocking.analysis.hazard import HazardCurve, hazard_line
from rocking.analysis.risk import Rate
from rocking.arrays import Floats
from rocking.errors import InvalidOption
from rocking.motion.scaling import Measure
from rocking.result import DrawnResult
from rocking.tables import as_written, counted, known_digits, text_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Probabilities of exceedance of the intensities in the table.
_CHANCES: Final = (0.05, 0.16, 0.5, 0.84, 0.95)

#: Probabilities between which a figure shows the rates, and its points.
_SHOWN: Final = (0.01, 0.999)
_POINTS: Final = 200


@dataclass(frozen=True, eq=False, repr=False)
class Survival(DrawnResult):
    """A limit state that was not exceeded in a time, and what that says of the shaking; from `Fragility.survival`.

    Its figure has the largest rates that fit with the survival, and the hazard curve beside them.

    Attributes
    ----------
    curve : FragilityCurve
        Probabilities that the limit is exceeded.
    measure : Measure
        What its intensity is.
    description : str
        What was simulated or observed.
    years : float
        For how long it was not exceeded.
    confidence : float
        Probability with which it would have been, if shaking were any stronger or more frequent than what is said.
    hazard : HazardCurve or None
        Annual rates of intensities at the site.
    rate : Rate or None
        Annual rate of the limit state under that hazard curve.
    """

    curve: FragilityCurve
    measure: Measure
    description: str
    years: float
    confidence: float
    hazard: HazardCurve | None
    rate: Rate | None

    def __post_init__(self) -> None:
        object.__setattr__(self, "years", checks.positive(self.years, "years", InvalidOption))
        checks.share(self.confidence, "confidence", InvalidOption)

    @property
    def intensity(self) -> Floats:
        """Intensities (SI) that exceed the limit with probabilities of 0.05, 0.16, 0.5, 0.84 and 0.95."""
        return np.array([self.curve.intensity_of(chance) for chance in _CHANCES])

    @property
    def unlikely(self) -> float:
        """Intensity (SI) that one motion, had it come, would have exceeded the limit with the confidence asked for."""
        return self.curve.intensity_of(self.confidence)

    @property
    def largest_rate(self) -> Floats:
        """Annual rates of motions of each `intensity` or more above which the limit would have been exceeded."""
        return self.curve.largest_rate(self.intensity, self.years, self.confidence)

    @property
    def probability(self) -> float:
        """Probability, under the hazard curve, that the limit is not exceeded in the time; NaN without one."""
        return math.nan if self.rate is None else self.rate.survival(self.years)

    @property
    def interval(self) -> tuple[float, float]:
        """Its confidence interval, from that of the fragility."""
        if self.rate is None:
            return math.nan, math.nan
        low, high = self.rate.interval
        return math.exp(-high * self.years), math.exp(-low * self.years)

    @property
    def contradicts(self) -> bool:
        """Whether the hazard curve makes the survival less probable than 1 - confidence, all through its interval."""
        return self.rate is not None and self.interval[1] < 1.0 - self.confidence

    def summary(self) -> str:
        measure, share = self.measure, f"{100.0 * self.confidence:g} %"
        header = [measure.label, "probability", "at most a year", "at most once in (years)"]
        columns: list[list[Any]] = [
            [measure.scale * x for x in self.intensity],
            [*_CHANCES],
            [f"{rate:.2g}" for rate in self.largest_rate],
            [f"{float(f'{1.0 / rate:.2g}'):.7g}" for rate in self.largest_rate],
        ]
        if self.hazard is not None:
            rates = self.hazard.rate_of(self.intensity)
            header += ["hazard curve, a year", "too often"]
            columns += [[f"{rate:.2g}" for rate in rates], (rates > self.largest_rate).tolist()]
        return "\n".join(
            [
                f"{self.curve.limit_state}: not in {counted(self.years, 'year')}; intensity: {measure.label}",
                f"most likely no motion reached {in_units(self.unlikely, self.measure)}: one that did would have "
                f"exceeded the limit with {share}",
                f"largest rates of motions of an intensity or more; with larger ones the limit would have been "
                f"exceeded with {share}",
                "",
                text_table(header, [*map(list, zip(*columns, strict=True))]),
                *([] if self.hazard is None else ["", self._verdict(self.hazard)]),
            ]
        )

    def _verdict(self, hazard: HazardCurve) -> str:
        """Say how probable the survival is under a hazard curve."""
        chance, between = known_digits(self.probability, self.interval)
        text = (
            f"under the hazard curve {hazard.name!r} the probability of {counted(self.years, 'year')} without it is "
            f"{chance} ({100.0 * self.curve.confidence:g} % interval {between})"
        )
        least = f"{1.0 - self.confidence:.3g}"
        if self.probability >= 1.0 - self.confidence:
            return f"{text}, so they do not contradict each other"
        if not self.contradicts:
            return f"{text}; below {least} they would contradict each other, which the interval does not settle"
        return (
            f"{text}; all of that is below {least}, so they contradict each other: the hazard curve is too high, or "
            "the block stronger than its fragility, or younger"
        )

    def to_dict(self) -> dict[str, Any]:
        column = self.measure.column
        found = {
            "limit_state": self.curve.limit_state,
            "years": self.years,
            "confidence": self.confidence,
            f"most_likely_never_{column}": self.unlikely,
            "probability_of_exceedance": [*_CHANCES],
            column: self.intensity,
            "largest_annual_rate": self.largest_rate,
        }
        if self.hazard is None:
            return found
        return found | {
            "hazard_annual_rate": self.hazard.rate_of(self.intensity),
            "probability": self.probability,
            "probability_interval": [*self.interval],
            "contradicts": self.contradicts,
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.risk import survival_figure

        ends = [self.curve.intensity_of(chance) for chance in _SHOWN]
        if self.hazard is not None:
            ends += self.hazard.intensity[[0, -1]].tolist()
        at = np.geomspace(min(ends), max(ends), _POINTS)
        at = at[self.curve.probability(at) > _SHOWN[0] * 0.1]
        return survival_figure(
            intensity=self.measure.scale * at,
            largest=self.curve.largest_rate(at, self.years, self.confidence),
            largest_label=f"at most, with {counted(self.years, 'year')} without {self.curve.limit_state} "
            f"({100.0 * self.confidence:g} %)",
            hazard=None if self.hazard is None else hazard_line(self.hazard, at),
            intensity_label=self.measure.label,
            title=title or as_written(self.description),
            ax=ax,
            figsize=figsize,
        )

    def _headline(self) -> str:
        time, never = counted(self.years, "year"), in_units(self.unlikely, self.measure)
        return f"{self.curve.limit_state}: not in {time}; most likely never {never} or more"
