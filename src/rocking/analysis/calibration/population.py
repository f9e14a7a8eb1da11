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
    parts = [_log_sum_exp(_log_normal(part, widened, points)) for part in batches(populations)]
    return np.asarray(_log_sum_exp(np.array(parts)) - np.log(len(populations)))


def _log_normal(populations: Floats, widened: float, points: Floats) -> Floats:
    """Logarithm of the density of each population at each point, shape (c, n)."""
    centre, dispersion = unpacked(populations)
    precision = (widened * dispersion) ** -2
    constant = 0.5 * (np.log(precision / (2.0 * np.pi)) - precision * centre**2).sum(axis=1)
    return np.asarray((precision * centre) @ points.T - 0.5 * precision @ (points**2).T + constant[:, None])


def _log_sum_exp(rows: Floats) -> Floats:
    """Logarithm of the sum over rows of exponentials (much faster than numpy.logaddexp)."""
    highest = rows.max(axis=0)
    return np.asarray(highest + np.log(np.exp((rows - highest).astype(np.float32)).sum(axis=0)))


def batches(populations: Floats) -> list[Floats]:
    """Cut an array of populations into parts that bound the memory."""
    return [populations[start : start + _BATCH] for start in range(0, len(populations), _BATCH)]
