"""Parameter space of plausible blocks, and its coordinates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from rocking.block import Blocks, housner_restitution
from rocking.block.sides import compute_eccentric_rectangles
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import InvalidOption

#: Parameters of a block's side, in the order of the coordinates.
PARAMETERS: Final = ("p", "alpha", "restitution")

_UNITS: Final = {"p": "rad/s", "alpha": "rad", "restitution": "1", "initial": "rad"}

#: Largest values of a block's parameters.
HIGHEST: Final = {"p": math.inf, "alpha": 0.5 * math.pi, "restitution": 1.0}

#: The sides of a rigid body differ in slenderness as much as the pivots in distance from the centre of mass. Their p
#: and restitution differ only to second order, which outcomes do not reveal.
SIDED: Final = "alpha"


#: Restitution from the slenderness (Housner 1963), where positive. For two sides it comes from a rectangle with an
#: eccentric centre of mass. Then p is the rectangle's and differs from the sides' values.
HOUSNER: Final = "housner"
_HOUSNER_ENDS: Final = math.asin(math.sqrt(2.0 / 3.0))


#: Message for a problem without unknowns.
EVERYTHING_IS_KNOWN: Final = (
    "everything is known of the block, so that nothing is to be found: give a pair (lowest, highest) for what is not "
    "known, or ask what the known block does by simulate, and how probably it overturns by fragility"
)

Range = tuple[float, float]

#: Knowledge of a parameter: its value, its bounds, or for a restitution Housner's rule.
Knowledge = float | Range | Literal["housner"]


@dataclass(frozen=True, eq=False)
class Space:
    """Space of logarithms of the unknown parameters: p, slenderness (mean of both sides) and restitution.

    `lower` and `upper` are the logarithms of the bounds. A restitution that is neither unknown nor known follows from
    the slenderness. The last coordinate of a two-sided block is the logarithm of the ratio of its slendernesses.
    """

    unknown: tuple[str, ...]
    known: Mapping[str, float]
    lower: Floats
    upper: Floats
    ratio: float

    @classmethod
    def from_bounds(cls, p: Knowledge, alpha: Knowledge, restitution: Knowledge, *, two_sided: bool) -> Space:
        """Create the space of the unknown parameters."""
        bounds, known = {}, {}
        for name, given in zip(PARAMETERS, (p, alpha, restitution), strict=True):
            if isinstance(given, str):
                if name != "restitution" or given != HOUSNER:
                    wanted = "a value or a pair (lowest, highest)" + f", or {HOUSNER!r}" * (name == "restitution")
                    raise InvalidOption(f"{{}} must be {wanted}, not {given!r}", name, value=given)
            elif is_known(given):
                known[name] = known_value(np.ravel(given)[0], name)
            else:
                bounds[name] = value_range(given, name, HIGHEST[name])
        if not bounds:
            raise InvalidOption(EVERYTHING_IS_KNOWN)
        steepest = bounds.get("alpha", (0.0, known.get("alpha", 0.0)))[1]
        if "restitution" not in {*bounds, *known} and steepest >= _HOUSNER_ENDS:
            raise InvalidOption(
                f"Housner's restitution is positive for {{}} below {_HOUSNER_ENDS:.4f} rad only", "alpha"
            )
        lower, upper = np.log(list(bounds.values())).T
        ratio = 0.0
        if two_sided and SIDED in bounds:
            # Narrow bounds limit the ratio. Otherwise their box would be almost empty.
            ratio = min(math.log(3.0), math.log(bounds[SIDED][1] / bounds[SIDED][0]))
        return cls(tuple(bounds), known, lower, upper, ratio)

    @property
    def two_sided(self) -> bool:
        """Whether the sides may differ."""
        return self.ratio > 0.0

    @property
    def dispersions(self) -> Floats:
        """Prior median of the dispersion along each coordinate, shape (k,)."""
        return np.full(len(self.unknown) + self.two_sided, 0.10)

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lower and upper ends of the coordinates, shape (k,) each."""
        ratio = [self.ratio] if self.two_sided else []
        return np.concatenate([self.lower, np.negative(ratio)]), np.concatenate([self.upper, ratio])

    def quasi_random(self, count: int, rng: np.random.Generator) -> Floats:
        """Return points of a scrambled Halton sequence that lie in the space, which they fill evenly."""
        from scipy.stats import qmc

        low, high = self.box
        sequence = qmc.Halton(len(low), rng=rng)
        found = np.empty((0, len(low)))
        while len(found) < count:
            points = qmc.scale(sequence.random(count), low, high)
            found = np.concatenate([found, points[self.contains(points)]])
        return found[:count]

    @cached_property
    def volume(self) -> float:
        """Volume of the space, from its share of the box."""
        from scipy.stats import qmc

        low, high = self.box
        points = qmc.scale(qmc.Halton(len(low), scramble=False).random(20_000), low, high)
        return float(np.mean(self.contains(points)) * np.prod(high - low))

    def contains(self, points: Floats) -> NDArray[np.bool_]:
        """Return whether points lie in the box and each of their sides within its bounds."""
        low, high = self.box
        logs = self._log_sides(points)
        inside = np.all((logs >= self.lower) & (logs <= self.upper), axis=(1, 2))
        return np.asarray(inside & np.all((points >= low) & (points <= high), axis=1))

    def sides(self, points: Floats) -> dict[str, Floats]:
        """Return p, alpha and restitution by name, for side + and side -, shape (n, 2) each."""
        found = dict(zip(self.unknown, np.moveaxis(np.exp(self._log_sides(points)), 2, 0), strict=True))
        values = found | {name: np.full((len(points), 2), value) for name, value in self.known.items()}
        if "restitution" not in values and self.two_sided:
            factors, values["restitution"] = compute_eccentric_rectangles(values["alpha"])
            values["p"] = values["p"] * factors
        elif "restitution" not in values:
            values["restitution"] = np.vectorize(housner_restitution)(values["alpha"])
        return values

    def named(self, points: Floats) -> dict[str, Floats]:
        """Return the unknown parameters by name, for each side if they differ, shape (n,) each."""
        values = np.exp(self._log_sides(points))
        return {
            name + side: values[:, i, k]
            for k, name in enumerate(self.unknown)
            for i, side in enumerate(("_plus", "_minus") if self.two_sided and name == SIDED else ("",))
        }

    def blocks(self, points: Floats) -> Blocks:
        """Return the blocks at points."""
        sides = self.sides(points)
        # exp(log(1)) may exceed 1 by one unit in the last place.
        return Blocks(sides["p"], sides["alpha"], np.minimum(sides["restitution"], 1.0))

    def _log_sides(self, points: Floats) -> Floats:
        """Return logarithms of the unknown parameters on each side, shape (n, 2, f)."""
        f = len(self.unknown)
        half = np.zeros((len(points), f))
        if self.two_sided:
            half[:, self.unknown.index(SIDED)] = 0.5 * points[:, f]
        return np.stack([points[:, :f] + half, points[:, :f] - half], axis=1)


