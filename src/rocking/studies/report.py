"""The report of a study: what is wanted of it, and how that is made."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Final, Literal

from rocking import checks
from rocking.analysis.fragility.fit import OVERTURNING
from rocking.analysis.fragility.result import Fragility
from rocking.errors import InvalidOption, Message, StudyError, Unfitted
from rocking.motion.scaling import INTENSITIES, IntensityName, Measure
from rocking.progress import note
from rocking.studies.folder import Folder
from rocking.studies.fragility import BlockFragilities, block_fragilities, pooled_fragility
from rocking.studies.spectrum import (
    FRACTILES,
    StudySpectrum,
    checked_fractiles,
    require_limits,
    require_ratios,
    study_spectrum,
)
from rocking.studies.store import Store

#: What a report may hold: each with a summary, a figure and a table.
ReportPart = Fragility | BlockFragilities | StudySpectrum

_REPORT: Final = "report.json"


@dataclass(frozen=True)
class FragilityPlan:
    """Fragility curves that are wanted.

    Attributes
    ----------
    measure : str
        Intensity, as for `rocking.fragility`.
    period : float or None
        Period of a spectral acceleration, s.
    damping : float
        Its fraction of critical damping.
    limits : mapping of str to float
        Limit states: peak rotation over slenderness that is exceeded, or infinity for overturning.
    blocks : {"each", "together"}
        A curve for each block, or one for all.
    confidence : float
        Probability of the intervals.

    Raises
    ------
    InvalidOption
        If one of them is out of its range.
    """

    measure: IntensityName = "pga"
    period: float | None = None
    damping: float = 0.05
    limits: Mapping[str, float] = field(default_factory=lambda: dict(OVERTURNING))
    blocks: Literal["each", "together"] = "each"
    confidence: float = 0.9

    def __post_init__(self) -> None:
        checks.one_of(self.measure, "measure", InvalidOption, INTENSITIES)
        Measure(self.measure, self.period, self.damping)
        checks.share(self.confidence, "confidence", InvalidOption)
        checks.one_of(self.blocks, "blocks", InvalidOption, ["each", "together"])
        for name, limit in checks.mapping(self.limits, "limits", InvalidOption, '{"overturning": inf}').items():
            if not (isinstance(limit, (int, float)) and limit >= 0.0):
                raise InvalidOption(
                    f"{{}}.{name} must be a rotation over slenderness or inf, not {checks.shown(limit)}",
                    "limits",
                    value=limit,
                )


@dataclass(frozen=True)
class SpectrumPlan:
    """Fractiles that are wanted.

    Attributes
    ----------
    fractiles : sequence of float
        Shares of the motions, in (0, 1), that stay below.

    Raises
    ------
    InvalidOption
        If one is out of its range.
    """

    fractiles: Sequence[float] = FRACTILES

    def __post_init__(self) -> None:
        checked_fractiles(self.fractiles)


#: Plans by the names of the parts of a report.
PLANS: Final[Mapping[str, type[FragilityPlan | SpectrumPlan]]] = {"fragility": FragilityPlan, "spectrum": SpectrumPlan}


@dataclass(frozen=True)
class ReportPlan:
    """All that is wanted.

    Attributes
    ----------
    fragility : FragilityPlan or None
        Fragility curves.
    spectrum : SpectrumPlan or None
        Fractiles of the peak rotation.
    """

    fragility: FragilityPlan | None = None
    spectrum: SpectrumPlan | None = None


def check_part(plan: FragilityPlan | SpectrumPlan, kept: Sequence[str]) -> None:
    """Raise an InvalidOption unless these outcomes, which a study keeps, are enough for a part of a report."""
    if isinstance(plan, FragilityPlan):
        require_limits(kept, plan.limits)
    else:
        require_ratios(kept, "a spectrum")


def made_report(store: Store, progress: bool | None) -> dict[str, ReportPart]:
    """Make all that is wanted of a complete study, by name."""
    plan = kept_report(store.folder)
    if plan is None or plan == ReportPlan():
        raise StudyError(
            "the study says nothing of a report: add [report.fragility] to its file and create it again",
            path=str(store.folder),
        )
    found: dict[str, ReportPart] = {}
    refused: Unfitted | None = None
    if (curves := plan.fragility) is not None:
        measure = Measure(curves.measure, curves.period, curves.damping)
        try:
            found["fragility"] = (
                pooled_fragility(store, measure, curves.limits, curves.confidence)
                if curves.blocks == "together"
                else block_fragilities(store, measure, curves.limits, curves.confidence, progress)
            )
        except Unfitted as error:
            refused = error
    if plan.spectrum is not None:
        found["spectrum"] = study_spectrum(store, plan.spectrum.fractiles, progress)
    if refused is not None:
        if not found:
            raise refused
        note(Message(f"fragility left out: {refused.message.template}", refused.message.arguments))
    return found


def keep_report(folder: Folder, plan: ReportPlan) -> None:
    """Store what is wanted beside the study, in place of what was."""
    folder.keep(_REPORT, json.dumps(asdict(plan), indent=2).encode())


def kept_report(folder: Folder) -> ReportPlan | None:
    """Read what is wanted; None if nothing is, a StudyError if it is damaged."""
    data = folder.get(_REPORT)
    if data is None:
        return None
    try:
        given = {name: words for name, words in json.loads(data).items() if words is not None}
        plans: dict[str, Any] = {name: PLANS[name](**words) for name, words in given.items()}
        return ReportPlan(**plans)
    except (ValueError, TypeError, KeyError, AttributeError, InvalidOption) as error:
        raise StudyError(f"{_REPORT} is damaged ({error}): create the study again from its file") from None
