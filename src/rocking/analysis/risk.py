"""Risk, from fragility and hazard: how often a year a limit state is exceeded, and how likely in some years."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking import checks
from rocking.analysis.fragility.curve import FragilityCurve, interval_of
from rocking.analysis.fragility.lognormal import Probit
from rocking.analysis.hazard import (
    HazardCurve,
    hazard_line,
    log_parts,
    quantile_intensities,
    share_density,
    shares_beyond,
    shown_range,
)
from rocking.arrays import Floats
from rocking.errors import InvalidOption
from rocking.motion.scaling import Measure
from rocking.result import Result
from rocking.tables import as_written, counted, known_digits, text_table, within

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Relative change by which a rate's slope is taken.
_STEP: Final = 1e-5

#: A figure shows what is between quantiles of a rate, and so many times as far beyond them.
_BEYOND: Final = 2.0

#: Points of a line in a figure.
_POINTS: Final = 400


@dataclass(frozen=True)
class Rate:
    """Mean annual rate of exceeding a limit state.

    Attributes
    ----------
    limit_state : str
        Name of what is exceeded.
    annual_rate : float
        Exceedances a year.
    interval : (float, float)
        Confidence interval from the fragility's; the hazard is taken as it is.
    below, above : float
        Shares of the rate from motions below the hazard curve's first point and above its last, where its lines are
        only extended.
    intensities : (float, float, float)
        Intensities (SI) of the motions below which 16, 50 and 84 % of the rate arise.
    bounds : (float, float)
        Rates between which the hazard curve can tell the rate; texts state the bound in place of a rate beyond them.
    """

    limit_state: str
    annual_rate: float
    interval: tuple[float, float]
    below: float
    above: float
    intensities: tuple[float, float, float]
    bounds: tuple[float, float] = (0.0, math.inf)

    def __repr__(self) -> str:
        rate, between = known_digits(self.annual_rate, self.interval, self.bounds)
        return f"<Rate: {self.limit_state}: {rate} a year ({between}), {self.in_words()}>"

    def in_words(self) -> str:
        """Say the return period with its interval, to the digits that this leaves.

        Returns
        -------
        str
            "once in ... years", with the interval.

        Examples
        --------
        >>> Rate("overturning", 1 / 464.8, (1 / 826, 1 / 206.1), 0.0, 0.0, (1.0, 2.0, 3.0)).in_words()
        'once in 460 years (210 to 830)'
        """
        period, between = _period_digits(self)
        return f"once in {period} year{'' if period == '1' else 's'} ({between})"

    def probability(self, years: float) -> float:
        """Probability of at least one exceedance in some years, for exceedances that do not depend on one another.

        Parameters
        ----------
        years : float
            Time, above 0.

        Returns
        -------
        float
            1 - exp(-annual_rate years).

        Raises
        ------
        InvalidOption
            If the time is no positive number.

        Examples
        --------
        >>> round(Rate("overturning", 1e-3, (5e-4, 2e-3), 0.0, 0.0, (1.0, 2.0, 3.0)).probability(50.0), 4)
        0.0488
        """
        return -math.expm1(-self.annual_rate * checks.positive(years, "years", InvalidOption))

    def survival(self, years: float) -> float:
        """Probability of no exceedance in some years: of standing, for overturning.

        Parameters
        ----------
        years : float
            Time, above 0.

        Returns
        -------
        float
            exp(-annual_rate years).

        Raises
        ------
        InvalidOption
            If the time is no positive number.

        Examples
        --------
        >>> round(Rate("overturning", 1e-3, (5e-4, 2e-3), 0.0, 0.0, (1.0, 2.0, 3.0)).survival(50.0), 4)
        0.9512
        """
        return math.exp(-self.annual_rate * checks.positive(years, "years", InvalidOption))

    @property
    def return_period(self) -> float:
        """Mean time between exceedances, years."""
        return _period(self.annual_rate)

    @property
    def return_interval(self) -> tuple[float, float]:
        """Confidence interval of the return period, years."""
        low, high = self.interval
        return _period(high), _period(low)


def _period_digits(rate: Rate) -> tuple[str, str]:
    """Return period and its interval, as text."""
    low, high = rate.bounds
    return known_digits(rate.return_period, rate.return_interval, (_period(high), _period(low)))


def _period(rate: float) -> float:
    with np.errstate(over="ignore"):
        return float(np.divide(1.0, rate)) if rate > 0.0 else math.inf


@dataclass(frozen=True, eq=False, repr=False)
class Risk(Result):
    """Annual rates of all limit states of a fragility under a hazard curve; from `Fragility.annual_rate`.

    Its figure has the hazard curve, and below it for each limit state which intensities its rate comes from.

    Attributes
    ----------
    rates : tuple of Rate
        One for each limit state.
    curves : tuple of FragilityCurve
        Probabilities of exceedance, in the same order.
    hazard : HazardCurve
        Annual rates of intensities.
    description : str
        What was simulated or observed.
    """

    rates: tuple[Rate, ...]
    curves: tuple[FragilityCurve, ...]
    hazard: HazardCurve
    description: str

    def rate(self, limit_state: str) -> Rate:
        """Return the rate of a limit state.

        Parameters
        ----------
        limit_state : str
            Its name.

        Returns
        -------
        Rate
            Its rate.

        Raises
        ------
        InvalidOption
            If there is none of that name.

        Examples
        --------
        >>> from rocking import HazardCurve, fit_fragility
        >>> fitted = fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trials=4)
        >>> round(fitted.annual_rate(HazardCurve([0.5, 5.0], [1e-2, 1e-4])).rate("overturning").annual_rate, 6)
        0.000434
        """
        rates = {one.limit_state: one for one in self.rates}
        return rates[checks.one_of(limit_state, "limit_state", InvalidOption, [*rates])]

    def summary(self, years: float = 50.0) -> str:
        """Say in words what was found: rates, return periods and probabilities, in a table.

        Parameters
        ----------
        years : float
            Time that the probabilities are for.

        Returns
        -------
        str
            Lines of text and tables.

        Examples
        --------
        >>> from rocking import HazardCurve, fit_fragility
        >>> fitted = fit_fragility([1.0, 2.0, 3.0], [0, 2, 4], trials=5)
        >>> risk = fitted.annual_rate(HazardCurve([0.5, 5.0], [1e-2, 1e-4]))
        >>> "probability in 10 years" in risk.summary(10)
        True
        """
        years = checks.positive(years, "years", InvalidOption)
        scale, confidence = self.hazard.measure.scale, 100 * self.curves[0].confidence
        rows = []
        for one in self.rates:
            chances = [-math.expm1(-rate * years) for rate in (one.annual_rate, *one.interval, *one.bounds)]
            rows.append(
                [
                    one.limit_state,
                    *known_digits(one.annual_rate, one.interval, one.bounds),
                    *_period_digits(one),
                    *known_digits(chances[0], (chances[1], chances[2]), (chances[3], chances[4])),
                    ", ".join(within(scale * x, shown_range(self.hazard), "{:.3g}".format) for x in one.intensities),
                ]
            )
        between = f"{confidence:g} % between"
        header = [
            "limit state", "annual rate", between, "once in (years)", between,
            f"probability in {counted(years, 'year')}", between,
            f"{self.hazard.measure.label} below which 16, 50, 84 % of the rate arises",
        ]  # fmt: skip
        notes = [note for one in self.rates for note in beyond_notes(one)]
        notes += [
            f"{one.limit_state}: the upper end, {one.interval[1]:.2g} a year, is above the highest rate of the hazard "
            "curve: it comes from weaker motions, to which the first line of the curve is extended; more motions "
            "narrow the interval"
            for one in self.rates
            if self.hazard.rate[0] < one.interval[1] < math.inf
        ]
        if any(one.interval[0] == 0.0 or math.isinf(one.interval[1]) for one in self.rates):
            notes.append("intervals are those of the fragility, whose summary says why they have no end")
        return "\n".join([text_table(header, rows), *notes])

    def to_dict(self, years: float = 50.0) -> dict[str, Any]:
        """Return what was found as plain values by name.

        Parameters
        ----------
        years : float
            Time that the probabilities are for.

        Returns
        -------
        dict of str to object
            Rates, probabilities, and the hazard curve; units are in the names, or SI.

        Examples
        --------
        >>> from rocking import HazardCurve, fit_fragility
        >>> fitted = fit_fragility([1.0, 2.0, 3.0], [0, 2, 4], trials=5)
        >>> risk = fitted.annual_rate(HazardCurve([0.5, 5.0], [1e-2, 1e-4]))
        >>> risk.to_dict(10.0)["years"]
        10.0
        """
        return {
            "description": self.description,
            "hazard": self.hazard.to_dict(),
            "years": years,
            "rates": [
                {
                    "limit_state": one.limit_state,
                    "annual_rate": one.annual_rate,
                    "annual_rate_interval": list(one.interval),
                    "confidence": self.curves[0].confidence,
                    "return_period_years": one.return_period,
                    "return_period_interval_years": list(one.return_interval),
                    "probability": one.probability(years),
                    "share_below_hazard_curve": one.below,
                    "share_above_hazard_curve": one.above,
                    f"intensities_of_16_50_84_percent_{self.hazard.measure.column}": list(one.intensities),
                }
                for one in self.rates
            ],
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import RiskLine, risk_figure

        scale, at = self.hazard.measure.scale, self._shown()
        return risk_figure(
            intensity=scale * at,
            hazard=hazard_line(self.hazard, at),
            lines=[
                RiskLine(f"{one.limit_state}: {one.in_words()}", share_density(curve.fitted, self.hazard, at))
                for one, curve in zip(self.rates, self.curves, strict=True)
            ],
            intensity_label=self.hazard.measure.label,
            title=title or as_written(self.description),
            ax=ax,
            figsize=figsize,
        )

    def _shown(self) -> Floats:
        """Intensities of a figure: of the hazard curve, and where the rates come from."""
        ends = [*self.hazard.intensity[[0, -1]]]
        for one in self.rates:
            low, _, high = one.intensities
            if low > 0.0 and high < math.inf:
                reach = (high / low) ** _BEYOND
                ends += [end for end in (low / reach, high * reach) if 0.0 < end < math.inf]
        return np.geomspace(min(ends), max(ends), _POINTS)

    def _headline(self) -> str:
        rates = ", ".join(f"{one.limit_state}: {one.in_words()}" for one in self.rates)
        return f"{self.description}; {self.hazard.name}; {rates}"


def risk_of(curves: Sequence[FragilityCurve], hazard: HazardCurve, measure: Measure, description: str) -> Risk:
    """Integrate curves against a measure over a hazard curve."""
    if not isinstance(hazard, HazardCurve):
        raise InvalidOption(
            f"a HazardCurve is needed, not a {type(hazard).__name__}: make one with HazardCurve(intensity, rate), "
            "or read one with HazardCurve.read(path)",
            value=hazard,
        )
    check_measure(hazard, measure)
    return Risk(tuple(_rate(curve, hazard) for curve in curves), tuple(curves), hazard, description)


def beyond_notes(rate: Rate) -> list[str]:
    """Say how much of a rate is from where the lines of a hazard curve are only extended."""
    return [
        f"{rate.limit_state}: {100 * share:.{0 if share > 0.1 else 1}f} % of the rate is from {what} the hazard curve"
        for share, what in ((rate.below, "below"), (rate.above, "above"))
        if share > 0.01
    ]


def check_measure(hazard: HazardCurve, measure: Measure) -> None:
    """Raise an InvalidOption unless a hazard curve is of the measure that a fragility is against."""
    if measure != hazard.measure:
        raise InvalidOption(
            f"the fragility is against {measure.label}, the hazard curve of {hazard.measure.label}; "
            "fit the one against the other's measure"
        )


def _rate(curve: FragilityCurve, hazard: HazardCurve) -> Rate:
    parts = log_parts(curve.fitted, hazard)[0]
    total = np.logaddexp.reduce(parts)

    def logarithm(fits: Probit) -> Floats:
        return np.asarray(np.logaddexp.reduce(log_parts(fits, hazard), axis=1)[:, None])

    low, high = interval_of(curve, logarithm, logarithm(curve.fitted)[0], gradient_of(logarithm, curve.fitted))
    with np.errstate(over="ignore", under="ignore"):
        rate, lower, upper = (float(np.exp(value)) for value in (total, low[0], high[0]))
    below, above = shares_beyond(curve.fitted, hazard)
    # Motions above the last point add no more than its rate; of a rate that is mostly theirs only the bound is known.
    least = (1.0 - above) * rate + float(hazard.rate[-1]) if above > 0.5 else 0.0
    intensities = quantile_intensities(curve.fitted, hazard)
    return Rate(
        curve.limit_state, rate, (lower, upper), below, above, intensities, (least, max(least, float(hazard.rate[0])))
    )


def gradient_of(quantity: Any, fitted: Probit) -> Floats:
    """Change of a quantity with intercept and slope, shape (2, n)."""
    rows = []
    for name in Probit._fields:
        value = getattr(fitted, name)
        step = _STEP * np.maximum(np.abs(value), 1.0)
        up, down = (quantity(fitted._replace(**{name: value + sign * step}))[0] for sign in (1.0, -1.0))
        rows.append((up - down) / (2.0 * step))
    return np.array(rows)
