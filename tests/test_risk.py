"""Annual rates from fragility and hazard, against closed forms and quadrature."""

import itertools
import json
import math
from pathlib import Path

import mpmath
import numpy as np
import pandas as pd
import pytest
import scipy.integrate
import scipy.optimize
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

import rocking
from rocking import HazardCurve
from rocking.analysis.hazard import (
    compute_log_integrals,
    compute_log_rate_within,
    compute_log_survival,
    compute_power_laws,
)
from rocking.analysis.probit import Probit
from rocking.analysis.risk import compute_mean_survival
from rocking.calibration.tables import read_observed
from rocking.errors import OptionError
from rocking.motion.scaling import Measure

G = 9.80665

quick = settings(deadline=None, max_examples=12)


def fragility_with(median: float, dispersion: float) -> rocking.Fragility:
    """Fit to outcomes that follow a lognormal closely."""
    levels = median * np.exp(dispersion * np.linspace(-2.5, 2.5, 41))
    trials = 100_000
    chance = [0.5 * math.erfc(-math.log(x / median) / dispersion / math.sqrt(2.0)) for x in levels]
    return rocking.fit_fragility(levels, np.round(np.multiply(chance, trials)).astype(int), trial_counts=trials)


def by_quadrature(curve: object, hazard: HazardCurve) -> float:
    """Integral of rate(x) dP(x) by forty points of Gauss to each of many pieces."""
    a, b = (float(value[0]) for value in curve.fitted)
    exponents, factors = compute_power_laws(hazard)
    inside = a + b * np.log(hazard.intensity)
    ends = np.union1d(inside, np.linspace(min(*inside, 0.0) - 40.0, max(*inside, 0.0) + 40.0, 60))
    points, weights = np.polynomial.legendre.leggauss(40)
    z = 0.5 * (ends[1:] + ends[:-1])[:, None] + 0.5 * np.diff(ends)[:, None] * points
    k = np.clip(np.searchsorted(inside, z, side="right") - 1, 0, len(exponents) - 1)
    logs = factors[k] - exponents[k] * (z - a) / b - 0.5 * z * z
    return float(np.diff(ends) @ np.exp(logs) @ weights) / math.sqrt(8.0 * math.pi)


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


@pytest.mark.parametrize("exponent", [1.2, 2.5, 4.0])
def test_the_rate_below_an_intensity_is_that_of_the_weaker_motions(exponent: float) -> None:
    """Motions of x to x + dx come |d rate(x)| times a year, and P(x) of them exceed the limit."""
    fitted = fragility_with(0.3 * G, 0.4)
    intensity = np.array([0.1, 0.3, 0.9]) * G
    risk = fitted.annual_rate(HazardCurve(intensity, 1e-3 * (intensity / G) ** -exponent))
    found, curve = risk.rates[0], fitted.curves[0]

    def from_motions(low: float, high: float) -> float:
        def density(log: float) -> float:
            chance = 0.5 * math.erfc(-(log - math.log(curve.median)) / curve.dispersion / math.sqrt(2.0))
            return chance * exponent * 1e-3 * math.exp(-exponent * (log - math.log(G)))

        return scipy.integrate.quad(density, math.log(low), math.log(high), epsabs=0.0, epsrel=1e-11, limit=500)[0]

    everything = from_motions(1e-3 * G, 1e6 * G)
    assert found.annual_rate == pytest.approx(everything, rel=1e-6)
    assert found.share_below_curve == pytest.approx(from_motions(1e-3 * G, 0.1 * G) / everything, rel=1e-6)
    assert found.share_above_curve == pytest.approx(from_motions(0.9 * G, 1e6 * G) / everything, rel=1e-6)
    line = risk.plot().axes[1].lines[0]
    x, y = line.get_xdata()[200], line.get_ydata()[200]
    assert y == pytest.approx(from_motions(x * G / 1.001, x * G * 1.001) / everything / (2 * math.log(1.001)), rel=1e-4)


