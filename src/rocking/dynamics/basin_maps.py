"""Basins of attraction of a body under periodic motion, where overturning to either side is an attractor as well."""

from __future__ import annotations

import hashlib
import io
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.arrays import Floats, Integers
from rocking.body import Body
from rocking.constants import VERSION, Model
from rocking.dynamics.attractors import Known
from rocking.dynamics.basin_measures import basin_entropy, uncertainty_exponent
from rocking.dynamics.maps import StroboscopicMap, parts_of, stroboscopic_map
from rocking.engine import cores, in_threads
from rocking.errors import InvalidOption
from rocking.kernels import state
from rocking.kernels.periodic import Fate, settle
from rocking.motion.motion import Motion
from rocking.progress import Progress, note
from rocking.result import DatasetResult, variable
from rocking.tables import counted, text_table, write_bytes
from rocking.treatment import Treatment

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What a cell is, before attractors are sorted: 3 + k belongs to attractor k.
_NOT_REACHED: Final = -1
_TO_PLUS, _TO_MINUS, _UNSETTLED = 0, 1, 2
_FIRST: Final = 3
_NAMES: Final = ("overturns to side +", "overturns to side -", "not settled")

#: Cells of the coarsest pass, at least; cells between two looks for attractors; and seconds between two savings.
_COARSEST: Final = 400
_BATCH: Final = 16_384
_BETWEEN_SAVINGS: Final = 20.0


