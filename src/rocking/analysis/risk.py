"""Risk, from fragility and hazard: how often a year a limit state is exceeded, and how likely in some years."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking import checks
from rocking.analysis.fragility.lognormal import Probit
from rocking.analysis.hazard import HazardCurve
from rocking.arrays import Floats
from rocking.errors import InvalidOption
from rocking.tables import text_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rocking.analysis.fragility.curve import Fragility, FragilityCurve

#: Relative change by which a rate's slope is taken.
_STEP: Final = 1e-5

#: Parts of the risk that are told apart by intensity: what a standard deviation leaves on either side, and half.
_QUANTILES: Final = (0.16, 0.5, 0.84)

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
        Shares of the rate from intensities below the hazard curve's first point and above its last, where its lines are
        only extended.
    intensities : (float, float, float)
        Intensities (SI) up to which 16, 50 and 84 % of the rate come from.
    """

    limit_state: str
    annual_rate: float
    interval: tuple[float, float]
    below: float
    above: float
    intensities: tuple[float, float, float]

    def __repr__(self) -> str:
        low, high = self.interval
        return (
            f"<Rate: {self.limit_state}: {self.annual_rate:.3g} a year ({low:.3g} to {high:.3g}), once in "
            f"{self.return_period:.4g} years>"
        )

    def probability(self, years: float) -> float:
        """Probability of at least one exceedance in some years, for exceedances that do not depend on one another."""
        return -math.expm1(-self.annual_rate * checks.positive(years, "years", InvalidOption))

    def survival(self, years: float) -> float:
        """Probability of no exceedance in some years: of standing, for overturning."""
        return math.exp(-self.annual_rate * checks.positive(years, "years", InvalidOption))

    @property
    def return_period(self) -> float:
        """Mean time between exceedances, years."""
        return 1.0 / self.annual_rate if self.annual_rate > 0.0 else math.inf


@dataclass(frozen=True, eq=False, repr=False)
class Risk:
    """Annual rates of all limit states of a fragility under a hazard curve.

    Attributes
    ----------
    rates : tuple of Rate
        One for each limit state.
    fragility : Fragility
        Probabilities of exceedance.
    hazard : HazardCurve
        Annual rates of intensities.
    """

    rates: tuple[Rate, ...]
    fragility: Fragility
    hazard: HazardCurve

    def rate(self, limit_state: str) -> Rate:
        """Return the rate of a limit state.

        Raises
        ------
        InvalidOption
            If there is none of that name.
        """
        self.fragility.curve(limit_state)
        return next(one for one in self.rates if one.limit_state == limit_state)

    def summary(self, years: float = 50.0) -> str:
        """Rates, return periods and probabilities in some years, in a table."""
        scale, confidence = self.hazard.measure.scale, 100 * self.fragility.curves[0].confidence
        rows = [
            [
                one.limit_state,
                one.annual_rate,
                "{:.3g} to {:.3g}".format(*one.interval),
                one.return_period,
                one.probability(years),
                "{:.3g}, {:.3g}, {:.3g}".format(*(scale * x for x in one.intensities)),
            ]
            for one in self.rates
        ]
        header = [
            "limit state", "annual rate", f"{confidence:g} % between", "return period (years)",
            f"probability in {years:g} years", f"16, 50, 84 % from below, {self.hazard.measure.label}",
        ]  # fmt: skip
        notes = [
            f"{one.limit_state}: {100 * share:.2g} % of the rate is from {what} the hazard curve"
            for one in self.rates
            for share, what in ((one.below, "below"), (one.above, "above"))
            if share > 0.01
        ]
        return "\n".join([text_table(header, rows), *notes])

    def to_dict(self, years: float = 50.0) -> dict[str, Any]:
        """Rates by name, and the hazard curve."""
        return {
            "description": self.fragility.description,
            "hazard": self.hazard.to_dict(),
            "years": years,
            "rates": [
                {
                    "limit_state": one.limit_state,
                    "annual_rate": one.annual_rate,
                    "annual_rate_interval": list(one.interval),
                    "confidence": self.fragility.curves[0].confidence,
                    "return_period_years": one.return_period,
                    "probability": one.probability(years),
                    "share_below_hazard_curve": one.below,
                    "share_above_hazard_curve": one.above,
                    f"intensities_of_16_50_84_percent_{self.hazard.measure.column}": list(one.intensities),
                }
                for one in self.rates
            ],
        }

    def plot(self, ax: Axes | None = None, *, figsize: tuple[float, float] | None = None) -> Figure:
        """Draw the hazard curve, and for each limit state which intensities its rate comes from.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw.
        figsize : (float, float), optional
            Width and height of a new figure, inches.
        """
        from rocking.plot import RiskLine, risk_figure

        scale, hazard = self.hazard.measure.scale, self.hazard
        spans = [(curve.intensity_of(1e-3), curve.intensity_of(0.999)) for curve in self.fragility.curves]
        low = min([float(hazard.intensity[0]), *(span[0] for span in spans)])
        high = max([float(hazard.intensity[-1]), *(span[1] for span in spans)])
        at = np.geomspace(low, high, _POINTS)
        lines = [
            RiskLine(
                f"{one.limit_state}: {one.annual_rate:.3g} a year, once in {one.return_period:.4g} years",
                hazard.rate_of(at) * _density(curve.fitted, at),
            )
            for one, curve in zip(self.rates, self.fragility.curves, strict=True)
        ]
        return risk_figure(
            intensity=scale * at,
            rate=hazard.rate_of(at),
            known=(scale * float(hazard.intensity[0]), scale * float(hazard.intensity[-1])),
            lines=lines,
            intensity_label=hazard.measure.label,
            title=self.fragility.description,
            ax=ax,
            figsize=figsize,
        )

    def __repr__(self) -> str:
        rates = ", ".join(f"{one.limit_state}: {one.annual_rate:.3g} a year" for one in self.rates)
        return f"<Risk: {self.fragility.description}; {self.hazard.name}; {rates}>"


