"""`rocking validate`: predictions judged against tests."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from rocking.analysis.input_tables import read_tests
from rocking.analysis.validation.judging import validate as judged
from rocking.analysis.validation.tested import ShakeTest
from rocking.cli.body_options import EnsembleOptions, ensemble_of
from rocking.cli.options import BLOCK, MODEL, WHOLE, ModelOptions
from rocking.cli.output import OUTPUT, OutputOptions, print_result, write_results, write_tables
from rocking.cli.records import RECORDS, FileOptions
from rocking.errors import InvalidOption
from rocking.quantities import tilt


def validate(
    tests: Path,
    *,
    lapse: float | None = None,
    peak_error: str = "0",
    bins: Annotated[int, WHOLE] = 10,
    seed: Annotated[int, WHOLE] = 0,
    block: Annotated[EnsembleOptions, BLOCK] = EnsembleOptions(),
    file: Annotated[FileOptions, RECORDS] = FileOptions(),
    model: Annotated[ModelOptions, MODEL] = ModelOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Judge what a block, or the ensemble of a calibration, predicts of tests against what was observed.

    TESTS is a CSV table with a row for each test: motion (a record file beside it, a shipped record, or a pulse), where
    wanted scale, vertical, channel, dt_s and units; overturned (1 or 0), peak_rotation_deg or peak_rotation_rad, or
    both; and where wanted name, specimen, nominal and group (rows with the same belong together). With --ensemble
    FOLDER each specimen is predicted by FOLDER/SPECIMEN/ensemble.csv, as rocking calibrate writes them. --out holds
    validation.png, .pdf, tests.csv and result.json.

    Parameters
    ----------
    tests
        CSV table of tests.
    lapse
        Chance that an outcome is not that of a rocking block at all; by default 0.
    peak_error
        Standard deviation of a measured peak, 0.1deg or 0.002 (rad).
    bins
        Bins of the reliability diagram.
    seed
        Seed of the simulations for bands and chances.
    """
    deviation = tilt(peak_error, "peak_error")
    with output.folder() as folder:
        rows = read_tests(tests, channel=file.channel, dt=file.dt, units=file.units)
        found = judged(
            rows,
            **_blocks(rows, block, model),
            lapse=lapse,
            peak_error=deviation,
            bins=bins,
            seed=seed,
        )
        result = found.to_dict()
        if folder is not None:
            write_tables(folder, found)
            write_results(folder, figures={"validation": found.plot}, result=result)
        print_result(result, found.summary(), as_json=output.as_json)


def _blocks(tests: Sequence[ShakeTest], block: EnsembleOptions, model: ModelOptions) -> dict[str, Any]:
    """Return blocks, weights and model as arguments; of a folder of ensembles those of each specimen."""
    folder = block.ensemble
    if folder is None or not folder.is_dir():
        return block.blocks(model)
    block.refuse_a_block()
    names = dict.fromkeys(test.specimen for test in tests)
    each = {name: ensemble_of(folder / name / "ensemble.csv", model) for name in names}
    models = {one["model"] for one in each.values()}
    if len(models) > 1:
        raise InvalidOption("the ensembles of {} are of both equations of motion: give one {}", "ensemble", "model")
    parts = {part: {name: one[part] for name, one in each.items()} for part in ("blocks", "weights")}
    return {**parts, "model": models.pop()}
