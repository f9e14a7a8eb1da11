"""Parameter space of plausible blocks, and its coordinates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from rocking.block import Blocks
from rocking.block.sides import compute_eccentric_rectangles, housner_restitution
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import OptionError

#: Parameters of a block's side, in the order of the coordinates.
PARAMETERS: Final = ("p", "alpha", "restitution")

_UNITS: Final = {"p": "rad/s", "alpha": "rad", "restitution": "1", "initial": "rad"}

#: Largest values of a block's parameters.
MAX_VALUES: Final = {"p": math.inf, "alpha": 0.5 * math.pi, "restitution": 1.0}

#: The sides of a rigid body differ in slenderness as much as the pivots in distance from the centre of mass. Their p
#: and restitution differ only to second order, which outcomes do not reveal.
SIDED_PARAMETER: Final = "alpha"


#: Restitution from the slenderness (Housner 1963), where positive. For two sides it comes from a rectangle with an
#: eccentric centre of mass. Then p is the rectangle's and differs from the sides' values.
HOUSNER: Final = "housner"
_MAX_HOUSNER_ALPHA: Final = math.asin(math.sqrt(2.0 / 3.0))


#: Message for a problem without unknowns.
NO_UNKNOWNS: Final = (
    "all parameters are known, so that there is nothing to estimate: use a pair (lowest, highest) for each unknown "
    "parameter, or call simulate or fragility with the known block"
)

Range = tuple[float, float]

#: Input of a parameter: its value, its bounds, or for a restitution Housner's rule.
ValueOrBounds = float | Range | Literal["housner"]


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
    max_log_ratio: float

    @classmethod
    def from_bounds(
        cls, p: ValueOrBounds, alpha: ValueOrBounds, restitution: ValueOrBounds, *, two_sided: bool
    ) -> Space:
        """Create the space of the unknown parameters."""
        bounds, known = {}, {}
        for name, value in zip(PARAMETERS, (p, alpha, restitution), strict=True):
            if isinstance(value, str):
                if name != "restitution" or value != HOUSNER:
                    alternatives = "a value or a pair (lowest, highest)" + f", or {HOUSNER!r}" * (name == "restitution")
                    raise OptionError(f"{{}} must be {alternatives}; got {value!r}", name, value=value)
            elif is_known(value):
                known[name] = check_known_value(np.ravel(value)[0], name)
            else:
                bounds[name] = parse_range(value, name, MAX_VALUES[name])
        if not bounds:
            raise OptionError(NO_UNKNOWNS)
        max_alpha = bounds.get("alpha", (0.0, known.get("alpha", 0.0)))[1]
        if "restitution" not in {*bounds, *known} and max_alpha >= _MAX_HOUSNER_ALPHA:
            message = f"Housner's restitution is positive for {{}} below {_MAX_HOUSNER_ALPHA:.4f} rad only"
            raise OptionError(message, "alpha")
        lower, upper = np.log(list(bounds.values())).T
        max_log_ratio = 0.0
        if two_sided and SIDED_PARAMETER in bounds:
            # Narrow bounds limit the ratio. Otherwise their box would be almost empty.
            max_log_ratio = min(math.log(3.0), math.log(bounds[SIDED_PARAMETER][1] / bounds[SIDED_PARAMETER][0]))
        return cls(tuple(bounds), known, lower, upper, max_log_ratio)

    @property
    def is_two_sided(self) -> bool:
        """Whether the sides may differ."""
        return self.max_log_ratio > 0.0

    @property
    def dispersions(self) -> Floats:
        """Prior median of the dispersion along each coordinate, shape (k,)."""
        return np.full(len(self.unknown) + self.is_two_sided, 0.10)

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lower and upper ends of the coordinates, shape (k,) each."""
        ratio = [self.max_log_ratio] if self.is_two_sided else []
        return np.concatenate([self.lower, np.negative(ratio)]), np.concatenate([self.upper, ratio])

    def sample_quasi_randomly(self, count: int, rng: np.random.Generator) -> Floats:
        """Return points of a scrambled Halton sequence that lie in the space, which they fill evenly."""
        from scipy.stats import qmc

        low, high = self.box
        sequence = qmc.Halton(len(low), rng=rng)
        inside = np.empty((0, len(low)))
        while len(inside) < count:
            points = qmc.scale(sequence.random(count), low, high)
            inside = np.concatenate([inside, points[self.contains(points)]])
        return inside[:count]

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
        logs = self._compute_log_sides(points)
        inside = np.all((logs >= self.lower) & (logs <= self.upper), axis=(1, 2))
        return np.asarray(inside & np.all((points >= low) & (points <= high), axis=1))

    def sides(self, points: Floats) -> dict[str, Floats]:
        """Return p, alpha and restitution by name, for side + and side -, shape (n, 2) each."""
        unknown_values = dict(
            zip(self.unknown, np.moveaxis(np.exp(self._compute_log_sides(points)), 2, 0), strict=True)
        )
        values = unknown_values | {name: np.full((len(points), 2), value) for name, value in self.known.items()}
        if "restitution" not in values and self.is_two_sided:
            factors, values["restitution"] = compute_eccentric_rectangles(values["alpha"])
            values["p"] = values["p"] * factors
        elif "restitution" not in values:
            values["restitution"] = np.vectorize(housner_restitution)(values["alpha"])
        return values

    def parameters_by_name(self, points: Floats) -> dict[str, Floats]:
        """Return the unknown parameters by name, for each side if they differ, shape (n,) each."""
        values = np.exp(self._compute_log_sides(points))
        return {
            name + side: values[:, i, k]
            for k, name in enumerate(self.unknown)
            for i, side in enumerate(("_plus", "_minus") if self.is_two_sided and name == SIDED_PARAMETER else ("",))
        }

    def blocks(self, points: Floats) -> Blocks:
        """Return the blocks at points."""
        sides = self.sides(points)
        # exp(log(1)) may exceed 1 by one unit in the last place.
        return Blocks(sides["p"], sides["alpha"], np.minimum(sides["restitution"], 1.0))

    def _compute_log_sides(self, points: Floats) -> Floats:
        """Return logarithms of the unknown parameters on each side, shape (n, 2, f)."""
        f = len(self.unknown)
        half = np.zeros((len(points), f))
        if self.is_two_sided:
            half[:, self.unknown.index(SIDED_PARAMETER)] = 0.5 * points[:, f]
        return np.stack([points[:, :f] + half, points[:, :f] - half], axis=1)


