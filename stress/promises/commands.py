"""The long commands, each small enough for a second or two, and how to tell whether what they write is whole."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import xarray as xr

_BLOCK: Final = ("--width", "0.24", "--height", "1.1")
_RECORD: Final = "el-centro-meloland-270"
_SINE: Final = "sine:amplitude=0.3g,frequency=2Hz"

_STUDY: Final = """\
[blocks]
p = "1:6:400"
alpha = [0.15, 0.2]
restitution = 0.9

[motions]
records = ["el-centro-meloland-270", "el-centro-meloland-360"]

[scales]
pga = "2:9:6"

[report.fragility]
measure = "pga"
blocks = "together"
"""
_TESTS: Final = "motion,overturned,scale\n" + "".join(
    f"el-centro-meloland-270,{int(scale > 1.0)},{scale}\n" for scale in (0.3, 0.6, 0.9, 1.2, 1.5)
)

#: What a study writes of its own runs; half a line there is passed over.
_JOURNALS: Final = ("lock", "runs.jsonl")

#: Commands by name; OUT is the folder for their files, and what they read lies beside it.
COMMANDS: Final[dict[str, tuple[str, ...]]] = {
    "simulate": ("simulate", _RECORD, *_BLOCK, "--out", "OUT"),
    "map": ("map", "one-sine", *_BLOCK, "--out", "OUT"),
    "spectrum": ("spectrum", _RECORD, "--alpha", "0.15,0.2", "--p", "1:6:20", "--out", "OUT"),
    "fragility": ("fragility", _RECORD, "ridgecrest-clc-090", *_BLOCK, "--levels", "0.1g:1g:19", "--out", "OUT"),
    "study run": ("study", "run", "study.toml", "OUT"),
    "paper": ("paper", "--figure", "5", "--out", "OUT"),
    "orbits": ("orbits", *_BLOCK, "--pulse", _SINE, "--out", "OUT"),
    "calibrate": ("calibrate", "tests.csv", "--out", "OUT"),
    "validate": ("validate", "tests.csv", *_BLOCK, "--out", "OUT"),
}


def inputs(folder: Path) -> None:
    """Write what the commands read."""
    (folder / "study.toml").write_text(_STUDY, encoding="utf-8")
    (folder / "tests.csv").write_text(_TESTS, encoding="utf-8")


def files(folder: Path) -> dict[str, bytes]:
    """Content of every file in a folder and below it."""
    found = sorted(path for path in folder.rglob("*") if path.is_file()) if folder.is_dir() else []
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


def faults(folder: Path, whole: dict[str, bytes]) -> list[str]:
    """Say which files of a folder are not whole, or are none that an undisturbed run (`whole`) leaves."""
    return [fault for name, content in files(folder).items() if (fault := _fault(folder / name, name, content, whole))]


def _fault(path: Path, name: str, content: bytes, whole: dict[str, bytes]) -> str:
    if Path(name).name in _JOURNALS:
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
        case ".json":
            return isinstance(json.loads(content), (dict, list))
        case ".jsonl":
            return all(json.loads(line) for line in content.splitlines())
        case _:
            return content == whole
