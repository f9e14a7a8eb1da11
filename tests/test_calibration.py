"""Calibration: hidden blocks are found again from outcomes and from histories, and what they will do is predicted."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.stats import norm

import rocking
from rocking.calibration import search as searching
from rocking.calibration.diagnostics import Scores, list_bounds_reached
from rocking.calibration.history import HistoryCalibration
from rocking.calibration.outcomes import label_groups
from rocking.calibration.search import MAX_R_HAT, Candidates, Evidence, Problem, sample_posterior, search
from rocking.calibration.space import Space
from rocking.calibration.tables import read_calibration, read_ensemble

HIDDEN = rocking.Block.from_parameters(p=(3.6, 3.5), alpha=(0.11, 0.2), restitution=(0.8, 0.82))
STEP = 0.02


def bursts(count: int, seed: int) -> list[rocking.Motion]:
    """Windowed noise of random length, colour and strength: 6 s each."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, 6.0, STEP)
    frequencies = np.fft.rfftfreq(len(times), STEP)
    motions = []
    for number in range(count):
        centre, length, peak = rng.uniform(0.5, 3.0), rng.uniform(0.5, 2.0), 9.81 * 0.6 ** rng.uniform(1.0, 5.0)
        noise = np.fft.irfft(np.fft.rfft(rng.standard_normal(len(times))) / (1.0 + (frequencies / centre) ** 4))
        samples = noise * np.exp(-(((times - 2.5) / length) ** 2))
        samples *= peak / np.abs(samples).max()
        motions.append(rocking.Motion.from_samples(samples, STEP, name=f"burst {number}"))
    return motions


def outcomes(motions: list[rocking.Motion], block: rocking.Block = HIDDEN) -> np.ndarray:
    return np.array([rocking.simulate(block, motion, model="linear").overturned for motion in motions])


@pytest.fixture(scope="module")
def shaken():
    motions = bursts(120, seed=1)
    return motions, outcomes(motions)


@pytest.fixture(scope="module")
def told(shaken):
    """Half of the tests, from which a coarse search learns as much."""
    motions, overturned = shaken
    return motions[60:], overturned[60:]


@pytest.fixture(scope="module")
def found(told, coarsely):
    with coarsely():
        return rocking.calibrate(*told, candidate_count=512, model="linear")


@pytest.fixture(scope="module")
def unseen():
    motions = bursts(100, seed=2)
    return motions, outcomes(motions)


# Outcomes: overturned or not.


def test_two_sides_by_housners_rule_are_those_of_one_rectangle():
    space = Space.from_bounds((1.0, 8.0), (0.05, 0.5), "housner", two_sided=True)
    points = space.sample_quasi_randomly(200, np.random.default_rng(3))
    blocks, named = space.blocks(points), space.parameters_by_name(points)
    compared = 0
    for k, block in enumerate(blocks):
        plus, minus = np.tan(blocks.alpha[k])
        half_width, offset = 0.5 * (plus + minus), 0.5 * (minus - plus)  # over half the height
        if abs(offset) > 0.5 * half_width:
            continue  # slendernesses in a ratio of nearly 3
        half_height = 0.75 * block.gravity / named["p"][k] ** 2 / np.hypot(half_width, 1.0)
        truth = rocking.Block(half_width=half_width * half_height, half_height=half_height, offset=offset * half_height)
        for side, other in zip(block.sides, truth.sides, strict=True):
            found, wanted = ((each.p, each.alpha, each.restitution) for each in (side, other))
            assert found == pytest.approx(wanted, rel=1e-12)
        compared += 1
    assert compared > 150
    np.testing.assert_allclose(rocking.Blocks(blocks.p, blocks.alpha).restitution, blocks.restitution, rtol=1e-6)
    symmetric = Space.from_bounds(2.0, (0.05, 0.5), "housner", two_sided=False)
    assert set(symmetric.blocks(symmetric.sample_quasi_randomly(20, np.random.default_rng(3))).p.ravel()) == {2.0}


def test_what_a_hidden_block_will_do_is_predicted(found, unseen):
    motions, overturned = unseen
    scores = Scores.from_predictions(found.predict(motions), overturned)
    guess = Scores.from_predictions(np.full(len(motions), overturned.mean()), overturned)
    assert scores.accuracy > 0.93
    assert scores.log_loss < 0.35 * guess.log_loss


def test_the_hidden_block_lies_within_the_estimates(found):
    for side, truth in zip(("_plus", "_minus"), HIDDEN.sides, strict=True):
        slenderness = found.estimates[f"alpha{side}"]
        assert slenderness.lower < truth.alpha < slenderness.upper, side
        assert found.estimates["p"].lower < truth.p < found.estimates["p"].upper
    assert found.estimates["alpha_plus"].upper < found.estimates["alpha_minus"].upper


