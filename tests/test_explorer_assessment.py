"""The assessment of a case's block: the package's own fragility bit for bit, friction, rules of thumb, margin."""

import numpy as np
import pytest
from explorer_texts import in_english

import rocking
from rocking.explorer.assessment import describe_assessment, read_assessment, simulate_records
from rocking.explorer.inputs import read_case
from rocking.explorer.uploads import UploadStore

STATUE = {"width": "0.24", "height": "1.1", "motion": "el-centro-meloland-270"}
LEANING = {"width": "0.24", "height": "1.1", "offset": "0.01", "model": "linear", "motion": "none"}
FEW = {"records": "motion=el-centro-meloland-270", "level_from": "0.2g", "level_to": "0.9g", "levels": "2"}
PLAIN = "motion=el-centro-meloland-270;motion=ridgecrest-tow2-360;motion=ridgecrest-clc-360"
RISING = "motion=el-centro-meloland-270&vertical=el-centro-meloland-up;" + PLAIN
LEVELS = {"level_from": "0.2g", "level_to": "0.9g", "levels": "6"}


def assessed(case, **texts):
    store = UploadStore()
    return read_assessment(read_case(case, store), texts, store)


def last(found):
    *_, part = simulate_records(found)
    return part


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize(
    ("case", "texts"),
    [
        (STATUE, {"records": RISING, **LEVELS}),
        (LEANING, {"records": PLAIN, **LEVELS, "measure": "sa", "measure_period": "0.5"}),
    ],
    ids=["vertical", "two sides"],
)
def test_the_curve_is_that_of_the_script_to_the_last_bit(case, texts):
    found = assessed(case, **texts)
    names = {}
    exec(describe_assessment(found)["python"], names)
    curve, part = names["found"].curves[0], last(found)
    fit = part.header["fit"]
    assert (fit["median"], fit["dispersion"]) == (curve.median, curve.dispersion)
    assert fit["median_interval"] == [*curve.median_interval]
    assert fit["dispersion_interval"] == [*curve.dispersion_interval]
    at = part.arrays["at"]
    assert np.array_equal(part.arrays["probability"], curve.probability(at))
    lower, upper = curve.band(at)
    assert np.array_equal(part.arrays["lower"], lower) and np.array_equal(part.arrays["upper"], upper)
    assert part.header["outcomes"] == len(names["found"].outcomes) and fit["exceeded"] == curve.exceeded.sum()
    assert 0 < fit["exceeded"] < part.header["outcomes"]
    undecided, *notes = names["found"].notes  # the page counts no undecided outcomes
    assert undecided.startswith("undecided within 3e-6") and fit["notes"] == notes


def test_every_record_adds_a_row_of_its_own_and_the_curve_so_far():
    found = assessed(STATUE, records=RISING, **LEVELS)
    block, rows = rocking.Block(width=0.24, height=1.1), [part.header for part in simulate_records(found)]
    assert [row["share"] for row in rows] == [0.2, 0.4, 0.6, 0.8, 1.0]
    up = rocking.records.load("el-centro-meloland-up")
    motions = [rocking.records.load(name) for name in ("el-centro-meloland-270",) * 2 + ("ridgecrest-tow2-360",)]
    judged = 0
    for motion, header in zip([motions[0].with_vertical(up), *motions[1:]], rows[:3], strict=True):
        row, response = header["row"], rocking.simulate(block, motion)
        assert row["overturns"] == response.overturned
        assert row["friction_needed"] == response.required_friction
        assert row["ratios"]["west"] == rocking.rules.west(block, motion).ratio[0]
        assert row["ratios"]["ishiyama"] == rocking.rules.ishiyama(block, motion).ratio[0]
        assert len(row["overturned_levels"]) == 6
        judged += 1
    assert judged == 3
    about = describe_assessment(found)
    assert about["friction_to_rock"] == pytest.approx(0.24 / 1.1, rel=1e-12)
    assert about["thresholds"] == list(block.uplift_thresholds())
    assert [each["phrase"] for each in about["notes"]] == [
        "assessment.symmetric", "assessment.stations", "assessment.vertical", "assessment.first",
    ]  # fmt: skip
    assert {rule["name"] for rule in about["rules"]} == {*about["case"]["ratios"]} == {"uplift", "west", "ishiyama"}


