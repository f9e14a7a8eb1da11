"""What the page offers: numbers with units, ranges and explanations, pulses, records, treatments, axes of maps."""

from __future__ import annotations

import functools
from dataclasses import asdict, dataclass
from typing import Any, Final

from rocking.constants import VERSION
from rocking.explorer.case import DEFAULT
from rocking.explorer.maps import AXES
from rocking.motion import records
from rocking.motion.formats.units import CHOICES


@dataclass(frozen=True)
class Number:
    """A number that a slider and a field set.

    Attributes
    ----------
    name, label, unit : str
        Name of its text, what the page calls it, and the unit that is shown.
    suffix : str
        What the text has behind the number: "deg", "g", or nothing for SI units.
    low, high, start : float
        Ends of the slider, and where it starts.
    logarithmic : bool
        Whether equal ways on the slider are equal ratios.
    words : str
        What it is.
    """

    name: str
    label: str
    unit: str
    low: float
    high: float
    start: float
    suffix: str = ""
    logarithmic: bool = False
    words: str = ""


BLOCK: Final = (
    Number("width", "Width", "m", 0.02, 5.0, 0.24, logarithmic=True, words="Full width 2b of a rectangular block."),
    Number("height", "Height", "m", 0.1, 20.0, 1.1, logarithmic=True, words="Full height 2h of a rectangular block."),
    Number(
        "offset", "Offset of the centre of mass", "m", -0.25, 0.25, 0.0,
        words="How far the centre of mass is off the middle of the width, to the right (side +); a quarter of the "
        "width at most. The two sides then differ.",
    ),
    Number(
        "pivots", "Distance of the pivot", "m", 0.01, 2.5, 0.15, logarithmic=True,
        words="Horizontal distance of the corner from the centre of mass.",
    ),
    Number(
        "height_of_mass", "Height of the centre of mass", "m", 0.05, 10.0, 0.55, logarithmic=True,
        words="Above the corners.",
    ),
    Number(
        "gyration", "Radius of gyration", "m", 0.02, 8.0, 0.33, logarithmic=True,
        words="About the centre of mass: the square root of the moment of inertia over the mass.",
    ),
    Number(
        "p", "Frequency parameter p", "rad/s", 0.3, 12.0, 3.61, logarithmic=True,
        words="How fast the block tips: p² = 3g/4R for a rectangle with half diagonal R. Large blocks have a small p. "
        "It is not a frequency of vibration: a rocking block has none.",
    ),
    Number(
        "alpha", "Slenderness α", "°", 1.0, 40.0, 12.3, "deg",
        words="Angle between the vertical and the line from a corner to the centre of mass. The block lifts when the "
        "ground acceleration passes g tan α, and stands on its corner in balance when it is rotated by α.",
    ),
    Number(
        "restitution", "Restitution η", "", 0.5, 0.99, 0.93,
        words="Angular speed just after an impact over the speed just before. Housner's value, 1 − 1.5 sin² α, keeps "
        "the angular momentum about the new corner; that of two different sides follows from both p and α.",
    ),
)  # fmt: skip

SCALES: Final = (
    Number("pga", "Peak acceleration", "g", 0.05, 2.0, 0.4, "g", True, "Largest ground acceleration (PGA)."),
    Number("pgv", "Peak velocity", "m/s", 0.05, 3.0, 0.5, "", True, "Largest ground velocity (PGV)."),
    Number(
        "sa", "Spectral acceleration", "g", 0.05, 4.0, 0.5, "g", True,
        "Peak response of an oscillator of the period below, 5 % damped.",
    ),
    Number("scale", "Factor", "", 0.1, 10.0, 1.0, "", True, "Every acceleration times this; negative turns it round."),
)  # fmt: skip

PERIOD: Final = Number("period", "at a period of", "s", 0.05, 5.0, 1.0, "", True, "Period of that oscillator.")

