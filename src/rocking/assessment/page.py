"""Report of an assessment as one HTML page with figures, which prints on A4 with a page for each object."""

from __future__ import annotations

import math
import platform
from collections.abc import Iterable, Sequence
from datetime import datetime
from html import escape
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from rocking.analysis.levels import compute_block_units
from rocking.analysis.risk import describe_extrapolated_shares
from rocking.assessment.chart import Chart, render_bar, render_intervals
from rocking.core.constants import STANDARD_GRAVITY, VERSION
from rocking.core.tables import format_count, list_some, write_text
from rocking.engine.problem import gather_bodies
from rocking.motion.scaling import Measure

if TYPE_CHECKING:
    import xarray as xr

    from rocking.assessment.results import Assessment, ObjectAssessment

#: Rules of thumb beside the simulations.
RULES: Final = ("west", "ishiyama")


def write_page(assessment: Assessment, path: str | Path, command: str) -> None:
    """Write the report of an assessment."""
    style = Path(__file__).with_name("report.css").read_text("utf-8")
    title = f"Assessment of {format_count(len(assessment.objects), 'object')}"
    parts = [_render_overview(assessment, title)]
    parts += [_render_object(assessment, k) for k in range(len(assessment.objects))]
    parts += [_render_records(assessment), _render_method(assessment, command)]
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{title}</title>'
    body = "\n".join(parts)
    write_text(path, f'<!DOCTYPE html>\n<html lang="en"><head>{head}<style>\n{style}</style></head>\n{body}\n</html>\n')


def _render_overview(assessment: Assessment, title: str) -> str:
    """Render the summary table, the figure of all objects, and failures."""
    header, rows = assessment.tabulate()
    labels = assessment.labels
    links = [f'<a href="#object-{k + 1}">{escape(row[1])}</a>' for k, row in enumerate(rows)]
    cells = [[rank, link, *map(escape, values)] for link, (rank, _, *values) in zip(links, rows, strict=True)]
    texts = [[link, *(escape(assessment.label(name, k)) for name in labels)] for k, link in enumerate(links)]
    details = f"<h3>Objects</h3>\n{_render_table(['object', *labels], texts, is_dense=True)}" if labels else ""
    hazard = "" if assessment.hazard is None else f" The hazard curve is {escape(repr(assessment.hazard.name))}."
    basis = "return period of overturning" if assessment.hazard is not None else "median intensity"
    confidence = f"{100 * assessment.confidence:g} %"
    items = [f"<li><b>{escape(name)}</b>: {escape(reason)}</li>" for name, reason in assessment.failures.items()]
    failure_list = f'<div class="failed"><h3>Not assessed</h3><ul>{"".join(items)}</ul></div>' if items else ""
    return f"""<h1>{title} under {format_count(len(assessment.motions), "ground motion")}</h1>
<p>Intensity measure: {escape(assessment.measure.label)}.{hazard} Intervals have {confidence} confidence. Objects are
ranked by their {basis}. The ranks in brackets are plausible with {confidence} confidence: the motions are resampled,
the same ones for all objects.</p>
{_render_table(header, cells)}
<p>{_describe_factors(assessment)}</p>
{failure_list}
<h3>Median intensity of overturning</h3>
{_render_medians(assessment)}
<p class="soft">Dots are medians, bars their {confidence} intervals. Without a fitted curve the bar extends from the
highest level at which the object stands under all motions to the level at which all motions overturn it; an arrow
marks a bar without an end. The intervals contain the differences between the ground motions, not the errors of the
model, of the sizes that are taken as known, and of the selection of the motions.</p>
{details}"""