def test_the_margin_is_the_critical_scale():
    margin = last(assessed(STATUE, records=PLAIN, **LEVELS)).header["margin"]
    block, motion = rocking.Block(width=0.24, height=1.1), rocking.records.load("el-centro-meloland-270")
    assert rocking.simulate(block, motion * margin["factor"]).overturned
    assert not rocking.simulate(block, motion * (margin["factor"] * (1.0 - 1e-6))).overturned
    assert margin["pga"] == pytest.approx(margin["factor"] * motion.pga)
    assert last(assessed(LEANING, records=PLAIN, **LEVELS)).header["margin"] is None


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("width", "height", "name"), [("0.24", "1.1", "ridgecrest-clc-090"), ("0.3", "2.0", "ridgecrest-tow2-360")]
)
def test_the_margin_is_the_lowest_band_of_an_incremental_dynamic_analysis(width, height, name):
    assessment = assessed({"width": width, "height": height, "motion": name}, **FEW)
    margin = last(assessment).header["margin"]
    block, motion = rocking.Block(width=float(width), height=float(height)), rocking.records.load(name)
    found = rocking.incremental_dynamic_analysis(block, motion)
    bands = found.bands()
    assert len(bands) > 2 and margin["pga"] == pytest.approx(bands[0][0], rel=1e-6)
    (note,) = (each for each in describe_assessment(assessment)["notes"] if each["phrase"] == "assessment.first")
    levels = found.data.level.values
    assert levels[1] / levels[0] == pytest.approx(1.0 + note["values"]["step"] / 100.0)


def test_a_block_that_no_level_overturns_has_no_margin_up_to_the_highest_level_looked_at():
    case = {"width": "2", "height": "8", "motion": "half-sine:amplitude=1g,frequency=3000"}
    margin = last(assessed(case, **FEW)).header["margin"]
    block, motion = rocking.Block(width=2.0, height=8.0), rocking.pulses.half_sine(9.80665, 3000.0)
    assert margin["factor"] is None and margin["pga"] > 400.0 * block.uplift_thresholds()[0]
    assert not rocking.simulate(block, motion.scaled_to(margin["pga"])).overturned


@pytest.mark.thorough
def test_the_margin_has_the_treatment_of_the_case():
    treated = {**STATUE, "motion": "ridgecrest-clc-090", "chattering": "velocity=0.5"}
    found, plain = (
        last(assessed(case, **FEW)).header["margin"]["factor"] for case in (treated, {**treated, "chattering": ""})
    )
    block, motion = rocking.Block(width=0.24, height=1.1), rocking.records.load("ridgecrest-clc-090")
    assert found != pytest.approx(plain, rel=1e-3)
    assert rocking.simulate(block, motion * found, chattering="velocity=0.5").overturned
    assert not rocking.simulate(block, motion * (found * (1.0 - 1e-6)), chattering="velocity=0.5").overturned


@pytest.mark.thorough
def test_levels_go_from_where_a_record_lifts_the_block_to_where_most_overturn_it():
    for measure in ("pga", "sa"):
        found = assessed(STATUE, records=PLAIN, measure=measure, levels="4")
        assert len(found.levels) == 4 and 0.0 < found.levels[0] < found.levels[-1]
        seen = last(found).arrays["seen"]
        assert seen[0] == 0.0 and seen[-1] > 0.5
    weak = last(assessed(STATUE, records=PLAIN, level_from="0.01g", level_to="0.02g"))
    assert weak.header["fit"] is None and "No curve can be fitted yet" in in_english(weak.header["why"])


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        ({}, "tick one or more"),
        ({"records": PLAIN, "measure": "pgd"}, "pga or sa"),
        ({"records": PLAIN, "levels": "61"}, "from 2 to 60"),
        ({"records": PLAIN, "levels": "nan"}, "from 2 to 60"),
        ({"records": PLAIN, "level_from": "2g", "level_to": "1g"}, "below the last"),
        ({"records": "motion=none"}, "shakes nothing"),
        ({"records": "0"}, "names no motion"),
        ({"records": "key=x"}, "names no motion"),
        ({"records": "motion=file:00"}, "not here any more"),
        ({"records": PLAIN, "level_from": "1", "level_to": "1e40"}, "must stay below"),
    ],
)
def test_what_cannot_be_assessed_is_refused_in_a_sentence(texts, words):
    with pytest.raises(rocking.RockingError, match=words):
        last(assessed(STATUE, **texts))


def test_a_block_that_hardly_comes_to_rest_is_refused_whatever_the_duration_of_the_case():
    with pytest.raises(rocking.RockingError, match="hardly comes to rest: lower it"):
        assessed({**STATUE, "restitution": "1", "duration": "10"}, records=PLAIN, **LEVELS)