@settings(deadline=None, max_examples=6)
@given(st.floats(0.5, 8.0), st.floats(0.05, 0.9), st.integers(0, 10_000))
def test_against_any_hazard_curve_the_rate_is_the_integral(median: float, beta: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    hazard = HazardCurve(np.cumsum(random.uniform(0.1, 1.5, 6)), 10.0 ** (-np.cumsum(random.uniform(0.05, 0.8, 6))))
    fitted = fragility_with(median, beta)
    found = fitted.annual_rate(hazard).rates[0]
    assert found.annual_rate == pytest.approx(by_quadrature(fitted.curves[0], hazard), rel=1e-8)
    assert 0.0 <= found.share_below_curve + found.share_above_curve <= 1.0 + 1e-12


def flat_fragility(dispersion: float) -> rocking.Fragility:
    """Two stripes, which are fitted exactly: as wide as wanted."""
    apart = math.exp(2.0 * dispersion * float(mpmath.sqrt(2) * mpmath.erfinv(0.5)))
    return rocking.fit_fragility([1.0, apart], [25, 75], trial_counts=100)


@pytest.mark.parametrize("exponent, dispersion", [(12.0, 1.1), (8.0, 2.0), (20.0, 1.5), (30.0, 3.0), (3.0, 40.0)])
def test_steep_hazards_and_flat_fragilities_have_the_rate_of_the_closed_form(
    exponent: float, dispersion: float
) -> None:
    hazard = HazardCurve([1.0, 1.5], [1e-2, 1e-2 * 1.5**-exponent])
    fitted = flat_fragility(dispersion)
    found = fitted.annual_rate(hazard).rates[0]
    with mpmath.workdps(60):
        a, b = (mpmath.mpf(float(value[0])) for value in fitted.curves[0].fitted)
        k = (mpmath.log(hazard.rate[0]) - mpmath.log(hazard.rate[1])) / mpmath.log(mpmath.mpf("1.5"))
        expected = mpmath.mpf(float(hazard.rate[0])) * mpmath.exp(k * a / b + (k / b) ** 2 / 2)
        if expected < mpmath.mpf("1e300"):
            assert found.annual_rate == pytest.approx(float(expected), rel=1e-10)
        else:
            assert found.annual_rate == math.inf
    assert found.share_below_curve > 0.99


def test_a_steep_fragility_is_exceeded_as_often_as_its_median() -> None:
    hazard = HazardCurve([1.0, 2.0, 4.0, 8.0], [1e-2, 3e-3, 4e-4, 2e-5])
    rate = fragility_with(3.0, 0.01).annual_rate(hazard).rates[0]
    assert rate.annual_rate == pytest.approx(float(hazard.rate_of(3.0)), rel=1e-3)


def test_the_interval_is_that_of_the_fragility() -> None:
    hazard = HazardCurve([0.5, 20.0], [1e-1, 1e-4])
    few, many = (
        rocking.fit_fragility([1.0, 2.0, 3.0, 4.0], [1 * n, 3 * n, 6 * n, 9 * n], trial_counts=10 * n)
        .annual_rate(hazard)
        .rates[0]
        for n in (10, 1000)
    )
    assert few.interval[0] < few.annual_rate < few.interval[1]
    width, narrow = (math.log(one.interval[1] / one.interval[0]) for one in (few, many))
    assert width / narrow == pytest.approx(10.0, rel=0.03)


def test_limits_of_fits_have_the_rates_of_what_they_stand_for() -> None:
    hazard = HazardCurve([0.5, 5.0], [1e-2, 1e-4])
    fits = Probit(np.array([-np.inf, 0.0, -1e9, 2.0]), np.array([0.0, 0.0, 1e9, 1.0]))
    rates = np.exp(np.logaddexp.reduce(compute_log_integrals(fits, hazard), axis=1))
    # None ever, half of the weakest motions, all from e m/s^2 on, a lognormal of median exp(-2) and dispersion 1.
    assert rates[:3] == pytest.approx([0.0, math.inf, 1e-2 * (math.e / 0.5) ** -2.0])
    assert rates[3] == pytest.approx(1e-2 * (math.exp(-2.0) / 0.5) ** -2.0 * math.exp(2.0))


def test_a_rock_that_stands_bounds_how_often_it_was_shaken() -> None:
    curve = fragility_with(3.0, 0.4).curves[0]
    assert curve.intensity_of(0.5) == pytest.approx(curve.median)
    assert float(curve.probability(curve.intensity_of(0.95))) == pytest.approx(0.95)
    assert curve.largest_rate(curve.median, 1e4) == pytest.approx(-math.log(0.05) / 0.5e4)
    at = float(curve.intensity_of(0.7))
    certain = float(curve.largest_rate(at, 2000.0, 0.9))
    assert math.exp(-certain * 0.7 * 2000.0) == pytest.approx(0.1)


def test_an_interval_without_an_end_is_explained() -> None:
    site = HazardCurve([2.0, 3.0], [1e-2, 5e-3])
    note = "whose summary says why they have no end"
    assert note not in fragility_with(3.0, 0.4).annual_rate(site).summary()
    few = rocking.fit_fragility([2.0, 2.5, 3.0, 4.0, 5.0], [False, True, False, True, True])
    assert note in few.annual_rate(site).summary()


def test_a_table_is_read_with_its_units(tmp_path: Path) -> None:
    path = tmp_path / "site.csv"
    path.write_text("annual_rate,pga_g\n0.02,0.1\n0.001,0.5\n")
    hazard = HazardCurve.read(path)
    assert hazard.intensity == pytest.approx([0.1 * G, 0.5 * G])
    assert (hazard.measure, hazard.name) == (Measure("pga"), "site")
    assert "0.1 to 0.5" in repr(hazard)
    path.write_text("sa_g,annual_rate\n0.1,0.02\n0.5,0.001\n")
    assert HazardCurve.read(path, period=1.0).measure == Measure("sa", 1.0)
    with pytest.raises(OptionError, match="period must be a positive number"):
        HazardCurve.read(path, period="1.0")  # type: ignore[arg-type]


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
    with pytest.raises(OptionError, match="no site 2"):
        HazardCurve.read(path, site=2)


def test_an_openquake_curve_that_rises_once_keeps_what_falls_below_all_before(tmp_path: Path) -> None:
    """Probabilities of sampled catalogues rise here and there: such a point says no more than the one before it."""
    path = tmp_path / "hazard_curve-mean-PGA.csv"
    path.write_text(
        "#,,,,\"kind='mean', investigation_time=50.0, imt='PGA'\"\n"
        "lon,lat,depth,poe-0.1,poe-0.2,poe-0.3,poe-0.4,poe-0.5,poe-0.6\n"
        "10.0,45.0,0.0,0.5,0.3,0.4,0.35,0.3,0.2\n"
    )
    hazard = HazardCurve.read(path)
    assert hazard.intensity == pytest.approx(np.array([0.1, 0.2, 0.5, 0.6]) * G)
    assert hazard.rate == pytest.approx(-np.log1p(-np.array([0.5, 0.3, 0.3, 0.2])) / 50.0)


def test_an_openquake_curve_keeps_its_rate_up_to_the_end_of_a_plateau(tmp_path: Path) -> None:
    path = tmp_path / "hazard_curve-mean-PGA.csv"
    levels, chances = (0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.2), (0.9, 0.9, 0.1, 0.05, 0.05, 0.01, 0.005, 0.005)
    path.write_text(
        "#,,,,\"kind='mean', investigation_time=50.0, imt='PGA'\"\n"
        f"lon,lat,depth,{','.join(f'poe-{x}' for x in levels)}\n10.0,45.0,0.0,{','.join(map(str, chances))}\n"
    )
    hazard = HazardCurve.read(path)
    rates = -np.log1p(-np.array(chances)) / 50.0
    assert hazard.rate_of(np.array(levels[:7]) * G) == pytest.approx(rates[:7], rel=1e-8)
    # The line from 0.8 g to 1 g goes on: the curve would never end with that of the plateau at its end.
    assert hazard.rate_of(1.2 * G) < 0.7 * rates[-1]


DAMAGED = "#,,imt='{}',investigation_time={}\nlon,lat,poe-{},poe-0.2\n0,0,0.5,0.1\n"


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        ("", {}, "heading"),
        ("pga,rate\n0.1,0.01\n", {}, "pga_g"),
        ("pga_g,annual_rate\n0.1,often\n", {}, "line 2"),
        ("pga_g,annual_rate\n0.1,0.01\n", {}, "two points"),
        ("pga_g,annual_rate\n0.1,0.9\n0.2,1.5\n", {}, "positive and decrease .* got 1.5 after 0.9 at point 2"),
        ("pga_g,annual_rate\n0.2,0.01\n0.1,0.001\n", {}, "intensities of a hazard curve must be positive and increase"),
        ("pga_g,annual_rate\n0.1,nan\n0.2,0.1\n", {}, "got nan at point 1; correct or remove this point"),
        ("sa_g,annual_rate\n0.1,0.01\n0.2,0.001\n", {}, "a spectral acceleration requires period, in s"),
        ("pga_m_s2,annual_rate\n1,9,0\n2,5,0\n", {}, "in 2 cells, as in the heading; got 1,9,0"),
        *[("pga_g,annual_rate\n0.1,0.9\n0.2,0.5\n", {"site": site}, "site") for site in (1, -1, math.nan, "x")],
        ("pga_g,annual_rate\n0.1,0.9\n0.2,0.5\n", {"period": 1.0}, "period applies only .* of this curve is pga"),
        ("pga_g,annual_rate\n0.1,inf\n0.2,0.1\n", {}, "got inf at point 1"),
        ("#,\"investigation_time=50.0, imt='MMI'\"\nlon,lat,poe-0.1\n1,2,0.5\n", {}, "MMI"),
        (DAMAGED.format("SA(x)", 50.0, 0.1), {}, "could not convert"),
        (DAMAGED.format("SA", 50.0, 0.1), {}, "could not convert"),
        (DAMAGED.format("PGA", 50.0, "0.."), {}, "could not convert"),
        (DAMAGED.format("PGA", 0, 0.1), {}, "investigation_time must be a positive"),
        (DAMAGED.format("SA(0.5)", 50.0, 0.1), {"period": 1.0}, r"period is 1 s, but .* is SA\(0.5\)"),
    ],
)
def test_what_is_no_hazard_curve_is_refused(tmp_path: Path, text: str, options: dict, said: str) -> None:
    path = tmp_path / "site.csv"
    path.write_text(text)
    with pytest.raises(OptionError, match=said) as caught:
        HazardCurve.read(path, **options)
    assert str(path) in str(caught.value) or "site" in options


