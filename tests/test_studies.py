"""Studies: resumed after anything, byte for byte; every damage seen; nobody runs one twice at once."""

import errno
import itertools
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from studies_seen import RUNS, after_each_unit, digest, store_of

import rocking
from rocking import errors
from rocking.studies import batches
from rocking.studies import folder as folders
from rocking.studies.batches import OUTCOMES, BatchGrid, decode, format_key

BLOCKS = rocking.Blocks(p=np.linspace(1.0, 6.0, 1300), alpha=0.2, restitution=0.7)
MOTIONS = [rocking.pulses.one_sine(4.0, frequency) for frequency in (0.5, 1.0, 2.0)]
OPTIONS = {"levels": [2.0, 4.0], "measure": "pga", "polarity": "both", "model": "linear", "blocks_per_batch": 512}

SCRIPT = """
import sys
import numpy as np, rocking
blocks = rocking.Blocks(p=np.linspace(1.0, 6.0, 1300), alpha=0.2, restitution=0.7)
motions = [rocking.pulses.one_sine(4.0, frequency) for frequency in (0.5, 1.0, 2.0)]
scales = {"levels": [2.0, 4.0], "measure": "pga", "polarity": "both"}
study = rocking.create_study(sys.argv[1], blocks, motions, **scales, model="linear", blocks_per_batch=512)
print("ready", flush=True)
with rocking.set_options(threads=int(sys.argv[2])):
    report = study.run(part=sys.argv[3] if sys.argv[3:] else None)
print(report.ended_early)
"""


def made(folder, *, blocks=BLOCKS, **changes):
    return rocking.create_study(folder, blocks, MOTIONS, **(OPTIONS | changes))


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    folder = tmp_path_factory.mktemp("complete")
    with rocking.set_options(threads=1):
        made(folder).run()
    return folder


@pytest.fixture(scope="module")
def reference():
    options = {name: value for name, value in OPTIONS.items() if name != "blocks_per_batch"}
    return rocking.simulate_many(BLOCKS, MOTIONS, **options)


def test_a_study_is_what_simulate_many_computes(complete, reference):
    xr.testing.assert_identical(rocking.Study(complete).results().load(), reference)


def test_any_selection_of_the_results_is_that_of_the_whole(complete, reference):
    lazy = rocking.Study(complete).results()
    for part in (
        {"motion": 1, "block": slice(500, 530)},
        {"scale": [1], "block": [3, 600, 1299]},
        {"polarity": 0, "block": slice(None, None, 400)},
        {"block": -1},
    ):
        xr.testing.assert_identical(lazy.isel(part).load(), reference.isel(part))


@pytest.mark.thorough
def test_units_may_hold_several_motions_scales_and_polarities(reference, tmp_path, monkeypatch):
    monkeypatch.setattr(RUNS, "choose_batch_shape", lambda product, blocks_per_batch: (2, 1, 2, 1024))
    study = made(tmp_path, blocks_per_batch=None)
    keys = list(store_of(study).grid)
    assert len(keys) == 2 * 2 * 1 * 2
    assert sum(map(store_of(study).grid.count_simulations, keys)) == reference.overturned.size
    with rocking.set_options(threads=2):
        study.run()
    xr.testing.assert_identical(rocking.Study(tmp_path).results().load(), reference)
    lazy = rocking.Study(tmp_path).results()
    for part in ({"motion": [2, 0], "block": [1299, 5]}, {"polarity": 1, "scale": 0}, {"motion": -1, "block": -1}):
        xr.testing.assert_identical(lazy.isel(part).load(), reference.isel(part))
    (tmp_path / "batches" / format_key(keys[3])).unlink()
    found = rocking.Study(tmp_path).results().load()
    np.testing.assert_array_equal(np.isnan(found.impacts.values), ~found.done.values)
    assert (~found.done.values).sum() == store_of(study).grid.count_simulations(keys[3])


