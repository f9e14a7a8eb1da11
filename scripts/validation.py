"""Write the tables of docs/validation.md from computation.

Run ``python scripts/validation.py`` from the repository's root (ten minutes). Some tables need what is not part of this
repository, and stay as they are without it: OpenSeesPy, shake-table tests (``--shake-table FOLDER``, as
scripts/shake_table.py takes it), and tests on a small table (``--small-table FILE``: a CSV file of the columns set,
pgv_over_pga_s, pga_g and overturned).
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
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

import rocking
from rocking import overturning_map
from rocking.analysis import Scores, Validation
from rocking.constants import STANDARD_GRAVITY

ROOT = Path(__file__).resolve().parents[1]
TABLES = ROOT / "docs" / "_tables"

#: Half diagonals, m, and amplitudes over the threshold (each +- 4.9e-6) of Numerics-in-Motion/blocks, under-this-pulse.
OTHERS = {0.25: 1.2618896484375, 0.5: 1.4584423828125, 1.0: 2.1637841796875, 2.0: 5.1549267578125}
OTHERS_ERROR = 4.9e-6

#: Slenderness, restitution, and the largest frequency over p that Zhang and Makris (2001) print for overturning with
#: impact under a one-sine pulse; the last two are where to look: frequency and amplitude.
LIMITS = ((0.25, 0.9, 7.58, 7.4, 9.9), (0.349, 0.825, 5.8, 5.3, 5.6))

#: Random cases that are compared with SciPy, of each model.
RANDOM = 12

#: Random cases of each kind of body with restraints, of walls, and of laws of restitution.
STANDING = 200

#: A rock of 0.4 kg on a small table: the bounds of its calibrations, and their seeds.
SMALL_P = (3.0, 40.0)
SMALL_ALPHA = (0.005, 0.6)

#: Its p by the mesh, rad/s: the geometric mean of those about its two axes.
MESH_P = 10.69

#: What the calibrations of the validation are of.
LINEAR: dict[str, Any] = {"model": "linear", "restitution": (0.3, 0.99)}
SEEDS = (0, 1, 2)


def main() -> None:
    """Write the tables that are named; by default all that can be made here."""
    parser = argparse.ArgumentParser(description="Write the tables of docs/validation.md.")
    parser.add_argument("--shake-table", type=Path, metavar="FOLDER")
    parser.add_argument("--small-table", type=Path, metavar="FILE")
    parser.add_argument(
        "tables", nargs="*", help="quick, limits, random, standing, opensees, shake-table, small-table, judged"
    )
    options = parser.parse_args()
    parts = {"quick": quick_tables, "limits": limits_tables, "random": random_tables, "standing": standing_tables}
    if importlib.util.find_spec("openseespy"):
        parts["opensees"] = opensees_tables
    if options.shake_table:
        parts["shake-table"] = lambda: shake_tables(options.shake_table)
    if options.shake_table and options.small_table:
        parts["judged"] = lambda: judged_tables(options.shake_table, options.small_table)
    if options.small_table:
        parts["small-table"] = lambda: small_tables(options.small_table)
    for name in options.tables or parts:
        write(parts[name]())
    write({"validation-made.txt": versions()})


def write(made):
    """Write tables by file name."""
    for name, text in made.items():
        (TABLES / name).write_text(text, encoding="utf-8")
        sys.stdout.write(f"{name}\n{text}\n")
        sys.stdout.flush()


def quick_tables():
    """Make the tables that take seconds, by file name."""
    return {name: table() for name, table in QUICK.items()}


def versions():
    """Say when the tables were made, and with what."""
    parts = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("numpy", "scipy", "numba"))
    return f"Made on {datetime.date.today().isoformat()} by rocking {rocking.__version__} with {parts}.\n"


# Published numbers


def blocks_table():
    """Lowest amplitude of a one-sine of half a second that overturns blocks of four sizes."""
    rows = []
    for radius, theirs in OTHERS.items():
        block = rocking.Block(half_width=radius * math.sin(0.2), half_height=radius * math.cos(0.2))
        ours = lowest_amplitude(block, "one-sine", 4.0 * math.pi / block.sides[0].p, np.linspace(1.001, 6.0, 51))
        within = "yes" if abs(ours - theirs) <= OTHERS_ERROR else "no"
        rows.append((f"{radius:g}", f"{theirs:.5f}", f"{ours:.8f}", f"{ours - theirs:+.1e}", within))
    return markdown(("R, m", "theirs, +- 4.9e-6", "here", "difference", "within their bound"), rows)


def lowest_amplitude(block, pulse, frequency, amplitudes, model="nonlinear"):
    """Lowest amplitude over the threshold that overturns, at a frequency over p."""
    found = overturning_map(
        block, pulse, amplitudes=amplitudes, frequencies=[frequency], model=model, tolerance=1e-12, progress=False
    )
    return float(found.overturning_amplitude[0])


# Closed forms of the slender block


def pulses_table():
    """Amplitudes from which pulses overturn a slender block without impact, and their closed forms."""
    slender = rocking.Block.from_parameters(p=1.0, alpha=1e-3, restitution=0.5)
    rows = []
    for length in (0.5, 1.0, 2.0):
        closed = 1.0 / -math.expm1(-length)
        cosh = math.cosh(length) - 1.0
        assert abs(closed * (closed - 1.0) * 2.0 * cosh - 1.0) < 1e-12  # Housner's own form
        # A rectangle counts by its length, so the frequency of the family is 1/(2 length).
        ours = lowest_amplitude(slender, rectangle, math.pi / length, np.geomspace(1.001, 20.0, 13), "linear")
        rows.append(("rectangle", f"p t = {length:g}", f"{closed:.9f}", *compared(ours, closed)))
    for name, sign, cycles in (("half-sine", 1.0, 0.5), ("one-sine", -1.0, 1.0)):
        for frequency in (1.0, 2.0, 5.0):
            closed = brentq(
                lambda a, w=frequency, s=sign, c=cycles: without_impact(a, w, s, c), 1.0 + 1e-12, 100.0, xtol=1e-14
            )
            grid = np.geomspace(1.001, 30.0, 41)
            ours = last_amplitude(slender, name, frequency, grid)
            rows.append((name, f"omega/p = {frequency:g}", f"{closed:.9f}", *compared(ours, closed)))
    return markdown(("pulse", "", "closed form", "here", "relative difference"), rows)


def half_sine_table():
    """Housner's formula for the half sine, which leaves out what the arc owes to its start, and the whole condition."""
    rows = []
    for w in (0.5, 1.0, 2.0, 4.0, 8.0):
        printed = math.hypot(1.0, w)
        whole = brentq(lambda a, w=w: without_impact(a, w, 1.0, 0.5), 1.0 + 1e-12, 100.0, xtol=1e-14)
        rows.append((f"{w:g}", f"{printed:.4f}", f"{whole:.4f}", f"{100.0 * (printed / whole - 1.0):.1f}"))
    return markdown(("omega/p", "Housner", "whole condition", "too high by, %"), rows)