def test_the_ensemble_predicts_what_its_blocks_do(found, unseen):
    motions = unseen[0][:6]
    fallen = np.array([outcomes(motions, block) for block in found.blocks])
    count = found.diagnostics.effective_count
    share = (count * found.weights @ fallen + 0.5) / (count + 1.0)
    expected = found.outlier_probability + (1.0 - 2.0 * found.outlier_probability) * share
    np.testing.assert_allclose(found.predict(motions), expected, rtol=1e-12)
    assert found.weights.sum() == pytest.approx(1.0, abs=1e-12)


def test_fitted_probabilities_are_those_of_the_ensemble(found, told):
    # The ensemble is a draw of 1000 from the candidates' weights, which are those of the fit.
    assert np.abs(found.predict(told[0]) - found.probabilities).max() < 3.0 / math.sqrt(1000)


@pytest.mark.slow
def test_cross_validation_says_how_good_predictions_are(coarsely, shaken, unseen):
    with coarsely():
        found = rocking.calibrate(*shaken, candidate_count=512, model="linear")
    validation = found.cross_validate(fold_count=4, repeat_count=2)
    assert validation.probabilities.shape == (2, len(shaken[0]))
    for row, scores in zip(validation.probabilities, validation.scores_by_repeat, strict=True):
        assert scores == Scores.from_predictions(row, shaken[1])
    honest = Scores.from_predictions(found.predict(unseen[0]), unseen[1])
    assert found.scores.log_loss < validation.scores.log_loss
    # Both are means over more than a hundred outcomes, with standard errors of about 0.02.
    assert abs(validation.scores.accuracy - honest.accuracy) < 0.06


@pytest.mark.thorough
def test_a_group_is_left_out_as_a_whole(coarse):
    # Each motion comes twice, with opposite outcomes: whoever saw the twin would predict the wrong outcome.
    motions = bursts(6, seed=4)
    overturned = np.arange(12) < 6
    found = rocking.calibrate(motions * 2, overturned, candidate_count=128, two_sided=False, model="linear")
    validation = found.cross_validate(groups=[*range(6)] * 2, fold_count=2)
    first, second = validation.probabilities[0, :6], validation.probabilities[0, 6:]
    # Twins differ by the order of single-precision sums.
    np.testing.assert_allclose(first, second, rtol=1e-6)
    assert len(np.unique(np.round(first, 6))) > 2  # each test has a probability of its own, and not that of its part


@pytest.mark.slow
def test_dispersion_from_test_to_test_is_measured():
    motions = bursts(150, seed=3)
    rng = np.random.default_rng(8)
    dispersions = []
    for deviation in (0.0, 0.4):
        factors = np.exp(deviation * rng.standard_normal(len(motions)))
        fallen = outcomes([motion.scaled(factor) for motion, factor in zip(motions, factors, strict=True)])
        found = rocking.calibrate(motions, fallen, candidate_count=1024, two_sided=False, model="linear")
        dispersions.append(found.estimates["alpha"].dispersion)
    # No dispersion at all cannot be told from one as wide as the candidates are apart.
    assert dispersions[1] > 1.5 * dispersions[0]


def test_blocks_keep_to_the_bounds(coarse, shaken):
    found = rocking.calibrate(
        shaken[0][:10],
        shaken[1][:10],
        candidate_count=256,
        p=(2.0, 3.0),
        alpha=(0.1, 0.2),
        restitution=(0.7, 1.0),
        model="linear",
    )
    assert np.all((found.blocks.p >= 2.0 - 1e-12) & (found.blocks.p <= 3.0 + 1e-12))
    assert np.all((found.blocks.alpha >= 0.1 - 1e-12) & (found.blocks.alpha <= 0.2 + 1e-12))
    assert np.all(found.blocks.restitution >= 0.7 - 1e-12)


def test_the_nonlinear_model_calibrates_too(coarse):
    motions = bursts(12, seed=9)
    block = rocking.Block.from_parameters(p=3.0, alpha=0.25, restitution=0.85)
    overturned = [rocking.simulate(block, motion).overturned for motion in motions]
    found = rocking.calibrate(motions, overturned, model="nonlinear", candidate_count=128, two_sided=False)
    assert found.model == "nonlinear"
    assert found.scores.accuracy > 0.9


