"""What a new process takes until its first answer: with the libraries of a wheel, a warm cache, and nothing compiled.

Usage: python benchmarks/bench_first.py        # with the Python of an environment that the wheel is installed in

Processor time of the process, s; least of some runs in turn.
"""

import os
import subprocess
import sys
import tempfile

from rocking.kernels import library

RECORD = "el-centro-meloland-270"
BLOCKS = "rocking.Blocks(p=np.repeat(np.linspace(1, 5, 100), 100), alpha=np.tile(np.linspace(0.1, 0.4, 100), 100))"
ANSWERS = {
    "simulate": f"rocking.simulate(rocking.Block(half_width=0.12, half_height=0.55), rocking.records.load('{RECORD}'))",
    "simulate, summary": (
        "str(rocking.simulate(rocking.Block(half_width=0.12, half_height=0.55), "
        f"rocking.records.load('{RECORD}')).summary())"
    ),
    "10,000 blocks, linear": f"rocking.simulate_many({BLOCKS}, rocking.records.load('{RECORD}'), model='linear')",
    "10,000 blocks, nonlinear": f"rocking.simulate_many({BLOCKS}, rocking.records.load('{RECORD}'))",
    "chattering time": "rocking.chattering.chattering_time(1.05, 3.0, 0.9)",
    "chattering report": "rocking.chattering.chattering_report(1.05, 3.0, 0.9)",
}
REPEATS = 3


def main() -> None:
    print(library.state())
    print(f"{'processor time, s':26s} {'library':>9s} {'warm':>9s} {'cold':>9s}")
    for name, code in ANSWERS.items():
        with tempfile.TemporaryDirectory() as warm:
            spent(code, ROCKING_SHIPPED="0", NUMBA_CACHE_DIR=warm)
            rows = []
            for _ in range(REPEATS):
                with tempfile.TemporaryDirectory() as cold:
                    rows.append(
                        (
                            spent(code) if library.opened() else float("nan"),
                            spent(code, ROCKING_SHIPPED="0", NUMBA_CACHE_DIR=warm),
                            spent(code, ROCKING_SHIPPED="0", NUMBA_CACHE_DIR=cold),
                        )
                    )
        print(f"{name:26s}" + "".join(f" {min(times):9.2f}" for times in zip(*rows, strict=True)))


def spent(code: str, **environment: str) -> float:
    """Processor time of a process that computes something."""
    script = f"import time\nimport numpy as np\nimport rocking\n{code}\nprint(time.process_time())"
    done = subprocess.run(
        [sys.executable, "-c", script], check=True, capture_output=True, text=True, env=os.environ | environment
    )
    return float(done.stdout.split()[-1])


if __name__ == "__main__":
    main()
