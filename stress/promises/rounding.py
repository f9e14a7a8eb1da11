"""Every operation of the compiled code is rounded for itself: no fused product and sum, no fast-math, in any kernel.

The program looks at LLVM's code of all kernels, and at the machine code that the build makes of it for each level of
processors.
"""

from __future__ import annotations

import runpy
import tempfile
from pathlib import Path
from typing import Final

from oracles.rounding import COMPILING, FUSED, PRODUCTS, RELAXED, optimised, translated

from promises.promise import ABOVE_ENSEMBLES, Found, Promise
from rocking.kernels.signatures import sample_arguments

#: Products that a kernel has at least, on an average: with fewer the program would look at something else.
_PRODUCTS: Final = 20


def judge(part: int) -> Found:
    """Look at the code of every kernel."""
    found = Found(parts=1)
    with tempfile.TemporaryDirectory() as name:
        middle = translated(Path(name))
        relaxed = RELAXED.findall(middle)
        if relaxed or middle.count("fmul double") < _PRODUCTS * len(sample_arguments()):
            found.fail(f"LLVM's code: {middle.count('fmul double')} products; relaxed: {sorted({*relaxed})[:5]}")
        for level in runpy.run_path(str(COMPILING / "libraries.py"))["LEVELS"]:
            _judge(found, f"the library for {level}", optimised(Path(name), level))
    return found


def _judge(found: Found, what: str, machine: str) -> None:
    kernels, products, fused = len(sample_arguments()), len(PRODUCTS.findall(machine)), FUSED.findall(machine)
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
    parts=1,
    small=1,
    judge=judge,
    table=table,
    above=ABOVE_ENSEMBLES,
)
