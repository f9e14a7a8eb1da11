"""Responses of one block to many records, and comparison with rules of thumb."""

from __future__ import annotations

import itertools
import math
import re
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from rocking.analysis.levels import MIRROR_NOTE
from rocking.block.body import Body
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.progress import Progress
from rocking.core.result import Result
from rocking.core.tables import Column, add_unit, format_count, format_table, records_to_columns, round_decimal
from rocking.engine.problem import gather_bodies, require_body
from rocking.errors import OptionError
from rocking.inputs.inventory import find_friction
from rocking.motion.motion import Motion
from rocking.records.named import Motions, index_motions, list_motion_names
from rocking.response import Response
from rocking.response.mechanics import check_available_friction
from rocking.response.perturbed import MOTION_PRECISION, choose_factors
from rocking.response.summary import format_brief_outcome, format_ratio, round_ratio
from rocking.simulation.ensemble import body_coordinates, list_labels, motion_coordinates
from rocking.simulation.simulate import simulate

#: Columns of the printed table. Files contain all columns.
_TABLE_COLUMNS: Final = {
    "record": "record",
    add_unit("pga", "g"): "PGA, g",
    "peak_over_{}": "peak/{}",
    "impacts_resolved": "resolved impacts",
    "rests": "rests",
    "verdict": "verdict",
}

_SLIDING_TIME: Final = add_unit("sliding_time", "s")


@dataclass(frozen=True, eq=False, repr=False)
class BlocksUnderRecords(Result):
    """Responses of each block to several motions, named `records`, with reasons for `skipped` ones."""

    TABLES = ("records",)

    block: Body | Sequence[Body]
    records: tuple[str, ...]
    responses: tuple[Response, ...]
    skipped: Mapping[str, str] = field(default_factory=dict, kw_only=True)

    @abstractmethod
    def rows(self) -> list[dict[str, Any]]:
        """Return a row of results for each record."""

    @property
    def bodies(self) -> list[Body]:
        """Blocks in a list."""
        return [*self.block] if isinstance(self.block, Sequence) else [self.block]

    def to_dict(self) -> dict[str, Any]:
        blocks = [str(body) for body in self.bodies]
        entry = {"block": blocks[0]} if len(blocks) == 1 else {"blocks": blocks}
        return {**entry, "records": self.rows(), "skipped": dict(self.skipped)}

    def _columns(self, table: str) -> list[Column]:
        return records_to_columns(self.rows(), self.skipped)

    def _create_labels(self) -> list[dict[str, Any]]:
        """Create the first columns of each row: labels of the block, record, motion, block."""
        bodies = self.bodies
        record_count = len(self.responses) // len(bodies)
        gathered = gather_bodies(bodies if len(bodies) > 1 else bodies[0])
        names = [*list_labels(gathered)]
        columns = {
            _add_attribute_unit(name, attributes): np.repeat(values, record_count).tolist()
            for name, (_, values, attributes) in body_coordinates(gathered).items()
        }
        rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
        motions = [require_motion(response) for response in self.responses]
        records = create_record_columns(self.records[:record_count], motions[:record_count]) * len(bodies)
        blocks = [{"block": response.block.description} for response in self.responses]
        return [
            {name: row[name] for name in names} | record | block | row
            for row, record, block in zip(rows, records, blocks, strict=True)
        ]

    def _list_label_titles(self) -> dict[str, str]:
        """Return the columns of labels in the printed table."""
        names = {
            name: "object" if name == "name" else name for body in self.bodies for name in getattr(body, "labels", {})
        }
        if names or len(self.bodies) == 1:
            return {name: title for name, title in names.items() if name in self._create_labels()[0]}
        return {"block": "block"}

    def _format_headline(self) -> str:
        """Summarise the number of records that overturn the block."""
        overturned_count = sum(response.overturned and response.perturbed().is_decided for response in self.responses)
        if len(self.bodies) > 1:
            record_count = len(self.responses) // len(self.bodies)
            pairs = f"{format_count(len(self.bodies), 'block')} under {format_count(record_count, 'record')}"
            return f"{pairs}: {overturned_count} of {len(self.responses)} overturn"
        text = format_count(len(self.records), "record")
        return f"{self.bodies[0].description}: {text}, overturned by {overturned_count}"


