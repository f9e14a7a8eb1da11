"""What a treatment of chattering is, and how one is found by its name."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import ClassVar, Literal

from rocking.arrays import Floats
from rocking.block import Blocks
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion

Model = Literal["nonlinear", "linear"]

_BY_NAME: dict[str, type[Treatment]] = {}


@dataclass(frozen=True)
class Treatment(ABC):
    """How a sequence of impacts ends. A class of its own is found by its `name` as soon as it is imported.

    What is compared with its limits at an impact is one of the measures that kernels know (`rocking.kernels.state`).
    """

    #: Name in ``chattering=`` and on the command line.
    name: ClassVar[str]
    #: What the kernels compare with the limits, a code of `rocking.kernels.state`.
    code: ClassVar[int]

    def __init_subclass__(cls) -> None:
        _BY_NAME[cls.name] = cls

    @property
    @abstractmethod
    def label(self) -> str:
        """Short name with the parameter and its unit, for tables and figures."""

    @property
    def bracket(self) -> float:
        """Width, s, of the bracket on the time of rest that is asked for; 0 where nothing is proven."""
        return 0.0

    @abstractmethod
    def limits(self, blocks: Blocks, motion: Motion | None, model: Model, factor: float = 1.0) -> Floats:
        """Limits of both sides of every block under a motion times a factor, shape (n, 2)."""

    def __str__(self) -> str:
        """Write the treatment so that `treatment` reads it back."""
        values = [str(getattr(self, parameter.name)) for parameter in fields(self)]
        return "=".join([self.name, *values])

    @classmethod
    def from_text(cls, value: str) -> Treatment:
        """Make the treatment of its one parameter as it is written after "NAME=".

        Raises
        ------
        InvalidOption
            If it takes no parameter, or the text is not one.
        """
        parameters = fields(cls)
        if not parameters:
            raise InvalidOption(f"the chattering treatment {cls.name} takes no parameter, not {value!r}")
        try:
            return cls(float(value))  # type: ignore[call-arg]
        except ValueError:
            raise InvalidOption(f"the chattering treatment {cls.name} takes one number, not {value!r}") from None


def treatment(chattering: str | Treatment) -> Treatment:
    """Treatment of a name, or of a name and its parameter, or the treatment itself.

    Raises
    ------
    InvalidOption
        If there is none of that name, or its parameter is out of its range.

    Examples
    --------
    >>> treatment("certified")
    Certified(tolerance=1e-12)
    >>> treatment("velocity=1e-6")
    VelocityThreshold(threshold=1e-06)
    >>> str(treatment("interval"))
    'interval=1e-09'
    """
    if isinstance(chattering, Treatment):
        return chattering
    name, given, value = chattering.partition("=") if isinstance(chattering, str) else ("", "", "")
    if name not in _BY_NAME:
        kinds = "" if isinstance(chattering, str) else " or a treatment"
        sentence = f"{{}} must be one of {', '.join(_BY_NAME)}{kinds}, not {chattering!r}"
        raise InvalidOption(sentence, "chattering", value=chattering)
    if not given:
        return _BY_NAME[name]()
    try:
        return _BY_NAME[name].from_text(value)
    except InvalidOption as error:
        sentence = f'{{}} "{chattering}": {error.message.template}'
        raise InvalidOption(sentence, "chattering", *error.message.arguments) from None