def test_what_is_known_has_no_estimate_and_stays(coarse, shaken):
    known = {"p": 3.55, "restitution": 0.81}
    found = rocking.calibrate(shaken[0][40:60], shaken[1][40:60], candidate_count=128, **known, model="linear")
    assert set(found.estimates) == {"alpha_plus", "alpha_minus"}
    assert np.all(found.blocks.p == 3.55) and np.all(found.blocks.restitution == 0.81)
    assert len(found.plot().axes) == 2
    for side, truth in zip(("plus", "minus"), HIDDEN.sides, strict=True):
        assert found.estimates[f"alpha_{side}"].lower < truth.alpha < found.estimates[f"alpha_{side}"].upper


def test_one_unknown_angle_is_found_from_forty_tests(coarse):
    size = rocking.Block(width=0.4, height=2.0)
    motions = bursts(40, seed=11)
    found = rocking.calibrate(
        motions,
        outcomes(motions, size),
        candidate_count=256,
        p=size.p,
        restitution="housner",
        two_sided=False,
        model="linear",
    )
    assert set(found.estimates) == {"alpha"}
    angle = found.estimates["alpha"]
    assert angle.lower < size.alpha < angle.upper < 1.4 * angle.lower
    np.testing.assert_allclose(found.blocks.restitution, 1.0 - 1.5 * np.sin(found.blocks.alpha) ** 2, rtol=1e-12)
    assert not found.diagnostics.notes


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"overturned": [True, False]}, "each of the 3 motions"),
        ({"overturned": [1, 1, 1]}, "all outcomes are equal"),
        ({"overturned": [0, 2, 1]}, "True or False"),
        ({"overturned": ["no", "yes", "no"]}, "True or False"),
        ({"outlier_probability": 0.0}, "outlier_probability"),
        ({"outlier_probability": 0.5}, "outlier_probability"),
        ({"candidate_count": 10}, "candidate_count"),
        ({"p": (2.0, 1.0)}, "p must be"),
        ({"p": 2.0, "alpha": 0.2, "restitution": 0.9}, "all parameters are known"),
        ({"restitution": "hausner"}, "'housner'"),
        ({"p": "housner"}, "p must be a value or a pair"),
        ({"alpha": (0.1, 1.0), "restitution": "housner"}, "below 0.9553"),
        ({"alpha": (0.1, 1.6)}, "alpha must be"),
        ({"model": "cubic"}, "model"),
    ],
)
def test_a_mistaken_argument_is_refused(change, word):
    arguments = {"motions": bursts(3, seed=0), "overturned": [True, False, True], "candidate_count": 128} | change
    with pytest.raises(rocking.errors.OptionError, match=word):
        rocking.calibrate(**arguments)


# The parts: space, population, posterior.


def test_even_points_fill_the_space_evenly():
    space = Space.from_bounds((1.0, 4.0), (0.1, 0.2), (0.5, 1.0), two_sided=True)
    rng = np.random.default_rng(0)
    points = space.sample_quasi_randomly(4096, rng)
    low, high = space.box
    independent = low + rng.random((200_000, 4)) * (high - low)
    inside = independent[space.contains(independent)]
    assert space.volume == pytest.approx(len(inside) / 200_000 * np.prod(high - low), rel=0.02)
    # Means are those of the uniform density, closer than independent points would be (0.3/sqrt(4096) of the width).
    np.testing.assert_allclose(points.mean(axis=0) / (high - low), inside.mean(axis=0) / (high - low), atol=5e-3)


def test_the_slenderness_of_a_side_is_the_mean_times_or_over_the_root_of_the_ratio():
    space = Space.from_bounds((1.0, 9.0), (0.01, 1.0), (0.1, 1.0), two_sided=True)
    point = np.log([[3.0, 0.1, 0.5, 4.0]])
    for name, expected in (("p", [3.0, 3.0]), ("alpha", [0.2, 0.05]), ("restitution", [0.5, 0.5])):
        np.testing.assert_allclose(space.sides(point)[name][0], expected, rtol=1e-12)
    assert list(space.parameters_by_name(point)) == ["p", "alpha_plus", "alpha_minus", "restitution"]


def test_a_known_slenderness_leaves_nothing_in_which_the_sides_differ():
    space = Space.from_bounds((1.0, 9.0), 0.2, (0.1, 1.0), two_sided=True)
    assert not space.is_two_sided
    assert list(space.parameters_by_name(np.log([[3.0, 0.5]]))) == ["p", "restitution"]
    for name, expected in (("p", 3.0), ("alpha", 0.2), ("restitution", 0.5)):
        np.testing.assert_allclose(space.sides(np.log([[3.0, 0.5]]))[name][0], expected, rtol=1e-12)


