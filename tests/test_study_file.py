"""A study from a text file, through the commands: the same as from Python, and every mistake with its line."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

import rocking
from rocking.studies import TEMPLATE, read_study

TEXT = """\
[blocks]
p = "1:6:5"
alpha = ["10deg", 0.2]
restitution = 0.9

[motions]
records = ["el-centro-meloland-270"]

[[motions.pulses]]
family = "one-sine"
amplitude = ["0.3g", "0.5g"]
frequency = [0.5, 1.0]

[scales]
factor = [0.5, 1.0]
polarity = "both"

[simulation]
model = "linear"
chattering = "certified=1e-9"
"""


WALLS = """\
[blocks]
width = [0.5, 0.6]
height = 4.0
mass = 5000
one_sided = true
lean = ["0deg", "0.5deg"]
restitution = 0.4
spring = 2e3

[[blocks.thrusts]]
force = [300, 600]
height = 3

[[blocks.loads]]
mass = 100
height = 4
moves_with_block = false

[[blocks.tendons]]
stiffness = 1e5
offset = -0.1

[motions]
records = ["ridgecrest-clc-090", "el-centro-meloland-270"]

[scales]
pga = [1.0, 2.0, 3.0, 4.0]
polarity = "both"
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(TEXT)
    return path


def test_a_file_is_the_product_that_it_describes(file):
    product = read_study(file).product
    assert product.shape == (5, 2, 2, 10)
    np.testing.assert_allclose(np.unique(product.blocks.alpha), [np.deg2rad(10.0), 0.2])
    assert [round(motion.pga / 9.80665, 6) for motion in product.motions[1:]] == [0.3, 0.3, 0.5, 0.5]
    assert product.model == "linear"
    assert product.chattering == rocking.Certified(1e-9)
    assert product.scales.values.tolist() == [0.5, 1.0]


def test_a_peak_velocity_has_units_as_on_the_command_line(file):
    text = file.read_text(encoding="utf-8")
    (old,) = (line for line in text.splitlines() if line.startswith("factor ="))
    file.write_text(text.replace(old, 'pgv = ["40cm/s", 0.6]'), encoding="utf-8")
    scales = read_study(file).product.scales
    assert scales.values == pytest.approx([0.4, 0.6], rel=1e-15)
    assert scales.measure.name == "pgv"


def test_the_template_describes_a_study(tmp_path):
    path = tmp_path / "new.toml"
    path.write_text(TEMPLATE)
    assert read_study(path).product.shape == (2, 3, 1, 320)


GRID = 'p = "1:6:5"\nalpha = ["10deg", 0.2]\nrestitution = 0.9\n'


def test_a_table_of_blocks_that_cannot_be_is_refused_with_its_line(tmp_path, file):
    file.write_text(TEXT.replace(GRID, 'csv = "blocks.csv"\n'))
    (tmp_path / "blocks.csv").write_text("width,height,offset\n0.3,1.1,0\n0.3,1.1,0.2\n")
    with pytest.raises(rocking.errors.StudyError, match=r"blocks\.csv, line 3: offset must be at most"):
        read_study(file)
    (tmp_path / "blocks.csv").write_text("p_plus,p_minus,alpha\n2,2,0.2\n2,3,0.2\n")
    with pytest.raises(rocking.errors.StudyError, match=r"blocks\.csv, line 3: no rigid body has p = 2 and 3"):
        read_study(file)


def test_blocks_come_from_a_table_as_well(tmp_path, file):
    (tmp_path / "blocks.csv").write_text("p,alpha,restitution\n2.0,12deg,0.9\n3.0,0.2,0.85\n")
    file.write_text(TEXT.replace(GRID, 'csv = "blocks.csv"\n'))
    blocks = read_study(file).product.blocks
    np.testing.assert_allclose(blocks.alpha[:, 0], [np.deg2rad(12.0), 0.2])
    assert blocks.restitution[:, 0].tolist() == [0.9, 0.85]
    # As spreadsheets write it where the comma is the decimal sign.
    (tmp_path / "blocks.csv").write_text(
        "\ufeffp; alpha ;restitution;Bemerkung\r\n2,0;12deg;0,9;\r\n3;0,2;0,85;x\r\n;;;\r\n"
    )
    again = read_study(file).product.blocks
    assert (again.p.tolist(), again.alpha.tolist()) == (blocks.p.tolist(), blocks.alpha.tolist())
    assert again.restitution.tolist() == blocks.restitution.tolist()
    (tmp_path / "blocks.csv").write_bytes("p;alpha;name\n2;0,2;Säule\n".encode("latin-1"))
    with pytest.raises(rocking.errors.StudyError, match="not a text table in UTF-8"):
        read_study(file)
    (tmp_path / "blocks.csv").write_text("p,alpha\n2.0,0.2\nfast,0.2\n")
    with pytest.raises(rocking.errors.StudyError, match=r"blocks\.csv, line 3: p must be an angular velocity"):
        read_study(file)


