"""Closed surfaces from the triangles of a mesh, with a sentence for every repair; their moments, and their overlaps.

What is inside a surface is known where its triangles make a cycle: every edge is passed as often one way as the other.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rocking.core.arrays import Flags, Floats, Integers
from rocking.core.tables import counted
from rocking.errors import InvalidBlock

if TYPE_CHECKING:
    from scipy.sparse import csr_array


class Surface(NamedTuple):
    """Corners, m, shape (n, 3), triangles, shape (m, 3), and what was repaired."""

    vertices: Floats
    faces: Integers
    repairs: tuple[str, ...] = ()


def is_closed(faces: Integers) -> bool:
    """Whether every edge is passed as often one way as the other."""
    return not len(_open_edges(faces))


def joined(vertices: Floats, faces: Integers) -> Surface:
    """Join corners at one place; leave out triangles that are none then, or are there already."""
    from scipy.spatial import cKDTree

    low = vertices.min(axis=0)
    size = float(np.max(vertices.max(axis=0) - low))
    if not size > 0.0:
        raise InvalidBlock("all corners of the mesh are at one place")
    places, at, index = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    near = components(len(places), cKDTree(places).query_pairs(1e-8 * size, output_type="ndarray"))
    _, first, of_place = np.unique(near, return_index=True, return_inverse=True)
    first = at[first]
    three = of_place.reshape(-1)[index.reshape(-1)][faces]
    whole = (three[:, 0] != three[:, 1]) & (three[:, 1] != three[:, 2]) & (three[:, 2] != three[:, 0])
    kept = three[whole]
    # Each begins with its least corner, so that those of one orientation are equal.
    turned = np.take_along_axis(kept, (np.argmin(kept, axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    unique = np.sort(np.unique(turned, axis=0, return_index=True)[1])
    repairs = []
    if not whole.all():
        repairs.append(f"{counted(int(np.sum(~whole)), 'face')} without area left out")
    if len(unique) < len(kept):
        repairs.append(f"{counted(len(kept) - len(unique), 'face')} that came twice left out")
    return Surface(vertices[first], kept[unique], tuple(repairs))


def agreeing(surface: Surface) -> Surface:
    """Turn triangles to agree with their neighbours."""
    vertices, faces, repairs = surface
    turned = _against_neighbours(faces)
    if not turned.any():
        return surface
    said = f"{counted(int(turned.sum()), 'face')} turned to agree with the neighbours"
    return Surface(vertices, np.where(turned[:, None], faces[:, ::-1], faces), (*repairs, said))


def closed(surface: Surface) -> Surface:
    """Fill the holes of a surface whose triangles agree, and turn its normals outwards."""
    vertices, faces, filled = _filled(surface.vertices, surface.faces)
    faces, outward = _outward(vertices, faces)
    return Surface(vertices, faces, (*surface.repairs, *filled, *outward))


def _edges(faces: Integers) -> Integers:
    """Edges of every triangle, in its sense: shape (3 m, 2)."""
    return np.asarray(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2))


def _shared(faces: Integers) -> tuple[Integers, Integers, int, Integers]:
    """Edges of triangles, their numbers without a sense and how many these are, and pairs of edges that two share."""
    edges = _edges(faces)
    _, key, counts = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    key = key.reshape(-1)
    order = np.argsort(key, kind="stable")
    return edges, key, len(counts), order[counts[key[order]] == 2].reshape(-1, 2)


def components(count: int, pairs: Integers) -> Integers:
    """Label each of so many things by the connected ones that it is among, from pairs of neighbours."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links: csr_array = coo_array((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), (count, count)).tocsr()
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _against_neighbours(faces: Integers) -> Flags:
    """Which triangles to turn, so that neighbours pass their edge in opposite senses; the fewest of each component.

    Every triangle stands in a graph twice, as it is and turned; neighbours are linked as they agree. Where both of one
    triangle are connected, the surface has one side only.
    """
    edges, _, _, pairs = _shared(faces)
    one, other = pairs.T
    agree = edges[one, 0] != edges[other, 0]
    n = len(faces)
    if agree.all():
        return np.zeros(n, bool)
    left, right = one // 3, other // 3
    crossed = np.where(agree, 0, n)
    links = np.vstack([np.column_stack([left, right + crossed]), np.column_stack([left + n, right + n - crossed])])
    label = components(2 * n, links)
    if np.any(label[:n] == label[n:]):
        raise InvalidBlock("the surface of the mesh has one side only, as a Möbius strip: it encloses nothing")
    patch = components(n, np.column_stack([left, right]))
    root = np.unique(patch, return_index=True)[1][patch]
    turned = label[:n] != label[root]
    share = np.bincount(patch, weights=turned) / np.bincount(patch)
    return np.asarray(np.where(share[patch] > 0.5, ~turned, turned))


