"""The explorer's core: cases from texts and back, arrays of windows, maps; against the package's own functions."""

import json
import math
import random
import runpy
import shlex
import sys
import types
from pathlib import Path

import explorer_addresses
import numpy as np
import pytest
from explorer_answers import page_answer

import rocking
from rocking.chattering import chattering_map, critical_amplitude, families
from rocking.errors import BlockError, MotionError, OptionError, RecordError, RockingError, StudyError
from rocking.explorer import maps
from rocking.explorer.code import case_as_command, case_as_python, map_as_python
from rocking.explorer.core import Explorer
from rocking.explorer.inputs import block_to_texts, read_case
from rocking.explorer.motions import create_pulse, motion_to_texts
from rocking.explorer.parameters import DEFAULT_TEXTS, QUANTITIES
from rocking.explorer.payload import pack
from rocking.explorer.periodic import read_sweep
from rocking.explorer.simulated import describe_outcome, thin_line
from rocking.explorer.studies import StudyView
from rocking.explorer.uploads import MAX_FILE_SIZE, MAX_FILES, UploadStore, clean_file_name, list_units
from rocking.motion.motion import find_exceedances

STATUE = {"width": "0.24", "height": "1.1", "motion": "ridgecrest-clc-090", "pga": "0.4g"}
SINE = {
    "p": "1",
    "alpha": "0.2",
    "restitution": "0.92",
    "model": "linear",
    "motion": "sine:amplitude=2.02,frequency=0.3,cycles=2.5",
}


@pytest.fixture(scope="module")
def explorer():
    return Explorer()


# Cases


def test_a_case_is_what_the_package_makes_of_the_same_numbers():
    case = read_case({**STATUE, "model": "linear", "chattering": "velocity=1e-3"}, UploadStore())
    expected = rocking.simulate(
        rocking.Block(width=0.24, height=1.1),
        rocking.records.load("ridgecrest-clc-090").scaled_to(0.4 * 9.80665),
        model="linear",
        chattering="velocity=1e-3",
    )
    response = case.simulate()
    assert response.peak_rotation == expected.peak_rotation
    assert np.array_equal(response.impacts, expected.impacts)


@pytest.mark.parametrize(
    ("scale", "measure"),
    [
        ({"pga": "0.3g"}, lambda motion: motion.pga / (0.3 * 9.80665)),
        ({"pgv": "0.2"}, lambda motion: motion.pgv / 0.2),
        ({"sa": "0.4g@0.8"}, lambda motion: motion.spectral_acceleration(0.8) / (0.4 * 9.80665)),
        ({"scale": "-2"}, lambda motion: motion.pga / (2.0 * rocking.records.load("ridgecrest-clc-090").pga)),
    ],
)
def test_a_motion_is_scaled_to_what_the_text_says(scale, measure):
    texts = {name: value for name, value in STATUE.items() if name != "pga"}
    motion = read_case({**texts, **scale}, UploadStore()).motion
    assert measure(motion) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("vertical", ["ridgecrest-clc-up", "file:{up}", "file:{both}#2"])
def test_a_record_has_a_vertical_component(vertical, tmp_path, monkeypatch):
    horizontal, upwards = (rocking.records.load(f"ridgecrest-clc-{which}") for which in ("090", "up"))
    times = np.arange(len(upwards.samples)) * upwards.dt
    table = np.column_stack([times, horizontal.acceleration(times), upwards.samples])
    files = {"up.csv": table[:, [0, 2]], "both.csv": table}
    uploads, keys = UploadStore(), {}
    monkeypatch.chdir(tmp_path)
    for name, columns in files.items():
        heading = "time (s),along (m/s2),up (m/s2)" if columns.shape[1] == 3 else "time (s),up (m/s2)"
        np.savetxt(tmp_path / name, columns, "%.17g", ",", header=heading, comments="")
        keys[name.removesuffix(".csv")] = uploads.add_file(name, (tmp_path / name).read_bytes())
    case = read_case({**STATUE, "vertical": vertical.format(**keys)}, uploads)
    expected = rocking.simulate(
        rocking.Block(width=0.24, height=1.1), horizontal.with_vertical(upwards).scaled_to(0.4 * 9.80665)
    )
    assert case.simulate().peak_rotation == expected.peak_rotation
    script = tmp_path / "case.py"
    script.write_text(case_as_python(case), "utf-8")
    assert runpy.run_path(str(script))["response"].peak_rotation == expected.peak_rotation
    command = case_as_command(case)
    assert (command is None) == ("#" in vertical)
    if command is not None:
        assert f"--vertical {'up.csv' if 'file' in vertical else vertical}" in command


def test_an_answer_about_the_vertical_file_leaves_alone_what_the_horizontal_one_says(tmp_path, monkeypatch, run):
    monkeypatch.chdir(tmp_path)
    up = np.random.default_rng(1).normal(size=200)
    (tmp_path / "up.txt").write_text("\n".join(map(repr, up.tolist())), "utf-8")
    (tmp_path / "knet.ns").write_bytes((Path(__file__).parent / "data" / "formats" / "knet.ns").read_bytes())
    uploads = UploadStore()
    along, upwards = (uploads.add_file(name, (tmp_path / name).read_bytes()) for name in ("knet.ns", "up.txt"))
    answer = {"dt": "0.02", "units": "m/s2", "scale": "4"}
    case = read_case(
        {"width": "0.24", "height": "1.1", "motion": f"file:{along}", "vertical": f"file:{upwards}", **answer}, uploads
    )
    expected = rocking.read("knet.ns").with_vertical(rocking.Motion.from_samples(up, 0.02)).scaled(4.0)
    assert np.array_equal(case.motion.coefficients, expected.coefficients)
    assert np.array_equal(case.motion.vertical.coefficients, expected.vertical.coefficients)
    assert case.motion_expression.startswith(
        "rocking.read('knet.ns').with_vertical(rocking.read('up.txt', dt=0.02, units="
    )
    program, *arguments = shlex.split(case_as_command(case))
    code, out, _ = run(*arguments, "--json", "--quiet")
    assert (program, code) == ("rocking", 0)
    assert json.loads(out)["peak_rotation_rad"] == case.simulate().peak_rotation


def test_a_vertical_component_is_a_channel_of_the_same_file(tmp_path, monkeypatch):
    uploads = UploadStore()
    file = Path(__file__).parent / "data" / "formats" / "two.v2"
    key = uploads.add_file(file.name, file.read_bytes())
    case = read_case({**STATUE, "motion": f"file:{key}", "channel": "1", "vertical": "2"}, uploads)
    expected = rocking.read(file, channel=1).with_vertical(rocking.read(file, channel=2)).scaled_to(0.4 * 9.80665)
    assert np.array_equal(case.motion.vertical.coefficients, expected.vertical.coefficients)
    assert case_as_command(case).startswith("rocking simulate two.v2 --vertical 2 ")


