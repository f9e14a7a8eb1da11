"""Basins of attraction of a body under periodic motion, with overturning to either side as attractors."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.constants import VERSION, Model
from rocking.core.progress import Progress
from rocking.core.result import DatasetResult, variable
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
        number of random states; period and impacts of the orbit (0 and -1 without an orbit); rests; multiplier, the
        largest in absolute value. With dimensions (attractor, phase): orbit_coordinate and orbit_velocity. Overturning
        and unsettled states count as attractors.

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

    TABLES = MappingProxyType(
        {
            "attractors": ("share", "standard_error", "period", "impacts", "rests", "multiplier"),
            "outcomes": ("outcome", "periods"),
            "orbits": ("orbit_coordinate", "orbit_velocity"),
        }
    )
    POOLED = ("velocity", "position", "angular_velocity", "rotation", "attractor", "phase")

    def summary(self) -> str:
        data = self.data
        rows = [
            [
                str(data.attractor.values[k]),
                f"{100.0 * data.share.values[k]:.2f} %",
                f"{100.0 * data.standard_error.values[k]:.2f} %",
                "-" if np.isnan(data.multiplier.values[k]) else f"{data.multiplier.values[k]:.4g}",
            ]
            for k in range(data.sizes["attractor"])
        ]
        cells = data.outcome.size
        headline = (
            f"basins of {data.body} under {data.motion}: {cells} cells, {format_count(data.most_periods, 'period')}"
        )
        return f"{headline}\n\n{format_table(['attractor', 'share', 'standard error', 'multiplier'], rows)}"

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        names = self.TABLES["attractors"]
        return {
            "body": data.body,
            "motion": data.motion,
            "model": data.model,
            "periods": data.most_periods,
            "attractors": [
                {
                    "attractor": str(data.attractor.values[k]),
                    **{name: data[name].values[k].item() for name in names},
                    "orbit": [
                        [float(x), float(v)]
                        for x, v in zip(data.orbit_coordinate.values[k], data.orbit_velocity.values[k], strict=True)
                        if np.isfinite(x)
                    ],
                }
                for k in range(data.sizes["attractor"])
            ],
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.maps import draw_basins

        data = self.data
        x, v = (data[name] for name in (str(data.outcome.dims[1]), str(data.outcome.dims[0])))
        names = [str(name) for name in data.attractor.values]
        return draw_basins(
            x=x.values,
            y=v.values,
            outcome=data.outcome.values,
            names=names,
            kinds=[
                "overturns" if n in _OUTCOME_NAMES[:2] else "unsettled" if n == _OUTCOME_NAMES[2] else "orbit"
                for n in names
            ],
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
    n_periods: int = 200,
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
    n_periods : int
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
    checks.grid_size({"positions": len(x), "velocities": len(v)}, OptionError)
    max_periods = checks.integer(n_periods, "n_periods", OptionError, minimum=1)
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
        strobe._to_records(self.states[[0, -1]], "positions", "velocities")

    def follow_all(self) -> None:
        """Follow all cells in random order."""
        n_cells = len(self.outcome)
        cells = np.random.default_rng(0).permutation(n_cells)
        chunk_starts = range(_CELLS_BEFORE_SEARCH, n_cells, _CELLS_PER_SEARCH)
        with Progress("basins", n_cells) as bar:
            for first, last in zip((0, *chunk_starts), (*chunk_starts, n_cells), strict=True):
                self._follow_cells(cells[first:last])
                bar.advance(last - first)

    def _follow_cells(self, cells: Integers) -> None:
        """Determine the outcomes of some cells."""
        strobe = self.strobe
        _, records = strobe._to_records(self.states[cells])
        traps, period_counts = self.known_attractors.advance_to_traps(records, self.max_periods)
        outcome = np.where(
            traps >= 0, _FIRST_ATTRACTOR + np.append(self.known_attractors.attractor_of_trap, 0)[traps], _UNSETTLED
        )
        overturned = records["ending"] == PeriodOutcome.OVERTURNED
        outcome[overturned] = np.where(records["side"][overturned] > 0, _OVERTURNS_MINUS, _OVERTURNS_PLUS)
        unsettled = np.flatnonzero((traps < 0) & ~overturned & (records["ending"] != PeriodOutcome.UNFINISHED))
        attractors = self.known_attractors.classify_or_search(
            strobe._to_coordinates(records["u"][unsettled], records["v"][unsettled], records["side"][unsettled])
        )
        outcome[unsettled] = np.where(attractors >= 0, _FIRST_ATTRACTOR + attractors, _UNSETTLED)
        self.period_counts[cells], self.outcome[cells] = period_counts, outcome

    def to_dataset(self) -> xr.Dataset:
        """Create the dataset, with attractors in the order of their shares, then the outcomes without an attractor."""
        import xarray as xr

        codes, counts = np.unique(self.outcome, return_counts=True)
        total = counts.sum()
        order = sorted(
            zip(codes.tolist(), counts.tolist(), strict=True), key=lambda item: (item[0] < _FIRST_ATTRACTOR, -item[1])
        )
        sorted_codes, share = [code for code, _ in order], np.array([count for _, count in order]) / total
        orbits = [
            self.known_attractors.attractors[code - _FIRST_ATTRACTOR] if code >= _FIRST_ATTRACTOR else None
            for code in sorted_codes
        ]
        names = [
            _OUTCOME_NAMES[code] if orbit is None else orbit.name
            for code, orbit in zip(sorted_codes, orbits, strict=True)
        ]
        index_of_code = np.full(_FIRST_ATTRACTOR + len(self.known_attractors.attractors) + 1, -1, dtype=np.int16)
        index_of_code[sorted_codes] = np.arange(len(sorted_codes))
        points = np.full((len(orbits), max([1, *(item.period for item in orbits if item is not None)]), 2), np.nan)
        properties: list[tuple[int, int, bool, float]] = []
        for k, orbit in enumerate(orbits):
            if orbit is None:
                properties.append((0, -1, False, np.nan))
                continue
            points[k, : orbit.period] = orbit.states
            properties.append((orbit.period, orbit.impacts, orbit.rests, float(np.abs(orbit.multipliers).max())))
        period, impacts, rests, multiplier = map(list, zip(*properties, strict=True))
        error = np.sqrt(share * (1.0 - share) / total)
        coordinate = self.strobe.body.coordinate
        coordinate_name, rate, unit = coordinate.name, coordinate.rate, coordinate.unit
        dimensions, shape = (rate, coordinate_name), (len(self.v), len(self.x))
        return xr.Dataset(
            {
                "outcome": variable(dimensions, index_of_code[self.outcome].reshape(shape), "number of the attractor"),
                "periods": variable(
                    dimensions, self.period_counts.reshape(shape), "periods until the outcome was known"
                ),
                "share": variable("attractor", share, "share of the cells", "1"),
                "standard_error": variable("attractor", error, "of the share, as of random states", "1"),
                "period": variable("attractor", period, "periods of the motion"),
                "impacts": variable("attractor", impacts, "impacts in a period of the orbit"),
                "rests": variable("attractor", rests, "has a rest"),
                "multiplier": variable("attractor", multiplier, "largest multiplier in size", "1"),
                "orbit_coordinate": variable(
                    ("attractor", "phase"), points[..., 0], f"{coordinate_name} on the orbit", unit
                ),
                "orbit_velocity": variable(("attractor", "phase"), points[..., 1], "rate on the orbit", f"{unit}/s"),
            },
            {
                rate: variable(rate, self.v, "velocity at the start of a period", f"{unit}/s"),
                coordinate_name: variable(coordinate_name, self.x, f"{coordinate_name} at the start of a period", unit),
                "attractor": _make_distinct(names),
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


def _make_distinct(names: list[str]) -> list[str]:
    """Append a letter to names that are equal."""
    counts: dict[str, int] = {}
    labels = []
    for name in names:
        count = counts[name] = counts.get(name, 0) + 1
        labels.append(
            f"{name} ({chr(ord('a') + count - 1) if count <= 26 else count})" if names.count(name) > 1 else name
        )
    return labels
