"""How kernels are compiled: IEEE arithmetic, no exceptions, no reference counts; and where the results are kept."""

import contextlib
import functools
import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import numba

from rocking.kernels.parts import KernelCompiler, part

F = TypeVar("F", bound=Callable[..., object])

_HERE = Path(__file__).parent

# - error_model: a kernel that divides by zero goes on with inf or NaN and reports through its status.
# - fast-math is never switched on: the proofs rest on IEEE rounding, and every machine gives the same answer.
# - _nrt=False: kernels never allocate, so counting references to their array arguments (atomic operations, dearer
#   than a whole Taylor step) is switched off.
_OPTIONS = {"error_model": "numpy", "_nrt": False}

# - forceinline is said of every function: numba hands an unsaid one down from the first caller, so that one inlined
#   function would inline all that it calls, a march included.
# - no_cfunc_wrapper: nobody calls a kernel from C.
_KERNEL = {"forceinline": False, "no_cfunc_wrapper": True, "pipeline_class": KernelCompiler}


def kernel(function: F) -> F:
    """Compile an entry point that Python calls: cached on disk, and free of Python's lock while it runs."""
    folder = cache_folder()
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder or "")
    try:
        compiled: F = numba.njit(cache=folder is not None, nogil=True, **_KERNEL, **_OPTIONS)(function)
    finally:
        numba.config.CACHE_DIR = before
    return compiled


def inlined(function: F) -> F:
    """Compile a part of a kernel that is small or called once, always inlined."""
    compiled: F = part(function, forceinline=True, **_OPTIONS)
    return compiled


def shared(function: F) -> F:
    """Compile a part that kernels call from several places, where inlining would only multiply code."""
    compiled: F = part(function, forceinline=False, **_OPTIONS)
    return compiled


@functools.cache
def cache_folder() -> Path | None:
    """Folder for what is compiled from exactly these sources; None where nothing can be written.

    numba looks for changes in the file of an entry point alone, and would go on with stale code when another kernel
    that it calls has changed. So the folder's name holds a hash of all of them. numba writes its files under another
    name and renames them, so that any number of processes may share the folder.
    """
    name = f"kernels-{fingerprint()}"
    for parent in _parents():
        folder = parent / name
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    return None


def _parents() -> Iterator[Path]:
    """Places for the cache, in order: as numba is told, beside the sources, the user's, a temporary one."""
    if numba.config.CACHE_DIR:
        yield Path(numba.config.CACHE_DIR)
    yield _HERE / "__pycache__"
    home = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME")
    with contextlib.suppress(RuntimeError):  # no home
        yield (Path(home) if home else Path.home() / ".cache") / "rocking"
    yield Path(tempfile.gettempdir()) / f"rocking-{os.getuid() if hasattr(os, 'getuid') else 'cache'}"


def fingerprint() -> str:
    """Hash of all kernels' sources and of the compiler's version."""
    sources = sorted(_HERE.rglob("*.py"))
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sources:
        digest.update(str(source.relative_to(_HERE)).encode() + b"\0" + source.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
