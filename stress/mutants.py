"""Ask of the tests whether they see mistakes: draw some of each part of the package, and run the nearest tests.

    python stress/mutants.py                        # 30 mutants of every part, about an hour
    python stress/mutants.py chattering --number 5

Each mutant (`mutations.py` says what is drawn) is put into a copy of the tree, and judged there by the files of tests
that `make quick` would run for a change of its file, up to the first failure; if they see nothing, by more that are
farther away. The nearest tests of kernels run them uncompiled. What a mutant showed is kept under a hash of its text,
and holds as long as the tests that showed it are what they were; a run that was stopped goes on where it was. Every
survivor is printed; those of `equivalent_mutants.json` change nothing that can be seen, for the reason said there, and
do not count. The table of docs/reliability.md has the last judgement of each part.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import importlib
import json
import math
import multiprocessing
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from mutations import Mutant, mutants
from of_changes import MOST, FilesOfTests, ordered
from rows import markdown, with_earlier

ROOT = Path(__file__).resolve().parents[1]
TABLE = ROOT / "docs/_tables/tests-mutants.txt"

#: Folders of each part.
PARTS = {
    "kernels": ["kernels"],
    "chattering": ["chattering"],
    "analysis": ["analysis"],
    "studies": ["studies"],
    "explorer": ["explorer"],
    "response": ["response"],
    "motion": ["motion"],
    "block and solid": ["block", "solid"],
    "dynamics": ["dynamics"],
    "cli": ["cli"],
}

#: How kernels come to be compiled, which a run without compilation shows nothing of.
NOT_JUDGED = ("compiled.py", "library.py", "signatures.py", "sources.py")

#: Share of the mutants of a part that tests must see.
WANTED = 0.85

#: Tests of laws that every module keeps, which import none of them; and more than the processor time that they take, s.
OF_ALL = ("tests/test_public_interface.py", "tests/test_portability.py")
_OF_ALL_SECONDS = 30.0

EQUIVALENT = Path(__file__).with_name("equivalent_mutants.json")
_OPTIONS = ["-x", "-q", "-n0", "-p", "no:cacheprovider", "--benchmark-disable"]
_FAST = ["-m", "not thorough and not slow and not browser", "--hypothesis-profile=few"]

#: Processor time at most in which the kernels that tests call are compiled anew, s.
_COMPILING = 400.0

#: No file of tests is so many imports farther than the nearest.
_ANYWHERE = 99

#: Time over processor time after which a process hangs: on a busy machine it is only waiting.
_SLOWER = 100.0

_FORKED = multiprocessing.get_context("fork")


class Tree:
    """The tests, how long they take, and copies of the tree to run them in."""

    def __init__(self, folder: Path, jobs: int, seconds: float) -> None:
        self.folder, self.seconds = folder, seconds
        self.tests = FilesOfTests(ROOT)
        self.copies = [Path(tempfile.mkdtemp(prefix="mutants-")) for _ in range(jobs)]
        names = subprocess.run(["git", "ls-files", "-z", "-co", "--exclude-standard"], cwd=ROOT, check=True, stdout=-1)
        for copy in self.copies:
            for name in names.stdout.decode().split("\0"):
                if (ROOT / name).is_file():
                    (copy / name).parent.mkdir(parents=True, exist_ok=True)
                    shutil.copy2(ROOT / name, copy / name)
            (copy / "src/rocking/kernels/built").symlink_to(ROOT / "src/rocking/kernels/built")
        sources = sorted((ROOT / "src").rglob("*.py"))
        self.sources = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()

    def remove(self) -> None:
        """Remove the copies."""
        for copy in self.copies:
            shutil.rmtree(copy, ignore_errors=True)

    def hash(self, name: str) -> str:
        """Hash of a file of tests."""
        return hashlib.sha256((ROOT / name).read_bytes()).hexdigest()[:16]

    def near(self, path: Path, without: Collection[str] = ()) -> list[str]:
        """Names of the files of tests of a file, the nearest first; of many more where some are left out."""
        near = ordered([self.tests.of(path, _ANYWHERE) if without else self.tests.of(path)])
        names = [path.relative_to(ROOT).as_posix() for path in near]
        return [name for name in names if name not in without][: MOST * (3 if without else 1)]

    def chosen(
        self, without: Mapping[Path, Collection[str]], seconds: float, uncompiled: bool
    ) -> dict[Path, dict[str, float]]:
        """Files of tests for a mutant of each file and their times: the nearest that the time allows, at least one.

        Some may be left out. Times are measured one file of tests after another, until half of the time is filled.
        """
        near, times = {path: self.near(path, names) for path, names in without.items()}, dict[str, float]()
        while True:
            chosen: dict[Path, dict[str, float]] = {path: {} for path in near}
            missing = set()
            for path, some in chosen.items():
                for name in near[path]:
                    total = sum(some.values())
                    if total > 0.5 * seconds:
                        break
                    if name not in times:
                        missing.add(name)
                        break
                    if total + times[name] <= (seconds if some else sys.float_info.max):
                        some[name] = times[name]
            if not missing:
                return chosen
            times |= self.measured(missing, uncompiled)

    def measured(self, names: Iterable[str], uncompiled: bool) -> dict[str, float]:
        """Processor time of each file of tests without a mutant; infinite, and said, if it fails or takes too long."""
        tasks: list[Task] = []
        kept = {}
        for name in sorted(names):
            place = self.folder / "times" / f"{self.sources[:16]}-{self.hash(name)}-{int(uncompiled)}.json"
            kept[name] = place
            if not place.exists():
                tasks.append((place, None, [name], 3.0 * self.seconds, uncompiled))
        done(tasks, self.copies)
        found = {name: json.loads(place.read_text()) for name, place in kept.items()}
        if failing := [name for name, each in found.items() if each["by"]]:
            print("left out, for they fail or take too long without a mutant:", *failing)
        return {name: math.inf if each["by"] else each["seconds"] for name, each in found.items()}

    def judged(self, drawn: list[Mutant], kernels: bool) -> list[str]:
        """Name of the test that sees each mutant, or nothing: a near one, else another, or one that judges all."""
        by, chosen = dict.fromkeys(drawn, ""), {mutant.path: dict[str, float]() for mutant in drawn}
        # Other tests of kernels alone would see little that these do not.
        of_kernels = [path.relative_to(ROOT).as_posix() for path in ROOT.glob("tests/test_kernels_*") if kernels]
        for times, of_all, uncompiled in ((1, {}, kernels), (3, dict.fromkeys(OF_ALL, _OF_ALL_SECONDS), False)):
            left = [mutant for mutant in drawn if not by[mutant]]
            places = {mutant: self.folder / "mutants" / f"{mutant.key}-{times}.json" for mutant in left}
            without = {mutant.path: [*some, *of_kernels] if (some := chosen[mutant.path]) else () for mutant in left}
            near = self.chosen(without, times * self.seconds, uncompiled)
            chosen = {path: some | of_all for path, some in near.items()}
            tasks: list[Task] = []
            for mutant, place in places.items():
                names = [*chosen[mutant.path]]
                if not (place.exists() and self._holds(json.loads(place.read_text()), names)):
                    limit = 3.0 * sum(chosen[mutant.path].values()) + 20.0
                    limit += _COMPILING * (kernels and not uncompiled)
                    tasks.append((place, mutant, names, limit, uncompiled))
            done(tasks, self.copies)
            by |= {mutant: json.loads(place.read_text())["by"] for mutant, place in places.items()}
        return [*by.values()]

    def _holds(self, found: dict[str, Any], names: list[str]) -> bool:
        """Whether a mutant that was judged is what it was: killed by a file that is the same, or spared by all."""
        seen = [found["by"].partition("::")[0]] if "::" in found["by"] else names
        return all(found["files"].get(name) == self.hash(name) for name in seen if (ROOT / name).exists())


Task = tuple[Path, "Mutant | None", list[str], float, bool]


def done(tasks: list[Task], copies: list[Path]) -> None:
    """Run the tests of each task, in as many processes as there are copies."""
    free, waiting = [*copies], tasks[::-1]
    running: dict[BaseProcess, tuple[Path, float, Task]] = {}
    while waiting or running:
        while waiting and free:
            task, copy = waiting.pop(), free.pop()
            task[0].parent.mkdir(parents=True, exist_ok=True)
            process: BaseProcess = _FORKED.Process(target=_tried, args=(copy, *task))
            process.start()
            running[process] = copy, time.monotonic() + _SLOWER * task[3], task
        wait([process.sentinel for process in running], timeout=1.0)
        for process, (copy, end, task) in [*running.items()]:
            if process.is_alive() and time.monotonic() < end:
                continue
            hangs = process.is_alive()
            if hangs and process.pid:
                os.killpg(process.pid, signal.SIGKILL)
            process.join()
            if process.exitcode == 1:
                raise RuntimeError(f"pytest itself failed: {(copy / 'said.txt').read_text()[-2000:]}")
            if process.exitcode:  # a signal: too long, or code that is no more sound
                _written(task, "no end" if hangs else f"signal {-process.exitcode}", task[3])
            if mutant := task[1]:
                _placed(copy, mutant, mutant.path.read_text("utf-8"))
            del running[process]
            free.append(copy)
            print(f"\r{len(waiting) + len(running)} to go   ", end="", file=sys.stderr, flush=True)


def _written(task: Task, by: str, seconds: float) -> None:
    files = {name: hashlib.sha256((ROOT / name).read_bytes()).hexdigest()[:16] for name in task[2]}
    task[0].write_text(json.dumps({"by": by, "seconds": seconds, "files": files}))


def _placed(copy: Path, mutant: Mutant, text: str) -> None:
    """Write a module's text, and remove what Python compiled of it before: it looks at seconds and size alone."""
    path = copy / mutant.path.relative_to(ROOT)
    path.write_text(text, "utf-8")
    for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*"):
        compiled.unlink()


