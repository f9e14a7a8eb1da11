"""Fragility curves: lognormals fitted to outcomes, with confidence bands and NRML export."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis import probit
from rocking.analysis.levels import compute_block_units
from rocking.analysis.probit import ExceedanceCounts, Probit, compute_normal_scores, compute_probabilities
from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Floats, Integers, unwrap_scalar
from rocking.core.constants import STANDARD_GRAVITY, Model
from rocking.core.tables import format_within
from rocking.errors import FitError, OptionError
from rocking.motion.measures import DEFAULT_DAMPING
from rocking.motion.scaling import Measure, check_intensities

if TYPE_CHECKING:
    from rocking.plot.curves import FragilityLine

NAMESPACE: Final = "http://openquake.org/xmlns/nrml/0.5"

LossCategory = Literal["structural", "nonstructural", "contents", "business_interruption"]

#: Largest square of a dispersion for which the lognormal has a finite standard deviation.
_MAX_VARIANCE: Final = 700.0

#: Largest plausible ratio of the median to the data.
_MAX_MEDIAN_RATIO: Final = 1000.0


@dataclass(frozen=True, eq=False)
class FragilityCurve:
    """Lognormal fragility curve P(x) = Phi(ln(x/median)/dispersion) fitted to outcomes.

    Attributes
    ----------
    limit_state : str
        Name of the limit state.
    limit : float or None
        Limit of the ratio of peak rotation to slenderness, infinite for overturning, or None for given outcomes.
    intensity, exceedance_counts, trial_counts : ndarray, shape (n,)
        Data: number of outcomes that exceeded, and of trials, at each intensity. Weights of blocks lead to fractional
        numbers.
    cluster_count : int
        Number of clusters of dependent outcomes (of motions for simulations).
    is_independent : bool
        Whether all outcomes are independent, as required by tests without clusters.
    fitted : Probit
        Intercept and slope of P = Phi(intercept + slope ln x).
    covariance : ndarray, shape (2, 2)
        Inverse of Fisher's expected information of intercept and slope.
    confidence : float
        Probability of the intervals and bands.
    log_likelihood : float
        Maximum of the log-likelihood, without binomial coefficients.
    region : Probit
        Fits on the boundary of the confidence region, whose extremes are the intervals. The region follows from the
        profile likelihood, adjusted to the differences between clusters with several outcomes
        :cite:p:`chandler2007`.
    goodness : Goodness
        Pearson's test of groups of outcomes against the fit: one group for each intensity if each has five outcomes or
        more (stripes), otherwise up to ten of equal size along the intensity (cloud, as in :cite:t:`hosmer1980`). The
        test assumes independence, and has no p-value for clusters of several outcomes.

    See Also
    --------
    rocking.fit_fragility : Fit curves to given outcomes.
    rocking.fragility : Simulate the outcomes and fit the curves.

    Examples
    --------
    >>> from rocking import fit_fragility
    >>> curve = fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trial_counts=4).curves[0]
    >>> low, high = curve.band(curve.median)
    >>> bool(low < 0.5 < high)
    True
    """

    limit_state: str
    limit: float | None
    intensity: Floats
    exceedance_counts: Floats
    trial_counts: Floats
    fitted: Probit
    covariance: Floats
    confidence: float
    cluster_count: int
    is_independent: bool
    log_likelihood: float
    goodness: probit.Goodness
    region: Probit

    def __repr__(self) -> str:
        median_bounds, dispersion_text = format_median_interval(self, 1.0), format_interval(self.dispersion_interval, 4)
        count_text = f"{self.exceedance_counts.sum():.0f} of {self.trial_counts.sum():.0f} exceeded"
        return (
            f"<FragilityCurve: {self.limit_state}, {count_text}; "
            f"median {self.median:.4g} ({median_bounds}) in SI units, "
            f"dispersion {self.dispersion:.4g} ({dispersion_text}); {100 * self.confidence:g} % confidence>"
        )

    @property
    def median(self) -> float:
        """Intensity of probability one half, in SI units or a block's own."""
        return math.exp(-float(self.fitted.intercept[0] / self.fitted.slope[0]))

    @property
    def dispersion(self) -> float:
        """Standard deviation of the logarithm of the intensity."""
        return 1.0 / float(self.fitted.slope[0])

    @property
    def is_bounded(self) -> bool:
        """Whether intervals can be finite, which requires three clusters if they contain several outcomes."""
        return bool(np.all(np.isfinite(self.region.intercept)))

    @property
    def median_interval(self) -> tuple[float, float]:
        """Confidence interval of the median, 0 or infinite if the data allow a curve that does not rise."""
        low, high = compute_extremes(self.region, _compute_log_medians)
        with np.errstate(over="ignore"):
            return float(np.exp(low[0])), float(np.exp(high[0]))

    @property
    def dispersion_interval(self) -> tuple[float, float]:
        """Confidence interval of the dispersion, infinite if the data allow a curve that does not rise."""
        return _compute_dispersion(float(self.region.slope.max())), _compute_dispersion(float(self.region.slope.min()))

    def probability(self, intensity: ArrayLike) -> Floats:
        """Compute the fitted probability at intensities >= 0 (SI units or a block's own), with their shape."""
        intensities = check_intensities(intensity)
        probabilities = compute_probabilities(self.fitted, _compute_logarithm(intensities).ravel())
        return unwrap_scalar(probabilities[0].reshape(intensities.shape))

    def intensity_of(self, probability: float) -> float:
        """Compute the intensity (SI units or a block's own) for a fitted probability between 0 and 1.

        ``intensity_of(0.95)`` is the amplitude that a rock which still stands has most likely never experienced.
        """
        from scipy.special import ndtri

        fraction = checks.fraction(probability, "probability", OptionError)
        score = float(ndtri(fraction))
        with np.errstate(over="ignore", under="ignore"):
            return float(np.exp((score - self.fitted.intercept[0]) / self.fitted.slope[0]))

    def largest_rate(self, intensity: ArrayLike, years: float, confidence: float = 0.95) -> Floats:
        """Compute the largest annual rates of exceeding an intensity that are consistent with survival.

        The rates are -ln(1 - confidence)/(years P(intensity)), with the shape of the intensities (SI units, 0 or more),
        and infinite at 0. The confidence is one-sided, as in `Fragility.survival`. A precarious rock that has stood for
        so long contradicts hazard curves above them.
        """
        duration = checks.positive(years, "years", OptionError)
        fraction = checks.fraction(confidence, "confidence", OptionError)
        with np.errstate(divide="ignore"):
            return -math.log1p(-fraction) / (duration * self.probability(intensity))

    def band(self, intensity: ArrayLike) -> tuple[Floats, Floats]:
        """Compute the lower and upper end of the pointwise confidence band of `probability`."""
        from scipy.special import ndtr

        intensities = check_intensities(intensity)
        log_intensity = _compute_logarithm(intensities).ravel()
        score_bounds = compute_extremes(self.region, lambda fits: compute_normal_scores(fits, log_intensity))
        low, high = (unwrap_scalar(np.asarray(ndtr(scores)).reshape(intensities.shape)) for scores in score_bounds)
        return low, high

    def to_dict(self) -> dict[str, Any]:
        """Return parameters, intervals and tests by name, with intensities in SI units or a block's own."""
        return {
            "limit_state": self.limit_state,
            "median": self.median,
            "median_interval": list(self.median_interval),
            "dispersion": self.dispersion,
            "dispersion_interval": list(self.dispersion_interval),
            "confidence": self.confidence,
            "trial_count": round(float(self.trial_counts.sum())),
            "exceedance_count": round(float(self.exceedance_counts.sum())),
            "cluster_count": self.cluster_count,
            "log_likelihood": self.log_likelihood,
            "goodness_statistic": self.goodness.statistic,
            "goodness_freedom": self.goodness.degrees_of_freedom,
            "goodness_p_value": self.goodness.p_value,
        }


