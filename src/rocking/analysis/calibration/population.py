"""The population of blocks behind binary outcomes.

A specimen is never twice the same block: it is set back by hand, its pivots wear, a rock rolls out of its plane. So
each test has its own block, drawn from a population that is normal in the logarithmic coordinates of `Space`. Several
populations are an array of shape (c, 2 k): centres, then logarithms of the dispersions, along each coordinate.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from rocking.analysis.calibration.space import Space
from rocking.arrays import Floats
from rocking.kernels import population as kernel

#: Prior of the logarithm of a dispersion from test to test: its standard deviation.
_DISPERSION_LOG_DEVIATION: Final = 0.6

#: Populations that are weighed at once: bounds the memory.
_BATCH: Final = 64


def unpacked(populations: Floats) -> tuple[Floats, Floats]:
    """Centres and dispersions, shape (c, k) each."""
    k = populations.shape[1] // 2
    return populations[:, :k], np.exp(populations[:, k:])


def with_dispersions(space: Space, centres: Floats, rng: np.random.Generator) -> Floats:
    """Give each centre dispersions from their prior."""
    scores = rng.standard_normal(centres.shape)
    return np.hstack([centres, np.log(space.dispersions) + _DISPERSION_LOG_DEVIATION * scores])


def log_prior_of_dispersions(space: Space, populations: Floats) -> Floats:
    """Logarithm of the prior of the dispersions, up to a constant, shape (c,)."""
    k = populations.shape[1] // 2
    scores = (populations[:, k:] - np.log(space.dispersions)) / _DISPERSION_LOG_DEVIATION
    return np.asarray(-0.5 * (scores**2).sum(axis=1))


def drawn(populations: Floats, widened: float, count: int, rng: np.random.Generator) -> Floats:
    """Draw points from populations in turn, their dispersion times `widened`; shape (count, k)."""
    centre, dispersion = unpacked(populations[np.arange(count) % len(populations)])
    return centre + widened * dispersion * rng.standard_normal(centre.shape)


def log_density(populations: Floats, widened: float, points: Floats) -> Floats:
    """Logarithm of the density at points of what `drawn` draws, shape (n,)."""
    centre, dispersion = unpacked(populations)
    middle = centre.mean(axis=0)
    centre, from_middle = centre - middle, points - middle
    precision = (widened * dispersion) ** -2
    constant = 0.5 * (np.log(precision / (2.0 * np.pi)) - precision * centre**2).sum(axis=1)
    powers = np.vstack([(precision * centre).T, -0.5 * precision.T, constant])
    factors = np.hstack([from_middle, from_middle**2, np.ones((len(points), 1))])
    found = np.empty(len(points))
    kernel.log_density(factors, powers, np.empty(len(populations)), found)
    return np.asarray(found - np.log(len(populations)))


def batches(populations: Floats) -> list[Floats]:
    """Cut an array of populations into parts that bound the memory."""
    return [populations[start : start + _BATCH] for start in range(0, len(populations), _BATCH)]
