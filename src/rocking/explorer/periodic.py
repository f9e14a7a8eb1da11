"""A case under an infinite sine: phase plane and parameter sweeps, independent of the web."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rocking import pulses
from rocking.core.arrays import Floats
from rocking.dynamics.bifurcation import period_of, states_after
from rocking.dynamics.maps import Fate, StroboscopicMap, scale_of, stroboscopic_map
from rocking.dynamics.orbits import multipliers_at
from rocking.errors import InvalidOption
from rocking.explorer.inputs import Case, require_possible
from rocking.explorer.maps import AXES, Axis, axis_of, change_pulse
from rocking.explorer.motions import arguments_of, is_pulse, pulse_call, pulse_of
from rocking.explorer.parameters import Texts
from rocking.explorer.payload import Payload, phrase
from rocking.inputs.declared import SCALINGS
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.simulation.simulate import simulate

#: Transient periods at each value of a sweep, and states stored after them.
PASSED: Final = 300
KEPT: Final = 64

#: Longest period that `period_of` detects in the stored states.
LONGEST: Final = KEPT // 2

#: Periods after which a case counts as aperiodic, and states that are then drawn.
_PATIENCE: Final = 8000
_CLOUD: Final = 1024

#: Points of a trajectory, and the fraction of the greatest speed below which an impact leaves no gap.
_POINTS: Final = 6000
_SEEN: Final = 2e-3


class Sine(NamedTuple):
    """Sine by its parameters in SI units, with ``cycles``; a single cycle repeats for ever."""

    amplitude: float
    frequency: float
    phase: float
    cycles: float

    def motion(self, cycles: float = 1.0) -> Motion:
        """Return a motion of some cycles of the sine."""
        return pulses.sine(self.amplitude, self.frequency, cycles=cycles, phase=self.phase)

    @property
    def text(self) -> str:
        """Text that names the sine in a case."""
        given = {name: value for name, value in self._asdict().items() if value or name != "phase"}
        return "sine:" + ",".join(f"{name}={value!r}" for name, value in given.items())


class Settled(NamedTuple):
    """States of one period, or the last ones; ``after`` is the number of periods, ``course`` the drawn part."""

    states: Floats
    period: int
    rests: bool
    fate: Fate
    after: int
    course: tuple[Floats, int]


def lifting(case: Case) -> float:
    """Return the smallest uplift acceleration of the block, m/s^2."""
    return min(case.block.uplift_thresholds(case.model))


def slowest(case: Case) -> float:
    """Return the (smaller) frequency parameter of the block, rad/s."""
    return min(side.p for side in case.block.sides)


def values_of(case: Case, sine: Sine) -> dict[str, float]:
    """Return the sweep parameters: amplitude divided by the uplift acceleration, and frequency 2 pi f/p."""
    return {"a": sine.amplitude / lifting(case), "omega": 2.0 * math.pi * sine.frequency / slowest(case)}


def sine_of(case: Case) -> Sine | None:
    """Return the sine of a case, scaled like its motion; None for other motions."""
    text = case.texts.get("motion", "")
    if case.motion is None or text.partition(":")[0] != "sine":
        return None
    given, as_it_is = arguments_of(text), pulse_of(text).coefficients
    largest = np.unravel_index(np.argmax(np.abs(as_it_is)), as_it_is.shape)
    factor = float(case.motion.coefficients[largest] / as_it_is[largest])
    amplitude, phase = given["amplitude"] * factor, given.get("phase", 0.0)
    return Sine(abs(amplitude), given["frequency"], phase + (math.pi if amplitude < 0.0 else 0.0), given["cycles"])


def nearest_sine(case: Case) -> Sine:
    """Return a sine with the pulse's peak acceleration (or else velocity) and frequency, or a sine above uplift."""
    if case.motion is None or case.motion.pga == 0.0:
        return Sine(1.5 * lifting(case), 1.5 * slowest(case) / math.pi, 0.0, 10.0)
    text, pga = case.texts.get("motion", ""), case.motion.pga
    given = arguments_of(text) if is_pulse(text) else {}
    frequency = given.get("frequency") or pga / (2.0 * math.pi * case.motion.pgv)
    return Sine(float(f"{pga:.6g}"), float(f"{frequency:.6g}"), 0.0, 10.0)


def map_of(case: Case, sine: Sine) -> StroboscopicMap:
    """Return the map of the case's block from period to period of a sine."""
    return stroboscopic_map(case.block, sine.motion(), model=case.model, chattering=case.chattering)


