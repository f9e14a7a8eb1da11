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


_SIDED = {"p": (1.5, 5.0), "alpha": (0.1, 0.35), "restitution": (0.6, 0.95)}
_SCALINGS = ("pga", "pgv", "sa", "scale", "")
_PULSES = (
    "sine:amplitude={a}g,frequency={f},cycles={c},phase={d}deg", "half-sine:amplitude={a}g,frequency={f}",
    "one-sine:amplitude={a}g,frequency={f}", "one-cosine:amplitude={a}g,frequency={f}",
    "ricker:amplitude={a}g,frequency={f},kind=antisymmetric", "rectangular:amplitude={a}g,duration={c}",
    "triangular:amplitude={a}g,duration={c}",
    "mavroeidis-papageorgiou:amplitude={a},frequency={f},phase={d}deg,gamma={c}",
)  # fmt: skip
_HORIZONTAL = ("ridgecrest-clc-090", "ridgecrest-clc-360", "el-centro-meloland-270", "el-centro-meloland-360")


def sound(draw, number):
    """Texts of a case that the command line does, too: blocks and motions of every kind in turn, by a number."""

    def between(low, high):
        return repr(draw.uniform(low, high))

    def pair(name):
        return ",".join(between(*_SIDED[name]) for _ in range(2))

    width = draw.uniform(0.15, 0.5)
    block = (
        lambda: {"width": repr(width), "height": between(0.8, 2.5)},
        lambda: {"width": repr(width), "height": between(0.8, 2.5), "offset": repr(draw.uniform(-0.2, 0.2) * width)},
        lambda: {name: between(*ends) for name, ends in _SIDED.items()},
        lambda: {name: pair(name) for name in _SIDED},
        lambda: {"pivots": f"{between(0.1, 0.2)},{between(0.1, 0.2)}", "height_of_mass": between(0.5, 0.9),
                 "gyration": between(0.3, 0.5)},
        lambda: {"mesh": "statue", "azimuth": repr(float(draw.randrange(360)))},
    )[number % 6]()  # fmt: skip
    if number % 2:
        values = {"a": between(0.15, 0.5), "f": between(0.8, 2.5), "c": between(1.0, 2.5), "d": between(0.0, 90.0)}
        motion = {"motion": _PULSES[number // 2 % len(_PULSES)].format(**values)}
    else:
        motion = {"motion": draw.choice(_HORIZONTAL)}
        scaling = _SCALINGS[number // 2 % len(_SCALINGS)]
        level = between(0.2, 0.7)
        if scaling:
            motion[scaling] = {"pga": f"{level}g", "sa": f"{level}g@{between(0.3, 1.5)}"}.get(scaling, level)
        if number // 2 % 3 != 1:
            motion["vertical"] = motion["motion"][:-3] + "up"
    more = {}
    if draw.random() < 0.4:
        more["model"] = "linear"
    if draw.random() < 0.3:
        more["chattering"] = draw.choice(("velocity=0.02", "interval=0.001"))
    if draw.random() < 0.4:
        more |= {"initial_rotation": between(-0.04, 0.04), "initial_velocity": between(-0.2, 0.2)}
    if number % 2 and draw.random() < 0.2:
        more["duration"] = between(3.0, 9.0)
    return block | motion | more
