"""Laws of a single simulation where it could go wrong: series with zeros inside, and what no arithmetic can decide."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose
from oracles.multiprecision import follow
from oracles.problem import Problem
from scipy.integrate import solve_ivp

import rocking
from rocking import Block, Motion, Response, simulate

GRAVITY = 9.80665
MODELS = pytest.mark.parametrize("model", ["linear", "nonlinear"])


# --- series ---------------------------------------------------------------------------------------------------


def released(p: float, alpha: float, lean: float, push: float, time: float) -> float:
    """Rotation some time after a release from rest at alpha - lean, under push g, before the first impact."""
    tilt = solve_ivp(
        lambda t, y: (y[1], p * p * (math.sin(y[0]) + push * math.cos(y[0]))),
        (0.0, time),
        (lean, 0.0),
        method="DOP853",
        rtol=1e-13,
        atol=1e-15,
    )
    return alpha - float(tilt.y[0, -1])


@pytest.mark.parametrize("lean", [math.pi / 4, math.pi / 4 + 1e-9, 0.3, 1.0])
@pytest.mark.parametrize("time", [0.1, 0.25, 0.5])
def test_a_release_is_followed_whatever_coefficients_of_its_series_vanish(lean: float, time: float) -> None:
    """At rest odd powers vanish; under 1 g, pi/4 from the balance, so does the fourth (cos - a/g sin = 0)."""
    alpha = 1.2
    block = Block.from_parameters(p=1.0, alpha=alpha, restitution=0.5)
    response = simulate(block, Motion([0.0, 3.0], [[GRAVITY]]), duration=time, initial_rotation=alpha - lean)
    assert not len(response.impacts)
    assert_allclose(float(response.rotation(time)), released(1.0, alpha, lean, 1.0, time), rtol=0.0, atol=1e-13)


@pytest.mark.cases(fast=4)
@pytest.mark.parametrize("push", [0.25, 1.0, 2.0, pytest.param(5.0, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("p", [0.3, 1.0, 4.0])
def test_a_release_where_the_fourth_power_vanishes_has_its_first_impact_when_it_must(p: float, push: float) -> None:
    """cos(lean) = push sin(lean), for any push and p; to the impact, in sixty digits."""
    alpha, lean = 1.4, math.atan2(1.0, push)
    motion = Motion([0.0, 8.0], [[push * GRAVITY]])
    block = Block.from_parameters(p=p, alpha=alpha, restitution=0.05)
    response = simulate(block, motion, initial_rotation=alpha - lean)
    problem = Problem("nonlinear", (p, p), (alpha, alpha), (0.05, 0.05), motion.breakpoints, motion.coefficients)
    course = follow(problem, rotation=alpha - lean)
    assert_allclose(response.impacts["time"][0], float(course.impacts[0][0]), rtol=1e-12)
    assert_allclose(response.impacts["speed_before"][0], float(course.impacts[0][2]), rtol=1e-11)
    assert [str(kind) for kind in response.events["kind"]] == [kind for _, kind, _ in course.events]


@MODELS
@pytest.mark.parametrize("slope", [0.0, 2.0, -2.0])
def test_a_release_where_the_block_balances_follows_the_motion(model: str, slope: float) -> None:
    """From rest at alpha every coefficient up to the second vanishes: only the motion's slope moves the block."""
    p, alpha = 2.0, 0.25
    block = Block.from_parameters(p=p, alpha=alpha, restitution=0.5)
    motion = Motion([0.0, 1.0], [[0.0, slope]])
    response = simulate(block, motion, model=model, duration=0.5, initial_rotation=alpha)
    k = -slope * p * p / GRAVITY
    exact = alpha + k / p**3 * (math.sinh(p * 0.5) - p * 0.5)
    if model == "nonlinear":
        tilt = solve_ivp(
            lambda t, y: (y[1], -p * p * (math.sin(alpha - y[0]) + slope * t / GRAVITY * math.cos(alpha - y[0]))),
            (0.0, 0.5),
            (alpha, 0.0),
            method="DOP853",
            rtol=1e-13,
            atol=1e-15,
        )
        exact = float(tilt.y[0, -1])
    assert_allclose(float(response.rotation(0.5)), exact, rtol=0.0, atol=1e-13)


# --- what no arithmetic can decide ----------------------------------------------------------------------------


def neighbours(value: float, ulps: int) -> float:
    for _ in range(abs(ulps)):
        value = math.nextafter(value, math.inf if ulps > 0 else -math.inf)
    return value


def towards_balance(model: str, p: float, alpha: float, rotation: float) -> float:
    """The speed that brings the block to its balance point and no further (energy), in exact arithmetic."""
    lean = alpha - rotation
    return p * lean if model == "linear" else 2.0 * p * math.sin(0.5 * lean)


def is_ambiguous(respond: Callable[[], Response]) -> bool:
    """Whether a response says that it is, or is refused since it would balance for ever."""
    try:
        return respond().ambiguous
    except rocking.errors.OptionError as error:
        return "balance" in str(error)


