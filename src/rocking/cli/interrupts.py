"""Ctrl-C ends a command wherever it falls, also in code that does not let exceptions through."""

from __future__ import annotations

import _thread
import gc
import signal
import sys
import threading
from types import FrameType, TracebackType
from typing import Any, Final, Self

#: Time until an interrupt that was lost is tried again, s.
_AGAIN: Final = 0.02


class Interrupts:
    """What became of Ctrl-C within a block of code.

    Python drops an exception that is raised in a finaliser or in a callback, and a library that calls Python may raise
    another in its place. The first is raised again; for the second, `asked` says where the error comes from. What
    Python drops of the second kind is not printed.

    Attributes
    ----------
    asked : bool
        Whether there was an interrupt.
    """

    def __init__(self) -> None:
        self.asked = False
        self._again: threading.Timer | None = None

    def __enter__(self) -> Self:
        # Other threads get no signals, and who listens already keeps what he listens with.
        free = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        self._listens = free and threading.current_thread() is threading.main_thread()
        if self._listens:
            signal.signal(signal.SIGINT, self._interrupt)
            self._before, sys.unraisablehook = sys.unraisablehook, self._dropped
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._listens:
            if self._again is not None:
                self._again.cancel()
            if self.asked and error is not None:
                error.__context__ = None  # what was half made is given up here, where nothing of it is printed
                gc.collect()
            sys.unraisablehook = self._before
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        raise KeyboardInterrupt

    def _dropped(self, unraisable: Any) -> None:
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._again = threading.Timer(_AGAIN, _thread.interrupt_main)
            self._again.start()
        elif not self.asked:
            self._before(unraisable)