def _render_object(assessment: Assessment, k: int) -> str:
    """Render the page of one object."""
    item, data = assessment.objects[k], assessment.data
    labels = {name: assessment.label(name, k) for name in assessment.labels}
    details = [escape(item.body.description.removeprefix(f"{item.name}: "))]
    details += [f"{escape(name)}: {escape(value)}" for name, value in labels.items() if value]
    scale, unit = assessment.measure.display_factor, assessment.measure.display_unit
    suffix = f", {unit}" if unit else ""
    rules = [rule for rule in RULES if np.isfinite(data[rule].values[k]).all()]
    highest_level = scale * item.levels[-1]
    header = [
        "record",
        "PGA, g",
        "as recorded",
        "peak/slenderness",
        f"overturns at{suffix}",
        "",
        *map(str.title, rules),
    ]
    rows = []
    for m, name in enumerate(_shorten_names(assessment.motions)):
        low, high = (scale * float(data[end].values[k, m]) for end in ("stands_up_to", "overturns_at"))
        outcome, peak = _describe_outcome(data, k, m), float(data.peak_over_alpha.values[k, m])
        recorded_level = scale * float(data.intensity.values[m])
        row = [
            escape(name),
            f"{float(data.pga.values[m]) / STANDARD_GRAVITY:.3g}",
            f'<b class="overturns">{outcome}</b>' if outcome == "overturns" else outcome,
            "" if math.isinf(peak) else f"{peak:.2f}",
            f"&gt; {low:.2g}" if math.isinf(high) else f"{low:.2g} to {high:.2g}",
            render_bar((low, min(high, highest_level)), recorded_level, highest_level, has_end=high < math.inf),
        ]
        rows.append(row + [f"{float(data[rule].values[k, m]):.2f}" for rule in rules])
    statements = "".join(f"<li>{escape(text)}</li>" for text in describe_object(assessment, k))
    table = _render_table(header, rows, is_dense=True)
    return f"""<section id="object-{k + 1}"><h2>{k + 1}. {escape(item.name)}</h2>
<p class="soft">{"; ".join(details)}</p>
{_render_fragility(assessment, item)}
<ul>{statements}</ul>
<h3>Each record</h3>
{table}
<p class="soft">Bars extend from the highest level at which the object stands to the lowest level at which it overturns;
triangles mark the record as it is. Ratios of rules are demand divided by capacity: 1 or more predicts overturning.</p>
</section>"""


def _describe_outcome(data: xr.Dataset, k: int, m: int) -> str:
    if data.unfinished.values[k, m]:
        return "not finished"
    if data.undecided.values[k, m]:
        return "undecided"
    if data.overturned.values[k, m]:
        return "overturns"
    if data.peak_over_alpha.values[k, m] > 0.0:
        return "stands"
    return "slides" if "largest_slip" in data and data.largest_slip.values[k, m] > 0.0 else "does not move"


def describe_object(assessment: Assessment, k: int) -> list[str]:
    """Describe the results of an object and their certainty, one statement each."""
    item, data, measure = assessment.objects[k], assessment.data, assessment.measure
    names = np.array(_shorten_names(assessment.motions))
    is_overturned, record_count = data.overturned.values[k], len(names)
    listed = f" ({list_some(names[is_overturned].tolist())})" if is_overturned.any() else ""
    text = f"Under the records as they are it overturns in {is_overturned.sum()} of {record_count}{listed}"
    is_undecided = data.undecided.values[k]
    if is_undecided.any():
        text += f"; {is_undecided.sum()} outcomes are undecided, because they change within 3e-6 of the motion"
    statements = [f"{text}."]
    scale, unit = measure.display_factor, f" {measure.display_unit}".rstrip()
    low, high = item.first_levels
    first = int(np.argmin(high))
    if math.isinf(high[first]):
        statements.append(f"No record overturns it up to {scale * item.levels[-1]:.3g}{unit}, the highest level.")
    else:
        bounds = f"between {scale * low[first]:.3g} and {scale * high[first]:.3g}{unit}"
        if low[first] == 0.0:
            bounds = f"at or below {scale * high[first]:.3g}{unit}, the lowest level"
        text = f"Scaled records first overturn it {bounds} ({names[first]})"
        if censored_count := int(np.isinf(high).sum()):
            text += f"; {censored_count} of {record_count} do not up to {scale * item.levels[-1]:.3g}{unit}"
        statements.append(f"{text}.")
    median, interval, dispersion = assessment.format_curve(item)
    if item.curve is None:
        statements.append(f"No fragility curve: {item.fault}.")
    else:
        simulations = format_count(int(item.curve.trial_counts.sum()), "simulation")
        interval = f"{100 * assessment.confidence:g} % interval {interval}"
        text = f"Half of the motions overturn it at {median}{unit} ({interval}), with a dispersion of {dispersion}, "
        statements.append(f"{text}from {simulations}.")
    statements += _describe_rate(assessment, item)
    if (count := item.sample_count) > 1:
        statements.append(f"Its size is uncertain: the curve is of {count} sampled sizes, records of the mean.")
    statements += _describe_sliding(item, data, k)
    for rule in RULES:
        ratios = data[rule].values[k]
        if np.isfinite(ratios).all():
            right_count = int(np.count_nonzero((ratios >= 1.0) == is_overturned))
            unsafe_count = int(np.count_nonzero((ratios < 1.0) & is_overturned))
            verdict = f"is right for {right_count} of {record_count} records, and unsafe for {unsafe_count}"
            statements.append(f"The rule {rule.title()} {verdict}.")
    notes = []
    if item.fragility is not None and item.curve is not None:
        has_ends = item.curve.is_bounded and not math.isinf(item.curve.dispersion_interval[1])
        notes = [item.fragility.missing_note, item.fragility.undecided_note] if has_ends else [*item.fragility.notes]
    texts = [*statements, *(f"{note}." for note in notes if note)]
    return [f"{text[0].upper()}{text[1:]}".replace("< ", "less than ").replace("> ", "more than ") for text in texts]


