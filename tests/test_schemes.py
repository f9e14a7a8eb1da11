"""Every scheme that ends chattering against the certified response: right where it is, and shown wrong where not."""

import math
import re
import warnings
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rocking
from rocking import dynamics
from rocking.chattering import chattering_time
from rocking.cli.options import TreatmentOptions
from rocking.dynamics.comparison import FAMILIES
from rocking.dynamics.schemes import STEPPINGS, TREATMENTS, compare_schemes
from rocking.errors import OutsideFit
from rocking.explorer.parameters import specification
from rocking.explorer.phrases import english
from rocking.treatment import _BY_NAME as KINDS
from rocking.treatment import treatment

BLOCK = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
THRESHOLD = BLOCK.gravity * 0.2


def sine(a, omega=2.0, cycles=2.5, threshold=THRESHOLD):
    return rocking.pulses.sine(a * threshold, omega / (2.0 * math.pi), cycles=cycles)


def compared(a, *schemes, omega=2.0, cycles=2.5):
    return compare_schemes(BLOCK, sine(a, omega, cycles), schemes=schemes or TREATMENTS, model="linear")


def by_name(comparison):
    return {repr(outcome.scheme): outcome for outcome in comparison.outcomes}


def test_below_the_critical_amplitude_every_treatment_finds_every_rest_and_thresholds_none_too_late():
    comparison = compared(1.03)
    assert len(comparison.outcomes) == len(TREATMENTS)
    for outcome in comparison.outcomes:
        assert outcome.is_right
        assert len(outcome.rests) == 5
        assert np.all(outcome.rests["error"] < 0.0) or outcome.scheme.name == "bypass"


def test_a_threshold_is_early_by_what_the_geometric_series_still_adds():
    # After an impact that leaves speed v, arcs of 2 v/(1 -+ delta) follow (the paper's Eqs 67, 69 and 75).
    outcome = compared(1.03, rocking.VelocityThreshold(1e-9)).outcomes[0]
    first = outcome.rests[0]
    delta = float(sine(1.03).acceleration(first["certified"])) / THRESHOLD
    side = outcome.response.impacts[np.searchsorted(outcome.response.impacts["time"], first["time"])]["side"]
    arcs = 2.0 * first["speed"] * (1.0 / (1.0 + side * delta) + 0.92 / (1.0 - side * delta))
    # A time of rest has an absolute error of some 1e-15 s.
    assert -first["error"] == pytest.approx(arcs / (1.0 - 0.92**2), rel=1e-6)


def test_a_geometric_bypass_is_off_by_the_square_of_its_threshold_where_a_threshold_is_off_by_itself():
    thresholds = np.geomspace(1e-3, 1e-6, 7)
    schemes = [
        kind(threshold) for kind in (rocking.GeometricBypass, rocking.VelocityThreshold) for threshold in thresholds
    ]
    outcomes = compared(1.03, *schemes).outcomes
    assert all(outcome.is_right for outcome in outcomes)
    errors = np.array([outcome.rests["error"][0] for outcome in outcomes]).reshape(2, -1)
    speeds = np.array([outcome.rests["speed"][0] for outcome in outcomes]).reshape(2, -1)
    orders = [np.polyfit(np.log(v), np.log(-error), 1)[0] for v, error in zip(speeds, errors, strict=True)]
    assert orders == pytest.approx([2.0, 1.0], abs=0.05)
    np.testing.assert_array_less(-errors[0], -errors[1] / 50.0)


def test_a_coarse_geometric_bypass_passes_over_the_motion_to_come():
    coarse, fine = compared(1.05, rocking.GeometricBypass(5e-2), rocking.GeometricBypass(1e-3)).outcomes
    assert coarse.false_rests == pytest.approx([2.741502, 5.883095], abs=1e-6)
    assert fine.is_right


def test_the_paper_s_figure_11_only_the_coarse_threshold_rests_wrongly():
    outcomes = by_name(compared(1.05))
    coarse = outcomes.pop("VelocityThreshold(threshold=0.05)")
    assert outcomes.pop("GeometricBypass(threshold=0.05)").false_rests.size == 2
    assert all(outcome.is_right for outcome in outcomes.values())
    assert coarse.false_rests.size == 4
    assert coarse.false_rests[0] == pytest.approx(1.258442, abs=1e-6)
    assert np.all(coarse.rests["speed"] <= 0.05)
    assert coarse.position_error > 0.01 * 0.2
    assert "4 false rests" in coarse.verdict


