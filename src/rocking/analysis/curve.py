"""A fragility curve: a lognormal fitted to outcomes of one limit state, with its confidence band."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis import probit
from rocking.analysis.probit import Outcomes, Probit, normal_scores, probabilities
from rocking.analysis.regions import FEWEST, Confidence, Ends, LikelyRegion, Quantity, Resamples
from rocking.core import checks
from rocking.core.arrays import Floats, Integers, as_asked
from rocking.core.tables import within
from rocking.errors import InvalidOption, Unfitted
from rocking.motion.scaling import Measure, intensities

BandKind = Literal["likelihood", "bootstrap"]


#: How many times beyond the data a median is still believed.
_FARTHEST: Final = 1000.0


@dataclass(frozen=True)
class Band:
    """How confidence intervals and bands of a fragility are made.

    Parameters
    ----------
    kind : {"likelihood", "bootstrap"}
        Whether they come from the profile likelihood, adjusted to the differences between clusters where these hold
        several outcomes (Chandler and Bate 2007); or from fits to clusters drawn with replacement (BCa, Efron 1987).
    confidence : float
        Probability of the intervals and bands, between 0 and 1.
    samples, seed : int
        How many times the bootstrap draws, and the seed of its random numbers.

    Examples
    --------
    >>> from rocking import fit_fragility
    >>> found = fit_fragility([2.0, 3.0, 4.0], [1, 4, 7], trials=10, band=Band(confidence=0.5))
    >>> found.curves[0].confidence
    0.5
    """

    kind: BandKind = "likelihood"
    confidence: float = 0.9
    samples: int = 1000
    seed: int = 0

    def __post_init__(self) -> None:
        checks.one_of(self.kind, "kind", InvalidOption, get_args(BandKind))
        checks.share(self.confidence, "confidence", InvalidOption)
        checks.whole(self.samples, "samples", InvalidOption, 1)
        checks.whole(self.seed, "seed", InvalidOption, 0)
        # In the mean two samples lie beyond the ends of an interval, at least.
        if self.kind == "bootstrap" and self.samples * (1.0 - self.confidence) < 2.0:
            least = math.ceil(2.0 / (1.0 - self.confidence))
            raise InvalidOption(
                f"so few {{}} as {self.samples} do not reach the ends of an interval of {self.confidence:g}; take "
                f"{least} or more",
                "samples",
            )


@dataclass(frozen=True, eq=False)
class FragilityCurve:
    """A lognormal fitted to outcomes: P(x) = Phi(ln(x/median)/dispersion).

    Attributes
    ----------
    limit_state : str
        Name of what is exceeded.
    limit : float or None
        Peak rotation over slenderness that is exceeded, infinite for overturning; None where outcomes were given.
    intensity, exceeded, trials : ndarray, shape (n,)
        The data: outcomes that exceeded, of how many, at each intensity. Those of blocks with weights count in parts.
    clusters : int
        Number of clusters of outcomes that belong together: of motions, where outcomes were simulated; of outcomes,
        where each is on its own.
    independent : bool
        Whether every outcome is on its own, so that tests which know of no clusters may be asked.
    fitted : Probit
        Intercept and slope of P = Phi(intercept + slope ln x).
    covariance : ndarray, shape (2, 2)
        Inverse of Fisher's expected information of intercept and slope.
    confidence : float
        Probability of the intervals and bands.
    likelihood : Likelihood
        At its maximum, and against one probability for all intensities.
    goodness : Goodness
        Pearson's test between groups of outcomes and the fit: one group for each intensity where each has five outcomes
        or more (stripes), else up to ten of equal size along the intensity (cloud; Hosmer and Lemeshow). It takes all
        outcomes for independent: where several belong to one cluster there is no p-value.

    Examples
    --------
    >>> from rocking import fit_fragility
    >>> curve = fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trials=4).curves[0]
    >>> low, high = curve.band(curve.median)
    >>> bool(low < 0.5 < high)
    True
    """

    limit_state: str
    limit: float | None
    intensity: Floats
    exceeded: Floats
    trials: Floats
    fitted: Probit
    covariance: Floats
    confidence: float
    clusters: int
    independent: bool
    likelihood: probit.Likelihood
    goodness: probit.Goodness
    _uncertainty: Confidence

    def __repr__(self) -> str:
        median, dispersion = median_text(self, 1.0), interval_text(self.dispersion_interval, 4)
        count = f"{self.exceeded.sum():.0f} of {self.trials.sum():.0f} exceeded"
        return (
            f"<FragilityCurve: {self.limit_state}, {count}; median {self.median:.4g} ({median}) in SI units, "
            f"dispersion {self.dispersion:.4g} ({dispersion}); {100 * self.confidence:g} % confidence>"
        )

    @property
    def _intercept(self) -> float:
        return float(self.fitted.intercept[0])

    @property
    def _slope(self) -> float:
        return float(self.fitted.slope[0])

    @property
    def median(self) -> float:
        """Intensity of probability one half, in SI units or a block's own."""
        return math.exp(-self._intercept / self._slope)

    @property
    def dispersion(self) -> float:
        """Standard deviation of the logarithm of the intensity."""
        return 1.0 / self._slope

    @property
    def degenerate(self) -> float:
        """Share of resampled data sets that are separated, all alike or fall, as limits; NaN without a bootstrap."""
        return self._uncertainty.degenerate if isinstance(self._uncertainty, Resamples) else math.nan

    @property
    def bounded(self) -> bool:
        """Whether intervals and bands bound anything: fewer than three clusters of several outcomes do not."""
        return isinstance(self._uncertainty, Resamples) or self._uncertainty.bounded

    @property
    def median_interval(self) -> tuple[float, float]:
        """Confidence interval of the median; 0 or infinite where the data allow a curve that does not rise."""
        logarithm = math.log(self.median)
        gradient = np.array([[-1.0 / self._slope], [-logarithm / self._slope]])
        low, high = interval_of(self, _log_medians, gradient)
        with np.errstate(over="ignore"):
            return float(np.exp(low[0])), float(np.exp(high[0]))

    @property
    def dispersion_interval(self) -> tuple[float, float]:
        """Confidence interval of the dispersion; infinite where the data allow a curve that does not rise."""
        gradient = np.array([[0.0], [1.0]])
        flattest, steepest = interval_of(self, lambda fits: fits.slope[:, None], gradient)
        return _dispersion(float(steepest[0])), _dispersion(float(flattest[0]))

    def probability(self, intensity: ArrayLike) -> Floats:
        """Fitted probability at intensities of 0 or more (SI units, or a block's own), shaped like them."""
        at = intensities(intensity)
        return as_asked(probabilities(self.fitted, _logarithm(at).ravel())[0].reshape(at.shape))

    def intensity_of(self, probability: float) -> float:
        """Intensity (SI units, or a block's own) at which the fitted probability is that given, between 0 and 1.

        ``intensity_of(0.95)`` is the amplitude that a rock which still stands has most likely never met.
        """
        from scipy.special import ndtri

        share = checks.share(probability, "probability", InvalidOption)
        score = float(ndtri(share))
        with np.errstate(over="ignore", under="ignore"):
            return float(np.exp((score - self._intercept) / self._slope))

    def largest_rate(self, intensity: ArrayLike, years: float, confidence: float = 0.95) -> Floats:
        """Annual rates of motions of an intensity or more above which a block that stood would have fallen.

        They are -ln(1 - confidence)/(years P(intensity)), shaped like the intensities (SI units, 0 or more), and
        infinite at 0. A precarious rock of that age contradicts a hazard curve above them.
        """
        time = checks.positive(years, "years", InvalidOption)
        share = checks.share(confidence, "confidence", InvalidOption)
        with np.errstate(divide="ignore"):
            return -math.log1p(-share) / (time * self.probability(intensity))

    def band(self, intensity: ArrayLike) -> tuple[Floats, Floats]:
        """Lower and upper end of the pointwise confidence band of the `probability` at intensities."""
        from scipy.special import ndtr

        at = intensities(intensity)
        z = _logarithm(at).ravel()
        finite = np.where(np.isfinite(z), z, 0.0)
        gradient = np.stack([np.ones_like(finite), finite])
        ends = interval_of(self, lambda fits: normal_scores(fits, z), gradient)
        low, high = (as_asked(np.asarray(ndtr(end)).reshape(at.shape)) for end in ends)
        return low, high

    def to_dict(self) -> dict[str, Any]:
        """Return parameters, intervals and tests by name; intensities are in SI units, or a block's own."""
        return {
            "limit_state": self.limit_state,
            "median": self.median,
            "median_interval": list(self.median_interval),
            "dispersion": self.dispersion,
            "dispersion_interval": list(self.dispersion_interval),
            "confidence": self.confidence,
            "outcomes": round(float(self.trials.sum())),
            "exceeded": round(float(self.exceeded.sum())),
            "clusters": self.clusters,
            "log_likelihood": self.likelihood.logarithm,
            "likelihood_ratio": self.likelihood.ratio,
            "likelihood_ratio_p_value": self.likelihood.p_value,
            "goodness_statistic": self.goodness.statistic,
            "goodness_freedom": self.goodness.freedom,
            "goodness_p_value": self.goodness.p_value,
            "degenerate_resamples": self.degenerate,
        }


