"""What a promise is, and what a part of its cases has shown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

#: Parts of the package above single simulations and ensembles.
ABOVE_ENSEMBLES = ("cli", "explorer", "studies", "analysis", "chattering", "dynamics")

#: And kernels that no simulation with certified chattering calls: of periodic motion and sines.
OF_NO_SIMULATION = (*ABOVE_ENSEMBLES, "kernels/periodic.py", "kernels/sine")

#: Failures of a part that are told in words; all are counted.
MOST_TOLD = 20


@dataclass
class Found:
    """Counts of some parts.

    ``worst`` is the largest error over what was promised; ``notes`` are further counts, by name.
    """

    parts: int = 0
    cases: int = 0
    judged: int = 0
    failures: int = 0
    worst: float = 0.0
    seconds: float = 0.0
    told: list[str] = field(default_factory=list)
    notes: Counter[str] = field(default_factory=Counter)

    def add(self, other: Found) -> None:
        """Take in what other parts have shown."""
        for name, value in vars(other).items():
            mine = getattr(self, name)
            setattr(self, name, max(mine, value) if name == "worst" else mine + value)

    def fail(self, told: str) -> None:
        """Count a failure, and keep its words if there are few."""
        self.failures += 1
        if len(self.told) < MOST_TOLD:
            self.told.append(told)

    @classmethod
    def of(cls, kept: dict[str, Any]) -> Found:
        """Read what was kept of a part."""
        return cls(**{**kept, "notes": Counter(kept["notes"])})


class Table(Protocol):
    """A promise's own table, in Markdown."""

    def __call__(self, found: Found) -> str: ...


@dataclass(frozen=True)
class Promise:
    """A promise, and the program that holds the package to it.

    Attributes
    ----------
    name : str
        Of the command line and of files.
    says : str
        Title in the table.
    parts, small : int
        Parts of the full run, and of a quick look. Part k is the same in both.
    judge : callable
        Judges part k.
    least : float
        Share of the cases that must be decided, and so judged; less is a failure of the program.
    table : callable, optional
        Makes a table of its own from all parts.
    above : tuple of str
        Files and folders of the package above all that is judged: their sources change no answer, as the import
        contracts say.
    """

    name: str
    says: str
    parts: int
    small: int
    judge: Callable[[int], Found]
    least: float = 1.0
    table: Table | None = None
    above: tuple[str, ...] = ()

    def faults(self, found: Found) -> list[str]:
        """Say what is not as promised, in sentences."""
        few = [f"{self.name}: only {found.judged} of {found.cases} cases were decided"]
        return [f"{self.name}: {told}" for told in found.told] + few * (found.judged < self.least * found.cases)
