"""Laws that every response obeys, over random blocks and motions."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from oracles import dense
from oracles.cases import GRAVITY, Case, between, cases, events_of, impacts_of, records

import rocking

ULP = 2.0**-52

quick = settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow])
thorough = settings(deadline=None, max_examples=1500, suppress_health_check=[HealthCheck.too_slow])


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


@pytest.mark.parametrize("examples", [12, pytest.param(40, marks=pytest.mark.thorough)])
def test_no_impact_is_missed_in_the_linear_model(examples: int) -> None:
    judged = 0

    @settings(quick, max_examples=examples)
    @given(cases(model="linear"))
    def judge(case: Case) -> None:
        nonlocal judged
        judged += assert_no_impact_is_missed(case)

    judge()
    assert judged >= examples


@pytest.mark.parametrize("examples", [5, pytest.param(10, marks=pytest.mark.thorough)])
def test_no_impact_is_missed_in_the_nonlinear_model(examples: int) -> None:
    judged = 0

    @settings(quick, max_examples=examples)
    @given(cases(model="nonlinear"))
    def judge(case: Case) -> None:
        nonlocal judged
        judged += assert_no_impact_is_missed(case)

    judge()
    assert judged >= examples


@pytest.mark.slow
def test_no_impact_is_missed_in_the_linear_model_at_length() -> None:
    judged = 0

    @thorough
    @given(cases(model="linear"))
    def judge(case: Case) -> None:
        nonlocal judged
        judged += assert_no_impact_is_missed(case)

    judge()
    assert judged >= 1500


@pytest.mark.slow
def test_no_impact_is_missed_in_the_nonlinear_model_at_length() -> None:
    judged = 0

    @settings(thorough, max_examples=100)
    @given(cases(model="nonlinear"))
    def judge(case: Case) -> None:
        nonlocal judged
        judged += assert_no_impact_is_missed(case)

    judge()
    assert judged >= 100


@quick
@given(cases())
def test_the_angular_speed_never_grows_at_an_impact(case: Case) -> None:
    impacts = case.simulate().impacts
    left = np.where(impacts["side"] > 0, case.restitution[1], case.restitution[0])
    assert np.all(impacts["speed_after"] <= impacts["speed_before"])
    assert_allclose(impacts["speed_after"], left * impacts["speed_before"], rtol=4 * ULP)


@quick
@given(
    st.tuples(between(0.03, 0.4), between(0.03, 0.4)),
    between(0.5, 2.0),
    between(0.05, 1.5),
    st.sampled_from(["linear", "nonlinear"]),
    st.data(),
)
def test_conserved_momentum_takes_energy_from_the_block_at_every_impact(
    distances: tuple[float, float], height: float, gyration: float, model: str, data: st.DataObject
) -> None:
    block = rocking.Block.from_pivots(distances=distances, height=height, radius_of_gyration=gyration)
    motion = data.draw(records(GRAVITY * min(distances) / height))
    impacts = rocking.simulate(block, motion, model=model).impacts
    inertia = [gyration**2 + d**2 + height**2 for d in distances]
    entered = np.where(impacts["side"] > 0, inertia[0], inertia[1])
    left = np.where(impacts["side"] > 0, inertia[1], inertia[0])
    energy_before = left * impacts["speed_before"] ** 2
    assert np.all(entered * impacts["speed_after"] ** 2 <= energy_before * (1.0 + 8.0 * ULP))


@quick
@given(cases(), st.floats(-0.95, 0.95), st.booleans())
def test_energy_is_constant_along_free_arcs(case: Case, share: float, moving: bool) -> None:
    assume(abs(share) > 1e-3)
    side = 0 if share > 0.0 else 1
    p, alpha = case.p[side], case.alpha[side]
    state = {"initial_velocity": share * p * alpha} if moving else {"initial_rotation": share * alpha}
    free = replace(case, motion=None)
    response = free.simulate(**state)
    starts = [0.0, *(float(t) for t in response.impacts["time"])]
    assert len(starts) > 1 or response.overturned
    for (start, end), k in zip(pairwise(starts), range(6), strict=False):
        times = np.linspace(start, end, 22)[1:-1]
        rotation, rate = response.rotation(times), response.angular_velocity(times)
        i = np.sign(rotation[0])
        assert np.all(np.sign(rotation) == i), k
        p, alpha = (pair[0 if i > 0 else 1] for pair in (case.p, case.alpha))
        u = np.abs(rotation)
        if case.model == "linear":
            height = u * (2.0 * alpha - u) / 2.0
        else:
            height = 2.0 * np.sin(u / 2.0) * np.sin(alpha - u / 2.0)
        energy = rate**2 / 2.0 + p**2 * height
        assert_allclose(energy, energy[0], rtol=1e-11)


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


@quick
@given(cases())
def test_the_mirrored_motion_mirrors_the_response_exactly(case: Case) -> None:
    assert case.motion is not None
    mirrored = Case(
        case.model,
        case.p[::-1],
        case.alpha[::-1],
        case.restitution[::-1],
        rocking.Motion(case.motion.breakpoints, -case.motion.coefficients, error=case.motion.error),
    )
    one, other = case.simulate(), mirrored.simulate()
    assert events_of(one) == [(t, kind, -side) for t, kind, side in events_of(other)]
    assert impacts_of(one) == [(t, -side, *speeds) for t, side, *speeds in impacts_of(other)]
    assert one.peak_rotation == other.peak_rotation
    times = np.linspace(0.0, case.motion.duration, 301)
    assert_array_equal(one.rotation(times), -other.rotation(times))
    assert_array_equal(one.angular_velocity(times), -other.angular_velocity(times))


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


STEP = 1e-8


def scaled_responses(case: Case) -> tuple[rocking.Response, rocking.Response, rocking.Response]:
    """Responses to the motion and to the motion scaled a little up and down, with as many events and impacts."""
    assert case.motion is not None
    response, more, less = (replace(case, motion=case.motion.scaled(1.0 + i * STEP)).simulate() for i in (0, 1, -1))
    assume(len(response.events) == len(more.events) == len(less.events))
    assume(len(response.impacts) == len(more.impacts) == len(less.impacts))
    return response, more, less


def test_sensitivities_are_derivatives_by_the_scale_of_the_motion() -> None:
    judged = 0

    @quick
    @given(cases(motion="record"))
    def judge(case: Case) -> None:
        nonlocal judged
        response, more, less = scaled_responses(case)
        for rows in ("events", "impacts"):
            found, after, before = (getattr(r, rows) for r in (response, more, less))
            slopes = (after["time"] - before["time"]) / (2.0 * STEP)
            sensitivity = getattr(response.sensitivity, rows)["motion"]
            chosen = np.abs(sensitivity) < 100.0
            if rows == "events":
                chosen &= found["kind"] != "rest"
            assert_allclose(slopes[chosen], sensitivity[chosen], rtol=1e-3, atol=1e-5)
            judged += np.count_nonzero(chosen)
        if abs(response.sensitivity.peak["motion"][0]) < 100.0 * response.peak_rotation:
            slope = (more.peak_rotation - less.peak_rotation) / (2.0 * STEP)
            assert_allclose(
                slope, response.sensitivity.peak["motion"][0], rtol=1e-3, atol=1e-5 * response.peak_rotation
            )

    judge()
    assert judged >= 100


@pytest.mark.thorough
def test_sensitivities_of_rests_take_in_the_impacts_that_a_proof_has_summed() -> None:
    judged = 0

    @quick
    @given(cases(motion="record"))
    def judge(case: Case) -> None:
        nonlocal judged
        response, more, less = scaled_responses(case)
        slopes = (more.events["time"] - less.events["time"]) / (2.0 * STEP)
        sensitivity = response.sensitivity.events["motion"]
        rests = (np.abs(sensitivity) < 100.0) & (response.events["kind"] == "rest")
        assert_allclose(slopes[rests], sensitivity[rests], rtol=1e-2, atol=1e-3)
        judged += np.count_nonzero(rests)

    judge()
    assert judged >= 10


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


@pytest.mark.parametrize(
    "omega, critical", [(1.0, 1.3223965979), (2.0, 1.8007239306), (3.0, 2.2938723134), (5.0, 3.2891467775)]
)
def test_a_half_sine_overturns_from_the_known_amplitude_on(omega: float, critical: float) -> None:
    p, alpha = 1.7, 0.13
    block = rocking.Block.from_parameters(p=p, alpha=alpha, restitution=0.9)

    def overturns(amplitude: float) -> bool:
        motion = rocking.pulses.half_sine(amplitude * GRAVITY * alpha, omega * p / (2.0 * np.pi))
        return rocking.simulate(block, motion, model="linear").overturned

    low, high = 0.9 * critical, 1.1 * critical
    assert overturns(high) and not overturns(low)
    while high - low > 1e-11:
        middle = (low + high) / 2.0
        low, high = (low, middle) if overturns(middle) else (middle, high)
    assert abs(high - critical) <= 1e-8