@pytest.mark.parametrize(
    ("blocks", "motions", "scales"),
    [
        *((1, 40, 3), (3_000, 2, 2)),
        *(pytest.param(*sizes, marks=pytest.mark.thorough) for sizes in ((1, 200, 5), (700, 3, 20), (9_000, 2, 2))),
    ],
)
def test_a_study_is_cut_into_some_dozens_of_units_whatever_it_is_long_of(tmp_path, blocks, motions, scales):
    pulses = [rocking.pulses.one_sine(4.0, frequency) for frequency in np.linspace(0.5, 2.0, motions)]
    many = rocking.Blocks(p=np.linspace(1.0, 6.0, blocks), alpha=0.2, restitution=0.7)
    study = rocking.create_study(tmp_path, many, pulses, levels=np.linspace(0.5, 2.0, scales), model="linear")
    assert 20 <= len(store_of(study).grid) <= 120
    sizes = list(map(store_of(study).grid.count_simulations, store_of(study).grid))
    assert sum(sizes) == blocks * motions * scales
    study.run()
    stored = sum(path.stat().st_size for path in (tmp_path / "batches").iterdir())
    assert stored < 2.5 * 64 * sum(sizes)


@pytest.mark.cases(fast=2)
@pytest.mark.parametrize("how", ["two threads", "processes", "reversed order", "parts"])
def test_whoever_computes_it_the_store_is_the_same_to_the_byte(complete, tmp_path, how, monkeypatch):
    study = made(tmp_path)
    if how == "two threads":
        with rocking.set_options(threads=2):
            study.run()
    elif how == "processes":
        with ProcessPoolExecutor(2) as pool:
            study.run(executor=pool)
    elif how == "parts":
        with rocking.set_options(threads=1):
            counts = [study.run(part=part).batch_count for part in ("3/5", "1/5", "2/5", "5/5", "4/5")]
        assert sum(counts) == study.status.batch_count == 36 and max(counts) - min(counts) <= 1
        assert study.run().batch_count == 0
    else:
        keys = list(store_of(study).grid)
        monkeypatch.setattr(BatchGrid, "__iter__", lambda self: iter(keys[::-1]))
        with rocking.set_options(threads=1):
            study.run()
    assert digest(tmp_path) == digest(complete)


def kill_again_and_again(folder, times, rng, least=0):
    """Run the study in a process that is killed at a random moment, so many times; the batches that were seen stay.

    A moment comes after the least number of batches is there.
    """
    seen = {}
    for _ in range(times):
        command = [sys.executable, "-c", SCRIPT, str(folder), "2"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
            process.stdout.readline()
            while len([*(folder / "batches").glob("batch.*")]) < least:
                assert process.poll() is None
            time.sleep(float(rng.uniform(0.0, 0.15)))
            process.send_signal(signal.SIGKILL)
        batches = {path.name: path.read_bytes() for path in (folder / "batches").glob("batch.*")}
        assert seen.items() <= batches.items()
        seen = batches
    return seen


@pytest.mark.parametrize("times", [1, pytest.param(2, marks=pytest.mark.thorough)])
@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
def test_a_killed_study_loses_no_batch_and_goes_on_to_the_same_bytes(complete, tmp_path, times):
    seen = kill_again_and_again(tmp_path, times, np.random.default_rng(0), least=1)
    study = made(tmp_path)
    report = study.run()
    assert not report.failures
    assert seen and report.batch_count == len(store_of(study).grid) - len(seen)
    assert digest(tmp_path) == digest(complete)
    assert not list(tmp_path.rglob(".*.part*"))


@pytest.mark.thorough
@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
def test_parts_that_run_at_the_same_time_and_are_killed_are_completed_to_the_same_bytes(complete, tmp_path):
    made(tmp_path)
    commands = [[sys.executable, "-c", SCRIPT, str(tmp_path), "1", f"{number}/3"] for number in (1, 2, 3)]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for command in commands]
    running[1].stdout.readline()
    while len([*(tmp_path / "batches").glob("batch.*")]) < 2:
        assert running[1].poll() is None or running[0].poll() is None
    running[1].send_signal(signal.SIGKILL)
    for process in running:
        process.communicate()
    assert [process.returncode for process in running] == [0, -signal.SIGKILL, 0]
    study = made(tmp_path)
    assert 24 <= study.status.done_count <= 36
    study.run()
    assert study.status.is_complete and digest(tmp_path) == digest(complete)


