"""How kernels are declared, and what runs them.

A kernel's machine code comes from the library that was built with the package (see `library`). Two variables of the
environment are for work on kernels: with ROCKING_JIT=1 numba, which must be installed, compiles each kernel when it is
first called, and with NUMBA_DISABLE_JIT=1 Python runs them.
"""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from rocking.kernels import library
from rocking.kernels.sources import code_hash

F = TypeVar("F", bound=Callable[..., object])

#: Whether Python runs the kernels: slowly, with the same results to the last bit.
UNCOMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")

# - error_model: a kernel that divides by zero continues with inf or NaN, and its code reports the consequence.
# - Fast-math is never switched on: the proofs rest on IEEE rounding, and every machine computes the same result.
# - _nrt=False: kernels never allocate, so counting references to their array arguments (atomic operations, which take
#   longer than a whole Taylor step) is switched off.
# - forceinline is set for every function: otherwise numba adopts the value of the first caller, and one inlined
#   function would inline everything that it calls, including whole marches.
_OPTIONS = {"error_model": "numpy", "_nrt": False}


def _by_numba(function: Callable[..., Any], **options: Any) -> Any:
    import numba

    return numba.njit(**options)(function)


#: Compiler of the functions that are declared from now on; None where the library holds their code.
compiler: Callable[..., Any] | None = None if os.environ.get("ROCKING_JIT", "0") in ("", "0") else _by_numba


def kernel(function: F) -> F:
    """Declare a function that Python calls; it releases Python's lock while it runs."""
    if UNCOMPILED:
        return function
    if compiler is None:
        return library.Kernel(function)  # type: ignore[return-value]
    return compiler(function, nogil=True, forceinline=False, **_OPTIONS)


def inlined(function: F) -> F:
    """Declare a part of kernels that is small or called once, and always inlined."""
    return _part(function, forceinline=True)


def shared(function: F) -> F:
    """Declare a part of kernels that is called from several places, where inlining would only multiply code."""
    return _part(function, forceinline=False)


def _part(function: F, *, forceinline: bool) -> F:
    if UNCOMPILED or compiler is None:
        return function
    return compiler(function, forceinline=forceinline, **_OPTIONS)


def fingerprint() -> str:
    """Identify the code of all kernels and what compiled it."""
    if UNCOMPILED or compiler is not None:
        return code_hash(Path(__file__).parent)
    made = library.manifest()["made"]
    return hashlib.sha256(f"{made['compiler']} {made['code']}".encode()).hexdigest()[:16]


def state() -> str:
    """Name what runs the kernels in this process."""
    if UNCOMPILED:
        return "none: NUMBA_DISABLE_JIT is set, and Python runs the kernels"
    if compiler is not None:
        return "compiled by numba when first called: ROCKING_JIT is set"
    return f"library {library.opened().name}"
