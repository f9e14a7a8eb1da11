"""Motions of the page, read from texts and written as texts."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from rocking import records
from rocking.core import checks
from rocking.errors import MotionError, OptionError
from rocking.explorer.parameters import PULSES, Texts, Values, list_names, read_texts
from rocking.explorer.uploads import UploadStore
from rocking.inputs.declared import SCALINGS
from rocking.inputs.pulses import FAMILIES, read_pulse
from rocking.inputs.quantities import read_acceleration, read_scaling
from rocking.inputs.texts import format_arguments, format_option, format_path
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure

#: Longest pulse, cycles, which bounds memory.
MAX_CYCLES: Final = 1000.0


class WrittenMotion(NamedTuple):
    """Motion with equivalent Python code and words of a command."""

    motion: Motion | None
    expression: str  # Python
    words: tuple[str, ...]  # of a command
    preamble: str = ""  # line before the expression, with its end


def read_motion(texts: Texts, uploads: UploadStore) -> WrittenMotion:
    """Read the texts of a motion alone, as `read_case` does for a case."""
    motion_texts = {name: text for name, text in texts.items() if name in list_names("motion")}
    return read_motion_values(*read_texts(motion_texts), uploads)


def read_motion_values(texts: Texts, values: Values, uploads: UploadStore) -> WrittenMotion:
    """Create the motion of a case, scaled and with its vertical component."""
    target = read_scaling({name: texts[name] for name in SCALINGS if name in texts}, _read_level)
    written = _read_unscaled(values["motion"], values, uploads)
    if "vertical" in values:
        written = _add_vertical(written, values, uploads)
    if target is None:
        return written
    if written.motion is None:
        names = [scaling for scaling in SCALINGS if scaling in texts]
        raise OptionError("{} scales a ground motion: choose one, or leave the scaling out", *names)
    expression = f"{written.expression}.{_format_scaling(*target)}"
    return written._replace(motion=_scale_motion(written.motion, *target), expression=expression)


def _read_level(text: str, name: str) -> float:
    return checks.positive(read_acceleration(text, name), name, OptionError, "m/s^2")


def _format_scaling(level: float, measure: Measure) -> str:
    if measure.name == "factor":
        return f"scaled({level!r})"
    kind = f'rocking.Measure("sa", period={measure.period!r})' if measure.name == "sa" else repr(measure.name)
    return f"scaled_to({level!r}" + ("" if measure.name == "pga" else f", {kind}") + ")"


# Cached while only the block changes.
_scale_motion = functools.lru_cache(maxsize=4)(Motion.scaled_to)
_combine = functools.lru_cache(maxsize=4)(Motion.with_vertical)
_load_shipped = functools.cache(records.load)


def _add_vertical(horizontal: WrittenMotion, values: Values, uploads: UploadStore) -> WrittenMotion:
    """Add the vertical component: a record, another file, or a channel of the same file."""
    name, (kind, _, key) = values["vertical"], values["motion"].partition(":")
    if horizontal.motion is None or is_pulse(kind) or kind == "given":
        raise OptionError("{} goes with a record: choose one, or leave the component out", "vertical")
    other_key, _, channel = name.removeprefix("file:").partition("#")
    if name.startswith("file:"):
        vertical = _read_file(other_key, values, channel or None, uploads)
        words = () if channel else vertical.words
    elif kind == "file" and name not in records.names():
        vertical, words = _read_file(key, values, name, uploads), (name,)
    else:
        vertical = _load_record(name, "vertical")
        words = vertical.words
    return WrittenMotion(
        _combine(horizontal.motion, vertical.motion),
        f"{horizontal.expression}.with_vertical({vertical.expression})",
        (*horizontal.words, *format_option("vertical", *words)) if horizontal.words and words else (),
    )


def _read_unscaled(name: str, values: Values, uploads: UploadStore) -> WrittenMotion:
    kind, _, key = name.partition(":")
    if corrections := [name for name in ("baseline", "highpass") if name in values and kind != "file"]:
        raise OptionError("{} corrects the record of a file: choose one, or leave it empty", *corrections)
    if name == "none":
        return WrittenMotion(None, "None", ())
    if is_pulse(name):
        arguments = format_arguments(read_pulse_arguments(name))
        call = f"rocking.pulses.{read_pulse(name)[0].make.__name__}({arguments})"
        return WrittenMotion(create_pulse(name), call, ("--pulse", name))
    if kind == "given":
        motion, variable = uploads.get_motion(key), f"given_{key[:6]}"
        label = "".join(letter for letter in motion.name if letter.isprintable())  # a line break would end the comment
        return WrittenMotion(motion, variable, (), f"{variable} = ...  # {label}: a motion of the study\n")
    if kind == "file":
        return _read_file(key, values, values.get("channel"), uploads)
    return _load_record(name, "motion")


def _load_record(name: str, argument: str) -> WrittenMotion:
    """Load a shipped record, which an argument names."""
    if name not in records.names():
        raise OptionError(f"{{}}: there is no shipped record {name[:40]!r}", argument, value=name)
    return WrittenMotion(_load_shipped(name), f"rocking.records.load({name!r})", (name,))


def _read_file(key: str, values: Values, channel: str | None, uploads: UploadStore) -> WrittenMotion:
    """Read a channel of a file with the step and units of the texts, unless a separate vertical lacks them."""
    names = ("dt", "units", "baseline", "highpass")
    vertical, stated = values.get("vertical", ""), set[str]()
    if vertical.startswith("file:") or vertical in records.names():
        stated = {"dt", "units"} - {*uploads.describe_file(key)["missing"]}
    options = {} if channel is None else {"channel": channel}
    options |= {name: values[name] for name in names if name in values and name not in stated}
    file = uploads.get_file(key).name
    arguments = ", ".join(filter(None, (repr(file), format_arguments(options))))
    return WrittenMotion(uploads.read(key, **options), f"rocking.read({arguments})", (format_path(file),))


def is_pulse(text: str) -> bool:
    """Whether a text names a pulse of the page."""
    return text.partition(":")[0] in PULSES


def read_pulse_arguments(text: str) -> dict[str, Any]:
    """Read the parameters of a pulse, in SI units; reject pulses longer than the maximum.

    Examples
    --------
    >>> read_pulse_arguments("sine:amplitude=2, frequency=1Hz, cycles=5,")
    {'amplitude': 2.0, 'frequency': 1.0, 'cycles': 5.0}
    """
    _, arguments = read_pulse(text)
    for name in ("cycles", "gamma"):
        if (count := arguments.get(name, 0.0)) > MAX_CYCLES:
            raise MotionError(f"{{}} of a pulse may be {MAX_CYCLES:g} here at most, not {count:g}", name, value=count)
    return arguments


def format_pulse(text: str, arguments: Mapping[str, Any]) -> str:
    """Write a pulse of the family of a text with these parameters, in SI units."""
    return f"{read_pulse(text)[0].name}:" + ",".join(f"{name}={value}" for name, value in arguments.items())


def create_pulse(text: str) -> Motion:
    """Create the pulse that a text names."""
    return read_pulse(text)[0].create_motion(read_pulse_arguments(text))


def format_as_pulse(motion: Motion) -> str | None:
    """Return the text of a motion that is one of the pulses, bit for bit and without a vertical component, else None.

    Examples
    --------
    >>> format_as_pulse(create_pulse("one-sine:amplitude=3,frequency=2").scaled(2.0))
    'one-sine:amplitude=6.0,frequency=2.0'
    """
    name = motion.description.family.lower().replace(" ", "-")
    parameters: dict[str, Any] = dict(motion.description.parameters)
    if name.endswith("-ricker"):
        name, parameters = "ricker", parameters | {"kind": name.removesuffix("-ricker")}
    if name not in PULSES or motion.vertical is not None:
        return None
    names = [*FAMILIES[name].needed, *FAMILIES[name].optional]
    text = format_pulse(name, {parameter: value for parameter, value in parameters.items() if parameter in names})
    return text if _is_equal(create_pulse(text), motion) else None


def _is_equal(motion: Motion, other: Motion) -> bool:
    pairs = ((getattr(item, name) for item in (motion, other)) for name in ("breakpoints", "coefficients"))
    return motion.vertical is other.vertical is None and all(np.array_equal(*pair) for pair in pairs)


def motion_to_texts(motion: Motion, uploads: UploadStore, factor: float = 1.0) -> dict[str, str]:
    """Texts of a motion times a factor: a pulse, a shipped record, or the key under which the store keeps it."""
    if (pulse := format_as_pulse(motion if factor == 1.0 else motion.scaled(factor))) is not None:
        return {"motion": pulse}
    if motion.name in records.names() and _is_equal(_load_shipped(motion.name), motion):
        return {"motion": motion.name} | ({} if factor == 1.0 else {"scale": repr(factor)})
    texts = {"motion": f"given:{uploads.add_motion(motion)}"}
    return texts if factor == 1.0 else texts | {"scale": repr(factor)}
