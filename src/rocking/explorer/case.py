"""A case: a block, a motion and the rules, read from texts, and written as Python and as a command.

The texts are those of the page's address: names of the command line's options and values as people write them
(``alpha=12deg``, ``pga=0.5g``), so that an address says what it shows.
"""

from __future__ import annotations

import functools
import itertools
import math
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from rocking.block import Block
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidBlock, InvalidOption
from rocking.explorer.pulses import is_pulse, pulse_as_python, pulse_as_text, pulse_of
from rocking.explorer.shelf import Shelf
from rocking.model import Model
from rocking.motion import records
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.quantities import angle, length, number, scaling, sides
from rocking.response import Response
from rocking.simulation import simulate
from rocking.treatment import Treatment, treatment

Texts = Mapping[str, str]

#: The case that is shown when nothing is asked for: it chatters, rests and rocks on several times.
DEFAULT: Final[Texts] = {"width": "0.24", "height": "1.1", "motion": "ridgecrest-clc-090", "pga": "0.4g"}

#: Names of the texts of a case.
NAMES: Final = (
    "width", "height", "offset", "p", "alpha", "pivots", "height_of_mass", "gyration", "restitution", "gravity",
    "motion", "channel", "vertical", "dt", "units", "scale", "pga", "pgv", "sa",
    "model", "chattering", "duration", "initial_rotation", "initial_velocity",
)  # fmt: skip

#: Texts that say what a block is, together, and what may go with them.
_BLOCKS: Final[Mapping[tuple[str, ...], tuple[str, ...]]] = {
    ("width", "height"): ("offset",),
    ("p", "alpha"): (),
    ("pivots", "height_of_mass", "gyration"): (),
}

#: Those of a block but its gravity.
BLOCK_NAMES: Final = frozenset({"restitution", *(name for each in _BLOCKS.items() for names in each for name in names)})

#: Product of both restitutions up to which a page waits for the block to come to rest.
_LIVELIEST: Final = 0.998

_LONGEST_TEXT: Final = 300


@dataclass(frozen=True, eq=False)
class Case:
    """What is simulated.

    Attributes
    ----------
    texts : mapping of str to str
        What it was read from.
    block, motion, model, treatment, duration, initial_rotation, initial_velocity
        As for `rocking.simulate`.
    python : str
        How Python makes the motion.
    words : tuple of str
        How the command line names the motion; empty where it cannot.
    """

    texts: Texts
    block: Block
    motion: Motion | None
    model: Model
    treatment: Treatment
    duration: float | None
    initial_rotation: float
    initial_velocity: float
    python: str
    words: tuple[str, ...]

    def simulate(self) -> Response:
        """Return the response."""
        return simulate(
            self.block,
            self.motion,
            model=self.model,
            chattering=self.treatment,
            duration=self.duration,
            initial_rotation=self.initial_rotation,
            initial_velocity=self.initial_velocity,
        )


def read_case(texts: Texts, shelf: Shelf) -> Case:
    """Read a case from texts; those that are not given have the command line's defaults.

    Parameters
    ----------
    texts : mapping of str to str
        Values by `NAMES`; empty ones count as not given. ``motion`` is the name of a shipped record, a pulse
        (``sine:amplitude=0.3g,frequency=1,cycles=2.5``), ``file:KEY``, ``given:KEY`` or ``none``; ``vertical`` the name
        of a shipped record, ``file:KEY``, ``file:KEY#CHANNEL``, or a channel of the motion's own file.
    shelf : Shelf
        Where the files and motions of keys are.

    Raises
    ------
    RockingError
        If a text cannot be read, or the case is impossible; one sentence says which and how to mend it.

    Examples
    --------
    >>> case = read_case({"width": "0.24", "height": "1.1", "motion": "ridgecrest-clc-090", "pga": "0.4g"}, Shelf())
    >>> case.block, round(case.motion.pga, 6)
    (<Block: rectangular block, 0.24 m x 1.1 m; p = 3.6146 rad/s, alpha = 0.21482 rad, restitution = 0.93184>, 3.92266)
    """
    given = _given(texts)
    block = _block(given)
    found = _motion(given, shelf)
    duration = None if "duration" not in given else number(given["duration"], "duration")
    if duration is None and math.prod(side.restitution for side in block.sides) > _LIVELIEST:
        raise InvalidOption(
            f"the product of both restitutions is above {_LIVELIEST:g}, so that the block hardly comes to rest: "
            "lower it, or simulate it in Python"
        )
    model: Any = given.get("model", "nonlinear")
    return Case(
        texts=given,
        block=block,
        motion=found.motion,
        model=model,
        treatment=treatment(given.get("chattering", "certified")),
        duration=duration,
        initial_rotation=angle(given.get("initial_rotation", "0"), "initial_rotation"),
        initial_velocity=number(given.get("initial_velocity", "0"), "initial_velocity"),
        python=found.python,
        words=found.words,
    )


