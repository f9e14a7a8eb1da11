"""Where an outcome changes with the intensity of the motion: found on a grid, then refined by bisection."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rocking.arrays import Floats, Integers
from rocking.progress import Progress

#: From so many changes on, no further ones are looked for in an interval of the grid.
_MOST: Final = 64


@dataclass(frozen=True)
class Boundaries:
    """Changes of the outcome in columns of a grid, ordered by column, then level.

    Each lies between a low and a high level, which have the outcomes below and above.
    """

    column: Integers
    low: Floats
    high: Floats
    below: Integers
    above: Integers

    @property
    def level(self) -> Floats:
        """Middle of every bracket."""
        return 0.5 * (self.low + self.high)


def boundaries(
    levels: Floats,
    outcome: Integers,
    outcome_of: Callable[[Integers, Floats], Integers],
    *,
    tolerance: float,
    progress: bool | None = None,
) -> Boundaries:
    """Find all changes of the outcome (m, columns) between neighbouring levels (m,) of a grid.

    `outcome_of` tells outcomes for arrays of columns and levels; the tolerance is relative to the level.

    Where a bisection meets a third outcome both halves are followed, so each bracket ends with two outcomes that are
    neighbours to within the tolerance. Only where an interval of the grid holds 64 changes or more, as between the
    regions of a fractal, one is followed up for all that lie between two outcomes. Outcomes between two levels of the
    grid with the same outcome are not seen.
    """
    here = _on_grid(levels, outcome)
    origin = np.arange(len(here.level))
    halvings = np.ceil(np.log2(np.maximum(1.0, (here.high - here.low) / (tolerance * here.high))))
    with Progress("refining", int(halvings.sum()), show=progress) as bar:
        while (wide := _wide(here, tolerance)).any():
            found = here.below.copy()
            found[wide] = outcome_of(here.column[wide], here.level[wide])
            here, origin = _halved(here, wide, found, origin)
            bar.advance(int(wide.sum()))
    return _ordered(here)


def _wide(here: Boundaries, tolerance: float) -> NDArray[np.bool_]:
    """Which brackets are wider than wanted, and hold a number between their ends."""
    return (here.high - here.low > tolerance * here.high) & (here.level > here.low) & (here.level < here.high)


def _on_grid(levels: Floats, outcome: Integers) -> Boundaries:
    row, column = np.nonzero(outcome[1:] != outcome[:-1])
    return Boundaries(column, levels[row], levels[row + 1], outcome[row, column], outcome[row + 1, column])


def _halved(
    here: Boundaries, wide: NDArray[np.bool_], found: Integers, origin: Integers
) -> tuple[Boundaries, Integers]:
    """Brackets after one bisection of the wide ones; those that hold a third outcome become two.

    `origin` is the interval of the grid that each comes from.
    """
    middle = here.level
    few = np.bincount(origin)[origin] < _MOST
    third = wide & few & (found != here.below) & (found != here.above)
    up = wide & (found == here.below)
    lower = Boundaries(
        here.column,
        np.where(up, middle, here.low),
        np.where(wide & ~up, middle, here.high),
        here.below,
        np.where(third, found, here.above),
    )
    upper = Boundaries(here.column[third], middle[third], here.high[third], found[third], here.above[third])
    both = (np.concatenate(pair) for pair in zip(vars(lower).values(), vars(upper).values(), strict=True))
    return Boundaries(*both), np.concatenate([origin, origin[third]])


def _ordered(here: Boundaries) -> Boundaries:
    order = np.lexsort((here.low, here.column))
    return Boundaries(*(values[order] for values in vars(here).values()))
