"""Studies: stored simulations that can be interrupted and resumed without loss."""

from __future__ import annotations

import contextlib
import itertools
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rocking.analysis.fragility import Fragility
from rocking.block.body import Bodies, Body
from rocking.block.friction import Friction
from rocking.core import checks
from rocking.core.constants import Model
from rocking.core.progress import Progress
from rocking.core.tables import format_count, write_netcdf
from rocking.core.threads import choose_thread_count, count_cores
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import OptionError, RockingError, StudyError
from rocking.motion.scaling import IntensityName, Measure, MeasureName
from rocking.records.named import Motions
from rocking.simulation.ensemble import Polarity, SimulationProduct, create_product
from rocking.studies.batches import BatchInput, Key, choose_batch_shape, compute_batch, format_key
from rocking.studies.folder import Store, contains_study, lock_folder, read_bytes, require_empty, write_atomically
from rocking.studies.results import (
    BlockTable,
    StudyOutcome,
    compute_spectrum,
    find_critical_scales,
    fit_block_fragilities,
    fit_pooled_fragility,
    open_results,
    write_table,
)

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Status:
    """Progress of a study.

    Attributes
    ----------
    done_count, batch_count, simulation_count : int
        Number of finished batches, of all batches, and of simulations.

    See Also
    --------
    rocking.Study.status : Return the progress of a study.
    rocking.studies.RunReport : Report the outcome of one run.

    Examples
    --------
    >>> import rocking, tempfile
    >>> block, pulse = rocking.Block.from_parameters(2.0, 0.1, 0.9), rocking.pulses.one_sine(4.0, 1.0)
    >>> status = rocking.create_study(tempfile.mkdtemp(), block, pulse, levels=[0.4, 1.0]).status
    >>> status.done_count, status.batch_count, status.is_complete
    (0, 2, False)
    """

    done_count: int
    batch_count: int
    simulation_count: int

    @property
    def is_complete(self) -> bool:
        """Whether every batch is done."""
        return self.done_count == self.batch_count

    def __str__(self) -> str:
        share = int(1000 * self.done_count / self.batch_count) / 10  # rounded down, so that 100 % means all
        done = f"{self.done_count} of {format_count(self.batch_count, 'batch')} done ({share:.1f} %)"
        return f"{done}, {format_count(self.simulation_count, 'simulation')} in all"


@dataclass(frozen=True)
class RunReport:
    """Outcome of one run.

    Attributes
    ----------
    batch_count, simulation_count : int
        Number of computed batches and simulations.
    seconds : float
        Duration of the run, s.
    failures : mapping
        Sentence for each batch that could not be computed, by its name.
    ended_early : bool
        Whether SIGTERM stopped the run before all batches were done.

    See Also
    --------
    rocking.Study.run : Simulate the batches that are not done.
    rocking.studies.Status : Report the progress of a study.

    Examples
    --------
    >>> import rocking, tempfile
    >>> block, pulse = rocking.Block.from_parameters(2.0, 0.1, 0.9), rocking.pulses.one_sine(4.0, 1.0)
    >>> report = rocking.create_study(tempfile.mkdtemp(), block, pulse, levels=[0.4, 1.0]).run()
    >>> report.batch_count, report.simulation_count, report.ended_early
    (2, 2, False)
    """

    batch_count: int
    simulation_count: int
    seconds: float
    failures: dict[str, str]
    ended_early: bool

    def __str__(self) -> str:
        rate = self.simulation_count / self.seconds if self.seconds > 0.0 else 0.0
        done = f"{format_count(self.batch_count, 'batch')}, {format_count(self.simulation_count, 'simulation')}"
        text = f"{done} in {self.seconds:.1f} s ({rate:.3g} a second)"
        if self.failures:
            first = next(iter(self.failures.values()))
            text += f"; {format_count(len(self.failures), 'batch')} failed, the first: {first}"
        return text + ("; stopped, run again to continue" if self.ended_early else "")


