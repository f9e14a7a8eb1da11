"""Running a study: units to workers, results into the store, until all are done or somebody stops it."""

from __future__ import annotations

import contextlib
import signal
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from types import FrameType
from typing import Any, Final

from rocking.engine import cores
from rocking.errors import RockingError, StudyError
from rocking.progress import Progress
from rocking.studies.store import Store
from rocking.studies.units import Key, compute

#: Units that are handed out ahead of the results, for each worker.
_AHEAD: Final = 2

#: How often a unit is tried whose worker died.
_TRIES: Final = 3

#: How often the executor is asked whether it still lives, s.
_PULSE: Final = 0.5


@dataclass(frozen=True)
class RunReport:
    """What one run did.

    Attributes
    ----------
    units : int
        Units that were computed.
    simulations : int
        Simulations in them.
    seconds : float
        Time it took.
    failed : mapping
        Sentence for each unit that could not be computed, by its name.
    stopped : bool
        Whether it was asked to stop before all was done.
    """

    units: int
    simulations: int
    seconds: float
    failed: dict[str, str]
    stopped: bool

    def __str__(self) -> str:
        """Write it in one line."""
        rate = self.simulations / self.seconds if self.seconds > 0.0 else 0.0
        text = f"{self.units} units, {self.simulations} simulations in {self.seconds:.1f} s ({rate:.3g} a second)"
        if self.failed:
            text += f"; {len(self.failed)} units failed, the first: {next(iter(self.failed.values()))}"
        return text + ("; stopped, go on with another run" if self.stopped else "")


class Stop:
    """What SIGINT and SIGTERM ask for: the first to finish the units in hand, the second to stop at once."""

    def __init__(self) -> None:
        self.asked = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Take note of a signal."""
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True

    @contextlib.contextmanager
    def listening(self) -> Iterator[None]:
        """Listen to the signals, where this is the main thread."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = {number: signal.signal(number, self) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def run(store: Store, *, threads: int | None, executor: Executor | None, progress: bool | None) -> RunReport:
    """Compute all units that are not done; in threads, or by any executor.

    Raises
    ------
    StudyError
        If the executor dies.
    """
    start, stop = time.monotonic(), Stop()
    missing = list(store.missing())
    done = {"units": 0, "simulations": 0}
    failed: dict[str, str] = {}
    total = sum(store.grid.simulations(key) for key in store.grid)
    left = sum(store.grid.simulations(key) for key in missing)
    with (
        stop.listening(),
        Progress("simulating", total, show=progress, done=total - left) as bar,
        _pool(executor, threads) as (pool, workers),
    ):
        for key, outcome in _results(store, iter(missing), pool, workers * _AHEAD, stop):
            if isinstance(outcome, bytes):
                store.put(key, outcome)
                count = store.grid.simulations(key)
                done["units"] += 1
                done["simulations"] += count
                bar.advance(count)
            else:
                failed[".".join(map(str, key))] = outcome
                bar.note(f"{len(failed)} units failed")
    stopped = stop.asked and done["units"] + len(failed) < len(missing)
    return RunReport(done["units"], done["simulations"], time.monotonic() - start, failed, stopped)


@contextlib.contextmanager
def _pool(executor: Executor | None, threads: int | None) -> Iterator[tuple[Executor, int]]:
    """Give the executor, or one of threads, and how many workers it has at least."""
    if executor is not None:
        yield executor, getattr(executor, "_max_workers", None) or cores()
        return
    count = threads or cores()
    pool = ThreadPoolExecutor(count)
    try:
        yield pool, count
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _results(
    store: Store, keys: Iterator[Key], pool: Executor, most: int, stop: Stop
) -> Iterator[tuple[Key, bytes | str]]:
    """Give the bytes of every unit as they come, or a sentence where it failed."""
    pending: dict[Future[bytes], Key] = {}
    tries: Counter[Key] = Counter()

    def submit(key: Key) -> None:
        tries[key] += 1
        pending[_submitted(store, key, pool)] = key

    while True:
        while len(pending) < most and not stop.asked and (key := next(keys, None)) is not None:
            submit(key)
        if not pending:
            return
        finished = wait(pending, timeout=_PULSE, return_when=FIRST_COMPLETED).done
        _check_alive(pool)
        for future in finished:
            key = pending.pop(future)
            try:
                yield key, future.result()
            except RockingError as error:
                yield key, str(error)
            except (CancelledError, Exception) as error:  # the worker died, or its task was lost with it
                _check_alive(pool, error)
                if tries[key] >= _TRIES:
                    yield key, f"the worker died {_TRIES} times: {error or type(error).__name__}"
                else:
                    submit(key)


def _submitted(store: Store, key: Key, pool: Executor) -> Future[bytes]:
    """Hand a unit to a worker, with all that it needs."""
    try:
        return pool.submit(compute, *store.work(key))
    except RuntimeError as error:
        raise StudyError(f"the workers are gone: {error}; what was computed is kept, run the study again") from error


def _check_alive(pool: Executor, error: BaseException | None = None) -> None:
    """Check that an executor which knows whether it lives, does."""
    client: Any = getattr(pool, "_client", None)
    broken: Any = getattr(pool, "_broken", False)
    if (client is not None and client.status != "running") or broken:
        raise StudyError(
            f"the workers are gone: {error or broken or 'no connection to the scheduler'}; what was computed is kept, "
            "run the study again"
        )