def test_the_paper_s_scheme_rests_at_its_first_impact_past_eq_65():
    outcome = compared(1.03, rocking.AsymptoticTime()).outcomes[0]
    after = outcome.rests["time"][0] - outcome.response.events["time"][0]
    eq65 = float(chattering_time(1.03, 2.0, 0.92, method="asymptotic"))
    struck = outcome.response.impacts["time"] - outcome.response.events["time"][0]
    assert after == struck[struck >= eq65][0]


def test_where_eq_65_exceeds_the_true_time_the_rest_is_reported_as_stalled():
    assert chattering_time(1.02, 2.0, 0.92, method="asymptotic") > chattering_time(1.02, 2.0, 0.92)
    outcome = compared(1.02, rocking.AsymptoticTime()).outcomes[0]
    assert outcome.is_right
    assert outcome.response.stalled == 5
    assert "time no longer advanced" in outcome.verdict
    assert abs(outcome.largest_error) < 1e-12


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize(("a", "omega"), [(1.0386, 4.0), (1.05, 12.0)])
def test_between_eq_76_and_the_critical_amplitude_the_scheme_rests_falsely(a, omega, model):
    angle = THRESHOLD if model == "linear" else BLOCK.uplift_thresholds("nonlinear")[0]
    motion = sine(a, omega, 2.5, angle)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        comparison = compare_schemes(
            BLOCK, motion, schemes=[rocking.AsymptoticTime(), rocking.AsymptoticTime("exact")], model=model
        )
    by_eq76, by_exact = comparison.outcomes
    assert by_eq76.false_rests.size == (4 if omega == 4.0 else 2)
    assert by_exact.false_rests.size == by_exact.missed.size == 0
    assert {warning.category for warning in caught} == ({OutsideFit} if omega == 12.0 else set())


def test_eq_76_ends_chattering_by_stall_only_where_it_is_too_small():
    comparison = compared(1.0375, rocking.AsymptoticTime("eq76"), rocking.AsymptoticTime("exact"))
    assert [outcome.response.stalled for outcome in comparison.outcomes] == [5, 0]
    assert all(outcome.is_right for outcome in comparison.outcomes)


def test_the_asymptotic_time_counts_in_the_model_s_own_threshold():
    block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
    motion = sine(1.03, threshold=block.uplift_thresholds("nonlinear")[0])
    response = rocking.simulate(block, motion, model="nonlinear", chattering="time")
    assert response.stalled == 0
    assert len(response.chattering) == 5


def test_a_treatment_is_made_of_its_name_and_parameter():
    assert treatment("time=exact") == rocking.AsymptoticTime("exact")
    assert treatment("interval=1e-6") == rocking.IntervalThreshold(1e-6)
    for wrong, sentence in (
        ("time=eq78", "eq76, eq77, exact"),
        ("velocity=x", "one number"),
        ("none", "must be one of"),
    ):
        with pytest.raises(rocking.InvalidOption, match=sentence):
            treatment(wrong)


def test_a_coarse_threshold_hides_overturning():
    comparison = compared(1.05, rocking.VelocityThreshold(5e-2), omega=1.0, cycles=4.0)
    (outcome,) = comparison.outcomes
    assert comparison.certified.response.overturned
    assert not outcome.response.overturned
    assert outcome.wrong_verdict
    assert not outcome.is_right
    assert "does not overturn, wrongly" in outcome.verdict


@pytest.mark.parametrize("scheme", ["moreau-jean=1e-4", "schatzman-paoli=1e-4"])
def test_a_scheme_by_which_a_block_overturns_some_steps_late_has_the_right_verdict(scheme):
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.85)
    comparison = compare_schemes(block, rocking.pulses.sine(6.0, 1.0, cycles=3), schemes=[scheme], model="linear")
    (outcome,) = comparison.outcomes
    late = outcome.response.times[-1] - comparison.certified.response.overturn_time
    assert 0.0 < late < 50.0 * 1e-4
    assert outcome.response.overturned and outcome.is_right


