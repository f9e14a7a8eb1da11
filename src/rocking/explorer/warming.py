"""Compiling before anybody waits for it: a few small computations in a thread, when the explorer starts."""

from __future__ import annotations

import threading
import time
from typing import Any

from rocking.block import Block, Blocks
from rocking.engine import Setup, Task, simulate_tasks
from rocking.motion import pulses
from rocking.motion.motion import Motion
from rocking.simulation import simulate
from rocking.treatment import Certified


class Warming:
    """Runs once, in the background."""

    def __init__(self) -> None:
        self._thread = threading.Thread(target=self._run, name="rocking-warming", daemon=True)
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
        try:
            self._compile()
        except RuntimeError:
            # Threads cannot start others once the program has ended.
            if threading.main_thread().is_alive():
                raise

    def _compile(self) -> None:
        import scipy.signal  # noqa: F401 - it takes a second, and the ground's displacement needs it

        block = Block(width=0.24, height=1.1)
        sine = pulses.one_sine(2.5, 1.0)
        record = Motion.from_samples(sine.acceleration([0.01 * k for k in range(200)]), 0.01)
        for motion in (sine, record):
            response = simulate(block, motion)
            response.rotation([0.5])
            response.summary()
        for motion in (sine, record):
            for model in ("nonlinear", "linear"):
                setup = Setup(Blocks(p=[3.0, 4.0], alpha=0.2), model, Certified())
                list(simulate_tasks(setup, [Task(slice(0, 2), motion)], threads=1))
        assert self._started is not None
        self._took = time.monotonic() - self._started
