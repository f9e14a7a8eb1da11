"""Studies too long for one sitting: created once, run anywhere, killed at any moment without loss."""

from __future__ import annotations

import contextlib
import json
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.analysis.fragility.curve import Fragility
from rocking.analysis.fragility.fit import OVERTURNING
from rocking.analysis.intensity import Measure, MeasureName
from rocking.block import Block
from rocking.body import Bodies, Body
from rocking.compiling import SIMULATIONS, announce
from rocking.errors import DamagedStudy, InvalidOption, StudyError
from rocking.model import Model
from rocking.motion.accepted import several_motions
from rocking.motion.motion import Motion
from rocking.problem import bodies_of
from rocking.product import Polarity, Product, Scales, names_of
from rocking.studies import store as stores
from rocking.studies.export import export
from rocking.studies.fragility import BlockFragilities, block_fragilities, pooled_fragility
from rocking.studies.outcomes import OUTCOMES, chosen_outcomes
from rocking.studies.place import Place, place_of, this_process
from rocking.studies.refine import (
    Refinement,
    Round,
    Verdict,
    critical_scales,
    keep_plan,
    kept_plan,
    next_round,
    refinement,
    rounds,
    tolerances_of,
)
from rocking.studies.report import Made, ReportPlan, is_kept, keep, kept, report
from rocking.studies.run import RunReport, Stop, run
from rocking.studies.spectrum import FRACTILES, StudySpectrum, study_spectrum
from rocking.studies.store import Store
from rocking.studies.units import Axes, Key, Work, compute
from rocking.tables import counted
from rocking.treatment import Treatment, treatment

if TYPE_CHECKING:
    import xarray as xr

#: Units are multiples of so many blocks, which the engine takes through a motion together.
_GROUP: Final = 512

#: How long a unit should take, s; how many units there should be at least, and simulations in one at most.
_UNIT: Final = 5.0
_FEWEST: Final = 32
_LARGEST: Final = 1 << 18

#: What happened in every run; no result depends on it.
_RUNS: Final = "runs.jsonl"

#: Rows of a table that are held in memory at a time.
_ROWS: Final = 1 << 16


