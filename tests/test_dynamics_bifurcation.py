"""Bifurcation diagrams against closed forms of the ball's and the linear block's orbits, and against their own maps."""

import math

import numpy as np
import pytest
from test_dynamics_exponents import start_of_one_bounce

from rocking import Block, dynamics, pulses
from rocking.dynamics import bifurcation


def ball_case(e):
    ball, one_g = dynamics.BouncingBall(e, gravity=10.0), pulses.sine(10.0, 5.0, cycles=1)
    return lambda ratio: (ball, one_g.scaled(ratio))


def first_doubling(e, n=1):
    """A w^2/g at which the orbit of one bounce in n periods loses its stability (Luck and Mehta 1993)."""
    return math.hypot(n * math.pi * (1.0 - e) / (1.0 + e), 2.0 * (1.0 + e * e) / (1.0 + e) ** 2)


@pytest.mark.parametrize(("e", "about"), [(0.5, 1.5268), (0.8, 1.0708)])
def test_the_period_of_a_ball_doubles_where_its_closed_form_says(e, about):
    at = first_doubling(e)
    assert at == pytest.approx(about, abs=5e-5)
    values = at + np.array([-0.02, -0.002, 0.002, 0.004])
    found = dynamics.bifurcation_diagram(
        ball_case(e), values, start_of_one_bounce(e, values[0])[0], transient_periods=6000, recorded_periods=16
    )
    assert found.data.period.values[0, :, 0].tolist() == [1, 1, 2, 2]
    assert found.data.impact_count.values[0, :, 0].tolist() == [1, 1, 2, 2]
    assert found.changes() == [(values[1], values[2], 1, 2)]
    # The two states part as the square root of the distance from the bifurcation.
    parted = np.ptp(found.data.velocity.values[0, :, 0], axis=-1)
    assert parted[3] / parted[2] == pytest.approx(math.sqrt(2.0), rel=0.02)


def test_an_orbit_that_is_still_settling_has_no_period():
    """Near the doubling it comes nearer from both sides in turn, and every second state is almost the same."""
    at = first_doubling(0.5)
    found = dynamics.bifurcation_diagram(
        ball_case(0.5), at - np.array([0.002, 0.0008]), start_of_one_bounce(0.5, at - 0.1)[0], transient_periods=1500
    )
    states = found.data.velocity.values[0, 1, 0]
    assert abs(states[-1] - states[-3]) < 1e-6 * abs(states[-1]) < abs(states[-1] - states[-2])
    assert found.data.period.values[0, 1, 0] == 0


def test_going_up_and_down_keep_what_they_are_on():
    """Under a weak motion a ball that rests goes on resting, and one that bounces goes on bouncing."""
    values = np.linspace(0.5, 0.98, 13)
    for direction, first in (("up", values[0]), ("down", values[-1])):
        starts = [[0.0, 0.0], start_of_one_bounce(0.8, first)[0]]
        found = dynamics.bifurcation_diagram(ball_case(0.8), values, starts, direction=direction)
        assert np.all(found.data.coordinate.values[0, :, 0] == 0.0) and np.all(
            found.data.impact_count.values[0, :, 0] == 0
        )
        assert np.all(found.data.impact_count.values[0, :, 1] == 1)
        expected = np.array([start_of_one_bounce(0.8, value)[0] for value in values])
        assert found.data.coordinate.values[0, :, 1, -1] == pytest.approx(expected[:, 0], abs=1e-9)
        assert found.data.velocity.values[0, :, 1, -1] == pytest.approx(expected[:, 1], abs=1e-8)


def test_kept_states_are_those_of_the_map_after_its_transient():
    values = [1.2, 1.7, 2.5]
    afresh = dynamics.bifurcation_diagram(
        ball_case(0.5), values, [0.1, 0.5], direction="afresh", transient_periods=30, recorded_periods=7
    )
    up = dynamics.bifurcation_diagram(ball_case(0.5), values, [0.1, 0.5], transient_periods=30, recorded_periods=7)
    state = np.array([0.1, 0.5])
    for k, value in enumerate(values):
        strobe = dynamics.stroboscopic_map(*ball_case(0.5)(value))
        kept = strobe.orbit(strobe([0.1, 0.5], 30), 7)[1:]
        assert np.array_equal(np.stack([afresh.data.coordinate[0, k, 0], afresh.data.velocity[0, k, 0]], axis=-1), kept)
        going = strobe.orbit(strobe(state, 30), 7)[1:]
        assert np.array_equal(np.stack([up.data.coordinate[0, k, 0], up.data.velocity[0, k, 0]], axis=-1), going)
        state = going[-1]


