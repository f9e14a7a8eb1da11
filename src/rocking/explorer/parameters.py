"""The parameters of a case: their names, how their texts are read, and what the page says about them.

This is the only list of them. `inputs` reads texts by it, `core` groups texts by it, `server` names fields in messages
by it, and the page builds its address and its forms from `specification`.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal, NamedTuple

from rocking.constants import VERSION
from rocking.errors import InvalidOption
from rocking.motion import records
from rocking.motion.units import CHOICES, plain_spelling
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
from rocking.solid.reading import SHIPPED
from rocking.solid.reading import UNITS as MESH_UNITS

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

    ``name`` is that of the address, and of the command line's option; ``label`` is what the page calls it; ``kind``
    says how its text is read, ``unit`` what the page shows it in, ``default`` with which text its field starts. Its
    slider goes from ``low`` to ``high``, in ``unit``; where it is ``logarithmic``, equal distances are equal ratios.
    ``values`` says whether the sides of a block may differ in it, ``step`` by how much its slider moves where that is
    no thousandth of its way.
    """

    name: str
    label: str
    group: Group
    kind: Kind = "number"
    unit: str = ""
    default: str = ""
    low: float = 0.0
    high: float = 0.0
    logarithmic: bool = False
    values: Literal["one", "one or two", "two"] = "one"
    step: float = 0.0
    explanation: str = ""

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
        return {**asdict(self), "suffix": self._suffix, "units": self._units()}

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
        "width", "Width", "block", "position", "m", "0.24", 0.02, 5.0, True,
        explanation="Full width 2b of a rectangular block.",
    ),
    Parameter(
        "height", "Height", "block", "position", "m", "1.1", 0.1, 20.0, True,
        explanation="Full height 2h of a rectangular block.",
    ),
    Parameter(
        "offset", "Offset of the centre of mass", "block", "position", "m", "0", -0.25, 0.25,
        explanation="Distance of the centre of mass from the middle of the width, positive to the right (side +). It "
        "is a quarter of the width at most. The two sides then differ.",
    ),
    Parameter(
        "p", "Frequency parameter p", "block", "rate", "rad/s", "3.61", 0.3, 12.0, True, "one or two",
        explanation="It says how fast the block tips: p² = 3g/4R for a rectangle with half diagonal R. Large blocks "
        "have a small p. It is not a frequency of vibration: a rocking block has none.",
    ),
    Parameter(
        "alpha", "Slenderness α", "block", "angle", "°", "12.3deg", 1.5, 40.0, False, "one or two",
        explanation="Angle between the vertical and the line from a corner to the centre of mass. The block lifts when "
        "the ground acceleration passes g tan α, and it stands on its corner in balance when it is rotated by α.",
    ),
    Parameter(
        "pivots", "Distance of the pivot", "block", "length", "m", "0.15", 0.01, 2.5, True, "two",
        explanation="Horizontal distance of the corner from the centre of mass.",
    ),
    Parameter(
        "height_of_mass", "Height of the centre of mass", "block", "length", "m", "0.55", 0.05, 10.0, True,
        explanation="Its height above the corners.",
    ),
    Parameter(
        "gyration", "Radius of gyration", "block", "length", "m", "0.33", 0.02, 8.0, True,
        explanation="About the centre of mass: the square root of the moment of inertia over the mass.",
    ),
    Parameter("mesh", "Mesh", "block", "text", default="statue"),
    Parameter(
        "azimuth", "Azimuth", "block", "number", "°", "90", 0.0, 360.0, step=1.0,
        explanation="Direction of side + (to the right), in which the ground moves and the body rocks, clockwise from "
        "north; x of the mesh is to the east, and y to the north.",
    ),
    Parameter("up", "Axis that points up", "block", "text"),
    Parameter("unit", "Unit of the coordinates", "block", "text"),
    Parameter("density", "Density, kg/m³", "block", "text"),
    Parameter("tolerance", "Height of what still carries, m", "block", "length", "m"),
    Parameter(
        "restitution", "Restitution η", "block", "number", "", "0.93", 0.5, 0.99, False, "one or two",
        explanation="Angular speed just after an impact over the speed just before. Housner's value, 1 − 1.5 sin² α, "
        "keeps the angular momentum about the new corner; that of two different sides follows from both p and α.",
    ),
    Parameter("gravity", "Gravity", "model", "acceleration", "m/s²"),
    Parameter("motion", "Record", "motion", "text", default="ridgecrest-clc-090"),
    Parameter("channel", "Channel", "motion", "text"),
    Parameter("vertical", "Vertical component", "motion", "text"),
    Parameter("dt", "Sampling step", "motion", "duration", "s", "0.01"),
    Parameter("units", "Units of the numbers", "motion", "text"),
    Parameter(
        "scale", "Factor", "motion", "number", "", "1", 0.1, 10.0, True,
        explanation="Every acceleration is multiplied by it; a negative one reverses the motion.",
    ),
    Parameter(
        "pga", "Peak acceleration", "motion", "acceleration", "g", "0.4g", 0.05, 2.0, True,
        explanation="Largest ground acceleration (PGA).",
    ),
    Parameter(
        "pgv", "Peak velocity", "motion", "velocity", "m/s", "0.5", 0.05, 3.0, True,
        explanation="Largest ground velocity (PGV).",
    ),
    Parameter(
        "sa", "Spectral acceleration", "motion", "acceleration at a period", "g", "0.5g", 0.05, 4.0, True,
        explanation="Peak response of an oscillator of the period below, with 5 % damping.",
    ),
    Parameter("model", "Equation of motion", "model", "text", default="nonlinear"),
    Parameter("chattering", "Chattering ends by", "treatment", "text", default="certified"),
    Parameter("duration", "Duration", "model", "duration", "s"),
    Parameter(
        "initial_rotation", "Release from a rotation of", "start", "angle", "°", "0deg", -20.0, 20.0,
        explanation="Rotation at time zero; positive leans to the right corner.",
    ),
    Parameter(
        "initial_velocity", "Release with a velocity of", "start", "rate", "rad/s", "0", -2.0, 2.0,
        explanation="Angular velocity at time zero; positive turns to the right corner.",
    ),
)  # fmt: skip

