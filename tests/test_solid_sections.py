"""The outline of a body from its sections: against the projection of its triangles, and of shapes known beforehand."""

import math

import numpy as np
import pytest
import trimesh

from rocking.solid.mesh import compute_properties
from rocking.solid.support import compute_sections


def surfaces_of(mesh):
    return compute_properties(mesh, None, None, None, up=None, unit="m", turn=0.0)[1]


def box(sizes, at):
    made = trimesh.creation.box(sizes)
    made.apply_translation(at)
    return made


def covered(trapezoids, height, place):
    """Whether an outline covers places at heights."""
    low, high, left, right, left_up, right_up = (column[:, None] for column in trapezoids.T)
    part = (height - low) / (high - low)
    inside = (part >= 0.0) & (part <= 1.0)
    ends = [one + part * (other - one) for one, other in ((left, left_up), (right, right_up))]
    return np.any(inside & (place >= ends[0]) & (place <= ends[1]), axis=0)


@pytest.mark.parametrize("azimuth", [247.5, *(pytest.param(a, marks=pytest.mark.thorough) for a in (0.0, 30.0, 90.0))])
def test_the_outline_is_where_triangles_are_seen(azimuth):
    surfaces = surfaces_of("statue")
    outline = compute_sections(surfaces).compute_outline(azimuth)
    towards = np.array([math.sin(math.radians(azimuth)), math.cos(math.radians(azimuth))])
    random = np.random.default_rng(7)
    height = random.uniform(0.0, 1.7295, 4000)
    place = random.uniform(-0.4, 0.4, 4000)
    # Every ray through a closed body enters it by some triangle: places in the projection of one are in the outline.
    seen = np.zeros(4000, bool)
    for surface in surfaces:
        corners = surface.vertices[surface.faces]
        flat = np.stack([corners[..., :2] @ towards, corners[..., 2]], axis=-1)
        flat = flat[np.abs(np.linalg.det(flat[:, 1:] - flat[:, :1])) > 1e-12]
        for a, b, c in flat:
            turns = [
                (q[0] - p[0]) * (height - p[1]) - (q[1] - p[1]) * (place - p[0]) for p, q in ((a, b), (b, c), (c, a))
            ]
            seen |= np.all(np.array(turns) >= 0.0, axis=0) | np.all(np.array(turns) <= 0.0, axis=0)
    assert 800 < seen.sum() < 3200
    wrong = covered(outline, height, place) != seen
    assert wrong.mean() < 0.002


def test_the_outline_spans_what_is_open_between_legs():
    legs = [box((0.1, 0.1, 0.5), (x, 0.0, 0.25)) for x in (-0.4, 0.4)]
    table = trimesh.Scene([*legs, box((1.0, 0.6, 0.1), (0.0, 0.0, 0.55))])
    found = compute_sections(surfaces_of(table))
    ends = [[0.0, 0.5, -0.45, 0.45, -0.45, 0.45], [0.5, 0.6, -0.5, 0.5, -0.5, 0.5]]
    assert np.allclose(found.compute_outline(90.0), ends)
    assert np.allclose(
        found.compute_outline(0.0), [[0.0, 0.5, -0.05, 0.05, -0.05, 0.05], [0.5, 0.6, -0.3, 0.3, -0.3, 0.3]]
    )
    assert np.allclose(found.compute_outline(180.0)[:, 2:4], -found.compute_outline(0.0)[:, 3:1:-1])


@pytest.mark.thorough
def test_a_mesh_of_very_many_corners_has_a_small_outline():
    ball = trimesh.creation.icosphere(4)
    ball.vertices[:, 2] = np.maximum(ball.vertices[:, 2], -0.9)
    fine = compute_sections(surfaces_of(ball))
    assert len(fine.heights) == 240
    assert max(map(len, fine.hulls)) <= 180
    wide = fine.compute_outline(17.0)[:, 2:4]
    assert np.abs(wide[np.argmax(wide[:, 1])] - [-1.0, 1.0]).max() < 1e-3
