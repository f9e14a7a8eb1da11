"""Motions as arguments, by name or from record files."""

from __future__ import annotations

import csv
import fnmatch
import glob
import itertools
import os
import re
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from rocking.core import checks
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.progress import note
from rocking.errors import MotionError, OptionError, RecordError
from rocking.motion.motion import Motion
from rocking.records import catalogue, formats
from rocking.records.formats.channel import remove_baseline
from rocking.records.formats.source import Request, list_archive, split_archive

#: One motion, several, or a mapping from names to motions.
Motions = Motion | Mapping[str, Motion] | Sequence[Motion]


def check_motion(motion: Motion | None) -> Motion | None:
    """Return a motion (None is free rocking), or raise an error."""
    if motion is not None and not isinstance(motion, Motion):
        raise MotionError(_describe_wrong_type(motion))
    return motion


def list_motions(motions: Motions) -> list[Motion]:
    """Return one motion or several as a list, renamed by the keys of a mapping."""
    if isinstance(motions, Mapping):
        unnamed = list_motions([*motions.values()])
        return [replace(motion, name=name) for name, motion in zip(motions, unnamed, strict=True)]
    is_iterable = isinstance(motions, Iterable) and not isinstance(motions, (Motion, str, Path, np.ndarray))
    gathered: list[Any] = list(cast(Any, motions)) if is_iterable else [motions]
    if not gathered:
        raise OptionError("{} must contain at least one motion", "motions")
    for motion in gathered:
        if not isinstance(motion, Motion):
            raise MotionError(_describe_wrong_type(motion))
    return gathered


def index_motions(motions: Motions) -> dict[str, Motion]:
    """Return motions by the names of a mapping, or else by their own."""
    motion_list = list_motions(motions)
    if isinstance(motions, Mapping):
        return dict(motions)
    return dict(zip(list_motion_names(motion_list), motion_list, strict=True))


def list_motion_names(motions: Sequence[Motion]) -> list[str]:
    """Return distinct names of motions, numbered if necessary."""
    return make_names_unique([motion.name for motion in motions])


def make_names_unique(names: Sequence[str]) -> list[str]:
    """Return names, with repeated ones numbered."""
    repeated = {name for name, count in Counter(names).items() if count > 1}
    used = {*names}
    unique = []
    for name in names:
        candidates = (f"{name} #{k}" for k in itertools.count(1))
        unique.append(next(choice for choice in candidates if choice not in used) if name in repeated else name)
        used.add(unique[-1])
    return unique


def _describe_wrong_type(value: Any) -> str:
    advice = "load one with rocking.read(file) or rocking.records.load(name), or use Motion.from_samples(array, dt)"
    return f"a Motion is required, not {checks.short_repr(value)}; {advice}, in m/s^2 and s"


#: Name of a record with a factor.
_FACTOR_PATTERN = re.compile(r"(?s)(.+) x ([+-]?\d[\d.]*(?:[eE][+-]?\d+)?)")

#: Name of the vertical component of the same station, for pairs.
OWN = "own"

#: Name of a record on standard input.
STANDARD_INPUT = "-"

_NO_REQUEST = Request()


def load_motion(name: str, request: Request = _NO_REQUEST, vertical_name: str | None = None) -> Motion:
    """Return the motion of a record file ("-" is standard input), or of a shipped record if no file exists.

    A name may end with a factor, as in "a.at2 x 1.5".
    """
    if vertical_name is not None and _is_file_or_record(vertical_name):
        request = replace(request, are_defaults=True)
    name, factor = split_factor(name)
    if is_shipped(name):
        reject_redundant_arguments(name, request)
        motion = correct_motion(name, catalogue.load(name), request)
    else:
        channel = formats.read_channel(sys.stdin.buffer if name == STANDARD_INPUT else name, request)
        motion = correct_motion(name, channel.motion("none"), request, is_raw=channel.is_raw)
    if vertical_name is not None:
        motion = motion.with_vertical(load_vertical(vertical_name, name, request))
    return motion if factor == 1.0 else motion.scaled(factor)


def correct_motion(name: str, original: Motion, request: Request, *, is_raw: bool = False) -> Motion:
    """Return a motion without its baseline and high-pass filtered, with a note on the change of the peak."""
    motion = remove_baseline(original, request.baseline, request.highpass, is_raw=is_raw)
    if motion is not original:
        texts = [f"{item.pga:.4g} m/s^2 ({item.pga / STANDARD_GRAVITY:.4g} g)" for item in (original, motion)]
        note(f"{name}: {' and '.join(motion.history)}, which changes the peak acceleration from {' to '.join(texts)}")
    return motion


