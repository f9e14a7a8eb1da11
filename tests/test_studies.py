"""Studies: resumed after anything, byte for byte; every damage seen; nobody runs one twice at once."""

import errno
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import rocking
from rocking.studies import place as places
from rocking.studies.place import Folder
from rocking.studies.units import DamagedUnit, Grid, decoded, encoded, key_of, name_of

BLOCKS = rocking.Blocks(p=np.linspace(1.0, 6.0, 1300), alpha=0.2, restitution=0.9)
MOTIONS = [rocking.pulses.one_sine(4.0, frequency) for frequency in (0.5, 1.0, 2.0)]
OPTIONS = {"pga": [2.0, 4.0], "polarity": "both", "model": "linear", "unit_blocks": 512}

SCRIPT = """
import sys
import numpy as np, rocking
blocks = rocking.Blocks(p=np.linspace(1.0, 6.0, 1300), alpha=0.2, restitution=0.9)
motions = [rocking.pulses.one_sine(4.0, frequency) for frequency in (0.5, 1.0, 2.0)]
study = rocking.study(sys.argv[1], blocks, motions, pga=[2.0, 4.0], polarity="both", model="linear", unit_blocks=512)
print("ready", flush=True)
study.run(threads=int(sys.argv[2]))
"""


def made(folder, **changes):
    return rocking.study(folder, BLOCKS, MOTIONS, **(OPTIONS | changes))


def digest(folder):
    """Hash of all that a study is: inputs, description, every unit."""
    total = hashlib.sha256()
    for path in sorted(Path(folder).rglob("*")):
        if path.is_file() and path.name not in ("lock", "runs.jsonl"):
            total.update(f"{path.relative_to(folder)}".encode() + path.read_bytes())
    return total.hexdigest()


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    folder = tmp_path_factory.mktemp("complete")
    made(folder).run(threads=1)
    return folder


@pytest.fixture(scope="module")
def reference():
    options = {name: value for name, value in OPTIONS.items() if name != "unit_blocks"}
    return rocking.simulate_many(BLOCKS, MOTIONS, **options)


def test_a_study_is_what_simulate_many_computes(complete, reference):
    xr.testing.assert_identical(rocking.study(complete).results().load(), reference)


def test_any_selection_of_the_results_is_that_of_the_whole(complete, reference):
    lazy = rocking.study(complete).results()
    for part in (
        {"motion": 1, "block": slice(500, 530)},
        {"scale": [1], "block": [3, 600, 1299]},
        {"polarity": 0, "block": slice(None, None, 400)},
        {"block": -1},
    ):
        xr.testing.assert_identical(lazy.isel(part).load(), reference.isel(part))


def test_any_zarr_reader_opens_the_store(complete, reference):
    zarr = pytest.importorskip("zarr")
    array = zarr.open_group(complete, mode="r")["result"]
    outcomes = array.attrs["outcomes"]
    assert array.shape == (len(outcomes), 3, 2, 2, 1300)
    for k, name in enumerate(outcomes):
        np.testing.assert_array_equal(array[k], reference[name].values.astype(float))


@pytest.mark.parametrize("how", ["two threads", "processes", "reversed order"])
def test_whoever_computes_it_the_store_is_the_same_to_the_byte(complete, tmp_path, how, monkeypatch):
    study = made(tmp_path)
    if how == "two threads":
        study.run(threads=2)
    elif how == "processes":
        with ProcessPoolExecutor(2) as pool:
            study.run(executor=pool)
    else:
        keys = list(study.store.missing())
        monkeypatch.setattr(type(study.store), "missing", lambda self: iter(keys[::-1]))
        study.run(threads=1)
    assert digest(tmp_path) == digest(complete)


