"""Overturning maps of pulses over dimensionless amplitude and frequency, with refined boundaries."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.analysis.levels import Brackets, find_boundaries, list_missing_notes
from rocking.block import Block, Blocks
from rocking.block.friction import Friction, check_friction, resolve_friction
from rocking.block.single import require_block
from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.constants import VERSION, Model
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, create_variable, format_some_rows
from rocking.core.tables import add_unit, columns_to_records, escape_dollars, format_cell, format_table
from rocking.engine.schemes import Certified
from rocking.engine.tasks import OUTCOME_DTYPE, Setup, simulate_each
from rocking.errors import MotionError, OptionError
from rocking.inputs.pulses import find_family
from rocking.motion.motion import Motion
from rocking.records.named import check_motion

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class OverturningMode(IntEnum):
    """Outcome of a block under a pulse. Other modes n >= 0 are overturning after n impacts.

    Attributes
    ----------
    UNFINISHED
        The simulation was abandoned after too many steps.
    OVERTURNS_AFTER_REST
        The block overturns after it has been at rest.
    NO_UPLIFT
        The pulse does not lift the block.
    RESTS
        The block comes to rest at least once before the end of the pulse.
    ROCKS
        The block rocks until the end of the pulse.

    See Also
    --------
    rocking.analysis.describe_mode : Describe a mode in words.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> result = rocking.overturning_map(block, "half-sine", amplitudes=[0.5, 1.5], frequencies=[2.0])
    >>> [rocking.analysis.OverturningMode(mode).name for mode in result.data.mode.values[:, 0]]
    ['NO_UPLIFT', 'ROCKS']
    """

    UNFINISHED = -5
    OVERTURNS_AFTER_REST = -4
    NO_UPLIFT = -3
    RESTS = -2
    ROCKS = -1


_MODE_NAMES: Final = {
    OverturningMode.UNFINISHED: "not finished",
    OverturningMode.OVERTURNS_AFTER_REST: "overturns after a rest",
    OverturningMode.NO_UPLIFT: "no uplift",
    OverturningMode.RESTS: "rests before the pulse is over",
    OverturningMode.ROCKS: "rocks until the pulse is over",
    0: "overturns without impact",
}

#: Pulse families with one amplitude and one frequency. Other pulses of `rocking.pulses`, with a duration or several
#: amplitudes, are passed as functions.
PULSES: Final = ("sine", "half-sine", "one-sine", "one-cosine", "ricker", "mavroeidis-papageorgiou")

#: Largest relative difference of two motions of one shape, as in samples at a constant step.
_SHAPE_TOLERANCE: Final = 0.02


def overturning_map(
    block: Block,
    pulse: str | Callable[[float, float], Motion],
    *,
    amplitudes: ArrayLike,
    frequencies: ArrayLike,
    model: Model = "nonlinear",
    rtol: float = 1e-6,
    friction: Friction | None = None,
    **parameters: Any,
) -> OverturningMap:
    """Map the outcomes of a block under a pulse over amplitude and frequency, with their boundaries.

    Parameters
    ----------
    block : Block
        Block, of which only slenderness and restitution matter.
    pulse : str or callable
        "sine" (with `cycles`), "half-sine", "one-sine", "one-cosine", "ricker" (`kind`) or "mavroeidis-papageorgiou"
        (`phase`, `gamma`), or a function of amplitude (m/s^2) and frequency (Hz) that returns a motion proportional to
        the amplitude and of constant shape: the motion and its vertical component last half as long at twice the
        frequency.
    amplitudes : array_like, shape (m,)
        Increasing amplitudes, normalised by the uplift acceleration (g tan(alpha), or g alpha in the linear model). The
        amplitude of a Mavroeidis-Papageorgiou pulse is here its peak acceleration.
    frequencies : array_like, shape (n,)
        Increasing values of 2 pi f/p, with the pulse's frequency f and the block's p (the smaller one of two sides).
    model : {"nonlinear", "linear"}
        Equation of motion.
    rtol : float
        Width of refined boundaries, relative to the amplitude.
    friction : optional
        As for `simulate`.
    **parameters : object
        Further parameters of a named pulse, as for the function of that name in `rocking.pulses`.

    Returns
    -------
    OverturningMap
        Modes, peaks and boundaries.

    Raises
    ------
    OptionError
        If an argument is out of range, the shape of the pulse depends on the frequency (for example because of a fixed
        `duration`) or the amplitude, or the block never comes to rest (restitution 1).
    MotionError
        If a function does not return a motion.

    See Also
    --------
    rocking.incremental_dynamic_analysis : Scale any motion until the block overturns.
    rocking.pulses : Analytic ground motions.

    Notes
    -----
    By dimensional analysis, the outcome depends on the frequency of the pulse only through 2 pi f/p. Therefore one
    pulse is simulated with blocks of different p in place of pulses of different frequencies. Changes of mode between
    neighbouring amplitudes of the grid are located by bisection. Changes between amplitudes of equal mode are not
    detected.

    References
    ----------
    Zhang, J. and Makris, N. (2001). Rocking response of free-standing blocks under cycloidal pulses. Journal of
    Engineering Mechanics 127(5), 473-483.

    Examples
    --------
    The half sine of frequency 2 p that just overturns a slender block:

    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> result = overturning_map(block, "half-sine", amplitudes=[0.5, 1.5, 2.5], frequencies=[2.0], model="linear")
    >>> print(f"{float(result.data.overturning_amplitude[0]):.5f}")
    1.80072
    """
    levels = checks.increasing_numbers(amplitudes, "amplitudes", OptionError)
    ratios = checks.increasing_numbers(frequencies, "frequencies", OptionError)
    checks.check_grid_size({"amplitudes": len(levels), "frequencies": len(ratios)}, OptionError)
    relative_width = checks.between(rtol, "rtol", OptionError, 1e-15, 0.5)
    require_block(block)
    if all(side.restitution == 1.0 for side in block.sides):
        message = "{} must be below 1 for an overturning map, because otherwise the block never comes to rest"
        raise OptionError(message, "restitution")
    min_p = min(side.p for side in block.sides)
    create_pulse, frequency = _create_pulse_function(pulse, parameters), min_p / (2.0 * math.pi)
    unit_pulse = _call_pulse(create_pulse, 1.0, frequency)
    for ratio in {float(ratios[0]), float(ratios[-1])}:
        amplitude = 1.0 + ratio
        scaled_pulse = _call_pulse(create_pulse, amplitude, ratio * frequency)
        pairs = (unit_pulse, scaled_pulse), (unit_pulse.vertical, scaled_pulse.vertical)
        if not all(_is_alike(first, second, amplitude, ratio) for first, second in pairs):
            raise OptionError(
                "the {} must have the same shape at all frequencies: proportional to the amplitude, and half as long "
                f"at twice the frequency; the shapes at {frequency:g} Hz and at {ratio * frequency:g} Hz differ",
                "pulse",
            )
    p, alpha, restitution = np.array([(side.p, side.alpha, side.restitution) for side in block.sides]).T
    # Blocks of one shape with values of p that correspond to the ratios for a pulse of the block's frequency.
    blocks = Blocks(p / ratios[:, None], alpha[None, :], restitution[None, :], gravity=block.gravity)
    coefficients, scheme = resolve_friction(friction), Certified(relative_width * unit_pulse.end)
    blocks.__dict__["radii"] = np.array(block._list_radii()) * ratios[:, None] ** 2
    check_friction(blocks, model, coefficients)
    setup, threshold = Setup(blocks, model, scheme, friction=coefficients), min(block.uplift_thresholds(model))

    def simulate_modes(
        column: Integers, level: Floats, advance: Callable[[int], None] = lambda count: None
    ) -> tuple[Integers, Floats]:
        """Simulate the block of each column at its level, and return modes and peak rotations."""
        results = np.empty(column.size, dtype=OUTCOME_DTYPE)
        for k, outcomes in simulate_each(setup, [unit_pulse], column, np.zeros_like(column), threshold * level):
            results[k] = outcomes
            advance(len(outcomes))
        modes = np.where(results["unfinished"], OverturningMode.UNFINISHED, classify_modes(results, unit_pulse.end))
        return modes, results["peak_rotation"]

    row, column = (index.ravel() for index in np.indices((levels.size, ratios.size)))
    with Progress("mapping", row.size) as bar:
        modes, peaks = simulate_modes(column, levels[row], bar.advance)
    modes, peaks = modes.reshape(levels.size, -1), peaks.reshape(levels.size, -1)
    brackets = find_boundaries(levels, modes, lambda *arguments: simulate_modes(*arguments)[0], rtol=relative_width)
    attributes = {
        "program": f"rocking {VERSION}",
        "model": model,
        "block": block.description,
        add_unit("alpha", "rad"): [side.alpha for side in block.sides],
        "restitution": [side.restitution for side in block.sides],
        "pulse": f"{unit_pulse.name}: {unit_pulse.description.text}",
        "pulse_name": unit_pulse.name,
        "rtol": relative_width,
    }
    return OverturningMap(_combine_modes(levels, ratios, modes, peaks, brackets, attributes))


def describe_mode(mode: int) -> str:
    """Return the description of an `OverturningMode` or of a number of impacts before overturning.

    Parameters
    ----------
    mode : int
        Mode in the results of `overturning_map`.

    Returns
    -------
    str
        Description, for example "rocks until the pulse is over" or "overturns after 2 impacts".

    See Also
    --------
    rocking.analysis.OverturningMode : Identify the outcome of a block under a pulse.
    rocking.overturning_map : Compute the modes of a block under a pulse.

    Examples
    --------
    >>> describe_mode(-2), describe_mode(0), describe_mode(1)
    ('rests before the pulse is over', 'overturns without impact', 'overturns after 1 impact')
    """
    if mode <= 0:
        return _MODE_NAMES[int(mode)]
    return f"overturns after {mode} impact{'s' if mode > 1 else ''}"


def classify_modes(results: NDArray[np.void], duration: float) -> Integers:
    """Classify the outcomes of blocks under a motion with a duration (s) from the engine's results."""
    uplifts = results["uplifts"]
    has_rested = (uplifts > 1) | ((results["rests"] > 0) & (results["last_rest"] <= duration))
    lifted_modes = np.where(has_rested, OverturningMode.RESTS, OverturningMode.ROCKS)
    standing_modes = np.where(uplifts == 0, OverturningMode.NO_UPLIFT, lifted_modes)
    overturning_modes = np.where(uplifts > 1, OverturningMode.OVERTURNS_AFTER_REST, results["impacts"])
    return np.where(results["overturned"], overturning_modes, standing_modes)


