"""The paper's asymptotic scheme: Eq. 65 against its printed terms, and against the exact sequence."""

import mpmath
import numpy as np
import pytest
from oracles.paper_scheme import cycles

from rocking import chattering
from rocking.errors import OptionError


def test_eq65_of_the_reference(reference):
    assert len(reference["paper_scheme_eq65"]) >= 4
    for case in reference["paper_scheme_eq65"]:
        time = chattering.chattering_time(case["a"], case["omega"], case["eta"], method="asymptotic")
        assert time == pytest.approx(case["tau"], rel=1e-13)


@pytest.mark.parametrize(("a", "omega", "eta"), [(1.01, 2.0, 0.92), (1.03, 5.0, 0.6), (1.1, 0.5, 0.8)])
def test_table_repeats_the_printed_equations(a, omega, eta):
    """Amplitude and frequency cancel in the product's kernel; here they are in every term."""
    table = chattering.asymptotic_table(a, omega, eta)
    printed = np.array(cycles(a, omega, eta, 40))
    assert table["term"][:40] == pytest.approx(printed[:, :2].sum(axis=1), rel=1e-9)
    assert table["speed_after"][:40] == pytest.approx(printed[:, 2] * (a - 1.0) ** 1.5, rel=1e-9)
    assert (table["order"][:40] == np.where(printed[:, 0] > 0.0, 1, 3)).all()


def test_table_adds_up_to_eq65():
    table = chattering.asymptotic_table(1.02, 3.0, 0.9)
    assert table["n"].tolist() == list(range(table.size))
    assert table["sign"][:3].tolist() == [-1, 1, -1]
    assert table["interval"] == pytest.approx(table["term"] * 0.02 ** (table["order"] / 2.0), rel=1e-12)
    assert table["time"] == pytest.approx(np.cumsum(table["interval"]))
    assert table["time"][-1] == pytest.approx(
        chattering.chattering_time(1.02, 3.0, 0.9, method="asymptotic"), rel=1e-14
    )
    assert table["interval"][-2] < 1e-16 * table["time"][-1]


def test_speeds_and_phases_of_the_table_are_those_of_the_impacts_as_the_amplitude_falls_to_one():
    eps = 1e-8
    table = chattering.asymptotic_table(1.0 + eps, 2.0, 0.92)
    impacts = chattering.chattering_sequence(1.0 + eps, 2.0, 0.92).impacts[:40]
    for name in ("speed_before", "speed_after", "interval"):
        assert table[name][:40] == pytest.approx(impacts[name], rel=1e-6)
    phases = 2.0 * impacts["time"] + np.arcsin(1.0 / (1.0 + eps))
    assert table["phase"][:40] == pytest.approx(phases, abs=1e-9)


def test_the_first_speed_of_the_table_is_the_first_term_of_eq_34():
    table = chattering.asymptotic_table(1.02, 3.0, 0.9)
    assert table["speed_before"][0] == pytest.approx(16.0 * np.sqrt(2.0) / 9.0 * 0.02**1.5, rel=1e-13)
    assert table["speed_after"] == pytest.approx(0.9 * table["speed_before"], rel=1e-14)
    assert np.sin(table["phase"][0] - 3.0 * table["time"][0]) == pytest.approx(1.0 / 1.02, rel=1e-12)


def test_eq65_is_leading_order_right_and_never_incomplete():
    eps = np.array([1e-6, 1e-5])
    error = chattering.chattering_time(1.0 + eps, 2.0, 0.92, method="asymptotic") - chattering.chattering_time(
        1.0 + eps, 2.0, 0.92
    )
    assert np.diff(np.log(error))[0] / np.log(10.0) == pytest.approx(1.5, abs=0.01)
    critical = chattering.critical_amplitude(2.0, 0.92)
    share = chattering.chattering_time(critical, 2.0, 0.92, method="asymptotic") * 2.0 / np.pi
    assert share == pytest.approx(0.82, abs=0.005)


