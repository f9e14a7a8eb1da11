"""Ensembles: the same answers as one simulation at a time, in every dimension of the product."""

import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import rocking
from rocking import Block, Blocks, Certified, Measure, VelocityThreshold, simulate, simulate_many
from rocking.engine import tasks as engine
from rocking.errors import BlockError, OptionError


@pytest.fixture(scope="module")
def records():
    names = ("el-centro-meloland-270", "el-centro-meloland-360", "ridgecrest-tow2-090")
    return [rocking.records.load(name) for name in names]


def random_blocks(count, seed, *, two_sided=False):
    rng = np.random.default_rng(seed)
    shape = (count, 2) if two_sided else count
    return Blocks(
        p=rng.uniform(1.0, 7.0, shape), alpha=rng.uniform(0.06, 0.4, shape), restitution=rng.uniform(0.7, 0.98, shape)
    )


def test_counts_and_times_are_those_of_the_response(records):
    blocks = random_blocks(20, 5)
    result, judged = simulate_many(blocks, records[1], model="linear").isel(motion=0), 0
    for b, block in enumerate(blocks):
        response, cell = simulate(block, records[1], model="linear"), result.isel(block=b)
        if response.ambiguous:
            continue
        judged += 1
        assert len(response.impacts) == int(cell.impacts)
        assert float(cell.time_at_rest) == pytest.approx(response.time_at_rest, abs=1e-6)
        assert float(cell.peak_time) == pytest.approx(response.peak_time, abs=1e-6)
    assert judged >= 10


def test_times_of_uplift_and_rest_are_those_of_the_response(records):
    blocks = random_blocks(30, 6)
    result = simulate_many(blocks, records[0], include_times=True)
    assert not {"first_uplift", "first_rest", "last_rest"} & {*simulate_many(blocks[0], records[0]).data_vars}
    rested = 0
    for b in range(30):
        events, cell = simulate(blocks[b], records[0]).events, result.isel(motion=0, block=b)
        uplifts, rests = ([*events["time"][events["kind"] == kind]] for kind in ("uplift", "rest"))
        expected = [*(uplifts[:1] or [0.0]), *(rests[:1] or [0.0]), *(rests[-1:] or [0.0])]
        found = [float(cell[name]) for name in ("first_uplift", "first_rest", "last_rest")]
        assert np.allclose(found, expected, rtol=0.0, atol=1e-9), b
        rested += bool(rests)
    assert rested >= 4


def test_scales_are_those_of_the_motion(records):
    blocks = random_blocks(10, 7)
    for measure, values in (
        (Measure("factor"), [0.5, 1.5]),
        (Measure("pga"), [1.0, 4.0]),
        (Measure("pgv"), [0.3, 0.9]),
        (Measure("sa", period=0.8), [2.0, 6.0]),
    ):
        result = simulate_many(blocks, records[:2], levels=values, measure=measure)
        assert result.sizes == {"motion": 2, "scale": 2, "block": 10}
        assert result.scale.attrs["measure"] == measure.name
        for m, s in np.ndindex(2, 2):
            scaled = records[m].scaled_to(values[s], measure)
            alone = simulate_many(blocks, scaled)
            assert np.array_equal(result.peak_rotation[m, s], alone.peak_rotation[0])


def test_treatments_are_passed_on(records):
    blocks = random_blocks(20, 10)
    how = VelocityThreshold(1e-3)
    result, judged = simulate_many(blocks, records[1], chattering=how), 0
    for b, block in enumerate(blocks):
        response = simulate(block, records[1], chattering=how)
        if not response.ambiguous:
            assert int(result.impacts[0, b]) == len(response.impacts)
            judged += 1
    assert judged >= 10


def test_one_block_and_lists_of_blocks(records):
    block = Block(half_width=0.2, half_height=1.0)
    alone = simulate_many(block, records[0])
    assert alone.sizes == {"motion": 1, "block": 1}
    pair = simulate_many([block, Block(half_width=0.15, half_height=1.0)], records[:2])
    assert float(pair.peak_rotation[0, 0]) == float(alone.peak_rotation[0, 0])


def test_the_result_can_be_written_and_says_what_it_is(records, tmp_path):
    result = simulate_many(Blocks.grid(p=[2.0, 3.0], alpha=[0.1, 0.2]), records[:2])
    assert result.attrs["program"].startswith("rocking ")
    assert list(result.motion.values) == [motion.name for motion in records[:2]]
    assert result.p.values.tolist() == [2.0, 2.0, 3.0, 3.0]
    assert result.peak_rotation.attrs["units"] == "rad"
    result.to_netcdf(tmp_path / "many.nc", engine="h5netcdf")


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"levels": 1.0, "measure": "pga_ratio"}, "measure must be one of factor, pga, pgv, pgd, sa"),
        ({"levels": 1.0, "measure": "sa"}, r"use rocking\.Measure\(.sa., period=1\.0\)"),
        ({"measure": "pga"}, "levels"),
        ({"polarity": "up"}, "polarity"),
    ],
)
def test_bad_options_are_refused(records, options, word):
    with pytest.raises(OptionError, match=word):
        simulate_many(Block(half_width=0.2, half_height=1.0), records[0], **options)


def test_nothing_to_simulate_is_refused(records):
    with pytest.raises(OptionError, match="at least one motion"):
        simulate_many(Block(half_width=0.2, half_height=1.0), [])
    with pytest.raises(BlockError, match="at least one"):
        simulate_many([], records[0])
    with pytest.raises(OptionError, match="give duration to limit the simulation"):
        simulate_many(Blocks(p=[1.0, 2.0], alpha=0.1, restitution=[0.9, 1.0]), records[0])


def test_an_interrupt_reaches_the_tasks_in_hand(monkeypatch):
    setup, task = (
        engine.Setup(Block.from_parameters(2.0, 0.2).as_bodies(), "linear", Certified()),
        engine.Task(slice(None), (rocking.pulses.one_sine(1.0, 1.0),)),
    )
    begun, told = threading.Event(), []

    def held(setup, task, cancelled):
        begun.set()
        late = time.monotonic() + 20.0
        while not cancelled.is_set() and time.monotonic() < late:
            time.sleep(0.001)
        told.append(cancelled.is_set())

    def tasks():
        yield task
        assert begun.wait(60.0)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(engine, "simulate_task", held)
        with pytest.raises(KeyboardInterrupt), rocking.set_options(threads=2):
            [*engine.simulate_tasks(setup, tasks())]
    assert told == [True]


def test_a_task_that_is_told_to_stop_follows_no_body_any_further(monkeypatch, records):
    setup, task = engine.Setup(random_blocks(3, 1), "linear", Certified()), engine.Task(slice(None), (records[2],))
    marched, cancelled = [], threading.Event()
    march = engine._march_together
    monkeypatch.setattr(engine, "_march_together", lambda *given: marched.append(given) or march(*given))
    engine.simulate_task(setup, task, cancelled)
    assert len(marched) >= 1
    cancelled.set()
    marched.clear()
    engine.simulate_task(setup, task, cancelled)
    assert not marched


@pytest.mark.slow
def test_a_million_blocks_fit_into_a_gibibyte(records):
    probe = (
        "import numpy as np, resource, rocking\n"
        "blocks = rocking.Blocks(p=np.linspace(1, 6, 1_000_000), alpha=0.35, restitution=0.9)\n"
        "motion = rocking.records.load('el-centro-meloland-up')\n"
        "result = rocking.simulate_many(blocks, motion, model='linear')\n"
        "assert result.sizes['block'] == 1_000_000\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)\n"
    )
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 1024.0