def risk(fragility: Fragility, hazard: HazardCurve) -> Risk:
    """Annual rates of a fragility's limit states under a hazard curve; see `Fragility.annual_rate`."""
    if not isinstance(hazard, HazardCurve):
        raise InvalidOption(
            f"a HazardCurve is needed, not a {type(hazard).__name__}: make one with HazardCurve(intensity, rate), or "
            "read one with HazardCurve.read(path)"
        )
    if fragility.measure != hazard.measure:
        raise InvalidOption(
            f"the fragility is against {fragility.measure.label}, the hazard curve of {hazard.measure.label}; "
            "fit the one against the other's measure"
        )
    return Risk(tuple(_rate(curve, hazard) for curve in fragility.curves), fragility, hazard)


def _rate(curve: FragilityCurve, hazard: HazardCurve) -> Rate:
    parts = _parts(curve.fitted, hazard)[0]
    total = float(parts.sum())
    shares = parts / total if total > 0.0 else np.zeros_like(parts)

    def logarithm(fits: Probit) -> Floats:
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(_parts(fits, hazard).sum(axis=1))[:, None])

    low, high = curve.uncertainty.interval(
        logarithm, logarithm(curve.fitted)[0], _gradient(logarithm, curve.fitted), curve.confidence
    )
    return Rate(
        curve.limit_state,
        total,
        (float(np.exp(low[0])), float(np.exp(high[0]))),
        float(shares[0]),
        float(shares[-1]),
        _intensities(curve.fitted, hazard, total),
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


def _parts(fits: Probit, hazard: HazardCurve) -> Floats:
    """Rates from below the hazard curve, from each of its segments, and from above, shape (fits, n + 1).

    The rate is the integral of rate(x) dP(x). On a segment rate(x) = c x^-k, and with P = Phi(a + b ln x) its part is
    c exp(k a/b + k^2/(2 b^2)) [Phi(z + k/b)] between the segment's ends z = a + b ln x.
    """
    exponents, factors = hazard.powers()
    # The first and the last line are extended.
    k, c = (np.concatenate([values[:1], values, values[-1:]]) for values in (exponents, factors))
    ends = np.log(np.concatenate([[0.0], hazard.intensity, [np.inf]]), where=np.r_[False, np.ones(len(k), dtype=bool)],
                  out=np.full(len(k) + 1, -np.inf))  # fmt: skip
    a, b = (values[:, None] for values in fits)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        shift = k / b
        lower, upper = (a + b * end + shift for end in (ends[:-1], ends[1:]))
        parts = np.exp(c + shift * a + 0.5 * shift * shift + _log_between(lower, upper))
    # A curve that does not rise is exceeded by the weakest motions as often as they come.
    return np.where(b > 0.0, parts, np.inf)


def _log_between(lower: Floats, upper: Floats) -> Floats:
    """Logarithm of Phi(upper) - Phi(lower), far out in either tail as well."""
    from scipy.special import log_ndtr

    mirrored = lower > 0.0
    first, last = np.where(mirrored, -upper, lower), np.where(mirrored, -lower, upper)
    most, least = log_ndtr(last), log_ndtr(first)
    return np.asarray(most + np.log1p(-np.exp(np.minimum(least - most, 0.0))))


def _intensities(fitted: Probit, hazard: HazardCurve, total: float) -> tuple[float, float, float]:
    """Intensities up to which the quantiles of a rate come from."""
    if not 0.0 < total < math.inf:
        return math.nan, math.nan, math.nan
    from scipy.optimize import brentq

    a, b = float(fitted.intercept[0]), float(fitted.slope[0])
    low, high = (math.exp((z - a) / b) for z in (-12.0, 12.0))

    def found(share: float) -> float:
        def excess(logarithm: float) -> float:
            return _up_to(fitted, hazard, math.exp(logarithm)) / total - share

        return math.exp(brentq(excess, math.log(low), math.log(high), xtol=1e-12))

    sixteenth, half, rest = (found(share) for share in _QUANTILES)
    return sixteenth, half, rest


def _up_to(fitted: Probit, hazard: HazardCurve, intensity: float) -> float:
    """Part of a rate that comes from intensities up to one."""
    k, c = hazard.powers()
    segment = int(np.clip(np.searchsorted(hazard.intensity, intensity, side="right") - 1, 0, len(k) - 1))
    parts = _parts(fitted, hazard)[0]
    corners = np.log(hazard.intensity)
    outside = intensity < hazard.intensity[0]
    whole = 0.0 if outside else float(parts[: segment + 1].sum())
    start = -math.inf if outside else float(corners[segment])
    a, b = float(fitted.intercept[0]), float(fitted.slope[0])
    shift = k[segment] / b
    ends = np.array([a + b * start + shift]), np.array([a + b * math.log(intensity) + shift])
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.exp(c[segment] + shift * a + 0.5 * shift * shift + _log_between(*ends)[0])
    return whole + float(part)


def _density(fitted: Probit, at: Floats) -> Floats:
    """Change of a fragility with the logarithm of the intensity."""
    a, b = float(fitted.intercept[0]), float(fitted.slope[0])
    z = a + b * np.log(at)
    return np.asarray(b * np.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi))