def test_a_rest_that_a_scheme_does_not_find_is_missed():
    block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.705)
    motion = rocking.pulses.n_lobe([3.34, 2.59, 1.85, 1.98, 3.1, 2.34], 0.3045)
    comparison = compare_schemes(block, motion, schemes=[rocking.VelocityThreshold(0.3)], model="linear")
    (outcome,) = comparison.outcomes
    rests = comparison.certified.response.events["time"][comparison.certified.response.events["kind"] == "rest"]
    np.testing.assert_array_equal(outcome.missed, rests)
    assert "1 rest missed" in outcome.verdict
    assert "overturns, wrongly" in outcome.verdict


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
    comparison = compare_schemes(block, motion, schemes=[rocking.VelocityThreshold(threshold)], model="linear")
    (outcome,) = comparison.outcomes

    def lifted(response, rest):
        events = response.events
        after = events["time"][np.searchsorted(events["time"], rest, side="right") :]
        return after[0] if after.size else math.inf

    true = outcome.rests[~np.isnan(outcome.rests["certified"])]
    for rest in true:
        theirs, ours = lifted(outcome.response, rest["time"]), lifted(comparison.certified.response, rest["certified"])
        assert theirs == pytest.approx(ours, abs=1e-12)
    # Each certified rest has exactly one counterpart, or is missed.
    assert len(np.unique(true["certified"])) == len(true)
    assert len(true) + outcome.missed.size == len(comparison.certified.response.chattering)


def test_schemes_that_do_not_apply_are_listed_with_the_reason():
    record = rocking.records.load("ridgecrest-clc-090").processed(trim=(225.0, 245.0))
    comparison = compare_schemes(rocking.Block(width=0.24, height=1.1), record, schemes=[rocking.AsymptoticTime()])
    assert comparison.outcomes == ()
    ((scheme, reason),) = comparison.not_applicable
    assert scheme == rocking.AsymptoticTime()
    assert "sinusoidal" in reason
    assert "not applicable" in str(comparison)


YIELDING = rocking.RestrainedBlock(
    rocking.Block(width=0.4, height=2.0, mass=1000.0), rocking.Tendon(4.9e4, prestress=490.0, strength=1200.0)
)
FALLING = rocking.RestrainedBlock(
    rocking.Block(width=0.4, height=2.0), restitution=rocking.FallingRestitution(0.95, 0.2, 0.6)
)


@pytest.mark.parametrize(("body", "word"), [(YIELDING, "yields"), (FALLING, "varies")], ids=["yielding", "falling"])
def test_time_stepping_is_refused_where_it_would_converge_to_another_body(body, word):
    motion = rocking.pulses.one_sine(5.0, 1.0)
    comparison = compare_schemes(body, motion, schemes=["velocity=1e-6", "moreau-jean=1e-3"])
    assert [outcome.scheme for outcome in comparison.outcomes] == [rocking.VelocityThreshold(1e-6)]
    ((scheme, reason),) = comparison.not_applicable
    assert scheme == dynamics.MoreauJean(1e-3) and word in reason
    with pytest.raises(rocking.InvalidBlock, match=word):
        dynamics.integrate(body, motion, dynamics.MoreauJean(1e-3), 1.0)


def test_a_block_that_nothing_restrains_is_that_block_by_default_too():
    block = rocking.Block(width=0.4, height=1.0, restitution=0.85)
    free, motion = rocking.RestrainedBlock(block), rocking.pulses.sine(5.0, 1.5, cycles=1)
    maps = [dynamics.stroboscopic_map(body, motion) for body in (block, free)]
    assert [each.model for each in maps] == ["nonlinear", "nonlinear"]
    assert maps[1]([-0.1, 0.2]) == pytest.approx(maps[0]([-0.1, 0.2]), rel=1e-12)
    responses = [compare_schemes(body, motion, schemes=["velocity=1e-6"]).certified.response for body in (block, free)]
    assert responses[1].peak_rotation == pytest.approx(responses[0].peak_rotation, rel=1e-12)
    diagrams = [
        dynamics.bifurcation_diagram(
            lambda value, body=body: (body, rocking.pulses.sine(value, 1.5, cycles=1)), [4.0, 4.5],
            starts=[[-0.1, 0.0]], transient=3, kept=4, progress=False,
        )
        for body in (block, free)
    ]  # fmt: skip
    found = [each.data.coordinate.values for each in diagrams]
    assert found[1] == pytest.approx(found[0], rel=1e-9, nan_ok=True)
    assert np.isfinite(found[0]).any()


