"""Names of files and channels as a stranger may choose them, in the commands and scripts that the explorer writes."""

import ast
import itertools
import json
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from explorer_answers import page_answer

import rocking
from rocking.explorer.code import case_as_command, case_as_python
from rocking.explorer.core import Explorer
from rocking.explorer.inputs import read_case
from rocking.explorer.uploads import UploadStore, clean_file_name

BLOCK = {"width": "0.24", "height": "1.1"}
FILE = "time (s), a (g)\n" + "".join(f"{0.01 * k:.2f}, {0.3 * (-1) ** (k // 20)}\n" for k in range(100))

STARTS = ["-", "--", "-x", "--out=", "--help", "-1", "~", "@", "#", "=", "", "ü", "日本", "ridgecrest-clc-090", "sine:"]
MIDDLES = [
    "'", '"', "\\'", "'; touch hacked; '", "$(touch hacked)", "`touch hacked`", "a  b", "\ttouch hacked",
    "\ntouch hacked\n", "' + __import__('os').system('touch hacked') + '", '"""', "{file}%s", "*?[a]", "!!",
    "&& touch hacked", "\x00\x1b[2J\u202e",
]  # fmt: skip
NAMES = sorted(
    {start + middle + ".txt" for start, middle in itertools.product(STARTS, MIDDLES)} | {"-", "--", "'", "\n"}
)


def case_of(name, uploads, **texts):
    key = uploads.add_file(name, FILE.encode())
    return read_case({**BLOCK, "motion": f"file:{key}", **texts}, uploads)


def words_as_a_shell_reads_them(commands, folder):
    """Arguments of each command, by a shell in which `rocking` prints what it is given."""
    script = 'rocking() { printf "%s\\0" "$@"; printf "\\0"; }\n' + "\n".join(commands) + "\n"
    ran = subprocess.run(["sh", "-c", script], cwd=folder, capture_output=True, check=True)
    assert ran.stderr == b""
    return [part.decode().split("\0") for part in ran.stdout.split(b"\0\0")[:-1]]


@pytest.mark.skipif(sys.platform == "win32", reason="commands are written for the shells of POSIX")
# Every fifth name leaves all starts and all middles.
@pytest.mark.parametrize("every", [5, pytest.param(1, marks=pytest.mark.thorough)])
def test_hostile_names_of_files_are_one_argument_and_one_text(tmp_path, every):
    names = NAMES[::every]
    assert len(names) >= 150 / every
    cases = [case_of(name, UploadStore()) for name in names]  # in one store a content has one name
    found = words_as_a_shell_reads_them([case_as_command(case) for case in cases], tmp_path)
    assert len(found) == len(names)
    plain = ast.dump(ast.parse(case_as_python(case_of("x", UploadStore()))))
    for name, case, (command, file, *rest) in zip(names, cases, found, strict=True):
        kept = clean_file_name(name)
        assert (command, *rest) == ("simulate", "--width", "0.24", "--height", "1.1")
        assert Path(file) == Path(kept) and not file.startswith("-")
        script = ast.parse(case_as_python(case))
        (read,) = [
            node for node in ast.walk(script) if isinstance(node, ast.Call) and ast.unparse(node.func) == "rocking.read"
        ]
        assert ast.literal_eval(read.args[0]) == kept
        assert ast.dump(script).replace(repr(kept), repr("x")) == plain
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["-x.txt", "--out", "it's $(here).txt"])
def test_a_copied_command_reads_the_file_of_a_hostile_name(name, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(FILE, "utf-8")
    case = case_of(name, UploadStore())
    code, out, err = run(*shlex.split(case_as_command(case))[1:], "--json", "--quiet")
    assert (code, err) == (0, "")
    assert json.loads(out)["peak_rotation_rad"] == case.simulate().peak_rotation


def test_a_channel_named_like_an_option_is_none(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "time (s), --out (g), -up (g)\n" + "".join(
        f"{0.01 * k:.2f}, {0.3 * (-1) ** (k // 20)}, 0.1\n" for k in range(100)
    )
    (tmp_path / "two.txt").write_text(text, "utf-8")
    uploads = UploadStore()
    key = uploads.add_file("two.txt", text.encode())
    case = read_case({**BLOCK, "motion": f"file:{key}", "channel": "--out", "vertical": "-up"}, uploads)
    words = shlex.split(case_as_command(case))
    assert "--vertical=-up" in words and "--channel=--out" in words
    code, out, err = run(*words[1:], "--json", "--quiet")
    assert (code, err) == (0, "")
    assert json.loads(out)["peak_rotation_rad"] == case.simulate().peak_rotation


def test_the_name_of_a_motion_ends_no_comment():
    explorer = Explorer()
    motion = rocking.Motion.from_samples(np.sin(np.arange(50.0)), dt=0.02, name="x\nimport os\rimport sys\x0cy")
    texts = {**BLOCK, "motion": f"given:{explorer.uploads.add_motion(motion)}"}
    python = page_answer(explorer, "details", texts).header["python"]
    assert "# ximport osimport sysy: a motion of the study" in python
    assert len(ast.parse(python).body) == 6