def test_a_missing_file_and_another_measure_are_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="cannot be read"):
        HazardCurve.read(tmp_path / "none.csv")
    with pytest.raises(OptionError, match="must have the same measure"):
        fragility_with(3.0, 0.4).annual_rate(HazardCurve([0.1, 1.0], [1e-2, 1e-3], Measure("pgv")))
    with pytest.raises(OptionError, match="does not depend on a block"):
        HazardCurve([0.1, 1.0], [1e-2, 1e-3], "pga_ratio")


def test_a_table_from_a_spreadsheet_with_semicolons_and_decimal_commas_is_read(tmp_path: Path) -> None:
    path = tmp_path / "site.csv"
    path.write_bytes("PGA (m/s^2);Annual rate\r\n0,5;0,05\r\n1,0;0,02\r\n".encode("utf-8-sig"))
    curve = HazardCurve.read(path)
    assert curve.intensity.tolist() == [0.5, 1.0]
    assert curve.rate.tolist() == [0.05, 0.02]
    assert curve.measure.column == "pga_m_s2"


def test_a_hazard_curve_that_looks_as_if_in_per_cent_of_g_is_noted(run, tmp_path: Path) -> None:
    seen = tmp_path / "seen.csv"
    seen.write_text("pga_g,overturned,trials\n0.2,1,10\n0.3,4,10\n0.4,7,10\n")
    site = tmp_path / "site.csv"
    for factor, is_noted in ((1.0, False), (100.0, True)):
        site.write_text(f"pga_g,annual_rate\n{0.1 * factor},1e-2\n{0.8 * factor},5e-5\n")
        code, _, notes = run("fragility", "--outcomes", seen, "--hazard", site)
        assert code == 0
        assert ("are its units right?" in notes) is is_noted
    assert "even the weakest motions of the hazard curve have 98.0665 m/s^2 (10 g)" in notes


