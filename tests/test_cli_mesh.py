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


@pytest.mark.thorough
def test_it_prints_and_writes_what_it_says(run, tmp_path, statue):
    code, out, _ = run("mesh", "statue", "--azimuth", "0:165:12", "--out", tmp_path)
    assert code == 0
    for words in ("statue.obj: 1.73 m high", "least resistance", "planar rocking leaves out", "pivot_plus_m"):
        assert words in out
    names = {"rose.png", "rose.pdf", "rose.csv", "rose.nc", "support.csv", "blocks.csv", "result.json"}
    assert {path.name for path in tmp_path.iterdir()} == names
    assert len((tmp_path / "blocks.csv").read_text().splitlines()) == 13


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


@pytest.mark.cases(fast=5)
@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nobody.obj"], "nobody.obj: there is no such file"),
        (["statue", "--density", "plinth=2700"], "--density is missing for figure, head"),
        (["statue", "--density", "plinth=1,2"], "--density takes a number, or PART=NUMBER"),
        (["statue", "--density", "heavy"], "--density takes a number, not 'heavy'"),
        (["statue", "--support", "0.1,0.1;a,b"], "--support takes a number, not 'a'"),
        (["statue", "--support", "0.1,0.1;0.2"], "--support must be"),
        (["statue", "--unit", "yard"], "--unit must be one of"),
        (["statue", "--up", "0,1"], "--up must be x, y or z, or a vector"),
        (["statue", "--up", "x"], "does not stand"),
        (["statue", "--azimuth", "north"], "--azimuth takes a number"),
        (["statue", "--tolerance", "-1"], "--tolerance"),
        (["statue", "--restitution", "0.9"], "--restitution is for the blocks of --azimuth: give one"),
    ],
)
def test_a_mistake_is_one_line(run, arguments, sentence):
    code, out, err = run("mesh", *arguments)
    assert (code, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1
