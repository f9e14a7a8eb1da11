"""What validation found: scores, reliability, ranks of peaks, repetitions, and the tests that surprise most."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.analysis.calibration.diagnostics import Scores
from rocking.analysis.validation.scores import Score
from rocking.result import DrawnResult, TableResult
from rocking.tables import as_written, counted, named, text_table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Tests in a summary that surprise most.
_SURPRISING: Final = 5

#: A chance below this is doubted in the summary.
_DOUBTED: Final = 0.05

_IN_RADIANS: Final = ("peak_rotation", "lower", "median", "upper", "crps")


@dataclass(frozen=True)
class JudgedTest:
    """What was predicted of one test, and what was observed.

    Attributes
    ----------
    name, specimen, motion : str
        Names of the test, of the specimen, and of the motion.
    overturned : bool
        Whether it overturned.
    probability : float
        Predicted probability of that.
    blocks : float
        Number of blocks, effectively, that the probability comes from; infinite where one block is taken as known, NaN
        where only probabilities were given.
    peak_rotation : float
        Measured peak, rad; infinite where the specimen overturned, NaN where none was measured.
    lower, median, upper : float
        The peaks that 5 %, 50 % and 95 % of the blocks that stand stay below or at, rad; NaN where none stands.
    crps : float
        Continuous ranked probability score of the measured peak, rad, among the blocks that stand.
    pit_lower, pit_upper : float
        Between which the share of the standing blocks with a smaller peak lies: probability integral transform.
    chance : float
        Probability that was given to the outcome; with a measured peak, no more than that of one as far from the
        middle of the prediction.
    """

    name: str
    specimen: str
    motion: str
    overturned: bool
    probability: float
    blocks: float
    peak_rotation: float
    lower: float
    median: float
    upper: float
    crps: float
    pit_lower: float
    pit_upper: float
    chance: float


@dataclass(frozen=True)
class ShareInBin:
    """A share of tests that was observed, and the band that it stays in where predictions are right.

    Attributes
    ----------
    lower, upper : float
        Ends of the bin.
    tests : int
        Number of tests that the share is of.
    predicted : float
        Predicted share.
    observed : float
        Observed share.
    band_lower, band_upper : float
        Ends of the central 90 % of the shares in simulations from the predictions (Broecker and Smith 2007).
    """

    lower: float
    upper: float
    tests: int
    predicted: float
    observed: float
    band_lower: float
    band_upper: float


@dataclass(frozen=True)
class Repeatability:
    """How much repetitions of one test differ: observed, and as the blocks would have it.

    Of outcomes, the share of pairs of repetitions of which one overturned and one did not; of peaks their standard
    deviation, rad. Both are pooled: a set of n repetitions counts n - 1.

    Attributes
    ----------
    sets, tests : int
        Number of sets of repetitions, and of tests in them.
    observed : float
        What was observed.
    expected : float
        What is expected where each test has a block of its own.
    lower, upper : float
        Central 90 % of that.
    same_block : float
        What is expected where one block is in all tests of a set: what is left is what the motions, and the measured
        peaks, differ by. 0 of outcomes under one motion, as of a perfect table. NaN where only probabilities were
        given.
    """

    sets: int
    tests: int
    observed: float
    expected: float
    lower: float
    upper: float
    same_block: float

    @property
    def sizes(self) -> str:
        """How many tests in how many sets, in words."""
        return f"{counted(self.tests, 'test')} in {counted(self.sets, 'set')}"

    @property
    def expectation(self) -> str:
        """What is expected, in words."""
        own = f"expected {self.expected:.2g} ({self.lower:.2g} to {self.upper:.2g}) with a block of its own in each"
        return own if math.isnan(self.same_block) else f"{own}, {self.same_block:.2g} with one block in all of a set"


@dataclass(frozen=True, eq=False, repr=False)
class ModelValidation(DrawnResult, TableResult):
    """Predictions judged against tests; from `validate`.

    Its tables are "tests" (a row for each), "reliability" and "ranks" (a row for each bin). Its figure is the
    reliability diagram with consistency bands; where peaks were measured, also those against their predictions, and how
    they rank among them.

    Attributes
    ----------
    tests : tuple of JudgedTest
        Predictions and observations.
    brier, log_loss : Score
        Mean squared difference between probability and outcome; mean of -log of the probability of the outcome.
    crps : Score or None
        Mean continuous ranked probability score of measured peaks, rad; None where there are none.
    reliability : tuple of ShareInBin
        Shares that overturned, in bins of the predicted probability that hold tests.
    reliability_chance : float
        Chance of a reliability term of the Brier score as large or larger where the predictions are right.
    ranks : tuple of ShareInBin
        Shares of the measured peaks in bins of their ranks; empty where there are none.
    ranks_chance : float
        Chance of ranks as uneven or more where the predictions are right.
    coverage : float
        Share of the measured peaks within the central 90 % of the blocks that stand.
    unexplained : int
        Number of measured peaks in tests in which no block stands: no rank or score of them is known.
    repeated_outcomes, repeated_peaks : Repeatability or None
        Repetitions; None where there are none.
    description, model, one_block_in : str
        What predicted, by which equation of motion, and in which tests a block is one and the same.
    """

    TABLES = ("tests", "reliability", "ranks")

    tests: tuple[JudgedTest, ...]
    brier: Score
    log_loss: Score
    crps: Score | None
    reliability: tuple[ShareInBin, ...]
    reliability_chance: float
    ranks: tuple[ShareInBin, ...]
    ranks_chance: float
    coverage: float
    unexplained: int
    repeated_outcomes: Repeatability | None
    repeated_peaks: Repeatability | None
    description: str
    model: str
    one_block_in: str

    @property
    def scores(self) -> Scores:
        """Accuracy, log loss and Brier score, as of a calibration."""
        return Scores.of([test.probability for test in self.tests], [test.overturned for test in self.tests])

    @property
    def surprising(self) -> tuple[JudgedTest, ...]:
        """The tests, those first of which the prediction gave the least chance to what was observed."""
        return tuple(sorted(self.tests, key=lambda test: test.chance))

    @property
    def notes(self) -> tuple[str, ...]:
        """What is to be known before the scores are believed, a sentence each."""
        notes = []
        fell = sum(test.overturned for test in self.tests)
        if fell in (0, len(self.tests)):
            all_or_none = "all tests" if fell else "no test"
            notes.append(f"{all_or_none} overturned the specimen: the base rate is perfect, and no skill is known")
        if self.brier.clusters < 10:
            few = counted(self.brier.clusters, "cluster")
            notes.append(f"the tests belong to {few} only: standard errors are rough")
        if math.isinf(self.log_loss.value):
            notes.append("the log loss is infinite, as a certainty failed: give what is not known of the specimen")
        if self.unexplained:
            notes.append(f"{counted(self.unexplained, 'peak')} of tests in which no block stands could not be ranked")
        return tuple(notes)

    def _headline(self) -> str:
        fell = sum(test.overturned for test in self.tests)
        peaks = sum(math.isfinite(test.peak_rotation) for test in self.tests)
        measured = f", {counted(peaks, 'measured peak')}" if peaks else ""
        by = f", {self.model} model" if self.model else ""
        return f"{self.description}{by}: {counted(len(self.tests), 'test')}, {fell} overturned{measured}"

    def summary(self) -> str:
        scores = [
            [name, *_with_error(score.value, score.error), *_with_error(score.skill, score.skill_error)]
            for name, score in self._scores().items()
        ]
        parts = [
            self._headline(),
            "",
            text_table(["score", "mean", "+-", "skill", "+-"], scores),
            "",
            f"reliability: {_said(self.reliability_chance)}",
        ]
        if self.ranks:
            parts.append(f"ranks of peaks: {_said(self.ranks_chance)}; 90 % intervals hold {100 * self.coverage:.0f} %")
        for what, one, unit in (
            ("outcomes differ in a share of", self.repeated_outcomes, ""),
            ("peaks have a standard deviation of", self.repeated_peaks, " rad"),
        ):
            if one is not None:
                parts.append(f"repetitions, {one.sizes}: {what} {one.observed:.3g}{unit}")
                parts.append(f"  {one.expectation}")
        rows = [
            [test.name, test.specimen, "overturned" if test.overturned else "stood", test.probability, test.chance]
            for test in self.surprising[:_SURPRISING]
        ]
        parts += ["", text_table(["most surprising", "specimen", "it", "predicted to overturn", "chance"], rows)]
        return "\n".join([*parts, *(f"note: {sentence}" for sentence in self.notes)])

    def _scores(self) -> dict[str, Score]:
        found = {"Brier": self.brier, "log loss": self.log_loss}
        return found if self.crps is None else found | {"CRPS of peaks, rad": self.crps}

    def to_dict(self) -> dict[str, Any]:
        return {
            "description": self.description,
            "model": self.model,
            "one_block_in": self.one_block_in,
            "brier": asdict(self.brier),
            "log_loss": asdict(self.log_loss),
            named("crps", "rad"): None if self.crps is None else asdict(self.crps),
            "reliability_chance": self.reliability_chance,
            "reliability": [asdict(one) for one in self.reliability],
            "ranks_chance": self.ranks_chance,
            "ranks": [asdict(one) for one in self.ranks],
            "coverage": self.coverage,
            "unexplained": self.unexplained,
            "repeated_outcomes": None if self.repeated_outcomes is None else asdict(self.repeated_outcomes),
            named("repeated_peaks", "rad"): None if self.repeated_peaks is None else asdict(self.repeated_peaks),
            "notes": [*self.notes],
            "tests": [_with_units(asdict(test)) for test in self.tests],
        }

    def _frame(self, table: str) -> pd.DataFrame:
        import pandas as pd

        if table == "tests":
            return pd.DataFrame([_with_units(asdict(test)) for test in self.tests])
        rows = self.reliability if table == "reliability" else self.ranks
        return pd.DataFrame([asdict(row) for row in rows], columns=[*ShareInBin.__annotations__])

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.validation import Bars, PeaksPlot, validation_figure

        measured = [test for test in self.tests if math.isfinite(test.peak_rotation)]
        peaks = None
        if measured:
            columns = [[getattr(test, name) for test in measured] for name in _IN_RADIANS[:-1]]
            peaks = PeaksPlot(*(np.array(column) for column in columns))
        return validation_figure(
            reliability=_bars(Bars, self.reliability),
            probabilities=np.array([test.probability for test in self.tests]),
            overturned=np.array([test.overturned for test in self.tests]),
            ranks=_bars(Bars, self.ranks) if self.ranks else None,
            peaks=peaks,
            title=title or as_written(self._headline()),
            ax=ax,
            figsize=figsize,
        )


def _bars(kind: Any, rows: tuple[ShareInBin, ...]) -> Any:
    """Columns of bins for a figure."""
    return kind(*(np.array([getattr(row, name) for row in rows]) for name in ShareInBin.__annotations__))


def _with_units(row: dict[str, Any]) -> dict[str, Any]:
    return {named(name, "rad" if name in _IN_RADIANS else "1"): value for name, value in row.items()}


def _with_error(value: float, error: float) -> tuple[str, str]:
    """Value and standard error as text, to two digits of the error."""
    if not (math.isfinite(value) and math.isfinite(error)):
        if math.isinf(value):
            return ("infinite" if value > 0.0 else "-infinite"), "-"
        return ("-" if math.isnan(value) else f"{value:.3g}"), "-"
    digits = 3 if error == 0.0 else max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{digits}f}", f"{error:.{digits}f}"


def _said(chance: float) -> str:
    verdict = "not as if the predictions were right" if chance < _DOUBTED else "as if the predictions were right"
    return f"{verdict} (p = {chance:.2g})"
