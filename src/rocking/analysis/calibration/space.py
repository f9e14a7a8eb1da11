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

_UNITS: Final = {"p": "rad/s", "alpha": "rad", "restitution": "1", "initial": "rad"}

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
        lower, upper = np.log(bounds.T)
        largest = np.log([LARGEST_RATIOS[name] for name in PARAMETERS])
        # No wider than the bounds of a side let them be: else a box around narrow bounds would be all but empty.
        return cls(lower, upper, np.minimum(largest, upper - lower) if two_sided else np.empty(0))

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lower and upper ends of the coordinates, shape (k,) each."""
        return np.concatenate([self.lower, -self.ratios]), np.concatenate([self.upper, self.ratios])

    def spread_evenly(self, count: int, rng: np.random.Generator) -> Floats:
        """Points that fill the space evenly: those of a scrambled Halton sequence that lie in it."""
        from scipy.stats import qmc

        low, high = self.box
        sequence = qmc.Halton(len(low), rng=rng)
        found = np.empty((0, len(low)))
        while len(found) < count:
            points = qmc.scale(sequence.random(count), low, high)
            found = np.concatenate([found, points[self.contains(points)]])
        return found[:count]

    def volume(self) -> float:
        """Volume of the space, from the share of its box that it fills."""
        from scipy.stats import qmc

        low, high = self.box
        points = qmc.scale(qmc.Halton(len(low), scramble=False).random(_VOLUME_POINTS), low, high)
        return float(np.mean(self.contains(points)) * np.prod(high - low))

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


def unit_of(estimate: str) -> str:
    """Return the unit of an estimate: of a parameter, of either side, or of the initial rotation."""
    return _UNITS[estimate.partition("_")[0]]


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
        hint = checks.hint_of_degrees(high) if name == "alpha" else ""
        kind = "positive, increasing numbers"
        raise InvalidOption(f"{name} must be a pair (lowest, highest) of {kind}{limit}, not {low:g}, {high:g}{hint}")
    return low, high
