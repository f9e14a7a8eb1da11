"""Tables of objects: names, units, uncertainties and further columns, carried to every output."""

import json
from pathlib import Path

import numpy as np
import pytest

import rocking
from rocking.calibration.tables import read_table
from rocking.core.progress import notes_for

MOTIONS = {"weak": rocking.pulses.one_sine(2.5, 1.0), "strong": rocking.pulses.one_sine(6.0, 1.5)}

#: The same two objects as different people write them.
TABLES = {
    "plain": "name,width,height,room\nvase,0.24,1.1,12\nstele,0.4,2.0,14\n",
    "units in headings": "Object,Width (cm),HEIGHT [m],Room\nvase,24,1.1,12\nstele,40,2.0,14\n",
    "units after underscores": "room,item,height_mm,width_m\n12,vase,1100,.24\n14,stele,2000,.4\n",
    "units in cells": "name,width,height,room\nvase,24cm,1100 mm,12\nstele,40 cm,2 m,14\n",
    "decimal commas": "name;Width (m);Height (m);Room\nvase;0,24;1,1;12\nstele;0,4;2;14\n",
    "a title above": "Hall 3,,,\n,,,\nname,width,height,room\nvase,0.24,1.1,12\nstele,0.4,2.0,14\n,,,\n",
    "words under inputs": "name,width,height,room,Load,Lean\nvase,0.24,1.1,12,full,\nstele,0.4,2.0,14,empty,no\n",
    "short rows": "name,width,height,room,remark\nvase,0.24,1.1,12\nstele,0.4,2.0,14,\n",
}


def written(folder, text, name="inventory.csv"):
    path = folder / name
    path.write_text(text)
    return path


@pytest.mark.parametrize("text", TABLES.values(), ids=TABLES.keys())
def test_an_inventory_is_the_same_however_it_is_written(tmp_path, text):
    inventory = rocking.read_inventory(written(tmp_path, text))
    assert [(block.half_width, block.half_height) for block in inventory] == [
        (pytest.approx(0.12), pytest.approx(0.55)),
        (pytest.approx(0.2), pytest.approx(1.0)),
    ]
    assert [(block.labels["name"], block.labels["room"]) for block in inventory] == [("vase", "12"), ("stele", "14")]


def test_a_workbook_is_read_as_its_csv(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [["Inventory"], [], ["Object", "Breadth (cm)", "Height (m)", "Value (EUR)"], ["vase", 24, 1.1, 125000]]:
        book.active.append(row)
    book.active.append(["stele", "40 ± 1", "2,0"])
    book.save(tmp_path / "inventory.xlsx")
    inventory = rocking.read_inventory(tmp_path / "inventory.xlsx")
    assert [block.half_width for block in inventory] == pytest.approx([0.12, 0.2])
    assert [block.half_height for block in inventory] == pytest.approx([0.55, 1.0])
    assert inventory[0].labels == {"name": "vase", "value_eur": "125000"}
    assert inventory[1].labels == {"name": "stele", "value_eur": "", "width_sd": pytest.approx(0.01)}


@pytest.mark.parametrize(
    ("columns", "cells", "sizes"),
    [
        ("width,height", "0.30 +- 0.02,1", {"width": (0.3, 0.02), "height": 1.0}),
        ("width,height", "30 ± 2 cm,1 m +/- 5cm", {"width": (0.3, 0.02), "height": (1.0, 0.05)}),
        ("Width (cm),height", "30 +- 2,1", {"width": (0.3, 0.02), "height": 1.0}),
        ("Width (cm),height", "30 ± 20 mm,1", {"width": (0.3, 0.02), "height": 1.0}),
        ("width_cm,width_sd,height", "30,2,1", {"width": (0.3, 0.02), "height": 1.0}),
        ("width,width_sd (cm),height", "0.3,2,1", {"width": (0.3, 0.02), "height": 1.0}),
        ("width,width_sd,height", "0.3,0.0,1", {"width": 0.3, "height": 1.0}),
        ("width,width_sd,height", "0.3,,1", {"width": 0.3, "height": 1.0}),
        ("p,alpha,alpha_sd (deg)", "2,0.2,1", {"p": 2.0, "alpha": (0.2, np.pi / 180)}),
    ],
)
def test_uncertain_sizes_are_read_in_the_unit_of_their_size(tmp_path, columns, cells, sizes):
    inventory = rocking.read_inventory(written(tmp_path, f"{columns}\n{cells}\n"))
    read = {
        name: (size.first, size.second) if hasattr(size, "ppf") else size for name, size in inventory.values[0].items()
    }
    assert read == {name: pytest.approx(size) for name, size in sizes.items()}
    sample = inventory.sample(0, 40)
    assert (sample is None) == (not any(isinstance(size, tuple) for size in sizes.values()))
    if sample is not None:
        assert sample.alpha.mean() == pytest.approx(rocking.Blocks.from_bodies(inventory).alpha.mean(), rel=0.01)
        assert np.ptp(sample.alpha) > 0.0


def test_restraints_and_sides_are_columns_as_options_are(tmp_path):
    text = (
        "width,height,mass,spring,one_sided,lean,tendon\n0.4,4,2000,1e4,yes,1deg,\n"
        '0.4,2,2000,,,,"stiffness=2e5,prestress=2e3"\n'
    )
    wall, column = rocking.read_inventory(written(tmp_path, text))
    sizes = rocking.Block(width=0.4, height=4.0, mass=2000.0)
    alike = rocking.RestrainedBlock(sizes, rocking.Spring(1e4), one_sided=True, lean=np.pi / 180)
    assert wall.uplift_thresholds() == pytest.approx(alike.uplift_thresholds())
    held = rocking.RestrainedBlock(
        rocking.Block(width=0.4, height=2.0, mass=2000.0), rocking.Tendon(2e5, prestress=2e3)
    )
    assert column.uplift_thresholds() == pytest.approx(held.uplift_thresholds())
    (statue,) = rocking.read_inventory(
        written(tmp_path, "pivots_plus (cm),pivots_minus (cm),height_of_mass,gyration\n20,15,0.9,0.5\n")
    )
    assert [side.alpha for side in statue.sides] == pytest.approx([np.arctan2(0.2, 0.9), np.arctan2(0.15, 0.9)])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("name,width,height\nvase,-0.3,1\n", "line 2: width must be"),
        ("name,width,height\nvase,0.3,\n", "line 2: a block requires more than width"),
        (
            "name,width,height\nvase,0.3 +- 0.1 +- 2,1\n",
            "line 2: width must be a mean and a positive standard deviation",
        ),
        ("name,width,height\nvase,0.3 +- -2,1\n", "line 2: width must be a mean and a positive standard deviation"),
        ("width_sd,p,alpha\n0.1,2,0.2\n", "line 2: a standard deviation of width is given, but no value"),
        ("name,width,height,one_sided\nvase,0.3,1,maybe\n", "line 2: one_sided must be yes or no"),
        ("name,width,Width (m),height\nvase,0.3,1,2\n", "line 1: two columns contain width"),
        ("name,width,height\n", "contains no objects"),
        ("name,width,height\nvase,0.3,1,2,3\n", "line 2: this row has 5 cells for 3 columns"),
    ],
)
def test_a_row_that_is_no_object_is_named_with_its_line(tmp_path, text, sentence):
    with pytest.raises(rocking.RockingError, match=sentence.replace("+", r"\+")):
        rocking.read_inventory(written(tmp_path, text))


