"""Restitution: numbers that follow from angular momentum, and laws by which it varies from impact to impact."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from rocking.block.limits import checked_pair, checked_parameter
from rocking.core import checks
from rocking.errors import InvalidBlock

#: Largest seed: whole numbers up to it are floats, too.
_LARGEST_SEED: Final = 2**53


def housner_restitution(alpha: float) -> float:
    """Restitution of a rectangular block that conserves angular momentum: 1 - 1.5 sin(alpha)^2 (Housner 1963)."""
    return 1.0 - 1.5 * math.sin(checks.finite(alpha, "alpha", InvalidBlock)) ** 2


def one_sided_restitution(alpha: float) -> float:
    """Restitution of a wall that rocks against transverse walls, by angular momentum at three impacts.

    The wall meets the ground with its inner edge, then the transverse walls with its top, then the ground again
    (Sorrentino, AlShawa and Decanini 2011). A measured value is better.

    Parameters
    ----------
    alpha : float
        Slenderness, rad.

    Returns
    -------
    float
        The size of (1 - 1.5 sin(alpha)^2)^2 (1 - 1.5 cos(alpha)^2): 0.47 for a slenderness of 0.1.

    Examples
    --------
    >>> round(one_sided_restitution(0.1), 4)
    0.4707
    """
    angle = checked_parameter(checks.finite(alpha, "alpha", InvalidBlock), "alpha")
    sine, cosine = math.sin(angle), math.cos(angle)
    return abs((1.0 - 1.5 * sine * sine) ** 2 * (1.0 - 1.5 * cosine * cosine))


@dataclass(frozen=True)
class Restitution:
    """A law by which the restitution of a `RestrainedBlock` varies from impact to impact, between two bounds.

    With a slope it falls in a straight line with the speed of the impact: max(least, largest - slope speed). With a
    seed it is drawn at each impact, evenly between both, by Philox 2x32 with ten rounds.

    Parameters
    ----------
    largest, least : float or pair
        Bounds of the factor on the angular speed, in (0, 1]; a pair is (on leaving side +, on leaving side -). The
        largest takes the place of the restitution of each `Side`.
    slope : float or pair
        How much it falls per angular speed before the impact, s/rad, at least 0.
    seed : int, optional
        Whole number from 0 to 2^53. The factor depends on it and on the number of the impact alone: a body draws the
        same ones whatever shakes it, and whether it is simulated alone or with others. Give bodies seeds of their own.
        After a rest it goes on from the impacts that were resolved, of which a finer treatment has more.

    Raises
    ------
    InvalidBlock
        If a bound, the slope or the seed is out of its range, or there are both a slope and a seed.

    References
    ----------
    J. K. Salmon, M. A. Moraes, R. O. Dror and D. E. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 (2011).

    Examples
    --------
    >>> from rocking import Block, RestrainedBlock, simulate
    >>> block = RestrainedBlock(Block(width=0.4, height=2.0), restitution=Restitution(0.95, 0.8, slope=0.2))
    >>> hits = simulate(block, None, initial_rotation=0.15).impacts
    >>> [round(float(hit["speed_after"] / hit["speed_before"]), 4) for hit in hits[:3]]
    [0.8473, 0.8629, 0.8749]
    """

    largest: float | Sequence[float]
    least: float | Sequence[float]
    slope: float | Sequence[float] = 0.0
    seed: int | None = None

    def __post_init__(self) -> None:
        slopes = checked_pair(self.slope, "slope")
        if wrong := [slope for slope in slopes if not 0.0 <= slope < math.inf]:
            raise InvalidBlock(
                f"{{}} must be finite and at least 0, in s/rad, not {wrong[0]:g}: a faster impact loses more",
                "slope",
                value=self.slope,
            )
        for low, high in zip(checked_pair(self.least, "least"), checked_pair(self.largest, "largest"), strict=True):
            if not 0.0 < high <= 1.0:
                hint = checks.hint_of_percent(high)
                raise InvalidBlock(f"{{}} must be in (0, 1], not {high:g}{hint}", "largest", value=self.largest)
            if not 0.0 < low <= high:
                raise InvalidBlock(
                    f"{{}} must be above 0 and at most {{}}, {high:g}, not {low:g}", "least", "largest",
                    value=self.least,
                )  # fmt: skip
        if self.seed is not None:
            checks.whole(self.seed, "seed", InvalidBlock, 0, _LARGEST_SEED)
            if max(slopes) > 0.0:
                raise InvalidBlock("a restitution either falls or is drawn: give a {} or a {}", "slope", "seed")

    def _terms(self, side: int) -> dict[str, float]:
        """Return what is below the largest factor on leaving a side, as fields of `restraints.Terms`."""
        least, slope = (checked_pair(getattr(self, name), name)[side] for name in ("least", "slope"))
        seed = -1.0 if self.seed is None else float(self.seed)
        return {"restitution_least": least, "restitution_slope": slope, "restitution_seed": seed}

    def __str__(self) -> str:
        if self.seed is None:
            return f"restitution falling from {self.largest} by {self.slope} per rad/s to {self.least}"
        return f"restitution drawn from {self.least} to {self.largest}, seed {self.seed}"
