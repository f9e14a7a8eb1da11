"""`rocking bifurcation` and `rocking basin`: the public functions' numbers, their files, one line for every mistake."""

import json

import numpy as np
import pytest

from rocking import Block, dynamics, pulses

BLOCK = ["--p", "2", "--alpha", "0.2", "--restitution", "0.9"]


def test_basin_json_is_the_basins(run, tmp_path):
    arguments = ["--rotations", "-0.2:0.2:12", "--velocities", "-0.4:0.4:11", "--folder", tmp_path / "kept"]
    for _ in range(2):  # the second time from the folder
        code, out, err = run("basin", "--amplitude", "3.5", "--frequency", "1.2Hz", *BLOCK, *arguments, "--json")
        assert (code, err) == (0, "")
        result = json.loads(out)
        block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
        shaking = pulses.sine(3.5, 1.2, cycles=1)
        found = dynamics.basins(block, shaking, np.linspace(-0.2, 0.2, 12), np.linspace(-0.4, 0.4, 11))
        assert [each["attractor"] for each in result["attractors"]] == found.attractor.values.tolist()
        assert [each["share"] for each in result["attractors"]] == found.share.values.tolist()
        assert result["complete"] is True and result["basin_entropy"] == found.entropy[0]


def test_basin_prints_shares_and_writes_what_it_says(run, tmp_path):
    grid = ["--rotations", "-0.2:0.2:9", "--velocities", "-0.4:0.4:9"]
    code, out, _ = run("basin", "--amplitude", "0.35g", "--frequency", "1.2", *BLOCK, *grid, "--out", tmp_path)
    assert code == 0 and "overturns to side -" in out
    tables = {"attractors.csv", "outcomes.csv", "orbits.csv"}
    assert {path.name for path in tmp_path.iterdir()} == tables | {"basin.nc", "basin.pdf", "basin.png", "result.json"}


@pytest.mark.parametrize(
    ("amplitude", "frequency", "parameter"),
    [("0.1g:0.4g:5", "1.2", "amplitude (m/s²)"), ("2.5", "1:2:5", "frequency (Hz)")],
)
def test_bifurcation_json_is_the_diagram(run, amplitude, frequency, parameter):
    arguments = ["--amplitude", amplitude, "--frequency", frequency, "--start", "0.02,0.1", "--kept", "8", "--json"]
    code, out, err = run("bifurcation", *arguments, *BLOCK, "--direction", "up")
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert result["parameter"] == parameter and result["direction"] == ["up"]
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    over = parameter.startswith("amplitude")
    found = dynamics.bifurcation_diagram(
        lambda value: (block, pulses.sine(value if over else 2.5, 1.2 if over else value, cycles=1)),
        result["value"], [0.02, 0.1], kept=8,
    )  # fmt: skip
    assert result["period"] == found.period.values.tolist() and result["impacts"] == found.impacts.values.tolist()


def test_bifurcation_writes_what_it_says(run, tmp_path):
    arguments = ["--amplitude", "1:3:4", "--frequency", "1.2", "--kept", "4", "--out", tmp_path]
    code, out, _ = run("bifurcation", *arguments, *BLOCK)
    assert code == 0 and "up: " in out
    names = {f"bifurcation.{kind}" for kind in ("nc", "pdf", "png")} | {"states.csv", "orbits.csv", "result.json"}
    assert {path.name for path in tmp_path.iterdir()} == names


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["bifurcation", "--amplitude", "1", "--frequency", "2"], "one of --amplitude and --frequency must be a list"),
        (
            ["bifurcation", "--amplitude", "1:2:3", "--frequency", "1", "--start", "0.1"],
            "--start takes a rotation and a velocity",
        ),
        (["basin", "--amplitude", "1", "--frequency", "1", "--rotations", "0.1,0"], "--rotations must be increasing"),
        (["basin", "--amplitude", "1", "--frequency", "1", "--velocities", "1,0"], "--velocities must be increasing"),
        (["basin", "--amplitude", "1kg", "--frequency", "1"], "--amplitude takes an acceleration"),
    ],
)
def test_a_mistake_gets_one_line_with_the_options_in_it(run, arguments, words):
    code, _, err = run(*arguments, *BLOCK)
    assert code == 2 and words in err and err.count("\n") == 1
