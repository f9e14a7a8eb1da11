"""Base classes of results: text, plain values, tables, figures and labelled datasets."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import numpy as np

from rocking.core import checks
from rocking.core.arrays import select_evenly
from rocking.core.tables import (
    Column,
    add_unit,
    columns_to_frame,
    dataset_to_columns,
    format_table,
    to_json,
    to_plain,
    write_csv,
    write_excel,
    write_netcdf,
    write_text,
)
from rocking.errors import OptionError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Rows of a table for display.
_MAX_ROWS = 12


class Row(NamedTuple):
    """Line of a summary, or entry of a dictionary.

    Attributes
    ----------
    name : str
        Words in a summary, name of a quantity in a dictionary.
    value : object
        Value, in a summary as text with the significant digits.
    unit : str
        Unit of the value, "1" if dimensionless.
    note : str
        Addition in a summary, with the mark that separates it from the value.

    See Also
    --------
    rocking.Response.summary_rows : Return the lines of a summary as rows.
    rocking.Response.result_rows : Return the entries of a dictionary as rows.

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


def format_rows(rows: Iterable[Row], width: int) -> str:
    """Return rows as lines: names in a column of this width, then value, unit and note."""
    return "\n".join(f"{row.name:<{width}}{row.text}" for row in rows)


def rows_to_dict(rows: Iterable[Row]) -> dict[str, Any]:
    """Return rows as plain values by name with unit, with None for numbers that are not finite."""
    return {add_unit(row.name, row.unit): to_plain(row.value) for row in rows}


class Result(ABC):
    """Base class of all results of simulations and analyses.

    Attributes
    ----------
    TABLES : collection of str
        Names of the tables, the default one first.

    See Also
    --------
    rocking.Response : Describe the response of one body.
    rocking.core.result.DatasetResult : Describe a result with a labelled dataset.

    Examples
    --------
    >>> import rocking
    >>> response = rocking.simulate(rocking.Block(width=0.4, height=2.0), None, initial_rotation=0.1)
    >>> isinstance(response, rocking.Result), response.to_dataframe("events").columns.tolist()
    (True, ['time_s', 'kind', 'side'])
    """

    TABLES: ClassVar[Collection[str]] = ()

    #: Format of numbers in CSV files.
    _FLOAT_FORMAT: ClassVar[str | None] = "%.15g"

    @abstractmethod
    def summary(self) -> str:
        """Return the result as text: lines and tables."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values by name, with units in the names or SI."""

    def to_json(self, path: str | Path) -> None:
        """Write the values of `to_dict` to a JSON file, with null for NaN and infinity, completely or not at all.

        Raises `OutputError` if the file cannot be written.
        """
        write_text(path, to_json(self.to_dict()) + "\n")

    def _columns(self, table: str) -> list[Column]:
        """Return the columns of a table."""
        raise NotImplementedError(table)

    def to_dataframe(self, table: str | None = None) -> pd.DataFrame:
        """Return a table (one of `TABLES`, by default the first) as a data frame with units in the column names.

        Raises `OptionError` if the table does not exist.
        """
        names = [*self.TABLES]
        if not names:
            raise OptionError(f"a {type(self).__name__} has no tables; use to_dict or to_json")
        return columns_to_frame(self._columns(checks.choice(table or names[0], "table", OptionError, names)))

    def to_csv(self, path: str | Path, table: str | None = None) -> None:
        """Write a table of `to_dataframe` to a CSV file, with "inf" for infinity, like `to_json`."""
        write_csv(path, self.to_dataframe(table), float_format=self._FLOAT_FORMAT)

    def to_excel(self, path: str | Path) -> None:
        """Write all tables as sheets of a workbook (.xlsx), like `to_json`.

        Raises `OptionError` without openpyxl.
        """
        write_excel(path, {table: self.to_dataframe(table) for table in self.TABLES or [""]})

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        """Draw the result.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Axes for the main panel alone, by default a new figure with all panels.
        title : str
            Title, by default a description of the result.
        figsize : (float, float), optional
            Width and height of a new figure, inches.

        Returns
        -------
        matplotlib.figure.Figure
            New figure, or the figure of `ax`.

        Raises
        ------
        OptionError
            If the result has no figure, the size is not two positive numbers, or `ax` is not an Axes object.
        """
        raise OptionError(f"a {type(self).__name__} has no figure; use summary or to_dict")

    def _format_headline(self) -> str:
        """Return the result in one line, for the representation."""
        return self.summary().splitlines()[0]

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._format_headline()}>"

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(max_rows=_MAX_ROWS, index=False) if self.TABLES else ""
        return f"<p><b>{type(self).__name__}</b>: {escape(self._format_headline())}</p>{table}"


