"""Responses under vertical motion, weights through zero included, judged by many digits; and the judge by others.

    python tests/test_vertical_exact.py --cases 2000 --seed 1 [--first 0]

judges as many, prints what was drawn and every fault, and exits with status 1 if there is one.
"""

import argparse
import sys
import time

import numpy as np
import pytest
from oracles import multiprecision, scipy_events, vertical_referee
from oracles.multiprecision import Course
from oracles.problem import Problem
from oracles.vertical_referee import Case, Verdict

from rocking import Block, Motion, simulate

G = vertical_referee.GRAVITY
QUICK, LONGER, LONG = 4, (10, 40), 2_000
MODELS = pytest.mark.parametrize("model", ["linear", "nonlinear"])


def judged(seed: int, count: int, *, first: int = 0) -> Verdict:
    verdict = Verdict()
    for number in range(first, first + count):
        verdict.add(vertical_referee.judge(vertical_referee.case(seed, number)))
    return verdict


def said(verdict: Verdict) -> str:
    worst = sorted(verdict.faults, key=lambda fault: -fault.excess)[:5]
    return "\n".join([f"{len(verdict.faults)} faults in {verdict.cases} cases", *map(str, worst)])


def assert_without_fault(verdict: Verdict) -> None:
    assert not verdict.faults, said(verdict)
    # Enough of what was drawn must be decided for the comparison to mean anything.
    assert verdict.ambiguous <= 0.1 * verdict.cases
    assert sum(verdict.skipped.values()) + verdict.not_followed <= 0.01 * verdict.cases
    assert verdict.ties <= 0.1 * verdict.cases
    assert verdict.overturned <= 0.6 * verdict.judged
    assert verdict.never_up <= 0.2 * verdict.judged


def of(block: Block, motion: Motion, model: str, **initial: float) -> Case:
    pairs = (tuple(getattr(side, name) for side in block.sides) for name in ("p", "alpha", "restitution"))
    return Case(0, 0, "given", model, *pairs, motion, **initial)


def followed(case: Case, **options: float) -> Course:
    return multiprecision.follow(case.problem, rotation=case.rotation, velocity=case.velocity, **options)


# --- what simulations say -------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [QUICK, *(pytest.param(count, marks=pytest.mark.thorough) for count in LONGER)])
def test_responses_under_vertical_motion_are_right(count: int) -> None:
    assert_without_fault(judged(4, count))


@pytest.mark.slow
def test_responses_under_vertical_motion_are_right_at_length() -> None:
    assert_without_fault(judged(1, LONG))


def assert_right(case: Case) -> None:
    verdict = vertical_referee.judge(case)
    assert verdict.judged == 1
    assert not verdict.faults, said(verdict)


@pytest.mark.parametrize("number", [7792, 11838])
def test_no_rounding_adds_up_on_the_way(number: int) -> None:
    """Pieces of a high degree that a breakpoint of the other component cuts; and a piece of many short steps."""
    verdict = vertical_referee.judge(vertical_referee.case(2024, number))
    assert verdict.judged == 1
    assert not verdict.faults, said(verdict)
    assert verdict.units <= 4.0


BLOCK = Block.from_parameters(p=1.0, alpha=0.2, restitution=0.8)
STILL = Motion.from_samples([0.0, 0.0], 1.0)
DIP = Motion.from_points([0.0, 0.1, 0.4, 0.41, 0.8], [0.0, -G, -7.0 * G, 0.0, 0.0])


def test_a_block_lifted_through_zero_weight_goes_where_it_must() -> None:
    """The cubic term is the last of the first few: weight and push vanish at the start, but the weight changes."""
    response = simulate(BLOCK, STILL.with_vertical(DIP))
    assert not response.overturned
    assert response.rotation(0.4) == pytest.approx(0.01756689, abs=5e-9)
    assert response.peak_rotation == pytest.approx(0.16540, abs=5e-6)


