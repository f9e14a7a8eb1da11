"""Assessment of a case's block under a list of records by `rocking.assess`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from rocking.assessment.assess import assess
from rocking.assessment.page import describe_object
from rocking.assessment.results import Assessment
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import OptionError, RockingError
from rocking.explorer.catalogue import describe_entries, read_entries
from rocking.explorer.inputs import Case, require_rest
from rocking.explorer.motions import WrittenMotion, read_motion
from rocking.explorer.parameters import Texts, read_count
from rocking.explorer.payload import Payload
from rocking.explorer.uploads import UploadStore
from rocking.inputs.quantities import read_acceleration, read_duration
from rocking.motion.scaling import Measure
from rocking.records.named import make_names_unique

#: Maximum number of levels, and number by default.
_MAX_LEVELS, _LEVEL_COUNT = 60, 20

_SCRIPT: Final = """\
import numpy as np

import rocking

block = rocking.{block}
{before}motions = {{
{motions}
}}
assessment = rocking.assess(block, motions, measure={measure}, levels={levels}, polarity="both"{options})
print(assessment.summary())
assessment.to_html("report.html")
"""


@dataclass(frozen=True, eq=False)
class AssessedCase:
    """Assessment of a case's block, the names of all records in the list, and an equivalent Python script."""

    result: Assessment
    names: list[str]
    script: str


def assess_case(case: Case, texts: Texts, uploads: UploadStore) -> AssessedCase:
    """Assess the block of a case under the entries of ``records`` (see `catalogue.read_entries`).

    ``measure`` is pga, or sa with ``measure_period``. ``levels`` is a number of levels, from ``level_from`` to
    ``level_to`` or else as `rocking.assess` chooses them.
    """
    entries = read_entries(texts.get("records", ""))
    if not entries:
        raise OptionError("an assessment needs {}: tick one or more in the list", "records")
    require_rest(side.restitution for side in case.block.sides)
    measure, levels = _read_measure(texts), _read_levels(texts)
    written, failures = dict[str, WrittenMotion](), dict[str, str]()
    titles, stations = zip(*describe_entries(entries, uploads), strict=True)
    names = make_names_unique(titles)
    for name, entry in zip(names, entries, strict=True):
        try:
            written[name] = read_motion(entry, uploads)
        except RockingError as error:
            failures[name] = str(error)
    motions = {name: record.motion for name, record in written.items() if record.motion is not None}
    clusters = [station for name, station in zip(names, stations, strict=True) if name in motions]
    options = {name: value for name, value in case.options.items() if name in ("model", "friction", "chattering")}
    options |= {"clusters": clusters} if len({*clusters}) < len(clusters) else {}
    block = case.block.with_labels(name="block")
    result = assess(block, motions, measure=measure, levels=levels, polarity="both", **options)
    result = replace(result, skipped={**failures, **result.skipped})
    return AssessedCase(result, names, _format_script(case, written, measure, levels, options))


def _read_measure(texts: Texts) -> Measure:
    if checks.choice(texts.get("measure") or "pga", "measure", OptionError, ["pga", "sa"]) == "pga":
        return Measure("pga")
    return Measure("sa", read_duration(texts.get("measure_period") or "1", "measure_period"))


def _read_levels(texts: Texts) -> int | Floats:
    count = read_count(texts.get("levels") or str(_LEVEL_COUNT), "levels", 2, _MAX_LEVELS)
    if not (texts.get("level_from") or texts.get("level_to")):
        return count
    low, high = (read_acceleration(texts.get(end, ""), end) for end in ("level_from", "level_to"))
    if not 0.0 < low < high < np.inf:
        message = "{} and {} must be positive and increasing; leave both empty for levels that suit the block"
        raise OptionError(message, "level_from", "level_to")
    return np.linspace(low, high, count)


def _format_script(
    case: Case, records: dict[str, WrittenMotion], measure: Measure, levels: int | Floats, options: dict[str, Any]
) -> str:
    """Write a complete script that computes the same assessment."""
    return _SCRIPT.format(
        block=case.block_expression,
        before="".join(dict.fromkeys(record.preamble for record in records.values())),
        motions="\n".join(f"    {name!r}: {record.expression}," for name, record in records.items()),
        measure=repr(measure.name) if measure.period is None else f'rocking.Measure("sa", period={measure.period!r})',
        levels=levels if isinstance(levels, int) else f"np.linspace({levels[0]!s}, {levels[-1]!s}, {len(levels)})",
        options="".join(f", {name}={value!r}" for name, value in options.items()),
    )


def describe_assessment(assessed: AssessedCase) -> Payload:
    """Return statements on the block, its fragility, and the outcomes of each record."""
    result, data = assessed.result, assessed.result.data.isel(block=0)
    item, names = result.objects[0], ("overturned", "undecided", "peak_over_alpha", "stands_up_to", "overturns_at")
    intensities = np.linspace(0.0, item.levels[-1], 121)
    curve = {} if item.curve is None else {"at": intensities, "probability": item.curve.probability(intensities)}
    if item.curve is not None and item.curve.is_bounded:
        curve["lower"], curve["upper"] = item.curve.band(intensities)
    header = {
        "measure": result.measure.name,
        "label": result.measure.quantity,
        "period": result.measure.period,
        "statements": describe_object(result, 0),
        "failures": [f"{name}: {reason}" for name, reason in result.skipped.items()],
        "records": [
            {"number": assessed.names.index(name), "name": name, **{key: data[key].values[k].item() for key in names}}
            for k, name in enumerate(result.motions)
        ],
        "python": assessed.script,
    }
    return Payload(header, {"levels": item.levels, "share": item.share.mean(axis=1), **curve})
