"""What rocks: free-standing rigid blocks, symmetric or with two different sides."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, Never

import numpy as np

from rocking import checks, svg
from rocking.block.body import bodies_of, gyration_squared, refusal
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
#: Rounding of a length that was computed, relative.
_ROUNDING: Final = 1e-12
#: Restitutions so near are one: that of a body, from p and alpha or from itself.
_SAME_RESTITUTION: Final = 1e-9
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
        Half the width b and half the height h of a rectangular block, m. Sizes are given by name.
    width, height : float
        The full sizes instead, m.
    offset : float
        Horizontal distance of the centre of mass from the middle of the width, m, positive to side +; a quarter of the
        width at most.
    restitution : float or pair, optional
        Factor on the angular speed at an impact, in (0, 1]; a pair is (on leaving side +, on leaving side -).
        By default the one that conserves angular momentum about the new pivot: without an offset Housner's,
        1 - 1.5 sin(alpha)^2.
    mass : float, optional
        Mass, kg; it only scales forces and moments of inertia.
    gravity : float
        Acceleration of gravity, m/s^2.

    Raises
    ------
    InvalidBlock
        If the sizes are neither two halves nor two full ones, one is not positive and finite, the offset is more than
        a quarter of the width, the restitution is outside (0, 1], or angular momentum gives one that is not positive.

    Notes
    -----
    alpha = atan(b/h), R = hypot(b, h), p = sqrt(3 g/(4 R)) (paper, section 2; Housner 1963).

    With an offset s the block is the body of `from_pivots` with distances (b - s, b + s), height h and radius of
    gyration k = sqrt((b^2 + h^2)/3 - s^2). Its moment of inertia about the middle of the rectangle is that of an even
    block: so it is where one half of the width is heavier than the other, or where the density grows along the width in
    a straight line. At a quarter of the width all mass lies in one half. Of a body with its mass farther out, or
    spread otherwise, give the radius of gyration to `from_pivots`.

    Examples
    --------
    >>> block = Block(half_width=0.2, half_height=1.0)
    >>> round(block.alpha, 6), round(block.p, 6), round(block.restitution, 6)
    (0.197396, 2.685546, 0.942308)
    >>> round(block.minimum_acceleration, 6)
    1.96133
    >>> Block(width=0.4, height=2.0)
    <Block: rectangular block, 0.4 m x 2 m; p = 2.6855 rad/s, alpha = 0.1974 rad, restitution = 0.94231>
    >>> print("%.6f on leaving side +, %.6f on leaving side -" % Block(width=0.4, height=2.0, offset=0.03).restitution)
    0.934223 on leaving side +, 0.950533 on leaving side -
    """

    sides: tuple[Side, Side]
    gravity: float
    description: str
    half_width: float | None
    half_height: float | None
    offset: float
    mass: float | None

    def __init__(
        self,
        *unnamed: Never,
        half_width: float | None = None,
        half_height: float | None = None,
        width: float | None = None,
        height: float | None = None,
        offset: float = 0.0,
        restitution: Number | Sequence[Number] | None = None,
        mass: float | None = None,
        gravity: float = STANDARD_GRAVITY,
    ) -> None:
        _refuse_unnamed(unnamed)
        b, h = _half_sizes((half_width, half_height), (width, height))
        g = within(gravity, "gravity", GRAVITY, "m/s^2")
        text = f"rectangular block, {2 * b:.5g} m x {2 * h:.5g} m"
        s = checks.finite(offset, "offset", InvalidBlock)
        if abs(s) > 0.5 * b * (1.0 + _ROUNDING):
            raise InvalidBlock(
                f"{{}} must be at most a quarter of the width, {0.5 * b:g} m, not {s:g}: of a block with its mass "
                "farther out the pivots and the radius of gyration must be given",
                "offset",
                value=offset,
            )
        if s == 0.0:
            alpha, radius = math.atan2(b, h), math.hypot(b, h)
            p = math.sqrt(0.75 * g / radius)
            e = _restitutions(restitution, (housner_restitution(alpha),) * 2, _perhaps_swapped(b, h))
            sides = (Side(p, alpha, e[0], radius), Side(p, alpha, e[1], radius))
        else:
            sides = _sides_on_pivots(
                (b - s, b + s), h, gyration_squared(b, h, s), g, restitution, _perhaps_swapped(b, h)
            )
            text += f", centre of mass {abs(s):.5g} m off its middle to side {'+' if s > 0.0 else '-'}"
        _fill(self, sides, g, text, (b, h, s), mass)

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
            Factor on the angular speed on leaving a side, in (0, 1]. By default the one that conserves angular
            momentum: Housner's where the sides are equal, else of the one rigid body that has these p and alpha.
        gravity : float
            Acceleration of gravity, m/s^2.

        Returns
        -------
        Block
            Its radii are those of that body, or where it has another restitution those of a rectangular block with the
            same p, R = 3 g/(4 p^2).

        Raises
        ------
        InvalidBlock
            If a parameter is out of its range, or without a restitution no rigid body has these sides, or p and alpha
            have too few digits to tell it to 0.05.

        Notes
        -----
        Depth h and radius of gyration k of the body follow from R_i = h/cos(alpha_i), g R_i/p_i^2 = k^2 + R_i^2. Sides
        that agree to the digits that they are given to (three at least) count as equal. (Derived in the documentation.)

        Examples
        --------
        >>> Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92).restitution
        0.92
        >>> Block.from_parameters(p=(2.5, 2.2), alpha=(0.12, 0.2), restitution=(0.9, 0.85)).alpha
        (0.12, 0.2)
        >>> statue = Block.from_parameters(p=(2.9858, 3.0053), alpha=(0.27417, 0.155))
        >>> print("%.3f on leaving side +, %.3f on leaving side -" % statue.restitution)
        0.950 on leaving side +, 0.914 on leaving side -
        """
        g = within(gravity, "gravity", GRAVITY, "m/s^2")
        rates = [within(value, "p", P, "rad/s") for value in _pair(p, "p")]
        angles = [_angle(value) for value in _pair(alpha, "alpha")]
        radii, text = [0.75 * g / rate**2 for rate in rates], "block from its parameters"
        if rates[0] == rates[1] and angles[0] == angles[1]:
            e = _restitutions(restitution, (housner_restitution(angles[0]),) * 2)
        else:
            both = np.array([rates]), np.array([angles])
            found = bodies_of(*both)
            if restitution is None and (reason := refusal(found, *both)):
                raise InvalidBlock(reason)
            conserved = found.restitution[0].tolist()
            e = _restitutions(restitution, conserved)
            if not found.alike[0] and all(abs(e[i] - conserved[i]) <= _SAME_RESTITUTION for i in range(2)):
                depth = g * float(found.depth[0])
                radii = [depth / math.cos(angle) for angle in angles]
                k = math.sqrt(max(g * radii[0] / rates[0] ** 2 - radii[0] ** 2, 0.0))
                text = f"body from its parameters, centre of mass {depth:.4g} m high, radius of gyration {k:.4g} m"
        sides = tuple(Side(rates[i], angles[i], e[i], radii[i]) for i in range(2))
        return _made(cls, (sides[0], sides[1]), g, text)

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

        >>> rectangle = Block(half_width=0.2, half_height=1.0)
        >>> body = Block.from_pivots((0.2, 0.2), 1.0, (1.04 / 3) ** 0.5)
        >>> abs(body.p - rectangle.p) < 1e-15, abs(body.restitution - rectangle.restitution) < 1e-15
        (True, True)
        """
        plus, minus = (_length(value, "distances") for value in _pair(distances, "distances"))
        h = _length(height, "height")
        k = _length(radius_of_gyration, "radius_of_gyration")
        g = within(gravity, "gravity", GRAVITY, "m/s^2")
        sides = _sides_on_pivots((plus, minus), h, k * k, g, restitution)
        text = f"body on pivots {plus:.5g} m and {minus:.5g} m from its centre of mass, which is {h:.5g} m high"
        return _made(cls, sides, g, text, mass)

    @classmethod
    def from_frame(
        cls,
        *,
        half_width: float,
        half_height: float,
        mass_ratio: float,
        restitution: Number | Sequence[Number] | None = None,
        gravity: float = STANDARD_GRAVITY,
    ) -> Block:
        """Solitary block that rocks like a frame: equal columns that carry a freely supported rigid beam.

        Parameters
        ----------
        half_width, half_height : float
            Half the width and half the height of one column, m. All are given by name.
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
        >>> column = Block(half_width=0.5, half_height=3.0)
        >>> frame = Block.from_frame(half_width=0.5, half_height=3.0, mass_ratio=2.0)
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
    _fill(block, sides, gravity, description, None, mass)
    return block


def _fill(
    block: Block,
    sides: tuple[Side, Side],
    gravity: float,
    description: str,
    rectangle: tuple[float, float, float] | None,
    mass: float | None,
) -> None:
    """Fill in what a block is; of a rectangle also half its sizes and its offset, m."""
    for side in sides:
        within(side.p, "p (from the sizes)", P, "rad/s")
        within(side.alpha, "alpha (from the sizes)", ALPHA, "rad")
    fields = {
        "sides": sides,
        "gravity": gravity,
        "description": description,
        "half_width": None if rectangle is None else rectangle[0],
        "half_height": None if rectangle is None else rectangle[1],
        "offset": 0.0 if rectangle is None else rectangle[2],
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
    rocking.errors.InvalidBlock: a Block is needed, not a tuple: make one with Block(width=, height=), in m
    """
    if not isinstance(block, Block):
        raise InvalidBlock(
            f"a Block is needed, not a {type(block).__name__}: make one with Block(width=, height=), in m"
        )
    return block


