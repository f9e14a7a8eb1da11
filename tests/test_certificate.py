"""The brackets on the time of rest hold.

For random cases in 60-digit arithmetic; for some of every kind by a proof in ball arithmetic.
"""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from mpmath import mpf
from oracles import balls, multiprecision
from oracles.cases import GRAVITY, Case, Pair, cases, impacts_of

import rocking

State = tuple[float, int, float]


@pytest.fixture(autouse=True)
def _bits_enough(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Prove with fewer bits what is fast: impacts that use them up are few there, and too few bits prove nothing."""
    if not any(request.node.get_closest_marker(tier) for tier in ("thorough", "slow")):
        monkeypatch.setattr(balls, "PRECISION", 700)


def proofs(response: rocking.Response) -> list[tuple[State, float, float, float]]:
    """Of each sequence: the state at its last resolved impact, where the proof was made; rest, bracket."""
    found = []
    for sequence in response.sequences:
        before = [impact for impact in impacts_of(response) if impact[0] <= sequence["end"]]
        time, side, _, speed = before[-1]
        found.append(((time, side, speed), *(float(sequence[k]) for k in ("end", "lower", "upper"))))
    return found


def assert_brackets_hold(case: Case) -> int:
    """Judge all brackets of a case, and count them."""
    found = proofs(case.simulate())
    for state, end, lower, upper in found:
        rest = multiprecision.rest_time(case.problem, *state)
        assert mpf(lower) <= rest <= mpf(upper), (state, float(rest))
        assert lower <= end <= upper
        # The allowance for rounding grows with the number of impacts since the first proof, up to some thousand here.
        assert upper - lower <= 1e-9
    return len(found)


@pytest.mark.parametrize(
    ("examples", "restitution"), [(25, (0.4, 0.96)), pytest.param(600, (0.05, 0.985), marks=pytest.mark.slow)]
)
def test_brackets_hold_the_rest_time_of_sixty_digit_arithmetic(examples: int, restitution: Pair) -> None:
    judged = 0

    @settings(deadline=None, max_examples=examples, suppress_health_check=[HealthCheck.too_slow])
    @given(cases(restitution=restitution))
    def judge(case: Case) -> None:
        nonlocal judged
        judged += assert_brackets_hold(case)

    judge()
    assert judged >= 0.4 * examples


def record(seed: int) -> rocking.Motion:
    """Smoothed noise that hardly uplifts a block of alpha = 0.12, so that it comes to rest while shaken."""
    noise = np.convolve(np.random.default_rng(seed).normal(size=125), np.ones(6), mode="valid")
    return rocking.Motion.from_samples(noise * (1.3 * 0.12 * GRAVITY / np.max(np.abs(noise))), 0.02)


def shipped() -> rocking.Motion:
    return rocking.records.load("ridgecrest-clc-090")


SYMMETRIC = ((2.0, 2.0), (0.12, 0.12), (0.9, 0.9))
TWO_SIDED = ((2.4, 1.8), (0.12, 0.14), (0.93, 0.7))
SINE = (1.025 * 0.12 * GRAVITY, 0.6)
MOTIONS = {
    "record": lambda: record(1),
    "sine": lambda: rocking.pulses.sine(*SINE, cycles=1.2),
    "ricker": lambda: rocking.pulses.ricker(1.4, 1.0),
    "shipped record": shipped,
}
#: With these, and in the linear model, ball arithmetic takes some tenths of a second.
SHORT = {(SYMMETRIC, "ricker"), (TWO_SIDED, "record"), (TWO_SIDED, "sine")}


def time_of(model: str, block: tuple[Pair, Pair, Pair], motion: str) -> list[pytest.MarkDecorator]:
    """Tenths of a second; or, in the linear model, about a second each; or, in the nonlinear one, up to ten."""
    if model == "nonlinear":
        return [] if (block, motion) == (TWO_SIDED, "ricker") else [pytest.mark.slow]
    return [pytest.mark.thorough] * ((block, motion) not in SHORT)


KINDS = [
    pytest.param(model, block, motion, marks=time_of(model, block, motion))
    for model in ("linear", "nonlinear")
    for block in (SYMMETRIC, TWO_SIDED)
    for motion in MOTIONS
]


@pytest.mark.cases(fast=4, thorough=6)
@pytest.mark.parametrize(("model", "block", "motion"), KINDS)
def test_ball_arithmetic_proves_the_brackets(model: str, block: tuple[Pair, Pair, Pair], motion: str) -> None:
    case = Case(model, *block, MOTIONS[motion]())
    found = proofs(case.simulate())
    assert found
    for state, _, lower, upper in found:
        rest = balls.rest_enclosure(case.problem, *state)
        assert balls.within(rest, lower, upper), (state, rest)
        assert balls.holds(rest, str(multiprecision.rest_time(case.problem, *state)))


@pytest.mark.parametrize(("model", "block", "motion"), KINDS)
def test_ball_arithmetic_proves_chattering_from_the_first_certified_impact_on(
    model: str, block: tuple[Pair, Pair, Pair], motion: str
) -> None:
    case = Case(model, *block, MOTIONS[motion]())
    response = case.simulate()
    sequence = response.sequences[0]
    ((time, side, _, speed),) = [i for i in impacts_of(response) if i[0] == sequence["start"]]
    rest = balls.rest_enclosure(case.problem, time, side, speed)
    assert balls.within(rest, sequence["end"] - 1e-11, sequence["end"] + 1e-11)


@pytest.mark.parametrize(
    ("model", "block"),
    [
        ("linear", SYMMETRIC),
        ("linear", TWO_SIDED),
        pytest.param("nonlinear", SYMMETRIC, marks=pytest.mark.slow),
        pytest.param("nonlinear", TWO_SIDED, marks=pytest.mark.thorough),
    ],
)
def test_the_brackets_under_an_approximated_sine_hold_for_the_sine_itself(
    model: str, block: tuple[Pair, Pair, Pair]
) -> None:
    case = Case(model, *block, MOTIONS["sine"]())
    ground = balls.sine(case.problem, *SINE)
    assert case.motion is not None
    found = [proof for proof in proofs(case.simulate()) if proof[3] < case.motion.duration]
    assert found
    for state, _, lower, upper in found:
        assert balls.within(balls.rest_enclosure(case.problem, *state, ground=ground), lower, upper)
