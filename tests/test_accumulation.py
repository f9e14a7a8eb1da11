"""The accumulation benchmark: its cases against 50 digits, its scorer, its page against the answers that are kept."""

import importlib.util
import json
import re
from pathlib import Path

import pytest
from mpmath import mp
from oracles.accumulation import Followed

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "benchmarks" / "accumulation"
CASES = {case["name"]: case for case in json.loads((FOLDER / "cases.json").read_text("utf-8"))}
ANSWERS = sorted((FOLDER / "answers").glob("*.json"))

#: Followed by every run of the tests: those of which few impacts have to be followed.
QUICK = [name for name, case in CASES.items() if case["restitution"] < 0.6 and len(case["rests"]) <= 3][1::2]


def loaded(name):
    specification = importlib.util.spec_from_file_location(f"accumulation_{name}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def score():
    return loaded("score")


def judged(names):
    """Compare cases with 50 digits; returns how many rests and impacts were compared."""
    rests = impacts = 0
    with mp.workdps(50):
        for name in names:
            case, known = CASES[name], Followed(CASES[name])
            assert len(known.rests) == len(case["rests"]), name
            for row, time in zip(case["rests"], known.rests, strict=True):
                assert row["lower"] <= time <= row["upper"], name
                assert row["upper"] - row["lower"] < 1e-10
                assert abs(row["time"] - time) < 2e-12, name
                rests += 1
            assert case["count"] in (None, len(known.impacts)), name
            for time, exact in zip(case["impacts"], known.impacts, strict=False):
                # Rounding grows from impact to impact: most in pendulum-never-1, to 3.1e-9 s.
                assert abs(time - exact) < 4e-9, name
                impacts += 1
    return rests, impacts


#: Of each body one.
FEW = ["ball-several-3", "oscillator-rest-2", "pendulum-rest-5", "block-free-2"]


@pytest.mark.parametrize("names", [FEW, pytest.param(QUICK, marks=pytest.mark.thorough)], ids=["few", "some"])
def test_brackets_hold_the_rests_of_50_digits(names):
    rests, impacts = judged(names)
    assert len(QUICK) >= 11 and len(names) >= 4
    assert rests > 15 * len(names) / 12 and impacts > 80 * len(names) / 12


@pytest.mark.slow
def test_all_brackets_hold_the_rests_of_50_digits():
    rests, impacts = judged(CASES)
    assert rests == sum(len(case["rests"]) for case in CASES.values()) > 200 and impacts > 1500


@pytest.mark.parametrize("names", [QUICK, pytest.param([*CASES], marks=pytest.mark.slow)], ids=["some", "all"])
def test_the_cases_are_what_is_computed_today(names):
    made = loaded("make_cases")
    assert len(names) >= 4
    for case in map(CASES.get, names):
        found, rests = made.solved(case), made.bracketed(case)
        assert found["impacts"] == pytest.approx(case["impacts"], abs=1e-8)
        assert (found["count"], len(rests)) == (case["count"], len(case["rests"]))
        assert [row["time"] for row in rests] == pytest.approx([row["time"] for row in case["rests"]], abs=1e-10)


@pytest.mark.thorough
def test_the_page_shows_what_the_answers_are_worth(score):
    programs, cases = score.read([])
    assert len(programs) == len(ANSWERS) >= 2
    tables = ROOT / "docs" / "_tables"
    assert (tables / "accumulation.txt").read_text("utf-8") == score.main_table(programs, cases)
    assert (tables / "accumulation-families.txt").read_text("utf-8") == score.family_table(programs, cases)
    page = (ROOT / "docs" / "accumulation.md").read_text("utf-8")
    assert set(re.findall(r"_tables/(\S+)", page)) == {"accumulation.txt", "accumulation-families.txt"}
    assert (ROOT / "docs" / "_static" / "accumulation.png").is_file()
    for program in programs:
        assert program["settings"] in " ".join(page.split()) or program["program"] == "rocking"
