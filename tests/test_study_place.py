"""Places for studies: what a folder does so that an object is whole or not there, whatever happens to the machine."""

import os
import stat
from pathlib import Path

import pytest

from rocking.errors import StudyError
from rocking.studies.place import Folder
from rocking.studies.store import Store, exists, keep, require_free


@pytest.mark.skipif(os.name == "nt", reason="folders cannot be flushed there")
def test_an_object_is_on_the_disk_before_it_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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
    Folder(tmp_path).put("c.0.1", b"outcomes")
    assert done == [len(b"outcomes"), "name", "folder"]
    assert (tmp_path / "c.0.1").read_bytes() == b"outcomes"


@pytest.mark.parametrize("when", ["fsync", "replace"])
def test_an_interrupt_leaves_no_part_of_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, when: str) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(*((os, "fsync") if when == "fsync" else (Path, "replace")), interrupted)
    with pytest.raises(KeyboardInterrupt):
        Folder(tmp_path).put("c.0.1", b"outcomes")
    assert not [*tmp_path.iterdir()]


@pytest.mark.skipif(os.name == "nt", reason="there the folder says who may read its files")
@pytest.mark.parametrize(("umask", "mode"), [(0o022, 0o644), (0o002, 0o664), (0o077, 0o600)])
def test_who_may_read_a_study_is_for_the_umask_to_say(tmp_path: Path, umask: int, mode: int) -> None:
    before = os.umask(umask)
    try:
        Folder(tmp_path).put("c.0.1", b"outcomes")
        with Folder(tmp_path).locked():
            pass
    finally:
        os.umask(before)
    assert [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("c.0.1", "lock")] == [mode, mode]


def test_a_second_run_is_told_who_holds_the_study_and_what_to_do(tmp_path: Path) -> None:
    told = rf"run by process {os.getpid()} on .*; wait for it, or end it there"
    with Folder(tmp_path).locked(), pytest.raises(StudyError, match=told), Folder(tmp_path).locked():
        pass


def test_what_is_there_already_is_not_written_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place, written = Folder(tmp_path), []
    put = Folder.put
    monkeypatch.setattr(Folder, "put", lambda folder, name, data: written.append(data) or put(folder, name, data))
    for data in (b"one", b"one", b"two"):
        keep(place, "study.json", data)
        assert place.get("study.json") == data
    assert written == [b"one", b"two"]


def test_where_there_is_no_study_none_is_opened(tmp_path: Path) -> None:
    place = Folder(tmp_path)
    assert not exists(place)
    with pytest.raises(StudyError, match="there is no study here: create it first"):
        Store.open(place)


@pytest.mark.parametrize(
    ("names", "listed"), [(("b", "a"), "but a, b: name"), (("d", "c", "b", "a"), "but a, b, c and more: name")]
)
def test_a_folder_of_other_files_is_no_place_for_a_study(tmp_path: Path, names: tuple[str, ...], listed: str) -> None:
    require_free(Folder(tmp_path))
    for name in names:
        (tmp_path / name).touch()
    with pytest.raises(StudyError, match=listed):
        require_free(Folder(tmp_path))
