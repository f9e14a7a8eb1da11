"""Fragility curves: lognormals with confidence bands, and what they are written to."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.analysis.fragility import lognormal, nrml
from rocking.analysis.fragility.confidence import Confidence, Resamples
from rocking.analysis.fragility.lognormal import Probit
from rocking.analysis.intensity import Measure, intensities
from rocking.arrays import Floats, as_asked
from rocking.block import Block
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidOption
from rocking.model import Model
from rocking.progress import phrased
from rocking.tables import counted, text_table, write_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rocking.analysis.hazard import HazardCurve
    from rocking.analysis.risk import Risk
    from rocking.analysis.survival import Survival

#: Points of a curve in a table or a figure.
_POINTS: Final = 201


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
        Number of clusters of outcomes that belong together: of motions, where outcomes were simulated.
    independent : bool
        Whether every outcome is on its own, so that tests which know of no clusters may be asked.
    fitted : Probit
        Intercept and slope of P = Phi(intercept + slope ln x).
    covariance : ndarray, shape (2, 2)
        Inverse of Fisher's expected information of intercept and slope.
    uncertainty : LikelyRegion or Resamples
        Where intervals and bands come from: the likelihood, or the bootstrap.
    confidence : float
        Probability of the intervals and bands.
    likelihood : Likelihood
        At its maximum, and against one probability for all intensities.
    goodness : Goodness
        Pearson's test between groups of outcomes and the fit: one group for each intensity where each has five outcomes
        or more (stripes), else up to ten of equal size along the intensity (cloud; Hosmer and Lemeshow). It takes all
        outcomes for independent: where several belong to one cluster there is no p-value.
    """

    limit_state: str
    limit: float | None
    intensity: Floats
    exceeded: Floats
    trials: Floats
    fitted: Probit
    covariance: Floats
    uncertainty: Confidence
    confidence: float
    clusters: int
    independent: bool
    likelihood: lognormal.Likelihood
    goodness: lognormal.Goodness

    def __repr__(self) -> str:
        median, dispersion = (interval_text(each, 4) for each in (self.median_interval, self.dispersion_interval))
        count = f"{self.exceeded.sum():.0f} of {self.trials.sum():.0f} exceeded"
        return (
            f"<FragilityCurve: {self.limit_state}, {count}; median {self.median:.4g} ({median}) in SI units, "
            f"dispersion {self.dispersion:.4g} ({dispersion}); {100 * self.confidence:g} % confidence>"
        )

    @property
    def median(self) -> float:
        """Intensity of probability one half."""
        return math.exp(-float(self.fitted.intercept[0]) / float(self.fitted.slope[0]))

    @property
    def dispersion(self) -> float:
        """Standard deviation of the logarithm of the intensity."""
        return 1.0 / float(self.fitted.slope[0])

    @property
    def degenerate(self) -> float:
        """Share of resampled data sets whose outcomes were separated, all alike or fell; they count as limits.

        Separated outcomes make a step, the others a level curve; NaN without a bootstrap.
        """
        return self.uncertainty.degenerate if isinstance(self.uncertainty, Resamples) else math.nan

    @property
    def bounded(self) -> bool:
        """Whether intervals and bands bound anything: fewer than three clusters of several outcomes do not."""
        return isinstance(self.uncertainty, Resamples) or self.uncertainty.bounded

    @property
    def median_interval(self) -> tuple[float, float]:
        """Confidence interval of the median; 0 or infinite where the data allow a curve that does not rise."""
        slope, logarithm = float(self.fitted.slope[0]), math.log(self.median)
        gradient = np.array([[-1.0 / slope], [-logarithm / slope]])
        low, high = self.uncertainty.interval(_log_medians, np.array([logarithm]), gradient, self.confidence)
        with np.errstate(over="ignore"):
            return float(np.exp(low[0])), float(np.exp(high[0]))

    @property
    def dispersion_interval(self) -> tuple[float, float]:
        """Confidence interval of the dispersion; infinite where the data allow a curve that does not rise."""
        gradient = np.array([[0.0], [1.0]])
        flattest, steepest = self.uncertainty.interval(_slopes, self.fitted.slope, gradient, self.confidence)
        return _dispersion(float(steepest[0])), _dispersion(float(flattest[0]))

    def probability(self, intensity: ArrayLike) -> Floats:
        """Fitted probability at intensities, shaped like them.

        Examples
        --------
        >>> from rocking import fit_fragility
        >>> curve = fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trials=4).curves[0]
        >>> curve.probability([curve.median, 0.0]).round(12).tolist()
        [0.5, 0.0]
        """
        at = intensities(intensity)
        return as_asked(self.fitted.probability(_logarithm(at).ravel())[0].reshape(at.shape))

    def intensity_of(self, probability: float) -> float:
        """Intensity at which the fitted probability is as given.

        A rock that still stands has, most likely, never been shaken so strongly that it would have fallen with a
        probability of 0.95: ``intensity_of(0.95)`` is the amplitude that is unlikely to have been exceeded in its life.

        Raises
        ------
        InvalidOption
            If the probability is not between 0 and 1.
        """
        from scipy.special import ndtri

        share = checks.share(probability, "probability", InvalidOption)
        score = float(ndtri(share))
        with np.errstate(over="ignore", under="ignore"):
            return float(np.exp((score - float(self.fitted.intercept[0])) / float(self.fitted.slope[0])))

    def largest_rate(self, intensity: ArrayLike, years: float, confidence: float = 0.95) -> Floats:
        """Annual rates of motions of an intensity or more that fit with none having exceeded the limit state in a time.

        Were such motions more frequent, a block that stood for `years` would have fallen with a probability above
        `confidence`: -ln(1 - confidence)/(years P(intensity)). A hazard curve above it is contradicted by a precarious
        rock of that age.

        Parameters
        ----------
        intensity : array_like
            Intensities in SI units, above 0.
        years : float
            For how long the block has stood.
        confidence : float
            Probability with which it would have fallen.

        Returns
        -------
        ndarray
            Rates (1/year), shaped like the intensities; infinite at 0.

        Raises
        ------
        InvalidOption
            If an argument is out of range.
        """
        time = checks.positive(years, "years", InvalidOption)
        share = checks.share(confidence, "confidence", InvalidOption)
        with np.errstate(divide="ignore"):
            return -math.log1p(-share) / (time * self.probability(intensity))

    def band(self, intensity: ArrayLike) -> tuple[Floats, Floats]:
        """Lower and upper end of the pointwise confidence band of the probability."""
        from scipy.special import ndtr

        at = intensities(intensity)
        z = _logarithm(at).ravel()
        finite = np.where(np.isfinite(z), z, 0.0)
        ends = self.uncertainty.interval(
            lambda fits: fits.score(z),
            self.fitted.score(z)[0],
            np.stack([np.ones_like(finite), finite]),
            self.confidence,
        )
        low, high = (as_asked(np.asarray(ndtr(end)).reshape(at.shape)) for end in ends)
        return low, high

    def to_dict(self) -> dict[str, Any]:
        """Parameters, intervals and tests by name."""
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


