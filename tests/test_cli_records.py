"""The command line and records: many at once, targets to scale to, units, names that are close, what looks wrong."""

import io
import json
import re
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import rocking
from rocking.cli import main
from rocking.core.progress import note, notes_for
from rocking.inputs.notes import list_motion_notes
from rocking.motion.scaling import Measure
from rocking.records.named import expand_record_names

RECORD = "el-centro-meloland-270"
OTHER = "ridgecrest-clc-090"
BLOCK = ["--width", "0.24", "--height", "1.1"]
GRAVITY = 9.80665


@pytest.fixture
def folder(tmp_path):
    """A folder of three small records and a hidden file."""
    place = tmp_path / "records"
    place.mkdir()
    for k in range(3):
        samples = 0.4 * (1.0 + k) * np.sin(np.linspace(0.0, 12.0, 120))
        lines = "".join(f"{value:.5f}\n" for value in samples)
        title = "Event, 1/1/2000, Station, 90"
        text = f"PEER\n{title}\nACCELERATION IN UNITS OF G\nNPTS= 120, DT= .02 SEC,\n{lines}"
        (place / f"r{k}.AT2").write_text(text)
    (place / ".hidden").write_text("nothing")
    return place


@pytest.mark.cases(fast=6)
@pytest.mark.parametrize("command", ["simulate", "spectrum", "fragility"])
@pytest.mark.parametrize(
    ("option", "value", "target"),
    [
        ("--pga", "0.5g", (0.5 * GRAVITY, Measure("pga"))),
        ("--pga", "490gal", (4.9, Measure("pga"))),
        ("--pga", "4.9", (4.9, Measure("pga"))),
        ("--pgv", "0.4", (0.4, Measure("pgv"))),
        ("--sa", "0.4g@1.0", (0.4 * GRAVITY, Measure("sa", 1.0))),
        ("--scale", "-2", (-2.0, Measure("factor"))),
    ],
)
def test_records_are_scaled_to_a_target_by_every_command(monkeypatch, run, command, option, value, target):
    seen = []

    def scaled_to(motion, *asked):
        seen.append(asked)
        raise SystemExit  # what a command does with a motion is not looked at here

    monkeypatch.setattr(rocking.Motion, "scaled_to", scaled_to)
    options = {"spectrum": ["--alpha", "0.2", "--p", "2"]}.get(command, BLOCK)
    run(command, RECORD, *options, option, value)
    assert (pytest.approx(seen[0][0]), seen[0][1]) == target


def test_sizes_speeds_and_steps_of_the_command_line_have_units(run):
    plain = run("simulate", "el-centro-meloland-270", "--width", "0.24", "--height", "1", "--pgv", "0.4")
    assert (
        run("simulate", "el-centro-meloland-270", "--width", "24cm", "--height", "1000mm", "--pgv", "40cm/s") == plain
    )
    assert plain[0] == 0


def test_files_folders_patterns_and_shipped_names_make_one_table(run, folder):
    code, out, err = run("simulate", RECORD, folder, str(folder / "r*.AT2"), *BLOCK)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert "4 records" in lines[0]
    assert [line.split()[0] for line in lines[3:]] == [RECORD, *(str(folder / f"r{k}.AT2") for k in range(3))]


def test_the_table_is_what_simulate_finds(run, folder):
    _, out, _ = run("simulate", RECORD, OTHER, *BLOCK, "--json")
    rows = {row["record"]: row for row in json.loads(out)["records"]}
    block = rocking.Block(width=0.24, height=1.1)
    response = rocking.simulate(block, rocking.records.load(OTHER))
    assert rows[OTHER]["peak_over_slenderness"] == response.peak_over_slenderness
    assert rows[OTHER]["rests"] == int((response.events["kind"] == "rest").sum())
    assert rows[RECORD]["verdict"].startswith("overturns at") == rows[RECORD]["overturned"]


