"""A body from a mesh is the body that its surface encloses: against closed forms, and against numeric integration."""

import io
import itertools
import json
import math
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

import rocking
from rocking import Block, Solid
from rocking.errors import BlockError, OptionError
from rocking.solid.mesh import compute_upright_rotation
from rocking.solid.repair import label_shells

SCRIPT = runpy.run_path(str(Path(__file__).resolve().parents[1] / "scripts" / "ship_statue.py"))
SIZES = (0.6, 0.4, 1.8)


def mesh_of(corners, faces):
    return trimesh.Trimesh(np.asarray(corners, float), np.asarray(faces), process=False)


def box(sizes=SIZES, at=(0.0, 0.0)):
    """A box that stands on z = 0, its middle at a place."""
    made = trimesh.creation.box(sizes)
    made.apply_translation([*at, 0.5 * sizes[2]])
    return made


def revolved(profile, at=(0.0, 0.0, 0.0)):
    """Rings of regular polygons of 36 corners, at heights and radii."""
    return mesh_of(*SCRIPT["revolved"](profile, at, None))


def scene(**parts):
    made = trimesh.Scene()
    for name, part in parts.items():
        made.add_geometry(part, node_name=name, geom_name=name)
    return made


def assert_same(one, other, rtol=1e-12):
    np.testing.assert_allclose(one.centre[2], other.centre[2], rtol=rtol)
    np.testing.assert_allclose(one.inertia_over_mass, other.inertia_over_mass, rtol=rtol, atol=rtol)
    np.testing.assert_allclose(sorted(one.support.tolist()), sorted(other.support.tolist()), rtol=rtol, atol=rtol)


def test_a_box_is_the_rectangular_block_across_its_sides():
    solid = Solid.from_mesh(box(), density=2500.0)
    assert solid.mass == pytest.approx(2500.0 * math.prod(SIZES), rel=1e-12)
    for azimuth, width, deep in ((0.0, 0.4, 0.6), (90.0, 0.6, 0.4), (180.0, 0.4, 0.6), (270.0, 0.6, 0.4)):
        block, rectangle = solid.block(azimuth), Block(width=width, height=1.8, mass=solid.mass)
        for side, exact in zip(block.sides, rectangle.sides, strict=True):
            for name in ("p", "alpha", "restitution", "radius"):
                assert getattr(side, name) == pytest.approx(getattr(exact, name), rel=1e-12), name
        assert solid.inertia_over_mass[2, 2] == pytest.approx((width**2 + deep**2) / 12.0, rel=1e-12)
    assert solid.weakest_azimuth in (pytest.approx(0.0), pytest.approx(180.0))
    assert solid.repairs == () == solid.notes


def polygon_shares(count=36):
    """Area over r^2 of a regular polygon, and its second moment about an axis over r^4."""
    turn = 2.0 * math.pi / count
    area = 0.5 * count * math.sin(turn)
    return area, area * (2.0 + math.cos(turn)) / 12.0


def integrated(profile):
    """Volume, height of the centre, and squared radii of gyration across and up, by quadrature over the height."""
    heights, radii = np.array(profile).T
    area, second = polygon_shares()

    def over(power, share, times):
        parts = [
            quad(lambda z: share * np.interp(z, heights, radii) ** power * z**times, low, high, epsabs=0.0)[0]
            for low, high in itertools.pairwise(heights)
            if high > low
        ]
        return sum(parts)

    volume, about = over(2, area, 0), over(4, second, 0)
    centre = over(2, area, 1) / volume
    return volume, centre, about / volume + over(2, area, 2) / volume - centre**2, 2.0 * about / volume


@pytest.mark.parametrize(
    "profile",
    [((0.0, 0.3), (1.4, 0.3)), ((0.0, 0.5), (1.2, 0.2)), ((0.0, 0.2), (0.3, 0.35), (0.9, 0.1))],
    ids=["cylinder", "frustum", "vase"],
)
def test_a_body_of_revolution_has_the_moments_of_its_cross_sections(profile):
    volume, centre, across, up = integrated(profile)
    solid = Solid.from_mesh(revolved(profile, (0.7, -0.4, 0.0)))
    assert solid.volume == pytest.approx(volume, rel=1e-12)
    np.testing.assert_allclose(solid.centre, [0.7, -0.4, centre], rtol=1e-12)
    np.testing.assert_allclose(solid.inertia_over_mass, np.diag([across, across, up]), rtol=1e-12, atol=1e-15)
    radius = profile[0][1]
    assert solid.block(10.0).sides[0].alpha == pytest.approx(math.atan2(radius, centre), rel=1e-12)


def test_a_cylinder_of_a_circle_is_approached_as_the_square_of_its_facets():
    radius, height = 0.3, 1.5
    exact = Block.from_pivots((radius, radius), height / 2, math.sqrt(radius**2 / 4 + height**2 / 12))
    for count in (32, 64, 128):
        block = Solid.from_mesh(trimesh.creation.cylinder(radius=radius, height=height, sections=count)).block(90.0)
        bound = (math.pi / count) ** 2
        assert 0.0 < abs(block.sides[0].p / exact.p - 1.0) < bound


