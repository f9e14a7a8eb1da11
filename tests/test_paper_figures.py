"""The paper's figures: the numbers that it states, the data behind each, and files that say the same."""

import contextlib
import csv
import importlib.util
import inspect
import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from scipy.optimize import brentq

import rocking
from rocking.chattering import chattering_time, critical_amplitude, interval_ratios
from rocking.chattering.paper import FIGURES, Statement, paper_figure, theory
from rocking.chattering.paper.figure import ETA, OMEGA, A, BlockUnderSine

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


def test_the_critical_amplitude_at_a_restitution_of_0_92_is_about_1_038():
    assert round(float(critical_amplitude(2.0, 0.92)), 3) == 1.038
    assert round(float(critical_amplitude(2.0, 0.92, method="eq77")), 3) == 1.038


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


def test_the_critical_amplitude_differs_by_half_a_per_cent_over_the_frequencies():
    exact = critical_amplitude(np.linspace(0.5, 8.0, 301), 0.92)
    assert round(100.0 * float(exact.max() / exact.min() - 1.0), 1) == 0.5


@pytest.mark.parametrize(("a", "omega", "eta"), [(1.01, 5.0, 0.92), (1.03, 2.0, 0.86)])
def test_the_ratio_of_intervals_tends_to_the_square_of_the_restitution(a, omega, eta):
    distance = np.abs(interval_ratios(a, omega, eta, 300) - eta**2)
    assert distance[60] < 1e-3
    assert distance[299] < 1e-9
    assert np.all(distance[2:120] < distance[:118])


def test_the_chattering_time_has_two_vertical_asymptotes():
    critical = float(critical_amplitude(2.0, 0.92))
    steps = 10.0 ** -np.arange(4.0, 8.0)
    for start, direction in ((1.0, 1.0), (critical, -1.0)):
        near, nearer = (chattering_time(start + direction * h, 2.0, 0.92) for h in (2.0 * steps, steps))
        slopes = np.abs(near - nearer) / steps
        assert np.all(slopes[1:] > 2.0 * slopes[:-1])
    assert float(chattering_time(critical - 1e-10, 2.0, 0.92)) == pytest.approx(math.pi / 2.0, abs=1e-4)


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


def test_a_statement_knows_its_difference():
    assert Statement("a number", 1.5, 1.75).difference == 0.25
    assert Statement("words", '"small"', 1.75).difference is None
    assert str(Statement("a number", 1.5, 1.75)) == "1.5 in the paper, 1.75 here, +0.25"
    assert str(Statement("words", '"small"', 1.75)) == '"small" in the paper, 1.75 here'


def test_what_a_formula_gives_does_not_stand_in_the_paper_and_what_it_is_silent_on_has_ours_alone():
    by_formula = Statement("a_cr", 1.5, 1.75, formula="Eq. 76")
    assert str(by_formula) == "1.5 by Eq. 76, 1.75 here, +0.25"
    assert by_formula.cells == ("1.5, Eq. 76", "1.75", "+0.25")
    silent = Statement("rests", None, 4.0)
    assert (str(silent), silent.cells, silent.difference) == ("4", ("", "4", ""), None)


def test_of_other_parameters_nothing_is_said_to_stand_in_the_paper_that_does_not(figures):
    judged = 0
    for number in FIGURES:
        given = {name: PARAMETERS[name] for name in accepted(number)}
        for statement in (paper_figure(number, **given) if given else figures[number]).statements:
            line = f"{statement.claim}: {statement}"
            assert "(paper" not in line and "not given" not in line
            if isinstance(statement.paper, float) and number not in (4, 6):
                assert statement.formula.startswith("Eq. ") and " in the paper" not in line
                judged += 1
    assert judged >= 9


@pytest.mark.parametrize(
    ("a", "omega", "eta", "beginning", "end"),
    [
        (1.03, 2.0, 0.92, "first rest, s before that of certified", '"properly" in the paper, 0.0213 here'),
        (1.07, 2.0, 0.8, "first rest, s before that of certified", "0.0901"),
        (1.06, 2.0, 0.92, "first rest, beside that of certified", "neither rests"),
        (1.0386, 4.0, 0.92, "first rest, beside that of certified", "only chattering threshold rests"),
    ],
)
def test_figure_10_says_which_response_rests_first(a, omega, eta, beginning, end):
    rest = stated(paper_figure(10, a=a, omega=omega, eta=eta), f"chattering threshold: {beginning}")
    assert str(rest) == end


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