@MODELS
@pytest.mark.parametrize(
    "push",
    [0.0, -1e-15, *(pytest.param(push, marks=pytest.mark.thorough) for push in (1e-15, 1e-3))],
    ids="{:g} g".format,
)
def test_a_block_lifted_through_zero_weight_is_followed_exactly(model: str, push: float) -> None:
    motion = Motion([0.0, 1.0], [[push * G]])
    assert_right(of(BLOCK, motion.with_vertical(DIP), model))


@pytest.mark.cases(fast=4)
@MODELS
@pytest.mark.parametrize("power", [1, 2, 3, 4, 6, 9])
def test_a_tilted_block_falls_back_as_weight_comes_from_nothing(model: str, power: int) -> None:
    """Terms that vanish one after another are not the end of a series."""
    coefficients = np.zeros(power + 1)
    coefficients[0], coefficients[power] = -G, 2.0 * G / 1.5**power
    weight = Motion([0.0, 1.5], [coefficients])
    assert_right(of(BLOCK, STILL.with_vertical(weight), model, rotation=0.05))


@pytest.mark.cases(fast=3)
@MODELS
@pytest.mark.parametrize("push", [0.0, 1e-15], ids=lambda push: f"{push:g} g")
@pytest.mark.parametrize("after", [-2.0, 1.0], ids=lambda after: f"to {after:g} g")
def test_a_tilted_block_waits_where_it_weighs_nothing(model: str, push: float, after: float) -> None:
    level = Motion.from_points([0.0, 0.5, 0.9, 1.5], [-G, -G, after * G, 0.0])
    case = of(BLOCK, Motion([0.0, 1.0], [[push * G]]).with_vertical(level), model, rotation=0.03)
    assert_right(case)
    assert case.simulate().rotation(0.5) == pytest.approx(0.03, abs=1e-14)


@pytest.mark.parametrize("count", [80, pytest.param(400, marks=pytest.mark.thorough)])
def test_a_block_that_nothing_pushes_lifts_off_to_side_plus(count: int) -> None:
    """Both thresholds are passed where its weight is zero, at instants that only rounding tells apart."""
    rng = np.random.default_rng(20)
    for number in range(count):
        alpha = tuple(rng.uniform(0.02, 0.6, 2))
        block = Block.from_parameters(p=tuple(rng.uniform(0.5, 20.0, 2)), alpha=alpha, restitution=0.5)
        start, end = rng.uniform(-0.9, 1.0), rng.uniform(-4.0, -1.1)
        weight = Motion.from_points([0.0, float(rng.uniform(0.05, 0.5)), 0.6], [start * G, end * G, 0.0])
        model = ("linear", "nonlinear")[number % 2]
        first = simulate(block, STILL.with_vertical(weight), model=model).events[0]
        assert (first["kind"], first["side"]) == ("uplift", 1), (number, first)


@pytest.mark.cases(fast=2)
@MODELS
@pytest.mark.parametrize("delay", [0.0, 0.5])
def test_a_push_that_starts_with_a_rounding_error_chooses_the_side(model: str, delay: float) -> None:
    """Pulses of high degree do so, where their first sample is zero; the block must not rotate into the ground."""
    push = Motion([0.0, 1.0], [[-1e-16, 3.0, 1e-9]])
    weight = Motion([0.0, 0.2], [[-G]])
    if delay:
        push, weight = push.delayed(delay), Motion.from_points([0.0, delay, delay + 0.2], [0.0, -G, -G])
    case = of(Block.from_parameters(p=5.0, alpha=0.1, restitution=0.5), push.with_vertical(weight), model)
    response = case.simulate()
    assert response.events["side"][0] == np.sign(response.rotation(delay + 0.01)) == -1
    assert response.overturn_time == pytest.approx(float(followed(case).events[-1][0]), abs=1e-12)


