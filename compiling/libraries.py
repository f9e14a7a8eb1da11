"""Build the libraries of compiled kernels for this platform; `hatch_build.py` calls this when the package is built.

numba translates the kernels into LLVM's language in two processes, and all of them are optimised together for each
level of the processor (`lowering.py`). Here the results are linked, and a manifest describes them. This imports the
standard library alone, because the packages that compile are installed only where something must be compiled.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import importlib.util
import json
import os
import platform
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
KERNELS = ROOT / "src" / "rocking" / "kernels"
OUT = KERNELS / "built"

#: The compiler, and packages that the kernels' sources import: exactly, since constraints do not reach isolated builds.
REQUIREMENTS = ["numba==0.68.1", "llvmlite==0.50.0", "numpy==2.4.6", "lazy-loader==0.6"]

#: The linker of WebAssembly with its C library, and of libraries where there is no C compiler.
ZIG = "ziglang==0.17.0"

#: Kernels in the WebAssembly of the standalone page, and functions of the C library that the page calls.
PAGE_KERNELS = ("march.march", "trace.trace", "ground.write_pieces")
PAGE_FUNCTIONS = ("sin", "cos", "tan", "atan2", "hypot")

MACHINE = {"amd64": "x86_64", "aarch64": "arm64"}.get(platform.machine().lower(), platform.machine().lower())

#: Whether the page's WebAssembly is wanted, as it is by default wherever ziglang can be installed.
PAGE = (
    os.environ.get("ROCKING_PAGE") != "0"
    and MACHINE in ("x86_64", "arm64")
    and sys.platform in ("linux", "darwin", "win32")
)

#: Levels of the processor as LLVM names them, the one that every machine has first.
LEVELS = {"x86_64": ["x86-64", "x86-64-v3", "x86-64-v4"]}.get(MACHINE, ["generic"])

#: The oldest C library in the names of wheels, even where nothing newer than an older one is needed.
OLDEST_NAMED = 17

#: The oldest macOS that libraries are linked and wheels are named for: the first on arm64.
OLDEST_MACOS = "11.0"

MACOS = [f"-mmacosx-version-min={OLDEST_MACOS}"] if sys.platform == "darwin" else []

#: Whether libraries for all levels are wanted, as releases hold them, not only those that serve this machine.
EVERY_LEVEL = os.environ.get("ROCKING_LEVELS") == "all"

SUFFIX = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")


class BuildError(Exception):
    """The kernels cannot be built: one sentence."""


def dependencies() -> list[str]:
    """List the packages that the build needs besides hatchling: none where the libraries are current."""
    if is_current():
        return []
    return [*REQUIREMENTS, *([ZIG] if PAGE else [])]


def build() -> list[Path]:
    """Build the libraries and the manifest, unless they are current, and return their paths.

    Builds of one source tree wait for each other. Each library has a name of its own, and the manifest is replaced
    last, so that a process that starts meanwhile opens files that belong together.
    """
    OUT.mkdir(exist_ok=True)
    with _alone():
        if not is_current():
            with tempfile.TemporaryDirectory(dir=OUT, prefix=".") as folder:
                _make(Path(folder))
        manifest = json.loads((OUT / "manifest.json").read_text("utf-8"))
        if manifest["text"] != sources("hash_text"):  # comments have changed, and nothing else
            _put_manifest(manifest | {"text": sources("hash_text")})
    return [OUT / "manifest.json", *(OUT / each["file"] for each in _files(manifest))]


@contextlib.contextmanager
def _alone() -> Iterator[None]:
    """Let one process build at a time; on Windows builds that start together all do the work."""
    if sys.platform == "win32":
        yield
        return
    import fcntl

    with (OUT / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def is_current() -> bool:
    """Whether the libraries are there, whole, for this platform, and made from these sources by this script."""
    try:
        manifest = json.loads((OUT / "manifest.json").read_text("utf-8"))
        return bool(
            manifest["made"] == _made()
            and len(manifest["libraries"]) >= (len(LEVELS) if EVERY_LEVEL else 1)
            and all(_digest(OUT / each["file"]) == each["sha256"] for each in _files(manifest))
        )
    except (OSError, ValueError, LookupError, TypeError):
        return False


def _files(manifest: dict[str, Any]) -> list[dict[str, Any]]:
    """List the libraries of a manifest, and the page's WebAssembly where it was made."""
    return [*manifest["libraries"], *filter(None, [manifest["page"]])]


