"""Assessment of a case's block: fragility over a list of records, friction, rules of thumb and margin."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from rocking.analysis.fragility import fit_fragility
from rocking.analysis.levels import simulate_levels
from rocking.block import Blocks
from rocking.core.arrays import Flags, Floats
from rocking.core.bisection import bisect
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import FitError, OptionError
from rocking.explorer.catalogue import find_title, number_stations, read_entries
from rocking.explorer.inputs import Case, require_rest, require_sticking
from rocking.explorer.motions import WrittenMotion, read_motion
from rocking.explorer.parameters import ASSESSMENT, Texts
from rocking.explorer.payload import Payload, phrase
from rocking.explorer.uploads import UploadStore
from rocking.inputs.quantities import read_number
from rocking.motion.motion import Motion, compute_uplift_factors
from rocking.motion.scaling import FACTOR, Measure
from rocking.rules import apply_rules, overturning_velocity
from rocking.simulation.simulate import simulate

#: Minimum and maximum number of levels of a fragility.
_MIN_LEVELS, _MAX_LEVELS = 2, 60

#: Ratio of successive levels of the margin from the uplift level on, and the number of levels simulated at once; the
#: first level that overturns is then refined.
_LEVEL_RATIO: Final = 1.05
_BATCH_SIZE: Final = 16

#: Displayed rules of thumb and their sources.
RULES: Final[Mapping[str, str]] = {
    "uplift": "Housner (1963), Bull. Seism. Soc. Am. 53(2), 403–417",
    "west": "Milne and Omori (1893), Seism. J. Japan 1, 59–86",
    "ishiyama": "Ishiyama (1982), Earthq. Eng. Struct. Dyn. 10(5), 635–650",
}

_SCRIPT: Final = """\
import numpy as np

import rocking

