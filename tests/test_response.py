"""What a response offers: evaluation, forces, sensitivities, export, treatments, and refusals."""

import math

import numpy as np
import pytest

import rocking
from rocking import AsymptoticTime, Block, Certified, simulate
from rocking.errors import OptionError

G = 9.80665


def sine(amplitude, omega, block, cycles=2.5):
    """Sine of dimensionless amplitude and frequency for a block (paper, Eq. 5)."""
    return rocking.pulses.sine(amplitude * G * block.alpha, omega * block.p / (2 * math.pi), cycles=cycles)


@pytest.fixture(scope="module")
def block():
    return Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)


@pytest.fixture(scope="module")
def record():
    return rocking.records.load("el-centro-meloland-270")


@pytest.fixture(scope="module")
def shaken(record):
    return simulate(Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9), record)


def test_rotation_is_continuous_and_its_derivatives_agree(shaken):
    times = np.linspace(0.0, shaken.duration, 20_001)[1:-1]
    far = np.min(np.abs(times[:, None] - shaken.impacts["time"][None, :]), axis=1) > 2e-4
    times = times[far & (shaken.rotation(times) != 0.0)]
    h = 1e-5
    slope = (shaken.rotation(times + h) - shaken.rotation(times - h)) / (2 * h)
    assert np.max(np.abs(slope - shaken.angular_velocity(times))) < 1e-7
    slope = (shaken.angular_velocity(times + h) - shaken.angular_velocity(times - h)) / (2 * h)
    corners = np.abs(times / 0.01 - np.round(times / 0.01)) < 2e-3
    assert np.count_nonzero(~corners) > 1000
    assert np.max(np.abs(slope - shaken.angular_acceleration(times))[~corners]) < 1e-5


def test_rotation_vanishes_at_impacts_and_speeds_match(shaken):
    times = shaken.impacts["time"]
    early = times < shaken.sequences["start"][0] if len(shaken.sequences) else np.ones(len(times), bool)
    times = times[early]
    assert np.max(np.abs(shaken.rotation(times))) < 1e-14
    after = shaken.angular_velocity(np.nextafter(times, np.inf))
    assert np.allclose(after, (shaken.impacts["side"] * shaken.impacts["speed_after"])[early], rtol=1e-9)


def test_forces_at_rest_are_those_of_a_fixed_body(record):
    heavy = simulate(Block.from_parameters(p=2.0, alpha=0.5, restitution=0.9), record)
    assert len(heavy.events) == 0
    assert heavy.required_friction == pytest.approx(record.pga / G, rel=1e-12)
    assert heavy.minimum_normal_force == 1.0


def test_forces_follow_from_the_centre_of_mass(shaken, record):
    """Newton's law on the centre of mass, whose path is differentiated numerically."""
    side = shaken.block.sides[0]
    h = 2e-4

    def centre(t):
        theta = shaken.rotation(t)
        leaning = np.sign(theta)
        psi = side.alpha - np.abs(theta)
        return -leaning * side.radius * np.sin(psi), side.radius * np.cos(psi)

    times = np.linspace(1.0, 20.0, 4001) + 0.005
    calm = np.min(np.abs(times[:, None] - shaken.impacts["time"]), axis=1) > 5 * h
    times = times[calm & (np.abs(shaken.rotation(times)) > 1e-4)]
    x, y = (np.array(v) for v in zip(*(centre(times + k * h) for k in (-1, 0, 1)), strict=True))
    accelerations = [(v[2] - 2 * v[1] + v[0]) / h**2 for v in (x, y)]
    normal = 1.0 + accelerations[1] / G
    assert np.allclose(shaken.normal_force(times), normal, atol=2e-4)
    friction = np.abs(record.acceleration(times) + accelerations[0]) / G / normal
    assert np.allclose(shaken.friction_demand(times), friction, atol=2e-3)


def test_a_response_that_nobody_can_know_is_flagged():
    record = rocking.records.load("ridgecrest-clc-090")
    block = Block(half_width=0.12, half_height=0.75)
    base, nudged = simulate(block, record), simulate(block, record.scaled(1 + 2**-52))
    assert base.ambiguous
    assert abs(base.events["time"][-1] - nudged.events["time"][-1]) > 1e-6
    assert not simulate(Block(width=0.24, height=1.1), record).ambiguous


def test_tolerance_sets_the_width_of_the_bracket(block):
    motion = sine(1.03, 2.0, block)
    for tolerance in (1e-4, 1e-7, 1e-11):
        rows = simulate(block, motion, model="linear", chattering=Certified(tolerance)).sequences
        assert np.all(rows["upper"] - rows["lower"] <= tolerance + 1e-12)  # and the rounding before the proof
        assert np.all((rows["lower"] <= rows["end"]) & (rows["end"] <= rows["upper"]))


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_a_tolerance_below_all_rounding_proves_the_rest_that_a_wider_one_proves(model):
    block = Block(width=0.4, height=2.0)
    (known,) = simulate(block, None, model=model, initial_rotation=0.05).sequences
    for tolerance in (1e-30, 1e-80, 1e-300):
        found = simulate(block, None, model=model, initial_rotation=0.05, chattering=Certified(tolerance))
        (row,), (proof,) = found.sequences, found.solution.sequences
        assert found.rests_by_rounding == 0
        assert row["start"] == known["start"]
        assert row["lower"] <= proof["lower"] <= row["end"] <= proof["upper"] <= row["upper"]
        assert proof["upper"] <= proof["lower"] + 1e-11
        assert max(row["lower"], known["lower"]) <= min(row["upper"], known["upper"])


