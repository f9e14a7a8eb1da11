"""Brackets hold the true time of rest from the start on, and what the last digits decide is flagged."""

import math

import numpy as np
import pytest
from oracles import balance
from oracles.vertical_referee import case as random_case

import rocking
from rocking import Block, simulate
from rocking.dynamics import BouncingBall

ULP = 2.0**-52
MODELS = ("linear", "nonlinear")
SIDES = (1.0, -1.0)


@pytest.mark.parametrize("model", MODELS)
def test_a_bracket_holds_the_rest_of_a_block_that_starts_next_to_its_balance(model: str) -> None:
    """Free, under constant pieces and under straight ones; at rest, on the way and from upright; by 40 digits."""
    judged = 0
    for number in range(60 if model == "linear" else 12):
        given = balance.case(1, number, model)
        response, true = given.simulate(), given.rest()
        assert (true is None) == response.overturned, given
        if true is None or response.ambiguous:
            continue
        sequence = response.sequences[0]
        assert math.isfinite(sequence["lower"]) and sequence["lower"] <= sequence["end"] <= sequence["upper"]
        assert sequence["lower"] <= true <= sequence["upper"], (given, float(true))
        judged += 1
    assert judged >= (40 if model == "linear" else 6)


def test_a_bracket_is_without_end_where_rounding_moves_the_rest_as_far_as_the_block_lingers() -> None:
    """And the response is ambiguous; a rest is still one that is proven."""
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    response = simulate(block, None, initial_rotation=0.2 * (1.0 - 4.0 * ULP))
    (sequence,) = response.sequences
    assert (sequence["lower"], sequence["upper"]) == (-math.inf, math.inf)
    assert response.ambiguous
    assert "not proven" not in response.summary()
    assert response.to_dict()["events"]


@pytest.mark.parametrize("treatment", ["velocity", "bypass", "interval"])
def test_other_treatments_have_no_bracket(treatment: str) -> None:
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    found = simulate(block, None, chattering=treatment, initial_rotation=0.1).sequences
    assert np.isnan(found["lower"]).all() and np.isnan(found["upper"]).all()


def test_a_bracket_is_hardly_wider_where_nothing_is_magnified() -> None:
    """What rounding adds in ordinary responses is of the size of the rounding of times."""
    added = []
    for number in range(60):
        response = random_case(7, number, vertical=False).simulate()
        if not response.ambiguous:
            added += (response.sequences["upper"] - response.solution.sequences["upper"]).tolist()
    assert len(added) >= 30 and np.nanmin(added) >= 0.0
    assert np.nanmedian(added) < 1e-13


def test_a_ball_without_restitution_rests_in_its_bracket() -> None:
    """Its last impact has no speed left: the bracket is that of the fall."""
    ball = BouncingBall(restitution=0.0)
    height = 0.5 * ball.gravity * 0.25**2
    (sequence,) = simulate(ball, None, model="linear", initial_rotation=height).sequences
    assert sequence["lower"] <= math.sqrt(2.0 * height / ball.gravity) <= sequence["upper"] < sequence["lower"] + 1e-14


# ---- What the last digits decide ----


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("duration", [0.1, 10.0])
def test_a_block_that_is_released_in_its_balance_is_flagged(model: str, side: float, duration: float) -> None:
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    found = simulate(block, None, model=model, initial_rotation=side * 0.2, duration=duration)
    assert found.ambiguities == ("touch",)
    near = simulate(block, None, model=model, initial_rotation=side * 0.1999, duration=duration)
    assert not near.ambiguous


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("excess", [-4.0, -1.0, 0.0, 1.0, 4.0, 16.0])
def test_a_motion_that_just_passes_a_threshold_or_just_does_not_is_flagged(
    model: str, side: float, excess: float
) -> None:
    """By some units in the last place; records, and a parabola that turns there."""
    block = Block.from_parameters(p=2.0, alpha=(0.2, 0.25), restitution=0.9)
    peak = -side * block.uplift_thresholds(model)[0 if side > 0.0 else 1]
    for factor, flagged in ((1.0 + excess * ULP, True), (1.0 - 1e-9, False)):
        record = rocking.Motion.from_samples([0.0, factor * peak, 0.0], 0.1)
        parabola = rocking.Motion([0.0, 0.2], [[0.0, 20.0 * factor * peak, -100.0 * factor * peak]])
        assert [simulate(block, each, model=model).ambiguous for each in (record, parabola)] == [flagged] * 2


@pytest.mark.parametrize("model", MODELS)
def test_an_arc_that_just_turns_above_the_ground_is_flagged(model: str) -> None:
    """The push that turns it at the ground, found by bisection, and a little more."""
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)

    def under(level: float) -> rocking.Response:
        motion = rocking.Motion([0.0, 0.3, 1.0], [[0.0], [level]])
        return simulate(block, motion, model=model, initial_rotation=0.05, duration=1.0)

    low, high = -9.0, -0.5
    while (middle := 0.5 * (low + high)) not in (low, high):
        low, high = (middle, high) if not len(under(middle).impacts) else (low, middle)
    assert not len(under(low).impacts) and len(under(high).impacts)
    assert under(low).rounding_decisions and under(low).ambiguous
    assert not under(low * (1.0 + 1e-6)).ambiguous
