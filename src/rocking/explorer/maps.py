"""Maps of a case over two of its parameters, from coarse to fine, independent of the web."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from rocking.analysis.levels import RATIO_VARIABLES, compute_ratios
from rocking.analysis.overturning import classify_modes
from rocking.block import Blocks
from rocking.block.sides import housner_restitution
from rocking.chattering.duration import critical_amplitude
from rocking.chattering.maps import UpliftOutcome, classify_uplifts, find_last_exceedance
from rocking.core.arrays import Flags, Floats, split_range
from rocking.core.constants import STANDARD_GRAVITY
from rocking.engine.schemes import FITTED_FREQUENCIES, FITTED_RESTITUTIONS, Certified
from rocking.engine.tasks import Setup, Task, simulate_tasks
from rocking.errors import OptionError
from rocking.explorer.inputs import Case, require_possible, require_rest, require_sticking
from rocking.explorer.motions import create_pulse, is_pulse, read_pulse_arguments, write_pulse
from rocking.explorer.parameters import BLOCK_NAMES, QUANTITIES, Texts, list_names
from rocking.explorer.payload import Payload, phrase
from rocking.inputs.declared import SCALINGS
from rocking.inputs.pulses import split_pulse
from rocking.inputs.quantities import read_number
from rocking.motion.motion import Motion

#: Minimum and maximum number of points of an axis.
_MIN_POINTS, _MAX_POINTS = 8, 400


@dataclass(frozen=True)
class AxisKind:
    """Parameter of a map, with its initial ranges: close for chattering, wide for overturning."""

    name: str
    unit: str
    close: tuple[float, float]
    wide: tuple[float, float]


AXES: Final = {
    kind.name: kind
    for kind in (
        AxisKind("omega", "", (0.5, 8.0), (0.5, 8.0)),
        AxisKind("p", "rad/s", (1.0, 6.0), (1.0, 6.0)),
        AxisKind("alpha", "°", (5.0, 25.0), (5.0, 25.0)),
        AxisKind("restitution", "", (0.5, 0.97), (0.5, 0.97)),
        AxisKind("a", "", (1.0, 1.1), (0.5, 8.0)),
        AxisKind("pga", "g", (0.1, 1.0), (0.1, 2.0)),
    )
}


class Axis(NamedTuple):
    """Parameter and its values."""

    name: str
    values: Floats


@dataclass(frozen=True, eq=False)
class MapGrid:
    """Case, its ground motion, and the two parameters of its map: horizontal and vertical."""

    case: Case
    motion: Motion
    x: Axis
    y: Axis

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return self.y.values.size, self.x.values.size


#: Number of points of a task: of a record, whose points are simulated together, and of another motion.
_RECORD_POINTS: Final = 256
_PULSE_POINTS: Final = 32


def list_axes(case: Case) -> list[str]:
    """Return the names of the possible axes of a case."""
    motion = case.texts.get("motion", "")
    unusable = set() if is_pulse(motion) and "frequency" in read_pulse_arguments(motion) else {"omega"}
    return [name for name in AXES if name not in unusable and (name != "alpha" or _has_one_slenderness(case))]


def _has_one_slenderness(case: Case) -> bool:
    """Whether blocks of another slenderness, equal on both sides, can be derived from this one."""
    plus, minus = case.block.sides
    return "restitution" in case.texts or (plus.p == minus.p and not {"pivots", "offset", "mesh"} & case.texts.keys())


def read_grid(case: Case, texts: Texts) -> MapGrid:
    """Read the axes of a map: ``x``, ``x_from``, ``x_to``, the same for ``y``, and the number of ``points`` of each."""
    if case.motion is None or case.motion.pga == 0.0:
        raise OptionError("a map needs something that shakes the block: choose a record or a pulse", "motion")
    require_sticking(case)
    x, y = (_read_axis(direction, case, texts) for direction in ("x", "y"))
    if x.name == y.name or {x.name, y.name} in ({"omega", "p"}, {"a", "pga"}):  # vary the same quantity
        raise OptionError("{} and {} vary the same: choose another pair of axes", x.name, y.name)
    # Blocks of a map over the restitution have equal sides, and the highest restitution comes to rest last.
    eta = [float(axis.values[-1]) for axis in (x, y) if axis.name == "restitution"]
    require_rest(eta * 2 or [side.restitution for side in case.block.sides])
    grid = MapGrid(case, case.motion, x, y)
    peak = _compute_peak(grid, {axis.name: float(axis.values[-1]) for axis in (x, y)})
    require_possible(grid.motion.pga if peak is None else peak)
    return grid


def simulate_grid(grid: MapGrid) -> Generator[Payload]:
    """Simulate the points of a grid from coarse to fine, and yield them as they are completed."""
    blocks, factors, time_scale = _make_blocks(grid)
    setup = Setup(blocks, grid.case.model, Certified())
    exceedances: dict[tuple[tuple[float, float], float], float | None] = {}
    for task, results in simulate_tasks(setup, _list_tasks(grid, factors)):
        indices, stride = task.bodies, task.key
        assert isinstance(indices, np.ndarray) and isinstance(stride, int)
        alpha = blocks.alpha[indices]
        conditions = np.column_stack([_compute_uplift_thresholds(alpha, grid), factors[indices]])
        outcome = np.empty(len(indices))
        for condition in np.unique(conditions, axis=0):
            has_thresholds = (conditions == condition).all(axis=1)
            factor = float(condition[-1])
            scaled_thresholds = _scale_thresholds(grid, condition[:-1] / factor, factor)
            if scaled_thresholds not in exceedances:
                exceedances[scaled_thresholds] = find_last_exceedance(grid.motion, *scaled_thresholds)
            outcome[has_thresholds] = classify_uplifts(results[has_thresholds], exceedances[scaled_thresholds])
        rest_duration = (results["first_rest"] - results["first_uplift"]) * time_scale[indices]
        quantities = {
            "outcome": outcome,
            "rest": np.where(results["rests"] > 0, rest_duration, np.nan),
            "peak": compute_ratios(alpha.min(axis=1), *(results[name] for name in RATIO_VARIABLES)),
            "mode": np.where(results["unfinished"], np.nan, classify_modes(results, grid.motion.duration)),
        }
        yield Payload({"stride": stride}, {"points": indices.astype(float), **quantities})


def _scale_thresholds(grid: MapGrid, thresholds: Floats, factor: float) -> tuple[tuple[float, float], float]:
    """Return thresholds (m/s^2), and gravity, divided by the factor of the motion if there is a vertical component."""
    gravity = grid.case.block.gravity
    return (float(thresholds[0]), float(thresholds[1])), gravity / factor if grid.motion.vertical else gravity


def compute_critical_curves(grid: MapGrid) -> dict[str, Floats]:
    """Compute critical amplitudes of a symmetric block under a sine along the x axis: exact, and by the paper's Eq. 76.

    NaN where the sine of that amplitude lifts the block at its start, or ends before half a period.
    """
    case = grid.case
    motion = case.texts.get("motion", "")
    if not motion.startswith("sine:") or grid.y.name != "a" or not case.block.is_symmetric:
        return {}
    if grid.x.name not in ("omega", "restitution"):
        return {}
    side = case.block.sides[0]
    size = grid.x.values.size
    omega = np.full(size, 2.0 * math.pi * read_pulse_arguments(motion)["frequency"] / side.p)
    eta = np.full(size, side.restitution)
    omega, eta = (grid.x.values, eta) if grid.x.name == "omega" else (omega, grid.x.values)
    amplitudes = {"exact": critical_amplitude(omega, eta), "eq76": np.full(omega.size, np.nan)}
    (low, high), (min_restitution, max_restitution) = FITTED_FREQUENCIES, FITTED_RESTITUTIONS
    is_fitted = (omega >= low) & (omega <= high) & (eta >= min_restitution) & (eta <= max_restitution)
    amplitudes["eq76"][is_fitted] = critical_amplitude(omega[is_fitted], eta[is_fitted], method="eq76")
    for values in amplitudes.values():
        values[~_is_lifted_in_time(values, **read_pulse_arguments(motion))] = np.nan
    return amplitudes if np.isfinite(amplitudes["exact"]).any() else {}


def _is_lifted_in_time(amplitudes: Floats, *, cycles: float, phase: float = 0.0, **_: float) -> Flags:
    """Whether a sine of amplitudes above the threshold passes it from below, more than half a period before its end."""
    uplift_phase = np.arcsin(1.0 / amplitudes)
    start_phase = phase % math.pi  # each half of the sine is the mirror image of the previous one
    starts_below = (start_phase < uplift_phase) | (start_phase > math.pi - uplift_phase)
    uplift_after = np.where(start_phase < uplift_phase, uplift_phase, math.pi + uplift_phase) - start_phase
    is_lifted: Flags = starts_below & (uplift_after + math.pi < 2.0 * math.pi * cycles)
    return is_lifted


def map_point_to_texts(grid: MapGrid, x: float, y: float) -> dict[str, str]:
    """Return the texts at a point of the map: start at rest, full duration, and proof of each rest."""
    dropped = {*list_names("start", "treatment"), "duration"}
    texts = {name: text for name, text in grid.case.texts.items() if name not in dropped}
    point = {grid.x.name: x, grid.y.name: y}
    for name in ("p", "alpha", "restitution"):
        if name in point:
            _change_block(texts, grid, name, point[name])
    if "omega" in point:
        p = min(side.p for side in grid.case.block.sides)
        change_pulse(texts, frequency=point["omega"] * p / (2.0 * math.pi))
    peak = _compute_peak(grid, point)
    if peak is not None:
        _change_amplitude(texts, grid, peak)
    return texts


def _compute_peak(grid: MapGrid, point: Mapping[str, float]) -> float | None:
    """Return the peak acceleration at a point of the map, m/s^2, or None if the motion is unchanged."""
    if "a" in point:
        return point["a"] * _find_uplift_threshold(grid, math.radians(point["alpha"]) if "alpha" in point else None)
    if "pga" in point:
        return point["pga"] * STANDARD_GRAVITY
    # The amplitude of some pulses is not an acceleration, and the scale of a pulse may depend on its frequency.
    return grid.motion.pga if "omega" in point else None


def find_axis_value(case: Case, name: str) -> float:
    """Return the value of a parameter of a map in the case itself."""
    block, motion = case.block, case.motion
    p = min(side.p for side in block.sides)
    pga = 0.0 if motion is None else motion.pga
    if name == "omega":
        return 2.0 * math.pi * float(read_pulse_arguments(case.texts["motion"])["frequency"]) / p
    if name == "a":
        return pga / min(block.uplift_thresholds(case.model))
    values: dict[str, float] = {
        "p": p,
        "alpha": math.degrees(min(side.alpha for side in block.sides)),
        "restitution": block.sides[0].restitution,
        "pga": pga / STANDARD_GRAVITY,
    }
    return values[name]


def _choose_ends(case: Case, name: str) -> tuple[float, float]:
    """Return ends of an axis that contain the case: close ones for the chattering under a sine, else wide ones."""
    kind, value = AXES[name], find_axis_value(case, name)
    if case.texts.get("motion", "").startswith("sine:") and kind.close[0] <= value <= kind.close[1]:
        return kind.close
    low, high = kind.wide
    return (low, high) if low <= value <= high else (min(low, 0.5 * value), max(high, float(f"{1.5 * value:.2g}")))


def describe_axes() -> list[dict[str, Any]]:
    """Describe all axes that a map may have."""
    return [{"name": kind.name, "unit": kind.unit, "label": phrase(f"axis.{kind.name}")} for kind in AXES.values()]


def read_polarity(texts: Texts) -> float:
    """Return -1 if the scale of a case reverses its motion, else 1."""
    return math.copysign(1.0, read_number(texts.get("scale", "1"), "scale"))


def describe_map(grid: MapGrid) -> dict[str, Any]:
    """Describe a map: its axes, the meaning of outcome and mode numbers, and the differences from the case."""
    case, notes = grid.case, []
    has_initial_state = case.initial_rotation or case.initial_velocity
    if has_initial_state or case.duration is not None or str(case.chattering) != str(Certified()):
        notes.append(phrase("map.begins"))
    if "alpha" not in (grid.x.name, grid.y.name) and len({side.alpha for side in case.block.sides}) > 1:
        notes.append(phrase("map.smaller_alpha"))
    return {
        "notes": notes,
        "shape": list(grid.shape),
        "axes": list_axes(case),
        "x": _describe_axis(grid.x),
        "y": _describe_axis(grid.y),
        "quantities": list(QUANTITIES),
        "case": [find_axis_value(case, axis.name) for axis in (grid.x, grid.y)],
        "outcomes": [outcome.name.lower() for outcome in UpliftOutcome],
        "curves": {
            name: [None if math.isnan(v) else v for v in values]
            for name, values in compute_critical_curves(grid).items()
        },
    }


def _describe_axis(axis: Axis) -> dict[str, Any]:
    kind = AXES[axis.name]
    return {"name": axis.name, "label": phrase(f"axis.{kind.name}"), "unit": kind.unit, "values": axis.values.tolist()}


def _read_axis(direction: str, case: Case, texts: Texts) -> Axis:
    possible = list_axes(case)
    amplitude = "a" if is_pulse(case.texts.get("motion", "")) else "pga"
    name = texts.get(direction) or (amplitude if direction == "y" else possible[0])
    if name not in possible:
        reason = "; the slenderness of a mesh follows from its azimuth, which no map varies" if case.body else ""
        message = f"{{}}: this case is mapped over {', '.join(possible)}, not over {name[:20]!r}{reason}"
        raise OptionError(message, direction, value=name)
    if direction == "x" and name in ("a", "pga"):
        raise OptionError("{}: amplitudes go upwards; choose another parameter for the axis to the right", "x")
    return read_range(name, texts, (f"{direction}_from", f"{direction}_to", "points"), _choose_ends(case, name))


def read_range(name: str, texts: Texts, keys: tuple[str, str, str], default_ends: tuple[float, float]) -> Axis:
    """Read the values of a parameter; the texts of the keys are its ends (by default `ends`) and number of values."""
    low, high, count = (
        read_number(texts.get(key) or repr(default), key)
        for key, default in zip(keys, (*default_ends, 200), strict=True)
    )
    if not (_MIN_POINTS <= count <= _MAX_POINTS and count == int(count)):
        raise OptionError(
            f"{{}} must be a whole number from {_MIN_POINTS} to {_MAX_POINTS}, not {count:g}", keys[2], value=count
        )
    if not 0.0 < low < high < math.inf:
        raise OptionError(f"{{}} must be positive and below {{}}; got {low:g} and {high:g}", *keys[:2], value=low)
    return Axis(name, np.linspace(low, high, int(count)))


def _make_blocks(grid: MapGrid) -> tuple[Blocks, Floats, Floats]:
    """Return blocks row by row, factors on the motion, and factors that convert times to the times of the case."""
    case = grid.case
    y, x = (values.ravel() for values in np.meshgrid(grid.y.values, grid.x.values, indexing="ij"))
    points = {grid.x.name: x, grid.y.name: y}
    sides = {
        name: np.tile([getattr(side, name) for side in case.block.sides], (x.size, 1))
        for name in ("p", "alpha", "restitution")
    }
    min_p = sides["p"].min(axis=1, keepdims=True)
    time_scale = np.ones(x.size)
    if "p" in points:
        sides["p"] = points["p"][:, None] * (sides["p"] / min_p)
    if "omega" in points:
        # A pulse of another frequency is equivalent to another p, in other units of time.
        frequency = read_pulse_arguments(case.texts["motion"])["frequency"]
        frequency_parameter = 2.0 * math.pi * frequency / points["omega"][:, None]
        time_scale = (frequency_parameter / min_p)[:, 0]
        sides["p"] = frequency_parameter * (sides["p"] / min_p)
    if "alpha" in points:
        sides["alpha"] = np.repeat(np.radians(points["alpha"])[:, None], 2, axis=1)
        if "restitution" not in case.texts:
            sides["restitution"] = np.array([[housner_restitution(alpha)] * 2 for alpha in sides["alpha"][:, 0]])
    if "restitution" in points:
        sides["restitution"] = np.repeat(points["restitution"][:, None], 2, axis=1)
    factors = np.ones(x.size)
    if "pga" in points:
        factors = points["pga"] * STANDARD_GRAVITY / grid.motion.pga
    elif "a" in points:
        factors = points["a"] * _compute_uplift_thresholds(sides["alpha"], grid).min(axis=1) / grid.motion.pga
    return Blocks(**sides, gravity=case.block.gravity), factors, time_scale


def _compute_uplift_thresholds(alpha: Floats, grid: MapGrid) -> Floats:
    """Return the uplift accelerations, m/s^2, of blocks of these slendernesses, shape (n, 2)."""
    slopes: Floats = alpha if grid.case.model == "linear" else np.tan(alpha)
    return grid.case.block.gravity * slopes


def _find_uplift_threshold(grid: MapGrid, alpha: float | None) -> float:
    """Return the smallest uplift acceleration, m/s^2, of the case's block, or for another slenderness."""
    if alpha is None:
        return min(grid.case.block.uplift_thresholds(grid.case.model))
    return float(_compute_uplift_thresholds(np.array([[alpha]]), grid)[0, 0])