# Drawings and files


@pytest.mark.thorough
@pytest.mark.parametrize(
    "number", [number if number == 6 else pytest.param(number, marks=pytest.mark.thorough) for number in FIGURES]
)
def test_each_figure_is_written_with_its_data(unarranged, figures, number, tmp_path):
    figure = figures[number]
    paths = figure.write(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in paths}
    drawn, tables = paths[: 2 * len(figure.drawings)], paths[2 * len(figure.drawings) :]
    for pdf, png in zip(drawn[::2], drawn[1::2], strict=True):
        assert pdf.read_bytes().startswith(b"%PDF")
        assert png.read_bytes().startswith(b"\x89PNG")
    for (name, table), path in zip(figure.tables.items(), tables, strict=True):
        assert path.name == f"figure-{number}-{name}.csv"
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
        assert rows[0] == list(table)
        for k, column in enumerate(table.values()):
            read = [row[k] for row in rows[1:]]
            if np.issubdtype(column.dtype, np.number):
                np.testing.assert_allclose(np.array(read, dtype=float), column, rtol=1e-11)
            else:
                assert read == column.tolist()


@pytest.mark.thorough
def test_two_runs_write_the_same_files(unarranged, tmp_path, monkeypatch):
    contents = []
    for folder, seconds in (("first", "0"), ("second", "86400")):
        (tmp_path / folder).mkdir()
        # Matplotlib takes this for the date of a file.
        monkeypatch.setenv("SOURCE_DATE_EPOCH", seconds)
        contents.append([path.read_bytes() for path in paper_figure(1).write(tmp_path / folder)])
    assert contents[0] == contents[1]


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


@pytest.mark.parametrize("number", [5, 6, 7])
def test_the_exact_curve_is_added(figures, number):
    drawing = figures[number].draw()
    texts = [text.get_text() for legend in drawing.legends for text in legend.get_texts()]
    texts += [text.get_text() for axes in drawing.axes if axes.get_legend() for text in axes.get_legend().get_texts()]
    assert "exact" in texts
    assert any("Eq." in text for text in texts)


@pytest.mark.parametrize("number", [12, 0, -1, "five"])
def test_other_figures_are_refused(number):
    with pytest.raises(rocking.InvalidOption, match="Figs 1 to 11"):
        paper_figure(number)


def test_a_drawing_that_there_is_none_of_is_refused(figures):
    with pytest.raises(rocking.InvalidOption, match="contours or surface"):
        figures[6].draw("map")


def test_a_folder_that_is_none_is_an_output_error(figures, tmp_path):
    with pytest.raises(rocking.OutputError, match=r"there is no folder .*nowhere; make it"):
        figures[3].write(tmp_path / "nowhere")


# What is drawn


def curves(axes):
    return {line.get_label(): line.get_xydata() for line in axes.lines}


def test_the_block_of_figure_1_has_the_slenderness_that_it_names():
    for alpha in (0.2, 0.5):
        drawing = paper_figure(1, alpha=alpha).draw()
        rocking_block, upright = (patch.get_xy()[:4] for patch in drawing.axes[0].patches[:2])
        for corners in (rocking_block, upright):
            width, height = (np.hypot(*(corners[k + 1] - corners[k])) for k in (1, 0))
            assert width / height == pytest.approx(math.tan(alpha), rel=1e-12)
            assert np.hypot(width, height) == pytest.approx(2.0, rel=1e-12)
        np.testing.assert_allclose(rocking_block[0], upright[0], atol=1e-15)
        # Clockwise about the right corner, and above the ground.
        assert rocking_block[1, 0] > upright[1, 0]
        assert rocking_block[3, 1] > 0.0
        points = paper_figure(1, alpha=alpha).tables["points"]
        centre = np.array([points["x_rocking_over_R"][4], points["y_rocking_over_R"][4]])
        assert np.hypot(*(centre - rocking_block[0])) == pytest.approx(1.0, rel=1e-12)
        np.testing.assert_allclose(centre, rocking_block.mean(axis=0), atol=1e-12)