@pytest.mark.parametrize(
    ("texts", "says"),
    [
        ({"motion": "none"}, "goes with a record"),
        ({"motion": "sine:amplitude=3,frequency=1,cycles=2"}, "goes with a record"),
        ({"vertical": "nothing-up"}, "no shipped record 'nothing-up'"),
        ({"vertical": "file:unknown"}, "not here any more"),
    ],
)
def test_a_vertical_component_that_cannot_be_is_answered(texts, says):
    with pytest.raises(RockingError, match=says):
        read_case(
            {"width": "0.24", "height": "1.1", "motion": DEFAULT_TEXTS["motion"], "vertical": "ridgecrest-clc-up"}
            | texts,
            UploadStore(),
        )


def test_a_g_is_the_standard_one_whatever_gravity_a_block_has(explorer):
    """As in the texts of the case: a motion of 0.1 g is not one of 0.6 g where things weigh less."""
    moon = 1.62
    texts = {"p": "1", "alpha": "0.2", "restitution": "0.9", "gravity": repr(moon), "motion": "ridgecrest-clc-090"}
    texts |= {"vertical": "ridgecrest-clc-up", "pga": "0.1g"}
    found, response = page_answer(explorer, "case", texts, (225.0, 240.0)), explorer.simulate(texts).response
    header, vertical = found.header, response.motion.vertical
    assert header["motion"]["pga_g"] == pytest.approx(0.1, rel=1e-12)
    assert header["motion"]["vertical"]["pga_g"] == pytest.approx(vertical.pga / 9.80665, rel=1e-12)
    lifting = moon * math.tan(0.2)
    assert header["block"]["thresholds_g"] == pytest.approx([lifting / 9.80665] * 2, rel=1e-12)
    assert np.abs(found.arrays["ground_g"]).max() == pytest.approx(0.1, rel=1e-12)
    # Drawn are the vertical acceleration and thresholds that move by the weight, which is over the block's own gravity.
    drawn = header["block"]["gravity_g"] * (found.arrays["weight"] - 1.0)
    times = 225.0 + found.arrays["ground_time"]
    assert drawn == pytest.approx(vertical.acceleration(times) / 9.80665, abs=1e-12)
    now = page_answer(explorer, "at", texts, at="232.5")
    for name, motion in (("ground_g", response.motion), ("vertical_g", vertical)):
        assert now[name] == pytest.approx(float(motion.acceleration(232.5)) / 9.80665, rel=1e-12)
    still = {**texts, "pga": "0.02g", "scale": None, "vertical": None}
    verdict = page_answer(explorer, "case", {name: text for name, text in still.items() if text}).header["verdict"]
    assert verdict == "It does not move."


def test_the_weight_on_moving_ground_says_when_the_block_is_lifted(explorer):
    texts = {**STATUE, "vertical": "ridgecrest-clc-up"}
    arrays = page_answer(explorer, "case", texts, (228.0, 236.0)).arrays
    response = explorer.simulate(texts).response
    lift = response.block.uplift_thresholds()[0] / 9.80665
    beyond = np.abs(arrays["ground_g"]) > lift * arrays["weight"]
    stretches = find_exceedances(response.motion, response.block.uplift_thresholds())
    times = 228.0 + arrays["ground_time"]
    inside = (np.searchsorted(stretches.ravel(), times, side="right") % 2).astype(bool)
    assert beyond.sum() > 30
    # A sample at the very end of a stretch may be on either side of it.
    assert np.count_nonzero(beyond != inside) <= 2
    assert "weight" not in page_answer(explorer, "case", STATUE).arrays


@pytest.mark.parametrize(
    ("texts", "error", "words"),
    [
        ({"width": "0.2"}, BlockError, "a block requires more than width; give width and height$"),
        (
            {**STATUE, "p": "3"},
            BlockError,
            "width and height and p are from different descriptions of a block; give only width and height, or p",
        ),
        ({**STATUE, "width": "wide"}, OptionError, "width must be a length"),
        ({**STATUE, "width": "-1"}, BlockError, "positive"),
        ({**STATUE, "width": "nan"}, BlockError, "positive"),
        ({**STATUE, "colour": "red"}, OptionError, "no 'colour'"),
        ({**STATUE, "pgv": "1"}, OptionError, "use only one of them"),
        ({**STATUE, "motion": "ridgecrest-cls-090"}, OptionError, "no shipped record"),
        ({**STATUE, "motion": "/etc/passwd"}, OptionError, "no shipped record"),
        ({**STATUE, "motion": "file:../../etc/passwd"}, RecordError, "open it again"),
        ({**STATUE, "motion": "none"}, OptionError, "pga scales a ground motion"),
        ({**STATUE, "motion": "sine:amplitude=1"}, OptionError, "also requires frequency and cycles"),
        ({**STATUE, "motion": "sine:amplitude=1,frequency=1,cycles=1e9"}, MotionError, "1000 here at most"),
        ({**STATUE, "restitution": "0.9999"}, OptionError, "hardly comes to rest"),
        ({**STATUE, "chattering": "never"}, OptionError, "chattering must be one of"),
        ({**STATUE, "model": "x" * 400}, OptionError, "at most 300"),
        (
            {"motion": "none"},
            BlockError,
            "a block is required; give width and height, or p and .*, or mesh and azimuth$",
        ),
        ({"pivots": "0.2,0.1", "gyration": "0.4"}, BlockError, "more than pivots and gyration; give"),
        ({"p": "2", "alpha": "0.2", "offset": "0.1"}, BlockError, "from different descriptions"),
    ],
)
def test_an_impossible_case_is_refused_with_one_sentence(texts, error, words):
    with pytest.raises(error, match=words) as caught:
        read_case(texts, UploadStore()).simulate()
    assert "\n" not in str(caught.value)


# As Python, and as a command

ECCENTRIC = [
    {"p": "2.9858,3.0053", "alpha": "0.27417,0.155"},
    {"width": "0.3", "height": "1.1", "offset": "-0.03"},
    {"pivots": "0.2,0.15", "height_of_mass": "60cm", "gyration": "0.4"},
]

CASES = [
    STATUE,
    {**STATUE, "model": "linear", "restitution": "0.9"},
    {
        "p": "2.5,2.2",
        "alpha": "7deg,11deg",
        "restitution": "0.9,0.85",
        "motion": "el-centro-meloland-270",
        "scale": "0.6",
    },
    {"width": "0.24", "height": "1.1", "motion": "ridgecrest-clc-090", "sa": "0.5g@1", "chattering": "interval=1e-3"},
    {"width": "0.24", "height": "1.1", "motion": "ridgecrest-clc-090", "duration": "235"},
    *({**block, "motion": "el-centro-meloland-270"} for block in ECCENTRIC),
]


