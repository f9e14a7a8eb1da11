"""What was found: in words, as plain values, as tables and as a figure; analyses add a dataset with labels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import numpy as np

from rocking import checks
from rocking.errors import InvalidOption
from rocking.tables import data_frame, named, plain, text_table, write_csv, write_netcdf

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Rows of a table for people.
_SHOWN = 12


class Row(NamedTuple):
    """One statement: a line of a summary, or an entry of a dictionary.

    Attributes
    ----------
    name : str
        What it is about: words in a summary, the name of a quantity in a dictionary.
    value : object
        Its value; in a summary a text with the digits that are known.
    unit : str
        Unit of the value, "1" where it has none.
    note : str
        What a summary adds, with the mark that separates it from the value.

    Examples
    --------
    >>> Row("peak rotation", "0.05", "rad", " at 1.2 s").text
    '0.05 rad at 1.2 s'
    """

    name: str
    value: Any
    unit: str = "1"
    note: str = ""

    @property
    def text(self) -> str:
        """Value, unit and note."""
        return f"{self.value}{'' if self.unit == '1' else f' {self.unit}'}{self.note}"


def text_of(rows: Iterable[Row], width: int) -> str:
    """Return rows as lines: names in a column of so many letters, then value, unit and note."""
    return "\n".join(f"{row.name:<{width}}{row.text}" for row in rows)


def dictionary_of(rows: Iterable[Row]) -> dict[str, Any]:
    """Return rows as plain values by name, units in the names; None for what is not a finite number.

    Examples
    --------
    >>> dictionary_of([Row("period", 0.5, "s"), Row("rotation", np.array([0.1, np.nan]), "rad")])
    {'period_s': 0.5, 'rotation_rad': [0.1, None]}
    """
    return {named(row.name, row.unit): plain(row.value) for row in rows}


class Findings:
    """Base of results: from rows follow the summary and the dictionary, from a table its file, from `_draw` the figure.

    A subclass gives `summary_rows`, `facts`, `to_dataframe` and `_draw`, those that it has.
    """

    #: Letters of the column of names in a summary.
    WIDTH: ClassVar[int] = 20

    def summary_rows(self) -> Sequence[Row]:
        """Return what was found, for people: the lines of `summary`."""
        raise NotImplementedError

    def facts(self) -> Sequence[Row]:
        """Return what was found, for machines: the entries of `to_dict`."""
        raise NotImplementedError

    def summary(self) -> str:
        """Return what was found in words, line by line."""
        return text_of(self.summary_rows(), self.WIDTH)

    def to_dict(self) -> dict[str, Any]:
        """Return what was found as plain values by name: units are in the names, None is no finite number."""
        return dictionary_of(self.facts())

    def to_dataframe(self) -> pd.DataFrame:
        """Return the table as a data frame, columns named with their units."""
        raise NotImplementedError

    def to_csv(self, path: str | Path) -> None:
        """Write the table of `to_dataframe` as text columns with a header; "inf" stands for infinity.

        Parameters
        ----------
        path : str or pathlib.Path
            File to write, whole or not at all.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        write_csv(path, self.to_dataframe())

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        """Draw what was found.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; by default in a new figure.
        title : str
            Title; by default one that says what is drawn.
        figsize : (float, float), optional
            Width and height of a new figure, inches.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InvalidOption
            If the size is not two positive numbers, or `ax` are no axes.
        """
        return self._draw(ax, title, figsize)

    def _draw(self, ax: Axes | None, title: str, figsize: tuple[float, float] | None) -> Figure:
        """Draw what was found; an empty title stands for the default one."""
        raise NotImplementedError

    def _headline(self) -> str:
        """Return what was found in one line, for the representation."""
        return self.summary().splitlines()[0]

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._headline()}>"


@dataclass(frozen=True, eq=False, repr=False)
class Result(Findings):
    """Result of an analysis. The variables, coordinates and methods of its dataset are its own as well.

    Attributes
    ----------
    data : xarray.Dataset
        All numbers, with units and meaning of each variable.
    TABLES : mapping of str to tuple of str
        Tables that `to_dataframe` and `to_csv` know, the first by default, and the variables of each.
    """

    TABLES: ClassVar[Mapping[str, tuple[str, ...]]]

    data: xr.Dataset

    def select(self, **labels: Any) -> Self:
        """Return the part at some labels of its dimensions, which are all kept.

        Parameters
        ----------
        **labels
            Label or labels for each dimension, as ``alpha=0.2`` or ``motion=["a", "b"]``; the nearest of numbers.

        Raises
        ------
        InvalidOption
            If there is no such dimension or label.
        """
        wanted = {name: np.atleast_1d(values) for name, values in labels.items()}
        data = self.data
        try:
            for name, values in wanted.items():
                numeric = data[name].dtype.kind == "f"
                at = checks.numbers(values, name, InvalidOption) if numeric else values
                data = data.sel({name: at}, method="nearest" if numeric else None)
        except (KeyError, TypeError, ValueError, IndexError):
            names = ", ".join(map(str, data.sizes))
            raise InvalidOption(
                f"there is nothing at {checks.shown(labels)}; the dimensions are {names}", value=labels
            ) from None
        return type(self)(data)

    def to_dataframe(self, table: str | None = None) -> pd.DataFrame:
        """Return one of the tables as a data frame: a row for each point, columns named with their units.

        Parameters
        ----------
        table : str, optional
            One of `TABLES`; by default the first.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        InvalidOption
            If there is no such table.
        """
        names = [*self.TABLES]
        part = self._table(names[0] if table is None else checks.one_of(table, "table", InvalidOption, names))
        return data_frame(part)

    def to_csv(self, path: str | Path, table: str | None = None) -> None:
        """Write one of the tables of `to_dataframe` as text columns with a header; "inf" stands for infinity.

        Raises
        ------
        InvalidOption
            As `to_dataframe`.
        OutputError
            If the file cannot be written.
        """
        write_csv(path, self.to_dataframe(table))

    def _table(self, name: str) -> xr.Dataset:
        return self.data[[*self.TABLES[name]]]

    def to_netcdf(self, path: str | Path) -> None:
        """Write the dataset to a NetCDF file.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        write_netcdf(path, self.data)

    def __getattr__(self, name: str) -> Any:
        # Not before `data` is there (while it is unpickled), and no protocol that was not meant.
        if name == "data" or name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.data, name)

    def __getitem__(self, name: str) -> xr.DataArray:
        return self.data[name]

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *dir(self.data)})

    def __repr__(self) -> str:
        sizes = ", ".join(f"{size} {name}" for name, size in self.data.sizes.items())
        return f"<{type(self).__name__}: {self._headline()} ({sizes})>"

    def _repr_html_(self) -> str:
        html: str = self.data._repr_html_()
        return f"<p><b>{type(self).__name__}</b>: {self._headline()}</p>{html}"


def table_of_some(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Table of at most a dozen rows, evenly from the first to the last; it says so where there are more.

    Examples
    --------
    >>> table_of_some(["n"], [[k] for k in range(100)]).splitlines()[-2:]
    ['99', '(12 of 100 rows)']
    """
    chosen = sorted({round(k) for k in np.linspace(0, len(rows) - 1, min(len(rows), _SHOWN))})
    table = text_table(header, [rows[k] for k in chosen])
    return table if len(chosen) == len(rows) else f"{table}\n({len(chosen)} of {len(rows)} rows)"
