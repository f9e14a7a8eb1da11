"""Every way in which a branch of orbits may end, or cross another, where formulas or other computations say."""

import math

import numpy as np
import pytest
from oracles import closed_orbits
from scipy.optimize import brentq

from rocking import Block, VelocityThreshold, dynamics, pulses, simulate

G = 10.0
TABLE = 5.0  # Hz
BALL = dynamics.BouncingBall(0.5, gravity=G)
EXACT = closed_orbits.Ball(0.5, 1)


def table(level, cycles=1):
    return BALL, pulses.sine(level * G, TABLE, cycles=cycles)


def branch_of(family, value, limits, *, starts=64, **options):
    """Branch of the stable orbit with impacts that is found first."""
    found = dynamics.periodic_orbits(*family(value), starts=starts, **options)
    start = next(each for each in found if each.is_stable and not each.has_rest and each.impact_count)
    return dynamics.continue_orbit(start, family, value, limits, step=0.2)


@pytest.mark.thorough
def test_branches_that_cross_are_followed_through_and_the_crossing_is_said():
    """Where the level is a parabola whose vertex is the fold, both orbits of the ball are smooth in the parameter."""
    branch = branch_of(lambda q: table(EXACT.fold + q * q), 0.3, (-0.35, 0.35))
    (crossing,) = branch.bifurcations
    assert crossing.kind == "branch point" and abs(crossing.value) < 1e-4
    assert crossing.bracket[0] < 0.0 < crossing.bracket[1]
    assert branch.ends == ("limit of the parameter", "limit of the parameter")
    assert np.array_equal(branch.is_stable, branch.values > 0.0)  # the two change places
    judged = 0
    for value, multipliers in zip(branch.values[::5], branch.multipliers[::5], strict=True):
        expected = EXACT.trace(EXACT.fold + value**2, stable=value > 0.0)
        assert complex(multipliers.sum()) == pytest.approx(expected, abs=1e-9)
        judged += 1
    assert judged >= 4


def oscillator(stop):
    return dynamics.ImpactOscillator(0.5 / math.pi, 0.8, stop=stop)


@pytest.mark.thorough
@pytest.mark.parametrize("step", [0.3, 0.05])
def test_an_orbit_that_comes_to_touch_its_stop_once_more_ends_at_grazing(step):
    """Differences by the parameter that reach beyond the touch turned the tangent: it was taken for a branch point."""
    motion = pulses.sine(1.0, 1.1 / math.pi, cycles=1, phase=0.5 * math.pi)
    found = dynamics.periodic_orbits(oscillator(-0.4), motion, starts=64)
    (orbit,) = (each for each in found if each.impact_count == 1.0 and not each.is_stable)
    branch = dynamics.continue_orbit(orbit, lambda stop: (oscillator(stop), motion), -0.4, (-0.5, 4.5), step=step)
    assert branch.ends == ("limit of the parameter", "grazing")
    (end,) = branch.bifurcations
    response = end.orbit.response
    (at,) = response.impacts["time"]
    times = np.linspace(at + 0.05, response.duration + at - 0.05, 20_001) % response.duration
    assert np.min(response.position(times) - end.orbit.body.stops[0]) == pytest.approx(0.0, abs=1e-6)
    assert np.max(np.abs(end.orbit.multipliers)) > 2.0  # none is near 1


@pytest.mark.thorough
def test_a_flip_is_a_branch_point_where_the_motion_is_given_twice():
    """Orbits of twice the sine's period have that of the motion: they cross the branch that goes on.

    There the equations of an orbit are singular, and known to the root of a rounding error.
    """
    branch = branch_of(lambda level: table(level, cycles=2), 1.5, (1.48, 1.58))
    (crossing,) = branch.bifurcations
    assert crossing.kind == "branch point" and crossing.value == pytest.approx(EXACT.flip, abs=4e-9)
    assert np.array_equal(branch.is_stable, branch.values < EXACT.flip)


