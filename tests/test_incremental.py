"""Incremental dynamic analysis: bands of overturning, their ends, measures, and what must be refused."""

import math

import numpy as np
import pytest

import rocking
from rocking.analysis.incremental import incremental_dynamic_analysis
from rocking.block import Blocks

BLOCK = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
PULSE = rocking.pulses.one_sine(1.0, 5.0 / math.pi)


@pytest.fixture(scope="module")
def record():
    return rocking.records.load("ridgecrest-clc-360").processed(trim=(225.0, 255.0))


@pytest.fixture(scope="module")
def analysis(record):
    blocks = [
        rocking.Block(width=0.24, height=1.1),
        rocking.Block.from_parameters((2.5, 3.0), (0.15, 0.2), (0.85, 0.9)),
    ]
    return blocks, incremental_dynamic_analysis(blocks, [record, PULSE], measure="pgv")


def bands(dataset, motion=0, block=0):
    mine = (dataset.data.band_motion.values == motion) & (dataset.data.band_block.values == block)
    return np.column_stack([dataset.data.band_start.values[mine], dataset.data.band_end.values[mine]])


def test_a_pulse_overturns_in_two_bands_that_a_map_finds_as_well():
    dataset = incremental_dynamic_analysis(BLOCK, PULSE, measure="pga_ratio")
    grid = {"amplitudes": np.linspace(0.5, 10.0, 30), "frequencies": [5.0]}
    edges = rocking.overturning_map(BLOCK, "one-sine", **grid).data.boundary_amplitude.values[-3:]
    (start, end), (again, never) = bands(dataset)
    np.testing.assert_allclose([start, end, again], edges, rtol=1e-6)
    assert math.isnan(never)
    assert float(dataset.data.overturning_level[0, 0]) == start


def both_verdicts_are_near(body, motion, level, measure):
    """Whether both come within the tolerance of a level; under a record bands have thinner ones beside them."""
    shifts = sorted(np.linspace(-5e-7, 5e-7, 11), key=abs, reverse=True)
    scaled = (motion.scaled_to(level * (1.0 + shift), measure) for shift in shifts)
    return len({rocking.simulate(body, one).overturned for one in scaled}) == 2


def test_the_ends_of_every_band_are_where_the_verdict_changes(analysis, record):
    blocks, dataset = analysis
    assert dataset.data.sizes["band"] > 4
    judged = 0
    for m, motion in enumerate((record, PULSE)):
        for k, block in enumerate(blocks):
            for start, end in bands(dataset, m, k):
                for level in (start, end):
                    if not math.isnan(level):
                        assert both_verdicts_are_near(block, motion, level, "pgv")
                        judged += 1
    assert judged > 4


def test_blocks_keep_their_order_though_each_is_simulated_in_its_own_unit():
    blocks = Blocks(p=2.0, alpha=[0.2, 0.3, 0.1], restitution=0.9)
    options = {"measure": "pga_ratio", "levels": np.linspace(1.0, 8.0, 8), "rtol": 1e-3}
    together = incremental_dynamic_analysis(blocks, PULSE, **options).data.overturning_level.values[0]
    alone = [incremental_dynamic_analysis(block, PULSE, **options).data.overturning_level.item() for block in blocks]
    assert len({*alone}) == 3
    assert together == pytest.approx(alone, rel=1e-12)


def test_the_bands_hold_the_levels_that_overturn_and_no_others(analysis):
    _, dataset = analysis
    seen = []
    for m in range(2):
        for k in range(2):
            inside = np.zeros(dataset.data.sizes["level"], dtype=bool)
            for start, end in bands(dataset, m, k):
                inside |= (dataset.data.level.values >= start) & ~(dataset.data.level.values >= end)
            fell = dataset.data.overturned.isel(motion=m, block=k).values
            np.testing.assert_array_equal(inside, fell)
            seen += fell.tolist()
    assert min(seen.count(True), seen.count(False)) > 20


def test_peaks_are_those_of_the_scaled_motion(analysis, record):
    blocks, dataset = analysis
    level = float(dataset.data.level[20])
    for k, block in enumerate(blocks):
        response = rocking.simulate(block, record.scaled_to(level, "pgv"))
        cell = dataset.data.isel(motion=0, level=20, block=k)
        assert float(cell.peak_rotation) == pytest.approx(response.peak_rotation, rel=1e-9)
        smaller = min(side.alpha for side in block.sides)
        expected = math.inf if response.overturned else response.peak_rotation / smaller
        assert float(cell.peak_over_alpha) == pytest.approx(expected, rel=1e-9)


def test_without_levels_they_go_from_the_first_uplift_to_twice_the_first_overturning(analysis, record):
    blocks, dataset = analysis
    uplift = np.inf
    for motion in (record, PULSE):
        ground = motion.acceleration(np.union1d(motion.breakpoints, np.linspace(0.0, motion.duration, 200_001)))
        for block in blocks:
            plus, minus = block.uplift_thresholds()
            factor = min(plus / -ground.min(), minus / ground.max())
            uplift = min(uplift, factor * motion.pgv)
    assert float(dataset.data.level[0]) == pytest.approx(uplift, rel=1e-9)
    assert not dataset.data.overturned.isel(level=0).any()
    assert float(dataset.data.level[-1]) >= 2.0 * float(dataset.data.overturning_level.max())
    np.testing.assert_allclose(dataset.data.level.values[1:] / dataset.data.level.values[:-1], 1.05, rtol=1e-12)


@pytest.fixture(scope="module")
def by_acceleration():
    blocks = [BLOCK, rocking.Block.from_parameters(p=3.0, alpha=0.15, restitution=0.9)]
    return blocks, incremental_dynamic_analysis(blocks, PULSE, measure="pga")


