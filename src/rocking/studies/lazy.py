"""Outcomes of a study as arrays that are read from its store when they are asked for."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from rocking.arrays import Floats
from rocking.engine import OUTCOME
from rocking.errors import StudyError
from rocking.studies.store import Store
from rocking.studies.units import Key, exact, name_of

if TYPE_CHECKING:
    import xarray as xr


class _Outcome(BackendArray):
    """One outcome of a store; reads the units that a selection touches."""

    def __init__(self, store: Store, name: str, complete: bool) -> None:
        self._store, self._name, self._complete = store, name, complete
        self.shape = store.grid.shape
        self.dtype = OUTCOME[name] if complete else np.dtype(np.float64)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> NDArray[Any]:
        found: NDArray[Any] = indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER, self._selected
        )
        return found

    def _selected(self, key: tuple[Any, ...]) -> NDArray[Any]:
        axes = [np.arange(size)[part] for size, part in zip(self.shape, key, strict=True)]
        wanted = [np.atleast_1d(axis) for axis in axes]
        found = np.full([len(axis) for axis in wanted], np.nan)
        parts = self._store.grid.unit
        units = [np.unique(axis // part).tolist() for axis, part in zip(wanted, parts, strict=True)]
        for unit in itertools.product(*units):
            here = [np.flatnonzero(axis // part == k) for axis, part, k in zip(wanted, parts, unit, strict=True)]
            within = [axis[at] - k * part for axis, at, part, k in zip(wanted, here, parts, unit, strict=True)]
            found[np.ix_(*here)] = self._unit(unit)[np.ix_(*within)]
        dropped = tuple(position for position, axis in enumerate(axes) if axis.ndim == 0)
        return self._typed(found.squeeze(axis=dropped))

    def _unit(self, key: Key) -> Floats:
        outcomes = self._store.outcomes(key)
        if outcomes is not None:
            return outcomes[self._name]
        if self._complete:
            raise StudyError(f"unit {name_of(key)} is gone since these results were opened: run the study again")
        return np.full(self._store.grid.counts(key), np.nan)

    def _typed(self, values: NDArray[np.float64]) -> NDArray[Any]:
        return exact(self._name, values) if self._complete else values


def lazy(store: Store, name: str, complete: bool) -> xr.Variable:
    """Outcome of a store over (motion, scale, polarity, block), read when it is needed.

    Parameters
    ----------
    store : Store
        Where it is kept.
    name : str
        Which outcome.
    complete : bool
        Whether all units are done, so that its own type holds every value.
    """
    import xarray as xr

    values = indexing.LazilyIndexedArray(_Outcome(store, name, complete))
    return xr.Variable(("motion", "scale", "polarity", "block"), values)