@dataclass(frozen=True, eq=False, repr=False)
class Basins(DatasetResult):
    """Basins of attraction; from `basins`.

    Its figure has the basins in shades, and a mark at each point of the attractors.

    Attributes
    ----------
    data : xarray.Dataset
        Over (velocity, coordinate): outcome, the number of the attractor, -1 where an interrupt came first; periods,
        how many it took until that was known. Over (attractor): share of the cells (the basin's stability) with its
        standard_error as that of as many random states, period and impacts of its orbit (0 and -1 of what is none),
        rests, and multiplier, the largest in size. Over (attractor, phase): orbit_coordinate and orbit_velocity. What
        overturns and what has not settled on a periodic orbit count among the attractors.
    """

    TABLES = MappingProxyType(
        {
            "attractors": ("share", "standard_error", "period", "impacts", "rests", "multiplier"),
            "outcomes": ("outcome", "periods"),
            "orbits": ("orbit_coordinate", "orbit_velocity"),
        }
    )

    @property
    def entropy(self) -> tuple[float, float]:
        """Basin entropy and boundary basin entropy of boxes of 5 by 5 cells; see `basin_entropy`."""
        return basin_entropy(self.data.outcome.values)

    @property
    def uncertainty(self) -> tuple[float, float]:
        """Uncertainty exponent and its standard error; see `uncertainty_exponent`."""
        return uncertainty_exponent(self.data.outcome.values)

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
        head = f"basins of {data.body} under {data.motion}: {cells} cells, {counted(data.most_periods, 'period')}"
        text = [head, "", text_table(["attractor", "share", "standard error", "multiplier"], rows)]
        missing = int(np.count_nonzero(data.outcome.values == _NOT_REACHED))
        if missing:
            return "\n".join([*text, f"not reached before an interrupt: {missing} cells"])
        whole, boundary = self.entropy
        said = "above ln 2, so that it is fractal" if boundary > np.log(2.0) else "not above ln 2"
        text.append(f"basin entropy {whole:.4f}, of the boundary {boundary:.4f} ({said})")
        exponent, error = self.uncertainty
        if np.isfinite(exponent):
            dimension = f"dimension of the boundary {2.0 - exponent:.3f}"
            known = "" if np.isnan(error) else f" (standard error {error:.2g})"
            text.append(f"uncertainty exponent {exponent:.3f}{known}, {dimension}")
        return "\n".join(text)

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        complete = not np.any(data.outcome.values == _NOT_REACHED)
        whole, boundary = self.entropy if complete else (np.nan, np.nan)
        exponent, error = self.uncertainty if complete else (np.nan, np.nan)
        names = self.TABLES["attractors"]
        return {
            "body": data.body,
            "motion": data.motion,
            "model": data.model,
            "periods": data.most_periods,
            "complete": complete,
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
            "basin_entropy": whole,
            "boundary_basin_entropy": boundary,
            "uncertainty_exponent": exponent,
            "uncertainty_exponent_standard_error": error,
            "boundary_dimension": 2.0 - exponent,
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.basins import basins_figure

        data = self.data
        x, v = (data[name] for name in (str(data.outcome.dims[1]), str(data.outcome.dims[0])))
        names = [str(name) for name in data.attractor.values]
        return basins_figure(
            x=x.values,
            y=v.values,
            outcome=data.outcome.values,
            names=names,
            kinds=["overturns" if n in _NAMES[:2] else "unsettled" if n == _NAMES[2] else "orbit" for n in names],
            orbits=np.stack([data.orbit_coordinate.values, data.orbit_velocity.values], axis=-1),
            x_label=f"{x.name} at the start of a period ({x.units})",
            y_label=f"{str(v.name).replace('_', ' ')} ({v.units})",
            title=title or f"{data.body} under {data.motion}, {data.model} model",
            ax=ax,
            figsize=figsize,
        )


def basins(
    body: Body,
    motion: Motion,
    positions: ArrayLike,
    velocities: ArrayLike,
    periods: int = 200,
    *,
    model: Model | None = None,
    chattering: str | Treatment = "certified",
    folder: str | Path | None = None,
    threads: int | None = None,
    progress: bool | None = None,
) -> Basins:
    """Find what becomes of a body under periodic motion, for every initial state of a grid.

    Parameters
    ----------
    body : Block, or a body of `rocking.dynamics`
        What moves.
    motion : Motion
        One period, which repeats for ever.
    positions : array_like, shape (n,)
        Increasing coordinates at the start of a period: rotations of a block (rad), positions of other bodies (m).
    velocities : array_like, shape (m,)
        Increasing velocities, rad/s or m/s.
    periods : int
        Most periods that a state is followed for.
    model : {"nonlinear", "linear"}, optional
        As for `stroboscopic_map`.
    chattering : str or treatment
        As for `rocking.simulate`.
    folder : str or pathlib.Path, optional
        Where to keep what was computed, again and again; a call with the same arguments goes on from there.
    threads : int, optional
        Number of threads; by default one for every core.
    progress : bool, optional
        Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

    Returns
    -------
    Basins
        Attractors, basins and their measures; after an interrupt, of the cells that were reached. They come coarse to
        fine.

    Raises
    ------
    InvalidMotion
        If the motion is none, or has no length.
    InvalidOption
        If an argument is out of its range, or the folder holds basins of something else.

    Notes
    -----
    A state is followed until it overturns, or is in a neighbourhood of a stable periodic orbit in which the map
    contracts, on whose size the map was checked; else for all periods. What has not settled then may be chaotic, or
    slow. Orbits of up to 64 periods are looked for among the states that have not settled. Of a chaotic attractor no
    neighbourhood is known, so that its basin takes as long as all periods do.

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
    >>> for name, share in zip(found.attractor.values, found.share.values):
    ...     print(f"{name}: {share:.2f}")
    period 1, 2 impacts: 0.35
    overturns to side -: 0.52
    overturns to side +: 0.12
    """
    strobe = stroboscopic_map(body, motion, model=model, chattering=chattering)
    x, v = _axis(positions, "positions"), _axis(velocities, "velocities")
    checks.grid_size({"positions": len(x), "velocities": len(v)}, InvalidOption)
    most = checks.whole(periods, "periods", InvalidOption, least=1)
    count = None if threads is None else checks.whole(threads, "threads", InvalidOption, least=1)
    work = _Work(strobe, x, v, most, cores() if count is None else count)
    if folder is not None:
        work.keep_in(checks.path(folder, "folder", InvalidOption))
    work.run(progress)
    return Basins(work.dataset())


class _Work:
    """Cells of a grid, coarse to fine, with the attractors that are known so far."""

    def __init__(self, strobe: StroboscopicMap, x: Floats, v: Floats, periods: int, threads: int) -> None:
        self.strobe, self.x, self.v, self.periods, self.threads = strobe, x, v, periods, threads
        self.size = np.array([_extent(x), _extent(v)])
        self.outcome = np.full(len(x) * len(v), _NOT_REACHED, dtype=np.int16)
        self.taken = np.zeros(len(x) * len(v), dtype=np.int32)
        self.known = Known(strobe, self.size)
        self.file: Path | None = None
        strobe._states(self._states(np.array([0, len(x) * len(v) - 1])))  # a start behind a stop is refused at once

    def keep_in(self, folder: Path) -> None:
        """Go on from what a folder holds, and keep what is computed there."""
        folder.mkdir(parents=True, exist_ok=True)
        self.file = folder / "basins.npz"
        if not self.file.exists():
            return
        with np.load(self.file) as kept:
            if kept["key"].item() != self._key():
                raise InvalidOption("{} holds basins of something else; give another one", "folder", value=str(folder))
            self.outcome, self.taken = kept["outcome"], kept["taken"]
            self.known = Known(self.strobe, self.size, kept["attractors"])

    def run(self, progress: bool | None) -> None:
        """Follow all cells that are not done; an interrupt ends it."""
        done = int(np.count_nonzero(self.outcome != _NOT_REACHED))
        saved = time.monotonic()
        with Progress("basins", self.outcome.size, show=progress, done=done) as bar:
            try:
                for cells in self._batches():
                    self._follow(cells)
                    bar.advance(len(cells))
                    if time.monotonic() - saved > _BETWEEN_SAVINGS:
                        self._save()
                        saved = time.monotonic()
            except KeyboardInterrupt:
                if np.all(self.outcome == _NOT_REACHED):
                    raise
                note("interrupted: the basins hold the cells that were reached")
        self._save()

    def _batches(self) -> Iterator[Integers]:
        """Cells that are not done, coarse to fine; which ones go together does not depend on what is done."""
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
                batch = cells[start : start + _BATCH]
                if self.outcome[batch[0]] == _NOT_REACHED:
                    yield batch

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

        for _ in in_threads(settled, parts_of(len(cells)), threads=self.threads):
            pass
        outcome = np.full(len(cells), _UNSETTLED)
        inside = found >= 0
        outcome[inside] = _FIRST + self.known.owner[found[inside]]
        over = made["ending"] == Fate.OVERTURNED
        outcome[over] = np.where(made["side"][over] > 0, _TO_MINUS, _TO_PLUS)
        left = np.flatnonzero(~inside & ~over & (made["ending"] != Fate.UNFINISHED))
        ends = strobe._coordinates(made["u"][left], made["v"][left], made["side"][left])
        later = self.known.settle(ends)
        outcome[left] = np.where(later >= 0, _FIRST + later, _UNSETTLED)
        self.taken[cells], self.outcome[cells] = taken, outcome

    def _key(self) -> str:
        """Fingerprint of the problem."""
        strobe = self.strobe
        whole = hashlib.sha256()
        for array in (strobe._ground.pieces, strobe._records, self.x, self.v):
            whole.update(np.ascontiguousarray(array).tobytes())
        whole.update(f"{VERSION} {strobe.model} {strobe.treatment} {self.periods}".encode())
        return whole.hexdigest()

    def _save(self) -> None:
        if self.file is None:
            return
        packed = io.BytesIO()
        starts = [attractor.states[0] for attractor in self.known.attractors]
        np.savez_compressed(
            packed,
            key=np.array(self._key()),
            outcome=self.outcome,
            taken=self.taken,
            attractors=np.array(starts).reshape(-1, 2),
        )
        write_bytes(self.file, packed.getvalue())

    def dataset(self) -> xr.Dataset:
        """Everything that was found, attractors in the order of their shares, then what is none."""
        import xarray as xr

        found, counts = np.unique(self.outcome[self.outcome != _NOT_REACHED], return_counts=True)
        total = counts.sum()
        order = sorted(zip(found.tolist(), counts.tolist(), strict=True), key=lambda each: (each[0] < _FIRST, -each[1]))
        numbers = [number for number, _ in order]
        orbits = [self.known.attractors[n - _FIRST] if n >= _FIRST else None for n in numbers]
        names = _distinct(
            [_NAMES[n] if orbit is None else orbit.name for n, orbit in zip(numbers, orbits, strict=True)]
        )
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
                "body": told(self.strobe.body),
                "motion": told(self.strobe.motion),
                "model": self.strobe.model,
                "most_periods": self.periods,
                "period_s": self.strobe.period,
            },
        )


def told(what: Body | Motion) -> str:
    """Return what moves, or what shakes it, with its parameters in one line."""
    if isinstance(what, Motion):
        return ", ".join(part for part in (what.label, what.description.numbers) if part)
    return ", ".join([what.description, *dict.fromkeys(map(str, what.sides))])


def _axis(values: ArrayLike, name: str) -> Floats:
    axis = np.atleast_1d(checks.numbers(values, name, InvalidOption))
    if axis.ndim != 1 or axis.size == 0 or np.any(np.diff(axis) <= 0.0):
        raise InvalidOption("{} must be increasing numbers", name)
    return axis


def _extent(values: NDArray[np.float64]) -> float:
    """Size of a range of numbers, that of a single one at least."""
    return float(np.ptp(values) or abs(values[0]) or 1.0)


def _distinct(names: list[str]) -> list[str]:
    """Return names of which no two are equal: a letter behind each of those that were."""
    seen: dict[str, int] = {}
    told = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        several = names.count(name) > 1
        told.append(f"{name} ({_letter(seen[name])})" if several else name)
    return told


def _letter(number: int) -> str:
    return chr(ord("a") + number - 1) if number <= 26 else str(number)
