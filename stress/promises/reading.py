"""Files of records and of studies, cut off at every byte or damaged otherwise: refused in a sentence, or read right.

A part takes every hundredth truncation of every fixture, and so many files that `oracles.damaged_files` makes.
What is read without a word is compared with what the file states, where `oracles.stated_records` can tell.
"""

from __future__ import annotations

import gzip
import io
import random
import tempfile
import time
import tracemalloc
import warnings
import zipfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final

from oracles import record_files
from oracles.damaged_files import damaged
from oracles.stated_records import READINGS, contradiction, stated

from promises.promise import Found, Promise
from rocking.analysis.hazard import HazardCurve
from rocking.calibration import tables as input_tables
from rocking.errors import RockingError
from rocking.records import formats
from rocking.records.formats import through_obspy
from rocking.records.formats.source import Request
from rocking.studies.file import TEMPLATE, read_study

#: Parts of the full run; a part takes the truncations whose number has its own as the rest.
PARTS: Final = 100

#: Spoilt files of a part; of each record file so many are of studies.
CASES: Final = 10_000
_OF_STUDIES: Final = 0.1

#: Processor time, s; memory, times the file's size, and what a small file may take in any case, bytes.
SECONDS, TIMES, ANYWAY = 2.0, 20, 2**24

#: Memory is traced in every so many-th case, and there again in every so many-th one of a file made long.
_TRACED, _LONG, _LONG_SIZE = 100, 30, 2_000_000

#: What a record is read with, and how often of ten.
_REQUESTS: Final[tuple[dict[str, Any], ...]] = ({}, {"units": "g"}, {"units": "gal", "dt": 0.005}, {"dt": 0.01})
_OFTEN: Final = (6, 1, 2, 1)

_STUDY: Final = """\
[blocks]
p = "1:6:5"
alpha = ["10deg", 0.2]
restitution = 0.9

[motions]
records = ["record.dat"]

[[motions.pulses]]
family = "one-sine"
amplitude = ["0.3g", "0.5g"]
frequency = [0.5, 1.0]

[scales]
pga = [0.5, "0.2g"]
polarity = "both"

[simulation]
model = "linear"
chattering = "certified=1e-9"
"""
_OF_TABLE: Final = (
    '[blocks]\ncsv = "blocks.csv"\n\n[[motions.pulses]]\nfamily = "one-sine"\namplitude = 2.0\nfrequency = 1.0\n'
)
_TABLES: Final = {
    "blocks.csv": "p,alpha,restitution\n2.0,0.2,0.9\n3.0,12deg,0.85\n4.5,0.15,0.9\n",
    "bodies.csv": "width,height,mass\n0.3,1.1,200\n0.4,2.0,500\n40cm,1.5,300\n",
    "tests.csv": (
        "motion,overturned,scale,peak_rotation_deg,group\nrecord.dat,0,0.5,1.5,a\n"
        '"one-sine:amplitude=0.2g,frequency=2Hz",1,2.0,inf,b\n'
    ),
    "history.csv": "time_s,rotation_rad\n0.0,0.0\n0.1,0.01\n0.2,-0.02\n0.3,0.005\n",
    "ensemble.csv": (
        "p_plus_rad_s,p_minus_rad_s,alpha_plus_rad,alpha_minus_rad,restitution_plus,restitution_minus,weight,model\n"
        "2.0,2.0,0.2,0.2,0.9,0.9,0.5,nonlinear\n2.1,2.1,0.21,0.21,0.9,0.9,0.5,nonlinear\n"
    ),
    "hazard.csv": "pga_g,annual_rate\n0.05,0.1\n0.1,0.02\n0.2,0.004\n0.4,0.0006\n",
}


@cache
def records() -> dict[str, bytes]:
    """Record files as they should be, by their names."""
    found = record_files.fixtures()
    one, two, three = (record_files.series(k) for k in (1, 2, 3))
    found["one.v2c"] = record_files.cosmos(one)
    rows = [(0.01 * k, *values) for k, values in enumerate(zip(one, two, three, strict=True))]
    found["three.csv"] = "time (s),N (cm/s2),E (gal),Z (m/s2)\n" + "".join(
        f"{t:.2f},{a:.4f},{b:.4f},{c / 100.0:.6f}\n" for t, a, b, c in rows
    )
    found["commas.csv"] = "time (ms);acc (cm/s2)\n" + "".join(f"{1e3 * t:.0f};{a:.4f}\n" for t, a, *_ in rows).replace(
        ".", ","
    )
    return {name: text.encode("latin-1") for name, text in found.items()}


@cache
def others() -> dict[str, bytes]:
    """Files of studies and analyses as they should be, by their names."""
    made = {"study.toml": _STUDY, "template.toml": TEMPLATE, **_TABLES}
    return {name: text.encode() for name, text in made.items()}


@cache
def _folder() -> Path:
    """Return a folder that goes with this process, with a record and the study that names a table of blocks."""
    folder = Path(_kept().name)
    (folder / "record.dat").write_bytes(records()["nga.at2"])
    (folder / "of-table.toml").write_text(_OF_TABLE, encoding="utf-8")
    return folder


@cache
def _kept() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory()


