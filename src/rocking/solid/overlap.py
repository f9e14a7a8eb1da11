"""Volume that two pieces of a mesh have in common, and which is counted twice: at least so much, by proof.

A box that no triangle of either surface enters lies wholly inside or outside of each. Boxes that triangles enter are
halved, the largest first, until they are small or so much has been done; what lies inside both is then counted.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from rocking.arrays import Flags, Floats, Integers
from rocking.solid.moments import signed_volumes
from rocking.solid.repair import Surface, shells_of, winding

#: Triangles that are looked at, over all pairs; boxes of one pair; pairs.
_WORK: Final = 20_000_000
_BOXES: Final = 1_500
_PAIRS: Final = 50
#: What a triangle costs in a winding number, over what it costs to ask whether it enters a box.
_WINDING: Final = 5
#: Pairs that are named.
_NAMED: Final = 3
#: Surfaces that lie so near, over the size of the mesh, touch; so small a share of the smaller piece is left out.
_TOUCH: Final = 1e-9
_SMALL: Final = 1e-4
#: What is left of a box's edge over the numbers that rounding loses in the distance of a triangle's plane.
_ROUNDING: Final = 1e-13


class _Piece(NamedTuple):
    """A closed surface with its cavities: the part that it is of, its corners, triangles and volume."""

    part: str
    vertices: Floats
    faces: Integers
    volume: float

    @property
    def ends(self) -> tuple[Floats, Floats]:
        corners = self.vertices[self.faces].reshape(-1, 3)
        return corners.min(axis=0), corners.max(axis=0)


def overlaps(names: Sequence[str], surfaces: Sequence[Surface]) -> tuple[str, ...]:
    """Return a sentence on what pieces of a mesh have in common; none where nothing is proven."""
    pieces = [piece for name, surface in zip(names, surfaces, strict=True) for piece in _pieces(name, surface)]
    ends = [piece.ends for piece in pieces]
    size = max(float(np.max(high - low)) for low, high in ends)
    boxes = []
    for i, j in itertools.combinations(range(len(pieces)), 2):
        low, high = np.maximum(ends[i][0], ends[j][0]), np.minimum(ends[i][1], ends[j][1])
        if np.all(high - low > 2.0 * _TOUCH * size):
            boxes.append((float(np.prod(high - low)), pieces[i], pieces[j], low, high))
    boxes = sorted(boxes, key=lambda box: -box[0])[:_PAIRS]
    found = []
    for _, one, other, low, high in boxes:
        common = _common(one, other, low, high, _TOUCH * size, _WORK // len(boxes))
        if common > _SMALL * min(one.volume, other.volume):
            found.append((common, one.part, other.part))
    if not found:
        return ()
    found.sort(key=lambda pair: -pair[0])
    said = [
        f"{f'{one} and {other}' if one != other else f'two pieces of {one}'} overlap in at least {_at_least(common)} "
        "m^3"
        for common, one, other in found[:_NAMED]
    ]
    more = f", and so do {len(found) - _NAMED} more pairs" if len(found) > _NAMED else ""
    return (
        f"{', '.join(said)}{more}, which is counted twice: make one surface of the two, cut one out of the other, or, "
        "if one is a cavity, turn its normals inwards",
    )


def _pieces(name: str, surface: Surface) -> list[_Piece]:
    """Part a surface into closed ones whose normals point outwards, each with its cavities."""
    vertices, faces, _ = surface
    label = shells_of(faces)
    volumes = np.bincount(label, weights=signed_volumes(vertices, faces))
    outer = np.flatnonzero(volumes > 0.0)
    if len(outer) == 1:
        return [_Piece(name, vertices, faces, float(volumes.sum()))]
    members = {int(k): [faces[label == k]] for k in outer}
    for k in np.flatnonzero(volumes < 0.0):
        cavity = faces[label == k]
        around = [n for n, parts in members.items() if winding(vertices, parts[0], vertices[cavity[0, 0]]) > 0.5]
        for n in around[:1]:
            members[n].append(cavity)
    return [_Piece(name, vertices, np.vstack(parts), float(volumes[n])) for n, parts in members.items()]


def _common(one: _Piece, other: _Piece, low: Floats, high: Floats, touch: float, work: int) -> float:
    """Proven volume of what lies in two pieces and in a box, m^3."""
    pieces = one, other
    corners = [piece.vertices[piece.faces] for piece in pieces]
    normals = [np.cross(each[:, 1] - each[:, 0], each[:, 2] - each[:, 0]) for each in corners]
    smallest, volume, count = float(np.prod(high - low)) / _BOXES**2, 0.0, itertools.count()
    # Each box with the triangles of both pieces that may enter it; None of a piece that it lies in.
    entering: list[Integers | None] = [np.arange(len(each)) for each in corners]
    waiting = [(-math.inf, next(count), low, high, entering)]
    for _ in range(_BOXES):
        if not waiting or work < 0:
            break
        _, _, low, high, before = heapq.heappop(waiting)
        low_in, high_in, after = low + touch, high - touch, [*before]
        outside = False
        for k, faces in enumerate(before):
            if faces is None or outside:
                continue
            work -= len(faces)
            left = faces[_may_enter(corners[k][faces], normals[k][faces], low_in, high_in)]
            after[k] = left
            if not len(left):
                work -= _WINDING * len(corners[k])
                after[k] = None
                outside = winding(pieces[k].vertices, pieces[k].faces, 0.5 * (low + high)) < 0.5
        if outside:
            continue
        inner = float(np.prod(high_in - low_in))
        if after[0] is None and after[1] is None:
            volume += inner
            continue
        longest = int(np.argmax(high - low))
        if inner < smallest or high[longest] - low[longest] <= 8.0 * touch:
            continue
        middle = 0.5 * (low[longest] + high[longest])
        for end, at in ((high, low), (low, high)):
            cut = end.copy()
            cut[longest] = middle
            half = (at, cut) if end is high else (cut, at)
            heapq.heappush(waiting, (-0.5 * inner, next(count), *half, after))
    return volume


def _may_enter(corners: Floats, normals: Floats, low: Floats, high: Floats) -> Flags:
    """Whether triangles may enter a box: neither an axis nor the normal of the triangle is seen to part them."""
    near = np.all((corners.max(axis=1) > low) & (corners.min(axis=1) < high), axis=1)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    away = np.abs(np.einsum("ij,ij->i", normals, middle - corners[:, 0]))
    longest = np.max(np.abs(corners - middle), axis=(1, 2))
    return np.asarray(near & (away <= np.abs(normals) @ half + _ROUNDING * longest**3))


def _at_least(value: float) -> str:
    """Three digits of a number, none too high but for the surfaces that were moved to touch."""
    digit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return f"{math.floor(value * (1.0 + 1e-6) / digit) * digit:.3g}"
