"""Calibrate two rock specimens on shake-table tests: which motions overturned them, and which will.

    python scripts/shake_table.py FOLDER [--cross-validate REPEATS]

FOLDER holds index.csv (columns test, ground_motion, overturned_specimen_1, dem_best_specimen_1, ... _2) and
table_acceleration.npz (one array test_N for each test: the table's acceleration in g at 200 Hz). The data are those of
Chen et al. (Seismica v3i1.692); they do not ship with this package.
"""

import argparse
import csv
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

import rocking
from rocking.calibration import Scores, Validation
from rocking.core.constants import STANDARD_GRAVITY

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

STEP = 0.005  # s
FOLDS = 10

#: Strength of the prior that keeps the logistic regression's slopes finite: N(0, 1/RIDGE) on standardised covariates.
RIDGE = 0.1


def main() -> None:
    """Calibrate both specimens, say how good the predictions are, and how good simpler ones would be."""
    parser = argparse.ArgumentParser(description="Calibrate two rock specimens on shake-table tests.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cross-validate", type=int, default=0, metavar="REPEATS")
    options = parser.parse_args()
    tests, motions = read(options.folder)
    groups = [test["ground_motion"].strip().partition("_")[0] for test in tests]
    intensities = np.log([(motion.pga, motion.pgv) for motion in motions])
    for specimen in ("1", "2"):
        overturned = np.array([test[f"overturned_specimen_{specimen}"] == "1" for test in tests])
        elements = np.array([test[f"dem_best_specimen_{specimen}"] == "1" for test in tests])
        print(f"\nSpecimen {specimen}")
        start, worked = time.perf_counter(), time.process_time()
        calibration = rocking.calibrate(motions, overturned, model="linear", alpha=(0.02, 0.5), restitution=(0.3, 0.99))
        print(calibration.summary())
        print(f"calibrated in {time.perf_counter() - start:.0f} s ({time.process_time() - worked:.0f} s of CPU time)")
        print(f"\n{'':<44}accuracy  log loss  Brier")
        report(
            "distinct elements, tuned by their authors",
            Scores.from_predictions(as_sure_as_right(elements, overturned), overturned),
        )
        report(
            "logistic regression, fitted",
            Scores.from_predictions(logistic(intensities, overturned)(intensities), overturned),
        )
        report("rocking blocks, fitted", calibration.scores)
        for name, labels in (("random folds", None), ("folds of source motions", groups)):
            if options.cross_validate:
                chances = left_out(intensities, overturned, labels, options.cross_validate)
                repeats = tuple(Scores.from_predictions(row, overturned) for row in chances)
                report(f"logistic regression, {name}", Validation(chances, repeats).scores)
                validation = calibration.cross_validate(
                    groups=labels, fold_count=FOLDS, repeat_count=options.cross_validate
                )
                report(f"rocking blocks, {name}", validation.scores)


def read(folder: Path) -> tuple[list[dict[str, str]], list[rocking.Motion]]:
    """Read the tests and the motions of the table."""
    with (folder / "index.csv").open(newline="", encoding="utf-8") as file:
        tests = list(csv.DictReader(file))
    with np.load(folder / "table_acceleration.npz") as table:
        samples = [STANDARD_GRAVITY * table[f"test_{test['test']}"].astype(np.float64) for test in tests]
    named = zip(samples, tests, strict=True)
    return tests, [rocking.Motion.from_samples(values, STEP, name=f"test {test['test']}") for values, test in named]


def logistic(covariates: Floats, observed: Flags) -> Callable[[Floats], Floats]:
    """Logistic regression on standardised covariates, its slopes held by a weak prior; a function of covariates."""
    centre, scale = covariates.mean(axis=0), covariates.std(axis=0)
    signs = np.where(observed, 1.0, -1.0)

    def linear(values: Floats, weights: Floats) -> Floats:
        return np.asarray(weights[0] + (values - centre) / scale @ weights[1:])

    def cost(weights: Floats) -> float:
        losses = np.logaddexp(0.0, -signs * linear(covariates, weights))
        return float(losses.sum() + 0.5 * RIDGE * weights[1:] @ weights[1:])

    weights = minimize(cost, np.zeros(covariates.shape[1] + 1)).x
    return lambda values: 1.0 / (1.0 + np.exp(-linear(values, weights)))


def as_sure_as_right(predicted: Flags, observed: Flags) -> Floats:
    """Give predictions of yes or no the probability that is best for them: how often they are right."""
    right = float(np.mean(predicted == observed))
    return np.where(predicted, right, 1.0 - right)


def left_out(covariates: Floats, observed: Flags, groups: list[str] | None, repeats: int) -> Floats:
    """Probabilities for each test from the regression on the folds without it, shape (repeats, m)."""
    labels = np.unique(np.arange(len(observed)) if groups is None else groups, return_inverse=True)[1]
    rng = np.random.default_rng(0)
    chances = np.empty((repeats, len(observed)))
    for row in chances:
        parts = rng.permutation(np.arange(labels.max() + 1) % FOLDS)[labels]
        for part in range(FOLDS):
            out = parts == part
            row[out] = logistic(covariates[~out], observed[~out])(covariates[out])
    return chances


def report(name: str, scores: Scores) -> None:
    """Print one line of the table."""
    print(f"{name:<44}{100 * scores.accuracy:>6.1f} %{scores.log_loss:>10.3f}{scores.brier:>7.3f}")


if __name__ == "__main__":
    main()
