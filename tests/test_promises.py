"""The promises of docs/reliability.md at a small size, and the program that runs them."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from oracles import leapfrog, multiprecision
from oracles.problem import Problem, linear_record
from promises import chattering, containment, cross_code, events, exact, one_answer

ROOT = Path(__file__).parents[1]


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


@pytest.mark.slow
def test_the_other_code_agrees_with_many_digits():
    """Short records of all kinds; what does not overturn has the same peak to some thousand units of rounding."""
    worst, moved, fell = 0.0, 0, 0
    for number in range(24):
        rng = np.random.default_rng([67, number])
        p, alpha, e = (tuple(rng.uniform(low, high, 2).tolist()) for low, high in ((1, 6), (0.1, 0.3), (0.5, 0.9)))
        step, count, model = 0.05, int(rng.integers(10, 40)), ("linear", "nonlinear")[number % 2]
        across = 9.80665 * min(alpha) * np.append(rng.normal(0.0, rng.uniform(0.8, 2.0), count), 0.0)
        up = 9.80665 * np.append(rng.uniform(-0.5, 0.5, count) * (number % 3 == 0), 0.0)
        found = leapfrog.follow(model, p, alpha, e, step, across, up)
        problem = Problem(model, p, alpha, e, *linear_record(across, step), vertical=linear_record(up, step))
        true = multiprecision.follow(problem, closest=1e-6, digits=32)
        assert found.overturned == true.overturned
        assert found.rests == sum(event[1] == "rest" for event in true.events)
        moved, fell = moved + (true.peak > 0), fell + true.overturned
        if not true.overturned:
            worst = max(worst, abs(found.peak - float(true.peak)))
    assert moved >= 20
    assert fell >= 2
    assert worst < 1e-12


@pytest.mark.thorough
def test_an_ensemble_has_one_answer(monkeypatch):
    monkeypatch.setattr(one_answer, "BLOCKS", 30)
    found = one_answer.judge(1)
    assert not found.told
    assert found.judged == 8


def test_the_closed_form_of_a_rest_is_the_sum_of_its_impacts():
    sides = exact.Side(2.0, 0.2, 0.6), exact.Side(3.0, 0.1, 0.5)
    time, speed = next(itertools.islice(exact.impacts(sides, 0.3, 0.2, 1), 60, None))
    assert abs(exact.rest(sides, 0.3, 0.2, 1) - time) < 10.0 * speed
    assert abs(exact.rest(sides, 0.3, float(speed), 0) + time - exact.rest(sides, 0.3, 0.2, 1)) < 1e-30
