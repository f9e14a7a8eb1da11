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

from rocking import checks
from rocking.analysis.fragility import OVERTURNING, Fragility
from rocking.body import Bodies, Body
from rocking.constants import Model
from rocking.ensemble import Polarity, Product, dataset_of, product_of
from rocking.errors import InvalidOption
from rocking.motion.named import Motions, names_of
from rocking.motion.scaling import IntensityName, Measure, MeasureName
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
from rocking.tables import counted, write_netcdf
from rocking.treatment import Treatment

if TYPE_CHECKING:
    import xarray as xr

#: Changes of verdicts that are held in memory at a time, where they are written to a file.
_CHANGES = 1 << 16


@dataclass(frozen=True, eq=False, repr=False)
class Study:
    """Simulations of blocks, motions, scales and polarities, kept in a store; from `rocking.study`.

    Attributes
    ----------
    place : str
        Folder where it is kept.
    product : Product
        What is simulated.
    outcomes : tuple of str
        What is kept of each simulation.
    status : Status
        How far it has come; may be asked while another process runs it.
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
            Number of threads; by default one for every core.
        executor : concurrent.futures.Executor or dask.distributed.Client, optional
            Processes, or the client of a cluster, whose workers compute instead; only this process writes.
        part : str, optional
            Compute a fixed share of the units only, as "3/10", the third of ten. Different shares may run at the same
            time, on machines with a common file system; a run without a part then computes what is missing.
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

        Returns
        -------
        RunReport
            What this run did. SIGTERM finishes the units in hand first; Ctrl-C ends the run at once. Nothing that was
            stored is lost either way.

        Raises
        ------
        InvalidOption
            If the number of threads is not a whole number from 1, or the executor or the part is none.
        StudyError
            If the study is being run elsewhere, was made by another version, or the workers are gone.
        OutputError
            If a unit cannot be written.

        Examples
        --------
        >>> import tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> study = rocking.study(tempfile.mkdtemp(), blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> study.run().simulations
        8
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
        """Outcomes so far, read from the store when they are needed.

        Returns
        -------
        xarray.Dataset
            As from `simulate_many`: over (motion, scale, polarity, block), those that apply, with the outcomes that
            the study keeps. While units are missing every variable is of floats, NaN where its unit is not done, and a
            variable ``done`` says which are.

        Raises
        ------
        StudyError
            When a damaged unit is read; the message names it.

        Examples
        --------
        >>> import tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> study = rocking.study(tempfile.mkdtemp(), blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> _ = study.run()
        >>> study.results().impacts.values.tolist()
        [[[1, 0, 1, 0], [0, 1, 0, 0]]]
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
            How many units, drawn at random, to compute again.
        repair : bool
            Whether to compute damaged units again and store them.
        seed : int
            Seed of the draw.
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

        Returns
        -------
        list of str
            A sentence for each unit or file that is damaged or differs; empty if all is well.

        Raises
        ------
        StudyError
            If units are to be computed again and the study was made by another version, or what says what is computed
            is damaged.

        Examples
        --------
        >>> import tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> study = rocking.study(tempfile.mkdtemp(), blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> _ = study.run()
        >>> study.verify(recompute=1)
        []
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
            Over ``change``, in order of motion, polarity, block and scale: low and high (scales, in the units of the
            measure), overturns or completes (whether the verdict holds at the higher one, and not at the lower one),
            known (whether all verdicts between them are: a simulation may have been given up or stopped, or a rest not
            be proven); motion, polarity, block and its parameters as coordinates. A block that
            stands a stronger motion than one that overturns it has several. Brackets are neighbouring scales of the
            study; where verdicts are not known at scales between two that differ, the bracket is those two.

        Raises
        ------
        StudyError
            If units are missing or damaged.
        InvalidOption
            If there is no such verdict, the study does not keep its outcomes, or has no two scales in increasing order.

        Examples
        --------
        >>> import tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> study = rocking.study(tempfile.mkdtemp(), blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> _ = study.run()
        >>> found = study.critical_scales()
        >>> found.block.values.tolist(), found.low.values.tolist(), found.high.values.tolist()
        ([1, 3], [0.4, 0.4], [1.0, 1.0])
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
        """Fit the probability that a limit is exceeded to the outcomes of all blocks, as `rocking.fragility` does.

        Parameters
        ----------
        measure : {"pga", "pgv", "sa", "pga_ratio", "pgv_ratio"} or Measure
            As for `rocking.fragility`. What a motion measures at a scale is its intensity.
        limits : mapping of str to float
            As for `rocking.fragility`.
        confidence : float
            As for `rocking.fragility`.
        weights : array_like, optional
            As for `rocking.fragility`.
        clusters : "station" or array_like of labels, optional
            As for `rocking.fragility`, one for each motion of the study.

        Returns
        -------
        Fragility
            A curve for each limit.

        Raises
        ------
        StudyError
            If units are missing or damaged.
        InvalidOption
            If an argument is out of its range, the study does not keep what a limit needs, or no lognormal fits.

        Examples
        --------
        >>> import tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> study = rocking.study(tempfile.mkdtemp(), blocks, motion, levels=[0.4, 0.6, 1.0], unit_blocks=512)
        >>> _ = study.run()
        >>> f"{study.fragility().curves[0].median:.3f} m/s^2"
        '1.662 m/s^2'
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
        """Fit a fragility curve to the outcomes of each block.

        Parameters
        ----------
        measure : {"pga", "pgv", "sa", "pga_ratio", "pgv_ratio"} or Measure
            As for `rocking.fragility`. A curve takes some hundredths of a second where motions were scaled to the
            measure (stripes), and seconds where thousands of outcomes have an intensity each (a cloud).
        limits : mapping of str to float
            As for `rocking.fragility`.
        confidence : float
            As for `rocking.fragility`.
        clusters : "station" or array_like of labels, optional
            As for `rocking.fragility`, one for each motion of the study.
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

        Returns
        -------
        BlockFragilities
            A curve for each block and limit, or why there is none.

        Raises
        ------
        StudyError
            If units are missing or damaged.
        InvalidOption
            If an argument is out of its range, or the study does not keep what a limit needs. A block that no lognormal
            fits has a sentence in place of a curve.

        Examples
        --------
        >>> import tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> study = rocking.study(tempfile.mkdtemp(), blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> _ = study.run()
        >>> study.block_fragilities().data.exceeded.values.tolist()
        [[2.0, 1.0, 2.0, 1.0]]
        """
        return block_fragilities(self._store, Measure.of(measure), limits, confidence, clusters, progress)

    def spectrum(self, fractiles: Sequence[float] = FRACTILES, *, progress: bool | None = None) -> StudySpectrum:
        """Fractiles over the motions of the peak rotation over slenderness, for each scale and block.

        Parameters
        ----------
        fractiles : sequence of float
            Shares of the motions, in (0, 1), that stay below.
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

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

        Examples
        --------
        >>> import tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> study = rocking.study(tempfile.mkdtemp(), blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> _ = study.run()
        >>> study.spectrum([0.5]).data.overturned_share.values.tolist()
        [[1.0, 0.0, 1.0, 0.0], [1.0, 1.0, 1.0, 1.0]]
        """
        return study_spectrum(self._store, fractiles, progress)

    def report(self, *, progress: bool | None = None) -> dict[str, ReportPart]:
        """Make what the study's file asks for under [report].

        Parameters
        ----------
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

        Returns
        -------
        dict
            "fragility" and "spectrum", as far as they are asked for: results with a summary and a figure.

        Raises
        ------
        StudyError
            If nothing is asked for, or units are missing or damaged.

        Examples
        --------
        >>> import tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> study = rocking.study(tempfile.mkdtemp(), blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> study.report()
        Traceback (most recent call last):
        ...
        rocking.errors.StudyError: ...the study says nothing of a report: add [report.fragility] to its file ...
        """
        return made_report(self._store, progress)

    def to_netcdf(self, path: str | Path, *, critical: StudyVerdict | None = None) -> None:
        """Write the results as `results` returns them to a NetCDF file.

        Parameters
        ----------
        path : path
            File to write.
        critical : {"overturning", "complete_chattering"}, optional
            Write the `critical_scales` of this verdict instead, a row for each change.

        Raises
        ------
        OutputError
            If the file cannot be written.
        StudyError
            If a unit is damaged, or units are missing for critical scales.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> folder = pathlib.Path(tempfile.mkdtemp())
        >>> study = rocking.study(folder / "study", blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> _ = study.run()
        >>> study.to_netcdf(folder / "all.nc")
        >>> (folder / "all.nc").is_file()
        True
        """
        write_netcdf(path, self._results(critical)[0])

    def to_csv(self, path: str | Path, *, critical: StudyVerdict | None = None, progress: bool | None = None) -> None:
        """Write a row for each simulation as text, in columns named with their units.

        Parameters
        ----------
        path : path
            File to write.
        critical : {"overturning", "complete_chattering"}, optional
            Write the `critical_scales` of this verdict instead, a row for each change.
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

        Raises
        ------
        OutputError
            If the file cannot be written.
        StudyError
            If a unit is damaged, or units are missing for critical scales.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> folder = pathlib.Path(tempfile.mkdtemp())
        >>> study = rocking.study(folder / "study", blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> _ = study.run()
        >>> study.to_csv(folder / "all.csv")
        >>> (folder / "all.csv").read_text().splitlines()[1][:40]
        'one-sine,0.4,0,2.0,0.1,0.9,True,1.570796'
        """
        write_table("csv", path, *self._results(critical), progress)

    def to_json(self, path: str | Path, *, critical: StudyVerdict | None = None, progress: bool | None = None) -> None:
        """Write an object for each simulation as JSON.

        The keys are those of the columns of `to_csv`, and NaN is null. The attributes of the study and of its measure
        are under "study".

        Parameters
        ----------
        path : path
            File to write.
        critical : {"overturning", "complete_chattering"}, optional
            Write the `critical_scales` of this verdict instead, a row for each change.
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

        Raises
        ------
        OutputError
            If the file cannot be written.
        StudyError
            If a unit is damaged, or units are missing for critical scales.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> folder = pathlib.Path(tempfile.mkdtemp())
        >>> study = rocking.study(folder / "study", blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> _ = study.run()
        >>> study.to_json(folder / "all.json")
        >>> import json
        >>> len(json.loads((folder / "all.json").read_text())["simulations"])
        8
        """
        write_table("json", path, *self._results(critical), progress)

    def to_parquet(
        self, path: str | Path, *, critical: StudyVerdict | None = None, progress: bool | None = None
    ) -> None:
        """Write the table of `to_csv` as Parquet.

        Parameters
        ----------
        path : path
            File to write.
        critical : {"overturning", "complete_chattering"}, optional
            Write the `critical_scales` of this verdict instead, a row for each change.
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

        Raises
        ------
        OutputError
            If the file cannot be written.
        StudyError
            If a unit is damaged, or units are missing for critical scales.
        InvalidOption
            If pyarrow is not installed.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> folder = pathlib.Path(tempfile.mkdtemp())
        >>> study = rocking.study(folder / "study", blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> _ = study.run()
        >>> study.to_parquet(folder / "all.parquet")
        >>> (folder / "all.parquet").is_file()
        True
        """
        write_table("parquet", path, *self._results(critical), progress)

    def to_excel(self, path: str | Path, *, critical: StudyVerdict | None = None, progress: bool | None = None) -> None:
        """Write the table of `to_csv` as a workbook (.xlsx).

        Parameters
        ----------
        path : path
            File to write.
        critical : {"overturning", "complete_chattering"}, optional
            Write the `critical_scales` of this verdict instead, a row for each change.
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

        Raises
        ------
        OutputError
            If the file cannot be written.
        StudyError
            If a unit is damaged, or units are missing for critical scales.
        InvalidOption
            If openpyxl is not installed, or a sheet has too few rows.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> import rocking
        >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
        >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
        >>> folder = pathlib.Path(tempfile.mkdtemp())
        >>> study = rocking.study(folder / "study", blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
        >>> _ = study.run()
        >>> study.to_excel(folder / "all.xlsx")
        >>> (folder / "all.xlsx").is_file()
        True
        """
        write_table("excel", path, *self._results(critical), progress)

    def _results(self, critical: StudyVerdict | None) -> tuple[xr.Dataset, str, int]:
        if critical:
            return self.critical_scales(critical), "change", _CHANGES
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
    blocks : Blocks, Block, RestrainedBlock or sequence of one kind, optional
        As for `simulate_many`; without blocks and motions, the study must be there, and needs no script nor any other
        argument.
    motions : Motion, sequence of Motion, or mapping of str to Motion, optional
        As for `simulate_many`.
    model : {"nonlinear", "linear"}
        As for `simulate_many`.
    chattering : str or Treatment
        As for `simulate_many`.
    levels : array_like, optional
        As for `simulate_many`.
    measure : {"factor", "pga", "pgv"} or Measure
        As for `simulate_many`.
    polarity : {"+", "-", "both"}
        As for `simulate_many`.
    duration : float, optional
        As for `simulate_many`.
    outcomes : sequence of str, optional
        Names of what is kept of each simulation, of the variables that `simulate_many` returns; by default all.
        stalled, unfinished and stopped are always kept: they say which of the others are answers.
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
    >>> import tempfile
    >>> import rocking
    >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
    >>> motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
    >>> folder = tempfile.mkdtemp()
    >>> first = study(folder, blocks, motion, levels=[0.4, 1.0], unit_blocks=512)
    >>> _ = first.run()
    >>> study(folder).results().overturned.sel(scale=0.4).values.tolist()
    [[True, False, True, False]]
    """
    where = Folder(folder)
    if blocks is None or motions is None:
        if blocks is not None or motions is not None:
            raise InvalidOption("a new study needs {} and {}; one that is there needs neither", "blocks", "motions")
        _refuse_inputs(
            model=None if model == "nonlinear" else model,
            chattering=None if chattering == "certified" else chattering,
            levels=levels,
            measure=None if measure == "factor" else measure,
            polarity=None if polarity == "+" else polarity,
            duration=duration,
            outcomes=outcomes,
            unit_blocks=unit_blocks,
        )
        return Study(Store.open(where))
    product = product_of(blocks, motions, levels, measure, polarity, model, chattering, duration)
    return study_of(where, product, unit_blocks, outcomes=chosen_outcomes(outcomes))


def _refuse_inputs(**given: object) -> None:
    """Refuse what is said of a study that is opened by its folder alone: it would be ignored."""
    names = [name for name, value in given.items() if value is not None]
    if names:
        raise InvalidOption(
            f"{', '.join(['{}'] * len(names))} belong{'s' if len(names) == 1 else ''} to {{}} and {{}}: give those as "
            "well, or open the study by its folder alone",
            *names,
            "blocks",
            "motions",
        )


def study_of(
    folder: Folder,
    product: Product,
    unit_blocks: int | None = None,
    plan: ReportPlan | None = None,
    outcomes: tuple[str, ...] = OUTCOMES,
    records: Sequence[str] = (),
) -> Study:
    """Create the study of a product in a folder, or open the one that is there and check its inputs.

    Units are of `unit_blocks` blocks of one motion, scale and polarity, or else from a pilot. `plan` (what is to be
    made of the results) and `records` (the name of the record of each motion, which results then have as well) take the
    place of what was; `outcomes` are from `chosen_outcomes`.
    """
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