def _checked_model(model: str) -> str:
    return checks.one_of(model, "model", InvalidOption, ("nonlinear", "linear"))


def _refuse_unnamed(sizes: Sequence[object]) -> None:
    """Refuse sizes without names, of which nobody sees whether they are halves."""
    if sizes:
        raise InvalidBlock(
            f"the sizes of a block are given by name, not as {', '.join(map(checks.shown, sizes))}: width= and height= "
            "for the full sizes, half_width= and half_height= for half of them, in m"
        )


def _sides_on_pivots(
    distances: tuple[float, float],
    height: float,
    gyration_squared: float,
    gravity: float,
    restitution: object,
    mend: str = "",
) -> tuple[Side, Side]:
    """Sides of a body from the distances of its pivots from the centre of mass, its height, m, and k^2, m^2."""
    plus, minus = distances
    radii = math.hypot(plus, height), math.hypot(minus, height)
    inertias = [gyration_squared + radius * radius for radius in radii]
    kept = gyration_squared + height * height - plus * minus
    e = _restitutions(restitution, (kept / inertias[1], kept / inertias[0]), mend)
    first, second = (
        Side(math.sqrt(gravity * radius / inertia), math.atan2(distance, height), factor, radius)
        for distance, radius, inertia, factor in zip(distances, radii, inertias, e, strict=True)
    )
    return first, second


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


def _restitutions(given: object, default: Sequence[float], mend: str = "") -> tuple[float, float]:
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
