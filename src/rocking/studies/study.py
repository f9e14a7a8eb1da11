"""Studies too long for one sitting: created once, run anywhere, killed at any moment without loss."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.fragility import Fragility
from rocking.analysis.levels import OVERTURNING
from rocking.block.body import Bodies, Body
from rocking.core import checks
from rocking.core.constants import Model
from rocking.core.tables import counted, write_netcdf
from rocking.engine.treatment import Treatment
from rocking.errors import InvalidOption
from rocking.motion.scaling import IntensityName, Measure, MeasureName
from rocking.records.named import Motions, names_of
from rocking.simulation.ensemble import Polarity, Product, dataset_of, product_of
from rocking.studies.folder import Folder, Store, exists, require_free
from rocking.studies.product import OUTCOMES, chosen_outcomes
from rocking.studies.report import (
    FRACTILES,
    BlockFragilities,
    ReportPart,
    ReportPlan,
    StudySpectrum,
    block_fragilities,
    keep_report,
    kept_report,
    made_report,
    pooled_fragility,
    study_spectrum,
)
from rocking.studies.results import StudyVerdict, critical_scales, lazy_outcome, write_table
from rocking.studies.run import RunReport, Status, log_run, run, status_of, verified
from rocking.studies.units import fitting_unit, width_of

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False, repr=False)
class Study:
    """Simulations of blocks, motions, scales and polarities, kept in a folder; from `rocking.study`.

    Examples
    --------
    >>> import pathlib, rocking, tempfile
    >>> block, pulse = rocking.Block.from_parameters(2.0, 0.1, 0.9), rocking.pulses.one_sine(4.0, 1.0)
    >>> study = rocking.study(tempfile.mkdtemp(), block, pulse, levels=[0.4, 1.0], unit_blocks=512)
    >>> _ = study.run()
    >>> table = pathlib.Path(tempfile.mkdtemp(), "all.csv")
    >>> study.to_csv(table)
    >>> table.read_text().splitlines()[1][:40]
    'one-sine,0.4,0,2.0,0.1,0.9,True,1.570796'
    """

    _store: Store

    @property
    def place(self) -> str:
        """Folder where it is kept."""
        return str(self._store.folder)

    @property
    def product(self) -> Product:
        """What is simulated."""
        return self._store.product

    @property
    def outcomes(self) -> tuple[str, ...]:
        """What is kept of each simulation."""
        return self._store.grid.outcomes

    @property
    def status(self) -> Status:
        """How far it has come; may be asked while another process runs it."""
        return status_of(self._store)

    def run(
        self,
        threads: int | None = None,
        executor: Executor | Any = None,
        *,
        part: str | None = None,
        progress: bool | None = None,
    ) -> RunReport:
        """Compute every unit that is not done.

        Parameters
        ----------
        threads : int, optional
            As for `simulate_many`.
        executor : concurrent.futures.Executor or dask.distributed.Client, optional
            Processes, or the client of a cluster, whose workers compute instead; only this process writes.
        part : str, optional
            Compute a fixed share of the units only, as "3/10", the third of ten. Different shares may run at the same
            time, on machines with a common file system; a run without a part then computes what is missing.
        progress : bool, optional
            As for `simulate_many`.

        Returns
        -------
        RunReport
            Units that this run computed. SIGTERM finishes the units in hand first; Ctrl-C ends the run at once. Stored
            units are kept either way.

        Raises
        ------
        InvalidOption
            If an argument is out of its range.
        StudyError
            If the study is being run elsewhere, was made by another version, or the workers are gone.
        OutputError
            If a unit cannot be written.
        """
        if threads is not None:
            threads = checks.whole(threads, "threads", InvalidOption, least=1)
        number, count = (1, 1) if part is None else _part(part)
        store, folder, lock = self._store, self._store.folder, "lock" if part is None else f"lock.{number}-{count}"
        store.check_program()
        with folder.locked(lock):
            for name, data in store.metadata.items():
                folder.keep(name, data)
            share = [*itertools.islice(store.grid, number - 1, None, count)]
            log_run(folder, lock, {"event": "start", "done": sum(map(store.grid.simulations, store.done()))})

            def failing(unit: str, why: str) -> None:
                log_run(folder, lock, {"event": "failed", "unit": unit, "why": why})

            try:
                report = run(store, share, threads=threads, executor=executor, progress=progress, failing=failing)
            except BaseException as error:
                log_run(folder, lock, {"event": "end", "error": str(error) or type(error).__name__})
                raise
            about = {"units": report.units, "seconds": report.seconds, "stopped": report.stopped}
            log_run(folder, lock, {"event": "end", **about})
        return report

    def results(self) -> xr.Dataset:
        """Outcomes so far, read from the folder when they are needed, as `simulate_many` returns them.

        While units are missing every variable is of floats, NaN where its unit is not done, and a variable ``done``
        marks the others. A StudyError names a damaged unit when it is read.
        """
        done, grid = self._store.done(), self._store.grid
        complete = len(done) == len(grid)
        outcomes: dict[str, Any] = {name: lazy_outcome(self._store, name, complete) for name in grid.outcomes}
        if not complete:
            outcomes["done"] = np.zeros(grid.shape, dtype=bool)
            for key in done:
                outcomes["done"][grid.ranges(key)] = True
        return self._with_records(dataset_of(self.product, outcomes))

    def _with_records(self, found: xr.Dataset) -> xr.Dataset:
        """Name each motion by its record, too, where the study knows that."""
        records = dict(zip(names_of(self.product.motions), self._store.records(), strict=False))
        if not records:
            return found
        return found.assign_coords(record=(found.motion.dims, [records[name] for name in found.motion.values.tolist()]))

    def verify(
        self, recompute: int = 0, *, repair: bool = False, seed: int = 0, progress: bool | None = None
    ) -> list[str]:
        """Read every unit and all that describes the study, and check it; compute some units again, to the last bit.

        Parameters
        ----------
        recompute : int
            Number of units, drawn at random, to compute again.
        repair : bool
            Whether to compute damaged units again and store them.
        seed : int
            Seed of the draw.
        progress : bool, optional
            As for `simulate_many`.

        Returns
        -------
        list of str
            A sentence for each unit or file that is damaged or differs; empty if all is well.

        Raises
        ------
        StudyError
            If units are to be computed again and the study was made by another version, or its inputs are damaged.
        """
        return verified(self._store, recompute, repair, seed, progress)

    def critical_scales(self, verdict: StudyVerdict = "overturning") -> xr.Dataset:
        """Scales between which the verdict on a block changes.

        Parameters
        ----------
        verdict : {"overturning", "complete_chattering"}
            Whether a block overturns; or whether it comes to rest after its first uplift before the motion passes a
            threshold again.

        Returns
        -------
        xarray.Dataset
            Over ``change``, in order of motion, polarity, block and scale: low and high (neighbouring scales with a
            known verdict, in the units of the measure), overturns or completes (the verdict at the higher one), known
            (whether all verdicts between them are), with motion, polarity, block and its parameters. A block that
            stands a stronger motion than one that overturns it has several.

        Raises
        ------
        StudyError
            If units are missing or damaged.
        InvalidOption
            If there is no such verdict, the study does not keep its outcomes, or has no two scales in increasing order.
        """
        return self._with_records(critical_scales(self._store, verdict))

    def fragility(
        self,
        *,
        measure: IntensityName | Measure = "pga",
        limits: Mapping[str, float] = OVERTURNING,
        confidence: float = 0.9,
        weights: ArrayLike | None = None,
        clusters: ArrayLike | None = None,
    ) -> Fragility:
        """Fit fragility curves to the outcomes of all blocks, with arguments and results as for `rocking.fragility`.

        The intensity is what a motion measures at a scale. A StudyError is raised if units are missing or damaged.
        """
        return pooled_fragility(self._store, Measure.of(measure), limits, confidence, weights, clusters)

    def block_fragilities(
        self,
        *,
        measure: IntensityName | Measure = "pga",
        limits: Mapping[str, float] = OVERTURNING,
        confidence: float = 0.9,
        clusters: ArrayLike | None = None,
        progress: bool | None = None,
    ) -> BlockFragilities:
        """Fit a fragility curve to the outcomes of each block, with arguments and errors as for `Study.fragility`.

        A curve takes some hundredths of a second where motions were scaled to the measure (stripes), and seconds where
        thousands of outcomes have an intensity each (a cloud). Where no lognormal fits, a sentence is kept instead.
        """
        return block_fragilities(self._store, Measure.of(measure), limits, confidence, clusters, progress)

    def spectrum(self, fractiles: Sequence[float] = FRACTILES, *, progress: bool | None = None) -> StudySpectrum:
        """Fractiles over the motions of the peak rotation over slenderness, for each scale and block.

        Parameters
        ----------
        fractiles : sequence of float
            Shares of the motions, in (0, 1), that stay below.
        progress : bool, optional
            As for `simulate_many`.

        Returns
        -------
        StudySpectrum
            Fractiles of every scale and block, with the share of the motions that overturns the block.

        Raises
        ------
        StudyError
            If units are missing or damaged.
        InvalidOption
            If a fractile is out of its range, or the study does not keep overturned and peak_rotation.
        """
        return study_spectrum(self._store, fractiles, progress)

    def report(self, *, progress: bool | None = None) -> dict[str, ReportPart]:
        """Make the results that the study's file lists under [report], by "fragility" and "spectrum".

        Each has a summary and a figure. A StudyError is raised if the file lists none, or units are missing or damaged.
        """
        return made_report(self._store, progress)

    def to_netcdf(self, path: str | Path, *, critical: StudyVerdict | None = None) -> None:
        """Write the `results` to a NetCDF file, or the critical scales, as `to_csv` does."""
        write_netcdf(path, self._results(critical)[0])

    def to_csv(self, path: str | Path, *, critical: StudyVerdict | None = None, progress: bool | None = None) -> None:
        """Write a row for each simulation as text, in columns named with their units.

        Parameters
        ----------
        path : str or pathlib.Path
            File to write, whole or not at all.
        critical : {"overturning", "complete_chattering"}, optional
            Write the `critical_scales` of this verdict instead, a row for each change.
        progress : bool, optional
            As for `simulate_many`.

        Raises
        ------
        OutputError
            If the file cannot be written.
        StudyError
            If a unit is damaged, or units are missing for critical scales.
        """
        write_table("csv", path, *self._results(critical), progress)

    def to_json(self, path: str | Path, *, critical: StudyVerdict | None = None, progress: bool | None = None) -> None:
        """Write an object for each simulation as JSON, with arguments and errors as for `to_csv`.

        The keys are those of the columns of `to_csv`, and NaN is null. The attributes of the study and of its measure
        are under "study".
        """
        write_table("json", path, *self._results(critical), progress)

    def to_parquet(
        self, path: str | Path, *, critical: StudyVerdict | None = None, progress: bool | None = None
    ) -> None:
        """Write the table of `to_csv` as Parquet, with its arguments and errors; requires pyarrow."""
        write_table("parquet", path, *self._results(critical), progress)

    def _results(self, critical: StudyVerdict | None) -> tuple[xr.Dataset, str, int]:
        """Return what is written, the dimension along which it is cut, and how much of it is held in memory."""
        if critical:
            return self.critical_scales(critical), "change", 1 << 16
        return self.results(), "motion", self._store.grid.unit[0]

    def __repr__(self) -> str:
        m, s, k, n = self._store.grid.shape
        sizes = counted(m, "motion"), counted(s, "scale"), counted(k, "polarity"), counted(n, "block")
        return f"<Study: {' x '.join(sizes)}; {self.status}>"


def study(
    folder: str | Path,
    blocks: Bodies | Body | Sequence[Body] | None = None,
    motions: Motions | None = None,
    *,
    model: Model = "nonlinear",
    chattering: str | Treatment = "certified",
    levels: ArrayLike | None = None,
    measure: MeasureName | Measure = "factor",
    polarity: Polarity = "+",
    duration: float | None = None,
    outcomes: Sequence[str] | None = None,
    unit_blocks: int | None = None,
) -> Study:
    """Create a study, or open one that is there and check that its inputs are these.

    Parameters
    ----------
    folder : path
        Folder where the study is kept.
    blocks, motions : optional
        As for `simulate_many`; without both, the study must be there, and takes no other argument.
    model, chattering, levels, measure, polarity, duration : optional
        As for `simulate_many`.
    outcomes : sequence of str, optional
        Variables of `simulate_many` to keep; by default all. stalled, unfinished and stopped are always kept: they say
        which of the others are answers.
    unit_blocks : int, optional
        Blocks of a unit, a multiple of 512, of one motion, scale and polarity; by default a unit holds as many of all
        as take about five seconds, from a pilot.

    Returns
    -------
    Study
        ``.run()`` computes what is missing, ``.results()`` reads what is there.

    Raises
    ------
    StudyError
        If there is no study and no inputs are given, it holds other inputs or outcomes, or it is damaged.
    InvalidOption
        If an argument is out of its range.

    Examples
    --------
    >>> import rocking, tempfile
    >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
    >>> folder, pulse = tempfile.mkdtemp(), rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
    >>> _ = study(folder, blocks, pulse, levels=[0.4, 1.0], unit_blocks=512).run()
    >>> study(folder).results().overturned.sel(scale=0.4).values.tolist()
    [[True, False, True, False]]
    """
    where = Folder(folder)
    if blocks is not None and motions is not None:
        product = product_of(blocks, motions, levels, measure, polarity, model, chattering, duration)
        return study_of(where, product, unit_blocks, outcomes=chosen_outcomes(outcomes))
    if blocks is not None or motions is not None:
        raise InvalidOption("a new study needs {} and {}; one that is there needs neither", "blocks", "motions")
    texts = {"model": (model, "nonlinear"), "chattering": (chattering, "certified"), "measure": (measure, "factor")}
    texts |= {"polarity": (polarity, "+")}
    others = {"levels": levels, "duration": duration, "outcomes": outcomes, "unit_blocks": unit_blocks}
    ignored = [name for name, (value, default) in texts.items() if value != default]
    ignored += [name for name, value in others.items() if value is not None]
    if ignored:
        raise InvalidOption(
            f"{', '.join(['{}'] * len(ignored))} belong{'s' if len(ignored) == 1 else ''} to {{}} and {{}}: give those "
            "as well, or open the study by its folder alone",
            *ignored,
            "blocks",
            "motions",
        )
    return Study(Store.open(where))


def study_of(
    folder: Folder,
    product: Product,
    unit_blocks: int | None = None,
    plan: ReportPlan | None = None,
    outcomes: tuple[str, ...] = OUTCOMES,
    records: Sequence[str] = (),
) -> Study:
    """Create the study of a product in a folder, or open the one there, check its inputs, replace plan and records."""
    found = None if exists(folder) else _created(folder, product, unit_blocks, outcomes)
    if found is None:
        found = Store.open(folder)
        found.check_inputs(product, outcomes)
        width, count = found.grid.unit[3], len(product.bodies)
        if unit_blocks is not None and min(width_of(unit_blocks), count) != min(width, count):
            raise InvalidOption(
                f"the study is there already, in units of {width} blocks: leave {{}} out", "unit_blocks"
            )
    if any(records) or (records and found.records()):
        found.name_records(records)
    if plan is not None and (plan != ReportPlan() or kept_report(folder) is not None):
        keep_report(folder, plan)
    return Study(found)


def _created(folder: Folder, product: Product, unit_blocks: int | None, outcomes: tuple[str, ...]) -> Store | None:
    """Create the store of a study; None where another process has done so meanwhile."""
    require_free(folder)  # before the pilot, and before a lock is put beside the files of others
    unit = fitting_unit(product) if unit_blocks is None else (1, 1, 1, width_of(unit_blocks))
    with folder.locked():
        return None if exists(folder) else Store.create(folder, product, unit, outcomes)


def _part(part: str) -> tuple[int, int]:
    """Return the number of a part, and how many there are."""
    number, slash, count = str(part).partition("/")
    if not (slash and number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
        raise InvalidOption(
            f"{{}} must be the number of a share of the units and of all shares, as 3/10; got {part}",
            "part",
            value=part,
        )
    return int(number), int(count)
