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
from rocking.errors import BlockError
from rocking.motion.processing import sine_cosine
from rocking.solid.repair import Surface

#: Largest distance from the outermost corner, relative to the polygon, of corners on one edge.
_EDGE_TOLERANCE: Final = 1e-6

#: Largest number of bands, each with sections just above its lower and just below its upper end.
_MAX_BANDS: Final = 120


class SupportExtent(NamedTuple):
    """Reach of a support in n directions, m, shape (n,) each."""

    distance: Floats  # distance of the outermost edge or corner
    low: Floats  # lower lateral end of it, positive 90 deg counterclockwise
    high: Floats  # upper lateral end of it

    @property
    def lateral_offset(self) -> Floats:
        """Lateral distance of the edge or corner from the centre of mass, m; 0 if an edge extends past it."""
        return np.asarray(np.maximum(np.maximum(self.low, -self.high), 0.0))


def compute_directions(azimuths: ArrayLike) -> Floats:
    """Return unit vectors (east, north) of azimuths, degrees; shape (n, 2)."""
    sine, cosine = sine_cosine(np.atleast_1d(np.asarray(azimuths, dtype=np.float64)))
    return np.column_stack([sine, cosine])


def compute_hull(points: Floats) -> Floats | None:
    """Return the convex hull of points in a plane, counterclockwise; None if it has no area."""
    from scipy.spatial import ConvexHull, QhullError

    offsets = points - points.mean(axis=0)
    if len(points) < 3 or np.linalg.matrix_rank(offsets, tol=_EDGE_TOLERANCE * float(np.abs(offsets).max())) < 2:
        return None
    try:
        return np.asarray(points[ConvexHull(offsets).vertices])
    except QhullError:
        return None


def compute_area(polygon: Floats) -> float:
    """Compute the area of a polygon, m^2."""
    x, y = (polygon - polygon[0]).T
    return float(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def check_polygon(value: ArrayLike) -> Floats:
    """Return the convex hull of the corners from a user, shape (n, 2), or raise `BlockError`."""
    points = checks.numbers(value, "support", BlockError)
    if points.ndim != 2 or points.shape[1] != 2 or not np.all(np.isfinite(points)):
        raise BlockError("{} must be corners of a polygon, each a finite (east, north) in m", "support", value=value)
    polygon = compute_hull(points)
    if polygon is None:
        raise BlockError("{} must have at least three corners that are not on one line", "support")
    return polygon


def compute_extents(polygon: Floats, azimuths: ArrayLike) -> SupportExtent:
    """Return the reach in each direction of a polygon around the centre of mass."""
    directions = compute_directions(azimuths)
    reach, across = polygon @ directions.T, polygon @ np.column_stack([-directions[:, 1], directions[:, 0]]).T
    max_reach = reach.max(axis=0)
    outermost = reach >= max_reach - _EDGE_TOLERANCE * float(np.ptp(polygon, axis=0).max())
    low, high = np.where(outermost, across, np.inf).min(axis=0), np.where(outermost, across, -np.inf).max(axis=0)
    return SupportExtent(max_reach, low, high)


def compute_edges(polygon: Floats) -> tuple[Floats, Floats]:
    """Return the azimuths of outward normals of edges, degrees, and distances of edges from the origin, m."""
    vectors = np.roll(polygon, -1, axis=0) - polygon
    outward = np.column_stack([vectors[:, 1], -vectors[:, 0]]) / np.linalg.norm(vectors, axis=1, keepdims=True)
    azimuth = np.mod(np.rad2deg(np.arctan2(outward[:, 0], outward[:, 1])), 360.0)
    return azimuth, np.sum(outward * polygon, axis=1)


class Sections(NamedTuple):
    """Horizontal sections of a body, in pairs."""

    heights: Floats  # heights, m
    hulls: tuple[Floats, ...]  # corners of the convex hull of each section, m, shape (n, 2)

    def compute_outline(self, azimuth: float) -> Floats:
        """Return the outline across an azimuth as trapezoids: heights, ends below and ends above, m, shape (n, 6)."""
        reach = [corners @ compute_directions(azimuth)[0] for corners in self.hulls]
        ends = np.array([(section_reach.min(), section_reach.max()) for section_reach in reach])
        return np.column_stack([self.heights.reshape(-1, 2), ends.reshape(-1, 4)])


def compute_sections(surfaces: Sequence[Surface]) -> Sections:
    """Return sections of closed surfaces at the heights of all or some corners."""
    corners = np.unique(np.concatenate([np.unique(surface.vertices[surface.faces, 2]) for surface in surfaces]))
    size = float(corners[-1] - corners[0])
    first = np.unique(np.rint((corners - corners[0]) * (10.0 * _MAX_BANDS / size)), return_index=True)[1]
    bands = np.append(corners[first[:-1]], corners[-1])
    if len(bands) > _MAX_BANDS + 1:
        bands = np.linspace(corners[0], corners[-1], _MAX_BANDS + 1)
    margin = 1e-6 * np.diff(bands)  # preserves a step in the outline
    heights = np.column_stack([bands[:-1] + margin, bands[1:] - margin]).ravel()
    reach = [(z.min(axis=1), z.max(axis=1)) for z in (surface.vertices[surface.faces, 2] for surface in surfaces)]
    hulls = tuple(_cut_section(surfaces, reach, float(height)) for height in heights)
    return Sections(np.column_stack([bands[:-1], bands[1:]]).ravel(), hulls)


def _cut_section(surfaces: Sequence[Surface], reach: Sequence[tuple[Floats, Floats]], height: float) -> Floats:
    """Return the convex hull of a section, or a polygon inside it that differs by at most 2e-4 of its size."""
    points = []
    for (vertices, faces, _), (low, high) in zip(surfaces, reach, strict=True):
        cut_faces = faces[(low < height) & (high > height)]
        edges = cut_faces[:, [[0, 1], [1, 2], [2, 0]]]
        is_above = vertices[edges, 2] > height
        crossing_edges = np.sort(edges[is_above[..., 0] != is_above[..., 1]], axis=1)
        start, end = vertices[crossing_edges[:, 0]], vertices[crossing_edges[:, 1]]
        fraction = (height - start[:, 2]) / (end[:, 2] - start[:, 2])
        points.append(start[:, :2] + fraction[:, None] * (end[:, :2] - start[:, :2]))
    all_points = np.vstack(points)
    if not len(all_points):  # between separate pieces: no width
        return surfaces[0].vertices[:1, :2]
    polygon = compute_hull(all_points)
    if polygon is None:  # on one line: its ends
        return all_points[np.lexsort(all_points.T)[[0, -1]]]
    directions = compute_directions(np.arange(0.0, 360.0, 2.0))
    return polygon if len(polygon) <= len(directions) else polygon[np.unique(np.argmax(polygon @ directions.T, axis=0))]