def unit_of(estimate: str) -> str:
    """Return the unit of an estimate: a parameter (of either side) or the initial rotation."""
    return _UNITS[estimate.partition("_")[0]]


def is_known(given: Any) -> bool:
    """Return whether a parameter has a value: a number, or a pair of equal numbers."""
    if isinstance(given, str) or not isinstance(given, Sequence | np.ndarray):
        return True
    return len(given) == 2 and all(np.ndim(end) == 0 for end in given) and bool(given[0] == given[1])


def known_value(value: object, name: str) -> float:
    """Return the value of a known parameter, within the range allowed for blocks."""
    known = checks.positive(value, name, InvalidOption, unit_of(name))
    if known > HIGHEST[name]:
        raise InvalidOption(f"{{}} must be at most {HIGHEST[name]:g}, not {known:g}", name, value=known)
    return known


def value_range(pair: Any, name: str, highest: float) -> Range:
    """Return the ends of a range, increasing numbers between 0 and `highest`."""
    try:
        low, high = (checks.real(value, f"each of {name}", InvalidOption) for value in pair)
    except (TypeError, ValueError):
        raise InvalidOption(f"{{}} must be a pair (lowest, highest), not {pair!r}", name, value=pair) from None
    if not 0.0 < low < high <= highest or math.isinf(high):
        limit = "" if math.isinf(highest) else f" and at most {highest:g}"
        hint = checks.hint_at_degrees(high) if name == "alpha" else ""
        raise InvalidOption(
            f"{{}} must be a pair (lowest, highest) of positive, increasing numbers{limit}, "
            f"not {low:g}, {high:g}{hint}",
            name,
            value=pair,
        )
    return low, high
