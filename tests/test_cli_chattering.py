"""`rocking chatter`, `critical` and `paper`: the same numbers as the functions, and one line for every mistake."""

import json

import pytest

from rocking.chattering import (
    asymptotic_table,
    chattering_time,
    critical_amplitude,
    first_impact_speed,
    first_interval,
    sequence,
)


def test_chatter_json_is_what_the_functions_give(run):
    code, out, err = run("chatter", 1.03, 2, 0.92, "--json")
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert result["complete"] is True
    assert len(result["chattering_time"]) == 4
    for method, value in result["chattering_time"].items():
        assert value == float(chattering_time(1.03, 2.0, 0.92, method=method))
    exact = sequence(1.03, 2.0, 0.92)
    assert (result["bracket"]["lower"], result["bracket"]["upper"]) == (exact.lower, exact.upper)
    assert result["critical_amplitude"] == critical_amplitude(2.0, 0.92)
    assert result["first_interval"]["eq32"] == first_interval(1.03, 2.0)
    assert result["first_interval"]["exact"] == exact.impacts["interval"][0]
    assert result["first_impact_speed"]["eq34"] == first_impact_speed(1.03, 2.0)
    assert "asymptotic_table" not in result


def test_order_and_resolved_are_passed_on(run):
    _, out, _ = run("chatter", 1.01, 2, 0.92, "--order", 6, "--resolved", 20, "--json")
    times = json.loads(out)["chattering_time"]
    assert times["series"] == chattering_time(1.01, 2.0, 0.92, method="series", order=6)
    assert times["semianalytical"] == chattering_time(1.01, 2.0, 0.92, method="semianalytical", resolved=20)


def test_chatter_shows_the_iterative_procedure(run):
    table = asymptotic_table(1.01, 2.0, 0.92)
    _, out, _ = run("chatter", 1.01, 2, 0.92, "--table", "--json")
    rows = json.loads(out)["asymptotic_table"]
    assert [row["time"] for row in rows] == table["time"].tolist()
    code, out, _ = run("chatter", 1.01, 2, 0.92, "--table")
    assert code == 0
    assert "T_1;3 = " in out
    assert f"({len(table) - 12} more)" in out
    assert f"{len(table) - 1}  +1" in out
    assert len(out.splitlines()) < 40


def test_chatter_says_complete_or_incomplete(run):
    assert "complete: proven" in run("chatter", 1.03, 2, 0.92)[1]
    code, out, _ = run("chatter", 1.05, 2, 0.92)
    assert code == 0
    assert "incomplete" in out
    assert "worthless" in out
    result = json.loads(run("chatter", 1.05, 2, 0.92, "--json")[1])
    assert result["complete"] is False
    assert result["chattering_time"]["exact"] is None
    assert result["bracket"]["upper"] is None


def test_without_loss_at_impacts_nothing_rests(run):
    code, out, _ = run("chatter", 1.03, 2, 1)
    assert code == 0
    assert "incomplete" in out
    assert json.loads(run("chatter", 1.03, 2, 1, "--json")[1])["series"]["error"] is None


@pytest.mark.thorough
@pytest.mark.parametrize(
    "sequence",
    [
        (1.03, 2, 0.92),
        *(pytest.param(x, marks=pytest.mark.thorough) for x in ((1.5, 2, 0.92), (1.03, 2, 1), (1, 2, 0.9))),
    ],
)
def test_chatter_draws_the_sequence_whatever_becomes_of_it(run, tmp_path, sequence):
    code, out, _ = run("chatter", *sequence, "--out", tmp_path)
    assert code == 0
    names = {"chatter.pdf", "chatter.png", "impacts.csv", "result.json"} | (
        {"cycles.csv"} if sequence[2] < 1 else set()
    )
    assert {path.name for path in tmp_path.iterdir()} == names
    assert all(name in out for name in names)


def test_at_the_threshold_there_is_nothing_to_wait_for(run):
    result = json.loads(run("chatter", 1, 2, 0.92, "--json")[1])
    assert result["complete"] is True
    assert set(result["chattering_time"].values()) == {0.0}


def test_critical_json_has_every_method(run):
    code, out, err = run("critical", 2, 0.92, "--json")
    assert (code, err) == (0, "")
    amplitudes = json.loads(out)["critical_amplitude"]
    assert set(amplitudes) == {"exact", "eq76", "eq77", "approximation"}
    for method, value in amplitudes.items():
        assert value == critical_amplitude(2.0, 0.92, method=method)


