"""`rocking study`: long runs of simulations, from a study file to results."""

from __future__ import annotations

import signal
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Final

from cyclopts import App, Parameter

from rocking.cli.options import INTENSITY_OPTIONS, READ_INTEGER, IntensityOptions, parse_limit_states
from rocking.cli.output import (
    OUTPUT_OPTIONS,
    PrintOptions,
    QuietOptions,
    open_output_folder,
    print_result,
    skip_on_error,
    write_results,
)
from rocking.core import checks
from rocking.core.progress import note
from rocking.core.result import Result
from rocking.core.tables import format_count, write_text
from rocking.core.threads import set_options
from rocking.errors import FitError, OptionError, OutputError, StudyError
from rocking.inputs.quantities import read_array
from rocking.motion.scaling import ComponentName
from rocking.studies.file import TEMPLATE, read_study
from rocking.studies.results import StudyOutcome, check_fractiles
from rocking.studies.study import Study, open_or_create

app = App(name="study")

#: Maximum number of failed batches that are named.
_MAX_REPORTED: Final = 5

#: Writers of a study, by the suffix of the file.
WRITERS: Final = {".nc": Study.to_netcdf, ".csv": Study.to_csv, ".parquet": Study.to_parquet}


@app.command
def new(file: Path, *, output_options: Annotated[QuietOptions, OUTPUT_OPTIONS] = QuietOptions()) -> None:
    """Write a commented template of a study file.

    Parameters
    ----------
    file
        TOML file to write. An existing file is not replaced.
    """
    if file.exists():
        raise OutputError("the file already exists; choose another name, or remove it first", path=str(file))
    write_text(file, TEMPLATE)
    print(f"written to {file}; edit it, then: rocking study run {file}")


@app.command
def create(
    file: Path,
    folder: str,
    *,
    blocks_per_batch: Annotated[int | None, READ_INTEGER] = None,
    output_options: Annotated[QuietOptions, OUTPUT_OPTIONS] = QuietOptions(),
) -> None:
    """Create the study of a file in a folder; if the folder exists, check that it contains the same study.

    Parameters
    ----------
    file
        TOML file, as created by `rocking study new`.
    folder
        Folder of the study.
    blocks_per_batch
        Number of blocks in a batch (one motion and scale), a multiple of 512. By default a batch runs for about five
        seconds.
    """
    print(f"{folder}: {_create_study(file, folder, blocks_per_batch).status}; next: rocking study run {folder}")


@app.command
def run(
    folder: str,
    target: Annotated[str | None, Parameter(name="--into")] = None,
    *,
    thread_count: Annotated[int | None, READ_INTEGER, Parameter(name="--threads")] = None,
    part: str | None = None,
    output_options: Annotated[QuietOptions, OUTPUT_OPTIONS] = QuietOptions(),
) -> None:
    """Compute the missing batches; after Ctrl-C, SIGTERM or any other interruption, run it again to continue.

    Parameters
    ----------
    folder
        Folder of the study; or its TOML file, from which the study is created first.
    target
        With a file, the folder of the study. By default beside the file, with its name without .toml.
    thread_count
        Number of threads, by default one for every core.
    part
        Fixed share of the batches to compute, as 3/10. Shares may run at the same time, as an array of jobs.
    """
    if target is not None and not folder.endswith(".toml"):
        raise OptionError(f"{target} is only allowed with a TOML file, which {folder} is not; pass one folder only")
    is_file = folder.endswith(".toml")
    study = _create_study(Path(folder), target or folder.removesuffix(".toml"), None) if is_file else Study(folder)
    with set_options(threads=thread_count):
        report = study.run(part=part)
    print(f"{report}\n{study.folder}: {study.status}")
    for batch, message in [*report.failures.items()][:_MAX_REPORTED]:
        note(f"{batch} failed: {message}")
    if report.failures:
        raise StudyError(f"{format_count(len(report.failures), 'batch')} failed; run the study again to repeat them")
    if report.ended_early:
        sys.exit(128 + signal.SIGTERM)


@app.command
def status(folder: str, *, output_options: Annotated[PrintOptions, OUTPUT_OPTIONS] = PrintOptions()) -> None:
    """Show the progress of a study, also while it runs.

    Parameters
    ----------
    folder
        Folder of the study.
    """
    state = Study(folder).status
    print_result({"folder": folder, **asdict(state)}, f"{folder}: {state}", as_json=output_options.as_json)


