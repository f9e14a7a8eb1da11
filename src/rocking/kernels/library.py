"""Calls of kernels in the library that was built with the package.

The build creates a library for each processor level, and a manifest with hashes of the sources and argument types of
the kernels. A kernel accepts the address of its arguments, packed into eight bytes each: numbers, addresses of structs,
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
from rocking.kernels.sources import hash_code, hash_text

SOURCES: Final = Path(__file__).parent

#: Folder of the libraries and the manifest.
FOLDER: Final = SOURCES / "built"

_ADVICE: Final = "run make kernels in the source tree, or install rocking again"

#: Function that appends an argument to a list, or raises TypeError or ValueError for another type.
Packer = Callable[[Any, list[Any]], None]


class Library(NamedTuple):
    """Open library."""

    name: str  # file name
    handle: ctypes.CDLL  # library as opened by the system
    kernels: dict[str, Any]  # symbol and types of arguments and results of each kernel


@functools.cache
def open_library() -> Library:
    """Open the library of the highest level that this processor supports.

    Raises
    ------
    KernelsError
        If it is missing, damaged, or built from other sources.
    """
    manifest = read_manifest()
    try:
        baseline = manifest["libraries"][0]
        level = _load_library(baseline).rocking_level()
        best = [entry for entry in manifest["libraries"] if entry["level"] <= level][-1]
        return Library(best["file"], _load_library(best), manifest["kernels"])
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise KernelsError(f"the compiled kernels in {FOLDER} cannot be opened ({error}); {_ADVICE}") from error


@functools.cache
def read_manifest() -> dict[str, Any]:
    """Read the manifest of the libraries, which must be built from the sources of this process.

    Raises
    ------
    KernelsError
        If it is missing, or the sources differ.
    """
    try:
        contents: dict[str, Any] = json.loads((FOLDER / "manifest.json").read_text("utf-8"))
        is_current = contents["text"] == hash_text(SOURCES) or contents["made"]["code"] == hash_code(SOURCES)
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise KernelsError(f"there are no compiled kernels in {FOLDER}; {_ADVICE}") from error
    if not is_current:
        raise KernelsError(f"the sources in {SOURCES} have changed since the kernels were compiled; {_ADVICE}")
    return contents


def _load_library(entry: dict[str, Any]) -> ctypes.CDLL:
    path = FOLDER / entry["file"]
    # The system opens a truncated library without error, but calling it terminates the process.
    if hashlib.sha256(path.read_bytes()).hexdigest() != entry["sha256"]:
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
        return _make_caller(name, open_library())

    def __call__(self, *arguments: Any) -> Any:
        """Call the function; raise `TypeError` for arguments of types for which it was not compiled."""
        return self.native(*arguments)


def _make_caller(name: str, library: Library) -> Callable[..., Any]:
    kernel = library.kernels[name]
    code = getattr(library.handle, kernel["symbol"])
    packers = [_make_packer(description) for description in kernel["arguments"]]
    pack = struct.Struct("=" + "".join(map(_write_struct_format, kernel["arguments"]))).pack
    result_layout = struct.Struct("=" + "".join(map(_write_struct_format, kernel["returns"])))
    returns_tuple = len(kernel["returns"]) > 1
    code.restype = None
    if len(kernel["returns"]) == 1:
        code.restype = {"int": ctypes.c_int64, "float": ctypes.c_double}[kernel["returns"][0]]
    code.argtypes = [ctypes.c_char_p, ctypes.c_char_p]

    def call(*arguments: Any) -> Any:
        packed: list[Any] = []
        try:
            for pack_argument, argument in zip(packers, arguments, strict=True):
                pack_argument(argument, packed)
            data = pack(*packed)
        except (TypeError, ValueError, struct.error) as error:
            raise TypeError(f"{name} is not compiled for these arguments: {error}") from error
        if not returns_tuple:
            return code(data, None)
        buffer = ctypes.create_string_buffer(result_layout.size)
        code(data, buffer)
        return result_layout.unpack(buffer.raw)

    return call


def _write_struct_format(description: Any) -> str:
    """Return the `struct` format of an argument: eight bytes per number or address."""
    if isinstance(description, str):
        return {"int": "q", "bool": "q", "float": "d"}[description]
    if "tuple" in description:
        return "".join(map(_write_struct_format, description["tuple"]))
    return "q" + "q" * int(description.get("dimensions", 0))


def _make_packer(description: Any) -> Packer:
    if isinstance(description, str):
        return _pack_bool if description == "bool" else lambda value, packed: packed.append(value)
    if "tuple" in description:
        return _make_tuple_packer([_make_packer(member) for member in description["tuple"]])
    return _make_array_packer(description) if "dimensions" in description else _make_struct_packer(description)


def _pack_bool(value: Any, packed: list[Any]) -> None:
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{value!r} is neither True nor False")
    packed.append(bool(value))


def _make_tuple_packer(packers: Sequence[Packer]) -> Packer:
    def pack_tuple(value: Any, packed: list[Any]) -> None:
        for pack_member, member in zip(packers, value, strict=True):
            pack_member(member, packed)

    return pack_tuple


def _make_array_packer(description: dict[str, Any]) -> Packer:
    check = _make_layout_check(description["items"])
    dimensions, writable, aligned = description["dimensions"], not description["readonly"], description["aligned"]

    def pack_array(value: Any, packed: list[Any]) -> None:
        if not isinstance(value, np.ndarray) or value.ndim != dimensions:
            raise TypeError(f"an array of {dimensions} dimensions is required, not {type(value).__name__}")
        flags = value.flags
        if not (flags.c_contiguous and (flags.aligned or not aligned) and (flags.writeable or not writable)):
            raise TypeError("an array is not contiguous, not aligned or read-only")
        check(value.dtype)
        packed.append(value.ctypes.data)
        packed.extend(value.shape)

    return pack_array


def _make_struct_packer(description: dict[str, Any]) -> Packer:
    check = _make_layout_check(description["record"])

    def pack_struct(value: Any, packed: list[Any]) -> None:
        if not isinstance(value, np.void):
            raise TypeError(f"a struct is required, not {type(value).__name__}")
        check(value.dtype)
        packed.append(np.frombuffer(value, np.uint8).ctypes.data)

    return pack_struct


def _make_layout_check(expected: str) -> Callable[[np.dtype[Any]], None]:
    """Return a check of types that compares layouts only if the type has changed."""
    last_dtype: np.dtype[Any] | None = None

    def check(dtype: np.dtype[Any]) -> None:
        nonlocal last_dtype
        if dtype is not last_dtype:
            if str(dtype.descr) != expected:
                raise TypeError(f"items of type {dtype} are laid out otherwise")
            last_dtype = dtype

    return check
