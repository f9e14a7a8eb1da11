"""Impacts of a proven sequence, passed in one go, against the same ones taken one by one."""

import math

import numpy as np
import pytest
from kernel_structs import in_units_of_g, long_uncompiled, rocking_block, rules_for, state_of
from numpy.testing import assert_array_equal
from test_kernels_march import Run, record, run, with_rows

from rocking.kernels import state
from rocking.kernels.ground import Ground
from rocking.kernels.rest import apply_proven_impacts
from rocking.kernels.state import PROVEN_PER_ITERATION, Struct, has_space

pytestmark = pytest.mark.usefixtures("parts_run_by_python")


def one_by_one(ground: Ground) -> Ground:
    """The same motion as a parabola without curvature, which takes the long way."""
    rows = np.zeros((len(ground.pieces) - 1, 3))
    rows[:, :2] = ground.pieces[:-1, 2:4]
    return with_rows(ground, rows)


def passed(ground: Ground, start: Struct, *, rows: int = 100, left: float = 9.0, e: float = 0.9) -> Struct:
    """State after the impacts that can be passed."""
    table = state.create_table(rows)
    apply_proven_impacts(ground, rocking_block(e=(e, e)), rules_for(), table, start, left)
    return start


def proven(v: float, *, peak: float = 1.0, proof_speed: float = 1e-5, offset: float = 0.0) -> Struct:
    """Just after an impact from which chattering has been proven."""
    return state_of(0, 0.0, v, peak=peak, certificate_speed=proof_speed, proven_impacts=1, offset=offset)


STEADY = in_units_of_g([0.0, 9.0], [[0.02, 0.01]])


def assert_same_course(one: Run, other: Run) -> None:
    assert one.kinds == other.kinds
    assert len(one.impacts) == len(other.impacts)
    assert one.impacts["time"] == pytest.approx(other.impacts["time"], abs=1e-11)
    assert one.impacts["speed_before"] == pytest.approx(other.impacts["speed_before"], rel=1e-9)
    assert one.events["time"] == pytest.approx(other.events["time"], abs=1e-11)
    assert one.at["peak"] == pytest.approx(other.at["peak"], rel=1e-12)
    assert one.at["peak_time"] == pytest.approx(other.at["peak_time"], abs=1e-7)


@long_uncompiled
@pytest.mark.parametrize("seed", range(8))
def test_impacts_in_one_go_are_those_taken_one_by_one(seed: int) -> None:
    assert_same_course(run(record(seed)), run(one_by_one(record(seed))))


def test_a_rest_within_the_piece_is_that_of_the_impacts_taken_one_by_one() -> None:
    found = run(STEADY, velocity=0.02)
    assert found.events["time"][-1] < 9.0
    assert len(found.impacts) > 20
    assert_same_course(found, run(one_by_one(STEADY), velocity=0.02))


def test_impacts_are_passed_down_to_the_speed_that_is_worth_a_proof() -> None:
    found = passed(STEADY, proven(1e-3))
    assert found["impact_count"] > 30
    assert found["proven_impacts"] == found["impact_count"] + 1
    assert found["budget"] == 10**6 - found["impact_count"]
    assert 1e-5 < found["v"] < 1.2e-5
    assert found["last_impact_time"] == found["offset"]


def test_a_peak_among_proven_impacts_is_not_lost() -> None:
    """An arc that might be the highest so far is left to a closer look; the first of them ends the passing."""
    v, g = 1e-3, 4.0 * (0.15 + 0.02)
    height = v * v / (2.0 * g)
    assert passed(STEADY, proven(v, peak=0.5 * height))["impact_count"] == 0
    assert passed(STEADY, proven(v, peak=1.01 * height))["impact_count"] == 0  # is not seen at a glance
    assert passed(STEADY, proven(v, peak=5.0 * height))["impact_count"] > 30


def test_the_peak_of_a_response_may_lie_within_a_proven_sequence() -> None:
    """The first arc is on the side that is pressed down more; those on the other, all after the proof, are higher."""
    ground = in_units_of_g([0.0, 0.02, 60.0], [[-0.3, 0.0], [0.1, 0.0]])
    found, expected = run(ground), run(one_by_one(ground))
    assert found.at["peak_time"] > found.sequences["start"][0] == found.impacts["time"][0]
    assert_same_course(found, expected)


def test_nothing_is_passed_beyond_the_end_of_the_piece() -> None:
    flight = 2.0 * 1e-3 / (4.0 * 0.17)
    assert passed(STEADY, proven(1e-3), left=0.99 * flight)["impact_count"] == 0
    found = passed(STEADY, proven(1e-3), left=1.01 * flight)
    assert found["impact_count"] == 1
    assert found["offset"] == pytest.approx(flight, rel=1e-2)


def test_a_turn_passes_no_more_impacts_than_every_table_has_space_for() -> None:
    found = passed(STEADY, proven(1e-3), e=0.99)
    assert found["impact_count"] == found["node_count"] == PROVEN_PER_ITERATION
    assert not has_space(rules_for(), state.create_table(PROVEN_PER_ITERATION + 2), proven(1e-3))
    assert has_space(rules_for(), state.create_table(PROVEN_PER_ITERATION + 3), proven(1e-3))


@long_uncompiled
def test_a_table_that_is_full_within_a_proven_sequence_changes_no_bit() -> None:
    whole = run(STEADY, velocity=0.02)
    for rows in range(3, len(whole.nodes) + 2):
        found = run(STEADY, velocity=0.02, rows=rows)
        assert_array_equal(found.impacts, whole.impacts)
        assert_array_equal(found.nodes, whole.nodes)


def test_not_a_number_passes_nothing() -> None:
    assert passed(STEADY, proven(math.nan))["impact_count"] == 0
    assert passed(in_units_of_g([0.0, 9.0], [[math.nan, 0.0]]), proven(1e-3))["impact_count"] == 0
