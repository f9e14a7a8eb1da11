"""Kernels that came compiled with the package: libraries of native functions, called without numba.

`scripts/ship_kernels.py` makes a library for each level of the processor, and a manifest: the hash of the sources that
it was made from, and the types of each function's arguments. A function takes the address of its arguments, packed into
eight bytes each: numbers; the address of a record; the address of an array and its shape; a tuple's members.
"""

import ctypes
import functools
import hashlib
import json
import os
import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from rocking.kernels.sources import sources

#: Where libraries and manifest lie.
FOLDER: Final = Path(__file__).parent / "shipped"

Manifest = dict[str, Any]


class OtherTypes(TypeError):
    """Arguments are of types that the library has no function for."""


class _Library:
    """A library and its manifest."""

    def __init__(self, name: str, manifest: Manifest) -> None:
        # The system loads half a library without a word, and ends the process when something is called.
        if hashlib.sha256((FOLDER / name).read_bytes()).hexdigest() != manifest["libraries"][name]:
            raise ValueError(f"{name} is not the file that the manifest describes")
        self.name, self.manifest = name, manifest
        self.handle = ctypes.CDLL(str(FOLDER / name))


class _Unused(Exception):
    """Why no library is used, in words."""


@functools.cache
def _search() -> _Library | str:
    """Open the library of the highest level that this processor has, or say why none is used."""
    try:
        return _fitting()
    except _Unused as why:
        return str(why)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as damage:
        return f"the libraries that came with the package are damaged ({damage})"


def _fitting() -> _Library:
    if os.environ.get("ROCKING_SHIPPED", "1") == "0":
        raise _Unused("ROCKING_SHIPPED=0 leaves libraries aside")
    if not (FOLDER / "manifest.json").exists():
        raise _Unused("no library came with this installation")
    manifest = json.loads((FOLDER / "manifest.json").read_text("utf-8"))
    if manifest["sources"] != sources(Path(__file__).parent):
        raise _Unused("the libraries that came with the package were made from other sources")
    lowest, *higher = manifest["libraries"]
    found = _Library(lowest, manifest)
    best = higher[: found.handle.rocking_level()][-1:]
    return _Library(best[0], manifest) if best else found


def opened() -> _Library | None:
    """Return the library that serves this process; None if there is none that fits."""
    found = _search()
    return None if isinstance(found, str) else found


def state() -> str:
    """Name the library that serves this process, or say why there is none."""
    found = _search()
    return found if isinstance(found, str) else f"library {found.name}"


def function(name: str) -> Callable[..., Any] | None:
    """Return what calls a kernel's functions in the library; None if there are none.

    What is returned raises `OtherTypes` for arguments that no function takes.
    """
    library = opened()
    if library is None:
        return None
    try:
        variants = [_variant(getattr(library.handle, one["symbol"]), one) for one in library.manifest["kernels"][name]]
    except (AttributeError, KeyError, TypeError):  # no such kernel, or a damaged manifest
        return None
    if len(variants) == 1:
        return variants[0]

    def call(*arguments: Any) -> Any:
        for variant in variants:
            try:
                return variant(*arguments)
            except OtherTypes:
                continue
        raise OtherTypes

    return call


def _variant(code: Any, types: dict[str, Any]) -> Callable[..., Any]:
    """Return what calls one function: for arguments of certain types."""
    takers = [_taker(kind) for kind in types["arguments"]]
    pack = struct.Struct("=" + "".join(_format(kind) for kind in types["arguments"])).pack
    returned = struct.Struct("=" + "".join(_format(kind) for kind in types["returns"]))
    several = len(types["returns"]) > 1
    code.restype = None
    if len(types["returns"]) == 1:
        code.restype = {"int": ctypes.c_int64, "float": ctypes.c_double}[types["returns"][0]]
    code.argtypes = [ctypes.c_char_p, ctypes.c_char_p]

    def call(*arguments: Any) -> Any:
        if len(arguments) != len(takers):
            raise OtherTypes
        packed: list[Any] = []
        for take, argument in zip(takers, arguments, strict=True):
            take(argument, packed)
        if not several:
            return code(pack(*packed), None)
        answer = ctypes.create_string_buffer(returned.size)
        code(pack(*packed), answer)
        return returned.unpack(answer.raw)

    return call