@pytest.mark.parametrize(
    "texts", [*CASES, {**SINE, "initial_rotation": "1deg"}, {**SINE, "motion": "none", "initial_rotation": "2deg"}]
)
def test_the_case_as_python_runs_and_has_the_same_peak(texts, tmp_path, capsys):
    case = read_case(texts, UploadStore())
    script = tmp_path / "case.py"
    script.write_text(case_as_python(case), "utf-8")
    found = runpy.run_path(str(script))
    assert found["response"].peak_rotation == case.simulate().peak_rotation
    assert "outcome" in capsys.readouterr().out


@pytest.mark.cases(fast=3)
@pytest.mark.parametrize("texts", CASES)
def test_the_case_as_a_command_runs_and_has_the_same_peak(texts, run):
    case = read_case(texts, UploadStore())
    program, *arguments = shlex.split(case_as_command(case))
    code, out, err = run(*arguments, "--json")
    assert (program, code, err) == ("rocking", 0, "")
    peak = float(out.split('"peak_rotation_rad": ')[1].split(",")[0])
    assert peak == case.simulate().peak_rotation


@pytest.mark.thorough
def test_a_file_is_named_in_code_as_it_was_called(tmp_path, monkeypatch, run):
    record = rocking.records.load("el-centro-meloland-270")
    text = "\n".join(f"{value:.10g}" for value in record.samples)
    (tmp_path / "my record.txt").write_text(text, "utf-8")
    uploads = UploadStore()
    key = uploads.add_file("C:\\data\\my record.txt", text.encode())
    case = read_case(
        {"width": "0.24", "height": "1.1", "motion": f"file:{key}", "dt": "0.01", "units": "m/s2"}, uploads
    )
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.py").write_text(case_as_python(case), "utf-8")
    assert runpy.run_path("case.py")["response"].peak_rotation == case.simulate().peak_rotation
    code, _, err = run(*shlex.split(case_as_command(case))[1:], "--quiet")
    assert (code, err) == (0, "")


def test_what_the_command_line_cannot_do_is_not_given_as_a_command():
    assert case_as_command(read_case({**SINE, "motion": "none", "initial_rotation": "2deg"}, UploadStore())) is None
    assert case_as_command(read_case({**STATUE, "gravity": "1.62"}, UploadStore())) is None


def test_code_names_a_motion_of_the_program_on_a_line_of_its_own(tmp_path):
    uploads = UploadStore()
    motion = rocking.Motion.from_samples(np.sin(np.arange(400) / 9.0), 0.02, name="my\nmotion")
    texts = {"p": "2", "alpha": "0.2", "motion": f"given:{uploads.add_motion(motion)}", "pga": "3"}
    case = read_case(texts, uploads)
    grid = maps.read_grid(case, {"x": "p", "y": "pga", "points": "8"})
    for code, peak in ((case_as_python(case), 3.0), *[(map_as_python(grid), None)]):
        (line,) = [line for line in code.splitlines() if "# mymotion: a motion of the study" in line]
        variable = line.partition(" = ...")[0]
        script = tmp_path / "code.py"
        script.write_text(code.replace(line, f"from rocking_given import motion as {variable}"), "utf-8")
        sys.modules["rocking_given"] = types.SimpleNamespace(motion=motion)
        found = runpy.run_path(str(script))
        assert peak is None or found["motion"].pga == pytest.approx(peak, rel=1e-12)
    del sys.modules["rocking_given"]


#: Blocks and motions as studies have them.
SIMULATED = {
    "sizes": (rocking.Block(width=0.24, height=1.1), rocking.records.load("ridgecrest-clc-090")),
    "restitution": (rocking.Block(width=0.24, height=1.1, restitution=0.8), rocking.pulses.ricker(4.0, 1.0)),
    "two-sided": (rocking.Block.from_pivots((0.2, 0.15), 0.6, 0.4), rocking.pulses.one_sine(4.0, 1.0)),
    "off its middle": (rocking.Block(width=0.3, height=1.1, offset=0.03), rocking.pulses.one_sine(4.0, 1.0)),
    "moon": (rocking.Block(width=0.24, height=1.1, gravity=1.62), rocking.pulses.one_sine(2.0, 1.0)),
    "own motion": (
        rocking.Block.from_parameters(2.0, 0.2), rocking.pulses.one_sine(4.0, 1.0) + rocking.pulses.ricker(1.0, 2.0)
    ),
    "processed": (
        rocking.Block(width=0.24, height=1.1), rocking.records.load("ridgecrest-clc-090").processed(trim=(200.0, 250.0))
    ),
}  # fmt: skip


@pytest.mark.parametrize("factor", [1.0, 1.5])
@pytest.mark.parametrize("name", SIMULATED)
def test_a_block_and_a_motion_written_as_a_case_are_the_same_bit_for_bit(name, factor):
    (block, motion), uploads = SIMULATED[name], UploadStore()
    case = read_case(block_to_texts(block) | motion_to_texts(motion, uploads, factor), uploads)
    again, expected = case.simulate(), rocking.simulate(block, motion.scaled(factor))
    assert np.array_equal(again.impacts, expected.impacts)
    assert np.array_equal(again.events, expected.events)
    assert again.peak_rotation == expected.peak_rotation
    assert again.duration == expected.duration


# Windows


@pytest.mark.parametrize("width", [300.0, 3.0, 1e-3, 1e-6, 1e-9])
def test_a_window_has_the_engines_own_values_however_narrow_it_is(explorer, width):
    response = explorer.simulate(STATUE).response
    middle = float(response.impacts["time"][-20])
    start, end = max(0.0, middle - 0.4 * width), min(response.duration, middle + 0.6 * width)
    arrays = page_answer(explorer, "case", STATUE, (start, end)).arrays
    times = start + arrays["time"]
    assert times[0] >= start
    assert times[-1] <= end
    # The offsets are exact but for the rounding of start + offset, which is at most one ulp of the time.
    slack = 2.0 * np.spacing(end) * np.abs(response.angular_velocity(times)).max() + 1e-300
    assert np.abs(arrays["rotation"] - response.rotation(times)).max() <= slack
    struck = response.impacts["time"]
    inside = struck[(struck >= start) & (struck <= end)]
    assert np.array_equal(start + arrays["impact"], inside) or len(inside) > 2000
    assert len(arrays["time"]) <= 3000 + 2