def test_figure_2_names_each_interval_between_its_impacts(figures):
    drawing = figures[2].draw()
    impacts = figures[2].tables["impacts"]
    for axes, first in ((drawing.axes[1], 0), (drawing.axes[2], 60)):
        texts = {text.get_text(): text for text in axes.texts if text.get_text().startswith(r"$\Delta")}
        assert rf"$\Delta\tau_{{{first}}}$" in texts
        marks = {text.get_text(): text.xy[0] for text in axes.texts if text.get_text().startswith(r"$\tau")}
        for label, text in texts.items():
            n = int(label[len(r"$\Delta\tau_{") : -2])
            start, end = marks[rf"$\tau_{{{n}}}$"], marks[rf"$\tau_{{{n + 1}}}$"]
            assert text.xy[0] == pytest.approx(0.5 * (start + end))
            factor = 1.0 if first == 0 else 1e3
            assert end - start == pytest.approx(factor * impacts["interval"][n], rel=1e-9)


def test_figure_5_draws_the_times_of_the_parameters_that_it_is_given():
    drawing = paper_figure(5, omega=1.0, eta=0.8).draw()
    drawn = curves(drawing.axes[0])
    for label, method in (("exact", "exact"), ("asymptotic (Eq. 65)", "asymptotic")):
        a, share = drawn[label].T
        expected = chattering_time(a, 1.0, 0.8, method=method) / math.pi
        np.testing.assert_allclose(share, expected, rtol=1e-13)
    (label,) = [text.get_text() for text in drawing.axes[0].texts if "a_{cr}" in text.get_text()]
    assert label.endswith(f"{critical_amplitude(1.0, 0.8):.6f}")


def test_figure_6_draws_eq_76_above_or_below_the_surface_as_it_is(figures):
    axes = figures[6].draw("surface").axes[0]
    shown = 0
    for line in axes.lines:
        omega, eta, height = (np.asarray(values) for values in line.get_data_3d())
        np.testing.assert_allclose(height, critical_amplitude(omega, eta, method="eq76"), rtol=1e-13)
        above = height >= critical_amplitude(omega, eta)
        assert np.all(above) if line.get_markerfacecolor() != "white" else not np.any(above)
        shown += height.size
    assert shown == 17 * 11


@pytest.mark.thorough
def test_the_labels_of_figure_6_lie_within_their_panel_and_apart(figures):
    drawing = figures[6].draw()
    canvas = FigureCanvasAgg(drawing)
    canvas.draw()
    assert len(drawing.axes) >= 2
    for axes in drawing.axes:
        boxes = [text.get_window_extent(canvas.get_renderer()) for text in axes.texts]
        assert len(boxes) > 5
        for k, box in enumerate(boxes):
            assert axes.bbox.x0 <= box.x0 and box.x1 <= axes.bbox.x1
            assert axes.bbox.y0 <= box.y0 and box.y1 <= axes.bbox.y1
            assert not any(box.overlaps(other) for other in boxes[k + 1 :])


def test_figure_7_has_no_kinks(figures):
    omega, exact = figures[7].tables["critical"]["omega"], figures[7].tables["critical"]["exact"]
    middles = np.sqrt(omega[1:] * omega[:-1])
    straight = np.interp(middles, omega, exact)
    height = exact.max() - exact.min()
    assert np.max(np.abs(straight - critical_amplitude(middles, 0.92))) < 2e-3 * height


@pytest.mark.parametrize("number", [9, *(pytest.param(number, marks=pytest.mark.thorough) for number in (10, 11))])
def test_histories_are_drawn_as_they_are_computed(figures, number):
    figure = figures[number]
    axes = figure.draw().axes[0]
    history = figure.tables["history"]
    drawn = [line.get_xydata().T for line in axes.lines if line.get_label() in LABELS]
    columns = [name for name in history if name.startswith("rotation_over_alpha")]
    for (time, rotation), name in zip(drawn, columns, strict=True):
        np.testing.assert_array_equal(time, history["time_over_period"])
        np.testing.assert_allclose(rotation, 1e3 * history[name], rtol=1e-14)
    assert "$10^{3}$" in axes.get_ylabel()


LABELS = {
    "certified",
    "chattering threshold (Eq. 65)",
    r"$VelTol/(p\alpha) = 5\cdot 10^{-10}$",
    r"$VelTol/(p\alpha) = 5\cdot 10^{-2}$",
}


# Fig. 8: what is drawn is what is done


