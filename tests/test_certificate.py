"""The brackets on the time of rest hold.

For random cases in 60-digit arithmetic; for some of every kind by a proof in ball arithmetic.
"""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from mpmath import mpf
from oracles import balls, multiprecision
from oracles.cases import GRAVITY, Case, cases, impacts_of
from oracles.problem import Problem

import rocking

quick = settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.too_slow])
thorough = settings(deadline=None, max_examples=600, suppress_health_check=[HealthCheck.too_slow])

State = tuple[float, int, float]


def proofs(response: rocking.Response) -> list[tuple[State, float, float, float]]:
    """Of each sequence: the state at its last resolved impact, where the proof was made; rest, bracket."""
    found = []
    for sequence in response.chattering:
        before = [impact for impact in impacts_of(response) if impact[0] <= sequence["end"]]
        time, side, _, speed = before[-1]
        found.append(((time, side, speed), *(float(sequence[k]) for k in ("end", "lower", "upper"))))
    return found


def assert_brackets_hold(case: Case) -> None:
    for state, end, lower, upper in proofs(case.simulate()):
        rest = multiprecision.rest_time(case.problem, *state)
        assert mpf(lower) <= rest <= mpf(upper), (state, float(rest))
        assert lower <= end <= upper
        assert upper - lower <= 1e-9


@quick
@given(cases())
def test_brackets_hold_the_rest_time_of_sixty_digit_arithmetic(case: Case) -> None:
    assert_brackets_hold(case)


@pytest.mark.slow
@thorough
@given(cases(restitution=(0.05, 0.985)))
def test_brackets_hold_the_rest_time_of_sixty_digit_arithmetic_at_length(case: Case) -> None:
    assert_brackets_hold(case)


def record(seed: int, samples: int = 80) -> rocking.Motion:
    """Smoothed noise that reaches 1.8 times the acceleration which uplifts a block of alpha = 0.15."""
    noise = np.convolve(np.random.default_rng(seed).normal(size=samples + 5), np.ones(6), mode="valid")
    return rocking.Motion.from_samples(noise * (1.8 * 0.15 * GRAVITY / np.max(np.abs(noise))), 0.02)


SYMMETRIC = ((2.0, 2.0), (0.15, 0.15), (0.9, 0.9))
TWO_SIDED = ((2.4, 1.8), (0.12, 0.18), (0.93, 0.7))
SINE = (1.3 * 0.15 * GRAVITY, 0.6)
PROVEN = {
    "linear, record": lambda: Case("linear", *SYMMETRIC, record(1)),
    "linear, two-sided, record": lambda: Case("linear", *TWO_SIDED, record(2)),
    "nonlinear, record": lambda: Case("nonlinear", *SYMMETRIC, record(3)),
    "nonlinear, two-sided, record": lambda: Case("nonlinear", *TWO_SIDED, record(4)),
    "linear, sine": lambda: Case("linear", *SYMMETRIC, rocking.pulses.sine(*SINE, cycles=3.0)),
    "nonlinear, sine": lambda: Case("nonlinear", *SYMMETRIC, rocking.pulses.sine(*SINE, cycles=3.0)),
    "nonlinear, two-sided, sine": lambda: Case(
        "nonlinear", *TWO_SIDED, rocking.pulses.sine(*SINE, cycles=3.0)
    ),
    "nonlinear, ricker": lambda: Case("nonlinear", *SYMMETRIC, rocking.pulses.ricker(4.0, 1.0)),
    "linear, shipped record": lambda: Case("linear", *SYMMETRIC, rocking.records.load("ridgecrest-clc-090")),
    "nonlinear, shipped record": lambda: Case(
        "nonlinear", *TWO_SIDED, rocking.records.load("ridgecrest-clc-090")
    ),
}


@pytest.mark.parametrize("name", PROVEN)
def test_ball_arithmetic_proves_the_brackets(name: str) -> None:
    case = PROVEN[name]()
    found = proofs(case.simulate())
    assert found
    for state, _, lower, upper in found:
        rest = balls.rest_enclosure(case.problem, *state)
        assert balls.within(rest, lower, upper), (state, rest)
        assert balls.holds(rest, str(multiprecision.rest_time(case.problem, *state)))


@pytest.mark.parametrize("name", [name for name in PROVEN if "sine" in name])
def test_the_brackets_under_an_approximated_sine_hold_for_the_sine_itself(name: str) -> None:
    case = PROVEN[name]()
    ground = balls.sine(case.problem, *SINE)
    assert case.motion is not None
    found = [proof for proof in proofs(case.simulate()) if proof[3] < case.motion.duration]
    assert found
    for state, _, lower, upper in found:
        assert balls.within(balls.rest_enclosure(case.problem, *state, ground=ground), lower, upper)


def test_a_proof_in_ball_arithmetic_refuses_a_bracket_that_misses_the_rest() -> None:
    problem = Problem("linear", *SYMMETRIC, np.array([0.0]), np.zeros((0, 1)))
    rest = balls.rest_enclosure(problem, 0.0, 1, 0.01)
    near = float(multiprecision.rest_time(problem, 0.0, 1, 0.01))
    assert balls.within(rest, near - 1e-15, near + 1e-15)
    assert not balls.within(rest, near + 1e-15, near + 2e-15)
    assert not balls.within(rest, near - 2e-15, near - 1e-15)
