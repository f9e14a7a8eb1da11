"""Work in the background: compiling before anybody waits for it, and long work that gives way to short."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, Final

from rocking.kernels import signatures

#: What responses, maps and periodic motion need.
_KERNELS: Final = (
    "ground.fill", "march.march", "trace.trace", "trace.vary", "uplift.note_complete", "lanes.run_lanes",
    "lanes.march_each", "periodic.iterate", "periodic.differentiate", "adjoint.adjoint", "adjoint.of_ending",
    "uplift.next_uplifts",
)  # fmt: skip

#: Lowest priority of all: such a thread takes what others leave, and all of it where they leave everything.
_NICENESS: Final = 19


@contextmanager
def low_priority() -> Iterator[Executor]:
    """Give an executor of one thread that takes the processor only where nobody else wants it.

    Where the system knows priorities of threads (Linux) those that it starts have the same one; elsewhere it is an
    ordinary thread.
    """
    with ThreadPoolExecutor(1, "rocking-low-priority", initializer=_lower_priority) as executor:
        yield executor


def _lower_priority() -> None:
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)


class Compilation:
    """Compiles what responses and maps need, once, in a thread."""

    def __init__(self) -> None:
        self._thread = threading.Thread(target=self._run, name="rocking-compilation", daemon=True)
        self._started: float | None = None
        self._took: float | None = None

    def start(self) -> None:
        """Start it, if it has not been started."""
        if self._started is None:
            self._started = time.monotonic()
            self._thread.start()

    def state(self) -> dict[str, Any]:
        """Say whether all is compiled, and for how long it has been going on, s."""
        started = time.monotonic() if self._started is None else self._started
        return {"done": self._took is not None, "seconds": self._took or time.monotonic() - started}

    def _run(self) -> None:
        assert self._started is not None
        _compile()
        self._took = time.monotonic() - self._started


def _compile() -> None:
    import scipy.signal  # noqa: F401 - it takes a second, and the ground's displacement needs it

    signatures.prepare(*_KERNELS)