def rectangle(amplitude, frequency):
    """Rectangular pulse of half a period."""
    return rocking.pulses.rectangular(amplitude, 0.5 / frequency)


def without_impact(amplitude, w, sign, cycles):
    """Growing part of the first arc after a sine of some cycles: above 0 the block overturns (Zhang and Makris)."""
    lift = math.asin(1.0 / amplitude)
    grown = amplitude * math.exp(-(2.0 * math.pi * cycles - lift) / w)
    return math.sqrt(amplitude**2 - 1.0) + sign * grown - w


def last_amplitude(block, pulse, frequency, amplitudes):
    """Amplitude from which on a slender block overturns without impact."""
    found = overturning_map(
        block, pulse, amplitudes=amplitudes, frequencies=[frequency], model="linear", tolerance=1e-12, progress=False
    )
    return float(found.boundary_amplitude.values[found.mode_above.values == 0][-1])


def free_table():
    """Free rocking of a slender block: period and decay of Housner (1963)."""
    rows = []
    for share in (0.1, 0.5, 0.9, 0.99):
        block = rocking.Block.from_parameters(p=2.0, alpha=0.1, restitution=0.9)
        free = rocking.simulate(block, None, model="linear", initial_rotation=share * 0.1)
        times = free.impacts["time"]
        period = 4.0 / 2.0 * math.acosh(1.0 / (1.0 - share))
        rows.append((f"{share:g}", "period, s", f"{period:.9f}", *compared(4.0 * float(times[0]), period)))
        kept = 0.9 ** (2 * 5) * (1.0 - (1.0 - share) ** 2)
        decayed = -math.expm1(0.5 * math.log1p(-kept))
        middle = 0.5 * float(times[4] + times[5])
        ours = abs(float(free.rotation(middle))) / 0.1
        rows.append((f"{share:g}", "peak after 5 impacts, over alpha", f"{decayed:.9f}", *compared(ours, decayed)))
    return markdown(("released at, over alpha", "", "closed form", "here", "relative difference"), rows)