def test_one_failure_does_not_discard_the_other_objects(tmp_path):
    path = written(tmp_path, "name,width,height\nvase,0.24,1.1\nurn,0.3,-1\nstele,0.4,2\n")
    inventory = rocking.read_inventory(path, keep_going=True)
    assert [block.labels["name"] for block in inventory] == ["vase", "stele"]
    assert [*inventory.failures] == ["urn (line 3)"]
    assert "height must be" in inventory.failures["urn (line 3)"]


def test_unknown_columns_are_reported_and_kept(run, tmp_path):
    path = written(tmp_path, "name,width,height,widht,found in\nvase,0.24,1.1,3,1950\nstele,0.4,2,,1960\n")
    code, out, err = run("simulate", "--inventory", path, "--pulse", "one-sine:amplitude=3,frequency=1")
    assert code == 0
    assert "widht (did you mean width?), found in" in err
    assert out.splitlines()[2].split()[:3] == ["object", "widht", "found_in"]


def test_equal_names_are_numbered_and_missing_ones_are_too(tmp_path):
    path = written(tmp_path, "name,width,height\nvase,0.24,1.1\nvase,0.3,1\n,0.4,2\n")
    assert [block.labels["name"] for block in rocking.read_inventory(path)] == ["vase #1", "vase #2", "block 3"]


@pytest.fixture
def inventory(tmp_path):
    return rocking.read_inventory(written(tmp_path, TABLES["plain"]))


def test_results_carry_names_and_columns(inventory):
    data = rocking.simulate_many(inventory, MOTIONS)
    assert data["name"].values.tolist() == ["vase", "stele"]
    assert data["room"].values.tolist() == ["12", "14"]
    assert data["pulse_frequency"].values.tolist() == [1.0, 1.5]
    assert data["pulse_frequency"].attrs["units"] == "Hz"
    survey = rocking.survey(inventory, MOTIONS)
    assert survey.to_dataframe()[["name", "room", "record"]].values.tolist() == [
        ["vase", "12", "weak"], ["vase", "12", "strong"], ["stele", "14", "weak"], ["stele", "14", "strong"],
    ]  # fmt: skip
    assert [response.overturned for response in survey.responses] == data.overturned.values.T.ravel().tolist()
    analysis = rocking.incremental_dynamic_analysis(inventory, MOTIONS, levels=[1.0, 4.0, 8.0])
    assert {*analysis.to_dataframe("bands")["name"]} == {"vase", "stele"}
    assert "stele" in analysis.summary()
    assert [entry["name"] for entry in analysis.to_dict()["motions"]] == ["vase", "stele"] * 2
    comparison = rocking.rules.compare_rules(inventory, MOTIONS, rules=["west"])
    alone = rocking.rules.compare_rules(inventory[1], MOTIONS, rules=["west"])
    assert comparison.margins[2:] == alone.margins
    assert [ratios["west"] for ratios in comparison.ratios[2:]] == [ratios["west"] for ratios in alone.ratios]
    assert comparison.to_dataframe()["name"].tolist() == ["vase", "vase", "stele", "stele"]
    outcomes = rocking.fragility(inventory, MOTIONS, levels=np.linspace(1.9, 3.2, 14)).outcomes
    assert outcomes["name"].tolist()[:2] == ["vase", "stele"]


