"""A figure of the paper, redrawn: its data, what the paper states about it in numbers, and its files."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rocking.errors import InvalidOption
from rocking.tables import whole_file, write_figure

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
    paper : float, str or None
        The paper's number or words, or what its formula gives for these parameters; None where it says nothing of them.
    here : float or str
        Ours.
    digits : int
        Significant digits worth writing.
    formula : str
        The formula of the paper that gives its number or words, "Eq. 76"; empty where they stand in the paper.
    """

    claim: str
    paper: float | str | None
    here: float | str
    digits: int = 7
    formula: str = ""

    @property
    def difference(self) -> float | None:
        """Ours minus the paper's; None where one of them is in words or the paper has none."""
        if isinstance(self.paper, float | int) and isinstance(self.here, float | int):
            return self.here - self.paper
        return None

    def shown(self) -> str:
        """One line: paper, here, difference; ours alone where the paper says nothing."""
        _, here, difference = self.cells()
        if self.paper is None:
            return here
        source = f"by {self.formula}" if self.formula else "in the paper"
        return f"{self._written(self.paper)} {source}, {here} here{difference and f', {difference}'}"

    def cells(self) -> tuple[str, str, str]:
        """Paper, here and difference as texts; the first is empty where the paper says nothing."""
        paper = "" if self.paper is None else self._written(self.paper)
        difference = "" if self.difference is None else f"{self.difference:+.2g}"
        return f"{paper}, {self.formula}" if self.formula else paper, self._written(self.here), difference

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
    conditions : str
        The parameters that it is drawn for, with their values; empty where it depends on none.
    tables : mapping of str to table
        All that is drawn; each is written as a CSV file of its own.
    statements : tuple of Statement
        What the paper states about it in numbers, beside ours.
    drawings : mapping of str to callable
        What draws it, by name; the first is what `draw` draws unless told otherwise.
    """

    number: int
    title: str
    conditions: str
    tables: Mapping[str, Table]
    statements: tuple[Statement, ...]
    drawings: Mapping[str, Callable[[], Figure]]

    def __repr__(self) -> str:
        conditions = f" ({self.conditions})" if self.conditions else ""
        contents = f"tables: {', '.join(self.tables) or 'none'}; {len(self.statements)} statements"
        return f"<PaperFigure {self.number}: {self.title}{conditions}; {contents}>"

    @property
    def caption(self) -> str:
        """Number, title and conditions."""
        return f"Fig. {self.number}: {self.title}{self.conditions and f'; {self.conditions}'}"

    def draw(self, drawing: str | None = None) -> Figure:
        """Draw it.

        Parameters
        ----------
        drawing : str, optional
            Which of its `drawings`, by name; by default the first.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InvalidOption
            If there is none of that name.
        """
        chosen = next(iter(self.drawings)) if drawing is None else drawing
        if chosen not in self.drawings:
            raise InvalidOption(f"Fig. {self.number} is drawn as {' or '.join(self.drawings)}, not as {drawing!r}")
        return self.drawings[chosen]()

    def write(self, folder: str | Path) -> tuple[Path, ...]:
        """Write all drawings as PDF and PNG and the data as CSV into a folder that exists; the files' paths.

        Raises
        ------
        OutputError
            If a file cannot be written.
        """
        target = Path(folder)
        tables = {target / f"{self._stem}-{name}.csv": table for name, table in self.tables.items()}
        paths: list[Path] = []
        for k, name in enumerate(self.drawings):
            paths += self._write_drawing(target, f"{self._stem}-{name}" if k else self._stem, self.draw(name))
        for path, table in tables.items():
            _write_table(path, table)
        return (*paths, *tables)

    @property
    def _stem(self) -> str:
        return f"figure-{self.number}"

    def _write_drawing(self, folder: Path, stem: str, drawing: Figure) -> tuple[Path, Path]:
        pdf, png = folder / f"{stem}.pdf", folder / f"{stem}.png"
        # Without a date the files of two runs are the same.
        write_figure(pdf, drawing, metadata={"CreationDate": None})
        write_figure(png, drawing, dpi=_DOTS_PER_INCH)
        return pdf, png


def _write_table(path: Path, table: Table) -> None:
    with whole_file(path) as beside, beside.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(table)
        writer.writerows(zip(*([_cell(value) for value in column] for column in table.values()), strict=True))


def _cell(value: np.generic) -> str:
    return f"{value:.12g}" if isinstance(value, np.floating) else str(value)