def test_what_a_crash_left_half_written_is_removed(complete, tmp_path):
    study = made(tmp_path)
    (tmp_path / "batches").mkdir()
    (tmp_path / "batches" / ".abc.part").write_bytes(b"half")
    study.run()
    assert digest(tmp_path) == digest(complete)


def test_sigterm_finishes_the_units_in_hand(complete, tmp_path, monkeypatch):
    study = made(tmp_path)
    with monkeypatch.context() as patched:
        after_each_unit(patched, lambda: signal.raise_signal(signal.SIGTERM))
        with rocking.set_options(threads=1):
            report = study.run()
    assert report.ended_early and 1 <= report.batch_count == study.status.done_count <= 3
    assert "stopped, run again to continue" in str(report)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    study.run()
    assert digest(tmp_path) == digest(complete)


@pytest.mark.thorough
@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
def test_sigterm_of_another_process_finishes_the_units_in_hand(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(tmp_path), "1"], stdout=subprocess.PIPE, text=True
    ) as process:
        while not [*(tmp_path / "batches").glob("batch.*")]:
            assert process.poll() is None
            time.sleep(0.001)
        process.send_signal(signal.SIGTERM)
        assert process.stdout.read().splitlines() == ["ready", "True"]
        assert process.wait() == 0


def test_ctrl_c_stops_in_the_middle_of_a_unit(complete, tmp_path, monkeypatch):
    study, numbers, stopped = made(tmp_path), itertools.count(), []

    def compute(work, cancelled):
        if next(numbers):
            cancelled.wait(30.0)
        stopped.append(cancelled.is_set())
        return batches.compute_batch(work)

    with monkeypatch.context() as patched:
        patched.setattr(RUNS, "compute_batch", compute)
        after_each_unit(patched, lambda: signal.raise_signal(signal.SIGINT))
        with pytest.raises(KeyboardInterrupt), rocking.set_options(threads=2):
            study.run()
    assert stopped.count(False) == 1  # the batch that is stored
    assert len(stopped) == next(numbers) > 1
    assert study.status.done_count == 1
    study.run()
    assert digest(tmp_path) == digest(complete)


class Broken(ThreadPoolExecutor):
    """Workers that are gone after a few batches."""

    left = 4

    def submit(self, function, /, *arguments):
        self.left -= 1
        if self.left >= 0:
            return super().submit(function, *arguments)
        lost = Future()
        lost.set_exception(BrokenExecutor("a process ended abruptly"))
        return lost


def test_workers_that_are_gone_end_the_run_and_another_one_goes_on(complete, tmp_path):
    study = made(tmp_path)
    with (
        Broken(1) as pool,
        pytest.raises(errors.StudyError, match="the workers were lost: a process ended abruptly; computed"),
    ):
        study.run(executor=pool)
    assert study.status.done_count <= 4
    study.run()
    assert digest(tmp_path) == digest(complete)


def test_units_that_failed_are_computed_by_the_next_run(complete, tmp_path, monkeypatch):
    study = made(tmp_path)

    def broken(work, stop):
        raise ArithmeticError("no luck")

    with monkeypatch.context() as patched:
        patched.setattr(RUNS, "compute_batch", broken)
        with rocking.set_options(threads=1):
            report = study.run()
    assert set(report.failures.values()) == {"ArithmeticError: no luck"}
    assert len(report.failures) == 36 and study.status.done_count == 0
    assert not study.run().failures
    assert digest(tmp_path) == digest(complete)


