"""Ctrl-C at any moment of a long command: over at once, in one sentence, with nothing half-written.

The moment is a share of the processor time that the command takes undisturbed, so that it does not hang on how busy the
machine is; it may fall into the start of Python itself, the imports, the work or the end.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple

from promises.commands import COMMANDS, faults, files, inputs
from promises.promise import Found, Promise
from rocking.errors import INTERRUPTED

#: Interrupts of a part, all of one command.
INTERRUPTS: Final = 10

#: Processor time after an interrupt at most, s.
LIMIT: Final = 1.0

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


@contextmanager
def _started(arguments: list[str], folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    # Whoever hands out the parts does not listen to Ctrl-C, and neither would its children.
    with (
        (folder / "out.txt").open("wb") as out,
        (folder / "err.txt").open("wb") as errors,
        subprocess.Popen(
            [sys.executable, "-m", "rocking", *arguments],
            cwd=folder,
            stdout=out,
            stderr=errors,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        ) as process,
    ):
        try:
            yield process
        finally:
            process.kill()


def _spent(process: int) -> float:
    """Processor time of a process so far, s."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


def ended(name: str, folder: Path, moment: float | None) -> Ended:
    """Run a command, and interrupt it once it has taken so many seconds of processor time."""
    arguments = [str(folder / "out") if word == "OUT" else word for word in COMMANDS[name]]
    inputs(folder)
    at, deadline = 0.0, time.monotonic() + _PATIENCE
    with _started(arguments, folder) as process:
        while time.monotonic() < deadline:
            number, status, used = os.wait4(process.pid, os.WNOHANG)
            if number:
                process.returncode = os.waitstatus_to_exitcode(status)
                break
            if moment is not None and (at := _spent(process.pid)) >= moment:
                process.send_signal(signal.SIGINT)
                moment = None
            time.sleep(0.002)
        else:
            return Ended(-1, b"", b"not over in time", _PATIENCE, _PATIENCE)
        seconds = used.ru_utime + used.ru_stime
    out, errors = (folder / file for file in ("out.txt", "err.txt"))
    return Ended(process.returncode, out.read_bytes(), errors.read_bytes(), seconds, seconds - at if at else 0.0)


@cache
def undisturbed(name: str) -> tuple[float, dict[str, bytes]]:
    """Processor time of a command that nothing disturbs, s, and its files; the first run compiles what it needs."""
    with tempfile.TemporaryDirectory() as where:
        for folder in (Path(where) / "first", Path(where) / "second"):
            folder.mkdir()
            one = ended(name, folder, None)
            if one.status != 0:
                raise RuntimeError(f"{name}: {one.errors.decode()[-500:]}")
        return one.seconds, files(folder / "out")


def judge(part: int) -> Found:
    """Interrupt one command at several moments."""
    found, rng = Found(parts=1), random.Random(f"interrupts {part}")
    name = [*COMMANDS][part % len(COMMANDS)]
    seconds, whole = undisturbed(name)
    for number in range(INTERRUPTS):
        # One in each tenth of the time, so that start and end are not left to chance.
        moment = seconds * (number + rng.random()) / INTERRUPTS
        with tempfile.TemporaryDirectory() as where:
            folder = Path(where)
            one = ended(name, folder, moment)
            _judge_end(found, f"{name}, after {moment:.2f} s of {seconds:.2f} s", one, folder / "out", whole)
    return found


def _judge_end(found: Found, what: str, one: Ended, folder: Path, whole: dict[str, bytes]) -> None:
    found.cases += 1
    found.judged += 1
    found.worst = max(found.worst, one.after / LIMIT)
    if one.after > LIMIT:
        found.fail(f"{what}: {one.after:.2f} s of processor time after the interrupt")
    for fault in faults(folder, whole):
        found.fail(f"{what}: {fault}")
    lines = [line for line in one.errors.splitlines() if not line.startswith(b"rocking: note:")]
    if one.status == 0 and not lines:
        found.notes["over before"] += 1
    elif one.status == -signal.SIGINT:
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
        f"{counts['over before']} a command that was over.\n"
    )


PROMISE = Promise(
    name="interrupts",
    says="Ctrl-C ends a command at once, and leaves nothing half-written",
    parts=2 * len(COMMANDS),
    small=1,
    judge=judge,
    table=table,
)
