"""Description of a motion: family, parameters of the formula, origin of a record."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Final

from rocking.core import checks
from rocking.errors import MotionError

_DOWNWARD_CHANNEL: Final = re.compile(r"\s*(?:down|dwn|dn)\b", re.IGNORECASE)
_VERTICAL_CHANNEL: Final = re.compile(r"-?(?:up|u|u-?d|v\d?|ver|vert\w*|z|down|dwn|dn|[a-z]{2}z)\b", re.IGNORECASE)
_SCALED_TO_LEVEL: Final = re.compile(r"(scaled by \S+) to .*")


@dataclass(frozen=True)
class Origin:
    """Facts about a motion from its record file or the catalogue, empty if not stated.

    Attributes
    ----------
    format, file : str
        Format and name of the file, without its folder.
    event, station : str
        Earthquake and place.
    channel, number : str, int or None
        Name of the component ("90 Deg", "Up", "HNE", ...) and its number in the file.
    azimuth : float or None
        Direction of positive acceleration, degrees clockwise from north, or None if vertical or unknown.
    units, heading_units : str
        Units of the numbers in the file, as spelled there, and units in the heading of a text table.
    start : float or None
        Instant of the first sample by the file's clock, s, or None if unknown, delayed or cut.
    is_reversed : bool
        Whether the motion (and `azimuth`) is opposite to `channel`.

    See Also
    --------
    rocking.motion.Description : Describe a motion.
    rocking.read : Read a motion from a record file.

    Examples
    --------
    >>> import rocking
    >>> origin = rocking.records.load("ridgecrest-clc-090").description.origin
    >>> origin.station, origin.azimuth, origin.units
    ('CI.CLC China Lake, G2 Tower Rd.', 90.0, 'g')
    """

    format: str = ""
    file: str = ""
    event: str = ""
    station: str = ""
    channel: str = ""
    number: int | None = None
    azimuth: float | None = None
    units: str = ""
    heading_units: str = ""
    start: float | None = None
    is_reversed: bool = False

    @property
    def is_downward(self) -> bool:
        """Whether the motion is positive downwards, by the name of its channel."""
        return _DOWNWARD_CHANNEL.match(self.channel) is not None and not self.is_reversed

    @property
    def is_vertical(self) -> bool:
        """Whether the component is vertical, by the name of its channel."""
        return _VERTICAL_CHANNEL.match(self.channel) is not None


@dataclass(frozen=True)
class Description:
    """Description of the origin of a motion.

    Attributes
    ----------
    family : str
        Kind of motion: "record", "samples", "sine", "symmetric Ricker", ... A delay or processing is included
        ("delayed sine", "processed record"), because the formula of `text` then no longer starts at time zero.
    parameters : mapping of str to float
        Parameters of the formula in SI units and radians, for example amplitude, frequency, phase and cycles of a sine.
        Scaling multiplies parameters with names that start with "amplitude" (possibly to negative values).
    text : str
        Formula, or source and terms of the record, in words.
    origin : Origin, optional
        Facts about a record, which `text` contains in words.

    Raises
    ------
    MotionError
        If `family` or `text` is not text, or a parameter is not a number.

    See Also
    --------
    rocking.Motion : ground motion.

    Examples
    --------
    >>> import rocking
    >>> rocking.pulses.sine(1.0 / 3.0, 2.0, cycles=5).description
    <Description: sine, amplitude 0.33333, frequency 2, cycles 5, phase 0>
    """

    family: str
    parameters: Mapping[str, float] = field(default_factory=dict)
    text: str = ""
    origin: Origin | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        checks.text(self.family, "family of a description", MotionError)
        checks.text(self.text, "text of a description", MotionError)
        parameters = self.parameters.items()
        numbers = {name: checks.real(value, f"{name} of a description", MotionError) for name, value in parameters}
        object.__setattr__(self, "parameters", MappingProxyType(numbers))

    def __reduce__(self) -> tuple[Any, ...]:
        return Description, (self.family, dict(self.parameters), self.text, self.origin)

    def __repr__(self) -> str:
        return f"<Description: {', '.join(part for part in (self.family, self.parameter_text) if part)}>"

    @property
    def parameter_text(self) -> str:
        """Parameters as readable text: "amplitude 3, frequency 2"."""
        return ", ".join(f"{name} {value:.5g}" for name, value in self.parameters.items())

    def scaled(self, factor: float) -> Description:
        """Return the description of the motion times a factor, which multiplies the amplitudes."""
        parameters = {k: v * factor if k.startswith("amplitude") else v for k, v in self.parameters.items()}
        origin = self.origin
        if origin is not None and factor < 0.0:
            azimuth = None if origin.azimuth is None else (origin.azimuth + 180.0) % 360.0
            origin = replace(origin, azimuth=azimuth, is_reversed=not origin.is_reversed)
        return replace(self, parameters=parameters, origin=origin)

    def changed(self, change: str) -> Description:
        """Return the description of a changed motion, with the change ("delayed", "processed") once in its family."""
        family = self.family if self.family.startswith(f"{change} ") else f"{change} {self.family}"
        origin = None if self.origin is None else replace(self.origin, start=None)
        return replace(self, family=family, origin=origin)


def compute_start_delay(first: Description, second: Description, step: float | None) -> float:
    """Return the delay of the second of two records, s, by the clock of their files."""
    first_origin, second_origin = (description.origin or Origin() for description in (first, second))
    if first_origin.start is None or second_origin.start is None or first_origin.format != second_origin.format:
        return 0.0
    delay = second_origin.start - first_origin.start
    return delay if abs(delay) > 0.5 * (step or 0.0) + 1e-6 else 0.0


def create_label(name: str, history: Sequence[str], vertical: str = "") -> str:
    """Return the name of a motion and its vertical component with processing but without scaling."""
    full_name = f"{name} with vertical {vertical}" if vertical else name
    return ", ".join((full_name, *(_SCALED_TO_LEVEL.sub(r"\1", entry) for entry in history)))
