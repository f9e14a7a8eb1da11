"""Time stepping: as in a plain program and as by Siconos, of its order, and at rest where it should be."""

import math
from pathlib import Path

import numpy as np
import pytest
from kernel_records import long_uncompiled
from oracles.time_stepping import moreau_jean, schatzman_paoli

import rocking
from rocking import dynamics
from rocking.dynamics import BouncingBall, ImpactOscillator, MoreauJean, SchatzmanPaoli, integrate

SICONOS = Path(__file__).parent / "data" / "siconos"
P, ALPHA, E = 2.0, 0.2, 0.9
BLOCK = rocking.Block.from_parameters(p=P, alpha=ALPHA, restitution=E)
BOTH = [MoreauJean, SchatzmanPaoli]


def shaken(amplitude, frequency=1.0, cycles=3, model="linear"):
    """A sine over what lifts the block, and the acceleration off the ground under it."""
    threshold = BLOCK.uplift_thresholds(model)[0]
    motion = rocking.pulses.sine(amplitude * threshold, frequency, cycles=cycles)
    omega, end = 2.0 * math.pi * frequency, cycles / frequency

    def off_the_ground(side, t, u):
        push = side * amplitude * threshold / BLOCK.gravity * (math.sin(omega * t) if t < end else 0.0)
        if model == "linear":
            return P * P * (u - ALPHA - push)
        return -P * P * (math.sin(ALPHA - u) + push * math.cos(ALPHA - u))

    return motion, off_the_ground


