"""Parallel computation in threads that stops cleanly on an interrupt."""

from __future__ import annotations

import itertools
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sized
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import ContextVar
from typing import Final, NamedTuple, TypeVar

from rocking.core import checks
from rocking.errors import OptionError

Item = TypeVar("Item")
Output = TypeVar("Output")

#: Items per thread that are submitted ahead of the oldest pending result.
ITEMS_AHEAD_PER_THREAD: Final = 16


class _Options(NamedTuple):
    """Options of long computations; None is the default."""

    threads: int | None = None
    progress: bool | None = None


_DEFAULT_OPTIONS: Final = _Options()
_options: Final = ContextVar[_Options]("options")


class set_options:  # noqa: N801 - used as a function and as a context manager
    """Set the number of threads and the progress bar of long computations, for a ``with`` block or until changed.

    Parameters
    ----------
    threads : int, optional
        Number of threads; one per available core until it is set.
    progress : bool, optional
        Whether to draw progress bars on stderr; until it is set, if stderr is a terminal.

    Raises
    ------
    OptionError
        If `threads` is not a positive integer, or `progress` is not a boolean.

    See Also
    --------
    simulate_many : Simulate many blocks under many motions.

    Notes
    -----
    The options apply to the current thread (or task of asyncio). An argument that is left out keeps its value. Results
    do not depend on the number of threads.

    Examples
    --------
    >>> import rocking
    >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.2])
    >>> with rocking.set_options(threads=1, progress=False):
    ...     table = rocking.simulate_many(blocks, rocking.pulses.one_sine(amplitude=3.0, frequency=1.0))
    >>> table.sizes["block"]
    2
    """

    def __init__(self, *, threads: int | None = None, progress: bool | None = None) -> None:
        options = _options.get(_DEFAULT_OPTIONS)
        if threads is not None:
            options = options._replace(threads=checks.integer(threads, "threads", OptionError, minimum=1))
        if progress is not None:
            options = options._replace(progress=checks.boolean(progress, "progress", OptionError))
        self._token = _options.set(options)

    def __enter__(self) -> None:
        return

    def __exit__(self, *error: object) -> None:
        _options.reset(self._token)


def choose_thread_count() -> int:
    """Return the number of threads of long computations."""
    return _options.get(_DEFAULT_OPTIONS).threads or count_cores()


def read_progress_option() -> bool | None:
    """Return whether to draw progress bars, or None by default."""
    return _options.get(_DEFAULT_OPTIONS).progress


def count_cores() -> int:
    """Count the cores available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def map_in_threads(
    function: Callable[[Item], Output], items: Iterable[Item], *, cancelled: threading.Event | None = None
) -> Iterator[Output]:
    """Yield the results of some work on each item, in order, from the number of threads in `set_options`.

    Items are consumed as needed, some per thread ahead of the results. The first of several failed items determines the
    error. On an early exit, for example an interrupt, `cancelled` is set, running work is awaited, and other work is
    discarded.
    """
    count = min(choose_thread_count(), len(items) if isinstance(items, Sized) else 2**16)
    if count < 2:
        yield from map(function, items)
        return
    remaining, pending = iter(items), deque[Future[Output]]()
    pool = ThreadPoolExecutor(count)
    try:
        while True:
            for item in itertools.islice(remaining, ITEMS_AHEAD_PER_THREAD * count - len(pending)):
                try:
                    pending.append(pool.submit(function, item))
                except RuntimeError as error:
                    if pending or "start new thread" not in str(error):
                        raise
                    yield from map(function, itertools.chain([item], remaining))  # a system without threads
            if not pending:
                return
            yield pending.popleft().result()
    finally:
        if cancelled is not None:
            cancelled.set()
        pool.shutdown(cancel_futures=True)