def _made() -> dict[str, Any]:
    """Describe what libraries are made from and for."""
    scripts = [_digest(path) for path in sorted(Path(__file__).parent.glob("*.py"))]
    code = sources("hash_code")
    return {
        "code": code,
        "scripts": scripts,
        "compiler": REQUIREMENTS[0],
        "platform": sysconfig.get_platform(),
        "page": PAGE,
    }


def sources(kind: str) -> str:
    """Hash the kernels' sources as `rocking.kernels.sources` does."""
    return str(runpy.run_path(str(KERNELS / "sources.py"))[kind](KERNELS))


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _make(folder: Path) -> None:
    """Make libraries and manifest in a folder, and move them to their place."""
    linker, made, text = _linker(), _made(), sources("hash_text")
    zig = _zig() if PAGE else []
    if PAGE and not zig:
        print("ziglang was not found: without it there is no standalone page, and all else works", file=sys.stderr)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        steps = [("lower", "0"), ("lower", "1"), ("level", "-")]
        lowered: list[Future[Any]] = [pool.submit(_run, folder, *step) for step in steps]
        prepared: list[Future[Any]] = [pool.submit(_link_page, folder, zig)] if zig else []  # compiles the C library
        for each in lowered:
            each.result()
        levels = LEVELS if EVERY_LEVEL else [*dict.fromkeys([LEVELS[0], (folder / "level").read_text("utf-8")])]
        optimised: list[Future[Any]] = [pool.submit(_run, folder, "optimise", level) for level in levels]
        prepared += [pool.submit(_run, folder, "page", "-")] if zig else []
        for each in [*optimised, *prepared]:
            each.result()
    libraries = [_linked(folder, level, linker) for level in levels]
    page = _placed(_link_page(folder, zig, folder / "page.o"), "page") if zig else None
    kernels = {name: kernel for part in folder.glob("*.json") for name, kernel in json.loads(part.read_text()).items()}
    manifest = {"made": made, "text": text, "libraries": libraries, "kernels": kernels, "page": page}
    _put_manifest(manifest)
    for old in {*OUT.glob("kernels-*"), *OUT.glob("page-*")} - {OUT / each["file"] for each in _files(manifest)}:
        with contextlib.suppress(OSError):  # Windows keeps a library that a process has opened
            old.unlink()


def _linked(folder: Path, level: str, linker: tuple[list[str], list[str]]) -> dict[str, Any]:
    """Link the library of a level, move it to its place and describe it."""
    command, needed = linker
    path = folder / f"{level}{SUFFIX}"
    subprocess.run([*command, "-o", str(path), str(folder / f"{level}.o"), *needed], check=True)
    return {"level": LEVELS.index(level), **_placed(path, f"kernels-{level}")}


def _placed(path: Path, name: str) -> dict[str, Any]:
    """Move a file to its place, under a name of its own, and describe it."""
    sha256 = _digest(path)
    file = f"{name}-{sha256[:8]}{path.suffix}"
    path.replace(OUT / file)
    return {"file": file, "sha256": sha256}


