"""Sweeps of a case under a sine without end: a parameter up and down, coarse to fine. They know no web."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rocking.dynamics.maps import Fate
from rocking.errors import InvalidOption
from rocking.explorer.inputs import Case, require_possible
from rocking.explorer.maps import AXES, Axis, change_pulse
from rocking.explorer.motions import arguments_of, pulse_call
from rocking.explorer.parameters import Texts
from rocking.explorer.payload import Payload
from rocking.explorer.periodic import (
    KEPT,
    LONGEST,
    PASSED,
    Settled,
    Sine,
    lifting,
    map_of,
    scaled,
    settled,
    sine_of,
    slowest,
    values_of,
)
from rocking.explorer.phrases import phrase
from rocking.inputs.declared import SCALINGS
from rocking.quantities import number

#: Values of a sweep, the steps between those of each level, and how many come at once.
_LEAST, _MOST = 8, 400
_AT_ONCE: Final = 10

_FROM_REST: Final = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Sweep:
    """A case, its sine, and the parameter that is swept: ``a`` or ``omega`` of `maps.AXES`."""

    case: Case
    sine: Sine
    axis: Axis

    @property
    def value(self) -> float:
        """The parameter's value of the case itself."""
        return values_of(self.case, self.sine)[self.axis.name]

    def sine_at(self, value: float) -> Sine:
        """Return the sine at a value of the parameter."""
        if self.axis.name == "a":
            return self.sine._replace(amplitude=value * lifting(self.case))
        return self.sine._replace(frequency=value * slowest(self.case) / (2.0 * math.pi))


class Part(NamedTuple):
    """Values of a sweep by number, in one direction of one level, with results and ``share`` of the work."""

    stride: int
    direction: str
    indices: list[int]
    found: list[Settled]
    share: float


def sweep_of(case: Case, texts: Texts) -> Sweep:
    """Read what is swept: ``sweep`` (``a`` or ``omega``), ``sweep_from``, ``sweep_to``, and ``sweep_points``."""
    sine = sine_of(case)
    if sine is None:
        raise InvalidOption("a diagram needs a sine, of which one period repeats for ever: choose one", "motion")
    name = texts.get("sweep") or "a"
    if name not in ("a", "omega"):
        raise InvalidOption(f"a case is swept over a or omega, not over {name[:20]!r}")
    points = number(texts.get("sweep_points") or "200", "sweep_points")
    if not (_LEAST <= points <= _MOST and points == int(points)):
        raise InvalidOption(f"a sweep has from {_LEAST} to {_MOST} values, not {points:g}")
    omega = values_of(case, sine)["omega"]
    ends = (0.9, float(f"{max(1.5, 2.5 * omega):.2g}")) if name == "a" else AXES["omega"].close
    low, high = (
        number(texts.get(end) or repr(default), end)
        for end, default in zip(("sweep_from", "sweep_to"), ends, strict=True)
    )
    if not 0.0 < low < high < math.inf:
        raise InvalidOption(
            f"a sweep needs a positive start below its end, not {low:g} to {high:g}", "sweep_from", value=low
        )
    sweep = Sweep(case, sine, Axis(name, np.linspace(low, high, int(points))))
    require_possible(sweep.sine_at(high).amplitude)
    return sweep


def parts(sweep: Sweep) -> Generator[Part]:
    """Sweep the parameter up and down from rest in ever smaller steps, on from the last state unless it overturned."""
    values, maps, done = sweep.axis.values, {}, 0
    every = [(stride, order) for stride in (8, 4, 2, 1) for order in (1, -1)]
    whole = sum(len(values[::stride]) for stride, _ in every)
    for stride, order in every:
        start: ArrayLike = _FROM_REST
        numbers = [*range(0, len(values), stride)][::order]
        for indices in (numbers[k : k + _AT_ONCE] for k in range(0, len(numbers), _AT_ONCE)):
            every_found = []
            for index in indices:
                if index not in maps:
                    maps[index] = map_of(sweep.case, sweep.sine_at(float(values[index])))
                found = settled(maps[index], start, PASSED + KEPT - 1)
                start = found.states[-1] if len(found.states) else _FROM_REST
                every_found.append(found)
            done += len(indices)
            yield Part(stride, "up" if order > 0 else "down", indices, every_found, done / whole)


def part_payload(sweep: Sweep, part: Part) -> Payload:
    """Return a part as it is sent: at each value a number of states, with their rotations over slenderness."""
    states = np.concatenate([found.states for found in part.found])
    header = {
        "stride": part.stride,
        "share": part.share,
        "direction": part.direction,
        "indices": part.indices,
        "counts": [len(found.states) for found in part.found],
        "words": [_in_words(found) for found in part.found],
        "overturned": [found.fate == Fate.OVERTURNED for found in part.found],
    }
    return Payload(header, {"states": states.ravel(), "drawn": scaled(sweep.case, states)[:, 0]})


def _in_words(found: Settled) -> dict[str, Any]:
    if found.fate in (Fate.OVERTURNED, Fate.UNFINISHED):
        key = "sweep.overturns" if found.fate == Fate.OVERTURNED else "sweep.given_up"
        return phrase(key, after=found.after)
    if found.fate == Fate.RESTS_FOR_EVER:
        return phrase("sweep.still")
    if not found.period:
        return phrase("sweep.no_period", longest=LONGEST)
    return phrase("sweep.period_rest" if found.rests else "sweep.period", period=found.period)


def described(sweep: Sweep) -> dict[str, Any]:
    """Say what is swept."""
    kind = AXES[sweep.axis.name]
    return {"name": kind.name, "label": phrase(f"axis.{kind.name}"), "values": sweep.axis.values.tolist()}


def texts_at(sweep: Sweep, value: float, state: tuple[float, float] | None) -> dict[str, str]:
    """Texts of the case at a value of the parameter, released from a state (rotation, velocity) or from rest."""
    gone = {*SCALINGS, "initial_rotation", "initial_velocity"}
    texts = {name: text for name, text in sweep.case.texts.items() if name not in gone}
    sine, given = sweep.sine_at(value), arguments_of(texts["motion"])
    changed = {name: each for name, each in sine._asdict().items() if each != given.get(name, 0.0)}
    change_pulse(texts, **changed)
    if state is not None:
        texts |= {"initial_rotation": repr(state[0]), "initial_velocity": repr(state[1])}
    return texts


def call_at(sweep: Sweep) -> str:
    """Write the call that makes one period of the sine at a value of the parameter, which has that name."""
    given: Mapping[str, str] = {
        name: repr(value) for name, value in sweep.sine._asdict().items() if value or name != "phase"
    }
    varied = {
        "a": {"amplitude": f"a * {lifting(sweep.case)!r}"},
        "omega": {"frequency": f"omega * {slowest(sweep.case)!r} / (2.0 * math.pi)"},
    }[sweep.axis.name]
    return pulse_call("sine:amplitude=1,frequency=1,cycles=1", {**given, **varied, "cycles": "1"})
