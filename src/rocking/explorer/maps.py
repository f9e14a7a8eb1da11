"""Maps of a case over two of its parameters, from coarse to fine, independent of the web."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from rocking.analysis.levels import RATIO_VARIABLES, compute_ratios
from rocking.analysis.overturning import classify_modes
from rocking.block import Block, Blocks
from rocking.block.sides import housner_restitution
from rocking.chattering.duration import critical_amplitude
from rocking.chattering.maps import UpliftOutcome, classify_uplifts, find_last_exceedance
from rocking.core.arrays import Floats, Integers, split_range
from rocking.core.constants import STANDARD_GRAVITY
from rocking.engine.problem import compute_uplift_thresholds
from rocking.engine.schemes import Certified
from rocking.engine.tasks import Setup, Task, simulate_tasks
from rocking.errors import OptionError
from rocking.explorer.inputs import Case, block_to_texts, check_peak_acceleration, reject_friction, require_rest
from rocking.explorer.motions import create_pulse, format_pulse, is_pulse, read_pulse_arguments
from rocking.explorer.parameters import BLOCK_NAMES, Texts, list_names, read_count
from rocking.explorer.payload import Payload
from rocking.inputs.declared import SCALINGS
from rocking.inputs.quantities import read_number
from rocking.motion.motion import Motion

#: Minimum and maximum number of points of an axis, and number by default.
_MIN_POINTS, _MAX_POINTS, _POINT_COUNT = 8, 400, 200

#: Number of points of a task: of a record, whose points are simulated together, and of another motion.
_RECORD_POINTS: Final = 256
_PULSE_POINTS: Final = 32


class AxisKind(NamedTuple):
    """Unit of a parameter of maps, and ends of its initial range."""

    unit: str
    low: float
    high: float


AXES: Final = {
    "omega": AxisKind("", 0.5, 8.0),
    "p": AxisKind("rad/s", 1.0, 6.0),
    "alpha": AxisKind("°", 5.0, 25.0),
    "restitution": AxisKind("", 0.5, 0.97),
    "a": AxisKind("", 0.5, 8.0),
    "pga": AxisKind("g", 0.1, 2.0),
}

#: Parameters of the motion's peak.
_PEAK_AXES: Final = {"a", "pga"}


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
    def names(self) -> set[str]:
        """Names of both parameters."""
        return {self.x.name, self.y.name}

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return self.y.values.size, self.x.values.size


def list_axes(case: Case) -> list[str]:
    """Return the names of the possible axes of a case."""
    motion, (plus, minus) = case.texts.get("motion", ""), case.block.sides
    has_frequency = is_pulse(motion) and "frequency" in read_pulse_arguments(motion)
    # Blocks of another slenderness, equal on both sides, can be derived from these.
    has_slenderness = "restitution" in case.texts or (
        plus.p == minus.p and not {"pivots", "offset", "mesh"} & case.texts.keys()
    )
    return [name for name in AXES if (name != "omega" or has_frequency) and (name != "alpha" or has_slenderness)]


def read_grid(case: Case, texts: Texts) -> MapGrid:
    """Read the axes of a map: ``x``, ``x_from``, ``x_to``, the same for ``y``, and the number of ``points`` of each."""
    if case.motion is None or case.motion.pga == 0.0:
        raise OptionError("a map needs something that shakes the block: choose a record or a pulse", "motion")
    reject_friction(case)
    x, y = (_read_axis(direction, case, texts) for direction in ("x", "y"))
    if x.name == y.name or {x.name, y.name} in ({"omega", "p"}, _PEAK_AXES):  # vary the same quantity
        raise OptionError("{} and {} vary the same: choose another pair of axes", x.name, y.name)
    grid = MapGrid(case, case.motion, x, y)
    blocks, factors, _ = _make_blocks(grid, x.values[-1:], y.values[-1:])
    require_rest(blocks.restitution[0])  # the highest comes to rest last
    check_peak_acceleration(float(factors[0]) * grid.motion.pga)
    return grid


def _read_axis(direction: str, case: Case, texts: Texts) -> Axis:
    axis_names, is_record = list_axes(case), not is_pulse(case.texts.get("motion", ""))
    name = texts.get(direction) or (("pga" if is_record else "a") if direction == "y" else axis_names[0])
    if name not in axis_names:
        reason = "; the slenderness of a mesh follows from its azimuth, which no map varies" if case.body else ""
        message = f"{{}}: this case is mapped over {', '.join(axis_names)}, not over {name[:20]!r}{reason}"
        raise OptionError(message, direction, value=name)
    if direction == "x" and name in _PEAK_AXES:
        raise OptionError("{}: amplitudes go upwards; choose another parameter for the axis to the right", "x")
    return read_range(name, texts, (f"{direction}_from", f"{direction}_to", "points"), _choose_ends(case, name))


def _choose_ends(case: Case, name: str) -> tuple[float, float]:
    """Return ends of an axis that contain the case."""
    (_, low, high), value = AXES[name], find_axis_value(case, name)
    if name == "a" and case.texts.get("motion", "").startswith("sine:") and 1.0 <= value <= 1.1:
        return 1.0, 1.1  # the chattering
    return (low, high) if low <= value <= high else (min(low, 0.5 * value), max(high, float(f"{1.5 * value:.2g}")))


def read_range(name: str, texts: Texts, keys: tuple[str, str, str], default_ends: tuple[float, float]) -> Axis:
    """Read the values of a parameter; the texts of the keys are its ends and number of values."""
    low, high = (read_number(texts.get(key) or repr(end), key) for key, end in zip(keys, default_ends, strict=False))
    count = read_count(texts.get(keys[2]) or str(_POINT_COUNT), keys[2], _MIN_POINTS, _MAX_POINTS)
    if not 0.0 < low < high < math.inf:
        message = f"{{}} must be positive and below {{}}; got {low:g} and {high:g}"
        raise OptionError(message, *keys[:2], value=low)
    return Axis(name, np.linspace(low, high, count))


def find_axis_value(case: Case, name: str) -> float:
    """Return the value of a parameter of a map in the case itself."""
    sides, pga = case.block.sides, 0.0 if case.motion is None else case.motion.pga
    p = min(side.p for side in sides)
    if name == "omega":
        return compute_angular_frequency(case) / p
    return {
        "p": p,
        "alpha": math.degrees(min(side.alpha for side in sides)),
        "restitution": sides[0].restitution,
        "a": pga / min(case.block.uplift_thresholds(case.model)),
        "pga": pga / STANDARD_GRAVITY,
    }[name]


def compute_angular_frequency(case: Case) -> float:
    """Return the angular frequency of the pulse of a case, rad/s."""
    return 2.0 * math.pi * float(read_pulse_arguments(case.texts["motion"])["frequency"])


def _make_blocks(grid: MapGrid, x: Floats, y: Floats) -> tuple[Blocks, Floats, Floats]:
    """Return blocks of points, factors on the motion, and factors that convert times to the times of the case."""
    case, points = grid.case, {grid.x.name: x, grid.y.name: y}
    sides = {
        name: np.tile([getattr(side, name) for side in case.block.sides], (x.size, 1))
        for name in ("p", "alpha", "restitution")
    }
    slowest, time_scale = float(sides["p"].min()), np.ones(x.size)
    if "p" in points:
        sides["p"] = points["p"][:, None] * (sides["p"] / slowest)
    if "omega" in points:
        # A pulse of another frequency is equivalent to another p, in other units of time.
        frequency_parameter = compute_angular_frequency(case) / points["omega"]
        sides["p"] = frequency_parameter[:, None] * (sides["p"] / slowest)
        time_scale = frequency_parameter / slowest
    if "alpha" in points:
        sides["alpha"] = np.repeat(np.radians(points["alpha"])[:, None], 2, axis=1)
        if "restitution" not in case.texts:
            sides["restitution"] = np.array([[housner_restitution(alpha)] * 2 for alpha in sides["alpha"][:, 0]])
    if "restitution" in points:
        sides["restitution"] = np.repeat(points["restitution"][:, None], 2, axis=1)
    blocks, factors = Blocks(**sides, gravity=case.block.gravity), np.ones(x.size)
    if "pga" in points:
        factors = points["pga"] * STANDARD_GRAVITY / grid.motion.pga
    elif "a" in points:
        factors = points["a"] * compute_uplift_thresholds(blocks, case.model)[0].min(axis=1) / grid.motion.pga
    return blocks, factors, time_scale


def simulate_grid(grid: MapGrid) -> Generator[Payload]:
    """Simulate the points of a grid from coarse to fine, and yield them as they are completed."""
    y, x = (values.ravel() for values in np.meshgrid(grid.y.values, grid.x.values, indexing="ij"))
    blocks, factors, time_scale = _make_blocks(grid, x, y)
    thresholds, _ = compute_uplift_thresholds(blocks, grid.case.model)
    conditions = np.column_stack([thresholds / factors[:, None], factors])
    last_exceedances: dict[tuple[float, ...], float | None] = {}

    def tasks() -> Iterator[Task]:
        for stride, indices in _list_indices(*grid.shape):
            for part in split_range(len(indices), _PULSE_POINTS if grid.motion.dt is None else _RECORD_POINTS):
                yield Task(indices[part], (grid.motion,), factors[indices[part]], key=stride)

    for task, results in simulate_tasks(Setup(blocks, grid.case.model, Certified()), tasks()):
        indices: Any = task.bodies
        outcome = np.empty(len(indices))
        for condition in np.unique(conditions[indices], axis=0):
            plus, minus, factor = key = tuple(condition.tolist())
            if key not in last_exceedances:
                gravity = blocks.gravity / factor if grid.motion.vertical else blocks.gravity
                last_exceedances[key] = find_last_exceedance(grid.motion, (plus, minus), gravity)
            is_alike = (conditions[indices] == condition).all(axis=1)
            outcome[is_alike] = classify_uplifts(results[is_alike], last_exceedances[key])
        rest_duration = (results["first_rest"] - results["first_uplift"]) * time_scale[indices]
        quantities = {
            "outcome": outcome,
            "rest": np.where(results["rests"] > 0, rest_duration, np.nan),
            "peak": compute_ratios(blocks.alpha[indices].min(axis=1), *(results[name] for name in RATIO_VARIABLES)),
            "mode": np.where(results["unfinished"], np.nan, classify_modes(results, grid.motion.duration)),
        }
        yield Payload({"stride": task.key}, {"points": indices.astype(float), **quantities})


def _list_indices(rows: int, columns: int) -> Iterator[tuple[int, Integers]]:
    """Yield the new points of a grid at each level, from coarse to fine."""
    is_done = np.zeros((rows, columns), dtype=bool)
    for stride in (8, 4, 2, 1):
        is_new = np.zeros_like(is_done)
        is_new[::stride, ::stride] = True
        yield stride, np.flatnonzero(is_new & ~is_done)
        is_done |= is_new


def compute_critical_amplitudes(grid: MapGrid) -> Floats | None:
    """Compute the critical amplitudes of a symmetric block along the x axis under a sine that starts at zero, or None.

    They hold for sines that last longer than half a period after the uplift.
    """
    text = grid.case.texts.get("motion", "")
    if not text.startswith("sine:") or not grid.case.block.is_symmetric or grid.y.name != "a":
        return None
    sine = read_pulse_arguments(text)
    if sine.get("phase") or sine["cycles"] < 1.0 or grid.x.name not in ("omega", "restitution"):
        return None
    axes: dict[str, Any] = {name: find_axis_value(grid.case, name) for name in ("omega", "restitution")}
    axes[grid.x.name] = grid.x.values
    amplitudes: Floats = critical_amplitude(axes["omega"], axes["restitution"])
    return amplitudes


def describe_map(grid: MapGrid) -> dict[str, Any]:
    """Describe a map: its axes and the case on them, the meanings of outcomes, and the critical amplitudes."""
    curve = compute_critical_amplitudes(grid)
    return {
        "shape": list(grid.shape),
        "axes": list_axes(grid.case),
        "x": _describe_axis(grid.x),
        "y": _describe_axis(grid.y),
        "case": [find_axis_value(grid.case, axis.name) for axis in (grid.x, grid.y)],
        "outcomes": [outcome.name.lower() for outcome in UpliftOutcome],
        "curve": None if curve is None else curve.tolist(),
    }


def _describe_axis(axis: Axis) -> dict[str, Any]:
    return {"name": axis.name, "unit": AXES[axis.name].unit, "values": axis.values.tolist()}


def map_point_to_texts(grid: MapGrid, x: float, y: float) -> dict[str, str]:
    """Return the texts at a point of the map: start at rest, full duration, and proof of each rest."""
    blocks, factors, time_scale = _make_blocks(grid, np.array([x]), np.array([y]))
    dropped = {*list_names("start", "treatment"), "duration"}
    texts = {name: text for name, text in grid.case.texts.items() if name not in dropped}
    if grid.names & {"p", "alpha", "restitution"}:
        texts = {name: text for name, text in texts.items() if name not in BLOCK_NAMES}
        p, alpha, restitution = blocks.p[0] / time_scale[0], blocks.alpha[0], blocks.restitution[0]
        texts |= block_to_texts(Block.from_parameters(p, alpha, restitution, gravity=blocks.gravity))
    if grid.names & {"omega", *_PEAK_AXES}:
        _change_motion(texts, grid, float(time_scale[0]), float(factors[0]) * grid.motion.pga)
    return texts


def _change_motion(texts: dict[str, str], grid: MapGrid, time_scale: float, peak: float) -> None:
    """Shorten the pulse of a case, and scale the motion to a peak acceleration, m/s^2, in its polarity."""
    scale, name = read_number(texts.get("scale", "1"), "scale"), texts["motion"]
    for scaling in SCALINGS:
        texts.pop(scaling, None)
    if not is_pulse(name):
        texts |= {"scale": repr(scale * peak / grid.motion.pga)} if scale < 0.0 else {"pga": repr(peak)}
        return
    pulse = read_pulse_arguments(name)
    pulse |= {key: pulse[key] * factor for key, factor in (("frequency", 1.0 / time_scale), ("duration", time_scale))
              if key in pulse}  # fmt: skip
    amplitude = math.copysign(1.0, scale) * pulse["amplitude"] * peak / create_pulse(format_pulse(name, pulse)).pga
    texts["motion"] = format_pulse(name, pulse | {"amplitude": amplitude})
