"""`rocking calibrate` and `validate`: estimate a block from outcomes or a rotation history, and test predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Final

from cyclopts import Parameter

from rocking.calibration.history import HistoryCalibration, calibrate_history
from rocking.calibration.outcomes import Calibration, check_outcomes, label_groups
from rocking.calibration.outcomes import calibrate as run_calibration
from rocking.calibration.space import HOUSNER
from rocking.calibration.tables import MeasuredHistory, read_calibration, read_tests
from rocking.calibration.validate import ShakeTest
from rocking.calibration.validate import validate as run_validation
from rocking.cli.options import (
    BLOCK_OPTIONS,
    MODEL_OPTIONS,
    READ_INTEGER,
    RECORD_OPTIONS,
    EnsembleOptions,
    FileOptions,
    ModelOptions,
    ScaledPulseOptions,
)
from rocking.cli.output import OUTPUT_OPTIONS, OutputOptions, print_result, write_results, write_tables
from rocking.core.constants import Model
from rocking.core.tables import format_count, format_table
from rocking.errors import OptionError
from rocking.inputs.quantities import read_bounds, read_number, read_tilt
from rocking.motion.motion import Motion

#: Default number of candidate blocks.
_DEFAULT_CANDIDATE_COUNT: Final = 8192


def calibrate(
    data: Path,
    *,
    model: Model = "nonlinear",
    p: str | None = None,
    alpha: str | None = None,
    restitution: str | None = None,
    two_sided: bool | None = None,
    candidate_count: Annotated[int, READ_INTEGER] = _DEFAULT_CANDIDATE_COUNT,
    fold_count: Annotated[int, READ_INTEGER] = 0,
    predict: Annotated[tuple[str, ...], Parameter(consume_multiple=True, negative="")] = (),
    motion: str | None = None,
    initial_rotation: str | None = None,
    seed: Annotated[int, READ_INTEGER] = 0,
    file_options: Annotated[ScaledPulseOptions, RECORD_OPTIONS] = ScaledPulseOptions(),
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Estimate the block from observed outcomes (overturned or not) or from a measured rotation history.

    DATA is a CSV table with a header. Columns for outcomes: motion (a record file, a shipped record, or a pulse),
    overturned (1 or 0), and optionally scale, vertical, channel, dt_s, units and group. Columns for a history: time_s
    and rotation_rad (or rotation_deg). The motions of --predict, --motion and --pulse may be scaled. --out contains
    calibration.png, .pdf, result.json and, for outcomes, ensemble.csv.

    Parameters
    ----------
    data
        CSV table of outcomes or of a history.
    model
        Equation of motion. The linear one is faster and suits slender specimens.
    p
        Lowest and highest plausible frequency parameter, rad/s, separated by a comma; or a known value.
    alpha
        Likewise the slenderness, for example 5deg,20deg or 0.1,0.3 (rad).
    restitution
        Likewise the coefficient of restitution; for outcomes also housner, which computes it from the slenderness (two
        sides are treated as one rectangle).
    two_sided
        Whether the two sides of the block may differ. By default yes for outcomes, no for a history.
    candidate_count
        Outcomes: approximate number of blocks to try. More are tried if the runs disagree.
    fold_count
        Outcomes: number of folds for cross-validation; 0: none. Tests of one group stay together.
    predict
        Outcomes: records to predict, files or names of shipped records. Use --pulse for pulses.
    motion
        History: record of the base's motion, or use one --pulse; without either, the block was released and rocked
        freely.
    initial_rotation
        History: rotation at time 0, 2deg or 0.03 (rad). By default fitted for a release test, 0 under a motion.
    seed
        Seed of the random numbers. The same seed reproduces the result.
    """
    texts = {"p": (p, read_number), "alpha": (alpha, read_tilt), "restitution": (restitution, read_number)}
    arguments: dict[str, Any] = {"model": model} | ({} if two_sided is None else {"two_sided": two_sided})
    for name, (text, reader) in texts.items():
        if text is not None:
            arguments[name] = HOUSNER if text == HOUSNER else read_bounds(text, name, reader)
    rotation = None if initial_rotation is None else read_tilt(initial_rotation, "initial_rotation")
    with output_options.folder() as folder:
        table = read_calibration(data, **file_options.read_options())
        conflicting: dict[str, object] = {"motion": motion, "initial_rotation": initial_rotation}
        if isinstance(table, MeasuredHistory):
            conflicting = {
                "predict": predict,
                "fold_count": fold_count,
                "candidate_count": candidate_count != _DEFAULT_CANDIDATE_COUNT,
            }
        for name in [name for name, value in conflicting.items() if value]:
            kinds = ("outcomes", "a history") if isinstance(table, MeasuredHistory) else ("a history", "outcomes")
            raise OptionError(f"{{}} requires a table of {kinds[0]}, but this table contains {kinds[1]}", name)
        records = predict if motion is None else (motion,)
        motions = _read_motions(records, file_options, "motion" if isinstance(table, MeasuredHistory) else "predict")
        if isinstance(table, MeasuredHistory):
            if len(motions) > 1:
                message = "a history requires a single motion of the base; use {}, or one {}"
                raise OptionError(message, "motion", "pulse")
            arguments |= {"motion": next(iter(motions.values()), None), "initial_rotation": rotation, "seed": seed}
            result: Calibration | HistoryCalibration = calibrate_history(table.times, table.rotation, **arguments)
            numbers, text = result.to_dict(), result.summary()
        else:
            # Invalid outcomes, and more folds than groups, are rejected before the computation.
            overturned = check_outcomes([test.overturned for test in table], len(table)).tolist()
            if fold_count:
                label_groups([test.group for test in table], len(table), fold_count)
            arguments |= {"candidate_count": candidate_count, "seed": seed}
            result = calibration = run_calibration([test.motion for test in table], overturned, **arguments)
            numbers, text = _summarise_calibration(calibration, table, motions, fold_count)
            if folder is not None:
                calibration.to_csv(folder / "ensemble.csv")
        if folder is not None:
            write_results(folder, figures={"calibration": result.plot}, result=numbers)
        print_result(numbers, text, as_json=output_options.as_json)


