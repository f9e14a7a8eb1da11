"""A figure of the paper, redrawn: its data, what the paper states about it in numbers, and its files."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rocking.errors import OutputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Columns of equal length by name; a name ends in its unit where there is one.
Table = Mapping[str, NDArray[np.generic]]

_DOTS_PER_INCH: Final = 200


@dataclass(frozen=True)
class Statement:
    """What the paper states, and what is computed here.

    Attributes
    ----------
    claim : str
        What is stated.
    paper : float or str
        The paper's number or words.
    here : float or str
        Ours.
    digits : int
        Significant digits worth writing.
    """

    claim: str
    paper: float | str
    here: float | str
    digits: int = 7

    @property
    def difference(self) -> float | None:
        """Ours minus the paper's; None where one of them is in words."""
        if isinstance(self.paper, str) or isinstance(self.here, str):
            return None
        return self.here - self.paper

    def shown(self) -> str:
        """One line: paper, here, difference."""
        paper, here, difference = self.cells()
        return f"{paper} in the paper, {here} here{difference and f', {difference}'}"

    def cells(self) -> tuple[str, str, str]:
        """Paper, here and difference as texts."""
        difference = "" if self.difference is None else f"{self.difference:+.2g}"
        return self._written(self.paper), self._written(self.here), difference

    def _written(self, value: float | str) -> str:
        return value if isinstance(value, str) else f"{value:.{self.digits}g}"


@dataclass(frozen=True, eq=False)
class PaperFigure:
    """One figure of the paper, computed.

    Attributes
    ----------
    number : int
        Its number in the paper.
    title : str
        What it shows.
    tables : mapping of str to table
        All that is drawn; each is written as a CSV file of its own.
    statements : tuple of Statement
        What the paper states about it in numbers, beside ours.
    draw : callable
        Draws it.
    """

    number: int
    title: str
    tables: Mapping[str, Table]
    statements: tuple[Statement, ...]
    draw: Callable[[], Figure]

    def write(self, folder: str | Path) -> tuple[Path, ...]:
        """Write the figure as PDF and PNG and its data as CSV into a folder that exists; the files' paths.

        Raises
        ------
        OutputError
            If a file cannot be written.
        """
        target = Path(folder)
        names = [f"figure-{self.number}.pdf", f"figure-{self.number}.png"]
        names += [f"figure-{self.number}-{name}.csv" for name in self.tables]
        paths = tuple(target / name for name in names)
        drawing = self.draw()
        try:
            # Without a date the files of two runs are the same.
            drawing.savefig(paths[0], metadata={"CreationDate": None})
            drawing.savefig(paths[1], dpi=_DOTS_PER_INCH)
            for path, table in zip(paths[2:], self.tables.values(), strict=True):
                _write_table(path, table)
        except OSError as error:
            raise OutputError(f"{target} cannot be written to: {error.strerror}; choose another folder") from error
        return paths


def _write_table(path: Path, table: Table) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(table)
        writer.writerows(zip(*([_cell(value) for value in column] for column in table.values()), strict=True))


def _cell(value: np.generic) -> str:
    return f"{value:.12g}" if isinstance(value, np.floating) else str(value)
