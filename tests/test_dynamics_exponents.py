"""Lyapunov exponents against closed forms, finite differences, two orbits that part, and the contraction of areas."""

import math

import numpy as np
import pytest

from rocking import Block, dynamics, pulses

G, HERTZ = 10.0, 5.0


def shaken_ball(e, gamma):
    return dynamics.BouncingBall(e, gravity=G), pulses.sine(gamma * G, HERTZ, cycles=1)


def start_of_one_bounce(e, gamma):
    """State at the start of a period on the orbit of one bounce a period, and the sum of its multipliers.

    The ball is in flight for T: relative to the table it leaves with e times the speed s of its approach, where
    s (1 + e) = g T, and it moves as it does over a table at rest if the table moves at that moment with the velocity
    (g T/2)(1 - e)/(1 + e). Of the two phases where it does, the stable one has the table slow down.
    """
    w, A, T = 2.0 * math.pi * HERTZ, gamma * G, 1.0 / HERTZ
    moving = 0.5 * G * T * (1.0 - e) / (1.0 + e)
    phase = 2.0 * math.pi - math.acos(-w * moving / A)
    start, leaving = phase / w, e * G * T / (1.0 + e)
    t = T - start
    table = A / w * (math.cos(phase) * t - (math.sin(w * T) - math.sin(phase)) / w)
    table_velocity = A / w * (math.cos(phase) - math.cos(w * T))
    state = leaving * t - 0.5 * G * t * t - table, leaving - G * t - table_velocity
    C = math.sqrt(gamma**2 - (math.pi * (1.0 - e) / (1.0 + e)) ** 2)
    return state, 1.0 + e * e - (1.0 + e) ** 2 * C


@pytest.mark.parametrize(("e", "gamma"), [(0.5, 1.3), (0.5, 1.52), (0.8, 0.9), (0.8, 0.36), (0.8, 1.068), (0.3, 1.9)])
def test_of_a_bouncing_ball_they_are_the_logarithms_of_its_multipliers(e, gamma):
    ball, table = shaken_ball(e, gamma)
    state, total = start_of_one_bounce(e, gamma)
    found = dynamics.lyapunov_exponents(ball, table, state, 4000)
    expected = np.sort(np.log(np.abs(np.roots([1.0, -total, e * e]))))[::-1]
    assert found.impacts_per_period == 1.0
    assert (found.largest, found.smallest) == pytest.approx(tuple(expected), abs=1e-6)


@pytest.mark.parametrize(("amplitude", "model"), [(2.0, "nonlinear"), (3.5, "nonlinear"), (3.0, "linear")])
def test_of_a_block_they_are_those_of_differences_of_its_map(amplitude, model):
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    motion = pulses.sine(amplitude, 1.2, cycles=1)
    strobe = dynamics.stroboscopic_map(block, motion, model=model)
    on = strobe([0.02, 0.1], 500)
    assert strobe(on) == pytest.approx(on, abs=1e-12)  # a fixed point
    h = 1e-5
    ends = [strobe(on + k * h * step) for step in np.eye(2) for k in (1, -1)]
    change = np.column_stack([(ends[0] - ends[1]) / (2.0 * h), (ends[2] - ends[3]) / (2.0 * h)])
    expected = np.sort(np.log(np.abs(np.linalg.eigvals(change))))[::-1]
    found = dynamics.lyapunov_exponents(block, motion, on, 2000, model=model)
    assert (found.largest, found.smallest) == pytest.approx(tuple(expected), abs=1e-6)
    assert found.largest + found.smallest == pytest.approx(2.0 * found.impacts_per_period * math.log(0.9), abs=1e-6)


def test_where_every_period_holds_a_rest_they_are_minus_infinity():
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.5)
    found = dynamics.lyapunov_exponents(block, pulses.sine(2.1, 1.5, cycles=1), [0.0, 0.0], 100)
    assert found.largest == found.smallest == -math.inf and found.share_at_rest == 1.0
    assert found.outcome in (dynamics.PeriodOutcome.MOVES, dynamics.PeriodOutcome.RESTS)
    assert "comes to rest in 100 %" in found.summary()
    still = dynamics.lyapunov_exponents(block, pulses.sine(1.9, 0.5, cycles=1), [0.01, 0.0], 100)
    assert still.largest == -math.inf and still.outcome == dynamics.PeriodOutcome.RESTS_FOR_EVER