#: What stands in a file (of `TEXT`, or else of `WALLS`), what replaces it, the line of the error, and words of it.
MISTAKES = r"""
p = "1:6:5" -> p = "fast" | 2 | p must be an angular velocity
restitution = 0.9 -> restitutoin = 0.9 | 4 | no restitutoin; did you mean restitution
{GRID} -> width = 0.3 | 2 | a block requires more than width; give width and height
[simulation] -> [report.fragility]\n[simulation] | 18 | its options are now those of rocking study report
[scales] -> [scale] | 14 | no table [scale]; did you mean scales?
frequency = [0.5, 1.0] ->  | 9 | the pulse one-sine also requires frequency
frequency = [0.5, 1.0] -> frequncy = 2 | 12 | no frequncy; did you mean frequency
amplitude = ["0.3g", "0.5g"] -> amplitude = "0.3h" | 11 | acceleration
factor = [0.5, 1.0] -> refine = 1e-3 | 15 | [scales] has no refine; there are factor, pga, pgv, sa
factor = [0.5, 1.0] -> factor = 1\npga = 2 | 15 | one measure only
factor = [0.5, 1.0] -> sa = 2 | 15 | "sa" requires period
factor = [0.5, 1.0] -> damping = 0.1 | 15 | damping is only allowed with sa
polarity = "both" -> polarity = "up" | 16 | polarity must be
chattering = "certified=1e-9" -> chattering = "slow" | 20 | chattering must be
["el-centro-meloland-270"] -> ["el-centro-melolnd-270"] | 7 | did you mean the shipped record el-centro-meloland-270
["el-centro-meloland-270"] -> [\n"el-centro-meloland-270",\n"nowhere/*.AT2",\n] | 9 | matches this name
["el-centro-meloland-270"] -> "el-centro-meloland-270" | 7 | records must be a list of texts
records = ["el-centro-meloland-270"] -> vertical = "el-centro-meloland-up" | 7 | applies only to records
[motions] -> [motions]\nskip_unreadable = "no" | 7 | must be true or false
[motions] -> [motions]\nvertical = "9" | 8 | no file or shipped record '9' for the vertical motion
[blocks] -> [[blocks]] | 1 | must be one table, [blocks], once
mass = 5000\n ->  | 1 | requires its mass, kg
width = [0.5, 0.6]\nheight = 4.0\nmass = 5000\n -> p = 2\nalpha = 0.1\n | 1 | requires its mass
one_sided = true -> one_sided = 1 | 5 | one_sided must be true or false
[[blocks.thrusts]] -> [[blocks.thrust]] | 10 | no thrust; did you mean thrusts
[[blocks.thrusts]] -> [blocks.thrusts] | 10 | thrusts must be tables, [[blocks.thrusts]]
force = [300, 600] -> forze = 300 | 11 | [[blocks.thrusts]] has no forze; did you mean force
force = [300, 600] -> force = 9e5 | 1 | does not stand
force = [300, 600]\n ->  | 10 | [[blocks.thrusts]] also requires force
moves_with_block = false -> moves_with_block = "no" | 17 | moves_with_block must be a number
offset = -0.1 -> offset = -0.5 | 1 | is beyond the pivot
"""


@pytest.mark.parametrize("mistake", MISTAKES.strip("\n").splitlines())
def test_a_mistake_is_a_sentence_with_its_line(file, mistake):
    change, line, sentence = mistake.replace("{GRID}", GRID).replace("\\n", "\n").rsplit(" | ", 2)
    old, new = change.split(" -> ")
    text = TEXT if old in TEXT else WALLS
    assert old in text
    file.write_text(text.replace(old, f"{new}\n" if old == GRID else new))
    with pytest.raises((rocking.errors.StudyError, rocking.errors.RecordError)) as caught:
        read_study(file)
    assert sentence in str(caught.value) and "\n" not in str(caught.value)
    assert f"{file}, line {line}: " in str(caught.value)
    assert caught.value.line == int(line)


