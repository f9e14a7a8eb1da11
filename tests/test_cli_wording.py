"""One sentence for every mistake: it names what was typed, in the options' own words, and the slip that is likely."""

import json
import math

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import rocking
from rocking import Block, Blocks, Motion, quantities
from rocking.errors import RockingError

RECORD = "el-centro-meloland-270"
SIZES = ["--width", "0.24", "--height", "1.1"]
PULSE = "one-sine:amplitude=0.4g,frequency=1Hz"


@pytest.fixture
def undrawn(run, monkeypatch):
    """Files of figures without a figure, where only their names matter."""
    monkeypatch.setattr(Figure, "savefig", lambda figure, file, **options: file.write(b"not drawn"))


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (f"simulate {RECORD} --width -0.24 --height 1", "--width must be a positive number, in m, not -0.24"),
        (f"simulate {RECORD} --p 0 --alpha 0.2", "--p must be positive, from 1e-06 to 1e+06 rad/s, not 0"),
        (f"spectrum {RECORD} --p 1", "a spectrum needs --alpha, or the --ensemble of a calibration"),
        ("basin --p 2 --alpha 0.2", "rocking basin needs --pulse; see rocking basin --help"),
        ("chatter 1.5 2", "rocking chatter needs ETA; see rocking chatter --help"),
        ("--version x", "rocking --version takes no argument 'x'; see rocking --version --help"),
        ("pulses sine x", "rocking pulses takes no argument 'sine x'; see rocking pulses --help"),
        ("--version --verbos", "rocking --version has no option --verbos; did you mean --verbose?"),
        (f"simulate {RECORD} --p 2 --alpha 0.2 --pga", "--pga needs a value; see rocking simulate --help"),
        (
            f"simulate {RECORD} --p 2 --alpha 0.2 --pga -0.4g",
            "--pga must be above 0, not -0.4g; --scale -1 reverses a motion",
        ),
        (f"simulate {RECORD} --p 2 --alpha 0.2 --pga inf", "--pga must be a finite number, not inf"),
        (f"simulate {RECORD} --p 2 --alpha 0.2 --sa inf@1", "--sa must be a finite number, not inf"),
        (f"simulate {RECORD} --p 2 --alpha 0.2 --sa 0.1g@inf", "--sa must be a finite number, not inf"),
        (f"simulate {RECORD} --p 2 --alpha 0.2 --pgv -0.4", "--pgv must be a positive number, in m/s, not -0.4"),
        ("map half-sine --cycles 3 --alpha 0.2", "the pulse half-sine has no cycles; it takes amplitude and frequency"),
        ("map sine --alpha 0.2", "the pulse sine needs cycles as well"),
        (
            "map sine",
            "a block is needed: give --width and --height, or --half-width and --half-height, or --alpha, "
            "or --pivots and --height-of-mass and --gyration",
        ),
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
def test_a_mistake_is_reported_in_the_words_of_the_command_line(run, tmp_path, monkeypatch, arguments, sentence):
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
        lambda: rocking.simulate(Block(half_width=0.2, half_height=1.0), None, initial_rotation=12.0),
        lambda: rocking.rocking_spectrum(
            rocking.Blocks.grid(alpha=12.0, p=1.0, restitution=0.9), rocking.pulses.one_sine(1.0, 1.0)
        ),
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
    wide, high = float(sizes[1]), float(sizes[3])
    full = 2.0 if sizes[0] == "--half-width" else 1.0
    assert f"it is {full * wide:g} m wide and {full * high:g} m high, so swap its sizes if that is a slip" in err
    assert "--restitution" in err


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


def test_a_file_that_is_replaced_is_named(run, undrawn, tmp_path):
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


@pytest.mark.thorough
@pytest.mark.usefixtures("coarse")
def test_a_calibration_takes_semicolons_and_gives_units(run, history):
    known = ["--alpha", 0.2, "--restitution", 0.9]
    code, plain, err = run("calibrate", history(), *known)
    assert (code, err) == (0, "")
    assert "rad/s" in plain and "unit" in plain.splitlines()[0]
    assert run("calibrate", history(";", ","), *known)[1] == plain
    assert run("calibrate", history(";", "."), *known)[1] == plain


