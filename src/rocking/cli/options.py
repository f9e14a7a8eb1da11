"""Options that several commands share, in groups: the intensity, the equation of motion, how chattering ends."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final

from cyclopts import Group, Parameter, Token

from rocking.analysis.levels import BY_STATION
from rocking.constants import Model
from rocking.errors import InvalidOption
from rocking.motion.scaling import IntensityName, Measure
from rocking.plausibility import level_notes
from rocking.progress import note
from rocking.quantities import Quantity, acceleration, number, values, velocity

_DIGITS: Final = re.compile(r"[+-]?\d+")

#: Spread over the command's own options, each group under its own heading in the help.
BLOCK: Final = Parameter(name="*", group=Group("Block", sort_key=1))
MEASURE: Final = Parameter(name="*", group=Group("Intensity", sort_key=0))
MODEL: Final = Parameter(name="*", group=Group("Model", sort_key=3))


def hint(text: str) -> Parameter:
    """Return the help of an option."""
    return Parameter(help=text)


def written(text: str) -> Parameter:
    """Return the help of an option whose value is a number as people write it, which may begin with a minus sign."""
    return Parameter(help=text, allow_leading_hyphen=True)


def measured(text: str, quantity: Quantity) -> Parameter:
    """Return the help of an option whose value is a number with or without a unit, which `quantity` reads."""

    def read(_: Any, tokens: Sequence[Token]) -> float:
        return quantity(tokens[0].value, (tokens[0].keyword or "").lstrip("-").replace("-", "_"))

    return Parameter(help=text, converter=read, allow_leading_hyphen=True)


def _whole(_: Any, tokens: Sequence[Token]) -> int:
    if not _DIGITS.fullmatch(tokens[0].value):
        raise ValueError(tokens[0].value)
    return int(tokens[0].value)


#: How a whole number is read: the parser itself would round 1.5 to one.
WHOLE: Final = Parameter(converter=_whole)


@dataclass(frozen=True)
class MeasureOptions:
    """How the intensity of motions is measured, and its levels."""

    measure: Annotated[
        IntensityName,
        hint(
            "Intensity: PGA, PGV, spectral acceleration, or in the block's own units PGA and p PGV "
            "over the acceleration that lifts it."
        ),
    ] = "pga"
    period: Annotated[float | None, hint("Period of the spectral acceleration, s.")] = None
    damping: Annotated[float, hint("Its fraction of critical damping.")] = 0.05
    levels: Annotated[
        str | None,
        written(
            "Levels to scale every motion to, as 0.1g,0.2g or 0.1g:1g:10 (velocities as 0.4 (m/s) or 40cm/s, ratios as "
            "plain numbers); START:STOP:COUNT:log for equal ratios."
        ),
    ] = None

    def chosen(self) -> dict[str, Any]:
        """Return measure and levels as arguments."""
        levels = None if self.levels is None else values(self.levels, "levels", self._quantity())
        return {"measure": self.wanted, "levels": levels}

    @property
    def wanted(self) -> Measure:
        """Measure of intensity."""
        return Measure(self.measure, self.period, self.damping)

    def _quantity(self) -> Quantity:
        """Return what reads a level of the measure."""
        return {"pga": noted_acceleration, "sa": noted_acceleration, "pgv": velocity}.get(self.measure, _ratio)


@dataclass(frozen=True)
class ModelOptions:
    """The equation of motion."""

    equation: Annotated[
        Model | None,
        Parameter(
            name="--model",
            help="Equation of motion: of finite rotations (nonlinear, the default), or linearised for slender blocks.",
        ),
    ] = None

    @property
    def model(self) -> Model:
        """Equation of motion, nonlinear unless it is said."""
        return self.equation or "nonlinear"


@dataclass(frozen=True)
class TreatmentOptions(ModelOptions):
    """The equation of motion, and how chattering ends."""

    chattering: Annotated[
        str,
        hint(
            "How chattering ends: certified, velocity, bypass, interval, or (under a sine) time; with a limit, as "
            "certified=1e-9 (s), velocity=5e-10 or bypass=1e-3 (over p alpha), interval=1e-9 (s)."
        ),
    ] = "certified"

    def chosen(self) -> dict[str, Any]:
        """Return model and treatment as arguments."""
        from rocking.treatment import treatment

        return {"model": self.equation or "nonlinear", "chattering": treatment(self.chattering)}


def labels_of(clusters: str | None) -> str | list[str] | None:
    """Return what an option says of motions that belong together."""
    return clusters if clusters in (None, BY_STATION) else [label.strip() for label in clusters.split(",")]


def noted_acceleration(text: str, name: str) -> float:
    """Return an acceleration, m/s^2, with a note where a number without a unit looks like one in g."""
    value = acceleration(text, name)
    if not value > 0.0:
        raise InvalidOption(
            f"{{}} must be above 0, not {text.strip()}; {{}} -1 reverses a motion", name, "scale", value=text
        )
    for sentence in level_notes(text, value, name):
        note(sentence)
    return value


def _ratio(text: str, name: str) -> float:
    """Return a level of a measure in the block's own units."""
    try:
        return number(text, name)
    except InvalidOption:
        sentence = "{} takes plain numbers with this {}, which counts in the block's own units, not "
        raise InvalidOption(sentence + repr(text.strip()), name, "measure") from None