@dataclass(frozen=True, eq=False, repr=False)
class Survey(BlocksUnderRecords):
    """Responses of one or more blocks to several motions, computed by `survey`.

    Attributes
    ----------
    available_friction, precision : float
        As for `survey`.
    block, records, responses, skipped
        One body or several, names of the motions and their responses (for each body in turn), and reasons why records
        could not be read.

    See Also
    --------
    rocking.survey : Run the simulations.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> motions = {"weak": rocking.pulses.one_sine(1.0, 1.0), "strong": rocking.pulses.one_sine(9.0, 1.0)}
    >>> survey = rocking.survey(block, motions)
    >>> [response.overturned for response in survey.responses]
    [False, True]
    """

    available_friction: float | None = None
    precision: float = MOTION_PRECISION

    def rows(self) -> list[dict[str, Any]]:
        friction, rows = self.available_friction, []
        for label, response in zip(self._create_labels(), self.responses, strict=True):
            row = label | _create_row(response, self.precision)
            if friction is not None:
                row |= {"available_friction": friction, _SLIDING_TIME: response.sliding_time(friction)}
            rows.append(row)
        return rows

    def summary(self) -> str:
        limit = self.bodies[0].coordinate.limit_name
        ratio_columns = [{f"peak_over_{limit}": float(format_ratio(response))} for response in self.responses]
        rows = [row | ratio_column for row, ratio_column in zip(self.rows(), ratio_columns, strict=True)]
        titles = self._list_label_titles()
        titles |= {name.format(limit): title.format(limit) for name, title in _TABLE_COLUMNS.items()}
        if self.available_friction is not None:
            titles |= {_SLIDING_TIME: f"with friction {self.available_friction:g} slides at, s"}
        if any(row["processing"] for row in rows):
            titles = titles | {"processing": "done to the record"}
        table = format_table(list(titles.values()), [[row[name] for name in titles] for row in rows])
        return f"{self._format_headline()}\n\n{table}"

    def _format_headline(self) -> str:
        undecided_count = sum(
            item.ended_early or item.unfinished or not item.perturbed().is_decided for item in self.responses
        )
        undecided_text = f", undecided under {undecided_count}" if undecided_count else ""
        skipped_text = f"; {format_count(len(self.skipped), 'record')} skipped" if self.skipped else ""
        return super()._format_headline() + undecided_text + skipped_text

    def to_dict(self) -> dict[str, Any]:
        blocks = []
        for body in self.bodies:
            parameters = body.as_bodies().parameters().items()
            numbers = {add_unit(name, unit): values[0].tolist() for name, (values, unit) in parameters}
            blocks.append({"description": body.description, **getattr(body, "labels", {}), **numbers})
        entry: dict[str, Any] = {"block": blocks[0]} if len(blocks) == 1 else {"blocks": blocks}
        friction = {} if self.available_friction is None else {"available_friction": self.available_friction}
        return {**entry, **friction, "records": self.rows(), "skipped": dict(self.skipped)}


