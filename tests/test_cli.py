"""The command line: results, files, exit codes, and one line for every mistake."""

import inspect
import itertools
import json
import os
import re
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

import rocking
from rocking import cli
from rocking.cli import app
from rocking.core.threads import map_in_threads
from rocking.errors import INTERRUPT_MESSAGE

BLOCK = ["--half-width", "0.12", "--half-height", "0.55"]
RECORD = "el-centro-meloland-270"


def test_simulate_json_is_the_response(run):
    code, out, _ = run(
        "simulate", RECORD, "--p", "2.5,2.2", "--alpha", "0.12,0.2", "--restitution", "0.9,0.85", "--json"
    )
    assert code == 0
    result = json.loads(out)
    import rocking

    block = rocking.Block.from_parameters((2.5, 2.2), (0.12, 0.2), (0.9, 0.85))
    response = rocking.simulate(block, rocking.records.load(RECORD))
    assert result["peak_rotation_rad"] == response.peak_rotation
    assert [event["time_s"] for event in result["events"]] == list(response.events["time"])
    assert result["overturn_time_s"] is None or response.overturned


#: Commands, their arguments, and the files that they write beside result.json; a folder of figures has both kinds.
FILES = {
    "simulate": (
        [RECORD, *BLOCK, "--energy"], "response.csv events.csv impacts.csv response.nc response phase-plane energy",
    ),
    "spectrum": ([RECORD, "--alpha", "0.1:0.4:6", "--p", "2,3"], "fractiles.csv peaks.csv spectrum.nc spectrum"),
    "map": (
        ["ricker", "--kind", "antisymmetric", *BLOCK, "--amplitudes", "0.5:8:9", "--frequencies", "2:5:4"],
        "boundaries.csv modes.csv map.nc map",
    ),
    "ida": ([RECORD, *BLOCK, "--levels", "1:6:6"], "bands.csv levels.csv ida.nc ida"),
    "fragility": (
        [RECORD, "ridgecrest-clc-090", *BLOCK, "--levels", "1:6:9", "--limit-states", "half=0.5,overturning"],
        "fragility.xml fragility.csv outcomes.csv fragility",
    ),
    "chatter": (["1.03", "2", "0.92"], "impacts.csv cycles.csv chatter"),
    "chatter without loss": (["1.03", "2", "1"], "impacts.csv chatter"),
    "mesh": (["statue", "--azimuth", "0:165:12"], "rose.csv rose.nc support.csv blocks.csv rose"),
}  # fmt: skip


@pytest.mark.cases(fast=3)
@pytest.mark.parametrize("command", FILES)
def test_a_command_writes_what_it_says(run, tmp_path, request, command):
    drawn = {"spectrum", "chatter without loss"}  # figures of the others are made, and not drawn
    if command not in drawn:
        request.getfixturevalue("undrawn")
    arguments, names = FILES[command]
    code, out, err = run(command.split()[0], *arguments, "--out", tmp_path / "new" / "folder")
    assert (code, err.count("rocking: note")) == (0, err.count("\n"))
    expected = {"result.json"}
    for name in names.split():
        expected |= {name} if "." in name else {f"{name}.png", f"{name}.pdf"}
    assert {path.name for path in (tmp_path / "new" / "folder").iterdir()} == expected
    assert all(name in out for name in expected)


@pytest.mark.parametrize("command", ["simulate", "spectrum", "map", "ida", "fragility"])
def test_a_folder_that_cannot_be_written_to_is_refused_before_work(run, tmp_path, command):
    blocked = tmp_path / "file"
    blocked.write_text("")
    block = ["--alpha", "0.2", "--p", "2"] if command == "spectrum" else BLOCK
    code, out, err = run(command, "half-sine" if command == "map" else RECORD, *block, "--out", blocked / "results")
    assert (code, out) == (2, "")
    assert "--out" in err


def test_scale_and_treatments_are_passed_on(run):
    _, out, _ = run("simulate", RECORD, *BLOCK, "--scale", "0.01", "--json")
    assert json.loads(out)["events"] == []
    _, out, _ = run("simulate", RECORD, *BLOCK, "--chattering", "velocity=1e-6", "--json")
    assert "VelocityThreshold(threshold=1e-06)" in out


def test_records_lists_what_ships(run):
    code, out, _ = run("records", "--json")
    assert code == 0
    listed = {entry["name"]: entry for entry in json.loads(out)["records"]}
    assert listed["ridgecrest-clc-090"]["pga_g"] == pytest.approx(0.344, abs=1e-3)
    assert "ridgecrest-clc-090" in run("records")[1]


def test_records_shows_what_a_file_was_taken_for(run, tmp_path):
    file = tmp_path / "motion.txt"
    file.write_text("0.0 0.0\n0.01 0.2\n0.02 -0.1\n")
    code, out, _ = run("records", file, "--units", "g")
    assert code == 0
    assert "text table, since" in out
    assert "0.2" in out


