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
from rocking.dynamics.bifurcation import find_period, record_states
from rocking.dynamics.maps import PeriodOutcome, StroboscopicMap, compute_scale, stroboscopic_map
from rocking.dynamics.orbits import compute_multipliers
from rocking.errors import OptionError
from rocking.explorer.inputs import Case, require_possible, require_sticking
from rocking.explorer.maps import AXES, Axis, change_pulse, read_range
from rocking.explorer.motions import create_pulse, is_pulse, read_pulse_arguments, write_pulse_call
from rocking.explorer.parameters import Texts
from rocking.explorer.payload import Payload, phrase
from rocking.inputs.declared import SCALINGS
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.simulation.simulate import simulate

#: Transient periods at each value of a sweep, and states stored after them.
TRANSIENT_PERIODS: Final = 300
STORED_STATES: Final = 64

#: Longest period that `find_period` detects in the stored states.
MAX_PERIOD: Final = STORED_STATES // 2

#: Periods after which a case counts as aperiodic, and states that are then drawn.
_MAX_PERIODS: Final = 8000
_MAX_STATES: Final = 1024

#: Points of a trajectory, and the fraction of the greatest speed below which an impact leaves no gap.
_POINTS: Final = 6000
_MIN_SPEED_RATIO: Final = 2e-3


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
        parameters = {name: value for name, value in self._asdict().items() if value or name != "phase"}
        return "sine:" + ",".join(f"{name}={value!r}" for name, value in parameters.items())


class SteadyState(NamedTuple):
    """Steady state, or overturning, of a block under a sine."""

    states: Floats  # once per period of the sine: of one cycle, or the last ones
    period: int  # of the cycle, in periods of the sine; 0 if none was detected
    has_rest: bool
    outcome: PeriodOutcome
    periods: int  # elapsed
    trajectory: tuple[Floats, int]  # first state and number of periods to draw


def find_uplift_threshold(case: Case) -> float:
    """Return the smallest uplift acceleration of the block, m/s^2."""
    return min(case.block.uplift_thresholds(case.model))


def find_frequency_parameter(case: Case) -> float:
    """Return the (smaller) frequency parameter of the block, rad/s."""
    return min(side.p for side in case.block.sides)


def compute_sweep_values(case: Case, sine: Sine) -> dict[str, float]:
    """Return the sweep parameters: amplitude divided by the uplift acceleration, and frequency 2 pi f/p."""
    return {
        "a": sine.amplitude / find_uplift_threshold(case),
        "omega": 2.0 * math.pi * sine.frequency / find_frequency_parameter(case),
    }


def find_sine(case: Case) -> Sine | None:
    """Return the sine of a case, scaled like its motion; None for other motions."""
    text = case.texts.get("motion", "")
    if case.motion is None or text.partition(":")[0] != "sine":
        return None
    pulse, unscaled = read_pulse_arguments(text), create_pulse(text).coefficients
    largest_index = np.unravel_index(np.argmax(np.abs(unscaled)), unscaled.shape)
    factor = float(case.motion.coefficients[largest_index] / unscaled[largest_index])
    amplitude, phase = pulse["amplitude"] * factor, pulse.get("phase", 0.0)
    return Sine(abs(amplitude), pulse["frequency"], phase + (math.pi if amplitude < 0.0 else 0.0), pulse["cycles"])


def suggest_sine(case: Case) -> Sine:
    """Return a sine with the pulse's peak acceleration (or else velocity) and frequency, or a sine above uplift."""
    if case.motion is None or case.motion.pga == 0.0:
        return Sine(1.5 * find_uplift_threshold(case), 1.5 * find_frequency_parameter(case) / math.pi, 0.0, 10.0)
    text, pga = case.texts.get("motion", ""), case.motion.pga
    parameters = read_pulse_arguments(text) if is_pulse(text) else {}
    frequency = parameters.get("frequency") or pga / (2.0 * math.pi * case.motion.pgv)
    return Sine(float(f"{pga:.6g}"), float(f"{frequency:.6g}"), 0.0, 10.0)


def create_map(case: Case, sine: Sine) -> StroboscopicMap:
    """Return the map of the case's block from period to period of a sine."""
    return stroboscopic_map(case.block, sine.motion(), model=case.model, chattering=case.chattering)


