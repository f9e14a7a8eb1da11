"""Walls and restraints by options: the public functions' numbers, one line for every mistake."""

import json
import math

import pytest

import rocking
from rocking import Block, Damper, Load, RestrainedBlock, Spring, Tendon, Thrust

PULSE = ["--pulse", "one-sine:amplitude=2,frequency=1Hz"]
SIZES = ["--width", "0.5", "--height", "4", "--mass", "5000"]
BLOCK = Block(width=0.5, height=4.0, mass=5e3)
FACADE = ["--one-sided", "--thrust", "force=500,height=3"]


@pytest.mark.parametrize(
    ("options", "body"),
    [
        (FACADE, RestrainedBlock(BLOCK, Thrust(5e2, 3.0), one_sided=True)),
        (["--one-sided", "--restitution", "0.4"], RestrainedBlock(BLOCK, one_sided=True, restitution=0.4)),
        (
            ["--tendon", "stiffness=2e5,prestress=1e3", "--tendon", "stiffness=1e5,strength=2e3,offset=-0.1"],
            RestrainedBlock(BLOCK, Tendon(2e5, 1e3), Tendon(1e5, strength=2e3, offset=-0.1)),
        ),
        (
            ["--spring", "1e3", "--damper", "50", "--lean", "-1deg"],
            RestrainedBlock(BLOCK, Spring(1e3), Damper(50.0), lean=-math.radians(1.0)),
        ),
        (
            ["--load", "mass=250,height=3,moves_with_block=no,offset=0.05", "--load", "mass=100,height=4"],
            RestrainedBlock(BLOCK, Load(250.0, 3.0, 0.05, moves_with_block=False), Load(100.0, 4.0)),
        ),
    ],
    ids=["facade", "wall", "tendons", "couples", "loads"],
)
def test_simulate_takes_restraints(run, options, body):
    code, out, err = run("simulate", *PULSE, *SIZES, *options, "--json")
    assert (code, err) == (0, "")
    found, response = json.loads(out), rocking.simulate(body, rocking.pulses.one_sine(2.0, 1.0))
    assert found["block"]["description"] == body.description
    assert found["overturned"] == response.overturned
    assert found["peak_rotation_rad"] == response.peak_rotation > 0.0


@pytest.mark.thorough
def test_ida_and_fragility_take_restraints(run):
    body = RestrainedBlock(BLOCK, Thrust(5e2, 3.0), one_sided=True)
    pulse, given = rocking.pulses.one_sine(1.0, 0.8), ["--pulse", "one-sine:amplitude=1,frequency=0.8Hz"]
    code, out, _ = run("ida", *given, *SIZES, *FACADE, "--levels", "1:4:7", "--json")
    assert code == 0
    levels = [1.0 + 0.5 * k for k in range(7)]
    truth = rocking.incremental_dynamic_analysis(body, pulse, levels=levels)
    assert json.loads(out)["motions"][0]["peak_over_alpha"][0] == truth.data.peak_over_alpha.values.ravel()[0]
    code, out, _ = run("fragility", *given, *SIZES, *FACADE, "--levels", "1:4:7", "--polarity", "both", "--json")
    truth = rocking.fragility(body, pulse, levels=levels, polarity="both")
    assert json.loads(out)["curves"][0]["median"] == pytest.approx(truth.curves[0].median)
