"""Responses under vertical motion, weights through zero included, judged by many digits."""

import numpy as np
import pytest
from oracles import multiprecision, vertical_referee
from oracles.multiprecision import Course
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


LITTLE = pytest.mark.parametrize("little", [10.0**-n for n in (2, 4, 5, 6, 7, 8, 9)])


def assert_bracket_holds(case: Case) -> None:
    response = case.simulate()
    sequence, last = response.solution.sequences[0], response.impacts[-1]
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