def test_a_closed_pipe_is_no_traceback(run, monkeypatch):
    reader, writer = os.pipe()
    os.close(reader)
    with open(writer, "w") as closed, monkeypatch.context() as patched:  # noqa: PTH123
        patched.setattr(sys, "stdout", closed)
        assert run("records") == (0, "", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device that is always full")
@pytest.mark.parametrize("is_small", [True, False])
def test_a_full_disk_behind_the_output_is_one_sentence(run, monkeypatch, is_small):
    """What is printed is written when it is much (here at once), or else at the end; closing it fails no more."""
    said = "rocking: the output cannot be written: No space left on device; redirect it to another disk\n"
    with open("/dev/full", "w", 8192 if is_small else 64) as full, monkeypatch.context() as patched:  # noqa: PTH123
        full.reconfigure(write_through=not is_small)
        patched.setattr(sys, "stdout", full)
        assert run("pulses") == (2, "", said)


@pytest.mark.thorough
def test_an_interrupt_while_the_command_line_is_imported_is_no_traceback():
    for raised, code in (("KeyboardInterrupt", 130), ("RuntimeError('another one')", 1)):
        probe = (
            "import sys\n"
            "class Interrupted:\n"
            "    def find_spec(self, name, path=None, target=None):\n"
            "        if name == 'cyclopts':\n"
            f"            raise {raised}\n"
            "sys.meta_path.insert(0, Interrupted())\n"
            "from rocking.__main__ import main\n"
            "main()\n"
        )
        done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=False)
        assert done.returncode == code
        assert (done.stderr == f"{INTERRUPT_MESSAGE}\n") == (code == 130)
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))
    assert project["project"]["scripts"]["rocking"] == "rocking.__main__:main"
    done = subprocess.run([sys.executable, "-m", "rocking", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == rocking.__version__


def test_the_end_of_python_need_not_look_through_all_objects():
    """That takes up to a second, after a command as after an interrupt."""
    probe = (
        "import atexit, gc, sys\n"
        "atexit.register(lambda: print(gc.get_freeze_count() > 10 * len(gc.get_objects())))\n"
        "sys.argv = ['rocking', '--version']\n"
        "from rocking.__main__ import main\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [rocking.__version__, "True"]


def test_an_interrupt_is_one_sentence_and_closes_what_is_half_done(monkeypatch, capsys):
    """Work in threads that a traceback holds would be done to its end before the program is over."""
    begun = []

    def run(_):
        rocking.set_options(threads=2)
        for _ in map_in_threads(lambda each: (begun.append(each), time.sleep(0.01)), itertools.count()):
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(cli, "_run_command", run)
    with pytest.raises(SystemExit) as ended:
        cli.main([])
    count = len(begun)
    assert ended.value.__context__ is None
    assert (ended.value.code, capsys.readouterr().err) == (130, f"{INTERRUPT_MESSAGE}\n")
    time.sleep(0.05)
    assert len(begun) == count < 10
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("interrupted", [True, False])
def test_an_error_in_place_of_an_interrupt_is_one(run, monkeypatch, interrupted):
    def called(*_):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            if interrupted:
                raise RuntimeError("release unlocked lock")  # noqa: B904 - as Python itself does
        raise ValueError("of its own")

    monkeypatch.setattr("rocking.cli.find_command", called)
    if interrupted:
        assert run("records") == (130, "", f"{INTERRUPT_MESSAGE}\n")
    else:
        with pytest.raises(ValueError, match="of its own"):
            run("records")


@pytest.mark.parametrize("dropped", ["KeyboardInterrupt", "KeyError"])
def test_an_interrupt_that_python_drops_comes_again(dropped):
    probe = (
        "import sys, time\n"
        "from rocking import cli\n"
        "from rocking.__main__ import main\n"
        "class Dropping:\n"
        "    def __del__(self):\n"
        f"        raise {dropped}\n"
        "def run(_):\n"
        "    Dropping()\n"
        f"    time.sleep({60.0 if dropped == 'KeyboardInterrupt' else 0.1})\n"
        "cli._run_command = run\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=False, timeout=50.0)
    if dropped == "KeyboardInterrupt":
        assert (done.returncode, done.stderr) == (130, f"{INTERRUPT_MESSAGE}\n")
    else:
        assert done.returncode == 0 and "KeyError" in done.stderr


def test_help_starts_without_the_heavy_libraries():
    probe = (
        "import sys\nfrom rocking.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "print(sorted({'numba', 'scipy', 'xarray', 'matplotlib'} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, env=os.environ, check=True)
    assert done.stderr.strip() == "[]"


COMMANDS = [name for name in app if not name.startswith("-") and name != "study"]


def test_the_list_of_commands_has_a_line_for_each(run):
    code, out, _ = run("--help")
    assert code == 0
    assert all(f"│ {command} " in out for command in [*COMMANDS, "study"])
    lines = " ".join(re.sub(r"[│╭╰─╮╯]", " ", out).split())
    for command in COMMANDS:  # the first line of what its own help says
        assert f"{command} {inspect.getdoc(app[command].default_command).splitlines()[0]}" in lines
