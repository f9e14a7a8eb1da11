"""Command line: thin commands over the public names, one module each, imported when they are called."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from cyclopts import App, CycloptsError

import rocking
from rocking.errors import RockingError

app = App(
    name="rocking",
    help="Rocking, chattering, rest and overturning of free-standing rigid blocks under ground motion.",
    version=rocking.__version__,
    result_action="return_value",
)
for _command, _help in {
    "simulate": "Simulate one block under one record and say what happens to it.",
    "records": "List the shipped records, or show what a record file holds.",
    "chatter": "Say how long a slender block chatters under a sine, by every method, and whether it comes to rest.",
    "critical": "Give the amplitude up to which chattering under a sine is complete, by every method.",
    "paper": "Redraw the paper's figures from computation.",
    "spectrum": "Compute rocking spectra: peak rotation against the size of the block.",
    "map": "Map what a pulse does to a block, over amplitude and frequency.",
    "ida": "Scale motions up until the block overturns and beyond (incremental dynamic analysis).",
    "fragility": "Fit the probability that a block overturns against the intensity of the motions.",
    "calibrate": "Find the block behind observed outcomes, or behind a measured rotation history.",
}.items():
    app.command(f"rocking.cli.{_command}:{_command}", name=_command, help=_help)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 when done, 2 with one line on stderr for bad input, 130 when interrupted."""
    # Figures are written to files here, so no toolkit of windows need be started for them.
    os.environ.setdefault("MPLBACKEND", "agg")
    try:
        app(arguments, exit_on_error=False, print_error=False)
        sys.stdout.flush()
    except (RockingError, CycloptsError) as error:
        sys.exit(_refuse(error))
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:
        # The reader of our output has gone; so must Python's own last flush.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _refuse(error: Exception) -> int:
    hint = "; see rocking --help" if isinstance(error, CycloptsError) else ""
    sentence = " ".join(str(error).split()).rstrip(".")
    print(f"rocking: {sentence}{hint}", file=sys.stderr)
    return 2
