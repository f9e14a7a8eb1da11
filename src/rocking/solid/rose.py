"""Resistance of a body in every direction."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.result import DatasetResult, create_variable, format_some_rows
from rocking.core.tables import Column, columns_to_records, escape_dollars, round_decimal
from rocking.errors import OptionError
from rocking.solid import support as polygons

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Default azimuths, degrees.
DEFAULT_AZIMUTHS: Final = np.arange(0.0, 360.0, 5.0)


@dataclass(frozen=True, eq=False, repr=False)
class ResistanceRose(DatasetResult):
    """Resistance of a body to rocking in every direction, returned by `Solid.rose`.

    The figure shows the uplift acceleration in each direction. Inside is the support polygon about the centre of mass,
    divided by its height: its reach equals the ratio of this acceleration to g. A second panel shows slenderness and
    frequency parameter against the azimuth.

    Attributes
    ----------
    data : xarray.Dataset
        Over (azimuth), degrees clockwise from north: acceleration of the ground, in g, that lifts the body to this
        side, and overturns it if it lasts; alpha (rad), the tilt of a table that overturns the body; p (rad/s);
        restitution on leaving this side; radius R (m); rise of the centre of mass up to the unstable balance (m).
        Effects neglected in planar rocking: coupling, ratio of the products of inertia to the moment about the axis;
        lateral_offset of the pivot from the centre of mass (m); gap, lateral distance between the pivots of both sides
        (m). Over (corner): east and north of the centre of mass (m), the support polygon. Attributes:
        weakest_azimuth and weakest_acceleration, exact, and height_of_mass (m).

    See Also
    --------
    rocking.Solid : Rigid body in space.

    Examples
    --------
    >>> import rocking
    >>> rose = rocking.Solid.from_mesh("statue", density=2650.0).rose([0.0, 90.0])
    >>> rose.data.acceleration.values.round(3).tolist()
    [0.307, 0.282]
    """

    TABLES = MappingProxyType({
        "rose": ("acceleration", "alpha", "p", "restitution", "radius", "rise", "coupling", "lateral_offset", "gap"),
        "support": ("east", "north"),
    })  # fmt: skip

    def _format_headline(self) -> str:
        data = self.data
        weakest = f"towards {data.weakest_azimuth:.4g} deg, at {data.weakest_acceleration:.4g} g"
        return f"{data.description}: lifted first {weakest}"

    def summary(self) -> str:
        data = self.data
        titles = {"azimuth": "azimuth, deg", "acceleration": "uplift, g", "alpha": "alpha, rad", "p": "p, rad/s"} | {
            "restitution": "restitution", "coupling": "coupling", "lateral_offset": "lateral offset, m"
        }  # fmt: skip
        rows = [*zip(*(data[name].values.tolist() for name in titles), strict=True)]
        coupling, offset, gap = (float(data[name].max()) for name in ("coupling", "lateral_offset", "gap"))
        limits = (
            "planar rocking leaves out turning about the vertical and rolling over corners: over all azimuths "
            f"products of inertia are up to {coupling:.2g} of the moment, pivots lie up to {offset:.2g} m to the side "
            f"of the centre of mass, and those of both sides up to {gap:.2g} m from facing each other"
        )
        return "\n\n".join([self._format_headline(), format_some_rows([*titles.values()], rows), limits])

    def to_dict(self) -> dict[str, Any]:
        data = self.data
        columns = [Column(name, data[name].values) for name in ("azimuth", *self.TABLES["rose"])]
        return {
            "description": data.description,
            "weakest_azimuth_deg": data.weakest_azimuth,
            "weakest_acceleration_g": data.weakest_acceleration,
            "height_of_mass_m": data.height_of_mass,
            "gravity_m_s2": data.gravity,
            "support_m": np.column_stack([data.east.values, data.north.values]).tolist(),
            "rose": columns_to_records(columns),
        }

    def plot(self, ax: Axes | None = None, *, title: str = "", figsize: tuple[float, float] | None = None) -> Figure:
        from rocking.plot.maps import draw_rose

        data = self.data
        return draw_rose(
            azimuth=data.azimuth.values,
            acceleration=data.acceleration.values,
            slenderness=np.rad2deg(data.alpha.values),
            p=data.p.values,
            support=np.column_stack([data.east.values, data.north.values]) / data.height_of_mass,
            weakest=(data.weakest_azimuth, data.weakest_acceleration),
            title=title or escape_dollars(self._format_headline()),
            ax=ax,
            figsize=figsize,
        )


def check_azimuths(azimuths: ArrayLike | None) -> Floats:
    """Return unique, increasing azimuths in [0, 360), degrees, or raise `OptionError`."""
    if azimuths is None:
        return DEFAULT_AZIMUTHS
    angles = np.atleast_1d(checks.numbers(azimuths, "azimuths", OptionError))
    if angles.ndim != 1 or not angles.size or not np.all(np.isfinite(angles)):
        raise OptionError("{} must be one finite number or more, degrees clockwise from north", "azimuths")
    return np.unique([round_decimal(value) % 360.0 for value in np.mod(angles, 360.0).tolist()])


def compute_rose(
    polygon: Floats, height: float, inertia: Floats, gravity: float, azimuths: Floats, description: str
) -> ResistanceRose:
    """Return the rose from the support about the centre of mass, its height, m, and `inertia_over_mass`, m^2."""
    import xarray as xr

    front, back = (polygons.compute_extents(polygon, direction) for direction in (azimuths, azimuths + 180.0))
    radius, back_radius = np.hypot(front.distance, height), np.hypot(back.distance, height)
    gyration_squared, coupling = compute_axis_moments(inertia, azimuths)
    edge_azimuths, distances = polygons.compute_edges(polygon)
    weakest = int(np.argmin(distances))
    numerator = gyration_squared + height**2 - front.distance * back.distance
    restitution = numerator / (gyration_squared + back_radius**2)
    gap = np.maximum(np.maximum(front.low + back.low, -front.high - back.high), 0.0)
    meaning = "factor on the angular speed on leaving this side, by angular momentum; not positive: too stocky to rock"
    columns = {
        "acceleration": (front.distance / height, "ground acceleration that lifts the body to this side", "g"),
        "alpha": (np.arctan2(front.distance, height), "slenderness, at which a tilted table overturns it", "rad"),
        "p": (np.sqrt(gravity * radius / (gyration_squared + radius**2)), "frequency parameter", "rad/s"),
        "restitution": (restitution, meaning, "1"),
        "radius": (radius, "distance from the pivot to the centre of mass", "m"),
        "rise": (radius - height, "rise of the centre of mass up to the unstable balance", "m"),
        "coupling": (coupling, "products of inertia about the axis of rocking over the moment of inertia", "1"),
        "lateral_offset": (front.lateral_offset, "how far the pivot lies to the side of the centre of mass", "m"),
        "gap": (gap, "how far the pivots of both sides are from facing each other", "m"),
    }
    variables = {name: create_variable("azimuth", *column) for name, column in columns.items()}
    variables["east"] = create_variable("corner", polygon[:, 0], "support, east of the centre of mass", "m")
    variables["north"] = create_variable("corner", polygon[:, 1], "support, north of the centre of mass", "m")
    attributes = {
        "description": description,
        "weakest_azimuth": float(edge_azimuths[weakest]),
        "weakest_acceleration": float(distances[weakest] / height),
        "height_of_mass": height,
        "gravity": gravity,
    }
    coordinates = {"azimuth": create_variable("azimuth", azimuths, "clockwise from north", "deg")}
    return ResistanceRose(xr.Dataset(variables, coordinates, attributes))


def compute_axis_moments(inertia: Floats, azimuths: Floats) -> tuple[Floats, Floats]:
    """Return moments about horizontal axes perpendicular to azimuths, and ratios of products of inertia to them."""
    directions = polygons.compute_directions(azimuths)
    axis = np.column_stack([directions[:, 1], -directions[:, 0], np.zeros(len(directions))])
    torque = axis @ inertia
    gyration_squared = np.sum(torque * axis, axis=1)
    products = np.hypot(np.sum(torque[:, :2] * directions, axis=1), torque[:, 2])
    return gyration_squared, products / gyration_squared
