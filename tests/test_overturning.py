"""Overturning maps: closed forms of pulses, the second region, refined boundaries, and what must be refused."""

import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import rocking
from rocking.analysis.levels import find_boundaries
from rocking.analysis.overturning import PULSES, describe_mode, overturning_map
from rocking.block import Blocks
from rocking.engine.schemes import Certified
from rocking.engine.tasks import Setup, simulate_each
from rocking.inputs.pulses import FAMILIES

BLOCK = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
PULSE_OF = rocking.pulses.one_sine
FREQUENCIES = np.array([1.0, 2.0, 3.0, 5.0, 6.5])

# The closed forms know no limit to the rotation. A block falls at pi/2, which the linear model passes during a slow
# pulse though its end would still bring the block back; the slenderer, the more multiples of alpha pi/2 is.
THIN = rocking.Block.from_parameters(p=2.0, alpha=1e-5, restitution=0.9)


def half_sine_amplitude(ratio: float) -> float:
    """Amplitude of the half sine, of frequency `ratio` times p, that just overturns a slender block."""

    def excess(a: float) -> float:
        return math.sqrt(a * a - 1.0) + a * math.exp(-(math.pi - math.asin(1.0 / a)) / ratio) - ratio

    return brentq(excess, 1.0, 50.0, xtol=1e-14, rtol=1e-15)


def one_sine_amplitude(ratio: float) -> float:
    """Amplitude of the one-sine pulse that just overturns a slender block without an impact."""

    def excess(a: float) -> float:
        return math.sqrt(a * a - 1.0) - a * math.exp(-(2.0 * math.pi - math.asin(1.0 / a)) / ratio) - ratio

    return brentq(excess, 1.0, 50.0, xtol=1e-14, rtol=1e-15)


def sequence(dataset, column):
    """Modes from the lowest amplitude to the highest, and the amplitudes between them."""
    here = dataset.data.boundary_frequency.values == dataset.data.frequency.values[column]
    modes = [int(dataset.data.mode[0, column]), *dataset.data.mode_above.values[here].tolist()]
    return modes, dataset.data.boundary_amplitude.values[here]


def test_a_half_sine_overturns_a_slender_block_from_the_closed_form_on():
    grid = np.linspace(0.5, 6.0, 12)
    dataset = overturning_map(THIN, "half-sine", amplitudes=grid, frequencies=FREQUENCIES, model="linear", rtol=1e-9)
    exact = [half_sine_amplitude(ratio) for ratio in FREQUENCIES]
    np.testing.assert_allclose(dataset.data.overturning_amplitude, exact, rtol=0.0, atol=1e-8)
    # Values known beforehand.
    np.testing.assert_allclose(exact[:4], [1.3223965979, 1.8007239306, 2.2938723134, 3.2891467775], atol=1e-10)


@pytest.mark.parametrize("frequencies", [FREQUENCIES[::3], pytest.param(FREQUENCIES, marks=pytest.mark.thorough)])
def test_a_one_sine_overturns_a_slender_block_without_impact_from_the_closed_form_on(frequencies):
    grid = np.linspace(0.5, 14.0, 46)
    dataset = overturning_map(THIN, "one-sine", amplitudes=grid, frequencies=frequencies, model="linear", rtol=1e-9)
    for k, ratio in enumerate(frequencies):
        modes, edges = sequence(dataset, k)
        assert modes[-1] == 0
        assert edges[-1] == pytest.approx(one_sine_amplitude(ratio), rel=0.0, abs=1e-8)


def test_a_second_region_overturns_after_one_impact_with_safety_above_it():
    grid = np.linspace(0.5, 14.0, 46)
    dataset = overturning_map(BLOCK, "one-sine", amplitudes=grid, frequencies=[4.0, 5.0, 6.0], rtol=1e-9)
    for k in range(3):
        modes, _ = sequence(dataset, k)
        assert modes == [-3, -2, -1, 1, -1, 0] or modes == [-3, -1, 1, -1, 0]
    assert [describe_mode(mode) for mode in modes[-3:]] == [
        "overturns after 1 impact",
        "rocks until the pulse is over",
        "overturns without impact",
    ]


