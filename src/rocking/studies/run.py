"""Running a study: units to workers, results into the store, until all are done or somebody stops it.

Workers are threads of this process, any executor, or those of dask.distributed: of a scheduler, or of this machine.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator
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
from types import FrameType
from typing import Any, Final

from rocking import checks
from rocking.errors import InvalidOption, RockingError, StudyError, install
from rocking.progress import Progress, note
from rocking.studies.store import UnitArray
from rocking.studies.units import Key, Work, compute
from rocking.tables import counted
from rocking.threads import Cancellation, cores

#: Errors of a unit whose worker went away, or that was lost with it; every other one is the unit's own.
_LOST: Final = (CancelledError, BrokenExecutor, OSError, EOFError)

#: How often a cluster is asked how many workers it has, s.
_RECOUNT: Final = 1.0

#: Units that are handed out for each worker: one that it computes, and the next.
_AHEAD: Final = 2

#: How often a unit is handed out again whose worker died.
_RETRIES: Final = 3

#: How often the workers are asked whether they still live, s.
_POLL: Final = 0.5


_HERE: Final = "127.0.0.1"

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
        Whether it was asked to stop before all was done.
    """

    units: int
    simulations: int
    seconds: float
    failed: dict[str, str]
    stopped: bool

    def __add__(self, other: RunReport) -> RunReport:
        return RunReport(
            self.units + other.units,
            self.simulations + other.simulations,
            self.seconds + other.seconds,
            self.failed | other.failed,
            other.stopped,
        )

    def __str__(self) -> str:
        """Write it in one line."""
        rate = self.simulations / self.seconds if self.seconds > 0.0 else 0.0
        done = f"{counted(self.units, 'unit')}, {counted(self.simulations, 'simulation')}"
        text = f"{done} in {self.seconds:.1f} s ({rate:.3g} a second)"
        if self.failed:
            text += f"; {counted(len(self.failed), 'unit')} failed, the first: {next(iter(self.failed.values()))}"
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


def run(
    job: UnitArray,
    *,
    stop: Stop,
    threads: int | None,
    executor: Any,
    progress: bool | None,
    failing: Callable[[str, str], None],
) -> RunReport:
    """Compute all units that are not done, in threads or by any executor, until `stop` is asked to.

    `failing` gets the name of each unit that cannot be computed, and why, as it happens. A StudyError is raised if the
    workers are gone.
    """
    start = time.monotonic()
    missing = list(job.missing())
    units = simulations = 0
    failed: dict[str, str] = {}
    before = job.grid.total - sum(map(job.grid.simulations, missing))
    with (
        Progress(job.title, job.grid.total, show=progress, done=before) as bar,
        workers_of(executor, threads) as workers,
        contextlib.closing(_results(job, iter(missing), workers, stop)) as results,
    ):
        for key, outcome in results:
            if isinstance(outcome, bytes):
                job.put(key, outcome)
                units += 1
                simulations += job.grid.simulations(key)
                bar.advance(job.grid.simulations(key))
            else:
                failed[job.label(key)] = outcome
                failing(job.label(key), outcome)
                bar.note(f"{counted(len(failed), 'unit')} failed")
    stopped = stop.asked and units + len(failed) < len(missing)
    return RunReport(units, simulations, time.monotonic() - start, failed, stopped)


def _results(
    job: UnitArray, keys: Iterator[Key], workers: Workers, stop: Stop
) -> Generator[tuple[Key, bytes | str], None, None]:
    """Give the bytes of every unit as they come, or a sentence where it failed."""
    pending: dict[Future[bytes], Key] = {}
    tries: Counter[Key] = Counter()

    def submit(key: Key) -> None:
        tries[key] += 1
        pending[workers.submit(job.work(key))] = key

    try:
        while True:
            most = _AHEAD * max(1, workers.count)
            while len(pending) < most and not stop.asked and (key := next(keys, None)) is not None:
                submit(key)
            if not pending:
                return
            finished = wait(pending, timeout=_POLL, return_when=FIRST_COMPLETED).done
            workers.check()
            for future in finished:
                key = pending.pop(future)
                outcome = _outcome(future)
                if isinstance(outcome, BaseException):
                    workers.check(outcome)
                    if tries[key] <= _RETRIES:
                        submit(key)
                        continue
                    outcome = f"its worker died {tries[key]} times: {_reason(outcome)}"
                yield key, outcome
    finally:
        for future in pending:
            future.cancel()


def _outcome(future: Future[bytes]) -> bytes | str | BaseException:
    """Bytes of a unit, why it cannot be computed, or with which error its worker went away."""
    try:
        return future.result()
    except _LOST as error:
        return error
    except Exception as error:
        return _reason(error)


