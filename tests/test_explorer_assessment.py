"""The assessment of a case's block: that of the package, of which the page shows sentences, a curve and a list."""

import numpy as np
import pytest

import rocking
from rocking.assessment.page import describe_object
from rocking.explorer.assessment import assess_case, describe_assessment
from rocking.explorer.core import EXPORTS, Explorer, Query
from rocking.explorer.inputs import read_case
from rocking.explorer.uploads import UploadStore

STATUE = {"width": "0.24", "height": "1.1", "motion": "el-centro-meloland-270"}
LEANING = {"width": "0.24", "height": "1.1", "offset": "0.01", "model": "linear", "motion": "none"}
PLAIN = "motion=el-centro-meloland-270;motion=ridgecrest-tow2-360;motion=ridgecrest-clc-360"
RISING = "motion=el-centro-meloland-270&vertical=el-centro-meloland-up;" + PLAIN
LEVELS = {"level_from": "0.2g", "level_to": "0.9g", "levels": "6"}


def assessed(case, **texts):
    store = UploadStore()
    return assess_case(read_case(case, store), texts, store)


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize(
    ("case", "texts"),
    [
        (STATUE, {"records": RISING, **LEVELS}),
        (LEANING, {"records": PLAIN, **LEVELS, "measure": "sa", "measure_period": "0.5"}),
        ({**STATUE, "friction": "0.3"}, {"records": PLAIN}),
    ],
    ids=["vertical", "two sides", "friction"],
)
def test_the_page_shows_what_its_script_computes(case, texts, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found, names = assessed(case, **texts), {}
    payload = describe_assessment(found)
    exec(payload.header["python"], names)
    expected = names["assessment"]
    item, data = expected.objects[0], expected.data.isel(block=0)
    assert payload.header["statements"] == describe_object(expected, 0)
    assert np.array_equal(payload.arrays["levels"], item.levels)
    assert np.array_equal(payload.arrays["share"], item.share.mean(axis=1))
    assert np.array_equal(payload.arrays["probability"], item.curve.probability(payload.arrays["at"]))
    lower, upper = item.curve.band(payload.arrays["at"])
    assert np.array_equal(payload.arrays["lower"], lower) and np.array_equal(payload.arrays["upper"], upper)
    rows = payload.header["records"]
    assert [row["number"] for row in rows] == [*range(len(rows))] and len(rows) >= 3
    for k, row in enumerate(rows):
        for name in ("overturned", "undecided", "peak_over_alpha", "stands_up_to", "overturns_at"):
            assert row[name] == data[name].values[k], (row["name"], name)
    assert (tmp_path / "report.html").read_text("utf-8").startswith("<!DOCTYPE html>")


def test_components_of_one_station_count_together():
    two = "motion=el-centro-meloland-270;motion=el-centro-meloland-360;motion=ridgecrest-clc-360"
    assert "clusters=[0, 0, 1]" in assessed(STATUE, records=two, **LEVELS).script
    assert "clusters" not in assessed(STATUE, records=PLAIN, **LEVELS).script


def test_a_record_that_cannot_be_used_does_not_stop_the_others():
    found = assessed(STATUE, records=f"motion=file:00;{PLAIN};motion=ridgecrest-clc-360&scale=0", **LEVELS)
    header = describe_assessment(found).header
    assert len(header["records"]) == 3 and [row["number"] for row in header["records"]] == [1, 2, 3]
    assert len(header["failures"]) == 2 and any("not here any more" in each for each in header["failures"])


def test_the_report_and_the_numbers_are_exported():
    explorer = Explorer()
    query = {**STATUE, "records": PLAIN, **LEVELS}
    explorer.answers["assessment"](Query(query))
    report = explorer.answers["export"](Query({**query, "form": "report.html"})).decode()
    assert "<h2>1. block</h2>" in report and "Half of the motions overturn it" in report
    assert explorer.answers["export"](Query({**query, "form": "assessment.nc"})).startswith(b"\x89HDF")
    assert {"report.html", "assessment.nc"} <= {*EXPORTS}


@pytest.mark.thorough
@pytest.mark.parametrize("measure", ["pga", "sa"])
def test_levels_go_from_where_a_record_lifts_the_block_to_where_most_overturn_it(measure):
    found = assessed(STATUE, records=PLAIN, measure=measure, levels="10").result.objects[0]
    assert len(found.levels) == 10 and found.share[0].mean() < 0.4 and found.share[-1].mean() >= 0.9
    weak = assessed(STATUE, records=PLAIN, level_from="0.01g", level_to="0.02g")
    payload = describe_assessment(weak)
    assert "probability" not in payload.arrays and "No fragility curve" in " ".join(payload.header["statements"])


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        ({}, "tick one or more"),
        ({"records": PLAIN, "measure": "pgd"}, "one of pga, sa"),
        ({"records": PLAIN, "levels": "61"}, "from 2 to 60"),
        ({"records": PLAIN, "levels": "nan"}, "from 2 to 60"),
        ({"records": PLAIN, "level_from": "2g", "level_to": "1g"}, "positive and increasing"),
        ({"records": "motion=none"}, "no motion|at least one"),
        ({"records": PLAIN, "level_from": "1"}, "level_to"),
    ],
)
def test_what_cannot_be_assessed_is_refused_in_a_sentence(texts, words):
    with pytest.raises(rocking.RockingError, match=words):
        assessed(STATUE, **texts)


def test_a_block_that_hardly_comes_to_rest_is_refused_whatever_the_duration_of_the_case():
    with pytest.raises(rocking.RockingError, match="hardly comes to rest: lower it"):
        assessed({**STATUE, "restitution": "1", "duration": "10"}, records=PLAIN, **LEVELS)