def test_critical_says_where_an_approximation_does_not_hold(run):
    code, out, _ = run("critical", 20, 0.92)
    assert code == 0
    assert out.count("none here: it holds for fewer omega and eta") == 3
    amplitudes = json.loads(run("critical", 20, 0.92, "--json")[1])["critical_amplitude"]
    assert [name for name, value in amplitudes.items() if value is None] == ["eq76", "eq77", "approximation"]


def test_critical_prints_how_far_the_fits_are_off(run):
    out = run("critical", 2, 0.92)[1]
    assert "1.03801554\n" in out
    assert "Eq. 76" in out
    assert "off by -6.92e-04" in out


@pytest.mark.thorough
def test_paper_writes_one_figure_and_says_what_the_paper_says(run, tmp_path):
    code, out, err = run("paper", "--figure", 7, "--out", tmp_path / "new")
    assert (code, err) == (0, "")
    names = {path.name for path in (tmp_path / "new").iterdir()}
    assert names == {"figure-7.pdf", "figure-7.png", "figure-7-critical.csv"}
    assert all(name in out for name in names)
    assert "0.5 in the paper, 0.517 here" in out


@pytest.mark.slow
def test_paper_writes_all_figures(run, tmp_path):
    code, _, _ = run("paper", "--out", tmp_path)
    assert code == 0
    drawn = {path.stem for path in tmp_path.glob("*.pdf")}
    assert drawn == {f"figure-{number}" for number in range(1, 12)} | {"figure-6-surface"}


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["chatter", 0.9, 2, 0.92], "lift off"),
        (["chatter", "nan", 2, 0.92], "finite"),
        (["chatter", 1.03, 0, 0.92], "omega"),
        (["chatter", 1.03, -2, 0.92], "omega"),
        (["chatter", 1.03, 2, 0], "eta"),
        (["chatter", 1.03, 2, 1.2], "eta"),
        (["chatter", 1.03, 2, "high"], "eta"),
        (["chatter", 1.03, 2], "eta"),
        (["chatter", 1.03, 2, 0.92, "--order", 0], "order"),
        (["chatter", 1.03, 2, 0.92, "--resolved", 0], "resolved"),
        (["chatter", 1.03, 2, 1, "--table"], "eta"),
        (["critical", 2, "inf"], "eta"),
        (["critical", 2], "eta"),
        (["critical", 2, 0.92, "--method", "exact"], "--method"),
        (["paper"], "--out"),
        (["paper", "--figure", "five", "--out", "."], "--figure"),
    ],
)
def test_a_mistake_is_one_line_and_exit_2(run, arguments, word):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert err.startswith("rocking: ")
    assert word.lower() in err.lower()


@pytest.mark.parametrize("number", [0, 12, 99])
def test_a_figure_that_there_is_none_of_is_refused(run, tmp_path, number):
    code, out, err = run("paper", "--figure", number, "--out", tmp_path)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert "Figs 1 to 11" in err


def test_paper_draws_a_figure_for_other_parameters(run, tmp_path, monkeypatch):
    # What is said is looked at here, and the figure as it is drawn by others.
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda *_, **__: None)
    code, out, err = run("paper", "--figure", 5, "--eta", 0.8, "--omega", 3, "--out", tmp_path)
    assert (code, err) == (0, "")
    assert out.startswith("Fig. 5: chattering time against amplitude; omega = 3, eta = 0.8\n")
    assert f"critical amplitude a_cr: {critical_amplitude(3.0, 0.8):.7g}\n" in out
    code, out, _ = run("paper", "--figure", 1, "--alpha", "20deg", "--out", tmp_path)
    assert code == 0
    assert "alpha = 0.349065850399 rad" in out


def test_paper_refuses_a_parameter_that_a_figure_does_not_depend_on(run, tmp_path):
    code, out, err = run("paper", "--figure", 5, "--p", 2, "--out", tmp_path / "new")
    assert (code, out) == (2, "")
    assert err == "rocking: Fig. 5 does not depend on p; it takes omega and eta\n"
    code, out, err = run("paper", "--eta", 0.8, "--out", tmp_path / "new")
    assert (code, out) == (2, "")
    assert err == "rocking: with --eta one figure is drawn: say which with --figure\n"
    assert not (tmp_path / "new").exists()


@pytest.mark.slow
def test_paper_draws_figure_6_as_contours_and_as_a_surface(run, tmp_path):
    code, _, _ = run("paper", "--figure", 6, "--out", tmp_path)
    assert code == 0
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {
        "figure-6.pdf", "figure-6.png", "figure-6-surface.pdf", "figure-6-surface.png", "figure-6-surface.csv",
    }  # fmt: skip


def test_a_folder_that_cannot_be_written_to_is_refused(run, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    code, out, err = run("paper", "--out", blocked / "figures")
    assert (code, out) == (2, "")
    assert "--out" in err