def _list_tasks(grid: MapGrid, factors: Floats) -> Iterator[Task]:
    """Yield tasks from coarse to fine levels, with few enough points for frequent updates of the page."""
    rows, columns = grid.shape
    for level, stride in enumerate((8, 4, 2, 1)):
        points = []
        for row in range(0, rows, stride):
            refines = level > 0 and row % (2 * stride) == 0
            points.append(row * columns + np.arange(stride * refines, columns, stride * (1 + refines)))
        indices = np.concatenate(points)
        for part in split_range(len(indices), _PULSE_POINTS if grid.motion.dt is None else _RECORD_POINTS):
            yield Task(indices[part], (grid.motion,), factors[indices[part]], key=stride)


def _change_block(texts: dict[str, str], grid: MapGrid, name: str, value: float) -> None:
    sides = grid.case.block.sides
    if "alpha" not in (grid.x.name, grid.y.name) and (
        not grid.case.block.is_symmetric or {"pivots", "mesh"} & texts.keys()
    ):
        texts.setdefault("restitution", _join_values([side.restitution for side in sides]))
    if "p" not in texts:
        texts["p"], texts["alpha"] = (_join_values([getattr(side, name) for side in sides]) for name in ("p", "alpha"))
        for unused_name in BLOCK_NAMES - {"p", "alpha", "restitution"}:
            texts.pop(unused_name, None)
    if name == "p":
        min_p = min(side.p for side in sides)
        texts["p"] = _join_values([value * (side.p / min_p) for side in sides])
    elif name == "alpha":
        texts["alpha"] = f"{value!r}deg"
    else:
        texts["restitution"] = repr(value)