@pytest.fixture(scope="module")
def threshold_evidence():
    """Symmetric blocks that overturn where alpha is below a threshold, one threshold for each of 40 tests."""
    space = Space.from_bounds((1.0, 2.0), (0.05, 0.5), (0.5, 0.9), two_sided=False)
    rng = np.random.default_rng(3)
    points = space.sample_quasi_randomly(4096, rng)
    thresholds = np.log(np.geomspace(0.08, 0.35, 40))
    fallen = (points[:, 1:2] < thresholds).astype(np.float32)
    observed = np.log(0.17) + 0.1 * rng.standard_normal(40) < thresholds
    return Evidence(Candidates(space, points, fallen, len(points)), observed, 0.01), thresholds


def test_the_chance_of_overturning_is_the_share_of_the_population(threshold_evidence):
    evidence, thresholds = threshold_evidence
    centre, dispersion = math.log(0.17), 0.13
    populations = np.array([[math.log(1.4), centre, math.log(0.7), *np.log([0.18, dispersion, 0.18])]])
    share = [0.5 * (1.0 + math.erf((threshold - centre) / dispersion / math.sqrt(2.0))) for threshold in thresholds]
    # 4096 candidates, of which some 150 stand within the population's reach.
    np.testing.assert_allclose(evidence.probabilities(populations)[0], 0.01 + 0.98 * np.array(share), atol=0.03)


def test_the_posterior_is_that_of_brute_force(threshold_evidence):
    evidence, _ = threshold_evidence
    drawn = sample_posterior(evidence, 512, 4, np.random.default_rng(0))
    rng = np.random.default_rng(1)
    space = evidence.candidates.space
    prior = searching.extend_to_populations(space, space.sample_quasi_randomly(8000, rng), rng)
    likelihood = np.exp(evidence.log_likelihoods(prior))
    weights = likelihood / likelihood.sum()
    mean = weights @ prior
    deviation = np.sqrt(weights @ (prior - mean) ** 2)
    effective = min(1.0 / (weights**2).sum(), 512)
    assert effective > 100
    assert np.all(np.abs(drawn.mean(axis=0) - mean) < 4.0 * deviation * math.sqrt(2.0 / effective))
    np.testing.assert_allclose(drawn.std(axis=0), deviation, rtol=0.3)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("candidates", "goes_on", "populations"),
    [
        (2500, False, 64),
        pytest.param(2500, False, 256, marks=pytest.mark.thorough),
        pytest.param(512, True, 256, marks=pytest.mark.thorough),
    ],
)
def test_a_search_goes_on_while_few_candidates_speak_for_what_it_found(
    threshold_evidence, monkeypatch, candidates, goes_on, populations
):
    monkeypatch.setattr(searching, "_SAMPLE_COUNT", populations)
    evidence, thresholds = threshold_evidence
    space = evidence.candidates.space

    def tried(points):
        return (points[:, 1:2] < thresholds).astype(np.float32)

    found = search(Problem(space, evidence.observed, 0.01, tried), candidates, np.random.default_rng(5))
    assert max(found.r_hat.values()) < MAX_R_HAT
    drawn = found.evidence.candidates.filling_count + sum(count for count, _ in found.evidence.candidates.proposals)
    assert drawn == pytest.approx((13.0 / 7.0 if goes_on else 1.0) * candidates, rel=0.05)
    assert (found.effective_count < 100.0) == goes_on


def test_shares_are_sums_over_weighted_candidates(threshold_evidence):
    """In single precision, against double precision without leaving anything out."""
    evidence, _ = threshold_evidence
    rng = np.random.default_rng(6)
    populations = searching.extend_to_populations(evidence.candidates.space, evidence.candidates.points[:50], rng)
    centre, dispersion = searching.split_populations(populations)
    apart = (evidence.candidates.points - centre[:, None]) / dispersion[:, None]
    weights = np.exp(-0.5 * (apart**2).sum(axis=2) + evidence.candidates.log_weights)
    weights /= weights.sum(axis=1, keepdims=True)
    share = weights @ evidence.candidates.overturned
    effective = 1.0 / (weights**2).sum(axis=1)
    np.testing.assert_allclose(evidence.count_effective(populations), effective, rtol=2e-3)
    count = effective[:, None]
    expected = 0.01 + 0.98 * (count * share + 0.5) / (count + 1.0)
    np.testing.assert_allclose(evidence.probabilities(populations), expected, atol=2e-4)
    np.testing.assert_allclose(evidence.weights(populations), weights, atol=2e-4)


def test_a_low_exponent_widens_the_posterior(threshold_evidence):
    evidence, _ = threshold_evidence
    spread = [
        sample_posterior(evidence, 256, 2, np.random.default_rng(7), exponent=exponent)[:, 1].std()
        for exponent in (0.03, 0.3, 1.0)
    ]
    assert spread[0] > 1.5 * spread[1] > 2.0 * spread[2]