def _open_edges(faces: Integers) -> Integers:
    """Edges that are passed one way more often than the other, in the sense that closes them; shape (k, 2)."""
    edges = _edges(faces)
    undirected, key = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    net = np.bincount(key.reshape(-1), weights=np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0)).astype(np.int64)
    closing = np.where(net[:, None] > 0, undirected[:, ::-1], undirected)
    return np.repeat(closing, np.abs(net), axis=0)


def _filled(vertices: Floats, faces: Integers) -> tuple[Floats, Integers, tuple[str, ...]]:
    """Fill every hole with triangles from its edge to the mean of its corners, which is exact where it is flat."""
    edges = _open_edges(faces)
    if not len(edges):
        return vertices, faces, ()
    corners, index = np.unique(edges, return_inverse=True)
    hole = components(len(corners), index.reshape(-1, 2))
    count = int(hole.max()) + 1
    shares = np.bincount(hole)
    middle = np.column_stack([np.bincount(hole, weights=column) for column in vertices[corners].T]) / shares[:, None]
    of_edge = hole[index.reshape(-1, 2)[:, 0]]
    patches = np.column_stack([edges, len(vertices) + of_edge])
    everything = np.vstack([vertices, middle])
    area, before = _areas(everything, patches), float(_areas(vertices, faces).sum())
    # Least-squares planes of the edges: how far these leave them.
    off = (vertices[corners] - middle[hole])[np.argsort(hole, kind="stable")]
    each = np.split(off, np.cumsum(shares)[:-1])
    rough = max(float(np.max(np.abs(rim @ np.linalg.svd(rim, full_matrices=False)[2][-1]))) for rim in each)
    total = float(area.sum())
    said = (
        f"{counted(count, 'hole')} filled, {total:.3g} m^2 or {100.0 * total / (total + before):.2g} % of the surface; "
        f"their edges are flat to {rough:.2g} m"
    )
    return everything, np.vstack([faces, patches]), (said,)


def shells_of(faces: Integers) -> Integers:
    """Label the triangles of each closed surface, from 0 up: pieces that touch at corners or edges are apart."""
    edges, key, count_edges, pairs = _shared(faces)
    patch = components(len(faces), pairs // 3)
    # Patches that are not closed are parts of one surface where they share an edge.
    of_edge = np.repeat(patch, 3)
    each, place = np.unique(of_edge * count_edges + key, return_inverse=True)
    net = np.bincount(place.reshape(-1), weights=np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0))
    links = np.isin(of_edge, each[net != 0.0] // count_edges)
    count = int(patch.max()) + 1
    label = components(count + count_edges, np.column_stack([of_edge, count + key])[links])[patch]
    return np.asarray(np.unique(label, return_inverse=True)[1].reshape(-1), dtype=np.int64)


def _areas(vertices: Floats, faces: Integers) -> Floats:
    one, two, three = (vertices[faces[:, k]] for k in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(two - one, three - one), axis=1))


def _outward(vertices: Floats, faces: Integers) -> tuple[Integers, tuple[str, ...]]:
    """Turn normals outwards; a surface inside another, whose normals point into it, is a cavity."""
    label = shells_of(faces)
    volume = np.bincount(label, weights=signed_volumes(vertices, faces))
    largest = int(np.argmax(np.abs(volume)))
    repairs: list[str] = []
    sign = np.ones(len(volume))
    if volume[largest] < 0.0:
        repairs.append("normals pointed inwards: the surface was turned inside out")
        sign[:] = -1.0
    cavities, apart = [], 0
    outer = np.flatnonzero(sign * volume > 0.0)
    for k in np.flatnonzero(sign * volume < 0.0):
        around = outer[np.abs(volume[outer]) > abs(volume[k])]
        if any(surrounds(vertices, faces[label == n], vertices, faces[label == k]) for n in around):
            cavities.append(abs(float(volume[k])))
        else:
            sign[k] *= -1.0
            apart += 1
    if cavities:
        said = "1 cavity" if len(cavities) == 1 else f"{len(cavities)} cavities"
        repairs.append(f"{said} of {sum(cavities):.3g} m^3 taken as hollow")
    if apart:
        repairs.append(f"{counted(apart, 'separate surface')} turned inside out")
    return np.where(sign[label][:, None] < 0.0, faces[:, ::-1], faces), tuple(repairs)


def surrounds(vertices: Floats, faces: Integers, other: Floats, others: Integers) -> bool:
    """Whether a surface goes round another one, as that of its corners and triangles says which is least doubtful."""
    some = others[np.linspace(0, len(others) - 1, 12).astype(np.int64)]
    places = np.vstack([other[some[:, 0]], other[some].mean(axis=1)])
    around = [abs(winding(vertices, faces, place)) for place in np.unique(places, axis=0)]
    return max(around, key=lambda times: abs(times - 0.5)) > 0.5


