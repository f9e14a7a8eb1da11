"""Block-steps per second: ensembles beside SciPy's event loop and beside a plain compiled Runge-Kutta loop.

Usage: python benchmarks/bench_ensemble.py

A block-step is one block through one sample of the record, whether it rocks, rests or has fallen. Times are processor
times of one core in one run. The Runge-Kutta loop is what one writes with numba in an afternoon: one step per sample,
an impact where the rotation has changed sign at the end of a step, rest below a velocity threshold.
"""

import functools
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import get_args

import numba
import numpy as np

import rocking
from rocking.core.constants import Model
from rocking.engine.problem import build_settings, prepare_grounds
from rocking.engine.schemes import Certified
from rocking.kernels import lanes, state

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from oracles.problem import Problem  # noqa: E402
from oracles.scipy_events import integrate_as_practised  # noqa: E402

RECORDS = ROOT.parent / "shared" / "records" / "test_only"
NAMES = ("RSN6_IMPVALL.I_I-ELC180-hor1.AT2", "RSN753_LOMAP_CLS000-hor1.AT2")
SHIPPED, SHIPPED_UP = "el-centro-meloland-270", "el-centro-meloland-up"
G = 9.80665
REPETITIONS = 3
SCIPY_SAMPLE = 12


def main() -> None:
    blocks = rocking.Blocks.grid(p=np.linspace(1.5, 6.0, 100), alpha=np.linspace(0.08, 0.4, 100), restitution=0.9)
    motions = [rocking.read(RECORDS / name) for name in NAMES if (RECORDS / name).exists()]
    for motion in motions or [rocking.records.load(SHIPPED)]:
        acceleration = np.asarray(motion.acceleration(motion.breakpoints))
        steps = len(blocks) * (len(acceleration) - 1)
        print(f"{motion.name}: {len(acceleration)} samples, {len(blocks)} blocks, {steps:.3g} block-steps")
        for model in get_args(Model):
            report(model, motion, acceleration, blocks, steps)
        print()
    report_vertical(blocks)
    for model in get_args(Model):
        report_analyses(model)


def report(model: Model, motion: rocking.Motion, acceleration: np.ndarray, blocks: rocking.Blocks, steps: int) -> None:
    """Print the rates of one model."""
    with rocking.set_options(threads=1):
        own = shortest(lambda: rocking.simulate_many(blocks, motion, model=model)) / steps
    result = rocking.simulate_many(blocks, motion, model=model).isel(motion=0)
    nonlinear = model == "nonlinear"
    arguments = (acceleration, motion.dt, blocks.p[:, 0].copy(), blocks.alpha[:, 0].copy(), 0.9, nonlinear)
    plain = shortest(lambda: runge_kutta(*arguments)) / steps
    baseline = scipy_time(model, acceleration, motion, blocks) / (len(acceleration) - 1)
    print(
        f"\n{model}: {float(result.impacts.mean()):.0f} impacts per block, {float(result.overturned.mean()):.0%} fall"
    )
    print(f"  lanes         {1e9 * own:10.2f} ns per block-step  {1.0 / own:9.3g} per second and core")
    print(f"  Runge-Kutta   {1e9 * plain:10.2f} ns                {plain / own:9.2f} times the lanes' time")
    print(f"  SciPy         {1e9 * baseline:10.0f} ns                {baseline / own:9.0f} times")


def report_vertical(blocks: rocking.Blocks) -> None:
    """Print what a vertical component costs, in lanes and one block after the other."""
    motion = rocking.records.load(SHIPPED).with_vertical(rocking.records.load(SHIPPED_UP))
    steps = len(blocks) * len(motion.coefficients)
    print(f"{motion.name} with {SHIPPED_UP}, ns per block-step: horizontal alone; both in lanes; both one by one")
    for model in get_args(Model):
        alone, together, each = (1e9 * time / steps for time in vertical_times(model, motion, blocks))
        print(f"  {model:10} {alone:8.2f} {together:8.2f} {each:8.2f}   lanes {each / together:.2f} times as fast")
    print()