def test_boundaries_separate_what_simulate_says():
    dataset = overturning_map(BLOCK, "one-sine", amplitudes=[0.5, 2.0, 4.0, 7.0, 10.0], frequencies=[4.5], rtol=1e-9)
    motion = rocking.pulses.one_sine(1.0, 4.5 * 2.0 / (2.0 * math.pi))
    threshold = min(BLOCK.uplift_thresholds())
    assert dataset.data.sizes["boundary"] >= 4
    judged = set()
    for edge, *modes in zip(
        *(dataset.data[n].values for n in ("boundary_amplitude", "mode_below", "mode_above")), strict=True
    ):
        for factor, mode in zip((1.0 - 1e-8, 1.0 + 1e-8), modes, strict=True):
            response = rocking.simulate(BLOCK, motion.scaled(edge * factor * threshold))
            assert response.overturned == (mode >= 0)
            judged.add(int(mode))
            if mode >= 0:
                assert len(response.impacts) == mode
            elif mode == -3:
                assert len(response.events) == 0
            else:
                rests = response.events["time"][response.events["kind"] == "rest"]
                assert (rests[0] <= motion.duration) == (mode == -2)
    assert len(judged) >= 4


def test_nothing_moves_below_an_amplitude_of_one():
    dataset = overturning_map(BLOCK, "half-sine", amplitudes=[0.5, 1.5], frequencies=[1.0, 4.0], rtol=1e-9)
    assert np.all(dataset.data.mode.values[0] == -3)
    assert np.count_nonzero(dataset.data.mode_below == -3) >= 2
    np.testing.assert_allclose(dataset.data.boundary_amplitude.values[dataset.data.mode_below == -3], 1.0, rtol=1e-9)
    assert np.all(dataset.data.peak_rotation.values[0] == 0.0)


def test_a_block_that_overturns_after_a_rest_is_told_so():
    # A weak lobe, after which the block comes to rest in the pause, then a strong one.
    def pulse(amplitude, frequency):
        return rocking.pulses.n_lobe([0.35 * amplitude, 0.0, 0.0, amplitude], frequency)

    damped = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.5)
    dataset = overturning_map(damped, pulse, amplitudes=[3.0], frequencies=[1.0])
    response = rocking.simulate(damped, pulse(3.0 * min(damped.uplift_thresholds()), 1.0 / math.pi))
    assert response.overturned
    assert response.events["kind"].tolist() == ["uplift", "rest", "uplift", "overturn"]
    assert len(response.impacts) > 0
    assert dataset.data.mode.values[0, 0] == -4
    assert describe_mode(-4) in dataset.summary()
    assert "3 or less" in dataset.summary()
    (legend,) = dataset.plot().legends
    assert [text.get_text() for text in legend.get_texts()] == [describe_mode(-4)]


def test_a_mirrored_two_sided_block_under_a_mirrored_pulse():
    sided = rocking.Block.from_parameters(p=(2.0, 2.5), alpha=(0.15, 0.25), restitution=(0.9, 0.85))
    mirrored = rocking.Block.from_parameters(p=(2.5, 2.0), alpha=(0.25, 0.15), restitution=(0.85, 0.9))

    def reversed_sine(amplitude, frequency):
        return -rocking.pulses.one_sine(amplitude, frequency)

    grid = {"amplitudes": np.linspace(0.5, 8.0, 6), "frequencies": [2.0, 4.0], "rtol": 1e-3}
    here, there = overturning_map(sided, "one-sine", **grid), overturning_map(mirrored, reversed_sine, **grid)
    np.testing.assert_array_equal(here.data.mode, there.data.mode)
    np.testing.assert_array_equal(here.data.boundary_amplitude, there.data.boundary_amplitude)
    assert here.data.sizes["boundary"] >= 6


@pytest.mark.parametrize(
    ("pulse", "parameters"),
    [
        ("sine", {"cycles": 2.0}),
        ("ricker", {}),
        ("ricker", {"kind": "antisymmetric"}),
        ("Mavroeidis-Papageorgiou", {"phase": 0.5, "gamma": 2.0}),
        (partial(rocking.pulses.n_lobe, lobes=3), {}),
    ],
)
def test_the_amplitude_of_a_pulse_is_its_peak(pulse, parameters):
    dataset = overturning_map(BLOCK, pulse, amplitudes=[0.9, 1.1], frequencies=[2.0], rtol=1e-9, **parameters)
    assert dataset.data.mode.values[0, 0] == -3
    assert dataset.data.mode.values[1, 0] > -3
    lifting = dataset.data.boundary_amplitude.values[dataset.data.mode_below == -3]
    np.testing.assert_allclose(lifting, 1.0, rtol=2e-9)