# Zhang and Makris: up to which frequency a one-sine overturns with impact


def limits_tables():
    """Largest frequencies at which a one-sine overturns a block after an impact: printed, here, and by SciPy."""
    rows = []
    for alpha, eta, printed, frequency, amplitude in LIMITS:
        scipy, at = scipy_limit(alpha, eta, frequency, amplitude)
        ours = package_limit(alpha, eta, scipy, at)
        lacking = best_margin(alpha, eta, printed, (at - 0.5, at + 2.0))[0]
        needed = eta * math.sqrt(1.0 / (1.0 + lacking))
        numbers = (f"{alpha:g}", f"{eta:g}", f"{printed:g}", f"{ours:.5f}", f"{scipy:.5f}", f"{at:.3f}")
        rows.append((*numbers, f"{100.0 * lacking:.2f} %", f"{needed:.4f}"))
    heading = ("alpha", "eta", "printed", "here", "SciPy", "amplitude", "energy at the printed one", "eta for it")
    return {"validation-limits.txt": markdown(heading, rows)}


def package_limit(alpha, eta, about, amplitude):
    """Bisect the frequency between one with an amplitude that overturns after an impact and one without."""
    block = rocking.Block.from_parameters(p=1.0, alpha=alpha, restitution=eta)
    amplitudes = amplitude + np.linspace(-0.05, 0.05, 2001)

    def overturns(frequency):
        found = overturning_map(
            block, "one-sine", amplitudes=amplitudes, frequencies=[frequency], tolerance=1e-3, progress=False
        )
        return bool((found.mode.values == 1).any())

    low, high = about - 1e-3, about + 1e-3
    assert overturns(low)
    assert not overturns(high)
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if overturns(middle) else (low, middle)
    return 0.5 * (low + high)


def scipy_limit(alpha, eta, frequency, amplitude):
    """Frequency at which the best amplitude just overturns after an impact, and that amplitude."""
    window = (amplitude - 0.7, amplitude + 0.7)
    found = brentq(
        lambda w: best_margin(alpha, eta, w, window)[0], frequency - 0.1, frequency + 0.3, xtol=1e-8, rtol=1e-10
    )
    return found, best_margin(alpha, eta, found, window)[1]


def best_margin(alpha, eta, frequency, window):
    """Largest margin over the amplitudes of a window, and its amplitude."""
    best = minimize_scalar(
        lambda a: -margin(alpha, eta, frequency, a), bounds=window, method="bounded", options={"xatol": 1e-8}
    )
    return -best.fun, float(best.x)


def margin(alpha, eta, w, amplitude):
    """Energy after the first impact over that of the balance point, less 1, under a one-sine: above 0 it overturns.

    Rotation u in size and its rate, in time p t, by DOP853. About the limit the block is on its way back as the pulse
    ends, and lands after it; from the end of the pulse on only the impact takes energy.
    """
    push = amplitude * math.tan(alpha)

    def motion(t, y):
        lean = alpha - y[0]
        return y[1], -math.sin(lean) + push * math.sin(w * t) * math.cos(lean)

    start, end = math.asin(1.0 / amplitude) / w, 2.0 * math.pi / w
    arc = solve_ivp(motion, (start, end), (0.0, 0.0), method="DOP853", rtol=1e-13, atol=1e-15)
    u, rate = arc.y[:, -1]
    assert u > 0.0 > rate
    energy = 0.5 * rate**2 + 2.0 * math.sin(0.5 * u) * math.sin(alpha - 0.5 * u)
    return float(eta**2 * energy / (2.0 * math.sin(0.5 * alpha) ** 2) - 1.0)


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


# OpenSees: an elastic block that becomes stiffer


