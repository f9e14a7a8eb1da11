"""Calls of kernels in the library that was built with the package.

The build creates a library for each processor level, and a manifest with hashes of the sources and argument types of
the kernels. A kernel accepts the address of its arguments, packed into eight bytes each: numbers, addresses of records,
addresses and shapes of arrays, and members of tuples.
"""

import ctypes
import functools
import hashlib
import json
import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from rocking.errors import KernelsError
from rocking.kernels.sources import code_hash, text_hash

SOURCES: Final = Path(__file__).parent

#: Folder of the libraries and the manifest.
FOLDER: Final = SOURCES / "built"

_ADVICE: Final = "run make kernels in the source tree, or install rocking again"

#: Function that appends an argument to a list, or raises TypeError or ValueError for another type.
Taker = Callable[[Any, list[Any]], None]


class Library(NamedTuple):
    """Open library."""

    name: str
    handle: ctypes.CDLL
    kernels: dict[str, Any]


@functools.cache
def opened() -> Library:
    """Open the library of the highest level that this processor supports.

    Raises
    ------
    KernelsError
        If it is missing, damaged, or built from other sources.
    """
    built = manifest()
    try:
        lowest = built["libraries"][0]
        level = _open(lowest).rocking_level()
        best = [each for each in built["libraries"] if each["level"] <= level][-1]
        return Library(best["file"], _open(best), built["kernels"])
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise KernelsError(f"the compiled kernels in {FOLDER} cannot be opened ({error}); {_ADVICE}") from error


@functools.cache
def manifest() -> dict[str, Any]:
    """Read the manifest of the libraries, which must be built from the sources of this process.

    Raises
    ------
    KernelsError
        If it is missing, or the sources differ.
    """
    try:
        built: dict[str, Any] = json.loads((FOLDER / "manifest.json").read_text("utf-8"))
        current = built["text"] == text_hash(SOURCES) or built["made"]["code"] == code_hash(SOURCES)
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise KernelsError(f"there are no compiled kernels in {FOLDER}; {_ADVICE}") from error
    if not current:
        raise KernelsError(f"the sources in {SOURCES} have changed since the kernels were compiled; {_ADVICE}")
    return built


def _open(described: dict[str, Any]) -> ctypes.CDLL:
    path = FOLDER / described["file"]
    # The system opens a truncated library without error, but calling it terminates the process.
    if hashlib.sha256(path.read_bytes()).hexdigest() != described["sha256"]:
        raise ValueError(f"{path.name} is not the file that was built")
    return ctypes.CDLL(str(path))


class Kernel:
    """Function in the library, which is opened at the first call."""

    __name__: str

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)

    @functools.cached_property
    def native(self) -> Callable[..., Any]:
        """The function that packs arguments and calls the library."""
        name = f"{self.__module__.removeprefix(f'{__package__}.')}.{self.__name__}"
        return _caller(name, opened())

    def __call__(self, *arguments: Any) -> Any:
        """Call the function; raise `TypeError` for arguments of types for which it was not compiled."""
        return self.native(*arguments)


def _caller(name: str, library: Library) -> Callable[..., Any]:
    kernel = library.kernels[name]
    code = getattr(library.handle, kernel["symbol"])
    takers = [_taker(kind) for kind in kernel["arguments"]]
    pack = struct.Struct("=" + "".join(map(_format, kernel["arguments"]))).pack
    returned = struct.Struct("=" + "".join(map(_format, kernel["returns"])))
    several = len(kernel["returns"]) > 1
    code.restype = None
    if len(kernel["returns"]) == 1:
        code.restype = {"int": ctypes.c_int64, "float": ctypes.c_double}[kernel["returns"][0]]
    code.argtypes = [ctypes.c_char_p, ctypes.c_char_p]

    def call(*arguments: Any) -> Any:
        packed: list[Any] = []
        try:
            for take, argument in zip(takers, arguments, strict=True):
                take(argument, packed)
            data = pack(*packed)
        except (TypeError, ValueError, struct.error) as error:
            raise TypeError(f"{name} is not compiled for these arguments: {error}") from error
        if not several:
            return code(data, None)
        answer = ctypes.create_string_buffer(returned.size)
        code(data, answer)
        return returned.unpack(answer.raw)

    return call


def _format(kind: Any) -> str:
    """Return the `struct` format of an argument: eight bytes per number or address."""
    if isinstance(kind, str):
        return {"int": "q", "bool": "q", "float": "d"}[kind]
    if "tuple" in kind:
        return "".join(map(_format, kind["tuple"]))
    return "q" + "q" * int(kind.get("dimensions", 0))


def _taker(kind: Any) -> Taker:
    if isinstance(kind, str):
        return _pack_bool if kind == "bool" else lambda value, packed: packed.append(value)
    if "tuple" in kind:
        return _tuple_taker([_taker(each) for each in kind["tuple"]])
    return _array_taker(kind) if "dimensions" in kind else _record_taker(kind)


def _pack_bool(value: Any, packed: list[Any]) -> None:
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{value!r} is neither True nor False")
    packed.append(bool(value))


def _tuple_taker(takers: Sequence[Taker]) -> Taker:
    def take(value: Any, packed: list[Any]) -> None:
        for taker, member in zip(takers, value, strict=True):
            taker(member, packed)

    return take


def _array_taker(kind: dict[str, Any]) -> Taker:
    check = _layout_check(kind["items"])
    dimensions, written, aligned = kind["dimensions"], not kind["readonly"], kind["aligned"]

    def take(value: Any, packed: list[Any]) -> None:
        if not isinstance(value, np.ndarray) or value.ndim != dimensions:
            raise TypeError(f"an array of {dimensions} dimensions is required, not {type(value).__name__}")
        flags = value.flags
        if not (flags.c_contiguous and (flags.aligned or not aligned) and (flags.writeable or not written)):
            raise TypeError("an array is not contiguous, not aligned or read-only")
        check(value.dtype)
        packed.append(value.ctypes.data)
        packed.extend(value.shape)

    return take


def _record_taker(kind: dict[str, Any]) -> Taker:
    check = _layout_check(kind["record"])

    def take(value: Any, packed: list[Any]) -> None:
        if not isinstance(value, np.void):
            raise TypeError(f"a record is required, not {type(value).__name__}")
        check(value.dtype)
        packed.append(np.frombuffer(value, np.uint8).ctypes.data)

    return take


def _layout_check(expected: str) -> Callable[[np.dtype[Any]], None]:
    """Return a check of types that compares layouts only if the type has changed."""
    known: np.dtype[Any] | None = None

    def check(kind: np.dtype[Any]) -> None:
        nonlocal known
        if kind is not known:
            if str(kind.descr) != expected:
                raise TypeError(f"items of type {kind} are laid out otherwise")
            known = kind

    return check
