"""What rocks: free-standing rigid blocks, symmetric or with two different sides."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from rocking import checks, svg
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidBlock, InvalidOption

Number = float | int
Sided = float | tuple[float, float]


class Limits(NamedTuple):
    """Lowest and highest value of a parameter, both included."""

    low: float
    high: float


# Far beyond any block, and far enough from the ends of double precision for fourth powers of p, for the quotients of
# a motion's largest acceleration with gravity and slenderness, and for products of all of them.
P: Final = Limits(1e-6, 1e6)
ALPHA: Final = Limits(1e-9, 0.5 * math.pi)
GRAVITY: Final = Limits(1e-6, 1e6)
#: Restitution; below it one impact is the end of rocking, to double precision.
RESTITUTION: Final = Limits(1e-9, 1.0)
_LENGTH: Final = Limits(1e-20, 1e20)
_MASS: Final = Limits(1e-30, 1e30)
_HEAVIEST_BEAM: Final = 1e12
#: Longer side of a block's picture, pixels.
_PICTURED: Final = 120.0


@dataclass(frozen=True)
class Side:
    """One side of a block: what counts while it leans to that side.

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
    """

    p: float
    alpha: float
    restitution: float
    radius: float

    def __str__(self) -> str:
        """Return the parameters as people read them."""
        return f"p = {self.p:.5g} rad/s, alpha = {self.alpha:.5g} rad, restitution = {self.restitution:.5g}"

    def __repr__(self) -> str:
        return f"<Side: {self}, R = {self.radius:.5g} m>"


@dataclass(frozen=True)
class Block:
    """A free-standing rigid block that rocks without sliding or bouncing.

    Made from the sizes of a rectangular block here, or by `from_parameters`, `from_pivots` and `from_frame`.

    Parameters
    ----------
    half_width, half_height : float
        Half the width b and half the height h of a rectangular block, m.
    width, height : float
        The full sizes instead, m.
    restitution : float or pair, optional
        Factor on the angular speed at an impact, in (0, 1]; a pair is (on leaving side +, on leaving side -).
        By default Housner's, 1 - 1.5 sin(alpha)^2, which conserves angular momentum about the new pivot.
    mass : float, optional
        Mass, kg; it only scales forces and moments of inertia.
    gravity : float
        Acceleration of gravity, m/s^2.

    Raises
    ------
    InvalidBlock
        If the sizes are neither two halves nor two full ones, one is not positive and finite, the restitution is
        outside (0, 1], or Housner's is not positive.

    Notes
    -----
    alpha = atan(b/h), R = hypot(b, h), p = sqrt(3 g/(4 R)) (paper, section 2; Housner 1963).

    Examples
    --------
    >>> block = Block(half_width=0.2, half_height=1.0)
    >>> round(block.alpha, 6), round(block.p, 6), round(block.restitution, 6)
    (0.197396, 2.685546, 0.942308)
    >>> round(block.minimum_acceleration, 6)
    1.96133
    >>> Block(width=0.4, height=2.0)
    <Block: rectangular block, 0.4 m x 2 m; p = 2.6855 rad/s, alpha = 0.1974 rad, restitution = 0.94231>
    """

    sides: tuple[Side, Side]
    gravity: float
    description: str
    half_width: float | None
    half_height: float | None
    mass: float | None

    def __init__(
        self,
        half_width: float | None = None,
        half_height: float | None = None,
        *,
        width: float | None = None,
        height: float | None = None,
        restitution: Number | Sequence[Number] | None = None,
        mass: float | None = None,
        gravity: float = STANDARD_GRAVITY,
    ) -> None:
        b, h = _half_sizes((half_width, half_height), (width, height))
        g = within(gravity, "gravity", GRAVITY, "m/s^2")
        alpha, radius = math.atan2(b, h), math.hypot(b, h)
        p = math.sqrt(0.75 * g / radius)
        e = _restitutions(restitution, (housner_restitution(alpha),) * 2, _perhaps_swapped(b, h))
        sides = (Side(p, alpha, e[0], radius), Side(p, alpha, e[1], radius))
        _fill(self, sides, g, f"rectangular block, {2 * b:.5g} m x {2 * h:.5g} m", b, h, mass)

    @classmethod
    def from_parameters(
        cls,
        p: Number | Sequence[Number],
        alpha: Number | Sequence[Number],
        restitution: Number | Sequence[Number] | None = None,
        *,
        gravity: float = STANDARD_GRAVITY,
    ) -> Block:
        """Block from its dynamic parameters, each a number or a pair (side +, side -).

        Parameters
        ----------
        p : float or pair
            Frequency parameter, rad/s.
        alpha : float or pair
            Slenderness, rad, between 0 and pi/2.
        restitution : float or pair, optional
            Factor on the angular speed on leaving a side, in (0, 1]; by default Housner's from alpha.
        gravity : float
            Acceleration of gravity, m/s^2.

        Returns
        -------
        Block
            Its radius is that of a rectangular block with the same p, R = 3 g/(4 p^2).

        Raises
        ------
        InvalidBlock
            If a parameter is out of its range.

        Examples
        --------
        >>> Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92).restitution
        0.92
        >>> Block.from_parameters(p=(2.5, 2.2), alpha=(0.12, 0.2), restitution=(0.9, 0.85)).alpha
        (0.12, 0.2)
        """
        g = within(gravity, "gravity", GRAVITY, "m/s^2")
        rates = [within(value, "p", P, "rad/s") for value in _pair(p, "p")]
        angles = [_angle(value) for value in _pair(alpha, "alpha")]
        e = _restitutions(restitution, tuple(housner_restitution(angle) for angle in angles))
        sides = tuple(Side(rates[i], angles[i], e[i], 0.75 * g / rates[i] ** 2) for i in range(2))
        return _made(cls, (sides[0], sides[1]), g, "block from its parameters")

    @classmethod
    def from_pivots(
        cls,
        distances: Sequence[Number],
        height: float,
        radius_of_gyration: float,
        *,
        restitution: Number | Sequence[Number] | None = None,
        mass: float | None = None,
        gravity: float = STANDARD_GRAVITY,
    ) -> Block:
        """Rigid body of any shape that rocks on two pivots.

        Parameters
        ----------
        distances : pair of float
            Horizontal distances from the centre of mass to the pivots (side +, side -), m.
        height : float
            Height of the centre of mass above the pivots, m.
        radius_of_gyration : float
            sqrt(I/m) about the centre of mass, m.
        restitution : float or pair, optional
            Factor on the angular speed on leaving a side. By default angular momentum about the new pivot is
            conserved: e_i = (I + m (h^2 - d+ d-))/(I + m R_j^2), j the other side.
        mass : float, optional
            Mass, kg.
        gravity : float
            Acceleration of gravity, m/s^2.

        Raises
        ------
        InvalidBlock
            If the body cannot stand (a distance or the height is not positive) or cannot rock (restitution <= 0).

        Notes
        -----
        R_i = hypot(d_i, h), alpha_i = atan(d_i/h), p_i = sqrt(m g R_i/(I + m R_i^2)).

        Examples
        --------
        A rectangle is the body with equal distances and I = m R^2/3:

        >>> rectangle = Block(0.2, 1.0)
        >>> body = Block.from_pivots((0.2, 0.2), 1.0, (1.04 / 3) ** 0.5)
        >>> abs(body.p - rectangle.p) < 1e-15, abs(body.restitution - rectangle.restitution) < 1e-15
        (True, True)
        """
        plus, minus = (_length(value, "distances") for value in _pair(distances, "distances"))
        h = _length(height, "height")
        k = _length(radius_of_gyration, "radius_of_gyration")
        g = within(gravity, "gravity", GRAVITY, "m/s^2")
        radii = math.hypot(plus, h), math.hypot(minus, h)
        inertias = [k * k + radius * radius for radius in radii]
        kept = k * k + h * h - plus * minus
        e = _restitutions(restitution, (kept / inertias[1], kept / inertias[0]))
        sides = tuple(
            Side(math.sqrt(g * radii[i] / inertias[i]), math.atan2((plus, minus)[i], h), e[i], radii[i])
            for i in range(2)
        )
        text = f"body on pivots {plus:.5g} m and {minus:.5g} m from its centre of mass, which is {h:.5g} m high"
        return _made(cls, (sides[0], sides[1]), g, text, mass)

    @classmethod
    def from_frame(
        cls,
        half_width: float,
        half_height: float,
        mass_ratio: float,
        *,
        restitution: Number | Sequence[Number] | None = None,
        gravity: float = STANDARD_GRAVITY,
    ) -> Block:
        """Solitary block that rocks like a frame: equal columns that carry a freely supported rigid beam.

        Parameters
        ----------
        half_width, half_height : float
            Half the width and half the height of one column, m.
        mass_ratio : float
            gamma: mass of the beam over the mass of all columns; 0 is a column alone.
        restitution : float or pair, optional
            By default from angular momentum: (1 - 1.5 sin(alpha)^2 + 3 gamma cos(2 alpha))/(1 + 3 gamma).
        gravity : float
            Acceleration of gravity, m/s^2.

        Raises
        ------
        InvalidBlock
            If a size is not positive, or the mass ratio is negative.

        Notes
        -----
        The frame has the column's slenderness, and R' = R (1 + 3 gamma)/(1 + 2 gamma): a heavier beam makes it
        more stable (Makris and Vassiliou 2013; derived in the documentation).

        Examples
        --------
        >>> column, frame = Block(0.5, 3.0), Block.from_frame(0.5, 3.0, mass_ratio=2.0)
        >>> frame.alpha == column.alpha, round(frame.radius / column.radius, 12)
        (True, 1.4)
        """
        b = _length(half_width, "half_width")
        h = _length(half_height, "half_height")
        g = within(gravity, "gravity", GRAVITY, "m/s^2")
        gamma = checks.within(mass_ratio, "mass_ratio (0: no beam)", InvalidBlock, 0.0, _HEAVIEST_BEAM)
        alpha = math.atan2(b, h)
        radius = math.hypot(b, h) * (1.0 + 3.0 * gamma) / (1.0 + 2.0 * gamma)
        kept = 1.0 - 1.5 * math.sin(alpha) ** 2 + 3.0 * gamma * math.cos(2.0 * alpha)
        e = _restitutions(restitution, (kept / (1.0 + 3.0 * gamma),) * 2, _perhaps_swapped(b, h))
        p = math.sqrt(0.75 * g / radius)
        sides = (Side(p, alpha, e[0], radius), Side(p, alpha, e[1], radius))
        return _made(cls, sides, g, f"frame of columns {2 * b:.5g} m x {2 * h:.5g} m, mass ratio {gamma:.5g}")

    def __str__(self) -> str:
        """Return description and parameters in one line."""
        sides = self.sides[:1] if self.is_symmetric else self.sides
        names = ("",) if self.is_symmetric else ("side +: ", "side -: ")
        return "; ".join([self.description, *(f"{name}{side}" for name, side in zip(names, sides, strict=True))])

    def __repr__(self) -> str:
        return f"<Block: {self}>"

    def _repr_html_(self) -> str:
        return svg.captioned(f"Block: {self}", self._picture())

    def _picture(self) -> str:
        """Block to scale: a rectangle, or the triangle of the pivots and the centre of mass."""
        if self.half_width is not None and self.half_height is not None:
            b, top = self.half_width, 2.0 * self.half_height
            return svg.outline([(-b, 0.0), (b, 0.0), (b, top), (-b, top)], _PICTURED, f"{2.0 * b:.4g} m x {top:.4g} m")
        (right, left), (up, _) = zip(
            *((side.radius * math.sin(side.alpha), side.radius * math.cos(side.alpha)) for side in self.sides),
            strict=True,
        )
        return svg.outline([(-left, 0.0), (right, 0.0), (0.0, up)], _PICTURED, "pivots and centre of mass")

    @property
    def p(self) -> Sided:
        """Frequency parameter, rad/s; a pair (side +, side -) where the sides differ."""
        return _sided(self.sides[0].p, self.sides[1].p)

    @property
    def alpha(self) -> Sided:
        """Slenderness, rad; a pair (side +, side -) where the sides differ."""
        return _sided(self.sides[0].alpha, self.sides[1].alpha)

    @property
    def radius(self) -> Sided:
        """Distance R from pivot to centre of mass, m; a pair (side +, side -) where the sides differ."""
        return _sided(self.sides[0].radius, self.sides[1].radius)

    @property
    def restitution(self) -> Sided:
        """Factor on the angular speed at an impact; a pair (on leaving side +, side -) where the sides differ."""
        return _sided(self.sides[0].restitution, self.sides[1].restitution)

    @property
    def is_symmetric(self) -> bool:
        """Whether both sides are equal."""
        return self.sides[0] == self.sides[1]

    @property
    def minimum_acceleration(self) -> Sided:
        """Ground acceleration g tan(alpha) that lifts the block to a side, m/s^2 (paper, Eq. 1)."""
        plus, minus = self.uplift_thresholds("nonlinear")
        return _sided(plus, minus)

    @property
    def inertia(self) -> Sided | None:
        """Moment of inertia about the pivot, m g R/p^2, kg m^2; None while the mass is not known."""
        if self.mass is None:
            return None
        plus, minus = (self.mass * self.gravity * side.radius / side.p**2 for side in self.sides)
        return _sided(plus, minus)

    def uplift_thresholds(self, model: str = "nonlinear") -> tuple[float, float]:
        """Ground accelerations, m/s^2, that lift the block: to side + when -a passes the first, to - when a the second.

        Parameters
        ----------
        model : {"nonlinear", "linear"}
            g tan(alpha), or g alpha for the slender block.

        Raises
        ------
        InvalidOption
            If there is no such model.

        Examples
        --------
        >>> Block.from_parameters(p=1.0, alpha=0.2, restitution=0.9, gravity=10.0).uplift_thresholds("linear")
        (2.0, 2.0)
        """
        steepness = math.tan if _checked_model(model) == "nonlinear" else float
        return (
            self.gravity * steepness(self.sides[0].alpha),
            self.gravity * steepness(self.sides[1].alpha),
        )


def housner_restitution(alpha: float) -> float:
    """Restitution of a rectangular block that conserves angular momentum: 1 - 1.5 sin(alpha)^2 (Housner 1963).

    Raises
    ------
    InvalidBlock
        If the slenderness is no number.

    Examples
    --------
    >>> round(housner_restitution(0.2), 6)
    0.940796
    """
    return 1.0 - 1.5 * math.sin(checks.finite(alpha, "alpha", InvalidBlock)) ** 2


def _made(
    cls: type[Block], sides: tuple[Side, Side], gravity: float, description: str, mass: float | None = None
) -> Block:
    block = cls.__new__(cls)
    _fill(block, sides, gravity, description, None, None, mass)
    return block


def _fill(
    block: Block,
    sides: tuple[Side, Side],
    gravity: float,
    description: str,
    half_width: float | None,
    half_height: float | None,
    mass: float | None,
) -> None:
    for side in sides:
        within(side.p, "p (from the sizes)", P, "rad/s")
        within(side.alpha, "alpha (from the sizes)", ALPHA, "rad")
    fields = {
        "sides": sides,
        "gravity": gravity,
        "description": description,
        "half_width": half_width,
        "half_height": half_height,
        "mass": None if mass is None else within(mass, "mass", _MASS, "kg"),
    }
    for name, value in fields.items():
        object.__setattr__(block, name, value)


def _sided(plus: float, minus: float) -> Sided:
    return plus if plus == minus else (plus, minus)


def within(value: object, name: str, limits: Limits, unit: str) -> float:
    """Return a positive number within its limits as a float.

    Raises
    ------
    InvalidBlock
        If it is anything else.
    """
    return checks.within(checks.positive(value, name, InvalidBlock, unit), name, InvalidBlock, *limits, unit)


def one_block(block: Block) -> Block:
    """Return the block.

    Raises
    ------
    InvalidBlock
        If it is anything else.

    Examples
    --------
    >>> one_block((0.2, 1.0))
    Traceback (most recent call last):
        ...
    rocking.errors.InvalidBlock: a Block is needed, not a tuple: make one with Block(half_width, half_height), in m
    """
    if not isinstance(block, Block):
        raise InvalidBlock(
            f"a Block is needed, not a {type(block).__name__}: make one with Block(half_width, half_height), in m"
        )
    return block


def _checked_model(model: str) -> str:
    return checks.one_of(model, "model", InvalidOption, ("nonlinear", "linear"))


def _half_sizes(
    halves: tuple[float | None, float | None], full: tuple[float | None, float | None]
) -> tuple[float, float]:
    """Half width and half height from either pair of sizes, m."""
    given = [size is not None for size in (*halves, *full)]
    if given == [True, True, False, False]:
        return _length(halves[0], "half_width"), _length(halves[1], "half_height")
    if given == [False, False, True, True]:
        return 0.5 * _length(full[0], "width"), 0.5 * _length(full[1], "height")
    raise InvalidBlock(
        "a block takes either half_width and half_height, or width and height (the full sizes), all in m"
    )


def _length(value: object, name: str) -> float:
    return within(value, name, _LENGTH, "m")


def _angle(value: object) -> float:
    number = checks.positive(value, "alpha", InvalidBlock, "rad")
    if number >= ALPHA.high:
        hint = checks.hint_of_degrees(number)
        raise InvalidBlock(f"alpha must be below pi/2 rad for a block that can stand, not {number:g}{hint}")
    return within(number, "alpha", ALPHA, "rad")


def _pair(value: Any, name: str) -> tuple[object, object]:
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__") or getattr(value, "ndim", 1) == 0:
        return value, value
    values = tuple(value)
    if len(values) != 2:
        raise InvalidBlock(f"{name} must be a number or a pair (side +, side -), not {len(values)} values")
    return values[0], values[1]


def _perhaps_swapped(half_width: float, half_height: float) -> str:
    """Return what to try first where a block is wider than it is high; else nothing."""
    if half_width <= half_height:
        return ""
    return f"swap its sizes, {2.0 * half_width:g} m wide and {2.0 * half_height:g} m high, if that is a slip, or "


def _restitutions(given: object, default: tuple[float, ...], mend: str = "") -> tuple[float, float]:
    if given is None:
        if min(default) <= 0.0:
            raise InvalidBlock(
                f"conserving angular momentum gives this block a restitution of {min(default):.3g}: it is too stocky "
                f"to rock that way; {mend}give restitution= a value in (0, 1]"
            )
        return default[0], default[1]
    plus, minus = (
        checks.within(value, "restitution", InvalidBlock, *RESTITUTION) for value in _pair(given, "restitution")
    )
    return plus, minus
