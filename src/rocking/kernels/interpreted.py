"""Kernels as Python reads them: the same answers to the last bit, a thousand times slower, and nothing to compile.

A single march often takes fewer steps than compiling takes seconds.
"""

import ctypes
import sys
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from rocking.kernels.compiled import Kernel, OnUse

#: Modules' names with the functions in them as Python reads them, and those functions.
_modules: dict[str, dict[str, Any]] = {}
_functions: dict[Callable[..., Any], Callable[..., Any]] = {}


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


def _function(function: Any) -> Callable[..., Any]:
    """Make a function that sees other kernels and parts as Python reads them, too."""
    names = _names(function.__module__)
    if function not in _functions:
        _functions[function] = FunctionType(
            function.__code__, names, function.__name__, function.__defaults__, function.__closure__
        )
    return _functions[function]


def _names(module: str) -> dict[str, Any]:
    if module not in _modules:
        names = _modules[module] = dict(vars(sys.modules[module]))
        for name, value in list(names.items()):
            if isinstance(value, OnUse):
                names[name] = _function(value.py_func)
    return _modules[module]


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
