"""A block that comes to rest waits for the next passing of a threshold, also within the piece in which it rests."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from oracles.multiprecision import follow
from oracles.problem import Problem

import rocking
from rocking import Block, Motion, simulate, simulate_many

GRAVITY = 9.80665
MODELS = pytest.mark.parametrize("model", ["linear", "nonlinear"])
P, ALPHA, RESTITUTION = (3.0, 3.0), (0.2, 0.2), (0.4, 0.4)


def threshold(model: str) -> float:
    return GRAVITY * (0.2 if model == "linear" else float(np.tan(0.2)))


def assert_course(motion: Motion, model: str, kinds: list[str], *, rtol: float = 1e-11) -> rocking.Response:
    """Events, their times and the peak are those of sixty-digit arithmetic; the ensemble's outcomes are the same."""
    block = Block.from_parameters(P, ALPHA, RESTITUTION)
    response = simulate(block, motion, model=model)
    course = follow(Problem(model, P, ALPHA, RESTITUTION, motion.breakpoints, motion.coefficients))
    assert [kind for _, kind, _ in course.events] == kinds
    assert [(str(e["kind"]), int(e["side"])) for e in response.events] == [e[1:] for e in course.events]
    assert_allclose(response.events["time"], [float(e[0]) for e in course.events], rtol=rtol, atol=1e-12)
    assert_allclose(response.peak_rotation, float(course.peak), rtol=rtol)
    result = simulate_many(block, motion, model=model)
    assert (result.uplifts.item(), result.rests.item()) == (kinds.count("uplift"), kinds.count("rest"))
    assert_allclose(result.peak_rotation.item(), response.peak_rotation, rtol=1e-10)
    assert_allclose(result.time_at_rest.item(), response.time_at_rest, rtol=1e-9, atol=1e-12)
    return response


@MODELS
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_rest_is_proven_before_the_highest_rotation(model: str, sign: float) -> None:
    """After the first impact the time of rest is known well enough, but the next arc is the highest."""
    size = sign * threshold(model)
    response = assert_course(Motion([0.0, 1e-3, 3.0], [[1.01 * size], [-0.9 * size]]), model, ["uplift", "rest"])
    assert response.peak_time > response.impacts["time"][0]


@pytest.mark.cases(fast=3)
@MODELS
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("second", [1.0, -1.0])
def test_a_block_rests_and_uplifts_again_within_one_piece(model: str, sign: float, second: float) -> None:
    """One parabola or cubic: over the threshold, under it for long enough to rest, and over one of the two again."""
    size = sign * threshold(model)
    instants = np.array([0.0, 0.15, 1.5, 2.5, 3.0])
    values = np.array([1.3, 1.0, 0.2 * second, second, 1.2 * second]) * size
    coefficients = np.linalg.solve(np.vander(instants, increasing=True), values)
    pieces = Motion([0.0, 3.0], coefficients[None, :])
    response = assert_course(pieces, model, ["uplift", "rest", "uplift", "rest"])
    rest, again = response.events["time"][1:3]
    assert rest < again < 3.0
    assert abs(float(pieces.acceleration(float(again)))) == pytest.approx(abs(size), rel=1e-12)


@MODELS
def test_a_passing_before_the_rest_is_not_taken_for_one_after_it(model: str) -> None:
    """The piece passes the threshold once, on its way up, while the block still rocks; then it stays beneath."""
    size = threshold(model)
    jump = Motion([0.0, 0.1, 4.0], [[-1.4 * size, 0.0, 0.0], [0.5 * size, 2.2 * size, -1.5 * size]])
    assert np.max(np.abs(jump.acceleration(np.linspace(0.11, 1.5, 2001)))) > size
    block = Block.from_parameters(P, ALPHA, RESTITUTION)
    course = follow(Problem(model, P, ALPHA, RESTITUTION, jump.breakpoints, jump.coefficients))
    response = simulate(block, jump, model=model)
    assert [str(e["kind"]) for e in response.events] == [kind for _, kind, _ in course.events]
    assert_allclose(response.events["time"], [float(e[0]) for e in course.events], rtol=1e-11)


@pytest.mark.cases(fast=2)
@MODELS
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_block_rests_and_uplifts_again_between_two_samples(model: str, sign: float) -> None:
    """Samples 0.8 s apart: a falling line brings it to rest, and passes the other side's threshold before it ends."""
    size = sign * threshold(model)
    samples = np.array([0.0, 1.15, -1.3, 0.0, 0.0]) * size
    assert_course(Motion.from_samples(samples, 0.8), model, ["uplift", "rest", "uplift", "rest"])


@MODELS
def test_an_uplift_that_ends_in_a_sequence_of_its_own_in_every_sample_is_counted(model: str) -> None:
    """A zigzag that hardly passes the thresholds, slowly: one uplift and one rest for every tooth."""
    size = threshold(model)
    samples = np.tile([0.0, 1.02, 0.0, -1.02], 4) * size
    motion = Motion.from_samples(np.append(samples, 0.0), 1.0)
    assert_course(motion, model, ["uplift", "rest"] * 8)


@MODELS
@pytest.mark.parametrize("over", [0.0, 2.0**-52, 1e-12])
def test_a_sample_exactly_at_the_threshold_does_not_uplift_a_block(model: str, over: float) -> None:
    """At the threshold the block stays; an ulp over it, it moves by next to nothing: alone and together alike."""
    size = threshold(model) * (1.0 + over)
    motion = Motion.from_samples([0.0, size, size, 0.0, -size, 0.0], 0.02)
    block = Block.from_parameters(P, ALPHA, RESTITUTION)
    response = simulate(block, motion, model=model)
    result = simulate_many(block, motion, model=model)
    assert response.peak_rotation <= 1e-13
    assert result.peak_rotation.item() <= 1e-13
    assert result.uplifts.item() == int(np.sum(response.events["kind"] == "uplift"))


def test_a_response_lasts_until_its_last_rest() -> None:
    """To the last digit: the rotation at the time of the rest is zero, not unknown."""
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.5)
    response = simulate(block, Motion([0.0, 0.3], [[-0.3 * GRAVITY]]))
    assert response.rotation(response.events["time"][-1]) == 0.0
