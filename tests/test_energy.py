"""Energy over the least that overturns a block: kept between impacts, lost at them, and the phase plane's boundary."""

import math

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad

import rocking
from rocking import Block, Damper, RestrainedBlock, Spring, Tendon, simulate
from rocking.errors import OptionError
from rocking.response.figure import compute_boundary, sample_interval

COLUMN = Block(width=0.4, height=2.0, mass=2000.0)
BODIES = {
    "rectangle": Block(width=0.24, height=1.1),
    "two sides": Block(width=0.24, height=1.1, offset=0.04),
    "parameters": Block.from_parameters(p=(2.9858, 3.0053), alpha=(0.27417, 0.155)),
    "tendon": RestrainedBlock(COLUMN, Tendon(2e5, prestress=2e3)),
    "spring": RestrainedBlock(COLUMN, Spring(2e3)),
    "wall": Block.one_sided(width=0.4, height=4.0, restitution=0.7),
    "leaning": RestrainedBlock(COLUMN, lean=0.05),
}


def total(response, time):
    return response.kinetic_energy(time) + response.potential_energy(time)


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
@pytest.mark.parametrize("name", BODIES)
def test_energy_is_kept_between_impacts_and_lost_at_them(name, model):
    body = BODIES[name]
    start = 0.2 * min(*body.balance, 0.25)
    response = simulate(body, None, model=model, initial_rotation=start, duration=30.0)
    impacts = response.impacts[:20]
    assert len(impacts) >= 8
    ends = np.concatenate([[0.0], impacts["time"]])
    fractions = np.linspace(0.0, 1.0, 9)[:-1]
    energies = total(response, ends[:-1, None] + np.diff(ends)[:, None] * fractions)
    assert energies[0, 0] > 0.01
    assert np.ptp(energies, axis=1).max() <= 2e-14 * energies[0, 0]
    lost = energies[:-1, 0] - energies[1:, 0]
    np.testing.assert_allclose(response.impact_losses[: len(lost)], lost, rtol=1e-9, atol=1e-13 * energies[0, 0])
    assert (lost > 0.0).all()


def test_a_damper_takes_energy_between_impacts():
    damped = RestrainedBlock(COLUMN, Damper(2e3))
    response = simulate(damped, None, initial_rotation=0.1, duration=5.0)
    times = np.linspace(0.0, response.impacts["time"][0] - 1e-9, 50)
    assert (np.diff(total(response, times)) < 0.0).all()


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
def test_energies_are_those_of_a_rigid_body_to_the_last_digits(model):
    """Weight and lever by geometry, in 40 digits, against the states that the response itself tells."""
    draw, worst, judged = np.random.default_rng(4), 0.0, 0
    for _ in range(12):
        right, left, height, gyration = draw.uniform(0.1, 0.6, 2).tolist() + draw.uniform(0.5, 3.0, 2).tolist()
        block = Block.from_pivots((right, left), height, gyration)
        response = simulate(
            block,
            rocking.pulses.one_sine(draw.uniform(3.0, 9.0), 0.8),
            model=model,
            duration=2.0,
            initial_rotation=0.01,
        )
        times = draw.uniform(0.0, response.duration, 12)
        theta, rate, _ = response.states(times).T
        kinetic, potential = response.kinetic_energy(times), response.potential_energy(times)
        with mpmath.workdps(40):
            side = [(mpmath.atan2(d, height), mpmath.hypot(d, height)) for d in (right, left)]

            def lifted(u, k, side=side):
                alpha, radius = side[k]
                linear = radius * (alpha * u - u * u / 2)
                return linear if model == "linear" else radius * (mpmath.cos(alpha - u) - mpmath.cos(alpha))

            least = min(lifted(side[k][0], k) for k in range(2))
            for x, v, *found in zip(*(each.tolist() for each in (theta, rate, kinetic, potential)), strict=True):
                if x == 0.0:
                    continue
                k = 0 if x > 0 else 1
                turning = (mpmath.mpf(gyration) ** 2 + side[k][1] ** 2) * mpmath.mpf(v) ** 2 / 2 / block.gravity
                for value, exact in zip(found, (turning, lifted(abs(mpmath.mpf(x)), k)), strict=True):
                    # Past the balance the potential passes through zero: what counts there is the energy of the way.
                    scale = max(abs(exact), least if abs(x) > side[k][0] else 0)
                    worst = max(worst, float(abs(value * least - exact) / scale))
                    judged += 1
    assert judged >= 200
    assert worst <= 4e-14