def settle(strobe: StroboscopicMap, start: ArrayLike, periods: int, stored: int = STORED_STATES) -> SteadyState:
    """Return the steady state, or overturning, that follows a state within a number of periods."""
    initial, count = np.asarray(start, dtype=float), min(stored, periods)
    last_states = record_states(strobe, initial[None], periods - count, count)[0][0]
    if np.isnan(last_states[-1, 0]):
        orbit = strobe.orbit(initial, periods)
        duration = int(np.argmax(np.isnan(orbit[:, 0])))
        _, outcome, _ = strobe.advance(orbit[duration - 1])
        first_period = max(0, duration - MAX_PERIOD)
        return SteadyState(
            np.empty((0, 2)),
            0,
            False,
            PeriodOutcome(int(outcome)),
            duration,
            (orbit[first_period], duration - first_period),
        )
    period = find_period(last_states[-STORED_STATES:], compute_scale(strobe))
    _, outcome, _ = strobe.advance(last_states[-1])
    has_rest = period > 0 and not np.any(strobe.derivative(last_states[-1], period)[1])
    drawn_periods = period or MAX_PERIOD
    states = last_states[-period:] if period else last_states
    return SteadyState(
        states, period, has_rest, PeriodOutcome(int(outcome)), periods, (last_states[-drawn_periods], drawn_periods)
    )


def settle_case(case: Case, sine: Sine) -> tuple[SteadyState, StroboscopicMap]:
    """Return the steady state of a case, if necessary after thousands of periods, and its map."""
    strobe = create_map(case, sine)
    start: Floats = np.array([case.initial_rotation, case.initial_velocity])
    elapsed = 0
    while True:
        periods = min(max(2 * STORED_STATES, elapsed), _MAX_PERIODS - elapsed)
        steady_state = settle(strobe, start, periods, _MAX_STATES)
        elapsed += periods
        steady_state = steady_state._replace(periods=steady_state.periods + elapsed - periods)
        if steady_state.period or not len(steady_state.states) or elapsed >= _MAX_PERIODS:
            return steady_state, strobe
        start = steady_state.states[-1]


def describe_orbit(case: Case) -> Payload:
    """Return the normalised phase plane of a case under an infinite sine, and its steady state in words.

    For another motion the header contains only ``offer``: text, amplitude (m/s^2) and frequency (Hz) of a sine.
    """
    require_sticking(case)
    sine = find_sine(case)
    if sine is None:
        suggested = suggest_sine(case)
        offer = {"motion": suggested.text, "amplitude": suggested.amplitude, "frequency": suggested.frequency}
        return Payload({"offer": offer})
    steady_state, strobe = settle_case(case, sine)
    response = _simulate_periods(case, sine, *steady_state.trajectory)
    header = {
        "offer": None,
        "sentence": describe_steady_state(steady_state, response),
        "about": _describe_stability(case, sine, steady_state, strobe),
        "at": compute_sweep_values(case, sine),
        "phase": sine.phase,
        "period": steady_state.period,
    }
    states = normalise_states(case, steady_state.states)
    return Payload(header, {**_trace_phase_plane(case, response), "x": states[:, 0], "y": states[:, 1]})


def _simulate_periods(case: Case, sine: Sine, start: Floats, periods: int) -> Response:
    return simulate(
        case.block,
        sine.motion(periods + 1.0),
        model=case.model,
        chattering=case.chattering,
        duration=periods / sine.frequency,
        initial_rotation=float(start[0]),
        initial_velocity=float(start[1]),
    )


def describe_steady_state(steady_state: SteadyState, response: Response) -> dict[str, Any]:
    """Describe the steady state of a case; the response covers one period of it."""
    if steady_state.outcome == PeriodOutcome.OVERTURNED:
        return phrase("orbit.overturns", after=steady_state.periods)
    if steady_state.outcome == PeriodOutcome.UNFINISHED:
        return phrase("orbit.given_up", after=steady_state.periods)
    if steady_state.outcome == PeriodOutcome.RESTS_FOR_EVER:
        return phrase("orbit.still")
    if not steady_state.period:
        return phrase("orbit.no_period", longest=MAX_PERIOD, after=steady_state.periods)
    rests = int(np.sum(response.events["kind"] == "rest"))
    content = (
        phrase("orbit.with_rests", count=rests) if rests else phrase("orbit.with_impacts", count=len(response.impacts))
    )
    return phrase("orbit.repeats", every=phrase("orbit.every", count=steady_state.period), each=content)