def test_a_file_that_is_no_toml_is_refused(file):
    file.write_text(TEXT.replace("[blocks]", "[blocks"))
    with pytest.raises(rocking.errors.StudyError, match=f"{file}: this is not a valid TOML file"):
        read_study(file)


@pytest.mark.thorough
def test_unreadable_records_are_left_out_only_where_the_file_says_so(file, tmp_path):
    (tmp_path / "broken.AT2").write_text("nothing of use\n")
    records = 'records = ["el-centro-meloland-270", "broken.AT2"]'
    file.write_text(TEXT.replace('records = ["el-centro-meloland-270"]', records))
    with pytest.raises(rocking.errors.RecordError, match=r"broken\.AT2"):
        read_study(file)
    file.write_text(file.read_text().replace(records, records + "\nskip_unreadable = true"))
    found = read_study(file)
    assert found.product.shape[0] == 5
    assert len(found.skipped) == 1


def test_the_commands_go_from_a_file_to_results(run, file, tmp_path):
    folder, table = tmp_path / "kept", tmp_path / "all.csv"
    code, out, err = run("study", "create", file, folder, "--blocks-per-batch", 512)
    assert (code, err) == (0, "")
    assert "0 of 20 batches" in out
    assert run("study", "run", folder)[0] == 0
    assert run("study", "status", folder)[1].startswith(f"{folder}: 20 of 20 batches done")
    assert json.loads(run("study", "status", folder, "--json")[1]) == {
        "folder": str(folder),
        "done_count": 20,
        "batch_count": 20,
        "simulation_count": 200,
    }
    assert "20 of 20 batches done and sound" in run("study", "verify", folder, "--recompute", 2)[1]
    lost = max((folder / "batches").glob("batch.*"))
    batch = lost.read_bytes()
    lost.unlink()
    reported = run("study", "verify", folder)[1]
    assert reported == "19 of 20 batches done and sound\n"
    lost.write_bytes(batch)
    assert run("study", "export", folder, table)[0] == 0
    with table.open() as rows:
        pairs = {(row["record"], row["motion"]) for row in csv.DictReader(rows)}
    assert ("el-centro-meloland-270", "el-centro-meloland-270") in pairs
    assert sorted(record for record, _ in pairs) == ["", "", "", "", "el-centro-meloland-270"]
    product = read_study(file).product
    reference = rocking.simulate_many(
        product.blocks, product.motions, levels=[0.5, 1.0], polarity="both", model="linear", chattering="certified=1e-9"
    )
    np.testing.assert_array_equal(rocking.Study(folder).results().peak_rotation.values, reference.peak_rotation.values)
    batch = folder / "batches" / "batch.0.0.0.0"
    batch.write_bytes(batch.read_bytes()[:-1])
    code, out, err = run("study", "verify", folder)
    assert code == 2
    assert "batch.0.0.0.0 is damaged" in out
    assert err.count("\n") == 1
    code, _, err = run("study", "export", folder, tmp_path / "again.csv")
    assert code == 2
    assert "batch.0.0.0.0 is damaged" in err and "rocking study verify FOLDER --repair computes it again" in err
    assert "verify(" not in out + err
    assert "1 fault repaired" in run("study", "verify", folder, "--repair")[1]
    assert run("study", "verify", folder, "--recompute", "-1")[0] == 2


def test_a_study_names_its_records_as_its_file_does(file, tmp_path):
    (tmp_path / "recs").mkdir()
    values = "\n".join(f"{0.01 * k},{0.1 * (-1) ** k}" for k in range(300))
    for name in ("a", "b"):
        (tmp_path / "recs" / f"{name}.csv").write_text(f"time (s),EW (g)\n{values}\n")
    file.write_text(
        TEXT.replace('records = ["el-centro-meloland-270"]', 'records = ["recs", "el-centro-meloland-270"]')
    )
    found = read_study(file)
    assert found.records == ("recs/a.csv", "recs/b.csv", "el-centro-meloland-270", "", "", "", "")