def _join_values(values: list[float]) -> str:
    return ",".join(map(repr, values if values[0] != values[1] else values[:1]))


def change_pulse(texts: dict[str, str], **numbers: float) -> None:
    """Change parameters of the pulse in the texts of a case; a truncated pulse keeps its number of cycles."""
    arguments = read_pulse_arguments(texts["motion"])
    if "duration" in arguments and "frequency" in numbers:
        numbers["duration"] = arguments["duration"] * arguments["frequency"] / numbers["frequency"]
    _, written = split_pulse(texts["motion"])
    current: dict[str, Any] = {name: ",".join(values) for name, values in written.items() if name in arguments}
    texts["motion"] = write_pulse(texts["motion"], current | numbers)


def _change_amplitude(texts: dict[str, str], grid: MapGrid, peak: float) -> None:
    """Scale the motion to a peak acceleration, m/s^2, in its polarity: pulses by amplitude, records by scale."""
    scale, sign = read_number(texts.get("scale", "1"), "scale"), read_polarity(texts)
    for name in SCALINGS:
        texts.pop(name, None)
    if is_pulse(texts["motion"]):
        amplitude = sign * read_pulse_arguments(texts["motion"])["amplitude"]
        change_pulse(texts, amplitude=amplitude * peak / create_pulse(texts["motion"]).pga)
    elif sign < 0.0:
        texts["scale"] = repr(scale * peak / grid.motion.pga)
    else:
        texts["pga"] = repr(peak)