@pytest.mark.thorough
def test_the_table_is_written_and_each_record_only_on_request(run, undrawn, folder, tmp_path):
    (folder / "r0.AT2").unlink()
    out = tmp_path / "out"
    assert run("simulate", folder, *BLOCK, "--out", out)[0] == 0
    assert {"summary.csv", "summary.json"} <= {path.name for path in out.iterdir()}
    assert not any(path.is_dir() for path in out.iterdir())
    assert len((out / "summary.csv").read_text("utf-8").splitlines()) == 3
    assert run("simulate", folder, *BLOCK, "--out", out, "--each")[0] == 0
    assert {path.name for path in out.iterdir() if path.is_dir()} == {"r1", "r2"}
    assert (out / "r1" / "response.csv").is_file()
    assert "--out" in run("simulate", folder, *BLOCK, "--each")[2]


@pytest.mark.thorough
def test_the_table_is_a_workbook_where_openpyxl_is_installed(run, folder, tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    assert run("simulate", folder, *BLOCK, "--out", tmp_path)[0] == 0
    sheet = openpyxl.load_workbook(tmp_path / "summary.xlsx").active
    assert sheet.max_row == 4
    assert sheet["A1"].value == "record"
    assert (sheet.title, sheet.freeze_panes) == ("records", "A2")


def test_without_openpyxl_a_note_says_why_there_is_no_workbook(run, folder, tmp_path, monkeypatch):
    loaded = [name for name in sys.modules if name.partition(".")[0] in ("openpyxl", "xlsxwriter")]
    for name in {*loaded, "openpyxl", "xlsxwriter"}:
        monkeypatch.setitem(sys.modules, name, None)
    code, _, err = run("simulate", folder, *BLOCK, "--out", tmp_path)
    assert code == 0
    assert (
        "note: summary.xlsx left out: an Excel workbook requires openpyxl: run pip install '.[excel]' in the source"
        in err
    )
    assert not (tmp_path / "summary.xlsx").exists()


def test_an_unreadable_record_is_an_error_unless_one_keeps_going(run, folder):
    (folder / "readme.txt").write_text("These are records.\n")
    code, _, err = run("simulate", folder, *BLOCK)
    assert code == 2
    assert "readme.txt" in err
    code, out, err = run("simulate", folder, *BLOCK, "--keep-going")
    assert code == 0
    assert "3 records" in out
    assert err.startswith("rocking: note: skipped: ")
    assert "readme.txt" in err
    code, _, err = run("simulate", folder / "readme.txt", *BLOCK, "--keep-going")
    assert code == 2
    assert "none of 1 records" in err


def test_a_record_without_motion_cannot_be_scaled_and_is_skipped_as_well(run, folder):
    zero = folder / "zero.txt"
    zero.write_text("0\n0\n0\n")
    arguments = ["simulate", zero, folder / "r1.AT2", *BLOCK, "--dt", "0.02", "--units", "g", "--pga", "0.3g"]
    assert run(*arguments)[0] == 2
    code, out, err = run(*arguments, "--keep-going")
    assert code == 0
    assert "1 record," in out
    assert "zero throughout" in err


def test_a_pulse_has_the_vertical_component_that_is_given(run):
    given = ["simulate", "--pulse", "one-sine:amplitude=0.3g,frequency=3Hz", *BLOCK, "--json"]
    code, out, _ = run(*given, "--vertical", "el-centro-meloland-up")
    motion = rocking.pulses.one_sine(0.3 * GRAVITY, 3.0).with_vertical(rocking.records.load("el-centro-meloland-up"))
    found, response = json.loads(out), rocking.simulate(rocking.Block(width=0.24, height=1.1), motion)
    assert code == 0 and found["impacts_resolved"] == len(response.impacts) > 0
    assert found["peak_rotation_rad"] == response.peak_rotation != json.loads(run(*given)[1])["peak_rotation_rad"]


def test_each_record_counts_once(folder):
    assert len(expand_record_names([str(folder), str(folder / "*.AT2")])) == 3
    with pytest.raises(rocking.errors.RecordError, match="matches"):
        expand_record_names([str(folder / "*.xyz")])


@pytest.mark.thorough
def test_a_record_is_read_from_standard_input(run, folder, monkeypatch):
    content = (folder / "r1.AT2").read_bytes()
    expected = json.loads(run("simulate", folder / "r1.AT2", *BLOCK, "--json")[1])
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))
    found = json.loads(run("simulate", "-", *BLOCK, "--json")[1])
    assert found["peak_rotation_rad"] == expected["peak_rotation_rad"]
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))
    assert run("records", "-")[1].startswith("standard input: PEER AT2")


