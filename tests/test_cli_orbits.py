"""`rocking orbits`: the same numbers as the functions, files for every orbit, and one line for every mistake."""

import json

import numpy as np
import pytest

from rocking import Block, Damper, RestrainedBlock, Tendon, Thrust, dynamics, pulses
from rocking.cli import dynamics as commands

SINE = "sine:amplitude=12,frequency=5Hz"


@pytest.mark.slow
def test_orbits_are_those_of_the_functions_and_one_is_followed(run, tmp_path):
    code, out, err = run("orbits", "--ball", 0.5, "--pulse", SINE, "--along", "amplitude:10:15", "--json",
                         "--out", tmp_path)  # fmt: skip
    assert (code, err) == (0, "")
    result = json.loads(out)
    expected = dynamics.periodic_orbits(dynamics.BouncingBall(0.5), pulses.sine(12.0, 5.0, cycles=1))
    assert [each["position_m"] for each in result["orbits"]] == [each.state[0] for each in expected]
    assert [each["stable"] for each in result["orbits"]] == [each.is_stable for each in expected]
    assert result["orbits"][-1]["complete_chattering"] is True
    kinds = [each["kind"] for each in result["branch"]["bifurcations"]]
    assert sorted(kinds) == ["flip", "fold"]
    names = {path.name for path in tmp_path.iterdir()}
    assert {"branch.png", "points.csv", "bifurcations.csv", "result.json"} <= names
    assert {f"orbit-{k}.pdf" for k in range(1, len(expected) + 1)} <= names


@pytest.mark.cases(fast=2)
@pytest.mark.parametrize(
    "pulse",
    ["sine:amplitude=0.05,frequency=5Hz", pytest.param("sine:amplitude=3,frequency=1.3Hz", marks=pytest.mark.thorough)],
)
@pytest.mark.parametrize(
    "body",
    [
        ("--oscillator", "frequency=1,restitution=0.8,stop=0.01,damping-ratio=0.05"),
        ("--pendulum", "p=3,gap=0.1,restitution=0.6"),
        ("--width", 0.8, "--height", 2.0, "--model", "linear"),
        ("--width", 0.5, "--height", 3.0, "--mass", 4000, "--one-sided", "--thrust", "force=500,height=2"),
    ],
)
def test_every_body_is_shown_in_a_table(run, body, pulse):
    code, out, _ = run("orbits", *body, "--pulse", pulse)
    assert code == 0
    assert out.splitlines()[0].endswith(("periodic orbit", "periodic orbits"))
    assert "largest multiplier" in out


@pytest.mark.parametrize(("restitution", "said"), [(0.0, "1"), (0.5, "infinite")])
def test_the_table_has_the_impacts_of_the_orbits(restitution, said):
    ball, table = dynamics.BouncingBall(restitution), pulses.sine(12.0, 5.0, cycles=1)
    (orbit,) = dynamics.periodic_orbits(ball, table, starts=[[0.0, 0.0]])
    assert orbit.rests and float(said.replace("infinite", "inf")) == orbit.impacts
    assert commands._text([orbit]).splitlines()[-1].split()[:3] == ["1", "1", said]


SIZES = ("--width", 0.5, "--height", 3.0, "--mass", 4000)
COLUMN = Block(width=0.5, height=3.0, mass=4e3)


@pytest.mark.thorough
def test_a_diagram_takes_restraints(run, tmp_path):
    options = (*SIZES, "--tendon", "stiffness=3e5,prestress=1e3", "--damper", 2e3, "--pulse", "sine:frequency=1.5Hz")
    few = ("--along", "amplitude:2,2.5", "--transient", 20, "--kept", 4, "--direction", "up")
    code, _, err = run("bifurcation", *options, *few, "--out", tmp_path)
    assert (code, err) == (0, "")
    tied = RestrainedBlock(COLUMN, Tendon(3e5, prestress=1e3), Damper(2e3))
    found = dynamics.bifurcation_diagram(
        lambda a: (tied, pulses.sine(a, 1.5, cycles=1)), [2.0, 2.5], (0.01, 0.0), direction="up", transient=20, kept=4
    )
    header, *rows = (tmp_path / "states.csv").read_text().splitlines()
    table = found.to_dataframe("states")
    assert len(rows) == len(table) > 0
    assert header.split(",")[0] == str(table.columns[0])
    assert float(rows[-1].split(",")[-1]) == pytest.approx(float(table.iloc[-1, -1]), rel=1e-12)


@pytest.mark.slow
def test_a_basin_of_a_wall_lies_before_its_stop(run, tmp_path):
    options = (*SIZES, "--one-sided", "--thrust", "force=500,height=2", "--pulse", "sine:amplitude=2.5,frequency=1.5Hz")
    grid = ("--positions", "0.5deg:5deg:6", "--velocities=-0.3:0.3:5", "--periods", 50)
    code, out, err = run("basin", *options, *grid, "--json", "--out", tmp_path)
    assert (code, err) == (0, "")
    wall = RestrainedBlock(COLUMN, Thrust(5e2, 2.0), one_sided=True)
    at = np.deg2rad(np.linspace(0.5, 5.0, 6))
    found = dynamics.basins(wall, pulses.sine(2.5, 1.5, cycles=1), at, np.linspace(-0.3, 0.3, 5), 50)
    shares = [[(each["attractor"], each["share"]) for each in one["attractors"]]
              for one in (json.loads(out), found.to_dict())]  # fmt: skip
    assert shares[0] == shares[1]
    assert len(shares[0]) >= 2
    assert "basin.png" in {path.name for path in tmp_path.iterdir()}