def _link_page(folder: Path, zig: list[str], code: Path | None = None) -> Path:
    """Link the page's WebAssembly with zig's C library, so that it imports nothing; without code only that library.

    All its results are the same on every machine, because its arithmetic is that of IEEE, without fused operations.
    """
    kernels = [f"rocking_{name.replace('.', '_')}" for name in PAGE_KERNELS] if code else []
    if code is None:
        code = folder / "nothing.c"
        code.write_text("int nothing;\n")
    exports = [f"--export={name}" for name in (*kernels, *PAGE_FUNCTIONS, "__heap_base")]
    options = [f"-Wl,{each}" for each in ("--no-entry", "--export-memory", *exports)]
    command = [*zig, "cc", "-target", "wasm32-wasi", "-mexec-model=reactor", "-O2", "-s", *options]
    path = code.with_suffix(".wasm")
    subprocess.run([*command, str(code), "-lm", "-o", str(path)], check=True)
    return path


def _put_manifest(manifest: dict[str, Any]) -> None:
    new = OUT / ".manifest.json"
    new.write_text(json.dumps(manifest), "utf-8")
    new.replace(OUT / "manifest.json")


def _run(folder: Path, step: str, argument: str) -> None:
    """Run a step of `lowering.py` in a process of its own, whose errors are shown."""
    environment = os.environ | {
        # What numba compiles for its own use beside the kernels runs on every processor, too.
        "NUMBA_CPU_NAME": LEVELS[0],
        "NUMBA_CPU_FEATURES": "",
        "PYTHONPATH": os.pathsep.join(filter(None, [str(ROOT / "src"), os.environ.get("PYTHONPATH")])),
    }
    for name in ("NUMBA_DISABLE_JIT", "ROCKING_JIT"):
        environment.pop(name, None)
    program = str(Path(__file__).with_name("lowering.py"))
    subprocess.run([sys.executable, program, step, str(folder), argument], env=environment, check=True)


def _c_compiler() -> list[str]:
    """Find a C compiler: CC names one, else the first of the usual names; nothing where there is none."""
    named = shlex.split(os.environ.get("CC", ""))
    candidates = [named] if named else [["cc"], ["gcc"], ["clang"]]
    return next((each for each in candidates if shutil.which(each[0])), [])


def _zig() -> list[str]:
    """Find ziglang."""
    return [] if importlib.util.find_spec("ziglang") is None else [sys.executable, "-m", "ziglang"]


def _linker() -> tuple[list[str], list[str]]:
    """Return the command that links a library, without its files, and the libraries that it needs."""
    zig = _zig()
    gnu = platform.libc_ver()[0] == "glibc"
    if compiler := _c_compiler():
        strip = ["-Wl,--strip-all", "-Wl,-z,noexecstack"] if sys.platform == "linux" else []
        return [*compiler, "-shared", *strip, *MACOS], ["-lm"]
    if zig and gnu:  # `zig cc` links its own sincos and memset, and last bits differ
        return [*zig, "ld.lld", "-shared", "-s", "-z", "noexecstack"], [_loaded("libm.so.6"), _loaded("libc.so.6")]
    if zig:
        return [*zig, "cc", "-shared", *MACOS], ["-lm"]
    raise BuildError(
        "neither a C compiler nor ziglang was found to link them; install a C compiler such as gcc or clang (the "
        "variable CC may name it), or a wheel of rocking for this platform"
    )


def _loaded(name: str) -> str:
    """Path of a library of the system, which this process opens."""
    ctypes.CDLL(name)
    lines = Path("/proc/self/maps").read_text("utf-8").splitlines()
    return next(line.split()[-1] for line in lines if line.endswith(f"/{name}"))


def tag() -> str:
    """Name the platform of a wheel: for releases the oldest system that it runs on, else this one."""
    if EVERY_LEVEL and platform.libc_ver()[0] == "glibc":
        libraries = [path.read_bytes() for path in OUT.glob("kernels-*")]
        needed = [int(minor) for library in libraries for minor in re.findall(rb"GLIBC_2\.(\d+)", library)]
        return f"manylinux_2_{max([OLDEST_NAMED, *needed])}_{platform.machine()}"
    if sys.platform == "darwin":  # Python itself may be for two processors; a library is for one
        return f"macosx_{OLDEST_MACOS.replace('.', '_')}_{platform.machine()}"
    return sysconfig.get_platform().replace("-", "_").replace(".", "_")
