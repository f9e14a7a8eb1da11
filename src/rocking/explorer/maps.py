"""Maps of a case over two of its parameters, from coarse to fine, independent of the web."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rocking.analysis.levels import ratios_of
from rocking.analysis.overturning import modes_of
from rocking.block import Blocks
from rocking.block.sides import housner_restitution
from rocking.chattering.duration import critical_amplitude
from rocking.chattering.maps import Outcome, last_exceedance, outcomes_of
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.constants import STANDARD_GRAVITY
from rocking.engine.schemes import FITTED_FREQUENCIES, FITTED_RESTITUTIONS, Certified
from rocking.engine.tasks import Setup, Task, simulate_tasks
from rocking.errors import InvalidOption
from rocking.explorer.inputs import Case, require_possible, require_rest
from rocking.explorer.motions import arguments_of, is_pulse, pulse_of, pulse_text
from rocking.explorer.parameters import BLOCK_NAMES, QUANTITIES, Texts, names_of
from rocking.explorer.payload import phrase
from rocking.inputs.declared import SCALINGS
from rocking.inputs.pulses import pulse_texts
from rocking.inputs.quantities import number
from rocking.motion.motion import Motion

#: Minimum and maximum number of points of an axis.
_FEWEST, _MOST = 8, 400


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


class Part(NamedTuple):
    """Some points of a map: spacing, indices, and quantities."""

    stride: int
    points: Integers
    values: NDArray[np.float32]


def axes_of(case: Case) -> list[str]:
    """Return the names of the possible axes of a case."""
    if case.motion is None:
        return []
    pulse = is_pulse(case.texts.get("motion", ""))
    frequency = pulse and "frequency" in arguments_of(case.texts["motion"])
    unusable = set() if frequency else {"omega"}
    if not _has_one_slenderness(case):
        unusable.add("alpha")
    return [name for name in AXES if name not in unusable]


def _has_one_slenderness(case: Case) -> bool:
    """Whether blocks of another slenderness, equal on both sides, can be derived from this one."""
    plus, minus = case.block.sides
    return "restitution" in case.texts or (plus.p == minus.p and not {"pivots", "offset", "mesh"} & case.texts.keys())


def grid_of(case: Case, texts: Texts) -> MapGrid:
    """Read the axes of a map: ``x``, ``x_from``, ``x_to``, the same for ``y``, and the number of ``points`` of each."""
    if case.motion is None or case.motion.pga == 0.0:
        raise InvalidOption("a map needs something that shakes the block: choose a record or a pulse", "motion")
    x, y = (_axis(which, case, texts) for which in ("x", "y"))
    if x.name == y.name or {x.name, y.name} in ({"omega", "p"}, {"a", "pga"}):  # pairs that vary the same quantity
        raise InvalidOption("{} and {} vary the same: choose another pair of axes", x.name, y.name)
    # Blocks of a map over the restitution have equal sides, and the highest restitution comes to rest last.
    eta = [float(axis.values[-1]) for axis in (x, y) if axis.name == "restitution"]
    require_rest(eta * 2 or [side.restitution for side in case.block.sides])
    grid = MapGrid(case, case.motion, x, y)
    highest = _peak_at(grid, {axis.name: float(axis.values[-1]) for axis in (x, y)})
    require_possible(grid.motion.pga if highest is None else highest)
    return grid


def parts(grid: MapGrid) -> Generator[Part]:
    """Simulate the points of a grid from coarse to fine, and yield them as they are completed."""
    blocks, factors, scale = _points(grid)
    setup = Setup(blocks, grid.case.model, Certified())
    last: dict[tuple[tuple[float, float], float], float | None] = {}
    for task, ends in simulate_tasks(setup, _tasks(grid, factors)):
        chosen = task.bodies
        assert isinstance(chosen, np.ndarray)
        alpha = blocks.alpha[chosen]
        thresholds = _thresholds(alpha, grid)
        outcome = np.empty(len(chosen))
        for pair in np.unique(thresholds, axis=0):
            here = (thresholds == pair).all(axis=1)
            passed = _passed(grid, pair / task.factor, task.factor)
            if passed not in last:
                last[passed] = last_exceedance(grid.motion, *passed)
            outcome[here] = outcomes_of(ends[here], last[passed])
        rest = (ends["first_rest"] - ends["first_uplift"]) * scale[chosen]
        quantities = {
            "outcome": outcome,
            "rest": np.where(ends["rests"] > 0, rest, np.nan),
            "peak": ratios_of(ends["peak_rotation"], ends["overturned"], ends["unfinished"], alpha.min(axis=1)),
            "mode": np.where(ends["unfinished"], np.nan, modes_of(ends, grid.motion.duration)),
        }
        values = np.array([quantities[name] for name in QUANTITIES], np.float32)
        yield Part(task.key[0], chosen, values)


def _passed(grid: MapGrid, thresholds: Floats, factor: float) -> tuple[tuple[float, float], float]:
    """Return thresholds (m/s^2), and gravity, divided by the factor of the motion if there is a vertical component."""
    gravity = grid.case.block.gravity
    return (float(thresholds[0]), float(thresholds[1])), gravity / factor if grid.motion.vertical else gravity


def curves(grid: MapGrid) -> dict[str, Floats]:
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
    omega = np.full(size, 2.0 * math.pi * arguments_of(motion)["frequency"] / side.p)
    eta = np.full(size, side.restitution)
    omega, eta = (grid.x.values, eta) if grid.x.name == "omega" else (omega, grid.x.values)
    found = {"exact": critical_amplitude(omega, eta), "eq76": np.full(omega.size, np.nan)}
    (low, high), (least, most) = FITTED_FREQUENCIES, FITTED_RESTITUTIONS
    fitted = (omega >= low) & (omega <= high) & (eta >= least) & (eta <= most)
    found["eq76"][fitted] = critical_amplitude(omega[fitted], eta[fitted], method="eq76")
    for values in found.values():
        values[~_is_lifted_in_time(values, **arguments_of(motion))] = np.nan
    return found if np.isfinite(found["exact"]).any() else {}


def _is_lifted_in_time(a: Floats, *, cycles: float, phase: float = 0.0, **_: float) -> Flags:
    """Whether a sine of amplitudes above the threshold passes it from below, more than half a period before its end."""
    lifts = np.arcsin(1.0 / a)
    begins = phase % math.pi  # each half of the sine is the mirror image of the previous one
    below = (begins < lifts) | (begins > math.pi - lifts)
    uplift = np.where(begins < lifts, lifts, math.pi + lifts) - begins
    found: Flags = below & (uplift + math.pi < 2.0 * math.pi * cycles)
    return found


def texts_at(grid: MapGrid, x: float, y: float) -> dict[str, str]:
    """Return the texts at a point of the map: start at rest, full duration, and proof of each rest."""
    gone = {*names_of("start", "treatment"), "duration"}
    texts = {name: text for name, text in grid.case.texts.items() if name not in gone}
    at = {grid.x.name: x, grid.y.name: y}
    for name in ("p", "alpha", "restitution"):
        if name in at:
            _change_block(texts, grid, name, at[name])
    if "omega" in at:
        p = min(side.p for side in grid.case.block.sides)
        change_pulse(texts, frequency=at["omega"] * p / (2.0 * math.pi))
    peak = _peak_at(grid, at)
    if peak is not None:
        _change_amplitude(texts, grid, peak)
    return texts


def _peak_at(grid: MapGrid, at: Mapping[str, float]) -> float | None:
    """Return the peak acceleration at a point of the map, m/s^2, or None if the motion is unchanged."""
    if "a" in at:
        return at["a"] * _lifting(grid, math.radians(at["alpha"]) if "alpha" in at else None)
    if "pga" in at:
        return at["pga"] * STANDARD_GRAVITY
    # The amplitude of some pulses is not an acceleration, and the scale of a pulse may depend on its frequency.
    return grid.motion.pga if "omega" in at else None


def sign_of(texts: Texts) -> float:
    """Return -1 if the scale of a case reverses its motion, else 1."""
    return math.copysign(1.0, number(texts.get("scale", "1"), "scale"))


def described(grid: MapGrid) -> dict[str, Any]:
    """Describe a map: its axes, the meaning of outcome and mode numbers, and the differences from the case."""
    case, notes = grid.case, []
    begins = case.initial_rotation or case.initial_velocity
    if begins or case.duration is not None or str(case.chattering) != str(Certified()):
        notes.append(phrase("map.begins"))
    if "alpha" not in (grid.x.name, grid.y.name) and len({side.alpha for side in case.block.sides}) > 1:
        notes.append(phrase("map.smaller_alpha"))
    return {
        "notes": notes,
        "shape": list(grid.shape),
        "x": _described(grid.x),
        "y": _described(grid.y),
        "quantities": list(QUANTITIES),
        "outcomes": [outcome.name.lower() for outcome in Outcome],
        "curves": {name: [None if math.isnan(v) else v for v in values] for name, values in curves(grid).items()},
    }


def _described(axis: Axis) -> dict[str, Any]:
    kind = AXES[axis.name]
    return {"name": axis.name, "label": phrase(f"axis.{kind.name}"), "unit": kind.unit, "values": axis.values.tolist()}


def _axis(which: str, case: Case, texts: Texts) -> Axis:
    name = texts.get(which, "")
    if name not in axes_of(case):
        why = "; the slenderness of a mesh follows from its azimuth, which no map varies" if case.body else ""
        raise InvalidOption(f"this case is mapped over {', '.join(axes_of(case))}, not over {name[:20]!r}{why}")
    if which == "x" and name in ("a", "pga"):
        raise InvalidOption("amplitudes go upwards: choose another parameter for the axis to the right")
    return axis_of(name, texts, (f"{which}_from", f"{which}_to", "points"), AXES[name].close)


def axis_of(name: str, texts: Texts, keys: tuple[str, str, str], ends: tuple[float, float]) -> Axis:
    """Read the values of a parameter; the texts of the keys are its ends (by default `ends`) and number of values."""
    low, high, count = (
        number(texts.get(key) or repr(usual), key) for key, usual in zip(keys, (*ends, 200), strict=True)
    )
    if not (_FEWEST <= count <= _MOST and count == int(count)):
        raise InvalidOption(
            f"{{}} must be a whole number from {_FEWEST} to {_MOST}, not {count:g}", keys[2], value=count
        )
    if not 0.0 < low < high < math.inf:
        raise InvalidOption(f"{{}} must be positive and below {{}}; got {low:g} and {high:g}", *keys[:2], value=low)
    return Axis(name, np.linspace(low, high, int(count)))


def _points(grid: MapGrid) -> tuple[Blocks, Floats, Floats]:
    """Return blocks row by row, factors on the motion, and factors that convert times to the times of the case."""
    case = grid.case
    y, x = (values.ravel() for values in np.meshgrid(grid.y.values, grid.x.values, indexing="ij"))
    at = {grid.x.name: x, grid.y.name: y}
    sides = {
        name: np.tile([getattr(side, name) for side in case.block.sides], (x.size, 1))
        for name in ("p", "alpha", "restitution")
    }
    slowest = sides["p"].min(axis=1, keepdims=True)
    scale = np.ones(x.size)
    if "p" in at:
        sides["p"] = at["p"][:, None] * (sides["p"] / slowest)
    if "omega" in at:
        # A pulse of another frequency is equivalent to another p, in other units of time.
        frequency = arguments_of(case.texts["motion"])["frequency"]
        resized = 2.0 * math.pi * frequency / at["omega"][:, None]
        scale = (resized / slowest)[:, 0]
        sides["p"] = resized * (sides["p"] / slowest)
    if "alpha" in at:
        sides["alpha"] = np.repeat(np.radians(at["alpha"])[:, None], 2, axis=1)
        if "restitution" not in case.texts:
            sides["restitution"] = np.array([[housner_restitution(alpha)] * 2 for alpha in sides["alpha"][:, 0]])
    if "restitution" in at:
        sides["restitution"] = np.repeat(at["restitution"][:, None], 2, axis=1)
    factors = np.ones(x.size)
    if "pga" in at:
        factors = at["pga"] * STANDARD_GRAVITY / grid.motion.pga
    elif "a" in at:
        factors = at["a"] * _thresholds(sides["alpha"], grid).min(axis=1) / grid.motion.pga
    return Blocks(**sides, gravity=case.block.gravity), factors, scale


def _thresholds(alpha: Floats, grid: MapGrid) -> Floats:
    """Return the uplift accelerations, m/s^2, of blocks of these slendernesses, shape (n, 2)."""
    steepness: Floats = alpha if grid.case.model == "linear" else np.tan(alpha)
    return grid.case.block.gravity * steepness


def _lifting(grid: MapGrid, alpha: float | None) -> float:
    """Return the smallest uplift acceleration, m/s^2, of the case's block, or for another slenderness."""
    if alpha is None:
        return min(grid.case.block.uplift_thresholds(grid.case.model))
    return float(_thresholds(np.array([[alpha]]), grid)[0, 0])


