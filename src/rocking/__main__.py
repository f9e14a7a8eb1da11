"""The program `rocking`: an interrupt while the command line is being imported ends it as one later does."""

import _thread
import gc
import signal
import sys
import threading
from typing import Any


def main() -> None:
    """Run the command line, as `rocking.cli.main` does."""
    sys.unraisablehook = _raise_again
    try:
        from rocking.cli import main as run

        run()
    except KeyboardInterrupt:
        from rocking.errors import INTERRUPT_MESSAGE

        print(INTERRUPT_MESSAGE, file=sys.stderr)
        sys.exit(130)
    finally:
        # As Python ends it looks for cycles among all objects, again and again: up to a second, for memory that is
        # given back anyway.
        gc.freeze()


def _raise_again(unraisable: Any) -> None:
    """Repeat an interrupt that Python drops because it fell into a callback: each import calls one."""
    if issubclass(unraisable.exc_type, KeyboardInterrupt):
        # Once the callback is over. A true signal also ends a wait, where there is one.
        again = getattr(signal, "pthread_kill", lambda *_: _thread.interrupt_main())
        threading.Timer(0.02, again, (threading.main_thread().ident, signal.SIGINT)).start()
    else:
        sys.__unraisablehook__(unraisable)


if __name__ == "__main__":
    main()