def split_factor(name: str) -> tuple[str, float]:
    """Return the name and the factor of a record such as "a.at2 x 1.5"."""
    match = None if os.path.exists(name) else _FACTOR_PATTERN.fullmatch(name)  # noqa: PTH110 - see `path_exists`
    return (match[1], float(match[2])) if match else (name, 1.0)


def load_vertical(name: str, record: str, request: Request) -> Motion:
    """Return a vertical motion by name: a file, a shipped record, or else a channel of the horizontal file."""
    if _is_file_or_record(name):
        return load_motion(name, replace(request, channel=None, are_defaults=True))
    if record == STANDARD_INPUT or not path_exists(record):
        text = f"there is no file or shipped record {name!r} for the vertical motion, and {record} has no channels"
        raise RecordError(f"{text}; check the name")
    channels = formats.read_content(record, replace(request, channel=None))[1]
    found = formats.find_channel(record, channels, name, "channel, file or shipped record")
    return found.motion(request.baseline, request.highpass)


def _is_file_or_record(vertical: str) -> bool:
    """Return whether a vertical motion is a file or shipped record, not a channel of the horizontal file."""
    is_file = os.path.isfile(vertical) or split_archive(vertical) is not None  # noqa: PTH113 - see `path_exists`
    return is_file or vertical in catalogue.names()


def reject_redundant_arguments(name: str, request: Request) -> None:
    """Raise an error if an argument specifies a property of a shipped record."""
    arguments = {"channel": request.channel, "dt": request.dt, "units": request.unit}
    for argument in (key for key, value in arguments.items() if value is not None and not request.are_defaults):
        text = "a shipped record has one channel, with known step and units; omit {}"
        raise RecordError(text, argument, path=name)


def path_exists(name: str | Path) -> bool:
    """Return whether a file (also in a ZIP archive, or with a factor) or folder exists (False for overlong names)."""
    name, _ = split_factor(str(name))
    return os.path.exists(name) or split_archive(name) is not None  # noqa: PTH110 - Path.exists() raises then


def is_shipped(name: str) -> bool:
    """Return whether a name refers to a shipped record and not to a file."""
    return name in catalogue.names() and not path_exists(name)


def expand_record_names(names: Iterable[str]) -> list[str]:
    """Return the distinct record names from files, folders, patterns and shipped records."""
    return list(dict.fromkeys(itertools.chain.from_iterable(map(_find_records, names))))


def _find_records(name: str) -> list[str]:
    if os.path.isdir(name):  # noqa: PTH112 - see `path_exists`
        matches = sorted(str(path) for path in Path(name).iterdir() if path.is_file() and not path.name.startswith("."))
    elif not glob.has_magic(name) or path_exists(name):
        matches = [name]
    else:
        matches = sorted(path for path in glob.glob(name, recursive=True) if Path(path).is_file())  # noqa: PTH207 - any root
        matches = matches or fnmatch.filter(catalogue.names(), name)
    if not matches:
        raise RecordError("no file or shipped record matches this name; check the folder and the name", path=name)
    return [record for match in matches for record in (_unfold(match) or [match])]


def _unfold(name: str) -> list[str]:
    """Return the records in a ZIP archive, or those of a selection with factors, or none for another file."""
    suffix = Path(name).suffix.lower() if os.path.isfile(name) else ""  # noqa: PTH113 - see `path_exists`
    if suffix != ".csv":
        return list_archive(name) if suffix == ".zip" else []
    with Path(name).open(encoding="utf-8-sig", errors="replace", newline="") as file:
        text = file.read(2**20)
    rows = csv.reader(text.splitlines(), delimiter=";" if text.count(";") > text.count(",") else ",")
    for row in rows:
        heading = [cell.strip().lower() for cell in row]
        files = [k for k, cell in enumerate(heading) if re.search("file|^record$", cell) and "vert" not in cell]
        factors = [k for k, cell in enumerate(heading) if re.search("scale|scaling|^factor$", cell)]
        if files and factors:
            # A blank line ends the selection.
            selected = itertools.takewhile(lambda row: any(map(str.strip, row)), rows)
            return [record for row in selected for record in _scale_files(name, rows.line_num, row, files, factors[0])]
    return []


def _scale_files(name: str, line: int, row: list[str], file_columns: list[int], factor_column: int) -> Iterator[str]:
    """Yield the files in a row of a selection with their factor."""
    text = row[factor_column].strip() if len(row) > factor_column else ""
    if not _FACTOR_PATTERN.fullmatch(f"- x {text}"):
        raise RecordError(f"the scale factor must be a number; got {text!r}", path=name, line=line, value=text)
    for cell in (row[k].strip() for k in file_columns if len(row) > k and row[k].strip()):
        sibling = str(Path(name).parent / cell)
        yield f"{sibling if path_exists(sibling) else cell} x {text}"
