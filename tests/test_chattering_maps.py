"""Where chattering is complete under any motion: maps, exceedances of the thresholds, and episodes of a response."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rocking
from rocking.chattering import chattering_time, critical_amplitude, families
from rocking.chattering.families import SimulationInput
from rocking.chattering.maps import UpliftOutcome, chattering_episodes, chattering_map
from rocking.motion.motion import find_exceedances

BLOCK = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.92)
THRESHOLD = BLOCK.gravity * 0.2
STATUE = rocking.Block(width=0.24, height=1.1)
ONE = {"a": [1.0], "b": [1.0]}


def outcome_of(motion, block=BLOCK, model="linear"):
    dataset = chattering_map(lambda a, b: SimulationInput(block, motion, model), ONE)
    return UpliftOutcome(dataset.data.outcome.item())


# The region of complete chattering


@pytest.mark.parametrize("eta", [0.6, 0.85, 0.92])
@pytest.mark.parametrize("omega", [0.6, 2.0, 7.0])
def test_under_a_sine_the_boundary_is_the_critical_amplitude(omega, eta):
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=eta)
    critical = float(critical_amplitude(omega, eta))
    around = critical + (critical - 1.0) * np.array([-1e-6, 1e-6])
    dataset = chattering_map(families.sine(block, model="linear"), {"a": around, "omega": [omega]})
    assert dataset.data.complete.values.ravel().tolist() == [True, False]


def test_under_a_sine_the_time_to_rest_is_the_chattering_time():
    a, omega = np.linspace(1.005, 1.035, 7), np.array([0.8, 2.0, 5.0])
    dataset = chattering_map(families.sine(BLOCK, model="linear"), {"a": a, "omega": omega})
    expected = chattering_time(a[:, np.newaxis], omega, 0.92) / 2.0
    np.testing.assert_allclose((dataset.data.rest - dataset.data.uplift).values, expected, rtol=1e-10)
    assert (dataset.data.lower <= dataset.data.rest).all()
    assert (dataset.data.rest <= dataset.data.upper).all()
    assert (dataset.data.upper - dataset.data.lower < 1e-11).all()


def test_the_nonlinear_boundary_of_a_slender_block_is_near_the_linear_one():
    slender = rocking.Block.from_parameters(p=2.0, alpha=0.02, restitution=0.92)
    around = {"a": float(critical_amplitude(2.0, 0.92)) + np.array([-1e-4, 1e-4]), "omega": [2.0]}
    assert chattering_map(families.sine(slender), around).data.complete.values.ravel().tolist() == [True, False]


def lobes(*amplitudes):
    return rocking.pulses.n_lobe([a * THRESHOLD for a in amplitudes], 2.0 / math.pi)


@pytest.mark.parametrize(
    ("amplitudes", "outcome"),
    [
        ((0.9, 0.99), UpliftOutcome.NO_UPLIFT),
        ((1.02, 1.02), UpliftOutcome.COMPLETE),
        ((1.5,), UpliftOutcome.COMPLETE),  # nothing comes after a single lobe
        ((1.1, 1.1), UpliftOutcome.RESTS_AT_LAST),
        ((1.1, 1.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.02), UpliftOutcome.RESTS_LATER),
        ((9.0,), UpliftOutcome.OVERTURNS),
    ],
)
def test_lobes_have_the_outcome_that_the_next_exceedance_leaves_them(amplitudes, outcome):
    assert outcome_of(lobes(*amplitudes)) is outcome


def test_overturning_after_a_complete_sequence_is_both():
    quiet = (0.0, 0.0, 0.0, 0.0)
    dataset = chattering_map(
        lambda a, b: SimulationInput(BLOCK, lobes(1.02, *quiet, a), "linear"), {"strong": [1.5, 9.0], "any": [0.0]}
    )
    assert dataset.data.complete.all()
    assert dataset.data.overturned.values.ravel().tolist() == [False, True]
    assert dataset.data.rests.values.ravel().tolist() == [2, 1]


def test_an_uplift_by_hardly_more_than_rounding_is_complete_only_if_proven():
    record = rocking.records.load("ridgecrest-clc-090").processed(trim=(225.0, 245.0))
    dataset = chattering_map(families.record(record, 0.2, 0.92), {"a": [1.0 + 1e-15, 1.0 + 1e-13], "p": [2.0]})
    below, above = dataset.data.outcome.values.ravel()
    assert below == UpliftOutcome.NO_UPLIFT
    assert above in (UpliftOutcome.COMPLETE, UpliftOutcome.UNPROVEN)
    assert bool(dataset.data.complete[1, 0]) == (above == UpliftOutcome.COMPLETE)
    assert bool(np.isfinite(dataset.data.upper[1, 0])) == (above == UpliftOutcome.COMPLETE)


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_at_the_threshold_nothing_lifts_a_block_whichever_way_its_peak_was_rounded(model):
    block = rocking.Block.from_parameters(p=2.1, alpha=0.17, restitution=0.95)
    pulses = families.ricker(block, model=model)
    omega = np.linspace(0.5, 8.0, 31)
    peaks = [pulses(1.0, ratio).motion.pga / min(block.uplift_thresholds(model)) for ratio in omega]
    assert max(peaks) > 1.0
    dataset = chattering_map(pulses, {"a": [1.0, 1.0 + 1e-9], "omega": omega})
    assert (dataset.data.outcome.values[0] == UpliftOutcome.NO_UPLIFT).all()
    assert (dataset.data.outcome.values[1] == UpliftOutcome.COMPLETE).all()


def test_a_weight_that_falls_lifts_a_block_whose_motion_does_not_reach_the_threshold():
    motion = lobes(0.9, 0.9)
    falling = rocking.Motion.from_samples([0.0, -0.3 * BLOCK.gravity, -0.3 * BLOCK.gravity, 0.0], motion.duration / 3.0)
    assert outcome_of(motion) is UpliftOutcome.NO_UPLIFT
    assert outcome_of(motion.with_vertical(falling)) is not UpliftOutcome.NO_UPLIFT


def test_what_overturns_after_its_first_rocking_is_counted_and_hatched():
    record = rocking.records.load("el-centro-meloland-270")

    def case(pga, p):
        return families.SimulationInput(rocking.Block.from_parameters(p, 0.15, 0.93), record.scaled_to(pga * 9.80665))

    found = chattering_map(case, {"pga": np.linspace(0.3, 0.9, 5), "p": np.linspace(2.0, 6.0, 5)})
    later = (found.data.overturned & (found.data.outcome != UpliftOutcome.OVERTURNS)).values
    assert (
        2 <= later.sum() < found.data.overturned.values.sum() or later.sum() == found.data.overturned.values.sum() >= 2
    )
    share = f"{100 * found.data.overturned.values.mean():.1f} %, {100 * later.mean():.1f} % after a first rest"
    assert found.summary().endswith(f"overturns in the end: {share}")
    figure = found.plot()
    hatched = [each for each in figure.axes[0].collections if each.get_hatch()]
    assert [len(each.get_paths()) for each in hatched] == [later.sum()] * 2
    assert "overturns later" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_a_map_is_the_same_in_one_thread_and_in_several():
    parameters = {"a": [0.9, 1.03, 1.05, 9.0], "omega": [1.0, 2.0]}
    with rocking.set_options(threads=1):
        one = chattering_map(families.sine(BLOCK), parameters)
    with rocking.set_options(threads=3):
        several = chattering_map(families.sine(BLOCK), parameters)
    assert one.data.identical(several.data)
    with pytest.raises(rocking.errors.OptionError, match="threads"):
        rocking.set_options(threads=0)


# Families


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize(
    "family",
    [
        families.sine, families.ricker,
        lambda block, model: families.ricker(block, kind="antisymmetric", model=model),
        lambda block, model: families.mavroeidis_papageorgiou(block, phase=0.4, gamma=2.0, model=model),
        lambda block, model: families.record(rocking.records.load("el-centro-meloland-270"), 0.2, 0.9, model=model),
    ],
)  # fmt: skip
def test_the_amplitude_of_a_family_is_over_the_threshold_of_its_block(family, model):
    case = family(rocking.Block.from_parameters(p=(3.0, 2.0), alpha=0.2, restitution=0.9), model=model)(1.3, 3.0)
    assert case.model == model
    assert case.motion.pga == pytest.approx(1.3 * min(case.block.uplift_thresholds(model)), rel=1e-9)
    # The frequency is over the smaller p, and a record is of blocks of any size.
    durations = {"sine": 2.5 * math.pi / 3.0, "Mavroeidis-Papageorgiou": 2.0 * math.pi / 3.0}
    if (expected := durations.get(case.motion.description.family)) is not None:
        assert case.motion.duration == pytest.approx(expected)
    assert case.motion.name != "el-centro-meloland-270" or case.block.p == 3.0


def test_lobes_swell_or_fade_by_the_ratio():
    case = families.lobes(BLOCK, omega=2.0, count=3, model="linear")(1.1, 1.2)
    quarter = 0.5 * math.pi / (2.0 * BLOCK.p)
    peaks = case.motion.acceleration(quarter * np.array([1.0, 3.0, 5.0])) / THRESHOLD
    np.testing.assert_allclose(peaks, [1.1, -1.32, 1.584], rtol=1e-12)


# Exceedances


@settings(deadline=None, max_examples=60)
@given(
    samples=st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=30),
    plus=st.floats(0.1, 2.0),
    minus=st.floats(0.1, 2.0),
    times=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=40),
)
def test_a_motion_is_beyond_a_threshold_within_the_exceedances_and_nowhere_else(samples, plus, minus, times):
    motion = rocking.Motion.from_samples(samples, 0.5)
    found = find_exceedances(motion, (plus, minus))
    assert np.all(np.diff(found, axis=1) > 0.0)
    instants = motion.duration * np.array(times)
    # At the ends of a stretch rounding decides.
    ends = np.append(found.ravel(), math.inf)
    clear = np.min(np.abs(instants[:, np.newaxis] - ends), axis=1) > 1e-9
    acceleration = motion.acceleration(instants)
    beyond = (acceleration > minus) | (acceleration < -plus)
    within = np.any((instants[:, np.newaxis] > found[:, 0]) & (instants[:, np.newaxis] < found[:, 1]), axis=1)
    np.testing.assert_array_equal(within[clear], beyond[clear])


def test_exceedances_of_a_pulse_start_where_a_resting_block_is_lifted():
    motion = rocking.pulses.ricker(2.7 * THRESHOLD, 0.7)
    starts = find_exceedances(motion, BLOCK.uplift_thresholds("linear"))[:, 0]
    assert len(starts) == 3
    response = rocking.simulate(BLOCK, motion, model="linear")
    assert response.events["time"][0] == pytest.approx(starts[0], abs=1e-12)


def test_the_two_sides_have_thresholds_of_their_own():
    motion = rocking.pulses.sine(1.0, 1.0, cycles=1)
    assert find_exceedances(motion, (2.0, 0.5)).round(12).tolist() == [[round(1 / 12, 12), round(5 / 12, 12)]]
    assert find_exceedances(motion, (0.5, 2.0)).round(12).tolist() == [[round(7 / 12, 12), round(11 / 12, 12)]]
    assert find_exceedances(motion, (2.0, 2.0)).shape == (0, 2)


# Episodes


def test_episodes_under_a_record_are_those_of_the_response():
    response = rocking.simulate(STATUE, rocking.records.load("ridgecrest-clc-090"))
    found = chattering_episodes(response)
    episodes = found.episodes
    kinds, times = response.events["kind"], response.events["time"]
    np.testing.assert_array_equal(episodes["uplift"], times[kinds == "uplift"])
    np.testing.assert_array_equal(episodes["rest"], times[kinds == "rest"])
    assert np.all(episodes["uplift"] < episodes["proven"])
    assert np.all((episodes["lower"] <= episodes["rest"]) & (episodes["rest"] <= episodes["upper"]))
    assert episodes["impacts"].sum() == len(response.impacts)
    assert found.ends_during_shaking.tolist() == [True] * 5 + [False]
    # It rests though the ground still shakes.
    assert np.all(np.abs(episodes["ground"]) > 0.1)


def test_the_share_at_rest_is_the_share_of_instants_at_which_the_block_does_not_move():
    response = rocking.simulate(STATUE, rocking.records.load("ridgecrest-clc-360"))
    found = chattering_episodes(response)
    start, end = found.shaking_span
    instants = np.linspace(start, end, 400_001)
    still = np.mean((response.rotation(instants) == 0.0) & (response.angular_velocity(instants) == 0.0))
    assert found.share_at_rest == pytest.approx(still, abs=1e-4)
    assert 0.1 < found.share_at_rest < 0.9


def test_a_block_that_never_rests_amid_the_shaking_has_a_share_of_zero():
    """It lifts where the shaking starts; rounding of the one time or the other is no rest."""
    random, zeros = np.random.default_rng(3), 0
    for _ in range(60):
        p, alpha, restitution, over, frequency = random.uniform([1, 0.05, 0.5, 1.05, 0.5], [6, 0.35, 0.9, 2.5, 6.0])
        block = rocking.Block.from_parameters(p=p, alpha=alpha, restitution=restitution)
        motion = rocking.pulses.sine(over * alpha * 9.80665, frequency, cycles=2)
        share = chattering_episodes(rocking.simulate(block, motion)).share_at_rest
        assert share == 0.0 or share > 1e-6
        zeros += share == 0.0
    assert zeros >= 20


def test_shaking_ends_when_the_block_has_overturned():
    response = rocking.simulate(
        rocking.Block(half_width=0.05, half_height=0.25), rocking.records.load("ridgecrest-clc-360")
    )
    assert response.overturned
    found = chattering_episodes(response)
    assert len(found.episodes) == 3
    assert found.shaking_span[1] <= response.overturn_time


@pytest.mark.parametrize(
    ("motion", "options", "count"),
    [
        (rocking.pulses.sine(1.03 * THRESHOLD, BLOCK.p / math.pi, cycles=2), {"chattering": "velocity"}, 0),
        (lobes(0.9), {}, 0),
        (None, {"initial_rotation": 0.05}, 1),
    ],
    ids=["not proven", "not lifted", "free"],
)
def test_rests_that_are_proven_are_episodes_with_shaking_and_without(motion, options, count):
    response = rocking.simulate(BLOCK, motion, model="linear", **options)
    found = chattering_episodes(response)
    assert len(found.episodes) == count and np.all(found.episodes["uplift"] == 0.0)
    assert (len(response.sequences) > 0) == (motion is None or "chattering" in options)
    assert math.isnan(found.share_at_rest) == ("chattering" not in options) and not found.ends_during_shaking.any()
    assert ("never passes a threshold" in str(found)) == ("chattering" not in options)


def test_the_parameters_of_a_family_are_taken_by_their_names():
    family = families.lobes(rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.9), count=3)
    ratio, a = [0.2, 5.0], [1.01, 1.5, 3.0]
    named = chattering_map(family, {"a": a, "ratio": ratio}).data.outcome
    swapped = chattering_map(family, {"ratio": ratio, "a": a}).data.outcome
    assert swapped.dims == ("ratio", "a") and (swapped.T.values == named.values).all()
    assert np.unique(named.values).size > 1
