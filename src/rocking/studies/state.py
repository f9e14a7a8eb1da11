"""How far a study has come, and whether it is sound: the log of its runs, its status, the check of all its parts."""

from __future__ import annotations

import contextlib
import json
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

import numpy as np

from rocking import checks
from rocking.errors import InvalidOption, StudyError
from rocking.progress import Progress
from rocking.studies.place import Place, this_process
from rocking.studies.refine import Refinement, kept_plan, refinement, rounds
from rocking.studies.results import kept_report
from rocking.studies.store import Store, UnitArray
from rocking.studies.units import Key, compute
from rocking.tables import counted

#: What happened in every run; no result depends on it.
_RUNS: Final = "runs.jsonl"


@dataclass(frozen=True)
class Running:
    """A run that goes on while somebody asks.

    Attributes
    ----------
    holder : str
        Process and host.
    rate : float
        Simulations a second since it started.
    seconds_left : float
        Time that it will take at this rate, or that the round of a refinement will; infinite before its first unit.
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
        What happened in every run, as `runs.jsonl` has it.
    refinement : Refinement or None
        How far the refinement of its scales has come, where it has one.
    """

    done: int
    units: int
    simulations: int
    failed: dict[str, str]
    running: Running | None
    runs: tuple[dict[str, Any], ...]
    refinement: Refinement | None = None

    @property
    def complete(self) -> bool:
        """Whether every unit is done, and all that is to be refined is."""
        return self.done == self.units and (self.refinement is None or self.refinement.complete)

    def __str__(self) -> str:
        """Write it in one line."""
        share = math.floor(1000.0 * self.done / self.units) / 10.0  # 100 % only where all are
        done = f"{self.done} of {counted(self.units, 'unit')} done ({share:.1f} %)"
        text = f"{done}, {counted(self.simulations, 'simulation')} in all"
        text += f"; {self.refinement}" if self.refinement else ""
        text += f"; {len(self.failed)} failed in the last run" if self.failed else ""
        return text + (f"; {self.running}" if self.running else "")


class Log:
    """What happened in every run, a line of JSON for each event; no result depends on it."""

    def __init__(self, place: Place) -> None:
        self._place = place

    def add(self, entry: dict[str, Any]) -> None:
        """Append an entry, with the time and this process."""
        who = {"time": datetime.now().astimezone().isoformat(timespec="seconds"), "by": this_process()}
        self._place.append(_RUNS, json.dumps(who | entry))

    def entries(self) -> Iterator[dict[str, Any]]:
        """Give the entries; a line that was cut off by a crash is passed over."""
        for line in (self._place.get(_RUNS) or b"").splitlines():
            with contextlib.suppress(ValueError):
                entry = json.loads(line)
                if isinstance(entry, dict):
                    yield entry

    def fault(self, done: int) -> str:
        """Say what is wrong with the log of a study with so many simulations done; nothing if it may be whole."""
        data, entries = self._place.get(_RUNS) or b"", [*self.entries()]
        lines = len(data.splitlines())
        is_reported = any(entry.get("event") in ("start", "repaired") for entry in entries)
        if len(entries) < lines or (data and not data.endswith(b"\n")):
            return f"{_RUNS} is damaged: {counted(lines - len(entries) or 1, 'line')} of it cannot be read whole"
        if done and not is_reported:
            return f"{_RUNS} is damaged or missing: it has no run of the units that are done"
        last = entries[-1] if entries else {}
        if last.get("event") == "end" and last.get("done", done) < done:
            return f"{_RUNS} is damaged: it ends before the last run"
        return ""

    def repair(self, fault: str) -> None:
        """Keep the lines that can be read, and say so."""
        self._place.put(_RUNS, b"".join(json.dumps(entry).encode() + b"\n" for entry in self.entries()))
        self.add({"event": "repaired", "why": fault})


def arrays_of(store: Store) -> Sequence[UnitArray]:
    """Return the grid, and the rounds that have begun."""
    tolerances = kept_plan(store)
    return [store, *([] if tolerances is None else rounds(store, tolerances))]


def simulations_done(store: Store) -> int:
    """Count the simulations that are done, of the grid and of all rounds."""
    return sum(array.grid.simulations(key) for array in arrays_of(store) for key in array.done())


def status_of(store: Store) -> Status:
    """Return how far a study has come; another process may run it."""
    runs = tuple(Log(store.place).entries())
    starts = [k for k, entry in enumerate(runs) if entry.get("event") == "start"]
    last = runs[starts[-1] :] if starts else ()
    failed = {entry["unit"]: entry["why"] for entry in last if entry.get("event") == "failed"}
    done, grid = store.done(), store.grid
    refined = refinement(store)
    left = grid.total - sum(map(grid.simulations, done)) or (refined.simulations - refined.done if refined else 0)
    holder = store.place.holder()
    running = None
    if holder and last:
        seconds = time.time() - datetime.fromisoformat(last[0]["time"]).timestamp()
        rate = max(simulations_done(store) - last[0]["done"], 0) / max(seconds, 1.0)
        running = Running(holder, rate, left / rate if rate else math.inf)
    return Status(len(done), len(grid), grid.total, failed, running, runs, refined)


def verified(store: Store, recompute: int, repair: bool, seed: int, progress: bool | None) -> list[str]:
    """Check, and perhaps repair, all parts of a study, as `Study.verify`."""
    checks.whole(recompute, "recompute", InvalidOption, 0)
    if recompute or repair:
        store.check_program()
    place, log, arrays = store.place, Log(store.place), arrays_of(store)
    metadata = {name: data for array in arrays for name, data in array.metadata.items()}
    wrong = [name for name, data in metadata.items() if place.get(name) != data]
    log_fault = log.fault(simulations_done(store))
    faults = [
        *(f"{name} is damaged or missing: other programs that read Zarr need it" for name in wrong),
        *_reading(kept_report, store),
        *_reading(Store.records, store),
        *filter(None, [log_fault]),
    ]
    done = [(array, key) for array in arrays for key in sorted(array.done())]
    drawn = min(recompute, len(done))
    with Progress("verifying", len(done) + drawn, show=progress) as bar:
        damaged: dict[tuple[UnitArray, Key], str] = {}
        for array, key in done:
            for fault in _reading(array.outcomes, key):
                damaged[array, key] = fault
            bar.advance()
        sound = [unit for unit in done if unit not in damaged]
        for k in np.random.default_rng(seed).permutation(len(sound))[:drawn]:
            array, key = sound[k]
            if compute(array.work(key)) != array.raw(key):
                damaged[array, key] = f"unit {array.label(key)} is not what this program computes"
            bar.advance()
    if repair:
        with place.locked():
            for name in wrong:
                place.put(name, metadata[name])
            for array, key in damaged:
                array.put(key, compute(array.work(key)))
            if log_fault:
                log.repair(log_fault)
    return [*faults, *damaged.values()]


def _reading(read: Callable[[Any], object], what: object) -> list[str]:
    """Say why something cannot be read; nothing if it can."""
    try:
        read(what)
    except StudyError as error:
        return [error.text()]
    return []