@dataclass(frozen=True, eq=False, repr=False)
class RuleComparison(BlocksUnderRecords):
    """Comparison of rules of thumb with simulations for blocks under several motions, computed by `check`.

    Attributes
    ----------
    ratios : tuple of mapping of str to float
        Ratio of demand to capacity by rule, for each motion.
    margins : tuple of float
        Reciprocal of the lowest factor on each motion that overturns the block, or NaN.
    block, records, responses, skipped
        One block or several, names of the motions and their simulated responses (for each block in turn), and reasons
        why records could not be read.

    See Also
    --------
    rocking.rules.compare_rules : Run the comparison.
    """

    ratios: tuple[Mapping[str, float], ...]
    margins: tuple[float, ...]

    @property
    def overturns_when_scaled_down(self) -> tuple[bool, ...]:
        """Whether the block stands under each motion, but overturns under the same motion scaled down."""
        pairs = zip(self.responses, self.margins, strict=True)
        return tuple(margin > 1.0 and not (response.overturned or response.unfinished) for response, margin in pairs)

    def rows(self) -> list[dict[str, Any]]:
        rows, labels = [], self._create_labels()
        columns = labels, self.responses, self.ratios, self.margins, self.overturns_when_scaled_down
        for label, response, ratios, margin, overturns_when_scaled_down in zip(*columns, strict=True):
            motion, factor = require_motion(response), 1.0 / margin
            verdict = format_brief_outcome(response, MOTION_PRECISION)
            if overturns_when_scaled_down:  # with more digits near 1
                verdict += f"; overturns at x {factor:.{2 if factor < 0.985 else 4}f}"
            rows.append(
                label
                | {
                    add_unit("pga", "g"): round_decimal(motion.pga / STANDARD_GRAVITY),
                    add_unit("pgv", "m/s"): motion.pgv,
                    **ratios,
                    "simulated": margin,
                    "lowest_factor": factor,
                    "peak_over_slenderness": response.peak_over_slenderness,
                    "overturned": response.overturned,
                    "overturns_when_scaled_down": overturns_when_scaled_down,
                    "verdict": verdict,
                }
            )
        return rows

    def summary(self) -> str:
        rules = [*self.ratios[0]]
        titles = self._list_label_titles()
        titles |= {"record": "record", add_unit("pga", "g"): "PGA, g", add_unit("pgv", "m/s"): "PGV, m/s"}
        titles |= {rule: format_rule_name(rule) for rule in rules}
        titles |= {"simulated": "simulated", "peak_over_slenderness": "peak/slenderness", "verdict": "outcome"}
        ratio_columns = [{"peak_over_slenderness": round_ratio(response)} for response in self.responses]
        rows = [row | ratio_column for row, ratio_column in zip(self.rows(), ratio_columns, strict=True)]
        # Rules of thumb are accurate to three digits at most.
        cells = [[float(f"{x:.3g}") if isinstance(x := row[name], float) else x for name in titles] for row in rows]
        table = format_table(list(titles.values()), cells)
        explanation = (
            "demand over capacity: from 1 on a rule predicts overturning; simulated: one over the lowest factor on the "
            "motion that was found to overturn the block, in steps of 5 %"
        )
        count_lines = ["", *self._count_disagreements(rules)] if rules else []
        notes = (f"note: {note}" for note in self._list_notes())
        heading = str(self.bodies[0]) if len(self.bodies) == 1 else self._format_headline()
        return "\n".join([heading, explanation, "", table, *count_lines, *notes])

    def to_dict(self) -> dict[str, Any]:
        return super().to_dict() | {"notes": self._list_notes()}

    def _list_notes(self) -> list[str]:
        return [] if all(body.as_bodies().is_symmetric for body in self.bodies) else [MIRROR_NOTE]

    def _format_headline(self) -> str:
        return f"{super()._format_headline()}; by {', '.join(self.ratios[0]) or 'no rule'}"

    def _count_disagreements(self, rules: list[str]) -> list[str]:
        """Count the errors of each rule, without records for which no single number can be right."""
        lines, is_excluded = [], self.overturns_when_scaled_down
        compared = [
            (ratios, response.overturned)
            for ratios, response, is_ambiguous in zip(self.ratios, self.responses, is_excluded, strict=True)
            if not (is_ambiguous or response.unfinished)
        ]
        count, total_count = len(compared), len(is_excluded)
        for rule in rules:
            unsafe_count = sum(ratios[rule] < 1.0 and overturned for ratios, overturned in compared)
            conservative_count = sum(ratios[rule] >= 1.0 and not overturned for ratios, overturned in compared)
            errors = f"unsafe {unsafe_count}, over-conservative {conservative_count} of {count}"
            lines.append(f"{format_rule_name(rule)}: right {count - unsafe_count - conservative_count}, {errors}")
        if any(is_excluded):
            reason = "where the block stands under the motion as it is, but falls under the same motion scaled down"
            lines.append(f"not counted: {sum(is_excluded)} of {total_count}, {reason}")
        if unfinished_count := sum(response.unfinished for response in self.responses):
            lines.append(f"not counted: {unfinished_count} of {total_count}, whose simulation was not finished")
        return lines


def format_rule_name(rule: str) -> str:
    """Format the usual name of a rule of thumb."""
    return "ASCE 43-05" if rule == "asce_43_05" else rule.capitalize()