@pytest.mark.thorough
def test_where_an_impact_vanishes_is_extrapolated_from_orbits_that_have_it():
    """An orbit without impacts passes near: x = a sin(w t)/(p^2 + w^2), which touches the walls at gap (p^2 + w^2)."""
    pendulum = dynamics.InvertedPendulum(3.0, 0.1, 0.6)

    def family(amplitude):
        return pendulum, pulses.sine(amplitude, 1.0, cycles=1)

    found = dynamics.periodic_orbits(*family(3.0), starts=[[0.02149176, 0.43097785]])
    (orbit,) = (each for each in found if each.impact_count == 1.0)
    branch = dynamics.continue_orbit(orbit, family, 3.0, (2.9, 5.0))
    assert branch.ends == ("limit of the parameter", "grazing")
    (end,) = branch.bifurcations
    exact = 0.1 * (9.0 + 4.0 * math.pi**2)
    assert end.value == pytest.approx(exact, abs=1e-8)
    assert end.bracket[0] - 1e-8 < exact < end.bracket[1] + 1e-8


@pytest.mark.thorough
def test_a_branch_reaches_limits_beyond_which_there_is_no_body():
    """A ball that loses nothing is the last one; below the fold, in closed form, there is no orbit."""
    level = 1.2

    def family(restitution):
        return dynamics.BouncingBall(restitution, gravity=G), pulses.sine(level * G, TABLE, cycles=1)

    found = dynamics.periodic_orbits(*family(0.5), starts=200)
    start = next(each for each in found if each.is_stable and each.impact_count == 1.0)
    branch = dynamics.continue_orbit(start, family, 0.5, (0.45, 1.0), step=0.2)
    assert branch.ends == ("limit of the parameter", "limit of the parameter")
    assert (branch.values[0], branch.values[-1]) == (0.45, 1.0)
    (flip,) = branch.bifurcations
    expected = brentq(lambda e: closed_orbits.Ball(e, 1).flip - level, 0.45, 0.99)
    assert flip.kind == "flip" and flip.value == pytest.approx(expected, abs=1e-9)
    for k in (0, -1):
        ball = closed_orbits.Ball(float(branch.values[k]), 1)
        assert branch.multipliers[k].sum().real == pytest.approx(ball.trace(level, stable=True), abs=1e-9)


def test_a_symmetric_orbit_with_a_large_multiplier_is_followed_to_grazing():
    """Its multiplier is 131 over a period, and the square root of that over half of one."""

    def family(level):
        return dynamics.InvertedPendulum(1.0, 1.0, 0.8), pulses.sine(level, 0.35, cycles=1)

    (start,) = (
        each
        for each in dynamics.periodic_orbits(*family(3.0), starts=256)
        if each.is_symmetric and each.impact_count == 2.0 and not each.is_stable
    )
    branch = dynamics.continue_orbit(start, family, 3.0, (1.5, 6.0))
    assert branch.ends == ("limit of the parameter", "grazing") and len(branch) < 100
    (grazing,) = branch.bifurcations
    assert grazing.value == pytest.approx(5.836106, abs=1e-6)


def test_no_more_points_than_asked_for():
    start = next(each for each in dynamics.periodic_orbits(*table(1.2), starts=64) if each.is_stable)
    branch = dynamics.continue_orbit(start, table, 1.2, (1.0, 1.6), max_points=4)
    assert len(branch) == 7 and branch.ends == ("too many points", "too many points")


@pytest.mark.slow
def test_rest_starts_where_a_threshold_on_the_speed_is_reached():
    """A ball that bounces once a period leaves with the speed e g T/(1 + e), however hard the table shakes."""
    limit = 0.5

    def family(frequency):
        return BALL, pulses.sine(1.2 * G, frequency, cycles=1)

    branch = branch_of(family, 5.0, (4.5, 8.0), chattering=VelocityThreshold(limit))
    assert branch.ends == ("limit of the parameter", "start of rest")
    assert branch.bifurcations[-1].value == pytest.approx(0.5 * G / (1.5 * limit), abs=1e-9)
    # Resolved by proof, the same orbits go on.
    certified = branch_of(family, 5.0, (4.5, 8.0))
    assert certified.ends == ("limit of the parameter", "limit of the parameter")
    assert certified.values.max() == 8.0


