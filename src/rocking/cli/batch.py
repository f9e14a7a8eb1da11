"""What the commands share: a folder for what came out, writing into it, and printing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rocking.errors import OutputError
from rocking.progress import note
from rocking.result import DatasetResult
from rocking.tables import to_json, write_figure, write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rocking.analysis.fragility.result import Fragility
    from rocking.cli.options import Records

#: Resolution of figures as PNG.
_DOTS_PER_INCH: Final = 160


def write(folder: Path, *, figures: Mapping[str, Figure], result: Mapping[str, Any] | None = None) -> None:
    """Write figures by name (PNG and PDF) and, if there is one, a result (JSON) into a folder.

    Raises
    ------
    OutputError
        If one of them cannot be written.
    """
    for stem, figure in figures.items():
        write_figure(folder / f"{stem}.png", figure, dpi=_DOTS_PER_INCH)
        write_figure(folder / f"{stem}.pdf", figure)
    if result is not None:
        write_text(folder / "result.json", to_json(result) + "\n")  # last: where it is, all is there


def deliver(
    found: DatasetResult, stem: str, read: Records | None, *, folder: Path | None, as_json: bool, **figure: Any
) -> None:
    """Write an analysis into a folder where there is one (figure, tables, dataset, result), and print it.

    Its tables name each motion by the record that was read, too, as those of other commands do.
    """
    result = found.to_dict()
    if read is not None:
        result |= read.to_dict()
        found = replace(found, data=found.data.assign_coords(record=("motion", [*read.motions])))
    if folder is not None:
        for table in found.TABLES:
            found.to_csv(folder / f"{table}.csv", table)
        found.to_netcdf(folder / f"{stem}.nc")
        write(folder, figures={stem: found.plot(**figure)}, result=result)
    show(result, found.summary(), as_json=as_json, folder=folder)


def with_records(found: Fragility, read: Records) -> Fragility:
    """Name the motion of each outcome by the record that was read, too."""
    if found.outcomes is None:
        return found
    records = {row["motion"]: row["record"] for row in read.to_dict()["records"]}
    named = found.outcomes.copy()
    named.insert(0, "record", named["motion"].map(records))
    return replace(found, outcomes=named)


def show(result: Mapping[str, Any], text: str, *, as_json: bool, folder: Path | None) -> None:
    """Print a result, for machines or for people, and what was written."""
    if as_json:
        print(to_json(result))
        return
    print(text)
    if folder is not None:
        print(f"\nwritten to {folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")


@contextmanager
def output_folder(folder: Path) -> Iterator[Path]:
    """Make a folder for results, and note which files were replaced; on failure, remove what was made and is empty.

    Raises
    ------
    OutputError
        If it cannot be made or written to.
    """
    made = [each for each in (folder, *folder.parents) if not each.exists()]
    before = _written_at(folder)
    probe = folder / ".rocking-can-write"
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            probe.touch()
            probe.unlink()
        except OSError as error:
            sentence = f"this folder cannot be written to: {error.strerror}; choose another {{}}"
            raise OutputError(sentence, "out", path=str(folder)) from error
        yield folder
        now = _written_at(folder)
        replaced = [name for name, time in before.items() if now.get(name, time) != time]
        if replaced:
            note(f"replaced in {folder}: {', '.join(replaced)}")
    except BaseException:
        with suppress(OSError):
            for each in made:
                each.rmdir()
        raise


def _written_at(folder: Path) -> dict[str, int]:
    """Return the times, ns, at which the files in a folder and below it were written, by their names in it."""
    files = sorted(path for path in folder.rglob("*") if path.is_file()) if folder.is_dir() else []
    return {str(path.relative_to(folder)): path.stat().st_mtime_ns for path in files}
