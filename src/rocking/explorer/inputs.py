"""What is simulated, read from texts, and written as texts again.

The texts are those of the page's address: names of the command line's options and values as people write them
(``alpha=12deg``, ``pga=0.5g``), so that an address says what it shows.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from rocking import checks
from rocking.block import Block
from rocking.constants import STANDARD_GRAVITY, Model
from rocking.errors import InvalidBlock, InvalidMotion, InvalidOption
from rocking.explorer.meshes import Body, pivots_of
from rocking.explorer.parameters import DEFAULT, PARAMETERS, PULSES, SCALINGS, SHAPES, names_of
from rocking.explorer.uploads import UploadStore
from rocking.motion import records
from rocking.motion.motion import Motion
from rocking.motion.piecewise import STRONGEST, TOO_STRONG
from rocking.motion.scaling import Measure
from rocking.named_pulses import FAMILIES, pulse_values
from rocking.quantities import acceleration, scaling
from rocking.response import Response, trail_of
from rocking.simulation import simulate
from rocking.treatment import Treatment, treatment

Texts = Mapping[str, str]

#: What reads a text of a case has: numbers in SI units, and texts.
Values = Mapping[str, Any]

#: Names of the texts of a case, and of those that describe its block.
NAMES: Final = tuple(PARAMETERS)
BLOCK_NAMES: Final = frozenset(names_of("block"))

#: Product of both restitutions up to which a page waits for the block to come to rest.
_LIVELIEST: Final = 0.998

_LONGEST_TEXT: Final = 300

#: Letters of a key in the name of a variable.
_TOLD_APART: Final = 6

#: Longest pulse, cycles: a page shows no more, and memory is bounded.
MOST_SHOWN: Final = 1000.0

#: Shortest duration, s: below it arithmetic, and not mechanics, says what is shown.
_SHORTEST: Final = 1e-12

#: What makes a block of each shape, its name in `rocking`, and what it calls the parameters.
_MAKERS: Final[Mapping[str, tuple[Callable[..., Block], str]]] = {
    "sizes": (Block, "Block"),
    "parameters": (Block.from_parameters, "Block.from_parameters"),
    "pivots": (Block.from_pivots, "Block.from_pivots"),
}
_ARGUMENTS: Final = {"pivots": "distances", "height_of_mass": "height", "gyration": "radius_of_gyration"}


@dataclass(frozen=True, eq=False)
class Case:
    """What `rocking.simulate` takes, with the texts from which it was read.

    ``block_call`` and ``motion_call`` are the expressions that make block and motion, with the line that the latter
    needs before it, if any, in ``motion_before``; ``block_options`` are the options that describe the block on the
    command line, and ``words`` the arguments that name the motion: none where it cannot be named. The block of a mesh
    has the ``body`` of which it is the plane of an ``azimuth``, degrees.
    """

    texts: Texts
    block: Block
    motion: Motion | None
    model: Model
    treatment: Treatment
    duration: float | None
    initial_rotation: float
    initial_velocity: float
    block_call: str
    block_options: Texts
    body: Body | None
    azimuth: float
    motion_call: str
    motion_before: str
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


def read_case(texts: Texts, uploads: UploadStore) -> Case:
    """Read what is simulated from texts; those that are not given have the command line's defaults.

    Parameters
    ----------
    texts : mapping of str to str
        Values by the names of `PARAMETERS`; empty ones count as not given. ``motion`` is the name of a shipped record,
        a pulse (``sine:amplitude=0.3g,frequency=1,cycles=2.5``), ``file:KEY``, ``given:KEY`` or ``none``; ``vertical``
        is the name of a shipped record, ``file:KEY``, ``file:KEY#CHANNEL``, or a channel of the motion's own file;
        ``mesh`` is the name of a shipped mesh, or ``file:KEY``.
    uploads : UploadStore
        Where the files and motions of keys are.

    Examples
    --------
    >>> texts = {"width": "0.24", "height": "1.1", "motion": "ridgecrest-clc-090", "pga": "0.4g"}
    >>> case = read_case(texts, UploadStore())
    >>> case.block, round(case.motion.pga, 6)
    (<Block: rectangular block, 0.24 m x 1.1 m; p = 3.6146 rad/s, alpha = 0.21482 rad, restitution = 0.93184>, 3.92266)
    """
    given = _given(texts)
    values = {name: PARAMETERS[name].read(text) for name, text in given.items()}
    found_block = _block(given, values, uploads)
    block = found_block.block
    found = _motion(given, values, uploads)
    if "duration" not in values:
        require_rest(block)
    elif values["duration"] < _SHORTEST:
        raise InvalidOption(f"{{}} must be {_SHORTEST:g} s or more here", "duration", value=values["duration"])
    return Case(
        texts=given,
        block=block,
        motion=found.motion,
        model=values.get("model", "nonlinear"),
        treatment=treatment(values.get("chattering", "certified")),
        duration=values.get("duration"),
        initial_rotation=values.get("initial_rotation", 0.0),
        initial_velocity=values.get("initial_velocity", 0.0),
        block_call=found_block.python,
        block_options=found_block.options,
        body=found_block.body,
        azimuth=values.get("azimuth", 0.0),
        motion_call=found.python,
        motion_before=found.before,
        words=found.words,
    )


def require_rest(block: Block) -> None:
    """Raise `InvalidOption` unless a block comes to rest soon enough for a page to wait for it."""
    if math.prod(side.restitution for side in block.sides) > _LIVELIEST:
        raise InvalidOption(
            f"the product of {{}} on both sides is above {_LIVELIEST:g}, so that the block hardly comes to rest: lower "
            "it, or simulate it in Python",
            "restitution",
        )


def require_possible(peak: float) -> None:
    """Refuse the strongest peak acceleration, m/s^2, of motions that are still to be made where none can have it."""
    if peak > STRONGEST:
        raise InvalidMotion(TOO_STRONG)


def texts_of(response: Response, uploads: UploadStore) -> dict[str, str]:
    """Write a response as the texts of its case; the store keeps its motion if no text can name it."""
    block, motion = response.block, response.motion
    texts = _texts_of_block(block)
    texts |= {"motion": "none"} if motion is None else texts_of_motion(motion, uploads)
    if response.model != "nonlinear":
        texts["model"] = response.model
    if str(response.treatment) != str(treatment("certified")):
        texts["chattering"] = str(response.treatment)
    rules = trail_of(response).rules
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
    """Texts that are not empty, of names that a case has."""
    given = {name: value.strip() for name, value in texts.items() if value.strip()}
    for name, value in given.items():
        if name not in NAMES:
            raise InvalidOption(f"a case has no {name[:40]!r}; it has {', '.join(NAMES)}")
        if len(value) > _LONGEST_TEXT:
            raise InvalidOption(f"{{}} is {len(value)} letters long; at most {_LONGEST_TEXT} are read", name)
    return {"motion": DEFAULT["motion"], **given} if given else dict(DEFAULT)


class _FoundBlock(NamedTuple):
    """A block, how `rocking` makes it in Python, its options on the command line, and the body that it is of."""

    block: Block
    python: str
    options: Texts
    body: Body | None = None


def _block(given: Texts, values: Values, uploads: UploadStore) -> _FoundBlock:
    """Make the block."""
    chosen = values.keys() & BLOCK_NAMES - {"restitution"}
    shape = next((each for each in SHAPES if {*each.needed} <= chosen <= {*each.needed, *each.optional}), None)
    if shape is None:
        raise InvalidBlock(
            "a block has either {} and {} (m) and perhaps {}, or {} (rad/s) and {}, or {}, {} and {} (m), or {} and "
            "{} (degrees)",
            *(name for each in SHAPES[:-1] for name in (*each.needed, *each.optional)),
            *SHAPES[-1].needed,
        )
    if shape.name == "mesh":
        return _of_mesh(given, values, uploads)
    names = (*shape.needed, *shape.optional, "restitution", "gravity")
    arguments = {_ARGUMENTS.get(name, name): values[name] for name in names if name in values}
    if isinstance(arguments.get("distances"), float):
        arguments["distances"] = (arguments["distances"],) * 2
    make, name = _MAKERS[shape.name]
    options = {each: given[each] for each in NAMES if each in BLOCK_NAMES and each in given}
    return _FoundBlock(make(**arguments), f"{name}({_written(arguments)})", options)


def _of_mesh(given: Texts, values: Values, uploads: UploadStore) -> _FoundBlock:
    """Make the block that the body of a mesh is in the plane of an azimuth."""
    body = uploads.meshes.body(given["mesh"], given, values.get("tolerance"), values.get("gravity"))
    azimuth, restitution = values["azimuth"], values.get("restitution")
    block = body.solid.block(azimuth, restitution=restitution)
    distances, height, gyration = pivots_of(body, azimuth)
    options = {"pivots": ",".join(map(repr, distances)), "height_of_mass": repr(height), "gyration": repr(gyration)}
    if restitution is not None:
        options["restitution"] = given["restitution"]
    python = f"{body.call}.block({azimuth!r}" + ("" if restitution is None else f", restitution={restitution!r}") + ")"
    return _FoundBlock(block, python, options, body)


def _written(arguments: Mapping[str, Any]) -> str:
    """Arguments of a call, as Python writes them."""
    return ", ".join(f"{name}={value!r}" for name, value in arguments.items())


class Found(NamedTuple):
    """A motion, how Python makes it, how the command line names it, and the line that Python needs before it."""

    motion: Motion | None
    python: str
    words: tuple[str, ...]
    before: str = ""


def read_motion(texts: Texts, uploads: UploadStore) -> Found:
    """Read the texts of a motion alone, as `read_case` does those of a case."""
    given = {name: text for name, text in _given(texts).items() if name in names_of("motion")}
    return _motion(given, {name: PARAMETERS[name].read(text) for name, text in given.items()}, uploads)


def _motion(given: Texts, values: Values, uploads: UploadStore) -> Found:
    target = scaling({name: given[name] for name in SCALINGS if name in given}, _level)
    name = values["motion"]
    found = _unscaled(name, values, uploads)
    if "vertical" in values:
        found = _with_vertical(found, name, values, uploads)
    if target is not None:
        if found.motion is None:
            raise InvalidOption("there is no motion to scale: choose one, or leave the scaling out")
        python = f"{found.python}.{_scaling_as_python(*target)}"
        found = found._replace(motion=_scaled(found.motion, *target), python=python)
    return found


def _level(text: str, name: str) -> float:
    return checks.positive(acceleration(text, name), name, InvalidOption, "m/s^2")


def _scaling_as_python(level: float, measure: Measure) -> str:
    if measure.name == "factor":
        return f"scaled({level!r})"
    kind = f'rocking.Measure("sa", period={measure.period!r})' if measure.name == "sa" else repr(measure.name)
    return f"scaled_to({level!r}" + ("" if measure.name == "pga" else f", {kind}") + ")"


# These are made once while only the block is changed.
_scaled = functools.lru_cache(maxsize=4)(Motion.scaled_to)
_together = functools.lru_cache(maxsize=4)(Motion.with_vertical)
_shipped = functools.cache(records.load)


def _with_vertical(found: Found, horizontal: str, values: Values, uploads: UploadStore) -> Found:
    """Add the vertical component."""
    name, (kind, _, key) = values["vertical"], horizontal.partition(":")
    if found.motion is None or is_pulse(horizontal) or kind == "given":
        raise InvalidOption("{} goes with a record: choose one, or leave the component out", "vertical")
    if name.startswith("file:"):
        other, _, channel = name.removeprefix("file:").partition("#")
        vertical = _from_file(other, values, channel or None, uploads)
        words = vertical.words if not channel else ()
    elif name in records.names():
        vertical, words = _unscaled(name, {}, uploads), (name,)
    elif kind == "file":
        vertical, words = _from_file(key, values, name, uploads), (name,)
    else:
        raise InvalidOption(f"{{}}: there is no shipped record {name[:40]!r}", "vertical", value=name)
    return Found(
        _together(found.motion, vertical.motion),
        f"{found.python}.with_vertical({vertical.python})",
        (*found.words, *as_option("vertical", *words)) if found.words and words else (),
    )


def _unscaled(name: str, values: Values, uploads: UploadStore) -> Found:
    kind, _, key = name.partition(":")
    if name == "none":
        return Found(None, "None", ())
    if is_pulse(name):
        call = pulse_call(name, {parameter: repr(value) for parameter, value in arguments_of(name).items()})
        return Found(pulse_of(name), call, ("--pulse", name))
    if kind == "given":
        motion = uploads.motion(key)
        name = "".join(letter for letter in motion.name if letter.isprintable())  # a new line would end the comment
        variable = f"given_{key[:_TOLD_APART]}"
        return Found(motion, variable, (), f"{variable} = ...  # {name}: the motion that this page was opened with")
    if kind == "file":
        return _from_file(key, values, values.get("channel"), uploads)
    return Found(_shipped(name), f"rocking.records.load({name!r})", (name,))


def _from_file(key: str, values: Values, channel: str | None, uploads: UploadStore) -> Found:
    """Read a channel of a file with the step and the units that the texts give.

    Where the vertical component is a record of its own, these are for the file that does not say them, as the command
    line has it.
    """
    given: dict[str, Any] = {name: values[name] for name in ("dt", "units") if name in values}
    vertical = values.get("vertical", "")
    if vertical.startswith("file:") or vertical in records.names():
        given = {name: value for name, value in given.items() if name in uploads.contents(key)["missing"]}
    file, read = uploads.file(key).name, {"channel": channel, "dt": None, "units": None} | given
    arguments = _written({name: value for name, value in read.items() if value is not None})
    call = f"rocking.read({file!r}{', ' if arguments else ''}{arguments})"
    return Found(uploads.read(key, **read), call, (as_path(file),))


def as_path(name: str) -> str:
    """Write the name of a file as an argument that no program takes for an option, or for standard input."""
    return f"./{name}" if name.startswith("-") else name


def as_option(name: str, value: str) -> tuple[str, ...]:
    """Write an option and its value, in one word where the value alone would be taken for another option.

    Examples
    --------
    >>> as_option("channel", "HNE"), as_option("channel", "--out")
    (('--channel', 'HNE'), ('--channel=--out',))
    """
    written = f"--{name.replace('_', '-')}"
    return (f"{written}={value}",) if value.startswith("-") else (written, value)


def is_pulse(text: str) -> bool:
    """Whether a text names a pulse that the page has."""
    return text.partition(":")[0] in PULSES


def arguments_of(text: str) -> dict[str, Any]:
    """Read the parameters of a pulse, in SI units; one that is longer than the page shows is refused.

    A duration is given only where it cuts the pulse: the one that a pulse has by itself goes with its frequency.

    Examples
    --------
    >>> arguments_of("sine:amplitude=2, frequency=1Hz, cycles=5,")
    {'amplitude': 2.0, 'frequency': 1.0, 'cycles': 5.0}
    """
    family, arguments = pulse_values(text)
    for name in ("cycles", "gamma"):
        if arguments.get(name, 0.0) > MOST_SHOWN:
            raise InvalidMotion(
                f"{{}} of a pulse may be {MOST_SHOWN:g} here at most, not {arguments[name]:g}",
                name,
                value=arguments[name],
            )
    if "duration" in arguments and "duration" in family.optional:
        whole = {name: value for name, value in arguments.items() if name != "duration"}
        return whole if family.motion(whole).duration == arguments["duration"] else arguments
    return arguments


def pulse_text(text: str, arguments: Mapping[str, Any]) -> str:
    """Write a pulse of the family of a text with these parameters, in SI units."""
    written = ",".join(f"{name}={value}" for name, value in arguments.items())
    return f"{pulse_values(text)[0].name}:{written}"


def pulse_of(text: str) -> Motion:
    """Make the pulse that a text names."""
    return pulse_values(text)[0].motion(arguments_of(text))


def pulse_call(text: str, arguments: Mapping[str, str]) -> str:
    """Write the call that makes a pulse of the same family with these arguments, as Python has them."""
    written = ", ".join(f"{name}={value}" for name, value in arguments.items())
    return f"rocking.pulses.{pulse_values(text)[0].make.__name__}({written})"


def pulse_as_text(motion: Motion) -> str | None:
    """Write a motion that is one of the pulses, bit for bit and without a vertical component, as text; else None.

    Examples
    --------
    >>> pulse_as_text(pulse_of("one-sine:amplitude=3,frequency=2").scaled(2.0))
    'one-sine:amplitude=6.0,frequency=2.0'
    """
    name = motion.description.family.lower().replace(" ", "-")
    given: dict[str, Any] = dict(motion.description.parameters)
    if name.endswith("-ricker"):
        name, given["kind"] = "ricker", name.removesuffix("-ricker")
    if name not in PULSES or motion.vertical is not None:
        return None
    parameters = [*FAMILIES[name].needed, *FAMILIES[name].optional]
    text = pulse_text(name, {each: value for each, value in given.items() if each in parameters})
    made = pulse_of(text)
    same = np.array_equal(made.breakpoints, motion.breakpoints) and np.array_equal(
        made.coefficients, motion.coefficients
    )
    return pulse_text(text, arguments_of(text)) if same else None


def texts_of_motion(motion: Motion, uploads: UploadStore, factor: float = 1.0) -> dict[str, str]:
    """Texts of a motion times a factor: of a pulse, or shipped records and their scale, or else the key of the motion.

    What is kept under a key is the motion as it is, once for all factors.
    """
    scaled = motion if factor == 1.0 else motion.scaled(factor)
    pulse = pulse_as_text(scaled)
    if pulse is not None:
        return {"motion": pulse}
    shipped = _texts_of_shipped(scaled)
    if shipped is not None:
        return shipped
    kept = {"motion": f"given:{uploads.add_motion(motion)}"}
    return kept if factor == 1.0 else kept | {"scale": repr(factor)}


def _texts_of_shipped(motion: Motion) -> dict[str, str] | None:
    """Texts of a shipped record times a factor, its vertical component a shipped one as well; None of any other."""
    components = [motion] if motion.vertical is None else [motion, motion.vertical]
    if not all(each.name in records.names() for each in components):
        return None
    bases = [records.load(each.name) for each in components]
    factor = _factor_of(motion, bases[0])
    factors = factor, abs(factor)  # as `Motion.scaled` has it
    if not all(map(_is_times, components, bases, factors)):
        return None
    names = dict(zip(("motion", "vertical"), (each.name for each in components), strict=False))
    return names if factor == 1.0 else names | {"scale": repr(factor)}


def _factor_of(motion: Motion, base: Motion) -> float:
    """Factor that may make one motion of the other; NaN if none can."""
    if motion.coefficients.shape != base.coefficients.shape:
        return math.nan
    largest = np.unravel_index(np.argmax(np.abs(base.coefficients)), base.coefficients.shape)
    return float(motion.coefficients[largest] / base.coefficients[largest])


def _is_times(motion: Motion, base: Motion, factor: float) -> bool:
    """Whether a factor makes one motion of the other, bit for bit."""
    same = np.array_equal(motion.breakpoints, base.breakpoints)
    return same and np.array_equal(base.coefficients * factor, motion.coefficients)
