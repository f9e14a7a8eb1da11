"""Rules of thumb: their formulas against simulations, quadrature and the forms in which they are printed."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
import rules_trial
from pages import DOCS
from scipy.integrate import quad

import rocking
from rocking import rules
from rocking import rules as criteria
from rocking.core.constants import STANDARD_GRAVITY as G

NUMBER = re.compile(r"\d+(?:\.\d+)?")
RECORD = "el-centro-meloland-270"
TOMBSTONE = rocking.Block(width=0.3, height=0.9)


@pytest.fixture(scope="module")
def record():
    return rocking.records.load(RECORD).processed(trim=(5.0, 15.0))


@pytest.mark.parametrize(("p", "alpha"), [(2.0, 0.1), (4.0, 0.3), (3.0, 0.5)])
def test_the_overturning_velocity_takes_a_block_at_rest_just_to_its_balance_point(p, alpha):
    block = rocking.Block.from_parameters(p=p, alpha=alpha)
    velocity = criteria.overturning_velocity(rocking.Blocks.from_bodies(block))[0, 0]
    # Momentum about the pivot, m V R cos(alpha) = I w.
    speed = velocity * p**2 * math.cos(alpha) / G
    for factor, falls in ((1.0 - 1e-6, False), (1.0 + 1e-6, True)):
        assert rocking.simulate(block, None, initial_velocity=factor * speed).overturned is falls


def test_ishiyamas_velocity_is_ten_widths_over_the_root_of_the_height_in_centimetres():
    for width, height in ((10.0, 100.0), (30.0, 150.0), (50.0, 400.0)):
        block = rocking.Blocks.from_bodies(rocking.Block(width=width / 100.0, height=height / 100.0))
        velocity = 100.0 * 0.4 * criteria.overturning_velocity(block)[0, 0]
        assert velocity == pytest.approx(10.0 * width / math.sqrt(height), rel=0.05)


def test_ishiyama_asks_for_acceleration_and_velocity():
    long, short = rocking.pulses.half_sine(2.0, 0.2), rocking.pulses.half_sine(20.0, 20.0)
    weak, quick = rules.ishiyama(TOMBSTONE, long), rules.ishiyama(TOMBSTONE, short)
    assert weak.ratio[0] == pytest.approx(2.0 / (G * math.tan(TOMBSTONE.alpha)), rel=1e-9)
    velocity = 0.4 * criteria.overturning_velocity(rocking.Blocks.from_bodies(TOMBSTONE))[0, 0]
    assert quick.ratio[0] == pytest.approx(short.pgv / velocity, rel=1e-12)
    assert not weak.overturns[0]


def test_the_static_threshold_is_what_lifts_the_block():
    pulse = rocking.pulses.half_sine(1.0, 1.0)
    for excess, lifted in ((1.0 - 1e-9, 0), (1.0 + 1e-9, 1)):
        scaled = pulse.scaled(excess / rules.west(TOMBSTONE, pulse).ratio[0])
        assert len(rocking.simulate(TOMBSTONE, scaled).events) >= lifted
        assert rules.west(TOMBSTONE, scaled).overturns[0] == bool(lifted)


def test_under_a_blow_every_spectral_velocity_is_that_of_the_ground():
    # An undamped oscillator at rest goes on with the speed of the blow, whatever its period.
    blow = rocking.Motion.from_points([0.0, 1e-5, 2e-5], [0.0, 0.5e5, 0.0])
    assert blow.pgv == pytest.approx(0.5, rel=1e-12)
    assert criteria.mean_spectral_velocity(blow) == pytest.approx(0.5, rel=1e-6)
    block = rocking.Block.from_parameters(p=3.0, alpha=0.2)
    assert rules.housner(block, blow).ratio[0] == pytest.approx(3.0 * 0.5 / (G * 0.2), rel=1e-6)


def test_housners_criterion_is_the_energy_of_the_balance_point():
    block = rocking.Block.from_parameters(p=3.0, alpha=0.01)
    velocity = criteria.overturning_velocity(rocking.Blocks.from_bodies(block))[0, 0]
    assert velocity == pytest.approx(G * 0.01 / 3.0, rel=1e-4)


def test_asce_43_05_in_the_terms_of_the_standard(record):
    b, h = 0.15, 0.45
    a, inertia = b / h, 4.0 / 3.0 * (1.0 + (b / h) ** 2)
    decay = -2.0 * math.log(1.0 - 2.0 * a**2 / inertia)
    damping = decay / math.sqrt(4.0 * math.pi**2 + decay**2)
    rotation = math.atan(a)
    raised = math.cos(rotation) + a * math.sin(rotation) - 1.0
    capacity = 2.0 * G * raised / rotation
    frequency = math.sqrt(2.0 * raised * G / (inertia * rotation**2 * h)) / (2.0 * math.pi)
    demand = record.spectral_acceleration(1.0 / frequency, damping)
    rating = rules.asce_43_05(TOMBSTONE, record)
    assert rating.capacity[0] == pytest.approx(capacity, rel=1e-12)
    assert rating.ratio[0] == pytest.approx(demand / capacity, rel=1e-10)


@pytest.mark.parametrize("share", [0.01, 0.5, 1.0])
def test_the_oscillator_of_asce_43_05_has_the_energy_of_the_block_and_loses_what_two_impacts_take(share):
    p, alpha, e = 3.0, 0.25, 0.9
    here = criteria._create_energy_oscillator(p, alpha, e, G, share)
    rotation = share * alpha
    # Work against gravity about the pivot, over m g R; h = R cos(alpha), a spring's force grows with the rotation.
    work = quad(lambda t: math.sin(alpha - t), 0.0, rotation)[0]
    assert here.capacities[0] * math.cos(alpha) * rotation / (2.0 * G) == pytest.approx(work, rel=1e-11)
    # I w^2 theta^2/2 is the same energy.
    rate = 2.0 * math.pi / here.periods[0]
    assert 0.5 * (rate * rotation / p) ** 2 == pytest.approx(work, rel=1e-11)
    left = math.exp(-2.0 * math.pi * here.damping / math.sqrt(1.0 - here.damping**2))
    assert left == pytest.approx(e**2, rel=1e-12)


def test_the_period_of_priestley_is_that_of_free_rocking():
    block = rocking.Block.from_parameters(p=3.0, alpha=0.1, restitution=0.9)
    here = criteria._create_free_rocking_oscillator(3.0, 0.1, 0.9, G)
    for k in (0, 24, 55):
        start = criteria._ROTATION_SHARES[k] * 0.1
        free = rocking.simulate(block, None, model="linear", initial_rotation=start)
        assert 4.0 * free.impacts["time"][0] == pytest.approx(here.periods[k], rel=1e-12)
    # At the balance point the centre of mass stands above the pivot.
    assert here.capacities[-1] == pytest.approx(block.radius * math.sin(0.1), rel=2e-3)


@pytest.mark.parametrize("restitution", [0.75, 0.85, 0.95])
def test_the_damping_of_priestley_lies_between_those_of_small_and_large_free_rocking(restitution):
    block = rocking.Block.from_parameters(p=3.0, alpha=0.1, restitution=restitution)
    dampings = []
    for share in (1e-3, 0.8):
        free = rocking.simulate(block, None, model="linear", initial_rotation=share * 0.1)
        speed = free.impacts["speed_after"][3] / (3.0 * 0.1)
        later = 2.0 * math.sin(0.5 * math.asin(speed)) ** 2
        # Four impacts are two cycles.
        dampings.append(math.log(share / later) / (4.0 * math.pi))
    small, large = dampings
    assert small == pytest.approx(-2.0 * math.log(restitution) / math.pi, rel=2e-3)
    assert small < criteria._create_free_rocking_oscillator(3.0, 0.1, restitution, G).damping < min(large, 1.1 * small)


@pytest.mark.parametrize("name", rules.RULES)
def test_every_demand_grows_with_the_motion_and_counts_the_weaker_side(name, record):
    rule = rules.RULES[name]
    strong, weak = rocking.Block.from_parameters(2.0, 0.3, 0.9), rocking.Block.from_parameters(3.0, 0.2, 0.8)
    both = rocking.Block.from_parameters((2.0, 3.0), (0.3, 0.2), (0.9, 0.8))
    rating = rule([strong, weak, both], record)
    assert rating.rule == name
    assert rating.ratio.shape == (3,)
    assert rating.ratio[2] == rating.ratio[1] > rating.ratio[0]
    np.testing.assert_allclose(rule([strong, weak, both], record.scaled(-1.7)).ratio, 1.7 * rating.ratio, rtol=1e-9)
    np.testing.assert_array_equal(rule(weak, record).ratio, rating.ratio[1:2])
    at_limit = record.scaled(1.0 / float(rating.ratio[1]))
    assert rule(weak, at_limit.scaled(1.0 + 1e-9)).overturns[0]
    assert not rule(weak, at_limit.scaled(1.0 - 1e-9)).overturns[0]


def test_what_a_rule_cannot_take_is_refused_in_one_sentence(record):
    with pytest.raises(rocking.errors.BlockError, match=r"priestley requires a restitution above 0\.23"):
        rules.priestley(rocking.Block.from_parameters(2.0, 0.2, 0.2), record)
    with pytest.raises(rocking.errors.OptionError, match="rules must be one of west, ishiyama"):
        rules.apply_rules(TOMBSTONE, record, ["wst"])
    with pytest.raises(rocking.errors.MotionError, match="a Motion is required, not None"):
        rules.west(TOMBSTONE, None)
    with pytest.raises(rocking.errors.OptionError, match="motions must contain at least one motion"):
        rules.compare_rules(TOMBSTONE, {})


def test_a_check_compares_the_rules_with_simulations(record):
    motions = {"as it is": record, "stronger": record.scaled(1.8)}
    found = rules.compare_rules(TOMBSTONE, motions, rules=["west", "asce_43_05"])
    once, more = found.rows()
    assert more["west"] == pytest.approx(1.8 * once["west"])
    assert more["simulated"] == pytest.approx(1.8 * once["simulated"], rel=1e-3)
    assert (once["overturned"], more["overturned"]) == (False, True)
    for excess, falls in ((1.0 - 2e-4, False), (1.0 + 2e-4, True)):
        assert rocking.simulate(TOMBSTONE, record.scaled(excess / once["simulated"])).overturned is falls
    for low, words in (
        (1.2, "right 1, unsafe 0, over-conservative 1"),
        (0.5, "right 1, unsafe 1, over-conservative 0"),
    ):
        text = replace(found, ratios=({"west": low}, {"west": low})).summary()
        assert f"West: {words} of 2" in text


def test_what_was_not_finished_says_nothing_of_a_rule(record, few_steps):
    found = rules.compare_rules(TOMBSTONE, {"whole": record, "cut": record}, rules=["west"])
    with few_steps(5):
        cut = rocking.simulate(TOMBSTONE, rocking.pulses.sine(4.0, 2.0, cycles=20))
    assert cut.unfinished
    text = replace(found, responses=(found.responses[0], cut), ratios=({"west": 0.5},) * 2).summary()
    assert "West: right 1, unsafe 0, over-conservative 0 of 1" in text
    assert "not counted: 1 of 2, whose simulation was not finished" in text


@pytest.mark.parametrize(
    "frequency", [0.8, *(pytest.param(each, marks=pytest.mark.thorough) for each in (0.9, 1.1, 1.2))]
)
@pytest.mark.parametrize(("factor", "falls"), [(1.0 - 1e-6, False), (1.0 + 1e-6, True)])
def test_the_margin_lies_on_the_side_of_1_on_which_the_motion_lies(frequency, factor, falls):
    """No weaker pulse overturns the block: a bisection finds the change within 1e-9, closer than the margin is read."""
    block, pulse = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9), (1.0, frequency)
    critical = rocking.critical_scale(block, rocking.pulses.one_sine(*pulse), (2.0, 8.0)).scale
    (row,) = rules.compare_rules(block, [rocking.pulses.one_sine(*pulse) * (factor * critical)], rules=["west"]).rows()
    assert (row["overturned"], row["overturns_when_scaled_down"]) == (falls, False)
    assert (row["simulated"] >= 1.0) is falls
    assert row["simulated"] == pytest.approx(factor, rel=1e-4)


def test_white_noise_at_housners_ratio_does_not_overturn_one_block_in_two():
    """Of fourteen fair coins three heads or fewer have a probability of 0.03, and eleven or more as well."""
    at_one, at_one_and_a_half, at_two = rules_trial.overturned_by_noise(range(14)).sum(axis=0)[:, 0]
    assert at_one == 0 < at_one_and_a_half < 11 <= at_two


@pytest.mark.slow
def test_the_table_of_white_noises_is_that_which_the_script_makes():
    made = rules_trial.noise_table(rules_trial.overturned_by_noise(range(rules_trial.NOISES)))
    kept = (DOCS / "_tables" / "rules-noise.txt").read_text("utf-8")
    assert NUMBER.sub("#", made) == NUMBER.sub("#", kept)
    # Some responses are ambiguous: the last digit of another platform may let another noise overturn the block.
    for now, before in zip(NUMBER.findall(made), NUMBER.findall(kept), strict=True):
        assert float(now) == pytest.approx(float(before), abs=1.0)


@pytest.mark.slow
def test_the_tables_of_the_trial_are_those_that_the_script_makes():
    blocks, motions = rules_trial.all_blocks(), rules_trial.all_motions()
    ratios = rules_trial.ratings(blocks, motions)
    verdicts = rules_trial.verdict_table(blocks, motions, ratios, rules_trial.simulated_verdicts(blocks, motions))
    capacities = rules_trial.capacity_table(ratios, rules_trial.simulated_capacities(blocks, motions))
    for name, made, share in (("verdicts", verdicts, 0.11), ("capacities", capacities, 0.021)):
        kept = (DOCS / "_tables" / f"rules-{name}.txt").read_text("utf-8")
        assert NUMBER.sub("#", made) == NUMBER.sub("#", kept)
        # Of 7,200 responses 248 are ambiguous: the last digit of another platform may let a few more fall.
        numbers = [*zip(NUMBER.findall(made), NUMBER.findall(kept), strict=True)]
        assert len(numbers) > 20
        for now, before in numbers:
            assert float(now) == pytest.approx(float(before), abs=share if "." in before else 3.0)


def test_a_motion_beyond_all_levels_that_are_looked_at_has_a_margin():
    block, shock = rocking.Block(width=0.01, height=0.5), rocking.pulses.half_sine(80.0 * G, 2000.0)
    (row,) = rules.compare_rules(block, shock, rules=["west"]).rows()
    assert row["overturned"] and row["simulated"] == row["lowest_factor"] == 1.0
