"""Free-standing rigid blocks, symmetric or with two different sides."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Never, Self

import numpy as np

from rocking.block.body import BODIES_TYPES, SINGLE_BODY_TYPES, Bodies, Body, CoordinateLabels
from rocking.block.sides import (
    Side,
    check_gravity,
    check_length,
    check_mass,
    check_pair,
    check_parameter,
    choose_restitutions,
    compute_gyration_squared,
    compute_rigid_bodies,
    create_even_sides,
    create_sides,
    describe_missing_body,
    format_sides,
    housner_restitution,
)
from rocking.core import checks
from rocking.core.arrays import Floats, Integers
from rocking.core.constants import MODELS, STANDARD_GRAVITY, Model
from rocking.errors import BlockError, OptionError, UnequalSidesError

#: The coordinate of every block.
ROTATION: Final = CoordinateLabels("rotation", "angular_velocity", "angular_acceleration", "rad", "slenderness")

#: Relative rounding error of a length.
_LENGTH_ROUNDING: Final = 1e-12
#: Largest difference of a restitution from the value of a rigid body that counts as equal.
_RESTITUTION_TOLERANCE: Final = 1e-9
_MAX_MASS_RATIO: Final = 1e12


class BlockBase:
    """Text, labels, stops and arrays shared by free and restrained blocks."""

    #: Name and further facts, for example its place, which do not affect the motion.
    labels: Mapping[str, str | float] = {}
    description: str

    def with_labels(self, **labels: str | float) -> Self:
        """Return the block with a name and further facts, which tables, files and figures contain.

        Parameters
        ----------
        **labels : str or float
            Facts by name. ``name`` is also part of the description.

        Returns
        -------
        same type
            The same block with these labels added.

        See Also
        --------
        rocking.read_inventory : Read named blocks from a table.

        Examples
        --------
        >>> print(Block(width=0.24, height=1.1).with_labels(name="vase", room="12").description)
        vase: rectangular block, 0.24 m x 1.1 m
        """
        labelled = copy.copy(self)
        text = self.description.removeprefix(f"{self.labels.get('name', '')}: ")
        combined = {**self.labels, **labels}
        name = str(combined.get("name", ""))
        labelled.__dict__.update(labels=combined, description=f"{name}: {text}" if name else text)
        return labelled

    def __str__(self: Body) -> str:
        """Return the description and the parameters in one line."""
        return f"{self.description}; {format_sides(self.sides)}"

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self}>"

    @property
    def stops(self) -> tuple[float, float]:
        """Rotation at which the block stands on each side: zero."""
        return 0.0, 0.0

    def as_bodies(self) -> Bodies:
        """Return `Blocks` that contain only this block."""
        return BODIES_TYPES["blocks"].from_bodies([self])


@dataclass(frozen=True, repr=False)
class Block(BlockBase):
    """Free-standing rigid block that rocks without sliding or bouncing.

    The constructor creates rectangular blocks. For other blocks use `from_parameters`, `from_pivots` and `from_frame`.

    Parameters
    ----------
    half_width, half_height : float
        Half width b and half height h of a rectangular block, m.
    width, height : float
        Full sizes instead, m.
    offset : float
        Horizontal distance of the centre of mass from the middle, m, positive to side +, up to a quarter of the width.
    restitution : float or pair, optional
        Factor on the angular speed at an impact, in (0, 1]. A pair is (on leaving side +, on leaving side -). The
        default conserves angular momentum about the new pivot: 1 - 1.5 sin(alpha)^2 (Housner) without an offset.
    mass : float, optional
        Mass, kg. It only scales forces.
    gravity : float
        Acceleration of gravity, m/s^2.

    Raises
    ------
    BlockError
        If the sizes are not two positive, finite half or full sizes, or the offset or the restitution (or its default)
        is out of range.

    See Also
    --------
    Blocks : Many blocks as arrays.
    RestrainedBlock : Block with restraints, a lean or a single side.

    Notes
    -----
    alpha = atan(b/h), R = hypot(b, h), p = sqrt(3 g/(4 R)) (paper, section 2; :cite:t:`housner1963`).

    With an offset s the block is the body of `from_pivots` with distances (b - s, b + s), height h and radius of
    gyration k = sqrt((b^2 + h^2)/3 - s^2). Its moment of inertia about the middle is unchanged, as for halves of
    different density or a density linear along the width. At a quarter of the width all mass lies in one half. For
    other distributions use `from_pivots`.

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
        **unknown: Never,
    ) -> None:
        if unnamed:
            raise BlockError("give the sizes of a block by name, in m: Block({}=0.4, {}=2.0)", "width", "height")
        for name in unknown:
            constructors = {"p": "from_parameters", "alpha": "from_parameters", "distances": "from_pivots"}
            constructors |= {"radius_of_gyration": "from_pivots", "mass_ratio": "from_frame"}
            hint = f"use Block.{constructors[name]}" if name in constructors else "see help(rocking.Block)"
            raise TypeError(f"Block has no argument {name}; {hint}")
        b, h = _resolve_half_sizes((half_width, half_height), (width, height))
        g = check_gravity(gravity)
        description = f"rectangular block, {2 * b:.5g} m x {2 * h:.5g} m"
        s = checks.finite(offset, "offset", BlockError)
        if abs(s) > 0.5 * b * (1.0 + _LENGTH_ROUNDING):
            message = f"{{}} must be at most a quarter of the width, {0.5 * b:g} m, not {s:g}"
            hint = "for a larger one, give the pivots and the radius of gyration"
            raise BlockError(f"{message}; {hint}", "offset", value=offset)
        if s == 0.0:
            alpha = math.atan2(b, h)
            sides = create_even_sides(g, math.hypot(b, h), alpha, restitution, housner_restitution(alpha))
        else:
            sides = create_sides((b - s, b + s), h, compute_gyration_squared(b, h, s), g, restitution)
            description += f", centre of mass {abs(s):.5g} m off its middle to side {'+' if s > 0.0 else '-'}"
        self._fill(sides, g, description, mass, (b, h, s))

    def _fill(
        self,
        sides: tuple[Side, Side],
        gravity: float,
        description: str,
        mass: float | None = None,
        rectangle: tuple[float | None, float | None, float] = (None, None, 0.0),
    ) -> Block:
        """Set all attributes, for a rectangle with half sizes and offset, m."""
        for side in sides:
            check_parameter(side.p, "p", origin=" (from the sizes)")
            check_parameter(side.alpha, "alpha", origin=" (from the sizes)")
        mass = None if mass is None else check_mass(mass)
        self.__dict__.update(sides=sides, gravity=gravity, description=description, mass=mass)
        self.__dict__.update(zip(("half_width", "half_height", "offset"), rectangle, strict=True))
        return self

    def _create_rows(self) -> list[tuple[float, ...]]:
        """Collect the parameters of both sides as stored in `Blocks`."""
        return [(side.p, side.alpha, side.restitution) for side in self.sides]

    def _list_radii(self) -> list[float]:
        """Return the distance of the centre of mass from each pivot, m; NaN for a frame, whose columns differ."""
        return [math.nan if side.arm is not None else side.radius for side in self.sides]

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
        """Create a block from its dynamic parameters, each a number or a pair (side +, side -).

        Parameters
        ----------
        p, alpha : float or pair
            Frequency parameter, rad/s, and slenderness, rad, between 0 and pi/2.
        restitution : float or pair, optional
            Factor on the angular speed on leaving a side, in (0, 1]. The default conserves angular momentum: Housner's
            value if the sides are equal, otherwise the value of the only rigid body with these p and alpha.
        gravity : float
            Acceleration of gravity, m/s^2.

        Returns
        -------
        Block
            Block with the radii of that body, or R = 3 g/(4 p^2), as of a rectangle, if its restitution differs.

        Raises
        ------
        BlockError
            If a parameter is out of range, or no rigid body with these sides determines a default restitution.

        See Also
        --------
        Block.from_pivots : Create a block from its pivots and its radius of gyration.

        Notes
        -----
        Depth h and radius of gyration k of the body follow from R_i = h/cos(alpha_i), g R_i/p_i^2 = k^2 + R_i^2.
        Because the sides are subtracted, p and alpha need many digits. (Derived in the documentation.)

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
        g = check_gravity(gravity)
        rates = [check_parameter(value, "p") for value in check_pair(p, "p")]
        angles = [check_parameter(value, "alpha") for value in check_pair(alpha, "alpha")]
        radii, description = [0.75 * g / rate**2 for rate in rates], "block from its parameters"
        if rates[0] == rates[1] and angles[0] == angles[1]:
            e = choose_restitutions(restitution, (housner_restitution(angles[0]),) * 2)
        else:
            factors, depths = compute_rigid_bodies(np.array([rates]), np.array([angles]))
            conserved, depth = factors[0].tolist(), g * float(depths[0])
            if restitution is None and math.isnan(conserved[0]):
                raise BlockError(describe_missing_body(np.array(rates), np.array(angles)), "restitution")
            e = choose_restitutions(restitution, conserved)
            if depth > 0.0 and all(abs(e[i] - conserved[i]) <= _RESTITUTION_TOLERANCE for i in range(2)):
                radii = [depth / math.cos(angle) for angle in angles]
                k = math.sqrt(max(g * radii[0] / rates[0] ** 2 - radii[0] ** 2, 0.0))
                details = f"centre of mass {depth:.4g} m high, radius of gyration {k:.4g} m"
                description = f"body from its parameters, {details}"
        plus, minus = map(Side, rates, angles, e, radii)
        return cls.__new__(cls)._fill((plus, minus), g, description)

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
        """Create a block from a rigid body of any shape that rocks on two pivots.

        Parameters
        ----------
        distances : pair of float
            Horizontal distances from the centre of mass to the pivots (side +, side -), m.
        height, radius_of_gyration : float
            Height of the centre of mass above the pivots, and sqrt(I/m) about the centre of mass, m.
        restitution : float or pair, optional
            Factor on the angular speed on leaving a side. The default conserves angular momentum about the new pivot:
            e_i = (I + m (h^2 - d+ d-))/(I + m R_j^2), j the other side.
        mass, gravity : float, optional
            As of `Block`.
        description : str, optional
            Description of the body; by default of its pivots.

        Returns
        -------
        Block
            Block with equal sides if the distances are equal.

        Raises
        ------
        BlockError
            If the body cannot stand (a distance or the height is not positive) or cannot rock (restitution <= 0).

        See Also
        --------
        rocking.Solid.block : Create a block from a solid.

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
        plus, minus = (check_length(value, "distances") for value in check_pair(distances, "distances"))
        h = check_length(height, "height")
        k = check_length(radius_of_gyration, "radius_of_gyration")
        g = check_gravity(gravity)
        sides = create_sides((plus, minus), h, k * k, g, restitution)
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
        """Create the single block that rocks like a frame: equal columns with a freely supported rigid beam.

        Parameters
        ----------
        half_width, half_height : float
            Half width and half height of a column, m.
        mass_ratio : float
            Ratio gamma of the mass of the beam to the mass of all columns; 0 for a single column.
        restitution : float or pair, optional
            Default from angular momentum: (1 - 1.5 sin(alpha)^2 + 3 gamma cos(2 alpha))/(1 + 3 gamma).
        gravity : float
            Acceleration of gravity, m/s^2.

        Returns
        -------
        Block
            Symmetric block.

        Raises
        ------
        BlockError
            If a size is not positive, or the mass ratio is negative.

        Notes
        -----
        The block has the slenderness of a column and R' = R (1 + 3 gamma)/(1 + 2 gamma). Therefore a heavier beam
        increases the stability (:cite:t:`makris2013`; derived in the documentation).

        Examples
        --------
        >>> column = Block(half_width=0.5, half_height=3.0)
        >>> frame = Block.from_frame(half_width=0.5, half_height=3.0, mass_ratio=2.0)
        >>> frame.alpha == column.alpha, round(frame.radius / column.radius, 12)
        (True, 1.4)
        """
        b, h = check_length(half_width, "half_width"), check_length(half_height, "half_height")
        g = check_gravity(gravity)
        gamma = checks.between(mass_ratio, "mass_ratio", BlockError, 0.0, _MAX_MASS_RATIO)
        alpha = math.atan2(b, h)
        radius = math.hypot(b, h) * (1.0 + 3.0 * gamma) / (1.0 + 2.0 * gamma)
        numerator = 1.0 - 1.5 * math.sin(alpha) ** 2 + 3.0 * gamma * math.cos(2.0 * alpha)
        # The beam moves twice as far as the centres of the columns.
        arm = math.hypot(b, h) * (1.0 + 2.0 * gamma) / (1.0 + gamma)
        sides = create_even_sides(g, radius, alpha, restitution, numerator / (1.0 + 3.0 * gamma), arm)
        description = f"frame of columns {2 * b:.5g} m x {2 * h:.5g} m, mass ratio {gamma:.5g}"
        return cls.__new__(cls)._fill(sides, g, description)

    @classmethod
    def one_sided(cls, *restraints: Any, lean: float = 0.0, restitution: Any = None, **sizes: Any) -> Any:
        """Create a rectangular block that rocks to side + only, such as a facade against transverse walls.

        Parameters
        ----------
        *restraints : Restraint
            `Thrust` of a vault, `Load`, `Tendon` and others.
        lean : float
            Angle by which the block stands out of plumb to side +, rad.
        restitution : float or Restitution, optional
            Factor on the speed when the block bounces back to the same side. The default is `one_sided_restitution`.
        **sizes
            Keyword arguments of `Block`: `width` and `height`, m, or the half sizes, `mass`, kg, `gravity`.

        Returns
        -------
        RestrainedBlock
            Block with one side.

        See Also
        --------
        one_sided_restitution : Compute the default restitution.

        Examples
        --------
        >>> wall = Block.one_sided(width=0.4, height=4.0)
        >>> round(wall.sides[0].restitution, 4)
        0.4708
        """
        # A wall may be too stocky for the default of a block.
        block = cls(restitution=None if restitution is None else 1.0, **sizes)
        return SINGLE_BODY_TYPES["restrained"](block, *restraints, one_sided=True, lean=lean, restitution=restitution)

    @property
    def width(self) -> float | None:
        """Width, m, of a rectangular block, otherwise None."""
        return None if self.half_width is None else 2.0 * self.half_width

    @property
    def height(self) -> float | None:
        """Height, m, of a rectangular block, otherwise None."""
        return None if self.half_height is None else 2.0 * self.half_height

    @property
    def p(self) -> float:
        """Frequency parameter, rad/s, if both sides are equal. Otherwise use `sides`."""
        return self._require_equal_sides("p")

    @property
    def alpha(self) -> float:
        """Slenderness, rad, if both sides are equal. Otherwise use `sides`."""
        return self._require_equal_sides("alpha")

    @property
    def radius(self) -> float:
        """Distance R from the pivot to the centre of mass, m, if both sides are equal. Otherwise use `sides`."""
        return self._require_equal_sides("radius")

    @property
    def restitution(self) -> float:
        """Factor on the angular speed at an impact if both sides are equal. Otherwise use `sides`."""
        return self._require_equal_sides("restitution")

    @property
    def is_symmetric(self) -> bool:
        """Whether both sides are equal."""
        return self.sides[0] == self.sides[1]

    def _require_equal_sides(self, name: str) -> float:
        plus, minus = (getattr(side, name) for side in self.sides)
        if plus != minus:
            remedy = f"use block.sides[0].{name} and block.sides[1].{name}"
            raise UnequalSidesError(f"{name} is {plus:g} on side + and {minus:g} on side - of this block: {remedy}")
        return float(plus)

    @property
    def coordinate(self) -> CoordinateLabels:
        """Names and unit of the coordinate, the rotation."""
        return ROTATION

    @property
    def balance(self) -> tuple[float, float]:
        """Rotation of the unstable balance on each side, rad: the slenderness."""
        return self.sides[0].alpha, self.sides[1].alpha

    def contact_law(
        self,
        kinematics: tuple[Floats, Floats, Floats],
        ground_over_g: tuple[Floats, Floats],
        side: Integers,
        elongation: Floats,
    ) -> tuple[Floats, Floats]:
        """Return the ratio of the ground forces to the weight, horizontal and vertical (see `rocking.block.body`).

        On side i, with psi = alpha - |theta|, the centre of mass is at x = -i R sin(psi), y = R cos(psi) from the
        pivot, where R is the `arm` of the side if it has one. The forces are m (a + x'') and m (g + a_v + y''), at
        rest m (a, g + a_v).
        """
        side_index, (rotation, velocity, acceleration) = np.maximum(side, 0), kinematics
        sides = [(item.alpha, item.radius if item.arm is None else item.arm) for item in self.sides]
        alpha, arm = np.array(sides).T[:, side_index]
        sign, arm_over_g = np.where(side < 0, 0.0, 1.0 - 2.0 * side_index), arm / self.gravity
        psi = alpha - np.abs(rotation)
        signed_acceleration, squared_rate = sign * acceleration, np.abs(sign) * velocity**2
        horizontal = sign * arm_over_g * (np.cos(psi) * signed_acceleration + np.sin(psi) * squared_rate)
        vertical = arm_over_g * (np.sin(psi) * signed_acceleration - np.cos(psi) * squared_rate)
        return ground_over_g[0] + horizontal, 1.0 + ground_over_g[1] + vertical

    def uplift_thresholds(self, model: Model = "nonlinear") -> tuple[float, float]:
        """Return the ground accelerations, m/s^2, that lift the block to side + (if -a exceeds it) and to side -."""
        steepness = math.tan if checks.choice(model, "model", OptionError, MODELS) == "nonlinear" else float
        return self.gravity * steepness(self.sides[0].alpha), self.gravity * steepness(self.sides[1].alpha)


def require_block(block: object, requirement: str = "a free Block") -> Block:
    """Return the block, or raise `BlockError` that names the required object."""
    if not isinstance(block, Block):
        hint = "create one with Block(width=, height=), in m"
        if hasattr(block, "rose"):
            hint = "use solid.block(azimuth), the block that a Solid is in one vertical plane"
        raise BlockError(f"{requirement} is required, not a {type(block).__name__}; {hint}")
    return block


def _resolve_half_sizes(
    halves: tuple[float | None, float | None], full: tuple[float | None, float | None]
) -> tuple[float, float]:
    """Return half sizes, m, from half or full sizes."""
    is_given = [size is not None for size in (*halves, *full)]
    if is_given == [True, True, False, False]:
        return check_length(halves[0], "half_width"), check_length(halves[1], "half_height")
    if is_given == [False, False, True, True]:
        return 0.5 * check_length(full[0], "width"), 0.5 * check_length(full[1], "height")
    message = "a block requires either {} and {}, or {} and {} (the full sizes), all in m"
    raise BlockError(message, "half_width", "half_height", "width", "height")
