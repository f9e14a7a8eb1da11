"""What the engine moves: a body with one coordinate, or many of one kind. A block is one kind.

The equation of motion between impacts is that of `kernels.state.BLOCK`: u'' = lambda u - gain (threshold + side a/g),
of any stiffness lambda, with damping or without, with one side or two, or between two stops. Everything above the
kernels knows a body by these protocols alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple, Protocol, Self, runtime_checkable

from rocking.core.arrays import Floats, Integers
from rocking.core.constants import Model
from rocking.kernels.state import Records


class Coordinate(NamedTuple):
    """How texts, columns and figures name the coordinate of a body.

    Attributes
    ----------
    name, rate, acceleration : str
        Names of the coordinate and its rates, as "rotation", "angular_velocity" and "angular_acceleration".
    unit : str
        Unit of the coordinate.
    limit : str
        Name of the value at which the body is in unstable balance, as "slenderness"; empty where there is none.
    """

    name: str
    rate: str
    acceleration: str
    unit: str
    limit: str = ""


#: Forces of the ground on a body over its weight, horizontal and vertical: from the coordinate and its two rates, from
#: the ground acceleration over g (horizontal, vertical), from the side (0, 1, or -1 at rest), and from the elongation
#: of a tendon that yields beyond its plastic one, m (0 where there is none); arrays of one shape.
ContactLaw = Callable[[tuple[Floats, Floats, Floats], tuple[Floats, Floats], Integers, Floats], tuple[Floats, Floats]]


@runtime_checkable
class Body(Protocol):
    """One body, as simulations and responses know it."""

    @property
    def description(self) -> str:
        """What it is, in words."""

    @property
    def gravity(self) -> float:
        """Acceleration of gravity, m/s^2."""

    @property
    def coordinate(self) -> Coordinate:
        """Its coordinate."""

    @property
    def sides(self) -> Sequence[object]:
        """Its sides, one or two; the text of each states its parameters."""

    @property
    def balance(self) -> tuple[float, float]:
        """Coordinate of the unstable balance on each side; infinite where there is none."""

    @property
    def stops(self) -> tuple[float, float]:
        """Coordinate at which it touches the ground on each side; of one side the second is not used."""

    @property
    def contact(self) -> ContactLaw | None:
        """Forces of the ground; None where nothing is known of them."""

    def uplift_thresholds(self, model: Model = "nonlinear") -> tuple[float, float]:
        """Return accelerations (m/s^2) that lift it: to side + when -a passes the first, to side - when a the second.

        Of a block they are g tan(alpha), or g alpha in the linear model; infinite where there is no such side.
        """

    def alone(self) -> Bodies:
        """Return bodies of which it is the only one: of a block `rocking.Blocks`."""


@runtime_checkable
class Bodies(Protocol):
    """Any number n of bodies of one kind under one gravity."""

    @property
    def kind(self) -> str:
        """Name of the kind, by which `KINDS` finds it."""

    @property
    def gravity(self) -> float:
        """Acceleration of gravity, m/s^2."""

    @property
    def restitution(self) -> Floats:
        """Factors on the speed on leaving each side, shape (n, 2); of one side twice the same."""

    @property
    def stops(self) -> Floats:
        """Coordinates at which each touches the ground, as `Body.stops`, shape (n, 2)."""

    @property
    def is_symmetric(self) -> bool:
        """Whether a motion and its mirror image move every body to mirror images; never one of a single side."""

    def __len__(self) -> int:
        """Return their number."""

    def __getitem__(self, index: int) -> Body:
        """Return one of them."""

    def select(self, index: slice | Integers) -> Self:
        """Return some of them, by a slice, flat array of indices, or mask; `InvalidBlock` if it is none of these."""

    def parameters(self) -> Mapping[str, tuple[Floats, str]]:
        """Return what they are made from, by name: arrays of shape (n, 2), and units."""

    def speed_limits(self, share: float) -> Floats:
        """Return a share of the speed that is natural to each side, shape (n, 2): of a block p alpha, rad/s."""

    def kernel_records(self, model: Model, limits: Floats) -> Records:
        """Return them as kernels take them (`kernels.state.BLOCK`), with the limits of a treatment, shape (n, 2)."""


class Kind(Protocol):
    """What makes bodies of a kind: their class."""

    def __call__(self, *nothing: Any, **parameters: Any) -> Bodies:
        """Make them of their `parameters`, by name, and of gravity; studies read their inputs so."""

    def of(self, bodies: Any, /) -> Bodies:
        """Gather single ones."""


#: Classes of many bodies by name: a registry, so that a body need not import the class that imports it.
KINDS: Final[dict[str, Kind]] = {}

#: Classes of single bodies by name, for the same reason.
SINGLE: Final[dict[str, Callable[..., Any]]] = {}
