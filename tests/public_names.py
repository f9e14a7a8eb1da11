"""The public names of the package, and what numpydoc finds missing in their docstrings.

    python tests/public_names.py

lists the faults, one a line, and exits with 1 where there are some.
"""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
import pydoc
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import rocking
from rocking.block.body import Bodies, Body

#: What describes the methods of these classes, which do not inherit from it.
PROTOCOLS: dict[Any, tuple[Any, ...]] = {
    rocking.Block: (Body,),
    rocking.Blocks: (Bodies,),
    rocking.RestrainedBlock: (Body,),
    rocking.dynamics.LinearBodies: (Bodies,),
}

#: Checks of numpydoc: form and order of sections; parameters, returns and yields without a name, a type or a word.
CHECKS = frozenset({"GL01", "GL03", "GL05", "GL06", "GL07", "GL08", "PR02", "PR03", "PR04", "PR07", "RT03"})

#: Those of functions and methods, which also need parameters and results, and functions an example. A method whose
#: docstring has no section of parameters points to another method, which has one.
CHECKS_OF_FUNCTIONS = CHECKS | {"PR01", "RT01", "YD01", "EX01"}


def public_modules() -> Iterator[Any]:
    """Modules that a user reaches by attributes: the package, and each module among the names of one."""
    waiting, seen = [rocking], set()
    while waiting:
        module = waiting.pop()
        seen.add(module.__name__)
        yield module
        members = [getattr(module, name) for name in names_of(module)]
        waiting += [each for each in members if inspect.ismodule(each) and each.__name__ not in seen]


def names_of(module: Any) -> list[str]:
    """Names that a module offers: those it lists, or the public ones that it defines."""
    listed = getattr(module, "__all__", None)
    own = (name for name, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__)
    return sorted(listed or (name for name in own if not name.startswith("_")))


@functools.cache
def public_names() -> dict[str, Any]:
    """Functions and classes by the name under which a user finds them."""
    found: dict[str, Any] = {}
    for module in public_modules():
        for name in names_of(module):
            value = getattr(module, name)
            if callable(value) and (value.__module__ or "").startswith("rocking"):
                found.setdefault(f"{module.__name__}.{name}", value)
    return found


def public_members() -> dict[str, Any]:
    """Functions, classes, and their own methods and properties, each by its name."""
    found: dict[str, Any] = {}
    for name, value in public_names().items():
        found[name] = value
        if inspect.isclass(value):
            # Parts of a class that have no public name, as those of Motion, belong to it.
            parts = [each for each in inspect.getmro(value) if each in (value, *rocking.Motion.__mro__[1:-1])]
            every = {key: member for each in reversed(parts) for key, member in vars(each).items()}
            own = {key: member for key, member in every.items() if not key.startswith("_")}
            found |= {f"{name}.{key}": _plain(member) for key, member in own.items() if _is_member(member)}
    return found


def callables() -> dict[str, Callable[..., Any]]:
    """Functions, methods, and classes whose constructor is part of the interface."""
    return {name: value for name, value in public_members().items() if callable(value)}


def faults() -> list[str]:
    """List what is missing in the docstrings, one fault a line."""
    from numpydoc.docscrape import get_doc_object
    from numpydoc.validate import validate

    found = []
    for name, own in public_members().items():
        member = _described(name, own)
        wanted = CHECKS_OF_FUNCTIONS if inspect.isfunction(member) else CHECKS
        if inspect.isclass(public_names().get(name.rpartition(".")[0])):
            points = "Parameters\n" not in (inspect.getdoc(member) or "")
            wanted = wanted - ({"PR01", "RT01", "EX01"} if points else {"EX01"})
        # What a property is, its one line says; and a class that only the package makes has attributes.
        if isinstance(member, property) or "Attributes\n" in (inspect.getdoc(member) or ""):
            wanted = wanted - {"PR02", "PR03"}
        errors = validate(get_doc_object(member))["errors"]
        found += [f"{name}: {code} {text}" for code, text in errors if code in wanted]
    return found


def unreachable() -> list[str]:
    """List classes, but for protocols, that public functions and attributes speak of, and that have no public name.

    Those that the reference lists by their module have one, too.
    """
    page = (Path(__file__).parent.parent / "docs" / "api" / "index.md").read_text("utf-8")
    listed = [pydoc.locate(f"rocking.{name}") for name in re.findall(r"^   ([\w.]+)$", page, re.MULTILINE)]
    classes = [value for value in [*public_names().values(), *listed] if inspect.isclass(value)]
    public = {base for each in classes for base in inspect.getmro(each)}
    found = set()
    for name, member in public_members().items():
        function = member.fget if isinstance(member, property) else member
        spoken = vars(function).get("__annotations__", {}) if inspect.isclass(function) else function.__annotations__
        names = imported(sys.modules[function.__module__])
        for about, annotation in spoken.items():
            words = () if about.startswith("_") else re.findall(r"[A-Za-z_]\w*", str(annotation))
            found |= {f"{name}: {word}" for word in words if word in names and names[word] not in public}
    return sorted(found)


@functools.cache
def imported(module: Any) -> dict[str, Any]:
    """Classes of the package by the names that a module gives them, also where it imports them for types alone."""
    found = {name: value for name, value in vars(module).items() if inspect.isclass(value)}
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("rocking"):
            there = importlib.import_module(node.module or "")
            found |= {each.asname or each.name: getattr(there, each.name, None) for each in node.names}
    return {name: value for name, value in found.items() if _is_own_class(value)}


def _described(name: str, member: Any) -> Any:
    """Return a member, or the one of a base class or a protocol that it implements: that one describes it."""
    owner = public_names().get(name.rpartition(".")[0])
    key = name.rpartition(".")[2]
    bases = [*inspect.getmro(owner)[1:], *PROTOCOLS.get(owner, ())] if inspect.isclass(owner) else []
    given = [_plain(vars(base)[key]) for base in bases if key in vars(base) and base.__module__.startswith("rocking")]
    return next((one for one in given if one.__doc__), member)


def _is_own_class(value: Any) -> bool:
    return inspect.isclass(value) and "rocking" in value.__module__ and not getattr(value, "_is_protocol", False)


def _is_member(member: Any) -> bool:
    return inspect.isfunction(member) or isinstance(member, (property, classmethod, staticmethod))


def _plain(member: Any) -> Any:
    return member.__func__ if isinstance(member, (classmethod, staticmethod)) else member


if __name__ == "__main__":
    lines = faults()
    print("\n".join(lines))
    sys.exit(bool(lines))
