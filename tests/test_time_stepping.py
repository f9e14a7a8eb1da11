"""Time stepping of the benchmark of schemes as by Siconos, and a ball as by Siconos."""

import math
import runpy
from pathlib import Path

import numpy as np

from rocking import dynamics
from rocking.dynamics import BouncingBall

SICONOS = Path(__file__).parent / "data" / "siconos"
BENCH = runpy.run_path(str(Path(__file__).parents[1] / "benchmarks/bench_schemes.py"))


def siconos(example):
    """Time, position and velocity, a row for each step."""
    return np.loadtxt(SICONOS / f"BouncingBall{example}.ref.gz", unpack=True)


def test_moreau_jean_is_what_siconos_computes():
    times, position, velocity = siconos("TS")
    ball = BouncingBall(0.9, gravity=9.81)
    found = BENCH["integrate"](ball, None, "moreau-jean", 0.005, 10.0, position=1.0)
    assert len(times) == 2001
    np.testing.assert_allclose(found.times, times, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found.position, position, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(found.velocity, velocity, rtol=0.0, atol=1e-12)
    assert np.sum(found.impulse > 0.0) == 345


def test_the_exact_response_is_what_siconos_computes_event_by_event():
    # Siconos' times of impact are sums of what is located with errors of some 1e-13 s, which add up to 4.7e-12 s; the
    # velocities at later steps are off by g times that.
    times, position, velocity = siconos("ED")
    assert len(times) == 1788
    ball = BouncingBall(0.9, gravity=9.81)
    found = dynamics.simulate(ball, None, initial_position=1.0, duration=8.5, chattering="velocity=1e-6")
    after = np.flatnonzero(np.diff(times) == 0.0) + 1
    assert len(after) == len(found.impacts) == 44
    np.testing.assert_allclose(times[after], found.impacts["time"], rtol=0.0, atol=5e-12)
    np.testing.assert_allclose(velocity[after], found.impacts["speed_after"], rtol=0.0, atol=2.5e-12)
    first, e = math.sqrt(2.0 / 9.81), 0.9
    closed = first * (1.0 + 2.0 * e * (1.0 - e ** np.arange(44)) / (1.0 - e))
    np.testing.assert_allclose(found.impacts["time"], closed, rtol=0.0, atol=2e-14)
    between = np.setdiff1d(np.arange(times.size), [*after, *(after - 1)])
    assert between.size == 1700
    np.testing.assert_allclose(found.position(times[between]), position[between], rtol=0.0, atol=2.5e-13)
    np.testing.assert_allclose(found.velocity(times[between]), velocity[between], rtol=0.0, atol=5e-11)
