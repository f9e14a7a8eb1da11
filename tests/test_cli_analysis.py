"""The commands with many simulations: their results, their files, one line for every mistake."""

import csv
import json
import re
from importlib import import_module

import numpy as np
import pytest

import rocking
from rocking import fragility, incremental_dynamic_analysis, overturning_map, rocking_spectrum
from rocking.core.tables import to_json
from rocking.inputs import quantities

RECORD = "el-centro-meloland-270"
OTHER = "el-centro-meloland-360"
SIZES = ["--half-width", "0.12", "--half-height", "0.55"]
CALIBRATED = ["--candidate-count", "128", "--p", "3", "--restitution", "housner", "--no-two-sided"]


def test_spectrum_json_is_the_spectrum(run):
    code, out, err = run("spectrum", RECORD, OTHER, "--alpha", "0.1,0.2", "--p", "1:4:5:log", "--json")
    assert (code, err) == (0, "")
    result = json.loads(out)
    motions = [rocking.records.load(name) for name in (RECORD, OTHER)]
    dataset = rocking_spectrum(
        rocking.Blocks.grid(alpha=[0.1, 0.2], p=quantities.read_array("1:4:5:log", "--p")), motions
    )
    assert result["motions"] == [RECORD, OTHER]
    assert result["axes"] == ["alpha", "p"]
    assert result["overturned_share"] == dataset.data.overturned_share.values.tolist()
    shown = dataset.data.fractile_over_alpha.values
    assert result["fractile_over_alpha"] == np.where(np.isinf(shown), None, shown).tolist()


@pytest.mark.thorough
def test_map_json_is_the_map(run):
    arguments = ["--alpha", "0.2", "--restitution", "0.9", "--amplitudes", "0.5:8:16", "--frequencies", "2,5", "--json"]
    code, out, err = run("map", "sine", "--cycles", "1", *arguments, "--model", "linear")
    assert (code, err) == (0, "")
    result = json.loads(out)
    block = rocking.Block.from_parameters(1.0, 0.2, 0.9)
    grid = {"amplitudes": np.linspace(0.5, 8.0, 16), "frequencies": [2.0, 5.0]}
    dataset = overturning_map(block, "one-sine", model="linear", **grid)
    assert result["mode"] == dataset.data.mode.values.tolist()
    assert [
        row["boundary_amplitude"] for row in result["boundaries"]
    ] == dataset.data.boundary_amplitude.values.tolist()
    assert result["modes"]["0"] == "overturns without impact"


def test_ida_json_is_the_analysis(run):
    code, out, err = run("ida", RECORD, *SIZES, "--measure", "pgv", "--levels", "0.2:1.5:12", "--json")
    assert (code, err) == (0, "")
    (result,) = json.loads(out)["motions"]
    dataset = incremental_dynamic_analysis(
        rocking.Block(width=0.24, height=1.1),
        rocking.records.load(RECORD),
        measure="pgv",
        levels=np.linspace(0.2, 1.5, 12),
    )
    assert result["overturning_level_m_s"] == float(dataset.data.overturning_level[0, 0])
    assert [band["from_m_s"] for band in result["overturns"]] == dataset.data.band_start.values.tolist()
    assert result["overturns"][-1]["to_m_s"] is None


@pytest.mark.usefixtures("undrawn")
def test_ida_prints_bands_and_writes_what_it_says(run, tmp_path):
    code, out, _ = run("ida", RECORD, *SIZES, "--out", tmp_path)
    assert code == 0
    # What is open above was looked at up to the last level, and no further; it is not all that overturns.
    assert re.search(r"at all levels looked at from [\d.]+ g on$", out, re.MULTILINE)
    assert "and more" not in out and "5 % apart; bands and gaps that lie between two of them are not seen" in out
    names = {"bands.csv", "levels.csv", "ida.nc", "ida.pdf", "ida.png"}
    assert {path.name for path in tmp_path.iterdir()} == names | {"result.json"}
    code, out, _ = run("ida", RECORD, *SIZES, "--levels", "0.1,0.2")
    assert "at no level looked at, 0.010197 to 0.020394 g" in out
    assert "none of them lifts a block; that begins at 0.21818 g" in out
    code, out, _ = run("ida", RECORD, *SIZES, "--levels", "2g,2.1g")
    assert "at every level looked at, 2 to 2.1 g" in out
    assert "none of them lifts" not in out


STRIPES = ["--measure", "pgv", "--levels", "0.4:1.2:9", "--polarity", "both"]


