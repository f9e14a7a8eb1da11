"""One sentence for every mistake: it names what was typed, in the options' own words, and the slip that is likely."""

import json

import numpy as np
import pandas as pd
import pytest

import rocking
from rocking import Block, Blocks, Motion, quantities
from rocking.errors import RockingError

RECORD = "el-centro-meloland-270"
SIZES = ["--width", "0.24", "--height", "1.1"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (f"simulate {RECORD} --width -0.24 --height 1", "--width must be a positive number, in m, not -0.24"),
        (f"simulate {RECORD} --p 0 --alpha 0.2", "--p must be a positive number, in rad/s, not 0"),
        (f"spectrum {RECORD} --p 1", "rocking spectrum needs --alpha; see rocking spectrum --help"),
        ("paper", "rocking paper needs --out; see rocking paper --help"),
        ("chatter 1.5 2", "rocking chatter needs ETA; see rocking chatter --help"),
        (f"simulate {RECORD} --p 2 --alpha 0.2 --pga", "--pga needs a value; see rocking simulate --help"),
        (
            f"simulate {RECORD} --p 2 --alpha 0.2 --pga -0.4g",
            "--pga must be above 0, not -0.4g; --scale -1 reverses a motion",
        ),
        (f"simulate {RECORD} --p 2 --alpha 0.2 --pgv -0.4", "--pgv must be a positive number, in m/s, not -0.4"),
        ("map half-sine --cycles 3 --alpha 0.2", "the pulse half-sine has no cycles; it takes amplitude and frequency"),
        ("map sine --alpha 0.2", "the pulse sine needs cycles as well"),
        ("map sine", "a block is needed: give --width and --height, or --half-width and --half-height, or --alpha"),
        (
            f"spectrum {RECORD} --alpha 0.2 --p 1 --size 1",
            "give not both of --p (rad/s) and --size (half diagonals, m)",
        ),
        (f"simulate {RECORD} --width 1", "a block needs more than --width: give --width and --height"),
        (
            f"simulate {RECORD} --width 1 --half-width 1",
            "--width and --half-width belong to different descriptions of a block; give one: --width and --height, or "
            "--half-width and --half-height",
        ),
        (
            "map one-sine --width 1 --alpha 0.2",
            "--width and --alpha belong to different descriptions of a block; give one: --width and --height, or "
            "--alpha",
        ),
    ],
)
def test_a_mistake_is_told_in_the_words_of_the_command_line(run, tmp_path, monkeypatch, arguments, sentence):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(*arguments.split())
    assert (code, out, err) == (2, "", f"rocking: {sentence}\n")


@pytest.mark.parametrize(
    "arguments",
    [
        ["simulate", RECORD, "--p", "2", "--alpha", "12"],
        ["spectrum", RECORD, "--p", "2", "--alpha", "12"],
        ["spectrum", RECORD, "--p", "2", "--alpha", "12:20:3"],
        ["map", "one-sine", "--alpha", "12"],
        ["simulate", RECORD, *SIZES, "--initial-rotation", "12"],
    ],
)
def test_degrees_without_their_unit_are_suspected(run, arguments):
    code, _, err = run(*arguments)
    assert code == 2
    assert "is taken for rad, and pi/2 is the limit; did you mean 12deg?" in err


def test_angles_that_may_be_radians_are_taken_for_them(run):
    assert quantities.tilt("1.5", "--alpha") == 1.5
    assert quantities.tilt("12deg", "--alpha") == pytest.approx(np.radians(12.0))
    # A phase may be any number of radians.
    assert (
        run("map", "sine", "--cycles", 1, "--phase", 3, "--alpha", 0.2, "--amplitudes", "1,2", "--frequencies", 5)[0]
        == 0
    )