class Walker:
    """A slender block in the paper's dimensionless form, which does what the boxes of a flowchart say."""

    def __init__(self, a, omega, eta, end, over):
        self.a, self.omega, self.eta, self.end, self.is_over = a, omega, eta, end, over
        self.tau, self.rests = 0.0, []

    def uplift(self):
        """Next crossing of 1 by the size of the acceleration, from below."""
        phase, threshold = self.omega * self.tau, math.asin(1.0 / self.a)
        half_periods = math.floor((phase - threshold) / math.pi) + 1
        self.next = (threshold + half_periods * math.pi) / self.omega
        self.sign = 1 if half_periods % 2 else -1

    def lifts(self):
        if self.next >= self.end:
            return "no"
        self.tau = self.uplifted = self.next
        self.speed = 0.0
        return "yes"

    def rotation(self, s):
        """Eqs 6 and 8, s after the last event."""
        particular = self.a / (1.0 + self.omega**2)
        at = self.omega * self.tau
        plus = -self.sign - particular * math.sin(at)
        minus = self.sign * self.speed - self.omega * particular * math.cos(at)
        wave = math.sin(self.omega * (self.tau + s))
        return plus * math.cosh(s) + minus * math.sinh(s) + self.sign + particular * wave

    def slope(self, s):
        return (self.rotation(s + 1e-6) - self.rotation(s - 1e-6)) / 2e-6

    def arc(self):
        # What presses the block down is at most 1 + a, so an arc lasts at least 2 speed/(1 + a).
        step = 0.2 * self.speed / (1.0 + self.a) if self.speed > 0.0 else 1e-2
        s = step
        while self.sign * self.rotation(s + step) > 0.0 and self.tau + s < self.end:
            s += step
        self.next = s if self.tau + s >= self.end else brentq(self.rotation, s, s + step, xtol=1e-14)

    def lands(self):
        return "no" if self.tau + self.next >= self.end else "yes"

    def impact(self):
        speed = self.eta * abs(self.slope(self.next))
        self.tau += self.next
        self.speed, self.sign = speed, -self.sign

    def over(self):
        return "yes" if self.is_over(self) else "no"

    def still(self):
        return "yes" if self.speed == 0.0 or self.next < 1e-14 else "no"

    def rest(self):
        self.rests.append(self.tau)

    def follow(self, chart):
        place = "start"
        for _ in range(100_000):
            if place == "end":
                return self.rests
            answer = getattr(self, place, lambda: None)() or ""
            (place,) = [way.end for way in chart.ways if way.start == place and way.answer == answer]
        raise AssertionError("the flowchart has no end")


@pytest.mark.parametrize(
    ("k", "a", "threshold", "count"), [(0, 1.03, None, 4), (0, 1.05, None, 0), (1, 1.03, 2e-4, 4), (1, 1.05, 5e-2, 5)]
)
def test_whoever_follows_the_flowcharts_rests_when_simulate_does(figures, k, a, threshold, count):
    chart = figures[8].drawings["flowcharts"].args[0][k]
    case = BlockUnderSine(a)
    limit = float(chattering_time(a, 2.0, 0.92, method="asymptotic"))
    complete = 1.0 <= a < critical_amplitude(2.0, 0.92, method="eq76")
    rules = (
        lambda walker: complete and walker.tau - walker.uplifted >= limit,
        lambda walker: walker.speed <= threshold,
    )
    rests = Walker(a, 2.0, 0.92, 2.5 * case.period, rules[k]).follow(chart)
    treatment = rocking.AsymptoticTime() if threshold is None else rocking.VelocityThreshold(threshold)
    events = case.simulated(treatment).events
    expected = events["time"][events["kind"] == "rest"]
    assert len(expected) == count
    np.testing.assert_allclose(rests, expected, atol=1e-6)


def test_every_decision_of_the_flowcharts_has_both_answers_and_every_box_is_reached(figures):
    charts = figures[8].drawings["flowcharts"].args[0]
    assert len(charts) == 2 and all(len(chart.boxes) >= 5 for chart in charts)
    for chart in charts:
        for name, box in chart.boxes.items():
            answers = sorted(way.answer for way in chart.ways if way.start == name)
            assert answers == (["no", "yes"] if box.kind == "decision" else [] if name == "end" else [""])
            assert name == "start" or any(way.end == name for way in chart.ways)


# Other parameters than the paper's

PARAMETERS = {"a": 1.02, "omega": 3.0, "eta": 0.8, "p": 2.5, "alpha": 0.3}


def accepted(number):
    return [name for name in inspect.signature(FIGURES[number]).parameters if name in PARAMETERS]


