"""Closed surfaces from the triangles of a mesh, with repairs, moments and overlaps.

The inside of a surface is defined if its triangles form a cycle: every edge is traversed equally often in both
directions.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.tables import counted
from rocking.errors import InvalidBlock

if TYPE_CHECKING:
    from scipy.sparse import csr_array


class Surface(NamedTuple):
    """Corners, m, shape (n, 3), triangles, shape (m, 3), and descriptions of repairs."""

    vertices: Floats
    faces: Integers
    repairs: tuple[str, ...] = ()


def is_closed(faces: Integers) -> bool:
    """Return whether every edge is traversed equally often in both directions."""
    return not len(_open_edges(faces))


def joined(name: str, vertices: Floats, faces: Integers) -> Surface:
    """Merge coincident corners; remove degenerate and duplicate triangles."""
    low = vertices.min(axis=0)
    size = float(np.max(vertices.max(axis=0) - low))
    if not size > 0.0:
        raise InvalidBlock("all corners of the mesh are at one place")
    places = np.rint((vertices - low) / (1e-8 * size))
    _, first, of_place = np.unique(places, axis=0, return_index=True, return_inverse=True)
    three = of_place.reshape(-1)[faces]
    kept = three[(three[:, 0] != three[:, 1]) & (three[:, 1] != three[:, 2]) & (three[:, 2] != three[:, 0])]
    # Starting with the smallest index, triangles of one orientation are equal.
    turned = np.take_along_axis(kept, (np.argmin(kept, axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    kept = kept[np.sort(np.unique(turned, axis=0, return_index=True)[1])]
    edges, _, _, pairs = _shared(kept)
    if np.any(edges[pairs[:, 0], 0] == edges[pairs[:, 1], 0]):
        raise InvalidBlock(
            "normals of neighbouring triangles point to different sides of the surface: orient them alike, as MeshLab "
            "does by re-orienting all faces coherently",
            path=name,
        )
    left_out = len(faces) - len(kept)
    said = (f"{counted(left_out, 'face')} without area, or there twice, left out",) if left_out else ()
    return Surface(vertices[first], kept, said)


def one_of(surfaces: Sequence[Surface]) -> Surface:
    """Combine several surfaces."""
    starts = np.cumsum([0, *(len(each.vertices) for each in surfaces)])
    faces = np.vstack([each.faces + start for each, start in zip(surfaces, starts[:-1], strict=True)])
    repairs = tuple(sentence for each in surfaces for sentence in each.repairs)
    return Surface(np.vstack([each.vertices for each in surfaces]), faces, repairs)


def oriented(surfaces: Sequence[Surface], hollow: Sequence[bool]) -> list[Surface]:
    """Turn the normals of closed surfaces outwards, except for cavities: pieces in a larger one with normals into it.

    A cavity belongs to the surface around it, but to another one only if ``hollow`` is true. Surfaces may become
    empty.
    """
    labels = [shells_of(each.faces) for each in surfaces]
    of, shells = _pieces(surfaces, labels)
    volumes = np.array([float(signed_volumes(*each[:2]).sum()) for each in shells])
    sizes, owner = np.abs(volumes), of.copy()
    is_cavity = np.zeros(len(shells), bool)
    for n in np.argsort(-sizes, kind="stable"):  # so that it is known of all larger ones whether they are cavities
        may = (volumes * volumes[n] < 0.0) & (sizes > sizes[n]) & ~is_cavity & ((of == of[n]) | hollow[of[n]])
        if around := [m for m in np.flatnonzero(may) if surrounds(*shells[m][:2], *shells[n][:2])]:
            is_cavity[n], owner[n] = True, of[min(around, key=lambda m: sizes[m])]
    flipped = np.where(is_cavity, volumes > 0.0, volumes < 0.0)
    found = []
    for k, (vertices, faces, repairs) in enumerate(surfaces):
        own, label = of == k, labels[k]
        faces = np.where(flipped[own][label][:, None], faces[:, ::-1], faces)[owner[own][label] == k]
        cavities = np.flatnonzero(is_cavity & (owner == k) & ~own)
        turned = [Surface(shells[n].vertices, shells[n].faces[:, :: -1 if flipped[n] else 1]) for n in cavities]
        said = _said(sizes[is_cavity & (owner == k)], flipped[own & ~is_cavity])
        found.append(one_of([Surface(vertices, faces, (*repairs, *said)), *turned]))
    return found


def _pieces(surfaces: Sequence[Surface], labels: Sequence[Integers]) -> tuple[Integers, list[Surface]]:
    """Return the index of the surface of each closed piece, and the pieces, from labels of triangles."""
    of = [(k, n) for k, label in enumerate(labels) for n in range(int(label.max(initial=-1)) + 1)]
    pieces = [Surface(surfaces[k].vertices, surfaces[k].faces[labels[k] == n]) for k, n in of]
    return np.array([k for k, _ in of]), pieces


def _said(cavities: Floats, flipped: Flags) -> Iterator[str]:
    """Describe cavities, with volumes in m^3, and other turned pieces."""
    if flipped.all() and len(flipped):
        yield "normals pointed inwards: the surface was turned inside out"
    if len(cavities):
        said = "1 cavity" if len(cavities) == 1 else f"{len(cavities)} cavities"
        yield f"{said} of {cavities.sum():.3g} m^3 taken as hollow"
    if flipped.any() and not flipped.all():
        yield f"{counted(int(flipped.sum()), 'separate surface')} turned inside out"


def _edges(faces: Integers) -> Integers:
    """Return the directed edges of every triangle, shape (3 m, 2)."""
    return np.asarray(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2))


def _shared(faces: Integers) -> tuple[Integers, Integers, int, Integers]:
    """Return directed edges, undirected indices of edges and their number, and pairs shared by two triangles."""
    edges = _edges(faces)
    _, key, counts = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    key = key.reshape(-1)
    order = np.argsort(key, kind="stable")
    return edges, key, len(counts), order[counts[key[order]] == 2].reshape(-1, 2)


def components(count: int, pairs: Integers) -> Integers:
    """Label ``count`` items by connected component, from pairs of neighbours."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links: csr_array = coo_array((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), (count, count)).tocsr()
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _open_edges(faces: Integers) -> Integers:
    """Return the edges with unbalanced directions, in the direction that closes them, shape (k, 2)."""
    edges = _edges(faces)
    undirected, key = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    net = np.bincount(key.reshape(-1), weights=np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0)).astype(np.int64)
    closing = np.where(net[:, None] > 0, undirected[:, ::-1], undirected)
    return np.repeat(closing, np.abs(net), axis=0)


