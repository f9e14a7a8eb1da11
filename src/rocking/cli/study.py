"""`rocking study`: simulations too many for one sitting, from a text file to results."""

from __future__ import annotations

import contextlib
import signal
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

import rocking
from rocking.cli.options import WHOLE
from rocking.cli.output import OUTPUT, PrintOptions, QuietOptions, output_folder, print_result, write_results
from rocking.core.progress import note
from rocking.core.tables import counted, to_json, write_text
from rocking.errors import InvalidOption, OutputError, StudyError
from rocking.studies.file import TEMPLATE, read_study
from rocking.studies.folder import Folder
from rocking.studies.report import ReportPlan
from rocking.studies.results import FORMATS, StudyVerdict
from rocking.studies.run import scheduler_client
from rocking.studies.study import Study, study_of

study = App(name="study")


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
    scheduler: str | None = None,
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
    scheduler
        Address of a scheduler of dask.distributed whose workers compute instead, as tcp://127.0.0.1:8786.
    part
        Compute a fixed share of the units only, as 3/10; shares may run at the same time, as an array of jobs.
    """
    if threads is not None and scheduler is not None:
        raise InvalidOption("{} and {} both say who computes; give one of them", "threads", "scheduler")
    found = _opened(folder, into)
    with contextlib.nullcontext() if scheduler is None else scheduler_client(scheduler) as client:
        report = found.run(threads=threads, executor=client, part=part)
    print(f"{report}\n{found.place}: {found.status}")
    if report.failed:
        raise StudyError(
            f"{counted(len(report.failed), 'unit')} failed, as runs.jsonl says; run the study again to try again"
        )
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
    state = rocking.study(folder).status
    running = None if state.running is None else asdict(state.running)
    about = {name: getattr(state, name) for name in ("done", "units", "simulations", "failed")}
    print(to_json({"folder": folder, **about, "running": running}) if output.as_json else f"{folder}: {state}")


@study.command
def verify(
    folder: str,
    *,
    recompute: Annotated[int, WHOLE] = 0,
    repair: Annotated[bool, Parameter(negative="")] = False,
    output: Annotated[QuietOptions, OUTPUT] = QuietOptions(),
) -> None:
    """Read every unit and all that describes the study, and check it; compute some units again and compare all bits.

    Parameters
    ----------
    folder
        Folder where the study is kept.
    recompute
        How many units, drawn at random, to compute again.
    repair
        Compute damaged units again and store them.
    """
    found = rocking.study(folder)
    faults = found.verify(recompute, repair=repair)
    for fault in faults:
        print(fault)
    if faults and not repair:
        found_faults = f"{counted(len(faults), 'fault')} found"
        raise StudyError(f"{found_faults}; {{}} computes damaged units again", "repair")
    left = found.verify() if faults else []
    print(_sound(found, folder, len(faults) - len(left)))
    if left:
        raise StudyError(f"{counted(len(left), 'fault')} cannot be repaired: {'; '.join(left)}")


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
        NetCDF (.nc), or a table with a row for each simulation: CSV (.csv), JSON (.json) or Parquet
        (.parquet); units are in the names of its columns.
    critical
        Write the scales between which this verdict on a block changes instead.
    """
    if file.suffix not in FORMATS:
        raise InvalidOption(f"a study is exported to {', '.join(FORMATS)}, not to {file.name}", "file", value=file)
    is_replaced = file.exists()
    getattr(rocking.study(folder), f"to_{FORMATS[file.suffix]}")(file, critical=critical)
    if is_replaced:
        note(f"replaced {file}")
    print(f"written to {file}")


@study.command
def report(folder: str, out: Path | None = None, *, output: Annotated[PrintOptions, OUTPUT] = PrintOptions()) -> None:
    """Make what the study's file asks for under [report]: figures, tables (CSV) and result.json.

    Parameters
    ----------
    folder
        Folder where the study is kept.
    out
        Folder for what is made; by default the folder report in that of the study.
    """
    found = rocking.study(folder)
    with output_folder(out or Path(folder) / "report", listed=not output.as_json) as target:
        made = found.report()
        for name, one in made.items():
            one.to_csv(target / f"{name}.csv")
        result = {name: one.to_dict() for name, one in made.items()}
        write_results(target, figures={name: one.plot for name, one in made.items()}, result=result)
        text = "\n\n".join(one.summary() for one in made.values())
        print_result(result, text, as_json=output.as_json)


def _opened(folder: str, into: str | None) -> Study:
    """Open a study, or create the one of a file."""
    if folder.endswith(".toml"):
        return _created(Path(folder), into or folder.removesuffix(".toml"), None)
    if into is not None:
        raise InvalidOption(f"{into} is for a study from a TOML file, which {folder} is not; name one place only")
    return rocking.study(folder)


def _created(file: Path, folder: str, unit_blocks: int | None) -> Study:
    described = read_study(file)
    for sentence in described.skipped:
        note(f"left out: {sentence}")
    wanted = described.report or ReportPlan(), described.outcomes, described.records
    return study_of(Folder(folder), described.product, unit_blocks, *wanted)


def _sound(found: Study, folder: str, repaired: int) -> str:
    """Say how much is sound, how much was repaired, and what is not there."""
    state = found.status
    missing = state.units - state.done
    sound = f"{counted(state.done, 'unit')} {'is' if state.done == 1 else 'are'} sound"
    sound += f"; {counted(repaired, 'fault')} repaired" if repaired else ""
    if missing:
        sound += f"; {missing} of {state.units} {'is' if missing == 1 else 'are'} missing: rocking study run {folder}"
    return sound
