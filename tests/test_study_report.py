"""What is made of a complete study: the same curves as from its simulations at once, by two commands."""

import itertools
import json
import math
import re

import numpy as np
import pytest

import rocking
from rocking.studies import results as reading

BLOCKS = rocking.Blocks.grid(p=[1.5, 2.0, 3.0], alpha=[0.1, 0.15, 0.2, 0.25], restitution=[0.9])
MOTIONS = [rocking.pulses.one_sine(1.0, frequency) for frequency in np.linspace(0.3, 1.6, 9)]
LEVELS = np.linspace(1.0, 9.0, 8)
LIMITS = {"overturning": math.inf, "half": 0.5}

TEXT = """\
[blocks]
p = [1.5, 2.0, 3.0]
alpha = [0.1, 0.2]
restitution = 0.9

[[motions.pulses]]
family = "one_sine"
amplitude = 1.0
frequency = "0.3:1.6:9"

[scales]
pga = "1:9:8"
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    made = rocking.create_study(
        tmp_path_factory.mktemp("study"), BLOCKS, MOTIONS, levels=LEVELS, measure="pga", blocks_per_batch=512
    )
    made.run()
    return made


@pytest.fixture(scope="module")
def curves(study):
    return study.block_fragilities(limit_states=LIMITS)


@pytest.fixture(scope="module")
def simulated():
    return rocking.simulate_many(BLOCKS, MOTIONS, levels=LEVELS, measure="pga")


def test_a_study_that_stops_its_simulations_early_gives_no_verdicts(tmp_path):
    short = rocking.create_study(tmp_path / "short", BLOCKS, MOTIONS, levels=LEVELS, measure="pga", duration=0.5)
    short.run()
    for report in (short.block_fragilities, short.spectrum):
        with pytest.raises(rocking.errors.StudyError, match="without a duration"):
            report()


@pytest.mark.parametrize("blocks", [(1, 11), pytest.param((0, 1, 5, 11), marks=pytest.mark.thorough)])
def test_the_curve_of_each_block_is_that_of_its_simulations(curves, blocks):
    fitted = 0
    for j, name in itertools.product(blocks, LIMITS):
        one = curves.data.sel(limit_state=name).isel(block=j)
        limits = {name: LIMITS[name]}
        try:
            curve = rocking.fragility(BLOCKS[j], MOTIONS, levels=LEVELS, limit_states=limits).curve(name)
        except rocking.errors.OptionError as error:
            assert str(one.fault.values) == str(error)
            continue
        fitted += 1
        ends = [float(one[name]) for name in ("median_lower", "median_upper", "dispersion_lower", "dispersion_upper")]
        assert [float(one["median"]), float(one.dispersion)] == pytest.approx(
            [curve.median, curve.dispersion], rel=1e-12
        )
        assert ends == pytest.approx([*curve.median_interval, *curve.dispersion_interval])
        assert float(one.exceedance_count) == curve.exceedance_counts.sum()
    assert fitted >= len(blocks)


@pytest.mark.parametrize(
    "measure", ["pgv", "pga_ratio", *(pytest.param(each, marks=pytest.mark.thorough) for each in ("pga", "pgv_ratio"))]
)
def test_one_curve_for_all_blocks_is_fitted_to_all_their_simulations(study, simulated, measure):
    of_motion = [motion.pga if measure.startswith("pga") else motion.pgv for motion in MOTIONS]
    per_pga = np.array(of_motion) / [motion.pga for motion in MOTIONS]
    unit = np.ones(len(BLOCKS))
    if measure.endswith("ratio"):
        unit = 9.80665 * np.tan(BLOCKS.alpha[:, 0]) / (1.0 if measure == "pga_ratio" else BLOCKS.p[:, 0])
    x = np.broadcast_to((per_pga[:, None] * LEVELS)[:, :, None] / unit, simulated.overturned.shape)
    motion = np.broadcast_to(np.arange(len(MOTIONS))[:, None, None], x.shape)
    reference = rocking.fit_fragility(
        x.ravel(), simulated.overturned.values.ravel(), clusters=motion.ravel(), measure=measure
    ).curves[0]
    found = study.fragility(measure=measure).curves[0]
    assert found.median == pytest.approx(reference.median, rel=1e-9)
    assert found.dispersion == pytest.approx(reference.dispersion, rel=1e-9)
    assert found.median_interval == pytest.approx(reference.median_interval, rel=1e-6)
    assert found.trial_counts.sum() == reference.trial_counts.sum()


def test_blocks_of_one_curve_count_by_their_weights(study):
    weights = np.linspace(1.0, 3.0, len(BLOCKS))
    found = study.fragility(weights=weights)
    reference = rocking.fragility(BLOCKS, MOTIONS, levels=LEVELS, weights=weights)
    for one, other in zip(found.curves, reference.curves, strict=True):
        assert (one.median, one.dispersion) == pytest.approx((other.median, other.dispersion), rel=1e-9)
        assert one.median_interval == pytest.approx(other.median_interval, rel=1e-6)
    assert abs(found.curves[0].median / study.fragility().curves[0].median - 1.0) > 1e-3
    assert "weighted" in found.description
    first = np.eye(len(BLOCKS))[0]
    alone, reference = study.fragility(weights=first).curves[0], rocking.fragility(BLOCKS[0], MOTIONS, levels=LEVELS)
    assert alone.trial_counts.sum() == reference.curves[0].trial_counts.sum() == len(MOTIONS) * len(LEVELS)


LIFT = rocking.pulses.one_sine(6.0, 3.0)


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize(
    ("alpha", "lift"),
    [
        (0.2, None),
        ((0.2, 0.25), LIFT),
        pytest.param(0.2, LIFT, marks=pytest.mark.thorough),
        pytest.param((0.2, 0.25), None, marks=pytest.mark.thorough),
    ],
)
def test_a_study_of_one_block_says_what_a_fragility_at_once_does(tmp_path, alpha, lift):
    block = rocking.Block.from_parameters(p=2.0, alpha=alpha, restitution=0.9)
    motions = [motion.with_vertical(lift) for motion in MOTIONS[:6]]
    levels = np.linspace(1.0, 9.0, 9)
    of_study = rocking.create_study(
        tmp_path / "s", block, motions, levels=levels, polarity="both", blocks_per_batch=512
    )
    of_study.run()
    found, reference = of_study.fragility(), rocking.fragility(block, motions, levels=levels, polarity="both")
    assert found.description.partition(" model, ")[2] == reference.description.partition(" model, ")[2] != ""
    for one in (found, reference):
        one.to_nrml(tmp_path / "model.xml")
        # Below its uplift acceleration g tan(alpha) no block moves, unless a vertical motion makes it lighter.
        limits = re.findall('noDamageLimit="(.*?)"', (tmp_path / "model.xml").read_text())
        assert [float(limit) for limit in limits] == ([pytest.approx(math.tan(0.2))] if lift is None else [])


def test_a_spectrum_is_the_fractiles_of_the_simulations(study, simulated):
    found = study.spectrum([0.5])
    ratio = np.where(simulated.overturned, np.inf, simulated.peak_rotation / BLOCKS.alpha[:, 0])
    np.testing.assert_array_equal(found.data.fractile_over_alpha.values[0], np.median(ratio, axis=0))
    np.testing.assert_array_equal(found.data.overturned_share.values, simulated.overturned.values.mean(axis=0))


def test_what_is_written_of_spectral_accelerations_says_their_period_and_damping(tmp_path):
    measure, about = rocking.Measure("sa", 0.7, 0.02), {"measure": "sa", "period": 0.7, "damping": 0.02}
    made = rocking.create_study(
        tmp_path / "study", BLOCKS, MOTIONS[:2], levels=[1.0, 2.0], measure=measure, blocks_per_batch=512
    )
    with rocking.set_options(threads=1):
        made.run()
    for found in (made.results().scale.attrs, made.critical_scales().attrs, made.spectrum().to_dict()):
        assert {name: found[name] for name in about} == about


def test_what_is_read_in_small_parts_is_the_same(study, curves, monkeypatch):
    whole = curves, study.spectrum(), study.fragility(measure="pga_ratio")
    monkeypatch.setattr(reading, "_MAX_VALUES_IN_MEMORY", 5 * len(MOTIONS) * len(LEVELS))
    parts = study.block_fragilities(limit_states=LIMITS), study.spectrum(), study.fragility(measure="pga_ratio")
    assert whole[0].data.identical(parts[0].data)
    assert whole[1].data.identical(parts[1].data)
    assert whole[2].to_dict() == parts[2].to_dict()


@pytest.mark.thorough
def test_both_polarities_of_symmetric_blocks_are_one_outcome(curves, tmp_path):
    both = rocking.create_study(
        tmp_path, BLOCKS, MOTIONS, levels=LEVELS, measure="pga", polarity="both", blocks_per_batch=512
    )
    both.run()
    assert both.block_fragilities(limit_states=LIMITS).data.identical(curves.data)


def test_both_polarities_of_asymmetric_blocks_are_two_trials(tmp_path):
    blocks = rocking.Blocks(p=[1.5, 2.0, 3.0], alpha=[[0.1, 0.15], [0.2, 0.15], [0.2, 0.3]], restitution=0.9)
    motions = MOTIONS[::2]
    study = rocking.create_study(
        tmp_path, blocks, motions, levels=LEVELS, measure="pga", polarity="both", blocks_per_batch=512
    )
    study.run()
    of_study = study.fragility(limit_states=LIMITS)
    at_once = rocking.fragility(blocks, motions, levels=LEVELS, polarity="both", limit_states=LIMITS)
    for name in LIMITS:
        found, reference = of_study.curve(name), at_once.curve(name)
        assert found.trial_counts.sum() == reference.trial_counts.sum() == 2 * 3 * len(motions) * len(LEVELS)
        assert found.exceedance_counts.sum() == reference.exceedance_counts.sum()
        assert (found.median, found.dispersion) == pytest.approx((reference.median, reference.dispersion), rel=1e-9)


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_outcomes_are_counted_for_each_block_by_its_own_polarities(tmp_path, order):
    blocks = rocking.Blocks(p=2.0, alpha=[[0.2, 0.2], [0.2, 0.15]], restitution=0.9).select(np.array(order))
    study = rocking.create_study(
        tmp_path, blocks, MOTIONS, levels=LEVELS, measure="pga", polarity="both", blocks_per_batch=512
    )
    study.run()
    found, once = study.block_fragilities(), len(MOTIONS) * len(LEVELS)
    assert found.data.trial_count.values.tolist() == [[once * (1 + k) for k in order]]


def test_a_block_that_no_curve_fits_says_why(tmp_path):
    blocks = rocking.Blocks(p=[2.0, 2.0], alpha=[0.2, 1.2], restitution=[0.9, 0.9])
    study = rocking.create_study(tmp_path, blocks, MOTIONS, levels=LEVELS, measure="pga", blocks_per_batch=512)
    study.run()
    found = study.block_fragilities()
    assert found.data.fault.values[0, 0] == ""
    assert "no outcome of 72 exceeds the limit" in found.data.fault.values[0, 1]
    assert np.isnan(found.data["median"].values[0, 1])
    assert "; 1 curve cannot be fitted (see fault)" in found.summary()


def test_wrong_options_of_a_report_are_refused(study, run, tmp_path):
    for curves in (study.block_fragilities, study.fragility):
        with pytest.raises(rocking.errors.OptionError, match="confidence must be a number between 0 and 1, not 2"):
            curves(confidence=2)
        with pytest.raises(rocking.errors.OptionError, match="must be 0 or more"):
            curves(limit_states={"half": -0.5})
    with pytest.raises(rocking.errors.OptionError, match="fractiles must contain at least one number"):
        study.spectrum([])
    for options in ("--limit-states foo", "--measure sa", "--fractiles 2", "--confidence 2", "--limit-states half=-1"):
        code, _, err = run("study", "report", study.folder, tmp_path / "out", *options.split())
        said = "the limit 'half'" if "half" in options else options.split()[0]
        assert code == 2 and said in err and not (tmp_path / "out").exists()


def test_a_study_that_is_not_complete_has_no_report(tmp_path):
    study = rocking.create_study(tmp_path, BLOCKS, MOTIONS, levels=LEVELS, measure="pga", blocks_per_batch=512)
    with pytest.raises(rocking.errors.StudyError, match="72 of 72 batches are missing"):
        study.fragility()


@pytest.mark.slow
def test_two_commands_go_from_a_file_to_fragility_curves(run, tmp_path):
    file = tmp_path / "museum.toml"
    file.write_text(TEXT)
    code, out, _ = run("study", "run", file)
    assert code == 0
    assert re.search(r"(\d+) of \1 batches done", out)
    code, out, err = run("study", "report", tmp_path / "museum", "--limit-states", "overturning,half=0.5")
    assert (code, err) == (0, "")
    assert "fragility of 6 blocks; intensity: peak ground acceleration" in out
    made = {path.name for path in (tmp_path / "museum" / "report").iterdir()}
    tables = {"fragility.csv", "fragility.pdf", "fragility.png", "spectrum.csv", "spectrum.pdf", "spectrum.png"}
    assert made == tables | {"result.json"}
    result = json.loads((tmp_path / "museum" / "report" / "result.json").read_text())
    assert result["fragility"]["limit_state"] == ["overturning", "half"]
    assert len((tmp_path / "museum" / "report" / "fragility.csv").read_text().splitlines()) == 13
    assert (tmp_path / "museum" / "report" / "spectrum.csv").read_text().startswith("fractile,pga_m_s2,block,p_rad_s,")
    options = ["--measure", "pga_ratio", "--together", "--fractiles", "0.25,0.5", "--confidence", "0.8"]
    code, out, _ = run("study", "report", tmp_path / "museum", tmp_path / "out", *options)
    assert code == 0
    assert "PGA / uplift acceleration" in out
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert result["spectrum"]["fractile"] == [0.25, 0.5] and result["fragility"]["curves"][0]["confidence"] == 0.8
    assert (tmp_path / "out" / "fragility.png").is_file()


def test_the_figures_draw_every_block(study, curves):
    figure = curves.plot()
    for axes in figure.axes[:2]:
        assert sum(len(one.get_offsets()) for one in axes.collections) == 12
    with pytest.raises(rocking.errors.OptionError, match="require a separate figure"):
        study.spectrum().plot(ax=figure.axes[0])
    spectrum = study.spectrum().plot()
    marks = sum(len(one.get_offsets()) for axes in spectrum.axes[:4] for one in axes.collections)
    assert marks == 4 * 12
    assert f"{len(MOTIONS)} motions, nonlinear model" in spectrum.get_suptitle() == study.spectrum().data.description


def test_the_figures_say_what_they_draw(study, curves):
    bar = study.spectrum([0.9, 0.16, 0.16]).plot().axes
    assert bar[0].get_title().startswith("PGA 0.10") and bar[0].get_title().endswith(" g")
    assert bar[-1].get_ylabel() == "16 % fractile of peak rotation over slenderness"
    assert curves.plot().axes[-1].get_ylabel() == "median peak ground acceleration (g)"
