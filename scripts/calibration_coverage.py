"""Simulation-based calibration: measure how often the 90 % intervals of `rocking.calibrate` hold the truth.

Run ``python scripts/calibration_coverage.py`` from the repository's root (an hour of two cores): it writes
docs/_tables/calibration-coverage.txt and docs/_static/calibration-ranks.png. Truths are drawn from the prior, each
test's block from the truth, and its outcome is simulated; truths whose outcomes are all the same are passed over,
which leaves the check exact, since the fit sees them refused as well. The truth's rank among the draws of the posterior
is then uniform (Talts et al. 2018). Truths fill the prior evenly: where outcomes tell little of a parameter, what is
measured would otherwise be how many truths happen to lie near its bounds. Shares of 200 data sets are uncertain by
0.04, of 400 by 0.03 (two standard deviations). Another number of data sets may be given, for a trial that only prints.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import binom

import rocking
from rocking.calibration import search as population
from rocking.calibration.space import Space

ROOT = Path(__file__).resolve().parents[1]
TABLE = ROOT / "docs" / "_tables" / "calibration-coverage.txt"
FIGURE = ROOT / "docs" / "_static" / "calibration-ranks.png"

#: Data sets of symmetric blocks, and of two-sided ones, which take three times as long.
SYMMETRIC, TWO_SIDED = 400, 200
PROCESSES = 2

TESTS = 60
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
        points = population.sample_points(truth, 1.0, len(motions), rng)
        drawn = np.concatenate([drawn, points[space.contains(points)]])
    blocks = list(space.blocks(drawn[: len(motions)]))
    tested = zip(blocks, motions, strict=True)
    fallen = [rocking.simulate(one, motion, model="linear").overturned for one, motion in tested]
    return np.array(fallen) != (rng.random(len(motions)) < LAPSE)


@dataclass(frozen=True)
class DataSet:
    """Outcomes of a population that is known, and the seed of their calibration."""

    seed: int
    space: Space
    truth: np.ndarray
    motions: list[rocking.Motion]
    overturned: np.ndarray


def data_sets(count: int, two_sided: bool) -> list[DataSet]:
    """Return so many data sets."""
    return list(islice(drawn(2 * count, two_sided), count))


def drawn(count: int, two_sided: bool) -> Iterator[DataSet]:
    """Draw so many truths, and pass over those whose outcomes are all the same."""
    space = Space.from_bounds(**BOUNDS, two_sided=two_sided)
    rng = np.random.default_rng(two_sided)
    truths = population.extend_to_populations(space, space.sample_quasi_randomly(count, rng), rng)
    for seed, truth in enumerate(truths[:, None]):
        motions = tests(rng)
        overturned = outcomes(space, truth, motions, rng)
        if 0 < overturned.sum() < len(motions):
            yield DataSet(seed, space, truth, motions, overturned)


def ranks(given: DataSet) -> dict[str, float]:
    """Share of the posterior below the truth, by parameter."""
    with rocking.set_options(threads=1):
        found = rocking.calibrate(
            given.motions,
            given.overturned,
            model="linear",
            seed=given.seed,
            p=BOUNDS["p"],
            alpha=BOUNDS["alpha"],
            restitution=BOUNDS["restitution"],
            two_sided=given.space.is_two_sided,
            outlier_probability=LAPSE,
        )
    values = given.space.parameters_by_name(population.split_populations(given.truth)[0])
    return {name: float(np.mean(found.draws[name] < values[name][0])) for name in found.estimates}


def table(found: list[dict[str, float]], sides: str) -> str:
    """Shares of central intervals that hold the truth, a row for each parameter."""
    rows = [f"{len(found)} data sets of {TESTS} tests, {sides} blocks"]
    rows.append(f"{'parameter':<20}{'90 % interval':>14}{'50 % interval':>14}{'mean rank':>11}")
    for name in found[0]:
        rank = np.array([one[name] for one in found])
        held = [np.mean(np.abs(rank - 0.5) <= 0.5 * share) for share in (0.9, 0.5)]
        rows.append(f"{name:<20}{held[0]:>14.3f}{held[1]:>14.3f}{rank.mean():>11.3f}")
    return "\n".join(rows) + "\n"


def draw(symmetric: list[dict[str, float]], two_sided: list[dict[str, float]], path: Path) -> None:
    """Draw a histogram of the truth's ranks for each parameter, with the band of 90 % of even ones."""
    figure = Figure(figsize=(10.0, 5.4), layout="constrained")
    rows = figure.subplots(2, 4, sharey="row")
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
        row[0].set_ylim(bottom=0.0)
    rows[0, 3].set_axis_off()
    rows[0, 3].legend(*rows[0, 0].get_legend_handles_labels(), loc="center")
    figure.savefig(path, dpi=150)


def main() -> None:
    """Draw data sets, calibrate each, and tell how often intervals hold the truth."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data_sets", type=int, nargs="?")
    trial = parser.parse_args().data_sets
    with ProcessPoolExecutor(PROCESSES) as pool:
        symmetric = list(pool.map(ranks, data_sets(trial or SYMMETRIC, two_sided=False)))
        two_sided = list(pool.map(ranks, data_sets(trial or TWO_SIDED, two_sided=True)))
    text = "\n".join((table(symmetric, "symmetric"), table(two_sided, "two-sided")))
    print(text)
    if trial is None:
        TABLE.write_text(text, "utf-8")
        draw(symmetric, two_sided, FIGURE)


if __name__ == "__main__":
    main()
