"""Predictions judged against tests: scores by closed forms and quadrature, chances that are even, tables."""

import json
import math

import numpy as np
import pytest
from scipy import stats

import rocking
from rocking import Block, Blocks, ShakeTest
from rocking.calibration import Validation
from rocking.errors import OptionError, RecordError

STRONG, WEAK = rocking.pulses.one_sine(6.0, 1.0), rocking.pulses.one_sine(1.0, 1.0)
BLOCK = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)


def left_out(probabilities):
    """Predictions by probability alone."""
    return Validation(np.atleast_2d(np.asarray(probabilities, dtype=float)), ())


def of_outcomes(outcomes):
    """Tests under one motion each, with these outcomes."""
    motions = [rocking.pulses.one_sine(1.0 + k, 1.0) for k in range(len(outcomes))]
    return [ShakeTest(motion, bool(fell)) for motion, fell in zip(motions, outcomes, strict=True)]


def test_perfect_predictions_score_zero_and_have_skill_one():
    outcomes = [1, 0, 1, 1, 0, 0]
    found = rocking.validate(of_outcomes(outcomes), left_out(outcomes))
    for score in (found.brier, found.log_loss):
        assert (score.value, score.error, score.skill, score.skill_error) == (0.0, 0.0, 1.0, 0.0)
    assert found.reliability_p_value == 1.0


def test_what_was_thought_nearly_impossible_has_the_least_chance():
    found = rocking.validate(of_outcomes([1] * 12), left_out([0.02] * 12), simulation_count=400)
    assert found.reliability_p_value == pytest.approx(1.0 / 401.0)


def test_the_base_rate_has_no_skill():
    outcomes = [1, 0, 1, 1, 0, 0, 0, 0]
    found = rocking.validate(of_outcomes(outcomes), left_out([3 / 8] * 8))
    assert found.brier.value == pytest.approx(3 / 8 * 5 / 8, abs=1e-15)
    assert found.log_loss.value == pytest.approx(-3 / 8 * math.log(3 / 8) - 5 / 8 * math.log(5 / 8), abs=1e-15)
    assert abs(found.brier.skill) < 1e-14 and abs(found.log_loss.skill) < 1e-14


def test_scores_of_three_tests_are_those_by_hand():
    found = rocking.validate(of_outcomes([1, 0, 0]), left_out([0.9, 0.2, 0.6]))
    assert found.brier.value == pytest.approx((0.01 + 0.04 + 0.36) / 3)
    assert found.brier.error == pytest.approx(np.std([0.01, 0.04, 0.36], ddof=1) / math.sqrt(3))
    assert found.log_loss.value == pytest.approx(-math.log(0.9 * 0.8 * 0.4) / 3)
    assert found.brier.skill == pytest.approx(1.0 - found.brier.value / (2 / 9))
    assert found.scores.accuracy == pytest.approx(2 / 3)


def test_standard_errors_allow_for_tests_that_belong_together():
    outcomes, chances = [1, 0, 0, 1], [0.9, 0.2, 0.6, 0.7]
    four = of_outcomes(outcomes)
    twice = [ShakeTest(test.motion, test.overturned, group=str(k)) for k, test in enumerate(four) for _ in range(2)]
    apart, together = (
        rocking.validate(tests, left_out(given)) for tests, given in ((four, chances), (twice, np.repeat(chances, 2)))
    )
    for name in ("value", "error", "skill", "skill_error"):
        assert getattr(together.brier, name) == pytest.approx(getattr(apart.brier, name))
        assert getattr(together.log_loss, name) == pytest.approx(getattr(apart.log_loss, name))
    assert (together.brier.test_count, together.brier.cluster_count) == (8, 4)


# Chances and bands


MOTIONS = [rocking.pulses.one_sine(1.0 + k, 1.0) for k in range(40)]
STRENGTH = np.random.default_rng(1).uniform(0.2, 3.0, 40)


