"""Populations of blocks: fraction that overturns, computed from blocks simulated once, and density."""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rocking.kernels.compiled import inlined, kernel

Singles = NDArray[np.float32]
Reals = NDArray[Any]

#: Exponents smaller than the largest one by at least this contribute less than rounding (single, double precision).
_NEGLIGIBLE_SINGLE: Final = np.float32(16.0)
_NEGLIGIBLE: Final = 40.0


@kernel
def write_overturned_fractions(
    factors: Singles,
    powers: Singles,
    overturned: Singles,
    exponents: Singles,
    fractions: Singles,
    effective: NDArray[np.float64],
) -> None:
    """Write the fraction of each population that overturns into ``fractions``, shape (populations, motions).

    Block j has the weight exp(factors[c] @ powers[:, j]) in population c. ``overturned``, shape (blocks, motions), is 1
    if it overturns, else 0. The effective number of blocks of each population is written into ``effective``;
    ``exponents``, with a number per block, is scratch space. All numbers must be finite.
    """
    for c in range(factors.shape[0]):
        _write_exponents(factors[c], powers, exponents)
        max_exponent = _find_max(exponents)
        total, total_squares = 0.0, 0.0
        fractions[c] = np.float32(0.0)
        for j in range(exponents.shape[0]):
            deficit = max_exponent - exponents[j]
            if deficit < _NEGLIGIBLE_SINGLE:
                weight = np.float32(math.exp(-deficit))
                total += float(weight)
                total_squares += float(weight) ** 2
                _add_multiple(weight, overturned[j], fractions[c])
        for m in range(fractions.shape[1]):
            fractions[c, m] /= np.float32(total)
        effective[c] = total * total / total_squares


@kernel
def write_log_sums(
    factors: NDArray[np.float64], powers: NDArray[np.float64], exponents: NDArray[np.float64], sums: NDArray[np.float64]
) -> None:
    """Write the logarithm of the sum over j of exp(factors[c] @ powers[:, j]) into ``sums``, for each c.

    ``exponents``, with a number per j, is scratch space. All numbers must be finite.
    """
    for c in range(factors.shape[0]):
        _write_exponents(factors[c], powers, exponents)
        max_exponent = _find_max(exponents)
        total = 0.0
        for j in range(exponents.shape[0]):
            if max_exponent - exponents[j] < _NEGLIGIBLE:
                total += math.exp(exponents[j] - max_exponent)
        sums[c] = max_exponent + math.log(total)


@inlined
def _write_exponents(factors: Reals, powers: Reals, exponents: Reals) -> None:
    """Write factors @ powers."""
    for j in range(exponents.shape[0]):
        exponents[j] = factors[0] * powers[0, j]
    for k in range(1, powers.shape[0]):
        _add_multiple(factors[k], powers[k], exponents)


@inlined
def _find_max(values: Reals) -> Any:
    """Return the largest of some numbers."""
    largest = values[0]
    for i in range(1, values.shape[0]):
        if values[i] > largest:
            largest = values[i]
    return largest


@inlined
def _add_multiple(weight: Any, row: Reals, total: Reals) -> None:
    """Add a multiple of a row."""
    for i in range(row.shape[0]):
        total[i] += weight * row[i]