def _tasks(grid: MapGrid, factors: Floats) -> Iterator[Task]:
    """Yield tasks by level and row; points of a task share the factor on the motion."""
    rows, columns = grid.shape
    for level, stride in enumerate((8, 4, 2, 1)):
        for row in range(0, rows, stride):
            done = level > 0 and row % (2 * stride) == 0
            index = row * columns + np.arange(stride if done else 0, columns, 2 * stride if done else stride)
            for factor in np.unique(factors[index]):
                yield Task(index[factors[index] == factor], grid.motion, float(factor), (stride, row))


def _change_block(texts: dict[str, str], grid: MapGrid, name: str, value: float) -> None:
    sides = grid.case.block.sides
    if "alpha" not in (grid.x.name, grid.y.name) and (
        not grid.case.block.is_symmetric or {"pivots", "mesh"} & texts.keys()
    ):
        texts.setdefault("restitution", _both([side.restitution for side in sides]))
    if "p" not in texts:
        texts["p"], texts["alpha"] = (_both([getattr(side, each) for side in sides]) for each in ("p", "alpha"))
        for each in BLOCK_NAMES - {"p", "alpha", "restitution"}:
            texts.pop(each, None)
    if name == "p":
        slowest = min(side.p for side in sides)
        texts["p"] = _both([value * (side.p / slowest) for side in sides])
    elif name == "alpha":
        texts["alpha"] = f"{value!r}deg"
    else:
        texts["restitution"] = repr(value)