def test_fragility_json_is_the_fit(run):
    names = [name for name in rocking.records.names() if not name.endswith("up")]
    code, out, err = run("fragility", *names, *SIZES, *STRIPES, "--confidence", "0.8", "--json", "--quiet")
    assert (code, err) == (0, "")
    result = json.loads(out)
    motions = [rocking.records.load(name) for name in names]
    # The command's levels are the decimals that were meant, 0.9 and not 0.8999999999999999.
    options = {"measure": "pgv", "levels": [0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2], "polarity": "both"}
    fitted = fragility(rocking.Block(width=0.24, height=1.1), motions, confidence=0.8, **options)
    assert result["curves"] == json.loads(to_json(fitted.to_dict()))["curves"]
    assert result["measure"] == {"name": "pgv", "units": "m/s"}


@pytest.fixture
def no_work(monkeypatch):
    """Fail where anything is simulated."""

    def simulated(*arguments, **named):
        raise AssertionError("this was simulated")

    monkeypatch.setattr("rocking.engine.tasks.simulate_task", simulated)
    # A function has the name of its module there.
    monkeypatch.setattr(import_module("rocking.rules"), "simulate", simulated)


LEVELS = ["--levels", "0.1g:1.2g:12"]


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["fragility", RECORD, OTHER, *SIZES, *LEVELS, "--taxonomy", "a block", "--out", "out"], "--taxonomy of NRML"),
        (["fragility", RECORD, *SIZES, *LEVELS, "--limit-states", "a half=0.5", "--out", "out"], "limit state of NRML"),
        (
            ["fragility", RECORD, OTHER, *SIZES, *STRIPES, "--hazard", "site.csv"],
            "against the measure of the hazard curve",
        ),
        (["fragility", RECORD, OTHER, *SIZES, "--levels", "0.5g"], "--levels must contain at least two levels"),
        (["measures", RECORD, OTHER, *SIZES, "--damping", "1.5"], "--damping must be a fraction"),
        (["check", RECORD, OTHER, *SIZES, "--rules", "west,east"], "--rules must be one of"),
    ],
)
def test_what_is_wrong_with_what_is_given_is_said_before_the_work(run, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "site.csv").write_text("pga_g,annual_rate\n0.05,0.05\n1.0,0.00005\n")
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert words in err and len(err.splitlines()) == 1


@pytest.mark.usefixtures("no_work")
def test_more_folds_than_groups_are_refused_before_the_calibration(run, outcomes_table):
    code, _, err = run("calibrate", outcomes_table, *CALIBRATED, "--fold-count", "40")
    assert code == 2
    assert "--fold-count must be a whole number" in err


@pytest.mark.thorough
def test_a_fragility_that_nrml_does_not_hold_is_written_without(run, tmp_path):
    """A measure in units of blocks that are many, and so have no common unit."""
    ensemble = tmp_path / "ensemble.csv"
    columns = [f"{name}_{side}{unit}" for name, unit in (("p", "_rad_s"), ("alpha", "_rad"), ("restitution", ""))
               for side in ("plus", "minus")]  # fmt: skip
    rows = [f"{p},{p},0.2,0.2,0.9,0.9,1,linear" for p in (2.0, 2.5, 3.0)]
    ensemble.write_text("\n".join([",".join([*columns, "weight", "model"]), *rows]) + "\n")
    about = ["--ensemble", ensemble, "--measure", "pga_ratio", "--levels", "1:6:11", "--out", tmp_path / "out"]
    code, _, err = run("fragility", RECORD, OTHER, "ridgecrest-clc-090", *about)
    assert code == 0
    assert "note: fragility.xml left out: pga_ratio is in units of the block" in err
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {"fragility.png", "fragility.pdf", "fragility.csv", "outcomes.csv", "result.json"}


COMMANDS = {
    "spectrum": [RECORD, "--alpha", "0.2", "--p", "2,3"],
    "map": ["half-sine", *SIZES, "--amplitudes", "0.5:4:5", "--frequencies", "2,3"],
    "ida": [RECORD, *SIZES],
    "measures": [RECORD, OTHER, *SIZES],
    "fragility": [RECORD, OTHER, "ridgecrest-clc-090", *SIZES, *STRIPES],
    "calibrate": [*CALIBRATED],
    "simulate": [RECORD, *SIZES],
    "chatter": ["1.03", "2", "0.92"],
}