def test_a_figure_takes_what_it_depends_on_and_refuses_the_rest_by_name():
    judged = 0
    for number in FIGURES:
        for name in {*PARAMETERS} - {*accepted(number)}:
            takes = " and ".join(accepted(number)[-2:]) or "one way only"
            with pytest.raises(rocking.InvalidOption, match=f"does not depend on {name}; .*{takes}"):
                paper_figure(number, **{name: PARAMETERS[name]})
            judged += 1
    assert judged >= 20


def differ(one, other):
    return any(
        table[name].shape != other[key][name].shape or not np.array_equal(table[name], other[key][name])
        for key, table in one.items()
        for name in table
        if name in other[key] and np.issubdtype(table[name].dtype, np.number)
    )


def test_every_parameter_that_a_figure_takes_changes_its_data(figures):
    judged = 0
    for number in FIGURES:
        for name in accepted(number):
            if (number, name) == (4, "eta"):
                continue  # The excitation has no restitution; the time to rest is drawn and not tabulated.
            other = paper_figure(number, **{name: PARAMETERS[name]})
            assert differ(figures[number].tables, other.tables), (number, name)
            judged += 1
    assert judged >= 25


@pytest.mark.cases(fast=4)
@pytest.mark.parametrize("number", [number for number in FIGURES if number not in (6, 8)])
def test_titles_and_captions_say_the_values_used_and_no_other(number):
    given = {name: PARAMETERS[name] for name in accepted(number)}
    figure = paper_figure(number, **given)
    for name, value in given.items():
        assert f"{name} = {value:g}" in figure.caption
    drawing = figure.draw()
    texts = " ".join(text.get_text() for text in drawing.findobj(Text))
    for name, value in given.items():
        if (number, name) not in ((2, "p"), (2, "alpha")):  # Both axes of Fig. 2 are dimensionless.
            assert f"= {value:g}" in texts, name
    for paper in ("1.03", "1.05", "0.92", "1.01", "0.86", "1.038"):
        for name in ("a", r"\omega", r"\eta"):
            assert f"${name}$ = {paper}" not in texts
    assert all(statement.paper != 1.038 for statement in figure.statements)


def test_size_and_slenderness_scale_seconds_and_radians_alone(figures):
    other = paper_figure(9, p=2.5, alpha=0.3).tables["history"]
    history = figures[9].tables["history"]
    scaled = np.interp(other["time_over_period"], history["time_over_period"], history["rotation_over_alpha_certified"])
    np.testing.assert_allclose(other["rotation_over_alpha_certified"], scaled, atol=2e-7)
    np.testing.assert_allclose(other["time_s"], other["time_over_period"] * math.pi / 2.5, rtol=1e-12)
    np.testing.assert_allclose(
        other["rotation_certified_rad"], 0.3 * other["rotation_over_alpha_certified"], rtol=1e-13, atol=1e-300
    )


def test_figure_3_has_one_panel_where_its_cases_are_the_same():
    figure = paper_figure(3, **{name: PARAMETERS[name] for name in ("a", "omega", "eta")})
    assert len(figure.draw().axes) == 1
    assert list(figure.tables["ratios"]) == ["n", "ratio_a"]
    np.testing.assert_array_equal(figure.tables["ratios"]["ratio_a"], interval_ratios(1.02, 3.0, 0.8, 100))


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


@pytest.mark.parametrize("number", [9, 10, 11])
def test_the_detail_of_a_response_is_a_panel_whose_time_is_shaded_wide_enough_to_be_seen(figures, number):
    drawing = figures[number].draw()
    response, excitation, detail = drawing.axes
    assert not response.child_axes
    (shaded,) = response.patches
    low, high = detail.get_xlim()
    assert (shaded.get_x(), shaded.get_x() + shaded.get_width()) == pytest.approx((low, high))
    assert high - low > 0.005 * (response.get_xlim()[1] - response.get_xlim()[0])
    assert response.get_xlim() == excitation.get_xlim() == (0.0, 2.5)
    magnified = [line.get_ydata()[(line.get_xdata() > low) & (line.get_xdata() < high)] for line in detail.lines[1:]]
    assert max(np.max(np.abs(values)) for values in magnified) > 0.5 * detail.get_ylim()[1]