def settled(rock: StroboscopicMap, start: ArrayLike, periods: int, kept: int = KEPT) -> Settled:
    """Return the steady state, or overturning, that follows a state within a number of periods."""
    first, count = np.asarray(start, dtype=float), min(kept, periods)
    last = states_after(rock, first[None], periods - count, count)[0][0]
    if np.isnan(last[-1, 0]):
        orbit = rock.orbit(first, periods)
        after = int(np.argmax(np.isnan(orbit[:, 0])))
        _, fate, _ = rock.followed(orbit[after - 1])
        earlier = max(0, after - LONGEST)
        return Settled(np.empty((0, 2)), 0, False, Fate(int(fate)), after, (orbit[earlier], after - earlier))
    period = period_of(last[-KEPT:], scale_of(rock))
    _, fate, _ = rock.followed(last[-1])
    rests = period > 0 and not np.any(rock.derivative(last[-1], period)[1])
    drawn = period or LONGEST
    states = last[-period:] if period else last
    return Settled(states, period, rests, Fate(int(fate)), periods, (last[-drawn], drawn))


def settled_case(case: Case, sine: Sine) -> tuple[Settled, StroboscopicMap]:
    """Return the steady state of a case, if necessary after thousands of periods, and its map."""
    rock = map_of(case, sine)
    start: Floats = np.array([case.initial_rotation, case.initial_velocity])
    passed = 0
    while True:
        periods = min(max(2 * KEPT, passed), _PATIENCE - passed)
        found = settled(rock, start, periods, _CLOUD)
        passed += periods
        found = found._replace(after=found.after + passed - periods)
        if found.period or not len(found.states) or passed >= _PATIENCE:
            return found, rock
        start = found.states[-1]


def orbit(case: Case) -> Payload:
    """Return the normalised phase plane of a case under an infinite sine, and its steady state in words.

    For another motion the header contains only ``offer``: text, amplitude (m/s^2) and frequency (Hz) of a sine.
    """
    sine = sine_of(case)
    if sine is None:
        near = nearest_sine(case)
        offer = {"motion": near.text, "amplitude": near.amplitude, "frequency": near.frequency}
        return Payload({"offer": offer})
    found, rock = settled_case(case, sine)
    response = _followed(case, sine, *found.course)
    header = {
        "offer": None,
        "sentence": sentence(found, response),
        "about": _about(case, sine, found, rock),
        "at": values_of(case, sine),
        "phase": sine.phase,
        "period": found.period,
    }
    states = scaled(case, found.states)
    return Payload(header, {**_trajectory(case, response), "x": states[:, 0], "y": states[:, 1]})


def _followed(case: Case, sine: Sine, start: Floats, periods: int) -> Response:
    return simulate(
        case.block,
        sine.motion(periods + 1.0),
        model=case.model,
        chattering=case.chattering,
        duration=periods / sine.frequency,
        initial_rotation=float(start[0]),
        initial_velocity=float(start[1]),
    )


def sentence(found: Settled, response: Response) -> dict[str, Any]:
    """Describe the steady state of a case; the response covers one period of it."""
    if found.fate == Fate.OVERTURNED:
        return phrase("orbit.overturns", after=found.after)
    if found.fate == Fate.UNFINISHED:
        return phrase("orbit.given_up", after=found.after)
    if found.fate == Fate.RESTS_FOR_EVER:
        return phrase("orbit.still")
    if not found.period:
        return phrase("orbit.no_period", longest=LONGEST, after=found.after)
    rests = int(np.sum(response.events["kind"] == "rest"))
    each = (
        phrase("orbit.with_rests", count=rests) if rests else phrase("orbit.with_impacts", count=len(response.impacts))
    )
    return phrase("orbit.repeats", every=phrase("orbit.every", count=found.period), each=each)


def _about(case: Case, sine: Sine, found: Settled, rock: StroboscopicMap) -> dict[str, Any]:
    """Return the stability of the steady state, and its start."""
    released = case.initial_rotation or case.initial_velocity
    start = phrase("orbit.from_rest")
    if released:
        start = phrase("orbit.from_state", rotation=case.initial_rotation, velocity=case.initial_velocity)
    begins = phrase("orbit.begins", period=1.0 / sine.frequency, start=start)
    if not found.period or found.fate == Fate.RESTS_FOR_EVER:
        return begins
    if found.rests:
        return phrase("orbit.forgets", begins=begins)
    _, change = rock.derivative(found.states[-1], found.period)
    first, second = (complex(each) for each in multipliers_at(rock, change))
    if first.imag:
        pair = phrase("orbit.complex_pair", real=first.real, imaginary=abs(first.imag))
    else:
        pair = phrase("orbit.real_pair", first=first.real, second=second.real)
    return phrase("orbit.multipliers", begins=begins, pair=pair)


def scaled(case: Case, states: Floats) -> Floats:
    """Return rotations divided by slenderness, and velocities divided by p times slenderness, of their sides."""
    plus, minus = case.block.sides
    side = np.where((states[..., 0] < 0.0) | ((states[..., 0] == 0.0) & (states[..., 1] < 0.0)), -1, 1)
    units = np.where((side > 0)[..., None], [plus.alpha, plus.alpha * plus.p], [minus.alpha, minus.alpha * minus.p])
    relative: Floats = states / units
    return relative


def _states(case: Case, response: Response, end: float) -> tuple[Floats, Floats]:
    """Return times up to an end, and the states at them."""
    times = np.linspace(0.0, end, _POINTS)
    return times, scaled(case, np.stack([response.rotation(times), response.angular_velocity(times)], axis=-1))


