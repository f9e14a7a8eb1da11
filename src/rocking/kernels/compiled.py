"""Declaration of kernels, and choice of how they run.

Their machine code is in the library that was built with the package (see `library`). For development, ROCKING_JIT=1
makes numba, if installed, compile each kernel at its first call, and NUMBA_DISABLE_JIT=1 makes Python run them.
"""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from rocking.kernels import library
from rocking.kernels.sources import hash_code

F = TypeVar("F", bound=Callable[..., object])

#: Whether Python runs the kernels: slowly, with the same results to the last bit.
UNCOMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")

# - error_model: after a division by zero, a kernel continues with inf or NaN, and its code reports the consequence.
# - Fast-math is never enabled: the proofs rely on IEEE rounding, and every machine computes the same result.
# - _nrt=False: kernels never allocate, so that reference counting of arrays (atomic operations, slower than a Taylor
#   step) is disabled.
# - forceinline is set for every function. Otherwise numba adopts the value of the first caller, and one inlined
#   function would inline everything that it calls, including entire marches.
_OPTIONS = {"error_model": "numpy", "_nrt": False}


def _compile_with_numba(function: Callable[..., Any], **options: Any) -> Any:
    import numba

    return numba.njit(**options)(function)


#: Compiler of all functions declared from now on; None if the library contains their code.
compiler: Callable[..., Any] | None = None if os.environ.get("ROCKING_JIT", "0") in ("", "0") else _compile_with_numba


def kernel(function: F) -> F:
    """Declare a function that Python calls and that releases the interpreter lock."""
    if UNCOMPILED:
        return function
    if compiler is None:
        return library.Kernel(function)  # type: ignore[return-value]
    return compiler(function, nogil=True, forceinline=False, **_OPTIONS)


def inlined(function: F) -> F:
    """Declare a part of kernels that is small or called once, and always inlined."""
    return _declare_part(function, forceinline=True)


def not_inlined(function: F) -> F:
    """Declare a part of kernels with several callers, where inlining would only duplicate code."""
    return _declare_part(function, forceinline=False)


def _declare_part(function: F, *, forceinline: bool) -> F:
    if UNCOMPILED or compiler is None:
        return function
    return compiler(function, forceinline=forceinline, **_OPTIONS)


def fingerprint() -> str:
    """Return a hash of the code of all kernels and their compiler."""
    if UNCOMPILED or compiler is not None:
        return hash_code(Path(__file__).parent)
    build = library.read_manifest()["made"]
    return hashlib.sha256(f"{build['compiler']} {build['code']}".encode()).hexdigest()[:16]


def describe_mode() -> str:
    """Return a description of how the kernels run in this process."""
    if UNCOMPILED:
        return "none: NUMBA_DISABLE_JIT is set, and Python runs the kernels"
    if compiler is not None:
        return "compiled by numba when first called: ROCKING_JIT is set"
    return f"library {library.open_library().name}"
