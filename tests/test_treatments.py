"""Every chattering scheme against the certified response: right where it is, and shown wrong where not."""

import math
import runpy
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rocking
from rocking.chattering import chattering_time
from rocking.engine.schemes import chattering_scheme
from rocking.errors import OutsideFitWarning

BENCH = runpy.run_path(str(Path(__file__).parents[1] / "benchmarks/bench_schemes.py"))
BLOCK = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
THRESHOLD = BLOCK.gravity * 0.2


def sine(a, omega=2.0, cycles=2.5, threshold=THRESHOLD):
    return rocking.pulses.sine(a * threshold, omega / (2.0 * math.pi), cycles=cycles)


def outcome_of(block, motion, scheme, model="linear"):
    """What a treatment makes of a case, beside the certified response."""
    _, (outcome,) = BENCH["compare"](block, motion, [scheme], model=model)
    return outcome


def compared(a, *schemes, omega=2.0, cycles=2.5):
    return BENCH["compare"](BLOCK, sine(a, omega, cycles), schemes or BENCH["TREATMENTS"])[1]


def test_below_the_critical_amplitude_every_treatment_finds_every_rest_and_thresholds_none_too_late():
    outcomes = compared(1.03)
    assert len(outcomes) == len(BENCH["TREATMENTS"])
    for outcome in outcomes:
        assert outcome.is_right
        assert len(outcome.rests) == 5
        assert np.all(outcome.errors < 0.0) or outcome.scheme.startswith("bypass")


def last_impact(outcome):
    """Speed that the last impact before the first rest leaves, over p alpha, and its side."""
    impacts = outcome.response.impacts
    last = impacts[np.searchsorted(impacts["time"], outcome.rests[0, 0], side="right") - 1]
    return last["speed_after"] / 0.2, last["side"]


def test_a_threshold_is_early_by_what_the_geometric_series_still_adds():
    # After an impact that leaves speed v, arcs of 2 v/(1 -+ delta) follow (the paper's Eqs 67, 69 and 75).
    (outcome,) = compared(1.03, rocking.VelocityThreshold(1e-9))
    delta = float(sine(1.03).acceleration(outcome.certified[0])) / THRESHOLD
    speed, side = last_impact(outcome)
    arcs = 2.0 * speed * (1.0 / (1.0 + side * delta) + 0.92 / (1.0 - side * delta))
    # A time of rest has an absolute error of some 1e-15 s.
    assert -outcome.errors[0] == pytest.approx(arcs / (1.0 - 0.92**2), rel=1e-6)


def test_a_geometric_bypass_is_off_by_the_square_of_its_threshold_where_a_threshold_is_off_by_itself():
    thresholds = np.geomspace(1e-3, 1e-6, 7)
    schemes = [
        kind(threshold) for kind in (rocking.GeometricBypass, rocking.VelocityThreshold) for threshold in thresholds
    ]
    outcomes = compared(1.03, *schemes)
    assert all(outcome.is_right for outcome in outcomes)
    errors = np.array([outcome.errors[0] for outcome in outcomes]).reshape(2, -1)
    speeds = np.array([last_impact(outcome)[0] for outcome in outcomes[7:]])
    orders = [np.polyfit(np.log(speeds), np.log(-error), 1)[0] for error in errors]
    assert orders == pytest.approx([2.0, 1.0], abs=0.05)
    np.testing.assert_array_less(-errors[0], -errors[1] / 50.0)


def test_a_coarse_geometric_bypass_passes_over_the_motion_to_come():
    coarse, fine = compared(1.05, rocking.GeometricBypass(5e-2), rocking.GeometricBypass(1e-3))
    assert coarse.false_rests == pytest.approx([2.741502, 5.883095], abs=1e-6)
    assert fine.is_right


def test_the_paper_s_scheme_rests_at_its_first_impact_past_eq_65():
    (outcome,) = compared(1.03, rocking.AsymptoticTime())
    after = outcome.rests[0, 0] - outcome.response.events["time"][0]
    eq65 = float(chattering_time(1.03, 2.0, 0.92, method="asymptotic"))
    struck = outcome.response.impacts["time"] - outcome.response.events["time"][0]
    assert after == struck[struck >= eq65][0]


def test_where_eq_65_exceeds_the_true_time_the_rest_is_counted_as_by_rounding():
    assert chattering_time(1.02, 2.0, 0.92, method="asymptotic") > chattering_time(1.02, 2.0, 0.92)
    (outcome,) = compared(1.02, rocking.AsymptoticTime())
    assert outcome.is_right
    assert outcome.response.rests_by_rounding == 5
    assert np.max(np.abs(outcome.errors)) < 1e-12


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize(("a", "omega"), [(1.0386, 4.0), (1.05, 12.0)])
def test_between_eq_76_and_the_critical_amplitude_the_scheme_rests_falsely(a, omega, model):
    angle = THRESHOLD if model == "linear" else BLOCK.uplift_thresholds("nonlinear")[0]
    motion = sine(a, omega, 2.5, angle)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        by_eq76, by_exact = (
            outcome_of(BLOCK, motion, rocking.AsymptoticTime(critical), model) for critical in ("eq76", "exact")
        )
    assert by_eq76.false_rests.size == (4 if omega == 4.0 else 2)
    assert by_exact.false_rests.size == by_exact.missed.size == 0
    assert {warning.category for warning in caught} == ({OutsideFitWarning} if omega == 12.0 else set())


