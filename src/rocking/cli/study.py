"""`rocking study`: simulations too many for one sitting, from a text file to results."""

from __future__ import annotations

import signal
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Final

from cyclopts import App, Parameter

from rocking.cli.options import MEASURE, WHOLE, IntensityOptions, limits_of
from rocking.cli.output import (
    OUTPUT,
    PrintOptions,
    QuietOptions,
    left_out,
    output_folder,
    print_result,
    write_results,
)
from rocking.core import checks
from rocking.core.progress import note
from rocking.core.result import Result
from rocking.core.tables import counted, write_text
from rocking.errors import InvalidOption, OutputError, StudyError, Unfitted
from rocking.inputs.quantities import values
from rocking.studies.file import TEMPLATE, read_study
from rocking.studies.results import StudyVerdict, checked_fractiles
from rocking.studies.study import Study, study_of

study = App(name="study")

#: Units that are named where some failed, at most.
_SHOWN: Final = 5

#: What writes a study, by the end of the file's name.
FORMATS: Final = {".nc": Study.to_netcdf, ".csv": Study.to_csv, ".parquet": Study.to_parquet}


@study.command
def new(file: Path, *, output: Annotated[QuietOptions, OUTPUT] = QuietOptions()) -> None:
    """Write a commented file to start from.

    Parameters
    ----------
    file
        TOML file to write; one that is there is left alone.
    """
    if file.exists():
        raise OutputError("the file is there already: choose another name, or remove it first", path=str(file))
    write_text(file, TEMPLATE)
    print(f"written to {file}; edit it, then: rocking study run {file}")


@study.command
def create(
    file: Path,
    folder: str,
    *,
    unit_blocks: Annotated[int | None, WHOLE] = None,
    output: Annotated[QuietOptions, OUTPUT] = QuietOptions(),
) -> None:
    """Create the study of a file in a folder; with the folder there, check that it is the same study.

    Parameters
    ----------
    file
        TOML file, as `rocking study new` writes one.
    folder
        Folder where the study is kept.
    unit_blocks
        Blocks of a unit, a multiple of 512, of one motion and scale; by default a unit takes about five seconds.
    """
    print(f"{folder}: {_created(file, folder, unit_blocks).status}; next: rocking study run {folder}")


@study.command
def run(
    folder: str,
    into: str | None = None,
    *,
    threads: Annotated[int | None, WHOLE] = None,
    part: str | None = None,
    output: Annotated[QuietOptions, OUTPUT] = QuietOptions(),
) -> None:
    """Compute what is missing; after Ctrl-C, SIGTERM or anything else, run it again to go on.

    Parameters
    ----------
    folder
        Folder where the study is kept; or its TOML file, from which it is created first.
    into
        With a file, the folder where the study is kept; by default one beside the file, of its name without .toml.
    threads
        Number of threads; by default one for every core.
    part
        Compute a fixed share of the units only, as 3/10; shares may run at the same time, as an array of jobs.
    """
    if into is not None and not folder.endswith(".toml"):
        raise InvalidOption(f"{into} is for a study from a TOML file, which {folder} is not; name one place only")
    is_file = folder.endswith(".toml")
    found = _created(Path(folder), into or folder.removesuffix(".toml"), None) if is_file else Study(folder)
    report = found.run(threads=threads, part=part)
    print(f"{report}\n{found.place}: {found.status}")
    for unit, why in [*report.failed.items()][:_SHOWN]:
        note(f"{unit} failed: {why}")
    if report.failed:
        raise StudyError(f"{counted(len(report.failed), 'unit')} failed; run the study again to try again")
    if report.stopped:
        sys.exit(128 + signal.SIGTERM)


@study.command
def status(folder: str, *, output: Annotated[PrintOptions, OUTPUT] = PrintOptions()) -> None:
    """Say how far a study has come, also while it runs.

    Parameters
    ----------
    folder
        Folder where the study is kept.
    """
    state = Study(folder).status
    print_result({"folder": folder, **asdict(state)}, f"{folder}: {state}", as_json=output.as_json)