def test_a_motion_that_is_given_twice_is_simulated_once(coarse, monkeypatch):
    motions = bursts(12, seed=4)
    counted = []

    def spy(blocks, motions, **options):
        counted.append(len(motions))
        return rocking.simulate_many(blocks, motions, **options)

    monkeypatch.setattr("rocking.calibration.outcomes.simulate_many", spy)
    twice = motions + [rocking.Motion(one.breakpoints, one.coefficients, name="again") for one in motions]
    observed = outcomes(twice)
    found = rocking.calibrate(twice, observed, candidate_count=128, two_sided=False, model="linear")
    assert set(counted) == {12}
    np.testing.assert_allclose(found.probabilities[:12], found.probabilities[12:], rtol=1e-12)


def test_tests_that_are_left_out_do_not_count(threshold_evidence):
    evidence, _ = threshold_evidence
    some = np.arange(40) < 30
    flipped = Evidence(
        evidence.candidates, np.where(some, evidence.observed, ~evidence.observed), evidence.outlier_probability
    )
    first, second = (
        sample_posterior(one.select_tests(some), 64, 2, np.random.default_rng(2)) for one in (evidence, flipped)
    )
    np.testing.assert_array_equal(first, second)


def test_the_number_of_threads_changes_no_bit(threshold_evidence):
    evidence, _ = threshold_evidence
    points = evidence.candidates.points[:100]
    populations = np.hstack([points, np.full_like(points, -2.0)])
    found = []
    for threads in (1, 2, 5):
        with rocking.set_options(threads=threads):
            found.append(evidence.probabilities(populations))
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


def test_one_candidate_predicts_no_certainty(threshold_evidence):
    evidence, _ = threshold_evidence
    point = evidence.candidates.points[10]
    populations = np.concatenate([point, np.full(3, math.log(1e-4))])[None]
    assert evidence.count_effective(populations)[0] == pytest.approx(1.0, abs=1e-6)
    expected = 0.01 + 0.98 * np.where(evidence.candidates.overturned[10] > 0.5, 0.75, 0.25)
    np.testing.assert_allclose(evidence.probabilities(populations)[0], expected, atol=1e-6)


def test_the_density_is_that_of_what_is_drawn():
    rng = np.random.default_rng(5)
    populations = np.array([[0.0, 1.0, 2.0, -2.3, -1.7, -2.9], [0.2, 1.1, 2.1, -2.3, -2.3, -2.3]])
    points = searching.sample_points(populations, 1.5, 40_000, rng)
    few = points[:100, None]
    centre, dispersion = searching.split_populations(populations)
    parts = norm.pdf(few, centre, 1.5 * dispersion).prod(axis=2)
    np.testing.assert_allclose(
        searching.compute_log_density(populations, 1.5, points[:100]), np.log(parts.mean(axis=1)), atol=1e-9
    )
    density = np.exp(searching.compute_log_density(populations, 1.5, points))
    box = (points > [0.0, 0.9, 1.95]) & (points < [0.2, 1.1, 2.05])
    inside = box.all(axis=1)
    # The mean of 1/density over points in a box is its volume over its share.
    assert (1.0 / density[inside]).sum() / len(points) == pytest.approx(0.2 * 0.2 * 0.1, rel=0.05)


def test_scores_of_known_predictions():
    scores = Scores.from_predictions([0.8, 0.4, 0.5], [1, 1, 0])
    assert scores.accuracy == pytest.approx(2 / 3)
    assert scores.log_loss == pytest.approx(-(math.log(0.8) + math.log(0.4) + math.log(0.5)) / 3)
    assert scores.brier == pytest.approx((0.04 + 0.36 + 0.25) / 3)
    assert Scores.from_predictions([1.0], [0]).log_loss == math.inf


@pytest.mark.parametrize("probabilities", [[0.5], [1.2, 0.1], [math.nan, 0.1], []])
def test_scores_refuse_what_is_no_probability(probabilities):
    with pytest.raises(rocking.errors.OptionError):
        Scores.from_predictions(probabilities, [True, False])


# Histories: release tests and forced rocking.

TIMES = np.arange(0.0, 6.0, 0.01)
NOISE = 1e-3


def released(model: str = "nonlinear", seed: int = 0, block: rocking.Block | None = None) -> np.ndarray:
    rocks = block or rocking.Block.from_parameters(p=2.5, alpha=0.2, restitution=0.88)
    response = rocking.simulate(rocks, None, model=model, initial_rotation=0.1, duration=float(TIMES[-1]))
    return response.rotation(TIMES) + np.random.default_rng(seed).normal(0.0, NOISE, len(TIMES))


