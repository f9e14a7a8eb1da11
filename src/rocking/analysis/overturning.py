"""Overturning maps of pulses over dimensionless amplitude and frequency, with refined boundaries."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking.analysis.levels import Boundaries, boundaries
from rocking.block import Block, Blocks, require_block
from rocking.core import checks
from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.constants import VERSION, Model
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, format_some_rows, variable
from rocking.core.tables import add_unit, columns_to_records, escape_dollars, format_cell, format_table
from rocking.engine.schemes import Certified
from rocking.engine.tasks import OUTCOME, Setup, describe_missing, simulate_each
from rocking.errors import InvalidMotion, InvalidOption
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
    rocking.analysis.mode_name : Describe a mode in words.
    """

    UNFINISHED = -5
    OVERTURNS_AFTER_REST = -4
    NO_UPLIFT = -3
    RESTS = -2
    ROCKS = -1


_NAMES: Final = {
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
_SAME: Final = 0.02


def overturning_map(
    block: Block,
    pulse: str | Callable[[float, float], Motion],
    *,
    amplitudes: ArrayLike,
    frequencies: ArrayLike,
    model: Model = "nonlinear",
    rtol: float = 1e-6,
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
    **parameters : object
        Further parameters of a named pulse, as for the function of that name in `rocking.pulses`.

    Returns
    -------
    OverturningMap
        Modes, peaks and boundaries.

    Raises
    ------
    InvalidOption
        If an argument is out of range, the shape of the pulse depends on the frequency (for example because of a fixed
        `duration`) or the amplitude, or the block never comes to rest (restitution 1).
    InvalidMotion
        If a function does not return a motion.

    See Also
    --------
    rocking.incremental_dynamic_analysis : Scale any motion until the block overturns.
    rocking.pulses : Analytic ground motions.

    Notes
    -----
    By dimensional analysis, one pulse is simulated with blocks of different p for the frequencies. Changes of mode
    between neighbouring amplitudes of the grid are located by bisection. Changes between amplitudes of equal mode are
    not detected.

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
    >>> print(f"{float(result.data.overturning_amplitude[0]):.7f}")
    1.8007239
    """
    levels = checks.increasing_numbers(amplitudes, "amplitudes", InvalidOption)
    ratios = checks.increasing_numbers(frequencies, "frequencies", InvalidOption)
    checks.grid_size({"amplitudes": len(levels), "frequencies": len(ratios)}, InvalidOption)
    width = checks.between(rtol, "rtol", InvalidOption, 1e-15, 0.5)
    require_block(block)
    if all(side.restitution == 1.0 for side in block.sides):
        raise InvalidOption(
            "a block with {} 1 never comes to rest; an overturning map needs one below 1", "restitution"
        )
    slowest = min(side.p for side in block.sides)
    made, own = _pulse_function(pulse, parameters), slowest / (2.0 * math.pi)
    unit = _called(made, 1.0, own)
    for ratio in {float(ratios[0]), float(ratios[-1])}:
        stronger = 1.0 + ratio
        other = _called(made, stronger, ratio * own)
        pairs = (unit, other), (unit.vertical, other.vertical)
        if not all(_is_alike(first, second, stronger, ratio) for first, second in pairs):
            raise InvalidOption(
                "the {} must have one shape: a function of amplitude and frequency whose motion is proportional to the "
                f"amplitude, and over in half the time at twice the frequency; that of {own:g} Hz is another one "
                f"than that of {ratio * own:g} Hz",
                "pulse",
            )
    p, alpha, restitution = (
        np.array([getattr(side, name) for side in block.sides]) for name in ("p", "alpha", "restitution")
    )
    # Blocks of one shape with values of p that correspond to the ratios for a pulse of the block's frequency.
    blocks = Blocks(p / ratios[:, None], alpha[None, :], restitution[None, :], gravity=block.gravity)
    setup, threshold = Setup(blocks, model, Certified(width * unit.end)), min(block.uplift_thresholds(model))

    def followed(
        column: Integers, level: Floats, done: Callable[[int], None] = lambda count: None
    ) -> tuple[Integers, Floats]:
        """OverturningMode and peak rotation of each block, selected by column, at its level."""
        ends = np.empty(column.size, dtype=OUTCOME)
        here = replace(setup, bodies=setup.bodies.select(column))
        for task, outcomes in simulate_each(here, unit, threshold * level):
            ends[task.bodies] = outcomes
            done(len(outcomes))
        return np.where(ends["unfinished"], OverturningMode.UNFINISHED, modes_of(ends, unit.end)), ends["peak_rotation"]

    row, column = (index.ravel() for index in np.indices((levels.size, ratios.size)))
    with Progress("mapping", row.size) as bar:
        modes, peaks = followed(column, levels[row], bar.advance)
    modes, peaks = modes.reshape(levels.size, -1), peaks.reshape(levels.size, -1)
    edges = boundaries(levels, modes, lambda *at: followed(*at)[0], rtol=width)
    attributes = {
        "program": f"rocking {VERSION}",
        "model": model,
        "block": block.description,
        add_unit("alpha", "rad"): [side.alpha for side in block.sides],
        "restitution": [side.restitution for side in block.sides],
        "pulse": f"{unit.name}: {unit.description.text}",
        "pulse_name": unit.name,
        "rtol": width,
    }
    return OverturningMap(_dataset(levels, ratios, modes, peaks, edges, attributes))


def mode_name(mode: int) -> str:
    """Return the description of a `OverturningMode` or of a number of impacts before overturning.

    Parameters
    ----------
    mode : int
        OverturningMode in the results of `overturning_map`.

    Returns
    -------
    str
        Description, for example "rocks until the pulse is over" or "overturns after 2 impacts".

    Examples
    --------
    >>> mode_name(-2), mode_name(0), mode_name(1)
    ('rests before the pulse is over', 'overturns without impact', 'overturns after 1 impact')
    """
    if mode <= 0:
        return _NAMES[int(mode)]
    return f"overturns after {mode} impact{'s' if mode > 1 else ''}"


def modes_of(ends: NDArray[np.void], duration: float) -> Integers:
    """Modes of blocks under a motion of given duration (s), from the engine's results."""
    rested = (ends["uplifts"] > 1) | ((ends["rests"] > 0) & (ends["last_rest"] <= duration))
    modes = np.where(
        ends["uplifts"] == 0, OverturningMode.NO_UPLIFT, np.where(rested, OverturningMode.RESTS, OverturningMode.ROCKS)
    )
    overturns = np.where(ends["uplifts"] > 1, OverturningMode.OVERTURNS_AFTER_REST, ends["impacts"])
    return np.where(ends["overturned"], overturns, modes)


def _overturns(modes: Integers) -> Flags:
    found: Flags = (modes >= 0) | (modes == OverturningMode.OVERTURNS_AFTER_REST)
    return found


@dataclass(frozen=True, eq=False, repr=False)
class OverturningMap(DatasetResult):
    """Outcomes of a block under a pulse, over amplitude and frequency, computed by `overturning_map`.

    The figure shows the modes as regions between the refined boundaries.

    Attributes
    ----------
    data : xarray.Dataset
        Over (amplitude, frequency): mode (a `OverturningMode`, or the number of impacts before overturning), and peak_rotation
        (rad, pi/2 for overturning). Over (frequency): overturning_amplitude, the lowest that overturns, or NaN if none
        or already the first does. Over (boundary): boundary_frequency, boundary_amplitude, and the modes below and
        above the boundary.

    See Also
    --------
    rocking.overturning_map : Compute the map.
    """

    TABLES = MappingProxyType(
        {
            "modes": ("mode", "peak_rotation"),
            "boundaries": ("boundary_frequency", "boundary_amplitude", "mode_below", "mode_above"),
        }
    )
    POOLED = ("boundary",)

    @staticmethod
    def _restrict(data: xr.Dataset) -> xr.Dataset:
        at, level = data.boundary_frequency.values, data.boundary_amplitude.values
        low, high = data.amplitude.values.min(), data.amplitude.values.max()
        return data.isel(boundary=np.isin(at, data.frequency.values) & (low < level) & (level <= high))

    def summary(self) -> str:
        modes, counts = np.unique(self.data.mode, return_counts=True)
        percents = 100.0 * counts / self.data.mode.size
        shares = [
            (mode_name(int(mode)), f"{percent:.1f} %" if percent >= 0.1 else "below 0.1 %")
            for mode, percent in zip(modes, percents, strict=True)
        ]
        rows = [(float(ratio), self._lowest(k)) for k, ratio in enumerate(self.data.frequency)]
        return "\n\n".join(
            [
                f"{self.data.pulse_name} on a block with {self._proportions}; {self.data.model} model",
                format_table(["outcome", "share of the map"], shares),
                format_some_rows(["2 pi f/p", "lowest amplitude that overturns, over the smallest that lifts"], rows),
                *(
                    [f"note: {missing}"]
                    if (missing := describe_missing(self.data.mode.values == OverturningMode.UNFINISHED))
                    else []
                ),
            ]
        )

    def _lowest(self, k: int) -> str:
        """Describe the lowest amplitude of the grid's range that overturns at a frequency."""
        lowest, amplitudes = float(self.data.overturning_amplitude[k]), self.data.amplitude.values
        if not math.isnan(lowest):
            return format_cell(lowest)
        is_open_below = _overturns(self.data.mode.values[0, k])
        return f"{amplitudes[0]:g} or less" if is_open_below else f"none of those up to {amplitudes[-1]:g}"

    def to_dict(self) -> dict[str, Any]:
        return {
            "pulse": self.data.pulse,
            "block": self.data.block,
            **{name: self.data.attrs[name] for name in (add_unit("alpha", "rad"), "restitution")},
            "model": self.data.model,
            "rtol": self.data.rtol,
            "modes": {str(mode): mode_name(int(mode)) for mode in np.unique(self.data.mode)},
            "frequency": self.data.frequency.values,
            "amplitude": self.data.amplitude.values,
            "mode": self.data.mode.values,
            "overturning_amplitude": self.data.overturning_amplitude.values,
            "boundaries": columns_to_records(self._columns("boundaries")),
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.maps import regions_figure

        data = self.data
        modes = data.mode.values
        columns = [data.boundary_frequency.values == ratio for ratio in data.frequency.values]
        return regions_figure(
            x=data.frequency.values,
            y_range=(float(data.amplitude[0]), float(data.amplitude[-1])),
            edges=[data.boundary_amplitude.values[here] for here in columns],
            regions=[[modes[0, k], *data.mode_above.values[here]] for k, here in enumerate(columns)],
            names={int(mode): mode_name(int(mode)) for mode in np.union1d(modes, data.mode_above.values)},
            x_label="2πf/p, with the frequency f of the pulse",
            y_label="amplitude over the smallest that lifts the block",
            title=title or escape_dollars(f"{self.data.pulse_name}, {self._proportions}, {data.model} model"),
            ax=ax,
            figsize=figsize,
        )

    @property
    def _proportions(self) -> str:
        """Describe the block's slenderness and restitution, which usually are equal on both sides."""
        alpha, restitution = (
            ", ".join(dict.fromkeys(f"{value:.5g}" for value in self.data.attrs[name]))
            for name in (add_unit("alpha", "rad"), "restitution")
        )
        return f"alpha = {alpha} rad, restitution = {restitution}"


def _pulse_function(
    pulse: str | Callable[[float, float], Motion], parameters: dict[str, Any]
) -> Callable[[float, float], Motion]:
    """Return a function of amplitude (m/s^2, peak for named pulses) and frequency (Hz) that creates a pulse."""
    if callable(pulse):
        if parameters:
            raise InvalidOption(
                f"a {{}} given as a function takes no {', '.join(parameters)}: bind them to it", "pulse"
            )
        return pulse
    family = find_family(pulse)
    if family.name not in PULSES:
        raise InvalidOption(
            f"{{}} must be one of {', '.join(PULSES)}, or a function, not {pulse!r}", "pulse", value=pulse
        )

    def named_pulse(amplitude: float, frequency: float) -> Motion:
        made = family.create_motion({"amplitude": 1.0, "frequency": frequency} | parameters)
        return made.scaled_to(amplitude) if family.is_of_velocity else made.scaled(amplitude)

    return named_pulse


def _called(pulse: Callable[[float, float], Motion], amplitude: float, frequency: float) -> Motion:
    motion = check_motion(pulse(amplitude, frequency))
    if motion is None:
        raise InvalidMotion(
            f"the pulse of amplitude {amplitude:g} and frequency {frequency:g} is None; return a Motion"
        )
    return motion


def _is_alike(first: Motion | None, second: Motion | None, factor: float, ratio: float) -> bool:
    """Whether one component equals the other up to a factor and a ratio of durations, or both are missing."""
    if first is None or second is None:
        return first is second
    if abs(ratio * second.duration - first.duration) > _SAME * first.duration:
        return False
    phases = (np.arange(400) + 0.5) / 400
    one, other = first.acceleration(phases * first.duration), second.acceleration(phases * second.duration) / factor
    return bool(np.abs(other - one).mean() <= _SAME * np.abs(one).max())


def _dataset(
    levels: Floats, ratios: Floats, modes: Integers, peaks: Floats, edges: Boundaries, attributes: dict[str, Any]
) -> xr.Dataset:
    import xarray as xr

    lowest = np.full(ratios.size, np.inf)
    overturns = _overturns(edges.above) & ~_overturns(edges.below)
    np.minimum.at(lowest, edges.column[overturns], edges.level[overturns])
    lowest[np.isinf(lowest) | _overturns(modes[0])] = np.nan
    meaning = (
        "-5: not finished, -4: overturns after a rest, -3: no uplift, -2: rests before the pulse is over, -1: rocks, "
        "n >= 0: overturns after n impacts"
    )
    over = "over the smallest acceleration that lifts the block"
    return xr.Dataset(
        {
            "mode": variable(("amplitude", "frequency"), modes, meaning),
            "peak_rotation": variable(("amplitude", "frequency"), peaks, "largest rotation in size", "rad"),
            "overturning_amplitude": variable(
                "frequency", lowest, f"lowest amplitude that overturns the block, {over}", "1"
            ),
            "boundary_frequency": variable("boundary", ratios[edges.column], unit="1"),
            "boundary_amplitude": variable("boundary", edges.level, unit="1"),
            "mode_below": variable("boundary", edges.below, meaning),
            "mode_above": variable("boundary", edges.above, meaning),
        },
        {
            "amplitude": variable("amplitude", levels, f"amplitude of the pulse {over}", "1"),
            "frequency": variable("frequency", ratios, "2 pi times the pulse's frequency, over p", "1"),
        },
        attributes,
    )
