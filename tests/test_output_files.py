"""What is written to files is whole, or not there; what was there before stays where the new one cannot be written."""

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import rocking
from rocking import errors
from rocking.analysis.survey import create_folder_names, survey
from rocking.cli.study import WRITERS as STUDY_WRITERS
from rocking.core import tables
from rocking.core.result import DatasetResult
from rocking.core.tables import atomic_file, write_figure

resource = pytest.importorskip("resource")

RECORD = "el-centro-meloland-270"


@contextlib.contextmanager
def full_disk(left: int) -> Iterator[None]:
    """Let no file grow beyond so many bytes: the system itself fails the writes, in compiled libraries as well."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    writes_bytecode = sys.dont_write_bytecode
    # Python would keep half of what it compiles of a module that is imported meanwhile, and fail on it ever after.
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (left, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        sys.dont_write_bytecode = writes_bytecode


@pytest.fixture(scope="module")
def response() -> rocking.Response:
    found = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.records.load(RECORD))
    found.summary(0.5)  # kernels are compiled and kept on the disk while it has room
    found.to_xarray(dt=1.0)
    return found


@pytest.fixture(scope="module")
def analysis(response: rocking.Response) -> DatasetResult:
    return rocking.incremental_dynamic_analysis(response.block, response.motion, rtol=1e-2)


def drawn() -> Figure:
    figure = Figure()
    figure.subplots().plot([0.0, 1.0])
    return figure


WRITERS = {
    "response.csv": lambda response, _, path: response.to_csv(path),
    "response.nc": lambda response, _, path: response.to_netcdf(path),
    "levels.csv": lambda _, analysis, path: analysis.to_csv(path),
    "levels.nc": lambda _, analysis, path: analysis.to_netcdf(path),
    "response.png": lambda _, __, path: write_figure(path, drawn()),
    "response.pdf": lambda _, __, path: write_figure(path, drawn()),
}


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_no_part_of_a_file_and_keeps_the_old_one(response, analysis, tmp_path, name):
    path = tmp_path / name
    for old in (None, b"old"):
        if old is not None:
            path.write_bytes(old)
        with full_disk(1000), pytest.raises(errors.OutputError, match=f"{name}: cannot be written"):
            WRITERS[name](response, analysis, path)
        assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == ([] if old is None else [(name, old)])
    WRITERS[name](response, analysis, path)
    assert [file.name for file in tmp_path.iterdir()] == [name]
    assert path.stat().st_size > 1000


@pytest.mark.parametrize(
    "suffix", [".csv", *(pytest.param(x, marks=pytest.mark.thorough) for x in (".nc", ".parquet"))]
)
def test_an_export_of_a_study_is_whole_or_not_there(tmp_path, suffix):
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    blocks = rocking.Blocks.grid(p=[1.0, 2.0, 3.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
    study = rocking.create_study(tmp_path / "study", blocks, rocking.pulses.one_sine(4.0, 1.0), levels=[0.4, 1.0])
    study.run()
    target, write = tmp_path / f"results{suffix}", STUDY_WRITERS[suffix]
    with full_disk(700), pytest.raises(errors.OutputError, match="cannot be written"):
        write(study, target)
    assert {file.name for file in tmp_path.iterdir()} == {"study"}
    write(study, target)
    assert {file.name for file in tmp_path.iterdir()} == {"study", target.name}


def test_a_table_of_many_records_is_whole_or_not_there(response, tmp_path):
    found = survey(response.block, {RECORD: response.motion})
    with full_disk(100), pytest.raises(errors.OutputError, match="cannot be written"):
        found.to_csv(tmp_path / "summary.csv")
    assert not [*tmp_path.iterdir()]


def test_a_write_that_fails_in_the_middle_leaves_what_was_there(tmp_path, monkeypatch):
    file = tmp_path / "table.csv"
    file.write_text("old")

    def fails(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fails)
    with (
        pytest.raises(errors.OutputError, match="No space left on device; no partial file remains"),
        atomic_file(file) as beside,
    ):
        beside.write_text("new")
    assert [each.name for each in tmp_path.iterdir()] == ["table.csv"]
    assert file.read_text() == "old"


def test_a_link_is_kept_and_a_file_keeps_its_rights_and_a_device_is_written_to(tmp_path):
    real, link = tmp_path / "real.csv", tmp_path / "link.csv"
    real.write_text("old")
    real.chmod(0o640)
    link.symlink_to(real)
    with atomic_file(link) as beside:
        beside.write_text("new")
    assert link.is_symlink()
    assert real.read_text() == "new"
    assert real.stat().st_mode & 0o777 == 0o640
    with atomic_file("/dev/null") as beside:
        assert beside == Path("/dev/null")
    umask = os.umask(0o022)
    try:
        with atomic_file(tmp_path / "fresh.csv") as beside:
            beside.write_text("new")
    finally:
        os.umask(umask)
    assert (tmp_path / "fresh.csv").stat().st_mode & 0o777 == 0o644
    with (
        pytest.raises(errors.OutputError, match="there is no folder"),
        atomic_file(tmp_path / "none" / "a.csv"),
    ):
        pass


def test_records_of_one_name_have_a_folder_each() -> None:
    assert create_folder_names(["a/one.csv", "b/one.csv", "c/one.csv", "two.csv"]) == ["one", "one-2", "one-3", "two"]
    assert create_folder_names(["-", "sine:amplitude=1"]) == ["standard-input", "sine-amplitude=1"]


@pytest.mark.parametrize("index", [False, True])
def test_numbers_of_a_table_have_fifteen_digits_whatever_their_size(tmp_path: Path, index: bool) -> None:
    values = np.random.default_rng(1).uniform(1.0, 10.0, 200) * 10.0 ** np.arange(-100.0, 100.0)
    frame = pd.DataFrame({"value": values}, index=pd.Index(-values, name="place"))
    tables.write_csv(tmp_path / "it.csv", frame, index=index)
    found = np.loadtxt(tmp_path / "it.csv", delimiter=",", skiprows=1, ndmin=2)
    expected = np.column_stack([*[-values] * index, values])
    np.testing.assert_allclose(found.reshape(expected.shape), expected, rtol=5e-15, atol=0.0)
