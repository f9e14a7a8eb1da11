"""Command line: thin commands over the public names, in modules that are imported when they are called."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from cyclopts import App, CycloptsError

from rocking.cli import wording
from rocking.errors import RockingError
from rocking.progress import notes_for

app = App(
    name="rocking",
    help="Rocking, chattering, rest and overturning of free-standing rigid blocks under ground motion.",
    version_flags=[],
    result_action="return_value",
)
for _command, (_module, _help) in {
    "simulate": ("simulate", "Simulate a block under a record, or under many, and say what happens to it."),
    "records": ("records", "List the shipped records, or show what a record file holds."),
    "pulses": ("records", "List the pulses that --pulse takes, with their parameters."),
    "chatter": (
        "chattering",
        "Say how long a slender block chatters under a sine, by every method, and whether it comes to rest.",
    ),
    "critical": ("chattering", "Give the amplitude up to which chattering under a sine is complete, by every method."),
    "paper": ("chattering", "Redraw the paper's figures from computation."),
    "spectrum": ("analysis", "Compute rocking spectra: peak rotation against the size of the block."),
    "map": ("analysis", "Map what a pulse does to a block, over amplitude and frequency."),
    "ida": ("analysis", "Scale motions up until the block overturns and beyond (incremental dynamic analysis)."),
    "fragility": ("fits", "Fit the probability that a block overturns against the intensity of the motions."),
    "measures": ("analysis", "Compare intensity measures: which predicts best when motions overturn a block."),
    "check": ("simulate", "Say what rules of thumb make of a block, beside the exact answer."),
    "calibrate": ("fits", "Find the block behind observed outcomes, or behind a measured rotation history."),
    "explore": ("explore", "Open a page on which a block is seen to rock, chatter, rest and fall."),
    "study": ("study", "Run a study too long for one sitting: created once, resumed after anything."),
}.items():
    app.command(f"rocking.cli.{_module}:{_command}", name=_command, help=_help)
app.command("rocking.cli.version:version", name=["--version", "-V"], help="Display the version.")
app.register_install_completion_command(help="Install completion of commands and options for this shell.")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 when done, 2 with one line on stderr for bad input, 130 when interrupted."""
    # Figures are written to files here, so no toolkit of windows need be started for them.
    os.environ.setdefault("MPLBACKEND", "agg")
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # what the locale cannot encode is shown as question marks
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        called = wording.called(app, given)
        if called.default_command is not None:
            called.help = None  # The help of a command is all that its function says, not its line in the list.
        command, bound, _ = app.parse_args(given, exit_on_error=False, print_error=False)
        wording.refuse_unknown_options(bound.args, app, given)
        quiet = any(getattr(value, "quiet", False) for value in bound.arguments.values())
        with notes_for("nobody" if quiet else "everybody", wording.spelling_of(called)):
            command(*bound.args, **bound.kwargs)
        sys.stdout.flush()
    except (RockingError, CycloptsError) as error:
        print(f"rocking: {wording.of(error, app, given)}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:
        # The reader of our output has gone; so must Python's own last flush.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