@app.command
def verify(
    folder: str,
    *,
    recompute_count: Annotated[int, READ_INTEGER, Parameter(name="--recompute")] = 0,
    repair: Annotated[bool, Parameter(negative="")] = False,
    output_options: Annotated[QuietOptions, OUTPUT_OPTIONS] = QuietOptions(),
) -> None:
    """Read and check every batch, recompute some batches and compare all bits.

    Parameters
    ----------
    folder
        Folder of the study.
    recompute_count
        Number of batches, drawn at random, to compute again.
    repair
        Recompute damaged batches and store them.
    """
    study = Study(folder)
    faults = study.verify(recompute_count, repair=repair)
    for fault in faults:
        print(fault)
    if faults and not repair:
        raise StudyError(f"{format_count(len(faults), 'fault')} found; {{}} computes damaged batches again", "repair")
    status, repaired = study.status, f"; {format_count(len(faults), 'fault')} repaired" if faults else ""
    print(f"{status.done_count} of {format_count(status.batch_count, 'batch')} done and sound{repaired}")


@app.command
def export(
    folder: str,
    file: Path,
    *,
    critical: StudyOutcome | None = None,
    output_options: Annotated[QuietOptions, OUTPUT_OPTIONS] = QuietOptions(),
) -> None:
    """Write the results to one file.

    Parameters
    ----------
    folder
        Folder of the study.
    file
        NetCDF (.nc), or a table with a row for each simulation: CSV (.csv) or Parquet (.parquet); its column names
        contain the batches.
    critical
        Write the scales between which this outcome of a block changes instead.
    """
    if file.suffix not in WRITERS:
        message = f"the name of an exported file must end with one of {', '.join(WRITERS)}; got {file.name}"
        raise OptionError(message, "file", value=file)
    WRITERS[file.suffix](Study(folder), file, critical=critical)
    print(f"written to {file}")


@app.command
def report(
    folder: str,
    out: Path | None = None,
    *,
    limit_states: str = "overturning",
    is_pooled: Annotated[bool, Parameter(name="--together", negative="")] = False,
    confidence: float = 0.9,
    fractiles: str = "0.16,0.5,0.84",
    component: ComponentName = "own",
    larger: Annotated[bool, Parameter(negative="")] = False,
    measure_options: Annotated[IntensityOptions, INTENSITY_OPTIONS] = IntensityOptions(),
    output_options: Annotated[PrintOptions, OUTPUT_OPTIONS] = PrintOptions(),
) -> None:
    """Fit a fragility curve to the outcomes of each block and compute its spectrum: figures, tables, result.json.

    Parameters
    ----------
    folder
        Folder of the study.
    out
        Folder for the results. By default the folder report in the folder of the study.
    limit_states
        Limit states, separated by commas: overturning, or NAME=ROTATION divided by the slenderness, as half=0.5.
    is_pooled
        Fit one curve to the outcomes of all blocks together.
    confidence
        Probability of the intervals.
    fractiles
        Fractions of the motions that stay below the fractiles of the spectrum.
    component
        Component to which the intensity refers; for a study of pairs also geometric_mean, larger, rotd50 or rotd100.
    larger
        Count only the larger response of both components of each pair, and of both polarities.
    """
    measure, limits = measure_options.create_measure(component), parse_limit_states(limit_states)
    fractile_values = check_fractiles(read_array(fractiles, "fractiles").tolist())
    checks.fraction(confidence, "confidence", OptionError)
    study, results = Study(folder), dict[str, Result]()
    fit = study.fragility if is_pooled else study.block_fragilities
    with open_output_folder(out or Path(folder) / "report", lists_files=not output_options.as_json) as target:
        with skip_on_error("fragility", FitError):
            results["fragility"] = fit(measure=measure, limit_states=limits, confidence=confidence, larger=larger)
        results["spectrum"] = study.spectrum(fractile_values.tolist())
        for name, analysis in results.items():
            analysis.to_csv(target / f"{name}.csv")
        result = {name: analysis.to_dict() for name, analysis in results.items()}
        write_results(target, figures={name: analysis.plot for name, analysis in results.items()}, result=result)
        text = "\n\n".join(analysis.summary() for analysis in results.values())
        print_result(result, text, as_json=output_options.as_json)


def _create_study(file: Path, folder: str, blocks_per_batch: int | None) -> Study:
    study_file = read_study(file)
    for sentence in study_file.skipped:
        note(f"left out: {sentence}")
    return open_or_create(folder, study_file.product, blocks_per_batch, study_file.records)
