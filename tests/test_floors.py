"""Motions of floors against an integration by DOP853, and against what oscillators are known to do."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import rocking
from rocking import Motion
from rocking.errors import MotionError

SAMPLES = np.random.default_rng(5).normal(size=40)
GROUNDS = {
    "record": Motion.from_samples(SAMPLES, 0.02),
    "jumps": Motion([0.0, 0.3, 0.8], [[2.0, -1.0], [-1.0, 4.0]]),
    "pulse": rocking.pulses.ricker(2.0, 1.5),
}


def integrated(ground, period, damping, times):
    """Absolute acceleration by DOP853, restarted at every breakpoint."""
    w, state, found = 2.0 * math.pi / period, np.zeros(2), np.full(len(times), np.nan)
    corners = np.unique(np.append(ground.breakpoints, times[-1]))
    for start, end in itertools.pairwise(corners):
        piece = min(np.searchsorted(ground.breakpoints, start, side="right") - 1, len(ground.coefficients))
        moves = start < ground.duration
        given = np.polynomial.Polynomial(ground.coefficients[piece]) if moves else np.polynomial.Polynomial([0.0])

        def rates(t, y, given=given, start=start):
            return [y[1], -given(t - start) - 2.0 * damping * w * y[1] - w * w * y[0]]

        solved = solve_ivp(rates, (start, end), state, "DOP853", rtol=1e-12, atol=1e-14, dense_output=True)
        here = (times >= start) & (times <= end)
        u, v = solved.sol(times[here])
        found[here], state = -(2.0 * damping * w * v + w * w * u), solved.y[:, -1]
    return found


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("damping", [0.0, 0.05, 0.6])
@pytest.mark.parametrize("name", GROUNDS)
def test_a_floor_moves_as_an_integration_of_the_oscillator_does(name, damping):
    ground = GROUNDS[name]
    for period in (0.11, 0.7, 3.0):
        floor = ground.on_floor(period, damping, free_vibration=0.5)
        assert floor.duration == pytest.approx(ground.duration + 0.5)
        times = np.linspace(0.0, floor.duration, 301)[1:-1]
        found = integrated(ground, period, damping, times)
        np.testing.assert_allclose(floor.acceleration(times), found, rtol=0.0, atol=1e-9 * np.max(np.abs(found)))


def test_without_damping_the_peak_of_a_floor_is_the_spectral_acceleration():
    for ground in GROUNDS.values():
        for period in (0.2, 1.0, 2.5):
            floor = ground.on_floor(period, 0.0, free_vibration=period)
            assert floor.pga == pytest.approx(ground.spectral_acceleration(period, 0.0), rel=1e-9)


def test_a_stiff_floor_moves_as_the_ground_and_one_that_rings_fades_to_a_thousandth():
    ground = rocking.pulses.ricker(2.0, 1.0)
    stiff = ground.on_floor(5e-3, 0.5)
    times = np.linspace(0.0, ground.duration, 200)
    np.testing.assert_allclose(stiff.acceleration(times), ground.acceleration(times), atol=0.03)
    floor = ground.on_floor(0.5)
    late = np.linspace(floor.duration - 0.5, floor.duration, 200)[:-1]
    at_end = np.linspace(ground.duration, ground.duration + 0.5, 200)
    assert np.max(np.abs(floor.acceleration(late))) < 2e-3 * np.max(np.abs(floor.acceleration(at_end)))
    assert ground.with_vertical(GROUNDS["jumps"]).on_floor(0.5).vertical is GROUNDS["jumps"]
    pair = ground.with_orthogonal(GROUNDS["jumps"]).on_floor(0.5, 0.02)
    assert np.array_equal(pair.orthogonal.coefficients, GROUNDS["jumps"].on_floor(0.5, 0.02).coefficients)
    assert np.array_equal(pair.coefficients, ground.on_floor(0.5, 0.02).coefficients)
    assert floor.history[-1] == "on a floor of period 0.5 s, damping 0.05"
    assert floor.error < 1e-9 * floor.pga


def test_a_wall_on_a_floor_that_resonates_falls_under_what_it_stands_on_the_ground():
    ground = rocking.pulses.sine(1.0, 1.5, cycles=6)
    wall = rocking.Block.one_sided(width=0.3, height=3.0)
    assert not rocking.simulate(wall, ground).overturned
    assert rocking.simulate(wall, ground.on_floor(1.0 / 1.5)).overturned


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ((0.0,), "period must be a positive number"),
        ((1e-6,), "too short for a floor motion of"),
        ((1.0, 1.0), "damping must be a fraction of critical"),
        ((1.0, 0.0), "without damping does not decay; give free_vibration"),
    ],
)
def test_what_no_floor_can_be_is_refused_in_one_sentence(given, says):
    with pytest.raises(MotionError, match=says) as refused:
        GROUNDS["record"].on_floor(*given)
    assert "\n" not in str(refused.value)
    with pytest.raises(MotionError, match="free_vibration must be a number from 0 to"):
        GROUNDS["record"].on_floor(1.0, free_vibration=-1.0)


@pytest.mark.parametrize("given", [{"damping": 1e-7}, {"damping": 0.05, "free_vibration": 3e6}])
def test_a_floor_that_would_move_for_days_is_refused_at_once(given):
    with pytest.raises(
        MotionError, match=r"period = 1 s is too short .* use a longer one, or a shorter free_vibration"
    ):
        rocking.pulses.sine(1.0, 2.0, cycles=2).on_floor(1.0, **given)


@pytest.mark.parametrize("damping", [0.0, 0.02, 0.2])
def test_a_floor_is_as_uncertain_as_all_that_its_motion_may_differ_by(damping):
    ground = rocking.Motion.from_samples([0.0, 1.0, -1.0, 0.5, 0.0], 0.2)
    off = 1e-3
    other = rocking.Motion(ground.breakpoints, ground.coefficients + np.array([off, 0.0]))
    uncertain = rocking.Motion(ground.breakpoints, ground.coefficients, error=off)
    one, shifted = (each.on_floor(0.3, damping, free_vibration=2.0) for each in (uncertain, other))
    times = np.linspace(0.0, one.duration, 500)
    differ = np.max(np.abs(one.acceleration(times) - shifted.acceleration(times)))
    assert off < differ <= one.error
