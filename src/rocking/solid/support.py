"""The convex polygon of a body's support, in any direction; horizontal sections of a body, and its outline from them.

Seen along a horizontal axis, each connected piece of a section covers an interval, which its convex hull has as well.
So hulls at some heights are all that an outline needs, for every azimuth.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.errors import InvalidBlock, literal
from rocking.motion.processing import sine_cosine
from rocking.solid.repair import Surface, components

#: Corners of a polygon within this part of its size of the outermost one are on one edge with it.
_ON_EDGE: Final = 1e-6

#: Most bands between sections; each has a section just above its lower end and one just below its upper end.
_BANDS: Final = 120
#: Most pieces of a section that are kept apart.
_PIECES: Final = 24


class Extent(NamedTuple):
    """Reach of a support in n directions, and ends of the edge or corner there, 90 deg counterclockwise; m, (n,)."""

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


class Piece(NamedTuple):
    """Convex hull of a connected piece of a section: the number of the section, and corners, m, shape (n, 2)."""

    section: int
    corners: Floats


class Sections(NamedTuple):
    """Sections in pairs: band k lies between heights 2k and 2k + 1, m; pieces in the order of their sections."""

    heights: Floats
    pieces: tuple[Piece, ...]

    def across(self, azimuth: float) -> Floats:
        """Return the outline across an azimuth as trapezoids: heights, ends below and ends above, m, shape (n, 6)."""
        towards = directions(azimuth)[0]
        ends: list[list[tuple[float, float]]] = [[] for _ in self.heights]
        for section, corners in self.pieces:
            reach = corners @ towards
            ends[section].append((float(reach.min()), float(reach.max())))
        rows = []
        for k in range(0, len(self.heights), 2):
            low, high = (float(each) for each in self.heights[k : k + 2])
            below, above = (_united(each) for each in ends[k : k + 2])
            if len(below) == len(above):
                rows += [(low, high, *one, *other) for one, other in zip(below, above, strict=True)]
            else:
                middle = 0.5 * (low + high)
                rows += [(low, middle, *one, *one) for one in below] + [(middle, high, *one, *one) for one in above]
        return np.array(rows).reshape(-1, 6)


def sections_of(surfaces: Sequence[Surface]) -> Sections:
    """Return sections of a body at the heights of its corners, or of some of them, from closed surfaces."""
    corners = np.unique(np.concatenate([np.unique(each.vertices[each.faces, 2]) for each in surfaces]))
    size = float(corners[-1] - corners[0])
    first = np.unique(np.rint((corners - corners[0]) * (10.0 * _BANDS / size)), return_index=True)[1]
    kept = np.append(corners[first[:-1]], corners[-1])
    if len(kept) > _BANDS + 1:
        kept = np.linspace(corners[0], corners[-1], _BANDS + 1)
    within = 1e-6 * np.diff(kept)  # so that a step in the outline stays one
    heights = np.column_stack([kept[:-1] + within, kept[1:] - within]).ravel()
    reach = [(tall.min(axis=1), tall.max(axis=1)) for tall in (each.vertices[each.faces, 2] for each in surfaces)]
    found = [Piece(k, hull) for k, height in enumerate(heights) for hull in _hulls(surfaces, reach, float(height))]
    return Sections(np.column_stack([kept[:-1], kept[1:]]).ravel(), tuple(found))


def _hulls(surfaces: Sequence[Surface], reach: Sequence[tuple[Floats, Floats]], height: float) -> list[Floats]:
    """Convex hulls of the pieces of a section; of very many pieces, one around all."""
    found: list[Floats] = []
    for (vertices, faces, _), (low, high) in zip(surfaces, reach, strict=True):
        cut = faces[(low < height) & (high > height)]
        if not len(cut):
            continue
        edges = cut[:, [[0, 1], [1, 2], [2, 0]]]
        is_above = vertices[edges, 2] > height
        crossed = np.sort(edges[is_above[..., 0] != is_above[..., 1]], axis=1)  # two of each triangle, side by side
        unique, index = np.unique(crossed, axis=0, return_inverse=True)
        one, other = vertices[unique[:, 0]], vertices[unique[:, 1]]
        part = (height - one[:, 2]) / (other[:, 2] - one[:, 2])
        places = one[:, :2] + part[:, None] * (other[:, :2] - one[:, :2])
        piece = components(len(unique), index.reshape(-1, 2))
        count = int(piece.max()) + 1
        if count > _PIECES:
            piece, count = np.zeros(len(places), np.int64), 1
        found += [_hull(places[piece == k]) for k in range(count)]
    return found if len(found) <= _PIECES else [_hull(np.vstack(found))]


def _hull(places: Floats) -> Floats:
    """Return the corners of a hull, or of a polygon in it that differs by at most 2e-4 of its size."""
    around = hull(places)
    if around is None:  # on one line: its ends
        return places[np.lexsort(places.T)[[0, -1]]]
    towards = directions(np.arange(0.0, 360.0, 2.0))
    return around if len(around) <= len(towards) else around[np.unique(np.argmax(around @ towards.T, axis=0))]


def _united(intervals: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return intervals that do not meet, from left to right."""
    found: list[tuple[float, float]] = []
    for left, right in sorted(intervals):
        if found and left <= found[-1][1]:
            found[-1] = (found[-1][0], max(found[-1][1], right))
        else:
            found.append((left, right))
    return found
