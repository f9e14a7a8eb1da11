"""The parameters of a case: their names, how their texts are read, and what the page says about them.

This is the only list of them. `inputs` reads texts by it, `core` groups texts by it, `server` names fields in messages
by it, and the page builds its address and its forms from `specification`.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal, NamedTuple

from rocking import records
from rocking.constants import VERSION
from rocking.errors import InvalidOption
from rocking.explorer.phrases import english
from rocking.quantities import (
    UNITS,
    Quantity,
    acceleration,
    angle,
    duration,
    frequency,
    length,
    number,
    position,
    rate,
    sides,
    velocity,
)
from rocking.records.units import CHOICES, plain_spelling
from rocking.solid.mesh import SHIPPED
from rocking.solid.mesh import UNITS as MESH_UNITS
from rocking.treatment import treatment

#: Parameters that one form sets together, and that a comparison replaces together.
Group = Literal[
    "block", "motion", "start", "model", "map", "sweep", "reading", "assessment", "pulse", "treatment",
]  # fmt: skip

Kind = Literal[
    "text", "number", "length", "position", "angle", "rate", "duration", "velocity", "frequency", "acceleration",
    "acceleration at a period",
]  # fmt: skip

_READERS: Final[Mapping[Kind, Quantity]] = {
    "number": number,
    "length": length,
    "position": position,
    "angle": angle,
    "rate": rate,
    "duration": duration,
    "velocity": velocity,
    "frequency": frequency,
    "acceleration": acceleration,
}

#: What the page writes behind a number that is shown in these units; others are SI units.
_SUFFIXES: Final = {"°": "deg", "g": "g"}


@dataclass(frozen=True)
class Parameter:
    """A parameter of a case, and the field of the page that sets it.

    ``name`` is that of the address, and of the command line's option; ``kind`` says how its text is read, ``unit`` what
    the page shows it in, ``default`` with which text its field starts. What the page calls it and says of it are the
    texts ``field.TEXT`` and ``about.TEXT`` of `phrases`, where ``text`` is the name unless another is given. Its
    slider goes from ``low`` to ``high``, in ``unit``; where it is ``logarithmic``, equal distances are equal ratios.
    ``values`` says whether the sides of a block may differ in it, ``step`` by how much its slider moves where that is
    no thousandth of its way.
    """

    name: str
    group: Group
    kind: Kind = "number"
    unit: str = ""
    default: str = ""
    low: float = 0.0
    high: float = 0.0
    logarithmic: bool = False
    values: Literal["one", "one or two", "two"] = "one"
    step: float = 0.0
    text: str = ""

    def read(self, text: str) -> Any:
        """Return the value of a text in SI units: the text itself, a number, or a tuple of two numbers.

        Examples
        --------
        >>> PARAMETERS["alpha"].read("0.1,0.2"), PARAMETERS["sa"].read("2@0.5"), PARAMETERS["motion"].read("none")
        ((0.1, 0.2), (2.0, 0.5), 'none')
        """
        if self.kind == "text":
            return text
        if self.kind == "acceleration at a period":
            level, at, period = text.partition("@")
            if not at:
                raise InvalidOption(
                    f"{{}} takes an acceleration at a period, as 0.4g@1.0, not {text!r}", self.name, value=text
                )
            return acceleration(level, self.name), duration(period, self.name)
        if self.values == "one":
            return _READERS[self.kind](text, self.name)
        found = sides(text, self.name, _READERS[self.kind])
        return tuple(found) if isinstance(found, list) else found

    def described(self) -> dict[str, Any]:
        """Return all of it in plain values, as the page takes it."""
        return {**asdict(self), "text": self.text or self.name, "suffix": self._suffix, "units": self._units()}

    @property
    def _suffix(self) -> str:
        """What is written behind a number in the unit that is shown; an azimuth is in degrees without it."""
        return "" if self.kind == "number" else _SUFFIXES.get(self.unit, "")

    def _units(self) -> dict[str, float]:
        """Return what one of each unit is in the unit that is shown, by plain spellings as in `quantities.UNITS`."""
        kind = "acceleration" if self.kind == "acceleration at a period" else self.kind
        if kind == "text":
            return {}
        units = UNITS[kind]
        shown = units[plain_spelling(self._suffix)]
        return {each: unit.multiplier * shown.divisor / unit.divisor / shown.multiplier for each, unit in units.items()}


def _by_name(*parameters: Parameter) -> dict[str, Parameter]:
    return {parameter.name: parameter for parameter in parameters}


#: All texts of a case by name, in the order of the address and of the command line.
PARAMETERS: Final = _by_name(
    Parameter(
        "width", "block", "position", "m", "0.24", 0.02, 5.0, True,
    ),
    Parameter(
        "height", "block", "position", "m", "1.1", 0.1, 20.0, True,
    ),
    Parameter(
        "offset", "block", "position", "m", "0", -0.25, 0.25,
    ),
    Parameter(
        "p", "block", "rate", "rad/s", "3.61", 0.3, 12.0, True, "one or two",
    ),
    Parameter(
        "alpha", "block", "angle", "°", "12.3deg", 1.5, 40.0, False, "one or two",
    ),
    Parameter(
        "pivots", "block", "length", "m", "0.15", 0.01, 2.5, True, "two",
    ),
    Parameter(
        "height_of_mass", "block", "length", "m", "0.55", 0.05, 10.0, True,
    ),
    Parameter(
        "gyration", "block", "length", "m", "0.33", 0.02, 8.0, True,
    ),
    Parameter("mesh", "block", "text", default="statue"),
    Parameter(
        "azimuth", "block", "number", "°", "90", 0.0, 360.0, step=1.0,
    ),
    Parameter("up", "block", "text"),
    Parameter("unit", "block", "text"),
    Parameter("density", "block", "text"),
    Parameter("tolerance", "block", "length", "m"),
    Parameter(
        "restitution", "block", "number", "", "0.93", 0.5, 0.99, False, "one or two",
    ),
    Parameter("gravity", "model", "acceleration", "m/s²"),
    Parameter("motion", "motion", "text", default="ridgecrest-clc-090"),
    Parameter("channel", "motion", "text"),
    Parameter("vertical", "motion", "text"),
    Parameter("dt", "motion", "duration", "s", "0.01"),
    Parameter("units", "motion", "text"),
    Parameter(
        "scale", "motion", "number", "", "1", 0.1, 10.0, True,
    ),
    Parameter(
        "pga", "motion", "acceleration", "g", "0.4g", 0.05, 2.0, True,
    ),
    Parameter(
        "pgv", "motion", "velocity", "m/s", "0.5", 0.05, 3.0, True,
    ),
    Parameter(
        "sa", "motion", "acceleration at a period", "g", "0.5g", 0.05, 4.0, True,
    ),
    Parameter("model", "model", "text", default="nonlinear"),
    Parameter("chattering", "treatment", "text", default="certified"),
    Parameter("duration", "model", "duration", "s"),
    Parameter(
        "initial_rotation", "start", "angle", "°", "0deg", -20.0, 20.0,
    ),
    Parameter(
        "initial_velocity", "start", "rate", "rad/s", "0", -2.0, 2.0,
    ),
)  # fmt: skip

#: What an address says about a map, of a case or of a study.
MAP: Final = _by_name(
    Parameter("x", "map", "text"),
    Parameter("x_from", "map"),
    Parameter("x_to", "map"),
    Parameter("y", "map", "text"),
    Parameter("y_from", "map"),
    Parameter("y_to", "map"),
    Parameter("points", "map", default="200"),
    Parameter("quantity", "map", "text"),
    Parameter("motion_index", "map"),
    Parameter("polarity_index", "map"),
    Parameter("scale_index", "map"),
    *(Parameter(f"fix_{name}", "map") for name in ("p", "alpha", "restitution", "block")),
)

#: What an address says about a sweep under periodic motion.
SWEEP: Final = _by_name(
    Parameter("sweep", "sweep", "text", default="a"),
    Parameter("sweep_from", "sweep"),
    Parameter("sweep_to", "sweep"),
    Parameter("sweep_points", "sweep", default="200"),
)

#: What an address says about the time that is read.
READING: Final = _by_name(Parameter("at", "reading", "duration", "s"))

#: Kinds of files that are read as meshes, by the ends of their names.
MESH_KINDS: Final = ("obj", "ply", "stl", "glb", "gltf")
#: What an address says about an assessment, and about the list of records it is made of.
ASSESSMENT: Final = _by_name(
    Parameter("records", "assessment", "text"),
    Parameter("measure", "assessment", "text", default="pga"),
    Parameter("measure_period", "assessment", "duration", "s", "1"),
    Parameter("level_from", "assessment", "acceleration", "g"),
    Parameter("level_to", "assessment", "acceleration", "g"),
    Parameter("levels", "assessment", default="16"),
    Parameter("friction", "assessment"),
)

#: Units that the page shows lengths, angles and accelerations in, and the default of each first.
SHOWN_IN: Final[Mapping[str, tuple[str, ...]]] = {
    "length_in": ("m", "cm", "ft", "in"),
    "angle_in": ("deg", "rad"),
    "acceleration_in": ("g", "m/s2"),
}

#: The case that is shown when nothing is asked for: it chatters, rests and rocks on several times.
DEFAULT: Final = {name: PARAMETERS[name].default for name in ("width", "height", "motion", "pga")}


class Shape(NamedTuple):
    """A way to describe a block: its name, and which parameters it needs and takes."""

    name: str
    needed: tuple[str, ...]
    optional: tuple[str, ...] = ()


SHAPES: Final = (
    Shape("sizes", ("width", "height"), ("offset",)),
    Shape("parameters", ("p", "alpha")),
    Shape("pivots", ("pivots", "height_of_mass", "gyration")),
    Shape("mesh", ("mesh", "azimuth"), ("up", "unit", "density", "tolerance")),
)

#: Parameters that scale a motion, of which a case has one at most.
SCALINGS: Final = ("pga", "pgv", "sa", "scale")

_PERIOD: Final = Parameter(
    "period",
    "motion",
    "duration",
    "s",
    "1",
    0.05,
    5.0,
    True,
)


def _of_pulse(name: str, kind: Kind, unit: str, default: str, ends: tuple[float, float], text: str = "") -> Parameter:
    """Return a parameter of a pulse, which `named_pulses` reads; its slider is logarithmic where it can be."""
    logarithmic = ends[0] > 0.0 and name not in ("cycles", "gamma")
    return Parameter(name, "pulse", kind, unit, default, *ends, logarithmic, text=text or f"pulse_{name}")


_AMPLITUDE = _of_pulse("amplitude", "acceleration", "g", "0.3g", (0.02, 2.0))
_FREQUENCY = _of_pulse("frequency", "frequency", "Hz", "1", (0.1, 10.0))
_DURATION = _of_pulse("duration", "duration", "s", "0.5", (0.05, 5.0))
_CYCLES = _of_pulse("cycles", "number", "", "2.5", (0.5, 20.0))
_PHASE = _of_pulse("phase", "angle", "°", "0deg", (0.0, 360.0))
_VELOCITY = _of_pulse("amplitude", "velocity", "m/s", "0.6", (0.05, 3.0), "pulse_velocity")
_GAMMA = _of_pulse("gamma", "number", "cycles", "2", (1.0, 6.0))

#: Parameters of each pulse, and choices.
PULSES: Final[Mapping[str, dict[str, Any]]] = {
    "sine": {"parameters": (_AMPLITUDE, _FREQUENCY, _CYCLES, _PHASE)},
    "half-sine": {"parameters": (_AMPLITUDE, _FREQUENCY)},
    "one-sine": {"parameters": (_AMPLITUDE, _FREQUENCY)},
    "one-cosine": {"parameters": (_AMPLITUDE, _FREQUENCY)},
    "ricker": {
        "parameters": (_AMPLITUDE, _FREQUENCY),
        "choices": {"kind": ("symmetric", "antisymmetric")},
    },
    "mavroeidis-papageorgiou": {
        "parameters": (_VELOCITY, _FREQUENCY, _PHASE, _GAMMA),
    },
    "rectangular": {"parameters": (_AMPLITUDE, _DURATION)},
    "triangular": {"parameters": (_AMPLITUDE, _DURATION)},
}


def _limited(name: str, unit: str, default: str, text: str) -> dict[str, Any]:
    """Return a treatment with the field of its limit, and the limit that it has where a text names none."""
    limit = Parameter("limit", "treatment", "number", unit, default, 1e-9, 0.1, True, text=text)
    return {"name": name, "limit": limit.described(), "unnamed": str(treatment(name)).partition("=")[2]}


_TREATMENTS: Final = (
    {"name": "certified"},
    _limited("velocity", "", "0.05", "limit_velocity"),
    _limited("bypass", "", "0.001", "limit_velocity"),
    _limited("interval", "s", "0.001", "limit_interval"),
    {"name": "time"},
)


#: Quantities of a map.
QUANTITIES: Final = ("outcome", "rest", "peak", "mode")


def names_of(*groups: Group) -> tuple[str, ...]:
    """Return the names of a case's texts in some groups.

    Examples
    --------
    >>> names_of("start")
    ('initial_rotation', 'initial_velocity')
    """
    return tuple(name for name, parameter in PARAMETERS.items() if parameter.group in groups)


def field_label(name: str, motion: str = "", texts: Mapping[str, Any] | None = None) -> str:
    """Return what a message on the page calls an argument: the label of its field, where it has one.

    A parameter of a pulse is called as the pulse that `motion` names has it, or as all that have it do. The labels are
    those of ``texts``, by default the English ones.

    Examples
    --------
    >>> field_label("width"), field_label("radius")
    ('“Width”', 'radius')
    >>> field_label("amplitude", "sine:amplitude=0.2g"), field_label("amplitude", "mavroeidis-papageorgiou")
    ('“Amplitude”', '“Velocity amplitude”')
    """
    shown = PULSES.get(motion.partition(":")[0])
    known = PARAMETERS | MAP | SWEEP | READING | ASSESSMENT | _by_name(_PERIOD)
    known_texts = english() if texts is None else texts
    fields = {
        each.text
        for pulse in (PULSES.values() if shown is None else [shown])
        for each in pulse["parameters"]
        if each.name == name
    }
    if name in known:
        fields = {known[name].text or name}
    return f"“{known_texts[f'field.{fields.pop()}']}”" if len(fields) == 1 else name


@functools.cache
def specification() -> dict[str, Any]:
    """Return all of this in plain values, as the page takes it."""
    return {
        "version": VERSION,
        "default": DEFAULT,
        "parameters": [parameter.described() for parameter in PARAMETERS.values()],
        "map": list(MAP),
        "sweep": list(SWEEP),
        "assessment": list(ASSESSMENT),
        "shown_in": {name: list(units) for name, units in SHOWN_IN.items()},
        "shapes": [shape._asdict() for shape in SHAPES],
        "scalings": ["", *SCALINGS],
        "period": _PERIOD.described(),
        "pulses": {
            name: {**pulse, "parameters": [parameter.described() for parameter in pulse["parameters"]]}
            for name, pulse in PULSES.items()
        },
        "meshes": [*SHIPPED],
        "mesh_kinds": list(MESH_KINDS),
        "records": [_record(name) for name in records.names()],
        "mesh_units": list(MESH_UNITS),
        "units": list(CHOICES),
        "models": ["nonlinear", "linear"],
        "treatments": list(_TREATMENTS),
        "quantities": list(QUANTITIES),
    }


def _record(name: str) -> dict[str, str]:
    record = records.info(name)
    return {
        "name": name,
        "title": record.title,
        "event": record.event,
        "station": record.station,
        "direction": record.direction,
    }
