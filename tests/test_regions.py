"""Maps of regions: what lies between two abscissae is drawn from what is known there, and nothing is invented."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rocking.plot.maps import draw_regions

LOW, HIGH = 0.0, 10.0


@st.composite
def columns(draw):
    edges = sorted(draw(st.lists(st.floats(0.1, 9.9), max_size=6, unique=True)))
    regions = [draw(st.integers(-3, 2))]
    for _ in edges:
        regions.append(draw(st.integers(-3, 2).filter(lambda region: region != regions[-1])))
    return [each for pair in zip(regions, [*edges, None], strict=True) for each in pair][:-1]


def areas(figure):
    """Area of each region that is drawn, in its order from the left and the lowest."""
    corners = [path.vertices for shape in figure.axes[0].collections for path in shape.get_paths()]
    return [0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) for x, y in (each.T for each in corners)]


@given(st.lists(columns(), min_size=2, max_size=5))
def test_all_regions_together_are_the_frame(drawn):
    found = np.array(areas(map_of(drawn)))
    assert np.all(found * np.sign(found.sum()) >= -1e-9)
    assert abs(found.sum()) == pytest.approx((HIGH - LOW) * (len(drawn) - 1))


def lines(figure):
    return [line.get_xydata().tolist() for line in figure.axes[0].lines]


def test_neighbours_that_are_alike_are_joined_straight():
    assert lines(map_of([[-1, 4.0, 0], [-1, 6.0, 0]])) == [[[0.0, 4.0], [1.0, 6.0]]]


def test_a_lobe_ends_in_a_tip_between_its_last_column_and_the_next():
    lower, upper, edge, beyond = lines(map_of([[-1, 2.0, 1, 4.0, -1, 8.0, 0], [-1, 9.0, 0]]))
    assert (lower, upper) == ([[0.0, 2.0], [0.5, 3.0]], [[0.0, 4.0], [0.5, 3.0]])
    assert (edge, beyond) == ([[0.0, 8.0], [0.5, 8.5]], [[0.5, 8.5], [1.0, 9.0]])


def test_the_lobe_that_goes_on_is_the_nearer_one():
    _, _, lower, upper, *_ = lines(map_of([[-1, 1.0, 1, 2.0, -1, 6.0, 1, 8.0, -1], [-1, 6.5, 1, 8.5, -1]]))
    assert (lower[-1], upper[-1]) == ([0.5, 6.25], [0.5, 8.25])


def map_of(columns, **options):
    names = {-3: "no uplift", -2: "rests", -1: "rocks"} | {k: f"overturns after {k}" for k in range(9)}
    return draw_regions(
        x=np.arange(len(columns), dtype=float),
        y_range=(LOW, HIGH),
        edges=[np.array(column[1::2]) for column in columns],
        regions=[column[::2] for column in columns],
        names=names,
        x_label="x",
        y_label="y",
        **options,
    )


def entries(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_legend_names_what_can_be_seen_and_nothing_else():
    assert entries(map_of([[-3, 5.0, 0]] * 2)) == ["no uplift", "overturns after 0"]
    speck = map_of([[-3, 5.0, 0], [-3, 5.0, 2, 5.0 + 1e-6, 0]])
    assert entries(speck) == ["no uplift", "overturns after 0"]
    many = map_of([[-3, 3.0, 4, 5.0, 7]] * 2)
    assert entries(many) == ["no uplift", "overturns after 4 or more"]
    assert entries(map_of([[-3, 3.0, 7]] * 2)) == ["no uplift", "overturns after 7"]
