"""Measure of basins: basin entropy."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rocking import checks
from rocking.errors import InvalidOption


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


def _grid(outcomes: ArrayLike) -> NDArray[np.int64]:
    grid = np.asarray(outcomes)
    if grid.ndim != 2 or grid.size == 0 or grid.dtype.kind not in "iub":
        raise InvalidOption("{} must be a grid of whole numbers", "outcomes")
    return grid.astype(np.int64)