@MODELS
@pytest.mark.parametrize(
    "p, alpha, rotation", [(2.0, 0.2, 0.1), (1.0, 0.25, 0.125), (3.0, 0.15, 0.03), (2.0, 0.2, 0.0)]
)
@pytest.mark.parametrize("ulps", [-2, -1, 0, 1, 2])
def test_a_block_sent_to_its_balance_point_is_ambiguous(
    model: str, p: float, alpha: float, rotation: float, ulps: int
) -> None:
    block = Block.from_parameters(p=p, alpha=alpha, restitution=0.9)
    speed = neighbours(towards_balance(model, p, alpha, rotation), ulps)
    for sign in (1.0, -1.0):
        assert is_ambiguous(
            lambda sign=sign: simulate(
                block, None, model=model, initial_rotation=sign * rotation, initial_velocity=sign * speed
            )
        )


@MODELS
@pytest.mark.parametrize("ulps", [-2, -1, 0, 1, 2])
def test_a_block_released_at_its_balance_point_is_ambiguous(model: str, ulps: int) -> None:
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    rotation = neighbours(0.2, ulps)
    assert is_ambiguous(lambda: simulate(block, None, model=model, initial_rotation=rotation))


@MODELS
def test_a_slenderness_on_the_brink_is_ambiguous(model: str) -> None:
    """Neither state nor motion are special: it is the block's slenderness that an ulp sends either way."""
    p, rotation, speed = 2.0, 0.125, 0.1875

    def respond(alpha: float) -> Response:
        block = Block.from_parameters(p=p, alpha=alpha, restitution=0.9)
        return simulate(block, None, model=model, initial_rotation=rotation, initial_velocity=speed)

    low, high = 0.15, 0.35
    assert respond(low).overturned and not respond(high).overturned
    low, high = adjacent(low, high, lambda alpha: respond(alpha).overturned)
    assert respond(low).ambiguous and respond(high).ambiguous


@MODELS
@pytest.mark.parametrize("seed", range(3))
def test_a_state_on_the_brink_of_overturning_after_impacts_is_ambiguous(model: str, seed: int) -> None:
    """Two sides, and an impact before the block goes over the other one or does not quite."""
    rng = np.random.default_rng(seed)
    block = Block.from_parameters(rng.uniform(2.0, 2.4, 2), rng.uniform(0.2, 0.25, 2), rng.uniform(0.6, 0.8, 2))
    rotation = 0.05

    def respond(velocity: float) -> Response:
        return simulate(block, None, model=model, initial_rotation=rotation, initial_velocity=velocity)

    low, high = 0.0, -3.0
    assert not respond(low).overturned and respond(high).overturned
    low, high = adjacent(high, low, lambda velocity: respond(velocity).overturned)
    assert respond(low).ambiguous and respond(high).ambiguous


@MODELS
def test_a_state_on_the_brink_under_a_motion_is_ambiguous(model: str) -> None:
    rng = np.random.default_rng(11)
    motion = Motion.from_samples(0.5 * GRAVITY * rng.normal(size=40), 0.02)
    block = Block.from_parameters(p=(2.0, 3.0), alpha=(0.2, 0.25), restitution=0.8)

    def respond(velocity: float) -> Response:
        return simulate(block, motion, model=model, initial_rotation=0.02, initial_velocity=velocity)

    assert respond(10.0).overturned and not respond(0.0).overturned
    low, high = adjacent(10.0, 0.0, lambda velocity: respond(velocity).overturned)
    assert respond(low).ambiguous and respond(high).ambiguous


def adjacent(yes: float, no: float, answer: Callable[[float], bool]) -> tuple[float, float]:
    """Two neighbouring doubles with different answers."""
    while True:
        middle = 0.5 * (yes + no)
        if middle in (yes, no):
            return yes, no
        if answer(middle):
            yes = middle
        else:
            no = middle


@MODELS
@pytest.mark.parametrize("p, alpha, rotation", [(2.0, 0.2, 0.1), (1.0, 0.25, 0.125), (3.0, 0.15, 0.03)])
@pytest.mark.parametrize("share", [-0.5, -1e-3, 1e-3, 0.5])
def test_ordinary_states_are_not_ambiguous(model: str, p: float, alpha: float, rotation: float, share: float) -> None:
    block = Block.from_parameters(p=p, alpha=alpha, restitution=0.9)
    speed = towards_balance(model, p, alpha, rotation) * (1.0 + share)
    assert not simulate(block, None, model=model, initial_rotation=rotation, initial_velocity=speed).ambiguous


@pytest.mark.cases(fast=1)
@MODELS
def test_ordinary_records_are_not_ambiguous(model: str) -> None:
    """Of a hundred blocks under noise hardly any; those without an event never."""
    rng = np.random.default_rng(3)
    count = 0
    for _ in range(100):
        samples = np.convolve(rng.normal(size=155), np.ones(6), mode="valid")
        motion = Motion.from_samples(samples * (2.0 * 0.2 * GRAVITY / np.abs(samples).max()), 0.02)
        block = Block.from_parameters(p=rng.uniform(1.0, 4.0), alpha=0.2, restitution=rng.uniform(0.5, 0.9))
        count += simulate(block, motion, model=model).ambiguous
        assert not simulate(block, motion.scaled(0.4), model=model).ambiguous
    assert count <= 2