def errors(found: HistoryCalibration, truth: dict[str, float]) -> dict[str, float]:
    """Errors in standard errors."""
    return {
        name: (estimate.value - truth[name]) / estimate.deviation
        for name, estimate in found.estimates.items()
        if name in truth
    }


TRUTH = {"p": 2.5, "alpha": 0.2, "restitution": 0.88, "initial_rotation": 0.1}


@pytest.fixture(scope="module")
def free(coarsely):
    with coarsely():
        return rocking.calibrate_history(TIMES, released())


KNOWN = {"p": 2.5, "alpha": 0.2, "initial_rotation": 0.1}


@pytest.fixture(scope="module")
def sure(coarsely):
    with coarsely():
        return rocking.calibrate_history(TIMES, released(), **KNOWN)


@pytest.fixture(scope="module")
def mirrored(coarsely):
    with coarsely():
        return rocking.calibrate_history(TIMES, -released(), p=2.5, alpha=0.2)


@pytest.mark.thorough
def test_a_release_test_gives_the_block_within_its_errors_in_the_linear_model_too(coarse, free):
    # With p known, the other model's restitution is 6 standard errors off.
    linear = rocking.calibrate_history(TIMES, released("linear"), model="linear", p=2.5, initial_rotation=0.1)
    for found, count in ((free, 4), (linear, 2)):
        is_within_its_errors(found, count)


@pytest.mark.slow
def test_a_full_search_gives_the_block_within_its_errors_too():
    is_within_its_errors(rocking.calibrate_history(TIMES, released()), 4)


def is_within_its_errors(found: HistoryCalibration, count: int) -> None:
    assert len(errors(found, TRUTH)) == count
    assert all(abs(error) < 3.5 for error in errors(found, TRUTH).values())
    assert found.estimates["restitution"].deviation < 1e-3
    assert found.misfit == pytest.approx(NOISE, rel=0.1)


@pytest.mark.slow
def test_standard_errors_are_those_of_repeated_tests():
    fits = [rocking.calibrate_history(TIMES, released(seed=seed)) for seed in range(16)]
    for name, truth in TRUTH.items():
        scaled = [errors(found, {name: truth})[name] for found in fits]
        # The root mean square of 16 standard normals is within these with 99.9 %.
        assert 0.48 < math.sqrt(np.mean(np.square(scaled))) < 1.59, name


@pytest.mark.thorough
@pytest.mark.parametrize(
    "known", [pytest.param({}, marks=pytest.mark.thorough), {"p": 2.5, "initial_rotation": 0.1}], ids=str
)
def test_two_sides_are_told_apart(coarse, known):
    p = known.get("p", (2.5, 2.3))
    block = rocking.Block.from_parameters(p=p, alpha=(0.18, 0.24), restitution=(0.9, 0.84))
    found = rocking.calibrate_history(TIMES, released(block=block), two_sided=True, **known)
    truth = {
        f"{name}_{side}": getattr(block.sides[k], name)
        for k, side in enumerate(("plus", "minus"))
        for name in ("p", "alpha", "restitution")
    }
    apart = errors(found, truth)
    assert len(apart) == (4 if known else 6)
    assert all(abs(error) < 4.0 for error in apart.values())


@pytest.mark.parametrize("known", [{"p": 2.5}, pytest.param({}, marks=pytest.mark.thorough)], ids=str)
def test_forced_rocking_gives_the_block(coarse, known):
    block = rocking.Block.from_parameters(p=2.5, alpha=0.2, restitution=0.88)
    motion = rocking.records.load("el-centro-meloland-270").scaled(0.9)
    times = np.arange(0.0, 30.0, 0.02)
    measured = rocking.simulate(block, motion, duration=30.0).rotation(times)
    measured += np.random.default_rng(2).normal(0.0, NOISE, len(times))
    found = rocking.calibrate_history(times, measured, motion, **known)
    assert set(found.estimates) == {"p", "alpha", "restitution"} - set(known)
    assert all(abs(error) < 3.5 for error in errors(found, TRUTH).values())


@pytest.mark.parametrize(
    "known", [pytest.param({}, marks=pytest.mark.thorough), {"alpha": 0.2, "initial_rotation": 0.1}], ids=str
)
def test_without_noise_the_block_is_found_exactly(coarse, known):
    clean = rocking.simulate(
        rocking.Block.from_parameters(p=2.5, alpha=0.2, restitution=0.88), None, initial_rotation=0.1, duration=5.99
    ).rotation(TIMES)
    found = rocking.calibrate_history(TIMES, clean, **known)
    assert set(found.estimates) == set(TRUTH) - set(known)
    for name, estimate in found.estimates.items():
        assert estimate.value == pytest.approx(TRUTH[name], rel=1e-6)


