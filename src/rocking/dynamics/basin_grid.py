"""Cells of a grid of initial states, followed coarse to fine until it is known what becomes of each."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats, Integers
from rocking.constants import VERSION
from rocking.dynamics.attractors import Known
from rocking.dynamics.maps import StroboscopicMap
from rocking.dynamics.repeated import described, parts_of, scale_of
from rocking.kernels import state
from rocking.kernels.periodic import Fate, settle
from rocking.progress import Progress
from rocking.result import variable
from rocking.threads import in_threads

if TYPE_CHECKING:
    import xarray as xr

#: What a cell is, before attractors are sorted: 3 + k belongs to attractor k.
NOT_REACHED: Final = -1

TO_PLUS, TO_MINUS, _UNSETTLED = 0, 1, 2

_FIRST: Final = 3

NAMES: Final = ("overturns to side +", "overturns to side -", "not settled")

#: Cells of the coarsest pass, at least, and cells between two looks for attractors.
_COARSEST: Final = 400
_BATCH: Final = 16_384


class Grid:
    """Cells of a grid, coarse to fine, with the attractors that are known so far."""

    def __init__(self, strobe: StroboscopicMap, x: Floats, v: Floats, periods: int, threads: int) -> None:
        self.strobe, self.x, self.v, self.periods, self.threads = strobe, x, v, periods, threads
        # What becomes of a small grid's states is as large as that of others: to compare them more closely than by
        # rounding would find no attractor.
        self.size = np.maximum([_extent(x), _extent(v)], scale_of(strobe))
        self.outcome = np.full(len(x) * len(v), NOT_REACHED, dtype=np.int16)
        self.taken = np.zeros(len(x) * len(v), dtype=np.int32)
        self.known = Known(strobe, self.size)
        corners = self._states(np.array([0, len(x) * len(v) - 1]))
        strobe._states(corners, "positions", "velocities")  # a start behind a stop, or into one, is refused at once

    def run(self, progress: bool | None) -> None:
        """Follow all cells."""
        with Progress("basins", self.outcome.size, show=progress) as bar:
            for cells in self._batches():
                self._follow(cells)
                bar.advance(len(cells))

    def _batches(self) -> Iterator[Integers]:
        """Cells, coarse to fine."""
        stride = 1
        while self.outcome.size // (4 * stride * stride) >= _COARSEST:
            stride *= 2
        row, column = (each.ravel() for each in np.indices((len(self.v), len(self.x))))
        level = np.zeros(self.outcome.size, dtype=np.int64)
        first = stride
        while stride > 1:
            stride //= 2
            level[(row % (2 * stride) != 0) | (column % (2 * stride) != 0)] += 1
        for pass_ in range(int(np.log2(first)) + 1):
            # Those of a pass in a mixed order: what an interrupt leaves out is then left out all over the grid.
            cells = np.random.default_rng(pass_).permutation(np.flatnonzero(level == pass_))
            for start in range(0, len(cells), _BATCH):
                yield cells[start : start + _BATCH]

    def _states(self, cells: Integers) -> Floats:
        row, column = np.divmod(cells, len(self.x))
        return np.stack([self.x[column], self.v[row]], axis=-1)

    def _follow(self, cells: Integers) -> None:
        strobe = self.strobe
        _, made = strobe._states(self._states(cells))
        found, taken = np.empty(len(cells), dtype=np.int64), np.empty(len(cells), dtype=np.int64)
        setting, traps = strobe._setting(), self.known.traps

        def settled(part: slice) -> None:
            settle(setting, state.new_scratch(), made[part], self.periods, traps, found[part], taken[part])

        for _ in in_threads(settled, parts_of(len(cells), self.periods), threads=self.threads):
            pass
        outcome = np.full(len(cells), _UNSETTLED)
        inside = found >= 0
        outcome[inside] = _FIRST + self.known.owner[found[inside]]
        over = made["ending"] == Fate.OVERTURNED
        outcome[over] = np.where(made["side"][over] > 0, TO_MINUS, TO_PLUS)
        left = np.flatnonzero(~inside & ~over & (made["ending"] != Fate.UNFINISHED))
        ends = strobe._coordinates(made["u"][left], made["v"][left], made["side"][left])
        later = self.known.settle(ends)
        outcome[left] = np.where(later >= 0, _FIRST + later, _UNSETTLED)
        self.taken[cells], self.outcome[cells] = taken, outcome

    def dataset(self) -> xr.Dataset:
        """Everything that was found, attractors in the order of their shares, then what is none."""
        import xarray as xr

        found, counts = np.unique(self.outcome[self.outcome != NOT_REACHED], return_counts=True)
        total = counts.sum()
        order = sorted(zip(found.tolist(), counts.tolist(), strict=True), key=lambda each: (each[0] < _FIRST, -each[1]))
        numbers = [number for number, _ in order]
        orbits = [self.known.attractors[n - _FIRST] if n >= _FIRST else None for n in numbers]
        names = _distinct([NAMES[n] if orbit is None else orbit.name for n, orbit in zip(numbers, orbits, strict=True)])
        place = np.full(_FIRST + len(self.known.attractors) + 1, -1, dtype=np.int16)
        place[numbers] = np.arange(len(numbers))
        share = np.array([number for _, number in order]) / total
        longest = max([1, *(orbit.period for orbit in orbits if orbit is not None)])
        points = np.full((len(orbits), longest, 2), np.nan)
        for k, orbit in enumerate(orbits):
            if orbit is not None:
                points[k, : orbit.period] = orbit.states
        at, rate = self.strobe.body.coordinate.name, self.strobe.body.coordinate.rate
        unit = self.strobe.body.coordinate.unit
        cells = (rate, at)
        shape = len(self.v), len(self.x)
        return xr.Dataset(
            {
                "outcome": variable(cells, place[self.outcome].reshape(shape), "number of the attractor, or -1"),
                "periods": variable(cells, self.taken.reshape(shape), "periods until the outcome was known"),
                "share": variable("attractor", share, "share of the cells", "1"),
                "standard_error": variable(
                    "attractor", np.sqrt(share * (1.0 - share) / total), "of the share, as of random states", "1"
                ),
                "period": variable(
                    "attractor", [0 if orbit is None else orbit.period for orbit in orbits], "periods of the motion"
                ),
                "impacts": variable(
                    "attractor",
                    [-1 if orbit is None else orbit.impacts for orbit in orbits],
                    "impacts in a period of the orbit",
                ),
                "rests": variable("attractor", [orbit is not None and orbit.rests for orbit in orbits], "has a rest"),
                "multiplier": variable(
                    "attractor",
                    [np.nan if orbit is None else float(np.abs(orbit.multipliers).max()) for orbit in orbits],
                    "largest multiplier in size",
                    "1",
                ),
                "orbit_coordinate": variable(("attractor", "phase"), points[..., 0], f"{at} on the orbit", unit),
                "orbit_velocity": variable(("attractor", "phase"), points[..., 1], "rate on the orbit", f"{unit}/s"),
            },
            {
                rate: variable(rate, self.v, "velocity at the start of a period", f"{unit}/s"),
                at: variable(at, self.x, f"{at} at the start of a period", unit),
                "attractor": names,
            },
            {
                "program": f"rocking {VERSION}",
                "body": described(self.strobe.body),
                "motion": described(self.strobe.motion),
                "model": self.strobe.model,
                "most_periods": self.periods,
                "period_s": self.strobe.period,
            },
        )


def _extent(values: NDArray[np.float64]) -> float:
    """Size of a range of numbers, that of a single one at least."""
    return float(np.ptp(values) or abs(values[0]) or 1.0)


def _distinct(names: list[str]) -> list[str]:
    """Return names of which no two are equal: a letter behind each of those that were."""
    seen: dict[str, int] = {}
    found = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        several = names.count(name) > 1
        found.append(f"{name} ({_letter(seen[name])})" if several else name)
    return found


def _letter(number: int) -> str:
    return chr(ord("a") + number - 1) if number <= 26 else str(number)
