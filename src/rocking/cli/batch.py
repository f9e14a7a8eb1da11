"""What the commands share: whether there is one record, and delivering what came out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rocking.errors import OutputError
from rocking.result import Result
from rocking.tables import to_json, write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def is_single(names: Sequence[str], records: Sized) -> bool:
    """Whether one record or pulse is named by itself, and no folder or pattern that happens to hold one."""
    return (
        len(names) == len(records) == 1 and not any(sign in names[0] for sign in "*?[") and not Path(names[0]).is_dir()
    )


def write(folder: Path, *, figures: Mapping[str, Figure], result: Mapping[str, Any]) -> None:
    """Write figures by name (PNG and PDF) and a result (JSON) into a folder.

    Raises
    ------
    OutputError
        If one of them cannot be written.
    """
    for stem, figure in figures.items():
        write_figure(folder, stem, figure)
    write_text(folder / "result.json", to_json(result) + "\n")


def write_figure(folder: Path, stem: str, figure: Figure) -> None:
    """Write a figure as PNG and PDF into a folder.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    try:
        figure.savefig(folder / f"{stem}.png", dpi=160)
        figure.savefig(folder / f"{stem}.pdf")
    except OSError as error:
        raise OutputError(f"{folder} cannot be written to: {error.strerror}; choose another --out") from error


def deliver(found: Result, stem: str, *, folder: Path | None, as_json: bool, **figure: Any) -> None:
    """Write an analysis into a folder where there is one (figure, tables, dataset, result), and print it."""
    result = found.to_dict()
    if folder is not None:
        for table in found.TABLES:
            found.to_csv(folder / f"{table}.csv", table)
        found.to_netcdf(folder / f"{stem}.nc")
        write(folder, figures={stem: found.plot(**figure)}, result=result)
    show(result, found.summary(), as_json=as_json, folder=folder)


def show(result: Mapping[str, Any], text: str, *, as_json: bool, folder: Path | None) -> None:
    """Print a result, for machines or for people, and what was written."""
    if as_json:
        print(to_json(result))
        return
    print(text)
    if folder is not None:
        print(f"\nwritten to {folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")
