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
from rocking.core.tables import format_count
from rocking.errors import BlockError

if TYPE_CHECKING:
    from scipy.sparse import csr_array


class Surface(NamedTuple):
    """Surface of triangles."""

    vertices: Floats  # corners, m, shape (n, 3)
    faces: Integers  # indices of the corners of each triangle, shape (m, 3)
    repairs: tuple[str, ...] = ()  # descriptions of repairs


def is_closed(faces: Integers) -> bool:
    """Return whether every edge is traversed equally often in both directions."""
    return not len(_find_open_edges(faces))


def merge_corners(name: str, vertices: Floats, faces: Integers) -> Surface:
    """Merge coincident corners; remove degenerate and duplicate triangles."""
    low = vertices.min(axis=0)
    size = float(np.max(vertices.max(axis=0) - low))
    if not size > 0.0:
        raise BlockError("all corners of the mesh coincide")
    grid_points = np.rint((vertices - low) / (1e-8 * size))
    _, first, merged_index = np.unique(grid_points, axis=0, return_index=True, return_inverse=True)
    merged = merged_index.reshape(-1)[faces]
    valid = merged[(merged[:, 0] != merged[:, 1]) & (merged[:, 1] != merged[:, 2]) & (merged[:, 2] != merged[:, 0])]
    # Starting with the smallest index, triangles of one orientation are equal.
    rotated = np.take_along_axis(valid, (np.argmin(valid, axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    valid = valid[np.sort(np.unique(rotated, axis=0, return_index=True)[1])]
    edges, _, _, pairs = _index_edges(valid)
    if np.any(edges[pairs[:, 0], 0] == edges[pairs[:, 1], 0]):
        message = "normals of neighbouring triangles point to different sides of the surface: orient them alike, as "
        raise BlockError(f"{message}MeshLab does by re-orienting all faces coherently", path=name)
    removed_count = len(faces) - len(valid)
    repair = f"{format_count(removed_count, 'face')} without area, or there twice, left out"
    return Surface(vertices[first], valid, (repair,) if removed_count else ())


def combine_surfaces(surfaces: Sequence[Surface]) -> Surface:
    """Combine several surfaces."""
    starts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
    faces = np.vstack([surface.faces + start for surface, start in zip(surfaces, starts[:-1], strict=True)])
    repairs = tuple(sentence for surface in surfaces for sentence in surface.repairs)
    return Surface(np.vstack([surface.vertices for surface in surfaces]), faces, repairs)


def orient_surfaces(surfaces: Sequence[Surface], is_hollow: Sequence[bool]) -> list[Surface]:
    """Turn the normals of closed surfaces outwards, except for cavities: pieces in a larger one with normals into it.

    A cavity belongs to the surface around it, but to another one only if ``is_hollow``. Surfaces may become
    empty.
    """
    labels = [label_shells(surface.faces) for surface in surfaces]
    surface_of, shells = _split_pieces(surfaces, labels)
    volumes = np.array([float(compute_signed_volumes(*piece[:2]).sum()) for piece in shells])
    sizes, owner = np.abs(volumes), surface_of.copy()
    is_cavity = np.zeros(len(shells), bool)
    for n in np.argsort(-sizes, kind="stable"):  # larger pieces first, because they may be cavities
        may_contain = (surface_of == surface_of[n]) | is_hollow[surface_of[n]]
        may_enclose = (volumes * volumes[n] < 0.0) & (sizes > sizes[n]) & ~is_cavity & may_contain
        if enclosing := [m for m in np.flatnonzero(may_enclose) if surrounds(*shells[m][:2], *shells[n][:2])]:
            is_cavity[n], owner[n] = True, surface_of[min(enclosing, key=lambda m: sizes[m])]
    is_flipped = np.where(is_cavity, volumes > 0.0, volumes < 0.0)
    results = []
    for k, (vertices, faces, repairs) in enumerate(surfaces):
        is_own, label = surface_of == k, labels[k]
        faces = np.where(is_flipped[is_own][label][:, None], faces[:, ::-1], faces)[owner[is_own][label] == k]
        cavities = np.flatnonzero(is_cavity & (owner == k) & ~is_own)
        inner = [Surface(shells[n].vertices, shells[n].faces[:, :: -1 if is_flipped[n] else 1]) for n in cavities]
        new_repairs = _describe_repairs(sizes[is_cavity & (owner == k)], is_flipped[is_own & ~is_cavity])
        results.append(combine_surfaces([Surface(vertices, faces, (*repairs, *new_repairs)), *inner]))
    return results


def _split_pieces(surfaces: Sequence[Surface], labels: Sequence[Integers]) -> tuple[Integers, list[Surface]]:
    """Return the index of the surface of each closed piece, and the pieces, from labels of triangles."""
    surface_and_label = [(k, n) for k, label in enumerate(labels) for n in range(int(label.max(initial=-1)) + 1)]
    pieces = [Surface(surfaces[k].vertices, surfaces[k].faces[labels[k] == n]) for k, n in surface_and_label]
    return np.array([k for k, _ in surface_and_label]), pieces


def _describe_repairs(cavities: Floats, is_flipped: Flags) -> Iterator[str]:
    """Yield descriptions of cavities, with volumes in m^3, and of other turned pieces."""
    if is_flipped.all() and len(is_flipped):
        yield "normals pointed inwards: the surface was turned inside out"
    if len(cavities):
        yield f"{format_count(len(cavities), 'cavity')} of {cavities.sum():.3g} m^3 taken as hollow"
    if is_flipped.any() and not is_flipped.all():
        yield f"{format_count(int(is_flipped.sum()), 'separate surface')} turned inside out"


def _list_edges(faces: Integers) -> Integers:
    """Return the directed edges of every triangle, shape (3 m, 2)."""
    return np.asarray(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2))


def _index_edges(faces: Integers) -> tuple[Integers, Integers, int, Integers]:
    """Return directed edges, undirected indices of edges and their number, and pairs shared by two triangles."""
    edges = _list_edges(faces)
    _, edge_index, counts = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    edge_index = edge_index.reshape(-1)
    order = np.argsort(edge_index, kind="stable")
    return edges, edge_index, len(counts), order[counts[edge_index[order]] == 2].reshape(-1, 2)


def label_components(count: int, pairs: Integers) -> Integers:
    """Label ``count`` items by connected component, from pairs of neighbours."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links: csr_array = coo_array((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), (count, count)).tocsr()
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _find_open_edges(faces: Integers) -> Integers:
    """Return the edges with unbalanced directions, in the direction that closes them, shape (k, 2)."""
    edges = _list_edges(faces)
    undirected, edge_index = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    net = np.bincount(edge_index.reshape(-1), weights=np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0)).astype(np.int64)
    closing = np.where(net[:, None] > 0, undirected[:, ::-1], undirected)
    return np.repeat(closing, np.abs(net).astype(np.intp), axis=0)


def fill_holes(surface: Surface) -> Surface:
    """Fill every hole with triangles from its edge to the mean of its corners, which is exact for flat holes."""
    vertices, faces, repairs = surface
    edges = _find_open_edges(faces)
    if not len(edges):
        return surface
    corners, index = np.unique(edges, return_inverse=True)
    hole = label_components(len(corners), index.reshape(-1, 2))
    count = int(hole.max()) + 1
    sums = np.column_stack([np.bincount(hole, weights=column) for column in vertices[corners].T])
    all_vertices = np.vstack([vertices, sums / np.bincount(hole)[:, None]])
    patches = np.column_stack([edges, len(vertices) + hole[index.reshape(-1, 2)[:, 0]]])
    area, old_area = _compute_area(all_vertices, patches), _compute_area(vertices, faces)
    share = 100.0 * area / (area + old_area)
    repair = f"{format_count(count, 'hole')} filled, {area:.3g} m^2 or {share:.2g} % of the surface"
    return Surface(all_vertices, np.vstack([faces, patches]), (*repairs, repair))


def label_shells(faces: Integers) -> Integers:
    """Label the triangles of each closed surface, from 0. Pieces that touch at corners or edges are separate."""
    edges, edge_index, edge_count, pairs = _index_edges(faces)
    patch = label_components(len(faces), pairs // 3)
    # Open patches belong to one surface if they share an edge.
    patch_of_edge = np.repeat(patch, 3)
    combinations, combination = np.unique(patch_of_edge * edge_count + edge_index, return_inverse=True)
    net = np.bincount(combination.reshape(-1), weights=np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0))
    links = np.isin(patch_of_edge, combinations[net != 0.0] // edge_count)
    count = int(patch.max()) + 1
    label = label_components(count + edge_count, np.column_stack([patch_of_edge, count + edge_index])[links])[patch]
    return np.asarray(np.unique(label, return_inverse=True)[1].reshape(-1), dtype=np.int64)


def _compute_area(vertices: Floats, faces: Integers) -> float:
    first, second, third = (vertices[faces[:, k]] for k in range(3))
    return float(0.5 * np.linalg.norm(np.cross(second - first, third - first), axis=1).sum())


def surrounds(vertices: Floats, faces: Integers, inner_vertices: Floats, inner_faces: Integers) -> bool:
    """Return whether a surface surrounds another one, from the sample with the clearest winding number."""
    samples = inner_faces[np.linspace(0, len(inner_faces) - 1, 12).astype(np.int64)]
    points = np.vstack([inner_vertices[samples[:, 0]], inner_vertices[samples].mean(axis=1)])
    winding_numbers = [abs(compute_winding_number(vertices, faces, point)) for point in np.unique(points, axis=0)]
    return max(winding_numbers, key=lambda number: abs(number - 0.5)) > 0.5


def compute_winding_number(vertices: Floats, faces: Integers, point: Floats) -> float:
    """Return the winding number of a surface around a point from solid angles (Van Oosterom and Strackee 1983)."""
    a, b, c = (vertices[faces[:, k]] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(vector, axis=1) for vector in (a, b, c))
    numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
    denominator = la * lb * lc + np.sum(a * b, axis=1) * lc + np.sum(b * c, axis=1) * la + np.sum(c * a, axis=1) * lb
    half_angles = np.arctan2(numerator, denominator)
    # For a point in a triangle, rounding determines the sign of the solid angle. The mean of both sides is 0.
    half_angles[(denominator < 0.0) & (np.abs(numerator) <= 1e-12 * la * lb * lc)] = 0.0
    return float(np.sum(half_angles) / (2.0 * np.pi))


class Moments(NamedTuple):
    """Moments of a body."""

    amount: float  # volume or mass
    centre: Floats  # centre, shape (3,)
    second_moment: Floats  # integral of x x^T about the centre, shape (3, 3)

    def compute_inertia(self) -> Floats:
        """Return the tensor of inertia about the centre divided by the amount, m^2: the trace of x x^T minus x x^T."""
        mean = self.second_moment / self.amount
        return np.asarray(np.trace(mean) * np.eye(3) - mean)


def compute_signed_volumes(vertices: Floats, faces: Integers) -> Floats:
    """Return the volume between each triangle and the middle, positive if its normal points outwards."""
    first, second, third = (vertices[faces[:, k]] - _compute_middle(vertices) for k in range(3))
    return np.asarray(np.einsum("ij,ij->i", first, np.cross(second, third)) / 6.0)


def compute_moments(vertices: Floats, faces: Integers) -> Moments:
    """Compute the moments of the interior of a closed surface, exact except for rounding.

    Every triangle and a common point span a tetrahedron of signed volume V. With the sum s of its corners a, b, c
    relative to this point, its first moment is V s/4, its second V (s s^T + a a^T + b b^T + c c^T)/20.
    """
    reference = _compute_middle(vertices)
    corners = vertices[faces] - reference
    volumes = compute_signed_volumes(vertices, faces)
    amount = float(volumes.sum())
    sums = corners.sum(axis=1)
    first = volumes @ sums / 4.0
    second = np.einsum("i,ij,ik->jk", volumes, sums, sums) + np.einsum("i,inj,ink->jk", volumes, corners, corners)
    offset = first / amount if amount else np.zeros(3)
    return Moments(amount, reference + offset, second / 20.0 - amount * np.outer(offset, offset))


def combine_moments(parts: Sequence[Moments], densities: Sequence[float]) -> Moments:
    """Combine the moments of parts with their densities."""
    masses = np.array([part.amount * density for part, density in zip(parts, densities, strict=True)])
    total = float(masses.sum())
    centre = masses @ np.array([part.centre for part in parts]) / total
    second = np.zeros((3, 3))
    for part, density, mass in zip(parts, densities, masses, strict=True):
        offset = part.centre - centre
        second += density * part.second_moment + mass * np.outer(offset, offset)
    return Moments(total, centre, second)


def _compute_middle(vertices: Floats) -> Floats:
    """Return the middle of all corners, a reference point that avoids cancellation."""
    return np.asarray(0.5 * (vertices.min(axis=0) + vertices.max(axis=0)))


def describe_overlaps(names: Sequence[str], surfaces: Sequence[Surface]) -> tuple[str, ...]:
    """Return a note on the common volumes of pieces of a mesh, by sampling overlaps of their bounding boxes."""
    surface_of, shells = _split_pieces(surfaces, [label_shells(surface.faces) for surface in surfaces])
    corners = [shell.vertices[shell.faces] for shell in shells]
    lows, highs = (np.array([bound(points, axis=(0, 1)) for points in corners]) for bound in (np.min, np.max))
    volumes = np.array([float(compute_signed_volumes(*shell[:2]).sum()) for shell in shells])
    size, boxes = float(np.max(highs - lows)), []
    for pair in itertools.combinations(np.flatnonzero(volumes > 0.0).tolist(), 2):
        low, high = lows[[*pair]].max(axis=0), highs[[*pair]].min(axis=0)
        if np.all(high - low > 2e-9 * size):
            boxes.append((float(np.prod(high - low)), pair, low, high))
    overlaps = []
    for volume, pair, low, high in sorted(boxes, key=lambda box: -box[0])[:50]:
        inside = [np.all((lows >= lows[k]) & (highs <= highs[k]), axis=1) & (surface_of == surface_of[k]) for k in pair]
        involved = [shells[k] for k in (*pair, *np.flatnonzero(np.any(inside, axis=0) & (volumes < 0.0)))]
        count = min(max(20_000_000 // (len(boxes) * sum(len(shell.faces) for shell in involved)), 30), 1000)
        # An additive recurrence fills the box evenly, and avoids the faces of common shapes.
        fractions = (0.5 + np.arange(count)[:, None] * 1.2207440846057596 ** -np.arange(1.0, 4.0)) % 1.0
        points = low + fractions * (high - low)
        winding_numbers = [
            sum(compute_winding_number(shell.vertices, shell.faces, point) for shell in involved) for point in points
        ]
        common = volume * float(np.mean(np.array(winding_numbers) > 1.5))
        if common > 1e-4 * min(volumes[k] for k in pair):
            overlaps.append((common, *(names[surface_of[k]] for k in pair)))
    if not overlaps:
        return ()
    common, first, second = max(overlaps)
    pair_text = f"{first} and {second}" if first != second else f"two pieces of {first}"
    more = f" (the largest of {len(overlaps)} overlaps)" if len(overlaps) > 1 else ""
    remedy = "make one surface of the two, cut one out of the other, or, if one is a cavity, turn its normals inwards"
    return (f"{pair_text} overlap in about {common:.2g} m^3{more}, which is counted twice: {remedy}",)