def kill_again_and_again(folder, times, rng):
    """Run the study in a process that is killed at a random moment, so many times; the units that were seen stay."""
    seen = {}
    for _ in range(times):
        command = [sys.executable, "-c", SCRIPT, str(folder), "2"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
            process.stdout.readline()
            time.sleep(float(rng.uniform(0.0, 0.15)))
            process.send_signal(signal.SIGKILL)
        units = {path.name: path.read_bytes() for path in (folder / "result").glob("c.*")}
        assert seen.items() <= units.items()
        seen = units
    return seen


@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
def test_a_killed_study_loses_no_unit_and_goes_on_to_the_same_bytes(complete, tmp_path):
    kill_again_and_again(tmp_path, 3, np.random.default_rng(0))
    report = made(tmp_path).run()
    assert not report.failed
    assert digest(tmp_path) == digest(complete)
    assert not list(tmp_path.rglob("*.part"))


def test_what_a_crash_left_half_written_is_removed(complete, tmp_path):
    study = made(tmp_path)
    (tmp_path / "result" / ".abc.part").write_bytes(b"half")
    study.run()
    assert digest(tmp_path) == digest(complete)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
def test_a_hundred_kills(complete, tmp_path):
    rng = np.random.default_rng(1)
    for k in range(10):
        folder = tmp_path / str(k)
        kill_again_and_again(folder, 10, rng)
        made(folder).run()
        assert digest(folder) == digest(complete)


@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
def test_the_first_signal_finishes_what_is_in_hand(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT + "print(study.status.runs[-1]['event'])", str(tmp_path), "1"],
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        process.stdout.readline()
        time.sleep(0.05)
        process.send_signal(signal.SIGTERM)
        assert process.stdout.readline() == "end\n"
        assert process.wait(timeout=30) == 0


class Failing:
    """The n-th call of a function of the operating system fails."""

    def __init__(self, function, n, code):
        self.function, self.left, self.code = function, n, code

    def __call__(self, *arguments, **options):
        self.left -= 1
        if self.left == 0:
            raise OSError(self.code, os.strerror(self.code))
        return self.function(*arguments, **options)


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO])
@pytest.mark.parametrize("call", ["fsync", "open", "write", "rename"])
@pytest.mark.parametrize("n", [1, 2, 3, 7, 12, 20])
def test_a_write_that_fails_is_one_sentence_and_leaves_nothing_half_visible(
    complete, tmp_path, monkeypatch, call, n, code
):
    with monkeypatch.context() as patched:
        if call == "rename":
            failing = Failing(Path.replace, n, code)
            patched.setattr(Path, "rename", lambda self, target: failing(self, target))
        elif call == "write":
            failing = Failing(places._written, n, code)
            patched.setattr(places, "_written", failing)
        else:
            patched.setattr(places.os, call, Failing(getattr(os, call), n, code))
        try:
            made(tmp_path).run(threads=1)
        except rocking.RockingError as error:
            assert os.strerror(code) in str(error)
            assert "\n" not in str(error)
    for path in (tmp_path / "result").glob("c.*"):
        assert path.read_bytes() == (complete / "result" / path.name).read_bytes()
    made(tmp_path).run(threads=1)
    assert digest(tmp_path) == digest(complete)
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize("seed", range(4))
def test_every_changed_bit_and_every_cut_of_a_unit_is_seen(complete, seed):
    data = (complete / "result" / "c.0.1.1.0.2").read_bytes()
    rng = np.random.default_rng(seed)
    sound = decoded(data, 276, 512)
    for _ in range(250):
        changed = bytearray(data)
        if rng.random() < 0.5:
            changed = changed[: rng.integers(len(data))]
        else:
            changed[rng.integers(len(data))] ^= 1 << rng.integers(8)
        try:
            found = decoded(bytes(changed), 276, 512)
        except DamagedUnit:
            continue
        np.testing.assert_array_equal(found, sound)  # harmless


def test_a_damaged_unit_is_named_and_computed_again_on_request(complete, tmp_path):
    study = made(tmp_path)
    study.run()
    path = tmp_path / "result" / "c.0.1.1.0.2"
    sound = path.read_bytes()
    path.write_bytes(sound[:-9] + b"\0" + sound[-8:])
    assert study.results().peak_rotation.isel(motion=0).load().size  # other units can be read
    with pytest.raises(rocking.StudyError, match=r"c\.0\.1\.1\.0\.2 is damaged"):
        study.results().load()
    (fault,) = study.verify()
    assert "c.0.1.1.0.2" in fault
    study.verify(repair=True)
    assert study.verify(recompute=3) == []
    assert path.read_bytes() == sound