def test_shaking_does_the_work_that_the_energy_gains():
    block = Block(width=0.24, height=1.1)
    motion = rocking.pulses.one_sine(3.0, 1.0)
    response = simulate(block, motion)
    start, end = response.events["time"][0], response.impacts["time"][0]
    side = block.sides[0]

    def power(t):
        theta, rate, _ = response.states(t)
        push = -motion.acceleration(t) / block.gravity
        return push * math.cos(side.alpha - abs(theta)) * rate * side.p**2

    work = quad(power, start, end - 1e-12, epsabs=1e-13, epsrel=1e-12)[0] / (side.p**2 * (1.0 - math.cos(side.alpha)))
    gained = total(response, end - 1e-12) - total(response, start)
    assert gained > 0.1
    assert gained == pytest.approx(work, rel=1e-8)


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
@pytest.mark.parametrize("name", BODIES)
def test_the_boundary_is_where_the_energy_just_overturns(name, model):
    body = BODIES[name]
    response = simulate(body, None, model=model, initial_rotation=0.01, duration=1.0)
    energy, judged = response._energy, 0
    x, y = compute_boundary(response)
    for sign, side in ((1.0, 0), (-1.0, 1)):
        here = (sign * x > 0.0) & (sign * x < 1.0)
        if not here.any():
            continue
        balance, p = energy.balance[side], energy.p[side]
        sides = np.full(here.sum(), side)
        found = energy.kinetic(y[here] * p * balance, sides) + energy.potential(x[here] * balance, sides)
        np.testing.assert_allclose(found, energy.overturning_energy[side], rtol=1e-12)
        judged += here.sum()
    assert judged > 200
    assert min(energy.overturning_energy) == 1.0
    # Released a little within it, a block comes back; a little beyond it, it falls.
    for factor, falls in ((1.0 - 1e-6, False), (1.0 + 1e-6, True)):
        found = simulate(
            body, None, model=model, initial_rotation=0.01, duration=40.0,
            initial_velocity=factor * float(np.interp(0.01, *_outward(energy))),
        )  # fmt: skip
        assert (found.overturned and not len(found.impacts)) == falls


def _outward(energy):
    u, speed = energy.compute_boundary(0)
    within = u <= 1.0
    return u[within] * energy.balance[0], speed[within] * energy.p[0] * energy.balance[0]


def test_a_course_jumps_at_impacts_and_nowhere_else():
    record = rocking.records.load("ridgecrest-clc-090")
    response = simulate(BODIES["two sides"], record.scaled_to(4.0, "pga"))
    course = sample_interval(response, 230.0, 236.0)
    impacts = response.impacts[(response.impacts["time"] >= 230.0) & (response.impacts["time"] <= 236.0)]
    assert len(course.impact_rows) == len(impacts) > 30
    np.testing.assert_array_equal(course.time[course.impact_rows], impacts["time"])
    np.testing.assert_array_equal(course.time[course.impact_rows + 1], impacts["time"])
    drops = (course.kinetic + course.potential)[course.impact_rows] - (course.kinetic + course.potential)[
        course.impact_rows + 1
    ]
    inside = np.isin(response.impacts["time"], impacts["time"])
    np.testing.assert_allclose(drops, response.impact_losses[inside], rtol=1e-12)
    assert (course.rotation[course.impact_rows] == 0.0).all()
    smooth = np.delete(np.arange(len(course.time)), np.union1d(course.impact_rows, course.impact_rows + 1))
    theta = response.rotation(course.time[smooth])
    alpha = np.where(theta >= 0.0, *[side.alpha for side in response.block.sides])
    np.testing.assert_array_equal(course.rotation[smooth], theta / alpha)
    assert np.isnan(course.insert_gaps(course.velocity)[course.impact_rows + 1 + np.arange(len(impacts))]).all()


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
def test_a_phase_plane_counts_in_radians_where_a_side_has_no_balance(model):
    body = RestrainedBlock(rocking.Block(width=0.6, height=2.0, mass=1e3), Tendon(6e4, offset=0.2))
    response = simulate(body, rocking.pulses.one_sine(4.5, 1.0), model=model)
    balance = response.balance[0]
    assert math.isfinite(balance) and response.balance[1] == math.inf
    course = sample_interval(response, 0.0, response.duration)
    smooth = np.delete(np.arange(len(course.time)), np.union1d(course.impact_rows, course.impact_rows + 1))
    times = course.time[smooth]
    np.testing.assert_array_equal(course.rotation[smooth], response.rotation(times))
    sides = [side.p for side in body.sides]
    assert course.rotation.min() < -0.04
    np.testing.assert_allclose(course.velocity[smooth] * sides[0], response.angular_velocity(times), rtol=1e-12)
    x, y = compute_boundary(response)
    crossing = np.flatnonzero(np.abs(x - balance) < 1e-12)
    assert crossing.size == 2 and np.max(np.abs(y[crossing])) < 1e-7
    axes = response.plot_phase_plane().axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("rotation / rad", "velocity / (p × rad)")


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (RestrainedBlock(COLUMN, Tendon(2e5, 1e3, strength=3e3)), "not defined for a yielding tendon"),
        (RestrainedBlock(COLUMN, Spring(1e6)), "hold it at any rotation"),
    ],
)
def test_an_energy_that_is_not_known_is_refused_in_one_sentence(body, words):
    response = simulate(body, None, initial_rotation=0.01, duration=1.0)
    for ask in (lambda: response.kinetic_energy(0.5), lambda: response.impact_losses, response.plot_energy):
        with pytest.raises(OptionError, match=words):
            ask()


def test_a_ball_has_no_energy_that_overturns_it():
    ball = rocking.dynamics.BouncingBall(restitution=0.8)
    response = rocking.dynamics.simulate(ball, None, initial_position=1.0)
    with pytest.raises(OptionError, match="defined for blocks only, not for a BouncingBall"):
        response.potential_energy(0.1)
