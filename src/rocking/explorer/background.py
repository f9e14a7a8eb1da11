"""Work in the background: compiling before anybody waits for it, and long work that gives way to short."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, Final

from rocking.block import Block, Blocks
from rocking.engine import Setup, Task, simulate_tasks
from rocking.kernels import state
from rocking.kernels.march import march
from rocking.motion import pulses
from rocking.motion.motion import Motion
from rocking.simulation import simulate
from rocking.treatment import Certified

#: Lowest priority of all: such a thread takes what others leave, and all of it where they leave everything.
_NICENESS: Final = 19


@contextmanager
def low_priority() -> Iterator[Executor]:
    """Give an executor of one thread that takes the processor only where nobody else wants it.

    Where the system knows priorities of threads (Linux) those that it starts have the same one; elsewhere it is an
    ordinary thread.
    """
    with ThreadPoolExecutor(1, "rocking-low-priority", initializer=_lower_priority) as executor:
        yield executor


def _lower_priority() -> None:
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)


class Compilation:
    """Compiles all kernels once, in a thread, by a few small computations."""

    def __init__(self) -> None:
        self._thread = threading.Thread(target=self._run, name="rocking-compilation", daemon=True)
        self._started: float | None = None
        self._took: float | None = None

    def start(self) -> None:
        """Start it, if it has not been started."""
        if self._started is None:
            self._started = time.monotonic()
            self._thread.start()

    def state(self) -> dict[str, Any]:
        """Say whether all is compiled, and for how long it has been going on, s."""
        started = time.monotonic() if self._started is None else self._started
        return {"done": self._took is not None, "seconds": self._took or time.monotonic() - started}

    def _run(self) -> None:
        assert self._started is not None
        try:
            _compile()
        except RuntimeError:
            # Threads cannot start others once the program has ended.
            if threading.main_thread().is_alive():
                raise
        else:
            self._took = time.monotonic() - self._started


def _compile() -> None:
    import scipy.signal  # noqa: F401 - it takes a second, and the ground's displacement needs it

    block = Block(width=0.24, height=1.1)
    sine = pulses.one_sine(2.5, 1.0)
    record = Motion.from_samples(sine.acceleration([0.01 * k for k in range(200)]), 0.01)
    for motion in (sine, record):
        response = simulate(block, motion)
        response.rotation([0.5])
        response.summary()
        for model in ("nonlinear", "linear"):
            setup = Setup(Blocks(p=[3.0, 4.0], alpha=0.2), model, Certified())
            list(simulate_tasks(setup, [Task(slice(0, 2), motion)], threads=1))
    # Python follows the first responses; a march without turns is compiled all the same.
    ground, body, rules, _ = response._trail
    march(ground, body, rules, state.new_table(0), state.new_scratch(), state.new_states(1, 0)[0])