class Recorder:
    """A plugin of pytest that keeps the name of the first test that failed, and counts those that passed."""

    def __init__(self) -> None:
        self.failed, self.passed = "", 0

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Keep a failure."""
        self.failed = self.failed or (report.nodeid if report.failed else "")
        self.passed += report.when == "call" and report.passed

    def pytest_collectreport(self, report: Any) -> None:
        """Keep a module that cannot be imported."""
        self.failed = self.failed or (f"{report.nodeid}::" if report.failed else "")


def _tried(copy: Path, place: Path, mutant: Mutant | None, names: list[str], limit: float, uncompiled: bool) -> None:
    """Run tests in a copy, in a process of its own, and write what failed first."""
    os.setsid()
    os.chdir(copy)
    place.unlink(missing_ok=True)
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 5))
    if mutant:
        _placed(copy, mutant, mutant.text)
    said = os.open("said.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    for stream in (1, 2):
        os.dup2(said, stream)
    os.environ["PYTHONPATH"] = str(copy / "src")
    sys.path[:] = [str(copy / "src"), *(path for path in sys.path if not path.startswith(str(ROOT / "s")))]
    sys.path.remove(str(ROOT / "tests"))
    for module in ("of_changes", "mutations"):
        sys.modules.pop(module, None)
    options = [*_OPTIONS, *_FAST]
    if uncompiled:
        os.environ["NUMBA_DISABLE_JIT"] = "1"
        options += ["-W", "ignore::RuntimeWarning"]
    elif mutant and "kernels" in mutant.path.parts:
        os.environ["ROCKING_JIT"] = "1"
    import pytest

    recorder, began = Recorder(), time.process_time()
    status = pytest.main([*options, *names], plugins=[recorder])
    by = recorder.failed or ("" if status == 0 and recorder.passed else f"status {int(status)}")
    _written((place, mutant, names, limit, uncompiled), by, time.process_time() - began)
    os._exit(0)


def drawn(part: str, number: int, seed: int) -> list[Mutant]:
    """Mutants of a part, the same for everybody, and those of a line as long as the line is what it was."""
    placed, seen = {}, Counter[str]()
    for folder in PARTS[part]:
        for path in sorted((ROOT / "src/rocking" / folder).rglob("*.py")):
            for each in [] if path.name in NOT_JUDGED else mutants(path):
                place = "\0".join([str(seed), path.relative_to(ROOT).as_posix(), each.code, each.change, each.becomes])
                seen[place] += 1  # equal lines have equal mutants
                placed[hashlib.sha256(f"{place}\0{seen[place]}".encode()).hexdigest()] = each
    return [placed[key] for key in sorted(placed)[:number]]


def equivalent() -> Callable[[Mutant], str]:
    """Look up why a mutant changes nothing that can be seen; empty if nothing is known.

    What it changes is said as ``Mutant.change`` says it, or by the whole new line where there are several of these.
    """
    names = ("file", "line", "change")
    known = {tuple(each[name] for name in names): each["reason"] for each in json.loads(EQUIVALENT.read_text("utf-8"))}

    def reason(each: Mutant) -> str:
        place = each.path.relative_to(ROOT / "src").as_posix(), each.code
        return known.get((*place, each.change)) or known.get((*place, each.becomes), "")

    return reason


@dataclass(frozen=True)
class Shown:
    """What the tests showed of the mutants of a part."""

    drawn: int
    equivalent: int
    killed: int
    #: Of each survivor its place, why it changes nothing that can be seen (empty: it does), and the change.
    spared: list[list[str]]
    seed: int = 1
    date: str = ""

    @property
    def counted(self) -> int:
        """Mutants that change something."""
        return self.drawn - self.equivalent

    @property
    def share(self) -> float:
        """Share of these that tests saw."""
        return self.killed / max(self.counted, 1)

    @classmethod
    def of(cls, drawn: list[Mutant], by: list[str], seed: int) -> Shown:
        """Count, and name the survivors."""
        reason = equivalent()
        spared = [mutant for mutant, name in zip(drawn, by, strict=True) if not name]
        places = [f"{mutant.path.relative_to(ROOT / 'src/rocking')}:{mutant.line}" for mutant in spared]
        named = [
            [place, reason(mutant), mutant.before, mutant.after] for place, mutant in zip(places, spared, strict=True)
        ]
        counts = len(drawn), sum(bool(each[1]) for each in named), len(drawn) - len(spared)
        return cls(*counts, named, seed)

    def report(self, part: str) -> Iterator[str]:
        """Write a line with the counts, and every survivor."""
        counts = f"{self.drawn} mutants, {self.equivalent} equivalent, {self.killed} of {self.counted} killed"
        yield f"{part}: {counts} ({100 * self.share:.0f} %)"
        for place, reason, before, after in self.spared:
            yield f"  {place}: {reason or 'not seen'}\n    - {before}\n    + {after}"
        if self.share < WANTED:
            yield f"  fewer than {100 * WANTED:.0f} %"


def table(shown: dict[str, Shown]) -> str:
    """Table of all parts, and below it every survivor that changes something."""
    heads = ("part", "mutants", "equivalent", "killed", "killed, %", "date")
    rows: dict[str, tuple[object, ...]] = {}
    for part in PARTS:
        each = shown.get(part)
        rows[part] = (each.drawn, each.equivalent, each.killed, f"{100 * each.share:.0f}", each.date) if each else ()
    lines = markdown(heads, rows, "not judged yet")
    spared = [survivor for each in shown.values() for survivor in each.spared if not survivor[1]]
    if spared:
        lines += ["", "Not seen by the tests that were run:"]
    elif len(shown) == len(PARTS):
        lines += ["", "Tests have seen each that changes something."]
    for place, _, before, after in spared:
        lines += ["", f"- {place}: `{_line(before)}` became `{_line(after)}`"]
    return "\n".join([*lines, ""])


def _line(code: str) -> str:
    return " ".join(code.replace("`", "'").split())


def main() -> int:
    """Draw, judge and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="which; by default all")
    parser.add_argument("--number", type=int, default=30, help="mutants of each part")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--seconds", type=float, default=20.0, help="processor time of the tests of one mutant")
    parser.add_argument("--kept", type=Path, default=ROOT / "out" / "mutants", help="folder of what is kept")
    given = parser.parse_args()
    for module in ("matplotlib.pyplot", "pandas", "pytest", "scipy.optimize", "xarray"):
        importlib.import_module(module)  # each process would do so anew otherwise

    tree, enough = Tree(given.kept, given.jobs, given.seconds), True
    try:
        for part in given.parts or PARTS:
            some = drawn(part, given.number, given.seed)
            shown = Shown.of(some, tree.judged(some, kernels=part == "kernels"), given.seed)
            rows = with_earlier(TABLE, {part: dataclasses.asdict(shown)})
            TABLE.write_text(table({name: Shown(**row) for name, row in rows.items()}), "utf-8")
            enough = enough and shown.share >= WANTED
            print("\r" + "\n".join(shown.report(part)), flush=True)
    finally:
        tree.remove()
    return 0 if enough else 1


if __name__ == "__main__":
    sys.exit(main())
