"""The paper's figures: the numbers that it states, the data behind each, and files that say the same."""

import csv
import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import rocking
from rocking.chattering import chattering_time, critical_amplitude, interval_ratios
from rocking.chattering.paper import FIGURES, Statement, paper_figure
from rocking.chattering.paper.case import PERIOD, simulated

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def figures():
    return {number: paper_figure(number) for number in FIGURES}


def stated(figure, beginning):
    (found,) = [statement for statement in figure.statements if statement.claim.startswith(beginning)]
    return found


# What the paper states in numbers


def test_the_critical_amplitude_at_a_restitution_of_0_92_is_about_1_038():
    assert round(float(critical_amplitude(2.0, 0.92)), 3) == 1.038
    assert round(float(critical_amplitude(2.0, 0.92, method="eq77")), 3) == 1.038


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
    corner = stated(figures[6], "Eq. 76 there, at omega = 0.5, eta = 0.5")
    assert (corner.paper, corner.here) == (pytest.approx(1.0935, abs=1e-5), pytest.approx(1.082087, abs=1e-6))


def test_a_statement_knows_its_difference():
    assert Statement("a number", 1.5, 1.75).difference == 0.25
    assert Statement("words", '"small"', 1.75).difference is None
    assert Statement("a number", 1.5, 1.75).shown() == "1.5 in the paper, 1.75 here, +0.25"
    assert Statement("words", '"small"', 1.75).shown() == '"small" in the paper, 1.75 here'


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
    assert np.all(np.diff(table["exact"][inside]) > 0.0)
    assert np.all(np.isnan(table["exact"][table["a"] > critical]))
    assert np.all(np.isfinite(table["asymptotic"]))
    np.testing.assert_allclose(table["semianalytical"][inside], table["exact"][inside], rtol=0.05)


def test_figure_6_holds_the_whole_surface(figures):
    table = figures[6].tables["surface"]
    np.testing.assert_array_equal(table["exact"], critical_amplitude(table["omega"], table["eta"]))
    np.testing.assert_array_equal(table["eq76"], critical_amplitude(table["omega"], table["eta"], method="eq76"))


@pytest.mark.parametrize("number", [9, 10, 11])
def test_histories_are_the_responses_of_the_schemes(figures, number):
    history, events = figures[number].tables["history"], figures[number].tables["events"]
    a = {9: 1.03, 10: 1.03, 11: 1.05}[number]
    response = simulated(a, "certified")
    rotation = response.rotation(history["time_over_period"] * PERIOD) / 0.2
    np.testing.assert_allclose(history["rotation_over_alpha_certified"], rotation, atol=1e-15)
    ours = events["time_over_period"][events["scheme"] == "certified"]
    np.testing.assert_allclose(ours * PERIOD, response.events["time"], atol=1e-12)
    assert np.max(np.abs(history["acceleration_over_g_alpha"])) == pytest.approx(a, rel=1e-5)


# Drawings and files


@pytest.mark.parametrize("number", FIGURES)
def test_each_figure_is_written_with_its_data(figures, number, tmp_path):
    figure = figures[number]
    paths = figure.write(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in paths}
    assert paths[0].read_bytes().startswith(b"%PDF")
    assert paths[1].read_bytes().startswith(b"\x89PNG")
    for (name, table), path in zip(figure.tables.items(), paths[2:], strict=True):
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


def test_two_runs_write_the_same_files(tmp_path):
    contents = []
    for folder in ("first", "second"):
        (tmp_path / folder).mkdir()
        contents.append([path.read_bytes() for path in paper_figure(7).write(tmp_path / folder)])
    assert contents[0] == contents[1]


@pytest.mark.parametrize("number", FIGURES)
def test_no_label_leaves_the_figure(figures, number):
    drawing = figures[number].draw()
    canvas = FigureCanvasAgg(drawing)
    canvas.draw()
    for axes in drawing.axes:
        box = axes.get_tightbbox(canvas.get_renderer())
        assert drawing.bbox.x0 - 1.0 <= box.x0
        assert box.x1 <= drawing.bbox.x1 + 1.0
        assert drawing.bbox.y0 - 1.0 <= box.y0
        assert box.y1 <= drawing.bbox.y1 + 1.0


@pytest.mark.parametrize("number", [5, 6, 7])
def test_the_exact_curve_is_added(figures, number):
    drawing = figures[number].draw()
    texts = [text.get_text() for legend in drawing.legends for text in legend.get_texts()]
    texts += [text.get_text() for axes in drawing.axes if axes.get_legend() for text in axes.get_legend().get_texts()]
    assert "exact" in texts
    assert any("Eq." in text for text in texts)


@pytest.mark.parametrize("number", [1, 8, 12, 0])
def test_other_figures_are_refused(number):
    with pytest.raises(rocking.InvalidOption, match="9, 10, 11"):
        paper_figure(number)


def test_a_folder_that_is_none_is_an_output_error(figures, tmp_path):
    with pytest.raises(rocking.OutputError, match="another folder"):
        figures[3].write(tmp_path / "nowhere")


# The documentation


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