def fit_curve(
    name: str,
    data: tuple[Floats, Floats, Floats],
    clusters: Integers | None,
    confidence: float,
    measure: Measure,
    limit: float | None = None,
) -> FragilityCurve:
    """Fit the curve of a limit state. Without clusters all trials are independent."""
    intensity, exceedances, trial_counts = data
    intensity = probit.merge_equal_intensities(intensity)
    # Both are sums of the same weights, but perhaps in a different order.
    exceedances = np.where(np.abs(trial_counts - exceedances) <= 1e-12 * trial_counts, trial_counts, exceedances)
    log_x = np.log(intensity)
    outcomes = ExceedanceCounts(log_x, exceedances, trial_counts)
    if message := probit.explain_missing_fit(outcomes, measure.format_value):
        raise FitError(f"no lognormal can be fitted to {name!r}: {message}")
    fitted = probit.fit(outcomes.as_batch())
    log_median = float(-fitted.intercept[0] / fitted.slope[0])
    if not log_x.min() - math.log(_MAX_MEDIAN_RATIO) <= log_median <= log_x.max() + math.log(_MAX_MEDIAN_RATIO):
        raise FitError(
            f"no lognormal can be fitted to {name!r}: the outcomes hardly depend on the intensity, so that the median "
            f"is {'above' if log_median > log_x.max() else 'below'} all intensities by a factor of more than 1000; use "
            "motions nearer to it, or another measure"
        )
    cluster_count = round(float(trial_counts.sum())) if clusters is None else int(clusters.max()) + 1
    is_independent = clusters is None or (cluster_count == log_x.size and bool(np.all(trial_counts <= 1.0)))
    return FragilityCurve(
        limit_state=name,
        limit=limit,
        intensity=intensity,
        exceedance_counts=exceedances,
        trial_counts=trial_counts,
        fitted=fitted,
        covariance=probit.compute_covariance(outcomes, fitted),
        confidence=confidence,
        cluster_count=cluster_count,
        is_independent=is_independent,
        log_likelihood=float(probit.compute_log_likelihood(outcomes.as_batch(), np.column_stack(fitted))[0]),
        goodness=probit.compute_goodness(outcomes, fitted, is_independent=is_independent),
        region=probit.compute_confidence_region(outcomes, fitted, None if is_independent else clusters, confidence),
    )


