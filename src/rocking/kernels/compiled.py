"""How kernels are declared, and where their machine code comes from.

A kernel's code is in the library that came with the package (`library`), if it was made from exactly these sources and
for these types; else numba compiles it when it is first called (`compiler`), and keeps the result on disk. Until then
numba is not even imported, which alone takes longer than a simulation.
"""

import contextlib
import functools
import hashlib
import os
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Any, TypeVar

from rocking.kernels import library
from rocking.kernels.sources import sources

F = TypeVar("F", bound=Callable[..., object])

_HERE = Path(__file__).parent

#: Whether kernels run as Python reads them, in numba's own words: slow, and the same to the last bit.
UNCOMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


#: What is called once, before anything is compiled.
before_compiling: list[Callable[[], None]] = []


_ONE_AT_A_TIME = threading.RLock()

#: Sources of kernels, by their folder, as they were when this process began to import them.
_imported = {_HERE: sources(_HERE)}


class OnUse:
    """A function that is compiled when it is first needed, by a call or by a kernel that calls it."""

    def __init__(self, function: Callable[..., Any], compile_: Callable[[Callable[..., Any]], Any]) -> None:
        functools.update_wrapper(self, function)
        #: The function as Python reads it.
        self.py_func = function
        self._compile = compile_

    @functools.cached_property
    def compiled(self) -> Any:
        """What numba makes of it; one thread at a time asks for it."""
        with _ONE_AT_A_TIME:
            while before_compiling:  # an interrupt leaves to the next call what has not been done
                before_compiling[-1]()
                before_compiling.pop()
            return vars(self).get("compiled") or self._compile(self.py_func)

    @property
    def _numba_type_(self) -> Any:
        """The type as which numba sees it in other kernels."""
        return self.compiled._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function."""
        return self.compiled(*arguments)


class Kernel(OnUse):
    """An entry point, which the library that came with the package may hold."""

    @functools.cached_property
    def native(self) -> Callable[..., Any] | None:
        """What calls its code in the library; None if there is none."""
        return library.function(f"{self.py_func.__module__}.{self.py_func.__qualname__}")

    @property
    def is_at_hand(self) -> bool:
        """Whether a call compiles nothing, as far as can be told without importing numba."""
        made = vars(self).get("compiled")
        # numba may still be at work on it, in another thread.
        return self.native is not None or (made is not None and len(made.overloads) > 0) or self._is_cached

    @functools.cached_property
    def _is_cached(self) -> bool:
        """Whether numba keeps code of it, named by place of the source and version of Python: no other is loaded."""
        folder, source = cache_folder(), Path(self.py_func.__code__.co_filename).absolute()
        place = hashlib.sha1(str(source.parent).encode(), usedforsecurity=False).hexdigest()
        version = "py{}{}{}".format(*sys.version_info[:2], getattr(sys, "abiflags", ""))
        entry = f"*_{place}/{source.stem}.{self.py_func.__qualname__}-*.{version}.*.nbc"
        return folder is not None and any(folder.glob(entry))

    def prepare(self, *arguments: Any) -> None:
        """Compile it for arguments of these types, unless the library has code of it; it is not called."""
        if self.native is None:
            from numba import typeof

            self.compiled.compile(tuple(typeof(argument) for argument in arguments))

    def __call__(self, *arguments: Any) -> Any:
        """Call the code in the library, or what numba compiles where the library does not take these arguments."""
        if self.native is not None:
            try:
                return self.native(*arguments)
            except library.OtherTypes:
                pass
        return self.compiled(*arguments)


def kernel(function: F) -> F:
    """Declare an entry point that Python calls; it is free of Python's lock while it runs."""

    def compile_(function: Callable[..., Any]) -> Any:
        from rocking.kernels import compiler

        return compiler.kernel_of(function, cache_folder())

    return function if UNCOMPILED else Kernel(function, compile_)  # type: ignore[return-value]


def inlined(function: F) -> F:
    """Declare a part of a kernel that is small or called once, always inlined."""
    return _part(function, inline=True)


def shared(function: F) -> F:
    """Declare a part that kernels call from several places, where inlining would only multiply code."""
    return _part(function, inline=False)


def _part(function: F, *, inline: bool) -> F:
    def compile_(function: Callable[..., Any]) -> Any:
        from rocking.kernels import compiler

        # The folder's name tells the sources of this package's parts, and of no others.
        ours = function.__module__.startswith(f"{__package__}.")
        return compiler.part_of(function, cache_folder() if ours else None, inline=inline)

    return function if UNCOMPILED else OnUse(function, compile_)  # type: ignore[return-value]


@functools.cache
def cache_folder() -> Path | None:
    """Folder for what is compiled from exactly these sources; None where nothing can be written, or they have changed.

    numba checks the file of an entry point only, and would use old code when another kernel that it calls has changed.
    So the folder's name is a hash of all of them. Files are written under another name and renamed, so that any number
    of processes may share the folder. A process that has imported what the files no longer say keeps nothing: others
    would take it for code of the new sources.
    """
    now = sources(_HERE)
    if _imported.setdefault(_HERE, now) != now:
        return None
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
    if wished := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(wished)
    yield _HERE / "__pycache__"
    home = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME")
    with contextlib.suppress(RuntimeError):  # no home
        yield (Path(home) if home else Path.home() / ".cache") / "rocking"
    yield Path(tempfile.gettempdir()) / f"rocking-{os.getuid() if hasattr(os, 'getuid') else 'cache'}"


def fingerprint() -> str:
    """Hash of all kernels' sources and of the compiler's version."""
    return hashlib.sha256(f"{metadata.version('numba')} {sources(_HERE)}".encode()).hexdigest()[:16]


def state() -> str:
    """Say where compiled code comes from in this process: a library, numba's folder, or nowhere."""
    if UNCOMPILED:
        return "none: NUMBA_DISABLE_JIT has Python read the kernels"
    if library.opened() is not None:
        return f"{library.state()}, made beforehand from exactly these sources"
    folder = cache_folder()
    kept = f"keeps it in {folder}" if folder else "can keep it nowhere"
    return f"numba compiles when something is first used, and {kept}; {library.state()}"