def test_errors_name_options(run, tmp_path):
    column = tmp_path / "column.txt"
    column.write_text("0.0\n0.1\n0.0\n")
    assert "give --dt in seconds" in run("simulate", column, *BLOCK)[2]
    assert "give --units as one of" in run("simulate", column, *BLOCK, "--dt", "0.01")[2]
    assert "--half-width" in run("simulate", RECORD, "--half-width", "-1", "--half-height", "1")[2]
    assert "half_width" not in run("simulate", RECORD, "--half-width", "-1", "--half-height", "1")[2]
    assert "--initial-velocity" in run("simulate", RECORD, *BLOCK, "--initial-velocity", "1e9")[2]


def write_component(folder: Path, component: str, station: str = "Station") -> Path:
    """Write a record of a component, as the PEER database titles it."""
    samples = 0.4 * np.sin(np.linspace(0.0, 12.0, 120))
    title = f"PEER\nEvent, 1/1/2000, {station}, {component}\nACCELERATION IN UNITS OF G\nNPTS= 120, DT= .02 SEC,\n"
    folder.mkdir(exist_ok=True)
    path = folder / f"{station}-{component}.AT2"
    path.write_text(title + "".join(f"{value:.5f}\n" for value in samples))
    return path


#: Options of each command that reads folders of records.
FOLDER_COMMANDS = {
    "simulate": BLOCK, "check": BLOCK, "ida": BLOCK, "measures": BLOCK, "fragility": [*BLOCK, "--levels", "0.1g:1g:4"],
    "spectrum": ["--alpha", "0.2", "--p", "2,3"],
}  # fmt: skip


@pytest.mark.parametrize("kind", ["folder", "archive", "pattern"])
@pytest.mark.parametrize("command", FOLDER_COMMANDS)
def test_a_vertical_record_of_a_folder_is_no_horizontal_motion(run, tmp_path, command, kind):
    path = write_component(tmp_path / "records", "UP")
    name = {"folder": path.parent, "archive": tmp_path / "records.zip", "pattern": path.parent / "*.AT2"}[kind]
    with zipfile.ZipFile(tmp_path / "records.zip", "w") as archive:
        archive.write(path, path.name)
    code, out, err = run(command, name, *FOLDER_COMMANDS[command])
    assert (code, out) == (2, "")
    assert f"{path.name}: this record is vertical (channel 'UP'); add a horizontal record of its station" in err
    assert err.count("\n") == 1 and "--vertical" in err


def test_a_vertical_record_is_skipped_beside_horizontal_ones_and_used_where_it_is_named(run, tmp_path):
    folder = tmp_path / "records"
    up = write_component(folder, "UP")
    level = write_component(folder, "090")
    code, out, err = run("simulate", folder, *BLOCK, "--json")
    assert code == 0 and f"skipped: {up}: this record is vertical (channel 'UP')" in err
    found = json.loads(out)
    assert [row["record"] for row in found["records"]] == [str(level)] and [*found["skipped"]] == [str(up)]
    code, _, err = run("simulate", up, *BLOCK)
    assert code == 0 and "looks vertical" in err
    code, _, err = run("simulate", folder, *BLOCK, "--channel", "UP")
    assert code == 0 and "looks vertical" in err
    write_component(folder, "UP", "Other")
    code, _, err = run("simulate", folder, *BLOCK)
    assert code == 2 and "Other-UP.AT2: this record is vertical" in err
    code, out, err = run("simulate", folder, *BLOCK, "--keep-going")
    assert code == 0 and err.count("skipped: ") == 2


