"""Addresses of the explorer's page as nobody writes them on purpose: names and values right, wrong and missing."""

import math

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
    "view": ("shake", "map", "periodic", "assess", "constructor"),
    "x": ("p", "omega", "constructor"),
    "quantity": ("mode", "rest", "hasOwnProperty"),
    "points": ("8", "0", "abc"),
    "from": ("0", "1", "-1e9", "5", "abc"),
    "to": ("1e-300", "2", "1e300", "Infinity", "6"),
    "sweep": ("a", "omega", "valueOf"),
    "sweep_points": ("8", "-1"),
    "other": ("motion=none", "width=0.5&height=1&chattering=velocity%3D0.05", "constructor", "width=abc"),
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


_SIDED = {"p": (1.5, 5.0), "alpha": (0.1, 0.35), "restitution": (0.6, 0.95)}
_PULSES = (
    "sine:amplitude={a}g,frequency={f},cycles={c},phase={d}deg", "half-sine:amplitude={a}g,frequency={f}",
    "one-sine:amplitude={a}g,frequency={f}", "one-cosine:amplitude={a}g,frequency={f}",
    "ricker:amplitude={a}g,frequency={f},kind=antisymmetric", "ricker:amplitude={a}g,frequency={f}",
    "rectangular:amplitude={a}g,duration={c}", "triangular:amplitude={a}g,duration={c}",
    "mavroeidis-papageorgiou:amplitude={a},frequency={f},phase={d}deg,gamma={c}",
    "sine:amplitude=-{a}g,frequency={f},cycles={c}",
)  # fmt: skip
_HORIZONTAL = ("ridgecrest-clc-090", "ridgecrest-clc-360", "el-centro-meloland-270", "el-centro-meloland-360")
_LENGTHS = {"": 1.0, " m": 1.0, "cm": 100.0, "mm": 1000.0, " ft": 1.0 / 0.3048, "in": 1.0 / 0.0254}
_ANGLES = {"": 1.0, "rad": 1.0, "deg": 180.0 / math.pi, "°": 180.0 / math.pi}
_ACCELERATIONS = {"g": 1.0, "": 9.80665, " m/s2": 9.80665, "cm/s2": 980.665}


def _written(draw, low, high, units):
    """A number between two ends, with a unit in which people may write it."""
    unit, size = draw.choice(list(units.items()))
    return f"{size * draw.uniform(low, high)!r}{unit}"


def _block(draw):
    """Texts of a block of any kind, by its sizes, by p and alpha, of two sides, by its pivots, of a mesh."""

    def length(low, high):
        return _written(draw, low, high, _LENGTHS)

    kind = draw.choice(("sizes", "off the middle", "p and alpha", "two sides", "pivots", "mesh"))
    if kind in ("sizes", "off the middle"):
        texts = {"width": length(0.15, 0.5), "height": length(0.8, 2.5)}
        if kind == "off the middle":
            texts["offset"] = length(-0.03, 0.03)
        elif draw.random() < 0.4:
            texts["restitution"] = repr(draw.uniform(*_SIDED["restitution"]))
        return texts
    if kind == "pivots":
        pair = ",".join(length(0.1, 0.2) for _ in range(2))
        return {"pivots": pair, "height_of_mass": length(0.5, 0.9), "gyration": length(0.3, 0.5)}
    if kind == "mesh":
        return {"mesh": "statue", "azimuth": repr(float(draw.randrange(360)))}
    texts = {}
    for name, ends in _SIDED.items():
        units = _ANGLES if name == "alpha" else {"": 1.0}
        count = draw.choice((1, 2)) if kind == "two sides" else 1  # what is one number is that of both sides
        texts[name] = ",".join(_written(draw, *ends, units) for _ in range(count))
    if kind == "p and alpha" and draw.random() < 0.5:
        del texts["restitution"]
    return texts


def _motion(draw):
    """Texts of a pulse, or of a record that is scaled in any way or not, with its vertical component or without."""
    level = draw.uniform(0.2, 0.7)
    if draw.random() < 0.5:
        values = {"a": draw.uniform(0.15, 0.5), "f": draw.uniform(0.8, 2.5), "c": draw.uniform(1.0, 2.5)}
        texts = {"motion": draw.choice(_PULSES).format(**values, d=draw.uniform(0.0, 90.0))}
        return texts | ({"duration": repr(draw.uniform(3.0, 9.0))} if draw.random() < 0.2 else {})
    texts = {"motion": draw.choice(_HORIZONTAL)}
    scaling = draw.choice(("pga", "pgv", "sa", "scale", ""))
    if scaling:
        texts[scaling] = {
            "pga": _written(draw, 0.2, 0.7, _ACCELERATIONS), "pgv": repr(level),
            "sa": f"{level!r}g@{draw.uniform(0.3, 1.5)!r}", "scale": repr(draw.choice((-2.0, 2.0)) * level),
        }[scaling]  # fmt: skip
    if draw.random() < 0.5:
        texts["vertical"] = texts["motion"][:-3] + "up"
    return texts


def sound(draw):
    """Texts of a case that the command line does, too: any block and any motion, the model, what ends chattering."""
    texts = _block(draw) | _motion(draw)
    if draw.random() < 0.4:
        texts["model"] = "linear"
    if draw.random() < 0.3:
        texts["chattering"] = draw.choice(("velocity=0.02", "interval=0.001", "bypass=0.001", "certified=1e-9"))
    if draw.random() < 0.4:
        texts["initial_rotation"] = _written(draw, -0.04, 0.04, _ANGLES)
        texts["initial_velocity"] = repr(draw.uniform(-0.2, 0.2))
    return texts