def _format(kind: Any) -> str:
    """Format of an argument as `struct` knows it: eight bytes for each number or address."""
    if isinstance(kind, str):
        return {"int": "q", "bool": "q", "float": "d"}[kind]
    if "tuple" in kind:
        return "".join(_format(each) for each in kind["tuple"])
    return "q" + "q" * int(kind.get("dimensions", 0))


def _taker(kind: Any) -> Callable[[Any, list[Any]], None]:
    """Return what appends an argument of a kind to a list, as it is packed, or raises `OtherTypes`."""
    if isinstance(kind, str):
        return {"int": _take_integer, "bool": _take_truth, "float": _take_number}[kind]
    if "tuple" in kind:
        return _tuple_taker([_taker(each) for each in kind["tuple"]])
    return _array_taker(kind) if "dimensions" in kind else _record_taker(kind)


def _take_integer(value: Any, packed: list[Any]) -> None:
    if not isinstance(value, (int, np.integer)):
        raise OtherTypes
    packed.append(value)


def _take_truth(value: Any, packed: list[Any]) -> None:
    if not isinstance(value, (bool, np.bool_)):
        raise OtherTypes
    packed.append(bool(value))


def _take_number(value: Any, packed: list[Any]) -> None:
    if not isinstance(value, float):
        raise OtherTypes
    packed.append(value)


def _tuple_taker(takers: Sequence[Callable[[Any, list[Any]], None]]) -> Callable[[Any, list[Any]], None]:
    def take(value: Any, packed: list[Any]) -> None:
        if not isinstance(value, tuple) or len(value) != len(takers):
            raise OtherTypes
        for taker, member in zip(takers, value, strict=True):
            taker(member, packed)

    return take


def _array_taker(kind: dict[str, Any]) -> Callable[[Any, list[Any]], None]:
    known: list[Any] = [None]
    expected, dimensions, written, aligned = kind["items"], kind["dimensions"], not kind["readonly"], kind["aligned"]

    def take(value: Any, packed: list[Any]) -> None:
        if type(value) is not np.ndarray or value.ndim != dimensions:
            raise OtherTypes
        flags = value.flags
        if not (flags.c_contiguous and (flags.aligned or not aligned) and (flags.writeable or not written)):
            raise OtherTypes
        if value.dtype is not known[0]:
            if layout(value.dtype) != expected:
                raise OtherTypes
            known[0] = value.dtype
        packed.append(value.ctypes.data)
        packed.extend(value.shape)

    return take


def _record_taker(kind: dict[str, Any]) -> Callable[[Any, list[Any]], None]:
    known: list[Any] = [None]
    expected = kind["record"]

    def take(value: Any, packed: list[Any]) -> None:
        if type(value) is not np.void:
            raise OtherTypes
        if value.dtype is not known[0]:
            if layout(value.dtype) != expected:
                raise OtherTypes
            known[0] = value.dtype
        packed.append(np.frombuffer(value, np.uint8).ctypes.data)

    return take


def layout(kind: np.dtype[Any]) -> Any:
    """Describe a type of array items or records for the manifest: names, places and types of all fields.

    Examples
    --------
    >>> layout(np.dtype([("u", "f8"), ("sides", "i8", (2,))]))
    {'size': 24, 'fields': [['u', 0, 'f8'], ['sides', 8, ['i8', 2]]]}
    """
    if kind.subdtype is not None:
        items, shape = kind.subdtype
        return [layout(items), *shape]
    if kind.fields is not None:
        fields = [[name, kind.fields[name][1], layout(kind.fields[name][0])] for name in kind.names or ()]
        return {"size": kind.itemsize, "fields": fields}
    return f"{kind.kind}{kind.itemsize}" if kind.isnative else kind.str