class Study:
    """Simulations of blocks, motions, scales and polarities, stored in a folder; created by `rocking.create_study`.

    Parameters
    ----------
    folder : path
        Folder of an existing study.

    Attributes
    ----------
    folder : str
        Folder of the study.
    product : SimulationProduct
        Inputs of the simulations.

    See Also
    --------
    create_study : Create or open a study.
    simulate_many : Simulate in memory.

    Examples
    --------
    >>> import pathlib, rocking, tempfile
    >>> block, pulse = rocking.Block.from_parameters(2.0, 0.1, 0.9), rocking.pulses.one_sine(4.0, 1.0)
    >>> study = rocking.create_study(tempfile.mkdtemp(), block, pulse, levels=[0.4, 1.0], blocks_per_batch=512)
    >>> _ = study.run()
    >>> table = pathlib.Path(tempfile.mkdtemp(), "all.csv")
    >>> study.to_csv(table)
    >>> table.read_text().splitlines()[1][:40]
    'one-sine,0.4,0,4.0,1.0,1.0,0.0,2.0,0.1,0'
    """

    def __init__(self, folder: str | Path) -> None:
        self._store = Store(folder)
        self.folder = str(self._store.folder)
        self.product: SimulationProduct = self._store.product

    @property
    def status(self) -> Status:
        """Return the progress; may be called while another process runs the study."""
        return Status(len(self._store.find_done()), len(self._store.grid), int(np.prod(self._store.grid.shape)))

    def run(self, executor: Executor | Any = None, *, part: str | None = None) -> RunReport:
        """Compute every batch that is not done.

        Parameters
        ----------
        executor : concurrent.futures.Executor or dask.distributed.Client, optional
            Pool of processes or cluster client that computes instead; only this process writes.
        part : str, optional
            Fixed share of the batches, for example "3/10", the third of ten. Different shares may run at the same time,
            on machines with a common file system; a run without a part then computes the missing batches.

        Returns
        -------
        RunReport
            Computed batches. SIGTERM ends the run after the current batches, Ctrl-C at once; stored batches are kept.

        Raises
        ------
        OptionError
            If an argument is out of its range.
        StudyError
            If another process runs the study, another version created it, or the workers are gone.
        OutputError
            If a batch cannot be written.
        """
        first, step = (1, 1) if part is None else _parse_part(part)
        self._store.check_program()
        with lock_folder(self.folder, is_shared=part is not None):
            share = [*itertools.islice(self._store.grid, first - 1, None, step)]
            return _run_batches(self._store, share, executor)

    def results(self) -> xr.Dataset:
        """Return the outcomes so far as `simulate_many` does, read lazily from the folder.

        While batches are missing, every variable is of floats with NaN for missing batches. A variable ``done`` marks
        the available ones. Reading a damaged batch raises a StudyError that names it.
        """
        return open_results(self._store)

    def verify(self, recompute_count: int = 0, *, repair: bool = False, seed: int = 0) -> list[str]:
        """Read and check every batch, and recompute some batches bit for bit.

        Parameters
        ----------
        recompute_count : int
            Number of batches, drawn at random, to compute again.
        repair : bool
            Whether to compute damaged batches again and store them.
        seed : int
            Seed of the draw.

        Returns
        -------
        list of str
            A sentence for each batch that is damaged or differs; empty if there are none.

        Raises
        ------
        StudyError
            If another version created the study whose batches are to be computed again.
        """
        store, faults = self._store, dict[Key, str]()
        if checks.integer(recompute_count, "recompute_count", OptionError, 0) or repair:
            store.check_program()
        done = sorted(store.find_done())
        recomputed = {*np.random.default_rng(seed).permutation(len(done))[:recompute_count].tolist()}
        with Progress("verifying", len(done)) as bar:
            for k, key in enumerate(done):
                try:
                    store.read_outcomes(key)
                    if k in recomputed and compute_batch(store.create_input(key)) != read_bytes(store.batch_path(key)):
                        faults[key] = f"batch {format_key(key)} differs from the result of this program"
                except StudyError as error:
                    faults[key] = error.text()
                bar.advance()
        if repair and faults:
            with lock_folder(self.folder):
                for key in faults:
                    write_atomically(store.batch_path(key), compute_batch(store.create_input(key)))
        return [*faults.values()]

    def critical_scales(self, outcome: StudyOutcome = "overturning") -> xr.Dataset:
        """Find the scales between which the outcome of a block changes.

        Parameters
        ----------
        outcome : {"overturning", "complete_chattering"}
            Whether a block overturns; or whether it comes to rest after its first uplift before the motion exceeds a
            threshold again.

        Returns
        -------
        xarray.Dataset
            Variables over ``change``, ordered by motion, polarity, block and scale: low and high (neighbouring scales
            with a known outcome, in the units of the measure), overturns or completes (the outcome at the higher
            scale), known (whether all outcomes between them are known), with motion, polarity, block and its
            parameters. A block that survives a stronger motion than one that overturns it has several changes.

        Raises
        ------
        StudyError
            If batches are missing or damaged.
        OptionError
            If `outcome` is unknown, or the study has fewer than two scales in increasing order.
        """
        return find_critical_scales(self._store, outcome)

    def fragility(
        self,
        *,
        measure: IntensityName | Measure = "pga",
        limit_states: Mapping[str, float] | None = None,
        confidence: float = 0.9,
        weights: ArrayLike | None = None,
        clusters: ArrayLike | None = None,
        larger: bool = False,
    ) -> Fragility:
        """Fit fragility curves to the outcomes of all blocks, with the arguments and results of `rocking.fragility`.

        The intensity is the measure of a motion at a scale. A StudyError is raised if batches are missing or damaged.
        """
        parsed = Measure.parse(measure)
        return fit_pooled_fragility(self._store, parsed, limit_states, confidence, weights, clusters, larger=larger)

    def block_fragilities(
        self,
        *,
        measure: IntensityName | Measure = "pga",
        limit_states: Mapping[str, float] | None = None,
        confidence: float = 0.9,
        clusters: ArrayLike | None = None,
        larger: bool = False,
    ) -> BlockTable:
        """Fit a fragility curve to the outcomes of each block, with the arguments and errors of `Study.fragility`.

        The result contains, over (limit_state, block), the median and the dispersion with their confidence intervals
        (median_lower, median_upper, ...; SI units), exceedance_count and trial_count (for a symmetric block of one
        polarity), and fault: the reason why no lognormal fits, or an empty string.
        """
        parsed = Measure.parse(measure)
        return fit_block_fragilities(self._store, parsed, limit_states, confidence, clusters, larger=larger)

    def spectrum(self, fractiles: Sequence[float] = (0.16, 0.5, 0.84)) -> BlockTable:
        """Compute fractiles of the normalised peak rotation over the motions, for each scale and block.

        Parameters
        ----------
        fractiles : sequence of float
            Fractions of the motions, in (0, 1), that stay below.

        Returns
        -------
        BlockTable
            fractile_over_alpha over (fractile, scale, block), infinite if that fraction of the motions overturns the
            block, and overturned_share over (scale, block).

        Raises
        ------
        StudyError
            If batches are missing or damaged.
        OptionError
            If a fractile is out of its range.
        """
        return compute_spectrum(self._store, fractiles)

    def to_netcdf(self, path: str | Path, *, critical: StudyOutcome | None = None) -> None:
        """Write the `results`, or the critical scales as `to_csv` does, to a NetCDF file."""
        write_netcdf(path, self.critical_scales(critical) if critical else self.results())

    def to_csv(self, path: str | Path, *, critical: StudyOutcome | None = None) -> None:
        """Write a CSV row for each simulation, with units in the column names.

        Parameters
        ----------
        path : str or pathlib.Path
            File, written atomically.
        critical : {"overturning", "complete_chattering"}, optional
            Write the `critical_scales` of this outcome instead, a row for each change.

        Raises
        ------
        OutputError
            If the file cannot be written.
        StudyError
            If a batch is damaged, or batches are missing for critical scales.
        """
        self._write("csv", path, critical)

    def to_parquet(self, path: str | Path, *, critical: StudyOutcome | None = None) -> None:
        """Write the table of `to_csv` as Parquet, with the same arguments and errors; requires pyarrow."""
        self._write("parquet", path, critical)

    def _write(self, kind: str, path: str | Path, critical: StudyOutcome | None) -> None:
        dataset = self.critical_scales(critical) if critical else self.results()
        write_table(kind, path, dataset, 1 << 16 if critical else self._store.grid.batch_shape[0])

    def __repr__(self) -> str:
        names = ("motion", "scale", "polarity", "block")
        sizes = " x ".join(map(format_count, self._store.grid.shape, names))
        return f"<Study: {sizes}; {self.status}>"