def test_the_figure_has_the_hazard_curve_and_the_shares_of_the_rate_on_axes_of_their_own() -> None:
    fitted = fragility_with(3.0, 0.4)
    risk = fitted.annual_rate(HazardCurve([0.5, 1.0, 2.0, 4.0, 8.0], [5e-2, 2e-2, 6e-3, 1.2e-3, 1.5e-4]))
    figure = risk.plot()
    above, below = figure.axes
    assert (above.get_yscale(), below.get_yscale()) == ("log", "linear")
    line = below.lines[0]
    assert np.trapezoid(line.get_ydata(), np.log(line.get_xdata())) == pytest.approx(1.0, abs=2e-3)
    assert any(risk.rates[0].describe_period() in text.get_text() for text in figure.legends[0].get_texts())


def test_survival_is_what_the_rate_and_the_curve_say() -> None:
    fitted = fragility_with(3.0, 0.4)
    hazard = HazardCurve([0.5, 1.0, 2.0, 4.0, 8.0], [5e-2, 2e-2, 6e-3, 1.2e-3, 1.5e-4])
    rate = fitted.annual_rate(hazard).rates[0]
    long, short = fitted.survival(10_000.0, hazard), fitted.survival(10.0, hazard)
    assert long.probability == pytest.approx(math.exp(-10_000.0 * rate.annual_rate))
    assert long.contradicts_hazard
    assert not short.contradicts_hazard
    assert "so they contradict each other" in long.summary()
    assert "do not contradict" in short.summary()
    chances = fitted.curves[0].probability(long.intensity)
    assert chances == pytest.approx([0.05, 0.16, 0.5, 0.84, 0.95])
    # At the largest rate the limit would have been exceeded with the confidence asked for.
    assert np.exp(-10_000.0 * chances * long.largest_rate) == pytest.approx(0.05)
    assert float(fitted.curves[0].probability(long.never_reached_intensity)) == pytest.approx(0.95)
    alone = fitted.survival(10_000.0)
    assert math.isnan(alone.probability)
    assert "hazard" not in alone.summary()
    assert "most likely never" in repr(alone)
    for one in (long, short, alone):
        assert one.plot().axes
    with pytest.raises(OptionError, match="limit_state"):
        fitted.survival(10.0, limit_state="none")
    with pytest.raises(OptionError, match="years"):
        fitted.survival(0.0)


