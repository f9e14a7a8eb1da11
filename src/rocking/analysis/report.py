"""What an analysis returns where it is no dataset: words, a dictionary, tables, a figure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rocking import checks
from rocking.errors import InvalidOption
from rocking.tables import write_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class Drawn(ABC):
    """What draws itself; `_draw` says how."""

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        """Draw what was found.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw, of several panels the main one alone; by default in a new figure with all panels.
        title : str
            Title; by default what was simulated or observed.
        figsize : (float, float), optional
            Width and height of a new figure, inches.

        Returns
        -------
        matplotlib.figure.Figure
            The new figure, or that of `ax`.

        Raises
        ------
        InvalidOption
            If the size is not two positive numbers, or `ax` is no axes.
        """
        return self._draw(ax, title, figsize)

    @abstractmethod
    def _draw(self, ax: Axes | None, title: str, figsize: tuple[float, float] | None) -> Figure:
        """Draw what was found; an empty title stands for the default one."""


class Report(Drawn):
    """What was found, in words, by name, and in a figure."""

    @abstractmethod
    def summary(self) -> str:
        """Return what was found, in words and a table."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return what was found by name; units are in the names, or SI."""


class Tabled(Report):
    """A report with tables, one row for each point, in columns named with their units."""

    #: Names of the tables, the default one first.
    TABLES: ClassVar[tuple[str, ...]]

    @abstractmethod
    def _frame(self, table: str) -> pd.DataFrame:
        """Return a table by its name."""

    def to_dataframe(self, table: str | None = None) -> pd.DataFrame:
        """Return one of the tables as a data frame.

        Parameters
        ----------
        table : str, optional
            One of `TABLES`; by default the first.

        Returns
        -------
        pandas.DataFrame
            Columns are named with their units.

        Raises
        ------
        InvalidOption
            If there is no such table.
        """
        name = self.TABLES[0] if table is None else table
        return self._frame(checks.one_of(name, "table", InvalidOption, self.TABLES))

    def to_csv(self, path: str | Path, table: str | None = None) -> None:
        """Write one of the tables of `to_dataframe` as text columns with a header.

        Parameters
        ----------
        path : str or Path
            File to write.
        table : str, optional
            One of `TABLES`; by default the first.

        Raises
        ------
        InvalidOption
            If there is no such table.
        OutputError
            If the file cannot be written.
        """
        write_text(path, self.to_dataframe(table).to_csv(index=False, float_format="%.10g", lineterminator="\n"))