def test_another_study_in_the_same_folder_is_refused(run, file, tmp_path):
    run("study", "create", file, tmp_path / "kept", "--blocks-per-batch", 512)
    file.write_text(TEXT.replace("factor = [0.5, 1.0]", "factor = [0.5, 1.5]"))
    code, _, err = run("study", "create", file, tmp_path / "kept")
    assert code == 2
    changed = "the folder contains a study of other inputs (scales/values changed), 0 of 20 batches done"
    assert f"{tmp_path / 'kept'}: {changed}" in err
    assert "create this study elsewhere, or remove the other one" in err


def test_a_folder_of_other_things_is_no_place_for_a_study(run, file, tmp_path):
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "a.jpg").touch()
    code, out, err = run("study", "create", file, tmp_path / "photos", "--blocks-per-batch", 512)
    assert (code, out) == (2, "")
    assert f"{tmp_path / 'photos'}: the folder contains no study, but a.jpg: choose a new or empty folder" in err
    assert [path.name for path in (tmp_path / "photos").iterdir()] == ["a.jpg"]
    code, _, err = run("study", "status", file)
    assert code == 2
    assert "a study is stored in a folder, but this is a file" in err


def test_a_file_that_is_there_is_not_overwritten(run, tmp_path):
    assert run("study", "new", tmp_path / "new.toml")[0] == 0
    code, _, err = run("study", "new", tmp_path / "new.toml")
    assert code == 2
    assert "already exists" in err


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["study", "crate", "a"], "there is no command crate; did you mean create?"),
        (["study", "run", "m", "--thread", "2"], "Unknown option: --thread. Did you mean --threads?"),
        (["study", "run", "nowhere"], "nowhere: the folder contains no study"),
        (["study", "export", "nowhere", "all.doc"], "must end with one of .nc, .csv, .parquet; got all.doc"),
    ],
)
def test_mistakes_in_the_commands_are_one_line(run, tmp_path, monkeypatch, arguments, sentence):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1


def pushes(motion):
    """All that a motion does to the ground."""
    return [motion.coefficients, motion.vertical.coefficients]


def test_records_take_a_vertical_component_from_a_record_or_a_channel(file, tmp_path):
    text = TEXT.replace("[motions]", '[motions]\nvertical = "el-centro-meloland-up"')
    file.write_text(text)
    alone, up = (rocking.records.load(f"el-centro-meloland-{name}") for name in ("270", "up"))
    both, *pulses = read_study(file).product.motions
    for one, other in zip(pushes(both), pushes(alone.with_vertical(up)), strict=True):
        np.testing.assert_array_equal(one, other)
    assert not any(pulse.vertical for pulse in pulses)

    two = Path(__file__).parent / "data" / "formats" / "two.v1"
    file.write_text(TEXT.replace('["el-centro-meloland-270"]', f'["{two}"]\nchannel = 1\nvertical = "2"'))
    found = read_study(file).product.motions[0]
    for one, channel in zip(pushes(found), ("1", "2"), strict=True):
        np.testing.assert_array_equal(one, rocking.read(two, channel=channel).coefficients)


def test_units_are_for_those_of_several_records_that_do_not_say_theirs(file, tmp_path):
    """As on the command line: they may not contradict the only record, but several may differ."""
    heading = "PEER\nHere\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 40, DT= .01 SEC\n"
    samples = "\n".join(f"{value:.3f}" for value in np.sin(0.3 * np.arange(40)))
    (tmp_path / "silent.txt").write_text(samples)
    (tmp_path / "says.AT2").write_text(heading + samples)
    several = TEXT.replace('["el-centro-meloland-270"]', '["silent.txt", "says.AT2"]\nunits = "m/s2"\ndt = 0.02')
    file.write_text(several)
    silent, says = read_study(file).product.motions[:2]
    assert (silent.duration, says.duration) == pytest.approx((39 * 0.02, 39 * 0.01))
    assert says.pga == pytest.approx(9.80665 * silent.pga)
    file.write_text(several.replace('"silent.txt", ', ""))
    with pytest.raises(rocking.errors.RecordError, match=r"omit (units|dt)"):
        read_study(file)
    vertical = several.replace('"silent.txt", ', "").replace(
        'units = "m/s2"\ndt = 0.02', 'vertical = "silent.txt"\nunits = "g"\ndt = 0.01'
    )
    file.write_text(vertical)
    assert read_study(file).product.motions[0].vertical.pga == pytest.approx(says.pga)


# Walls and blocks with restraints


@pytest.fixture
def walls(tmp_path):
    path = tmp_path / "walls.toml"
    path.write_text(WALLS)
    return path


