"""`rocking fragility` and `rocking calibrate`: what is fitted to outcomes, simulated or observed."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from cyclopts import Parameter

from rocking import checks
from rocking.analysis.calibration.history import HistoryCalibration, calibrate_history
from rocking.analysis.calibration.outcomes import calibrate as calibrated
from rocking.analysis.calibration.outcomes import checked_outcomes
from rocking.analysis.calibration.result import Calibration, group_labels
from rocking.analysis.calibration.space import HOUSNER
from rocking.analysis.fragility import nrml
from rocking.analysis.fragility.curve import Band
from rocking.analysis.fragility.fit import fit_fragility
from rocking.analysis.fragility.fit import fragility as run
from rocking.analysis.fragility.result import Fragility
from rocking.analysis.hazard import HazardCurve
from rocking.analysis.input_tables import History, Outcomes, read_calibration, read_observed
from rocking.analysis.levels import BY_STATION
from rocking.analysis.risk import check_measure
from rocking.cli.body_options import EnsembleOptions
from rocking.cli.options import BLOCK, MEASURE, MODEL, WHOLE, MeasureOptions, TreatmentOptions
from rocking.cli.output import OUTPUT, OutputOptions, left_out, print_result, subfolder, write_results
from rocking.cli.records import RECORDS, MotionOptions, Names, ReadRecords, ScaledPulseOptions
from rocking.constants import Model
from rocking.ensemble import Polarity
from rocking.errors import InvalidOption, RockingError, Unfitted, literal
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.plausibility import hazard_notes
from rocking.progress import note
from rocking.quantities import bounds, number, tilt
from rocking.tables import counted, text_table, write_csv

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Time of probabilities, unless it is said.
_YEARS: Final = 50.0

#: Blocks to try, unless it is said.
_CANDIDATES: Final = 8192


def fragility(
    *names: Names,
    outcomes: Path | None = None,
    limits: str = "overturning",
    polarity: Annotated[Polarity, Parameter(allow_leading_hyphen=True)] = "+",
    clusters: str | None = None,
    confidence: float = 0.9,
    bootstrap: Annotated[int, WHOLE] = 0,
    seed: Annotated[int, WHOLE] = 0,
    taxonomy: str = "rocking-block",
    hazard: Path | None = None,
    site: Annotated[int, WHOLE] = 0,
    years: float = _YEARS,
    standing: float | None = None,
    measure: Annotated[MeasureOptions, MEASURE] = MeasureOptions(),
    block: Annotated[EnsembleOptions, BLOCK] = EnsembleOptions(),
    motion: Annotated[MotionOptions, RECORDS] = MotionOptions(),
    model: Annotated[TreatmentOptions, MODEL] = TreatmentOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Fit the probability that a block overturns, or passes a rotation, against the intensity of the motions.

    The block is a rectangle (--width, --height, or half of each) or given by its parameters (--p, --alpha), or the
    ensemble of a calibration stands for it (--ensemble). With --levels every motion is scaled to each (stripes);
    without, motions are taken as they are (a cloud). Or outcomes that were observed are fitted (--outcomes), without
    records and block. --out holds fragility.png, .pdf, .csv, outcomes.csv (record, intensity, peak, outcome),
    result.json, and fragility-continuous.xml and -discrete.xml (NRML 0.5).

    Parameters
    ----------
    outcomes
        CSV table of what was observed: a column overturned (1 or 0; with a column trials, how many of them), and the
        intensity (pga_g, pgv_m_s, sa_g with --period) or the motion (a record file, or a shipped record, of which the
        --measure is taken); and where wanted group: outcomes that belong together.
    limits
        Limit states, with commas between: overturning, or NAME=ROTATION over slenderness, as half=0.5.
    polarity
        Motions as they are (+), reversed (-), or both; a symmetric block does the same in both, which count once.
    clusters
        Which records belong together, for the intervals: station joins components of one station in one earthquake, as
        files name them; or a label for each record, with commas between. By default each is on its own.
    confidence
        Probability of the intervals and bands.
    bootstrap
        Draws of the bootstrap for the bands; 0: the profile likelihood.
    seed
        Seed of its random numbers.
    taxonomy
        Identifier of the fragility function in NRML.
    hazard
        CSV file of the site's hazard curve (pga_g,annual_rate, or OpenQuake's): adds annual rates of exceeding the
        limit states, and risk.png and .pdf to --out.
    site
        Row of OpenQuake's file, from 0.
    years
        Time for which probabilities are given.
    standing
        Years for which the block has stood: adds how strongly and how often it was not shaken, and with --hazard how
        probable that is; survival.png and .pdf to --out.
    """
    if outcomes is not None:
        _refuse_beside_outcomes(
            names, block, motion, measure, model, limits=limits, polarity=polarity, clusters=clusters
        )
    bodies = {} if outcomes is not None else block.blocks(model)
    checks.positive(years, "years", InvalidOption)
    curve = _hazard(hazard, site, years, measure.period)
    states = _limits(limits)
    if output.out is not None:
        nrml.check_names([taxonomy], "taxonomy")
        nrml.check_names(states, "a limit state")
    not_passed = ""
    if standing is not None:
        checks.positive(standing, "standing", InvalidOption)
        not_passed = _limit_of_standing([*states])
    checks.whole(bootstrap, "bootstrap", InvalidOption, 0)
    band = Band("bootstrap" if bootstrap != 0 else "likelihood", confidence, samples=bootstrap or 1, seed=seed)
    with output.folder() as folder:
        read = None
        if outcomes is not None:
            observed = read_observed(outcomes, measure.wanted, channel=motion.channel, dt=motion.dt, units=motion.units)
            _check_hazard(curve, observed["measure"])
            fitted = fit_fragility(**observed, band=band)
        else:
            _check_hazard(curve, measure.wanted)
            read = motion.read_all(names)
            with _outcomes_kept(folder):
                fitted = run(
                    motions=list(read.motions.values()),
                    **measure.chosen(),
                    **model.chosen() | bodies,
                    limits=states,
                    polarity=polarity,
                    clusters=_clusters(clusters),
                    band=band,
                )
        found, text = fitted.to_dict() | ({} if read is None else read.to_dict()), [fitted.summary()]
        figures: dict[str, Callable[[], Figure]] = {"fragility": fitted.plot}
        if curve is not None:
            risk = fitted.annual_rate(curve)
            found["risk"], figures["risk"] = risk.to_dict(years), risk.plot
            text.append(risk.summary(years))
        if standing is not None:
            survived = fitted.survival(standing, curve, limit_state=not_passed)
            found["survival"], figures["survival"] = survived.to_dict(), survived.plot
            text.append(survived.summary())
        if folder is not None:
            for form in ("continuous", "discrete"):
                with left_out(name := f"fragility-{form}.xml"):
                    fitted.to_nrml(folder / name, taxonomy=taxonomy, format=form)
            fitted.to_csv(folder / "fragility.csv")
            if fitted.outcomes is not None:
                together = fitted if read is None else _with_records(fitted, read)
                together.to_csv(folder / "outcomes.csv", "outcomes")
            write_results(folder, figures=figures, result=found)
        print_result(found, "\n\n".join(text), as_json=output.as_json)


