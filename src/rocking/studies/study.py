"""Studies too long for one sitting: created once, run anywhere, killed at any moment without loss."""

from __future__ import annotations

import json
import math
import os
import socket
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.block import Block, Blocks
from rocking.errors import InvalidOption, OutputError, StudyError
from rocking.motion.accepted import several_motions
from rocking.motion.motion import Motion
from rocking.product import Polarity, Product, Scales
from rocking.studies import store as stores
from rocking.studies.place import Folder, Place
from rocking.studies.run import RunReport, run
from rocking.studies.store import Store
from rocking.studies.units import OUTCOMES, Key, compute, name_of
from rocking.treatment import Treatment, treatment
from rocking.treatment.base import Model

if TYPE_CHECKING:
    import xarray as xr

#: Units are multiples of so many blocks, which the engine takes through a motion together.
_GROUP: Final = 512

#: How long a unit should take, s.
_UNIT: Final = 5.0


@dataclass(frozen=True)
class Status:
    """How far a study has come.

    Attributes
    ----------
    done, units : int
        Units that are done, of how many.
    simulations : int
        Simulations in all units.
    failed : mapping
        Sentence for each unit that the last run could not compute.
    runs : tuple
        Starts and ends of every run, as `runs.jsonl` has them.
    """

    done: int
    units: int
    simulations: int
    failed: dict[str, str]
    runs: tuple[dict[str, Any], ...]

    @property
    def complete(self) -> bool:
        """Whether every unit is done."""
        return self.done == self.units

    def __str__(self) -> str:
        """Write it in one line."""
        share = 100.0 * self.done / self.units
        text = f"{self.done} of {self.units} units done ({share:.1f} %), {self.simulations} simulations in all"
        return text + (f"; {len(self.failed)} failed in the last run" if self.failed else "")