def create_study(
    folder: str | Path,
    blocks: Bodies | Body | Sequence[Body],
    motions: Motions,
    *,
    model: Model = "nonlinear",
    chattering: str | ChatteringScheme = "certified",
    levels: ArrayLike | None = None,
    measure: MeasureName | Measure = "factor",
    polarity: Polarity = "+",
    duration: float | None = None,
    friction: Friction | None = None,
    blocks_per_batch: int | None = None,
) -> Study:
    """Create a study, or open an existing one with the same inputs.

    Parameters
    ----------
    folder : path
        Folder of the study.
    blocks, motions : Blocks and Motion, or sequences of blocks and motions
        As for `simulate_many`.
    model, chattering, levels, measure, polarity, duration, friction : optional
        As for `simulate_many`; the study stores no slips.
    blocks_per_batch : int, optional
        Number of blocks in a batch (one motion, scale and polarity), a multiple of 512. By default a batch contains as
        many blocks, motions, scales and polarities as run for about five seconds, estimated by a pilot run.

    Returns
    -------
    Study
        ``.run()`` computes missing batches, ``.results()`` reads the stored ones.

    Raises
    ------
    StudyError
        If the folder contains a study with other inputs, or a damaged one.
    OptionError
        If an argument is out of its range.

    See Also
    --------
    Study : Open an existing study.
    simulate_many : Simulate in memory.

    Examples
    --------
    >>> import rocking, tempfile
    >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
    >>> folder, pulse = tempfile.mkdtemp(), rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
    >>> _ = create_study(folder, blocks, pulse, levels=[0.4, 1.0], blocks_per_batch=512).run()
    >>> rocking.Study(folder).results().overturned.sel(scale=0.4).values.tolist()
    [[True, False, True, False]]
    """
    product = create_product(blocks, motions, levels, measure, polarity, model, chattering, duration, friction)
    return open_or_create(folder, product, blocks_per_batch)