def _describe_stability(case: Case, sine: Sine, steady_state: SteadyState, strobe: StroboscopicMap) -> dict[str, Any]:
    """Return the stability of the steady state, and its start."""
    is_released = case.initial_rotation or case.initial_velocity
    start = phrase("orbit.from_rest")
    if is_released:
        start = phrase("orbit.from_state", rotation=case.initial_rotation, velocity=case.initial_velocity)
    beginning = phrase("orbit.begins", period=1.0 / sine.frequency, start=start)
    if not steady_state.period or steady_state.outcome == PeriodOutcome.RESTS_FOR_EVER:
        return beginning
    if steady_state.has_rest:
        return phrase("orbit.forgets", begins=beginning)
    _, jacobian = strobe.derivative(steady_state.states[-1], steady_state.period)
    first_multiplier, second_multiplier = (complex(multiplier) for multiplier in compute_multipliers(strobe, jacobian))
    if first_multiplier.imag:
        pair = phrase("orbit.complex_pair", real=first_multiplier.real, imaginary=abs(first_multiplier.imag))
    else:
        pair = phrase("orbit.real_pair", first=first_multiplier.real, second=second_multiplier.real)
    return phrase("orbit.multipliers", begins=beginning, pair=pair)


def normalise_states(case: Case, states: Floats) -> Floats:
    """Return rotations divided by slenderness, and velocities divided by p times slenderness, of their sides."""
    plus, minus = case.block.sides
    sides = np.where((states[..., 0] < 0.0) | ((states[..., 0] == 0.0) & (states[..., 1] < 0.0)), -1, 1)
    scales = np.where((sides > 0)[..., None], [plus.alpha, plus.alpha * plus.p], [minus.alpha, minus.alpha * minus.p])
    normalised: Floats = states / scales
    return normalised


def _sample_states(case: Case, response: Response, end: float) -> tuple[Floats, Floats]:
    """Return times up to an end, and the states at them."""
    times = np.linspace(0.0, end, _POINTS)
    return times, normalise_states(
        case, np.stack([response.rotation(times), response.angular_velocity(times)], axis=-1)
    )


def _trace_phase_plane(case: Case, response: Response) -> dict[str, Floats]:
    """Return a response in the phase plane, with a gap at each impact, and the lines across the gaps."""
    end = response.duration
    if response.overturned:
        is_beyond = np.abs(_sample_states(case, response, end)[1][:, 0]) > 1.5  # relative to the slenderness
        end *= np.argmax(is_beyond) / (_POINTS - 1) if is_beyond.any() else 1.0
    times, states = _sample_states(case, response, end)
    impacts = response.impacts[response.impacts["time"] <= end]
    visible = impacts[impacts["speed_before"] > _MIN_SPEED_RATIO * impacts["speed_before"].max(initial=0.0)]
    jumps = [
        np.stack([np.zeros(len(visible)), visible["side"] * visible[f"speed_{moment}"]], -1)
        for moment in ("before", "after")
    ]
    # The velocities before and after an impact belong to the old and the new side, respectively.
    before, after = normalise_states(case, jumps[0] * [1.0, -1.0]) * [1.0, -1.0], normalise_states(case, jumps[1])
    gaps = np.stack([before, np.full_like(before, np.nan), after], axis=1).reshape(-1, 2)
    order = np.argsort(np.concatenate([times, np.repeat(visible["time"], 3)]), kind="stable")
    line = np.concatenate([states, gaps])[order]
    return {"rotation": line[:, 0], "velocity": line[:, 1], "before": before[:, 1], "after": after[:, 1]}


#: Values of a sweep in one part.
_BATCH_SIZE: Final = 10

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
        return compute_sweep_values(self.case, self.sine)[self.axis.name]

    def sine_at(self, value: float) -> Sine:
        """Return the sine at a value of the parameter."""
        if self.axis.name == "a":
            return self.sine._replace(amplitude=value * find_uplift_threshold(self.case))
        return self.sine._replace(frequency=value * find_frequency_parameter(self.case) / (2.0 * math.pi))


def read_sweep(case: Case, texts: Texts) -> Sweep:
    """Read a sweep: ``sweep`` (``a`` or ``omega``), ``sweep_from``, ``sweep_to``, and ``sweep_points``."""
    sine = find_sine(case)
    if sine is None:
        raise OptionError("a diagram needs a sine, of which one period repeats for ever: choose one", "motion")
    name = texts.get("sweep") or "a"
    if name not in ("a", "omega"):
        raise OptionError(f"{{}} must be a or omega, not {name[:20]!r}", "sweep", value=name)
    omega = compute_sweep_values(case, sine)["omega"]
    ends = (0.9, float(f"{max(1.5, 2.5 * omega):.2g}")) if name == "a" else AXES["omega"].close
    sweep = Sweep(case, sine, read_range(name, texts, ("sweep_from", "sweep_to", "sweep_points"), ends))
    require_possible(sweep.sine_at(float(sweep.axis.values[-1])).amplitude)
    return sweep


