"""Ctrl-C ends a command wherever it falls, also in code that does not let exceptions through."""

from __future__ import annotations

import _thread
import itertools
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any, Final, Self

#: Time until an interrupt that was lost, or has to wait, is tried again, s.
_AGAIN: Final = 0.02

#: Modules in which an exception at the wrong moment leaves a lock that nobody opens any more, so that other threads,
#: and whoever waits for them, wait for ever; and how often an interrupt waits until they are left: a thread that is
#: still in one of them then, waits there itself, as it may.
_LOCKING: Final = ("threading", "concurrent.futures._base", "concurrent.futures.thread")
_WAITS: Final = 10

#: What libraries in C ask of an object that may not have it: NumPy and pybind11 take whatever happens there for a no.
_ASKED: Final = frozenset(
    {"__array__", "__eq__", "__float__", "__getattr__", "__getitem__", "__index__", "__iter__", "__len__"}
)


class Interrupts:
    """What became of Ctrl-C within a block of code.

    Python drops an exception that is raised in a finaliser or in a callback, a library that is imported may catch it,
    and one that calls Python may raise another in its place. The first two are raised again; for the third, `asked`
    says where the error comes from. What Python drops of that kind is not printed. While locks are taken and given
    back, or an object is asked what it is, an interrupt waits.

    Attributes
    ----------
    asked : bool
        Whether there was an interrupt.
    """

    def __init__(self) -> None:
        self.asked = False
        #: Number of the last call that is to come later: those before it are off.
        self._later_call = 0
        #: The import that was interrupted, and whether it is asked now what became of it.
        self._import: FrameType | None = None
        self._asks = False
        self._waited = 0

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
            self._later_call += 1
            self._import = None
            if self.asked and error is not None:
                error.__context__ = None  # what was half made is given up here, where nothing of it is printed
            sys.unraisablehook = self._before
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        asks, self._asks = self._asks, False
        if asks and not _is_whole(self._import):
            self._import = None  # the interrupt got through
            return
        if self._waited < _WAITS and _is_delicate(frame):
            self._waited += 1
            self._later(_thread.interrupt_main)
            return
        self._waited = 0
        self.asked = True
        self._import = next((each for each in reversed(_frames(frame)) if _is_imported(each)), None)
        if self._import is not None:
            self._later(self._ask)
        raise KeyboardInterrupt

    def _ask(self) -> None:
        self._asks = True
        _thread.interrupt_main()

    def _later(self, call: Callable[[], None]) -> None:
        self._later_call += 1
        # Not by `threading`, in the middle of which the interrupt may have come.
        _thread.start_new_thread(self._call, (call, self._later_call))

    def _call(self, call: Callable[[], None], number: int) -> None:
        time.sleep(_AGAIN)
        if number == self._later_call:
            call()

    def _dropped(self, unraisable: Any) -> None:
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._later(_thread.interrupt_main)
        elif not self.asked:
            self._before(unraisable)


def _is_whole(imported: FrameType | None) -> bool:
    """Whether the module of a frame is still there: an import that an exception ends takes it away again."""
    if imported is None:
        return False
    module = sys.modules.get(imported.f_globals.get("__name__", ""))
    return module is not None and vars(module) is imported.f_globals


def _is_delicate(frame: FrameType | None) -> bool:
    """Whether an exception would leave a lock behind here, or be lost."""
    if frame is None:
        return False
    # Of a module that is imported, whoever asked for it learns of the exception.
    inner = itertools.takewhile(lambda each: not _imports(each), _frames(frame))
    return frame.f_globals.get("__name__") in _LOCKING or any(each.f_code.co_name in _ASKED for each in inner)


def _frames(frame: FrameType | None) -> list[FrameType]:
    """Frames that are executed, from the innermost to the outermost."""
    found = []
    while frame is not None:
        found.append(frame)
        frame = frame.f_back
    return found


def _is_imported(frame: FrameType) -> bool:
    """Whether a frame is that of a module which is being imported."""
    return frame.f_code.co_name == "<module>" and frame.f_back is not None and _imports(frame.f_back)


def _imports(frame: FrameType) -> bool:
    """Whether a frame is of the code by which Python imports."""
    return frame.f_code.co_filename.startswith("<frozen importlib")