class Failing:
    """The n-th call of a function of the operating system fails."""

    def __init__(self, function, n, code):
        self.function, self.left, self.code = function, n, code

    def __call__(self, *arguments, **options):
        self.left -= 1
        if self.left == 0:
            raise OSError(self.code, os.strerror(self.code))
        return self.function(*arguments, **options)


def small(folder):
    """Study of three batches."""
    return rocking.create_study(folder, BLOCKS, MOTIONS[:1], model="linear", blocks_per_batch=512)


@pytest.fixture(scope="module")
def small_complete(tmp_path_factory):
    folder = tmp_path_factory.mktemp("small")
    with rocking.set_options(threads=1):
        small(folder).run()
    return folder


@pytest.mark.cases(fast=6)
@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO])
@pytest.mark.parametrize("call", ["fsync", "open", "write", "rename"])
@pytest.mark.parametrize("n", [1, 2, 3, 5, 6, 9])
def test_a_write_that_fails_is_one_sentence_and_leaves_nothing_half_visible(
    small_complete, tmp_path, monkeypatch, call, n, code
):
    with monkeypatch.context() as patched:
        if call == "rename":
            failing = Failing(Path.rename, n, code)
            patched.setattr(Path, "replace", lambda self, target: failing(self, target))
        elif call == "write":
            patched.setattr(folders, "write_bytes", Failing(folders.write_bytes, n, code))
        else:
            patched.setattr(folders.os, call, Failing(getattr(os, call), n, code))
        try:
            with rocking.set_options(threads=1):
                small(tmp_path).run()
        except rocking.RockingError as error:
            assert os.strerror(code) in str(error)
            assert "\n" not in str(error)
    for path in (tmp_path / "batches").glob("batch.*"):
        assert path.read_bytes() == (small_complete / "batches" / path.name).read_bytes()
    with rocking.set_options(threads=1):
        small(tmp_path).run()
    assert digest(tmp_path) == digest(small_complete)
    assert not list(tmp_path.rglob(".*.part*"))


def test_every_changed_bit_and_every_cut_of_a_batch_is_seen(complete):
    data, batch = (complete / "batches" / "batch.1.1.0.2").read_bytes(), (1, 1, 1, 512)
    rng = np.random.default_rng(0)
    assert decode(data, batch).shape == (len(OUTCOMES), *batch)
    for _ in range(500):
        changed = bytearray(data)
        changed[rng.integers(len(data))] ^= 1 << rng.integers(8)
        assert decode(bytes(changed), batch) is None
        assert decode(data[: rng.integers(len(data))], batch) is None


def test_a_damaged_batch_is_named_and_computed_again_on_request(complete, tmp_path):
    study = made(tmp_path)
    study.run()
    path = tmp_path / "batches" / "batch.1.1.0.2"
    sound = path.read_bytes()
    path.write_bytes(sound[:-9] + b"\0" + sound[-8:])
    assert study.results().peak_rotation.isel(motion=0).load().size  # other batches can be read
    with pytest.raises(errors.StudyError, match=r"batch\.1\.1\.0\.2 is damaged"):
        study.results().load()
    (fault,) = study.verify()
    assert "batch.1.1.0.2" in fault
    study.verify(repair=True)
    assert study.verify(recompute_count=3) == []
    assert path.read_bytes() == sound


def test_a_study_that_may_not_be_written_to_can_be_opened(tmp_path, monkeypatch):
    made(tmp_path).run()

    def refuse(*_):
        raise AssertionError("nothing is written when a study is opened")

    monkeypatch.setattr(folders, "write_atomically", refuse)
    assert rocking.Study(tmp_path).results().peak_rotation.load().size


def test_a_batch_that_is_another_s_is_found_by_computing_it_again(small_complete, tmp_path):
    shutil.copytree(small_complete, tmp_path, dirs_exist_ok=True)
    study = rocking.Study(tmp_path)
    names = [format_key(key) for key in store_of(study).grid]
    assert study.verify(recompute_count=len(names)) == []
    (tmp_path / "batches" / names[0]).write_bytes((tmp_path / "batches" / names[1]).read_bytes())
    assert study.verify() == []
    assert any(names[0] in fault for fault in study.verify(recompute_count=len(names)))


