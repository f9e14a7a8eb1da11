"""What keeping a study costs: processor time beside `simulate_many`, memory, listing and opening.

python stress/cost.py --simulations 10000000 --figure memory.png

Processor time is that of all threads of the process, with what the system does for it. Both ways are measured in pairs,
turn about, and a ratio is taken of each pair: what others do on the machine meanwhile changes both times of a pair
alike. Where they do much, the simulations still take now more, now less time by more than a study costs; so the time
beside them is compared as well.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import resource
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

import numpy as np

import rocking
from rocking.arrays import Floats
from rocking.engine import simulate_task
from rocking.plot.canvas import add_labels, figure_for
from rocking.studies.units import LARGEST, name_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Processor time, s: in all, and beside the simulations.
Times = tuple[float, float]


def pulses(count: int) -> list[rocking.Motion]:
    """Make pulses of as many frequencies."""
    return [rocking.pulses.one_sine(1.0, frequency) for frequency in np.geomspace(0.5, 5.0, count)]


def at_once(blocks: rocking.Blocks, pga: float) -> Times:
    """Processor times of four motions, simulated at once."""
    motions = pulses(4)
    with timed() as taken:
        rocking.simulate_many(blocks, motions, levels=[pga], measure="pga", model="linear", threads=1)
    return taken[0]


def as_study(blocks: rocking.Blocks, pga: float, width: int) -> Times:
    """Processor times of running them as a study of units of so many blocks."""
    with tempfile.TemporaryDirectory() as folder:
        study = rocking.study(folder, blocks, pulses(4), levels=[pga], measure="pga", model="linear", unit_blocks=width)
        with timed() as taken:
            report = study.run(threads=1)
        assert report.units == len(study._store.grid)
    return taken[0]


@contextlib.contextmanager
def timed() -> Iterator[list[Times]]:
    """Put the processor times of what follows into a list."""
    gc.collect()
    taken: list[Times] = []
    simulating: list[float] = []

    def watched(*arguments: Any, **named: Any) -> Any:
        start = time.thread_time()
        outcomes = simulate_task(*arguments, **named)
        simulating.append(time.thread_time() - start)
        return outcomes

    start = time.process_time()
    with patch("rocking.engine.simulate_task", watched), patch("rocking.studies.units.simulate_task", watched):
        yield taken
    whole = time.process_time() - start
    taken.append((whole, whole - sum(simulating)))


def paired(blocks: rocking.Blocks, pga: float, width: int, repeats: int) -> Floats:
    """Processor times at once and as a study, shape (repeats, 2, 2); each goes first in every other pair."""
    at_once(blocks, pga)  # compiles, and warms up
    as_study(blocks, pga, width)
    pairs = []
    for k in range(repeats):
        if k % 2 == 0:
            pairs.append((at_once(blocks, pga), as_study(blocks, pga, width)))
        else:
            pairs.append((as_study(blocks, pga, width), at_once(blocks, pga))[::-1])
    return np.array(pairs)


def overhead(simulations: int, repeats: int) -> None:
    """Compare processor times at once and as a study: of units as large as in long studies, and of next to nothing."""
    rng = np.random.default_rng(0)
    groups = max(1, min(LARGEST, simulations // 8) // 512)
    for name, pga, each in (
        ("blocks that rock", 4.0, 512 * max(1, groups // 16)),
        ("blocks that stay", 0.5, 512 * groups),
    ):
        count = 2 * each
        blocks = rocking.Blocks(p=rng.uniform(1.0, 6.0, count), alpha=rng.uniform(0.1, 0.4, count), restitution=0.9)
        times = paired(blocks, pga, each, repeats)
        once, more = times[:, 0, 0], times[:, 1] - times[:, 0]
        (low, _), (whole, beside), (high, _) = 100.0 * np.quantile(
            more / once[:, np.newaxis], (0.25, 0.5, 0.75), axis=0
        )
        print(
            f"{name}: {1e6 * np.median(once) / (4 * count):.2f} us a simulation; as a study {whole:+.1f} % (quartiles "
            f"{low:+.1f} and {high:+.1f} %), {beside:+.1f} % beside the simulations; {repeats} pairs, 8 units of {each}"
        )
    times = paired(rocking.Blocks(p=2.0, alpha=0.2, restitution=0.9), 0.5, 512, repeats)
    short = 1e3 * np.median(times[:, 1, 0] - times[:, 0, 0])
    print(f"a run of 4 units of one simulation: {short:.1f} ms more than at once")


def listing(units: int) -> None:
    """Time how long a study of very many units takes to open and to list."""
    blocks = rocking.Blocks(p=np.linspace(1.0, 6.0, 1000), alpha=0.2, restitution=0.9)
    with tempfile.TemporaryDirectory() as folder:
        study = rocking.study(folder, blocks, pulses(1), levels=np.linspace(1.0, 2.0, units // 2), unit_blocks=512)
        for key in study._store.grid:
            (Path(folder) / "result" / name_of(key)).touch()
        start = time.perf_counter()
        found = rocking.study(folder)
        opened = time.perf_counter()
        done = len(found._store.done())
        print(f"{done} units: opened in {opened - start:.3f} s, listed in {time.perf_counter() - opened:.3f} s")


def memory(simulations: int, figure: Path | None) -> None:
    """Follow the memory of a run, most of whose blocks stay (so that much is written), and of the spectrum after it."""
    rng = np.random.default_rng(0)
    motions = simulations // 10_000
    blocks = rocking.Blocks(p=rng.uniform(1.0, 6.0, 1000), alpha=rng.uniform(0.18, 0.4, 1000), restitution=0.9)
    times, held, over = [], [], threading.Event()
    start = time.monotonic()

    def watch() -> None:
        while not over.wait(0.2):
            pages = int(Path("/proc/self/statm").read_text().split()[1])
            times.append(time.monotonic() - start)
            held.append(pages * resource.getpagesize() / 2**20)

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    with tempfile.TemporaryDirectory() as folder:
        study = rocking.study(
            folder, blocks, pulses(motions), levels=np.linspace(0.2, 2.0, 10), measure="pga", model="linear"
        )
        report = study.run()
        print(report)
        ran = time.monotonic() - start
        study.spectrum()
        stored = sum(path.stat().st_size for path in Path(folder).rglob("*"))
    over.set()
    watcher.join()
    inside = [one for at, one in zip(times, held, strict=True) if at <= ran]
    quarter = len(inside) // 4 + 1
    early, late = np.median(inside[:quarter]), np.median(inside[-quarter:])
    most, kept = max(held), stored / 2**20
    print(f"memory: {early:.0f} MiB early in the run, {late:.0f} late, {most:.0f} at most; stored {kept:.0f} MiB")
    if figure is not None:
        drawn(times, held, ran, f"run of {simulations:,} simulations").savefig(figure, dpi=160)


def drawn(times: list[float], held: list[float], ran: float, run: str) -> Figure:
    """Draw memory (MiB) over time (s), and where the run ends."""
    most = max(held)
    with figure_for(None, (4.2, 2.8)) as figure:
        axes = figure.add_subplot()
        axes.plot(times, held, color="black", linewidth=1.0)
        axes.axvline(ran, color="0.35", linestyle="--", linewidth=0.8)
        axes.text(0.5 * ran, 1.05 * most, run, ha="center")
        axes.text(ran, 0.05 * most, "then its spectrum \u2192 ", ha="right")
        axes.set_ylim(0.0, 1.2 * most)
        add_labels(axes, "time (s)", "memory of the process (MiB)")
    return figure


def main() -> None:
    """Measure all three."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--simulations", type=int, default=1_000_000)
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--units", type=int, default=100_000)
    parser.add_argument("--figure", type=Path)
    given = parser.parse_args()
    overhead(given.simulations, given.repeats)
    listing(given.units)
    memory(given.simulations, given.figure)


if __name__ == "__main__":
    main()