def test_a_file_may_describe_walls_and_restraints(walls):
    truth = [
        rocking.RestrainedBlock(
            rocking.Block(width=width, height=4.0, mass=5e3, restitution=0.4),
            rocking.Spring(2e3), rocking.Tendon(1e5, offset=-0.1), rocking.Thrust(force, 3.0),
            rocking.Load(100.0, 4.0, moves_with_block=False), one_sided=True, lean=np.deg2rad(lean), restitution=0.4,
        )
        for width in (0.5, 0.6) for lean in (0.0, 0.5) for force in (300.0, 600.0)
    ]  # fmt: skip
    found, wanted = read_study(walls).product.bodies, truth[0].as_bodies().from_bodies(truth)
    assert len(found) == 8
    for name, (values, _) in wanted.parameters().items():
        np.testing.assert_allclose(found.parameters()[name][0], values, rtol=1e-12, err_msg=name)


def test_the_fragility_of_a_study_of_walls_is_that_of_the_function(walls, run, tmp_path, undrawn):
    walls.write_text(WALLS.replace("ridgecrest-clc-090", "el-centro-meloland-360"))  # A shorter record will do.
    bodies = read_study(walls).product.bodies
    folder = tmp_path / "study"
    assert run("study", "create", str(walls), str(folder))[0] == 0
    assert run("study", "run", str(folder))[0] == 0
    code, _, err = run("study", "report", str(folder), "--together", "--out", str(tmp_path / "report"))
    assert code == 0, err
    motions = [rocking.records.load(name) for name in ("el-centro-meloland-360", "el-centro-meloland-270")]
    truth = rocking.fragility(bodies, motions, levels=[1.0, 2.0, 3.0, 4.0], polarity="both").curves[0]
    study = rocking.Study(folder)
    assert study.fragility().curves[0].median == pytest.approx(truth.median, rel=1e-9)
    assert study.fragility().curves[0].dispersion == pytest.approx(truth.dispersion, rel=1e-9)
    written = json.loads((tmp_path / "report" / "result.json").read_text())["fragility"]["curves"][0]
    assert written["median"] == pytest.approx(truth.median, rel=1e-9)
    assert 0 < written["exceedance_count"] < written["trial_count"] == 8 * 2 * 2 * 4


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ("width,height\n1,2,3,6\n", "line 2: this row has 4 cells for 2 columns"),
        ("width,height,spring\n1,3,2000\n", "line 2: a block with restraints requires its mass"),
        ("p,p,alpha\n2,3,0.2\n", "line 1: two columns contain p"),
        ("width,height,gyration\n1,3,0.5\n", "width and height and gyration are from different descriptions"),
        ("p,alpha,mass\n2,0.2,100\n", "mass and p and alpha are from different descriptions"),
    ],
)
def test_a_table_of_blocks_says_all_of_them_or_is_refused(file, tmp_path, table, sentence):
    (tmp_path / "blocks.csv").write_text(table)
    file.write_text(TEXT.replace(GRID, 'csv = "blocks.csv"\n'))
    with pytest.raises(rocking.errors.StudyError, match=re.escape(sentence)):
        read_study(file)


def test_a_table_may_say_more_than_a_block_needs(file, tmp_path):
    (tmp_path / "blocks.csv").write_text("name,p,alpha,found in\na,2,0.2,1950\nb,3,0.1,1960\n")
    file.write_text(TEXT.replace(GRID, 'csv = "blocks.csv"\n'))
    blocks = read_study(file).product.blocks
    assert blocks.p[:, 0].tolist() == [2.0, 3.0]
    assert {name: values.tolist() for name, values in blocks.labels.items()} == {
        "name": ["a", "b"],
        "found_in": ["1950", "1960"],
    }


def test_a_study_gives_the_notes_of_the_commands(run, file, tmp_path):
    text = TEXT.replace(GRID, "width = 0.6\nheight = 0.5\n").replace("-270", "-up").replace("factor", "pga")
    file.write_text(text)
    code, _, err = run("study", "create", file, tmp_path / "made")
    assert code == 0
    for said in ("looks vertical", "0.5 is taken for 0.5 m/s^2", "are the sizes swapped"):
        assert said in err
    code, _, err = run("study", "create", file, tmp_path / "quiet", "--quiet")
    assert (code, err) == (0, "")


