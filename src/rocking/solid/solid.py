"""A rigid body in space that stands on a support polygon: from a mesh, or from its mass properties."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rocking.block import Block
from rocking.block.sides import checked_gravity, checked_mass
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.result import Result, Row, dictionary_of, text_of
from rocking.core.tables import counted
from rocking.errors import InvalidBlock
from rocking.solid import support as polygons
from rocking.solid.mesh import Region, properties
from rocking.solid.rose import Rose, about_axes, checked_azimuths, rose_of

if TYPE_CHECKING:
    from rocking.solid.mesh import Mesh


@dataclass(frozen=True, eq=False, repr=False)
class Solid(Result):
    """A rigid body in space that stands on a horizontal plane; `from_mesh` makes it, or here its mass properties.

    Coordinates are to the east, to the north, and up from the plane, m.

    Parameters
    ----------
    support : array_like, shape (k, 2)
        Corners of its support; what counts is the convex polygon around them.
    centre : array_like, shape (3,)
        Centre of mass.
    inertia_over_mass : array_like, shape (3, 3)
        Tensor of inertia about the centre of mass over the mass, m^2: squares of radii of gyration on its diagonal, and
        the negative of the mean products of coordinates beside it.
    mass, gravity : float, optional
        Mass, kg, on which rocking does not depend, and acceleration of gravity, m/s^2.
    description, height : str, float, optional
        What it is, and its height, m.
    regions : sequence of Region
        Its parts, each with its name, volume (m^3) and density (kg/m^3).
    repairs, notes : sequence of str
        What was done to the mesh to close its surface, and what looks like a mistake.

    Raises
    ------
    InvalidBlock
        If it does not stand, or no body has that tensor of inertia.

    Notes
    -----
    In the vertical plane of an azimuth the body is a block (`block`): it rocks about the edges, or corners, where its
    support ends in that direction and in the opposite one. Turning about the vertical, rolling over corners and
    products of inertia are left out; `rose` contains their sizes.

    Examples
    --------
    >>> inertia = [(0.4**2 + 1.8**2) / 12, (0.6**2 + 1.8**2) / 12, (0.6**2 + 0.4**2) / 12]
    >>> corners = [(0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)]
    >>> cabinet = Solid(corners, (0.0, 0.0, 0.9), [[inertia[0], 0, 0], [0, inertia[1], 0], [0, 0, inertia[2]]])
    >>> [round(cabinet.block(azimuth).alpha, 4) for azimuth in (0.0, 90.0)]
    [0.2187, 0.3218]
    """

    support: Floats
    centre: Floats
    inertia_over_mass: Floats
    mass: float | None = None
    gravity: float = STANDARD_GRAVITY
    description: str = "rigid body"
    height: float | None = None
    regions: tuple[Region, ...] = ()
    repairs: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        held: dict[str, Any] = {
            "support": polygons.given_polygon(self.support),
            "centre": _shaped(self.centre, "centre", (3,)),
            "inertia_over_mass": _checked_inertia(self.inertia_over_mass),
            "mass": None if self.mass is None else checked_mass(self.mass),
            "gravity": checked_gravity(self.gravity),
            "description": checks.text(self.description, "description", InvalidBlock),
        }
        for name, value in held.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)
        for name in ("regions", "repairs", "notes"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        checks.positive(self.centre[2], "height of the centre of mass", InvalidBlock, "m")
        facing, distances = polygons.edges(self._about_centre)
        least = int(np.argmin(distances))
        if not distances[least] > 0.0:
            raise InvalidBlock(
                f"this body does not stand: its centre of mass lies {-distances[least]:.3g} m outside its support, "
                f"towards {facing[least]:.0f} deg; correct which axis points up, the densities, or {{}}",
                "support",
            )

    @classmethod
    def from_mesh(
        cls,
        mesh: Mesh,
        *,
        density: float | Mapping[str, float] | None = None,
        support: ArrayLike | None = None,
        tolerance: float | None = None,
        up: str | ArrayLike | None = None,
        unit: str | float = "m",
        turn: float = 0.0,
        gravity: float = STANDARD_GRAVITY,
    ) -> Solid:
        """Body that the surface of a mesh encloses: from a file (OBJ, PLY, STL, glTF, ...), or what trimesh has read.

        The lowest corner stands on the ground. Unless `up` or `turn` change it, x is to the east and y to the north, so
        that azimuths are counted clockwise from y.

        Parameters
        ----------
        mesh : path, binary stream, trimesh.Trimesh or trimesh.Scene
            Triangles; "statue" is a mesh that ships with the package. A stream needs the file's name as its ``name``.
        density : float or mapping of str to float, optional
            Density, kg/m^3: of all, or of each part (object, group, node) by its name. Without it all is of one
            density, and the mass not known. What parts have in common counts twice, and is noted.
        support : array_like, shape (k, 2), optional
            Corners of the support, m, in the mesh's own horizontal coordinates after `up`, `unit` and `turn`. By
            default the convex polygon around all corners of the mesh within `tolerance` of the lowest one.
        tolerance : float, optional
            That distance, m; by default a thousandth of the height. Without `support` only.
        up : {"x", "y", "z", "-x", "-y", "-z"} or array_like, optional
            Axis of the mesh that points up, or a vector; the mesh is turned there by the shortest way, so that with "y"
            x stays in the east, and north is -z. By default z; of glTF files y.
        unit : {"m", "cm", "mm", "in", "ft"} or float
            Unit of the mesh's coordinates, or its length in m.
        turn : float
            Degrees, clockwise seen from above, by which the mesh is then turned.
        gravity : float
            Acceleration of gravity, m/s^2.

        Returns
        -------
        Solid
            With what was repaired: holes, and normals that point inwards; and with notes, as on parts that overlap.

        Raises
        ------
        InvalidBlock
            If the mesh cannot be read, encloses no volume or does not stand, or an argument is not usable.
        InvalidOption
            If a file is to be read and trimesh is not installed.

        Notes
        -----
        Volume, centre and inertia are exact for the mesh. A hole is filled by triangles between its edge and the mean
        of its corners. Where several parts are of one density and some are open, these are joined first. A surface in
        another one, with its normals inwards, is a cavity; so is such a part to which `density` gives none.

        Examples
        --------
        >>> Solid.from_mesh("statue", density={"plinth": 2700.0, "figure": 2650.0, "head": 2650.0})
        <Solid: statue.obj: 1.73 m high, 0.1711 m^3, 455.4 kg>
        """
        made, _ = properties(mesh, density, support, tolerance, up=up, unit=unit, turn=turn)
        return cls(gravity=gravity, **made)

    @property
    def volume(self) -> float | None:
        """Volume of all its regions, m^3; None where it is not known."""
        return sum(region.volume for region in self.regions) if self.regions else None

    @property
    def weakest_azimuth(self) -> float:
        """Direction, degrees clockwise from north, in which it is lifted first; an edge of the support faces it."""
        facing, distances = polygons.edges(self._about_centre)
        return float(facing[np.argmin(distances)])

    @property
    def _about_centre(self) -> Floats:
        """Support about the centre of mass."""
        return np.asarray(self.support - self.centre[:2])

    def block(self, azimuth: float, *, restitution: float | Sequence[float] | None = None) -> Block:
        """Block that the body is in the vertical plane of an azimuth.

        Parameters
        ----------
        azimuth : float
            Direction of side +, degrees clockwise from north; that in which the ground acceleration is positive.
        restitution : float or pair, optional
            Factor on the angular speed on leaving a side; by default angular momentum about the new pivot is conserved.

        Returns
        -------
        Block
            As `Block.from_pivots` makes it, with the azimuth in its description: the pivots are where the support ends
            in both directions, the radius of gyration is that about the horizontal axis across the plane.

        Raises
        ------
        InvalidBlock
            If the body is too stocky to rock that way.
        """
        plane = plane_of(self, azimuth)
        plus, minus = plane.pivots.distance.tolist()
        return Block.from_pivots(
            (plus, minus),
            plane.height,
            plane.gyration,
            restitution=restitution,
            mass=self.mass,
            gravity=self.gravity,
            description=f"{self.description} in the plane of {plane.azimuth:.5g} deg",
        )

    def rose(self, azimuths: ArrayLike | None = None) -> Rose:
        """Return the resistance at azimuths (degrees clockwise from north; by default every five) as a `Rose`."""
        at = checked_azimuths(azimuths)
        height = float(self.centre[2])
        return rose_of(self._about_centre, height, self.inertia_over_mass, self.gravity, at, self.description)

    def _headline(self) -> str:
        known = [
            None if self.height is None else f"{self.height:.4g} m high",
            None if self.volume is None else f"{self.volume:.4g} m^3",
            None if self.mass is None else f"{self.mass:.4g} kg",
        ]
        return ": ".join(part for part in (self.description, ", ".join(filter(None, known))) if part)

    def summary(self) -> str:
        weakest = self.rose([self.weakest_azimuth])
        one = {name: float(weakest.data[name][0]) for name in weakest.TABLES["rose"]}
        east, north = (float(each) for each in self.centre[:2])
        sizes = np.ptp(self.support, axis=0)
        radii = np.sqrt(np.diag(self.inertia_over_mass))
        rows = [
            *(
                Row("part", f"{name}: {volume:.4g} m^3", note=f" of {density:g} kg/m^3" if density is not None else "")
                for name, volume, density in self.regions
            ),
            Row("centre of mass", f"{self.centre[2]:.5g} m high, at {east:.4g} m east, {north:.4g} m north"),
            Row("radii of gyration", "about axes to the east, to the north and up "
                + ", ".join(f"{radius:.4g} m" for radius in radii)),
            Row("support", f"{counted(len(self.support), 'corner')}, {sizes[0]:.4g} m by {sizes[1]:.4g} m, "
                f"{polygons.area(self.support):.4g} m^2"),
            Row("least resistance", f"towards {self.weakest_azimuth:.4g} deg: lifted at {one['acceleration']:.4g} g, "
                f"alpha {one['alpha']:.4g} rad, p {one['p']:.4g} rad/s"),
            Row("left out there", f"products of inertia, {one['coupling']:.2g} of the moment; pivot {one['aside']:.2g} "
                f"m to the side of the centre of mass, {one['gap']:.2g} m from facing the other one"),
            *(Row("repaired", sentence) for sentence in self.repairs),
            *(Row("note", sentence) for sentence in self.notes),
        ]  # fmt: skip
        return f"{self._headline()}\n\n{text_of(rows, 22)}"

    def to_dict(self) -> dict[str, Any]:
        rows = [
            Row("height", self.height, "m"),
            Row("volume", self.volume, "m^3"),
            Row("mass", self.mass, "kg"),
            Row("gravity", self.gravity, "m/s^2"),
            Row("centre", self.centre, "m"),
            Row("inertia_over_mass", self.inertia_over_mass, "m^2"),
            Row("support", self.support, "m"),
            Row("weakest_azimuth", self.weakest_azimuth, "deg"),
        ]
        return {
            "description": self.description,
            **dictionary_of(rows),
            "regions": [
                dictionary_of([Row("name", name), Row("volume", volume, "m^3"), Row("density", density, "kg/m^3")])
                for name, volume, density in self.regions
            ],
            "repairs": [*self.repairs],
            "notes": [*self.notes],
        }


class Plane(NamedTuple):
    """A body in the plane of an azimuth, deg: pivots of side + and -, height of the mass, radius of gyration, m."""

    azimuth: float
    pivots: polygons.Extent
    height: float
    gyration: float


def plane_of(solid: Solid, azimuth: float) -> Plane:
    """Return a body in the vertical plane of an azimuth."""
    towards = checks.finite(azimuth, "azimuth", InvalidBlock)
    pivots = polygons.extents(solid.support - solid.centre[:2], [towards, towards + 180.0])
    middle, apart = pivots.distance.mean(), np.ptp(pivots.distance)
    if apart <= 1e-12 * middle:  # by rounding alone: a body that is symmetric has equal sides wherever it stands
        pivots = pivots._replace(distance=np.full(2, middle))
    squared, _ = about_axes(solid.inertia_over_mass, np.array([towards]))
    return Plane(towards, pivots, float(solid.centre[2]), math.sqrt(float(squared[0])))


def _shaped(value: ArrayLike, name: str, shape: tuple[int, ...]) -> Floats:
    found = np.array(checks.numbers(value, name, InvalidBlock))
    if found.shape != shape or not np.all(np.isfinite(found)):
        raise InvalidBlock(f"{{}} must be finite numbers of shape {shape}", name, value=value)
    return found


def _checked_inertia(value: ArrayLike) -> Floats:
    found = _shaped(value, "inertia_over_mass", (3, 3))
    rounding = 1e-9 * float(np.abs(found).max())
    # Principal moments: none is larger than the sum of both others.
    least, middle, most = np.linalg.eigvalsh(0.5 * (found + found.T))
    is_symmetric = np.allclose(found, found.T, rtol=0.0, atol=rounding)
    if not (rounding > 0.0 and is_symmetric and least + middle >= most - rounding and least > -rounding):
        raise InvalidBlock(
            "{} is the tensor of no body: it must be symmetric, each principal moment at most the sum of the others",
            "inertia_over_mass",
            value=value,
        )
    return found