def test_a_survival_of_one_block_of_several_is_the_mean_of_their_own() -> None:
    """Of weak and strong blocks the strong ones stand: what each does alone, by another optimiser and by quadrature."""
    shapes = [(3.0, 0.08), (1.5, 0.35), (2.0, 0.2), (2.5, 0.15)]
    blocks = [rocking.Block.from_parameters(p=p, alpha=alpha, restitution=0.6) for p, alpha in shapes]
    pulses = [rocking.pulses.one_sine(1.0, f) for f in np.linspace(0.5, 2.0, 10)]
    points = np.array([0.01, 0.1, 1.0, 10.0, 100.0])
    hazard = HazardCurve(points, [9e-1, 1e-1, 1e-2, 1e-4, 1e-8])
    levels, weights, years = np.geomspace(0.4, 40.0, 16), [1.0, 3.0, 0.0, 2.0], 2000.0

    def own(block: rocking.Block) -> float:
        z, exceeded = [], []
        for pulse in pulses:
            for level in levels:
                z.append(math.log(level))
                exceeded.append(rocking.simulate(block, pulse.scaled_to(level)).overturned)
        at, sign = np.array(z), np.where(exceeded, 1.0, -1.0)

        def loss(parameters: np.ndarray) -> float:
            return -float(scipy.stats.norm.logcdf(sign * (parameters[0] + parameters[1] * at)).sum())

        a, b = scipy.optimize.minimize(
            loss, [-1.0, 1.0], method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-12}
        ).x
        middle, width = -a / b, 12.0 / b

        def density(x: float) -> float:
            return float(hazard.rate_of(math.exp(x)) * scipy.stats.norm.pdf(a + b * x) * b)

        corners = sorted({middle - width, middle + width, *(x for x in np.log(points) if abs(x - middle) < width)})
        rate = sum(
            scipy.integrate.quad(density, *ends, epsabs=0.0, epsrel=1e-9)[0] for ends in itertools.pairwise(corners)
        )
        return math.exp(-years * rate)

    both = rocking.fragility(blocks, pulses, levels=levels, weights=weights).survival(years, hazard)
    expected = np.average([own(block) for block in blocks], weights=weights)
    assert 0.05 < expected < 0.95
    assert both.mean_probability == pytest.approx(expected, rel=1e-5)
    assert both.probability < 0.05 < both.mean_probability < both.max_probability
    assert both.to_dict()["mean_probability"] == both.mean_probability
    assert not both.contradicts_hazard
    said = (
        f"is {expected:.2g} in the mean (standard error of the sample {both.mean_error:.1g}) and at most "
        f"{both.max_probability:.2g} if one of the blocks has stood all the"
    )
    assert said in both.summary()
    alone = rocking.fragility(blocks[0], pulses, levels=levels).survival(years, hazard)
    assert alone.contradicts_hazard
    assert math.isnan(alone.mean_probability)
    assert "if one of the blocks" not in alone.summary()


def test_blocks_that_always_or_never_fall_or_at_once_have_their_part_in_the_mean() -> None:
    """Limits of fits: a probability of 0 or 1, or a step, whose rate is that of the hazard curve there."""
    site = HazardCurve([1.0, 2.0, 4.0], [1e-2, 2e-3, 2e-4])
    kinds = {"never": [0, 0, 0], "always": [1, 1, 1], "step": [0, 1, 1], "one unfinished": [0, None, 1]}
    table = pd.DataFrame(
        [
            {"block": k, "pga_m_s2": level, "exceeded_overturning": bool(one), "unfinished": one is None}
            for level, *fell in zip([1.0, 2.25, 4.0], *kinds.values(), strict=True)
            for k, one in enumerate(fell)
        ]
    )
    rates = [0.0, 1e-2 - 2e-4, float(site.rate_of(1.5)), float(site.rate_of(2.0))]
    found, _ = compute_mean_survival(table, "pga_m_s2", "overturning", site, 100.0)
    assert found == pytest.approx(np.mean(np.exp(-100.0 * np.array(rates))), rel=1e-4)


def test_a_rate_from_above_the_hazard_curve_has_a_bound_and_no_estimate() -> None:
    strong = fragility_with(40.0, 0.3)
    site = HazardCurve([0.5, 1.0, 2.0, 4.0, 8.0], [5e-2, 2e-2, 6e-3, 1.2e-3, 1.5e-4])
    (rate,) = strong.annual_rate(site).rates
    assert rate.share_above_curve > 0.99
    assert rate.annual_rate < 1.5e-4
    assert "once in > 6700 years" in rate.describe_period()
    # Were every motion above the last point to exceed the limit, the rate would be this.
    assert rate.bounds[0] == pytest.approx((1.0 - rate.share_above_curve) * rate.annual_rate + 1.5e-4)


