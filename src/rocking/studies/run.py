"""Running a study: units to workers, results into the store, until all are done or somebody stops it."""

from __future__ import annotations

import contextlib
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass
from types import FrameType
from typing import Final, Protocol

from rocking.compiling import SIMULATIONS, announce
from rocking.progress import Progress
from rocking.studies.units import Grid, Key, Line, PointsWork, Work
from rocking.studies.workers import LOST, Workers, sentence, workers_of
from rocking.tables import counted

#: Units that are handed out for each worker: one that it computes, and the next.
_AHEAD: Final = 2

#: How often a unit is handed out again whose worker died.
_AGAIN: Final = 3

#: How often the workers are asked whether they still live, s.
_PULSE: Final = 0.5


class Job(Protocol):
    """Units to compute: those of a study's grid, or of a round of its refinement."""

    @property
    def title(self) -> str:
        """What is counted while it runs, in a few words."""

    @property
    def grid(self) -> Grid | Line:
        """How the simulations are cut into units."""

    def missing(self) -> Iterator[Key]:
        """Keys of the units that are not done, in order."""

    def work(self, key: Key) -> Work | PointsWork:
        """Return all that a worker needs for a unit."""

    def put(self, key: Key, data: bytes) -> None:
        """Store a unit."""

    def label(self, key: Key) -> str:
        """Name a unit."""


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
        """Return what both did, one after the other."""
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
    job: Job,
    *,
    stop: Stop,
    threads: int | None,
    executor: Executor | None,
    progress: bool | None,
    failing: Callable[[str, str], None],
) -> RunReport:
    """Compute all units that are not done; in threads, or by any executor.

    Parameters
    ----------
    job : Job
        The units.
    stop : Stop
        Who is asked whether to stop.
    threads, executor, progress
        As for `Study.run`.
    failing : callable
        Told the name of each unit that cannot be computed, and why, as it happens.

    Raises
    ------
    StudyError
        If the workers are gone.
    """
    announce(SIMULATIONS)
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
    job: Job, keys: Iterator[Key], workers: Workers, stop: Stop
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
            finished = wait(pending, timeout=_PULSE, return_when=FIRST_COMPLETED).done
            workers.check()
            for future in finished:
                key = pending.pop(future)
                outcome = _outcome(future)
                if isinstance(outcome, BaseException):
                    workers.check(outcome)
                    if tries[key] <= _AGAIN:
                        submit(key)
                        continue
                    outcome = f"its worker died {tries[key]} times: {sentence(outcome)}"
                yield key, outcome
    finally:
        for future in pending:
            future.cancel()


def _outcome(future: Future[bytes]) -> bytes | str | BaseException:
    """Bytes of a unit, why it cannot be computed, or with which error its worker went away."""
    try:
        return future.result()
    except LOST as error:
        return error
    except Exception as error:
        return sentence(error)