@pytest.mark.parametrize("width", [1e-4, 1e-6, 1e-8])
def test_a_window_close_to_a_rest_is_resolved_as_far_as_it_shows(explorer, width):
    case = explorer.simulate(STATUE).case
    fine = rocking.simulate(case.block, case.motion, chattering=rocking.Certified(1e-40))
    rest = float(explorer.simulate(STATUE).response.sequences["end"][-1])
    payload = page_answer(explorer, "case", STATUE, (rest - width, rest + 0.1 * width))
    start, arrays = payload.header["window"]["from"], payload.arrays
    assert len(arrays["impact"]) == payload.header["window"]["impacts"] > 10
    assert np.array_equal(arrays["rotation"], fine.rotation(start + arrays["time"]))
    assert np.abs(arrays["rotation"]).max() > 0.0
    # What is resolved in both is the same to rounding.
    coarse = explorer.simulate(STATUE).response.impacts["time"]
    nearest = np.abs(fine.impacts["time"][:, None] - coarse).min(axis=0)
    assert nearest.max() < 1e-12
    assert fine.sequences["end"] == pytest.approx(explorer.simulate(STATUE).response.sequences["end"], abs=1e-12)


def test_peaks_survive_the_thinning_of_a_wide_window(explorer):
    shown = explorer.simulate(STATUE)
    arrays = page_answer(explorer, "case", STATUE, (0.0, shown.response.duration)).arrays
    assert arrays["rotation"].max() > 0.98 * shown.response.peak_rotation
    assert np.abs(arrays["ground_g"]).max() == pytest.approx(0.4, rel=1e-12)


def test_a_thinned_line_keeps_its_extremes_and_its_order():
    rng = np.random.default_rng(1)
    time, values = np.sort(rng.uniform(size=50_001)), rng.normal(size=50_001)
    chosen = thin_line(values, 1000)
    kept_time, kept = time[chosen], values[chosen]
    assert len(kept) <= 1000
    assert (kept.min(), kept.max()) == (values.min(), values.max())
    assert (np.diff(kept_time) > 0.0).all()


def test_what_a_millionth_of_the_motion_moves_a_rest_by_is_told_beside_its_bracket(explorer):
    rows = page_answer(explorer, "case", STATUE).arrays["sequence"].reshape(-1, 6)
    response = explorer.simulate(STATUE).response
    assert np.array_equal(rows[:, 1], response.sequences["end"]) and len(rows) == 4
    moved = []
    for sign in (1.0, -1.0):
        motion = response.motion.scaled(1.0 + sign * 1e-10)
        moved.append(rocking.simulate(response.block, motion).sequences["end"][:3])
    # Of the three short sequences a change by 1e-10 is linear; the motion drives the block by more than its scale.
    by_scale = 1e4 * 0.5 * np.abs(moved[0] - moved[1])
    assert (rows[:3, 5] >= 0.5 * by_scale).all() and (rows[:3, 5] < 1e-5).all()
    # A unit in the last place of the motion moves the last rest by 1.6e-9 s; its bracket contains that.
    assert 1.0 < rows[3, 5] < 20.0 and 1.6e-9 < rows[3, 3] - rows[3, 2] < 1e-6
    assert (rows[:3, 3] - rows[:3, 2] < 1e-9).all()


def test_a_window_that_begins_when_the_response_is_over_is_where_it_moves(explorer):
    short = {"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"}
    usual = page_answer(explorer, "case", short).header["window"]
    assert page_answer(explorer, "case", short, (400.0, 500.0)).header["window"] == usual
    with pytest.raises(OptionError, match="finite"):
        page_answer(explorer, "case", short, (math.nan, 1.0))


@pytest.mark.parametrize("window", [(5.0, 5.0), (6.0, 5.0), (math.nan, 1.0), (0.0, math.inf)])
def test_a_window_that_is_none_is_refused(explorer, window):
    with pytest.raises(OptionError, match=r"window|finite"):
        page_answer(explorer, "case", STATUE, window)


def test_verdicts_are_those_of_the_response(explorer):
    assert page_answer(explorer, "case", {**STATUE, "pga": "0.1g"}).header["verdict"] == "It does not move."
    fallen = page_answer(explorer, "case", {**STATUE, "pga": "0.8g"}).header
    stopped = page_answer(explorer, "case", {**STATUE, "duration": "232"}).header["verdict"]
    assert stopped.startswith("Still rocking at 232 s, where the simulation was stopped")
    header = page_answer(explorer, "case", STATUE).header
    share = f"{100.0 * header['peak_over_slenderness']:.2g} %"
    assert header["verdict"] == f"It rocks and does not overturn: it reaches {share} of the overturning rotation."
    times = f"It overturns at {fallen['tipping_time']:.2f} s, and lies flat at {fallen['overturn_time']:.2f} s."
    assert fallen["verdict"] == times
    sine = {"width": "0.24", "height": "1.1", "motion": "sine:amplitude=5.6,frequency=1.6,cycles=6"}
    for amplitude in np.linspace(2.6, 9.0, 65):
        response = explorer.simulate(sine | {"motion": f"sine:amplitude={amplitude},frequency=1.6,cycles=6"}).response
        assert describe_outcome(response).startswith("Undecided: ") == (not response.perturbed().is_decided)


def test_a_block_that_nothing_moves_is_shown_at_rest_for_a_second(explorer):
    payload = page_answer(explorer, "case", {"width": "0.24", "height": "1.1", "motion": "none"})
    assert payload.header["verdict"] == "It does not move."
    assert payload.header["window"] == {"from": 0.0, "to": 1.0, "impacts": 0, "unresolved": None}
    assert payload.header["duration"] == 0.0 and payload.arrays["rotation"].tolist() == [0.0]


def test_whatever_an_address_says_is_answered_with_numbers_or_a_sentence():
    draw, explorer, answered, refused = random.Random(5), Explorer(), 0, 0
    for _ in range(200):
        texts = explorer_addresses.case(draw)
        try:
            payload = page_answer(explorer, "case", texts)
            other = page_answer(explorer, "case", texts, (0.0, 0.5))
            assert page_answer(explorer, "details", texts).header["python"]
        except RockingError as error:
            assert str(error), texts
            refused += 1
            continue
        for each in (payload, other):
            assert 0.0 <= each.header["window"]["from"] < each.header["window"]["to"] < math.inf, texts
            assert pack(each)
        for header in (payload.header, other.header):
            assert math.isfinite(header["overturn_time"]) == header["overturned"], texts
            assert math.isfinite(header["peak_time"]) and math.isfinite(header["peak_rotation"]), texts
        answered += 1
    assert answered >= 25 and refused >= 100


# Files


def test_a_file_says_what_must_be_told(explorer):
    key = explorer.uploads.add_file("one column.txt", "\n".join(["0.1", "-0.2", "0.3"] * 50).encode())
    found = explorer.uploads.describe_file(key)
    assert set(found["missing"]) == {"units", "dt"}
    assert found["channels"][0]["raw"] == {"pga": 0.3, "duration": 149.0} and found["channels"][0]["measures"] is None
    sizes = {"g": 9.80665, "m/s2": 1.0, "cm/s2": 0.01, "mm/s2": 1e-3, "mg": 9.80665e-3}
    assert list_units() == pytest.approx(sizes, rel=1e-12)
    texts = {"width": "0.24", "height": "1.1", "motion": f"file:{key}", "dt": "0.02", "units": "g"}
    assert read_case(texts, explorer.uploads).motion.duration == pytest.approx(149 * 0.02)


