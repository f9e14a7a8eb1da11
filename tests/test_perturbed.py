"""Repeated simulations: the motion or the initial state scaled by factors near 1, and what of the response survives."""

import itertools
import json
import pickle
import re

import numpy as np
import pytest

import rocking
from rocking import Block, Damper, RestrainedBlock, Spring, Tendon, dynamics, simulate
from rocking.errors import OptionError
from rocking.response.perturbed import choose_factors, list_factors

FREE = Block(width=0.24, height=1.1)
LEANING = Block.from_parameters(p=(2.0, 2.5), alpha=(0.15, 0.25), restitution=(0.9, 0.8))
HELD = RestrainedBlock(Block(width=0.4, height=2.0, mass=500.0), Spring(2e3), Damper(50.0))
TIED = RestrainedBlock(Block(width=0.4, height=2.0, mass=500.0), Tendon(2e5, strength=1e3))
RECORD = rocking.records.load("el-centro-meloland-270")
SHAKEN = RECORD.with_vertical(rocking.records.load("el-centro-meloland-360").scaled(0.5))
SINE = rocking.pulses.sine(3.0, 1.0, cycles=3)
UNDECIDED = rocking.records.load("ridgecrest-clc-090").scaled_to(0.53 * 9.80665)


def outcome(response):
    rests = response.events["time"][response.events["kind"] == "rest"]
    at_rest = len(rests) and not response.moves_at_end
    return (
        response.outcome,
        response.peak_rotation,
        response.peak_time,
        repr(response.overturn_time),
        repr(float(rests[-1]) if at_rest else float("nan")),
        response.events.tolist(),
    )


@pytest.mark.parametrize(
    ("body", "motion", "options"),
    [
        *((body, RECORD, {}) for body in (FREE, LEANING, HELD, TIED)),
        *((body, RECORD, {"model": "linear"}) for body in (FREE, LEANING, HELD, TIED)),
        *((body, SHAKEN, {}) for body in (FREE, LEANING, TIED)),
        (LEANING, RECORD.scaled(-1.3), {}),
        (FREE, RECORD, {"duration": 5.0}),
        (FREE, RECORD, {"initial_rotation": 0.1, "initial_velocity": -0.3}),
        (LEANING, None, {"initial_rotation": -0.2}),
        (LEANING, None, {"initial_velocity": 0.3, "model": "linear"}),
        *((FREE, SINE, {"chattering": each}) for each in ("velocity", "bypass", "interval", "time")),
    ],
)
def test_each_repeat_is_the_simulation_of_the_scaled_motion_and_initial_state(body, motion, options):
    response = simulate(body, motion, **options)
    found = response.perturbed(1e-4, 7)
    assert (
        found.factors.tolist()
        == list_factors(1e-4, 7)
        == [1 - 5e-4, 1 - 3e-4, 1 - 1e-4, 1, 1 + 1e-4, 1 + 3e-4, 1 + 5e-4]
    )
    for repeat in found.repeats:
        initial = {
            name: options[name] * repeat.factor for name in ("initial_rotation", "initial_velocity") if name in options
        }
        again = simulate(body, None if motion is None else motion.scaled(repeat.factor), **options | initial)
        assert outcome(again) == (
            *repeat[1:4], repr(repeat.overturn_time), repr(repeat.last_rest), repeat.events.tolist()
        )  # fmt: skip
    assert len({repeat.peak for repeat in found.repeats}) > 1 or response.overturned