def read_record(name: str, content: bytes, given: dict[str, Any]) -> list[Any]:
    """Read a record as `rocking.read` does, and all channels as motions."""
    stream = io.BytesIO(content)
    stream.name = name
    found = formats.read_content(stream, Request.create(given.get("dt"), given.get("units")))[1]
    for each in found:
        each.motion()
    return found


def read_other(name: str, content: bytes) -> Any:
    """Read a file of a study or an analysis from its place."""
    folder = _folder()
    suffix = Path(name).suffix
    table = folder / ("blocks.csv" if name in ("blocks.csv", "bodies.csv") else name)
    table.write_bytes(content)
    if suffix == ".toml":
        return read_study(table).product
    if name in ("blocks.csv", "bodies.csv"):
        return read_study(folder / "of-table.toml").product
    if name == "hazard.csv":
        return HazardCurve.read(table)
    if name == "history.csv":
        return input_tables.read_calibration(table, channel=None, dt=None, units=None)
    return input_tables.read_ensemble(table) if name == "ensemble.csv" else input_tables.read_tests(table)


def judge(part: int) -> Found:
    """Judge the truncations and the damaged files of a part."""
    found, rng = Found(parts=1), random.Random(f"reading {part}")
    installed, through_obspy.is_obspy_installed = through_obspy.is_obspy_installed, lambda: False
    try:
        for number, (name, content) in enumerate(_cases(part, rng)):
            _judge_case(
                found, rng, f"{name}, case {number} of part {part}", name, content, traced=number % _TRACED == 0
            )
    finally:
        through_obspy.is_obspy_installed = installed
    return found


def _cases(part: int, rng: random.Random) -> Iterator[tuple[str, bytes]]:
    for name, content in {**records(), **others()}.items():
        for length in range(part, len(content), PARTS):
            yield name, content[:length]
        if part == 0:
            yield name, content
    for name, content in records().items():
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w") as archive:
            archive.writestr(name, content)
        for each in (gzip.compress(content, mtime=0), packed.getvalue()):
            yield name, damaged(each, rng) if part else each
    files = list(records().items()), list(others().items())
    for _ in range(CASES):
        name, content = rng.choice(files[rng.random() < _OF_STUDIES])
        yield name, damaged(content, rng)


def _judge_case(found: Found, rng: random.Random, what: str, name: str, content: bytes, *, traced: bool) -> None:
    is_record = name in records()
    given = {"dt": 0.01} if name == "column.txt" else rng.choices(_REQUESTS, _OFTEN)[0] if is_record else {}
    read: Callable[[], Any] = (
        (lambda: read_record(name, content, given)) if is_record else (lambda: read_other(name, content))
    )
    found.cases += 1
    found.judged += 1
    start = time.process_time()
    answer = _answer(found, what, read)
    seconds = time.process_time() - start
    found.worst = max(found.worst, seconds / SECONDS)
    if seconds > SECONDS:
        found.fail(f"{what}: {seconds:.1f} s of processor time")
    if traced and is_record:
        _judge_memory(found, what, read, len(content))
        found.notes["traced"] += 1
        if found.notes["traced"] % _LONG == 0:
            long = content + content[len(content) // 2 :] * (_LONG_SIZE // max(len(content), 1))
            _judge_memory(found, f"{what}, made long", lambda: read_record(name, long, given), len(long))
            found.notes["made long"] += 1
    found.notes["refused" if answer is None else "read"] += 1
    if answer is None or not is_record:
        return
    said = stated(name, content) if "units" not in given else None
    if said is None:
        return
    found.notes["compared"] += 1
    wrong = "another number of channels" if len(said) != len(answer) else ""
    for one, channel in zip(said, answer, strict=False):
        wrong = wrong or contradiction(one, channel.acceleration, channel.dt, channel.times)
    if wrong:
        found.fail(f"{what}: read without a word, and {wrong}")


def _answer(found: Found, what: str, read: Callable[[], Any]) -> Any:
    """Return what is read; None where it is refused in one sentence, or fails."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return read()
    except RockingError as error:
        text = str(error)
        if not text or "\n" in text or len(text) > 4000:
            found.fail(f"{what}: refused in {len(text)} characters: {text[:80]!r}")
    except Exception as error:
        found.fail(f"{what}: {type(error).__name__}: {str(error)[:200]}")
    return None


def _judge_memory(found: Found, what: str, read: Callable[[], Any], size: int) -> None:
    tracemalloc.start()
    try:
        _answer(found, what, read)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    most = max(TIMES * size, ANYWAY)
    found.worst = max(found.worst, peak / most)
    if peak > most:
        found.fail(f"{what}: {peak} bytes of memory for a file of {size}")


def table(found: Found) -> str:
    """Say how many were read, and how many of these could be compared."""
    counts = found.notes
    return (
        f"Of {found.cases} files {counts['refused']} were refused and {counts['read']} read; of these "
        f"{counts['compared']} say so clearly what they hold that it could be compared. Memory was traced for "
        f"{counts['traced']} files, and for {counts['made long']} of {_LONG_SIZE // 1_000_000} MB or more.\n"
    )


PROMISE = Promise(
    name="reading",
    says="a damaged file is refused, or read as it states",
    parts=PARTS,
    small=1,
    judge=judge,
    table=table,
    above=("cli", "explorer"),
)

assert set(READINGS) <= {*records()}
