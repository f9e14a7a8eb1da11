"""Brackets on the time of rest where one term of the certificate decides: the motion's error, a steep nonlinear arc."""

import numpy as np
import pytest
from mpmath import mpf
from oracles.multiprecision import rest_time
from oracles.problem import Problem

import rocking
from rocking import Block, Certified, Motion, Response, simulate

GRAVITY = 9.80665
LONG = 50.0


def constant(acceleration: float, error: float = 0.0) -> Motion:
    return Motion([0.0, LONG], [[acceleration]], error=error)


def last_impact_of_the_sequence(response: Response) -> tuple[float, int, float]:
    """Where the proof was made that closed the first sequence."""
    before = response.impacts[response.impacts["time"] <= response.sequences["end"][0]][-1]
    return float(before["time"]), int(before["side"]), float(before["speed_after"])


def assert_bracket_holds(response: Response, problem: Problem) -> None:
    sequence = response.sequences[0]
    assert sequence["end"] < LONG
    rest = rest_time(problem, *last_impact_of_the_sequence(response))
    assert mpf(float(sequence["lower"])) <= rest <= mpf(float(sequence["upper"])), (sequence, float(rest))


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("tolerance", [1e-12, 1e-9, 1e-5])
@pytest.mark.parametrize("share", [0.5, -0.5])
@pytest.mark.parametrize("doubt", [0.1, -0.1])
def test_a_bracket_holds_for_every_motion_within_the_error(
    model: str, tolerance: float, share: float, doubt: float
) -> None:
    """The motion is known to a tenth of the threshold: what it may truly be, at either end, lies in the bracket."""
    p, alpha, e = (2.0, 2.5), (0.2, 0.22), (0.3, 0.4)
    block = Block.from_parameters(p, alpha, e)
    threshold = min(block.uplift_thresholds(model), key=abs)
    a, error = share * abs(threshold), abs(doubt * threshold)
    response = simulate(block, constant(a, error), model=model, initial_rotation=0.02, chattering=Certified(tolerance))
    true = Problem(model, p, alpha, e, np.array([0.0, LONG]), np.array([[a + np.sign(doubt) * error]]))
    assert_bracket_holds(response, true)


@pytest.mark.parametrize("share", [0.0, 0.3, -0.3])
@pytest.mark.parametrize("tolerance", [1e-11, 1e-8])
def test_a_bracket_holds_for_a_motion_that_changes_within_the_error_at_the_worst_instants(
    share: float, tolerance: float
) -> None:
    """One that pushes a block out and back as strongly as the error lets it, or the other way round, arc by arc.

    So late every arc is a pair of parabolas, by a (p T)^2 of 1e-10 and less.
    """
    p, alpha, e = (2.0, 2.5), (0.2, 0.22), (0.6, 0.7)
    block = Block.from_parameters(p, alpha, e)
    a, error = share * 0.2 * GRAVITY, 0.05 * 0.2 * GRAVITY
    response = simulate(
        block, constant(a, error), model="linear", initial_rotation=0.02, chattering=Certified(tolerance)
    )
    time, side, speed = last_impact_of_the_sequence(response)
    longest = shortest = 0.0
    fast = slow = speed
    for _ in range(400):
        k = 0 if side > 0 else 1
        weak, strong = (p[k] ** 2 * (alpha[k] + (side * a + i * error) / GRAVITY) for i in (-1, 1))
        longest += fast * (1.0 / weak + (weak * strong) ** -0.5)
        shortest += slow * (1.0 / strong + (weak * strong) ** -0.5)
        fast *= e[k] * (strong / weak) ** 0.5
        slow *= e[k] * (weak / strong) ** 0.5
        side = -side
    sequence = response.sequences[0]
    assert 0.0 < shortest < longest
    assert sequence["lower"] <= time + shortest * (1.0 + 1e-9)
    assert time + longest * (1.0 - 1e-9) <= sequence["upper"]


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("share", [0.5, -0.5])
@pytest.mark.parametrize("doubt, provable", [(0.3, True), (0.6, False)])
def test_no_rest_is_proven_where_the_motion_may_reach_the_threshold(
    model: str, share: float, doubt: float, provable: bool
) -> None:
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.05)
    threshold = abs(block.uplift_thresholds(model)[0])
    response = simulate(
        block, constant(share * threshold, doubt * threshold), model=model, initial_rotation=0.02, duration=10.0
    )
    proven = ~np.isnan(response.sequences["upper"])
    assert np.any(proven) if provable else not np.any(proven)


@pytest.mark.cases(fast=10)
@pytest.mark.parametrize("tolerance", [1e-12, 1e-8, 1e-4])
@pytest.mark.parametrize("alpha, share", [(1.4, 0.85), (1.4, -0.85), (1.3, 0.5), (1.5, -0.9), (0.9, 0.7)])
@pytest.mark.parametrize("e", [0.3, 0.8])
def test_a_bracket_holds_where_rotation_takes_more_from_the_restoring_force_than_gravity(
    tolerance: float, alpha: float, share: float, e: float
) -> None:
    """A stocky block under several g: its restoring acceleration falls by p^2 hypot(1, a/g) per radian, not by p^2."""
    block = Block.from_parameters(p=1.0, alpha=alpha, restitution=e)
    a = share * np.tan(alpha) * GRAVITY
    response = simulate(block, constant(a), initial_rotation=1e-3, chattering=Certified(tolerance))
    pair = (1.0, 1.0), (alpha, alpha), (e, e)
    assert_bracket_holds(response, Problem("nonlinear", *pair, np.array([0.0, LONG]), np.array([[a]])))


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("tolerance", [1e-6, 1e-3, 1.0])
@pytest.mark.parametrize("slow", [0, 1])
def test_a_peak_among_the_impacts_that_a_proof_has_summed_is_the_peak(model: str, tolerance: float, slow: int) -> None:
    """Thrown towards a stiff side; after one impact a loose bracket closes, and the soft side still goes higher."""
    p = (0.5, 5.0) if slow == 0 else (5.0, 0.5)
    block = Block.from_parameters(p=p, alpha=0.2, restitution=0.9)
    thrown = {"initial_velocity": -0.005 if slow == 0 else 0.005}
    fine = simulate(block, None, model=model, **thrown)
    loose = simulate(block, None, model=model, chattering=Certified(tolerance), **thrown)
    height = 0.5 * (0.9 * 0.005) ** 2 / (0.25 * np.sin(0.2))
    assert fine.peak_rotation == pytest.approx(height, rel=0.02)
    assert loose.peak_rotation == pytest.approx(fine.peak_rotation, rel=1e-9)
    assert loose.peak_time == pytest.approx(fine.peak_time, rel=1e-9)


def test_a_proof_does_not_span_the_uplift_that_follows_a_rest() -> None:
    """The ground passes the threshold soon after: the window of any proof before must end sooner."""
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.7)
    threshold = 0.2 * GRAVITY
    motion = Motion([0.0, 0.4, 2.0, 4.0], [[1.3 * threshold, 0.0], [0.0, 0.0], [0.0, threshold]])
    response = rocking.simulate(block, motion, model="linear")
    proven = response.sequences[np.isfinite(response.sequences["upper"])]
    uplifts = response.events["time"][response.events["kind"] == "uplift"]
    assert len(proven) >= 1
    assert uplifts[-1] > proven["start"][0]
    for sequence in proven:
        assert not np.any((uplifts > sequence["start"]) & (uplifts < sequence["upper"]))
