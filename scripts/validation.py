"""Write the tables of docs/validation.md from computation.

Run ``python scripts/validation.py`` from the repository's root (ten minutes). Some tables need what is not part of this
repository, and stay as they are without it: shake-table tests (``--shake-table FOLDER``, as scripts/shake_table.py
takes it), and tests on a small table (``--small-table FILE``: a CSV file of the columns set, pgv_over_pga_s, pga_g and
overturned).
"""

from __future__ import annotations

import argparse
import csv
import datetime
import importlib.metadata
import importlib.util
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from pages import markdown, write

import rocking
from rocking import overturning_map
from rocking.calibration import Scores, Validation
from rocking.core.constants import STANDARD_GRAVITY

ROOT = Path(__file__).resolve().parents[1]

#: Half diagonals, m, and amplitudes over the threshold (each +- 4.9e-6) of Numerics-in-Motion/blocks, under-this-pulse.
OTHERS = {0.25: 1.2618896484375, 0.5: 1.4584423828125, 1.0: 2.1637841796875, 2.0: 5.1549267578125}
OTHERS_ERROR = 4.9e-6

#: Random cases that are compared with SciPy, of each model.
RANDOM = 12

#: Random cases of each kind of body with restraints, of walls, and of laws of restitution.
STANDING = 200

#: A rock of 0.4 kg on a small table: the bounds of its calibrations.
SMALL_P = (3.0, 40.0)
SMALL_ALPHA = (0.005, 0.6)

#: Its p by the mesh, rad/s: the geometric mean of those about its two axes.
MESH_P = 10.69

#: What the calibrations of the validation are of.
LINEAR: dict[str, Any] = {"model": "linear", "restitution": (0.3, 0.99)}


def main() -> None:
    """Write the tables that are named; by default all that can be made here."""
    parser = argparse.ArgumentParser(description="Write the tables of docs/validation.md.")
    parser.add_argument("--shake-table", type=Path, metavar="FOLDER")
    parser.add_argument("--small-table", type=Path, metavar="FILE")
    parser.add_argument("tables", nargs="*", help="blocks, random, standing, shake-table, small-table, judged")
    options = parser.parse_args()
    parts = {"blocks": blocks_tables, "random": random_tables, "standing": standing_tables}
    if options.shake_table:
        parts["shake-table"] = lambda: shake_tables(options.shake_table)
    if options.shake_table and options.small_table:
        parts["judged"] = lambda: judged_tables(options.shake_table, options.small_table)
    if options.small_table:
        parts["small-table"] = lambda: small_tables(options.small_table)
    for name in options.tables or parts:
        write(parts[name]())
    write({"validation-made.txt": versions()})


def versions():
    """Say when the tables were made, and with what."""
    parts = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("numpy", "scipy", "numba"))
    return f"Made on {datetime.date.today().isoformat()} by rocking {rocking.__version__} with {parts}.\n"


# Published numbers


def blocks_tables():
    """Lowest amplitude of a one-sine of half a second that overturns blocks of four sizes."""
    rows = []
    for radius, theirs in OTHERS.items():
        block = rocking.Block(half_width=radius * math.sin(0.2), half_height=radius * math.cos(0.2))
        map_of = overturning_map(
            block, "one-sine", amplitudes=np.linspace(1.001, 6.0, 51), frequencies=[4.0 * math.pi / block.sides[0].p],
            rtol=1e-12,
        )  # fmt: skip
        ours = float(map_of.data.overturning_amplitude[0])
        within = "yes" if abs(ours - theirs) <= OTHERS_ERROR else "no"
        rows.append((f"{radius:g}", f"{theirs:.5f}", f"{ours:.8f}", f"{ours - theirs:+.1e}", within))
    heading = ("R, m", "theirs, +- 4.9e-6", "here", "difference", "within their bound")
    return {"validation-blocks.txt": markdown(heading, rows)}


# An independent integrator on random cases


