"""Motions of a study's file: records beside it or shipped, and pulses of every combination of their parameters."""

from __future__ import annotations

import fnmatch
import glob
import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rocking import records
from rocking.arrays import Floats
from rocking.ensemble import Scales
from rocking.errors import InvalidMotion, UnreadableRecord
from rocking.motion.motion import Motion
from rocking.named_pulses import pulse_family
from rocking.plausibility import motion_notes
from rocking.progress import note
from rocking.records.formats.source import Request
from rocking.records.named import expanded, is_there, named_motion
from rocking.studies.file.tables import Tables, read


def motions_of(tables: Tables, scales: Scales) -> tuple[list[Motion], list[str], list[str]]:
    """Motions that can be read and scaled, their records, and a sentence for each that cannot, if it may be so."""
    given = tables.table("motions")
    with tables.located("motions", key="dt"):
        Request.checked(given.get("dt"), None)
    with tables.located("motions", key="units"):
        Request.checked(None, given.get("units"))
    if "vertical" in given and not given.get("records"):
        raise tables.wrong("motions", "vertical", "{} is that of the records, and there are none", "vertical")
    found: dict[str, str] = {}  # by their paths or names, what stands for each in the file
    for name in given.get("records", []):
        with tables.located_record(name):
            found |= dict.fromkeys(_records_of(tables, name), name)
    motions, names, skipped = [], [], []
    for path, name in found.items():
        try:
            with tables.located_record(name):
                motion = _record(tables, path, several=len(found) > 1)
                scales.factors(motion)  # it can be scaled
        except (UnreadableRecord, InvalidMotion) as error:
            if not given.get("skip_unreadable", False):
                raise
            skipped.append(str(error))
        else:
            motions.append(motion)
            names.append(_as_written(tables, path))
    for k in range(len(given.get("pulses", []))):
        motions += _pulses(tables, k)
    if not motions:
        raise tables.wrong("motions", None, "[motions] holds no motion that can be read: name records or pulses")
    return motions, names + [""] * (len(motions) - len(names)), skipped


def _record(tables: Tables, path: str, *, several: bool) -> Motion:
    given = tables.table("motions")
    about = {"dt": given.get("dt"), "units": given.get("units")}
    channel = None if "channel" not in given else str(given["channel"])
    vertical = _beside(tables, given["vertical"]) if "vertical" in given else None
    motion = named_motion(path, vertical=vertical, channel=channel, several=several, **about)
    for sentence in motion_notes(motion):
        note(f"{path}: {sentence}")
    return motion


def _records_of(tables: Tables, name: str) -> list[str]:
    """Files beside the study's own, or shipped records, that a name, a folder or a pattern stands for."""
    parent = tables.file.parent
    path = str(parent / name)
    if is_there(path):
        return expanded([path])
    if not glob.has_magic(name):
        # A file of this name in the folder of the call is not meant; without one the name alone tells more.
        return [path if is_there(name) and name not in records.names() else name]
    try:
        return expanded([str(Path(glob.escape(str(parent))) / name)])
    except UnreadableRecord:
        shipped = fnmatch.filter(records.names(), name)
        if not shipped:
            raise
        return shipped


def _beside(tables: Tables, name: str) -> str:
    """Path of a file that lies beside the study's own, or the name of anything else."""
    path = str(tables.file.parent / name)
    return path if is_there(path) else name


def _as_written(tables: Tables, path: str) -> str:
    """Return the path of a record relative to the file, as it names those beside it."""
    beside = Path(path).is_relative_to(tables.file.parent) and is_there(path)
    return str(Path(path).relative_to(tables.file.parent)) if beside else path


def _pulses(tables: Tables, k: int) -> list[Motion]:
    pulse, table = dict(tables.table("motions.pulses", k)), "motions.pulses"
    with tables.located(table, key="family", occurrence=k):
        family = pulse_family(str(pulse.pop("family", "")))
    axes: dict[str, Sequence[Any] | Floats] = {}
    for key, value in pulse.items():
        with tables.located(table, key=key, occurrence=k):
            quantity = family.quantity(key)
            axes[key] = [value] if quantity is None else read(key, value, quantity)
    with tables.located(table, occurrence=k):
        return [family.motion(dict(zip(axes, values, strict=True))) for values in itertools.product(*axes.values())]
