"""What an analysis found: a dataset that says in words what it is, and draws itself."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from rocking.errors import InvalidOption, OutputError

if TYPE_CHECKING:
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
    """

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
                nearest = "nearest" if data[name].dtype.kind == "f" else None
                data = data.sel({name: values}, method=nearest)
        except KeyError as error:
            names = ", ".join(map(str, data.sizes))
            raise InvalidOption(f"there is nothing at {error.args[0]}; the dimensions are {names}") from None
        return type(self)(data)

    @abstractmethod
    def summary(self) -> str:
        """Return what was found, in words and a table."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return what was found by name; units are in the names."""

    @abstractmethod
    def plot(self, ax: Axes | None = None, *, title: str = "") -> Figure:
        """Draw what was found: in a new figure, or in `ax`."""

    def to_netcdf(self, path: str | Path) -> None:
        """Write the dataset to a NetCDF file.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        try:
            self.data.to_netcdf(path, engine="h5netcdf")
        except OSError as error:
            raise OutputError(f"{path} cannot be written: {error.strerror or error}; choose another place") from error

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


def some(count: int) -> list[int]:
    """List at most a dozen positions, evenly from the first to the last."""
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, _SHOWN))})
