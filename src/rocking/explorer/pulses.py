"""Pulses on the page: texts of `rocking.named_pulses`, bounded, as Python, and back from a motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from rocking.errors import InvalidMotion
from rocking.motion import pulses
from rocking.motion.motion import Motion
from rocking.named_pulses import FAMILIES as ALL_FAMILIES
from rocking.named_pulses import Family, pulse_values

#: Families by name: those of one amplitude, which the page's sliders and maps change.
FAMILIES: Final = {name: family for name, family in ALL_FAMILIES.items() if family.make is not pulses.n_lobe}

#: Longest pulse, cycles: a page shows no more, and memory is bounded.
MOST_CYCLES: Final = 1000.0


def is_pulse(text: str) -> bool:
    """Whether a text names a pulse.

    Examples
    --------
    >>> is_pulse("sine:amplitude=3,frequency=1,cycles=2"), is_pulse("ridgecrest-clc-090")
    (True, False)
    """
    return text.partition(":")[0] in FAMILIES


def arguments_of(text: str) -> dict[str, Any]:
    """Read the parameters of a pulse, in SI units.

    Raises
    ------
    InvalidMotion
        If the pulse is longer than the page shows.
    InvalidOption
        If the text cannot be read (`rocking.named_pulses.pulse_values`).

    Examples
    --------
    >>> arguments_of("one-sine:amplitude=0.5g,frequency=2Hz")
    {'amplitude': 4.903325, 'frequency': 2.0}
    """
    _, arguments = pulse_values(text)
    for name in ("cycles", "gamma"):
        if arguments.get(name, 0.0) > MOST_CYCLES:
            raise InvalidMotion(f"{name} of a pulse may be {MOST_CYCLES:g} here at most, not {arguments[name]:g}")
    return arguments


def pulse_of(text: str) -> Motion:
    """Make the pulse that a text names.

    Raises
    ------
    InvalidMotion, InvalidOption
        As for `arguments_of`, or if a parameter is missing or out of the pulse's range.

    Examples
    --------
    >>> pulse_of("one-sine:amplitude=0.5g,frequency=2")
    <Motion: one-sine, 0.5 s, peak 4.9033 m/s^2 (0.5 g)>
    """
    return _family(text).motion(arguments_of(text))


def pulse_as_python(text: str) -> str:
    """Write the call that makes the pulse of a text.

    Examples
    --------
    >>> pulse_as_python("sine:amplitude=3,frequency=1,cycles=2.5")
    'rocking.pulses.sine(amplitude=3.0, frequency=1.0, cycles=2.5)'
    """
    return pulse_call(text, {name: repr(value) for name, value in arguments_of(text).items()})


def pulse_call(text: str, arguments: Mapping[str, str]) -> str:
    """Write the call that makes a pulse of the same family with these arguments, as Python has them."""
    written = ", ".join(f"{name}={value}" for name, value in arguments.items())
    return f"rocking.pulses.{_family(text).make.__name__}({written})"


def pulse_as_text(motion: Motion) -> str | None:
    """Write a motion that is one of the pulses, bit for bit and without a vertical component, as text; else None.

    Examples
    --------
    >>> pulse_as_text(pulses.one_sine(3.0, 2.0).scaled(2.0))
    'one-sine:amplitude=6.0,frequency=2.0'
    """
    described = motion.description
    name = described.family.lower().replace(" ", "-")
    given: dict[str, Any] = dict(described.parameters)
    if name.endswith("-ricker"):
        name, given["kind"] = "ricker", name.removesuffix("-ricker")
    if name not in FAMILIES or motion.vertical is not None:
        return None
    family = FAMILIES[name]
    taken = [*family.needed, *family.optional]
    text = f"{name}:" + ",".join(f"{each}={value}" for each, value in given.items() if each in taken)
    made = pulse_of(text)
    same = np.array_equal(made.breakpoints, motion.breakpoints) and np.array_equal(
        made.coefficients, motion.coefficients
    )
    return text if same else None


def _family(text: str) -> Family:
    return pulse_values(text)[0]
