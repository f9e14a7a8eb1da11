"""Where a body stands: the convex polygon of its support, and its edges and corners across a direction."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rocking import checks
from rocking.arrays import Floats
from rocking.errors import InvalidBlock, literal
from rocking.motion.directions import sine_cosine

#: Corners of a polygon within this part of its size of the outermost one are on one edge with it.
_ON_EDGE: Final = 1e-6


class Extent(NamedTuple):
    """How far a support reaches in n directions from the centre of mass, and what it turns about there; m.

    Attributes
    ----------
    distance : ndarray, shape (n,)
        How far it reaches.
    low, high : ndarray, shape (n,)
        Ends of the edge, or the corner twice, that is farthest, in the direction 90 deg counterclockwise.
    """

    distance: Floats
    low: Floats
    high: Floats

    @property
    def aside(self) -> Floats:
        """How far the edge or corner lies to the side of the centre of mass, m; 0 where an edge reaches past it."""
        return np.asarray(np.maximum(np.maximum(self.low, -self.high), 0.0))


def directions(azimuths: ArrayLike) -> Floats:
    """Return unit vectors (east, north) of azimuths, degrees; shape (n, 2)."""
    sine, cosine = sine_cosine(np.atleast_1d(np.asarray(azimuths, dtype=np.float64)))
    return np.column_stack([sine, cosine])


def hull(points: Floats) -> Floats | None:
    """Return the corners of the convex polygon around points in a plane, counterclockwise; None if it has no area."""
    from scipy.spatial import ConvexHull, QhullError

    off = points - points.mean(axis=0)
    if len(points) < 3 or np.linalg.matrix_rank(off, tol=_ON_EDGE * float(np.abs(off).max())) < 2:
        return None
    try:
        return np.asarray(points[ConvexHull(off).vertices])
    except QhullError:
        return None


def area(polygon: Floats) -> float:
    """Area of a polygon, m^2."""
    x, y = (polygon - polygon[0]).T
    return float(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def given_polygon(value: ArrayLike) -> Floats:
    """Return the convex polygon around points that somebody gives, shape (n, 2), or refuse them."""
    try:
        points = np.asarray(value, float)
    except (TypeError, ValueError):
        points = np.empty(0)
    if points.ndim != 2 or points.shape[1] != 2 or not np.all(np.isfinite(points)):
        raise InvalidBlock(
            f"{{}} must be corners of a polygon, each a finite (east, north) in m, not {literal(checks.shown(value))}",
            "support",
            value=value,
        )
    found = hull(points)
    if found is None:
        raise InvalidBlock("{} must have three corners or more that are not on one line", "support")
    return found


def extents(polygon: Floats, azimuths: ArrayLike) -> Extent:
    """Return how far a polygon about the centre of mass reaches in each direction."""
    towards = directions(azimuths)
    reach, across = polygon @ towards.T, polygon @ np.column_stack([-towards[:, 1], towards[:, 0]]).T
    most = reach.max(axis=0)
    outermost = reach >= most - _ON_EDGE * float(np.ptp(polygon, axis=0).max())
    low, high = np.where(outermost, across, np.inf).min(axis=0), np.where(outermost, across, -np.inf).max(axis=0)
    return Extent(most, low, high)


def edges(polygon: Floats) -> tuple[Floats, Floats]:
    """Return the azimuths that the edges of a polygon face, degrees, and their distances from the origin, m."""
    along = np.roll(polygon, -1, axis=0) - polygon
    outward = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1, keepdims=True)
    azimuth = np.mod(np.rad2deg(np.arctan2(outward[:, 0], outward[:, 1])), 360.0)
    return azimuth, np.sum(outward * polygon, axis=1)
