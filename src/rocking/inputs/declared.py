"""Declarations of all inputs: name, reader, help text, and field of the page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

from rocking.block import Block, Damper, Load, Restraint, Spring, Tendon, Thrust
from rocking.core.progress import note
from rocking.errors import OptionError
from rocking.inputs import quantities
from rocking.inputs.notes import list_level_notes
from rocking.records.units import normalise_spelling

#: Reader of a number of each kind, and its SI unit.
READERS: Final[Mapping[str, tuple[quantities.NumberReader, str]]] = {
    "number": (quantities.read_number, ""),
    "length": (quantities.read_length, "m"),
    "position": (quantities.read_position, "m"),
    "angle": (quantities.read_angle, "rad"),
    "tilt": (quantities.read_tilt, "rad"),
    "rate": (quantities.read_rate, "rad/s"),
    "duration": (quantities.read_duration, "s"),
    "velocity": (quantities.read_velocity, "m/s"),
    "frequency": (quantities.read_frequency, "Hz"),
    "acceleration": (quantities.read_acceleration, "m/s^2"),
}

#: Readers of other texts of each kind.
_TEXT_READERS: Final[Mapping[str, Callable[[str, str], Any]]] = {
    "acceleration at a period": quantities.read_level_at_period,
    "densities": quantities.read_densities,
    "length unit": quantities.read_length_unit,
}


def read_noted_acceleration(text: str, name: str) -> float:
    """Return an acceleration, m/s^2, with a note if a number without a unit is probably in g."""
    value = quantities.read_acceleration(text, name)
    for sentence in list_level_notes(text, value, name):
        note(sentence)
    return value


@dataclass(frozen=True)
class Input:
    """Input: an option of the command line, a key of study files, and a field of the page.

    Attributes
    ----------
    name : str
        Name of the option (with hyphens), of the key, and in the address of the page.
    group : str
        Form of the page that contains the input, which comparisons replace as a whole; empty without a field.
    kind : str
        Type of the text: a key of `READERS`, "acceleration at a period", "densities" (of parts), "length unit", "text",
        "flag" (yes or no), or "texts" (several).
    help : str
        Help of its option.
    unit, default, low, high, is_logarithmic, step : str, str, float, float, bool, float
        Field of the page: displayed unit, initial text, limits of the slider in that unit, whether the slider is
        logarithmic, and its step if not a thousandth of its range.
    arity : str
        Number of values: "two" for one of each side of a block, "one or two" if they may differ.
    text : str
        Suffix of the texts ``field.TEXT`` and ``about.TEXT`` of the page; by default the name.
    argument : str
        Name of the Python argument, if different.
    """

    name: str
    group: str = ""
    kind: str = "number"
    help: str = ""
    unit: str = ""
    default: str = ""
    low: float = 0.0
    high: float = 0.0
    is_logarithmic: bool = False
    arity: Literal["one", "one or two", "two"] = "one"
    step: float = 0.0
    text: str = ""
    argument: str = ""

    def read(self, text: str) -> Any:
        """Return the value of a text in SI units: the text itself, a number, or a tuple of two numbers.

        Examples
        --------
        >>> INPUTS["alpha"].read("0.1,0.2"), INPUTS["sa"].read("2@0.5"), INPUTS["pivots"].read("20cm")
        ((0.1, 0.2), (2.0, 0.5), (0.2, 0.2))
        """
        if self.kind not in READERS:
            return _TEXT_READERS[self.kind](text, self.name) if self.kind in _TEXT_READERS else text
        reader = READERS[self.kind][0]
        if self.arity == "one":
            return reader(text, self.name)
        numbers = quantities.read_sides(text, self.name, reader)
        if isinstance(numbers, list):
            return tuple(numbers)
        return (numbers, numbers) if self.arity == "two" else numbers

    def read_uncertain(self, text: str) -> Any:
        """Return the value of a text, as `read`, or a distribution from "0.30 +- 0.02" (mean, standard deviation)."""
        if self.kind not in READERS or not quantities.PLUS_MINUS.search(text):
            return self.read(text)
        return quantities.read_uncertain(text, self.name, READERS[self.kind][0])

    def read_axis(self, value: Any) -> list[Any]:
        """Return the values of an entry of a study file: a number, a list, or a range (for pivots, of pairs)."""
        if self.kind not in READERS:
            return [value]
        reader = READERS[self.kind][0]
        if self.arity != "two":
            return [*map(float, quantities.read_axis(value, self.name, reader))]
        pairs = value if isinstance(value, list) and value and isinstance(value[0], list) else [value]
        pairs_read = [tuple(map(float, quantities.read_axis(pair, self.name, reader))) for pair in pairs]
        if any(len(pair) != 2 for pair in pairs_read):
            message = "{} must be a pair, [0.2, 0.15] (side +, side -), or a list of pairs"
            raise OptionError(message, self.name, value=value)
        return [*pairs_read]

    def describe(self) -> dict[str, Any]:
        """Return the properties that the page requires, in plain values."""
        names = ("name", "group", "unit", "default", "low", "high", "is_logarithmic", "arity", "step")
        plain = {name: getattr(self, name) for name in names}
        kind = "angle" if self.kind == "tilt" else self.kind
        return {
            **plain,
            "kind": kind,
            "text": self.text or self.name,
            "argument": self.argument or self.name,
            "suffix": self.suffix,
            "units": self._sizes(),
        }

    @property
    def suffix(self) -> str:
        """Unit written after a number in the displayed unit; empty for an azimuth, always in degrees."""
        return "" if self.kind == "number" else {"°": "deg", "g": "g"}.get(self.unit, "")

    def _sizes(self) -> dict[str, float]:
        """Return the sizes of units relative to the displayed unit, by their plain spellings in `quantities.UNITS`."""
        kind = {"acceleration at a period": "acceleration", "tilt": "angle"}.get(self.kind, self.kind)
        if kind not in quantities.UNITS:
            return {}
        units = quantities.UNITS[kind]
        base = units[normalise_spelling(self.suffix)]
        return {name: unit.multiplier * base.divisor / unit.divisor / base.multiplier for name, unit in units.items()}


def index_by_name(*inputs: Input) -> dict[str, Input]:
    """Return inputs by their names."""
    return {declared_input.name: declared_input for declared_input in inputs}


#: All inputs of a single simulation, in the order of the address of the page.
INPUTS: Final = index_by_name(
    Input("half_width", "", "position", "Half the width of a rectangular block, 0.12 (m) or 12cm."),
    Input("half_height", "", "position", "Half its height, m."),
    Input("width", "block", "position", "Width of a rectangular block, 0.24 (m) or 24cm; with --height.",
        "m", "0.24", 0.02, 5.0, True),
    Input("height", "block", "position", "Its height, m.", "m", "1.1", 0.1, 20.0, True),
    Input("offset", "block", "position",
        "How far its centre of mass is off the middle of the width, m; positive to side + (the right).",
        "m", "0", -0.25, 0.25),
    Input("p", "block", "rate", "Frequency parameter, rad/s; one number or two; with --alpha.",
        "rad/s", "3.61", 0.3, 12.0, True, "one or two"),
    Input("alpha", "block", "tilt", "Slenderness, 12deg or 0.2 (rad); two with a comma between are side + and side -.",
        "°", "12.3deg", 1.5, 40.0, False, "one or two"),
    Input("pivots", "block", "length",
        "Distances of the pivots of side + and side - from the centre of mass, m, as 0.2,0.15; with --height-of-mass "
        "and --gyration.", "m", "0.15", 0.01, 2.5, True, "two", argument="distances"),
    Input("height_of_mass", "block", "length", "Height of the centre of mass above the pivots, m.",
        "m", "0.55", 0.05, 10.0, True, argument="height"),
    Input("gyration", "block", "length", "Radius of gyration about the centre of mass, m.",
        "m", "0.33", 0.02, 8.0, True, argument="radius_of_gyration"),
    Input("mesh", "block", "text", default="statue"),
    Input("azimuth", "block", "number", "", "°", "90", 0.0, 360.0, step=1.0),
    Input("up", "block", "text"),
    Input("unit", "block", "length unit"),
    Input("density", "block", "densities"),
    Input("tolerance", "block", "length", "", "m"),
    Input("restitution", "block", "number",
        "Factor on the angular speed at an impact, in (0, 1]; one or two; by default from angular momentum (Housner's "
        "where both sides are equal).", "", "0.93", 0.5, 0.99, False, "one or two"),
    Input("mass", "", "number", "Mass of the block, kg, which restraints need; with its sizes or pivots."),
    Input("one_sided", "", "flag",
        "It rocks to side + only, as a wall against transverse walls; --restitution is then the speed back over that "
        "before."),
    Input("lean", "", "tilt", "Angle by which it stands out of plumb to side +, 1deg or 0.02 (rad)."),
    Input("tendon", "", "texts",
        "Elastic tendon, as stiffness=2e6,prestress=5e3 (N/m, N), with offset (m, to side +) and strength (N), at "
        "which it yields; several times for several."),
    Input("spring", "", "number", "Rotational spring, N m/rad."),
    Input("damper", "", "number", "Rotational viscous damper, N m s/rad."),
    Input("thrust", "", "texts",
        "Horizontal force to side +, as force=1500,height=4 (N, m), with offset (m); several times for several."),
    Input("load", "", "texts",
        "Weight on it, as mass=250,height=3 (kg, m), with offset (m), and moves_with_block=no for one that only "
        "presses; several times for several."),
    Input("gravity", "model", "acceleration", "", "m/s²"),
    Input("motion", "motion", "text", default="ridgecrest-clc-090"),
    Input("channel", "motion", "text", "Channel, by number or name, of files that hold several."),
    Input("vertical", "motion", "text",
        "Vertical motion, scaled alike: a channel of the same file, or another file or shipped record."),
    Input("dt", "motion", "duration", "Sampling step, 0.01 (s) or 10ms, of files that do not say theirs.", "s", "0.01"),
    Input("units", "motion", "text", "Units of files that do not say theirs: g, m/s2, cm/s2, gal, mm/s2, mg."),
    Input("baseline", "motion", "text",
        "Degree of the polynomial that is subtracted from records (0: the mean), or none. By default 0 for counts of "
        "instruments (K-NET), none for others."),
    Input("highpass", "motion", "frequency", "Corner frequency of a high-pass filter of records, 0.1 (Hz)."),
    Input("floor", "", "text",
        "Floor of a linear building whose motion shakes the block, as period=0.4,damping=0.05 (s, fraction of critical "
        "damping); scaling and measures then refer to the motion of the floor."),
    Input("scale", "motion", "number", "Factor on the motion; negative: reversed.", "", "1", 0.1, 10.0, True),
    Input("pga", "motion", "acceleration", "Scale to this peak ground acceleration: 0.5g, 4.9m/s2 or 4.9 (m/s^2).",
        "g", "0.4g", 0.05, 2.0, True),
    Input("pgv", "motion", "velocity", "Scale to this peak ground velocity, 0.4 (m/s) or 40cm/s.",
        "m/s", "0.5", 0.05, 3.0, True),
    Input("sa", "motion", "acceleration at a period",
        "Scale to this spectral acceleration (5 % damping) at a period: 0.4g@1.0 is 0.4 g at 1.0 s.",
        "g", "0.5g", 0.05, 4.0, True),
    Input("pulse", "", "texts",
        "A pulse as the ground motion, sine:amplitude=0.2g,frequency=2Hz,cycles=5 (see rocking pulses); once for "
        "each."),
    Input("stochastic", "", "texts",
        "Stochastic motions, as count=20,arias_intensity=1.2,duration=12s,middle_time=8s,frequency=4Hz, with "
        "frequency_rate (Hz/s), damping, highpass, dt and seed; several times for several sets."),
    Input("model", "model", "text",
        "Equation of motion: of finite rotations (nonlinear, the default), or linearised for slender blocks.",
        default="nonlinear"),
    Input("friction", "model", "number",
        "Coefficient of friction with which slip is simulated, or the static and the kinetic one, as 0.3,0.25.",
        "", "0.5", 0.05, 1.5, arity="one or two"),
    Input("chattering", "treatment", "text",
        "How chattering ends: certified, velocity, bypass, interval, or (under a sine) time; with a limit, as "
        "certified=1e-9 (s), velocity=5e-10 or bypass=1e-3 (over p alpha), interval=1e-9 (s).", default="certified"),
    Input("duration", "model", "duration",
        "Time to stop at, s; by default when the block is at rest after the motion, or has overturned.", "s"),
    Input("initial_rotation", "start", "tilt", "Rotation at the start, 2deg or 0.03 (rad).", "°", "0deg", -20.0, 20.0),
    Input("initial_velocity", "start", "rate", "Angular velocity at the start, 5deg/s or 0.09 (rad/s).",
        "rad/s", "0", -2.0, 2.0),
)  # fmt: skip

#: Inputs that scale a motion, mutually exclusive.
SCALINGS: Final = ("pga", "pgv", "sa", "scale")


class BlockDescription(NamedTuple):
    """Description of a block: required and optional inputs, and the function of `rocking` that creates the block."""

    name: str
    needed: tuple[str, ...]
    optional: tuple[str, ...]
    make: Callable[..., Block]


#: Each also accepts a restitution.
BLOCK_DESCRIPTIONS: Final = (
    BlockDescription("sizes", ("width", "height"), ("offset", "mass"), Block),
    BlockDescription("half sizes", ("half_width", "half_height"), ("offset", "mass"), Block),
    BlockDescription("parameters", ("p", "alpha"), (), Block.from_parameters),
    BlockDescription("pivots", ("pivots", "height_of_mass", "gyration"), ("mass",), Block.from_pivots),
)

BLOCK_INPUTS: Final = (
    *dict.fromkeys(name for shape in BLOCK_DESCRIPTIONS for name in (*shape.needed, *shape.optional)),
    "restitution",
)

#: Restraints by the names of their inputs. Couples are numbers, the others have parameters.
MOMENT_RESTRAINTS: Final[Mapping[str, Callable[[float], Restraint]]] = {"spring": Spring, "damper": Damper}
FORCE_RESTRAINTS: Final[Mapping[str, Callable[..., Restraint]]] = {"tendon": Tendon, "thrust": Thrust, "load": Load}
SUPPORT_INPUTS: Final = ("one_sided", "lean", "tendon", "spring", "damper", "thrust", "load")
