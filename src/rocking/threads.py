"""Work on many items in threads, of which an interrupt leaves no thread and no lock behind.

Who waits here takes none of the locks of `concurrent.futures`: an exception between two lines of that, as that of
Ctrl-C, leaves a lock that nobody opens any more, and then the end of the threads never comes. To start a thread takes
such a lock for a moment; the command line keeps an interrupt back for so long.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from queue import Empty, SimpleQueue
from typing import Any, Final, TypeVar

Item = TypeVar("Item")
Found = TypeVar("Found")

#: Items that are handed out ahead of the results, for each thread.
AHEAD: Final = 2

_NO_MORE: Final = object()


class Cancellation:
    """What work that takes long looks at on its way: whether nobody waits for it any more."""

    def __init__(self) -> None:
        self.asked = False


def cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_threads(work: Callable[[Item], Found], items: Sequence[Item], *, threads: int | None = None) -> Iterator[Found]:
    """Results of some work on each item, in their order; by default in a thread for every core.

    An interrupt leaves the rest undone. Of several errors the one of the first item is raised.
    """
    count = min(cores() if threads is None else threads, len(items))
    if count < 2:
        yield from map(work, items)
        return
    early: dict[int, tuple[Any, Exception | None]] = {}
    following = 0
    for (number, _), tried in as_done(lambda each: _tried(work, each[1]), enumerate(items), count, ahead=math.inf):
        early[number] = tried
        while following in early:
            found, error = early.pop(following)
            if error is not None:
                raise error
            yield found
            following += 1


def _tried(work: Callable[[Item], Found], item: Item) -> tuple[Found | None, Exception | None]:
    try:
        return work(item), None
    except Exception as error:
        return None, error


def as_done(
    work: Callable[[Item], Found],
    items: Iterable[Item],
    count: int,
    *,
    ahead: float = AHEAD,
    cancelled: Cancellation | None = None,
) -> Iterator[tuple[Item, Found]]:
    """Items with the result of some work on each, as so many threads have done it; its first error is raised.

    Items are taken as they are needed, so many for each thread ahead of the results. What leaves this early, as an
    interrupt, has the work in hand ``cancelled``, and waits for its end.
    """
    given: SimpleQueue[Any] = SimpleQueue()
    done: SimpleQueue[Any] = SimpleQueue()
    waiting = begun = 0
    try:
        for _ in range(count):
            threading.Thread(target=_serve, args=(work, given, done), daemon=True).start()
            begun += 1
        for item in items:
            given.put(item)
            waiting += 1
            if waiting >= ahead * count:
                yield _next(done)
                waiting -= 1
        while waiting:
            yield _next(done)
            waiting -= 1
    finally:
        if cancelled is not None:
            cancelled.asked = True
        _empty(given)
        for _ in range(count):
            given.put(_NO_MORE)
        while begun:
            begun -= done.get() is _NO_MORE


def _serve(work: Callable[[Any], Any], given: SimpleQueue[Any], done: SimpleQueue[Any]) -> None:
    """Do what is given until there is no more."""
    while (item := given.get()) is not _NO_MORE:
        try:
            done.put((item, work(item), None))
        except BaseException as error:
            done.put((item, None, error))
    done.put(_NO_MORE)


def _next(done: SimpleQueue[Any]) -> tuple[Any, Any]:
    item, found, error = done.get()
    if error is not None:
        raise error
    return item, found


def _empty(queue: SimpleQueue[Any]) -> None:
    try:
        while True:
            queue.get_nowait()
    except Empty:
        return