def as_python(case: Case) -> str:
    """Write the case as a script that runs as it stands.

    Examples
    --------
    >>> print(as_python(read_case({"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"}, Shelf())))
    import rocking
    <BLANKLINE>
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2)
    motion = None
    response = rocking.simulate(block, motion, initial_rotation=0.02)
    print(response.summary())
    """
    numbers = {
        "model": None if case.model == "nonlinear" else case.model,
        "chattering": case.texts.get("chattering"),
        "duration": case.duration,
        "initial_rotation": case.initial_rotation or None,
        "initial_velocity": case.initial_velocity or None,
    }
    options = "".join(f", {name}={value!r}" for name, value in numbers.items() if value is not None)
    return "\n".join(
        [
            "import rocking",
            "",
            f"block = rocking.{block_as_python(case.texts)}",
            f"motion = {case.python}",
            f"response = rocking.simulate(block, motion{options})",
            "print(response.summary())",
        ]
    )


def as_command(case: Case) -> str | None:
    """Write the case as a command; None for what the command line does not do.

    Examples
    --------
    >>> as_command(read_case({"p": "2", "alpha": "12deg", "motion": "ridgecrest-clc-090", "sa": "0.4g@1"}, Shelf()))
    'rocking simulate ridgecrest-clc-090 --p 2 --alpha 12deg --sa 0.4g@1'
    """
    if not case.words or "gravity" in case.texts:
        return None
    options = [name for name in NAMES if name in case.texts and name not in ("motion", "vertical")]
    each = ([f"--{name.replace('_', '-')}", case.texts[name]] for name in options)
    return shlex.join(["rocking", "simulate", *case.words, *itertools.chain.from_iterable(each)])


def texts_of(response: Response, shelf: Shelf) -> dict[str, str]:
    """Write a response as the texts of its case, so that the page shows the same one.

    Parameters
    ----------
    response : Response
        Any response.
    shelf : Shelf
        Where its motion is kept if no text can name it.
    """
    block, motion = response.block, response.motion
    texts = _texts_of_block(block)
    texts |= {"motion": "none"} if motion is None else texts_of_motion(motion, shelf)
    if response.model != "nonlinear":
        texts["model"] = response.model
    if str(response.treatment) != str(treatment("certified")):
        texts["chattering"] = str(response.treatment)
    rules = response.trail.rules
    if not rules["endless"]:
        texts["duration"] = repr(float(rules["stop"]))
    rotation, velocity = float(response.rotation(0.0)), float(response.angular_velocity(0.0))
    if rotation or velocity:
        texts |= {"initial_rotation": repr(rotation), "initial_velocity": repr(velocity)}
    return texts


def _texts_of_block(block: Block) -> dict[str, str]:
    """Sizes of a rectangular block, else the parameters of both sides."""
    pairs = {name: [getattr(side, name) for side in block.sides] for name in ("p", "alpha", "restitution")}
    texts = {name: ",".join(repr(value) for value in pair) for name, pair in pairs.items()}
    if block.gravity != STANDARD_GRAVITY:
        texts["gravity"] = repr(block.gravity)
    if block.half_width is None or block.half_height is None:
        return texts
    del texts["p"], texts["alpha"]
    sizes = {"width": 2.0 * block.half_width, "height": 2.0 * block.half_height}
    if block.offset:
        sizes["offset"] = block.offset
    if block.sides == Block(**sizes, gravity=block.gravity).sides:
        del texts["restitution"]
    return {name: repr(size) for name, size in sizes.items()} | texts