@pytest.mark.cases(fast=1)
@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize("command", COMMANDS)
def test_a_figure_that_is_refused_takes_nothing_else_away(run, tmp_path, monkeypatch, request, command):
    def refused(*arguments, **options):
        raise rocking.errors.OptionError("nothing can be drawn of {}", "alpha")

    arguments = COMMANDS[command]
    if command == "calibrate":
        arguments = [request.getfixturevalue("outcomes_table"), *arguments]
    monkeypatch.setattr("rocking.cli.output.write_figure", refused)
    code, out, err = run(command, *arguments, "--out", tmp_path / "out")
    assert code == 0, err
    assert ".png and " in err and "left out: nothing can be drawn of" in err
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert "result.json" in files and not any(name.endswith((".png", ".pdf")) for name in files)
    assert "result.json" in out


@pytest.fixture(scope="module")
def outcomes_text():
    block = rocking.Block.from_parameters(p=3.0, alpha=0.15, restitution=0.9)
    motion = rocking.records.load(RECORD)
    scales = np.linspace(0.4, 3.0, 20)
    fallen = [rocking.simulate(block, motion.scaled(scale), model="linear").overturned for scale in scales]
    assert 0 < sum(fallen) < 20
    rows = [
        f"{RECORD},{scale:.6f},{int(fell)},{k // 2}" for k, (scale, fell) in enumerate(zip(scales, fallen, strict=True))
    ]
    return "\n".join(["motion,scale,overturned,group", *rows])


@pytest.fixture
def outcomes_table(outcomes_text, tmp_path):
    """Twenty tests of a block, in a table, with two that are scaled from one motion in each group."""
    table = tmp_path / "outcomes.csv"
    table.write_text(outcomes_text)
    return table


@pytest.mark.thorough
@pytest.mark.usefixtures("coarse")
def test_calibrate_json_is_the_calibration(run, outcomes_table):
    code, out, err = run(
        "calibrate", outcomes_table, *CALIBRATED, "--fold-count", "2", "--predict", RECORD, OTHER, "--json"
    )
    assert (code, err) == (0, "")
    result = json.loads(out)
    rows = [line.split(",") for line in outcomes_table.read_text().splitlines()[1:]]
    motions = [rocking.records.load(RECORD).scaled(float(row[1])) for row in rows]
    overturned = [row[2] == "1" for row in rows]
    found = rocking.calibrate(motions, overturned, p=3.0, restitution="housner", two_sided=False, candidate_count=128)
    assert list(result["estimates"]) == ["alpha"]
    assert result["estimates"]["alpha"]["median"] == pytest.approx(found.estimates["alpha"].median, rel=1e-12)
    assert result["diagnostics"]["candidate_count"] == found.diagnostics.candidate_count
    assert set(result["cross_validated"]) == {"accuracy", "log_loss", "brier"}
    predicted = found.predict([rocking.records.load(name) for name in (RECORD, OTHER)])
    assert list(result["predicted"].values()) == pytest.approx(predicted.tolist(), rel=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--motion", RECORD], "--motion requires a table of a history"),
        (["--predict", "no-such-record"], "no-such-record"),
    ],
)
def test_calibrate_refuses_a_mistake_in_one_line(run, outcomes_table, change, words):
    code, _, err = run("calibrate", outcomes_table, *CALIBRATED, *change)
    assert code == 2
    assert words in err and len(err.splitlines()) == 1


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("command", ["ida", "measures"])
def test_a_vertical_motion_is_scaled_along_by_the_commands_that_scale(run, command):
    records = [RECORD, OTHER]
    few = {"ida": ["--levels", "1:4:4"], "measures": []}[command]
    code, out, err = run(command, *records, *SIZES, *few, "--vertical", "el-centro-meloland-up", "--json")
    assert code == 0, err
    up = rocking.records.load("el-centro-meloland-up")
    motions = [rocking.records.load(name).with_vertical(up) for name in records]
    analysis = incremental_dynamic_analysis if command == "ida" else rocking.compare_measures
    options = {"levels": [1.0, 2.0, 3.0, 4.0]} if few else {}
    expected = json.loads(to_json(analysis(rocking.Block(width=0.24, height=1.1), motions, **options).to_dict()))
    found = json.loads(out)
    part = "motions" if command == "ida" else "measures"
    assert found[part] == expected[part]
    alone = json.loads(run(command, *records, *SIZES, *few, "--json")[1])
    assert found[part] != alone[part]


