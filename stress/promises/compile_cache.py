"""What is kept of compiled kernels: many processes on an empty folder, kills, folders of no use, sources that change.

A part is a process of its own, which imports numba and kernels and compiles none of them. Its forks then begin where
they all compile, each in an order of its own, so that they meet in the folder. Every answer must
have the bits of a process that had the folder to itself.
"""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import rocking
from promises.promise import ABOVE_ENSEMBLES, Found, Promise

#: Rounds of a part, and processes of a round; in every second round some of them are killed.
ROUNDS: Final = 10
PROCESSES: Final = 8

#: Exit codes of a fork.
_RIGHT, _WRONG, _ERROR, _COMPILED = 0, 3, 4, 5

_NOBODY: Final = 65534

#: A process that imports kernels, waits until it is told to go on, and answers.
_PROGRAM: Final = """
from rocking.kernels.sine import eq65
print("imported", flush=True)
input()
print(repr(eq65.eq65_time(1.25, 0.7, 0.5)))
"""
_CHANGED: Final = "z / 24.0"


def judge(part: int) -> Found:
    """Judge the rounds of a part in a process of its own, and an update of the sources."""
    path = os.pathsep.join(each for each in sys.path if each)
    program = f"from promises.compile_cache import rounds\nrounds({part}, {ROUNDS})"
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | {"PYTHONPATH": path, "ROCKING_SHIPPED": "0"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise RuntimeError(done.stderr[-2000:])
    found = Found.of(json.loads(done.stdout))
    with tempfile.TemporaryDirectory() as where:
        _judge_update(found, part, Path(where))
    return found


# --- forks ----------------------------------------------------------------------------------------------------


def rounds(part: int, count: int) -> None:
    """Do the rounds of a part, and print what they have shown."""
    import numba

    numba.njit(lambda x: x + 1.0)(1.0)  # what numba makes ready for its first compilation is made once
    found, rng = Found(parts=1), random.Random(f"compile cache {part}")
    with tempfile.TemporaryDirectory() as where:
        top = Path(where)
        top.chmod(0o777)
        alone = _Forks(top / "alone", top / "answers", None)
        start = time.monotonic()
        _told(alone.run(rng.random()), "a process that has the folder to itself")
        expected = json.loads((top / "answers").read_text("utf-8"))
        within = PROCESSES / 2 * (time.monotonic() - start)
        for number in range(count):
            forks = _Forks(top / f"round {number}", top / "answers", expected)
            within = _judge_round(found, rng, f"round {number} of part {part}", forks, number % 2, within)
        for name, prepare in FOLDERS.items():
            forks = _Forks(top / name, top / "answers", expected)
            _judge(found, f"a folder {name}", forks.run(rng.random(), prepare=prepare), _RIGHT)
            found.notes[f"a folder {name}"] += 1
        _judge_damage(found, rng, _Forks(top / "round 0", top / "answers", expected))
    print(json.dumps(vars(found)))


class _Forks:
    """Forks of this process that all keep what they compile in one folder."""

    def __init__(self, folder: Path, answers: Path, expected: list[str] | None) -> None:
        self.folder, self._answers, self._expected = folder, answers, expected

    def start(self, seed: float, *, warm: bool = False, prepare: Callable[[Path], None] | None = None) -> int:
        """Start a fork that answers; ``warm``: it must find all code kept."""
        process = os.fork()
        if process:
            return process
        code = _ERROR
        try:
            os.environ["NUMBA_CACHE_DIR"] = str(self.folder)
            if prepare is not None:
                prepare(self.folder)
            code = self._answered(random.Random(seed), warm)
        except BaseException as error:
            sys.stderr.write(f"{type(error).__name__}: {error}\n")
        finally:
            os._exit(code)

    def run(self, seed: float, *, warm: bool = False, prepare: Callable[[Path], None] | None = None) -> int:
        """Return how such a fork ends."""
        return _ended(self.start(seed, warm=warm, prepare=prepare))

    def _answered(self, rng: random.Random, warm: bool) -> int:
        questions = _questions()
        found = [""] * len(questions)
        for number in rng.sample(range(len(questions)), len(questions)):
            kernel, arguments = questions[number]
            found[number] = repr(kernel(*arguments))
            if warm and kernel.compiled.stats.cache_misses:
                return _COMPILED
        if self._expected is None:
            self._answers.write_text(json.dumps(found), "utf-8")
            return _RIGHT
        return _RIGHT if found == self._expected else _WRONG


def _questions() -> list[tuple[Any, tuple[Any, ...]]]:
    """Two small kernels, one of them for two types."""
    import numpy as np

    from rocking.kernels.sine.eq65 import eq65_sums, eq65_time

    return [(eq65_sums, (0.5,)), (eq65_sums, (np.float32(0.5),)), (eq65_time, (1.25, 0.7, 0.5))]


def _ended(process: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def _told(code: int, what: str) -> None:
    if code != _RIGHT:
        raise RuntimeError(f"{what} ended with {code}")


def _judge(found: Found, what: str, code: int, expected: int) -> None:
    found.cases += 1
    found.judged += 1
    if code != expected:
        said = {_WRONG: "a wrong answer", _ERROR: "an error", _COMPILED: "compiled what should be kept"}
        found.fail(f"{what}: {said.get(code, f'exit status {code}')}")


def _judge_round(found: Found, rng: random.Random, what: str, forks: _Forks, kills: int, within: float) -> float:
    """Start all processes at once, kill some; return how long they took, s, or what was given where some are killed."""
    start = time.monotonic()
    running = [forks.start(rng.random()) for _ in range(PROCESSES)]
    victims = rng.sample(running, rng.randint(1, PROCESSES // 2)) if kills else []
    for moment, victim in sorted((rng.uniform(0.0, within), victim) for victim in victims):
        time.sleep(max(0.0, start + moment - time.monotonic()))
        os.kill(victim, signal.SIGKILL)
    for process in running:
        code = _ended(process)
        killed = process in victims and code == -signal.SIGKILL
        found.notes["killed"] += killed
        if not killed:
            _judge(found, what, code, _RIGHT)
    took = time.monotonic() - start
    _judge(found, f"{what}, after it", forks.run(rng.random()), _RIGHT)
    _judge(found, f"{what}, from what is kept", forks.run(rng.random(), warm=True), _RIGHT)
    found.notes["rounds"] += 1
    return within if kills else took


def _judge_damage(found: Found, rng: random.Random, forks: _Forks) -> None:
    """Cut off and change files of a folder: what is damaged is made anew."""
    for file in forks.folder.rglob("*.nbc"):
        sound = file.read_bytes()
        place = rng.randrange(len(sound))
        changed = sound[:place] + bytes([sound[place] ^ (1 << rng.randrange(8))]) + sound[place + 1 :]
        file.write_bytes(sound[:place] if rng.random() < 0.5 else changed)
        found.notes["damaged files"] += 1
    _judge(found, "damaged files", forks.run(rng.random()), _RIGHT)
    _judge(found, "damaged files, made anew", forks.run(rng.random(), warm=True), _RIGHT)


# --- folders --------------------------------------------------------------------------------------------------


def _only(folder: Path) -> None:
    """Leave no other place than this folder, and no right to write everywhere."""
    from rocking.kernels import compiled

    compiled._parents = lambda: iter([folder])
    if os.getuid() == 0:
        os.setgid(_NOBODY)
        os.setuid(_NOBODY)


def _missing(folder: Path) -> None:
    os.environ["NUMBA_CACHE_DIR"] = str(folder / "and" / "below")


def _removed(folder: Path) -> None:
    from rocking.kernels import compiled

    compiled.cache_folder()
    shutil.rmtree(folder)


def _read_only(folder: Path) -> None:
    _only(folder)
    folder.mkdir(mode=0o555)


def _read_only_later(folder: Path) -> None:
    from rocking.kernels import compiled

    _only(folder)
    kept = compiled.cache_folder()
    assert kept is not None
    kept.chmod(0o555)


def _full(folder: Path) -> None:
    from rocking.kernels import compiled

    compiled.cache_folder()
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))


FOLDERS: Final[dict[str, Callable[[Path], None]]] = {
    "that is missing": _missing,
    "that is removed meanwhile": _removed,
    "that is read-only, as all places are": _read_only,
    "that becomes read-only": _read_only_later,
    "on a full disk": _full,
}


# --- sources --------------------------------------------------------------------------------------------------


def _judge_update(found: Found, part: int, folder: Path) -> None:
    """Change a kernel, but not the size and the date of its file, while a process has imported and not compiled it."""
    package = Path(rocking.__file__).parent
    aside = shutil.ignore_patterns("__pycache__", "shipped", "explorer")
    shutil.copytree(package, folder / "rocking", ignore=aside)
    source = folder / "rocking" / "kernels" / "sine" / "eq65.py"
    text, date = source.read_text("utf-8"), source.stat().st_mtime_ns
    before = _asked(_process(folder))
    with _process(folder) as late:
        assert late.stdout is not None
        late.stdout.readline()
        source.write_text(text.replace(_CHANGED, f"z / {25 + part % 70}.0"), "utf-8")
        os.utime(source, ns=(date, date))
        answers = {"a process that had imported them": (_asked(late, imported=True), before)}
    true = _asked(_process(folder, NUMBA_DISABLE_JIT="1"))
    answers["a new process"] = _asked(_process(folder)), true
    answers["another one"] = _asked(_process(folder)), true
    found.notes["updates"] += before != true
    for who, (answer, expected) in answers.items():
        found.cases += 1
        found.judged += 1
        if answer != expected:
            found.fail(f"sources changed in part {part}: {who} answers {answer}, not {expected}")


def _process(folder: Path, **more: str) -> subprocess.Popen[str]:
    environment = {"PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(folder / "kept"), "ROCKING_SHIPPED": "0"}
    return subprocess.Popen(
        [sys.executable, "-c", _PROGRAM],
        env=os.environ | environment | {"PYTHONDONTWRITEBYTECODE": "1"} | more,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _asked(process: subprocess.Popen[str], *, imported: bool = False) -> str:
    """Let a process go on, and return its answer."""
    out, errors = process.communicate("\n", timeout=600)
    answer = out.splitlines()[0 if imported else 1 :]
    return answer[0] if process.returncode == 0 and answer else f"error: {errors.strip()[-300:]}"


def table(found: Found) -> str:
    """Say what was done."""
    counts = found.notes
    folders = ", ".join(f"{counts[f'a folder {name}']} {name}" for name in FOLDERS)
    return (
        f"{counts['rounds']} rounds of {PROCESSES} processes; {counts['killed']} processes were killed. Folders: "
        f"{folders}. {counts['damaged files']} files were damaged, and sources changed {counts['updates']} times.\n"
    )


PROMISE = Promise(
    name="compile-cache",
    says="no crash and no stale code from what is kept of compiled kernels",
    parts=20,
    small=1,
    judge=judge,
    table=table,
    above=ABOVE_ENSEMBLES,
)