@pytest.mark.parametrize(
    "start", [{}, {"initial_velocity": 0.05}, {"initial_position": 0.03}, {"initial_position": 0.05}]
)
@pytest.mark.parametrize(
    "body",
    [
        dynamics.BouncingBall(0.6),
        dynamics.ImpactOscillator(1.0, 0.6, stop=-0.02),
        dynamics.ImpactOscillator(1.0, 0.6, stop=0.01, second_stop=0.05),
    ],
    ids=["ball", "stop", "two stops"],
)
def test_of_another_body_the_distance_from_its_stop_is_scaled(body, start):
    motion = rocking.pulses.sine(2.0, 1.5, cycles=3)
    found = dynamics.simulate(body, motion, **start).perturbed(1e-3)
    low, high = body.stops
    for repeat in found.repeats:
        scaled = {name: repeat.factor * value for name, value in start.items()}
        if "initial_position" in start:
            at = start["initial_position"]
            scaled = {"initial_position": at if at == high else low + repeat.factor * (at - low)}
        again = dynamics.simulate(body, motion.scaled(repeat.factor), **scaled)
        assert repeat.peak == again.peak_rotation and repeat.events.tolist() == again.events.tolist()


@pytest.mark.parametrize("level", [0.53, 0.55])
def test_an_outcome_that_changes_within_three_millionths_is_undecided(level):
    response = simulate(FREE, UNDECIDED.scaled_to(level * 9.80665))
    found = response.perturbed()
    assert not response.overturned and not found.is_decided
    text = f"undecided: overturns in {np.count_nonzero(found.overturned)} of 5 motions within 3e-6"
    assert found.describe_outcome() == text and text in response.summary() and text in found.summary()
    (row,) = rocking.survey(FREE, response.motion).rows()
    assert row["decided"] is False and row["overturned_share"] == found.overturned.mean()
    assert row["verdict"].startswith(f"undecided: overturns in {np.count_nonzero(found.overturned)} of 5 (3e-6), ")
    assert ", undecided under 1" in rocking.survey(FREE, response.motion).summary()
    rows = response.to_dict()["perturbed"]
    assert [row["count"] for row in rows] == [5, 11] and rows[0]["decided"] is False
    assert rows == json.loads(json.dumps(rows))


@pytest.mark.parametrize("polarity", ["+", "both"])
def test_a_robust_ensemble_counts_every_body_motion_level_and_polarity(polarity):
    blocks, motions = rocking.Blocks.from_bodies([FREE, LEANING]), {"a": RECORD, "b": SHAKEN}
    options = {"levels": [1.0, 1.4], "polarity": polarity}
    found = rocking.simulate_many(blocks, motions, robust=True, **options)
    near = [rocking.simulate_many(blocks, motions, **options | {"levels": [f, 1.4 * f]}) for f in list_factors(1e-6, 5)]
    shares = np.mean([each.overturned.values for each in near], axis=0)
    assert found.overturned_share.dims == found.overturned.dims and np.array_equal(
        found.overturned_share.values, shares
    )
    assert "overturned_share" not in near[0]


def test_a_summary_counts_outcomes_in_both_ranges_and_takes_the_precision_that_is_given():
    response = simulate(FREE, UNDECIDED.scaled(0.9))
    assert re.search(r"^outcome +(undecided: )?\w+ in \d of 5 motions within 3e-6", response.summary(), re.MULTILINE)
    for precision, text in ((1e-3, "0.1 %"), (0.05, "5 %"), (2e-6, "2e-6")):
        found = response.perturbed(*choose_factors(precision))
        assert found.max_deviation == pytest.approx(precision, rel=1e-12)
        last = response.summary(precision=precision).splitlines()[-1]
        assert last == f"{'':20}{found.describe_agreement()}" and last.endswith(f" of 11 motions within {text}")
    released = simulate(FREE, None, initial_rotation=0.1)
    assert "stands in 5 of 5 initial states within 3e-6" in released.summary()
    assert "does not move in 5 of 5 motions" in simulate(FREE, RECORD.scaled(0.1)).summary()


def test_a_release_from_balance_is_decided_on_neither_side():
    balanced = simulate(FREE, None, model="linear", initial_rotation=FREE.alpha, duration=100.0)
    outcomes = [repeat.outcome for repeat in balanced.perturbed().repeats]
    assert outcomes[:2] == ["stands"] * 2 and outcomes[3:] == ["overturns"] * 2


