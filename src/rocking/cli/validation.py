"""`rocking validate`: predictions judged against tests."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from rocking.analysis.input_tables import read_tests
from rocking.analysis.validation import validate as judged
from rocking.cli.body_options import EnsembleOptions
from rocking.cli.options import BLOCK, MODEL, WHOLE, ModelOptions
from rocking.cli.output import OUTPUT, OutputOptions, print_result, write_results, write_tables
from rocking.cli.records import RECORDS, FileOptions


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
        rows = read_tests(tests, channel=file.channel, dt=file.dt, units=file.units)
        found = judged(rows, **block.blocks(model), lapse=lapse, bins=bins, seed=seed)
        result = found.to_dict()
        if folder is not None:
            write_tables(folder, found)
            write_results(folder, figures={"validation": found.plot}, result=result)
        print_result(result, found.summary(), as_json=output.as_json)
