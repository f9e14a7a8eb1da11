"""What a calibration does not know: too few candidates, runs that disagree, a posterior that leans on a bound."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from rocking.analysis.calibration import population
from rocking.analysis.calibration.search import AGREEMENT, RUNS, Search
from rocking.analysis.calibration.space import HIGHEST, Space, unit_of
from rocking.arrays import Floats
from rocking.tables import counted

#: A posterior leans on a bound if more than this share of it, what lies beyond one end of an estimate's interval, is
#: within the outermost part of the range, in the logarithm: then the interval ends where the bound is.
_OUTERMOST: Final = 0.05
_LEANING: Final = 0.05

#: Fewer effective candidates than these do not tell what a population does.
_FEW: Final = 20.0


@dataclass(frozen=True)
class Leaning:
    """A parameter whose posterior leans on a bound.

    Attributes
    ----------
    name : str
        The estimate.
    end : {"lower", "upper"}
        Which bound.
    bound : float
        Where it is, in the parameter's unit.
    wider : float
        A bound that leaves more room.
    share : float
        Share of the posterior in the outermost 5 % of the range.
    """

    name: str
    end: str
    bound: float
    wider: float
    share: float

    def __str__(self) -> str:
        """Say so, and how to mend it."""
        unit = unit_of(self.name)
        bound = f"{self.bound:g}" + ("" if unit == "1" else f" {unit}")
        return (
            f"{self.name} leans on its {self.end} bound of {bound}: {100 * self.share:.0f} % of the posterior lies in "
            f"the outermost {100 * _OUTERMOST:.0f} % of the range, so that the bound sets the {self.end} end of the "
            "interval; unless you know that bound, "
            f"set that of {self.name.partition('_')[0]} to {self.wider:g}"
        )


@dataclass(frozen=True)
class Diagnostics:
    """How far a calibration can be trusted.

    Attributes
    ----------
    candidates : int
        Blocks that were simulated under every motion.
    effective : float
        How many of them, effectively, tell what a typical population of the posterior does.
    agreement : mapping of str to float
        R-hat of each estimate between independent runs: 1 where they agree, above 1.1 where they do not.
    leaning : tuple of Leaning
        Estimates that lean on a bound.
    """

    candidates: int
    effective: float
    agreement: Mapping[str, float]
    leaning: tuple[Leaning, ...]

    @classmethod
    def of(cls, found: Search, posterior: Floats) -> Diagnostics:
        """Look at a search, and at the draws of its posterior."""
        space = found.evidence.candidates.space
        return cls(
            len(found.evidence.candidates.points),
            float(np.median(found.evidence.effective(posterior))),
            found.agreement,
            leaning(space, population.unpacked(posterior)[0]),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What is to be known before the estimates are believed, a sentence each; none where all is well."""
        notes = [f"{one}" for one in self.leaning]
        apart = [f"{name} ({value:.2f})" for name, value in self.agreement.items() if value > AGREEMENT]
        if apart:
            held = "the estimates weigh what both found; double the candidates, or narrow the bounds to what you know"
            notes.append(f"independent runs disagree (R-hat) on {', '.join(apart)}: {held}")
        if self.effective < _FEW:
            few = f"only {counted(round(self.effective), 'candidate')} can tell what a typical population does"
            notes.append(f"{few}: double the candidates, or narrow the bounds to what you know")
        return tuple(notes)

    def __str__(self) -> str:
        """Say how the search went, then the notes."""
        search = (
            f"{counted(self.candidates, 'candidate')}, {self.effective:.0f} effective for a typical population; {RUNS} "
            f"independent runs, R-hat at most {max(self.agreement.values()):.2f}"
        )
        return "\n".join([search, *(f"note: {sentence}" for sentence in self.notes)])

    def to_dict(self) -> dict[str, Any]:
        """Numbers and notes by name."""
        return {
            "candidates": self.candidates,
            "effective": self.effective,
            "agreement": dict(self.agreement),
            "leaning": [asdict(one) for one in self.leaning],
            "notes": list(self.notes),
        }


def leaning(space: Space, centres: Floats) -> tuple[Leaning, ...]:
    """Estimates whose interval ends where a bound is, from draws of the population's centre."""
    found = []
    for name, values in space.named(centres).items():
        parameter = name.partition("_")[0]
        if parameter not in space.unknown:
            continue
        k = space.unknown.index(parameter)
        low, high = float(space.lower[k]), float(space.upper[k])
        edge = _OUTERMOST * (high - low)
        wider = min(2.0 * math.exp(high), HIGHEST[parameter])
        ends = [
            ("lower", low, 0.5 * math.exp(low), np.log(values) < low + edge),
            ("upper", high, wider, np.log(values) > high - edge),
        ]
        for end, bound, further, near in ends:
            share = float(near.mean())
            # A bound that no block can exceed needs no room beyond it.
            if share > _LEANING and bound < math.log(HIGHEST[parameter]) - 1e-9:
                found.append(Leaning(name, end, math.exp(bound), further, share))
    return tuple(found)
