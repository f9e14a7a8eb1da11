"""Branches that leave others at flips and where symmetry breaks: against their equations, many digits, simulations."""

import dataclasses
import math

import mpmath as mp
import numpy as np
import pytest
from oracles import closed_orbits, exact_arcs
from scipy.optimize import fsolve

from rocking import Block, InvalidOption, dynamics, pulses

G = 10.0
TABLE = 5.0  # Hz
BLOCK = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.8)


def table(level):
    return dynamics.BouncingBall(0.5, gravity=G), pulses.sine(level * G, TABLE, cycles=1)


def shaken(amplitude):
    return dynamics.ImpactOscillator(1.0, 0.8, damping_ratio=0.05, stop=0.02), pulses.sine(amplitude, 2.6, cycles=1)


def rocked(amplitude):
    return BLOCK, pulses.sine(amplitude, 1.2, cycles=1)


def branch_from(family, value, limits, *, period=1, starts=64, **options):
    """Branch of stable orbits with impacts; of a block of symmetric ones."""
    found = dynamics.periodic_orbits(*family(value), period=period, starts=starts, **options)
    stable = [each for each in found if each.is_stable and 0 < each.impacts < math.inf and each.period == period]
    start = next(each for each in stable if each.symmetric or family is not rocked)
    return dynamics.continue_orbit(start, family, value, limits, step=0.2)


def number_of(branch, kind):
    return next(k for k, each in enumerate(branch.bifurcations) if each.kind == kind)


@pytest.fixture(scope="module")
def once():
    return branch_from(table, 1.5, (1.5, 1.53), starts=8)


@pytest.fixture(scope="module")
def twice(once):
    return dynamics.switch_branch(once, number_of(once, "flip"), (1.5, 1.7), step=0.2)


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
    assert (twice.period, twice.impacts, twice.ends[0]) == (2, 2.0, "flip")
    assert twice.bifurcations[0].value == pytest.approx(exact.flip, abs=1e-10)
    assert twice.bifurcations[0].orbit.period == 1  # what is there is the orbit that both branches share
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


def test_orbits_leave_a_flip_as_the_square_root_of_the_distance(once, twice):
    flip = once.bifurcations[number_of(once, "flip")].value
    beyond = twice.values - flip
    parted = np.array([np.ptp(twice.orbit(k).states[:, 1]) for k in np.flatnonzero(beyond < 0.02)])
    ratio = parted**2 / beyond[beyond < 0.02]
    # The square is a multiple of the distance, and what is of the next order.
    slope, limit = np.polyfit(beyond[beyond < 0.02], ratio, 1)
    assert len(ratio) >= 4 and np.max(np.abs(ratio / (limit + slope * beyond[beyond < 0.02]) - 1.0)) < 1e-3
    assert abs(slope) * 0.02 < 0.2 * limit


def test_a_period_doubles_again_where_a_long_simulation_says(twice):
    flip = twice.bifurcations[1].value
    found = dynamics.bifurcation_diagram(table, [flip - 0.004, flip + 0.004], twice.states[-1], transient=1500)
    assert found.period.values[0, :, 0].tolist() == [2, 4]


@pytest.mark.thorough
def test_where_a_period_doubles_again_another_branch_leaves(twice):
    again = dynamics.switch_branch(twice, 1, (1.66, 1.68), step=0.5)
    flip = twice.bifurcations[1].value
    assert (again.period, again.impacts) == (4, 4.0)
    assert again.bifurcations[0].value == pytest.approx(flip, abs=1e-9)
    value = flip + 0.004
    orbit = again.orbit(int(np.argmin(np.abs(again.values - value))))
    assert orbit.period == 4 and orbit.is_stable


@pytest.fixture(scope="module")
def oscillating():
    exact = closed_orbits.Oscillator(1.0, 0.8, 0.05, 0.02, 2.6)
    value = exact.amplitude(exact.flip)
    branch = branch_from(shaken, 1.03 * value, (0.94 * value, 1.04 * value))
    return exact, dynamics.switch_branch(branch, number_of(branch, "flip"))


