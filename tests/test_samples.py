"""Blocks with uncertain parameters: distributions, stratified samples, and the survival of a rock of uncertain size."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.stats

import rocking
from rocking import Block, Blocks, HazardCurve, lognormal, normal, uniform
from rocking.errors import BlockError, OptionError
from rocking.inputs.bodies import sample_bodies
from rocking.inputs.declared import INPUTS

DISTRIBUTIONS: dict[str, tuple[Any, Any]] = {
    "normal": (normal(0.3, 0.02), scipy.stats.norm(0.3, 0.02)),
    "truncated": (normal(0.3, 0.2, low=0.1, high=0.6), scipy.stats.truncnorm(-1.0, 1.5, 0.3, 0.2)),
    "lognormal": (lognormal(0.3, 0.1), scipy.stats.lognorm(0.1, scale=0.3)),
    "uniform": (uniform(0.2, 0.4), scipy.stats.uniform(0.2, 0.2)),
}


@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_quantiles_are_those_of_scipy(name: str) -> None:
    ours, reference = DISTRIBUTIONS[name]
    fractions = np.linspace(1e-6, 1.0 - 1e-6, 101)
    np.testing.assert_allclose(ours.ppf(fractions), reference.ppf(fractions), rtol=1e-12)


@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_every_interval_of_equal_probability_contains_one_block(name: str) -> None:
    ours, reference = DISTRIBUTIONS[name]
    blocks = Blocks.sample(64, width=ours, height=1.2, seed=3)
    widths = 2.0 * np.array([0.6 * math.tan(alpha) for alpha in blocks.alpha[:, 0]])
    assert sorted(np.floor(64 * reference.cdf(widths)).astype(int)) == [*range(64)]
    again = Blocks.sample(64, width=reference, height=1.2, seed=3)  # a distribution of SciPy
    np.testing.assert_allclose(again.alpha, blocks.alpha, rtol=1e-12)
    assert not np.array_equal(Blocks.sample(64, width=ours, height=1.2, seed=4).alpha, blocks.alpha)


def test_parameters_are_independent_and_correlated_ones_come_as_arrays() -> None:
    blocks = Blocks.sample(2000, Block.from_parameters, p=normal(3.0, 0.2), alpha=normal(0.2, 0.02), restitution=0.9)
    assert abs(np.corrcoef(blocks.p[:, 0], blocks.alpha[:, 0])[0, 1]) < 0.05
    widths = np.linspace(0.3, 0.5, 5)
    both = Blocks.sample(5, width=widths, height=4.0 * widths, offset=normal(0.0, 0.01))
    p_alpha = [(side.p, side.alpha) for block in both for side in block.sides]
    assert len({p for p, _ in p_alpha}) == 10
    assert both.alpha.mean(axis=1) == pytest.approx(math.atan(0.25), rel=0.01)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: normal(0.3, 0.0), "deviation must be a positive number"),
        (lambda: normal(0.3, 0.1, low=0.5), "mean must be between low and high; got 0.3, 0.5 and inf"),
        (lambda: uniform(0.4, 0.2), "must be (lower, higher)"),
        (lambda: Blocks.sample(10, width=0.3, height=1.0), "no parameter is uncertain"),
        (lambda: Blocks.sample(0, width=normal(0.3, 0.1), height=1.0), "count must be a whole number of at least 1"),
        (lambda: Blocks.sample(9, width=np.ones(3), height=1.0), "width must be an array of 9 values"),
        (lambda: Blocks.sample(50, width=normal(0.3, 0.2), height=1.0), "is not possible: width must be"),
        (lambda: INPUTS["width"].read_uncertain("0.3 +- -1"), "width must be a mean and a positive standard deviation"),
    ],
)
def test_impossible_distributions_and_samples_are_refused(call: Callable[[], object], words: str) -> None:
    with pytest.raises((OptionError, BlockError)) as caught:
        call()
    assert words in str(caught.value)


def test_a_text_gives_a_mean_and_a_standard_deviation_in_one_unit() -> None:
    texts = ["0.30 +- 0.02", "30+-2cm", "30 cm ± 20 mm", "0.30m +/- 2cm", "300 ± 20 mm"]
    read = [INPUTS["width"].read_uncertain(text) for text in texts]
    assert [(one.first, one.second) for one in read] == [(pytest.approx(0.3), pytest.approx(0.02))] * 5
    assert INPUTS["alpha"].read_uncertain("12deg +- 1deg").first == pytest.approx(math.radians(12.0))
    assert INPUTS["width"].read_uncertain("30cm") == 0.3


def test_samples_carry_restraints() -> None:
    values = {"width": normal(0.6, 0.02), "height": 3.0, "mass": 500.0}
    tied = sample_bodies(values, 20, restraints=[rocking.Tendon(stiffness=1e5)])
    assert len(tied) == 20
    terms = tied.terms["cosine_coefficient"], tied.terms["sine_coefficient"]
    assert any(np.unique(each[:, 0]).size > 1 for each in terms)


PULSES = [rocking.pulses.one_sine(1.0, frequency) for frequency in np.linspace(0.5, 1.5, 9)]
LEVELS = np.linspace(1.0, 12.0, 12)
SITE = HazardCurve([0.5, 1.0, 2.0, 4.0, 8.0], [5e-2, 2e-2, 6e-3, 1.2e-3, 1.5e-4])


def survival(count: int, seed: int) -> Any:
    blocks = Blocks.sample(count, seed=seed, width=normal(0.5, 0.08), height=uniform(1.2, 1.8))
    return rocking.fragility(blocks, PULSES, levels=LEVELS).survival(200.0, SITE)


def test_the_error_of_the_mean_survival_bounds_its_scatter_between_samples() -> None:
    """The stated error is that of independent samples; stratified ones scatter less."""
    repeats = [survival(12, seed) for seed in range(16)]
    many = survival(400, 99)
    means = np.array([one.mean_probability for one in repeats])
    stated = np.array([one.mean_error for one in repeats])
    assert 0.05 < many.mean_probability < 0.95
    assert many.mean_error == pytest.approx(stated.mean() * math.sqrt(11.0 / 399.0), rel=0.3)
    assert means.std(ddof=1) < 1.1 * stated.mean()
    assert abs(means.mean() - many.mean_probability) < 4.0 * stated.mean() / math.sqrt(16.0)
    assert f"(standard error of the sample {many.mean_error:.1g})" in many.summary()
    assert many.to_dict()["mean_probability_standard_error"] == many.mean_error


def test_one_command_computes_the_survival_of_a_rock_of_uncertain_size(
    tmp_path: Path, run: Callable[..., tuple[int, str, str]]
) -> None:
    hazard = tmp_path / "site.csv"
    hazard.write_text("pga_g,annual_rate\n0.05,0.05\n0.1,0.02\n0.2,6e-3\n0.4,1.2e-3\n0.8,1.5e-4\n")
    pulses = [word for f in (0.6, 0.8, 1.0, 1.3) for word in ("--pulse", f"one-sine:amplitude=1,frequency={f}")]
    rock = ["--width", "0.50 +- 0.05", "--height", "1.5 +- 0.1", "--levels", "0.1g:1.2g:12"]
    about = ["--hazard", str(hazard), "--standing", "200", "--samples", "30", "--json"]
    code, out, _ = run("fragility", *pulses, *rock, *about)
    assert code == 0
    result = json.loads(out)
    assert "30 blocks" in result["description"]
    assert 0.0 < result["survival"]["mean_probability_standard_error"] < result["survival"]["mean_probability"] < 1.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["simulate", "--width", "0.3+-0.02", "--height", "1"], "this analysis requires one number for --width"),
        (["fragility", "--width", "0.3", "--height", "1", "--samples", "9"], "--samples requires an uncertain size"),
    ],
)
def test_commands_explain_uncertain_sizes(
    arguments: list[str], words: str, run: Callable[..., tuple[int, str, str]]
) -> None:
    code, _, err = run(*arguments, "--pulse", "one-sine:amplitude=1,frequency=1")
    assert code == 2
    assert words in err
