"""Two-sided blocks: the rigid body behind p and alpha, its restitution, and rectangles off their middle."""

import itertools
import math
import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from oracles.rigid_body import Piece, sides_of

from rocking import Block, Blocks
from rocking.errors import BlockError

NAMES = ("p", "alpha", "restitution")
lengths = st.floats(0.05, 5.0)


def both(block, name):
    return [getattr(side, name) for side in block.sides]


def of_two_densities(width, height, left, right):
    """A prism whose left and right halves have these densities."""
    half = mpf(width) / 2
    pieces = [Piece(-half, mpf(0), mpf(0), mpf(height), left), Piece(mpf(0), half, mpf(0), mpf(height), right)]
    return sides_of(pieces, -half, half), half / 2 * (mpf(right) - left) / (mpf(right) + left)


@given(lengths, st.floats(1.2, 8.0), st.floats(0.0, 5.0), st.floats(0.01, 5.0))
@settings(deadline=None)
def test_a_rectangle_with_an_offset_is_a_prism_of_two_densities(width, slender, left, right):
    truth, offset = of_two_densities(width, width * slender, left, right)
    assume(min(truth.restitution) > 0.0)
    block = Block(width=width, height=width * slender, offset=float(offset))
    for name in NAMES:
        assert [getattr(side, name) for side in block.sides] == pytest.approx(
            [float(value) for value in getattr(truth, name)], rel=1e-13
        ), name


def test_a_density_that_grows_along_the_width_has_the_same_moment_of_inertia():
    # Of 400 strips; the rectangle with the same offset differs by what strips leave of a straight line.
    width, height, strips = mpf("0.6"), mpf("1.8"), 400
    edges = [-width / 2 + width * k / strips for k in range(strips + 1)]
    pieces = [Piece(a, b, mpf(0), height, 1 + mpf("0.9") * (a + b) / width) for a, b in itertools.pairwise(edges)]
    truth = sides_of(pieces, -width / 2, width / 2)
    block = Block(width=0.6, height=1.8, offset=0.9 * 0.6 / 6.0)
    for name in NAMES:
        found = [getattr(side, name) for side in block.sides]
        assert found == pytest.approx([float(v) for v in getattr(truth, name)], rel=3e-6)


@pytest.mark.parametrize(
    ("p", "alpha", "restitution"),
    [
        ((2.9858, 3.0053), (0.27417, 0.155), (0.950255, 0.913887)),
        ((3.0053, 2.9858), (0.155, 0.27417), (0.913887, 0.950255)),
        ((3.0, 3.0), (0.1, 0.2), (0.970274, 0.985062)),  # the body whose k^2 is R+ R-
        ((2.0, 2.0), (0.2, 0.2), (0.940796, 0.940796)),  # equal sides: the rectangle
    ],
)
def test_two_sides_take_the_restitution_of_the_body_that_has_their_p_and_alpha(p, alpha, restitution):
    block = Block.from_parameters(p, alpha)
    assert [side.restitution for side in block.sides] == pytest.approx(restitution, abs=1e-6)
    assert Blocks([p, p], [alpha, alpha]).restitution == pytest.approx(np.array([restitution] * 2), abs=1e-6)
    assert Blocks([p], [alpha])[0] == block
    if alpha[0] != alpha[1]:
        # Solved to 40 digits, without the formulas of the package.
        with mp.workdps(40):
            g = mpf("9.80665")
            cosines, squares = [mp.cos(mpf(a)) for a in alpha], [mpf(x) ** 2 for x in p]
            height, square = mp.findroot(
                lambda h, kk: [g * h / c / pp - kk - (h / c) ** 2 for c, pp in zip(cosines, squares, strict=True)],
                (block.sides[0].radius * math.cos(alpha[0]), 0.2),
            )
            found = Block.from_pivots(
                [float(height * mp.tan(mpf(a))) for a in alpha], float(height), float(mp.sqrt(square))
            )
        for name in (*NAMES, "radius"):
            for one, other in zip(block.sides, found.sides, strict=True):
                assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-12), name


@given(lengths, st.floats(0.05, 0.6), st.floats(0.05, 0.6), st.floats(0.05, 3.0))
@settings(deadline=None)
def test_a_body_is_found_again_from_its_p_and_alpha(height, plus, minus, gyration):
    assume(abs(plus - minus) > 1e-3)
    try:
        body = Block.from_pivots((plus * height, minus * height), height, gyration * height)
    except BlockError:
        return
    again = Block.from_parameters(both(body, "p"), both(body, "alpha"))
    for name in (*NAMES, "radius"):
        assert both(again, name) == pytest.approx(both(body, name), rel=1e-7), name
    assert both(Blocks.from_bodies([body])[0], "radius") == pytest.approx(both(body, "radius"), rel=1e-7)
    assert again.description.startswith("body from its parameters, centre of mass ")


@pytest.mark.parametrize(
    ("p", "alpha", "words"),
    [
        ((3.0, 3.1), (0.2, 0.2), "p = 3 and 3.1 rad/s on sides of alpha = 0.2 and 0.2 rad"),
        ((2.5, 2.2), (0.12, 0.2), "its p must differ by less than 0.65 %, not by 14 %"),
        ((3.0, 2.9), (0.2, 0.201), "its p must differ by less than 0.0[0-9]+ %, not by 3.4 %"),
        ((3.0, 3.001), (0.05, 0.04), "its p must differ by less than 0.023 %, not by 0.033 %"),
        ((1.0, 1.05), (1.2, 1.1), "too stocky"),
    ],
)
def test_sides_that_are_those_of_no_body_are_refused_and_the_restitution_is_asked_for(p, alpha, words):
    for make in (lambda: Block.from_parameters(p, alpha), lambda: Blocks([(2.0, 2.0), p], [(0.2, 0.2), alpha])):
        with pytest.raises(BlockError, match=r"set restitution to a value( or a pair)? in \(0, 1\]") as caught:
            make()
        assert caught.value.argument == "restitution"
        if "stocky" not in words:
            assert re.search(words, str(caught.value)), str(caught.value)
    assert both(Block.from_parameters(p, alpha, (0.9, 0.8)), "restitution") == [0.9, 0.8]


def test_sides_that_are_equal_but_for_rounding_are_those_of_a_rectangle():
    nearly = Block.from_parameters((2.0, 2.0000000000000004), (0.2, 0.20000000000000001))
    assert both(nearly, "restitution") == pytest.approx([1.0 - 1.5 * math.sin(0.2) ** 2] * 2, abs=1e-15)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Block(width=0.4, height=2.0, offset=0.11), "offset must be at most a quarter of the width, 0.1 m"),
        (lambda: Block(width=0.4, height=2.0, offset=math.nan), "offset"),
        (lambda: Block(width=0.4, height=2.0, offset="0.1"), "offset"),
    ],
)
def test_offsets_lie_within(make, words):
    with pytest.raises(BlockError, match=words):
        make()


def test_the_side_to_which_the_mass_lies_is_the_more_slender_one():
    block = Block(width=0.4, height=2.0, offset=0.05)
    assert both(block, "alpha") == pytest.approx([math.atan2(0.15, 1.0), math.atan2(0.25, 1.0)], rel=1e-15)
    assert block.offset == 0.05 and (block.half_width, block.half_height) == (0.2, 1.0)
    assert both(Block(width=0.4, height=2.0, offset=-0.05), "alpha") == both(block, "alpha")[::-1]
    assert Block(width=0.4, height=2.0, offset=0.0) == Block(width=0.4, height=2.0)
    assert "0.05 m off its middle to side +" in str(block)
