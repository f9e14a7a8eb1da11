"""Texts of a case, and how values are written for Python and for a shell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from rocking.errors import InvalidOption
from rocking.explorer.parameters import DEFAULT, PARAMETERS, names_of

Texts = Mapping[str, str]

#: What reads a text of a case has: numbers in SI units, and texts.
Values = Mapping[str, Any]

#: Names of the texts of a case, and of those that describe its block.
NAMES: Final = tuple(PARAMETERS)
BLOCK_NAMES: Final = frozenset(names_of("block"))

_LONGEST_TEXT: Final = 300


def given_texts(texts: Texts) -> dict[str, str]:
    """Texts that are not empty, of names that a case has."""
    given = {name: value.strip() for name, value in texts.items() if value.strip()}
    for name, value in given.items():
        if name not in NAMES:
            raise InvalidOption(f"a case has no {name[:40]!r}; it has {', '.join(NAMES)}")
        if len(value) > _LONGEST_TEXT:
            raise InvalidOption(f"{{}} is {len(value)} letters long; at most {_LONGEST_TEXT} are read", name)
    return {"motion": DEFAULT["motion"], **given} if given else dict(DEFAULT)


def written_arguments(arguments: Mapping[str, Any]) -> str:
    """Arguments of a call, as Python writes them."""
    return ", ".join(f"{name}={value!r}" for name, value in arguments.items())


def as_path(name: str) -> str:
    """Write the name of a file as an argument that no program takes for an option, or for standard input."""
    return f"./{name}" if name.startswith("-") else name


def as_option(name: str, value: str) -> tuple[str, ...]:
    """Write an option and its value, in one word where the value alone would be taken for another option.

    Examples
    --------
    >>> as_option("channel", "HNE"), as_option("channel", "--out")
    (('--channel', 'HNE'), ('--channel=--out',))
    """
    written = f"--{name.replace('_', '-')}"
    return (f"{written}={value}",) if value.startswith("-") else (written, value)