def _limit_of_standing(names: list[str]) -> str:
    """Name the limit that a block has not passed in a time: overturning, or the only one."""
    if len(names) > 1 and "overturning" not in names:
        raise InvalidOption(
            f"{{}} is about overturning, or about one limit, not {' and '.join(names)}: name one of them in {{}}",
            "standing",
            "limits",
            value=names,
        )
    return "overturning" if "overturning" in names else names[0]


@contextlib.contextmanager
def _outcomes_kept(folder: Path | None) -> Iterator[None]:
    """Write what was simulated although no curve can be fitted to it."""
    try:
        yield
    except Unfitted as refused:
        if folder is not None and refused.outcomes is not None:
            write_csv(folder / "outcomes.csv", refused.outcomes)
            note(f"what was simulated is in {folder / 'outcomes.csv'}")
        raise


def _hazard(file: Path | None, site: int, years: float, period: float | None) -> HazardCurve | None:
    """Read a hazard curve, where there is one, with notes on what looks like a mistake."""
    if file is None:
        for name, is_given in {"site": site != 0, "years": years != _YEARS}.items():
            if is_given:
                raise InvalidOption("{} is for a curve of {}: give one, or leave it out", name, "hazard")
        return None
    curve = HazardCurve.read(file, site=site, period=period)
    for sentence in hazard_notes(curve.intensity, curve.measure):
        note(f"{file}: {sentence}")
    return curve


def _check_hazard(curve: HazardCurve | None, measure: Measure) -> None:
    """Refuse a hazard curve of another measure, before the work."""
    if curve is not None:
        check_measure(curve, measure)


def _with_records(found: Fragility, read: ReadRecords) -> Fragility:
    """Name the motion of each outcome by the record that was read, too."""
    if found.outcomes is None:
        return found
    records = {row["motion"]: row["record"] for row in read.to_dict()["records"]}
    named = found.outcomes.copy()
    named.insert(0, "record", named["motion"].map(records))
    return replace(found, outcomes=named)