def test_a_unit_that_is_another_s_is_found_by_computing_it_again(tmp_path):
    study = made(tmp_path)
    study.run()
    names = [name_of(key) for key in study.store.grid]
    (tmp_path / "result" / names[0]).write_bytes((tmp_path / "result" / names[7]).read_bytes())
    assert any(names[0] in fault for fault in study.verify(recompute=len(names)))


@pytest.mark.parametrize("name", ["study.json", "inputs.npz"])
def test_damage_to_what_describes_a_study_is_seen(tmp_path, name):
    made(tmp_path)
    data = (tmp_path / name).read_bytes()
    rng = np.random.default_rng(2)
    for _ in range(60):
        changed = bytearray(data)
        changed[rng.integers(len(data))] ^= 1 << rng.integers(8)
        (tmp_path / name).write_bytes(changed)
        with pytest.raises(rocking.StudyError, match="damaged"):
            rocking.study(tmp_path)
    (tmp_path / name).write_bytes(data[:-3])
    with pytest.raises(rocking.StudyError, match="damaged"):
        rocking.study(tmp_path)


def test_what_is_missing_is_never_read_as_a_result(complete, tmp_path):
    study = made(tmp_path)
    for path in list((complete / "result").glob("c.0.*"))[::2]:
        (tmp_path / "result" / path.name).write_bytes(path.read_bytes())
    found = study.results().load()
    assert 0 < int(found.done.sum()) < found.done.size
    for name in ("overturned", "peak_rotation", "impacts"):
        np.testing.assert_array_equal(np.isnan(found[name].values), ~found.done.values)
    assert not study.status.complete


def test_a_unit_that_goes_while_it_is_read_is_no_zero(complete, tmp_path):
    study = made(tmp_path)
    study.run()
    results = study.results()
    (tmp_path / "result" / "c.0.0.0.0.0").unlink()
    with pytest.raises(rocking.StudyError, match=r"c\.0\.0\.0\.0\.0 is gone"):
        results.load()


def test_two_runs_at_once_are_refused(tmp_path):
    study = made(tmp_path)
    with study.place.locked(), pytest.raises(rocking.StudyError, match=f"process {os.getpid()} on"):
        study.run()
    assert not study.run().failed


def test_a_lock_that_was_left_behind_is_taken_over_and_noted(tmp_path):
    study = made(tmp_path)
    (tmp_path / "lock").write_text("process 1 on elsewhere")
    study.run()
    assert "process 1 on elsewhere" in study.status.runs[0]["note"]


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"pga": [2.0, 4.5]}, "the scales"),
        ({"model": "nonlinear"}, "model"),
        ({"chattering": "velocity"}, "treatment"),
        ({"duration": 3.0}, "duration"),
    ],
)
def test_other_inputs_are_refused_by_name(tmp_path, changes, part):
    made(tmp_path)
    with pytest.raises(rocking.StudyError, match=part):
        made(tmp_path, **changes)


def test_other_blocks_and_motions_are_refused_by_name(tmp_path):
    made(tmp_path)
    with pytest.raises(rocking.StudyError, match="the blocks"):
        rocking.study(tmp_path, BLOCKS.select(slice(0, 1299)), MOTIONS, **OPTIONS)
    with pytest.raises(rocking.StudyError, match="motion 1 "):
        rocking.study(tmp_path, BLOCKS, [MOTIONS[0], MOTIONS[1].scaled(1.1), MOTIONS[2]], **OPTIONS)
    with pytest.raises(rocking.StudyError, match="number of motions"):
        rocking.study(tmp_path, BLOCKS, MOTIONS[:2], **OPTIONS)


