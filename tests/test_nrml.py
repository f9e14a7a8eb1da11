"""NRML 0.5: the shape that OpenQuake's manual documents, its units, and the same probabilities as the curve."""

import math
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from scipy import stats

import rocking
from rocking import fit_fragility, fragility

G = 9.80665
BLOCK = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
PULSES = [rocking.pulses.one_sine(1.0, frequency) for frequency in np.linspace(0.3, 1.5, 13)]
NAMESPACE = "http://openquake.org/xmlns/nrml/0.5"
NAME = re.compile(r"[A-Za-z0-9_-]{1,100}")


@pytest.fixture(scope="module")
def result():
    return fragility(
        BLOCK, PULSES, levels=[1.9, 2.1, 2.5, 3.5, 5.0], limit_states={"half": 0.5, "overturning": math.inf}
    )


def written(fragility_model, path, **options):
    fragility_model.to_nrml(path, **options)
    return ET.parse(path).getroot()


def tag(name):
    return f"{{{NAMESPACE}}}{name}"


def check_shape(root):
    """Check a model against the manual: elements, their order, attributes, and the counts that must agree."""
    assert root.tag == tag("nrml")
    (model,) = root
    assert model.tag == tag("fragilityModel")
    assert set(model.attrib) == {"id", "assetCategory", "lossCategory"}
    assert NAME.fullmatch(model.get("id"))
    assert model.get("lossCategory") in {"structural", "nonstructural", "contents", "business_interruption"}
    description, states, *functions = model
    assert [description.tag, states.tag] == [tag("description"), tag("limitStates")]
    assert description.text.isascii()
    names = states.text.split()
    assert all(NAME.fullmatch(name) for name in names)
    for function in functions:
        assert function.tag == tag("fragilityFunction")
        assert NAME.fullmatch(function.get("id"))
        imls, *rest = function
        assert imls.tag == tag("imls")
        assert re.fullmatch(r"PGA|PGV|SA\(\d+(\.\d+)?\)", imls.get("imt"))
        assert [entry.get("ls") for entry in rest] == names
        check_continuous(function, imls, rest)
    return functions


def check_continuous(function, imls, params):
    assert set(function.attrib) == {"id", "format", "shape"}
    assert function.get("format") == "continuous"
    assert function.get("shape") == "logncdf"
    assert set(imls.attrib) - {"noDamageLimit"} == {"imt", "minIML", "maxIML"}
    assert 0.0 < float(imls.get("minIML")) < float(imls.get("maxIML"))
    for entry in params:
        assert entry.tag == tag("params")
        assert set(entry.attrib) == {"ls", "mean", "stddev"}
        assert float(entry.get("mean")) > 0.0
        assert float(entry.get("stddev")) > 0.0


def openquakes_probability(params, level):
    """Lognormal from the mean and the standard deviation of the intensity."""
    mean, deviation = float(params.get("mean")), float(params.get("stddev"))
    sigma = math.sqrt(math.log(1.0 + (deviation / mean) ** 2))
    return stats.lognorm.cdf(level, sigma, scale=mean / math.sqrt(1.0 + (deviation / mean) ** 2))


def test_a_model_has_the_documented_shape(result, tmp_path):
    (function,) = check_shape(written(result, tmp_path / "model.xml", taxonomy="statue_A"))
    assert function.get("id") == "statue_A"
    assert (tmp_path / "model.xml").read_text("utf-8").startswith("<?xml version='1.0' encoding='UTF-8'?>")


def test_a_continuous_function_gives_the_probabilities_of_the_curve(result, tmp_path):
    (function,) = check_shape(written(result, tmp_path / "model.xml"))
    imls, *params = function
    assert imls.get("imt") == "PGA"
    assert float(imls.get("minIML")) == pytest.approx(math.tan(0.2), rel=1e-7)
    assert float(imls.get("maxIML")) == pytest.approx(5.0 / G, rel=1e-7)
    # Nothing moves below the uplift acceleration.
    assert float(imls.get("noDamageLimit")) == pytest.approx(math.tan(0.2), rel=1e-7)
    at = np.linspace(1.0, 5.0, 9)
    for curve, entry in zip(result.curves, params, strict=True):
        np.testing.assert_allclose(openquakes_probability(entry, at / G), curve.probability(at), atol=1e-6)