def test_a_calibration_draws_what_was_measured_and_what_it_predicts(found, told):
    tests = found.plot().axes[0]
    curve, fell, _ = tests.lines
    np.testing.assert_array_equal(curve.get_ydata(), np.sort(found.probabilities))
    assert len(fell.get_xdata()) == told[1].sum()
    assert [axes.get_xlabel() for axes in found.plot().axes[1:]] == ["p (rad/s)", "alpha (rad)", "restitution"]
    mine = Figure()
    assert found.plot(mine.add_subplot()) is mine and len(mine.axes) == 1
    assert found.plot(figsize=(3.4, 4.0)).get_size_inches().tolist() == [3.4, 4.0]


def test_what_is_known_is_kept(sure, mirrored):
    assert (sure.block.p, sure.block.alpha) == (2.5, 0.2)
    assert set(sure.estimates) == {"restitution"}
    assert 1.5 * sure.estimates["restitution"].deviation < mirrored.estimates["restitution"].deviation


def test_a_fit_at_a_bound_says_so(coarse):
    found = rocking.calibrate_history(TIMES, released(), alpha=0.2, initial_rotation=0.1, restitution=(0.3, 0.8))
    assert found.estimates["restitution"].is_at_bound
    assert "at its bound" in found.summary()
    assert not found.estimates["p"].is_at_bound


def test_a_release_to_the_other_side_is_found_too(mirrored):
    assert mirrored.estimates["initial_rotation"].value == pytest.approx(-0.1, abs=1e-3)
    assert mirrored.estimates["restitution"].value == pytest.approx(0.88, abs=2e-3)


def test_errors_with_white_noise_are_those_of_least_squares(sure):
    step = 1e-5
    sides = [rocking.Block.from_parameters(p=2.5, alpha=0.2, restitution=0.88 + sign * step) for sign in (1, -1)]
    # The same noise is in both, and cancels.
    slope = (released(block=sides[0]) - released(block=sides[1])) / (2.0 * step)
    # The autocorrelation of white noise, summed to its first value that is not positive, is 1 and a little.
    ratio = sure.estimates["restitution"].deviation * np.linalg.norm(slope) / sure.misfit
    assert 0.99 < ratio < 1.15


@pytest.mark.parametrize("known", [pytest.param({}, marks=pytest.mark.slow), KNOWN])
def test_correlated_noise_widens_the_errors(coarse, sure, known):
    white = np.random.default_rng(0).normal(0.0, 1.0, len(TIMES))
    correlated = np.convolve(white, np.ones(20) / math.sqrt(20), mode="same")
    clean = released() - np.random.default_rng(0).normal(0.0, NOISE, len(TIMES))
    sharp = sure if known else rocking.calibrate_history(TIMES, clean + NOISE * white)
    wide = rocking.calibrate_history(TIMES, clean + NOISE * correlated, **known)
    assert wide.misfit == pytest.approx(sharp.misfit, rel=0.15)
    assert wide.estimates["restitution"].deviation > 2.0 * sharp.estimates["restitution"].deviation


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"times": TIMES[:-1]}, "must have the same shape"),
        ({"times": TIMES - 1.0}, "nonnegative and increasing"),
        ({"times": TIMES[::-1]}, "nonnegative and increasing"),
        ({"rotation": np.full(len(TIMES), math.nan)}, "finite"),
        ({"rotation": np.zeros(len(TIMES))}, "zero throughout"),
        ({"rotation": np.full(len(TIMES), 10.0)}, "rad"),
        ({"rotation": np.roll(released(), 1) * (TIMES > 0.0)}, "set initial_rotation"),
        ({"rotation": ["a"] * len(TIMES)}, "numbers"),
        ({"times": TIMES[:6], "rotation": released()[:6]}, "6 samples"),
        pytest.param(
            {"times": TIMES[:30], "rotation": released()[:30]}, "does not determine restitution", marks=pytest.mark.slow
        ),
        ({"p": 2.5, "alpha": 0.2, "restitution": 0.9, "initial_rotation": 0.1}, "all parameters are known"),
        ({"model": "cubic"}, "model"),
    ],
)
def test_a_mistaken_history_is_refused(change, word):
    arguments = {"times": TIMES, "rotation": released()} | change
    with pytest.raises(rocking.errors.OptionError, match=word):
        rocking.calibrate_history(**arguments)


