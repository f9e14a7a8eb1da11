"""Sides of a block: bounds of parameters, restitution, and the rigid body with these sides."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import BlockError

Number = TypeVar("Number", float, Floats)

# Smallest and largest values, both included. They are far beyond any block, and far enough from the limits of double
# precision for fourth powers of p, for the ratio of the largest acceleration of a motion to gravity and slenderness,
# and for products of all these. Below the smallest restitution, one impact ends rocking, to double precision.
_GRAVITY: Final = (1e-6, 1e6)
_LENGTH: Final = (1e-20, 1e20)
_MASS: Final = (1e-30, 1e30)
_BOUNDS: Final = {
    "p": (1e-6, 1e6, "positive, from 1e-06 to 1e+06 rad/s"),
    "alpha": (1e-9, math.nextafter(0.5 * math.pi, 0.0), "from 1e-09 to below pi/2 rad"),
    "restitution": (1e-9, 1.0, "in (0, 1], at least 1e-09"),
}

#: Largest number of contact points. Far beyond it, the loss is below rounding error.
_MAX_POINTS: Final = 1_000_000


def check_parameter(value: float, name: str, *, origin: str = "", label: str = "") -> float:
    """Return p, alpha or restitution of a side, or raise BlockError that names its origin and its block."""
    low, high, range_text = _BOUNDS[name]
    if not low <= value <= high:
        hint = checks.hint_at_degrees(value) if name == "alpha" else ""
        hint = checks.hint_at_percent(value) if name == "restitution" else hint
        raise BlockError(f"{{}}{origin} must be {range_text}, not {value:g}{label}{hint}", name, value=value)
    return value


def check_sides(values: Floats, name: str) -> Floats:
    """Return p, alpha or restitution, shape (n, 2), or raise BlockError for the first one out of range."""
    low, high, _ = _BOUNDS[name]
    invalid = np.argwhere(~((values >= low) & (values <= high)))
    if len(invalid):
        check_parameter(float(values[tuple(invalid[0])]), name, label=f" (block {invalid[0][0]})")
    return values


def check_gravity(gravity: object) -> float:
    """Return an acceleration of gravity, m/s^2, or raise BlockError."""
    return checks.positive(gravity, "gravity", BlockError, "m/s^2", _GRAVITY)


def check_mass(mass: object) -> float:
    """Return a mass, kg, or raise BlockError."""
    return checks.positive(mass, "mass", BlockError, "kg", _MASS)


def check_length(value: object, name: str) -> float:
    """Return a length, m, or raise BlockError."""
    return checks.positive(value, name, BlockError, "m", _LENGTH)


def check_pair(value: Any, name: str) -> tuple[float, float]:
    """Return a number, or a pair (side +, side -), as two numbers."""
    if type(value) is float:
        return value, value
    values = checks.numbers(value, name, BlockError)
    if values.shape not in ((), (2,)):
        message = f"{{}} must be a number or a pair (side +, side -), not {values.size} values"
        raise BlockError(message, name, value=value)
    plus, minus = np.broadcast_to(values, 2).tolist()
    return plus, minus


def housner_restitution(alpha: float) -> float:
    """Compute the restitution of a rectangle, 1 - 1.5 sin(alpha)^2, from angular momentum (:cite:t:`housner1963`)."""
    return 1.0 - 1.5 * math.sin(checks.finite(alpha, "alpha", BlockError)) ** 2


def one_sided_restitution(alpha: float) -> float:
    """Compute the restitution of a wall that rocks against transverse walls, from angular momentum at three impacts.

    The wall hits the ground with its inner edge, the transverse walls with its top, and the ground again
    (:cite:t:`sorrentino2011`). A measured value is preferable.

    Parameters
    ----------
    alpha : float
        Slenderness, rad.

    Returns
    -------
    float
        Absolute value of (1 - 1.5 sin(alpha)^2)^2 (1 - 1.5 cos(alpha)^2): 0.47 for a slenderness of 0.1.

    See Also
    --------
    Block.one_sided : Create a rectangular block with a single side.

    Examples
    --------
    >>> round(one_sided_restitution(0.1), 4)
    0.4707
    """
    angle = check_parameter(checks.finite(alpha, "alpha", BlockError), "alpha")
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
    """Compute the restitution from angular momentum for a narrow contact or several contact points.

    Parameters
    ----------
    alpha : float, optional
        Slenderness of a rectangular block, rad, instead of the three sizes below.
    contact : float
        Position of the impulse between the point below the centre of mass (0) and the new pivot (1, Housner). A
        narrower or distributed contact has a smaller value.
    points : int
        Number of evenly spaced points, from the old to the new pivot, at which the base meets the ground in turn; 2
        for the pivots only.
    distances : pair of float, optional
        Horizontal distances from the centre of mass to the pivots (side +, side -), m.
    height, radius_of_gyration : float, optional
        Height of the centre of mass above the pivots and sqrt(I/m) about the centre of mass, m.

    Returns
    -------
    pair of float
        Factor on the angular speed on leaving side + and on leaving side -, for the `restitution` of a block.

    Raises
    ------
    BlockError
        If a value is out of range, both or neither of slenderness and sizes are given, both `contact` and `points` are
        given, the body would not continue to rock, or `contact` is so narrow that an uneven body would gain energy.

    See Also
    --------
    Block.from_pivots : Create a block from its pivots and its radius of gyration.

    Notes
    -----
    With A = k^2 + h^2 and pivots at d_i and d_j from the centre of mass, e_i = (A - kappa d_i d_j)/(A + kappa d_j^2)
    for a contact kappa (after :cite:t:`kalliontzis2016`, whose formula is mostly quoted with kappa^2 in place of
    kappa; square such a value). For several points, e_i is the product of (A + x y)/(A + y^2) over points x and their
    successors y (after :cite:t:`ther2017`). (Derived in the documentation.)

    Examples
    --------
    >>> [round(impact_restitution(0.3, contact=share)[0], 4) for share in (1.0, 0.8, 0.5)]
    [0.869, 0.8938, 0.9323]
    """
    if alpha is not None and distances is None and height is None and radius_of_gyration is None:
        angle = check_parameter(checks.finite(alpha, "alpha", BlockError), "alpha")
        arms, h, k = (math.sin(angle),) * 2, math.cos(angle), math.sqrt(1.0 / 3.0)
    elif alpha is None and not (distances is None or height is None or radius_of_gyration is None):
        plus, minus = check_pair(distances, "distances")
        arms = check_length(plus, "distances"), check_length(minus, "distances")
        h, k = check_length(height, "height"), check_length(radius_of_gyration, "radius_of_gyration")
    else:
        message = "give either {} for a rectangular block, or {}, {} and {} for another body"
        raise BlockError(message, "alpha", "distances", "height", "radius_of_gyration")
    kappa = checks.fraction(contact, "contact", BlockError, below=math.nextafter(1.0, 2.0))
    count = checks.integer(points, "points", BlockError, 2, _MAX_POINTS)
    if kappa < 1.0 and count > 2:
        raise BlockError("give either a {} or {}, not both", "contact", "points")
    inertia = k * k + h * h
    factors = (_compute_factor(arms, inertia, kappa, count), _compute_factor(arms[::-1], inertia, kappa, count))
    if min(factors) <= 0.0:
        result = f"gives this body a restitution of {min(factors):.3g}, because it is too stocky"
        raise BlockError(f"conservation of angular momentum {result}; use a more slender one")
    short, long = sorted(arms)
    ratio = math.sqrt((inertia + long * long) / (inertia + short * short))  # ratio of the speeds without energy loss
    min_kappa = inertia * (ratio - 1.0) / (long * (long + ratio * short))
    if kappa < min_kappa:
        message = f"{{}} must be at least {min_kappa:.4g}, because this body would otherwise gain energy"
        raise BlockError(message, "contact")
    return factors


def _compute_factor(distances: Sequence[float], inertia: float, kappa: float, points: int) -> float:
    """Compute the factor on leaving the first of two pivots, from their distances and k^2 + h^2."""
    if points == 2:
        return (inertia - kappa * distances[0] * distances[1]) / (inertia + kappa * distances[1] ** 2)
    step = (distances[0] + distances[1]) / (points - 1)
    loss = 0.0
    for n in range(1, points):
        x = distances[0] - n * step
        change = step * x / (inertia + x * x)
        if change <= -1.0:
            return 1.0 + change
        loss += math.log1p(change)
    return math.exp(loss)


@dataclass(frozen=True)
class Side:
    """Parameters of a block while it leans to one side.

    Attributes
    ----------
    p : float
        Frequency parameter, rad/s.
    alpha : float
        Slenderness, rad: the angle between the vertical and the line from the pivot to the centre of mass.
    restitution : float
        Factor on the angular speed when the block leaves this side at an impact.
    radius : float
        Distance R from the pivot to the centre of mass, m.
    arm : float or None
        Momentum divided by mass and angular speed, m, which determines the ground forces. None if it equals the
        radius, as for all blocks except frames.

    See Also
    --------
    rocking.Block : Create a block with two sides.
    rocking.impact_restitution : Compute the restitution of both sides.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.4, height=2.0, offset=0.05)
    >>> [f"{side.alpha:.4f} rad" for side in block.sides]
    ['0.1489 rad', '0.2450 rad']
    """

    p: float
    alpha: float
    restitution: float
    radius: float
    arm: float | None = None

    def __str__(self) -> str:
        """Return the parameters as readable text."""
        return f"p = {self.p:.5g} rad/s, alpha = {self.alpha:.5g} rad, restitution = {self.restitution:.5g}"

    def __repr__(self) -> str:
        return f"<Side: {self}, R = {self.radius:.5g} m>"


def format_sides(sides: Sequence[object]) -> str:
    """Return the parameters in one line, by side if they differ."""
    if len(sides) == 1 or sides[0] == sides[1]:
        return str(sides[0])
    return "; ".join(f"side {sign}: {side}" for sign, side in zip("+-", sides, strict=True))


def create_even_sides(
    gravity: float, radius: float, alpha: float, restitution: object, conserved: float, arm: float | None = None
) -> tuple[Side, Side]:
    """Return both sides of a body that rocks like a rectangle of this radius, m, and slenderness, rad."""
    plus, minus = choose_restitutions(restitution, (conserved, conserved))
    p = math.sqrt(0.75 * gravity / radius)
    return Side(p, alpha, plus, radius, arm), Side(p, alpha, minus, radius, arm)


def create_sides(
    distances: tuple[float, float], height: float, gyration_squared: float, gravity: float, restitution: object
) -> tuple[Side, Side]:
    """Return the sides of a body, from its pivot distances, the height of its centre of mass, m, and k^2, m^2."""
    plus, minus = distances
    radii = math.hypot(plus, height), math.hypot(minus, height)
    inertias = [gyration_squared + radius * radius for radius in radii]
    numerator = gyration_squared + height * height - plus * minus
    e = choose_restitutions(restitution, (numerator / inertias[1], numerator / inertias[0]))
    first, second = (
        Side(math.sqrt(gravity * radius / inertia), math.atan2(distance, height), factor, radius)
        for distance, radius, inertia, factor in zip(distances, radii, inertias, e, strict=True)
    )
    return first, second


def choose_restitutions(restitution: object, conserved: Sequence[float]) -> tuple[float, float]:
    """Return the given restitutions, by default the ones that conserve angular momentum."""
    if restitution is None:
        if min(conserved) <= 0.0:
            result = f"gives this block a restitution of {min(conserved):.3g}, because it is too stocky"
            hint = "correct its sizes if they are swapped, or set {} to a value in (0, 1]"
            raise BlockError(f"conservation of angular momentum {result}; {hint}", "restitution")
        return conserved[0], conserved[1]
    if hasattr(restitution, "maximum"):  # a Restitution, whose module imports this one
        message = "{} of a Block must be a number or a pair; for a law, use RestrainedBlock(block, restitution=...)"
        raise BlockError(message, "restitution")
    plus, minus = (check_parameter(value, "restitution") for value in check_pair(restitution, "restitution"))
    return plus, minus


#: Largest relative difference between parameters of sides that count as equal.
_EQUALITY_TOLERANCE: Final = 1e-9


def compute_rigid_bodies(p: Floats, alpha: Floats) -> tuple[Floats, Floats]:
    """Compute the rigid bodies whose sides have these parameters, arrays of shape (n, 2).

    Returns the restitutions by angular momentum, NaN without such a body, and the height of the centre of mass divided
    by gravity, s^2, shape (n,), NaN for equal sides, as of a rectangle.

    With depth h, e_i = 1 - (h p_j^2/g) sin(alpha_j) (tan(alpha_+) + tan(alpha_-)), j the other side. A body with
    positive h and k exists if |ln(p_+/p_-)| < |ln(cos(alpha_+)/cos(alpha_-))|/2 (derived in the documentation).
    """
    cosine, tangent = np.cos(alpha), np.tan(alpha)
    quotient = 1.0 / (cosine * p**2)  # (k^2 + R^2)/(g h)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (quotient[:, 0] - quotient[:, 1]) / (tangent[:, 0] - tangent[:, 1])
        factors: Floats = 1.0 - np.sin(alpha[:, ::-1]) * p[:, ::-1] ** 2 * slope[:, None]
        height_over_gravity = slope / tangent.sum(axis=1)
    difference, bound = _compare_sides(p, cosine)
    factors[difference >= bound] = np.nan
    equal = np.all(
        [abs(values[:, 0] - values[:, 1]) <= _EQUALITY_TOLERANCE * values[:, 0] for values in (p, alpha)], axis=0
    )
    factors[equal] = 1.0 - 1.5 * np.sin(alpha[equal]) ** 2
    height_over_gravity[equal] = np.nan
    return factors, height_over_gravity


def _compare_sides(p: Floats, cosine: Floats) -> tuple[Floats, Floats]:
    """Return logarithmic differences of p between sides, and their bounds for a rigid body."""
    return np.abs(np.log(p[:, 0] / p[:, 1])), 0.5 * np.abs(np.log(cosine[:, 0] / cosine[:, 1]))


def describe_missing_body(p: Floats, alpha: Floats) -> str:
    """Return the message that no rigid body has the p and alpha of two sides."""
    comparison = _compare_sides(p[None], np.cos(alpha)[None])
    difference, bound = (100.0 * math.expm1(float(values[0])) for values in comparison)
    return (
        f"no rigid body has p = {p[0]:g} and {p[1]:g} rad/s on sides of alpha = {alpha[0]:g} and {alpha[1]:g} rad; its "
        f"p must differ by less than {bound:.2g} %, not by {difference:.2g} %; give p and alpha with more digits, or "
        "set {} to a value in (0, 1]"
    )


def compute_eccentric_rectangles(alpha: Floats) -> tuple[Floats, Floats]:
    """Compute rectangles with an offset centre of mass and these slendernesses, shape (n, 2).

    Returns p of each side divided by p of the symmetric rectangle, and the restitutions by angular momentum.
    """
    distances = np.tan(alpha)  # divided by the height of the centre of mass
    half_width, offset = 0.5 * distances.sum(axis=1), 0.5 * (distances[:, 1] - distances[:, 0])
    gyration_squared = compute_gyration_squared(half_width, 1.0, offset)[:, None]
    radius = np.hypot(distances, 1.0)
    inertia = gyration_squared + radius**2
    p = np.sqrt(radius / inertia * (4.0 / 3.0) * np.hypot(half_width, 1.0)[:, None])
    numerator = gyration_squared + 1.0 - np.prod(distances, axis=1, keepdims=True)
    return p, numerator / inertia[:, ::-1]


def compute_gyration_squared(half_width: Number, half_height: float, offset: Number) -> Number:
    """Return the squared radius of gyration, m^2, of a rectangle with an offset centre of mass."""
    return (half_width * half_width + half_height * half_height) / 3.0 - offset * offset