def _given(texts: Texts) -> dict[str, str]:
    given = {name: value.strip() for name, value in texts.items() if value.strip()}
    for name, value in given.items():
        if name not in NAMES:
            raise InvalidOption(f"a case has no {name[:40]!r}; it has {', '.join(NAMES)}")
        if len(value) > _LONGEST_TEXT:
            raise InvalidOption(f"{name} is {len(value)} letters long; at most {_LONGEST_TEXT} are read")
    return given or dict(DEFAULT)


def _block(given: Texts) -> Block:
    restitution = None if "restitution" not in given else sides(given["restitution"], "restitution")
    gravity = number(given["gravity"], "gravity") if "gravity" in given else STANDARD_GRAVITY
    told = given.keys() & BLOCK_NAMES - {"restitution"}
    if not any({*all_} <= told <= {*all_, *more} for all_, more in _BLOCKS.items()):
        raise InvalidBlock(
            "a block has either width and height (m) and perhaps offset, or p (rad/s) and alpha, or pivots, "
            "height_of_mass and gyration (m)"
        )
    if "width" in told:
        sizes = {name: number(given[name], name) for name in ("width", "height", "offset") if name in told}
        return Block(**sizes, restitution=restitution, gravity=gravity)
    if "pivots" in told:
        return Block.from_pivots(**_on_pivots(given), restitution=restitution, gravity=gravity)
    return Block.from_parameters(
        sides(given["p"], "p"), sides(given["alpha"], "alpha", angle), restitution, gravity=gravity
    )


def _on_pivots(given: Texts) -> dict[str, Any]:
    """Return what `Block.from_pivots` takes."""
    distances = sides(given["pivots"], "pivots", length)
    return {
        "distances": tuple(distances) if isinstance(distances, list) else (distances, distances),
        "height": length(given["height_of_mass"], "height_of_mass"),
        "radius_of_gyration": length(given["gyration"], "gyration"),
    }


def block_as_python(given: Texts) -> str:
    """Write the call of `rocking` that makes the block."""
    quantities: dict[str, Callable[[str, str], float]] = {"alpha": angle}
    shape = _on_pivots(given) if "pivots" in given else {}
    arguments = shape | {
        name: sides(given[name], name, quantities.get(name, number))
        for name in ("width", "height", "offset", "p", "alpha", "restitution", "gravity")
        if name in given
    }
    written = ", ".join(
        f"{name}={tuple(value) if isinstance(value, list) else value!r}" for name, value in arguments.items()
    )
    maker = "Block" if "width" in given else "Block.from_pivots" if shape else "Block.from_parameters"
    return f"{maker}({written})"


class _Found(NamedTuple):
    """A motion, how Python makes it, and how the command line names it."""

    motion: Motion | None
    python: str
    words: tuple[str, ...]


def _motion(given: Texts, shelf: Shelf) -> _Found:
    target = scaling({name: given.get(name) for name in ("scale", "pga", "pgv", "sa")})
    found = _unscaled(given.get("motion", DEFAULT["motion"]), given, shelf)
    if "vertical" in given:
        found = _with_vertical(found, given, shelf)
    if target is None:
        return found
    if found.motion is None:
        raise InvalidOption("there is no motion to scale: choose one, or leave the scaling out")
    return _Found(_scaled(found.motion, *target), f"{found.python}.{_scaling_as_python(*target)}", found.words)


def _scaling_as_python(level: float, measure: Measure) -> str:
    if measure.name == "factor":
        return f"scaled({level!r})"
    kind = f'rocking.Measure("sa", period={measure.period!r})' if measure.name == "sa" else repr(measure.name)
    return f"scaled_to({level!r}" + ("" if measure.name == "pga" else f", {kind}") + ")"


