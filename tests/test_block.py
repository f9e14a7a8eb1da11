"""Blocks: parameters from sizes, pivots and frames; thresholds; what cannot stand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rocking import Block, Blocks
from rocking.errors import BlockError

sizes = st.floats(0.01, 20.0)


@given(sizes, sizes)
def test_a_rectangle_is_the_body_with_its_own_inertia(b, h):
    if math.atan2(b, h) > 0.9:
        return
    rectangle = Block(half_width=b, half_height=h)
    body = Block.from_pivots((b, b), h, math.sqrt((b * b + h * h) / 3.0))
    for name in ("p", "alpha", "restitution", "radius"):
        assert getattr(body, name) == pytest.approx(getattr(rectangle, name), rel=1e-13)


@given(sizes, sizes, sizes, sizes)
def test_pivot_restitution_conserves_angular_momentum_about_the_new_pivot(plus, minus, h, k):
    kept = k * k + h * h - plus * minus
    if kept <= 1e-3:
        return
    block = Block.from_pivots((plus, minus), h, k)
    # Momentum about the new pivot: spin of the body plus moment of the centre's momentum, before and after.
    for i, (left, entered) in enumerate(((plus, minus), (minus, plus))):
        velocity = np.array([h, left])  # of the centre for unit angular speed about the pivot that is left
        lever = np.array([-entered, h])
        before = k * k + (lever[1] * velocity[0] + lever[0] * velocity[1])
        after = k * k + entered**2 + h * h
        assert block.sides[i].restitution == pytest.approx(before / after, rel=1e-12)


def test_two_sided_body_from_unequal_pivots():
    block = Block.from_pivots((0.2, 0.15), 0.6, 0.4)
    assert [side.alpha for side in block.sides] == [math.atan2(0.2, 0.6), math.atan2(0.15, 0.6)]
    radii = math.hypot(0.2, 0.6), math.hypot(0.15, 0.6)
    expected = [math.sqrt(9.80665 * r / (0.16 + r * r)) for r in radii]
    assert [side.p for side in block.sides] == pytest.approx(expected, rel=1e-15)
    assert not block.is_symmetric


def test_a_block_whose_sides_differ_has_no_one_value_of_them():
    block = Block.from_pivots((0.2, 0.15), 0.6, 0.4, mass=100.0)
    for name in ("alpha", "p", "radius", "restitution"):
        plus, minus = (getattr(side, name) for side in block.sides)
        with pytest.raises(BlockError, match=rf"{name} is {plus:g} on side .* use block.sides\[0\].{name}"):
            getattr(block, name)
        assert plus != minus
        assert not hasattr(block, name)  # what looks at all attributes of an object passes these over
    half = Block.from_parameters((2.0, 2.0), (0.2, 0.2), (0.9, 0.8))
    assert (half.p, half.alpha) == (2.0, 0.2)
    assert not hasattr(half, "restitution")


@given(st.floats(0.0, 50.0))
def test_frame_is_the_lagrangian_of_columns_and_beam(gamma):
    b, h = 0.5, 3.0
    frame, radius = Block.from_frame(half_width=b, half_height=h, mass_ratio=gamma), math.hypot(b, h)
    # Kinetic energy of one column about its corner, plus its share of a beam that moves with its top (2R away).
    inertia = 4.0 / 3.0 * radius**2 + 4.0 * gamma * radius**2
    stiffness = 9.80665 * radius * (1.0 + 2.0 * gamma)
    assert frame.p == pytest.approx(math.sqrt(stiffness / inertia), rel=1e-13)
    assert frame.alpha == Block(half_width=b, half_height=h).alpha


@given(st.floats(0.0, 50.0))
def test_a_frames_restitution_conserves_angular_momentum_at_the_impact(gamma):
    # Every column turns from one lower corner to the other while the beam moves with their tops, without turning.
    b, h = 0.5, 3.0
    left, right = np.array([b, h]), np.array([-b, h])  # from the old and the new lower corner to a column's centre
    square = b * b + h * h

    def velocity(arm):
        return np.array([arm[1], -arm[0]])

    def moment(arm, momentum):
        return arm[1] * momentum[0] - arm[0] * momentum[1]

    # Momentum of a column about its new corner, and the beam's share through the new contact at the top (Makris and
    # Vassiliou 2013): the top's contact jumps to the opposite corner, 2 (b, h) from the lower one that is left.
    def about_the_new_corner(arm):
        spin = square / 3.0
        beam = gamma * moment(2.0 * right, velocity(2.0 * arm))
        return spin + moment(right, velocity(arm)) + beam

    expected = about_the_new_corner(left) / about_the_new_corner(right)
    assert Block.from_frame(half_width=b, half_height=h, mass_ratio=gamma).restitution == pytest.approx(
        expected, rel=1e-12
    )


def test_thresholds_of_both_models():
    block = Block.from_parameters(p=(2.0, 2.5), alpha=(0.1, 0.3), restitution=0.9)
    g = block.gravity
    assert block.uplift_thresholds("linear") == (g * 0.1, g * 0.3)
    assert block.uplift_thresholds() == (g * math.tan(0.1), g * math.tan(0.3))


def test_parameters_give_the_rectangles_radius():
    block = Block(half_width=0.3, half_height=1.1)
    assert Block.from_parameters(block.p, block.alpha).radius == pytest.approx(block.radius, rel=1e-14)


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Block(half_width=0.0, half_height=1.0), "half_width"),
        (lambda: Block(half_width=0.2, half_height=-1.0), "half_height"),
        (lambda: Block(half_width=0.2, half_height=1.0, restitution=0.0), "restitution"),
        (lambda: Block(half_width=0.2, half_height=1.0, restitution=(0.9, 0.9, 0.9)), "pair"),
        (lambda: Block(half_width=1.0, half_height=0.5), "set restitution to a value"),
        (lambda: Block(half_width=0.2, half_height=1.0, gravity=0.0), "gravity"),
        (lambda: Block(half_width=0.2, half_height=1.0, mass=-1.0), "mass"),
        (lambda: Block.from_parameters(-1.0, 0.2), "p must"),
        (lambda: Block.from_parameters(1.0, math.pi / 2), "pi/2"),
        (lambda: Block.from_parameters(1.0, 0.97), "set restitution"),
        (lambda: Block.from_pivots((0.2, 0.0), 1.0, 0.3), "distances"),
        (lambda: Block.from_pivots((2.0, 2.0), 0.1, 0.3), "set restitution"),
        (lambda: Block.from_frame(half_width=0.2, half_height=1.0, mass_ratio=-0.1), "mass_ratio"),
        (lambda: Block(half_width=1e-300, half_height=1.0), "half_width"),
        (lambda: Block(half_width=1e-12, half_height=1.0), "alpha"),
        (lambda: Block(half_width=0.2e14, half_height=1e14), "p (from the sizes) must be positive"),
        (lambda: Block.from_parameters(1e-200, 0.2), "p must"),
        (lambda: Block.from_parameters(1.0, 1e-200), "alpha"),
        (lambda: Block.from_pivots((0.2, 0.2), 1.0, 1e200), "radius_of_gyration"),
        (lambda: Block(0.4, 2.0), "give the sizes of a block by name, in m: Block(width=0.4, height=2.0)"),
        (
            lambda: Block.from_parameters((2.7, 2.70001), (0.2, 0.2)),
            "give p and alpha with more digits, or set restitution to a value in (0, 1]",
        ),
        (lambda: Block.from_parameters(True, 0.2), "p must be a number or an array of numbers, not True"),
    ],
)
def test_what_cannot_stand_is_refused_in_one_sentence(make, word):
    with pytest.raises(BlockError) as caught:
        make()
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_blocks_broadcast_and_index():
    blocks = Blocks.grid(p=[1.0, 2.0], alpha=[0.1, 0.2, 0.3], restitution=0.9)
    assert len(blocks) == 6
    assert [block.alpha for block in blocks] == [0.1, 0.2, 0.3] * 2
    assert blocks[4] == Block.from_parameters(2.0, 0.2, 0.9)
    assert len(blocks.select(blocks.alpha[:, 0] > 0.15)) == 4
    assert [block.alpha for block in blocks.select((1, 5))] == [0.2, 0.3]
    assert len(blocks.select(np.array([]))) == 0
    two_sided = Blocks(p=[[1.0, 2.0]], alpha=0.2, restitution=[0.9, 0.8])
    assert [side.p for side in two_sided[1].sides] == [1.0, 2.0]
    assert not two_sided.is_symmetric


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Blocks(p=[1.0, -2.0], alpha=0.2), "block 1"),
        (lambda: Blocks(p=[1.0], alpha=[0.2, np.nan]), "alpha"),
        (lambda: Blocks(p=[1.0], alpha=[1.2]), "restitution"),
        (lambda: Blocks(p=[1.0, 2.0], alpha=[0.1, 0.2, 0.3]), "shape"),
        (lambda: Blocks.grid(p=[], alpha=[0.1]), "grid"),
        (lambda: Blocks.from_bodies([]), "at least one"),
        (lambda: Blocks([1.0, 1e200], [0.1]), "block 1"),
        (lambda: Blocks([1.0], [0.1], gravity=np.inf), "gravity"),
    ],
)
def test_bad_arrays_of_blocks_are_refused(make, word):
    with pytest.raises(BlockError, match=word):
        make()


@pytest.mark.parametrize("factor", [0.0, -0.5, np.nextafter(1.0, 2.0), 2.0])
def test_a_restitution_outside_its_range_is_refused(factor):
    for make in (lambda: Block.from_parameters(2.0, 0.2, factor), lambda: Blocks([2.0], [0.2], [factor])):
        with pytest.raises(BlockError, match=r"restitution.* must be in \(0, 1\]"):
            make()


def test_sides_that_are_equal_but_for_rounding_are_those_of_a_rectangle():
    block = Block.from_parameters(p=(2.7, 2.7 * (1.0 + 1e-10)), alpha=(0.2, 0.2 * (1.0 - 3e-10)))
    assert [side.restitution for side in block.sides] == pytest.approx([1.0 - 1.5 * math.sin(0.2) ** 2] * 2, rel=1e-9)


@pytest.mark.parametrize("distances", [(0.3, 0.5), (0.5, 0.3)])
def test_parameters_of_two_sides_tell_the_body_that_has_them(distances):
    sides = Block.from_pivots(distances, 1.2, 0.8).sides
    found = Block.from_parameters(p=[side.p for side in sides], alpha=[side.alpha for side in sides])
    said = "body from its parameters, centre of mass 1.2 m high, radius of gyration 0.8 m"
    assert found.description.startswith(said)
    assert [side.radius for side in found.sides] == pytest.approx([math.hypot(b, 1.2) for b in distances], rel=1e-9)


def test_sizes_come_back_as_they_were_given():
    block = Block(width=0.4, height=2.0)
    assert (block.width, block.height, block.half_width, block.half_height) == (0.4, 2.0, 0.2, 1.0)
    assert Block.from_parameters(2.0, 0.2).width is None


def test_a_wrong_keyword_names_the_constructor_that_accepts_it():
    with pytest.raises(TypeError, match=r"^Block has no argument p; use Block.from_parameters$"):
        Block(p=2.0, alpha=0.2)
    with pytest.raises(TypeError, match=r"^Block has no argument size; see help\(rocking.Block\)$"):
        Block(size=2.0)