@pytest.mark.cases(fast=2)
@pytest.mark.parametrize(
    ("measure", "units"),
    [
        pytest.param("pga", lambda block, motion: motion.pga, marks=pytest.mark.thorough),
        pytest.param("pgv", lambda block, motion: motion.pgv, marks=pytest.mark.thorough),
        (rocking.Measure("sa", period=0.5), lambda block, motion: motion.spectral_acceleration(0.5)),
        pytest.param(
            "pga_ratio", lambda block, motion: motion.pga / min(block.uplift_thresholds()), marks=pytest.mark.thorough
        ),
        ("pgv_ratio", lambda block, motion: motion.pgv * block.p / min(block.uplift_thresholds())),
    ],
)
def test_every_measure_finds_the_same_factor(by_acceleration, measure, units):
    blocks, reference = by_acceleration
    dataset = incremental_dynamic_analysis(blocks, PULSE, measure=measure)
    assert np.isfinite(reference.data.overturning_level.values).sum() == len(blocks)
    for k, block in enumerate(blocks):
        factor = float(dataset.data.overturning_level[0, k]) / units(block, PULSE)
        assert factor == pytest.approx(float(reference.data.overturning_level[0, k]) / PULSE.pga, rel=2e-6)


def test_given_levels_that_begin_or_end_in_a_band_leave_it_open():
    dataset = incremental_dynamic_analysis(BLOCK, PULSE, measure="pga_ratio", levels=[4.0, 5.0, 6.8, 8.0])
    (first, end), (start, last) = bands(dataset)
    assert math.isnan(first)
    assert math.isnan(last)
    assert end < 6.8 < start
    assert np.isnan(dataset.data.overturning_level.values).all()
    safe = incremental_dynamic_analysis(BLOCK, PULSE, measure="pga_ratio", levels=[1.0, 2.0])
    assert safe.data.sizes["band"] == 0
    assert np.isnan(safe.data.overturning_level.values).all()


def test_the_figure_shows_peaks_and_bands(analysis):
    _, dataset = analysis
    curves, strip = dataset.plot(block=1).axes
    lines = curves.lines
    assert [line.get_label() for line in lines] == [
        f"{k}: {name}" for k, name in enumerate(dataset.data.motion.values, 1)
    ]
    peaks = dataset.data.peak_over_alpha.isel(motion=0, block=1).values
    np.testing.assert_array_equal(lines[0].get_xdata(), np.where(np.isinf(peaks), np.nan, peaks))
    strips = [line for line in strip.lines if line.get_linestyle() == "-"]
    assert len(strips) == len(bands(dataset, 0, 1)) + len(bands(dataset, 1, 1))
    assert curves.get_ylabel() == "peak ground velocity (m/s)"


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"measure": "factor"}, "measure"),
        ({"levels": [2.0, 1.0]}, "increasing order"),
        ({"levels": [0.0, 1.0]}, "positive"),
        ({"rtol": -1.0}, "rtol"),
        ({"motions": []}, "at least one motion"),
        ({"motions": rocking.Motion([0.0, 1.0], [[0.0]])}, "zero throughout"),
        ({"blocks": rocking.Block.from_parameters(1.0, 0.2, 1.0)}, "restitution must be below 1"),
    ],
)
def test_what_cannot_be_scaled_up_is_refused(changes, word):
    arguments = {"blocks": BLOCK, "motions": PULSE} | changes
    with pytest.raises(rocking.RockingError, match=word):
        incremental_dynamic_analysis(arguments.pop("blocks"), arguments.pop("motions"), **arguments)


def test_bands_of_a_block_or_a_motion_that_is_not_there_are_refused(analysis):
    _, result = analysis
    for name in ("motion", "block"):
        assert result.bands(**{name: 1})
        for wrong in (-1, 2, 0.0):
            with pytest.raises(rocking.errors.OptionError, match=f"{name} must be a whole number from 0 to 1"):
                result.bands(**{name: wrong})
    with pytest.raises(rocking.errors.OptionError, match="block must be a whole number"):
        result.plot(block=-1)


def test_levels_of_a_spectral_acceleration_say_its_period_and_damping():
    measure = rocking.Measure("sa", 1.0, 0.02)
    found = incremental_dynamic_analysis(BLOCK, PULSE, measure=measure, levels=[3.0, 9.0])
    about = found.to_dict()
    assert (about["period"], about["damping"]) == (1.0, 0.02)
    assert about["measure"] == "spectral acceleration at 1 s, damping 0.02"
    assert "spectral acceleration at 1 s, damping 0.02 (g) that overturns" in found.summary()
    assert "damping" not in incremental_dynamic_analysis(BLOCK, PULSE, levels=[3.0, 9.0]).to_dict()


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_blocks_with_equal_and_with_different_sides_are_analysed_together(order):
    each = rocking.Block(width=0.3, height=1.2), rocking.Block(width=0.3, height=1.5, offset=0.02)
    blocks, levels = [each[k] for k in order], [1.0, 4.0, 16.0, 64.0]
    both = incremental_dynamic_analysis(blocks, PULSE, measure="pga_ratio", levels=levels)
    judged = 0
    for k, block in enumerate(blocks):
        alone = incremental_dynamic_analysis(block, PULSE, measure="pga_ratio", levels=levels)
        np.testing.assert_array_equal(both.bands(block=k), alone.bands())
        assert alone.bands()
        slenderness = both.data.alpha_plus.values[k], both.data.alpha_minus.values[k]
        assert slenderness == tuple(side.alpha for side in block.sides)
        judged += 1
    assert judged == 2