def test_bisection_finds_a_region_inside_an_interval_of_the_grid():
    levels = np.array([1.0, 2.0])

    def outcome_of(column, level):
        return np.select([level < 1.3, level < 1.6], [0, 1], 2)

    edges = find_boundaries(levels, np.array([[0], [2]]), outcome_of, rtol=1e-12)
    np.testing.assert_allclose(edges.level, [1.3, 1.6], rtol=1e-12)
    assert edges.outcome_below.tolist() == [0, 1]
    assert edges.outcome_above.tolist() == [1, 2]
    assert np.all(edges.high - edges.low <= 1e-12 * edges.high)


def test_bisection_finds_a_thin_region_between_two_others():
    def outcome_of(column, level):
        return np.select([level < 1.3, level < 1.3 + 1e-7], [1, -1], 0)

    edges = find_boundaries(np.array([1.0, 2.0]), np.array([[1], [0]]), outcome_of, rtol=1e-12)
    np.testing.assert_allclose(edges.level, [1.3, 1.3 + 1e-7], rtol=1e-12)
    assert edges.outcome_above.tolist() == [-1, 0]


def test_bisection_of_endless_regions_ends():
    rng = np.random.default_rng(0)
    edges = find_boundaries(
        np.array([1.0, 2.0]), np.array([[0], [1]]), lambda column, level: rng.integers(2, 1000, len(level)), rtol=1e-6
    )
    assert len(edges.level) <= 128
    assert np.all(np.diff(edges.low) > 0.0)


def test_blocks_that_each_have_their_own_scaling_do_what_simulate_says():
    rng = np.random.default_rng(1)
    blocks = Blocks(rng.uniform(1.0, 6.0, 40), rng.uniform(0.08, 0.4, 40), rng.uniform(0.6, 0.95, 40))
    factors = rng.uniform(0.5, 6.0, 40)
    motion = rocking.pulses.sine(1.0, 0.9, cycles=2.5)
    for model in ("linear", "nonlinear"):
        setup, bodies = Setup(blocks, model, Certified()), np.arange(40)
        played = list(simulate_each(setup, [motion], bodies, np.zeros(40, dtype=np.int64), factors))
        assert sorted(np.concatenate([indices for indices, _ in played])) == list(range(40))
        for indices, outcomes in played:
            for k, outcome in zip(indices, outcomes, strict=True):
                response = rocking.simulate(blocks[k], motion.scaled(factors[k]), model=model)
                assert outcome["overturned"] == response.overturned
                assert outcome["peak_rotation"] == response.peak_rotation
                assert outcome["impacts"] == len(response.impacts)
                assert outcome["rests"] == len(response.sequences)


def test_a_map_that_never_overturns_has_no_overturning_amplitude():
    dataset = overturning_map(BLOCK, "half-sine", amplitudes=[0.5, 1.01], frequencies=[5.0], rtol=1e-9)
    assert np.isnan(dataset.data.overturning_amplitude.values).all()
    below = overturning_map(BLOCK, "half-sine", amplitudes=[8.0, 9.0], frequencies=[1.0], rtol=1e-9)
    assert np.isnan(below.data.overturning_amplitude.values).all()
    assert below.data.sizes["boundary"] == 0