def test_damage_to_what_describes_a_study_is_seen(tmp_path):
    made(tmp_path)
    name = "study.npz"
    data = (tmp_path / name).read_bytes()
    rng = np.random.default_rng(2)
    for _ in range(60):
        changed = bytearray(data)
        changed[rng.integers(len(data))] ^= 1 << rng.integers(8)
        (tmp_path / name).write_bytes(changed)
        with pytest.raises(errors.StudyError, match="damaged"):
            rocking.Study(tmp_path)
    (tmp_path / name).write_bytes(data[:-3])
    with pytest.raises(errors.StudyError, match="damaged"):
        rocking.Study(tmp_path)


def test_what_is_missing_is_never_read_as_a_result(complete, tmp_path):
    study = made(tmp_path)
    (tmp_path / "batches").mkdir()
    for path in list((complete / "batches").glob("batch.*"))[::2]:
        (tmp_path / "batches" / path.name).write_bytes(path.read_bytes())
    found = study.results().load()
    assert 0 < int(found.done.sum()) < found.done.size
    for name in ("overturned", "peak_rotation", "impacts"):
        np.testing.assert_array_equal(np.isnan(found[name].values), ~found.done.values)
    assert not study.status.is_complete


def test_a_batch_that_goes_while_it_is_read_is_no_zero(complete, tmp_path):
    study = made(tmp_path)
    study.run()
    results = study.results()
    (tmp_path / "batches" / "batch.0.0.0.0").unlink()
    with pytest.raises(errors.StudyError, match=r"batch\.0\.0\.0\.0 was removed"):
        results.load()


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"levels": [2.0, 4.5]}, "scales/values"),
        ({"model": "nonlinear"}, "rules/model"),
        ({"chattering": "velocity"}, "rules/chattering"),
        ({"duration": 3.0}, "rules/duration"),
        ({"polarity": "-"}, "rules/polarity"),
        ({"measure": "pgv"}, "scales/measure"),
    ],
)
def test_other_inputs_are_refused_by_name(tmp_path, changes, part):
    made(tmp_path)
    with pytest.raises(errors.StudyError, match=part):
        made(tmp_path, **changes)


def test_other_blocks_and_motions_are_refused_by_name(tmp_path):
    made(tmp_path)
    with pytest.raises(errors.StudyError, match="blocks/p"):
        rocking.create_study(tmp_path, BLOCKS.select(slice(0, 1299)), MOTIONS, **OPTIONS)
    with pytest.raises(errors.StudyError, match="motions/1 changed"):
        rocking.create_study(tmp_path, BLOCKS, [MOTIONS[0], MOTIONS[1].scaled(1.1), MOTIONS[2]], **OPTIONS)
    with pytest.raises(errors.StudyError, match="motions/2 changed"):
        rocking.create_study(tmp_path, BLOCKS, MOTIONS[:2], **OPTIONS)


def test_another_version_may_read_a_study_but_not_go_on_with_it(tmp_path, monkeypatch):
    study = made(tmp_path)
    monkeypatch.setattr("rocking.studies.folder.identify_program", lambda: "rocking 9.9.9 (kernels 0)")
    assert rocking.Study(tmp_path).results().sizes["block"] == 1300
    for compute in (study.run, lambda: study.verify(recompute_count=1), lambda: study.verify(repair=True)):
        with pytest.raises(errors.StudyError, match=r"9\.9\.9"):
            compute()
    assert study.verify() == []


@pytest.mark.parametrize("executor", [3, "tcp://127.0.0.1:8786", ProcessPoolExecutor])
def test_what_is_no_executor_is_refused_before_a_unit(tmp_path, executor):
    study = made(tmp_path)
    with pytest.raises(errors.OptionError, match=r"^executor must be a concurrent.futures.Executor or a client of"):
        study.run(executor=executor)
    assert study.status.done_count == 0


