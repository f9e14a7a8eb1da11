"""What is made of a complete study: fragility curves, a spectrum. It is kept beside the inputs, and is none of them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, get_args

from rocking import checks
from rocking.analysis.fragility.fit import OVERTURNING
from rocking.analysis.fragility.result import Fragility
from rocking.errors import InvalidOption, StudyError
from rocking.motion.scaling import IntensityName, Measure
from rocking.studies.fragility import BlockFragilities, block_fragilities, pooled_fragility
from rocking.studies.ratios import require_limits, require_ratios
from rocking.studies.spectrum import FRACTILES, StudySpectrum, study_spectrum
from rocking.studies.store import Store

#: What a report may hold: each with a summary, a figure and a table.
Made = Fragility | BlockFragilities | StudySpectrum

Whose = Literal["each", "together"]

_NAME = "report.json"


@dataclass(frozen=True)
class FragilityPlan:
    """Fragility curves that are wanted.

    Attributes
    ----------
    measure, period, damping
        Intensity, as for `rocking.fragility`.
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
    blocks: Whose = "each"
    confidence: float = 0.9

    def __post_init__(self) -> None:
        Measure(self.measure, self.period, self.damping)
        checks.share(self.confidence, "confidence", InvalidOption)
        if self.blocks not in get_args(Whose):
            raise InvalidOption(f"blocks must be one of {', '.join(get_args(Whose))}, not {self.blocks!r}")
        if not isinstance(self.limits, Mapping) or not self.limits:
            raise InvalidOption("limits must name limit states, as { overturning = inf, half = 0.5 }")
        for name, limit in self.limits.items():
            if not (isinstance(limit, (int, float)) and limit >= 0.0):
                raise InvalidOption(f"limits.{name} must be a rotation over slenderness or inf, not {limit!r}")

    def check(self, kept: Sequence[str]) -> None:
        """Check that the outcomes that a study keeps are enough.

        Parameters
        ----------
        kept : sequence of str
            Names of the outcomes.

        Raises
        ------
        InvalidOption
            If they are not; the message says what is missing.
        """
        require_limits(kept, self.limits)


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
        for value in checks.numbers(self.fractiles, "fractiles", InvalidOption).ravel():
            checks.share(float(value), "each of fractiles", InvalidOption)

    def check(self, kept: Sequence[str]) -> None:
        """Check that the outcomes that a study keeps are enough.

        Parameters
        ----------
        kept : sequence of str
            Names of the outcomes.

        Raises
        ------
        InvalidOption
            If they are not; the message says what is missing.
        """
        require_ratios(kept, "a spectrum")


@dataclass(frozen=True)
class ReportPlan:
    """All that is wanted."""

    fragility: FragilityPlan | None = None
    spectrum: SpectrumPlan | None = None


def keep(store: Store, plan: ReportPlan) -> None:
    """Store what is wanted beside the study, in place of what was."""
    data = json.dumps(asdict(plan), indent=2).encode()
    if store.place.get(_NAME) != data:
        store.place.put(_NAME, data)


def is_kept(store: Store) -> bool:
    """Whether anything is wanted of the results."""
    return store.place.get(_NAME) is not None


def kept(store: Store) -> ReportPlan:
    """Read what is wanted.

    Raises
    ------
    StudyError
        If nothing is, or it is damaged.
    """
    data = store.place.get(_NAME)
    if data is None:
        raise StudyError(
            f"{store.place}: the study says nothing of a report: add [report.fragility] to its file and create it again"
        )
    try:
        told: dict[str, Any] = json.loads(data)
        kinds = {"fragility": FragilityPlan, "spectrum": SpectrumPlan}
        return ReportPlan(**{name: kinds[name](**words) for name, words in told.items() if words is not None})
    except (ValueError, TypeError, KeyError, InvalidOption) as error:
        raise StudyError(f"{_NAME} is damaged ({error}): create the study again from its file") from None


def report(store: Store, plan: ReportPlan, progress: bool | None = None) -> dict[str, Made]:
    """Make all that is wanted, by name."""
    made: dict[str, Made] = {}
    if plan.fragility is not None:
        wanted = plan.fragility
        measure = Measure(wanted.measure, wanted.period, wanted.damping)
        if wanted.blocks == "together":
            made["fragility"] = pooled_fragility(store, measure, wanted.limits, wanted.confidence)
        else:
            made["fragility"] = block_fragilities(store, measure, wanted.limits, wanted.confidence, progress)
    if plan.spectrum is not None:
        made["spectrum"] = study_spectrum(store, plan.spectrum.fractiles)
    return made
