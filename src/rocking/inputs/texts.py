"""Inputs as Python and shell text."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from typing import Any


def format_arguments(values: Mapping[str, Any]) -> str:
    """Format the arguments of a Python call."""
    return ", ".join(f"{name}={value!r}" for name, value in values.items())


def format_option_name(name: str) -> str:
    """Return the option of an argument: --half-width of half_width."""
    return f"--{name.replace('_', '-')}"


def format_option(name: str, value: str) -> tuple[str, ...]:
    """Return an option and its value, as one word if the value alone would be read as another option.

    Examples
    --------
    >>> format_option("channel", "HNE"), format_option("channel", "--out")
    (('--channel', 'HNE'), ('--channel=--out',))
    """
    option = format_option_name(name)
    return (f"{option}={value}",) if value.startswith("-") else (option, value)


def format_path(name: str) -> str:
    """Return a file name as an argument that no program reads as an option or as standard input."""
    return f"./{name}" if name.startswith("-") else name


def format_command(words: Iterable[str], options: Mapping[str, str]) -> str:
    """Format a shell command with its options."""
    return shlex.join([*words, *(word for name, value in options.items() for word in format_option(name, value))])