def _refuse_beside_outcomes(
    names: Sequence[str],
    block: EnsembleOptions,
    motion: MotionOptions,
    measure: MeasureOptions,
    model: TreatmentOptions,
    *,
    limits: str,
    polarity: Polarity,
    clusters: str | None,
) -> None:
    """Refuse options that do not go with observed outcomes."""
    motions = ("pulse", "scale", "pga", "pgv", "sa", "vertical", "keep_going")
    given = {
        "records": names,
        "levels": measure.levels,
        "ensemble": block.ensemble,
        "limits": limits if limits != "overturning" else None,
        "polarity": polarity if polarity != "+" else None,
        "clusters": clusters,
        "model": model.equation,
        "chattering": model.chattering if model.chattering != "certified" else None,
        **{name: getattr(motion, name) for name in motions},
        **dict.fromkeys(block.of_block(), True),
    }
    found = [option for option, value in given.items() if value not in (None, False, ())]
    if found:
        sentence = "{} are observed, of a block and under motions of their own: leave {} out"
        raise InvalidOption(sentence, "outcomes", found[0])


def _clusters(text: str | None) -> str | list[str] | None:
    return text if text in (None, BY_STATION) else [label.strip() for label in text.split(",")]


def _limits(text: str) -> dict[str, float]:
    limits = {}
    for part in text.split(","):
        name, given, value = part.strip().partition("=")
        if not given and name != "overturning":
            raise InvalidOption(
                f"{{}} takes overturning or NAME=ROTATION over slenderness, not {part.strip()!r}", "limits", value=text
            )
        if name in limits or (given and name in ("", "overturning")):
            why = f"has {name} twice" if name in limits else f"gives a rotation the name {name!r}"
            raise InvalidOption(f"{{}} {why}; name each limit state once, as half=0.5", "limits")
        try:
            limits[name] = number(value, "limits") if given else math.inf
        except InvalidOption:
            raise InvalidOption(f"{{}} {name} takes a number, not {value.strip()!r}", "limits", value=text) from None
    return limits


def calibrate(
    data: Path,
    *,
    model: Model = "nonlinear",
    p: str | None = None,
    alpha: str | None = None,
    restitution: str | None = None,
    two_sided: bool | None = None,
    candidates: Annotated[int, WHOLE] = _CANDIDATES,
    folds: Annotated[int, WHOLE] = 0,
    predict: Annotated[tuple[str, ...], Parameter(consume_multiple=True, negative="")] = (),
    motion: str | None = None,
    initial_rotation: str | None = None,
    seed: Annotated[int, WHOLE] = 0,
    file: Annotated[ScaledPulseOptions, RECORDS] = ScaledPulseOptions(),
    output: Annotated[OutputOptions, OUTPUT] = OutputOptions(),
) -> None:
    """Find the block behind observed outcomes (overturned or not), or behind a measured rotation history.

    DATA is a CSV table with a header. Outcomes: columns motion (a record file, or a shipped record) and overturned (1
    or 0), and where wanted scale, channel, group, and specimen: each specimen is then calibrated by itself. A history:
    columns time_s and rotation_rad (or rotation_deg). The motions of --predict, --motion and --pulse may be scaled.
    --out holds calibration.png, .pdf, result.json and, of outcomes, ensemble.csv; of several specimens a folder each.

    Parameters
    ----------
    data
        CSV table of outcomes or of a history.
    model
        Equation of motion; the linear one is faster, and serves slender specimens.
    p
        Lowest and highest thinkable frequency parameter, rad/s, with a comma between; or a known value.
    alpha
        Likewise the slenderness, as 5deg,20deg or 0.1,0.3 (rad).
    restitution
        Likewise the factor on the angular speed at an impact; of outcomes also housner, to follow from the slenderness
        (of two sides as those of one rectangle).
    two_sided
        Whether the two sides of the block may differ; by default yes for outcomes, no for a history.
    candidates
        Outcomes: blocks to try, about; more where its runs disagree.
    folds
        Outcomes: parts for cross-validation; 0: none. Tests of one group stay together.
    predict
        Outcomes: records to predict, files or names of shipped records; pulses to predict go with --pulse.
    motion
        History: record of the base's motion, or give one --pulse; without either, the block was released and rocked
        freely.
    initial_rotation
        History: rotation at time 0, 2deg or 0.03 (rad); by default fitted in a release test, 0 under a motion.
    seed
        The same seed gives the same result.
    """
    ranges = {
        "p": None if p is None else bounds(p, "p", number),
        "alpha": None if alpha is None else bounds(alpha, "alpha", tilt),
        "restitution": restitution if restitution in (None, HOUSNER) else bounds(restitution, "restitution", number),
    }
    start = None if initial_rotation is None else tilt(initial_rotation, "initial_rotation")
    given: dict[str, Any] = {**ranges, "model": model, "two_sided": two_sided}
    choices = {name: value for name, value in given.items() if value is not None}
    with output.folder() as folder:
        table = read_calibration(data, channel=file.channel, dt=file.dt, units=file.units)
        if not isinstance(table, History):
            _refuse("a history", motion=motion, initial_rotation=initial_rotation)
            if not (predict or file.pulse):
                _refuse_without("predict", file)
            others = {name: file.read(name) for name in predict} | file.pulses()
            how = _How(seed, folds, others, {"candidates": candidates, **choices})
            results = _of_specimens(table, how, folder) if isinstance(table, dict) else _of_outcomes(table, how)
        else:
            _refuse("outcomes", predict=predict or None, folds=folds or None)
            _refuse("outcomes", candidates=candidates if candidates != _CANDIDATES else None)
            shaking = _shaking(motion, file)
            if shaking is None:
                _refuse_without("motion", file)
            history = calibrate_history(
                table.times, table.rotation, shaking, **choices, initial_rotation=start, seed=seed
            )
            results = _history_results(history)
        if folder is not None:
            results.write(folder)
        print_result(results.numbers, results.text, as_json=output.as_json)