def test_a_calibration_names_all_columns_and_answers_that_it_takes(run, tmp_path):
    table = tmp_path / "table.csv"
    table.write_text("a,b\n1,2\n")
    assert "time_s,rotation_rad or time_s,rotation_deg" in run("calibrate", table)[2]
    table.write_text(f"motion,overturned\n{RECORD},maybe\n")
    assert "line 2: 'maybe' is not 0 or 1, no or yes, false or true" in run("calibrate", table)[2]


def test_the_height_of_a_centre_of_mass_is_called_so():
    block = Block.from_pivots((0.1, 0.2), 0.6, 0.3)
    assert block.description == "body on pivots 0.1 m and 0.2 m from its centre of mass, which is 0.6 m high"


def test_a_scaled_motion_is_distinguished_from_the_record(run):
    record = rocking.records.load(RECORD)
    scaled = record.scaled(2.0)
    assert (record.label, scaled.label) == (RECORD, f"{RECORD}, scaled by 2")
    assert (scaled.name, record.scaled_to(4.9).label) == (RECORD, f"{RECORD}, scaled by {4.9 / record.pga:.6g}")
    response = rocking.simulate(Block(width=0.24, height=1.1), scaled)
    assert scaled.label in repr(response)
    assert f"under {scaled.label}" in response.plot().get_suptitle().replace("\n", " ")
    spectrum = rocking.rocking_spectrum(rocking.Blocks.grid(alpha=0.2, p=[1.0, 2.0], restitution=0.9), scaled)
    assert scaled.label in spectrum.summary().splitlines()[0]
    assert scaled.label in spectrum.plot().get_suptitle().replace("\n", " ")
    assert list(spectrum.motion.values) == [RECORD]
    blocks = rocking.Blocks.grid(alpha=0.2, p=[1.0, 2.0], restitution=0.9)
    two = rocking.rocking_spectrum(blocks, [scaled, record]).summary()
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


