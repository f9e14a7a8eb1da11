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
from rocking.errors import BlockError, RockingError
from rocking.solid.mesh import Region, compute_properties
from rocking.solid.support import Sections, compute_sections

if TYPE_CHECKING:
    from rocking.solid.mesh import Mesh

#: Maximum number of triangles of a mesh; about six seconds of work.
MAX_TRIANGLES: Final = 500_000

#: Limits of the process: processor time, s, memory, bytes, and waiting time, s.
_MAX_TIME: Final = 20
_MAX_MEMORY: Final = 2 * 2**30
_MAX_WAIT: Final = 60.0

#: Libraries that would allocate memory for every processor.
_THREAD_COUNTS: Final = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

#: Arguments of `rocking.Solid`, and the sections of its outline.
SolidParts = tuple[dict[str, Any], Sections]


def read_mesh(mesh: Mesh, options: Mapping[str, Any]) -> SolidParts:
    """Read a mesh of up to `MAX_TRIANGLES` triangles with arguments of `rocking.Solid.from_mesh`."""
    arguments = {"density": None, "support": None, "tolerance": None, "up": None, "unit": "m", "turn": 0.0, **options}
    parts, surfaces = compute_properties(mesh, **arguments, max_faces=MAX_TRIANGLES)
    return parts, compute_sections(surfaces)


def read_mesh_in_process(name: str, data: bytes, options: Mapping[str, Any]) -> SolidParts:
    """Read the content of a file in a process with limited time and memory."""
    head = json.dumps({"name": name, "options": dict(options)}).encode()
    search_path = os.pathsep.join(path for path in sys.path if path)
    environment = {**os.environ, **dict.fromkeys(_THREAD_COUNTS, "1"), "PYTHONPATH": search_path}
    command, request = [sys.executable, "-P", "-m", __name__], head + b"\n" + data
    try:
        process = subprocess.run(
            command, input=request, capture_output=True, timeout=_MAX_WAIT, env=environment, check=True
        )
    except subprocess.SubprocessError:
        allowed = f"{_MAX_TIME} s or {_MAX_MEMORY // 2**30} GiB"
        sentence = f"takes more than {allowed} to read: make the mesh coarser, or use it in Python"
        raise BlockError(sentence, path=name) from None
    return decode_answer(process.stdout)


def decode_answer(output: str | bytes) -> SolidParts:
    """Decode the answer of the process."""
    answer = json.loads(output)
    if "error" in answer:
        kind, template, arguments, path = answer["error"]
        raise getattr(errors, kind)(template, *arguments, path=path)
    parts = answer["made"]
    arrays = {name: np.array(parts[name]) for name in ("support", "centre", "inertia_over_mass")}
    regions = [Region(*region) for region in parts["regions"]]
    hulls = tuple(np.array(corners) for corners in answer["hulls"])
    return {**parts, **arrays, "regions": regions}, Sections(np.array(answer["heights"]), hulls)


def answer_request(data: bytes) -> dict[str, Any]:
    """Decode the input from `read_mesh_in_process`, read the mesh, and return the result."""
    head, _, content = data.partition(b"\n")
    request = json.loads(head)
    stream = io.BytesIO(content)
    stream.name = request["name"]
    try:
        parts, sections = read_mesh(stream, request["options"])
    except RockingError as error:
        return {"error": [type(error).__name__, error.message.template, error.message.arguments, error.path]}
    plain = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in parts.items()}
    hulls = [np.round(corners, 6).tolist() for corners in sections.hulls]
    return {"made": plain, "heights": sections.heights.tolist(), "hulls": hulls}


def _limit_this_process() -> None:
    """Limit memory and time if the system can; otherwise only the waiting time is limited."""
    try:
        import resource
    except ImportError:  # Windows
        return
    for resource_kind, soft, hard in (
        (resource.RLIMIT_AS, _MAX_MEMORY, _MAX_MEMORY),
        (resource.RLIMIT_CPU, _MAX_TIME, _MAX_TIME + 1),
        (resource.RLIMIT_CORE, 0, 0),
    ):
        # A lower limit may be set already, and macOS rejects limits of memory.
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(resource_kind, (soft, hard))


if __name__ == "__main__":
    _limit_this_process()
    output, sys.stdout = sys.stdout, sys.stderr
    json.dump(answer_request(sys.stdin.buffer.read()), output)
