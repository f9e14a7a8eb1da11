"""All commands that compute or write, each small enough for a second or two, and whether what they write is whole."""

from __future__ import annotations

import contextlib
import io
import json
import shutil
import tempfile
import zipfile
from functools import cache
from pathlib import Path
from typing import Final

import xarray as xr

from rocking.cli import main

_BLOCK: Final = ("--width", "0.24", "--height", "1.1")
_RECORD: Final = "el-centro-meloland-270"

_STUDY: Final = """\
[blocks]
p = "1:6:400"
alpha = [0.15, 0.2]
restitution = 0.9

[motions]
records = ["el-centro-meloland-270", "el-centro-meloland-360"]

[scales]
pga = "2:9:6"
"""
_INVENTORY: Final = "name,width (cm),height (m),room\nvase,24 +- 1,1.1,12\nstele,50,1.6,14\n"
_TESTS: Final = "motion,overturned,scale\n" + "".join(
    f"el-centro-meloland-270,{int(scale > 1.0)},{scale}\n" for scale in (0.3, 0.6, 0.9, 1.2, 1.5)
)

#: Commands by name; OUT is the folder for their files, and what they read lies beside it. STUDY is one that is done.
COMMANDS: Final[dict[str, tuple[str, ...]]] = {
    "simulate": ("simulate", _RECORD, *_BLOCK, "--out", "OUT"),
    "map": ("map", "one-sine", *_BLOCK, "--out", "OUT"),
    "spectrum": ("spectrum", _RECORD, "--alpha", "0.15,0.2", "--p", "1:6:20", "--out", "OUT"),
    "fragility": ("fragility", _RECORD, "ridgecrest-clc-090", *_BLOCK, "--levels", "0.1g:1g:19", "--out", "OUT"),
    "assess": ("assess", "inventory.csv", _RECORD, "ridgecrest-clc-090", "ridgecrest-tow2-360", "--out", "OUT"),
    "study run": ("study", "run", "study.toml", "OUT"),
    "calibrate": ("calibrate", "tests.csv", "--out", "OUT"),
    "validate": ("validate", "tests.csv", *_BLOCK, "--out", "OUT"),
    "check": ("check", _RECORD, *_BLOCK, "--out", "OUT"),
    "ida": ("ida", _RECORD, *_BLOCK, "--levels", "0.1g:1.5g:30", "--out", "OUT"),
    "measures": ("measures", _RECORD, "ridgecrest-clc-090", *_BLOCK, "--periods", "0.5,1", "--out", "OUT"),
    "chatter": ("chatter", "1.05", "0.7", "0.8", "--out", "OUT"),
    "critical": ("critical", "0.7", "0.8", "--out", "OUT"),
    "mesh": ("mesh", "statue", "--azimuth", "0,90", "--out", "OUT"),
    "page": ("page", "--out", "OUT/block.html"),
    "study new": ("study", "new", "OUT/study.toml"),
    "study create": ("study", "create", "study.toml", "OUT"),
    "study export": ("study", "export", "STUDY", "OUT/study.csv"),
    "study report": ("study", "report", "STUDY", "OUT"),
}

#: Commands that may take long, at sizes that people ask for.
LONG: Final = tuple(
    name
    for name in COMMANDS
    if name not in ("check", "chatter", "critical", "page", "study new", "study create", "study export")
)

#: Commands that only print.
PRINTING: Final[dict[str, tuple[str, ...]]] = {
    "records": ("records",),
    "pulses": ("pulses",),
    "study status": ("study", "status", "STUDY"),
    "study verify": ("study", "verify", "STUDY"),
    "version": ("--version",),
}


def arguments(name: str, folder: Path) -> list[str]:
    """Write what a command reads into a folder, and return its words."""
    words = [*(COMMANDS | PRINTING)[name]]
    (folder / "study.toml").write_text(_STUDY, encoding="utf-8")
    (folder / "tests.csv").write_text(_TESTS, encoding="utf-8")
    (folder / "inventory.csv").write_text(_INVENTORY, encoding="utf-8")
    if "STUDY" in words:
        shutil.copytree(_study(), folder / "study")
    if any(word.startswith("OUT/") for word in words):
        (folder / "out").mkdir()
    places = {"OUT": "out", "STUDY": "study", "study.toml": "study.toml", "tests.csv": "tests.csv"}
    for number, word in enumerate(words):
        first, slash, rest = word.partition("/")
        if first in places:
            words[number] = f"{folder / places[first]}{slash}{rest}"
    return words


@cache
def _study() -> Path:
    """Run the study, once in this process."""
    folder = Path(_kept().name)
    (folder / "study.toml").write_text(_STUDY, encoding="utf-8")
    status, said = called(["study", "run", str(folder / "study.toml"), str(folder / "study")])
    if status != 0:
        raise RuntimeError(said)
    return folder / "study"


@cache
def _kept() -> tempfile.TemporaryDirectory[str]:
    """Return a folder that goes with this process."""
    return tempfile.TemporaryDirectory()


def called(words: list[str]) -> tuple[int, str]:
    """Run a command in this process: exit status, and what it says on stderr but for notes."""
    errors, status = io.StringIO(), 0
    with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(io.StringIO()):
        try:
            main(words)
        except SystemExit as stop:
            status = int(stop.code or 0)
    said = [line for line in errors.getvalue().splitlines() if not line.startswith("rocking: note:")]
    return status, "\n".join(said)


def files(folder: Path) -> dict[str, bytes]:
    """Content of every file in a folder and below it."""
    found = sorted(path for path in folder.rglob("*") if path.is_file()) if folder.is_dir() else []
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


def faults(folder: Path, whole: dict[str, bytes]) -> list[str]:
    """Say which files of a folder are not whole, or are none that an undisturbed run (`whole`) leaves."""
    fault = {name: _fault(folder / name, name, content, whole) for name, content in files(folder).items()}
    return [each for each in fault.values() if each]


def _fault(path: Path, name: str, content: bytes, whole: dict[str, bytes]) -> str:
    if Path(name).name == "lock":
        return ""
    if name not in whole:
        return f"{name} is left"
    try:
        return "" if _opens(path, content, whole[name]) else f"{name} is not whole"
    except (OSError, ValueError) as error:
        return f"{name} does not open: {error}"


def _opens(path: Path, content: bytes, whole: bytes) -> bool:
    """Whether a file is what an undisturbed run writes; formats that hold the time of writing are opened."""
    match path.suffix:
        case ".png":
            return content.endswith(b"IEND\xaeB\x60\x82")
        case ".pdf":
            return content.rstrip().endswith(b"%%EOF")
        case ".nc":
            with xr.open_dataset(path, engine="h5netcdf") as dataset:
                return bool(dataset.load().sizes is not None)
        case ".html":
            return content.endswith(b"</html>\n")
        case ".xlsx":
            return zipfile.ZipFile(path).testzip() is None
        case ".json":
            return isinstance(json.loads(content), (dict, list))
        case ".jsonl":
            return all(json.loads(line) for line in content.splitlines())
        case _:
            return content == whole