def opensees_tables():
    """First peaks under half sines: OpenSees' RockingBC for ever stiffer blocks, and the rigid block."""
    alpha, p = 0.2, 2.0
    radius = 0.75 * STANDARD_GRAVITY / p**2
    width, height = 2.0 * radius * math.sin(alpha), 2.0 * radius * math.cos(alpha)
    block = rocking.Block(width=width, height=height)
    rows = []
    for amplitude, frequency in ((2.0, 4.0), (3.0, 6.0)):
        acceleration = amplitude * STANDARD_GRAVITY * math.tan(alpha)
        pulse = rocking.pulses.half_sine(acceleration, frequency * p / (2.0 * math.pi))
        rigid = rocking.simulate(block, pulse).peak_rotation / alpha
        elastic = [
            rocking_bc(width, height, acceleration, frequency * p / (2.0 * math.pi), softness) / alpha
            for softness in (1e-4, 1e-5, 1e-6, 1e-7)
        ]
        rows.append((f"{amplitude:g}", f"{frequency:g}", *(f"{peak:.4f}" for peak in elastic), f"{rigid:.4f}"))
    heading = ("amplitude", "omega/p", *(f"rho g H/E = 1e-{k}" for k in (4, 5, 6, 7)), "rigid, here")
    return {"validation-opensees.txt": markdown(heading, rows)}


def rocking_bc(width, height, amplitude, frequency, softness):
    """First peak of the rotation of an elastic block under a half sine, rad."""
    import openseespy.opensees as ops

    density = 2.5
    modulus = density * STANDARD_GRAVITY * height / softness
    mass = density * width * height
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    for node, level in ((1, 0.0), (2, 0.5 * height), (3, height)):
        ops.node(node, 0.0, level)
    control = {
        "-convlim": 1e-15, "-useshear": 0, "-blevery": 1, "-useUelNM": 1, "-usecomstiff": 0, "-af": 1.0, "-aflim": 0.4,
        "-convlimmult": 1.0, "-maxtries": 50, "-NlimN": 0.01, "-NlimT": 1.0, "-Dtlim": 1e-8, "-errorifNexceeds": 1,
    }  # fmt: skip
    elastic = -1e6 * density * STANDARD_GRAVITY * height
    flat = [part for pair in control.items() for part in pair]
    ops.element("RockingBC", 1, 2, 1, 15, modulus, 0.0, elastic, width, 1.0, 0.0, *flat)
    ops.geomTransf("Corotational", 1)
    ops.element("elasticBeamColumn", 2, 2, 3, width, modulus, width**3 / 12.0, 1)
    ops.fix(1, 1, 1, 1)
    ops.mass(2, mass, mass, mass * (width**2 + height**2) / 12.0)
    _stand(ops, mass)
    ops.rayleigh(0.0, 0.1 / math.sqrt(ops.eigen("-fullGenLapack", 1)[0]), 0.0, 0.0)
    _shake(ops, amplitude, frequency)
    return _first_peak(ops, 0.5 / frequency)


def _stand(ops, mass):
    """Apply the weight."""
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(2, 0.0, -mass * STANDARD_GRAVITY, 0.0)
    _solve_by(ops, ("EnergyIncr", 1e-10, 100), ("LoadControl", 0.1), "Static")
    assert ops.analyze(10) == 0
    ops.loadConst("-time", 0.0)


def _shake(ops, amplitude, frequency):
    """Set up a half sine of the ground."""
    times = np.linspace(0.0, 0.5 / frequency, 2001)
    values = amplitude * np.sin(2.0 * math.pi * frequency * times)
    values[-1] = 0.0
    ops.timeSeries("Path", 2, "-time", *times.tolist(), 100.0, "-values", *values.tolist(), 0.0)
    ops.pattern("UniformExcitation", 3, 1, "-accel", 2)
    ops.wipeAnalysis()
    _solve_by(ops, ("RelativeNormUnbalance", 1e-8, 100), ("Newmark", 0.5, 0.25), "Transient")


def _solve_by(ops, test, integrator, analysis):
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test(*test)
    ops.algorithm("Newton")
    ops.integrator(*integrator)
    ops.analysis(analysis)


def _first_peak(ops, pulse):
    """Step on, shorter where the contact changes fast, until the rotation falls again after the pulse."""
    longest = step = 2e-4
    peak, good = 0.0, 0
    while True:
        if ops.analyze(1, step):
            step, good = max(1e-8, 0.5 * step), 0
            continue
        good += 1
        if good >= 10:
            step = min(longest, 1.5 * step)
        rotation = abs(ops.nodeDisp(2, 3))
        if ops.getTime() > pulse and rotation < 0.9 * peak:
            return peak
        peak = max(peak, rotation)


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
        tuned = Scores.of(as_sure_as_right(elements, overturned), overturned)
        rows.append(score_row(specimen, "distinct elements, tuned by their authors on all", tuned))
        blocks = {"rocking blocks": rocking.calibrate(motions, overturned, alpha=(0.02, 0.5), **LINEAR)}
        rows += left_out_rows(specimen, motions, overturned, groups, blocks)
    return {"validation-shake-table.txt": markdown(SCORE_HEADING, rows)}


