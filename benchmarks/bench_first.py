"""Time until the first result of a new process.

Usage: python benchmarks/bench_first.py

Processor time of the process, s; least of some runs in turn.
"""

import subprocess
import sys

from rocking.kernels import compiled

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
    "fragility, 3 blocks": (
        "rocking.fragility(rocking.Blocks(p=[2.0, 3.0, 4.0], alpha=0.2), "
        f"[rocking.records.load(name) for name in ('{RECORD}', 'ridgecrest-clc-090')], "
        "levels=[2.0, 4.0, 8.0, 16.0])"
    ),
    "chattering time": "rocking.chattering.chattering_time(1.05, 3.0, 0.9)",
    "chattering report": "rocking.chattering.chattering_report(1.05, 3.0, 0.9)",
}
REPEATS = 3


def main() -> None:
    print(f"processor time, s; {compiled.describe_mode()}")
    for name, code in ANSWERS.items():
        print(f"{name:26s} {min(spent(code) for _ in range(REPEATS)):9.2f}")


def spent(code: str) -> float:
    """Processor time of a process that computes something."""
    script = f"import time\nimport numpy as np\nimport rocking\n{code}\nprint(time.process_time())"
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    return float(done.stdout.split()[-1])


if __name__ == "__main__":
    main()
