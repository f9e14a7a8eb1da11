"""Code run in a process of its own, which may neither hang nor eat the machine's memory."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from dataclasses import dataclass

MEMORY = 12 * 2**30
STARTING = 300.0
"""Seconds to import and to compile the kernels where nobody has yet; not part of a run's time."""

_BEFORE = """
import json, math, resource, warnings
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
found = attempt(lambda: (
"""
_AFTER = """
))
print(json.dumps(found), flush=True)
"""


@dataclass(frozen=True)
class Outcome:
    """How a run went: its output (after "ready") and errors, how long it took, and whether it had to be stopped."""

    output: str
    errors: str
    seconds: float
    stopped: bool
    status: int


def run(expression: str, *, limit: float, interrupt_after: float | None = None) -> Outcome:
    """Evaluate an expression (`of_response(...)`, `of_dataset(...)`) with `rocking`, `np` and `block` at hand.

    An interrupt may be sent some seconds after the start; then `seconds` counts from it, as `limit` does.
    """
    code = _BEFORE.format(memory=MEMORY) + expression + _AFTER
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0
    ) as process:
        assert process.stdout is not None
        line = process.stdout.readline()  # unbuffered, so that the rest is left to `communicate`
        if line != b"ready\n":
            raise AssertionError(process.communicate(timeout=STARTING)[1].decode())
        if interrupt_after is not None:
            try:
                process.wait(timeout=interrupt_after)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGINT)
        start, stopped = time.monotonic(), False
        try:
            output, errors = process.communicate(timeout=limit)
        except subprocess.TimeoutExpired:
            stopped = True
            process.kill()
            output, errors = process.communicate()
        return Outcome(output.decode(), errors.decode(), time.monotonic() - start, stopped, process.returncode)
