"""Lyapunov exponents of a body under periodic motion, from the variational equation and saltation at each impact."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import Model
from rocking.core.result import Result
from rocking.core.tables import counted
from rocking.dynamics.forcing import TOGETHER
from rocking.dynamics.maps import stroboscopic_map
from rocking.engine.treatment import Treatment
from rocking.errors import InvalidOption
from rocking.kernels.periodic import Fate, stretch
from rocking.motion.motion import Motion

#: Parts of an orbit whose means give the standard error.
_BATCHES: Final = 20


@dataclass(frozen=True, eq=False, repr=False)
class LyapunovExponents(Result):
    """Lyapunov exponents of one orbit; from `lyapunov_exponents`.

    Attributes
    ----------
    largest, smallest : float
        Weighted mean of the logarithm, per period, of the stretch along the direction that grows fastest and of that
        across it: minus infinity where the body comes to rest in some of the periods, NaN where it overturns. Where
        impacts lose nothing, a period at rest counts as zero: what is near it never rests.
    standard_error : float
        Of both, from the means of 20 consecutive parts of the orbit.
    period, periods : float, int
        Period of the motion, s, and how many were averaged over.
    impacts : float
        Impacts per period.
    resting : float
        Share of the periods in which the body comes to rest or is at rest, of those that are known; NaN where none is.
    fate : Fate
        What the state is in the end.
    stretches : ndarray, shape (periods, 2)
        Logarithms of the stretches of each period.
    """

    largest: float
    smallest: float
    standard_error: float
    period: float
    periods: int
    impacts: float
    resting: float
    fate: Fate
    stretches: Floats

    @property
    def per_second(self) -> tuple[float, float]:
        """Largest and smallest exponent, 1/s."""
        return self.largest / self.period, self.smallest / self.period

    def summary(self) -> str:
        over = f"over {counted(self.periods, 'period')}"
        if np.isnan(self.largest):
            return f"no Lyapunov exponents: the body overturns or cannot be followed {over}"
        if np.isneginf(self.largest):
            return (
                f"Lyapunov exponents: minus infinity; the body comes to rest in {100.0 * self.resting:.3g} % of the "
                f"periods, {over}"
            )
        said = f"{self.largest:.6g} and {self.smallest:.6g} per period (standard error {self.standard_error:.1g})"
        return f"Lyapunov exponents: {said}, {over}, {self.impacts:.4g} impacts in each"

    def to_dict(self) -> dict[str, Any]:
        return {
            "largest_per_period": self.largest,
            "smallest_per_period": self.smallest,
            "standard_error": self.standard_error,
            "period_s": self.period,
            "periods": self.periods,
            "impacts_per_period": self.impacts,
            "share_of_periods_with_rest": self.resting,
            "fate": self.fate.name,
        }


def lyapunov_exponents(
    body: Body,
    motion: Motion,
    state: ArrayLike,
    periods: int = 1000,
    *,
    transient: int = 200,
    model: Model | None = None,
    chattering: str | Treatment = "certified",
) -> LyapunovExponents:
    """Lyapunov exponents of a body under periodic motion, both of them, from one orbit.

    Parameters
    ----------
    body, motion : Body, Motion
        As for `stroboscopic_map`.
    state : array_like, shape (2,)
        Coordinate and velocity at the start of a period.
    periods : int
        Number of periods that are averaged over.
    transient : int
        Number of periods before these, in which the direction turns to the one that grows fastest.
    model, chattering : str, optional
        As for `stroboscopic_map`.

    Returns
    -------
    LyapunovExponents
        Per period, with a standard error.

    Notes
    -----
    On a stable periodic orbit they are the logarithms of the sizes of its multipliers over its period. Their sum is the
    mean logarithm of the contraction of areas: twice ln(restitution) for each impact, less damping times the period.
    After a rest nothing is left of a small difference, so that both are minus infinity however rarely one comes.

    References
    ----------
    P. C. Mueller, "Calculation of Lyapunov exponents for dynamic systems with discontinuities", Chaos, Solitons and
    Fractals 5 (1995). S. Das and others, "Measuring quasiperiodicity", Europhysics Letters 114 (2016).

    Examples
    --------
    >>> import math, rocking
    >>> from rocking import dynamics
    >>> ball = dynamics.BouncingBall(0.5, gravity=10.0)
    >>> shaking = rocking.pulses.sine(1.3 * 10.0, 5.0, cycles=1)
    >>> found = dynamics.lyapunov_exponents(ball, shaking, [0.1, 0.5])
    >>> f"{found.largest:.6f} {found.smallest:.6f}, ln 0.5 = {math.log(0.5):.6f}"
    '-0.693147 -0.693147, ln 0.5 = -0.693147'
    """
    strobe = stroboscopic_map(body, motion, model=model, chattering=chattering)
    given = checks.numbers(state, "state", InvalidOption)
    if given.shape != (2,):
        raise InvalidOption(f"{{}} must be one pair (coordinate, velocity), not of shape {given.shape}", "state")
    strobe.checked_starts(given, "state")
    count = checks.whole(periods, "periods", InvalidOption, least=_BATCHES)
    before = checks.whole(transient, "transient", InvalidOption, least=0)
    made, marching = strobe._states(given[None])[1][0], strobe._marching()
    frame, logs, impacts = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]), np.full((before + count, 2), np.nan), 0
    for start, stop in pairwise(sorted({*range(0, before + count, TOGETHER), before, before + count})):
        here = stretch(*marching, made, frame, logs[start:stop])
        impacts += here if start >= before else 0
        if made["ending"] not in (Fate.MOVES, Fate.RESTS):
            break
    fate, logs = Fate(int(made["ending"])), logs[before:]
    if fate == Fate.RESTS_FOR_EVER:
        logs[np.isnan(logs)] = -np.inf
    rests = np.isneginf(logs[:, 0])
    if strobe._loses_nothing:  # what is near a rest never comes to one, and goes neither nearer nor away
        logs[rests] = 0.0
    # Weights of a mean over so many periods, all of whose derivatives vanish at both ends (Das and others 2016).
    at = (np.arange(count) + 0.5) / count
    bump = np.exp(-1.0 / (at * (1.0 - at)))
    weights: Floats = bump / bump.sum()
    known = ~np.isnan(logs).any(axis=1)
    mean, error = np.full(2, np.nan), float("nan")
    if known.all():  # else nothing is known of what would follow, whatever rests came before
        mean[:] = [-np.inf if np.isneginf(each).any() else weights @ each for each in logs.T]
    if np.isfinite(logs[:, 0]).all():  # the error of a plain mean, from those of consecutive parts
        means = [part.mean() for part in np.array_split(logs[:, 0], _BATCHES)]
        error = float(np.std(means, ddof=1) / np.sqrt(_BATCHES))
    return LyapunovExponents(
        largest=float(mean[0]),
        smallest=float(mean[1]),
        standard_error=error * float(np.sqrt(count * np.sum(weights**2))),
        period=strobe.period,
        periods=count,
        impacts=impacts / count,
        resting=float(np.mean(rests[known])) if known.any() else float("nan"),
        fate=fate,
        stretches=logs,
    )