def test_messages_about_a_file_name_it_and_no_path(explorer):
    key = explorer.uploads.add_file("/home/somebody/bad.txt", b"1.0\n2.0\nthree\n")
    with pytest.raises(RockingError) as caught:
        explorer.uploads.describe_file(key)
    assert "bad.txt" in str(caught.value)
    assert "/" not in str(caught.value).replace("m/s2", "").replace("m/s", "").replace("cm/s2", "")


def test_files_are_known_by_name_and_content_and_so_many_at_most():
    uploads = UploadStore()
    key = uploads.add_file("a.txt", b"1 2 3")
    assert uploads.add_file("/data/a.txt", b"1 2 3") == key
    other = uploads.add_file("123", b"1 2 3")
    assert other != key and [uploads.get_file(each).name for each in (key, other)] == ["a.txt", "123"]
    uploads.remove(other)
    for k in range(MAX_FILES - 1):
        uploads.add_file("x", str(k).encode())
    with pytest.raises(RecordError, match="x: it cannot be kept: 120 files and 256 MiB are kept at most"):
        uploads.add_file("x", b"another")
    assert uploads.add_file("a.txt", b"1 2 3") in uploads.list_records() and len(uploads.list_records()) == MAX_FILES
    with pytest.raises(RecordError, match="may have 16 MiB: cut a record"):
        uploads.add_file("big", bytes(MAX_FILE_SIZE + 1))


@pytest.mark.parametrize("name", ["../../x", "..\\..\\x", "/etc/x", "C:\\x", "a/b/../x", "\x00x\n"])
def test_no_folder_is_left_of_a_files_name(name):
    assert clean_file_name(name) == "x"


# Maps


def filled(grid):
    """Every quantity at every point of a map, each point once."""
    values = np.full((len(QUANTITIES), grid.shape[0] * grid.shape[1]), -9.0)
    count = np.zeros(values.shape[1], int)
    for part in maps.simulate_grid(grid):
        points = part.arrays["points"].astype(int)
        values[:, points] = [part.arrays[name] for name in QUANTITIES]
        count[points] += 1
    assert (count == 1).all()
    return dict(zip(QUANTITIES, values.reshape(len(values), *grid.shape), strict=True))


def _mapped(texts, axes):
    grid = maps.read_grid(read_case(texts, UploadStore()), {"points": "8", **axes})
    return grid, filled(grid)


@pytest.mark.thorough
def test_a_map_of_a_sine_is_the_packages_chattering_map():
    case = read_case(SINE, UploadStore())
    grid = maps.read_grid(
        case, {"x": "omega", "y": "a", "x_from": "0.7", "x_to": "5", "y_from": "0.95", "y_to": "1.3", "points": "12"}
    )
    found = filled(grid)
    expected = chattering_map(families.sine(case.block, model="linear"), {"a": grid.y.values, "omega": grid.x.values})
    assert np.array_equal(found["outcome"], expected.data.outcome.values)
    times = (expected.data.rest - expected.data.uplift).values
    assert np.array_equal(np.isnan(found["rest"]), np.isnan(times))
    assert found["rest"] == pytest.approx(times, rel=2e-6, nan_ok=True)


def test_a_map_of_a_record_is_the_packages_chattering_map():
    case = read_case(
        {"p": "3", "alpha": "0.2", "restitution": "0.9", "motion": "el-centro-meloland-270"}, UploadStore()
    )
    grid = maps.read_grid(
        case, {"x": "p", "y": "a", "x_from": "2", "x_to": "6", "y_from": "0.9", "y_to": "2", "points": "8"}
    )
    found = filled(grid)
    family = families.record(rocking.records.load("el-centro-meloland-270"), 0.2, 0.9)
    expected = chattering_map(family, {"a": grid.y.values, "p": grid.x.values})
    assert np.array_equal(found["outcome"], expected.data.outcome.values)


def test_peaks_and_modes_of_a_map_are_those_of_single_simulations():
    case = read_case({**SINE, "motion": "one-sine:amplitude=2,frequency=0.5"}, UploadStore())
    grid = maps.read_grid(
        case, {"x": "omega", "y": "a", "x_from": "1", "x_to": "4", "y_from": "0.9", "y_to": "6", "points": "8"}
    )
    found = filled(grid)
    expected = rocking.overturning_map(
        case.block, "one-sine", amplitudes=grid.y.values, frequencies=grid.x.values, model="linear", rtol=0.4
    )
    assert np.array_equal(found["mode"], expected.data.mode.values)
    stays = found["mode"] < 0
    assert np.count_nonzero(stays) >= 10 and np.count_nonzero(~stays) >= 10
    assert found["peak"][stays] == pytest.approx(expected.data.peak_rotation.values[stays] / 0.2, rel=1e-6)
    assert np.isinf(found["peak"][~stays]).all()


@pytest.mark.parametrize("block", ECCENTRIC)
def test_an_eccentric_block_is_not_mapped_over_one_slenderness_of_both_sides(block):
    texts = {**block, "motion": "one-sine:amplitude=4,frequency=1"}
    with pytest.raises(OptionError, match="is mapped over omega, p, restitution, a, pga, not over 'alpha'"):
        maps.read_grid(read_case(texts, UploadStore()), {"x": "alpha", "y": "a"})
    assert "alpha" in maps.list_axes(read_case({**texts, "restitution": "0.9"}, UploadStore()))


def test_the_curves_over_a_map_are_the_critical_amplitudes():
    case = read_case(SINE, UploadStore())
    grid = maps.read_grid(case, {"x": "omega", "y": "a", "x_from": "0.3", "x_to": "9", "points": "20"})
    assert np.array_equal(maps.compute_critical_amplitudes(grid), critical_amplitude(grid.x.values, 0.92))
    other = maps.read_grid(case, {"x": "restitution", "y": "a", "points": "8"})
    omega = 2.0 * math.pi * 0.3
    assert np.array_equal(maps.compute_critical_amplitudes(other), critical_amplitude(omega, other.x.values))
    without = maps.read_grid(case, {"x": "omega", "y": "restitution", "points": "8"})
    assert maps.compute_critical_amplitudes(without) is None


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        ({"x": "omega", "y": "p"}, "vary the same"),
        ({"x": "a", "y": "p"}, "amplitudes go upwards"),
        ({"x": "mass", "y": "a"}, "mapped over"),
        ({"x": "omega", "y": "a", "points": "4000"}, "from 8 to 400"),
        ({"x": "omega", "y": "a", "points": "10.5"}, "from 8 to 400"),
        ({"x": "omega", "y": "a", "x_from": "3", "x_to": "2"}, "must be positive and below"),
        ({"x": "omega", "y": "a", "x_from": "-1", "x_to": "2"}, "must be positive and below"),
    ],
)
def test_axes_that_are_none_are_refused(axes, words):
    with pytest.raises(OptionError, match=words):
        maps.read_grid(read_case(SINE, UploadStore()), axes)