def vertical_times(model: Model, motion: rocking.Motion, blocks: rocking.Blocks) -> tuple[float, float, float]:
    """Processor times of an ensemble: under the horizontal component alone, under both, under both without lanes."""
    horizontal = motion.with_vertical(None)
    with rocking.set_options(threads=1):
        return (
            shortest(lambda: rocking.simulate_many(blocks, horizontal, model=model)),
            shortest(lambda: rocking.simulate_many(blocks, motion, model=model)),
            shortest(lambda: one_by_one(model, motion, blocks)),
        )


def one_by_one(model: Model, motion: rocking.Motion, blocks: rocking.Blocks) -> None:
    """March every block to its end, as bodies that lanes do not support."""
    scheme, (group,) = Certified(), prepare_grounds((motion,), blocks.gravity)
    records = blocks.create_kernel_structs(model, scheme.thresholds(blocks, motion, model))
    states = state.create_states(len(blocks), state.NO_STOP_PIECE)
    index, factors = np.zeros(len(blocks), dtype=np.int64), np.ones(len(blocks))
    pool = lanes.build_pool(group.grounds, index, factors, records, states, math.inf, 0)
    lanes.march_blocks(build_settings(blocks, model, scheme, None, writes_tables=False), state.create_scratch(), pool)


def report_analyses(model: Model) -> None:
    """Print the times of analyses of one body, and of some, under many motions and levels."""
    block, record = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9), rocking.records.load(SHIPPED)
    tied = rocking.RestrainedBlock(
        rocking.Block(width=0.5, height=3.0, mass=3e3, restitution=0.9), rocking.Tendon(1e5, prestress=1e3)
    )
    synthetic = [create_synthetic(seed) for seed in range(44)]
    scales, levels = np.linspace(0.2, 3.0, 300), np.linspace(0.5, 12.0, 40)
    ten = rocking.Blocks(p=np.linspace(1.0, 5.0, 10), alpha=0.2, restitution=0.9)
    sizes = rocking.Blocks(p=np.geomspace(0.8, 8.0, 100), alpha=0.2, restitution=0.9)
    equal = rocking.Blocks(p=np.full(300, 2.0), alpha=0.2, restitution=0.9)
    many = functools.partial(rocking.simulate_many, model=model)
    analysis = functools.partial(rocking.incremental_dynamic_analysis, model=model)
    fragility = functools.partial(rocking.fragility, levels=levels, model=model)
    works: dict[str, Callable[[], object]] = {
        f"one block, 300 scalings of {record.name}: loop of simulate": lambda: [
            rocking.simulate(block, record.scaled(float(scale)), model=model) for scale in scales
        ],
        "  simulate_many": lambda: many(block, record, levels=scales),
        "  incremental_dynamic_analysis": lambda: analysis(block, record, levels=scales),
        "  300 equal blocks under the record": lambda: many(equal, record),
        "one block, 44 synthetic records, 40 levels: fragility": lambda: fragility(block, synthetic),
        "  incremental_dynamic_analysis with refined ends": lambda: analysis(block, synthetic, levels=levels),
        "  ten blocks, fragility": lambda: fragility(ten, synthetic),
        "  a wall with a tendon, fragility": lambda: fragility(tied, synthetic),
        "  100 sizes, unscaled": lambda: many(sizes, synthetic),
    }
    print(f"{model}: processor seconds of one core")
    with rocking.set_options(threads=1):
        for label, work in works.items():
            print(f"  {label:70} {shortest(work):8.4f}")
    print()