def _describe_rate(assessment: Assessment, item: ObjectAssessment) -> list[str]:
    """Describe how often the site overturns an object."""
    if assessment.hazard is None:
        return []
    years = format_count(assessment.years, "year")
    period, interval, probability = assessment.format_rate(item)
    if item.rate is None:
        return [f"It overturns once in {period} years, because the outcomes only bound the rate."]
    text = f"At the site it overturns once in {period} years (interval {interval}), and within {years} with probability"
    return [f"{text} {probability}.", *(f"{share}." for share in describe_extrapolated_shares(item.rate))]


def _describe_sliding(item: ObjectAssessment, data: xr.Dataset, k: int) -> list[str]:
    """Describe the friction that an object requires, or its slip."""
    threshold = item.uplift_acceleration / item.body.gravity
    if item.friction is None:
        text = f"It lifts off at {threshold:.3g} g. With a coefficient of friction below {threshold:.3g} it would slide"
        return [f"{text} instead of rock; the simulations do not include sliding."]
    text = f"With a coefficient of friction of {item.static_friction:g} it "
    slip = np.nanmax(data.largest_slip.values[k]) if "largest_slip" in data else math.nan
    slides = f"slides by up to {1000.0 * slip:.2g} mm under the records as they are" if slip > 0.0 else "does not slide"
    if item.slides_first:
        return [f"{text}slides instead of rocking from rest, because friction is below {threshold:.3g}; it {slides}."]
    return [f"{text}lifts off at {threshold:.3g} g, and {slides}."]


def _shorten_names(names: Iterable[str]) -> list[str]:
    """Return names of files without their folders, if they remain distinct."""
    long_names = [*names]
    short_names = [Path(name).name for name in long_names]
    return short_names if len({*short_names}) == len(long_names) else long_names


def _render_records(assessment: Assessment) -> str:
    """Render the table of the ground motions, and of the records that are not used."""
    data, names = assessment.data, _shorten_names(assessment.motions)
    label_names = [name for name in data.coords if data[name].dims == ("motion",) and name not in ("motion", "file")]
    files = [str(file) for file in data["file"].values] if "file" in data.coords else [""] * len(names)
    columns = {"record": names, "file": ["" if file in name else file for file, name in zip(files, names, strict=True)]}
    columns |= {str(name): [str(value) for value in data[name].values] for name in (*label_names, "format")}
    numbers = {
        "step, s": ("step", 1.0), "duration, s": ("duration", 1.0), "D5-95, s": ("significant_duration", 1.0),
        "PGA, g": ("pga", STANDARD_GRAVITY), "PGV, m/s": ("pgv", 1.0), "Arias, m/s": ("arias", 1.0),
    }  # fmt: skip
    if assessment.measure not in (Measure("pga"), Measure("pgv"), Measure("arias")):
        numbers[assessment.measure.label] = ("intensity", 1.0 / assessment.measure.display_factor)
    for title, (name, divisor) in numbers.items():
        columns[title] = [f"{value / divisor:.4g}".replace("nan", "-") for value in data[name].values.tolist()]
    columns["remarks"] = [str(value) for value in data.processing.values]
    columns = {title: texts for title, texts in columns.items() if title == "remarks" or any(texts)}
    rows = [[escape(text) for text in row] for row in zip(*columns.values(), strict=True)]
    unused = zip(_shorten_names(assessment.skipped), assessment.skipped.values(), strict=True)
    rows += [[escape(name), *[""] * (len(columns) - 2), f"not used: {escape(reason)}"] for name, reason in unused]
    table = _render_table([*columns], rows, is_dense=True)
    return f'<section id="records"><h2>Ground motions</h2>\n{table}</section>'


