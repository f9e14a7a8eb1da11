"""Inputs written for Python and for a shell."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from typing import Any


def arguments(values: Mapping[str, Any]) -> str:
    """Write arguments of a call, as Python has them."""
    return ", ".join(f"{name}={value!r}" for name, value in values.items())


def option_of(name: str) -> str:
    """Return the option of an argument: --half-width of half_width."""
    return f"--{name.replace('_', '-')}"


def as_option(name: str, value: str) -> tuple[str, ...]:
    """Write an option and its value, in one word where the value alone would be taken for another option.

    Examples
    --------
    >>> as_option("channel", "HNE"), as_option("channel", "--out")
    (('--channel', 'HNE'), ('--channel=--out',))
    """
    option = option_of(name)
    return (f"{option}={value}",) if value.startswith("-") else (option, value)


def as_path(name: str) -> str:
    """Write the name of a file as an argument that no program takes for an option, or for standard input."""
    return f"./{name}" if name.startswith("-") else name


def command_line(words: Iterable[str], options: Mapping[str, str]) -> str:
    """Write a command with its options, as a shell takes it."""
    return shlex.join([*words, *(word for name, value in options.items() for word in as_option(name, value))])