def seen_by(own, rng, monkeypatch, **options):
    """Validate tests with the outcomes of blocks by 400 others of the population; these are not simulated here."""
    fell = STRENGTH * rng.lognormal(0.0, 0.4, (400, 1)) > 2.0
    tests = [ShakeTest(one, bool(outcome)) for one, outcome in zip(MOTIONS, STRENGTH * own > 2.0, strict=True)]

    def simulated(blocks, given, **_):
        import xarray as xr

        assert len(given) == len(MOTIONS)
        variables = {"overturned": fell, "unfinished": np.zeros_like(fell)}
        return xr.Dataset({name: (("block", "motion"), values) for name, values in variables.items()})

    monkeypatch.setattr("rocking.calibration.outcomes.simulate_many", simulated)
    blocks = Blocks(np.full(len(fell), 2.0), 0.2, 0.9)
    return rocking.validate(tests, blocks, simulation_count=200, seed=int(rng.integers(1 << 30)), **options)


def chances_are_even(chances):
    """Whether chances are those of right predictions: below x no more often than x, and not much less often."""
    assert len(chances) >= 12
    return stats.kstest(chances, "uniform").pvalue > 0.01


@pytest.mark.parametrize("sets", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_of_right_predictions_chances_are_even_and_bands_hold(monkeypatch, sets):
    rng = np.random.default_rng(2)
    found = [seen_by(rng.lognormal(0.0, 0.4, 40), rng, monkeypatch) for _ in range(sets)]
    assert chances_are_even([one.reliability_p_value for one in found])
    inside = [
        each.band_lower - 1e-9 <= each.observed <= each.band_upper + 1e-9 for one in found for each in one.reliability
    ]
    assert len(inside) >= 8 * sets
    assert np.mean(inside) > 0.85
    for name in ("brier", "log_loss") if sets >= 200 else ():
        each = [getattr(one, name) for one in found]
        for value, error in (("value", "error"), ("skill", "skill_error")):
            spread = np.std([getattr(score, value) for score in each])
            # A jackknife errs to the safe side.
            assert 0.85 < np.mean([getattr(score, error) for score in each]) / spread < 1.2, (name, value)


@pytest.mark.parametrize("wrong", [0.5, 2.0])
def test_predictions_that_are_wrong_are_found_out(monkeypatch, wrong):
    rng = np.random.default_rng(4)
    found = seen_by(wrong * rng.lognormal(0.0, 0.4, 40), rng, monkeypatch)
    assert found.reliability_p_value < 0.05 and "not as if the predictions were right" in found.summary()


# What predicts


def test_a_calibration_says_of_tests_what_it_predicts(coarse):
    pulses = [rocking.pulses.one_sine(a, 1.0) for a in (2.0, 3.0, 4.0, 5.0)]
    fell = [False, False, True, True]
    calibration = rocking.calibrate(
        pulses, fell, p=2.0, restitution=0.9, two_sided=False, candidate_count=128, model="linear"
    )
    tests = [ShakeTest(*pair) for pair in zip(pulses, fell, strict=True)]
    found = rocking.validate(tests, calibration)
    np.testing.assert_allclose([t.probability for t in found.tests], calibration.predict(pulses), rtol=1e-12)
    assert found.model == "linear" and found.scores.brier == pytest.approx(found.brier.value)
    validation = calibration.cross_validate(fold_count=2, repeat_count=2)
    assert [t.probability for t in rocking.validate(tests, validation).tests] == pytest.approx(
        validation.probabilities.mean(axis=0).tolist()
    )
    with pytest.raises(OptionError, match="a calibration contains its own weights"):
        rocking.validate(tests, calibration, weights=[1.0])
    with pytest.raises(OptionError, match="of 4 tests; got 3 tests"):
        rocking.validate(tests[:3], validation)


def test_a_known_block_is_certain_and_a_lapse_is_not():
    tests = [ShakeTest(STRONG, False), ShakeTest(WEAK, False)]
    found = rocking.validate(tests, BLOCK)
    assert [test.probability for test in found.tests] == [1.0, 0.0] and math.isinf(found.log_loss.value)
    assert any("a certain prediction failed" in note for note in found.notes)
    assert any("no test overturned" in note for note in found.notes) and math.isnan(found.brier.skill)
    include_outliers = rocking.validate(tests, BLOCK, outlier_probability=0.01)
    assert [test.probability for test in include_outliers.tests] == pytest.approx([0.99, 0.01])
    assert "all tests overturned" in rocking.validate([ShakeTest(STRONG, True)], BLOCK).summary()


def test_vertical_motion_and_weights_and_the_model_count():
    blocks = Blocks(2.0, [0.1, 0.4], 0.9)
    lifted = STRONG.with_vertical(rocking.pulses.one_sine(30.0, 1.0))
    simulated = rocking.simulate_many(blocks, [lifted, STRONG], model="linear")
    tests = [ShakeTest(one, True) for one in (lifted, STRONG)]
    found = rocking.validate(tests, blocks, weights=[1.0, 3.0], model="linear")
    shares = np.array([0.25, 0.75]) @ simulated.overturned.transpose("block", "motion").values
    effective = 1.0 / (0.25**2 + 0.75**2)
    assert [test.probability for test in found.tests] == pytest.approx((effective * shares + 0.5) / (effective + 1.0))
    assert found.brier.cluster_count == 2  # motions that differ in the vertical component alone are two


def test_a_simulation_that_was_given_up_counts_as_half_overturned(small_budget):
    restless = Block.from_parameters(p=2.0, alpha=0.2, restitution=1.0 - 1e-9)
    found = rocking.validate([ShakeTest(STRONG.scaled(0.4), False)], restless)
    assert found.tests[0].probability == pytest.approx(0.5)


# What is refused


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"overturned": "yes"}, "overturned must be True or False, not 'yes'"),
        ({"overturned": None}, "overturned must be True or False, not None"),
        ({"overturned": True, "group": 3}, "group must be text, not 3"),
    ],
)
def test_what_is_no_outcome_is_no_test(given, sentence):
    with pytest.raises(OptionError, match=sentence):
        ShakeTest(STRONG, **given)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"tests": []}, "tests must contain at least one test"),
        ({"tests": [STRONG]}, "tests must contain ShakeTest"),
        ({"weights": [1.0, 2.0]}, "weights must contain 1 nonnegative numbers"),
        ({"outlier_probability": 0.7}, "outlier_probability must be a number from 0 to 0.5"),
        ({"simulation_count": 3}, "simulation_count must be a whole number of at least 100"),
        ({"blocks": rocking.dynamics.BouncingBall(0.9)}, "slenderness is defined for blocks only"),
    ],
)
def test_what_cannot_be_judged_is_refused_in_a_sentence(change, sentence):
    given = {"tests": [ShakeTest(STRONG, True)], "blocks": BLOCK} | change
    with pytest.raises(OptionError, match=sentence):
        rocking.validate(given.pop("tests"), given.pop("blocks"), **given)


