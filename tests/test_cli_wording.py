"""One sentence for every mistake: it names what was typed, in the options' own words, and the slip that is likely."""

import json

import numpy as np
import pytest

import rocking
from rocking import Block, Blocks, Motion
from rocking.errors import RockingError
from rocking.inputs import quantities

RECORD = "el-centro-meloland-270"
SIZES = ["--width", "0.24", "--height", "1.1"]
PULSE = "one-sine:amplitude=0.4g,frequency=1Hz"


#: What is typed after `rocking`, and words of the one sentence that answers: {R} is a record, {S} sizes, {B} a block by
#: its parameters, {W} a wall of a mass, {P} a pulse.
MISTAKES = """
simulat | there is no command simulat; did you mean simulate?
simulate {R} | a block is required; give --width and --height, or --half-width and --half-height, or --p and --alpha
simulate {S} | at least one record is required
simulate {R} --width 1 | a block requires more than --width; give --width and --height
simulate {R} {S} --p 2 | different descriptions
simulate {R} --alpha 12deg | a block requires more than --alpha; give --p and --alpha; p is sqrt(3 g/(4 R))
simulate {R} --width -0.24 --height 1 | --width must be a positive number, in m, not -0.24
simulate {R} --width 24kg --height 1 | --width must be a length, as 0.2, 0.2m or 20cm, not '24kg'
simulate {R} --half-width 2 --half-height 1 | set --restitution
simulate {R} --width 1.1 --height 0.24 | if they are swapped, or set --restitution to a value in (0, 1]
simulate {R} --p 2 --alpha 12 | which is read as rad; did you mean 12deg?
simulate {R} {S} --initial-rotation 95deg | --initial-rotation must be below 90deg in size, not 95deg
simulate {R} {S} --restituton 0.9 | has no option --restituton; did you mean --restitution?
simulate {R} {S} --model cubic | "cubic" for --model. Choose from: "nonlinear", "linear"
simulate {R} {S} --chattering foo | one of time, certified, velocity, bypass, interval, not 'foo'
simulate {R} {S} --chattering certified=0 | --chattering "certified=0": tolerance must be a positive number, in s, not 0
simulate {R} {S} --scale 2 --pga 0.5g | --scale and --pga
simulate {R} {S} --sa 0.4g | 0.4g@1.0
simulate {R} {S} --pga | --pga requires a value; see rocking simulate --help
simulate {R} {S} --pga -0.4g | --pga must be positive; got -0.4g; use --scale -1 to reverse a motion
simulate {R} {S} --channel 7 | a shipped record has one channel, with known step and units; omit --channel
simulate {R} {S} --energy | --energy writes files
simulate {R} {S} --each | --out
simulate ridgecrest-clc-91 {S} | did you mean the shipped record ridgecrest-clc-090?
simulate {P} --offset 0.1 | requires more than --offset; give --width and --height, or --half-width and --half-height
simulate {P} {W} --tendon stiffnes=1 | --tendon has no stiffnes; did you mean stiffness?
simulate {P} {W} --tendon prestress=1 | --tendon also requires stiffness
simulate {P} {W} --tendon stiffness=1e6,stiffness=2 | --tendon must be NAME=VALUE pairs separated by commas
simulate {P} {W} --tendon stiffness=-1 | --tendon: stiffness of a tendon must be at least 0 N/m, not -1
simulate {P} {W} --load mass=1,height=2,moves_with_block=so | moves_with_block=yes or moves_with_block=no; got 'so'
simulate {P} {W} --lean 40deg | --lean must be between -0.1244 and 0.1244 rad
spectrum {R} --p 1 | a spectrum requires --alpha, or the --ensemble of a calibration
spectrum {R} --alpha 0.2 | give either --p
spectrum {R} --alpha 0.2 --p 1 --size 1 | give either --p (rad/s) or --size (half diagonals, m), not both
spectrum --alpha 0.2 --p 2 | record
spectrum {R} --alpha 0.2 --p 1:2 | --p must be numbers, as 1,2,5, or a range
spectrum {R} --alpha 0.2 --p 1:2:9999999 | COUNT
spectrum {R} --alpha 0.1:0.3:10000 --p 1:9:10000 | points; use at most
map sine | a block is required
map sine --alpha 0.2 | the pulse sine also requires cycles
map half-sine --cycles 3 --alpha 0.2 | the pulse half-sine has no cycles; it accepts amplitude and frequency
ida {R} {S} --measure pgv --levels 0.2g:1g:5 | --levels must be a velocity, as 40cm/s or 0.4 (m/s), not '0.2g'
ida {R} {S} --measure pga_ratio --levels 0.2g,1g | which is in units of the block; got '0.2g'
fragility {R} --ensemble none.csv --restitution 0.5 | --ensemble replaces the block: omit --restitution
measures {R} --ensemble none.csv --one-sided --spring 2 | omit --one-sided and --spring
fragility {R} {S} --limit-states half=0.5,half=0.7 | contains half twice
fragility {R} {S} --limit-states overturning=0.5 | must not name a rotation 'overturning'
fragility {R} {S} --site 2 | --site requires a hazard curve; add one with --hazard
chatter one 2 0.9 | Invalid value for A: unable to convert "one" into float; see rocking chatter --help
chatter 1.5 2 | rocking chatter requires ETA; see rocking chatter --help
chatter | rocking chatter requires A; see
mesh nobody.obj | nobody.obj: there is no such file
mesh statue --density heavy | --density must be a number, not 'heavy'
mesh statue --restitution 0.9 | --restitution applies only to blocks created by --azimuth; add
explore --port http | --port: http is not a whole number; see rocking explore --help
pulses sine x | Unused Tokens: ['sine', 'x']; see rocking pulses --help
--version --verbos | Did you mean --verbose?
"""
TYPED = {
    "R": RECORD, "S": "--width 0.24 --height 1.1", "B": "--p 2 --alpha 0.2 --restitution 0.9",
    "W": "--width 0.5 --height 4 --mass 5000", "P": f"--pulse {PULSE}",
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES.strip().splitlines())
def test_a_mistake_is_one_sentence_in_the_words_of_the_command_line(run, tmp_path, monkeypatch, mistake):
    monkeypatch.chdir(tmp_path)
    typed, _, words = mistake.partition(" | ")
    for name, text in TYPED.items():
        typed = typed.replace(f"{{{name}}}", text)
    code, out, err = run(*typed.split())
    assert (code, out) == (2, "")
    assert err.startswith("rocking: ") and err.count("\n") == 1
    assert words in err


