"""Basins of attraction of a body under periodic motion, with overturning to either side as attractors."""

from __future__ import annotations

from dataclasses import dataclass
from string import ascii_lowercase
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.constants import VERSION, Model
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, create_variable
from rocking.core.tables import escape_dollars, format_count, format_table
from rocking.dynamics.attractors import KnownAttractors
from rocking.dynamics.maps import StroboscopicMap, check_magnitudes, compute_scale, describe_input
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import OptionError
from rocking.kernels.periodic import PeriodOutcome
from rocking.motion.motion import Motion

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Codes of cells before attractors are sorted: 3 + k is attractor k.
_OVERTURNS_PLUS, _OVERTURNS_MINUS, _UNSETTLED, _FIRST_ATTRACTOR = 0, 1, 2, 3
_OUTCOME_NAMES: Final = ("overturns to side +", "overturns to side -", "not settled")

#: Numbers of cells before the first search for attractors, and between later searches.
_CELLS_BEFORE_SEARCH, _CELLS_PER_SEARCH = 400, 16_384


@dataclass(frozen=True, eq=False, repr=False)
class Basins(DatasetResult):
    """Basins of attraction, created by `basins`.

    The figure shows the basins in shades, and a mark at each point of the attractors.

    Attributes
    ----------
    data : xarray.Dataset
        With dimensions (velocity, coordinate): outcome, the number of the attractor, and periods until it was known.
        With dimension (attractor): share of the cells (the basin stability) with its standard_error, as of an equal
        number of random states; period and impact_count of the orbit (0 and -1 without an orbit); has_rest; multiplier,
        the largest in absolute value. With dimensions (attractor, phase): orbit_coordinate and orbit_velocity.
        Overturning and unsettled states count as attractors.

    See Also
    --------
    basins : Compute the basins.

    Examples
    --------
    >>> from rocking import dynamics, pulses
    >>> ball, shaking = dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(12.0, 5.0, cycles=1)
    >>> result = dynamics.basins(ball, shaking, [0.05, 0.1, 0.15], [-0.5, 0.0, 0.5])
    >>> result.data.attractor.values.tolist()
    ['period 1, rest', 'period 1, 1 impact']
    """

    TABLES: ClassVar = {
        "attractors": ("share", "standard_error", "period", "impact_count", "has_rest", "multiplier"),
        "outcomes": ("outcome", "periods"),
        "orbits": ("orbit_coordinate", "orbit_velocity"),
    }
    AGGREGATED_DIMENSIONS = ("velocity", "position", "angular_velocity", "rotation", "attractor", "phase")

    def summary(self) -> str:
        data = self.data
        columns = (data[name].values for name in ("attractor", "share", "standard_error", "multiplier"))
        rows = [
            [name, f"{100.0 * share:.2f} %", f"{100.0 * error:.2f} %", f"{multiplier:.4g}".replace("nan", "-")]
            for name, share, error, multiplier in zip(*columns, strict=True)
        ]
        numbers = f"{data.outcome.size} cells, {format_count(data.most_periods, 'period')}"
        table = format_table(["attractor", "share", "standard error", "multiplier"], rows)
        return f"basins of {data.body} under {data.motion}: {numbers}\n\n{table}"

    def to_dict(self) -> dict[str, Any]:
        data, attractors = self.data, []
        orbits = np.stack([data.orbit_coordinate.values, data.orbit_velocity.values], axis=-1)
        for k, (name, orbit) in enumerate(zip(data.attractor.values, orbits, strict=True)):
            numbers = {key: data[key].values[k].item() for key in self.TABLES["attractors"]}
            points = orbit[np.isfinite(orbit[:, 0])].tolist()
            attractors.append({"attractor": str(name), **numbers, "orbit": points})
        return {
            "body": data.body,
            "motion": data.motion,
            "model": data.model,
            "periods": data.most_periods,
            "attractors": attractors,
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.maps import draw_basins

        data = self.data
        v, x = (data[str(name)] for name in data.outcome.dims)
        names, kinds = [str(name) for name in data.attractor.values], dict.fromkeys(_OUTCOME_NAMES, "overturns")
        kinds[_OUTCOME_NAMES[_UNSETTLED]] = "unsettled"
        return draw_basins(
            x=x.values,
            y=v.values,
            outcome=data.outcome.values,
            names=names,
            kinds=[kinds.get(name, "orbit") for name in names],
            orbits=np.stack([data.orbit_coordinate.values, data.orbit_velocity.values], axis=-1),
            x_label=f"{x.name} at the start of a period ({x.units})",
            y_label=f"{str(v.name).replace('_', ' ')} ({v.units})",
            title=title or escape_dollars(f"{data.body} under {data.motion}, {data.model} model"),
            ax=ax,
            figsize=figsize,
        )


def basins(
    body: Body,
    motion: Motion,
    positions: ArrayLike,
    velocities: ArrayLike,
    period_count: int = 200,
    *,
    model: Model | None = None,
    chattering: str | ChatteringScheme = "certified",
) -> Basins:
    """Compute the basins of attraction of a body under periodic motion on a grid of initial states.

    Parameters
    ----------
    body, motion : Body, Motion
        As in `stroboscopic_map`.
    positions : array_like, shape (n,)
        Increasing rotations of a block (rad) or positions of other bodies (m) at the start of a period.
    velocities : array_like, shape (m,)
        Increasing velocities, rad/s or m/s.
    period_count : int
        Maximum number of periods per state.
    model, chattering : str, optional
        As in `stroboscopic_map`.

    Returns
    -------
    Basins
        Attractors, basins and their measures.

    See Also
    --------
    periodic_orbits : Find stable and unstable periodic orbits.
    stroboscopic_map : Create the map of a body under periodic motion.

    Notes
    -----
    A state is followed until it overturns or enters a neighbourhood of a stable periodic orbit in which the map
    contracts (as checked on samples), otherwise for all periods. Unsettled states may be chaotic or slow. Orbits of up
    to 64 periods are searched for among them. A chaotic attractor has no known neighbourhood, so that its states are
    followed for all periods.

    References
    ----------
    :cite:t:`menck2013`, "How basin stability complements the linear-stability paradigm".

    Examples
    --------
    >>> import numpy as np, rocking
    >>> from rocking import dynamics
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> shaking = rocking.pulses.sine(3.5, 1.2, cycles=1)
    >>> result = dynamics.basins(block, shaking, np.linspace(-0.2, 0.2, 21), np.linspace(-0.4, 0.4, 21))
    >>> for name, share in zip(result.data.attractor.values, result.data.share.values):
    ...     print(f"{name}: {share:.2f}")
    period 1, 2 impacts: 0.35
    overturns to side -: 0.52
    overturns to side +: 0.12
    """
    strobe = StroboscopicMap(body, motion, model, chattering)
    x, v = checks.axis(positions, "positions", OptionError), checks.axis(velocities, "velocities", OptionError)
    check_magnitudes(x, "positions")
    check_magnitudes(v, "velocities")
    checks.check_grid_size({"positions": len(x), "velocities": len(v)}, OptionError)
    max_periods = checks.integer(period_count, "period_count", OptionError, minimum=1)
    grid = _BasinGrid(strobe, x, v, max_periods)
    grid.follow_all()
    return Basins(grid.to_dataset())


class _BasinGrid:
    """Cells of a grid of initial states, and the attractors that they approach."""

    def __init__(self, strobe: StroboscopicMap, x: Floats, v: Floats, max_periods: int) -> None:
        self.strobe, self.x, self.v, self.max_periods = strobe, x, v, max_periods
        # Later states of a small grid are as large as others. Comparison within their rounding error would find no
        # attractor.
        size = np.maximum([float(np.ptp(axis) or abs(axis[0]) or 1.0) for axis in (x, v)], compute_scale(strobe))
        self.states = np.stack(np.meshgrid(x, v), axis=-1).reshape(-1, 2)
        self.outcome = np.full(len(self.states), _UNSETTLED, dtype=np.int16)
        self.period_counts = np.zeros(len(self.states), dtype=np.int32)
        self.known_attractors = KnownAttractors(strobe, size)
        # Raise an error for a start behind a stop, or moving into it.
        strobe._to_structs(self.states[[0, -1]], "positions", "velocities")

    def follow_all(self) -> None:
        """Follow all cells in random order."""
        cell_count = len(self.outcome)
        cells = np.random.default_rng(0).permutation(cell_count)
        chunk_starts = range(_CELLS_BEFORE_SEARCH, cell_count, _CELLS_PER_SEARCH)
        with Progress("basins", cell_count) as bar:
            for first, last in zip((0, *chunk_starts), (*chunk_starts, cell_count), strict=True):
                self._follow_cells(cells[first:last])
                bar.advance(last - first)

    def _follow_cells(self, cells: Integers) -> None:
        """Determine the outcomes of some cells."""
        strobe = self.strobe
        _, structs = strobe._to_structs(self.states[cells])
        traps, period_counts = self.known_attractors.advance_to_traps(structs, self.max_periods)
        outcome = np.append(_FIRST_ATTRACTOR + self.known_attractors.attractor_of_trap, _UNSETTLED)[traps]
        overturned = structs["status"] == PeriodOutcome.OVERTURNED
        outcome[overturned] = np.where(structs["side"][overturned] > 0, _OVERTURNS_MINUS, _OVERTURNS_PLUS)
        unsettled = np.flatnonzero((traps < 0) & ~overturned & (structs["status"] != PeriodOutcome.UNFINISHED))
        attractors = self.known_attractors.classify_or_search(
            strobe._to_coordinates(structs["u"][unsettled], structs["v"][unsettled], structs["side"][unsettled])
        )
        outcome[unsettled] = np.where(attractors >= 0, _FIRST_ATTRACTOR + attractors, _UNSETTLED)
        self.period_counts[cells], self.outcome[cells] = period_counts, outcome

    def to_dataset(self) -> xr.Dataset:
        """Create the dataset, with attractors in the order of their shares, then the outcomes without an attractor."""
        import xarray as xr

        codes, counts = np.unique(self.outcome, return_counts=True)
        total = counts.sum()
        order = np.lexsort((-counts, codes < _FIRST_ATTRACTOR))
        codes, share = codes[order], counts[order] / total
        all_attractors = self.known_attractors.attractors
        index_of_code = np.full(_FIRST_ATTRACTOR + len(all_attractors) + 1, -1, dtype=np.int16)
        index_of_code[codes] = np.arange(len(codes))
        reached = [all_attractors[code - _FIRST_ATTRACTOR] for code in codes if code >= _FIRST_ATTRACTOR]
        others = codes[len(reached) :].tolist()
        names = [*(known.name for known in reached), *(_OUTCOME_NAMES[code] for code in others)]
        period = [known.period for known in reached] + [0] * len(others)
        impacts = [known.impact_count for known in reached] + [-1] * len(others)
        rests = [known.has_rest for known in reached] + [False] * len(others)
        multiplier = [float(np.abs(known.multipliers).max()) for known in reached] + [np.nan] * len(others)
        points = np.full((len(codes), max(1, *period), 2), np.nan)
        for k, known in enumerate(reached):
            points[k, : known.period] = known.states
        error = np.sqrt(share * (1.0 - share) / total)
        coordinate = self.strobe.body.coordinate
        name, rate, unit = coordinate.name, coordinate.rate_name, coordinate.unit
        dims, orbit_dims, shape = (rate, name), ("attractor", "phase"), (len(self.v), len(self.x))
        outcome, period_counts = index_of_code[self.outcome].reshape(shape), self.period_counts.reshape(shape)
        return xr.Dataset(
            {
                "outcome": create_variable(dims, outcome, "number of the attractor"),
                "periods": create_variable(dims, period_counts, "periods until the outcome was known"),
                "share": create_variable("attractor", share, "share of the cells", "1"),
                "standard_error": create_variable("attractor", error, "of the share, as of random states", "1"),
                "period": create_variable("attractor", period, "periods of the motion"),
                "impact_count": create_variable("attractor", impacts, "impacts in a period of the orbit"),
                "has_rest": create_variable("attractor", rests, "has a rest"),
                "multiplier": create_variable("attractor", multiplier, "largest multiplier in size", "1"),
                "orbit_coordinate": create_variable(orbit_dims, points[..., 0], f"{name} on the orbit", unit),
                "orbit_velocity": create_variable(orbit_dims, points[..., 1], "rate on the orbit", f"{unit}/s"),
            },
            {
                rate: create_variable(rate, self.v, "velocity at the start of a period", f"{unit}/s"),
                name: create_variable(name, self.x, f"{name} at the start of a period", unit),
                "attractor": _distinguish_names(names),
            },
            {
                "program": f"rocking {VERSION}",
                "body": describe_input(self.strobe.body),
                "motion": describe_input(self.strobe.motion),
                "model": self.strobe.model,
                "most_periods": self.max_periods,
                "period_s": self.strobe.forcing_period,
            },
        )


def _distinguish_names(names: list[str]) -> list[str]:
    """Append a letter to names that are equal."""
    labels = []
    for k, name in enumerate(names):
        number = names[:k].count(name)
        label = ascii_lowercase[number] if number < 26 else number + 1
        labels.append(f"{name} ({label})" if names.count(name) > 1 else name)
    return labels
