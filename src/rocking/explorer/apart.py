"""Read the mesh of an untrusted file in a separate process, with limited time and memory and no other input.

There are many mesh readers, and their behaviour with malicious files is unknown; however, a process can be killed.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking import errors
from rocking.errors import InvalidBlock, RockingError
from rocking.solid.mesh import Region, compute_properties
from rocking.solid.support import Sections, compute_sections

if TYPE_CHECKING:
    from rocking.solid.mesh import Mesh

#: Maximum number of triangles of a mesh; about six seconds of work.
MOST_TRIANGLES: Final = 500_000

#: Limits of the process: processor time, s, memory, bytes, and waiting time, s.
_SECONDS: Final = 20
_MEMORY: Final = 2 * 2**30
_PATIENCE: Final = 60.0

#: Libraries that would allocate memory for every processor.
_ONE_THREAD: Final = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

#: Arguments of `rocking.Solid`, and the sections of its outline.
Made = tuple[dict[str, Any], Sections]


def made_here(mesh: Mesh, options: Mapping[str, Any]) -> Made:
    """Read a mesh of up to `MOST_TRIANGLES` triangles with arguments of `rocking.Solid.from_mesh`."""
    given = {"density": None, "support": None, "tolerance": None, "up": None, "unit": "m", "turn": 0.0, **options}
    made, surfaces = compute_properties(mesh, **given, max_faces=MOST_TRIANGLES)
    return made, compute_sections(surfaces)


def made_apart(name: str, data: bytes, options: Mapping[str, Any]) -> Made:
    """Read the content of a file in a process with limited time and memory."""
    head = json.dumps({"name": name, "options": dict(options)}).encode()
    places = os.pathsep.join(each for each in sys.path if each)
    environment = {**os.environ, **dict.fromkeys(_ONE_THREAD, "1"), "PYTHONPATH": places}
    command, sent = [sys.executable, "-P", "-m", __name__], head + b"\n" + data
    try:
        done = subprocess.run(command, input=sent, capture_output=True, timeout=_PATIENCE, env=environment, check=True)
    except subprocess.SubprocessError:
        limits = f"{_SECONDS} s or {_MEMORY // 2**30} GiB"
        sentence = f"takes more than {limits} to read: make the mesh coarser, or use it in Python"
        raise InvalidBlock(sentence, path=name) from None
    return made_of(done.stdout)


def made_of(answer: str | bytes) -> Made:
    """Decode the answer of the process."""
    found = json.loads(answer)
    if "error" in found:
        kind, template, arguments, path = found["error"]
        raise getattr(errors, kind)(template, *arguments, path=path)
    made = found["made"]
    arrays = {each: np.array(made[each]) for each in ("support", "centre", "inertia_over_mass")}
    regions = [Region(*each) for each in made["regions"]]
    hulls = tuple(np.array(corners) for corners in found["hulls"])
    return {**made, **arrays, "regions": regions}, Sections(np.array(found["heights"]), hulls)


def answered(data: bytes) -> dict[str, Any]:
    """Decode the input from `made_apart`, read the mesh, and return the result."""
    head, _, content = data.partition(b"\n")
    asked = json.loads(head)
    stream = io.BytesIO(content)
    stream.name = asked["name"]
    try:
        made, sections = made_here(stream, asked["options"])
    except RockingError as error:
        return {"error": [type(error).__name__, error.message.template, error.message.arguments, error.path]}
    plain = {name: each.tolist() if isinstance(each, np.ndarray) else each for name, each in made.items()}
    hulls = [np.round(corners, 6).tolist() for corners in sections.hulls]
    return {"made": plain, "heights": sections.heights.tolist(), "hulls": hulls}


def _limit_this_process() -> None:
    """Limit memory and time if the system can; otherwise only the waiting time is limited."""
    try:
        import resource
    except ImportError:  # Windows
        return
    for kind, soft, hard in (
        (resource.RLIMIT_AS, _MEMORY, _MEMORY),
        (resource.RLIMIT_CPU, _SECONDS, _SECONDS + 1),
        (resource.RLIMIT_CORE, 0, 0),
    ):
        # A lower limit may be set already, and macOS rejects limits of memory.
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(kind, (soft, hard))


if __name__ == "__main__":
    _limit_this_process()
    out, sys.stdout = sys.stdout, sys.stderr
    json.dump(answered(sys.stdin.buffer.read()), out)
