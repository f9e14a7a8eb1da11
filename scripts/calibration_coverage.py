"""Simulation-based calibration: measure how often the 90 % intervals of `rocking.calibrate` hold the truth.

Run ``python scripts/calibration_coverage.py`` from the repository's root (forty minutes of one core): it writes
docs/_tables/calibration-coverage.txt and docs/_static/calibration-ranks.png. Each truth is drawn from the prior, each
test's block from the truth, and its outcome is simulated; data sets whose outcomes are all the same are drawn again,
which leaves the check exact, since the fit sees them refused as well. The truth's rank among the draws of the posterior
is then uniform (Talts et al. 2018). Shares of 200 data sets are uncertain by 0.04 (two standard deviations). Another
number of data sets may be given, for a trial that only prints.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import binom

import rocking
from rocking.analysis.calibration import population
from rocking.analysis.calibration.space import Space

ROOT = Path(__file__).resolve().parents[1]
TABLE = ROOT / "docs" / "_tables" / "calibration-coverage.txt"
FIGURE = ROOT / "docs" / "_static" / "calibration-ranks.png"
DATA_SETS = 200
PROCESSES = 2

TESTS = 60
CANDIDATES = 4096
LAPSE = 0.005
BOUNDS = {"p": (1.0, 10.0), "alpha": (0.02, 0.5), "restitution": (0.3, 0.99)}
BINS = 10


def tests(rng: np.random.Generator) -> list[rocking.Motion]:
    """One-cycle pulses of random strength and frequency, around what overturns the blocks of the prior."""
    strength = np.exp(rng.uniform(np.log(0.3), np.log(12.0), TESTS))
    frequency = np.exp(rng.uniform(np.log(0.3), np.log(4.0), TESTS))
    return [rocking.pulses.one_sine(a, f) for a, f in zip(strength, frequency, strict=True)]


def outcomes(space: Space, truth: np.ndarray, motions: list[rocking.Motion], rng: np.random.Generator) -> np.ndarray:
    """Simulate a population in its tests: each with its own block inside the bounds, and a few lapses."""
    drawn = np.empty((0, truth.shape[1] // 2))
    while len(drawn) < len(motions):
        points = population.drawn(truth, 1.0, len(motions), rng)
        drawn = np.concatenate([drawn, points[space.contains(points)]])
    blocks = list(space.blocks(drawn[: len(motions)]))
    tested = zip(blocks, motions, strict=True)
    fallen = [rocking.simulate(one, motion, model="linear").overturned for one, motion in tested]
    return np.array(fallen) != (rng.random(len(motions)) < LAPSE)


def data_set(seed: int, space: Space) -> tuple[np.ndarray, list[rocking.Motion], np.ndarray]:
    """Draw a truth, motions and outcomes that are not all the same."""
    rng = np.random.default_rng([seed, 2])
    while True:
        truth = population.with_dispersions(space, space.spread_evenly(1, rng), rng)
        motions = tests(rng)
        overturned = outcomes(space, truth, motions, rng)
        if 0 < overturned.sum() < len(motions):
            return truth, motions, overturned


def ranks(seed: int, two_sided: bool) -> dict[str, float]:
    """Share of the posterior below the truth, by parameter."""
    space = Space.of(**BOUNDS, two_sided=two_sided)
    truth, motions, overturned = data_set(seed, space)
    found = rocking.calibrate(
        motions,
        overturned,
        seed,
        p=BOUNDS["p"],
        alpha=BOUNDS["alpha"],
        restitution=BOUNDS["restitution"],
        two_sided=two_sided,
        lapse=LAPSE,
        candidates=CANDIDATES,
        threads=1,
        progress=False,
    )
    values = space.named(population.unpacked(truth)[0])
    return {name: float(np.mean(found.draws[name] < values[name][0])) for name in found.estimates}


def table(found: list[dict[str, float]], two_sided: bool) -> str:
    """Shares of central intervals that hold the truth, a row for each parameter."""
    sides = "two-sided" if two_sided else "symmetric"
    rows = [f"{len(found)} data sets of {TESTS} tests, {CANDIDATES} candidates, {sides} blocks"]
    rows.append(f"{'parameter':<20}{'90 % interval':>14}{'50 % interval':>14}{'mean rank':>11}")
    for name in found[0]:
        rank = np.array([one[name] for one in found])
        held = [np.mean(np.abs(rank - 0.5) <= 0.5 * share) for share in (0.9, 0.5)]
        rows.append(f"{name:<20}{held[0]:>14.3f}{held[1]:>14.3f}{rank.mean():>11.3f}")
    return "\n".join(rows) + "\n"


def draw(symmetric: list[dict[str, float]], two_sided: list[dict[str, float]], path: Path) -> None:
    """Draw a histogram of the truth's ranks for each parameter, with the band of 90 % of even ones."""
    figure = Figure(figsize=(10.0, 5.4), layout="constrained")
    rows = figure.subplots(2, 4, sharey=True)
    for row, found, sides in zip(rows, (symmetric, two_sided), ("symmetric", "two-sided"), strict=True):
        low, high = (float(binom.ppf(share, len(found), 1.0 / BINS)) for share in (0.05, 0.95))
        for axes, name in zip(row, found[0], strict=False):
            axes.axhspan(low, high, color="0.85", label="90 % of even ranks")
            axes.hist(
                [one[name] for one in found], BINS, range=(0.0, 1.0), histtype="step", color="k", label="data sets"
            )
            axes.set_xlabel(f"share of the posterior\nbelow the true {name.replace('_', ' ')}")
            axes.set_xlim(0.0, 1.0)
            axes.set_xticks([0.0, 0.5, 1.0])
        row[0].set_ylabel(f"data sets, {sides}")
    rows[0, 0].set_ylim(0.0, 1.1 * max(line.get_xy()[:, 1].max() for axes in rows.flat for line in axes.patches[1:]))
    rows[0, 3].set_axis_off()
    rows[0, 3].legend(*rows[0, 0].get_legend_handles_labels(), loc="center")
    figure.savefig(path, dpi=150)


def main() -> None:
    """Draw data sets, calibrate each, and tell how often intervals hold the truth."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data_sets", type=int, nargs="?", default=DATA_SETS)
    count = parser.parse_args().data_sets
    with ProcessPoolExecutor(PROCESSES) as pool:
        two_sided, symmetric = (list(pool.map(ranks, range(count), [sides] * count)) for sides in (True, False))
    text = "\n".join((table(symmetric, False), table(two_sided, True)))
    print(text)
    if count == DATA_SETS:
        TABLE.write_text(text, "utf-8")
        draw(symmetric, two_sided, FIGURE)


if __name__ == "__main__":
    main()