def test_a_study_refuses_a_folder_of_only_vertical_records(tmp_path):
    write_component(tmp_path / "records", "UP")
    file, text = tmp_path / "study.toml", "[blocks]\nwidth = 0.5\nheight = 2.0\n[scales]\npga = [1.0]\n[motions]\n"
    file.write_text(text + 'records = ["records"]\n')
    with pytest.raises(rocking.errors.RecordError, match=r"Station-UP.AT2.* is vertical \(channel 'UP'\)"):
        rocking.studies.read_study(file)
    file.write_text(text + 'records = ["records/Station-UP.AT2"]\n')
    assert len(rocking.studies.read_study(file).product.motions) == 1


def test_a_path_is_not_taken_for_an_option(run, tmp_path):
    path = tmp_path / "half_width" / "units=g.txt"
    assert str(path) in run("simulate", path, *BLOCK)[2]


@pytest.mark.parametrize("option", ["-V", "--version"])
def test_the_version_is_shown(run, option):
    assert run(option)[1].strip() == rocking.__version__


def test_a_failed_command_leaves_no_folder_that_it_made(run, tmp_path):
    assert run("simulate", "nowhere.AT2", *BLOCK, "--out", tmp_path / "new" / "results")[0] == 2
    assert not (tmp_path / "new").exists()
    (tmp_path / "old").mkdir()
    assert run("simulate", "nowhere.AT2", *BLOCK, "--out", tmp_path / "old")[0] == 2
    assert (tmp_path / "old").exists()


def test_what_the_locale_cannot_encode_is_shown_as_question_marks(monkeypatch):
    stderr = io.TextIOWrapper(io.BytesIO(), "ascii", write_through=True)
    monkeypatch.setattr(sys, "stderr", stderr)
    with pytest.raises(SystemExit):
        main(["records", "Łódź.txt"])
    assert b"rocking: ??d?.txt" in stderr.buffer.getvalue()


@pytest.mark.parametrize(("unit", "sentence"), [("m/s2", "moves no block"), ("g", "are the units right")])
def test_a_peak_of_another_order_is_noted(run, tmp_path, unit, sentence):
    record = tmp_path / "record.txt"
    record.write_text("0\n0.005\n-0.002\n" if unit == "m/s2" else "0\n300\n-200\n")
    assert sentence in run("simulate", record, *BLOCK, "--units", unit, "--dt", "0.01")[2]


def test_units_in_a_heading_are_taken_and_a_contradiction_is_noted(run, tmp_path):
    record = tmp_path / "record.txt"
    record.write_text("time (s), a (cm/s2)\n0.00,0.0\n0.01,120.5\n0.02,0.0\n")
    assert run("simulate", record, *BLOCK)[::2] == (0, "")
    assert run("simulate", record, *BLOCK, "--units", "cm/s2")[2] == ""
    for command in (["simulate", record, *BLOCK], ["records", record]):
        assert "heading says cm/s2, but the numbers are taken for g" in run(*command, "--units", "g")[2]


def test_units_and_step_apply_to_those_of_several_files_that_do_not_say_theirs(run, folder):
    (folder / "plain.txt").write_text("0\n1.5\n-0.5\n0\n")
    (folder / "headed.csv").write_text("time (s),a (cm/s2)\n0,0\n0.02,120\n0.04,0\n")
    code, out, err = run("records", folder, "--units", "m/s2", "--dt", 0.02, "--json")
    assert (code, err) == (0, "")
    held = {Path(each["file"]).name: each["channels"][0] for each in json.loads(out)["files"]}
    assert {name: each["units"] for name, each in held.items()} == {
        "headed.csv": "cm/s2", "plain.txt": "m/s2", **{f"r{k}.AT2": "G" for k in range(3)}
    }  # fmt: skip
    assert held["headed.csv"]["pga_g"] == pytest.approx(1.2 / GRAVITY)
    assert run("simulate", folder, *BLOCK, "--units", "m/s2", "--dt", 0.02)[0] == 0
    # Of one file alone a contradiction is refused.
    code, _, err = run("simulate", folder / "r0.AT2", *BLOCK, "--units", "m/s2")
    assert code == 2 and "the units in the file are g" in err