# Tables


def written(path, text):
    path.write_text(text, "utf-8")
    return path


def test_a_table_of_tests_is_read_with_its_units_and_labels(tmp_path):
    times = 0.01 * np.arange(50)
    samples = np.sin(2.0 * np.pi * times)
    (tmp_path / "one.txt").write_text("\n".join(f"{value:.6f}" for value in samples), "utf-8")
    rows = [
        "motion,scale,dt_s,units,vertical,name,group,overturned,remark",
        "one.txt,2,0.01,g,,first,G1,no,",
        "one.txt,-1,0.02,m/s2,,,,1,fell late",
        "el-centro-meloland-270,0.5,,,el-centro-meloland-up,,,false,",
        '"one-sine:amplitude=0.2g,frequency=2Hz",,,,,,,yes,',
    ]
    tests = rocking.read_tests(written(tmp_path / "tests.csv", "\n".join(rows)))
    first, second, third, fourth = tests
    assert (first.name, first.group) == ("first", "G1")
    assert [test.overturned for test in tests] == [False, True, False, True]
    peak = float(f"{samples.max():.6f}")
    assert first.motion.pga == pytest.approx(2.0 * 9.80665 * peak) and first.motion.dt == pytest.approx(0.01)
    assert second.motion.pga == pytest.approx(peak) and second.motion.dt == pytest.approx(0.02)
    up = rocking.records.load("el-centro-meloland-up")
    assert third.motion.vertical.pga == pytest.approx(0.5 * up.pga)
    assert fourth.motion.pga == pytest.approx(0.2 * 9.80665)