@pytest.mark.cases(fast=2)
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("theta", [0.5, pytest.param(1.0, marks=pytest.mark.thorough), 0.0])
def test_moreau_jean_is_what_a_plain_program_computes(model, theta):
    motion, acceleration = shaken(1.4, 3.0, 8, model=model)
    h, steps = 1.7e-3, 2500  # no step ends with the motion
    found = integrate(BLOCK, motion, MoreauJean(h, theta), steps * h, model=model)
    plain = np.array(moreau_jean(acceleration, E, (1, 0.0, 0.0), h, steps, theta=theta))
    assert len(found.times) == steps + 1
    assert np.max(np.abs(found.position)) > 1e-3
    assert len(found.impact_times) > 10
    np.testing.assert_allclose(found.position, plain[:, 0] * plain[:, 1], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found.velocity, plain[:, 0] * plain[:, 2], rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_schatzman_paoli_is_what_a_plain_program_computes(model):
    motion, acceleration = shaken(1.4, 3.0, 8, model=model)
    h, steps = 1.7e-3, 2500
    found = integrate(BLOCK, motion, SchatzmanPaoli(h), steps * h, model=model)
    plain = np.array(schatzman_paoli(acceleration, E, (1, 0.0, 0.0), h, steps))
    assert len(found.times) == steps + 1
    assert np.max(np.abs(found.position)) > 1e-3
    assert len(found.impact_times) > 10
    np.testing.assert_allclose(found.position, plain[:, 0] * plain[:, 1], rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("kind", BOTH)
def test_each_impact_has_the_restitution_of_the_side_that_is_hit(kind):
    """Between impacts a free block keeps its energy, so that each leaves the speed before it times one of the two."""
    own = (0.85, 0.6)
    block, h = rocking.Block.from_parameters(p=P, alpha=ALPHA, restitution=own), 1e-5
    found = integrate(block, None, kind(h), 3.0, model="linear", initial_position=0.1)
    at = np.rint(found.impact_times[:4] / h).astype(int)
    apart = 10  # steps before and after, of which an impact takes three
    before, after = (np.abs(found.velocity[at + off]) for off in (-apart, apart))
    slope = P * P * ALPHA * apart * h  # by which the speed changes until and from then
    assert (after + slope) / (before + slope) == pytest.approx(own * 2, abs=5e-4)


def siconos(example):
    """Time, position and velocity, a row for each step."""
    return np.loadtxt(SICONOS / f"BouncingBall{example}.ref.gz", unpack=True)


def test_moreau_jean_is_what_siconos_computes():
    times, position, velocity = siconos("TS")
    found = integrate(BouncingBall(0.9, gravity=9.81), None, MoreauJean(0.005), 10.0, initial_position=1.0)
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


@long_uncompiled
@pytest.mark.parametrize(
    ("kind", "second"),
    [
        (MoreauJean, None),
        (SchatzmanPaoli, 0.03),
        pytest.param(MoreauJean, 0.03, marks=pytest.mark.thorough),
        pytest.param(SchatzmanPaoli, None, marks=pytest.mark.thorough),
    ],
)
def test_an_oscillator_with_damping_and_stops_is_followed_with_order_one(kind, second):
    oscillator = ImpactOscillator(1.0, 0.7, damping_ratio=0.05, stop=0.01, second_stop=second)
    motion, until = rocking.pulses.sine(0.5, 0.7, cycles=4), 1.0 if second is None else 0.5
    exact = dynamics.simulate(oscillator, motion, duration=until, initial_velocity=-0.8)
    assert exact.impacts["side"].tolist() == ([1, 1] if second is None else [1, -1, 1])
    fastest = np.max(np.abs(exact.velocity(np.linspace(0.0, until, 1000))))
    lengths = np.geomspace(1e-3, 1e-5, 61)
    errors, depths = np.empty(lengths.size), np.empty(lengths.size)
    for k, h in enumerate(lengths):
        found = integrate(oscillator, motion, kind(h), until - h, initial_velocity=-0.8)
        errors[k] = np.max(np.abs(found.position - exact.position(found.times)))
        depths[k] = found.penetration
    assert np.all(depths < 1.01 * fastest * lengths)
    assert np.sum(depths > 0.0) > 55
    order, _ = np.polyfit(np.log(lengths), np.log(errors), 1)
    assert order == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("kind", BOTH)
def test_with_damping_and_without_impacts_a_scheme_is_of_second_order(kind):
    oscillator = ImpactOscillator(1.0, 0.7, damping_ratio=0.1, stop=1.0)
    motion = rocking.pulses.sine(2.0, 0.7, cycles=4)
    exact = dynamics.simulate(oscillator, motion, duration=2.0)
    errors = []
    for steps in (100, 200, 400, 800):
        found = integrate(oscillator, motion, kind(2.0 / steps), 2.0)
        errors.append(np.max(np.abs(found.position - exact.position(np.minimum(found.times, 2.0)))))
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(("scheme", "order"), [(MoreauJean, 2), (lambda h: MoreauJean(h, 1.0), 1), (SchatzmanPaoli, 2)])
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_without_impacts_a_scheme_is_of_its_order(scheme, order, model):
    motion, _ = shaken(1.5, 0.7, model=model)
    exact = rocking.simulate(BLOCK, motion, model=model, initial_rotation=0.12, duration=0.45)
    assert not len(exact.impacts)
    errors = []
    for steps in (100, 200, 400, 800):
        found = integrate(BLOCK, motion, scheme(0.45 / steps), 0.45, model=model, initial_position=0.12)
        errors.append(np.max(np.abs(found.position - exact.rotation(np.minimum(found.times, 0.45)))))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx(order, abs=0.1)


@long_uncompiled
@pytest.mark.parametrize("kind", BOTH)
def test_with_impacts_the_order_is_one(kind):
    # The error of one step length depends on where the impacts lie within steps: many are averaged.
    exact = rocking.simulate(BLOCK, None, model="linear", initial_rotation=0.05, duration=3.0)
    assert len(exact.impacts) == 5
    lengths = np.geomspace(1e-2, 1e-5, 61)
    errors = np.empty(lengths.size)
    for k, h in enumerate(lengths):
        found = integrate(BLOCK, None, kind(h), 3.0 - h, model="linear", initial_position=0.05)
        errors[k] = np.max(np.abs(found.position - exact.rotation(found.times)))
    order, _ = np.polyfit(np.log(lengths), np.log(errors), 1)
    assert order == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("kind", "least", "most"), [(MoreauJean, -0.16, 0.05), (SchatzmanPaoli, -1.04, 0.84)])
def test_the_speed_after_an_impact_is_off_by_the_acceleration_times_the_step(kind, least, most):
    # From two heights of the parabola that follows, whatever the shift in time.
    g, h, apart, errors = 9.81, 1e-3, 150, []
    for height in np.linspace(0.9, 1.1, 200):
        fall = math.sqrt(2.0 * height / g)
        found = integrate(BouncingBall(0.9, gravity=g), None, kind(h), fall + 0.2, initial_position=height)
        low, high = found.position[[-1 - apart, -1]]
        middle = (high - low) / (apart * h)
        energy = 0.5 * middle**2 + g * 0.5 * (low + high) + g * (g * (apart * h) ** 2 / 8.0)
        errors.append((math.sqrt(2.0 * energy) - 0.9 * g * fall) / (g * h))
    assert min(errors) == pytest.approx(least, abs=0.02)
    assert max(errors) == pytest.approx(most, abs=0.02)


@pytest.mark.parametrize("kind", BOTH)
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_block_at_rest_is_lifted_to_the_side_to_which_it_is_pushed(kind, model, sign):
    threshold = BLOCK.uplift_thresholds(model)[0]
    motion = rocking.Motion.from_samples(sign * np.linspace(0.0, 2.0 * threshold, 101), 0.01)
    h = 1e-3
    found = integrate(BLOCK, motion, kind(h), 0.9, model=model)
    lifted = found.times[np.argmax(np.abs(found.position) > 0.0)]
    assert np.all(-sign * found.position >= 0.0)
    assert 0.5 < lifted <= 0.5 + 5.0 * h
    assert found.penetration == 0.0


@pytest.mark.parametrize("kind", BOTH)
def test_a_block_below_the_threshold_stays_at_rest_exactly(kind):
    motion, _ = shaken(0.999)
    found = integrate(BLOCK, motion, kind(1e-3), 4.0, model="linear")
    assert not found.position.any()
    assert found.rests.shape == (0, 2)
    assert not found.impact_times.size


@pytest.mark.parametrize("kind", BOTH)
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_a_block_that_overturns_ends_at_the_same_time(kind, model):
    motion, _ = shaken(8.0, 1.0, 2, model)
    exact = rocking.simulate(BLOCK, motion, model=model)
    found = integrate(BLOCK, motion, kind(1e-4), 10.0, model=model)
    assert exact.overturned and found.overturned
    assert found.times[-1] == pytest.approx(exact.overturn_time, abs=5e-3)


def restrained(*restraints):
    return rocking.RestrainedBlock(rocking.Block(width=0.4, height=2.0, mass=2e3), *restraints)


STIFF = {
    "spring": restrained(rocking.Spring(1e8)),
    "tendon": restrained(rocking.Tendon(1e9)),
    "damper": restrained(rocking.Damper(1e8)),
}


@pytest.mark.parametrize("scheme", [SchatzmanPaoli, MoreauJean, lambda h: MoreauJean(h, 0.0)])
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("kind", STIFF)
def test_steps_too_long_for_a_restraint_are_refused_and_others_do_not_make_it_overturn(kind, model, scheme):
    given = {"body": STIFF[kind], "motion": None, "duration": 0.5, "initial_position": 0.01, "model": model}
    with pytest.raises(rocking.InvalidOption, match=r"too long for this body: at most") as refused:
        integrate(scheme=scheme(0.02), **given)
    longest = float(str(refused.value).split()[-2])
    found = integrate(scheme=scheme(0.99 * longest), **given)
    assert not found.overturned
    assert found.peak < 0.01 * math.e  # so much an explicit scheme may add to an oscillation
    assert not rocking.simulate(STIFF[kind], None, model=model, initial_rotation=0.01, duration=0.5).overturned


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"scheme": "moreau-jean"}, "must be one of time stepping"),
        ({"scheme": MoreauJean(0.5)}, "too long for this body: at most 0.25 s"),
        ({"scheme": SchatzmanPaoli(1e-9)}, "10000000000 steps of 1e-09 s are too many"),
        ({"duration": 0.0}, "duration must be"),
        ({"model": "cubic"}, "model must be"),
        ({"initial_position": math.nan}, "must be"),
    ],
)
def test_what_makes_no_sense_is_refused(given, sentence):
    chosen = {"body": BLOCK, "motion": None, "scheme": MoreauJean(1e-3), "duration": 10.0} | given
    with pytest.raises(rocking.InvalidOption, match=sentence):
        integrate(**chosen)


@pytest.mark.parametrize(
    "wrong", [lambda: MoreauJean(0.0), lambda: MoreauJean(1e-3, 1.5), lambda: SchatzmanPaoli(True)]
)
def test_parameters_of_a_scheme_are_within_their_ranges(wrong):
    with pytest.raises(rocking.InvalidOption, match="must be"):
        wrong()


def test_schemes_and_responses_are_told_in_words():
    assert MoreauJean(1e-3).label == "Moreau-Jean 0.001 s"
    assert MoreauJean(1e-3, 1.0).label == "Moreau-Jean 0.001 s, theta 1"
    found = integrate(BLOCK, None, SchatzmanPaoli(1e-3), 6.0, model="linear", initial_position=0.05)
    assert "by Schatzman-Paoli 0.001 s: 6000 steps, " in repr(found)
    assert found.peak == 0.05