def test_what_was_simulated_is_kept_where_no_curve_can_be_fitted(run, tmp_path):
    weak = ["--levels", "0.1:0.3:3", "--out", tmp_path / "out"]
    code, _, err = run("fragility", RECORD, *SIZES, *weak)
    assert code == 2
    assert "no outcome of 3 exceeds the limit" in err and str(tmp_path / "out" / "outcomes.csv") in err
    rows = list(csv.DictReader((tmp_path / "out" / "outcomes.csv").read_text().splitlines()))
    assert [row["pga_m_s2"] for row in rows] == ["0.1", "0.2", "0.3"]
    block = rocking.Block(half_width=0.12, half_height=0.55)
    with pytest.raises(rocking.errors.FitError) as refused:
        rocking.fragility(block, [rocking.records.load(RECORD)], levels=[0.1, 0.2, 0.3])
    assert refused.value.outcomes["peak_rotation_rad"].tolist() == [float(row["peak_rotation_rad"]) for row in rows]


@pytest.mark.cases(fast=5)
@pytest.mark.parametrize(
    "arguments",
    ["", "--restitution 0.5", "--one-sided", "--lean 1deg", "--tendon stiffness=2e6", "--spring 100", "--scale 2",
     "--pga 0.5g", "--pgv 0.4", "--sa 0.4g@1", "--vertical nothing", "--keep-going", "--model linear",
     "--chattering bypass", "--polarity both", "--limit-states half=0.5", "--clusters station", "--levels 1,2"],
)  # fmt: skip
def test_observed_outcomes_go_without_what_is_simulated(run, tmp_path, arguments):
    table = tmp_path / "seen.csv"
    table.write_text("pga_g,overturned\n0.1,0\n0.2,1\n0.3,0\n0.4,1\n0.5,0\n0.6,1\n")
    code, out, err = run("fragility", "--outcomes", table, *arguments.split())
    if arguments:
        assert (code, out) == (2, "")
        assert f"omit {arguments.split()[0]}" in err
    else:
        assert (code, err) == (0, "")


@pytest.mark.thorough
def test_records_of_a_fragility_belong_together_by_station_or_by_labels(run):
    names = [name for name in rocking.records.names() if not name.endswith("up")]
    motions = [rocking.records.load(name) for name in names]
    stations = [name.rpartition("-")[0] for name in names]
    stripes = ["fragility", *names, *SIZES, "--measure", "pgv", "--levels", "0.4:1.2:9"]
    options = {"measure": "pgv", "levels": [0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2]}
    code, alone, err = run(*stripes)
    assert code == 0 and "--clusters may be station, which joins them" in err and "6 motions, 9 stripes" in alone
    fitted = fragility(rocking.Block(width=0.24, height=1.1), motions, clusters=stations, **options)
    assert fitted.curves[0].cluster_count == 3
    for given in ("station", ", ".join(stations)):
        code, out, err = run(*stripes, "--clusters", given, "--json")
        assert (code, err) == (0, "")
        assert json.loads(out)["curves"][0]["median_interval"] == list(fitted.curves[0].median_interval)
    code, _, err = run(*stripes, "--clusters", "a,b")
    assert code == 2 and "--clusters must contain 6 labels" in err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scale", "3"], "--scale requires a motion; add one with --motion or --pulse"),
        (["--vertical", "up"], "--vertical requires a motion"),
        (["--candidate-count", "512"], "--candidate-count requires a table of outcomes"),
    ],
)
def test_a_free_history_goes_without_what_is_said_of_motions(run, tmp_path, arguments, said):
    history = tmp_path / "history.csv"
    history.write_text("time_s,rotation_rad\n0,0.1\n0.1,0.09\n0.2,0.05\n0.3,-0.01\n0.4,-0.03\n")
    code, _, err = run("calibrate", history, *arguments)
    assert code == 2
    assert said in err


@pytest.mark.thorough
def test_standing_is_about_overturning_in_whatever_order_the_limits_come(run, monkeypatch):
    about = f"fragility {RECORD} ridgecrest-clc-090 {' '.join(SIZES)} --levels 0.1g:1g:19 --standing 1000 --json"
    common = about.split()
    for limits in ("overturning,half=0.5", "half=0.5,overturning"):
        code, out, _ = run(*common, "--limit-states", limits)
        assert code == 0 and json.loads(out)["survival"]["limit_state"] == "overturning"
    monkeypatch.setattr("rocking.cli.fragility.fit_simulated", None)  # it is refused before anything is simulated
    code, _, err = run(*common, "--limit-states", "half=0.5,most=0.8")
    assert code == 2 and "--standing requires overturning or a single limit state; got half and most" in err