@dataclass(frozen=True, eq=False, repr=False)
class DatasetResult(Result):
    """Result with a labelled dataset, `data`.

    Attributes
    ----------
    data : xarray.Dataset
        All numbers, with units and meaning of each variable.
    TABLES : mapping of str to tuple of str
        Tables, the default one first, and the variables of each.
    AGGREGATED_DIMENSIONS : tuple of str
        Dimensions over which some numbers are aggregated. These numbers do not apply to a part of a dimension.

    See Also
    --------
    rocking.Result : Summarise, tabulate or plot any result.
    rocking.rocking_spectrum : Compute a rocking spectrum.

    Examples
    --------
    >>> import rocking
    >>> blocks = rocking.Blocks.grid(p=[1.0, 2.0], alpha=[0.2], restitution=[0.9])
    >>> spectrum = rocking.rocking_spectrum(blocks, rocking.pulses.one_sine(5.0, 1.0))
    >>> spectrum.select(p=2.0).data.sizes["p"]
    1
    """

    TABLES: ClassVar[Mapping[str, tuple[str, ...]]]
    AGGREGATED_DIMENSIONS: ClassVar[tuple[str, ...]] = ()

    data: xr.Dataset

    def select(self, **labels: Any) -> Self:
        """Return the part at some labels of its dimensions, all of which are kept.

        Parameters
        ----------
        **labels : object
            Label or labels for each dimension, such as ``alpha=0.2`` or ``alpha=[0.1, 0.2]``. Numbers select the
            nearest.

        Returns
        -------
        same type
            Selected part.

        Raises
        ------
        OptionError
            If a dimension or label does not exist, or the result contains numbers aggregated over that dimension.
        """
        for name in labels.keys() & {*self.AGGREGATED_DIMENSIONS}:
            message = f"this result contains numbers aggregated over {name}; repeat the analysis for a part, or select"
            raise OptionError(f"{message} from `data`", value=labels)
        selection = {name: np.atleast_1d(values) for name, values in labels.items()}
        data = self.data
        try:
            for name, values in selection.items():
                numeric = data[name].dtype.kind == "f"
                coordinate = checks.numbers(values, name, OptionError) if numeric else values
                data = data.sel({name: coordinate}, method="nearest" if numeric else None)
        except (KeyError, TypeError, ValueError, IndexError):
            names = ", ".join(map(str, data.sizes))
            message = f"no values match {checks.short_repr(labels)}; the dimensions are {names}"
            raise OptionError(message, value=labels) from None
        return type(self)(self._restrict(data))

    @staticmethod
    def _restrict(data: xr.Dataset) -> xr.Dataset:
        """Return the data of a part without variables that belong to another part."""
        return data

    def _columns(self, table: str) -> list[Column]:
        return dataset_to_columns(self._table(table))

    def _table(self, name: str) -> xr.Dataset:
        return self.data[[*self.TABLES[name]]]

    def to_netcdf(self, path: str | Path) -> None:
        """Write `data` to a NetCDF file, like `to_json`."""
        write_netcdf(path, self.data)

    def __repr__(self) -> str:
        sizes = ", ".join(f"{size} {name}" for name, size in self.data.sizes.items())
        return f"<{type(self).__name__}: {self._format_headline()} ({sizes})>"

    def _repr_html_(self) -> str:
        html: str = self.data._repr_html_()
        return f"<p><b>{type(self).__name__}</b>: {escape(self._format_headline())}</p>{html}"


def create_variable(dims: str | tuple[str, ...], values: Any, meaning: str = "", unit: str = "") -> tuple[Any, ...]:
    """Return a variable of a dataset: dimensions, values, and optional unit and meaning."""
    return dims, values, {name: text for name, text in (("units", unit), ("long_name", meaning)) if text}


def format_some_rows(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return a table of at most a dozen rows, evenly from first to last, with a remark if there are more."""
    indices = select_evenly(len(rows), _MAX_ROWS)
    table = format_table(header, [rows[k] for k in indices])
    return table if len(indices) == len(rows) else f"{table}\n({len(indices)} of {len(rows)} rows)"