def _describe_factors(assessment: Assessment) -> str:
    """Describe the factors with which the levels scale the motions."""
    measure, values = assessment.measure, assessment.data.intensity.values
    units = compute_block_units(gather_bodies([item.body for item in assessment.objects]), measure, assessment.model)
    ends = [unit * item.levels[[0, -1], None] for unit, item in zip(units, assessment.objects, strict=True)]
    low, high = (find_extreme(measure.find_factor(np.array(ends), values)) for find_extreme in (np.min, np.max))
    text = f"The levels scale the records by factors of {low:.2g} to {high:.2g}."
    return f"{text} Scaled weak motions differ from strong ones in duration and frequency content."


def _render_method(assessment: Assessment, command: str) -> str:
    """Render assumptions, versions and the command."""
    options = assessment.data.attrs
    versions = [f"rocking {VERSION}", f"Python {platform.python_version()}"]
    versions += [f"{name} {metadata.version(name)}" for name in ("numpy", "scipy")]
    polarity = {"both": "Original and reversed motions", "+": "Original motions", "-": "Reversed motions"}
    assumptions = [
        f"Rigid blocks, {assessment.model} model, events located and chattering certified.",
        f"{polarity[options['polarity']]}; a symmetric object responds equally to both, which count once.",
        "Fragility: lognormal curve by maximum likelihood; motions are independent, unless they were grouped.",
        "An undecided outcome changes if the motion is scaled by less than 3e-6.",
        "Objects are numbered by rank, from 1.",
    ]
    items = "".join(f"<li>{escape(text)}</li>" for text in assumptions)
    command_text = f"<p>Command: <code>{escape(command)}</code></p>" if command else ""
    time = datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z")
    return f"""<section id="method"><h2>Method and versions</h2><ul>{items}</ul>{command_text}
<p>{escape(", ".join(versions))}; written {time}.</p></section>"""


def _render_medians(assessment: Assessment) -> str:
    """Render the median of each object with its interval."""
    scale = assessment.measure.display_factor
    rows, ends = [], list[float]()
    for k, item in enumerate(assessment.objects):
        curve = item.curve
        low, high = (float(end) for end in (item.first_levels[0].min(), item.first_levels[1].max()))
        median = math.nan
        if curve is not None:
            median, (low, high) = curve.median, curve.median_interval
        rows.append((f"{k + 1}. {item.name}", scale * low, scale * median, scale * high))
        ends += [end for end in rows[-1][1:] if 0.0 < end < math.inf]
    return render_intervals(rows, (min(ends), max(ends)), assessment.measure.label)


def _render_fragility(assessment: Assessment, item: ObjectAssessment) -> str:
    """Render the fragility curve with its band and the simulated shares."""
    scale = assessment.measure.display_factor
    chart = Chart(
        (0.0, 1.05 * scale * item.levels[-1]), (0.0, 1.0), assessment.measure.label, "probability of overturning"
    )
    x = np.linspace(0.0, item.levels[-1], 121)
    if item.curve is not None:
        if item.curve.is_bounded:
            chart.add_band(scale * x, *item.curve.band(x))
        chart.add_line(scale * x, item.curve.probability(x), "curve")
    chart.add_points(scale * item.levels, item.share.mean(axis=1))
    return chart.write()


def _render_table(header: Sequence[str], rows: Sequence[Sequence[str]], *, is_dense: bool = False) -> str:
    """Render a table of HTML texts below a heading of plain texts."""
    kinds = [_choose_column_class([row[k] for row in rows]) for k in range(len(header))]
    heading = "".join(f"<th{kind}>{escape(title)}</th>" for kind, title in zip(kinds, header, strict=True))
    lines = ("".join(f"<td{kind}>{cell}</td>" for kind, cell in zip(kinds, row, strict=True)) for row in rows)
    body = "".join(f"<tr>{line}</tr>\n" for line in lines)
    style = " class=dense" if is_dense else ""
    return f'<div class="wide"><table{style}><thead><tr>{heading}</tr></thead><tbody>\n{body}</tbody></table></div>'


def _choose_column_class(cells: Sequence[str]) -> str:
    """Return the class of a column: of numbers, or of other short texts such as intervals."""
    if all(_is_number(cell) for cell in cells):
        return ' class="number"'
    return ' class="fixed"' if all(len(cell) <= 18 for cell in cells) else ""


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return cell == "-"
    return True
