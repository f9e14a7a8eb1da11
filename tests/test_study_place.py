"""Places for studies: what a folder does so that an object is whole or not there, whatever happens to the machine."""

import os
import stat
from pathlib import Path

import pytest

from rocking.studies.place import Folder


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
