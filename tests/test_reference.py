"""Whole responses and chattering times against values computed elsewhere."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from oracles.cases import GRAVITY, events_of
from oracles.multiprecision import follow
from oracles.problem import Problem
from oracles.scipy_events import integrate

import rocking

ULP = 2.0**-52


@pytest.fixture(scope="module")
def el_centro(shared: Path, reference: dict[str, Any]) -> rocking.Motion:
    return rocking.read(shared / "records" / reference["record_response"]["record"])


@pytest.mark.parametrize("number", range(7))
def test_responses_to_el_centro_are_those_of_the_reference(
    reference: dict[str, Any], el_centro: rocking.Motion, number: int
) -> None:
    case = reference["record_response"]["cases"][number]
    block = rocking.Block.from_parameters(p=case["p"], alpha=case["alpha"], restitution=case["restitution"])
    response = rocking.simulate(block, el_centro, model=case["model"])
    shifted = [rocking.simulate(block, el_centro.scaled(1.0 + i * ULP), model=case["model"]) for i in (1, -1)]
    expected = case["events"] if not case["overturned"] else [*case["events"], ["overturn", None, None]]

    assert response.overturned == case["overturned"]
    assert [e["kind"] for e in response.events] == [kind for kind, _, _ in expected]
    for k, (_, time, side) in enumerate(expected):
        if time is not None:
            found = response.events[k]
            shift = max(abs(found["time"] - moved.events[k]["time"]) for moved in shifted)
            assert abs(found["time"] - time) <= max(1e-8, 30.0 * shift)
            assert found["side"] == side
    if not case["overturned"]:
        assert_allclose(response.peak_rotation, case["peak_rotation"], rtol=1e-9 if case["model"] == "linear" else 1e-7)
        assert_allclose(response.peak_time, case["peak_time"], rtol=0.0, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 2, 3, 4, 6])
def test_responses_to_el_centro_err_less_than_an_ulp_of_the_record_matters(
    reference: dict[str, Any], el_centro: rocking.Motion, number: int
) -> None:
    case = reference["record_response"]["cases"][number]
    p, alpha, restitution = (tuple(case[k]) for k in ("p", "alpha", "restitution"))
    block = rocking.Block.from_parameters(p=p, alpha=alpha, restitution=restitution)
    response = rocking.simulate(block, el_centro, model=case["model"])
    course = follow(Problem(case["model"], p, alpha, restitution, el_centro.breakpoints, el_centro.coefficients))

    assert [e[1:] for e in events_of(response)] == [e[1:] for e in course.events]
    errors = np.array(
        [float(e["time"] - exact) for e, (exact, _, _) in zip(response.events, course.events, strict=True)]
    )
    assert np.all(np.abs(errors) <= np.maximum(1e-12, ULP * np.abs(response.sensitivity.events["motion"])))
    of_an_ulp = ULP * abs(response.sensitivity.peak["motion"][0])
    assert_allclose(response.peak_rotation, float(course.peak), rtol=1e-12, atol=of_an_ulp)


@pytest.mark.parametrize("number", range(15))
def test_the_first_sequence_under_a_sine_is_that_of_the_reference(reference: dict[str, Any], number: int) -> None:
    case = reference["chattering_time"][number]
    p, alpha = 1.0, 0.1
    block = rocking.Block.from_parameters(p=p, alpha=alpha, restitution=case["eta"])
    motion = rocking.pulses.sine(case["a"] * GRAVITY * alpha, case["omega"] * p / (2.0 * np.pi), cycles=1.0)
    response = rocking.simulate(block, motion, model="linear")
    (uplift, first, _), (rest, second, _) = events_of(response)[:2]

    assert (first, second) == ("uplift", "rest")
    assert_allclose(p * (rest - uplift), float(case["tau"]), rtol=0.0, atol=1e-9)
    intervals = [float(x) for x in case.get("first_intervals", [])]
    found = p * np.diff([uplift, *response.impacts["time"]])[: len(intervals)]
    assert_allclose(found, intervals, rtol=0.0, atol=1e-9)


P, ALPHA, RESTITUTION = (2.0, 2.6), (0.15, 0.12), (0.9, 0.7)


def short_record(seed: int) -> rocking.Motion:
    generator = np.random.default_rng(seed)
    samples = np.convolve(generator.normal(size=44), np.ones(5), mode="valid")
    samples *= generator.uniform(1.2, 2.0) * 0.15 * GRAVITY / np.max(np.abs(samples))
    return rocking.Motion.from_samples(samples, 0.02)


@pytest.mark.cases(fast=3)
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("seed", range(4))
def test_responses_to_short_records_are_those_of_sixty_digit_arithmetic(model: str, seed: int) -> None:
    motion = short_record(seed)
    block = rocking.Block.from_parameters(p=P, alpha=ALPHA, restitution=RESTITUTION)
    response = rocking.simulate(block, motion, model=model)
    course = follow(Problem(model, P, ALPHA, RESTITUTION, motion.breakpoints, motion.coefficients))

    assert [e[1:] for e in events_of(response)] == [e[1:] for e in course.events]
    assert_allclose(response.events["time"], [float(e[0]) for e in course.events], rtol=0.0, atol=1e-12)
    assert_allclose(response.peak_rotation, float(course.peak), rtol=1e-12)
    resolved = min(len(course.impacts), len(response.impacts))
    for k, name in enumerate(["time", "side", "speed_before", "speed_after"]):
        exact = [float(impact[k]) for impact in course.impacts[:resolved]]
        assert_allclose(response.impacts[name][:resolved], exact, rtol=1e-9, atol=1e-12)


@pytest.mark.cases(fast=1, thorough=5)
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("seed", [4, 5, 6, 7])
def test_responses_from_initial_states_are_those_of_scipy(model: str, seed: int) -> None:
    motion = short_record(seed)
    generator = np.random.default_rng(seed)
    rotation, velocity = generator.uniform(-0.08, 0.08), generator.uniform(-0.1, 0.1)
    block = rocking.Block.from_parameters(p=P, alpha=ALPHA, restitution=RESTITUTION)
    response = rocking.simulate(block, motion, model=model, initial_rotation=rotation, initial_velocity=velocity)
    problem = Problem(model, P, ALPHA, RESTITUTION, motion.breakpoints, motion.coefficients)
    run = integrate(problem, rotation=rotation, velocity=velocity)

    assert [e[1:] for e in events_of(response)] == [e[1:] for e in run.events]
    assert_allclose(response.events["time"], [e[0] for e in run.events], rtol=0.0, atol=1e-10)
    assert_allclose(response.peak_rotation, run.peak, rtol=1e-10)
    assert_allclose(response.peak_time, run.peak_time, rtol=0.0, atol=1e-7)


@pytest.mark.cases(fast=7)
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("excess", [10.0**-k for k in range(1, 11)])
def test_a_peak_that_hardly_passes_the_threshold_uplifts_the_block_for_a_moment(model: str, excess: float) -> None:
    threshold = GRAVITY * (ALPHA[1] if model == "linear" else np.tan(ALPHA[1]))
    motion = rocking.Motion.from_samples([0.0, 0.0, threshold * (1.0 + excess), 0.0, 0.0], 0.01)
    block = rocking.Block.from_parameters(p=P, alpha=ALPHA, restitution=RESTITUTION)
    response = rocking.simulate(block, motion, model=model)
    course = follow(Problem(model, P, ALPHA, RESTITUTION, motion.breakpoints, motion.coefficients))

    assert events_of(response)[0][1:] == ("uplift", -1)
    assert [e[1:] for e in events_of(response)] == [e[1:] for e in course.events]
    assert_allclose(response.events["time"], [float(e[0]) for e in course.events], rtol=0.0, atol=1e-13)
    relative = 1e-12 / excess
    assert_allclose(response.peak_rotation, float(course.peak), rtol=relative)
    assert_allclose(response.impacts["speed_before"][0], float(course.impacts[0][2]), rtol=relative)