def test_labels_do_not_change_the_motion_of_a_block(inventory):
    bare = rocking.simulate_many([rocking.Block(width=0.24, height=1.1), rocking.Block(width=0.4, height=2.0)], MOTIONS)
    named = rocking.simulate_many(inventory, MOTIONS)
    assert all(np.array_equal(named[name], bare[name], equal_nan=True) for name in bare.data_vars)


def test_blocks_keep_their_labels(inventory):
    blocks = rocking.Blocks.from_bodies(inventory)
    assert blocks.select(np.array([1])).labels["name"].tolist() == ["stele"]
    assert blocks[1].labels == {"name": "stele", "room": "14"}
    assert blocks.with_p_scaled(np.array([2.0, 1.0])).labels["room"].tolist() == ["12", "14"]
    renamed = inventory[0].with_labels(name="urn")
    assert renamed.description == "urn: rectangular block, 0.24 m x 1.1 m"


def test_a_label_never_replaces_a_result(tmp_path):
    path = written(tmp_path, "name,width,height,overturned,period,level\nvase,0.24,1.1,never,18th,2\n")
    data = rocking.simulate_many(rocking.read_inventory(path), MOTIONS)
    assert data.overturned.dtype == bool
    assert data["object_overturned"].values.tolist() == ["never"]
    assert (data["period"].values.tolist(), data["object_level"].values.tolist()) == (["18th"], ["2"])


def test_a_study_carries_names_to_its_tables(run, tmp_path):
    written(tmp_path, TABLES["plain"])
    (tmp_path / "s.toml").write_text(
        '[blocks]\ncsv = "inventory.csv"\n[motions]\nrecords = ["el-centro-meloland-270"]\n'
        "[scales]\nfactor = [0.5, 1.0, 2.0]\n"
    )
    assert run("study", "run", tmp_path / "s.toml", tmp_path / "s")[0] == 0
    assert run("study", "export", tmp_path / "s", tmp_path / "all.csv")[0] == 0
    table = read_table(tmp_path / "all.csv")
    assert [(row["block"], row["name"], row["room"]) for _, row in table.rows[:2]] == [
        ("0", "vase", "12"),
        ("1", "stele", "14"),
    ]
    assert rocking.Study(tmp_path / "s").critical_scales()["name"].values.tolist()[0] in ("vase", "stele")
    code, out, _ = run("study", "report", tmp_path / "s")
    assert code == 0
    assert "vase" in out
    assert json.loads((tmp_path / "s" / "report" / "result.json").read_text())["spectrum"]["blocks"]["name"] == [
        "vase",
        "stele",
    ]


def test_figures_of_several_objects_have_their_names(run, tmp_path):
    path = written(tmp_path, TABLES["plain"].replace("vase", "vase: no. 1/2"))
    pulse = ("--pulse", "one-sine:amplitude=3,frequency=1")
    assert run("ida", "--inventory", path, *pulse, "--levels", "1,4,8", "--out", tmp_path / "ida")[0] == 0
    assert {"ida-vase-no.-1-2.png", "ida-stele.png"} <= {file.name for file in (tmp_path / "ida").iterdir()}
    code, _, err = run("simulate", "--inventory", path, "--width", "1", *pulse)
    assert code == 2
    assert "--inventory replaces the block: omit --width" in err


@pytest.mark.parametrize("heading", ["mu", "Friction coefficient", "friction"])
def test_the_coefficient_of_friction_may_have_its_usual_headings(tmp_path: Path, heading: str) -> None:
    path = tmp_path / "objects.csv"
    path.write_text(f"name,width,height,{heading}\nvase,0.24,1.1,0.3\n")
    assert rocking.read_inventory(path)[0].labels == {"name": "vase", "friction": "0.3"}


def test_the_first_column_names_the_objects_if_no_other_does(tmp_path):
    path = tmp_path / "racks.csv"
    path.write_text("Rack,Width (mm),Height (mm),Room\nR01,600,2000,B\nR02,800,2200,B\n")
    inventory = rocking.read_inventory(path)
    assert [block.labels["name"] for block in inventory] == ["R01", "R02"]
    path.write_text("Width (mm),Height (mm),Room\n600,2000,B\n800,2200,B\n")
    assert ["name" in block.labels for block in rocking.read_inventory(path)] == [False, False]


def test_a_depth_is_not_a_width(tmp_path, capsys):
    with notes_for("everybody"):
        rocking.read_inventory(written(tmp_path, "name,width,depth,height\nbox,0.3,0.18,0.9\n"))
    hint = "depth (blocks rock over their width: give the smaller side of the base as width)"
    assert hint in capsys.readouterr().err