def test_two_densities_move_the_centre_and_the_sides_differ():
    # An L: a foot of one stone below, a post of another at its western end.
    foot, post = box((1.0, 0.5, 0.4)), box((0.3, 0.5, 1.2), at=(-0.35, 0.0))
    post.apply_translation([0.0, 0.0, 0.4])
    densities = {"foot": 2000.0, "post": 2600.0}
    solid = Solid.from_mesh(scene(foot=foot, post=post), density=densities)
    masses = np.array([2000.0 * 0.2, 2600.0 * 0.18])
    centres = np.array([[0.0, 0.2], [-0.35, 1.0]])
    sizes = np.array([[1.0, 0.4], [0.3, 1.2]])
    centre = masses @ centres / masses.sum()
    inertia = masses @ (np.sum(sizes**2, axis=1) / 12.0 + np.sum((centres - centre) ** 2, axis=1)) / masses.sum()
    exact = Block.from_pivots(
        (0.5 - centre[0], 0.5 + centre[0]), centre[1], math.sqrt(inertia), mass=float(masses.sum())
    )
    block = solid.block(90.0)
    for side, wanted in zip(block.sides, exact.sides, strict=True):
        assert (side.p, side.alpha, side.restitution) == pytest.approx(
            (wanted.p, wanted.alpha, wanted.restitution), rel=1e-12
        )
    assert block.sides[0].alpha > block.sides[1].alpha
    assert solid.mass == pytest.approx(masses.sum(), rel=1e-12)
    assert [(each.name, each.density) for each in solid.regions] == [*densities.items()]
    # Of one density the mass cancels.
    assert_same(Solid.from_mesh(scene(foot=foot, post=post)), Solid.from_mesh(scene(foot=foot, post=post), density=7.0))


@pytest.mark.parametrize("at", [(0.0, 0.0), (1.1, 0.7), (-35.3, 12.9)])
def test_a_symmetric_body_has_equal_sides_wherever_it_stands(at):
    inertia = np.diag([(0.4**2 + 1.8**2) / 12, (0.6**2 + 1.8**2) / 12, (0.6**2 + 0.4**2) / 12])
    corners = [(at[0] + x, at[1] + y) for x, y in ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2))]
    cabinet = Solid(corners, (*at, 0.9), inertia)
    turned = Solid.from_mesh(box(at=at), turn=30.0)
    for azimuth in (*range(0, 360, 15), turned.weakest_azimuth):
        for solid in (cabinet, turned):
            assert solid.block(azimuth).is_symmetric
    uneven = Solid(corners, (at[0] + 1e-6, at[1], 0.9), inertia)
    assert not uneven.block(90.0).is_symmetric


def test_the_opposite_azimuth_is_the_mirror_image():
    solid = Solid.from_mesh("statue")
    for azimuth in (0.0, 37.0, 90.0, 200.0):
        here, there = solid.block(azimuth), solid.block(azimuth + 180.0)
        for side, other in zip(here.sides, there.sides[::-1], strict=True):
            assert (side.p, side.alpha, side.restitution) == pytest.approx(
                (other.p, other.alpha, other.restitution), rel=1e-12
            )


