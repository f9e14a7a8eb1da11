"""Every operation of the compiled code is rounded for itself: no fused product and sum, no fast-math, in any kernel.

The first part looks at the code that numba makes of every kernel for this processor, and at LLVM's code before that.
The second makes the libraries that come with a wheel, for each level of processors, and looks at the files.
"""

from __future__ import annotations

import json
import runpy
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

from oracles.rounding import FUSED, PRODUCTS, RELAXED, compiled_here, of_library

from promises.promise import ABOVE_ENSEMBLES, Found, Promise
from rocking.kernels.signatures import signatures

#: Products that a kernel has at least, on an average: with fewer the program would look at something else.
_PRODUCTS: Final = 20

_SCRIPT: Final = Path(__file__).resolve().parents[2] / "scripts" / "ship_kernels.py"


def judge(part: int) -> Found:
    """Look at the code of every kernel: what numba compiles here, or the libraries."""
    found = Found(parts=1)
    if part == 0:
        machine, middle = compiled_here([*signatures()])
        _judge(found, "compiled by numba", machine)
        relaxed = RELAXED.findall(middle)
        if relaxed or middle.count("fmul double") < _PRODUCTS * len(signatures()):
            found.fail(f"LLVM's code: {middle.count('fmul double')} products; relaxed: {sorted({*relaxed})[:5]}")
        return found
    script = runpy.run_path(str(_SCRIPT))
    levels = script["LEVELS"][script["platform"].machine().lower()]
    with tempfile.TemporaryDirectory() as where:
        subprocess.run([sys.executable, str(_SCRIPT), "--out", where], check=True, stdout=subprocess.DEVNULL)
        libraries = json.loads(Path(where, "manifest.json").read_text("utf-8"))["libraries"]
        for level, library in zip(levels, libraries, strict=True):
            _judge(found, f"the library for {level}", of_library(Path(where, library)))
    return found


def _judge(found: Found, what: str, machine: str) -> None:
    kernels, products, fused = len(signatures()), len(PRODUCTS.findall(machine)), FUSED.findall(machine)
    found.cases += kernels
    found.judged += kernels
    found.notes[f"products, {what}"] += products
    if fused or products < _PRODUCTS * kernels:
        found.fail(f"{what}: {products} products, {len(fused)} fused ones, such as {sorted({*fused})[:5]}")


def table(found: Found) -> str:
    """Say how much code was looked at."""
    counts = ", ".join(f"{count} {name.partition(', ')[2]}" for name, count in found.notes.items())
    return f"Instructions that multiply: {counts}; none of them adds as well.\n"


PROMISE = Promise(
    name="rounding",
    says="every operation of the compiled code is rounded for itself",
    parts=2,
    small=1,
    judge=judge,
    table=table,
    above=ABOVE_ENSEMBLES,
)