@dataclass(frozen=True)
class _How:
    """How to calibrate, and what to predict."""

    seed: int
    folds: int
    others: Mapping[str, Motion]
    choices: Mapping[str, Any]


@dataclass(frozen=True)
class _Results:
    """A calibration, or of several specimens none that could be drawn; numbers and words."""

    found: Calibration | HistoryCalibration | None
    numbers: dict[str, Any]
    text: str

    def write(self, folder: Path) -> None:
        """Write numbers, and figure and ensemble of a calibration."""
        if isinstance(self.found, Calibration):
            self.found.to_csv(folder / "ensemble.csv")
        write_results(folder, figures={"calibration": self.found.plot} if self.found else {}, result=self.numbers)


def _refuse(belong_to: str, **given: object) -> None:
    for name, value in given.items():
        if value is not None:
            raise InvalidOption(f"{{}} is for {belong_to}; the columns of this table are not", name)


def _refuse_without(option: str, file: ScaledPulseOptions) -> None:
    """Refuse what is said of motions where none is given that it could be said of."""
    for name in ("scale", "pga", "pgv", "sa", "vertical"):
        if getattr(file, name) is not None:
            raise InvalidOption("{} is for the motions of {} or {}: give one, or leave it out", name, option, "pulse")


def _shaking(record: str | None, file: ScaledPulseOptions) -> Motion | None:
    """Motion of the base, if it moved."""
    motions = file.pulses() if record is None else {record: file.read(record)} | file.pulses()
    if len(motions) > 1:
        raise InvalidOption("a history has one motion of the base: give {}, or one {}", "motion", "pulse")
    return next(iter(motions.values()), None)


def _of_specimens(tables: Mapping[str, Outcomes], how: _How, folder: Path | None) -> _Results:
    """Calibrate each specimen by itself, and write each as soon as it is done."""
    for name, table in tables.items():
        with _naming(name):
            _check(table, how)
    results = {}
    for name, table in tables.items():
        with _naming(name):
            results[name] = _of_outcomes(table, how)
        if folder is not None:
            results[name].write(subfolder(folder, name))
    numbers = {"specimens": {name: one.numbers for name, one in results.items()}}
    return _Results(None, numbers, "\n\n".join(f"specimen {name}\n{one.text}" for name, one in results.items()))


def _check(table: Outcomes, how: _How) -> None:
    """Refuse outcomes that cannot be calibrated, and more folds than groups, before the work."""
    checked_outcomes(table.overturned, len(table.overturned))
    if how.folds:
        group_labels(table.groups, len(table.overturned), how.folds)


@contextlib.contextmanager
def _naming(specimen: str) -> Iterator[None]:
    """Add the specimen's name to an error."""
    try:
        yield
    except RockingError as error:
        error.message = replace(error.message, template=f"specimen {literal(specimen)}: {error.message.template}")
        raise


def _of_outcomes(table: Outcomes, how: _How) -> _Results:
    _check(table, how)
    found = calibrated(table.motions, table.overturned, seed=how.seed, **how.choices)
    predicted = dict(zip(how.others, found.predict([*how.others.values()]), strict=True))
    numbers = {**found.to_dict(), "predicted": predicted}
    parts = [found.summary()]
    if how.folds:
        scores = found.cross_validate(groups=table.groups, folds=how.folds).scores
        numbers["cross_validated"] = asdict(scores)
        parts.append(f"left-out motions: {scores} ({counted(how.folds, 'fold')})")
    if predicted:
        rows = [(name, float(chance)) for name, chance in predicted.items()]
        parts.append("\n" + text_table(["motion", "probability"], rows))
    return _Results(found, numbers, "\n".join(parts))


def _history_results(found: HistoryCalibration) -> _Results:
    return _Results(found, found.to_dict(), found.summary())