@dataclass(frozen=True, eq=False, repr=False)
class Study:
    """Simulations of blocks, motions, scales and polarities, kept in a store; from `rocking.study`.

    Attributes
    ----------
    place : Place
        Where it is kept.
    store : Store
        Its units.
    """

    place: Place
    store: Store

    @property
    def product(self) -> Product:
        """What is simulated."""
        return self.store.product

    def run(
        self, threads: int | None = None, executor: Executor | None = None, *, progress: bool | None = None
    ) -> RunReport:
        """Compute every unit that is not done.

        Parameters
        ----------
        threads : int, optional
            Number of threads; by default one for every core.
        executor : concurrent.futures.Executor, optional
            Who computes instead: processes, or a cluster (``client.get_executor()`` of dask.distributed). Workers only
            compute; this process alone writes.
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

        Returns
        -------
        RunReport
            What this run did. Ctrl-C and SIGTERM finish the units in hand first; a second one stops at once. Nothing
            that was computed is lost either way.

        Raises
        ------
        StudyError
            If the study is being run elsewhere, was made by another version, or the workers are gone.
        OutputError
            If a unit cannot be written.
        """
        if threads is not None:
            threads = checks.whole(threads, "threads", InvalidOption, least=1)
        self.store.check_program()
        with self.place.locked() as note:
            self._log({"event": "start", "note": note})
            try:
                report = run(self.store, threads=threads, executor=executor, progress=progress)
            except BaseException as error:
                self._log({"event": "end", "error": str(error) or type(error).__name__})
                raise
            self._log({"event": "end", **asdict(report)})
        return report

    @property
    def status(self) -> Status:
        """How far it has come; may be asked while another process runs it."""
        runs = tuple(self._runs())
        ended = [one for one in runs if one.get("event") == "end"]
        failed = ended[-1].get("failed", {}) if ended else {}
        grid = self.store.grid
        return Status(len(self.store.done()), len(grid), math.prod(grid.shape), failed, runs)

    def results(self) -> xr.Dataset:
        """Outcomes so far, read from the store when they are needed.

        Returns
        -------
        xarray.Dataset
            As from `simulate_many`: over (motion, scale, polarity, block), those that apply. While units are missing
            every variable is of floats, NaN where its unit is not done, and a variable ``done`` says which are.

        Raises
        ------
        StudyError
            When a damaged unit is read; the message names it.
        """
        from rocking.studies.lazy import lazy

        done = self.store.done()
        complete = len(done) == len(self.store.grid)
        outcomes: dict[str, Any] = {name: lazy(self.store, name, complete) for name in OUTCOMES}
        if not complete:
            outcomes["done"] = self._done_mask(done)
        return self.product.dataset(outcomes)

    def verify(self, recompute: int = 0, *, repair: bool = False, seed: int = 0) -> list[str]:
        """Read every unit and check it; compute some again and compare all their bits.

        Parameters
        ----------
        recompute : int
            How many units, drawn at random, to compute again.
        repair : bool
            Whether to compute damaged units again and store them.
        seed : int
            Seed of the draw.

        Returns
        -------
        list of str
            A sentence for each unit that is damaged or differs; empty if all is well.

        Raises
        ------
        StudyError
            If units are to be computed again and the study was made by another version.
        """
        if recompute or repair:
            self.store.check_program()
        done = sorted(self.store.done())
        faults = {key: fault for key in done if (fault := self._fault(key))}
        sound = [key for key in done if key not in faults]
        rng = np.random.default_rng(seed)
        for k in rng.permutation(len(sound))[:recompute]:
            if compute(*self.store.work(sound[k])) != self.store.raw(sound[k]):
                faults[sound[k]] = f"unit {name_of(sound[k])} is not what this program computes"
        if repair:
            with self.place.locked():
                for key in faults:
                    self.store.put(key, compute(*self.store.work(key)))
        return list(faults.values())

    def export(self, path: str | Path) -> None:
        """Write the results to one file: NetCDF (.nc), CSV (.csv) or Parquet (.parquet, with pyarrow installed).

        Raises
        ------
        InvalidOption
            If the suffix is another, or pyarrow is missing.
        OutputError
            If the file cannot be written.
        """
        target, dataset = Path(path), self.results()
        try:
            if target.suffix == ".nc":
                dataset.to_netcdf(target, engine="h5netcdf")
            elif target.suffix == ".csv":
                dataset.to_dataframe().to_csv(target)
            elif target.suffix == ".parquet":
                dataset.to_dataframe().to_parquet(target)
            else:
                raise InvalidOption(f"a study is exported to .nc, .csv or .parquet, not to {target.name}")
        except ImportError:
            raise InvalidOption("Parquet needs pyarrow: install rocking[parquet], or export to .csv or .nc") from None
        except OSError as error:
            raise OutputError(f"{target} cannot be written: {error.strerror or error}; choose another place") from error

    def __repr__(self) -> str:
        m, s, k, n = self.store.grid.shape
        return f"<Study: {m} motions x {s} scales x {k} polarities x {n} blocks; {self.status}>"

    def _fault(self, key: Key) -> str:
        try:
            self.store.outcomes(key)
        except StudyError as error:
            return str(error)
        return ""

    def _done_mask(self, done: set[Key]) -> np.ndarray[Any, np.dtype[np.bool_]]:
        mask = np.zeros(self.store.grid.shape, dtype=bool)
        for key in done:
            mask[(*key[:3], self.store.grid.block_range(key))] = True
        return mask

    def _log(self, entry: dict[str, Any]) -> None:
        who = {"time": time.strftime("%Y-%m-%dT%H:%M:%S%z"), "process": os.getpid(), "host": socket.gethostname()}
        self.place.append("runs.jsonl", json.dumps(who | entry))

    def _runs(self) -> Iterator[dict[str, Any]]:
        """Entries of the log; a line that was cut off by a crash is passed over."""
        for line in (self.place.get("runs.jsonl") or b"").splitlines():
            try:
                yield json.loads(line)
            except ValueError:
                continue