@study.command
def verify(
    folder: str,
    *,
    recompute: Annotated[int, WHOLE] = 0,
    repair: Annotated[bool, Parameter(negative="")] = False,
    output: Annotated[QuietOptions, OUTPUT] = QuietOptions(),
) -> None:
    """Read and check every unit; compute some units again and compare all bits.

    Parameters
    ----------
    folder
        Folder where the study is kept.
    recompute
        How many units, drawn at random, to compute again.
    repair
        Compute damaged units again and store them.
    """
    found = Study(folder)
    faults = found.verify(recompute, repair=repair)
    for fault in faults:
        print(fault)
    if faults and not repair:
        raise StudyError(f"{counted(len(faults), 'fault')} found; {{}} computes damaged units again", "repair")
    state, repaired = found.status, f"; {counted(len(faults), 'fault')} repaired" if faults else ""
    print(f"{state.done} of {counted(state.units, 'unit')} done and sound{repaired}")


@study.command
def export(
    folder: str,
    file: Path,
    *,
    critical: StudyVerdict | None = None,
    output: Annotated[QuietOptions, OUTPUT] = QuietOptions(),
) -> None:
    """Write the results to one file.

    Parameters
    ----------
    folder
        Folder where the study is kept.
    file
        NetCDF (.nc), or a table with a row for each simulation: CSV (.csv) or Parquet (.parquet); units are in the
        names of its columns.
    critical
        Write the scales between which this verdict on a block changes instead.
    """
    if file.suffix not in FORMATS:
        raise InvalidOption(f"a study is exported to {', '.join(FORMATS)}, not to {file.name}", "file", value=file)
    FORMATS[file.suffix](Study(folder), file, critical=critical)
    print(f"written to {file}")


@study.command
def report(
    folder: str,
    out: Path | None = None,
    *,
    limits: str = "overturning",
    together: Annotated[bool, Parameter(negative="")] = False,
    confidence: float = 0.9,
    fractiles: str = "0.16,0.5,0.84",
    measure: Annotated[IntensityOptions, MEASURE] = IntensityOptions(),
    output: Annotated[PrintOptions, OUTPUT] = PrintOptions(),
) -> None:
    """Fit a fragility curve to the outcomes of each block and compute its spectrum: figures, tables, result.json.

    Parameters
    ----------
    folder
        Folder where the study is kept.
    out
        Folder for what is made; by default the folder report in that of the study.
    limits
        Limit states, with commas between: overturning, or NAME=ROTATION over slenderness, as half=0.5.
    together
        Fit one curve to the outcomes of all blocks together.
    confidence
        Probability of the intervals.
    fractiles
        Shares of the motions that stay below the fractiles of the spectrum.
    """
    how, states = measure.wanted, limits_of(limits)
    shares = checked_fractiles(values(fractiles, "fractiles").tolist())
    checks.share(confidence, "confidence", InvalidOption)
    found, made = Study(folder), dict[str, Result]()
    fit = found.fragility if together else found.block_fragilities
    with output_folder(out or Path(folder) / "report", listed=not output.as_json) as target:
        with left_out("fragility", Unfitted):
            made["fragility"] = fit(measure=how, limits=states, confidence=confidence)
        made["spectrum"] = found.spectrum(shares.tolist())
        for name, one in made.items():
            one.to_csv(target / f"{name}.csv")
        result = {name: one.to_dict() for name, one in made.items()}
        write_results(target, figures={name: one.plot for name, one in made.items()}, result=result)
        print_result(result, "\n\n".join(one.summary() for one in made.values()), as_json=output.as_json)


def _created(file: Path, folder: str, unit_blocks: int | None) -> Study:
    described = read_study(file)
    for sentence in described.skipped:
        note(f"left out: {sentence}")
    return study_of(folder, described.product, unit_blocks, described.records)
