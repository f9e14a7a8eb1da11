"""Where compiled kernels are kept, and that they never are those of other sources."""

import ast
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kernel_records import NO_GROUND

from rocking.kernels import compiled
from rocking.kernels.ground import has_vertical
from rocking.kernels.sine.eq65 import eq65_sums

KERNELS = Path(compiled.__file__).parent
SOURCE = KERNELS.parent.parent


@pytest.fixture
def places(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Path]:
    """A folder for everything, nothing remembered of other folders, and no wish of the user's."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(compiled, "_HERE", tmp_path / "package")
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(tmp_path / "temporary"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    (tmp_path / "package").mkdir()
    compiled.cache_folder.cache_clear()
    yield tmp_path
    compiled.cache_folder.cache_clear()


def block(folder: Path) -> None:
    """Make a folder that nothing can be made in: a file, which stops even the superuser."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.write_text("")


def test_the_cache_lies_beside_the_sources_where_it_can(places: Path) -> None:
    folder = compiled.cache_folder()
    assert folder is not None
    assert folder.parent == places / "package" / "__pycache__"
    assert folder.is_dir()


def test_it_falls_back_to_the_users_then_to_a_temporary_one_then_to_none(places: Path) -> None:
    for blocked, expected in (
        (places / "package" / "__pycache__", places / "home" / ".cache" / "rocking"),
        (places / "home" / ".cache", places / "temporary"),
        (places / "temporary", None),
    ):
        block(blocked)
        compiled.cache_folder.cache_clear()
        folder = compiled.cache_folder()
        assert folder is None if expected is None else folder is not None and folder.is_relative_to(expected)


def test_the_users_wish_comes_first(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(places / "wished"))
    folder = compiled.cache_folder()
    assert folder is not None
    assert folder.parent == places / "wished"
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(places / "xdg"))
    block(places / "package" / "__pycache__")
    compiled.cache_folder.cache_clear()
    folder = compiled.cache_folder()
    assert folder is not None
    assert folder.parent == places / "xdg" / "rocking"


def test_without_a_place_kernels_are_compiled_all_the_same(places: Path) -> None:
    for folder in (places / "package" / "__pycache__", places / "home", places / "temporary"):
        block(folder)
    assert compiled.cache_folder() is None

    @compiled.kernel
    def twice(x: float) -> float:
        return 2.0 * x

    assert twice(21.0) == 42.0


def test_a_process_whose_sources_have_changed_keeps_nothing(places: Path) -> None:
    """What it compiles then is of the old sources, and would lie in the folder of the new ones."""
    source = places / "package" / "twice.py"
    source.write_text("def twice(x): return 2.0 * x")
    assert compiled.cache_folder() is not None
    source.write_text("def twice(x): return 3.0 * x")
    compiled.cache_folder.cache_clear()
    assert compiled.cache_folder() is None
    source.write_text("def twice(x): return 2.0 * x")
    compiled.cache_folder.cache_clear()
    assert compiled.cache_folder() is not None


