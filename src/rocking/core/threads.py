"""Parallel work on many items in threads that stops cleanly when interrupted."""

from __future__ import annotations

import itertools
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sized
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Final, TypeVar

Item = TypeVar("Item")
Found = TypeVar("Found")

#: Items per thread that are submitted ahead of the oldest pending result.
AHEAD: Final = 16


def cores() -> int:
    """Count the cores available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_threads(
    work: Callable[[Item], Found],
    items: Iterable[Item],
    *,
    threads: int | None = None,
    cancelled: threading.Event | None = None,
) -> Iterator[Found]:
    """Yield the results of some work on each item, in order, by default with one thread per core.

    Items are consumed as needed, some per thread ahead of the results. The first of several failed items determines the
    error. On an early exit, for example an interrupt, `cancelled` is set, running work is awaited, and other work is
    discarded.
    """
    count = min(cores() if threads is None else threads, len(items) if isinstance(items, Sized) else 2**16)
    if count < 2:
        yield from map(work, items)
        return
    left, pending = iter(items), deque[Future[Found]]()
    pool = ThreadPoolExecutor(count)
    try:
        while True:
            for item in itertools.islice(left, AHEAD * count - len(pending)):
                pending.append(pool.submit(work, item))
            if not pending:
                return
            yield pending.popleft().result()
    finally:
        if cancelled is not None:
            cancelled.set()
        pool.shutdown(cancel_futures=True)
