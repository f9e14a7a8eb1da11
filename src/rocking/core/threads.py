"""Work on many items in threads, of which nothing is left to do when it is interrupted."""

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

#: Items that are handed out ahead of the oldest result that is not done, for each thread.
AHEAD: Final = 16


def cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_threads(
    work: Callable[[Item], Found],
    items: Iterable[Item],
    *,
    threads: int | None = None,
    cancelled: threading.Event | None = None,
) -> Iterator[Found]:
    """Results of some work on each item, in their order; by default in a thread for every core.

    Items are taken as they are needed, some for each thread ahead of the results. Of several errors that of the first
    item is raised. When this is left early, as by an interrupt, `cancelled` is set for the work in hand, which is
    waited for, and the rest is left undone.
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