def _read_motions(records: Sequence[str], file_options: ScaledPulseOptions, option: str) -> dict[str, Motion]:
    """Read records and pulses and reject options of motions if there are none."""
    motions = {name: file_options.read_motion(name) for name in records} | file_options.create_pulses()
    for name in {} if motions else file_options.supplied_texts("scale", "pga", "pgv", "sa", "vertical"):
        raise OptionError("{} requires a motion; add one with {} or {}, or omit it", name, option, "pulse")
    return motions


def _summarise_calibration(
    calibration: Calibration, tests: Sequence[ShakeTest], motions: Mapping[str, Motion], fold_count: int
) -> tuple[dict[str, Any], str]:
    """Summarise a calibration as numbers and text, optionally with predictions and a cross-validation."""
    predicted = dict(zip(motions, calibration.predict([*motions.values()]), strict=True))
    numbers, parts = {**calibration.to_dict(), "predicted": predicted}, [calibration.summary()]
    if fold_count:
        scores = calibration.cross_validate(groups=[test.group for test in tests], fold_count=fold_count).scores
        numbers["cross_validated"] = asdict(scores)
        parts.append(f"left-out motions: {scores} ({format_count(fold_count, 'fold')})")
    if predicted:
        rows = [(name, float(probability)) for name, probability in predicted.items()]
        parts.append("\n" + format_table(["motion", "probability"], rows))
    return numbers, "\n".join(parts)


def validate(
    tests: Path,
    *,
    outlier_probability: float | None = None,
    bin_count: Annotated[int, READ_INTEGER] = 10,
    seed: Annotated[int, READ_INTEGER] = 0,
    block_options: Annotated[EnsembleOptions, BLOCK_OPTIONS] = EnsembleOptions(),
    file_options: Annotated[FileOptions, RECORD_OPTIONS] = FileOptions(),
    model_options: Annotated[ModelOptions, MODEL_OPTIONS] = ModelOptions(),
    output_options: Annotated[OutputOptions, OUTPUT_OPTIONS] = OutputOptions(),
) -> None:
    """Compare the predictions of a block, or of an ensemble from a calibration, with observed outcomes of tests.

    TESTS is a CSV table with a row for each test and the columns motion (a record file beside it, a shipped record, or
    a pulse), overturned (1 or 0), and optionally scale, vertical, channel, dt_s, units, name and group (rows of the
    same group belong together). --out contains validation.png, .pdf, tests.csv and result.json.

    Parameters
    ----------
    tests
        CSV table of tests.
    outlier_probability
        Probability that an outcome is unrelated to the rocking of the block, by default 0.
    bin_count
        Number of bins of the reliability diagram.
    seed
        Seed of the simulations for bands and probabilities.
    """
    with output_options.folder() as folder:
        rows = read_tests(tests, **file_options.read_options())
        options: dict[str, Any] = {"outlier_probability": outlier_probability, "bin_count": bin_count, "seed": seed}
        validation = run_validation(rows, **block_options.create_block_arguments(model_options), **options)
        result = validation.to_dict()
        if folder is not None:
            write_tables(folder, validation)
            write_results(folder, figures={"validation": validation.plot}, result=result)
        print_result(result, validation.summary(), as_json=output_options.as_json)