def find_parameter_unit(estimate: str) -> str:
    """Return the unit of an estimate: a parameter (of either side) or the initial rotation."""
    return _UNITS[estimate.partition("_")[0]]


def is_known(value: Any) -> bool:
    """Return whether a parameter has a value: a number, or a pair of equal numbers."""
    if isinstance(value, str) or not isinstance(value, Sequence | np.ndarray):
        return True
    return len(value) == 2 and all(np.ndim(end) == 0 for end in value) and bool(value[0] == value[1])


def check_known_value(value: object, name: str) -> float:
    """Check a known parameter against the range allowed for blocks."""
    known = checks.positive(value, name, OptionError, find_parameter_unit(name))
    if known > MAX_VALUES[name]:
        raise OptionError(f"{{}} must be at most {MAX_VALUES[name]:g}, not {known:g}", name, value=known)
    return known


def parse_range(pair: Any, name: str, max_value: float) -> Range:
    """Parse the ends of a range, increasing numbers between 0 and `max_value`."""
    try:
        low, high = (checks.real(value, f"each of {name}", OptionError) for value in pair)
    except (TypeError, ValueError):
        raise OptionError(f"{{}} must be a pair (lowest, highest), not {pair!r}", name, value=pair) from None
    if not 0.0 < low < high <= max_value or math.isinf(high):
        limit = "" if math.isinf(max_value) else f" and at most {max_value:g}"
        correction = checks.hint_at_degrees(high) if name == "alpha" else ""
        message = f"{{}} must be a pair (lowest, highest) of positive, increasing numbers{limit}"
        raise OptionError(f"{message}, not {low:g}, {high:g}{correction}", name, value=pair)
    return low, high