def test_where_a_mesh_lies_how_it_is_turned_and_its_units_do_not_matter():
    plain = Solid.from_mesh(box())
    moved = box()
    moved.apply_translation([0.0, 0.0, -37.0])
    assert_same(Solid.from_mesh(moved), plain)
    for unit, size in (("mm", 1e-3), ("cm", 1e-2), ("ft", 0.3048), (1e6, 1e6), (1e-6, 1e-6)):
        other = box()
        other.apply_scale(1.0 / size)
        assert_same(Solid.from_mesh(other, unit=unit), plain, 1e-11)
    tilted = box()
    rotation = Rotation.from_rotvec([0.3, -0.2, 0.0])
    tilted.vertices = rotation.apply(tilted.vertices) + np.array([5.0, 3.0, 2.0])
    solid = Solid.from_mesh(tilted, up=rotation.apply([0.0, 0.0, 1.0]))
    block, straight = solid.block(30.0), plain.block(30.0)
    assert block.sides[0].p == pytest.approx(straight.sides[0].p, rel=1e-12)
    assert block.sides[0].alpha == pytest.approx(straight.sides[0].alpha, rel=1e-12)
    turned = Solid.from_mesh(box(), turn=25.0)
    for azimuth in (0.0, 40.0, 111.0):
        assert turned.block(azimuth + 25.0).sides[0].alpha == pytest.approx(
            plain.block(azimuth).sides[0].alpha, rel=1e-12
        )
    quarter = Solid.from_mesh(box(), turn=90.0)
    assert quarter.block(90.0).sides[0].alpha == plain.block(0.0).sides[0].alpha


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z", [1.0, 2.0, -0.5], [0.0, 0.0, -3.0]])
def test_any_axis_is_turned_up_without_a_mirror(up):
    rotation = compute_upright_rotation(up)
    axis = (
        np.eye(3)["xyz".index(up[-1])] * (-1 if up[0] == "-" else 1) if isinstance(up, str) else up / np.linalg.norm(up)
    )
    np.testing.assert_allclose(rotation @ axis, [0.0, 0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_all_formats_hold_the_same_body_and_gltf_points_up_by_y(tmp_path):
    plain = Solid.from_mesh(box())
    for suffix in ("obj", "ply", "stl", "glb"):
        made = box()
        if suffix == "glb":
            made.vertices = made.vertices @ compute_upright_rotation("y")  # z to y
        made.export(tmp_path / f"box.{suffix}")
        assert_same(Solid.from_mesh(tmp_path / f"box.{suffix}"), plain, 1e-6)
    for name, content in made.export(file_type="gltf").items():
        (tmp_path / name).write_bytes(content)
    assert_same(Solid.from_mesh(tmp_path / "model.gltf"), plain, 1e-6)
    assert_same(Solid.from_mesh(str(tmp_path / "box.obj")), plain, 1e-6)


def test_parts_of_a_scene_stand_where_their_nodes_put_them(tmp_path):
    made = trimesh.Scene()
    for name, height in (("low", 0.0), ("high", 1.0)):
        place = trimesh.transformations.translation_matrix([0.0, 0.0, height])
        made.add_geometry(box((1.0, 1.0, 1.0)), node_name=name, geom_name="cube", transform=place)
    mirrored = np.diag([-1.0, 1.0, 1.0, 1.0])
    mirrored[2, 3] = 2.0
    made.add_geometry(box((1.0, 1.0, 1.0)), node_name="mirrored", geom_name="other", transform=mirrored)
    solid = Solid.from_mesh(made, density={"low": 1.0, "high": 2.0, "mirrored": 3.0})
    assert solid.mass == pytest.approx(6.0)
    assert solid.centre[2] == pytest.approx((0.5 + 2 * 1.5 + 3 * 2.5) / 6.0)
    assert solid.repairs == ()


# What is repaired


def repairs_of(mesh):
    return Solid.from_mesh(mesh).repairs


def test_normals_that_point_inwards_are_turned():
    inverted = box()
    inverted.invert()
    assert_same(Solid.from_mesh(inverted), Solid.from_mesh(box()))
    assert repairs_of(inverted) == ("normals pointed inwards: the surface was turned inside out",)


def mixed():
    """A box with some faces turned round."""
    made = box()
    made.faces[[1, 4, 7]] = made.faces[[1, 4, 7], ::-1]
    return made


def test_flat_holes_are_filled_exactly_and_said_to_be():
    plain = Solid.from_mesh(revolved(((0.0, 0.3), (1.4, 0.3))))
    mesh = revolved(((0.0, 0.3), (1.4, 0.3)))
    flat = np.ptp(mesh.vertices[mesh.faces][:, :, 2], axis=1) == 0.0
    for left_out, count in ((flat & (mesh.triangles_center[:, 2] == 0.0), "1 hole"), (flat, "2 holes")):
        opened = mesh_of(mesh.vertices, mesh.faces[~left_out])
        solid = Solid.from_mesh(opened)
        assert_same(solid, plain, 1e-11)
        (said,) = solid.repairs
        assert said.startswith(f"{count} filled, ")
        area = polygon_shares()[0] * 0.3**2 * int(count[0])
        assert f"{area:.3g} m^2" in said


def test_a_hole_round_an_edge_is_filled_with_what_is_missing_known():
    opened = box((1.0, 1.0, 1.0))
    corner = np.flatnonzero(np.all(opened.vertices == [0.5, 0.5, 1.0], axis=1))
    opened.update_faces(~np.any(np.isin(opened.faces, corner), axis=1))
    (said,) = repairs_of(opened)
    assert "1 hole filled" in said
    assert 0.5 < Solid.from_mesh(opened).volume < 1.0


def test_cavities_are_hollow_and_pieces_are_not():
    inner = trimesh.creation.box((0.2, 0.2, 0.2))
    inner.apply_translation([0.0, 0.0, 0.5])
    outer, hollow = box((1.0, 1.0, 1.0)), inner.copy()
    hollow.invert()
    both = trimesh.util.concatenate([outer, hollow])
    solid = Solid.from_mesh(both)
    assert solid.volume == pytest.approx(1.0 - 0.008)
    assert solid.repairs == ("1 cavity of 0.008 m^3 taken as hollow",)
    inverted = both.copy()
    inverted.invert()
    assert Solid.from_mesh(inverted).volume == pytest.approx(1.0 - 0.008)
    core = Solid.from_mesh(trimesh.util.concatenate([outer, inner]))
    assert core.volume == pytest.approx(1.008)
    assert core.repairs == ()
    assert core.notes[0].startswith("two pieces of mesh overlap in about 0.008 m^3, which is counted twice: ")
    assert core.notes[0].endswith("if one is a cavity, turn its normals inwards")
    apart = box((0.2, 0.2, 0.2), at=(0.0, 2.0))
    apart.invert()
    pieces = Solid.from_mesh(trimesh.util.concatenate([outer, apart]))
    assert pieces.volume == pytest.approx(1.008)
    assert pieces.repairs == ("1 separate surface turned inside out",)


def test_a_part_inside_another_that_is_turned_the_other_way_is_its_cavity():
    hollow = trimesh.creation.box((0.2, 0.2, 0.2))
    hollow.apply_translation([0.0, 0.0, 0.5])
    hollow.invert()
    parts = {"outer": box((1.0, 1.0, 1.0)), "hollow": hollow, "far": box((1.0, 1.0, 1.0), at=(3.0, 0.0))}
    one_mesh = trimesh.util.concatenate([*parts.values()])
    for density in (None, 2e3, {"outer": 2e3, "far": 2e3}):
        solid = Solid.from_mesh(scene(**parts), density=density)
        assert_same(solid, Solid.from_mesh(one_mesh))
        assert {each.name: round(each.volume, 12) for each in solid.regions} == {"outer": 0.992, "far": 1.0}
        assert solid.repairs == ("outer: 1 cavity of 0.008 m^3 taken as hollow",)
        assert solid.notes == ()
    filled = Solid.from_mesh(scene(**parts), density={"outer": 2e3, "far": 2e3, "hollow": 1e3})
    assert filled.volume == pytest.approx(2.008)
    assert filled.notes[0].startswith("hollow and outer overlap in about 0.008 m^3")
    # All turned inside out, and a cavity in the smaller piece of one mesh.
    inverted = one_mesh.copy()
    inverted.invert()
    assert_same(Solid.from_mesh(inverted), Solid.from_mesh(one_mesh))
    smaller = trimesh.util.concatenate([box((1.0, 1.0, 1.0)), hollow, box((2.0, 2.0, 1.0), at=(3.0, 0.0))])
    assert Solid.from_mesh(smaller).volume == pytest.approx(4.992)


@pytest.mark.parametrize(
    ("at", "sizes", "common"),
    [
        ((0.5, 0.0, 0.5), (1.0, 1.0, 1.0), 0.25),
        ((0.0, 0.0, 0.99), (1.0, 1.0, 1.0), 1e-2),
        ((0.1, 0.2, 0.3), (0.2, 0.3, 0.4), 0.024),
        ((0.0, 0.0, 1.0), (1.0, 1.0, 1.0), 0.0),
        ((1.0, 0.2, 0.0), (1.0, 1.0, 1.0), 0.0),
        ((1.0, 1.0, 0.0), (1.0, 1.0, 1.0), 0.0),
        ((3.0, 0.0, 0.0), (1.0, 1.0, 1.0), 0.0),
    ],
    ids=["corner", "sunk", "nested", "on", "beside", "edge", "apart"],
)
def test_what_two_boxes_have_in_common_is_noted_once(at, sizes, common):
    other = box(sizes, at[:2])
    other.apply_translation([0.0, 0.0, at[2]])
    parts = {"foot": box((1.0, 1.0, 1.0)), "post": other}
    both = trimesh.util.concatenate([*parts.values()])
    for mesh, pair in ((scene(**parts), "foot and post"), (both, "two pieces of mesh")):
        solid = Solid.from_mesh(mesh)
        if common == 0.0:
            assert solid.notes == ()
            continue
        (note,) = solid.notes
        assert note == (
            f"{pair} overlap in about {common:.2g} m^3, which is counted twice: make one surface of the two, cut one "
            "out of the other, or, if one is a cavity, turn its normals inwards"
        )


def test_small_overlaps_far_apart_are_noted():
    parts = {"base": _box((4, 2, 0.5), (0, 0, 0.25)), "top": _box((4, 2, 0.5), (0, 0, 3.65))}
    parts |= {name: _box((0.3, 0.3, 3.0), (x, 0, 1.95)) for name, x in (("west", -1.5), ("east", 1.5))}
    (note,) = Solid.from_mesh(scene(**parts)).notes
    assert "top and west overlap in about 0.0045 m^3 (the largest of 4 overlaps), which is counted twice" in note


def test_bodies_that_overlap_in_a_cavity_are_noted():
    shell = [_box((4, 4, 4), (0, 0, 2)), _box((3, 3, 3), (0, 0, 2), inverted=True)]
    held = [_box((1, 1, 1), (x, 0, 2)) for x in (0.0, 0.5)]
    assert Solid.from_mesh(trimesh.util.concatenate([*shell, held[0]])).notes == ()
    (note,) = Solid.from_mesh(trimesh.util.concatenate([*shell, *held])).notes
    assert note.startswith("two pieces of mesh overlap in about 0.5 m^3, which is")


def test_faces_that_are_none_or_come_twice_are_left_out():
    mesh = box()
    faces = np.vstack([mesh.faces, [0, 0, 1], [2, 2, 2], mesh.faces[3], np.roll(mesh.faces[5], 1)])
    solid = Solid.from_mesh(mesh_of(mesh.vertices, faces))
    assert_same(solid, Solid.from_mesh(box()))
    assert solid.repairs == ("4 faces without area, or there twice, left out",)


def test_a_surface_in_several_open_parts_of_one_density_is_joined():
    mesh = box()
    halves = scene(
        left=mesh_of(mesh.vertices, mesh.faces[:6]),
        right=mesh_of(mesh.vertices, mesh.faces[6:]),
    )
    solid = Solid.from_mesh(halves, density=2000.0)
    assert_same(solid, Solid.from_mesh(box()))
    assert solid.repairs == ()
    assert [each.name for each in solid.regions] == ["left + right"]
    assert solid.mass == pytest.approx(2000.0 * math.prod(SIZES))


# The support


def test_a_body_far_from_the_origin_of_its_coordinates_has_the_support_that_it_has_there():
    # Eastings and northings of a map: the body is small over them.
    for at in ((0.0, 0.0), (4.0e5, 5.2e6)):
        found = Solid.from_mesh(box(at=at))
        assert len(found.support) == 4, at
        assert np.ptp(found.support, axis=0) == pytest.approx(SIZES[:2], rel=1e-7)
        assert found.block(0.0).sides[0].alpha == pytest.approx(math.atan2(SIZES[1], SIZES[2]), rel=1e-7)


def test_only_corners_near_the_lowest_one_carry():
    # A base whose edge is bevelled by 5 mm over 50 mm.
    profile = ((0.0, 0.25), (0.005, 0.3), (1.5, 0.3))
    sharp = Solid.from_mesh(revolved(profile))
    assert np.ptp(sharp.support[:, 0]) == pytest.approx(0.5)
    (note,) = sharp.notes
    assert "the support would be 44 % larger" in note
    wide = Solid.from_mesh(revolved(profile), tolerance=0.006)
    assert np.ptp(wide.support[:, 0]) == pytest.approx(0.6)
    assert wide.notes == ()
    given = Solid.from_mesh(revolved(profile), support=[(0.1, 0.1), (-0.1, 0.1), (0.0, 0.0), (-0.1, -0.1), (0.1, -0.1)])
    assert len(given.support) == 4
    assert given.block(0.0).sides[0].alpha == pytest.approx(math.atan2(0.1, given.centre[2]))


def test_the_rose_is_the_blocks_and_the_least_is_at_an_edge():
    solid = Solid.from_mesh("statue", density={"plinth": 2700.0, "figure": 2650.0, "head": 2650.0})
    azimuths = np.arange(3.0, 360.0, 30.0)
    rose = solid.rose(azimuths)
    for k, azimuth in enumerate(azimuths):
        side, other = solid.block(azimuth).sides
        assert rose.data.acceleration.values[k] == pytest.approx(math.tan(side.alpha), rel=1e-12)
        for name in ("alpha", "p", "restitution", "radius"):
            assert rose.data[name].values[k] == pytest.approx(getattr(side, name), rel=1e-12), name
        assert rose.data.rise.values[k] == pytest.approx(side.radius - solid.centre[2], rel=1e-12)
        assert rose.select(azimuth=(azimuth + 180.0) % 360.0).data.p.values[0] == pytest.approx(other.p, rel=1e-12)
    fine = solid.rose(np.arange(0.0, 360.0, 0.5))
    assert float(fine.data.acceleration.min()) == pytest.approx(rose.data.weakest_acceleration, rel=1e-12)
    assert fine.data.azimuth.values[np.argmin(fine.data.acceleration.values)] == pytest.approx(
        rose.data.weakest_azimuth
    )
    assert solid.rose().data.sizes["azimuth"] == 72
    assert solid.rose([360.0, 0.0, -90.0]).data.azimuth.values.tolist() == [0.0, 270.0]


def test_what_planar_rocking_leaves_out_is_measured():
    # A box of which one upper corner is heavy: the axes to the east and to the north are no principal ones.
    heavy = trimesh.creation.box((0.1, 0.1, 0.1))
    heavy.apply_translation([0.25, 0.15, 1.9])
    solid = Solid.from_mesh(scene(box=box(), heavy=heavy), density={"box": 1000.0, "heavy": 50000.0})
    tensor = solid.inertia_over_mass
    rose = solid.rose([0.0, 90.0])
    np.testing.assert_allclose(
        rose.data.coupling.values,
        [np.hypot(tensor[0, 1], tensor[0, 2]) / tensor[0, 0], np.hypot(tensor[0, 1], tensor[1, 2]) / tensor[1, 1]],
        rtol=1e-12,
    )
    assert rose.data.coupling.values.min() > 0.03
    even = Solid.from_mesh(box()).rose([0.0, 30.0])
    assert even.data.coupling.values[0] == pytest.approx(0.0, abs=1e-12)
    # At 30 deg the corner at (0.3, 0.2) is the pivot: on the right of the direction, and the other one on its left.
    aside = abs(0.3 * math.cos(math.radians(30.0)) - 0.2 * math.sin(math.radians(30.0)))
    np.testing.assert_allclose(even.data.lateral_offset.values, [0.0, aside], atol=1e-12)
    np.testing.assert_allclose(even.data.gap.values, [0.0, 2.0 * aside], atol=1e-12)


def test_a_body_needs_no_mesh():
    made = Solid.from_mesh(box(), density=1000.0)
    again = Solid(made.support, made.centre, made.inertia_over_mass, mass=made.mass)
    assert again.block(20.0).sides == made.block(20.0).sides
    assert again.block(20.0).description == "rigid body in the plane of 20 deg"
    assert again.volume is None and again.height is None
    assert again.summary().startswith("rigid body: 432 kg")
    assert again.to_dict()["volume_m3"] is None
    with pytest.raises(ValueError, match="read-only"):
        again.centre[0] = 1.0


# The statue that ships


def test_the_shipped_statue_is_what_its_script_makes_and_small(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["ship_statue.py", str(tmp_path / "statue.obj")])
    SCRIPT["main"]()
    shipped = Path(rocking.__file__).parent / "solid" / "data" / "statue.obj"
    assert shipped.read_bytes() == (tmp_path / "statue.obj").read_bytes()
    assert shipped.stat().st_size < 100_000


def test_the_statue_is_what_quadrature_over_its_cross_sections_says():
    densities = {"plinth": 2700.0, "figure": 2650.0, "head": 2650.0}
    solid = Solid.from_mesh("statue", density=densities)
    x, y, z = SCRIPT["PLINTH"]
    rows = [(x * y * z, (0.0, 0.0, 0.5 * z), np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) / 12.0)]
    figure, head = SCRIPT["FIGURE"], (*SCRIPT["HEAD"], (SCRIPT["HEAD_TOP"], 0.0))
    for profile, at, base in ((figure, SCRIPT["FIGURE_AT"], z), (head, SCRIPT["HEAD_AT"], z + figure[-1][0])):
        volume, centre, across, up = integrated(profile)
        rows.append((volume, (*at, base + centre), np.diag([across, across, up])))
    masses = np.array([volume for volume, _, _ in rows]) * [*densities.values()]
    centres = np.array([centre for _, centre, _ in rows])
    centre = masses @ centres / masses.sum()
    inertia = np.zeros((3, 3))
    for mass, at, own in zip(masses, centres, [own for _, _, own in rows], strict=True):
        off = at - centre
        inertia += mass * (own + off @ off * np.eye(3) - np.outer(off, off)) / masses.sum()
    assert solid.mass == pytest.approx(masses.sum(), rel=1e-8)
    np.testing.assert_allclose(solid.centre, centre, rtol=1e-8)
    np.testing.assert_allclose(solid.inertia_over_mass, inertia, rtol=1e-8, atol=1e-9)
    assert solid.repairs == () == solid.notes  # its parts touch, and do not overlap


# What is refused


def flat():
    return mesh_of([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], [(0, 1, 2), (1, 3, 2)])


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_a_plate_is_too_thin_for_its_size_and_not_for_a_metre(size):
    assert Solid.from_mesh(box((size, size, 1e-7 * size))).volume == pytest.approx(1e-7 * size**3, rel=1e-6)
    with pytest.raises(BlockError, match="encloses no volume"):
        Solid.from_mesh(box((size, size, 1e-11 * size)))


def strip():
    """A Möbius strip of six quadrilaterals."""
    turns = np.arange(6) * np.pi / 3.0
    tilt = 0.5 * turns
    ring = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(6)])
    off = 0.3 * np.column_stack([np.cos(tilt) * np.cos(turns), np.cos(tilt) * np.sin(turns), np.sin(tilt)])
    corners = np.vstack([ring + off, ring - off])
    faces = []
    for k in range(6):
        a, b, c, d = k, (k + 1) % 6, k + 6, (k + 1) % 6 + 6
        if k == 5:
            b, d = d, b
        faces += [(a, b, d), (a, d, c)]
    return mesh_of(corners, faces)


