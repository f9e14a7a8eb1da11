"""Assessment of a case's block: fragility over a list of records, friction, rules of thumb, margin. No web."""

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
from rocking.core.bisection import bisected
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import InvalidOption, Unfitted
from rocking.explorer.catalogue import clusters_of, entries_of, title_of
from rocking.explorer.inputs import Case, require_rest
from rocking.explorer.motions import Found, read_motion
from rocking.explorer.parameters import ASSESSMENT, Texts
from rocking.explorer.payload import Payload, phrase
from rocking.explorer.uploads import UploadStore
from rocking.inputs.quantities import number
from rocking.motion.motion import Motion, compute_uplift_factors
from rocking.motion.scaling import FACTOR, Measure
from rocking.response.mechanics import friction_coefficient
from rocking.rules import overturning_velocity, rate
from rocking.simulation.simulate import simulate

#: Minimum and maximum number of levels of a fragility.
_LEAST, _MOST = 2, 60

#: Ratio of successive levels of the margin from the uplift level on, and the number of levels simulated at once; the
#: first level that overturns is then refined.
_STEP: Final = 1.05
_AT_ONCE: Final = 16

#: Displayed rules of thumb and their sources.
RULES: Final[Mapping[str, str]] = {
    "uplift": "Housner (1963), Bull. Seism. Soc. Am. 53(2), 403–417",
    "west": "Milne and Omori (1893), Seism. J. Japan 1, 59–86",
    "ishiyama": "Ishiyama (1982), Earthq. Eng. Struct. Dyn. 10(5), 635–650",
}