@pytest.mark.thorough
def test_the_doubled_orbit_of_an_oscillator_comes_back_in_exact_arithmetic(oscillating):
    exact, doubled = oscillating
    assert doubled.period == 2 and doubled.values.max() <= exact.amplitude(exact.flip)  # below the flip
    assert doubled.bifurcations[0].value == pytest.approx(exact.amplitude(exact.flip), abs=1e-10)
    k = len(doubled) // 2
    body, _ = shaken(1.0)
    sine, law = exact_arcs.Sine(float(doubled.values[k]), 2.6), (body.law, body.restitution)
    with mp.workdps(25):
        halfway, bounces = exact_arcs.followed(law, sine, doubled.states[k], 1)
        end, more = exact_arcs.followed(law, sine, halfway, 1)
    assert [float(each) for each in end] == pytest.approx(doubled.states[k], abs=1e-12)
    assert np.max(np.abs(np.array(halfway, dtype=float) - doubled.states[k])) > 1e-4
    assert bounces + more == doubled.impacts


@pytest.mark.thorough
def test_a_simulation_settles_on_the_doubled_orbit_of_an_oscillator(oscillating):
    _, doubled = oscillating
    k = int(np.argmin(np.abs(doubled.multipliers[:, 0])))  # it attracts the fastest
    orbit = doubled.orbit(k)
    cycles = 2 * math.ceil(math.log(1e-9) / math.log(abs(orbit.multipliers[0])))
    motion = pulses.sine(float(doubled.values[k]), 2.6, cycles=cycles + 2)
    response = dynamics.simulate(
        orbit.body, motion, initial_position=orbit.state[0] * 1.01, initial_velocity=orbit.state[1] * 1.01
    )
    times = np.arange(cycles - 1, cycles + 1) / 2.6
    states = np.stack([response.position(times), response.velocity(times)], axis=-1)
    gaps = [np.max(np.abs(np.roll(orbit.states, shift, axis=0) - states)) for shift in (0, 1)]
    assert min(gaps) < 1e-9 < 1e-4 < max(gaps)


@pytest.mark.slow
def test_where_symmetry_breaks_two_orbits_leave_that_are_mirror_images():
    exact = closed_orbits.Block(2.0, 0.2, 0.8, 1.2, BLOCK.gravity, 3)
    breaking = exact.amplitude(exact.breaking)
    symmetric = branch_from(rocked, 3.05, (3.04, 3.11), period=3, starts=256, model="linear")
    branch = dynamics.switch_branch(symmetric, number_of(symmetric, "symmetry breaking"), (3.09, 3.15), step=0.3)
    assert branch.ends == ("symmetry breaking", "limit of the parameter")
    assert branch.limits == (3.09, 3.15) and branch.values.max() == pytest.approx(3.15)
    assert branch.bifurcations[0].value == pytest.approx(breaking, abs=1e-9)
    orbit = branch.orbit(len(branch) - 1)
    assert orbit.period == 3 and orbit.is_stable and not orbit.symmetric
    law, sine = (2.0, 0.2, 0.8), exact_arcs.Sine(float(branch.values.max()), 1.2)
    middle = orbit.response.states(0.5 * orbit.duration)[:2]
    for state in (orbit.state, -middle):  # the orbit, and its mirror image half a period later
        end, impacts = exact_arcs.followed(law, sine, state, 3, BLOCK.gravity)
        assert [float(each) for each in end] == pytest.approx(state, abs=1e-10)
        assert impacts == orbit.impacts
    assert np.max(np.abs(orbit.state + middle)) > 1e-3  # they are two


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((2,), "from 0 to 1"),
        ((-1,), "number"),
        ((0,), "0 is a fold"),
        ((1, (1.0, 1.2)), "no orbit of another branch"),
        ((1, (2.0, 1.2)), "lower, higher"),
    ],
)
def test_a_branch_that_does_not_begin_there_is_refused(once, arguments, words):
    (flip,) = once.bifurcations
    branch = dataclasses.replace(once, bifurcations=(flip._replace(kind="fold"), flip))
    with pytest.raises(InvalidOption, match=words) as caught:
        dynamics.switch_branch(branch, *arguments)
    assert "\n" not in str(caught.value)


def test_a_branch_without_a_bifurcation_has_none_to_switch_at(once):
    with pytest.raises(InvalidOption, match="no bifurcation"):
        dynamics.switch_branch(dataclasses.replace(once, bifurcations=()), 0)
