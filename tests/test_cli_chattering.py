"""`rocking chatter`, `critical` and `paper`: the same numbers as the functions, and one line for every mistake."""

import json

import pytest

from rocking.chattering import (
    asymptotic_table,
    chattering_sequence,
    chattering_time,
    critical_amplitude,
    first_impact_speed,
    first_interval,
)

METHODS = ("asymptotic", "series", "semianalytical", "exact")


def test_chatter_json_is_what_the_functions_give(run):
    code, out, err = run("chatter", 1.03, 2, 0.92, "--json")
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert result["complete"] is True
    assert len(result["chattering_time"]) == 4
    for method, value in result["chattering_time"].items():
        assert value == float(chattering_time(1.03, 2.0, 0.92, method=method))
    exact = chattering_sequence(1.03, 2.0, 0.92)
    assert (result["bracket"]["lower"], result["bracket"]["upper"]) == (exact.lower, exact.upper)
    assert result["critical_amplitude"] == critical_amplitude(2.0, 0.92)
    assert result["first_interval"]["eq32"] == first_interval(1.03, 2.0)
    assert result["first_interval"]["exact"] == exact.impacts["interval"][0]
    assert result["first_impact_speed"]["eq34"] == first_impact_speed(1.03, 2.0)
    assert "asymptotic_table" not in result


def test_order_and_impact_count_are_passed_on(run):
    _, out, _ = run("chatter", 1.01, 2, 0.92, "--order", 6, "--impact-count", 20, "--json")
    times = json.loads(out)["chattering_time"]
    assert times["series"] == chattering_time(1.01, 2.0, 0.92, method="series", order=6)
    assert times["semianalytical"] == chattering_time(1.01, 2.0, 0.92, method="semianalytical", impact_count=20)


def test_chatter_shows_the_iterative_procedure(run):
    table = asymptotic_table(1.01, 2.0, 0.92)
    _, out, _ = run("chatter", 1.01, 2, 0.92, "--table", "--json")
    rows = json.loads(out)["asymptotic_table"]
    assert [row["time"] for row in rows] == table["time"].tolist()
    code, out, _ = run("chatter", 1.01, 2, 0.92, "--table")
    assert code == 0
    assert "T_0;1 = " in out
    assert f"(12 of {len(table)} rows)" in out
    assert f"{len(table) - 1}  +1" in out
    assert len(out.splitlines()) < 40


@pytest.mark.parametrize(
    ("a", "eta", "words", "times", "upper"),
    [(1.03, 0.92, "complete: proven", {}, True), (1.05, 0.92, "worthless", {"exact": None}, False),
     (1.03, 1, "incomplete", {}, False), (1, 0.92, "complete", dict.fromkeys(METHODS, 0.0), True)],
)  # fmt: skip
def test_chatter_says_complete_or_incomplete(run, a, eta, words, times, upper):
    code, out, _ = run("chatter", a, 2, eta)
    assert code == 0 and words in out and ("incomplete" in out) != upper
    result = json.loads(run("chatter", a, 2, eta, "--json")[1])
    assert result["complete"] is upper
    assert result["chattering_time"].items() >= times.items()
    assert (result["bracket"]["upper"] is not None) == upper


def test_critical_json_has_every_method(run):
    code, out, err = run("critical", 2, 0.92, "--json")
    assert (code, err) == (0, "")
    amplitudes = json.loads(out)["critical_amplitude"]
    assert set(amplitudes) == {"exact", "eq76", "eq77"}
    for method, value in amplitudes.items():
        assert value == critical_amplitude(2.0, 0.92, method=method)


def test_critical_says_where_an_approximation_does_not_hold(run):
    code, out, _ = run("critical", 20, 0.92)
    assert code == 0
    assert out.count("none here: it holds for fewer omega and eta") == 2
    amplitudes = json.loads(run("critical", 20, 0.92, "--json")[1])["critical_amplitude"]
    assert [name for name, value in amplitudes.items() if value is None] == ["eq76", "eq77"]
