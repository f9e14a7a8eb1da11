"""`rocking bifurcation` and `rocking basin`: the public functions' numbers, their files, one line for every mistake."""

import json

import numpy as np
import pytest

from rocking import Block, dynamics, pulses

BLOCK = ["--p", "2", "--alpha", "0.2", "--restitution", "0.9"]
SINE = ["--pulse", "sine:amplitude=3.5,frequency=1.2Hz"]


@pytest.mark.thorough
def test_basin_json_is_the_basins(run):
    arguments = ["--positions", "-0.2:0.2:12", "--velocities", "-0.4:0.4:11"]
    code, out, err = run("basin", *SINE, *BLOCK, *arguments, "--json")
    assert (code, err) == (0, "")
    result = json.loads(out)
    block = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    shaking = pulses.sine(3.5, 1.2, cycles=1)
    found = dynamics.basins(block, shaking, np.linspace(-0.2, 0.2, 12), np.linspace(-0.4, 0.4, 11))
    assert [each["attractor"] for each in result["attractors"]] == found.data.attractor.values.tolist()
    assert [each["share"] for each in result["attractors"]] == found.data.share.values.tolist()


@pytest.mark.parametrize(
    ("pulse", "along", "parameter"),
    [
        ("sine:frequency=1.2", "amplitude:0.1g:0.4g:5", "amplitude (m/s²)"),
        ("sine:amplitude=2.5,frequency=1", "frequency:1:2:5", "frequency (Hz)"),
    ],
)
def test_bifurcation_json_is_the_diagram(run, pulse, along, parameter):
    arguments = ["--pulse", pulse, "--along", along, "--start", "0.02,0.1", "--kept", "8", "--json"]
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
    assert (
        result["period"] == found.data.period.values.tolist()
        and result["impacts"] == found.data.impacts.values.tolist()
    )


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("options", "body"),
    [
        (["--ball", "0.5"], dynamics.BouncingBall(0.5)),
        (["--oscillator", "frequency=1,restitution=0.8,stop=0.01"], dynamics.ImpactOscillator(1.0, 0.8, stop=0.01)),
        pytest.param(
            ["--pendulum", "p=3,gap=0.1,restitution=0.6"],
            dynamics.InvertedPendulum(3.0, 0.1, 0.6),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_every_body_has_a_basin_and_a_diagram(run, options, body):
    pulse = ["--pulse", "sine:amplitude=3,frequency=1.3Hz"]
    code, out, err = run("basin", *pulse, *options, "--periods", "60", "--json")
    assert (code, err) == (0, "")
    assert body.description in (result := json.loads(out))["body"]
    assert sum(each["share"] for each in result["attractors"]) == pytest.approx(1.0)
    grid = ["--positions", "0:1cm:3", "--velocities", "0,0.1"]
    _, out, _ = run("basin", *pulse, *options, *grid, "--json")
    expected = dynamics.basins(body, pulses.sine(3.0, 1.3, cycles=1), [0.0, 0.005, 0.01], [0.0, 0.1])
    assert [each["share"] for each in json.loads(out)["attractors"]] == expected.data.share.values.tolist()
    code, out, err = run("bifurcation", *pulse, *options, "--along", "amplitude:2,3", "--kept", "8", "--json")
    assert (code, err) == (0, "")
    found = dynamics.bifurcation_diagram(
        lambda value: (body, pulses.sine(value, 1.3, cycles=1)), [2.0, 3.0], [0.01, 0.0], direction="both", kept=8
    )
    assert json.loads(out)["period"] == found.data.period.values.tolist()