def test_messages_in_python_say_what_is_meant(tmp_path):
    response = rocking.simulate(Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
    with pytest.raises(RockingError, match=rf"it is a shipped record: load it with rocking.records.load\('{RECORD}'\)"):
        rocking.read(RECORD)
    with pytest.raises(RockingError, match=r"Motion\.from_samples\(acceleration, dt\)"):
        Motion([1.0, 2.0, 3.0], 0.01)
    with pytest.raises(RockingError, match="dt = 1e-09 s makes more than 50,000,000 points"):
        response.to_dataframe(dt=1e-9)
    with pytest.raises(RockingError, match="ax must be axes of Matplotlib's to draw in, not 'x'"):
        response.plot(ax="x")
    blocks = rocking.Blocks.grid(alpha=0.2, p=1.0, restitution=0.9)
    for written in (response, rocking.rocking_spectrum(blocks, response.motion)):
        with pytest.raises(RockingError, match=r"there is no folder .*nowhere; make it"):
            written.to_netcdf(tmp_path / "nowhere" / "x.nc")


def test_the_command_line_does_not_mention_what_only_python_can_give(run):
    _, _, err = run("simulate", RECORD, *SIZES, "--chattering", "foo")
    assert err.strip().endswith("--chattering must be one of time, certified, velocity, bypass, interval, not 'foo'")
    with pytest.raises(RockingError, match="interval or a treatment, not 3"):
        rocking.simulate(Block(width=0.24, height=1.1), None, initial_rotation=0.1, chattering=3)


def test_the_peak_of_a_block_that_overturns_is_one_number_everywhere(run, tmp_path):
    single = json.loads(run("simulate", RECORD, *SIZES, "--json")[1])
    folder = tmp_path / "out"
    code, out, _ = run("simulate", RECORD, "el-centro-meloland-up", *SIZES, "--out", folder)
    assert code == 0 and single["overturned"]
    table = pd.read_csv(folder / "summary.csv")
    rows = json.loads((folder / "summary.json").read_text())["records"]
    # What falls has no largest rotation: counted as pi/2, it would lower or raise every mean.
    assert (single["peak_over_slenderness"], table["peak_over_slenderness"][0], rows[0]["peak_over_slenderness"]) == (
        None,
        math.inf,
        None,
    )
    response = rocking.simulate(Block(width=0.24, height=1.1), rocking.records.load(RECORD))
    assert response.peak_over_slenderness == math.inf
    assert "infinite" in out and f"{0.5 * math.pi / response.block.alpha:.4g}" not in out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            f"simulate {RECORD} --width 24kg --height 1",
            "--width takes a length as 0.2, 0.2m or 20cm, not '24kg'",
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


def test_large_sizes_are_shown_in_whole_metres(run):
    _, _, err = run("simulate", RECORD, "--width", "600", "--height", "2100")
    assert "the diagonal of the block is 2184 m" in err


ECCENTRIC = ["--p", "2.9858,3.0053", "--alpha", "0.27417,0.155"]


@pytest.mark.parametrize(
    ("options", "block"),
    [
        (ECCENTRIC, lambda: Block.from_parameters((2.9858, 3.0053), (0.27417, 0.155))),
        (
            ["--pivots", "0.2,0.15", "--height-of-mass", "0.6", "--gyration", "0.4"],
            lambda: Block.from_pivots((0.2, 0.15), 0.6, 0.4),
        ),
        (
            ["--pivots", "0.2", "--height-of-mass", "0.6", "--gyration", "0.4", "--restitution", "0.7,0.8"],
            lambda: Block.from_pivots((0.2, 0.2), 0.6, 0.4, restitution=(0.7, 0.8)),
        ),
        (
            ["--width", "0.3", "--height", "1.1", "--offset", "-0.03"],
            lambda: Block(width=0.3, height=1.1, offset=-0.03),
        ),
        (
            ["--half-width", "0.15", "--half-height", "0.55", "--offset", "0.03", "--restitution", "0.9,0.8"],
            lambda: Block(width=0.3, height=1.1, offset=0.03, restitution=(0.9, 0.8)),
        ),
    ],
)
def test_an_eccentric_block_is_that_of_python(run, options, block):
    code, out, _ = run("simulate", "--pulse", "one-sine:amplitude=0.4g,frequency=1Hz", *options, "--json")
    assert code == 0
    truth = rocking.simulate(block(), rocking.pulses.one_sine(0.4 * 9.80665, 1.0))
    found = json.loads(out)
    assert found["block"]["restitution"] == [side.restitution for side in truth.block.sides]
    assert found["peak_rotation_rad"] == truth.peak_rotation


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--pivots", "0.2,0.15"], "needs more than --pivots: give --pivots and --height-of-mass and --gyration"),
        (["--offset", "0.1"], "needs more than --offset: give --width and --height, or --half-width and --half-height"),
        (
            ["--p", "2", "--alpha", "0.2", "--offset", "0.1"],
            "--offset and --p and --alpha belong to different descriptions",
        ),
        (["--pivots", "0.2,-0.1", "--height-of-mass", "1", "--gyration", "1"], "--pivots must be a positive length"),
        (["--pivots", "0.2,0.1", "--height-of-mass", "-1", "--gyration", "1"], "--height-of-mass must be a positive"),
        (["--pivots", "0.2,0.1", "--height-of-mass", "1", "--gyration", "0"], "--gyration must be a positive length"),
        (["--pivots", "0.2,0.1", "--width", "1"], "--width and --pivots belong to different descriptions"),
        (["--width", "0.3", "--height", "1", "--offset", "0.2"], "--offset must be at most a quarter of the width"),
        (["--p", "3,3.1", "--alpha", "0.2"], "no rigid body has p = 3 and 3.1 rad/s on sides of one slenderness"),
        (["--width", "0.24", "--height", "1.1", "--friction", "30"], "--friction must be a coefficient"),
    ],
)
def test_an_impossible_block_is_refused_with_the_names_of_its_options(run, options, words):
    code, out, err = run("simulate", "--pulse", PULSE, *options)
    assert (code, out) == (2, "")
    assert words in err and err.count("\n") == 1