def test_the_figure_names_every_mode_that_it_shows():
    dataset = overturning_map(
        BLOCK, "one-sine", amplitudes=np.linspace(0.5, 10.0, 20), frequencies=np.linspace(2, 6, 5), rtol=1e-3
    )
    figure = dataset.plot()
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {
        "no uplift",
        "rocks until the pulse is over",
        "overturns after 1 impact",
        "overturns without impact",
    } <= set(texts)
    filled = [path for shape in figure.axes[0].collections for path in shape.get_paths()]
    areas = [abs(np.sum(np.diff(p.vertices[:, 0]) * (p.vertices[1:, 1] + p.vertices[:-1, 1]) / 2)) for p in filled]
    # The regions fill the whole of the axes.
    assert sum(areas) == pytest.approx((6.0 - 2.0) * (10.0 - 0.5), rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"pulse": "square"}, "no pulse 'square'"),
        ({"pulse": "triangular"}, "one of sine, .* or a function"),
        ({"pulse": "sine"}, "cycles"),
        ({"pulse": "half-sine", "cycles": 2.0}, "cycles"),
        ({"pulse": rocking.pulses.half_sine, "cycles": 2.0}, "set them in it"),
        ({"pulse": lambda a, f: a * f}, "a Motion is required, not 0."),
        ({"pulse": lambda a, f: None}, "is None; return a Motion"),
        ({"pulse": lambda a, f: rocking.pulses.half_sine(a, 1.0), "frequencies": [1.0, 3.0]}, "the same shape"),
        ({"pulse": lambda a, f: rocking.pulses.n_lobe([a, a * a], f)}, "the same shape"),
        ({"pulse": "ricker", "duration": 1.5, "frequencies": [1.0, 3.0]}, "the same shape"),
        ({"pulse": lambda a, f: PULSE_OF(a, f).with_vertical(PULSE_OF(1.0, f))}, "the same shape"),
        (
            {"pulse": lambda a, f: PULSE_OF(a, f).with_vertical(PULSE_OF(a, 1.0)), "frequencies": [3.0]},
            "the same shape",
        ),
        (
            {
                "pulse": lambda a, f: PULSE_OF(a, f).with_vertical(PULSE_OF(a, f) if f > 1.0 else None),
                "frequencies": [0.1, 90.0],
            },
            "the same shape",
        ),
        ({"amplitudes": []}, "amplitudes"),
        ({"amplitudes": [2.0, 1.0]}, "increasing order"),
        ({"frequencies": [-1.0]}, "frequencies"),
        ({"rtol": 0.0}, "rtol"),
        ({"block": rocking.Block.from_parameters(1.0, 0.2, 1.0)}, "restitution must be below 1"),
    ],
)
def test_what_makes_no_map_is_refused(changes, word):
    arguments = {"pulse": "half-sine", "block": BLOCK, "amplitudes": [0.5, 2.0], "frequencies": [1.0]} | changes
    with pytest.raises(rocking.RockingError, match=word):
        overturning_map(arguments.pop("block"), arguments.pop("pulse"), **arguments)


def test_a_pulse_with_a_vertical_component_overturns_where_single_simulations_say():
    def pulse(amplitude, frequency):
        return PULSE_OF(amplitude, frequency).with_vertical(rocking.pulses.sine(amplitude, 2.0 * frequency, cycles=3))

    ratios = np.array([1.5, 3.0])
    found = overturning_map(BLOCK, pulse, amplitudes=np.linspace(0.8, 6.0, 14), frequencies=ratios, rtol=1e-6)
    side = BLOCK.sides[0]
    for ratio, level in zip(ratios, found.data.overturning_amplitude.values, strict=True):
        frequency, lifting = ratio * side.p / (2.0 * math.pi), BLOCK.gravity * math.tan(side.alpha)
        for times, falls in ((1.0 - 1e-5, False), (1.0 + 1e-5, True)):
            response = rocking.simulate(BLOCK, pulse(times * level * lifting, frequency))
            assert response.overturned == falls


def test_every_family_of_pulses_is_mapped_by_name_or_known_to_need_a_function() -> None:
    of_a_duration_or_several_amplitudes = {"rectangular", "triangular", "n-lobe"}
    assert set(FAMILIES) == {*PULSES} | of_a_duration_or_several_amplitudes
    page = (Path(__file__).parent.parent / "docs" / "howto" / "overturning-map.md").read_text("utf-8")
    for text in (overturning_map.__doc__ or "", page):
        assert all(name in text for name in PULSES)


def test_a_function_of_samples_at_a_constant_step_is_of_one_shape():
    def sampled(amplitude, frequency):
        times = np.arange(0.0, 1.0 / frequency, 0.005)
        return rocking.Motion.from_samples(amplitude * np.sin(2.0 * np.pi * frequency * times), 0.005)

    grid = {"amplitudes": np.linspace(0.5, 6.0, 6), "frequencies": [1.0, 4.0], "rtol": 1e-4}
    by_function, by_name = overturning_map(BLOCK, sampled, **grid), overturning_map(BLOCK, "one-sine", **grid)
    np.testing.assert_allclose(by_function.data.overturning_amplitude, by_name.data.overturning_amplitude, rtol=1e-2)
