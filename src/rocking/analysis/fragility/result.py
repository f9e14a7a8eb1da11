"""Fragility curves against one intensity measure, and all that is made of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking import checks
from rocking.analysis.fragility import nrml
from rocking.analysis.fragility.curve import FragilityCurve, in_units, interval_text, median_text
from rocking.analysis.fragility.lognormal import groups
from rocking.analysis.hazard import HazardCurve
from rocking.analysis.risk import Risk, risk_of
from rocking.analysis.survival import Survival, mean_of_blocks
from rocking.arrays import Floats
from rocking.body import Body
from rocking.constants import STANDARD_GRAVITY, Model
from rocking.errors import InvalidOption, Message
from rocking.motion.scaling import Measure
from rocking.problem import bodies_of
from rocking.progress import spelled
from rocking.result import Result
from rocking.tables import Column, as_written, counted, text_table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Points of a curve in a table or a figure.
_POINTS: Final = 201


@dataclass(frozen=True, eq=False, repr=False)
class Fragility(Result):
    """Fragility curves of one or several limit states against one intensity measure; from `fragility`.

    Its tables are "curves" (limit state, intensity in SI units, probability, lower and upper end of the band) and,
    where blocks were simulated, "outcomes". Its figure has the curves with their bands and the shares that were seen.

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
        overturned, unfinished (its peak_over_alpha is NaN then), whether each limit state was exceeded, and the weight
        of the block where it has one; None where the outcomes were given.
    one_way : bool
        Whether sides that differ met motions in one polarity only: reversed, they do something else.
    with_vertical : bool
        Whether a vertical motion was simulated.
    several_blocks : bool
        Whether outcomes of several blocks count together.
    source : str
        What a cluster of outcomes comes from: a motion, or, where outcomes were given, a cluster.
    undecided : str
        How many outcomes of a sample change within 3e-6 of the motion; empty where outcomes were given.
    missing : str
        How many simulations were given up, which the curves leave out; empty where there are none.
    """

    TABLES = ("curves", "outcomes")

    curves: tuple[FragilityCurve, ...]
    measure: Measure
    description: str
    block: Body | None
    model: Model
    outcomes: pd.DataFrame | None
    one_way: bool = False
    with_vertical: bool = False
    several_blocks: bool = False
    source: str = "motion"
    undecided: str = ""
    missing: str = ""

    def summary(self) -> str:
        scale = self.measure.scale
        rows = [
            [
                curve.limit_state,
                f"{curve.exceeded.sum():.0f} of {curve.trials.sum():.0f}",
                scale * curve.median,
                median_text(curve, scale),
                curve.dispersion,
                interval_text(curve.dispersion_interval, 3),
                float(f"{curve.goodness.p_value:.2g}"),
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
        notes = [text for text in (self.missing, self.undecided) if text]
        if self.one_way:
            notes.append(
                "the sides differ, and motions came in one polarity only: reversed ones give another curve; "
                + spelled(Message('{} "both" counts both', ("polarity",)))
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
        return "likelihood" if math.isnan(self.curves[0].degenerate) else "bootstrap"

    def _headline(self) -> str:
        curves = ", ".join(
            f"{one.limit_state}: median {in_units(one.median, self.measure)}, dispersion {one.dispersion:.3g}"
            for one in self.curves
        )
        return f"{self.description}; {self.measure.label}; {curves}"

    def curve(self, limit_state: str) -> FragilityCurve:
        """Curve of a limit state.

        Parameters
        ----------
        limit_state : str
            Its name.

        Returns
        -------
        FragilityCurve
            Its curve.

        Raises
        ------
        InvalidOption
            If there is none of that name.

        Examples
        --------
        >>> from rocking import fit_fragility
        >>> fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trials=4).curve("overturning").clusters
        16
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
        return risk_of(self.curves, hazard, self.measure, self.description)

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
        curve = self.curve(limit_state)
        rate = None if hazard is None else self.annual_rate(hazard).rate(limit_state)
        mean = math.nan
        if hazard is not None and self.several_blocks and self.outcomes is not None:
            mean = mean_of_blocks(self.outcomes, self.measure.column, limit_state, hazard, years)
        return Survival(
            curve, self.measure, self.description, years, confidence, hazard, rate, self.several_blocks, mean
        )

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest intensity of the data, in SI units or a block's own."""
        held = np.concatenate([curve.intensity for curve in self.curves])
        return float(held.min()), float(held.max())

    def _columns(self, table: str) -> list[Column]:
        if table == "curves":
            at = np.linspace(0.0, self.range[1], _POINTS)
            values = np.concatenate([[at, curve.probability(at), *curve.band(at)] for curve in self.curves], axis=1)
            names = [curve.limit_state for curve in self.curves for _ in at]
            columns = zip((self.measure.column, "probability", "lower", "upper"), values, strict=True)
            return [Column("limit_state", names), *(Column(name, column) for name, column in columns)]
        if self.outcomes is None:
            raise InvalidOption("this fragility was fitted to given outcomes: there are no simulations to write")
        return [Column(str(name), self.outcomes[name]) for name in self.outcomes]

    def to_nrml(
        self,
        path: str | Path,
        *,
        taxonomy: str = "rocking-block",
        format: nrml.Format = "continuous",
        block: Body | None = None,
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
            If a name has a character that NRML does not allow, a block is needed, a spectral acceleration is of another
            damping than 5 % of critical, which OpenQuake's are of, or the dispersion is too wide.
        OutputError
            If the file cannot be written.

        Notes
        -----
        Units become OpenQuake's: PGA and SA in g, PGV in cm/s. A measure in a block's own unit becomes PGA or PGV of
        that block. The range of validity is that of the data. A block cannot move below its uplift acceleration, which
        is written as the limit of no damage of PGA, unless a vertical motion was simulated, which lowers it.

        Examples
        --------
        >>> import tempfile
        >>> from rocking import fit_fragility
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     fit_fragility([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 4], trials=4).to_nrml(f"{folder}/model.xml")
        """
        chosen = self.block
        if block is not None:
            bodies_of(block)
            chosen = block
        scale = nrml.scale_of(self.measure, chosen, self.model)
        lifting = None
        if chosen is not None and scale.imt == "PGA" and not self.with_vertical:
            lifting = min(chosen.uplift_thresholds(self.model)) / STANDARD_GRAVITY
        function = nrml.fragility_function(self.curves, scale, self.range, lifting, taxonomy, format)
        states = [curve.limit_state for curve in self.curves]
        about = {"id": model_id, "assetCategory": asset_category, "lossCategory": loss_category}
        nrml.write(path, function, states, self.description, **about)

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import FragilityLine, fragility_figure

        first = self.curves[0]
        band_text = f"band: {100 * first.confidence:g} % confidence ({self.band_kind})"
        if not first.bounded:
            band_text = f"no band: {self._too_few()}"

        intensity, scale = np.linspace(0.0, self.range[1], _POINTS), self.measure.scale
        lines = []
        for curve in self.curves:
            at, seen, outcomes = _shares_seen(curve)
            is_rotation = curve.limit is not None and math.isfinite(curve.limit)
            limit = f" (rotation of {curve.limit:g} of the slenderness)" if is_rotation else ""
            at_half = f"median {in_units(curve.median, self.measure)}, dispersion {curve.dispersion:.3g}"
            text = f"{curve.limit_state}{limit}: {at_half}"
            chance = curve.probability(intensity)
            band = curve.band(intensity) if curve.bounded else (chance, chance)
            lines.append(FragilityLine(text, scale * intensity, chance, *band, scale * at, seen, outcomes))
        return fragility_figure(
            lines=lines,
            intensity_label=self.measure.label,
            band_label=band_text,
            probability_label=_probability_of([curve.limit_state for curve in self.curves]),
            title=title or as_written(self.description),
            ax=ax,
            figsize=figsize,
        )


def _probability_of(limit_states: Sequence[str]) -> str:
    """Say what a probability is of."""
    if [*limit_states] == ["overturning"]:
        return "probability of overturning"
    return f"probability of exceeding {limit_states[0] if len(limit_states) == 1 else 'the limit state'}"


def _shares_seen(curve: FragilityCurve) -> tuple[Floats, Floats, Floats]:
    """Mean intensities, shares and numbers of outcomes of the groups that the fit is tested in."""
    group = groups(np.log(curve.intensity), curve.trials)
    held = np.bincount(group, curve.trials).astype(np.float64)
    return np.bincount(group, curve.trials * curve.intensity) / held, np.bincount(group, curve.exceeded) / held, held
