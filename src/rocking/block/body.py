"""Protocols of bodies with one coordinate, for example blocks.

Between impacts (see `kernels.state.BLOCK_DTYPE`), u'' = lambda u - gain (threshold + side a/g), with any stiffness
lambda, with or without damping, with one or two sides, or between two stops. Everything above the kernels uses only
these protocols.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple, Protocol, Self, runtime_checkable

from rocking.core.arrays import Floats, Integers
from rocking.core.constants import Model
from rocking.kernels.state import Structs


class CoordinateLabels(NamedTuple):
    """Names of the coordinate of a body in texts, columns and figures.

    Attributes
    ----------
    name, rate_name, acceleration_name : str
        Names of the coordinate and its rates, for example "rotation", "angular_velocity" and "angular_acceleration".
    unit : str
        Unit of the coordinate.
    limit_name : str
        Name of the coordinate of the unstable balance, for example "slenderness"; empty if there is none.

    See Also
    --------
    rocking.block.body.Body : Describe a single body.
    rocking.Block : Create a block.

    Examples
    --------
    >>> import rocking
    >>> coordinate = rocking.Block(width=0.4, height=2.0).coordinate
    >>> coordinate.name, coordinate.unit, coordinate.limit_name
    ('rotation', 'rad', 'slenderness')
    """

    name: str
    rate_name: str
    acceleration_name: str
    unit: str
    limit_name: str = ""


#: Ratio of the ground forces on a body to its weight, horizontal and vertical. Arguments (arrays of one shape): the
#: coordinate and its two rates, the ratio of the ground acceleration to g (horizontal, vertical), the side (0, 1, or
#: -1 at rest), and the elongation of a yielding tendon beyond its plastic elongation, m (0 without such a tendon).
ContactLaw = Callable[[tuple[Floats, Floats, Floats], tuple[Floats, Floats], Integers, Floats], tuple[Floats, Floats]]


@runtime_checkable
class Body(Protocol):
    """Single body, as used by simulations and responses.

    See Also
    --------
    rocking.block.body.Bodies : Describe many bodies of one kind.
    rocking.Block : Create a block.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block(width=0.4, height=2.0)
    >>> isinstance(block, rocking.block.body.Body), f"{block.uplift_thresholds()[0]:.4f} m/s^2"
    (True, '1.9613 m/s^2')
    """

    @property
    def description(self) -> str:
        """Description of the body."""

    @property
    def gravity(self) -> float:
        """Acceleration of gravity, m/s^2."""

    @property
    def coordinate(self) -> CoordinateLabels:
        """Names and unit of the coordinate."""

    @property
    def sides(self) -> Sequence[object]:
        """One or two sides, whose texts contain the parameters."""

    @property
    def balance(self) -> tuple[float, float]:
        """Coordinate of the unstable balance on each side; infinite if there is none."""

    @property
    def stops(self) -> tuple[float, float]:
        """Coordinate of the ground contact on each side; the second is unused for a single side."""

    @property
    def contact_law(self) -> ContactLaw | None:
        """Forces of the ground; None if they are not available."""

    def uplift_thresholds(self, model: Model = "nonlinear") -> tuple[float, float]:
        """Return accelerations, m/s^2, that lift the body to side + (if -a exceeds the first) and side - (if a does).

        For a block they are g tan(alpha), or g alpha in the linear model. They are infinite for a side that does not
        exist.
        """

    def as_bodies(self) -> Bodies:
        """Return bodies that contain only this one, for a block `rocking.Blocks`."""


@runtime_checkable
class Bodies(Protocol):
    """Any number n of bodies of one kind with the same gravity.

    See Also
    --------
    rocking.block.body.Body : Describe a single body.
    rocking.Blocks : Create many blocks.

    Examples
    --------
    >>> import rocking
    >>> blocks = rocking.Blocks.grid(p=[2.0, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
    >>> isinstance(blocks, rocking.block.body.Bodies), len(blocks), blocks.kind
    (True, 4, 'blocks')
    """

    @property
    def kind(self) -> str:
        """Name of the kind, the key in `BODIES_TYPES`."""

    @property
    def gravity(self) -> float:
        """Acceleration of gravity, m/s^2."""

    @property
    def restitution(self) -> Floats:
        """Factors on the speed on leaving each side, shape (n, 2), equal for a single side."""

    @property
    def stops(self) -> Floats:
        """Coordinates of the ground contact, as `Body.stops`, shape (n, 2)."""

    @property
    def is_symmetric(self) -> bool:
        """Whether mirrored ground motion mirrors all responses; False for a single side."""

    def __len__(self) -> int:
        """Return the number of bodies."""

    def __getitem__(self, index: int) -> Body:
        """Return one body."""

    def select(self, index: slice | Integers) -> Self:
        """Return bodies by a slice, flat array of indices, or mask; otherwise raise `BlockError`."""

    def parameters(self) -> Mapping[str, tuple[Floats, str]]:
        """Return the parameters by name: arrays of shape (n, 2), and units."""

    def speed_thresholds(self, share: float) -> Floats:
        """Return a share of the characteristic speed of each side, shape (n, 2): p alpha for a block, rad/s."""

    def create_kernel_structs(self, model: Model, thresholds: Floats) -> Structs:
        """Return structs for kernels (`kernels.state.BLOCK_DTYPE`); ``thresholds`` of a scheme have shape (n, 2)."""


class BodiesFactory(Protocol):
    """Class that creates bodies of one kind."""

    def __call__(self, *unnamed: Any, **parameters: Any) -> Bodies:
        """Create bodies from their `parameters`, by name, and gravity."""

    def from_bodies(self, bodies: Any, /) -> Bodies:
        """Gather single bodies."""


#: Registry of classes of many bodies, which avoids circular imports.
BODIES_TYPES: Final[dict[str, BodiesFactory]] = {}

#: Registry of classes of single bodies.
SINGLE_BODY_TYPES: Final[dict[str, Callable[..., Any]]] = {}
