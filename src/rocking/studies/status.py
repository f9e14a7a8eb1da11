"""How far a study has come, and whether it is sound: the log of its runs, its status, the check of all its units."""

from __future__ import annotations

import contextlib
import json
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

import numpy as np

from rocking import checks
from rocking.errors import InvalidOption, StudyError
from rocking.progress import Progress
from rocking.studies.folder import Folder, this_process
from rocking.studies.report import kept_report
from rocking.studies.store import Store
from rocking.studies.units import Key, compute, name_of
from rocking.tables import counted

#: The log of all runs; one of a part has a name of its own, as its lock has ("runs.3-10.jsonl" and "lock.3-10").
_RUNS: Final = "runs.jsonl"


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
        """Write it in one line."""
        left = (
            f"{self.seconds_left:.0f} s left" if math.isfinite(self.seconds_left) else "its first unit is not done yet"
        )
        return f"being run by {self.holder}: {self.rate:.3g} simulations a second, {left}"


@dataclass(frozen=True)
class Status:
    """How far a study has come.

    Attributes
    ----------
    done, units : int
        Units that are done, of how many.
    simulations : int
        Simulations in all units.
    failed : mapping
        Sentence for each unit that the last run could not compute.
    running : Running or None
        The run that goes on now, where there is one.
    runs : tuple
        What happened in every run, as `runs.jsonl` has it, and after it in those of parts.
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
        """Write it in one line."""
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
            entry = json.loads(line)
            if isinstance(entry, dict):
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
