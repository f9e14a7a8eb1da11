"""Ctrl-C at any moment of a long command: over at once, in one sentence, with nothing half-written.

The moment is a share of the processor time that the command takes undisturbed, so that it does not hang on how busy the
machine is. Some commands are processes of their own, in which it may fall into the start of Python itself, the imports,
the work or the end. Most are forks of a process that has imported and compiled everything: there the work is met.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any, Final, NamedTuple, cast

from promises.commands import ENDING_WITH_A_PART, LONG, arguments, called, faults, files
from promises.promise import Found, Promise
from rocking.cli import main
from rocking.errors import INTERRUPTED

#: Interrupts of a part, all of one command: of processes of their own, and of forks. A command has two parts.
PROCESSES: Final = 5
FORKS: Final = 95

#: Processor time after an interrupt at most, s; of a command that draws and writes what it has.
LIMIT: Final = 1.0
_LIMIT_WITH_A_PART: Final = 5.0

#: Longest a command may take in all, s: long enough for a busy machine.
_PATIENCE: Final = 300.0

_TICKS: Final = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100

#: Status of a fork that was interrupted before or after the command, and of one that went on to its end all the same.
_OUTSIDE: Final = 99
_LOST: Final = 98

#: Interrupts that were raised in a fork.
_raised: list[int] = []


class Ended(NamedTuple):
    """How a command ended: status, what it said, processor time in all, and that after the interrupt, s."""

    status: int
    out: bytes
    errors: bytes
    seconds: float
    after: float


def ended(name: str, folder: Path, moment: float | None, *, forked: bool = False) -> Ended:
    """Run a command, and interrupt it once it has taken so many seconds of processor time."""
    words = arguments(name, folder)
    process = _forked(words, folder, moment) if forked else _started(words, folder)
    at, deadline, number = moment or 0.0, time.monotonic() + _PATIENCE, 0
    while time.monotonic() < deadline:
        number, status, used = os.wait4(process, os.WNOHANG)
        if number:
            break
        if moment is not None and not forked and (at := _spent(process)) >= moment:
            os.kill(process, signal.SIGINT)
            moment = None
        time.sleep(0.002)
    else:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        return Ended(-1, b"", b"not over in time", _PATIENCE, _PATIENCE)
    seconds = used.ru_utime + used.ru_stime
    out, errors = ((folder / file).read_bytes() for file in ("out.txt", "err.txt"))
    return Ended(os.waitstatus_to_exitcode(status), out, errors, seconds, seconds - at if at else 0.0)


def _started(words: list[str], folder: Path) -> int:
    """Start a process of its own; its number."""
    with (folder / "out.txt").open("wb") as out, (folder / "err.txt").open("wb") as errors:
        process = subprocess.Popen(
            [sys.executable, "-m", "rocking", *words],
            cwd=folder,
            stdout=out,
            stderr=errors,
            # Whoever hands out the parts does not listen to Ctrl-C, and neither would its children.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
    process.returncode = 0  # it is waited for elsewhere
    return process.pid


def _interrupted(number: int, frame: FrameType | None) -> None:
    """Call who listens as Ctrl-C does: with the place that is interrupted, and not one of ours."""
    try:
        cast(Any, signal.getsignal(signal.SIGINT))(signal.SIGINT, frame)
    except KeyboardInterrupt:
        _raised.append(number)
        raise


def _forked(words: list[str], folder: Path, moment: float | None) -> int:
    """Start a fork, which interrupts itself; its number."""
    sys.stdout.flush()
    sys.stderr.flush()
    process = os.fork()
    if process:
        return process
    code: Any = _OUTSIDE
    try:
        for number, file in ((1, "out.txt"), (2, "err.txt")):
            os.dup2(os.open(folder / file, os.O_WRONLY | os.O_CREAT), number)
        # What a tool for tests has in their places is not ours to write to.
        sys.stdout, sys.stderr = (os.fdopen(number, "w", closefd=False) for number in (1, 2))
        os.chdir(folder)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGPROF, _interrupted)
        if moment is not None:
            signal.setitimer(signal.ITIMER_PROF, max(moment, 1e-3))
        main(words)
        code = _LOST if _raised and words[0] not in ENDING_WITH_A_PART else 0
    except SystemExit as stop:
        code = int(stop.code or 0)
    except KeyboardInterrupt:
        code = _OUTSIDE
    except BaseException as error:
        code = 1
        sys.stderr.write(f"Traceback: {type(error).__name__}: {error}\n")
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _spent(process: int) -> float:
    """Processor time of a process so far, s."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