def test_the_fingerprint_changes_with_the_content_of_any_kernel(places: Path) -> None:
    package = places / "package"
    shutil.copytree(KERNELS, package, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
    sources = sorted(package.rglob("*.py"))
    assert len(sources) > 20
    before = compiled.fingerprint()
    assert compiled.fingerprint() == before
    seen = {before}
    for source in sources:
        text = source.read_bytes()
        source.write_bytes(text + b"# changed\n")
        seen.add(compiled.fingerprint())
        source.write_bytes(text)
    assert len(seen) == len(sources) + 1
    assert compiled.fingerprint() == before
    sources[0].rename(sources[0].with_name("renamed.py"))
    assert compiled.fingerprint() not in seen


def anew(declared: Any) -> compiled.Kernel:
    """Declare a kernel again, as another process does: nothing of it is compiled."""
    return compiled.Kernel(declared.py_func, declared._compile)


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder for what is compiled, and no library."""
    monkeypatch.setattr(compiled, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(compiled.Kernel, "native", None)
    return tmp_path


@pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")
def test_what_another_python_or_another_place_has_kept_is_not_at_hand(kept: Path) -> None:
    first = anew(eq65_sums)
    assert not first.is_at_hand
    numbas = first.compiled
    assert not first.is_at_hand
    numbas(0.5)
    assert first.is_at_hand
    assert anew(eq65_sums).is_at_hand
    (file,) = kept.rglob("*.nbc")
    other = file.rename(file.with_name(file.name.replace(".py3", ".py2")))
    assert not anew(eq65_sums).is_at_hand
    other.rename(file)
    file.parent.rename(file.parent.with_name("kernels_elsewhere"))
    assert not anew(eq65_sums).is_at_hand


@pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")
def test_processes_that_compile_at_once_for_different_types_keep_both(kept: Path) -> None:
    """Each sees an empty folder, and what they keep comes together."""
    expected = eq65_sums(0.5)
    for process, eta in (("first", 0.5), ("second", np.float32(0.5))):
        (kept / process).mkdir()
        compiled.cache_folder = lambda folder=kept / process: folder  # type: ignore[assignment, misc]
        assert anew(eq65_sums)(eta) == expected
    shutil.copytree(kept / "second", kept / "first", dirs_exist_ok=True)
    compiled.cache_folder = lambda: kept / "first"  # type: ignore[assignment]
    third = anew(eq65_sums)
    assert [third(eta) for eta in (0.5, np.float32(0.5))] == [expected, expected]
    assert sum(third.compiled.stats.cache_hits.values()) == 2


@pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")
@pytest.mark.cases(fast=1)
@pytest.mark.parametrize(
    "damage", [lambda data: data[:-100], lambda data: data[:5000] + b"no" + data[5002:], lambda data: b""]
)
def test_a_damaged_file_is_made_anew(kept: Path, damage: Any) -> None:
    expected = anew(eq65_sums)(0.5)
    (file,) = kept.rglob("*.nbc")
    sound = file.read_bytes()
    file.write_bytes(damage(sound))
    assert anew(eq65_sums)(0.5) == expected
    assert file.read_bytes() != damage(sound)
    again = anew(eq65_sums)
    assert again(0.5) == expected
    assert sum(again.compiled.stats.cache_hits.values()) == 1


@pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")
def test_a_folder_that_can_no_longer_be_written_is_done_without(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = anew(eq65_sums)
    folder = Path(first.compiled.stats.cache_path)
    block(folder)
    assert first(0.5) == eq65_sums(0.5)
    folder.unlink()
    assert anew(eq65_sums)(0.5) == eq65_sums(0.5)
    assert len(list(folder.glob("*.nbc"))) == 1
    file = kept / "a file"
    file.touch()
    monkeypatch.setattr(compiled, "cache_folder", lambda: file / "and below")
    second = anew(eq65_sums)
    assert second(0.5) == eq65_sums(0.5)
    assert second.compiled.stats.cache_path is None


@pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")
def test_a_kernel_is_prepared_for_types_without_being_called(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "cache_folder", lambda: tmp_path)

    @compiled.kernel
    def put(out: Any) -> None:
        out[0] = 1.0

    prepared: Any = put
    out = np.zeros(1)
    prepared.prepare(out)
    assert prepared.is_at_hand
    assert out[0] == 0.0
    put(out)
    assert out[0] == 1.0
    assert len(prepared.compiled.overloads) == 1


@pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")
def test_what_calls_a_part_from_python_is_kept_too_but_for_a_part_from_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    declared: Any = has_vertical
    monkeypatch.setattr(compiled, "cache_folder", lambda: tmp_path)

    def anew() -> Any:
        return compiled.OnUse(declared.py_func, declared._compile).compiled

    first, second = anew(), anew()
    assert not first(NO_GROUND)
    assert len(list(tmp_path.rglob("*.nbc"))) == 1
    assert not second(NO_GROUND)
    assert [len(each.dispatcher.signatures) for each in (first, second)] == [1, 0]

    @compiled.shared
    def twice(x: float) -> float:
        return 2.0 * x

    assert twice(21.0) == 42.0
    assert len(list(tmp_path.rglob("*.nbc"))) == 1


PROGRAM = """
import rocking
from rocking.kernels import march
march._interpreted.spend(march._interpreted.work())  # Python follows nothing: the march is compiled
block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
response = rocking.simulate(block, None, model="linear", initial_rotation=0.02)
print(f"{response.events['time'][-1]:.12f}", len(response.impacts))
"""


def started(program: str, source: Path, cache: Path) -> subprocess.Popen[str]:
    environment = {
        **os.environ,
        "PYTHONPATH": str(source),
        "NUMBA_CACHE_DIR": str(cache),
        "PYTHONDONTWRITEBYTECODE": "1",
        "ROCKING_SHIPPED": "0",  # they compile their own
    }
    return subprocess.Popen(
        [sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def finished(process: subprocess.Popen[str]) -> str:
    out, error = process.communicate(timeout=900)
    assert process.returncode == 0, error
    return out


@pytest.mark.slow
def test_processes_that_start_at_once_with_an_empty_cache_all_give_the_same_answer(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    answers = {finished(process) for process in [started(PROGRAM, SOURCE, cache) for _ in range(4)]}
    assert len(answers) == 1
    (folder,) = cache.iterdir()
    compiled_once = sorted(path.name for path in folder.rglob("*.nbc"))
    assert len(compiled_once) > 0
    answers.add(finished(started(PROGRAM, SOURCE, cache)))
    assert len(answers) == 1
    assert sorted(path.name for path in folder.rglob("*.nbc")) == compiled_once


@pytest.mark.slow
def test_a_change_in_a_kernel_that_others_call_is_seen(tmp_path: Path) -> None:
    """Restitution is halved in the file of the impact; the entry point's own file stays as it is."""
    source, cache = tmp_path / "source", tmp_path / "cache"
    shutil.copytree(SOURCE, source, ignore=shutil.ignore_patterns("__pycache__"))
    before = finished(started(PROGRAM, source, cache))
    impact = source / "rocking" / "kernels" / "events.py"
    text = impact.read_text()
    changed = text.replace("= factor(block, left", "= 0.5 * factor(block, left")
    assert changed != text
    impact.write_text(changed)
    after = finished(started(PROGRAM, source, cache))
    assert float(after.split()[0]) < 0.9 * float(before.split()[0])
    assert len(list(cache.iterdir())) == 2


@pytest.mark.thorough
def test_numba_is_imported_as_a_whole_before_a_part_of_it() -> None:
    """Two threads may import it at once; one that begins with a part holds it while it waits for the whole."""
    judged = 0
    for file in sorted((SOURCE / "rocking").rglob("*.py")):
        tree = ast.parse(file.read_text("utf-8"))
        for scope in [tree, *(each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef))]:
            names = []
            for each in scope.body:
                names += [each.module or ""] if isinstance(each, ast.ImportFrom) else []
                names += [name.name for name in each.names] if isinstance(each, ast.Import) else []
            of_numba = [name for name in names if name.partition(".")[0] == "numba"]
            assert of_numba[:1] in ([], ["numba"]), f"{file}: import numba before {of_numba[0]}"
            judged += len(of_numba) > 1
    assert judged >= 2
