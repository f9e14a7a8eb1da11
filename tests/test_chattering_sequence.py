"""Impact by impact: intervals and speeds in 120 digits, and the bracket on the time of rest."""

import numpy as np
import pytest
from oracles.sine_chattering import first_impacts, rest_time

from rocking import chattering

CASES = [
    (1.03, 2.0, 0.92),
    (1.01, 5.0, 0.92),
    (1.038, 2.0, 0.92),
    (1.002, 0.5, 0.5),
    (1.08, 8.0, 0.75),
    (1.012, 0.4, 0.97),
    (1.3, 3.0, 0.01),
    (1.0 + 2.0**-40, 1.0, 0.9),
]


def test_first_intervals_of_the_reference(reference):
    cases = [case for case in reference["chattering_time"] if "first_intervals" in case]
    assert len(cases) >= 10
    for case in cases:
        sequence = chattering.chattering_sequence(case["a"], case["omega"], case["eta"])
        first = np.array(case["first_intervals"], float)
        assert sequence.impacts["interval"][: first.size] == pytest.approx(first, rel=2e-13)


@pytest.mark.cases(fast=3)
@pytest.mark.parametrize("case", CASES)
def test_intervals_and_speeds_agree_with_120_digits(case):
    impacts = chattering.chattering_sequence(*case).impacts
    # The height of an arc cancels like the square of its duration: 120 digits resolve arcs above 1e-25.
    count = int(np.argmin(np.append(impacts["interval"][:60] > 1e-25, False)))
    intervals, speeds = np.transpose(first_impacts(*case, count))
    assert len(intervals) == count >= 5
    assert impacts["interval"][:count] == pytest.approx(intervals, rel=5e-13)
    assert impacts["speed_before"][:count] == pytest.approx(speeds, rel=5e-13)


def test_impacts_keep_the_bookkeeping_of_the_motion():
    eta = 0.8
    impacts = chattering.chattering_sequence(1.03, 2.0, eta).impacts
    assert impacts["side"][:4].tolist() == [1, -1, 1, -1]
    assert impacts["time"] == pytest.approx(np.cumsum(impacts["interval"]), rel=1e-14)
    assert impacts["speed_after"] == pytest.approx(eta * impacts["speed_before"], rel=1e-15)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9, 1e-12])
def test_the_bracket_holds_the_rest_of_120_digits(case, tolerance):
    """From the last impact's double-precision time and speed, all that follows is summed in 120 digits."""
    sequence = chattering.chattering_sequence(*case, tolerance=tolerance)
    last = sequence.impacts[-1]
    state = (float(last["time"]), int(last["side"]), float(last["speed_after"]))
    assert sequence.lower <= rest_time(*case, start=state, little=1e-12) <= sequence.upper
    assert sequence.lower <= sequence.time <= sequence.upper
    assert sequence.upper - sequence.lower <= 1.1 * tolerance * sequence.time + 1e-15


def test_incomplete_sequences_end_at_half_a_period():
    sequence = chattering.chattering_sequence(1.05, 2.0, 0.92)
    assert not sequence.is_complete and np.isnan([sequence.time, sequence.lower, sequence.upper]).all()
    assert 0.0 < sequence.impacts["time"][-1] < np.pi / 2.0
    assert len(first_impacts(1.05, 2.0, 0.92, 100)) == sequence.impacts.size


def test_no_rocking_at_the_threshold_of_uplift():
    sequence = chattering.chattering_sequence(1.0, 2.0, 0.92)
    assert sequence.is_complete and sequence.impacts.size == 0 and sequence.time == 0.0


@pytest.mark.parametrize(("a", "omega", "eta"), [(1.01, 5.0, 0.92), (1.03, 2.0, 0.86)])
def test_intervals_of_every_second_impact_shrink_by_the_square_of_the_restitution(a, omega, eta):
    """The paper's Fig. 3 and Eq. 73: constant from about the 60th impact on."""
    ratios = chattering.interval_ratios(a, omega, eta, 100)
    assert np.abs(ratios[:4] / eta**2 - 1.0).max() > 0.1
    assert ratios[60:] == pytest.approx(eta**2, rel=4e-3)
    distance = np.abs(ratios / eta**2 - 1.0)
    assert np.diff(np.log(distance[40:100:2])) == pytest.approx(2.0 * np.log(eta), rel=0.1)


def test_interval_ratios_end_with_the_sequence():
    ratios = chattering.interval_ratios(1.05, 2.0, 0.92, 50)
    known = chattering.chattering_sequence(1.05, 2.0, 0.92).impacts.size - 2
    assert np.isfinite(ratios[:known]).all() and np.isnan(ratios[known:]).all()
    assert np.isnan(chattering.interval_ratios(1.03, 2.0, 0.01, 200)[-1])
