"""How often `calibrate_history` finds the block behind a history, and at what cost: by derivatives and by differences.

Usage: python benchmarks/bench_calibrate_history.py [--histories 200] [--seed 1] [--two-sided]

Blocks are drawn at random, every other one is released and the others are shaken by noise of 4 s; noise of one of three
sizes is added to 4 s of the rotation. A fit has found the block where its sum of squares is no larger than the hidden
block's own: a search that has stopped in another minimum has not. Both searches start from the same seed; the cost is
processor time of this process, and the number of simulations.
"""

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

import rocking
from rocking.calibration import history

NOISES = (1e-3, 1e-2, 5e-2)
TIMES = np.arange(0.0, 4.0, 0.01)
DESCENTS: dict[str, Callable] = {"derivatives": history._descended}


def by_differences(problem: history._Problem, start: np.ndarray, count: int) -> np.ndarray:
    """Descend as `history._descended`, by three-point differences."""
    steps = [1e-5] * len(start)
    return least_squares(problem.residuals, start, "3-point", problem.bounds, args=(count,), diff_step=steps).x


@dataclass
class Case:
    """A history, the motion, and the sum of squares that the hidden block leaves."""

    rotation: np.ndarray
    motion: rocking.Motion | None
    noise: float
    least: float


def drawn(rng: np.random.Generator, *, two_sided: bool) -> Iterator[Case]:
    """Histories that show at least three impacts, without end; noise in shares of the largest rotation."""
    number = 0
    while True:
        sides = 2 if two_sided else 1
        p = rng.uniform(1.5, 6.0) * rng.uniform(0.95, 1.05, sides)
        alpha = rng.uniform(0.08, 0.35) * rng.uniform(0.85, 1.15, sides)
        restitution = rng.uniform(0.65, 0.96) * rng.uniform(0.95, 1.02, sides)
        pairs = [each.tolist() if two_sided else float(each[0]) for each in (p, alpha, restitution)]
        block = rocking.Block.from_parameters(pairs[0], pairs[1], pairs[2])
        motion, start = None, float(rng.uniform(0.3, 0.8) * alpha[0])
        if number % 2:
            rough = np.convolve(rng.normal(size=108), np.hanning(9), mode="valid")
            size = rng.uniform(1.3, 3.0) * 9.80665 * np.tan(alpha.max())
            motion, start = rocking.Motion.from_samples(size * rough / np.abs(rough).max(), 0.04), 0.0
        response = rocking.simulate(block, motion, initial_rotation=start, duration=float(TIMES[-1]))
        if response.overturned or len(response.impacts) < 3:
            continue
        clean = response.rotation(TIMES)
        noise = NOISES[number // 2 % len(NOISES)]
        added = noise * np.abs(clean).max() * rng.normal(size=len(TIMES))
        yield Case(clean + added, motion, noise, float(np.sum(added**2)))
        number += 1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--histories", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--two-sided", action="store_true")
    options = parser.parse_args()
    DESCENTS["differences"] = by_differences
    respond, count = history._Problem.response, 0

    def counting(problem: history._Problem, logs: np.ndarray, end: float) -> rocking.Response:
        nonlocal count
        count += 1
        return respond(problem, logs, end)

    setattr(history._Problem, "response", counting)  # noqa: B010  a method cannot be assigned
    rows: dict[tuple[str, str], list[tuple[bool, bool, float, int]]] = {}
    cases = drawn(np.random.default_rng(options.seed), two_sided=options.two_sided)
    rocking.calibrate_history(TIMES, next(cases).rotation, progress=False)  # what is compiled is compiled now
    cases = drawn(np.random.default_rng(options.seed), two_sided=options.two_sided)
    for _, case in zip(range(options.histories), cases, strict=False):
        sums = {}
        for name, descended in DESCENTS.items():
            history._descended = descended
            count, begin = 0, time.process_time()
            try:
                found = rocking.calibrate_history(
                    TIMES, case.rotation, case.motion, two_sided=options.two_sided, progress=False
                )
            except rocking.InvalidOption:  # the history does not determine the block where the search ended
                sums[name] = (np.inf, time.process_time() - begin, count)
                continue
            sums[name] = (float(np.sum(found.residuals**2)), time.process_time() - begin, count)
        best = min(one[0] for one in sums.values())
        for name, (left, spent, simulations) in sums.items():
            is_found, is_best = left <= case.least * (1.0 + 1e-9), left <= best * (1.0 + 1e-6)
            shaken = "free" if case.motion is None else "forced"
            for group in (f"{shaken}, noise {case.noise:g}", shaken, "all"):
                rows.setdefault((group, name), []).append((is_found, is_best, spent, simulations))
    print("| histories | descent by | number | found | as good as the other | processor time, s | simulations |")
    print("|---|---|---|---|---|---|---|")
    for (group, name), each in sorted(rows.items()):
        found, best, spent, simulations = np.mean(np.array(each, dtype=float), axis=0)
        print(f"| {group} | {name} | {len(each)} | {found:.1%} | {best:.1%} | {spent:.2f} | {simulations:.0f} |")


if __name__ == "__main__":
    main()