def open_or_create(
    folder: str | Path, product: SimulationProduct, blocks_per_batch: int | None = None, records: Sequence[str] = ()
) -> Study:
    """Create the study of a product, or open it and check its inputs."""
    if not contains_study(folder):
        require_empty(folder)  # before the pilot and the lock file
        batch_shape = choose_batch_shape(product, blocks_per_batch)
        with lock_folder(folder):
            if not contains_study(folder):  # another process may have created it meanwhile
                Store.create(folder, product, batch_shape, records)
    study = Study(folder)
    study._store.check_inputs(product)
    width, count = study._store.grid.batch_shape[3], len(product.bodies)
    if blocks_per_batch is not None and min(choose_batch_shape(product, blocks_per_batch)[3], count) != min(
        width, count
    ):
        raise OptionError(f"the study already exists, in batches of {width} blocks: omit {{}}", "blocks_per_batch")
    return study


def _parse_part(part: str) -> tuple[int, int]:
    """Return the number of a part and the number of parts."""
    number, slash, count = str(part).partition("/")
    if not (slash and number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
        message = f"{{}} must be the number of a part and the number of parts, as 3/10; got {part}"
        raise OptionError(message, "part", value=part)
    return int(number), int(count)


def _run_batches(store: Store, share: Sequence[Key], executor: Any) -> RunReport:
    """Compute the missing batches of a share until SIGTERM."""
    start, grid, pending = time.monotonic(), store.grid, dict[Future[bytes], Key]()
    batch_count, simulation_count, failures = 0, 0, dict[str, str]()
    done_keys = store.find_done()
    missing_keys = [key for key in share if key not in done_keys]
    remaining_keys, total_count = iter(missing_keys), sum(map(grid.count_simulations, share))
    earlier_count = total_count - sum(map(grid.count_simulations, missing_keys))
    with (
        Progress("simulations", total_count, done=earlier_count) as bar,
        _open_workers(executor) as (submit, count_workers),
        _catch_sigterm() as stop_event,
    ):
        try:
            while True:
                # Each worker has a current batch and a next one.
                capacity = 0 if stop_event.is_set() else max(2 * max(1, count_workers()) - len(pending), 0)
                for key in itertools.islice(remaining_keys, capacity):
                    pending[submit(store.create_input(key))] = key
                if not pending:
                    break
                for future in wait(pending, timeout=1.0, return_when=FIRST_COMPLETED).done:
                    key = pending.pop(future)
                    try:
                        data = future.result()
                    except (BrokenExecutor, CancelledError) as error:
                        raise _create_worker_error(error) from error
                    except Exception as error:
                        prefix = "" if isinstance(error, RockingError) else f"{type(error).__name__}: "
                        failures[format_key(key)] = " ".join(f"{prefix}{error}".split()).rstrip(": ")
                        bar.note(f"{format_count(len(failures), 'batch')} failed")
                        continue
                    write_atomically(store.batch_path(key), data)
                    batch_count, simulation_count = batch_count + 1, simulation_count + grid.count_simulations(key)
                    bar.advance(grid.count_simulations(key))
        finally:
            for future in pending:
                future.cancel()
    ended_early = stop_event.is_set() and batch_count + len(failures) < len(missing_keys)
    return RunReport(batch_count, simulation_count, time.monotonic() - start, failures, ended_early)


@contextlib.contextmanager
def _catch_sigterm() -> Iterator[threading.Event]:
    """Yield an event that SIGTERM sets if this is the main thread."""
    stop_event = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop_event
        return
    previous_handler = signal.signal(signal.SIGTERM, lambda *_: stop_event.set())
    try:
        yield stop_event
    finally:
        signal.signal(signal.SIGTERM, previous_handler)


@contextlib.contextmanager
def _open_workers(executor: Any) -> Iterator[tuple[Callable[[BatchInput], Future[bytes]], Callable[[], int]]]:
    """Yield functions that submit a batch and count the workers; errors stop the threads."""
    if executor is None:
        cancelled, thread_pool = threading.Event(), ThreadPoolExecutor(choose_thread_count())
        try:
            yield lambda batch_input: thread_pool.submit(compute_batch, batch_input, cancelled), choose_thread_count
        finally:
            cancelled.set()
            thread_pool.shutdown(cancel_futures=True)
        return
    client: Any = executor if hasattr(executor, "get_executor") else getattr(executor, "_client", None)
    pool = executor.get_executor(pure=False) if client is executor else executor
    if not isinstance(pool, Executor):
        message = "{} must be a concurrent.futures.Executor or a client of dask.distributed; got "
        raise OptionError(message + checks.short_repr(executor), "executor", value=executor)

    def submit(batch_input: BatchInput) -> Future[bytes]:
        try:
            return pool.submit(compute_batch, batch_input)
        except RuntimeError as error:  # also BrokenExecutor
            raise _create_worker_error(error) from error

    def count() -> int:
        if client is None:
            return getattr(pool, "_max_workers", None) or count_cores()
        if client.status != "running":
            raise _create_worker_error("no connection to the scheduler")
        try:
            return sum(client.nthreads().values())
        except Exception as error:  # a client that loses its scheduler raises socket errors
            raise _create_worker_error(error) from error

    yield submit, count


def _create_worker_error(reason: object) -> StudyError:
    return StudyError(f"the workers were lost: {reason}; computed batches are stored, so run the study again")
