"""Ctrl-C at any moment of a long command: over within two seconds, with nothing half-written.

The moment is a share of the processor time that the command takes undisturbed, so that it does not depend on how busy
the machine is. It may fall into the start of Python itself, the imports, the work or the end.
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
from typing import Final, NamedTuple

from promises.commands import LONG, arguments, faults, files
from promises.promise import Found, Promise
from rocking.errors import INTERRUPT_MESSAGE

#: Interrupts of a part, all of one command, which has two parts.
INTERRUPTS: Final = 20

#: Processor time after an interrupt at most, s.
LIMIT: Final = 2.0

#: Longest a command may take in all, s: long enough for a busy machine.
_PATIENCE: Final = 300.0

_TICKS: Final = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


class Ended(NamedTuple):
    """How a command ended: status, what it said, processor time in all, and that after the interrupt, s."""

    status: int
    out: bytes
    errors: bytes
    seconds: float
    after: float


def ended(name: str, folder: Path, moment: float | None) -> Ended:
    """Run a command, and interrupt it once it has taken so many seconds of processor time."""
    process = _started(arguments(name, folder), folder)
    at, deadline, number = 0.0, time.monotonic() + _PATIENCE, 0
    while time.monotonic() < deadline:
        number, status, used = os.wait4(process, os.WNOHANG)
        if number:
            break
        if moment is not None and (at := _spent(process)) >= moment:
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


def _spent(process: int) -> float:
    """Processor time of a process so far, s."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


@cache
def undisturbed(name: str) -> tuple[float, dict[str, bytes]]:
    """Processor time of a command that nothing disturbs, s, and its files."""
    with tempfile.TemporaryDirectory() as where:
        one = ended(name, Path(where), None)
        if one.status != 0:
            raise RuntimeError(f"{name}: {one.errors.decode()[-500:]}")
        return one.seconds, files(Path(where, "out"))


def judge(part: int) -> Found:
    """Interrupt one command at several moments."""
    found, rng = Found(parts=1), random.Random(f"interrupts {part}")
    name = LONG[part % len(LONG)]
    seconds, whole = undisturbed(name)
    for number in range(INTERRUPTS):
        # One in each stretch of the time, so that start and end are not left to chance.
        moment = seconds * (number + rng.random()) / INTERRUPTS
        with tempfile.TemporaryDirectory() as where:
            folder = Path(where)
            one = ended(name, folder, moment)
            _judge_end(found, f"{name}, after {moment:.3f} s of {seconds:.3f} s", one, folder / "out", whole)
    return found


def _judge_end(found: Found, what: str, one: Ended, folder: Path, whole: dict[str, bytes]) -> None:
    found.cases += 1
    found.judged += 1
    found.worst = max(found.worst, one.after / LIMIT)
    if one.after > LIMIT:
        found.fail(f"{what}: {one.after:.2f} s of processor time after the interrupt, status {one.status}")
    for fault in faults(folder, whole):
        found.fail(f"{what}: {fault}")
    lines = [line for line in one.errors.splitlines() if not line.startswith(b"rocking: note:")]
    if one.status == 0 and not lines:
        found.notes["over before"] += 1
    elif one.status == -signal.SIGINT:
        found.notes["before the program"] += 1  # Python itself was starting, or leaving: what it says is its own
    elif one.status == 130 and len(lines) == 1 and lines[0] == INTERRUPT_MESSAGE.encode():
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
        f"{counts['over before']} one that was over.\n"
    )


PROMISE = Promise(
    name="interrupts",
    says="Ctrl-C ends a command at once, and leaves nothing half-written",
    parts=2 * len(LONG),
    small=1,
    judge=judge,
    table=table,
)
