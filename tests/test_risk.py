"""Annual rates from fragility and hazard, against closed forms and quadrature."""

import json
import math
import re
from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rocking
from rocking import HazardCurve, InvalidOption
from rocking.analysis.intensity import Measure

G = 9.80665

quick = settings(deadline=None, max_examples=30)


def fragility_with(median: float, dispersion: float) -> rocking.Fragility:
    """Fit to outcomes that follow a lognormal closely."""
    levels = median * np.exp(dispersion * np.linspace(-2.5, 2.5, 41))
    trials = 100_000
    chance = [0.5 * math.erfc(-math.log(x / median) / dispersion / math.sqrt(2.0)) for x in levels]
    return rocking.fit_fragility(levels, np.round(np.multiply(chance, trials)).astype(int), trials=trials)


def by_quadrature(curve: object, hazard: HazardCurve) -> float:
    """Integral of rate(x) dP(x), digit by digit."""
    a, b = (mpmath.mpf(float(value[0])) for value in curve.fitted)
    exponents, factors = hazard.powers()
    corners = [float(x) for x in hazard.intensity]

    def integrand(z: mpmath.mpf) -> mpmath.mpf:
        log = (z - a) / b
        k = int(np.clip(np.searchsorted(np.log(corners), float(log), side="right") - 1, 0, len(exponents) - 1))
        return mpmath.exp(float(factors[k]) - float(exponents[k]) * log) * mpmath.npdf(z)

    inside = [float(a + b * mpmath.log(x)) for x in corners]
    ends = {*inside, *np.linspace(min(*inside, 0.0) - 40.0, max(*inside, 0.0) + 40.0, 60)}
    return float(mpmath.quad(integrand, sorted(ends)))


@quick
@given(st.floats(0.3, 20.0), st.floats(0.1, 1.2), st.floats(1.0, 4.0))
def test_against_a_power_of_the_intensity_the_rate_is_that_of_cornell(median: float, beta: float, k: float) -> None:
    fitted = fragility_with(median, beta)
    curve = fitted.curves[0]
    intensity = np.geomspace(0.1, 50.0, 7)
    found = fitted.annual_rate(HazardCurve(intensity, 1e-3 * intensity**-k)).rates[0]
    expected = 1e-3 * curve.median**-k * math.exp(0.5 * (k * curve.dispersion) ** 2)
    assert found.annual_rate == pytest.approx(expected, rel=1e-11)
    assert found.probability(50.0) == pytest.approx(1.0 - math.exp(-50.0 * expected), rel=1e-10)
    assert found.survival(50.0) == pytest.approx(math.exp(-50.0 * expected), rel=1e-10)
    # Each factor of the power moves the middle of the contributions down by k dispersion^2.
    middle = curve.median * math.exp(-k * curve.dispersion**2)
    assert found.intensities[1] == pytest.approx(middle, rel=1e-8)
    assert found.intensities[2] == pytest.approx(middle * math.exp(0.994457883 * curve.dispersion), rel=1e-6)