@functools.lru_cache(maxsize=4)
def _scaled(motion: Motion, level: float, measure: Measure) -> Motion:
    """Scaled motion, made once while only the block is changed."""
    return motion.scaled_to(level, measure)


def _with_vertical(found: _Found, given: Texts, shelf: Shelf) -> _Found:
    """Add the vertical component, which is read with the same step and units as the motion."""
    name, motion = given["vertical"], given.get("motion", DEFAULT["motion"])
    kind, _, key = motion.partition(":")
    if found.motion is None or is_pulse(motion) or kind == "given":
        raise InvalidOption("a vertical component goes with a record: choose one, or leave the component out")
    if name.startswith("file:"):
        other, _, channel = name.removeprefix("file:").partition("#")
        vertical = _from_file(other, {**_told(given), "channel": channel or None}, shelf)
        words = vertical.words if not channel else ()
    elif name in records.names():
        vertical, words = _unscaled(name, {}, shelf), (name,)
    elif kind == "file":
        vertical, words = _from_file(key, {**_told(given), "channel": name}, shelf), (name,)
    else:
        raise InvalidOption(f"there is no shipped record {name[:40]!r} for the vertical component")
    return _Found(
        _together(found.motion, vertical.motion),
        f"{found.python}.with_vertical({vertical.python})",
        (*found.words, "--vertical", *words) if found.words and words else (),
    )


@functools.lru_cache(maxsize=4)
def _together(motion: Motion, vertical: Motion | None) -> Motion:
    """Add a vertical component, made once while only the block is changed."""
    return motion.with_vertical(vertical)


def _unscaled(name: str, given: Texts, shelf: Shelf) -> _Found:
    kind, _, key = name.partition(":")
    if name == "none":
        return _Found(None, "None", ())
    if is_pulse(name):
        return _Found(pulse_of(name), pulse_as_python(name), ("--pulse", name))
    if kind == "given":
        motion = shelf.given(key)
        return _Found(motion, f"...  # {motion.name}: the motion that this page was opened with", ())
    if kind == "file":
        return _from_file(key, _told(given), shelf)
    return _Found(_shipped(name), f"rocking.records.load({name!r})", (name,))


def _from_file(key: str, told: dict[str, Any], shelf: Shelf) -> _Found:
    file = shelf.file(key).name
    written = "".join(f", {each}={value!r}" for each, value in told.items() if value is not None)
    return _Found(shelf.read(key, **told), f"rocking.read({file!r}{written})", (file,))


@functools.cache
def _shipped(name: str) -> Motion:
    """Shipped record, read once."""
    return records.load(name)


def _told(given: Texts) -> dict[str, Any]:
    """Return what a file does not say by itself, as `rocking.read` takes it."""
    dt = None if "dt" not in given else number(given["dt"], "dt")
    return {"channel": given.get("channel"), "dt": dt, "units": given.get("units")}


def texts_of_motion(motion: Motion, shelf: Shelf) -> dict[str, str]:
    """Text of a pulse, or of a shipped record and its scale, or else of the key under which the motion is kept."""
    pulse = pulse_as_text(motion)
    if pulse is not None:
        return {"motion": pulse}
    if motion.name in records.names():
        factor = _factor_of(motion, records.load(motion.name))
        if factor is not None:
            return {"motion": motion.name} | ({} if factor == 1.0 else {"scale": repr(factor)})
    return {"motion": f"given:{shelf.give(motion)}"}


def _factor_of(motion: Motion, base: Motion) -> float | None:
    """Factor that makes one motion of the other, bit for bit; None if there is none."""
    if motion.vertical is not None:
        return None
    if not np.array_equal(motion.breakpoints, base.breakpoints) or motion.coefficients.shape != base.coefficients.shape:
        return None
    largest = np.unravel_index(np.argmax(np.abs(base.coefficients)), base.coefficients.shape)
    factor = float(motion.coefficients[largest] / base.coefficients[largest])
    return factor if np.array_equal(base.coefficients * factor, motion.coefficients) else None