@pytest.mark.parametrize("option", ["--pgd", "--p0", "--velocity", "--ph", "--rotation", "--mass", "--a"])
def test_no_suggestion_leads_to_another_quantity(run, option):
    code, _, err = run("simulate", RECORD, option, "0.4")
    assert code == 2 and option in err and "mean" not in err


def test_angles_that_may_be_radians_are_taken_for_them(run):
    assert quantities.read_tilt("1.5", "--alpha") == 1.5
    assert quantities.read_tilt("12deg", "--alpha") == pytest.approx(np.radians(12.0))
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


def test_a_rotation_may_be_negative(run):
    code, out, _ = run("simulate", RECORD, *SIZES, "--initial-rotation", "-2deg", "--json")
    assert code == 0
    mirrored = rocking.simulate(
        Block(width=0.24, height=1.1), rocking.records.load(RECORD), initial_rotation=-np.radians(2.0)
    )
    assert json.loads(out)["peak_rotation_rad"] == mirrored.peak_rotation


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
    assert list(spectrum.data.motion.values) == [RECORD]
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


def test_of_several_records_those_that_ship_keep_theirs(run, tmp_path):
    (tmp_path / "mine.txt").write_text("\n".join(["0.0", "0.1", "-0.2", "0.0"]))
    code, out, _ = run("simulate", tmp_path / "mine.txt", RECORD, *SIZES, "--dt", "0.01", "--units", "g")
    assert code == 0
    assert RECORD in out


def test_a_note_is_said_once(run):
    _, _, err = run("ida", RECORD, *SIZES, "--levels", "1:1:10")
    assert err.count("note: --levels 1 is taken for 1 m/s^2") == 1


def test_levels_of_a_velocity_may_have_their_unit(run):
    code, out, _ = run("ida", RECORD, *SIZES, "--measure", "pgv", "--levels", "20cm/s:40cm/s:3", "--rtol", "1e-3")
    assert code == 0
    assert "looked at: 3 levels, 0.2 to 0.4 m/s" in out


ECCENTRIC = ["--p", "2.9858,3.0053", "--alpha", "0.27417,0.155"]


def test_a_map_takes_a_block_as_the_other_commands_do(run):
    grid = ["--amplitudes", "1,3", "--frequencies", "2", "--rtol", "1e-2", "--json"]
    alone, with_p = (run("map", "one-sine", *p, "--alpha", "0.2", *grid) for p in ([], ["--p", "2.5"]))
    assert (alone[0], with_p[0]) == (0, 0)
    assert json.loads(alone[1]) == json.loads(with_p[1])
    sided = run("map", "one-sine", *ECCENTRIC, *grid)
    assert json.loads(sided[1])["restitution"] == pytest.approx([0.950255, 0.913887], abs=1e-6)
    code, _, err = run("map", "one-sine", "--alpha", "0.27417,0.155", *grid)
    assert code == 2 and "depends on --p and --alpha of both; also set --p" in err


@pytest.mark.thorough
def test_only_what_this_run_has_written_is_listed(run, undrawn, tmp_path):
    first = ("simulate", "--pulse", PULSE, *SIZES, "--out", tmp_path)
    assert "energy.png" in run(*first, "--energy")[1]
    code, out, _ = run(*first)
    assert code == 0
    assert "energy" not in out
    assert "response.png" in out


def test_a_file_in_the_way_of_a_folder_is_one_sentence(run, tmp_path):
    (tmp_path / RECORD).write_text("")
    code, _, err = run(
        *("simulate", RECORD, "el-centro-meloland-360", "--width", "0.24", "--height", "1", "--each"), "--out", tmp_path
    )
    assert code == 2
    assert err.splitlines()[-1] == f"rocking: {tmp_path / RECORD}: this folder cannot be created: File exists"
