"""`rocking study`: simulations too many for one sitting, from a text file to results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

import rocking
from rocking.errors import OutputError, StudyError
from rocking.progress import note
from rocking.studies.file import TEMPLATE, read_study
from rocking.studies.place import Folder
from rocking.studies.study import Study, study_of
from rocking.tables import to_json, write_text

study = App(name="study", help="Run a study too long for one sitting: created once, resumed after anything.")


@study.command
def new(file: Path) -> None:
    """Write a commented file to start from.

    Parameters
    ----------
    file
        TOML file to write; one that is there is left alone.
    """
    if file.exists():
        raise OutputError(f"{file} is there already: choose another name, or remove it first")
    write_text(file, TEMPLATE)
    print(f"written to {file}; edit it, then: rocking study create {file} FOLDER")


@study.command
def create(file: Path, folder: Path, *, unit_blocks: int | None = None) -> None:
    """Create the study of a file in a folder; with the folder there, check that it is the same study.

    Parameters
    ----------
    file
        TOML file, as `rocking study new` writes one.
    folder
        Where the study is kept.
    unit_blocks
        Blocks of a unit, a multiple of 512; by default so many that a unit takes about five seconds.
    """
    found = read_study(file)
    for sentence in found.skipped:
        note(f"left out: {sentence}")
    made = study_of(Folder(folder), found.product, unit_blocks)
    print(f"{made.status}; next: rocking study run {folder}")


@study.command
def run(folder: Path, *, threads: int | None = None) -> None:
    """Compute what is missing. Ctrl-C finishes the units in hand and stops; run it again to go on.

    Parameters
    ----------
    folder
        Where the study is kept.
    threads
        Number of threads; by default one for every core.
    """
    found = rocking.study(folder)
    report = found.run(threads=threads)
    print(f"{report}\n{found.status}")
    if report.failed:
        raise StudyError(f"{len(report.failed)} units failed: see {folder / 'runs.jsonl'}, and run the study again")


@study.command
def status(folder: Path, *, as_json: Annotated[bool, Parameter(name="--json", negative="")] = False) -> None:
    """Say how far a study has come, also while it runs.

    Parameters
    ----------
    folder
        Where the study is kept.
    as_json
        Print it as JSON.
    """
    state = rocking.study(folder).status
    done = {"done": state.done, "units": state.units, "simulations": state.simulations, "failed": state.failed}
    print(to_json(done) if as_json else state)


@study.command
def verify(folder: Path, *, recompute: int = 0, repair: Annotated[bool, Parameter(negative="")] = False) -> None:
    """Read every unit and check it; compute some again and compare all bits.

    Parameters
    ----------
    folder
        Where the study is kept.
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
        raise StudyError(f"{len(faults)} units are damaged or differ; --repair computes them again")
    print(_sound(found, len(faults)))


@study.command
def export(folder: Path, file: Path) -> None:
    """Write the results to one file.

    Parameters
    ----------
    folder
        Where the study is kept.
    file
        NetCDF (.nc), CSV (.csv), or Parquet (.parquet, with pyarrow installed).
    """
    rocking.study(folder).export(file)
    print(f"written to {file}")


def _sound(found: Study, repaired: int) -> str:
    return f"{found.status.done} units are sound" + (f", {repaired} of them repaired" if repaired else "")
