"""The promises of docs/reliability.md at a small size, and the program that runs them."""

import re
from pathlib import Path

import pytest
import verify
from promises import ALL, containment
from promises.promise import Found, Promise

ROOT = Path(__file__).parents[1]


def judge(part: int) -> Found:
    """Judge a case that fails in part 2."""
    found = Found(parts=1, cases=1, judged=1, worst=float(part))
    if part == 2:
        found.fail("two")
    return found


MADE_UP = Promise("made-up", "a promise made up", 4, 1, judge)


@pytest.mark.thorough
def test_responses_are_within_the_stated_error(monkeypatch):
    monkeypatch.setattr(containment, "CASES", 20)
    found = containment.judge(0)
    assert not found.told
    assert found.judged >= 17
    assert found.notes["rotations"] >= 50
    assert found.worst <= 1.0


def test_parts_add_up_and_a_failure_is_told():
    total = Found()
    for part in range(4):
        total.add(judge(part))
    assert (total.parts, total.cases, total.failures, total.worst) == (4, 4, 1, 3.0)
    assert MADE_UP.faults(total) == ["made-up: two"]


def test_too_few_decided_cases_are_a_fault():
    assert MADE_UP.faults(Found(cases=3, judged=2)) == ["made-up: only 2 of 3 cases were decided"]


def test_the_page_tells_of_every_promise_and_shows_its_table():
    page = (ROOT / "docs" / "reliability.md").read_text("utf-8")
    tables = {f"reliability-{name}.txt" for name in ("all", "made", *(n for n, each in ALL.items() if each.table))}
    assert set(re.findall(r"_tables/(\S+)", page)) == tables
    for name in ALL:
        assert f"`python stress/verify.py {name}`" in page
    whole = (ROOT / "docs" / "_tables" / "reliability-all.txt").read_text("utf-8")
    for promise in ALL.values():
        assert f"| {promise.says} | " in whole


def test_what_is_kept_is_known_by_its_sources(monkeypatch, tmp_path):
    promise = ALL["containment"]
    before = verify.key(promise)
    assert before == verify.key(promise)
    changed = tmp_path / "containment.py"
    changed.write_text(Path(containment.__file__).read_text("utf-8") + "\n", "utf-8")
    monkeypatch.setattr(containment, "__file__", str(changed))
    assert verify.key(promise) != before