@pytest.mark.parametrize(
    "call",
    [
        lambda: Block.from_parameters(2.0, 12.0, 0.9),
        lambda: Blocks(p=2.0, alpha=[0.2, 12.0], restitution=0.9),
        lambda: rocking.simulate(Block(0.2, 1.0), None, initial_rotation=12.0),
        lambda: rocking.rocking_spectrum(rocking.pulses.one_sine(1.0, 1.0), alpha=12.0, p=1.0, restitution=0.9),
        lambda: rocking.calibrate([rocking.pulses.one_sine(1.0, 1.0)] * 2, [True, False], alpha=(0.1, 12.0)),
    ],
)
def test_degrees_are_suspected_in_python(call):
    with pytest.raises(RockingError, match=r"if it is in degrees, give math\.radians\(12\)"):
        call()


def test_an_angle_beyond_all_degrees_is_refused_without_a_hint():
    with pytest.raises(RockingError) as caught:
        Block.from_parameters(2.0, 120.0, 0.9)
    assert "degrees" not in str(caught.value)


@pytest.mark.parametrize(
    "sizes", [["--width", "1.1", "--height", "0.24"], ["--half-width", "1", "--half-height", "0.25"]]
)
def test_swapped_sizes_are_suspected(run, sizes):
    code, _, err = run("simulate", RECORD, *sizes)
    assert code == 2
    assert "swap its sizes" in err and "if that is a slip" in err and "--restitution" in err


def test_a_rotation_may_be_negative(run):
    code, out, _ = run("simulate", RECORD, *SIZES, "--initial-rotation", "-2deg", "--json")
    assert code == 0
    mirrored = rocking.simulate(
        Block(width=0.24, height=1.1), rocking.records.load(RECORD), initial_rotation=-np.radians(2.0)
    )
    assert json.loads(out)["peak_rotation_rad"] == mirrored.peak_rotation


def test_notes_name_options_too(run, tmp_path):
    (tmp_path / "a.txt").write_text("0 1\n1 2\n")
    (tmp_path / "b.csv").write_text("t,a (g)\n0,0\n0.01,0.1\n")
    err = run("simulate", tmp_path, *SIZES, "--keep-going")[2]
    assert "skipped: " in err and "give --units as one of g, m/s2" in err and "units=" not in err


def test_a_file_that_is_replaced_is_named(run, tmp_path):
    arguments = ["chatter", 1.03, 2, 0.92, "--out", tmp_path / "out"]
    assert run(*arguments)[2] == ""
    (tmp_path / "out" / "mine.txt").write_text("left alone")
    files = "chatter.pdf, chatter.png, cycles.csv, impacts.csv, result.json"
    assert run(*arguments)[2] == f"rocking: note: replaced in {tmp_path / 'out'}: {files}\n"


@pytest.fixture
def history(tmp_path):
    """A measured history, as a table that may be written with decimal commas."""
    response = rocking.simulate(Block.from_parameters(2.5, 0.2, 0.9), None, initial_rotation=0.1)
    times = np.arange(0.0, 2.0, 0.02)

    def write(delimiter=",", comma="."):
        rows = zip(times, np.degrees(response.rotation(times)), strict=True)
        lines = [delimiter.join(f"{value:.9f}".replace(".", comma) for value in row) for row in rows]
        table = tmp_path / "history.csv"
        table.write_text("\n".join([delimiter.join(["time_s", "rotation_deg"]), *lines]))
        return table

    return write


def test_a_calibration_takes_semicolons_and_gives_units(run, history):
    code, plain, err = run("calibrate", history())
    assert (code, err) == (0, "")
    assert "rad/s" in plain and "unit" in plain.splitlines()[0]
    assert run("calibrate", history(";", ","))[1] == plain
    assert run("calibrate", history(";", "."))[1] == plain


def test_a_calibration_tells_all_columns_and_answers_that_it_takes(run, tmp_path):
    table = tmp_path / "table.csv"
    table.write_text("a,b\n1,2\n")
    assert "time_s,rotation_rad or time_s,rotation_deg" in run("calibrate", table)[2]
    table.write_text(f"motion,overturned\n{RECORD},maybe\n")
    assert "line 2: 'maybe' is not 0 or 1, no or yes, false or true" in run("calibrate", table)[2]