def simulate_sweep(sweep: Sweep) -> Generator[Payload]:
    """Sweep up and down from rest in decreasing steps, each from the last state unless it overturned."""
    values, maps, computed = sweep.axis.values, {}, 0
    passes = [(stride, direction) for stride in (8, 4, 2, 1) for direction in (1, -1)]
    total = sum(len(values[::stride]) for stride, _ in passes)
    for stride, direction in passes:
        start: ArrayLike = _FROM_REST
        pass_indices = [*range(0, len(values), stride)][::direction]
        for indices in (pass_indices[k : k + _BATCH_SIZE] for k in range(0, len(pass_indices), _BATCH_SIZE)):
            steady_states = []
            for index in indices:
                if index not in maps:
                    maps[index] = create_map(sweep.case, sweep.sine_at(float(values[index])))
                steady_state = settle(maps[index], start, TRANSIENT_PERIODS + STORED_STATES - 1)
                start = steady_state.states[-1] if len(steady_state.states) else _FROM_REST
                steady_states.append(steady_state)
            computed += len(indices)
            header = {"stride": stride, "share": computed / total, "direction": "up" if direction > 0 else "down"}
            yield _describe_steady_states(sweep, header | {"indices": indices}, steady_states)


def _describe_steady_states(sweep: Sweep, header: dict[str, Any], steady_states: list[SteadyState]) -> Payload:
    """Return the number of states at each value, the states, and their normalised rotations."""
    states = np.concatenate([steady_state.states for steady_state in steady_states])
    header |= {
        "counts": [len(steady_state.states) for steady_state in steady_states],
        "words": [_summarise_steady_state(steady_state) for steady_state in steady_states],
        "overturned": [steady_state.outcome == PeriodOutcome.OVERTURNED for steady_state in steady_states],
    }
    return Payload(header, {"states": states.ravel(), "drawn": normalise_states(sweep.case, states)[:, 0]})


def _summarise_steady_state(steady_state: SteadyState) -> dict[str, Any]:
    if steady_state.outcome in (PeriodOutcome.OVERTURNED, PeriodOutcome.UNFINISHED):
        key = "sweep.overturns" if steady_state.outcome == PeriodOutcome.OVERTURNED else "sweep.given_up"
        return phrase(key, after=steady_state.periods)
    if steady_state.outcome == PeriodOutcome.RESTS_FOR_EVER:
        return phrase("sweep.still")
    if not steady_state.period:
        return phrase("sweep.no_period", longest=MAX_PERIOD)
    return phrase("sweep.period_rest" if steady_state.has_rest else "sweep.period", period=steady_state.period)


def describe_sweep(sweep: Sweep) -> dict[str, Any]:
    """Describe a sweep."""
    kind = AXES[sweep.axis.name]
    return {"name": kind.name, "label": phrase(f"axis.{kind.name}"), "values": sweep.axis.values.tolist()}


def sweep_point_to_texts(sweep: Sweep, value: float, state: tuple[float, float] | None) -> dict[str, str]:
    """Return the texts of the case at a value of the parameter, from a state (rotation, velocity) or from rest."""
    dropped = {*SCALINGS, "initial_rotation", "initial_velocity"}
    texts = {name: text for name, text in sweep.case.texts.items() if name not in dropped}
    sine, pulse = sweep.sine_at(value), read_pulse_arguments(texts["motion"])
    changes = {name: number for name, number in sine._asdict().items() if number != pulse.get(name, 0.0)}
    change_pulse(texts, **changes)
    if state is not None:
        texts |= {"initial_rotation": repr(state[0]), "initial_velocity": repr(state[1])}
    return texts


def write_sine_call(sweep: Sweep) -> str:
    """Write the call that creates one period of the sine; the parameter is a variable of its own name."""
    parameters: Mapping[str, str] = {
        name: repr(value) for name, value in sweep.sine._asdict().items() if value or name != "phase"
    }
    varied = {
        "a": {"amplitude": f"a * {find_uplift_threshold(sweep.case)!r}"},
        "omega": {"frequency": f"omega * {find_frequency_parameter(sweep.case)!r} / (2.0 * math.pi)"},
    }[sweep.axis.name]
    return write_pulse_call("sine:amplitude=1,frequency=1,cycles=1", {**parameters, **varied, "cycles": "1"})