def _trajectory(case: Case, response: Response) -> dict[str, Floats]:
    """Return a response in the phase plane, with a gap at each impact, and the lines across the gaps."""
    end = response.duration
    if response.overturned:
        fallen = np.abs(_states(case, response, end)[1][:, 0]) > 1.5  # relative to the slenderness
        end *= np.argmax(fallen) / (_POINTS - 1) if fallen.any() else 1.0
    times, states = _states(case, response, end)
    impacts = response.impacts[response.impacts["time"] <= end]
    seen = impacts[impacts["speed_before"] > _SEEN * impacts["speed_before"].max(initial=0.0)]
    jumps = [np.stack([np.zeros(len(seen)), seen["side"] * seen[f"speed_{when}"]], -1) for when in ("before", "after")]
    # The velocities before and after an impact belong to the old and the new side, respectively.
    before, after = scaled(case, jumps[0] * [1.0, -1.0]) * [1.0, -1.0], scaled(case, jumps[1])
    gaps = np.stack([before, np.full_like(before, np.nan), after], axis=1).reshape(-1, 2)
    order = np.argsort(np.concatenate([times, np.repeat(seen["time"], 3)]), kind="stable")
    line = np.concatenate([states, gaps])[order]
    return {"rotation": line[:, 0], "velocity": line[:, 1], "before": before[:, 1], "after": after[:, 1]}


#: Values of a sweep in one part.
_AT_ONCE: Final = 10

_FROM_REST: Final = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Sweep:
    """Case, its sine, and the sweep parameter: ``a`` or ``omega`` of `maps.AXES`."""

    case: Case
    sine: Sine
    axis: Axis

    @property
    def value(self) -> float:
        """Value of the parameter in the case itself."""
        return values_of(self.case, self.sine)[self.axis.name]

    def sine_at(self, value: float) -> Sine:
        """Return the sine at a value of the parameter."""
        if self.axis.name == "a":
            return self.sine._replace(amplitude=value * lifting(self.case))
        return self.sine._replace(frequency=value * slowest(self.case) / (2.0 * math.pi))


class Part(NamedTuple):
    """Values of a sweep by index, in one direction of one level, with results and ``share`` of the work."""

    stride: int
    direction: str
    indices: list[int]
    found: list[Settled]
    share: float


def sweep_of(case: Case, texts: Texts) -> Sweep:
    """Read a sweep: ``sweep`` (``a`` or ``omega``), ``sweep_from``, ``sweep_to``, and ``sweep_points``."""
    sine = sine_of(case)
    if sine is None:
        raise InvalidOption("a diagram needs a sine, of which one period repeats for ever: choose one", "motion")
    name = texts.get("sweep") or "a"
    if name not in ("a", "omega"):
        raise InvalidOption(f"a case is swept over a or omega, not over {name[:20]!r}")
    omega = values_of(case, sine)["omega"]
    ends = (0.9, float(f"{max(1.5, 2.5 * omega):.2g}")) if name == "a" else AXES["omega"].close
    sweep = Sweep(case, sine, axis_of(name, texts, ("sweep_from", "sweep_to", "sweep_points"), ends))
    require_possible(sweep.sine_at(float(sweep.axis.values[-1])).amplitude)
    return sweep


def parts(sweep: Sweep) -> Generator[Part]:
    """Sweep up and down from rest in decreasing steps, each from the last state unless it overturned."""
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
    """Return the payload of a part: the number of states at each value, and their normalised rotations."""
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
    """Describe a sweep."""
    kind = AXES[sweep.axis.name]
    return {"name": kind.name, "label": phrase(f"axis.{kind.name}"), "values": sweep.axis.values.tolist()}


def texts_at(sweep: Sweep, value: float, state: tuple[float, float] | None) -> dict[str, str]:
    """Return the texts of the case at a value of the parameter, from a state (rotation, velocity) or from rest."""
    gone = {*SCALINGS, "initial_rotation", "initial_velocity"}
    texts = {name: text for name, text in sweep.case.texts.items() if name not in gone}
    sine, given = sweep.sine_at(value), arguments_of(texts["motion"])
    changed = {name: each for name, each in sine._asdict().items() if each != given.get(name, 0.0)}
    change_pulse(texts, **changed)
    if state is not None:
        texts |= {"initial_rotation": repr(state[0]), "initial_velocity": repr(state[1])}
    return texts


def call_at(sweep: Sweep) -> str:
    """Write the call that creates one period of the sine; the parameter is a variable of its own name."""
    given: Mapping[str, str] = {
        name: repr(value) for name, value in sweep.sine._asdict().items() if value or name != "phase"
    }
    varied = {
        "a": {"amplitude": f"a * {lifting(sweep.case)!r}"},
        "omega": {"frequency": f"omega * {slowest(sweep.case)!r} / (2.0 * math.pi)"},
    }[sweep.axis.name]
    return pulse_call("sine:amplitude=1,frequency=1,cycles=1", {**given, **varied, "cycles": "1"})