def test_events_have_ranges_up_to_the_first_that_differs():
    found = simulate(FREE, UNDECIDED).perturbed()
    ranges = found.event_ranges
    assert np.isfinite(ranges[0]).all() and np.isnan(ranges[1:]).all() and len(ranges) > 1
    assert found.event_spreads[0] == max(
        abs(repeat.events["time"][0] - found.repeats[2].events["time"][0]) for repeat in found.repeats
    )
    same = simulate(FREE, RECORD.scaled(0.7)).perturbed()
    times = np.array([repeat.events["time"] for repeat in same.repeats])
    assert np.array_equal(same.event_ranges, np.stack([times.min(axis=0), times.max(axis=0)], axis=1))


def test_repeats_are_a_table_and_survive_pickling(tmp_path):
    response = pickle.loads(pickle.dumps(simulate(FREE, RECORD)))
    found = response.perturbed(count=3)
    assert found is response.perturbed(count=3)
    found.to_csv(tmp_path / "repeats.csv")
    head = (tmp_path / "repeats.csv").read_text("utf-8").splitlines()[0]
    assert head == "factor,outcome,peak_rotation_rad,peak_time_s,overturn_time_s,last_rest_s"
    assert found.to_dataframe()["outcome"].tolist() == [repeat.outcome for repeat in found.repeats]
    assert [*itertools.pairwise(found.factors)] == sorted(itertools.pairwise(found.factors))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"relative_step": 0.0}, "relative_step must be a number from 1e-12 to 0.1, not 0"),
        ({"count": 4}, "count must be odd, with as many factors below 1 as above; got 4"),
        ({"count": 1}, "count must be a whole number"),
        ({"relative_step": 0.1, "count": 13}, "relative_step must be below 1/11 for 13 factors; got 0.1"),
    ],
)
def test_factors_that_are_none_are_refused(given, message):
    with pytest.raises(OptionError, match=re.escape(message)):
        simulate(FREE, RECORD).perturbed(**given)
    with pytest.raises(OptionError, match=r"precision must be a number from 1e-06 to 0\.1, not 1"):
        simulate(FREE, RECORD).summary(precision=1)


@pytest.mark.parametrize("measure", ["pga", "pga_ratio"])
@pytest.mark.parametrize(("body", "polarity"), [(FREE, "+"), (LEANING, "both"), (LEANING, "-")])
def test_fragilities_count_the_undecided_outcomes_of_a_sample(body, polarity, measure):
    """So few outcomes are all in the sample: their number is that of single simulations at both ends."""
    motions = [UNDECIDED, RECORD]
    unit = min(body.uplift_thresholds()) if measure == "pga_ratio" else 1.0
    levels = np.array([2.0, 0.53 * 9.80665, 0.55 * 9.80665, 6.5, 9.0, 14.0, 20.0]) / unit
    found = rocking.fragility(body, motions, measure=measure, levels=levels, polarity=polarity)
    signs = {"+": (1.0,), "-": (-1.0,), "both": (1.0, -1.0)}[polarity]
    changed = 0
    for motion, level, sign in itertools.product(motions, levels, signs):
        scale = level * unit / motion.pga * sign  # one rounding more would be another motion
        near = [simulate(body, motion.scaled(scale * factor)).overturned for factor in (1 - 3e-6, 1.0, 1 + 3e-6)]
        changed += len(set(near)) > 1
    text = f"undecided within 3e-6 of the motion: {changed} of a sample of {14 * len(signs)} outcomes"
    assert found.notes[0] == text and text in found.summary()
    assert changed >= 2 or body is LEANING


def test_an_incremental_analysis_counts_the_undecided_outcomes_of_a_sample():
    levels = np.array([0.53, 0.54, 0.55, 0.6]) * 9.80665
    found = rocking.incremental_dynamic_analysis(FREE, UNDECIDED, levels=levels, rtol=0.01)
    text = "undecided within 3e-6 of the motion: 2 of a sample of 4 outcomes"
    assert f"note: {text}" in found.summary() and found.to_dict()["undecided_note"] == text