def test_a_channel_is_for_those_of_several_files_that_hold_several(run, folder):
    two = Path(__file__).parent / "data" / "formats" / "two.v1"
    (folder / "two.v1").write_bytes(two.read_bytes())
    code, out, _ = run("simulate", folder, *BLOCK, "--channel", "90 Deg", "--json")
    assert code == 0
    assert len(json.loads(out)["records"]) == 4
    code, out, _ = run("records", folder, "--channel", "90 Deg", "--json")
    held = {Path(each["file"]).name: [one["name"] for one in each["channels"]] for each in json.loads(out)["files"]}
    assert held == {"two.v1": ["90 Deg"], **{f"r{k}.AT2": ["90"] for k in range(3)}}
    # Each file that holds several must have it, and so must a file alone.
    assert "no channel 'NS'; give one of 1 '90 Deg', 2 'Up'" in run("simulate", folder, *BLOCK, "--channel", "NS")[2]
    assert "no channel 'NS'" in run("simulate", folder / "r0.AT2", *BLOCK, "--channel", "NS")[2]


def test_a_folder_is_listed_although_some_files_cannot_be_read(run, folder):
    (folder / "notes.txt").write_text("These are records.\n")
    code, out, err = run("records", folder)
    assert code == 2
    assert err == f"rocking: 1 of 4 files cannot be read: {folder / 'notes.txt'}\n"
    assert out.count("PEER AT2") == 3 and f"{folder / 'notes.txt'}: the format of this text is unknown" in out
    code, out, _ = run("records", folder, "--json")
    assert code == 2
    files = json.loads(out)["files"]
    assert [("error" in each, Path(each["file"]).name) for each in files][-1] == (True, "notes.txt")
    assert len(files) == 4
    code, out, err = run("records", folder / "notes.txt")
    assert (code, out) == (2, "") and "the format of this text is unknown" in err


def test_a_hyphen_is_a_polarity(run):
    records = [RECORD, OTHER, "el-centro-meloland-360", "--levels", "0.1g:1.2g:12", *BLOCK, "--json"]
    apart, joined = (run("fragility", *records, *polarity) for polarity in (["--polarity", "-"], ["--polarity=-"]))
    assert apart == joined
    assert apart[0] == 0


NOTES = """
el-centro-meloland-up {B} | looks vertical
{R} --width 2 --height 1 --restitution 0.5 | sizes swapped
{R} --p 2.9858,3.0053 --alpha 0.155,0.27417 | are the sides of p swapped
{R} --width 20 --height 100 | in metres
{R} {B} --pga 0.4 | --pga 0.4 is taken for 0.4 m/s^2, 0.0408 g; write 0.4g for 0.4 g
{R} {B} --pga 400 | the peak acceleration is 40.8 g
{R} {B} --sa 0.3@1 | --sa 0.3 is taken for 0.3 m/s^2
{R} {B} --sa 0.3g@1000 | the peak acceleration is 8.35e+03 g
{R} {B} --pgv 40 | more than any ground motion has
{R} {B} --scale 0 | the acceleration is zero throughout
"""


@pytest.mark.parametrize("noted", NOTES.strip().splitlines())
def test_what_looks_like_a_mistake_is_noted_and_computed(run, noted):
    typed, _, sentence = noted.replace("{R}", RECORD).replace("{B}", " ".join(BLOCK)).partition(" | ")
    code, out, err = run("simulate", *typed.split())
    assert code == 0 and "outcome" in out
    assert err.startswith("rocking: note: ") and sentence in err and err.count("note") == err.count("\n") == 1
    assert run("simulate", *typed.split(), "--quiet")[2] == ""


def test_a_sensible_scaling_is_not_noted(run):
    for scaling in (["--pga", "0.4g"], ["--pga", "4"], ["--pgv", "0.5"], ["--sa", "0.4g@1"], ["--scale", "-1"]):
        assert run("simulate", RECORD, *BLOCK, *scaling)[::2] == (0, "")


@pytest.mark.parametrize("heading", ["t,a_ms2\n", ""])
def test_a_step_that_no_record_has_is_noted(run, tmp_path, heading):
    record = tmp_path / "record.csv"
    record.write_text(heading + "0,0\n10,1.2\n20,-0.5\n30,0\n")
    err = run("simulate", record, *BLOCK, *([] if heading else ["--units", "m/s2"]))[2]
    assert "the sampling step is 10 s, too coarse for a record: are the times in seconds?" in err
    assert "the peak velocity is 10.2 m/s, too much" in err


