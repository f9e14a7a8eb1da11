"""Free-standing rigid blocks, symmetric or with two different sides."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Never

import numpy as np

from rocking.block.body import KINDS, SINGLE, Bodies, Body, Coordinate
from rocking.block.sides import (
    Side,
    checked_gravity,
    checked_length,
    checked_mass,
    checked_pair,
    checked_parameter,
    even_sides,
    gyration_squared,
    housner_restitution,
    in_line,
    no_body,
    restitutions,
    rigid_bodies,
    sides_on_pivots,
)
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.constants import MODELS, STANDARD_GRAVITY, Model
from rocking.errors import InvalidBlock, InvalidOption, UnequalSides

#: The coordinate of every block.
ROTATION: Final = Coordinate("rotation", "angular_velocity", "angular_acceleration", "rad", "slenderness")

#: Rounding of a length that was computed, relative.
_ROUNDING: Final = 1e-12
#: Restitutions so near are one: that of a body, from p and alpha or from itself.
_SAME_RESTITUTION: Final = 1e-9
_HEAVIEST_BEAM: Final = 1e12


class Rocking:
    """What free and restrained blocks share: text, the stops, and the arrays of one."""

    def __str__(self: Body) -> str:
        """Return description and parameters in one line."""
        return f"{self.description}; {in_line(self.sides)}"

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self}>"

    @property
    def stops(self) -> tuple[float, float]:
        """Rotation at which it stands, for each side: zero."""
        return 0.0, 0.0

    def alone(self) -> Bodies:
        """Return `Blocks` of which it is the only one."""
        return KINDS["blocks"].of([self])


@dataclass(frozen=True, repr=False)
class Block(Rocking):
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
        Mass, kg; it only scales forces.
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
        restitution: float | Sequence[float] | None = None,
        mass: float | None = None,
        gravity: float = STANDARD_GRAVITY,
    ) -> None:
        if unnamed:
            raise InvalidBlock("give the sizes of a block by name, in m: Block({}=0.4, {}=2.0)", "width", "height")
        b, h = _half_sizes((half_width, half_height), (width, height))
        g = checked_gravity(gravity)
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
            alpha = math.atan2(b, h)
            sides = even_sides(g, math.hypot(b, h), alpha, restitution, housner_restitution(alpha))
        else:
            sides = sides_on_pivots((b - s, b + s), h, gyration_squared(b, h, s), g, restitution)
            text += f", centre of mass {abs(s):.5g} m off its middle to side {'+' if s > 0.0 else '-'}"
        self._fill(sides, g, text, mass, (b, h, s))

    def _fill(
        self,
        sides: tuple[Side, Side],
        gravity: float,
        description: str,
        mass: float | None = None,
        rectangle: tuple[float | None, float | None, float] = (None, None, 0.0),
    ) -> Block:
        """Set all attributes; of a rectangle also half its sizes and its offset, m."""
        for side in sides:
            checked_parameter(side.p, "p", origin=" (from the sizes)")
            checked_parameter(side.alpha, "alpha", origin=" (from the sizes)")
        mass = None if mass is None else checked_mass(mass)
        self.__dict__.update(sides=sides, gravity=gravity, description=description, mass=mass)
        self.__dict__.update(zip(("half_width", "half_height", "offset"), rectangle, strict=True))
        return self

    def _rows(self) -> list[tuple[float, ...]]:
        """Parameters of both sides, as `Blocks` has them."""
        return [(side.p, side.alpha, side.restitution) for side in self.sides]

    def _with_sides(self, sides: tuple[Side, Side]) -> Block:
        """Return the block with other sides."""
        return Block.__new__(Block)._fill(sides, self.gravity, self.description, self.mass)

    @classmethod
    def from_parameters(
        cls,
        p: float | Sequence[float],
        alpha: float | Sequence[float],
        restitution: float | Sequence[float] | None = None,
        *,
        gravity: float = STANDARD_GRAVITY,
    ) -> Block:
        """Block from its dynamic parameters, each a number or a pair (side +, side -).

        Parameters
        ----------
        p, alpha : float or pair
            Frequency parameter, rad/s, and slenderness, rad, between 0 and pi/2.
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
            If a parameter is out of its range, or without a restitution no rigid body has these sides.

        Notes
        -----
        Depth h and radius of gyration k of the body follow from R_i = h/cos(alpha_i), g R_i/p_i^2 = k^2 + R_i^2: from
        differences of the sides, so that p and alpha need many digits. (Derived in the documentation.)

        Examples
        --------
        >>> Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92).restitution
        0.92
        >>> [side.alpha for side in Block.from_parameters((2.5, 2.2), (0.12, 0.2), (0.9, 0.85)).sides]
        [0.12, 0.2]
        >>> statue = Block.from_parameters(p=(2.9858, 3.0053), alpha=(0.27417, 0.155))
        >>> [round(side.restitution, 3) for side in statue.sides]
        [0.95, 0.914]
        """
        g = checked_gravity(gravity)
        rates = [checked_parameter(value, "p") for value in checked_pair(p, "p")]
        angles = [checked_parameter(value, "alpha") for value in checked_pair(alpha, "alpha")]
        radii, text = [0.75 * g / rate**2 for rate in rates], "block from its parameters"
        if rates[0] == rates[1] and angles[0] == angles[1]:
            e = restitutions(restitution, (housner_restitution(angles[0]),) * 2)
        else:
            kept, depths = rigid_bodies(np.array([rates]), np.array([angles]))
            conserved, depth = kept[0].tolist(), g * float(depths[0])
            if restitution is None and math.isnan(conserved[0]):
                raise InvalidBlock(no_body(np.array(rates), np.array(angles)), "restitution")
            e = restitutions(restitution, conserved)
            if depth > 0.0 and all(abs(e[i] - conserved[i]) <= _SAME_RESTITUTION for i in range(2)):
                radii = [depth / math.cos(angle) for angle in angles]
                k = math.sqrt(max(g * radii[0] / rates[0] ** 2 - radii[0] ** 2, 0.0))
                text = f"body from its parameters, centre of mass {depth:.4g} m high, radius of gyration {k:.4g} m"
        sides = tuple(Side(rates[i], angles[i], e[i], radii[i]) for i in range(2))
        return cls.__new__(cls)._fill((sides[0], sides[1]), g, text)

    @classmethod
    def from_pivots(
        cls,
        distances: Sequence[float],
        height: float,
        radius_of_gyration: float,
        *,
        restitution: float | Sequence[float] | None = None,
        mass: float | None = None,
        gravity: float = STANDARD_GRAVITY,
        description: str | None = None,
    ) -> Block:
        """Rigid body of any shape that rocks on two pivots.

        Parameters
        ----------
        distances : pair of float
            Horizontal distances from the centre of mass to the pivots (side +, side -), m.
        height, radius_of_gyration : float
            Height of the centre of mass above the pivots, and sqrt(I/m) about the centre of mass, m.
        restitution : float or pair, optional
            Factor on the angular speed on leaving a side. By default angular momentum about the new pivot is
            conserved: e_i = (I + m (h^2 - d+ d-))/(I + m R_j^2), j the other side.
        mass, gravity : float, optional
            As of `Block`.
        description : str, optional
            What it is, in words; by default its pivots are.

        Returns
        -------
        Block
            With two sides, which are equal where the distances are.

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
        plus, minus = (checked_length(value, "distances") for value in checked_pair(distances, "distances"))
        h = checked_length(height, "height")
        k = checked_length(radius_of_gyration, "radius_of_gyration")
        g = checked_gravity(gravity)
        sides = sides_on_pivots((plus, minus), h, k * k, g, restitution)
        pivots = f"body on pivots {plus:.5g} m and {minus:.5g} m from its centre of mass, which is {h:.5g} m high"
        return cls.__new__(cls)._fill(sides, g, description or pivots, mass)

    @classmethod
    def from_frame(
        cls,
        *,
        half_width: float,
        half_height: float,
        mass_ratio: float,
        restitution: float | Sequence[float] | None = None,
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

        Returns
        -------
        Block
            Symmetric.

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
        b, h = checked_length(half_width, "half_width"), checked_length(half_height, "half_height")
        g = checked_gravity(gravity)
        gamma = checks.within(mass_ratio, "mass_ratio", InvalidBlock, 0.0, _HEAVIEST_BEAM)
        alpha = math.atan2(b, h)
        radius = math.hypot(b, h) * (1.0 + 3.0 * gamma) / (1.0 + 2.0 * gamma)
        kept = 1.0 - 1.5 * math.sin(alpha) ** 2 + 3.0 * gamma * math.cos(2.0 * alpha)
        # The beam moves twice as far as the centres of the columns do.
        arm = math.hypot(b, h) * (1.0 + 2.0 * gamma) / (1.0 + gamma)
        sides = even_sides(g, radius, alpha, restitution, kept / (1.0 + 3.0 * gamma), arm)
        text = f"frame of columns {2 * b:.5g} m x {2 * h:.5g} m, mass ratio {gamma:.5g}"
        return cls.__new__(cls)._fill(sides, g, text)

    @classmethod
    def one_sided(
        cls,
        *restraints: Any,
        lean: float = 0.0,
        restitution: Any = None,
        **sizes: Any,
    ) -> Any:
        """Rectangular block that rocks to side + only, as a facade that stands against transverse walls.

        Parameters
        ----------
        *restraints : Restraint
            `Thrust` of a vault, `Load`, `Tendon` and others.
        lean : float
            Angle by which it stands out of plumb to side +, rad.
        restitution : float or Restitution, optional
            Factor with which it bounces back to the same side. By default `one_sided_restitution`.
        **sizes
            As of `Block`: `width` and `height`, m, or half of them, `mass`, kg, `gravity`.

        Returns
        -------
        RestrainedBlock
            With one side.

        Examples
        --------
        >>> wall = Block.one_sided(width=0.4, height=4.0)
        >>> round(wall.sides[0].restitution, 4)
        0.4708
        """
        # Of a wall too stocky for angular momentum, what is given takes the place of the block's own.
        block = cls(restitution=None if restitution is None else 1.0, **sizes)
        return SINGLE["restrained"](block, *restraints, one_sided=True, lean=lean, restitution=restitution)

    @property
    def p(self) -> float:
        """Frequency parameter, rad/s, of a block whose sides are equal; else ask its `sides`."""
        return self._of_both_sides("p")

    @property
    def alpha(self) -> float:
        """Slenderness, rad, of a block whose sides are equal; else ask its `sides`."""
        return self._of_both_sides("alpha")

    @property
    def radius(self) -> float:
        """Distance R from pivot to centre of mass, m, of a block whose sides are equal; else ask its `sides`."""
        return self._of_both_sides("radius")

    @property
    def restitution(self) -> float:
        """Factor on the angular speed at an impact, of a block whose sides are equal; else ask its `sides`."""
        return self._of_both_sides("restitution")

    @property
    def is_symmetric(self) -> bool:
        """Whether both sides are equal."""
        return self.sides[0] == self.sides[1]

    def _of_both_sides(self, name: str) -> float:
        plus, minus = (getattr(side, name) for side in self.sides)
        if plus != minus:
            raise UnequalSides(
                f"{name} is {plus:g} on side + and {minus:g} on side - of this block: ask block.sides[0].{name} and "
                f"block.sides[1].{name}"
            )
        value: float = plus
        return value

    @property
    def coordinate(self) -> Coordinate:
        """Names and unit of its coordinate, the rotation."""
        return ROTATION

    @property
    def balance(self) -> tuple[float, float]:
        """Rotation of the unstable balance on each side, rad: the slenderness."""
        return self.sides[0].alpha, self.sides[1].alpha

    def contact(
        self,
        motion: tuple[Floats, Floats, Floats],
        ground_over_g: tuple[Floats, Floats],
        side: Integers,
        stretch: Floats,
    ) -> tuple[Floats, Floats]:
        """Return the forces of the ground over the weight, horizontal and vertical (see `rocking.block.body`).

        On side i, with psi = alpha - |theta|, the centre of mass is at x = -i R sin(psi), y = R cos(psi) from the
        pivot, R being the arm where there is one; forces are m (a + x'') and m (g + a_v + y''). At rest they are
        (a/g, 1 + a_v/g).
        """
        leaning, (rotation, velocity, acceleration) = np.maximum(side, 0), motion
        sides = [(each.alpha, each.radius if each.arm is None else each.arm) for each in self.sides]
        alpha, arm = np.array(sides).T[:, leaning]
        sign, over_g = np.where(side < 0, 0.0, 1.0 - 2.0 * leaning), arm / self.gravity
        psi, towards_pivot, speed = alpha - np.abs(rotation), sign * acceleration, np.abs(sign) * velocity**2
        horizontal = sign * over_g * (np.cos(psi) * towards_pivot + np.sin(psi) * speed)
        vertical = over_g * (np.sin(psi) * towards_pivot - np.cos(psi) * speed)
        return ground_over_g[0] + horizontal, 1.0 + ground_over_g[1] + vertical

    def uplift_thresholds(self, model: Model = "nonlinear") -> tuple[float, float]:
        """Ground accelerations, m/s^2, that lift the block to side + (when -a passes the first) and to side -."""
        steepness = math.tan if checks.one_of(model, "model", InvalidOption, MODELS) == "nonlinear" else float
        return self.gravity * steepness(self.sides[0].alpha), self.gravity * steepness(self.sides[1].alpha)


def one_block(block: object, needed: str = "a free Block") -> Block:
    """Return the block, or say that it is none, and what is needed."""
    if not isinstance(block, Block):
        how = "make one with Block(width=, height=), in m"
        if hasattr(block, "rose"):
            how = "use solid.block(azimuth), the block that a Solid is in one vertical plane"
        raise InvalidBlock(f"{needed} is needed, not a {type(block).__name__}: {how}")
    return block


def _half_sizes(
    halves: tuple[float | None, float | None], full: tuple[float | None, float | None]
) -> tuple[float, float]:
    """Half width and half height from either pair of sizes, m."""
    given = [size is not None for size in (*halves, *full)]
    if given == [True, True, False, False]:
        return checked_length(halves[0], "half_width"), checked_length(halves[1], "half_height")
    if given == [False, False, True, True]:
        return 0.5 * checked_length(full[0], "width"), 0.5 * checked_length(full[1], "height")
    raise InvalidBlock(
        "a block takes either {} and {}, or {} and {} (the full sizes), all in m",
        "half_width", "half_height", "width", "height",
    )  # fmt: skip