def _both(pair: list[float]) -> str:
    return ",".join(map(repr, pair if pair[0] != pair[1] else pair[:1]))


def change_pulse(texts: dict[str, str], **numbers: float) -> None:
    """Change parameters of the pulse in the texts of a case; a truncated pulse keeps its number of cycles."""
    given = arguments_of(texts["motion"])
    if "duration" in given and "frequency" in numbers:
        numbers["duration"] = given["duration"] * given["frequency"] / numbers["frequency"]
    _, written = pulse_texts(texts["motion"])
    kept: dict[str, Any] = {name: ",".join(values) for name, values in written.items() if name in given}
    texts["motion"] = pulse_text(texts["motion"], kept | numbers)


def _change_amplitude(texts: dict[str, str], grid: MapGrid, peak: float) -> None:
    """Scale the motion to a peak acceleration, m/s^2, in its polarity: pulses by amplitude, records by scale."""
    scale, sign = number(texts.get("scale", "1"), "scale"), sign_of(texts)
    for name in SCALINGS:
        texts.pop(name, None)
    if is_pulse(texts["motion"]):
        amplitude = sign * arguments_of(texts["motion"])["amplitude"]
        change_pulse(texts, amplitude=amplitude * peak / pulse_of(texts["motion"]).pga)
    elif sign < 0.0:
        texts["scale"] = repr(scale * peak / grid.motion.pga)
    else:
        texts["pga"] = repr(peak)
