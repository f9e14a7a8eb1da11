"""Who computes the units of a study: threads of this process, or whatever an executor stands for."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from typing import Any, Final

from rocking.engine import cores
from rocking.errors import RockingError, StudyError
from rocking.studies.units import PointsWork, Work, compute

#: Errors of a unit whose worker went away, or that was lost with it; every other one is the unit's own.
LOST: Final = (CancelledError, BrokenExecutor, OSError, EOFError)

#: How often a cluster is asked how many workers it has, s.
_PATIENCE: Final = 1.0


class Workers:
    """An executor, as far as a run needs to know it.

    Parameters
    ----------
    pool : concurrent.futures.Executor
        Who computes; that of dask.distributed tells how many workers it has now, and whether it lost them all.
    stop : threading.Event, optional
        What threads look at to stop in the middle of a unit.
    """

    def __init__(self, pool: Executor, stop: threading.Event | None = None) -> None:
        self._pool, self._stop = pool, stop
        self._client: Any = getattr(pool, "_client", None)
        self._count, self._counted = 0, -_PATIENCE

    @property
    def count(self) -> int:
        """How many units can be computed at a time, now; 0 of a cluster that has no worker yet."""
        if self._client is None:
            return getattr(self._pool, "_max_workers", None) or cores()
        now = time.monotonic()
        if now - self._counted >= _PATIENCE:
            try:
                self._count, self._counted = sum(self._client.nthreads().values()), now
            except Exception as error:  # a client that loses its scheduler raises what its sockets raise
                raise _gone(error) from error
        return self._count

    def submit(self, work: Work | PointsWork) -> Future[bytes]:
        """Hand a unit to a worker, with all that it needs.

        Raises
        ------
        StudyError
            If the workers are gone.
        """
        try:
            return self._pool.submit(compute, work, *([] if self._stop is None else [self._stop]))
        except RuntimeError as error:
            raise _gone(error) from error

    def check(self, error: BaseException | None = None) -> None:
        """Check that an executor which knows whether it lives, does.

        Raises
        ------
        StudyError
            If it does not.
        """
        broken: Any = getattr(self._pool, "_broken", False)
        if (self._client is not None and self._client.status != "running") or broken:
            raise _gone(broken or ("no connection to the scheduler" if self._client is not None else error))


@contextlib.contextmanager
def workers_of(executor: Executor | None, threads: int | None) -> Iterator[Workers]:
    """Workers of an executor, or threads, which stop in the middle of their units when this is left by an error."""
    if executor is not None:
        yield Workers(executor)
        return
    stop = threading.Event()
    with ThreadPoolExecutor(threads or cores()) as pool:
        try:
            yield Workers(pool, stop)
        except BaseException:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def sentence(error: BaseException) -> str:
    """Say in one line why a unit was not computed."""
    if type(error).__name__ == "KilledWorker":  # dask.distributed has handed it out again itself
        return f"its worker died {getattr(error, 'allowed_failures', 0) + 1} times"
    text = " ".join(str(error).split())
    return text if isinstance(error, RockingError) else f"{type(error).__name__}: {text}".removesuffix(": ")


def _gone(why: object) -> StudyError:
    return StudyError(f"the workers are gone: {why}; what was computed is kept, run the study again")