@dataclass(frozen=True)
class Running:
    """A run that goes on while somebody asks.

    Attributes
    ----------
    holder : str
        Process and host.
    rate : float
        Simulations a second since it started.
    seconds_left : float
        Time that it will take at this rate, or that the round of a refinement will; infinite before its first unit.
    """

    holder: str
    rate: float
    seconds_left: float

    def __str__(self) -> str:
        """Write it in one line."""
        left = (
            f"{self.seconds_left:.0f} s left" if math.isfinite(self.seconds_left) else "its first unit is not done yet"
        )
        return f"being run by {self.holder}: {self.rate:.3g} simulations a second, {left}"


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
    running : Running or None
        The run that goes on now, where there is one.
    runs : tuple
        What happened in every run, as `runs.jsonl` has it.
    refinement : Refinement or None
        How far the refinement of its scales has come, where it has one.
    """

    done: int
    units: int
    simulations: int
    failed: dict[str, str]
    running: Running | None
    runs: tuple[dict[str, Any], ...]
    refinement: Refinement | None = None

    @property
    def complete(self) -> bool:
        """Whether every unit is done, and all that is to be refined is."""
        return self.done == self.units and (self.refinement is None or self.refinement.complete)

    def __str__(self) -> str:
        """Write it in one line."""
        share = 100.0 * self.done / self.units
        done = f"{self.done} of {counted(self.units, 'unit')} done ({share:.1f} %)"
        text = f"{done}, {counted(self.simulations, 'simulation')} in all"
        text += f"; {self.refinement}" if self.refinement else ""
        text += f"; {len(self.failed)} failed in the last run" if self.failed else ""
        return text + (f"; {self.running}" if self.running else "")


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
        """Compute every unit that is not done, and the rounds of the refinement after them.

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
            self._log({"event": "start", "note": note, "done": self._simulations()})
            try:
                report = self._compute(threads=threads, executor=executor, progress=progress)
            except BaseException as error:
                self._log({"event": "end", "error": str(error) or type(error).__name__})
                raise
            about = {"units": report.units, "seconds": report.seconds, "stopped": report.stopped}
            self._log({"event": "end", **about, "done": self._simulations()})
        return report

    def _compute(self, **options: Any) -> RunReport:
        """Run the grid, and one round of the refinement after the other, until nothing is left or somebody stops it."""
        stop, tolerances = Stop(), kept_plan(self.store)
        with stop.listening():
            report = run(self.store, stop=stop, failing=self._failing, **options)
            while tolerances is not None and not (report.failed or report.stopped):
                now = next_round(self.store, tolerances)
                if now.is_last:
                    break
                report += run(now, stop=stop, failing=self._failing, **options)
        return report

    @property
    def status(self) -> Status:
        """How far it has come; may be asked while another process runs it."""
        runs = tuple(self._runs())
        starts = [k for k, entry in enumerate(runs) if entry.get("event") == "start"]
        last = runs[starts[-1] :] if starts else ()
        failed = {entry["unit"]: entry["why"] for entry in last if entry.get("event") == "failed"}
        done = self.store.done()
        grid = self.store.grid
        refined = refinement(self.store)
        left = grid.total - sum(map(grid.simulations, done)) or (refined.simulations - refined.done if refined else 0)
        return Status(len(done), len(grid), grid.total, failed, self._running(last, left), runs, refined)

    def _running(self, last: tuple[dict[str, Any], ...], left: int) -> Running | None:
        """Whoever runs it, and how fast since the start of the last run; so many simulations are left."""
        holder = self.place.holder()
        if not holder or not last:
            return None
        seconds = time.time() - datetime.fromisoformat(last[0]["time"]).timestamp()
        rate = max(self._simulations() - last[0]["done"], 0) / max(seconds, 1.0)
        return Running(holder, rate, left / rate if rate else math.inf)

    def _simulations(self) -> int:
        """Count those that are done, of the grid and of all rounds."""
        return sum(part.grid.simulations(key) for part in self._parts() for key in part.done())

    def _parts(self) -> list[Store | Round]:
        """Return the grid, and the rounds that have begun."""
        tolerances = kept_plan(self.store)
        return [self.store, *([] if tolerances is None else rounds(self.store, tolerances))]

    def _failing(self, unit: str, why: str) -> None:
        self._log({"event": "failed", "unit": unit, "why": why})

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
        """
        from rocking.studies.lazy import lazy

        done = self.store.done()
        complete = len(done) == len(self.store.grid)
        outcomes: dict[str, Any] = {name: lazy(self.store, name, complete) for name in self.store.grid.outcomes}
        if not complete:
            outcomes["done"] = self._done_mask(done)
        return self._with_records(self.product.dataset(outcomes))

    def _with_records(self, found: xr.Dataset) -> xr.Dataset:
        """Name each motion by its record, too, where the study knows that."""
        records = dict(zip(names_of(self.product.motions), self.store.records(), strict=False))
        if not records:
            return found
        return found.assign_coords(record=(found.motion.dims, [records[name] for name in found.motion.values.tolist()]))

    def verify(self, recompute: int = 0, *, repair: bool = False, seed: int = 0) -> list[str]:
        """Read every unit and all that describes the study, and check it; compute some units again, to the last bit.

        Parameters
        ----------
        recompute : int
            How many units, drawn at random, to compute again.
        repair : bool
            Whether to compute damaged units again and store them, and to write what else is damaged anew.
        seed : int
            Seed of the draw.

        Returns
        -------
        list of str
            A sentence for each unit or file that is damaged or differs; empty if all is well.

        Raises
        ------
        StudyError
            If units are to be computed again and the study was made by another version, or what says what is computed
            is damaged.

        Notes
        -----
        The log of the runs, ``runs.jsonl``, is not needed for any result. That it is cut is seen within a line, where
        it has no run of units that are done, and after the end of a run; a log that ends within a run looks as after a
        kill. What is lost of it stays lost: a repair keeps the lines that can be read, and says so in it.
        """
        if recompute or repair:
            self.store.check_program()
            announce(SIMULATIONS)
        parts = self._parts()
        described = {name: data for part in parts for name, data in part.metadata.items()}
        wrong = [name for name, data in described.items() if self.place.get(name) != data]
        told = [f"{name} is damaged or missing: other programs that read Zarr need it" for name in wrong]
        told += [
            *self._faults(kept if is_kept(self.store) else None),
            *self._faults(Store.records),
            *(log := self._log_faults()),
        ]
        done = [(part, key) for part in parts for key in sorted(part.done())]
        faults = {unit: fault for unit in done if (fault := _fault(*unit))}
        sound = [unit for unit in done if unit not in faults]
        rng = np.random.default_rng(seed)
        for part, key in (sound[k] for k in rng.permutation(len(sound))[:recompute]):
            if compute(part.work(key)) != part.raw(key):
                faults[part, key] = f"unit {part.label(key)} is not what this program computes"
        if repair:
            with self.place.locked():
                for name in wrong:
                    self.place.put(name, described[name])
                for part, key in faults:
                    part.put(key, compute(part.work(key)))
                if log:
                    self.place.put(_RUNS, b"".join(json.dumps(entry).encode() + b"\n" for entry in self._runs()))
                    self._log({"event": "repaired", "why": log[0]})
        return [*told, *faults.values()]

    def _faults(self, read: Callable[[Store], object] | None) -> list[str]:
        """Say whether what is kept beside the inputs cannot be read; nothing if it can, or nothing is kept."""
        try:
            if read is not None:
                read(self.store)
        except StudyError as error:
            return [str(error)]
        return []

    def _log_faults(self) -> list[str]:
        """Say what is wrong with the log; nothing if it may be whole."""
        data, entries = self.place.get(_RUNS) or b"", [*self._runs()]
        lines, done = len(data.splitlines()), self._simulations()
        is_told = any(entry.get("event") in ("start", "repaired") for entry in entries)
        if len(entries) < lines or (data and not data.endswith(b"\n")):
            return [f"{_RUNS} is damaged: {counted(lines - len(entries) or 1, 'line')} of it cannot be read whole"]
        if done and not is_told:
            return [f"{_RUNS} is damaged or missing: it has no run of the units that are done"]
        last = entries[-1] if entries else {}
        if last.get("event") == "end" and last.get("done", done) < done:
            return [f"{_RUNS} is damaged: it ends before the last run"]
        return []

    def critical_scales(self, verdict: Verdict = "overturning") -> xr.Dataset:
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
            known (whether all verdicts on the way are, else the bracket stays wide: a simulation was given up or
            stopped, or a rest is not proven); motion, polarity, block and its parameters as coordinates. A block that
            stands a stronger motion than one that overturns it has several. Brackets are neighbouring scales of the
            study, or narrower where it was made with `refine`.

        Raises
        ------
        StudyError
            If units are missing or damaged, or the refinement is not done.
        InvalidOption
            If there is no such verdict, the study does not keep its outcomes, or has no two scales in increasing order.
        """
        return self._with_records(critical_scales(self.store, verdict))

    def fragility(
        self,
        *,
        measure: MeasureName = "pga",
        period: float | None = None,
        damping: float = 0.05,
        limits: Mapping[str, float] = OVERTURNING,
        confidence: float = 0.9,
        weights: ArrayLike | None = None,
    ) -> Fragility:
        """Fit the probability that a limit is exceeded to the outcomes of all blocks, as `rocking.fragility` does.

        Parameters
        ----------
        measure, period, damping, limits, confidence, weights
            As for `rocking.fragility`. What a motion measures at a scale is its intensity.

        Raises
        ------
        StudyError
            If units are missing or damaged.
        InvalidOption
            If an argument is out of its range, the study does not keep what a limit needs, or no lognormal fits.
        """
        return pooled_fragility(self.store, Measure(measure, period, damping), limits, confidence, weights)

    def block_fragilities(
        self,
        *,
        measure: MeasureName = "pga",
        period: float | None = None,
        damping: float = 0.05,
        limits: Mapping[str, float] = OVERTURNING,
        confidence: float = 0.9,
        progress: bool | None = None,
    ) -> BlockFragilities:
        """Fit a fragility curve to the outcomes of each block.

        Parameters
        ----------
        measure, period, damping, limits, confidence
            As for `rocking.fragility`. A curve takes some hundredths of a second where motions were scaled to the
            measure (stripes), and seconds where thousands of outcomes have an intensity each (a cloud).
        progress : bool, optional
            Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

        Raises
        ------
        StudyError
            If units are missing or damaged.
        InvalidOption
            If an argument is out of its range, or the study does not keep what a limit needs. A block that no lognormal
            fits has a sentence in place of a curve.
        """
        return block_fragilities(self.store, Measure(measure, period, damping), limits, confidence, progress)

    def spectrum(self, fractiles: Sequence[float] = FRACTILES) -> StudySpectrum:
        """Fractiles over the motions of the peak rotation over slenderness, for each scale and block.

        Parameters
        ----------
        fractiles : sequence of float
            Shares of the motions, in (0, 1), that stay below.

        Raises
        ------
        StudyError
            If units are missing or damaged.
        InvalidOption
            If a fractile is out of its range, or the study does not keep overturned and peak_rotation.
        """
        return study_spectrum(self.store, fractiles)

    def report(self, progress: bool | None = None) -> dict[str, Made]:
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
        """
        return report(self.store, kept(self.store), progress)

    def export(self, path: str | Path, *, critical: Verdict | None = None) -> None:
        """Write the results to one file, by its suffix.

        Parameters
        ----------
        path : path
            NetCDF (.nc), as `results` has them; or a table with a row for each simulation, in columns named with their
            units: CSV (.csv), JSON (.json), Parquet (.parquet, with pyarrow installed), a workbook (.xlsx, with
            openpyxl installed).
        critical : {"overturning", "complete_chattering"}, optional
            Write the `critical_scales` of this verdict instead, a row for each change.

        Raises
        ------
        InvalidOption
            If the suffix is another, what writes it is not installed, or a sheet has too few rows.
        OutputError
            If the file cannot be written.
        """
        if critical:
            export(self.critical_scales(critical), Path(path), "change", _ROWS)
        else:
            export(self.results(), Path(path), "motion", self.store.grid.unit[0])

    def __repr__(self) -> str:
        m, s, k, n = self.store.grid.shape
        sizes = counted(m, "motion"), counted(s, "scale"), counted(k, "polarity"), counted(n, "block")
        return f"<Study: {' x '.join(sizes)}; {self.status}>"

    def _done_mask(self, done: set[Key]) -> np.ndarray[Any, np.dtype[np.bool_]]:
        mask = np.zeros(self.store.grid.shape, dtype=bool)
        for key in done:
            mask[self.store.grid.ranges(key)] = True
        return mask

    def _log(self, entry: dict[str, Any]) -> None:
        who = {"time": datetime.now().astimezone().isoformat(timespec="seconds"), "by": this_process()}
        self.place.append(_RUNS, json.dumps(who | entry))

    def _runs(self) -> Iterator[dict[str, Any]]:
        """Entries of the log; a line that was cut off by a crash is passed over."""
        for line in (self.place.get(_RUNS) or b"").splitlines():
            with contextlib.suppress(ValueError):
                entry = json.loads(line)
                if isinstance(entry, dict):
                    yield entry


def _fault(part: Store | Round, key: Key) -> str:
    """Say what is wrong with a unit; nothing if it is sound."""
    try:
        part.outcomes(key)
    except DamagedStudy as error:
        return error.text()
    return ""


def study(
    folder: str | Path,
    blocks: Bodies | Body | Sequence[Block] | None = None,
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
    refine: float | Mapping[str, float] | None = None,
    outcomes: Sequence[str] | None = None,
    unit_blocks: int | None = None,
) -> Study:
    """Create a study, or open one that is there and check that its inputs are these.

    Parameters
    ----------
    folder : path
        Where the study is kept: a folder, or the URL of an object store as ``"s3://bucket/prefix"``, which
        needs obstore.
    blocks, motions
        As for `simulate_many`; without both, the study must be there, and needs no script nor any other argument
        (but `refine`).
    model, chattering, factor, pga, pgv, sa, period, damping, polarity, duration
        As for `simulate_many`.
    refine : float or mapping, optional
        Once the scales (two or more, increasing) are computed, halve the gap between neighbours of which one overturns
        a block and the other does not, until it is narrower than this, relative to the scale: `Study.critical_scales`.
        ``{"complete_chattering": 1e-6}`` does so where one completes the first chattering and the other does not;
        ``"overturning"`` may be named beside it. May be given later for a study that is there.
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
        If an argument is out of its range, or `outcomes` leaves out what `refine` needs.

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
    place = place_of(folder)
    if blocks is None or motions is None:
        if blocks is not None or motions is not None:
            raise InvalidOption("a new study needs blocks and motions; one that is there needs neither")
        scaling = {"factor": factor, "pga": pga, "pgv": pgv, "sa": sa, "period": period}
        _refuse_inputs({**scaling, "duration": duration, "outcomes": outcomes, "unit_blocks": unit_blocks})
        found = Study(place, Store.open(place))
        if refine is not None:
            keep_plan(found.store, tolerances_of(found.product, refine, found.store.grid.outcomes))
        return found
    product = Product(
        bodies_of(blocks),
        tuple(several_motions(motions)),
        Scales.of(factor=factor, pga=pga, pgv=pgv, sa=sa, period=period, damping=damping),
        polarity,
        model,
        treatment(chattering),
        duration,
    )
    return study_of(place, product, unit_blocks, refine=refine, outcomes=chosen_outcomes(outcomes))


