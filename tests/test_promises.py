"""The promises of docs/reliability.md at a small size, and the program that runs them."""

import pytest
from promises import chattering, containment, cross_code, events, one_answer


@pytest.mark.thorough
def test_responses_are_within_the_stated_error(monkeypatch):
    monkeypatch.setattr(containment, "CASES", 12)
    found = containment.judge(0)
    assert not found.told
    assert found.judged >= 10
    assert found.notes["rotations"] >= 30
    assert found.worst <= 1.0


@pytest.mark.parametrize("cases", [2, pytest.param(12, marks=pytest.mark.thorough)])
def test_no_event_is_missed_and_none_is_made_up(monkeypatch, cases):
    monkeypatch.setattr(events, "CASES", cases)
    found = events.judge(0)
    assert not found.told
    assert found.cases == cases * len(events.KINDS)
    assert found.judged >= 0.7 * found.cases
    assert found.worst <= 1.0


@pytest.mark.parametrize("cases", [3, pytest.param(15, marks=pytest.mark.thorough)])
def test_every_rest_is_in_its_bracket_at_a_bounded_cost(monkeypatch, cases):
    monkeypatch.setattr(chattering, "CASES", cases)
    monkeypatch.setattr(chattering, "NEXT_TO_BALANCE", {"linear": cases, "nonlinear": 2})
    found = chattering.judge(0)
    assert not found.told
    assert found.judged == 2 * cases + 2
    resolved, followed = (found.notes[f"{row} at 1e-12"] for row in ("resolved", "one by one"))
    assert resolved < 0.5 * followed


@pytest.mark.slow
def test_another_code_agrees_on_whole_analyses(monkeypatch):
    monkeypatch.setattr(cross_code, "BLOCKS", 30)
    found = cross_code.judge(3)
    found.add(cross_code.judge(4))
    assert not found.told
    assert found.judged >= 55
    assert sum(found.notes[f"{row}: impacts"] for row in ("record, nonlinear", "noise, linear")) >= 1000
    assert found.worst <= 1.0


@pytest.mark.thorough
def test_an_ensemble_has_one_answer(monkeypatch):
    monkeypatch.setattr(one_answer, "BLOCKS", 30)
    found = one_answer.judge(1)
    assert not found.told
    assert found.judged == 8
