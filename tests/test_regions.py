"""Maps of regions: what lies between two abscissae is drawn from what is known there, and nothing is invented."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rocking.plot.boundaries import Stack, meeting, runs
from rocking.plot.maps import regions_figure

LOW, HIGH = 0.0, 10.0


def stack(*edges_and_regions) -> Stack:
    """Regions and the boundaries between them, from the lowest region on."""
    return Stack(np.array([LOW, *edges_and_regions[1::2], HIGH]), tuple(edges_and_regions[::2]))


@st.composite
def stacks(draw) -> Stack:
    count = draw(st.integers(0, 6))
    edges = sorted(draw(st.lists(st.floats(0.1, 9.9), min_size=count, max_size=count, unique=True)))
    regions = [draw(st.integers(-3, 2))]
    for _ in range(count):
        regions.append(draw(st.integers(-3, 2).filter(lambda region: region != regions[-1])))
    return Stack(np.array([LOW, *edges, HIGH]), tuple(regions))


@given(stacks(), stacks())
@example(
    stack(-1, 0.5, 2, 1.0, 0, 2.0, -1, 3.0, 1, 4.0, 0),
    stack(-1, 1.0, 0, 1.5, 1, 2.0, 0, 2.5, 1, 3.0, 0),
)
def test_half_way_both_sides_fill_the_frame_in_order(left, right):
    halves = list(meeting(left, right))
    assert len(halves) == 2
    for levels in halves:
        assert levels[0] == LOW
        assert levels[-1] == HIGH
        assert np.all(np.diff(levels) >= 0.0)


@given(st.lists(stacks(), min_size=2, max_size=5))
def test_all_regions_together_are_the_frame(columns):
    x = np.arange(len(columns), dtype=float)
    area = sum(np.trapezoid(np.diff(levels, axis=0).sum(axis=0), at) for at, levels, _ in runs(x, columns))
    assert area == pytest.approx((HIGH - LOW) * x[-1])
    ends = [(at[0], at[-1]) for at, _, _ in runs(x, columns)]
    assert ends[0][0] == 0.0
    assert ends[-1][1] == x[-1]
    assert all(end == start for (_, end), (start, _) in pairwise(ends))


@given(stacks())
def test_neighbours_that_are_alike_are_joined_straight(column):
    higher = Stack(np.where(column.level % HIGH > 0.0, 0.5 * (column.level + HIGH), column.level), column.region)
    left, right = meeting(column, higher)
    np.testing.assert_allclose(left, 0.5 * (column.level + higher.level))
    np.testing.assert_array_equal(left, right)


def test_a_lobe_ends_in_a_tip_between_its_last_column_and_the_next():
    left, right = meeting(stack(-1, 2.0, 1, 4.0, -1, 8.0, 0), stack(-1, 8.0, 0))
    np.testing.assert_allclose(left, [0.0, 3.0, 3.0, 8.0, 10.0])
    np.testing.assert_allclose(right, [0.0, 8.0, 10.0])


def test_the_lobe_that_goes_on_is_the_nearer_one():
    left, right = meeting(stack(-1, 1.0, 1, 2.0, -1, 6.0, 1, 8.0, -1), stack(-1, 6.5, 1, 8.5, -1))
    np.testing.assert_allclose(left[3:5], right[1:3])
    np.testing.assert_allclose(left[3:5], [6.25, 8.25])
    assert left[1] == left[2]


def test_a_region_between_two_others_begins_at_the_boundary_between_them():
    left, right = meeting(stack(-1, 5.0, 0), stack(-1, 4.0, 2, 7.0, 0))
    np.testing.assert_allclose(left, [0.0, 5.25, 10.0])
    np.testing.assert_allclose(right, [0.0, 5.25, 5.25, 10.0])


def test_regions_in_each_other_s_place_meet_at_an_upright_line():
    left, right = meeting(stack(-1, 2.0, 1, 4.0, -1), stack(-1, 3.0, 2, 5.0, -1))
    np.testing.assert_allclose(left, [0.0, 2.5, 4.5, 10.0])
    np.testing.assert_array_equal(left, right)
    left, right = meeting(stack(-3, 2.0, -2), stack(0, 5.0, 1))
    np.testing.assert_allclose([left[1], right[1]], [2.0, 5.0])


def test_a_region_that_both_sides_have_goes_on_where_its_neighbours_change():
    left, right = meeting(stack(-3, 2.0, -2, 3.0, -1, 8.0, 0), stack(-3, 2.0, -1, 8.0, 1, 9.0, 0))
    np.testing.assert_allclose(left, [0.0, 2.25, 2.25, 8.25, 10.0])
    np.testing.assert_allclose(right, [0.0, 2.25, 8.25, 8.25, 10.0])


def test_a_boundary_leaves_the_frame_straight():
    columns = [stack(-1, 5.0, 0), stack(-1, 7.0, 0), stack(-1)]
    (at, levels, _), (_, other, _) = runs(np.arange(3.0), columns)
    np.testing.assert_allclose(at, [0.0, 1.0, 1.5])
    np.testing.assert_allclose(levels[1], [5.0, 7.0, 8.0])
    np.testing.assert_allclose(other, [[0.0, 0.0], [10.0, 10.0]])
    _, (at, levels, _) = runs(np.arange(3.0), [stack(0), stack(-1, 1.0, 0), stack(-1, 5.0, 0)])
    np.testing.assert_allclose(at, [0.5, 1.0, 2.0])
    np.testing.assert_allclose(levels[1], [0.0, 1.0, 5.0])


def map_of(columns, **options):
    names = {-3: "no uplift", -2: "rests", -1: "rocks"} | {k: f"overturns after {k}" for k in range(9)}
    return regions_figure(
        x=np.arange(len(columns), dtype=float),
        y_range=(LOW, HIGH),
        edges=[column.level[1:-1] for column in columns],
        regions=[column.region for column in columns],
        names=names,
        x_label="x",
        y_label="y",
        **options,
    )


def entries(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_legend_names_what_can_be_seen_and_nothing_else():
    assert entries(map_of([stack(-3, 5.0, 0)] * 2)) == ["no uplift", "overturns after 0"]
    speck = map_of([stack(-3, 5.0, 0), stack(-3, 5.0, 2, 5.0 + 1e-6, 0)])
    assert entries(speck) == ["no uplift", "overturns after 0"]
    many = map_of([stack(-3, 3.0, 4, 5.0, 7)] * 2)
    assert entries(many) == ["no uplift", "overturns after 4 or more"]
    assert entries(map_of([stack(-3, 3.0, 7)] * 2)) == ["no uplift", "overturns after 7"]