@pytest.mark.parametrize(("a", "b"), [(-1.0, 1.5), (2.0, 0.7), (-6.0, 9.0), (20.0, 2.0), (-20.0, 1.0)])
def test_a_block_of_which_the_intensity_alone_decides_stands_as_quadrature_says(a: float, b: float) -> None:
    hazard = HazardCurve([0.5, 1.0, 2.0, 4.0, 8.0], [5e-2, 2e-2, 6e-3, 1.2e-3, 1.5e-4])
    low, high = (a + b * math.log(x) for x in hazard.intensity[[0, -1]])

    def integrand(z: mpmath.mpf) -> mpmath.mpf:
        return mpmath.npdf(z) * mpmath.exp(-100.0 * float(hazard.rate_of(math.exp((float(z) - a) / b))))

    corners = [a + b * math.log(x) for x in hazard.intensity]
    expected = mpmath.ncdf(low) * mpmath.exp(-5.0) + mpmath.ncdf(-high) + mpmath.quad(integrand, corners)
    found = compute_log_survival(Probit(np.array([a]), np.array([b])), hazard, 100.0)
    assert found[0, 0] == pytest.approx(float(mpmath.log(expected)), abs=1e-5)


@pytest.mark.parametrize("a", [-np.inf, -3.0, 0.0, 1.5, np.inf])
def test_a_curve_that_does_not_rise_is_the_limit_of_flat_ones(a: float) -> None:
    """Motions within the hazard curve exceed it with one probability, as often as they come."""
    hazard = rocking.HazardCurve([4.0, 12.0, 40.0], [1e-3, 1e-4, 1e-5])
    chance, flat = scipy.stats.norm.cdf(a), Probit(np.array([a, np.clip(a, -9.0, 9.0)]), np.array([0.0, 1e-9]))
    with np.errstate(all="raise"):
        rates, standing = compute_log_rate_within(flat, hazard)[:, 0], compute_log_survival(flat, hazard, 1000.0)[:, 0]
    assert np.exp(rates) == pytest.approx(chance * (1e-3 - 1e-5), rel=1e-6, abs=1e-21)
    assert np.exp(standing) == pytest.approx(1.0 - chance + chance * math.exp(-1.0), rel=1e-6)


@pytest.mark.parametrize("drawn", [False, pytest.param(True, marks=pytest.mark.thorough)])
def test_observed_outcomes_make_a_fragility_a_rate_and_a_survival(run, tmp_path: Path, drawn: bool) -> None:
    site = tmp_path / "site.csv"
    site.write_text("pga_g,annual_rate\n0.05,0.05\n0.2,0.005\n1.0,0.00005\n")
    seen = tmp_path / "seen.csv"
    intensity = [0.1, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6] * 3
    fell = [0, 0, 1, 0, 1, 1, 0, 1, 0, 0, 0, 1, 0, 1, 1, 1, 0, 0, 0, 1, 1, 1, 1, 1]
    seen.write_text("PGA (g),overturned\n" + "".join(f"{x},{y}\n" for x, y in zip(intensity, fell, strict=True)))
    out, given = tmp_path / "out", ("fragility", "--outcomes", seen, "--hazard", site, "--standing", "5000")
    code, text, _ = run(*given, *(("--out", out) if drawn else ()))
    assert code == 0
    assert "24 observed outcomes in seen.csv" in text
    assert "the probability of 5000 years without it" in text
    written = json.loads((out / "result.json").read_text() if drawn else run(*given, "--json")[1])
    expected = rocking.fit_fragility(np.multiply(intensity, G), fell)
    assert written["curves"][0]["median"] == pytest.approx(expected.curves[0].median)
    hazard = HazardCurve.read(site)
    assert written["risk"]["rates"][0]["annual_rate"] == pytest.approx(
        expected.annual_rate(hazard).rates[0].annual_rate
    )
    assert written["survival"]["probability"] == pytest.approx(expected.survival(5000.0, hazard).probability)
    assert not drawn or (out / "survival.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("table", "options", "said"),
    [
        ("pga_g,fell\n0.1,0\n", [], "line 1: the columns must be overturned and either motion or one of pga_g"),
        ("pga_g,overturned\n0.1,maybe\n", [], "line 2: 'maybe' is not 0 or 1"),
        ("sa_g,overturned\n0.1,0\n0.2,1\n", [], "--period"),
        ("pga_g,overturned\n0.1,0\n0.2,1\n", ["--width", "0.3"], "omit --width"),
        ("pga_g,overturned\n0.1,0\n0.2,1\n", ["el-centro-meloland-270"], "omit records"),
        ("pga_g,overturned\n0.1,0\n0.2,1\n", [], "separated"),
    ],
)
def test_what_is_no_table_of_outcomes_is_refused(run, tmp_path: Path, table: str, options: list, said: str) -> None:
    seen = tmp_path / "seen.csv"
    seen.write_text(table)
    code, _, error = run("fragility", *options, "--outcomes", seen)
    assert code == 2
    assert said in error