@settings(deadline=None, max_examples=8)
@given(st.floats(0.5, 8.0), st.floats(0.05, 0.9), st.integers(0, 10_000))
def test_against_any_hazard_curve_the_rate_is_the_integral(median: float, beta: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    hazard = HazardCurve(np.cumsum(random.uniform(0.1, 1.5, 6)), 10.0 ** (-np.cumsum(random.uniform(0.05, 0.8, 6))))
    fitted = fragility_with(median, beta)
    found = fitted.annual_rate(hazard).rates[0]
    assert found.annual_rate == pytest.approx(by_quadrature(fitted.curves[0], hazard), rel=1e-8)
    assert 0.0 <= found.below + found.above <= 1.0 + 1e-12


def test_a_steep_fragility_is_exceeded_as_often_as_its_median() -> None:
    hazard = HazardCurve([1.0, 2.0, 4.0, 8.0], [1e-2, 3e-3, 4e-4, 2e-5])
    rate = fragility_with(3.0, 0.01).annual_rate(hazard).rates[0]
    assert rate.annual_rate == pytest.approx(float(hazard.rate_of(3.0)), rel=1e-3)
    assert rate.intensities == pytest.approx((2.97, 3.0, 3.03), rel=2e-3)


def test_the_interval_is_that_of_the_fragility() -> None:
    hazard = HazardCurve([0.5, 20.0], [1e-1, 1e-4])
    few, many = (
        rocking.fit_fragility([1.0, 2.0, 3.0, 4.0], [1 * n, 3 * n, 6 * n, 9 * n], trials=10 * n)
        .annual_rate(hazard)
        .rates[0]
        for n in (10, 1000)
    )
    assert few.interval[0] < few.annual_rate < few.interval[1]
    width, narrow = (math.log(one.interval[1] / one.interval[0]) for one in (few, many))
    assert width / narrow == pytest.approx(10.0, rel=0.03)


def test_a_rock_that_stands_bounds_how_often_it_was_shaken() -> None:
    curve = fragility_with(3.0, 0.4).curves[0]
    assert curve.intensity_of(0.5) == pytest.approx(curve.median)
    assert float(curve.probability(curve.intensity_of(0.95))) == pytest.approx(0.95)
    assert curve.largest_rate(curve.median, 1e4) == pytest.approx(-math.log(0.05) / 0.5e4)
    at = float(curve.intensity_of(0.7))
    certain = float(curve.largest_rate(at, 2000.0, 0.9))
    assert math.exp(-certain * 0.7 * 2000.0) == pytest.approx(0.1)


def test_the_share_beyond_the_curve_is_told() -> None:
    fitted = fragility_with(3.0, 0.4)
    short = fitted.annual_rate(HazardCurve([2.5, 3.5], [1e-2, 5e-3]))
    assert short.rates[0].below > 0.2
    assert "below the hazard curve" in short.summary()
    assert "above the hazard curve" in short.summary()


def test_a_table_is_read_with_its_units(tmp_path: Path) -> None:
    path = tmp_path / "site.csv"
    path.write_text("annual_rate,pga_g\n0.02,0.1\n0.001,0.5\n")
    hazard = HazardCurve.read(path)
    assert hazard.intensity == pytest.approx([0.1 * G, 0.5 * G])
    assert (hazard.measure, hazard.name) == (Measure("pga"), "site")
    assert "0.1 to 0.5" in repr(hazard)
    path.write_text("sa_g,annual_rate\n0.1,0.02\n0.5,0.001\n")
    assert HazardCurve.read(path, period=1.0).measure == Measure("sa", 1.0)


def test_openquake_probabilities_become_rates(tmp_path: Path) -> None:
    path = tmp_path / "hazard_curve-mean-SA(1.0).csv"
    path.write_text(
        "#,,,,\"generated_by='OpenQuake engine 3.16.3', start_date='2024-01-01T00:00:00', checksum=1, kind='mean', "
        "investigation_time=50.0, imt='SA(1.0)'\"\n"
        "lon,lat,depth,poe-0.0500000,poe-0.1000000,poe-0.2000000,poe-2.0000000\n"
        "10.0,45.0,0.0,1.000000E+00,5.000000E-01,1.000000E-01,0.000000E+00\n"
        "11.0,45.0,0.0,9.000000E-01,4.000000E-01,1.000000E-01,1.000000E-03\n"
    )
    hazard = HazardCurve.read(path, site=1)
    assert hazard.measure == Measure("sa", 1.0)
    assert hazard.intensity == pytest.approx(np.array([0.05, 0.1, 0.2, 2.0]) * G)
    assert hazard.rate == pytest.approx(-np.log1p(-np.array([0.9, 0.4, 0.1, 0.001])) / 50.0)
    assert len(HazardCurve.read(path).rate) == 2
    with pytest.raises(InvalidOption, match="no site 2"):
        HazardCurve.read(path, site=2)


@pytest.mark.parametrize(
    "text, said",
    [
        ("", "heading"),
        ("pga,rate\n0.1,0.01\n", "pga_g"),
        ("pga_g,annual_rate\n0.1,often\n", "row 2"),
        ("pga_g,annual_rate\n0.1,0.01\n", "two points"),
        ("pga_g,annual_rate\n0.1,0.01\n0.2,0.02\n", "decrease"),
        ("pga_g,annual_rate\n0.2,0.01\n0.1,0.001\n", "increase"),
        ("pga_g,annual_rate\n0.1,nan\n0.2,0.001\n", "positive"),
        ("sa_g,annual_rate\n0.1,0.01\n0.2,0.001\n", "period="),
        ("#,\"investigation_time=50.0, imt='IA'\"\nlon,lat,poe-0.1\n1,2,0.5\n", "IA"),
    ],
)
def test_what_is_no_hazard_curve_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "site.csv"
    path.write_text(text)
    with pytest.raises(InvalidOption, match=said):
        HazardCurve.read(path)


def test_a_missing_file_and_another_measure_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidOption, match="cannot be read"):
        HazardCurve.read(tmp_path / "none.csv")
    with pytest.raises(InvalidOption, match="fit the one"):
        fragility_with(3.0, 0.4).annual_rate(HazardCurve([0.1, 1.0], [1e-2, 1e-3], Measure("pgv")))
    with pytest.raises(InvalidOption, match="of the site"):
        HazardCurve([0.1, 1.0], [1e-2, 1e-3], "pga_ratio")


