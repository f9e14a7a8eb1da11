"""Two workers of dask.distributed, of one thread each, beside one: time and processor time.

python stress/workers.py
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil

import rocking
from rocking.studies.run import local_executor


def made(folder: str, scales: int) -> rocking.Study:
    """Make a study of units of about a third of a second."""
    motion = rocking.records.load("el-centro-meloland-270")
    blocks = rocking.Blocks(p=np.linspace(1.0, 6.0, 16384), alpha=0.2, restitution=0.9)
    return rocking.study(folder, blocks, motion, levels=np.linspace(2.0, 9.0, scales), measure="pga", unit_blocks=16384)


def processor_time(process: psutil.Process) -> float:
    """Processor time of a process and of those that it started."""
    return sum(each.cpu_times().user + each.cpu_times().system for each in (process, *process.children(recursive=True)))


def measured(count: int, scales: int) -> tuple[float, float]:
    """Time and processor time of a run, all workers warm."""
    with tempfile.TemporaryDirectory() as folder, local_executor(count) as pool:
        warm = [pool.submit(time.sleep, 0.2) for _ in range(4 * count)]
        with tempfile.TemporaryDirectory() as other:
            made(other, 4 * count).run(executor=pool)
        for one in warm:
            one.result()
        study = made(folder, scales)
        process = psutil.Process()
        before, start = processor_time(process), time.monotonic()
        study.run(executor=pool)
        return time.monotonic() - start, processor_time(process) - before


def main() -> None:
    """Measure by turns, and take the least."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--scales", type=int, default=40)
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args()
    found: dict[int, list[tuple[float, float]]] = {1: [], 2: []}
    for _ in range(given.repeats):
        for count, times in found.items():
            times.append(measured(count, given.scales))
    one, two = (min(times) for times in found.values())
    load = Path("/proc/loadavg").read_text().split()[0]
    print(f"one worker {one[0]:.2f} s ({one[1]:.2f} s of processor), two {two[0]:.2f} s ({two[1]:.2f} s); load {load}")
    print(f"two are {one[0] / two[0]:.2f} times as fast; processor time {two[1] / one[1]:.2f} times that of one")


if __name__ == "__main__":
    main()