def _refuse_inputs(given: Mapping[str, object]) -> None:
    """Refuse what is said of a study that is opened by its folder alone: it would be ignored."""
    told = [name for name, value in given.items() if value is not None]
    if told:
        raise InvalidOption(
            f"{', '.join(told)} belong{'s' if len(told) == 1 else ''} to blocks and motions: give those as well, or "
            "open the study by its folder alone"
        )


def study_of(
    place: Place,
    product: Product,
    unit_blocks: int | None = None,
    plan: ReportPlan | None = None,
    refine: float | Mapping[str, float] | None = None,
    outcomes: tuple[str, ...] = OUTCOMES,
    records: Sequence[str] = (),
) -> Study:
    """Create the study of a product in a place, or open the one that is there and check its inputs.

    Parameters
    ----------
    place : Place
        Where it is kept.
    product : Product
        What is simulated.
    unit_blocks : int, optional
        Blocks of a unit of one motion, scale and polarity; by default units are made from a pilot.
    plan : ReportPlan, optional
        What is to be made of the results; takes the place of what was.
    refine : float or mapping, optional
        Tolerance of the scales, or one for each verdict; may be given later.
    outcomes : tuple of str
        What is kept of each simulation, from `chosen_outcomes`.
    records : sequence of str
        Name of the record of each motion, which results then have as well; takes the place of what was.

    Raises
    ------
    StudyError
        If there is one of other inputs or outcomes, or it is damaged.
    InvalidOption
        If a tolerance is out of its range, or `outcomes` leaves out what it needs.
    """
    tolerances = None if refine is None else tolerances_of(product, refine, outcomes)
    if stores.exists(place):
        found = Store.open(place)
        found.check_inputs(product, outcomes)
    else:
        unit = _pilot(product) if unit_blocks is None else (1, 1, 1, _checked_width(unit_blocks))
        found = Store.create(place, product, unit, outcomes)
    if any(records):
        found.name_records(records)
    if plan is not None:
        keep(found, plan)
    if tolerances is not None:
        keep_plan(found, tolerances)
    return Study(place, found)