def test_another_version_may_read_a_study_but_not_go_on_with_it(tmp_path, monkeypatch):
    study = made(tmp_path)
    monkeypatch.setattr("rocking.studies.store.VERSION", "9.9.9")
    assert rocking.study(tmp_path).results().sizes["block"] == 1300
    for compute in (study.run, lambda: study.verify(recompute=1), lambda: study.verify(repair=True)):
        with pytest.raises(rocking.StudyError, match=r"9\.9\.9"):
            compute()
    assert study.verify() == []


class Dying(ThreadPoolExecutor):
    """Workers of which the first few lose their task."""

    def __init__(self, deaths):
        super().__init__(1)
        self.deaths = deaths

    def submit(self, function, /, *arguments):
        if self.deaths:
            self.deaths -= 1
            lost = Future()
            lost.set_exception(ConnectionError("the worker is gone"))
            return lost
        return super().submit(function, *arguments)


def test_a_unit_whose_worker_dies_is_tried_again(complete, tmp_path):
    with Dying(4) as pool:
        report = made(tmp_path).run(executor=pool)
    assert not report.failed
    assert digest(tmp_path) == digest(complete)


def test_a_unit_that_kills_every_worker_is_reported_and_left(tmp_path):
    with Dying(10**6) as pool:
        report = made(tmp_path).run(executor=pool)
    assert report.units == 0
    assert len(report.failed) == len(Grid((3, 2, 2, 1300), 512))
    assert "died 3 times" in next(iter(report.failed.values()))
    assert "failed" in str(rocking.study(tmp_path).status)


def test_a_study_is_exported(complete, tmp_path, reference):
    study = rocking.study(complete)
    study.export(tmp_path / "all.nc")
    study.export(tmp_path / "all.csv")
    with xr.open_dataset(tmp_path / "all.nc", engine="h5netcdf") as found:
        np.testing.assert_array_equal(found.peak_rotation.values, reference.peak_rotation.values)
    assert len((tmp_path / "all.csv").read_text().splitlines()) == 1 + reference.overturned.size
    with pytest.raises(rocking.InvalidOption, match="exported to"):
        study.export(tmp_path / "all.doc")
    with pytest.raises(rocking.OutputError, match="cannot be written"):
        study.export(tmp_path / "none" / "all.csv")


def test_names_of_units_are_their_keys():
    for key in Grid((2, 3, 1, 5000), 512):
        assert key_of(name_of(key)) == key
    assert key_of("zarr.json") is key_of("c.0.1.2.3") is key_of("c.1.0.0.0.0") is key_of("c.0.a.0.0.0") is None


def test_a_hundred_thousand_units_are_listed_in_a_second(tmp_path):
    grid = Grid((1000, 100, 1, 512), 512)
    folder = tmp_path / "result"
    folder.mkdir()
    for key in grid:
        (folder / name_of(key)).touch()
    start = time.perf_counter()
    assert sum(1 for name in Folder(tmp_path).names("result") if key_of(name)) == 100_000
    assert time.perf_counter() - start < 1.0


def test_the_bytes_of_a_unit_are_the_same_whenever_it_is_encoded():
    outcomes = np.zeros(
        5, dtype=[(name, "f8") for name in json.loads(Grid((1, 1, 1, 5), 512).metadata())["attributes"]["outcomes"]]
    )
    first = encoded(outcomes, 512)
    time.sleep(1.1)
    assert encoded(outcomes, 512) == first


@pytest.mark.parametrize("width", [0, 100, 513, 1.5])
def test_units_are_whole_groups_of_blocks(tmp_path, width):
    with pytest.raises(rocking.InvalidOption, match="unit_blocks"):
        made(tmp_path, unit_blocks=width)


def test_an_empty_folder_holds_no_study(tmp_path):
    with pytest.raises(rocking.StudyError, match="no study here"):
        rocking.study(tmp_path)
    with pytest.raises(rocking.InvalidOption, match="blocks and motions"):
        rocking.study(tmp_path, BLOCKS)