def random_tables():
    """Differences from DOP853, restarted at every sample and impact, over random blocks under random records."""
    sys.path.insert(0, str(ROOT / "tests"))
    from oracles.problem import Problem, linear_record
    from oracles.scipy_events import integrate

    rows = []
    for model in ("linear", "nonlinear"):
        rng = np.random.default_rng(12)
        impacts, peaks, agree, falls = [], [], 0, 0
        for _ in range(RANDOM):
            p, alpha = float(rng.uniform(1.5, 5.0)), float(rng.uniform(0.08, 0.35))
            e = float(rng.uniform(0.6, 0.92))
            samples = noise(rng) * STANDARD_GRAVITY * math.tan(alpha)
            points, coefficients = linear_record(samples, 0.02)
            theirs = integrate(Problem(model, (p, p), (alpha, alpha), (e, e), points, coefficients), rtol=1e-12)
            block = rocking.Block.from_parameters(p=p, alpha=alpha, restitution=e)
            ours = rocking.simulate(block, rocking.Motion.from_samples(samples, 0.02), model=model)
            agree += ours.overturned == theirs.overturned
            falls += ours.overturned
            shared = min(len(theirs.impacts), len(ours.impacts), 10)
            times = np.array([impact[0] for impact in theirs.impacts[:shared]])
            impacts.append(np.max(np.abs(ours.impacts["time"][:shared] - times), initial=0.0))
            if not (ours.overturned or theirs.overturned) and theirs.peak > 0.0:
                peaks.append(abs(ours.peak_rotation / theirs.peak - 1.0))
        rows.append((model, RANDOM, falls, agree, *(below(np.max(values)) for values in (impacts, peaks))))
    heading = ("model", "cases", "overturn", "same verdict", "first 10 impacts, s", "peak, relative")
    return {"validation-random.txt": markdown(heading, rows)}


def standing_tables():
    """Differences from DOP853 over forces on points, of bodies with restraints, walls and laws of restitution."""
    sys.path.insert(0, str(ROOT / "tests"))
    from oracles.standing import KINDS, single_and_integrated

    rows = []
    for kind in KINDS:
        found = single_and_integrated(kind, 1, STANDING)
        same = found.cases - found.ill - len(found.different)
        rows.append((kind, found.cases, found.impacts, found.overturned, same, found.ill, below(found.worst)))
        sys.stdout.writelines(f"{where}\n" for where in found.different)
    heading = ("body", "cases", "impacts", "overturn", "same", "ill-conditioned", "peak, relative")
    return {"validation-standing.txt": markdown(heading, rows)}


def noise(rng):
    """Five seconds of smooth noise under an envelope, with a peak of 1.5 to 6."""
    times = 0.02 * np.arange(251)
    waves = [rng.normal() * np.sin(2.0 * np.pi * f * times + rng.uniform(0.0, 6.28)) for f in rng.uniform(0.4, 4.0, 12)]
    samples = np.sum(waves, axis=0) * np.sin(np.pi * times / times[-1]) ** 2
    return samples / np.max(np.abs(samples)) * rng.uniform(1.5, 6.0)


# Shake tables


def shake_tables(folder):
    """Cross-validated scores on shake-table tests of two granite specimens, beside other predictions."""
    from shake_table import as_sure_as_right, read

    tests, motions = read(folder)
    groups = [test["ground_motion"].strip().partition("_")[0] for test in tests]
    rows = []
    for specimen in ("1", "2"):
        overturned = np.array([test[f"overturned_specimen_{specimen}"] == "1" for test in tests])
        elements = np.array([test[f"dem_best_specimen_{specimen}"] == "1" for test in tests])
        tuned = Scores.from_predictions(as_sure_as_right(elements, overturned), overturned)
        rows.append(score_row(specimen, "distinct elements, tuned by their authors on all", tuned))
        blocks = {"rocking blocks": rocking.calibrate(motions, overturned, alpha=(0.02, 0.5), **LINEAR)}
        rows += left_out_rows(specimen, motions, overturned, groups, blocks)
    return {"validation-shake-table.txt": markdown(SCORE_HEADING, rows)}


def small_tables(file):
    """Cross-validated scores on tests of a printed rock on a small table."""
    scores = []
    for series, chosen in small_series(file).items():
        motions = [commanded(test) for test in chosen]
        overturned = np.array([test["overturned"] == "1" for test in chosen])
        unknown = rocking.calibrate(motions, overturned, p=SMALL_P, alpha=SMALL_ALPHA, **LINEAR)
        groups = [test["pgv_over_pga_s"] for test in chosen]
        known = rocking.calibrate(motions, overturned, p=MESH_P, alpha=SMALL_ALPHA, **LINEAR)
        blocks = {"rocking blocks": unknown, "rocking blocks, p from the mesh": known}
        scores += left_out_rows(series, motions, overturned, groups, blocks)
    return {"validation-small-table.txt": markdown(SCORE_HEADING, scores)}


