"""Restitution: numbers that follow from angular momentum, and laws by which it varies from impact to impact."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from rocking.block.limits import checked_length, checked_pair, checked_parameter
from rocking.core import checks
from rocking.errors import InvalidBlock

#: Most points at which a base meets the ground in turn: far beyond, rounding is what is left of the loss.
_MOST_POINTS: Final = 1_000_000

#: Largest seed: whole numbers up to it are floats, too.
_LARGEST_SEED: Final = 2**53

# ---- Numbers from angular momentum ----


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


def impact_restitution(
    alpha: float | None = None,
    *,
    contact: float = 1.0,
    points: int = 2,
    distances: Sequence[float] | None = None,
    height: float | None = None,
    radius_of_gyration: float | None = None,
) -> tuple[float, float]:
    """Restitution by angular momentum where the impulse is not at the new pivot, or there are several.

    Parameters
    ----------
    alpha : float, optional
        Slenderness of a rectangular block, rad. Of another body give the three sizes below in its place.
    contact : float
        Where the impulse of the impact acts, as a share of the distance from below the centre of mass to the new pivot:
        1 at the pivot as Housner has it, less where the contact is narrower or spread over a region.
    points : int
        At how many points, evenly from the old pivot to the new one, the base meets the ground, one after the other: 2
        are the pivots alone.
    distances : pair of float, optional
        Horizontal distances from the centre of mass to the pivots (side +, side -), m.
    height, radius_of_gyration : float, optional
        Height of the centre of mass above the pivots and sqrt(I/m) about it, m.

    Returns
    -------
    pair of float
        Factor on the angular speed on leaving side + and on leaving side -, for the `restitution` of a block.

    Raises
    ------
    InvalidBlock
        If a number is out of its range, there are both a slenderness and sizes or neither, or both a `contact` and
        `points`, the body would not rock on, or a `contact` is so narrow that an uneven body would gain energy.

    Notes
    -----
    With A = k^2 + h^2 and pivots at d_i and d_j from the centre of mass: e_i = (A - kappa d_i d_j)/(A + kappa d_j^2)
    for a contact kappa (after Kalliontzis, Sritharan and Schultz 2016, whose formula is mostly quoted with kappa^2 in
    the place of kappa: give the square of such a share); the product of (A + x y)/(A + y^2) over points x and their
    successors y, from one pivot to the other (after Ther and Kollar 2017). More points lose less, infinitely many no
    energy. (Derived in the documentation.)

    References
    ----------
    D. Kalliontzis, S. Sritharan and A. Schultz, "Improved coefficient of restitution estimation for free rocking
    members", Journal of Structural Engineering 142 (2016). T. Ther and L. P. Kollar, "Refinement of Housner's model on
    rocking blocks", Bulletin of Earthquake Engineering 15 (2017).

    Examples
    --------
    >>> [round(impact_restitution(0.3, contact=share)[0], 4) for share in (1.0, 0.8, 0.5)]
    [0.869, 0.8938, 0.9323]
    """
    if alpha is not None and (distances, height, radius_of_gyration) == (None, None, None):
        angle = checked_parameter(checks.finite(alpha, "alpha", InvalidBlock), "alpha")
        away, h, k = (math.sin(angle),) * 2, math.cos(angle), math.sqrt(1.0 / 3.0)
    elif alpha is None and not (distances is None or height is None or radius_of_gyration is None):
        plus, minus = checked_pair(distances, "distances")
        away = checked_length(plus, "distances"), checked_length(minus, "distances")
        h, k = checked_length(height, "height"), checked_length(radius_of_gyration, "radius_of_gyration")
    else:
        raise InvalidBlock(
            "give either {} of a rectangular block, or {}, {} and {} of a body",
            "alpha", "distances", "height", "radius_of_gyration",
        )  # fmt: skip
    share = checks.share(contact, "contact", InvalidBlock, below=math.nextafter(1.0, 2.0))
    count = checks.whole(points, "points", InvalidBlock, 2, _MOST_POINTS)
    if share < 1.0 and count > 2:
        raise InvalidBlock("give either a {} or {}, not both", "contact", "points")
    inertia = k * k + h * h
    found = _on_leaving(away, inertia, share, count), _on_leaving(away[::-1], inertia, share, count)
    if min(found) <= 0.0:
        raise InvalidBlock(
            f"angular momentum leaves this body a restitution of {min(found):.3g}: it is too stocky to rock that way"
        )
    if share < (least := _narrowest(away, inertia)):
        raise InvalidBlock(f"{{}} must be at least {least:.4g} for this body, which would gain energy", "contact")
    return found


def _narrowest(away: Sequence[float], inertia: float) -> float:
    """Least share at which no impact adds energy: a body gains some where it passes to the pivot further away."""
    near, far = sorted(away)
    ratio = math.sqrt((inertia + far * far) / (inertia + near * near))
    return inertia * (ratio - 1.0) / (far * (far + ratio * near))


def _on_leaving(away: Sequence[float], inertia: float, share: float, points: int) -> float:
    """Factor on leaving the first of two pivots, from their distances and k^2 + h^2."""
    if points == 2:
        return (inertia - share * away[0] * away[1]) / (inertia + share * away[1] ** 2)
    step = (away[0] + away[1]) / (points - 1)
    loss = 0.0
    for n in range(1, points):
        x = away[0] - n * step
        change = step * x / (inertia + x * x)
        if change <= -1.0:
            return 1.0 + change
        loss += math.log1p(change)
    return math.exp(loss)


# ---- Laws by which it varies ----


class Restitution(ABC):
    """A law by which the restitution of a `RestrainedBlock` varies from impact to impact, within bounds.

    Its largest factor takes the place of the restitution of each `Side`.
    """

    least: float | Sequence[float]
    largest: float | Sequence[float]

    @abstractmethod
    def _terms(self, side: int) -> dict[str, float]:
        """Return what is below the largest factor on leaving a side, as fields of `restraints.Terms`."""

    def _check_bounds(self) -> None:
        """Refuse bounds outside (0, 1], or in the wrong order."""
        for low, high in zip(checked_pair(self.least, "least"), checked_pair(self.largest, "largest"), strict=True):
            if not 0.0 < high <= 1.0:
                raise InvalidBlock(
                    f"{{}} must be in (0, 1], not {high:g}{checks.hint_of_percent(high)}", "largest", value=self.largest
                )
            if not 0.0 < low <= high:
                raise InvalidBlock(
                    f"{{}} must be above 0 and at most {{}}, {high:g}, not {low:g}", "least", "largest",
                    value=self.least,
                )  # fmt: skip


@dataclass(frozen=True)
class FallingRestitution(Restitution):
    """A restitution that falls in a straight line with the speed of the impact: max(least, largest - slope speed).

    Parameters
    ----------
    largest : float or pair
        Factor on the angular speed at an impact of no speed, in (0, 1]; a pair is (on leaving side +, side -).
    slope : float or pair
        How much it falls per angular speed before the impact, s/rad, at least 0.
    least : float or pair
        Factor below which it does not fall, above 0 and at most `largest`.

    Examples
    --------
    >>> from rocking import Block, RestrainedBlock, simulate
    >>> block = RestrainedBlock(Block(width=0.4, height=2.0), restitution=FallingRestitution(0.95, 0.2, least=0.8))
    >>> hits = simulate(block, None, initial_rotation=0.15).impacts
    >>> [round(float(hit["speed_after"] / hit["speed_before"]), 4) for hit in hits[:3]]
    [0.8473, 0.8629, 0.8749]
    """

    largest: float | Sequence[float]
    slope: float | Sequence[float]
    least: float | Sequence[float]

    def __post_init__(self) -> None:
        slopes = checked_pair(self.slope, "slope")
        if wrong := [slope for slope in slopes if not 0.0 <= slope < math.inf]:
            raise InvalidBlock(
                f"{{}} must be finite and at least 0, in s/rad, not {wrong[0]:g}: a faster impact loses more",
                "slope",
                value=self.slope,
            )
        self._check_bounds()

    def _terms(self, side: int) -> dict[str, float]:
        least, slope = checked_pair(self.least, "least")[side], checked_pair(self.slope, "slope")[side]
        return {"restitution_least": least, "restitution_slope": slope}

    def __str__(self) -> str:
        return f"restitution falling from {self.largest} by {self.slope} per rad/s to {self.least}"


@dataclass(frozen=True)
class RandomRestitution(Restitution):
    """A restitution that is drawn at each impact, evenly between two bounds, by Philox 2x32 with ten rounds.

    Parameters
    ----------
    least, largest : float or pair
        Bounds of the factor on the angular speed, in (0, 1]; a pair is (on leaving side +, on leaving side -).
    seed : int
        Whole number from 0 to 2^53. The factor depends on it and on the number of the impact alone: a body draws the
        same ones whatever shakes it, and whether it is simulated alone or with others. Give bodies seeds of their own.
        After a rest it goes on from the impacts that were resolved, of which a finer treatment has more.

    References
    ----------
    J. K. Salmon, M. A. Moraes, R. O. Dror and D. E. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 (2011).

    Examples
    --------
    >>> from rocking import Block, RestrainedBlock, simulate
    >>> block = RestrainedBlock(Block(width=0.4, height=2.0), restitution=RandomRestitution(0.9, 0.96, seed=1))
    >>> hits = simulate(block, None, initial_rotation=0.15).impacts
    >>> bool(all((hits["speed_after"] / hits["speed_before"] >= 0.9 - 1e-12)[:100]))
    True
    """

    least: float | Sequence[float]
    largest: float | Sequence[float]
    seed: int

    def __post_init__(self) -> None:
        self._check_bounds()
        checks.whole(self.seed, "seed", InvalidBlock, 0, _LARGEST_SEED)

    def _terms(self, side: int) -> dict[str, float]:
        return {"restitution_least": checked_pair(self.least, "least")[side], "restitution_seed": float(self.seed)}

    def __str__(self) -> str:
        return f"restitution drawn from {self.least} to {self.largest}, seed {self.seed}"
