"""Probability distributions of uncertain parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import OptionError


@dataclass(frozen=True, repr=False)
class Distribution:
    """Normal, lognormal or uniform distribution of a parameter, created by `normal`, `lognormal` or `uniform`.

    Attributes
    ----------
    kind : {"normal", "lognormal", "uniform"}
        Kind of the distribution.
    first, second : float
        Mean and standard deviation, median and logarithmic standard deviation, or lowest and highest value.
    low, high : float
        Limits at which a normal distribution is truncated.

    See Also
    --------
    rocking.Blocks.sample : Sample blocks with uncertain parameters.

    Examples
    --------
    >>> import rocking
    >>> rocking.lognormal(2.0, 0.1).ppf(0.5)
    array(2.)
    """

    kind: Literal["normal", "lognormal", "uniform"]
    first: float
    second: float
    low: float = -math.inf
    high: float = math.inf

    def ppf(self, probability: Floats | float) -> Floats:
        """Return the quantiles of some probabilities (percent-point function, as in `scipy.stats`)."""
        from scipy.special import ndtr, ndtri

        fractions = np.asarray(probability, dtype=np.float64)
        if self.kind == "uniform":
            return np.asarray(self.first + (self.second - self.first) * fractions)
        if self.kind == "lognormal":
            return np.asarray(self.first * np.exp(self.second * ndtri(fractions)))
        below, above = (float(ndtr((end - self.first) / self.second)) for end in (self.low, self.high))
        quantiles = self.first + self.second * ndtri(below + (above - below) * fractions)
        return np.asarray(np.clip(quantiles, self.low, self.high))

    def __repr__(self) -> str:
        limits = "" if (self.low, self.high) == (-math.inf, math.inf) else f", low={self.low:g}, high={self.high:g}"
        return f"{self.kind}({self.first:g}, {self.second:g}{limits})"


def normal(mean: float, deviation: float, *, low: float = -math.inf, high: float = math.inf) -> Distribution:
    """Create a normal distribution, truncated at two limits if they are finite.

    Parameters
    ----------
    mean, deviation : float
        Mean and standard deviation before truncation.
    low, high : float
        Limits of the values.

    Returns
    -------
    Distribution
        Distribution for `Blocks.sample`.

    Raises
    ------
    OptionError
        If the deviation is not positive, or the mean is not between the limits.

    See Also
    --------
    rocking.lognormal : Create a lognormal distribution.

    Examples
    --------
    >>> normal(0.30, 0.02).ppf(0.975).round(4)
    np.float64(0.3392)
    """
    center, spread = checks.finite(mean, "mean", OptionError), checks.positive(deviation, "deviation", OptionError)
    ends = checks.real(low, "low", OptionError), checks.real(high, "high", OptionError)
    if not ends[0] < center < ends[1]:
        message = f"{{}} must be between {{}} and {{}}; got {center:g}, {ends[0]:g} and {ends[1]:g}"
        raise OptionError(message, "mean", "low", "high", value=mean)
    return Distribution("normal", center, spread, *ends)


def lognormal(median: float, dispersion: float) -> Distribution:
    """Create a lognormal distribution.

    Parameters
    ----------
    median : float
        Median, positive.
    dispersion : float
        Standard deviation of the natural logarithm.

    Returns
    -------
    Distribution
        Distribution for `Blocks.sample`.

    See Also
    --------
    rocking.normal : Create a normal distribution.

    Examples
    --------
    >>> lognormal(0.3, 0.1)
    lognormal(0.3, 0.1)
    """
    positive = checks.positive
    return Distribution(
        "lognormal", positive(median, "median", OptionError), positive(dispersion, "dispersion", OptionError)
    )


def uniform(low: float, high: float) -> Distribution:
    """Create a uniform distribution between two values.

    Parameters
    ----------
    low, high : float
        Lowest and highest value.

    Returns
    -------
    Distribution
        Distribution for `Blocks.sample`.

    See Also
    --------
    rocking.normal : Create a normal distribution.

    Examples
    --------
    >>> uniform(0.2, 0.4).ppf(0.25)
    array(0.25)
    """
    return Distribution("uniform", *checks.increasing_pair((low, high), "ends of a uniform distribution", OptionError))