def judged_tables(folder, file):
    """Predictions of both sets of tests judged: scores, and whether they are reliable.

    Of the granite tests all that have one source motion belong together, on the small table those with one shape of the
    pulse.
    """
    from shake_table import FOLDS, read

    tests, motions = read(folder)
    groups = [test["ground_motion"].strip().partition("_")[0] for test in tests]
    scores = []
    for specimen in ("1", "2"):
        overturned = [test[f"overturned_specimen_{specimen}"] == "1" for test in tests]
        calibration = rocking.calibrate(motions, overturned, alpha=(0.02, 0.5), **LINEAR)
        judged = judged_of(motions, overturned, groups, calibration, FOLDS)
        scores += [judged_row(f"granite {specimen}", name, one) for name, one in judged.items()]
    for series, chosen in small_series(file).items():
        motions, overturned = [commanded(test) for test in chosen], [test["overturned"] == "1" for test in chosen]
        groups = [test["pgv_over_pga_s"] for test in chosen]
        calibration = rocking.calibrate(motions, overturned, p=MESH_P, alpha=SMALL_ALPHA, **LINEAR)
        judged = judged_of(motions, overturned, groups, calibration, min(FOLDS, len(set(groups))))
        scores += [judged_row(series, name, one) for name, one in judged.items()]
    heading = ("tests", "predicted", "Brier", "skill", "log loss", "skill", "p of reliability")
    return {"validation-judged.txt": markdown(heading, scores)}


def judged_of(motions, overturned, groups, calibration, folds):
    """Judge a calibration on its own tests, and what it said of them while they were left out."""
    tests = [
        rocking.ShakeTest(motion, fell, group=group)
        for motion, fell, group in zip(motions, overturned, groups, strict=True)
    ]
    left_out = calibration.cross_validate(groups=groups, fold_count=folds)
    return {"fitted": rocking.validate(tests, calibration), "left out": rocking.validate(tests, left_out)}


def judged_row(tests, predicted, found):
    """Scores with their standard errors as text."""
    cells = [
        f"{value:.3f} +- {error:.3f}"
        for score in (found.brier, found.log_loss)
        for value, error in ((score.value, score.error), (score.skill, score.skill_error))
    ]
    return tests, predicted, *cells, f"{found.reliability_p_value:.2g}"


def small_series(file):
    """Return the tests of each series on the small table."""
    with file.open(newline="", encoding="utf-8") as opened:
        # A command of nothing has no PGA to regress on.
        tests = [test for test in csv.DictReader(opened) if float(test["pga_g"]) > 0.0]
    return {name: [test for test in tests if test["set"] == name] for name in sorted({test["set"] for test in tests})}


def commanded(test):
    """One period of a cosine, as the table was told to move."""
    frequency = 1.0 / (2.0 * math.pi * float(test["pgv_over_pga_s"]))
    return rocking.pulses.one_cosine(float(test["pga_g"]) * STANDARD_GRAVITY, frequency)


def left_out_rows(specimen, motions, overturned, groups, calibrations):
    """Scores on tests that were left out, in groups as wholes, of a logistic regression and of calibrations."""
    from shake_table import FOLDS, left_out

    folds = min(FOLDS, len(set(groups)))
    intensities = np.log([(motion.pga, motion.pgv) for motion in motions])
    chances = left_out(intensities, overturned, groups, 1)
    regression = Validation(chances, tuple(Scores.from_predictions(row, overturned) for row in chances)).scores
    scores = {name: one.cross_validate(groups=groups, fold_count=folds).scores for name, one in calibrations.items()}
    told = {"logistic regression on PGA and PGV": regression, **scores}
    return [score_row(specimen, name, one) for name, one in told.items()]


SCORE_HEADING = ("tests", "predicted by", "accuracy", "log loss", "Brier")


def score_row(specimen, name, one):
    """Scores as text."""
    return specimen, name, f"{100.0 * one.accuracy:.1f} %", f"{one.log_loss:.3f}", f"{one.brier:.3f}"


# Text


def below(difference):
    """Power of ten that a difference is below, 1e-11 at least: what is less depends on the machine."""
    return f"below 1e{max(-11, math.ceil(math.log10(max(difference, 1e-300)) + 1e-9))}"


if __name__ == "__main__":
    main()