def test_overturning_ends_at_a_quarter_turn(record):
    fallen = simulate(Block.from_parameters(p=4.0, alpha=0.05, restitution=0.9), record)
    assert fallen.peak_rotation == math.pi / 2
    assert fallen.overturn_time == fallen.duration == fallen.peak_time == fallen.events["time"][-1]
    assert abs(fallen.rotation(fallen.duration)) == pytest.approx(math.pi / 2, rel=1e-12)


def test_a_stop_cuts_the_response_short(block, record, shaken):
    cut = simulate(shaken.block, record, duration=10.0)
    assert cut.duration == 10.0
    times = np.linspace(0.0, 10.0, 501)
    assert np.array_equal(cut.rotation(times[:-1]), shaken.rotation(times[:-1]))


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"model": "quadratic"}, "model"),
        ({"chattering": "luck"}, "chattering"),
        ({"duration": 0.0}, "duration"),
        ({"initial_rotation": 2.0}, "pi/2"),
        ({"chattering": AsymptoticTime()}, "sinusoidal"),
        ({"model": "linear", "initial_rotation": 0.2, "motion": None}, "balanced"),
    ],
)
def test_bad_options_are_refused_in_one_sentence(block, record, options, word):
    with pytest.raises(OptionError, match=word):
        simulate(block, **{"motion": record} | options)


def test_a_block_that_never_rests_needs_a_duration(block):
    bouncing = Block.from_parameters(p=1.0, alpha=0.2, restitution=1.0)
    with pytest.raises(OptionError, match="give duration to limit the simulation"):
        simulate(bouncing, None, initial_rotation=0.1)
    response = simulate(bouncing, None, initial_rotation=0.1, duration=20.0)
    assert response.duration == 20.0


OF_TIME = (
    "states", "rotation", "angular_velocity", "angular_acceleration", "kinetic_energy", "potential_energy",
    "normal_force", "friction_demand",
)  # fmt: skip


@pytest.mark.parametrize("name", [*OF_TIME, "sensitivity.rotation"])
@pytest.mark.parametrize("model", ["nonlinear", "linear"])
@pytest.mark.parametrize("duration", [None, 0.7])
def test_functions_of_time_are_nan_outside_the_response_and_nowhere_within(block, name, model, duration):
    response = simulate(block, sine(2.0, 3.0, block), model=model, duration=duration)
    function = getattr(response, name) if name in OF_TIME else lambda time: response.sensitivity.rotation(time)["p"]
    end = response.duration
    within, outside = [0.0, 0.5 * end, end], [-1e-9, np.nextafter(end, np.inf), 1e9, np.inf, -np.inf, np.nan]
    assert not np.isnan(function(within)).any()  # a friction demand may be infinite
    assert np.isnan(function(outside)).all()
    assert np.isnan(function(100.0 * end)).all()
    with pytest.raises(OptionError, match="time must be a number"):
        function("soon")


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_of_equal_maxima_of_free_rocking_the_first_has_the_time(model, side):
    """Without losses every swing reaches the same rotation; rounding makes later ones higher by some last digits."""
    random, higher = np.random.default_rng(4), 0
    for _ in range(20):
        p, alpha, share = random.uniform([1.0, 0.1, 0.05], [4.0, 0.3, 0.9])
        free = Block.from_parameters(p=p, alpha=alpha, restitution=1.0)
        response = simulate(free, None, model=model, initial_rotation=side * share * alpha, duration=30.0)
        assert response.peak_time == 0.0
        assert response.peak_rotation == pytest.approx(share * alpha, rel=1e-13)
        higher += response.peak_rotation > share * alpha
    assert higher >= 5


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
@pytest.mark.parametrize("polarity", [1.0, -1.0])
@pytest.mark.parametrize("lanes", [1, 3, 20])
def test_of_equal_maxima_of_a_motion_that_comes_again_the_first_has_the_time(model, polarity, lanes):
    step, judged = 0.02, 0
    for restitution, frequency, strength in ((0.55, 1.0, 1.3), (0.7, 1.4, 1.7), (0.85, 1.8, 2.1), (0.6, 1.7, 2.2)):
        once = rocking.pulses.one_sine(strength * 0.2 * G * polarity, frequency).acceleration(np.arange(52) * step)
        again = np.concatenate([once, np.zeros(600)])
        motion = rocking.Motion.from_samples(np.tile(again, 3), step)
        one = simulate(Block.from_parameters(p=2.0, alpha=0.2, restitution=restitution), motion, model=model)
        many = rocking.Blocks(p=np.full(lanes, 2.0), alpha=0.2, restitution=restitution)
        times = rocking.simulate_many(many, motion, model=model).peak_time.values.ravel()
        assert 0.0 < one.peak_time < len(again) * step
        assert times == pytest.approx(one.peak_time, abs=1e-12)
        judged += len(one.sequences) >= 3 and not one.overturned
    assert judged >= 2


def test_a_maximum_that_is_higher_has_its_own_time():
    """By a billionth: that is no rounding."""
    step = 0.02
    once = rocking.pulses.one_sine(1.7 * 0.2 * G, 1.4).acceleration(np.arange(52) * step)
    motion = rocking.Motion.from_samples(np.concatenate([once, np.zeros(600), (1.0 + 1e-9) * once, np.zeros(9)]), step)
    response = simulate(Block.from_parameters(p=2.0, alpha=0.2, restitution=0.7), motion)
    assert response.peak_time > 652 * step
