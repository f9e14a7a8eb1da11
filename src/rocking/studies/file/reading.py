"""A study as a text file: blocks, motions, scales and rules in TOML, every mistake with its line."""

from __future__ import annotations

import contextlib
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

from rocking import checks
from rocking.ensemble import Product, Scales
from rocking.errors import InvalidOption, StudyError
from rocking.motion.scaling import FACTOR, Measure, MeasureName
from rocking.plausibility import level_notes
from rocking.progress import note
from rocking.studies.file.blocks import blocks_of
from rocking.studies.file.motions import motions_of
from rocking.studies.file.tables import MEASURES, Tables
from rocking.studies.product import OUTCOMES, chosen_outcomes
from rocking.studies.report import PLANS, ReportPlan, check_part
from rocking.treatment import treatment

#: A file to start from, with comments.
TEMPLATE: Final = Path(__file__).with_name("template.toml").read_text("utf-8")


@dataclass(frozen=True)
class StudyFile:
    """What a file describes.

    Attributes
    ----------
    product : Product
        Blocks, motions, scales and rules.
    skipped : tuple of str
        A sentence for each record that could not be read, where the file says to go on.
    report : ReportPlan or None
        What is to be made of the results.
    outcomes : tuple of str
        What is kept of each simulation.
    records : tuple of str
        Name of the record of each motion, relative to the file; empty of a pulse.
    """

    product: Product
    skipped: tuple[str, ...]
    report: ReportPlan | None
    outcomes: tuple[str, ...] = OUTCOMES
    records: tuple[str, ...] = ()


def read_study(path: str | Path) -> StudyFile:
    """Read the description of a study; names of files in it are relative to it.

    Parameters
    ----------
    path : path
        A TOML file; `TEMPLATE` is one with comments.

    Returns
    -------
    StudyFile
        Its product, and what is to be kept and made of the results.

    Raises
    ------
    StudyError
        If the file cannot be read, or a line of it is wrong: `path`, `line` and `argument` (the key) of the error.
    UnreadableRecord
        If a record cannot be read.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "study.toml"
    >>> _ = file.write_text(TEMPLATE)
    >>> read_study(file).product.shape
    (2, 3, 1, 320)
    >>> _ = file.write_text(TEMPLATE.replace("restitution", "restitutoin"))
    >>> try:
    ...     read_study(file)
    ... except StudyError as error:
    ...     print(error.line, error.message.text())
    7 [blocks] has no restitutoin; did you mean restitution?
    """
    file = checks.path(path, "the file of a study", StudyError)
    try:
        text = file.read_text("utf-8-sig")
        content = tomllib.loads(text)
    except OSError as error:
        raise StudyError(f"the file cannot be read: {error.strerror or error}", path=str(file)) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise StudyError(f"this is no TOML file: {error}; correct it", path=str(file)) from None
    return _study(Tables(file, text, content))


def _study(tables: Tables) -> StudyFile:
    """Read all tables, the cheapest first."""
    tables.check()
    rules, given = tables.table("simulation"), tables.table("scales")
    blocks, scales = blocks_of(tables), _scales(tables)
    motions, names, skipped = motions_of(tables, scales)
    with tables.located("simulation", key="chattering"):
        chattering = treatment(rules.get("chattering", "certified"))
    model, polarity = rules.get("model", "nonlinear"), given.get("polarity", "+")
    with tables.located("simulation", "scales", "blocks"):
        product = Product(blocks, tuple(motions), scales, polarity, model, chattering, rules.get("duration"))
        kept = chosen_outcomes(rules.get("outcomes"))
    report = _report(tables, kept)
    longest = max(motion.end for motion in motions)
    if report not in (None, ReportPlan()) and product.duration is not None and product.duration < longest:
        raise tables.wrong(
            "simulation",
            "duration",
            f"{{}} ends before the longest motion, of {longest:g} s, and a report needs whole responses: leave it out",
            "duration",
        )
    return StudyFile(product, tuple(skipped), report, kept, tuple(names))


def _scales(tables: Tables) -> Scales:
    given = tables.table("scales")
    measures = [name for name in MEASURES if name in given]
    if len(measures) > 1:
        listed = " and ".join(["{}"] * len(measures))
        raise tables.wrong(
            "scales", measures[0], f"motions can be scaled to one measure only, not to {listed}", *measures
        )
    for option in ("period", "damping"):
        if option in given and "sa" not in given:
            raise tables.wrong("scales", option, "{} goes with {}, and only with it", option, "sa")
    if "sa" in given and "period" not in given:
        raise tables.wrong("scales", "sa", "{} needs {}, in s", "sa", "period")
    levels = {name: tables.numbers("scales", name, given[name]) for name in measures}
    with tables.located("scales"):
        if not levels:
            return Scales.of(None, FACTOR)
        ((name, values),) = levels.items()
        checks.positive_numbers(values, name, InvalidOption)
        _note_levels(name, given[name])
        options = {option: given[option] for option in ("period", "damping") if option in given}
        return Scales.of(values, Measure(cast(MeasureName, name), **options))


def _note_levels(name: str, given: object) -> None:
    """Note levels without a unit that look like accelerations in g."""
    if name in ("pga", "sa"):
        for each in given if isinstance(given, list) else [given]:
            # Of START:STOP:COUNT the stop is the strongest.
            text = each.split(":")[:2][-1] if isinstance(each, str) else f"{each!r}"
            with contextlib.suppress(ValueError):  # a number with a unit
                for sentence in level_notes(text.strip(), float(text), name):
                    note(sentence)


def _report(tables: Tables, kept: tuple[str, ...]) -> ReportPlan | None:
    plans: dict[str, Any] = {}
    for name, given in tables.table("report").items():
        with tables.located(f"report.{name}"):
            plans[name] = PLANS[name](**given)
            check_part(plans[name], kept)
    return ReportPlan(**plans) if "report" in tables.tables else None
