"""Horizontal sections of a body, and its outline from them: as it is seen from one side, and from above.

Seen along a horizontal axis, each connected piece of a section covers an interval, which its convex hull has as well.
So hulls at some heights are all that an outline needs, for every azimuth.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from rocking.arrays import Floats, Integers
from rocking.solid import support as polygons
from rocking.solid.repair import Surface, components

#: Bands between sections, at most; each has a section just above its lower end and one just below its upper end.
_BANDS: Final = 120
#: How far within a band its sections are, over its height: so that a step in the outline stays one.
_WITHIN: Final = 1e-6
#: Pieces of a section that are told apart, and corners that are kept of each: to 2e-4 of its size.
_PIECES: Final = 24
_DIRECTIONS: Final = polygons.directions(np.arange(0.0, 360.0, 2.0))


class Piece(NamedTuple):
    """Convex hull of a connected piece of a section: the number of the section, and corners, m, shape (n, 2)."""

    section: int
    corners: Floats


class Sections(NamedTuple):
    """Sections in pairs: band k lies between heights 2k and 2k + 1, m; pieces in the order of their sections."""

    heights: Floats
    pieces: tuple[Piece, ...]

    def across(self, azimuth: float) -> Floats:
        """Return the outline as it is seen along the axis across an azimuth, to the right of which is that direction.

        Returns
        -------
        ndarray, shape (n, 6)
            Trapezoids: their lower and upper end, left and right end below, left and right end above, m.
        """
        towards = polygons.directions(azimuth)[0]
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
    within = _WITHIN * np.diff(kept)
    heights = np.column_stack([kept[:-1] + within, kept[1:] - within]).ravel()
    cuts = [_Cuts(each) for each in surfaces]
    found = [Piece(k, hull) for k, height in enumerate(heights) for hull in _hulls(cuts, float(height))]
    return Sections(np.column_stack([kept[:-1], kept[1:]]).ravel(), tuple(found))


class _Cuts:
    """A surface, ready to be cut at many heights."""

    def __init__(self, surface: Surface) -> None:
        self.vertices, self.faces = surface.vertices, surface.faces
        tall = self.vertices[self.faces, 2]
        self.low, self.high = tall.min(axis=1), tall.max(axis=1)

    def at(self, height: float) -> tuple[Floats, Integers]:
        """Places on edges that a plane cuts, shape (n, 2), and the number of the connected piece that each is of."""
        faces = self.faces[(self.low < height) & (self.high > height)]
        if not len(faces):
            return np.empty((0, 2)), np.empty(0, np.int64)
        edges = faces[:, [[0, 1], [1, 2], [2, 0]]]
        above = self.vertices[edges, 2] > height
        cut = np.sort(edges[above[..., 0] != above[..., 1]], axis=1)  # two of each triangle, one after the other
        unique, index = np.unique(cut, axis=0, return_inverse=True)
        one, other = self.vertices[unique[:, 0]], self.vertices[unique[:, 1]]
        part = (height - one[:, 2]) / (other[:, 2] - one[:, 2])
        places = one[:, :2] + part[:, None] * (other[:, :2] - one[:, :2])
        return places, components(len(unique), index.reshape(-1, 2))


def _hulls(cuts: Sequence[_Cuts], height: float) -> list[Floats]:
    """Convex hulls of the pieces of a section; of very many pieces, one around all."""
    found: list[Floats] = []
    for each in cuts:
        places, piece = each.at(height)
        count = int(piece.max(initial=-1)) + 1
        if count > _PIECES:
            piece, count = np.zeros(len(places), np.int64), 1
        found += [_hull(places[piece == k]) for k in range(count)]
    return found if len(found) <= _PIECES else [_hull(np.vstack(found))]


def _hull(places: Floats) -> Floats:
    """Return the corners of a hull, or of a polygon in it that differs by nothing that is seen."""
    hull = polygons.hull(places)
    if hull is None:  # on one line: its ends
        order = np.lexsort(places.T)
        return places[order[[0, -1]]]
    return hull if len(hull) <= len(_DIRECTIONS) else hull[np.unique(np.argmax(hull @ _DIRECTIONS.T, axis=0))]


def _united(intervals: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return intervals that do not meet, from left to right."""
    found: list[tuple[float, float]] = []
    for left, right in sorted(intervals):
        if found and left <= found[-1][1]:
            found[-1] = (found[-1][0], max(found[-1][1], right))
        else:
            found.append((left, right))
    return found
