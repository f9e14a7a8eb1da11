"""`rocking calibrate` and `validate`: the block behind observed outcomes or a measured history, and its predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Final

from cyclopts import Parameter

from rocking.calibration.history import HistoryCalibration, calibrate_history
from rocking.calibration.outcomes import Calibration, checked_outcomes, group_labels
from rocking.calibration.outcomes import calibrate as calibrated
from rocking.calibration.space import HOUSNER
from rocking.calibration.tables import History, read_calibration, read_tests
from rocking.calibration.validate import ShakeTest
from rocking.calibration.validate import validate as judged
from rocking.cli.options import (
    BLOCK,
    MODEL,
    RECORDS,
    WHOLE,
    EnsembleOptions,
    FileOptions,
    ModelOptions,
    ScaledPulseOptions,
)
from rocking.cli.output import OUTPUT, OutputOptions, print_result, write_results, write_tables
from rocking.core.constants import Model
from rocking.core.tables import counted, text_table
from rocking.errors import InvalidOption
from rocking.inputs.quantities import bounds, number, tilt
from rocking.motion.motion import Motion

#: Blocks to try, unless it is said.
_CANDIDATES: Final = 8192


def calibrate(
    data: Path,
    *,
    model: Model = "nonlinear",
    p: str | None = None,
    alpha: str | None = None,
    restitution: str | None = None,
    two_sided: bool | None = None,
    candidates: Annotated[int, WHOLE] = _CANDIDATES,
    folds: Annotated[int, WHOLE] = 0,
    predict: Annotated[tuple[str, ...], Parameter(consume_multiple=True, negative="")] = (),
    motion: str | None = None,
    initial_rotation: str | None = None,
    seed: Annotated[int, WHOLE] = 0,
    file: Annotated[ScaledPulseOptions, RECORDS] = ScaledPulseOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Find the block behind observed outcomes (overturned or not), or behind a measured rotation history.

    DATA is a CSV table with a header. Outcomes: columns motion (a record file, a shipped record, or a pulse) and
    overturned (1 or 0), and where wanted scale, vertical, channel, dt_s, units and group. A history: columns time_s and
    rotation_rad (or rotation_deg). The motions of --predict, --motion and --pulse may be scaled. --out holds
    calibration.png, .pdf, result.json and, of outcomes, ensemble.csv.

    Parameters
    ----------
    data
        CSV table of outcomes or of a history.
    model
        Equation of motion; the linear one is faster, and serves slender specimens.
    p
        Lowest and highest thinkable frequency parameter, rad/s, with a comma between; or a known value.
    alpha
        Likewise the slenderness, as 5deg,20deg or 0.1,0.3 (rad).
    restitution
        Likewise the factor on the angular speed at an impact; of outcomes also housner, to follow from the slenderness
        (of two sides as those of one rectangle).
    two_sided
        Whether the two sides of the block may differ; by default yes for outcomes, no for a history.
    candidates
        Outcomes: blocks to try, about; more where its runs disagree.
    folds
        Outcomes: parts for cross-validation; 0: none. Tests of one group stay together.
    predict
        Outcomes: records to predict, files or names of shipped records; pulses to predict go with --pulse.
    motion
        History: record of the base's motion, or give one --pulse; without either, the block was released and rocked
        freely.
    initial_rotation
        History: rotation at time 0, 2deg or 0.03 (rad); by default fitted in a release test, 0 under a motion.
    seed
        The same seed gives the same result.
    """
    ranges = {
        "p": None if p is None else bounds(p, "p", number),
        "alpha": None if alpha is None else bounds(alpha, "alpha", tilt),
        "restitution": restitution if restitution in (None, HOUSNER) else bounds(restitution, "restitution", number),
    }
    start = None if initial_rotation is None else tilt(initial_rotation, "initial_rotation")
    given: dict[str, Any] = {**ranges, "model": model, "two_sided": two_sided}
    choices = {name: value for name, value in given.items() if value is not None}
    with output.folder() as folder:
        table = read_calibration(data, **file.about())
        others: dict[str, object] = {"motion": motion, "initial_rotation": initial_rotation}
        if isinstance(table, History):
            others = {"predict": predict, "folds": folds, "candidates": candidates != _CANDIDATES}
        for name in [name for name, value in others.items() if value]:
            belong_to = "outcomes" if isinstance(table, History) else "a history"
            raise InvalidOption(f"{{}} is for {belong_to}; the columns of this table are not", name)
        records = predict if motion is None else (motion,)
        motions = _motions(records, file, "motion" if isinstance(table, History) else "predict")
        if isinstance(table, History):
            if len(motions) > 1:
                raise InvalidOption("a history has one motion of the base: give {}, or one {}", "motion", "pulse")
            shaking = next(iter(motions.values()), None)
            history = calibrate_history(
                table.times, table.rotation, shaking, **choices, initial_rotation=start, seed=seed
            )
            results = _Results(history, history.to_dict(), history.summary())
        else:
            results = _of_outcomes(table, motions, folds, {"candidates": candidates, "seed": seed, **choices})
        if folder is not None:
            results.write(folder)
        print_result(results.numbers, results.text, as_json=output.as_json)


