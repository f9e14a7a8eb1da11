"""Rocking spectra: what `simulate` says, fractiles over blocks that overturn, equal displacements of similar blocks."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import rocking
from rocking.analysis.spectrum import compute_fractiles, compute_weighted_fractiles, rocking_spectrum

PULSES = [rocking.pulses.one_sine(5.0, frequency) for frequency in (0.5, 0.8, 1.3, 2.0)]


@pytest.fixture(scope="module")
def spectrum():
    return rocking_spectrum(rocking.Blocks.grid(alpha=[0.1, 0.2], p=[1.0, 2.0, 4.0], restitution=[0.8, 0.9]), PULSES)


def test_every_peak_is_the_one_of_its_block_and_motion(spectrum):
    assert spectrum.data.peak_rotation.dims == ("motion", "alpha", "restitution", "p")
    for m, motion in enumerate(PULSES):
        for alpha, e, p in ((0.1, 0.9, 2.0), (0.2, 0.8, 4.0), (0.2, 0.9, 1.0)):
            block = rocking.Block.from_parameters(p, alpha, e)
            response = rocking.simulate(block, motion)
            cell = spectrum.data.isel(motion=m).sel(alpha=alpha, restitution=e, p=p)
            assert float(cell.peak_rotation) == pytest.approx(response.peak_rotation, rel=1e-9)
            assert bool(cell.overturned) == response.overturned
            over = math.inf if response.overturned else response.peak_rotation / alpha
            assert float(cell.peak_over_alpha) == pytest.approx(over, rel=1e-9)


def test_an_overturned_block_counts_as_infinitely_large(spectrum):
    cell = spectrum.data.sel(alpha=0.2, restitution=0.9, p=1.0)
    peaks = np.sort(cell.peak_over_alpha.values.ravel())
    assert np.isfinite(peaks).sum() == 3
    # Fractiles stand between the 1st and 2nd, the 2nd and 3rd, and the 3rd and 4th of four peaks.
    low, middle, high = cell.fractile_over_alpha.values
    assert low == pytest.approx(peaks[0] + 0.16 * 3 * (peaks[1] - peaks[0]), rel=1e-12)
    assert middle == pytest.approx(0.5 * (peaks[1] + peaks[2]), rel=1e-12)
    assert high == math.inf
    assert float(cell.overturned_share) == 0.25


def test_housners_restitution_goes_with_each_slenderness():
    result = rocking_spectrum(rocking.Blocks.grid(alpha=[0.1, 0.3], p=[2.0]), PULSES[2])
    assert "restitution" not in result.data.dims
    for alpha in (0.1, 0.3):
        response = rocking.simulate(rocking.Block.from_parameters(2.0, alpha), PULSES[2])
        assert float(result.data.peak_rotation.sel(alpha=alpha, p=2.0)[0]) == pytest.approx(
            response.peak_rotation, rel=1e-9
        )


def test_sizes_are_half_diagonals_of_rectangles():
    block = rocking.Block(half_width=0.2, half_height=1.0)
    result = rocking_spectrum(rocking.Blocks.grid(alpha=block.alpha, size=[block.radius]), PULSES[3])
    assert float(result.data.p[0]) == pytest.approx(block.p, rel=1e-14)
    assert float(result.data["size"][0]) == pytest.approx(block.radius, rel=1e-14)
    assert float(result.data.period[0]) == pytest.approx(2.0 * math.pi / block.p, rel=1e-14)
    response = rocking.simulate(block, PULSES[3])
    assert result.data.peak_rotation.values.item() == pytest.approx(response.peak_rotation, rel=1e-9)


def test_large_similar_blocks_have_equal_displacements():
    # R theta'' = -(3/4) (g sin(alpha - theta) + a cos(alpha - theta)): as R grows theta vanishes beside alpha, and
    # R theta obeys an equation without R. What differs falls as theta does, in proportion to 1/R.
    record = rocking.records.load("el-centro-meloland-270")
    sizes = [80.0, 160.0, 320.0, 640.0, 1280.0]
    result = rocking_spectrum(rocking.Blocks.grid(alpha=[0.1, 0.2], size=sizes, restitution=[0.9]), record)
    displacement = (result.data.peak_rotation * result.data["size"]).isel(motion=0, restitution=0).values
    steps = np.abs(np.diff(displacement, axis=1))
    assert np.all(steps[:, -1] < 0.005 * displacement[:, -1])
    np.testing.assert_allclose(steps[:, -2:] / steps[:, -3:-1], 0.5, atol=0.03)


@given(arrays(float, (7, 3), elements=st.floats(0.0, 1e6)), st.lists(st.floats(0.01, 0.99), min_size=1, max_size=4))
def test_finite_fractiles_are_interpolated_linearly(values, shares):
    shares = np.array(shares)
    expected = np.quantile(values, shares, axis=0)
    np.testing.assert_allclose(compute_fractiles(values, shares), expected, rtol=1e-12, atol=1e-9)


@example(8, 18, Fraction(28, 100))  # 0.28 * 25 is more than 7 in floating point
@given(st.integers(1, 30), st.integers(0, 30), st.fractions(0, 1, max_denominator=1000))
def test_a_fractile_is_infinite_where_the_value_at_it_or_next_above_is(finite, infinite, share):
    values = np.concatenate([np.arange(finite, dtype=float), np.full(infinite, np.inf)])[:, None]
    place = share * (finite + infinite - 1)
    (result,) = compute_fractiles(values, np.array([float(share)]))[:, 0]
    assert math.isinf(result) == (math.ceil(place) >= finite)
    assert not math.isnan(result)


def test_the_figure_draws_fractiles_and_leaves_out_what_overturns(spectrum):
    few = spectrum.select(restitution=0.9)
    figure = few.plot(abscissa="size")
    peaks, shares = figure.axes
    thick = [line for line in peaks.lines if line.get_linewidth() > 1.5 and len(line.get_xdata())]
    assert len(thick) == 2
    expected = few.data.fractile_over_alpha.sel(fractile=0.5, alpha=0.2, restitution=0.9).values
    np.testing.assert_array_equal(thick[1].get_ydata(), np.where(np.isinf(expected), np.nan, expected))
    np.testing.assert_array_equal(thick[1].get_xdata(), few.data["size"].values)
    drawn = shares.lines[0].get_ydata()
    np.testing.assert_array_equal(drawn, few.data.overturned_share.sel(alpha=0.1, restitution=0.9).values)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"p": None}, "give either p "),
        ({"size": [1.0]}, "give either p .*, not both"),
        ({"fractiles": [1.0]}, "fractiles"),
        ({"motions": []}, "at least one motion"),
    ],
)
def test_what_makes_no_spectrum_is_refused(changes, word):
    arguments = {"motions": PULSES, "alpha": [0.2], "p": [2.0]} | changes
    grid = {name: arguments.pop(name) for name in ("alpha", "p", "size", "restitution") if name in arguments}
    with pytest.raises(rocking.RockingError, match=word):
        rocking_spectrum(rocking.Blocks.grid(**grid), arguments.pop("motions"), **arguments)


def test_a_figure_shows_any_number_of_curves_and_names_some_of_many(spectrum):
    for count in (5, 11):
        slendernesses = np.linspace(0.1, 0.3, count)
        found = rocking_spectrum(rocking.Blocks.grid(alpha=slendernesses, p=[2.0, 3.0]), PULSES).plot()
        peaks, shares = found.axes
        assert len(peaks.lines) >= count and len(shares.lines) == count
        assert len({str(line.get_color()) for line in shares.lines}) == count
        named = [text.get_text() for text in found.legends[0].get_texts() if "alpha" in text.get_text()]
        assert len(named) == min(count, 8)
        assert named[0].startswith("alpha = 0.1 ") and named[-1].startswith("alpha = 0.3 ")
    with pytest.raises(rocking.errors.OptionError, match="abscissa"):
        spectrum.plot(abscissa="height")


@given(
    arrays(float, st.integers(1, 9), elements=st.sampled_from([0.5, 1.0, 2.0, math.inf])),
    st.data(),
    st.floats(0.01, 0.99),
)
def test_a_weight_counts_as_often_as_it_says(values, data, share):
    counts = data.draw(arrays(int, values.shape, elements=st.integers(1, 4)))
    repeated = np.sort(np.repeat(values, counts))
    expected = repeated[math.ceil(share * len(repeated) * (1.0 - 1e-12)) - 1]
    assert compute_weighted_fractiles(values, counts.astype(float), np.array([share]))[0] == expected


def test_an_ensemble_of_one_block_has_the_spectrum_of_its_shape():
    motions = [rocking.pulses.one_sine(4.0, f) for f in (0.5, 1.0, 2.0)]
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    p = [1.0, 2.0, 3.0]
    grid = rocking_spectrum(rocking.Blocks.grid(alpha=[0.2], restitution=[0.9], p=p), motions)
    ensemble = rocking_spectrum(block, motions, p=p)
    assert ensemble.data.peak_rotation.values[:, 0] == pytest.approx(grid.data.peak_rotation.values[:, 0, 0], rel=1e-12)
    assert ensemble.data.overturned_share.values.tolist() == grid.data.overturned_share.values[0, 0].tolist()
    assert ensemble.plot().axes
    with pytest.raises(rocking.errors.BlockError, match=r"give either p .*, not both"):
        rocking_spectrum(block, motions, p=p, size=[1.0])


def test_a_grid_that_is_moved_or_weighted_is_an_ensemble():
    grid = rocking.Blocks.grid(p=[2.0, 3.0], alpha=[0.1, 0.2], restitution=0.9)
    assert [*grid.axes] == ["p", "alpha", "restitution"] and grid.select(slice(2)).axes is None
    assert dict(rocking_spectrum(grid, PULSES[0]).data.peak_rotation.sizes) == {
        "motion": 1, "alpha": 2, "restitution": 1, "p": 2,
    }  # fmt: skip
    for options in ({"p": [1.0]}, {"size": [1.0]}, {"weights": [1.0, 1.0, 2.0, 2.0]}):
        assert rocking_spectrum(grid, PULSES[0], **options).data.sizes["block"] == 4


def test_peaks_of_asymmetric_blocks_count_in_their_smaller_slenderness():
    block, p = rocking.Block.from_parameters(p=2.0, alpha=(0.2, 0.3), restitution=0.8), [2.0, 3.0]
    found = rocking_spectrum([block], [rocking.pulses.one_sine(2.5, 1.5), rocking.pulses.one_sine(-3.0, 2.0)], p=p)
    judged = 0
    for over, peak, overturned in zip(
        found.data.peak_over_alpha.values.ravel(),
        found.data.peak_rotation.values.ravel(),
        found.data.overturned.values.ravel(),
        strict=True,
    ):
        assert over == (math.inf if overturned else pytest.approx(peak / 0.2, rel=1e-12))
        judged += not overturned
    assert judged >= 2


@pytest.mark.parametrize("scale", [5e-324, 1e-300, 1e308])
def test_weights_count_over_each_other_however_large_or_small(scale):
    blocks = rocking.Blocks(p=[2.0, 3.0, 4.0], alpha=0.2, restitution=0.9)
    found = rocking_spectrum(blocks, PULSES[0], p=[2.0], weights=scale * np.array([1.0, 1.0, 0.0]))
    assert found.data.weight.values.tolist() == [1.5, 1.5, 0.0]


def test_a_line_goes_along_its_abscissa_in_whatever_order_p_was_given():
    def lines(p):
        found = rocking_spectrum(rocking.Blocks.grid(alpha=[0.1, 0.2], p=p, restitution=[0.9]), PULSES)
        return [line.get_xydata() for axes in found.plot().axes for line in axes.get_lines()]

    sorted_, mixed = lines([1.0, 2.0, 4.0]), lines([4.0, 1.0, 2.0])
    assert len(mixed) == len(sorted_) > 4
    for one, other in zip(sorted_, mixed, strict=True):
        np.testing.assert_array_equal(one, other)