_PYTHON: Final = """\
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
    """Case, entries of its list of records with ``clusters`` by station, and levels of a measure."""

    case: Case
    entries: list[dict[str, str]]
    clusters: list[int]
    uploads: UploadStore
    measure: Measure
    levels: Floats
    friction: float | None

    @property
    def stations(self) -> int | None:
        """Number of stations if several entries share one, else None."""
        count = len(set(self.clusters))
        return count if count < len(self.entries) else None

    def record(self, k: int) -> Found:
        """Read one record, because the whole list is not stored in memory."""
        return read_motion(self.entries[k], self.uploads)

    def motion(self, k: int) -> Motion:
        """Return the motion of one record."""
        return _motion(self.entries[k], self.uploads)


def assessment_of(case: Case, texts: Texts, uploads: UploadStore) -> Assessment:
    """Read an assessment: ``records`` as in `catalogue.entries_of`, ``measure``, its levels, and ``friction``."""
    given = {name: texts[name].strip() for name in ASSESSMENT if texts.get(name, "").strip()}
    entries = entries_of(given.get("records", ""))
    if not entries:
        raise InvalidOption("an assessment needs {}: tick one or more in the list", "records")
    if not all("motion" in entry for entry in entries):
        raise InvalidOption("an entry of the list of {} names no motion: take it out", "records")
    require_rest(side.restitution for side in case.block.sides)
    measure = _measure(given)
    count = number(given.get("levels", "16"), "levels")
    if not (_LEAST <= count <= _MOST and count == int(count)):
        raise InvalidOption(
            f"{{}} are from {_LEAST} to {_MOST} in number, not {count:g}", "levels", value=given["levels"]
        )
    known = {end: float(ASSESSMENT[end].read(given[end])) for end in ("level_from", "level_to") if end in given}
    found = (math.nan, math.nan)
    if len(known) < 2:
        found = _range(case, measure, (_motion(entry, uploads) for entry in entries))
    low, high = known.get("level_from", found[0]), known.get("level_to", found[1])
    if not 0.0 < low < high < math.inf:
        raise InvalidOption("{} must be positive, and below the last of the levels", "level_from")
    friction = friction_coefficient(number(given["friction"], "friction")) if "friction" in given else None
    return Assessment(
        case, entries, clusters_of(entries, uploads), uploads, measure, np.linspace(low, high, int(count)), friction
    )


def _measure(given: Texts) -> Measure:
    if given.get("measure", "pga") == "pga":
        return Measure("pga")
    if given["measure"] != "sa":
        raise InvalidOption(f"{{}} is pga or sa, not {given['measure'][:20]!r}", "measure", value=given["measure"])
    return Measure("sa", ASSESSMENT["measure_period"].read(given.get("measure_period", "1")))


def described(assessment: Assessment) -> dict[str, Any]:
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
        notes.append(phrase("assessment.first", step=100.0 * (_STEP - 1.0)))
    if case.initial_rotation or case.initial_velocity or case.duration is not None:
        notes.append(phrase("assessment.begins"))
    return {
        "measure": measure.name,
        "label": measure.quantity,
        "period": measure.period,
        "levels": assessment.levels.tolist(),
        "records": [title_of(entry, assessment.uploads) for entry in assessment.entries],
        "thresholds": list(block.uplift_thresholds(case.model)),
        "friction_to_rock": max(block.uplift_thresholds(case.model)) / block.gravity,
        "friction": assessment.friction,
        "overturning_velocity": _sudden(case),
        "rules": [{"name": name, "source": source} for name, source in RULES.items()],
        "case": None if case.motion is None else _rated(case, case.motion),
        "notes": notes,
        "python": as_python(assessment),
    }


def parts(assessment: Assessment) -> Generator[Payload]:
    """Simulate the records one by one, fit the outcomes so far, and finally compute the margin of the case."""
    case, count = assessment.case, len(assessment.entries)
    fallen: list[Floats] = []
    for k in range(count):
        motion = assessment.motion(k)
        fallen.append(_stripes(assessment, motion))
        row = _row(assessment, motion) | {"number": k, "overturned_levels": fallen[-1].mean(axis=1).tolist()}
        yield _part({"share": (k + 1) / (count + 1), "row": row}, assessment, fallen)
    yield _part({"share": 1.0, "margin": _margin(case)}, assessment, fallen)


def _stripes(assessment: Assessment, motion: Motion) -> Floats:
    """Return 1 (overturns), 0 or NaN (unknown) at each level and polarity."""
    case = assessment.case
    many = Blocks.from_bodies(case.block)
    table = simulate_levels(
        many, [motion], assessment.measure, assessment.levels, model=case.model, chattering=case.chattering,
        polarity="+" if many.is_symmetric else "both",
    )  # fmt: skip
    if "polarity" not in table.dims:
        table = table.expand_dims("polarity")
    found = table.overturned.where(~table.unfinished).transpose("level", "polarity", "motion", "block")
    return np.asarray(found.values[:, :, 0, 0], dtype=float)


def _part(header: dict[str, Any], assessment: Assessment, fallen: list[Floats]) -> Payload:
    """Return the payload of a part: the curve of `rocking.fragility` through all outcomes so far."""
    outcomes = np.stack(fallen, axis=1)  # level, motion, polarity, as in `rocking.fragility`
    levels = np.broadcast_to(assessment.levels[:, None, None], outcomes.shape).ravel()
    own = np.array(assessment.clusters[: len(fallen)])
    clusters = np.broadcast_to(own[None, :, None], outcomes.shape).ravel()
    known = ~np.isnan(outcomes.ravel())
    arrays, count = {"seen": outcomes.mean(axis=(1, 2), where=~np.isnan(outcomes))}, int(known.sum())
    data, groups = (levels[known], outcomes.ravel()[known]), clusters[known]
    try:
        fitted = fit_fragility(*data, clusters=groups, measure=assessment.measure)
    except Unfitted as refused:
        words = phrase("assessment.no_fit", reason=str(refused))
        return Payload({**header, "fit": None, "why": words, "outcomes": count}, arrays)
    curve, at = fitted.curves[0], np.linspace(0.0, assessment.levels[-1], 121)
    lower, upper = curve.band(at) if curve.bounded else (np.zeros_like(at), np.ones_like(at))
    fit = {
        "median": curve.median,
        "median_interval": list(curve.median_interval),
        "dispersion": curve.dispersion,
        "dispersion_interval": list(curve.dispersion_interval),
        "confidence": curve.confidence,
        "bounded": curve.bounded,
        "exceeded": int(curve.exceeded.sum()),
        "notes": list(replace(fitted, source="motion" if assessment.stations is None else "cluster").notes),
    }
    header = {**header, "fit": fit, "why": None, "outcomes": count}
    return Payload(header, {**arrays, "at": at, "probability": curve.probability(at), "lower": lower, "upper": upper})


def _row(assessment: Assessment, motion: Motion) -> dict[str, Any]:
    """Return the outcome of an unscaled record and the friction that it requires."""
    case = assessment.case
    response = simulate(case.block, motion, model=case.model, chattering=case.chattering)
    friction = assessment.friction
    return {
        **_rated(case, motion),
        "measure": assessment.measure.value(motion),
        "overturns": response.overturned,
        "undecided": not response.perturbed().is_decided,
        "peak_over_slenderness": response.peak_over_slenderness,
        "friction_needed": response.required_friction,
        "sliding_time": None if friction is None else response.sliding_time(friction),
    }


def _rated(case: Case, motion: Motion) -> dict[str, Any]:
    """Return measures of a motion, and demand divided by capacity by every rule."""
    ratings = rate(case.block, motion, ["west", "ishiyama"])
    found = {name: float(rating.ratio[0]) for name, rating in ratings.items()}
    uplift = motion.pga / min(case.block.uplift_thresholds(case.model))
    return {"pga": motion.pga, "pgv": motion.pgv, "ratios": {"uplift": uplift, **found}}


def _margin(case: Case) -> dict[str, Any] | None:
    """Return the lowest factor on the case's motion that overturns the block, or None, and the peak acceleration.

    Overturning levels may form several bands; bands thinner than a step from the uplift level are missed.
    """
    motion = case.motion
    if motion is None or motion.pga == 0.0:
        return None

    def fall(factors: Floats) -> Flags:
        table = simulate_levels(
            Blocks.from_bodies(case.block), [motion], FACTOR, factors, model=case.model, chattering=case.chattering,
        )  # fmt: skip
        return np.asarray(table.overturned.values.ravel())

    lifting = compute_uplift_factors(motion, [case.block.uplift_thresholds(case.model)], case.block.gravity)[0]
    found: dict[str, Any] = {"factor": None, "pga": motion.pga}
    if math.isinf(lifting):
        return found
    factors = lifting * _STEP ** np.arange(-1.0, 128)  # the lowest does not lift the block
    for start in range(1, len(factors), _AT_ONCE):
        fallen = np.flatnonzero(fall(factors[start : start + _AT_ONCE]))
        if fallen.size:
            low, high = factors[start + fallen[0] - 1 : start + fallen[0] + 1]
            factor = bisected(float(low), float(high), lambda each: bool(fall(np.array([each]))[0]), halvings=24)[1]
            return found | {"factor": factor, "pga": factor * motion.pga}
    return found | {"pga": float(factors[-1]) * motion.pga}


def _motion(entry: Texts, uploads: UploadStore) -> Motion:
    found = read_motion(entry, uploads).motion
    if found is None or found.pga == 0.0:
        raise InvalidOption(f"{title_of(entry, uploads)} shakes nothing: take it out of {{}}", "records")
    return found


def _sudden(case: Case) -> float:
    """Return the sudden ground velocity, m/s, that just overturns the block on its weaker side."""
    return float(overturning_velocity(Blocks.from_bodies(case.block)).min())


def _range(case: Case, measure: Measure, motions: Iterable[Motion]) -> tuple[float, float]:
    """Return the level at which the first record lifts the block, and one at which half of them may overturn it."""
    # Twice the sudden velocity that overturns the block.
    lifting, sudden = min(case.block.uplift_thresholds(case.model)), 2.0 * _sudden(case)
    values = [(measure.value(motion), motion.pga, motion.pgv) for motion in motions]
    low = min(lifting * value / pga for value, pga, _ in values)
    high = float(np.median([sudden * value / pgv for value, _, pgv in values]))
    return _rounded(low, math.floor), _rounded(max(high, 3.0 * low), math.ceil)


def _rounded(level: float, towards: Any) -> float:
    """Return an acceleration rounded to two digits, in g."""
    step = 10.0 ** (math.floor(math.log10(level / STANDARD_GRAVITY)) - 1)
    return float(f"{towards(level / STANDARD_GRAVITY / step) * step:.6g}") * STANDARD_GRAVITY


def as_python(assessment: Assessment) -> str:
    """Write a complete script that computes the same curve."""
    case, measure = assessment.case, assessment.measure
    given = {
        "model": None if case.model == "nonlinear" else case.model,
        "chattering": case.texts.get("chattering"),
        "clusters": None if assessment.stations is None else assessment.clusters,
    }
    found = [assessment.record(k) for k in range(len(assessment.entries))]
    return _PYTHON.format(
        block=case.block_call,
        before="".join(f"{line}\n" for line in dict.fromkeys(each.before for each in found) if line),
        motions="\n".join(f"    {each.python}," for each in found),
        measure=repr(measure.name) if measure.period is None else f'rocking.Measure("sa", period={measure.period!r})',
        levels=f"np.linspace({assessment.levels[0]!s}, {assessment.levels[-1]!s}, {len(assessment.levels)})",
        options="".join(f", {name}={value!r}" for name, value in given.items() if value is not None),
    )