@pytest.mark.parametrize("a", [1.00001, pytest.param(1.0 + 1e-13, marks=pytest.mark.thorough)])
def test_the_detail_of_a_very_short_chattering_shows_its_arcs(a):
    figure = paper_figure(10, a=a)
    low, high = figure.draw().axes[2].get_xlim()
    history = figure.tables["history"]
    time, rotation = history["time_over_period"], history["rotation_over_alpha_certified"]
    inside = np.abs(rotation[(low < time) & (time < high)])
    turnings = np.sum((inside[1:-1] > inside[:-2]) & (inside[1:-1] >= inside[2:]))
    assert turnings >= 5 and inside.max() > 1e-3 * np.max(np.abs(rotation))


@pytest.mark.thorough
def test_an_initiation_that_the_certified_response_has_not_names_the_scheme_that_has_it(figures):
    texts = {number: [text.get_text() for text in figures[number].draw().axes[1].texts] for number in (10, 11)}
    assert texts[10] == ["1st initiation", "2nd initiation"]
    assert texts[11] == ["1st initiation", r"2nd initiation, by $VelTol/(p\alpha) = 5\cdot 10^{-2}$ alone"]


@pytest.mark.thorough
@pytest.mark.parametrize("eta", [0.01, *(pytest.param(eta, marks=pytest.mark.thorough) for eta in (0.5, 0.99))])
@pytest.mark.parametrize("number", [2, *(pytest.param(number, marks=pytest.mark.thorough) for number in (3, 9))])
def test_sequences_of_few_and_of_many_impacts_are_drawn(eta, number):
    a = 1.0 + 0.5 * (critical_amplitude(2.0, eta) - 1.0)
    with pytest.warns(rocking.errors.OutsideFit) if number == 9 and eta != 0.5 else contextlib.nullcontext():
        figure = paper_figure(number, a=a, eta=eta)
    FigureCanvasAgg(figure.draw()).draw()


def test_without_rest_figures_4_and_9_say_so():
    assert stated(paper_figure(4, a=1.05), "chattering time").here == "none"
    figure = paper_figure(9, a=1.05)
    assert stated(figure, "rest of the scheme").here == "none"
    assert stated(figure, "rests in 2.5 T").here == 0.0
    texts = [text.get_text() for text in paper_figure(4, a=1.05).draw().axes[0].texts]
    assert "1st initiation" in texts
    assert not {"2nd initiation", "at rest", r"$\tau_{ch}$"} & set(texts)


@pytest.mark.parametrize(
    ("number", "parameters", "sentence"),
    [
        (2, {"a": 1.05}, "Fig. 2 shows complete chattering: a must be below the critical amplitude 1.03801554"),
        (3, {"a": 1.2}, "Fig. 3 shows complete chattering"),
        (4, {"a": 1.0}, "a must be above 1"),
        (5, {"eta": 1.0}, "eta must be below 1"),
        (7, {"eta": 1.0}, "eta must be below 1"),
        (5, {"omega": 0.0}, "omega must be between"),
        (9, {"p": 0.0}, "p must be a positive number"),
        (1, {"alpha": 2.0}, "alpha must be between 0 and pi/2"),
        (9, {"a": 3.0}, "overturns"),
        (9, {"a": "high"}, "a .*must be a number"),
        *((number, {"a": 1.0 + 2.0**-52}, "take a larger one") for number in (2, 9, 10, 11)),
        (3, {"eta": 1e-150}, "take a larger eta"),
    ],
)
def test_parameters_beyond_a_figures_range_are_refused(number, parameters, sentence):
    with pytest.raises(rocking.InvalidOption, match=sentence):
        paper_figure(number, **parameters)


# The documentation


# All tables are made at once. What they hold, numbers of the paper and critical amplitudes, is also tested above.
@pytest.mark.slow
def test_the_tables_of_the_pages_are_those_that_the_script_makes():
    path = ROOT / "scripts" / "chattering_pages.py"
    specification = importlib.util.spec_from_file_location("chattering_pages", path)
    script = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(script)
    made = script.tables()
    on_page = {path.name: path.read_text("utf-8") for path in script.TABLES.iterdir()}
    assert {name: on_page.get(name) for name in made} == made


def test_every_table_and_image_of_the_two_pages_exists():
    for page in ("paper.md", "chattering-maps.md"):
        text = (ROOT / "docs" / page).read_text("utf-8")
        named = [line.split(" ")[1] for line in text.splitlines() if line.startswith("```{include}")]
        named += [part.split(")")[0] for part in text.split("](")[1:] if part.startswith("_static")]
        assert named
        for name in named:
            file = ROOT / "docs" / name
            assert file.is_file()
            assert file.stat().st_size < 150_000