def _is_overturning(modes: Integers) -> Flags:
    return np.asarray((modes >= 0) | (modes == OverturningMode.OVERTURNS_AFTER_REST))


@dataclass(frozen=True, eq=False, repr=False)
class OverturningMap(DatasetResult):
    """Outcomes of a block under a pulse, over amplitude and frequency, computed by `overturning_map`.

    The figure shows the modes as regions between the refined boundaries.

    Attributes
    ----------
    data : xarray.Dataset
        Over (amplitude, frequency): mode (an `OverturningMode`, or the number of impacts before overturning), and
        peak_rotation (rad, pi/2 for overturning). Over (frequency): overturning_amplitude, the lowest that overturns,
        or NaN if none or already the first does. Over (boundary): boundary_frequency, boundary_amplitude, and the modes
        below and above the boundary.

    See Also
    --------
    rocking.overturning_map : Compute the map.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> result = rocking.overturning_map(block, "half-sine", amplitudes=[0.5, 1.5, 2.5], frequencies=[2.0])
    >>> [rocking.analysis.describe_mode(mode) for mode in result.data.mode.values[:, 0]]
    ['no uplift', 'rocks until the pulse is over', 'overturns without impact']
    """

    TABLES: ClassVar = {
        "modes": ("mode", "peak_rotation"),
        "boundaries": ("boundary_frequency", "boundary_amplitude", "mode_below", "mode_above"),
    }
    AGGREGATED_DIMENSIONS = ("boundary",)

    @staticmethod
    def _restrict(data: xr.Dataset) -> xr.Dataset:
        frequency, amplitude = data.boundary_frequency.values, data.boundary_amplitude.values
        low, high = data.amplitude.values.min(), data.amplitude.values.max()
        return data.isel(boundary=np.isin(frequency, data.frequency.values) & (low < amplitude) & (amplitude <= high))

    def summary(self) -> str:
        modes, counts = np.unique(self.data.mode, return_counts=True)
        percents = 100.0 * counts / self.data.mode.size
        shares = [
            (describe_mode(int(mode)), f"{percent:.1f} %" if percent >= 0.1 else "below 0.1 %")
            for mode, percent in zip(modes, percents, strict=True)
        ]
        rows = [(float(ratio), self._describe_lowest(k)) for k, ratio in enumerate(self.data.frequency)]
        header = ["2 pi f/p", "lowest amplitude that overturns, over the smallest that lifts"]
        headline = f"{self.data.pulse_name} on a block with {self._proportion_text}; {self.data.model} model"
        tables = format_table(["outcome", "share of the map"], shares), format_some_rows(header, rows)
        notes = list_missing_notes(self.data.mode.values == OverturningMode.UNFINISHED)
        return "\n\n".join([headline, *tables, *notes])

    def _describe_lowest(self, k: int) -> str:
        """Describe the lowest amplitude of the grid's range that overturns at a frequency."""
        lowest, amplitudes = float(self.data.overturning_amplitude[k]), self.data.amplitude.values
        if not math.isnan(lowest):
            return format_cell(lowest)
        is_open_below = _is_overturning(self.data.mode.values[0, k])
        return f"{amplitudes[0]:g} or less" if is_open_below else f"none of those up to {amplitudes[-1]:g}"

    def to_dict(self) -> dict[str, Any]:
        return {
            "pulse": self.data.pulse,
            "block": self.data.block,
            **{name: self.data.attrs[name] for name in (add_unit("alpha", "rad"), "restitution")},
            "model": self.data.model,
            "rtol": self.data.rtol,
            "modes": {str(mode): describe_mode(int(mode)) for mode in np.unique(self.data.mode)},
            "frequency": self.data.frequency.values,
            "amplitude": self.data.amplitude.values,
            "mode": self.data.mode.values,
            "overturning_amplitude": self.data.overturning_amplitude.values,
            "boundaries": columns_to_records(self._columns("boundaries")),
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.maps import draw_regions

        data = self.data
        modes = data.mode.values
        columns = [data.boundary_frequency.values == ratio for ratio in data.frequency.values]
        return draw_regions(
            x=data.frequency.values,
            y_range=(float(data.amplitude[0]), float(data.amplitude[-1])),
            edges=[data.boundary_amplitude.values[is_column] for is_column in columns],
            regions=[[modes[0, k], *data.mode_above.values[is_column]] for k, is_column in enumerate(columns)],
            names={int(mode): describe_mode(int(mode)) for mode in np.union1d(modes, data.mode_above.values)},
            x_label="2πf/p, with the frequency f of the pulse",
            y_label="amplitude over the smallest that lifts the block",
            title=title or escape_dollars(f"{self.data.pulse_name}, {self._proportion_text}, {data.model} model"),
            ax=ax,
            figsize=figsize,
        )

    @property
    def _proportion_text(self) -> str:
        """Describe the block's slenderness and restitution, which usually are equal on both sides."""
        sides = self.data.attrs[add_unit("alpha", "rad")], self.data.restitution
        alpha, restitution = (", ".join(dict.fromkeys(f"{value:.5g}" for value in values)) for values in sides)
        return f"alpha = {alpha} rad, restitution = {restitution}"


def _create_pulse_function(
    pulse: str | Callable[[float, float], Motion], parameters: dict[str, Any]
) -> Callable[[float, float], Motion]:
    """Create a function of amplitude (m/s^2, peak for named pulses) and frequency (Hz) that returns a pulse."""
    if callable(pulse):
        if parameters:
            message = f"{{}} is a function, so that no parameters are accepted; got {', '.join(parameters)}"
            raise OptionError(f"{message}; set them in it", "pulse", value=parameters)
        return pulse
    family = find_family(pulse)
    if family.name not in PULSES:
        message = f"{{}} must be one of {', '.join(PULSES)}, or a function, not {pulse!r}"
        raise OptionError(message, "pulse", value=pulse)

    def create_named_pulse(amplitude: float, frequency: float) -> Motion:
        motion = family.create_motion({"amplitude": 1.0, "frequency": frequency} | parameters)
        return motion.scaled_to(amplitude) if family.is_of_velocity else motion.scaled(amplitude)

    return create_named_pulse


def _call_pulse(pulse: Callable[[float, float], Motion], amplitude: float, frequency: float) -> Motion:
    if (motion := check_motion(pulse(amplitude, frequency))) is None:
        arguments = f"amplitude {amplitude:g} and frequency {frequency:g}"
        raise MotionError(f"the pulse of {arguments} is None; return a Motion")
    return motion


def _is_alike(first: Motion | None, second: Motion | None, factor: float, ratio: float) -> bool:
    """Whether one component equals the other up to a factor and a ratio of durations, or both are missing."""
    if first is None or second is None:
        return first is second
    if abs(ratio * second.duration - first.duration) > _SHAPE_TOLERANCE * first.duration:
        return False
    phases = (np.arange(400) + 0.5) / 400
    values, scaled_values = (motion.acceleration(phases * motion.duration) for motion in (first, second))
    return bool(np.abs(scaled_values / factor - values).mean() <= _SHAPE_TOLERANCE * np.abs(values).max())


def _combine_modes(
    levels: Floats, ratios: Floats, modes: Integers, peaks: Floats, brackets: Brackets, attributes: dict[str, Any]
) -> xr.Dataset:
    import xarray as xr

    lowest = np.full(ratios.size, np.inf)
    overturns = _is_overturning(brackets.outcome_above) & ~_is_overturning(brackets.outcome_below)
    np.minimum.at(lowest, brackets.column[overturns], brackets.level[overturns])
    lowest[np.isinf(lowest) | _is_overturning(modes[0])] = np.nan
    meaning = (
        "-5: not finished, -4: overturns after a rest, -3: no uplift, -2: rests before the pulse is over, -1: rocks, "
        "n >= 0: overturns after n impacts"
    )
    normalisation = "over the smallest acceleration that lifts the block"
    lowest_meaning = f"lowest amplitude that overturns the block, {normalisation}"
    return xr.Dataset(
        {
            "mode": create_variable(("amplitude", "frequency"), modes, meaning),
            "peak_rotation": create_variable(("amplitude", "frequency"), peaks, "largest rotation in size", "rad"),
            "overturning_amplitude": create_variable("frequency", lowest, lowest_meaning, "1"),
            "boundary_frequency": create_variable("boundary", ratios[brackets.column], unit="1"),
            "boundary_amplitude": create_variable("boundary", brackets.level, unit="1"),
            "mode_below": create_variable("boundary", brackets.outcome_below, meaning),
            "mode_above": create_variable("boundary", brackets.outcome_above, meaning),
        },
        {
            "amplitude": create_variable("amplitude", levels, f"amplitude of the pulse {normalisation}", "1"),
            "frequency": create_variable("frequency", ratios, "2 pi times the pulse's frequency, over p", "1"),
        },
        attributes,
    )