@pytest.mark.parametrize(
    ("measure", "imt", "unit"),
    [
        ("pga", "PGA", 1.0 / G),
        ("pgv", "PGV", 100.0),
        (rocking.Measure("sa", period=0.5), "SA(0.5)", 1.0 / G),
        ("pga_ratio", "PGA", math.tan(0.2)),
        ("pgv_ratio", "PGV", 100.0 * G * math.tan(0.2) / 2.0),
    ],
)
def test_units_are_openquakes(tmp_path, measure, imt, unit):
    fitted = fit_fragility([1.0, 2.0, 3.0, 4.0], [1, 4, 7, 9], trial_counts=10, measure=measure, block=BLOCK)
    (function,) = check_shape(written(fitted, tmp_path / "model.xml"))
    imls, params = function
    assert imls.get("imt") == imt
    curve = fitted.curves[0]
    at = np.array([1.0, 2.0, 4.0])
    np.testing.assert_allclose(openquakes_probability(params, unit * at), curve.probability(at), atol=1e-6)


def test_a_spectral_acceleration_of_another_damping_is_none_of_openquakes(tmp_path):
    path, data = tmp_path / "model.xml", ([1.0, 2.0, 3.0, 4.0], [1, 4, 7, 9])
    light, usual = (
        fit_fragility(*data, trial_counts=10, measure=rocking.Measure("sa", period=0.5, damping=damping))
        for damping in (0.02, 0.05)
    )
    with pytest.raises(rocking.errors.OptionError, match=r"damping .* must be 0.05 of critical .* got 0.02"):
        light.to_nrml(path)
    assert not path.exists()
    usual.to_nrml(path)


def test_pooled_blocks_need_one_to_count_for(tmp_path):
    blocks = [BLOCK, rocking.Block.from_parameters(p=3.0, alpha=0.25, restitution=0.9)]
    pooled = fragility(blocks, PULSES, measure="pga_ratio", levels=np.linspace(1.1, 4.0, 9))
    with pytest.raises(rocking.errors.OptionError, match="give block"):
        pooled.to_nrml(tmp_path / "model.xml")
    (function,) = check_shape(written(pooled, tmp_path / "model.xml", block=blocks[1]))
    np.testing.assert_allclose(float(function[0].get("maxIML")), 4.0 * math.tan(0.25), rtol=1e-7)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"taxonomy": "two words"}, "taxonomy"),
        ({"model_id": "a/b"}, "model_id"),
        ({"loss_category": "people"}, "loss_category"),
    ],
)
def test_what_nrml_does_not_allow_is_refused(result, tmp_path, options, word):
    with pytest.raises(rocking.errors.OptionError, match=word):
        result.to_nrml(tmp_path / "model.xml", **options)
    assert not (tmp_path / "model.xml").exists()


def test_a_limit_state_that_is_no_identifier_is_refused(tmp_path):
    named = fit_fragility([1.0, 2.0, 3.0], {"half way": [1, 2, 3]}, trial_counts=4)
    with pytest.raises(rocking.errors.OptionError, match="limit state"):
        named.to_nrml(tmp_path / "model.xml")


def test_a_curve_too_flat_for_a_mean_is_refused(tmp_path):
    flat = fit_fragility([1.0, 2.0, 3.0], [4999, 5000, 5010], trial_counts=10000)
    assert flat.curves[0].dispersion > 100.0
    with pytest.raises(rocking.errors.OptionError, match="too large for the mean"):
        flat.to_nrml(tmp_path / "model.xml")


def test_data_below_the_blocks_uplift_have_no_range_of_validity(tmp_path):
    below = fit_fragility([0.5, 1.0, 1.5], [1, 2, 3], trial_counts=4, block=BLOCK)
    with pytest.raises(rocking.errors.OptionError, match="above the uplift of the block"):
        below.to_nrml(tmp_path / "model.xml")