@pytest.mark.parametrize("omega", [0.5, 1.0, 2.0, 8.0])
def test_first_interval_and_speed_err_by_the_next_order(omega):
    eps = np.array([1e-4, 1e-3])
    first = [chattering.chattering_sequence(1.0 + e, omega, 0.9).impacts[0] for e in eps]
    interval_error = chattering.first_interval(1.0 + eps, omega) - [impact["interval"] for impact in first]
    speed_error = chattering.first_impact_speed(1.0 + eps, omega) - [impact["speed_before"] for impact in first]
    assert np.diff(np.log(np.abs(interval_error)))[0] / np.log(10.0) == pytest.approx(2.5, abs=0.02)
    assert np.diff(np.log(np.abs(speed_error)))[0] / np.log(10.0) == pytest.approx(3.5, abs=0.02)


@pytest.mark.parametrize(
    "a", [*(pytest.param(a, marks=pytest.mark.thorough) for a in (1e10, 1e100, 1e300)), 1e206, 1.7e308]
)
def test_an_amplitude_whose_powers_no_double_holds_has_infinite_times(a):
    """Warnings of overflows are errors here."""
    table = chattering.asymptotic_table(a, 2.0, 0.92)
    assert np.isfinite(table["term"]).all() and (table["speed_before"] > 0.0).all()
    assert np.isinf(table["speed_before"][0]) == (a > 1e205)
    with mpmath.workdps(20):
        eps = mpmath.mpf(a) - 1
        first = mpmath.sqrt(2 * eps) / 2 * (4 + (1 - mpmath.mpf(32) / 15 * 3 / 4) * eps)
        speed = 2 * mpmath.sqrt(2 * eps) * eps * (mpmath.mpf(4) / 3 + (1 - mpmath.mpf(32) / 15 * 3 / 4) * eps)
    assert chattering.first_interval(a, 2.0) == pytest.approx(float(first), rel=1e-14)
    assert chattering.first_impact_speed(a, 2.0) == pytest.approx(float(speed), rel=1e-14)
    assert chattering.chattering_time(a, 2.0, 0.92, method="series", order=40) == np.inf
    report = chattering.chattering_report(a, 2.0, 0.92)
    assert not report.values["complete"] and "worthless" in report.summary()


def test_asymptotic_functions_know_their_ends():
    assert np.isinf(chattering.chattering_time(1.01, 2.0, 1.0, method="asymptotic"))
    assert np.isnan(chattering.first_interval(0.9, 2.0)) and chattering.first_interval(1.0, 2.0) == 0.0
    assert chattering.first_impact_speed([[1.0], [1.1]], [1.0, 2.0]).shape == (2, 2)
    with pytest.raises(OptionError, match="below 1"):
        chattering.asymptotic_table(1.01, 2.0, 1.0)
    with pytest.raises(OptionError, match="uplifts"):
        chattering.asymptotic_table(0.9, 2.0, 0.9)


def test_the_tables_and_the_figure_of_a_report_are_those_of_its_sequence():
    report = chattering.chattering_report(1.03, 2.0, 0.92)
    impacts, cycles = (report.to_dataframe(table) for table in report.TABLES)
    assert impacts["interval"].tolist() == report.impacts["interval"].tolist() and len(impacts) > 5
    assert cycles["speed_after"].tolist() == report.cycles["speed_after"].tolist() and len(cycles) > 5
    with pytest.raises(OptionError, match="must be below 1 for the iterative procedure"):
        chattering.chattering_report(1.03, 2.0, 1.0).to_dataframe("cycles")
    titles = [
        {figure_of.get_suptitle(), *(each.get_title() for each in figure_of.axes)}
        for figure_of in (report.plot(), report.plot(title="mine"))
    ]
    rest = report.values["chattering_time"]["exact"]
    assert f"a = 1.03, ω = 2, η = 0.92: at rest at p t = {rest:.6g}" in titles[0] and "mine" in titles[1]