def test_counts_groups_and_motions_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "seen.csv"
    path.write_text("pgv_cm_s,overturned,trials,group\n10,1,10,a\n20,4,10,b\n40,8,10,c\n")
    found = rocking.fit_fragility(**read_observed(path, Measure("pga")))
    assert (found.measure, found.curves[0].trial_counts.tolist()) == (Measure("pgv"), [10.0, 10.0, 10.0])
    assert found.intensity_range == pytest.approx((0.1, 0.4))
    assert not found.curves[0].is_independent
    path.write_text(
        "motion,scale,overturned\nel-centro-meloland-270,1,no\nel-centro-meloland-270,2,yes\n"
        "ridgecrest-clc-090,1,yes\nridgecrest-clc-360,1,no\n"
    )
    found = rocking.fit_fragility(**read_observed(path, Measure("pgv")))
    record = rocking.records.load("el-centro-meloland-270")
    assert found.curves[0].intensity[:2] == pytest.approx([record.pgv, 2.0 * record.pgv])
    assert found.curves[0].cluster_count == 3
    with pytest.raises(OptionError, match="in units of the block"):
        read_observed(path, Measure("pgv_ratio"))


def test_multiples_of_one_pulse_belong_together_however_they_are_written(tmp_path: Path) -> None:
    """A factor in the text of a motion tells no more than one in the column scale."""
    pulses = [(0.3, 1), (0.4, 1), (0.5, 1), (0.3, 2), (0.45, 2), (0.6, 3)]
    texts = [f"one-sine:amplitude={size}g,frequency={frequency}Hz" for size, frequency in pulses]
    rows = [f'"{text}",{k % 2},1' for k, text in enumerate(texts)]
    (tmp_path / "tests.csv").write_text("\n".join(["motion,overturned,scale", *rows, f'"{texts[5]}",0,0']))
    clusters = read_observed(tmp_path / "tests.csv", Measure("pga"))["clusters"]
    assert [clusters.index(each) for each in clusters] == [0, 0, 0, 3, 3, 5, 5]


def test_counted_outcomes_under_motions_are_those_at_their_intensities(tmp_path: Path) -> None:
    path, rows = tmp_path / "seen.csv", [(0.1, 0, 10), (0.2, 3, 10), (0.3, 1, 2), (0.4, 0, 1), (0.5, 9, 10)]
    path.write_text("pga_g,overturned,trials\n" + "".join(f"{x},{fell},{of}\n" for x, fell, of in rows))
    at_intensities = read_observed(path, Measure("pga"))
    pulses = [(f"one-sine:amplitude={x}g,frequency=1Hz", fell, of) for x, fell, of in rows]
    path.write_text("Motion,overturned,trials\n" + "".join(f'"{pulse}",{fell},{of}\n' for pulse, fell, of in pulses))
    under_motions = read_observed(path, Measure("pga"))
    for name in ("intensity", "exceedance_counts", "trial_counts"):
        assert [*under_motions[name]] == pytest.approx([*at_intensities[name]], rel=1e-9)
    assert under_motions["description"] == "33 observed outcomes in seen.csv"


def test_rows_belong_together_by_motion_and_by_group_and_not_without_a_label(tmp_path: Path) -> None:
    path = tmp_path / "seen.csv"
    names = [f"one-sine:amplitude=0.3g,frequency={x}Hz" for x in (1, 2, 3)]
    # Motion and group of each row: the second motion and the third have group b in common, the first has none of both.
    given = [(0, ""), (1, "a"), (2, ""), (1, "b"), (0, ""), (1, ""), (2, "c"), (0, "d"), (2, "b")]
    path.write_text("motion,overturned,group\n" + "".join(f'"{names[k]}",1,{group}\n' for k, group in given))
    reach = np.array([[a == c or (b == d != "") for c, d in given] for a, b in given])
    together = np.linalg.matrix_power(reach.astype(int), len(given)) > 0
    found = np.array(read_observed(path, Measure("pga"))["clusters"])
    assert np.array_equal(found[:, None] == found, together)
    assert len({*found.tolist()}) == 2
    path.write_text("pga_g,overturned,group\n0.1,0,\n0.2,1,a\n0.3,1,\n0.4,1,a\n")
    found = np.array(read_observed(path, Measure("pga"))["clusters"])
    assert len({*found.tolist()}) == 3 and found[1] == found[3]


@pytest.mark.parametrize("heading", ["PGA (g),pga_g,overturned", "pga_g,overturned,Overturned"])
def test_two_columns_of_one_name_are_refused(heading: str, tmp_path: Path) -> None:
    path = tmp_path / "seen.csv"
    path.write_text(f"{heading}\n0.1,1,0\n0.2,0,1\n")
    with pytest.raises(rocking.RockingError, match="more than once"):
        read_observed(path, Measure("pga"))
    hazard = tmp_path / "hazard.csv"
    hazard.write_text("pga_g,annual_rate,Annual rate\n0.1,1e-2,1e-3\n0.2,1e-3,1e-4\n")
    with pytest.raises(OptionError, match="annual_rate"):
        HazardCurve.read(hazard)