@MODELS
def test_a_touch_without_speed_is_no_impact(model: str) -> None:
    """Where the weight is less than nothing a block swings about its balance, and touches the ground once a period."""
    for alpha, lift in zip(np.linspace(0.05, 0.5, 20), np.linspace(0.2, 3.0, 20), strict=True):
        duration = 10.0 / (3.0 * np.sqrt(lift))
        weight = Motion([0.0, duration], [[-G * (1.0 + lift)]])
        block = Block.from_parameters(p=3.0, alpha=float(alpha), restitution=0.6)
        response = simulate(block, STILL.with_vertical(weight), model=model, duration=duration)
        assert not len(response.impacts), (alpha, lift, response.impacts)


LITTLE = pytest.mark.parametrize("little", [10.0**-n for n in (2, 4, 5, 6, 7, 8, 9)])


def assert_bracket_holds(case: Case) -> None:
    response = case.simulate()
    sequence, last = response._sequences[0], response.impacts[-1]
    state = float(last["time"]), int(last["side"]), float(last["speed_after"])
    rest = multiprecision.rest_time(case.problem, *state)
    assert sequence["lower"] <= rest <= sequence["upper"], float(rest - sequence["end"])
    assert sequence["upper"] - sequence["lower"] < 2e-12


@MODELS
@LITTLE
def test_a_bracket_holds_where_next_to_no_weight_is_left(model: str, little: float) -> None:
    """The sum of gravity and what takes it away has lost digits that the bracket must count."""
    block = Block.from_parameters(p=2.0, alpha=0.3, restitution=0.7)
    weight = Motion([0.0, 9.0], [[-G * (1.0 - 1.2345 * little)]])
    case = of(block, STILL.with_vertical(weight), model, velocity=0.2 * little)
    assert_bracket_holds(case)


@MODELS
@LITTLE
def test_a_bracket_holds_where_a_push_nearly_lifts_the_block(model: str, little: float) -> None:
    block = Block.from_parameters(p=2.0, alpha=0.3, restitution=0.7)
    push = block.uplift_thresholds(model)[0] * (1.0 - 1.2345 * little)
    case = of(block, Motion([0.0, 9.0], [[push]]), model, velocity=-0.2 * little)
    assert_bracket_holds(case)


# --- the judge, by itself and by others -----------------------------------------------------------------------


def drawn(number: int) -> Case:
    return vertical_referee.case(11, number)


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize(
    "number",
    [0, 12, *(pytest.param(n, marks=[pytest.mark.thorough, pytest.mark.slow][n % 2]) for n in range(24) if n % 12)],
)
def test_the_judge_says_the_same_with_more_digits_and_other_steps(number: int) -> None:
    """So 32 digits are enough: errors grow along a response, here up to the last impact that is followed."""
    case = drawn(number)
    one, other = followed(case, digits=vertical_referee.DIGITS), followed(case, digits=60, reach=0.07)
    assert [event[1:] for event in one.events] == [event[1:] for event in other.events]
    for mine, theirs in zip(one.events, other.events, strict=True):
        assert abs(mine[0] - theirs[0]) < 1e-17
    assert abs(one.peak - other.peak) < 1e-28
    # With fewer digits fewer impacts are enough for a time of rest: those up to the first one are compared.
    rest = min((event[0] for event in one.events if event[1] == "rest"), default=1e99)
    impacts = ([impact for impact in course.impacts if impact[0] < rest] for course in (one, other))
    for mine, theirs in zip(*impacts, strict=False):
        assert mine[1] == theirs[1]
        assert abs(mine[0] - theirs[0]) < 1e-22


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize(
    "number", [2, 5, *(pytest.param(n, marks=pytest.mark.thorough) for n in (0, 4, 9, 10, 12, 15, 18))]
)
def test_the_judge_agrees_with_another_integrator(number: int) -> None:
    case = drawn(number)
    course = followed(case, digits=40)
    run = scipy_events.integrate(case.problem, rotation=case.rotation, velocity=case.velocity)
    assert [event[1:] for event in run.events] == [event[1:] for event in course.events]
    for mine, theirs in zip(course.events, run.events, strict=True):
        assert float(mine[0]) == pytest.approx(theirs[0], abs=1e-8)
    assert float(course.peak) == pytest.approx(run.peak, rel=1e-9, abs=1e-13)


