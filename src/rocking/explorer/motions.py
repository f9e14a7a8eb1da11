"""Motions of the page, read from texts and written as texts."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from rocking import records
from rocking.core import checks
from rocking.errors import InvalidMotion, InvalidOption
from rocking.explorer.parameters import PARAMETERS, PULSES, Texts, Values, given_texts, names_of
from rocking.explorer.uploads import UploadStore
from rocking.inputs.declared import SCALINGS
from rocking.inputs.pulses import FAMILIES, pulse_values
from rocking.inputs.quantities import acceleration, scaling
from rocking.inputs.texts import arguments as written_arguments
from rocking.inputs.texts import as_option, as_path
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure

#: Longest pulse, cycles, which bounds memory.
MOST_SHOWN: Final = 1000.0


class Found(NamedTuple):
    """Motion, its Python expression, its command-line name, and a preceding line of Python."""

    motion: Motion | None
    python: str
    words: tuple[str, ...]
    before: str = ""


def read_motion(texts: Texts, uploads: UploadStore) -> Found:
    """Read the texts of a motion alone, as `read_case` does for a case."""
    given = {name: text for name, text in given_texts(texts).items() if name in names_of("motion")}
    return motion_of(given, {name: PARAMETERS[name].read(text) for name, text in given.items()}, uploads)


def motion_of(given: Texts, values: Values, uploads: UploadStore) -> Found:
    """Create the motion of a case, scaled and with its vertical component."""
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


# cached while only the block changes
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
        name = "".join(letter for letter in motion.name if letter.isprintable())  # a line break would end the comment
        variable = f"given_{key[:6]}"
        return Found(motion, variable, (), f"{variable} = ...  # {name}: the motion that this page was opened with")
    if kind == "file":
        return _from_file(key, values, values.get("channel"), uploads)
    return Found(_shipped(name), f"rocking.records.load({name!r})", (name,))


def _from_file(key: str, values: Values, channel: str | None, uploads: UploadStore) -> Found:
    """Read a channel of a file with the step and units of the texts, unless a separate vertical lacks them."""
    given: dict[str, Any] = {name: values[name] for name in ("dt", "units") if name in values}
    vertical = values.get("vertical", "")
    if vertical.startswith("file:") or vertical in records.names():
        given = {name: value for name, value in given.items() if name in uploads.contents(key)["missing"]}
    file, read = uploads.file(key).name, {"channel": channel, "dt": None, "units": None} | given
    arguments = written_arguments({name: value for name, value in read.items() if value is not None})
    call = f"rocking.read({file!r}{', ' if arguments else ''}{arguments})"
    return Found(uploads.read(key, **read), call, (as_path(file),))


def is_pulse(text: str) -> bool:
    """Whether a text names a pulse of the page."""
    return text.partition(":")[0] in PULSES


def arguments_of(text: str) -> dict[str, Any]:
    """Read the parameters of a pulse, in SI units; reject pulses longer than the maximum.

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
    """Create the pulse that a text names."""
    return pulse_values(text)[0].motion(arguments_of(text))


def pulse_call(text: str, arguments: Mapping[str, str]) -> str:
    """Write the call that creates a pulse of the same family with these arguments, as Python expressions."""
    written = ", ".join(f"{name}={value}" for name, value in arguments.items())
    return f"rocking.pulses.{pulse_values(text)[0].make.__name__}({written})"


def pulse_as_text(motion: Motion) -> str | None:
    """Return the text of a motion that is one of the pulses, bit for bit and without a vertical component, else None.

    Examples
    --------
    >>> pulse_as_text(pulse_of("one-sine:amplitude=3,frequency=2").scaled(2.0))
    'one-sine:amplitude=6.0,frequency=2.0'
    """
    name = motion.description.family.lower().replace(" ", "-")
    parameters: dict[str, Any] = dict(motion.description.parameters)
    if name.endswith("-ricker"):
        name, parameters = "ricker", parameters | {"kind": name.removesuffix("-ricker")}
    if name not in PULSES or motion.vertical is not None:
        return None
    names = [*FAMILIES[name].needed, *FAMILIES[name].optional]
    text = pulse_text(name, {each: value for each, value in parameters.items() if each in names})
    return pulse_text(text, arguments_of(text)) if _is_same(pulse_of(text), motion) else None


def _is_same(motion: Motion, other: Motion) -> bool:
    pairs = ((getattr(each, name) for each in (motion, other)) for name in ("breakpoints", "coefficients"))
    return motion.vertical is other.vertical is None and all(np.array_equal(*pair) for pair in pairs)


def texts_of_motion(motion: Motion, uploads: UploadStore, factor: float = 1.0) -> dict[str, str]:
    """Texts of a motion times a factor: a pulse, a shipped record, or the key under which the store keeps it."""
    if (pulse := pulse_as_text(motion if factor == 1.0 else motion.scaled(factor))) is not None:
        return {"motion": pulse}
    if motion.name in records.names() and _is_same(_shipped(motion.name), motion):
        return {"motion": motion.name} | ({} if factor == 1.0 else {"scale": repr(factor)})
    kept = {"motion": f"given:{uploads.add_motion(motion)}"}
    return kept if factor == 1.0 else kept | {"scale": repr(factor)}
