"""The folder of a study: what it does so that a file is whole or not there, and who may run the study at a time."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

import rocking
from rocking.errors import OptionError, StudyError
from rocking.studies.folder import Store, contains_study, lock_folder, require_empty, write_atomically


@pytest.mark.skipif(os.name == "nt", reason="folders cannot be flushed there")
def test_a_file_is_on_the_disk_before_it_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[str | int] = []
    fsync, replace = os.fsync, Path.replace

    def flush(handle: int) -> None:
        # What a file's buffer still holds is not on the disk: the size counts, and not the call alone.
        about = os.fstat(handle)
        done.append("folder" if stat.S_ISDIR(about.st_mode) else about.st_size)
        fsync(handle)

    def name(path: Path, target: Path) -> Path:
        done.append("name")
        return replace(path, target)

    monkeypatch.setattr(os, "fsync", flush)
    monkeypatch.setattr(Path, "replace", name)
    write_atomically(tmp_path / "batch.1", b"outcomes")
    assert done == [len(b"outcomes"), "name", "folder"]
    assert (tmp_path / "batch.1").read_bytes() == b"outcomes"


@pytest.mark.skipif(os.name == "nt", reason="there the folder decides who may read its files")
@pytest.mark.parametrize(("umask", "mode"), [(0o022, 0o644), (0o002, 0o664), (0o077, 0o600)])
def test_the_umask_decides_who_may_read_a_study(tmp_path: Path, umask: int, mode: int) -> None:
    before = os.umask(umask)
    try:
        write_atomically(tmp_path / "batch.1", b"outcomes")
        with lock_folder(tmp_path):
            pass
    finally:
        os.umask(before)
    assert [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("batch.1", "lock")] == [mode, mode]


@pytest.mark.skipif(os.name == "nt", reason="parts share no lock there")
@pytest.mark.parametrize("one", [False, True])
@pytest.mark.parametrize("other", [False, True])
def test_one_process_runs_a_study_or_several_run_parts_of_it(tmp_path: Path, one: bool, other: bool) -> None:
    for _ in range(2):  # a lock that was given back locks nothing
        with lock_folder(tmp_path, is_shared=one):
            if one and other:
                with lock_folder(tmp_path, is_shared=other):
                    pass
            else:
                told = rf"run by process {os.getpid()} on .*; wait until it ends, or stop it there"
                with pytest.raises(StudyError, match=told), lock_folder(tmp_path, is_shared=other):
                    pass


@pytest.mark.skipif(os.name == "nt", reason="parts share no lock there")
@pytest.mark.parametrize("shared", [False, True])
def test_a_lock_goes_with_its_process_and_the_next_run_removes_half_written_files(tmp_path: Path, shared: bool) -> None:
    program = (
        "import sys, time\nfrom rocking.studies.folder import lock_folder\n"
        f"with lock_folder(sys.argv[1], is_shared={shared}):\n    print('locked', flush=True)\n    time.sleep(600)\n"
    )
    part = tmp_path / ".abc.part"
    part.write_bytes(b"half")
    with subprocess.Popen([sys.executable, "-c", program, tmp_path], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stdout.readline() == b"locked\n"
        with pytest.raises(StudyError, match=f"run by process {process.pid} on"), lock_folder(tmp_path):
            pass
        assert part.exists() == shared  # others may be writing beside a part
        process.kill()
    with lock_folder(tmp_path):
        assert not part.exists()


def test_where_there_is_no_study_none_is_opened(tmp_path: Path) -> None:
    assert not contains_study(tmp_path)
    with pytest.raises(StudyError, match="the folder contains no study: create it first"):
        Store(tmp_path)
    with pytest.raises(StudyError, match="a study is stored in a folder, but this is a URL"):
        rocking.Study("s3://bucket/museum")


@pytest.mark.parametrize(
    ("names", "listed"), [(("b", "a"), "but a, b: choose"), (("d", "c", "b", "a"), "but a, b, c and more: choose")]
)
def test_a_folder_of_other_files_is_no_place_for_a_study(tmp_path: Path, names: tuple[str, ...], listed: str) -> None:
    require_empty(tmp_path)
    for name in names:
        (tmp_path / name).touch()
    with pytest.raises(StudyError, match=listed):
        require_empty(tmp_path)


@pytest.mark.parametrize("part", ["0/3", "4/3", "1", "1/", "/3", "a/b", "-1/3", "1/0", "1.5/3", 3])
def test_a_part_that_is_none_is_refused(tmp_path: Path, part: str) -> None:
    motion, blocks = rocking.pulses.one_sine(4.0, 1.0), rocking.Blocks([1.0, 2.0], 0.2, 0.9)
    study = rocking.create_study(tmp_path, blocks, motion, blocks_per_batch=512)
    with pytest.raises(OptionError, match="part must be the number of a part"):
        study.run(part=part)
