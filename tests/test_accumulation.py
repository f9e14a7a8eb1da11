"""The accumulation benchmark: its cases against 50 digits."""

import importlib.util
import json
from pathlib import Path

import pytest
from mpmath import mp
from oracles.accumulation import Followed

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "benchmarks" / "accumulation"
CASES = {case["name"]: case for case in json.loads((FOLDER / "cases.json").read_text("utf-8"))}

#: Followed by every run of the tests: those of which few impacts have to be followed.
QUICK = [name for name, case in CASES.items() if case["restitution"] < 0.6][2::4]


def loaded(name):
    specification = importlib.util.spec_from_file_location(f"accumulation_{name}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


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


def test_brackets_hold_the_rests_of_50_digits():
    rests, impacts = judged(QUICK)
    assert len(QUICK) >= 11 and rests > 25 and impacts > 80


@pytest.mark.slow
def test_all_brackets_hold_the_rests_of_50_digits():
    rests, impacts = judged(CASES)
    assert rests == sum(len(case["rests"]) for case in CASES.values()) > 200 and impacts > 1500


def test_there_are_a_hundred_cases_from_easy_to_cruel():
    assert len(CASES) == 100
    counts = {(case["body"], case["family"]) for case in CASES.values()}
    assert len(counts) == 4 * 7
    assert max(case["restitution"] for case in CASES.values()) == 0.99
    assert sum(not case["rests"] for case in CASES.values()) >= 4
    assert sum(len(case["rests"]) > 1 for case in CASES.values()) >= 20


def test_the_cases_are_what_is_computed_today():
    made = loaded("make_cases")
    for case in CASES.values():
        found, rests = made.solved(case), made.bracketed(case)
        assert found["impacts"] == pytest.approx(case["impacts"], abs=1e-8)
        assert (found["count"], len(rests)) == (case["count"], len(case["rests"]))
        assert [row["time"] for row in rests] == pytest.approx([row["time"] for row in case["rests"]], abs=1e-10)
