"""Standalone page: one HTML file with the kernels as WebAssembly and some records, without a server.

The page consists of modules in `page/standalone` and of modules that it shares with the explorer. All numbers of the
computation come from the package when the file is written: layouts of records, codes, settings, pulses, gravity.
"""

from __future__ import annotations

import base64
import gzip
import json
import math
import re
from collections.abc import Mapping, Sequence
from enum import IntEnum
from importlib import resources
from itertools import product
from pathlib import Path, PurePosixPath
from typing import Any, Final
from urllib.parse import parse_qsl

import numpy as np

from rocking import pulses
from rocking.block import Block
from rocking.core.constants import MODELS, STANDARD_GRAVITY, VERSION
from rocking.engine.schemes import Certified, VelocityThreshold
from rocking.engine.tasks import STEP_BUDGET, STEP_BUDGET_PER_PIECE, STEPS_PER_SLICE, Setup
from rocking.errors import KernelsError, OptionError, RockingError, escape_braces
from rocking.explorer.inputs import read_case
from rocking.explorer.simulated import MAX_DRAWN_PERIOD
from rocking.explorer.uploads import UploadStore
from rocking.kernels import compiled, ground, library, state
from rocking.motion.motion import Motion
from rocking.records.catalogue import info, load, read_differences
from rocking.records.units import choose_unit

#: Records in the page by default: a near-fault pulse, and the long record of the tutorials.
RECORD_NAMES: Final = ("el-centro-meloland-270", "ridgecrest-clc-090")

#: Pulses in the page by name, besides sines of several cycles.
PULSE_NAMES: Final = ("one-sine", "one-cosine", "half-sine", "rectangular", "triangular", "ricker")

#: Largest size of the compressed file, bytes.
MAX_SIZE: Final = 600_000

#: Parts of an address that the page reads.
_READ_NAMES: Final = (
    "width", "height", "offset", "restitution", "motion", "pga", "initial_rotation", "chattering", "model", "ask",
)  # fmt: skip

#: Sampling step, s, and unit, m, of the displacement of a record, which is only drawn.
_DRAWN_STEP: Final = 0.04
_DRAWN_UNIT: Final = 1e-4

_KERNEL_NAMES: Final = {"march": "march.march", "trace": "trace.trace", "write_pieces": "ground.write_pieces"}
_IMPORT: Final = re.compile(r'^import \{[^}]*\} from "([^"]+)";\n', re.MULTILINE)


def build_page(names: Sequence[str] = RECORD_NAMES, exercises: Path | None = None, *, served: bool = False) -> str:
    """Create the page with these shipped records, and the links of a class, as HTML text.

    A page that the explorer's server sends (``served``) leads to the explorer, whose link it redeems.

    Raises
    ------
    OptionError
        If a record is unknown, the page would be too large, or this installation has no WebAssembly.
    """
    data = describe_computation(names) | {
        "tours": [tour for tour in json.loads(_read("standalone/tours.json")) if _uses_only(tour, names)],
        "class": None if exercises is None else read_exercises(exercises, names),
        "served": served,
    }
    core, seen = _bundle("standalone/jobs.js", [])
    parts = {
        "STYLE": _read("colours.css") + _read("standalone/style.css"),
        "DATA": json.dumps(data, separators=(",", ":")).replace("<", "\\u003c"),
        "CORE": core,
        "APP": _bundle("standalone/main.js", seen)[0],
        "MORE": '<a id="more" href="/">Records and studies</a>' if served else "",
    }
    html = _read("standalone/index.html").replace("CONNECT", "'self'" if served else "'none'")
    page = re.sub(r"/\*([A-Z]+)\*/", lambda match: parts[match[1]], html)
    size = len(gzip.compress(page.encode()))
    if size > MAX_SIZE:
        limit = f"at most {MAX_SIZE // 1000} kB compressed, but would have {size // 1000} kB"
        raise OptionError(f"the page must have {limit}; choose fewer or shorter {{}}", "records")
    return page


def is_available() -> bool:
    """Whether this installation has the WebAssembly of the page."""
    return bool(library.read_manifest().get("page"))


