"""Rigid bodies in space on a support polygon, from a mesh or from mass properties."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rocking.block import Block
from rocking.block.sides import check_gravity, check_mass
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.result import Result, Row, format_rows, rows_to_dict
from rocking.core.tables import format_count
from rocking.errors import BlockError
from rocking.solid import support as polygons
from rocking.solid.mesh import Region, compute_properties
from rocking.solid.rose import ResistanceRose, check_azimuths, compute_axis_moments, compute_rose

if TYPE_CHECKING:
    from rocking.solid.mesh import Mesh


@dataclass(frozen=True, eq=False, repr=False)
class Solid(Result):
    """Rigid body in space on a horizontal plane, from its mass properties or by `from_mesh`.

    Coordinates are east, north, and up from the plane, m.

    Parameters
    ----------
    support : array_like, shape (k, 2)
        Corners of the support, which is their convex hull.
    centre : array_like, shape (3,)
        Centre of mass.
    inertia_over_mass : array_like, shape (3, 3)
        Tensor of inertia about the centre of mass divided by the mass, m^2: squared radii of gyration on the diagonal,
        negative mean products of coordinates elsewhere.
    mass, gravity : float, optional
        Mass, kg, which does not affect rocking, and acceleration of gravity, m/s^2.
    description, height : str, float, optional
        Description and height, m.
    regions : sequence of Region
        Parts of the body, with name, volume (m^3) and density (kg/m^3).
    repairs, notes : sequence of str
        Repairs that closed the surface of the mesh, and warnings about probable mistakes.

    Raises
    ------
    BlockError
        If the body does not stand, or the tensor of inertia is impossible.

    See Also
    --------
    rocking.solid.ResistanceRose : Resistance to rocking in every direction.
    Block : Block that rocks in a plane.

    Notes
    -----
    In the vertical plane of an azimuth the body is a block (`block`). It rocks about the outermost edges or corners of
    the support in this direction and the opposite one. Rotation about the vertical, rolling over corners and products
    of inertia are neglected; `rose` reports their size.

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
        checked_fields: dict[str, Any] = {
            "support": polygons.check_polygon(self.support),
            "centre": _check_array(self.centre, "centre", (3,)),
            "inertia_over_mass": _check_inertia(self.inertia_over_mass),
            "mass": None if self.mass is None else check_mass(self.mass),
            "gravity": check_gravity(self.gravity),
            "description": checks.text(self.description, "description", BlockError),
        }
        for name, value in checked_fields.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)
        for name in ("regions", "repairs", "notes"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        checks.positive(self.centre[2], "height of the centre of mass", BlockError, "m")
        azimuths, distances = polygons.compute_edges(self._centred_support)
        weakest = int(np.argmin(distances))
        if not distances[weakest] > 0.0:
            place = f"{-distances[weakest]:.3g} m outside its support, towards {azimuths[weakest]:.0f} deg"
            message = f"this body does not stand: its centre of mass lies {place}; correct which axis points up, the "
            raise BlockError(f"{message}densities, or {{}}", "support")

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
        """Create a body from a mesh: a file (OBJ, PLY, STL, glTF, ...) or an object of trimesh.

        The lowest corner stands on the ground. Unless `up` or `turn` change it, x points east and y north, so azimuths
        are clockwise from y.

        Parameters
        ----------
        mesh : path, binary stream, trimesh.Trimesh or trimesh.Scene
            Triangles. "statue" is a mesh included in the package. A stream needs the name of the file as ``name``.
        density : float or mapping of str to float, optional
            Density, kg/m^3, of the body, or of each part (object, group, node) by name. By default uniform, with
            unknown mass. Overlaps count twice, and are reported in `notes`.
        support : array_like, shape (k, 2), optional
            Corners of the support, m, in the horizontal coordinates of the mesh after `up`, `unit` and `turn`. The
            default is the convex hull of all corners of the mesh within `tolerance` of the lowest one.
        tolerance : float, optional
            Height of these corners above the lowest one, m; by default a thousandth of the height. Only without
            `support`.
        up : {"x", "y", "z", "-x", "-y", "-z"} or array_like, optional
            Axis of the mesh that points up, or a vector. The mesh is rotated by the smallest angle, so with "y" x
            still points east, and north is -z. The default is z, for glTF files y.
        unit : {"m", "cm", "mm", "in", "ft"} or float
            Unit of the coordinates of the mesh, or its length in m.
        turn : float
            Final rotation of the mesh, degrees, clockwise from above.
        gravity : float
            Acceleration of gravity, m/s^2.

        Returns
        -------
        Solid
            Body with `repairs` (holes, normals that pointed inwards) and `notes`, for example on overlapping parts.

        Raises
        ------
        BlockError
            If the mesh cannot be read, encloses no volume or does not stand, or an argument is invalid.
        OptionError
            If trimesh is required to read a file but not installed.

        See Also
        --------
        rocking.solid.Region : Part of a body.

        Notes
        -----
        Volume, centre and inertia are exact for the mesh, apart from rounding. A hole is filled by triangles between
        its edge and the mean of its corners. If several parts have one density and some are open, the open parts are
        joined first. A surface inside another one, with its normals inwards, is a cavity, and so is such a part
        without a `density`.

        Examples
        --------
        >>> Solid.from_mesh("statue", density={"plinth": 2700.0, "figure": 2650.0, "head": 2650.0})
        <Solid: statue.obj: 1.73 m high, 0.1711 m^3, 455.4 kg>
        """
        arguments, _ = compute_properties(mesh, density, support, tolerance, up=up, unit=unit, turn=turn)
        return cls(gravity=gravity, **arguments)

    @property
    def volume(self) -> float | None:
        """Total volume of the regions, m^3; None if it is not known."""
        return sum(region.volume for region in self.regions) if self.regions else None

    @property
    def weakest_azimuth(self) -> float:
        """Direction of the first uplift, degrees clockwise from north, perpendicular to an edge of the support."""
        azimuths, distances = polygons.compute_edges(self._centred_support)
        return float(azimuths[np.argmin(distances)])

    @property
    def _centred_support(self) -> Floats:
        """Support relative to the centre of mass."""
        return np.asarray(self.support - self.centre[:2])

    def block(self, azimuth: float, *, restitution: float | Sequence[float] | None = None) -> Block:
        """Return the block of the body in the vertical plane of an azimuth.

        Parameters
        ----------
        azimuth : float
            Direction of side +, and of positive ground acceleration, degrees clockwise from north.
        restitution : float or pair, optional
            Factor on the angular speed on leaving a side. The default conserves angular momentum about the new pivot.

        Returns
        -------
        Block
            Block from `Block.from_pivots`, with the azimuth in its description. Its pivots are the ends of the
            support, and its radius of gyration is about the horizontal axis perpendicular to the plane.

        Raises
        ------
        BlockError
            If the body is too stocky to rock in this plane.

        See Also
        --------
        Block.from_pivots : Create a block from its pivots and its radius of gyration.
        """
        plane = compute_plane(self, azimuth)
        options: dict[str, Any] = {"restitution": restitution, "mass": self.mass, "gravity": self.gravity}
        options["description"] = f"{self.description} in the plane of {plane.azimuth:.5g} deg"
        return Block.from_pivots(plane.pivots.distance.tolist(), plane.height, plane.gyration, **options)

    def rose(self, azimuths: ArrayLike | None = None) -> ResistanceRose:
        """Compute the resistance at azimuths, in degrees clockwise from north; by default every five."""
        angles, support, height = check_azimuths(azimuths), self._centred_support, float(self.centre[2])
        return compute_rose(support, height, self.inertia_over_mass, self.gravity, angles, self.description)

    def _format_headline(self) -> str:
        values = {"m high": self.height, "m^3": self.volume, "kg": self.mass}
        sizes = ", ".join(f"{value:.4g} {unit}" for unit, value in values.items() if value is not None)
        return ": ".join(filter(None, (self.description, sizes)))

    def summary(self) -> str:
        weakest = self.rose([self.weakest_azimuth])
        row = {name: float(weakest.data[name][0]) for name in weakest.TABLES["rose"]}
        east, north = (float(coordinate) for coordinate in self.centre[:2])
        sizes = np.ptp(self.support, axis=0)
        radii = np.sqrt(np.diag(self.inertia_over_mass))
        densities = ["" if region.density is None else f" of {region.density:g} kg/m^3" for region in self.regions]
        parts = [f"{region.name}: {region.volume:.4g} m^3" for region in self.regions]
        rows = [
            *(Row("part", part, note=density) for part, density in zip(parts, densities, strict=True)),
            Row("centre of mass", f"{self.centre[2]:.5g} m high, at {east:.4g} m east, {north:.4g} m north"),
            Row("radii of gyration", "about axes to the east, to the north and up "
                + ", ".join(f"{radius:.4g} m" for radius in radii)),
            Row("support", f"{format_count(len(self.support), 'corner')}, {sizes[0]:.4g} m by {sizes[1]:.4g} m, "
                f"{polygons.compute_area(self.support):.4g} m^2"),
            Row("least resistance", f"towards {self.weakest_azimuth:.4g} deg: lifted at {row['acceleration']:.4g} g, "
                f"alpha {row['alpha']:.4g} rad, p {row['p']:.4g} rad/s"),
            Row("left out there", f"products of inertia, {row['coupling']:.2g} of the moment; pivot "
                f"{row['lateral_offset']:.2g} m to the side of the centre of mass, {row['gap']:.2g} m from facing the "
                "other one"),
            *(Row("repaired", sentence) for sentence in self.repairs),
            *(Row("note", sentence) for sentence in self.notes),
        ]  # fmt: skip
        return f"{self._format_headline()}\n\n{format_rows(rows, 22)}"

    def to_dict(self) -> dict[str, Any]:
        units = {"height": "m", "volume": "m^3", "mass": "kg", "gravity": "m/s^2", "centre": "m"}
        units |= {"inertia_over_mass": "m^2", "support": "m", "weakest_azimuth": "deg"}
        rows = [Row(name, getattr(self, name), unit) for name, unit in units.items()]
        region_units = {"name": "1", "volume": "m^3", "density": "kg/m^3"}
        return {
            "description": self.description,
            **rows_to_dict(rows),
            "regions": [rows_to_dict(map(Row, region_units, part, region_units.values())) for part in self.regions],
            "repairs": [*self.repairs],
            "notes": [*self.notes],
        }


class Plane(NamedTuple):
    """Body in a vertical plane."""

    azimuth: float  # direction of side +, deg
    pivots: polygons.SupportExtent  # pivots of both sides
    height: float  # height of the centre of mass, m
    gyration: float  # radius of gyration, m


def compute_plane(solid: Solid, azimuth: float) -> Plane:
    """Return the body in the vertical plane of an azimuth."""
    direction = checks.finite(azimuth, "azimuth", BlockError)
    pivots = polygons.compute_extents(solid.support - solid.centre[:2], [direction, direction + 180.0])
    mean, difference = pivots.distance.mean(), np.ptp(pivots.distance)
    if difference <= 1e-12 * mean:  # rounding only: a symmetric body has equal sides at any position
        pivots = pivots._replace(distance=np.full(2, mean))
    gyration_squared, _ = compute_axis_moments(solid.inertia_over_mass, np.array([direction]))
    return Plane(direction, pivots, float(solid.centre[2]), math.sqrt(float(gyration_squared[0])))


def _check_array(value: ArrayLike, name: str, shape: tuple[int, ...]) -> Floats:
    array = np.array(checks.numbers(value, name, BlockError))
    if array.shape != shape or not np.all(np.isfinite(array)):
        raise BlockError(f"{{}} must be finite numbers of shape {shape}", name, value=value)
    return array


def _check_inertia(value: ArrayLike) -> Floats:
    tensor = _check_array(value, "inertia_over_mass", (3, 3))
    rounding = 1e-9 * float(np.abs(tensor).max())
    # No principal moment exceeds the sum of the other two.
    smallest, middle, largest = np.linalg.eigvalsh(0.5 * (tensor + tensor.T))
    is_symmetric = np.allclose(tensor, tensor.T, rtol=0.0, atol=rounding)
    if not (rounding > 0.0 and is_symmetric and smallest + middle >= largest - rounding and smallest > -rounding):
        message = "{} must be symmetric, with each principal moment at most the sum of the other two"
        raise BlockError(message, "inertia_over_mass", value=value)
    return tensor
