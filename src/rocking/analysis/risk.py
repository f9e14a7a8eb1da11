"""Risk from fragility and hazard: annual rates and probabilities of exceeding limit states, and survival."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.analysis.curve import FragilityCurve, compute_extremes, format_intensity
from rocking.analysis.hazard import (
    HazardCurve,
    compute_log_rate,
    compute_log_rate_within,
    compute_log_survival,
    compute_share_density,
    compute_shares_beyond,
    create_hazard_line,
)
from rocking.analysis.probit import ExceedanceCounts, fit_or_limits
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.result import Result
from rocking.core.tables import escape_dollars, format_count, format_digits, format_table, format_within
from rocking.errors import OptionError
from rocking.motion.scaling import Measure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Probabilities of exceedance for the intensities in the table of a survival, and for the limits of its figure.
_DRAWN_PROBABILITIES: Final = (0.05, 0.16, 0.5, 0.84, 0.95)
_FIGURE_RANGE: Final = (0.01, 0.999)


@dataclass(frozen=True)
class Rate:
    """Mean annual rate of exceeding a limit state.

    Attributes
    ----------
    limit_state : str
        Name of the limit state.
    annual_rate : float
        Exceedances per year.
    interval : (float, float)
        Confidence interval due to the fragility, for the given hazard curve.
    share_below_curve, share_above_curve : float
        Shares of the rate from the extrapolated parts of the hazard curve, below its first and above its last point.
    bounds : (float, float)
        Smallest and largest rate that the hazard curve can resolve, printed for rates beyond.

    See Also
    --------
    rocking.Fragility.annual_rate : Compute the rates from a hazard curve.

    Examples
    --------
    >>> round(Rate("overturning", 1e-3, (5e-4, 2e-3), 0.0, 0.0).probability(50.0), 4)
    0.0488
    """

    limit_state: str
    annual_rate: float
    interval: tuple[float, float]
    share_below_curve: float
    share_above_curve: float
    bounds: tuple[float, float] = (0.0, math.inf)

    def __repr__(self) -> str:
        rate, interval_text = format_digits(self.annual_rate, self.interval, self.bounds)
        return f"<Rate: {self.limit_state}: {rate} a year ({interval_text}), {self.describe_period()}>"

    def describe_period(self) -> str:
        """Return the period and its interval as "once in ... years", with the significant digits."""
        period, interval_text = self._format_period()
        return f"once in {period} year{'' if period == '1' else 's'} ({interval_text})"

    def probability(self, years: float) -> float:
        """Compute the probability of at least one exceedance in a time (years), for independent exceedances."""
        return -math.expm1(-self.annual_rate * checks.positive(years, "years", OptionError))

    def survival(self, years: float) -> float:
        """Compute the probability of no exceedance (survival) in a time (years)."""
        return math.exp(-self.annual_rate * checks.positive(years, "years", OptionError))

    @property
    def return_period(self) -> float:
        """Mean time between exceedances, years."""
        return _compute_period(self.annual_rate)

    @property
    def return_interval(self) -> tuple[float, float]:
        """Confidence interval of the return period, years."""
        low, high = self.interval
        return _compute_period(high), _compute_period(low)

    def _format_period(self) -> tuple[str, str]:
        low, high = self.bounds
        return format_digits(self.return_period, self.return_interval, (_compute_period(high), _compute_period(low)))


def _compute_period(rate: float) -> float:
    with np.errstate(over="ignore"):
        return float(np.divide(1.0, rate)) if rate > 0.0 else math.inf


@dataclass(frozen=True, eq=False, repr=False)
class Risk(Result):
    """Annual rates of the limit states of a fragility, computed by `Fragility.annual_rate`.

    The figure shows the hazard curve and, for each limit state, the contributions of the intensities to its rate.

    Attributes
    ----------
    rates : tuple of Rate
        Rate of each limit state.
    curves : tuple of FragilityCurve
        Probabilities of exceedance, in the same order.
    hazard : HazardCurve
        Annual rates of intensities.
    description : str
        Description of the simulations or observations.

    See Also
    --------
    rocking.Fragility.annual_rate : Compute the rates from a hazard curve.
    rocking.HazardCurve : Rates of exceeding an intensity at a site.

    Examples
    --------
    >>> from rocking import HazardCurve, fit_fragility
    >>> fitted = fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trial_counts=4)
    >>> round(fitted.annual_rate(HazardCurve([0.5, 5.0], [1e-2, 1e-4])).rate("overturning").annual_rate, 6)
    0.000434
    """

    rates: tuple[Rate, ...]
    curves: tuple[FragilityCurve, ...]
    hazard: HazardCurve
    description: str

    def rate(self, limit_state: str) -> Rate:
        """Return the rate of a limit state."""
        rates = {rate.limit_state: rate for rate in self.rates}
        return rates[checks.choice(limit_state, "limit_state", OptionError, [*rates])]

    def summary(self, years: float = 50.0) -> str:
        """Return rates, return periods, and probabilities in a time (years) as a text table."""
        years = checks.positive(years, "years", OptionError)
        rows = []
        for rate in self.rates:
            values = rate.annual_rate, *rate.interval, *rate.bounds
            probability, *ends = (-math.expm1(-value * years) for value in values)
            probability_texts = format_digits(probability, (ends[0], ends[1]), (ends[2], ends[3]))
            rate_texts = format_digits(rate.annual_rate, rate.interval, rate.bounds)
            rows.append([rate.limit_state, *rate_texts, *rate._format_period(), *probability_texts])
        heading = f"{100 * self.curves[0].confidence:g} % between"
        quantities = "annual rate", "once in (years)", f"probability in {format_count(years, 'year')}"
        header = ["limit state", *(title for quantity in quantities for title in (quantity, heading))]
        notes = [note for rate in self.rates for note in describe_extrapolated_shares(rate)]
        if any(rate.interval[0] == 0.0 or math.isinf(rate.interval[1]) for rate in self.rates):
            notes.append("intervals are those of the fragility, whose summary says why they have no end")
        return "\n".join([format_table(header, rows), *notes])

    def to_dict(self, years: float = 50.0) -> dict[str, Any]:
        """Return rates, probabilities in a time (years) and the hazard curve by name, in named or SI units."""
        return {
            "description": self.description,
            "hazard": self.hazard.to_dict(),
            "years": years,
            "rates": [
                {
                    "limit_state": rate.limit_state,
                    "annual_rate": rate.annual_rate,
                    "annual_rate_interval": list(rate.interval),
                    "confidence": self.curves[0].confidence,
                    "return_period_years": rate.return_period,
                    "return_period_interval_years": list(rate.return_interval),
                    "probability": rate.probability(years),
                    "share_below_hazard_curve": rate.share_below_curve,
                    "share_above_hazard_curve": rate.share_above_curve,
                }
                for rate in self.rates
            ],
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import RiskLine, draw_risk

        # Limit the figure to intensities that contribute to the rates.
        low, high = self.hazard.intensity[[0, -1]]
        intensity = np.geomspace(1e-2 * low, 1e2 * high, 800)
        labels = [f"{rate.limit_state}: {rate.describe_period()}" for rate in self.rates]
        densities = [compute_share_density(curve.fitted, self.hazard, intensity) for curve in self.curves]
        return draw_risk(
            intensity=self.hazard.measure.display_factor * intensity,
            hazard=create_hazard_line(self.hazard, intensity),
            lines=[*map(RiskLine, labels, densities)],
            intensity_label=self.hazard.measure.label,
            title=title or escape_dollars(self.description),
            ax=ax,
            figsize=figsize,
        )

    def _format_headline(self) -> str:
        rates = ", ".join(f"{rate.limit_state}: {rate.describe_period()}" for rate in self.rates)
        return f"{self.description}; {self.hazard.name}; {rates}"


def compute_risk(curves: Sequence[FragilityCurve], hazard: HazardCurve, measure: Measure, description: str) -> Risk:
    """Integrate fragility curves of a measure over a hazard curve."""
    if not isinstance(hazard, HazardCurve):
        raise OptionError(
            f"a HazardCurve is required, not a {type(hazard).__name__}; create one with HazardCurve(intensity, rate), "
            "or read one with HazardCurve.read(path)",
            value=hazard,
        )
    check_measure(hazard, measure)
    return Risk(tuple(_compute_rate(curve, hazard) for curve in curves), tuple(curves), hazard, description)


def describe_extrapolated_shares(rate: Rate) -> list[str]:
    """Describe the share of a rate from extrapolations of the hazard curve."""
    return [
        f"{rate.limit_state}: {100 * share:.{0 if share > 0.1 else 1}f} % of the rate is from {side} the hazard curve"
        for share, side in ((rate.share_below_curve, "below"), (rate.share_above_curve, "above"))
        if share > 0.01
    ]


def check_measure(hazard: HazardCurve | None, measure: Measure) -> None:
    """Raise an OptionError if the measures of a hazard curve and a fragility differ."""
    if hazard is not None and measure != hazard.measure:
        raise OptionError(
            f"the fragility and the hazard curve must have the same measure; got {measure.label} and "
            f"{hazard.measure.label}; fit the fragility against the measure of the hazard curve"
        )


def _compute_rate(curve: FragilityCurve, hazard: HazardCurve) -> Rate:
    total = compute_log_rate(curve.fitted, hazard)[0]
    low, high = compute_extremes(curve.region, lambda fits: compute_log_rate(fits, hazard))
    with np.errstate(over="ignore", under="ignore"):
        rate, lower, upper = (float(np.exp(value[0])) for value in (total, low, high))
    below, above = compute_shares_beyond(curve.fitted, hazard)
    # Motions above the last point add no more than its rate. If most of the rate is theirs, only this bound is known.
    min_rate = (1.0 - above) * rate + float(hazard.rate[-1]) if above > 0.5 else 0.0
    bounds = min_rate, max(min_rate, float(hazard.rate[0]))
    return Rate(curve.limit_state, rate, (lower, upper), below, above, bounds)


@dataclass(frozen=True, eq=False, repr=False)
class Survival(Result):
    """Limit state that was not exceeded, and its constraints on ground motion, computed by `Fragility.survival`.

    The figure shows the largest rates consistent with the survival, and the hazard curve.

    A curve of several blocks (for example an ensemble that represents one uncertain block) does not separate their
    dispersion from the record-to-record variability: for rates and `probability`, the block parameters are resampled
    for every motion. If a single one of the blocks has stood all the time, the probability is `mean_probability`, and
    `max_probability` is its bound.

    Attributes
    ----------
    curve : FragilityCurve
        Probabilities of exceeding the limit.
    measure, description, has_several_blocks : Measure, str, bool
        As for `Fragility`.
    years, confidence : float
        As for `Fragility.survival`.
    hazard : HazardCurve or None
        Annual rates of intensities at the site.
    rate : Rate or None
        Annual rate of the limit state for this hazard curve.
    mean_probability : float
        Weighted mean of the survival probabilities of several blocks, each with its own curve, under the hazard curve.
        NaN for one block, or without hazard curve or outcomes.
    mean_error : float
        Standard error of `mean_probability` if the blocks are a sample (`Blocks.sample`). It does not contain the
        record-to-record variability, because all blocks met the same motions.

    See Also
    --------
    rocking.Fragility.survival : Compute the constraints.
    rocking.HazardCurve : Rates of exceeding an intensity at a site.

    Examples
    --------
    >>> from rocking import HazardCurve, fit_fragility
    >>> fitted = fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trial_counts=4, measure="pga")
    >>> survival = fitted.survival(1000.0, HazardCurve([0.5, 5.0], [1e-2, 1e-4]))
    >>> f"probability of survival {survival.probability:.3f}"
    'probability of survival 0.648'
    """

    curve: FragilityCurve
    measure: Measure
    description: str
    years: float
    confidence: float
    hazard: HazardCurve | None
    rate: Rate | None
    has_several_blocks: bool = False
    mean_probability: float = math.nan
    mean_error: float = math.nan

    def __post_init__(self) -> None:
        object.__setattr__(self, "years", checks.positive(self.years, "years", OptionError))
        checks.fraction(self.confidence, "confidence", OptionError)

    @property
    def intensity(self) -> Floats:
        """Intensities (SI) that exceed the limit with probabilities of 0.05, 0.16, 0.5, 0.84 and 0.95."""
        return np.array([self.curve.intensity_of(probability) for probability in _DRAWN_PROBABILITIES])

    @property
    def never_reached_intensity(self) -> float:
        """Intensity (SI) of one motion that would have exceeded the limit with the requested confidence."""
        return self.curve.intensity_of(self.confidence)

    @property
    def largest_rate(self) -> Floats:
        """Largest annual rates of motions of each `intensity` or more that are consistent with the survival.

        For several blocks, their parameters are resampled for every motion.
        """
        return self.curve.largest_rate(self.intensity, self.years, self.confidence)

    @property
    def probability(self) -> float:
        """Probability under the hazard curve that the limit is not exceeded in the time, or NaN without a curve.

        For several blocks this is the lower bound, with parameters resampled for every motion.
        """
        return math.nan if self.rate is None else self.rate.survival(self.years)

    @property
    def interval(self) -> tuple[float, float]:
        """Confidence interval of `probability`, from the interval of the fragility."""
        if self.rate is None:
            return math.nan, math.nan
        low, high = self.rate.interval
        return math.exp(-high * self.years), math.exp(-low * self.years)

    @property
    def max_probability(self) -> float:
        """Largest `probability` consistent with its interval, the hazard curve and the blocks.

        This is the upper end of the interval, without the extrapolations of the hazard curve below its first and above
        its last point. For several blocks, a single block has stood all the time, and the intensity alone determines
        whether it overturns, which yields the integral of exp(-rate(x) years) dP(x).
        """
        if self.hazard is None:
            return math.nan
        hazard, years = self.hazard, self.years
        if self.has_several_blocks:
            _, high = compute_extremes(self.curve.region, lambda fits: compute_log_survival(fits, hazard, years))
            return math.exp(min(float(high[0]), 0.0))
        low, _ = compute_extremes(self.curve.region, lambda fits: compute_log_rate_within(fits, hazard))
        return math.exp(-math.exp(float(low[0])) * years)

    @property
    def contradicts_hazard(self) -> bool:
        """Whether the survival, at its `max_probability`, is less probable than 1 - confidence."""
        return self.max_probability < 1.0 - self.confidence

    def summary(self) -> str:
        measure, percent = self.measure, f"{100.0 * self.confidence:g} %"
        header = [measure.label, "probability", "at most a year", "at most once in (years)"]
        factor, data_range = measure.display_factor, self._known_range
        columns: list[list[Any]] = [
            [format_within(x, data_range, lambda end: f"{factor * end:.5g}") for x in self.intensity],
            [*_DRAWN_PROBABILITIES],
            [f"{rate:.2g}" for rate in self.largest_rate],
            [f"{float(f'{1.0 / rate:.2g}'):.7g}" for rate in self.largest_rate],
        ]
        if self.hazard is not None:
            header += ["hazard curve, a year", "survival at most"]
            highest, lowest = self.hazard.rate[[0, -1]]
            rates = self.hazard.rate_of(self.intensity)
            resolved = np.where(rates < lowest, 0.0, np.minimum(rates, highest))
            columns += [
                [format_within(rate, (lowest, highest), "{:.2g}".format) for rate in rates],
                [f"{probability:.2g}" for probability in np.exp(-self.years * resolved * _DRAWN_PROBABILITIES)],
            ]
        lines = [
            f"{self.curve.limit_state}: not in {format_count(self.years, 'year')}; intensity: {measure.label}",
            f"most likely never {self._rare_motion_text}: one such motion would have exceeded the limit with {percent}",
            f"largest rates of motions of an intensity or more; with larger ones the limit would have been "
            f"exceeded with {percent}" + (", if each met another of the blocks" if self.has_several_blocks else ""),
            "",
            format_table(header, [*zip(*columns, strict=True)]),
        ]
        if self.rate is not None:
            lines += ["", self._describe_survival(self.rate), *describe_extrapolated_shares(self.rate)]
        return "\n".join(lines)

    @property
    def _known_range(self) -> tuple[float, float]:
        """Lowest and highest intensity (SI) of the data and of the hazard curve."""
        intensities = np.concatenate([self.curve.intensity, [] if self.hazard is None else self.hazard.intensity])
        return float(intensities.min()), float(intensities.max())

    @property
    def _rare_motion_text(self) -> str:
        intensity, highest = self.never_reached_intensity, self._known_range[1]
        text = format_intensity(min(intensity, highest), self.measure)
        return f"some intensity above {text}, beyond the data" if intensity > highest else f"{text} or more"

    def _describe_survival(self, rate: Rate) -> str:
        """Describe the probability of the survival under the hazard curve."""
        low, high = rate.bounds
        bounds = math.exp(-high * self.years), math.exp(-low * self.years)
        probability_text, interval_text = format_digits(self.probability, self.interval, bounds)
        confidence, likeliest = 100.0 * self.curve.confidence, self.probability
        estimate = f"{probability_text} ({confidence:g} % interval {interval_text})"
        if self.has_several_blocks:
            single_text = f"at most {self.max_probability:.2g} if one of the blocks has stood all the time"
            estimate = f"{single_text}, and {estimate} if each motion met another of them"
        if not math.isnan(self.mean_probability):
            likeliest = self.mean_probability
            estimate = (
                f"{likeliest:.2g} in the mean (standard error of the sample {self.mean_error:.1g}) and {estimate}"
            )
        name = "" if self.hazard is None else self.hazard.name
        years = format_count(self.years, "year")
        sentence = f"under the hazard curve {name!r} the probability of {years} without it is {estimate}"
        threshold = f"{1.0 - self.confidence:.3g}"
        if likeliest >= 1.0 - self.confidence:
            return f"{sentence}, so they do not contradict each other"
        if not self.contradicts_hazard:
            return f"{sentence}; below {threshold} they would contradict each other, which is not settled"
        reasons = "the hazard curve is too high, or the block stronger than its fragility, or younger"
        return f"{sentence}; all of that is below {threshold}, so they contradict each other: {reasons}"

    def to_dict(self) -> dict[str, Any]:
        column = self.measure.column
        result = {
            "limit_state": self.curve.limit_state,
            "years": self.years,
            "confidence": self.confidence,
            f"most_likely_never_{column}": self.never_reached_intensity,
            "probability_of_exceedance": [*_DRAWN_PROBABILITIES],
            column: self.intensity,
            "largest_annual_rate": self.largest_rate,
        }
        if self.hazard is None:
            return result
        return result | {
            "hazard_annual_rate": self.hazard.rate_of(self.intensity),
            "probability": self.probability,
            "probability_interval": [*self.interval],
            "most_probable": self.max_probability,
            "mean_probability": self.mean_probability,
            "mean_probability_standard_error": self.mean_error,
            "share_below_hazard_curve": math.nan if self.rate is None else self.rate.share_below_curve,
            "share_above_hazard_curve": math.nan if self.rate is None else self.rate.share_above_curve,
            "contradicts": self.contradicts_hazard,
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import draw_survival

        ends = [end for end in map(self.curve.intensity_of, _FIGURE_RANGE) if 0.0 < end < math.inf]
        if len(ends) < len(_FIGURE_RANGE):  # the ends of a very wide curve are not finite numbers
            ends = [self.curve.intensity.min(), self.curve.intensity.max()]
        if self.hazard is not None:
            ends += self.hazard.intensity[[0, -1]].tolist()
        intensity = np.geomspace(min(ends), max(ends), 200)
        intensity = intensity[self.curve.probability(intensity) > _FIGURE_RANGE[0] * 0.1]
        return draw_survival(
            intensity=self.measure.display_factor * intensity,
            largest=self.curve.largest_rate(intensity, self.years, self.confidence),
            largest_label=f"at most, with {format_count(self.years, 'year')} without {self.curve.limit_state} "
            f"({100.0 * self.confidence:g} %)",
            hazard=None if self.hazard is None else create_hazard_line(self.hazard, intensity),
            intensity_label=self.measure.label,
            title=title or escape_dollars(self.description),
            ax=ax,
            figsize=figsize,
        )

    def _format_headline(self) -> str:
        state, years = self.curve.limit_state, format_count(self.years, "year")
        return f"{state}: not in {years}; most likely never {self._rare_motion_text}"


def compute_mean_survival(
    outcomes: pd.DataFrame, column: str, limit_state: str, hazard: HazardCurve, years: float
) -> tuple[float, float]:
    """Compute the mean survival probability of blocks, each with its own curve, and the standard error of the mean."""
    table = outcomes.sort_values("block", kind="stable")
    blocks = table.drop_duplicates("block")
    values = table[[column, f"exceeded_{limit_state}", "unfinished"]].to_numpy(np.float64)
    intensity, exceedance_counts, missing_counts = values.T.reshape(3, len(blocks), -1)
    fits = fit_or_limits(ExceedanceCounts(np.log(intensity[0]), exceedance_counts, 1.0 - missing_counts))
    # For a curve that does not rise, the rate below the hazard curve is unbounded and therefore omitted.
    log_rates, level_log_rates = compute_log_rate(fits, hazard), compute_log_rate_within(fits, hazard)
    rates = np.exp(np.where(fits.slope > 0.0, log_rates[:, 0], level_log_rates[:, 0]))
    probabilities, weights = np.exp(-years * rates), np.asarray(blocks.get("weight", np.ones(len(blocks))), np.float64)
    shares = weights / weights.sum()
    mean_probability = float(shares @ probabilities)
    effective_count = 1.0 / float(shares @ shares)  # of equally weighted blocks with this error
    variance = float(shares @ (probabilities - mean_probability) ** 2)
    return mean_probability, math.sqrt(variance / (effective_count - 1.0)) if effective_count > 1.0 else math.nan