def create_fragility_line(curve: FragilityCurve, intensity: Floats, measure: Measure) -> FragilityLine:
    """Create the line of a figure: curve, band, and observed shares in the groups of the test."""
    from rocking.plot.curves import FragilityLine

    groups = probit.group_outcomes(np.log(curve.intensity), curve.trial_counts)
    counts = np.bincount(groups, curve.trial_counts).astype(np.float64)
    products = curve.trial_counts * curve.intensity, curve.exceedance_counts
    mean_intensity, observed = (np.bincount(groups, product) / counts for product in products)
    is_rotation = curve.limit is not None and math.isfinite(curve.limit)
    limit_text = f" (rotation of {curve.limit:g} of the slenderness)" if is_rotation else ""
    parameters = f"median {format_intensity(curve.median, measure)}, dispersion {curve.dispersion:.3g}"
    probability, factor = curve.probability(intensity), measure.display_factor
    band = curve.band(intensity) if curve.is_bounded else (probability, probability)
    label = f"{curve.limit_state}{limit_text}: {parameters}"
    return FragilityLine(label, factor * intensity, probability, *band, factor * mean_intensity, observed)


def check_counts(values: ArrayLike, argument: str, count: int, minimum: float, maximum: ArrayLike) -> Floats:
    """Check integers between two bounds, and return one for each intensity."""
    array = checks.booleans_or_numbers(values, argument, OptionError)
    try:
        numbers = np.broadcast_to(array, count)
    except ValueError:
        raise OptionError(f"{{}} must contain one number for each of the {count} intensities", argument) from None
    if not np.all((numbers >= minimum) & (numbers <= np.asarray(maximum)) & (numbers == np.floor(numbers))):
        maximum_text = f"{maximum:g}" if isinstance(maximum, float) else "the number of trials"
        raise OptionError(f"{{}} must be whole numbers from {minimum:g} to {maximum_text}", argument)
    return numbers


def compute_extremes(region: Probit, quantity: Callable[[Probit], Floats]) -> tuple[Floats, Floats]:
    """Find the lowest and the highest values of a quantity (fits, n) in a region of fits."""
    values = quantity(region)
    return values.min(axis=0), values.max(axis=0)


def format_intensity(intensity: float, measure: Measure) -> str:
    """Format an intensity (SI) with its unit."""
    return f"{measure.display_factor * intensity:.4g} {measure.display_unit}".rstrip()


def format_interval(ends: Sequence[float], digits: int, bounds: tuple[float, float] = (0.0, math.inf)) -> str:
    """Format an interval, with bounds in place of finite ends beyond them."""
    format_number = f"{{:.{digits}g}}".format
    texts = (
        "infinity" if math.isinf(end) else format_within(end, bounds if end else (0, 0), format_number) for end in ends
    )
    return " to ".join(texts)


def format_median_interval(curve: FragilityCurve, scale: float) -> str:
    """Format the interval of the median, times a factor, without numbers too far from the data."""
    bounds = scale * curve.intensity.min() / _MAX_MEDIAN_RATIO, scale * curve.intensity.max() * _MAX_MEDIAN_RATIO
    return format_interval([scale * end for end in curve.median_interval], 4, bounds)


def _compute_log_medians(fits: Probit) -> Floats:
    """Compute logarithms of medians, shape (fits, 1), -inf or inf for level curves above or below one half."""
    with np.errstate(divide="ignore", invalid="ignore"):
        log_medians = -fits.intercept / fits.slope
    return np.where(fits.slope > 0.0, log_medians, np.where(fits.intercept > 0.0, -np.inf, np.inf))[:, None]


def _compute_dispersion(slope: float) -> float:
    """Convert a slope to a dispersion: 0 for a step, infinite for a level curve."""
    if slope >= probit.STEEPEST_SLOPE:
        return 0.0
    return 1.0 / slope if slope > 0.0 else math.inf


