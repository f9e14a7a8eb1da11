"""Command line: thin commands over the public names, one module each, imported when they are called."""

from __future__ import annotations

import contextlib
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from typing import Any

from cyclopts import App, CycloptsError

import rocking
from rocking.cli import wording
from rocking.errors import OutsideFit, RockingError
from rocking.progress import Audience, note, notes_for

app = App(
    name="rocking",
    help="Rocking, chattering, rest and overturning of free-standing rigid blocks under ground motion.",
    version=rocking.__version__,
    version_flags=["--version", "-V"],
    result_action="return_value",
)
for _command, _help in {
    "simulate": "Simulate a block under a record, or under many, and say what happens to it.",
    "records": "List the shipped records, or show what a record file holds.",
    "pulses": "List the pulses that --pulse takes, with their parameters.",
    "chatter": "Say how long a slender block chatters under a sine, by every method, and whether it comes to rest.",
    "critical": "Give the amplitude up to which chattering under a sine is complete, by every method.",
    "paper": "Redraw the paper's figures from computation.",
    "spectrum": "Compute rocking spectra: peak rotation against the size of the block.",
    "map": "Map what a pulse does to a block, over amplitude and frequency.",
    "ida": "Scale motions up until the block overturns and beyond (incremental dynamic analysis).",
    "fragility": "Fit the probability that a block overturns against the intensity of the motions.",
    "measures": "Compare intensity measures: which tells best when motions overturn a block.",
    "check": "Say what rules of thumb make of a block, beside the exact answer.",
    "calibrate": "Find the block behind observed outcomes, or behind a measured rotation history.",
    "explore": "Open a page on which a block is seen to rock, chatter, rest and fall.",
    "study": "Run a study too long for one sitting: created once, resumed after anything.",
}.items():
    app.command(f"rocking.cli.{_command}:{_command}", name=_command, help=_help)
app.register_install_completion_command(help="Install completion of commands and options for this shell.")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 when done, 2 with one line on stderr for bad input, 130 when interrupted."""
    # Figures are written to files here, so no toolkit of windows need be started for them.
    os.environ.setdefault("MPLBACKEND", "agg")
    given = list(sys.argv[1:] if arguments is None else arguments)
    _print_what_the_terminal_can_show()
    try:
        _run(given)
        sys.stdout.flush()
    except (RockingError, CycloptsError) as error:
        print(f"rocking: {wording.of(error, app, given)}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:
        # The reader of our output has gone; so must Python's own last flush.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _run(arguments: list[str]) -> None:
    wording.refuse_unknown_options(app, arguments)
    _explain(wording.called(app, arguments))
    command, bound, _ = app.parse_args(arguments, exit_on_error=False, print_error=False)
    quiet = any(getattr(value, "quiet", False) for value in bound.arguments.values())
    audience: Audience = "nobody" if quiet else "everybody"
    with notes_for(audience, lambda sentence: wording.in_options(sentence, app, arguments)), _warnings_as_notes():
        command(*bound.args, **bound.kwargs)


def _explain(command: App) -> None:
    """Let a command's help be all that its function says, not the line that the list of commands has."""
    if command.default_command is not None:
        command.help = None


def _print_what_the_terminal_can_show() -> None:
    """Let characters that the locale cannot encode be question marks rather than errors."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


@contextlib.contextmanager
def _warnings_as_notes() -> Iterator[None]:
    """Turn the package's own warnings into notes."""

    def show(message: Warning | str, category: type[Warning], *place: Any) -> None:
        if issubclass(category, OutsideFit):
            note(str(message))
        else:
            shown(message, category, *place)

    with warnings.catch_warnings():
        shown = warnings.showwarning
        warnings.simplefilter("always", OutsideFit)
        warnings.showwarning = show  # type: ignore[assignment]
        yield