def fitted_curve(
    name: str,
    data: tuple[Floats, Floats, Floats],
    clusters: Integers | None,
    band: Band,
    measure: Measure,
    limit: float | None = None,
) -> FragilityCurve:
    """Curve of a limit state from intensities, exceedances and trials; without clusters every trial is on its own."""
    intensity, exceeded, trials = data
    intensity = probit.merge_equal_intensities(intensity)
    # Both are sums of the same weights, perhaps in another order.
    exceeded = np.where(np.abs(trials - exceeded) <= 1e-12 * trials, trials, exceeded)
    z = np.log(intensity)
    outcomes = Outcomes(z, exceeded, trials)
    fault = probit.unidentified(outcomes, measure.shown)
    if fault is not None:
        raise Unfitted(f"no lognormal can be fitted to {name!r}: {fault}")
    fitted = probit.fit(outcomes.alone())
    middle = float(-fitted.intercept[0] / fitted.slope[0])
    if not z.min() - math.log(_FARTHEST) <= middle <= z.max() + math.log(_FARTHEST):
        raise Unfitted(
            f"no lognormal can be fitted to {name!r}: the outcomes hardly depend on the intensity, and put the median "
            f"{'above' if middle > z.max() else 'below'} all intensities by a factor of more than 1000: motions nearer "
            "to it, or another measure, are needed"
        )
    count = round(float(trials.sum())) if clusters is None else int(clusters.max()) + 1
    independent = clusters is None or (count == z.size and bool(np.all(trials <= 1.0)))
    uncertainty: Confidence
    if band.kind == "bootstrap" and (independent or count >= FEWEST):
        uncertainty = Resamples.of(outcomes, fitted, clusters, band.samples, band.seed)
    else:
        uncertainty = LikelyRegion.of(outcomes, fitted, None if independent else clusters, band.confidence)
    return FragilityCurve(
        limit_state=name,
        limit=limit,
        intensity=intensity,
        exceeded=exceeded,
        trials=trials,
        fitted=fitted,
        covariance=probit.covariance(outcomes, fitted),
        confidence=band.confidence,
        clusters=count,
        independent=independent,
        likelihood=probit.gain(outcomes, fitted, independent=independent),
        goodness=probit.goodness(outcomes, fitted, independent=independent),
        _uncertainty=uncertainty,
    )