def test_sides_that_look_swapped_or_rounded_are_noted(run):
    free = ["--pulse", "one-sine:amplitude=0.4g,frequency=1Hz"]
    swapped = run("simulate", *free, "--p", "2.9858,3.0053", "--alpha", "0.155,0.27417")
    assert swapped[0] == 0 and "are the sides of p swapped" in swapped[2]
    rounded = run("simulate", *free, "--p", "3.33,3.34", "--alpha", "0.322,0.245")
    assert rounded[0] == 0 and "tell the restitution to +-0.03 only" in rounded[2]
    assert "note" not in run("simulate", *free, *ECCENTRIC)[2]


def test_a_map_takes_a_block_as_the_other_commands_do(run):
    grid = ["--amplitudes", "1,3", "--frequencies", "2", "--tolerance", "1e-2", "--json"]
    alone, with_p = (run("map", "one-sine", *p, "--alpha", "0.2", *grid) for p in ([], ["--p", "2.5"]))
    assert (alone[0], with_p[0]) == (0, 0)
    assert json.loads(alone[1]) == json.loads(with_p[1])
    sided = run("map", "one-sine", *ECCENTRIC, *grid)
    assert json.loads(sided[1])["restitution"] == pytest.approx([0.950255, 0.913887], abs=1e-6)
    code, _, err = run("map", "one-sine", "--alpha", "0.27417,0.155", *grid)
    assert code == 2 and "follows from --p and --alpha of both: give --p, too" in err


def test_a_calibration_says_that_its_pairs_are_bounds(run, tmp_path):
    table = tmp_path / "tests.csv"
    table.write_text(f"motion,overturned\n{RECORD},1\nel-centro-meloland-270,0\n")
    for option in ("--p", "--alpha", "--restitution"):
        code, _, err = run("calibrate", table, option, "0.2,0.3,0.4")
        assert code == 2
        assert f"{option} takes a number, if it is known, or two with a comma between, the lowest and the high" in err


def test_a_fragility_names_the_options_and_counts_the_years(run, tmp_path):
    table = tmp_path / "seen.csv"
    table.write_text("pga_g,overturned,trials\n0.1,1,10\n0.2,4,10\n0.4,8,10\n")
    site = tmp_path / "site.csv"
    site.write_text("pga_g,annual_rate\n0.05,0.05\n1.0,0.00005\n")
    observed = ["fragility", "--outcomes", table, "--hazard", site]
    code, out, _ = run(*observed, "--standing", "1", "--years", "1")
    assert code == 0
    assert "not in 1 year;" in out and "probability of 1 year without it" in out and "probability in 1 year " in out
    assert "1 years" not in out
    code, _, err = run(*observed, "--standing", "-1")
    assert code == 2
    assert "--standing must be a positive number, not -1" in err
    stripes = [RECORD, "ridgecrest-clc-090", "--width", "0.24", "--height", "1.1", "--offset", "0.03"]
    out = run("fragility", *stripes, "--measure", "pgv", "--levels", "0.4:1.2:9")[1]
    assert 'give another curve; --polarity "both" counts both' in out


@pytest.mark.thorough
def test_only_what_this_run_has_written_is_listed(run, undrawn, tmp_path):
    first = ("simulate", "--pulse", PULSE, *SIZES, "--out", tmp_path)
    assert "energy.png" in run(*first, "--energy")[1]
    code, out, err = run(*first)
    assert code == 0
    assert "energy" not in out
    assert "response.png" in out
    assert f"from before in {tmp_path}: energy.pdf, energy.png, phase-plane.pdf, phase-plane.png" in err


def test_a_file_in_the_way_of_a_folder_is_one_sentence(run, tmp_path):
    (tmp_path / RECORD).write_text("")
    code, _, err = run(
        *("simulate", RECORD, "el-centro-meloland-360", "--width", "0.24", "--height", "1", "--each"), "--out", tmp_path
    )
    assert code == 2
    assert err.splitlines()[-1] == f"rocking: {tmp_path / RECORD}: this folder cannot be made: File exists"


@pytest.mark.parametrize(
    "arguments",
    [("study", "new"), ("study", "status"), ("explore",), ("simulate", RECORD, "--alpha", "0.2", "--p", "2", "--out")],
)
def test_a_name_that_no_file_can_have_is_one_sentence(run, tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(*arguments, 300 * "a" + ".toml")
    assert code == 2
    assert err.count("\n") == 1
    assert "Traceback" not in err
