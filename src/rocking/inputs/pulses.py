"""Pulses by name: functions of `rocking.pulses` with parameters as text."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from rocking import pulses
from rocking.core import checks
from rocking.errors import OptionError
from rocking.inputs import quantities
from rocking.inputs.declared import READERS, Input, index_by_name
from rocking.motion.motion import Motion


def _declare(name: str, kind: str, unit: str, default: str, low: float, high: float, text: str = "") -> Input:
    """Declare a parameter of pulses, with a logarithmic slider if possible."""
    is_logarithmic = low > 0.0 and name not in ("cycles", "gamma")
    return Input(name, "pulse", kind, "", unit, default, low, high, is_logarithmic, text=text or f"pulse_{name}")


#: Parameters of pulses, each declared once for all pulses.
PARAMETERS: Final = index_by_name(
    _declare("amplitude", "acceleration", "g", "0.3g", 0.02, 2.0),
    _declare("frequency", "frequency", "Hz", "1", 0.1, 10.0),
    _declare("duration", "duration", "s", "0.5", 0.05, 5.0),
    _declare("cycles", "number", "", "2.5", 0.5, 20.0),
    _declare("phase", "angle", "°", "0deg", 0.0, 360.0),
    _declare("gamma", "number", "cycles", "2", 1.0, 6.0),
    Input("lobes", "pulse"),
    Input("kind", "pulse", "text"),
)
#: Amplitude of a pulse that is specified by its velocity.
_VELOCITY_AMPLITUDE: Final = _declare("amplitude", "velocity", "m/s", "0.6", 0.05, 3.0, "pulse_velocity")


@dataclass(frozen=True)
class PulseFamily:
    """Family of pulses, with the function of `rocking.pulses` that creates them."""

    make: Callable[..., Motion]

    @property
    def name(self) -> str:
        """Name in text: "half-sine"."""
        return self.make.__name__.replace("_", "-")

    @property
    def needed(self) -> tuple[str, ...]:
        """Names of the parameters without a default."""
        return tuple(name for name in self._defaults if name not in self.optional)

    @property
    def optional(self) -> Mapping[str, Any]:
        """Defaults of the other parameters, by name."""
        return {name: default for name, default in self._defaults.items() if default is not inspect.Parameter.empty}

    @property
    def is_of_velocity(self) -> bool:
        """Whether the amplitude is a velocity."""
        return self.make is pulses.mavroeidis_papageorgiou

    def parameter(self, name: str) -> Input:
        """Return the declaration of a parameter."""
        if name not in self._defaults:
            hint = checks.suggest(name, [*self._defaults], f"it accepts {_join_names(self._defaults)}")
            raise OptionError(f"the pulse {self.name} has no {name}; {hint}")
        return _VELOCITY_AMPLITUDE if name == "amplitude" and self.is_of_velocity else PARAMETERS[name]

    def unit(self, parameter: str) -> str:
        """Return the SI unit of a parameter; empty without a unit."""
        return READERS.get(self.parameter(parameter).kind, (None, ""))[1]

    def find_reader(self, parameter: str) -> quantities.NumberReader | None:
        """Return the reader of a parameter; None for a word."""
        return READERS.get(self.parameter(parameter).kind, (None, ""))[0]

    def create_motion(self, values: Mapping[str, Any]) -> Motion:
        """Create a pulse from the values of its parameters."""
        for name in values:
            self.parameter(name)
        missing = [name for name in self.needed if name not in values]
        if missing:
            raise OptionError(f"the pulse {self.name} also requires {_join_names(missing)}")
        lobes = values.get("lobes")  # other values than whole numbers are rejected by the pulse
        count = {"lobes": int(lobes)} if isinstance(lobes, float) and lobes.is_integer() else {}
        return self.make(**{**values, **count})

    @cached_property
    def _defaults(self) -> Mapping[str, Any]:
        return {name: parameter.default for name, parameter in inspect.signature(self.make).parameters.items()}


FAMILIES: Final = {family.name: family for family in (PulseFamily(getattr(pulses, name)) for name in pulses.__all__)}


def find_family(name: str) -> PulseFamily:
    """Return the family of pulses with a name; blanks, hyphens and underscores are equivalent."""
    plain_name = checks.text(name, "pulse", OptionError).strip().lower().replace("_", "-").replace(" ", "-")
    if plain_name not in FAMILIES:
        hint = checks.suggest(plain_name, [*FAMILIES], f"there are {_join_names(FAMILIES)}")
        raise OptionError(f"there is no pulse {name!r}; {hint}")
    return FAMILIES[plain_name]


def named_pulse(text: str) -> Motion:
    """Create a pulse from a text: its family, a colon, and its parameters separated by commas.

    Numbers without a unit are in m/s^2, Hz, rad or s, and in m/s for the amplitude of a velocity. Several amplitudes of
    lobes are written one after the other, separated by commas.

    Parameters
    ----------
    text : str
        For example "sine:amplitude=0.2g,frequency=2Hz,cycles=5" or "n-lobe:amplitude=1,2,1,frequency=0.5".

    Returns
    -------
    Motion

    Raises
    ------
    OptionError
        If there is no such family or parameter, a parameter is missing or repeated, or a value cannot be read.

    See Also
    --------
    rocking.pulses : Create pulses by functions.
    rocking.simulate : Simulate one block under one motion.

    Examples
    --------
    >>> named_pulse("sine:amplitude=0.2g,frequency=2Hz,cycles=5").description
    <Description: sine, amplitude 1.9613, frequency 2, cycles 5, phase 0>
    """
    family, values = read_pulse(text)
    return family.create_motion(values)


def read_pulse(text: str) -> tuple[PulseFamily, dict[str, Any]]:
    """Return the family and the parameter values (SI units) of a text of `named_pulse`."""
    family, texts = split_pulse(text)
    return family, {parameter: _read_value(family, parameter, parts) for parameter, parts in texts.items()}


def split_pulse(text: str) -> tuple[PulseFamily, dict[str, list[str]]]:
    """Return family and parameters of a text of `named_pulse` as written, mostly one value each, without blanks."""
    name, _, rest = checks.text(text, "pulse", OptionError).partition(":")
    family, texts = find_family(name), dict[str, list[str]]()
    for part in filter(None, rest.split(",")):
        name, equals, value = (word.strip() for word in part.partition("="))
        if equals and name in texts:
            raise OptionError(f"{name} is given twice in {rest!r}")
        if equals:
            texts[name] = [value]
        elif texts:
            [*texts.values()][-1].append(name)  # another value of the previous parameter
        else:
            form = "NAME:PARAMETER=VALUE,PARAMETER=VALUE"
            raise OptionError(f"a pulse must have the form {form}, but {part!r} has no name")
    return family, texts


def _read_value(family: PulseFamily, parameter: str, texts: list[str]) -> Any:
    reader = family.find_reader(parameter)
    label = f"the {parameter} of a {family.name} pulse"
    if len(texts) > 1 and not (family.make is pulses.n_lobe and parameter == "amplitude"):
        raise OptionError(f"{label} must be one value, not {', '.join(texts)}")
    values = texts if reader is None else [reader(text, label) for text in texts]
    return values if len(values) > 1 else values[0]


def _join_names(names: Iterable[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last