@dataclass(frozen=True, eq=False, repr=False)
class Fragility:
    """Fragility curves of one or several limit states against one intensity measure.

    Attributes
    ----------
    curves : tuple of FragilityCurve
        One for each limit state.
    measure : Measure
        Intensity measure; intensities are in its SI units.
    description : str
        What was simulated or observed.
    block : Block or None
        The block, where there is one.
    model : str
        Equation of motion, which says how a block's own unit counts.
    outcomes : pandas.DataFrame or None
        What was simulated, one row each, so that the fit can be audited: motion, block (position), polarity, the
        measure with its unit (SI, as pga_m_s2), peak_rotation_rad, peak_over_alpha (infinite where it overturned),
        overturned, whether each limit state was exceeded, and the weight of the block where it has one; None where the
        outcomes were given.
    one_way : bool
        Whether sides that differ met motions in one polarity only: reversed, they do something else.
    source : str
        What a cluster of outcomes comes from: a motion, or, where outcomes were given, a cluster.
    """

    curves: tuple[FragilityCurve, ...]
    measure: Measure
    description: str
    block: Block | None
    model: Model
    outcomes: pd.DataFrame | None
    one_way: bool = False
    source: str = "motion"

    def summary(self) -> str:
        """Median and dispersion of each limit state with their intervals, in a table."""
        scale = self.measure.scale
        rows = [
            [
                curve.limit_state,
                f"{curve.exceeded.sum():.0f} of {curve.trials.sum():.0f}",
                scale * curve.median,
                interval_text([scale * end for end in curve.median_interval], 4),
                curve.dispersion,
                interval_text(curve.dispersion_interval, 3),
                curve.goodness.p_value,
            ]
            for curve in self.curves
        ]
        between_text = f"{100 * self.curves[0].confidence:g} % between"
        header = ["limit state", "exceeded", "median", between_text, "dispersion", between_text, "p of fit"]
        table = text_table(header, rows)
        notes = [f"note: {sentence}" for sentence in self.notes]
        return "\n".join([f"{self.description}; intensity: {self.measure.label}", "", table, *notes])

    @property
    def notes(self) -> tuple[str, ...]:
        """What is to be known before the curves are believed, a sentence each."""
        notes = []
        if self.one_way:
            notes.append(
                "the sides differ, and motions came in one polarity only: reversed ones give another curve; "
                + phrased('polarity="both" counts both')
            )
        if not self.curves[0].bounded:
            notes.append(f"intervals and bands go from 0 to infinity: {self._too_few()}")
        independent = self.curves[0].independent
        wanted = "outcome" if independent else self.source
        notes += [
            f"{curve.limit_state}: intervals without an end say that the data allow a curve which does not rise with "
            f"the intensity; more {wanted}s are needed"
            for curve in self.curves
            if curve.bounded and math.isinf(curve.dispersion_interval[1])
        ]
        if not independent:
            notes.append(
                f"there is no p of fit: the test takes all outcomes for independent, and those of one {self.source} "
                "belong together"
            )
        elif self.curves[0].goodness.freedom < 1:
            notes.append("there is no p of fit: the test needs three groups of outcomes, of five or so each")
        return tuple(notes)

    def _too_few(self) -> str:
        """Why nothing is bounded."""
        count = counted(self.curves[0].clusters, self.source)
        return f"{count} cannot tell how far {self.source}s differ; give 3 or more"

    def to_dict(self) -> dict[str, Any]:
        """Curves by name; intensities in SI units."""
        return {
            "block": None if self.block is None else self.block.description,
            "description": self.description,
            "measure": {"name": self.measure.name, "units": self.measure.units, **self.measure.options()},
            "model": self.model,
            "band": self.band_kind,
            "curves": [curve.to_dict() for curve in self.curves],
            "notes": list(self.notes),
            "outcomes": None if self.outcomes is None else self.outcomes.to_dict("records"),
        }

    @property
    def band_kind(self) -> str:
        """Where intervals and bands come from: "likelihood" or "bootstrap"."""
        return "bootstrap" if isinstance(self.curves[0].uncertainty, Resamples) else "likelihood"

    def __repr__(self) -> str:
        curves = ", ".join(
            f"{one.limit_state}: median {self.in_units(one.median)}, dispersion {one.dispersion:.3g}"
            for one in self.curves
        )
        return f"<Fragility: {self.description}; {self.measure.label}; {curves}>"

    def curve(self, limit_state: str) -> FragilityCurve:
        """Curve of a limit state.

        Raises
        ------
        InvalidOption
            If there is none of that name.
        """
        curves = {curve.limit_state: curve for curve in self.curves}
        return curves[checks.one_of(limit_state, "limit_state", InvalidOption, list(curves))]

    def annual_rate(self, hazard: HazardCurve) -> Risk:
        """Annual rates of exceeding the limit states at a site, from its hazard curve.

        Parameters
        ----------
        hazard : HazardCurve
            Annual rates of the intensities that this fragility is against.

        Returns
        -------
        Risk
            Rate, return period and probability in a number of years, for each limit state.

        Raises
        ------
        InvalidOption
            If the two are not of one intensity measure.

        Notes
        -----
        The integral of rate(x) dP(x) over all intensities x, in closed form: a lognormal against a power of x on each
        segment of the hazard curve. For one power k all along, it is rate(median) exp((k dispersion)^2/2) (Cornell).

        Examples
        --------
        >>> from rocking import HazardCurve, fit_fragility
        >>> fitted = fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trials=4, measure="pga")
        >>> risk = fitted.annual_rate(HazardCurve([0.5, 5.0], [1e-2, 1e-4]))
        >>> one = risk.rate("overturning")
        >>> f"{one.annual_rate:.6f} {one.probability(50.0):.4f}"
        '0.000434 0.0215'
        """
        from rocking.analysis.risk import risk

        return risk(self, hazard)

    def survival(
        self,
        years: float,
        hazard: HazardCurve | None = None,
        *,
        confidence: float = 0.95,
        limit_state: str = "overturning",
    ) -> Survival:
        """Say what follows for past shaking where a limit state was not exceeded, as of a rock that still stands.

        Parameters
        ----------
        years : float
            For how long the block has stood, or has not exceeded the limit state.
        hazard : HazardCurve, optional
            Annual rates of the intensities: how probable the survival is under them.
        confidence : float
            Probability with which the limit would have been exceeded, were shaking any stronger or more frequent.
        limit_state : str
            Name of what was not exceeded.

        Returns
        -------
        Survival
            Intensity that was most likely never reached, largest annual rates, and the probability of surviving.

        Raises
        ------
        InvalidOption
            If an argument is out of its range, there is no such limit state, or the hazard curve is of another measure.

        Examples
        --------
        >>> from rocking import HazardCurve, fit_fragility
        >>> fitted = fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trials=4, measure="pga")
        >>> found = fitted.survival(10_000.0, HazardCurve([0.5, 5.0], [1e-2, 1e-4]))
        >>> found
        <Survival: overturning: not in 10000 years; most likely never 0.4385 g or more>
        >>> f"{found.probability:.4f}", found.contradicts
        ('0.0131', False)
        """
        from rocking.analysis.survival import survival

        return survival(self, years, hazard, confidence, limit_state)

    def in_units(self, intensity: float) -> str:
        """Return an intensity, in SI units, as people write it."""
        return f"{self.measure.scale * intensity:.4g} {self.measure.shown_in}".rstrip()

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest intensity of the data."""
        held = np.concatenate([curve.intensity for curve in self.curves])
        return float(held.min()), float(held.max())

    def to_csv(self, path: str | Path) -> None:
        """Write the curves as columns: limit state, intensity (SI), probability, lower and upper end of the band.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        intensity = np.linspace(0.0, self.range[1], _POINTS)
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(["limit_state", self.measure.column, "probability", "lower", "upper"])
        for curve in self.curves:
            columns = np.column_stack([intensity, curve.probability(intensity), *curve.band(intensity)])
            table.writerows([curve.limit_state, *(f"{value:.10g}" for value in row)] for row in columns)
        write_text(path, text.getvalue())

    def outcomes_to_csv(self, path: str | Path) -> None:
        """Write `outcomes`, one row for each simulation.

        Raises
        ------
        InvalidOption
            If the outcomes were given, not simulated.
        OutputError
            If the file cannot be written.
        """
        if self.outcomes is None:
            raise InvalidOption("this fragility was fitted to given outcomes: there are no simulations to write")
        write_text(path, self.outcomes.to_csv(index=False, float_format="%.10g", lineterminator="\n"))

    def to_nrml(
        self,
        path: str | Path,
        *,
        taxonomy: str = "rocking-block",
        format: nrml.Format = "continuous",
        block: Block | None = None,
        model_id: str = "rocking",
        loss_category: nrml.LossCategory = "contents",
        asset_category: str = "contents",
    ) -> None:
        """Write the curves as an OpenQuake fragility model, NRML 0.5.

        Parameters
        ----------
        path : path
            File to write.
        taxonomy : str
            Identifier of the fragility function, which the exposure model refers to.
        format : {"continuous", "discrete"}
            Lognormals by the mean and the standard deviation of the intensity (not of its logarithm, as OpenQuake
            wants them), or probabilities at 40 intensities.
        block : Block, optional
            Block whose unit a dimensionless measure counts in, where the curves come from several.
        model_id, loss_category, asset_category : str
            Further attributes of the model; the loss category is one of structural, nonstructural, contents and
            business_interruption.

        Raises
        ------
        InvalidOption
            If a name has a character that NRML does not allow, a block is needed, or the dispersion is too wide.
        OutputError
            If the file cannot be written.

        Notes
        -----
        Units become OpenQuake's: PGA and SA in g, PGV in cm/s. A measure in a block's own unit becomes PGA or PGV of
        that block. The range of validity is that of the data. A block cannot move below its uplift acceleration, which
        is written as the limit of no damage of PGA, unless a vertical motion was simulated, which lowers it.
        """
        chosen = self.block if block is None else block
        lognormals = [nrml.Lognormal(one.limit_state, one.median, one.dispersion) for one in self.curves]
        scale = nrml.scale_of(self.measure, chosen, self.model)
        lifting = None
        is_horizontal = self.outcomes is None or "vertical" not in self.outcomes
        if chosen is not None and scale.imt == "PGA" and is_horizontal:
            lifting = min(chosen.uplift_thresholds(self.model)) / STANDARD_GRAVITY
        function = nrml.fragility_function(lognormals, scale, self.range, lifting, taxonomy, format)
        states = [curve.limit_state for curve in self.curves]
        nrml.write(path, function, states, nrml.Header(model_id, asset_category, loss_category, self.description))

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        """Draw the curves with their bands and the shares that were seen.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; by default in a new figure.
        title : str
            Title; by default the description.
        figsize : (float, float), optional
            Width and height of a new figure, inches.
        """
        from rocking.plot import FragilityLine, fragility_figure

        first = self.curves[0]
        band_text = f"band: {100 * first.confidence:g} % confidence ({self.band_kind})"
        if not first.bounded:
            band_text = f"no band: {self._too_few()}"

        intensity, scale = np.linspace(0.0, self.range[1], _POINTS), self.measure.scale
        lines = []
        for curve in self.curves:
            at, seen, outcomes = _shares_seen(curve)
            limit = f" (rotation of {curve.limit:g} of the slenderness)" if _is_rotation(curve.limit) else ""
            at_half = f"median {self.in_units(curve.median)}, dispersion {curve.dispersion:.3g}"
            text = f"{curve.limit_state}{limit}: {at_half}"
            chance = curve.probability(intensity)
            band = curve.band(intensity) if curve.bounded else (chance, chance)
            lines.append(FragilityLine(text, scale * intensity, chance, *band, scale * at, seen, outcomes))
        return fragility_figure(
            lines=lines,
            intensity_label=self.measure.label,
            band_label=band_text,
            probability_label=_probability_of([curve.limit_state for curve in self.curves]),
            title=title or self.description,
            ax=ax,
            figsize=figsize,
        )