COLUMNS = [
    *("motion", "pga_m_s2", "polarity", "block", "pulse_amplitude_m_s2", "pulse_frequency_Hz", "pulse_cycles"),
    *("pulse_phase_rad", "p_rad_s", "alpha_rad", "restitution", "overturned"),
    *(
        "peak_rotation_rad",
        "residual_rotation_rad",
        "peak_time_s",
        "impacts_resolved",
        "uplifts",
        "rests",
        "time_at_rest_s",
        "complete_chattering",
    ),
    *("rests_by_rounding", "leans", "unfinished", "ended_early"),
]


@pytest.mark.thorough
def test_a_study_is_exported(tmp_path, reference):
    pandas = pytest.importorskip("pandas")
    study, reference = made(tmp_path / "study", blocks=BLOCKS.select(slice(0, 50))), reference.isel(block=slice(0, 50))
    with rocking.set_options(threads=1):
        study.run()
    study.to_netcdf(tmp_path / "all.nc")
    with xr.open_dataset(tmp_path / "all.nc", engine="h5netcdf") as found:
        np.testing.assert_array_equal(found.peak_rotation.values, reference.peak_rotation.values)
    study.to_csv(tmp_path / "all.csv")
    table = pandas.read_csv(tmp_path / "all.csv")
    assert [*table.columns] == COLUMNS
    np.testing.assert_array_equal(table.peak_rotation_rad, reference.peak_rotation.values.ravel())
    assert table.iloc[50][["pga_m_s2", "polarity", "block"]].tolist() == [2.0, "-", 0]
    with pytest.raises(errors.OutputError, match="cannot be written"):
        study.to_csv(tmp_path / "none" / "all.csv")


def test_a_study_is_exported_to_parquet_or_says_what_is_missing(complete, tmp_path, reference, monkeypatch):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    study = rocking.Study(complete)
    study.to_parquet(tmp_path / "all.parquet")
    found = pandas.read_parquet(tmp_path / "all.parquet")
    assert [*found.columns] == COLUMNS
    np.testing.assert_array_equal(found.impacts_resolved, reference.impacts.values.ravel())
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(errors.OptionError, match=r"pip install '\.\[parquet\]' in the source folder"):
        study.to_parquet(tmp_path / "other.parquet")


def test_units_have_names_of_their_own_and_other_files_are_none(tmp_path):
    study = made(tmp_path)
    names = [format_key(key) for key in store_of(study).grid]
    assert len({*names}) == len(store_of(study).grid) == 36 and names[-1] == "batch.2.1.1.2"
    (tmp_path / "batches").mkdir()
    for name in ("batch.1.2.3", "batch.3.0.0.0", "batch.a.0.0.0", "batch.0.2.0.0", "batch.0.0.0.0.0", "batch."):
        (tmp_path / "batches" / name).touch()
    assert study.status.done_count == 0


@pytest.mark.parametrize("width", [0, 100, 513, 1.5])
def test_units_are_whole_groups_of_blocks(tmp_path, width):
    with pytest.raises(errors.OptionError, match="blocks_per_batch"):
        made(tmp_path, blocks_per_batch=width)


def test_a_vertical_component_is_part_of_a_study(tmp_path):
    """It is kept, computed with, and noticed when it is another one."""
    both = MOTIONS[0].with_vertical(MOTIONS[1])
    one = rocking.create_study(tmp_path / "study", BLOCKS, both)
    with rocking.set_options(threads=1):
        one.run()
    again = rocking.Study(tmp_path / "study").results().load()
    assert np.array_equal(again.peak_rotation, rocking.simulate_many(BLOCKS, both).peak_rotation)
    assert not np.array_equal(again.peak_rotation, rocking.simulate_many(BLOCKS, MOTIONS[0]).peak_rotation)
    for other in (MOTIONS[0], MOTIONS[0].with_vertical(-MOTIONS[1])):
        with pytest.raises(errors.StudyError, match="motions/0"):
            rocking.create_study(tmp_path / "study", BLOCKS, other)