@dataclass(frozen=True)
class _Results:
    """A calibration, its numbers and words."""

    found: Calibration | HistoryCalibration
    numbers: dict[str, Any]
    text: str

    def write(self, folder: Path) -> None:
        """Write numbers, and figure and ensemble of a calibration."""
        if isinstance(self.found, Calibration):
            self.found.to_csv(folder / "ensemble.csv")
        write_results(folder, figures={"calibration": self.found.plot}, result=self.numbers)


def _motions(records: Sequence[str], file: ScaledPulseOptions, option: str) -> dict[str, Motion]:
    """Read records and pulses; refuse what is said of motions where there are none."""
    motions = {name: file.motion(name) for name in records} | file.pulses()
    for name in {} if motions else file.given("scale", "pga", "pgv", "sa", "vertical"):
        raise InvalidOption("{} is for the motions of {} or {}: give one, or leave it out", name, option, "pulse")
    return motions


def _of_outcomes(
    tests: Sequence[ShakeTest], others: Mapping[str, Motion], folds: int, choices: Mapping[str, Any]
) -> _Results:
    fell, groups = [test.overturned for test in tests], [test.group for test in tests]
    # Outcomes that cannot be calibrated, and more folds than groups, are refused before the work.
    checked_outcomes(fell, len(tests))
    if folds:
        group_labels(groups, len(tests), folds)
    found = calibrated([test.motion for test in tests], fell, **choices)
    predicted = dict(zip(others, found.predict([*others.values()]), strict=True))
    numbers = {**found.to_dict(), "predicted": predicted}
    parts = [found.summary()]
    if folds:
        scores = found.cross_validate(groups=groups, folds=folds).scores
        numbers["cross_validated"] = asdict(scores)
        parts.append(f"left-out motions: {scores} ({counted(folds, 'fold')})")
    if predicted:
        rows = [(name, float(chance)) for name, chance in predicted.items()]
        parts.append("\n" + text_table(["motion", "probability"], rows))
    return _Results(found, numbers, "\n".join(parts))


def validate(
    tests: Path,
    *,
    lapse: float | None = None,
    bins: Annotated[int, WHOLE] = 10,
    seed: Annotated[int, WHOLE] = 0,
    block: Annotated[EnsembleOptions, BLOCK] = EnsembleOptions(),
    file: Annotated[FileOptions, RECORDS] = FileOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Judge what a block, or the ensemble of a calibration, predicts of tests against what was observed.

    TESTS is a CSV table with a row for each test: motion (a record file beside it, a shipped record, or a pulse), where
    wanted scale, vertical, channel, dt_s and units; overturned (1 or 0); and where wanted name and group (rows with the
    same belong together). --out holds validation.png, .pdf, tests.csv and result.json.

    Parameters
    ----------
    tests
        CSV table of tests.
    lapse
        Chance that an outcome is not that of a rocking block at all; by default 0.
    bins
        Bins of the reliability diagram.
    seed
        Seed of the simulations for bands and chances.
    """
    with output.folder() as folder:
        rows = read_tests(tests, **file.about())
        found = judged(rows, **block.blocks(model), lapse=lapse, bins=bins, seed=seed)
        result = found.to_dict()
        if folder is not None:
            write_tables(folder, found)
            write_results(folder, figures={"validation": found.plot}, result=result)
        print_result(result, found.summary(), as_json=output.as_json)