def _checked_width(unit_blocks: int) -> int:
    width = checks.whole(unit_blocks, "unit_blocks", InvalidOption, least=_GROUP)
    if width % _GROUP:
        raise InvalidOption(f"unit_blocks must be a multiple of {_GROUP}, not {width}")
    return width


def _pilot(product: Product) -> Axes:
    """Units that take about five seconds, or less where there would be too few of them, or too many simulations in one.

    How long one simulation takes is measured with a group of blocks spread over all, under the longest motion.
    """
    motions, scales, polarities, count = product.shape
    some = product.bodies.select(np.linspace(0, count - 1, min(count, _GROUP)).astype(np.int64))
    motion = max(product.motions, key=lambda one: len(one.coefficients))
    factors = np.array([[[product.scales.factors(motion).max()]]])
    announce(SIMULATIONS)
    setup = Product(some, (motion,), Scales(), "+", product.model, product.treatment, product.duration).setup()
    work = Work(setup, (motion,), factors, (1, 1, 1, len(some)), OUTCOMES)
    compute(work)  # compiles
    start = time.perf_counter()
    compute(work)
    each = (time.perf_counter() - start) / len(some)
    most = min(_UNIT / each, math.prod(product.shape) / _FEWEST, _LARGEST)
    width = min(_GROUP * max(1, int(most) // _GROUP), count)
    left = most / width
    held = []
    for size in (scales, polarities, motions):
        held.append(max(1, min(size, int(left))))
        left /= held[-1]
    return held[2], held[0], held[1], width