def test_a_map_that_is_not_read_on_stops():
    grid = maps.read_grid(read_case(SINE, UploadStore()), {"x": "omega", "y": "a", "points": "400"})
    found = maps.simulate_grid(grid)
    next(found)
    found.close()
    with pytest.raises(StopIteration):
        next(found)


_PULSE = "mavroeidis-papageorgiou:amplitude=0.6,frequency=1,phase=0,gamma=2"
_SIDES = {"p": "2,2.4", "alpha": "0.2,0.25", "restitution": "0.9,0.85"}
_BLOCK = {"p": "2", "alpha": "0.2", "restitution": "0.9"}


ONE = "one-sine:amplitude=3,frequency=1"
RICKER = "ricker:amplitude=3,frequency=1,"
NONLINEAR = {**SINE, "model": "nonlinear"}

#: Cases and axes of maps: over records and pulses, of one side and two, with each kind of axis, whatever scales,
#: reverses, lifts, starts, treats or ends the case, and whatever an amplitude or a frequency means.
MAPS = [
    (NONLINEAR, {"x": "omega", "x_from": "3", "x_to": "5", "y": "a", "y_to": "9"}),
    ({**_SIDES, "motion": _PULSE, "scale": "-1.5"}, {"x": "omega", "y": "a", "y_to": "4"}),
    ({**_BLOCK, "motion": ONE, "initial_rotation": "0.1", "duration": "1"}, {"x": "p", "y": "pga"}),
    (
        {**_BLOCK, "motion": "el-centro-meloland-270", "vertical": "el-centro-meloland-up"},
        {"x": "p", "y": "pga", "y_to": "0.5"},
    ),
    ({**NONLINEAR, "gravity": "3.7"}, {"x": "alpha", "y": "a", "y_from": "1", "y_to": "5"}),
    ({**ECCENTRIC[2], "motion": "one-sine:amplitude=4,frequency=1"}, {"x": "omega", "y": "a", "y_to": "3"}),
    (
        {**STATUE, "motion": RICKER + "duration=1.2,kind=symmetric"},
        {"x": "omega", "x_from": "1", "y": "a", "y_to": "6"},
    ),
    ({**_BLOCK, "motion": _PULSE}, {"x": "omega", "y": "restitution"}),
    ({**_BLOCK, "motion": ONE, "pgv": "0.9"}, {"x": "omega", "y": "restitution"}),
    ({**_SIDES, "motion": "el-centro-meloland-270", "scale": "-2"}, {"x": "p", "y": "pga", "y_to": "0.7"}),
    ({**_SIDES, "motion": ONE, "scale": "-2"}, {"x": "omega", "y": "restitution"}),
    (
        {**_BLOCK, "motion": "el-centro-meloland-360", "chattering": "velocity=0.05"},
        {"x": "p", "y": "pga", "y_to": "1"},
    ),
    (_BLOCK, {"x": "p", "y": "pga", "y_to": "1"}),
    (SINE, {"x": "restitution", "y": "omega"}),
    (SINE, {"x": "omega", "y": "pga", "y_from": "0.2", "y_to": "2"}),
    ({**SINE, "restitution": "0.9,0.92"}, {"x": "p", "y": "a", "y_from": "1.01", "y_to": "1.1"}),
    ({**STATUE, "motion": "el-centro-meloland-270"}, {"x": "alpha", "y": "pga", "y_to": "0.6"}),
    ({**STATUE, "offset": "0.03", "motion": "el-centro-meloland-270"}, {"x": "p", "y": "pga", "y_to": "0.5"}),
    ({**ECCENTRIC[0], "motion": "one-sine:amplitude=4,frequency=1"}, {"x": "p", "y": "a", "y_to": "3"}),
    ({**ECCENTRIC[1], "motion": "one-sine:amplitude=4,frequency=1"}, {"x": "restitution", "y": "a", "y_to": "3"}),
]