def read_exercises(path: Path, names: Sequence[str] = RECORD_NAMES) -> list[dict[str, str]]:
    """Read the links of a class: in each line words, and at its end the address of a case; or a heading alone.

    Raises
    ------
    OptionError
        If the file cannot be read, or the page cannot show a case.
    """
    try:
        lines = path.read_text("utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise OptionError(f"this list of links cannot be read ({error})", path=str(path)) from error
    entries = []
    for number, line in enumerate(lines, start=1):
        words, link = line.split(), ""
        if words and "=" in words[-1]:
            link = words.pop()
        try:
            case = {"case": _check_case(link, names)} if link else {}
        except RockingError as error:
            raise OptionError(escape_braces(str(error)), path=str(path), line=number) from error
        if words or case:
            entries.append({"words": " ".join(words).lstrip("# ") or link, **case})
    return entries


def _check_case(link: str, names: Sequence[str]) -> str:
    """Return the case of a link after checking that the page can show it."""
    case = link.partition("#")[2] or link.rpartition("?")[2]
    texts = dict(parse_qsl(case))
    unknown = texts.keys() - _READ_NAMES
    if unknown:
        raise OptionError(f"the page cannot show {min(unknown)!r}; it shows {', '.join(_READ_NAMES)}")
    texts.pop("ask", None)
    motion = texts.get("motion", "none").partition(":")[0]
    if motion not in ("none", "sine", *PULSE_NAMES, *names):
        raise OptionError(f"the page has no motion named {motion!r}; it has sine, {', '.join((*PULSE_NAMES, *names))}")
    read_case(texts, UploadStore())
    return case


def _uses_only(tour: Mapping[str, Any], names: Sequence[str]) -> bool:
    """Whether the records of all cases of a tour are in the page."""
    cases = (dict(parse_qsl(step.get("case", "")))["motion"] for step in tour["steps"] if "case" in step)
    return all(":" in motion or motion in names for motion in cases)


def describe_computation(names: Sequence[str] = RECORD_NAMES) -> dict[str, Any]:
    """Describe kernels, records and motions for the modules of the page."""
    sample = ground.build_ground(np.zeros(1), np.zeros((0, 2)), 1.0 / STANDARD_GRAVITY, 0.0)
    return {
        "version": VERSION,
        "fingerprint": compiled.fingerprint(),
        "gravity": STANDARD_GRAVITY,
        "wasm": base64.b64encode(_read_webassembly()).decode(),
        "calls": {name: _describe_call(kernel) for name, kernel in _KERNEL_NAMES.items()},
        "layouts": {
            name: _describe_layout(kind)
            for name, kind in (
                ("block", state.BLOCK_DTYPE), ("settings", state.SETTINGS_DTYPE), ("state", state.STATE_DTYPE),
                ("table", state.TABLE_DTYPE), ("scratch", state.SCRATCH_DTYPE), ("node", state.NODE_DTYPE),
            )
        },
        "templates": _build_templates(),
        "statuses": _list_codes(state.MarchStatus),
        "events": _list_codes(state.EventKind),
        "ground": {"first": sample.first_column, "stretch": ground.PIECES_PER_STRETCH, "unit": sample.g_per_unit},
        "budget": {"slice": STEPS_PER_SLICE, "total": STEP_BUDGET, "per_piece": STEP_BUDGET_PER_PIECE},
        "pulses": {name: _describe_pulse(getattr(pulses, name.replace("-", "_"))(1.0, 1.0)) for name in PULSE_NAMES},
        "records": {name: _describe_record(name) for name in names},
    }  # fmt: skip


def _read(path: str) -> str:
    return (resources.files("rocking.explorer") / "page" / path).read_text("utf-8")


def _bundle(path: str, seen: list[str]) -> tuple[str, list[str]]:
    """Join a module and all that it imports into one script, without the modules already seen."""
    text, parts = _read(path), []
    for name in _IMPORT.findall(text):
        imported = str(PurePosixPath(path).parent / name).replace("standalone/../", "").replace("/./", "/")
        if imported not in seen:
            part, seen = _bundle(imported, [*seen, imported])
            parts.append(part)
    return "".join([*parts, re.sub(r"^export ", "", _IMPORT.sub("", text), flags=re.MULTILINE)]), [*seen, path]


def _read_webassembly() -> bytes:
    entry = library.read_manifest().get("page")
    if not entry:
        raise OptionError(
            "this installation of rocking has no WebAssembly for the page, because ziglang was not available when it "
            "was built; install rocking again where ziglang can be installed, and without ROCKING_PAGE=0"
        )
    try:
        return (library.FOLDER / str(entry["file"])).read_bytes()
    except OSError as error:
        raise KernelsError(f"the WebAssembly of the page cannot be read ({error}); install rocking again") from error


def _describe_call(kernel: str) -> dict[str, str]:
    """Return the symbol of a kernel, and the format of each of its packed arguments: q (integer, address) or d."""
    entry = library.read_manifest()["kernels"][kernel]
    return {"symbol": entry["symbol"], "slots": "".join(map(library._write_struct_format, entry["arguments"]))}


def _describe_layout(kind: np.dtype[np.void], prefix: str = "", start: int = 0) -> dict[str, Any]:
    """Return the size of a record, and offset, type and length of each field by name."""
    fields: dict[str, Any] = {}
    for name, (field, offset, *_) in (kind.fields or {}).items():
        base, shape = field.subdtype or (field, ())
        if base.names:
            fields |= _describe_layout(base, f"{prefix}{name}.", start + offset)["fields"]
        else:
            fields[prefix + name] = [start + offset, base.str[1:], math.prod(shape)]
    return {"size": kind.itemsize, "fields": fields}


def _build_templates() -> dict[str, str]:
    """Return the bytes of records as the package prepares them, for the page to change: hexadecimal."""
    templates = {"state": _write_bytes(state.create_states(1, 0))}
    for model, scheme, is_recorded in product(MODELS, (Certified(), VelocityThreshold(1.0)), (False, True)):
        run = Setup(Block(width=0.4, height=2.0).as_bodies(), model, scheme).prepare(None, writes_tables=is_recorded)
        key = f"{model} {scheme.name}"
        templates[f"settings {key} {'record' if is_recorded else 'state'}"] = _write_bytes(run.settings)
        templates[f"block {key}"] = _write_bytes(run.structs)
    return templates


def _write_bytes(struct: state.Struct) -> str:
    """Write the bytes of a struct, with zeros between its fields."""
    copied = np.zeros(1, struct.dtype)
    for name in struct.dtype.names:
        copied[name] = struct[name]
    return copied.tobytes().hex()


def _list_codes(kind: type[IntEnum]) -> dict[str, int]:
    return {code.name: code.value for code in kind}


def _describe_pulse(motion: Motion) -> dict[str, Any]:
    """Return the pieces of a pulse of unit amplitude whose frequency is 1 Hz, or whose duration is 1 s."""
    return {
        "by": "frequency" if "frequency" in motion.description.parameters else "duration",
        "breaks": motion.breakpoints.tolist(),
        "rows": motion.coefficients.tolist(),
        "error": motion.error,
    }


def _describe_record(name: str) -> dict[str, Any]:
    """Return a shipped record: second differences of its integers, and the displacement to draw without its drift."""
    record, motion = info(name), load(name)
    unit = choose_unit(record.units)
    drawn = motion.processed(baseline=1, band_pass=(1.0 / MAX_DRAWN_PERIOD, None))
    displacement = drawn.displacement(np.arange(0.0, motion.duration, _DRAWN_STEP)) / _DRAWN_UNIT
    differences = np.diff(np.rint(displacement).astype(np.int64), prepend=0)
    return {
        "title": record.title,
        "step": record.dt,
        "differences": read_differences(record).tolist(),
        "denominator": record.denominator,
        "multiplier": unit.multiplier,
        "divisor": unit.divisor,
        "pga": motion.pga,
        "drawn": {"step": _DRAWN_STEP, "unit": _DRAWN_UNIT, "differences": differences.tolist()},
    }