def interval_text(ends: Sequence[float], digits: int) -> str:
    """Write the ends of an interval, to some digits."""
    return " to ".join("infinity" if math.isinf(end) else f"{end:.{digits}g}" for end in ends)


def _is_rotation(limit: float | None) -> bool:
    return limit is not None and math.isfinite(limit)


def _probability_of(limit_states: Sequence[str]) -> str:
    """Say what a probability is of."""
    if [*limit_states] == ["overturning"]:
        return "probability of overturning"
    return f"probability of exceeding {limit_states[0] if len(limit_states) == 1 else 'the limit state'}"


def _shares_seen(curve: FragilityCurve) -> tuple[Floats, Floats, Floats]:
    """Mean intensities, shares and numbers of outcomes of the groups that the fit is tested in."""
    group = lognormal.groups(np.log(curve.intensity), curve.trials)
    held = np.bincount(group, curve.trials).astype(np.float64)
    return np.bincount(group, curve.trials * curve.intensity) / held, np.bincount(group, curve.exceeded) / held, held


def _log_medians(fits: Probit) -> Floats:
    """Logarithms of medians, shape (fits, 1): infinite of a level curve, above one half or below."""
    with np.errstate(divide="ignore", invalid="ignore"):
        sloping = -fits.intercept / fits.slope
    return np.where(fits.slope > 0.0, sloping, np.where(fits.intercept > 0.0, -np.inf, np.inf))[:, None]


def _slopes(fits: Probit) -> Floats:
    return fits.slope[:, None]


def _dispersion(slope: float) -> float:
    """Dispersion of a slope: 0 of a step, infinite of a level curve."""
    if slope >= lognormal.STEEP:
        return 0.0
    return 1.0 / slope if slope > 0.0 else math.inf


def _logarithm(intensity: Floats) -> Floats:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(intensity))