def leaning():
    """A box whose upper half lies far to the east."""
    upper = box((0.4, 0.4, 1.0), at=(0.7, 0.0))
    upper.apply_translation([0.0, 0.0, 0.2])
    return scene(foot=box((0.4, 0.4, 0.2)), upper=upper)


REFUSED = {
    "no volume": (lambda: Solid.from_mesh(flat()), "mesh encloses no volume: it is a surface without an inside"),
    "one side": (lambda: Solid.from_mesh(strip()), "point to different sides of the surface: orient them alike"),
    "mixed": (lambda: Solid.from_mesh(mixed()), "normals of neighbouring triangles point to different sides"),
    "one place": (lambda: Solid.from_mesh(mesh_of(np.ones((3, 3)), [(0, 1, 2)])), "coincide"),
    "not finite": (
        lambda: Solid.from_mesh(mesh_of([(0, 0, 0), (1, 0, 0), (0, np.nan, 0)], [(0, 1, 2)])),
        "corners that are not finite",
    ),
    "does not stand": (
        lambda: Solid.from_mesh(leaning()),
        r"does not stand: its centre of mass lies 0\.383 m outside its support, towards 90 deg",
    ),
    "a ball": (lambda: Solid.from_mesh(trimesh.creation.icosphere()), "stands on a point or a line"),
    "support beyond": (
        lambda: Solid.from_mesh(box(), support=[(0.35, 0.2), (-0.3, 0.2), (-0.3, -0.2)]),
        r"support reaches 0\.05 m beyond the outline of the mesh, from -0\.3 m to 0\.3 m in the east",
    ),
    "support beyond a circle": (
        lambda: Solid.from_mesh(
            trimesh.creation.cylinder(0.5, 2.0, sections=360),
            support=np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) / 2,
        ),
        r"support reaches 0\.207 m beyond the outline of the mesh",
    ),
    "support on a line": (
        lambda: Solid.from_mesh(box(), support=[(0.1, 0.1), (0.0, 0.0), (-0.1, -0.1)]),
        "support must have at least three corners that are not on one line",
    ),
    "support of numbers": (lambda: Solid.from_mesh(box(), support=[0.1, 0.2]), "support must be corners of a polygon"),
    "density of no part": (
        lambda: Solid.from_mesh("statue", density={"plint": 2700.0}),
        "density has a part 'plint', which the mesh does not have; did you mean plinth",
    ),
    "density missing": (
        lambda: Solid.from_mesh("statue", density={"plinth": 2700.0, "head": 1.0}),
        "density is missing for figure; its parts are figure, head, plinth",
    ),
    "density": (lambda: Solid.from_mesh(box(), density=-1.0), "density must be a positive number, in kg/m"),
    "unit": (lambda: Solid.from_mesh(box(), unit="inch"), "unit must be one of m, cm, mm, in, ft"),
    "up": (lambda: Solid.from_mesh(box(), up="north"), "up must be one of x, y, z"),
    "both": (
        lambda: Solid.from_mesh(box(), tolerance=0.01, support=[[0, 0], [0.1, 0], [0, 0.1]]),
        "tolerance is used only to find the support; omit it if support is given",
    ),
    "no file": (lambda: Solid.from_mesh("nobody.obj"), "nobody.obj: there is no such file"),
    "a folder": (
        lambda: Solid.from_mesh(Path(__file__).parent),
        "tests: this is a folder, not a file; choose a file in it",
    ),
    "no statue": (lambda: Solid.from_mesh("statu"), "the mesh that ships is statue"),
    "no mesh": (
        lambda: Solid.from_mesh(3.0),
        "mesh must be the path of a file, a binary stream that has a name, .*, not 3",
    ),
    "inertia": (
        lambda: Solid([(1, 0), (0, 1), (-1, -1)], (0, 0, 1), np.diag([1.0, 1.0, 3.0])),
        "inertia_over_mass must be symmetric",
    ),
    "centre": (lambda: Solid([(1, 0), (0, 1), (-1, -1)], (0, 1), np.eye(3)), r"centre must be finite numbers of shape"),
    "centre below": (lambda: Solid([(1, 0), (0, 1), (-1, -1)], (0, 0, -1), np.eye(3)), "height of the centre of mass"),
    "stocky": (lambda: Solid.from_mesh(box((2.0, 2.0, 0.3))).block(0.0), "too stocky"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_body_is_refused_in_one_sentence(case):
    make, sentence = REFUSED[case]
    with pytest.raises(BlockError, match=sentence) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("azimuths", [[], [math.nan], "north", [[0.0]]])
def test_azimuths_are_numbers(azimuths):
    with pytest.raises(OptionError, match="azimuths must be"):
        Solid.from_mesh("statue").rose(azimuths)


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("points.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
         "property float z\nend_header\n0 0 0\n", "contains no faces"),
        ("nothing.obj", "# nothing\n", "contains no faces"),
        ("empty.obj", "", "contains no faces"),
        ("text.stl", "hello", "contains no faces"),
        ("text.ply", "hello", "cannot be read: "),
        ("text.glb", "hello", "cannot be read: "),
        ("block.xyzw", "hello", "cannot be read: trimesh reads only the formats"),
        ("plain", "hello", "cannot be read: trimesh reads only the formats"),
    ],
)  # fmt: skip
def test_a_file_without_a_mesh_is_refused_by_its_name(tmp_path, name, content, sentence):
    (tmp_path / name).write_text(content)
    with pytest.raises(BlockError, match=sentence) as caught:
        Solid.from_mesh(tmp_path / name)
    assert caught.value.path == str(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_without_trimesh_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(OptionError, match=r"pip install '\.\[mesh\]'"):
        Solid.from_mesh("statue")


@pytest.mark.parametrize(("unit", "noted"), [("m", 0), ("mm", 1), (1000.0, 1)])
def test_a_body_of_no_likely_size_is_noted(unit, noted):
    notes = Solid.from_mesh(box(), unit=unit).notes
    assert len(notes) == noted
    assert all("are its coordinates in metres?" in note for note in notes)


def named(data, name):
    stream = io.BytesIO(data)
    stream.name = name
    return stream


@pytest.mark.parametrize("name", ["one.stl", "one.ply", "two.obj", "two.glb"])
def test_a_stream_is_the_same_body_as_its_file(name, tmp_path):
    tall, low = box((0.4, 0.3, 1.2)), box((0.8, 0.6, 0.2))
    tall.apply_translation((0.05, 0.0, 0.2))
    scene = trimesh.Scene([tall] if name.startswith("one") else [low, tall])
    if name.endswith("glb"):
        scene.apply_transform(trimesh.transformations.rotation_matrix(-0.5 * math.pi, [1.0, 0.0, 0.0]))
    scene.export(tmp_path / name)
    with (tmp_path / name).open("rb") as stream:
        found = Solid.from_mesh(stream)
    assert found.to_dict() == Solid.from_mesh(tmp_path / name).to_dict()
    assert found.height == pytest.approx(1.2 if name.startswith("one") else 1.4)


def test_a_stream_names_no_other_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "other.bin").write_bytes(bytes(120))
    gltf = {"asset": {"version": "2.0"}, "buffers": [{"uri": "other.bin", "byteLength": 120}]}
    for uri in ("other.bin", "/etc/passwd", "../other.bin", "http://127.0.0.1:9/other.bin", "file:///etc/passwd"):
        gltf["buffers"][0]["uri"] = uri
        with pytest.raises(BlockError, match=f"a.gltf: cannot be read: '{uri}' is missing"):
            Solid.from_mesh(named(json.dumps(gltf).encode(), "a.gltf"))
    # Materials of an OBJ file are not looked for.
    scene = b"mtllib /etc/passwd\nusemtl red\n" + trimesh.exchange.obj.export_obj(box()).encode()
    assert Solid.from_mesh(named(scene, "a.obj")).volume == pytest.approx(box().volume)


