"""Stochastic motions against the theory of Gaussian processes: variance, crossings, extremes, filter, seeds."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.optimize
import scipy.signal
import scipy.stats

import rocking
from rocking import synthesize_motions
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import OptionError
from rocking.studies import read_study

PARAMETERS: dict[str, float] = {"arias_intensity": 1.2, "duration": 10.0, "middle_time": 7.0, "frequency": 4.0}
FILTER: dict[str, float] = {"frequency_rate": -0.15, "damping": 0.4}
COUNT = 400


@pytest.fixture(scope="module")
def unfiltered() -> np.ndarray:
    motions = synthesize_motions(COUNT, **PARAMETERS, **FILTER, highpass=0.0, seed=7)
    return np.stack([motion.samples for motion in motions], axis=1)


def envelope(times: np.ndarray) -> np.ndarray:
    """Standard deviation by an independent search for the gamma density with the requested times of Arias intensity."""

    def mismatch(shape: float) -> float:
        first, middle, last = scipy.stats.gamma.ppf([0.05, 0.45, 0.95], shape)
        return float((last - first) / middle - 10.0 / 7.0)

    shape = scipy.optimize.bisect(mismatch, 1.01, 100.0, xtol=1e-12)
    density = scipy.stats.gamma(shape, scale=7.0 / scipy.stats.gamma.ppf(0.45, shape)).pdf(times)
    return np.sqrt(2.0 * STANDARD_GRAVITY / math.pi * 1.2 * density)


def test_the_variance_follows_the_envelope(unfiltered: np.ndarray) -> None:
    times = 0.01 * np.arange(len(unfiltered))
    blocks = np.array_split(np.arange(5, len(times)), 20)
    expected = np.array([np.mean(envelope(times[block]) ** 2) for block in blocks])
    measured = np.array([np.mean(unfiltered[block] ** 2) for block in blocks])
    each = np.array([np.mean(unfiltered[block] ** 2, axis=0).std() / math.sqrt(COUNT) for block in blocks])
    assert np.all(np.abs(measured - expected) < 4.0 * each)
    assert np.sum(measured) == pytest.approx(np.sum(expected), rel=0.03)


def test_zero_level_crossings_are_those_of_a_filtered_gaussian_process(unfiltered: np.ndarray) -> None:
    """Between two samples with correlation r a Gaussian process rises through zero with probability acos(r)/(2 pi)."""
    crossings = (unfiltered[:-1] < 0.0) & (unfiltered[1:] >= 0.0)
    for start in (400, 700, 1000):
        instants = np.arange(start, start + 100)
        rates = 2.0 * math.pi * (4.0 - 0.15 * (0.01 * instants - 7.0))
        damped, lag = rates * math.sqrt(1.0 - 0.4**2), 0.01
        correlation = np.exp(-0.4 * rates * lag) * (np.cos(damped * lag) + 0.4 * rates / damped * np.sin(damped * lag))
        expected = np.mean(np.arccos(correlation)) / (2.0 * math.pi)
        assert crossings[instants].mean() == pytest.approx(expected, rel=0.03)
        assert expected / lag == pytest.approx(rates.mean() / (2.0 * math.pi), rel=0.05)  # the filter's own frequency


def test_extremes_are_those_of_independent_crossings(unfiltered: np.ndarray) -> None:
    """Crossings of high levels are a Poisson process with rate f exp(-a^2/(2 q^2)) on each side."""
    times = 0.01 * np.arange(1, len(unfiltered))
    frequency, deviation = 4.0 - 0.15 * (times - 7.0), envelope(times)
    peaks = np.sort(np.abs(unfiltered).max(axis=0))
    for fraction in (0.5, 0.8, 0.95):
        level = peaks[int(fraction * COUNT)]
        expected = math.exp(-0.01 * float(np.sum(2.0 * frequency * np.exp(-0.5 * (level / deviation) ** 2))))
        error = math.sqrt(fraction * (1.0 - fraction) / COUNT)
        assert expected == pytest.approx(fraction, abs=4.0 * error + 0.04)


def test_measures_are_close_to_the_parameters() -> None:
    motions = synthesize_motions(200, **PARAMETERS, **FILTER, seed=3)
    arias = np.array([motion.arias_intensity for motion in motions])
    assert arias.mean() == pytest.approx(1.2, abs=4.0 * arias.std() / math.sqrt(200.0) + 0.03)
    assert np.mean([motion.significant_duration() for motion in motions]) == pytest.approx(10.0, rel=0.05)
    middle = np.mean([motion.significant_duration(0.0, 0.45) for motion in motions])
    assert middle == pytest.approx(7.0, rel=0.05)


def test_the_filter_is_exact_and_leaves_no_velocity() -> None:
    (raw,) = synthesize_motions(1, **PARAMETERS, highpass=0.0, seed=2)
    (motion,) = synthesize_motions(1, **PARAMETERS, highpass=0.2, seed=2)
    corner = 0.4 * math.pi
    times, samples = motion.times, np.pad(raw.samples, (0, len(motion.times) - len(raw.times)))
    _, expected, _ = scipy.signal.lsim(([1.0, 0.0, 0.0], [1.0, 2.0 * corner, corner**2]), samples, times)
    np.testing.assert_allclose(motion.samples, expected, atol=1e-9 * motion.pga)
    assert abs(motion.velocity(motion.duration)) < 1e-3 * motion.pgv
    assert abs(raw.displacement(raw.duration)) > 3.0 * motion.pgd  # without the filter it drifts


@pytest.mark.parametrize("count", [1, 16, 17, 40])
def test_a_motion_depends_on_its_seed_and_number_only(count: int) -> None:
    reference = synthesize_motions(33, **PARAMETERS, seed=5)
    motions = synthesize_motions(count, **PARAMETERS, seed=5)
    for k in range(min(count, 33)):
        assert np.array_equal(motions[k].coefficients, reference[k].coefficients)
        assert motions[k].name == f"stochastic 5-{k + 1}"
    assert not np.array_equal(synthesize_motions(1, **PARAMETERS, seed=6)[0].samples, reference[0].samples)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"duration": 40.0}, "duration must be from 0.033 to 4.93 times middle_time, not 5.714 times"),
        ({"damping": 1.0}, "damping must be a number between 0 and 1"),
        ({"frequency": 40.0}, "dt must be at most a quarter of the shortest period of the filter, 0.0063 s"),
        ({"highpass": 5.0}, "highpass must be a number from 0 to 4"),
        ({"dt": 1e-4}, "at most 20000 are possible; increase dt"),
        ({"arias_intensity": -1.0}, "arias_intensity must be a positive number"),
        ({"seed": -1}, "seed must be a whole number of at least 0"),
    ],
)
def test_impossible_parameters_are_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(OptionError) as caught:
        synthesize_motions(2, **(PARAMETERS | changes))
    assert words in str(caught.value)


TEXT = "arias_intensity=1.2m/s,duration=10s,middle_time=7s,frequency=4Hz,count=3,seed=4"


def test_commands_and_studies_accept_stochastic_motions(
    run: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    code, out, _ = run("simulate", "--stochastic", TEXT, "--width", "0.3", "--height", "1.5", "--json")
    rows = json.loads(out)["records"]
    motions = synthesize_motions(3, **PARAMETERS, seed=4)
    assert code == 0 and [row["record"] for row in rows] == [motion.name for motion in motions]
    peaks = [rocking.simulate(rocking.Block(width=0.3, height=1.5), motion).peak_rotation for motion in motions]
    assert [row["peak_rotation_rad"] for row in rows] == pytest.approx(peaks, rel=1e-6)
    code, _, err = run("simulate", "--stochastic", "count=3,seed=4", "--width", "0.3", "--height", "1.5")
    assert code == 2 and "stochastic also requires arias_intensity and duration" in err
    file = tmp_path / "study.toml"
    table = 'count = 3\nseed = 4\narias_intensity = 1.2\nduration = "10s"\nmiddle_time = 7\nfrequency = "4Hz"'
    file.write_text(f"[blocks]\nwidth = 0.5\nheight = 2.0\n[motions]\n[[motions.stochastic]]\n{table}\n")
    study = read_study(file).product.motions
    assert all(np.array_equal(a.samples, b.samples) for a, b in zip(study, motions, strict=True))