def test_eq_76_ends_chattering_by_stall_only_where_it_is_too_small():
    outcomes = compared(1.0375, rocking.AsymptoticTime("eq76"), rocking.AsymptoticTime("exact"))
    assert [outcome.response.rests_by_rounding for outcome in outcomes] == [5, 0]
    assert all(outcome.is_right for outcome in outcomes)


def test_the_asymptotic_time_counts_in_the_model_s_own_threshold():
    block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
    motion = sine(1.03, threshold=block.uplift_thresholds("nonlinear")[0])
    response = rocking.simulate(block, motion, model="nonlinear", chattering="time")
    assert response.rests_by_rounding == 0
    assert len(response.sequences) == 5


def test_a_treatment_is_made_of_its_name_and_parameter():
    assert chattering_scheme("time=exact") == rocking.AsymptoticTime("exact")
    assert chattering_scheme("interval=1e-6") == rocking.IntervalThreshold(1e-6)
    for wrong, sentence in (
        ("time=eq78", "eq76, eq77, exact"),
        ("velocity=x", "must be a number"),
    ):
        with pytest.raises(rocking.errors.OptionError, match=sentence):
            chattering_scheme(wrong)


def test_a_coarse_threshold_hides_overturning():
    (outcome,) = compared(1.05, rocking.VelocityThreshold(5e-2), omega=1.0, cycles=4.0)
    assert not outcome.response.overturned
    assert outcome.wrong
    assert not outcome.is_right


def test_a_rest_that_a_treatment_does_not_find_is_missed():
    block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.705)
    motion = rocking.pulses.n_lobe([3.34, 2.59, 1.85, 1.98, 3.1, 2.34], 0.3045)
    outcome = outcome_of(block, motion, rocking.VelocityThreshold(0.3))
    events = rocking.simulate(block, motion, model="linear").events
    np.testing.assert_array_equal(outcome.missed, events["time"][events["kind"] == "rest"])
    assert outcome.missed.size == 1 and outcome.response.overturned


@settings(deadline=None, max_examples=40)
@given(
    lobes=st.lists(st.floats(0.5, 1.4), min_size=2, max_size=6),
    omega=st.floats(1.0, 6.0),
    eta=st.floats(0.5, 0.95),
    threshold=st.floats(1e-4, 0.3),
)
def test_blocks_that_rest_together_are_lifted_together(lobes, omega, eta, threshold):
    block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=eta)
    motion = rocking.pulses.n_lobe([a * THRESHOLD for a in lobes], omega / (2.0 * math.pi))
    certified, (outcome,) = BENCH["compare"](block, motion, [rocking.VelocityThreshold(threshold)])

    def lifted(response, rest):
        events = response.events
        after = events["time"][np.searchsorted(events["time"], rest, side="right") :]
        return after[0] if after.size else math.inf

    true = ~np.isnan(outcome.certified)
    for rest, proven in zip(outcome.rests[true, 0], outcome.certified[true], strict=True):
        assert lifted(outcome.response, rest) == pytest.approx(lifted(certified, proven), abs=1e-12)
    # Each certified rest has exactly one counterpart, or is missed.
    assert len(np.unique(outcome.certified[true])) == np.count_nonzero(true)
    assert np.count_nonzero(true) + outcome.missed.size == len(certified.sequences)


def test_the_asymptotic_time_is_for_symmetric_blocks_under_sines():
    scheme = rocking.AsymptoticTime(critical="exact")
    sine = rocking.pulses.sine(4.0, 1.0, cycles=2)
    symmetric = rocking.Blocks([2.0], [0.2], [0.9])
    assert scheme.thresholds(symmetric, sine, "linear").shape == (1, 2)
    for different in (
        rocking.Blocks([[2.0, 2.5]], [0.2], [0.9]),
        rocking.Blocks([2.0], [[0.2, 0.25]], [0.9]),
        rocking.Blocks([2.0], [0.2], [[0.9, 0.8]]),
        rocking.Blocks([[2.0, 2.0], [2.0, 2.5]], [0.2], [0.9]),
    ):
        with pytest.raises(rocking.errors.OptionError, match="symmetric blocks"):
            scheme.thresholds(different, sine, "linear")
    with pytest.raises(rocking.errors.OptionError, match="sinusoidal"):
        scheme.thresholds(symmetric, sine.delayed(1.0), "linear")


@pytest.mark.parametrize("value", ["1e-9", True, np.nan, np.inf, 0.0, -1.0, None])
@pytest.mark.parametrize("scheme", [rocking.Certified, rocking.VelocityThreshold, rocking.IntervalThreshold])
def test_the_parameter_of_a_scheme_is_a_positive_number(scheme, value):
    assert scheme(np.float32(1.0)) == scheme(1)
    with pytest.raises(rocking.errors.OptionError, match="must be"):
        scheme(value)
