"""`rocking explore`: the explorer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from rocking.cli.options import READ_INTEGER
from rocking.cli.output import OUTPUT_OPTIONS, QuietOptions
from rocking.core.progress import note
from rocking.errors import OptionError
from rocking.records.named import is_shipped

if TYPE_CHECKING:
    from rocking.explorer.core import Explorer
    from rocking.explorer.studies import StudyView


def explore(
    motion: str | None = None,
    *,
    port: Annotated[int, READ_INTEGER] = 0,
    no_open: Annotated[bool, Parameter(negative="")] = False,
    output_options: Annotated[QuietOptions, OUTPUT_OPTIONS] = QuietOptions(),
) -> None:
    """Open an interactive page that shows how a block rocks, chatters, comes to rest and overturns.

    Without a motion, the command opens the page of `rocking page`, which leads to the explorer.

    The command prints a link that opens the page once, in one browser. Press Ctrl-C to stop.

    Parameters
    ----------
    motion
        Initial ground motion: a shipped record, a record file, or a pulse; or the folder of a study, whose results are
        shown as maps.
    port
        Port of the server, by default a free one.
    no_open
        Do not open a browser.
    """
    from rocking.explorer.core import Explorer
    from rocking.explorer.launch import Server
    from rocking.explorer.standalone import is_available

    explorer = Explorer()
    if motion is not None and Path(motion).is_dir():
        explorer.opening, explorer.study = {"view": "map"}, _open_study(Path(motion))
    elif motion is not None:
        explorer.opening = _describe_initial_motion(explorer, motion)
    server = Server(explorer, port=port)
    path = "/block" if motion is None and is_available() else "/"
    if motion is None and path == "/":
        note("the page of the block needs WebAssembly, which was not built with this installation; the explorer opens")
    server.announce(open_browser=not no_open, path=path)
    server.run()


def _open_study(folder: Path) -> StudyView:
    """Open the study in a folder, for display as maps."""
    from rocking.explorer.studies import StudyView
    from rocking.studies.folder import contains_study

    if not contains_study(folder):
        message = "this folder contains no study; pass one record, and drop the other files on the page"
        raise OptionError(message, path=str(folder))
    return StudyView(folder)


def _describe_initial_motion(explorer: Explorer, motion: str) -> dict[str, str]:
    """Describe the initial motion in texts of the page."""
    from rocking.explorer.motions import create_pulse, is_pulse
    from rocking.records.formats.source import unreadable_file_error

    if is_pulse(motion):
        create_pulse(motion)  # raises for an invalid pulse
    if is_pulse(motion) or is_shipped(motion):
        return {"motion": motion}
    file = Path(motion)
    try:
        key = explorer.uploads.add_file(file.name, file.read_bytes())
    except OSError as error:
        raise unreadable_file_error(motion, error) from None
    explorer.uploads.describe_file(key)
    return {"motion": f"file:{key}"}
