"""The program `rocking`: an interrupt while the command line is being imported ends it as one later does."""

import atexit
import gc
import os
import signal
import sys
from contextlib import suppress
from typing import NoReturn


def main() -> None:
    """Run the command line, as `rocking.cli.main` does."""
    try:
        _run()
    except SystemExit as end:
        if end.code == 130:
            _leave(end.code)
        raise
    finally:
        # As Python ends it looks for cycles among all objects, again and again: up to a second, for memory that is
        # given back anyway.
        gc.freeze()


def _run() -> None:
    try:
        from rocking.cli import main as run

        run()
    except (KeyboardInterrupt, RuntimeError) as error:
        # Python 3.11 makes an error of its own of what interrupts it while it makes a class.
        if not isinstance(error, KeyboardInterrupt) and not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        from rocking.errors import INTERRUPTED

        print(INTERRUPTED, file=sys.stderr)
        sys.exit(130)


def _leave(status: int) -> NoReturn:
    """End the process without Python's own end, in which a library that is half imported may crash."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(status)


if __name__ == "__main__":
    main()