block = rocking.{block}
{before}motions = [
{motions}
]
found = rocking.fragility(block, motions, measure={measure}, levels={levels}, polarity="both"{options})
print(found.summary())
"""


@dataclass(frozen=True, eq=False)
class Assessment:
    """Case with the records and levels of its fragility."""

    case: Case
    entries: list[dict[str, str]]  # texts of each record
    clusters: list[int]  # number of each record's station
    uploads: UploadStore
    measure: Measure
    levels: Floats  # of the measure

    @property
    def stations(self) -> int | None:
        """Number of stations if several entries share one, else None."""
        count = len(set(self.clusters))
        return count if count < len(self.entries) else None

    def record(self, k: int) -> WrittenMotion:
        """Read one record; the list is too long for memory."""
        return read_motion(self.entries[k], self.uploads)

    def motion(self, k: int) -> Motion:
        """Return the motion of one record."""
        return _read_nonzero_motion(self.entries[k], self.uploads)


def read_assessment(case: Case, texts: Texts, uploads: UploadStore) -> Assessment:
    """Read an assessment: ``records`` as in `catalogue.read_entries`, ``measure``, its levels, and ``friction``."""
    nonempty = {name: texts[name].strip() for name in ASSESSMENT if texts.get(name, "").strip()}
    entries = read_entries(nonempty.get("records", ""))
    if not entries:
        raise OptionError("an assessment needs {}: tick one or more in the list", "records")
    if not all("motion" in entry for entry in entries):
        raise OptionError("an entry of the list of {} names no motion: take it out", "records")
    require_sticking(case)
    require_rest(side.restitution for side in case.block.sides)
    measure = _read_measure(nonempty)
    count = read_number(nonempty.get("levels", "16"), "levels")
    if not (_MIN_LEVELS <= count <= _MAX_LEVELS and count == int(count)):
        raise OptionError(
            f"{{}} are from {_MIN_LEVELS} to {_MAX_LEVELS} in number, not {count:g}", "levels", value=nonempty["levels"]
        )
    chosen_ends = {
        end: float(ASSESSMENT[end].read(nonempty[end])) for end in ("level_from", "level_to") if end in nonempty
    }
    default_range = (math.nan, math.nan)
    if len(chosen_ends) < 2:
        default_range = _suggest_levels(case, measure, (_read_nonzero_motion(entry, uploads) for entry in entries))
    low, high = chosen_ends.get("level_from", default_range[0]), chosen_ends.get("level_to", default_range[1])
    if not 0.0 < low < high < math.inf:
        raise OptionError("{} must be positive, and below the last of the levels", "level_from")
    stations = number_stations(entries, uploads)
    return Assessment(case, entries, stations, uploads, measure, np.linspace(low, high, int(count)))


def _read_measure(texts: Texts) -> Measure:
    if texts.get("measure", "pga") == "pga":
        return Measure("pga")
    if texts["measure"] != "sa":
        raise OptionError(f"{{}} is pga or sa, not {texts['measure'][:20]!r}", "measure", value=texts["measure"])
    return Measure("sa", ASSESSMENT["measure_period"].read(texts.get("measure_period", "1")))


def describe_assessment(assessment: Assessment) -> dict[str, Any]:
    """Return a description of the assessment that needs no simulation."""
    case, measure = assessment.case, assessment.measure
    block = case.block
    notes = []
    if not block.is_symmetric:
        notes.append(phrase("assessment.polarities"))
    else:
        notes.append(phrase("assessment.symmetric"))
    if assessment.stations is not None:
        notes.append(phrase("assessment.stations", count=assessment.stations))
    if any(entry.get("vertical") for entry in assessment.entries):
        notes.append(phrase("assessment.vertical"))
    if case.motion is not None:
        notes.append(phrase("assessment.first", step=100.0 * (_LEVEL_RATIO - 1.0)))
    if case.initial_rotation or case.initial_velocity or case.duration is not None:
        notes.append(phrase("assessment.begins"))
    return {
        "measure": measure.name,
        "label": measure.quantity,
        "period": measure.period,
        "levels": assessment.levels.tolist(),
        "records": [find_title(entry, assessment.uploads) for entry in assessment.entries],
        "thresholds": list(block.uplift_thresholds(case.model)),
        "friction_to_rock": max(block.uplift_thresholds(case.model)) / block.gravity,
        "overturning_velocity": _find_overturning_velocity(case),
        "rules": [{"name": name, "source": source} for name, source in RULES.items()],
        "case": None if case.motion is None else _rate_motion(case, case.motion),
        "notes": notes,
        "python": assessment_as_python(assessment),
    }


def simulate_records(assessment: Assessment) -> Generator[Payload]:
    """Simulate the records one by one, fit the outcomes so far, and finally compute the margin of the case."""
    case, count = assessment.case, len(assessment.entries)
    outcomes: list[Floats] = []
    for k in range(count):
        motion = assessment.motion(k)
        outcomes.append(_simulate_outcomes(assessment, motion))
        row = _describe_record(assessment, motion) | {
            "number": k,
            "overturned_levels": outcomes[-1].mean(axis=1).tolist(),
        }
        yield _fit_outcomes({"share": (k + 1) / (count + 1), "row": row}, assessment, outcomes)
    yield _fit_outcomes({"share": 1.0, "margin": _find_overturning_factor(case)}, assessment, outcomes)


def _simulate_outcomes(assessment: Assessment, motion: Motion) -> Floats:
    """Return 1 (overturns), 0 or NaN (unknown) at each level and polarity."""
    case = assessment.case
    blocks = Blocks.from_bodies(case.block)
    table = simulate_levels(
        blocks, [motion], assessment.measure, assessment.levels, model=case.model, chattering=case.chattering,
        polarity="+" if blocks.is_symmetric else "both",
    )  # fmt: skip
    if "polarity" not in table.dims:
        table = table.expand_dims("polarity")
    outcomes = table.overturned.where(~table.unfinished).transpose("level", "polarity", "motion", "block")
    return np.asarray(outcomes.values[:, :, 0, 0], dtype=float)


def _fit_outcomes(header: dict[str, Any], assessment: Assessment, outcomes_by_record: list[Floats]) -> Payload:
    """Return the payload of a part: the curve of `rocking.fragility` through all outcomes so far."""
    outcomes = np.stack(outcomes_by_record, axis=1)  # level, motion, polarity, as in `rocking.fragility`
    levels = np.broadcast_to(assessment.levels[:, None, None], outcomes.shape).ravel()
    record_clusters = np.array(assessment.clusters[: len(outcomes_by_record)])
    clusters = np.broadcast_to(record_clusters[None, :, None], outcomes.shape).ravel()
    is_known = ~np.isnan(outcomes.ravel())
    arrays, count = {"seen": outcomes.mean(axis=(1, 2), where=~np.isnan(outcomes))}, int(is_known.sum())
    data, known_clusters = (levels[is_known], outcomes.ravel()[is_known]), clusters[is_known]
    try:
        fragility = fit_fragility(*data, clusters=known_clusters, measure=assessment.measure)
    except FitError as error:
        reason = phrase("assessment.no_fit", reason=str(error))
        return Payload({**header, "fit": None, "why": reason, "outcomes": count}, arrays)
    curve, intensities = fragility.curves[0], np.linspace(0.0, assessment.levels[-1], 121)
    without_band = (np.zeros_like(intensities), np.ones_like(intensities))
    lower, upper = curve.band(intensities) if curve.is_bounded else without_band
    fit = {
        "median": curve.median,
        "median_interval": list(curve.median_interval),
        "dispersion": curve.dispersion,
        "dispersion_interval": list(curve.dispersion_interval),
        "confidence": curve.confidence,
        "bounded": curve.is_bounded,
        "exceeded": int(curve.exceeded.sum()),
        "notes": list(replace(fragility, source="motion" if assessment.stations is None else "cluster").notes),
    }
    header = {**header, "fit": fit, "why": None, "outcomes": count}
    return Payload(
        header,
        {**arrays, "at": intensities, "probability": curve.probability(intensities), "lower": lower, "upper": upper},
    )


def _describe_record(assessment: Assessment, motion: Motion) -> dict[str, Any]:
    """Return the outcome of an unscaled record and the friction that it requires."""
    case = assessment.case
    response = simulate(case.block, motion, model=case.model, chattering=case.chattering)
    return {
        **_rate_motion(case, motion),
        "measure": assessment.measure.value(motion),
        "overturns": response.overturned,
        "undecided": not response.perturbed().is_decided,
        "peak_over_slenderness": response.peak_over_slenderness,
        "friction_needed": response.required_friction,
    }


def _rate_motion(case: Case, motion: Motion) -> dict[str, Any]:
    """Return measures of a motion, and demand divided by capacity by every rule."""
    ratings = apply_rules(case.block, motion, ["west", "ishiyama"])
    ratios = {name: float(rating.ratio[0]) for name, rating in ratings.items()}
    uplift = motion.pga / min(case.block.uplift_thresholds(case.model))
    return {"pga": motion.pga, "pgv": motion.pgv, "ratios": {"uplift": uplift, **ratios}}


def _find_overturning_factor(case: Case) -> dict[str, Any] | None:
    """Return the lowest factor on the case's motion that overturns the block, or None, and the peak acceleration.

    Overturning levels may form several bands; bands thinner than a step from the uplift level are missed.
    """
    motion = case.motion
    if motion is None or motion.pga == 0.0:
        return None

    def is_overturned(factors: Floats) -> Flags:
        table = simulate_levels(
            Blocks.from_bodies(case.block), [motion], FACTOR, factors, model=case.model, chattering=case.chattering,
        )  # fmt: skip
        return np.asarray(table.overturned.values.ravel())

    uplift_factor = compute_uplift_factors(motion, [case.block.uplift_thresholds(case.model)], case.block.gravity)[0]
    margin: dict[str, Any] = {"factor": None, "pga": motion.pga}
    if math.isinf(uplift_factor):
        return margin
    factors = uplift_factor * _LEVEL_RATIO ** np.arange(-1.0, 128)  # the first does not lift the block
    for start in range(1, len(factors), _BATCH_SIZE):
        overturning = np.flatnonzero(is_overturned(factors[start : start + _BATCH_SIZE]))
        if overturning.size:
            low, high = factors[start + overturning[0] - 1 : start + overturning[0] + 1]
            factor = bisect(
                float(low), float(high), lambda factor: bool(is_overturned(np.array([factor]))[0]), halvings=24
            )[1]
            return margin | {"factor": factor, "pga": factor * motion.pga}
    return margin | {"pga": float(factors[-1]) * motion.pga}


def _read_nonzero_motion(entry: Texts, uploads: UploadStore) -> Motion:
    motion = read_motion(entry, uploads).motion
    if motion is None or motion.pga == 0.0:
        raise OptionError(f"{find_title(entry, uploads)} shakes nothing: take it out of {{}}", "records")
    return motion


def _find_overturning_velocity(case: Case) -> float:
    """Return the sudden ground velocity, m/s, that just overturns the block on its weaker side."""
    return float(overturning_velocity(Blocks.from_bodies(case.block)).min())


def _suggest_levels(case: Case, measure: Measure, motions: Iterable[Motion]) -> tuple[float, float]:
    """Return the level at which the first record lifts the block, and one at which half of them may overturn it."""
    # Twice the velocity that overturns the block.
    uplift_threshold, velocity = min(case.block.uplift_thresholds(case.model)), 2.0 * _find_overturning_velocity(case)
    values = [(measure.value(motion), motion.pga, motion.pgv) for motion in motions]
    low = min(uplift_threshold * value / pga for value, pga, _ in values)
    high = float(np.median([velocity * value / pgv for value, _, pgv in values]))
    return _round_level(low, math.floor), _round_level(max(high, 3.0 * low), math.ceil)


def _round_level(level: float, rounding: Any) -> float:
    """Return an acceleration rounded to two digits, in g."""
    step = 10.0 ** (math.floor(math.log10(level / STANDARD_GRAVITY)) - 1)
    return float(f"{rounding(level / STANDARD_GRAVITY / step) * step:.6g}") * STANDARD_GRAVITY


def assessment_as_python(assessment: Assessment) -> str:
    """Write a complete script that computes the same curve."""
    case, measure = assessment.case, assessment.measure
    options = {
        "model": None if case.model == "nonlinear" else case.model,
        "chattering": case.texts.get("chattering"),
        "clusters": None if assessment.stations is None else assessment.clusters,
    }
    records = [assessment.record(k) for k in range(len(assessment.entries))]
    return _SCRIPT.format(
        block=case.block_call,
        before="".join(f"{line}\n" for line in dict.fromkeys(record.preamble for record in records) if line),
        motions="\n".join(f"    {record.python}," for record in records),
        measure=repr(measure.name) if measure.period is None else f'rocking.Measure("sa", period={measure.period!r})',
        levels=f"np.linspace({assessment.levels[0]!s}, {assessment.levels[-1]!s}, {len(assessment.levels)})",
        options="".join(f", {name}={value!r}" for name, value in options.items() if value is not None),
    )