def create_synthetic(seed: int, count: int = 4000, dt: float = 0.01) -> rocking.Motion:
    """Create filtered noise with an envelope: 40 s, corner at 4 Hz, 3 m/s^2."""
    frequency, time_axis = np.fft.rfftfreq(count, dt), np.arange(count) * dt
    spectrum = np.fft.rfft(np.random.default_rng(seed).standard_normal(count)) * (frequency / 0.5) ** 2
    noise = np.fft.irfft(spectrum / (1.0 + (frequency / 0.5) ** 2) / (1.0 + (frequency / 4.0) ** 2), count)
    acceleration = noise * (time_axis / 6.0) ** 2 * np.exp(2.0 - time_axis / 3.0)
    return rocking.Motion.from_samples(3.0 * acceleration / np.abs(acceleration).max(), dt, name=f"synthetic {seed}")


def shortest(work: Callable[[], object]) -> float:
    """Shortest processor time of a few calls, after one to compile."""
    work()
    best = math.inf
    for _ in range(REPETITIONS):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return best


def scipy_time(model: str, acceleration: np.ndarray, motion: rocking.Motion, blocks: rocking.Blocks) -> float:
    """Mean processor time of SciPy's event loop per block, over a random sample of the blocks."""
    assert motion.dt is not None
    chosen = np.random.default_rng(0).choice(len(blocks), SCIPY_SAMPLE, replace=False)
    total = 0.0
    for index in chosen:
        block = blocks[int(index)]
        pair = tuple((side.p, side.alpha, side.restitution) for side in block.sides)
        p, alpha, e = zip(*pair, strict=True)
        problem = Problem(model, p, alpha, e, motion.breakpoints, motion.coefficients)
        start = time.process_time()
        integrate_as_practised(
            acceleration, motion.dt, problem, rtol=1e-8, atol=1e-12, max_step=0.05, rest_speed=1e-6 * p[0] * alpha[0]
        )
        total += time.process_time() - start
    return total / len(chosen)


@numba.njit
def slope(theta: float, ground: float, p: float, alpha: float, nonlinear: bool) -> float:
    """Angular acceleration."""
    side = 1.0 if theta >= 0.0 else -1.0
    if nonlinear:
        return -p * p * (math.sin(side * alpha - theta) + ground * math.cos(side * alpha - theta))
    return p * p * (theta - side * alpha - ground)


@numba.njit
def runge_kutta(
    acceleration: np.ndarray, h: float, ps: np.ndarray, alphas: np.ndarray, e: float, nonlinear: bool
) -> np.ndarray:
    """Peak rotation of every block, by a fixed-step loop with impacts on the sample grid."""
    peaks = np.zeros(len(ps))
    for k in range(len(ps)):
        p, alpha = ps[k], alphas[k]
        threshold = math.tan(alpha) if nonlinear else alpha
        theta, rate, peak, resting = 0.0, 0.0, 0.0, True
        for i in range(len(acceleration) - 1):
            a0, a1 = acceleration[i] / G, acceleration[i + 1] / G
            middle = 0.5 * (a0 + a1)
            if resting:
                if abs(a1) <= threshold:
                    continue
                resting = False
                theta = -math.copysign(1e-12, a1)
            k1 = slope(theta, a0, p, alpha, nonlinear)
            v2 = rate + 0.5 * h * k1
            k2 = slope(theta + 0.5 * h * rate, middle, p, alpha, nonlinear)
            v3 = rate + 0.5 * h * k2
            k3 = slope(theta + 0.5 * h * v2, middle, p, alpha, nonlinear)
            v4 = rate + h * k3
            k4 = slope(theta + h * v3, a1, p, alpha, nonlinear)
            new = theta + h / 6.0 * (rate + 2.0 * v2 + 2.0 * v3 + v4)
            rate += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            if new * theta < 0.0:
                rate *= e
                if abs(rate) < 1e-4 * p * alpha and abs(a1) <= threshold:
                    resting, new, rate = True, 0.0, 0.0
            theta = new
            peak = max(peak, abs(theta))
            if peak >= 0.5 * math.pi:
                break
        peaks[k] = peak
    return peaks


if __name__ == "__main__":
    main()