def test_what_cannot_be_written_for_openquake_is_said(tmp_path: Path) -> None:
    fitted = fragility_with(3.0, 0.4)
    for arguments, said in (({"block": "x"}, "Block"), ({"asset_category": 3}, "asset_category")):
        with pytest.raises(rocking.RockingError, match=said):
            fitted.to_nrml(tmp_path / "model.xml", **arguments)


def test_per_cent_in_a_heading_are_not_passed_over(tmp_path):
    path = tmp_path / "hazard.csv"
    path.write_text("PGA (%g),annual rate\n10,1e-2\n40,1e-4\n")
    assert HazardCurve.read(path).intensity == pytest.approx(np.array([0.1, 0.4]) * 9.80665)
    path.write_text("SA (m/s²),annual rate\n1,1e-2\n4,1e-4\n")
    assert HazardCurve.read(path, period=1.0).intensity.tolist() == [1.0, 4.0]
    path.write_text("PGA (g),annual rate (%)\n0.1,1\n0.4,0.01\n")
    with pytest.raises(OptionError, match=r"annual_rate and one of .*; got PGA \(g\), annual rate \(%\)"):
        HazardCurve.read(path)


def _rate_within(fitted, hazard):
    """Rate from motions between the ends of a hazard curve: the sum of P over fine steps of the rate."""
    steps = np.geomspace(*hazard.intensity[[0, -1]], 20001)
    middle = np.sqrt(steps[1:] * steps[:-1])
    chance = scipy.stats.norm.cdf(fitted[0] + fitted[1] * np.log(middle))
    return float(np.sum(chance * -np.diff(hazard.rate_of(steps))))


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize(
    ("levels", "fell", "trials", "hazard", "years"),
    [
        ([3, 4, 5, 6], [0, 2, 4, 5], 6, ([0.5, 2, 5], [1e-2, 1.5e-3, 1e-4]), 70000.0),
        ([3, 4, 5, 6], [0, 2, 4, 5], 6, ([0.5, 2, 5], [1e-2, 1.5e-3, 1e-4]), 20000.0),
        ([1, 2, 3, 4], [0, 1, 2, 4], 4, ([0.5, 1, 2, 3], [3e-2, 1e-2, 2e-3, 6e-4]), 5000.0),
        ([1, 2, 3, 4], [500, 500, 500, 501], 1000, ([0.5, 1, 5], [1e-1, 1e-2, 1e-4]), 100.0),
    ],
)
def test_the_largest_probability_of_standing_has_the_least_rate_within_the_curve(levels, fell, trials, hazard, years):
    curve = HazardCurve(*hazard)
    fitted = rocking.fit_fragility(levels, fell, trial_counts=trials)
    found = fitted.survival(years, curve)
    boundary = fitted.curves[0].region
    rates = [_rate_within(each, curve) for each in zip(boundary.intercept, boundary.slope, strict=True)]
    assert len(rates) > 100
    assert found.max_probability == pytest.approx(math.exp(-min(rates) * years), rel=1e-3)
    assert found.contradicts_hazard == (found.max_probability < 0.05)


def test_a_measure_that_is_not_that_of_observed_outcomes_is_refused(tmp_path):
    table = tmp_path / "observed.csv"
    table.write_text("pga_g,overturned\n0.1,0\n0.2,1\n0.3,0\n0.4,1\n")
    for measure in (Measure("pgv"), Measure("sa", 1.0)):
        with pytest.raises(OptionError, match=f"{measure.name}, but the intensities of the outcomes are pga"):
            read_observed(table, measure)
    assert read_observed(table, Measure("pga"))["measure"] == Measure("pga")


def test_functions_of_intensity_have_one_range():
    curve, site = fragility_with(3.0, 0.4).curves[0], HazardCurve([1.0, 2.0, 4.0], [1e-2, 2e-3, 2e-4])
    functions = (site.rate_of, curve.probability, curve.band, lambda x: curve.largest_rate(x, 100.0))
    for function in functions:
        for wrong in (-1e-300, -1.0, math.nan, [1.0, math.nan]):
            with pytest.raises(OptionError, match="intensities must be nonnegative"):
                function(wrong)
        assert not np.isnan(function([0.0, 1e-300, 1.0, 1e300, math.inf])).any()
    assert [float(function(0.0)) for function in (functions[0], functions[1], functions[3])] == [
        math.inf,
        0.0,
        math.inf,
    ]
    assert float(site.rate_of(8.0)) == pytest.approx(2e-5)  # the last line, extended
    assert "infinite at 0" in HazardCurve.rate_of.__doc__
