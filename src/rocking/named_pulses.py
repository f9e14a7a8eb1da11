"""Pulses by name: a function of `rocking.pulses`, with its parameters as people write them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from rocking import checks, pulses, quantities
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion


class _Kind(NamedTuple):
    """What a parameter is: how its text is read (None: it is a word), and its unit."""

    read: quantities.Quantity | None
    unit: str


_KINDS: Final = {
    "amplitude": _Kind(quantities.acceleration, "m/s^2"),
    "frequency": _Kind(quantities.frequency, "Hz"),
    "phase": _Kind(quantities.angle, "rad"),
    "duration": _Kind(quantities.duration, "s"),
    "cycles": _Kind(quantities.number, ""),
    "gamma": _Kind(quantities.number, ""),
    "lobes": _Kind(quantities.number, ""),
    "kind": _Kind(None, ""),
}

#: The amplitude of this pulse is that of its velocity.
_OF_VELOCITY: Final = pulses.mavroeidis_papageorgiou
_VELOCITY: Final = _Kind(quantities.velocity, "m/s")


@dataclass(frozen=True)
class PulseFamily:
    """A family of pulses, and the function of `rocking.pulses` that makes one."""

    make: Callable[..., Motion]

    @property
    def name(self) -> str:
        """Its name as it is written: "half-sine"."""
        return self.make.__name__.replace("_", "-")

    @property
    def needed(self) -> tuple[str, ...]:
        """Names of the parameters without a default."""
        return tuple(name for name, each in self._parameters.items() if each.default is inspect.Parameter.empty)

    @property
    def optional(self) -> Mapping[str, Any]:
        """Defaults of the other parameters, by name."""
        return {name: each.default for name, each in self._parameters.items() if name not in self.needed}

    @property
    def is_of_velocity(self) -> bool:
        """Whether its amplitude is that of its velocity."""
        return self.make is _OF_VELOCITY

    def unit(self, parameter: str) -> str:
        """Return the unit of a parameter; empty where it has none."""
        return self._kind(parameter).unit

    def quantity(self, parameter: str) -> quantities.Quantity | None:
        """Return what reads a parameter from its text; None where it is a word."""
        if parameter not in self._parameters:
            hint = checks.meant(parameter, [*self._parameters], f"it takes {_listed(self._parameters)}")
            raise InvalidOption(f"the pulse {self.name} has no {parameter}; {hint}")
        return self._kind(parameter).read

    def motion(self, values: Mapping[str, Any]) -> Motion:
        """Make a pulse of the values of its parameters."""
        for name in values:
            self.quantity(name)
        missing = [name for name in self.needed if name not in values]
        if missing:
            raise InvalidOption(f"the pulse {self.name} needs {_listed(missing)} as well")
        return self.make(**{name: _whole(value) if name == "lobes" else value for name, value in values.items()})

    @property
    def _parameters(self) -> Mapping[str, inspect.Parameter]:
        return inspect.signature(self.make).parameters

    def _kind(self, parameter: str) -> _Kind:
        return _VELOCITY if parameter == "amplitude" and self.is_of_velocity else _KINDS[parameter]


#: All families, by name.
FAMILIES: Final = {family.name: family for family in (PulseFamily(getattr(pulses, name)) for name in pulses.__all__)}


def pulse_family(name: str) -> PulseFamily:
    """Family of pulses of a name; blanks, hyphens and underscores are the same.

    Examples
    --------
    >>> pulse_family("one_sine").needed
    ('amplitude', 'frequency')
    """
    plain = checks.text(name, "pulse", InvalidOption).strip().lower().replace("_", "-").replace(" ", "-")
    if plain not in FAMILIES:
        hint = checks.meant(plain, [*FAMILIES], f"there are {_listed(FAMILIES)}")
        raise InvalidOption(f"there is no pulse {name!r}; {hint}")
    return FAMILIES[plain]


def named_pulse(text: str) -> Motion:
    """Pulse of a text: its family, a colon, and its parameters with commas between.

    A parameter without a unit is in m/s^2, Hz, rad, s, and m/s where the amplitude is that of a velocity. Where lobes
    have an amplitude each, they are written one after the other, with commas between.

    Parameters
    ----------
    text : str
        For instance "sine:amplitude=0.2g,frequency=2Hz,cycles=5" or "n-lobe:amplitude=1,2,1,frequency=0.5".

    Returns
    -------
    Motion

    Raises
    ------
    InvalidOption
        If there is no such family or parameter, one is missing or given twice, or a value cannot be read.
    InvalidMotion
        If a value is out of its range.

    Examples
    --------
    >>> named_pulse("sine:amplitude=0.2g,frequency=2Hz,cycles=5").description
    <Description: sine, amplitude 1.9613, frequency 2, cycles 5, phase 0>
    >>> named_pulse("sine:amplitude=0.2g,frequency=2Hz")
    Traceback (most recent call last):
        ...
    rocking.errors.InvalidOption: the pulse sine needs cycles as well
    """
    family, values = pulse_values(text)
    return family.motion(values)


def pulse_values(text: str) -> tuple[PulseFamily, dict[str, Any]]:
    """Family and values (SI units) of the parameters that a text of `named_pulse` gives."""
    family, written = pulse_texts(text)
    return family, {parameter: _value(family, parameter, texts) for parameter, texts in written.items()}


def pulse_texts(text: str) -> tuple[PulseFamily, dict[str, list[str]]]:
    """Family and parameters of a text of `named_pulse` as they are written: of most one value, without blanks."""
    name, _, rest = checks.text(text, "pulse", InvalidOption).partition(":")
    return pulse_family(name), _parts(rest)


def _parts(text: str) -> dict[str, list[str]]:
    """Texts of each parameter; one without a name goes with the parameter before."""
    found: dict[str, list[str]] = {}
    for part in filter(None, text.split(",")):
        name, given, value = (each.strip() for each in part.partition("="))
        if given and name not in found:
            found[name] = [value]
        elif given:
            raise InvalidOption(f"{name} is given twice in {text!r}")
        elif found:
            [*found.values()][-1].append(name)
        else:
            raise InvalidOption(f"a pulse is written NAME:PARAMETER=VALUE,PARAMETER=VALUE, but {part!r} has no name")
    return found


def _value(family: PulseFamily, parameter: str, texts: list[str]) -> Any:
    quantity = family.quantity(parameter)
    shown = f"the {parameter} of a {family.name} pulse"
    if len(texts) > 1 and not (family.make is pulses.n_lobe and parameter == "amplitude"):
        raise InvalidOption(f"{shown} is one value, not {', '.join(texts)}")
    if quantity is None:
        return texts[0]
    values = [quantity(text, shown) for text in texts]
    return values if len(values) > 1 else values[0]


def _whole(value: Any) -> Any:
    """Return a count as an int; what is none is left to the pulse to refuse."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _listed(names: Iterable[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last
