"""Kernels from a library that was compiled beforehand: the same answers, or none where anything does not fit."""

import importlib
import importlib.util
import json
import pkgutil
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rocking.kernels
from rocking.kernels import compiled, library
from rocking.kernels.signatures import signatures

SCRIPT = Path(__file__).resolve().parent.parent / "scripts" / "ship_kernels.py"
NAMES = ("sine.eq65.eq65_time", "sine.eq65.eq65_sums", "sine.sequence.fitted_amplitudes")

pytestmark = pytest.mark.skipif(compiled.UNCOMPILED, reason="nothing is compiled")


def script() -> Any:
    spec = importlib.util.spec_from_file_location("ship_kernels", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library of a few small kernels for this machine."""
    if shutil.which("cc") is None or sys.platform == "win32":
        pytest.skip("no C compiler links a library here")
    folder, module = tmp_path_factory.mktemp("shipped"), script()
    levels = module.LEVELS[module.platform.machine().lower()]
    files = [library.FOLDER / f"kernels-{level}{module.SUFFIX}" for level in levels]
    # What `make` has made of these sources by the same script holds those kernels as well.
    if module.is_made(library.FOLDER, module.origin(levels, []), files):
        return library.FOLDER
    module.ship(folder, levels[:1], NAMES)
    return folder


@pytest.fixture
def shipped(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of it, where the package looks for one."""
    folder = tmp_path / "shipped"
    shutil.copytree(made, folder)
    monkeypatch.setattr(library, "FOLDER", folder)
    monkeypatch.delenv("ROCKING_SHIPPED", raising=False)
    library._search.cache_clear()
    yield folder
    library._search.cache_clear()


def both(name: str) -> tuple[Any, Any]:
    """What calls the library's function, and what numba compiles."""
    module, _, function = name.rpartition(".")
    kernel = getattr(importlib.import_module(f"rocking.kernels.{module}"), function)
    native = library.function(f"rocking.kernels.{name}")
    assert native is not None
    return native, kernel.compiled


def test_every_kernel_that_python_calls_is_listed_once() -> None:
    found = set()
    for info in pkgutil.walk_packages(rocking.kernels.__path__, "rocking.kernels."):
        if info.name.endswith("compiler"):
            continue
        for name, value in vars(importlib.import_module(info.name)).items():
            if isinstance(value, compiled.Kernel) and value.py_func.__module__ == info.name:
                found.add(f"{info.name.removeprefix('rocking.kernels.')}.{name}")
    assert len(found) >= 20
    assert {*signatures()} == found


@pytest.mark.slow
def test_numbers_and_tuples_are_those_of_numba(shipped: Path) -> None:
    random = np.random.default_rng(4)
    time, reference = both("sine.eq65.eq65_time")
    sums, sums_reference = both("sine.eq65.eq65_sums")
    for a, omega, eta in random.uniform((1.0, 0.1, 0.3), (3.0, 9.0, 0.99), (200, 3)).tolist():
        assert np.array_equal(time(a, omega, eta), reference(a, omega, eta), equal_nan=True)
        assert sums(eta) == sums_reference(eta)


def test_arrays_are_read_and_written_as_by_numba(shipped: Path) -> None:
    random = np.random.default_rng(5)
    native, reference = both("sine.sequence.fitted_amplitudes")
    omega, eta = random.uniform(0.5, 8.0, 50), random.uniform(0.4, 0.95, 50)
    found, expected = np.zeros(50), np.zeros(50)
    native(omega, eta, True, found)
    reference(omega, eta, True, expected)
    assert np.array_equal(found, expected)
    assert np.ptp(found) > 0.0


@pytest.mark.parametrize(
    "change",
    [
        lambda omega, eta, with_, out: (omega.astype(np.float32), eta, with_, out),
        lambda omega, eta, with_, out: (omega[::2], eta[::2], with_, out),
        lambda omega, eta, with_, out: (omega[:, None], eta, with_, out),
        lambda omega, eta, with_, out: (omega, eta, 1, out),
        lambda omega, eta, with_, out: (omega.tolist(), eta, with_, out),
        lambda omega, eta, with_, out: (omega, eta, with_, np.broadcast_to(out, out.shape)),
        lambda omega, eta, with_, out: (omega, eta, with_),
        lambda omega, eta, with_, out: (omega.astype(">f8"), eta, with_, out),
    ],
    ids=["single", "strided", "two dimensions", "integer", "list", "read-only", "too few", "byte order"],
)
def test_arguments_of_other_types_are_left_to_numba(shipped: Path, change: Any) -> None:
    native, _ = both("sine.sequence.fitted_amplitudes")
    with pytest.raises(library.OtherTypes):
        native(*change(np.ones(4), np.full(4, 0.9), True, np.zeros(4)))


def test_what_is_only_read_may_be_read_only(shipped: Path) -> None:
    native, _ = both("sine.sequence.fitted_amplitudes")
    omega, eta, out = np.ones(4), np.full(4, 0.9), np.zeros(4)
    omega.flags.writeable = False
    native(omega, eta, True, out)
    assert np.all(out > 1.0)


def test_records_of_another_layout_are_not_taken_for_the_same(shipped: Path) -> None:
    kind = np.dtype([("u", "f8"), ("v", "f8")])
    take = library._taker({"record": library.layout(kind)})
    packed: list[Any] = []
    take(np.zeros(1, kind)[0], packed)
    take(np.zeros(1, np.dtype(kind.descr))[0], packed)
    assert len(packed) == 2
    for other in ([("u", "f8"), ("v", "i8")], [("v", "f8"), ("u", "f8")], [("u", "f8"), ("v", "f8"), ("w", "f8")]):
        with pytest.raises(library.OtherTypes):
            take(np.zeros(1, np.dtype(other))[0], packed)


@pytest.mark.parametrize(
    "change",
    [
        lambda kernels: {},
        lambda kernels: None,
        lambda kernels: {name: [each | {"symbol": "none"} for each in several] for name, several in kernels.items()},
        lambda kernels: {
            name: [each | {"arguments": ["text"]} for each in several] for name, several in kernels.items()
        },
        lambda kernels: {name: [{"symbol": several[0]["symbol"]}] for name, several in kernels.items()},
    ],
    ids=["nothing", "null", "symbol", "types", "no types"],
)
def test_a_kernel_that_a_manifest_describes_wrongly_is_left_to_numba(shipped: Path, change: Any) -> None:
    manifest = shipped / "manifest.json"
    content = json.loads(manifest.read_text("utf-8"))
    manifest.write_text(json.dumps(content | {"kernels": change(content["kernels"])}), "utf-8")
    assert library.opened() is not None
    assert library.function("rocking.kernels.sine.eq65.eq65_time") is None


def damage(name: str, folder: Path) -> None:
    manifest = folder / "manifest.json"
    content = json.loads(manifest.read_text("utf-8"))
    if name == "stale":
        manifest.write_text(json.dumps(content | {"sources": "0" * 16}), "utf-8")
    elif name == "no manifest":
        manifest.unlink()
    elif name == "half a manifest":
        manifest.write_text(manifest.read_text("utf-8")[:100], "utf-8")
    elif name == "another manifest":
        manifest.write_text("[1, 2]", "utf-8")
    elif name == "no library":
        (folder / next(iter(content["libraries"]))).unlink()
    elif name == "half a library":
        path = folder / next(iter(content["libraries"]))
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


@pytest.mark.parametrize(
    "name", ["stale", "no manifest", "half a manifest", "another manifest", "no library", "half a library"]
)
def test_a_library_that_does_not_fit_is_not_used(shipped: Path, name: str) -> None:
    damage(name, shipped)
    assert library.opened() is None
    assert library.function("rocking.kernels.sine.eq65.eq65_time") is None


def test_the_long_way_is_chosen_by_a_variable(shipped: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert library.opened() is not None
    monkeypatch.setenv("ROCKING_SHIPPED", "0")
    library._search.cache_clear()
    assert library.opened() is None
