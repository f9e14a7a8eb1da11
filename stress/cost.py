"""What keeping a study costs: processor time beside `simulate_many`, memory, listing and opening.

python stress/cost.py --simulations 10000000 --figure memory.png
"""

import argparse
import resource
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

import rocking
from rocking.studies.study import _LARGEST
from rocking.studies.units import name_of


def pulses(count: int) -> list[rocking.Motion]:
    """Make pulses of as many frequencies."""
    return [rocking.pulses.one_sine(1.0, frequency) for frequency in np.geomspace(0.5, 5.0, count)]


def times(blocks: rocking.Blocks, pga: float, width: int, repeats: int) -> tuple[float, float]:
    """Processor times of one thread, the least of some turns: at once, and as a study of units of so many blocks."""
    options = {"pga": [pga], "model": "linear"}
    rocking.simulate_many(blocks.select(slice(0, 512)), pulses(1), **options, threads=1)  # compiles
    at_once, as_study = [], []
    for _ in range(repeats):
        start = time.process_time()
        rocking.simulate_many(blocks, pulses(4), **options, threads=1)
        at_once.append(time.process_time() - start)
        with tempfile.TemporaryDirectory() as folder:
            study = rocking.study(folder, blocks, pulses(4), **options, unit_blocks=width)
            start = time.process_time()
            report = study.run(threads=1)
            as_study.append(time.process_time() - start)
            assert report.units == len(study.store.grid)
    return min(at_once), min(as_study)


def overhead(simulations: int, repeats: int) -> None:
    """Compare processor times at once and as a study: of units as large as in long studies, and of next to nothing."""
    rng = np.random.default_rng(0)
    width = 512 * max(1, min(_LARGEST, simulations // 8) // 512)
    for name, pga, each in (("blocks that rock", 4.0, max(512, width // 16)), ("blocks that stay", 0.5, width)):
        count = 2 * each
        blocks = rocking.Blocks(p=rng.uniform(1.0, 6.0, count), alpha=rng.uniform(0.1, 0.4, count), restitution=0.9)
        at_once, as_study = times(blocks, pga, each, repeats)
        share = 100.0 * (as_study / at_once - 1.0)
        cost = 1e6 * at_once / (4 * count)
        print(f"{name}: {cost:.2f} us a simulation; as a study {share:+.1f} % ({repeats} turns of 8 units of {each})")
    at_once, as_study = times(rocking.Blocks(p=2.0, alpha=0.2, restitution=0.9), 0.5, 512, repeats)
    print(f"a run of 4 units of one simulation: {1e3 * (as_study - at_once):.1f} ms more than at once")


def listing(units: int) -> None:
    """Time how long a study of very many units takes to open and to list."""
    blocks = rocking.Blocks(p=np.linspace(1.0, 6.0, 1000), alpha=0.2, restitution=0.9)
    with tempfile.TemporaryDirectory() as folder:
        study = rocking.study(folder, blocks, pulses(1), factor=np.linspace(1.0, 2.0, units // 2), unit_blocks=512)
        for key in study.store.grid:
            (Path(folder) / "result" / name_of(key)).touch()
        start = time.perf_counter()
        found = rocking.study(folder)
        opened = time.perf_counter()
        done = len(found.store.done())
        print(f"{done} units: opened in {opened - start:.3f} s, listed in {time.perf_counter() - opened:.3f} s")


def memory(simulations: int, figure: Path | None) -> None:
    """Follow the memory of a run, most of whose blocks stay (so that much is written), and of the spectrum after it."""
    rng = np.random.default_rng(0)
    motions = simulations // 10_000
    blocks = rocking.Blocks(p=rng.uniform(1.0, 6.0, 1000), alpha=rng.uniform(0.1, 0.4, 1000), restitution=0.9)
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
        study = rocking.study(folder, blocks, pulses(motions), pga=np.linspace(0.2, 2.0, 10), model="linear")
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
        from matplotlib.figure import Figure

        picture = Figure(figsize=(3.5, 2.4), layout="constrained")
        axes = picture.add_subplot()
        axes.plot(times, held, color="black", linewidth=1.0)
        axes.axvline(ran, color="grey", linestyle="--", linewidth=0.8)
        axes.text(0.5 * ran, 1.05 * most, f"run of {simulations:.0e} simulations", ha="center")
        axes.text(ran, 0.05 * most, "spectrum ", ha="right")
        axes.set(xlabel="time (s)", ylabel="memory of the process (MiB)", ylim=(0.0, 1.2 * most))
        picture.savefig(figure, dpi=160)


def main() -> None:
    """Measure all three."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--simulations", type=int, default=1_000_000)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--units", type=int, default=100_000)
    parser.add_argument("--figure", type=Path)
    given = parser.parse_args()
    overhead(given.simulations, given.repeats)
    listing(given.units)
    memory(given.simulations, given.figure)


if __name__ == "__main__":
    main()
