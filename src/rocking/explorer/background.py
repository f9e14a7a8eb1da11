"""Long work that gives way to short work."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Final

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