def test_a_mistake_in_the_case_is_no_scheme_s_fault():
    with pytest.raises(rocking.InvalidOption, match="model"):
        compare_schemes(BLOCK, sine(1.03), model="cubic")


def test_the_table_has_a_line_for_each_scheme():
    lines = str(compared(1.05)).splitlines()
    assert len(lines) == 4 + len(TREATMENTS)
    assert lines[1].startswith("certified")
    assert any(line.startswith("velocity 0.05") and "false rest" in line for line in lines)


def test_a_comparison_is_the_same_in_one_thread_and_in_several():
    one, several = (compare_schemes(BLOCK, sine(1.05), model="linear", threads=count).to_dict() for count in (1, 3))
    assert repr(one) == repr(several)
    assert len(one["schemes"]) == len(TREATMENTS) + len(STEPPINGS)
    assert sum(not scheme["is_right"] for scheme in one["schemes"]) == 5


def test_tables_have_a_row_for_each_scheme_and_each_rest():
    found = compared(1.03, rocking.VelocityThreshold(1e-3), STEPPINGS[1], rocking.AsymptoticTime())
    schemes, rests = found.to_dataframe(), found.to_dataframe("rests")
    assert schemes["scheme"].tolist() == ["certified", "velocity", "moreau-jean", "time"]
    assert schemes["parameter"].tolist() == [1e-12, 1e-3, 1e-3, "eq76"]
    assert schemes["unit"].tolist() == ["s", "p alpha", "s", ""]
    assert schemes["cost_unit"].tolist() == ["arcs", "arcs", "steps", "arcs"]
    assert schemes["position_error_rad"][0] == 0.0
    assert (schemes["position_error_over_largest"][1:] > 0.0).all()
    assert (schemes["impacts_to_first_rest"] < schemes["impacts"]).all()
    assert rests["scheme"].value_counts().to_dict() == {"velocity": 5, "moreau-jean": 5, "time": 5}
    assert (rests["error_s"] == rests["time_s"] - rests["certified_s"]).all()


def test_a_ball_is_compared_as_a_block_is():
    ball = dynamics.BouncingBall(0.8)
    found = compare_schemes(ball, rocking.pulses.sine(12.0, 2.0, cycles=6), schemes=["velocity=1e-3", "interval=1e-6"])
    coarse, fine = found.outcomes
    assert coarse.false_rests.size == 5
    assert fine.is_right
    assert found.certified.position_error == 0.0
    assert fine.position_error < 1e-8 * found.largest < coarse.position_error
    assert found.certified.response.body == ball


def test_between_two_stops_the_peak_is_that_of_the_stop_that_is_reached():
    pendulum = dynamics.InvertedPendulum(2.0, 0.05, 0.6)
    motion = rocking.pulses.sine(1.5, 1.0, cycles=3)
    found = compare_schemes(pendulum, motion, schemes=["bypass=1e-4", "moreau-jean=1e-4", "schatzman-paoli=1e-4"])
    assert len(found.certified.rests) > 0
    assert found.largest == pytest.approx(0.05)
    assert found.certified.response.peak_position == 0.05
    for outcome in found.outcomes:
        assert abs(outcome.peak_error) <= outcome.penetration / 0.05 + 1e-12 < 0.01
        assert outcome.position_error < 0.1 * found.largest


@pytest.mark.parametrize(
    ("start", "argument"),
    [
        ({"initial_position": 2.0}, "initial_position"),
        ({"initial_position": math.nan}, "initial_position"),
        ({"initial_position": 0.01, "initial_velocity": 2e6}, "initial_velocity"),
    ],
)
@pytest.mark.parametrize("body", [BLOCK, dynamics.ImpactOscillator(1.0, 0.5, stop=0.0, second_stop=1.0)])
def test_a_start_that_cannot_be_is_refused_by_the_name_it_was_given_by(body, start, argument):
    motion = rocking.pulses.sine(1.0, 1.0, cycles=1)
    for call in (
        lambda: compare_schemes(body, motion, schemes=["velocity=1e-3"], **start),
        lambda: dynamics.integrate(body, motion, dynamics.MoreauJean(1e-3), 1.0, **start),
    ):
        with pytest.raises(rocking.InvalidOption) as caught:
            call()
        assert caught.value.argument == argument and str(caught.value).startswith(argument)