def test_the_height_of_a_centre_of_mass_is_called_so():
    block = Block.from_pivots((0.1, 0.2), 0.6, 0.3)
    assert block.description == "body on pivots 0.1 m and 0.2 m from its centre of mass, which is 0.6 m high"


def test_a_motion_that_was_scaled_is_told_from_the_record(run):
    record = rocking.records.load(RECORD)
    scaled = record.scaled(2.0)
    assert (record.label, scaled.label) == (RECORD, f"{RECORD}, scaled by 2")
    assert (scaled.name, record.scaled(pga=4.9).label) == (RECORD, f"{RECORD}, scaled by {4.9 / record.pga:.6g}")
    response = rocking.simulate(Block(width=0.24, height=1.1), scaled)
    assert scaled.label in repr(response)
    assert f"under {scaled.label}" in response.plot().get_suptitle().replace("\n", " ")
    spectrum = rocking.rocking_spectrum(scaled, alpha=0.2, p=[1.0, 2.0], restitution=0.9)
    assert scaled.label in spectrum.summary().splitlines()[0]
    assert scaled.label in spectrum.plot().get_suptitle().replace("\n", " ")
    assert list(spectrum.motion.values) == [RECORD]
    two = rocking.rocking_spectrum([scaled, record], alpha=0.2, p=[1.0, 2.0], restitution=0.9).summary()
    assert "2 motions, 1 of them scaled or processed" in two
    out = run("simulate", RECORD, "el-centro-meloland-360", *SIZES, "--pga", "0.4g")[1]
    assert out.count("to a peak ground acceleration of 3.92266 m/s^2 (0.4 g)") == 2
    assert "scaled by 2" in run("simulate", RECORD, *SIZES, "--scale", 2)[1]


def test_a_motion_times_a_number_is_scaled():
    motion = Motion.from_samples([0.0, 1.0, -2.0, 0.0], 0.02)
    for doubled in (2 * motion, motion * 2.0, motion * np.float32(2.0)):
        np.testing.assert_array_equal(doubled.coefficients, motion.scaled(2.0).coefficients)
        assert doubled.history == ("scaled by 2",)
    with pytest.raises(TypeError):
        motion * "2"


def test_python_is_told_what_is_meant(tmp_path):
    response = rocking.simulate(Block(0.12, 0.55), rocking.pulses.one_sine(3.0, 1.0))
    with pytest.raises(RockingError, match=rf"it is a shipped record: load it with rocking.records.load\('{RECORD}'\)"):
        rocking.read(RECORD)
    with pytest.raises(RockingError, match=r"Motion\.from_samples\(acceleration, dt\)"):
        Motion([1.0, 2.0, 3.0], 0.01)
    with pytest.raises(RockingError, match="dt = 1e-09 s makes more than 50,000,000 points"):
        response.to_dataframe(dt=1e-9)
    with pytest.raises(RockingError, match="ax must be axes of Matplotlib's to draw in, not 'x'"):
        response.plot(ax="x")
    for written in (response, rocking.rocking_spectrum(response.motion, alpha=0.2, p=1.0, restitution=0.9)):
        with pytest.raises(RockingError, match=r"there is no folder .*nowhere; make it"):
            written.to_netcdf(tmp_path / "nowhere" / "x.nc")


