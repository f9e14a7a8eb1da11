"""Branches of twice the period: against the equations of their orbits, the closed form of the flip, simulations."""

import math

import numpy as np
import pytest
from oracles import closed_orbits
from scipy.optimize import fsolve

from rocking import dynamics, pulses

G = 10.0
TABLE = 5.0  # Hz


def table(level):
    return dynamics.BouncingBall(0.5, gravity=G), pulses.sine(level * G, TABLE, cycles=1)


def followed(period, value, limits, starts):
    """Branch of the stable orbits of a ball of so many periods, followed from a value."""
    found = dynamics.periodic_orbits(*table(value), period=period, starts=starts)
    start = next(each for each in found if each.is_stable and each.impact_count == each.period == period)
    return dynamics.continue_orbit(start, table, value, limits, step=0.2)


@pytest.fixture(scope="module")
def once():
    return followed(1, 1.5, (1.5, 1.53), 8)


@pytest.fixture(scope="module")
def twice():
    return followed(2, 1.53, (1.5, 1.7), 64)


def bounces_of_a_ball(level, times, speeds):
    """Times and relative speeds of two bounces that repeat after two periods, near others in space.

    Between bounces it flies on a parabola; at each, its speed relative to the table is multiplied by -e.
    """
    w, e, period = 2.0 * math.pi * TABLE, 0.5, 2.0 / TABLE
    size = level * G / w**2

    def height(t):
        return -size * math.sin(w * t)

    def rate(t):
        return -size * w * math.cos(w * t)

    def missed(unknown):
        first, second, fast, slow = unknown
        flights = second - first, first + period - second
        return [
            height(first) + fast * flights[0] - 0.5 * G * flights[0] ** 2 - height(second),
            height(second) + slow * flights[1] - 0.5 * G * flights[1] ** 2 - height(first),
            slow - rate(second) + e * (fast - G * flights[0] - rate(second)),
            fast - rate(first) + e * (slow - G * flights[1] - rate(first)),
        ]

    found = fsolve(missed, [*times, *speeds], xtol=1e-12)
    assert np.max(np.abs(missed(found))) < 1e-13
    return found[:2], found[2:] - [rate(each) for each in found[:2]]


def test_the_doubled_orbits_of_a_ball_are_those_of_its_own_equations(once, twice):
    exact = closed_orbits.Ball(0.5, 1)
    assert (twice.period, twice.impact_count, twice.ends[0]) == (2, 2.0, "flip")
    assert twice.bifurcations[0].value == pytest.approx(exact.flip, abs=1e-10)
    assert twice.bifurcations[0].orbit.period == 1  # what is there is the orbit that both branches share
    assert twice.bifurcations[0].value == pytest.approx(once.bifurcations[0].value, abs=1e-9)
    assert np.all(np.diff(twice.values) > 0.0)  # only beyond the flip
    w = 2.0 * math.pi * TABLE
    judged = 0
    for k in range(0, len(twice), 4):
        impacts, level = twice.orbit(k).response.impacts, float(twice.values[k])
        rates = -level * G / w * np.cos(w * impacts["time"])
        times, speeds = bounces_of_a_ball(level, impacts["time"], impacts["speed_after"] + rates)
        assert times == pytest.approx(impacts["time"], abs=1e-10)
        assert speeds == pytest.approx(impacts["speed_after"], abs=1e-10)
        assert abs(speeds[1] - speeds[0]) > 1e-4
        judged += 1
    assert judged >= 4


def test_a_period_doubles_again_where_a_long_simulation_says(twice):
    flip = twice.bifurcations[1].value
    found = dynamics.bifurcation_diagram(table, [flip - 0.004, flip + 0.004], twice.states[-1], transient_periods=1500)
    assert found.data.period.values[0, :, 0].tolist() == [2, 4]