@pytest.mark.parametrize(
    ("text", "line", "sentence"),
    [
        ("motion,fell\nx,1", 1, "the columns must include motion and overturned"),
        (
            "motion,overturned,specimen\nridgecrest-clc-090,1,a\nridgecrest-clc-090,1,b",
            1,
            "of 2 specimens; use one table for each",
        ),
        ("motion,overturned,overturned\nx,1,1", 1, "must be distinct"),
        ("motion,overturned\nno-such-file.txt,1", 2, "no-such-file.txt"),
        ("motion,overturned\n,1", 2, "this is a folder; choose a record file"),
        ("motion,overturned\nridgecrest-clc-090,perhaps", 2, "'perhaps' is not 0 or 1"),
        ("motion,overturned\nridgecrest-clc-090,1\nridgecrest-clc-090,", 3, "'' is not 0 or 1"),
        ("motion,overturned,scale\nridgecrest-clc-090,1,inf", 2, "'inf' is not a number"),
        ("motion,overturned,dt_s\nridgecrest-clc-090,1,x", 2, "'x' is not a number"),
        ("motion,overturned,vertical\nridgecrest-clc-090,1,nothing", 2, "nothing"),
        ("motion,overturned", None, "no rows"),
    ],
)
def test_a_wrong_row_is_named_by_its_line(tmp_path, text, line, sentence):
    with pytest.raises(RecordError, match=sentence) as caught:
        rocking.read_tests(written(tmp_path / "tests.csv", text))
    assert caught.value.line == line and "\n" not in str(caught.value)


def test_the_command_writes_figure_tables_and_numbers(run, undrawn, tmp_path):
    rows = "motion,scale,overturned", "ridgecrest-clc-090,0.5,0", "ridgecrest-clc-090,0.6,0", "ridgecrest-clc-090,2,1"
    table, sizes = written(tmp_path / "tests.csv", "\n".join(rows)), ("--width", "0.24", "--height", "1.1")
    code, out, err = run("validate", table, *sizes, "--outlier-probability", "0.01", "--out", tmp_path / "out")
    assert (code, err) == (0, "") and "3 tests, 1 overturned" in out
    files = {"result.json", "tests.csv", "validation.png", "validation.pdf"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == files
    result = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    direct = rocking.validate(rocking.read_tests(table), Block(width=0.24, height=1.1), outlier_probability=0.01)
    assert result["brier"]["value"] == pytest.approx(direct.brier.value)
    lines = (tmp_path / "out" / "tests.csv").read_text("utf-8").splitlines()
    assert lines[0] == "name,motion,overturned,probability" and len(lines) == 4
    code, _, err = run("validate", table)
    assert code == 2 and "a block is required" in err


def test_predictions_of_tests_that_were_left_out_take_no_lapse_and_no_weights():
    for name, given in (("outlier_probability", 0.3), ("weights", [1.0, 1.0])):
        with pytest.raises(OptionError, match=f"{name} cannot be combined"):
            rocking.validate(of_outcomes([0, 1]), left_out([0.2, 0.3]), **{name: given})
