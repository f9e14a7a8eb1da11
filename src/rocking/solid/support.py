"""Support polygons in any direction, and horizontal sections of a body for its outline.

Seen along a horizontal axis, a section and its convex hull have the same ends. Therefore convex hulls at some heights
determine the outline for every azimuth.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import InvalidBlock
from rocking.motion.processing import sine_cosine
from rocking.solid.repair import Surface

#: Largest distance from the outermost corner, relative to the polygon, of corners on one edge.
_ON_EDGE: Final = 1e-6

#: Largest number of bands, each with sections just above its lower and just below its upper end.
_BANDS: Final = 120


class Extent(NamedTuple):
    """Reach of a support in n directions, and ends of the edge or corner there, 90 deg counterclockwise; m, (n,)."""

    distance: Floats
    low: Floats
    high: Floats

    @property
    def aside(self) -> Floats:
        """Lateral distance of the edge or corner from the centre of mass, m; 0 if an edge extends past it."""
        return np.asarray(np.maximum(np.maximum(self.low, -self.high), 0.0))


def directions(azimuths: ArrayLike) -> Floats:
    """Return unit vectors (east, north) of azimuths, degrees; shape (n, 2)."""
    sine, cosine = sine_cosine(np.atleast_1d(np.asarray(azimuths, dtype=np.float64)))
    return np.column_stack([sine, cosine])


def hull(points: Floats) -> Floats | None:
    """Return the convex hull of points in a plane, counterclockwise; None if it has no area."""
    from scipy.spatial import ConvexHull, QhullError

    off = points - points.mean(axis=0)
    if len(points) < 3 or np.linalg.matrix_rank(off, tol=_ON_EDGE * float(np.abs(off).max())) < 2:
        return None
    try:
        return np.asarray(points[ConvexHull(off).vertices])
    except QhullError:
        return None


def area(polygon: Floats) -> float:
    """Compute the area of a polygon, m^2."""
    x, y = (polygon - polygon[0]).T
    return float(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def given_polygon(value: ArrayLike) -> Floats:
    """Return the convex hull of the corners from a user, shape (n, 2), or raise `InvalidBlock`."""
    points = checks.numbers(value, "support", InvalidBlock)
    if points.ndim != 2 or points.shape[1] != 2 or not np.all(np.isfinite(points)):
        raise InvalidBlock("{} must be corners of a polygon, each a finite (east, north) in m", "support", value=value)
    found = hull(points)
    if found is None:
        raise InvalidBlock("{} must have three corners or more that are not on one line", "support")
    return found


def extents(polygon: Floats, azimuths: ArrayLike) -> Extent:
    """Return the reach in each direction of a polygon around the centre of mass."""
    towards = directions(azimuths)
    reach, across = polygon @ towards.T, polygon @ np.column_stack([-towards[:, 1], towards[:, 0]]).T
    most = reach.max(axis=0)
    outermost = reach >= most - _ON_EDGE * float(np.ptp(polygon, axis=0).max())
    low, high = np.where(outermost, across, np.inf).min(axis=0), np.where(outermost, across, -np.inf).max(axis=0)
    return Extent(most, low, high)


def edges(polygon: Floats) -> tuple[Floats, Floats]:
    """Return the azimuths of outward normals of edges, degrees, and distances of edges from the origin, m."""
    along = np.roll(polygon, -1, axis=0) - polygon
    outward = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1, keepdims=True)
    azimuth = np.mod(np.rad2deg(np.arctan2(outward[:, 0], outward[:, 1])), 360.0)
    return azimuth, np.sum(outward * polygon, axis=1)


class Sections(NamedTuple):
    """Sections in pairs: heights (m), and the corners of the convex hull of each (m, shape (n, 2))."""

    heights: Floats
    hulls: tuple[Floats, ...]

    def across(self, azimuth: float) -> Floats:
        """Return the outline across an azimuth as trapezoids: heights, ends below and ends above, m, shape (n, 6)."""
        reach = [corners @ directions(azimuth)[0] for corners in self.hulls]
        ends = np.array([(each.min(), each.max()) for each in reach])
        return np.column_stack([self.heights.reshape(-1, 2), ends.reshape(-1, 4)])


def sections_of(surfaces: Sequence[Surface]) -> Sections:
    """Return sections of closed surfaces at the heights of all or some corners."""
    corners = np.unique(np.concatenate([np.unique(each.vertices[each.faces, 2]) for each in surfaces]))
    size = float(corners[-1] - corners[0])
    first = np.unique(np.rint((corners - corners[0]) * (10.0 * _BANDS / size)), return_index=True)[1]
    kept = np.append(corners[first[:-1]], corners[-1])
    if len(kept) > _BANDS + 1:
        kept = np.linspace(corners[0], corners[-1], _BANDS + 1)
    within = 1e-6 * np.diff(kept)  # preserves a step in the outline
    heights = np.column_stack([kept[:-1] + within, kept[1:] - within]).ravel()
    reach = [(tall.min(axis=1), tall.max(axis=1)) for tall in (each.vertices[each.faces, 2] for each in surfaces)]
    hulls = tuple(_section(surfaces, reach, float(height)) for height in heights)
    return Sections(np.column_stack([kept[:-1], kept[1:]]).ravel(), hulls)


def _section(surfaces: Sequence[Surface], reach: Sequence[tuple[Floats, Floats]], height: float) -> Floats:
    """Return the convex hull of a section, or a polygon inside it that differs by at most 2e-4 of its size."""
    places = []
    for (vertices, faces, _), (low, high) in zip(surfaces, reach, strict=True):
        cut = faces[(low < height) & (high > height)]
        edges = cut[:, [[0, 1], [1, 2], [2, 0]]]
        is_above = vertices[edges, 2] > height
        crossed = np.sort(edges[is_above[..., 0] != is_above[..., 1]], axis=1)
        one, other = vertices[crossed[:, 0]], vertices[crossed[:, 1]]
        part = (height - one[:, 2]) / (other[:, 2] - one[:, 2])
        places.append(one[:, :2] + part[:, None] * (other[:, :2] - one[:, :2]))
    every = np.vstack(places)
    if not len(every):  # between separate pieces: no width
        return surfaces[0].vertices[:1, :2]
    around = hull(every)
    if around is None:  # on one line: its ends
        return every[np.lexsort(every.T)[[0, -1]]]
    towards = directions(np.arange(0.0, 360.0, 2.0))
    return around if len(around) <= len(towards) else around[np.unique(np.argmax(around @ towards.T, axis=0))]
