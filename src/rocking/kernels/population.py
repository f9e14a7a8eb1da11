"""Populations of blocks: what share of each overturns, from blocks that were simulated once; and their density."""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.kernels.compiled import inlined, kernel

Singles = NDArray[np.float32]
Reals = NDArray[Any]

#: A block that weighs less than exp(-16) of the heaviest one adds less than rounding in single precision.
_FAINT: Final = np.float32(16.0)

#: A part of a density below exp(-40) of the largest one adds less than rounding.
_NEGLIGIBLE: Final = 40.0


@kernel
def shares(
    factors: Singles,
    powers: Singles,
    overturned: Singles,
    exponents: Singles,
    found: Singles,
    effective: NDArray[np.float64],
) -> None:
    """Find the share of each population that overturns, and the effective number of blocks behind it.

    Block j weighs the exponential of ``factors[c] @ powers[:, j]`` in population c.

    Parameters
    ----------
    factors, powers : ndarray, shapes (c, k) and (k, n)
        What the exponents are the product of.
    overturned : ndarray, shape (n, m)
        1 where a block overturns under a motion, else 0.
    exponents : ndarray, shape (n,)
        Room to work in.
    found : ndarray, shape (c, m)
        Shares; written.
    effective : ndarray, shape (c,)
        Effective numbers of blocks; written.
    """
    for c in range(factors.shape[0]):
        _exponents(factors[c], powers, exponents)
        highest = _highest(exponents)
        total, squares = 0.0, 0.0
        found[c] = np.float32(0.0)
        for j in range(exponents.shape[0]):
            below = highest - exponents[j]
            if below < _FAINT:
                weight = np.float32(math.exp(-below))
                total += float(weight)
                squares += float(weight) ** 2
                _add(weight, overturned[j], found[c])
        _divide(found[c], np.float32(total))
        effective[c] = total * total / squares


@kernel
def log_density(
    factors: NDArray[np.float64],
    powers: NDArray[np.float64],
    exponents: NDArray[np.float64],
    found: NDArray[np.float64],
) -> None:
    """Find the logarithm of a sum of exponentials, ``sum over j of exp(factors[c] @ powers[:, j])``, for each c.

    Parameters
    ----------
    factors, powers : ndarray, shapes (c, k) and (k, n)
        What the exponents are the product of.
    exponents : ndarray, shape (n,)
        Room to work in.
    found : ndarray, shape (c,)
        Logarithms; written.
    """
    for c in range(factors.shape[0]):
        _exponents(factors[c], powers, exponents)
        highest = _highest(exponents)
        total = 0.0
        for j in range(exponents.shape[0]):
            if highest - exponents[j] < _NEGLIGIBLE:
                total += math.exp(exponents[j] - highest)
        found[c] = highest + math.log(total)


@inlined
def _exponents(factors: Reals, powers: Reals, exponents: Reals) -> None:
    for j in range(exponents.shape[0]):
        exponents[j] = factors[0] * powers[0, j]
    for k in range(1, powers.shape[0]):
        _add(factors[k], powers[k], exponents)


@inlined
def _highest(values: Reals) -> Any:
    highest = values[0]
    for i in range(1, values.shape[0]):
        if values[i] > highest:
            highest = values[i]
    return highest


@inlined
def _add(weight: Any, row: Reals, total: Reals) -> None:
    for i in range(row.shape[0]):
        total[i] += weight * row[i]


@inlined
def _divide(values: Singles, divisor: np.float32) -> None:
    for i in range(values.shape[0]):
        values[i] /= divisor
