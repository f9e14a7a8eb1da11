"""Results: text, plain values, tables made from one list of columns, figures; analyses add a labelled dataset."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import numpy as np

from rocking.core import checks
from rocking.core.arrays import evenly
from rocking.core.tables import (
    Column,
    columns_of,
    frame_of,
    named,
    plain,
    text_table,
    to_json,
    write_csv,
    write_excel,
    write_netcdf,
    write_text,
)
from rocking.errors import InvalidOption

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
        Words in a summary, the name of a quantity in a dictionary.
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
    """Return rows as plain values by name, units in the names; None for what is not a finite number."""
    return {named(row.name, row.unit): plain(row.value) for row in rows}


class Result(ABC):
    """Base class of everything that simulations and analyses return.

    Attributes
    ----------
    TABLES : collection of str
        Names of the tables, the default one first; empty where the result has none.
    """

    TABLES: ClassVar[Collection[str]] = ()

    #: Format of numbers in CSV files.
    _FORMAT: ClassVar[str | None] = "%.15g"

    @abstractmethod
    def summary(self) -> str:
        """Return the result in words: lines of text and tables."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values by name; units are in the names, or SI."""

    def to_json(self, path: str | Path) -> None:
        """Write the values of `to_dict` as JSON to a file, whole or not at all; NaN and infinity are null.

        `OutputError` if the file cannot be written.
        """
        write_text(path, to_json(self.to_dict()) + "\n")

    def _columns(self, table: str) -> list[Column]:
        """Return the columns of a table."""
        raise NotImplementedError(table)

    def to_dataframe(self, table: str | None = None) -> pd.DataFrame:
        """Return one of the tables (`TABLES`), by default the first, as a data frame with units in its columns' names.

        `InvalidOption` if there is no such table.
        """
        names = [*self.TABLES]
        if not names:
            raise InvalidOption(f"a {type(self).__name__} has no tables; use to_dict or to_json")
        return frame_of(self._columns(checks.one_of(table or names[0], "table", InvalidOption, names)))

    def to_csv(self, path: str | Path, table: str | None = None) -> None:
        """Write a table of `to_dataframe` as text columns with a header, as `to_json`; "inf" stands for infinity."""
        write_csv(path, self.to_dataframe(table), digits=self._FORMAT)

    def to_excel(self, path: str | Path) -> None:
        """Write all tables as the sheets of a workbook (.xlsx), as `to_json`; `InvalidOption` without openpyxl."""
        write_excel(path, {table: self.to_dataframe(table) for table in self.TABLES or [""]})

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        """Draw the result.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Axes for the main panel alone; by default a new figure has all panels.
        title : str
            Title; by default it describes what is drawn.
        figsize : (float, float), optional
            Width and height of a new figure, inches.

        Returns
        -------
        matplotlib.figure.Figure
            The new figure, or that of `ax`.

        Raises
        ------
        InvalidOption
            If the result has no figure, the size is not two positive numbers, or `ax` are no axes.
        """
        raise InvalidOption(f"a {type(self).__name__} has no figure; use summary or to_dict")

    def _headline(self) -> str:
        """Return the result in one line, for the representation."""
        return self.summary().splitlines()[0]

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._headline()}>"

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(max_rows=_SHOWN, index=False) if self.TABLES else ""
        return f"<p><b>{type(self).__name__}</b>: {escape(self._headline())}</p>{table}"


@dataclass(frozen=True, eq=False, repr=False)
class DatasetResult(Result):
    """Result whose numbers are a dataset with labels, `data`.

    Attributes
    ----------
    data : xarray.Dataset
        All numbers, with units and meaning of each variable.
    TABLES : mapping of str to tuple of str
        Tables, the default one first, and the variables of each.
    POOLED : tuple of str
        Dimensions over which some of the numbers were taken together: a part of one of them has no numbers of its own.
    """

    TABLES: ClassVar[Mapping[str, tuple[str, ...]]]
    POOLED: ClassVar[tuple[str, ...]] = ()

    data: xr.Dataset

    def select(self, **labels: Any) -> Self:
        """Return the part at some labels of its dimensions, which are all kept.

        Parameters
        ----------
        **labels : object
            Label or labels for each dimension, as ``alpha=0.2`` or ``alpha=[0.1, 0.2]``; the nearest of numbers.

        Returns
        -------
        same type
            The result there.

        Raises
        ------
        InvalidOption
            If there is no such dimension or label, or numbers over all of that dimension stand in the result.
        """
        for name in labels.keys() & {*self.POOLED}:
            raise InvalidOption(
                f"some numbers of this result are of all its values of {name} together; compute a part of them anew, "
                "or take what is of each from `data`",
                value=labels,
            )
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
        return type(self)(self._kept_of(data))

    @staticmethod
    def _kept_of(data: xr.Dataset) -> xr.Dataset:
        """Return the data of a part without what belongs to another part."""
        return data

    def _columns(self, table: str) -> list[Column]:
        return columns_of(self._table(table))

    def _table(self, name: str) -> xr.Dataset:
        return self.data[[*self.TABLES[name]]]

    def to_netcdf(self, path: str | Path) -> None:
        """Write `data` to a NetCDF file, as `to_json`."""
        write_netcdf(path, self.data)

    def __repr__(self) -> str:
        sizes = ", ".join(f"{size} {name}" for name, size in self.data.sizes.items())
        return f"<{type(self).__name__}: {self._headline()} ({sizes})>"

    def _repr_html_(self) -> str:
        html: str = self.data._repr_html_()
        return f"<p><b>{type(self).__name__}</b>: {escape(self._headline())}</p>{html}"


def variable(dims: str | tuple[str, ...], values: Any, meaning: str = "", unit: str = "") -> tuple[Any, Any, Any]:
    """Return a variable of a dataset: its dimensions, its values, and its unit and meaning where there are any."""
    return dims, values, {name: said for name, said in (("units", unit), ("long_name", meaning)) if said}


def table_of_some(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Table of at most a dozen rows, evenly from the first to the last; it says so where there are more."""
    chosen = evenly(len(rows), _SHOWN)
    table = text_table(header, [rows[k] for k in chosen])
    return table if len(chosen) == len(rows) else f"{table}\n({len(chosen)} of {len(rows)} rows)"