class Workers:
    """An executor, as far as a run needs to know it; that of dask.distributed knows its workers, and whether it lives.

    Threads look at whether they are `cancelled` to stop in the middle of a unit.
    """

    def __init__(self, pool: Executor, cancelled: Cancellation | None = None) -> None:
        self._pool, self._cancelled = pool, cancelled
        self._client: Any = getattr(pool, "_client", None)
        self._count, self._counted = 0, -_RECOUNT

    @property
    def count(self) -> int:
        """How many units can be computed at a time, now; 0 of a cluster that has no worker yet."""
        if self._client is None:
            return getattr(self._pool, "_max_workers", None) or cores()
        now = time.monotonic()
        if now - self._counted >= _RECOUNT:
            try:
                self._count, self._counted = sum(self._client.nthreads().values()), now
            except Exception as error:  # a client that loses its scheduler raises what its sockets raise
                raise _gone(error) from error
        return self._count

    def submit(self, work: Work) -> Future[bytes]:
        """Hand a unit to a worker, with all that it needs."""
        try:
            return self._pool.submit(compute, work, *([] if self._cancelled is None else [self._cancelled]))
        except RuntimeError as error:
            raise _gone(error) from error

    def check(self, error: BaseException | None = None) -> None:
        """Raise a StudyError if the executor knows that it is broken."""
        broken: Any = getattr(self._pool, "_broken", False)
        if (self._client is not None and self._client.status != "running") or broken:
            raise _gone(broken or ("no connection to the scheduler" if self._client is not None else error))


@contextlib.contextmanager
def workers_of(executor: Any, threads: int | None) -> Iterator[Workers]:
    """Workers of an executor, or threads, which stop in the middle of their units when this is left by an error."""
    if executor is not None:
        pool = executor.get_executor(pure=False) if hasattr(executor, "get_executor") else executor
        if not isinstance(pool, Executor):
            kinds = "a concurrent.futures.Executor or a client of dask.distributed"
            raise InvalidOption(f"{{}} must be {kinds}; got {checks.shown(executor)}", "executor", value=executor)
        yield Workers(pool)
        return
    cancelled = Cancellation()
    with ThreadPoolExecutor(threads or cores()) as pool:
        try:
            yield Workers(pool, cancelled)
        except BaseException:
            cancelled.asked = True
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _reason(error: BaseException) -> str:
    """Say in one line why a unit was not computed."""
    if type(error).__name__ == "KilledWorker":  # dask.distributed has handed it out again itself
        return f"its worker died {getattr(error, 'allowed_failures', 0) + 1} times"
    text = " ".join(str(error).split())
    return text if isinstance(error, RockingError) else f"{type(error).__name__}: {text}".removesuffix(": ")


def _gone(why: object) -> StudyError:
    return StudyError(f"the workers are gone: {why}; what was computed is kept, run the study again")


@contextlib.contextmanager
def scheduler_executor(address: str) -> Iterator[Executor]:
    """Give the workers of a scheduler, as ``tcp://127.0.0.1:8786``, as an executor; a StudyError if nobody answers.

    Certificates for ``tls://`` are taken from Dask's configuration.
    """
    distributed = _distributed()
    try:
        # A client that cannot connect would leave threads behind, and wait for them at the end.
        asyncio.run(_try_connection(distributed, address))
    except Exception as error:  # whatever the address, the certificates and the sockets raise
        raise StudyError(f"there is no scheduler at {address}: {' '.join(str(error).split())}") from error
    with distributed.Client(address, timeout=_ANSWER, set_as_default=False) as client:
        if not client.nthreads():
            note(f"no worker has come to {address} yet; the run goes on as they come")
        yield client.get_executor(pure=False)


@contextlib.contextmanager
def local_executor(workers: int) -> Iterator[Executor]:
    """Give so many processes of this machine, of one thread each, as an executor; nobody else can reach them."""
    distributed = _distributed()
    here: dict[str, Any] = {
        "host": _HERE,
        "dashboard_address": f"{_HERE}:0",
        "worker_dashboard_address": f"{_HERE}:0",
    }
    with (
        distributed.LocalCluster(
            n_workers=workers, threads_per_worker=1, preload=[__name__], silence_logs=logging.CRITICAL, **here
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client.get_executor(pure=False)


def dask_setup(worker: object) -> None:
    """Leave signals to the process that runs the study: what a terminal sends reaches the workers, too.

    dask.distributed calls this in every worker of `local_executor` when it starts.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


async def _try_connection(distributed: Any, address: str) -> None:
    """Connect, as a client does, and go."""
    credentials = distributed.Security().get_connection_args("client")
    connection = await distributed.comm.connect(address, timeout=_ANSWER, **credentials)
    await connection.close()


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise InvalidOption(f"a cluster needs dask.distributed: {install('cluster')}") from None
    # What is worth saying of workers that come and go is said in sentences of our own.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    return distributed
