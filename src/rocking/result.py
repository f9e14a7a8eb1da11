"""What an analysis found: a dataset that says in words what it is, and draws itself."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from rocking import checks
from rocking.errors import InvalidOption
from rocking.tables import data_frame, text_table, write_netcdf, write_text

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Rows of a table for people.
_SHOWN = 12


@dataclass(frozen=True, eq=False, repr=False)
class Result(ABC):
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
            raise InvalidOption(f"there is nothing at {checks.shown(labels)}; the dimensions are {names}") from None
        return type(self)(data)

    @abstractmethod
    def summary(self) -> str:
        """Return what was found, in words and a table."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return what was found by name; units are in the names."""

    @abstractmethod
    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        """Draw what was found: in a new figure of this size (width and height, inches), or in `ax`."""

    def to_dataframe(self, table: str | None = None) -> pd.DataFrame:
        """Return one of the tables as a data frame: a row for each point, columns named with their units.

        Parameters
        ----------
        table : str, optional
            One of `TABLES`; by default the first.

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
        rows = self.to_dataframe(table)
        write_text(path, rows.to_csv(index=False, float_format="%.15g", lineterminator="\n"))

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
        return f"<{type(self).__name__}: {self.summary().splitlines()[0]} ({sizes})>"

    def _repr_html_(self) -> str:
        html: str = self.data._repr_html_()
        return f"<p><b>{type(self).__name__}</b>: {self.summary().splitlines()[0]}</p>{html}"


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