def small_tables(file):
    """Cross-validated scores on tests of a printed rock on a small table, and its p from three seeds."""
    scores, found = [], []
    for series, chosen in small_series(file).items():
        motions = [commanded(test) for test in chosen]
        overturned = np.array([test["overturned"] == "1" for test in chosen])
        calibrated = [
            rocking.calibrate(motions, overturned, seed=seed, p=SMALL_P, alpha=SMALL_ALPHA, **LINEAR) for seed in SEEDS
        ]
        groups = [test["pgv_over_pga_s"] for test in chosen]
        known = rocking.calibrate(motions, overturned, seed=SEEDS[0], p=MESH_P, alpha=SMALL_ALPHA, **LINEAR)
        blocks = {"rocking blocks": calibrated[0], "rocking blocks, p from the mesh": known}
        scores += left_out_rows(series, motions, overturned, groups, blocks)
        found += [estimate_row(series, one) for one in calibrated]
    heading = ("series", "seed", "p, rad/s", "90 %", "restitution", "90 %", "effective candidates", "R-hat")
    return {
        "validation-small-table.txt": markdown(SCORE_HEADING, scores),
        "validation-small-table-seeds.txt": markdown(heading, found),
    }


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
    left_out = calibration.cross_validate(groups=groups, folds=folds)
    return {"fitted": rocking.validate(tests, calibration), "left out": rocking.validate(tests, left_out)}


def judged_row(tests, predicted, found):
    """Scores with their standard errors as text."""
    cells = [
        f"{value:.3f} +- {error:.3f}"
        for score in (found.brier, found.log_loss)
        for value, error in ((score.value, score.error), (score.skill, score.skill_error))
    ]
    return tests, predicted, *cells, f"{found.reliability_chance:.2g}"


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


def estimate_row(series, found):
    """Estimates of one seed."""
    cells = []
    for name, digits in (("p", 1), ("restitution", 2)):
        one = found.estimates[name]
        cells += [f"{one.median:.{digits}f}", f"{one.lower:.{digits}f} to {one.upper:.{digits}f}"]
    looked = found.diagnostics
    return (series, found.seed, *cells, f"{looked.effective:.0f}", f"{max(looked.agreement.values()):.2f}")


def left_out_rows(specimen, motions, overturned, groups, calibrations):
    """Scores on tests that were left out, in groups as wholes, of a logistic regression and of calibrations."""
    from shake_table import FOLDS, left_out

    folds = min(FOLDS, len(set(groups)))
    intensities = np.log([(motion.pga, motion.pgv) for motion in motions])
    chances = left_out(intensities, overturned, groups, 1)
    regression = Validation(chances, tuple(Scores.of(row, overturned) for row in chances)).scores
    scores = {name: one.cross_validate(groups=groups, folds=folds).scores for name, one in calibrations.items()}
    told = {"logistic regression on PGA and PGV": regression, **scores}
    return [score_row(specimen, name, one) for name, one in told.items()]


SCORE_HEADING = ("tests", "predicted by", "accuracy", "log loss", "Brier")


def score_row(specimen, name, one):
    """Scores as text."""
    return specimen, name, f"{100.0 * one.accuracy:.1f} %", f"{one.log_loss:.3f}", f"{one.brier:.3f}"


# Text


def compared(ours, theirs):
    """Return a number, and by how much it differs at most."""
    return f"{ours:.9f}", below(abs(ours / theirs - 1.0))


def below(difference):
    """Power of ten that a difference is below, 1e-11 at least: what is less depends on the machine."""
    return f"below 1e{max(-11, math.ceil(math.log10(max(difference, 1e-300)) + 1e-9))}"


def markdown(heading, rows):
    """Write a table as Markdown; columns of numbers to the right, the others to the left."""
    columns = zip(*rows, strict=True)
    lines = [heading, ["---:" if all(is_number(cell) for cell in column) else "---" for column in columns], *rows]
    return "".join("| " + " | ".join(str(cell) for cell in line) + " |\n" for line in lines)


def is_number(cell):
    """Whether a cell is empty or starts like a number."""
    return str(cell)[:1] in "+-0123456789"


#: What makes each table that takes seconds.
QUICK = {
    "validation-blocks.txt": blocks_table,
    "validation-pulses.txt": pulses_table,
    "validation-half-sine.txt": half_sine_table,
    "validation-free.txt": free_table,
}


if __name__ == "__main__":
    main()
