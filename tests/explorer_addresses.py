"""Addresses of the explorer's page as nobody writes them on purpose: names and values right, wrong and missing."""

_BLOCKS = (
    {"width": "0.24", "height": "1.1"}, {"p": "2", "alpha": "12deg"},
    {"p": "2,2.2", "alpha": "0.2,0.3", "restitution": "0.9"},
    {"pivots": "0.15,0.1", "height_of_mass": "0.55", "gyration": "0.33"}, {"width": "0.24"}, {},
)  # fmt: skip
_MOTIONS = (
    "none", "none", "ridgecrest-clc-090", "sine:amplitude=0.4g,frequency=1,cycles=2.5",
    "ricker:amplitude=0.5g,frequency=2", "rectangular:amplitude=0.1g,duration=0.5", "sine:", "sine",
    "sine:amplitude", "constructor", "toString:a=1",
    "file:00ff", "given:00ff", "file:", "",
)  # fmt: skip
_NUMBERS = (
    "0",
    "1",
    "0.1",
    "-1",
    "3deg",
    "0.4g",
    "1e-300",
    "1e300",
    "inf",
    "nan",
    "abc",
    "1,2,3",
    "50 cm",
    "%",
    "2@0.5",
    "<b>",
)
_NAMES = (
    "pga", "scale", "sa", "pgv", "offset", "restitution", "gravity", "duration", "initial_rotation", "initial_velocity",
    "dt", "units", "channel", "vertical", "alpha", "width",
)  # fmt: skip
_CHOICES = {
    "model": ("linear", "nonlinear", "prototype"),
    "chattering": ("certified", "velocity=0.05", "interval=abc", "toString=1", "time", "velocity"),
}

#: What only the page reads.
_SHOWN = {
    "view": ("response", "block", "map", "periodic", "compare", "constructor"),
    "compare": ("treatment", "block", "motion", "toString"),
    "x": ("p", "omega", "constructor"),
    "quantity": ("mode", "rest", "hasOwnProperty"),
    "points": ("8", "0", "abc"),
    "from": ("0", "1", "-1e9", "5", "abc"),
    "to": ("1e-300", "2", "1e300", "Infinity", "6"),
    "sweep": ("a", "omega", "valueOf"),
    "sweep_points": ("8", "-1"),
    "other.motion": ("none", "constructor", "sine:amplitude=0.4g,frequency=1,cycles=2.5"),
    "other.chattering": ("velocity=0.05", "valueOf=3"),
    "other.width": ("0.5", "abc"),
}


def case(draw):
    """Texts of a case, drawn by a `random.Random`."""
    texts = dict(draw.choice(_BLOCKS))
    if draw.random() < 0.9:
        texts["motion"] = draw.choice(_MOTIONS)
    for name in draw.sample(_NAMES, draw.choice((0, 0, 1, 2))):
        texts[name] = draw.choice(_NUMBERS)
    for name, choices in _CHOICES.items():
        if draw.random() < 0.25:
            texts[name] = draw.choice(choices)
    return texts


def shown(draw):
    """What an address says besides of what is shown, drawn likewise."""
    return {name: draw.choice(choices) for name, choices in _SHOWN.items() if draw.random() < 0.4}
