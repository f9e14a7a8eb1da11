"""A case under an infinite sine: periodic orbit in the phase plane, and bifurcation diagrams."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from rocking import pulses
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.dynamics.bifurcation import NOT_FOLLOWED, OVERTURNED, BifurcationDiagram, bifurcation_diagram
from rocking.dynamics.maps import stroboscopic_map
from rocking.dynamics.orbits import create_orbit
from rocking.errors import OptionError
from rocking.explorer.inputs import Case, check_peak_acceleration, reject_friction
from rocking.explorer.maps import AXES, Axis, read_range
from rocking.explorer.motions import create_pulse, format_pulse, read_pulse_arguments
from rocking.explorer.parameters import Texts
from rocking.explorer.payload import Payload
from rocking.inputs.declared import SCALINGS
from rocking.motion.motion import Motion
from rocking.response.figure import sample_interval

#: Parameters of diagrams, and the parameter of the sine that each varies.
SWEPT_INPUTS: Final = {"a": "amplitude", "omega": "frequency"}

#: Transient periods at each value of a diagram, and states recorded after them.
TRANSIENT_PERIOD_COUNT: Final = 299
RECORDED_PERIOD_COUNT: Final = 64

#: The same for a case without a period after those.
_LONG_TRANSIENT_COUNT, _MAX_STATES = 7000, 1024


class Sine(NamedTuple):
    """Sine by its parameters in SI units, with ``cycles``; a single cycle repeats for ever."""

    amplitude: float
    frequency: float
    phase: float
    cycles: float

    def create_period(self) -> Motion:
        """Create one period of the sine."""
        return pulses.sine(self.amplitude, self.frequency, cycles=1, phase=self.phase)


@dataclass(frozen=True, eq=False)
class Sweep:
    """Case, its sine, and the parameter of a diagram: ``a`` or ``omega`` of `maps.AXES`."""

    case: Case
    sine: Sine
    axis: Axis

    @property
    def unit(self) -> float:
        """Amplitude, m/s^2, or frequency, Hz, at which the parameter is 1."""
        return compute_units(self.case)[self.axis.name]

    def choose_sine(self, value: float) -> Sine:
        """Return the sine at a value of the parameter."""
        return self.sine._replace(**{"amplitude" if self.axis.name == "a" else "frequency": value * self.unit})

    def compute_diagram(self, values: Floats) -> BifurcationDiagram:
        """Compute the diagram upwards and downwards from rest."""
        return bifurcation_diagram(
            lambda value: (self.case.block, self.choose_sine(value).create_period()), values, (0.0, 0.0),
            direction="both", transient_periods=TRANSIENT_PERIOD_COUNT, recorded_periods=RECORDED_PERIOD_COUNT,
            model=self.case.model, chattering=self.case.chattering,
        )  # fmt: skip


def compute_units(case: Case) -> dict[str, float]:
    """Return the amplitude, m/s^2, of uplift, and the frequency, Hz, of the frequency parameter."""
    p = min(side.p for side in case.block.sides)
    return {"a": min(case.block.uplift_thresholds(case.model)), "omega": p / (2.0 * math.pi)}


def find_sine(case: Case) -> Sine:
    """Return the sine of a case, scaled like its motion."""
    text = case.texts.get("motion", "")
    if case.motion is None or text.partition(":")[0] != "sine":
        raise OptionError("periodic motion requires a sine, which repeats for ever: choose one in {}", "motion")
    pulse, unscaled = read_pulse_arguments(text), create_pulse(text).coefficients
    largest_index = np.unravel_index(np.argmax(np.abs(unscaled)), unscaled.shape)
    amplitude = pulse["amplitude"] * float(case.motion.coefficients[largest_index] / unscaled[largest_index])
    phase = pulse.get("phase", 0.0) + (math.pi if amplitude < 0.0 else 0.0)
    return Sine(abs(amplitude), pulse["frequency"], phase, pulse["cycles"])


def describe_orbit(case: Case) -> Payload:
    """Return the normalised phase plane of a case under its sine without end, and its orbit in words."""
    reject_friction(case)
    sine = find_sine(case)
    strobe = stroboscopic_map(case.block, sine.create_period(), model=case.model, chattering=case.chattering)
    start = tuple(case.options.get(f"initial_{name}", 0.0) for name in ("rotation", "velocity"))
    for transient, recorded in ((TRANSIENT_PERIOD_COUNT, RECORDED_PERIOD_COUNT), (_LONG_TRANSIENT_COUNT, _MAX_STATES)):
        data = bifurcation_diagram(
            lambda _: (case.block, strobe.motion), [1.0], start, direction="afresh", transient_periods=transient,
            recorded_periods=recorded, model=case.model, chattering=case.chattering,
        ).data  # fmt: skip
        period = data.period.item()
        if period:
            break
    states = np.stack([data.coordinate.values.ravel(), data.velocity.values.ravel()], axis=-1)
    arrays: dict[str, Floats] = {}
    if period > 0:
        orbit = create_orbit(strobe, states[-1], period)
        course = sample_interval(orbit.response, 0.0, orbit.response.duration)
        states, sentence = orbit.states, f"{orbit._format_headline().capitalize()}."
        arrays = {"rotation": course.rotation, "velocity": course.velocity, "jump": course.impact_rows.astype(float)}
    else:
        words = {OVERTURNED: "The block overturns", NOT_FOLLOWED: "The block requires too many steps"}
        text = words.get(period, f"No period up to {recorded // 2} was found")
        sentence = f"{text} within {transient + recorded} periods."
    normalised = normalise_states(case, states)
    header = {
        "sentence": sentence,
        "duration": 1.0 / sine.frequency,
        "at": {name: getattr(sine, SWEPT_INPUTS[name]) / unit for name, unit in compute_units(case).items()},
        "period": max(period, 0),
    }
    is_known = np.isfinite(states[:, 0])
    return Payload(header, arrays | {"x": normalised[is_known, 0], "y": normalised[is_known, 1]})


def normalise_states(case: Case, states: Floats) -> Floats:
    """Return rotations divided by slenderness, and velocities divided by p times slenderness, of their sides."""
    plus, minus = case.block.sides
    is_minus = (states[..., 0] < 0.0) | ((states[..., 0] == 0.0) & (states[..., 1] < 0.0))
    scales = [[side.alpha, side.alpha * side.p] for side in (plus, minus)]
    normalised: Floats = states / np.array(scales)[is_minus.astype(int)]
    return normalised


def read_sweep(case: Case, texts: Texts) -> Sweep:
    """Read a diagram: ``sweep`` (``a`` or ``omega``), ``sweep_from``, ``sweep_to``, and ``sweep_points``."""
    reject_friction(case)
    sine = find_sine(case)
    name = checks.choice(texts.get("sweep") or "a", "sweep", OptionError, [*SWEPT_INPUTS])
    omega = sine.frequency / compute_units(case)["omega"]
    ends = (0.9, float(f"{max(1.5, 2.5 * omega):.2g}")) if name == "a" else AXES["omega"][1:]
    sweep = Sweep(case, sine, read_range(name, texts, ("sweep_from", "sweep_to", "sweep_points"), ends))
    check_peak_acceleration(sweep.choose_sine(float(sweep.axis.values[-1])).amplitude)
    return sweep


def simulate_sweep(sweep: Sweep) -> Generator[Payload]:
    """Compute the diagram in decreasing steps."""
    values, share = sweep.axis.values, 0.0
    for stride in (8, 4, 2, 1):
        data = sweep.compute_diagram(values[::stride]).data.isel(start=0)
        share += 8.0 / stride / 15.0
        states = np.stack([data.coordinate.values, data.velocity.values], axis=-1)
        for d, direction in enumerate(data.direction.values.tolist()):
            periods, impact_counts = data.period.values[d].tolist(), data.impact_count.values[d].tolist()
            counts = [0 if period < 0 else period or RECORDED_PERIOD_COUNT for period in periods]
            kept = np.concatenate([states[d, k, RECORDED_PERIOD_COUNT - count :] for k, count in enumerate(counts)])
            header = {
                "stride": stride,
                "share": share - (d == 0) * 4.0 / stride / 15.0,
                "direction": direction,
                "indices": [*range(0, len(values), stride)],
                "counts": counts,
                "words": [_describe_period(*pair) for pair in zip(periods, impact_counts, strict=True)],
                "overturned": [period == OVERTURNED for period in periods],
            }
            yield Payload(header, {"states": kept.ravel(), "drawn": normalise_states(sweep.case, kept)[:, 0]})


def _describe_period(period: int, impact_count: float) -> str:
    if period <= 0:
        return {OVERTURNED: "overturns", NOT_FOLLOWED: "requires too many steps", 0: "no period found"}[period]
    if not impact_count:
        return "stays at rest"
    return f"period {period}, with complete chattering" if math.isinf(impact_count) else f"period {period}"


def sweep_point_to_texts(sweep: Sweep, value: float, state: Sequence[float] = ()) -> dict[str, str]:
    """Return the texts of the case at a value of the parameter, from a state (or from rest)."""
    dropped = {*SCALINGS, "initial_rotation", "initial_velocity"}
    texts = {name: text for name, text in sweep.case.texts.items() if name not in dropped}
    texts["motion"] = format_pulse("sine", sweep.choose_sine(value)._asdict())
    if len(state):
        texts |= {"initial_rotation": repr(state[0]), "initial_velocity": repr(state[1])}
    return texts
