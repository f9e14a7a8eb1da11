"""Efficiency of intensity measures: against closed forms of pulses and a sample of known dispersion."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

import rocking
from rocking import compare_measures
from rocking.analysis import efficiency
from rocking.core.constants import STANDARD_GRAVITY as G

SLENDER = rocking.Block.from_parameters(p=1.0, alpha=1e-3, restitution=0.5)
LENGTHS = np.array([0.3, 1.2, 4.8])


@pytest.fixture(scope="module")
def rectangles():
    pulses = [rocking.pulses.rectangular(1.0, length) for length in LENGTHS]
    return compare_measures(SLENDER, pulses, periods=[0.7], model="linear", rtol=1e-9)


def test_dispersions_are_those_of_the_closed_form_of_rectangular_pulses(rectangles):
    amplitude = G * 1e-3 / -np.expm1(-LENGTHS)
    names = {"PGA": amplitude, "PGV": amplitude * LENGTHS, "PGA / uplift acceleration": amplitude}
    for name, capacity in names.items():
        found = rectangles.data.sel(measure=name)
        assert float(found.dispersion) == pytest.approx(np.std(np.log(capacity), ddof=1), rel=1e-7)
        assert float(found.dispersion_of_all) == pytest.approx(float(found.dispersion), rel=1e-12)
    np.testing.assert_allclose(rectangles.data.intensity.sel(measure="PGA").values[:, 0], amplitude, rtol=1e-8)
    np.testing.assert_allclose(
        rectangles.data.intensity.sel(measure="p PGV / uplift acceleration").values[:, 0],
        amplitude * LENGTHS / (G * 1e-3),
        rtol=1e-8,
    )


def test_the_interval_is_that_of_a_normal_sample(rectangles):
    beta = rectangles.data.dispersion.values
    low, high = (np.sqrt(2.0 / chi2.ppf(share, 2)) for share in (0.95, 0.05))
    np.testing.assert_allclose(rectangles.data.dispersion_low.values, low * beta, rtol=1e-12)
    np.testing.assert_allclose(rectangles.data.dispersion_high.values, high * beta, rtol=1e-12)


@pytest.mark.slow
def test_a_measure_that_was_scattered_by_hand_gets_its_scatter_back():
    # The same pulse, each time with another sudden, harmless burst that only the peak acceleration sees.
    rng = np.random.default_rng(3)
    scatter = rng.lognormal(0.0, 0.4, 12)
    motions = []
    for factor in scatter:
        peak = 60.0 * factor
        motions.append(
            rocking.Motion.from_points(
                [0.0, 1e-5, 2e-5, 4e-5, 6e-5, 7e-5, 8e-5, 0.5, 1.0, 1.5],
                [0.0, peak, 0.0, -0.0, -0.0, -peak, 0.0, 0.0, 4.0, 0.0],
            )
        )
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2)
    found = compare_measures(block, motions, periods=[1.0], rtol=1e-6)
    expected = float(np.std(np.log(scatter), ddof=1))
    assert float(found.data.dispersion.sel(measure="PGA")) == pytest.approx(expected, rel=0.02)
    assert float(found.data.dispersion.sel(measure="PGV")) < 0.02
    assert found.summary().splitlines()[3].startswith(("PGV", "SA(1 s)", "p PGV"))


@pytest.mark.thorough
def test_a_measure_in_the_blocks_own_units_serves_blocks_of_all_sizes():
    blocks = [rocking.Block.from_parameters(p=p, alpha=0.1, restitution=0.6) for p in (1.0, 2.0, 4.0)]
    # Each pulse is short for every block, so that its velocity counts.
    pulses = [rocking.pulses.rectangular(1.0, length) for length in (0.005, 0.01, 0.02)]
    found = compare_measures(blocks, pulses, periods=[1.0], model="linear", rtol=1e-3)
    within, overall = found.data.dispersion.to_series(), found.data.dispersion_of_all.to_series()
    assert within["PGV"] == pytest.approx(within["p PGV / uplift acceleration"], rel=1e-9)
    assert overall["p PGV / uplift acceleration"] < 0.03 < 0.5 < overall["PGV"]
    assert "of all blocks" in found.summary()
    assert found.to_dict()["measures"][0]["unit"] == "m/s^2"


def test_what_cannot_be_compared_is_told_in_one_sentence():
    pulse = rocking.pulses.half_sine(1.0, 1.0)
    with pytest.raises(rocking.errors.OptionError, match="must contain at least two motions"):
        compare_measures(SLENDER, pulse)
    with pytest.raises(rocking.errors.OptionError, match="periods must be one or more positive"):
        compare_measures(SLENDER, [pulse, pulse], periods=[0.0])


def test_motions_of_a_cluster_count_as_one_in_the_intervals():
    # Three stations, two components each; the last is a multiple of the first, so that two clusters remain.
    pulses = [rocking.pulses.half_sine(1.0, f) for f in (0.5, 0.6, 1.0, 1.2, 1.4)]
    pulses.append(pulses[0].scaled(2.0))
    options = {"periods": [0.7], "model": "linear", "rtol": 1e-3}
    alone = compare_measures(SLENDER, pulses, **options)
    found = compare_measures(SLENDER, pulses, clusters=["a", "a", "b", "b", "c", "c"], **options)
    assert np.array_equal(found.data.dispersion, alone.data.dispersion)
    for compared, freedom in ((alone, 4), (found, 1)):
        ends = [math.sqrt(freedom / chi2.ppf(share, freedom)) for share in (0.95, 0.05)]
        assert compared.data.dispersion_low.values == pytest.approx(ends[0] * alone.data.dispersion.values, rel=1e-12)
        assert compared.data.dispersion_high.values == pytest.approx(ends[1] * alone.data.dispersion.values, rel=1e-12)
    assert "6 motions in 2 clusters" in found.summary() and "6 motions overturn" in alone.summary()
    with pytest.raises(rocking.errors.OptionError, match="fewer than two clusters overturn"):
        compare_measures(SLENDER, pulses, clusters=[0] * 6)


@pytest.mark.parametrize("slendernesses", [(0.12, 0.3), (0.12, 0.12)])
def test_reversed_motions_count_where_the_sides_of_a_block_differ(slendernesses):
    block = rocking.Block.from_parameters(p=2.0, alpha=slendernesses, restitution=0.9)
    up = rocking.pulses.one_sine(0.2, 2.0)
    pulses = [rocking.pulses.ricker(1.0, f).with_vertical(up) for f in (0.4, 0.6, 0.9)]
    options = {"periods": [1.0], "rtol": 1e-3}
    found = compare_measures(block, [*pulses, *(pulse.scaled(-1.0) for pulse in pulses)], **options)
    logarithms = np.log(found.data.intensity.sel(measure="PGA").values[:, 0])
    counts = logarithms if block.sides[0] != block.sides[1] else logarithms[:3]
    assert float(found.data.dispersion.sel(measure="PGA")) == pytest.approx(np.std(counts, ddof=1), rel=1e-12)
    assert float(found.data.median_intensity.sel(measure="PGA")) == pytest.approx(np.exp(counts.mean()), rel=1e-12)
    end = math.sqrt(2.0 / chi2.ppf(0.05, 2))  # three pulses, each as it is and reversed
    assert float(found.data.dispersion_high[0] / found.data.dispersion[0]) == pytest.approx(end, rel=1e-12)
    assert (np.ptp(logarithms.reshape(2, 3), axis=0).max() > 0.01) == (len(counts) == 6)


def test_dispersions_of_several_blocks_are_written_out_sums(monkeypatch):
    """Weights 3 and 1, and a motion that does not overturn the second block: every sum written out."""
    blocks = [rocking.Block.from_parameters(p=p, alpha=0.2, restitution=0.9) for p in (1.5, 3.0)]
    motions = [rocking.pulses.one_sine(1.0, f) for f in (0.4, 0.7, 1.0)]
    search = efficiency.incremental_dynamic_analysis

    def without_one(*given, **options):
        scaled = search(*given, **options)
        level = scaled.data.overturning_level
        level[{"motion": 2, "block": 1}] = math.nan
        assert int(level.isnull().sum()) == 1
        return scaled

    monkeypatch.setattr(efficiency, "incremental_dynamic_analysis", without_one)
    found = compare_measures(blocks, motions, periods=[1.0], weights=[3.0, 1.0], rtol=1e-2)
    for k, values in enumerate(found.data.intensity.values):
        x = np.log(values)
        assert np.isnan(x).tolist() == [[False, False], [False, False], [False, True]]
        first, second = x[:, 0], x[:2, 1]
        shares = 1.5, 0.5  # 1 in the mean of the blocks
        squares = [float(np.sum((one - one.mean()) ** 2)) for one in (first, second)]
        own = math.sqrt((shares[0] * squares[0] + shares[1] * squares[1]) / (shares[0] * 2.0 + shares[1] * 1.0))
        mean = (shares[0] * first.sum() + shares[1] * second.sum()) / (3 * shares[0] + 2 * shares[1])
        total = shares[0] * np.sum((first - mean) ** 2) + shares[1] * np.sum((second - mean) ** 2)
        one = found.data.isel(measure=k)
        assert float(one.median_intensity) == pytest.approx(math.exp(mean), rel=1e-13)
        assert float(one.dispersion) == pytest.approx(own, rel=1e-12)
        assert float(one.dispersion_of_all) == pytest.approx(
            math.sqrt(total / (shares[0] * 2.0 + shares[1] * 1.0)), rel=1e-12
        )
        # Two motions remain that both blocks share: one degree of freedom, and no more.
        ends = [math.sqrt(1.0 / chi2.ppf(share, 1)) * own for share in (0.95, 0.05)]
        assert [float(one.dispersion_low), float(one.dispersion_high)] == pytest.approx(ends, rel=1e-12)
    assert found.data.sizes["measure"] == 5
    assert "left out: 1 pair of block and motion" in found.summary()


def test_spectral_accelerations_of_other_damping_than_5_percent_have_another_name():
    pulses = [rocking.pulses.one_sine(1.0, f) for f in (0.5, 0.8)]
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    for damping, name in ((0.05, "SA(1 s)"), (0.02, "SA(1 s, damping 0.02)"), (0, "SA(1 s, damping 0)")):
        found = compare_measures(block, pulses, periods=[1.0], damping=damping, rtol=1e-2)
        assert found.to_dict()["measures"][2]["measure"] == name
        assert name in found.summary()
        assert found.to_dict()["damping"] == damping


@pytest.mark.thorough
def test_multiples_of_a_motion_count_once(rectangles):
    pulses = [rocking.pulses.rectangular(*one) for one in ((1.0, LENGTHS[0]), *((2.5, length) for length in LENGTHS))]
    found = compare_measures(SLENDER, pulses, periods=[0.7], model="linear", rtol=1e-9)
    for name in ("median_intensity", "dispersion", "dispersion_low", "dispersion_high", "dispersion_of_all"):
        np.testing.assert_allclose(found.data[name].values, rectangles.data[name].values, rtol=1e-7)
    with pytest.raises(rocking.errors.OptionError, match="not multiples of one another"):
        compare_measures(SLENDER, pulses[:2], model="linear")
