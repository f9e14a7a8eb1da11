"""Studies as their tests look at them: the bytes that they keep, their units, and what happens as one is stored."""

import hashlib
import importlib
from collections.abc import Callable
from pathlib import Path

import pytest

import rocking
from rocking.studies import folder as folders
from rocking.studies.folder import Store

#: Module that runs studies; its name in the package is that of its function.
RUNS = importlib.import_module("rocking.studies.study")


def digest(folder: str | Path) -> str:
    """Hash of all that a study is: inputs, description, every unit."""
    total = hashlib.sha256()
    for path in sorted(Path(folder).rglob("*")):
        if path.is_file() and path.name != "lock":
            total.update(f"{path.relative_to(folder)}".encode() + path.read_bytes())
    return total.hexdigest()


def store_of(study: rocking.Study) -> Store:
    """Outcomes of a study as they lie in its folder."""
    return Store(study.folder)


def after_each_unit(monkeypatch: pytest.MonkeyPatch, action: Callable[[], object]) -> None:
    """Do something each time that a unit is stored."""
    put = folders.write_atomically
    monkeypatch.setattr(RUNS, "write_atomically", lambda file, data: (put(file, data), action()))