def survey(
    block: Body | Sequence[Body],
    motions: Motions,
    *,
    available_friction: float | None = None,
    precision: float = MOTION_PRECISION,
    **options: Any,
) -> Survey:
    """Simulate a block, or each of several blocks, under many motions.

    Parameters
    ----------
    block, motions : optional
        As for `simulate_many`: one or more blocks, m motions. The table shows the keys of a mapping, or otherwise the
        names of the motions.
    available_friction : float, optional
        Coefficient of friction, to report when a block that never slips would slide.
    precision : float
        Relative precision of the motions, from 1e-6 to 0.1. Outcomes are also counted within this precision.
    **options : object
        As for `rocking.simulate`: model, chattering, duration, friction, ... A label ``friction`` of a block is its
        coefficient.

    Returns
    -------
    Survey
        All responses, with a table row for each.

    Raises
    ------
    OptionError
        As for `rocking.simulate`, or if there is no motion.
    MotionError
        If an element of `motions` is not a motion.

    See Also
    --------
    rocking.simulate_many : Simulate many blocks under many motions.
    rocking.rules.compare_rules : Compare rules of thumb with simulations.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.24, height=1.1)
    >>> result = survey(block, {"clc": rocking.records.load("ridgecrest-clc-090")})
    >>> len(result.responses)
    1
    """
    named_motions = index_motions(motions)
    bodies = [*block] if isinstance(block, Sequence) else [block]
    for body in bodies:
        if not require_body(body).coordinate.limit_name:
            message = "a survey requires a Block, because only a block has an unstable equilibrium"
            raise OptionError(f"{message}; got {type(body).__name__}")
    if available_friction is not None:
        check_available_friction(available_friction)
    responses, friction = [], options.get("friction")
    with Progress("simulating", total=len(bodies) * len(named_motions)) as bar:
        for body, motion in itertools.product(bodies, named_motions.values()):
            responses.append(simulate(body, motion, **{**options, "friction": find_friction(body, friction)}))
            # The response caches the expensive results while the progress bar is shown.
            _create_row(responses[-1], precision)
            bar.advance()
    return Survey(block, tuple(named_motions) * len(bodies), tuple(responses), available_friction, precision)


def create_folder_names(records: Sequence[str], responses: Sequence[Response] = ()) -> list[str]:
    """Create a unique folder name for each record, after the name of the block of its response."""
    names: dict[str, None] = {}
    blocks = [getattr(response.block, "labels", {}).get("name", "") for response in responses] or [""] * len(records)
    for block, record in zip(blocks, records, strict=True):
        # Names of pulses contain a colon, which some file systems do not allow.
        stem = Path(record).stem.replace(":", "-") if record != "-" else "standard-input"
        stem = f"{create_file_stem(str(block))}-{stem}" if block else stem
        alternatives = (f"{stem}-{k}" for k in range(2, len(records) + 2))
        names[stem if stem not in names else next(name for name in alternatives if name not in names)] = None
    return list(names)


def create_file_stem(name: str) -> str:
    """Replace characters of a name that a file system may not allow."""
    return re.sub(r"[^\w.+#-]+", "-", name).strip("-.") or "object"


def create_record_columns(records: Sequence[str], motions: Sequence[Motion]) -> list[dict[str, str]]:
    """Create columns with the requested name of each record, and the name of its motion as in other analyses."""
    columns = {"record": records, "motion": list_motion_names(motions)}
    columns |= {
        _add_attribute_unit(name, *rest): values for name, (_, values, *rest) in motion_coordinates(motions).items()
    }
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _add_attribute_unit(name: str, attributes: Mapping[str, str] = MappingProxyType({})) -> str:
    return add_unit(name, attributes.get("units", "1"))


def require_motion(response: Response) -> Motion:
    """Return the motion of a response that has one."""
    assert response.motion is not None
    return response.motion


def _create_row(response: Response, precision: float) -> dict[str, Any]:
    motion = require_motion(response)
    perturbed, within_precision = response.perturbed(), response.perturbed(*choose_factors(precision))
    return {
        add_unit("duration", "s"): motion.duration,
        add_unit("pga", "g"): round_decimal(motion.pga / STANDARD_GRAVITY),
        add_unit("pgv", "m/s"): motion.pgv,
        "processing": "; ".join(motion.history),
        "verdict": format_brief_outcome(response, precision),
        "overturned": response.overturned,
        "decided": perturbed.is_decided,
        "overturned_share": float(perturbed.overturned.mean()),
        "precision": precision,
        "overturned_share_at_precision": float(within_precision.overturned.mean()),
        "unfinished": response.unfinished,
        "ended_early": response.ended_early,
        "leans": response.leans,
        "ambiguous": response.ambiguous,
        add_unit("overturn_time", "s"): response.overturn_time,
        f"peak_over_{response.block.coordinate.limit_name}": response.peak_over_slenderness,
        add_unit("peak_rotation", "rad"): response.peak_rotation,
        add_unit("residual_rotation", "rad"): response.residual_rotation,
        add_unit("peak_time", "s"): response.peak_time,
        "impacts_resolved": len(response.impacts),
        "rests": int((response.events["kind"] == "rest").sum()),
        add_unit("time_at_rest", "s"): response.time_at_rest,
        "required_friction": math.nan if response.block.contact_law is None else response.required_friction,
    }