@pytest.mark.parametrize("model", ["linear", pytest.param("nonlinear", marks=pytest.mark.thorough)])
def test_the_judge_knows_another_gravity(model: str) -> None:
    """Three quarters of the weight taken away and half the push: p is halved, and a push counts four times."""
    numbers = (0.3, 0.25), (0.7, 0.8)
    instants = np.array([0.0, 0.7, 9.0])
    push = np.array([[1.0, -1.5], [0.0, 0.0]])
    lift = (np.array([0.0, 16.0]), np.array([[-6.0]]))
    one = Problem(model, (2.0, 3.0), *numbers, instants, push, 8.0, vertical=lift)
    other = Problem(model, (1.0, 1.5), *numbers, instants, 4.0 * push, 8.0)
    mine, theirs = (multiprecision.follow(problem, closest=1e-3) for problem in (one, other))
    assert len(mine.impacts) == len(theirs.impacts) > 3
    assert mine.events[-1][0] < 9.0
    for here, there in zip(mine.impacts, theirs.impacts, strict=True):
        assert here[1] == there[1]
        assert abs(here[0] - there[0]) < 1e-50
        assert abs(here[3] - there[3]) < 1e-50
    assert abs(mine.peak - theirs.peak) < 1e-50


def test_the_judge_finds_what_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of another block, whose frequency parameter differs in the tenth digit."""
    case = of(BLOCK, STILL.with_vertical(DIP), "linear")
    other = Block.from_parameters(p=1.0 + 1e-10, alpha=0.2, restitution=0.8)
    response = simulate(other, case.motion, model="linear")
    monkeypatch.setattr(Case, "simulate", lambda self: response)
    measures = {fault.measure for fault in vertical_referee.judge(case).faults}
    assert {"peak", "time of an impact", "time of rest"} <= measures


# --- as a script ----------------------------------------------------------------------------------------------


def printed(by_kind: dict[tuple[str, str], Verdict], total: Verdict) -> None:
    head = ("cases", "judged", "ambiguous", "overturned", "never up", "impacts", "brackets", "ties", "faults")
    print(f"\n{'weight':12}{'model':11}" + "".join(f"{word:>11}" for word in head))
    for (kind, model), verdict in [*sorted(by_kind.items()), (("all", ""), total)]:
        counts = (
            *(verdict.cases, verdict.judged, verdict.ambiguous, verdict.overturned, verdict.never_up),
            *(verdict.impacts, verdict.brackets, verdict.ties, len(verdict.faults)),
        )
        print(f"{kind:12}{model:11}" + "".join(f"{count:11d}" for count in counts))
    print(f"\nskipped: {dict(total.skipped) or 'none'}; brackets not followed: {total.not_followed}")
    print(f"rests without a bracket: {total.unproven}")
    print(f"the largest error is {total.units:.3g} times what a unit in the last place changes")


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description="Judge responses under vertical motion by 32 digits.")
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    given = parser.parse_args(arguments)
    by_kind: dict[tuple[str, str], Verdict] = {}
    total, start, told = Verdict(), time.monotonic(), time.monotonic()
    for number in range(given.first, given.first + given.cases):
        case = vertical_referee.case(given.seed, number)
        verdict = vertical_referee.judge(case)
        total.add(verdict)
        by_kind.setdefault((case.kind.split(", ")[1], case.model), Verdict()).add(verdict)
        for fault in verdict.faults:
            print(fault, flush=True)
        if time.monotonic() - told > 10.0:
            told = time.monotonic()
            print(f"{total.cases} cases in {told - start:.0f} s, {len(total.faults)} faults", file=sys.stderr)
    printed(by_kind, total)
    return 1 if total.faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
