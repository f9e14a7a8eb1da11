"""Laws that every response obeys, over random blocks and motions."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from oracles import dense
from oracles.cases import Case, between, cases, events_of, impacts_of

import rocking

ULP = 2.0**-52

quick = settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow])


def assert_no_impact_is_missed(case: Case) -> int:
    """Judge all arcs of a case, and count them."""
    response = case.simulate()
    end = events_of(response)[-1][0] if len(response.events) else 0.0
    problem = case.problem
    arcs = list(dense.arcs(events_of(response), impacts_of(response), end))
    for arc in arcs:
        finding = dense.examine(problem, arc)
        span = arc.end - arc.start
        p, alpha, _ = problem.side(arc.side)
        of_time, of_acceleration = 32.0 * ULP * arc.end, 8.0 * ULP * p * p * alpha
        in_speed = of_acceleration * span + 2.0 * p * p * alpha * of_time
        assert finding.lowest > 0.0, finding
        assert abs(finding.speed_error) <= 1e-10 * arc.speed_at_end + in_speed, finding
        if arc.ended_by == "impact":
            in_time = of_time + of_acceleration * span**2 / arc.speed_at_end
            assert abs(finding.time_error) <= 1e-10 * span + in_time, finding
    return len(arcs)


@pytest.mark.parametrize(
    ("model", "examples"),
    [
        *(("linear", 12), ("nonlinear", 5)),
        *(pytest.param(model, n, marks=pytest.mark.thorough) for model, n in (("linear", 40), ("nonlinear", 20))),
        *(pytest.param(model, n, marks=pytest.mark.slow) for model, n in (("linear", 1500), ("nonlinear", 100))),
    ],
)
def test_no_impact_is_missed(model: str, examples: int) -> None:
    judged = 0

    @settings(quick, max_examples=examples)
    @given(cases(model=model))
    def judge(case: Case) -> None:
        nonlocal judged
        judged += assert_no_impact_is_missed(case)

    judge()
    assert judged >= examples


@quick
@given(cases())
def test_the_peak_is_the_largest_rotation(case: Case) -> None:
    response = case.simulate()
    edges = np.concatenate([[0.0], response.events["time"], response.impacts["time"], [response.duration]])
    edges = np.unique(edges[edges <= response.duration])
    times = (edges[:-1, None] + np.linspace(0.0, 1.0, 50, endpoint=False) * np.diff(edges)[:, None]).ravel()
    rotation = np.abs(response.rotation(times))
    peak = np.abs(response.rotation(response.peak_time))
    assert np.max(rotation, initial=0.0) <= response.peak_rotation * (1.0 + 1e-12)
    # A time is known to its last place, so a rotation to what the speed there makes of that.
    speed = np.abs(response.angular_velocity(response.peak_time))
    last_place = np.spacing(max(response.peak_time, np.finfo(float).tiny))
    assert_allclose(peak, response.peak_rotation, rtol=1e-9, atol=4.0 * speed * last_place)


def assert_same_course(
    one: rocking.Response, other: rocking.Response, *, time: float, shift: float, size: float
) -> None:
    """`other` is `one` with times t -> time t + shift and rotations times `size`, up to rounding.

    Nothing is asserted where an ulp in the motion moves an event by more than 1e-12 s.
    """
    assume(np.all(ULP * np.abs(one.sensitivity.events["motion"]) <= 1e-12))
    assert [e[1:] for e in events_of(one)] == [e[1:] for e in events_of(other)]
    assert_allclose(other.events["time"], time * one.events["time"] + shift, rtol=0.0, atol=1e-10 * time)
    atol = 100.0 * ULP * abs(size * one.sensitivity.peak["motion"][0])
    assert_allclose(other.peak_rotation, size * one.peak_rotation, rtol=1e-9, atol=atol)


def resampled(case: Case, *, delay: int = 0, faster: float = 1.0, size: float = 1.0) -> rocking.Motion:
    """The case's record that starts `delay` samples later, runs `faster` and has `size` times the amplitude."""
    assert case.motion is not None
    samples = np.concatenate([np.zeros(1 + delay), case.motion.coefficients[1:, 0], [0.0]])
    return rocking.Motion.from_samples(size * samples, float(case.motion.breakpoints[1]) / faster)


@quick
@given(cases(motion="record"), st.integers(1, 200))
def test_a_later_motion_gives_the_same_response_later(case: Case, delay: int) -> None:
    base = replace(case, motion=resampled(case))
    later = replace(case, motion=resampled(case, delay=delay))
    shift = delay * float(base.motion.breakpoints[1])
    assert_same_course(base.simulate(), later.simulate(), time=1.0, shift=shift, size=1.0)


@quick
@given(cases(motion="record"), between(0.3, 3.0))
def test_a_faster_block_under_a_faster_motion_rocks_alike(case: Case, factor: float) -> None:
    base = replace(case, motion=resampled(case))
    p = (factor * case.p[0], factor * case.p[1])
    faster = replace(case, p=p, motion=resampled(case, faster=factor))
    assert_same_course(base.simulate(), faster.simulate(), time=1.0 / factor, shift=0.0, size=1.0)


@quick
@given(cases(model="linear", motion="record"), between(0.3, 1.5))
def test_the_linear_response_scales_with_slenderness_and_motion(case: Case, factor: float) -> None:
    base = replace(case, motion=resampled(case))
    alpha = (factor * case.alpha[0], factor * case.alpha[1])
    wider = replace(case, alpha=alpha, motion=resampled(case, size=factor))
    one, other = base.simulate(), wider.simulate()
    assume(not one.overturned)
    assert_same_course(one, other, time=1.0, shift=0.0, size=factor)


@pytest.mark.parametrize(
    "p, alpha, restitution", [(2.0, 0.2, 0.5), (1.0, 0.1, 0.9), (6.0, 0.35, 0.95), (0.7, 0.3, 0.05)]
)
@pytest.mark.parametrize("share", [1e-4, 0.1, 0.5, 0.9, 0.999])
def test_a_released_block_rests_when_the_closed_form_says(
    p: float, alpha: float, restitution: float, share: float
) -> None:
    block = rocking.Block.from_parameters(p=p, alpha=alpha, restitution=restitution)
    response = rocking.simulate(block, None, model="linear", initial_rotation=share * alpha)
    x = 1.0 - (share * alpha) / alpha
    speeds = restitution ** np.arange(1, 2000) * np.sqrt(1.0 - x * x)
    expected = np.arccosh(1.0 / x) / p + np.sum(2.0 / p * np.arctanh(speeds))
    assert [(str(k), int(s)) for k, s in response.events[["kind", "side"]]] == [("rest", 0)]
    assert_allclose(response.events["time"][-1], expected, rtol=0.0, atol=1e-10)