@cache
def undisturbed(name: str, *, forked: bool = False) -> tuple[float, dict[str, bytes]]:
    """Processor time of a command that nothing disturbs, s, and its files; the first run compiles what it needs."""
    with tempfile.TemporaryDirectory() as where:
        first, second = (Path(where) / each for each in ("first", "second"))
        first.mkdir()
        second.mkdir()
        if forked:
            status, said = called(arguments(name, first))
        else:
            one = ended(name, first, None)
            status, said = one.status, one.errors.decode()
        one = ended(name, second, None, forked=forked)
        if status != 0 or one.status != 0:
            raise RuntimeError(f"{name}: {said[-500:]} {one.errors.decode()[-500:]}")
        return one.seconds, files(second / "out")


def judge(part: int) -> Found:
    """Interrupt one command at several moments."""
    found, rng = Found(parts=1), random.Random(f"interrupts {part}")
    name = LONG[part % len(LONG)]
    for forked, count in ((False, PROCESSES), (True, FORKS)):
        seconds, whole = undisturbed(name, forked=forked)
        for number in range(count):
            # One in each stretch of the time, so that start and end are not left to chance.
            moment = seconds * (number + rng.random()) / count
            with tempfile.TemporaryDirectory() as where:
                folder = Path(where)
                one = ended(name, folder, moment, forked=forked)
                what = f"{name}{' forked' * forked}, after {moment:.3f} s of {seconds:.3f} s"
                _judge_end(found, what, one, folder / "out", whole)
    if name in ENDING_WITH_A_PART and not found.notes["a part"]:
        found.fail(f"{name}: no interrupt met what it computes, so that nothing is known of how it ends with a part")
    return found


def _judge_end(found: Found, what: str, one: Ended, folder: Path, whole: dict[str, bytes]) -> None:
    found.cases += 1
    found.judged += 1
    of_a_part = what.startswith(ENDING_WITH_A_PART)
    limit = _LIMIT_WITH_A_PART if of_a_part else LIMIT
    found.worst = max(found.worst, one.after / limit)
    if one.after > limit:
        found.fail(f"{what}: {one.after:.2f} s of processor time after the interrupt, status {one.status}")
    for fault in faults(folder, whole, of_a_part=of_a_part):
        found.fail(f"{what}: {fault}")
    lines = [line for line in one.errors.splitlines() if not line.startswith(b"rocking: note:")]
    if one.status == 0 and not lines:
        found.notes["a part" if b"interrupted" in one.errors else "over before"] += 1
    elif one.status in (-signal.SIGINT, _OUTSIDE):
        found.notes["before the program"] += 1  # Python itself was starting, or leaving: what it says is its own
    elif one.status == 130 and len(lines) == 1 and lines[0] == INTERRUPTED.encode():
        found.notes["interrupted"] += 1
    else:
        said = b" / ".join(lines[-3:]).decode(errors="replace")[-300:]
        found.fail(f"{what}: status {one.status}, {len(lines)} lines on stderr: {said}")


def table(found: Found) -> str:
    """Say what the interrupts met."""
    counts = found.notes
    return (
        f"Of {found.cases} interrupts {counts['interrupted']} met the imports or the work, "
        f"{counts['before the program']} Python itself before the program's first line or after its last, and "
        f"{counts['over before']} one that was over; {counts['a part']} ended with what was computed until then.\n"
    )


PROMISE = Promise(
    name="interrupts",
    says="Ctrl-C ends a command at once, and leaves nothing half-written",
    parts=2 * len(LONG),
    small=1,
    judge=judge,
    table=table,
)
