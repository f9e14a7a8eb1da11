"""`rocking schemes`: the comparison of Python, its files, and one line for every mistake."""

import json

import pytest

from rocking import dynamics

BALL = ["--ball", 0.9, "--initial-position", "1m"]
SCHEMES = ["--schemes", "velocity=1e-3,bypass=1e-3,moreau-jean=1e-3,time"]


def test_json_is_what_the_comparison_says(run):
    code, out, err = run("schemes", *BALL, *SCHEMES, "--repetitions", 0, "--json")
    assert (code, err) == (0, "")
    schemes = ["velocity=1e-3", "bypass=1e-3", "moreau-jean=1e-3", "time"]
    found = dynamics.compare_schemes(dynamics.BouncingBall(0.9), None, schemes=schemes, initial_position=1.0)
    result = json.loads(out)
    assert [entry["scheme"] for entry in result["schemes"]] == ["velocity", "bypass", "moreau-jean"]
    for entry, outcome in zip(result["schemes"], found.outcomes, strict=True):
        assert entry["position_error_m"] == outcome.position_error
        assert (entry["cost"], entry["is_right"]) == (outcome.cost, True)
        assert "processor_time_s" not in entry
    assert [*result["not_applicable"]] == ["time=eq76"]


@pytest.mark.parametrize("drawn", [False, pytest.param(True, marks=pytest.mark.thorough)])
def test_processor_times_tables_and_figure_are_written(run, tmp_path, monkeypatch, drawn):
    if not drawn:  # Drawing takes most of the time, and `test_figures.py` looks at what is drawn.
        monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda self, file, **_: file.write(b"drawn"))
    pulse = ["--pulse", "sine:amplitude=0.206g,frequency=2rad/s,cycles=2.5", "--p", 1, "--alpha", 0.2]
    code, out, err = run("schemes", *pulse, "--restitution", 0.92, "--model", "linear", *SCHEMES, "--out", tmp_path)
    assert (code, err) == (0, "")
    assert "time, ms" in out
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {"schemes.csv", "rests.csv", "schemes.png", "schemes.pdf", "result.json"}
    header, certified, *rows = (tmp_path / "schemes.csv").read_text("utf-8").splitlines()
    assert header.startswith("scheme,parameter,unit,cost,cost_unit,processor_time_s,rests_found,")
    assert certified.startswith("certified,1e-12,s,")
    assert len(rows) == 4
    assert len((tmp_path / "rests.csv").read_text("utf-8").splitlines()) == 1 + 4 * 5
    times = [
        entry["processor_time_s"] for entry in json.loads((tmp_path / "result.json").read_text("utf-8"))["schemes"]
    ]
    assert len(times) == 4 and min(times) > 0.0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([*BALL, "--p", 2], "--ball is a body of its own: leave --p out"),
        (
            [*BALL, "--schemes", "hope"],
            "a scheme must be one of velocity, interval, bypass, time, certified, moreau-jean",
        ),
        ([*BALL, "--schemes", "moreau-jean"], "moreau-jean takes its step in s, as moreau-jean=1e-3, not ''"),
        (["--ball", 0.9], "give one record or more"),
        (["ridgecrest-clc-090", "el-centro-meloland-270", "--ball", 0.9], "on one motion at a time, not on 2"),
        ([*BALL, "--repetitions", -1], "--repetitions must be"),
        ([*BALL, "--pga", "0.4g"], "--pga is of a record or a pulse: name one, or leave it out"),
        ([*BALL, "--vertical", "nosuch"], "--vertical is of a record or a pulse: name one, or leave it out"),
    ],
)
def test_a_mistake_is_one_line(run, arguments, sentence):
    code, out, err = run("schemes", *arguments)
    assert (code, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("body", "overturning"),
    [(BALL, False), (["--p", 2, "--alpha", 0.2, "--restitution", 0.8, "--initial-position", "0.05"], True)],
)
def test_only_of_what_may_overturn_is_it_said_that_it_does_not(run, body, overturning):
    code, out, _ = run("schemes", *body, "--schemes", "velocity=1e-3", "--repetitions", 0)
    assert code == 0
    assert "every rest known to" in out
    assert ("does not overturn" in out) is overturning
