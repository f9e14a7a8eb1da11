"""Running a study: units to workers, results into the store, until all are done or SIGTERM asks to stop.

Workers are threads of this process, or those of any executor; dask.distributed has one for many machines.
"""

from __future__ import annotations

import contextlib
import importlib
import itertools
import json
import logging
import math
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
from datetime import datetime
from typing import Any, Final

import numpy as np

from rocking.core import checks
from rocking.core.progress import Progress, note
from rocking.core.tables import counted
from rocking.core.threads import cores
from rocking.errors import InvalidOption, RockingError, StudyError, install
from rocking.studies.folder import Folder, Store, this_process
from rocking.studies.report import kept_report
from rocking.studies.units import Key, Work, compute, name_of

#: The log of all runs; one of a part has a name of its own, as its lock has ("runs.3-10.jsonl" and "lock.3-10").
_RUNS: Final = "runs.jsonl"


#: How long a scheduler may take to answer, s.
_ANSWER: Final = 5.0


@dataclass(frozen=True)
class Running:
    """A run that goes on, or the runs of several parts together.

    Attributes
    ----------
    holder : str
        Process and host.
    rate : float
        Simulations a second since it started.
    seconds_left : float
        Time that it will take at this rate; infinite before its first unit.
    """

    holder: str
    rate: float
    seconds_left: float

    def __str__(self) -> str:
        is_known = math.isfinite(self.seconds_left)
        left = f"{self.seconds_left:.0f} s left" if is_known else "its first unit is not done yet"
        return f"being run by {self.holder}: {self.rate:.3g} simulations a second, {left}"


@dataclass(frozen=True)
class Status:
    """Progress of a study.

    Attributes
    ----------
    done, units, simulations : int
        Units that are done, all units, and simulations in all.
    failed : mapping
        Sentence for each unit that the last run could not compute.
    running : Running or None
        The present run, where there is one.
    runs : tuple
        Events of every run, as `runs.jsonl` has them, and after it of those of parts.
    """

    done: int
    units: int
    simulations: int
    failed: dict[str, str]
    running: Running | None
    runs: tuple[dict[str, Any], ...]

    @property
    def complete(self) -> bool:
        """Whether every unit is done."""
        return self.done == self.units

    def __str__(self) -> str:
        share = math.floor(1000.0 * self.done / self.units) / 10.0  # 100 % only where all are
        done = f"{self.done} of {counted(self.units, 'unit')} done ({share:.1f} %)"
        text = f"{done}, {counted(self.simulations, 'simulation')} in all"
        text += f"; {len(self.failed)} failed in the last run" if self.failed else ""
        return text + (f"; {self.running}" if self.running else "")


def log_run(folder: Folder, lock: str, entry: dict[str, Any]) -> None:
    """Append an entry to the log of the run that holds a lock, with the time and this process."""
    who = {"time": datetime.now().astimezone().isoformat(timespec="seconds"), "by": this_process()}
    folder.append(_RUNS.replace("runs", lock.replace("lock", "runs")), json.dumps(who | entry))


def _entries(data: bytes) -> Iterator[dict[str, Any]]:
    """Give the entries of a log; a line that was cut off by a crash is passed over."""
    for line in data.splitlines():
        with contextlib.suppress(ValueError):
            if isinstance(entry := json.loads(line), dict):
                yield entry


