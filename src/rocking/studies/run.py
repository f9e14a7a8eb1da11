"""Running a study: units to workers, results into the store, until all are done or SIGTERM asks to stop.

Workers are threads of this process, or those of any executor; dask.distributed has one for many machines.
"""

from __future__ import annotations

import contextlib
import importlib
import itertools
import logging
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from dataclasses import dataclass
from typing import Any, Final

from rocking import checks
from rocking.errors import InvalidOption, RockingError, StudyError, install
from rocking.progress import Progress, note
from rocking.studies.store import Store
from rocking.studies.units import Key, Work, compute, name_of
from rocking.tables import counted
from rocking.threads import cores

#: Units that are handed out for each worker: one that it computes, and the next.
_AHEAD: Final = 2

#: How often the number of workers is asked for, and whether they still live, s.
_POLL: Final = 1.0

#: How long a scheduler may take to answer, s.
_ANSWER: Final = 5.0


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
        Whether SIGTERM stopped it before all was done.
    """

    units: int
    simulations: int
    seconds: float
    failed: dict[str, str]
    stopped: bool

    def __str__(self) -> str:
        """Write it in one line."""
        rate = self.simulations / self.seconds if self.seconds > 0.0 else 0.0
        done = f"{counted(self.units, 'unit')}, {counted(self.simulations, 'simulation')}"
        text = f"{done} in {self.seconds:.1f} s ({rate:.3g} a second)"
        if self.failed:
            text += f"; {counted(len(self.failed), 'unit')} failed, the first: {next(iter(self.failed.values()))}"
        return text + ("; stopped, go on with another run" if self.stopped else "")


def run(
    store: Store,
    share: Sequence[Key],
    *,
    threads: int | None,
    executor: Any,
    progress: bool | None,
    failing: Callable[[str, str], None],
) -> RunReport:
    """Compute the units of a share that are not done, in threads or by an executor, until SIGTERM asks to stop.

    Units in hand are finished then.
    `failing` gets the name of each unit that cannot be computed, and why, as it happens. A StudyError is raised if the
    workers are gone.
    """
    start, units, simulations = time.monotonic(), 0, 0
    failed: dict[str, str] = {}
    done, pending = store.done(), dict[Future[bytes], Key]()
    missing = [key for key in share if key not in done]
    left, total = iter(missing), sum(map(store.grid.simulations, share))
    before = total - sum(map(store.grid.simulations, missing))
    with (
        Progress("simulations", total, show=progress, done=before) as bar,
        _workers(executor, threads) as (submit, count),
        _terminated() as stop,
    ):
        try:
            while True:
                if not stop.is_set():
                    for key in itertools.islice(left, max(_AHEAD * max(1, count()) - len(pending), 0)):
                        pending[submit(store.work(key))] = key
                if not pending:
                    break
                for future in wait(pending, timeout=_POLL, return_when=FIRST_COMPLETED).done:
                    key = pending.pop(future)
                    try:
                        data = future.result()
                    except (BrokenExecutor, CancelledError) as error:
                        raise _gone(error) from error
                    except Exception as error:
                        failed[name_of(key)] = _reason(error)
                        failing(name_of(key), failed[name_of(key)])
                        bar.note(f"{counted(len(failed), 'unit')} failed")
                        continue
                    store.put(key, data)
                    units += 1
                    simulations += store.grid.simulations(key)
                    bar.advance(store.grid.simulations(key))
        finally:
            for future in pending:
                future.cancel()
    stopped = stop.is_set() and units + len(failed) < len(missing)
    return RunReport(units, simulations, time.monotonic() - start, failed, stopped)


@contextlib.contextmanager
def _terminated() -> Iterator[threading.Event]:
    """Give what SIGTERM sets, where this is the main thread."""
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = signal.signal(signal.SIGTERM, lambda *_: stop.set())
    try:
        yield stop
    finally:
        signal.signal(signal.SIGTERM, before)


@contextlib.contextmanager
def _workers(executor: Any, threads: int | None) -> Iterator[tuple[Callable[[Work], Future[bytes]], Callable[[], int]]]:
    """Give what hands a unit to a worker, and what counts the workers.

    Threads stop within their units when this is left by an error.
    """
    if executor is None:
        cancelled, pool = threading.Event(), ThreadPoolExecutor(threads or cores())
        try:
            yield lambda work: pool.submit(compute, work, cancelled), lambda: threads or cores()
        finally:
            cancelled.set()
            pool.shutdown(cancel_futures=True)
        return
    client: Any = executor if hasattr(executor, "get_executor") else getattr(executor, "_client", None)
    foreign = executor.get_executor(pure=False) if client is executor else executor
    if not isinstance(foreign, Executor):
        kinds = "a concurrent.futures.Executor or a client of dask.distributed"
        raise InvalidOption(f"{{}} must be {kinds}; got {checks.shown(executor)}", "executor", value=executor)

    def submit(work: Work) -> Future[bytes]:
        try:
            return foreign.submit(compute, work)
        except RuntimeError as error:  # also BrokenExecutor
            raise _gone(error) from error

    def count() -> int:
        if client is None:
            return getattr(foreign, "_max_workers", None) or cores()
        try:
            if client.status == "running":
                return sum(client.nthreads().values())
        except Exception as error:  # a client that loses its scheduler raises what its sockets raise
            raise _gone(error) from error
        raise _gone("no connection to the scheduler")

    yield submit, count


def _reason(error: BaseException) -> str:
    """Return in one line why a unit was not computed."""
    text = " ".join(str(error).split())
    return text if isinstance(error, RockingError) else f"{type(error).__name__}: {text}".removesuffix(": ")


def _gone(why: object) -> StudyError:
    return StudyError(f"the workers are gone: {why}; what was computed is kept, run the study again")


@contextlib.contextmanager
def scheduler_client(address: str) -> Iterator[Any]:
    """Give a client of a scheduler of dask.distributed, as ``tcp://127.0.0.1:8786``; a StudyError if nobody answers.

    Certificates for ``tls://`` are taken from Dask's configuration.
    """
    try:
        distributed: Any = importlib.import_module("distributed")
    except ImportError:
        raise InvalidOption(f"a cluster needs dask.distributed: {install('cluster')}") from None
    # A run reports itself what matters about workers that come and go.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = distributed.Client(address, timeout=_ANSWER, set_as_default=False)
    except Exception as error:  # whatever the address, the certificates and the sockets raise
        raise StudyError(f"there is no scheduler at {address}: {' '.join(str(error).split())}") from error
    with client:
        if not client.nthreads():
            note(f"no worker has come to {address} yet; the run goes on as they come")
        yield client