def test_files_are_found_beside_the_studys_own_wherever_it_is_called(file, tmp_path, monkeypatch):
    """Neither the folder of the call, nor a bracket in the name of a folder, makes another study."""
    folder, away = tmp_path / "in [1]", tmp_path / "away"
    for each in (folder, away):
        each.mkdir()
    one, other = (rocking.Motion.from_samples([0.0, size, -size, 0.0], 0.1) for size in (1.0, 2.0))
    for place, motion in ((folder, one), (away, other)):
        lines = [f"{k * 0.1:.1f},{value}" for k, value in enumerate(motion.acceleration([0.0, 0.1, 0.2, 0.3]))]
        (place / "mine.csv").write_text("\n".join(["time (s),acceleration (m/s2)", *lines]) + "\n")
    monkeypatch.chdir(away)
    inside = folder / "study.toml"
    inside.write_text(TEXT.replace('"el-centro-meloland-270"', '"*.csv", "el-centro-meloland-360"'))
    motions = read_study(inside).product.motions
    assert motions[0].pga == 1.0
    assert motions[1].name == "el-centro-meloland-360"
    (folder / "mine.csv").unlink()
    inside.write_text(TEXT.replace("el-centro-meloland-270", "mine.csv"))
    with pytest.raises(rocking.errors.RecordError, match=re.escape(str(folder / "mine.csv"))):
        read_study(inside)


def test_a_file_with_a_byte_order_mark_is_read(file):
    file.write_bytes(b"\xef\xbb\xbf" + TEXT.encode())
    assert read_study(file).product.shape == (5, 2, 2, 10)


def test_results_without_their_description_are_no_new_study(run, file, tmp_path):
    assert run("study", "run", file, tmp_path / "made")[0] == 0
    (tmp_path / "made" / "study.npz").unlink()
    file.write_text(TEXT.replace("1:6:5", "2:9:5"))
    code, _, err = run("study", "create", file, tmp_path / "made")
    assert code == 2
    assert "the folder contains no study, but batches: choose a new" in err


def test_units_of_a_study_that_is_there_are_not_changed_without_a_word(run, file, tmp_path):
    file.write_text(TEXT.replace("1:6:5", "1:6:600"))
    for width, code in (("512", 0), ("512", 0), ("1024", 2)):
        found, _, err = run("study", "create", file, tmp_path / "made", "--blocks-per-batch", width)
        assert found == code
    assert "in batches of 512 blocks: omit --blocks-per-batch" in err


@pytest.mark.thorough
def test_scales_of_changes_and_tables_of_reports_say_what_they_are(run, file, tmp_path, undrawn):
    text = TEXT.replace("1:6:5", "1:6:2").replace("[motions]", '[motions]\nvertical = "el-centro-meloland-up"')
    text = text.replace("factor = [0.5, 1.0]", "pga = [1.0, 3.0, 9.0]")
    file.write_text(text)
    made = tmp_path / "made"
    assert run("study", "run", file, made)[0] == 0
    assert run("study", "export", made, tmp_path / "changes.csv", "--critical", "overturning")[0] == 0
    rows = [*csv.DictReader((tmp_path / "changes.csv").read_text().splitlines())]
    verticals = {row["vertical"] for row in rows if row["motion"].startswith("el-centro")}
    assert verticals == {"el-centro-meloland-up"}
    assert run("study", "report", made)[0] == 0
    assert "pga_m_s2" in (made / "report" / "spectrum.csv").read_text().splitlines()[0].split(",")


@pytest.mark.parametrize("option", [["--workers", "2"], ["--part", "4/3"], ["--part"]])
def test_options_of_a_run_that_are_none_are_one_line(run, file, tmp_path, option):
    code, out, err = run("study", "run", file, tmp_path / "made", *option)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert option[0] in err


def test_parts_of_a_study_are_run_by_commands_of_their_own_and_a_last_one_completes_it(run, file, tmp_path):
    made = tmp_path / "made"
    assert run("study", "create", file, made, "--blocks-per-batch", 512)[0] == 0
    for part, done in (("2/3", 7), ("3/3", 13)):
        assert f"{made}: {done} of 20 batches done" in run("study", "run", made, "--part", part)[1]
    assert "20 of 20 batches done" in run("study", "run", made)[1]
    assert run("study", "run", made, "--part", "1/3")[1].startswith("0 batches, 0 simulations in ")