def test_an_ensemble_is_read_as_it_was_written(found, tmp_path):
    found.to_csv(tmp_path / "ensemble.csv")
    read = read_ensemble(tmp_path / "ensemble.csv")
    assert read.model == found.model
    assert read.weights == pytest.approx(found.weights, rel=1e-9)
    for name in ("p", "alpha", "restitution"):
        assert getattr(read.blocks, name) == pytest.approx(getattr(found.blocks, name), rel=1e-9)
    text = (tmp_path / "ensemble.csv").read_text()
    for damaged, said in (
        (text.replace("weight", "wait", 1), "line 1: expected the ensemble.csv"),
        (text.replace("linear", "cubic", 1), "line 2: 'cubic' is not linear or nonlinear"),
        (text.replace("linear", "nonlinear", 1), "one model"),
    ):
        (tmp_path / "damaged.csv").write_text(damaged)
        with pytest.raises(rocking.errors.RecordError, match=said):
            read_ensemble(tmp_path / "damaged.csv")


def test_an_error_within_a_table_keeps_what_it_is_about(tmp_path):
    ensemble, outcomes = tmp_path / "ensemble.csv", tmp_path / "outcomes.csv"
    sides = ",".join(f"{name}_{side}" for name in ("p", "alpha", "restitution") for side in ("plus", "minus"))
    header = sides.replace("p_plus,p_minus", "p_plus_rad_s,p_minus_rad_s").replace("alpha_plus", "alpha_plus_rad")
    header = header.replace("alpha_minus", "alpha_minus_rad")
    ensemble.write_text(f"{header},weight,model\n2,2,0.2,0.2,-0.5,0.9,1,linear\n")
    with pytest.raises(rocking.errors.BlockError, match="line 2: restitution must be") as caught:
        read_ensemble(ensemble)
    error = caught.value
    assert (error.argument, error.path, error.value) == ("restitution", str(ensemble), -0.5)
    outcomes.write_text("motion,overturned\nel-centro-meloland-270,1\nnothing.AT2,0\n")
    with pytest.raises(rocking.errors.RecordError, match="line 2: dt must be a positive number") as caught:
        read_calibration(outcomes, channel=None, dt=-1.0, units=None)
    error = caught.value
    assert (error.argument, error.path, error.line, error.value) == ("dt", str(outcomes), 2, -1.0)


def test_rows_without_a_group_belong_to_none(tmp_path):
    table = tmp_path / "outcomes.csv"
    scales = enumerate(["near", "", "", "near"], start=1)
    rows = [f"ridgecrest-clc-090,{scale},1,{group}" for scale, group in scales]
    table.write_text("\n".join(["motion,scale,overturned,group", *rows]))
    read = read_calibration(table, channel=None, dt=None, units=None)
    assert label_groups([test.group for test in read], 4, fold_count=3).tolist() == [0, 1, 2, 0]


def test_a_pair_of_equal_numbers_is_known_and_nothing_unknown_says_what_to_call(shaken):
    space = Space.from_bounds((3.0, 3.0), (0.1, 0.2), (0.9, 0.9), two_sided=False)
    assert space.known == {"p": 3.0, "restitution": 0.9}
    with pytest.raises(rocking.errors.OptionError, match=r"call simulate or fragility"):
        rocking.calibrate(*shaken, p=(3.0, 3.0), alpha=0.2, restitution=(0.9, 0.9), model="linear")
    with pytest.raises(rocking.errors.OptionError, match=r"call simulate or fragility"):
        rocking.calibrate_history([0.0, 0.1], [0.1, 0.1], p=3.0, alpha=0.2, restitution=0.9, initial_rotation=0.1)


@pytest.mark.parametrize("share, told", [(0.08, True), (0.03, False)])
def test_a_posterior_whose_interval_ends_at_a_bound_is_told(share, told):
    space = Space.from_bounds((1.0, 10.0), 0.2, 0.9, two_sided=False)
    ends = np.log([9.9, 3.0])
    centres = np.repeat(ends, [round(1000 * share), 1000 - round(1000 * share)])[:, None]
    notes = [str(one) for one in list_bounds_reached(space, centres)]
    assert len(notes) == told
    assert all("8 % of the posterior" in note and "sets the upper end of the interval" in note for note in notes)


def test_a_column_that_is_there_twice_is_refused(tmp_path):
    for text in (
        "motion,overturned,overturned\nel-centro-meloland-270,0,1\n",
        "time_s,rotation_rad,rotation_deg\n0,0.1,1\n0.1,0.1,1\n",
        "time_s,time_s,rotation_deg\n0,0.1,1\n0.1,0.1,1\n",
    ):
        path = tmp_path / "table.csv"
        path.write_text(text)
        with pytest.raises(rocking.errors.RecordError, match=r"must contain either|must be distinct"):
            read_calibration(path, channel=None, dt=None, units=None)
