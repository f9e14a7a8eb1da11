"""Compiled kernels: they are called for the right types only, and a library that does not fit is refused."""

import importlib
import json
import os
import pkgutil
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rocking.kernels
from rocking.errors import KernelsError
from rocking.kernels import compiled, lane_steps, lanes, library, sources, state
from rocking.kernels.signatures import sample_arguments
from rocking.kernels.sine.sequence import write_critical_amplitudes

pytestmark = pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")


@pytest.fixture
def built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the libraries and the manifest, where the package looks for them."""
    folder = shutil.copytree(library.FOLDER, tmp_path / "built")
    monkeypatch.setattr(library, "FOLDER", folder)
    for each in (library.open_library, library.read_manifest):
        each.cache_clear()
    yield folder
    for each in (library.open_library, library.read_manifest):
        each.cache_clear()


@pytest.fixture
def kernels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, built: Path) -> Path:
    """A copy of the sources, which the package compares with those that were compiled."""
    folder = tmp_path / "kernels"
    shutil.copytree(library.SOURCES, folder, ignore=shutil.ignore_patterns("__pycache__", "built"))
    monkeypatch.setattr(library, "SOURCES", folder)
    return folder


def test_every_kernel_that_python_calls_is_listed_once() -> None:
    found = set()
    for info in pkgutil.walk_packages(rocking.kernels.__path__, "rocking.kernels."):
        for name, value in vars(importlib.import_module(info.name)).items():
            if isinstance(value, library.Kernel) and value.__module__ == info.name:
                found.add(f"{info.name.removeprefix('rocking.kernels.')}.{name}")
    assert len(found) >= 20
    assert {*sample_arguments()} == found == {*library.open_library().kernels}


@pytest.mark.parametrize(
    "change",
    [
        lambda omega, eta, out: (omega.astype(np.float32), eta, out),
        lambda omega, eta, out: (omega[::2], eta[::2], out),
        lambda omega, eta, out: (omega[:, None], eta, out),
        lambda omega, eta, out: (omega.tolist(), eta, out),
        lambda omega, eta, out: (omega, eta, np.broadcast_to(out, out.shape)),
        lambda omega, eta, out: (omega, eta),
        lambda omega, eta, out: (omega, eta, out, out),
        lambda omega, eta, out: (omega.astype(">f8"), eta, out),
    ],
    ids=["single", "strided", "two dimensions", "list", "read-only", "too few", "too many", "byte order"],
)
def test_arguments_of_other_types_are_refused(change: Any) -> None:
    arguments = np.ones(4), np.full(4, 0.9), np.zeros(4)
    with pytest.raises(TypeError, match="write_critical_amplitudes is not compiled for these arguments"):
        write_critical_amplitudes(*change(*arguments))
    write_critical_amplitudes(*arguments)
    assert np.all(arguments[-1] > 1.0)


def test_what_is_only_read_may_be_read_only() -> None:
    omega, eta, out = np.ones(4), np.full(4, 0.9), np.zeros(4)
    omega.flags.writeable = False
    write_critical_amplitudes(omega, eta, out)
    assert np.all(out > 1.0)


def test_records_of_another_layout_are_not_taken_for_the_same() -> None:
    kind = np.dtype([("u", "f8"), ("v", "f8")])
    take = library._make_packer({"record": str(kind.descr)})
    packed: list[Any] = []
    take(np.zeros(1, kind)[0], packed)
    take(np.zeros(1, np.dtype(kind.descr))[0], packed)
    assert len(packed) == 2
    for other in ([("u", "f8"), ("v", "i8")], [("v", "f8"), ("u", "f8")], [("u", "f8"), ("v", "f8"), ("w", "f8")]):
        with pytest.raises(TypeError):
            take(np.zeros(1, np.dtype(other))[0], packed)


def test_numbers_are_converted_only_without_loss() -> None:
    kernel = library._make_caller("sine.series.sum_eq65", library.open_library())
    assert kernel(np.float64(0.5)) == kernel(0.5)
    for wrong in ("0.5", None, 1j):
        with pytest.raises(TypeError):
            kernel(wrong)
    with pytest.raises(TypeError):
        library._make_packer("bool")(1, [])


def damage(name: str, folder: Path) -> None:
    manifest = folder / "manifest.json"
    content = json.loads(manifest.read_text("utf-8"))
    if name == "no manifest":
        manifest.unlink()
    elif name == "half a manifest":
        manifest.write_text(manifest.read_text("utf-8")[:100], "utf-8")
    elif name == "another manifest":
        manifest.write_text("[1, 2]", "utf-8")
    for each in content["libraries"]:
        path = folder / each["file"]
        if name == "no library":
            path.unlink()
        elif name == "half a library":
            path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


@pytest.mark.parametrize("name", ["no manifest", "half a manifest", "another manifest", "no library", "half a library"])
def test_a_library_that_is_damaged_is_refused_in_a_sentence(built: Path, name: str) -> None:
    damage(name, built)
    with pytest.raises(KernelsError, match=r"compiled kernels in .*; run make kernels"):
        library.open_library()


def test_changed_sources_are_refused_and_reworded_ones_are_not(kernels: Path) -> None:
    text, code = sources.hash_text(kernels), sources.hash_code(kernels)
    file = kernels / "arc.py"
    before = file.read_text("utf-8")
    file.write_text(before.replace('"""', '"""Reworded. ', 1) + "# A comment.\n", "utf-8")
    assert (sources.hash_text(kernels) != text, sources.hash_code(kernels)) == (True, code)
    library.open_library()
    file.write_text(before + "x = 1\n", "utf-8")
    for each in (library.open_library, library.read_manifest):
        each.cache_clear()
    with pytest.raises(KernelsError, match="have changed since the kernels were compiled; run make kernels"):
        library.open_library()
    file.write_text(before, "utf-8")
    file.rename(kernels / "renamed.py")
    assert sources.hash_code(kernels) != code


def test_a_processor_has_the_library_of_its_highest_level(built: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    best = library.read_manifest()["libraries"][-1]
    assert library.open_library().name == best["file"]
    if Path("/proc/cpuinfo").exists() and best["level"]:
        flags = set(Path("/proc/cpuinfo").read_text("utf-8").partition("flags")[2].partition("\n")[0].split())
        third = {"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"} <= flags and bool({"abm", "lzcnt"} & flags)
        fourth = third and {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"} <= flags
        assert library.open_library().handle.rocking_level() == third + fourth
    manifest = json.loads((built / "manifest.json").read_text("utf-8"))
    manifest["libraries"][-1]["level"] = 99
    (built / "manifest.json").write_text(json.dumps(manifest), "utf-8")
    for each in (library.open_library, library.read_manifest):
        each.cache_clear()
    if len(manifest["libraries"]) == 1:
        pytest.skip("this machine has one level only")
    assert library.open_library().name == manifest["libraries"][-2]["file"]


PROGRAM = """
import sys
import rocking
block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
response = rocking.simulate(block, None, model="linear", initial_rotation=0.02)
print(response.impacts.tobytes().hex(), "numba" in sys.modules)
"""


@pytest.mark.slow
def test_numba_compiles_the_same_where_it_is_asked_to() -> None:
    answers = {}
    for name, expected in (("0", "False"), ("1", "True")):
        environment = {**os.environ, "ROCKING_JIT": name}
        command = [sys.executable, "-c", PROGRAM]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        answers[name], with_numba = done.stdout.split()
        assert with_numba == expected
    assert len({*answers.values()}) == 1


def test_numbers_of_records_are_aligned_to_their_sizes_on_every_platform() -> None:
    kinds = [
        kind for module in (state, lanes, lane_steps) for kind in vars(module).values() if isinstance(kind, np.dtype)
    ]
    checked = 0
    for kind in kinds:
        assert kind.itemsize % 8 == 0 and kind.isalignedstruct
        end = 0
        for field, offset, *_ in kind.fields.values():
            size = 8 if field.names else field.base.itemsize
            assert offset % size == 0 and 0 <= offset - end < size
            end, checked = offset + field.itemsize, checked + 1
        assert 0 <= kind.itemsize - end < 8
    assert len(kinds) >= 12 and checked > 150
