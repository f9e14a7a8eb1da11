"""What a calibration from outcomes found, and what it predicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from dataclasses import asdict, astuple, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.analysis.calibration.diagnostics import Diagnostics, Scores
from rocking.analysis.calibration.evidence import Evidence as _Evidence
from rocking.analysis.calibration.evidence import blurred, expected_share
from rocking.analysis.calibration.search import posterior
from rocking.analysis.calibration.space import unit_of
from rocking.analysis.fragility.fit import fragility
from rocking.analysis.fragility.result import Fragility
from rocking.analysis.labels import groups_of
from rocking.analysis.levels import note_missing
from rocking.analysis.spectrum import RockingSpectrum, rocking_spectrum
from rocking.arrays import Flags, Floats
from rocking.block import Blocks
from rocking.constants import Model
from rocking.ensemble import simulate_many
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.motion.named import Motions
from rocking.result import Result
from rocking.tables import Column, as_written, counted, text_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rocking.plot.curves import Parameter

#: Rounds of moves of draws from the posterior over populations, and draws for a fit without a fold.
ROUNDS: Final = 4
_DRAWS: Final = 256


@dataclass(frozen=True)
class Estimate:
    """One parameter of the population of blocks.

    Attributes
    ----------
    median, lower, upper : float
        Median and central 90 % interval of the population's centre, in the parameter's unit.
    dispersion : float
        Standard deviation of the parameter's logarithm from test to test.
    """

    median: float
    lower: float
    upper: float
    dispersion: float


@dataclass(frozen=True, eq=False)
class Validation:
    """Predictions for tests that were left out of the fit.

    Attributes
    ----------
    probabilities : ndarray, shape (repeats, m)
        Probability of overturning for each test, from the fit to the folds without it.
    repeats : tuple of Scores
        Scores of each repeat.
    """

    probabilities: Floats
    repeats: tuple[Scores, ...]

    def __repr__(self) -> str:
        repeats, tests = self.probabilities.shape
        times = "once" if repeats == 1 else f"{repeats} times"
        return f"<Validation: {counted(tests, 'test')}, each left out {times}: {self.scores}>"

    @property
    def scores(self) -> Scores:
        """Mean scores of the repeats."""
        return Scores(*np.mean([astuple(one) for one in self.repeats], axis=0).tolist())


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Result):
    """Blocks that explain which motions overturned a specimen, and what they predict.

    Made by `calibrate`. Its table "ensemble" has a row for each block: parameters of both sides, weight, and the
    equation of motion; `rocking fragility --ensemble` and its like read it. Its figure has what happened against the
    fitted probability of every test, and the ensemble of blocks.

    Attributes
    ----------
    blocks : Blocks
        Ensemble of plausible blocks, n of them.
    weights : ndarray, shape (n,)
        Their weights; they sum to 1.
    estimates : mapping of str to Estimate
        The population's parameters: "p" (rad/s), "restitution", and "alpha" (rad), of a two-sided block
        "alpha_plus" and "alpha_minus".
    draws : mapping of str to ndarray, shape (d,)
        Draws of the posterior of the population's centre, by the same names.
    probabilities : ndarray, shape (m,)
        Fitted probability of overturning under each of the motions of the calibration.
    observed : ndarray of bool, shape (m,)
        What happened.
    model : str
        Equation of motion.
    lapse : float
        Chance that an outcome is not that of a rocking block at all.
    seed : int
        What the search started from.
    diagnostics : Diagnostics
        How far this can be trusted: effective candidates, agreement of runs, bounds that the posterior
        reaches. Its `notes` say what is to be known before the estimates are believed; they are in the summary.
    """

    TABLES = ("ensemble",)

    blocks: Blocks
    weights: Floats
    estimates: Mapping[str, Estimate]
    draws: Mapping[str, Floats]
    probabilities: Floats
    observed: Flags
    model: Model
    lapse: float
    seed: int
    diagnostics: Diagnostics
    _evidence: _Evidence = field(repr=False)

    @property
    def scores(self) -> Scores:
        """Scores on the motions of the calibration itself: too good by nature, see `cross_validate`."""
        return Scores.of(self.probabilities, self.observed)

    @property
    def dispersion(self) -> Mapping[str, float]:
        """Standard deviation of each parameter's logarithm from test to test."""
        return {name: estimate.dispersion for name, estimate in self.estimates.items()}

    def predict(self, motions: Motions, *, threads: int | None = None, progress: bool | None = None) -> Floats:
        """Probability that each motion overturns the specimen.

        Parameters
        ----------
        motions : Motion or sequence of Motion
            m motions.
        threads : int, optional
            As for `simulate_many`.
        progress : bool, optional
            As for `simulate_many`.

        Returns
        -------
        ndarray, shape (m,)
            Weighted share of the ensemble that overturns, within the lapse of 0 and 1.

        Raises
        ------
        InvalidMotion
            If one is no motion.

        Examples
        --------
        >>> import rocking
        >>> pulses = [rocking.pulses.one_sine(a, 1.0) for a in (2.0, 3.0, 4.0, 5.0)]
        >>> found = rocking.calibrate(pulses, [0, 0, 1, 1], p=2.0, restitution=0.9, two_sided=False, candidates=128)
        >>> bool(found.predict(rocking.pulses.one_sine(9.0, 1.0))[0] > 0.5)
        True
        """
        if isinstance(motions, Sized) and not isinstance(motions, Motion) and not len(motions):
            return np.empty(0)
        outcomes = overturned_under(self.blocks, motions, self.model, threads, progress)
        return blurred(expected_share(self.weights @ outcomes, self.diagnostics.effective), self.lapse)

    def cross_validate(
        self,
        *,
        groups: Sequence[object] | None = None,
        folds: int = 10,
        repeats: int = 1,
        seed: int = 0,
        threads: int | None = None,
        progress: bool | None = None,
    ) -> Validation:
        """Predict every test from fits without it.

        The candidates' simulations are used again, so a fold costs a second; the fit is made anew for each.

        Parameters
        ----------
        groups : sequence, optional
            One label for each motion: tests with the same label are left out together, as they should be where one
            source motion was scaled several times.
        folds, repeats : int
            Number of parts, and of random divisions into parts.
        seed : int
            Seeds the divisions.
        threads : int, optional
            As for `simulate_many`; it changes no result.
        progress : bool, optional
            As for `simulate_many`.

        Returns
        -------
        Validation
            Probabilities of all tests in each division, and their scores.

        Raises
        ------
        InvalidOption
            If there are fewer groups than folds, or labels do not match the motions.

        See Also
        --------
        rocking.analysis.Scores : accuracy, log loss and Brier score.

        Examples
        --------
        >>> import rocking
        >>> pulses = [rocking.pulses.one_sine(a, 1.0) for a in (2.0, 3.0, 4.0, 5.0)]
        >>> found = rocking.calibrate(pulses, [0, 0, 1, 1], p=2.0, restitution=0.9, two_sided=False, candidates=128)
        >>> found.cross_validate(folds=2).probabilities.shape
        (1, 4)
        """
        labels = group_labels(groups, len(self.observed), folds)
        rng = np.random.default_rng(checks.whole(seed, "seed", InvalidOption, 0))
        count = None if threads is None else checks.whole(threads, "threads", InvalidOption, 1)
        evidence = replace(self._evidence, threads=count)
        probabilities = np.empty((checks.whole(repeats, "repeats", InvalidOption, 1), len(self.observed)))
        for row in probabilities:
            parts = rng.permutation(np.arange(labels.max() + 1) % folds)[labels]
            for part in range(folds):
                left_out = parts == part
                kept, wanted = evidence.of_tests(~left_out), evidence.of_tests(left_out)
                drawn = posterior(kept, _DRAWS, ROUNDS, rng, progress=progress)
                row[left_out] = wanted.probabilities(drawn).mean(axis=0)
        return Validation(probabilities, tuple(Scores.of(row, self.observed) for row in probabilities))

    def fragility(self, motions: Motions, *, model: Model | None = None, **options: Any) -> Fragility:
        """Fit the specimen's fragility: the ensemble with its weights, in the equation of motion of the calibration.

        Parameters
        ----------
        motions : Motion, sequence of Motion, or mapping of str to Motion
            m motions.
        model : {"linear", "nonlinear"}, optional
            Equation of motion, if not that of the calibration.
        **options : object
            Further arguments of `rocking.fragility`: measure, levels, limits, polarity, band, ...

        Returns
        -------
        Fragility
            What is not known of the block, and how it differs from test to test, widens the curve; its band is that of
            the motions. The lapse of `predict`, chance that a test is not that of a rocking block at all, is not in it:
            a weak motion does not overturn what it cannot lift.

        Raises
        ------
        InvalidOption, InvalidMotion
            As `rocking.fragility`.

        Examples
        --------
        >>> import rocking
        >>> pulses = [rocking.pulses.one_sine(a, 1.0) for a in (2.0, 3.0, 4.0, 5.0)]
        >>> found = rocking.calibrate(pulses, [0, 0, 1, 1], p=2.0, restitution=0.9, two_sided=False, candidates=128)
        >>> found.fragility(pulses, levels=[2.0, 3.0, 4.0, 6.0]).model
        'nonlinear'
        """
        chosen = self.model if model is None else model
        return fragility(self.blocks, motions, weights=self.weights, model=chosen, **options)

    def spectrum(self, motions: Motions, *, model: Model | None = None, **options: Any) -> RockingSpectrum:
        """Peak rotation of the specimen, and of larger and smaller ones of its shape, with the ensemble's weights.

        Parameters
        ----------
        motions : Motion, sequence of Motion, or mapping of str to Motion
            m motions.
        model : {"linear", "nonlinear"}, optional
            Equation of motion, if not that of the calibration.
        **options : object
            Further arguments of `rocking.rocking_spectrum`: p (rad/s, to which the ensemble's median is moved; by
            default half to twice its own) or size, fractiles, ...

        Returns
        -------
        RockingSpectrum
            Fractiles of the motions and of the ensemble's weight together.

        Raises
        ------
        InvalidOption, InvalidMotion
            As `rocking.rocking_spectrum`.

        Examples
        --------
        >>> import rocking
        >>> pulses = [rocking.pulses.one_sine(a, 1.0) for a in (2.0, 3.0, 4.0, 5.0)]
        >>> found = rocking.calibrate(pulses, [0, 0, 1, 1], p=2.0, restitution=0.9, two_sided=False, candidates=128)
        >>> found.spectrum(pulses, p=[1.0, 2.0]).data.sizes["p"]
        2
        """
        chosen = self.model if model is None else model
        return rocking_spectrum(self.blocks, motions, weights=self.weights, model=chosen, **options)

    def _headline(self) -> str:
        overturned = int(self.observed.sum())
        return f"{counted(len(self.observed), 'motion')}, {overturned} overturned the specimen; {self.model} model"

    def summary(self) -> str:
        rows = [
            [name, one.median, one.lower, one.upper, f"{100 * one.dispersion:.0f} %", unit_of(name)]
            for name, one in self.estimates.items()
        ]
        alike = 1.0 / float((self.weights**2).sum())
        table = text_table(["parameter", "median", "5 %", "95 %", "dispersion", "unit"], rows)
        ensemble = f"ensemble of {counted(len(self.blocks), 'block')}, equivalent to {alike:.0f} of equal weight"
        return f"{self._headline()}\n\n{table}\n\n{ensemble}\nfitted motions: {self.scores}\n{self.diagnostics}"

    def to_dict(self) -> dict[str, Any]:
        known = self.diagnostics
        lists = {"bounds_reached": [asdict(one) for one in known.bounds_reached], "notes": [*known.notes]}
        return {
            "model": self.model,
            "motions": len(self.observed),
            "overturned": int(self.observed.sum()),
            "estimates": {name: asdict(one) for name, one in self.estimates.items()},
            "fitted": asdict(self.scores),
            "diagnostics": asdict(known) | lists,
            "probabilities": self.probabilities,
        }

    def _columns(self, table: str) -> list[Column]:
        columns = [
            Column(f"{name}_{side}", getattr(self.blocks, name)[:, k], unit)
            for name, unit in (("p", "rad/s"), ("alpha", "rad"), ("restitution", "1"))
            for k, side in enumerate(("plus", "minus"))
        ]
        return [*columns, Column("weight", self.weights), Column("model", [self.model] * len(self.weights))]

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.curves import outcomes_figure

        return outcomes_figure(
            probabilities=self.probabilities,
            overturned=self.observed,
            parameters=[self._parameter(name) for name in self._evidence.candidates.space.unknown],
            weights=self.weights,
            title=title or as_written(self._headline()),
            ax=ax,
            figsize=figsize,
        )

    def _parameter(self, name: str) -> Parameter:
        """One parameter for a figure: of both sides where they may differ."""
        from rocking.plot.curves import Parameter

        estimates = [one for key, one in self.estimates.items() if key.partition("_")[0] == name]
        values = getattr(self.blocks, name)[:, : len(estimates)]
        ends = np.array([(one.median, one.lower, one.upper) for one in estimates])
        space = self._evidence.candidates.space
        low, high = (float(np.exp(end[space.unknown.index(name)])) for end in (space.lower, space.upper))
        return Parameter({"p": "p (rad/s)", "alpha": "alpha (rad)"}.get(name, name), values, ends, (low, high))

    def __repr__(self) -> str:
        return f"<Calibration: {self._headline()}; fitted: {self.scores}>"


def overturned_under(
    blocks: Blocks, motions: Motions, model: Model, threads: int | None, progress: bool | None
) -> NDArray[np.float32]:
    """1 where a block overturns under a motion, else 0, and 0.5 where the simulation was given up; shape (n, m)."""
    simulated = simulate_many(blocks, motions, model=model, threads=threads, progress=progress)
    note_missing(simulated.unfinished.values)
    known = simulated.overturned.astype(np.float32).where(~simulated.unfinished, np.float32(0.5))
    return np.asarray(known.transpose("block", "motion").values, dtype=np.float32)


def group_labels(groups: Sequence[object] | None, count: int, folds: int) -> NDArray[np.int64]:
    """Give each group a number from 0; without groups each motion is its own."""
    labels = groups_of(range(count) if groups is None else groups, "groups", count)
    checks.whole(folds, "folds", InvalidOption, 2, int(labels.max()) + 1)
    return labels
