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
from rocking.dynamics.maps import StroboscopicMap, described, scale_of, sensible
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import InvalidOption
from rocking.kernels.periodic import PeriodOutcome
from rocking.motion.motion import Motion

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Codes of cells before attractors are sorted: 3 + k is attractor k.
_TO_PLUS, _TO_MINUS, _UNSETTLED, _FIRST = 0, 1, 2, 3
_NAMES: Final = ("overturns to side +", "overturns to side -", "not settled")

#: Cells before the first search for attractors, and between later searches.
_BEFORE, _BETWEEN = 400, 16_384


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
        head = f"basins of {data.body} under {data.motion}: {cells} cells, {format_count(data.most_periods, 'period')}"
        return f"{head}\n\n{format_table(['attractor', 'share', 'standard error', 'multiplier'], rows)}"

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
            kinds=["overturns" if n in _NAMES[:2] else "unsettled" if n == _NAMES[2] else "orbit" for n in names],
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
    P. J. Menck and others, "How basin stability complements the linear-stability paradigm", Nature Physics 9 (2013).

    Examples
    --------
    >>> import numpy as np, rocking
    >>> from rocking import dynamics
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> shaking = rocking.pulses.sine(3.5, 1.2, cycles=1)
    >>> found = dynamics.basins(block, shaking, np.linspace(-0.2, 0.2, 21), np.linspace(-0.4, 0.4, 21))
    >>> for name, share in zip(found.data.attractor.values, found.data.share.values):
    ...     print(f"{name}: {share:.2f}")
    period 1, 2 impacts: 0.35
    overturns to side -: 0.52
    overturns to side +: 0.12
    """
    strobe = StroboscopicMap(body, motion, model, chattering)
    x, v = checks.axis(positions, "positions", InvalidOption), checks.axis(velocities, "velocities", InvalidOption)
    sensible(x, "positions")
    sensible(v, "velocities")
    checks.grid_size({"positions": len(x), "velocities": len(v)}, InvalidOption)
    most = checks.integer(n_periods, "n_periods", InvalidOption, minimum=1)
    work = _Grid(strobe, x, v, most)
    work.run()
    return Basins(work.dataset())


class _Grid:
    """Cells of a grid, and the attractors found so far."""

    def __init__(self, strobe: StroboscopicMap, x: Floats, v: Floats, periods: int) -> None:
        self.strobe, self.x, self.v, self.periods = strobe, x, v, periods
        # Later states of a small grid are as large as others. Comparison within their rounding error would find no
        # attractor.
        size = np.maximum([float(np.ptp(each) or abs(each[0]) or 1.0) for each in (x, v)], scale_of(strobe))
        self.states = np.stack(np.meshgrid(x, v), axis=-1).reshape(-1, 2)
        self.outcome = np.full(len(self.states), _UNSETTLED, dtype=np.int16)
        self.taken = np.zeros(len(self.states), dtype=np.int32)
        self.known = KnownAttractors(strobe, size)
        # Raises an error for a start behind or into a stop.
        strobe._states(self.states[[0, -1]], "positions", "velocities")

    def run(self) -> None:
        """Follow all cells in a mixed order."""
        count = len(self.outcome)
        cells = np.random.default_rng(0).permutation(count)
        later = range(_BEFORE, count, _BETWEEN)
        with Progress("basins", count) as bar:
            for first, last in zip((0, *later), (*later, count), strict=True):
                self._follow(cells[first:last])
                bar.advance(last - first)

    def _follow(self, cells: Integers) -> None:
        strobe = self.strobe
        _, made = strobe._states(self.states[cells])
        traps, taken = self.known.settled(made, self.periods)
        outcome = np.where(traps >= 0, _FIRST + np.append(self.known.owner, 0)[traps], _UNSETTLED)
        over = made["ending"] == PeriodOutcome.OVERTURNED
        outcome[over] = np.where(made["side"][over] > 0, _TO_MINUS, _TO_PLUS)
        left = np.flatnonzero((traps < 0) & ~over & (made["ending"] != PeriodOutcome.UNFINISHED))
        later = self.known.settle(strobe._coordinates(made["u"][left], made["v"][left], made["side"][left]))
        outcome[left] = np.where(later >= 0, _FIRST + later, _UNSETTLED)
        self.taken[cells], self.outcome[cells] = taken, outcome

    def dataset(self) -> xr.Dataset:
        """Create the dataset, with attractors in the order of their shares, then the outcomes without an attractor."""
        import xarray as xr

        found, counts = np.unique(self.outcome, return_counts=True)
        total = counts.sum()
        order = sorted(zip(found.tolist(), counts.tolist(), strict=True), key=lambda each: (each[0] < _FIRST, -each[1]))
        numbers, share = [number for number, _ in order], np.array([count for _, count in order]) / total
        orbits = [self.known.attractors[n - _FIRST] if n >= _FIRST else None for n in numbers]
        names = [_NAMES[n] if orbit is None else orbit.name for n, orbit in zip(numbers, orbits, strict=True)]
        place = np.full(_FIRST + len(self.known.attractors) + 1, -1, dtype=np.int16)
        place[numbers] = np.arange(len(numbers))
        points = np.full((len(orbits), max([1, *(each.period for each in orbits if each is not None)]), 2), np.nan)
        about: list[tuple[int, int, bool, float]] = []
        for k, orbit in enumerate(orbits):
            if orbit is None:
                about.append((0, -1, False, np.nan))
                continue
            points[k, : orbit.period] = orbit.states
            about.append((orbit.period, orbit.impacts, orbit.rests, float(np.abs(orbit.multipliers).max())))
        period, impacts, rests, multiplier = map(list, zip(*about, strict=True))
        error = np.sqrt(share * (1.0 - share) / total)
        coordinate = self.strobe.body.coordinate
        at, rate, unit = coordinate.name, coordinate.rate, coordinate.unit
        cells, shape = (rate, at), (len(self.v), len(self.x))
        return xr.Dataset(
            {
                "outcome": variable(cells, place[self.outcome].reshape(shape), "number of the attractor"),
                "periods": variable(cells, self.taken.reshape(shape), "periods until the outcome was known"),
                "share": variable("attractor", share, "share of the cells", "1"),
                "standard_error": variable("attractor", error, "of the share, as of random states", "1"),
                "period": variable("attractor", period, "periods of the motion"),
                "impacts": variable("attractor", impacts, "impacts in a period of the orbit"),
                "rests": variable("attractor", rests, "has a rest"),
                "multiplier": variable("attractor", multiplier, "largest multiplier in size", "1"),
                "orbit_coordinate": variable(("attractor", "phase"), points[..., 0], f"{at} on the orbit", unit),
                "orbit_velocity": variable(("attractor", "phase"), points[..., 1], "rate on the orbit", f"{unit}/s"),
            },
            {
                rate: variable(rate, self.v, "velocity at the start of a period", f"{unit}/s"),
                at: variable(at, self.x, f"{at} at the start of a period", unit),
                "attractor": _distinct(names),
            },
            {
                "program": f"rocking {VERSION}",
                "body": described(self.strobe.body),
                "motion": described(self.strobe.motion),
                "model": self.strobe.model,
                "most_periods": self.periods,
                "period_s": self.strobe.forcing_period,
            },
        )


def _distinct(names: list[str]) -> list[str]:
    """Append a letter to names that are equal."""
    seen: dict[str, int] = {}
    found = []
    for name in names:
        k = seen[name] = seen.get(name, 0) + 1
        found.append(f"{name} ({chr(ord('a') + k - 1) if k <= 26 else k})" if names.count(name) > 1 else name)
    return found