def test_a_ball_that_keeps_no_speed_rests_up_to_a_level_in_closed_form():
    """It hits once a period where cos(phase) is pi over the level, and stays if the table presses there."""
    dull = dynamics.BouncingBall(0.0, gravity=G)

    def family(level):
        return dull, pulses.sine(level * G, TABLE, cycles=1)

    (rests,) = dynamics.periodic_orbits(*family(3.29), starts=16)
    branch = dynamics.continue_orbit(rests, family, 3.29, (3.29, 3.4), step=0.2)
    assert branch.bifurcations[-1].value == pytest.approx(math.hypot(1.0, math.pi), abs=1e-9)
    # Beyond, it leaves at once, and a multiplier is not zero: that of any restitution, with none.
    (leaves,) = dynamics.periodic_orbits(*family(3.5), starts=16)
    assert not leaves.has_rest and leaves.impact_count == 1.0
    trace = closed_orbits.Ball(0.0, 1).trace(3.5, stable=True)
    assert leaves.multipliers.tolist() == pytest.approx([trace, 0.0], abs=1e-9)


def peak_of(exact, speed):
    """Greatest rotation of a linear block with this speed after impacts, from its arc in closed form."""
    p, alpha, e, w = exact.p, exact.alpha, exact.restitution, 2.0 * math.pi * exact.shaking
    at, rate = exact.forced(speed)
    h = 0.5 * exact.m / exact.shaking
    times = np.linspace(0.0, h, 20001)
    forced = at * np.cos(w * times) + rate * np.sin(w * times)
    course = alpha - (alpha + at) * np.cosh(p * times) + (speed - w * rate) / p * np.sinh(p * times) + forced
    assert abs(course[-1]) < 1e-9 * course.max() and e > 0.0
    k = int(np.argmax(course))
    return float(np.polyval(fit := np.polyfit(times[k - 2 : k + 3] - times[k], course[k - 2 : k + 3], 2), 0.0)) - float(
        fit[1] ** 2 / (4.0 * fit[0])
    )


@pytest.mark.slow
def test_a_branch_ends_where_its_orbits_overturn():
    """An orbit of the linear model goes beyond the balance, and ends where its peak is a right angle."""
    block = Block.from_parameters(p=2.0, alpha=0.6, restitution=0.55)
    exact = closed_orbits.Block(2.0, 0.6, 0.55, 0.8, block.gravity)

    def family(amplitude):
        return block, pulses.sine(amplitude, 0.8, cycles=1)

    branch = branch_of(family, 16.0, (15.9, 160.0), model="linear")
    assert branch.ends[1] == "overturning" and branch.bifurcations[-1].kind == "overturning"
    speed = brentq(lambda speed: peak_of(exact, speed) - 0.5 * math.pi, 0.3, 30.0)
    assert branch.bifurcations[-1].value == pytest.approx(exact.amplitude(speed), rel=1e-8)
    assert branch.peaks[-1] == pytest.approx(0.5 * math.pi, rel=1e-9)
    # From the last state the block rocks on, and from one a little nearer or further out it falls, to either side.
    state, falls = branch.states[-1], []
    for factor in (1.0 - 1e-6, 1.0, 1.0 + 1e-6):
        response = simulate(
            block, pulses.sine(float(branch.values[-1]), 0.8, cycles=1), model="linear", duration=1.25,
            initial_rotation=factor * float(state[0]), initial_velocity=factor * float(state[1]),
        )  # fmt: skip
        falls.append(int(response.events["side"][-1]) if response.overturned else 0)
    assert falls == [-1, 0, 1]


@pytest.mark.slow
def test_a_branch_that_comes_back_is_followed_round_once():
    """Where the level has a maximum, the two orbits meet at a fold on either side of it."""
    branch = branch_of(lambda q: table(EXACT.fold + 0.09 - q * q), 0.1, (-0.6, 0.6))
    assert branch.ends == ("where it began", "where it began")
    assert sorted(each.value for each in branch.bifurcations) == pytest.approx([-0.3, 0.3], abs=1e-10)
    assert {each.kind for each in branch.bifurcations} == {"fold"}
    signs = np.sign(np.diff(branch.values))
    assert np.sum(signs[1:] != signs[:-1]) in (2, 3)
    assert np.abs(branch.values).max() == pytest.approx(0.3, abs=0.01) and np.any(branch.is_stable)