#: What an address says about a map, of a case or of a study.
MAP: Final = _by_name(
    Parameter("x", "to the right", "map", "text"),
    Parameter("x_from", "to the right, from", "map"),
    Parameter("x_to", "to the right, to", "map"),
    Parameter("y", "upwards", "map", "text"),
    Parameter("y_from", "upwards, from", "map"),
    Parameter("y_to", "upwards, to", "map"),
    Parameter("points", "points", "map", default="200"),
    Parameter("quantity", "Shows", "map", "text"),
    Parameter("motion_index", "motion", "map"),
    Parameter("polarity_index", "polarity", "map"),
    Parameter("scale_index", "scale", "map"),
    *(Parameter(f"fix_{name}", name, "map") for name in ("p", "alpha", "restitution", "block")),
)

#: What an address says about a sweep under periodic motion.
SWEEP: Final = _by_name(
    Parameter("sweep", "Diagram over", "sweep", "text", default="a"),
    Parameter("sweep_from", "Diagram from", "sweep"),
    Parameter("sweep_to", "Diagram to", "sweep"),
    Parameter("sweep_points", "Values", "sweep", default="200"),
)

#: What an address says about the time that is read.
READING: Final = _by_name(Parameter("at", "Time", "reading", "duration", "s"))

#: Kinds of files that are read as meshes, by the ends of their names.
MESH_KINDS: Final = ("obj", "ply", "stl", "glb", "gltf")
#: What an address says about an assessment, and about the list of records it is made of.
ASSESSMENT: Final = _by_name(
    Parameter("records", "records", "assessment", "text"),
    Parameter("measure", "Intensity", "assessment", "text", default="pga"),
    Parameter("measure_period", "at a period of", "assessment", "duration", "s", "1"),
    Parameter("level_from", "Levels from", "assessment", "acceleration", "g"),
    Parameter("level_to", "Levels to", "assessment", "acceleration", "g"),
    Parameter("levels", "Levels", "assessment", default="16"),
    Parameter("friction", "Friction coefficient of the base", "assessment"),
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
    """A way to describe a block: its name, its label, and which parameters it needs and takes."""

    name: str
    label: str
    needed: tuple[str, ...]
    optional: tuple[str, ...] = ()


SHAPES: Final = (
    Shape("sizes", "width and height", ("width", "height"), ("offset",)),
    Shape("parameters", "p and α", ("p", "alpha")),
    Shape("pivots", "pivots and radius of gyration", ("pivots", "height_of_mass", "gyration")),
    Shape("mesh", "a mesh and an azimuth", ("mesh", "azimuth"), ("up", "unit", "density", "tolerance")),
)

#: Parameters that scale a motion, of which a case has one at most; and how the page calls each.
SCALINGS: Final = {
    "pga": "to a peak acceleration (PGA)",
    "pgv": "to a peak velocity (PGV)",
    "sa": "to a spectral acceleration (Sa)",
    "scale": "by a factor",
}

_PERIOD: Final = Parameter(
    "period",
    "at a period of",
    "motion",
    "duration",
    "s",
    "1",
    0.05,
    5.0,
    True,
    explanation="Period of that oscillator.",
)


def _of_pulse(
    name: str, label: str, kind: Kind, unit: str, default: str, ends: tuple[float, float], words: str
) -> Parameter:
    """Return a parameter of a pulse, which `named_pulses` reads; its slider is logarithmic where it can be."""
    logarithmic = ends[0] > 0.0 and name not in ("cycles", "gamma")
    return Parameter(name, label, "pulse", kind, unit, default, *ends, logarithmic, explanation=words)


_AMPLITUDE = _of_pulse(
    "amplitude", "Amplitude", "acceleration", "g", "0.3g", (0.02, 2.0), "Largest acceleration of the pulse."
)
_FREQUENCY = _of_pulse("frequency", "Frequency", "frequency", "Hz", "1", (0.1, 10.0), "Cycles per second.")
_DURATION = _of_pulse("duration", "Duration", "duration", "s", "0.5", (0.05, 5.0), "How long the pulse lasts.")
_CYCLES = _of_pulse("cycles", "Cycles", "number", "", "2.5", (0.5, 20.0), "Duration times frequency; any number.")
_PHASE = _of_pulse("phase", "Phase", "angle", "°", "0deg", (0.0, 360.0), "Where in its cycle the pulse begins.")
_VELOCITY = _of_pulse(
    "amplitude", "Velocity amplitude", "velocity", "m/s", "0.6", (0.05, 3.0), "Amplitude of the velocity pulse."
)
_GAMMA = _of_pulse("gamma", "Length γ", "number", "cycles", "2", (1.0, 6.0), "How many cycles its envelope holds.")

#: Label and parameters of each pulse, and choices.
PULSES: Final[Mapping[str, dict[str, Any]]] = {
    "sine": {"label": "Sine", "parameters": (_AMPLITUDE, _FREQUENCY, _CYCLES, _PHASE)},
    "half-sine": {"label": "Half sine", "parameters": (_AMPLITUDE, _FREQUENCY)},
    "one-sine": {"label": "One sine", "parameters": (_AMPLITUDE, _FREQUENCY)},
    "one-cosine": {"label": "One cosine", "parameters": (_AMPLITUDE, _FREQUENCY)},
    "ricker": {
        "label": "Ricker",
        "parameters": (_AMPLITUDE, _FREQUENCY),
        "choices": {"kind": ("symmetric", "antisymmetric")},
    },
    "mavroeidis-papageorgiou": {
        "label": "Mavroeidis–Papageorgiou (near fault)",
        "parameters": (_VELOCITY, _FREQUENCY, _PHASE, _GAMMA),
    },
    "rectangular": {"label": "Rectangular", "parameters": (_AMPLITUDE, _DURATION)},
    "triangular": {"label": "Triangular", "parameters": (_AMPLITUDE, _DURATION)},
}

_TREATMENTS: Final = (
    {"name": "certified", "label": "Proof", "explanation": "The block rests where the impacts provably accumulate."},
    {
        "name": "velocity",
        "label": "Velocity threshold",
        "limit": Parameter(
            "limit", "Threshold over pα", "treatment", "number", "", "0.05", 1e-9, 0.1, True
        ).described(),
        "explanation": "The block rests as soon as an impact leaves less speed than this.",
    },
    {
        "name": "interval",
        "label": "Interval threshold",
        "limit": Parameter("limit", "Threshold", "treatment", "number", "s", "0.001", 1e-9, 0.1, True).described(),
        "explanation": "The block rests as soon as two impacts follow each other within this time.",
    },
    {
        "name": "time",
        "label": "Asymptotic time (Eq. 65)",
        "explanation": "The block rests once the paper's asymptotic chattering time has passed; for a sine only.",
    },
)


#: Quantities of a map, and how the page calls each.
QUANTITIES: Final = {
    "outcome": "End of the first rocking: chattering complete or not",
    "rest": "Time from uplift to rest",
    "peak": "Peak rotation over slenderness",
    "mode": "Final fate",
}


def names_of(*groups: Group) -> tuple[str, ...]:
    """Return the names of a case's texts in some groups.

    Examples
    --------
    >>> names_of("start")
    ('initial_rotation', 'initial_velocity')
    """
    return tuple(name for name, parameter in PARAMETERS.items() if parameter.group in groups)


def field_label(name: str, motion: str = "") -> str:
    """Return what a message on the page calls an argument: the label of its field, where it has one.

    A parameter of a pulse is called as the pulse that `motion` names has it, or as all that have it do.

    Examples
    --------
    >>> field_label("width"), field_label("radius")
    ('“Width”', 'radius')
    >>> field_label("amplitude", "sine:amplitude=0.2g"), field_label("amplitude", "mavroeidis-papageorgiou")
    ('“Amplitude”', '“Velocity amplitude”')
    """
    shown = PULSES.get(motion.partition(":")[0])
    known = PARAMETERS | MAP | SWEEP | READING | ASSESSMENT | _by_name(_PERIOD)
    labels = {
        each.label
        for pulse in (PULSES.values() if shown is None else [shown])
        for each in pulse["parameters"]
        if each.name == name
    }
    if name in known:
        labels = {known[name].label}
    return f"“{labels.pop()}”" if len(labels) == 1 else name


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
        "scalings": [["", "as it is"], *SCALINGS.items()],
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
        "models": [["nonlinear", "exact (nonlinear)"], ["linear", "slender block (linear)"]],
        "treatments": list(_TREATMENTS),
        "quantities": [{"name": name, "label": label} for name, label in QUANTITIES.items()],
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