def test_a_body_that_overturns_has_none():
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    found = dynamics.lyapunov_exponents(block, pulses.sine(20.0, 0.5, cycles=1), [0.1, 0.2], 100)
    assert math.isnan(found.largest) and found.outcome == dynamics.PeriodOutcome.OVERTURNED
    assert "overturns" in found.summary() and found.to_dict()["outcome"] == "OVERTURNED"


def chaotic_cases():
    damped = dynamics.ImpactOscillator(1.0, 0.9, damping_ratio=0.01, stop=0.02)
    return {
        "ball": (*shaken_ball(0.9, 5.0), [0.1, 0.5], 0.0),
        "oscillator": (damped, pulses.sine(10.0, 2.6, cycles=1), [0.02, 0.1], 2.0 * 0.01 * 2.0 * math.pi / 2.6),
    }


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("name", chaotic_cases())
def test_in_chaos_one_is_positive_and_their_sum_is_the_contraction_of_areas(name):
    body, motion, state, drag = chaotic_cases()[name]
    found = dynamics.lyapunov_exponents(body, motion, state, 4000)
    assert found.largest > 10.0 * found.standard_error > 0.0
    contraction = 2.0 * math.log(body.restitution) * found.impacts_per_period - drag
    assert found.stretches.mean(axis=0).sum() == pytest.approx(contraction, abs=1e-9)
    # Two orbits that start 1e-9 apart, brought together again after every period, at 40 places of one orbit; in the
    # first periods they turn into the direction in which they part.
    strobe = dynamics.stroboscopic_map(body, motion)
    on, distance, logs = strobe.orbit(strobe(state, 200), 3900)[::100], 1e-9, []
    off = on + np.array([distance, 0.0])
    for number in range(110):
        on, off = np.split(strobe(np.concatenate([on, off])), 2)
        apart = np.linalg.norm(off - on, axis=1)
        on, off, apart = (each[apart > 0.0] for each in (on, off, apart))  # others have both come to rest
        logs.extend(np.log(apart / distance) if number >= 10 else ())
        off = on + (off - on) * (distance / apart)[:, None]
    assert len(logs) > 3000
    assert found.largest == pytest.approx(np.mean(logs), abs=4.0 * found.standard_error)


def test_at_a_rest_where_impacts_lose_nothing_they_are_zero_as_the_multipliers_are_one():
    block, motion = Block.from_parameters(p=2.0, alpha=0.2, restitution=1.0), pulses.sine(1.0, 1.0, cycles=1)
    (orbit,) = dynamics.periodic_orbits(block, motion, starts=[[0.0, 0.0]])
    found = dynamics.lyapunov_exponents(block, motion, [0.0, 0.0], 100)
    assert orbit.has_rest and np.log(np.abs(orbit.multipliers)).tolist() == [found.largest, found.smallest] == [
        0.0,
        0.0,
    ]
    assert found.share_at_rest == 1.0 and "rest" not in found.summary()


def test_they_are_those_of_a_map_whose_rests_are_decided_as_asked():
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    motion = pulses.sine(2.0, 1.2, cycles=1)
    free = dynamics.lyapunov_exponents(block, motion, [0.02, 0.1], 30, chattering="velocity=1e-9")
    stopped = dynamics.lyapunov_exponents(block, motion, [0.02, 0.1], 30, chattering="velocity=10")
    assert math.isfinite(free.largest) and free.share_at_rest == 0.0
    assert stopped.largest == -math.inf and stopped.share_at_rest > 0.0


def test_they_are_those_of_the_model_that_is_asked_for():
    """On stable orbits both have the same mean; in each stretch they are those of their own states."""
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    motion = pulses.sine(2.0, 1.2, cycles=1)
    usual, nonlinear, linear = (
        dynamics.lyapunov_exponents(block, motion, [0.02, 0.1], 30, **options).stretches
        for options in ({}, {"model": "nonlinear"}, {"model": "linear"})
    )
    assert np.array_equal(usual, nonlinear)
    assert np.max(np.abs(linear - nonlinear)) > 1e-3
