"""Volume, centre and second moments of what a closed surface of triangles encloses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rocking.arrays import Floats, Integers


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
