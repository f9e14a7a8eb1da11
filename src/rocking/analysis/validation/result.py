"""What validation found: scores, reliability, and what was predicted of each test."""

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
    peak_rotation : float
        Measured peak, rad; infinite where the specimen overturned, NaN where none was measured.
    lower, median, upper : float
        The peaks that 5 %, 50 % and 95 % of the blocks that stand stay below or at, rad; NaN where none stands.
    crps : float
        Continuous ranked probability score of the measured peak, rad, among the blocks that stand.
    """

    name: str
    specimen: str
    motion: str
    overturned: bool
    probability: float
    peak_rotation: float
    lower: float
    median: float
    upper: float
    crps: float


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


@dataclass(frozen=True, eq=False, repr=False)
class ModelValidation(DrawnResult, TableResult):
    """Predictions judged against tests; from `validate`.

    Its table has a row for each test. Its figure is the reliability diagram with consistency bands.

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
    unexplained : int
        Number of measured peaks in tests in which no block stands: no score of them is known.
    description, model : str
        What predicted, and by which equation of motion.
    """

    TABLES = ("tests",)

    tests: tuple[JudgedTest, ...]
    brier: Score
    log_loss: Score
    crps: Score | None
    reliability: tuple[ShareInBin, ...]
    reliability_chance: float
    unexplained: int
    description: str
    model: str

    @property
    def scores(self) -> Scores:
        """Accuracy, log loss and Brier score, as of a calibration."""
        return Scores.of([test.probability for test in self.tests], [test.overturned for test in self.tests])

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
            notes.append(f"{counted(self.unexplained, 'peak')} of tests in which no block stands could not be scored")
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
        return "\n".join([*parts, *(f"note: {sentence}" for sentence in self.notes)])

    def _scores(self) -> dict[str, Score]:
        found = {"Brier": self.brier, "log loss": self.log_loss}
        return found if self.crps is None else found | {"CRPS of peaks, rad": self.crps}

    def to_dict(self) -> dict[str, Any]:
        return {
            "description": self.description,
            "model": self.model,
            "brier": asdict(self.brier),
            "log_loss": asdict(self.log_loss),
            named("crps", "rad"): None if self.crps is None else asdict(self.crps),
            "reliability_chance": self.reliability_chance,
            "reliability": [asdict(one) for one in self.reliability],
            "unexplained": self.unexplained,
            "notes": [*self.notes],
            "tests": [_with_units(asdict(test)) for test in self.tests],
        }

    def _frame(self, table: str) -> pd.DataFrame:
        import pandas as pd

        return pd.DataFrame([_with_units(asdict(test)) for test in self.tests])

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.validation import reliability_figure

        columns = ("predicted", "observed", "band_lower", "band_upper")
        return reliability_figure(
            **{name: np.array([getattr(row, name) for row in self.reliability]) for name in columns},
            title=title or as_written(self._headline()),
            ax=ax,
            figsize=figsize,
        )


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