def interval_of(curve: FragilityCurve, quantity: Quantity, gradient: Floats | None = None) -> Ends:
    """Return the confidence interval of a quantity of fits, from its gradient (2, n), by default of differences."""
    estimate = quantity(curve.fitted)[0]
    if gradient is None:
        rows = []
        for name in Probit._fields:
            value = getattr(curve.fitted, name)
            step = 1e-5 * np.maximum(np.abs(value), 1.0)
            up, down = (quantity(curve.fitted._replace(**{name: value + sign * step}))[0] for sign in (1.0, -1.0))
            rows.append((up - down) / (2.0 * step))
        gradient = np.array(rows)
    return curve._uncertainty.interval(quantity, estimate, gradient, curve.confidence)


def passed(ratio: Floats, limit: float, name: str) -> Floats:
    """Whether peak rotation over slenderness passes a limit: 1 or 0; infinite is overturning."""
    limit = checked_limit(limit, name)
    return np.asarray(np.isinf(ratio) if math.isinf(limit) else ratio > limit, dtype=np.float64)


def checked_limit(limit: float, name: str) -> float:
    """Return a limit of peak rotation over slenderness, checked."""
    what = f"the limit {name!r} (rotation over slenderness)"
    least = checks.number(limit, what, InvalidOption)
    if not least >= 0.0:
        raise InvalidOption(f"{{}} must be 0 or more, not {limit!r}", what, value=limit)
    return least


def in_units(intensity: float, measure: Measure) -> str:
    """Return an intensity, in SI units, as people write it, with its unit."""
    return f"{measure.scale * intensity:.4g} {measure.shown_in}".rstrip()


def interval_text(ends: Sequence[float], digits: int, bounds: tuple[float, float] = (0.0, math.inf)) -> str:
    """Write the ends of an interval, to some digits; in place of finite ones outside of bounds the bounds."""
    text = f"{{:.{digits}g}}".format
    return " to ".join("infinity" if math.isinf(end) else within(end, bounds if end else (0, 0), text) for end in ends)


def median_text(curve: FragilityCurve, scale: float) -> str:
    """Write the interval of the median, times a factor, without numbers that are too far from the data."""
    bounds = scale * curve.intensity.min() / _FARTHEST, scale * curve.intensity.max() * _FARTHEST
    return interval_text([scale * end for end in curve.median_interval], 4, bounds)


def _log_medians(fits: Probit) -> Floats:
    """Logarithms of medians, shape (fits, 1): infinite of a level curve, above one half or below."""
    with np.errstate(divide="ignore", invalid="ignore"):
        sloping = -fits.intercept / fits.slope
    return np.where(fits.slope > 0.0, sloping, np.where(fits.intercept > 0.0, -np.inf, np.inf))[:, None]


def _dispersion(slope: float) -> float:
    """Dispersion of a slope: 0 of a step, infinite of a level curve."""
    if slope >= probit.STEEP:
        return 0.0
    return 1.0 / slope if slope > 0.0 else math.inf


def _logarithm(intensity: Floats) -> Floats:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(intensity))
