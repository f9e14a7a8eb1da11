"""A simulation that its duration stops has no verdict: it says where the block is, and that this is all it knows."""

import json
import math

import numpy as np
import pytest

import rocking
from rocking import Block, Blocks, errors, simulate, simulate_many
from rocking.analysis.survey import survey

RECORD = "el-centro-meloland-270"
SIZES = ["--width", 0.24, "--height", 1.1]


@pytest.fixture(scope="module")
def record():
    return rocking.records.load(RECORD)


@pytest.fixture(scope="module")
def block():
    return Block(width=0.24, height=1.1)


@pytest.fixture(scope="module")
def whole(block, record):
    return simulate(block, record)


@pytest.mark.parametrize(
    ("duration", "says"),
    [(1.0, "has not moved by 1 s"), (4.5, "still rocking at 4.5 s"), (6.0, "not yet fallen at 6 s")],
)
def test_a_stopped_response_says_where_the_block_is_and_gives_no_verdict(duration, says, block, record):
    response = simulate(block, record, duration=duration)
    assert response.ended_early and not response.overturned
    found = survey(block, {RECORD: record}, duration=duration)
    for text in (repr(response), response.summary(), found.summary()):
        assert says in text
        assert "does not overturn" not in text and "does not move" not in text
    assert f"the motion goes on to {record.duration:.6g} s" in response.summary()
    assert "undecided under 1" in found.summary()
    assert response.to_dict()["ended_early"] is True
    assert found.rows()[0]["ended_early"] is True
    assert response.to_xarray().attrs["ended_early"] == 1


def test_the_whole_response_is_not_stopped(whole, block, record):
    assert whole.overturned and not whole.ended_early
    assert not simulate(block, record, duration=2.0 * record.duration).ended_early
    assert not simulate(Block(width=0.5, height=2.0), record).ended_early
    assert not survey(block, {RECORD: record}).rows()[0]["ended_early"]


def test_a_block_that_is_stopped_beyond_its_balance_point_tips_when_it_does_in_the_whole_response(whole, block, record):
    stopped = simulate(block, record, duration=0.5 * (whole.tipping_time + whole.overturn_time))
    assert stopped.tipping_time == pytest.approx(whole.tipping_time, abs=1e-12)
    assert f"beyond its balance point since {whole.tipping_time:.4f} s" in stopped.summary()
    # Contact is looked at until it tips, as in the whole response.
    assert stopped.required_friction == pytest.approx(whole.required_friction, rel=1e-12)


def test_a_block_at_rest_when_it_is_stopped_is_at_rest_until_then(record):
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    settled = simulate(block, record)
    rest = float(settled.events["time"][settled.events["kind"] == "rest"][-1])
    assert rest < record.duration - 0.5
    stopped = simulate(block, record, duration=rest + 0.25)
    assert stopped.ended_early and not stopped.moves_at_end and math.isnan(stopped.tipping_time)
    assert f"at rest at {rest + 0.25:.6g} s" in stopped.summary()
    after = simulate(block, record, duration=record.duration)
    assert not after.ended_early
    assert "stands in 5 of 5 motions" in after.summary()


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_a_block_that_still_rocks_when_the_motion_ends_is_stopped_there_and_not_decided(model, tmp_path):
    """`duration` is that of the motion: nothing of it is to come, and yet the block may rest or fall."""
    block, motion = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9), rocking.pulses.one_sine(3.0, 1.0)
    response = simulate(block, motion, model=model, duration=motion.duration)
    assert response.ended_early and response.moves_at_end and not response.overturned
    assert f"still rocking at {motion.duration:.6g} s, where the simulation was stopped" in response.summary()
    assert "goes on" not in response.summary()
    still = Block.from_parameters(p=2.0, alpha=0.4, restitution=0.9)
    assert not simulate(still, motion, model=model, duration=motion.duration).ended_early
    options = {"levels": [0.5, 1.0], "model": model, "duration": motion.duration}
    many = simulate_many([block, still], motion, **options)
    assert many.ended_early.values[0].tolist() == [[False, False], [True, False]]
    assert not many.overturned.values.any()
    study = rocking.create_study(tmp_path, Blocks(p=2.0, alpha=[0.2, 0.4], restitution=0.9), motion, **options)
    with rocking.set_options(threads=1):
        study.run()
    with pytest.raises(errors.StudyError, match="their outcomes are unknown: create the study without a duration"):
        study.fragility()


def test_free_rocking_is_stopped_where_the_block_still_moves(block):
    response = simulate(block, None, initial_rotation=0.1, duration=0.3)
    assert response.ended_early
    assert "within 3e-6; still rocking at 0.3 s, where the simulation was stopped\n" in response.summary()
    assert not simulate(block, None, initial_rotation=0.1, duration=100.0).ended_early


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_an_ensemble_marks_what_was_stopped_as_single_simulations_do(model, record):
    blocks = Blocks.grid(p=[1.5, 3.0, 4.5], alpha=[0.1, 0.2, 0.3], restitution=[0.9])
    for duration in (None, 1.0, 5.0, 12.0, 45.0):
        many = simulate_many(blocks, record, model=model, duration=duration, levels=[0.5, 1.0])
        single = [
            [simulate(block, record.scaled(factor), model=model, duration=duration).ended_early for block in blocks]
            for factor in (0.5, 1.0)
        ]
        np.testing.assert_array_equal(many.ended_early.values[0], single)
        assert duration is None or many.ended_early.any() == (duration < record.duration)


def test_the_command_line_gives_no_verdict_on_what_it_stopped(run):
    code, out, _ = run("simulate", RECORD, *SIZES, "--duration", 6)
    assert code == 0
    assert "not yet fallen at 6 s, where the simulation was stopped" in out
    assert "does not overturn" not in out
    result = json.loads(run("simulate", RECORD, *SIZES, "--duration", 6, "--json")[1])
    assert (result["overturned"], result["ended_early"]) == (False, True)


def test_an_unfinished_response_has_no_verdict_either(block, few_steps):
    with few_steps(5):
        response = simulate(block, rocking.pulses.sine(3.0, 1.0, cycles=20))
    assert response.unfinished and not response.ended_early
    assert "does not overturn" not in repr(response) + response.summary()
