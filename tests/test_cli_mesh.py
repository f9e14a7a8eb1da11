"""`rocking mesh` says what Solid says, and its blocks are those that other commands take."""

import json

import pytest
import trimesh

import rocking

DENSITIES = "plinth=2700,figure=2650,head=2650"


@pytest.fixture(scope="module")
def statue():
    return rocking.Solid.from_mesh("statue", density={"plinth": 2700.0, "figure": 2650.0, "head": 2650.0})


def test_the_result_is_the_body_and_its_rose(run, statue):
    code, out, err = run("mesh", "statue", "--density", DENSITIES, "--azimuth", "0,30,90", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["solid"] == json.loads(json.dumps(statue.to_dict()))
    assert found["rose"] == statue.rose().to_dict()["rose"]
    assert [row["azimuth_deg"] for row in found["blocks"]] == [0.0, 30.0, 90.0]
    for row in found["blocks"]:
        block = statue.block(row["azimuth_deg"])
        again = rocking.Block.from_pivots(
            (row["pivot_plus_m"], row["pivot_minus_m"]), row["height_of_mass_m"], row["gyration_m"]
        )
        for side, other in zip(block.sides, again.sides, strict=True):
            assert (side.p, side.alpha, side.restitution) == pytest.approx(
                (other.p, other.alpha, other.restitution), rel=1e-12
            )


def test_every_option_reaches_the_body(run, tmp_path):
    box = trimesh.creation.box((1800.0, 600.0, 400.0))
    box.export(tmp_path / "box.stl")
    options = ["--unit", "mm", "--up", "x", "--turn", "-90", "--tolerance", "0.1cm", "--restitution", "0.8,0.9"]
    code, out, err = run("mesh", tmp_path / "box.stl", *options, "--azimuth", "0", "--density", "2500", "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["solid"]["mass_kg"] == pytest.approx(2500.0 * 0.432, rel=1e-6)
    (row,) = found["blocks"]
    # x up: 400 mm to the west-east axis, 600 mm to the north; turned by a quarter they change places.
    assert row["pivot_plus_m"] == pytest.approx(0.2, rel=1e-6)
    assert (row["restitution_plus"], row["restitution_minus"]) == (0.8, 0.9)
    corners = "0.1,0.1;-0.1,0.1;-0.1,-0.1;0.1,-0.1"
    _, out, _ = run("mesh", "statue", "--support", corners, "--up", "0,0,2", "--json")
    found = json.loads(out)["solid"]["support_m"]
    assert sorted(found) == [[-0.1, -0.1], [-0.1, 0.1], [0.1, -0.1], [0.1, 0.1]]
