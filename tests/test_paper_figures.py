"""The paper's figures: the numbers that it states, the data behind each, and files that say the same."""

import importlib.util
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import theory
from figure import ETA, OMEGA, A, BlockUnderSine
from figures import FIGURES, paper_figure
from matplotlib.backends.backend_agg import FigureCanvasAgg

from rocking.chattering import chattering_time, critical_amplitude

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def figures():
    made = {number: paper_figure(number) for number in FIGURES if number != 6}
    # Amplitudes on the whole grid of Fig. 6 take seconds: here it has a quarter of them, its corners included.
    with pytest.MonkeyPatch.context() as patched:
        for axis in ("_FREQUENCIES", "_RESTITUTIONS"):
            patched.setattr(theory, axis, getattr(theory, axis)[::2])
        return made | {6: paper_figure(6)}


def stated(figure, beginning):
    (found,) = [statement for statement in figure.statements if statement.claim.startswith(beginning)]
    return found


# What the paper states in numbers


def test_eq_32_as_printed_and_eq_65_are_told_beside_what_is_right(figures):
    """Eq. 32: sqrt(2 eps) / omega (4 + eps (1 - 32 (omega^2 - 1) / (5 omega^2))), with eps = a - 1."""
    printed, corrected = (
        next(each for each in figures[2].statements if each.formula == f"Eq. 32 {how}")
        for how in ("as printed", "with its slip corrected")
    )
    eps = A - 1.0
    second = 1.0 - 6.4 * (OMEGA**2 - 1.0) / OMEGA**2
    assert printed.paper == pytest.approx(math.sqrt(2.0 * eps) / OMEGA * (4.0 + second * eps), rel=1e-14)
    assert abs(corrected.paper - corrected.here) < 0.1 * abs(printed.paper - printed.here)
    asymptotic = stated(figures[9], "time from uplift to rest")
    assert asymptotic.paper == float(chattering_time(A, OMEGA, ETA, method="asymptotic")) != asymptotic.here


def test_eq_65_is_close_at_the_first_asymptote_and_fails_at_the_second():
    critical = float(critical_amplitude(2.0, 0.92))
    for a, low, high in ((1.0 + 1e-6, 0.0, 1e-4), (critical - 1e-9, 0.15, 0.2)):
        error = 1.0 - float(chattering_time(a, 2.0, 0.92, method="asymptotic") / chattering_time(a, 2.0, 0.92))
        assert low <= abs(error) <= high


def test_chattering_is_complete_in_figure_10_and_incomplete_in_figure_11(figures):
    assert stated(figures[10], "complete chattering").here == "yes"
    incomplete = stated(figures[11], "rests in 2.5 T")
    assert incomplete.paper == incomplete.here == 0.0


def test_in_figure_11_a_threshold_of_5e_2_rests_wrongly_and_one_of_5e_10_does_not(figures):
    assert stated(figures[11], "VelTol/(p alpha) = 5e-2: rests").here == 5.0
    assert stated(figures[11], "VelTol/(p alpha) = 5e-10: rests").here == 0.0
    assert stated(figures[11], "chattering threshold: rests").here == 0.0


def test_the_time_from_one_initiation_to_the_next_is_half_a_period(figures):
    assert stated(figures[4], "from the 1st").here == pytest.approx(1.0, abs=1e-12)


def test_the_ratio_to_half_a_period_depends_on_the_frequency_too(figures):
    text = stated(figures[5], "tau_ch/(T/2)").here
    assert text == "0.8068 at omega = 0.5, 0.7308 at omega = 1, 0.7168 at omega = 2, 0.7131 at omega = 5"


def test_eq_76_is_worst_at_the_corner(figures):
    corner = stated(figures[6], "a_cr there, at omega = 0.5, eta = 0.5")
    assert corner.formula == "Eq. 76"
    assert (corner.paper, corner.here) == (pytest.approx(1.0935, abs=1e-5), pytest.approx(1.082087, abs=1e-6))


# The data


def test_in_figure_2_the_block_is_on_the_ground_at_each_impact_and_at_rest_after(figures):
    history, impacts = (figures[2].tables[name] for name in ("history", "impacts"))
    tau, phi = history["tau"], history["phi"]
    early = impacts["time"][:60]
    assert np.max(np.abs(np.interp(early, tau, phi))) < 1e-9
    middles = 0.5 * (early[:-1] + early[1:])
    np.testing.assert_array_equal(np.sign(np.interp(middles, tau, phi)), impacts["side"][:59])
    assert abs(phi[0]) < 1e-30
    assert abs(phi[-1]) < 1e-30
    assert tau[-1] == pytest.approx(float(chattering_time(1.03, 2.0, 0.92)), abs=1e-11)


def test_figure_5_is_drawn_to_the_critical_amplitude_and_only_eq_65_beyond(figures):
    table = figures[5].tables["durations"]
    critical = float(critical_amplitude(2.0, 0.92))
    inside = table["a"] < critical
    assert np.count_nonzero(inside) >= 20 and np.count_nonzero(table["a"] > critical) >= 1
    exact, asymptotic, other = (table[f"{name}_over_half_period"] for name in ("exact", "asymptotic", "semianalytical"))
    assert np.all(np.diff(exact[inside]) > 0.0) and exact[inside].max() < 1.0
    assert np.all(np.isnan(exact[table["a"] > critical]))
    assert np.all(np.isfinite(asymptotic))
    np.testing.assert_allclose(other[inside], exact[inside], rtol=0.05)


