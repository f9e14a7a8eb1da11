"""Parallel computation in threads that stops cleanly on an interrupt."""

from __future__ import annotations

import itertools
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sized
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Final, TypeVar

Item = TypeVar("Item")
Output = TypeVar("Output")

#: Items per thread that are submitted ahead of the oldest pending result.
LOOKAHEAD: Final = 16


def cores() -> int:
    """Count the cores available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_threads(
    function: Callable[[Item], Output],
    items: Iterable[Item],
    *,
    threads: int | None = None,
    cancelled: threading.Event | None = None,
) -> Iterator[Output]:
    """Yield the results of some work on each item, in order, by default with one thread per core.

    Items are consumed as needed, some per thread ahead of the results. The first of several failed items determines the
    error. On an early exit, for example an interrupt, `cancelled` is set, running work is awaited, and other work is
    discarded.
    """
    count = min(cores() if threads is None else threads, len(items) if isinstance(items, Sized) else 2**16)
    if count < 2:
        yield from map(function, items)
        return
    remaining, pending = iter(items), deque[Future[Output]]()
    pool = ThreadPoolExecutor(count)
    try:
        while True:
            for item in itertools.islice(remaining, LOOKAHEAD * count - len(pending)):
                pending.append(pool.submit(function, item))
            if not pending:
                return
            yield pending.popleft().result()
    finally:
        if cancelled is not None:
            cancelled.set()
        pool.shutdown(cancel_futures=True)