def _box(sizes, at, *, inverted=False):
    mesh = trimesh.creation.box(sizes)
    mesh.apply_translation(at)
    if inverted:
        mesh.invert()
    return mesh


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("density", [None, 1000.0, {"wall": 2000.0, "core": 7000.0}])
def test_a_body_within_a_cavity_is_one(inverted, density):
    whole = trimesh.Scene()
    parts = {"wall": _box((2, 2, 4), (0, 0, 2)), "core": _box((0.5, 0.5, 1), (0, 0, 1.5))}
    parts["void"] = _box((1.6, 1.6, 3), (0, 0, 2), inverted=True)
    for name, mesh in parts.items():
        if inverted:
            mesh.invert()
        whole.add_geometry(mesh, node_name=name, geom_name=name)
    found = Solid.from_mesh(whole, density=density)
    assert found.volume == pytest.approx(16.0 - 7.68 + 0.25, rel=1e-12)
    assert {region.name for region in found.regions} == {"wall", "core"}
    if isinstance(density, dict):
        assert found.mass == pytest.approx(2000.0 * 8.32 + 7000.0 * 0.25, rel=1e-12)


def test_an_inverted_part_leaves_the_cavity_of_another_one_hollow():
    cavity = _box((1, 1, 3), (4, 0, 2.5), inverted=True)
    hollow = trimesh.util.concatenate([_box((2, 2, 5), (4, 0, 2.5)), cavity])
    found = Solid.from_mesh(scene(solid=_box((3, 3, 6), (0, 0, 3), inverted=True), hollow=hollow))
    assert found.volume == pytest.approx(54.0 + 17.0, rel=1e-12)
    assert found.repairs == (
        "hollow: 1 cavity of 3 m^3 taken as hollow",
        "solid: normals pointed inwards: the surface was turned inside out",
    )


