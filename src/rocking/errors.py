"""Exceptions of the package: one base class, one subclass per kind of bad input.

Every message is one sentence that says what is wrong, where, and how to correct it. What it is about is also kept as
data, so that no code needs to read a sentence.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import pandas as pd

#: Where a name of an argument stands in a template; or "{}" itself, as `literal` writes it.
_PLACE: Final = re.compile(r"\{\{\}\}|\{\}")

#: What a command says that Ctrl-C has ended.
INTERRUPTED: Final = "rocking: this was interrupted; every file that it wrote is whole"

#: Longest path or word that a sentence shows whole, in characters.
_LONGEST_WORD: Final = 400

#: How a name of an argument is written: the command line writes its option, a page the label of its field.
Spelling = Callable[[str], str]


def as_argument(name: str) -> str:
    """Write the name of an argument as Python does."""
    return name


def _shortened(text: str) -> str:
    """Show both ends of a long word: nobody reads thousands of digits."""
    half = _LONGEST_WORD // 2
    return text if len(text) <= _LONGEST_WORD else f"{text[:half]}...{text[-half:]}"


def literal(text: str) -> str:
    """Write a text so that a template has it as it is: a "{}" in it is no place of a name."""
    return text.replace("{}", "{{}}")


def install(part: str) -> str:
    """Return the advice that installs the optional packages of a part."""
    return f"run pip install '.[{part}]' in the source folder of rocking"


@dataclass(frozen=True)
class Message:
    """A sentence that may name arguments.

    Attributes
    ----------
    template : str
        The sentence; each "{}" in it stands for a name of an argument, as long as there are names.
    arguments : tuple of str
        Those names, in their order.
    """

    template: str
    arguments: tuple[str, ...] = ()

    def text(self, spelling: Spelling = as_argument) -> str:
        """Return the sentence in one line, with names as ``spelling`` writes them."""
        names = map(spelling, self.arguments)
        sentence = _PLACE.sub(lambda place: "{}" if place[0] == "{{}}" else next(names, "{}"), self.template)
        return " ".join(map(_shortened, sentence.split()))

    def __str__(self) -> str:
        return self.text()


class RockingError(Exception):
    """Base of every error that the package raises on purpose.

    Parameters
    ----------
    message : str
        One sentence; each "{}" in it stands for one of `arguments`.
    *arguments : str
        Names of the arguments that the sentence names, the one that is wrong first.
    path, line : str, int, optional
        The file that is wrong, which the sentence itself does not name, and its line, from 1.
    value : object, optional
        What was given.

    Attributes
    ----------
    message : Message
        The sentence without the file's name.
    path, line, value
        As above.

    Examples
    --------
    >>> error = InvalidMotion("{} must be positive, in s, not -1", "dt", path="a.csv", line=3, value=-1)
    >>> print(error)
    a.csv, line 3: dt must be positive, in s, not -1
    """

    def __init__(
        self,
        message: str,
        *arguments: str,
        path: str | None = None,
        line: int | None = None,
        value: object = None,
    ) -> None:
        super().__init__(message, *arguments)
        self.message = Message(message, arguments)
        self.path, self.line, self.value = path, line, value

    @property
    def argument(self) -> str | None:
        """Name of the argument that is wrong, where the message names one."""
        return self.message.arguments[0] if self.message.arguments else None

    def text(self, spelling: Spelling = as_argument) -> str:
        """Return file, line and sentence in one line; `spelling` writes the names of arguments."""
        if self.path is None:
            return self.message.text(spelling)
        path = _shortened(self.path)
        where = path if self.line is None else f"{path}, line {self.line}"
        return f"{where}: {self.message.text(spelling)}"

    def __str__(self) -> str:
        return self.text()


class InvalidBlock(RockingError):
    """The block's sizes or parameters cannot describe a block that stands and rocks."""


class UnequalSides(InvalidBlock, AttributeError):
    """One value was asked of a block whose sides have two: `Block.sides` has them."""


class InvalidMotion(RockingError):
    """The ground motion's samples, step or parameters are not usable."""


class UnreadableRecord(RockingError):
    """A record file could not be read; the message names the file and, where there is one, the line."""


class InvalidOption(RockingError):
    """An argument of an analysis (model, chattering treatment, duration, ...) is not usable."""


class Unfitted(InvalidOption):
    """Outcomes determine no curve. What was simulated is kept.

    Attributes
    ----------
    outcomes : pandas.DataFrame or None
        Every simulation, as in `Fragility.outcomes`; None where nothing was simulated.
    """

    outcomes: pd.DataFrame | None = None


class Unfinished(RockingError):
    """A simulation was given up after too many steps, without which an analysis has no answer."""


class StudyError(RockingError):
    """A study is damaged, held by another process, or not the one that is meant."""


class DamagedStudy(StudyError):
    """A unit of a study is damaged, and can be computed again: the message says which, and what is wrong with it."""

    def __str__(self) -> str:
        return f"{self.text()}: the study's verify(repair=True) computes it again"


class KernelsError(RockingError):
    """The compiled kernels are missing or damaged, or were built from other sources."""


class OutsideFit(UserWarning):
    """A fitted formula was asked for values beyond those it was fitted to."""


class OutputError(RockingError):
    """Results could not be written where they were asked for."""