def test_the_peak_of_a_block_that_overturns_is_one_number_everywhere(run, tmp_path):
    single = json.loads(run("simulate", RECORD, *SIZES, "--json")[1])
    folder = tmp_path / "out"
    code, out, _ = run("simulate", RECORD, "el-centro-meloland-up", *SIZES, "--out", folder)
    assert code == 0 and single["overturned"]
    table = pd.read_csv(folder / "summary.csv")
    rows = json.loads((folder / "summary.json").read_text())["records"]
    ratio = 0.5 * np.pi / Block(width=0.24, height=1.1).alpha
    for found in (single["peak_over_slenderness"], table["peak_over_slenderness"][0], rows[0]["peak_over_slenderness"]):
        assert found == pytest.approx(ratio, rel=1e-12)
    assert f"{ratio:.4g}" in out and "inf" not in out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            f"simulate {RECORD} --width 24cm --height 1",
            "--width takes a number, not '24cm'; see rocking simulate --help",
        ),
        ("chatter one 2 0.9", "A takes a number, not 'one'; see rocking chatter --help"),
        ("explore --port http", "--port takes a whole number, not 'http'; see rocking explore --help"),
        (
            f"simulate {RECORD} --width 0.24 --height 1 --chattering certified=0",
            '--chattering "certified=0": tolerance must be a positive number, in s, not 0',
        ),
        (
            f"simulate {RECORD} --width 0.24 --height 1 --initial-rotation 95deg",
            "--initial-rotation must be below 90deg in size, not 95deg",
        ),
        (
            f"simulate {RECORD} --width 0.24 --height 1 --channel 7",
            f"{RECORD}: a shipped record is one channel, with its step and units; leave --channel out",
        ),
        (
            f"records {RECORD} --units g",
            f"{RECORD}: a shipped record is one channel, with its step and units; leave --units out",
        ),
        (
            f"ida {RECORD} --width 0.24 --height 1 --measure pgv --levels 0.2g:1g:5",
            "--levels takes a velocity as 40cm/s or 0.4 (m/s), not '0.2g'",
        ),
        (
            f"ida {RECORD} --width 0.24 --height 1 --measure pga_ratio --levels 0.2g,1g",
            "--levels takes plain numbers with this --measure, which counts in the block's own units, not '0.2g'",
        ),
        (
            f"simulate {RECORD} --alpha 12deg",
            "a block needs more than --alpha: give --p and --alpha; p is sqrt(3 g/(4 R)) of a rectangular block, with "
            "the distance R from its edge to its centre of mass; the mass alone does not matter",
        ),
    ],
)
def test_what_a_newcomer_types_is_answered_in_their_words(run, tmp_path, monkeypatch, arguments, sentence):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(*arguments.split())
    assert (code, out, err) == (2, "", f"rocking: {sentence}\n")


def test_the_step_of_a_file_is_named_by_its_option(run, tmp_path):
    (tmp_path / "mine.csv").write_text("time (s),a (g)\n0,0\n0.01,0.1\n0.02,0\n")
    code, _, err = run("records", tmp_path / "mine.csv", "--dt", "0")
    assert (code, err) == (2, "rocking: --dt must be a positive number, in s, not 0\n")


def test_of_several_records_those_that_ship_keep_theirs(run, tmp_path):
    (tmp_path / "mine.txt").write_text("\n".join(["0.0", "0.1", "-0.2", "0.0"]))
    code, out, _ = run("simulate", tmp_path / "mine.txt", RECORD, *SIZES, "--dt", "0.01", "--units", "g")
    assert code == 0
    assert RECORD in out


def test_a_note_is_said_once(run):
    _, _, err = run("ida", RECORD, *SIZES, "--levels", "1:1:10")
    assert err.count("note: --levels 1 is taken for 1 m/s^2") == 1


def test_levels_of_a_velocity_may_have_their_unit(run):
    code, out, _ = run("ida", RECORD, *SIZES, "--measure", "pgv", "--levels", "20cm/s:40cm/s:3", "--tolerance", "1e-3")
    assert code == 0
    assert "looked at: 3 levels, 0.2 to 0.4 m/s" in out


def test_a_map_says_what_its_amplitudes_count_in(run):
    _, out, _ = run("map", "one-sine", "--alpha", "0.2", "--amplitudes", "1:3:5", "--frequencies", "1:2:2")
    assert "lowest amplitude that overturns, over the smallest that lifts" in out


def test_formulas_that_mean_nothing_for_a_strong_sine_say_so(run):
    _, out, _ = run("chatter", "1e9", "2", "0.92")
    assert "none, the block does not come down; Eq. 32 means nothing here" in out
    assert "worthless: it takes chattering for complete" in out
    assert "-1.34" not in out


def test_large_sizes_are_told_in_whole_metres(run):
    _, _, err = run("simulate", RECORD, "--width", "600", "--height", "2100")
    assert "the diagonal of the block is 2184 m" in err