def test_the_command_gives_annual_rates(run, tmp_path: Path) -> None:
    site = tmp_path / "site.csv"
    site.write_text("pga_g,annual_rate\n0.05,0.05\n0.2,0.005\n1.0,0.00005\n")
    records = [name for name in rocking.records.names() if not name.endswith("up")]
    options = ["--width", "0.3", "--height", "1.5", "--levels", "0.1g:1.2g:12", "--hazard", site, "--years", "100"]
    code, out, _ = run("fragility", *records, *options, "--out", tmp_path / "out")
    assert code == 0
    assert "probability in 100 years" in out
    written = json.loads((tmp_path / "out" / "result.json").read_text())["risk"]
    rate = written["rates"][0]["annual_rate"]
    assert written["rates"][0]["probability"] == pytest.approx(-math.expm1(-100.0 * rate))
    assert (tmp_path / "out" / "risk.png").stat().st_size > 10_000
    assert run("fragility", *records, *options, "--years", "-1")[0] == 2


def test_a_table_from_a_spreadsheet_with_semicolons_and_decimal_commas_is_read(tmp_path: Path) -> None:
    path = tmp_path / "site.csv"
    path.write_bytes("PGA (m/s^2);Annual rate\r\n0,5;0,05\r\n1,0;0,02\r\n".encode("utf-8-sig"))
    curve = HazardCurve.read(path)
    assert curve.intensity.tolist() == [0.5, 1.0]
    assert curve.rate.tolist() == [0.05, 0.02]
    assert curve.measure.column == "pga_m_s2"


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("0.1,0.9\n0.2,1.5", "must be positive and decrease from point to point, but that of point 2 is 1.5 after 0.9"),
        ("0.1,nan\n0.2,0.1", "but that of point 1 is nan; correct it or leave the point out"),
        ("0.2,0.9\n0.1,0.5", "the intensities of a hazard curve must be positive and increase"),
    ],
)
def test_points_out_of_order_are_named_with_their_file(tmp_path: Path, rows: str, said: str) -> None:
    path = tmp_path / "site.csv"
    path.write_text(f"pga_g,annual_rate\n{rows}\n")
    with pytest.raises(InvalidOption, match=re.escape(said)) as caught:
        HazardCurve.read(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("site", [1, -1, float("nan"), "x"])
def test_a_table_has_one_site_only(tmp_path: Path, site: int) -> None:
    path = tmp_path / "site.csv"
    path.write_text("pga_g,annual_rate\n0.1,0.9\n0.2,0.5\n")
    with pytest.raises(InvalidOption, match="site"):
        HazardCurve.read(path, site=site)