def _compute_logarithm(intensity: Floats) -> Floats:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(intensity))


def format_nrml(
    curves: Sequence[FragilityCurve],
    measure: tuple[str, float],
    data_range: tuple[float, float],
    no_damage: float | None,
    taxonomy: str,
    description: str,
    **attributes: str,
) -> str:
    """Format an OpenQuake fragility model (NRML 0.5) of one function from moments of the intensity.

    `measure` contains OpenQuake's name and the factor of its unit, `data_range` the range (SI) of the data, `no_damage`
    the lowest damaging intensity in OpenQuake's unit, and `attributes` the model's id, assetCategory and lossCategory.
    """
    checks.choice(attributes["lossCategory"], "loss_category", OptionError, get_args(LossCategory))
    check_nrml_names("taxonomy", taxonomy)
    check_nrml_names("model_id", attributes["id"])
    check_nrml_names("asset_category", attributes["assetCategory"])
    check_nrml_names("a limit state", *(curve.limit_state for curve in curves))
    low, high = (measure[1] * end for end in data_range)
    low = max(low, no_damage or 0.0)
    if not high > low * (1.0 + 1e-5):
        raise OptionError(
            f"a fragility model requires a range of intensities above the uplift of the block; got {low:.6g} to "
            f"{high:.6g}; add motions of other intensities"
        )
    root = ET.Element("nrml", {"xmlns": NAMESPACE})
    model = ET.SubElement(root, "fragilityModel", attributes)
    # The manual requires a brief string in ASCII.
    ET.SubElement(model, "description").text = description.encode("ascii", "replace").decode("ascii")
    ET.SubElement(model, "limitStates").text = " ".join(curve.limit_state for curve in curves)
    function_attributes = {"id": taxonomy, "format": "continuous", "shape": "logncdf"}
    function = ET.SubElement(model, "fragilityFunction", function_attributes)
    level_attributes = {"imt": measure[0]} | ({} if no_damage is None else {"noDamageLimit": f"{no_damage:.8g}"})
    ET.SubElement(function, "imls", level_attributes | {"minIML": f"{low:.8g}", "maxIML": f"{high:.8g}"})
    for curve in curves:
        variance = curve.dispersion**2
        if variance > _MAX_VARIANCE:
            raise OptionError(f"a dispersion of {curve.dispersion:.3g} is too large for the mean and stddev of NRML")
        mean = measure[1] * curve.median * math.exp(0.5 * variance)
        moments = {"mean": f"{mean:.8g}", "stddev": f"{mean * math.sqrt(math.expm1(variance)):.8g}"}
        ET.SubElement(function, "params", {"ls": curve.limit_state} | moments)
    ET.indent(root)
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{ET.tostring(root, encoding='unicode')}\n"


def check_nrml_names(argument: str, *names: str) -> None:
    """Raise an OptionError unless NRML allows all names."""
    for name in names:
        if not re.fullmatch(r"[A-Za-z0-9_-]{1,100}", checks.text(name, argument, OptionError)):
            message = f"{{}} of NRML must consist of at most 100 letters, digits, dashes and underscores, not {name!r}"
            raise OptionError(message, argument, value=name)


def convert_to_openquake_measure(measure: Measure, block: Body | None, model: Model) -> tuple[str, float]:
    """Return OpenQuake's name of a measure, and the factor from SI units or the block's own to g (PGV: cm/s).

    SA(T) does not state its damping, which is the damping of ground-motion models.
    """
    if measure.has_block_units and block is None:
        raise OptionError(f"{measure.name} is in units of the block; give {{}} to convert it to PGA or PGV", "block")
    unit = 1.0 if block is None else float(compute_block_units(block.as_bodies(), measure, model)[0])
    name = measure.motion_measure_name
    factors = {
        "pgv": ("PGV", 100.0),
        "pgd": ("PGD", 100.0),
        "arias": ("IA", 1.0),
        "cav": ("CAV", 1.0 / STANDARD_GRAVITY),
    }
    if name in factors:
        return factors[name][0], factors[name][1] * unit
    if name not in ("pga", "sa"):
        known = ", ".join(["pga", "sa", *factors])
        raise OptionError(f"OpenQuake requires one of the measures {known}; got {name}", "measure", value=name)
    if (damping := measure.damping) != DEFAULT_DAMPING:
        message = f"the {{}} of a spectral acceleration must be {DEFAULT_DAMPING:g} of critical for OpenQuake"
        correction = "fit the fragility against a measure with this damping"
        raise OptionError(f"{message}; got {damping:g}; {correction}", "damping", value=damping)
    return "PGA" if name == "pga" else f"SA({measure.period:g})", unit / STANDARD_GRAVITY