def test_a_block_that_overturns_leaves_a_gap_and_starts_again():
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    found = dynamics.bifurcation_diagram(
        lambda a: (block, pulses.sine(a, 0.8, cycles=1)), [1.0, 9.0, 30.0], [0.0, 0.0], direction="down"
    )
    assert found.data.period.values[0, :, 0].tolist() == [1, -1, -1]
    assert np.isnan(found.data.coordinate.values[0, 1:]).all() and "overturned" in found.summary()
    assert found.changes() == [(9.0, 1.0, -1, 1)]


def test_a_velocity_that_is_zero_but_for_rounding_has_no_period_of_its_own():
    """In resonance the velocity of an oscillator that misses its stop is zero where the support's acceleration is."""
    oscillator = dynamics.ImpactOscillator(1.0, 0.8, damping_ratio=0.2, stop=0.5)
    found = dynamics.bifurcation_diagram(
        lambda frequency: (oscillator, pulses.sine(1.0, frequency, cycles=1)),
        [0.8, 0.9, 1.0, 1.1, 1.2], [0.0, 0.1], transient_periods=800,
    )  # fmt: skip
    assert np.abs(found.data.velocity.values[0, 2]).max() < 1e-14
    assert found.data.period.values[0, :, 0].tolist() == [1] * 5


def test_a_small_orbit_has_its_period():
    states = 1e-5 * np.array([[1.0, 2.0], [1.0, 2.0 + 1e-5]] * 8)
    assert bifurcation.find_period(states, (1.0, 1.0)) == bifurcation.find_period(states) == 2


@pytest.mark.parametrize("chattering", ["certified", "velocity=0.001"])
@pytest.mark.parametrize("restitution", [0.5, 0.0])
def test_impacts_are_those_of_the_orbit_infinite_where_chattering_is_complete(restitution, chattering):
    ball, levels = dynamics.BouncingBall(restitution, gravity=10.0), [5.0, 12.0]

    def case(level):
        return ball, pulses.sine(level, 5.0, cycles=1)

    found = dynamics.bifurcation_diagram(case, levels, [0.0, 0.0], chattering=chattering)
    orbits = [dynamics.periodic_orbits(*case(level), starts=[[0.0, 0.0]], chattering=chattering)[0] for level in levels]
    impacts = found.data.impact_count.values[0, :, 0].tolist()
    assert impacts == [each.impact_count for each in orbits] and impacts[0] == 0.0 < impacts[1]
    assert math.isinf(impacts[1]) == (restitution > 0.0 and chattering == "certified")


@pytest.mark.parametrize("transient", [0, 1])
def test_what_takes_too_many_steps_is_not_said_to_overturn(transient):
    lively, start = dynamics.BouncingBall(1.0, gravity=10.0), [0.0, 1e-5]
    found = dynamics.bifurcation_diagram(
        lambda level: (lively, pulses.sine(level, 0.5, cycles=1)),
        [0.1],
        start,
        transient_periods=transient,
        recorded_periods=2,
    )
    _, fate, _ = dynamics.stroboscopic_map(lively, pulses.sine(0.1, 0.5, cycles=1)).advance(start)
    assert fate == dynamics.PeriodOutcome.UNFINISHED and np.isnan(found.data.coordinate.values).all()
    assert found.data.period.values.tolist() == [[[-2]]]
    assert found.summary().endswith("up: not followed throughout") and "overturned" not in found.summary()
    (figure_legend,) = found.plot().legends
    assert "not followed" in [text.get_text() for text in figure_legend.get_texts()]


def test_a_stop_that_moves_takes_the_body_with_it():
    found = dynamics.bifurcation_diagram(
        lambda stop: (dynamics.ImpactOscillator(1.0, 0.7, stop=stop), pulses.sine(1.0, 0.7, cycles=1)),
        [-0.3, -0.2, 0.0], [0.4, 0.0], direction="down", transient_periods=50,
    )  # fmt: skip
    assert np.all(found.data.coordinate.values[0, :, 0].min(axis=-1) >= np.array([0.3, 0.2, 0.0]))
