"""Risk, from fragility and hazard: how often a year a limit state is exceeded, and how likely in some years."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking import checks
from rocking.analysis.fragility.curve import FragilityCurve
from rocking.analysis.fragility.lognormal import Probit
from rocking.analysis.hazard import HazardCurve
from rocking.arrays import Floats
from rocking.errors import InvalidOption
from rocking.motion.scaling import Measure
from rocking.result import DrawnResult
from rocking.tables import counted, known_digits, text_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Relative change by which a rate's slope is taken.
_STEP: Final = 1e-5

#: A figure shows what is between quantiles of a rate, and so many times as far beyond them.
_BEYOND: Final = 2.0

#: Shares of the risk up to an intensity: what a standard deviation leaves on either side, and half.
_QUANTILES: Final = (0.16, 0.5, 0.84)

_ROOT: Final = math.sqrt(0.5)

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
    """

    limit_state: str
    annual_rate: float
    interval: tuple[float, float]
    below: float
    above: float
    intensities: tuple[float, float, float]

    def __repr__(self) -> str:
        rate, between = known_digits(self.annual_rate, self.interval)
        return f"<Rate: {self.limit_state}: {rate} a year ({between}), {self.in_words()}>"

    def in_words(self) -> str:
        """Return period with its interval, to the digits that this leaves.

        Examples
        --------
        >>> Rate("overturning", 1 / 464.8, (1 / 826, 1 / 206.1), 0.0, 0.0, (1.0, 2.0, 3.0)).in_words()
        'once in 460 years (210 to 830)'
        """
        period, between = known_digits(self.return_period, self.return_interval)
        return f"once in {period} year{'' if period == '1' else 's'} ({between})"

    def probability(self, years: float) -> float:
        """Probability of at least one exceedance in some years, for exceedances that do not depend on one another.

        Parameters
        ----------
        years : float
            Time, above 0.

        Raises
        ------
        InvalidOption
            If it is no positive number.
        """
        return -math.expm1(-self.annual_rate * checks.positive(years, "years", InvalidOption))

    def survival(self, years: float) -> float:
        """Probability of no exceedance in some years: of standing, for overturning; as `probability`."""
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


def _period(rate: float) -> float:
    with np.errstate(over="ignore"):
        return float(np.divide(1.0, rate)) if rate > 0.0 else math.inf


