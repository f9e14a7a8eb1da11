"""Where plausible blocks are looked for, and what became of those that were tried."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rocking import checks
from rocking.arrays import Floats
from rocking.block import Blocks
from rocking.errors import InvalidOption

#: Parameters of a block's side, in the order of the coordinates.
PARAMETERS: Final = ("p", "alpha", "restitution")

#: What a block allows.
HIGHEST: Final = {"p": math.inf, "alpha": 0.5 * math.pi, "restitution": 1.0}

#: Largest ratios between the sides. A rigid body's two pivot radii are h/cos(alpha_i), so p hardly differs; the
#: slendernesses may differ as much as the pivots' distances from the centre of mass.
LARGEST_RATIOS: Final = {"p": 1.25, "alpha": 3.0, "restitution": 1.25}

#: Points that measure the space's volume: its share of the box to about 0.1 %.
_VOLUME_POINTS: Final = 20_000

Range = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Space:
    """Blocks in logarithmic coordinates: geometric means of both sides, then ratios of side + to side -.

    Attributes
    ----------
    lower, upper : ndarray, shape (3,)
        Logarithms of the bounds that each side's p, alpha and restitution keep to.
    ratios : ndarray, shape (3,) or (0,)
        Logarithms of the largest ratios between the sides; none for symmetric blocks.
    """

    lower: Floats
    upper: Floats
    ratios: Floats

    @classmethod
    def of(cls, p: Range, alpha: Range, restitution: Range, *, two_sided: bool) -> Space:
        """Space between bounds.

        Raises
        ------
        InvalidOption
            If a pair is not two increasing numbers in the range that blocks allow.
        """
        given = zip(PARAMETERS, (p, alpha, restitution), strict=True)
        bounds = np.array([value_range(pair, name, HIGHEST[name]) for name, pair in given])
        ratios = [LARGEST_RATIOS[name] for name in PARAMETERS] if two_sided else []
        return cls(np.log(bounds[:, 0]), np.log(bounds[:, 1]), np.log(ratios))

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lower and upper ends of the coordinates, shape (k,) each."""
        return np.concatenate([self.lower, -self.ratios]), np.concatenate([self.upper, self.ratios])

    def spread_evenly(self, count: int, rng: np.random.Generator) -> Floats:
        """Points that fill the space evenly: an additive recurrence with irrational steps, randomly shifted."""
        start = rng.random(len(self.box[0]))
        found, tried = np.empty((0, len(start))), 0
        while len(found) < count:
            points = self._recurrence(start, tried, count)
            found, tried = np.concatenate([found, points[self.contains(points)]]), tried + count
        return found[:count]

    def volume(self) -> float:
        """Volume of the space, from the share of its box that it fills."""
        low, high = self.box
        share = np.mean(self.contains(self._recurrence(np.zeros(len(low)), 1, _VOLUME_POINTS)))
        return float(share * np.prod(high - low))

    def contains(self, points: Floats) -> NDArray[np.bool_]:
        """Whether points lie in the box and each of their sides keeps to its bounds."""
        low, high = self.box
        logs = self._log_sides(points)
        inside = np.all((logs >= self.lower) & (logs <= self.upper), axis=(1, 2))
        return np.asarray(inside & np.all((points >= low) & (points <= high), axis=1))

    def sides(self, points: Floats) -> Floats:
        """Values of p, alpha and restitution on each side, shape (n, 2, 3)."""
        return np.exp(self._log_sides(points))

    def blocks(self, points: Floats) -> Blocks:
        """Blocks at points."""
        sides = self.sides(points)
        # exp(log(1)) may be one unit in the last place above 1.
        return Blocks(sides[:, :, 0], sides[:, :, 1], np.minimum(sides[:, :, 2], 1.0))

    def _recurrence(self, start: Floats, first: int, count: int) -> Floats:
        low, high = self.box
        return low + even_fractions(start, first, count) * (high - low)

    def _log_sides(self, points: Floats) -> Floats:
        half = 0.5 * points[:, 3:] if len(self.ratios) else np.zeros((len(points), 3))
        return np.stack([points[:, :3] + half, points[:, :3] - half], axis=1)


@dataclass(frozen=True, eq=False)
class Candidates:
    """Blocks that were tried on every motion.

    Attributes
    ----------
    space : Space
        Where they are from.
    points : ndarray, shape (n, k)
        Their coordinates.
    overturned : ndarray, shape (n, m)
        1 where a block overturned under a motion, else 0.
    log_weights : ndarray, shape (n,)
        Logarithm of how much of the space each stands for, up to a constant: dense regions weigh less per block.
    """

    space: Space
    points: Floats
    overturned: NDArray[np.float32]
    log_weights: Floats = field(repr=False)


def even_fractions(start: Floats, first: int, count: int) -> Floats:
    """Members of an additive recurrence that fills the unit cube evenly, shape (count, d).

    Its steps are powers of the root of x^(d + 1) = x + 1, the golden ratio for d = 1 (Roberts 2018).
    """
    dimensions = len(start)
    root = 1.5
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    steps = root ** -np.arange(1.0, dimensions + 1)
    return np.asarray((start + np.outer(np.arange(first, first + count), steps)) % 1.0)


def value_range(pair: Sequence[float], name: str, highest: float) -> Range:
    """Return the two ends of a range.

    Raises
    ------
    InvalidOption
        If they are not two increasing numbers between 0 and `highest`.
    """
    try:
        low, high = (checks.number(value, f"each of {name}", InvalidOption) for value in pair)
    except (TypeError, ValueError):
        raise InvalidOption(f"{name} must be a pair (lowest, highest), not {pair!r}") from None
    if not 0.0 < low < high <= highest or math.isinf(high):
        limit = "" if math.isinf(highest) else f" and at most {highest:g}"
        raise InvalidOption(f"{name} must be a pair (lowest, highest) of positive, increasing numbers{limit}")
    return low, high
