"""Measures of basins: basin entropy, and the uncertainty exponent, from which the boundary has its dimension."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.errors import InvalidOption

#: Fewest uncertain cells of a distance that counts for the exponent.
_FEWEST: Final = 20


def basin_entropy(outcomes: ArrayLike, box: int = 5) -> tuple[float, float]:
    """Basin entropy and boundary basin entropy of a grid of outcomes.

    Parameters
    ----------
    outcomes : array_like of int, shape (m, n)
        What becomes of each state.
    box : int
        Cells along each side of a box; rows and columns that fill no box are left out.

    Returns
    -------
    entropy : float
        Mean over the boxes of the entropy of the outcomes in one, natural logarithms.
    boundary : float
        Mean over those boxes that hold several outcomes: above ln 2 a boundary is fractal, but not every fractal one
        is; 0 where there are none.

    Raises
    ------
    InvalidOption
        If the outcomes are no grid of at least one box.

    References
    ----------
    A. Daza and others, "Basin entropy: a new tool to analyze uncertainty in dynamical systems", Scientific Reports 6
    (2016).

    Examples
    --------
    A straight boundary through the middle of each second box:

    >>> import numpy as np
    >>> from rocking import dynamics
    >>> outcomes = np.arange(8) // 2 % 2 * np.ones((8, 1), dtype=int)
    >>> [round(value, 12) for value in dynamics.basin_entropy(outcomes, box=4)]
    [0.69314718056, 0.69314718056]
    """
    grid = _grid(outcomes)
    side = checks.whole(box, "box", InvalidOption, least=2)
    rows, columns = (length // side for length in grid.shape)
    if rows * columns == 0:
        raise InvalidOption(f"{{}} must hold at least one box of {side} by {side} cells", "outcomes")
    cut = grid[: rows * side, : columns * side].reshape(rows, side, columns, side)
    shares = np.stack([np.mean(cut == value, axis=(1, 3)) for value in np.unique(grid)])
    entropies = -np.sum(shares * np.log(np.where(shares > 0.0, shares, 1.0)), axis=0)
    mixed = np.count_nonzero(shares > 0.0, axis=0) > 1
    return float(entropies.mean()), float(entropies[mixed].mean()) if mixed.any() else 0.0


def uncertainty_exponent(outcomes: ArrayLike) -> tuple[float, float]:
    """Uncertainty exponent of basins on a grid: how fast the share of uncertain states falls with the uncertainty.

    Parameters
    ----------
    outcomes : array_like of int, shape (m, n)
        What becomes of each state, on an even grid.

    Returns
    -------
    exponent : float
        A state is uncertain at a distance of k cells if one of the four states that far off along the axes has another
        outcome; the share of those goes as k to the exponent. The boundary has the dimension 2 - exponent: 1 of a
        smooth one. NaN where there are too few uncertain states at all but one distance.
    standard_error : float
        Of the straight line through the logarithms, over distances 1, 2, 4, ... up to a sixteenth of the grid.

    Raises
    ------
    InvalidOption
        If the outcomes are no grid.

    References
    ----------
    S. W. McDonald, C. Grebogi, E. Ott and J. A. Yorke, "Fractal basin boundaries", Physica D 17 (1985).

    Examples
    --------
    >>> import numpy as np
    >>> from rocking import dynamics
    >>> outcomes = (np.add.outer(np.arange(256), np.arange(256)) > 200).astype(int)
    >>> exponent, _ = dynamics.uncertainty_exponent(outcomes)
    >>> round(exponent, 1)
    1.0
    """
    grid = _grid(outcomes)
    steps = [2**n for n in range(int(math.log2(max(min(grid.shape) // 16, 1))) + 1)]
    known = [(k, share) for k in steps if (share := _uncertain(grid, k, steps[-1])) * grid.size >= _FEWEST]
    if len(known) < 2:
        return math.nan, math.nan
    x, y = np.log(np.array(known)).T
    slope = float(np.polyfit(x, y, 1)[0])
    rest = y - y.mean() - slope * (x - x.mean())
    freedom = len(known) - 2
    error = math.sqrt(float(rest @ rest) / freedom / float(np.sum((x - x.mean()) ** 2))) if freedom else math.nan
    return slope, error


def _uncertain(grid: NDArray[np.int64], k: int, margin: int) -> float:
    """Share of the cells, without a margin around them, that differ from one of four others k off."""
    rows, columns = (np.arange(margin, length - margin) for length in grid.shape)
    if rows.size == 0 or columns.size == 0:
        return 0.0
    middle = grid[np.ix_(rows, columns)]
    others = [grid[np.ix_(rows + k * i, columns + k * j)] for i, j in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    return float(np.mean(np.any([middle != other for other in others], axis=0)))


def _grid(outcomes: ArrayLike) -> NDArray[np.int64]:
    grid = np.asarray(outcomes)
    if grid.ndim != 2 or grid.size == 0 or grid.dtype.kind not in "iub":
        raise InvalidOption("{} must be a grid of whole numbers", "outcomes")
    return grid.astype(np.int64)