@dataclass(frozen=True, eq=False, repr=False)
class Risk(DrawnResult):
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

    @classmethod
    def of(cls, curves: Sequence[FragilityCurve], hazard: HazardCurve, measure: Measure, description: str) -> Risk:
        """Integrate curves against a measure over a hazard curve; see `Fragility.annual_rate`."""
        if not isinstance(hazard, HazardCurve):
            raise InvalidOption(
                f"a HazardCurve is needed, not a {type(hazard).__name__}: make one with HazardCurve(intensity, rate), "
                "or read one with HazardCurve.read(path)",
                value=hazard,
            )
        if measure != hazard.measure:
            raise InvalidOption(
                f"the fragility is against {measure.label}, the hazard curve of {hazard.measure.label}; "
                "fit the one against the other's measure"
            )
        return cls(tuple(_rate(curve, hazard) for curve in curves), tuple(curves), hazard, description)

    def rate(self, limit_state: str) -> Rate:
        """Return the rate of a limit state.

        Parameters
        ----------
        limit_state : str
            Its name.

        Returns
        -------
        Rate

        Raises
        ------
        InvalidOption
            If there is none of that name.
        """
        rates = {one.limit_state: one for one in self.rates}
        return rates[checks.one_of(limit_state, "limit_state", InvalidOption, [*rates])]

    def summary(self, years: float = 50.0) -> str:
        """Return rates, return periods and probabilities in some years, in a table."""
        years = checks.positive(years, "years", InvalidOption)
        scale, confidence = self.hazard.measure.scale, 100 * self.curves[0].confidence
        rows = []
        for one in self.rates:
            chances = [-math.expm1(-rate * years) for rate in (one.annual_rate, *one.interval)]
            rows.append(
                [
                    one.limit_state,
                    *known_digits(one.annual_rate, one.interval),
                    *known_digits(one.return_period, one.return_interval),
                    *known_digits(chances[0], (chances[1], chances[2])),
                    "{:.3g}, {:.3g}, {:.3g}".format(*(scale * x for x in one.intensities)),
                ]
            )
        between = f"{confidence:g} % between"
        header = [
            "limit state", "annual rate", between, "once in (years)", between,
            f"probability in {counted(years, 'year')}", between,
            f"{self.hazard.measure.label} below which 16, 50, 84 % of the rate arises",
        ]  # fmt: skip
        notes = [
            f"{one.limit_state}: {100 * share:.{0 if share > 0.1 else 1}f} % of the rate is from {what} the hazard "
            "curve"
            for one in self.rates
            for share, what in ((one.below, "below"), (one.above, "above"))
            if share > 0.01
        ]
        if any(one.interval[0] == 0.0 or math.isinf(one.interval[1]) for one in self.rates):
            notes.append("intervals are those of the fragility, whose summary says why they have no end")
        return "\n".join([text_table(header, rows), *notes])

    def to_dict(self, years: float = 50.0) -> dict[str, Any]:
        """Return rates, and probabilities in some years, by name, and the hazard curve."""
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
        from rocking.plot import RiskLine, risk_figure

        scale, at = self.hazard.measure.scale, self._shown()
        return risk_figure(
            intensity=scale * at,
            hazard=self.hazard.line(at),
            lines=[
                RiskLine(f"{one.limit_state}: {one.in_words()}", _share_density(curve.fitted, self.hazard, at))
                for one, curve in zip(self.rates, self.curves, strict=True)
            ],
            intensity_label=self.hazard.measure.label,
            title=title or self.description,
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


def _rate(curve: FragilityCurve, hazard: HazardCurve) -> Rate:
    parts = _log_parts(curve.fitted, hazard)[0]
    total = np.logaddexp.reduce(parts)

    def logarithm(fits: Probit) -> Floats:
        return np.asarray(np.logaddexp.reduce(_log_parts(fits, hazard), axis=1)[:, None])

    low, high = curve.uncertainty.interval(
        logarithm, logarithm(curve.fitted)[0], _gradient(logarithm, curve.fitted), curve.confidence
    )
    with np.errstate(over="ignore", under="ignore"):
        rate, lower, upper = (float(np.exp(value)) for value in (total, low[0], high[0]))
    return Rate(
        curve.limit_state,
        rate,
        (lower, upper),
        *_shares_beyond(curve.fitted, hazard),
        _intensities(curve.fitted, hazard),
    )


def _gradient(quantity: Any, fitted: Probit) -> Floats:
    """Change of a quantity with intercept and slope, shape (2, n)."""
    rows = []
    for name in Probit._fields:
        value = getattr(fitted, name)
        step = _STEP * np.maximum(np.abs(value), 1.0)
        up, down = (quantity(fitted._replace(**{name: value + sign * step}))[0] for sign in (1.0, -1.0))
        rows.append((up - down) / (2.0 * step))
    return np.array(rows)


def _log_parts(fits: Probit, hazard: HazardCurve, until: float = math.inf) -> Floats:
    """Logarithms of integrals below the hazard curve, over each of its segments, and above, up to `until` (ln x).

    Their shape is (fits, n + 1). The rate is the integral of rate(x) dP(x). On a segment rate(x) = c x^-k, and with
    P = Phi(z), z = a + b ln x, its part is c exp(k a/b + k^2/(2 b^2)) [Phi(z + k/b)] between the segment's ends.
    Where both lie on one side of z = -k/b the large terms cancel: with the scaled erfcx the part is
    rate(x) exp(-z^2/2) erfcx(|z + k/b|/sqrt(2))/2 at the nearer end, less that at the other.
    """
    from scipy.special import erfcx, ndtr

    k, log_c = (_extended(values) for values in hazard.powers())
    ends = [np.minimum(each, until) for each in _ends(hazard)]
    a, b = (values[:, None] for values in fits)
    with np.errstate(all="ignore"):
        shift = k / b
        lower, upper = (a + b * end + shift for end in ends)
        mirrored = lower > 0.0
        near, far = np.where(mirrored, lower, -upper), np.where(mirrored, upper, -lower)
        end = np.where(mirrored, *ends)
        z = a + b * end
        fall = np.exp(-0.5 * b * (ends[1] - ends[0]) * (near + far)) * erfcx(far * _ROOT) / erfcx(near * _ROOT)
        tail = log_c - k * end - 0.5 * z * z + np.log(0.5 * erfcx(near * _ROOT)) + np.log1p(-fall)
        middle = log_c + shift * a + 0.5 * shift * shift + np.log(ndtr(upper) - ndtr(lower))
    # A curve that does not rise is exceeded by the weakest motions as often as they come.
    return np.where(b > 0.0, np.where(near > 0.0, tail, middle), np.inf)


def _extended(values: Floats) -> Floats:
    """One value for each segment of a hazard curve, with those of the first and the last also beyond them."""
    return np.concatenate([values[:1], values, values[-1:]])


def _ends(hazard: HazardCurve) -> tuple[Floats, Floats]:
    """Logarithms of the lower and upper ends of the segments, and of what is below and above."""
    corners = np.concatenate([[-np.inf], np.log(hazard.intensity), [np.inf]])
    return corners[:-1], corners[1:]


def _log_total(fitted: Probit, hazard: HazardCurve) -> float:
    return float(np.logaddexp.reduce(_log_parts(fitted, hazard)[0]))


def _log_seen(fitted: Probit, hazard: HazardCurve, log_at: Floats) -> tuple[Floats, Floats]:
    """Logarithms of P(x) rate(x), and of its part k P(x) rate(x) = P(x) |d rate(x)/d ln x|, at logarithms of x."""
    from scipy.special import log_ndtr

    segment = np.searchsorted(np.log(hazard.intensity), log_at, side="right")
    k, log_c = (_extended(values)[segment] for values in hazard.powers())
    score = fitted.intercept[0] + fitted.slope[0] * log_at
    product = np.asarray(log_c - k * log_at + log_ndtr(score))
    return product, np.log(k) + product


def _shares_beyond(fitted: Probit, hazard: HazardCurve) -> tuple[float, float]:
    """Shares of a rate from motions below the hazard curve's first point, and above its last.

    By parts the integral of P(x) |d rate(x)| is that of rate(x) dP(x), less P(x) rate(x) at its upper end, and with
    that at its lower end.
    """
    parts, total = _log_parts(fitted, hazard)[0], _log_total(fitted, hazard)
    first, last = _log_seen(fitted, hazard, np.log(hazard.intensity[[0, -1]]))[0]
    with np.errstate(all="ignore"):
        below = np.exp(parts[0] - total) * max(-math.expm1(min(first - parts[0], 0.0)), 0.0)
        above = np.exp(np.logaddexp(parts[-1], last) - total)
    return float(below), float(above)


def _intensities(fitted: Probit, hazard: HazardCurve) -> tuple[float, float, float]:
    """Intensities below which the quantiles of a rate arise: shares of the motions P(x) |d rate(x)|.

    The share below x is that of the integral of rate(x) dP(x), less P(x) rate(x), which is never above the whole rate:
    neither loses more than the last digits of the share.
    """
    from scipy.optimize import brentq

    total, (k, log_c) = _log_total(fitted, hazard), hazard.powers()
    if not math.isfinite(total):
        return 0.0, 0.0, 0.0

    def excess(log_at: float, share: float) -> float:
        cumulative = np.logaddexp.reduce(_log_parts(fitted, hazard, log_at)[0])
        product = _log_seen(fitted, hazard, np.array([log_at]))[0][0]
        return float(np.exp(cumulative - total) - np.exp(product - total)) - share

    def found(share: float) -> float:
        # What comes from above x is at most rate(x): where that is what remains of the whole rate, x is high enough.
        left = total + math.log1p(-share)
        segment = np.searchsorted(-np.log(hazard.rate[1:-1]), -left)
        high, step = float((log_c[segment] - left) / k[segment]), 1.0
        low, step = high, 1.0
        while excess(high, share) < 0.0:  # by rounding
            high, step = high + step, 2.0 * step
        while excess(low, share) > 0.0:
            low, step = low - step, 2.0 * step
        return float(np.exp(brentq(excess, low, high, args=(share,), xtol=1e-13)))

    with np.errstate(all="ignore"):
        sixteenth, half, rest = (found(share) for share in _QUANTILES)
    return sixteenth, half, rest


def _share_density(fitted: Probit, hazard: HazardCurve, at: Floats) -> Floats:
    """Share of the rate from motions of about an intensity, for each factor of e: its integral over ln x is 1."""
    with np.errstate(under="ignore"):
        return np.asarray(np.exp(_log_seen(fitted, hazard, np.log(at))[1] - _log_total(fitted, hazard)))