def test_bodies_of_another_kind_with_the_same_numbers_are_another_study(tmp_path):
    motion = rocking.pulses.one_sine(4.0, 1.0)
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    pendulum = rocking.dynamics.InvertedPendulum(p=2.0, gap=0.2, restitution=0.9)
    rocking.create_study(tmp_path / "one", block, motion, model="linear", blocks_per_batch=512).run()
    rocking.create_study(tmp_path / "other", pendulum, motion, model="linear", blocks_per_batch=512).run()
    for folder, bodies in (("one", pendulum), ("other", block)):
        with pytest.raises(errors.StudyError, match="of other inputs"):
            rocking.create_study(tmp_path / folder, bodies, motion, model="linear", blocks_per_batch=512)
    again = rocking.create_study(tmp_path / "other", pendulum, motion, model="linear", blocks_per_batch=512)
    assert float(again.results().peak_rotation.max()) == pytest.approx(0.2)


def test_a_study_that_another_process_creates_meanwhile_is_opened(tmp_path, monkeypatch):
    pilot, motion = RUNS.choose_batch_shape, rocking.pulses.one_sine(4.0, 1.0)
    blocks = rocking.Blocks(p=np.linspace(1.0, 6.0, 1300), alpha=0.2, restitution=0.9)

    def slow(product, blocks_per_batch):
        monkeypatch.setattr(RUNS, "choose_batch_shape", pilot)
        rocking.create_study(tmp_path, blocks, motion, blocks_per_batch=512).run()
        return (1, 1, 1, 1024)

    monkeypatch.setattr(RUNS, "choose_batch_shape", slow)
    study = rocking.create_study(tmp_path, blocks, motion)
    assert study.results().sizes["block"] == 1300
    assert not study.verify()


def test_a_symmetric_block_counts_once_beside_others(tmp_path):
    """Both polarities are one outcome of it, whatever the blocks beside it."""
    motions = [rocking.records.load(name) for name in ("el-centro-meloland-270", "ridgecrest-clc-090")]
    even = rocking.Block.from_parameters(p=3.0, alpha=0.18, restitution=0.9)
    odd = rocking.Block.from_parameters(p=(2.0, 2.2), alpha=(0.15, 0.17), restitution=0.9)
    levels = np.array([0.15, 0.25, 0.35, 0.5, 0.8]) * 9.80665

    def made(name, blocks):
        study = rocking.create_study(
            tmp_path / name, blocks, motions, levels=levels, measure="pga", polarity="both", blocks_per_batch=512
        )
        study.run()
        return study.spectrum().data, study.block_fragilities().data

    (alone, curve), (beside, curves) = made("alone", [even]), made("beside", [odd, even])
    assert np.array_equal(alone.fractile_over_alpha[..., 0], beside.fractile_over_alpha[..., 1])
    assert np.array_equal(alone.overturned_share[..., 0], beside.overturned_share[..., 1])
    for name in ("median", "dispersion", "median_lower", "exceedance_count"):
        assert np.array_equal(curve[name][0, 0], curves[name][0, 1], equal_nan=True)
    assert int(curves.exceedance_count[0, 0]) > int(curves.exceedance_count[0, 1])


def test_sums_of_weights_in_another_order_make_no_outcome(tmp_path):
    blocks = rocking.Blocks(2.0, np.linspace(0.199, 0.201, 37), 0.9)
    pulses = [rocking.pulses.one_sine(1.0, frequency) for frequency in np.linspace(0.45, 0.55, 5)]
    study = rocking.create_study(
        tmp_path, blocks, pulses, levels=[1.0, 1.5, 4.0, 5.0], measure="pga", blocks_per_batch=512
    )
    study.run()
    rng = np.random.default_rng(0)
    for _ in range(10):
        with pytest.raises(errors.FitError, match="separated"):
            study.fragility(weights=rng.uniform(0.1, 1.0, 37))
