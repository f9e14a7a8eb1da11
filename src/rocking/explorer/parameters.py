"""Parameters of a case: fields of the page, and possible contents of an address.

`rocking.inputs.declared` declares the inputs of simulations. This module adds the inputs of the page alone, and
`describe_inputs`, from which the page creates its address and forms.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any, Final

from rocking.core import checks
from rocking.core.constants import MODELS, VERSION
from rocking.engine.schemes import chattering_scheme
from rocking.errors import OptionError
from rocking.explorer.payload import load_english_texts
from rocking.inputs.declared import BLOCK_DESCRIPTIONS, INPUTS, SCALINGS, BlockDescription, Input
from rocking.inputs.pulses import FAMILIES
from rocking.inputs.quantities import read_number
from rocking.solid.mesh import SHIPPED_MESHES
from rocking.solid.solid import Solid

Texts = Mapping[str, str]

#: Values of the texts of a case: numbers in SI units, and texts.
Values = Mapping[str, Any]

#: All texts of a case by name, in the order of the address and of the command line.
PARAMETERS: Final = {name: declared_input for name, declared_input in INPUTS.items() if declared_input.group}

_MAX_TEXT_LENGTH: Final = 300


#: Texts for a map of a case or of a study, for a diagram, and for an assessment, by name.
MAP_NAMES: Final = (
    "x", "x_from", "x_to", "y", "y_from", "y_to", "points", "quantity",
    *(f"{name}_index" for name in ("p", "alpha", "restitution", "block", "motion", "scale", "polarity")),
)  # fmt: skip
SWEEP_NAMES: Final = ("sweep", "sweep_from", "sweep_to", "sweep_points")
ASSESSMENT_NAMES: Final = ("records", "measure", "measure_period", "level_from", "level_to", "levels")

#: File name extensions of meshes.
MESH_KINDS: Final = ("obj", "ply", "stl", "glb", "gltf")

#: Units of lengths, angles and accelerations on the page; the first is the default.
DISPLAY_UNITS: Final[Mapping[str, tuple[str, ...]]] = {
    "length_in": ("m", "cm", "ft", "in"),
    "angle_in": ("deg", "rad"),
    "acceleration_in": ("g", "m/s2"),
}

#: Default case: it chatters, rests and rocks on several times.
DEFAULT_TEXTS: Final = {name: PARAMETERS[name].default for name in ("width", "height", "motion", "pga")}


#: Texts of a mesh that are arguments of `rocking.Solid.from_mesh`.
MESH_OPTIONS: Final = ("density", "up", "unit", "tolerance", "gravity")

#: Descriptions of a block on the page.
SHAPES: Final = (
    *(
        shape._replace(optional=tuple(name for name in shape.optional if name in PARAMETERS))
        for shape in BLOCK_DESCRIPTIONS
        if PARAMETERS.keys() >= {*shape.needed}
    ),
    BlockDescription("mesh", ("mesh", "azimuth"), MESH_OPTIONS[:-1], Solid.block),
)

_PERIOD_INPUT: Final = Input("period", "motion", "duration", "", "s", "1", 0.05, 5.0, True)

#: Pulses of the page, and choices of a parameter.
_PULSES: Final = (
    "sine", "half-sine", "one-sine", "one-cosine", "ricker", "mavroeidis-papageorgiou", "rectangular", "triangular"
)  # fmt: skip
_CHOICES: Final[Mapping[str, Any]] = {"ricker": {"kind": ("symmetric", "antisymmetric")}}


def _list_fields(pulse: str) -> tuple[Input, ...]:
    """Return the parameters of a pulse that have a field: required ones, and numbers with a default."""
    family = FAMILIES[pulse]
    numbers = (name for name, default in family.optional.items() if isinstance(default, float))
    return tuple(family.parameter(name) for name in (*family.needed, *numbers))


#: Parameters of each pulse, and choices.
PULSES: Final[Mapping[str, dict[str, Any]]] = {
    name: {"parameters": _list_fields(name), "choices": _CHOICES.get(name, {})} for name in _PULSES
}


def _declare_limited_scheme(name: str, unit: str, default: str, text: str) -> dict[str, Any]:
    """Return a scheme with the field of its limit, and its default limit."""
    limit = Input("limit", "treatment", "number", "", unit, default, 1e-9, 0.1, True, text=text)
    return {"name": name, "limit": limit.describe(), "unnamed": str(chattering_scheme(name)).partition("=")[2]}


_TREATMENTS: Final = (
    {"name": "certified"},
    _declare_limited_scheme("velocity", "", "0.05", "limit_velocity"),
    _declare_limited_scheme("bypass", "", "0.001", "limit_velocity"),
    _declare_limited_scheme("interval", "s", "0.001", "limit_interval"),
    {"name": "time"},
)


#: Quantities of a map.
QUANTITIES: Final = ("outcome", "rest", "peak", "mode")


def list_names(*groups: str) -> tuple[str, ...]:
    """Return the names of a case's texts in some groups.

    Examples
    --------
    >>> list_names("start")
    ('initial_rotation', 'initial_velocity')
    """
    return tuple(name for name, parameter in PARAMETERS.items() if parameter.group in groups)


#: Names of the texts that describe the block of a case.
BLOCK_NAMES: Final = list_names("block")


def read_texts(texts: Texts) -> tuple[dict[str, str], dict[str, Any]]:
    """Return the texts of a case that are not empty, by default those of `DEFAULT_TEXTS`, and their values."""
    nonempty = {name: value.strip() for name, value in texts.items() if value.strip()}
    for name, value in nonempty.items():
        if name not in PARAMETERS:
            raise OptionError(f"a case has no {name[:40]!r}; it has {', '.join(PARAMETERS)}")
        if len(value) > _MAX_TEXT_LENGTH:
            raise OptionError(f"{{}} is {len(value)} letters long; at most {_MAX_TEXT_LENGTH} are read", name)
    nonempty = {"motion": DEFAULT_TEXTS["motion"], **nonempty} if nonempty else DEFAULT_TEXTS
    return nonempty, {name: PARAMETERS[name].read(text) for name, text in nonempty.items()}


def read_count(text: str, name: str, minimum: int, maximum: int) -> int:
    """Return a whole number within a range.

    Examples
    --------
    >>> read_count("12", "points", 8, 400)
    12
    """
    number = read_number(text, name)
    return checks.integer(int(number) if number.is_integer() else number, name, OptionError, minimum, maximum)


def find_field_label(name: str, motion: str = "") -> str:
    """Return the label of an argument's field for messages, or the argument itself.

    A parameter of a pulse has the label for the pulse in `motion`, or the labels of all pulses that have it.

    Examples
    --------
    >>> find_field_label("width"), find_field_label("radius")
    ('“Width”', 'radius')
    >>> find_field_label("amplitude", "sine:amplitude=0.2g"), find_field_label("amplitude", "mavroeidis-papageorgiou")
    ('“Amplitude”', '“Velocity amplitude”')
    """
    pulse_in_motion, texts = PULSES.get(motion.partition(":")[0]), load_english_texts()
    pulses = PULSES.values() if pulse_in_motion is None else [pulse_in_motion]
    fields = {field.text for pulse in pulses for field in pulse["parameters"] if field.name == name}
    by_argument = {item.argument: item.name for item in PARAMETERS.values() if item.argument}
    field = name if f"field.{name}" in texts else by_argument.get(name, "")
    fields = {field} if f"field.{field}" in texts else fields
    return f"“{texts[f'field.{fields.pop()}']}”" if len(fields) == 1 else name


@functools.cache
def describe_inputs() -> dict[str, Any]:
    """Return these declarations as plain values for the page."""
    return {
        "version": VERSION,
        "default": DEFAULT_TEXTS,
        "parameters": [parameter.describe() for parameter in PARAMETERS.values()],
        "map": list(MAP_NAMES),
        "sweep": list(SWEEP_NAMES),
        "assessment": list(ASSESSMENT_NAMES),
        "shown_in": {name: list(units) for name, units in DISPLAY_UNITS.items()},
        "shapes": [{"name": name, "needed": needed, "optional": optional} for name, needed, optional, _ in SHAPES],
        "scalings": ["", *SCALINGS],
        "period": _PERIOD_INPUT.describe(),
        "pulses": {
            name: {**pulse, "parameters": [parameter.describe() for parameter in pulse["parameters"]]}
            for name, pulse in PULSES.items()
        },
        "meshes": [*SHIPPED_MESHES],
        "mesh_kinds": list(MESH_KINDS),
        "models": list(MODELS),
        "treatments": list(_TREATMENTS),
        "quantities": list(QUANTITIES),
    }
