"""Output of a command: its folder, files, printing, and the options for them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from cyclopts import Group, Parameter

from rocking.core.progress import note
from rocking.core.tables import to_json, write_figure, write_text
from rocking.errors import Message, OptionError, OutputError, escape_braces

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rocking.core.result import Result


OUTPUT_OPTIONS: Final = Parameter(name="*", group=Group("Output", sort_key=4))


@dataclass(frozen=True)
class QuietOptions:
    """Options of every command."""

    quiet: Annotated[bool, Parameter(name="--quiet", negative="", help="Suppress notes on stderr.")] = False


@dataclass(frozen=True)
class PrintOptions(QuietOptions):
    """Options for printing a result."""

    as_json: Annotated[bool, Parameter(name="--json", negative="", help="Print the result as JSON.")] = False


@dataclass(frozen=True)
class OutputOptions(PrintOptions):
    """Options for printing a result and for its files."""

    out: Annotated[Path | None, Parameter(help="Folder for the files: figures, tables, result.json.")] = None

    def folder(self) -> AbstractContextManager[Path | None]:
        """Create the folder, if any; on failure, remove it if empty."""
        return nullcontext() if self.out is None else open_output_folder(self.out, lists_files=not self.as_json)


def write_results(folder: Path, *, figures: Mapping[str, Callable[[], Figure]], result: Mapping[str, Any]) -> None:
    """Write named figures (PNG and PDF) and a result (JSON) into a folder."""
    for stem, draw_figure in figures.items():
        with skip_on_error(f"{stem}.png and {stem}.pdf"):
            figure = draw_figure()
            write_figure(folder / f"{stem}.png", figure, dpi=160)
            write_figure(folder / f"{stem}.pdf", figure)
    write_text(folder / "result.json", to_json(result) + "\n")  # last: marks a complete folder


def write_tables(folder: Path, result: Result) -> None:
    """Write every table of a result into its own file in a folder."""
    for table in result.TABLES:
        result.to_csv(folder / f"{table}.csv", table)


@contextmanager
def skip_on_error(files: str, error_type: type[OptionError] = OptionError) -> Iterator[None]:
    """Skip files whose content is rejected, with a note."""
    try:
        yield
    except error_type as error:
        note(Message(f"{escape_braces(files)} left out: {error.message.template}", error.message.arguments))


def print_result(result: Mapping[str, Any], text: str, *, as_json: bool) -> None:
    """Print a result as JSON or as text."""
    print(to_json(result) if as_json else text)


@contextmanager
def open_output_folder(folder: Path, *, lists_files: bool = False) -> Iterator[Path]:
    """Create a folder for results and report the written files; on failure, remove new empty folders.

    Replaced files are noted. If `lists_files`, the written files are printed.

    Raises
    ------
    OutputError
        If the folder cannot be created or written to.
    """
    new_folders = [path for path in (folder, *folder.parents) if not path.exists()]
    old_times = _read_modification_times(folder)
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()  # checks that the folder is writable
        except OSError as error:
            message = f"this folder cannot be written to: {error.strerror}; choose another {{}}"
            raise OutputError(message, "out", path=str(folder)) from error
        yield folder
        new_times = _read_modification_times(folder)
        written = [name for name, time in new_times.items() if old_times.get(name) != time]
        if lists_files:
            print(f"\nwritten to {folder}: {', '.join(sorted({Path(name).parts[0] for name in written}))}")
        if replaced := [name for name in written if name in old_times]:
            note(f"replaced in {folder}: {', '.join(replaced)}")
    except BaseException:
        with suppress(OSError):
            for path in new_folders:
                path.rmdir()
        raise


def create_subfolder(folder: Path, name: str) -> Path:
    """Create a folder in the folder of the results, unless it exists."""
    try:
        (folder / name).mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"this folder cannot be created: {error.strerror}", path=str(folder / name)) from error
    return folder / name


def _read_modification_times(folder: Path) -> dict[str, int]:
    """Read the modification times, ns, of the files below a folder."""
    files = sorted(path for path in folder.rglob("*") if path.is_file()) if folder.is_dir() else []
    return {str(path.relative_to(folder)): path.stat().st_mtime_ns for path in files}