def study(
    folder: str | Path,
    blocks: Blocks | Block | Sequence[Block] | None = None,
    motions: Motion | Sequence[Motion] | None = None,
    *,
    model: Model = "nonlinear",
    chattering: str | Treatment = "certified",
    factor: ArrayLike | None = None,
    pga: ArrayLike | None = None,
    pgv: ArrayLike | None = None,
    sa: ArrayLike | None = None,
    period: float | None = None,
    damping: float = 0.05,
    polarity: Polarity = "+",
    duration: float | None = None,
    unit_blocks: int | None = None,
) -> Study:
    """Create a study, or open one that is there and check that its inputs are these.

    Parameters
    ----------
    folder : path
        Where the study is kept.
    blocks, motions
        As for `simulate_many`; without both, the study must be there, and needs no script.
    model, chattering, factor, pga, pgv, sa, period, damping, polarity, duration
        As for `simulate_many`.
    unit_blocks : int, optional
        Blocks of a unit, a multiple of 512; by default so many that a unit takes about five seconds, from a pilot.

    Returns
    -------
    Study
        ``.run()`` computes what is missing, ``.results()`` reads what is there.

    Raises
    ------
    StudyError
        If there is no study and no inputs are given, it holds other inputs, or it is damaged.

    Examples
    --------
    >>> import tempfile
    >>> import rocking
    >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
    >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
    >>> folder = tempfile.mkdtemp()
    >>> first = study(folder, blocks, motion, factor=[0.4, 1.0], unit_blocks=512)
    >>> _ = first.run()
    >>> study(folder).results().overturned.sel(scale=0.4).values.tolist()
    [[True, False, True, False]]
    """
    place = Folder(Path(folder))
    if blocks is None or motions is None:
        if blocks is not None or motions is not None:
            raise InvalidOption("a new study needs blocks and motions; one that is there needs neither")
        return Study(place, Store.open(place))
    product = Product(
        Blocks.of(blocks),
        tuple(several_motions(motions)),
        Scales.of(factor=factor, pga=pga, pgv=pgv, sa=sa, period=period, damping=damping),
        polarity,
        model,
        treatment(chattering),
        duration,
    )
    return study_of(place, product, unit_blocks)


def study_of(place: Place, product: Product, unit_blocks: int | None = None) -> Study:
    """Create the study of a product in a place, or open the one that is there and check its inputs.

    Raises
    ------
    StudyError
        If there is one of other inputs, or it is damaged.
    """
    if stores.exists(place):
        found = Store.open(place)
        found.check_inputs(product)
        return Study(place, found)
    width = _pilot(product) if unit_blocks is None else _checked_width(unit_blocks)
    return Study(place, Store.create(place, product, width))


def _checked_width(unit_blocks: int) -> int:
    width = checks.whole(unit_blocks, "unit_blocks", InvalidOption, least=_GROUP)
    if width % _GROUP:
        raise InvalidOption(f"unit_blocks must be a multiple of {_GROUP}, not {width}")
    return width


def _pilot(product: Product) -> int:
    """Blocks of a unit that takes about five seconds: from one group of blocks spread over all, under one motion."""
    count = len(product.blocks)
    if count <= _GROUP:
        return _GROUP
    some = product.blocks.select(np.linspace(0, count - 1, _GROUP).astype(np.int64))
    motion = max(product.motions, key=lambda one: len(one.coefficients))
    factor = float(product.scales.factors(motion).max())
    setup = Product(some, (motion,), Scales(), "+", product.model, product.treatment, product.duration).setup()
    compute(setup, motion, factor, _GROUP)  # compiles
    start = time.perf_counter()
    compute(setup, motion, factor, _GROUP)
    groups = math.ceil(_UNIT / max(time.perf_counter() - start, 1e-3))
    return _GROUP * min(groups, math.ceil(count / _GROUP))
