"""Code run in a process of its own, which may neither hang nor eat the machine's memory."""

from __future__ import annotations

import contextlib
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from typing import IO

MEMORY = 12 * 2**30
STARTING = 300.0
"""Seconds to import and to compile the kernels where nobody has yet; not part of a run's time."""

_PROGRAM = """
import json, math, resource, signal, sys, warnings
signal.signal(signal.SIGINT, signal.default_int_handler)  # what runs in the background may have none
resource.setrlimit(resource.RLIMIT_AS, ({memory}, {memory}))
import numpy as np, rocking
warnings.simplefilter("ignore")
block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
samples = 1.5 * 0.2 * 9.80665 * np.sin(np.arange(100) * 0.1)
record, pieces = rocking.Motion.from_samples(samples, 0.02), rocking.Motion([0.0, 1.0], [[3.0]])
for model in ("linear", "nonlinear"):
    for motion in (record, pieces):
        rocking.simulate(block, motion, model=model)
        rocking.simulate_many(block, motion, model=model)

def of_response(r):
    unfinished = bool(getattr(r, "unfinished", False))
    return {{"unfinished": unfinished, "overturned": r.overturned, "overturn_time": r.overturn_time,
             "peak_rotation": r.peak_rotation, "duration": r.duration, "impacts": len(r.impacts)}}

def of_dataset(d):
    found = {{str(k): v.values.ravel().tolist() for k, v in d.data_vars.items()}}
    return {{"unfinished": False, **found}}

def attempt(evaluate):
    try:
        return evaluate()
    except rocking.RockingError as error:
        return {{"refused": f"{{type(error).__name__}}: {{error}}"}}

print("ready", flush=True)
for line in sys.stdin:
    print(json.dumps(attempt(lambda: eval(line))), flush=True)
"""


@dataclass(frozen=True)
class Outcome:
    """How a run went: its output and errors, how long it took, and whether it had to be stopped."""

    output: str
    errors: str
    status: int
    seconds: float
    stopped: bool


class Place:
    """A process that evaluates expressions, one after the other; a new one is started where the last one has ended."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._errors: IO[bytes] | None = None

    def run(self, expression: str, *, limit: float, interrupt_after: float | None = None) -> Outcome:
        """Evaluate an expression (`of_response(...)`, `of_dataset(...)`) with `rocking`, `np` and `block` at hand.

        An interrupt may be sent some seconds after the start; then `seconds` counts from it, as `limit` does.
        """
        process = self._ready()
        assert process.stdin is not None
        process.stdin.write(expression.encode() + b"\n")
        answers = self._answers(process)
        output, start = b"", time.monotonic()
        if interrupt_after is not None:
            with contextlib.suppress(queue.Empty):
                output = answers.get(timeout=interrupt_after)
            if not output:
                process.send_signal(signal.SIGINT)
                start = time.monotonic()
        stopped = False
        try:
            output = output or answers.get(timeout=limit)
        except queue.Empty:
            stopped = True
        seconds = time.monotonic() - start
        outcome = Outcome(output.decode(), *self._left(process, output), seconds, stopped)
        if interrupt_after is not None:
            self.close()  # The interrupt may have come too late, and meet the next one.
        return outcome

    def close(self) -> None:
        """End the process, if there is one."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
        if self._errors is not None:
            self._errors.close()
        self._process = self._errors = None

    def _ready(self) -> subprocess.Popen[bytes]:
        if self._process is not None:
            return self._process
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the process
        process = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM.format(memory=MEMORY)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            bufsize=0,
        )
        self._process = process
        if self._answers(process).get(timeout=STARTING) != b"ready\n":
            raise AssertionError(self._left(process, b"")[0])
        return process

    @staticmethod
    def _answers(process: subprocess.Popen[bytes]) -> queue.Queue[bytes]:
        """One line of the process, empty where it has ended, as soon as it is there."""
        answers: queue.Queue[bytes] = queue.Queue()
        assert process.stdout is not None
        threading.Thread(target=lambda out: answers.put(out.readline()), args=(process.stdout,), daemon=True).start()
        return answers

    def _left(self, process: subprocess.Popen[bytes], output: bytes) -> tuple[str, int]:
        """Errors and exit status: none of either while the process answers; else it is ended."""
        if output:
            return "", 0
        assert self._errors is not None
        if process.poll() is None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(timeout=0.5)
        status = process.poll()
        if status is None:
            process.kill()
            status = process.wait()
        self._errors.seek(0)
        errors = self._errors.read().decode()
        self.close()
        return errors, status
