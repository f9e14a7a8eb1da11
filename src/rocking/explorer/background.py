"""Long work that gives way to short: a thread of low priority, and whatever threads it starts."""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Final, TypeVar

T = TypeVar("T")

#: Lowest of all: it takes what others leave, and all of it where they leave everything.
_NICENESS: Final = 19


@contextmanager
def behind_others() -> Iterator[Executor]:
    """Give a thread that takes the processor only where nobody else wants it.

    Where the system knows priorities of threads (Linux) those that it starts have the same one; elsewhere it is an
    ordinary thread.
    """
    with ThreadPoolExecutor(1, "rocking-behind", initializer=_give_way) as executor:
        yield executor


async def result_of(executor: Executor, work: Callable[[], T]) -> T:
    """Return what some work gives, done by an executor."""
    return await asyncio.wrap_future(executor.submit(work))


def _give_way() -> None:
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)
