"""Peak rotations of a study, a range of blocks at a time: all that its post-processing reads."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from rocking.analysis.fragility.curve import checked_limit
from rocking.arrays import Floats
from rocking.engine import require_finished
from rocking.errors import StudyError
from rocking.studies.outcomes import require
from rocking.studies.store import Store

#: Simulations that are held in memory at a time.
_HELD: Final = 4_000_000


def require_ratios(kept: Sequence[str], what: str) -> None:
    """Check that the outcomes that are kept tell peak rotations over slenderness.

    Raises
    ------
    InvalidOption
        If they do not; the message says what needs them.
    """
    require(kept, ["overturned", "peak_rotation"], what)


def require_limits(kept: Sequence[str], limits: Mapping[str, float]) -> None:
    """Check that the outcomes that are kept tell whether limits are passed: overturning needs no peak rotation.

    Raises
    ------
    InvalidOption
        If they do not, or a limit is none.
    """
    finite = [name for name, limit in limits.items() if math.isfinite(checked_limit(limit, name))]
    if finite:
        require_ratios(kept, f"limits.{finite[0]}")
    else:
        require(kept, ["overturned"], "a fragility")


def peak_ratios(store: Store) -> Iterator[tuple[slice, Floats]]:
    """Peak rotation over the slenderness, infinite where a block overturned, for a range of blocks after the other.

    Of blocks that stand it is NaN where the study keeps no peak rotation: whoever needs it asks `require_ratios` first.

    Parameters
    ----------
    store : Store
        A complete one.

    Yields
    ------
    blocks : slice
        Which blocks.
    ratios : ndarray, shape (motions, scales, polarities, blocks of the range)
        Over the smaller one of two slendernesses; of symmetric blocks under motions in both polarities only the first,
        since the second is no other outcome.

    Raises
    ------
    StudyError
        If units are missing or damaged, or the study's duration stopped simulations before their end.
    Unfinished
        If simulations were given up, so that their verdicts are not known.
    """
    grid = store.grid
    missing = len(grid) - len(store.done())
    if missing:
        raise StudyError(f"units are missing, {missing} of {len(grid)}: run the study to its end first")
    motions, scales, polarities = grid.shape[:3]
    shape = motions, scales, 1 if store.product.blocks.is_symmetric else polarities
    width = max(1, _HELD // int(np.prod(shape)))
    for unit in range(grid.cells[3]):
        whole = grid.ranges((0, 0, 0, unit))[3]
        for start in range(whole.start, whole.stop, width):
            blocks = slice(start, min(start + width, whole.stop))
            yield blocks, _read(store, shape, unit, blocks)


def _require_whole(stopped: Floats) -> None:
    """Check that no simulation was stopped while the block moved or the motion went on: what follows is not known."""
    count = int(np.count_nonzero(stopped))
    if count:
        raise StudyError(
            f"{count} of {stopped.size} simulations of a unit were stopped by the study's duration, while the block "
            "moved or the motion went on, so that their verdicts are not known: make the study without a duration"
        )


def _read(store: Store, shape: tuple[int, int, int], unit: int, blocks: slice) -> Floats:
    alpha = store.product.blocks.select(blocks).alpha.min(axis=1)
    ratios = np.empty((*shape, len(alpha)))
    for cell in np.ndindex(store.grid.cells[:3]):
        key = *cell, unit
        outcomes = store.outcomes(key)
        if outcomes is None:
            raise StudyError("units are gone since the report was begun: run the study again")
        motions, scales, polarities, whole = store.grid.ranges(key)
        some = slice(blocks.start - whole.start, blocks.stop - whole.start)
        named = {name: values[..., some] for name, values in outcomes.items()}
        require_finished(named["unfinished"].astype(bool))
        _require_whole(named["stopped"])
        there = ratios[motions, scales, polarities]
        found = np.where(named["overturned"] != 0.0, np.inf, named.get("peak_rotation", np.nan) / alpha)
        there[...] = found[:, :, : there.shape[2]]
    return ratios
