"""A block under records: rules of thumb compared with simulations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from rocking import checks
from rocking.analysis.incremental import incremental_dynamic_analysis
from rocking.analysis.levels import MIRROR_NOTE, values_of
from rocking.analysis.rules.criteria import TITLES, rate
from rocking.analysis.survey import BlockUnderRecords, motion_of
from rocking.block import Block
from rocking.constants import STANDARD_GRAVITY, Model
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.motion.named import Motions, motions_by_name
from rocking.motion.scaling import Measure
from rocking.progress import Progress
from rocking.response import PRECISION, Response, in_brief, known_ratio
from rocking.simulation import simulate
from rocking.tables import decimal, named, text_table

#: Width, relative to it, of the level that overturns first: a margin is read to three digits.
_TOLERANCE: Final = 1e-4

#: From so much on, a factor below 1 is shown to four digits.
_NEAR: Final = 0.985


@dataclass(frozen=True, eq=False, repr=False)
class Check(BlockUnderRecords):
    """Rules of thumb compared with simulations, for a block under several motions; from `check`.

    Attributes
    ----------
    ratios : tuple of mapping of str to float
        For each motion, demand over capacity by each rule.
    margins : tuple of float
        For each motion, one over the lowest factor on it at which the block is found to overturn. NaN if it overturns
        at none. Above 1 the block need not overturn under the motion as it is: see `falls_under_less`.
    block, records, responses, skipped
        The block, the name of each motion, the simulated response to each, and why records could not be read.
    """

    ratios: tuple[Mapping[str, float], ...]
    margins: tuple[float, ...]

    @property
    def falls_under_less(self) -> tuple[bool, ...]:
        """Whether the block stands under each motion as it is, and falls under the same motion times less than 1.

        A stronger motion need not overturn what a weaker one does: no single number can be right there.
        """
        each = zip(self.responses, self.margins, strict=True)
        return tuple(margin > 1.0 and not (one.overturned or one.unfinished) for one, margin in each)

    def rows(self) -> list[dict[str, Any]]:
        return [
            {
                **label,
                named("pga", "g"): decimal(motion_of(response).pga / STANDARD_GRAVITY),
                named("pgv", "m/s"): motion_of(response).pgv,
                **ratios,
                "simulated": margin,
                "lowest_factor": 1.0 / margin,
                "peak_over_slenderness": response.peak_over_slenderness,
                "overturned": response.overturned,
                "falls_under_less": less,
                "verdict": _verdict(response, margin, falls_under_less=less),
            }
            for label, response, ratios, margin, less in zip(
                self._labels(), self.responses, self.ratios, self.margins, self.falls_under_less, strict=True
            )
        ]

    def summary(self) -> str:
        rules = [*self.ratios[0]]
        shown = {
            "record": "record",
            named("pga", "g"): "PGA, g",
            named("pgv", "m/s"): "PGV, m/s",
            **{rule: TITLES[rule] for rule in rules},
            "simulated": "simulated",
            "peak_over_slenderness": "peak/slenderness",
            "verdict": "outcome",
        }
        known = [{"peak_over_slenderness": known_ratio(response)} for response in self.responses]
        rows = [row | each for row, each in zip(self.rows(), known, strict=True)]
        table = text_table(list(shown.values()), [[_short(row[name]) for name in shown] for row in rows])
        return "\n".join(
            [
                str(self.block),
                "demand over capacity: from 1 on a rule predicts overturning; simulated: one over the lowest factor on "
                "the motion that was found to overturn the block, in steps of 5 %",
                "",
                table,
                *(["", *self._disagreements(rules)] if rules else []),
                *(f"note: {note}" for note in self._notes()),
            ]
        )

    def to_dict(self) -> dict[str, Any]:
        return super().to_dict() | {"notes": self._notes()}

    def _notes(self) -> list[str]:
        return [] if self.block.alone().is_symmetric else [MIRROR_NOTE]

    def _headline(self) -> str:
        return f"{super()._headline()}; by {', '.join(self.ratios[0]) or 'no rule'}"

    def _disagreements(self, rules: list[str]) -> list[str]:
        """Say of each rule how often it is wrong, and how; where no number can be right, none is counted."""
        lines = []
        less = self.falls_under_less
        for rule in rules:
            said = [
                (ratios[rule] >= 1.0, response.overturned)
                for ratios, response, is_left_out in zip(self.ratios, self.responses, less, strict=True)
                if not (is_left_out or response.unfinished)
            ]
            unsafe = sum(not yes and real for yes, real in said)
            wary = sum(yes and not real for yes, real in said)
            right = len(said) - unsafe - wary
            lines.append(f"{TITLES[rule]}: right {right}, unsafe {unsafe}, over-conservative {wary} of {len(said)}")
        if any(less):
            lines.append(
                f"not counted: {sum(less)} of {len(less)}, where the block stands under the motion as it is, but falls "
                "under the same motion scaled down"
            )
        if unfinished := sum(response.unfinished for response in self.responses):
            lines.append(f"not counted: {unfinished} of {len(less)}, whose simulation was not finished")
        return lines


def check(
    block: Block,
    motions: Motions,
    *,
    rules: Iterable[str] | None = None,
    model: Model = "nonlinear",
    threads: int | None = None,
    progress: bool | None = None,
) -> Check:
    """Apply rules of thumb to a block under motions, and simulate the block.

    Parameters
    ----------
    block : Block
        What rocks.
    motions : Motion, sequence of Motion, or mapping of str to Motion
        m motions; the table shows the names of a mapping, or else the motions' own.
    rules : iterable of str, optional
        Names in `RULES`; by default all.
    model : {"nonlinear", "linear"}
        Equation of motion of the simulations.
    threads : int, optional
        Number of threads; by default one for every core.
    progress : bool, optional
        Whether to draw a progress bar; by default if stderr is a terminal and the work takes long.

    Returns
    -------
    Check
        Demand over capacity by each rule, and the simulated margin.

    Raises
    ------
    InvalidOption
        If there is no motion, or no rule of a name, or the block never comes to rest (restitution 1).
    InvalidBlock, InvalidMotion
        As the rules, and if a motion is zero throughout.

    Notes
    -----
    The simulated margin comes from `incremental_dynamic_analysis`, whose levels are 5 % apart: a thinner band of levels
    that overturn may lie below it. The factor that overturns is known to 1e-4. Where 1 is within that of it, the
    response to the motion as it is decides on which side of 1 the margin is.

    Examples
    --------
    >>> import rocking
    >>> tombstone = rocking.Block(width=0.3, height=0.9)
    >>> records = {name: rocking.records.load(name) for name in ["el-centro-meloland-270", "el-centro-meloland-360"]}
    >>> found = check(tombstone, records, rules=["west", "ishiyama"])
    >>> for row in found.rows():
    ...     print(f"{row['west']:.2f} {row['ishiyama']:.2f} {row['simulated']:.2f} {row['verdict']}")
    0.90 0.90 0.71 does not move in 5 of 5 (3e-6), 11 of 11 (0.1 %)
    0.93 0.93 0.64 does not move in 5 of 5 (3e-6), 11 of 11 (0.1 %)
    """
    named_motions = motions_by_name(motions)
    names = None if rules is None else checks.several(rules, "rules", InvalidOption)
    # What is refused is refused before the work.
    values_of([*named_motions.values()], Measure("pga"))
    ratios = [
        {name: float(rating.ratio[0]) for name, rating in rate(block, motion, names).items()}
        for motion in named_motions.values()
    ]
    responses, margins = [], []
    with Progress("checking", total=len(named_motions), show=progress) as bar:
        for motion in named_motions.values():
            responses.append(simulate(block, motion, model=model))
            margins.append(_margin(responses[-1], block, motion, model, threads))
            bar.advance()
    return Check(block, tuple(named_motions), tuple(responses), tuple(ratios), tuple(margins))


def _margin(response: Response, block: Block, motion: Motion, model: Model, threads: int | None) -> float:
    """One over the lowest factor on the motion that overturns the block, on the side of 1 that the response tells."""
    scaled = incremental_dynamic_analysis(
        block, motion, model=model, tolerance=_TOLERANCE, threads=threads, progress=False
    )
    margin = motion.pga / float(scaled.overturning_level[0, 0])
    if response.overturned:
        return float(np.fmax(margin, 1.0))  # it may be beyond all levels that were looked at
    # The level is the middle of a bracket: where that holds the motion itself, which stands, the change lies above it.
    is_near = 1.0 <= margin <= 1.0 + _TOLERANCE and not response.unfinished
    return float(np.nextafter(1.0, 0.0)) if is_near else margin


def _verdict(response: Response, margin: float, *, falls_under_less: bool) -> str:
    outcome, factor = in_brief(response, PRECISION), 1.0 / margin
    text = f"{factor:.2f}" if factor < _NEAR else f"{factor:.4f}"
    return f"{outcome}; overturns at x {text}" if falls_under_less else outcome


def _short(entry: Any) -> Any:
    """Numbers to three digits: no rule of thumb is better than that."""
    return float(f"{entry:.3g}") if isinstance(entry, float) else entry
