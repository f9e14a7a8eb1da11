"""One response beside SciPy's.

Usage: python benchmarks/bench_simulate.py

The baseline (tests/oracles/scipy_events.py) is DOP853 restarted at each impact, at the loosest of a row
of tolerances whose peak rotation, and that of the next tighter one, lies within 1e-6 of the response's.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import rocking
from rocking.core.constants import Model

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from oracles.problem import Problem  # noqa: E402
from oracles.scipy_events import integrate_as_practised  # noqa: E402

EL_CENTRO = ROOT.parent / "shared" / "records" / "test_only" / "RSN6_IMPVALL.I_I-ELC180-hor1.AT2"
SHIPPED = "el-centro-meloland-270"
SAME_PEAK = 1e-6
BLOCKS: dict[Model, dict[str, float]] = {
    "linear": {"p": 1.2, "alpha": 0.22, "restitution": 0.88},
    "nonlinear": {"p": 2.0, "alpha": 0.15, "restitution": 0.92},
}


def main() -> None:
    motion = rocking.read(EL_CENTRO) if EL_CENTRO.exists() else rocking.records.load(SHIPPED)
    samples = motion.acceleration(motion.breakpoints)
    print(f"{motion.name}: {len(samples)} samples, {motion.duration:.1f} s")
    print("model      impacts   response     SciPy   rtol peak error   ratio")
    for model, parameters in BLOCKS.items():
        print(compare(motion, samples, model, parameters))


def compare(motion: rocking.Motion, samples: np.ndarray, model: Model, parameters: dict[str, float]) -> str:
    """One row of the table."""
    block = rocking.Block.from_parameters(**parameters)
    response = rocking.simulate(block, motion, model=model)
    own = shortest(lambda: rocking.simulate(block, motion, model=model), 200)
    p, alpha, restitution = (parameters[k] for k in ("p", "alpha", "restitution"))
    problem = Problem(
        model, (p, p), (alpha, alpha), (restitution, restitution), motion.breakpoints, motion.coefficients
    )
    rtol, error = loosest_tolerance(samples, problem, response.peak_rotation)
    scipy = shortest(lambda: baseline(samples, problem, rtol), 3)
    return (
        f"{model:10s} {len(response.impacts):7d} {1e3 * own:7.3f} ms {1e3 * scipy:6.0f} ms {rtol:6.0e} "
        f"{error:10.1e} {scipy / own:7.0f}"
    )


def baseline(samples: np.ndarray, problem: Problem, rtol: float) -> float:
    dt = float(problem.breakpoints[1])
    return integrate_as_practised(samples, dt, problem, rtol=rtol, atol=1e-3 * rtol, max_step=2.0 * dt, rest_speed=1e-5)


def loosest_tolerance(samples: np.ndarray, problem: Problem, peak: float) -> tuple[float, float]:
    """Loosest relative tolerance that gives the same peak, not by luck, and its relative error."""
    tolerances = [10.0**-k for k in range(6, 14)]
    errors = [abs(baseline(samples, problem, rtol) / peak - 1.0) for rtol in tolerances]
    for rtol, error, tighter in zip(tolerances, errors, errors[1:], strict=False):
        if max(error, tighter) <= SAME_PEAK:
            return rtol, error
    raise SystemExit(f"SciPy's peak stays off by {min(errors):.1e}, more than {SAME_PEAK:.0e}")


def shortest(action: Callable[[], object], repeats: int) -> float:
    """Shortest of several timings, s."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return min(times)


if __name__ == "__main__":
    main()