@pytest.mark.parametrize(("whole", "count"), [(False, 1000), pytest.param(True, 9000, marks=pytest.mark.thorough)])
def test_figure_6_holds_the_whole_surface(figures, whole, count):
    figure = paper_figure(6) if whole else figures[6]
    assert stated(figure, "a_cr rises as eta falls").here == "yes"
    table = figure.tables["surface"]
    omega, eta, exact, eq76 = (table[name] for name in ("omega", "eta", "exact", "eq76"))
    assert len(set(zip(omega, eta, strict=True))) == len(omega) > count
    some = slice(None, None, 13)
    np.testing.assert_array_equal(exact[some], critical_amplitude(omega[some], eta[some]))
    np.testing.assert_array_equal(eq76, critical_amplitude(omega, eta, method="eq76"))


@pytest.mark.parametrize("number", [9, 10, 11])
def test_histories_are_the_responses_of_the_schemes(figures, number):
    history, events = figures[number].tables["history"], figures[number].tables["events"]
    a = {9: 1.03, 10: 1.03, 11: 1.05}[number]
    case = BlockUnderSine(a)
    response = case.simulated("certified")
    rotation = response.rotation(history["time_over_period"] * case.period) / 0.2
    np.testing.assert_allclose(history["rotation_over_alpha_certified"], rotation, atol=1e-15)
    ours = events["time_over_period"][events["scheme"] == "certified"]
    np.testing.assert_allclose(ours * case.period, response.events["time"], atol=1e-12)
    assert np.max(np.abs(history["acceleration_over_g_alpha"])) == pytest.approx(a, rel=1e-5)


DRAWINGS = [(number, None) for number in FIGURES] + [(6, "surface")]


@pytest.mark.cases(fast=4, thorough=8)
@pytest.mark.parametrize(("number", "drawing"), DRAWINGS)
def test_no_label_leaves_the_figure(figures, number, drawing):
    drawn = figures[number].draw(drawing)
    canvas = FigureCanvasAgg(drawn)
    canvas.draw()
    assert drawn.axes
    for axes in drawn.axes:
        box = axes.get_tightbbox(canvas.get_renderer())
        assert drawn.bbox.x0 - 1.0 <= box.x0
        assert box.x1 <= drawn.bbox.x1 + 1.0
        assert drawn.bbox.y0 - 1.0 <= box.y0
        assert box.y1 <= drawn.bbox.y1 + 1.0


def test_size_and_slenderness_scale_seconds_and_radians_alone(figures):
    other = paper_figure(9, p=2.5, alpha=0.3).tables["history"]
    history = figures[9].tables["history"]
    scaled = np.interp(other["time_over_period"], history["time_over_period"], history["rotation_over_alpha_certified"])
    np.testing.assert_allclose(other["rotation_over_alpha_certified"], scaled, atol=2e-7)
    np.testing.assert_allclose(other["time_s"], other["time_over_period"] * math.pi / 2.5, rtol=1e-12)
    np.testing.assert_allclose(
        other["rotation_certified_rad"], 0.3 * other["rotation_over_alpha_certified"], rtol=1e-13, atol=1e-300
    )


def test_figure_3_states_its_last_ratio_and_that_all_late_ones_are_as_near(figures):
    cases = [name for name in figures[3].tables["ratios"] if name != "n"]
    limits = [statement for statement in figures[3].statements if "and its limit" in statement.claim]
    apart = [statement for statement in figures[3].statements if "largest relative distance" in statement.claim]
    assert len(cases) == len(limits) == len(apart) == 2
    for name, limit, late in zip(cases, limits, apart, strict=True):
        ratios = figures[3].tables["ratios"][name]
        last = np.flatnonzero(np.isfinite(ratios))[-1]
        assert f"ratio at n = {last}," in limit.claim and last > 50
        assert limit.here == ratios[last]
        assert abs(limit.here / limit.paper - 1.0) <= late.here


# The documentation


# All tables are made at once. What they hold, numbers of the paper and critical amplitudes, is also tested above.
@pytest.mark.slow
def test_the_tables_of_the_pages_are_those_that_the_script_makes():
    path = ROOT / "scripts" / "chattering_pages.py"
    specification = importlib.util.spec_from_file_location("chattering_pages", path)
    script = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(script)
    made = script.tables()
    on_page = {path.name: path.read_text("utf-8") for path in (ROOT / "docs" / "_tables").iterdir()}
    assert {name: on_page.get(name) for name in made} == made


@pytest.mark.thorough
def test_the_script_draws_one_figure_for_other_parameters_and_refuses_what_it_does_not_depend_on(tmp_path):
    script = [sys.executable, str(ROOT / "examples" / "paper")]
    done = subprocess.run([*script, "5", "--eta", "0.8", "--omega", "3", "--out", tmp_path], capture_output=True)
    said = done.stdout.decode()
    assert done.returncode == 0 and done.stderr == b""
    assert said.startswith("Fig. 5: chattering time against amplitude; omega = 3, eta = 0.8\n")
    assert f"critical amplitude a_cr: {critical_amplitude(3.0, 0.8):.7g}\n" in said
    assert {path.name for path in tmp_path.iterdir()} == {"figure-5.pdf", "figure-5.png", "figure-5-durations.csv"}
    refused = subprocess.run([*script, "5", "--p", "2", "--out", tmp_path], capture_output=True)
    assert refused.returncode == 1 and "does not depend on p" in refused.stderr.decode()