@pytest.mark.cases(fast=5, thorough=12)
@pytest.mark.parametrize(("texts", "axes"), MAPS)
def test_points_and_scripts_of_a_map_are_what_it_shows(texts, axes, tmp_path):
    grid, mapped = _mapped(texts, axes)
    rests, judged = np.argwhere(np.isfinite(mapped["rest"])), 0
    points = [*np.random.default_rng(1).integers(0, 8, (12, 2)), *rests[:: max(1, len(rests) // 3)]]
    for row, column in points:
        at = maps.map_point_to_texts(grid, float(grid.x.values[column]), float(grid.y.values[row]))
        response = read_case(at, UploadStore()).simulate()
        smaller = min(side.alpha for side in response.block.sides)
        peak = math.inf if response.overturned else response.peak_rotation / smaller
        assert mapped["peak"][row, column] == pytest.approx(peak, rel=1e-4, abs=1e-12)
        if len(response.sequences):
            rest = response.sequences["end"][0] - response.events["time"][0]
            assert mapped["rest"][row, column] == pytest.approx(rest, rel=1e-5)
        assert response.block.gravity == grid.case.block.gravity
        judged += 0.0 < peak < math.inf
    assert judged >= 3
    (tmp_path / "map.py").write_text(map_as_python(grid), "utf-8")
    names = runpy.run_path(str(tmp_path / "map.py"))
    found, overturned = names["found"].data, np.isinf(mapped["peak"])
    assert np.array_equal(found.outcome.values, mapped["outcome"])
    assert np.array_equal(found.overturned.values, overturned)
    assert np.allclose(names["peaks"], mapped["peak"], rtol=1e-4)


@pytest.mark.parametrize("motion", ["one-sine:amplitude=0,frequency=1", "ridgecrest-clc-090"])
def test_a_map_of_a_motion_that_shakes_nothing_is_refused(motion):
    case = read_case({**_BLOCK, "motion": motion, "scale": "0"}, UploadStore())
    with pytest.raises(OptionError, match="something that shakes the block"):
        maps.read_grid(case, {"x": "p", "y": "pga"})


@pytest.mark.cases(fast=2)
@pytest.mark.parametrize(
    ("cycles", "phase", "drawn"),
    [("1", "0", True), ("0.6", "30deg", False), ("2.5", "0", True), ("2.5", "80deg", False), ("0.5", "0", False)],
)
def test_the_critical_amplitude_is_drawn_where_it_parts_complete_chattering_from_other(cycles, phase, drawn):
    texts = {**SINE, "motion": f"sine:amplitude=3,frequency=0.3,cycles={cycles},phase={phase}"}
    case = read_case(texts, UploadStore())
    grid = maps.read_grid(case, {"x": "omega", "x_from": "1", "x_to": "4", "y": "a", "points": "8"})
    found = maps.compute_critical_amplitudes(grid)
    assert (found is not None) is drawn

    def at(a, omega):
        motion = create_pulse(maps.map_point_to_texts(grid, omega, a)["motion"])
        return families.SimulationInput(case.block, motion, "linear")

    parted = []
    for omega, a in zip(grid.x.values, critical_amplitude(grid.x.values, 0.92), strict=True):
        near = chattering_map(at, {"a": [0.999 * a, 1.001 * a], "omega": [omega]})
        parted.append(near.data.complete.values[:, 0].tolist() == [True, False])
    assert all(parted) is drawn
    if drawn:
        assert np.isfinite(found).all()


def test_a_motion_beyond_all_mechanics_is_refused_before_it_is_simulated():
    for scaling in ({"pga": "1e31"}, {"scale": "1e31"}, {"pgv": "1e40"}):
        with pytest.raises(MotionError, match=r"must stay below 1e\+30 m/s\^2"):
            read_case({**_BLOCK, "motion": "one-sine:amplitude=3,frequency=1", **scaling}, UploadStore())
    upwards = {"motion": "ridgecrest-clc-090", "vertical": "ridgecrest-clc-up", "scale": "1e29"}
    assert read_case({**_BLOCK, **upwards}, UploadStore()).motion.pga < 1e30
    case = read_case({**_BLOCK, "motion": "sine:amplitude=3,frequency=1,cycles=2"}, UploadStore())
    for axes in (
        {"y": "pga", "y_to": "1e40"}, {"y": "a", "y_to": "1e40"}, {"x": "alpha", "y": "a", "y_to": "1e33"}
    ):  # fmt: skip
        with pytest.raises(MotionError, match="must stay below"):
            maps.read_grid(case, {"x": "p", **axes, "points": "8"})
    with pytest.raises(MotionError, match="must stay below"):
        read_sweep(case, {"sweep": "a", "sweep_to": "1e40"})


@pytest.mark.parametrize("duration", ["5e-324", "1e-13"])
def test_a_duration_that_no_window_shows_is_refused(duration):
    with pytest.raises(OptionError, match="duration must be 1e-12 s or more here"):
        read_case({**STATUE, "duration": duration}, UploadStore())
    explorer = Explorer()
    shortest = {**STATUE, "duration": "1e-12"}
    assert pack(page_answer(explorer, "case", shortest))
    assert page_answer(explorer, "details", shortest).header["summary"]


def test_a_block_that_hardly_comes_to_rest_is_mapped_over_no_points_that_would_be_refused():
    case = read_case(
        {**_BLOCK, "restitution": "1", "duration": "10", "motion": "el-centro-meloland-270"}, UploadStore()
    )
    with pytest.raises(OptionError, match="hardly comes to rest"):
        maps.read_grid(case, {"x": "p", "y": "pga"})
    axes = {"x": "restitution", "y": "pga", "x_to": "0.9989"}
    assert maps.read_grid(case, axes)
    with pytest.raises(OptionError, match="hardly comes to rest"):
        maps.read_grid(case, {**axes, "x_to": "0.9991"})


# Studies


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("studies") / "museum"
    blocks = rocking.Blocks.grid(p=np.linspace(2.0, 5.0, 7), alpha=np.linspace(0.1, 0.3, 5), restitution=[0.85, 0.9])
    motions = [rocking.pulses.one_sine(1.0, 1.0), rocking.records.load("el-centro-meloland-270")]
    made = rocking.create_study(
        folder, blocks, motions, levels=[2.0, 4.0], measure="pga", polarity="both", blocks_per_batch=512
    )
    made.run()
    return StudyView(folder)


def test_a_slice_of_a_study_is_its_results(study):
    results = study.study.results()
    texts = {
        "x": "p",
        "y": "alpha",
        "quantity": "peak_rotation",
        "motion_index": "1",
        "scale_index": "1",
        "polarity_index": "1",
        "restitution_index": "1",
    }
    payload = study.select(texts)
    rows, columns = payload.header["shape"]
    values = payload.arrays["values"].reshape(rows, columns)
    for row in range(rows):
        for column in range(columns):
            chosen = (
                (results.p == payload.header["x"]["values"][column])
                & (results.alpha == payload.header["y"]["values"][row])
                & (results.restitution == 0.9)
            )
            assert values[row, column] == results.peak_rotation[1, 1, 1, np.flatnonzero(chosen.values)[0]]


def test_a_verdict_that_the_duration_left_open_is_not_drawn_as_standing(tmp_path):
    blocks = rocking.Blocks.grid(p=[1.5, 4.0], alpha=[0.1, 0.2], restitution=[0.9])
    motion = rocking.pulses.one_sine(amplitude=4.0, frequency=1.0)
    made = rocking.create_study(
        tmp_path / "cut", blocks, motion, levels=[0.01, 1.0], duration=0.9, blocks_per_batch=512
    )
    made.run()
    results = made.results()
    assert results.ended_early.values.any()
    view = StudyView(tmp_path / "cut")
    drawn = view.select({"x": "p", "y": "scale", "quantity": "overturned"}).arrays["values"].reshape(2, 2)
    chosen = results.isel(motion=0, block=np.flatnonzero(results.alpha.values == 0.1))
    wanted = np.where(chosen.ended_early & ~chosen.overturned, -1.0, chosen.overturned)
    assert np.array_equal(drawn, wanted.reshape(2, 2))
    assert (drawn == -1.0).any()


def test_points_of_a_study_have_its_gravity_and_keep_each_motion_once(tmp_path):
    blocks = rocking.Blocks.grid(p=[2.0, 3.0], alpha=[0.2, 0.3], restitution=[0.9], gravity=1.62)
    samples = np.random.default_rng(1).normal(size=400)
    motion = rocking.Motion.from_samples(samples, 0.02, name="own")
    made = rocking.create_study(
        tmp_path / "moon", blocks, motion, levels=[1.0, 2.0, 3.0], measure="pga", polarity="both"
    )
    made.run()
    view, uploads, results = StudyView(tmp_path / "moon"), UploadStore(), made.results()
    judged = 0
    for scale, level in enumerate((1.0, 2.0, 3.0)):
        for polarity in (0, 1):
            at = {"x": "p", "y": "scale", "at_x": "3", "at_y": str(level), "polarity_index": str(polarity)}
            texts = view.point_to_texts(at, uploads)
            response = read_case(texts, uploads).simulate()
            chosen = np.flatnonzero((results.p == 3.0).values & (results.alpha == 0.2).values)[0]
            picked = results.isel(scale=scale, polarity=polarity, block=chosen, motion=0)
            assert response.block.gravity == 1.62
            assert response.peak_rotation == pytest.approx(float(picked.peak_rotation), rel=1e-9)
            judged += response.peak_rotation > 0.0
    assert judged == 6


def test_levels_of_a_study_are_an_axis_in_increasing_order(tmp_path):
    blocks, levels = rocking.Blocks.grid(p=[2.0, 3.0], alpha=[0.2], restitution=[0.9]), [3.0, 1.0, 2.0]
    made = rocking.create_study(tmp_path / "any", blocks, rocking.pulses.one_sine(2.2, 2.0), levels=levels)
    made.run()
    found = StudyView(tmp_path / "any").select({"x": "p", "y": "scale", "quantity": "peak_rotation"})
    assert found.header["y"]["values"] == [1.0, 2.0, 3.0]
    peaks = made.results().peak_rotation.transpose("scale", "motion", "block").values[[1, 2, 0], 0]
    assert np.array_equal(found.arrays["values"].reshape(3, 2), peaks) and len(np.unique(peaks)) > 3


@pytest.mark.parametrize("at", ["inf", "nan", "", "x"])
def test_a_point_beside_a_study_is_refused(study, at):
    with pytest.raises(OptionError, match="at_x must be a") as caught:
        study.point_to_texts({"x": "p", "y": "alpha", "at_x": at, "at_y": "0.2"}, UploadStore())
    assert caught.value.argument == "at_x"


@pytest.mark.parametrize("motion", [0, 1])
def test_a_point_of_a_study_has_the_polarity_that_is_chosen(study, motion):
    at = {"x": "p", "y": "alpha", "at_x": "3.5", "at_y": "0.2", "scale_index": "1", "motion_index": str(motion)}
    uploads = UploadStore()
    one, reversed_one = (
        read_case(study.point_to_texts({**at, "polarity_index": str(k)}, uploads), uploads).motion for k in (0, 1)
    )
    assert np.array_equal(reversed_one.coefficients, -one.coefficients)
    base = study.study.product.motions[motion]
    np.testing.assert_allclose(one.coefficients, base.coefficients * (one.pga / base.pga), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("scales", "label", "unit"),
    [
        ({"levels": [0.5, 1.0]}, "Factor of the motion", ""),
        ({"levels": [2.0, 4.0], "measure": "pga"}, "Peak ground acceleration", "m/s^2"),
        ({"levels": [0.2, 0.4], "measure": "pgv"}, "Peak ground velocity", "m/s"),
        ({"levels": [2.0, 4.0], "measure": rocking.Measure("sa", 0.5)}, "Spectral acceleration at 0.5 s", "m/s^2"),
    ],
)
def test_the_axis_of_scales_says_what_they_are(tmp_path, scales, label, unit):
    blocks = rocking.Blocks(p=[2.0, 3.0], alpha=0.2, restitution=0.9)
    rocking.create_study(tmp_path / "scaled", blocks, rocking.pulses.one_sine(3.0, 1.0), **scales).run()
    axis = next(one for one in StudyView(tmp_path / "scaled").describe()["axes"] if one["name"] == "scale")
    assert (axis["label"], axis["unit"]) == (label, unit)


def test_a_study_of_a_list_of_blocks_is_a_map_over_their_numbers(tmp_path):
    blocks = rocking.Blocks(p=[2.0, 3.0, 4.0], alpha=[[0.2, 0.25], [0.2, 0.2], [0.3, 0.3]], restitution=0.9)
    motions = [rocking.records.load(f"el-centro-meloland-{which}") for which in ("270", "360")]
    made = rocking.create_study(tmp_path / "list", blocks, motions, levels=[2.0, 4.0, 5.0], measure="pga")
    made.run()
    view = StudyView(tmp_path / "list")
    assert list(view.axes) == ["block", "scale", "motion", "polarity"]
    results = made.results()
    over_scales = view.select({"x": "block", "y": "scale", "quantity": "peak_rotation", "motion_index": "1"})
    expected = results.peak_rotation.isel(motion=1).transpose("scale", "block", ...).values.reshape(3, 3)
    assert np.array_equal(over_scales.arrays["values"].reshape(3, 3), expected)
    over_motions = view.select({"x": "motion", "y": "block", "quantity": "peak_rotation", "scale_index": "2"})
    expected = results.peak_rotation.isel(scale=2).transpose("block", "motion", ...).values.reshape(3, 2)
    assert np.array_equal(over_motions.arrays["values"].reshape(3, 2), expected)
    uploads = UploadStore()
    texts = view.point_to_texts({"x": "block", "y": "motion", "at_x": "1", "at_y": "2", "scale_index": "2"}, uploads)
    response = read_case(texts, uploads).simulate()
    assert response.peak_rotation == pytest.approx(over_motions.arrays["values"][1], rel=1e-12)


def test_a_study_that_varies_too_little_is_refused_with_a_sentence(tmp_path):
    motion = rocking.pulses.one_sine(3.0, 1.0)
    made = rocking.create_study(
        tmp_path / "few", rocking.Blocks(p=[2.0, 3.0], alpha=[0.2, 0.3], restitution=0.9), motion
    )
    made.run()
    with pytest.raises(StudyError, match="varies block; a map needs two of blocks, motions and scales"):
        StudyView(tmp_path / "few")


@pytest.mark.parametrize(
    "texts",
    [
        {"x": "p", "y": "p"},
        {"x": "p", "y": "mass"},
        {"x": "p", "y": "alpha", "quantity": "colour"},
        {"x": "p", "y": "alpha", "motion_index": "7"},
    ],
)
def test_a_slice_that_is_none_is_refused(study, texts):
    with pytest.raises(OptionError):
        study.select(texts)


def test_a_slice_of_more_points_than_a_map_may_have_is_refused(study, monkeypatch):
    axes = study.axes
    size = axes["p"].size * axes["alpha"].size
    for most, fits in ((size, True), (size - 1, False)):
        monkeypatch.setattr("rocking.explorer.studies._MAX_POINTS", most)
        if fits:
            assert study.select({"x": "p", "y": "alpha"}).arrays
        else:
            with pytest.raises(OptionError, match="points are too many for a map"):
                study.select({"x": "p", "y": "alpha"})


@pytest.mark.parametrize(
    "pulse", ["sine:amplitude=0.3g,frequency=1Hz,cycles=2", "one-sine:amplitude=0.4g,frequency=1Hz"]
)
def test_what_only_rounding_leaves_of_a_number_is_shown_as_zero(explorer, pulse):
    texts = {"width": "0.24", "height": "1.1", "motion": pulse}
    found = [page_answer(explorer, "at", texts, at=time)["ground_g"] for time in ("0", "0.25", "0.5", "1")]
    assert [abs(each) > 0.2 for each in found] == [False, True, False, False]
    assert [found[k] for k in (0, 2, 3)] == [0.0, 0.0, 0.0]
    drawn = np.abs(page_answer(explorer, "case", texts, (0.0, 1.0)).arrays["ground_g"])
    assert not np.any((drawn > 0.0) & (drawn < 1e-9))
    assert np.any(drawn == 0.0)