def winding(vertices: Floats, faces: Integers, place: Floats) -> float:
    """Return how often a surface goes round a place: solid angles over 4 pi (Van Oosterom and Strackee 1983)."""
    a, b, c = (vertices[faces[:, k]] - place for k in range(3))
    la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
    above = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = la * lb * lc + np.sum(a * b, axis=1) * lc + np.sum(b * c, axis=1) * la + np.sum(c * a, axis=1) * lb
    halves = np.arctan2(above, below)
    # In a triangle itself the sign of its solid angle is that of rounding; halfway from one side to the other it is 0.
    halves[(below < 0.0) & (np.abs(above) <= 1e-12 * la * lb * lc)] = 0.0
    return float(np.sum(halves) / (2.0 * np.pi))


class Moments(NamedTuple):
    """Volume (or mass), centre, shape (3,), and the integral of x x^T about the centre, shape (3, 3)."""

    amount: float
    centre: Floats
    second: Floats

    def inertia_over_amount(self) -> Floats:
        """Return the tensor of inertia about the centre over the amount, m^2: of x x^T its trace less itself."""
        mean = self.second / self.amount
        return np.asarray(np.trace(mean) * np.eye(3) - mean)


def signed_volumes(vertices: Floats, faces: Integers) -> Floats:
    """Volumes between each triangle and the middle of all corners, positive where its normal points away from it."""
    one, two, three = (vertices[faces[:, k]] - _middle(vertices) for k in range(3))
    return np.asarray(np.einsum("ij,ij->i", one, np.cross(two, three)) / 6.0)


def moments(vertices: Floats, faces: Integers) -> Moments:
    """Return the moments of what a closed surface encloses, exact but for rounding.

    Every triangle and one place span a tetrahedron of signed volume V. With s the sum of its corners a, b, c from that
    place, its first moment is V s/4, its second V (s s^T + a a^T + b b^T + c c^T)/20.
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
    """Return the moments of several parts, each with its density."""
    masses = np.array([part.amount * density for part, density in zip(parts, densities, strict=True)])
    total = float(masses.sum())
    centre = masses @ np.array([part.centre for part in parts]) / total
    second = np.zeros((3, 3))
    for part, density, mass in zip(parts, densities, masses, strict=True):
        off = part.centre - centre
        second += density * part.second + mass * np.outer(off, off)
    return Moments(total, centre, second)


def _middle(vertices: Floats) -> Floats:
    """Place in the middle of all corners: differences from it keep their digits."""
    return np.asarray(0.5 * (vertices.min(axis=0) + vertices.max(axis=0)))


def overlaps(names: Sequence[str], surfaces: Sequence[Surface]) -> tuple[str, ...]:
    """Return a sentence on the pieces of a mesh that overlap, by sampling where the boxes around them do."""
    pieces = [piece for name, surface in zip(names, surfaces, strict=True) for piece in _pieces(name, surface)]
    used = [each.vertices[np.unique(each.faces)] for each in pieces]
    ends = [(corners.min(axis=0), corners.max(axis=0)) for corners in used]
    size = max(float(np.max(high - low)) for low, high in ends)
    boxes = []
    for (one, first), (other, second) in itertools.combinations(zip(pieces, ends, strict=True), 2):
        low, high = np.maximum(first[0], second[0]), np.minimum(first[1], second[1])
        if np.all(high - low > 2e-9 * size):
            boxes.append((float(np.prod(high - low)), one, other, low, high))
    found = []
    for volume, one, other, low, high in sorted(boxes, key=lambda box: -box[0])[:50]:
        count = min(max(20_000_000 // (len(boxes) * (len(one.faces) + len(other.faces))), 30), 1000)
        # An additive recurrence fills the box evenly, with no place on a face of a common shape.
        shares = (0.5 + np.arange(count)[:, None] * 1.2207440846057596 ** -np.arange(1.0, 4.0)) % 1.0
        within = sum(
            all(winding(each.vertices, each.faces, place) > 0.75 for each in (one, other))
            for place in low + shares * (high - low)
        )
        if volume * within / count > 1e-4 * min(one.volume, other.volume):
            found.append((volume * within / count, one.part, other.part))
    if not found:
        return ()
    found.sort(key=lambda pair: -pair[0])
    said = [
        f"{f'{one} and {other}' if one != other else f'two pieces of {one}'} overlap in about {common:.2g} m^3"
        for common, one, other in found[:3]
    ]
    more = f", and so do {len(found) - 3} more pairs" if len(found) > 3 else ""
    return (
        f"{', '.join(said)}{more}, which is counted twice: make one surface of the two, cut one out of the other, or, "
        "if one is a cavity, turn its normals inwards",
    )


class _Piece(NamedTuple):
    """A closed surface with its cavities: the part that it is of, its corners, triangles and volume."""

    part: str
    vertices: Floats
    faces: Integers
    volume: float


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
