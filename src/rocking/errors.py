"""Exceptions of the package: a base class, and a subclass for each kind of invalid input.

Every message is one sentence that names the fault, its location, and the remedy. The same information is available as
attributes.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import pandas as pd

#: Placeholder of an argument's name in a template, or an escaped "{}" from `literal`.
_PLACEHOLDER: Final = re.compile(r"\{\{\}\}|\{\}")

#: Message of a command after Ctrl-C.
INTERRUPTED: Final = "rocking: Interrupted. All files written are complete."

#: Longest path or word that a message shows completely, in characters.
_LONGEST_WORD: Final = 400

#: Spelling of an argument's name, for example as a command-line option or the label of a field.
Spelling = Callable[[str], str]


def spell_argument(name: str) -> str:
    """Return the name of an argument as in Python."""
    return name


def _shorten(text: str) -> str:
    """Shorten a long word to its ends."""
    half = _LONGEST_WORD // 2
    return text if len(text) <= _LONGEST_WORD else f"{text[:half]}...{text[-half:]}"


def escape_braces(text: str) -> str:
    """Escape each "{}" in a text for use in a template."""
    return text.replace("{}", "{{}}")


def describe_install(part: str) -> str:
    """Return instructions to install the optional packages of a part."""
    return f"run pip install '.[{part}]' in the source folder of rocking"


@dataclass(frozen=True)
class Message:
    """Sentence that may name arguments.

    Attributes
    ----------
    template : str
        Sentence with a "{}" for each argument. Surplus ones remain.
    arguments : tuple of str
        Names in their order.
    """

    template: str
    arguments: tuple[str, ...] = ()

    def text(self, spelling: Spelling = spell_argument) -> str:
        """Return the sentence in one line, with names as written by ``spelling``."""
        names = map(spelling, self.arguments)
        sentence = _PLACEHOLDER.sub(lambda match: "{}" if match[0] == "{{}}" else next(names, "{}"), self.template)
        return " ".join(map(_shorten, sentence.split()))

    def __str__(self) -> str:
        return self.text()


class RockingError(Exception):
    """Base class of all errors that the package raises on purpose.

    Parameters
    ----------
    message : str
        Sentence with a "{}" for each of `arguments`.
    *arguments : str
        Names of the arguments in the sentence, the invalid one first.
    path, line : str, int, optional
        Invalid file, which the sentence does not name, and its line, from 1.
    value : object, optional
        Invalid value.

    Attributes
    ----------
    message : Message
        Sentence without the file's name.
    path, line, value
        As above.

    Examples
    --------
    >>> error = InvalidMotion("{} must be positive, in s, not -1", "dt", path="a.csv", line=3, value=-1)
    >>> print(error)
    a.csv, line 3: dt must be positive, in s, not -1
    """

    def __init__(
        self, message: str, *arguments: str, path: str | None = None, line: int | None = None, value: object = None
    ) -> None:
        super().__init__(message, *arguments)
        self.message = Message(message, arguments)
        self.path, self.line, self.value = path, line, value

    @property
    def argument(self) -> str | None:
        """Name of the invalid argument, if the message contains one."""
        return self.message.arguments[0] if self.message.arguments else None

    def text(self, spelling: Spelling = spell_argument) -> str:
        """Return file, line and sentence in one line, with names as written by ``spelling``."""
        if self.path is None:
            return self.message.text(spelling)
        path = _shorten(self.path)
        location = path if self.line is None else f"{path}, line {self.line}"
        return f"{location}: {self.message.text(spelling)}"

    def __str__(self) -> str:
        return self.text()


class InvalidBlock(RockingError):
    """Sizes or parameters do not describe a block that stands and rocks."""


class UnequalSides(InvalidBlock, AttributeError):
    """A property of one value was requested for a block with unequal sides (see `Block.sides`).

    It is also an AttributeError, so that tools that inspect all attributes of an object skip the property.
    """


class InvalidMotion(RockingError):
    """Samples, step or parameters of a ground motion are invalid."""


class UnreadableRecord(RockingError):
    """A record file could not be read. The message names the file and, if known, the line."""


class InvalidOption(RockingError):
    """An argument of an analysis (model, chattering scheme, duration, ...) is invalid."""


class Unfitted(InvalidOption):
    """Outcomes do not determine a curve. The simulations are retained.

    Attributes
    ----------
    outcomes : pandas.DataFrame or None
        All simulations, as in `Fragility.outcomes`, or None.
    """

    outcomes: pd.DataFrame | None = None


class Unfinished(RockingError):
    """An analysis has no result because a simulation was abandoned after too many steps."""


class StudyError(RockingError):
    """A study is damaged, locked by another process, or not the intended one."""


class DamagedStudy(StudyError):
    """A unit of a study is damaged and can be recomputed. The message names the unit and the fault."""

    def __str__(self) -> str:
        return f"{self.text()}: the study's verify(repair=True) computes it again"


class KernelsError(RockingError):
    """The compiled kernels are missing, damaged, or built from other sources."""


class OutsideFit(UserWarning):
    """A fitted formula was evaluated beyond the range of its data."""


class OutputError(RockingError):
    """Results could not be written to the requested location."""
