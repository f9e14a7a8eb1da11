"""Fragility: maximum likelihood against an independent one, intervals, tests of fit, limit states, what is refused."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import linalg, stats
from scipy.optimize import minimize

import rocking
from rocking import fit_fragility, fragility
from rocking.analysis.levels import assign_clusters, assign_families
from rocking.block import Blocks
from rocking.core.progress import notes_for
from rocking.errors import OptionError

BLOCK = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
PULSES = [rocking.pulses.one_sine(1.0, frequency) for frequency in np.linspace(0.3, 1.5, 13)]


def outcomes(seed, count, median=3.0, dispersion=0.4):
    """Random intensities, and whether each exceeded."""
    rng = np.random.default_rng(seed)
    intensity = rng.lognormal(math.log(median), 0.6, count)
    chance = stats.norm.cdf(np.log(intensity / median) / dispersion)
    return intensity, rng.random(count) < chance


def log_likelihood(parameters, intensity, exceeded, trials):
    z = (np.log(intensity) - parameters[0]) / math.exp(parameters[1])
    return np.sum(exceeded * stats.norm.logcdf(z) + (trials - exceeded) * stats.norm.logsf(z))


@pytest.mark.parametrize("seed", range(5))
def test_the_fit_has_the_largest_likelihood(seed):
    intensity, exceeded = outcomes(seed, 80)
    curve = fit_fragility(intensity, exceeded).curves[0]
    here = [math.log(curve.median), math.log(curve.dispersion)]
    assert curve.log_likelihood == pytest.approx(log_likelihood(here, intensity, exceeded, 1), rel=1e-12)
    options = {"xatol": 1e-10, "fatol": 1e-12, "maxiter": 4000}
    found = minimize(
        lambda x: -log_likelihood(x, intensity, exceeded, 1), [1.0, -1.0], method="Nelder-Mead", options=options
    )
    assert curve.log_likelihood >= -found.fun - 1e-10
    np.testing.assert_allclose(here, found.x, atol=1e-5)


def test_two_stripes_are_fitted_exactly():
    curve = fit_fragility([2.0, 5.0], [2, 7], trial_counts=10).curves[0]
    np.testing.assert_allclose(curve.probability([2.0, 5.0]), [0.2, 0.7], rtol=1e-12)
    dispersion = math.log(2.5) / (stats.norm.ppf(0.7) - stats.norm.ppf(0.2))
    assert curve.dispersion == pytest.approx(dispersion, rel=1e-12)
    assert curve.median == pytest.approx(2.0 * math.exp(-dispersion * stats.norm.ppf(0.2)), rel=1e-12)


def test_counts_and_single_outcomes_are_the_same_data():
    counted = fit_fragility([2.0, 3.0, 4.0], [1, 2, 4], trial_counts=5).curves[0]
    outcome = (np.arange(5) < np.array([[1], [2], [4]])).ravel()
    single = fit_fragility(np.repeat([2.0, 3.0, 4.0], 5), outcome).curves[0]
    assert single.median == pytest.approx(counted.median, rel=1e-10)
    np.testing.assert_allclose(single.covariance, counted.covariance, rtol=1e-8)
    assert single.goodness.statistic == pytest.approx(counted.goodness.statistic, rel=1e-8)


@pytest.mark.parametrize("examples", [5, pytest.param(15, marks=pytest.mark.thorough)])
def test_other_units_scale_the_median_and_nothing_else(examples):
    judged = []

    @settings(deadline=None, max_examples=examples)
    @given(st.integers(0, 1000), st.floats(1e-3, 1e3))
    def judge(seed, factor):
        intensity, exceeded = outcomes(seed, 40)
        here, there = (fit_fragility(intensity * scale, exceeded).curves[0] for scale in (1.0, factor))
        assert there.median == pytest.approx(factor * here.median, rel=1e-8)
        assert there.dispersion == pytest.approx(here.dispersion, rel=1e-8)
        np.testing.assert_allclose(there.median_interval, factor * np.array(here.median_interval), rtol=1e-7)
        judged.append(factor)

    judge()
    assert len(set(judged)) >= 4


def test_fishers_covariance_is_the_inverse_of_the_expected_curvature():
    # Where the data are their own expectation, expected and observed information agree.
    intensity = np.array([1.0, 2.0, 3.0, 4.0])
    trials = np.full(4, 1_000_000)
    exceeded = np.rint(trials * stats.norm.cdf(np.log(intensity / 2.5) / 0.5))
    curve = fit_fragility(intensity, exceeded, trial_counts=trials).curves[0]
    best = np.array([curve.fitted.intercept[0], curve.fitted.slope[0]])

    def negative(x):
        z = x[0] + x[1] * np.log(intensity)
        return -np.sum(exceeded * stats.norm.logcdf(z) + (trials - exceeded) * stats.norm.logsf(z))

    h = 1e-4
    steps = h * np.eye(2)
    hessian = np.array(
        [
            [
                negative(best + i + j) - negative(best + i - j) - negative(best - i + j) + negative(best - i - j)
                for j in steps
            ]
            for i in steps
        ]
    ) / (4.0 * h * h)
    np.testing.assert_allclose(np.linalg.inv(hessian), curve.covariance, rtol=1e-4)


# Shares of docs/_tables/fragility-coverage.txt, which scripts/fragility_coverage.py measures.
@pytest.mark.parametrize(
    ("motions", "repeats"),
    [
        (30, 20),
        pytest.param(120, 20, marks=pytest.mark.thorough),
        pytest.param(120, 50, marks=pytest.mark.slow),
    ],
)
def test_ninety_per_cent_intervals_hold_the_truth_nine_times_in_ten(motions, repeats):
    held, share = np.zeros(2), 0.89
    for seed in range(repeats):
        curve = fit_fragility(*outcomes(seed, motions)).curves[0]
        for k, (truth, (low, high)) in enumerate(((3.0, curve.median_interval), (0.4, curve.dispersion_interval))):
            held[k] += low <= truth <= high
    # Three standard deviations of a binomial share.
    assert np.all(np.abs(held / repeats - share) < 3.0 * math.sqrt(share * (1.0 - share) / repeats))


def striped(seed, count):
    """Outcomes of motions that are scaled to the same levels, each with its own capacity, and the motions."""
    capacity = np.random.default_rng(seed).lognormal(math.log(3.0), 0.4, count)
    levels = np.linspace(0.5, 9.0, 18)
    return np.repeat(levels, count), np.repeat(levels, count) > np.tile(capacity, 18), np.tile(np.arange(count), 18)


@pytest.mark.parametrize("repeats", [8, pytest.param(30, marks=pytest.mark.thorough)])
def test_intervals_from_stripes_know_that_the_outcomes_of_a_motion_belong_together(repeats):
    held = np.zeros(2)
    for seed in range(repeats):
        intensity, exceeded, motion = striped(seed, 20)
        for k, clusters in enumerate((motion, None)):
            low, high = fit_fragility(intensity, exceeded, clusters=clusters).curves[0].median_interval
            held[k] += low <= 3.0 <= high
    assert held[0] >= 25 / 30 * repeats
    assert held[1] < 22 / 30 * repeats


def test_the_interval_of_the_likelihood_is_where_it_has_fallen_by_half_a_quantile():
    intensity, exceeded = outcomes(4, 60)
    curve = fit_fragility(intensity, exceeded).curves[0]
    floor = curve.log_likelihood - 0.5 * stats.chi2.ppf(0.9, 1)

    def profile(k, value):
        """Largest likelihood with one of the logarithms of median and dispersion held."""
        free = [math.log(curve.median), math.log(curve.dispersion)][1 - k]

        def lost(x):
            return -log_likelihood([value, x[0]] if k == 0 else [x[0], value], intensity, exceeded, 1)

        return -minimize(lost, [free], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-11}).fun

    for k, ends in enumerate((curve.median_interval, curve.dispersion_interval)):
        for end in ends:
            assert profile(k, math.log(end)) == pytest.approx(floor, abs=1e-3)
    # Where the band of the probability holds one half is the interval of the median.
    low, high = curve.band(curve.median_interval)
    assert (high[0], low[1]) == pytest.approx((0.5, 0.5), abs=1e-4)


def test_the_region_of_clusters_has_the_covariance_of_leaving_each_out():
    """Newton's step without each cluster, written out; the region is the likelihood's, stretched to their spread."""
    intensity, exceeded, motion = striped(5, 20)
    together = fit_fragility(intensity, exceeded, clusters=motion).curves[0]
    z, (median, dispersion) = np.log(intensity), (together.median, together.dispersion)
    a, b = -math.log(median) / dispersion, 1.0 / dispersion
    score, information = np.zeros((20, 2)), np.zeros((20, 2, 2))
    for k in range(20):
        for x, yes in zip(z[motion == k], exceeded[motion == k], strict=True):
            at = (a + b * x) * (1.0 if yes else -1.0)
            mills = stats.norm.pdf(at) / stats.norm.cdf(at)
            row = np.array([1.0, x])
            score[k] += mills * row * (1.0 if yes else -1.0)
            information[k] += mills * (mills + at) * np.outer(row, row)
    total = information.sum(axis=0)
    assert np.abs(score.sum(axis=0)).max() < 1e-6
    moved = np.array([np.linalg.solve(total - information[k], score[k]) for k in range(20)])
    robust = 19.0 / 20.0 * moved.T @ moved
    # The map that makes one covariance of the other and turns nothing, of the region that independent outcomes have.
    root = linalg.sqrtm(np.linalg.inv(total))
    stretch = root @ linalg.sqrtm(np.linalg.inv(root) @ robust @ np.linalg.inv(root)) @ np.linalg.inv(root)
    assert stretch @ np.linalg.inv(total) @ stretch.T == pytest.approx(robust, rel=1e-9)
    assert np.linalg.norm(stretch - np.eye(2)) > 0.5
    likewise = float(stats.chi2.cdf(stats.t.ppf(0.95, 19) ** 2, 1))
    alone = fit_fragility(intensity, exceeded, confidence=likewise).curves[0]
    region, plain = (np.column_stack(one.region) for one in (together, alone))
    assert region.shape == (360, 2)
    np.testing.assert_allclose(region, [a, b] + (plain - [a, b]) @ stretch.T, rtol=1e-6)


def test_outcomes_that_hardly_depend_on_the_intensity_leave_the_dispersion_without_an_upper_end():
    curve = fit_fragility([1.0, 2.0, 3.0, 4.0], [2, 1, 3, 2], trial_counts=4).curves[0]
    assert curve.dispersion_interval[1] == math.inf
    low, high = curve.median_interval
    assert 0.0 <= low < curve.median < high <= math.inf
    assert curve.to_dict()["dispersion"] > 0.0


def test_any_outcomes_give_a_rising_curve_or_are_refused():
    judged, refused = [], []

    @settings(deadline=None, max_examples=60)
    @given(st.lists(st.tuples(st.integers(1, 6), st.integers(1, 6)), min_size=1, max_size=14), st.integers(-45, 45))
    def judge(data, exponent):
        intensity = 10.0**exponent * np.array([level for level, _ in data])
        exceeded = [level >= strength for level, strength in data]
        try:
            curve = fit_fragility(intensity, exceeded).curves[0]
        except rocking.errors.OptionError as error:
            assert "no lognormal can be fitted" in str(error)
            refused.append(data)
            return
        assert 0.0 < curve.dispersion < math.inf
        assert 0.0 < curve.median < math.inf
        low, high = curve.dispersion_interval
        assert 0.0 <= low <= high
        ends = curve.band(np.append(0.0, intensity))
        assert np.all((ends[0] >= 0.0) & (ends[0] <= ends[1]) & (ends[1] <= 1.0))
        curve.to_dict()
        judged.append(data)

    judge()
    assert min(len(judged), len(refused)) >= 5


def test_a_band_holds_the_curve():
    # Each of the outcomes counts alone: the bands are those of four hundred, in a tenth of the time.
    intensity, at = np.linspace(1.0, 9.0, 20), np.linspace(0.0, 10.0, 41)
    exceeded = np.random.default_rng(3).binomial(20, stats.norm.cdf(np.log(intensity / 3.0) / 0.4))
    curve = fit_fragility(intensity, exceeded, trial_counts=20).curves[0]
    low, high = curve.band(at)
    assert np.all(low <= curve.probability(at))
    assert np.all(curve.probability(at) <= high)


@pytest.mark.parametrize("apart", [0.3, 1e-6])
def test_the_covariance_of_close_intensities_is_that_of_wide_ones(apart):
    wide, close = (
        fit_fragility(3.0 * np.exp(share * np.arange(4)), [2, 4, 5, 8], trial_counts=10).curves[0]
        for share in (1.0, apart)
    )
    # The same data but for the unit of ln x; the error of the slope is in proportion.
    assert close.covariance[1, 1] * apart**2 == pytest.approx(wide.covariance[1, 1], rel=1e-5)
    assert np.all(np.linalg.eigvalsh(wide.covariance) > 0.0)


def test_the_test_of_fit_is_pearsons_over_stripes():
    intensity, exceeded = np.array([1.0, 2.0, 3.0, 4.0, 5.0]), np.array([1, 4, 11, 13, 19])
    found = fit_fragility(intensity, exceeded, trial_counts=20)
    (curve,) = found.curves
    assert found.summary().splitlines()[3].split()[-1] == f"{curve.goodness.p_value:.2g}"
    chance = curve.probability(intensity)
    statistic = np.sum((exceeded - 20 * chance) ** 2 / (20 * chance * (1 - chance)))
    assert curve.goodness.statistic == pytest.approx(statistic, rel=1e-12)
    assert curve.goodness.degrees_of_freedom == 3
    assert curve.goodness.p_value == pytest.approx(stats.chi2.sf(statistic, 3), rel=1e-9)


def test_the_test_of_fit_accepts_lognormals_and_rejects_what_is_none():
    accepted = [fit_fragility(*outcomes(k, 100)).curves[0].goodness.p_value > 0.05 for k in range(12)]
    assert sum(accepted) >= 10
    rng = np.random.default_rng(0)
    intensity = rng.uniform(1.0, 10.0, 400)
    # Safe again between 4 and 7, as a rocking block may be.
    exceeded = (intensity > 2.0) & ~((intensity > 4.0) & (intensity < 7.0))
    assert fit_fragility(intensity, exceeded).curves[0].goodness.p_value < 1e-6


@pytest.mark.parametrize("alpha", [0.2, (0.2, 0.25)])
def test_a_cloud_has_every_motion_at_its_own_intensity(alpha):
    block = rocking.Block.from_parameters(p=2.0, alpha=alpha, restitution=0.9)
    motions = [pulse.scaled(factor) for factor in (2.1, 2.4, 2.6, 2.8, 3.0, 4.0, 6.0) for pulse in PULSES]
    result = fragility(block, motions, measure="pga", limit_states={"part": 0.3, "overturning": math.inf})
    verdicts = [rocking.simulate(block, motion) for motion in motions]
    for curve, limit in zip(result.curves, (0.3, math.inf), strict=True):
        np.testing.assert_allclose(curve.intensity, [motion.pga for motion in motions], rtol=1e-12)
        passed = [verdict.overturned or verdict.peak_rotation / 0.2 > limit for verdict in verdicts]
        np.testing.assert_array_equal(curve.exceedance_counts, passed)
    assert result.curve("part").median < result.curve("overturning").median


def test_a_limit_of_the_peak_rotation_is_not_negative():
    with pytest.raises(rocking.errors.OptionError, match=r"must be 0 or more, not -0\.5"):
        fragility(BLOCK, PULSES, levels=[2.5, 3.5], limit_states={"half": -0.5})


def test_stripes_scale_every_motion_to_every_level():
    levels = np.array([2.5, 3.5, 5.0])
    sided = rocking.Block.from_parameters((2.0, 2.5), (0.25, 0.15), (0.9, 0.85))
    # A symmetric block under a motion and its mirror image does the same, which is one outcome.
    for block, signs in ((BLOCK, (1.0,)), (sided, (1.0, -1.0))):
        curve = fragility(block, PULSES, levels=levels, polarity="both").curves[0]
        assert curve.trial_counts.sum() == 3 * 13 * len(signs)
        for level in levels:
            scaled = [pulse.scaled_to(level).scaled(sign) for pulse in PULSES for sign in signs]
            fell = [rocking.simulate(block, motion).overturned for motion in scaled]
            assert curve.exceedance_counts[curve.intensity == level].sum() == sum(fell)


def test_a_blocks_own_measures_are_multiples_of_those_of_the_motion():
    lifting = min(BLOCK.uplift_thresholds())
    levels = np.array([1.5, 2.0, 3.0, 4.0])
    own = fragility(BLOCK, PULSES, measure="pga_ratio", levels=levels).curves[0]
    plain = fragility(BLOCK, PULSES, measure="pga", levels=levels * lifting).curves[0]
    assert own.median * lifting == pytest.approx(plain.median, rel=1e-9)
    own = fragility(BLOCK, PULSES, measure="pgv_ratio", levels=levels).curves[0]
    plain = fragility(BLOCK, PULSES, measure="pgv", levels=levels * lifting / BLOCK.p).curves[0]
    assert own.median * lifting / BLOCK.p == pytest.approx(plain.median, rel=1e-9)


def test_similar_blocks_pool_in_their_own_units():
    # Two blocks of the same shape, each under the pulses of the same frequencies relative to its p.
    blocks = [BLOCK, rocking.Block.from_parameters(p=4.0, alpha=0.2, restitution=0.9)]
    fast = [rocking.pulses.one_sine(1.0, 2.0 * frequency) for frequency in np.linspace(0.3, 1.5, 13)]
    levels = np.linspace(1.1, 4.0, 9)
    alone = [
        fragility(block, motions, measure="pga_ratio", levels=levels).curves[0]
        for block, motions in zip(blocks, (PULSES, fast), strict=True)
    ]
    assert alone[0].median == pytest.approx(alone[1].median, rel=1e-9)
    pooled = fragility(Blocks.from_bodies(blocks), PULSES, measure="pga_ratio", levels=levels).curves[0]
    assert pooled.trial_counts.sum() == 2 * 13 * 9


def test_two_sided_blocks_count_in_the_units_of_the_side_that_lifts_first():
    sided = rocking.Block.from_parameters((2.0, 2.5), (0.25, 0.15), (0.9, 0.85))
    result = fragility(sided, PULSES, measure="pgv_ratio", levels=np.linspace(0.5, 6.0, 12))
    unit = sided.uplift_thresholds()[1] / 2.0
    plain = fragility(sided, PULSES, measure="pgv", levels=unit * np.linspace(0.5, 6.0, 12))
    assert result.curves[0].median * unit == pytest.approx(plain.curves[0].median, rel=1e-9)


def test_the_figure_shows_curves_bands_and_shares():
    result = fragility(BLOCK, PULSES, levels=[2.5, 3.5, 5.0], limit_states={"half": 0.5, "overturning": math.inf})
    axes = result.plot().axes[0]
    labels = [line.get_label() for line in axes.lines]
    assert sum(label.startswith(("half", "overturning")) for label in labels) == 2
    shares = [line for line in axes.lines if line.get_marker() == "o" and line.get_xdata().size]
    np.testing.assert_allclose(shares[0].get_xdata(), np.array([2.5, 3.5, 5.0]) / BLOCK.gravity)
    assert axes.get_xlabel() == "peak ground acceleration (g)"


@pytest.mark.parametrize(
    ("intensity", "exceedance_counts", "sentence"),
    [
        (
            [1.0, 2.0, 3.0],
            [0, 0, 0],
            r"no outcome of 3 exceeds the limit, at 1 m/s\^2 \(0.102 g\) to 3 .*; use stronger motions",
        ),
        ([1.0, 2.0, 3.0], [1, 1, 1], "every outcome of 3 exceeds .*; use weaker motions"),
        (
            [1.0, 2.0, 3.0, 4.0],
            [0, 0, 1, 1],
            r"none exceeds the limit up to 2 m/s\^2 \(0.2039 g\) and all do from 3 m/s\^2 \(0.3",
        ),
        (
            [1.0, 2.0, 2.0, 4.0],
            [0, 0, 1, 1],
            r"none exceeds the limit below 2 m/s\^2 \(0.2039 g\) and all do above it",
        ),
        ([0.1, 1.0, 1.000000001, 9.0], [0, 1, 0, 1], "separated"),
        ([1.0, 2.0, 3.0, 4.0], [1, 1, 0, 0], "the fitted curve does not rise"),
        ([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [1, 1, 0, 1, 0, 0], "the fitted curve does not rise"),
        ([1.0, 2.0, 4.0], [0, 1, 0], "the fitted curve does not rise"),
        ([2.0, 2.0, 2.0], [0, 1, 0], r"all outcomes are at one intensity, 2 m/s\^2"),
        ([1.0], [1], r"every outcome of 1 exceeds the limit, at 1 m/s\^2 \(0.102 g\); use weaker"),
    ],
)
def test_outcomes_without_a_best_lognormal_are_refused_in_one_sentence(intensity, exceedance_counts, sentence):
    with pytest.raises(rocking.errors.OptionError, match=f"'overturning': .*{sentence}"):
        fit_fragility(intensity, exceedance_counts)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"intensity": [1.0, -2.0, 3.0]}, "intensity"),
        ({"intensity": []}, "intensity"),
        ({"exceedance_counts": [0, 1]}, "exceedance_counts"),
        ({"exceedance_counts": [0, 2, 1]}, "trials"),
        ({"exceedance_counts": [0.5, 1, 1]}, "whole"),
        ({"trial_counts": 0}, "trial_counts"),
        ({"clusters": [1, 2]}, "clusters"),
        ({"clusters": [[1], [1, 2], 3]}, "clusters"),
        ({"clusters": "abc"}, "clusters"),
        ({"intensity": [1e-60, 1.0, 2.0]}, "intensity"),
        ({"trial_counts": 1e300}, "trial_counts"),
        ({"confidence": 1.0}, "confidence"),
    ],
)
def test_data_that_cannot_be_fitted_are_refused(changes, word):
    arguments = {"intensity": [1.0, 2.0, 3.0], "exceedance_counts": [1, 0, 1]} | changes
    with pytest.raises(rocking.errors.OptionError, match=word):
        fit_fragility(arguments.pop("intensity"), arguments.pop("exceedance_counts"), **arguments)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"limit_states": {}}, "limit_states must be a mapping with at least one entry"),
        ({"limit_states": {"half": -0.5}}, "'half'"),
        ({"motions": []}, "at least one motion"),
    ],
)
def test_studies_that_make_no_fragility_are_refused(changes, word):
    arguments = {"motions": PULSES, "levels": [4.0, 6.0]} | changes
    with pytest.raises(rocking.RockingError, match=word):
        fragility(BLOCK, arguments.pop("motions"), **arguments)


def test_a_constant_share_contradicts_a_curve_that_rises_and_a_nearly_constant_one_puts_its_median_out_of_reach():
    with pytest.raises(rocking.errors.OptionError, match="the fitted curve does not rise"):
        fit_fragility([1.0, 2.0, 3.0], [2, 2, 2], trial_counts=4)
    with pytest.raises(rocking.errors.OptionError, match="above all intensities by a factor of more than 1000"):
        fit_fragility([1.0, 2.0, 3.0], [20, 20, 21], trial_counts=100)


def test_a_block_of_weight_two_counts_as_two_blocks():
    motions = [rocking.pulses.one_sine(1.0, f) for f in np.linspace(0.4, 1.5, 8)]
    a, b = (rocking.Block.from_parameters(p=p, alpha=0.2, restitution=0.9) for p in (1.5, 3.0))
    levels = np.linspace(2.0, 12.0, 8)
    twice = fragility([a, a, b], motions, levels=levels).curves[0]
    weighted = fragility([a, b], motions, levels=levels, weights=[2.0, 1.0])
    curve = weighted.curves[0]
    assert (curve.median, curve.dispersion) == pytest.approx((twice.median, twice.dispersion), rel=1e-9)
    # The region's shape depends a little on how many outcomes there are, its size does not.
    assert curve.median_interval == pytest.approx(twice.median_interval, rel=5e-3)
    assert curve.dispersion_interval == pytest.approx(twice.dispersion_interval, rel=5e-2)
    alike = fragility([a, b], motions, levels=levels).curves[0]
    assert abs(curve.median / alike.median - 1.0) > 0.01
    assert "2 blocks, weighted" in weighted.description
    by_block = weighted.outcomes.groupby("block").weight.unique()
    assert [weights.tolist() for weights in by_block] == [pytest.approx([4 / 3]), pytest.approx([2 / 3])]
    one, other = (fragility([a, b], motions, weights=[w, 3.0 * w], levels=levels).curves[0] for w in (1.0, 1e-6))
    assert one.median_interval == pytest.approx(other.median_interval, rel=1e-9)


def test_a_block_of_weight_zero_is_none_of_the_data():
    # One motion for each outcome, at intensities that the second block's unit puts elsewhere.
    a, b = (rocking.Block.from_parameters(p=2.0, alpha=alpha, restitution=0.9) for alpha in (0.2, 0.05))
    motions = [
        rocking.pulses.one_sine(size, f + 0.001 * size)
        for size in (2.0, 2.5, 3.0, 4.0, 5.0, 6.0)
        for f in (0.6, 0.8, 1.0, 1.2)
    ]
    both = fragility([a, b], motions, measure="pga_ratio", weights=[1.0, 0.0])
    alone = fragility(a, motions, measure="pga_ratio")
    one, other = both.curves[0], alone.curves[0]
    assert both.intensity_range == alone.intensity_range
    assert one.is_independent and one.goodness.degrees_of_freedom == other.goodness.degrees_of_freedom
    assert one.goodness.p_value == pytest.approx(other.goodness.p_value, rel=1e-9)
    assert one.trial_counts.sum() == other.trial_counts.sum() == len(motions)
    assert one.median_interval == pytest.approx(other.median_interval, rel=1e-9)
    # The table still has both blocks' simulations; the figure is drawn without a warning.
    assert both.outcomes.groupby("block").weight.unique().tolist() == [[1.0], [0.0]]
    both.plot()


@pytest.mark.parametrize(
    "weights, word", [([1.0], "2 nonnegative numbers"), ([1.0, -1.0], "nonnegative"), ([0.0, 0.0], "not all 0")]
)
def test_weights_that_weigh_nothing_are_refused(weights, word):
    block = rocking.Block.from_parameters(p=1.5, alpha=0.2, restitution=0.9)
    with pytest.raises(OptionError, match=word):
        fragility([block, block], [rocking.pulses.one_sine(1.0, 1.0)], levels=[1.0, 5.0], weights=weights)


def test_what_cannot_be_told_is_left_out_with_its_reason():
    block = rocking.Block.from_parameters(p=1.5, alpha=(0.2, 0.25), restitution=0.9)
    motions = [rocking.pulses.one_sine(1.0, f) for f in (0.4, 0.9, 1.2, 1.6)]
    levels = np.linspace(2.0, 8.0, 19)
    two = fragility(block, motions[:2], levels=levels)
    assert "2 motions cannot tell how far motions differ; give 3 or more" in two.summary()
    assert "0 to infinity" in two.summary()
    assert math.isnan(two.curves[0].goodness.p_value)
    assert "no p-value of the fit" in two.summary()
    assert "one polarity only" in two.summary()
    assert two.to_dict()["notes"] == list(two.notes)
    assert (two.curves[0].median_interval, two.curves[0].dispersion_interval) == ((0.0, math.inf), (0.0, math.inf))
    figure = two.plot()
    axes = figure.axes[0]
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert any(text.startswith("no band: 2 motions") for text in texts)
    assert axes.get_ylabel() == "probability of overturning"
    four = fragility(block, motions, levels=levels, polarity="both")
    assert not any("polarity" in note or "infinity" in note for note in four.notes)
    assert "4 motions, 19 stripes, nonlinear model, both polarities" in four.description
    rate = two.annual_rate(rocking.HazardCurve([0.5, 20.0], [1e-1, 1e-4])).rates[0]
    assert rate.interval == (0.0, math.inf)


def test_outcomes_of_one_cluster_at_one_intensity_are_no_independent_trials():
    levels, exceeded = [1.0, 2.0, 3.0, 4.0, 5.0], [2, 20, 50, 70, 100]
    independent = fit_fragility(levels, exceeded, trial_counts=100).curves[0]
    together = fit_fragility(levels, exceeded, trial_counts=100, clusters=range(5)).curves[0]
    assert independent.is_independent
    assert not together.is_independent
    assert math.isfinite(independent.goodness.p_value)
    assert math.isnan(together.goodness.p_value)
    widths = [one.median_interval[1] / one.median_interval[0] for one in (independent, together)]
    assert widths[0] != pytest.approx(widths[1], rel=1e-3)


def test_a_finite_limit_counts_in_the_smaller_slenderness_of_an_asymmetric_block():
    block = rocking.Block.from_parameters(p=2.0, alpha=(0.3, 0.2), restitution=0.8)
    motions = [
        rocking.pulses.one_sine(size, frequency) for size in np.linspace(2.5, 6.0, 12) for frequency in (1.0, 1.5)
    ]
    result = fragility(block, motions, limit_states={"half": 0.5})
    peaks = np.array([rocking.simulate(block, motion).peak_rotation for motion in motions])
    exceeded = result.outcomes.exceeded_half.values
    assert exceeded.tolist() == (peaks / 0.2 > 0.5).tolist()
    assert 0 < np.sum(peaks / 0.3 > 0.5) < np.sum(exceeded) < len(motions)
    assert np.count_nonzero(peaks < 0.2) >= 3
    assert result.outcomes.peak_over_alpha.values[peaks < 0.2] == pytest.approx(peaks[peaks < 0.2] / 0.2, rel=1e-9)


def test_multiples_of_a_motion_are_one_cluster_however_they_are_given():
    """Stripes, and the same motions scaled beforehand or reversed, are the same data."""
    levels = np.geomspace(2.0, 6.0, 4)
    stripes = fragility(BLOCK, PULSES, levels=levels).curves[0]
    scaled = [pulse.scaled_to(level) for pulse in PULSES for level in levels]
    cloud = fragility(BLOCK, [-motion if k % 2 else motion for k, motion in enumerate(scaled)])
    curve = cloud.curves[0]
    assert curve.cluster_count == stripes.cluster_count == len(PULSES)
    assert not curve.is_independent
    assert curve.median_interval == pytest.approx(stripes.median_interval, rel=1e-6)
    assert any("belong together" in note for note in cloud.notes)
    # Twice the same data say no more: only the count of trials differs.
    twice = fragility(BLOCK, [*PULSES, *PULSES], levels=levels).curves[0]
    assert twice.cluster_count == len(PULSES)
    assert twice.median == pytest.approx(curve.median, rel=1e-6)


def test_motions_of_one_label_count_together_as_their_outcomes_do():
    levels, labels = np.geomspace(2.0, 6.0, 4), [k // 3 for k in range(len(PULSES))]
    found = fragility(BLOCK, PULSES, levels=levels, clusters=labels)
    each = found.outcomes
    of_name = dict(zip(each.motion.unique(), labels, strict=True))
    given = fit_fragility(each.pga_m_s2, each.overturned, clusters=each.motion.map(of_name)).curves[0]
    curve, alone = found.curves[0], fragility(BLOCK, PULSES, levels=levels).curves[0]
    assert (curve.cluster_count, alone.cluster_count) == (5, len(PULSES))
    assert "13 motions in 5 clusters, 4 stripes" in found.description
    assert curve.median == alone.median
    assert curve.median_interval == pytest.approx(given.median_interval, rel=1e-9)
    assert curve.median_interval != pytest.approx(alone.median_interval, rel=1e-3)
    two = fragility(BLOCK, PULSES, levels=levels, clusters=[0] * 6 + [1] * 7)
    assert "2 clusters cannot tell how far clusters differ" in " ".join(two.notes)


def test_components_of_one_station_are_one_cluster_where_that_is_asked_for_and_noted_where_not(capsys):
    named = [rocking.records.load(name) for name in ("el-centro-meloland-270", "ridgecrest-clc-090")]
    beside = rocking.records.load("el-centro-meloland-360").scaled(2.0)
    with notes_for("everybody"):
        assert assign_clusters([*named, named[0].scaled(0.5), PULSES[0], PULSES[1]]).tolist() == [0, 1, 0, 2, 3]
        assert capsys.readouterr().err == ""
        assert assign_clusters([*named, beside]).tolist() == [0, 1, 2]
        assert (
            "components of one station count as independent of each other: clusters may be" in capsys.readouterr().err
        )
        assert assign_clusters([*named, beside, PULSES[0], PULSES[1]], "station").tolist() == [0, 1, 0, 2, 3]
        assert capsys.readouterr().err == ""
    with pytest.raises(OptionError, match="clusters station requires records that name their station"):
        assign_clusters(PULSES, "station")


def test_motions_of_one_shape_and_another_length_or_vertical_component_are_not_one():
    pulse = rocking.pulses.one_sine(1.0, 1.0)
    up, down = (pulse.with_vertical(rocking.pulses.one_sine(a, 3.0)) for a in (0.5, -0.5))
    longer = rocking.pulses.one_sine(1.0, 1.5)
    given = [pulse, longer, up, pulse.scaled(-3.0), up.scaled(-0.3), down, longer.scaled(1e-6), up.scaled(0.3)]
    assert assign_families(given).tolist() == [0, 1, 2, 0, 2, 3, 1, 2]
    assert assign_families(given, include_reversed=False).tolist() == [0, 1, 2, 3, 4, 5, 1, 2]


@pytest.mark.parametrize("missing", [None, "", math.nan, np.nan])
def test_outcomes_without_a_label_are_on_their_own(missing):
    x, y = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [0, 1, 0, 1, 0, 1]
    own = fit_fragility(x, y, clusters=[missing] * 6).curves[0]
    assert own.cluster_count == 6
    assert own.is_independent
    assert fit_fragility(x, y, clusters=["a", missing, "a", missing, 3, 3.0]).curves[0].cluster_count == 4


@pytest.mark.parametrize("level", [4.0, 5.0, 6.0])
def test_motions_that_are_scaled_to_one_level_are_at_one_intensity(level):
    """Their measured intensities differ in the last digit."""
    block = rocking.Block.from_parameters(p=3.0, alpha=0.25, restitution=0.9)
    motions = [rocking.records.load(name).scaled_to(level) for name in rocking.records.names()]
    assert len({motion.pga for motion in motions}) > 1
    with pytest.raises(rocking.errors.FitError, match="all outcomes are at one intensity"):
        fragility(block, motions)


def test_labels_of_pandas_that_are_missing_are_on_their_own_and_masked_outcomes_are_refused():
    pandas = pytest.importorskip("pandas")
    levels, fell = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [0, 1, 0, 1, 1, 1]
    for labels in (
        pandas.Series(["a", "b", None, "c", "a", None], dtype="string"),
        pandas.Series([1, 2, None, 3, 1, None], dtype="Int64"),
        [1, 2, None, 3, 1, float("nan")],
    ):
        assert fit_fragility(levels, fell, clusters=labels).curves[0].cluster_count == 5
    masked = np.ma.masked_array(fell, mask=[0, 0, 0, 0, 0, 1])
    with pytest.raises(OptionError, match="must not contain masked values"):
        fit_fragility(levels, masked)
    with pytest.raises(OptionError, match="must not be masked"):
        rocking.calibrate([rocking.pulses.one_sine(each, 1.0) for each in levels], masked)
