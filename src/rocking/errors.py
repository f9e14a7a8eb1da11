"""Exceptions of the package: a base class, and a subclass for each kind of invalid input.

Every message is one sentence that names the fault, its location, and the remedy. The same information is available as
attributes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "BlockError",
    "DamagedStudyError",
    "FitError",
    "KernelsError",
    "MotionError",
    "OptionError",
    "OutputError",
    "OutsideFitWarning",
    "RecordError",
    "RockingError",
    "StudyError",
    "UnequalSidesError",
    "UnfinishedError",
]

#: Placeholder of an argument's name in a template, or an escaped "{}" from `literal`.
_PLACEHOLDER: Final = re.compile(r"\{\{\}\}|\{\}")

#: Message of a command after Ctrl-C.
INTERRUPT_MESSAGE: Final = "rocking: Interrupted. All files written are complete."

#: Longest path or word that a message shows completely, in characters.
_LONGEST_WORD: Final = 400

#: Spelling of an argument's name, for example as a command-line option or the label of a field.
Spelling = Callable[[str], str]


def _shorten(text: str) -> str:
    """Shorten a long word to its ends."""
    half = _LONGEST_WORD // 2
    return text if len(text) <= _LONGEST_WORD else f"{text[:half]}...{text[-half:]}"


def escape_braces(text: str) -> str:
    """Escape each "{}" in a text for use in a template."""
    return text.replace("{}", "{{}}")


def join_placeholders(names: Collection[str]) -> str:
    """Return placeholders for all names in a template."""
    return " and ".join(["{}"] * len(names))


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

    def text(self, spelling: Spelling = str) -> str:
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

    See Also
    --------
    rocking.errors.OptionError : Report an invalid argument of an analysis.
    rocking.errors.BlockError : Report an invalid block.

    Examples
    --------
    >>> error = MotionError("{} must be positive, in s, not -1", "dt", path="a.csv", line=3, value=-1)
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

    def text(self, spelling: Spelling = str) -> str:
        """Return file, line and sentence in one line, with names as written by ``spelling``."""
        if self.path is None:
            return self.message.text(spelling)
        path = _shorten(self.path)
        location = path if self.line is None else f"{path}, line {self.line}"
        return f"{location}: {self.message.text(spelling)}"

    def __str__(self) -> str:
        return self.text()


class BlockError(RockingError):
    """Sizes or parameters do not describe a block that stands and rocks.

    See Also
    --------
    rocking.Block : Create a block.
    rocking.RockingError : Catch all errors of the package.

    Examples
    --------
    >>> import rocking
    >>> rocking.Block(width=-0.4, height=2.0)
    Traceback (most recent call last):
        ...
    rocking.errors.BlockError: width must be a positive number, in m, not -0.4
    """


class UnequalSidesError(BlockError, AttributeError):
    """A property of one value was requested for a block with unequal sides (see `Block.sides`).

    It is also an AttributeError, so that tools that inspect all attributes of an object skip the property.

    See Also
    --------
    rocking.block.Side : Describe one side of a block.
    rocking.errors.BlockError : Report an invalid block.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.4, height=2.0, offset=0.05)
    >>> block.alpha
    Traceback (most recent call last):
        ...
    rocking.errors.UnequalSidesError: alpha is 0.14889 on side + and 0.244979 on side - of this block: ...
    >>> f"{block.sides[0].alpha:.4f}"
    '0.1489'
    """


class MotionError(RockingError):
    """Samples, step or parameters of a ground motion are invalid.

    See Also
    --------
    rocking.Motion : Create a ground motion.
    rocking.errors.RecordError : Report an unreadable record file.

    Examples
    --------
    >>> import rocking
    >>> rocking.Motion.from_samples([0.0, 1.0, 0.0], dt=-0.01)
    Traceback (most recent call last):
        ...
    rocking.errors.MotionError: dt must be a positive number, in s, not -0.01
    """


class RecordError(RockingError):
    """A record file could not be read. The message names the file and, if known, the line.

    See Also
    --------
    rocking.read : Read a motion from a record file.
    rocking.errors.MotionError : Report invalid samples.

    Examples
    --------
    >>> import rocking
    >>> rocking.read("missing.at2")
    Traceback (most recent call last):
        ...
    rocking.errors.RecordError: missing.at2: there is no such file; check the name and the folder
    """


class OptionError(RockingError):
    """An argument of an analysis (model, chattering scheme, duration, ...) is invalid.

    See Also
    --------
    rocking.RockingError : Catch all errors of the package.
    rocking.errors.FitError : Report outcomes that determine no curve.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.4, height=2.0)
    >>> rocking.simulate(block, None, model="exact")
    Traceback (most recent call last):
        ...
    rocking.errors.OptionError: model must be one of nonlinear, linear, not 'exact'
    """


class FitError(OptionError):
    """Outcomes do not determine a curve. The simulations are retained.

    Attributes
    ----------
    outcomes : pandas.DataFrame or None
        All simulations, as in `Fragility.outcomes`, or None.

    See Also
    --------
    rocking.fragility : Simulate the outcomes and fit the curves.
    rocking.fit_fragility : Fit curves to given outcomes.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.4, height=2.0)
    >>> try:
    ...     rocking.fragility(block, [rocking.pulses.one_sine(4.0, 1.0)], levels=[0.1, 5.0])
    ... except rocking.errors.FitError as error:
    ...     print(error.outcomes["overturned"].tolist())
    [False, True]
    """

    outcomes: pd.DataFrame | None = None


class UnfinishedError(RockingError):
    """An analysis has no result because a simulation was abandoned after too many steps.

    See Also
    --------
    rocking.critical_scale : Find one critical scale with its derivatives.
    rocking.simulate : Simulate one block and keep a partial response.

    Examples
    --------
    >>> import rocking
    >>> block, pulse = rocking.Block(width=0.4, height=2.0), rocking.pulses.one_sine(4.0, 1.0)
    >>> try:
    ...     print(f"{rocking.critical_scale(block, pulse, (0.1, 2.0)).scale:.4f}")
    ... except rocking.errors.UnfinishedError as error:
    ...     print(error)
    0.6203
    """


class StudyError(RockingError):
    """A study is damaged, locked by another process, or not the intended one.

    See Also
    --------
    rocking.create_study : Create a study in a folder.
    rocking.errors.DamagedStudyError : Report a damaged batch of a study.

    Examples
    --------
    >>> import rocking, tempfile
    >>> rocking.Study(tempfile.mkdtemp())
    Traceback (most recent call last):
        ...
    rocking.errors.StudyError: ...: the folder contains no study: create it first
    """


class DamagedStudyError(StudyError):
    """A batch of a study is damaged and can be recomputed. The message names the batch and the fault.

    See Also
    --------
    rocking.Study.verify : Check and repair a study.
    rocking.errors.StudyError : Report any other fault of a study.

    Examples
    --------
    >>> import pathlib, rocking, tempfile
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> block, pulse = rocking.Block(width=0.4, height=2.0), rocking.pulses.one_sine(4.0, 1.0)
    >>> _ = rocking.create_study(folder, block, pulse).run()
    >>> _ = (folder / "batches" / "batch.0.0.0.0").write_bytes(b"damaged")
    >>> rocking.Study(folder).results().load()
    Traceback (most recent call last):
        ...
    rocking.errors.DamagedStudyError: batch batch.0.0.0.0 is damaged: the study's verify(repair=True) computes it again
    """

    def __str__(self) -> str:
        return f"{self.text()}: the study's verify(repair=True) computes it again"


class KernelsError(RockingError):
    """The compiled kernels are missing, damaged, or built from other sources.

    See Also
    --------
    rocking.RockingError : Catch every error of the package.

    Examples
    --------
    >>> import rocking
    >>> issubclass(rocking.errors.KernelsError, rocking.RockingError)
    True
    """


class OutsideFitWarning(UserWarning):
    """A fitted formula was evaluated beyond the range of its data.

    See Also
    --------
    rocking.chattering.critical_amplitude : Compute the critical amplitude.
    rocking.AsymptoticTime : Let the block rest after the asymptotic chattering time.

    Examples
    --------
    >>> import rocking, warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", rocking.errors.OutsideFitWarning)
    ...     rocking.chattering.critical_amplitude(10.0, 0.9, method="eq76")
    Traceback (most recent call last):
        ...
    rocking.errors.OutsideFitWarning: Eq. 76 was fitted for omega from 0.5 to 8 and eta from 0.5 to 0.97, ...
    """


class OutputError(RockingError):
    """Results could not be written to the requested location.

    See Also
    --------
    rocking.Result.to_json : Write a result to a JSON file.
    rocking.RockingError : Catch all errors of the package.

    Examples
    --------
    >>> import rocking
    >>> response = rocking.simulate(rocking.Block(width=0.4, height=2.0), None, initial_rotation=0.1)
    >>> response.to_json("missing/response.json")
    Traceback (most recent call last):
        ...
    rocking.errors.OutputError: missing/response.json: cannot be written: there is no folder ...
    """