def status_of(store: Store) -> Status:
    """Return how far a study has come; other processes may run it."""
    folder, done, grid = store.folder, store.done(), store.grid
    logs = {
        name.replace("runs", "lock").removesuffix(".jsonl"): [*_entries(folder.get(name) or b"")]
        for name in sorted(folder.names(), key=lambda name: (name != _RUNS, name))
        if name.startswith("runs.") and name.endswith(".jsonl")
    }
    last = {
        lock: entries[max(k for k, each in enumerate(entries) if each.get("event") == "start") :]
        for lock, entries in logs.items()
        if any(each.get("event") == "start" for each in entries)
    }
    names = {*map(name_of, done)}
    failed = {
        each["unit"]: each["why"]
        for entries in last.values()
        for each in entries
        if each.get("event") == "failed" and each["unit"] not in names
    }
    simulated, holders = sum(map(grid.simulations, done)), folder.holders()
    starts = [last[lock][0] for lock in holders if lock in last]
    running = None
    if starts:
        first = min(starts, key=lambda start: datetime.fromisoformat(start["time"]))
        seconds = time.time() - datetime.fromisoformat(first["time"]).timestamp()
        rate = max(simulated - first["done"], 0) / max(seconds, 1.0)
        running = Running(", ".join(holders.values()), rate, (grid.total - simulated) / rate if rate else math.inf)
    runs = tuple(entry for entries in logs.values() for entry in entries)
    return Status(len(done), len(grid), grid.total, failed, running, runs)


def verified(store: Store, recompute: int, repair: bool, seed: int, progress: bool | None) -> list[str]:
    """Check all parts of a study, and perhaps compute damaged units again, as `Study.verify`."""
    checks.whole(recompute, "recompute", InvalidOption, 0)
    if recompute or repair:
        store.check_program()
    faults = [
        *(
            f"{name} is damaged or missing, which other programs that read Zarr need: run the study again"
            for name, data in store.metadata.items()
            if store.folder.get(name) != data
        ),
        *_reading(kept_report, store.folder),
        *_reading(Store.records, store),
    ]
    done = sorted(store.done())
    drawn = min(recompute, len(done))
    damaged: dict[Key, str] = {}
    with Progress("verifying", len(done) + drawn, show=progress) as bar:
        for key in done:
            for fault in _reading(store.outcomes, key):
                damaged[key] = fault
            bar.advance()
        sound = [key for key in done if key not in damaged]
        for k in np.random.default_rng(seed).permutation(len(sound))[:drawn]:
            if compute(store.work(sound[k])) != store.raw(sound[k]):
                damaged[sound[k]] = f"unit {name_of(sound[k])} is not what this program computes"
            bar.advance()
    if repair and damaged:
        with store.folder.locked():
            for key in damaged:
                store.put(key, compute(store.work(key)))
    return [*faults, *damaged.values()]


def _reading(read: Callable[[Any], object], what: object) -> list[str]:
    """Return why something cannot be read; nothing if it can."""
    try:
        read(what)
    except StudyError as error:
        return [error.text()]
    return []


@dataclass(frozen=True)
class RunReport:
    """Outcome of one run.

    Attributes
    ----------
    units, simulations : int
        Units that were computed, and simulations in them.
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
    """Compute the units of a share that are not done, in threads or by an executor, until SIGTERM."""
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
                    # Each worker has a unit in hand, and the next.
                    for key in itertools.islice(left, max(2 * max(1, count()) - len(pending), 0)):
                        pending[submit(store.work(key))] = key
                if not pending:
                    break
                for future in wait(pending, timeout=1.0, return_when=FIRST_COMPLETED).done:
                    key = pending.pop(future)
                    try:
                        data = future.result()
                    except (BrokenExecutor, CancelledError) as error:
                        raise _gone(error) from error
                    except Exception as error:
                        why, kind = " ".join(str(error).split()), type(error).__name__
                        failed[name_of(key)] = why if isinstance(error, RockingError) else f"{kind}: {why}".rstrip(": ")
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
    """Give what hands a unit to a worker, and what counts the workers; threads stop when this is left by an error."""
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


def _gone(why: object) -> StudyError:
    return StudyError(f"the workers are gone: {why}; what was computed is kept, run the study again")


@contextlib.contextmanager
def scheduler_client(address: str) -> Iterator[Any]:
    """Give a client of a scheduler of dask.distributed, with Dask's certificates; a StudyError if nobody answers."""
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
