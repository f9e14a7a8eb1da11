"""How kernels are compiled: IEEE arithmetic, no exceptions, no reference counts."""

from collections.abc import Callable
from typing import TypeVar

import numba

F = TypeVar("F", bound=Callable[..., object])

# - error_model: a kernel that divides by zero goes on with inf or NaN and reports through its status.
# - fast-math is never switched on: the proofs rest on IEEE rounding, and every machine gives the same answer.
# - _nrt=False: kernels never allocate, so counting references to their array arguments (atomic operations, dearer
#   than a whole Taylor step) is switched off.


def kernel(function: F) -> F:
    """Compile an entry point that Python calls: cached on disk, and free of Python's lock while it runs."""
    compiled: F = numba.njit(cache=True, nogil=True, error_model="numpy", _nrt=False)(function)
    return compiled


def inlined(function: F) -> F:
    """Compile a small part of a kernel, always inlined."""
    compiled: F = numba.njit(error_model="numpy", _nrt=False, forceinline=True)(function)
    return compiled


def shared(function: F) -> F:
    """Compile a part that kernels call from several places, where inlining would only multiply code."""
    compiled: F = numba.njit(error_model="numpy", _nrt=False)(function)
    return compiled