def test_no_shipped_record_looks_like_a_mistake():
    noted = {name: list_motion_notes(rocking.records.load(name)) for name in rocking.records.names()}
    assert [name for name, notes in noted.items() if notes] == [name for name in noted if name.endswith("-up")]
    assert len(noted) >= 9


def test_a_pattern_finds_shipped_records_where_no_file_matches(run, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert expand_record_names(["ridgecrest-*-090"]) == ["ridgecrest-clc-090", "ridgecrest-tow2-090"]
    assert "2 records" in run("simulate", "ridgecrest-*-090", *BLOCK)[1]
    assert run("records", "ridgecrest-*-090")[1].count("ridgecrest-") == 2
    (tmp_path / "ridgecrest-mine-090").write_text("0\n1\n")
    assert expand_record_names(["ridgecrest-*-090"]) == ["ridgecrest-mine-090"]
    assert "no file or shipped record matches" in run("simulate", "parkfield-*", *BLOCK)[2]


def test_a_fit_used_beyond_its_range_is_one_line(run, monkeypatch):
    import warnings

    from rocking.cli import analysis as module
    from rocking.errors import OutsideFitWarning

    def report(*_):
        warnings.warn("beyond the fit", OutsideFitWarning, stacklevel=1)
        raise rocking.errors.OptionError("enough")

    monkeypatch.setattr(module, "critical_report", report)
    assert run("critical", 2, 0.9)[2].splitlines() == ["rocking: note: beyond the fit", "rocking: enough"]
    assert run("critical", 2, 0.9, "--quiet")[2].splitlines() == ["rocking: enough"]


def test_notes_go_to_those_who_want_them(capsys):
    note("a terminal is not watching")
    with notes_for("everybody"):
        note("two\n lines")
    with notes_for("nobody"):
        note("silence")
    assert capsys.readouterr().err == "rocking: note: two lines\n"


@pytest.mark.thorough
def test_a_coefficient_of_friction_is_put_to_the_test(run):
    out = run("simulate", "ridgecrest-clc-090", "--width", 0.24, "--height", 1.1, "--available-friction", 0.24)[1]
    assert re.search(r"friction 0.24 +is not enough: the block slides, first at 23\d\.\d{4} s", out)
    out = run("simulate", "ridgecrest-clc-090", "--width", 0.24, "--height", 1.1, "--available-friction", 0.3)[1]
    assert re.search(r"friction 0.3 +is enough: the block does not slide", out)
    both = "ridgecrest-clc-090", "el-centro-meloland-270"
    out = run("simulate", *both, "--width", 0.24, "--height", 1.1, "--available-friction", 0.24, "--json")[1]
    times = [row["sliding_time_s"] for row in json.loads(out)["records"]]
    assert 230.0 < times[0] < 240.0
    assert run("simulate", both[0], "--width", 0.24, "--height", 1.1, "--available-friction", -1)[0] == 2


def test_a_floor_moves_as_its_building(run):
    out = run("simulate", RECORD, *BLOCK, "--floor", "period=0.4,damping=0.05", "--pga", "0.5g", "--json")[1]
    floor = rocking.records.load(RECORD).on_floor(0.4, 0.05)
    response = rocking.simulate(rocking.Block(width=0.24, height=1.1), floor.scaled_to(0.5 * GRAVITY, Measure("pga")))
    assert json.loads(out)["peak_rotation_rad"] == response.peak_rotation
    for text, sentence in (
        ("perod=1", "--floor has no perod; did you mean period?"),
        ("period=0", "--floor: period must be a positive number, in s, not 0"),
        ("0.4,0.05", "--floor must be NAME=VALUE pairs separated by commas, with distinct names; got '0.4,0.05'"),
    ):
        assert run("simulate", RECORD, *BLOCK, "--floor", text)[2].splitlines()[-1] == f"rocking: {sentence}"