def test_the_processor_time_is_measured_where_it_is_asked_for():
    schemes = ["velocity=1e-3", "moreau-jean=1e-3"]
    found = compare_schemes(BLOCK, sine(1.05), schemes=schemes, model="linear", repetitions=2)
    assert all(0.0 < outcome.processor_time < 1.0 for outcome in (found.certified, *found.outcomes))
    assert "time, ms" in found.summary()
    untimed = compare_schemes(BLOCK, sine(1.05), schemes=schemes, model="linear")
    assert math.isnan(untimed.certified.processor_time)
    assert "time, ms" not in untimed.summary()


@pytest.mark.parametrize("timed", [0, 1])
def test_the_figure_names_each_family_once(timed):
    figure = compare_schemes(BLOCK, sine(1.05), model="linear", repetitions=timed).plot()
    families = ["Moreau-Jean", "Schatzman-Paoli", "asymptotic time", "geometric bypass", "interval threshold"]
    assert figure.axes[-1].get_xlabel() == ("processor time (s)" if timed else "arcs or steps")
    assert len(figure.axes) == 2
    for axes in figure.axes:
        assert sorted(text.get_text() for text in axes.texts) == [*families, "velocity threshold"]
        heights = sorted(text.xyann[1] for text in axes.texts)
        assert min(np.diff(heights)) > 0.05


def test_free_rocking_is_compared_too():
    comparison = compare_schemes(
        BLOCK, None, schemes=[rocking.IntervalThreshold(1e-6)], model="linear", initial_position=0.02
    )
    (outcome,) = comparison.outcomes
    assert outcome.is_right
    assert -1e-4 < outcome.largest_error < 0.0
    assert outcome.peak_error == 0.0


def test_the_asymptotic_time_is_for_symmetric_blocks_under_sines():
    scheme = rocking.AsymptoticTime(critical="exact")
    sine = rocking.pulses.sine(4.0, 1.0, cycles=2)
    symmetric = rocking.Blocks([2.0], [0.2], [0.9])
    assert scheme.limits(symmetric, sine, "linear").shape == (1, 2)
    for different in (
        rocking.Blocks([[2.0, 2.5]], [0.2], [0.9]),
        rocking.Blocks([2.0], [[0.2, 0.25]], [0.9]),
        rocking.Blocks([2.0], [0.2], [[0.9, 0.8]]),
        rocking.Blocks([[2.0, 2.0], [2.0, 2.5]], [0.2], [0.9]),
    ):
        with pytest.raises(rocking.InvalidOption, match="symmetric blocks"):
            scheme.limits(different, sine, "linear")
    with pytest.raises(rocking.InvalidOption, match="sinusoidal"):
        scheme.limits(symmetric, sine.delayed(1.0), "linear")


def test_every_treatment_is_in_figures_on_the_page_in_help_and_in_the_how_to():
    assert len(KINDS) >= 5
    assert {*FAMILIES} == {*KINDS} | {type(each).name for each in STEPPINGS}
    assert {each["name"] for each in specification()["treatments"]} == {*KINDS}
    assert {f"treatment.{name}{end}" for name in KINDS for end in ("", "_about")} <= english().keys()
    told = get_type_hints(TreatmentOptions, include_extras=True)["chattering"].__metadata__[0].help
    page = (Path(__file__).parents[1] / "docs/howto/choose-a-chattering-treatment.md").read_text("utf-8")
    for name, kind in KINDS.items():
        assert re.search(rf"\b{name}\b", told), name
        assert f'"{name}"' in rocking.simulate.__doc__ and f"`{kind.__name__}`" in rocking.simulate.__doc__, name
        assert f'| `"{name}"`, `{kind.__name__}(' in page, name


@pytest.mark.parametrize("value", ["1e-9", True, np.nan, np.inf, 0.0, -1.0, None])
@pytest.mark.parametrize("scheme", [rocking.Certified, rocking.VelocityThreshold, rocking.IntervalThreshold])
def test_the_parameter_of_a_scheme_is_a_positive_number(scheme, value):
    assert scheme(np.float32(1.0)) == scheme(1)
    with pytest.raises(rocking.InvalidOption, match="must be"):
        scheme(value)
