"""Kernels as Python reads them: the same answers to the last bit, a thousand times slower, and nothing to compile.

A single march often takes fewer steps than compiling takes seconds.
"""

import ctypes
import functools
import sys
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from rocking.kernels.compiled import Kernel, OnUse


class Interpreted:
    """A kernel as Python reads it, for some work in all: then its machine code is worth compiling."""

    def __init__(self, kernel: Callable[..., Any], work: int) -> None:
        self._kernel, self._function = kernel, getattr(kernel, "py_func", kernel)
        self._left = work

    def work(self) -> int:
        """Return how much it may do before the kernel is compiled; nothing where that has machine code at hand."""
        return self._left if isinstance(self._kernel, Kernel) and not self._kernel.is_at_hand else 0

    def spend(self, work: int) -> None:
        """Take note of work that was done."""
        self._left -= work

    def __call__(self, *arguments: Any) -> Any:
        """Do the same as the kernel.

        Raises
        ------
        ArithmeticError, ValueError
            Where the kernel would go on with inf or NaN. Arguments may then be changed in part.
        """
        with np.errstate(all="ignore"):
            return _function(self._function)(*map(_attributed, arguments))


@functools.cache
def _function(function: Callable[..., Any]) -> Callable[..., Any]:
    """Make a function that sees other kernels and parts as Python reads them, too.

    It is kept once it is whole: another thread, or a call after an interrupt, would compile what is still missing.
    """
    return _with_parts(function, {})


def _with_parts(function: Callable[..., Any], modules: dict[str, dict[str, Any]]) -> Callable[..., Any]:
    """Make a function, and those of its module first; ``modules``: names and values of the modules seen so far."""
    if function.__module__ not in modules:
        names = modules[function.__module__] = dict(vars(sys.modules[function.__module__]))
        for name, value in list(names.items()):
            if isinstance(value, OnUse):
                names[name] = _with_parts(value.py_func, modules)
    return FunctionType(
        function.__code__, modules[function.__module__], function.__name__, function.__defaults__, function.__closure__
    )


def _attributed(argument: Any) -> Any:
    """Return a view of an argument whose records' fields are attributes, as they are for compiled code."""
    if isinstance(argument, tuple) and hasattr(argument, "_fields"):
        return type(argument)(*map(_attributed, argument))
    if isinstance(argument, np.ndarray) and argument.dtype.fields is not None:
        return argument.view(np.recarray)
    if isinstance(argument, np.void):
        # A view of one record for writing: NumPy gives the address, but only for reading.
        address = np.frombuffer(argument, np.uint8).ctypes.data
        memory = (ctypes.c_char * argument.dtype.itemsize).from_address(address)
        return np.frombuffer(memoryview(memory), argument.dtype).view(np.recarray)[0]
    return argument