def filled(surface: Surface) -> Surface:
    """Fill every hole with triangles from its edge to the mean of its corners, which is exact for flat holes."""
    vertices, faces, repairs = surface
    edges = _open_edges(faces)
    if not len(edges):
        return surface
    corners, index = np.unique(edges, return_inverse=True)
    hole = components(len(corners), index.reshape(-1, 2))
    count = int(hole.max()) + 1
    middle = np.column_stack([np.bincount(hole, weights=column) for column in vertices[corners].T])
    everything = np.vstack([vertices, middle / np.bincount(hole)[:, None]])
    patches = np.column_stack([edges, len(vertices) + hole[index.reshape(-1, 2)[:, 0]]])
    area, before = _area(everything, patches), _area(vertices, faces)
    share = 100.0 * area / (area + before)
    said = f"{counted(count, 'hole')} filled, {area:.3g} m^2 or {share:.2g} % of the surface"
    return Surface(everything, np.vstack([faces, patches]), (*repairs, said))


def shells_of(faces: Integers) -> Integers:
    """Label the triangles of each closed surface, from 0. Pieces that touch at corners or edges are separate."""
    edges, key, count_edges, pairs = _shared(faces)
    patch = components(len(faces), pairs // 3)
    # Open patches belong to one surface if they share an edge.
    of_edge = np.repeat(patch, 3)
    each, place = np.unique(of_edge * count_edges + key, return_inverse=True)
    net = np.bincount(place.reshape(-1), weights=np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0))
    links = np.isin(of_edge, each[net != 0.0] // count_edges)
    count = int(patch.max()) + 1
    label = components(count + count_edges, np.column_stack([of_edge, count + key])[links])[patch]
    return np.asarray(np.unique(label, return_inverse=True)[1].reshape(-1), dtype=np.int64)


def _area(vertices: Floats, faces: Integers) -> float:
    one, two, three = (vertices[faces[:, k]] for k in range(3))
    return float(0.5 * np.linalg.norm(np.cross(two - one, three - one), axis=1).sum())


def surrounds(vertices: Floats, faces: Integers, other: Floats, others: Integers) -> bool:
    """Return whether a surface surrounds another one, from the sample with the clearest winding number."""
    some = others[np.linspace(0, len(others) - 1, 12).astype(np.int64)]
    places = np.vstack([other[some[:, 0]], other[some].mean(axis=1)])
    around = [abs(winding(vertices, faces, place)) for place in np.unique(places, axis=0)]
    return max(around, key=lambda times: abs(times - 0.5)) > 0.5


def winding(vertices: Floats, faces: Integers, place: Floats) -> float:
    """Return the winding number of a surface around a point from solid angles (Van Oosterom and Strackee 1983)."""
    a, b, c = (vertices[faces[:, k]] - place for k in range(3))
    la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
    above = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = la * lb * lc + np.sum(a * b, axis=1) * lc + np.sum(b * c, axis=1) * la + np.sum(c * a, axis=1) * lb
    halves = np.arctan2(above, below)
    # For a point in a triangle, rounding determines the sign of the solid angle. The mean of both sides is 0.
    halves[(below < 0.0) & (np.abs(above) <= 1e-12 * la * lb * lc)] = 0.0
    return float(np.sum(halves) / (2.0 * np.pi))


class Moments(NamedTuple):
    """Volume (or mass), centre, shape (3,), and the integral of x x^T about the centre, shape (3, 3)."""

    amount: float
    centre: Floats
    second: Floats

    def inertia_over_amount(self) -> Floats:
        """Return the tensor of inertia about the centre divided by the amount, m^2: the trace of x x^T minus x x^T."""
        mean = self.second / self.amount
        return np.asarray(np.trace(mean) * np.eye(3) - mean)


def signed_volumes(vertices: Floats, faces: Integers) -> Floats:
    """Return the volume between each triangle and the middle, positive if its normal points outwards."""
    one, two, three = (vertices[faces[:, k]] - _middle(vertices) for k in range(3))
    return np.asarray(np.einsum("ij,ij->i", one, np.cross(two, three)) / 6.0)


def moments(vertices: Floats, faces: Integers) -> Moments:
    """Compute the moments of the interior of a closed surface, exact except for rounding.

    Every triangle and a common point span a tetrahedron of signed volume V. With the sum s of its corners a, b, c
    relative to this point, its first moment is V s/4, its second V (s s^T + a a^T + b b^T + c c^T)/20.
    """
    middle = _middle(vertices)
    corners = vertices[faces] - middle
    volumes = signed_volumes(vertices, faces)
    amount = float(volumes.sum())
    sums = corners.sum(axis=1)
    first = volumes @ sums / 4.0
    second = np.einsum("i,ij,ik->jk", volumes, sums, sums) + np.einsum("i,inj,ink->jk", volumes, corners, corners)
    off = first / amount if amount else np.zeros(3)
    return Moments(amount, middle + off, second / 20.0 - amount * np.outer(off, off))


def together(parts: Sequence[Moments], densities: Sequence[float]) -> Moments:
    """Combine the moments of parts with their densities."""
    masses = np.array([part.amount * density for part, density in zip(parts, densities, strict=True)])
    total = float(masses.sum())
    centre = masses @ np.array([part.centre for part in parts]) / total
    second = np.zeros((3, 3))
    for part, density, mass in zip(parts, densities, masses, strict=True):
        off = part.centre - centre
        second += density * part.second + mass * np.outer(off, off)
    return Moments(total, centre, second)


def _middle(vertices: Floats) -> Floats:
    """Return the middle of all corners, a reference point that avoids cancellation."""
    return np.asarray(0.5 * (vertices.min(axis=0) + vertices.max(axis=0)))


def overlaps(names: Sequence[str], surfaces: Sequence[Surface]) -> tuple[str, ...]:
    """Return a note on the common volumes of pieces of a mesh, by sampling overlaps of their bounding boxes."""
    of, shells = _pieces(surfaces, [shells_of(each.faces) for each in surfaces])
    corners = [each.vertices[each.faces] for each in shells]
    lows, highs = (np.array([end(each, axis=(0, 1)) for each in corners]) for end in (np.min, np.max))
    volumes = np.array([float(signed_volumes(*each[:2]).sum()) for each in shells])
    size, boxes = float(np.max(highs - lows)), []
    for pair in itertools.combinations(np.flatnonzero(volumes > 0.0).tolist(), 2):
        low, high = lows[[*pair]].max(axis=0), highs[[*pair]].min(axis=0)
        if np.all(high - low > 2e-9 * size):
            boxes.append((float(np.prod(high - low)), pair, low, high))
    found = []
    for volume, pair, low, high in sorted(boxes, key=lambda box: -box[0])[:50]:
        within = [np.all((lows >= lows[k]) & (highs <= highs[k]), axis=1) & (of == of[k]) for k in pair]
        some = [shells[k] for k in (*pair, *np.flatnonzero(np.any(within, axis=0) & (volumes < 0.0)))]
        count = min(max(20_000_000 // (len(boxes) * sum(len(each.faces) for each in some)), 30), 1000)
        # An additive recurrence fills the box evenly, and avoids the faces of common shapes.
        shares = (0.5 + np.arange(count)[:, None] * 1.2207440846057596 ** -np.arange(1.0, 4.0)) % 1.0
        places = low + shares * (high - low)
        times = np.array([sum(winding(each.vertices, each.faces, place) for each in some) for place in places])
        common = volume * float(np.mean(times > 1.5))
        if common > 1e-4 * min(volumes[k] for k in pair):
            found.append((common, *(names[of[k]] for k in pair)))
    if not found:
        return ()
    found.sort(key=lambda pair: -pair[0])
    said = [
        f"{f'{one} and {other}' if one != other else f'two pieces of {one}'} overlap in about {common:.2g} m^3"
        for common, one, other in found[:3]
    ]
    more = f", and {counted(len(found) - 3, 'more pair')}" if len(found) > 3 else ""
    return (
        f"{', '.join(said)}{more}, which is counted twice: make one surface of the two, cut one out of the other, or, "
        "if one is a cavity, turn its normals inwards",
    )