_AMPLITUDE = Number("amplitude", "Amplitude", "g", 0.02, 2.0, 0.3, "g", True, "Largest acceleration of the pulse.")
_FREQUENCY = Number("frequency", "Frequency", "Hz", 0.1, 10.0, 1.0, "", True, "Cycles a second.")
_DURATION = Number("duration", "Duration", "s", 0.05, 5.0, 0.5, "", True, "How long it lasts.")
_CYCLES = Number("cycles", "Cycles", "", 0.5, 20.0, 2.5, words="Duration times frequency; need not be whole.")
_PHASE = Number("phase", "Phase", "°", 0.0, 360.0, 0.0, "deg", words="Where in its cycle it begins.")
_VELOCITY = Number(
    "amplitude", "Velocity amplitude", "m/s", 0.05, 3.0, 0.6, "", True, "Amplitude of the velocity pulse."
)
_GAMMA = Number("gamma", "Length γ", "cycles", 1.0, 6.0, 2.0, words="How many cycles its envelope holds.")

#: Numbers of each pulse, and choices.
PULSES: Final[dict[str, dict[str, Any]]] = {
    "sine": {"label": "Sine", "numbers": (_AMPLITUDE, _FREQUENCY, _CYCLES, _PHASE)},
    "half-sine": {"label": "Half sine", "numbers": (_AMPLITUDE, _FREQUENCY)},
    "one-sine": {"label": "One sine", "numbers": (_AMPLITUDE, _FREQUENCY)},
    "one-cosine": {"label": "One cosine", "numbers": (_AMPLITUDE, _FREQUENCY)},
    "ricker": {
        "label": "Ricker",
        "numbers": (_AMPLITUDE, _FREQUENCY),
        "choices": {"kind": ("symmetric", "antisymmetric")},
    },
    "mavroeidis-papageorgiou": {
        "label": "Mavroeidis–Papageorgiou (near fault)",
        "numbers": (_VELOCITY, _FREQUENCY, _PHASE, _GAMMA),
    },
    "rectangular": {"label": "Rectangular", "numbers": (_AMPLITUDE, _DURATION)},
    "triangular": {"label": "Triangular", "numbers": (_AMPLITUDE, _DURATION)},
}

START: Final = (
    Number(
        "initial_rotation", "Release from a rotation of", "°", -20.0, 20.0, 0.0, "deg",
        words="Rotation at time zero; positive leans to the right corner.",
    ),
)  # fmt: skip

#: How chattering may be ended, with the threshold that the page starts with.
TREATMENTS: Final = (
    {"name": "certified", "label": "Proof", "words": "Rest where it is proven that the impacts accumulate."},
    {
        "name": "velocity",
        "label": "Velocity threshold",
        "number": asdict(Number("limit", "Threshold over pα", "", 1e-9, 0.1, 0.05, "", True)),
        "words": "Rest as soon as an impact leaves less speed than this.",
    },
    {
        "name": "interval",
        "label": "Interval threshold",
        "number": asdict(Number("limit", "Threshold", "s", 1e-9, 0.1, 1e-3, "", True)),
        "words": "Rest as soon as two impacts follow each other within this time.",
    },
    {
        "name": "time",
        "label": "Asymptotic time (Eq. 65)",
        "words": "Rest once the paper's asymptotic chattering time has passed; for a sine only.",
    },
)

#: Quantities of a map.
QUANTITIES: Final = (
    {"name": "outcome", "label": "Chattering: complete or not"},
    {"name": "rest", "label": "Time from uplift to rest"},
    {"name": "peak", "label": "Peak rotation over slenderness"},
    {"name": "mode", "label": "Overturning mode"},
)


@functools.cache
def offers() -> dict[str, Any]:
    """Return all of this in plain values."""
    return {
        "version": VERSION,
        "default": dict(DEFAULT),
        "block": [asdict(number) for number in BLOCK],
        "scales": [asdict(number) for number in SCALES],
        "period": asdict(PERIOD),
        "start": [asdict(number) for number in START],
        "pulses": {
            name: {**pulse, "numbers": [asdict(number) for number in pulse["numbers"]]}
            for name, pulse in PULSES.items()
        },
        "records": [_record(name) for name in records.names()],
        "units": list(CHOICES),
        "treatments": list(TREATMENTS),
        "axes": [asdict(axis) for axis in AXES.values()],
        "quantities": list(QUANTITIES),
    }


def _record(name: str) -> dict[str, str]:
    record = records.info(name)
    return {"name": name, "event": record.event, "station": record.station, "direction": record.direction}