@pytest.mark.parametrize("at", [(-0.5, 0, 2), (0.5, 0, 2), (0, -0.5, 2), (0, 0.5, 2)])
def test_a_cavity_in_the_surface_is_one_wherever_its_corners_lie(at):
    found = Solid.from_mesh(trimesh.util.concatenate([_box((2, 2, 4), (0, 0, 2)), _box((1, 1, 2), at, inverted=True)]))
    assert found.volume == pytest.approx(14.0, rel=1e-12)
    assert found.repairs == ("1 cavity of 2 m^3 taken as hollow",)


@pytest.mark.parametrize("at", [(1.25, 1.25, 4.25), (1.25, 1.25, 2.0), (1.25, 0.0, 2.0)])
def test_a_piece_that_is_turned_inside_out_and_touches_the_rest_is_none_of_its_cavities(at):
    """It touches at a corner, along an edge, and with a face that has no corner in common with the other's."""
    size = (0.5, 0.5, 0.5) if at[2] > 4.0 else (0.5, 0.5, 4.0) if at[1] > 1.0 else (0.5, 1.0, 1.0)
    piece = _box(size, at, inverted=True)
    found = Solid.from_mesh(trimesh.util.concatenate([_box((2, 2, 4), (0, 0, 2)), piece]))
    assert found.volume == pytest.approx(16.0 + np.prod(size), rel=1e-12)
    assert found.repairs == ("1 separate surface turned inside out",)
    upright = Solid.from_mesh(trimesh.util.concatenate([_box((2, 2, 4), (0, 0, 2)), _box(size, at)]))
    assert found.volume == pytest.approx(upright.volume, rel=1e-12)


def test_open_pieces_that_share_an_edge_are_one_surface_and_closed_ones_are_not():
    """Three pages of a book; two tetrahedra back to back along an edge."""
    assert label_shells(np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])).tolist() == [0, 0, 0]
    tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    other = np.array([[0, 5, 1], [0, 1, 6], [1, 5, 6], [0, 6, 5]])
    assert label_shells(np.vstack([tetrahedron, other])).tolist() == [0, 0, 0, 0, 1, 1, 1, 1]
